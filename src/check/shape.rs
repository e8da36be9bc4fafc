//! Which frames of a stack count, and in what order: what makes two stacks one for whoever asks.

use super::equivalence::{FrameBook, FrameNumber};
use super::frame_orders::{Noted, Orders};
use super::other_frames::{ListNumber, NOBODY, OtherFrames};
use crate::limits;
use crate::model::ConfigId;
use crate::stack::{Frame, FrameId, Requester, Stack, calls, is_kept, staying};
use crate::system::Slot;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
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
    /// Of a frame (its content) among those frames that do not count and that it has to do with, so many of which lie below it.
    under: FxHashMap<(FrameNumber, SmallVec<[FrameNumber; 4]>, usize), u32>,
    /// The same by all that do not count and lie below it, and above it.
    between: FxHashMap<(FrameNumber, ListNumber, ListNumber), u32>,
    others: OtherFrames,
    /// Of stacks that were met, by what their frames contain.
    known: FxHashMap<Box<[FrameNumber]>, Rc<StackShape>>,
    /// What comes of the frames that count, by those who have as many frames as may be, and by what is counted in the order in which it
    /// lies: most stacks differ only in frames that do not count.
    orderings: FxHashMap<SmallVec<[Requester; 2]>, FxHashMap<Box<[Counted]>, Rc<CountedFrames>>>,
    /// Of frames that were met, by their numbers.
    facts: Vec<Option<FrameFacts>>,
    /// The configurations, in the order of their names.
    names: Vec<ConfigId>,
    /// They are all of one file.
    one_file: bool,
}

/// What is always the same of frames that contain the same.
#[derive(Debug, Clone, Copy)]
struct FrameFacts {
    noted: Noted,
    /// It has called something that it takes back by itself.
    calls: bool,
    /// The place of its configuration among all, by their names.
    rank: usize,
}

/// A frame of a stack that counts.
#[derive(Clone, Copy)]
struct CountedFrame<'s> {
    frame: &'s Arc<Frame>,
    place: usize,
    rank: usize,
    counted: Counted,
}

/// What comes of the frames of a stack that count.
struct CountedFrames {
    /// Which of them comes when, in a canonical order.
    order: Vec<usize>,
    /// They, in that order.
    counted: Rc<[Counted]>,
    /// See [`StackShape`].
    deep: [Option<ConfigId>; 2],
}

/// What of a stack counts: always the same for frames that contain the same.
#[derive(Debug)]
pub struct StackShape {
    /// The frames that count, in a canonical order.
    pub counted: Rc<[Counted]>,
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

impl Shapes {
    /// Shapes in which these frames count, of these configurations.
    pub fn new(undone: Undone, configurations: impl Iterator<Item = ConfigId>) -> Self {
        let mut names: Vec<ConfigId> = configurations.collect();
        names.sort_unstable_by_key(ConfigId::as_str);
        let one_file = names.iter().all(|name| name.prefix().is_empty());
        Self { undone, names, one_file, ..Self::default() }
    }

    /// What of a stack counts.
    pub fn of(&mut self, stack: &Stack) -> Rc<StackShape> {
        let numbers: SmallVec<[FrameNumber; 64]> =
            stack.frames().iter().map(|frame| self.frames.number(frame)).collect();
        if let Some(known) = self.known.get(&numbers[..]) {
            return known.clone();
        }
        let shape = Rc::new(self.work_out(stack, &numbers));
        self.known.insert(numbers[..].into(), shape.clone());
        shape
    }

    /// What is to be known of a frame of that number.
    fn facts(&mut self, frame: &Frame, number: FrameNumber) -> FrameFacts {
        if let Some(known) = self.facts.get(number.index()).copied().flatten() {
            return known;
        }
        let counts = self.undone.counts(frame);
        let name = self.names.binary_search_by_key(&frame.configuration.as_str(), ConfigId::as_str);
        let (met, beside) = self.orders.numbers(frame.configuration, counts);
        let facts = FrameFacts {
            noted: Noted { counts, met, beside },
            calls: calls(frame).next().is_some(),
            rank: name.unwrap_or_else(|at| at),
        };
        if self.facts.len() <= number.index() {
            self.facts.resize(number.index() + 1, None);
        }
        self.facts[number.index()] = Some(facts);
        facts
    }

    /// The stack is made of frames that are kept already where they are the same.
    pub fn share(&mut self, stack: &mut Stack) {
        stack.share(|frame| self.frames.keep(frame));
    }

