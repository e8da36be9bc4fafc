//! What whoever types, or writes a script, is told beside what was asked for: what comes of it, what was meant, how it is called.

use crate::demo::{Demo, Ran, at_home};
use crate::foreground::Foreground;
use std::process::Stdio;

/// The demo, with changes to its files, deployed.
fn deployed(changes: &[(&str, &str, &str)]) -> (Demo, Foreground) {
    let demo = Demo::new();
    changes.iter().for_each(|(file, from, to)| _ = demo.replace(file, from, to));
    let mut command = demo.command(&["deploy", "deployment.yaml"]);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let deployed = Foreground::start(&mut command);
    demo.until_phase("up");
    (demo, deployed)
}

fn ended(demo: &Demo, deployed: Foreground) {
    assert_eq!(demo.run(&["shutdown", "--on", "demo"]).code, 0, "`--on` says which, too");
    assert_eq!(deployed.end().code(), Some(0));
}

#[test]
fn an_operator_hears_whose_frame_goes_and_what_must_be_confirmed() {
    let confirmed = "rename = Configuration { confirm = { event = \"e_fine\", within = 60 },";
    let (demo, deployed) = deployed(&[("configurations.lua", "rename = Configuration {", confirmed)]);
    let fast = demo.run(&["apply", "fast", "--force"]);
    assert_eq!(fast.code, 0, "{}{}", fast.out, fast.err);
    let told = "note: it is in the place of `slow` of `demo`, which an undo does not bring back: `davit apply slow --force` does\n";
    assert_eq!(fast.err, told);
    let again = demo.run(&["apply", "slow", "--force"]);
    assert_eq!((again.code, again.err.as_str()), (0, ""), "the operator's own frame");
    let rename = demo.run(&["apply", "rename", "--force"]);
    let told = "note: `rename` is taken back after 60 s unless `e_fine` confirms it: `davit event e_fine`\n";
    assert_eq!((rename.code, rename.err.as_str()), (0, told), "{}", rename.out);
    let json = demo.run(&["apply", "fast", "--force", "--json", "--wait"]).json();
    assert_eq!(json["notes"].as_array().map(Vec::len), Some(0), "{json}");
    ended(&demo, deployed);
}

#[test]
fn a_commit_that_is_refused_names_force() {
    let (demo, deployed) = deployed(&[]);
    let commit = demo.run(&["commit", "--on", "demo"]);
    assert!(commit.code == 1 && commit.out.contains("only with `--force`"), "{}{}", commit.out, commit.err);
    ended(&demo, deployed);
}

#[test]
fn which_deployment_is_meant_is_said_alike_everywhere() {
    let (demo, deployed) = deployed(&[]);
    for command in ["status", "stack", "drift", "log"] {
        for which in [&["demo"][..], &["--on", "demo"]] {
            let ran = demo.run(&[&[command], which].concat());
            assert_eq!(ran.code, 0, "{command} {which:?}: {}{}", ran.out, ran.err);
        }
        let both = demo.run(&[command, "demo", "--on", "other"]);
        assert_ne!(both.code, 0, "{command}: {}", both.out);
    }
    let event = demo.run(&["event", "e_fast", "demo"]);
    assert!(event.code == 2 && event.err.contains("`--on demo`"), "{}", event.err);
    ended(&demo, deployed);
}

#[test]
fn who_deploys_hears_that_there_are_warnings() {
    let demo = Demo::new();
    // Nobody hears that it fails.
    demo.replace("coordinator.lua", "\"create_all.failed\", \"connect_all.failed\"", "\"connect_all.failed\"");
    let warnings = demo.run(&["check", "deployment.yaml"]).err.matches('⚠').count();
    assert!(warnings > 0);
    let (deployed, told) = (
        demo.run(&["deploy", "deployment.yaml", "--clock", "simulated", "--detach"]),
        "`davit check deployment.yaml` shows",
    );
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    let said = format!("{}{}", deployed.out, deployed.err);
    assert!(said.contains(told) && said.contains(&format!("{warnings} warning")), "{said}");
}

