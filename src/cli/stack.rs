//! `davit stack`

use super::exit::Exit;
use super::output::{Style, Table};
use super::remote::{ASK, ask};
use super::status::text;
use super::{Answer, Context, Run};
use serde_json::{Value as Json, json};

/// Show the applied configurations that can be undone, newest first.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The running deployment's name; not needed while only one runs.
    name: Option<String>,
    /// Show the steps of every frame.
    #[arg(long)]
    steps: bool,
    /// Print JSON (newest last).
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let out = &context.out;
        let stack = ask(self.name.as_deref(), "stack", &json!({}), ASK)?;
        if self.json {
            out.json(&stack);
            return Ok(Exit::Done);
        }
        let frames = stack.as_array().cloned().unwrap_or_default();
        if frames.is_empty() {
            out.line("the stack is empty");
        }
        let mut table = Table::new(0);
        for (i, frame) in frames.iter().enumerate().rev() {
            let steps = frame["steps"].as_array().map_or(0, Vec::len);
            table.row([
                out.paint(Style::Dim, i + 1),
                out.paint(Style::Name, text(&frame["configuration"])),
                format!("{steps} step{}", if steps == 1 { "" } else { "s" }),
                format!("by {}", text(&frame["by"])),
                format!("at {:.3} s", frame["at"].as_f64().unwrap_or_default()),
                frame["group"].as_str().map(|g| format!("group {g}")).unwrap_or_default(),
                frame["floor"].as_str().map(|f| out.paint(Style::Care, format!("floor: {f}"))).unwrap_or_default(),
            ]);
        }
        if !self.steps {
            out.text(table.to_string());
            return Ok(Exit::Done);
        }
        for (row, frame) in table.to_string().lines().zip(frames.iter().rev()) {
            out.line(row);
            for step in frame["steps"].as_array().into_iter().flatten().filter_map(Json::as_str) {
                out.line(format!("     {step}"));
            }
        }
        Ok(Exit::Done)
    }
}
