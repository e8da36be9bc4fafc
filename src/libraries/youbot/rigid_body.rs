//! Rigid-body dynamics of the arm: gravity, mass matrix, inverse dynamics.
//!
//! All vectors are written in the arm's base frame: with five joints in a row that is cheaper than spatial algebra in
//! link frames, and easier to read. Inverse dynamics is the recursive Newton–Euler algorithm, the mass matrix the
//! composite-rigid-body algorithm (Featherstone, *Rigid Body Dynamics Algorithms*, chapters 5 and 6). Checked against
//! Pinocchio to 1e-9 (`tests/golden/`). Nothing here allocates.

use super::parameters::{
    ArmLink, BASE_MOUNT, GRAVITY, GRIPPER, JOINT_AXIS, JOINT_ORIGIN, JOINTS, LINKS, REFLECTED_INERTIA, TOOL_OFFSET,
};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector3};

/// Five joint values: angles in rad, speeds in rad/s, torques in N m.
pub type J5 = SVector<f64, JOINTS>;
/// A 5×5 matrix over the joints.
pub type M5 = SMatrix<f64, JOINTS, JOINTS>;
/// Tool velocity per joint speed, in m: 3×5.
pub type Jacobian = SMatrix<f64, 3, JOINTS>;

/// Masses and geometry of an arm.
#[derive(Debug, Clone)]
pub struct ArmModel {
    /// Links 1 to 5; the last carries what hangs on the tool.
    links: [RigidBody; JOINTS],
    /// From one joint to the next, in the previous link's frame.
    offsets: [Vector3<f64>; JOINTS],
    /// Which axis of its frame each joint turns about, and which way (1 or -1).
    axes: [(usize, f64); JOINTS],
    /// The tool point in the frame of joint 5, in m.
    pub tool: Vector3<f64>,
    /// The arm's base frame in the mobile base's, in m.
    pub mount: Vector3<f64>,
    /// Inertia of the drives, added to the mass matrix's diagonal, in kg m².
    pub reflected: J5,
}

#[derive(Debug, Clone, Copy)]
struct RigidBody {
    mass: f64,
    com: Vector3<f64>,
    inertia: Matrix3<f64>,
}

impl RigidBody {
    fn of(link: &ArmLink) -> Self {
        Self {
            mass: link.mass,
            com: Vector3::from(link.com),
            inertia: Matrix3::from_diagonal(&Vector3::from(link.inertia)),
        }
    }

    fn scaled(self, k: f64) -> Self {
        Self { mass: self.mass * k, com: self.com, inertia: self.inertia * k }
    }

    /// Two bodies as one.
    fn join(self, other: Self) -> Self {
        let mass = self.mass + other.mass;
        if mass <= 0.0 {
            return self;
        }
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let about = |b: &Self| {
            let d = b.com - com;
            b.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * b.mass
        };
        Self { mass, com, inertia: about(&self) + about(&other) }
    }
}

/// An inertia seen from the frame that `r` leads to: `r * inertia * rᵀ`, half of which is the other half.
fn turned(inertia: &Matrix3<f64>, r: &Matrix3<f64>) -> Matrix3<f64> {
    let half = r * inertia;
    let at = |i: usize, j: usize| half[(i, 0)] * r[(j, 0)] + half[(i, 1)] * r[(j, 1)] + half[(i, 2)] * r[(j, 2)];
    let (xy, xz, yz) = (at(0, 1), at(0, 2), at(1, 2));
    Matrix3::new(at(0, 0), xy, xz, xy, at(1, 1), yz, xz, yz, at(2, 2))
}

/// A body about the origin of the base's frame: of several as one it is the sum.
#[derive(Debug, Clone, Copy)]
struct Inertia {
    mass: f64,
    /// Mass by centre of mass, in kg m.
    moment: Vector3<f64>,
    /// In kg m².
    about: Matrix3<f64>,
}

impl Inertia {
    fn none() -> Self {
        Self { mass: 0.0, moment: Vector3::zeros(), about: Matrix3::zeros() }
    }

    fn add(&mut self, body: &RigidBody) {
        let (c, moment) = (&body.com, body.com * body.mass);
        self.mass += body.mass;
        self.moment += moment;
        self.about += body.inertia + Matrix3::from_diagonal_element(c.dot(&moment)) - moment * c.transpose();
    }
}

