//! The way out of *broken*: `davit drift`, `davit recover`, `davit commit`, as commands, on the socket and in scripts.

use crate::demo::Demo;
use crate::emergency::{belt, said};
use serde_json::{Value, json};

/// A logger whose file decides whether `swap` fails, and whether it can be taken back.
const DEPLOYMENT: &str = "davit: 1
name: logged
platform: embedded
libraries: [standard]
activities:
  slow: { period_ms: 10.0 }
configurations: [configurations.lua]
coordinator: coordinator.lua
deploy:   { event: e_start,    up: up,   within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  make = Configuration {
    create("log", "standard.CsvLogger", { activity = "slow", properties = { path = "logs/a.csv" } }),
    post_conf_state = { "log:running" },
  },
  thin = Configuration { property_set("log.every", 5) },
  thick = Configuration { property_set("log.every", 2) },
  swap = Configuration { on_failure = "hold",
    pre_conf_state = { "log:unconfigured" },
    property_set("log.path", "gone/b.csv"),
    post_conf_state = { "log:running" },
  },
}
"#;

const COORDINATOR: &str = r#"return state {
  idle = state {},
  making = state { entry = "make" },
  up = state {},
  thinned = state { config = "thin" },
  leaving = state { entry = "make.undo" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "making", events = { "e_start" } },
  trans { src = "making", tgt = "up", events = { "make.ok" } },
  trans { src = "making", tgt = "leaving", events = { "make.failed", "make.broken", "e_shutdown" } },
  trans { src = "up", tgt = "thinned", events = { "e_thin" } },
  trans { src = "thinned", tgt = "up", events = { "e_thick", "thin.failed", "thin.broken" } },
  trans { src = "up", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "thinned", tgt = "leaving", events = { "e_shutdown" } },
  trans { src = "leaving", tgt = "idle", events = { "make.undone", "make.undo.failed", "make.undo.broken" } },
}
"#;

fn files() -> Demo {
    let demo = Demo::new();
    demo.write("deployment.yaml", DEPLOYMENT);
    demo.write("configurations.lua", CONFIGURATIONS);
    demo.write("coordinator.lua", COORDINATOR);
    std::fs::create_dir(demo.path("logs")).unwrap();
    demo
}

/// A running deployment; taken down whatever the test found.
struct Deployed(Demo);

impl Deployed {
    fn new() -> Self {
        let demo = files();
        let up = demo.run(&["deploy", "deployment.yaml", "--detach"]);
        assert_eq!(up.code, 0, "{}{}", up.out, up.err);
        Self(demo)
    }

    /// The system is broken: the logger's file cannot be made, and what was done is held.
    fn broken() -> Self {
        let deployed = Self::new();
        let swap = deployed.0.run(&["apply", "swap", "--force", "--wait"]);
        assert_eq!(swap.code, 3, "{}{}", swap.out, swap.err);
        deployed
    }

    fn status(&self) -> Value {
        self.0.run(&["status", "--json"]).json()
    }
}

impl Drop for Deployed {
    fn drop(&mut self) {
        let _ = self.0.command(&["shutdown", "--force"]).output();
    }
}