    fn work_out(&mut self, stack: &Stack, numbers: &[FrameNumber]) -> StackShape {
        let frames = stack.frames();
        let facts: SmallVec<[FrameFacts; 64]> =
            frames.iter().zip(numbers).map(|(frame, number)| self.facts(frame, *number)).collect();
        self.orders.note(frames.iter().zip(&facts).map(|(frame, facts)| (frame.requester, facts.noted)));
        let above = self.others_above(numbers, &facts);
        let mut kept: Vec<CountedFrame<'_>> = Vec::with_capacity(frames.len());
        let mut below = NOBODY;
        for (place, frame) in frames.iter().enumerate() {
            let (number, own) = (numbers[place], facts[place]);
            if !own.noted.counts {
                // Those below matter only to what it has called, and only safe ones.
                if frame.safe {
                    below = self.others.with(below, number, self.one_file);
                }
                continue;
            }
            let key = (number, if own.calls { below } else { NOBODY }, above[place]);
            let under = self.between.get(&key).copied().unwrap_or_else(|| {
                let under = self.under(frames, numbers, &facts, place);
                self.between.insert(key, under);
                under
            });
            kept.push(CountedFrame { frame, place, rank: own.rank, counted: (number, under) });
        }
        let frames = self.counted_frames(stack, &kept);
        let CountedFrames { order, counted, deep: [deep, left] } = &*frames;
        let places = order.iter().map(|at| u16::try_from(kept[*at].place).unwrap_or(u16::MAX)).collect();
        StackShape { counted: counted.clone(), places, deep: *deep, left: *left }
    }

