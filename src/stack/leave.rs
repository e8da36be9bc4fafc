//! What a coordinator that leads down takes along: frames that nobody asks for any more and that stand in the way of what it
//! undoes (semantics: *Stopping*).
//!
//! An operator may have put something on top of what a coordinator has applied; while everything is being stopped nobody is
//! there who would take that away again. And what a state brought with it may be in force though that was left: something safe
//! came while it was to be undone, or that failed. The coordinator's chart has no place from where it would be asked for again. So it goes
//! first, newest first, in one transaction with the undo that was asked for: both or none. What an operator has made `safe`, and what would
//! move, is nobody's to take along.

use super::claims::{Claim, Claims};
use super::request::{Batch, LedDown, Request, Requester, Why};
use super::share::{self, Hindrance};
use super::{Frame, FrameId, Inverse, Stack, World};
use crate::model::names::is_within;
use crate::model::{Ask, ComponentName, ConfigId, Finding};
use crate::plan::PlannedStep;
use crate::plan::undo::DraftStep;
use crate::system::touch::{Slot, slot};
use crate::system::{View, step};
use rustc_hash::FxHashSet;
use smallvec::SmallVec;
use std::sync::Arc;

/// Whether an undo takes along what stands in its way, while everything is led down.
fn takes_along(request: &Request) -> bool {
    request.why == Why::Asked && request.ask.is_undo() && matches!(request.requester, Requester::Coordinator(_))
}

/// Whether a frame may be one that an undo takes along: nobody asks for it any more.
fn is_loose(frame: &Frame, led: LedDown) -> bool {
    frame.requester == Requester::Operator || frame.left && led.is_led_by(frame.requester)
}

/// What a frame is about that is outside of what is led down.
fn outside(led: LedDown, frame: &Frame) -> Option<ComponentName> {
    let LedDown::Inside(path) = led else { return None };
    share::components(&frame.footprint).into_iter().filter(|one| !is_within(one.prefix(), path.as_str())).min()
}

impl Stack {
    /// What a batch claims beside what its text names, since its undos may take it along while this is led down: frames of operators, and of states
    /// that its coordinator has left, that are about what it is about, and those that are about what these are about. None: there are none.
    pub fn taken_along(&self, batch: &Batch, led: LedDown, claims: &Claims) -> Option<Claim> {
        let own = |request: &Request| takes_along(request) && led.is_led_by(request.requester);
        batch.requests.iter().find(|request| own(request))?;
        let loose = self.frames.iter().filter(|frame| is_loose(frame, led) && outside(led, frame).is_none());
        let mut open: Vec<Claim> = loose.map(|frame| claims.of_frame(frame)).collect();
        if open.is_empty() {
            return None;
        }
        let (mut about, mut along) = (claims.of(&batch.requests), None);
        while let Some(at) = open.iter().position(|frame| frame.meets(&about)) {
            let frame = open.swap_remove(at);
            about.join(&frame);
            along.get_or_insert_with(Claim::default).join(&frame);
        }
        along
    }
}

/// What a frame that moves when it is undone is in the way of.
#[derive(Debug, Clone, PartialEq)]
pub struct Barring {
    /// What moves.
    pub moves: String,
    /// Of who asked for it, what is not undone before it, and why.
    pub of: Vec<(ConfigId, String)>,
}

impl World {
    /// The configuration whose frame, asked for by the same one, is in the way of the undo of that one's newest frame of `id`; none: there is none.
    pub fn own_in_the_way(&self, id: ConfigId, by: Requester) -> Option<ConfigId> {
        let frames = self.stack.frames();
        let at = frames.iter().rposition(|frame| (frame.configuration, frame.requester) == (id, by))?;
        let above = share::look(frames, at).err()?.by?;
        self.stack.frame(above).filter(|above| above.requester == by).map(|above| above.configuration)
    }

    /// What the newest frame of a configuration that one has asked for is in the way of, where that moves when it is undone; none: it does not,
    /// or is in the way of nothing.
    pub fn barring(&self, id: ConfigId, by: Requester) -> Option<Barring> {
        let frames = self.stack.frames();
        let own = |frame: &&Arc<Frame>| frame.requester == by;
        let frame = frames.iter().rev().filter(own).find(|frame| frame.configuration == id && !frame.safe)?;
        let moves = moving(frame, frames, &self.system)?;
        let others = frames.iter().filter(own).filter(|other| other.configuration != id && other.id < frame.id);
        let bars = |other: &Arc<Frame>| {
            let hindrance = share::look(&[other.clone(), frame.clone()], 0).err()?;
            Some((other.configuration, hindrance.finding.message))
        };
        let of: Vec<(ConfigId, String)> = others.filter_map(bars).collect();
        (!of.is_empty()).then_some(Barring { moves, of })
    }
}

