//! The two operators over time that all others are made of: the largest value in a window, and `since`.

use super::grade::Grade;
use super::pieces::Pieces;
use super::ring::{RingBuffer, grain};

/// The largest value that a condition had from `oldest` to `newest` positions ago.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    /// How many positions the newer end lies back.
    newest: u64,
    /// How many the older end lies back; `u64::MAX`: to the beginning.
    oldest: u64,
    /// Whether the older end itself is left out.
    half_open: bool,
    /// Where the present value began, and whether that piece has entered the window; none before the first value.
    open: Option<(u64, Grade, bool)>,
    /// Closed pieces (first position, position after the last) that have not entered yet.
    waiting: RingBuffer<(u64, u64, Grade)>,
    pieces: Pieces,
    most: usize,
    upward: bool,
    merged: u64,
}

impl Window {
    /// A window; see the fields. `most` and `upward` as in [`Pieces::new`].
    pub fn new(newest: u64, oldest: u64, half_open: bool, most: usize, upward: bool) -> Self {
        let most = most.max(2);
        Self {
            newest,
            oldest,
            half_open,
            open: None,
            waiting: RingBuffer::new(if newest == 0 { 0 } else { most }),
            pieces: Pieces::new(most, oldest, upward),
            most,
            upward,
            merged: 0,
        }
    }

    /// Forgets the history.
    pub fn clear(&mut self) {
        self.open = None;
        self.waiting.clear();
        self.pieces.clear();
    }

    /// How many pieces were merged so far.
    pub fn merged(&self) -> u64 {
        self.merged + self.pieces.merged()
    }

    /// The position at which a piece that ended before `end` leaves.
    fn exit(&self, end: u64) -> u64 {
        // Without its older end, a window that now lies at an instant does not hold a last piece that is one either.
        let end = if self.half_open { end & !1 } else { end };
        end.saturating_add(self.oldest)
    }

    /// From `position` on the condition is `value`.
    pub fn update(&mut self, position: u64, value: Grade) -> Grade {
        match self.open {
            Some((_, old, _)) if old == value => {}
            Some((start, old, entered)) => {
                if !entered {
                    self.wait(start, position, old);
                } else if self.oldest != u64::MAX {
                    self.pieces.close(self.exit(position));
                }
                self.open = Some((position, value, false));
            }
            None => self.open = Some((position, value, false)),
        }
        while let Some((start, end, value)) = self.waiting.front().copied()
            && start.saturating_add(self.newest) <= position
        {
            self.waiting.pop_front();
            self.enter(self.exit(end), value);
        }
        if let Some((start, value, entered @ false)) = &mut self.open
            && start.saturating_add(self.newest) <= position
        {
            *entered = true;
            let value = *value;
            self.enter(u64::MAX, value);
        }
        self.pieces.expire(position);
        self.pieces.best()
    }

    fn enter(&mut self, exit: u64, value: Grade) {
        // What never leaves is beaten for ever by what is as large.
        if self.oldest == u64::MAX && !self.pieces.is_empty() && !self.pieces.best().less(value) {
            return;
        }
        self.pieces.push(exit, value);
    }

    fn wait(&mut self, start: u64, end: u64, value: Grade) {
        if self.waiting.len() == self.most {
            let (grain, upward) = (grain(self.newest, self.most), self.upward);
            let one = |old: (u64, u64, Grade), new: (u64, u64, Grade)| {
                (old.0, new.1, if upward { old.2.or(new.2) } else { old.2.and(new.2) })
            };
            let joined =
                |old: (u64, u64, Grade), new: (u64, u64, Grade)| (new.1 - old.0 <= grain).then(|| one(old, new));
            self.merged += self.waiting.join(joined, one) as u64;
        }
        self.waiting.push_back((start, end, value));
    }

    /// The next position at which the value may change by itself.
    pub fn next(&self) -> u64 {
        let entering = match (self.waiting.front(), &self.open) {
            (Some((start, ..)), _) | (None, Some((start, _, false))) => start.saturating_add(self.newest),
            _ => u64::MAX,
        };
        entering.min(self.pieces.next())
    }
}

/// `hold` since `from`, at most `oldest` positions ago.
///
/// With a newer end in the past it is what this was then, and `hold` ever after: see `compile`.
#[derive(Debug, Clone, PartialEq)]
pub struct SinceWindow {
    oldest: u64,
    open: Option<(Grade, Grade)>,
    pieces: Pieces,
}

impl SinceWindow {
    /// An interval from now to `oldest` positions ago (`u64::MAX`: to the beginning). `most` and `upward` as in
    /// [`Pieces::new`].
    pub fn new(oldest: u64, most: usize, upward: bool) -> Self {
        Self { oldest, open: None, pieces: Pieces::new(most, oldest, upward) }
    }

    /// Forgets the history.
    pub fn clear(&mut self) {
        self.open = None;
        self.pieces.clear();
    }

    /// How many pieces were merged so far.
    pub fn merged(&self) -> u64 {
        self.pieces.merged()
    }

    /// From `position` on the conditions are `hold` and `from`.
    pub fn update(&mut self, position: u64, hold: Grade, from: Grade) -> Grade {
        match self.open {
            Some(same) if same == (hold, from) => {}
            Some((old_hold, old_from)) => {
                // When the piece ends with an instant, nothing of it lies after that instant, and `hold` there does not
                // matter; else something always does.
                let ends_with_instant = position % 2 == 1;
                let value = if ends_with_instant { old_from } else { old_hold.and(old_from) };
                let forever = self.oldest == u64::MAX;
                if !(forever && !self.pieces.is_empty() && !self.pieces.best().less(value)) {
                    self.pieces.push(position.saturating_add(self.oldest), value);
                }
                self.open = Some((hold, from));
            }
            None => self.open = Some((hold, from)),
        }
        self.pieces.cap(hold);
        self.pieces.expire(position);
        self.pieces.best().or(from)
    }

    /// The next position at which the value may change by itself.
    pub fn next(&self) -> u64 {
        self.pieces.next()
    }
}
