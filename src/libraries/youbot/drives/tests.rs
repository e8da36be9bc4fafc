//! What the drives do, without a component around them.

use super::super::motors::Encoders;
use super::super::parameters::SPEED_LIMIT;
use super::super::world::RobotBody;
use super::*;
use nalgebra::Vector3;

/// Drives with what they drive.
struct Driving {
    drives: Drives,
    body: RobotBody,
}

impl std::ops::Deref for Driving {
    type Target = Drives;
    fn deref(&self) -> &Drives {
        &self.drives
    }
}

impl std::ops::DerefMut for Driving {
    fn deref_mut(&mut self) -> &mut Drives {
        &mut self.drives
    }
}

impl Driving {
    fn new(degrees: [f64; JOINTS], mass: f64) -> Self {
        Self { drives: Drives::new(radians(degrees)), body: RobotBody::new(radians(degrees), mass) }
    }

    /// One update, a `push` on the tool meanwhile.
    fn update(
        &mut self,
        effort: Option<(J5, f64)>,
        twist: Option<(Twist2, f64)>,
        push: &Vector3<f64>,
        dt: f64,
        report: &mut impl FnMut(DriveHappening),
    ) {
        let measured = Measured { q: self.body.arm.q, qd: self.body.arm.qd, base: self.body.base.twist };
        let driven = self.drives.update(measured, effort, twist, dt, report);
        self.body.advance(&driven.torque, driven.twist, push, driven.braked, dt);
    }

    /// Switched off; how far the tool comes down, in m.
    fn sinks(&mut self) -> f64 {
        let (before, carried) = (self.body.tool().position.z, self.drives.switch_off());
        for _ in 0..1000 {
            self.body.advance(&J5::zeros(), Twist2::default(), &Vector3::zeros(), true, 0.001);
        }
        let sank = before - self.body.tool().position.z;
        assert_eq!(carried, sank < 0.02, "{sank} m");
        sank
    }
}

fn run(drives: &mut Driving, seconds: f64) -> Vec<DriveHappening> {
    let mut seen = Vec::new();
    for _ in 0..(seconds * 1000.0) as usize {
        drives.update(None, None, &Vector3::zeros(), 0.001, &mut |h| seen.push(h));
    }
    seen
}

fn parked() -> Driving {
    Driving::new([0.0, -60.0, 140.0, -98.0, 0.0], 1.0)
}

#[test]
fn calibrate_unfold_fold_and_rest() {
    let mut drives = parked();
    assert!(drives.unfold().is_err() && drives.set_mode(DriveMode::Torque).is_err());
    drives.calibrate().unwrap();
    assert!(drives.calibrate().is_err() && drives.set_mode(DriveMode::MotorStop).is_err());
    let seen = run(&mut drives, 3.0);
    assert!(seen.contains(&DriveHappening::Calibrated), "{seen:?} {}", drives.body.arm.q);
    let rested = drives.body.arm.posture().tool;
    run(&mut drives, 1.0);
    assert!((drives.body.arm.posture().tool - rested).norm() < 0.005);

    drives.unfold().unwrap();
    let seen = run(&mut drives, 6.0);
    assert!(seen.contains(&DriveHappening::Arrived) && seen.contains(&DriveHappening::SoftLimitExit), "{seen:?}");
    assert!((drives.body.arm.q - radians(WORKING_POSE_DEG)).norm() < 0.01, "{}", drives.body.arm.q);
    drives.fold().unwrap();
    run(&mut drives, 6.0);
    assert!(drives.sinks() < 0.02);
}

#[test]
fn unparked_it_falls_and_without_commands_it_holds() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    let at = drives.body.arm.q;
    drives.set_mode(DriveMode::Torque).unwrap();
    let seen = run(&mut drives, 1.0);
    assert_eq!(seen, [DriveHappening::CommandWatchdog]);
    assert!((drives.body.arm.q - at).norm() < 0.01 && drives.mode() == DriveMode::Positioning);
    assert!(drives.sinks() > 0.03);
}

#[test]
fn a_motion_that_is_held_up_fails_and_the_arm_stays() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.body.arm.friction_scale = 1e6;
    drives.unfold().unwrap();
    assert!(run(&mut drives, 10.0).contains(&DriveHappening::MotionFailed));
    assert!(drives.mode() == DriveMode::Positioning && !drives.busy());
}