/// The frames that the undo of `id`, asked for by `request`, takes along, in the order in which they go; none where it needs
/// none. `frames` are those that there are then, `led` is what is led down. `repaired`: what is broken is mended before.
///
/// # Errors
/// What stands in its way and stays, in words: of one that could be thought to be taken along also why it does.
pub(super) fn along(
    world: &World,
    frames: &[Arc<Frame>],
    request: &Request,
    id: FrameId,
    (led, repaired): (LedDown, bool),
) -> Result<SmallVec<[FrameId; 2]>, Box<Finding>> {
    let mut along: SmallVec<[FrameId; 2]> = SmallVec::new();
    if !takes_along(request) {
        return Ok(along);
    }
    let mut first: Option<Finding> = None;
    let mut open: SmallVec<[FrameId; 4]> = SmallVec::from_iter([id]);
    while let Some(next) = open.pop() {
        // As it will be when those are gone.
        let there = |frame: &&Arc<Frame>| frame.id == next || !along.contains(&frame.id);
        let rest: Vec<Arc<Frame>> = frames.iter().filter(there).cloned().collect();
        let Some(at) = rest.iter().position(|frame| frame.id == next) else { continue };
        let Err(hindrance) = share::look(&rest, at) else { continue };
        let Hindrance { by, finding } = *hindrance;
        let frame = rest.iter().find(|frame| Some(frame.id) == by);
        let why = match frame.map(|frame| stays(world, frame, &rest, (led, repaired))) {
            Some(None) => None,
            Some(Some(why)) => Some(why),
            None => Some(None),
        };
        if let Some(why) = why {
            // In the way of the undo itself, or of what would go with it.
            let whole = |what: &str, why: String| format!("{what}; that is not undone with it: {why}");
            let told = match why {
                Some(why) => whole(&finding.message, why),
                None => finding.message.clone(),
            };
            let first = first.filter(|_| next != id);
            let message = first.map_or(told.clone(), |first| whole(&first.message, told));
            return Err(Box::new(Finding { message, ..finding }));
        }
        let Some(frame) = frame else { continue };
        first.get_or_insert(finding);
        along.push(frame.id);
        open.extend([next, frame.id]);
    }
    // Newest first.
    let place = |id: &FrameId| frames.iter().position(|frame| frame.id == *id);
    along.sort_by_key(|id| std::cmp::Reverse(place(id)));
    Ok(along)
}

/// Whether a frame is not taken along from among these, and why, where it could be thought to be.
fn stays(
    world: &World,
    frame: &Frame,
    frames: &[Arc<Frame>],
    (led, repaired): (LedDown, bool),
) -> Option<Option<String>> {
    if !is_loose(frame, led) {
        return Some(None);
    }
    if let Some(component) = outside(led, frame) {
        return Some(Some(format!("it is about `{component}` as well, which goes on")));
    }
    // What its own coordinator has left was to be let go of.
    if frame.safe && !frame.left {
        return Some(Some("it is a safe configuration, and people let it go".to_owned()));
    }
    if let Some(step) = moving(frame, frames, &world.system) {
        let why = match frame.left {
            true => {
                format!("`{step}` moves, and `{}` has to be asked for by its name", Ask::UndoOf(frame.configuration))
            }
            false => format!("`{step}` moves, and nobody asked for that"),
        };
        return Some(Some(why));
    }
    let mut components = share::components(&frame.footprint).into_iter();
    let broken = world.broken_at(&mut components).filter(|_| !repaired)?;
    Some(Some(format!("what it is about is broken: {}", broken.residual.cause)))
}

/// What moves when a frame is undone that is one of these.
fn moving(frame: &Frame, frames: &[Arc<Frame>], view: &impl View) -> Option<String> {
    let staying: FxHashSet<Slot> = share::staying(frame, frames).collect();
    match &frame.inverse {
        Inverse::Steps(steps) => {
            let moves = |planned: &&PlannedStep| planned.undo_moves && !staying.contains(&slot(&planned.step));
            let back = steps.iter().rev().filter(moves);
            back.flat_map(|planned| planned.undo.steps()).map(ToString::to_string).next()
        }
        Inverse::List(items) => {
            let goes = |item: &&DraftStep| item.may_stay().is_none_or(|slot| !staying.contains(&slot));
            let mut back = items.iter().filter(goes);
            back.find(|item| step::moves(&item.step, view)).map(|item| item.step.to_string())
        }
    }
}
