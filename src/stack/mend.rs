//! What is broken, brought to where the model has it; and with an undo that takes that back anyway, straight to where the
//! undo leads.
//!
//! Mended first and undone then, a component that is not running, though the platform had said so, would be started to be
//! stopped at once: it would move, and nobody asked for that. So both are one net, from what is there to what the undo
//! leads to, with what is undone together with it (semantics: *What goes wrong*).

use super::net::is_bound;
use super::squash::list;
use super::work::{Op, Planned, Work, transaction};
use super::{Broken, Frame, FrameId, HandOver, Inverse, SafeWrites, Stack, World, net};
use crate::model::{ComponentName, MemberRef, Origin, RunState, Snapshot, Step};
use crate::plan::footprint::{Footprint, Index, Saved, Slot};
use crate::plan::undo::{DraftStep, Script, absolute};
use crate::plan::{PlanContext, PlanStage, PlannedStep, Refusal, SavedValue, StepId};
use crate::system::touch::{self, Access, touches};
use crate::system::{Overlay, System, View as _, diff, step};
use smallvec::SmallVec;
use std::sync::Arc;

impl Broken {
    /// What is expected to be there.
    fn expects(&self, slot: Slot) -> Option<Saved> {
        match slot {
            Slot::Property(property) => {
                let one = self.expected.components.get(&property.component)?;
                Some(Saved::Property(one.properties.get(&property.member)?.clone()))
            }
            Slot::Port(port) => Some(Saved::Port(self.expected.ports.get(&port).cloned())),
            _ => None,
        }
    }

    /// The components of which it is known what they are expected to be.
    pub fn own(&self) -> Vec<ComponentName> {
        self.components.difference(&self.guests).copied().collect()
    }

    /// Whether it is expected as this safe configuration had left it: that came before it was seen otherwise.
    fn goes_by(&self, frame: &Frame) -> bool {
        self.seen.as_ref().is_some_and(|seen| frame.id <= seen.newest)
    }
}

impl World {
    /// The picture with something broken as the model has it.
    pub fn as_meant(&self, broken: &Broken) -> System {
        let mut meant = self.system.clone();
        self.put_meant(broken, &mut meant);
        meant
    }

    /// A picture (that as it is, where there is none) in which what is broken is as safe configurations in force had left it:
    /// their undo takes that back, not that of one that comes now. None: nothing is broken.
    pub fn as_left_by_safe(&self, picture: Option<System>) -> Option<System> {
        if self.broken.is_empty() {
            return picture;
        }
        let mut left = picture.unwrap_or_else(|| self.system.clone());
        self.broken.iter().for_each(|broken| self.put_left_by_safe(broken, &mut left));
        Some(left)
    }

    /// Something is broken from now on. What the model has of it may have been written by safe configurations in force: what is
    /// expected is without that, since their undo is to lead there.
    pub fn breaks(&mut self, mut broken: Broken) {
        let held = self.overwritten(&broken).filter_map(|(_, saved)| Some((saved.slot, self.value(saved.slot)?)));
        broken.held = held.collect();
        let written = self.overwritten(&broken).map(|(_, saved)| saved.clone());
        written.collect::<Vec<_>>().iter().for_each(|saved| put_back(saved, &mut broken.expected));
        for (name, one) in &mut broken.expected.components {
            if let Some((before, _)) = self.moved_by_safe(*name).filter(|(_, after)| *after == one.state) {
                one.state = before;
            }
        }
        self.broken.push(broken);
    }

    /// The same of what was seen by looking, while the model had everything as it was wanted: also what safe configurations in
    /// force had written, which is not there then.
    pub fn is_otherwise(&mut self, mut broken: Broken) {
        broken.seen = self.had_written(&broken, &|_| true);
        self.breaks(broken);
    }

