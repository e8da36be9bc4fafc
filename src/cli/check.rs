//! `davit check`

use super::exit::Exit;
use super::input::Input;
use super::output::Style;
use super::{Answer, Context, Run};
use crate::check::{self, Explored};
use crate::diagnostics::{SourceMap, to_json};
use crate::limits::{CHECK_FRAMES, CHECK_LEFT, CHECK_PILED, CHECK_TOGETHER, CHECK_TRANSITIONS, CHECK_WAITING};
use crate::model::{Finding, Severity, finding};
use serde_json::json;

/// Check everything that can be known before a deployment runs: names, types, units, limits, configurations, and the
/// coordinator through every order of events and answers.
///
/// Exit status: 0 nothing refuses it (warnings do not); 1 findings; 2 a file is missing or does not parse.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    input: Input,
    /// Print JSON: `ok`, `findings`, `explored`, `trace`.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let read = match self.input.read(context) {
            Ok(read) => read,
            Err(failure) if self.json => {
                print_json(context, false, &failure.findings, &failure.sources, Explored::default(), &[]);
                return Ok(failure.exit);
            }
            Err(failure) => {
                let exit = failure.exit;
                context.out.findings(&failure.findings, &failure.sources);
                count(context, &failure.findings);
                return Ok(exit);
            }
        };
        let report = check::run(read.deployment.clone(), &read.catalogue);
        let findings: Vec<Finding> = report.findings.into_iter().chain(read.findings).collect();
        let ok = !finding::has_errors(&findings);
        let exit = if ok { Exit::Done } else { Exit::No };
        if self.json {
            print_json(context, ok, &findings, &read.sources, report.explored, &report.trace);
            return Ok(exit);
        }
        let out = &context.out;
        out.findings(&findings, &read.sources);
        if !report.trace.is_empty() {
            out.error("the way to the first of these that has one:\n");
            for line in &report.trace {
                out.error(format!("  {line}\n"));
            }
            out.error("\n");
        }
        count(context, &findings);
        let verdict = if ok { out.paint(Style::Good, "sound") } else { out.paint(Style::Bad, "refused") };
        let name = out.paint(Style::Bold, read.deployment.name);
        let explored = report.explored;
        let reach = match (explored.states, explored.complete) {
            (0, _) => String::new(),
            (n, true) => format!("; followed through all {n} states and {} transitions", explored.transitions),
            (n, false) => {
                format!("; followed through {n} states and {} transitions, not all there are", explored.transitions)
            }
        };
        out.line(format!("{name}: {verdict}{reach}"));
        for line in bounds(&explored) {
            out.line(out.paint(Style::Dim, format!("  {line}")));
        }
        Ok(exit)
    }
}

fn print_json(
    context: &Context,
    ok: bool,
    findings: &[Finding],
    sources: &SourceMap,
    explored: Explored,
    trace: &[String],
) {
    context.out.json(&json!({
        "ok": ok,
        "findings": to_json(findings, sources),
        "explored": explored,
        "trace": trace,
    }));
}

/// How far the coordinators were followed, and what was left out.
fn bounds(explored: &Explored) -> Vec<String> {
    let mut lines = Vec::new();
    if explored.states == 0 {
        return lines;
    }
    lines.push(format!(
        "at most {CHECK_WAITING} requests wait at once, and {CHECK_FRAMES} frames of one configuration are in force \
         ({CHECK_LEFT} where undoing failed)"
    ));
    match explored.together {
        Some(true) => lines.push("the coordinators were followed one by one and together".to_owned()),
        Some(false) => lines.push(format!(
            "the coordinators were followed one by one: only up to {CHECK_TOGETHER} without functions are followed \
             together, and within the budget"
        )),
        None => {}
    }
    if explored.unfollowed > 0 {
        let rest = if explored.without_failure { ", all of them behind a request that failed" } else { "" };
        lines.push(format!(
            "{} states were met and not followed further{rest}: the budget is {CHECK_TRANSITIONS} transitions, and \
             {CHECK_PILED} requests that wait",
            explored.unfollowed
        ));
    }
    lines
}

/// A line that counts the findings.
fn count(context: &Context, findings: &[Finding]) {
    let of = |severity| findings.iter().filter(|f| f.severity == severity).count();
    let mut parts = Vec::new();
    for (severity, word) in [(Severity::Error, "error"), (Severity::Warning, "warning"), (Severity::Info, "note")] {
        match of(severity) {
            0 => {}
            1 => parts.push(format!("1 {word}")),
            n => parts.push(format!("{n} {word}s")),
        }
    }
    if !parts.is_empty() {
        context.out.error(format!("{}\n", parts.join(", ")));
    }
}
