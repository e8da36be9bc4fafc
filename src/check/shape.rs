//! Which frames of a stack count, and in what order: what makes two stacks one for whoever asks.

use super::equivalence::{FrameBook, FrameNumber};
use crate::limits;
use crate::model::ConfigId;
use crate::stack::{Frame, FrameId, Requester, Stack, calls, is_kept, staying};
use crate::system::Slot;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::rc::Rc;
use std::sync::Arc;

/// A frame that counts: its content, and the number of what frames that do not count do to it.
pub type Counted = (FrameNumber, u32);

/// Whether frames that do not count keep a frame from being undone, and which of its values these would take over and of its
/// calls they keep.
type Beneath = (bool, Vec<Slot>);

/// Which frames count.
#[derive(Debug, Clone, Default)]
pub struct Undone {
    /// Configurations whose frames somebody may undo; none: all.
    pub ids: Option<FxHashSet<ConfigId>>,
    /// Those who undo whatever is their newest.
    pub bare: FxHashSet<Requester>,
    /// Whether the order of frames counts also where nothing can tell it, and their numbers: then a frame has its number for
    /// good, whatever worlds it is met in.
    pub in_order: bool,
}

impl Undone {
    pub fn counts(&self, frame: &Frame) -> bool {
        let named = |ids: &FxHashSet<ConfigId>| {
            ids.contains(&frame.configuration) || frame.parts.iter().any(|part| ids.contains(&part.configuration))
        };
        self.ids.as_ref().is_none_or(named)
            || self.bare.contains(&frame.requester)
            || frame.requester == Requester::Operator
    }
}

/// The shapes of stacks.
#[derive(Default)]
pub struct Shapes {
    /// Which frames count.
    pub undone: Undone,
    frames: FrameBook,
    orders: Orders,
    beneath: FxHashMap<Beneath, u32>,
    /// Of a frame (its content) among the frames that do not count, so many of which lie below it.
    under: FxHashMap<(FrameNumber, SmallVec<[FrameNumber; 4]>, usize), u32>,
    /// Of stacks that were met, by what their frames contain.
    known: FxHashMap<SmallVec<[FrameNumber; 8]>, Rc<StackShape>>,
}

/// What of a stack counts: always the same for frames that contain the same.
#[derive(Debug)]
pub struct StackShape {
    /// The frames that count, in a canonical order.
    pub counted: Box<[Counted]>,
    /// Their places on the stack.
    places: Box<[u16]>,
    /// A configuration of which one requester has more than [`limits::CHECK_FRAMES`] frames.
    pub deep: Option<ConfigId>,
    /// The same with [`limits::CHECK_LEFT`].
    pub left: Option<ConfigId>,
}

impl StackShape {
    /// The numbers of the frames that count, on a stack of this shape.
    pub fn ids<'s>(&'s self, stack: &'s Stack) -> impl Iterator<Item = FrameId> + 's {
        self.places.iter().map(|place| stack.frames()[usize::from(*place)].id)
    }
}

