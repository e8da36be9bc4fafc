//! What the shell has held up, in a bounded form: malformed messages, requests in a row, memory over many requests, kills, and
//! files that are wrong in any way. `DAVIT_ENDURANCE=N` makes each N times as long, with other cases
//! (`DAVIT_ENDURANCE=100 cargo test --release --test cli -- endurance`).

use crate::demo::Demo;
use crate::foreground::{Foreground, LIMIT, until};
use serde_json::{Value as Json, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixStream;
use std::process::Stdio;

fn times() -> usize {
    std::env::var("DAVIT_ENDURANCE").ok().map_or(1, |n| n.parse().expect("DAVIT_ENDURANCE is a number"))
}

/// Numbers that look random, the same each time (splitmix64).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        usize::try_from((z ^ (z >> 31)) % n as u64).expect("below a usize")
    }

    fn of<'a, T: ?Sized>(&mut self, all: &[&'a T]) -> &'a T {
        all[self.below(all.len())]
    }
}

/// The demo, deployed in the foreground.
fn deployed(demo: &Demo) -> Foreground {
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    deployed
}

/// A program that speaks to the control socket.
struct Talk {
    stream: UnixStream,
    lines: std::io::Lines<BufReader<UnixStream>>,
}

impl Talk {
    fn with(demo: &Demo) -> Self {
        let stream = UnixStream::connect(demo.path("davit/demo.sock")).expect("a place is free");
        stream.set_read_timeout(Some(LIMIT)).expect("a limit");
        stream.set_write_timeout(Some(LIMIT)).expect("a limit");
        let lines = BufReader::new(stream.try_clone().expect("a second handle")).lines();
        Self { stream, lines }
    }

    fn say(&mut self, line: &[u8]) {
        self.stream.write_all(line).expect("it listens");
        self.stream.write_all(b"\n").expect("it listens");
    }

    fn hear(&mut self) -> Json {
        let line = self.lines.next().expect("it answers").expect("it answers in time");
        serde_json::from_str(&line).unwrap_or_else(|e| panic!("{e}: {line}"))
    }
}

fn request(id: impl Into<Json>, method: &str, params: Json) -> Vec<u8> {
    json!({"jsonrpc": "2.0", "id": id.into(), "method": method, "params": params}).to_string().into_bytes()
}

/// A request of some kind with something wrong in it, in one line. (Now and then nothing is wrong after all, or it is none that
/// is answered.)
fn malformed(random: &mut Random) -> Vec<u8> {
    let method =
        random.of(&["status", "stack", "log", "event", "apply", "undo", "wait_for", "shutdwn", "components", ""]);
    let params = match random.below(6) {
        0 => json!({"event": "no_such_event", "more": 1}),
        1 => json!({"configuration": random.below(9), "force": "yes"}),
        2 => json!([1, 2, [3, null]]),
        3 => json!({"events": [1, {}], "within_s": -1e300}),
        4 => json!({"a".repeat(random.below(2000)): "\u{0}\u{7f}\u{10ffff}"}),
        _ => Json::Null,
    };
    let mut line = request(random.below(1000), method, params);
    for _ in 0..=random.below(4) {
        let at = random.below(line.len());
        match random.below(6) {
            0 => line[at] = u8::try_from(random.below(256)).expect("a byte"),
            1 => drop(line.remove(at)),
            2 => line.truncate(at.max(1)),
            3 => line.insert(at, b"{}[]\",:\\0e-"[random.below(11)]),
            4 => line.splice(at..at, b"[".repeat(random.below(300))).for_each(drop),
            _ => line.extend_from_within(at..),
        }
        if line.is_empty() {
            line.push(b'x');
        }
    }
    line.retain(|byte| *byte != b'\n');
    line
}