    /// The same of what has ended so. What safe configurations in force had written, as far as the model knew, may differ as well: a false *done*.
    pub fn ends_broken(&mut self, mut broken: Broken) {
        let differs = |slot: Slot| broken.residual.difference.iter().any(|step| absolute(step) == Some(slot));
        let seen = self.had_written(&broken, &differs).filter(|seen| !seen.written.is_empty());
        broken.seen = seen;
        self.breaks(broken);
    }

    /// What safe configurations in force had written of something broken, as it was expected. None: nothing is in force.
    fn had_written(&self, broken: &Broken, counts: &dyn Fn(Slot) -> bool) -> Option<SafeWrites> {
        let slots = self.overwritten(broken).map(|(_, saved)| saved.slot).filter(|slot| counts(*slot));
        let written = slots.filter_map(|slot| Some((slot, broken.expects(slot)?))).collect();
        self.stack.frames().iter().map(|frame| frame.id).max().map(|newest| SafeWrites { newest, written })
    }

    /// What safe configurations in force wrote of something broken.
    fn written(&self, broken: &Broken, slot: Slot) -> Option<Saved> {
        let mut frames = self.stack.frames().iter().rev();
        let last = frames.find(|frame| frame.safe && frame.saved.iter().any(|saved| saved.slot == slot))?;
        let seen = broken.seen.as_ref().filter(|_| broken.goes_by(last));
        if let Some((_, value)) = seen.and_then(|seen| seen.written.iter().find(|(of, _)| *of == slot)) {
            return Some(value.clone());
        }
        // One that is not there any more, and is made anew, is to be as that had made it as well.
        let held = || broken.held.iter().find(|(of, _)| *of == slot).map(|(_, value)| value.clone());
        self.value(slot).or_else(held)
    }

    /// What the picture has there.
    fn value(&self, slot: Slot) -> Option<Saved> {
        match slot {
            Slot::Property(property) => {
                let value = self.system.component(property.component).and_then(|node| node.value(property.member));
                value.cloned().map(Saved::Property)
            }
            Slot::Port(port) => step::written(port, &self.system).map(|value| Saved::Port(value.cloned())),
            _ => None,
        }
    }

    /// Puts something broken into `system` as the model has it; what a safe configuration in force has written of it is as
    /// that wrote it.
    pub fn put_meant(&self, broken: &Broken, system: &mut System) {
        let _ = system.adopt(&broken.own(), &broken.expected);
        self.put_left_by_safe(broken, system);
    }

    fn put_left_by_safe(&self, broken: &Broken, system: &mut System) {
        for (_, saved) in self.overwritten(broken) {
            let written = match (saved.slot, self.written(broken, saved.slot)) {
                (Slot::Property(property), Some(Saved::Property(value))) => Some(Step::PropertySet { property, value }),
                (Slot::Port(port), Some(Saved::Port(value))) => Some(Step::PortWrite { port, value }),
                _ => None,
            };
            let there = |member: MemberRef| {
                let node = system.component(member.component);
                node.is_some_and(|node| node.property(member.member).is_some() || node.port(member.member).is_some())
            };
            let written = written.filter(|_| matches!(saved.slot, Slot::Property(of) | Slot::Port(of) if there(of)));
            // Not a step that is done: nothing need allow it.
            written.iter().for_each(|step| step::effect(step, system));
        }
        for component in broken.components.iter().copied() {
            // Where their undo leads somewhere else than is expected, that is told all the time.
            let state = system.component(component).map(|node| node.state);
            if let Some((_, after)) = self.moved_by_safe(component).filter(|(before, _)| Some(*before) == state) {
                system.set_state(component, after);
            }
        }
    }

