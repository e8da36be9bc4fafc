//! `davit deploy`

use super::detach;
use super::exit::Exit;
use super::input::CommandInput;
use super::keep::Keep;
use super::last_words;
use super::output::{Output, Style};
use super::progress::ProgressView;
use super::signals::SignalWatch;
use super::{CommandContext, CommandFailure, CommandResult, Run};
use crate::app::{self, Checked, StartError};
use crate::model::Severity;
use crate::model::codes::{
    CLI_CONTRADICTS, CLI_NAME_TAKEN, CLI_SYSTEM, DEPLOY_NO_PLATFORM, FUNCTIONS_NOT_OPENED, TYPE_DIFFERS,
};
use crate::model::finding::count;
use crate::session::kept::Leave;
use crate::session::place;
use crate::session::service::SessionService;
use crate::session::socket::{ControlSocket, SocketError};
use crate::session::{Command, Ended, Happening, NotUp, Session, Stage, Unanswered};
use crate::time::{Clock, lock};
use serde_json::json;
use std::panic::resume_unwind;
use std::sync::{Arc, Mutex};

/// Bring a deployment up and stay in the foreground; Ctrl-C shuts it down in order.
///
/// Everything is checked first. Ctrl-C (SIGTERM, SIGHUP, SIGQUIT) stops it, also while it comes up: the coordinator leads down;
/// where it does not, what is in force is taken back, then everything is removed by force. A second Ctrl-C begins with force;
/// a third ends at once and asks the components nothing more. A bring-up that fails is stopped in the same way. While something
/// safe is in force, the end of the terminal (SIGHUP) stops nothing.
///
/// Exit status: 0 shut down by its coordinator; 1 refused, or it did not come up; 4 shut down without its coordinator, by force,
/// or incompletely.
///
/// What happens is kept under `$XDG_STATE_HOME/davit` (`~/.local/state/davit`), 8 MB at most, and so is what components print in
/// the background: `davit log` shows it, also after the end.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    input: CommandInput,
    /// Return once it is up, and leave it running in the background.
    #[arg(long)]
    detach: bool,
    /// Which clock it runs on. In simulated time a run is the same every time, and may be slowed or sped up with
    /// `--pace`.
    #[arg(long, value_enum, default_value_t, value_name = "CLOCK")]
    clock: ClockKind,
    /// With `--clock simulated`: simulated seconds in one real second; 0: as fast as the machine [default: 1].
    #[arg(long, value_name = "FACTOR", value_parser = super::remote::seconds)]
    pace: Option<f64>,
    /// Print every event of the story as one JSON object a line.
    #[arg(long)]
    json: bool,
    /// Set by `--detach` for the process in the background.
    #[arg(long, hide = true)]
    in_background: bool,
}

/// A clock, as asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum ClockKind {
    /// Real time.
    #[default]
    Real,
    /// Simulated time: deterministic.
    Simulated,
}

impl ClockKind {
    /// The clock; `pace` is how many simulated seconds pass in a real one, 0 for as fast as the machine.
    pub fn make(self, pace: f64) -> Clock {
        match self {
            Self::Real => Clock::real(),
            Self::Simulated if pace > 0.0 => Clock::simulated_paced(pace),
            Self::Simulated => Clock::simulated(),
        }
    }
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        if self.pace.is_some() && self.clock == ClockKind::Real {
            return Err(CommandFailure::usage(
                CLI_CONTRADICTS,
                "`--pace` is about simulated time, and this runs on the real clock",
                "add `--clock simulated`, or leave `--pace` out",
            ));
        }
        if self.detach {
            return detach::run(context);
        }
        self.deploy(context)
    }
}

impl Args {
    fn deploy(&self, context: &CommandContext) -> CommandResult {
        let checked = self.input.check(context, self.json)?;
        if !self.json {
            tell_warnings(&context.out, &self.input, &checked);
        }
        let clock = self.clock.make(self.pace.unwrap_or(1.0));
        let progress = ProgressView::new(context.out, self.json, &clock).map_err(short)?;
        let exit = self.foreground(context, &checked, &clock, &progress)?;
        clock.shutdown();
        last_words::unread(progress.end());
        Ok(exit)
    }

