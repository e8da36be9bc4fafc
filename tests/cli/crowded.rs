//! All places of a running deployment's control socket are taken by others: an operator gets through all the same.

use crate::demo::Demo;
use crate::foreground::Foreground;
use davit::limits;
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::Stdio;

#[test]
fn idle_connections_do_not_lock_the_operator_out() {
    let demo = Demo::new();
    demo.write("deployment.yaml", &format!("{}safety: [e_fast]\n", demo.read("deployment.yaml")));
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    let come = || UnixStream::connect(demo.path("davit/demo.sock")).expect("they are let in");
    let mut crowd: Vec<UnixStream> = (0..limits::SOCKET_CONNECTIONS).map(|_| come()).collect();
    // Who found a place had that of a connection that was ending still when the crowd came: one more takes it.
    let mut refused = |args: &[&str]| {
        let mut told = demo.run(args);
        for _ in 0..5 {
            if told.err.contains("too many connections") {
                break;
            }
            crowd.push(come());
            told = demo.run(args);
        }
        assert!(told.err.contains("too many connections"), "{}{}", told.out, told.err);
        told.code
    };
    assert_eq!(refused(&["apply", "rename", "--force"]), 1);
    // What is declared as a safety event is heard, another event is not.
    let fast = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]);
    assert_eq!(fast.code, 0, "{}{}", fast.out, fast.err);
    assert_eq!(refused(&["event", "e_slow"]), 1);
    assert_eq!(demo.run(&["status"]).code, 0);
    assert_eq!(demo.run(&["shutdown", "--force"]).code, 4);
    assert!(deployed.end().code().is_some());
    drop(crowd);
}

/// Places are no more than there are descriptors for, beside those that are kept.
#[test]
fn where_descriptors_are_few_an_emergency_gets_through_all_the_same() {
    let demo = Demo::new();
    demo.write("deployment.yaml", &format!("{}safety: [e_fast]\n", demo.read("deployment.yaml")));
    let program = env!("CARGO_BIN_EXE_davit");
    let mut command = std::process::Command::new("sh");
    command.args(["-c", &format!("ulimit -n 32; exec '{program}' deploy deployment.yaml")]);
    command.current_dir(demo.path("")).env("XDG_RUNTIME_DIR", demo.path("")).env("XDG_STATE_HOME", demo.path("state"));
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    let come = || UnixStream::connect(demo.path("davit/demo.sock")).expect("they are let in, or told");
    let crowd: Vec<UnixStream> = (0..limits::SOCKET_CONNECTIONS).map(|_| come()).collect();
    let fast = demo.run(&["event", "e_fast", "--wait", "fast.ok", "--within", "60"]);
    assert_eq!(fast.code, 0, "{}{}", fast.out, fast.err);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(deployed.end().code(), Some(0));
    drop(crowd);
}

/// One client sends events faster than what they lead to is carried out: they wait, and some are refused, and no request fails for it.
#[test]
fn a_burst_of_events_fails_no_request() {
    const EVENTS: usize = 10_000;
    let demo = Demo::new();
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    let mut client = UnixStream::connect(demo.path("davit/demo.sock")).expect("a place");
    let answers = BufReader::new(client.try_clone().expect("both ends"));
    let sends = std::thread::spawn(move || {
        for number in 0..EVENTS {
            let event = ["e_fast", "e_slow"][number % 2];
            let params = serde_json::json!({ "event": event });
            let call = serde_json::json!({ "jsonrpc": "2.0", "id": number, "method": "event", "params": params });
            client.write_all(format!("{call}\n").as_bytes()).expect("it is read");
        }
        client
    });
    assert_eq!(answers.lines().take(EVENTS).filter(|line| line.is_ok()).count(), EVENTS, "each is answered");
    drop(sends.join().expect("all are sent"));
    let down = demo.run(&["shutdown", "--json"]);
    assert_eq!((down.code, &down.json()["stage"]), (0, &"led".into()), "{}{}", down.out, down.err);
    assert_eq!(deployed.end().code(), Some(0));
    let log = demo.read("state/davit/demo.log")
        + &std::fs::read_to_string(demo.path("state/davit/demo.log.1")).unwrap_or_default();
    assert!(log.contains("fast.ok") && !log.contains(".failed"), "no request failed");
}

/// Who could not be commanded does not come up, and has not lived.
#[test]
fn with_too_few_descriptors_nothing_is_deployed() {
    let demo = Demo::new();
    let program = env!("CARGO_BIN_EXE_davit");
    for background in ["", "--detach"] {
        let mut command = std::process::Command::new("sh");
        command.args(["-c", &format!("ulimit -n 20; exec '{program}' deploy deployment.yaml {background}")]);
        command
            .current_dir(demo.path(""))
            .env("XDG_RUNTIME_DIR", demo.path(""))
            .env("XDG_STATE_HOME", demo.path("state"));
        let deployed = command.stdin(Stdio::null()).output().expect("it runs");
        let said = String::from_utf8_lossy(&deployed.stderr);
        assert_eq!(deployed.status.code(), Some(2), "{said}");
        assert!(said.contains("descriptors are open") && said.contains("ulimit -n"), "{said}");
        let status = demo.run(&["status", "demo"]);
        assert!(status.err.contains("not_running") && !status.out.contains("died"), "{}{}", status.out, status.err);
    }
}
