//! What is known of a deployment after its end: its log, how it ended, and of one that died when and how far it was.

use crate::demo::{Demo, Ran};
use crate::foreground::{Foreground, until};
use serde_json::Value;
use std::process::Stdio;

/// Kills what runs in the background without a word, and waits until it is gone.
pub fn kill(demo: &Demo, name: &str) {
    // SAFETY: a signal to a process of ours.
    assert_eq!(unsafe { libc::kill(process(demo, name), libc::SIGKILL) }, 0);
    until("its name is free", || {
        let ran = demo.command(&["event", "e_fast", "--on", name]).output().expect("the program starts");
        String::from_utf8_lossy(&ran.stderr).contains("cli::not_running").then_some(())
    });
}

/// The process that runs a deployment.
pub fn process(demo: &Demo, name: &str) -> i32 {
    let text = demo.read(&format!("state/davit/{name}.life"));
    let life: Value = serde_json::from_str(text.lines().next().expect("a line")).expect("JSON");
    i32::try_from(life["pid"].as_i64().expect("a number")).expect("of a process")
}

pub fn deploy(demo: &Demo, file: &str) -> Ran {
    let up = demo.run(&["deploy", file, "--detach"]);
    assert_eq!(up.code, 0, "{}{}", up.out, up.err);
    up
}

#[test]
fn of_one_that_was_killed_it_is_told_when_and_how_far_it_was() {
    let demo = Demo::new();
    deploy(&demo, "deployment.yaml");
    assert_eq!(demo.run(&["event", "e_fast", "--wait", "fast.ok"]).code, 0);
    // It is written beside what acts, a moment later.
    until("the answer is written", || {
        demo.read("state/davit/demo.log").contains("\"answer\":\"fast.ok\"").then_some(())
    });
    kill(&demo, "demo");

    for status in [demo.run(&["status"]), demo.run(&["status", "demo"])] {
        assert_eq!(status.code, 4, "{}{}", status.out, status.err);
        for words in [
            "demo  died  killed, or crashed; seen alive last at 2",
            "it was       up",
            "root.operational.fast_mode",
            "fast.ok",
            "look at the hardware",
            "`davit log demo`",
        ] {
            assert!(status.out.contains(words), "{words}: {}", status.out);
        }
    }
    let status = demo.run(&["status", "--json"]);
    let json = status.json();
    assert_eq!((status.code, &json["phase"], &json["was"]["phase"]), (4, &"died".into(), &"up".into()), "{json}");
    let states = json["was"]["coordinator"].as_array().expect("states").last().cloned();
    assert_eq!(states, Some("root.operational.fast_mode".into()));
    assert!(json["began"].as_str() <= json["seen"].as_str() && json["rebooted"] == false, "{json}");

    let log = demo.run(&["log", "demo", "--json"]);
    assert_eq!(log.code, 0, "{}", log.err);
    let entries = log.json();
    let entries = entries.as_array().expect("entries");
    assert_eq!(entries.first().map(|entry| &entry["what"]), Some(&"began".into()));
    assert!(entries.iter().any(|entry| entry["answer"] == "fast.ok"), "{}", log.out);
    assert!(log.err.contains("`demo` died"), "{}", log.err);
    assert_eq!(demo.run(&["log", "demo", "--last", "2"]).out.lines().count(), 2);
    let asked = demo.run(&["apply", "slow"]);
    assert!(asked.code == 1 && asked.err.contains("`demo` died"), "{}", asked.err);

    // The same name once more: another life, whose log begins anew, and that ends in order.
    deploy(&demo, "deployment.yaml");
    assert_eq!(demo.run(&["status"]).code, 0);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    let status = demo.run(&["status", "demo"]);
    assert!(status.code == 1 && status.err.contains("`demo` ended at 2"), "{}{}", status.out, status.err);
    let log = demo.run(&["log"]);
    assert_eq!(log.code, 0, "{}", log.err);
    assert!(!log.out.contains("fast.ok") && log.out.contains("create_all.undone"), "only the last life: {}", log.out);
    assert!(log.out.lines().last().is_some_and(|line| line.contains("ended      down")), "{}", log.out);
}

