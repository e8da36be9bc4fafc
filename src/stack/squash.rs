//! Keeping each pile of frames within its bound: its oldest become one, which is undone as one (semantics: *The stack*).

use super::net::reduce;
use super::{Frame, FrameId, Inverse, Pile, share};
use crate::limits;
use crate::model::{MemberRef, Step};
use crate::plan::footprint::{Footprint, Slot, Touch};
use crate::plan::undo::{DraftStep, items};
use crate::system::System;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

/// So many squashed frames are remembered.
const REMEMBERED: usize = 4096;

/// What was squashed of which two, for whoever follows thousands of stacks that have the same frames at the bottom.
#[derive(Debug, Clone, Default)]
pub(super) struct Memory(Arc<Mutex<FxHashMap<[usize; 2], Remembered>>>);

#[derive(Debug)]
struct Remembered {
    made: Arc<Frame>,
    /// They stay for as long as they are known by their addresses.
    _of: [Arc<Frame>; 2],
}

impl Memory {
    fn squash(&self, lower: &Arc<Frame>, upper: &Arc<Frame>) -> Arc<Frame> {
        let key = [lower, upper].map(|frame| Arc::as_ptr(frame) as usize);
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(remembered) = known.get(&key) {
            return remembered.made.clone();
        }
        let made = Arc::new(squash(lower, upper));
        if known.len() >= REMEMBERED {
            known.clear();
        }
        known.insert(key, Remembered { made: made.clone(), _of: [lower.clone(), upper.clone()] });
        made
    }
}

/// Whether a pile can be brought to at most `bound` frames.
pub(super) fn fits(frames: &[Arc<Frame>], pile: Pile, bound: usize, busy: &[FrameId], memory: Option<&Memory>) -> bool {
    let own = frames.iter().filter(|frame| pile.has(frame)).count();
    // What the last two of them become is nobody's to know yet.
    match own.checked_sub(bound + 1) {
        None => true,
        Some(0) => pair(frames, pile, busy).is_some(),
        Some(_) => {
            let mut frames = frames.to_vec();
            fit(&mut frames, pile, bound + 1, busy, memory) && pair(&frames, pile, busy).is_some()
        }
    }
}

/// Squashes until a pile has at most `bound` frames; `busy` ones stay as they are. False: no two could be squashed.
pub(super) fn fit(
    frames: &mut Vec<Arc<Frame>>,
    pile: Pile,
    bound: usize,
    busy: &[FrameId],
    memory: Option<&Memory>,
) -> bool {
    while frames.iter().filter(|frame| pile.has(frame)).count() > bound {
        let Some((lower, upper)) = pair(frames, pile, busy) else { return false };
        let upper = frames.remove(upper);
        frames[lower] = match memory {
            Some(memory) => memory.squash(&frames[lower], &upper),
            None => Arc::new(squash(&frames[lower], &upper)),
        };
    }
    true
}

/// The places of the two that are squashed next: the oldest, but such that as much as possible stays possible. The upper
/// one moves down to the lower, so nothing between may share with it.
fn pair(frames: &[Arc<Frame>], pile: Pile, busy: &[FrameId]) -> Option<(usize, usize)> {
    // A partial frame is undone by its name.
    let free = |f: &Frame| f.scope.is_none() && !f.partial && !busy.contains(&f.id);
    let own: Vec<usize> = (0..frames.len()).filter(|at| pile.has(&frames[*at])).collect();
    let newest = own.last().copied();
    let clear = |lower: usize, upper: usize| {
        frames[lower + 1..upper].iter().all(|between| !share::shares(&frames[upper], between))
    };
    let pairs = own.windows(2).map(|two| (two[0], two[1])).filter(|(a, b)| free(&frames[*a]) && free(&frames[*b]));
    // What lies between is looked at last: that takes longest.
    let first = |fits: &dyn Fn(usize, usize) -> bool| pairs.clone().find(|(a, b)| fits(*a, *b) && clear(*a, *b));
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

/// The list that takes a frame back.
pub(super) fn list(frame: &Frame) -> Vec<DraftStep> {
    match &frame.inverse {
        Inverse::Steps(steps) => items(steps, &frame.saved),
        Inverse::List(list) => list.clone(),
    }
}

/// Two neighbours as one frame.
pub(super) fn squash(lower: &Frame, upper: &Frame) -> Frame {
    let mut parts: BTreeSet<_> = lower.parts.iter().chain(&upper.parts).copied().collect();
    for frame in [lower, upper] {
        if !frame.is_squashed() {
            parts.insert(frame.buried());
        }
    }
    let mut seen: FxHashSet<(Slot, u8, Option<Slot>)> = FxHashSet::default();
    let mut touches: Vec<Touch> = lower
        .footprint
        .touches
        .iter()
        .chain(&upper.footprint.touches)
        .filter(|t| seen.insert((t.slot, t.access as u8, t.serves)))
        .copied()
        .collect();
    // Such frames are kept for long, and by whoever follows thousands of stacks in great number.
    touches.shrink_to_fit();
    let mut slots: FxHashSet<Slot> = FxHashSet::default();
    let saved = lower.saved.iter().chain(&upper.saved).filter(|s| slots.insert(s.slot)).cloned().collect();
    let mut floor = lower.floor.clone().or_else(|| upper.floor.clone());
    let mut inverse = Vec::new();
    if floor.is_none() {
        let bound: FxHashSet<MemberRef> = touches
            .iter()
            .filter_map(|t| match (t.slot, t.serves) {
                (Slot::State(_), Some(Slot::Property(property))) => Some(property),
                _ => None,
            })
            .collect();
        let whole: Vec<DraftStep> = list(upper).into_iter().chain(list(lower)).collect();
        inverse = reduce::<System>(whole, None, &|property| bound.contains(&property));
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
        inverse: Inverse::List(inverse),
        footprint: Arc::new(Footprint { touches }),
        saved,
        floor,
        parts,
        scope: None,
        partial: false,
        safe: lower.safe || upper.safe,
    }
}
