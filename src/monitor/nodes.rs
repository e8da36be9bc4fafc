//! The parts of a compiled condition.

use super::grade::Grade;
use super::ring::{RingBuffer, grain};
use super::sample::InputSample;
use super::window::{SinceWindow, Window};
use crate::model::monitor::Comparison;

/// What a part is made of, each by its place.
#[derive(Debug, Default)]
pub struct MadeOf {
    /// Inputs.
    pub inputs: Vec<usize>,
    /// Numbers before it.
    pub numbers: Vec<usize>,
    /// Truths before it.
    pub truths: Vec<usize>,
}

/// A number, from samples and from numbers before it in the list.
#[derive(Debug, Clone, PartialEq)]
pub enum Number {
    /// What an input holds.
    Input(usize),
    /// Always this.
    Constant(f64),
    /// Samples of an input in a time.
    Rate(usize, Rate),
    /// Euclidean norm.
    Norm(Box<[usize]>),
    /// The first minus the second.
    Difference(usize, usize),
    /// The smallest.
    Min(Box<[usize]>),
    /// The largest.
    Max(Box<[usize]>),
    /// Without sign.
    Abs(usize),
}

impl Number {
    /// Its value; NaN when it has none.
    pub fn value(&mut self, position: u64, held: &[InputSample], before: &[f64]) -> f64 {
        // Unlike the library's: what has no value makes the whole have none.
        let pick = |list: &[usize], better: fn(f64, f64) -> bool| {
            let mut values = list.iter().map(|i| before[*i]);
            let Some(mut found) = values.next() else { return f64::NAN };
            for value in values {
                if found.is_nan() || value.is_nan() {
                    return f64::NAN;
                }
                if better(value, found) {
                    found = value;
                }
            }
            found
        };
        match self {
            Self::Input(slot) => held[*slot].number(),
            Self::Constant(v) => *v,
            Self::Rate(slot, rate) => rate.value(position, &held[*slot]),
            Self::Norm(list) => list.iter().map(|i| before[*i] * before[*i]).sum::<f64>().sqrt(),
            Self::Difference(a, b) => before[*a] - before[*b],
            Self::Min(list) => pick(list, |a, b| a < b),
            Self::Max(list) => pick(list, |a, b| a > b),
            Self::Abs(i) => before[*i].abs(),
        }
    }
}

/// Samples of one moment, or of some that lie close together.
#[derive(Debug, Clone, Copy, PartialEq)]
struct NodeMoment {
    first: u64,
    at: u64,
    count: u64,
}

/// Counts samples in the time before now.
#[derive(Debug, Clone, PartialEq)]
pub struct Rate {
    /// The time, in positions.
    window: u64,
    /// The same in seconds.
    seconds: f64,
    start: Option<u64>,
    /// Of the input, when last looked at.
    writes: u64,
    /// Old to new.
    counts: RingBuffer<NodeMoment>,
    total: u64,
    most: usize,
    merged: u64,
}

impl Rate {
    /// Over a time in positions; at most `most` different moments are kept.
    #[allow(clippy::cast_precision_loss)]
    pub fn new(window: u64, most: usize) -> Self {
        let most = most.max(2);
        let counts = RingBuffer::new(most);
        let seconds = window as f64 / 2e9;
        Self { window, seconds, start: None, writes: 0, counts, total: 0, most, merged: 0 }
    }

    fn clear(&mut self) {
        self.start = None;
        self.counts.clear();
        self.total = 0;
    }

    #[allow(clippy::cast_precision_loss)]
    fn value(&mut self, position: u64, sample: &InputSample) -> f64 {
        let Some(start) = self.start else {
            self.start = Some(position);
            self.writes = sample.writes;
            return f64::NAN;
        };
        if sample.writes != self.writes {
            // Fewer than before: the port is another one, and has been written so often since.
            let new = sample.writes.checked_sub(self.writes).unwrap_or(sample.writes);
            self.writes = sample.writes;
            let at = sample.at.as_nanos().saturating_mul(2);
            // What was written before the history is no part of it.
            if at >= start && new > 0 {
                self.total += new;
                match self.counts.back_mut() {
                    Some(newest) if newest.at >= at => newest.count += new,
                    _ => {
                        if self.counts.len() == self.most {
                            self.expire(position);
                        }
                        if self.counts.len() == self.most {
                            self.merge();
                        }
                        self.counts.push_back(NodeMoment { first: at, at, count: new });
                    }
                }
            }
        }
        self.expire(position);
        if position < start.saturating_add(self.window) { f64::NAN } else { self.total as f64 / self.seconds }
    }

    fn expire(&mut self, position: u64) {
        while let Some(moment) = self.counts.front().copied()
            && moment.at.saturating_add(self.window) <= position
        {
            self.counts.pop_front();
            self.total -= moment.count;
        }
    }

