//! What the drives are at by themselves: a motion from one pose to another, or looking for the stops.

use super::{DriveHappening, DriveMode, Drives, JOINTS, RANGE_LOWER_DEG, RANGE_UPPER_DEG};
use crate::libraries::youbot::rigid_body::J5;

/// Peak joint speed of folding and unfolding, in rad/s.
const MOTION_SPEED: f64 = 1.2;
/// How close to its end a motion must come, in rad, and how much later than planned, in s.
const ARRIVAL_ERROR: f64 = 0.03;
const ARRIVAL_TIME: f64 = 3.0;
/// An arm so far behind where it should be, in rad, for so long, in s, has met something: all variants of the robot (`tests/youbot/variants.rs`) unfold
/// without being taken for that.
const BLOCKED_ERROR: f64 = 0.1;
const BLOCKED_TIME: f64 = 0.2;
/// Speed at which calibration looks for the stops, in rad/s.
const CALIBRATION_SPEED: f64 = 0.3;
/// A calibration that has not found the stops by then has failed, in s.
const CALIBRATION_TIME: f64 = 9.0;
/// Error of position that means a stop was met, in rad (with the gains of position control, 1 to 4 N m).
const CONTACT_ERROR: f64 = 0.01;
/// Joints that calibration moves against their stops, and which way. Joints 1 and 5 have index marks.
const CALIBRATION_WAY: [f64; JOINTS] = [0.0, -1.0, 1.0, -1.0, 0.0];

#[derive(Debug, Clone, Copy)]
pub(super) enum DriveTask {
    Idle,
    Moving {
        from: J5,
        to: J5,
        elapsed: f64,
        duration: f64,
        /// For how long the arm has been too far behind.
        behind: f64,
        /// It goes back: something was in the way.
        fails: bool,
    },
    Calibrating {
        elapsed: f64,
        met: [bool; JOINTS],
    },
}

impl DriveTask {
    fn moving(from: J5, to: J5, fails: bool) -> Self {
        // A quintic's peak speed is 15/8 of its mean.
        let duration = ((to - from).amax() / MOTION_SPEED * 1.875).max(0.2);
        Self::Moving { from, to, elapsed: 0.0, duration, behind: 0.0, fails }
    }

    pub(super) fn calibrating() -> Self {
        Self::Calibrating { elapsed: 0.0, met: CALIBRATION_WAY.map(|way| way == 0.0) }
    }
}

impl Drives {
    pub(super) fn go(&mut self, to: J5) -> Result<(), &'static str> {
        if self.busy() {
            return Err("a motion is under way");
        }
        if self.mode == DriveMode::Torque {
            return Err("the drives take torques: set mode 1 first");
        }
        if !self.calibrated {
            return Err("not calibrated");
        }
        self.hold();
        self.resumes = false;
        self.task = DriveTask::moving(self.measured.q, to, false);
        Ok(())
    }

    pub(super) fn advance_task(&mut self, dt: f64, report: &mut impl FnMut(DriveHappening)) {
        match &mut self.task {
            DriveTask::Idle => self.come_to_rest(dt),
            DriveTask::Moving { from, to, elapsed, duration, behind, fails } => {
                *elapsed += dt;
                let s = (*elapsed / *duration).min(1.0);
                let way = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
                let speed = 30.0 * s * s * (1.0 - 2.0 * s + s * s) / *duration;
                self.target = *from + (*to - *from) * way;
                self.target_speed = (*to - *from) * speed;
                let (from, to, over, fails) = (*from, *to, *elapsed - *duration, *fails);
                *behind = if (self.target - self.measured.q).amax() > BLOCKED_ERROR { *behind + dt } else { 0.0 };
                let blocked = over > ARRIVAL_TIME || *behind > BLOCKED_TIME;
                if over >= 0.0 {
                    self.target_speed = J5::zeros();
                }
                // The motion has ended when the arm is there, not when it should be.
                if over >= 0.0 && (self.measured.q - to).amax() < ARRIVAL_ERROR {
                    self.task = DriveTask::Idle;
                    report(if fails { DriveHappening::MotionFailed } else { DriveHappening::Arrived });
                } else if blocked && fails {
                    self.hold();
                    report(DriveHappening::MotionFailed);
                } else if blocked {
                    // What fails has not happened: it goes back to where it began, and presses on nothing.
                    self.hold();
                    self.task = DriveTask::moving(self.measured.q, from, true);
                }
            }
            DriveTask::Calibrating { elapsed, met } => {
                *elapsed += dt;
                for i in 0..JOINTS {
                    if met[i] {
                        continue;
                    }
                    self.target[i] += CALIBRATION_WAY[i] * CALIBRATION_SPEED * dt;
                    // Behind its target and standing: something is in the way.
                    let behind = (self.target[i] - self.measured.q[i]) * CALIBRATION_WAY[i];
                    met[i] = behind > CONTACT_ERROR && self.measured.qd[i].abs() < 0.1 * CALIBRATION_SPEED;
                }
                if met.iter().all(|m| *m) {
                    self.task = DriveTask::Idle;
                    let found = (1..4).all(|i| self.is_at_stop(i));
                    self.mode = if found { DriveMode::MotorStop } else { DriveMode::Positioning };
                    self.handover.begin();
                    self.calibrated = found;
                    report(if found { DriveHappening::Calibrated } else { DriveHappening::CalibrationFailed });
                } else if *elapsed > CALIBRATION_TIME {
                    self.hold();
                    report(DriveHappening::CalibrationFailed);
                }
            }
        }
    }

    fn is_at_stop(&self, i: usize) -> bool {
        let stop = if CALIBRATION_WAY[i] < 0.0 { RANGE_LOWER_DEG[i] } else { RANGE_UPPER_DEG[i] };
        (self.measured.q[i] - stop.to_radians()).abs() < 0.02
    }
}
