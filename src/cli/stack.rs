//! `davit stack`

use super::exit::Exit;
use super::output::{Style, Table};
use super::remote::{ASK, ask};
use super::status::text;
use super::{CommandContext, CommandResult, Run};
use serde_json::json;

/// Show the applied configurations that can be undone, newest first.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The running deployment's name; not needed while only one runs.
    #[arg(value_parser = super::remote::deployment_name)]
    name: Option<String>,
    /// Print JSON (newest last).
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let stack =
            ask(self.name.as_deref(), "stack", &json!({}), ASK).map_err(|failure| failure.in_json(self.json))?;
        if self.json {
            out.json(&stack);
            return Ok(Exit::Done);
        }
        let frames = stack.as_array().cloned().unwrap_or_default();
        if frames.is_empty() {
            out.line("the stack is empty");
        }
        let mark = |is: bool, style, words: &str| if is { out.paint(style, words) } else { String::new() };
        let mut table = Table::new(0);
        for (i, frame) in frames.iter().enumerate().rev() {
            let parts = frame["parts"].as_u64().unwrap_or(1);
            table.row([
                out.paint(Style::Dim, i + 1),
                out.paint(Style::Name, text(&frame["configuration"])),
                format!("by {}", text(&frame["by"])),
                format!("at {:.3} s", frame["at"].as_f64().unwrap_or_default()),
                if parts > 1 { format!("{parts} squashed into one") } else { String::new() },
                mark(frame["floor"] == true, Style::Care, "floor: undo stops here"),
                mark(frame["partial"] == true, Style::Bad, "partial"),
                mark(frame["lost"] == true, Style::Bad, "lost"),
                mark(frame["unseen"] == true, Style::Dim, "not observed"),
            ]);
        }
        out.text(table.to_string());
        Ok(Exit::Done)
    }
}
