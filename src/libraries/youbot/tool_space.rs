//! The arm as its tool feels it: apparent mass, and the joint speeds that go with a speed of the tool.

use super::parameters::JOINTS;
use super::rigid_body::{ArmModel, J5, Jacobian, Posture};
use nalgebra::{Cholesky, Const, Matrix3, Vector3};

/// Damping of the operational-space inverse near singular poses, in 1/kg.
const SINGULARITY_DAMPING: f64 = 1e-4;
/// How fast the joints may have to turn for a base that goes faster than the tool, in rad/s: the wrist, which is light and has a
/// long lever, makes up for most of it.
pub const LEFT_BEHIND: f64 = 0.3;

/// The arm as its tool feels it.
pub struct ToolSpace {
    /// Tool velocity in the world per joint speed.
    pub arm: Jacobian,
    /// Of the joints, with the drives.
    pub mass: Cholesky<f64, Const<JOINTS>>,
    /// Of the inverse of the tool's apparent mass.
    pub inertia: Cholesky<f64, Const<3>>,
}

impl ToolSpace {
    /// None: the masses given are not those of a body.
    pub fn of(model: &ArmModel, at: &Posture, arm: &Jacobian) -> Option<Self> {
        let mass = model.mass_matrix_with_drives(at).cholesky()?;
        let mobility = arm * mass.solve(&arm.transpose()) + Matrix3::identity() * SINGULARITY_DAMPING;
        Some(Self { arm: *arm, mass, inertia: mobility.cholesky()? })
    }

    /// Joint speeds with which a force on the tool would make it move with `speed` (m/s, in the world).
    pub fn joints(&self, speed: &Vector3<f64>) -> J5 {
        self.mass.solve(&self.arm.tr_mul(&self.inertia.solve(speed)))
    }

    /// The share of a motion of the base that the joints make up for, where the tool, which would be carried along with
    /// `carried`, goes with `speed` (both in m/s, in the world). A base that went faster, whether it is after the tool or gives way
    /// to a force, would turn the joints as a push does, which is an overspeed.
    pub fn share_followed(&self, carried: &Vector3<f64>, speed: &Vector3<f64>) -> f64 {
        let Some(ahead) = carried.try_normalize(f64::EPSILON) else { return 1.0 };
        let most = speed.dot(&ahead).max(0.0) + LEFT_BEHIND / self.joints(&ahead).amax();
        (most / carried.norm()).min(1.0)
    }
}
