//! One robot on the embedded platform, from nothing to nothing, in simulated time.

use crate::bench::{Bench, Row};
use davit::model::{Transition, Value};
use davit::platform::Outcome;
use std::time::Duration;

const DOWN: &[&str] =
    &["base_stop", "hold", "park", "stop_control", "stop_all", "cleanup_all", "disconnect_all", "destroy_all"];

fn rms(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = values.clone().count().max(1);
    (values.map(|v| v * v).sum::<f64>() / n as f64).sqrt()
}

fn error(rows: &[Row]) -> impl Iterator<Item = f64> + Clone + '_ {
    rows.iter().filter_map(|r| r.other.map(|o| (r.tool - o).norm()))
}

#[test]
fn up_engaged_and_down_to_nothing() {
    let mut bench = Bench::new("youbot_arm");
    let began = bench.now();
    bench.all(&["create_core", "create_link", "create_monitors", "connect_all", "load_properties"]);
    bench.probe();
    bench.apply("start_driver");
    let before = bench.now();
    bench.all(&["calibrate", "unfold"]);
    let moving = bench.now() - before;
    bench.all(&["start_control", "take_over"]);
    assert!(bench.now() - began - moving < 0.5, "bring-up takes {} s beside the motions", bench.now() - began - moving);

    let good = bench.wait("e_qos_ok", 3.0);
    assert!(good - bench.now() <= 0.0);
    bench.apply("five_DOF");
    bench.wait("e_aligned", 12.0);
    bench.apply("enable_copying");
    bench.run(10.0);
    let rows = bench.rows();
    // The arm is there and does not fall, from the moment the drives take torques.
    assert!(rows.iter().filter(|r| r.mode == 6).all(|r| r.tool.z > 0.2), "the arm fell");
    assert!(rows.iter().all(|r| r.saturated == 0));
    let coupled: Vec<Row> = rows.iter().filter(|r| r.force.norm() > 0.0).copied().collect();
    assert!(coupled.len() > 9_000, "{}", coupled.len());

    for event in ["e_cmd_watchdog", "e_overspeed", "e_torque_sat", "e_calibration_failed", "e_controller_lost"] {
        assert!(!bench.heard(event), "{event}");
    }

    bench.all(&["disable_copying"]);
    bench.unprobe();
    bench.all(DOWN);
    assert!(bench.system.is_empty());
    assert!(!bench.heard("e_arm_dropped") && !bench.heard("e_motion_blocked"));
}

#[test]
fn engaging_does_not_jerk() {
    let mut bench = Bench::engaged("youbot_arm");
    bench.run(1.0);
    let rows = bench.rows();
    let step = rows.windows(2).map(|w| (w[1].force - w[0].force).norm()).fold(0.0, f64::max);
    let first: Vec<f64> = rows.iter().map(|r| r.force.norm()).skip_while(|f| *f == 0.0).take(300).collect();
    assert!(step < 0.5, "{step} N from one update to the next");
    assert!(!first.is_empty() && first.iter().all(|f| *f <= 2.0), "{:?}", first.iter().copied().fold(0.0, f64::max));
}

fn sway(prepare: impl Fn(&mut Bench)) -> (f64, f64, Vec<Row>) {
    let mut bench = Bench::engaged("youbot_arm");
    prepare(&mut bench);
    bench.rows();
    bench.set("Operator", "script", "sway 60 0.042 0.042 0 0.15");
    bench.run(20.0);
    let rows = bench.rows();
    (rms(error(&rows)) * 1e3, rms(rows.iter().map(|r| r.hand.norm())), rows)
}

#[test]
fn the_other_robot_follows() {
    let (error, hand, rows) = sway(|_| ());
    assert!(error <= 25.0 && hand <= 8.0, "{error} mm, {hand} N");
    assert!(rows.iter().all(|r| r.saturated == 0));
    let (error, _, rows) = sway(|bench| {
        bench.apply("profile_stiff");
        bench.set("Peer", "stiffness", 300.0);
    });
    assert!(error <= 12.0, "{error} mm at 300 N/m");
    assert!(rows.iter().all(|r| r.saturated == 0));
}