#[test]
fn a_broken_deployment_goes_back() {
    let deployed = Deployed::broken();
    let run = |args: &[&str]| deployed.0.run(args);
    let status = run(&["status"]);
    assert_eq!(status.code, 3, "{}{}", status.out, status.err);
    let residual = &deployed.status()["residual"];
    let texts: Vec<&str> = residual.as_array().unwrap().iter().map(|d| d["text"].as_str().unwrap()).collect();
    assert!(texts.contains(&"property_set log.path = \"gone/b.csv\" (done, and not taken back)"), "{residual}");
    assert!(texts[0].starts_with("not done: `configure log`: "), "why is told first: {residual}");
    for text in &texts {
        assert!(status.out.contains(text), "{}", status.out);
    }

    let drift = run(&["drift", "logged"]);
    // What was done and not taken back is in force: the platform is as it is known.
    assert_eq!(drift.code, 0, "{}{}", drift.out, drift.err);
    assert!(drift.out.contains("nothing differs") && drift.err.contains("davit recover --back"), "{}", drift.out);
    assert_eq!(run(&["drift", "--json"]).json(), json!([]));
    let set = residual.as_array().unwrap().iter().find(|d| d["do"] == "property_set").expect("the path is left");
    assert_eq!((&set["target"], &set["value"]), (&json!("log.path"), &json!("gone/b.csv")));

    // The first file cannot be made again either: what remains is named, and so is why.
    std::fs::rename(deployed.0.path("logs"), deployed.0.path("away")).unwrap();
    let still = run(&["recover", "--back"]);
    assert_eq!(still.code, 3, "{}{}", still.out, still.err);
    assert!(still.out.contains("still broken") && still.out.contains("  cleanup log"), "{}", still.out);
    let still = run(&["recover", "--back", "--json"]);
    assert_eq!((still.code, &still.json()["recovered"]), (3, &json!(false)), "{}", still.out);
    assert!(!still.json()["residual"].as_array().unwrap().is_empty());

    std::fs::rename(deployed.0.path("away"), deployed.0.path("logs")).unwrap();
    let back = run(&["recover", "--back"]);
    let done = "  property_set log.path (done)\n  configure log (done)\n  start log (done)\n";
    assert_eq!((back.code, back.out), (0, format!("logged: recovered\n{done}")), "{}", back.err);
    let status = deployed.status();
    assert_eq!((&status["phase"], &status["residual"]), (&json!("up"), &json!([])));
    assert_eq!(status["system"]["components"]["log"]["state"], "running");
    let drift = run(&["drift"]);
    assert_eq!((drift.code, drift.out.as_str()), (0, "logged: as it should be\n"), "{}", drift.err);
    assert_eq!(run(&["drift", "--json"]).json(), json!([]));
    let again = run(&["recover", "--back"]);
    assert_eq!((again.code, again.out.as_str()), (0, "logged: not broken, nothing to recover\n"), "{}", again.err);

    let log = run(&["log", "--json"]).json();
    let entries = log.as_array().unwrap();
    assert!(entries.iter().any(|e| e["ask"] == "recover --back" && e["by"] == "operator"), "{log}");
    assert!(entries.iter().any(|e| e["what"] == "recovered"), "{log}");
    assert_eq!(run(&["shutdown"]).code, 0);
}

#[test]
fn the_undo_of_what_broke_it_recovers_as_well() {
    let deployed = Deployed::broken();
    let undo = deployed.0.run(&["undo", "swap", "--wait"]);
    assert_eq!(undo.code, 0, "{}{}", undo.out, undo.err);
    // Whoever drives it looks again once that is answered.
    deployed.0.until_phase("up");
}

#[test]
fn what_is_there_is_taken_as_the_state() {
    let deployed = Deployed::broken();
    let accept = deployed.0.run(&["recover", "--accept"]);
    assert_eq!((accept.code, accept.out.as_str()), (0, "logged: recovered\n"), "{}", accept.err);
    let status = deployed.status();
    assert_eq!((&status["phase"], &status["stack"]), (&json!("up"), &json!([])));
    assert_eq!(status["system"]["components"]["log"]["properties"]["path"], "gone/b.csv");
    assert_eq!(deployed.0.run(&["drift"]).code, 0);
    assert_eq!(deployed.0.run(&["apply", "thick", "--force", "--wait"]).code, 0, "requests are taken again");
}

