//! Each command: what it prints, the shape of its JSON, its exit status.

use crate::demo::{Demo, at_home};
use serde_json::{Value, json};
use std::io::Write;
use std::process::Stdio;

#[test]
fn usage_and_unreadable_input_are_status_2() {
    let demo = Demo::new();
    std::fs::create_dir(demo.path("directory.yaml")).unwrap();
    demo.write("broken.yaml", "davit: 1\nname: [\n");
    for args in [
        vec![],
        vec!["chekc", "deployment.yaml"],
        vec!["check"],
        vec!["check", "missing.yaml"],
        vec!["check", "directory.yaml"],
        vec!["check", "broken.yaml"],
        vec!["plan", "missing.yaml"],
        vec!["graph", "missing.yaml"],
        vec!["convert", "missing.lua", "--to", "yaml"],
        vec!["sim", "missing.lua"],
        vec!["sim", "coordinator.lua", "--events", "missing.txt"],
        vec!["check", "deployment.yaml", "--set", "nonsense"],
        vec!["plan", "deployment.yaml", "--bringup", "--shutdown"],
        vec!["graph", "deployment.yaml", "-o", "no/such/directory/picture.svg"],
    ] {
        let ran = demo.run(&args);
        assert_eq!(ran.code, 2, "{args:?}: {}{}", ran.out, ran.err);
        assert!(!ran.err.is_empty(), "{args:?} says nothing");
    }
    for args in [["--help"], ["--version"]] {
        let ran = demo.run(&args);
        assert_eq!((ran.code, ran.err.as_str()), (0, ""), "{args:?}");
    }
}

#[test]
fn the_help_of_every_command_says_what_it_does() {
    let help = at_home(&["--help"]).out;
    for command in ["check", "plan", "graph", "types", "convert", "sim", "monitor", "schema", "explain", "completions"]
    {
        assert!(help.contains(command), "{help}");
        let own = at_home(&[command, "--help"]).out;
        assert!(own.contains("Usage: davit"), "{own}");
    }
}

#[test]
fn explain_lists_and_explains_every_code() {
    let list = at_home(&["explain"]);
    assert_eq!(list.code, 0);
    for page in davit::model::codes::PAGES {
        assert!(list.out.contains(page.code.0), "{}", page.code);
    }
    let one = at_home(&["explain", "davit::coord::stuck"]);
    assert!(one.out.contains("nothing leads on"), "{}", one.out);
    let unknown = at_home(&["explain", "coord::stuk"]);
    assert_eq!(unknown.code, 1);
    assert!(unknown.err.contains("coord::stuck"), "{}", unknown.err);
    assert_eq!(at_home(&["explain", "coord::stuck", "--json"]).json()["code"], "coord::stuck");
}

#[test]
fn explain_tells_what_an_answer_means() {
    for ending in davit::model::Verdict::ENDINGS {
        // Only an undo that names nothing is answered so.
        let answer = if ending == ".done" { "undo.done".to_owned() } else { format!("work{ending}") };
        let told = at_home(&["explain", &answer, "--json"]).json();
        let name = told["answer"].as_str().unwrap_or_default();
        assert!(name.ends_with(ending) || (name, ending) == ("ID.undone", ".done"), "{answer}: {told}");
    }
    assert!(at_home(&["explain", "lost"]).out.starts_with("ID.lost: an answer"));
    // What else is called so is told behind it, and a key by its whole name is that key.
    let failed = at_home(&["explain", "failed"]).out;
    assert!(failed.starts_with("ID.failed: an answer") && failed.contains("deploy.failed"), "{failed}");
    assert!(at_home(&["explain", "deploy.failed"]).out.starts_with("deploy.failed"));
}