    /// What safe configurations in force overwrote of something broken, and nobody after them: the frame of the first of each
    /// slot.
    fn overwritten<'w>(&'w self, broken: &'w Broken) -> impl Iterator<Item = (FrameId, &'w SavedValue)> {
        let all = self.stack.frames().iter().filter(|frame| frame.safe).flat_map(|frame| &frame.saved);
        let mut slots: Vec<Slot> = all.map(|saved| saved.slot).collect();
        slots.sort_unstable();
        slots.dedup();
        slots.retain(|slot| broken.components.contains(&slot.components().0));
        slots.into_iter().filter_map(|slot| {
            let frames = self.stack.frames().iter().rev();
            let writes =
                frames.filter_map(move |frame| Some((frame, frame.saved.iter().find(|saved| saved.slot == slot)?)));
            writes.take_while(|(frame, _)| frame.safe).last().map(|(frame, saved)| (frame.id, saved))
        })
    }

    /// What is safe has taken the place of frames (`popped`) among those `before`, oldest first: its undo leads to where theirs would have
    /// led, so what they did to something broken is expected no more.
    pub(super) fn expects_no_more(&mut self, before: &[Arc<Frame>], popped: impl Fn(&Frame) -> bool) {
        for at in (0..before.len()).rev().filter(|at| !before[*at].safe && popped(&before[*at])) {
            let above = || before[at + 1..].iter().filter(|above| !above.safe && !popped(above));
            let items = list(&before[at]);
            for broken in &mut self.broken {
                let components = broken.own();
                let mut meant = self.system.clone();
                if meant.adopt(&components, &broken.expected).is_err() {
                    continue;
                }
                let own = |step: &Step| touch::components(step).iter().any(|of| broken.components.contains(of));
                for step in items.iter().map(|item| &item.step).filter(|step| own(step)) {
                    let stays = |slot| above().any(|above| above.saved.iter().any(|saved| saved.slot == slot));
                    if !absolute(step).is_some_and(stays) {
                        _ = goes_on(step, &mut meant);
                    }
                }
                broken.expected = meant.snapshot_some(&components);
            }
        }
    }

    /// What was seen to be otherwise than one had left it whose place has been `taken` is the matter of the one that has taken it, `pushed`, which
    /// has written `own`: the undo of that leads to where the other one's would have led.
    pub(super) fn answers_for(
        &mut self,
        before: &[Arc<Frame>],
        taken: impl Fn(&Frame) -> bool,
        pushed: FrameId,
        own: &[SavedValue],
    ) {
        for at in 0..self.broken.len() {
            let broken = &self.broken[at];
            let Some(culprit) = broken.culprit.filter(|_| broken.frame.is_none()) else { continue };
            let is_its =
                |frame: &Arc<Frame>| frame.safe && (frame.configuration, frame.requester) == culprit && taken(frame);
            if before.iter().any(is_its) && self.is_nobodys(broken) {
                let broken = &mut self.broken[at];
                broken.frame = Some(pushed);
                // What that one had left is there by this one's word from now on, but for what this one has written over it.
                if let Some(seen) = &mut broken.seen {
                    seen.newest = seen.newest.max(pushed);
                    seen.written.retain(|(slot, _)| own.iter().all(|saved| saved.slot != *slot));
                }
            }
        }
    }

    /// What it takes back of theirs is no more than what is there of something broken, unless that is its own matter: there would be no undo of it.
    pub(super) fn takes_back_what_is_there(&mut self, pushed: FrameId) {
        let Some(frame) = self.stack.frame(pushed) else { return };
        let Inverse::List(items) = &frame.inverse else { return };
        let mut left = self.system.clone();
        let mut is_there = |item: &&DraftStep| {
            let broken = self.broken_at(touch::components(&item.step).into_iter());
            goes_on(&item.step, &mut left) || broken.is_none_or(|broken| broken.frame == Some(pushed))
        };
        let kept: Vec<DraftStep> = items.iter().filter(|item| is_there(item)).cloned().collect();
        if kept.len() < items.len() {
            let frame = Frame { inverse: Inverse::List(Arc::new(kept)), ..(**frame).clone() };
            self.stack.replace(frame);
        }
    }

    /// Whether safe configurations in force have brought something broken to where it is expected, though their undo leads
    /// elsewhere: then it is broken still, and mended when they are undone.
    pub fn is_hidden(&self, broken: &Broken) -> bool {
        let mut expected = broken.expected.components.iter();
        expected.any(|(name, one)| {
            self.moved_by_safe(*name).is_some_and(|(before, after)| after == one.state && before != one.state)
        })
    }

    /// From where to where safe configurations in force moved a component, if nobody has moved it since.
    fn moved_by_safe(&self, component: ComponentName) -> Option<(RunState, RunState)> {
        let moves = self.stack.frames().iter().rev().filter_map(|frame| Some((frame, frame.moved(component)?)));
        let mut safe = moves.take_while(|(frame, _)| frame.safe).map(|(_, moved)| moved);
        let (before, after) = safe.next()?;
        Some((safe.last().map_or(before, |(before, _)| before), after))
    }

    /// Something is broken no more: what safe configurations in force overwrote of it goes back to what the model had there.
    pub fn hand_meant(&mut self, broken: &Broken) {
        let all = self.overwritten(broken);
        let all = all.filter_map(|(frame, saved)| Some((frame, saved.slot, broken.expects(saved.slot)?)));
        let hand = HandOver::to(all.collect());
        self.stack.hand_over(&hand);
    }

    /// What mends something broken, on the picture as it is. Nothing of it undoes what a safe configuration in force wrote or
    /// demanded: those come also to what is broken.
    pub fn mending(&self, broken: &Broken) -> Vec<Step> {
        let meant = self.as_meant(broken);
        let mut steps = diff(&self.system, &meant);
        let before = steps.len();
        steps.retain(|step| !self.is_safe_ones(step, &meant, broken, &|_| false));
        if steps.len() < before {
            // One that comes after what was left out may not be possible.
            let mut view = Overlay::new(&self.system);
            steps.retain(|step| step::apply(step, &mut view).is_ok());
        }
        steps
    }

    /// Whether a step would change what a safe configuration in force, other than those that are `undone`, wrote or demanded,
    /// and nobody after it. A component that ends as it is now is only brought to where something may be set, and back.
    fn is_safe_ones(&self, step: &Step, wanted: &System, broken: &Broken, undone: &dyn Fn(FrameId) -> bool) -> bool {
        let mut frames = self.stack.frames().iter().rev().filter(|frame| !undone(frame.id));
        if self.stack.safe().next().is_none() {
            return false;
        }
        let state = |of: &System, name| of.component(name).map(|node| node.state);
        // Of what is gone they have nothing: it is made, and does not move.
        let leads_there = match step {
            Step::State { component, .. } => match state(&self.system, *component) {
                None => !step::moves(step, wanted),
                // Where they moved it to, it goes for them.
                now => {
                    let goal = state(wanted, *component);
                    now == goal || self.moved_by_safe(*component).is_some_and(|(_, after)| goal == Some(after))
                }
            },
            _ => false,
        };
        if leads_there {
            return false;
        }
        let mut touches = touches(step, None, wanted).into_vec();
        touches.retain(|touch| touch.access != Access::Need);
        let made = if let Step::Create { component, .. } = step { Some(Slot::Component(*component)) } else { None };
        let index = Index::new(&Footprint { touches }, |_| true);
        let written = absolute(step);
        let newest = frames.find(|frame| {
            // What others need is not wanted by them.
            let mut touches = frame.footprint.touches.iter().filter(|t| frame.safe || t.access != Access::Need);
            if let Some(made) = made {
                return touches.any(|touch| touch.slot == made && touch.access != Access::Need);
            }
            touches.any(|touch| index.shares(touch)) || written.is_some_and(|slot| frame.footprint.writes(slot))
        });
        newest.is_some_and(|frame| frame.safe && !broken.goes_by(frame))
    }

    /// The undo of a frame, with those of others that come first, in a picture.
    ///
    /// # Errors
    /// [`Refusal`]: it is refused there.
    pub(super) fn undo_in(
        wanted: &System,
        stack: &Stack,
        (frame, with): (FrameId, &[FrameId]),
        context: &PlanContext,
    ) -> Result<Planned, Refusal> {
        if with.is_empty() {
            return transaction(wanted, stack, &[Op::Undo(frame)], context);
        }
        let mut view = Overlay::new(wanted);
        let mut work = Work::new(&mut view, stack);
        work.add_undo(frame, with)?;
        work.finish(wanted, None)
    }

    /// The undo of a frame in one net with what mends what is broken at this place. None: there is nothing that would be
    /// mended to be taken back at once, and each goes by itself.
    pub fn straight(&self, at: usize, frame: FrameId, context: &PlanContext) -> Option<Planned> {
        let wanted = self.as_meant(&self.broken[at]);
        self.in_one_net(at, &wanted, Self::undo_in(&wanted, &self.stack, (frame, &[]), context).ok()?)
    }

    /// The same of an undo that is planned in the picture `wanted`, to which is mended.
    pub(super) fn in_one_net(&self, at: usize, wanted: &System, undo: Planned) -> Option<Planned> {
        let broken = &self.broken[at];
        let mend = diff(&self.system, wanted);
        let out = broken.residual.unsettled.iter().any(|step| self.quarantined.contains(&step.component()));
        if mend.is_empty() || out {
            return None;
        }
        let mut end = wanted.clone();
        for planned in undo.steps.iter() {
            step::apply(&planned.step, &mut end).ok()?;
        }
        let mends = mend.len();
        let alone = |step| DraftStep::bare(step, PlanStage::Changes, Origin::NONE);
        let items = mend.into_iter().map(alone).chain(undo.steps.iter().map(DraftStep::of)).collect();
        let shorter = self.spared(items, mends, wanted);
        if shorter.iter().filter(|item| (item.of as usize) < mends).count() == mends {
            return None;
        }
        let calls = undo.steps.iter().any(|planned| matches!(planned.step, Step::Operation(_)));
        let steps = self.leads_to(shorter, &end).or_else(|| {
            // What lies between the two does not matter where nothing is called there.
            let whole = diff(&self.system, &end).into_iter().map(alone).collect();
            if calls { None } else { self.leads_to(whole, &end) }
        })?;
        let undone = |id: FrameId| undo.popped.iter().any(|popped| popped.id == id);
        if steps.iter().any(|planned| self.is_safe_ones(&planned.step, wanted, broken, &undone)) {
            return None;
        }
        let mut parts = undo.parts;
        for part in &mut parts {
            part.range = 0..u32::try_from(steps.len()).expect("fewer steps than that");
            // All of it is one.
            part.along.iter_mut().for_each(|along| along.range = 0..0);
        }
        let revision = self.system.revision();
        Some(Planned { steps: Arc::new(steps), of: Vec::new(), whole: Vec::new(), parts, revision, ..undo })
    }

    /// The net of `items`, of which the first so many mend and the others undo, each with its place among them. A call needs
    /// no run state: nothing moves to be as it was for one, and back.
    fn spared(&self, mut items: Vec<DraftStep>, mends: usize, wanted: &System) -> Vec<DraftStep> {
        (0..).zip(&mut items).for_each(|(place, item)| item.of = place);
        let mended = |item: &DraftStep| (item.of as usize) < mends;
        let bound = |property: MemberRef| is_bound(property, &self.system, wanted);
        let mut net = net::reduce(items, Some(&self.system), &bound);
        let mut at = 0;
        while at < net.len() {
            if let Step::State { component, transition } = &net[at].step
                && mended(&net[at])
                && step::moves(&net[at].step, wanted)
            {
                let next =
                    |item: &DraftStep| matches!(&item.step, Step::State { component: of, .. } if of == component);
                let back = Step::State { component: *component, transition: transition.inverse() };
                let later = net[at + 1..].iter().position(next).map(|later| at + 1 + later);
                if let Some(later) = later.filter(|later| net[*later].step == back && !mended(&net[*later])) {
                    net.remove(later);
                    net.remove(at);
                    continue;
                }
            }
            at += 1;
        }
        net
    }

    /// The steps, one after the other, if they lead from what is there to `end`.
    fn leads_to(&self, items: Vec<DraftStep>, end: &System) -> Option<Vec<PlannedStep>> {
        let mut view = Overlay::new(&self.system);
        let mut script = Script::new(&mut view);
        for item in items {
            let after: SmallVec<[StepId; 1]> = script.steps.last().map(|s| s.id).into_iter().collect();
            script.add(item, 0, &after).ok()?;
        }
        let steps = script.finish().ok()?;
        let mut reached = self.system.clone();
        for planned in &steps {
            step::apply(&planned.step, &mut reached).ok()?;
        }
        diff(&reached, end).is_empty().then_some(steps)
    }
}

