//! `davit status`

use super::drift::listed;
use super::exit::Exit;
use super::kept::{self, Died};
use super::list::{Overview, of_phase, silent};
use super::output::{Output, Style, Table};
use super::remote::{ASK, failure};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::model::finding::count;
use crate::session::client::{Client, ClientError};
use crate::session::kept::Life;
use crate::session::{StoppingView, Unanswered};
use serde_json::{Value as Json, json};

/// Show a running deployment: its phase, the coordinator's states, components, faults. Of one that died: when, and how far it
/// was. Of several, where none is named: a line each, as `davit list`.
///
/// Exit status: 0 it runs; 1 none runs; 3 it is broken; 4 it died: killed, crashed or cut off, and was not shut down, or its record is
/// damaged, so that nobody knows. Of several the
/// first of 3, 4, 1 and 0 that is so of one of them; without a name also one that died beside the one that runs counts.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The deployments' names; not needed while only one runs.
    #[arg(value_name = "NAME", value_parser = super::remote::deployment_name)]
    names: Vec<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let refused = |error| Err(failure(error).in_json(self.json));
        match &self.names[..] {
            [] => match look(None) {
                Ok(SeenStatus::Runs(status)) => {
                    // Who runs has died before, if ever.
                    let own = status["name"].as_str().unwrap_or_default().to_owned();
                    let mut exit = show(out, &[SeenStatus::Runs(status)], self.json);
                    for died in kept::died().iter().filter(|died| died.name() != own) {
                        out.error(format!("note: {}\n", died.sentence()));
                        exit = Exit::worst([exit, kept::EXIT]);
                    }
                    Ok(exit)
                }
                Ok(died) => Ok(show(out, &[died], self.json)),
                Err(ClientError::Several(_)) => {
                    let overview = Overview::look();
                    overview.show(out, self.json);
                    Ok(overview.exit())
                }
                Err(error) => refused(error),
            },
            [name] => look(Some(name)).map_or_else(refused, |seen| Ok(show(out, &[seen], self.json))),
            names => {
                let seen = |name: &String| {
                    look(Some(name)).unwrap_or_else(|error| SeenStatus::Not(name.clone(), failure(error)))
                };
                let seen: Vec<SeenStatus> = names.iter().map(seen).collect();
                Ok(show(out, &seen, self.json))
            }
        }
    }
}

/// What is seen of a deployment.
enum SeenStatus {
    Runs(Json),
    Died(Box<Died>),
    /// It is not seen, and why; one of several.
    Not(String, CommandFailure),
}

impl SeenStatus {
    fn json(&self) -> Json {
        match self {
            Self::Runs(status) => status.clone(),
            Self::Died(died) => died.json(),
            Self::Not(name, why) => silent(name, &why.message()),
        }
    }

    fn print(&self, out: &Output) {
        match self {
            Self::Runs(status) => print(out, status),
            Self::Died(died) => died.print(out),
            Self::Not(name, why) => {
                let message = why.message();
                out.line(format!("{}  {}  {message}", out.paint(Style::Bold, name), out.paint(Style::Dim, "not seen")));
            }
        }
    }

    fn exit(&self) -> Exit {
        match self {
            Self::Runs(status) => of_phase(&status["phase"]),
            Self::Died(_) => kept::EXIT,
            Self::Not(_, why) => why.exit,
        }
    }
}

fn look(name: Option<&str>) -> Result<SeenStatus, ClientError> {
    let asked = Client::connect(name).and_then(|mut client| client.call("status", &json!({}), ASK));
    asked.map(SeenStatus::Runs).or_else(|error| {
        let died = match error {
            ClientError::None => kept::died().into_iter().max_by(|a, b| a.seen().0.total_cmp(&b.seen().0)),
            _ => kept::meant(&error).filter(Life::is_open).map(Died::of),
        };
        died.map(|died| SeenStatus::Died(Box::new(died))).ok_or(error)
    })
}

/// One as it is, several below each other or as an array.
fn show(out: &Output, seen: &[SeenStatus], json: bool) -> Exit {
    match seen {
        [only] if json => out.json(&only.json()),
        all if json => out.json(&all.iter().map(SeenStatus::json).collect::<Vec<_>>()),
        all => {
            for (i, seen) in all.iter().enumerate() {
                if i > 0 {
                    out.line("");
                }
                seen.print(out);
            }
        }
    }
    Exit::worst(seen.iter().map(SeenStatus::exit))
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
        let still = stopping.stands_still().map(|still| format!(": stands still, {still}")).unwrap_or_default();
        out.line(format!("stopping     {}{still}", stopping.stage.words()));
    }
    if let Some(outstanding) = status["outstanding"].as_array().filter(|a| !a.is_empty()) {
        let names: Vec<&str> = outstanding.iter().map(text).collect();
        out.line(format!("waiting for  {}", names.join(", ")));
    }
    if let Some(inside) = status["dropped"]["inside"].as_u64().filter(|inside| *inside > 0) {
        let word = out.paint(Style::Care, "dropped");
        out.line(format!("{word}      {} that a coordinator sent to itself: too many at once", count(inside, "event")));
    }
    for (kind, what) in [("report", "lost"), ("outside", "from outside, refused")] {
        if let Some(dropped) = status["dropped"][kind].as_u64().filter(|dropped| *dropped > 0) {
            let word = out.paint(Style::Care, "dropped");
            out.line(format!("{word}      {} {what}: the coordinator does not keep up", count(dropped, "event")));
        }
    }
    let empty = Vec::new();
    let Some(stack) = status["stack"].as_array() else {
        out.line(format!("stack        {}", out.paint(Style::Bad, not_known())));
        out.line(format!("components   {}", out.paint(Style::Bad, not_known())));
        faults(out, status);
        return;
    };
    out.line(format!(
        "stack        {}{}",
        count(stack.len(), "frame"),
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
    faults(out, status);
}

/// What only the configurator knows, where it has not answered.
pub fn not_known() -> String {
    format!("not known: {Unanswered}")
}

fn faults(out: &Output, status: &Json) {
    for fault in status["faults"].as_array().into_iter().flatten() {
        out.line(format!(
            "{} {}: {}",
            out.paint(Style::Bad, "fault"),
            text(&fault["component"]),
            text(&fault["reason"])
        ));
    }
}