#[test]
fn explain_tells_what_a_key_means() {
    for (slip, meant) in [("configuration.tmeout", "configuration.timeout"), ("type.ports.unti", "type.ports.unit")] {
        let unknown = at_home(&["explain", slip]);
        assert!(unknown.code == 1 && unknown.err.contains(&format!("did you mean `{meant}`?")), "{}", unknown.err);
    }
    let timeout = at_home(&["explain", "timeout"]);
    assert_eq!(timeout.code, 0, "{}", timeout.err);
    for part in ["configuration.timeout", "in seconds", "timeout = 0.5", "timeout: 0.5", "text::bad_time"] {
        assert!(timeout.out.contains(part), "{part}: {}", timeout.out);
    }
    let several = at_home(&["explain", "moves", "--json"]).json();
    let of: Vec<_> = several.as_array().unwrap().iter().map(|entry| entry["of"].as_str().unwrap()).collect();
    assert_eq!(of, ["type", "operation"]);
    assert_eq!(at_home(&["explain", "operation.moves", "--json"]).json().as_array().unwrap().len(), 1);
    assert!(at_home(&["explain", "for_at_least"]).out.contains("a condition"));
    // What is written and is no key, and the ways in which findings name places.
    for (what, says) in [
        ("self", "settled_by"),
        ("_default", "the list does not name"),
        ("initial", "entered first"),
        ("e_after", "so many seconds after"),
        ("e_after(0.5)", "so many seconds after"),
        ("e_at", "the coordinator began"),
        ("e_done", "complete"),
        ("condition", "true or false"),
        ("signal", "a number at every instant"),
    ] {
        let told = at_home(&["explain", what]);
        assert!(told.code == 0 && told.out.contains(says), "{what}: {}{}", told.out, told.err);
    }
    for path in ["type.ports.unit", "types.Gain.ports.u.unit", "deployment.types.ports.unit", "port.unit"] {
        let told = at_home(&["explain", path, "--json"]).json();
        assert_eq!(told[0]["of"], "port", "{path}: {told}");
        assert_eq!(told.as_array().unwrap().len(), 1, "{path}: {told}");
    }
    assert_eq!(at_home(&["explain", "type.prots.unit"]).code, 1);
    let unknown = at_home(&["explain", "timeut"]);
    assert!(unknown.code == 1 && unknown.err.contains("did you mean `timeout`?"), "{}", unknown.err);
    let keys = at_home(&["explain", "--keys"]);
    assert!(keys.out.contains("deploy.within_s") && !keys.out.contains("durability"), "{}", keys.out);
}

