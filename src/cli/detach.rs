//! `davit deploy --detach`: the same command again as a process of its own, watched until it is up.
//!
//! The process in the background writes its story to a pipe. A line with [`UP`] says that it is up; the end of the pipe
//! without that line says that it is not, and its exit status says why.

use super::exit::Exit;
use super::output::{self, Output};
use super::{Answer, Context, Failure};
use crate::model::codes::CLI_SYSTEM;
use std::io::{BufRead, BufReader};
use std::os::unix::process::CommandExt;
use std::process::{Command, Stdio};

/// The line that says that the deployment is up. Not JSON and not a word anybody prints by chance.
const UP: &str = "\u{1}davit up\u{1}";

/// Says, in the process in the background, that the deployment is up. Nobody reads after it: the streams of who started it
/// are let go, so that a pipe that the command was typed with (`| tail`) ends with the command. What is said from now on is
/// [printed](super::printed) like what components say.
pub fn tell_up(out: Output) {
    out.line(UP);
    output::speak_to(None);
}

/// Starts the process in the background, passes its words on until it is up, and returns.
pub fn run(context: &Context) -> Answer {
    let failed = |what: &str, error: &std::io::Error| {
        Failure::usage(CLI_SYSTEM, format!("{what}: {error}"), "deploy without `--detach`, or try again")
    };
    let program = std::env::current_exe().map_err(|e| failed("the program's own file is not known", &e))?;
    let arguments = std::env::args_os().skip(1).filter(|a| a != "--detach");
    let mut child = Command::new(program)
        .args(arguments)
        .arg("--in-background")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        // A group of its own: Ctrl-C in this terminal is not meant for it any more.
        .process_group(0)
        .spawn()
        .map_err(|e| failed("the process in the background cannot be started", &e))?;
    let stdout = child.stdout.take().expect("piped above");
    // While it comes up, Ctrl-C here is passed on: it is stopped, as in the foreground.
    let pid = child.id();
    let _watch = super::signals::Watch::start(true, move |_| interrupt(pid, "INT"), move || interrupt(pid, "INT")).ok();
    for line in BufReader::new(stdout).lines() {
        match line {
            Ok(line) if line == UP => {
                return Ok(Exit::Done);
            }
            Ok(line) => context.out.line(line),
            Err(_) => break,
        }
    }
    let status = child.wait().map_err(|e| failed("the process in the background was lost", &e))?;
    Ok(match status.code() {
        Some(0) => Exit::Done,
        Some(1) => Exit::No,
        Some(2) => Exit::Usage,
        Some(4) => Exit::Forced,
        _ => Exit::Broken,
    })
}

fn interrupt(pid: u32, signal: &str) {
    // `kill` is the one program every Unix has for this; the standard library has no call for it.
    let _ = Command::new("kill").arg(format!("-{signal}")).arg(pid.to_string()).status();
}
