//! Nobody reads what a deployment prints: a terminal that was stopped (Ctrl-S), a pipe that is full. It goes on all the same.

use crate::demo::Demo;
use crate::foreground::{Foreground, LIMIT, full_pipe, read_until, terminal, until};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::Stdio;

/// It comes up, answers, and goes down in order.
fn lives(demo: &Demo, deployed: Foreground, end: impl FnOnce(&Foreground)) {
    demo.until_phase("up");
    let fast = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]);
    assert_eq!(fast.code, 0, "the coordinator reacts: {}{}", fast.out, fast.err);
    end(&deployed);
    let ended = deployed.end();
    assert_eq!(ended.code(), Some(0), "{ended}");
}

#[test]
fn a_full_pipe_stops_nothing() {
    for json in [false, true] {
        let demo = Demo::new();
        let (_nobody, pipe) = full_pipe();
        let (_nobody_either, errors) = full_pipe();
        let mut command = demo.command(&["deploy", "deployment.yaml"]);
        command.args(json.then_some("--json")).stdout(Stdio::from(pipe)).stderr(Stdio::from(errors));
        let deployed = Foreground::start(&mut command);
        lives(&demo, deployed, |deployed| match json {
            true => deployed.signal(libc::SIGINT),
            false => assert_eq!(demo.run(&["shutdown"]).code, 0),
        });
    }
}

#[test]
fn a_second_signal_is_heard_too() {
    let demo = Demo::new();
    // Something hangs on the way down, and nobody would wait for less than a minute.
    let faults = "faults:\n  - { step: \"stop source\", how: hang, times: 9 }\n";
    demo.write("deployment.yaml", &format!("{}{faults}", demo.read("deployment.yaml")));
    demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle,      within_s: 600");
    let (_nobody, pipe) = full_pipe();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::from(pipe)).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    deployed.signal(libc::SIGINT);
    demo.until_phase("shutting_down");
    deployed.signal_again(libc::SIGINT);
    assert!(deployed.end().code().is_some_and(|code| code != 0), "it says that it did not end in order");
}

#[test]
fn a_stopped_terminal_stops_nothing_and_shows_the_rest_when_it_goes_on() {
    let demo = Demo::new();
    let (mut person, program) = terminal();
    // Ctrl-S.
    person.write_all(b"\x13").unwrap();
    let mut command = demo.command(&["deploy", "deployment.yaml", "--color", "never"]);
    command.stdout(Stdio::from(program.try_clone().unwrap())).stderr(Stdio::from(program));
    let deployed = Foreground::start(&mut command);
    drop(command);
    demo.until_phase("up");
    assert_eq!(demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]).code, 0);
    // Ctrl-Q: all of it was kept.
    person.write_all(b"\x11").unwrap();
    let shown = read_until(&mut person, "fast.ok");
    for word in ["create_all.ok", "connect_all.ok", "start_all.ok", "up after", "fast.ok"] {
        assert!(shown.contains(word), "`{word}` is not in\n{shown}");
    }
    person.write_all(b"\x13").unwrap();
    deployed.signal(libc::SIGINT);
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn a_stopped_terminal_does_not_keep_a_script_or_a_failed_bring_up_from_its_end() {
    let demo = Demo::new();
    demo.write("script.lua", "deploy('deployment.yaml') wait_state('operational', 20) for i = 1, 300 do say('x') end");
    demo.write("failing.lua", "deploy('deployment.yaml') error('no luck')");
    for (args, code) in
        [(&["run", "script.lua"][..], 0), (&["run", "failing.lua"], 1), (&["deploy", "missing.yaml"], 2)]
    {
        let (mut person, program) = terminal();
        person.write_all(b"\x13").unwrap();
        let mut command = demo.command(args);
        command.stdout(Stdio::from(program.try_clone().unwrap())).stderr(Stdio::from(program));
        let ended = Foreground::start(&mut command).end();
        assert_eq!(ended.code(), Some(code), "{args:?}: {ended}");
    }
}

#[test]
fn in_simulated_time_a_slow_reader_misses_nothing() {
    let demo = Demo::new();
    // Many times what the queue holds.
    let lines = 40_000;
    demo.write("script.lua", &format!("for i = 1, {lines} do say(tostring(i)) end"));
    let (mut person, program) = terminal();
    let mut command = demo.command(&["run", "script.lua", "--clock", "simulated", "--json"]);
    command.stdout(Stdio::from(program));
    let ran = Foreground::start(&mut command);
    drop(command);
    // To the end of that line.
    let said = read_until(&mut person, &format!("\"text\":\"{lines}\",\"what\":\"said\"}}"));
    let texts: Vec<usize> = said
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok()?["text"].as_str()?.parse().ok())
        .collect();
    assert_eq!(texts, (1..=lines).collect::<Vec<usize>>());
    assert_eq!(ran.end().code(), Some(0));
}

