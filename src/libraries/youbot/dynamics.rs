//! From the wanted tool force to joint torques and a motion of the base.

use super::base::Twist2;
use super::parameters::{COULOMB, FRICTION_SLOPE, JOINTS, TORQUE_LIMIT, WORKING_POSE_DEG};
use super::plant::joint_ranges;
use super::rigid_body::{ArmModel, J5, Jacobian, Posture, radians};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Tool velocity in the world per base twist (in the base's frame) and joint speed: 3×8.
pub type Jacobian8 = SMatrix<f64, 3, 8>;

/// Parameters of the law.
#[derive(Debug, Clone, Copy)]
pub struct DynamicsParameters {
    /// How the base yields to the tool force: (m/s)/N, (m/s)/N, (rad/s)/(N m). All zero: five degrees of freedom.
    pub force_gain: Vector3<f64>,
    /// Share of gravity that is compensated.
    pub gravity_gain: f64,
    /// Share of Coulomb friction that is compensated.
    pub friction_comp: f64,
    /// Pull to the nominal posture where it does not move the tool, in N m/rad.
    pub posture_stiffness: f64,
    /// Its damping, in N m s/rad.
    pub posture_damping: f64,
    /// How fast the base moves to keep the tool in front of it, in 1/s.
    pub recenter_gain: f64,
    /// Where the tool is wanted, in the arm's base frame, in m.
    pub r_nominal: [f64; 2],
    /// Spring beyond 95 % of a joint's range, in N m/rad.
    pub soft_limit_k: f64,
    /// The nominal posture, in rad.
    pub posture: J5,
    /// Largest torques, in N m.
    pub tau_max: J5,
}

impl Default for DynamicsParameters {
    fn default() -> Self {
        Self {
            force_gain: Vector3::zeros(),
            gravity_gain: 1.0,
            friction_comp: 0.9,
            posture_stiffness: 8.0,
            posture_damping: 3.0,
            recenter_gain: 1.0,
            r_nominal: [0.26, 0.0],
            soft_limit_k: 80.0,
            posture: radians(WORKING_POSE_DEG),
            tau_max: J5::from(TORQUE_LIMIT),
        }
    }
}

/// Share of a joint's range within which the soft limits are silent.
const WORKING_RANGE: f64 = 0.95;
/// Damping of the operational-space inverse near singular poses, in 1/kg.
const SINGULARITY_DAMPING: f64 = 1e-4;
/// Time in which the posture control comes in after engaging, in s.
const POSTURE_RAMP: f64 = 0.3;

/// The law with its memory.
#[derive(Debug, Clone)]
pub struct Dynamics {
    /// The arm as the controller believes it to be.
    pub model: ArmModel,
    /// Its parameters.
    pub parameters: DynamicsParameters,
    engaged: f64,
}

/// What the law answers.
#[derive(Debug, Clone, Copy)]
pub struct DynamicsOutput {
    /// In N m, within `tau_max`.
    pub torque: J5,
    /// For the base, in its frame.
    pub twist: Twist2,
    /// Bit `i`: joint `i + 1` is at its limit.
    pub saturated: u8,
}

/// Torques of the springs beyond 95 % of each joint's range, in N m.
pub fn soft_limits(q: &J5, stiffness: f64) -> J5 {
    let (lower, upper) = joint_ranges();
    let mut out = J5::zeros();
    for i in 0..JOINTS {
        let (middle, half) = (0.5 * (lower[i] + upper[i]), 0.5 * (upper[i] - lower[i]) * WORKING_RANGE);
        let off = q[i] - middle;
        out[i] = -stiffness * (off - off.clamp(-half, half));
    }
    out
}

impl Dynamics {
    /// A law for an arm.
    pub fn new(model: ArmModel) -> Self {
        Self { model, parameters: DynamicsParameters::default(), engaged: 0.0 }
    }

    /// One step of `dt` seconds. `force` is the force wanted on the tool, in the world frame; none: it is stale or
    /// uncoupled, and only gravity and friction are compensated.
    pub fn update(
        &mut self,
        q: &J5,
        qd: &J5,
        jacobian: &Jacobian8,
        force: Option<&Vector3<f64>>,
        dt: f64,
    ) -> DynamicsOutput {
        let p = &self.parameters;
        let at = self.model.posture(q);
        let mut torque = self.model.gravity(&at) * p.gravity_gain + soft_limits(q, p.soft_limit_k);
        for i in 0..JOINTS {
            torque[i] += p.friction_comp * COULOMB[i] * (qd[i] / FRICTION_SLOPE).tanh();
        }
        // Exactly zero is what the impedance controller puts out when it does not couple.
        let coupled = force.filter(|f| f.norm_squared() > 0.0);
        let to = if coupled.is_some() { dt / POSTURE_RAMP } else { -dt / POSTURE_RAMP };
        self.engaged = (self.engaged + to).clamp(0.0, 1.0);
        let mut twist = Twist2::default();
        if let Some(force) = coupled {
            let arm: Jacobian = jacobian.fixed_columns::<JOINTS>(3).into_owned();
            torque += arm.tr_mul(force);
            torque += self.posture_torque(&at, &arm, q, qd) * self.engaged;
            if p.force_gain.iter().any(|g| *g > 0.0) {
                let wrench = jacobian.fixed_columns::<3>(0).tr_mul(force);
                twist = Twist2 {
                    vx: p.force_gain.x * wrench.x + p.recenter_gain * (at.tool.x - p.r_nominal[0]),
                    vy: p.force_gain.y * wrench.y + p.recenter_gain * (at.tool.y - p.r_nominal[1]),
                    wz: p.force_gain.z * wrench.z,
                };
            }
        }
        let mut saturated = 0;
        for i in 0..JOINTS {
            let most = p.tau_max[i];
            if torque[i].abs() >= most {
                saturated |= 1 << i;
                torque[i] = torque[i].clamp(-most, most);
            }
        }
        DynamicsOutput { torque, twist, saturated }
    }

    /// Torque towards the nominal posture, in the null space of the tool's position.
    fn posture_torque(&self, at: &Posture, arm: &Jacobian, q: &J5, qd: &J5) -> J5 {
        let p = &self.parameters;
        let wish = (p.posture - q) * p.posture_stiffness - qd * p.posture_damping;
        let Some(mass) = self.model.mass_matrix_with_drives(at).cholesky() else { return J5::zeros() };
        let mobility = arm * mass.solve(&arm.transpose()) + Matrix3::identity() * SINGULARITY_DAMPING;
        let Some(inertia) = mobility.cholesky() else { return J5::zeros() };
        wish - arm.tr_mul(&inertia.solve(&(arm * mass.solve(&wish))))
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        self.engaged = 0.0;
    }
}

/// What the base is allowed to do.
#[derive(Debug, Clone, Copy)]
pub struct BaseLimits {
    /// In m/s.
    pub v_max: f64,
    /// In rad/s.
    pub w_max: f64,
    /// In m/s² (and rad/s² times one metre).
    pub a_max: f64,
    /// Speeds below it are zero, in m/s.
    pub deadband: f64,
}

impl Default for BaseLimits {
    fn default() -> Self {
        Self { v_max: 0.3, w_max: 0.6, a_max: 1.0, deadband: 0.01 }
    }
}

impl BaseLimits {
    /// The next command after `last`, `dt` seconds later, towards `wanted`.
    pub fn limit(&self, wanted: Twist2, last: Twist2, dt: f64) -> Twist2 {
        let one = |want: f64, last: f64, most: f64| {
            let want = if want.abs() < self.deadband { 0.0 } else { want.clamp(-most, most) };
            last + (want - last).clamp(-self.a_max * dt, self.a_max * dt)
        };
        Twist2 {
            vx: one(wanted.vx, last.vx, self.v_max),
            vy: one(wanted.vy, last.vy, self.v_max),
            wz: one(wanted.wz, last.wz, self.w_max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kinematics::Tool;
    use super::*;

    #[test]
    fn the_posture_does_not_push_the_tool() {
        let model = ArmModel::youbot(0.219, 1.0);
        let law = Dynamics::new(model.clone());
        let q = radians([10.0, -20.0, 90.0, 50.0, 20.0]);
        let at = model.posture(&q);
        let arm = at.jacobian();
        let torque = law.posture_torque(&at, &arm, &q, &J5::zeros());
        assert!(torque.norm() > 0.1);
        let acc = arm * model.mass_matrix_with_drives(&at).cholesky().unwrap().solve(&torque);
        assert!(acc.norm() < 0.01, "{acc}");
    }

    #[test]
    fn uncoupled_it_compensates_gravity_and_nothing_else() {
        let model = ArmModel::youbot(0.219, 1.0);
        let mut law = Dynamics::new(model.clone());
        law.parameters.force_gain = Vector3::new(0.1, 0.1, 0.1);
        let q = radians([0.0, -30.0, 100.0, 60.0, 0.0]);
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        for force in [None, Some(Vector3::zeros())] {
            let out = law.update(&q, &J5::zeros(), &tool.jacobian, force.as_ref(), 0.001);
            assert_eq!(out.torque, model.gravity(&model.posture(&q)));
            assert_eq!(out.twist, Twist2::default());
        }
        let out = law.update(&q, &J5::zeros(), &tool.jacobian, Some(&Vector3::new(2.0, 0.0, 0.0)), 0.001);
        assert!((out.twist.vx - 0.2).abs() < 2e-3, "{:?}", out.twist);
    }

    #[test]
    fn the_base_is_limited() {
        let limits = BaseLimits::default();
        let mut t = Twist2::default();
        for _ in 0..1000 {
            t = limits.limit(Twist2 { vx: 5.0, vy: 0.005, wz: -9.0 }, t, 0.004);
        }
        assert_eq!((t.vx, t.vy, t.wz), (0.3, 0.0, -0.6));
    }
}
