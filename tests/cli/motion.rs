//! What moves, what nobody knows of, and what is taken away by force: scripts over a small deployment on the simulated
//! platform.

use crate::demo::Demo;

const DEPLOYMENT: &str = "davit: 1
name: small
platform: simulated
types:
  T:
    properties: { k: { type: float, default: 0.0 } }
    operations:
      up: { effect: { undo: dn }, moves: true }
      dn: { effect: { undo: up }, moves: true }
      open: { effect: { undo: close } }
      close: { effect: { undo: open } }
      home: { effect: none, moves: true }
      look: { effect: none }
  M:
    moves: [start, stop]
    properties: { k: { type: float, default: 0.0 }, n: { type: float, default: 0.0, tunable: unconfigured } }
    operations:
      up: { effect: { undo: dn }, moves: true }
      dn: { effect: { undo: up }, moves: true }
      open: { effect: { undo: close } }
      close: { effect: { undo: open } }
configurations: [conf.lua]
coordinator: coordinator.lua
deploy:   { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_stop, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  base  = Configuration { create("a", "T"), create("b", "T"), post_conf_state = { "a:running" } },
  first = Configuration { property_set("a.k", 1) },
  other = Configuration { property_set("b.k", 1) },
  lift  = Configuration { operation_call("a.up") },
  open  = Configuration { operation_call("a.open") },
  home  = Configuration { property_set("b.k", 4), operation_call("a.home") },
  look  = Configuration { property_set("b.k", 4), operation_call("a.look") },
  tried = Configuration { confirm = { event = "e_conf", within = 1.0 }, operation_call("a.up") },
  build = Configuration { create("c", "M"), post_conf_state = { "c:stopped" } },
  go    = Configuration { post_conf_state = { "c:running" } },
  work  = Configuration { pre_conf_state = { "c:running" }, property_set("b.k", 3), operation_call("c.open") },
  halt  = Configuration { post_conf_state = { "c:stopped" } },
  held  = Configuration { on_failure = "hold", post_conf_state = { "c:running" } },
  keep  = Configuration { on_failure = "hold", pre_conf_state = { "c:stopped" }, operation_call("b.open") },
  swap  = Configuration { pre_conf_state = { "c:unconfigured" }, property_set("c.n", 4), post_conf_state = { "c:running" } },
  again = Configuration { pre_conf_state = { "c:stopped" }, operation_call("b.open"), post_conf_state = { "c:running" } },
  both  = Configuration { operation_call("a.up"), operation_call("b.open") },
  safe  = Configuration { safe = true, property_set("b.k", 9) },
  rest  = Configuration { safe = true, post_conf_state = { "c:stopped" } },
  tune  = Configuration { property_set("c.k", 7) },
  rise  = Configuration { operation_call("c.up") },
  slow  = Configuration { safe = true, property_set("c.k", 9) },
  meant = Configuration { confirm = { event = "e_conf", within = 1.0 }, on_failure = "rollback", operation_call("a.up") },
}
"#;

const COORDINATOR: &str = r#"return state {
  idle = state {}, building = state { entry = "base" }, up = state {}, removing = state { entry = "base.undo" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "building", events = { "e_start" } },
  trans { src = "building", tgt = "up", events = { "base.ok" } },
  trans { src = "building", tgt = "removing", events = { "base.failed", "base.broken", "e_stop" } },
  trans { src = "up", tgt = "removing", events = { "e_stop" } },
  trans { src = "removing", tgt = "idle", events = { "base.undone", "base.undo.failed", "base.undo.broken" } },
}
"#;

/// What a script says on stdout, with the steps of each answer; it must end well.
pub fn run(script: &str) -> String {
    let demo = Demo::new();
    demo.write("deployment.yaml", DEPLOYMENT);
    demo.write("conf.lua", CONFIGURATIONS);
    demo.write("coordinator.lua", COORDINATOR);
    demo.write("story.lua", &format!("deploy('deployment.yaml')\n{script}"));
    let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--json"]);
    assert!(!ran.err.contains("davit::script"), "{}{}", ran.out, ran.err);
    ran.out
}