    /// What comes of the frames that count: worked out once for those that contain the same, to which the same is done.
    fn counted_frames(&mut self, stack: &Stack, kept: &[CountedFrame<'_>]) -> Rc<CountedFrames> {
        let full = full(stack, kept);
        let lie: SmallVec<[Counted; 64]> = kept.iter().map(|frame| frame.counted).collect();
        let known = self.orderings.get(&full).and_then(|of| of.get(&lie[..]));
        known.cloned().unwrap_or_else(|| {
            let order = self.canonical(&full, kept);
            let counted = order.iter().map(|at| lie[*at]).collect();
            let most = [limits::CHECK_FRAMES, limits::CHECK_LEFT];
            let deep = more_than(most, kept.iter().map(|frame| frame.frame));
            let frames = Rc::new(CountedFrames { order, counted, deep });
            self.orderings.entry(full).or_default().insert(lie[..].into(), frames.clone());
            frames
        })
    }

    /// Of each frame which of those above it do not count.
    fn others_above(&mut self, numbers: &[FrameNumber], facts: &[FrameFacts]) -> SmallVec<[ListNumber; 64]> {
        let mut above = SmallVec::from_elem(NOBODY, numbers.len());
        let mut list = NOBODY;
        for (place, number) in numbers.iter().enumerate().rev() {
            above[place] = list;
            if !facts[place].noted.counts {
                list = self.others.with(list, *number, self.one_file);
            }
        }
        above
    }

    /// The number of what frames that do not count do to one that does.
    fn under(&mut self, frames: &[Arc<Frame>], numbers: &[FrameNumber], facts: &[FrameFacts], place: usize) -> u32 {
        let frame = &frames[place];
        let other = |at: &usize| !facts[*at].noted.counts;
        let lower = (0..place).filter(|at| other(at) && facts[place].calls && frames[*at].safe);
        let mut lower: SmallVec<[usize; 4]> = lower.collect();
        let meets = |at: &usize| self.frames.meet((frame, numbers[place]), (&frames[*at], numbers[*at]));
        let mut upper: SmallVec<[usize; 4]> = (place + 1..frames.len()).filter(other).filter(meets).collect();
        // Which comes first, and how often, matters only to who takes connections of other files away.
        for list in [&mut lower, &mut upper].into_iter().filter(|_| self.one_file) {
            list.sort_unstable_by_key(|at| numbers[*at]);
            list.dedup_by_key(|at| numbers[*at]);
        }
        let those = lower.iter().chain(&upper);
        let key = (numbers[place], those.clone().map(|at| numbers[*at]).collect(), lower.len());
        self.under.get(&key).copied().unwrap_or_else(|| {
            let next = u32::try_from(self.beneath.len()).unwrap_or(u32::MAX);
            let those: Vec<Arc<Frame>> = those.map(|at| frames[*at].clone()).collect();
            let under = *self.beneath.entry(beneath(frame, &those, lower.len())).or_insert(next);
            self.under.insert(key, under);
            under
        })
    }

    /// The order in which frames that count are taken: of those that could as well lie at the bottom, always that with the least name.
    /// `filling`: whose oldest may have to be squashed, these go first.
    fn canonical(&mut self, filling: &[Requester], kept: &[CountedFrame<'_>]) -> Vec<usize> {
        if self.undone.in_order {
            return (0..kept.len()).collect();
        }
        let alone = kept.iter().all(|frame| frame.frame.requester == kept[0].frame.requester);
        // Of each how many have to go first, and which it keeps waiting.
        let mut waits: Vec<usize> = vec![0; kept.len()];
        let mut behind: Vec<SmallVec<[usize; 2]>> = vec![SmallVec::new(); kept.len()];
        for (at, below) in kept.iter().enumerate() {
            let by = below.frame.requester;
            let full = filling.contains(&by);
            let mut in_row = !full;
            for (other, above) in kept.iter().enumerate().skip(at + 1) {
                let next = !in_row && above.frame.requester == by;
                // Behind the next of a row is the rest of it.
                let apart = above.frame.requester != by || !full;
                if next || apart && !self.commute(below, above) {
                    in_row |= next;
                    waits[other] += 1;
                    behind[at].push(other);
                    if full && alone {
                        break;
                    }
                }
            }
        }
        let mut free: BinaryHeap<Reverse<(usize, usize)>> = BinaryHeap::new();
        free.extend((0..kept.len()).filter(|at| waits[*at] == 0).map(|at| Reverse((kept[at].rank, at))));
        let mut order = Vec::with_capacity(kept.len());
        let (mut taken, mut lowest) = (vec![false; kept.len()], 0);
        while let Some(Reverse((_, at))) = free.pop() {
            let CountedFrame { frame, .. } = kept[at];
            let passed = (lowest..at).filter(|below| !taken[*below]).map(|below| kept[below].frame);
            for below in passed.filter(|below| below.requester == frame.requester) {
                self.orders.take_as(frame.configuration, below.configuration);
            }
            taken[at] = true;
            while taken.get(lowest) == Some(&true) {
                lowest += 1;
            }
            order.push(at);
            for other in &behind[at] {
                waits[*other] -= 1;
                if waits[*other] == 0 {
                    free.push(Reverse((kept[*other].rank, *other)));
                }
            }
        }
        order
    }

    /// Whether stacks were taken for one in which frames of one requester lie in different orders. Which of them are squashed, and
    /// then are not undone by themselves any more, is known for one of these orders.
    pub fn mixes_orders(&self) -> bool {
        self.orders.mixed()
    }

    /// Whether it makes no difference which of two frames lies above the other: they share nothing, and are not undone by
    /// one name.
    fn commute(&mut self, one: &CountedFrame<'_>, other: &CountedFrame<'_>) -> bool {
        let (a, b) = (one.frame, other.frame);
        let one_name = a.requester == b.requester
            && (a.configuration == b.configuration || self.undone.bare.contains(&a.requester));
        !one_name && !self.frames.share((a, one.counted.0), (b, other.counted.0))
    }
}

/// Those of whose frames it may come to squashing. A stack that is not half full is far from that.
fn full(stack: &Stack, kept: &[CountedFrame<'_>]) -> SmallVec<[Requester; 2]> {
    let mut full: SmallVec<[Requester; 2]> = SmallVec::new();
    let mut met: SmallVec<[Requester; 4]> = SmallVec::new();
    for by in kept.iter().map(|frame| frame.frame.requester) {
        if !met.contains(&by) {
            met.push(by);
            let own = stack.frames().iter().filter(|frame| frame.requester == by).count();
            full.extend((!stack.has_room(by, own)).then_some(by));
        }
    }
    full
}

/// Of each of these bounds, a configuration of which one requester has more frames than that. Those of another one come of
/// other rounds.
fn more_than<'f>(most: [usize; 2], frames: impl Iterator<Item = &'f Arc<Frame>>) -> [Option<ConfigId>; 2] {
    let mut counts: SmallVec<[((ConfigId, Requester), usize); 16]> = SmallVec::new();
    let mut deep = [None; 2];
    for frame in frames.filter(|frame| !frame.is_squashed()) {
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

/// What frames that do not count do to one that does, above so many of them.
fn beneath(frame: &Arc<Frame>, others: &[Arc<Frame>], below: usize) -> Beneath {
    let above = &others[below..];
    let over = |slot: &Slot| above.iter().any(|f| f.saved.iter().any(|s| s.slot == *slot));
    let mut handed: Vec<Slot> = frame.saved.iter().map(|s| s.slot).filter(over).collect();
    if calls(frame).next().is_some() {
        handed.extend(staying(frame, others));
    }
    handed.sort_unstable();
    handed.dedup();
    let blocked = !above.is_empty() && is_kept(frame, above.iter().cloned());
    (blocked, handed)
}
