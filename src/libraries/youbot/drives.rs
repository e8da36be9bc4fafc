//! The youBot's drives as its driver sees them: control modes, limits, watchdogs, calibration, folding, braking.

use super::base::Twist2;
use super::handover::{Handover, ramped, within_speed};
use super::identification::{ArmScales, Identification};
use super::parameters::{
    COULOMB, GRIPPER, JOINTS, PARK_POSE_DEG, RANGE_LOWER_DEG, RANGE_UPPER_DEG, TORQUE_LIMIT, WORKING_POSE_DEG,
};
use super::plant::joint_ranges;
use super::rigid_body::{ArmModel, J5, radians};
use stopping::SETTLES;
use task::DriveTask;

mod stopping;
mod task;

/// What the drives do; numbers as in the KU Leuven driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveMode {
    /// 0: windings shorted. The arm sinks unless it rests on its stops.
    MotorStop,
    /// 1: hold, or move to, a position.
    Positioning,
    /// 6: torques as commanded.
    Torque,
}

impl DriveMode {
    /// From the driver's number.
    pub fn from_number(n: u8) -> Option<Self> {
        match n {
            0 => Some(Self::MotorStop),
            1 => Some(Self::Positioning),
            6 => Some(Self::Torque),
            _ => None,
        }
    }

    /// The driver's number.
    pub fn number(self) -> u8 {
        match self {
            Self::MotorStop => 0,
            Self::Positioning => 1,
            Self::Torque => 6,
        }
    }
}

/// Something the drives report, once each time it begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveHappening {
    /// A joint passed the soft limit.
    SoftLimit,
    /// All joints are inside again.
    SoftLimitExit,
    /// No torque command for too long: the drives hold the arm by themselves.
    CommandWatchdog,
    /// No twist command for too long while torques are taken: the base stands.
    BaseWatchdog,
    /// A calibration ended.
    Calibrated,
    /// A calibration did not find the stops.
    CalibrationFailed,
    /// The torques of an unfolding fitted no arm that it could be: what was known of it stays.
    NotIdentified,
    /// A motion ended.
    Arrived,
    /// A motion did not reach its end: something is in the way. The arm is held where it began, or where it cannot get on.
    MotionFailed,
}

/// Limits and times of the driver.
#[derive(Debug, Clone, Copy)]
pub struct DriveParameters {
    /// In N m.
    pub tau_max: J5,
    /// In s.
    pub cmd_timeout: f64,
    /// In s.
    pub base_timeout: f64,
    /// Share of a joint's range from which an event is raised and outward torque is reduced.
    pub soft_limit: f64,
    /// Share at which outward torque is zero.
    pub scale_end: f64,
    /// Whether they slow down a joint that comes near its highest speed, also against what is commanded.
    pub speed_limit: bool,
}

impl Default for DriveParameters {
    fn default() -> Self {
        Self {
            tau_max: J5::from(TORQUE_LIMIT),
            cmd_timeout: 0.02,
            base_timeout: 1.0,
            soft_limit: 0.80,
            scale_end: 0.85,
            speed_limit: true,
        }
    }
}

/// Gains of the position controllers, in N m/rad and N m s/rad.
const POSITION_GAIN: [f64; JOINTS] = [400.0, 400.0, 200.0, 80.0, 30.0];
const SPEED_GAIN: [f64; JOINTS] = [24.0, 24.0, 12.0, 4.0, 1.5];
/// A step back inside the soft limit before its exit is reported, as a share of the range.
const SOFT_LIMIT_HYSTERESIS: f64 = 0.01;

/// An arm that is held gives way when a joint was taken along by so much from where its drive held it with all that it has, in rad.
const GIVES_WAY: f64 = 0.05;

/// As far from a stop an arm that sinks onto it is not dropped, in rad.
const NEAR_STOP: f64 = 0.05;

/// What the drives measure.
#[derive(Debug, Clone, Copy, Default)]
pub struct Measured {
    /// Angles, in rad.
    pub q: J5,
    /// Speeds, in rad/s.
    pub qd: J5,
    /// How the base moves, in its frame.
    pub base: Twist2,
}