#[test]
fn who_deploys_what_is_refused_is_shown_why_and_how_much_more_there_is() {
    let demo = Demo::new();
    demo.replace("coordinator.lua", "\"create_all.failed\", \"connect_all.failed\"", "\"connect_all.failed\"");
    demo.replace("configurations.lua", "property_set(\"source.k\", 9)", "property_set(\"source.k\", 99)");
    demo.write("story.lua", "deploy('deployment.yaml')");
    for args in [["deploy", "deployment.yaml"], ["run", "story.lua"]] {
        let ran = demo.run(&args);
        let told = ran.err.contains("conf::bad_value") && ran.err.contains(": `davit check deployment.yaml` shows ");
        assert!(ran.code == 1 && told && !ran.err.contains('⚠'), "{args:?}: {}", ran.err);
    }
    let json = demo.run(&["deploy", "deployment.yaml", "--json"]).json();
    let warned = json["findings"].as_array().is_some_and(|all| all.iter().any(|one| one["severity"] == "warning"));
    assert!(warned, "programs are told all: {json}");
}

fn scripted(text: &str) -> Ran {
    let demo = Demo::new();
    demo.write("story.lua", text);
    demo.run(&["run", "story.lua", "--clock", "simulated"])
}

#[test]
fn a_function_that_is_called_otherwise_says_how_it_is_called() {
    for (text, told) in [
        ("wait_state('soft')", "`wait_state` is called as `wait_state(\"STATE\", SECONDS)`: something is missing"),
        ("say(nil)", "`say` is called as `say(\"TEXT\")`: what is given is nil"),
        ("log(1)", "a table is wanted where this"),
        ("say('a', 'b')", "`say` is called as `say(\"TEXT\")`: 2 values are given"),
        ("now(1)", "it takes nothing"),
        ("fault('a', 'fail', {})", "a number is wanted where"),
        ("inject('a', 'b', {}, 1, 2)", "it takes no more than 4 values, and 5 are given"),
    ] {
        let ran = scripted(text);
        let err = ran.err.replace("\n  │", "");
        assert!(ran.code == 1 && err.contains("story.lua:1: ") && err.contains(told), "{text}: {err}");
    }
    let twice = scripted("expect{ name = 'x', value = 1,\n  max = 2, max = 0 }");
    assert!(twice.code == 2 && twice.err.contains("story.lua:2: `max` stands twice in one table"), "{}", twice.err);
}

#[test]
fn a_deployment_is_no_script_and_a_parameter_that_nothing_reads_is_a_mistake_of_the_command() {
    let demo = Demo::new();
    let ran = demo.run(&["run", "deployment.yaml"]);
    assert!(ran.code == 2 && ran.err.contains("`davit deploy deployment.yaml`"), "{}", ran.err);
    let unread = |script: &str| {
        demo.write("story.lua", script);
        demo.run(&["run", "story.lua", "--clock", "simulated", "--set", "kq=3"])
    };
    for script in ["say('on')", "local k = param('kp', 1) say('on')", "deploy('deployment.yaml') shutdown()"] {
        let ran = unread(script);
        assert_eq!(ran.code, 2, "{script}: {}{}", ran.out, ran.err);
        assert!(ran.err.contains("unknown_parameter"), "{script}: {}", ran.err);
    }
}

#[test]
fn a_part_of_a_deployment_is_no_deployment() {
    let demo = Demo::new();
    demo.write("only.yaml", "coordinator:\n  states: { idle: {} }\n");
    let ran = demo.run(&["check", "only.yaml"]);
    let told =
        ran.err.contains("this is a file of a coordinator, and no deployment") && !ran.err.contains("missing_key");
    assert!(ran.code == 1 && told, "{}", ran.err);
    assert_eq!(demo.run(&["graph", "only.yaml"]).code, 0);
}

#[test]
fn what_is_planned_alone_says_what_has_to_come_before() {
    let demo = Demo::new();
    let ran = demo.run(&["plan", "deployment.yaml", "fast"]);
    let err = ran.err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(ran.code == 1 && err.contains("name what creates it before, as in `create_all fast`"), "{}", ran.err);
    assert_eq!(demo.run(&["plan", "deployment.yaml", "create_all", "fast"]).code, 0);
}

