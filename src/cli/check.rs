//! `davit check`

use super::budget::{CheckBudget, Following};
use super::exit::Exit;
use super::input::CommandInput;
use super::output::Style;
use super::{CommandContext, CommandFailure, CommandResult, Run, replay, write_output};
use crate::check::{self, CheckVerdict, Effort, Explored, Report, TraceStep, why_no_way};
use crate::diagnostics::{SourceMap, to_json};
use crate::limits::{CHECK_FRAMES, CHECK_LEFT, CHECK_PILED};
use crate::model::codes::{CLI_NO_FINDING, CLI_WHICH_COORDINATOR};
use crate::model::finding::count as plural;
use crate::model::{Deployment, Finding, Severity};
use serde_json::json;
use std::path::PathBuf;

/// Check everything that can be known before a deployment runs: names, types, units, limits, configurations, and the
/// coordinator through every order of events and answers.
///
/// What it comes to is *sound* (everything was followed, nothing found but notes), *sound as far as followed* (a bound was
/// hit, and which), *has warnings* or *refused*. Exit status: 0 nothing refuses it; 1 it is refused (with `--strict`: it is
/// not *sound*); 2 a file is missing or does not parse.
///
/// `--trace N` shows the shortest way to the N-th finding, and with `--as way.lua` writes a script that goes it:
/// `davit run way.lua --clock simulated --platform simulated`. With a name that ends in `.events` it writes what the
/// coordinator hears on that way, for `davit sim FILE --events way.events`.
///
/// Ctrl-C ends the following, and what was found so far is told (exit status 1); a second one ends the command.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    input: CommandInput,
    /// Print JSON: `ok`, `verdict`, `findings` (each with its `trace`), `explored`.
    #[arg(long)]
    json: bool,
    /// Exit with 1 for everything but *sound*.
    #[arg(long)]
    strict: bool,
    /// Show notes whole, not a line each.
    #[arg(long)]
    notes: bool,
    /// Follow the coordinators through at most so many transitions (`2000000`, `2M`), so many states (`500Kstates`), while the
    /// process takes up at most so much memory (`2GB`, `500MB`), or several of these (`20M,4GB`). With states alone there may be
    /// any number of transitions. Of coordinators that have nothing to do with each other each has as many.
    #[arg(long, value_name = "BUDGET", default_value_t)]
    budget: CheckBudget,
    /// Show the shortest way to the N-th finding, and nothing else.
    #[arg(long, value_name = "N", conflicts_with_all = ["json", "notes"])]
    trace: Option<usize>,
    /// With `--trace`: write a script to this file that goes that way on the simulated platform; to `NAME.events` what the
    /// coordinator hears on it, for `davit sim`.
    #[arg(long = "as", value_name = "SCRIPT", requires = "trace")]
    script: Option<PathBuf>,
    /// With `--as NAME.events`: which coordinator, of a deployment with several.
    #[arg(long, value_name = "NAME", requires = "script")]
    of: Option<String>,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let read = match self.input.read(context) {
            Ok(read) => read,
            Err(failure) if self.json => {
                let report = Report {
                    checked: None,
                    replayed: None,
                    traces: Vec::new(),
                    findings: failure.findings,
                    explored: Explored::default(),
                    left: Vec::new(),
                    verdict: CheckVerdict::Refused,
                };
                print_json(context, &report, &failure.sources, false);
                return Ok(failure.exit);
            }
            Err(failure) => {
                let exit = failure.exit;
                context.out.findings(&failure.findings, &failure.sources);
                count(context, &failure.findings);
                return Ok(exit);
            }
        };
        let following = Following::new(self.budget, self.json)?;
        let effort = Effort {
            transitions: self.budget.transitions,
            states: self.budget.states.unwrap_or(usize::MAX),
            goes_on: &|far| following.goes_on(far),
            ..Effort::default()
        };
        let mut report = check::run_with(read.deployment.clone(), &read.catalogue, effort);
        let interrupted = following.over();
        report.verdict = report.verdict.with(&read.findings);
        report.findings.extend(read.findings);
        report.traces.resize(report.findings.len(), Vec::new());
        sort(&mut report);
        let no = match report.verdict {
            CheckVerdict::Refused => true,
            CheckVerdict::Sound => false,
            CheckVerdict::Followed { .. } | CheckVerdict::Warnings => self.strict || interrupted,
        };
        let exit = if no { Exit::No } else { Exit::Done };
        if self.json {
            print_json(context, &report, &read.sources, interrupted);
            return Ok(exit);
        }
        let out = &context.out;
        if let Some(number) = self.trace {
            return self.way(context, &read.deployment, &report, number, exit);
        }
        let notes = report.findings.iter().position(|f| f.severity == Severity::Info).filter(|_| !self.notes);
        let (found, notes) = report.findings.split_at(notes.unwrap_or(report.findings.len()));
        out.findings(found, &read.sources);
        for (number, line) in (found.len() + 1..).zip(one_line_each(notes, &read.sources)) {
            out.error(format!("note {number}: {line}\n"));
        }
        if let Some((number, trace)) = first_trace(&report, self.notes) {
            out.error(format!("the way to finding {}, `{}`:\n", number + 1, report.findings[number].code));
            for line in trace {
                out.error(format!("  {line}\n"));
            }
            out.error("\n");
        }
        count(context, &report.findings);
        if !notes.is_empty() {
            out.error("`--notes` shows notes whole, `--trace N` the way to one\n");
        }
        let style = match report.verdict {
            CheckVerdict::Sound | CheckVerdict::Followed { .. } => Style::Good,
            CheckVerdict::Warnings => Style::Care,
            CheckVerdict::Refused => Style::Bad,
        };
        let (verdict, name) = (out.paint(style, report.verdict.text()), out.paint(Style::Bold, read.deployment.name));
        let explored = report.explored;
        let reach = match (explored.states, explored.complete) {
            (0, _) => String::new(),
            (1, true) => format!("; followed through its one state and {}", plural(explored.transitions, "transition")),
            (n, true) => {
                format!("; followed through all {n} states and {}", plural(explored.transitions, "transition"))
            }
            (n, false) => {
                let (states, transitions) = (plural(n, "state"), plural(explored.transitions, "transition"));
                format!("; followed through {states} and {transitions}, not all there are")
            }
        };
        let cut = if interrupted && no { ", interrupted" } else { "" };
        out.line(format!("{name}: {verdict}{cut}{reach}"));
        report.left.iter().for_each(|left| out.line(format!("  {left}")));
        for line in bounds(&explored, &read.deployment, self.budget) {
            out.line(out.paint(Style::Dim, format!("  {line}")));
        }
        Ok(exit)
    }
}

