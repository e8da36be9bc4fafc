//! One condition, compiled: lists of numbers and truths, each made of those before it.
//!
//! Each part is worked out again only where something that it is made of has become another, or its own time has come: of most
//! conditions little changes from one sample to the next.

use super::grade::Grade;
use super::nodes::{Number, TruthNode};
use super::sample::InputSample;

/// A condition with its history.
#[derive(Debug, Clone)]
pub struct CompiledCondition {
    numbers: Vec<Number>,
    truths: Vec<TruthNode>,
    values: Vec<f64>,
    grades: Vec<Grade>,
    /// Which parts are made of each input, and of each part; parts are numbered on from the numbers to the truths.
    of_inputs: Box<[Box<[usize]>]>,
    of_parts: Box<[Box<[usize]>]>,
    /// Which parts are to be worked out at the next position, as bits.
    stale: Box<[u64]>,
    /// Which parts may change though nothing that they are made of does, and from when on: few of them.
    timed: Box<[(usize, u64)]>,
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
        let first = numbers.len();
        let timed = places(&numbers, Number::is_timed).chain(places(&truths, TruthNode::is_timed).map(|i| first + i));
        let timed = timed.map(|part| (part, u64::MAX)).collect();
        let steps = places(&truths, |truth| matches!(truth, TruthNode::Rise(..) | TruthNode::Fall(..))).collect();
        let count = first + truths.len();
        let (mut of_inputs, mut of_parts): (Vec<Vec<usize>>, _) = (Vec::new(), vec![Vec::new(); count]);
        for (part, made_of) in
            numbers.iter().map(Number::made_of).chain(truths.iter().map(TruthNode::made_of)).enumerate()
        {
            for input in made_of.inputs {
                of_inputs.resize_with(of_inputs.len().max(input + 1), Vec::new);
                of_inputs[input].push(part);
            }
            made_of.numbers.into_iter().for_each(|number| of_parts[number].push(part));
            made_of.truths.into_iter().for_each(|truth| of_parts[first + truth].push(part));
        }
        let boxed = |lists: Vec<Vec<usize>>| lists.into_iter().map(Vec::into_boxed_slice).collect();
        let mut condition = Self {
            numbers,
            truths,
            values,
            grades,
            of_inputs: boxed(of_inputs),
            of_parts: boxed(of_parts),
            stale: vec![0; count.div_ceil(64)].into(),
            timed,
            steps,
            position: 0,
            next: u64::MAX,
            wake: u64::MAX,
        };
        condition.all_stale();
        condition
    }

    /// Forgets the history.
    pub fn clear(&mut self) {
        self.numbers.iter_mut().for_each(Number::clear);
        self.truths.iter_mut().for_each(TruthNode::clear);
        self.timed.iter_mut().for_each(|(_, next)| *next = u64::MAX);
        self.next = u64::MAX;
        self.wake = u64::MAX;
        self.all_stale();
    }

    fn all_stale(&mut self) {
        (0..self.of_parts.len()).for_each(|part| mark(&mut self.stale, part));
    }

    /// Something else came to an input: what is made of it is worked out at the next position.
    pub fn touch(&mut self, input: usize) {
        self.of_inputs.get(input).into_iter().flatten().for_each(|part| mark(&mut self.stale, *part));
    }

    /// What the condition is at `position`, which is after all before; in between nothing changed but by [`Self::next`], and
    /// what of `held` became another was [touched](Self::touch).
    pub fn evaluate(&mut self, position: u64, held: &[InputSample]) -> Grade {
        self.timed.iter().filter(|(_, next)| *next <= position).for_each(|(part, _)| mark(&mut self.stale, *part));
        for word in 0..self.stale.len() {
            // Whoever is made of a part stands behind it, perhaps in the same word.
            while self.stale[word] != 0 {
                let part = word * 64 + self.stale[word].trailing_zeros() as usize;
                self.stale[word] &= self.stale[word] - 1;
                if self.work_out(part, position, held) {
                    self.of_parts[part].iter().for_each(|user| mark(&mut self.stale, *user));
                }
            }
        }
        let mut next = self.timed.iter().map(|(_, next)| *next).min().unwrap_or(u64::MAX);
        let mut wake = next;
        for i in &self.steps {
            // What rose is not rising any more right behind.
            let (TruthNode::Rise(of, _) | TruthNode::Fall(of, _)) = &self.truths[*i] else { continue };
            let settled = self.grades[*of].and(self.grades[*of].contrary());
            if settled != self.grades[*i] {
                next = next.min(position + 1);
                mark(&mut self.stale, self.numbers.len() + i);
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

    /// Works out one part. Whether it has become another.
    fn work_out(&mut self, part: usize, position: u64, held: &[InputSample]) -> bool {
        let (changed, timed) = match part.checked_sub(self.numbers.len()) {
            None => {
                let number = &mut self.numbers[part];
                let value = number.value(position, held, &self.values);
                let before = std::mem::replace(&mut self.values[part], value);
                (before.to_bits() != value.to_bits(), number.is_timed().then(|| number.next(position)))
            }
            Some(at) => {
                let truth = &mut self.truths[at];
                let grade = truth.value(position, held, &self.values, &self.grades);
                let before = std::mem::replace(&mut self.grades[at], grade);
                (!before.is_same(grade), truth.is_timed().then(|| truth.next(position, held)))
            }
        };
        if let Some(next) = timed
            && let Some(known) = self.timed.iter_mut().find(|(timed, _)| *timed == part)
        {
            known.1 = next;
        }
        changed
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
        // Only what looks back has something to merge.
        let merged = |part: usize| match part.checked_sub(self.numbers.len()) {
            None => self.numbers[part].merged(),
            Some(at) => self.truths[at].merged(),
        };
        self.timed.iter().map(|(part, _)| merged(*part)).sum()
    }
}

fn places<'p, T>(parts: &'p [T], are: impl Fn(&T) -> bool + 'p) -> impl Iterator<Item = usize> + 'p {
    parts.iter().enumerate().filter(move |(_, part)| are(part)).map(|(i, _)| i)
}

/// Sets a bit.
fn mark(bits: &mut [u64], at: usize) {
    bits[at / 64] |= 1 << (at % 64);
}
