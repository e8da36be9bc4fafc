//! What stops the robot, in every state in which its drives have power, and what is felt of a switch.

use crate::live::{Live, Row, jolt};
use davit::model::{ComponentName, Step, Transition};

/// A hand that brings the arms together and sways, sooner than the shipped one.
const HAND: &str = "free 0.5; align 1.5; sway 600 0.06 0 0 0.15";

/// Up and copying, swayed by the hand.
fn swaying(name: &str) -> Live {
    let live = Live::with_hand(name, HAND);
    live.bring_up();
    live.until_state("copying", 5.0);
    live.run(2.0);
    live
}

/// Where it is stopped: what is raised on the way there, and the state.
const PLACES: [(&str, fn(&Live)); 11] = [
    ("calibrating", |live| way_up(live, "calibrating", 0.06)),
    ("unfolding", |live| way_up(live, "unfolding", 2.0)),
    ("unsync", |live| up(live, "unsync", 0.1)),
    ("harmonizing", |live| up(live, "harmonizing", 0.2)),
    ("copying with eight", |live| up(live, "eight_DOF_mode", 2.0)),
    ("copying with five", |live| {
        up(live, "eight_DOF_mode", 0.5);
        live.raise("e_5dof");
        live.until_state("five_DOF_mode", 1.0);
        live.run(1.0);
    }),
    ("soft_stop", |live| {
        up(live, "eight_DOF_mode", 0.5);
        live.raise("e_force_spike");
        live.until_state("soft_stop", 1.0);
    }),
    ("parking", |live| {
        up(live, "eight_DOF_mode", 0.5);
        live.raise("e_shutdown");
        live.until_state("parking", 1.0);
        live.run(1.8);
    }),
    ("cancelling", |live| {
        way_up(live, "unfolding", 3.0);
        live.raise("e_shutdown");
        live.until_state("folding", 5.0);
        live.run(1.0);
    }),
    ("stopped while parking", |live| {
        up(live, "unsync", 0.1);
        live.raise("e_shutdown");
        live.until_state("parking", 1.0);
        live.run(1.0);
        live.raise("e_estop");
        live.run(1.0);
        live.raise("e_reset");
        live.until_state("stranded.before_parking", 1.0);
    }),
    ("failed on the way up", |live| {
        way_up(live, "unfolding", 1.0);
        live.raise("e_estop");
        live.run(1.0);
        live.raise("e_reset");
        live.until_state("deploy_failed", 1.0);
    }),
];

fn way_up(live: &Live, state: &str, longer: f64) {
    live.raise("e_start");
    live.until_state(state, 10.0);
    live.run(longer);
    assert!(live.session.in_state(state), "{}", live.place());
}

fn up(live: &Live, state: &str, longer: f64) {
    live.raise("e_start");
    live.until_state(state, 20.0);
    live.run(longer);
    assert!(live.session.in_state(state), "{}\n{}", live.place(), live.story(0.0));
}

/// From `t` on the tool is at rest: the fastest it was, in m/s.
fn fastest(rows: &[Row], t: f64) -> f64 {
    rows.iter().filter(|row| row.t >= t).map(|row| row.speed.norm()).fold(0.0, f64::max)
}

/// Stops it with `stop`, and holds what is said to hold. What is not so, one line each.
fn scenario(name: &str, (place, go): &(&str, fn(&Live)), stop: &str) -> Vec<String> {
    let live = Live::with_hand(name, HAND);
    go(&live);
    live.run(0.02);
    live.rows();
    let t = live.now();
    match stop {
        "e_estop" => live.raise(stop),
        fault => live.driver_fault(fault),
    }
    live.run(1.5);
    let rows = live.rows();
    let mut wrong = Vec::new();
    let mut say = |so: bool, what: String| {
        if !so {
            println!("{name}, {place}, {stop}: {what}");
            wrong.push(format!("{name}, {place}, {stop}: {what}"));
        }
    };
    let heard = live.first("safe_hold.ok", t);
    say(heard.is_some_and(|at| at - t < 0.05), format!("not heard, in {}", live.place()));
    let rest = fastest(&rows, t + 0.3);
    say(rest < 0.02, format!("{rest:.3} m/s after 0.3 s"));
    let (step, at) = jolt(&rows);
    say(step < 0.5, format!("{step:.2} N m in 1 ms, {:.3} s after", at - t));
    say(live.place().ends_with(".waiting"), format!("in {} instead of waiting", live.place()));
    // It takes a reset, and then it is to be told.
    let before = rows.last().unwrap().tool;
    live.raise("e_reset");
    live.run(0.7);
    let rows = live.rows();
    let moved = rows.iter().map(|row| (row.tool - before).norm()).fold(0.0, f64::max);
    // In operation the hand of the operator may take hold again.
    let handled = rows.iter().any(|row| row.hand.norm() > 0.0);
    say(handled || moved < 0.005, format!("it moved {moved:.3} m after the reset, in {}", live.place()));
    let mode = rows.last().unwrap().mode;
    let operational = live.session.in_state("operational");
    say(operational == (mode == 6), format!("mode {mode} in {}", live.place()));
    // And down from there, if somebody asks.
    live.raise("e_shutdown");
    for _ in 0..400 {
        if live.session.in_state("idle") {
            break;
        }
        live.run(0.05);
    }
    say(live.session.in_state("idle"), format!("not down but in {}", live.place()));
    // Also where it was folding on the way back: it folds again.
    say(live.first("e_arm_dropped", 0.0).is_none(), "the arm was dropped".to_owned());
    let status = live.session.status();
    let (system, stack, residual) = (status.system.unwrap(), status.stack.unwrap(), status.residual.unwrap());
    let nothing = system.components.is_empty() && stack.is_empty() && residual.is_empty();
    say(nothing, format!("left: {stack:?} {residual:?}"));
    live.clock.shutdown();
    wrong
}

