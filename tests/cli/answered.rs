//! `apply`, `undo` and `event` end with their answer, as their exit status says it; `log --follow` goes on.

use crate::demo::Demo;
use crate::foreground::Foreground;
use std::io::{BufRead, BufReader};
use std::process::Stdio;

/// Fails once and breaks once, where it is told to.
const FAULTS: &str = "
faults:
  - { step: \"property_set source.k = 9.0\", how: fail, times: 1 }
";

fn deployed() -> (Demo, Foreground) {
    let demo = Demo::new();
    demo.write("deployment.yaml", &format!("{}{FAULTS}", demo.read("deployment.yaml")));
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    (demo, deployed)
}

#[test]
fn requests_end_with_their_answer() {
    let (demo, deployed) = deployed();
    let run = |args: &[&str]| demo.run(args);
    // It fails, and is heard though the other one was waited for.
    let failed = run(&["event", "e_fast", "--wait", "fast.ok", "--within", "80"]);
    assert_eq!((failed.code, failed.out.as_str()), (1, "fast.failed after e_fast\n"), "{}", failed.err);
    // It is in the slow state again, where nobody hears this one.
    let unheard = run(&["event", "e_slow", "--within", "80"]);
    assert_eq!(
        (unheard.code, unheard.out.as_str()),
        (1, "e_slow raised, and no transition heard it\n"),
        "{}",
        unheard.err
    );
    let heard = run(&["event", "e_fast", "--within", "80"]);
    assert_eq!((heard.code, heard.out.as_str()), (0, "e_fast heard\n"), "{}", heard.err);
    assert_eq!(run(&["event", "e_slow", "--no-wait"]).out, "e_slow raised\n");
    let refused = run(&["apply", "rename"]);
    assert_eq!(refused.code, 1, "{}{}", refused.out, refused.err);
    assert!(refused.out.starts_with("rename.failed") && !refused.out.contains("accepted"), "{}", refused.out);
    let asked = run(&["apply", "rename", "--no-wait"]);
    assert!(asked.code == 0 && !asked.out.contains("accepted"), "{}", asked.out);
    assert!(asked.out.contains("`davit log` shows how it is answered"), "{}", asked.out);
    let applied = run(&["apply", "rename", "--force", "--json"]);
    assert_eq!((applied.code, applied.json()["answer"].clone()), (0, "rename.ok".into()));
    assert_eq!(run(&["undo"]).code, 0);
    let nothing = run(&["undo"]);
    assert!(nothing.code == 1 && nothing.out.starts_with("undo.failed"), "{}{}", nothing.out, nothing.err);
    // What was needed before still goes.
    assert_eq!(run(&["apply", "rename", "--force", "--wait"]).code, 0);
    // An operator's frame that stands in the way of its coordinator goes with what that undoes.
    let down = run(&["shutdown"]);
    assert!(down.code == 0 && !down.out.contains("forced"), "{}{}", down.out, down.err);
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn what_is_refused_is_json_too_where_it_is_asked_for() {
    let demo = Demo::new();
    for args in [
        &["status"][..],
        &["stack"],
        &["log"],
        &["log", "--follow"],
        &["event", "e_fast"],
        &["apply", "rename"],
        &["undo"],
        &["shutdown"],
    ] {
        let ran = demo.run(&[args, &["--json"]].concat());
        assert_eq!((ran.code, ran.err.as_str()), (1, ""), "{args:?}");
        assert_eq!(ran.json()["findings"][0]["code"], "cli::not_running", "{args:?}");
    }
}

/// Also of what prints a line an event: its last line says why.
#[test]
fn what_comes_to_nothing_says_so_in_json() {
    let demo = Demo::new();
    demo.write("bad.lua", "this is no Lua");
    demo.write("fails.lua", "error('mine')");
    for (args, code, finding) in [
        (&["deploy", "nope.yaml"][..], 2, "text::no_file"),
        (&["deploy", "deployment.yaml", "--set", "nope=1"], 1, "text::unknown_parameter"),
        (&["deploy", "deployment.yaml", "--detach", "--set", "nope=1"], 1, "text::unknown_parameter"),
        (&["run", "nope.lua"], 2, "text::no_file"),
        (&["run", "bad.lua"], 2, "script::syntax"),
        (&["run", "fails.lua"], 1, "script::failed"),
        (&["explain", "conf::nope"], 1, "cli::unknown_code"),
    ] {
        let ran = demo.run(&[args, &["--json"]].concat());
        assert_eq!((ran.code, ran.err.as_str()), (code, ""), "{args:?} {}", ran.out);
        let last = ran.out.lines().last().unwrap_or_default();
        let told: serde_json::Value =
            if args[0] == "explain" { ran.json() } else { serde_json::from_str(last).expect(last) };
        assert_eq!(told["findings"][0]["code"], finding, "{args:?} {}", ran.out);
    }
    // What does not come up says why, and how it was stopped.
    let faults = "faults:\n  - { step: \"start source\", how: fail }\n";
    demo.write("deployment.yaml", &format!("{}{faults}", demo.read("deployment.yaml")));
    let ran = demo.run(&["deploy", "deployment.yaml", "--json", "--clock", "simulated"]);
    let told: Vec<serde_json::Value> = ran.out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let of =
        |what: &str| told.iter().find(|line| line["what"] == what).unwrap_or_else(|| panic!("{}{}", ran.out, ran.err));
    assert!(of("not_up")["why"].as_str().is_some_and(|why| !why.is_empty()), "{}", ran.out);
    assert_eq!(of("ended")["stage"], "led", "{}", ran.out);
}

/// Another failure of a script than that of the refusal which it has caught is told as what it is.
#[test]
fn a_refusal_that_a_script_catches_is_its_own_affair() {
    let demo = Demo::new();
    let caught = "local ok, why = pcall(deploy, 'nope.yaml') say(tostring(why)) ";
    for (then, code, says) in [
        ("say('end')", 0, ""),
        ("assert(false, 'the gain is wrong')", 1, "the gain is wrong"),
        ("deploy('deployment.yaml') error('mine')", 1, "mine"),
        ("error(why)", 1, "nope.yaml is refused"),
        ("deploy('neither.yaml')", 2, "neither.yaml"),
    ] {
        demo.write("story.lua", &format!("{caught}{then}"));
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
        assert_eq!(ran.code, code, "{then}: {}{}", ran.out, ran.err);
        assert!(ran.err.contains(says) && ran.out.contains("nope.yaml is refused"), "{then}: {}{}", ran.out, ran.err);
    }
}

/// An empty one would be `nil` in Lua, and what takes it would be gone without a word.
#[test]
fn a_parameter_without_a_value_is_refused() {
    let demo = Demo::new();
    let ran = demo.run(&["plan", "deployment.yaml", "--set", "gain="]);
    assert!(ran.code == 2 && ran.err.contains("it has no value"), "{} {}", ran.code, ran.err);
    let text = demo.read("deployment.yaml");
    for with in ["with: { gain: }", "with: { gains: { k: [1.0, null] } }"] {
        demo.write("deployment.yaml", &format!("{text}\n{with}\n"));
        let ran = demo.run(&["check", "deployment.yaml"]);
        assert!(ran.code != 0 && ran.err.contains("has no value"), "{with}: {}{}", ran.out, ran.err);
    }
}

#[test]
fn a_socket_with_too_long_a_path_says_so() {
    let demo = Demo::new();
    demo.replace("deployment.yaml", "name: demo", &format!("name: {}", "long".repeat(16)));
    let folder = demo.path(&"long".repeat(10));
    std::fs::create_dir(&folder).unwrap();
    let ran = demo.command(&["deploy", "deployment.yaml"]).env("XDG_RUNTIME_DIR", &folder).output().unwrap();
    let err = String::from_utf8_lossy(&ran.stderr);
    assert_eq!(ran.status.code(), Some(2), "{err}");
    assert!(err.contains("107") && err.contains("shorter"), "{err}");
}

#[test]
fn the_log_is_followed_to_the_end() {
    let (demo, deployed) = deployed();
    let mut command = demo.command(&["log", "--follow", "--json"]);
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let mut entries: Vec<serde_json::Value> = Vec::new();
    let mut next = || serde_json::from_str(&lines.next()?.unwrap()).ok();
    // What was before it, and what comes.
    while !entries.iter().any(|e: &serde_json::Value| e["event"] == "e_ready") {
        entries.push(next().expect("the log from the beginning"));
    }
    assert_eq!(demo.run(&["apply", "rename", "--force"]).code, 0);
    assert_eq!(demo.run(&["undo"]).code, 0);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    entries.extend(std::iter::from_fn(next));
    let answers: Vec<&str> = entries.iter().filter_map(|e| e["answer"].as_str()).collect();
    for answer in ["create_all.ok", "rename.ok", "create_all.undone"] {
        assert_eq!(answers.iter().filter(|a| **a == answer).count(), 1, "{answer} once: {answers:?}");
    }
    assert_eq!(entries.last().unwrap()["phase"], "down");
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn the_log_of_one_that_is_killed_ends_and_says_so() {
    for json in [false, true] {
        let demo = Demo::new();
        crate::kept::deploy(&demo, "deployment.yaml");
        let mut command = demo.command(&["log", "--follow"]);
        command.args(json.then_some("--json"));
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map(Result::unwrap);
        assert!(lines.any(|line| line.contains("e_ready")));
        crate::kept::kill(&demo, "demo");
        let last = lines.last().expect("a last line");
        let said = if json { "\"phase\":\"died\"" } else { "demo  died  killed, or crashed" };
        assert!(last.contains(said), "{last}");
        assert_eq!(child.wait().unwrap().code(), Some(4));
    }
}

/// What tells what has happened is raised by nobody from outside, whichever way it comes; and what may be raised is suggested.
#[test]
fn an_answer_is_given_by_nobody_else() {
    let (demo, deployed) = deployed();
    for (forged, instead) in [
        ("slow.failed", "`davit apply slow`"),
        ("slow.lost", "`davit apply slow`"),
        ("create_all.undone", "`davit undo create_all`"),
        ("start_all.undo.failed", "`davit undo start_all`"),
        ("create_all.undo", "`davit undo create_all`"),
        ("undo.done", "`davit undo`"),
        ("commit.ok", "`davit commit`"),
        ("e_done@root.idle", "a transition waits for"),
    ] {
        for args in [&["event", forged][..], &["event", forged, "--no-wait"], &["event", forged, "--wait", "e_ready"]] {
            let ran = demo.run(args);
            assert_eq!(ran.code, 1, "{args:?}: {}{}", ran.out, ran.err);
            assert!(ran.err.contains("run::not_from_outside"), "{args:?}: {}", ran.err);
            let said = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(said.contains(instead), "{args:?}: {said}");
        }
    }
    let status = demo.run(&["status", "--json"]).json();
    assert_eq!(status["coordinator"].as_array().and_then(|all| all.last()), Some(&"root.operational.slow_mode".into()));
    assert_eq!(demo.run(&["explain", "run::not_from_outside"]).code, 0);
    let unknown = demo.run(&["event", "what"]);
    assert!(unknown.err.contains("`e_fast`") && !unknown.err.contains("failed"), "{}", unknown.err);
    assert!(demo.run(&["event", "fast"]).err.contains("`davit apply fast`"));
    // What a component may raise, anybody may.
    assert!(demo.run(&["event", "source.faulted"]).err.contains("knows no event"));
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(deployed.end().code(), Some(0));
    demo.write("forge.lua", "deploy('deployment.yaml')\nraise('slow.failed')\n");
    let script = demo.run(&["run", "forge.lua", "--clock", "simulated"]);
    assert_eq!(script.code, 1, "{}", script.out);
    let said = script.err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("`slow.failed` is an answer") && said.contains("apply(\"slow\")"), "{said}");
}

/// Who reads a log that goes on may go while nothing happens.
#[test]
fn a_log_that_is_followed_ends_with_its_reader_also_where_nothing_happens() {
    let (demo, _deployed) = deployed();
    let mut following = demo.command(&["log", "--follow"]).stdout(Stdio::piped()).spawn().expect("the program starts");
    let mut line = String::new();
    let mut reader = BufReader::new(following.stdout.take().expect("a pipe"));
    reader.read_line(&mut line).expect("a line");
    drop(reader);
    let ended = crate::foreground::until("it ends", || following.try_wait().expect("it can be waited for"));
    assert_eq!(ended.code(), Some(0));
}
