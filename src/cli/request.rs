//! `davit event`, `davit apply`, `davit undo`, `davit commit`: what is asked of a running deployment.

use super::exit::Exit;
use super::log::duration;
use super::output::Style;
use super::remote::{OnlyWhich, Patience, WITHIN, WaitFor, Which, ask, seconds};
use super::status::text;
use super::{CommandContext, CommandResult, Run};
use crate::configurator::WAY_OUT;
use crate::model::finding::count;
use serde_json::{Value as Json, json};

/// Raise an event for the coordinators of a running deployment, and wait until they have taken it up.
///
/// Exit status: 0 a transition heard it; 1 none did, or it was not taken up in time. With `--wait EVENT`: 0 that was heard; 1 it
/// was not, or what was heard instead is another answer to the same request (`X.failed` for `X.ok`); 3 that answer is
/// `X.broken`.
#[derive(Debug, clap::Args)]
pub struct EventArgs {
    /// The event.
    event: String,
    #[command(flatten)]
    which: Which,
    /// Wait until this event or answer is heard, or another answer to the same request.
    #[arg(long = "wait", value_name = "EVENT")]
    wait_for: Option<String>,
    /// Do not wait: exit with 0 once it is raised.
    #[arg(long, conflicts_with = "wait_for")]
    no_wait: bool,
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds, help = WITHIN)]
    within: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for EventArgs {
    fn run(self, context: &CommandContext) -> CommandResult {
        let params = json!({
            "event": self.event, "wait": !self.no_wait, "wait_for": self.wait_for, "within_s": self.within
        });
        let answer = ask(self.which.name.as_deref(), "event", &params, Patience::within(self.within).left())?;
        let (heard, taken) = (answer["heard"].as_str(), answer["taken"].as_bool());
        let good = heard == self.wait_for.as_deref();
        // Nobody leads any more: a safety event acts by itself.
        let acted: Option<Vec<&str>> =
            answer["acted"].as_array().map(|all| all.iter().filter_map(Json::as_str).collect());
        let broke = acted.iter().flatten().any(|answer| answer.ends_with(".broken"));
        // Nothing that makes safe, or not all of it.
        let unsafe_still =
            acted.as_ref().is_some_and(|all| all.is_empty() || !all.iter().all(|it| it.ends_with(".ok")));
        if self.json {
            context.out.json(&answer);
        } else if let Some(heard) = heard {
            let style = if good { Style::Good } else { Style::Bad };
            context.out.line(format!("{} after {}", context.out.paint(style, heard), self.event));
        } else if let Some(acted) = acted {
            let what = match acted.is_empty() {
                true => "nothing was done, there is no safe configuration".to_owned(),
                false => acted.join(", "),
            };
            let when = if answer["before"] == true { "had acted by itself just before" } else { "acted by itself" };
            context.out.line(format!("{} {when}, since no coordinator leads any more: {what}", self.event));
            if unsafe_still {
                let again = format!("note: not everything is safe: `davit event {}` tries again", self.event);
                context.out.error(format!("{again}; `davit log` shows why\n"));
            }
        } else if let Some(taken) = taken {
            let what = if taken { "heard" } else { "raised, and no transition heard it" };
            context.out.line(format!("{} {what}", self.event));
        } else {
            context.out.line(format!("{} raised", self.event));
        }
        if let Some(note) = answer["note"].as_str().filter(|_| !self.json) {
            context.out.error(format!("note: {note}\n"));
        }
        Ok(match heard {
            Some(heard) if heard.ends_with(".broken") && !good => Exit::Broken,
            None if broke => Exit::Broken,
            None if unsafe_still => Exit::No,
            _ if good && taken != Some(false) => Exit::Done,
            _ => Exit::No,
        })
    }
}

/// Apply a configuration on a running deployment, and wait for the answer.
///
/// Exit status: 0 applied; 1 refused, failed and taken back, or not answered in time; 3 broken.
#[derive(Debug, clap::Args)]
pub struct ApplyArgs {
    /// The configuration.
    configuration: String,
    /// Also when the deployment's `operator:` does not list it, or it moves something while a safe configuration is in force.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    asking: Asking,
}

