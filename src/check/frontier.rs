//! States that are still to be followed: those with the least failing first, of these those with the shortest ways, of these those
//! that were met first.

use super::state::Failed;
use std::collections::BTreeMap;

/// All of them, those that are as good together.
#[derive(Default)]
pub(super) struct Frontier(BTreeMap<(Failed, u32), Level>);

/// States on whose ways as much fails, and that are as long.
#[derive(Default)]
struct Level {
    /// The next one last, where they are in order.
    states: Vec<u32>,
    in_order: bool,
}

impl Frontier {
    /// One more, on whose way this fails at worst and that is so long.
    pub fn push(&mut self, failed: Failed, depth: u32, at: u32) {
        let level = self.0.entry((failed, depth)).or_default();
        level.in_order = false;
        level.states.push(at);
    }

    /// The next one, and what fails on its way at worst.
    pub fn pop(&mut self) -> Option<(Failed, u32)> {
        let mut first = self.0.first_entry()?;
        let (failed, _) = *first.key();
        let level = first.get_mut();
        // While one is followed, what comes of it lies further on.
        if !std::mem::replace(&mut level.in_order, true) {
            level.states.sort_unstable_by(|a, b| b.cmp(a));
        }
        let at = level.states.pop();
        if level.states.is_empty() {
            first.remove();
        }
        at.map(|at| (failed, at))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_comes_first_whenever_it_was_met() {
        let mut open = Frontier::default();
        for (failed, depth, at) in [(Failed::Apply, 1, 4), (Failed::Nothing, 3, 2), (Failed::Nothing, 2, 7)] {
            open.push(failed, depth, at);
        }
        open.push(Failed::Nothing, 2, 9);
        assert_eq!(open.pop(), Some((Failed::Nothing, 7)));
        open.push(Failed::Nothing, 2, 8);
        let rest: Vec<_> = std::iter::from_fn(|| open.pop()).collect();
        let nothing = [8, 9, 2].map(|at| (Failed::Nothing, at));
        assert_eq!(rest[..3], nothing);
        assert_eq!(rest[3..], [(Failed::Apply, 4)]);
    }
}
