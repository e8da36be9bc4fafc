//! Several coordinators: who is blamed, and what is said of them together.

use crate::support::Small;

fn holder(name: &str, also: &str) -> String {
    format!(
        "idle = state {{}}, up = state {{ config = \"{name}_base\", low = state {{}}, high = state {{ config = \"{name}_high\" }},
           trans {{ src = \"initial\", tgt = \"low\" }},
           trans {{ src = \"low\", tgt = \"high\", events = {{ \"e_{name}_up\" }} }},
           trans {{ src = \"high\", tgt = \"low\", events = {{ \"e_{name}_down\" }} }},
         }},
         trans {{ src = \"initial\", tgt = \"idle\" }},
         trans {{ src = \"idle\", tgt = \"up\", events = {{ \"e_start\" }} }},
         trans {{ src = \"up\", tgt = \"idle\", events = {{ \"e_shutdown\"{also} }} }},"
    )
}

/// The gripper's `high` touches the arm's drive; the lamp has nothing to do with either.
#[test]
fn a_refusal_is_blamed_on_those_who_share_a_component() {
    let own = |name: &str, of: &str| {
        format!(
            "{name}_base = Configuration {{ create(\"{name}Drive\", \"Drive\"), post_conf_state = {{ \"{name}Drive:running\" }} }},
             {name}_high = Configuration {{ property_set(\"{of}Drive.gain\", 5.0) }},"
        )
    };
    // The lamp emits something that the others hear, so that it is followed with them.
    let lamp = holder("lamp", "").replace("idle = state {}", "idle = state { entry = \"e_lamp\" }");
    let said = Small::several(
        &format!("{}{}{}", own("arm", "arm"), own("gripper", "arm"), own("lamp", "lamp")),
        &[("arm", &holder("arm", ", \"e_lamp\"")), ("gripper", &holder("gripper", ", \"e_lamp\"")), ("lamp", &lamp)],
        "emits: [e_lamp]\n",
    )
    .check();
    let found = said.of("coord::refused_by_other");
    assert!(!found.is_empty(), "{:#}", said.0);
    for finding in found {
        let message = finding["message"].as_str().unwrap();
        assert!(!message.contains("`lamp`"), "{message}");
        assert!(!finding["trace"].as_array().unwrap().is_empty());
    }
}

/// Batches of two coordinators are under way at the same time: each may end first.
#[test]
fn every_order_of_endings_is_followed() {
    let other = |name: &str| {
        format!(
            "idle = state {{}}, up = state {{ entry = \"{name}\" }}, done = state {{ entry = \"e_{name}\" }}, leaving = state {{ entry = \"{name}.undo\" }},
             trans {{ src = \"initial\", tgt = \"idle\" }},
             trans {{ src = \"idle\", tgt = \"up\", events = {{ \"e_start\" }} }},
             trans {{ src = \"up\", tgt = \"done\", events = {{ \"{name}.ok\" }} }},
             trans {{ src = \"done\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"up\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
             trans {{ src = \"leaving\", tgt = \"idle\", events = {{ \"{name}.undone\", \"e_shutdown\" }} }},"
        )
    };
    // The second one asks for something that is wrong when the first one is ready before it.
    let second = other("two")
        + "late = state { entry = \"wrong\" }, trans { src = \"up\", tgt = \"late\", events = { \"e_one\" } },
           trans { src = \"late\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let said = Small::several(
        "one = Configuration { create(\"a\", \"Drive\") }, two = Configuration { create(\"b\", \"Drive\") },
         wrong = Configuration { destroy(\"nothing\"), create(\"nothing\", \"Drive\") },",
        &[("first", &other("one")), ("second", &second)],
        "emits: [e_one, e_two]\n",
    )
    .check();
    assert!(!said.refused("wrong").is_empty(), "{:#}", said.0);
}

/// `plan --bringup` and `--shutdown` show what all of them ask for.
#[test]
fn all_coordinators_are_driven_together() {
    let own = |name: &str| {
        format!(
            "{name}_base = Configuration {{ create(\"{name}Drive\", \"Drive\") }}, {name}_high = Configuration {{ property_set(\"{name}Drive.gain\", 5.0) }},"
        )
    };
    let small = Small::several(
        &format!("{}{}", own("arm"), own("gripper")),
        &[("arm", &holder("arm", "")), ("gripper", &holder("gripper", ""))],
        "",
    );
    for (way, requests) in
        [("--bringup", ["arm_base", "gripper_base"]), ("--shutdown", ["arm_base.undo", "gripper_base.undo"])]
    {
        let json = small.demo.run(&["plan", "small.yaml", way, "--json"]).json();
        let asked = json.to_string();
        for request in requests {
            assert!(asked.contains(request), "{way}: {request}: {json:#}");
        }
    }
}