/// Puts into what is expected what was there before something wrote over it.
fn put_back(saved: &SavedValue, expected: &mut Snapshot) {
    match (saved.slot, &saved.value) {
        (Slot::Property(property), Saved::Property(value)) => {
            let one = expected.components.get_mut(&property.component);
            let there = one.and_then(|one| one.properties.get_mut(&property.member));
            there.into_iter().for_each(|there| *there = value.clone());
        }
        (Slot::Port(port), Saved::Port(Some(value))) if expected.components.contains_key(&port.component) => {
            expected.ports.insert(port, value.clone());
        }
        (Slot::Port(port), Saved::Port(None)) => drop(expected.ports.remove(&port)),
        _ => {}
    }
}

impl Frame {
    /// What has ended *broken* while the one that this is to be the frame of was being applied is not expected with what that has `done` already: its
    /// undo will take that back.
    pub fn leaves_out(&self, done: &[&Step], expected: &mut Snapshot) {
        let wrote = |slot: Slot| done.iter().any(|step| absolute(step) == Some(slot));
        self.saved.iter().filter(|saved| wrote(saved.slot)).for_each(|saved| put_back(saved, expected));
        for (name, one) in &mut expected.components {
            let mut moves = done.iter().filter_map(|step| match step {
                Step::State { component, transition } if component == name => Some(*transition),
                _ => None,
            });
            if let Some(first) = moves.next()
                && moves.next_back().unwrap_or(first).target() == one.state
            {
                one.state = first.inverse().target();
            }
        }
    }
}