/// The steps of an answer, as the log has them.
pub fn steps(log: &str, answer: &str) -> Vec<String> {
    let lines = log.lines().filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let mut answered = lines.filter(|line| line["answer"] == answer);
    let found = answered.next().unwrap_or_else(|| panic!("no `{answer}`: {log}"));
    let steps = found["steps"].as_array().cloned().unwrap_or_default();
    steps.iter().map(|step| step["step"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_call_that_may_have_happened_is_taken_back_by_its_compensation() {
    // Nobody gave it up: what became of it is not known, until somebody asks for its undo.
    let log = run("fault('operation_call a.open', 'lost') apply('open', {force = true}) wait_answer('open.broken', 5)
        undo('open') wait_answer('open.undone', 5) assert(#stack() == 1)");
    assert_eq!(steps(&log, "open.undone"), ["operation_call a.close"]);
    let log = run("fault('operation_call a.up', 'lost') apply('lift', {force = true}) wait_answer('lift.broken', 5)
        undo('lift') wait_answer('lift.undone', 5) assert(#stack() == 1)");
    assert_eq!(steps(&log, "lift.broken"), ["operation_call a.up"]);
    assert_eq!(steps(&log, "lift.undone"), ["operation_call a.dn"]);
}

#[test]
fn a_confirmation_that_runs_out_moves_nothing_unasked() {
    let log = run("apply('tried', {force = true}) wait_answer('tried.ok', 1) wait_answer('tried.undo.failed', 2) assert(#stack() == 2)
        undo('tried') wait_answer('tried.undone', 1)");
    assert!(steps(&log, "tried.undo.failed").is_empty(), "{log}");
    assert!(log.contains("nobody asked for that"), "{log}");
    let log = run(
        "apply('meant', {force = true}) wait_answer('meant.ok', 1) wait_answer('meant.reverted', 2) assert(#stack() == 1)",
    );
    assert_eq!(steps(&log, "meant.reverted"), ["operation_call a.dn"]);
}

/// A call that moves and leaves nothing to take back: without an answer it is not known whether it moves still, and that is
/// not the system as before. Of what only looks nothing need be known.
#[test]
fn a_call_that_may_be_moving_still_is_broken_though_nothing_undoes_it() {
    for how in ["lost", "hang", "late"] {
        let log = run(&format!(
            "fault('operation_call a.home', '{how}') apply('home', {{force = true}}) wait_answer('home.broken', 5)
            assert(property('b.k') == 0)
            local f for _, d in ipairs(drift()) do f = f or d.how == 'unknown' and d.text:find('a.home', 1, true) end assert(f)
            apply('first', {{force = true}}) wait_answer('first.failed', 5)
            apply('other', {{force = true}}) wait_answer('other.ok', 5)"
        ));
        assert!(log.contains("nobody knows whether it happened: `operation_call a.home()`"), "{how}: {log}");
        run(&format!(
            "fault('operation_call a.look', '{how}') apply('look', {{force = true}}) wait_answer('look.failed', 5)
            assert(property('b.k') == 0)"
        ));
    }
    // Who asks for its undo accepts what is unknown: nothing is called for that.
    let log = run("fault('operation_call a.home', 'lost') apply('home', {force = true}) wait_answer('home.broken', 5)
        undo('home') wait_answer('home.undone', 5) assert(#stack() == 1 and #drift() == 0)
        apply('first', {force = true}) wait_answer('first.ok', 5)");
    assert!(steps(&log, "home.undone").is_empty(), "{log}");
}

#[test]
fn force_tries_again_what_failed_once() {
    for (step, how) in [("stop a", "fail"), ("destroy a", "fail"), ("destroy a", "lie"), ("cleanup a", "lost")] {
        run(&format!("fault('{step}', '{how}') shutdown{{force = true}}"));
    }
}

#[test]
fn recover_leaves_alone_what_is_whole() {
    run("apply('lift', {force = true}) wait_answer('lift.ok', 1) recover('accept') assert(#stack() == 2)
        undo('lift') wait_answer('lift.undone', 1) recover('back') assert(#stack() == 1)");
}

/// What has moved is moved back by a component that runs as it did: nothing takes its power away under it.
#[test]
fn what_holds_something_up_is_not_stopped_under_it() {
    let log =
        run("for _, id in ipairs{'build', 'go', 'rise'} do apply(id, {force = true}) wait_answer(id .. '.ok', 1) end
        undo('go', {force = true}) wait_answer('go.undo.failed', 1) assert_running('c')
        undo('rise', {force = true}) wait_answer('rise.undone', 1)
        undo('go', {force = true}) wait_answer('go.undone', 1) assert_state('c', 'stopped')
        undo('build', {force = true}) wait_answer('build.undone', 1)");
    assert!(log.contains("`go` cannot be undone before `rise`"), "{log}");
}

/// Requests of one connection begin one after the other, also where they have nothing to do with each other; a script is one.
#[test]
fn what_one_asks_for_begins_one_after_the_other() {
    let log = run(
        "fault('property_set a.k = 1', 'slow', 1, 0.5) apply('first', {force = true}) apply('other', {force = true})
        wait_answer('other.ok', 5) assert(property('a.k') == 1)",
    );
    let at = |answer: &str| log.find(answer).unwrap_or_else(|| panic!("no `{answer}`: {log}"));
    assert!(at("first.ok") < at("other.ok"), "{log}");
}

/// What looking does not tell, and who has not come back, are told all the same, until that is over.
#[test]
fn drift_tells_of_what_is_unknown_and_of_who_has_not_come_back() {
    let told = |what: &str| {
        format!("local f for _, d in ipairs(drift()) do if d.text:find('{what}', 1, true) then f = d end end")
    };
    let (unknown, quarantined) = (told("nobody knows"), told("a is in quarantine"));
    run(&format!(
        "fault('operation_call a.open', 'late') apply('open', {{force = true}}) wait_answer('open.broken', 5)
        do {unknown} assert(f and f.how == 'unknown') end
        do {quarantined} assert(f and f.how == 'quarantined') end
        wait(10) assert(#drift() == 0)"
    ));
}

/// Interrupted by a safe configuration nothing goes back that moves, also where it came in only after that.
#[test]
fn what_moves_and_was_under_way_when_a_safe_configuration_came_stays() {
    let log = run("fault('operation_call a.up', 'slow', 1, 0.8) apply('lift', {force = true}) wait(0.4)
        apply('safe') wait_answer('safe.ok', 0.1) wait_answer('lift.broken', 5)
        local f = stack()[2] assert(f.configuration == 'lift' and f.partial)
        undo('safe') wait_answer('safe.undone', 1) undo('lift') wait_answer('lift.undone', 1) assert(#stack() == 1)");
    assert_eq!(steps(&log, "lift.broken"), ["operation_call a.up"]);
    assert_eq!(steps(&log, "lift.undone"), ["operation_call a.dn"]);
    // What was being stopped is not started again.
    let log = run("apply('build', {force = true}) apply('go', {force = true}) wait_answer('go.ok', 1)
        fault('stop c', 'slow', 1, 0.8) apply('halt', {force = true}) wait(0.4)
        apply('safe') wait_answer('safe.ok', 0.1) wait_answer('halt.broken', 5) assert(state('c') == 'stopped')");
    assert_eq!(steps(&log, "halt.broken"), ["stop c"]);
}

/// What came in late goes back where the safe configuration wants that.
#[test]
fn what_starts_late_is_stopped_where_a_safe_configuration_wants_it_stopped() {
    let log = run("apply('build', {force = true}) wait_answer('build.ok', 1)
        fault('start c', 'slow', 1, 0.8) apply('go', {force = true}) wait(0.4)
        apply('rest') wait_answer('rest.ok', 0.1) wait_answer('go.failed', 5) assert(state('c') == 'stopped')");
    assert_eq!(steps(&log, "go.failed"), ["start c", "undo: stop c"]);
}

/// `hold` keeps nothing that a safe configuration wants otherwise.
#[test]
fn what_is_held_and_starts_late_is_stopped_where_a_safe_configuration_wants_it_stopped() {
    let log = run(
        "apply('build', {force = true}) wait_answer('build.ok', 1)
        fault('start c', 'slow', 1, 0.8) apply('held', {force = true}) wait(0.4)
        apply('rest') wait_answer('rest.ok', 0.1) wait_answer('held.failed', 5) assert(state('c') == 'stopped')
        undo('rest') wait_answer('rest.undone', 1) assert(state('c') == 'stopped' and #drift() == 0 and #stack() == 2)",
    );
    assert_eq!(steps(&log, "held.failed"), ["start c", "undo: stop c"]);
}

/// What a safe configuration restores is not restored once more with what is held.
#[test]
fn what_a_safe_configuration_restores_is_not_in_the_frame_of_what_is_held() {
    let log = run(
        "apply('build', {force = true}) apply('go', {force = true}) wait_answer('go.ok', 1)
        fault('operation_call b.open', 'slow', 1, 0.8) apply('keep', {force = true}) wait(0.4)
        apply('rest') wait_answer('rest.ok', 0.1) wait_answer('keep.broken', 5) assert(state('c') == 'stopped')
        undo('rest', {force = true}) wait_answer('rest.undone', 1) assert(state('c') == 'running')
        undo('keep') wait_answer('keep.undone', 1) assert(state('c') == 'running' and #drift() == 0 and #stack() == 3)",
    );
    assert_eq!(steps(&log, "keep.undone"), ["operation_call b.close"]);
}

/// A safe configuration brings something broken to where it is expected, and its undo takes it away from there again: an undo
/// that is refused meanwhile does not take it for mended.
#[test]
fn what_a_safe_configuration_hides_stays_broken() {
    let log = run("apply('build', {force = true}) apply('go', {force = true}) wait_answer('go.ok', 1)
        fault('stop c', 'lie') apply('again', {force = true}) wait_answer('again.broken', 1) assert(state('c') == 'running')
        apply('rest') wait_answer('rest.ok', 1) assert(state('c') == 'stopped')
        undo('again') wait_answer('again.undo.broken', 1)
        undo('rest', {force = true}) wait_answer('rest.undone', 1) assert(state('c') == 'running')
        undo('again', {force = true}) wait_answer('again.undone', 1)
        assert(state('c') == 'running' and #drift() == 0 and #stack() == 3)");
    assert!(steps(&log, "again.undone").is_empty(), "{log}");
}

/// What cannot be taken back beside what a safe configuration wants is left, told, and taken back when that is undone.
#[test]
fn what_is_left_beside_a_safe_configuration_is_told_and_can_be_undone() {
    let log = run("apply('build', {force = true}) wait_answer('build.ok', 1)
        fault('configure c', 'slow', 1, 0.8) apply('swap', {force = true}) wait(0.4)
        apply('rest') wait_answer('rest.ok', 5) wait_answer('swap.broken', 5)
        assert(state('c') == 'stopped' and property('c.n') == 4 and #stack() == 4)
        undo('rest') wait_answer('rest.undone', 1) undo('swap') wait_answer('swap.undone', 1)
        assert(state('c') == 'stopped' and property('c.n') == 0 and #drift() == 0 and #stack() == 2)");
    assert_eq!(steps(&log, "swap.undone"), ["cleanup c", "property_set c.n", "configure c"]);
}

/// A call that takes something back, and was given up half way, has not taken it back: it is called again.
#[test]
fn what_was_being_taken_back_by_a_call_is_still_to_be_taken_back() {
    let log = run("apply('lift', {force = true}) wait_answer('lift.ok', 1)
        fault('operation_call a.dn', 'slow', 1, 0.8) undo('lift') wait(0.4)
        apply('safe') wait_answer('safe.ok', 0.1) wait_answer('lift.undo.broken', 5) assert(#stack() == 3)
        undo('safe') wait_answer('safe.undone', 1) undo('lift') wait_answer('lift.undone', 1) assert(#stack() == 1)");
    assert_eq!(steps(&log, "lift.undo.broken"), ["operation_call a.dn"], "{log}");
    assert_eq!(steps(&log, "lift.undone"), ["operation_call a.dn"], "{log}");
}

/// While a safe configuration is in force, who recovers moves nothing.
#[test]
fn recovering_moves_nothing_while_a_safe_configuration_is_in_force() {
    run("apply('build', {force = true}) wait_answer('build.ok', 1)
        fault('start c', 'lie') apply('go', {force = true}) wait_answer('go.ok', 1) wait(8)
        apply('safe') wait_answer('safe.ok', 1)
        local ok, why = pcall(recover, 'back')
        assert(not ok and tostring(why):find('start c', 1, true), tostring(why)) assert(state('c') == 'stopped')
        undo('safe') wait_answer('safe.undone', 1) recover('back') assert(state('c') == 'running')");
    let log = run("fault('operation_call b.open', 'slow', 1, 0.8) apply('both', {force = true}) wait(0.4)
        apply('safe') wait_answer('safe.ok', 0.1) wait_answer('both.broken', 5)
        local ok, why = pcall(recover, 'back')
        assert(not ok and tostring(why):find('a.dn', 1, true), tostring(why))
        undo('safe') wait_answer('safe.undone', 1) recover('back') assert(#stack() == 1)");
    let recovered = log.lines().find(|line| line.contains("\"recovered\"")).unwrap_or_else(|| panic!("{log}"));
    assert!(recovered.contains("operation_call a.dn"), "{recovered}");
    assert!(!steps(&log, "both.broken").contains(&"operation_call a.dn".to_owned()), "{log}");
}

/// What is not running, though the platform had said so, is not started to be stopped: its undo goes straight to where it
/// leads, whatever else is to be done for that.
#[test]
fn what_is_undone_is_not_mended_first() {
    let lied = "apply('build', {force = true}) wait_answer('build.ok', 1) fault('start c', 'lie')";
    let log = run(&format!(
        "{lied} apply('go', {{force = true}}) wait_answer('go.ok', 1) wait(8) assert(state('c') == 'stopped')
        undo('go') wait_answer('go.undone', 1) assert(state('c') == 'stopped' and #drift() == 0 and #stack() == 2)"
    ));
    assert!(steps(&log, "go.undone").is_empty(), "{log}");
    // What lies between the two is taken back all the same.
    let log = run(&format!(
        "{lied} apply('work', {{force = true}}) wait_answer('work.ok', 1) wait(8)
        undo('work') wait_answer('work.undone', 1) assert(state('c') == 'stopped' and property('b.k') == 0 and #drift() == 0)"
    ));
    assert_eq!(steps(&log, "work.undone"), ["operation_call c.close", "property_set b.k"]);
    // Nothing that would move is left, so it goes also while a safe configuration is in force.
    let log = run(&format!(
        "{lied} apply('go', {{force = true}}) wait_answer('go.ok', 1) wait(8) apply('safe') wait_answer('safe.ok', 1)
        undo('go') wait_answer('go.undone', 1) assert(state('c') == 'stopped' and #drift() == 0)"
    ));
    assert!(steps(&log, "go.undone").is_empty(), "{log}");
    // The other way round: what still runs, though it was said to be stopped, is not stopped to be started.
    let log = run("apply('build', {force = true}) apply('go', {force = true}) wait_answer('go.ok', 1)
        fault('stop c', 'lie') apply('halt', {force = true}) wait_answer('halt.ok', 1) wait(8) assert(state('c') == 'running')
        undo('halt') wait_answer('halt.undone', 1) assert(state('c') == 'running' and #drift() == 0)");
    assert!(steps(&log, "halt.undone").is_empty(), "{log}");
}

/// `c` runs.
pub const BUILT: &str = "apply('build', {force = true}) apply('go', {force = true}) wait_answer('go.ok', 1)";
/// Nothing is told of a state of `c`.
const STILL: &str = "for _, d in ipairs(drift()) do assert(not d.text:find('st[oa][pr]t? c'), d.text) end";

/// What is broken while a safe configuration is in force is expected as it was without that: once that is undone, nothing is
/// brought to where that had wanted it.
#[test]
fn what_a_safe_configuration_stopped_runs_again_though_a_call_was_lost_meanwhile() {
    let log = run(&format!(
        "{BUILT} fault('operation_call c.up', 'lost', 1) apply('rise', {{force = true}}) wait(0.1)
        apply('rest') wait_answer('rise.broken', 5) assert(state('c') == 'stopped') {STILL}
        undo('rest', {{force = true}}) wait_answer('rest.undone', 1) assert(state('c') == 'running') {STILL}
        undo('rise') wait_answer('rise.undone', 1) assert(state('c') == 'running' and #drift() == 0)
        undo('go') wait_answer('go.undone', 1)"
    ));
    assert_eq!(steps(&log, "rest.undone"), ["start c"], "{log}");
    assert_eq!(steps(&log, "rise.undone"), ["operation_call c.dn"], "{log}");
}

#[test]
fn what_a_safe_configuration_wrote_is_over_with_it_though_a_call_was_lost_meanwhile() {
    let log = run(&format!(
        "{BUILT} fault('operation_call c.up', 'lost', 1) apply('rise', {{force = true}}) wait(0.1)
        apply('slow') wait_answer('rise.broken', 5) assert(property('c.k') == 9)
        undo('slow') wait_answer('slow.undone', 1) assert(property('c.k') == 0)
        undo('rise') wait_answer('rise.undone', 1) assert(property('c.k') == 0 and #drift() == 0)"
    ));
    assert_eq!(steps(&log, "rise.undone"), ["operation_call c.dn"], "{log}");
    // What somebody has written since is not the safe configuration's.
    run(&format!(
        "{BUILT} apply('slow') apply('tune', {{force = true}}) wait_answer('tune.ok', 1)
        fault('operation_call c.up', 'lost', 1) apply('rise', {{force = true}}) wait_answer('rise.broken', 5)
        undo('slow', {{force = true}}) wait_answer('slow.undone', 1) assert(property('c.k') == 7)
        undo('rise') wait_answer('rise.undone', 1) assert(property('c.k') == 7 and #drift() == 0)"
    ));
}

/// Found while it is in force, or before it came: what it stopped is no difference.
#[test]
fn what_a_safe_configuration_stopped_runs_again_though_a_lie_was_found_meanwhile() {
    for (before, within) in [(2, 7), (8, 1)] {
        let lied = format!(
            "{BUILT} fault('property_set c.k', 'lie', 1) apply('tune', {{force = true}}) wait({before})
            apply('rest') wait({within}) assert(state('c') == 'stopped' and #drift() == 1) {STILL}
            undo('rest', {{force = true}}) wait_answer('rest.undone', 1) assert(state('c') == 'running') {STILL}"
        );
        let log = run(&format!(
            "{lied} undo('tune') wait_answer('tune.undone', 1) assert(state('c') == 'running' and #drift() == 0)"
        ));
        assert!(steps(&log, "tune.undone").is_empty(), "{log}");
        run(&format!("{lied} recover('back') assert(state('c') == 'running' and property('c.k') == 7)"));
    }
    // Its own lie is told: it is to be stopped, and runs. Its undo has nothing to do.
    let log = run(&format!(
        "{BUILT} fault('stop c', 'lie', 1) apply('rest') wait(8) assert(state('c') == 'running')
        local told for _, d in ipairs(drift()) do told = told or d.text:find('start c', 1, true) end assert(told)
        undo('rest', {{force = true}}) wait_answer('rest.undone', 1) assert(state('c') == 'running' and #drift() == 0)"
    ));
    assert!(steps(&log, "rest.undone").is_empty(), "{log}");
}
