//! What a safe configuration comes to: as much of it as can be done, whatever is in its way (semantics: *Safe configurations*).
//!
//! It is planned whole where that goes; else piece by piece, each piece by itself. What concerns a component that is not
//! there has nothing to be made safe, and is left out.

use super::net;
use super::share::{self, HandOver, shares};
use super::squash::{list, squash};
use super::there::{is_done, of_what_is_there};
use super::void::rest;
use super::work::{Op, Part, Planned, transaction};
use super::{Edits, Frame, FrameId, Inverse, Reason, Request, Stack};
use crate::model::{Change, ChangeKind, ComponentName, Configuration, RunState, StateList, Step, Transition, codes};
use crate::plan::footprint::{Footprint, Slot};
use crate::plan::undo::{DraftStep, absolute, items};
use crate::plan::{PlanContext, PlannedStep, plan_on};
use crate::system::touch::{Access, Touch, slot};
use crate::system::{Overlay, System, View};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::smallvec;
use std::sync::Arc;

/// A safe configuration, planned as far as it goes.
#[derive(Debug, Clone)]
pub struct BestEffort {
    /// What is done.
    pub planned: Planned,
    /// The frame it leaves, without a number.
    pub frame: Frame,
    /// Why pieces of it cannot be done.
    pub troubles: Vec<Reason>,
}

/// What the safe `configuration`, asked for by `request`, comes to.
pub fn effort(
    system: &System,
    stack: &Stack,
    configuration: &Configuration,
    request: &Request,
    at: Time,
    context: &PlanContext,
) -> BestEffort {
    let mut best = on_top(system, stack, configuration, request, (at, context))
        .or_else(|| whole(system, stack, configuration, request, (at, context)))
        .unwrap_or_else(|| piecewise(system, configuration, request, at, context));
    let own = |frame: &Arc<Frame>| frame.configuration == configuration.id;
    if configuration.group.is_none() && stack.frames.iter().any(own) {
        best.keeps_gone(system, configuration);
    }
    best
}

impl BestEffort {
    /// What it would destroy and is gone already, by its own frame below, is to stay so: the undo of that one may not make it anew.
    fn keeps_gone(&mut self, system: &System, configuration: &Configuration) {
        let gone = |change: &Change| match change.kind {
            ChangeKind::Destroy { component } if system.component(component).is_none() => Some(component),
            _ => None,
        };
        let gone: Vec<ComponentName> = configuration.changes.iter().filter_map(gone).collect();
        if gone.is_empty() {
            return;
        }
        let needs = gone.into_iter().map(|component| Touch::new(Slot::Component(component), Access::Need));
        Arc::make_mut(&mut self.frame.footprint).touches.extend(needs);
        let frame = Some(Arc::new(self.frame.clone()));
        let part = &mut self.planned.parts[0];
        (part.frame, part.edits.push) = (frame.clone(), frame);
    }
}

/// Planned whole, if it can be.
fn whole(
    system: &System,
    stack: &Stack,
    configuration: &Configuration,
    request: &Request,
    (at, context): (Time, &PlanContext),
) -> Option<BestEffort> {
    let scope = request.scope.filter(|_| !request.gone);
    let op = Op::Push { configuration, requester: request.requester, at, scope };
    let mut planned = transaction(system, stack, &[op], context).ok()?;
    let frame = planned.parts[0].edits.push.as_deref().cloned()?;
    if !planned.of.is_empty() {
        let steps: &mut Vec<PlannedStep> = Arc::make_mut(&mut planned.steps);
        net::components_side_by_side(steps);
    }
    Some(BestEffort { planned, frame: Frame { left: request.gone, ..frame }, troubles: Vec::new() })
}

