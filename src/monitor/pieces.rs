//! The pieces of a signal that may still become the largest in a sliding window.

use super::grade::Grade;
use super::ring::{RingBuffer, grain};

/// Pieces from old to new; values fall from front to back, since a piece that is followed by a larger one can never be the
/// largest again.
#[derive(Debug, Clone, PartialEq)]
pub struct Pieces {
    ring: RingBuffer<Piece>,
    most: usize,
    /// How far apart pieces may leave that become one when there is no room.
    grain: u64,
    upward: bool,
    merged: u64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// The position at which the first of those leaves that became this one.
    first: u64,
    /// The position at which it leaves the window.
    exit: u64,
    value: Grade,
}

impl Pieces {
    /// Without pieces, which leave at most `window` positions after they came. At most `most` are kept (two at least);
    /// merging makes the window too long where `upward`, else too short, by no more than [`grain`].
    pub fn new(most: usize, window: u64, upward: bool) -> Self {
        let most = most.max(2);
        Self { ring: RingBuffer::new(most), most, grain: grain(window, most), upward, merged: 0 }
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
        while self.ring.back().is_some_and(|older| !value.less(older.value)) {
            self.ring.pop_back();
        }
        if self.ring.len() == self.most {
            self.merge();
        }
        self.ring.push_back(Piece { first: exit, exit, value });
    }

    /// Gives the newest piece the position at which it leaves.
    pub fn close(&mut self, exit: u64) {
        if let Some(newest) = self.ring.back_mut() {
            (newest.first, newest.exit) = (newest.first.min(exit), exit);
        }
    }

    /// No value may be more than `limit`.
    pub fn cap(&mut self, limit: Grade) {
        let mut capped = None;
        while let Some(piece) = self.ring.front().copied()
            && !piece.value.less(limit)
        {
            capped = Some(piece);
            self.ring.pop_front();
        }
        // Of pieces with the same value the one that stays longest does for all.
        if let Some(piece) = capped {
            self.ring.push_front(Piece { value: limit, ..piece });
        }
    }

    /// Drops what has left at `position`.
    pub fn expire(&mut self, position: u64) {
        while self.ring.front().is_some_and(|piece| piece.exit <= position) {
            self.ring.pop_front();
        }
    }

    /// The largest value; false without distance when there is none.
    pub fn best(&self) -> Grade {
        self.ring.front().map_or(Grade::BOTTOM, |piece| piece.value)
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }

    /// The position at which the next piece leaves.
    pub fn next(&self) -> u64 {
        self.ring.front().map_or(u64::MAX, |piece| piece.exit)
    }

    /// Merges pieces that leave shortly after each other. One that has not ended yet leaves after all others.
    fn merge(&mut self) {
        let (grain, upward) = (self.grain, self.upward);
        // The larger value stays in either case: until the last of them leaves, or only until the first does.
        let one = |old: Piece, new: Piece| if upward { Piece { exit: new.exit, ..old } } else { old };
        let joined = |old: Piece, new: Piece| (new.exit - old.first <= grain).then(|| one(old, new));
        self.merged += self.ring.join(joined, one) as u64;
    }
}
