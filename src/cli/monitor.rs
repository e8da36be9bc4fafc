//! `davit monitor`

use super::exit::Exit;
use super::input::{CommandInput, Parameters, is_deployment, unread};
use super::output::{self, Style, Table};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::check;
use crate::diagnostics::{SourceMap, to_json};
use crate::lang::{self, Sources};
use crate::limits::{SAMPLES_LINE, SAMPLES_WAKES};
use crate::model::codes::{
    CLI_UNKNOWN_MONITOR, SAMPLES_COLUMNS, SAMPLES_GAP, SAMPLES_MERGED, SAMPLES_MISSING, SAMPLES_NAN, SAMPLES_RENAMED,
    SAMPLES_UNREADABLE, SAMPLES_UNUSED,
};
use crate::model::finding::{and_also, did_you_mean, has_errors, nearest};
use crate::model::{Finding, Findings, Monitor, Origin, SampleText};
use crate::monitor::replay::{MonitorEvent, Replay, Tally};
use crate::monitor::table::{Columns, TableProblem, decimal, empty, is_blank};
use crate::time::Time;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;

/// Run monitors over recorded data: every event with its time and robustness, then how often and how long each
/// condition was true, and how near it came to the contrary.
///
/// The samples are comma-separated values: a first line with `time` (in seconds) and the signals as the monitors spell
/// them (`Dynamics.force[0]`, `state(Arm)`, `faulted(Arm)`, `activity(control.overruns)`), then a line for each time; an
/// empty cell is no new sample. With --json, one object a line: each event, then the table.
///
/// The monitors of a deployment are checked against it, as `davit check` does. What is found is told and refuses nothing: a
/// recording may be of another system.
///
/// Exit status: 0 done, whatever was raised; 1 findings; 2 a file is missing or does not parse.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A file of monitors, or a deployment that names some.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The recording; `-` is standard input.
    #[arg(long, value_name = "FILE")]
    samples: PathBuf,
    /// Look at this monitor only; may be given several times. Monitors that are not enabled run when they are named.
    #[arg(long = "only", value_name = "NAME")]
    only: Vec<String>,
    /// Take a signal from a column of another name.
    #[arg(long = "column", value_name = "SIGNAL=COLUMN")]
    columns: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    parameters: Parameters,
}

/// The monitors, and where they stand.
struct Found {
    monitors: Vec<Monitor>,
    findings: Findings,
    sources: SourceMap,
}

impl Args {
    fn monitors(&self, context: &CommandContext) -> Result<Found, CommandFailure> {
        let (monitors, findings, sources) = if is_deployment(&self.file) {
            let input = CommandInput { file: self.file.clone(), parameters: self.parameters.clone() };
            let read = input.read_but_for(context)?;
            // What a configuration's text lacks may be what a monitor watches.
            let wrong = check::monitors(&read.deployment, &read.catalogue, !has_errors(&read.findings));
            let findings = read.findings.into_iter().chain(wrong).collect();
            (read.deployment.monitors, findings, read.sources)
        } else {
            let loaded = lang::load_monitors(&Sources::Disk, &self.file, &self.parameters.options()?);
            if has_errors(&loaded.findings) {
                return Err(unread(loaded.findings, loaded.sources, loaded.unreadable));
            }
            (loaded.monitors, loaded.findings, loaded.sources)
        };
        let mut chosen = Vec::new();
        for name in &self.only {
            let Some(monitor) = monitors.iter().find(|m| m.name.as_str() == name) else {
                let known = monitors.iter().map(|m| m.name.as_str());
                let message = format!("there is no monitor `{name}` in {}", self.file.display());
                return Err(CommandFailure::no(CLI_UNKNOWN_MONITOR, message, did_you_mean(name, "monitors", known)));
            };
            chosen.push(Monitor { enabled: true, ..monitor.clone() });
        }
        if self.only.is_empty() {
            chosen = monitors;
        }
        Ok(Found { monitors: chosen, findings, sources })
    }