    /// Counts moments that lie close together at the newest of them.
    fn merge(&mut self) {
        let grain = grain(self.window, self.most);
        let one = |old: NodeMoment, new: NodeMoment| NodeMoment {
            first: old.first,
            at: new.at,
            count: old.count + new.count,
        };
        let joined = |old: NodeMoment, new: NodeMoment| (new.at - old.first <= grain).then(|| one(old, new));
        self.merged += self.counts.join(joined, one) as u64;
    }

    fn next(&self, position: u64) -> u64 {
        let full = self.start.map_or(u64::MAX, |start| start.saturating_add(self.window));
        let leaves = self.counts.front().map_or(u64::MAX, |moment| moment.at.saturating_add(self.window));
        leaves.min(if full > position { full } else { u64::MAX })
    }
}

/// A truth, from samples, numbers, and truths before it in the list.
#[derive(Debug, Clone, PartialEq)]
pub enum TruthNode {
    /// Two numbers compared; `holds` is what it was before, for the hysteresis.
    Compare { left: usize, op: Comparison, right: usize, hysteresis: f64, holds: bool },
    /// The age of an input's newest sample compared with a time in positions.
    Age { slot: usize, op: Comparison, bound: i64, start: Option<u64> },
    /// A number that is not zero.
    IsTrue(usize),
    /// An input that holds this value.
    Is(usize, f64),
    /// All of them.
    All(Box<[usize]>),
    /// One of them.
    Any(Box<[usize]>),
    /// Not this.
    Not(usize),
    /// It holds and did not hold just before; none: at the beginning.
    Rise(usize, Option<Grade>),
    /// It does not hold and did just before.
    Fall(usize, Option<Grade>),
    /// The largest in a window.
    Once(usize, Window),
    /// The smallest in a window: the window holds the contraries.
    Historically(usize, Window),
    /// The first since the second.
    Since(usize, usize, SinceWindow),
    /// The history is this many positions long.
    Lived(u64, Option<u64>),
}

impl TruthNode {
    /// What it is from `position` on.
    pub fn value(&mut self, position: u64, held: &[InputSample], numbers: &[f64], before: &[Grade]) -> Grade {
        match self {
            Self::Compare { left, op, right, hysteresis, holds } => {
                let (left, right) = (numbers[*left], numbers[*right]);
                *holds = compare(left, *op, right, if *holds { *hysteresis } else { 0.0 }).holds;
                // How far from the contrary: from the bound that would end it, or that would begin it.
                compare(left, *op, right, if *holds { *hysteresis } else { 0.0 })
            }
            Self::Age { slot, op, bound, start } => {
                let begun = *start.get_or_insert(position);
                age(position, held[*slot].since(begun), *op, *bound)
            }
            Self::IsTrue(slot) => {
                let v = held[*slot].number();
                Grade::of(v != 0.0 && !v.is_nan())
            }
            Self::Is(slot, v) => Grade::of(held[*slot].present && held[*slot].value == *v),
            Self::All(list) => list.iter().fold(Grade::TOP, |all, i| all.and(before[*i])),
            Self::Any(list) => list.iter().fold(Grade::BOTTOM, |any, i| any.or(before[*i])),
            Self::Not(i) => before[*i].contrary(),
            Self::Rise(i, last) => before[*i].and(last.replace(before[*i]).unwrap_or(Grade::BOTTOM).contrary()),
            Self::Fall(i, last) => before[*i].contrary().and(last.replace(before[*i]).unwrap_or(Grade::BOTTOM)),
            Self::Once(i, window) => window.update(position, before[*i]),
            Self::Historically(i, window) => window.update(position, before[*i].contrary()).contrary(),
            Self::Since(hold, from, since) => since.update(position, before[*hold], before[*from]),
            Self::Lived(time, start) => {
                let begun = *start.get_or_insert(position);
                Grade::of(position >= begun.saturating_add(*time))
            }
        }
    }

    /// What it is made of.
    pub fn made_of(&self) -> MadeOf {
        match self {
            Self::Compare { left, right, .. } => MadeOf { numbers: vec![*left, *right], ..MadeOf::default() },
            Self::Age { slot, .. } | Self::IsTrue(slot) | Self::Is(slot, _) => {
                MadeOf { inputs: vec![*slot], ..MadeOf::default() }
            }
            Self::All(list) | Self::Any(list) => MadeOf { truths: list.to_vec(), ..MadeOf::default() },
            Self::Not(i) | Self::Rise(i, _) | Self::Fall(i, _) | Self::Once(i, _) | Self::Historically(i, _) => {
                MadeOf { truths: vec![*i], ..MadeOf::default() }
            }
            Self::Since(hold, from, _) => MadeOf { truths: vec![*hold, *from], ..MadeOf::default() },
            Self::Lived(..) => MadeOf::default(),
        }
    }

    /// Whether it may ever change though nothing it is made of does.
    pub fn is_timed(&self) -> bool {
        match self {
            Self::Age { .. } | Self::Once(..) | Self::Historically(..) | Self::Since(..) | Self::Lived(..) => true,
            // That a rise is over is seen by who evaluates.
            Self::Compare { .. } | Self::IsTrue(_) | Self::Is(..) | Self::All(_) | Self::Any(_) => false,
            Self::Not(_) | Self::Rise(..) | Self::Fall(..) => false,
        }
    }