#[test]
fn malformed_messages_are_answered_and_nothing_else_happens() {
    let demo = Demo::new();
    let deployed = deployed(&demo);
    let mut random = Random(times() as u64);
    let mut refused = 0;
    for round in 0..30 * times() {
        let mut talk = Talk::with(&demo);
        for _ in 0..50 {
            talk.say(&malformed(&mut random));
        }
        // Every line before this one has been read when it is answered.
        talk.say(&request(format!("end of {round}"), "status", Json::Null));
        loop {
            let answer = talk.hear();
            if answer["id"] == format!("end of {round}") {
                assert_eq!(answer["result"]["phase"], "up");
                break;
            }
            assert!(answer["error"]["code"].is_i64() || answer.get("result").is_some(), "{answer}");
            refused += usize::from(answer["error"]["code"].is_i64());
        }
    }
    assert!(refused > 20 * 30 * times(), "too few of them were wrong: {refused}");
    let stack = demo.run(&["stack", "--json"]).json();
    assert_eq!(stack.as_array().map(Vec::len), Some(4), "{stack}");
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn requests_in_a_row_are_answered_in_order() {
    let demo = Demo::new();
    let deployed = deployed(&demo);
    let all = 3_000 * times();
    let mut talk = Talk::with(&demo);
    let mut to = talk.stream.try_clone().expect("a second handle");
    let asking = std::thread::spawn(move || {
        for id in 0..all {
            let method = ["stack", "status", "nonsense"][id % 3];
            let mut line = request(id, method, Json::Null);
            line.push(b'\n');
            to.write_all(&line).expect("it listens");
        }
    });
    for id in 0..all {
        assert_eq!(talk.hear()["id"], id);
    }
    asking.join().expect("all were asked");
    deployed.signal(libc::SIGINT);
    assert_eq!(deployed.end().code(), Some(0));
}

/// Kilobytes that a process holds.
fn resident(id: i32) -> usize {
    let status = std::fs::read_to_string(format!("/proc/{id}/status")).expect("it is there");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("a line of it");
    line.split_whitespace().nth(1).and_then(|n| n.parse().ok()).expect("a number")
}

#[test]
fn memory_stays_what_it_is_over_many_requests() {
    let demo = Demo::new();
    let deployed = deployed(&demo);
    let mut talk = Talk::with(&demo);
    let mut ask = |rounds: usize| {
        for n in 0..rounds {
            let asked: &[(&str, Json)] = &[
                ("event", json!({"event": if n % 2 == 0 { "e_fast" } else { "e_slow" }, "wait": true})),
                ("status", Json::Null),
                ("apply", json!({"configuration": "rename", "force": true, "wait": true})),
                ("undo", json!({"configuration": "rename", "wait": true})),
            ];
            for (method, params) in asked {
                talk.say(&request(n, method, params.clone()));
                assert_eq!(talk.hear()["id"], n);
            }
        }
    };
    // What is kept by design (the log, answers that may be asked for again) is full after this.
    ask(2_000);
    let before = resident(deployed.id());
    ask(1_000 * times());
    let after = resident(deployed.id());
    assert!(after < before + 4096, "{before} KiB, then {after} KiB");
    deployed.signal(libc::SIGINT);
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn after_every_kill_the_next_start_is_a_clear_one() {
    let demo = Demo::new();
    let mut random = Random(times() as u64);
    for round in 0..3 * times() {
        let mut command = demo.command(&["deploy", "deployment.yaml"]);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let deployed = Foreground::start(&mut command);
        // At some moment of its start, or when it is up.
        match random.below(2) {
            0 => demo.until_phase("up"),
            _ => until("a socket", || demo.path("davit/demo.sock").exists().then_some(())),
        }
        deployed.signal(libc::SIGKILL);
        let _ = deployed.end();
        let again = demo.run(&["deploy", "deployment.yaml", "--detach"]);
        assert_eq!(again.code, 0, "round {round}: {}{}", again.out, again.err);
        assert_eq!(demo.run(&["shutdown"]).code, 0, "round {round}");
    }
}

/// One of the demo's files with a few words or bytes changed, moved, doubled or gone.
fn damaged(text: &str, random: &mut Random) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(bytes.len());
        let line = |bytes: &[u8]| {
            let from = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |n| n + 1);
            let to = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |n| at + n + 1);
            from..to
        };
        match random.below(6) {
            0 => bytes[at] = u8::try_from(random.below(256)).expect("a byte"),
            1 => drop(bytes.drain(line(&bytes))),
            2 => bytes.extend_from_within(line(&bytes)),
            3 => bytes.truncate(at),
            4 => {
                let word = random
                    .of(&["nil", "{", "}", "~", "\"", "--[[", "1e999", "source", "&a", "*a", "\u{feff}", "root", "- "]);
                drop(bytes.splice(at..at, word.bytes()));
            }
            _ => {
                let moved: Vec<u8> = bytes.drain(line(&bytes)).collect();
                let to = random.below(bytes.len() + 1);
                drop(bytes.splice(to..to, moved));
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    bytes
}

#[test]
fn whatever_is_wrong_in_a_file_is_told() {
    let demo = Demo::new();
    let mut random = Random(times() as u64);
    let files = ["deployment.yaml", "configurations.lua", "coordinator.lua"].map(|name| (name, demo.read(name)));
    let mut wrong = 0;
    for case in 0..120 * times() {
        let (name, text) = &files[case % files.len()];
        std::fs::write(demo.path(name), damaged(text, &mut random)).expect("a written file");
        let keep = || std::fs::read(demo.path(name)).unwrap_or_default();
        // `Demo::run` asserts that it ends by itself and does not panic.
        let told = demo.run(&["check", "deployment.yaml"]);
        let text_of = || String::from_utf8_lossy(&keep()).into_owned();
        assert!(matches!(told.code, 0..=2), "{}: {}\n{}", told.code, told.err, text_of());
        if told.code > 0 {
            wrong += 1;
            assert!(
                told.out.contains("::") || told.err.contains("::"),
                "no code: {}{}\n{}",
                told.out,
                told.err,
                text_of()
            );
        }
        std::fs::write(demo.path(name), text).expect("a written file");
    }
    assert!(wrong > 60 * times(), "too few of them are wrong: {wrong}");
}
