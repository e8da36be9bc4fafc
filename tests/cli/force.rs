//! What force does, in which order, and what is told of it; and what a look at the platform finds and forgets.

use crate::demo::Ran;
use crate::small;

const DEPLOYMENT: &str = "davit: 1
name: small
platform: simulated
types:
  T:
    properties: { k: { type: float, default: 1.0 }, g: { type: float, default: 1.0 } }
    operations:
      home: { effect: { undo: away }, moves: true }
      away: { effect: { undo: home }, moves: true }
      open: { effect: { undo: close } }
      close: { effect: { undo: open } }
configurations: [conf.lua]
coordinator: coordinator.lua
operator: [calm, park, open, held, kick, home]
deploy:   { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_stop, down: idle, within_s: 5, rest: [park] }
";

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  base = Configuration { create("a", "T"), create("b", "T"), post_conf_state = { "_default:running" } },
  calm = Configuration { safe = true, property_set("a.g", 0.0) },
  park = Configuration { property_set("b.k", 9.0) },
  open = Configuration { operation_call("a.open") },
  home = Configuration { operation_call("a.home") },
  held = Configuration { on_failure = "hold", property_set("a.k", 7.0), property_set("b.g", 2.0) },
  kick = Configuration { property_set("a.k", 5.0), property_set("a.g", 5.0) },
}
"#;

fn run(script: &str) -> Ran {
    let told = "local function drifts(what) for _, d in ipairs(drift()) do if d.text:find(what, 1, true) then return true end end end\n";
    small::run(DEPLOYMENT, CONFIGURATIONS, &format!("{told}deploy('deployment.yaml')\n{script}"))
}

fn whole(script: &str) -> String {
    let ran = run(script);
    assert!(!ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
    ran.out + &ran.err
}

fn in_order(text: &str, words: &[&str]) {
    let mut rest = text;
    for word in words {
        let at = rest.find(word).unwrap_or_else(|| panic!("no `{word}` (in order) in {text}"));
        rest = &rest[at + word.len()..];
    }
}

#[test]
fn what_is_safe_comes_first_then_what_brings_it_to_rest() {
    let told = whole("shutdown{force = true}");
    in_order(&told, &["safe configuration `calm` applied", "`park`, to come to rest, applied", "destroy"]);
    // What a safe configuration holds still is not moved.
    let told = whole("apply('calm') wait_answer('calm.ok', 1) shutdown{force = true}");
    assert!(told.contains("safe configuration `calm` applied") && !told.contains("`park`"), "{told}");
}

#[test]
fn quarantine_does_not_keep_out_what_is_safe_and_what_failed_is_not_called_applied() {
    let hung = "fault('operation_call a.home', 'hang') apply('home') wait(1) shutdown{force = true}";
    let ran = run(hung);
    let told = ran.out + &ran.err;
    assert!(told.contains("safe configuration `calm` applied\n"), "{told}");
    let failed = whole("fault('property_set a.g', 'fail', 9) shutdown{force = true}");
    assert!(failed.contains("safe configuration `calm` applied as far as it went"), "{failed}");
}

#[test]
fn what_is_not_known_stays_told_until_it_is() {
    let ran = run("fault('operation_call a.home', 'hang') apply('home') wait(2) assert(drifts('nobody knows'))
        undo('home', {force = true}) wait(1) assert(drifts('nobody knows'), 'after the undo') say('to the end')");
    assert!((ran.out.clone() + &ran.err).contains("to the end"), "{}{}", ran.out, ran.err);
}

/// A partial frame is in force, and nothing differs.
#[test]
fn what_is_in_force_is_no_drift() {
    whole(
        "fault('property_set b.g', 'fail') apply('held') wait_answer('held.broken', 1)
        assert(#drift() == 0) apply('held') wait_answer('held.ok', 1) assert(#drift() == 0)
        undo('held') wait_answer('held.undone', 1) undo('held') wait_answer('held.undone', 1)",
    );
}

#[test]
fn a_partial_frame_that_holds_nothing_goes_when_all_is_known() {
    whole(
        "fault('property_set a.g', 'late') apply('kick') wait(20) assert(#drift() == 0)
        assert(#stack() == 1, 'frames ' .. #stack())",
    );
}

/// A false *done* of a destroy: what should be gone is there.
#[test]
fn what_should_be_gone_is_looked_for() {
    let ran = run("fault('destroy a', 'lie') raise('e_stop') wait_state('idle', 1) wait(12)
        assert(drifts('create a')) for _, d in ipairs(drift()) do say(d.how .. ' ' .. d.text) end");
    let told = ran.out + &ran.err;
    assert!(told.contains("differs create a"), "{told}");
    assert!(told.contains("broken") || told.contains("otherwise"), "{told}");
}
