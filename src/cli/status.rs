//! `davit status`

use super::drift::listed;
use super::exit::Exit;
use super::output::{Output, Style, Table};
use super::remote::{ASK, ask};
use super::{Answer, Context, Run};
use crate::session::StoppingView;
use serde_json::{Value as Json, json};

/// Show a running deployment: its phase, the coordinator's states, components, faults.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The running deployment's name; not needed while only one runs.
    name: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let status =
            ask(self.name.as_deref(), "status", &json!({}), ASK).map_err(|failure| failure.as_json(self.json))?;
        if self.json {
            context.out.json(&status);
        } else {
            print(&context.out, &status);
        }
        Ok(if status["phase"] == "broken" { Exit::Broken } else { Exit::Done })
    }
}

/// The style of a phase or a run state.
pub fn state_style(state: &str) -> Style {
    match state {
        "running" | "up" => Style::Good,
        "broken" | "faulted" => Style::Bad,
        "stopped" | "deploying" | "shutting_down" => Style::Care,
        _ => Style::Dim,
    }
}

/// A text in a JSON view, empty where there is none.
pub fn text(json: &Json) -> &str {
    json.as_str().unwrap_or_default()
}

/// That a coordinator stands still in a function, and for how long.
fn in_function(out: &Output, seconds: Option<&Json>) -> String {
    let Some(seconds) = seconds.and_then(Json::as_f64) else { return String::new() };
    format!(", {}", out.paint(Style::Care, format!("in a function for {seconds:.0} s")))
}

fn print(out: &Output, status: &Json) {
    let phase = text(&status["phase"]);
    out.line(format!(
        "{}  {}  {:.3} s",
        out.paint(Style::Bold, text(&status["name"])),
        out.paint(state_style(phase), phase),
        status["at"].as_f64().unwrap_or_default()
    ));
    let active = status["coordinator"].as_array().and_then(|a| a.last()).map_or("(inactive)", |s| text(s));
    match status["coordinators"].as_object().filter(|all| all.len() > 1) {
        None => {
            let slow = status["slow"].as_object().and_then(|slow| slow.values().next());
            out.line(format!("coordinator  {}{}", out.paint(Style::Name, active), in_function(out, slow)));
        }
        Some(all) => {
            for (name, states) in all {
                let active = states.as_array().and_then(|a| a.last()).map_or("(inactive)", text);
                let slow = in_function(out, status["slow"].get(name));
                out.line(format!("coordinator  {name}: {}{slow}", out.paint(Style::Name, active)));
            }
        }
    }
    if let Ok(stopping) = serde_json::from_value::<StoppingView>(status["stopping"].clone()) {
        let held = if stopping.held {
            ": a safe configuration holds what is left, `davit shutdown --force` lets go"
        } else {
            ""
        };
        out.line(format!("stopping     {}{held}", stopping.stage.words()));
    }
    if let Some(outstanding) = status["outstanding"].as_array().filter(|a| !a.is_empty()) {
        let names: Vec<&str> = outstanding.iter().map(text).collect();
        out.line(format!("waiting for  {}", names.join(", ")));
    }
    if let Some(inside) = status["dropped"]["inside"].as_u64().filter(|inside| *inside > 0) {
        let word = out.paint(Style::Care, "dropped");
        out.line(format!("{word}      {inside} events that a coordinator sent to itself: too many at once"));
    }
    for (kind, what) in [("report", "lost"), ("outside", "from outside, refused")] {
        if let Some(count) = status["dropped"][kind].as_u64().filter(|count| *count > 0) {
            let word = out.paint(Style::Care, "dropped");
            out.line(format!("{word}      {count} events {what}: the coordinator does not keep up"));
        }
    }
    let empty = Vec::new();
    let stack = status["stack"].as_array().unwrap_or(&empty);
    out.line(format!(
        "stack        {} frames{}",
        stack.len(),
        match stack.last() {
            Some(top) => format!(", newest {}", text(&top["configuration"])),
            None => String::new(),
        }
    ));
    for (key, style, words) in
        [("lost", Style::Bad, "what it did or stands for is no longer so"), ("unseen", Style::Dim, "not observed here")]
    {
        for frame in stack.iter().filter(|frame| frame[key] == true) {
            out.line(format!("             {} {}", text(&frame["configuration"]), out.paint(style, words)));
        }
    }
    let mut table = Table::new(2);
    if let Some(components) = status["system"]["components"].as_object() {
        for (name, component) in components {
            let state = text(&component["state"]);
            table.row([
                out.paint(state_style(state), state),
                name.clone(),
                out.paint(Style::Dim, text(&component["type"])),
                out.paint(Style::Dim, text(&component["activity"])),
            ]);
        }
    }
    if !table.is_empty() {
        out.line(out.paint(Style::Bold, "components"));
        out.text(table.to_string());
    }
    let residual = status["residual"].as_array().unwrap_or(&empty);
    if !residual.is_empty() {
        out.line(out.paint(Style::Bad, "what remains of what broke it"));
        out.text(listed(residual));
    }
    for fault in status["faults"].as_array().unwrap_or(&empty) {
        out.line(format!(
            "{} {}: {}",
            out.paint(Style::Bad, "fault"),
            text(&fault["component"]),
            text(&fault["reason"])
        ));
    }
}
