//! A switch that was prepared on both sides.

use crate::plan::prepare::Switch;
use crate::platform::Prepared;

/// A switch, prepared on both sides.
pub(super) struct Fast {
    pub switch: Switch,
    pub platform: Box<dyn Prepared>,
}
