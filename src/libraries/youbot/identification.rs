//! What an arm weighs and how much it rubs, beside what is believed of it: found while its position is controlled.
//!
//! Joint torques are linear in both (inverse dynamics with the links' masses, and the believed friction), so both are found by least squares
//! over a motion. Whoever moves the arm meanwhile, or hangs something on it, makes what is left over large, if only for a while: then nothing
//! was found.

use super::parameters::{COULOMB, GRIPPER, JOINTS, VISCOUS};
use super::rigid_body::{ArmModel, BaseMotion, J5};

/// Joints slower than that are left out, in rad/s: what friction does at rest is whatever is needed.
const TURNS: f64 = 0.1;
/// So many values of torque at least.
const ENOUGH: f64 = 500.0;
/// As alike as weight and friction may be (the cosine between both, squared) for both to be found.
const TOO_ALIKE: f64 = 0.9;
/// Parts of a motion, of so many seconds each; the last takes the rest.
const PARTS: usize = 16;
const PART: f64 = 0.25;
/// What may be left over of a joint's torques in a part of a motion, on the average, in N m, where there are so many values in it (a joint that
/// begins to turn does not go as planned at first). An arm that is let alone leaves a hundredth; a tool that touches something soft with 2 N
/// for half a second a tenth. On the average: encoders that count make position control tremble.
const LEFT_OVER: f64 = 0.08;
const TELLS: f64 = 100.0;
/// Beyond these it is not the arm that is meant.
const MASSES: std::ops::RangeInclusive<f64> = 0.8..=1.25;
const FRICTIONS: std::ops::RangeInclusive<f64> = 0.4..=1.8;

/// An arm as multiples of what is believed of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmScales {
    /// Of its links; what it carries is not scaled.
    pub mass: f64,
    /// Of its joints, Coulomb's and viscous.
    pub friction: f64,
}

impl Default for ArmScales {
    fn default() -> Self {
        Self { mass: 1.0, friction: 1.0 }
    }
}

/// Torques summed up (of the links' weight, of friction, and what the motors gave), and their products.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    count: f64,
    weight: f64,
    friction: f64,
    torque: f64,
    weight_weight: f64,
    weight_friction: f64,
    friction_friction: f64,
    torque_weight: f64,
    torque_friction: f64,
}

impl Sums {
    fn take(&mut self, weight: f64, friction: f64, torque: f64) {
        self.add(&Self {
            count: 1.0,
            weight,
            friction,
            torque,
            weight_weight: weight * weight,
            weight_friction: weight * friction,
            friction_friction: friction * friction,
            torque_weight: torque * weight,
            torque_friction: torque * friction,
        });
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        self.weight += other.weight;
        self.friction += other.friction;
        self.torque += other.torque;
        self.weight_weight += other.weight_weight;
        self.weight_friction += other.weight_friction;
        self.friction_friction += other.friction_friction;
        self.torque_weight += other.torque_weight;
        self.torque_friction += other.torque_friction;
    }

    /// The arm that fits best, if they tell.
    fn best(&self) -> Option<ArmScales> {
        let (w, f, both) = (self.weight_weight, self.friction_friction, self.weight_friction);
        let alike = both * both / (w * f);
        // Not a number where nothing has moved.
        if self.count < ENOUGH || alike.is_nan() || alike > TOO_ALIKE {
            return None;
        }
        let determinant = w * f - both * both;
        Some(ArmScales {
            mass: (self.torque_weight * f - self.torque_friction * both) / determinant,
            friction: (self.torque_friction * w - self.torque_weight * both) / determinant,
        })
    }

    /// What that arm leaves over on the average, in N m.
    fn left_over(&self, arm: &ArmScales) -> f64 {
        (self.torque - arm.mass * self.weight - arm.friction * self.friction).abs() / self.count.max(1.0)
    }
}

/// A motion as far as it has come.
#[derive(Debug, Clone)]
pub struct Identification {
    links: ArmModel,
    carried: ArmModel,
    parts: [[Sums; JOINTS]; PARTS],
}

impl Default for Identification {
    fn default() -> Self {
        Self {
            links: ArmModel::youbot(0.0, 1.0),
            carried: ArmModel::youbot(GRIPPER.mass, 0.0),
            parts: [[Sums::default(); JOINTS]; PARTS],
        }
    }
}

impl Identification {
    /// Another motion begins.
    pub fn begin(&mut self) {
        self.parts = [[Sums::default(); JOINTS]; PARTS];
    }

    /// So many seconds after it began the motors give `torque` (N m) while the joints are at `q` and go on as `qd` and `qdd` say.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn take(&mut self, elapsed: f64, q: &J5, qd: &J5, qdd: &J5, torque: &J5) {
        let (at, still) = (self.links.posture(q), BaseMotion::default());
        let weight = self.links.inverse_dynamics(&at, qd, qdd, &still);
        let carried = self.carried.inverse_dynamics(&at, qd, qdd, &still);
        let part = &mut self.parts[((elapsed / PART) as usize).min(PARTS - 1)];
        for i in (0..JOINTS).filter(|i| qd[*i].abs() > TURNS) {
            let friction = COULOMB[i] * qd[i].signum() + VISCOUS[i] * qd[i];
            part[i].take(weight[i], friction, torque[i] - self.links.reflected[i] * qdd[i] - carried[i]);
        }
    }

    /// What was found, if the motion tells.
    pub fn found(&self) -> Option<ArmScales> {
        let mut all = Sums::default();
        self.parts.iter().flatten().for_each(|sums| all.add(sums));
        let arm = all.best()?;
        let told = |sums: &&Sums| sums.count >= TELLS;
        let fits = self.parts.iter().flatten().filter(told).all(|sums| sums.left_over(&arm) <= LEFT_OVER);
        (fits && MASSES.contains(&arm.mass) && FRICTIONS.contains(&arm.friction)).then_some(arm)
    }
}
