//! How much is followed behind an undo that fails.

use crate::limits;

/// What is followed behind an undo that fails: all, or one batch of a coordinator at a time, and no races.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Behind {
    /// All where little comes before one fails.
    #[default]
    Little,
    /// The same, and all where it is so much that what an operator's safe configuration leads to is not followed anyway: what lies between is
    /// kept small for that. Where nothing else is to be looked at first ([`More`](super::deeper::More)) it is not followed twice so.
    AsItFits,
    /// All.
    All,
}

impl Behind {
    /// Whether only one batch at a time is followed, where before an undo fails there are so many transitions.
    pub fn is_lean(self, before: usize) -> bool {
        match self {
            Self::AsItFits => before > limits::CHECK_LEAN && before <= limits::CHECK_BY_HAND,
            Self::All => false,
            Self::Little => before > limits::CHECK_LEAN,
        }
    }
}
