//! Keeping each pile of frames within its bound: its oldest become one, which is undone as one (semantics: *The stack*).

use super::net::reduce_among;
use super::share::{self, HandOver};
use super::{Buried, Frame, FrameId, Inverse, Pile};
use crate::limits;
use crate::model::{ComponentName, MemberRef, Step};
use crate::plan::footprint::{Footprint, Slot, Touch};
use crate::plan::undo::{DraftStep, absolute, items};
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// So many squashed frames are remembered.
const REMEMBERED: usize = 4096;

/// What was squashed of which two, for whoever follows thousands of stacks that have the same frames at the bottom.
#[derive(Debug, Clone, Default)]
pub(super) struct Memory(Arc<Mutex<SquashedFrames>>);

#[derive(Debug, Default)]
struct SquashedFrames {
    /// By their addresses.
    same: FxHashMap<[usize; 2], Remembered>,
    /// By the addresses of what they share with others that differ in their numbers alone.
    alike: FxHashMap<[usize; 4], SmallVec<[Remembered; 1]>>,
}

#[derive(Debug)]
struct Remembered {
    made: Arc<Frame>,
    /// They stay for as long as they are known by their addresses.
    of: [Arc<Frame>; 2],
}

impl Memory {
    fn squash(&self, lower: &Arc<Frame>, upper: &Arc<Frame>) -> Arc<Frame> {
        let key = [lower, upper].map(|frame| Arc::as_ptr(frame) as usize);
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(remembered) = known.same.get(&key) {
            return remembered.made.clone();
        }
        let made = known.made_of(lower, upper);
        if known.same.len() >= REMEMBERED {
            known.same.clear();
        }
        known.same.insert(key, Remembered { made: made.clone(), of: [lower.clone(), upper.clone()] });
        made
    }
}

impl SquashedFrames {
    /// Two frames as one, worked out once for all that differ in their numbers alone.
    fn made_of(&mut self, lower: &Arc<Frame>, upper: &Arc<Frame>) -> Arc<Frame> {
        let ([a, b], [c, d]) = (shared(lower), shared(upper));
        if self.alike.len() >= REMEMBERED {
            self.alike.clear();
        }
        let alike = self.alike.entry([a, b, c, d]).or_default();
        let fits = |Remembered { of: [a, b], .. }: &&Remembered| a.is_like(lower) && b.is_like(upper);
        if let Some(Remembered { made, .. }) = alike.iter().find(fits) {
            return Arc::new(Frame { id: upper.id, at: upper.at, ..(**made).clone() });
        }
        let made = Arc::new(squash(lower, upper));
        alike.push(Remembered { made: made.clone(), of: [lower.clone(), upper.clone()] });
        made
    }
}

/// Where that stands which frames share that were copied of each other.
fn shared(frame: &Frame) -> [usize; 2] {
    let inverse = match &frame.inverse {
        Inverse::Steps(steps) => Arc::as_ptr(steps) as usize,
        Inverse::List(items) => Arc::as_ptr(items) as usize,
    };
    [inverse, Arc::as_ptr(&frame.footprint) as usize]
}

/// Whose frames are squashed, and how far that may go.
#[derive(Clone, Copy)]
pub(super) struct Quota<'a> {
    pub pile: Pile,
    pub bound: usize,
    /// These stay as they are.
    pub busy: &'a [FrameId],
}

impl Quota<'_> {
    fn own<'f>(&self, frames: &'f [Arc<Frame>]) -> impl Iterator<Item = usize> + 'f {
        let pile = self.pile;
        (0..frames.len()).filter(move |at| pile.has(&frames[*at]))
    }
}

/// Whether a pile can be brought to at most `bound` frames.
pub(super) fn fits(frames: &[Arc<Frame>], quota: Quota<'_>, memory: Option<&Memory>) -> bool {
    // What the last two of them become is nobody's to know yet.
    match quota.own(frames).count().checked_sub(quota.bound + 1) {
        None => true,
        Some(0) => pair(frames, quota).is_some(),
        Some(_) => {
            let mut frames = frames.to_vec();
            fit(&mut frames, Quota { bound: quota.bound + 1, ..quota }, memory) && pair(&frames, quota).is_some()
        }
    }
}

/// Squashes until a pile has at most `bound` frames. False: no two could be squashed.
pub(super) fn fit(frames: &mut Vec<Arc<Frame>>, quota: Quota<'_>, memory: Option<&Memory>) -> bool {
    // Most stacks have fewer frames than one pile may have.
    while frames.len() > quota.bound && quota.own(frames).count() > quota.bound {
        let Some(Pair { lower, upper, way }) = pair(frames, quota) else { return false };
        let (made, stays, goes) = match (way, memory) {
            (Passage::Up(left, hand), _) => {
                share::hand_over(frames, &hand, &|id| id);
                (Arc::new(squash(&left, &frames[upper])), upper, lower)
            }
            (Passage::Down, Some(memory)) => (memory.squash(&frames[lower], &frames[upper]), lower, upper),
            (Passage::Down, None) => (Arc::new(squash(&frames[lower], &frames[upper])), lower, upper),
        };
        frames[stays] = made;
        frames.remove(goes);
    }
    true
}

