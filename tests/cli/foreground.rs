//! A deployment in the foreground as a process of its own, with streams of the test's choosing; and waiting for it.

use crate::demo::Demo;
use davit::time::Clock;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::process::CommandExt;
use std::process::{Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// How long anything may take in these tests before it counts as hanging: the machine may be busy.
pub const LIMIT: Duration = Duration::from_secs(90);

/// Looks again and again until there is something to be seen.
///
/// # Panics
/// When there is nothing for long.
pub fn until<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let clock = Clock::real();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(clock.now().as_secs_f64() < LIMIT.as_secs_f64(), "{what}: not in {} s", LIMIT.as_secs());
        clock.sleep(Duration::from_millis(20));
    }
}

/// A process that is killed when the test ends before it does.
pub struct Foreground {
    id: i32,
    ended: mpsc::Receiver<ExitStatus>,
    over: bool,
}

impl Foreground {
    pub fn start(command: &mut Command) -> Self {
        // A group of its own: nothing that the test is told by its terminal is meant for it.
        let mut child = command.stdin(Stdio::null()).process_group(0).spawn().expect("the program starts");
        let id = i32::try_from(child.id()).expect("a number of a process");
        let (tell, ended) = mpsc::channel();
        std::thread::spawn(move || tell.send(child.wait().expect("it can be waited for")));
        Self { id, ended, over: false }
    }

    pub fn id(&self) -> i32 {
        self.id
    }

    pub fn signal(&self, signal: i32) {
        // SAFETY: a signal to a process of ours.
        assert_eq!(unsafe { libc::kill(self.id, signal) }, 0, "{}", io::Error::last_os_error());
    }

    /// Once more, so long after what came before that it is no echo of that.
    pub fn signal_again(&self, signal: i32) {
        Clock::real().sleep(Duration::from_millis(700));
        self.signal(signal);
    }

    /// How it ended.
    ///
    /// # Panics
    /// When it does not end.
    pub fn end(mut self) -> ExitStatus {
        let ended = self.ended.recv_timeout(LIMIT).expect("it ends");
        self.over = true;
        ended
    }
}

impl Drop for Foreground {
    fn drop(&mut self) {
        if !self.over && self.ended.try_recv().is_err() {
            self.signal(libc::SIGKILL);
        }
    }
}

impl Demo {
    /// Waits until `davit status` shows a phase.
    pub fn until_phase(&self, phase: &str) {
        until(phase, || {
            let ran = self.command(&["status", "--json"]).output().expect("the program starts");
            let status: serde_json::Value = serde_json::from_slice(&ran.stdout).ok()?;
            (status["phase"] == phase).then_some(())
        });
    }
}

/// A pipe that holds as much as it can, so that whoever writes to it waits; nobody reads it.
pub fn full_pipe() -> (OwnedFd, OwnedFd) {
    let mut ends = [0; 2];
    // SAFETY: two descriptors are written to a place for two.
    assert_eq!(unsafe { libc::pipe2(ends.as_mut_ptr(), libc::O_CLOEXEC) }, 0);
    // SAFETY: both were opened just now and belong to nobody else.
    let (read, write) = unsafe { (OwnedFd::from_raw_fd(ends[0]), OwnedFd::from_raw_fd(ends[1])) };
    blocking(&write, false);
    let mut to = File::from(write);
    for size in [1 << 16, 1] {
        while to.write_all(&vec![b'x'; size]).is_ok() {}
    }
    let write = OwnedFd::from(to);
    blocking(&write, true);
    (read, write)
}

fn blocking(fd: &OwnedFd, is: bool) {
    // SAFETY: flags of an open descriptor.
    let set = unsafe { libc::fcntl(fd.as_raw_fd(), libc::F_SETFL, if is { 0 } else { libc::O_NONBLOCK }) };
    assert_eq!(set, 0);
}

/// A terminal: the end that a person sits at, and the one that programs are given.
pub fn terminal() -> (File, OwnedFd) {
    let (mut person, mut program) = (0, 0);
    let null = std::ptr::null_mut();
    // SAFETY: two descriptors are written to two places; no name, settings or size are asked for or given.
    let opened = unsafe { libc::openpty(&raw mut person, &raw mut program, null, null.cast(), null.cast()) };
    assert_eq!(opened, 0, "{}", io::Error::last_os_error());
    for fd in [person, program] {
        // SAFETY: flags of an open descriptor.
        assert_eq!(unsafe { libc::fcntl(fd, libc::F_SETFD, libc::FD_CLOEXEC) }, 0);
    }
    // SAFETY: both were opened just now and belong to nobody else.
    unsafe { (File::from_raw_fd(person), OwnedFd::from_raw_fd(program)) }
}

/// What is on a stream until `end` is in it.
pub fn read_until(stream: &mut File, end: &str) -> String {
    let mut text = Vec::new();
    let mut chunk = [0; 4096];
    while !String::from_utf8_lossy(&text).contains(end) {
        match stream.read(&mut chunk) {
            Ok(n) if n > 0 => text.extend_from_slice(&chunk[..n]),
            _ => break,
        }
    }
    String::from_utf8_lossy(&text).into_owned()
}

/// A line editor has the terminal take single keys. Who is asked to end gives it back as it was.
#[test]
fn a_simulation_that_is_asked_to_end_gives_the_terminal_back() {
    let demo = Demo::new();
    let settings = |terminal: &OwnedFd| {
        let mut settings = std::mem::MaybeUninit::<libc::termios>::uninit();
        // SAFETY: as large as what is written, and read where it was.
        unsafe {
            assert_eq!(libc::tcgetattr(terminal.as_raw_fd(), settings.as_mut_ptr()), 0);
            settings.assume_init().c_lflag
        }
    };
    for signal in [libc::SIGTERM, libc::SIGHUP, libc::SIGQUIT] {
        let (mut person, program) = terminal();
        let before = settings(&program);
        let ends = || Stdio::from(program.try_clone().unwrap());
        let mut sim = demo.command(&["sim", "coordinator.lua"]);
        let mut sim = sim.env("TERM", "xterm").stdin(ends()).stdout(ends()).stderr(ends()).spawn().unwrap();
        read_until(&mut person, "> ");
        until("it takes single keys", || (settings(&program) != before).then_some(()));
        // SAFETY: our own child, which was not waited for.
        assert_eq!(unsafe { libc::kill(sim.id().cast_signed(), signal) }, 0);
        let ended = sim.wait().unwrap();
        assert_eq!(std::os::unix::process::ExitStatusExt::signal(&ended), Some(signal));
        assert_eq!(settings(&program), before);
    }
}
