//! Component libraries, written against the runtime as any user's library would be.

pub mod monitors;
pub mod standard;
pub mod youbot;

use crate::runtime::Libraries;

/// The libraries that come with the program.
pub fn builtin() -> Libraries {
    Libraries::new().with(standard::library()).with(youbot::library())
}
