//! Which steps of a list may begin, kept up to date as steps end.

use super::messages::CallKind;
use crate::plan::PlannedStep;
use std::collections::BTreeSet;

/// The order of a list: what each step still waits for.
#[derive(Debug)]
pub(super) struct Order {
    /// How many steps each one still waits for.
    waits: Vec<u32>,
    /// Who waits for step `i`: `followers[starts[i]..starts[i + 1]]`.
    starts: Vec<u32>,
    followers: Vec<u32>,
    waves: Vec<u32>,
    kinds: Vec<CallKind>,
    /// Steps of each wave that are not over.
    left: Vec<usize>,
    wave: u32,
    /// May begin but for their wave, in the order of the list; each [`CallKind`] apart.
    ready: [BTreeSet<(u32, u32)>; 3],
    over: usize,
}

impl Order {
    /// The order of `steps`, of which those that `over` says so of are over already.
    pub fn new(steps: &[PlannedStep], over: &dyn Fn(usize) -> bool, kind: &dyn Fn(&PlannedStep) -> CallKind) -> Self {
        let n = steps.len();
        let mut waits = vec![0u32; n];
        let mut starts = vec![0u32; n + 2];
        let open = |before: &&u32| !over(**before as usize);
        for (_, step) in steps.iter().enumerate().filter(|(i, _)| !over(*i)) {
            for before in step.after.iter().filter(open) {
                starts[*before as usize + 2] += 1;
            }
        }
        for i in 2..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut followers = vec![0u32; starts[n + 1] as usize];
        let mut left = vec![0usize; steps.iter().map(|step| step.wave as usize + 1).max().unwrap_or(0)];
        let mut done = 0;
        for (index, step) in (0..).zip(steps) {
            if over(index as usize) {
                done += 1;
                continue;
            }
            for before in step.after.iter().filter(open) {
                let at = &mut starts[*before as usize + 1];
                followers[*at as usize] = index;
                *at += 1;
                waits[index as usize] += 1;
            }
            left[step.wave as usize] += 1;
        }
        let mut order = Self {
            waits,
            starts,
            followers,
            waves: steps.iter().map(|step| step.wave).collect(),
            kinds: steps.iter().map(kind).collect(),
            left,
            wave: 0,
            ready: [BTreeSet::new(), BTreeSet::new(), BTreeSet::new()],
            over: done,
        };
        for index in 0..n {
            if !over(index) && order.waits[index] == 0 {
                order.offer(index as u32);
            }
        }
        order.advance();
        order
    }

    fn offer(&mut self, i: u32) {
        self.ready[self.kinds[i as usize] as usize].insert((self.waves[i as usize], i));
    }

    fn advance(&mut self) {
        while self.left.get(self.wave as usize) == Some(&0) {
            self.wave += 1;
        }
    }

    /// The first step of that kind that may begin; it is no longer offered.
    pub fn next(&mut self, kind: CallKind) -> Option<u32> {
        let ready = &mut self.ready[kind as usize];
        let (wave, _) = *ready.first()?;
        if wave > self.wave {
            return None;
        }
        ready.pop_first().map(|(_, i)| i)
    }

    /// Step `i` was taken, but did not begin: it is offered again.
    pub fn again(&mut self, i: u32) {
        self.offer(i);
    }

    /// Step `i` is over.
    pub fn ended(&mut self, i: u32) {
        self.over += 1;
        self.left[self.waves[i as usize] as usize] -= 1;
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

    /// Whether every step is over.
    pub fn is_over(&self) -> bool {
        self.over == self.waits.len()
    }
}
