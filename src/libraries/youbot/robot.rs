//! One whole robot in one struct: plant and control laws, stepped at 1 kHz. It is what the stand-in for the other robot
//! is made of, and two of them make the coupling that the figures are measured on.

use super::base::{BaseLimits, Twist2};
use super::dynamics::{Coupled, Dynamics};
use super::impedance::{Impedance, Reference};
use super::kinematics::Tool;
use super::rigid_body::{ArmModel, J5};
use super::world::RobotBody;
use nalgebra::Vector3;

/// Control period, in s.
pub const CONTROL_PERIOD: f64 = 0.001;
/// Control periods per update of the base.
const BASE_DIVISION: u64 = 4;

/// A robot with its control.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Arm and base, and what they touch.
    pub body: RobotBody,
    /// The coupling's law.
    pub impedance: Impedance,
    /// Torques and twist.
    pub dynamics: Dynamics,
    /// What the base may do.
    pub base_limits: BaseLimits,
    /// Where the tool was before the last step.
    pub tool: Tool,
    /// The force it put on its own tool, in N.
    pub force: Vector3<f64>,
    /// Norm of the force it wants, in N.
    pub raw_norm: f64,
    /// Joints at their limits in the last step.
    pub saturated: u8,
    command: Twist2,
    ticks: u64,
}

impl Robot {
    /// A robot at rest with its joints at `q`, its controller knowing the plant exactly.
    pub fn new(q: J5) -> Self {
        let model = ArmModel::youbot(super::parameters::GRIPPER.mass, 1.0);
        let body = RobotBody::new(q, 1.0);
        Self {
            tool: body.tool(),
            body,
            impedance: Impedance::default(),
            dynamics: Dynamics::new(model),
            base_limits: BaseLimits::default(),
            force: Vector3::zeros(),
            raw_norm: 0.0,
            saturated: 0,
            command: Twist2::default(),
            ticks: 0,
        }
    }

    /// One control period: `reference` is the other tool, `coupled` the switch, `peer_yields` whether the other base gives way too,
    /// `push` the hand's force (N, world).
    pub fn step(&mut self, reference: Option<&Reference>, coupled: bool, peer_yields: bool, push: &Vector3<f64>) {
        self.tool = self.body.tool();
        let out = self.impedance.update(&self.tool.position, &self.tool.velocity, reference, coupled, CONTROL_PERIOD);
        self.force = out.force;
        self.raw_norm = out.raw_norm;
        let coupled = Coupled { force: out.force, engaged: out.engaged, peer_yields };
        let law = self.dynamics.update(
            &self.body.arm.q,
            &self.body.arm.qd,
            &self.tool.jacobian(),
            self.body.base.twist,
            Some(&coupled),
            CONTROL_PERIOD,
        );
        self.saturated = law.saturated;
        if self.ticks.is_multiple_of(BASE_DIVISION) {
            #[allow(clippy::cast_precision_loss)]
            let dt = CONTROL_PERIOD * BASE_DIVISION as f64;
            self.command = self.base_limits.limit(law.twist, self.command, dt);
        }
        self.ticks += 1;
        self.body.advance(&law.torque, self.command, push, false, CONTROL_PERIOD);
    }
}