/// What takes the place of something safe, the same once more or another one of its group: what that has made safe stays so, nothing is let go of
/// in between. It is done as things stand, what it calls is called again, and its frame takes the older one over
/// ([`take_over_group`]).
fn on_top(
    system: &System,
    stack: &Stack,
    configuration: &Configuration,
    request: &Request,
    (at, context): (Time, &PlanContext),
) -> Option<BestEffort> {
    let group = configuration.group?;
    let below = stack.frames.iter().rposition(|frame| frame.group == Some(group))?;
    let old = &stack.frames[below];
    if !old.safe || old.foreign_to(request.requester).is_some() {
        return None;
    }
    let mut rest = configuration.clone();
    rest.changes.retain(|change| !is_done(&change.kind, system));
    rest.group = None;
    let mut straight = whole(system, stack, &rest, request, (at, context)).unwrap_or_else(|| {
        let mut by_pieces = piecewise(system, &rest, request, at, context);
        beside(Arc::make_mut(&mut by_pieces.planned.steps).as_mut_slice());
        by_pieces
    });
    // What that one was to take back of others, and did not, is taken back by this one, unless something it has stopped were started for that.
    if !old.owes.is_empty() {
        let mut owing = stack.clone();
        owing.frames[below] = Arc::new(Frame { inverse: Inverse::List(old.owes.clone()), ..(**old).clone() });
        rest.group = Some(group);
        let wanted = |of: &PlannedStep| straight.planned.steps.iter().any(|planned| planned.step == of.step);
        let up = |of: &&PlannedStep| {
            matches!(of.step, Step::State { transition: Transition::Configure | Transition::Start, .. })
        };
        let back = whole(system, &owing, &rest, request, (at, context));
        let back = back.filter(|back| back.planned.steps.iter().filter(up).all(wanted));
        straight = back.map_or(straight, |mut back| {
            back.planned.parts[0].edits.pops.clear();
            back
        });
    }
    straight.frame.group = Some(group);
    let frame = Some(Arc::new(straight.frame.clone()));
    let part = &mut straight.planned.parts[0];
    (part.frame, part.edits.push) = (frame.clone(), frame);
    if over(&stack.frames, below, stack.frames.len()).is_some() {
        part.edits.over = smallvec![old.id];
        straight.planned.popped = vec![old.clone()];
    }
    Some(straight)
}

/// What lies between a frame and the one at `at` has written over the former; none: that cannot go up past these.
fn over(frames: &[Arc<Frame>], below: usize, at: usize) -> Option<HandOver> {
    let lies_on = frames[below + 1..at].iter().any(|between| shares(&frames[below], between));
    if lies_on { share::free(&frames[below..at], 0) } else { Some(HandOver::default()) }
}

/// These are all that is done: what hangs on one component keeps no other one waiting.
fn beside(steps: &mut [PlannedStep]) {
    for (id, planned) in (0..).zip(&mut *steps) {
        (planned.id, planned.wave) = (id, 0);
    }
    net::components_side_by_side(steps);
}

/// The frame of a safe configuration of a group takes the others of that group over that are still there: it did not find them yet when it
/// was planned (an emergency comes again while the first is being applied), or could not be planned whole. Its undo leads to where theirs
/// would have led. What is left of something ordinary that is broken, and that it
/// was not to take the place of (`apart`), is its own matter: who repairs that undoes it by its name.
pub(super) fn take_over_group(frames: &mut Vec<Arc<Frame>>, pushed: FrameId, busy: &[FrameId], apart: &[FrameId]) {
    let Some(mut at) = frames.iter().position(|frame| frame.id == pushed) else { return };
    let Some(group) = frames[at].group else { return };
    for below in (0..at).rev() {
        let (old, new) = (&frames[below], &frames[at]);
        let own_matter = !old.safe && apart.contains(&old.id);
        let free = !busy.contains(&old.id) && !own_matter && old.foreign_to(new.requester).is_none();
        if old.group != Some(group) || !free {
            continue;
        }
        // What lies between stays where it is, and has what it has written over what the old one had.
        if let Some(hand) = over(frames, below, at) {
            let old = rest_of(&frames[below], &hand);
            share::hand_over(frames, &hand, &|id| id);
            let new = Arc::new(taken_over(&old, &frames[at]));
            frames[at] = if new.partial { Arc::new(owing(&old, &frames[at], &new)) } else { new };
            frames.remove(below);
            at -= 1;
        }
    }
}

