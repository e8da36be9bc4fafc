//! Whether a frame below the top may be popped, and which values it then hands over (design §5).

use super::{Frame, Inverse};
use crate::model::{Finding, codes};
use crate::plan::SavedValue;
use crate::plan::footprint::{Access, Index, Saved, Slot};
use crate::plan::undo::absolute;
use crate::plan::undo::restoring;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// What becomes of a popped frame's absolute writes.
#[derive(Debug, Default)]
pub(super) struct HandOver {
    /// Slots that a frame above wrote: nothing is sent for them.
    pub(super) slots: FxHashSet<Slot>,
    /// The frame (its place) that takes over the saved value.
    takers: Vec<(usize, Slot, Saved)>,
}

/// Whether the frame at `at` may be popped.
pub(super) fn examine(frames: &[Arc<Frame>], at: usize) -> Result<HandOver, Box<Finding>> {
    let frame = &frames[at];
    for above in &frames[at..] {
        if let Some(reason) = &above.floor {
            let message = format!("`{}` cannot be undone: {reason}", frame.configuration);
            let finding = Finding::error(codes::STACK_FLOOR, message)
                .help("apply a configuration that leads to the wanted state instead");
            return Err(Box::new(finding));
        }
    }
    let mut hand = HandOver::default();
    let above = &frames[at + 1..];
    if above.is_empty() {
        return Ok(hand);
    }
    let wanted: FxHashMap<Slot, &SavedValue> = frame.saved.iter().map(|s| (s.slot, s)).collect();
    for (i, other) in above.iter().enumerate() {
        for saved in &other.saved {
            if let Some(mine) = wanted.get(&saved.slot)
                && hand.slots.insert(saved.slot)
            {
                hand.takers.push((at + 1 + i, saved.slot, mine.value.clone()));
            }
        }
    }
    let index = Index::new(&frame.footprint, |touch| touch.serves.is_none_or(|slot| !hand.slots.contains(&slot)));
    for other in above.iter().rev() {
        if let Some(touch) = other.footprint.touches.iter().find(|touch| index.shares(touch)) {
            let did = match touch.access {
                Access::Need => "needs",
                Access::Join | Access::Write => "changes",
            };
            let (mine, theirs) = (frame.configuration, other.configuration);
            let whose = if other.requester == frame.requester {
                String::new()
            } else {
                format!(" (a frame of {})", other.requester)
            };
            let message = format!("`{mine}` cannot be undone before `{theirs}`{whose}, which {did} {}", touch.slot);
            let finding = Finding::error(codes::STACK_SHARED, message)
                .help(format!("undo `{theirs}` first, or undo down to `{mine}`"));
            return Err(Box::new(finding));
        }
    }
    Ok(hand)
}

/// Gives the values of the frame at `at` to their takers and removes the frame.
pub(super) fn remove(frames: &mut Vec<Arc<Frame>>, at: usize, hand: HandOver) {
    for (taker, slot, value) in hand.takers {
        let frame = Arc::make_mut(&mut frames[taker]);
        for saved in frame.saved.iter_mut().filter(|s| s.slot == slot) {
            saved.value = value.clone();
            if let Inverse::List(items) = &mut frame.inverse
                && let Some(step) = restoring(saved)
                && let Some(item) = items.iter_mut().rev().find(|item| absolute(&item.step) == Some(slot))
            {
                item.step = step;
            }
        }
    }
    frames.remove(at);
}