/// Two frames that become one, by their places.
struct Pair {
    lower: usize,
    upper: usize,
    way: Passage,
}

/// Where they become one.
enum Passage {
    /// At the lower one's place: the upper one shares with nothing between.
    Down,
    /// At the upper one's place: what lies between takes over what the lower one wrote, and the upper one wrote that again. This is left
    /// of the lower one.
    Up(Box<Frame>, HandOver),
}

/// The two that are squashed next: the oldest, but such that as much as possible stays possible.
fn pair(frames: &[Arc<Frame>], quota: Quota<'_>) -> Option<Pair> {
    // A frame of a safe configuration is undone by its name before anything moves again; of those the newest is in force.
    let safe = frames.iter().rev().find(|frame| frame.safe && quota.pile.has(frame)).map(|frame| frame.id);
    among(frames, quota, &|frame| !frame.safe)
        .or_else(|| safe.and_then(|safe| among(frames, quota, &|frame| frame.id != safe)))
        .or_else(|| safe.and_then(|_| among(frames, quota, &|_| true)))
}

fn among(frames: &[Arc<Frame>], quota: Quota<'_>, may: &dyn Fn(&Frame) -> bool) -> Option<Pair> {
    // A partial frame is undone by its name.
    let free = |f: &Frame| f.scope.is_none() && !f.partial && !quota.busy.contains(&f.id) && may(f);
    let own: SmallVec<[usize; 96]> = quota.own(frames).collect();
    let newest = own.last().copied();
    let mut lower = own.first().copied().filter(|at| free(&frames[*at]));
    let mut pairs: SmallVec<[(usize, usize); 96]> = SmallVec::new();
    for upper in own.iter().skip(1).copied() {
        let fits = free(&frames[upper]).then_some(upper);
        pairs.extend(lower.zip(fits));
        lower = fits;
    }
    // What lies between is looked at last: that takes longest.
    let first = |fits: &dyn Fn(usize, usize) -> bool| {
        let mut fitting = pairs.iter().copied().filter(|(a, b)| fits(*a, *b));
        fitting.find_map(|(lower, upper)| Some(Pair { lower, upper, way: way(frames, lower, upper, quota.busy)? }))
    };
    // The newest frame stays by itself as long as there is any other way: it is the one most likely to be undone.
    let older = |upper: usize| Some(upper) != newest;
    let (floor, group) = (|at: usize| frames[at].floor.is_some(), |at: usize| frames[at].group.is_some());
    // Below a floor nothing can be undone anyway.
    first(&|_, b| older(b) && floor(b))
        // A group's frame is wanted when the group changes.
        .or_else(|| first(&|a, b| older(b) && !floor(a) && !group(a) && !group(b)))
        .or_else(|| first(&|a, b| older(b) && !floor(a)))
        .or_else(|| first(&|_, b| older(b)))
        .or_else(|| first(&|_, _| true))
}

/// A frame of somebody else that keeps two of the pile apart.
pub(super) fn between<'f>(frames: &'f [Arc<Frame>], quota: Quota<'_>) -> Option<&'f Frame> {
    let own: Vec<usize> = quota.own(frames).collect();
    let apart = own.windows(2).flat_map(|two| {
        let upper = &frames[two[1]];
        frames[two[0] + 1..two[1]].iter().filter(move |between| share::shares(upper, between))
    });
    apart.map(|frame| &**frame).next()
}

/// How two become one past what lies between: whatever is undone later leads to where it would have led.
fn way(frames: &[Arc<Frame>], lower: usize, upper: usize, busy: &[FrameId]) -> Option<Passage> {
    if frames[lower + 1..upper].iter().all(|between| !share::shares(&frames[upper], between)) {
        return Some(Passage::Down);
    }
    let hand = share::free(&frames[..upper], lower)?;
    let (old, new) = (&frames[lower], &frames[upper]);
    // What a run state serves is not taken apart.
    let again = |slot: Slot| {
        new.saved.iter().any(|saved| saved.slot == slot)
            && !old.footprint.touches.iter().any(|touch| touch.serves == Some(slot))
    };
    if !hand.taken().all(again) || hand.takers().any(|id| busy.contains(&id)) {
        return None;
    }
    let left = Box::new(overwritten(old, &hand.taken().collect()));
    // Also what keeps nobody from undoing the lower one: above, it might keep that from being undone.
    let clear = frames[lower + 1..upper].iter().all(|between| !share::shares(&left, between));
    clear.then_some(Passage::Up(left, hand))
}

