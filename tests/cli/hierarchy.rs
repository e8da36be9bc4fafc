//! The hierarchy of a composed deployment on the command line: a subsystem alone by its own names, and folded into a line.

use crate::demo::{Demo, Ran, at_home};
use crate::foreground::until;
use crate::kept::{deploy, kill};
use serde_json::{Value, json};

/// A deployment in which the pair of the examples is a subsystem: two levels deep.
const CELL: &str = "davit: 1
name: cell
platform: simulated
types: {}
subsystems: { duo: { deployment: pair.yaml } }
configurations: [cell_configurations.lua]
coordinator: cell_coordinator.lua
deploy:   { event: e_start, up: on, failed: [bad], within_s: 10 }
shutdown: { event: e_shutdown, down: idle, within_s: 10 }
";

pub const COORDINATOR: &str = r#"return state {
  idle = state {}, raising = state {}, on = state {}, bad = state {}, lowering = state { entry = "duo/e_shutdown" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "raising", events = { "e_start" }, effect = { "duo/e_start" } },
  trans { src = "raising", tgt = "on", events = { "duo/up" } },
  trans { src = "raising", tgt = "bad", events = { "duo/failed" } },
  trans { src = "raising", tgt = "lowering", events = { "e_shutdown" } },
  trans { src = "bad", tgt = "lowering", events = { "e_shutdown" } },
  trans { src = "on", tgt = "lowering", events = { "e_shutdown", "duo/down" } },
  trans { src = "lowering", tgt = "idle", events = { "duo/down" } },
}
"#;

pub fn cell() -> Demo {
    let demo = Demo::new();
    for file in ["pair.yaml", "robot.yaml"] {
        demo.write(file, &example(file));
    }
    for name in ["pair", "robot"] {
        for part in ["configurations", "coordinator"] {
            demo.write(&format!("{name}_{part}.lua"), &example(&format!("{name}_{part}.lua")));
        }
    }
    demo.write("cell.yaml", CELL);
    demo.write("cell_configurations.lua", "ConfiguratorConf {}\n");
    demo.write("cell_coordinator.lua", COORDINATOR);
    demo
}