    /// The next position at which it may change though nothing it is made of does.
    pub fn next(&self, position: u64, held: &[InputSample]) -> u64 {
        match self {
            Self::Age { slot, op, bound, start: Some(start) } => {
                // The bound is crossed at it, or right behind it.
                let behind = match op {
                    Comparison::Above | Comparison::AtMost => 1,
                    Comparison::AtLeast | Comparison::Below | Comparison::Equals | Comparison::Differs => 0,
                };
                let since = i64::try_from(held[*slot].since(*start)).unwrap_or(i64::MAX);
                let crossed = u64::try_from(since.saturating_add(*bound)).unwrap_or(0);
                let crossed = crossed.saturating_add(behind);
                match op {
                    Comparison::Equals | Comparison::Differs if crossed == position => position + 1,
                    _ if crossed > position => crossed,
                    _ => u64::MAX,
                }
            }
            // True at an instant only: it may change at the next position, when it was replaced at this one.
            Self::Once(_, window) | Self::Historically(_, window) => window.next(),
            Self::Since(_, _, since) => since.next(),
            Self::Lived(time, Some(start)) => {
                let end = start.saturating_add(*time);
                if end > position { end } else { u64::MAX }
            }
            _ => u64::MAX,
        }
    }

    /// Forgets the history.
    pub fn clear(&mut self) {
        match self {
            Self::Compare { holds, .. } => *holds = false,
            Self::Age { start, .. } | Self::Lived(_, start) => *start = None,
            Self::Rise(_, last) | Self::Fall(_, last) => *last = None,
            Self::Once(_, window) | Self::Historically(_, window) => window.clear(),
            Self::Since(_, _, since) => since.clear(),
            _ => {}
        }
    }

    /// How many pieces were merged so far.
    pub fn merged(&self) -> u64 {
        match self {
            Self::Once(_, window) | Self::Historically(_, window) => window.merged(),
            Self::Since(_, _, since) => since.merged(),
            _ => 0,
        }
    }
}

impl Number {
    /// What it is made of.
    pub fn made_of(&self) -> MadeOf {
        match self {
            Self::Input(slot) | Self::Rate(slot, _) => MadeOf { inputs: vec![*slot], ..MadeOf::default() },
            Self::Constant(_) => MadeOf::default(),
            Self::Norm(list) | Self::Min(list) | Self::Max(list) => {
                MadeOf { numbers: list.to_vec(), ..MadeOf::default() }
            }
            Self::Difference(a, b) => MadeOf { numbers: vec![*a, *b], ..MadeOf::default() },
            Self::Abs(i) => MadeOf { numbers: vec![*i], ..MadeOf::default() },
        }
    }

    /// As [`TruthNode::is_timed`].
    pub fn is_timed(&self) -> bool {
        matches!(self, Self::Rate(..))
    }

    /// As [`TruthNode::next`].
    pub fn next(&self, position: u64) -> u64 {
        match self {
            Self::Rate(_, rate) => rate.next(position),
            _ => u64::MAX,
        }
    }

    /// As [`TruthNode::clear`].
    pub fn clear(&mut self) {
        if let Self::Rate(_, rate) = self {
            rate.clear();
        }
    }

    /// As [`TruthNode::merged`].
    pub fn merged(&self) -> u64 {
        match self {
            Self::Rate(_, rate) => rate.merged,
            _ => 0,
        }
    }
}

/// A comparison whose bound is `slack` easier to keep.
pub fn compare(left: f64, op: Comparison, right: f64, slack: f64) -> Grade {
    let robustness = match op {
        Comparison::Below | Comparison::AtMost => (right + slack) - left,
        Comparison::Above | Comparison::AtLeast => left - (right - slack),
        Comparison::Equals => -(left - right).abs(),
        Comparison::Differs => (left - right).abs(),
    };
    // Nothing is said of what is no number, or of the distance of two infinities.
    if robustness.is_nan() {
        return Grade::BOTTOM;
    }
    // The difference of two different numbers is never zero, so its sign decides.
    let holds = match op {
        Comparison::Below | Comparison::Above | Comparison::Differs => robustness > 0.0,
        Comparison::AtMost | Comparison::AtLeast | Comparison::Equals => robustness >= 0.0,
    };
    Grade { robustness, holds }
}

/// The age at `position` of what was written at position `since`, compared with `bound`. Between two nanoseconds the age
/// is between its values at them.
fn age(position: u64, since: u64, op: Comparison, bound: i64) -> Grade {
    let age = i64::try_from(position.saturating_sub(since)).unwrap_or(i64::MAX);
    Grade::of(match op {
        Comparison::Below => age < bound,
        Comparison::AtMost => age <= bound,
        Comparison::Above => age > bound,
        Comparison::AtLeast => age >= bound,
        Comparison::Equals => age == bound,
        Comparison::Differs => age != bound,
    })
}