#[test]
fn with_the_base_it_follows_closer() {
    let (error, hand, rows) = sway(|bench| {
        bench.apply("eight_DOF");
        bench.set("Peer", "force_gain", Value::floats(&[0.1; 3]));
    });
    assert!(error <= 12.0 && hand <= 8.0, "{error} mm, {hand} N");
    assert!(rows.iter().all(|r| r.saturated == 0));
    let moved = rows.iter().map(|r| r.base.x.hypot(r.base.y)).fold(0.0, f64::max);
    assert!(moved > 0.02, "the base moved {moved} m");
}

#[test]
fn a_cut_link_lets_go_by_itself_and_the_arm_stays_up() {
    let mut bench = Bench::engaged("youbot_arm");
    bench.set("Operator", "script", "sway 60 0.042 0.042 0 0.15");
    bench.run(2.0);
    bench.rows();
    let cut = bench.now();
    bench.set("Peer", "cut", true);
    let lost = bench.wait("e_link_lost", 1.0);
    assert!(lost - cut <= 0.12, "lost after {} s", lost - cut);
    bench.set("Operator", "script", "");
    bench.run(1.0);
    let rows = bench.rows();
    // Nobody wrote ext_ref_mode: it is the controller alone that lets go.
    let late = rows.iter().filter(|r| r.t > cut + 0.2).map(|r| r.force.norm()).fold(0.0, f64::max);
    assert!(late < 0.1, "{late} N");
    let at = rows.iter().find(|r| r.t >= cut + 0.3).unwrap().tool.z;
    assert!(rows.iter().filter(|r| r.t > cut + 0.3).all(|r| (r.tool.z - at).abs() < 0.02));
    bench.set("Peer", "cut", false);
    let healed = bench.now();
    let good = bench.wait("e_qos_ok", 3.0);
    assert!(good - healed >= 1.0, "good again after {} s", good - healed);
}

#[test]
fn a_slow_link_is_degraded_and_a_very_slow_one_lost() {
    let mut bench = Bench::engaged("youbot_arm");
    bench.run(0.5);
    let t = bench.now();
    bench.set("Peer", "delay", 0.05);
    assert!(bench.wait("e_qos_degraded", 1.0) - t <= 0.15);
    bench.run(0.5);
    assert!(!bench.since(t).iter().any(|(_, e)| e == "e_link_lost"), "{:?}", bench.since(t));
    bench.set("Peer", "delay", 0.005);
    bench.wait("e_qos_restored", 3.0);
    let t = bench.now();
    bench.set("Peer", "delay", 0.15);
    assert!(bench.wait("e_link_lost", 1.0) - t <= 0.25);
    let mut bench = Bench::engaged("youbot_arm");
    bench.set("Peer", "loss", 0.3);
    bench.wait("e_qos_degraded", 2.0);
}

#[test]
fn a_spike_is_bounded_and_told() {
    let mut bench = Bench::engaged("youbot_arm");
    bench.run(0.5);
    bench.rows();
    let t = bench.now();
    bench.set("Peer", "jump", Value::floats(&[0.0, 0.3, 0.0]));
    assert!(bench.wait("e_force_spike", 0.5) - t <= 0.03);
    bench.run(0.2);
    let most = bench.rows().iter().map(|r| r.force.norm()).fold(0.0, f64::max);
    assert!(most <= 10.5, "{most} N");
}

#[test]
fn without_its_controller_the_arm_is_carried_on() {
    let mut bench = Bench::engaged("youbot_arm");
    bench.run(0.5);
    bench.rows();
    let t = bench.now();
    bench.state("Cart_Impedance", Transition::Stop);
    assert!(bench.wait("e_controller_lost", 1.0) - t <= 0.06);
    bench.run(1.0);
    let rows = bench.rows();
    assert!(rows.iter().all(|r| r.mode == 6 && (r.tool.z - rows[0].tool.z).abs() < 0.02));
    bench.state("Cart_Impedance", Transition::Start);
    bench.run(0.3);
    let force = bench.rows().last().unwrap().force.norm();
    assert!(force < 2.0, "{force} N right after it came back");
}

