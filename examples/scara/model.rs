//! The arm as a mechanical system: a SCARA (shoulder, elbow, a quill that goes up and down, a wrist) on a rail.
//!
//! All numbers are this example's own: sizes, masses and friction of a small SCARA with 0.45 m of reach, of no make.

use nalgebra::{SMatrix, SVector};
use std::f64::consts::TAU;

/// Rail (m), shoulder, elbow (rad), quill (m, up), wrist (rad).
pub const AXES: usize = 5;
/// One number for each axis.
pub type V5 = SVector<f64, AXES>;
/// From axes to axes.
pub type M5 = SMatrix<f64, AXES, AXES>;
/// Names of the axes by number.
pub const RAIL: usize = 0;
/// The one that goes up and down.
pub const QUILL: usize = 3;

/// Lengths of upper arm and forearm, in m.
const L1: f64 = 0.25;
const L2: f64 = 0.20;
/// Where their centres of mass are, from their joints, in m.
const C1: f64 = 0.12;
const C2: f64 = 0.10;
/// Masses of the carriage on the rail, the upper arm and the forearm, in kg.
const CARRIAGE: f64 = 22.0;
const M1: f64 = 5.0;
const M2: f64 = 4.0;
/// Quill, wrist and gripper, in kg.
const M3: f64 = 1.2;
/// Inertias about their centres of mass, in kg m².
const I1: f64 = 0.040;
const I2: f64 = 0.025;
const I4: f64 = 0.0015;
/// What the motors' rotors add through their gears: kg for rail and quill, kg m² for the joints.
const ROTORS: [f64; AXES] = [6.0, 0.20, 0.07, 0.8, 0.002];
/// In m/s².
const GRAVITY: f64 = 9.81;

/// Coulomb's friction, N or N m, and the viscous one, N s/m or N m s/rad.
pub const COULOMB: [f64; AXES] = [12.0, 1.2, 0.7, 6.0, 0.05];
const VISCOUS: [f64; AXES] = [40.0, 0.8, 0.5, 20.0, 0.01];
/// The ends of the axes' ranges.
pub const LOWER: [f64; AXES] = [-0.40, -2.27, -2.53, -0.20, -TAU];
/// Upper ends.
pub const UPPER: [f64; AXES] = [0.40, 2.27, 2.53, 0.0, TAU];
/// What the motors give at most, N or N m.
pub const LARGEST: [f64; AXES] = [250.0, 25.0, 12.0, 100.0, 1.5];
/// Folded, the quill at its top, the carriage at its end: nothing has to hold it there.
pub const PARKED: [f64; AXES] = [-0.38, 1.75, 2.40, -0.002, 0.0];
/// The elbow bent by 90°, in the middle of the rail.
pub const WORKING: [f64; AXES] = [0.0, 0.785, 1.571, -0.10, 0.0];

/// Stiffness and damping of the stops, N/m and N s/m, for the joints N m/rad and N m s/rad.
const STOPS: [(f64, f64); AXES] = [(60_000.0, 1200.0), (4000.0, 40.0), (3000.0, 30.0), (20_000.0, 200.0), (200.0, 1.0)];
/// What a motor with shorted windings adds to the viscous friction.
const SHORTED: [f64; AXES] = [200.0, 6.0, 3.0, 100.0, 0.1];
/// What the quill's brake holds, in N.
const BRAKE: f64 = 250.0;

/// The longest step of the integration, in s.
pub const STEP: f64 = 0.000_25;
/// How often all axes are gone through for the friction of a step, and the change of speed that ends it.
const SWEEPS: usize = 60;
const SETTLED: f64 = 1e-11;

/// Where a tool is, or how it moves: x along the rail, y away from it, z up (m), and its angle about z (rad).
pub type V4 = SVector<f64, 4>;

/// The masses that the equations are made of.
#[derive(Debug, Clone, Copy)]
pub struct Arm {
    /// Carried by the gripper, in kg.
    pub payload: f64,
}

impl Arm {
    fn tip(self) -> f64 {
        M3 + self.payload
    }

    /// The first moments of the arm about the shoulder and about the elbow, in kg m.
    fn moments(self) -> (f64, f64) {
        (M1 * C1 + (M2 + self.tip()) * L1, M2 * C2 + self.tip() * L2)
    }

    /// The mass matrix, rotors included.
    pub fn mass(self, q: &V5) -> M5 {
        let ((a, b), tip, cos) = (self.moments(), self.tip(), q[2].cos());
        let (s1, s12) = (q[1].sin(), (q[1] + q[2]).sin());
        let forearm = I2 + I4 + M2 * C2 * C2 + tip * L2 * L2;
        let both = forearm + L1 * b * cos;
        let upper = I1 + M1 * C1 * C1 + (M2 + tip) * L1 * L1 + both + L1 * b * cos;
        let (rail_1, rail_2) = (-a * s1 - b * s12, -b * s12);
        let moving = CARRIAGE + M1 + M2 + tip;
        #[rustfmt::skip]
        let links = M5::new(
            moving, rail_1,  rail_2,  0.0, 0.0,
            rail_1, upper,   both,    0.0, I4,
            rail_2, both,    forearm, 0.0, I4,
            0.0,    0.0,     0.0,     tip, 0.0,
            0.0,    I4,      I4,      0.0, I4,
        );
        links + M5::from_diagonal(&V5::from(ROTORS))
    }