/// What the arm stands on is doing, in the arm's base frame.
#[derive(Debug, Clone, Copy, Default)]
pub struct BaseMotion {
    /// Angular velocity, in rad/s.
    pub angular: Vector3<f64>,
    /// Angular acceleration, in rad/s².
    pub angular_acc: Vector3<f64>,
    /// Acceleration of the frame's origin, in m/s².
    pub linear_acc: Vector3<f64>,
}

/// The arm in one pose: where its frames are. Everything else is computed from it.
#[derive(Debug, Clone)]
pub struct Posture {
    /// Joint origins, in m.
    pub origins: [Vector3<f64>; JOINTS],
    /// Orientations of the links.
    pub rotations: [Rotation3<f64>; JOINTS],
    /// Joint axes.
    pub axes: [Vector3<f64>; JOINTS],
    /// The tool point, in m.
    pub tool: Vector3<f64>,
}

impl ArmModel {
    /// The youBot's arm, carrying `payload` kg at the tool (the gripper alone is 0.219 kg), all link masses scaled by
    /// `mass_scale` (1 is nominal; others make a model that does not match).
    pub fn youbot(payload: f64, mass_scale: f64) -> Self {
        let mut links = LINKS.map(|l| RigidBody::of(&l).scaled(mass_scale));
        links[JOINTS - 1] = links[JOINTS - 1].join(RigidBody::of(&GRIPPER).scaled(payload / GRIPPER.mass));
        Self {
            links,
            offsets: JOINT_ORIGIN.map(Vector3::from),
            axes: JOINT_AXIS.map(|a| {
                let along = Vector3::from(a).iamax();
                (along, a[along])
            }),
            tool: Vector3::from(TOOL_OFFSET),
            mount: Vector3::from(BASE_MOUNT),
            reflected: J5::from(REFLECTED_INERTIA),
        }
    }

    /// Where everything is at angles `q`, in rad from candle.
    pub fn posture(&self, q: &J5) -> Posture {
        let mut out = Posture {
            origins: [Vector3::zeros(); JOINTS],
            rotations: [Rotation3::identity(); JOINTS],
            axes: [Vector3::zeros(); JOINTS],
            tool: Vector3::zeros(),
        };
        let mut columns = Matrix3::identity();
        let mut origin = Vector3::zeros();
        let mut rotation = Rotation3::identity();
        for i in 0..JOINTS {
            origin += columns * self.offsets[i];
            let (along, way) = self.axes[i];
            out.axes[i] = columns.column(along) * way;
            // About an axis of its own frame: that column stays, the other two turn in their plane.
            let (sin, cos) = (q[i] * way).sin_cos();
            let (a, b) = ((along + 1) % 3, (along + 2) % 3);
            let (u, v) = (columns.column(a).into_owned(), columns.column(b).into_owned());
            columns.set_column(a, &(u * cos + v * sin));
            columns.set_column(b, &(v * cos - u * sin));
            rotation = Rotation3::from_matrix_unchecked(columns);
            out.origins[i] = origin;
            out.rotations[i] = rotation;
        }
        out.tool = origin + rotation * self.tool;
        out
    }

    /// The links where they are.
    fn bodies(&self, at: &Posture) -> [RigidBody; JOINTS] {
        std::array::from_fn(|i| {
            let (r, b) = (at.rotations[i].matrix(), &self.links[i]);
            RigidBody { mass: b.mass, com: at.origins[i] + r * b.com, inertia: turned(&b.inertia, r) }
        })
    }

    /// Joint torques that hold the arm still against gravity, in N m.
    pub fn gravity(&self, at: &Posture) -> J5 {
        let mut out = J5::zeros();
        let (mut mass, mut moment) = (0.0, Vector3::zeros());
        for i in (0..JOINTS).rev() {
            let link = &self.links[i];
            mass += link.mass;
            moment += (at.origins[i] + at.rotations[i] * link.com) * link.mass;
            let lever = moment - at.origins[i] * mass;
            out[i] = at.axes[i].dot(&lever.cross(&Vector3::new(0.0, 0.0, GRAVITY)));
        }
        out
    }

    /// Potential energy, in J, zero at the arm's base plane.
    #[cfg(test)]
    pub fn potential(&self, at: &Posture) -> f64 {
        (0..JOINTS)
            .map(|i| self.links[i].mass * GRAVITY * (at.origins[i] + at.rotations[i] * self.links[i].com).z)
            .sum()
    }

