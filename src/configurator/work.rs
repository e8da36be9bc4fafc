//! Steps with the order they need, ready to be carried out.

use crate::model::{Origin, Step};
use crate::plan::{PlannedStep, Stage, StepId};
use crate::system::{Reversibility, Undo};
use smallvec::SmallVec;
use std::collections::BTreeSet;

/// A step with its place in the order; its `undo` is what takes it back.
pub(super) type Item = PlannedStep;

/// A step that stands alone in its wave and before which so many others stand.
pub(super) fn item(step: Step, id: StepId, wave: u32, after: SmallVec<[StepId; 4]>) -> Item {
    Item {
        id,
        stage: Stage::Changes,
        wave,
        after,
        step,
        reversibility: Reversibility::Exact,
        undo: Undo::Nothing,
        origin: Origin::NONE,
    }
}

/// Steps one after the other.
pub(super) fn chain(steps: impl IntoIterator<Item = Step>) -> Vec<Item> {
    let mut work = Vec::new();
    for (id, step) in (0..).zip(steps) {
        let before: Option<StepId> = StepId::checked_sub(id, 1);
        work.push(item(step, id, 0, before.into_iter().collect()));
    }
    work
}

/// Which items may begin, kept up to date as items end.
pub(super) struct Order<'a> {
    items: &'a [Item],
    /// How many items each one still waits for.
    waits: Vec<u32>,
    /// Who waits for item `i`: `followers[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    followers: Vec<u32>,
    /// Items of each wave that are not over.
    left: Vec<usize>,
    wave: u32,
    /// May begin but for their wave, in the order of the list; immediate ones and blocking ones apart.
    ready: [BTreeSet<(u32, u32)>; 2],
    immediate: &'a dyn Fn(&Step) -> bool,
    over: usize,
}

impl<'a> Order<'a> {
    /// The order of `items[from..]`; those before are over.
    pub fn new(items: &'a [Item], from: usize, immediate: &'a dyn Fn(&Step) -> bool) -> Self {
        let n = items.len();
        let mut waits = vec![0u32; n];
        let mut starts = vec![0u32; n + 2];
        let open = |before: &&u32| **before as usize >= from;
        for item in &items[from..] {
            for before in item.after.iter().filter(open) {
                starts[*before as usize + 2] += 1;
            }
        }
        for i in 2..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut followers = vec![0u32; starts[n + 1] as usize];
        let waves = items.iter().map(|item| item.wave as usize + 1).max().unwrap_or(0);
        let mut left = vec![0usize; waves];
        for (index, item) in (0..).zip(items).skip(from) {
            for before in item.after.iter().filter(open) {
                let at = &mut starts[*before as usize + 1];
                followers[*at as usize] = index;
                *at += 1;
                waits[index as usize] += 1;
            }
            left[item.wave as usize] += 1;
        }
        let ready = [BTreeSet::new(), BTreeSet::new()];
        let mut order = Self { items, waits, starts, followers, left, wave: 0, ready, immediate, over: from };
        for (index, _) in (0..).zip(items).skip(from) {
            if order.waits[index as usize] == 0 {
                order.offer(index);
            }
        }
        order.advance();
        order
    }

    fn offer(&mut self, i: u32) {
        let item = &self.items[i as usize];
        let kind = usize::from(!(self.immediate)(&item.step));
        self.ready[kind].insert((item.wave, i));
    }

    fn advance(&mut self) {
        while self.left.get(self.wave as usize) == Some(&0) {
            self.wave += 1;
        }
    }

    fn next(&mut self, kind: usize) -> Option<u32> {
        let (wave, i) = *self.ready[kind].first()?;
        if wave > self.wave {
            return None;
        }
        self.ready[kind].pop_first();
        Some(i)
    }

    /// The first immediate item that may begin; it is no longer offered.
    pub fn next_immediate(&mut self) -> Option<u32> {
        self.next(0)
    }

    /// The first blocking item that may begin; it is no longer offered.
    pub fn next_blocking(&mut self) -> Option<u32> {
        self.next(1)
    }

    /// Item `i` is over.
    pub fn ended(&mut self, i: u32) {
        self.over += 1;
        self.left[self.items[i as usize].wave as usize] -= 1;
        let range = self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize;
        for at in range {
            let follower = self.followers[at];
            let waits = &mut self.waits[follower as usize];
            *waits -= 1;
            if *waits == 0 {
                self.offer(follower);
            }
        }
        self.advance();
    }

    /// Whether every item is over.
    pub fn is_over(&self) -> bool {
        self.over == self.waits.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{ComponentName, Transition};

    fn item(after: &[u32], wave: u32) -> Item {
        let step = Step::State { component: ComponentName::new("a").unwrap(), transition: Transition::Start };
        super::item(step, 0, wave, after.iter().copied().collect())
    }

    #[test]
    fn edges_and_waves_are_kept() {
        // 0 → 2, 1 → 2, 3 in a later wave, 4 after 3.
        let items = [item(&[], 0), item(&[], 0), item(&[0, 1], 0), item(&[], 1), item(&[3], 1)];
        let blocking = |_: &Step| false;
        let mut order = Order::new(&items, 0, &blocking);
        assert_eq!(order.next_immediate(), None);
        assert_eq!(order.next_blocking(), Some(0));
        assert_eq!(order.next_blocking(), Some(1));
        assert_eq!(order.next_blocking(), None);
        order.ended(1);
        assert_eq!(order.next_blocking(), None);
        order.ended(0);
        assert_eq!(order.next_blocking(), Some(2));
        assert_eq!(order.next_blocking(), None, "the wave is a barrier");
        order.ended(2);
        assert_eq!(order.next_blocking(), Some(3));
        order.ended(3);
        assert_eq!(order.next_blocking(), Some(4));
        assert!(!order.is_over());
        order.ended(4);
        assert!(order.is_over());
        let immediate = |_: &Step| true;
        let mut rest = Order::new(&items, 2, &immediate);
        assert_eq!(rest.next_immediate(), Some(2), "those before are over");
    }
}
