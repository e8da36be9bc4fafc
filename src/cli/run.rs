//! `davit run`

use super::budget::Following;
use super::deploy::{ClockKind, Leaving};
use super::exit::Exit;
use super::figures;
use super::input::Parameters;
use super::keep::Keep;
use super::last_words;
use super::output::Style;
use super::progress::ProgressView;
use super::signals::{self, SignalWatch};
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::app::Extensions;
use crate::app::script::{self, CheckTeller, Door, Interrupt, ScriptEnd, ScriptFailure, ScriptOptions, ScriptSample};
use crate::diagnostics::SourceMap;
use crate::model::Ident;
use crate::model::codes::{
    DEPLOY_UNKNOWN_PLATFORM, SCRIPT_FAILED, SCRIPT_MISSED, SCRIPT_SYNTAX, SCRIPT_UNKNOWN_PARAMETER,
};
use crate::model::finding::did_you_mean;
use crate::session::Session;
use crate::session::socket::ControlSocket;
use crate::time::{Clock, lock};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Run a script: deploy, raise events, wait for states and answers with time limits, measure, assert, undo, shut down.
///
/// The figures that the script has measured are shown as a table at the end; where one is out of its bounds, the script has
/// failed. A script that fails also shows where it did: states, frames, and what happened last.
///
/// Whatever the script does or fails to do, the deployment it brought up is shut down before the command ends, in the stages of
/// `davit shutdown`; so it is at Ctrl-C, which ends the script. On the real clock it has its name while it is up, like one of `davit
/// deploy`: `davit status` and `davit event` reach it, and `davit shutdown` ends the script, too; and what happens is kept like
/// that of one. The functions a script may call are described in
/// docs/scripts.md.
///
/// Exit status: 0 it ran to its end; 1 it failed, missed a figure or was interrupted; 2 it cannot be read; 4 what it brought up was shut down
/// without its coordinator, by force, or incompletely. A parameter (`--set`) that neither the script (`param`) nor a deployment of its
/// reads is 2.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The script.
    script: PathBuf,
    /// Which clock it runs on; simulated time passes as fast as the machine, and the same way every time.
    #[arg(long, value_enum, default_value_t, value_name = "CLOCK")]
    clock: ClockKind,
    /// Run its deployments on this platform of the program instead of the one they name, without the options they give it. `simulated`
    /// needs no components and injects what `faults:` and the script's `fault` say.
    #[arg(long, value_name = "PLATFORM")]
    platform: Option<String>,
    #[command(flatten)]
    parameters: Parameters,
    /// Write what the script records into this folder: a file for each recording, as `davit monitor --samples` reads it.
    #[arg(long, value_name = "DIR")]
    samples: Option<PathBuf>,
    /// Tell only what the script says and measures, failures, and what somebody has to decide.
    #[arg(long, short)]
    quiet: bool,
    /// Print every event of the story as one JSON object a line.
    #[arg(long)]
    json: bool,
    /// End when stdin does: whoever has started it is gone.
    #[arg(long, hide = true)]
    with_parent: bool,
}

/// Stops the script when stdin ends. The thread ends with the process.
fn end_with_stdin(interrupt: &Interrupt) -> std::io::Result<()> {
    let interrupt = interrupt.clone();
    let watches = move || {
        let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
        interrupt.stop(false);
    };
    std::thread::Builder::new().name("davit-parent".to_owned()).spawn(watches).map(drop)
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let platform = self.platform.as_deref().map(|name| known(name, &context.extensions)).transpose()?;
        let clock = self.clock.make(0.0);
        let progress = ProgressView::new(context.out, self.json, &clock).map_err(super::deploy::short)?;
        let say = {
            let progress = progress.clone();
            let (out, clock, json) = (context.out, clock.clone(), self.json);
            Box::new(move |text: &str| match json {
                true => progress.say_json(&json!({ "at": clock.now().as_secs_f64(), "what": "said", "text": text })),
                false => progress.say(out.paint(Style::Bold, text)),
            })
        };
        let interrupt = Interrupt::default();
        let leaving = Leaving::default();
        if self.with_parent {
            end_with_stdin(&interrupt).map_err(super::deploy::short)?;
        }
        let watch = {
            let (stopped, left) = (progress.clone(), progress.clone());
            let (stops, leaving) = (interrupt.clone(), leaving.clone());
            let stop = move |force: bool| {
                let nothing = !force && !stops.has_deployed();
                stops.stop(force);
                stopped.line(if nothing { "the script ends; nothing of it is deployed" } else { signals::told(force) });
            };
            let held = {
                let interrupt = interrupt.clone();
                move || interrupt.waits_to_be_forced()
            };
            let leave = move || {
                super::deploy::leave(&leaving);
                left.finish();
            };
            SignalWatch::start(|| false, stop, held, leave).map_err(super::deploy::unwatched)?
        };
        let end = script::run(
            &self.script,
            ScriptOptions {
                clock: clock.clone(),
                extensions: context.extensions.clone(),
                load: self.parameters.options()?,
                platform,
                observer: match self.quiet {
                    true if self.json => None,
                    true => Some(progress.quiet_observer()),
                    false => Some(progress.observer()),
                },
                say,
                interrupt,
                door: Some(door(&clock, &leaving)),
                checking: Some(checking(self.quiet || self.json)),
            },
        );
        clock.shutdown();
        progress.finish();
        measured(context, &progress, &end);
        if let Some(ended) = &end.ended {
            // Else the story has told it.
            if self.quiet && !ended.is_orderly() {
                let note = |note: &String| format!("{}  {note}", context.out.paint(Style::Care, "note"));
                ended.forced.iter().for_each(|forced| progress.line(note(forced)));
            }
            for note in &ended.left {
                progress.line(format!("{}  {note}", context.out.paint(Style::Bad, "left")));
            }
        }
        last_words::unread(progress.end());
        drop(watch);
        let stopped = |well| end.ended.as_ref().map_or(well, |ended| Exit::of_stop(ended, well));
        let written = self.samples.map_or(Ok(Exit::Done), |folder| figures::write_samples(&folder, &end.samples));
        let Some(failure) = end.failure else { return written.map(|_| stopped(Exit::Done)) };
        let mut failure = tell(&self.script, failure);
        failure.exit = stopped(failure.exit);
        Err(failure)
    }
}