/// A flag is told like a key, with the keys that are about it; one that no command has is not.
#[test]
fn flags_are_explained() {
    let ran = at_home(&["explain", "--", "--set"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    for told in ["--set <NAME=VALUE>", "davit check", "davit deploy", "davit explain deployment.with"] {
        assert!(ran.out.contains(told), "{told}: {}", ran.out);
    }
    let json = at_home(&["explain", "--json", "--", "--budget=2M"]).json();
    assert_eq!(json[0]["of"], serde_json::json!(["check"]), "{json}");
    assert!(json[0]["doc"].as_str().is_some_and(|doc| doc.contains("500Kstates")), "{json}");
    let ran = at_home(&["explain", "--", "--bugdet"]);
    assert!(ran.code == 1 && ran.err.contains("did you mean `--budget`?"), "{}", ran.err);
    assert!(ran.err.contains("no command has a flag `--bugdet`"), "{}", ran.err);
}

#[test]
fn schema_writes_what_editors_need() {
    let demo = Demo::new();
    for kind in ["deployment", "configurations", "coordinator", "monitors"] {
        let ran = demo.run(&["schema", kind]);
        assert_eq!(ran.code, 0, "{}", ran.err);
        assert!(ran.json()["properties"].is_object(), "{}", ran.out);
        let page = demo.run(&["schema", kind, "--markdown"]);
        assert!(page.out.starts_with(&format!("# Reference: {kind}\n")), "{}", page.out);
    }
    assert_eq!(demo.run(&["schema"]).json()["properties"]["name"]["type"], "string");
    // What this program has is completed, and what it has not underlined.
    let deployment = demo.run(&["schema"]).json();
    assert_eq!(deployment["properties"]["platform"]["anyOf"][0]["enum"], serde_json::json!(["embedded", "simulated"]));
    assert_eq!(deployment["properties"]["libraries"]["anyOf"][0]["enum"], serde_json::json!(["standard", "youbot"]));
    let types = &demo.run(&["schema", "configurations"]).json()["definitions"]["create"]["properties"]["type"];
    let known = types["anyOf"][0]["enum"].as_array().unwrap();
    assert!(known.contains(&"standard.Gain".into()), "{types}");
    assert_eq!(demo.run(&["schema", "lua", "-o", "davit.lua"]).code, 0);
    assert!(demo.read("davit.lua").contains("function property_set(property, value) end"));
    let unknown = demo.run(&["schema", "deploymnt"]);
    assert!(unknown.code == 2 && unknown.err.contains("deployment"), "{}", unknown.err);
}

#[test]
fn completions_are_scripts() {
    for (shell, word) in [("bash", "complete"), ("zsh", "compdef"), ("fish", "complete")] {
        let ran = at_home(&["completions", shell]);
        assert_eq!(ran.code, 0);
        assert!(ran.out.contains(word) && ran.out.contains("davit"));
    }
}

#[test]
fn check_says_it_in_words_and_as_json() {
    let demo = Demo::new();
    let ran = demo.run(&["check", "deployment.yaml"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.out.starts_with("demo: sound; followed through all "), "{}", ran.out);
    assert!(!ran.out.contains('\x1b'), "colours only on a terminal");
    assert!(demo.run(&["check", "deployment.yaml", "--color", "always"]).out.contains('\x1b'));
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let keys: Vec<&String> = json.as_object().unwrap().keys().collect();
    for key in ["ok", "findings", "explored", "trace"] {
        assert!(keys.iter().any(|k| *k == key), "{keys:?}");
    }
    demo.replace("configurations.lua", "\"source.y\"", "\"source.z\"");
    let ran = demo.run(&["check", "deployment.yaml"]);
    assert_eq!(ran.code, 1);
    assert!(ran.err.contains("davit::conf::unknown_port") && ran.err.contains("configurations.lua"), "{}", ran.err);
    assert!(ran.out.contains("refused"));
    let finding = demo.run(&["check", "deployment.yaml", "--json"]).json()["findings"][0].clone();
    for key in ["code", "severity", "message", "file", "line", "column", "help"] {
        assert!(finding.get(key).is_some(), "{key} is missing: {finding}");
    }
}

#[test]
fn plan_has_the_documented_shape() {
    let demo = Demo::new();
    let plans =
        demo.run(&["plan", "deployment.yaml", "create_all", "connect_all", "start_all", "fast", "--json"]).json();
    let plans = plans.as_array().unwrap();
    let ids: Vec<&str> = plans.iter().map(|p| p["configuration"].as_str().unwrap()).collect();
    assert_eq!(ids, ["create_all", "connect_all", "start_all", "fast"]);
    for plan in plans {
        for (i, step) in plan["steps"].as_array().unwrap().iter().enumerate() {
            assert_eq!(step["id"], i);
            for key in ["do", "target", "after", "stage", "reversibility", "undo"] {
                assert!(step.get(key).is_some(), "{key} is missing: {step}");
            }
            assert!(step["undo"].is_object());
            assert!(step["after"].as_array().unwrap().iter().all(|a| a.as_u64().unwrap() < i as u64));
        }
    }
    let fast = &plans[3];
    let set = fast["steps"].as_array().unwrap().iter().find(|s| s["do"] == "property_set").unwrap();
    assert_eq!(set["target"], "source.k");
    assert_eq!(set["value"], json!(9.0));
    assert_eq!(set["stage"], "changes");
    assert_eq!(set["reversibility"], "exact");
    assert_eq!(set["undo"]["value"], json!(2.0));
    assert_eq!(plans[2]["steps"][0]["do"], "configure");
    let system = &fast["result"];
    assert_eq!(system["components"]["source"]["state"], "running");
    assert_eq!(system["components"]["source"]["type"], "Source");
    assert_eq!(system["components"]["source"]["properties"]["k"], json!(9.0));
    assert_eq!(system["components"]["source"]["activity"], "control");
    assert_eq!(system["connections"], json!([{ "from": "source.y", "to": "sink.u", "policy": "data" }]));
    assert_eq!(system["ports"], json!({ "sink.flag": true }));
}

#[test]
fn a_list_of_run_states_is_worked_off_in_order() {
    let demo = Demo::new();
    let plans = demo.run(&["plan", "deployment.yaml", "create_all", "start_all", "--json"]).json();
    let steps = plans[1]["steps"].as_array().unwrap();
    let place = |what: &str, who: &str| steps.iter().find(|s| s["do"] == what && s["target"] == who).unwrap();
    // Both lists name sink first: whatever follows `after` backwards from source's first step meets sink's last one.
    let mut open = vec![place("configure", "source")["id"].as_u64().unwrap()];
    let mut met = Vec::new();
    while let Some(id) = open.pop() {
        let step = steps.iter().find(|s| s["id"] == id).unwrap();
        open.extend(step["after"].as_array().unwrap().iter().filter_map(Value::as_u64));
        met.push(id);
    }
    assert!(met.contains(&place("start", "sink")["id"].as_u64().unwrap()), "{steps:#?}");
}

#[test]
fn a_group_replaces_its_frame() {
    let demo = Demo::new();
    let args = ["plan", "deployment.yaml", "create_all", "slow", "fast", "slow", "--json"];
    let plans = demo.run(&args).json();
    assert_eq!(plans[3]["result"], plans[1]["result"], "back to the first of the group");
    let sets: Vec<&Value> =
        plans[2]["steps"].as_array().unwrap().iter().filter(|s| s["target"] == "source.k").collect();
    assert_eq!(sets.len(), 1, "the net: never through the value before both");
}

#[test]
fn plan_refuses_what_was_asked_for_and_nothing_else() {
    let demo = Demo::new();
    let ran = demo.run(&["plan", "deployment.yaml", "connect_all", "--json"]);
    assert_eq!(ran.code, 1);
    assert_eq!(ran.json()["ok"], false);
    assert!(ran.json()["findings"].as_array().is_some_and(|f| !f.is_empty()));
    let ran = demo.run(&["plan", "deployment.yaml", "create_al", "--json"]);
    assert_eq!(ran.code, 1);
    assert_eq!(ran.json()["findings"][0]["code"], "cli::unknown_configuration");
    assert_eq!(ran.json()["findings"][0]["help"], "did you mean `create_all`?");
    // A mistake in another configuration.
    demo.replace("configurations.lua", "property_set(\"source.name\"", "property_set(\"sorce.name\"");
    let told = demo.run(&["plan", "deployment.yaml", "create_all"]);
    assert_eq!(told.code, 0);
    assert!(told.err.contains("conf::unknown_component"), "{}", told.err);
    assert_eq!(demo.run(&["plan", "deployment.yaml", "create_all", "rename"]).code, 1);
}

#[test]
fn bringup_and_shutdown_are_planned_through_the_coordinator() {
    let demo = Demo::new();
    let plans = demo.run(&["plan", "deployment.yaml", "--bringup", "--json"]).json();
    let ids: Vec<&str> = plans.as_array().unwrap().iter().map(|p| p["configuration"].as_str().unwrap()).collect();
    assert_eq!(ids, ["create_all", "connect_all", "start_all", "slow"]);
    let plans = demo.run(&["plan", "deployment.yaml", "--shutdown", "--json"]).json();
    let last = plans.as_array().unwrap().last().unwrap();
    assert_eq!(last["result"], json!({ "components": {}, "connections": [], "ports": {} }));
    assert_eq!(last["requests"], json!(["create_all.undo"]));
    let text = demo.run(&["plan", "deployment.yaml", "--bringup"]).out;
    assert!(text.contains("-- e_start") && text.contains("connect source.y -> sink.u"), "{text}");
}

#[test]
fn graphs_come_in_three_formats() {
    let demo = Demo::new();
    for what in ["components", "coordinator", "plan"] {
        let svg = demo.run(&["graph", "deployment.yaml", "--what", what]);
        assert_eq!(svg.code, 0, "{}", svg.err);
        assert!(svg.out.starts_with("<svg") && svg.out.trim_end().ends_with("</svg>"));
        let dot = demo.run(&["graph", "deployment.yaml", "--what", what, "--format", "dot"]).out;
        assert!(dot.starts_with("digraph"));
        let mermaid = demo.run(&["graph", "deployment.yaml", "--what", what, "--format", "mermaid"]).out;
        assert!(mermaid.contains(if what == "coordinator" { "stateDiagram-v2" } else { "flowchart" }));
    }
    assert_eq!(demo.run(&["graph", "coordinator.lua", "-o", "picture.svg"]).code, 0);
    assert!(demo.read("picture.svg").contains("fast_mode"));
}

/// The names of what is written into a directory are the program's: what is there with another text is somebody's.
#[test]
fn converting_into_a_directory_writes_over_nothing() {
    let demo = Demo::new();
    let convert =
        |more: &[&str]| demo.run(&[&["convert", "deployment.yaml", "--to", "yaml", "-o", "out"][..], more].concat());
    assert_eq!(convert(&[]).code, 0, "nothing was there");
    assert_eq!(convert(&[]).code, 0, "the same texts");
    demo.write("out/configurations.yaml", "mine: 1\n");
    let refused = convert(&[]);
    assert!(refused.code == 2 && refused.err.contains("cli::overwrites"), "{}", refused.err);
    assert!(
        refused.err.contains("`configurations.yaml` is there") && refused.err.contains("--force"),
        "{}",
        refused.err
    );
    assert_eq!(demo.read("out/configurations.yaml"), "mine: 1\n");
    assert_eq!(convert(&["--force"]).code, 0);
    assert_ne!(demo.read("out/configurations.yaml"), "mine: 1\n");
    std::fs::remove_file(demo.path("out/configurations.yaml")).expect("it was there");
    std::os::unix::fs::symlink("/dev/full", demo.path("out/configurations.yaml")).expect("a link");
    let refused = convert(&["--force"]);
    assert!(refused.code == 2 && refused.err.contains("it is no file"), "{}", refused.err);
}

#[test]
fn converting_there_and_back_changes_nothing() {
    let demo = Demo::new();
    for file in ["configurations", "coordinator"] {
        let yaml = demo.run(&["convert", &format!("{file}.lua"), "--to", "yaml", "-o", &format!("{file}.yaml")]);
        assert_eq!(yaml.code, 0, "{}", yaml.err);
        let back = demo.run(&["convert", &format!("{file}.yaml"), "--to", "lua"]);
        let direct = demo.run(&["convert", &format!("{file}.lua"), "--to", "lua"]);
        assert_eq!(back.out, direct.out);
    }
    demo.replace("deployment.yaml", "configurations.lua", "configurations.yaml");
    demo.replace("deployment.yaml", "coordinator.lua", "coordinator.yaml");
    let ran = demo.run(&["check", "deployment.yaml"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
}

/// A transition that leads nowhere cannot be written in SCXML, and is no model in any language.
#[test]
fn a_chart_with_an_error_is_not_converted() {
    let demo = Demo::new();
    let chart = |second: &str| {
        format!(
            "coordinator:\n  states: {{ idle: {{}}, busy: {{}} }}\n  transitions:\n    - {{ src: initial, tgt: idle }}\n    - {{ {second} events: [e_go] }}\n"
        )
    };
    for (second, code) in [("src: idle, tgt: bsuy,", "chart::unknown_state"), ("src: idle,", "chart::missing_end")] {
        demo.write("chart.yaml", &chart(second));
        for args in [
            &["convert", "chart.yaml", "--to", "scxml"][..],
            &["convert", "chart.yaml", "--to", "lua"],
            &["graph", "chart.yaml", "--format", "scxml"],
        ] {
            let ran = demo.run(args);
            assert_eq!((ran.code, ran.out.as_str()), (1, ""), "{args:?}: {}", ran.err);
            assert!(ran.err.contains(code), "{args:?}: {}", ran.err);
        }
    }
    demo.write("chart.yaml", &chart("src: idle, tgt: busy,"));
    assert_eq!(demo.run(&["convert", "chart.yaml", "--to", "scxml"]).code, 0);
}

#[test]
fn types_are_listed_and_shown() {
    let demo = Demo::new();
    let list = demo.run(&["types", "deployment.yaml"]).out;
    assert!(list.contains("Source") && list.contains("Sink"), "{list}");
    let one = demo.run(&["types", "deployment.yaml", "Source"]).out;
    assert!(one.contains("0 … 10") && one.contains("reset(float)") && one.contains("irreversible"), "{one}");
    assert!(at_home(&["types"]).out.contains("youbot."));
    assert_eq!(
        at_home(&["types", "Gain"]).out,
        at_home(&["types", "standard.Gain"]).out,
        "its library need not be said"
    );
    let world = at_home(&["types", "World"]).out;
    assert!(world.contains("events\n") && world.contains("e_robot2_fell"), "{world}");
    let driver = at_home(&["types", "Driver", "--json"]).json();
    assert_eq!(driver["raises"]["e_OVERTEMP"], "A motor is too hot; the drives hold.");
    assert_eq!(driver["raises"]["e_EMERGENCY_STOP"], "Somebody pressed the emergency stop; the drives hold.");
    assert!(at_home(&["types", "Gian"]).err.contains("did you mean `standard.Gain`?"));
    let wrong = demo.run(&["types", "deployment.yaml", "Sorce", "--json"]);
    assert_eq!(wrong.code, 1);
    assert_eq!(wrong.json()["findings"][0]["code"], "cli::unknown_type");
    assert!(demo.run(&["types", "deployment.yaml", "--json"]).json().is_array());
}

/// The step that enters loses what stands in its set, as rFSM has it: that is told, but of what the way in looks at.
#[test]
fn sim_tells_of_events_that_are_lost_with_the_first_line() {
    let demo = Demo::new();
    let notes = |coordinator: &str, lines: &str| {
        demo.write("events.txt", lines);
        let ran = demo.run(&["sim", coordinator, "--events", "events.txt"]);
        assert_eq!(ran.code, 0, "{}", ran.err);
        ran.out.lines().filter(|line| line.contains("note: ")).map(str::to_owned).collect::<Vec<_>>()
    };
    let lost = notes("coordinator.lua", "e_start e_fast\nrun\n");
    assert!(lost.len() == 1 && lost[0].contains("`e_start`, `e_fast` are lost"), "{lost:?}");
    assert_eq!(notes("coordinator.lua", "\ne_start\n"), Vec::<String>::new());
    assert_eq!(notes("coordinator.lua", "run\ne_start\n"), Vec::<String>::new());
    let ways = "return state { a = state {}, b = state {},
        trans { src = 'initial', tgt = 'a', events = { 'e_a' } }, trans { src = 'initial', tgt = 'b', events = { 'e_b' } } }";
    demo.write("ways.lua", ways);
    assert_eq!(notes("ways.lua", "e_b\n"), Vec::<String>::new());
}

#[test]
fn sim_prints_an_object_for_every_line() {
    let demo = Demo::new();
    let mut child = demo
        .command(&["sim", "coordinator.lua", "--events", "-", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(b"\ne_start\ncreate_all.ok\nrun\n").unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[0]["active"], json!(["root", "root.idle"]));
    assert_eq!(lines[0]["actions"], json!(["entry root", "entry root.idle"]));
    assert_eq!(lines[1]["active"], json!(["root", "root.deploying", "root.deploying.creating"]));
    assert_eq!(
        lines[1]["actions"],
        json!(["exit root.idle", "entry root.deploying", "entry root.deploying.creating", "raise create_all"])
    );
    assert_eq!(lines[1]["transition"], true);
    let mut keys: Vec<&str> = lines[1].as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    assert_eq!(keys, ["actions", "active", "idle", "mode", "queue", "transition"]);
}

#[test]
fn a_model_that_init_rejects_is_status_1() {
    let demo = Demo::new();
    demo.write("bad.lua", "return state { a = state {}, trans { src = 'initial', tgt = 'nowhere' } }");
    let ran = demo.run(&["sim", "bad.lua", "--events", "/dev/null"]);
    assert_eq!(ran.code, 1, "{}", ran.err);
}

#[test]
fn a_reader_that_goes_away_is_no_panic() {
    let demo = Demo::new();
    for args in [
        vec!["explain"],
        vec!["completions", "bash"],
        vec!["plan", "deployment.yaml", "--bringup", "--json"],
        vec!["graph", "deployment.yaml"],
        vec!["--help"],
    ] {
        let mut child = demo.command(&args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let err = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!err.contains("panicked"), "{args:?}: {err}");
        assert_eq!(output.status.code(), Some(0), "{args:?}: {err}");
    }
}

#[test]
fn sim_runs_a_model_with_functions_and_what_stands_in_for_its_host() {
    let demo = Demo::new();
    demo.write(
        "model.lua",
        "local name = robot.name\nreturn rfsm.state { a = rfsm.state { entry = function(fsm, s) print(name, s._fqn) end },
           b = rfsm.state { doo = function() error('worn out', 0) end }, rfsm.trans { src = 'initial', tgt = 'a' },
           rfsm.trans { src = 'a', tgt = 'b', events = { 'e_go' }, guard = function(tr, events) return #events == 2 end } }",
    );
    demo.write("host.lua", "robot = { name = 'youBot' }");
    demo.write("events.txt", "run\ne_go\ne_go now\nrun\n");
    let missing = demo.run(&["sim", "model.lua", "--events", "events.txt"]);
    assert_eq!(missing.code, 1, "{}", missing.err);
    assert!(missing.err.contains("lua::host_missing") && missing.err.contains("`robot`"), "{}", missing.err);
    let ran = demo.run(&["sim", "model.lua", "--host", "host.lua", "--events", "events.txt", "--json"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    let lines: Vec<Value> = ran.out.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(lines[0]["active"], json!(["root", "root.a"]));
    assert_eq!(lines[1]["transition"], json!(false));
    assert_eq!(lines[2]["actions"], json!(["exit root.a", "entry root.b"]));
    assert_eq!(lines[3]["mode"], json!("done"), "the activity failed");
    assert!(ran.err.contains("note: youBot root.a"), "{}", ran.err);
    assert!(ran.err.contains("note: error: DOO doo program of state 'root.b' failed: worn out"), "{}", ran.err);
}

/// Functions are kept or told of, never lost in silence; what looks like a slip is told wherever a coordinator is read.
#[test]
fn functions_are_kept_or_told_of() {
    let demo = Demo::new();
    let chart = |fields: &str, transition: &str| {
        format!(
            "return rfsm.state {{ {fields} idle = rfsm.state {{}}, on = rfsm.state {{ doo = function() end }},
               rfsm.trans {{ src = 'initial', tgt = 'idle' }}, rfsm.trans {{ src = 'idle', tgt = 'on', events = {{ 'e_start' }}, {transition} }},
               rfsm.trans {{ src = 'on', tgt = 'idle', events = {{ 'e_stop' }} }} }}"
        )
    };
    demo.write("rich.lua", &chart("", "guard = function() return true end"));
    demo.write("slip.lua", &chart("", "gaurd = function() return true end"));
    demo.write("asks.lua", &chart("getevents = function() return {} end,", "").replace("doo = function() end", ""));
    demo.write("none.lua", "ConfiguratorConf {}");
    demo.write(
        "rich.yaml",
        "davit: 1
name: rich
platform: simulated
libraries: [standard]
configurations: [none.lua]
coordinator: rich.lua
trusted: true
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
",
    );
    let kept = demo.run(&["convert", "rich.yaml", "--to", "yaml"]);
    assert_eq!(kept.code, 0, "{}", kept.err);
    assert!(kept.out.contains("trusted: true") && kept.out.contains("-- coordinator.lua"), "{}", kept.out);
    assert!(kept.out.contains("guard = function()") && kept.err.contains("convert::functions"), "{}", kept.err);
    let refused = demo.run(&["convert", "rich.lua", "--to", "lua"]);
    assert_eq!((refused.code, refused.out.as_str()), (1, ""));
    assert!(refused.err.contains("`root.on`: `doo`"), "{}", refused.err);
    for args in [["convert", "rich.lua", "--to", "scxml"], ["graph", "rich.lua", "--format", "scxml"]] {
        let written = demo.run(&args);
        assert_eq!(written.code, 0, "{}", written.err);
        assert_eq!(written.err.matches("convert::left_out").count(), 2, "{}", written.err);
        assert!(written.out.contains("cond=\"guard_"), "{}", written.out);
    }
    for args in [["sim", "slip.lua", "--events", "none.lua"], ["graph", "slip.lua", "--format", "dot"]] {
        let told = demo.run(&args);
        assert!(
            told.err.contains("chart::slip") && told.err.contains("did you mean `guard`?"),
            "{args:?}: {}",
            told.err
        );
    }
    for format in ["mermaid", "dot", "svg", "plantuml"] {
        for file in ["asks.lua", "rich.lua"] {
            let drawn = demo.run(&["graph", file, "--format", format]).out;
            assert!(drawn.contains("(functions are not verified)"), "{file} as {format}: {drawn}");
        }
    }
}

/// Mermaid takes one label and no description of a state with states in it; Graphviz draws no edge from a box into itself; and of what stands in one block
/// behind something that cannot be sent an SCXML interpreter does nothing more.
#[test]
fn what_others_draw_and_run_is_as_they_want_it() {
    let demo = Demo::new();
    demo.write(
        "own.yaml",
        "coordinator:
  states: { off: {}, on: { entry: go, states: { a: { entry: build }, halted: {} }, transitions: [{ src: initial, tgt: a }] } }
  transitions: [{ src: initial, tgt: off }, { src: off, tgt: on, events: [e_on] }, { src: on, tgt: on, events: [e_again] }, { src: on, tgt: .on.halted, events: [e_stop] }]
",
    );
    let graph = |format| demo.run(&["graph", "own.yaml", "--what", "coordinator", "--format", format]).out;
    let mermaid = graph("mermaid");
    assert!(mermaid.contains("state \"on<br/>entry / go\" as n2\n  state n2 {"), "{mermaid}");
    assert!(mermaid.lines().all(|line| !line.trim().starts_with("n2 : ")), "{mermaid}");
    let dot = graph("dot");
    // Neither end of an edge is in the box that the other end stands for.
    let boxed = dot.lines().filter(|line| line.contains("cluster_2") && line.contains("->"));
    assert!(
        boxed.clone().count() > 2 && boxed.clone().all(|line| !(line.contains("n5 ") && line.contains("ltail"))),
        "{dot}"
    );
    assert!(
        boxed.filter(|line| line.contains("e_stop") || line.contains("e_again")).all(|line| line.contains("-> b")),
        "{dot}"
    );
    let scxml = graph("scxml");
    let of_a = &scxml[scxml.find("id=\"root.on.a\"").expect("the state")..];
    let blocks: Vec<&str> =
        of_a.split("<onentry>").skip(1).take(2).map(|block| block.split("</onentry>").next().unwrap()).collect();
    assert!(blocks[0].contains("<raise ") && !blocks[0].contains("<send ") && blocks[1].contains("build"), "{of_a}");
}