/// Does a step where there is what it begins with; that it may be done now is nothing to ask. False: there is not.
pub(super) fn goes_on(step: &Step, system: &mut System) -> bool {
    let there = leads_on(step, system);
    match step {
        // With what is connected to it: others may have done that.
        Step::Destroy { component } if there => _ = system.adopt(&[*component], &Snapshot::default()),
        _ if there => step::effect(step, system),
        _ => {}
    }
    there
}

/// Whether there is in `system` what a step begins with. That it may be done now is nothing to ask.
fn leads_on(step: &Step, system: &System) -> bool {
    let member = |of: MemberRef| {
        let node = system.component(of.component);
        node.is_some_and(|node| node.property(of.member).is_some() || node.port(of.member).is_some())
    };
    let connected = |from: MemberRef, to: MemberRef| system.link(from, to).is_some();
    match step {
        Step::State { component, transition } => {
            system.component(*component).is_some_and(|node| node.state == transition.inverse().target())
        }
        Step::Create { component, ty, .. } => {
            system.component(*component).is_none() && system.catalogue().get(*ty).is_some()
        }
        Step::Connect { from, to, .. } => member(*from) && member(*to) && !connected(*from, *to),
        Step::Disconnect { from, to } => connected(*from, *to),
        other => match absolute(other) {
            Some(Slot::Property(of) | Slot::Port(of)) => member(of),
            _ => system.component(other.component()).is_some(),
        },
    }
}