/// What the script has measured, and where it failed.
fn measured(context: &CommandContext, progress: &ProgressView, end: &ScriptEnd) {
    let out = &context.out;
    for note in end.samples.iter().filter_map(ScriptSample::note) {
        progress.line(format!("{}  {note}", out.paint(Style::Care, "note")));
        progress.json_line(&json!({ "what": "note", "text": note }));
    }
    if let Some(scene) = &end.scene {
        progress.line(figures::scene(out, scene));
        progress.json_line(&figures::scene_json(scene));
    }
    if !end.figures.is_empty() {
        progress.line(figures::table(out, &end.figures).trim_end());
        progress.json_line(&json!({ "what": "figures", "figures": end.figures }));
    }
}

/// On the real clock a script's deployment has its name and its socket like every other, and is kept: nobody else commands the same
/// robot, who stands beside it can stop it, and who finds it abandoned is told.
fn door(clock: &Clock, leaving: &Leaving) -> Door {
    let (clock, leaving) = (clock.clone(), leaving.clone());
    Box::new(move |session, file| {
        let words = |failure: CommandFailure| failure.message();
        let socket = super::deploy::open(session).map_err(words)?;
        lock(&leaving).push(Box::new(socket.leave()));
        session.hub().attach(socket.observer(&clock).map_err(super::deploy::short).map_err(words)?);
        let keep = Keep::begin(session, file, &clock, false).map_err(words)?;
        lock(&leaving).extend(keep.leave());
        Ok(Box::new(KnownDeployment {
            keep: Some(keep),
            session: session.clone(),
            leaving: leaving.clone(),
            _socket: socket,
        }))
    })
}

/// A line that tells how far the check of a deployment is.
fn checking(silent: bool) -> CheckTeller {
    Box::new(move || {
        let following = Following::before_acting(silent);
        Box::new(move |far| following.tell(far))
    })
}

/// A script's deployment as others know it, as long as it is up.
struct KnownDeployment {
    keep: Option<Keep>,
    session: Arc<Session>,
    leaving: Leaving,
    _socket: ControlSocket,
}

impl Drop for KnownDeployment {
    /// How it ended is written before its name is free.
    fn drop(&mut self) {
        if let (Some(keep), Some(ended)) = (self.keep.take(), self.session.ended()) {
            keep.ended(&ended);
        }
        lock(&self.leaving).clear();
    }
}

/// A platform of this program.
pub fn known(name: &str, extensions: &Extensions) -> Result<Ident, CommandFailure> {
    let known = extensions.platforms().any(|known| known == name);
    Ident::new(name).ok().filter(|_| known).ok_or_else(|| {
        let help = did_you_mean(name, "platforms", extensions.platforms());
        CommandFailure::usage(DEPLOY_UNKNOWN_PLATFORM, format!("this program has no platform `{name}`"), help)
    })
}

fn tell(script: &Path, failure: ScriptFailure) -> CommandFailure {
    match failure {
        ScriptFailure::Unreadable(finding) => {
            CommandFailure { exit: Exit::Usage, ..CommandFailure::found(vec![*finding], SourceMap::new()) }
        }
        ScriptFailure::Unknown { findings, sources } => {
            CommandFailure { exit: Exit::Usage, ..CommandFailure::found(findings, *sources) }
        }
        ScriptFailure::Lua { message, syntax: true } => {
            let is_yaml = script.extension().is_some_and(|ending| ending == "yaml" || ending == "yml");
            let help = match is_yaml {
                true => format!("a script is Lua; a deployment is brought up by `davit deploy {}`", script.display()),
                false => "mend the script where the message points".to_owned(),
            };
            CommandFailure::usage(SCRIPT_SYNTAX, message, help)
        }
        ScriptFailure::Lua { message, syntax: false } => CommandFailure::no(
            SCRIPT_FAILED,
            message,
            "what happened before that, if anything, is told above; `--json` tells it to a program",
        ),
        ScriptFailure::Unread { message } => CommandFailure::usage(
            SCRIPT_UNKNOWN_PARAMETER,
            message,
            "a script reads one with `param(\"NAME\", DEFAULT)`",
        ),
        ScriptFailure::Missed { message } => CommandFailure::no(
            SCRIPT_MISSED,
            message,
            "the table of figures has all of them; `--samples DIR` writes down what was recorded",
        ),
        ScriptFailure::Refused { path, refused } => {
            let others = Some(format!("`davit check {}`", path.display()));
            CommandFailure { others, ..(*refused).into() }
        }
    }
}
