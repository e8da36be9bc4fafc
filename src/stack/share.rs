//! Whether a frame may be popped, which values it then hands over, and which calls stay (semantics: *The stack*).
//!
//! What a safe configuration has called stays while it is in force, whoever else called the same: nothing takes it back.

use super::void::Connections;
use super::{Frame, FrameId, Inverse};
use crate::model::{Call, ChangeKind, ComponentName, Configuration, Finding, MemberRef, Step, codes};
use crate::plan::SavedValue;
use crate::plan::footprint::{Access, Footprint, Index, Saved, Slot, Touch};
use crate::plan::undo::{DraftStep, absolute, restoring};
use crate::system::Undo;
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// What becomes of a popped frame's absolute writes and calls.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HandOver {
    /// Slots that a frame above wrote, and operations whose calls stay: nothing is sent for them.
    pub(super) slots: FxHashSet<Slot>,
    /// The frame that takes over the saved value.
    takers: Vec<(FrameId, Slot, Saved)>,
}

impl HandOver {
    /// Values that these frames take over, with nothing undone for it.
    pub(super) fn to(takers: Vec<(FrameId, Slot, Saved)>) -> Self {
        Self { takers, ..Self::default() }
    }

    /// Nothing is sent for these either.
    pub(super) fn keep(&mut self, slots: impl IntoIterator<Item = Slot>) {
        self.slots.extend(slots);
    }

    /// What is taken over.
    pub(super) fn taken(&self) -> impl Iterator<Item = Slot> + '_ {
        self.takers.iter().map(|(_, slot, _)| *slot)
    }

    /// Frames that take something over have got other numbers.
    pub(crate) fn renumber(&mut self, real: impl Fn(FrameId) -> FrameId) {
        self.takers.iter_mut().for_each(|(id, ..)| *id = real(*id));
    }

    /// The frames that take something over.
    pub fn takers(&self) -> impl Iterator<Item = FrameId> + '_ {
        self.takers.iter().map(|(id, ..)| *id)
    }
}

/// All components of a footprint.
pub fn components(footprint: &Footprint) -> FxHashSet<ComponentName> {
    let both = footprint.touches.iter().map(|touch| touch.slot.components());
    both.flat_map(|(a, b)| [a, b]).collect()
}

/// Whether two footprints have a component in common.
fn meet(mine: &FxHashSet<ComponentName>, theirs: &Footprint) -> bool {
    theirs.touches.iter().any(|touch| {
        let (a, b) = touch.slot.components();
        mine.contains(&a) || mine.contains(&b)
    })
}

/// The operations that a frame calls and takes back by itself.
pub fn calls(frame: &Frame) -> impl Iterator<Item = MemberRef> + '_ {
    let (steps, items) = match &frame.inverse {
        Inverse::Steps(steps) => (steps.as_slice(), [].as_slice()),
        Inverse::List(items) => ([].as_slice(), items.as_slice()),
    };
    let called = |call: &Call| call.operation;
    let done = steps.iter().filter_map(move |planned| match &planned.step {
        Step::Operation(call) if planned.undo != Undo::Nothing => Some(called(call)),
        _ => None,
    });
    done.chain(items.iter().filter_map(DraftStep::takes_back_call).map(called))
}

/// The operations whose calls stay, since safe ones among these frames have called them.
pub fn kept_calls<'f>(frames: impl IntoIterator<Item = &'f Arc<Frame>>) -> FxHashSet<MemberRef> {
    frames.into_iter().filter(|frame| frame.safe).flat_map(|frame| calls(frame)).collect()
}

/// The slots of a frame's calls that stay when it is popped from among these.
pub fn staying<'f>(frame: &'f Frame, frames: &[Arc<Frame>]) -> impl Iterator<Item = Slot> + 'f {
    let kept = kept_calls(frames.iter().filter(|other| other.id != frame.id));
    calls(frame).filter(move |operation| kept.contains(operation)).map(Slot::Operation)
}

