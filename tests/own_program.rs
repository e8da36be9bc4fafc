//! A program with components of its own, one of which starts a thread that panics: whoever panics does not wait for a
//! terminal that was stopped, and what it had to say comes when that goes on.
//!
//! Without a harness: the program starts itself.

use davit::libraries;
use davit::runtime::{Builder, Component, Library};
use davit::time::Clock;
use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::process::{Command, ExitCode, Stdio};
use std::sync::mpsc;
use std::time::Duration;

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
        return davit::cli::main(libraries::builtin().with(Library::new("own").with::<Careless>("own.Careless")));
    }
    let folder = tempfile::tempdir().expect("a directory");
    for (name, text) in [("d.yaml", DEPLOYMENT), ("c.yaml", CONFIGURATIONS), ("c.lua", COORDINATOR)] {
        std::fs::write(folder.path().join(name), text).expect("a written file");
    }
    let program = |args: &[&str]| {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command.args(args).current_dir(&folder).env(PROGRAM, "1").env("XDG_RUNTIME_DIR", folder.path());
        command
    };
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
    ExitCode::SUCCESS
}