#[test]
fn a_motion_that_meets_something_goes_back_before_it_fails() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    let start = drives.body.arm.q;
    drives.unfold().unwrap();
    run(&mut drives, 1.5);
    let there = drives.body.arm.q;
    assert!((there - start).amax() > 0.3, "it is well on its way");
    // For a moment it cannot get on, and it is not pressed for longer than that takes to be noticed.
    drives.body.arm.friction_scale = 1e6;
    assert!(run(&mut drives, 0.5).is_empty(), "it has not failed yet");
    drives.body.arm.friction_scale = 1.0;
    assert_eq!(run(&mut drives, 4.0), [DriveHappening::MotionFailed]);
    assert!((drives.body.arm.q - start).amax() < 0.03, "it is where it began: {}", drives.body.arm.q - start);
    assert!(drives.mode() == DriveMode::Positioning && !drives.busy());
}

#[test]
fn something_in_the_way_is_no_stop() {
    let mut drives = parked();
    drives.body.arm.q = radians([0.0, 0.0, 60.0, 0.0, 0.0]);
    // So heavy a friction that the joints do not move is taken for a stop, and refused as one.
    drives.body.arm.friction_scale = 1e6;
    drives.calibrate().unwrap();
    assert_eq!(run(&mut drives, 10.0), [DriveHappening::CalibrationFailed]);
    assert!(!drives.calibrated());
}

/// The largest change of a joint's torque from one update to the next, in N m, while `seconds` pass.
fn jolt(drives: &mut Driving, effort: Option<J5>, seconds: f64) -> f64 {
    let (mut last, mut most) = (drives.torque, 0.0_f64);
    for _ in 0..(seconds * 1000.0) as usize {
        drives.update(effort.map(|e| (e, 0.0)), None, &Vector3::zeros(), 0.001, &mut |_| ());
        most = most.max((drives.torque - last).amax());
        last = drives.torque;
    }
    most
}

#[test]
fn no_switch_of_modes_is_felt() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    assert!(jolt(&mut drives, None, 0.5) < 0.5 && !drives.busy());
    drives.unfold().unwrap();
    assert!(jolt(&mut drives, None, 1.5) < 0.5);
    // In the middle of a fast motion.
    assert!(drives.body.arm.qd.amax() > 0.8, "{}", drives.body.arm.qd);
    drives.brake();
    assert!(jolt(&mut drives, None, 1.0) < 0.5);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    let carried = drives.body.arm.model.gravity(&drives.body.arm.posture()) + J5::from([0.9, -0.9, 0.5, 0.2, 0.1]);
    drives.set_mode(DriveMode::Torque).unwrap();
    assert!(jolt(&mut drives, Some(carried), 0.3) < 0.5);
    drives.set_mode(DriveMode::Positioning).unwrap();
    assert!(jolt(&mut drives, None, 0.5) < 0.5);
    drives.fold().unwrap();
    assert!(jolt(&mut drives, None, 6.0) < 0.5);
    drives.set_mode(DriveMode::MotorStop).unwrap();
    assert!(jolt(&mut drives, None, 0.5) < 0.5 && drives.torque == J5::zeros());
}

#[test]
fn braking_brings_a_moving_arm_and_its_base_to_rest() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    drives.set_mode(DriveMode::Torque).unwrap();
    drives.body.arm.qd = J5::from([1.5, -1.0, 1.2, -1.5, 0.5]);
    drives.measured.qd = drives.body.arm.qd;
    drives.body.base.twist = Twist2 { vx: 0.3, vy: -0.2, wz: 0.3 };
    drives.brake();
    let twist = Some((Twist2 { vx: 0.3, vy: -0.2, wz: 0.3 }, 0.0));
    let mut fastest: f64 = 0.0;
    for _ in 0..300 {
        drives.update(None, twist, &Vector3::zeros(), 0.001, &mut |_| ());
        fastest = fastest.max(drives.body.arm.qd.amax());
    }
    let base = drives.body.base.twist;
    assert!(drives.body.arm.qd.amax() < 0.03 && fastest < 1.571, "{} {fastest}", drives.body.arm.qd);
    assert!(base.vx.abs() < 0.016 && base.vy.abs() < 0.016, "the base goes on: {base:?}");
    assert!(drives.mode() == DriveMode::Positioning && !drives.busy());
    // Let go of, they take torques again, because they did; after a hold that was asked for they do not.
    drives.release();
    assert_eq!(drives.mode(), DriveMode::Torque);
    drives.brake();
    drives.set_mode(DriveMode::Positioning).unwrap();
    drives.release();
    assert_eq!(drives.mode(), DriveMode::Positioning);
    // Drives that went off hold an arm that sinks since, and stay off where they do not know where it is.
    drives.set_mode(DriveMode::MotorStop).unwrap();
    drives.brake();
    assert_eq!(drives.mode(), DriveMode::Positioning);
    let mut unknown = parked();
    unknown.brake();
    assert_eq!(unknown.mode(), DriveMode::MotorStop);
}

