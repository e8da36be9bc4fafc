//! The states that were met, each once, by their numbers: in the order they were met.

use super::chunks::{Chunks, ChunksIter};
use super::once::Once;
use super::state::ProductState;
use rustc_hash::FxBuildHasher;
use std::hash::BuildHasher;
use std::ops::Index;

/// No state: a place that is free.
const FREE: u32 = u32::MAX;

/// All states that were met.
#[derive(Default)]
pub struct MetStates {
    all: Chunks<ProductState>,
    /// By their hashes, as a table with open addresses: half of a hash, and a number. Most that are not the same are told apart without
    /// looking at them.
    index: Vec<(u32, u32)>,
    once: Once,
}

impl MetStates {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// All, in the order they were met.
    pub(super) fn iter(&self) -> ChunksIter<'_, ProductState> {
        self.all.iter()
    }

    /// The number of a state, if it was met.
    pub fn find(&self, state: &ProductState) -> Option<u32> {
        (!self.index.is_empty()).then(|| self.look_up(hash_of(state), state).ok()).flatten()
    }

    /// The number of a state; else the place in the table where it belongs.
    fn look_up(&self, hash: u32, state: &ProductState) -> Result<u32, usize> {
        let mut place = hash as usize & (self.index.len() - 1);
        loop {
            let (of, number) = self.index[place];
            if number == FREE {
                return Err(place);
            }
            if of == hash && self.all[number as usize] == *state {
                return Ok(number);
            }
            place = (place + 1) & (self.index.len() - 1);
        }
    }

    /// The number of a state, and whether it was not met before.
    pub fn meet(&mut self, mut state: ProductState) -> (u32, bool) {
        // At most three quarters of the table are taken.
        if (self.all.len() + 1) * 4 > self.index.len() * 3 {
            self.grow();
        }
        let hash = hash_of(&state);
        let place = match self.look_up(hash, &state) {
            Ok(number) => return (number, false),
            Err(place) => place,
        };
        let number = u32::try_from(self.all.len()).unwrap_or(FREE);
        self.index[place] = (hash, number);
        self.once.share(&mut state);
        self.all.push(state);
        (number, true)
    }

    fn grow(&mut self) {
        let room = (self.index.len() * 2).max(16);
        let before = std::mem::replace(&mut self.index, vec![(0, FREE); room]);
        for (hash, number) in before.into_iter().filter(|(_, number)| *number != FREE) {
            let mut place = hash as usize & (room - 1);
            while self.index[place].1 != FREE {
                place = (place + 1) & (room - 1);
            }
            self.index[place] = (hash, number);
        }
    }
}

impl Index<usize> for MetStates {
    type Output = ProductState;

    fn index(&self, at: usize) -> &ProductState {
        &self.all[at]
    }
}

impl<'s> IntoIterator for &'s MetStates {
    type Item = &'s ProductState;
    type IntoIter = ChunksIter<'s, ProductState>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// The upper half is the better one.
fn hash_of(state: &ProductState) -> u32 {
    let hash = FxBuildHasher.hash_one(state);
    (hash >> 32) as u32 ^ hash as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::desks::Desks;
    use crate::check::seldom::SharedSeldom;
    use crate::check::shared_list::SharedList;
    use smallvec::SmallVec;

    /// Each state has one number, whenever it comes again, and stands there as it came.
    #[test]
    fn each_state_has_one_number() {
        let desk = Desks::default().empty();
        let state = |world: u32, lost: u32, aside: bool| {
            let mut state = ProductState {
                leaves: SmallVec::new(),
                world,
                desk: desk.clone(),
                inbox: SharedList::new(),
                stands: SharedList::new(),
                seldom: SharedSeldom::default(),
                stayed: false,
                aside,
                stopping: false,
                leaving: false,
                elsewhere: false,
                across: false,
                down: 0,
                children: 0,
                beliefs: SharedList::new(),
                told: SharedList::new(),
            };
            state.change(|seldom| seldom.joined.extend(0..lost));
            state
        };
        let all: Vec<ProductState> = (0..4000).map(|n| state(n / 8, n / 2 % 4, n % 2 == 0)).collect();
        let mut met = MetStates::default();
        for (number, state) in (0u32..).zip(&all) {
            assert_eq!(met.meet(state.clone()), (number, true));
        }
        assert_eq!(met.find(&state(4000, 0, true)), None);
        assert_eq!(MetStates::default().find(&all[0]), None);
        for (number, state) in all.iter().enumerate().rev() {
            assert_eq!(met.find(state), u32::try_from(number).ok());
            assert_eq!(met.meet(state.clone()), (u32::try_from(number).unwrap(), false));
            assert!(met[number] == *state);
        }
        assert!(met.len() == all.len() && met.iter().eq(&all));
    }
}