impl Args {
    /// The way to the N-th finding, counted from 1, shown or as a script.
    fn way(
        &self,
        context: &CommandContext,
        deployment: &Deployment,
        report: &Report,
        number: usize,
        exit: Exit,
    ) -> CommandResult {
        let found = number.checked_sub(1).and_then(|at| Some((report.findings.get(at)?, report.traces.get(at)?)));
        let Some((finding, trace)) = found else {
            let help = match report.findings.len() {
                0 => "there are none".to_owned(),
                there => format!("give one from 1 to {there}, as they are listed without `--trace`"),
            };
            return Err(CommandFailure::usage(CLI_NO_FINDING, format!("there is no finding {number}"), help));
        };
        let Some(to) = &self.script else { return Ok(show_way(context, finding, trace, exit)) };
        let file = std::fs::canonicalize(&self.input.file).unwrap_or_else(|_| self.input.file.clone());
        let alone = to.extension().is_some_and(|ending| ending == "events");
        let text = match alone {
            true => replay::events(finding, trace, self.alone(deployment)?),
            false => replay::script(&file, finding, trace),
        };
        let text = match text {
            Ok(text) => text,
            Err(why) => {
                context.out.error(format!("finding {number}: {why}\n"));
                return Ok(Exit::No);
            }
        };
        write_output(context, Some(to), &text)?;
        let of = self.of.iter().map(|of| format!(" --of {of}")).collect::<String>();
        context.out.line(match alone {
            true => format!("{}: davit sim {}{of} --events {0}", to.display(), self.input.file.display()),
            false => format!("{}: davit run {0} --clock simulated --platform simulated", to.display()),
        });
        Ok(exit)
    }