/// Asked to brake again and again, drives that hold an arm under a load do not give way to it.
#[test]
fn what_is_held_stays_where_it_is() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    let pushed = |drives: &mut Driving| {
        for _ in 0..50 {
            drives.update(None, None, &Vector3::new(0.0, 0.0, -5.0), 0.001, &mut |_| ());
        }
    };
    (0..10).for_each(|_| pushed(&mut drives));
    let held = drives.body.arm.q;
    for _ in 0..20 {
        drives.brake();
        pushed(&mut drives);
    }
    let gave_way = (drives.body.arm.q - held).amax();
    assert!(gave_way < 0.002, "{gave_way} rad");
}

/// What the joints may be like: friction and masses, as multiples of the nominal ones.
const JOINTS_MAY_BE: [(f64, f64); 6] = [(1.0, 1.0), (0.0, 1.0), (3.0, 1.0), (1.0, 0.5), (1.0, 1.3), (0.0, 1.3)];

fn parked_with((friction, mass): (f64, f64)) -> Driving {
    let mut drives = Driving::new([0.0, -64.5, 145.5, -102.0, 0.0], mass);
    drives.body.arm.friction_scale = friction;
    drives
}

/// Stopped at any time of a calibration, that of the reversal at the stops too; let alone, it finds them.
#[test]
fn a_calibration_is_stopped_without_a_jolt() {
    for joints in JOINTS_MAY_BE {
        for at in 0..30 {
            let mut drives = parked_with(joints);
            drives.calibrate().unwrap();
            let before = jolt(&mut drives, None, 0.005 * f64::from(at));
            drives.brake();
            let most = before.max(jolt(&mut drives, None, 0.3));
            assert!(most < 0.5, "{joints:?}: {most} N m in 1 ms, stopped after {at} times 5 ms");
            assert!(drives.body.arm.qd.amax() < 0.01, "{joints:?}: {}", drives.body.arm.qd);
        }
        let mut drives = parked_with(joints);
        drives.calibrate().unwrap();
        assert!(jolt(&mut drives, None, 1.0) < 0.5 && drives.calibrated(), "{joints:?}");
    }
}

/// Pushed with 40 N as long as they take torques, the drives hold the joints back; told that they are too fast they brake, and they
/// let go again.
#[test]
fn what_holds_a_pushed_arm_back_comes_by_a_ramp() {
    for joints in JOINTS_MAY_BE {
        for push in [[0.0, 40.0, 0.0], [40.0, 0.0, 0.0], [-40.0, 0.0, 0.0], [0.0, 0.0, 40.0], [0.0, 0.0, -40.0]] {
            let mut drives = parked_with(joints);
            drives.calibrate().unwrap();
            run(&mut drives, 1.0);
            drives.unfold().unwrap();
            assert!(jolt(&mut drives, None, 6.0) < 0.5 && !drives.busy(), "{joints:?}");
            drives.set_mode(DriveMode::Torque).unwrap();
            let (mut last, mut most, mut fastest, mut braked) = (drives.torque, 0.0_f64, 0.0_f64, usize::MAX);
            for ms in 0..2000 {
                let carried = drives.body.arm.model.gravity(&drives.body.arm.posture());
                if ms == braked {
                    drives.brake();
                } else if ms == 1500 {
                    drives.release();
                }
                let push = if ms < braked { Vector3::from(push) } else { Vector3::zeros() };
                drives.update(Some((carried, 0.0)), None, &push, 0.001, &mut |_| ());
                most = most.max((drives.torque - last).amax());
                last = drives.torque;
                if drives.body.arm.qd.amax() > 1.5 || ms == 500 {
                    braked = braked.min(ms + 5);
                }
                if ms >= braked.saturating_add(300) {
                    fastest = fastest.max((drives.body.arm.posture().jacobian() * drives.body.arm.qd).norm());
                }
            }
            assert!(most < 0.5, "{joints:?}, {push:?}: {most} N m in 1 ms");
            // A joint without friction, pushed by more than its drive gives, may take longer.
            assert!(joints.0 == 0.0 || fastest < 0.02, "{joints:?}, {push:?}: {fastest} m/s 0.3 s after it braked");
        }
    }
}

