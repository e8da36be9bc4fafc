//! How an arm comes to rest that is to be held: along a ramp, without driving on into what it meets.

use super::{Drives, JOINTS, SPEED_GAIN};
use crate::libraries::youbot::base::Pose2;
use crate::libraries::youbot::handover::slowed;
use crate::libraries::youbot::kinematics::Tool;
use crate::libraries::youbot::rigid_body::{J5, Jacobian};
use nalgebra::{Matrix3, Vector3};

/// A base that is slower stands, in m/s: what is left of its way is then half a millimetre.
const STANDS: f64 = 0.005;
/// Damping of the inverse near singular poses, in (m/rad)² per N m s/rad.
const SINGULAR: f64 = 1e-6;

impl Drives {
    /// What is held in the next `dt` seconds: each joint slows down along the ramp of a quick stop, or sooner where something slows it. A
    /// target that is ahead of its joint would press on whatever that is: it waits.
    pub(super) fn come_to_rest(&mut self, dt: f64) {
        let back = self.going_back();
        let ramp = back + slowed(&(self.target_speed - back), dt);
        for i in 0..JOINTS {
            let way = ramp[i].signum();
            let speed = ramp[i].abs().min((way * self.measured.qd[i]).max(0.0));
            if speed > 0.0 && way * (self.target[i] - self.measured.q[i]) > 0.0 {
                self.target[i] = self.measured.q[i];
            }
            self.target_speed[i] = way * speed;
        }
        self.target += self.target_speed * dt;
    }

    /// A base that is stopped rolls out for some tenths of a second, and takes the arm's foot along. Joint speeds with which the tool stays
    /// behind by as much as it does already, and by no more than the base rolls: an arm that is pushed back by what stands in its
    /// way gives way to that.
    fn going_back(&self) -> J5 {
        let (now, base) = (&self.measured, self.measured.base);
        let jacobian = Tool::of(&self.model, &now.q, &now.qd, Pose2::default(), base).jacobian;
        let arm: Jacobian = jacobian.fixed_columns::<JOINTS>(3).into_owned();
        let rolls = jacobian.fixed_columns::<3>(0) * Vector3::new(base.vx, base.vy, base.wz);
        let speed = rolls.norm();
        if speed < STANDS {
            return J5::zeros();
        }
        let behind = -(arm * self.measured.qd).dot(&rolls) / (speed * speed);
        // The joint speeds to which damped drives are pushed by a force on the tool.
        let mobility = Jacobian::from_fn(|row, i| arm[(row, i)] / SPEED_GAIN[i]);
        let inverse = (arm * mobility.transpose() + Matrix3::identity() * SINGULAR).try_inverse();
        let wanted = -rolls * behind.clamp(0.0, 1.0);
        inverse.map_or_else(J5::zeros, |inverse| mobility.transpose() * (inverse * wanted))
    }
}