/// The frame of something safe of which not everything was done (`new`; before it had taken over `old`: `made`), with what it may not have taken back
/// of the one whose place it has taken: of one that is no safe one all, and what a safe one itself owes. What something safe has written, or called as
/// well, is nothing to be taken back.
fn owing(old: &Frame, made: &Frame, new: &Frame) -> Frame {
    let mut owes = if old.safe { (*old.owes).clone() } else { list(old) };
    let own = list(made);
    let is_made_safe = |item: &DraftStep| match (&item.step, absolute(&item.step)) {
        (_, Some(slot)) => made.saved.iter().any(|saved| saved.slot == slot),
        (Step::Operation(_), _) => own.iter().any(|of| of.step == item.step),
        _ => false,
    };
    owes.retain(|item| !is_made_safe(item));
    owes.splice(0..0, made.owes.iter().cloned());
    Frame { owes: Arc::new(owes), ..new.clone() }
}

impl Frame {
    /// What takes it back, step by step.
    pub(crate) fn taking_back(&self) -> Vec<DraftStep> {
        list(self)
    }

    /// What is left of it where these steps of its taking back are done, each of which is used up; but for values, which are written or not. None: nothing
    /// of it is.
    pub(crate) fn but_for(&self, done: &mut Vec<&Step>) -> Option<Self> {
        let mut left = self.taking_back();
        let length = left.len();
        left.retain(|item| {
            let at = done.iter().position(|step| absolute(step).is_none() && **step == item.step);
            at.map(|at| done.remove(at)).is_none()
        });
        (left.len() < length).then(|| Self { inverse: Inverse::List(Arc::new(left)), ..self.clone() })
    }
}

/// What is left of a frame that hands this over.
fn rest_of(frame: &Arc<Frame>, hand: &HandOver) -> Arc<Frame> {
    if hand.slots.is_empty() {
        return frame.clone();
    }
    let given = |slot: Slot| hand.slots.contains(&slot);
    let mut left = list(frame);
    left.retain(|item| !item.may_stay().is_some_and(given));
    let saved = frame.saved.iter().filter(|saved| !given(saved.slot)).cloned().collect();
    let touches = frame.footprint.touches.iter().copied();
    let touches = touches.filter(|touch| !given(touch.slot) && !touch.serves.is_some_and(given)).collect();
    let (inverse, footprint) = (Inverse::List(Arc::new(left)), Arc::new(Footprint { touches }));
    Arc::new(Frame { inverse, saved, footprint, ..(**frame).clone() })
}

/// A frame with what an older one did as well. What both have called is taken back once, and so is what both have brought to a run state: the newer
/// one may have done it in the place of the older one.
fn taken_over(old: &Frame, new: &Frame) -> Frame {
    let (mut own, mut theirs) = (list(new), list(old));
    own.retain(|item| !(matches!(item.step, Step::Operation(_)) && theirs.iter().any(|other| other.step == item.step)));
    if own.is_empty() && new.configuration == old.configuration && new.footprint == old.footprint {
        let (inverse, footprint) = (old.inverse.clone(), old.footprint.clone());
        return Frame { inverse, footprint, saved: old.saved.clone(), floor: old.floor.clone(), ..new.clone() };
    }
    // Where the newer one's list has brought a component there, the older one's goes on from that.
    let mut states: FxHashMap<ComponentName, RunState> = FxHashMap::default();
    for item in &own {
        if let Step::State { component, transition } = item.step {
            states.insert(component, transition.target());
        }
    }
    theirs.retain(|item| match &item.step {
        Step::State { component, transition } => match states.get_mut(component) {
            Some(state) if !transition.allowed_in(*state) => false,
            Some(state) => {
                *state = transition.target();
                true
            }
            None => true,
        },
        Step::Create { component, .. } => {
            states.remove(component);
            true
        }
        _ => true,
    });
    let [old, new] = [(old, theirs), (new, own)]
        .map(|(frame, items)| Frame { inverse: Inverse::List(Arc::new(items)), ..frame.clone() });
    let (group, scope, left, partial) = (new.group, new.scope, new.left, new.partial);
    Frame { group, scope, left, partial, parts: Arc::default(), ..squash(&old, &new) }
}