/// In contact it presses with next to nothing, whatever rolls out under it, straight on or along, and wherever it was pressed in to.
#[test]
fn a_stop_does_not_drive_on_into_what_it_meets() {
    for (along, later) in [(0.0, 0), (0.12, 0), (0.0, 20), (0.12, 20), (0.12, 100)] {
        let mut drives = up();
        let effort = |drives: &Driving| drives.body.arm.model.gravity(&drives.body.arm.posture());
        drives.set_mode(DriveMode::Torque).unwrap();
        drives.body.surroundings.wall = drives.body.tool().position.x + 0.005;
        // The base takes the arm along, and goes on for a while when it is stopped.
        let rolls = Twist2 { vx: 0.1, vy: along, ..Twist2::default() };
        let mut met = None;
        for tick in 0..1000 {
            let effort = effort(&drives);
            drives.update(Some((effort, 0.0)), Some((rolls, 0.0)), &Vector3::zeros(), 0.001, &mut |_| ());
            met = met.or_else(|| (drives.body.contact.norm() > 1.0).then_some(tick));
            if met.is_some_and(|met| tick == met + later) {
                break;
            }
        }
        assert!(met.is_some(), "it meets the wall");
        drives.brake();
        let mut most: f64 = 0.0;
        for tick in 0..2000 {
            drives.update(None, None, &Vector3::zeros(), 0.001, &mut |_| ());
            if tick >= 300 {
                most = most.max(drives.body.contact.norm());
            }
        }
        assert!(most < 5.0, "{most} N, {later} ms later, along with {along} m/s");
    }
}

/// Whatever was asked of drives that were off, their torques begin from none.
#[test]
fn behind_a_loss_of_power_torques_begin_from_none() {
    let mut drives = up();
    assert!(drives.torque.amax() > 2.0, "it carries the arm: {}", drives.torque);
    for _ in 0..200 {
        drives.body.advance(&J5::zeros(), Twist2::default(), &Vector3::zeros(), true, 0.001);
    }
    let measured = Measured { q: drives.body.arm.q, qd: drives.body.arm.qd, ..Measured::default() };
    drives.lose_power(measured);
    drives.hold();
    let mut last = J5::zeros();
    for tick in 0..1000 {
        drives.update(None, None, &Vector3::zeros(), 0.001, &mut |_| ());
        assert!((drives.torque - last).amax() <= 0.5, "{tick} ms: {last} {}", drives.torque);
        last = drives.torque;
    }
    assert!((drives.body.arm.q - measured.q).amax() < 0.05, "{} {}", drives.body.arm.q, measured.q);
    assert!(drives.body.arm.qd.amax() < 1e-3);
}

/// Unfolded, held by itself.
fn up() -> Driving {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    drives
}

/// Unfolds an arm as it may be, with a `push` on the tool meanwhile; what was found of it.
fn unfolded(mass: f64, friction: f64, push: Vector3<f64>) -> Option<ArmScales> {
    let mut drives = Driving::new([0.0, -60.0, 140.0, -98.0, 0.0], mass);
    (drives.body.arm.friction_scale, drives.body.torque_lag) = (friction, 0.002);
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    assert_eq!(drives.identified(), None, "calibrating tells nothing");
    drives.unfold().unwrap();
    let mut encoders = Encoders::default();
    let mut heard = Vec::new();
    for _ in 0..6000 {
        let (q, qd) = encoders.read(&drives.body.arm.q, 0.001);
        let measured = Measured { q, qd, base: Twist2::default() };
        let driven = drives.drives.update(measured, None, None, 0.001, &mut |what| heard.push(what));
        drives.body.advance(&driven.torque, driven.twist, &push, driven.braked, 0.001);
    }
    let told = |what| heard.contains(&what);
    let arrived = told(DriveHappening::Arrived);
    assert_eq!(told(DriveHappening::NotIdentified), arrived && drives.identified().is_none(), "{heard:?}");
    drives.identified()
}

