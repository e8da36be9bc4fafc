//! `davit shutdown`

use super::exit::Exit;
use super::output::Style;
use super::remote::{ASK, connect, failure};
use super::status::text;
use super::{Answer, Context, Run};
use serde_json::{Value as Json, json};
use std::time::Duration;

/// Drive a running deployment to its *down* state; nothing is left.
///
/// The coordinator leads down; where it does not, what is in force is taken back, then everything is removed by force. Asked
/// again, the coordinator is told again; with `--force` the rest is done by force at once. Exit status: 0 its coordinator has led
/// down; 1 it is not down yet, or nobody answers; 4 shut down without its coordinator, by force, or incompletely.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The running deployment's name; not needed while only one runs.
    name: Option<String>,
    /// Without its coordinator: what is safe, what brings it to rest, then everything is removed.
    #[arg(long)]
    force: bool,
    /// How long to wait at most, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0, value_parser = super::remote::seconds)]
    within: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &Context) -> Answer {
        let json = self.json;
        self.show(context).map_err(|failure| failure.as_json(json))
    }
}

impl Args {
    fn show(self, context: &Context) -> Answer {
        let out = &context.out;
        let mut client = connect(self.name.as_deref())?;
        let name = client.name().to_owned();
        let limit = Duration::from_secs_f64(self.within) + ASK;
        let answer = client.call("shutdown", &json!({ "force": self.force, "wait": true }), limit).map_err(failure)?;
        // So that the same name can be deployed at once.
        client.wait_until_free();
        if self.json {
            out.json(&answer);
        } else {
            for note in answer["forced"].as_array().into_iter().flatten() {
                out.line(format!("{}  {}", out.paint(Style::Care, "forced"), text(note)));
            }
            for note in answer["left"].as_array().into_iter().flatten() {
                out.line(format!("{}    {}", out.paint(Style::Bad, "left"), text(note)));
            }
            let phase = text(&answer["phase"]);
            out.line(format!("{name}: {}", out.paint(super::status::state_style(phase), phase)));
        }
        let left = answer["left"].as_array().is_some_and(|left: &Vec<Json>| !left.is_empty());
        Ok(if left || answer["stage"] != "led" { Exit::Forced } else { Exit::Done })
    }
}
