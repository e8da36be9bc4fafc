//! Steps with the order they need, ready to be carried out.

use crate::model::{Origin, Step};
use crate::plan::{PlannedStep, Stage, StepId};
use crate::platform::Execution;
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
        // Nobody asks this of a step that stands alone: it is done because somebody wants it done.
        moves: false,
        undo_moves: false,
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

/// The place of a kind of execution in a list.
fn kind(execution: Execution) -> usize {
    match execution {
        Execution::Immediate => 0,
        Execution::Brief => 1,
        Execution::Blocking => 2,
    }
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
    /// May begin but for their wave, in the order of the list; immediate, brief and blocking ones apart.
    ready: [BTreeSet<(u32, u32)>; 3],
    execution: &'a dyn Fn(&Step) -> Execution,
    over: usize,
}

impl<'a> Order<'a> {
    /// The order of `items[from..]`; those before are over.
    pub fn new(items: &'a [Item], from: usize, execution: &'a dyn Fn(&Step) -> Execution) -> Self {
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
        let ready = [BTreeSet::new(), BTreeSet::new(), BTreeSet::new()];
        let mut order = Self { items, waits, starts, followers, left, wave: 0, ready, execution, over: from };
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
        self.ready[kind((self.execution)(&item.step))].insert((item.wave, i));
    }

    fn advance(&mut self) {
        while self.left.get(self.wave as usize) == Some(&0) {
            self.wave += 1;
        }
    }

    /// The first item of that kind that may begin; it is no longer offered.
    pub fn next(&mut self, execution: Execution) -> Option<u32> {
        let ready = &mut self.ready[kind(execution)];
        let (wave, _) = *ready.first()?;
        if wave > self.wave {
            return None;
        }
        ready.pop_first().map(|(_, i)| i)
    }

    /// Item `i` was taken, but did not begin: it is offered again.
    pub fn again(&mut self, i: u32) {
        self.offer(i);
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
        let blocking = |_: &Step| Execution::Blocking;
        let mut order = Order::new(&items, 0, &blocking);
        assert_eq!(order.next(Execution::Immediate), None);
        assert_eq!(order.next(Execution::Blocking), Some(0));
        assert_eq!(order.next(Execution::Blocking), Some(1));
        assert_eq!(order.next(Execution::Blocking), None);
        order.ended(1);
        assert_eq!(order.next(Execution::Blocking), None);
        order.ended(0);
        assert_eq!(order.next(Execution::Blocking), Some(2));
        assert_eq!(order.next(Execution::Blocking), None, "the wave is a barrier");
        order.ended(2);
        assert_eq!(order.next(Execution::Blocking), Some(3));
        order.ended(3);
        assert_eq!(order.next(Execution::Blocking), Some(4));
        order.again(4);
        assert_eq!(order.next(Execution::Blocking), Some(4), "it had not begun");
        assert!(!order.is_over());
        order.ended(4);
        assert!(order.is_over());
        let immediate = |_: &Step| Execution::Immediate;
        let mut rest = Order::new(&items, 2, &immediate);
        assert_eq!(rest.next(Execution::Immediate), Some(2), "those before are over");
    }
}