    fn foreground(
        &self,
        context: &CommandContext,
        checked: &Checked,
        clock: &Clock,
        progress: &ProgressView,
    ) -> Result<Exit, CommandFailure> {
        let _participant = clock.enter();
        let (name, in_background) = (checked.deployment.name, self.in_background);
        let session = app::start(checked, clock).map_err(|error| match error {
            StartError::Platform { .. } => CommandFailure::no(
                DEPLOY_NO_PLATFORM,
                error.to_string(),
                "the words are the platform's own: look at what it needs, and at its options under `platform`",
            ),
            StartError::Types { .. } => CommandFailure::no(
                TYPE_DIFFERS,
                error.to_string(),
                "declare the types as the platform has them, or give it what the deployment was written for",
            ),
            StartError::Part { finding } => CommandFailure::found(vec![*finding], checked.sources.clone()),
            StartError::Functions { why } => CommandFailure::no(
                FUNCTIONS_NOT_OPENED,
                format!("the coordinator's functions cannot be run: {why}"),
                "the text ran when it was read: does it depend on time or chance?",
            ),
        })?;
        // Before anything of it is to be seen: a signal that ends the process by itself would leave that behind.
        let leaving = Leaving::default();
        let watch = watch(&session, progress, &leaving, in_background)?;
        let socket = open(&session)?;
        lock(&leaving).push(Box::new(socket.leave()));
        // Before anything is kept of it: one that cannot be told of has not lived.
        let observer = socket.observer(clock).map_err(short)?;
        let keep = Keep::begin(&session, &self.input.file, clock, in_background)?;
        lock(&leaving).extend(keep.leave());
        session.hub().attach(progress.observer());
        session.hub().attach(observer);
        let driven = session.guarded(|| match session.bring_up() {
            Err(not_up) => {
                progress.finish();
                (tell_not_up(&context.out, progress, name.as_str(), &not_up, in_background), Err(not_up))
            }
            Ok(()) => {
                tell_up(&context.out, progress, &session, in_background);
                if in_background {
                    super::detach::stays_by_itself();
                    progress.up_in_background();
                }
                let Command::Shutdown { force } = session.serve();
                let ended = session.take_down(force);
                progress.finish();
                tell_ended(&context.out, progress, name.as_str(), &ended);
                (Exit::of_stop(&ended, Exit::Done), Ok(ended))
            }
        });
        let driven = match driven {
            Ok((exit, Ok(ended))) => {
                keep.ended(&ended);
                Ok(exit)
            }
            Ok((exit, Err(not_up))) => {
                keep.not_up(&not_up);
                Ok(exit)
            }
            Err((panic, ended)) => {
                progress.finish();
                if let Some(ended) = ended {
                    tell_ended(&context.out, progress, name.as_str(), &ended);
                    keep.ended(&ended);
                }
                Err(panic)
            }
        };
        drop(watch);
        drop(socket);
        // It is stopped, as far as that went: the defect is told by whoever started this.
        Ok(driven.unwrap_or_else(|panic| resume_unwind(panic)))
    }
}

/// What was found refuses nothing; that there is something is said.
fn tell_warnings(out: &Output, input: &CommandInput, checked: &Checked) {
    let warnings = checked.findings.iter().filter(|finding| finding.severity == Severity::Warning).count();
    if warnings > 0 {
        let them = if warnings == 1 { "it" } else { "them" };
        out.error(format!("{}: {} shows {them}\n", count(warnings, "warning"), input.checked_by()));
    }
}

pub(super) fn open(session: &Arc<Session>) -> Result<ControlSocket, CommandFailure> {
    let name = session.deployment().name;
    let service = Arc::new(SessionService::new(Arc::downgrade(session)));
    ControlSocket::open(name.as_str(), service).map_err(|error| match error {
        SocketError::Taken(name) => CommandFailure::no(
            CLI_NAME_TAKEN,
            format!("a deployment named `{name}` is already running"),
            format!("`davit shutdown {name}` takes it down; or give this one another `name`"),
        ),
        SocketError::Descriptors { .. } => CommandFailure::usage(CLI_SYSTEM, error.to_string(), MORE_DESCRIPTORS),
        SocketError::Io { path, .. } if path.as_os_str().len() > place::LONGEST => CommandFailure::usage(
            CLI_SYSTEM,
            format!(
                "the path of the control socket has {} bytes, and may have {}: {}",
                path.as_os_str().len(),
                place::LONGEST,
                path.display()
            ),
            "give the deployment a shorter `name`, or set XDG_RUNTIME_DIR to a directory with a shorter path",
        ),
        SocketError::Io { path, source } => CommandFailure::usage(
            CLI_SYSTEM,
            format!("cannot listen on {}: {source}", path.display()),
            "set XDG_RUNTIME_DIR to a directory of yours that can be written",
        ),
    })
}

/// What a process does that ends at once, the last first.
pub(super) type Leaving = Arc<Mutex<Vec<Leave>>>;

/// Does it.
pub(super) fn leave(leaving: &Leaving) {
    for leave in lock(leaving).drain(..).rev() {
        leave();
    }
}

