//! The robot itself, simulated: an arm with friction and drives, on a base that follows its twist with a lag.

use super::base::{Pose2, Twist2};
use super::parameters::{BASE_LAG, BASE_MOUNT, COULOMB, JOINTS, RANGE_LOWER_DEG, RANGE_UPPER_DEG, VISCOUS};
use super::rigid_body::{ArmModel, BaseMotion, J5, M5, Posture, radians};
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Stiffness of the mechanical stops, in N m/rad (assumed: stiff, and slow enough for a step of 0.5 ms).
const STOP_STIFFNESS: f64 = 3000.0;
/// Damping of the mechanical stops, in N m s/rad.
const STOP_DAMPING: f64 = 30.0;
/// What a short-circuited motor adds to a joint's damping, in N m s/rad (assumed): with the drives off the arm sinks,
/// it does not fall freely.
pub const BRAKE_DAMPING: f64 = 15.0;

/// How often all joints are gone through for the friction of a step, and the change (rad/s) that ends it. Drives through gears are most of
/// a joint's inertia: a few times are enough.
const SWEEPS: usize = 50;
const SETTLED: f64 = 1e-10;

/// The arm as a mechanical system.
#[derive(Debug, Clone)]
pub struct ArmPlant {
    /// Its masses.
    pub model: ArmModel,
    /// Angles, in rad.
    pub q: J5,
    /// Speeds, in rad/s.
    pub qd: J5,
    /// Factor on all friction (1 is nominal).
    pub friction_scale: f64,
    lower: J5,
    upper: J5,
}

/// Lower and upper ends of the joint ranges, in rad.
pub fn joint_ranges() -> (J5, J5) {
    (radians(RANGE_LOWER_DEG), radians(RANGE_UPPER_DEG))
}

impl ArmPlant {
    /// An arm at rest at `q`.
    pub fn new(model: ArmModel, q: J5) -> Self {
        let (lower, upper) = joint_ranges();
        Self { model, q, qd: J5::zeros(), friction_scale: 1.0, lower, upper }
    }

    /// Moves on by `dt` seconds under motor `torque` (N m) and a `force` on the tool (N, in the arm's base frame).
    ///
    /// Semi-implicit Euler; everything that dissipates enters the equation implicitly. Coulomb friction is what it is, a
    /// force that takes any value up to its limit at rest and the limit against the motion: the speed is the one that minimizes the
    /// step's energy with it, found joint by joint (projected Gauss and Seidel). So friction stops a joint, holds it, and never makes it chatter.
    ///
    /// `at` is where its parts are now: who moves it has worked that out.
    pub fn step(&mut self, at: &Posture, torque: &J5, force: &Vector3<f64>, base: &BaseMotion, braked: bool, dt: f64) {
        let (mut mass, bias) = self.model.mass_and_bias(at, &self.qd, base);
        let mut push = at.torque_of(force) - bias;
        if !braked {
            push += torque;
        }
        let momentum = mass * self.qd;
        for i in 0..JOINTS {
            let mut damping = self.friction_scale * VISCOUS[i];
            if braked {
                damping += BRAKE_DAMPING;
            }
            let beyond = self.beyond(i);
            if beyond != 0.0 {
                push[i] -= STOP_STIFFNESS * beyond;
                damping += STOP_DAMPING;
            }
            mass[(i, i)] += dt * damping;
        }
        let most = J5::from(COULOMB) * (self.friction_scale * dt);
        self.qd = with_friction(&mass, &(momentum + push * dt), &most, self.qd);
        self.q += self.qd * dt;
    }

    /// How far joint `i` is pressed into a stop, in rad, with its sign.
    fn beyond(&self, i: usize) -> f64 {
        self.q[i] - self.q[i].clamp(self.lower[i], self.upper[i])
    }

    /// Kinetic plus potential energy (that of the stops included), in J.
    #[cfg(test)]
    pub fn energy(&self) -> f64 {
        let at = self.model.posture(&self.q);
        let stops: f64 = (0..JOINTS).map(|i| 0.5 * STOP_STIFFNESS * self.beyond(i).powi(2)).sum();
        0.5 * self.qd.dot(&(self.model.mass_matrix_with_drives(&at) * self.qd)) + self.model.potential(&at) + stops
    }

    /// Where it is.
    pub fn posture(&self) -> Posture {
        self.model.posture(&self.q)
    }
}

/// The speeds `v` with `mass * v + friction = momentum`, where friction (as an impulse) is up to `most` against the motion of each joint and
/// holds what less would hold; from a first guess on. The mass matrix is positive definite for positive masses; should one be given that
/// is not, the arm stands.
fn with_friction(mass: &M5, momentum: &J5, most: &J5, guess: J5) -> J5 {
    let mut v = guess;
    let own = mass.diagonal();
    if own.min() <= 0.0 {
        return J5::zeros();
    }
    let mobility = own.map(f64::recip);
    for _ in 0..SWEEPS {
        let mut change: f64 = 0.0;
        for i in 0..JOINTS {
            // It is symmetric, and its columns lie together.
            let left = momentum[i] - mass.column(i).dot(&v) + own[i] * v[i];
            let next = (left - left.clamp(-most[i], most[i])) * mobility[i];
            change = change.max((next - v[i]).abs());
            v[i] = next;
        }
        if change < SETTLED {
            break;
        }
    }
    if v.iter().all(|speed| speed.is_finite()) { v } else { J5::zeros() }
}

/// The base: follows a commanded twist with a first-order lag.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BasePlant {
    /// Where it stands.
    pub pose: Pose2,
    /// How it moves, in its own frame.
    pub twist: Twist2,
}