/// What has been done of taking `others` back: these steps of something safe, as planned (`own`) and with the `frame` of what was done, are owed
/// no more; answers those that something safe had owed. Nobody does them once more, and its end does not take them back: it leads to where the others
/// are not in force.
pub(super) fn owed_no_more(
    stack: &mut Stack,
    others: &[FrameId],
    own: &Frame,
    frame: Frame,
    done: &[Step],
) -> (Frame, Vec<Step>) {
    let (mut left, mut kept, mut made_up) = (done.iter().collect::<Vec<&Step>>(), list(&frame), Vec::new());
    // What it does itself is its own, and its calls are taken back by itself.
    for planned in own.steps() {
        let at = left.iter().position(|step| **step == planned.step);
        at.into_iter().for_each(|at| _ = left.remove(at));
    }
    let own = list(own);
    let before = kept.clone();
    let is_missing = |item: &&DraftStep| {
        let called = done.iter().any(|step| takes_back(item, step));
        called && !kept.iter().any(|of| of.step == item.step)
    };
    let missing: Vec<DraftStep> = own.iter().filter(is_missing).cloned().collect();
    kept.splice(0..0, missing);
    for other in others.iter().filter_map(|id| stack.frame(*id).cloned()).collect::<Vec<_>>() {
        let (mut rest, mut owes) = (list(&other), (*other.owes).clone());
        let done: Vec<DraftStep> = {
            let mut was_done = |item: &&DraftStep| {
                // What its own frame takes back again is no matter of this one.
                let again = || kept.iter().any(|of| undoes(of, &item.step));
                let counts =
                    other.safe || item.takes_back_call().is_some() || absolute(&item.step).is_none() && !again();
                let at = left.iter().position(|step| counts && **step == item.step);
                at.map(|at| left.remove(at)).is_some()
            };
            if other.safe { &owes } else { &rest }.iter().filter(&mut was_done).cloned().collect()
        };
        if done.is_empty() {
            continue;
        }
        // What comes first of these was done last: what is owed lies below what the one that owes it has done.
        let drop_last = |list: &mut Vec<DraftStep>, is: &dyn Fn(&DraftStep) -> bool| {
            list.iter().rposition(is).into_iter().for_each(|at| _ = list.remove(at));
        };
        for item in &done {
            drop_last(&mut rest, &|of| of.step == item.step);
            drop_last(&mut owes, &|of| of.step == item.step);
            let back = |of: &DraftStep| undoes(of, &item.step);
            if kept.iter().filter(|of| back(of)).count() > own.iter().filter(|of| back(of)).count() {
                drop_last(&mut kept, &back);
            }
        }
        if other.safe {
            made_up.extend(done.into_iter().map(|item| item.step));
        }
        stack.replace(Frame { inverse: Inverse::List(Arc::new(rest)), owes: Arc::new(owes), ..(*other).clone() });
    }
    (if kept == before { frame } else { Frame { inverse: Inverse::List(Arc::new(kept)), ..frame } }, made_up)
}

/// The frame of an earlier safe configuration without what a later one was to do in its place, and did not: nobody has. None: it has nothing of that.
/// Run states are as they are in `system`.
pub(super) fn but_for_missed(frame: &Frame, missed: &[Step], system: &System) -> Option<Frame> {
    let mut left = list(frame);
    let before = left.len();
    for step in missed.iter().rev().filter(|step| absolute(step).is_none() && !matches!(step, Step::Operation(_))) {
        // What comes first of this tells how it is, as that frame has it.
        let is_not_so = |item: &DraftStep| match &item.step {
            Step::State { component, transition } => {
                system.component(*component).is_some_and(|node| !transition.allowed_in(node.state))
            }
            _ => undoes(item, step),
        };
        while let Some(at) =
            left.iter().position(|item| slot(&item.step) == slot(step)).filter(|at| is_not_so(&left[*at]))
        {
            left.remove(at);
        }
    }
    (left.len() < before).then(|| Frame { inverse: Inverse::List(Arc::new(left)), ..frame.clone() })
}

/// Whether an item leads back from a step.
fn undoes(item: &DraftStep, step: &Step) -> bool {
    match (step, &item.step) {
        (Step::State { component, transition }, back) => {
            *back == Step::State { component: *component, transition: transition.inverse() }
        }
        (Step::Connect { from, to, .. }, Step::Disconnect { from: a, to: b })
        | (Step::Disconnect { from, to }, Step::Connect { from: a, to: b, .. }) => (from, to) == (a, b),
        (Step::Create { component, .. }, Step::Destroy { component: of })
        | (Step::Destroy { component }, Step::Create { component: of, .. }) => component == of,
        (Step::Operation(_), _) => takes_back(item, step),
        (step, back) => absolute(step).is_some() && absolute(step) == absolute(back),
    }
}

