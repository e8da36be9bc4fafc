//! `davit shutdown`

use super::exit::Exit;
use super::output::{Output, Style};
use super::remote::{ASK, OnlyWhich, Patience, WITHIN, connect, failure, seconds};
use super::status::text;
use super::{CommandContext, CommandResult, Run};
use crate::limits;
use crate::session::StoppingView;
use crate::session::client::Client;
use crate::time::Clock;
use serde_json::{Value as Json, json};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Drive a running deployment to its *down* state; nothing is left.
///
/// The coordinator leads down; where it does not, what is in force is taken back, then everything is removed by force. Asked
/// again, the coordinator is told again; with `--force` the rest is done by force at once. Exit status: 0 its coordinator has led
/// down; 1 it is not down yet, or nobody answers; 4 shut down without its coordinator, by force, or incompletely.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    /// Without its coordinator: what is safe, what brings it to rest, then everything is removed.
    #[arg(long)]
    force: bool,
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = seconds, help = WITHIN)]
    within: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let patience = Patience::within(self.within);
        let mut client = connect(self.which.name())?;
        let name = client.name().to_owned();
        let done = Arc::new(AtomicBool::new(false));
        if !self.json {
            tell_waiting(context.out, name.clone(), done.clone());
        }
        let params = json!({ "force": self.force, "wait": true, "within_s": self.within });
        let answer = client.call("shutdown", &params, patience.left()).map_err(failure);
        done.store(true, Ordering::Relaxed);
        let answer = answer?;
        // So that the same name can be deployed at once.
        client.wait_until_free(patience.left());
        if self.json {
            out.json(&answer);
        } else {
            for note in answer["forced"].as_array().into_iter().flatten() {
                out.line(format!("{}  {}", out.paint(Style::Care, "forced"), text(note)));
            }
            for note in answer["left"].as_array().into_iter().flatten() {
                out.line(format!("{}    {}", out.paint(Style::Bad, "left"), text(note)));
            }
            let reported: Vec<&str> = answer["reported"].as_array().into_iter().flatten().map(text).collect();
            if !reported.is_empty() {
                out.line(format!("{}  {}", out.paint(Style::Dim, "reported"), reported.join(", ")));
            }
            let phase = text(&answer["phase"]);
            out.line(format!("{name}: {}", out.paint(super::status::state_style(phase), phase)));
        }
        let left = answer["left"].as_array().is_some_and(|left: &Vec<Json>| !left.is_empty());
        Ok(if left || answer["stage"] != "led" { Exit::Forced } else { Exit::Done })
    }
}

/// Tells now and then what the shutdown waits for, until it is done.
fn tell_waiting(out: Output, name: String, done: Arc<AtomicBool>) {
    let tell = move || {
        let (clock, mut told) = (Clock::real(), String::new());
        let mut client = Client::connect(Some(&name)).ok()?;
        loop {
            clock.sleep(limits::SHUTDOWN_TOLD);
            let status = client.call("status", &json!({}), ASK).ok()?;
            let stopping: StoppingView = serde_json::from_value(status["stopping"].clone()).ok()?;
            let (label, what) = match stopping.stands_still() {
                Some(still) => ("waits for", still),
                None if stopping.waits_for.is_empty() => {
                    ("stopping ", format!("{} {}", stopping.stage.words(), places(&status)))
                }
                None => ("waits for", stopping.waits_for.join(", ")),
            };
            if done.load(Ordering::Relaxed) {
                return Some(());
            }
            if what != told {
                out.line(format!("{}  {what}", out.paint(Style::Dim, label)));
                told = what;
            }
        }
    };
    // Without it the shutdown waits in silence.
    let _ = std::thread::Builder::new().name("davit-waits".to_owned()).spawn(tell);
}

/// Of each coordinator its innermost active state, by name where there are several.
fn places(status: &Json) -> String {
    let innermost =
        |states: &Json| states.as_array().and_then(|states| states.last()).map_or("no state", text).to_owned();
    match status["coordinators"].as_object().filter(|all| all.len() > 1) {
        Some(all) => {
            let each: Vec<String> =
                all.iter().map(|(name, states)| format!("{name} in {}", innermost(states))).collect();
            each.join(", ")
        }
        None => format!("in {}", innermost(&status["coordinator"])),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_coordinator_is_told_where_it_is() {
        let alone = json!({ "coordinator": ["root", "root.left"], "coordinators": { "heat": ["root", "root.left"] } });
        assert_eq!(places(&alone), "in root.left");
        let both = json!({ "coordinator": ["root"], "coordinators": { "heat": ["root", "root.left"], "liquid": [] } });
        assert_eq!(places(&both), "heat in root.left, liquid in no state");
    }
}
