//! `davit sweep`

mod grid;
mod runs;

use super::exit::Exit;
use super::output::{self, Output, Style, Table};
use super::run::known;
use super::signals::SignalWatch;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::app::script::{beside, digits};
use crate::diagnostics::SourceMap;
use crate::lang::Sources;
use crate::limits;
use crate::model::codes::{SCRIPT_UNKNOWN_PARAMETER, TEXT_UNKNOWN_PARAMETER};
use crate::model::{Code, SampleText};
use grid::{GridAxis, axes, points};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use runs::{PointEnd, PointRun, Sweeping};
use serde_json::{Value as Json, json};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Run a script once for every combination of its parameters' values, several at a time, and show their figures as one table.
///
/// A script reads a parameter with `param("K", 150)`. Each run is a `davit run` of its own, on the simulated clock: one that fails
/// or hangs takes no other one with it. A row is a point, a column a figure; `!` marks a figure that is out of its bounds. Ctrl-C
/// ends the sweep and shows what there is so far.
///
/// Exit status: 0 every point is within its bounds; 1 one is not, failed, hung or was not run; 2 usage, a parameter that the
/// script does not read.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The script.
    script: PathBuf,
    /// Values of a parameter: a list (`K=70,150,300`) or a range (`delay=0:0.05:0.005`, from, to, step).
    #[arg(long = "set", value_name = "NAME=VALUES")]
    set: Vec<String>,
    /// How many runs at a time; by itself as many as there are processors.
    #[arg(long, short, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=limits::SWEEP_JOBS))]
    jobs: Option<u64>,
    /// How long each run may take, in seconds; then it counts as hung, and is ended.
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, value_parser = super::remote::seconds)]
    within: f64,
    /// Run the script's deployments on this platform of the program instead of the one they name.
    #[arg(long, value_name = "PLATFORM")]
    platform: Option<String>,
    /// Print the table as comma-separated values.
    #[arg(long, conflicts_with = "json")]
    csv: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let axes = axes(&self.set)?;
        if let Some(platform) = &self.platform {
            known(platform, &context.extensions)?;
        }
        if let Err(finding) = Sources::Disk.read(&self.script) {
            let failure = CommandFailure::found(vec![*finding], SourceMap::new());
            return Err(CommandFailure { exit: Exit::Usage, ..failure });
        }
        let points = points(&axes);
        let stop = Arc::new(AtomicBool::new(false));
        let watch = {
            let stop = stop.clone();
            SignalWatch::start(|| false, move |_| stop.store(true, Ordering::Relaxed), || false, || {})
                .map_err(super::deploy::unwatched)?
        };
        let sweeping = Sweeping {
            command: self.command(),
            jobs: self.jobs.map_or_else(cores, |jobs| usize::try_from(jobs).unwrap_or(1)),
            within: Duration::from_secs_f64(self.within),
            stop: stop.clone(),
        };
        let given: Vec<Vec<String>> = points.iter().map(|point| arguments(&axes, point)).collect();
        let bar = bar(points.len());
        let unknown: Mutex<Option<Json>> = Mutex::new(None);
        let runs = sweeping.all(&given, &|at, run| {
            bar.inc(1);
            bar.set_message(format!("{}: {}", given[at].join(" ").replace("--set ", ""), run.end.word()));
            if let Some(finding) = run.unknown_parameter() {
                // It is so in every point.
                crate::time::lock(&unknown).get_or_insert(finding.clone());
                stop.store(true, Ordering::Relaxed);
            }
        });
        bar.finish_and_clear();
        drop(watch);
        if let Some(finding) = crate::time::lock(&unknown).take() {
            return Err(unread(&finding));
        }
        let columns = columns(&runs);
        match (self.json, self.csv) {
            (true, _) => context.out.json(&self.view(&axes, &points, &runs)),
            (_, true) => context.out.text(csv(&axes, &points, &runs, &columns)),
            _ => show(&context.out, &axes, &points, &runs, &columns),
        }
        Ok(if runs.iter().all(|run| run.end == PointEnd::Ok) { Exit::Done } else { Exit::No })
    }
}

impl Args {
    /// What is run of each point, but for its parameters.
    fn command(&self) -> Vec<String> {
        let mut command: Vec<String> =
            ["--color", "never", "run", "--with-parent", "--clock", "simulated", "--quiet", "--json"]
                .map(str::to_owned)
                .to_vec();
        if let Some(platform) = &self.platform {
            command.extend(["--platform".to_owned(), platform.clone()]);
        }
        command.push(self.script.display().to_string());
        command
    }

