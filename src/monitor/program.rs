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
    /// Which numbers and which truths may change though nothing that they are made of does: few of them.
    timed: (Box<[usize]>, Box<[usize]>),
    /// Which truths are a rise or a fall.
    steps: Box<[usize]>,
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
        let timed = (places(&numbers, Number::is_timed), places(&truths, TruthNode::is_timed));
        let steps = places(&truths, |truth| matches!(truth, TruthNode::Rise(..) | TruthNode::Fall(..)));
        Self { numbers, truths, values, grades, timed, steps, position: 0, next: u64::MAX, wake: u64::MAX }
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
        for (i, number) in self.numbers.iter_mut().enumerate() {
            self.values[i] = number.value(position, held, &self.values);
        }
        for (i, truth) in self.truths.iter_mut().enumerate() {
            self.grades[i] = truth.value(position, held, &self.values, &self.grades);
        }
        let mut next = u64::MAX;
        for i in &self.timed.0 {
            next = next.min(self.numbers[*i].next(position));
        }
        for i in &self.timed.1 {
            next = next.min(self.truths[*i].next(position, held));
        }
        let mut wake = next;
        for i in &self.steps {
            // What rose is not rising any more right behind.
            let (TruthNode::Rise(of, _) | TruthNode::Fall(of, _)) = &self.truths[*i] else { continue };
            let settled = self.grades[*of].and(self.grades[*of].contrary());
            if settled != self.grades[*i] {
                next = next.min(position + 1);
            }
            if settled.holds != self.grades[*i].holds {
                wake = wake.min(position + 1);
            }
        }
        self.position = position;
        self.next = next;
        self.wake = wake;
        self.grade()
    }

    /// Nothing has changed up to `position`, which is before [`Self::next`].
    pub fn go_on(&mut self, position: u64) {
        self.position = position;
    }

    /// What the condition was when last evaluated.
    pub fn grade(&self) -> Grade {
        self.grades.last().copied().unwrap_or(Grade::BOTTOM)
    }

    /// Whether it matters when, or how often, an input was written.
    pub fn counts(&self, input: usize) -> bool {
        self.numbers.iter().any(|number| matches!(number, Number::Rate(slot, _) if *slot == input))
            || self.truths.iter().any(|truth| matches!(truth, TruthNode::Age { slot, .. } if *slot == input))
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
        let numbers = self.timed.0.iter().map(|i| self.numbers[*i].merged());
        // Only what looks back has something to merge.
        numbers.chain(self.timed.1.iter().map(|i| self.truths[*i].merged())).sum()
    }
}

fn places<T>(parts: &[T], are: impl Fn(&T) -> bool) -> Box<[usize]> {
    parts.iter().enumerate().filter(|(_, part)| are(part)).map(|(i, _)| i).collect()
}
