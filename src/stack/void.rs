//! What becomes of what a file did to components of a subsystem (semantics: *Composition*): it is void once the subsystem has taken
//! them away, and until then only a connection is in that one's way.

use super::{Frame, FrameId, Inverse};
use crate::model::{ComponentName, MemberRef, Step};
use crate::plan::footprint::{Access, Footprint, Slot, Touch};
use crate::plan::undo::{DraftStep, absolute};
use crate::plan::{PlannedStep, SavedValue};
use crate::system::View;
use crate::system::touch::components;
use rustc_hash::FxHashSet;
use smallvec::SmallVec;
use std::sync::Arc;

/// Which connections foreign frames have made and no newer one has taken away: asked of the frames above one, the newest first.
#[derive(Debug, Default)]
pub(super) struct Connections {
    taken: FxHashSet<(MemberRef, MemberRef)>,
}

impl Connections {
    /// Whether what `other` touches, a frame above `frame`, is no hindrance to the undo of that: it is about a component of the file of
    /// `frame`, and `other` is not of that file. A connection that is there is one, and so is whatever is safe: that is for all inside.
    pub fn pass(&mut self, frame: &Frame, other: &Frame, touch: &Touch) -> bool {
        let own = |of: ComponentName| frame.is_of_file(of.prefix()) && !other.is_of_file(of.prefix());
        let (a, b) = touch.slot.components();
        if other.safe || !own(a) && !own(b) {
            return false;
        }
        match touch.slot {
            Slot::Link(from, to) => self.is_taken(other, from, to),
            // Who only demands that nothing drives it has written there.
            Slot::Drive(port) if touch.serves.is_none() => {
                let mut touches = other.footprint.touches.iter();
                touches.all(|touch| !matches!(touch.slot, Slot::Link(from, to) if to == port && !self.is_taken(other, from, to)))
            }
            _ => true,
        }
    }

    fn is_taken(&mut self, other: &Frame, from: MemberRef, to: MemberRef) -> bool {
        match left_connected(other, from, to) {
            _ if self.taken.contains(&(from, to)) => true,
            Some(connected) => {
                self.taken.insert((from, to));
                !connected
            }
            None => true,
        }
    }
}

/// Whether a frame left two ports connected; none: it left that as it was.
fn left_connected(frame: &Frame, from: MemberRef, to: MemberRef) -> Option<bool> {
    let is = |step: &Step| match step {
        Step::Connect { from: a, to: b, .. } if (*a, *b) == (from, to) => Some(true),
        Step::Disconnect { from: a, to: b } if (*a, *b) == (from, to) => Some(false),
        _ => None,
    };
    match &frame.inverse {
        Inverse::Steps(steps) => steps.iter().rev().find_map(|planned| is(&planned.step)),
        // What a floor did is not kept.
        Inverse::List(items) if frame.floor.is_some() && items.is_empty() => Some(true),
        Inverse::List(items) => items.iter().find_map(|item| is(&item.step)).map(|back| !back),
    }
}

/// A component that its own file takes away.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct TakenAway {
    /// Which.
    pub component: ComponentName,
    /// The one that this frame had put in the place of another one, which is there again, with all that was done to that before.
    pub from: Option<FrameId>,
}

/// Whether what a frame of another file did to a component is void with these.
pub(super) fn is_void(gone: &[TakenAway], frame: &Frame, component: ComponentName) -> bool {
    let own = |gone: &TakenAway| gone.component == component && gone.from.is_none_or(|from| frame.id > from);
    gone.iter().any(own) && is_foreign(frame, component)
}

/// Whether a frame is about a component, and of another file than that.
pub(super) fn is_foreign(frame: &Frame, component: ComponentName) -> bool {
    let about = |touch: &Touch| {
        let (a, b) = touch.slot.components();
        a == component || b == component
    };
    !frame.is_of_file(component.prefix()) && frame.footprint.touches.iter().any(about)
}

/// Those of these components that frames of other files are about.
pub(super) fn touched_from_outside(
    frames: &[Arc<Frame>],
    components: impl Iterator<Item = ComponentName>,
) -> Vec<ComponentName> {
    // Of each file whether a frame is of another one: mostly there is one file, and none is.
    let mut files: SmallVec<[(&str, bool); 1]> = SmallVec::new();
    let touched = |of: &ComponentName| -> bool {
        let path = of.prefix();
        let known = files.iter().find(|(other, _)| *other == path).map(|(_, has)| *has);
        let has_foreign = known.unwrap_or_else(|| {
            let has = frames.iter().any(|frame| !frame.is_of_file(path));
            files.push((path, has));
            has
        });
        has_foreign && frames.iter().any(|frame| is_foreign(frame, *of))
    };
    components.filter(touched).collect()
}

