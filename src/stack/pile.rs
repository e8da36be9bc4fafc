//! Which frames are kept within one bound, and whose floors hold back what (semantics: *The stack*).
//!
//! A coordinator asks for configurations of its own file only, so its frames are one pile. Operators ask for those of all files: of
//! theirs each subsystem has a pile of its own, or what was squashed would be about two of them, and be in the way of either's way down.

use super::{Frame, Requester};
use crate::model::names::is_within;

/// Frames that are counted together, and squashed with each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Pile {
    requester: Requester,
    /// Of operators, and of what acts by itself: the path of the subsystem.
    inside: &'static str,
}

impl Pile {
    /// Whether a frame is of it.
    pub(super) fn has(self, frame: &Frame) -> bool {
        // What a frame is about is looked at last: that takes longest.
        frame.requester == self.requester && (self.is_whole() || frame.inside() == self.inside)
    }

    fn is_whole(self) -> bool {
        matches!(self.requester, Requester::Coordinator(_))
    }
}

impl std::fmt::Display for Pile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.inside {
            "" => write!(f, "`{}`", self.requester),
            path => write!(f, "`{}` in `{path}`", self.requester),
        }
    }
}

impl Frame {
    /// The pile that it is of.
    pub(super) fn pile(&self) -> Pile {
        let whole = Pile { requester: self.requester, inside: "" };
        if whole.is_whole() { whole } else { Pile { inside: self.inside(), ..whole } }
    }

    /// The path of the innermost subsystem in which everything is that it is about; empty: the deployment itself.
    pub fn inside(&self) -> &'static str {
        let touched = self.footprint.touches.iter().map(|touch| touch.slot.components());
        let paths = touched.flat_map(|(a, b)| [a.prefix(), b.prefix()]);
        paths.reduce(both).unwrap_or_else(|| self.configuration.prefix())
    }

    /// Whether a configuration of the file of that path is in it.
    pub(super) fn is_of_file(&self, path: &str) -> bool {
        match self.is_squashed() {
            true => self.parts.iter().any(|part| part.configuration.prefix() == path),
            false => self.configuration.prefix() == path,
        }
    }

    /// Whether configurations of one file are in both.
    pub(super) fn is_of_a_file_of(&self, other: &Self) -> bool {
        match self.is_squashed() {
            true => self.parts.iter().any(|part| other.is_of_file(part.configuration.prefix())),
            false => other.is_of_file(self.configuration.prefix()),
        }
    }
}

/// The innermost subsystem that has both of these in it.
fn both(a: &'static str, b: &'static str) -> &'static str {
    if is_within(b, a) {
        return a;
    }
    let ends = a.match_indices('/').map(|(at, _)| at).rev();
    ends.map(|end| &a[..end]).find(|outer| is_within(b, outer)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::both;

    #[test]
    fn the_innermost_of_two_is_whole_names_of_their_paths() {
        assert_eq!(both("left", "left"), "left");
        assert_eq!(both("left", "left/arm"), "left");
        assert_eq!(both("left/arm", "left"), "left");
        assert_eq!(both("left/arm", "left/army"), "left");
        assert_eq!(both("a/b/c", "a/b/d"), "a/b");
        assert_eq!(both("left", "leftover"), "");
        assert_eq!(both("", "left"), "");
    }
}