    fn view(&self, axes: &[GridAxis], points: &[Vec<&str>], runs: &[PointRun]) -> Json {
        let one = |(point, run): (&Vec<&str>, &PointRun)| {
            let set: serde_json::Map<String, Json> =
                axes.iter().zip(point).map(|(axis, value)| (axis.name.clone(), json!(value))).collect();
            json!({
                "set": set, "end": run.end.word(), "why": run.why, "figures": run.figures, "findings": run.findings,
            })
        };
        let all: Vec<Json> = points.iter().zip(runs).map(one).collect();
        let ok = runs.iter().all(|run| run.end == PointEnd::Ok);
        json!({ "script": self.script.display().to_string(), "ok": ok, "points": all })
    }
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

fn arguments(axes: &[GridAxis], point: &[&str]) -> Vec<String> {
    let one = |(axis, value): (&GridAxis, &&str)| ["--set".to_owned(), format!("{}={value}", axis.name)];
    axes.iter().zip(point).flat_map(one).collect()
}

fn bar(points: usize) -> ProgressBar {
    let target = if output::is_terminal() { ProgressDrawTarget::stdout() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(points as u64), target);
    bar.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len}  {msg}").expect("a valid template"));
    bar
}

/// What the runs say of a parameter that nobody reads.
fn unread(finding: &Json) -> CommandFailure {
    let text = |key: &str| finding[key].as_str().unwrap_or_default().to_owned();
    let codes: [Code; 2] = [SCRIPT_UNKNOWN_PARAMETER, TEXT_UNKNOWN_PARAMETER];
    let code = codes.into_iter().find(|code| code.to_string() == text("code"));
    CommandFailure::usage(code.unwrap_or(SCRIPT_UNKNOWN_PARAMETER), text("message"), text("help"))
}

/// The figures of all runs, with their units, in the order in which they were told first.
fn columns(runs: &[PointRun]) -> Vec<(String, String)> {
    let mut columns: Vec<(String, String)> = Vec::new();
    for figure in runs.iter().flat_map(|run| &run.figures) {
        let name = figure["name"].as_str().unwrap_or_default();
        if columns.iter().all(|(known, _)| known != name) {
            columns.push((name.to_owned(), figure["unit"].as_str().unwrap_or_default().to_owned()));
        }
    }
    columns
}

fn figure<'r>(run: &'r PointRun, name: &str) -> Option<&'r Json> {
    run.figures.iter().find(|figure| figure["name"] == name)
}

fn show(out: &Output, axes: &[GridAxis], points: &[Vec<&str>], runs: &[PointRun], columns: &[(String, String)]) {
    let mut table = Table::new(0);
    let with_unit = |(name, unit): &(String, String)| match unit.is_empty() {
        true => name.clone(),
        false => format!("{name} ({unit})"),
    };
    let heads = axes.iter().map(|axis| axis.name.clone()).chain(columns.iter().map(with_unit)).chain([String::new()]);
    table.row(heads.map(|head| out.paint(Style::Bold, head)));
    for (point, run) in points.iter().zip(runs) {
        let mut row: Vec<String> = point.iter().map(|value| out.paint(Style::Name, value)).collect();
        row.extend(columns.iter().map(|(name, _)| match figure(run, name) {
            None => "–".to_owned(),
            Some(figure) => {
                let of = |key: &str| figure[key].as_f64();
                let shown =
                    |value| digits(if figure["ok"] == true { beside(value, of("min"), of("max")) } else { value });
                let value = of("value").map_or_else(|| "NaN".to_owned(), shown);
                if figure["ok"] == true { value } else { out.paint(Style::Bad, format!("{value} !")) }
            }
        }));
        let style = if run.end == PointEnd::Ok { Style::Good } else { Style::Bad };
        // What failed, and the first reason of it.
        let why = run.why.as_deref().map(|why| why.lines().take(2).map(str::trim).collect::<Vec<_>>().join("; "));
        row.push(out.paint(style, run.end.word()) + &why.map_or_else(String::new, |why| format!(": {why}")));
        table.row(row);
    }
    out.text(table.to_string());
    let ok = runs.iter().filter(|run| run.end == PointEnd::Ok).count();
    out.line(match runs.len() {
        1 if ok == 1 => "the one point is within its bounds".to_owned(),
        1 => "the one point is not within its bounds".to_owned(),
        all => format!("{ok} of {all} points are within their bounds"),
    });
}

fn csv(axes: &[GridAxis], points: &[Vec<&str>], runs: &[PointRun], columns: &[(String, String)]) -> String {
    let quoted = |text: &str| match text.contains([',', '"', '\n']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")),
        false => text.to_owned(),
    };
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let names = axes.iter().map(|axis| &axis.name).chain(columns.iter().map(|(name, _)| name));
    let mut text = line(names.map(|name| quoted(name)).chain(["end".to_owned()]).collect());
    for (point, run) in points.iter().zip(runs) {
        let values = columns.iter().map(|(name, _)| {
            figure(run, name)
                .and_then(|figure| figure["value"].as_f64())
                .map_or_else(String::new, |v| SampleText(v).to_string())
        });
        let end = [run.end.word().to_owned()];
        text += &line(point.iter().map(|value| quoted(value)).chain(values).chain(end).collect());
    }
    text
}
