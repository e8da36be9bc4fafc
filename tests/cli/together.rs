//! Coordinators side by side, followed together by `check`.

use crate::demo::Demo;
use serde_json::Value;

const DEPLOYMENT: &str = "davit: 1
name: two
platform: simulated
types:
  Drive:
    ports: { out: { direction: out, type: float } }
    properties: { gain: { type: float, default: 1.0 } }
configurations: [conf.lua]
";

/// A state holds a configuration as long as it is active.
fn holder(name: &str) -> String {
    format!(
        "return state {{
          idle = state {{}}, fault = state {{}},
          on = state {{ config = \"{name}_base\", low = state {{}}, high = state {{ config = \"{name}_high\" }},
            trans {{ src = \"initial\", tgt = \"low\" }},
            trans {{ src = \"low\", tgt = \"high\", events = {{ \"e_{name}_up\" }} }},
            trans {{ src = \"high\", tgt = \"low\", events = {{ \"e_{name}_down\", \"{name}_high.failed\", \"{name}_high.broken\" }} }},
          }},
          trans {{ src = \"initial\", tgt = \"idle\" }},
          trans {{ src = \"idle\", tgt = \"on\", events = {{ \"e_start\" }} }},
          trans {{ src = \"on\", tgt = \"fault\", events = {{ \"{name}_base.failed\", \"{name}_base.broken\" }} }},
          trans {{ src = \"fault\", tgt = \"idle\", events = {{ \"e_shutdown\" }} }},
          trans {{ src = \"on\", tgt = \"idle\", events = {{ \"e_shutdown\", \"e_{name}_off\" }} }},
        }}"
    )
}

/// `check` of holders with these names; `gain` is whose drive the `high` of each sets.
fn holders(names: &[&str], gain: impl Fn(&str) -> String) -> (Value, String) {
    let demo = Demo::new();
    let listed: Vec<String> = names.iter().map(|name| format!("{name}: {name}.lua")).collect();
    let down: Vec<String> = names.iter().map(|name| format!("{name}:idle")).collect();
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinators: {{ {} }}
deploy: {{ event: e_start, up: on, failed: [fault], within_s: 5 }}
shutdown: {{ event: e_shutdown, down: [{}], within_s: 5 }}\n",
            listed.join(", "),
            down.join(", ")
        ),
    );
    let mut conf = String::new();
    for name in names {
        demo.write(&format!("{name}.lua"), &holder(name));
        conf += &format!(
            "{name}_base = Configuration {{ create(\"{name}Drive\", \"Drive\"), post_conf_state = {{ \"{name}Drive:running\" }} }},
             {name}_high = Configuration {{ property_set(\"{}Drive.gain\", 5.0) }},\n",
            gain(name)
        );
    }
    demo.write("conf.lua", &format!("ConfiguratorConf {{ {conf} }}"));
    let text = demo.run(&["check", "two.yaml"]);
    (demo.run(&["check", "two.yaml", "--json"]).json(), text.out)
}

fn of_code<'a>(json: &'a Value, code: &str) -> Vec<&'a Value> {
    json["findings"].as_array().unwrap().iter().filter(|f| f["code"] == code).collect()
}

/// They have nothing to do with each other: what holds of each holds of both, and nothing is gained by all orders of both.
#[test]
fn who_touches_nothing_in_common_is_followed_apart() {
    let (json, _) = holders(&["arm", "gripper"], str::to_owned);
    assert_eq!((&json["ok"], &json["explored"]["complete"]), (&true.into(), &true.into()), "{json:#}");
    for code in ["coord::refused_by_other", "coord::shared", "coord::no_way_down", "deploy::never_up"] {
        assert!(of_code(&json, code).is_empty(), "{json:#}");
    }
    let states = |json: &Value| json["explored"]["states"].as_u64().unwrap();
    let (one, _) = holders(&["arm"], str::to_owned);
    let (four, _) = holders(&["a", "b", "c", "d"], str::to_owned);
    assert_eq!(four["explored"]["complete"], true, "{four:#}");
    assert!(states(&four) <= 5 * states(&one), "{} {}", states(&four), states(&one));
    // Where they touch the same, every order of both is followed.
    let (both, _) = holders(&["arm", "gripper"], |_| "arm".to_owned());
    assert!(states(&both) > 4 * states(&one), "{} {}", states(&both), states(&one));
}

/// The gripper's `high` sets the gain of the arm's drive: the arm cannot take its drive away then.
#[test]
fn a_refusal_because_of_the_other_names_both_and_comes_with_a_way() {
    let (json, _) = holders(&["arm", "gripper"], |_| "arm".to_owned());
    let found = of_code(&json, "coord::refused_by_other");
    let message = "`arm_base.undo` of `arm` is refused because of the frames of `gripper`";
    let one = found.iter().find(|f| f["message"].as_str().unwrap().starts_with(message));
    let one = one.unwrap_or_else(|| panic!("{json:#}"));
    assert_eq!(one["severity"], "warning");
    assert_eq!(one["file"], "arm.lua");
    let trace = one["trace"].as_array().unwrap();
    assert_eq!(trace[0]["states"][0], serde_json::json!({ "coordinator": "arm", "state": "root.idle" }), "{one:#}");
    let answers = trace.iter().filter_map(|step| step["answers"].as_array()).flatten();
    assert!(answers.into_iter().any(|answer| answer["answer"] == "gripper_high.ok"), "{one:#}");
    assert!(trace.len() <= 12, "{one:#}");
    // That they touch the same is a note now: what comes of it was followed.
    let shared = of_code(&json, "coord::shared");
    assert!(shared.len() == 1 && shared[0]["severity"] == "info", "{json:#}");
    assert_eq!(json["explored"]["unfollowed"], 0);
}

/// A component that another coordinator's configuration makes is not unknown.
#[test]
fn what_another_one_makes_is_not_missed() {
    let (json, _) = holders(&["arm", "gripper"], |_| "arm".to_owned());
    assert!(of_code(&json, "conf::unknown_component").is_empty(), "{json:#}");
    let refused = of_code(&json, "coord::request_refused");
    let message = "`gripper_high` is refused when it is asked for: there is no component `armDrive`";
    let one = refused.iter().find(|f| f["message"] == message).unwrap_or_else(|| panic!("{json:#}"));
    let help = one["help"].as_str().unwrap();
    assert!(help.contains("`arm_base`, which `arm` asks for"), "{help}");
}

/// One commands another by events: alone each could always come up, for the other might emit anything at any time.
fn boss_and_hand(holds: &str, free: &str) -> Value {
    let boss = "return state {
      idle = state {}, closing = state { entry = \"e_close\" }, held = state {}, opening = state { entry = \"e_open\" },
      trans { src = \"initial\", tgt = \"idle\" },
      trans { src = \"idle\", tgt = \"closing\", events = { \"e_start\" } },
      trans { src = \"closing\", tgt = \"held\", events = { \"e_holds\" } },
      late = state {}, trans { src = \"closing\", tgt = \"late\", events = { \"e_shutdown\" } },
      trans { src = \"late\", tgt = \"opening\", events = { \"e_holds\" } },
      trans { src = \"held\", tgt = \"opening\", events = { \"e_shutdown\" } },
      trans { src = \"opening\", tgt = \"idle\", events = { \"e_free\" } },
    }";
    let hand = format!(
        "return state {{
      open = state {{}}, shut = state {{ entry = \"grip\" }}, sure = state {{ entry = \"{holds}\" }},
      loose = state {{ entry = \"grip.undo\" }}, never = state {{ entry = {{ \"e_holds\", \"e_free\" }} }},
      trans {{ src = \"initial\", tgt = \"open\" }},
      trans {{ src = \"open\", tgt = \"shut\", events = {{ \"e_close\" }} }},
      trans {{ src = \"shut\", tgt = \"shut\", events = {{ \"grip.failed\", \"grip.broken\" }} }},
      trans {{ src = \"shut\", tgt = \"sure\", events = {{ \"grip.ok\" }} }},
      trans {{ src = \"sure\", tgt = \"loose\", events = {{ \"e_open\" }} }},
      trans {{ src = \"never\", tgt = \"open\", events = {{ \"e_shutdown\" }} }},
      trans {{ src = \"loose\", tgt = \"open\", events = {{ \"grip.undone\", \"grip.undo.failed\", \"grip.undo.broken\" }}, effect = \"{free}\" }},
    }}"
    );
    let demo = Demo::new();
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinator: boss.lua\ncoordinators: {{ hand: hand.lua }}\nemits: [e_else]
deploy: {{ event: e_start, up: [held, hand:sure], within_s: 5 }}
shutdown: {{ event: e_shutdown, down: [idle, hand:open], within_s: 5 }}\n"
        ),
    );
    demo.write("boss.lua", boss);
    demo.write("hand.lua", &hand);
    demo.write("conf.lua", "ConfiguratorConf { grip = Configuration { create(\"g\", \"Drive\") } }");
    demo.run(&["check", "two.yaml", "--json"]).json()
}

#[test]
fn who_waits_for_the_other_for_ever_is_found() {
    let sound = boss_and_hand("e_holds", "e_free");
    assert_eq!(sound["explored"]["complete"], true, "{sound:#}");
    for code in ["deploy::never_up", "coord::no_way_down", "coord::refused_by_other"] {
        assert!(of_code(&sound, code).is_empty(), "{sound:#}");
    }
    let silent = boss_and_hand("e_else", "e_free");
    let found = of_code(&silent, "deploy::never_up");
    assert!(
        found.len() == 1 && found[0]["message"].as_str().unwrap().contains("two:root.closing, hand:root.sure"),
        "{silent:#}"
    );
    let trace: Vec<&str> = silent["trace"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert_eq!(trace.first(), Some(&"start → two:root.idle, hand:root.open"), "{silent:#}");
    assert!(trace.contains(&"grip.ok → two:root.closing, hand:root.sure"), "{silent:#}");
    let stays = boss_and_hand("e_holds", "e_else");
    let found = of_code(&stays, "coord::no_way_down");
    assert!(
        found.iter().any(|f| f["message"].as_str().unwrap().contains("two:root.opening, hand:root.open")),
        "{stays:#}"
    );
}

/// Each pops the top of the stack, and both have configurations of one group.
#[test]
fn nobody_takes_the_others_frames() {
    let greedy = |name: &str| {
        format!(
            "return state {{
              idle = state {{}}, on = state {{}},
              trans {{ src = \"initial\", tgt = \"idle\" }},
              trans {{ src = \"idle\", tgt = \"on\", events = {{ \"e_start\" }}, effect = \"{name}_base\" }},
              trans {{ src = \"on\", tgt = \"on\", events = {{ \"e_{name}_mode\" }}, effect = \"{name}_mode\" }},
              trans {{ src = \"on\", tgt = \"on\", events = {{ \"e_{name}_pop\" }}, effect = \"{name}_mode.undo\" }},
              trans {{ src = \"on\", tgt = \"idle\", events = {{ \"e_shutdown\" }}, effect = \"{name}_base.undo\" }},
            }}"
        )
    };
    let demo = Demo::new();
    demo.write("arm.lua", &greedy("arm"));
    demo.write("gripper.lua", &greedy("gripper"));
    demo.write(
        "conf.lua",
        "ConfiguratorConf {
          arm_base = Configuration { create(\"a\", \"Drive\") }, gripper_base = Configuration { create(\"g\", \"Drive\") },
          arm_mode = Configuration { group = \"mode\", property_set(\"a.gain\", 2.0) },
          gripper_mode = Configuration { group = \"mode\", property_set(\"g.gain\", 2.0) },
        }",
    );
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinators: {{ arm: arm.lua, gripper: gripper.lua }}
deploy: {{ event: e_start, up: on, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: [arm:idle, gripper:idle], within_s: 5 }}\n"
        ),
    );
    let json = demo.run(&["check", "two.yaml", "--json"]).json();
    let told: Vec<&str> =
        of_code(&json, "coord::refused_by_other").iter().map(|f| f["message"].as_str().unwrap()).collect();
    let refused = |what: &str| told.iter().any(|m| m.starts_with(what) && m.contains("of the group `mode`"));
    assert!(refused("`gripper_mode` of `gripper` is refused"), "{json:#}");
    assert!(refused("`arm_mode` of `arm` is refused"), "{json:#}");
}

/// Both hold the same configuration, each with a frame of its own. A frame that one takes from the other would be found in
/// what the other has in force: it never comes to that alone.
#[test]
fn each_undoes_its_own_frame_of_a_common_configuration() {
    let holds = |name: &str| {
        format!(
            "return state {{
              idle = state {{}}, fault = state {{}}, on = state {{ config = \"common\" }},
              trans {{ src = \"initial\", tgt = \"idle\" }},
              trans {{ src = \"idle\", tgt = \"on\", events = {{ \"e_start\", \"e_{name}_on\" }} }},
              trans {{ src = \"on\", tgt = \"fault\", events = {{ \"common.failed\", \"common.broken\" }} }},
              trans {{ src = \"on\", tgt = \"idle\", events = {{ \"e_shutdown\", \"e_{name}_off\" }} }},
              trans {{ src = \"fault\", tgt = \"idle\", events = {{ \"e_shutdown\" }} }},
            }}"
        )
    };
    let demo = Demo::new();
    demo.write("arm.lua", &holds("arm"));
    demo.write("gripper.lua", &holds("gripper"));
    demo.write("conf.lua", "ConfiguratorConf { common = Configuration { description = \"what both need\" } }");
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinators: {{ arm: arm.lua, gripper: gripper.lua }}
deploy: {{ event: e_start, up: on, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: [arm:idle, gripper:idle], within_s: 5 }}\n"
        ),
    );
    let json = demo.run(&["check", "two.yaml", "--json"]).json();
    assert_eq!(json["explored"]["unfollowed"], 0, "{json:#}");
    assert!(of_code(&json, "coord::refused_by_other").is_empty(), "{json:#}");
}

/// One of them waits for an event before it is entered at all: nothing is known of what they do together.
#[test]
fn one_that_cannot_be_entered_is_told_and_nothing_is_claimed() {
    let one = "return state { a = state {},
      trans { src = \"initial\", tgt = \"a\", events = { \"e_start\" } },
      trans { src = \"a\", tgt = \"a\", events = { \"e_shutdown\" } } }";
    let two = one
        .replace(", events = { \"e_start\" } },", " }, trans { src = \"a\", tgt = \"a\", events = { \"e_start\" } },");
    let demo = Demo::new();
    demo.write("one.lua", one);
    demo.write("two.lua", &two);
    demo.write("conf.lua", "ConfiguratorConf { x = Configuration { create(\"x\", \"Drive\") } }");
    let parts = [("coordinators: { one: one.lua, two: two.lua }", "[one:a, two:a]"), ("coordinator: one.lua", "a")];
    for (coordinators, down) in parts {
        demo.write(
            "two.yaml",
            &format!(
                "{DEPLOYMENT}{coordinators}
deploy: {{ event: e_start, up: a, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: {down}, within_s: 5 }}\n"
            ),
        );
        let json = demo.run(&["check", "two.yaml", "--json"]).json();
        assert_eq!(of_code(&json, "chart::entry_waits").len(), 1, "{json:#}");
        assert_eq!(json["explored"]["complete"], false, "{json:#}");
        for code in ["coord::no_way_down", "deploy::never_up"] {
            assert!(of_code(&json, code).is_empty(), "{json:#}");
        }
    }
}

/// Each applies `common` twice on the way up, and undoes both: four frames, no more than two of them by one.
fn twice(undo: &str) -> Value {
    let climber = "return state {
      idle = state {}, one = state { entry = \"common\" }, two = state { entry = \"common\" }, up = state {},
      leaving = state { entry = \"common.undo\" }, last = state { entry = \"UNDO\" },
      trans { src = \"initial\", tgt = \"idle\" },
      trans { src = \"idle\", tgt = \"one\", events = { \"e_start\" } },
      trans { src = \"one\", tgt = \"two\", events = { \"common.ok\" } },
      trans { src = \"two\", tgt = \"up\", events = { \"common.ok\" } },
      trans { src = \"up\", tgt = \"leaving\", events = { \"e_shutdown\" } },
      trans { src = \"leaving\", tgt = \"last\", events = { \"common.undone\", \"common.undo.failed\" } },
      trans { src = \"last\", tgt = \"idle\", events = { \"common.undone\", \"common.undo.failed\", \"e_shutdown\" } },
      trans { src = \"one\", tgt = \"last\", events = { \"common.failed\", \"common.broken\", \"e_shutdown\" } },
      trans { src = \"two\", tgt = \"leaving\", events = { \"common.failed\", \"common.broken\", \"e_shutdown\" } },
    }";
    let demo = Demo::new();
    demo.write("arm.lua", &climber.replace("UNDO", undo));
    demo.write("gripper.lua", &climber.replace("UNDO", "common.undo"));
    demo.write("conf.lua", "ConfiguratorConf { common = Configuration { description = \"what both need\" } }");
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinators: {{ arm: arm.lua, gripper: gripper.lua }}\nemits: [e_other]
deploy: {{ event: e_start, up: up, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: [arm:idle, gripper:idle], within_s: 5 }}\n"
        ),
    );
    demo.run(&["check", "two.yaml", "--json"]).json()
}

#[test]
fn frames_are_counted_by_coordinator_and_a_way_that_is_cut_is_told() {
    let json = twice("common.undo");
    for code in ["deploy::never_up", "coord::stack_grows", "coord::no_way_down"] {
        assert!(of_code(&json, code).is_empty(), "{json:#}");
    }
    // One that keeps a frame each time round: what comes of that is not followed, so nothing is claimed.
    let json = twice("e_other");
    assert_eq!(of_code(&json, "coord::stack_grows").len(), 1, "{json:#}");
    assert_eq!(json["explored"]["complete"], false, "{json:#}");
}

/// Whether it is being led down counts when an undo begins, not when it was asked for: what an operator has put in its way since
/// goes with it only then. `before` and `after`: what is raised while the operator's request is under way.
fn undo_that_waits(before: &str, after: &str) -> String {
    let demo = Demo::new();
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinators: {{ one: one.lua, two: two.lua }}
deploy: {{ event: e_start, up: up, failed: [failed], within_s: 5 }}
shutdown: {{ event: e_shutdown, down: idle, within_s: 5 }}
operator: [op]\n"
        ),
    );
    demo.write(
        "conf.lua",
        r#"ConfiguratorConf {
          base = Configuration { create("drive", "Drive") },
          other = Configuration { create("lamp", "Drive") },
          op = Configuration { property_set("drive.gain", 2.0) },
        }"#,
    );
    demo.write(
        "one.lua",
        r#"return state {
          idle = state {}, up = state { entry = "base" }, failed = state {}, leaving = state { entry = "base.undo" },
          trans { src = "initial", tgt = "idle" },
          trans { src = "idle", tgt = "up", events = { "e_start" } },
          trans { src = "up", tgt = "failed", events = { "base.failed", "base.broken" } },
          trans { src = "up", tgt = "leaving", events = { "e_shutdown", "e_leave" } },
          trans { src = "leaving", tgt = "failed", events = { "base.undo.failed", "base.undo.broken" } },
          trans { src = "leaving", tgt = "idle", events = { "base.undone" } },
          trans { src = "failed", tgt = "leaving", events = { "e_shutdown" } },
        }"#,
    );
    demo.write(
        "two.lua",
        r#"return state {
          idle = state {}, up = state {}, failed = state {}, leaving = state { entry = "other.undo" },
          trans { src = "initial", tgt = "idle" },
          trans { src = "idle", tgt = "up", events = { "e_start" } },
          trans { src = "up", tgt = "leaving", events = { "e_shutdown" } },
          trans { src = "leaving", tgt = "idle", events = { "other.undone" } },
        }"#,
    );
    demo.write(
        "story.lua",
        &format!(
            "deploy(\"two.yaml\") wait(0.1) fault(\"property_set drive.gain\", \"slow\", 1, 0.06)
             apply(\"op\") wait(0.02) raise(\"{before}\") wait(0.02) raise(\"{after}\") wait(0.1)"
        ),
    );
    demo.run(&["run", "story.lua", "--clock", "simulated"]).out
}

#[test]
fn whether_it_is_led_down_counts_when_an_undo_begins() {
    // One leads down, the other one brings up again before the operator's request is over.
    let out = undo_that_waits("e_shutdown", "e_start");
    assert!(out.contains("`base` cannot be undone before `op`"), "{out}");
    // It was asked for while it was up, and begins while it is led down.
    let out = undo_that_waits("e_leave", "e_shutdown");
    assert!(out.contains("`op` of an operator was undone with it") && !out.contains("base.undo.failed"), "{out}");
}

/// What one tells the other of an event comes behind that event, and behind what it asks for in the same step: on the real clock,
/// where each has a thread of its own, round after round.
#[test]
fn what_is_told_comes_behind_what_it_is_about() {
    let demo = Demo::new();
    demo.write(
        "two.yaml",
        &format!(
            "{DEPLOYMENT}coordinators: {{ one: one.lua, two: two.lua }}
deploy: {{ event: e_start, up: up, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: idle, within_s: 5 }}
emits: [x_made, x_gone]\n"
        ),
    );
    demo.write(
        "conf.lua",
        r#"ConfiguratorConf {
          make = Configuration { create("drive", "Drive") },
          use = Configuration { property_set("drive.gain", 2.0) },
        }"#,
    );
    demo.write(
        "one.lua",
        r#"return state {
          idle = state {}, up = state {}, made = state { entry = { "make", "x_made" } },
          gone = state { entry = { "make.undo", "x_gone" } },
          trans { src = "initial", tgt = "idle" },
          trans { src = "idle", tgt = "up", events = { "e_start" } },
          trans { src = "up", tgt = "made", events = { "e_make" } },
          trans { src = "made", tgt = "gone", events = { "e_take" } },
          trans { src = "gone", tgt = "up", events = { "make.undone" } },
          trans { src = "up", tgt = "idle", events = { "e_shutdown" } },
        }"#,
    );
    // What it hears of the event itself comes before what the other one tells of it.
    demo.write(
        "two.lua",
        r#"return state {
          idle = state {}, up = state {}, waits = state {}, used = state { entry = "use" }, early = state {},
          takes = state { entry = "use.undo" }, over = state {},
          trans { src = "initial", tgt = "idle" },
          trans { src = "idle", tgt = "up", events = { "e_start" } },
          trans { src = "up", tgt = "waits", events = { "e_make" } },
          trans { src = "up", tgt = "early", events = { "x_made" } },
          trans { src = "waits", tgt = "used", events = { "x_made" } },
          trans { src = "used", tgt = "early", events = { "use.failed" } },
          trans { src = "used", tgt = "takes", events = { "e_use_over" } },
          trans { src = "takes", tgt = "over", events = { "use.undone" } },
          trans { src = "over", tgt = "up", events = { "x_gone" } },
          trans { src = "up", tgt = "idle", events = { "e_shutdown" } },
        }"#,
    );
    demo.write(
        "story.lua",
        r#"deploy("two.yaml")
        for _ = 1, 60 do
          raise("e_make") wait_state("two:root.used", 10) wait_answer("use.ok", 10)
          raise("e_use_over") wait_state("two:root.over", 10)
          raise("e_take") wait_state("one:root.up", 10) wait_state("two:root.up", 10)
        end"#,
    );
    let ran = demo.run(&["run", "story.lua"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}