fn watch(
    session: &Arc<Session>,
    progress: &ProgressView,
    leaving: &Leaving,
    in_background: bool,
) -> Result<SignalWatch, CommandFailure> {
    let stop = {
        let (session, progress) = (Arc::downgrade(session), progress.clone());
        move |force| {
            if let Some(session) = session.upgrade() {
                session.command(Command::Shutdown { force });
            }
            progress.line(super::signals::told(force));
        }
    };
    let leave = {
        let (leaving, progress) = (leaving.clone(), progress.clone());
        move || {
            self::leave(&leaving);
            progress.finish();
        }
    };
    let held = {
        let session = Arc::downgrade(session);
        move || session.upgrade().is_some_and(|session| session.waits_to_be_forced())
    };
    let goes_on = {
        let session = Arc::downgrade(session);
        move || in_background || session.upgrade().is_some_and(|session| stays_for(&session))
    };
    SignalWatch::start(goes_on, stop, held, leave).map_err(unwatched)
}

/// The terminal is gone. In an emergency nobody asks for a motion with that: a connection that breaks is none to lead down for.
fn stays_for(session: &Session) -> bool {
    let stays = session.in_emergency();
    if stays {
        let note = "the terminal is gone, and something safe is in force: nothing moves for that, and it goes on without one; `davit shutdown` leads it down";
        session.hub().note(Happening::Noted { note: note.to_owned() });
    }
    stays
}

/// Signals cannot be watched.
pub(super) fn unwatched(error: std::io::Error) -> CommandFailure {
    no_threads("signals cannot be watched", &error)
}

/// The system has no thread left.
pub(super) fn short(error: std::io::Error) -> CommandFailure {
    no_threads("no thread can be started", &error)
}

fn no_threads(what: &str, error: &std::io::Error) -> CommandFailure {
    let help = match error.raw_os_error() {
        Some(libc::EMFILE | libc::ENFILE) => MORE_DESCRIPTORS,
        _ => "try again; the system is short of threads",
    };
    CommandFailure::usage(CLI_SYSTEM, format!("{what}: {error}"), help)
}

/// What to do where there are too few of them.
const MORE_DESCRIPTORS: &str = "let the process have more descriptors open (`ulimit -n`)";

fn tell_up(out: &Output, progress: &ProgressView, session: &Session, in_background: bool) {
    let status = session.status();
    let what = match (&status.system, &status.stack) {
        (Some(system), Some(stack)) => format!(
            "{}, {}, {} on the stack",
            count(system.components.len(), "component"),
            count(system.connections.len(), "connection"),
            count(stack.len(), "frame"),
        ),
        _ => format!("with what is not known: {Unanswered}"),
    };
    progress.line(format!(
        "{} {} after {:.3} s: {what}",
        out.paint(Style::Bold, &status.name),
        out.paint(Style::Good, "up"),
        status.at,
    ));
    let way = if in_background { "`davit shutdown` takes it down in order" } else { "Ctrl-C shuts it down in order" };
    progress.line(out.paint(Style::Dim, way));
}

fn tell_not_up(out: &Output, progress: &ProgressView, name: &str, not_up: &NotUp, in_background: bool) -> Exit {
    progress.line(format!("{} {}: {}", out.paint(Style::Bold, name), out.paint(Style::Bad, "not up"), not_up.why));
    for reason in &not_up.reasons {
        progress.line(format!("  {reason}"));
    }
    progress.json_line(&json!({
        "what": "not_up", "why": not_up.why, "reasons": not_up.reasons, "interrupted": not_up.interrupted,
    }));
    tell_ended(out, progress, name, &not_up.ended);
    // Who stopped it knows why it is not up; who waits for it in another terminal does not.
    let well = if not_up.interrupted && !in_background { Exit::Done } else { Exit::No };
    Exit::of_stop(&not_up.ended, well)
}

fn tell_ended(out: &Output, progress: &ProgressView, name: &str, ended: &Ended) {
    for note in &ended.left {
        progress.line(format!("  {}  {note}", out.paint(Style::Bad, "left")));
    }
    progress.json_line(&json!({
        "what": "ended", "stage": ended.stage, "left": ended.left, "orderly": ended.is_orderly(),
    }));
    let name = out.paint(Style::Bold, name);
    if ended.is_orderly() {
        progress.line(format!("{name} {}, nothing is left", out.paint(Style::Good, "down")));
    } else if ended.is_clean() {
        let how = match ended.stage {
            Stage::Forced => "by force",
            _ => "without its coordinator",
        };
        progress.line(format!("{name} {} {how}, nothing is left", out.paint(Style::Care, "down")));
    } else {
        progress.line(format!("{name} {}", out.paint(Style::Bad, "broken")));
    }
}
