//! Where the tool is in the world, and how it moves with base and joints.

use super::base::{Pose2, Twist2};
use super::dynamics::Jacobian8;
use super::parameters::JOINTS;
use super::plant::base_rotation;
use super::rigid_body::{ArmModel, J5, Jacobian, Posture, manipulability};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

/// The tool in the world frame.
#[derive(Debug, Clone, Copy)]
pub struct Tool {
    /// In m.
    pub position: Vector3<f64>,
    /// In m/s.
    pub velocity: Vector3<f64>,
    /// Angular velocity, in rad/s.
    pub rotation_rate: Vector3<f64>,
    /// From the base's frame to the world.
    pub turn: Rotation3<f64>,
    /// From the tool's frame to the base's.
    hand: Rotation3<f64>,
    /// In the base's frame, in m.
    lever: Vector3<f64>,
    arm: Jacobian,
}

impl Tool {
    /// Of an arm at angles `q` and speeds `qd`, on a base at `base` moving with `twist`.
    pub fn of(model: &ArmModel, q: &J5, qd: &J5, base: Pose2, twist: Twist2) -> Self {
        Self::at(model, &model.posture(q), qd, base, twist)
    }

    /// The same of an arm whose pose is known.
    pub fn at(model: &ArmModel, at: &Posture, qd: &J5, base: Pose2, twist: Twist2) -> Self {
        let (arm, turn, lever) = (at.jacobian(), base_rotation(base), model.mount + at.tool);
        let carried = Vector3::new(twist.vx - twist.wz * lever.y, twist.vy + twist.wz * lever.x, 0.0);
        Self {
            position: Vector3::new(base.x, base.y, 0.0) + turn * lever,
            velocity: turn * (carried + arm * qd),
            rotation_rate: turn * (at.tool_rotation_rate(qd) + Vector3::new(0.0, 0.0, twist.wz)),
            turn,
            hand: at.rotations[JOINTS - 1],
            lever,
            arm,
        }
    }

    /// Its orientation.
    pub fn orientation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_rotation_matrix(&(self.turn * self.hand))
    }

    /// Velocity per base twist (in the base's frame) and joint speed.
    pub fn jacobian(&self) -> Jacobian8 {
        let mut jacobian = Jacobian8::zeros();
        jacobian.set_column(0, &Vector3::x());
        jacobian.set_column(1, &Vector3::y());
        jacobian.set_column(2, &Vector3::z().cross(&self.lever));
        jacobian.fixed_columns_mut::<JOINTS>(3).copy_from(&self.arm);
        self.turn.matrix() * jacobian
    }

    /// Of the arm alone; 0 is singular.
    pub fn manipulability(&self) -> f64 {
        manipulability(&self.arm)
    }
}

#[cfg(test)]
mod tests {
    use super::super::rigid_body::radians;
    use super::*;

    #[test]
    fn velocity_is_the_slope_of_position() {
        let model = ArmModel::youbot(0.219, 1.0);
        let (q, qd) = (radians([10.0, -30.0, 100.0, 60.0, 5.0]), J5::from([0.3, -0.2, 0.5, 0.1, 0.7]));
        let base = Pose2 { x: 1.0, y: -2.0, th: 0.7 };
        let twist = Twist2 { vx: 0.2, vy: -0.1, wz: 0.4 };
        let dt = 1e-6;
        let now = Tool::of(&model, &q, &qd, base, twist);
        let then = Tool::of(&model, &(q + qd * dt), &qd, base.moved(twist, dt), twist);
        assert!(((then.position - now.position) / dt - now.velocity).norm() < 1e-5);
        let turn = (then.orientation() * now.orientation().inverse()).scaled_axis() / dt;
        assert!((turn - now.rotation_rate).norm() < 1e-4);
        let speeds =
            nalgebra::SVector::<f64, 8>::from([twist.vx, twist.vy, twist.wz, qd[0], qd[1], qd[2], qd[3], qd[4]]);
        assert!((now.jacobian() * speeds - now.velocity).norm() < 1e-12);
    }
}