#[test]
fn without_torques_the_drives_hold() {
    let mut bench = Bench::up("youbot_arm");
    bench.run(0.5);
    bench.rows();
    let t = bench.now();
    bench.state("Dynamics", Transition::Stop);
    assert!(bench.wait("e_cmd_watchdog", 1.0) - t <= 0.03);
    bench.run(1.0);
    let rows = bench.rows();
    assert_eq!(rows.last().unwrap().mode, 1);
    let sunk = rows.iter().map(|r| (r.tool - rows[0].tool).norm()).fold(0.0, f64::max);
    assert!(sunk < 0.01, "{sunk} m");
}

#[test]
fn stopping_an_arm_that_is_not_parked_drops_it() {
    let mut bench = Bench::up("youbot_arm");
    bench.state("youbot", Transition::Stop);
    assert!(bench.heard("e_arm_dropped"));
    // The world goes on without the driver, and shows it.
    assert!(!bench.heard("e_arm_fell"));
    let told = bench.now();
    let fell = bench.wait("e_arm_fell", 1.0) - told;
    assert!(fell > 0.05, "in no time: {fell} s");
}

/// A world that is not heard any more is a field bus that has failed.
#[test]
fn without_its_world_the_driver_tells_that_the_bus_has_failed() {
    let mut bench = Bench::up("youbot_arm");
    let t = bench.now();
    let silent = davit::model::MemberRef {
        component: davit::model::ComponentName::new("World").unwrap(),
        member: davit::model::Ident::new("robot1_state").unwrap(),
    };
    let heard = davit::model::MemberRef {
        component: davit::model::ComponentName::new("youbot").unwrap(),
        member: davit::model::Ident::new("plant_state").unwrap(),
    };
    bench.step(&davit::model::Step::Disconnect { from: silent, to: heard }, Duration::from_secs(1));
    assert!(bench.wait("e_EC_TIMEOUT", 0.1) - t <= 0.022);
}

#[test]
fn the_driver_refuses_what_would_hurt() {
    let mut bench = Bench::up("youbot_arm");
    let failed = |outcome: Outcome| matches!(outcome, Outcome::NotDone(_));
    assert!(failed(bench.call(("youbot", "fold"), vec![])), "folding while torques are taken");
    assert!(failed(bench.call(("youbot", "start_calibration"), vec![])));
    assert!(failed(bench.call(("youbot", "setControlMode"), vec![Value::Int(3)])));
    bench.apply("hold");
    assert!(matches!(bench.call(("youbot", "fold"), vec![]), Outcome::Done(_)));
}

#[test]
fn a_motion_that_is_given_up_ends_where_it_is() {
    let mut bench = Bench::up("youbot_arm");
    bench.apply("hold");
    for operation in ["fold", "unfold"] {
        bench.rows();
        let moving = bench.begin(("youbot", operation));
        bench.run(1.0);
        let told = bench.now();
        bench.give_up(("youbot", operation));
        let (outcome, at) = moving.recv_deadline(bench.clock.now() + Duration::from_secs(10)).expect("an answer");
        assert_eq!(outcome, Outcome::Done(None), "{operation} counts as done half way");
        assert!(at.as_secs_f64() - told < 0.005, "{operation}: {} s", at.as_secs_f64() - told);
        // The drives listen again at once, and hold.
        assert!(matches!(bench.call(("youbot", "setControlMode"), vec![Value::Int(1)]), Outcome::Done(_)));
        bench.run(1.0);
        let rows = bench.rows();
        let speed = |w: &[Row]| (w[1].tool - w[0].tool).norm() / (w[1].t - w[0].t);
        let before = rows.windows(2).filter(|w| w[1].t < told).map(speed).fold(0.0, f64::max);
        let after = rows.windows(2).filter(|w| w[0].t > told + 0.3).map(speed).fold(0.0, f64::max);
        assert!(before > 0.05, "{operation} was under way at {before} m/s");
        assert!(after < 0.02, "{operation}: {after} m/s after 0.3 s");
        assert_eq!(rows.last().unwrap().mode, 1);
        assert!(!bench.since(told).iter().any(|(_, e)| e == "e_arrived" || e == "e_arm_dropped"));
    }
    // And it goes on from there when it is asked to.
    assert!(matches!(bench.call(("youbot", "fold"), vec![]), Outcome::Done(_)));
}

