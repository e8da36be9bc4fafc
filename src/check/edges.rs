//! Moves that were followed, as little as each needs: there are several of them for each state.

use super::state::Failed;

/// No number.
pub(super) const NOWHERE: u32 = u32::MAX;

/// Why a way down by a move is none for a deployment that is being stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Barred {
    /// The event that ends the deployment comes once more, or somebody wants it up again.
    Again,
    /// An event that is refused then.
    Closed,
    /// An event that only a fault, or what components and monitors need not report there, would bring.
    Gone,
    /// A time event that lasts as long as the shutdown may.
    Late,
    /// An event that only a component may raise then, if one does.
    Reported,
}

/// What is told of a move that was followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tells {
    /// What failed in it.
    pub failed: Failed,
    /// No time passes, and no step fails: an answer is given, or heard, or an event is taken.
    pub quiet: bool,
    /// What does not come by itself, or not in time, where the deployment is being stopped.
    pub barred: Option<Barred>,
    /// It comes, and nobody hears it.
    pub dropped: bool,
    /// As far as this move alone tells, a script can bring it about.
    pub shown: bool,
}

const FAILED: [Failed; 4] = [Failed::Nothing, Failed::Apply, Failed::Undo, Failed::Broken];
const BARRED: [Barred; 5] = [Barred::Again, Barred::Closed, Barred::Gone, Barred::Late, Barred::Reported];
/// Bits of [`Tells`], below those of the place.
const TOLD: u32 = 8;
/// No place: so many rounds of a cycle.
const NO_PLACE: u32 = NOWHERE >> TOLD;

/// A move that was followed.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// From where.
    pub from: u32,
    /// To where.
    pub to: u32,
    by: u32,
    /// Its place among the moves from there, and what is told of it: two bits of what failed, three of what bars it, one each of the rest.
    told: u32,
}

impl Edge {
    /// An edge; `by` is the number of what leads there, `place` its place among the moves from there.
    pub(super) fn new(from: u32, to: u32, by: u32, place: Option<usize>, tells: Tells) -> Self {
        let place = place.and_then(|place| u32::try_from(place).ok()).map_or(NO_PLACE, |place| place.min(NO_PLACE));
        let barred = tells.barred.map_or(0, |barred| barred as u32 + 1);
        let bits = u32::from(tells.quiet) << 5 | u32::from(tells.dropped) << 6 | u32::from(tells.shown) << 7;
        Self { from, to, by, told: place << TOLD | bits | barred << 2 | tells.failed as u32 }
    }

    /// Its place among the moves from there; none: so many rounds of a cycle.
    pub fn place(&self) -> Option<usize> {
        let place = self.told >> TOLD;
        (place != NO_PLACE).then_some(place as usize)
    }

    /// What leads there, by its number.
    pub(super) fn by(&self) -> u32 {
        self.by
    }

    /// What failed in it.
    pub fn failed(&self) -> Failed {
        FAILED[(self.told & 3) as usize]
    }

    /// No time passes, and no step fails: an answer is given, or heard, or an event is taken.
    pub fn quiet(&self) -> bool {
        self.told & 1 << 5 != 0
    }

    /// What does not come by itself, or not in time, where the deployment is being stopped.
    pub fn barred(&self) -> Option<Barred> {
        let number = (self.told >> 2 & 7) as usize;
        number.checked_sub(1).and_then(|at| BARRED.get(at)).copied()
    }

    /// It comes, and nobody hears it.
    pub fn dropped(&self) -> bool {
        self.told & 1 << 6 != 0
    }

    /// As far as this move alone tells, a script can bring it about.
    pub fn shown(&self) -> bool {
        self.told & 1 << 7 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_tells_what_it_was_made_of() {
        let mut all = Vec::new();
        for failed in FAILED {
            for barred in BARRED.into_iter().map(Some).chain([None]) {
                for bits in 0..8 {
                    let [quiet, dropped, shown] = [0, 1, 2].map(|bit| bits & 1 << bit != 0);
                    all.push(Tells { failed, quiet, barred, dropped, shown });
                }
            }
        }
        for (number, tells) in (0u32..).zip(all) {
            for place in [None, Some(0), Some(1_000_000)] {
                let edge = Edge::new(number, 7, NOWHERE, place, tells);
                let Edge { from, to, .. } = edge;
                assert_eq!((from, to, edge.by(), edge.place()), (number, 7, NOWHERE, place));
                let (failed, quiet, barred) = (edge.failed(), edge.quiet(), edge.barred());
                let told = Tells { failed, quiet, barred, dropped: edge.dropped(), shown: edge.shown() };
                assert_eq!(told, tells);
            }
        }
    }
}
