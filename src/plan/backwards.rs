//! The order of the way back: the undo of a step waits for the undos of all steps that had waited for it.
//!
//! Undoing a frame and taking back what a failed request did are two lists (one is planned on the model as a whole, the other
//! follows what really happened), in one order: this one.

use super::{PlannedStep, StepId};
use smallvec::SmallVec;

/// Numbers of steps of a way back.
pub type Predecessors = SmallVec<[StepId; 4]>;

/// A list of steps gone through from its end, and what the undo of each waits for.
#[derive(Debug)]
pub struct Backwards {
    /// By step.
    waits: Vec<Predecessors>,
    last_wave: u32,
}

impl Backwards {
    /// Of a list whose steps wait only for earlier ones of it.
    pub fn of(steps: &[PlannedStep]) -> Self {
        // Waves never decrease along a list.
        let last_wave = steps.last().map_or(0, |step| step.wave);
        Self { waits: steps.iter().map(|_| Predecessors::new()).collect(), last_wave }
    }

    /// The wave of the undo of a step: the last one's come first.
    pub fn wave(&self, done: &PlannedStep) -> u32 {
        self.last_wave.saturating_sub(done.wave)
    }

    /// How many waves the way back has at most.
    pub fn waves(&self) -> u32 {
        self.last_wave
    }

    /// What the undo of the step at place `i` waits for. All steps that wait for it have been [left](Self::leave) before.
    #[inline]
    pub fn waits(&mut self, i: usize) -> Predecessors {
        let mut waits = std::mem::take(&mut self.waits[i]);
        if waits.len() > 1 {
            waits.sort_unstable();
            waits.dedup();
        }
        waits
    }

    /// A step is taken back once these are done (what it waited for itself, where nothing needs to be done for it).
    #[inline]
    pub fn leave(&mut self, done: &PlannedStep, last: &[StepId]) {
        for earlier in &done.after {
            let waits = &mut self.waits[*earlier as usize];
            // As a rule: a plan of tens of thousands of steps is undone step by step.
            match last {
                [one] => waits.push(*one),
                last => waits.extend_from_slice(last),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::Step;

    fn step(id: StepId, wave: u32, after: &[StepId]) -> PlannedStep {
        let step = Step::Destroy { component: "a".parse().unwrap() };
        PlannedStep::bare(step, id, wave, SmallVec::from_slice(after))
    }

    #[test]
    fn what_waited_goes_back_first_also_through_what_needs_nothing() {
        // 0 <- 1 <- 3, 0 <- 2; nothing needs to be done for 1.
        let steps = [step(0, 0, &[]), step(1, 1, &[0]), step(2, 1, &[0]), step(3, 2, &[1])];
        let mut back = Backwards::of(&steps);
        assert!(back.waits(3).is_empty());
        back.leave(&steps[3], &[7]);
        assert!(back.waits(2).is_empty());
        back.leave(&steps[2], &[8]);
        let waits = back.waits(1);
        assert_eq!(waits.as_slice(), [7]);
        back.leave(&steps[1], &waits);
        assert_eq!(back.waits(0).as_slice(), [7, 8]);
        assert_eq!(steps.iter().map(|step| back.wave(step)).collect::<Vec<_>>(), [2, 1, 1, 0]);
    }
}