#[test]
fn a_way_that_is_none_is_refused_in_words() {
    let deployed = Deployed::broken();
    let none = deployed.0.run(&["recover"]);
    assert_eq!(none.code, 2, "{}{}", none.out, none.err);
    assert!(
        none.err.contains("--back") && none.err.contains("--accept") && !none.err.contains("--forward"),
        "{}",
        none.err
    );
    let forward = deployed.0.run(&["recover", "--forward"]);
    assert_eq!(forward.code, 1, "{}{}", forward.out, forward.err);
    assert!(forward.err.contains("no journal"), "{}", forward.err);
    assert_eq!(deployed.0.run(&["recover", "--back", "--accept"]).code, 2);
    assert_eq!(deployed.status()["phase"], "broken", "nothing was done");
    for command in [vec!["drift", "lgged"], vec!["recover", "lgged", "--back"], vec!["commit", "lgged"]] {
        let unknown = deployed.0.run(&command);
        assert_eq!(unknown.code, 1, "{command:?}: {}", unknown.err);
        assert!(unknown.err.contains("`logged`"), "{command:?}: {}", unknown.err);
        let json = deployed.0.run(&[&command[..], &["--json"]].concat());
        assert_eq!((json.code, &json.json()["ok"]), (1, &json!(false)), "{command:?}");
    }
}

