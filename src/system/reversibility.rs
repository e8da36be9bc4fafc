//! How far a step can be undone, as a word.

/// How far a step can be undone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Reversibility {
    /// Its inverse restores the observable state.
    Exact,
    /// Another call makes good for it.
    Compensated,
    /// Nothing undoes it.
    Irreversible,
}
