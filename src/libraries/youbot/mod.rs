//! One robot of the coupling: its numbers, its mechanics, and the components that control it.

pub mod base;
pub mod parameters;
pub mod rigid_body;