fn table(name: &str, stop: &str) {
    let wrong: Vec<String> = PLACES.iter().flat_map(|place| scenario(name, place, stop)).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn an_estop_is_heard_everywhere() {
    table("youbot_arm", "e_estop");
}

#[test]
fn an_estop_is_heard_everywhere_scoped() {
    table("youbot_arm_scoped", "e_estop");
}

#[test]
fn a_fault_of_the_drives_is_heard_everywhere() {
    table("youbot_arm", "overcurrent");
}

#[test]
fn a_fault_of_the_drives_is_heard_everywhere_scoped() {
    table("youbot_arm_scoped", "overcurrent");
}

/// Whatever fails in the drives on the way down.
#[test]
fn a_fault_of_the_drives_is_heard_while_it_parks() {
    let parking = PLACES.iter().find(|place| place.0 == "parking").expect("one of them");
    for (name, stop) in [
        ("youbot_arm", "overcurrent"),
        ("youbot_arm", "overtemp"),
        ("youbot_arm_scoped", "ec_timeout"),
        ("youbot_arm_scoped", "encoder"),
    ] {
        assert_eq!(scenario(name, parking, stop), [""; 0]);
    }
}

/// And `davit shutdown` asked for once more, without a reset: it parks, and nothing is left.
#[test]
fn a_fault_of_the_drives_while_it_is_led_down_waits_for_people() {
    let live = Live::with_hand("youbot_arm", HAND);
    up(&live, "unsync", 0.1);
    live.raise("e_shutdown");
    live.until_state("parking", 1.0);
    live.run(1.0);
    live.driver_fault("overcurrent");
    live.run(1.0);
    assert!(live.place().ends_with("lowering.waiting"), "{}", live.place());
    live.down();
}

/// Somebody pushes with 40 N: whatever notices it first, the robot brakes.
fn push(name: &str, direction: &str) {
    let live = Live::copying(name);
    live.run(0.5);
    live.rows();
    let t = live.now();
    live.set("Operator", "script", format!("push 1 {direction}").as_str());
    live.until_state("fault", 1.0);
    let fault = live.now();
    assert!(fault - t <= 0.3, "noticed after {} s", fault - t);
    live.run(2.0);
    let rows = live.rows();
    let rest = fastest(&rows, fault + 0.3);
    let way = rows.iter().map(|row| (row.tool - rows[0].tool).norm()).fold(0.0, f64::max);
    let quick = rows.iter().flat_map(|row| row.joints.vel).map(f64::abs).fold(0.0, f64::max);
    let (step, at) = jolt(&rows);
    println!(
        "{name}, push {direction}: fault after {:.3} s, {rest:.4} m/s 0.3 s later, {way:.3} m, {quick:.2} rad/s, {step:.2} N m/ms at {:.3}",
        fault - t,
        at - t
    );
    assert!(rest < 0.02, "{direction}: {rest} m/s 0.3 s after the fault");
    assert!(way < 0.2, "{direction}: {way} m");
    assert!(step < 0.5, "{step} N m in 1 ms at {} s", at - t);
}

#[test]
fn a_hard_push_ends_at_rest() {
    push("youbot_arm", "0 40 0");
    push("youbot_arm", "40 0 0");
    push("youbot_arm_scoped", "0 -40 0");
}

/// Up, down, towards the base, and obliquely away from it.
#[test]
fn a_hard_push_ends_at_rest_up_and_down_too() {
    // To the last two the arm gives way at just less than the limit of its joints' speed.
    for direction in ["-40 0 0", "0 0 40", "0 0 -40", "28 0 28", "28 0 -28", "20 20 -28"] {
        push("youbot_arm", direction);
    }
}

/// Taking hold, letting go, a link that is cut, two modes: no torque changes by more than half a newton metre in 1 ms.
fn switches(name: &str) {
    let live = swaying(name);
    live.rows();
    let mut all = Vec::new();
    // In the middle of the sway, with the coupling at work.
    for (event, state) in [("e_5dof", "five_DOF_mode"), ("e_8dof", "eight_DOF_mode"), ("e_misaligned", "harmonizing")] {
        live.raise(event);
        live.until_state(state, 1.0);
        live.run(0.7);
    }
    live.until_state("copying", 5.0);
    live.run(1.0);
    live.raise("e_5dof");
    live.run(1.0);
    live.set("Peer", "cut", true);
    live.until_state("unsync", 1.0);
    live.run(0.5);
    all.extend(live.rows());
    let base = all.last().unwrap().base;
    live.set("Peer", "cut", false);
    live.until_state("copying", 8.0);
    live.run(1.0);
    // The operator's mode is kept: the base does not move unasked.
    assert!(live.session.in_state("five_DOF_mode"), "{}", live.place());
    all.extend(live.rows());
    let now = all.last().unwrap().base;
    assert!((now.x - base.x).hypot(now.y - base.y) < 0.005, "the base moved: {base:?} {now:?}");
    live.raise("e_shutdown");
    live.until_state("idle", 20.0);
    all.extend(live.rows());
    let (step, at) = jolt(&all);
    println!("{name}: {step:.2} N m in 1 ms at most, at {at:.3} s");
    assert!(step < 0.5, "{step} N m in 1 ms at {at} s\n{}", live.story(at - 0.1));
    live.clock.shutdown();
}

#[test]
fn no_switch_is_felt() {
    for name in ["youbot_arm", "youbot_arm_scoped"] {
        switches(name);
    }
}

/// From drives that are off to drives that are off, through whatever switches or stops: with joints as they may be.
fn all_of_it(name: &str, friction: f64, mass: f64) {
    let live = Live::with_joints(name, HAND, friction, mass);
    let mut all = Vec::new();
    let mut felt = |live: &Live| all.extend(live.rows());
    live.bring_up();
    // It couples where the hand gets the arms together in that time.
    live.run(4.0);
    felt(&live);
    live.raise("e_misaligned");
    live.run(0.5);
    live.raise("e_estop");
    live.run(0.5);
    felt(&live);
    live.raise("e_reset");
    live.until_state("operational", 1.0);
    live.run(0.5);
    live.set("Operator", "script", "push 1 40 0 0");
    live.run(0.3);
    // Stiff joints do not get too fast.
    live.raise("e_estop");
    live.until_state("fault", 1.0);
    live.run(0.5);
    felt(&live);
    live.set("Operator", "script", "free 600");
    live.raise("e_reset");
    live.until_state("operational", 1.0);
    live.run(0.3);
    live.raise("e_shutdown");
    live.until_state("parking", 1.0);
    live.run(1.0);
    live.driver_fault("overcurrent");
    live.run(0.5);
    live.raise("e_reset");
    live.run(0.3);
    live.raise("e_shutdown");
    live.until("with drives off", 20.0, |live| live.first("cleanup_all.ok", 0.0).is_some());
    felt(&live);
    let (step, at) = jolt(&all);
    println!("{name}, friction {friction}, mass {mass}: {step:.2} N m in 1 ms at most, at {at:.3} s");
    assert!(all[0].mode != 6 && step < 0.5, "{step} N m in 1 ms at {at} s\n{}", live.story(at - 0.1));
    // What is left when the driver stops is gone at once: it is stopped when the torque has faded.
    let done = |what: &str| live.first(what, 0.0).unwrap_or_else(|| panic!("{what}"));
    let faded = done("stop_all.ok") - done("stop_control.ok");
    assert!(faded > 0.004, "stopped {faded} s after the control loop, from up to 2 N m");
    assert_eq!(live.first("e_arm_dropped", 0.0), None);
    live.clock.shutdown();
}

#[test]
fn no_torque_steps_from_the_first_to_the_last() {
    all_of_it("youbot_arm", 2.0, 1.0);
    all_of_it("youbot_arm_scoped", 1.0, 1.05);
}

/// What is in force and dies is noticed within 50 ms, and the robot is stopped.
#[test]
fn what_dies_is_noticed() {
    for (component, event) in [
        ("Arm_Kinematics", "e_control_lost"),
        ("Base_Ctrl", "e_control_lost"),
        ("Dynamics", "e_cmd_watchdog"),
        ("Monitors", "e_watch_lost"),
        ("Cart_Impedance", "e_controller_lost"),
    ] {
        let live = swaying("youbot_arm_scoped");
        live.rows();
        let t = live.now();
        live.step(&Step::State { component: ComponentName::new(component).unwrap(), transition: Transition::Stop });
        live.run(0.4);
        let noticed = live.first(event, t).map(|at| at - t);
        assert!(
            noticed.is_some_and(|after| after <= 0.05),
            "{component}: {event} after {noticed:?} s\n{}",
            live.story(t)
        );
        assert!(live.first("safe_hold.ok", t).is_some_and(|at| at - t <= 0.055), "{component}\n{}", live.story(t));
        let rows = live.rows();
        let (step, at) = jolt(&rows);
        assert!(step < 0.5, "{component}: {step} N m in 1 ms, {} s after", at - t);
        live.clock.shutdown();
    }
}
