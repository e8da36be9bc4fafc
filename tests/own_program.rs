//! A program with components of its own, one of which prints and starts a thread that panics. Whoever panics does not wait for a
//! terminal that was stopped, and what it had to say comes when that goes on; in the background what is printed is kept.
//!
//! Without a harness: the program starts itself.

use davit::Clock;
use davit::component::{Builder, Component, Library};
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::process::{Command, ExitCode, Stdio};
use std::sync::mpsc;
use std::time::Duration;
use tempfile::TempDir;

const LIMIT: Duration = Duration::from_secs(90);
const PROGRAM: &str = "DAVIT_TEST_OWN_PROGRAM";

const DEPLOYMENT: &str = "davit: 1
name: own
platform: embedded
libraries: [own]
configurations: [c.yaml]
coordinator: c.lua
deploy: { event: e_start, up: on, failed: [failed], within_s: 60 }
shutdown: { event: e_stop, down: idle, within_s: 60 }
";

const CONFIGURATIONS: &str = "configurations:
  build:
    changes:
      - create: { component: Careless, type: own.Careless }
    post_conf_state: [\"Careless:running\"]
";

const COORDINATOR: &str = "return state {
  idle = state {}, failed = state {}, leaving = state { entry = 'build.undo' },
  up = state { entry = 'build', building = state {}, on = state {},
    trans { src = 'initial', tgt = 'building' },
    trans { src = 'building', tgt = 'on', events = { 'build.ok' } },
  },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'up', events = { 'e_start' } },
  trans { src = 'up', tgt = 'failed', events = { 'build.failed', 'build.broken' } },
  trans { src = 'up', tgt = 'leaving', events = { 'e_stop' } },
  trans { src = 'leaving', tgt = 'idle', events = { 'build.undone' } },
  trans { src = 'leaving', tgt = 'failed', events = { 'build.undo.failed', 'build.undo.broken' } },
  trans { src = 'failed', tgt = 'leaving', events = { 'e_stop' } },
}
";

/// Waits, where it is started, for a thread of its own that panics: were that kept waiting, so would this be.
struct Careless;

impl Component for Careless {
    fn new(b: &mut Builder<Self>) -> Self {
        b.on_start(|_, _| {
            println!("on my way");
            let _ = std::thread::spawn(panics).join();
            Ok(())
        });
        Self
    }
}

fn panics() {
    panic!("careless");
}

/// A pipe that takes nothing more.
fn full_pipe() -> (File, OwnedFd) {
    let mut ends = [0; 2];
    // SAFETY: two descriptors are written to a place for two.
    assert_eq!(unsafe { libc::pipe2(ends.as_mut_ptr(), libc::O_CLOEXEC) }, 0);
    // SAFETY: both were opened just now and belong to nobody else.
    let (read, mut write) = unsafe { (File::from_raw_fd(ends[0]), File::from_raw_fd(ends[1])) };
    // SAFETY: flags of an open descriptor.
    let flags = |flags: i32| assert_eq!(unsafe { libc::fcntl(ends[1], libc::F_SETFL, flags) }, 0);
    flags(libc::O_NONBLOCK);
    for size in [1 << 16, 1] {
        while write.write_all(&vec![b'x'; size]).is_ok() {}
    }
    flags(0);
    assert!(read.as_raw_fd() > 2);
    (read, OwnedFd::from(write))
}

fn main() -> ExitCode {
    if std::env::var_os(PROGRAM).is_some() {
        return davit::main(davit::builtin().with(Library::new("own").with::<Careless>("own.Careless")));
    }
    a_panic_does_not_wait_for_its_reader();
    what_is_printed_in_the_background_is_kept();
    ExitCode::SUCCESS
}

/// A directory with the deployment, and how the program is started in it.
fn folder() -> (TempDir, impl Fn(&[&str]) -> Command) {
    let folder = tempfile::tempdir().expect("a directory");
    for (name, text) in [("d.yaml", DEPLOYMENT), ("c.yaml", CONFIGURATIONS), ("c.lua", COORDINATOR)] {
        std::fs::write(folder.path().join(name), text).expect("a written file");
    }
    let path = folder.path().to_owned();
    let program = move |args: &[&str]| {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command.args(args).current_dir(&path).env(PROGRAM, "1").env("XDG_RUNTIME_DIR", &path);
        command.env("XDG_STATE_HOME", path.join("state"));
        command
    };
    (folder, program)
}

/// Does something at the end, whatever the test found.
struct Last<F: Fn()>(F);

impl<F: Fn()> Drop for Last<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

fn what_is_printed_in_the_background_is_kept() {
    let (_folder, program) = folder();
    let _down = Last(|| drop(program(&["shutdown", "--force"]).output()));
    let run = |args: &[&str]| {
        let ran = program(args).output().expect("the program starts");
        (ran.status.code(), String::from_utf8_lossy(&ran.stdout).into_owned() + &String::from_utf8_lossy(&ran.stderr))
    };
    let (code, up) = run(&["deploy", "d.yaml", "--detach"]);
    assert_eq!(code, Some(0), "{up}");
    let said = ["printed    on my way", "panicked at", "printed    careless"];
    let (_, log) = run(&["log"]);
    said.iter().for_each(|line| assert!(log.contains(line), "{line} while it runs: {log}"));
    assert!(up.contains("on my way"), "and who started it sees it: {up}");
    let (code, down) = run(&["shutdown"]);
    assert_eq!(code, Some(0), "{down}");
    let (code, log) = run(&["log", "own"]);
    assert_eq!(code, Some(0), "{log}");
    said.iter().for_each(|line| assert!(log.contains(line), "{line} after the end: {log}"));
    assert!(log.contains("build.undone") && log.contains("ended      down"), "{log}");
    println!("test what_is_printed_in_the_background_is_kept ... ok");
}

fn a_panic_does_not_wait_for_its_reader() {
    let (_folder, program) = folder();
    let (mut read, write) = full_pipe();
    let mut command = program(&["deploy", "d.yaml"]);
    let mut child = command.stdout(Stdio::null()).stderr(write).spawn().expect("the program starts");
    drop(command);
    let (tell, ended) = mpsc::channel();
    let clock = Clock::real();
    loop {
        let status = program(&["status", "--json"]).output().expect("the program starts");
        if String::from_utf8_lossy(&status.stdout).contains("\"phase\": \"up\"") {
            break;
        }
        if clock.now().as_secs_f64() > LIMIT.as_secs_f64() {
            let _ = child.kill();
            panic!("it does not come up: {}", String::from_utf8_lossy(&status.stdout));
        }
        clock.sleep(Duration::from_millis(50));
    }
    // Now somebody reads.
    let reads = std::thread::spawn(move || {
        let mut text = Vec::new();
        let _ = read.read_to_end(&mut text);
        String::from_utf8_lossy(&text).trim_start_matches('x').to_owned()
    });
    let down = program(&["shutdown"]).output().expect("the program starts");
    assert!(down.status.success(), "{}", String::from_utf8_lossy(&down.stderr));
    std::thread::spawn(move || tell.send(child.wait()));
    let ended = ended.recv_timeout(LIMIT).expect("it ends").expect("it can be waited for");
    let told = reads.join().expect("what it said");
    assert!(told.contains("panicked at") && told.contains("careless"), "{told}");
    assert_eq!(ended.code(), Some(0), "{told}");
    println!("test a_panic_does_not_wait_for_its_reader ... ok");
}