    fn renamed(&self) -> Result<Vec<(String, String)>, CommandFailure> {
        let one = |text: &String| match text.split_once('=') {
            Some((signal, column)) if !signal.is_empty() && !column.is_empty() => {
                Ok((signal.trim().to_owned(), column.trim().to_owned()))
            }
            _ => {
                let message = format!("`--column {text}` names no signal and its column");
                let help = "write `--column SIGNAL=COLUMN`, such as `--column Dynamics.f_raw_norm=u1`";
                Err(CommandFailure::usage(SAMPLES_COLUMNS, message, help))
            }
        };
        self.columns.iter().map(one).collect()
    }
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let renamed = self.renamed()?;
        let Found { monitors, mut findings, mut sources } = self.monitors(context)?;
        let name = self.samples.display().to_string();
        let unreadable = |error: &dyn std::fmt::Display| {
            let help = "name a text of comma-separated values, the first line with `time` and the signals";
            CommandFailure::usage(SAMPLES_UNREADABLE, format!("{name}: {error}"), help)
        };
        let input: Box<dyn Read> = if self.samples.as_os_str() == "-" {
            Box::new(std::io::stdin())
        } else {
            Box::new(std::fs::File::open(&self.samples).map_err(|error| unreadable(&error))?)
        };
        let mut lines = SampleLines { input: BufReader::new(input), number: 0, text: String::new() };
        // What is wrong with a line of the recording, shown with that line alone: the whole of it may be too large.
        let wrong = |sources: &mut SourceMap, lines: &SampleLines, problem: TableProblem| {
            let line = u32::try_from(lines.number).unwrap_or(u32::MAX).max(1);
            let text = lines.text.trim_start_matches('\u{feff}').trim_end_matches(['\r', '\n']);
            let file = sources.add_excerpt(name.as_str(), text, line);
            let origin = sources.exact(file, 1, problem.column, problem.length);
            Finding::error(problem.code, problem.message).at(origin).help(problem.help)
        };
        if !lines.next().map_err(|error| unreadable(&error))? || is_blank(&lines.text) {
            findings.push(wrong(&mut sources, &lines, empty(false)));
            return Err(CommandFailure::found(findings, sources));
        }
        let columns = match Columns::new(&lines.text) {
            Ok(columns) => columns,
            Err(problem) => {
                findings.push(wrong(&mut sources, &lines, problem));
                return Err(CommandFailure::found(findings, sources));
            }
        };
        let known: Vec<String> = columns.names().to_vec();
        let (mut replay, missing) = Replay::new(&monitors, columns, &renamed);
        let header = sources.add_excerpt(name.as_str(), lines.text.trim_end(), 1);
        let header = sources.whole_file(header);
        findings.extend(misnamed(&renamed, &replay, &known, |column| sources.within(header, column)));
        for input in &missing {
            let input = input.to_string();
            if renamed.iter().any(|(signal, _)| *signal == input) {
                continue; // said already
            }
            let near = did_you_mean(&input, "columns", known.iter().map(String::as_str));
            let meant = nearest(&input, known.iter().map(String::as_str));
            findings.push(
                Finding::error(SAMPLES_MISSING, format!("the recording has no column `{input}`"))
                    .at(meant.map_or(header, |column| sources.within(header, column)))
                    .help(and_also(&near, &format!("`--column {input}=NAME` takes it from a column of another name"))),
            );
        }
        let looked_past = replay.unused().first().map_or(header, |column| sources.within(header, column));
        let unused: Vec<String> = replay.unused().iter().map(|name| format!("`{name}`")).collect();
        if !unused.is_empty() {
            let more = unused.len().saturating_sub(8);
            let shown = unused[..unused.len() - more].join(", ");
            let and = if more > 0 { format!(" and {more} more") } else { String::new() };
            findings.push(
                Finding::info(SAMPLES_UNUSED, format!("no monitor looks at {shown}{and}"))
                    .at(looked_past)
                    .help("nothing needs to be done, unless one of them was meant to be looked at"),
            );
        }
        if !missing.is_empty() || findings.iter().any(|f| f.code == SAMPLES_RENAMED) {
            return Err(CommandFailure::found(findings, sources));
        }
        let mut raised = |raised: MonitorEvent| self.event(context, &monitors, raised);
        let mut problem = None;
        // An input may have no end.
        while !output::arrives_nowhere() && lines.next().map_err(|error| unreadable(&error))? {
            if is_blank(&lines.text) {
                continue;
            }
            if let Err(found) = replay.line(&lines.text, &mut raised) {
                problem = Some(wrong(&mut sources, &lines, found));
                break;
            }
        }
        if problem.is_none() && replay.lines() == 0 {
            problem = Some(wrong(&mut sources, &lines, empty(true)));
        }
        let ok = problem.is_none();
        findings.extend(problem);
        findings.extend(notes(&monitors, &replay));
        if self.json {
            context.out.json_line(&summary(&monitors, &replay, ok, &to_json(&findings, &sources)));
        } else {
            self.table(context, &monitors, &replay);
            context.out.findings(&findings, &sources);
        }
        Ok(if ok { Exit::Done } else { Exit::No })
    }
}

impl Args {
    fn event(&self, context: &CommandContext, monitors: &[Monitor], raised: MonitorEvent) {
        let monitor = &monitors[raised.monitor];
        if self.json {
            context.out.json_line(&json!({
                "time": raised.at.as_secs_f64(), "time_ns": raised.at.as_nanos(), "monitor": monitor.name,
                "event": raised.event, "robustness": finite(raised.robustness),
            }));
            return;
        }
        let out = &context.out;
        let style = if Some(raised.event) == monitor.raise { Style::Care } else { Style::Good };
        out.line(format!(
            "{:>14} s  {}  {} {}",
            decimal(raised.at),
            out.paint(style, raised.event),
            out.paint(Style::Dim, format!("{},", monitor.name)),
            out.paint(Style::Dim, format!("robustness {}", number(raised.robustness))),
        ));
    }

