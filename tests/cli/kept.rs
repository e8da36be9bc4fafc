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
    child.signal(libc::SIGINT);
    let mut tried = 0;
    until("the second is heard", || {
        tried += 1;
        let status = demo.run(&["status", "--json"]).json();
        (status["stopping"]["stage"] == "forced" || tried > 20).then_some(())
    });
    child.signal(libc::SIGINT);
    assert_eq!(child.end().code(), Some(4));
    let status = demo.run(&["status", "demo"]);
    assert!(status.code == 1 && status.err.contains("by a third signal"), "{}{}", status.out, status.err);
}

/// What a process wrote down of itself was damaged, at its beginning or behind it: that it was there is told all the same.
#[test]
fn of_one_whose_record_is_damaged_it_is_told_that_it_died() {
    let demo = Demo::new();
    deploy(&demo, "deployment.yaml");
    kill(&demo, "demo");
    let whole = demo.read("state/davit/demo.life");
    for damaged in ["", "\u{1}garbage", "{\"pid\": 3", &format!("{whole}{{\"at\": ")] {
        demo.write("state/davit/demo.life", damaged);
        let status = demo.run(&["status", "demo"]);
        assert_eq!(status.code, 4, "{damaged:?}: {}{}", status.out, status.err);
        for words in ["demo  died  its record is damaged", "it was       up", "look at the hardware"] {
            assert!(status.out.contains(words), "{damaged:?}, {words}: {}", status.out);
        }
        assert_eq!(demo.run(&["status", "--json"]).json()["damaged"], true);
        assert!(demo.run(&["list"]).out.contains("demo  died"), "{damaged:?}");
    }
    assert_eq!(demo.run(&["list", "--forget", "demo"]).code, 0);
    assert_eq!(demo.run(&["list"]).out, "no deployment is running\n");
}