/// Whether an item is the undo of this call.
fn takes_back(item: &DraftStep, step: &Step) -> bool {
    matches!((item.takes_back_call(), step), (Some(call), Step::Operation(of)) if of == call)
}

/// The frame of a safe configuration of which these steps were not done: it takes back what was.
pub fn without(frame: Frame, missed: &[Step]) -> Frame {
    let (done, mut saved) = rest(&frame, &|planned| !missed.contains(&planned.step));
    // What it found written by an earlier one, as it was planned, was not: there is nothing that it would give back.
    let written = |slot: Slot| done.iter().any(|planned| absolute(&planned.step) == Some(slot));
    saved.retain(|saved| written(saved.slot) || missed.iter().all(|step| absolute(step) != Some(saved.slot)));
    Frame { inverse: Inverse::List(Arc::new(items(&done, &saved))), saved, partial: true, ..frame }
}

fn piecewise(
    system: &System,
    configuration: &Configuration,
    request: &Request,
    at: Time,
    context: &PlanContext,
) -> BestEffort {
    let configuration = &*of_what_is_there(system, configuration);
    let mut view = Overlay::new(system);
    let mut steps: Vec<PlannedStep> = Vec::new();
    let mut troubles = Vec::new();
    let (mut footprint, mut saved) = (Footprint::default(), Vec::new());
    for piece in pieces(configuration) {
        let mut trial = view.clone();
        match plan_on(&mut trial, &piece, context) {
            Ok(plan) => {
                view = trial;
                let base = u32::try_from(steps.len()).expect("fewer steps than that");
                let wave = steps.last().map_or(0, |step| step.wave + 1);
                footprint.touches.extend(plan.footprint.touches);
                saved.extend(plan.saved.into_iter().map(|mut value| {
                    value.at += base;
                    value
                }));
                for mut planned in plan.steps {
                    planned.id += base;
                    planned.wave += wave;
                    planned.after.iter_mut().for_each(|id| *id += base);
                    steps.push(planned);
                }
            }
            Err(refusal) if refusal.findings.iter().all(|finding| finding.code == codes::UNKNOWN_COMPONENT) => {}
            Err(refusal) => troubles.push(Reason::Refused(refusal.findings)),
        }
    }
    let steps = Arc::new(steps);
    let frame = Frame {
        id: FrameId(u64::MAX),
        configuration: configuration.id,
        group: configuration.group,
        requester: request.requester,
        at,
        inverse: Inverse::Steps(steps.clone()),
        footprint: Arc::new(footprint),
        saved,
        floor: crate::plan::irreversible(&steps).map(str::to_owned),
        parts: Arc::default(),
        scope: request.scope.filter(|_| !request.gone),
        left: request.gone,
        partial: !troubles.is_empty(),
        safe: true,
        owes: Arc::default(),
    };
    let part = Part {
        range: 0..u32::try_from(steps.len()).expect("fewer steps than that"),
        edits: Edits {
            push: Some(Arc::new(frame.clone())),
            waits: configuration.confirm.is_some(),
            ..Edits::default()
        },
        pushes: Some(configuration.id),
        holds: configuration.holds.is_some(),
        on_failure: configuration.on_failure,
        frame: Some(Arc::new(frame.clone())),
        along: Vec::new(),
    };
    let revision = system.revision();
    let parts = vec![part];
    // As much of it as goes: nothing of it is taken back.
    let kept = FxHashSet::default();
    let (of, whole, warnings, popped) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let planned = Planned { steps, of, whole, parts, revision, warnings, popped, kept };
    BestEffort { planned, frame, troubles }
}

/// A configuration in parts that can each be refused by itself: entries of the lists and changes, in their order.
fn pieces(whole: &Configuration) -> Vec<Configuration> {
    let empty = || Configuration::new(whole.id);
    let one = |entry| StateList::of([entry]).expect("one `_default` at most");
    let pre = whole.pre.iter().map(|entry| Configuration { pre: one(entry), ..empty() });
    let changes =
        whole.changes.iter().map(|change: &Change| Configuration { changes: vec![change.clone()], ..empty() });
    let post = whole.post.iter().map(|entry| Configuration { post: one(entry), ..empty() });
    pre.chain(changes).chain(post).collect()
}