/// What `check` says of the demo with a slip in a file.
fn slip(file: &str, from: &str, to: &str) -> String {
    let demo = Demo::new();
    demo.replace(file, from, to);
    let ran = demo.run(&["check", "deployment.yaml"]);
    assert_eq!(ran.code, 1, "{to}: {}{}", ran.out, ran.err);
    ran.err.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_slip_is_told_once_and_with_what_was_meant() {
    let initial = "trans { src = \"initial\", tgt = \"idle\" }";
    let misspelt = slip("coordinator.lua", initial, "trans { src = \"initail\", tgt = \"idle\" }");
    assert!(
        misspelt.contains("did you mean `initial`?") && !misspelt.contains("in which state it begins"),
        "{misspelt}"
    );
    for (key, meant) in [("scr", "src"), ("source", "src")] {
        let said = slip("coordinator.lua", initial, &format!("trans {{ {key} = \"initial\", tgt = \"idle\" }}"));
        assert!(said.contains(&format!("did you mean `{meant}`?")), "{said}");
    }
    for (from, to, meant) in [
        ("create(\"source\", \"Source\"", "create(\"source\", Source", "`\"Source\"`"),
        ("entry = \"create_all\"", "entry = create_all", "`\"create_all\"`"),
        ("creating = state { entry", "creating = { entry", "`creating = state { … }`"),
    ] {
        let file = if from.starts_with("create(") { "configurations.lua" } else { "coordinator.lua" };
        let said = slip(file, from, to);
        assert!(said.contains(meant), "{to}: {said}");
    }
    // A text that does not parse says nothing of what it reads.
    let demo = Demo::new();
    let with = "with: { top: 9.0 }\nconfigurations:";
    demo.replace("deployment.yaml", "configurations:", with);
    demo.replace("configurations.lua", "property_set(\"source.k\", 9)", "property_set(\"source.k\", top))");
    let ran = demo.run(&["check", "deployment.yaml"]);
    assert!(ran.code != 0 && !ran.err.contains("no Lua file reads"), "{}", ran.err);
}

/// What is wrong with the declaration of a parameter is told there, and nothing of the files that read it.
#[test]
fn a_parameter_that_is_declared_ill_is_not_called_missing_as_well() {
    for (ill, said) in [
        ("top: { type: float, default: half }", "the default is not allowed"),
        ("top: { type: flot, default: 0.5 }", "`flot` is not a type"),
        ("top: { type: float, default: 2.0, max: 1.0 }", "the default is not allowed"),
    ] {
        let demo = Demo::new();
        demo.replace("deployment.yaml", "configurations:", &format!("parameters: {{ {ill} }}\nconfigurations:"));
        demo.replace("configurations.lua", "property_set(\"source.k\", 9)", "property_set(\"source.k\", top)");
        let ran = demo.run(&["check", "deployment.yaml"]);
        assert!(ran.code == 1 && ran.err.contains(said) && ran.err.contains("1 error\n"), "{ill}: {}", ran.err);
    }
}

#[test]
fn a_slip_in_the_platform_of_a_parent_is_told_there_and_once() {
    let demo = Demo::new();
    let (robot, parent) = ("name: robot\nplatform: simulated", "name: pair\nplatform: simulatd");
    let rest = "types: {}\nconfigurations: [none.yaml]\ncoordinator: rests.yaml\ndeploy: { event: e_start, up: on, \
                within_s: 1 }\nshutdown: { event: e_stop, down: off, within_s: 1 }\n";
    demo.write("robot.yaml", &format!("davit: 1\n{robot}\n{rest}"));
    let two = "subsystems: { left: { deployment: robot.yaml }, right: { deployment: robot.yaml } }";
    demo.write("pair.yaml", &format!("davit: 1\n{parent}\n{two}\n{rest}"));
    demo.write("none.yaml", "configurations: {}\n");
    let chart = "coordinator:\n  states: { off: {}, on: {} }\n  transitions:\n    - { src: initial, tgt: off }\n    \
                 - { src: off, tgt: on, events: [e_start] }\n    - { src: on, tgt: off, events: [e_stop] }\n";
    demo.write("rests.yaml", chart);
    let ran = demo.run(&["check", "pair.yaml"]);
    let there = ran.err.contains("pair.yaml:3:11") && ran.err.contains("`simulated` or `simulatd`?");
    assert!(ran.code == 1 && there && ran.err.matches("compose::differs").count() == 1, "{}", ran.err);
}

#[test]
fn a_parent_is_told_the_names_that_it_may_use() {
    let home = env!("CARGO_MANIFEST_DIR");
    let demo = Demo::new();
    for file in std::fs::read_dir(format!("{home}/examples/pair")).expect("the folder") {
        let file = file.expect("a file");
        demo.write(&file.file_name().to_string_lossy(), &std::fs::read_to_string(file.path()).expect("a text"));
    }
    assert_eq!(demo.run(&["check", "pair.yaml"]).code, 0);
    let said = |file: &str, from: &str, to: &str| {
        let before = demo.read(file);
        demo.replace(file, from, to);
        let ran = demo.run(&["check", "pair.yaml"]);
        demo.write(file, &before);
        ran.err.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    let subsystem = said("pair_configurations.lua", "left.", "lfet.");
    assert!(subsystem.contains("did you mean `left`?"), "{subsystem}");
    for event in ["left/e_start", "left/e_leaving"] {
        let dotted = said("pair_coordinator.lua", event, &event.replace('/', "."));
        assert!(dotted.contains(&format!("did you mean `{event}`?")), "{dotted}");
    }
    let types = said("pair.yaml", "types: {}\n", "");
    assert!(types.contains("add `types: {}`"), "{types}");
    // A file that is two subsystems is read twice, and what is wrong in it told once.
    let once = said("robot.yaml", "max: 2.0", "mx: 2.0");
    assert!(once.matches("has no `mx`").count() == 1 && once.contains("did you mean `max`?"), "{once}");
    // Whom nobody begins, or ends, is named, though the way that something fails leads on.
    let begun = said("pair_coordinator.lua", "\"left/e_start\", \"right/e_start\"", "\"left/e_start\"");
    let raises = "no coordinator raises `right/e_start`, which begins `right`: raise it on the way";
    assert!(
        begun.contains(raises) && begun.contains("stops at `root.raising.left` and never reaches `joined`"),
        "{begun}"
    );
    let ended = said("pair_coordinator.lua", "\"left/e_shutdown\", \"right/e_shutdown\"", "\"left/e_shutdown\"");
    let raises = "no coordinator raises `right/e_shutdown`, which ends `right`: raise it on the way";
    assert!(ended.contains(raises) && !ended.contains("`idle`, `idle`"), "{ended}");
    // What stands for a subsystem while its parent is checked is no configuration.
    for (file, from, to) in [
        ("pair.yaml", "types: {}\n", "types: {}\noperator: [left]\n"),
        ("pair_coordinator.lua", "joined   = state {}", "joined   = state { config = \"left\" }"),
    ] {
        let ids = said(file, from, to);
        assert!(ids.contains("there is no configuration `left`"), "{to}: {ids}");
        assert!(!ids.contains("`right`"), "{to}: {ids}");
    }
}

#[test]
fn an_answer_about_what_an_operator_sets_is_waited_for_also_where_a_configuration_is_called_like_it() {
    let configurations = "ConfiguratorConf {
      base = Configuration { create('base', 'Unit'), post_conf_state = { 'base:running' } },
    }";
    let script = "deploy('deployment.yaml')
      set('base.k', 2.0) wait_answer('base.k.ok', 1)
      undo('base.k') wait_answer('base.k.undone', 1)
      shutdown()";
    let deployment = "davit: 1
name: small
platform: simulated
types: { Unit: { properties: { k: { type: float, default: 1.0 } } } }
configurations: [conf.lua]
coordinator: coordinator.lua
operator: [base.k]
deploy:   { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
";
    let ran = crate::small::run(deployment, configurations, script);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}

#[test]
fn what_nobody_can_explain_is_no_list_of_what_can_be() {
    let told = |what: &str| at_home(&["explain", what]).err.split_whitespace().collect::<Vec<_>>().join(" ");
    let none = told("nosuchkey");
    assert!(none.ends_with("help: `davit explain` lists all codes, `davit explain --keys` all keys"), "{none}");
    assert!(told("timeuot").contains("did you mean `timeout`?"));
}

#[test]
fn a_picture_needs_no_order_of_painting_and_says_what_it_cuts() {
    let svg = at_home(&["graph", "deployments/youbot_arm.yaml", "--what", "coordinator"]).out;
    assert!(svg.contains("operational") && !svg.contains("paint-order"));
    let cut = svg.lines().filter(|line| line.contains('…')).count();
    assert!(cut > 0 && svg.matches("<g><title>").count() >= cut.min(1), "{cut}");
}
