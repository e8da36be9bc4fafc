//! `davit stack`

use super::exit::Exit;
use super::inside::{Hierarchy, is_within};
use super::output::{Output, Style, Table};
use super::remote::{ASK, OnlyWhich, ask};
use super::status::text;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::model::codes::CLI_NO_ANSWER;
use crate::model::finding::count;
use crate::model::names::folded_into;
use crate::session::Unanswered;
use serde_json::{Value as Json, json};

/// Show the applied configurations that can be undone, newest first.
///
/// With `--in`, frames of others that touch something of that subsystem stand below its own: they hold it. With `--depth`, the
/// frames of a subsystem that is folded are one line.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    #[command(flatten)]
    hierarchy: Hierarchy,
    /// Print JSON (newest last); with `--in` each frame with its `number` in the whole stack, and what others hold with `holds`.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let Hierarchy { inside, depth } = &self.hierarchy;
        let mut frames = match inside.is_some() || depth.is_some() {
            false => numbered(&ask(self.which.name(), "stack", &json!({}), ASK)?),
            true => {
                let status = ask(self.which.name(), "status", &json!({}), ASK)?;
                if status["stack"].is_null() {
                    return Err(CommandFailure::no(
                        CLI_NO_ANSWER,
                        Unanswered.to_string(),
                        "something may be under way that holds it up: `davit status` shows what is known",
                    ));
                }
                let frames = numbered(&status["stack"]);
                match inside.in_status(&status)? {
                    Some(region) => frames.iter().filter_map(|frame| region.in_stack(frame)).collect(),
                    None => frames,
                }
            }
        };
        if self.json {
            if !inside.is_some() {
                frames.iter_mut().filter_map(Json::as_object_mut).for_each(|frame| drop(frame.remove(NUMBER)));
            }
            out.json(&frames);
            return Ok(Exit::Done);
        }
        if frames.is_empty() {
            out.line(if inside.is_some() { "no frame belongs to it" } else { "the stack is empty" });
        }
        out.text(table(out, &frames, depth.unwrap_or(usize::MAX)).to_string());
        Ok(Exit::Done)
    }
}

/// Where the number of a frame is among those of the whole deployment, oldest first: what `davit undo --to` counts.
pub const NUMBER: &str = "number";

/// Frames with their numbers.
fn numbered(stack: &Json) -> Vec<Json> {
    let mut frames = stack.as_array().cloned().unwrap_or_default();
    frames.iter_mut().enumerate().for_each(|(at, frame)| frame[NUMBER] = json!(at + 1));
    frames
}

/// A line each, newest first; of a subsystem that is deeper than `depth` one for all that are in it, where its newest is.
fn table(out: &Output, frames: &[Json], depth: usize) -> Table {
    let mark = |is: bool, style, words: &str| if is { out.paint(style, words) } else { String::new() };
    let at = |frame: &Json| format!("at {:.3} s", frame["at"].as_f64().unwrap_or_default());
    let mut table = Table::new(0);
    let mut shown: Vec<&str> = Vec::new();
    for frame in frames.iter().rev() {
        let number = out.paint(Style::Dim, &frame[NUMBER]);
        if let Some(path) = folded_into(text(&frame["subsystem"]), depth) {
            if !shown.contains(&path) {
                shown.push(path);
                let inside: Vec<&Json> =
                    frames.iter().filter(|other| is_within(text(&other["subsystem"]), path)).collect();
                let marks =
                    ["partial", "lost"].into_iter().filter(|mark| inside.iter().any(|frame| frame[*mark] == true));
                table.row([
                    number,
                    out.paint(Style::Bold, path),
                    count(inside.len(), "frame"),
                    at(frame),
                    format!("newest {}", text(&frame["configuration"])),
                    out.paint(Style::Bad, marks.collect::<Vec<_>>().join(", ")),
                ]);
            }
            continue;
        }
        let parts = frame["parts"].as_u64().unwrap_or(1);
        table.row([
            number,
            out.paint(Style::Name, text(&frame["configuration"])),
            format!("by {}", text(&frame["by"])),
            at(frame),
            if parts > 1 { format!("{parts} squashed into one") } else { String::new() },
            mark(frame["floor"] == true, Style::Care, "floor: undo stops here"),
            mark(frame["partial"] == true, Style::Bad, "partial"),
            mark(frame["lost"] == true, Style::Bad, "lost"),
            mark(frame["unseen"] == true, Style::Dim, "not observed"),
            mark(frame["holds"] == true, Style::Care, "holds it"),
        ]);
    }
    table
}
