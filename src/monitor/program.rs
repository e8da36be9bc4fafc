//! One condition, compiled: lists of numbers and truths, each made of those before it.

use super::bank::InputSample;
use super::grade::Grade;
use super::nodes::{Number, TruthNode};

/// A condition with its history.
#[derive(Debug, Clone)]
pub struct CompiledCondition {
    numbers: Vec<Number>,
    truths: Vec<TruthNode>,
    values: Vec<f64>,
    grades: Vec<Grade>,
    /// Where the history is evaluated up to.
    position: u64,
    /// The next position at which something may change though no sample comes.
    next: u64,
    /// The same without what changes the robustness alone, for whoever must wake up for it.
    wake: u64,
}

impl CompiledCondition {
    /// The last of the truths is the condition.
    pub fn new(numbers: Vec<Number>, truths: Vec<TruthNode>) -> Self {
        let (values, grades) = (vec![f64::NAN; numbers.len()], vec![Grade::BOTTOM; truths.len()]);
        Self { numbers, truths, values, grades, position: 0, next: u64::MAX, wake: u64::MAX }
    }

    /// Forgets the history.
    pub fn clear(&mut self) {
        self.numbers.iter_mut().for_each(Number::clear);
        self.truths.iter_mut().for_each(TruthNode::clear);
        self.next = u64::MAX;
        self.wake = u64::MAX;
    }

    /// What the condition is at `position`, which is after all before; in between nothing changed but by [`Self::next`].
    pub fn evaluate(&mut self, position: u64, held: &[InputSample]) -> Grade {
        let mut next = u64::MAX;
        for i in 0..self.numbers.len() {
            self.values[i] = self.numbers[i].value(position, held, &self.values[..i]);
            next = next.min(self.numbers[i].next(position));
        }
        for i in 0..self.truths.len() {
            let truth = &mut self.truths[i];
            self.grades[i] = truth.value(position, held, &self.values, &self.grades[..i]);
            next = next.min(truth.next(position, held));
        }
        let mut wake = next;
        for (i, truth) in self.truths.iter().enumerate() {
            // What rose is not rising any more right behind.
            let (TruthNode::Rise(of, _) | TruthNode::Fall(of, _)) = truth else { continue };
            let settled = self.grades[*of].and(self.grades[*of].contrary());
            if settled != self.grades[i] {
                next = next.min(position + 1);
            }
            if settled.holds != self.grades[i].holds {
                wake = wake.min(position + 1);
            }
        }
        self.position = position;
        self.next = next;
        self.wake = wake;
        self.grade()
    }

    /// What the condition was when last evaluated.
    pub fn grade(&self) -> Grade {
        self.grades.last().copied().unwrap_or(Grade::BOTTOM)
    }

    /// The position it was last evaluated at.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// The next position at which something may change though no sample comes.
    pub fn next(&self) -> u64 {
        self.next
    }

    /// The same without what changes the robustness alone.
    pub fn wake(&self) -> u64 {
        self.wake
    }

    /// How many numbers and truths it is made of.
    #[cfg(test)]
    pub fn parts(&self) -> (usize, usize) {
        (self.numbers.len(), self.truths.len())
    }

    /// How many pieces were merged so far.
    pub fn merged(&self) -> u64 {
        self.numbers.iter().map(Number::merged).sum::<u64>() + self.truths.iter().map(TruthNode::merged).sum::<u64>()
    }
}
