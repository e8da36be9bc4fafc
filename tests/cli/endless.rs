//! Inputs without an end: each is refused, with a code, after so much of it as could be meant.

use crate::demo::Demo;
use std::io::Write;
use std::process::Stdio;

/// Refused with exit status 2 and this code.
fn refused(demo: &Demo, args: &[&str], code: &str) {
    let ran = demo.run(args);
    assert_eq!(ran.code, 2, "{args:?}: {}{}", ran.out, ran.err);
    assert!(ran.err.contains(code), "{args:?}: {}", ran.err);
}

#[test]
fn a_file_without_an_end_is_refused() {
    let demo = Demo::new();
    // Five gigabytes on no disk.
    std::fs::File::create(demo.path("huge.lua")).unwrap().set_len(5 << 30).unwrap();
    let mut pipes = Vec::new();
    for pipe in ["pipe.lua", "pipe.txt"] {
        assert!(std::process::Command::new("mkfifo").arg(demo.path(pipe)).status().unwrap().success());
        let mut endless = std::process::Command::new("sh");
        endless.args(["-c", &format!("exec cat /dev/zero > {pipe}")]).current_dir(demo.path(""));
        pipes.push(endless.stderr(Stdio::null()).spawn().unwrap());
    }
    for script in ["/dev/zero", "huge.lua", "pipe.lua"] {
        refused(&demo, &["run", script], "text::too_large");
    }
    for events in ["/dev/zero", "huge.lua", "pipe.txt"] {
        refused(&demo, &["sim", "coordinator.lua", "--events", events], "cli::events_unreadable");
    }
    for mut pipe in pipes {
        // It ends when nobody reads.
        pipe.wait().unwrap();
    }
}

#[test]
fn lines_without_an_end_are_refused() {
    let demo = Demo::new();
    let mut command = demo.command(&["sim", "coordinator.lua", "--events", "-"]);
    let mut sim = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let mut input = sim.stdin.take().unwrap();
    let line = format!("{}\n", " ".repeat(davit::limits::SIM_LINE - 1));
    let lines = davit::limits::SIM_BYTES / line.len() as u64;
    for _ in 0..lines {
        input.write_all(line.as_bytes()).expect("so much is read");
    }
    let _ = input.write_all(b"e_start\n");
    drop(input);
    let ended = sim.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(2), "{told}");
    assert!(told.contains("more than 64 MB"), "{told}");
}
