//! A platform that says *done* and does nothing, while a safe configuration is in force: who wrote it is told, and its undo
//! leads out.

use crate::emergency::{belt, said};
use crate::motion::{BUILT, run, steps};

/// `c` is there and stopped.
const THERE: &str = "apply('build', {force = true}) wait_answer('build.ok', 1)";

/// Only who wrote what is otherwise has lost it. That a property can be set in a state of its own only, and the component
/// would have to be brought there and back, is no doing of what stopped it.
#[test]
fn what_was_stopped_is_not_lost_with_a_property_that_is_set_unconfigured() {
    let log = run(&format!(
        "{THERE} fault('property_set c.n', 'lie', 1) apply('swap', {{force = true}}) wait_answer('swap.ok', 1)
        apply('rest') wait_answer('rest.ok', 1) wait(8)
        undo('rest', {{force = true}}) wait_answer('rest.undone', 1) assert(state('c') == 'running')
        undo('swap') wait_answer('swap.undone', 1) assert(state('c') == 'stopped' and #drift() == 0 and #stack() == 2)"
    ));
    assert!(log.contains("swap.lost") && !log.contains("rest.lost"), "{log}");
    // Nothing is mended first: what it had wanted never was.
    assert_eq!(steps(&log, "swap.undone"), ["stop c"], "{log}");
}

/// What a safe configuration wrote itself is a difference like others; its own undo leads out of it, it can be asked for again,
/// and who recovers brings it about.
#[test]
fn what_a_safe_configuration_did_not_write_after_all_is_told() {
    let lied = format!(
        "{THERE} apply('tune', {{force = true}}) wait_answer('tune.ok', 1) fault('property_set c.k', 'lie', 1)
        apply('slow') wait_answer('slow.ok', 1) wait_answer('slow.lost', 8)
        assert(property('c.k') == 7 and #drift() == 1, #drift())"
    );
    let rest =
        "undo('tune') wait_answer('tune.undone', 1) assert(property('c.k') == 0 and #drift() == 0 and #stack() == 2)";
    let undone =
        "undo('slow', {force = true}) wait_answer('slow.undone', 1) assert(property('c.k') == 7 and #drift() == 0)";
    let log = run(&format!("{lied} {undone} {rest}"));
    assert!(steps(&log, "slow.undone").is_empty(), "{log}");
    let log = run(&format!("{lied} recover('back') assert(property('c.k') == 9 and #drift() == 0) {undone} {rest}"));
    assert_eq!(steps(&log, "slow.undone"), ["property_set c.k"], "{log}");
    // The second does what the first had not: what that wants stays until it is undone itself.
    run(&format!(
        "{lied} apply('slow') wait(0.5) assert(property('c.k') == 9 and #drift() == 0 and #stack() == 5)
        undo('slow', {{force = true}}) wait_answer('slow.undone', 1) assert(property('c.k') == 9 and #drift() == 0)
        undo('slow', {{force = true}}) wait(0.5) assert(property('c.k') == 7 and #drift() == 0 and #stack() == 3) {rest}"
    ));
}

/// It is stopped only when that is asked for; what recovers does not move it, and the undo has nothing to do.
#[test]
fn what_a_safe_configuration_did_not_stop_after_all_is_told() {
    let lied = format!(
        "{BUILT} fault('stop c', 'lie', 1) apply('rest') wait_answer('rest.ok', 1) wait_answer('rest.lost', 8)
        assert(state('c') == 'running' and #drift() == 1)"
    );
    let log = run(&format!(
        "{lied} local ok, why = pcall(recover, 'back') assert(not ok and tostring(why):find('stop c', 1, true), tostring(why))
        undo('rest', {{force = true}}) wait_answer('rest.undone', 1) assert(state('c') == 'running' and #drift() == 0)
        undo('go') wait_answer('go.undone', 1) assert(state('c') == 'stopped' and #stack() == 2)"
    ));
    assert!(steps(&log, "rest.undone").is_empty(), "{log}");
    let log = run(&format!("{lied} apply('rest') wait(0.5) assert(state('c') == 'stopped' and #drift() == 0)"));
    let stopped = log.lines().filter(|line| line.contains("rest.ok") && line.contains("stop c")).count();
    assert_eq!(stopped, 2, "{log}");
}

/// What came late and goes back, since a safe configuration wants it so, has to arrive: else it is done again, and told.
#[test]
fn what_came_late_and_did_not_go_back_is_tried_again_and_told() {
    let script = |lost: u32| {
        format!(
            "{THERE} fault('cleanup c', 'slow', 1, 0.2) fault('configure c', 'lost', {lost})
            apply('swap', {{force = true}}) wait(0.1) apply('rest') wait_answer('rest.ok', 0.1)"
        )
    };
    let back = "undo('rest', {force = true}) wait_answer('rest.undone', 1)";
    let log = run(&format!(
        "{} wait_answer('swap.failed', 5) assert(state('c') == 'stopped' and #drift() == 0) {back}
        undo('build', {{force = true}}) wait_answer('build.undone', 1)",
        script(1)
    ));
    let tried = steps(&log, "swap.failed");
    assert_eq!(tried.iter().filter(|step| step.ends_with("configure c")).count(), 2, "{tried:?} {log}");
    run(&format!(
        "{} wait_answer('swap.broken', 5) assert(state('c') == 'unconfigured' and #drift() == 1) {back}
        undo('swap') wait_answer('swap.undone', 1) assert(state('c') == 'stopped' and #drift() == 0 and #stack() == 2)
        undo('build', {{force = true}}) wait_answer('build.undone', 1)",
        script(2)
    ));
}

/// A connection that was not taken away, though the platform had said so, is a difference of both its ends: who recovers takes that away, and
/// what is at its other end stays as it is.
#[test]
fn what_is_at_the_other_end_of_a_connection_is_not_taken_away_by_who_recovers() {
    let demo = belt();
    demo.replace(
        "belt/deployment.yaml",
        "      speed: { direction: in, type: float, unit: m/s }",
        "      speed: { direction: in, type: float, unit: m/s }\n      past: { direction: out, type: float, unit: m/s }\n      near: { direction: in, type: float, unit: m/s }",
    );
    demo.replace(
        "belt/configurations.yaml",
        "  run:\n",
        "  beside: { changes: [{ create: { component: aux, type: Motor } }] }\n  wire: { changes: [{ connect: { from: motor.past, to: aux.near } }] }\n  parked: { post_conf_state: [\"motor:stopped\"] }\n  run:\n",
    );
    let story = "deploy('deployment.yaml')
        local function tell(when) say(when .. ' ' .. state('motor') .. ' ' .. tostring(state('aux')) .. ' ' .. #system().connections .. ' ' .. #drift()) end
        local function put(name) apply(name, {force = true}) wait_answer(name .. '.ok', 1) end
        put('beside') put('wire') fault('disconnect motor.past', 'lie', 2) undo('wire', {force = true}) wait_answer('wire.undone', 1)
        fault('stop motor', 'lie') put('parked') undo('parked', {force = true}) wait_answer('parked.undo.broken', 1) tell('broken')
        recover('back') tell('recovered') for _ = 1, 3 do undo() wait(1) end shutdown()";
    let told = said(&demo, story);
    let told: Vec<&String> =
        told.iter().filter(|line| line.starts_with("broken") || line.starts_with("recovered")).collect();
    assert!(told[0].starts_with("broken stopped unconfigured 1 "), "{told:?}");
    assert_eq!(told[1], "recovered stopped unconfigured 0 0");
}

/// What takes the place of another one of its group undoes that: not where something of that is broken, also where it names nothing of it itself.
#[test]
fn nothing_takes_the_place_of_what_is_broken() {
    let demo = belt();
    demo.replace(
        "belt/configurations.yaml",
        "  run:\n",
        "  beside: { changes: [{ create: { component: aux, type: Motor } }] }\n  parked: { group: place, post_conf_state: [\"motor:stopped\"] }\n  aside: { group: place, changes: [{ property_set: { property: aux.limit, value: 0.7 } }] }\n  run:\n",
    );
    let story = "deploy('deployment.yaml')
        local function tell(when) say(when .. ' ' .. state('motor') .. ' ' .. property('aux.limit') .. ' ' .. #stack() .. ' ' .. #drift()) end
        local function put(name) apply(name, {force = true}) wait_answer(name .. '.ok', 1) end
        put('beside') put('parked') fault('property_set motor.limit', 'lie') set('motor.limit', 0.7) wait(6) tell('lied')
        apply('aside', {force = true}) wait_answer('aside.failed', 1) tell('refused')
        recover('back') put('aside') tell('recovered') for _ = 1, 4 do undo() wait(1) end shutdown()";
    let told = said(&demo, story);
    let told: Vec<&String> = told.iter().filter(|line| !line.contains("note ")).collect();
    assert_eq!(told[..3], ["lied stopped 0.5 6 1", "refused stopped 0.5 6 1", "recovered running 0.7 6 0"]);
}