    /// The mass matrix, in kg m², without the drives' inertia.
    pub fn mass_matrix(&self, at: &Posture) -> M5 {
        Self::mass_matrix_of(&self.bodies(at), at)
    }

    fn mass_matrix_of(bodies: &[RigidBody; JOINTS], at: &Posture) -> M5 {
        let mut out = M5::zeros();
        let mut composite = Inertia::none();
        // What is at the origin moves so where joint i alone turns at 1 rad/s.
        let origins: [Vector3<f64>; JOINTS] = std::array::from_fn(|i| at.origins[i].cross(&at.axes[i]));
        for i in (0..JOINTS).rev() {
            composite.add(&bodies[i]);
            // Momentum of all that joint i carries then, and its moment about the origin.
            let momentum = origins[i] * composite.mass + at.axes[i].cross(&composite.moment);
            let moment = composite.about * at.axes[i] + composite.moment.cross(&origins[i]);
            for j in 0..=i {
                let value = at.axes[j].dot(&moment) + origins[j].dot(&momentum);
                out[(i, j)] = value;
                out[(j, i)] = value;
            }
        }
        out
    }

    /// The mass matrix with the drives' inertia seen through the gears, in kg m².
    pub fn mass_matrix_with_drives(&self, at: &Posture) -> M5 {
        self.with_drives(self.mass_matrix(at))
    }

    fn with_drives(&self, mut m: M5) -> M5 {
        for i in 0..JOINTS {
            m[(i, i)] += self.reflected[i];
        }
        m
    }

    /// The mass matrix with the drives' inertia, and the torques that hold the speeds `qd` as they are, together: both are made of the
    /// links where they are.
    pub fn mass_and_bias(&self, at: &Posture, qd: &J5, base: &BaseMotion) -> (M5, J5) {
        let bodies = self.bodies(at);
        let mass = self.with_drives(Self::mass_matrix_of(&bodies, at));
        (mass, Self::inverse_dynamics_of(&bodies, at, qd, &J5::zeros(), base))
    }

    /// Joint torques for the accelerations `qdd` at speeds `qd` (gravity, Coriolis and centrifugal terms included; the
    /// drives' inertia is not), in N m.
    pub fn inverse_dynamics(&self, at: &Posture, qd: &J5, qdd: &J5, base: &BaseMotion) -> J5 {
        Self::inverse_dynamics_of(&self.bodies(at), at, qd, qdd, base)
    }

    fn inverse_dynamics_of(bodies: &[RigidBody; JOINTS], at: &Posture, qd: &J5, qdd: &J5, base: &BaseMotion) -> J5 {
        let mut forces = [Vector3::zeros(); JOINTS];
        let mut torques = [Vector3::zeros(); JOINTS];
        let mut levers = [Vector3::zeros(); JOINTS];
        let (mut w, mut dw) = (base.angular, base.angular_acc);
        let mut acc = base.linear_acc + Vector3::new(0.0, 0.0, GRAVITY);
        let mut previous = Vector3::zeros();
        for i in 0..JOINTS {
            let r = at.origins[i] - previous;
            acc += dw.cross(&r) + w.cross(&w.cross(&r));
            let spin = at.axes[i] * qd[i];
            dw += at.axes[i] * qdd[i] + w.cross(&spin);
            w += spin;
            let body = &bodies[i];
            let s = body.com - at.origins[i];
            forces[i] = (acc + dw.cross(&s) + w.cross(&w.cross(&s))) * body.mass;
            torques[i] = body.inertia * dw + w.cross(&(body.inertia * w));
            levers[i] = s;
            previous = at.origins[i];
        }
        let mut out = J5::zeros();
        let (mut f, mut n) = (Vector3::zeros(), Vector3::zeros());
        for i in (0..JOINTS).rev() {
            if i + 1 < JOINTS {
                n += (at.origins[i + 1] - at.origins[i]).cross(&f);
            }
            n += torques[i] + levers[i].cross(&forces[i]);
            f += forces[i];
            out[i] = at.axes[i].dot(&n);
        }
        out
    }
}

impl Posture {
    /// Tool velocity per joint speed.
    pub fn jacobian(&self) -> Jacobian {
        let mut out = Jacobian::zeros();
        for i in 0..JOINTS {
            out.set_column(i, &self.axes[i].cross(&(self.tool - self.origins[i])));
        }
        out
    }

