//! A deployment that is a part of something larger, by itself.

use crate::demo::{Demo, at_home};
use serde_json::Value;

/// A file that exports what its components cannot do without is a part: it is checked, planned and imitated, and refused where they would run.
#[test]
fn a_part_of_something_larger_is_not_deployed_alone() {
    const PART: &str = "deployments/youbot_robot.yaml";
    let checked = at_home(&["check", PART, "--json"]);
    assert_eq!(checked.code, 0, "{}{}", checked.out, checked.err);
    let findings = checked.json()["findings"].as_array().unwrap().clone();
    let told: Vec<&Value> = findings.iter().filter(|finding| finding["code"] == "deploy::part").collect();
    assert!(told.len() == 1 && told[0]["severity"] == "info", "{findings:#?}");
    let whole = at_home(&["check", "deployments/youbot_coupling.yaml", "--json"]).json();
    assert!(!whole["findings"].to_string().contains("deploy::part"), "it is where it belongs");
    // And of the whole everything was followed that the budget has room for: what is behind an undo that failed, and whether one event
    // leads all coordinators down.
    let left: Vec<&str> = whole["left"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    for unknown in ["--budget", "before it was answered", "leads all coordinators down"] {
        assert!(!left.is_empty() && !left.iter().any(|line| line.contains(unknown)), "{left:#?}");
    }

    let demo = Demo::new();
    let path = format!("{}/{PART}", env!("CARGO_MANIFEST_DIR"));
    let refused = demo.run(&["deploy", &path, "--clock", "simulated"]);
    assert!(refused.code == 1 && refused.err.contains("deploy::part"), "{}: {}", refused.code, refused.err);
    demo.write("story.lua", &format!("deploy({path:?}) shutdown()"));
    let refused = demo.run(&["run", "story.lua", "--clock", "simulated"]);
    assert!(refused.code == 1 && refused.err.contains("part of something larger"), "{}: {}", refused.code, refused.err);
    let imitated = demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert_eq!(imitated.code, 0, "{}{}", imitated.out, imitated.err);
}

/// A robot that cannot be placed in the world of the coupling fails the bring-up at once, with the reason, and all of it is taken down.
#[test]
fn a_part_that_cannot_be_placed_fails_the_bring_up() {
    let demo = Demo::new();
    let path = format!("{}/deployments/youbot_coupling.yaml", env!("CARGO_MANIFEST_DIR"));
    demo.write(
        "story.lua",
        &format!(
            "fault('connect left/Link_Tx.tx', 'fail', 1)
             local up, why = pcall(deploy, {path:?})
             say('up: ' .. tostring(up) .. ' ' .. tostring(why) .. ' at ' .. now())"
        ),
    );
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated"]);
    let said = ran.out.split_once("up: ").map(|(_, said)| said).unwrap_or_default();
    assert!(said.starts_with("false") && said.contains("place_left.failed"), "{}: {}{}", ran.code, ran.out, ran.err);
    let at: f64 = said.rsplit(" at ").next().and_then(|at| at.split_whitespace().next()?.parse().ok()).expect("when");
    assert!(at < 5.0, "{at}");
}
