//! One robot of the coupling: its numbers, its mechanics, and the components that control it.

pub mod base;
pub mod components;
pub mod datagram;
pub mod drives;
pub mod dynamics;
pub mod hand;
pub mod handover;
pub mod identification;
pub mod impedance;
pub mod kinematics;
pub mod link;
pub mod motors;
pub mod network;
pub mod parameters;
pub mod passivity;
pub mod peer_clock;
pub mod plant;
pub mod rigid_body;
pub mod robot;
pub mod tank;
mod tool_space;
pub mod world;

pub use components::library;
