//! `davit list`: the deployments of this user, one line each.

use super::exit::Exit;
use super::kept::{self, Died};
use super::levels::{parts, states};
use super::output::{Output, Style, Table};
use super::remote::ASK;
use super::status::{state_style, text};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::model::codes::{CLI_NOTHING_KEPT, CLI_SYSTEM};
use crate::model::finding::count;
use crate::model::names::level;
use crate::session::client::Client;
use crate::session::kept::{Life, forget, life};
use crate::session::{owner, place};
use serde_json::{Value as Json, json};
use std::collections::BTreeSet;

/// List the running deployments of this user, and those that died without being shut down.
///
/// Each with the states of its coordinators, of several with their names, and how its subsystems stand.
///
/// One that died, or whose record is damaged, is listed until its name is deployed again, or until it is forgotten.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Throw away what is kept of a deployment that does not run any more: its log, and that it died.
    #[arg(long, value_name = "NAME", conflicts_with = "json", value_parser = super::remote::deployment_name)]
    forget: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        if let Some(name) = self.forget {
            return if owner::is_owned(&name) || life(&name).is_some_and(|life| life.alive) {
                Err(CommandFailure::no(
                    CLI_NOTHING_KEPT,
                    format!("`{name}` runs, and nothing of it is forgotten before it has ended"),
                    format!("`davit shutdown {name}` takes it down; what is kept of it is then that it was shut down"),
                ))
            } else {
                match forget(&name) {
                    Ok(true) => Ok(Exit::Done),
                    Ok(false) => Err(CommandFailure::no(
                        CLI_NOTHING_KEPT,
                        format!("nothing of a deployment `{name}` that does not run any more is kept"),
                        "`davit list` shows what runs, and what died",
                    )),
                    Err((path, why)) => Err(CommandFailure::usage(
                        CLI_SYSTEM,
                        format!("{} cannot be thrown away: {why}", path.display()),
                        "look what it is, and remove it by hand",
                    )),
                }
            };
        }
        let overview = Overview::look();
        overview.show(&context.out, self.json);
        Ok(Exit::Done)
    }
}

/// All deployments of this user.
pub struct Overview {
    running: Vec<Json>,
    died: Vec<Died>,
}

impl Overview {
    /// Asks all that run, at the same time: one that does not answer keeps nobody else waiting.
    pub fn look() -> Self {
        let mut names: BTreeSet<String> = owner::owned().into_iter().collect();
        if place::is_there().is_ok_and(|there| there) {
            names.extend(place::running());
        }
        let running: Vec<Json> = std::thread::scope(|scope| {
            let asked: Vec<_> = names.iter().map(|name| scope.spawn(move || about(name))).collect();
            asked.into_iter().filter_map(|asked| asked.join().ok()).collect()
        });
        let died = kept::died().into_iter().filter(|died| !names.contains(died.name())).collect();
        Self { running, died }
    }

    /// As text or JSON.
    pub fn show(&self, out: &Output, json: bool) {
        if json {
            out.json(&self.running.iter().cloned().chain(self.died.iter().map(Died::json)).collect::<Vec<_>>());
            return;
        }
        if self.running.is_empty() && self.died.is_empty() {
            out.line("no deployment is running");
        }
        let mut table = Table::new(0);
        for one in &self.running {
            let phase = one["phase"].as_str().unwrap_or("no answer");
            let parts = parts(one);
            let subsystems = parts.iter().filter(|part| level(part.path) == 1);
            let subsystems =
                subsystems.map(|it| format!("{} {}", it.path, out.paint(state_style(it.standing), it.standing)));
            let states = parts.first().map_or_else(String::new, states);
            let faults = one["faults"].as_u64().filter(|faults| *faults > 0);
            table.row([
                out.paint(Style::Bold, text(&one["name"])),
                out.paint(state_style(phase), phase),
                if one["why"].is_null() { out.paint(Style::Name, states) } else { text(&one["why"]).to_owned() },
                subsystems.collect::<Vec<_>>().join(", "),
                faults.map_or_else(String::new, |faults| out.paint(Style::Bad, count(faults, "fault"))),
                one["pid"].as_u64().map_or_else(String::new, |pid| format!("process {pid}")),
                one["began"].as_str().map_or_else(String::new, |began| out.paint(Style::Dim, format!("since {began}"))),
            ]);
        }
        out.text(table.to_string());
        for died in &self.died {
            died.print_short(out);
        }
    }

    /// How `davit status` ends that has shown it.
    pub fn exit(&self) -> Exit {
        let running = self.running.iter().map(|one| match &one["phase"] {
            Json::Null => Exit::No,
            phase => of_phase(phase),
        });
        Exit::worst(running.chain(self.died.iter().map(|_| kept::EXIT)))
    }
}

/// How `davit status` ends that has shown one that runs.
pub fn of_phase(phase: &Json) -> Exit {
    if phase == "broken" { Exit::Broken } else { Exit::Done }
}

/// One that does not answer, as `davit list --json` has it.
pub fn silent(name: &str, why: &str) -> Json {
    json!({ "name": name, "phase": null, "why": why })
}

/// One that runs, as `davit list --json` has it.
fn about(name: &str) -> Json {
    let mut one = match Client::connect(Some(name)).and_then(|mut client| client.call("status", &json!({}), ASK)) {
        Err(why) => silent(name, &why.to_string()),
        Ok(status) => {
            let leaves = status["coordinators"].as_object().into_iter().flatten();
            let leaves = leaves.filter_map(|(_, states)| states.as_array()?.last().cloned());
            let length = |key: &str| status[key].as_array().map_or(0, Vec::len);
            let mut one = json!({
                "name": name, "phase": status["phase"], "coordinator": leaves.collect::<Vec<_>>(), "at": status["at"],
                "coordinators": status["coordinators"],
                "frames": length("stack"), "faults": length("faults"), "residual": length("residual"),
            });
            if status["subsystems"].is_array() {
                one["subsystems"] = status["subsystems"].clone();
            }
            one
        }
    };
    // Of a process that could not keep anything, or keeps it elsewhere, this is not known.
    if let Some(Life { process: Some(process), alive: true, .. }) = life(name) {
        one["pid"] = json!(process.pid);
        one["began"] = json!(process.began.to_string());
        one["file"] = json!(process.file);
    }
    one
}
