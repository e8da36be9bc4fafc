//! Who hears that a request failed: `check` warns of those that nobody hears, and of no other.

use crate::demo::Demo;

/// What `check` says of the failure of `rename`, after these replacements in the coordinator.
fn warned(replacements: &[(&str, &str)]) -> bool {
    let demo = Demo::new();
    for (from, to) in replacements {
        demo.replace("coordinator.lua", from, to);
    }
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let findings = json["findings"].as_array().unwrap();
    // Where it is asked for it is refused, for there is no source yet; that does not matter here. The texts do.
    let of_text = |f: &serde_json::Value| {
        ["text", "lua", "chart"].contains(&f["code"].as_str().unwrap().split(':').next().unwrap())
    };
    assert!(!findings.iter().any(|f| f["severity"] == "error" && of_text(f)), "{json:#}");
    let of_rename = |f: &serde_json::Value| f["message"].as_str().unwrap().contains("rename.failed");
    findings.iter().any(|f| f["code"] == "coord::failure_unhandled" && f["severity"] == "warning" && of_rename(f))
}

const EFFECT: (&str, &str) = (
    "trans { src = \"idle\", tgt = \"deploying\", events = { \"e_start\" } }",
    "trans { src = \"idle\", tgt = \"deploying\", events = { \"e_start\" }, effect = \"rename\" }",
);

const INNER: (&str, &str) = ("events = { \"e_fast\", ", "effect = \"rename\", events = { \"e_fast\", ");

const DEPLOYING: &str = "events = { \"create_all.failed\", ";

#[test]
fn what_an_effect_asks_for_needs_an_ear() {
    assert!(!warned(&[]), "the demo does not ask for it");
    assert!(warned(&[EFFECT]));
    assert!(!warned(&[
        EFFECT,
        (DEPLOYING, "events = { \"rename.failed\", \"rename.broken\", \"create_all.failed\", ")
    ]));
}

#[test]
fn an_ear_outside_of_what_stays_active_hears_nothing() {
    // Asked for on the way between two states of `operational`, which is not left by it.
    assert!(warned(&[INNER]));
    let elsewhere = (DEPLOYING, "events = { \"rename.failed\", \"rename.broken\", \"create_all.failed\", ");
    assert!(warned(&[INNER, elsewhere]), "answers are for those who are in `operational`");
    let here = ("\"slow.failed\", ", "\"slow.failed\", \"rename.failed\", ");
    assert!(!warned(&[INNER, here]));
    let around = (
        "trans { src = \"operational\", tgt = \"leaving\", events = { \"e_shutdown\" } }",
        "trans { src = \"operational\", tgt = \"leaving\", events = { \"e_shutdown\", \"rename.failed\" } }",
    );
    assert!(!warned(&[INNER, around]));
}

#[test]
fn a_connector_hears_what_leads_through_it() {
    let junction = |onward: &str| {
        let more = format!(
            "trans {{ src = \"deploying\", tgt = \"junction\", events = {{ \"rename.failed\" }} }},\n  \
             trans {{ src = \"junction\", tgt = \"failed\"{onward} }},\n  trans {{ src = \"failed\", tgt = \"leaving\""
        );
        let add = ("idle = state {},\n  deploying", "idle = state {}, junction = conn {},\n  deploying");
        warned(&[EFFECT, ("trans { src = \"failed\", tgt = \"leaving\"", &more), add])
    };
    assert!(!junction(""));
    assert!(!junction(", events = { \"rename.failed\" }"));
    assert!(junction(", events = { \"e_else\" }"), "the junction is a dead end for it");
}

/// The way into a composite state wants no event, and is taken long before any answer.
#[test]
fn an_initial_transition_is_no_ear() {
    assert!(warned(&[("deploying = state {\n", "deploying = state { entry = \"rename\",\n")]));
}
