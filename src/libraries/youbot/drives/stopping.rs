//! How an arm comes to rest that is to be held: along a ramp, without driving on into what it meets.

use super::{Drives, JOINTS, POSITION_GAIN, SPEED_GAIN};
use crate::libraries::youbot::base::{Pose2, Twist2};
use crate::libraries::youbot::handover::{QUICK_STOP, slowed};
use crate::libraries::youbot::kinematics::Tool;
use crate::libraries::youbot::parameters::SPEED_LIMIT;
use crate::libraries::youbot::rigid_body::{J5, Jacobian};
use nalgebra::{Matrix3, Vector3};

/// As long as a quick stop takes at most an arm is only slowed, in s; where it is then, it is held.
pub(super) const SETTLES: f64 = SPEED_LIMIT / QUICK_STOP;
/// A base that is slower stands, in m/s: what is left of its way is then half a millimetre.
const STANDS: f64 = 0.005;
/// Damping of the inverse near singular poses, in (m/rad)² per N m s/rad.
const SINGULAR: f64 = 1e-6;

impl Drives {
    /// What is held in the next `dt` seconds. Each joint slows down along the ramp of a quick stop, or sooner where something slows it; it is
    /// held where it came to rest, not where it was when it was stopped or should have come to: a tool that has met something is not pressed on into that, and gives back
    /// what it was pressed in. As long as the base rolls, what stands in the way of the tool goes on pushing the arm back: a target that its
    /// joint was pushed away from so would press against that, and follows.
    pub(super) fn come_to_rest(&mut self, dt: f64) {
        let rolling = Rolling::of(self);
        let back = rolling.as_ref().map_or_else(J5::zeros, |rolling| rolling.going_back(&self.measured.qd));
        let ramp = back + slowed(&(self.target_speed - back), dt);
        for i in 0..JOINTS {
            let way = ramp[i].signum();
            self.target_speed[i] = way * ramp[i].abs().min((way * self.measured.qd[i]).max(0.0));
            let off = self.measured.q[i] - self.target[i];
            if self.settles > 0.0 || rolling.as_ref().is_some_and(|rolling| rolling.pushes(i, off)) {
                self.target[i] = self.measured.q[i];
            }
            // Pushed further than the drive can hold, it stays there: it would be flung back when it is let go.
            let lead = self.parameters.tau_max[i] / POSITION_GAIN[i];
            let held = self.target[i];
            self.target[i] = held.clamp(self.measured.q[i] - lead, self.measured.q[i] + lead);
            self.dragged[i] += self.target[i] - held;
        }
        self.target += self.target_speed * dt;
    }

    /// Whether the base still rolls.
    pub(super) fn rolls(&self) -> bool {
        Rolling::of(self).is_some()
    }
}

/// A base that was stopped rolls out for some tenths of a second, and takes the arm's foot along.
struct Rolling {
    /// The tool's speed per joint speed, in the base's frame.
    arm: Jacobian,
    /// The tool's speed if no joint turned, there, in m/s.
    rolls: Vector3<f64>,
}

impl Rolling {
    /// None: the base stands.
    fn of(drives: &Drives) -> Option<Self> {
        let (now, base) = (&drives.measured, drives.measured.base);
        if base == Twist2::default() {
            return None;
        }
        let jacobian = Tool::of(&drives.model, &now.q, &now.qd, Pose2::default(), base).jacobian();
        let rolls = jacobian.fixed_columns::<3>(0) * Vector3::new(base.vx, base.vy, base.wz);
        let arm = jacobian.fixed_columns::<JOINTS>(3).into_owned();
        (rolls.norm() >= STANDS).then_some(Self { arm, rolls })
    }

    /// Joint speeds with which the tool stays behind by as much as it does already at joint speeds `qd`, and by no more than the base rolls that
    /// way: an arm that is pushed back by what stands in its way gives way to that. What slides along a wall is pushed back across it only.
    fn going_back(&self, qd: &J5) -> J5 {
        let moves = self.arm * qd;
        let level = Vector3::new(moves.x, moves.y, 0.0);
        let share = (-level.dot(&self.rolls) / level.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        // The joint speeds to which damped drives are pushed by a force on the tool.
        let mobility = Jacobian::from_fn(|row, i| self.arm[(row, i)] / SPEED_GAIN[i]);
        let inverse = (self.arm * mobility.transpose() + Matrix3::identity() * SINGULAR).try_inverse();
        inverse.map_or_else(J5::zeros, |inverse| mobility.transpose() * (inverse * (level * share)))
    }

    /// Whether joint `i`, which is `off` its target, is so since the tool stayed behind the base.
    fn pushes(&self, i: usize, off: f64) -> bool {
        self.arm.column(i).dot(&self.rolls) * off < 0.0
    }
}
