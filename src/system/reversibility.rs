//! How far a step can be undone, as a word.

use crate::model::words::words;

words! {
    /// How far a step can be undone.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum Reversibility by word {
        /// Its inverse restores the observable state.
        Exact = "exact",
        /// Another call makes good for it.
        Compensated = "compensated",
        /// Nothing undoes it.
        Irreversible = "irreversible",
    }
}