    /// Which coordinator is stepped alone; none: there is only one.
    fn alone(&self, deployment: &Deployment) -> Result<Option<&str>, CommandFailure> {
        let names: Vec<&str> = deployment.coordinators.iter().map(|c| c.name.as_str()).collect();
        let several = names.len() > 1;
        match self.of.as_deref() {
            Some(of) if names.contains(&of) => Ok(several.then_some(of)),
            None if !several => Ok(None),
            of => Err(CommandFailure::usage(
                CLI_WHICH_COORDINATOR,
                match of {
                    Some(of) => format!("there is no coordinator `{of}`"),
                    None => "the deployment has several coordinators, and each is stepped alone".to_owned(),
                },
                format!("say which one with `--of`: {}", names.join(", ")),
            )),
        }
    }
}

/// Errors come first, notes last, each with its way.
fn sort(report: &mut Report) {
    let (findings, traces) = (std::mem::take(&mut report.findings), std::mem::take(&mut report.traces));
    let mut all: Vec<_> = findings.into_iter().zip(traces).collect();
    all.sort_by_key(|(finding, _)| std::cmp::Reverse(finding.severity));
    (report.findings, report.traces) = all.into_iter().unzip();
}

fn show_way(context: &CommandContext, finding: &Finding, trace: &[TraceStep], exit: Exit) -> Exit {
    context.out.line(format!("{}: {}", finding.code, finding.message));
    if trace.is_empty() {
        context.out.line(format!("  {}", why_no_way(finding.code)));
    }
    trace.iter().for_each(|step| context.out.line(format!("  {step}")));
    exit
}

/// Findings in short: where and what.
fn one_line_each(findings: &[Finding], sources: &SourceMap) -> Vec<String> {
    let json = to_json(findings, sources);
    let line = |finding: &serde_json::Value| {
        let message = finding["message"].as_str().unwrap_or_default();
        match (finding["file"].as_str(), finding["line"].as_u64()) {
            (Some(file), Some(line)) => format!("{file}:{line}: {message}"),
            _ => message.to_owned(),
        }
    };
    json.as_array().into_iter().flatten().map(line).collect()
}

/// The way to the worst finding that has one, with its number; that to a note only with `notes`.
fn first_trace(report: &Report, notes: bool) -> Option<(usize, &[TraceStep])> {
    let traces = report.findings.iter().zip(&report.traces).enumerate();
    let shown = |finding: &Finding| notes || finding.severity != Severity::Info;
    let mut worth = traces.filter(|(_, (finding, trace))| shown(finding) && !trace.is_empty());
    worth.next().map(|(number, (_, trace))| (number, trace.as_slice()))
}

fn print_json(context: &CommandContext, report: &Report, sources: &SourceMap, interrupted: bool) {
    let mut findings = to_json(&report.findings, sources);
    if let Some(findings) = findings.as_array_mut() {
        for (finding, trace) in findings.iter_mut().zip(&report.traces) {
            finding["trace"] = json!(trace);
        }
    }
    let trace: Vec<String> =
        first_trace(report, true).map_or_else(Vec::new, |(_, trace)| trace.iter().map(ToString::to_string).collect());
    context.out.json(&json!({
        "ok": report.verdict != CheckVerdict::Refused && !(interrupted && report.verdict != CheckVerdict::Sound),
        "interrupted": interrupted,
        "verdict": report.verdict.word(),
        "left": report.left,
        "findings": findings,
        "explored": report.explored,
        "trace": trace,
    }));
}

/// How far the coordinators were followed, and what was left out.
fn bounds(explored: &Explored, deployment: &Deployment, budget: CheckBudget) -> Vec<String> {
    let mut lines = Vec::new();
    if explored.states == 0 {
        return lines;
    }
    lines.push(format!(
        "followed with at most {CHECK_FRAMES} frames of one configuration in force ({CHECK_LEFT} where undoing failed)"
    ));
    if deployment.coordinators.len() > 1 {
        lines.push(
            "followed with at most one event from outside before all coordinators have heard what came before"
                .to_owned(),
        );
    }
    if deployment.operator_applies().next().is_some() {
        lines.push("followed with at most 2 frames of an operator in force at once, or one that is safe".to_owned());
    }
    if explored.unfollowed > 0 {
        let rest = if explored.without_failure { ", all of them behind a request that failed" } else { "" };
        lines.push(format!(
            "{} states were met and not followed further{rest}: the budget is {}, and {CHECK_PILED} requests that wait",
            explored.unfollowed,
            budget.told()
        ));
    }
    lines
}

/// A line that counts the findings.
fn count(context: &CommandContext, findings: &[Finding]) {
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