#[test]
fn commit_makes_the_operators_frames_permanent_and_no_others() {
    let deployed = Deployed::new();
    let run = |args: &[&str]| deployed.0.run(args);
    let frames = || {
        let stack = run(&["stack", "--json"]).json();
        stack.as_array().unwrap().iter().map(|f| f["configuration"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(run(&["event", "e_thin", "--wait", "thin.ok"]).code, 0);
    assert_eq!(run(&["apply", "thick", "--force", "--wait"]).code, 0);
    assert_eq!(frames(), ["make", "thin", "thick"]);
    let refused = run(&["commit"]);
    assert_eq!(refused.code, 1, "{}{}", refused.out, refused.err);
    assert!(refused.out.contains("commit.failed") && refused.out.contains("`thin` is in force"), "{}", refused.out);
    assert_eq!(frames(), ["make", "thin", "thick"], "nothing was done");

    let forced = run(&["commit", "--force", "--json"]);
    assert_eq!((forced.code, &forced.json()["answer"]), (0, &json!("commit.ok")), "{}", forced.out);
    assert_eq!(frames(), ["make", "thin"], "the coordinator's frames stay");
    let undo = run(&["undo", "thick", "--wait"]);
    assert_eq!(undo.code, 1, "{}{}", undo.out, undo.err);
    assert_eq!(deployed.status()["system"]["components"]["log"]["properties"]["every"], 2);
    assert_eq!(run(&["event", "e_thick", "--wait", "thin.undone"]).code, 0, "its own it can undo");
    assert_eq!(run(&["shutdown"]).code, 0);
}

#[test]
fn a_coordinators_frame_is_undone_by_force_only() {
    let deployed = Deployed::new();
    let run = |args: &[&str]| deployed.0.run(args);
    assert_eq!(run(&["event", "e_thin", "--wait", "thin.ok"]).code, 0);
    for args in [&["undo", "thin", "--wait"][..], &["undo", "--to", "1", "--wait"]] {
        let refused = run(args);
        assert_eq!(refused.code, 1, "{}{}", refused.out, refused.err);
        assert!(refused.out.contains("`thin` is a frame of a coordinator"), "{}{}", refused.out, refused.err);
    }
    let every = || deployed.status()["system"]["components"]["log"]["properties"]["every"].clone();
    assert_eq!(every(), 5, "nothing was done");
    let forced = run(&["undo", "thin", "--force", "--wait"]);
    assert_eq!(forced.code, 0, "{}{}", forced.out, forced.err);
    assert_ne!(every(), 5);
    // What a person asks for, and is not there to be undone, is told as that.
    let nothing = |args: &[&str], code: i32, says: &str| {
        let ran = run(args);
        assert!(ran.code == code && ran.out.contains(says), "{args:?}: {}{}", ran.out, ran.err);
    };
    nothing(&["undo", "thick"], 0, "`thick` was not in force: there was nothing to undo");
    nothing(&["undo"], 1, "a coordinator's frame is undone by its name, with `--force`");
    nothing(&["undo", "--to", "9"], 1, "no more is in force than 1 frame");
    assert_eq!(run(&["shutdown"]).code, 0);
}

#[test]
fn a_script_recovers() {
    let demo = files();
    demo.write(
        "story.lua",
        r#"
deploy("deployment.yaml")
assert(#drift() == 0)
recover("back")
apply("swap", { force = true })
wait_answer("swap.broken", 1)
assert(#drift() == 0 and stack()[#stack()].partial, "what is left is in force")
local ok, why = pcall(recover, "forward")
assert(not ok and tostring(why):find("journal"), tostring(why))
recover("back")
assert(#drift() == 0)
assert_running("log")
apply("thick", { force = true })
wait_answer("thick.ok", 1)
commit()
wait_answer("commit.failed", 1)
commit { force = true }
wait_answer("commit.ok", 1)
assert(#stack() == 1, "the coordinator's")
apply("swap", { force = true })
wait_answer("swap.broken", 1)
recover("accept")
assert_state("log", "unconfigured")
"#,
    );
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    // What is accepted stands on no stack any more: the coordinator leaves it, and force takes it away.
    assert!(ran.code == 4 && ran.out.contains("by force: log (unconfigured) is left"), "{}{}", ran.out, ran.err);
    let typo = "deploy('deployment.yaml')\nrecover('bak')\n";
    demo.write("typo.lua", typo);
    let ran = demo.run(&["run", "typo.lua", "--clock", "simulated"]);
    assert!(ran.code == 1 && ran.err.contains("`back`"), "{}{}", ran.out, ran.err);
}

/// *Down* with something there is not *down*: what was accepted as it is belongs to no frame, so its coordinator leaves it.
#[test]
fn what_was_accepted_is_told_when_its_coordinator_is_down() {
    let deployed = Deployed::broken();
    let run = |args: &[&str]| deployed.0.run(args);
    assert_eq!(run(&["recover", "--accept"]).code, 0);
    let event = run(&["event", "e_shutdown", "--wait", "make.undone"]);
    assert_eq!(event.code, 0, "{}{}", event.out, event.err);
    // The answer is told before its coordinator has taken it.
    assert!((0..500).any(|_| deployed.status()["phase"] != "shutting_down"), "{}", deployed.status());
    let status = run(&["status"]);
    assert!(
        status.code == 3 && status.out.contains("broken") && status.out.contains("davit shutdown"),
        "{}",
        status.out
    );
    let seen = deployed.status();
    assert_eq!((&seen["phase"], &seen["left"]), (&json!("broken"), &json!(["log (unconfigured)"])), "{seen}");
    assert_eq!(run(&["list", "--json"]).json()[0]["phase"], "broken");
    let shutdown = run(&["shutdown"]);
    assert_eq!(shutdown.code, 4, "{}{}", shutdown.out, shutdown.err);
}

#[test]
fn a_script_tries_a_deployment_out_on_the_simulated_platform() {
    let demo = files();
    // What the real component could not do.
    std::fs::remove_dir(demo.path("logs")).unwrap();
    demo.write("story.lua", "deploy('deployment.yaml')\nassert_running('log')\n");
    let run = |more: &[&str]| {
        let args: Vec<&str> = ["run", "story.lua", "--clock", "simulated"].iter().chain(more).copied().collect();
        demo.run(&args)
    };
    assert_eq!(run(&[]).code, 1, "its own platform has no such folder");
    let ran = run(&["--platform", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let typo = run(&["--platform", "simulted"]);
    assert!(typo.code == 2 && typo.err.contains("simulated"), "{}", typo.err);
}

/// Who recovers has often seen a difference before the slow look has: it is looked at first, and put right. Nothing is told to be recovered
/// while something safe stays in force in part, nor to be done and not taken back what somebody has written since.
#[test]
fn who_recovers_looks_first() {
    let demo = belt();
    let brake = "      - operation_call: { operation: motor.brake }";
    demo.replace(
        "belt/configurations.yaml",
        brake,
        &format!("{brake}\n      - property_set: {{ property: motor.limit, value: 0.0 }}"),
    );
    let told = said(
        &demo,
        "local function logged(what) local n = 0 for _, entry in ipairs(log{ since = 0 }) do if entry.what == what then n = n + 1 end end return n end
         local function tell(when) say(when .. ' ' .. property('motor.limit') .. ' ' .. #drift() .. ' ' .. logged('recovered')) end
         deploy('deployment.yaml') fault('property_set motor.limit', 'lie') set('motor.limit', 0.25) tell('lied')
         recover('back') tell('recovered') undo('motor.limit') wait_answer('motor.limit.undone', 1)
         fault('port_write motor.speed', 'fail', 1) raise('e_stop') wait_state('stopped.in_part', 1)
         fault('property_set motor.limit', 'lie') set('motor.limit', 0.25, {force = true}) tell('in part')
         local ok, why = pcall(recover, 'back') why = tostring(why) tell('stays')
         assert(not ok and why:find('motor.brake() (done, and not taken back)', 1, true) and not why:find('limit', 1, true), why)",
    );
    let told: Vec<&String> = told.iter().filter(|line| !line.contains("note ")).collect();
    assert_eq!(told, ["lied 0.5 1 0", "recovered 0.25 0 1", "in part 0.0 1 1", "stays 0.25 0 1"]);
}

/// Who recovers is told what was done for it, and what was lost is so no more when it is there again.
#[test]
fn who_recovers_is_told_what_was_done() {
    let demo = belt();
    demo.replace(
        "belt/deployment.yaml",
        "platform: simulated",
        "platform: simulated\nfaults: [{ step: start motor, how: lie }]",
    );
    let up = demo.run(&["deploy", "belt/deployment.yaml", "--detach"]);
    assert_eq!(up.code, 0, "{}{}", up.out, up.err);
    let lost = || {
        let frames = demo.run(&["stack", "--json"]).json();
        let frames = frames.as_array().cloned().unwrap_or_default();
        frames.iter().filter(|f| f["lost"] == true).map(|f| f["configuration"].to_string()).collect::<Vec<_>>()
    };
    let recovered = demo.run(&["recover", "--back"]);
    assert_eq!(
        (recovered.code, recovered.out.as_str()),
        (0, "belt: recovered\n  start motor (done)\n"),
        "{}",
        recovered.err
    );
    assert_eq!(lost(), [""; 0], "it runs again");
    let undone = demo.run(&["undo", "--to", "1", "--force"]);
    assert!(undone.code == 0 && undone.out.contains("`slow`, `run` are undone"), "{}{}", undone.out, undone.err);
    demo.run(&["shutdown", "--force"]);
}

/// A recover that failed leaves it *broken*; then its coordinators lead down what is left, which is right again.
#[test]
fn broken_is_told_when_it_comes_to_be_and_when_it_is_over() {
    let demo = Demo::new();
    for file in std::fs::read_dir(format!("{}/examples/pair", env!("CARGO_MANIFEST_DIR"))).expect("the folder") {
        let file = file.expect("a file");
        std::fs::copy(file.path(), demo.path(&file.file_name().to_string_lossy())).expect("copied");
    }
    demo.write(
        "story.lua",
        "fault('connect left/Drive.pose -> right/Drive.ref', 'lie', 2)
         deploy('pair.yaml') wait(0.6) pcall(recover, 'back') fail('left/Drive') wait(20)
         for _, entry in ipairs(log()) do if entry.phase then say('phase ' .. entry.phase) end end",
    );
    let ran = demo.run(&["run", "story.lua", "--platform", "simulated", "--clock", "simulated"]);
    let phases: Vec<&str> = ran.out.lines().filter_map(|line| line.trim().strip_prefix("phase ")).collect();
    assert_eq!(phases, ["deploying", "up", "broken", "up"], "{}{}", ran.out, ran.err);
}
