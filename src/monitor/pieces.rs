//! The pieces of a signal that may still become the largest in a sliding window.

use super::grade::Grade;
use super::ring::Ring;

/// Pieces from old to new, each with the position at which it leaves the window; values fall from front to back, since a
/// piece that is followed by a larger one can never be the largest again.
#[derive(Debug, Clone)]
pub struct Pieces {
    ring: Ring<(u64, Grade)>,
    most: usize,
    upward: bool,
    merged: u64,
}

impl Pieces {
    /// Without pieces. At most `most` are kept (two at least); merging makes values too large where `upward`, else too
    /// small.
    pub fn new(most: usize, upward: bool) -> Self {
        let most = most.max(2);
        Self { ring: Ring::new(most), most, upward, merged: 0 }
    }

    /// Forgets everything but the count of what was merged.
    pub fn clear(&mut self) {
        self.ring.clear();
    }

    /// How many pieces were merged so far.
    pub fn merged(&self) -> u64 {
        self.merged
    }

    /// Adds a piece newer than all others; `exit` is not before theirs.
    pub fn push(&mut self, exit: u64, value: Grade) {
        while self.ring.back().is_some_and(|(_, older)| !value.less(*older)) {
            self.ring.pop_back();
        }
        if self.ring.len() == self.most {
            self.halve();
        }
        self.ring.push_back((exit, value));
    }

    /// Gives the newest piece the position at which it leaves.
    pub fn close(&mut self, exit: u64) {
        if let Some(newest) = self.ring.back_mut() {
            newest.0 = exit;
        }
    }

    /// No value may be more than `limit`.
    pub fn cap(&mut self, limit: Grade) {
        let mut capped = None;
        while let Some((exit, value)) = self.ring.front().copied()
            && !value.less(limit)
        {
            capped = Some(exit);
            self.ring.pop_front();
        }
        // Of pieces with the same value the one that stays longest does for all.
        if let Some(exit) = capped {
            self.ring.push_front((exit, limit));
        }
    }

    /// Drops what has left at `position`.
    pub fn expire(&mut self, position: u64) {
        while self.ring.front().is_some_and(|(exit, _)| *exit <= position) {
            self.ring.pop_front();
        }
    }

    /// The largest value; false without distance when there is none.
    pub fn best(&self) -> Grade {
        self.ring.front().map_or(Grade::BOTTOM, |(_, value)| *value)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }

    /// The position at which the next piece leaves.
    pub fn next(&self) -> u64 {
        self.ring.front().map_or(u64::MAX, |(exit, _)| *exit)
    }

    /// Merges every second piece into its newer neighbour. Done once in so many pushes as there are pieces left, so a
    /// push still costs the same.
    fn halve(&mut self) {
        let pairs = self.ring.len() / 2;
        for i in 0..pairs {
            let (old, new) = (self.ring[2 * i], self.ring[2 * i + 1]);
            self.ring[i] = (new.0, if self.upward { old.1 } else { new.1 });
        }
        let odd = self.ring.len() % 2 == 1;
        if odd {
            self.ring[pairs] = self.ring[2 * pairs];
        }
        self.ring.truncate(pairs + usize::from(odd));
        self.merged += pairs as u64;
    }
}