impl BasePlant {
    /// Moves on by `dt` seconds; answers what the arm on it feels.
    pub fn step(&mut self, command: Twist2, dt: f64) -> BaseMotion {
        let follow = |now: f64, want: f64| (want - now) / BASE_LAG;
        let t = self.twist;
        let acc = Twist2 { vx: follow(t.vx, command.vx), vy: follow(t.vy, command.vy), wz: follow(t.wz, command.wz) };
        self.twist = Twist2 { vx: t.vx + dt * acc.vx, vy: t.vy + dt * acc.vy, wz: t.wz + dt * acc.wz };
        self.pose = self.pose.moved(self.twist, dt);
        let angular = Vector3::new(0.0, 0.0, self.twist.wz);
        let angular_acc = Vector3::new(0.0, 0.0, acc.wz);
        let mount = Vector3::from(BASE_MOUNT);
        BaseMotion {
            angular,
            angular_acc,
            linear_acc: Vector3::new(acc.vx, acc.vy, 0.0)
                + angular.cross(&Vector3::new(self.twist.vx, self.twist.vy, 0.0))
                + angular_acc.cross(&mount)
                + angular.cross(&angular.cross(&mount)),
        }
    }
}

/// From the base's frame to the world.
pub fn base_rotation(pose: Pose2) -> Rotation3<f64> {
    let (sin, cos) = pose.th.sin_cos();
    Rotation3::from_matrix_unchecked(Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::super::parameters::{PARK_POSE_DEG, WORKING_POSE_DEG};
    use super::*;

    fn arm(degrees: [f64; JOINTS]) -> ArmPlant {
        ArmPlant::new(ArmModel::youbot(0.219, 1.0), radians(degrees))
    }

    #[test]
    fn a_free_arm_never_gains_energy() {
        for friction in [0.0, 1.0] {
            let mut arm = arm([20.0, 40.0, -60.0, 30.0, 10.0]);
            arm.friction_scale = friction;
            let mut before = arm.energy();
            let start = before;
            for _ in 0..4000 {
                arm.step(&arm.posture(), &J5::zeros(), &Vector3::zeros(), &BaseMotion::default(), false, 0.0005);
                let now = arm.energy();
                // Without friction the integrator wobbles about the true energy; with it nothing may come back.
                let bound = if friction == 0.0 { start.max(0.0) * 1.01 } else { before + 1e-3 };
                assert!(now < bound, "{start} {before} {now}");
                before = before.min(now);
            }
            assert!(friction == 0.0 || before < start - 1.0);
        }
    }

    /// How far the joints are off where steps of 5 µs bring them, after a second of falling, of being driven to and fro through rest, and
    /// of being just pushed loose.
    #[test]
    fn a_step_of_half_a_millisecond_is_fine_enough() {
        let after = |case: usize, dt: f64| {
            let mut arm = arm(WORKING_POSE_DEG);
            let steps = (1.0 / dt).round() as u32;
            for i in 0..steps {
                // Torques change every millisecond, whatever the step.
                let t = (f64::from(i) * dt * 1e3 + 1e-6).floor() * 1e-3;
                let sway = J5::from([2.0, 2.0, 1.5, 0.6, 0.4]) * (std::f64::consts::TAU * t).sin();
                let torque = match case {
                    0 => J5::zeros(),
                    1 => arm.model.gravity(&arm.posture()) + sway,
                    _ => arm.model.gravity(&arm.posture()) + J5::from(COULOMB) * 1.05,
                };
                arm.step(&arm.posture(), &torque, &Vector3::zeros(), &BaseMotion::default(), false, dt);
            }
            arm.q
        };
        for case in 0..3 {
            let (fine, moved) = (after(case, 5e-6), after(case, 5e-4));
            let error = (fine - moved).amax();
            assert!(error < 2e-4 && (fine - radians(WORKING_POSE_DEG)).amax() > 0.01, "{case}: {error}");
        }
    }

    #[test]
    fn friction_holds_what_less_would_hold() {
        let mut arm = arm(WORKING_POSE_DEG);
        let before = arm.q;
        for _ in 0..2000 {
            let torque = arm.model.gravity(&arm.posture()) + J5::from(COULOMB) * 0.99;
            arm.step(&arm.posture(), &torque, &Vector3::zeros(), &BaseMotion::default(), false, 0.0005);
        }
        assert_eq!(arm.q, before, "not a creep of a nanoradian");
    }

    #[test]
    fn folded_it_rests_unfolded_it_sinks() {
        let sink = |degrees| {
            let mut arm = arm(degrees);
            let before = arm.posture().tool.z;
            for _ in 0..2000 {
                arm.step(&arm.posture(), &J5::zeros(), &Vector3::zeros(), &BaseMotion::default(), true, 0.0005);
            }
            before - arm.posture().tool.z
        };
        assert!(sink(PARK_POSE_DEG).abs() < 0.02, "{}", sink(PARK_POSE_DEG));
        assert!(sink(WORKING_POSE_DEG) > 0.05, "{}", sink(WORKING_POSE_DEG));
    }

    #[test]
    fn gravity_compensation_holds_it() {
        let mut arm = arm(WORKING_POSE_DEG);
        let before = arm.q;
        for _ in 0..4000 {
            let torque = arm.model.gravity(&arm.posture());
            arm.step(&arm.posture(), &torque, &Vector3::zeros(), &BaseMotion::default(), false, 0.0005);
        }
        assert!((arm.q - before).norm() < 1e-6);
    }

    #[test]
    fn the_base_arrives() {
        let mut base = BasePlant::default();
        for _ in 0..2000 {
            base.step(Twist2 { vx: 0.2, vy: 0.0, wz: 0.0 }, 0.0005);
        }
        assert!((base.pose.x - 0.2 * (1.0 - BASE_LAG)).abs() < 1e-3, "{}", base.pose.x);
    }
}
