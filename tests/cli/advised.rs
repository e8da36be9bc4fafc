//! Advice that leads on when it is followed: what somebody meant who wrote something else.

use crate::demo::{Demo, Ran, at_home};
use serde_json::Value as Json;

fn says(ran: &Ran, code: i32, told: &[&str]) {
    let (all, flat) = (format!("{}{}", ran.out, ran.err), |text: &str| text.replace(['\n', '│'], " "));
    let words: Vec<String> = flat(&all).split_whitespace().map(str::to_owned).collect();
    let all = words.join(" ");
    let missing: Vec<_> = told.iter().filter(|told| !all.contains(*told)).collect();
    assert!(ran.code == code && missing.is_empty(), "{}: {missing:?} in {all}", ran.code);
}

fn copied(folder: &str, files: &[&str]) -> Demo {
    let demo = Demo::new();
    for file in files {
        let text = std::fs::read_to_string(format!("{}/examples/{folder}/{file}", env!("CARGO_MANIFEST_DIR")));
        demo.write(file, &text.unwrap());
    }
    demo
}

fn pair() -> Demo {
    let all = [
        "pair.yaml",
        "pair_configurations.lua",
        "pair_coordinator.lua",
        "robot.yaml",
        "robot_configurations.lua",
        "robot_coordinator.lua",
    ];
    copied("pair", &all)
}

fn conveyor() -> Demo {
    copied("conveyor", &["conveyor.yaml", "configurations.yaml", "coordinator.yaml"])
}

#[test]
fn of_a_type_with_a_length_the_length_stays() {
    let demo = conveyor();
    demo.replace("conveyor.yaml", "type: float, unit: m/s", "type: \"flaot[3]\"");
    says(&demo.run(&["check", "conveyor.yaml"]), 1, &["`flaot[3]` is not a type", "did you mean `float[3]`?"]);
}

#[test]
fn what_creates_a_subsystems_component_is_named_where_it_is_planned_without() {
    let demo = pair();
    says(
        &demo.run(&["plan", "pair.yaml", "join"]),
        1,
        &["name what creates it before, as in `left/make right/make join`"],
    );
    assert_eq!(demo.run(&["plan", "pair.yaml", "left/make", "right/make", "join"]).code, 0);
}

#[test]
fn a_file_that_is_not_there_is_not_the_one_that_names_it() {
    let demo = pair();
    demo.replace("pair.yaml", "left:  { deployment: robot.yaml", "left:  { deployment: pairs.yaml");
    let ran = demo.run(&["check", "pair.yaml"]);
    assert!(
        ran.err.contains("there is no file pairs.yaml") && !ran.err.contains("did you mean `pair.yaml`"),
        "{}",
        ran.err
    );
}

#[test]
fn a_file_sees_nothing_beside_it() {
    let demo = pair();
    demo.replace(
        "robot_configurations.lua",
        "run = Configuration { ",
        "run = Configuration { port_write(\"right/Drive.u\", 1.0), ",
    );
    says(
        &demo.run(&["check", "robot.yaml"]),
        1,
        &["no configuration creates a component `right/Drive`", "comes by an in-port of it"],
    );
}

#[test]
fn a_picture_without_coordinators_has_no_coordinator_to_choose() {
    let ran = at_home(&["graph", "examples/pair/pair.yaml", "--of", "laed"]);
    says(&ran, 2, &["`--of laed` is one of the coordinators, and none are drawn", "add `--what coordinator`"]);
}

#[test]
fn a_finding_that_there_is_not() {
    says(
        &at_home(&["check", "examples/pair/pair.yaml", "--trace", "99"]),
        2,
        &["there is no finding 99", "davit::cli::no_finding"],
    );
    let demo = conveyor();
    demo.replace("coordinator.yaml", "events: [e_end] }", "events: [e_ned] }");
    let ran = demo.run(&["check", "conveyor.yaml", "--trace", "1", "--as", "nowhere/way.lua"]);
    says(&ran, 2, &["davit::cli::unwritable", "name a file in a directory that exists"]);
}

/// A script that is taken for a coordinator, and texts that begin with the mark of their encoding.
#[test]
fn other_texts() {
    let demo = Demo::new();
    demo.write("story.lua", "deploy(\"x.yaml\")\n");
    says(&demo.run(&["sim", "story.lua"]), 1, &["`deploy` is of scripts", "`davit run` runs a script"]);
    demo.write("say.lua", "\u{feff}#!/usr/bin/env davit\nsay(\"hello\")\n");
    assert_eq!(demo.run(&["run", "say.lua", "--clock", "simulated"]).out, "hello\n");
    demo.write("c.lua", "\u{feff}return state { idle = state {}, trans { src = \"initial\", tgt = \"idle\" } }\n");
    assert_eq!(demo.run(&["graph", "c.lua"]).code, 0);
}

/// What a type raises and nobody listens to is no mistake, but where a near name is what somebody waits for.
#[test]
fn a_typo_of_what_a_type_raises() {
    let unheard = |raises: &str| {
        let demo = conveyor();
        demo.replace("conveyor.yaml", "    moves: [start]", &format!("    moves: [start]\n    raises: [{raises}]"));
        let checked = demo.run(&["check", "conveyor.yaml", "--json"]).json();
        let found = checked["findings"].as_array().unwrap().iter().filter(|one| one["code"] == "conf::event_unheard");
        found.map(|one: &Json| one["help"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(unheard("e_rezet"), ["did you mean `e_reset`?"]);
    assert_eq!(unheard("e_jammed"), [""; 0]);
    assert_eq!(unheard("e_reset"), [""; 0]);
}
