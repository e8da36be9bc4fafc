//! What the commands that talk to a running deployment share: finding it, asking it, telling why not.

use super::CommandFailure;
use super::kept;
use crate::limits;
use crate::model::Ident;
use crate::model::codes::{
    CLI_NO_ANSWER, CLI_NOT_RUNNING, CLI_REFUSED, CLI_SEVERAL_RUNNING, CLI_SOCKET_GONE, CLI_UNTRUSTED, page,
};
use crate::session::client::{Client, ClientError};
use crate::time::{Clock, Time};
use clap::error::{ContextKind, ErrorKind};
use serde_json::Value as Json;
use std::time::Duration;

/// How long a running deployment may take to answer what needs no waiting. Its socket threads do nothing else.
pub const ASK: Duration = Duration::from_secs(10);

/// Which running deployment.
#[derive(Debug, clap::Args)]
pub struct Which {
    /// The running deployment's name; not needed while only one runs.
    #[arg(long = "on", value_name = "NAME", value_parser = deployment_name)]
    pub name: Option<String>,
}

/// The same of a command that takes nothing else: the name alone, or as those say it that do.
#[derive(Debug, clap::Args)]
pub struct OnlyWhich {
    /// The running deployment's name, with or without `--on`; not needed while only one runs.
    #[arg(value_name = "NAME", value_parser = deployment_name)]
    only: Option<String>,
    #[arg(long = "on", value_name = "NAME", value_parser = deployment_name, conflicts_with = "only", hide = true)]
    on: Option<String>,
}

impl OnlyWhich {
    /// Which, if that is said.
    pub fn name(&self) -> Option<&str> {
        self.only.as_deref().or(self.on.as_deref())
    }

    /// Which, if that is said.
    pub fn into_name(self) -> Option<String> {
        self.only.or(self.on)
    }
}

/// Of a command line that is not understood: how the deployment is said where something else is to be said, too.
pub fn how_it_is_said(error: &clap::Error) -> Option<String> {
    let said = |kind| error.get(kind).map(ToString::to_string);
    let (extra, usage) = (said(ContextKind::InvalidArg)?, said(ContextKind::Usage)?);
    let takes = ["event", "apply", "undo", "get", "set"].iter().any(|it| usage.contains(&format!("davit {it} ")));
    let is_name = error.kind() == ErrorKind::UnknownArgument && deployment_name(&extra).is_ok();
    (is_name && takes).then(|| format!("\n  tip: which deployment is meant is said with `--on {extra}`\n"))
}

/// A deployment's name as it is typed: what is kept of it, and its socket, are files of that name.
///
/// # Errors
/// It is not one: a path, say.
pub fn deployment_name(text: &str) -> Result<String, String> {
    Ident::new(text).map(|_| text.to_owned()).map_err(|error| error.to_string())
}

/// How long to wait for an answer.
#[derive(Debug, clap::Args)]
pub struct WaitFor {
    /// Do not wait for the answer: exit with 0 once it is asked for.
    #[arg(long)]
    pub no_wait: bool,
    /// What is done anyway.
    #[arg(long, hide = true, conflicts_with = "no_wait")]
    pub wait: bool,
    /// For how long: see [`Patience`].
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, value_parser = seconds, help = WITHIN)]
    pub within: f64,
}

/// The help of every `--within`.
pub const WITHIN: &str =
    "How long to wait at most, in seconds; of a deployment that says nothing at all, one second longer";

/// How long a command waits for a running deployment, all that it asks for together. The deployment is told the same time: if
/// it lives it says at the end of it what has not come, and that is heard within [`limits::ANSWER_WAY`]. Nothing else
/// lengthens a `--within`.
pub struct Patience {
    clock: Clock,
    until: Time,
}

impl Patience {
    /// From now on, for that many seconds.
    pub fn within(seconds: f64) -> Self {
        let clock = Clock::real();
        let until = clock.now() + Duration::from_secs_f64(seconds) + limits::ANSWER_WAY;
        Self { clock, until }
    }

    /// What is left of it.
    pub fn left(&self) -> Duration {
        self.until.since(self.clock.now())
    }
}

/// A number of seconds: finite, not negative.
pub fn seconds(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("`{text}` is not a number of seconds"))?;
    if value.is_finite() && (0.0..=1e6).contains(&value) {
        Ok(value)
    } else {
        Err("give a number of seconds from 0 to 1000000".to_owned())
    }
}

/// Connects.
pub fn connect(name: Option<&str>) -> Result<Client, CommandFailure> {
    Client::connect(name).map_err(failure)
}

/// Connects, asks once, and gives the answer.
pub fn ask(name: Option<&str>, method: &str, params: &Json, limit: Duration) -> Result<Json, CommandFailure> {
    connect(name)?.call(method, params, limit).map_err(failure)
}

/// Why there is no answer, as a finding.
pub fn failure(error: ClientError) -> CommandFailure {
    let meant = kept::meant(&error);
    match error {
        ClientError::None => {
            let help = "start one with `davit deploy FILE`, or look whether XDG_RUNTIME_DIR is the same here and there";
            let help = meant.map_or_else(|| help.to_owned(), |life| format!("{help}; {}", kept::ended(&life)));
            CommandFailure::no(CLI_NOT_RUNNING, "no deployment is running", help)
        }
        ClientError::Several(names) => CommandFailure::usage(
            CLI_SEVERAL_RUNNING,
            format!("{} deployments are running", names.len()),
            format!(
                "say which, with `--on NAME`: {}",
                names.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ")
            ),
        ),
        ClientError::Unknown { name, help } => {
            let help = meant.map_or(help, |life| kept::ended(&life));
            CommandFailure::no(CLI_NOT_RUNNING, format!("no deployment named `{name}` is running"), help)
        }
        ClientError::SocketGone { name, path } => CommandFailure::no(
            CLI_SOCKET_GONE,
            format!("the deployment `{name}` runs, but its socket {} is gone", path.display()),
            "Ctrl-C in its terminal shuts it down in order, and so does SIGINT to its process: look for it with `pgrep -af \
             davit`",
        ),
        ClientError::Untrusted(why) => CommandFailure::no(
            CLI_UNTRUSTED,
            format!("not asked: {why}"),
            "set XDG_RUNTIME_DIR to a directory of yours, as where the deployment was started; a deployment of another user is \
             asked by that user",
        ),
        ClientError::Io { name, source } => CommandFailure::no(
            CLI_NO_ANSWER,
            format!("the deployment `{name}` does not answer: {source}"),
            "look at its terminal; `davit status` tries again, `davit shutdown --force` takes it down without its \
             coordinator",
        ),
        ClientError::Refused(error) => CommandFailure::no(
            error.data.get("code").and_then(Json::as_str).and_then(page).map_or(CLI_REFUSED, |page| page.code),
            error.message.clone(),
            error.data.get("help").and_then(Json::as_str).unwrap_or("`davit log` shows what happened").to_owned(),
        ),
    }
}
