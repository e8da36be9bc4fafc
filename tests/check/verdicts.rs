//! What a check comes to, and with which exit status.

use crate::demo::Demo;
use crate::support::Small;

const UP_AND_DOWN: &str = "idle = state {}, up = state { entry = \"base\" }, leaving = state { entry = \"base.undo\" },
    trans { src = \"initial\", tgt = \"idle\" },
    trans { src = \"idle\", tgt = \"up\", events = { \"e_start\" } },
    trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\", \"base.failed\", \"base.broken\" } },
    trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
    trans { src = \"leaving\", tgt = \"leaving\", events = { \"e_shutdown\", \"base.undo.failed\", \"base.undo.broken\" } },";

const CONFIGURATIONS: &str = "base = Configuration { create(\"a\", \"Drive\") },";

fn verdict(small: &Small) -> (String, i32, i32, String) {
    let json = small.demo.run(&["check", "small.yaml", "--json"]);
    let strict = small.demo.run(&["check", "small.yaml", "--strict"]);
    let verdict = json.json()["verdict"].as_str().unwrap().to_owned();
    (verdict, json.code, strict.code, strict.out)
}

#[test]
fn sound_is_said_only_of_what_is_sound() {
    let sound = Small::new(
        CONFIGURATIONS,
        &UP_AND_DOWN.replace("\"e_shutdown\", \"base.undo.failed\"", "\"base.undo.failed\""),
        "",
    );
    let (word, code, strict, text) = verdict(&sound);
    assert_eq!((word.as_str(), code, strict), ("sound", 0, 0), "{text}");
    assert!(text.starts_with("small: sound;"), "{text}");
    // A warning.
    let warned = Small::new(CONFIGURATIONS, &UP_AND_DOWN.replace(", \"base.failed\", \"base.broken\"", ""), "");
    let (word, code, strict, text) = verdict(&warned);
    assert_eq!((word.as_str(), code, strict), ("warnings", 0, 1), "{text}");
    assert!(text.contains("has warnings") && !text.contains("sound"), "{text}");
    // An error.
    let refused =
        Small::new(&format!("{CONFIGURATIONS} base2 = Configuration {{ destroy(\"nobody\") }},"), UP_AND_DOWN, "");
    let (word, code, strict, _) = verdict(&refused);
    assert_eq!((word.as_str(), code, strict), ("refused", 1, 1));
}

/// Each event makes it ask for more than is answered meanwhile: nothing is found as far as that is followed.
#[test]
fn a_bound_that_cuts_something_off_is_told() {
    let states = UP_AND_DOWN.replace("\"e_shutdown\", \"base.undo.failed\"", "\"base.undo.failed\"")
        + "more = state { entry = \"set\" }, trans { src = \"up\", tgt = \"more\", events = { \"e_more\" } },
           trans { src = \"more\", tgt = \"more\", events = { \"e_more\" } },
           trans { src = \"more\", tgt = \"leaving\", events = { \"base.failed\", \"base.broken\", \"set.failed\", \"set.broken\", \"e_shutdown\" } },";
    // It stands in nobody's way and cannot fail.
    let configurations = format!("{CONFIGURATIONS} set = Configuration {{ group = \"g\", description = \"rest\" }},");
    let small = Small::new(&configurations, &states, "");
    let json = small.demo.run(&["check", "small.yaml", "--json"]).json();
    assert_eq!(json["explored"]["complete"], false, "{json:#}");
    let left: Vec<&str> = json["left"].as_array().unwrap().iter().map(|left| left.as_str().unwrap()).collect();
    assert!(left.iter().any(|left| left.contains("wait at once")), "{left:?}");
    let (word, code, strict, text) = verdict(&small);
    assert_eq!((word.as_str(), code, strict), ("followed", 0, 1), "{json:#}");
    assert!(text.starts_with("small: sound as far as followed;") && text.contains("wait at once"), "{text}");
}

/// Every finding that is met on a way has one, from the start.
#[test]
fn each_finding_has_its_own_way() {
    let demo = Demo::new();
    demo.replace("coordinator.lua", "config = \"slow\"", "entry = { \"slow\", \"create_all\" }");
    let json = demo.run(&["check", "deployment.yaml", "--json"]).json();
    let mut ways = Vec::new();
    for finding in json["findings"].as_array().unwrap() {
        let trace = finding["trace"].as_array().unwrap();
        if finding["code"] == "coord::request_refused" {
            assert_eq!(trace[0]["what"], "start", "{finding:#}");
            assert!(trace.len() > 3 && trace.iter().all(|step| !step["states"].as_array().unwrap().is_empty()));
            ways.push(trace.clone());
        }
    }
    assert!(!ways.is_empty(), "{json:#}");
}

/// Each time round an undo fails and leaves a frame more: that is followed only so far, and told.
#[test]
fn frames_that_failed_undoings_leave_are_followed_only_so_far() {
    let configurations = format!(
        "{CONFIGURATIONS} one = Configuration {{ property_set(\"a.gain\", 2.0) }}, two = Configuration {{ property_set(\"a.gain\", 3.0) }},"
    );
    let states =
        "idle = state {}, building = state { entry = \"base\" }, up = state {}, on = state { config = \"one\" },
        far = state { config = \"two\" },
        trans { src = \"on\", tgt = \"far\", events = { \"e_far\" } },
        trans { src = \"far\", tgt = \"on\", events = { \"e_near\" } },
        trans { src = \"far\", tgt = \"up\", events = { \"e_off\", \"two.failed\", \"two.broken\" } },
        trans { src = \"far\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        leaving = state { entry = \"base.undo\" }, stuck = state {},
        trans { src = \"initial\", tgt = \"idle\" },
        trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
        trans { src = \"building\", tgt = \"up\", events = { \"base.ok\" } },
        trans { src = \"building\", tgt = \"leaving\", events = { \"base.failed\", \"base.broken\", \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"on\", events = { \"e_on\" } },
        trans { src = \"on\", tgt = \"up\", events = { \"e_off\", \"one.failed\", \"one.broken\" } },
        trans { src = \"on\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
        trans { src = \"leaving\", tgt = \"idle\", events = { \"base.undone\" } },
        trans { src = \"leaving\", tgt = \"stuck\", events = { \"base.undo.failed\", \"base.undo.broken\" } },
        trans { src = \"stuck\", tgt = \"leaving\", events = { \"e_shutdown\" } },";
    let small = Small::new(&configurations, states, "");
    let json = small.demo.run(&["check", "small.yaml", "--json"]).json();
    let left: Vec<&str> = json["left"].as_array().unwrap().iter().map(|left| left.as_str().unwrap()).collect();
    let told =
        |line: &&str| line.starts_with("more than 2 frames of one configuration were not followed, behind an undo");
    assert!(left.iter().any(told), "{left:?}");
    assert_eq!(json["explored"]["complete"], false, "{left:?}");
}

/// An operator may apply a safe configuration at any time, and that is followed. What it is in the way of is the operator's to
/// deal with: a note.
#[test]
fn what_an_operators_safe_configuration_leads_to_is_followed() {
    let configurations = "base = Configuration { create(\"a\", \"Drive\"), post_conf_state = { \"a:running\" } },
        stop = Configuration { safe = true, post_conf_state = { \"a:stopped\" } },";
    let states = UP_AND_DOWN.replace("\"e_shutdown\", \"base.undo.failed\"", "\"base.undo.failed\"");
    let small = Small::new(configurations, &states, "");
    let (word, code, strict, text) = verdict(&small);
    assert_eq!((word.as_str(), code, strict), ("sound", 0, 0), "{text}");
    let said = small.check();
    let notes = said.of("coord::refused_by_other");
    let [note] = notes[..] else { panic!("{:#}", said.0) };
    assert_eq!(note["severity"], "info");
    assert!(note["message"].as_str().unwrap().contains("before `stop` (a frame of operator)"), "{note:#}");
    assert_eq!(note["help"], "let the operator undo that first (`davit undo`)", "{note:#}");
    let script = "deploy('small.yaml') apply('stop') shutdown()";
    small.demo.write("forced.lua", script);
    let ran = small.demo.run(&["run", "forced.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert!(ran.out.contains("base.undo.failed"), "{}{}", ran.out, ran.err);
}

/// Two coordinators that have nothing to do with each other make the same mistake: each is told of its own.
#[test]
fn findings_with_equal_words_at_two_places_are_two() {
    let coordinator = |base: &str| {
        UP_AND_DOWN.replace("base", base).replace("\"e_shutdown\", \"", "\"")
            + "lost = state {}, trans { src = \"up\", tgt = \"lost\", events = { \"e_lost\" } },"
            + "trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },"
    };
    let configurations =
        "one = Configuration { create(\"a\", \"Drive\") }, two = Configuration { create(\"b\", \"Drive\") },";
    let small = Small::several(configurations, &[("first", &coordinator("one")), ("second", &coordinator("two"))], "");
    let said = small.check();
    let stuck = said.of("coord::stuck");
    let places: Vec<_> = stuck.iter().map(|f| (f["file"].as_str(), f["message"].as_str())).collect();
    let message = Some("nothing leads on from `root.lost`");
    assert_eq!(places, [(Some("first.lua"), message), (Some("second.lua"), message)], "{:#}", said.0);
}

/// What was cut off may lead down; where all was followed and nothing does, that is told all the same.
#[test]
fn a_bound_hides_no_place_that_no_way_leads_down_from() {
    let configurations = format!("{CONFIGURATIONS} set = Configuration {{ group = \"g\", description = \"rest\" }},");
    let spins = UP_AND_DOWN.to_owned()
        + "spins = state { entry = \"set\" }, trans { src = \"up\", tgt = \"spins\", events = { \"e_spin\" } },
           trans { src = \"spins\", tgt = \"spins\", events = { \"e_done\" } },";
    let here = "here = state {}, there = state {}, trans { src = \"up\", tgt = \"here\", events = { \"e_here\" } },
        trans { src = \"here\", tgt = \"there\", events = { \"e_there\" } },
        trans { src = \"there\", tgt = \"here\", events = { \"e_here\" } },";
    let said = Small::new(&configurations, &spins, "").check();
    assert_eq!(said.0["explored"]["complete"], false, "{:#}", said.0);
    assert!(said.of("coord::no_way_down").is_empty(), "{:#}", said.0);
    let said = Small::new(&configurations, &(spins + here), "").check();
    assert_eq!(said.0["explored"]["complete"], false, "{:#}", said.0);
    let messages: Vec<_> = said.of("coord::no_way_down").iter().map(|found| found["message"].clone()).collect();
    assert_eq!(messages, ["from `root.here` no way leads to `idle`"], "{:#}", said.0);
}
