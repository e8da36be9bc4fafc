//! The drives: what they do by themselves, and what they let others do.

use super::model::{AXES, Arm, COULOMB, LARGEST, LOWER, PARKED, QUILL, RAIL, UPPER, V5, WORKING};

/// What the drives do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// 0: windings shorted, the quill's brake closed.
    Off,
    /// 1: every axis is held, or moved, by the drives.
    Holding,
    /// 2: the arm takes forces and torques, the rail a speed.
    Torques,
}

impl Mode {
    /// From its number.
    pub fn from_number(number: u8) -> Option<Self> {
        [Self::Off, Self::Holding, Self::Torques].into_iter().find(|mode| mode.number() == number)
    }

    /// Its number.
    pub fn number(self) -> u8 {
        self as u8
    }
}

/// How a motion of the drives ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// As it should.
    Well,
    /// Something is in the way, or a stop was not met.
    Badly,
}

/// What commands drives that take torques, and for how long that has not been heard, in s.
#[derive(Debug, Clone, Copy)]
pub struct Commanded {
    /// Forces and torques of the arm; that of the rail counts for nothing.
    pub effort: V5,
    /// Where the rail is to go, in m/s.
    pub rail: f64,
}

/// Position controllers, on accelerations: each axis as a critically damped oscillator of this frequency, in rad/s.
const STIFFNESS: [f64; AXES] = [30.0, 30.0, 30.0, 40.0, 30.0];
/// How fast motions go at most, in m/s and rad/s.
const SPEED: [f64; AXES] = [0.35, 1.2, 1.5, 0.15, 2.0];
/// With what they are stopped, in m/s² and rad/s²: from any of those speeds within 0.2 s.
const QUICK_STOP: [f64; AXES] = [2.5, 7.0, 8.0, 1.5, 12.0];
/// How fast a force or torque changes at most, whatever asks for it, per second.
const RATE: [f64; AXES] = [8000.0, 450.0, 225.0, 3000.0, 40.0];
/// How fast that of before a switch fades.
const FADE: [f64; AXES] = [4000.0, 200.0, 100.0, 1500.0, 20.0];
/// How close to its end a motion comes, and how much later than planned, in s.
const ARRIVED: [f64; AXES] = [0.004, 0.01, 0.01, 0.004, 0.02];
const LATE: f64 = 2.0;
/// Homing: which axes look for their stops (shoulder, elbow and wrist have absolute encoders), how fast, how far behind its target an
/// axis is that has met one, and when they are given up, in s.
const HOMING: [f64; AXES] = [-0.06, 0.0, 0.0, 0.04, 0.0];
const MET: [f64; AXES] = [0.006, 0.0, 0.0, 0.012, 0.0];
const HOMING_TIME: f64 = 6.0;
/// An axis that takes torques may use so much of its range.
pub const SOFT_LIMIT: f64 = 0.85;
/// The rail's speed is not taken above this, in m/s.
const RAIL_SPEED: f64 = 0.45;
/// Speed at which the friction that the drives help against counts as that of motion, in m/s or rad/s.
const STILL: f64 = 0.01;
/// What the drives believe to be in the gripper, in kg.
pub const BELIEVED_PAYLOAD: f64 = 0.3;

#[derive(Debug, Clone, Copy)]
enum Task {
    Idle,
    Moving { from: V5, to: V5, since: f64, takes: f64 },
    Homing { since: f64, met: [bool; AXES] },
}

/// The drives of an arm.
#[derive(Debug, Clone)]
pub struct Drives {
    arm: Arm,
    mode: Mode,
    task: Task,
    /// They took torques before they held by themselves.
    resumes: bool,
    /// They were told to brake, and that was not taken back.
    braked: bool,
    homed: bool,
    target: V5,
    target_speed: V5,
    target_gain: V5,
    /// What is put out.
    pub effort: V5,
    left: V5,
    switched: bool,
    q: V5,
    v: V5,
}

impl Default for Drives {
    fn default() -> Self {
        let zeros = V5::zeros();
        Self {
            arm: Arm { payload: BELIEVED_PAYLOAD },
            mode: Mode::Off,
            task: Task::Idle,
            resumes: false,
            braked: false,
            homed: false,
            target: zeros,
            target_speed: zeros,
            target_gain: zeros,
            effort: zeros,
            left: zeros,
            switched: false,
            q: zeros,
            v: zeros,
        }
    }
}

impl Drives {
    /// What they do.
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Where the arm is seen from now on.
    pub fn see(&mut self, q: V5, v: V5) {
        (self.q, self.v) = (q, v);
    }

