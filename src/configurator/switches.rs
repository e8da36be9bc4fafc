//! A plan that is carried out again, prepared on both sides.

use crate::platform::Prepared;
use crate::stack::Switch;

/// A plan that is carried out again, prepared on both sides.
pub(super) struct Fast {
    pub switch: Switch,
    pub platform: Box<dyn Prepared>,
}