/// In which orders frames of one requester were met, by their configurations: the lower one first.
#[derive(Default)]
struct Orders {
    /// Of frames that count.
    met: ConfigPairs,
    /// As which they were taken instead, since it makes no difference to who undoes them.
    taken_as: ConfigPairs,
    /// Of one that counts and one that does not: which lies lower is not looked at.
    beside: ConfigPairs,
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
    fn note(&mut self, frames: &[Arc<Frame>], counts: &[bool]) {
        // Of each requester what lies below, that which counts and that which does not: numbers of `met` and of `beside`.
        let mut below: SmallVec<[(Requester, ConfigBits, ConfigBits, ConfigBits); 2]> = SmallVec::new();
        for (frame, counts) in frames.iter().zip(counts) {
            let place = below.iter().position(|(by, ..)| *by == frame.requester).unwrap_or_else(|| {
                below.push((frame.requester, ConfigBits::default(), ConfigBits::default(), ConfigBits::default()));
                below.len() - 1
            });
            let (_, met, counted, uncounted) = &mut below[place];
            let beside = self.beside.number(frame.configuration);
            if *counts {
                let number = self.met.number(frame.configuration);
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
}

impl Shapes {
    /// Shapes in which these frames count.
    pub fn new(undone: Undone) -> Self {
        Self { undone, ..Self::default() }
    }

    /// What of a stack counts.
    pub fn of(&mut self, stack: &Stack) -> Rc<StackShape> {
        let numbers: SmallVec<[FrameNumber; 8]> =
            stack.frames().iter().map(|frame| self.frames.number(frame)).collect();
        if let Some(known) = self.known.get(&numbers) {
            return known.clone();
        }
        let shape = Rc::new(self.work_out(stack));
        self.known.insert(numbers, shape.clone());
        shape
    }

    /// The stack is made of frames that are kept already where they are the same.
    pub fn share(&mut self, stack: &mut Stack) {
        stack.share(|frame| self.frames.keep(frame));
    }

    fn work_out(&mut self, stack: &Stack) -> StackShape {
        let frames = stack.frames();
        let counts: Vec<bool> = frames.iter().map(|frame| self.undone.counts(frame)).collect();
        self.orders.note(frames, &counts);
        let mut kept: Vec<(&Arc<Frame>, Counted)> = Vec::new();
        let others: SmallVec<[&Arc<Frame>; 4]> =
            frames.iter().zip(&counts).filter(|(_, counts)| !**counts).map(|(frame, _)| frame).collect();
        let numbers: SmallVec<[FrameNumber; 4]> = others.iter().map(|frame| self.frames.number(frame)).collect();
        let mut below = 0;
        for (i, frame) in frames.iter().enumerate() {
            if !counts[i] {
                below += 1;
                continue;
            }
            let number = self.frames.number(frame);
            // Those below matter only to what it has called.
            let from = if calls(frame).next().is_some() { 0 } else { below };
            let key = (number, SmallVec::from_slice(&numbers[from..]), below - from);
            let under = match self.under.get(&key) {
                Some(known) => *known,
                None => {
                    let next = u32::try_from(self.beneath.len()).unwrap_or(u32::MAX);
                    let under = *self.beneath.entry(beneath(frame, &others[from..], below - from)).or_insert(next);
                    self.under.insert(key, under);
                    under
                }
            };
            kept.push((frame, (number, under)));
        }
        // Where it may come to squashing, the oldest go first. A stack that is not half full is far from that.
        let of = |by: Requester| frames.iter().filter(|frame| frame.requester == by).count();
        let filling =
            |a: &Frame, b: &Frame| a.requester == b.requester && !stack.has_room(a.requester, of(a.requester));
        let mut counted = Vec::with_capacity(kept.len());
        let mut places = Vec::with_capacity(kept.len());
        while !kept.is_empty() {
            // Of those that could as well lie at the bottom, that with the least name.
            let mut least = 0;
            for at in 1..kept.len() {
                let smaller = kept[at].0.configuration.as_str() < kept[least].0.configuration.as_str();
                let mut passes =
                    |below: usize| !filling(kept[below].0, kept[at].0) && self.commute(&kept[below], &kept[at]);
                if smaller && (0..at).all(&mut passes) {
                    least = at;
                }
            }
            let (frame, one) = kept.remove(least);
            for (below, _) in kept[..least].iter().filter(|(below, _)| below.requester == frame.requester) {
                self.orders.taken_as.insert(frame.configuration, below.configuration);
            }
            counted.push(one);
            let place = frames.iter().position(|other| Arc::ptr_eq(other, frame)).unwrap_or_default();
            places.push(u16::try_from(place).unwrap_or(u16::MAX));
        }
        let [deep, left] = self.more_than([limits::CHECK_FRAMES, limits::CHECK_LEFT], stack);
        StackShape { counted: counted.into(), places: places.into(), deep, left }
    }

    /// Of each of these bounds, a configuration of which one requester has more frames than that. Those of another one come of
    /// other rounds.
    fn more_than(&self, most: [usize; 2], stack: &Stack) -> [Option<ConfigId>; 2] {
        let mut counts: SmallVec<[((ConfigId, Requester), usize); 16]> = SmallVec::new();
        let mut deep = [None; 2];
        for frame in stack.frames().iter().filter(|frame| self.undone.counts(frame) && !frame.is_squashed()) {
            let key = (frame.configuration, frame.requester);
            let count = match counts.iter_mut().find(|(of, _)| *of == key) {
                Some((_, count)) => {
                    *count += 1;
                    *count
                }
                None => {
                    counts.push((key, 1));
                    1
                }
            };
            for (deep, most) in deep.iter_mut().zip(most) {
                *deep = deep.or((count > most).then_some(frame.configuration));
            }
        }
        deep
    }

    /// Whether stacks were taken for one in which frames of one requester lie in different orders. Which of them are squashed, and
    /// then are not undone by themselves any more, is known for one of these orders.
    pub fn mixes_orders(&self) -> bool {
        let Orders { met, taken_as, beside } = &self.orders;
        taken_as.iter().any(|(lower, upper)| met.contains(lower, upper))
            || beside.iter().any(|(lower, upper)| lower != upper && beside.contains(upper, lower))
    }

    /// Whether it makes no difference which of two frames lies above the other: they share nothing, and are not undone by
    /// one name.
    fn commute(&mut self, (a, one): &(&Arc<Frame>, Counted), (b, other): &(&Arc<Frame>, Counted)) -> bool {
        if self.undone.in_order {
            return false;
        }
        let one_name = a.requester == b.requester
            && (a.configuration == b.configuration || self.undone.bare.contains(&a.requester));
        !one_name && !self.frames.share((a, one.0), (b, other.0))
    }
}

/// What frames that do not count do to one that does, above so many of them.
fn beneath(frame: &Arc<Frame>, others: &[&Arc<Frame>], below: usize) -> Beneath {
    let others: Vec<Arc<Frame>> = others.iter().map(|frame| (*frame).clone()).collect();
    let above = &others[below..];
    let over = |slot: &Slot| above.iter().any(|f| f.saved.iter().any(|s| s.slot == *slot));
    let mut handed: Vec<Slot> = frame.saved.iter().map(|s| s.slot).filter(over).collect();
    if calls(frame).next().is_some() {
        handed.extend(staying(frame, &others));
    }
    handed.sort_unstable();
    handed.dedup();
    let blocked = !above.is_empty() && is_kept(frame, above.iter().cloned());
    (blocked, handed)
}