    /// Centrifugal and Coriolis forces, and weight: what the motors must give for no acceleration.
    pub fn bias(self, q: &V5, v: &V5) -> V5 {
        let (a, b) = self.moments();
        let both = v[1] + v[2];
        let h = L1 * b * q[2].sin();
        let rail = -a * q[1].cos() * v[1] * v[1] - b * (q[1] + q[2]).cos() * both * both;
        V5::new(rail, -h * (both * both - v[1] * v[1]), h * v[1] * v[1], self.tip() * GRAVITY, 0.0)
    }

    /// Kinetic plus potential energy without that of the stops, in J.
    #[allow(dead_code)] // for the tests of the example
    pub fn energy(self, q: &V5, v: &V5) -> f64 {
        0.5 * v.dot(&(self.mass(q) * v)) + self.tip() * GRAVITY * q[QUILL]
    }
}

/// Where the tool is.
pub fn tool(q: &V5) -> V4 {
    let q12 = q[1] + q[2];
    V4::new(q[0] + L1 * q[1].cos() + L2 * q12.cos(), L1 * q[1].sin() + L2 * q12.sin(), q[QUILL], q12 + q[4])
}

/// How the tool moves with the axes.
pub fn jacobian(q: &V5) -> SMatrix<f64, 4, AXES> {
    let q12 = q[1] + q[2];
    let (x1, y1) = (L1 * q[1].cos(), L1 * q[1].sin());
    let (x2, y2) = (L2 * q12.cos(), L2 * q12.sin());
    #[rustfmt::skip]
    let j = SMatrix::<f64, 4, AXES>::new(
        1.0, -y1 - y2, -y2, 0.0, 0.0,
        0.0,  x1 + x2,  x2, 0.0, 0.0,
        0.0,  0.0,      0.0, 1.0, 0.0,
        0.0,  1.0,      1.0, 0.0, 1.0,
    );
    j
}

/// What is done to the arm for a step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Done {
    /// By the motors, N or N m.
    pub effort: V5,
    /// By somebody, at the tool.
    pub push: V4,
    /// The motors' windings are shorted, and they give nothing.
    pub shorted: bool,
    /// The quill's brake is closed.
    pub brake: bool,
}

/// The arm with its state.
#[derive(Debug, Clone, Copy)]
pub struct Body {
    /// Its masses.
    pub arm: Arm,
    /// Where its axes are.
    pub q: V5,
    /// How they move.
    pub v: V5,
    /// On all friction; 1 is nominal.
    pub friction: f64,
}

impl Body {
    /// At rest.
    pub fn new(q: V5, payload: f64) -> Self {
        Self { arm: Arm { payload }, q, v: V5::zeros(), friction: 1.0 }
    }

    /// Goes on by `time` seconds, in steps no longer than [`STEP`].
    pub fn advance(&mut self, done: &Done, time: f64) {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let steps = (time / STEP - 1e-6).ceil().max(1.0) as u32;
        for _ in 0..steps {
            self.step(done, time / f64::from(steps));
        }
    }

    /// Semi-implicit Euler. Whatever dissipates is in the equation for the new speed: viscous friction and the stops' damping as they are,
    /// Coulomb's as an impulse of up to its limit, which holds an axis at rest where less would do (projected Gauss and Seidel).
    fn step(&mut self, done: &Done, dt: f64) {
        let mut mass = self.arm.mass(&self.q);
        let mut force = jacobian(&self.q).tr_mul(&done.push) - self.arm.bias(&self.q, &self.v);
        if !done.shorted {
            force += done.effort;
        }
        let momentum = mass * self.v;
        let mut most = V5::from(COULOMB) * self.friction;
        for i in 0..AXES {
            let mut damping = VISCOUS[i] * self.friction + if done.shorted { SHORTED[i] } else { 0.0 };
            let beyond = self.q[i] - self.q[i].clamp(LOWER[i], UPPER[i]);
            if beyond != 0.0 {
                force[i] -= STOPS[i].0 * beyond;
                damping += STOPS[i].1;
            }
            mass[(i, i)] += dt * damping;
        }
        if done.brake {
            most[QUILL] += BRAKE;
        }
        let wanted = momentum + force * dt;
        for _ in 0..SWEEPS {
            let mut change: f64 = 0.0;
            for i in 0..AXES {
                let left = wanted[i] - (mass.row(i) * self.v)[0] + mass[(i, i)] * self.v[i];
                let next = (left - left.clamp(-most[i] * dt, most[i] * dt)) / mass[(i, i)];
                change = change.max((next - self.v[i]).abs());
                self.v[i] = next;
            }
            if change < SETTLED {
                break;
            }
        }
        self.q += self.v * dt;
    }
}
