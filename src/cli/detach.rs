//! `davit deploy --detach`: the same command again as a process of its own, watched until it is up.
//!
//! The process in the background writes its story to a pipe. A line with [`UP`] says that it is up; the end of the pipe
//! without that line says that it is not, and its exit status says why. Signals to the command are [passed on](Passed) to it.

use super::exit::Exit;
use super::last_words;
use super::output::{self, Output};
use super::signals::SignalWatch;
use super::{CommandContext, CommandFailure, CommandResult};
use crate::model::codes::CLI_SYSTEM;
use crate::time::lock;
use std::io::{BufRead, BufReader};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};

/// The line that says that the deployment is up. Not JSON and not a word anybody prints by chance.
const UP: &str = "\u{1}davit up\u{1}";

/// What is said to a signal that comes when it is up already.
const STAYS: &str = "note: it is up, and stays so in the background: `davit shutdown` takes it down\n";

/// Says, in the process in the background, that the deployment is up. Nobody reads after it: the streams of who started it
/// are let go, so that a pipe that the command was typed with (`| tail`) ends with the command. What is said from now on is
/// [printed](super::printed) like what components say.
pub fn tell_up(out: Output) {
    out.line(UP);
    output::speak_to(None);
}

/// Starts the process in the background, passes its words on until it is up, and returns.
pub fn run(context: &CommandContext) -> CommandResult {
    let failed = |what: &str, error: &std::io::Error| {
        CommandFailure::usage(CLI_SYSTEM, format!("{what}: {error}"), "deploy without `--detach`, or try again")
    };
    let program = std::env::current_exe().map_err(|e| failed("the program's own file is not known", &e))?;
    let arguments = std::env::args_os().skip(1).filter(|a| a != "--detach");
    // While it comes up, Ctrl-C here is passed on: it is stopped, as in the foreground. Before it is there already: who is
    // ended by a signal in the moment in which it begins would leave it to come up unasked.
    let passed = Arc::new(Mutex::new(Passed::by(interrupt)));
    let watch = {
        let (passed, last) = (passed.clone(), passed.clone());
        let left = |heard: bool| {
            if !heard {
                last_words::say(|| output::error(STAYS));
            }
            heard
        };
        let leave = move || {
            if !left(lock(&last).signal()) {
                last_words::end();
                std::process::exit(i32::from(Exit::Done.code()));
            }
        };
        SignalWatch::start(
            || true,
            move |_| {
                left(lock(&passed).signal());
            },
            || false,
            leave,
        )
        .map_err(super::deploy::unwatched)?
    };
    let mut child = {
        // Also a third signal, which ends the command, waits until there is somebody to be told.
        let mut passed = lock(&passed);
        let mut command = Command::new(program);
        command
            .args(arguments)
            .arg("--in-background")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            // A group of its own: Ctrl-C in this terminal is not meant for it any more.
            .process_group(0);
        ends_with_this_process(&mut command);
        let child = command.spawn().map_err(|e| failed("the process in the background cannot be started", &e))?;
        passed.to(child.id());
        child
    };
    let stdout = child.stdout.take().expect("piped above");
    let mut came_up = false;
    for line in BufReader::new(stdout).lines() {
        match line {
            Ok(line) if line == UP => {
                if lock(&passed).leave_it() {
                    watch.until_the_end();
                    return Ok(Exit::Done);
                }
                came_up = true;
            }
            Ok(line) => context.out.line(line),
            Err(_) => break,
        }
    }
    let status = child.wait().map_err(|e| failed("the process in the background was lost", &e))?;
    let interrupted = lock(&passed).interrupted();
    // Where it has said nothing of its end itself.
    if let Some(signal) = status.signal() {
        let why = if interrupted { "interrupted; " } else { "" };
        context.out.error(format!("not up: {why}the process in the background was ended by signal {signal}\n"));
    } else if came_up {
        context
            .out
            .error("not up: interrupted in the moment in which it was; `davit status` says how it was shut down\n");
    }
    Ok(exit(status, interrupted))
}