#[test]
fn what_cannot_be_kept_keeps_nobody_from_deploying() {
    let demo = Demo::new();
    demo.write("state", "no directory");
    let up = deploy(&demo, "deployment.yaml");
    assert!(up.err.contains("what happens is not kept"), "{}", up.err);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    let log = demo.run(&["log", "demo"]);
    assert!(log.code == 1 && log.err.contains("cli::not_running"), "{}", log.err);
    // Its record, but not its log: nothing is left that would be told as one that died.
    std::fs::remove_file(demo.path("state")).unwrap();
    std::fs::create_dir_all(demo.path("state/davit/demo.log")).unwrap();
    let up = deploy(&demo, "deployment.yaml");
    assert!(up.err.contains("what happens is not kept"), "{}", up.err);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(demo.run(&["list"]).out, "no deployment is running\n");
    assert_eq!(demo.run(&["status", "demo"]).code, 1);
}

#[test]
fn one_in_the_foreground_is_kept_too_also_when_a_third_signal_ends_it() {
    let demo = Demo::new();
    demo.replace(
        "deployment.yaml",
        "platform: simulated",
        "faults: [{ step: \"destroy sink\", how: hang }]\nplatform: simulated",
    );
    demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle, within_s: 600");
    demo.write("deployment.yaml", &(demo.read("deployment.yaml") + "limits: { step_timeout_s: 600 }\n"));
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    let child = Foreground::start(command.stdout(Stdio::null()).stderr(Stdio::null()));
    demo.until_phase("up");
    child.signal(libc::SIGINT);
    demo.until_phase("shutting_down");
    child.signal_again(libc::SIGINT);
    let mut tried = 0;
    until("the second is heard", || {
        tried += 1;
        let status = demo.run(&["status", "--json"]).json();
        (status["stopping"]["stage"] == "forced" && tried > 10 || tried > 20).then_some(())
    });
    child.signal_again(libc::SIGINT);
    assert_eq!(child.end().code(), Some(4));
    let status = demo.run(&["status", "demo"]);
    for words in ["demo  died  it was ended at once, by a third signal", "look at the hardware"] {
        assert!(status.code == 4 && status.out.contains(words), "{words}: {}{}", status.out, status.err);
    }
    let listed = demo.run(&["list"]);
    assert!(listed.out.contains("demo  died"), "{}", listed.out);
}

/// A script's deployment on the real clock is a robot that others find: what is known of an earlier life says nothing of it.
#[test]
fn of_one_that_a_script_had_it_is_told_how_it_ended() {
    let demo = Demo::new();
    deploy(&demo, "deployment.yaml");
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    demo.write("short.lua", "deploy('deployment.yaml') shutdown()");
    assert_eq!(demo.run(&["run", "short.lua"]).code, 0);
    let log = demo.run(&["log", "demo"]);
    assert!(log.out.contains("event      e_start from") && log.out.contains("ended      down"), "{}", log.out);
    demo.write("long.lua", "deploy('deployment.yaml') wait(600)");
    let start = || {
        let mut command = demo.command(&["run", "long.lua"]);
        let child = Foreground::start(command.stdout(Stdio::null()).stderr(Stdio::null()));
        demo.until_phase("up");
        child
    };
    let child = start();
    assert_eq!(process(&demo, "demo"), child.id());
    child.signal(libc::SIGKILL);
    child.end();
    let status = demo.run(&["status", "demo"]);
    assert!(status.code == 4 && status.out.contains("killed, or crashed"), "{}{}", status.out, status.err);
    assert!(status.out.contains("deployment.yaml") && !status.out.contains("long.lua"), "{}", status.out);

    // By its third signal: a step hangs in the way of the force that the second one asks for.
    demo.replace(
        "deployment.yaml",
        "platform: simulated",
        "faults: [{ step: \"destroy sink\", how: hang }]\nplatform: simulated",
    );
    demo.replace("deployment.yaml", "down: idle,      within_s: 5", "down: idle, within_s: 600");
    demo.write("deployment.yaml", &(demo.read("deployment.yaml") + "limits: { step_timeout_s: 600 }\n"));
    let child = start();
    child.signal(libc::SIGINT);
    demo.until_phase("shutting_down");
    child.signal_again(libc::SIGINT);
    until("the second is heard", || {
        (demo.run(&["status", "--json"]).json()["stopping"]["stage"] == "forced").then_some(())
    });
    child.signal_again(libc::SIGINT);
    assert_eq!(child.end().code(), Some(4));
    let status = demo.run(&["status", "demo"]);
    let words = "demo  died  it was ended at once, by a third signal";
    assert!(status.code == 4 && status.out.contains(words), "{}{}", status.out, status.err);
    let socket = demo.path("davit/demo.sock");
    assert!(!socket.exists(), "{}", socket.display());
}

