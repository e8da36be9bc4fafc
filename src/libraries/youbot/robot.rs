//! One whole robot in one struct: plant and control laws, stepped at 1 kHz. It is what the stand-in for the other robot
//! is made of, and two of them make the coupling that the figures are measured on.

use super::base::Twist2;
use super::dynamics::{BaseLimits, Coupled, Dynamics};
use super::impedance::{Impedance, Reference};
use super::kinematics::Tool;
use super::plant::{ArmPlant, BasePlant, base_rotation};
use super::rigid_body::{ArmModel, J5};
use nalgebra::Vector3;

/// Control period, in s.
pub const CONTROL_PERIOD: f64 = 0.001;
/// Integration step of the plant, in s.
pub const PLANT_STEP: f64 = 0.0005;
/// Control periods per update of the base.
const BASE_DIVISION: u64 = 4;

/// A robot with its control.
#[derive(Debug, Clone)]
pub struct Robot {
    /// The arm.
    pub arm: ArmPlant,
    /// The base.
    pub base: BasePlant,
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
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        Self {
            arm: ArmPlant::new(model.clone(), q),
            base: BasePlant::default(),
            impedance: Impedance::default(),
            dynamics: Dynamics::new(model),
            base_limits: BaseLimits::default(),
            tool,
            force: Vector3::zeros(),
            raw_norm: 0.0,
            saturated: 0,
            command: Twist2::default(),
            ticks: 0,
        }
    }

    /// One control period: `reference` is the other tool, `coupled` the switch, `push` the hand's force (N, world).
    pub fn step(&mut self, reference: Option<&Reference>, coupled: bool, push: &Vector3<f64>) {
        self.tool = Tool::of(&self.arm.model, &self.arm.q, &self.arm.qd, self.base.pose, self.base.twist);
        let out = self.impedance.update(&self.tool.position, &self.tool.velocity, reference, coupled, CONTROL_PERIOD);
        self.force = out.force;
        self.raw_norm = out.raw_norm;
        let coupled = Coupled { force: out.force, engaged: out.engaged };
        let law = self.dynamics.update(&self.arm.q, &self.arm.qd, &self.tool.jacobian, Some(&coupled), CONTROL_PERIOD);
        self.saturated = law.saturated;
        if self.ticks.is_multiple_of(BASE_DIVISION) {
            #[allow(clippy::cast_precision_loss)]
            let dt = CONTROL_PERIOD * BASE_DIVISION as f64;
            self.command = self.base_limits.limit(law.twist, self.command, dt);
        }
        self.ticks += 1;
        advance(&mut self.arm, &mut self.base, &law.torque, self.command, push, false, CONTROL_PERIOD);
    }
}

/// Moves arm and base on by `dt` seconds, in steps of [`PLANT_STEP`]. `push` is a force on the tool in the world.
pub fn advance(
    arm: &mut ArmPlant,
    base: &mut BasePlant,
    torque: &J5,
    twist: Twist2,
    push: &Vector3<f64>,
    braked: bool,
    dt: f64,
) {
    let steps = (dt / PLANT_STEP).round().max(1.0);
    let force = base_rotation(base.pose).inverse() * push;
    let mut done = 0.0;
    while done < steps {
        let motion = base.step(twist, dt / steps);
        arm.step(torque, &force, &motion, braked, dt / steps);
        done += 1.0;
    }
}