/// What the drives do in the next period.
#[derive(Debug, Clone, Copy)]
pub struct DriveOutput {
    /// In N m.
    pub torque: J5,
    /// The windings are shorted.
    pub braked: bool,
    /// For the base, in its frame.
    pub twist: Twist2,
}

/// The drives of an arm and its base.
#[derive(Debug, Clone)]
pub struct Drives {
    /// The arm as it is meant to be.
    model: ArmModel,
    /// The arm as it was seen last.
    pub measured: Measured,
    /// Limits and times.
    pub parameters: DriveParameters,
    /// Torques applied in the last update, in N m.
    pub torque: J5,
    handover: Handover,
    /// Joint speeds in the last update, in rad/s.
    last_speed: J5,
    /// Whether outward torque is reduced near the limits.
    pub limit_safety: bool,
    mode: DriveMode,
    /// They took torques before they braked.
    resumes: bool,
    /// They were told to brake, and that was not taken back.
    braked: bool,
    calibrated: bool,
    task: DriveTask,
    target: J5,
    target_speed: J5,
    /// For how long the arm is still slowed before it is held where it is then, in s.
    settles: f64,
    /// How far a joint was taken along from where it was held, in rad.
    dragged: J5,
    outside: bool,
    base_watched: bool,
    /// A joint gave all that position control may in the last update.
    presses: bool,
    /// What the motion under way tells of the arm, and what the last one that did has told.
    identification: Identification,
    identified: Option<ArmScales>,
}

impl Drives {
    /// Drives off, not calibrated, of an arm that is at `q`.
    pub fn new(q: J5) -> Self {
        let (measured, target) = (Measured { q, ..Measured::default() }, q);
        Self {
            model: ArmModel::youbot(GRIPPER.mass, 1.0),
            measured,
            parameters: DriveParameters::default(),
            torque: J5::zeros(),
            handover: Handover::default(),
            last_speed: J5::zeros(),
            limit_safety: true,
            mode: DriveMode::MotorStop,
            resumes: false,
            braked: false,
            calibrated: false,
            task: DriveTask::Idle,
            target,
            target_speed: J5::zeros(),
            settles: 0.0,
            dragged: J5::zeros(),
            outside: false,
            base_watched: false,
            presses: false,
            identification: Identification::default(),
            identified: None,
        }
    }

    /// How the arm differs from what it is meant to be, as the last motion from or onto the stops has told.
    pub fn identified(&self) -> Option<ArmScales> {
        self.identified
    }

    /// The drives hold the arm with all that they have, and it goes elsewhere: it is too heavy for them, or somebody is stronger. Told once of
    /// each way of that length.
    pub fn gives_way(&mut self) -> bool {
        let gives_way = self.dragged.iter().any(|way| way.abs() > GIVES_WAY);
        if gives_way {
            self.dragged = J5::zeros();
        }
        gives_way
    }

    /// What they do.
    pub fn mode(&self) -> DriveMode {
        self.mode
    }

    /// Whether positions are known.
    #[cfg(test)]
    pub fn calibrated(&self) -> bool {
        self.calibrated
    }

    /// Whether a motion or a calibration is under way.
    pub fn busy(&self) -> bool {
        !matches!(self.task, DriveTask::Idle)
    }

