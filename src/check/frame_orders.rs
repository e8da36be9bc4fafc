//! In which orders frames were met on stacks, and as which they were taken instead.

use crate::model::ConfigId;
use crate::stack::Requester;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// In which orders frames of one requester were met, by their configurations: the lower one first.
#[derive(Default)]
pub(super) struct Orders {
    /// Of frames that count.
    met: ConfigPairs,
    /// As which they were taken instead, since it makes no difference to who undoes them.
    taken_as: ConfigPairs,
    /// Of one that counts and one that does not: which lies lower is not looked at.
    beside: ConfigPairs,
}

/// What is noted of a frame: whether it counts, and the numbers of its configuration ([`Orders::numbers`]).
#[derive(Debug, Clone, Copy)]
pub(super) struct Noted {
    pub counts: bool,
    pub met: usize,
    pub beside: usize,
}

/// Pairs of configurations. What lies below a frame is noted at once, for each of thousands of stacks.
#[derive(Default)]
struct ConfigPairs {
    numbers: FxHashMap<ConfigId, usize>,
    /// Of each upper one, the lower ones by their numbers.
    lower: Vec<ConfigBits>,
}

/// Configurations by their numbers, a bit each.
#[derive(Default, Clone)]
struct ConfigBits(SmallVec<[u64; 2]>);

impl ConfigBits {
    fn insert(&mut self, number: usize) {
        if self.0.len() <= number / 64 {
            self.0.resize(number / 64 + 1, 0);
        }
        self.0[number / 64] |= 1 << (number % 64);
    }

    fn extend(&mut self, more: &Self) {
        if self.0.len() < more.0.len() {
            self.0.resize(more.0.len(), 0);
        }
        self.0.iter_mut().zip(&more.0).for_each(|(own, more)| *own |= more);
    }

    fn contains(&self, number: usize) -> bool {
        self.0.get(number / 64).is_some_and(|bits| bits & (1 << (number % 64)) != 0)
    }
}

impl ConfigPairs {
    fn number(&mut self, id: ConfigId) -> usize {
        let next = self.numbers.len();
        let number = *self.numbers.entry(id).or_insert(next);
        if number == next {
            self.lower.push(ConfigBits::default());
        }
        number
    }

    fn insert(&mut self, lower: ConfigId, upper: ConfigId) {
        let (lower, upper) = (self.number(lower), self.number(upper));
        self.lower[upper].insert(lower);
    }

    fn contains(&self, lower: ConfigId, upper: ConfigId) -> bool {
        let (Some(lower), Some(upper)) = (self.numbers.get(&lower), self.numbers.get(&upper)) else { return false };
        self.lower[*upper].contains(*lower)
    }

    fn iter(&self) -> impl Iterator<Item = (ConfigId, ConfigId)> + '_ {
        let all = || self.numbers.iter();
        let of = move |(id, number): (&ConfigId, &usize)| {
            let (id, bits) = (*id, &self.lower[*number]);
            all().filter(|(_, other)| bits.contains(**other)).map(move |(other, _)| (*other, id))
        };
        self.numbers.iter().flat_map(of)
    }
}

impl Orders {
    /// The numbers of a configuration, among those of frames that count and among all.
    pub fn numbers(&mut self, of: ConfigId, counts: bool) -> (usize, usize) {
        (if counts { self.met.number(of) } else { 0 }, self.beside.number(of))
    }

    /// Notes which frames of a stack lie below which.
    pub fn note(&mut self, frames: impl Iterator<Item = (Requester, Noted)>) {
        // Of each requester what lies below, that which counts and that which does not: numbers of `met` and of `beside`.
        let mut below: SmallVec<[(Requester, ConfigBits, ConfigBits, ConfigBits); 2]> = SmallVec::new();
        for (by, Noted { counts, met: number, beside }) in frames {
            let place = below.iter().position(|(of, ..)| *of == by).unwrap_or_else(|| {
                below.push((by, ConfigBits::default(), ConfigBits::default(), ConfigBits::default()));
                below.len() - 1
            });
            let (_, met, counted, uncounted) = &mut below[place];
            if counts {
                self.met.lower[number].extend(met);
                met.insert(number);
                self.beside.lower[beside].extend(uncounted);
                counted.insert(beside);
            } else {
                self.beside.lower[beside].extend(counted);
                uncounted.insert(beside);
            }
        }
    }

    /// One was taken to lie below another one, since it makes no difference.
    pub fn take_as(&mut self, lower: ConfigId, upper: ConfigId) {
        self.taken_as.insert(lower, upper);
    }

    /// Whether stacks were taken for one in which frames of one requester lie in different orders.
    pub fn mixed(&self) -> bool {
        let Self { met, taken_as, beside } = self;
        taken_as.iter().any(|(lower, upper)| met.contains(lower, upper))
            || beside.iter().any(|(lower, upper)| lower != upper && beside.contains(upper, lower))
    }
}