#[test]
fn unfolding_tells_what_the_arm_weighs_and_how_it_rubs() {
    for mass in [0.9, 1.0, 1.1] {
        for friction in [0.7, 1.0, 1.3] {
            let found = unfolded(mass, friction, Vector3::zeros()).expect("it tells");
            assert!((found.mass - mass).abs() < 0.005, "{mass} {friction}: {found:?}");
            assert!((found.friction - friction).abs() < 0.01, "{mass} {friction}: {found:?}");
        }
    }
}

#[test]
fn an_arm_that_somebody_moves_meanwhile_tells_nothing() {
    let ways = [Vector3::x(), -Vector3::x(), Vector3::y(), Vector3::z(), -Vector3::z()];
    for push in ways.iter().flat_map(|way| [1.0, 2.0, 4.0, 8.0].map(|newtons| way * newtons)) {
        let found = unfolded(1.0, 1.0, push);
        // Across the plane in which the joints turn it is the others that hold it.
        let across = push.y != 0.0;
        let harmless = |arm: ArmScales| (arm.mass - 1.0).abs() < 0.005 && (arm.friction - 1.0).abs() < 0.01;
        assert!(if across { found.is_some_and(harmless) } else { found.is_none() }, "{push:?}: {found:?}");
    }
}

/// Something soft in the way of an unfolding tool, which the motion gets past.
#[test]
fn an_arm_that_brushes_past_something_soft_is_not_taken_for_another_one() {
    for (table, wall) in [(0.32, 100.0), (0.34, 100.0), (0.36, 100.0), (-100.0, 0.36), (-100.0, 0.34), (-100.0, 0.32)] {
        let mut drives = parked();
        drives.calibrate().unwrap();
        run(&mut drives, 3.0);
        (drives.body.surroundings.table, drives.body.surroundings.wall) = (table, wall);
        (drives.body.surroundings.stiffness, drives.body.surroundings.damping) = (60.0, 5.0);
        drives.unfold().unwrap();
        let mut pressed: f64 = 0.0;
        for _ in 0..6000 {
            drives.update(None, None, &Vector3::zeros(), 0.001, &mut |_| {});
            pressed = pressed.max(drives.body.contact.norm());
        }
        assert!(pressed > 1.0 && !drives.busy(), "{table} {wall}: {pressed} N");
        assert_eq!(drives.identified(), None, "{table} {wall}");
    }
}

#[test]
fn the_speed_limit_may_be_switched_off() {
    let fastest = |speed_limit: bool| {
        let mut drives = up();
        drives.set_mode(DriveMode::Torque).unwrap();
        drives.parameters.speed_limit = speed_limit;
        let mut fastest = 0.0_f64;
        for _ in 0..600 {
            let mut effort = drives.body.arm.model.gravity(&drives.body.arm.posture());
            effort[4] += 1.2;
            drives.update(Some((effort, 0.0)), None, &Vector3::zeros(), 0.001, &mut |_| {});
            fastest = fastest.max(drives.body.arm.qd[4]);
        }
        fastest
    };
    let (limited, free) = (fastest(true), fastest(false));
    assert!(limited < SPEED_LIMIT && limited > 1.2, "{limited} rad/s");
    assert!(free > 1.5 * SPEED_LIMIT, "{free} rad/s");
}

/// What asks for torques while they brake, as the way back of something that was stopped does, has them when that is taken back.
#[test]
fn who_brakes_takes_no_torques_before_that_is_taken_back() {
    let mut drives = Drives::new(radians(WORKING_POSE_DEG));
    drives.calibrated = true;
    for holds in [false, true] {
        drives.set_mode(if holds { DriveMode::Positioning } else { DriveMode::Torque }).unwrap();
        drives.brake();
        drives.set_mode(DriveMode::Torque).unwrap();
        assert_eq!(drives.mode(), DriveMode::Positioning);
        drives.release();
        assert_eq!(drives.mode(), DriveMode::Torque);
        drives.brake();
        drives.set_mode(DriveMode::Torque).unwrap();
        drives.set_mode(DriveMode::Positioning).unwrap();
        drives.release();
        assert_eq!(drives.mode(), DriveMode::Positioning, "the last word counts");
    }
}