    /// Changes what they do; who brakes takes torques when that is taken back, and not before.
    ///
    /// # Errors
    /// In words: while a motion is under way, or torque control before calibration.
    pub fn set_mode(&mut self, mode: DriveMode) -> Result<(), &'static str> {
        if self.busy() {
            return Err("a motion is under way");
        }
        if mode == DriveMode::Torque && !self.calibrated {
            return Err("not calibrated");
        }
        if mode == DriveMode::Torque && self.braked {
            self.resumes = true;
            return Ok(());
        }
        if mode != self.mode {
            match mode {
                DriveMode::Positioning => self.hold(),
                DriveMode::MotorStop | DriveMode::Torque => {
                    self.mode = mode;
                    self.handover.begin();
                }
            }
        }
        self.resumes = false;
        Ok(())
    }

    /// Whether they are off, and a torque is left that fades.
    pub fn fades(&self) -> bool {
        self.mode == DriveMode::MotorStop && self.torque != J5::zeros()
    }

    /// They take torques as they were meant to, after they held by themselves.
    ///
    /// # Errors
    /// In words: while they are told to brake, and as [`set_mode`](Self::set_mode).
    pub fn resume(&mut self) -> Result<(), &'static str> {
        if self.braked {
            return Err("the drives were told to brake, and that was not taken back: undo what stopped them");
        }
        self.set_mode(DriveMode::Torque)
    }

    /// Takes back that the drives braked, whoever asked for that: they take torques again if they did before.
    pub fn release(&mut self) {
        self.braked = false;
        if std::mem::take(&mut self.resumes) && !self.busy() {
            self.mode = DriveMode::Torque;
            self.handover.begin();
        }
    }

    /// They hear their arm, and it is there.
    pub fn find(&mut self, measured: Measured) {
        self.measured = measured;
    }

    /// Whatever is under way ends: a quick stop, then the drives hold the arm where it came to rest. The base stands.
    pub fn hold(&mut self) {
        self.task = DriveTask::Idle;
        self.target = self.measured.q;
        self.target_speed = self.measured.qd;
        self.settles = SETTLES;
        self.dragged = J5::zeros();
        self.resumes |= self.mode == DriveMode::Torque;
        self.mode = DriveMode::Positioning;
        self.handover.begin();
    }

    /// They come to rest, and hold until they are released.
    pub fn brake(&mut self) {
        self.braked = true;
        self.stop();
    }

    /// Whatever is under way ends, as with [`hold`](Self::hold), of what moves or takes torques, and of an arm that sinks since its drives went
    /// off. Drives that are off stay off where the arm rests, and as long as nobody knows where it is. Those that hold already, or come to rest, go on with that: held anew each time, the
    /// arm would give way under a load.
    pub fn stop(&mut self) {
        let sinks = self.mode == DriveMode::MotorStop && self.calibrated && !self.is_carried();
        if self.busy() || self.mode == DriveMode::Torque || sinks {
            self.hold();
        }
    }

    /// Looks for the stops of joints 2 to 4; ends resting on them, drives off.
    ///
    /// # Errors
    /// In words, in torque control or while something else is under way.
    pub fn calibrate(&mut self) -> Result<(), &'static str> {
        if self.busy() {
            return Err("a motion is under way");
        }
        if self.mode == DriveMode::Torque {
            return Err("the drives take torques: set mode 0 or 1 first");
        }
        self.hold();
        self.resumes = false;
        self.calibrated = false;
        self.task = DriveTask::calibrating();
        Ok(())
    }

    /// Moves to the working pose, and holds it.
    ///
    /// # Errors
    /// In words, in torque control, uncalibrated, or while something else is under way.
    pub fn unfold(&mut self) -> Result<(), &'static str> {
        self.go(radians(WORKING_POSE_DEG), false)
    }

    /// Moves onto the stops, and holds there.
    ///
    /// # Errors
    /// As [`Drives::unfold`].
    pub fn fold(&mut self) -> Result<(), &'static str> {
        self.go(radians(PARK_POSE_DEG), true)
    }

    /// One update of `dt` seconds: what is done until the next one. Commands come with their age in s.
    pub fn update(
        &mut self,
        measured: Measured,
        effort: Option<(J5, f64)>,
        twist: Option<(Twist2, f64)>,
        dt: f64,
        report: &mut impl FnMut(DriveHappening),
    ) -> DriveOutput {
        self.measured = measured;
        self.settles = (self.settles - dt).max(0.0);
        self.advance_task(dt, report);
        let command = match twist {
            // The base is heard while torques are: whoever stops the arm stops the base.
            Some((twist, age)) if age <= self.parameters.base_timeout => {
                self.base_watched = self.mode == DriveMode::Torque;
                if self.base_watched { twist } else { Twist2::default() }
            }
            _ => {
                if std::mem::take(&mut self.base_watched) && self.mode == DriveMode::Torque {
                    report(DriveHappening::BaseWatchdog);
                }
                Twist2::default()
            }
        };
        if self.mode == DriveMode::Torque && effort.is_none_or(|(_, age)| age > self.parameters.cmd_timeout) {
            self.hold();
            report(DriveHappening::CommandWatchdog);
        }
        let mut torque = match (self.mode, effort) {
            (DriveMode::Torque, Some((effort, _))) => self.reduced(&effort),
            (DriveMode::Positioning, _) => self.position_control(),
            (DriveMode::MotorStop | DriveMode::Torque, _) => J5::zeros(),
        };
        torque = self.handover.over(&torque, &self.torque, dt);
        if self.mode == DriveMode::Torque && self.parameters.speed_limit {
            // Behind a period that was missed that is more than it was: it brakes a little early.
            let gained = (self.measured.qd - self.last_speed) / dt;
            torque = within_speed(&torque, &self.measured.qd, &gained, &self.parameters.tau_max);
        }
        for i in 0..JOINTS {
            torque[i] = torque[i].clamp(-self.parameters.tau_max[i], self.parameters.tau_max[i]);
        }
        self.last_speed = self.measured.qd;
        self.torque = ramped(&self.torque, &torque, dt);
        self.watch_limits(report);
        // Windings are shorted when no torque is left.
        let braked = self.mode == DriveMode::MotorStop && self.torque == J5::zeros();
        DriveOutput { torque: self.torque, braked, twist: command }
    }

    fn position_control(&mut self) -> J5 {
        let mut out = self.model.gravity(&self.model.posture(&self.measured.q));
        let most = self.may_press();
        self.presses = false;
        for i in 0..JOINTS {
            let error = POSITION_GAIN[i] * (self.target[i] - self.measured.q[i])
                + SPEED_GAIN[i] * (self.target_speed[i] - self.measured.qd[i]);
            self.presses |= error.abs() > most[i];
            out[i] += error.clamp(-most[i], most[i]);
        }
        out
    }

    /// Share of its half-range that joint `i` is off its middle; its sign.
    fn excursion(&self, i: usize) -> f64 {
        let (lower, upper) = joint_ranges();
        (self.measured.q[i] - 0.5 * (lower[i] + upper[i])) / (0.5 * (upper[i] - lower[i]))
    }

    /// `effort` with what pushes outward reduced near the limits.
    fn reduced(&self, effort: &J5) -> J5 {
        let p = &self.parameters;
        let mut out = *effort;
        if self.limit_safety {
            for i in 0..JOINTS {
                let off = self.excursion(i);
                if off.abs() > p.soft_limit && off * effort[i] > 0.0 {
                    let span = (p.scale_end - p.soft_limit).max(1e-6);
                    out[i] *= (1.0 - (off.abs() - p.soft_limit) / span).clamp(0.0, 1.0);
                }
            }
        }
        out
    }

    fn watch_limits(&mut self, report: &mut impl FnMut(DriveHappening)) {
        let furthest = (0..JOINTS).map(|i| self.excursion(i).abs()).fold(0.0, f64::max);
        let limit = self.parameters.soft_limit;
        if !self.outside && furthest > limit {
            self.outside = true;
            report(DriveHappening::SoftLimit);
        } else if self.outside && furthest < limit - SOFT_LIMIT_HYSTERESIS {
            self.outside = false;
            report(DriveHappening::SoftLimitExit);
        }
    }

    /// Whether they give torque.
    pub fn has_power(&self) -> bool {
        self.mode != DriveMode::MotorStop
    }

    /// They were off, whatever was asked of them, with the arm as it was `measured` now.
    pub fn lose_power(&mut self, measured: Measured) {
        self.measured = measured;
        self.torque = J5::zeros();
    }

    /// Switches the drives off; whether the arm stays where it is, or nearly so.
    pub fn switch_off(&mut self) -> bool {
        self.task = DriveTask::Idle;
        self.mode = DriveMode::MotorStop;
        self.torque = J5::zeros();
        self.handover = Handover::default();
        self.is_carried()
    }

    /// Whether friction or a stop that is near carries each joint against gravity.
    fn is_carried(&self) -> bool {
        let (lower, upper) = joint_ranges();
        let weight = self.model.gravity(&self.model.posture(&self.measured.q));
        (0..JOINTS).all(|i| {
            let stop = if weight[i] > 0.0 { lower[i] } else { upper[i] };
            weight[i].abs() <= COULOMB[i] || (self.measured.q[i] - stop).abs() < NEAR_STOP
        })
    }
}

#[cfg(test)]
mod tests;