/// What a process wrote down of itself was damaged, at its beginning or behind it, or something else stands there: that is told,
/// and neither a death nor an end that there may not have been.
#[test]
fn of_one_whose_record_is_damaged_it_is_told_that_it_is() {
    let demo = Demo::new();
    deploy(&demo, "deployment.yaml");
    kill(&demo, "demo");
    let died = demo.read("state/davit/demo.life");
    deploy(&demo, "deployment.yaml");
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    let ended = demo.read("state/davit/demo.life");
    assert_eq!(demo.run(&["status", "demo"]).code, 1, "whole, it is one that was shut down");
    let end = ended.lines().nth(1).unwrap();
    let damages = [
        String::new(),
        "\u{1}garbage".to_owned(),
        "{\"pid\": 3".to_owned(),
        format!("{died}{{\"at\": "),
        died.trim_end().to_owned(),
        format!("{{\"a\": 1}}\n{end}\n"),
        "{\"at\": 1}\n{\"at\": 2}\n".to_owned(),
        ended.replace("\"demo\"", "\"other\""),
        ended.replace("{\"at\"", "{\"also\":1,\"at\""),
        format!("{ended}garbage\n"),
        format!("{ended}\n"),
        format!("{ended}\u{0}\u{0}"),
    ];
    let told = |damage: &str| {
        let status = demo.run(&["status", "demo"]);
        assert_eq!(status.code, 4, "{damage:?}: {}{}", status.out, status.err);
        for words in ["demo  damaged  its record cannot be read", "`davit list --forget demo`", "look at the hardware"]
        {
            assert!(status.out.contains(words), "{damage:?}, {words}: {}", status.out);
        }
        let json = demo.run(&["status", "--json"]).json();
        assert_eq!((&json["phase"], &json["damaged"]), (&"damaged".into(), &true.into()), "{damage:?}");
        assert!(demo.run(&["list"]).out.contains("demo  damaged"), "{damage:?}");
    };
    for damage in damages {
        demo.write("state/davit/demo.life", &damage);
        told(&damage);
    }
    assert_eq!(demo.run(&["list", "--forget", "demo"]).code, 0);
    assert_eq!(demo.run(&["list"]).out, "no deployment is running\n");
    std::fs::create_dir_all(demo.path("state/davit/demo.life/full")).unwrap();
    told("a folder");
    let full = demo.run(&["list", "--forget", "demo"]);
    assert!(full.code == 2 && full.err.contains("by hand"), "{}{}", full.out, full.err);
    std::fs::remove_dir(demo.path("state/davit/demo.life/full")).unwrap();
    assert_eq!(demo.run(&["list", "--forget", "demo"]).code, 0);
    assert_eq!(demo.run(&["list"]).out, "no deployment is running\n");
}
