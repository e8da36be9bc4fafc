//! Several coordinators in what is planned and drawn: all of them, each by its name.

use crate::demo::at_home;
use serde_json::Value;

const FILE: &str = "examples/side_by_side/deployment.yaml";

/// Who asks for what, and the system at the end.
fn planned(more: &[&str]) -> (Vec<(String, String)>, Value) {
    let args: Vec<&str> = ["plan", FILE, "--json"].iter().chain(more).copied().collect();
    let ran = at_home(&args);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    let plans = ran.json();
    let plans = plans.as_array().expect("an array");
    let word = |plan: &Value, key: &str| plan[key].as_str().unwrap_or_default().to_owned();
    let asks = |plan: &Value| {
        plan["requests"].as_array().unwrap().iter().map(|r| r.as_str().unwrap()).collect::<Vec<_>>().join(" ")
    };
    let all = plans.iter().map(|plan| (word(plan, "coordinator"), asks(plan))).collect();
    (all, plans.last().expect("something is asked for")["result"].clone())
}

#[test]
fn the_bringup_is_that_of_all_and_what_plan_shows_without_names() {
    let (asked, system) = planned(&[]);
    for name in ["arm", "gripper"] {
        assert!(asked.iter().any(|(by, _)| by == name), "{name}: {asked:?}");
    }
    assert_eq!(system["components"].as_object().unwrap().len(), 2, "{system}");
    assert_eq!(planned(&["--bringup"]), (asked.clone(), system));
    let text = at_home(&["plan", FILE]).out;
    for (by, ask) in &asked {
        assert!(text.contains(&format!("{by}: {ask}")), "{text}");
    }
    assert!(text.contains("-- gripper: e_start") && text.contains("2 components"), "{text}");
}

#[test]
fn the_shutdown_is_that_of_all_and_leaves_nothing() {
    let (asked, system) = planned(&["--shutdown"]);
    for name in ["arm", "gripper"] {
        assert!(asked.iter().any(|(by, _)| by == name), "{name}: {asked:?}");
    }
    assert_eq!(system, serde_json::json!({ "components": {}, "connections": [], "ports": {} }));
}

#[test]
fn pictures_show_all_or_the_one_that_is_named() {
    let graph = |more: &[&str]| {
        let args: Vec<&str> = ["graph", FILE].iter().chain(more).copied().collect();
        at_home(&args)
    };
    for format in ["svg", "dot", "mermaid"] {
        let both = graph(&["--what", "coordinator", "--format", format]);
        assert_eq!(both.code, 0, "{}", both.err);
        let arm = graph(&["--what", "coordinator", "--format", format, "--of", "arm"]);
        assert!(both.out.contains("gripper") && both.out.contains("arm"), "{format}: {}", both.out);
        assert!(both.out.contains("closing") && !arm.out.contains("closing"), "{format}: {}", arm.out);
        let plan = graph(&["--what", "plan", "--format", format]).out;
        assert!(plan.contains("arm") && plan.contains("gripper"), "{format}: {plan}");
        let components = graph(&["--format", format]).out;
        assert!(components.contains("Joints") && components.contains("Fingers"), "{format}: {components}");
    }
    let one = graph(&["--what", "coordinator", "--format", "plantuml"]);
    assert!(one.code == 2 && one.err.contains("arm, gripper"), "{}", one.err);
    assert_eq!(graph(&["--what", "coordinator", "--format", "plantuml", "--of", "gripper"]).code, 0);
    let typo = graph(&["--what", "coordinator", "--of", "griper"]);
    assert!(typo.code == 2 && typo.err.contains("`gripper`"), "{}", typo.err);
}

#[test]
fn every_shipped_deployment_is_planned_up_and_down() {
    let mut files: Vec<String> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/deployments"))
        .expect("shipped deployments")
        .map(|entry| format!("deployments/{}", entry.unwrap().file_name().to_string_lossy()))
        .filter(|name| name.ends_with(".yaml"))
        .collect();
    files.sort();
    assert!(files.len() >= 4, "{files:?}");
    for file in files {
        let (up, named) = (at_home(&["plan", &file, "--json"]), at_home(&["plan", &file, "--bringup", "--json"]));
        assert_eq!((up.code, &up.out), (0, &named.out), "{file}: {}", up.err);
        let down = at_home(&["plan", &file, "--shutdown", "--json"]);
        assert_eq!(down.code, 0, "{file}: {}", down.err);
        let last = down.json().as_array().and_then(|plans| plans.last().cloned()).expect("something is undone");
        assert_eq!(last["result"]["components"], serde_json::json!({}), "{file}");
    }
}