/// What the undo of a frame takes away: what it had made, also where what was there before is back. What was done to that before is
/// as it was. Of what is left of a frame it is not known.
pub(super) fn taken_away_with(frame: &Frame, after: &impl View) -> Vec<TakenAway> {
    let made = |touch: &Touch| match touch.slot {
        Slot::Component(of) if touch.access != Access::Need && frame.is_of_file(of.prefix()) => Some(of),
        _ => None,
    };
    let taken_away = |component: ComponentName| {
        let is_there = after.component(component).is_some();
        let from = is_there.then_some(frame.id);
        (!frame.partial || !is_there).then_some(TakenAway { component, from })
    };
    frame.footprint.touches.iter().filter_map(made).filter_map(taken_away).collect()
}

/// What these steps take away. Where they put another component in the place of one it is there all the same, with its connections.
pub(super) fn taken_away_by(steps: &[PlannedStep]) -> Vec<TakenAway> {
    let is_made = |of| steps.iter().any(|p| matches!(p.step, Step::Create { component, .. } if component == of));
    let taken_away = |planned: &PlannedStep| match planned.step {
        Step::Destroy { component } if !is_made(component) => Some(TakenAway { component, from: None }),
        _ => None,
    };
    steps.iter().filter_map(taken_away).collect()
}

/// Takes what is void out of frames: what they did to components that `gone` says are gone. One with nothing left goes. Whether there was
/// anything of that.
pub(super) fn take_out(frames: &mut Vec<Arc<Frame>>, gone: &dyn Fn(&Frame, ComponentName) -> bool) -> bool {
    let mut some = false;
    frames.retain_mut(|frame| {
        let gone = |component: ComponentName| gone(frame, component);
        let either = |slot: Slot| {
            let (a, b) = slot.components();
            gone(a) || gone(b)
        };
        if !frame.footprint.touches.iter().any(|touch| either(touch.slot)) {
            return true;
        }
        some = true;
        let left = without(frame, &gone);
        let stays = !left.footprint.touches.is_empty();
        *frame = Arc::new(left);
        stays
    });
    some
}

fn without(frame: &Frame, gone: &dyn Fn(ComponentName) -> bool) -> Frame {
    let either = |slot: Slot| {
        let (a, b) = slot.components();
        gone(a) || gone(b)
    };
    let of_gone = |step: &Step| components(step).into_iter().any(gone);
    // A call is void with the component that it was for, and with the one that would take it back.
    let is_void = |item: &DraftStep| {
        of_gone(&item.step) || item.takes_back_call().is_some_and(|call| gone(call.operation.component))
    };
    let (mut kept, mut lost) = (FxHashSet::default(), FxHashSet::default());
    for touch in &frame.footprint.touches {
        if let Slot::Link(_, to) = touch.slot {
            _ = if either(touch.slot) { lost.insert(to) } else { kept.insert(to) };
        }
    }
    // What drives a port goes with the connection that does.
    let driven = |touch: &Touch| matches!(touch.slot, Slot::Drive(to) if touch.serves.is_none() && lost.contains(&to) && !kept.contains(&to));
    let touches: Vec<Touch> =
        frame.footprint.touches.iter().filter(|touch| !either(touch.slot) && !driven(touch)).copied().collect();
    let (inverse, mut saved, floor) = match &frame.inverse {
        Inverse::Steps(_) => {
            let (done, saved) = rest(frame, &|planned| !of_gone(&planned.step));
            let floor = crate::plan::irreversible(&done).map(str::to_owned);
            let saved: Vec<_> = saved.into_iter().filter(|saved| !either(saved.slot)).collect();
            let mut left = crate::plan::undo::items(&done, &saved);
            left.retain(|item| !is_void(item));
            (left, saved, floor)
        }
        Inverse::List(items) => {
            let left: Vec<DraftStep> = items.iter().filter(|item| !is_void(item)).cloned().collect();
            (left, frame.saved.clone(), frame.floor.clone())
        }
    };
    saved.retain(|saved| !either(saved.slot));
    Frame {
        inverse: Inverse::List(Arc::new(inverse)),
        footprint: Arc::new(Footprint { touches }),
        saved,
        floor,
        ..frame.clone()
    }
}

/// The steps of a frame that count, and what they overwrote.
pub(super) fn rest(frame: &Frame, counts: &dyn Fn(&PlannedStep) -> bool) -> (Vec<PlannedStep>, Vec<SavedValue>) {
    let (mut done, mut gone, mut before) = (Vec::new(), Vec::new(), Vec::new());
    for planned in frame.steps() {
        before.push(done.len());
        match counts(planned) {
            true => done.push(planned.clone()),
            false => gone.extend(absolute(&planned.step)),
        }
    }
    // What was overwritten stands at the places of steps.
    let place = |at: u32| before.get(at as usize).map_or(done.len(), |at| *at);
    let saved = frame.saved.iter().filter(|saved| !gone.contains(&saved.slot));
    let saved = saved
        .map(|saved| SavedValue { at: u32::try_from(place(saved.at)).unwrap_or(u32::MAX), ..saved.clone() })
        .collect();
    (done, saved)
}
