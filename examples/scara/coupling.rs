//! The spring and damper between two tools, at one end of it.

use super::model::V4;
use nalgebra::Vector3;

/// For how long a coupling takes hold and lets go, in s.
const TAKES_HOLD: f64 = 0.3;
const LETS_GO: f64 = 0.1;
/// By how much the force of spring and damper changes at most, in N/s: what the other end tells may jump, and the force does not.
const RATE: f64 = 100.0;
/// Of the turning, as a share of the spring's stiffness per metre of arm squared: N m/rad for N/m.
const TURNING: f64 = 0.01;
/// Most that it turns with, in N m.
const MOST_TURNING: f64 = 0.8;

/// What it is made of.
#[derive(Debug, Clone, Copy)]
pub struct Law {
    /// In N/m.
    pub stiffness: f64,
    /// On the difference of speeds, and on the own one, in N s/m.
    pub damping_rel: f64,
    /// On the own one.
    pub damping_abs: f64,
    /// The largest force, in N.
    pub most: f64,
}

/// What one end does with its tool.
#[derive(Debug, Clone, Copy, Default)]
pub struct Pull {
    /// Forces (N) and a torque about z (N m).
    pub wrench: V4,
    /// The norm of the force that it would want if it were coupled and nothing bounded it, in N.
    pub wanted: f64,
}

/// How much of it is in force.
#[derive(Debug, Clone, Copy, Default)]
pub struct Coupling {
    /// From 0, let go of, to 1.
    pub engaged: f64,
    /// The force of spring and damper, as far as it has come, in N.
    force: Vector3<f64>,
}

impl Coupling {
    /// `dt` seconds later: what the end at `x`, moving with `v`, is pulled with towards the other one.
    pub fn update(&mut self, law: &Law, here: (&V4, &V4), there: Option<(&V4, &V4)>, coupled: bool, dt: f64) -> Pull {
        let step = if coupled && there.is_some() { dt / TAKES_HOLD } else { -dt / LETS_GO };
        self.engaged = (self.engaged + step).clamp(0.0, 1.0);
        // Who is not heard any more is let go of with the same ramp.
        let Some((to, at)) = there else { return Pull { wrench: self.pulls(), wanted: 0.0 } };
        let raw = (to - here.0) * law.stiffness + (at - here.1) * law.damping_rel;
        let wanted = raw.fixed_rows::<3>(0).norm();
        let bounded = raw * (law.most / wanted.max(law.most));
        let step = bounded.fixed_rows::<3>(0) - self.force;
        self.force += if self.engaged > 0.0 { step * (RATE * dt / step.norm().max(RATE * dt)) } else { step };
        let mut wrench = self.pulls() - here.1 * law.damping_abs * self.engaged;
        let turn = (raw[3] - here.1[3] * law.damping_abs) * TURNING;
        wrench[3] = turn.clamp(-MOST_TURNING, MOST_TURNING) * self.engaged;
        Pull { wrench, wanted }
    }

    /// What spring and damper pull with, as far as it is in force.
    fn pulls(&self) -> V4 {
        V4::new(self.force.x, self.force.y, self.force.z, 0.0) * self.engaged
    }
}
