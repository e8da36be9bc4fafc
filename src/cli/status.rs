//! `davit status`

use super::exit::Exit;
use super::inside::{Hierarchy, Inside};
use super::kept::{self, Died};
use super::list::{Overview, of_phase, silent};
use super::output::{Output, Style};
use super::remote::{ASK, failure};
use super::status_view::print;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::session::Unanswered;
use crate::session::client::{Client, ClientError};
use crate::session::kept::Life;
use serde_json::{Value as Json, json};

/// Show a running deployment: its phase, the coordinator's states, components, faults. Of one that died: when, and how far it
/// was. Of several, where none is named: a line each, as `davit list`.
///
/// Exit status: 0 it runs; 1 none runs; 3 it is broken; 4 it died: killed, crashed or cut off, and was not shut down, or its record is
/// damaged, so that nobody knows. Of several the
/// first of 3, 4, 1 and 0 that is so of one of them; without a name also one that died beside the one that runs counts.
///
/// What is a subsystem's stands below its path, with how it stands: *up*, *failed*, *down* or *stranded*, as its parent was told last,
/// or on its way (*deploying*, *shutting_down*). With `--in`, what others hold of it is said (*held by*).
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The deployments' names; not needed while only one runs.
    #[arg(value_name = "NAME", value_parser = super::remote::deployment_name)]
    names: Vec<String>,
    #[arg(long = "on", value_name = "NAME", value_parser = super::remote::deployment_name, hide = true)]
    on: Vec<String>,
    #[command(flatten)]
    hierarchy: Hierarchy,
    /// Print JSON: whole, with full names unless `--in` is given.
    #[arg(long)]
    json: bool,
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let inside = |seen: SeenStatus| seen.inside(&self.hierarchy.inside);
        let show = |seen: &[SeenStatus]| show(out, seen, self.hierarchy.depth, self.json);
        let names = [self.names, self.on].concat();
        match &names[..] {
            [] => match look(None) {
                Ok(SeenStatus::Runs(status)) => {
                    // Who runs has died before, if ever.
                    let own = status["name"].as_str().unwrap_or_default().to_owned();
                    let mut exit = show(&[inside(SeenStatus::Runs(status))?]);
                    for died in kept::died().iter().filter(|died| died.name() != own) {
                        out.error(format!("note: {}\n", died.sentence()));
                        exit = Exit::worst([exit, kept::EXIT]);
                    }
                    Ok(exit)
                }
                Ok(died) => Ok(show(&[died])),
                Err(ClientError::Several(_)) if !self.hierarchy.inside.is_some() => {
                    let overview = Overview::look();
                    overview.show(out, self.json);
                    Ok(overview.exit())
                }
                Err(error) => Err(failure(error)),
            },
            [name] => Ok(show(&[inside(look(Some(name)).map_err(failure)?)?])),
            names => {
                let seen = |name: &String| {
                    let seen = look(Some(name)).map_err(failure).and_then(inside);
                    seen.unwrap_or_else(|failure| SeenStatus::Not(name.clone(), failure))
                };
                let seen: Vec<SeenStatus> = names.iter().map(seen).collect();
                Ok(show(&seen))
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

    /// What of it belongs to the subsystem that is meant. One that died is told as a whole.
    fn inside(self, inside: &Inside) -> Result<Self, CommandFailure> {
        match self {
            Self::Runs(status) => {
                let region = inside.in_status(&status)?;
                Ok(Self::Runs(region.map_or(status.clone(), |region| region.status(&status))))
            }
            other => Ok(other),
        }
    }

    fn print(&self, out: &Output, depth: Option<usize>) {
        match self {
            Self::Runs(status) => print(out, status, depth),
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
fn show(out: &Output, seen: &[SeenStatus], depth: Option<usize>, json: bool) -> Exit {
    match seen {
        [only] if json => out.json(&only.json()),
        all if json => out.json(&all.iter().map(SeenStatus::json).collect::<Vec<_>>()),
        all => {
            for (i, seen) in all.iter().enumerate() {
                if i > 0 {
                    out.line("");
                }
                seen.print(out, depth);
            }
        }
    }
    Exit::worst(seen.iter().map(SeenStatus::exit))
}

/// The style of a phase or a run state.
pub fn state_style(state: &str) -> Style {
    match state {
        "running" | "up" => Style::Good,
        "broken" | "faulted" | "failed" | "stranded" => Style::Bad,
        "stopped" | "deploying" | "shutting_down" => Style::Care,
        _ => Style::Dim,
    }
}

/// A text in a JSON view, empty where there is none.
pub fn text(json: &Json) -> &str {
    json.as_str().unwrap_or_default()
}

/// What only the configurator knows, where it has not answered.
pub fn not_known() -> String {
    format!("not known: {Unanswered}")
}