pub fn example(file: &str) -> String {
    let path = format!("{}/examples/pair/{file}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).expect("an example")
}

/// Takes the deployment down whatever the test found.
pub struct DeployedCell(Demo);

impl DeployedCell {
    fn new() -> Self {
        Self::of(cell(), "cell.yaml")
    }

    pub fn of(demo: Demo, file: &str) -> Self {
        deploy(&demo, file);
        Self(demo)
    }

    /// What is printed, without the times and what else differs from run to run.
    pub fn shows(&self, args: &[&str]) -> String {
        let ran = self.0.run(args);
        assert_eq!(ran.code, 0, "{args:?}: {}{}", ran.out, ran.err);
        timeless(&ran.out)
    }

    fn json(&self, args: &[&str]) -> Value {
        let ran = self.0.run(args);
        assert_eq!(ran.code, 0, "{args:?}: {}{}", ran.out, ran.err);
        ran.json()
    }
}

impl Drop for DeployedCell {
    fn drop(&mut self) {
        let _ = self.0.command(&["shutdown", "--force"]).output();
    }
}

/// Numbers with a fraction, and the blanks around them, are not compared.
pub fn timeless(text: &str) -> String {
    let is_time = |word: &&str| !(word.contains('.') && word.trim_start_matches('(').parse::<f64>().is_ok());
    let line = |line: &str| {
        let indent = line.len() - line.trim_start().len();
        let indent = if line.trim_start().starts_with(|c: char| c.is_ascii_digit()) { 0 } else { indent };
        format!("{}{}\n", " ".repeat(indent), line.split_whitespace().filter(is_time).collect::<Vec<_>>().join(" "))
    };
    text.lines().map(line).collect()
}

#[test]
fn a_status_is_grouped_folded_or_of_one_subsystem() {
    let cell = DeployedCell::new();
    let whole = "cell up s
coordinator root.on
stack 0 frames
duo up
  coordinator root.joined
  stack 1 frame, newest duo/join
duo/left up
  coordinator root.alive.on
  stack 2 frames, newest duo/left/run
  components
    running duo/left/Drive Drive
duo/right up
  coordinator root.alive.on
  stack 2 frames, newest duo/right/run
  components
    running duo/right/Drive Drive
";
    assert_eq!(cell.shows(&["status"]), whole);
    let folded = "cell up s
coordinator root.on
stack 0 frames
duo up root.joined 5 frames 2 components
";
    assert_eq!(cell.shows(&["status", "--depth", "0"]), folded);
    let one = "cell/duo up s
coordinator root.joined
stack 1 frame, newest join
left up root.alive.on 2 frames 1 component
right up root.alive.on 2 frames 1 component
";
    assert_eq!(cell.shows(&["status", "--in", "duo", "--depth", "0"]), one);
    let deep = "cell/duo/left up s
coordinator root.alive.on
stack 2 frames, newest run
held by /duo/join by /duo
components
  running Drive Drive
";
    assert_eq!(cell.shows(&["status", "--in", "/duo/left/"]), deep);
    assert_eq!(cell.shows(&["status", "--depth", "2"]), whole, "there is nothing deeper");
    let listed = cell.shows(&["list"]);
    assert!(listed.starts_with("cell up root.on duo up process "), "{listed}");
    let watched = |args: &[&str]| cell.shows(&[&["watch", "--count", "1"], args].concat());
    assert_eq!(watched(&["--depth", "1"]), "s up root.on, duo:root.joined, duo/left up, duo/right up 5 frames\n");
    assert_eq!(watched(&["--in", "duo/left"]), "s up root.alive.on 2 frames\n");
}

#[test]
fn a_stack_keeps_its_numbers_and_says_what_holds() {
    let cell = DeployedCell::new();
    // Of the two it is not known which was first.
    let whole = cell.json(&["stack", "--json"]);
    let number = |name: &str| {
        let at = whole.as_array().unwrap().iter().position(|frame| frame["configuration"] == name);
        at.expect("in force") + 1
    };
    let (make, run) = (number("duo/left/make"), number("duo/left/run"));
    let inside = format!("5 /duo/join by /duo at s holds it\n{run} run by left at s\n{make} make by left at s\n");
    assert_eq!(cell.shows(&["stack", "--in", "duo/left"]), inside);
    assert_eq!(cell.shows(&["stack", "--depth", "0"]), "5 duo 5 frames at s newest duo/join\n");
    let folded = cell.shows(&["stack", "--depth", "1"]);
    assert!(folded.starts_with("5 duo/join by duo at s\n") && folded.lines().count() == 3, "{folded}");
    assert!(folded.contains("duo/left 2 frames at s newest duo/left/run\n"), "{folded}");
    // What nobody may set is listed in the file of the subsystem, by the name that it has there.
    let refused = cell.0.run(&["set", "duo/left/Drive.gain", "0.3"]);
    let said = "`operator:` in the file of `duo/left` does not list `Drive.gain`";
    assert!(refused.code == 1 && refused.out.contains(said), "{}{}", refused.out, refused.err);

    let join = &whole[4];
    assert_eq!((&join["subsystem"], &join["touches"]), (&json!("duo"), &json!(["duo/left", "duo/right"])), "{join}");
    assert!(whole.as_array().unwrap().iter().all(|frame| frame.get("number").is_none()), "{whole}");
    let inside = cell.json(&["stack", "--in", "duo/left", "--json"]);
    let frames: Vec<Value> =
        inside.as_array().unwrap().iter().map(|f| json!([f["number"], f["configuration"], f["holds"]])).collect();
    assert_eq!(frames, [json!([make, "make", null]), json!([run, "run", null]), json!([5, "/duo/join", true])]);
    assert_eq!(inside[2]["touches"], json!(["/duo/right"]), "{inside}");
    assert!(inside[0].get("subsystem").is_none(), "{inside}");
}

#[test]
fn programs_read_full_names_with_the_subsystem_or_those_of_its_file() {
    let cell = DeployedCell::new();
    let whole = cell.json(&["status", "--json"]);
    let all: Vec<Value> = whole["subsystems"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| json!([one["name"], one["standing"], one["coordinators"]]))
        .collect();
    assert_eq!(
        all,
        [
            json!(["duo", "up", ["duo"]]),
            json!(["duo/left", "up", ["duo/left"]]),
            json!(["duo/right", "up", ["duo/right"]])
        ]
    );
    assert!(whole["system"]["components"]["duo/left/Drive"].is_object(), "{whole}");
    let left = cell.json(&["status", "--in", "duo/left", "--json"]);
    assert_eq!((&left["in"], &left["standing"], &left["phase"]), (&json!("duo/left"), &json!("up"), &json!("up")));
    assert_eq!(left["coordinators"], json!({ "left": ["root", "root.alive", "root.alive.on"] }));
    assert_eq!(left["coordinator"], left["coordinators"]["left"]);
    assert_eq!(left["system"]["components"].as_object().unwrap().keys().collect::<Vec<_>>(), ["Drive"]);
    let ends = |connection: &Value| json!([connection["from"], connection["to"]]);
    let connections: Vec<Value> = left["system"]["connections"].as_array().unwrap().iter().map(ends).collect();
    assert_eq!(
        connections,
        [json!(["Drive.pose", "/duo/right/Drive.ref"]), json!(["/duo/right/Drive.pose", "Drive.ref"])]
    );
    assert_eq!(
        (&left["held_by"][0]["configuration"], &left["held_by"][0]["by"]),
        (&json!("/duo/join"), &json!("/duo"))
    );
    assert_eq!(left["subsystems"], json!([]));
    let duo = cell.json(&["status", "--in", "duo", "--json"]);
    assert_eq!((&duo["subsystems"][0]["name"], &duo["held_by"]), (&json!("left"), &json!([])), "{duo}");
    let list = cell.json(&["list", "--json"]);
    assert_eq!((&list[0]["coordinators"], &list[0]["subsystems"]), (&whole["coordinators"], &whole["subsystems"]));
}

/// The entries of a log without their times, `what` and what it is about.
fn told(log: &Value) -> Vec<String> {
    let about = |entry: &Value| {
        let state = &entry["active"].as_array().and_then(|all| all.last()).cloned().unwrap_or_default();
        let about = [&entry["event"], &entry["ask"], &entry["phase"], &entry["component"], state];
        let about = about.into_iter().find_map(Value::as_str).unwrap_or_default();
        format!("{} {about}", entry["what"].as_str().unwrap_or_default())
    };
    log.as_array().expect("an array").iter().map(about).collect()
}

#[test]
fn a_log_is_that_of_a_subsystem_also_when_nobody_runs_any_more() {
    let cell = DeployedCell::new();
    let inside = [
        "state left:root.alive.making",
        "requested make",
        "answered make",
        "state left:root.alive.starting",
        "emitted e_built",
        "requested run",
        "answered run",
        "state left:root.alive.on",
        "event up",
        "answered /duo/join",
        "phase up",
    ];
    let log = cell.json(&["log", "--in", "duo/left", "--json"]);
    // What comes before that, others tell in threads of their own.
    let all = told(&log);
    assert!(all.ends_with(&inside.map(str::to_owned)) && all.len() == inside.len() + 3, "{all:?}");
    for line in ["phase deploying", "state left:root.idle", "emitted e_start"] {
        assert!(all.iter().any(|told| told == line), "{line}: {all:?}");
    }
    let join = log.as_array().unwrap().iter().find(|entry| entry["ask"] == "/duo/join").unwrap();
    assert_eq!(join["steps"][0]["step"], "connect Drive.pose -> /duo/right/Drive.ref", "{join}");
    assert_eq!(told(&cell.json(&["log", "--in", "duo/left", "--json", "--last", "2"])), inside[9..]);

    let folded = cell.shows(&["log", "--depth", "0"]);
    for line in ["emitted duo/e_start\n", "event duo/up from duo\n", "state cell:root.on\n"] {
        assert!(folded.contains(line), "{line}: {folded}");
    }
    assert!(!folded.contains("duo:") && !folded.contains("duo/left"), "{folded}");
    let folded = cell.shows(&["log", "--depth", "1"]);
    for line in ["answer duo/join.ok", "event duo/left/up from duo/left\n", "emitted duo/left/e_built\n"] {
        assert!(folded.contains(line), "{line}: {folded}");
    }
    assert!(!folded.contains("duo/left:") && !folded.contains("duo/left/make"), "{folded}");

    // It is written beside what acts, a moment later.
    until("all of it is written", || cell.0.read("state/davit/cell.log").contains(r#""phase":"up""#).then_some(()));
    kill(&cell.0, "cell");
    let dead = told(&until("its end is seen", || {
        let ran = cell.0.run(&["log", "cell", "--in", "duo/left", "--json"]);
        (ran.code == 0).then(|| ran.json())
    }));
    // What was told before somebody kept it is not there.
    assert!(dead[0].starts_with("began") && dead.ends_with(&inside.map(str::to_owned)), "{dead:?}");
    let typo = cell.0.run(&["log", "cell", "--in", "duo/lef"]);
    assert!(typo.code == 2 && typo.err.contains("did you mean `duo/left`?"), "{}", typo.err);
}

#[test]
fn one_that_went_down_by_itself_is_seen_folded() {
    let cell = DeployedCell::new();
    assert_eq!(cell.0.run(&["event", "duo/left/Drive.faulted"]).code, 0);
    // It leaves, and its parent with it: one after the other all of it is down again, and the parent
    // is told so only then.
    let folded = until("all of it is down", || {
        let shown = cell.shows(&["log", "--depth", "0"]);
        shown.contains("event duo/down from duo\n").then_some(shown)
    });
    let down = cell.shows(&["status", "--depth", "1"]);
    for which in ["left", "right"] {
        let line = format!("duo/{which} down root.idle 0 frames 0 components\n");
        assert!(down.contains(&line), "{down}\n{folded}");
    }
}

#[test]
fn what_is_no_subsystem_is_refused_everywhere_with_what_may_be_meant() {
    let cell = DeployedCell::new();
    let refused = |ran: Ran, args: &[&str]| {
        assert_eq!(ran.code, 2, "{args:?}: {}{}", ran.out, ran.err);
        let said = ran.err.contains("there is no subsystem `duo/lfet`") && ran.err.contains("did you mean `duo/left`?");
        assert!(said && ran.err.contains("cli::unknown_subsystem"), "{args:?}: {}", ran.err);
    };
    let file = ["plan", "graph", "sim"].map(|command| vec![command, "cell.yaml"]);
    let running = ["status", "stack", "log", "watch"].map(|command| vec![command]);
    for args in file.into_iter().chain(running) {
        let args: Vec<&str> = args.into_iter().chain(["--in", "duo/lfet"]).collect();
        refused(cell.0.run(&args), &args);
    }
    let follow = ["log", "--follow", "--in", "duo/lfet"];
    refused(cell.0.run(&follow), &follow);
    let said = cell.0.run(&["status", "--in", "duo/lfet", "--json"]);
    assert_eq!((said.code, &said.json()["findings"][0]["code"]), (2, &json!("cli::unknown_subsystem")));
    let bad = cell.0.run(&["status", "--in", "duo//left"]);
    assert!(bad.code == 2 && bad.err.contains("separated by `/`"), "{}", bad.err);
    let whole = cell.0.run(&["stack", "--json", "--depth", "0"]);
    assert!(whole.code == 2 && whole.err.contains("--depth"), "{}", whole.err);
    let none = at_home(&["plan", "deployments/hello.yaml", "--in", "left"]);
    assert!(none.code == 2 && none.err.contains("there are no subsystems here"), "{}", none.err);
    let explained = at_home(&["explain", "cli::unknown_subsystem"]);
    assert!(explained.code == 0 && explained.out.contains("`subsystems:`"), "{}", explained.out);
}

#[test]
fn what_is_set_of_a_subsystem_is_told_by_its_whole_name() {
    let demo = cell();
    assert_eq!(demo.run(&["check", "cell.yaml", "--set", "duo.left.gain=0.5"]).code, 0);
    for (set, said, help) in [
        ("duo.left.gian=1", "the parameter `duo.left.gian`", "did you mean `duo.left.gain`?"),
        ("dou.left.gain=1", "the parameter `dou`", "did you mean the subsystem `duo`?"),
        ("duo.lfet.gain=1", "the parameter `duo.lfet`", "did you mean the subsystem `left`?"),
        ("duo/left.gain=1", "`duo/left` is not a name", "given as `--set duo.left.gain`"),
        ("duo.left.gain=", "`--set duo.left.gain=`: it has no value", "write `--set name=value`"),
    ] {
        let ran = demo.run(&["check", "cell.yaml", "--set", set]);
        assert!(ran.code != 0 && ran.err.contains(said) && ran.err.contains(help), "{set}: {}", ran.err);
    }
}

#[test]
fn a_plan_is_grouped_folded_or_of_one_subsystem() {
    let demo = cell();
    let shows = |args: &[&str]| {
        let ran = demo.run(&[&["plan", "cell.yaml"], args].concat());
        assert_eq!(ran.code, 0, "{args:?}: {}", ran.err);
        ran.out
    };
    let whole = shows(&[]);
    let headings: Vec<&str> = whole.lines().filter(|line| !line.starts_with([' ', 't'])).collect();
    assert_eq!(headings, ["duo/left", "duo/right", "duo"], "{whole}");
    assert!(
        whole.contains("\n  duo/left/make  → root.alive.starting\n      0  changes  create duo/left/Drive : Drive"),
        "{whole}"
    );
    let folded = "duo  5 requests, 10 steps  → root.joined
then: 2 components, 2 of them running, 2 connections, 0 written ports
";
    assert_eq!(shows(&["--depth", "0"]), folded);
    let inside = "duo/left
  -- e_start
  make  → root.alive.starting
      0  changes  create Drive : Drive           exact  undo: destroy Drive
      1  changes  property_set Drive.gain = 0.7  exact  undo: property_set Drive.gain = 1.0  after 0
      2  post     configure Drive                exact  undo: cleanup Drive                  after 1
  run  → root.alive.on
      0  post  start Drive  exact  undo: stop Drive
  /duo: /duo/join  → root.joined
      0  changes  connect Drive.pose -> /duo/right/Drive.ref (data)  exact  undo: disconnect Drive.pose -> /duo/right/Drive.ref
      1  changes  connect /duo/right/Drive.pose -> Drive.ref (data)  exact  undo: disconnect /duo/right/Drive.pose -> Drive.ref
then: 1 component, 1 of them running, 2 connections, 0 written ports
";
    assert_eq!(shows(&["--in", "duo/left"]), inside);
    let alone = shows(&["--in", "duo/left", "make", "run"]);
    assert!(alone.contains("  run\n      0  post  start Drive") && !alone.contains("join"), "{alone}");
    let typo = demo.run(&["plan", "cell.yaml", "--in", "duo/left", "maek"]);
    assert!(typo.code == 1 && typo.err.contains("`duo/left/make`"), "{}", typo.err);

    let json = |args: &[&str]| demo.run(&[&["plan", "cell.yaml", "--json"], args].concat()).json();
    let place = |plan: &Value| json!([plan["configuration"], plan["subsystem"]]);
    let whole: Vec<Value> = json(&[]).as_array().unwrap().iter().map(place).collect();
    assert!(whole.contains(&json!(["duo/left/make", "duo/left"])) && whole.contains(&json!(["duo/join", "duo"])));
    let inside = json(&["--in", "duo/left"]);
    assert_eq!(
        inside.as_array().unwrap().iter().map(place).collect::<Vec<_>>(),
        [json!(["make", null]), json!(["run", null]), json!(["/duo/join", null])]
    );
    assert_eq!((&inside[0]["events"], &inside[0]["coordinator"]), (&json!(["e_start"]), &json!("left")));
    let step = &inside[0]["steps"][1];
    assert_eq!((&step["target"], &step["undo"]["target"]), (&json!("Drive.gain"), &json!("Drive.gain")), "{step}");
    assert_eq!(inside[0]["result"]["components"].as_object().unwrap().keys().collect::<Vec<_>>(), ["Drive"]);
}

#[test]
fn a_coordinator_of_a_subsystem_is_stepped_by_the_names_of_its_file() {
    let demo = cell();
    demo.write("events.txt", "run\ne_start\nmake.ok\nrun.ok\n");
    let sim = |args: &[&str]| demo.run(&[&["sim", "cell.yaml", "--events", "events.txt", "--json"], args].concat());
    let last = |ran: &Ran| -> Value { serde_json::from_str(ran.out.lines().last().expect("a line")).expect("JSON") };
    let ran = sim(&["--in", "duo/left"]);
    assert_eq!(
        last(&ran)["active"].as_array().unwrap().last(),
        Some(&json!("root.alive.on")),
        "{}{}",
        ran.out,
        ran.err
    );
    let ran = sim(&["--of", "duo/left"]);
    assert_eq!(last(&ran)["active"].as_array().unwrap().last(), Some(&json!("root.idle")), "names from the root, else");
    let which = demo.run(&["sim", "cell.yaml", "--events", "events.txt", "--in", "duo"]);
    assert!(which.code == 2 && which.err.contains("with one of duo, left, right"), "{}", which.err);
    assert_eq!(sim(&["--in", "duo", "--of", "left"]).code, 0);
}

#[test]
fn pictures_have_boxes_arrows_and_folds() {
    let demo = cell();
    let graph = |args: &[&str]| {
        let ran = demo.run(&[&["graph", "cell.yaml", "--format", "mermaid"], args].concat());
        assert_eq!(ran.code, 0, "{args:?}: {}", ran.err);
        ran.out
    };
    let components = graph(&["--depth", "1"]);
    assert!(components.contains("subgraph") && components.contains("left<br/>1 component<br/>running"), "{components}");
    assert!(components.contains("|\"Drive.pose → Drive.ref\"|"), "{components}");
    let components = graph(&["--depth", "0"]);
    assert!(components.contains("duo<br/>2 components<br/>running") && !components.contains("-->"), "{components}");
    let components = graph(&["--in", "duo/left"]);
    assert!(
        components.contains("cell/duo/left: components") && components.contains("\"/duo/right/Drive<br/>"),
        "{components}"
    );

    let all = graph(&["--what", "coordinator"]);
    for arrow in
        ["e_shutdown, e_start", "down, failed, up", "e_released, e_shutdown, e_start", "down, e_leaving, failed, up"]
    {
        assert!(all.contains(&format!(" : {arrow}\n")), "{arrow}: {all}");
    }
    assert!(all.contains(" : make.ok\n") && !all.contains("left/make"), "by the names of their own files: {all}");
    let folded = graph(&["--what", "coordinator", "--depth", "0"]);
    assert!(folded.contains(" : 3 coordinators\n") && folded.contains(" : down, failed, up\n"), "{folded}");
    assert!(!folded.contains("join") && !folded.contains("make"), "{folded}");
    let inside = graph(&["--what", "coordinator", "--in", "duo/left"]);
    assert!(inside.contains(" : make.ok\n") && !inside.contains("join"), "{inside}");
    let plan = graph(&["--what", "plan", "--in", "duo", "--depth", "0"]);
    assert!(plan.contains("left<br/>2 requests<br/>4 steps") && plan.contains("\"join\""), "{plan}");

    let cell = DeployedCell(demo);
    deploy(&cell.0, "cell.yaml");
    let live = cell.0.run(&[
        "graph",
        "cell.yaml",
        "--format",
        "mermaid",
        "--what",
        "coordinator",
        "--live",
        "--in",
        "duo/left",
    ]);
    assert!(live.code == 0 && live.out.contains("class n2,n6 active"), "{}{}", live.out, live.err);
}

/// A subsystem that its parent leads down by itself takes along what an operator put in its way there, as a deployment does that is led
/// down whole; and while it is led down an operator asks for nothing more of it.
#[test]
fn what_an_operator_put_on_a_subsystem_goes_when_that_is_led_down_alone() {
    let demo = cell();
    demo.write(
        "story.lua",
        "deploy('pair.yaml')
         set('left/Drive.gain', 1.5, { force = true, within = 1 })
         set('right/Drive.gain', 1.5, { force = true, within = 1 })
         raise('left/Drive.faulted')
         wait_answer('left/make.undone', 5)
         wait_state('pair:idle', 5)
         shutdown()",
    );
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

/// What a script asks for that is nowhere is told with what there is of that name in subsystems.
#[test]
fn an_event_and_a_state_that_are_nowhere_are_told_with_those_of_subsystems() {
    let demo = cell();
    for (line, says) in [
        ("raise('Drive.faulted')", "did you mean `left/Drive.faulted` or `right/Drive.faulted`?"),
        ("wait_state('lfet:on', 1)", "there is no coordinator `lfet` that could be in `lfet:on`: did you mean `left`?"),
        ("wait_state('left:no', 1)", "has no state `left:no`: known states: "),
        ("wait_state('left.on', 1)", "no coordinator has a state `left.on`: did you mean `left:on`?"),
    ] {
        demo.write("story.lua", &format!("deploy('pair.yaml') {line}"));
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--quiet"]);
        let said: Vec<&str> = ran.err.split_whitespace().filter(|word| *word != "│").collect();
        assert!(ran.code == 1 && said.join(" ").contains(says), "{line}: {}{}", ran.out, ran.err);
    }
}

/// Leads each of the pair by a coordinator of its own.
pub fn apart(demo: &Demo) {
    demo.write(
        "pair.yaml",
        &example("pair.yaml")
            .replace("coordinator: pair_coordinator.lua", "coordinators: { l: left.lua, r: right.lua }")
            .replace("up: joined", "up: [l:on, r:on]")
            .replace("down: idle", "down: [l:idle, r:idle]"),
    );
    for side in ["left", "right"] {
        demo.write(
            &format!("{side}.lua"),
            &"return state { idle = state {}, raising = state { entry = 'SIDE/e_start' }, on = state {}, failed = state {},
  lowering = state { entry = { 'SIDE/e_shutdown', 'SIDE/e_released' } },
  trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'on', events = { 'SIDE/up' } }, trans { src = 'raising', tgt = 'failed', events = { 'SIDE/failed' } },
  trans { src = 'raising', tgt = 'lowering', events = { 'e_shutdown' } }, trans { src = 'failed', tgt = 'lowering', events = { 'e_shutdown' } },
  trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown', 'SIDE/e_leaving' } }, trans { src = 'lowering', tgt = 'idle', events = { 'SIDE/down' } } }"
                .replace("SIDE", side),
        );
    }
}

/// A sibling that is busy does not keep a subsystem from being down, nor from telling it.
#[test]
fn that_a_subsystem_is_down_is_told_while_a_sibling_is_busy() {
    let demo = cell();
    demo.write(
        "robot.yaml",
        &example("robot.yaml").replace(
            "    properties: { gain: { type: float, default: 1.0 } }",
            "    properties: { gain: { type: float, default: 1.0 } }\n    operations: { home: { effect: none } }",
        ),
    );
    demo.write(
        "robot_configurations.lua",
        &example("robot_configurations.lua").replacen(
            "ConfiguratorConf {",
            "ConfiguratorConf { home = Configuration { timeout = 9, operation_call('Drive.home') },",
            1,
        ),
    );
    apart(&demo);
    demo.write(
        "story.lua",
        "deploy('pair.yaml')
         fault('operation_call right/Drive.home', 'slow', 1, 7)
         apply('right/home', { force = true })
         wait(0.3)
         raise('left/Drive.faulted')
         wait_answer('left/down', 1)
         assert(now() < 2)
         wait(8)
         shutdown()",
    );
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}