#[test]
fn faults_of_the_drives_are_told_and_the_arm_is_held() {
    for (fault, event) in [
        ("overcurrent", "e_OVERCURRENT"),
        ("undervoltage", "e_UNDERVOLTAGE"),
        ("overtemp", "e_OVERTEMP"),
        ("hall", "e_HALL_ERR"),
        ("encoder", "e_ENCODER_ERR"),
        ("sine_comm", "e_SINE_COMM_INIT_ERR"),
        ("emergency", "e_EMERGENCY_STOP"),
        ("ec_timeout", "e_EC_TIMEOUT"),
        ("i2t", "e_I2T_EXCEEDED"),
    ] {
        let mut bench = Bench::up("youbot_arm");
        bench.run(0.2);
        bench.rows();
        bench.set("youbot", "comm_fault", fault);
        bench.wait(event, 0.1);
        bench.run(0.5);
        let rows = bench.rows();
        assert!((rows.last().unwrap().tool - rows[0].tool).norm() < 0.01 && rows.last().unwrap().mode == 1);
    }
}

/// With nobody touching anything, the coupling gives no more energy than its spring held.
#[test]
fn the_coupling_is_passive() {
    let mut bench = Bench::engaged("youbot_arm");
    bench.apply("disable_copying");
    bench.set("Operator", "script", "go 1 0.05 0.05 0; hold 0.5");
    bench.run(2.0);
    bench.rows();
    bench.apply("enable_copying");
    bench.run(5.0);
    let rows = bench.rows();
    let stored = 0.5 * 150.0 * error(&rows).next().unwrap().powi(2);
    let work: f64 = rows.windows(2).map(|w| w[0].force.dot(&(w[1].tool - w[0].tool))).sum();
    assert!(stored > 0.1, "{stored} J");
    assert!(work <= stored, "{work} J of {stored} J");
}

#[test]
fn the_control_loop_allocates_nothing() {
    let mut bench = Bench::engaged_in_threads("youbot_arm");
    bench.apply("eight_DOF");
    bench.set("Operator", "script", "sway 60 0.042 0.042 0 0.15");
    bench.run(0.5);
    bench.rows();
    bench.run(5.0);
    let rows = bench.rows();
    assert!(rows.len() > 4_900);
    // The rows up to the last one: handing them over is the probe's own doing.
    let (first, last) = (&rows[10], &rows[rows.len() - 2]);
    assert_eq!(last.requests - first.requests, 0, "requests in {} updates", rows.len());
}

#[test]
fn the_same_run_twice_is_the_same() {
    let run = || {
        let mut bench = Bench::engaged("youbot_arm");
        bench.run(1.0);
        let rows = bench.rows();
        let last = rows.last().unwrap();
        (rows.len(), last.tool, last.joints.eff.map(f64::to_bits), bench.events())
    };
    assert_eq!(run(), run());
}

/// That nobody watches is told as long as it lasts: who did not hear it at first hears it then.
#[test]
fn that_nobody_watches_is_told_again() {
    let mut bench = Bench::up("youbot_arm");
    bench.state("Monitors", Transition::Stop);
    let t = bench.now();
    bench.run(1.2);
    let told = bench.since(t).iter().filter(|(_, event)| event == "e_watch_lost").count();
    assert_eq!(told, 3);
}
