//! What the drives do, without a component around them.

use super::super::rigid_body::ArmModel;
use super::*;

fn run(drives: &mut Drives, seconds: f64) -> Vec<DriveHappening> {
    let mut seen = Vec::new();
    for _ in 0..(seconds * 1000.0) as usize {
        drives.update(None, None, &Vector3::zeros(), 0.001, &mut |h| seen.push(h));
    }
    seen
}

fn parked() -> Drives {
    Drives::new(ArmPlant::new(ArmModel::youbot(0.219, 1.0), radians([0.0, -60.0, 140.0, -98.0, 0.0])))
}

#[test]
fn calibrate_unfold_fold_and_rest() {
    let mut drives = parked();
    assert!(drives.unfold().is_err() && drives.set_mode(DriveMode::Torque).is_err());
    drives.calibrate().unwrap();
    assert!(drives.calibrate().is_err() && drives.set_mode(DriveMode::MotorStop).is_err());
    let seen = run(&mut drives, 3.0);
    assert!(seen.contains(&DriveHappening::Calibrated), "{seen:?} {}", drives.arm.q);
    let rested = drives.arm.posture().tool;
    run(&mut drives, 1.0);
    assert!((drives.arm.posture().tool - rested).norm() < 0.005);

    drives.unfold().unwrap();
    let seen = run(&mut drives, 6.0);
    assert!(seen.contains(&DriveHappening::Arrived) && seen.contains(&DriveHappening::SoftLimitExit), "{seen:?}");
    assert!((drives.arm.q - radians(WORKING_POSE_DEG)).norm() < 0.01, "{}", drives.arm.q);
    drives.fold().unwrap();
    run(&mut drives, 6.0);
    assert!(drives.switch_off() < 0.02);
}

#[test]
fn unparked_it_falls_and_without_commands_it_holds() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    let at = drives.arm.q;
    drives.set_mode(DriveMode::Torque).unwrap();
    let seen = run(&mut drives, 1.0);
    assert_eq!(seen, [DriveHappening::CommandWatchdog]);
    assert!((drives.arm.q - at).norm() < 0.01 && drives.mode() == DriveMode::Positioning);
    assert!(drives.switch_off() > 0.03);
}

#[test]
fn a_motion_that_is_held_up_fails_and_the_arm_stays() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.arm.friction_scale = 1e6;
    drives.unfold().unwrap();
    assert!(run(&mut drives, 10.0).contains(&DriveHappening::MotionFailed));
    assert!(drives.mode() == DriveMode::Positioning && !drives.busy());
}

#[test]
fn something_in_the_way_is_no_stop() {
    let mut drives = parked();
    drives.arm.q = radians([0.0, 0.0, 60.0, 0.0, 0.0]);
    // So heavy a friction that the joints do not move is taken for a stop, and refused as one.
    drives.arm.friction_scale = 1e6;
    drives.calibrate().unwrap();
    assert_eq!(run(&mut drives, 10.0), [DriveHappening::CalibrationFailed]);
    assert!(!drives.calibrated());
}

/// The largest change of a joint's torque from one update to the next, in N m, while `seconds` pass.
fn jolt(drives: &mut Drives, effort: Option<J5>, seconds: f64) -> f64 {
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
    assert!(drives.arm.qd.amax() > 0.8, "{}", drives.arm.qd);
    drives.brake();
    assert!(jolt(&mut drives, None, 1.0) < 0.5);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    let carried = drives.arm.model.gravity(&drives.arm.posture()) + J5::from([0.9, -0.9, 0.5, 0.2, 0.1]);
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
    drives.arm.qd = J5::from([1.5, -1.0, 1.2, -1.5, 0.5]);
    drives.base.twist = Twist2 { vx: 0.3, vy: -0.2, wz: 0.3 };
    drives.brake();
    let twist = Some((Twist2 { vx: 0.3, vy: -0.2, wz: 0.3 }, 0.0));
    let mut fastest: f64 = 0.0;
    for _ in 0..300 {
        drives.update(None, twist, &Vector3::zeros(), 0.001, &mut |_| ());
        fastest = fastest.max(drives.arm.qd.amax());
    }
    let base = drives.base.twist;
    assert!(drives.arm.qd.amax() < 0.03 && fastest < 1.571, "{} {fastest}", drives.arm.qd);
    assert!(base.vx.abs() < 0.016 && base.vy.abs() < 0.016, "the base goes on: {base:?}");
    assert!(drives.mode() == DriveMode::Positioning && !drives.busy());
    // Let go of, they take torques again, because they did; after a hold that was asked for they do not.
    drives.release();
    assert_eq!(drives.mode(), DriveMode::Torque);
    drives.brake();
    drives.set_mode(DriveMode::Positioning).unwrap();
    drives.release();
    assert_eq!(drives.mode(), DriveMode::Positioning);
    // Drives that are off stay off.
    drives.set_mode(DriveMode::MotorStop).unwrap();
    drives.brake();
    assert_eq!(drives.mode(), DriveMode::MotorStop);
}

/// Asked to brake again and again, drives that hold an arm under a load do not give way to it.
#[test]
fn what_is_held_stays_where_it_is() {
    let mut drives = parked();
    drives.calibrate().unwrap();
    run(&mut drives, 3.0);
    drives.unfold().unwrap();
    run(&mut drives, 6.0);
    let pushed = |drives: &mut Drives| {
        for _ in 0..50 {
            drives.update(None, None, &Vector3::new(0.0, 0.0, -5.0), 0.001, &mut |_| ());
        }
    };
    (0..10).for_each(|_| pushed(&mut drives));
    let held = drives.arm.q;
    for _ in 0..20 {
        drives.brake();
        pushed(&mut drives);
    }
    let gave_way = (drives.arm.q - held).amax();
    assert!(gave_way < 0.002, "{gave_way} rad");
}

/// What the joints may be like: friction and masses, as multiples of the nominal ones.
const JOINTS_MAY_BE: [(f64, f64); 6] = [(1.0, 1.0), (0.0, 1.0), (3.0, 1.0), (1.0, 0.5), (1.0, 1.3), (0.0, 1.3)];

fn parked_with((friction, mass): (f64, f64)) -> Drives {
    let mut drives =
        Drives::new(ArmPlant::new(ArmModel::youbot(0.219, mass), radians([0.0, -64.5, 145.5, -102.0, 0.0])));
    drives.arm.friction_scale = friction;
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
            assert!(drives.arm.qd.amax() < 0.01, "{joints:?}: {}", drives.arm.qd);
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
                let carried = drives.arm.model.gravity(&drives.arm.posture());
                if ms == braked {
                    drives.brake();
                } else if ms == 1500 {
                    drives.release();
                }
                let push = if ms < braked { Vector3::from(push) } else { Vector3::zeros() };
                drives.update(Some((carried, 0.0)), None, &push, 0.001, &mut |_| ());
                most = most.max((drives.torque - last).amax());
                last = drives.torque;
                if drives.arm.qd.amax() > 1.5 || ms == 500 {
                    braked = braked.min(ms + 5);
                }
                if ms >= braked.saturating_add(300) {
                    fastest = fastest.max((drives.arm.posture().jacobian() * drives.arm.qd).norm());
                }
            }
            assert!(most < 0.5, "{joints:?}, {push:?}: {most} N m in 1 ms");
            // A joint without friction, pushed by more than its drive gives, may take longer.
            assert!(joints.0 == 0.0 || fastest < 0.02, "{joints:?}, {push:?}: {fastest} m/s 0.3 s after it braked");
        }
    }
}