/// The slots that only calls touch which stay when the frame is popped, those of what would take them back included: in which
/// order they were called does not count.
fn untouched(frame: &Frame, stay: &FxHashSet<Slot>) -> FxHashSet<Slot> {
    if stay.is_empty() {
        return FxHashSet::default();
    }
    let (steps, items) = match &frame.inverse {
        Inverse::Steps(steps) => (steps.as_slice(), [].as_slice()),
        Inverse::List(items) => ([].as_slice(), items.as_slice()),
    };
    let operation = |step: &Step| match step {
        Step::Operation(call) => Some(call.operation),
        _ => None,
    };
    let done = steps
        .iter()
        .filter_map(|planned| Some((operation(&planned.step)?, planned.undo.steps().first().and_then(operation))));
    let undone = items.iter().filter_map(|item| {
        let own = operation(&item.step)?;
        Some(item.takes_back_call().map_or((own, None), |call| (call.operation, Some(own))))
    });
    let (mut only, mut also) = (FxHashSet::default(), Vec::new());
    for (of, undo) in done.chain(undone) {
        let both = std::iter::once(of).chain(undo).map(Slot::Operation);
        match stay.contains(&Slot::Operation(of)) {
            true => only.extend(both),
            false => also.extend(both),
        }
    }
    also.iter().for_each(|slot| _ = only.remove(slot));
    only
}

/// The slots of a frame's calls that a safe configuration which replaces it makes as well: they would be taken back first, and what
/// it makes safe be let go for a moment. Its own frame takes them back.
pub(super) fn called_again<'f>(by: &'f Configuration, frame: &'f Frame) -> impl Iterator<Item = Slot> + 'f {
    let calls_too = |operation: &MemberRef| {
        by.changes.iter().any(
            |change| matches!(&change.kind, ChangeKind::OperationCall { call, .. } if call.operation == *operation),
        )
    };
    calls(frame).filter(move |operation| by.safe && calls_too(operation)).map(Slot::Operation)
}

/// Whether a floor may hold back a frame: one of its own file; what is safe is for all.
fn reaches(floor: &Frame, frame: &Frame) -> bool {
    floor.safe || floor.is_of_a_file_of(frame)
}

/// Whether a floor holds back a frame below it, which shares a component with it.
pub(super) fn holds_back(floor: &Frame, frame: &Frame) -> bool {
    reaches(floor, frame) && meet(&components(&frame.footprint), &floor.footprint)
}

/// Whether the frame at `at` may be popped.
pub(super) fn examine(frames: &[Arc<Frame>], at: usize) -> Result<HandOver, Box<Finding>> {
    look(frames, at).map_err(|hindrance| Box::new(hindrance.finding))
}

/// The same, without a word on why not.
pub(super) fn free(frames: &[Arc<Frame>], at: usize) -> Option<HandOver> {
    handed(frames, at).ok()
}

/// What keeps a frame from being popped.
pub(super) struct Hindrance {
    /// The frame above that shares something with it, the newest of them; none: it is a floor, or one above holds it back.
    pub by: Option<FrameId>,
    /// In words.
    pub finding: Finding,
}

/// The same, and which frame it is that stands in its way.
pub(super) fn look(frames: &[Arc<Frame>], at: usize) -> Result<HandOver, Box<Hindrance>> {
    handed(frames, at).map_err(|obstacle| Box::new(obstacle.told(&frames[at])))
}

/// What stands in a frame's way.
enum Obstacle<'f> {
    /// A floor, for this reason.
    Floor(&'f str),
    /// A frame above that touches what it shares.
    Shared(&'f Frame, &'f Touch),
}

