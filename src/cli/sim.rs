//! `davit sim`

use super::exit::Exit;
use super::input::{Parameters, coordinator};
use super::output::Style;
use super::{Answer, Context, Failure, Run};
use crate::model::codes::CLI_EVENTS_UNREADABLE;
use crate::statechart::{Chart, Sim, compile};
use std::io::{BufRead, BufReader, IsTerminal, Read};
use std::path::PathBuf;

/// Step a coordinator alone, interactively or from a file of events.
///
/// One line is one set of events, separated by blanks, queued in the order written and followed by one step; an empty
/// line queues nothing; the first line also enters the machine. A line `run` runs to idle; `advance 0.5` moves the clock
/// by half a second and does one step.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A coordinator's file, or a deployment that names one.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Lines of events from a file, or from standard input as `-`; without it, from the terminal.
    #[arg(long, value_name = "FILE")]
    events: Option<PathBuf>,
    /// Which coordinator, of a deployment with several.
    #[arg(long, value_name = "NAME")]
    of: Option<String>,
    /// Print one JSON object for each input line.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    parameters: Parameters,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let read = coordinator(&self.file, &self.parameters, self.of.as_deref()).map_err(|f| f.as_json(self.json))?;
        let (chart, mut findings) = compile(&read.chart);
        findings.splice(0..0, read.findings);
        let Some(chart) = chart else {
            return Err(Failure { findings, sources: read.sources, json: self.json, ..Failure::default() });
        };
        context.out.findings(&findings, &read.sources);
        let input: Box<dyn Read> = match &self.events {
            Some(path) if path.as_os_str() != "-" => Box::new(std::fs::File::open(path).map_err(|error| {
                Failure::usage(
                    CLI_EVENTS_UNREADABLE,
                    format!("{}: {error}", path.display()),
                    "each line of the file is a set of events, `run`, or `advance SECONDS`; `-` is standard input",
                )
                .as_json(self.json)
            })?),
            _ => Box::new(std::io::stdin()),
        };
        let prompt = self.events.is_none() && std::io::stdin().is_terminal() && !self.json;
        self.lines(context, &chart, input, prompt)
    }
}

impl Args {
    fn lines(&self, context: &Context, chart: &Chart, input: Box<dyn Read>, prompt: bool) -> Answer {
        let out = &context.out;
        let mut sim = Sim::new(chart);
        if prompt {
            out.line("a line is a set of events; `run`; `advance SECONDS`; end with Ctrl-D");
        }
        let mut exit = Exit::Done;
        let mut lines = BufReader::new(input).lines();
        loop {
            if prompt {
                self.offer(context, chart, &sim);
                out.text("> ");
            }
            let line = match lines.next() {
                None => break,
                Some(Ok(line)) => line,
                Some(Err(error)) => {
                    return Err(Failure::usage(
                        CLI_EVENTS_UNREADABLE,
                        format!("the events cannot be read: {error}"),
                        "each line is a set of events, `run`, or `advance SECONDS`, as UTF-8 text",
                    )
                    .as_json(self.json));
                }
            };
            match sim.line(&line) {
                Ok(seen) if self.json => {
                    for note in &seen.notes {
                        out.error(format!("note: {note}\n"));
                    }
                    out.json_line(&seen);
                }
                Ok(seen) => {
                    if !prompt {
                        out.line(out.paint(Style::Dim, format!("> {line}")));
                    }
                    out.line(seen);
                }
                Err(error) => {
                    out.error(format!("{error}\n"));
                    if !prompt {
                        exit = Exit::Usage;
                    }
                }
            }
        }
        Ok(exit)
    }

    /// The events that lead on from where the machine is.
    fn offer(&self, context: &Context, chart: &Chart, sim: &Sim) {
        let mut events: Vec<String> = Vec::new();
        for state in sim.machine().active() {
            for edge in chart.outgoing(*state) {
                events.extend(chart.triggers(edge).unwrap_or(&[]).iter().map(|e| chart.event_text(*e)));
            }
        }
        events.sort();
        events.dedup();
        if !events.is_empty() {
            context.out.line(context.out.paint(Style::Dim, format!("heard here: {}", events.join(" "))));
        }
    }
}
