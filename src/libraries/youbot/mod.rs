//! One robot of the coupling: its numbers, its mechanics, and the components that control it.

pub mod base;
pub mod dynamics;
pub mod impedance;
pub mod kinematics;
pub mod parameters;
pub mod plant;
pub mod rigid_body;
