//! What the drives are at by themselves: a motion from one pose to another, or looking for the stops.

use super::{DriveHappening, DriveMode, Drives, JOINTS, Measured, RANGE_LOWER_DEG, RANGE_UPPER_DEG};
use crate::libraries::youbot::rigid_body::J5;

/// Peak joint speed of folding and unfolding, in rad/s; of joint 4 a ninth more.
const MOTION_SPEED: f64 = 1.25;
/// Its peak acceleration, in rad/s²: it takes less torque than [`PRESSES`] leaves.
const MOTION_ACCELERATION: f64 = 2.0;
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

/// In which part of the time of a motion onto the stops each joint moves; from the stops it is the other way round. First the arm leans back,
/// which lifts the tool, then the tool swings up, and last the forearm lies down: a tool in front of the arm goes no farther out, where a wall
/// may be, and not down. All joints at once took it 3 to 6 cm farther out.
const PARTS: [(f64, f64); JOINTS] = [(0.0, 1.0), (0.0, 0.4), (0.4, 1.0), (0.1, 1.0), (0.0, 1.0)];
/// What position control gives at most beside what carries the arm while that moves, in N m: more than its friction takes of any variant of the
/// robot. Something in the way is pressed on with no more.
const PRESSES: J5 = J5::new(4.0, 4.2, 3.2, 1.5, 0.8);
/// As long as a joint gives all of that it may be slow; then it has met something, in s.
const PRESSED_TIME: f64 = 0.12;
/// For a base that rolls on a motion waits so long, in s.
const ROLLS_OUT: f64 = 1.0;

/// From one pose to another, each joint along a quintic in its part of the time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    from: J5,
    to: J5,
    duration: f64,
    /// It goes onto the stops, or back there.
    folds: bool,
}

impl Motion {
    fn new(from: J5, to: J5, folds: bool) -> Self {
        Self { from, to, duration: takes((to - from).amax()).max(0.2), folds }
    }

    /// Where it should be so many seconds after it set out, how fast, and how much faster (rad/s²).
    fn at(&self, elapsed: f64) -> (J5, J5, J5) {
        let (mut at, mut speed, mut faster) = (self.to, J5::zeros(), J5::zeros());
        for i in 0..JOINTS {
            let way = self.to[i] - self.from[i];
            let (first, last) = PARTS[i];
            let (first, last) = if self.folds { (first, last) } else { (1.0 - last, 1.0 - first) };
            // No joint is faster for that, but for joint 4.
            let time = ((last - first) * self.duration).max(takes(way).min(0.9 * self.duration));
            let begins = if first > 0.0 { last * self.duration - time } else { 0.0 };
            let s = ((elapsed - begins) / time).clamp(0.0, 1.0);
            at[i] = self.from[i] + way * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            speed[i] = way * 30.0 * s * s * (1.0 - 2.0 * s + s * s) / time;
            faster[i] = way * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s * s) / (time * time);
        }
        (at, speed, faster)
    }
}

/// In how many seconds a joint goes that far, in rad: a quintic's peak speed is 15/8 of its mean, its peak acceleration 10/√3 of way by time squared.
fn takes(way: f64) -> f64 {
    (way.abs() / MOTION_SPEED * 1.875).max((way.abs() * 5.774 / MOTION_ACCELERATION).sqrt())
}

#[derive(Debug, Clone, Copy)]
pub(super) enum DriveTask {
    Idle,
    /// It moves there once the arm has come to rest, and its foot too: what presses on it then lets it go first.
    SettingOut {
        to: J5,
        folds: bool,
        fails: bool,
        waited: f64,
    },
    Moving {
        motion: Motion,
        elapsed: f64,
        /// For how long the arm has been too far behind, and a joint has given all that it may.
        behind: f64,
        pressed: f64,
        /// It goes back: something was in the way.
        fails: bool,
    },
    Calibrating {
        elapsed: f64,
        met: [bool; JOINTS],
    },
}

impl DriveTask {
    pub(super) fn calibrating() -> Self {
        Self::Calibrating { elapsed: 0.0, met: CALIBRATION_WAY.map(|way| way == 0.0) }
    }
}

impl Drives {
    pub(super) fn go(&mut self, to: J5, folds: bool) -> Result<(), &'static str> {
        if self.busy() {
            return Err("a motion is under way");
        }
        if self.mode == DriveMode::Torque {
            return Err("the drives take torques: set mode 1 first");
        }
        if !self.calibrated {
            return Err("not calibrated");
        }
        if self.mode == DriveMode::MotorStop {
            self.hold();
            // It lies on its stops.
            self.settles = 0.0;
        }
        self.resumes = false;
        self.task = DriveTask::SettingOut { to, folds, fails: false, waited: 0.0 };
        Ok(())
    }

    /// What position control may give beside what carries the arm.
    pub(super) fn may_press(&self) -> J5 {
        match self.task {
            DriveTask::Moving { .. } => PRESSES,
            _ => J5::repeat(f64::INFINITY),
        }
    }

    pub(super) fn advance_task(&mut self, dt: f64, report: &mut impl FnMut(DriveHappening)) {
        if let DriveTask::SettingOut { to, folds, fails, waited } = &mut self.task {
            *waited += dt;
            let (to, folds, fails, waited) = (*to, *folds, *fails, *waited);
            if self.settles > 0.0 || self.rolls() && waited < ROLLS_OUT {
                self.come_to_rest(dt);
                return;
            }
            self.handover.begin();
            self.identification.begin();
            let motion = Motion::new(self.measured.q, to, folds);
            self.task = DriveTask::Moving { motion, elapsed: 0.0, behind: 0.0, pressed: 0.0, fails };
        }
        match &mut self.task {
            // What is held matters where a position is.
            DriveTask::Idle if self.mode != DriveMode::Positioning => {}
            DriveTask::Idle | DriveTask::SettingOut { .. } => self.come_to_rest(dt),
            DriveTask::Moving { motion, elapsed, behind, pressed, fails } => {
                let Measured { q, qd, .. } = &self.measured;
                self.identification.take(*elapsed, q, qd, &motion.at(*elapsed).2, &self.torque);
                *elapsed += dt;
                (self.target, self.target_speed, _) = motion.at(*elapsed);
                let (motion, over, fails) = (*motion, *elapsed - motion.duration, *fails);
                *behind = if (self.target - self.measured.q).amax() > BLOCKED_ERROR { *behind + dt } else { 0.0 };
                *pressed = if self.presses { *pressed + dt } else { 0.0 };
                let blocked = over > ARRIVAL_TIME || *behind > BLOCKED_TIME || *pressed > PRESSED_TIME;
                // The motion has ended when the arm is there, not when it should be.
                if over >= 0.0 && (self.measured.q - motion.to).amax() < ARRIVAL_ERROR {
                    self.task = DriveTask::Idle;
                    let found = self.identification.found();
                    // An arm that is folded, or goes back, takes no torques after that.
                    if found.is_none() && !motion.folds && !fails {
                        report(DriveHappening::NotIdentified);
                    }
                    self.identified = found.or(self.identified);
                    report(if fails { DriveHappening::MotionFailed } else { DriveHappening::Arrived });
                } else if blocked && fails {
                    self.hold();
                    report(DriveHappening::MotionFailed);
                } else if blocked {
                    // What fails has not happened: it goes back to where it began, and presses on nothing.
                    self.hold();
                    self.task =
                        DriveTask::SettingOut { to: motion.from, folds: !motion.folds, fails: true, waited: 0.0 };
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