/// Who is killed has asked for nothing more: what it brings up is led down then, as by SIGTERM (a shell has what it starts beside itself
/// ignore Ctrl-C), until it is up
/// ([`stays_by_itself`]).
fn ends_with_this_process(command: &mut Command) {
    let own = std::process::id();
    let signal = libc::c_ulong::try_from(libc::SIGTERM).unwrap_or_default();
    let begins = move || {
        // SAFETY: it sets one number of the process's own, and is a call of the system alone, as is the next.
        let (told, parent) = unsafe { (libc::prctl(libc::PR_SET_PDEATHSIG, signal), libc::getppid()) };
        // It may have ended before that was said.
        match told == 0 && u32::try_from(parent) == Ok(own) {
            true => Ok(()),
            false => Err(std::io::Error::from_raw_os_error(libc::ESRCH)),
        }
    };
    // SAFETY: between `fork` and `exec` nothing is allocated and no lock is taken by it.
    unsafe { command.pre_exec(begins) };
}

/// It is up: whoever has started it may end.
pub fn stays_by_itself() {
    // SAFETY: as above.
    unsafe { libc::prctl(libc::PR_SET_PDEATHSIG, libc::c_ulong::default()) };
}

/// Of a process that has ended and did not stay up.
fn exit(status: ExitStatus, interrupted: bool) -> Exit {
    match status.code() {
        // It is not up, however well that went.
        Some(0) | None if interrupted => Exit::No,
        Some(0) => Exit::Done,
        Some(1) => Exit::No,
        Some(2) => Exit::Usage,
        Some(4) => Exit::Forced,
        _ => Exit::Broken,
    }
}

fn interrupt(pid: u32) {
    // `kill` is the one program every Unix has for this; the standard library has no call for it.
    let _ = Command::new("kill").arg("-INT").arg(pid.to_string()).status();
}

/// Passes signals on to a process, also those that came before it was there.
struct Passed<F> {
    by: F,
    /// Once it is there.
    process: Option<u32>,
    /// It is up, and left alone.
    left: bool,
    signals: u32,
}

impl<F: FnMut(u32)> Passed<F> {
    fn by(by: F) -> Self {
        Self { by, process: None, left: false, signals: 0 }
    }

    /// One came; whether it is meant for the process, or will be.
    fn signal(&mut self) -> bool {
        if self.left {
            return false;
        }
        self.signals += 1;
        if let Some(process) = self.process {
            (self.by)(process);
        }
        true
    }

    /// It is there.
    fn to(&mut self, process: u32) {
        self.process = Some(process);
        (0..self.signals).for_each(|_| (self.by)(process));
    }

    /// Nothing more is meant for it, unless something was.
    fn leave_it(&mut self) -> bool {
        self.left = !self.interrupted();
        self.left
    }

    fn interrupted(&self) -> bool {
        self.signals > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_signal_that_comes_before_the_process_is_passed_on_to_it() {
        let mut told = Vec::new();
        let mut passed = Passed::by(|process| told.push(process));
        assert!(passed.signal());
        passed.to(7);
        assert!(!passed.leave_it(), "it is going down");
        assert!(passed.signal());
        assert_eq!(told, [7, 7]);
    }

    #[test]
    fn what_is_up_is_left_alone() {
        let mut told = Vec::new();
        let mut passed = Passed::by(|process| told.push(process));
        passed.to(7);
        assert!(passed.leave_it());
        assert!(!passed.signal(), "who sent it is told that it stays up");
        assert_eq!(told, [0_u32; 0]);
    }

    #[test]
    fn what_ended_of_an_interruption_is_not_up() {
        let of_signal = ExitStatus::from_raw(2);
        assert_eq!((exit(of_signal, true), exit(of_signal, false)), (Exit::No, Exit::Broken));
        let well = ExitStatus::from_raw(0);
        assert_eq!((exit(well, true), exit(well, false)), (Exit::No, Exit::Done));
        assert_eq!(exit(ExitStatus::from_raw(4 << 8), true), Exit::Forced);
    }
}