    /// Joint torques that a force on the tool comes to, in N m: the transposed [`Self::jacobian`] times the force.
    pub fn torque_of(&self, force: &Vector3<f64>) -> J5 {
        // Each the joint's share of the force's moment about it.
        J5::from_fn(|i, _| self.axes[i].dot(&(self.tool - self.origins[i]).cross(force)))
    }

    /// Angular velocity of the tool at joint speeds `qd`, in rad/s.
    pub fn tool_rotation_rate(&self, qd: &J5) -> Vector3<f64> {
        (0..JOINTS).map(|i| self.axes[i] * qd[i]).sum()
    }
}

/// How far from singular a Jacobian is: the root of `det(J Jᵀ)`, 0 in the candle pose.
pub fn manipulability(jacobian: &Jacobian) -> f64 {
    (jacobian * jacobian.transpose()).determinant().max(0.0).sqrt()
}

/// Degrees as radians.
pub fn radians(degrees: [f64; JOINTS]) -> J5 {
    J5::from(degrees.map(f64::to_radians))
}

#[cfg(test)]
mod tests {
    use super::super::parameters::WORKING_POSE_DEG;
    use super::*;

    #[test]
    fn inverse_dynamics_is_mass_matrix_plus_bias() {
        let model = ArmModel::youbot(0.219, 1.0);
        let at = model.posture(&radians([10.0, -30.0, 100.0, 60.0, 30.0]));
        let qd = J5::from([0.3, -0.5, 0.7, 0.2, -1.0]);
        let qdd = J5::from([1.0, 2.0, -3.0, 0.5, 0.1]);
        let base = BaseMotion::default();
        let bias = model.inverse_dynamics(&at, &qd, &J5::zeros(), &base);
        let full = model.inverse_dynamics(&at, &qd, &qdd, &base);
        assert!((full - bias - model.mass_matrix(&at) * qdd).norm() < 1e-12);
        let still = model.inverse_dynamics(&at, &J5::zeros(), &J5::zeros(), &base);
        assert!((still - model.gravity(&at)).norm() < 1e-12);
    }

    #[test]
    fn joints_turn_about_their_axes() {
        let model = ArmModel::youbot(0.219, 1.0);
        let q = radians([10.0, -30.0, 100.0, 60.0, 30.0]);
        let at = model.posture(&q);
        let (mut turned, mut origin) = (Rotation3::identity(), Vector3::zeros());
        for i in 0..JOINTS {
            let axis = nalgebra::Unit::new_normalize(Vector3::from(JOINT_AXIS[i]));
            assert_eq!(axis.norm_squared(), axis.amax(), "an axis of the frame");
            origin += turned * Vector3::from(JOINT_ORIGIN[i]);
            assert!((turned * axis.into_inner() - at.axes[i]).norm() < 1e-12);
            turned *= Rotation3::from_axis_angle(&axis, q[i]);
            assert!((turned.matrix() - at.rotations[i].matrix()).norm() < 1e-12);
            assert!((origin - at.origins[i]).norm() < 1e-12);
        }
        assert!((origin + turned * Vector3::from(TOOL_OFFSET) - at.tool).norm() < 1e-12);
    }

    #[test]
    fn gravity_is_the_slope_of_the_potential() {
        let model = ArmModel::youbot(0.5, 1.1);
        let q = radians([20.0, 40.0, -70.0, 50.0, 10.0]);
        let g = model.gravity(&model.posture(&q));
        for i in 0..JOINTS {
            let mut step = J5::zeros();
            step[i] = 1e-6;
            let slope =
                (model.potential(&model.posture(&(q + step))) - model.potential(&model.posture(&(q - step)))) / 2e-6;
            assert!((slope - g[i]).abs() < 1e-7, "joint {i}: {slope} {}", g[i]);
        }
    }

    #[test]
    fn the_working_pose_and_the_candle() {
        let model = ArmModel::youbot(0.219, 1.0);
        let at = model.posture(&radians(WORKING_POSE_DEG));
        assert!((at.tool - Vector3::new(0.259, 0.0, 0.167)).norm() < 1e-3, "{}", at.tool);
        let candle = model.posture(&J5::zeros());
        assert!(manipulability(&candle.jacobian()) < 1e-9);
        // Horizontal: joint 2 needs more than the 9.5 N m of the URDF.
        let flat = model.gravity(&model.posture(&radians([0.0, 90.0, 0.0, 0.0, 0.0])));
        assert!((flat[1].abs() - 10.04).abs() < 0.01, "{flat}");
    }
}