impl Run for ApplyArgs {
    fn run(self, context: &CommandContext) -> CommandResult {
        let params = json!({ "configuration": self.configuration, "force": self.force });
        self.asking.request(context, "apply", params, &self.asking.patience())
    }
}

/// Undo the newest configuration of a running deployment, or a named one, or down to N frames, and wait for the answer.
///
/// Exit status: 0 undone; 1 refused, nothing to undo, or not answered in time; 3 broken.
#[derive(Debug, clap::Args)]
pub struct UndoArgs {
    /// The configuration whose newest frame is undone; without one, the newest that was applied by hand. Of the very
    /// configuration that broke the deployment: goes back to the system before it.
    configuration: Option<String>,
    /// Undo until so many frames are left.
    #[arg(long, value_name = "N", conflicts_with = "configuration")]
    to: Option<usize>,
    /// Also frames of coordinators, and what moves while a safe configuration is in force. The coordinator is not told, and
    /// goes on as if its frame were there.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    asking: Asking,
}

impl Run for UndoArgs {
    fn run(self, context: &CommandContext) -> CommandResult {
        let params = json!({ "configuration": self.configuration, "to": self.to, "force": self.force });
        self.asking.request(context, "undo", params, &self.asking.patience())
    }
}

/// Make what an operator applied permanent: it can no longer be undone.
///
/// Refused while a coordinator's frame is in force: its undo may write over what was to stay.
#[derive(Debug, clap::Args)]
pub struct CommitArgs {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    /// Also while a coordinator's frame is in force. That frame stays, and can be undone as far as that then goes.
    #[arg(long)]
    force: bool,
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds, help = WITHIN)]
    within: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl Run for CommitArgs {
    fn run(self, context: &CommandContext) -> CommandResult {
        let wait = WaitFor { no_wait: false, wait: true, within: self.within };
        let params = json!({ "force": self.force });
        let asking = Asking { which: Which { name: self.which.into_name() }, wait, json: self.json };
        asking.request(context, "commit", params, &asking.patience())
    }
}

/// Whom a request goes to, and how its answer is waited for and told.
#[derive(Debug, clap::Args)]
pub(super) struct Asking {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    pub which: Which,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub wait: WaitFor,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
}

impl Asking {
    /// How long its answer is waited for, from now on.
    pub fn patience(&self) -> Patience {
        Patience::within(self.wait.within)
    }

    /// Asks, and tells the answer if it is waited for.
    pub fn request(
        &self,
        context: &CommandContext,
        method: &str,
        mut params: Json,
        patience: &Patience,
    ) -> CommandResult {
        let waits = !self.wait.no_wait;
        params["wait"] = json!(waits);
        params["within_s"] = json!(self.wait.within);
        let out = &context.out;
        let answer = ask(self.which.name.as_deref(), method, &params, patience.left())?;
        let verdict = text(&answer["answer"]);
        if self.json {
            out.json(&answer);
        } else if waits {
            let ok = answer["ok"] == true;
            out.line(format!(
                "{} ({}, {})",
                out.paint(if ok { Style::Good } else { Style::Bad }, verdict),
                count(answer["steps"].as_array().map_or(0, Vec::len), "step"),
                duration(answer["took_us"].as_f64().unwrap_or_default()),
            ));
            for reason in answer["reasons"].as_array().into_iter().flatten() {
                out.line(format!("  {}", text(reason)));
            }
            for note in answer["notes"].as_array().into_iter().flatten() {
                out.error(format!("note: {}\n", text(note)));
            }
            if verdict.ends_with(".broken") {
                out.error(format!("note: it is broken; {WAY_OUT}\n"));
            }
        } else {
            out.line(format!("asked for as request {}; `davit log` shows how it is answered", answer["request"]));
        }
        Ok(match (waits, answer["ok"] == true, verdict.ends_with(".broken")) {
            (false, ..) | (_, true, _) => Exit::Done,
            (_, _, true) => Exit::Broken,
            _ => Exit::No,
        })
    }
}