#[test]
fn what_a_full_disk_does_not_take_is_an_error() {
    let demo = Demo::new();
    let full = || File::options().write(true).open("/dev/full").unwrap();
    demo.write("script.lua", "say('hello')");
    for args in [
        &["check", "deployment.yaml"][..],
        &["check", "deployment.yaml", "--json"],
        &["plan", "deployment.yaml"],
        &["graph", "deployment.yaml"],
        &["convert", "coordinator.lua", "--to", "yaml"],
        &["explain"],
        &["completions", "bash"],
        &["types"],
        &["--help"],
        &["--version"],
        &["run", "script.lua"],
    ] {
        let ran = demo.command(args).stdout(full()).output().unwrap();
        let err = String::from_utf8_lossy(&ran.stderr);
        assert_eq!(ran.status.code(), Some(2), "{args:?}: {err}");
        assert!(err.contains("cli::unwritable") && err.contains("could not be written"), "{args:?}: {err}");
    }
    // A no stays a no; and a reader that went away is none.
    demo.replace("configurations.lua", "\"source.y\"", "\"source.z\"");
    assert_eq!(demo.command(&["check", "deployment.yaml"]).stdout(full()).output().unwrap().status.code(), Some(1));
    let (read, write) = full_pipe();
    drop(read);
    let ran = demo.command(&["explain"]).stdout(Stdio::from(write)).output().unwrap();
    assert_eq!((ran.status.code(), ran.stderr.len()), (Some(0), 0), "{}", String::from_utf8_lossy(&ran.stderr));
}

#[test]
fn a_deployment_outlives_a_full_disk() {
    let demo = Demo::new();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(File::options().write(true).open("/dev/full").unwrap()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(deployed.end().code(), Some(2), "its end says that its story is not whole");
}

#[test]
fn a_terminal_that_is_closed_is_no_full_disk() {
    let demo = Demo::new();
    let (person, program) = terminal();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::from(program.try_clone().unwrap())).stderr(Stdio::from(program));
    let deployed = Foreground::start(&mut command);
    drop(command);
    demo.until_phase("up");
    drop(person);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn when_descriptors_run_out_nothing_spins_and_the_next_one_is_told() {
    // Two limits, so that one of them is reached whether a connection takes one descriptor or two.
    for limit in [40, 41] {
        runs_out(limit);
    }
}

fn runs_out(limit: u32) {
    let demo = Demo::new();
    let program = env!("CARGO_BIN_EXE_davit");
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &format!("ulimit -n {limit}; exec '{program}' deploy deployment.yaml")]);
    command.current_dir(demo.path("")).env("XDG_RUNTIME_DIR", demo.path("")).env("XDG_STATE_HOME", demo.path("state"));
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    let connect = || UnixStream::connect(demo.path("davit/demo.sock")).unwrap();
    // More than there are descriptors or places: each is let in, or told so.
    let mut crowd: Vec<UnixStream> = (0..45).map(|_| connect()).collect();
    // A thread that spins never waits.
    let waits = || waits_of(deployed.id(), "davit-socket");
    let before = waits();
    until("the thread that accepts waits", || {
        // No more than the system keeps for who does not accept.
        if crowd.len() < 100 {
            crowd.push(connect());
        }
        (waits() >= before + 3).then_some(())
    });
    let mut last = connect();
    last.set_read_timeout(Some(LIMIT)).unwrap();
    let mut told = String::new();
    BufReader::new(&mut last).read_line(&mut told).unwrap();
    assert!(told.contains("too many connections"), "{told}");
    drop(crowd);
    until("places are free again", || {
        (demo.command(&["shutdown"]).output().unwrap().status.code() == Some(0)).then_some(())
    });
    assert_eq!(deployed.end().code(), Some(0));
}

/// How often a thread has waited for something.
fn waits_of(process: i32, thread: &str) -> u64 {
    let of = |task: std::fs::DirEntry| {
        let status = std::fs::read_to_string(task.path().join("status")).ok()?;
        let field = |name: &str| status.lines().find_map(|l| Some(l.strip_prefix(name)?.trim().to_owned()));
        (field("Name:")? == thread).then(|| field("voluntary_ctxt_switches:")?.parse().ok())?
    };
    let tasks = std::fs::read_dir(format!("/proc/{process}/task")).unwrap();
    tasks.filter_map(Result::ok).find_map(of).expect("a thread of that name")
}