impl Obstacle<'_> {
    /// In the way of this frame.
    fn told(self, frame: &Frame) -> Hindrance {
        match self {
            Self::Floor(reason) => {
                let message = format!("`{}` cannot be undone: {reason}", frame.configuration);
                let finding = Finding::error(codes::STACK_FLOOR, message)
                    .help("apply a configuration that leads to the wanted state instead");
                Hindrance { by: None, finding }
            }
            Self::Shared(other, touch) => {
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
                let help = match mine == theirs && frame.group.is_none() {
                    true => format!(
                        "`{mine}` was asked for more than once: give it a `group` of its own, so that it takes the place of the one in force"
                    ),
                    false => format!("undo `{theirs}` first, or undo down to `{mine}`"),
                };
                let finding = Finding::error(codes::STACK_SHARED, message).help(help);
                Hindrance { by: Some(other.id), finding }
            }
        }
    }
}

fn handed(frames: &[Arc<Frame>], at: usize) -> Result<HandOver, Obstacle<'_>> {
    let frame = &frames[at];
    if frames[at..].iter().any(|above| above.floor.is_some()) {
        let mine = components(&frame.footprint);
        for (place, above) in frames[at..].iter().enumerate() {
            // Itself as well.
            if let Some(reason) = &above.floor
                && (place == 0 || reaches(above, frame) && meet(&mine, &above.footprint))
            {
                return Err(Obstacle::Floor(reason));
            }
        }
    }
    let mut hand = HandOver { slots: staying(frame, frames).collect(), ..HandOver::default() };
    let above = &frames[at + 1..];
    if above.is_empty() {
        return Ok(hand);
    }
    let wanted: FxHashMap<Slot, &SavedValue> = frame.saved.iter().map(|s| (s.slot, s)).collect();
    for other in above {
        for saved in &other.saved {
            if let Some(mine) = wanted.get(&saved.slot)
                && hand.slots.insert(saved.slot)
            {
                hand.takers.push((other.id, saved.slot, mine.value.clone()));
            }
        }
    }
    let untouched = untouched(frame, &hand.slots);
    let keep =
        |touch: &Touch| touch.serves.is_none_or(|slot| !hand.slots.contains(&slot)) && !untouched.contains(&touch.slot);
    let index = Index::new(&frame.footprint, keep);
    let mut connections = Connections::default();
    for other in above.iter().rev() {
        let mut touches = other.footprint.touches.iter();
        let shared = touches.find(|touch| index.shares(touch) && !connections.pass(frame, other, touch));
        if let Some(touch) = shared {
            return Err(Obstacle::Shared(other, touch));
        }
    }
    Ok(hand)
}

/// Whether a frame cannot be popped while these lie above it.
pub fn is_kept(frame: &Arc<Frame>, above: impl Iterator<Item = Arc<Frame>>) -> bool {
    let frames: Vec<Arc<Frame>> = std::iter::once(frame.clone()).chain(above).collect();
    free(&frames, 0).is_none()
}

/// Gives the values that a popped frame leaves to their takers.
pub(super) fn hand_over(frames: &mut [Arc<Frame>], hand: &HandOver, real: &dyn Fn(FrameId) -> FrameId) {
    for (taker, slot, value) in &hand.takers {
        let taker = real(*taker);
        let Some(frame) = frames.iter_mut().find(|frame| frame.id == taker) else { continue };
        let frame = Arc::make_mut(frame);
        for saved in frame.saved.iter_mut().filter(|s| s.slot == *slot) {
            saved.value = value.clone();
            if let Inverse::List(items) = &mut frame.inverse
                && let Some(step) = restoring(saved)
                && let Some(item) =
                    Arc::make_mut(items).iter_mut().rev().find(|item| absolute(&item.step) == Some(*slot))
            {
                item.step = step;
            }
        }
    }
}

/// Whether two frames share anything: then their order counts.
pub fn shares(a: &Frame, b: &Frame) -> bool {
    let index = Index::new(&a.footprint, |_| true);
    let absolute: FxHashSet<Slot> = a.saved.iter().map(|saved| saved.slot).collect();
    b.footprint.touches.iter().any(|touch| index.shares(touch)) || b.saved.iter().any(|s| absolute.contains(&s.slot))
}