    fn busy(&self) -> bool {
        !matches!(self.task, Task::Idle)
    }

    fn switch(&mut self, mode: Mode) {
        self.mode = mode;
        self.switched = true;
        self.target = self.q;
        (self.target_speed, self.target_gain) = (self.v, V5::zeros());
        if mode == Mode::Torques {
            // The rail is held, or goes on, by its own controller.
            self.target_speed[RAIL] = 0.0;
        }
    }

    /// Changes what they do.
    ///
    /// # Errors
    /// In words: while a motion is under way; torques before homing.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), &'static str> {
        if self.busy() {
            return Err("a motion is under way");
        }
        if mode == Mode::Torques && !self.homed {
            return Err("the axes are not homed");
        }
        if mode != self.mode {
            self.switch(mode);
        }
        self.resumes = false;
        Ok(())
    }

    /// Whatever is under way ends: a quick stop, then they hold where the axes came to rest.
    pub fn hold(&mut self) {
        self.task = Task::Idle;
        self.resumes |= self.mode == Mode::Torques;
        self.switch(Mode::Holding);
    }

    /// They were off, whatever was asked of them.
    pub fn lose_power(&mut self) {
        (self.effort, self.left) = (V5::zeros(), V5::zeros());
    }

    /// As [`hold`](Self::hold), of what moves or takes torques: what holds already goes on with that, what is off stays off.
    pub fn stop(&mut self) {
        if self.busy() || self.mode == Mode::Torques {
            self.hold();
        }
    }

    /// They come to rest, and hold until they are released.
    pub fn brake(&mut self) {
        self.braked = true;
        self.stop();
    }

    /// That they braked is taken back: they take torques again if they did before and `may`.
    pub fn release(&mut self, may: bool) {
        self.braked = false;
        if std::mem::take(&mut self.resumes) && may && !self.busy() {
            self.switch(Mode::Torques);
        }
    }

    /// They take torques, whatever made them hold by themselves.
    ///
    /// # Errors
    /// In words: while they are told to brake, and as [`set_mode`](Self::set_mode).
    pub fn resume(&mut self) -> Result<(), &'static str> {
        if self.braked {
            return Err("the drives were told to brake, and that was not taken back");
        }
        self.set_mode(Mode::Torques)
    }

    /// They are off, at once.
    pub fn switch_off(&mut self) {
        self.task = Task::Idle;
        self.switch(Mode::Off);
        (self.effort, self.left, self.resumes) = (V5::zeros(), V5::zeros(), false);
    }

    fn may_move(&self) -> Result<(), &'static str> {
        match (self.busy(), self.mode) {
            (true, _) => Err("a motion is under way"),
            (_, Mode::Torques) => Err("the drives take torques: set mode 1 first"),
            _ => Ok(()),
        }
    }

    /// The quill goes to its upper stop, then the carriage to its end; they are held there.
    ///
    /// # Errors
    /// In words: while they take torques or something moves.
    pub fn home(&mut self) -> Result<(), &'static str> {
        self.may_move()?;
        self.hold();
        (self.resumes, self.homed) = (false, false);
        self.task = Task::Homing { since: 0.0, met: HOMING.map(|speed| speed == 0.0) };
        Ok(())
    }

    /// To the working pose.
    ///
    /// # Errors
    /// As [`home`](Self::home), and before homing.
    pub fn unfold(&mut self) -> Result<(), &'static str> {
        self.go(WORKING.into())
    }

    /// Back to where nothing has to hold the arm.
    ///
    /// # Errors
    /// As [`unfold`](Self::unfold).
    pub fn fold(&mut self) -> Result<(), &'static str> {
        self.go(PARKED.into())
    }

    fn go(&mut self, to: V5) -> Result<(), &'static str> {
        self.may_move()?;
        if !self.homed {
            return Err("the axes are not homed");
        }
        self.hold();
        self.resumes = false;
        let from = self.q;
        // A quintic's peak speed is 15/8 of its mean.
        let takes = (to - from).abs().component_div(&V5::from(SPEED)).max() * 1.875;
        self.task = Task::Moving { from, to, since: 0.0, takes: takes.max(0.2) };
        Ok(())
    }

    /// One period of `dt` seconds: what is put out in it, and how a motion ended. None commanded: nobody is heard.
    pub fn update(&mut self, commanded: Option<Commanded>, dt: f64) -> Option<Ended> {
        let ended = self.advance(commanded.map_or(0.0, |c| c.rail), dt);
        let wanted = match (self.mode, commanded) {
            (Mode::Off, _) => V5::zeros(),
            (Mode::Torques, Some(command)) => {
                let mut wanted = command.effort;
                wanted[RAIL] = self.servo()[RAIL];
                wanted
            }
            (Mode::Holding | Mode::Torques, _) => self.servo(),
        };
        if std::mem::take(&mut self.switched) {
            self.left = self.effort - wanted;
        }
        let (effort, left) = (self.effort, self.left);
        for i in 0..AXES {
            self.left[i] -= left[i].clamp(-FADE[i] * dt, FADE[i] * dt);
            let next = (wanted[i] + self.left[i]).clamp(-LARGEST[i], LARGEST[i]);
            self.effort[i] += (next - effort[i]).clamp(-RATE[i] * dt, RATE[i] * dt);
        }
        ended
    }

    fn advance(&mut self, rail: f64, dt: f64) -> Option<Ended> {
        match self.task {
            Task::Idle => {
                for (i, most) in QUICK_STOP.into_iter().enumerate() {
                    let follows = self.mode == Mode::Torques && i == RAIL;
                    let wanted = if follows { rail.clamp(-RAIL_SPEED, RAIL_SPEED) } else { 0.0 };
                    let step = (wanted - self.target_speed[i]).clamp(-most * dt, most * dt);
                    self.target_gain[i] = step / dt;
                    self.target_speed[i] += step;
                }
                self.target += self.target_speed * dt;
                if self.mode == Mode::Torques {
                    // The arm is not the drives': what it does is not wanted of the rail.
                    for i in RAIL + 1..AXES {
                        (self.target[i], self.target_speed[i], self.target_gain[i]) = (self.q[i], self.v[i], 0.0);
                    }
                }
                None
            }
            Task::Moving { from, to, ref mut since, takes } => {
                *since += dt;
                let over = *since - takes;
                let s = (*since / takes).min(1.0);
                let way = to - from;
                self.target = from + way * (s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
                self.target_speed = way * (30.0 * s * s * (1.0 - s) * (1.0 - s) / takes);
                self.target_gain = way * (60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (takes * takes));
                let there = (0..AXES).all(|i| (self.q[i] - to[i]).abs() < ARRIVED[i]);
                if over >= 0.0 && there {
                    self.task = Task::Idle;
                    return Some(Ended::Well);
                }
                (over > LATE).then(|| {
                    self.hold();
                    Ended::Badly
                })
            }
            Task::Homing { ref mut since, ref mut met } => {
                *since += dt;
                let over = *since > HOMING_TIME;
                (self.target_speed, self.target_gain) = (V5::zeros(), V5::zeros());
                // The quill first: what it carries is out of the way then.
                if let Some(i) = [QUILL, RAIL].into_iter().find(|i| !met[*i]) {
                    self.target_speed[i] = HOMING[i];
                    self.target[i] += HOMING[i] * dt;
                    let behind = (self.target[i] - self.q[i]) * HOMING[i].signum();
                    if behind > MET[i] && self.v[i].abs() < 0.1 * HOMING[i].abs() {
                        met[i] = true;
                        // It rests there and does not press.
                        self.target[i] = self.q[i];
                    }
                    return over.then(|| {
                        self.hold();
                        Ended::Badly
                    });
                }
                let found = (self.q[QUILL] - UPPER[QUILL]).abs() < 0.01 && (self.q[RAIL] - LOWER[RAIL]).abs() < 0.01;
                self.hold();
                self.homed = found;
                Some(if found { Ended::Well } else { Ended::Badly })
            }
        }
    }

    /// What the position controllers ask for: the arm's own equations with the accelerations that bring each axis to its target.
    fn servo(&self) -> V5 {
        let mut wanted = self.target_gain;
        for i in 0..AXES {
            let w = STIFFNESS[i];
            wanted[i] += w * w * (self.target[i] - self.q[i]) + 2.0 * w * (self.target_speed[i] - self.v[i]);
        }
        let mut effort = self.arm.mass(&self.q) * wanted + self.arm.bias(&self.q, &self.v);
        for i in 0..AXES {
            effort[i] += COULOMB[i] * (self.target_speed[i] / STILL).tanh();
        }
        effort
    }

    /// The largest share of its range that an axis is off its middle.
    pub fn excursion(&self) -> f64 {
        let off = |i: usize| (self.q[i] - 0.5 * (LOWER[i] + UPPER[i])).abs() / (0.5 * (UPPER[i] - LOWER[i]));
        (0..AXES).map(off).fold(0.0, f64::max)
    }
}
