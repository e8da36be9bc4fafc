//! Keeping the stack within its bound: the oldest frames become one, which is undone as one (design §5).

use super::net::reduce;
use super::{Frame, FrameId, Inverse};
use crate::limits;
use crate::model::{MemberRef, Step};
use crate::plan::footprint::{Footprint, Slot, Touch};
use crate::plan::undo::{Item, items};
use crate::system::System;
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Squashes until at most `bound` frames are left. False: frames of active states leave no two that could be squashed.
pub(super) fn fit(frames: &mut Vec<Arc<Frame>>, bound: usize, active: &[FrameId]) -> bool {
    while frames.len() > bound {
        let Some(at) = pair(frames, active) else { return false };
        let upper = frames.remove(at + 1);
        frames[at] = Arc::new(squash(&frames[at], &upper));
    }
    true
}

/// The lower of the two neighbours that are squashed next: the oldest, but such that as much as possible stays possible.
fn pair(frames: &[Arc<Frame>], active: &[FrameId]) -> Option<usize> {
    let free = |f: &Frame| !active.contains(&f.id);
    let pairs =
        || frames.windows(2).enumerate().filter(|(_, w)| free(&w[0]) && free(&w[1])).map(|(i, w)| (i, &w[0], &w[1]));
    // Below a floor nothing can be undone anyway.
    // The newest frame stays by itself as long as there is any other way: it is the one most likely to be undone.
    let older = || pairs().filter(|(i, _, _)| i + 2 < frames.len());
    older()
        .find(|(_, _, upper)| upper.floor.is_some())
        // A group's frame is wanted when the group changes.
        .or_else(|| older().find(|(_, a, b)| a.floor.is_none() && a.group.is_none() && b.group.is_none()))
        .or_else(|| older().find(|(_, a, _)| a.floor.is_none()))
        .or_else(|| older().next())
        .or_else(|| pairs().next())
        .map(|(i, _, _)| i)
}

/// The list that takes a frame back.
pub(super) fn list(frame: &Frame) -> Vec<Item> {
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
            parts.insert(frame.part());
        }
    }
    let mut seen: FxHashSet<(Slot, u8, Option<Slot>)> = FxHashSet::default();
    let touches: Vec<Touch> = lower
        .footprint
        .touches
        .iter()
        .chain(&upper.footprint.touches)
        .filter(|t| seen.insert((t.slot, t.access as u8, t.serves)))
        .copied()
        .collect();
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
        let whole: Vec<Item> = list(upper).into_iter().chain(list(lower)).collect();
        inverse = reduce::<System>(whole, None, &|property| bound.contains(&property));
        let calls = inverse.iter().filter(|item| matches!(item.step, Step::Operation(_))).count();
        if calls > limits::SQUASHED_CALLS {
            floor = Some(format!(
                "it was squashed with others, and their {calls} operation calls (more than {}) cannot be kept",
                limits::SQUASHED_CALLS
            ));
            inverse = Vec::new();
        }
    }
    Frame {
        id: upper.id,
        configuration: upper.configuration,
        group: None,
        requester: upper.requester,
        at: upper.at,
        inverse: Inverse::List(inverse),
        footprint: Footprint { touches },
        saved,
        floor,
        parts,
        acts: Vec::new(),
    }
}