/// What is left of a frame whose absolute writes of these slots others have taken over.
fn overwritten(frame: &Frame, slots: &FxHashSet<Slot>) -> Frame {
    let mut inverse = list(frame);
    inverse.retain(|item| absolute(&item.step).is_none_or(|slot| !slots.contains(&slot)));
    let saved = frame.saved.iter().filter(|saved| !slots.contains(&saved.slot)).cloned().collect();
    let touches = frame.footprint.touches.iter().filter(|touch| !slots.contains(&touch.slot)).copied().collect();
    Frame {
        inverse: Inverse::List(Arc::new(inverse)),
        saved,
        footprint: Arc::new(Footprint { touches }),
        ..frame.clone()
    }
}

/// The list that takes a frame back.
pub(super) fn list(frame: &Frame) -> Vec<DraftStep> {
    match &frame.inverse {
        Inverse::Steps(steps) => items(steps, &frame.saved),
        Inverse::List(list) => list.to_vec(),
    }
}

/// What becomes one frame. Where the upper one adds nothing it is what the lower one has: such frames are kept for long, and by
/// whoever follows thousands of stacks in great number.
fn parts(lower: &Frame, upper: &Frame) -> Arc<BTreeSet<Buried>> {
    let mut parts = lower.parts.clone();
    let own = [lower, upper].into_iter().filter(|frame| !frame.is_squashed()).map(Frame::buried);
    for part in upper.parts.iter().copied().chain(own) {
        if !parts.contains(&part) {
            Arc::make_mut(&mut parts).insert(part);
        }
    }
    parts
}

/// What both touch, each once.
fn footprint(lower: &Arc<Footprint>, upper: &Footprint) -> Arc<Footprint> {
    let most = lower.touches.len() + upper.touches.len();
    let mut seen: FxHashSet<(Slot, u8, Option<Slot>)> = FxHashSet::with_capacity_and_hasher(most, FxBuildHasher);
    let mut is_new = |touch: &&Touch| seen.insert((touch.slot, touch.access as u8, touch.serves));
    let own: Vec<&Touch> = lower.touches.iter().filter(&mut is_new).collect();
    let more: Vec<&Touch> = upper.touches.iter().filter(is_new).collect();
    if more.is_empty() && own.len() == lower.touches.len() {
        return lower.clone();
    }
    let mut touches = Vec::with_capacity(own.len() + more.len());
    touches.extend(own.into_iter().chain(more));
    Arc::new(Footprint { touches })
}

/// Who has something for itself that another one has, too, at another time.
fn rivals(footprint: &Footprint) -> FxHashSet<ComponentName> {
    let held = || {
        footprint.touches.iter().filter_map(|touch| match touch.slot {
            Slot::Held(component, name) => Some((component, name)),
            _ => None,
        })
    };
    let rival = |(component, name)| held().any(|(other, of)| of == name && other != component);
    held().filter(|held| rival(*held)).map(|(component, _)| component).collect()
}

/// Two neighbours as one frame.
pub(super) fn squash(lower: &Frame, upper: &Frame) -> Frame {
    let parts = parts(lower, upper);
    let footprint = footprint(&lower.footprint, &upper.footprint);
    let mut slots: FxHashSet<Slot> = FxHashSet::default();
    let saved = lower.saved.iter().chain(&upper.saved).filter(|s| slots.insert(s.slot)).cloned().collect();
    let mut floor = lower.floor.clone().or_else(|| upper.floor.clone());
    let mut inverse = Vec::new();
    if floor.is_none() {
        let bound: FxHashSet<MemberRef> = footprint
            .touches
            .iter()
            .filter_map(|t| match (t.slot, t.serves) {
                (Slot::State(_), Some(Slot::Property(property))) => Some(property),
                _ => None,
            })
            .collect();
        let whole: Vec<DraftStep> = list(upper).into_iter().chain(list(lower)).collect();
        let rivals = rivals(&footprint);
        inverse = reduce_among(whole, &|property| bound.contains(&property), &|component| rivals.contains(&component));
        let calls = inverse.iter().filter(|item| matches!(item.step, Step::Operation(_))).count();
        if calls > limits::SQUASHED_CALLS {
            floor = Some(format!(
                "it was squashed with others, and their {calls} operation calls (more than {}) cannot be kept",
                limits::SQUASHED_CALLS
            ));
            inverse = Vec::new();
        }
        inverse.shrink_to_fit();
    }
    Frame {
        id: upper.id,
        configuration: upper.configuration,
        group: None,
        requester: upper.requester,
        at: upper.at,
        // Going round and round leads back to where it began.
        inverse: match &lower.inverse {
            Inverse::List(list) if **list == inverse => Inverse::List(list.clone()),
            _ => Inverse::List(Arc::new(inverse)),
        },
        footprint,
        saved,
        floor,
        parts,
        scope: None,
        left: lower.left && upper.left,
        partial: false,
        safe: lower.safe || upper.safe,
        owes: Arc::default(),
    }
}