    fn table(&self, context: &CommandContext, monitors: &[Monitor], replay: &Replay) {
        let out = &context.out;
        let mut table = Table::new(0);
        let heads = ["monitor", "became true", "true for", "least robustness", "greatest"];
        table.row(heads.map(|head| out.paint(Style::Bold, head)));
        let at = |extreme: Option<(f64, Time)>| {
            extreme.map_or("–".to_owned(), |(v, at)| format!("{} at {} s", number(v), decimal(at)))
        };
        for (monitor, tally) in monitors.iter().zip(replay.tallies()) {
            let total = decimal(Time::default() + tally.total);
            let off = if monitor.enabled { "" } else { " (off)" };
            table.row([
                format!("{}{off}", out.paint(Style::Name, monitor.name)),
                tally.times.to_string(),
                format!("{total} s"),
                at(tally.least),
                at(tally.greatest),
            ]);
        }
        out.text(table.to_string());
    }
}

/// A number with as many digits as help.
fn number(v: f64) -> String {
    if v.is_infinite() {
        return if v > 0.0 { "∞".to_owned() } else { "-∞".to_owned() };
    }
    if v.abs() >= 1e16 {
        return SampleText(v).to_string();
    }
    let text = format!("{v:.6}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A number as JSON has it: none when it is infinite.
fn finite(v: f64) -> Value {
    if v.is_finite() { json!(v) } else { Value::Null }
}

fn summary(monitors: &[Monitor], replay: &Replay, ok: bool, findings: &Value) -> Value {
    let extreme = |e: Option<(f64, Time)>| {
        e.map_or(Value::Null, |(v, at)| json!({ "robustness": v, "time": at.as_secs_f64(), "time_ns": at.as_nanos() }))
    };
    let one = |(monitor, tally): (&Monitor, &Tally)| {
        json!({
            "monitor": monitor.name, "enabled": monitor.enabled, "became_true": tally.times,
            "true_for_s": tally.total.as_secs_f64(), "least": extreme(tally.least), "greatest": extreme(tally.greatest),
        })
    };
    let table: Vec<Value> = monitors.iter().zip(replay.tallies()).map(one).collect();
    json!({
        "ok": ok, "monitors": table, "lines": replay.lines(), "troubles": replay.troubles(), "findings": findings,
    })
}

/// What `--column` names that is not there: a signal that no monitor looks at, a column that the recording does not have.
fn misnamed(
    renamed: &[(String, String)],
    replay: &Replay,
    known: &[String],
    mut at: impl FnMut(&str) -> Origin,
) -> Findings {
    let mut findings = Vec::new();
    let signals = replay.signals();
    for (signal, column) in renamed {
        let option = format!("`--column {signal}={column}`");
        if !signals.contains(signal) {
            let near = did_you_mean(signal, "signals", signals.iter().map(String::as_str));
            let message = format!("{option}: no monitor looks at `{signal}`");
            findings.push(Finding::error(SAMPLES_RENAMED, message).help(near));
        } else if !known.contains(column) {
            let near = did_you_mean(column, "columns", known.iter().map(String::as_str));
            let message = format!("{option}: the recording has no column `{column}`");
            // Without one that is near: the header, in which it would be.
            let meant = nearest(column, known.iter().map(String::as_str)).unwrap_or_default();
            findings.push(Finding::error(SAMPLES_RENAMED, message).at(at(meant)).help(near));
        }
    }
    findings
}

/// What is worth saying of the recording as a whole.
fn notes(monitors: &[Monitor], replay: &Replay) -> Findings {
    let mut findings = Vec::new();
    let nan = replay.troubles().not_numbers;
    if nan > 0 {
        let first = replay.first_nan();
        let first = first.map(|(column, at)| format!(", the first in column `{column}` at {} s", decimal(at)));
        findings.push(
            Finding::warning(SAMPLES_NAN, format!("samples that are NaN: {nan}{}", first.unwrap_or_default()))
                .help("comparisons with them are false; look at what produced them"),
        );
    }
    let merged: Vec<String> = monitors
        .iter()
        .enumerate()
        .filter(|(i, _)| replay.merged(*i) > 0)
        .map(|(_, monitor)| format!("`{}`", monitor.name))
        .collect();
    if !merged.is_empty() {
        let message = format!("{}: more changes in a time than are remembered one by one", merged.join(", "));
        let help = "what lies within a thousandth of the time of each other counts as one; a shorter time needs less";
        findings.push(Finding::info(SAMPLES_MERGED, message).help(help));
    }
    if replay.jumped() {
        let message = format!("a gap between two lines is longer than {SAMPLES_WAKES} evaluations");
        let help = "the rest of it was passed in one step; look whether the times are in seconds";
        findings.push(Finding::warning(SAMPLES_GAP, message).help(help));
    }
    findings
}

/// Lines of bounded length.
struct SampleLines {
    input: BufReader<Box<dyn Read>>,
    number: u64,
    text: String,
}

impl SampleLines {
    /// Reads the next line; false at the end.
    fn next(&mut self) -> std::io::Result<bool> {
        self.text.clear();
        let read = (&mut self.input).take(SAMPLES_LINE as u64 + 1).read_line(&mut self.text)?;
        if read > SAMPLES_LINE {
            return Err(std::io::Error::other(format!("line {} is longer than {SAMPLES_LINE} bytes", self.number + 1)));
        }
        self.number += u64::from(read > 0);
        Ok(read > 0)
    }
}
