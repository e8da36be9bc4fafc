//! `davit sim`

use super::exit::Exit;
use super::input::{Parameters, coordinator};
use super::inside::Inside;
use super::output::{self, Style};
use super::sim_editor::edit;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::functions::Opener;
use crate::limits::{SIM_BYTES, SIM_LINE};
use crate::model::Ident;
use crate::model::codes::{CLI_EVENTS_UNREADABLE, FUNCTIONS_NOT_OPENED};
use crate::statechart::{Hook, Observation, Sim, compile};
use serde_json::{Value as Json, json};
use std::io::{self, BufRead, BufReader, IsTerminal, Read};
use std::path::PathBuf;
use std::sync::Arc;

/// Step a coordinator alone, interactively or from a file of events.
///
/// A Lua file given here may have functions: it is trusted, with files and processes closed to it. What they print and
/// what goes wrong in them is shown as notes, between the entries and exits where it happened; with --json also in `notes`,
/// each with the number of actions before it.
///
/// One line is one set of events, separated by blanks, queued in the order written and followed by one step; an empty
/// line queues nothing. The first line enters the machine, and events on it are lost with that step, as rFSM has it: begin with
/// `run` or an empty line. A line `run` runs to idle; `advance 0.5` moves the clock
/// by half a second and does one step. At a terminal: Tab completes, `undo` takes lines back, `help` lists the rest.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// A coordinator's file, or a deployment that names one.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Lines of events from a file, or from standard input as `-`; without it, from the terminal.
    #[arg(long, value_name = "FILE")]
    events: Option<PathBuf>,
    #[command(flatten)]
    inside: Inside,
    /// Which coordinator, of a deployment with several (with `--in`, as it is called there).
    #[arg(long, value_name = "NAME")]
    of: Option<String>,
    /// Print one JSON object for each input line.
    #[arg(long)]
    json: bool,
    /// Stand in for the host of a coordinator with functions: run this Lua file before it. May be given again.
    #[arg(long, value_name = "FILE")]
    host: Vec<PathBuf>,
    #[command(flatten)]
    parameters: Parameters,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let read = coordinator(&self.file, &self.parameters, &self.inside, self.of.as_deref(), &self.host)?;
        let (chart, mut findings) = compile(&read.chart);
        findings.splice(0..0, read.findings);
        let Some(chart) = chart else {
            return Err(CommandFailure::found(findings, read.sources));
        };
        context.out.findings(&findings, &read.sources);
        let input: Box<dyn Read> = match &self.events {
            Some(path) if path.as_os_str() != "-" => Box::new(std::fs::File::open(path).map_err(|error| {
                CommandFailure::usage(
                    CLI_EVENTS_UNREADABLE,
                    format!("{}: {error}", path.display()),
                    "each line of the file is a set of events, `run`, or `advance SECONDS`; `-` is standard input",
                )
            })?),
            _ => Box::new(std::io::stdin()),
        };
        let prompt = self.events.is_none() && std::io::stdin().is_terminal() && !self.json;
        match read.program {
            None if prompt => edit(context, || Ok(Sim::new(&chart))),
            None => self.lines(context, Sim::new(&chart), input),
            Some(program) => {
                let names = read.path.split('/').filter_map(|name| Ident::new(name).ok());
                let path = names.reduce(|outer, inner| inner.within(outer));
                let opener = Opener::new(program, Arc::new(read.chart)).within(path);
                if prompt {
                    let open =
                        || opener.open(None).map_err(|failure| format!("the functions cannot be run: {failure}"));
                    return edit(context, || Ok(Sim::with(&chart, open()?)));
                }
                let functions = opener.open(None).map_err(|failure| {
                    CommandFailure::usage(
                        FUNCTIONS_NOT_OPENED,
                        format!("the functions cannot be run: {failure}"),
                        "the text ran when it was read: does it depend on time or chance?",
                    )
                })?;
                self.lines(context, Sim::with(&chart, functions), input)
            }
        }
    }
}

/// A line's JSON, with its notes where there are some: `{"after": 2, "text": "…"}`, after how many of its actions.
fn with_notes(seen: &Observation) -> Json {
    let mut json = serde_json::to_value(seen).expect("plain data");
    if !seen.notes.is_empty() {
        let notes = seen.notes.iter().zip(&seen.notes_after);
        json["notes"] = notes.map(|(text, after)| json!({ "after": after, "text": text })).collect();
    }
    json
}

impl Args {
    fn lines<F: Hook>(&self, context: &CommandContext, mut sim: Sim<'_, F>, input: Box<dyn Read>) -> CommandResult {
        let out = &context.out;
        let mut exit = Exit::Done;
        // An input may have no end.
        let mut lines = SimLines { input: BufReader::new(input), left: SIM_BYTES };
        while !output::arrives_nowhere() {
            let line = match lines.next() {
                Ok(None) => break,
                Ok(Some(line)) => line,
                Err(error) => {
                    return Err(CommandFailure::usage(
                        CLI_EVENTS_UNREADABLE,
                        format!("the events cannot be read: {error}"),
                        "each line is a set of events, `run`, or `advance SECONDS`, as UTF-8 text",
                    ));
                }
            };
            match sim.line(&line) {
                Ok(seen) if self.json => {
                    for note in &seen.notes {
                        out.error(format!("note: {note}\n"));
                    }
                    out.json_line(&with_notes(&seen));
                }
                Ok(seen) => {
                    out.line(out.paint(Style::Dim, format!("> {line}")));
                    out.line(seen);
                }
                Err(error) => {
                    out.error(format!("{error}\n"));
                    exit = Exit::Usage;
                }
            }
        }
        Ok(exit)
    }
}

/// Lines of a text that may have no end.
struct SimLines {
    input: BufReader<Box<dyn Read>>,
    left: u64,
}

impl SimLines {
    fn next(&mut self) -> io::Result<Option<String>> {
        let mut line = Vec::new();
        let read = (&mut self.input).take(SIM_LINE as u64 + 1).read_until(b'\n', &mut line)?;
        let Some(left) = self.left.checked_sub(read as u64) else {
            return Err(io::Error::other(format!("more than {} MB of them", SIM_BYTES / 1024 / 1024)));
        };
        self.left = left;
        if line.pop_if(|last| *last == b'\n').is_some() {
            line.pop_if(|last| *last == b'\r');
        } else if line.len() > SIM_LINE {
            return Err(io::Error::other(format!("a line is longer than {SIM_LINE} bytes")));
        }
        let text = String::from_utf8(line).map_err(|_| io::Error::other("a line is not UTF-8"))?;
        Ok((read > 0).then_some(text))
    }
}
