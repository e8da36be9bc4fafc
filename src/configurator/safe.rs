//! Safe configurations: applied at once and best effort, whatever is under way and also when something is broken.
//!
//! The frame it leaves is planned on the picture without what was interrupted: so it undoes to where the stack was before
//! both, and what is rolled back around it does not matter to it.

use super::engine::Engine;
use super::request::{Reason, Request};
use super::running::{Purpose, Running};
use super::safety::{Troubled, coming};
use crate::model::{Ask, ConfigId, Configuration, RequestId, Snapshot, Step, Target, Verdict};
use crate::stack::{
    BestEffort, Frame, Planned, Residual, SafeEnd, Stack, beside_what_is_interrupted, components, effort,
};
use crate::system::touch::{Slot, slot};
use crate::system::{System, is_so, step, touch};
use crate::transaction::{BrokenPart, Input, OpenStep, PartEnd, Spec, Touched, Transaction};
use smallvec::SmallVec;
use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;

impl Engine {
    /// Begins the safe configurations that were asked for. True: there were some.
    pub(super) fn serve_safe(&mut self) -> bool {
        if self.safety.waiting.is_empty() && self.counts.safe.load(std::sync::atomic::Ordering::Acquire) == 0 {
            return false;
        }
        self.glance();
        let mut some = false;
        while let Some(request) = self.safety.waiting.pop_front() {
            self.owe(request);
            self.begin_safe(request);
            some = true;
        }
        if !some && self.counts.safe.load(std::sync::atomic::Ordering::Acquire) > 0 {
            // It was announced and is on its way.
            self.pump(self.given.clock.now() + Duration::from_millis(1));
        }
        some
    }

    /// A safe configuration begins: what is under way is interrupted, and told so.
    fn begin_safe(&mut self, request: Request) {
        let Ask::Apply(id) = request.ask else { return };
        let configurations = self.given.configurations.clone();
        let Some(configuration) = configurations.get(&id) else { return };
        let before = self.interrupt(id);
        self.emergency_begins(id, before.as_ref());
        let at = self.given.clock.now();
        // What earlier safe ones will have done counts as done; but what both write only this one does.
        let was = self.earlier_safe(&request);
        let (mut earlier, comes_after) = (was.steps(), was.numbers.clone());
        let whole = self.stack_with_earlier();
        let (stack, begun) = self.begun_to_be_taken_back(&whole);
        let plan_on = |what: &Configuration, system: &System, stack: &Stack, earlier: &[Step]| {
            effort(&with(system, earlier), stack, what, &request, at, &self.given.context)
        };
        // The frame as it would be if what is interrupted had never been, and what is broken were as others had left it.
        let before = self.world.as_left_by_safe(before);
        let own =
            |earlier: &[Step]| before.as_ref().map(|before| plan_on(configuration, before, &whole, earlier).frame);
        let now = &self.world.system;
        let then = with(now, &earlier);
        let beside = |(own, before)| beside_what_is_interrupted(configuration, &own, &stack, (now, &then, before));
        let rest = own(&earlier).zip(before.as_ref()).map(beside);
        let rest = rest.as_deref().unwrap_or(configuration);
        let plan = |system: &System, earlier: &[Step]| plan_on(rest, system, &stack, earlier);
        let BestEffort { mut planned, mut frame, troubles } = plan(&self.world.system, &earlier);
        // What is on its way to the platform may have come there or not: what this one wants is written either way.
        let mut out = self.values_out();
        out.extend(was.unknown.iter().cloned());
        let mut here = with(&self.world.system, &out);
        if !out.is_empty() {
            let there = plan(&here, &earlier).planned;
            let writes = |planned: &Planned, of: Slot| planned.steps.iter().any(|planned| slot(&planned.step) == of);
            out.retain(|step| writes(&there, slot(step)) && !writes(&planned, slot(step)));
            here = with(&self.world.system, &out);
            planned = plan(&here, &earlier).planned;
        }
        let mut yields = false;
        for other in self.running.iter_mut().filter(|other| comes_after.contains(&other.number)) {
            // Its own frame tells what it wanted, whoever does it.
            yields |= other.machine.yield_to(planned.steps.iter().map(|planned| &planned.step));
        }
        if yields {
            let left = self.earlier_safe(&request);
            planned = plan(&here, &left.steps()).planned;
            // What it does in the place of one that it takes over its own frame tells, since nothing of that one may be left.
            earlier = was.but_for_what_is_taken(&left);
            let gone: Vec<Slot> =
                was.counted.iter().filter(|one| !left.counted.contains(one)).map(|one| slot(&one.0)).collect();
            for other in &mut self.running {
                if let Purpose::Safe(safe) = &mut other.purpose {
                    // Those between found it written so, as they were planned: it never was, and there is nothing that they would give back.
                    safe.1.saved.retain(|saved| saved.step || !gone.contains(&saved.slot));
                }
            }
        }
        if yields || !was.underlies.is_empty() {
            earlier.extend(was.underlies.iter().cloned());
            frame = plan(&self.world.system, &earlier).frame;
        }
        let mut touched = Touched::default();
        planned.steps.iter().for_each(|planned| touched.add(&planned.step));
        let frame = own(&earlier).unwrap_or(frame);
        frame.steps().iter().for_each(|planned| touched.add(&planned.step));
        for entry in configuration.pre.iter().chain(configuration.post.iter()) {
            if let Target::Component(component) = entry.target {
                touched.add_state(component, entry.state);
            }
        }
        for rest in taken_back(&planned) {
            let whole = begun.iter().find(|whole| whole.id == rest.id);
            touched.takes_place_of(whole.unwrap_or(rest));
            // What was being taken back stays so: the way back of who was doing that leaves it.
            whole.into_iter().for_each(|_| self.world.stack.replace((**rest).clone()));
        }
        touched.leaves(&frame);
        touched.planned_at(self.world.system.revision());
        // What could not be planned is not done, whatever the frame tells.
        let (done, system) = (&planned.steps, &self.world.system);
        let is_refused = |step: &Step| {
            !done.iter().any(|planned| planned.step == *step) && !earlier.contains(step) && !is_so(step, system)
        };
        let frame_steps = frame.steps().iter().map(|planned| &planned.step).filter(|_| !troubles.is_empty());
        let missed = frame_steps.filter(|step| is_refused(step)).cloned().collect();
        self.safety.troubles.push(Troubled { request: request.id, reasons: troubles, missed });
        let spec = Spec { asked_back: false, ..self.effort([configuration.id]) };
        let purpose = Purpose::Safe(Box::new((request, frame, touched)));
        let machine = Transaction::new(planned, spec);
        let running =
            Running::new(self.number(), machine, purpose, SmallVec::from_iter([request.id]), self.world.stack.next());
        self.running.insert(0, Running { after: comes_after, ..running });
        self.review_standings();
        // Now, not after what else waits to go on.
        self.advance(0);
    }

    /// What safe configurations under way have still to do about what this one is about.
    fn earlier_safe(&self, request: &Request) -> Earlier {
        let about = self.given.claims.of([request]);
        let mut earlier = Earlier::default();
        for other in self.running.iter().rev().filter(|other| other.is_safe()) {
            let Purpose::Safe(safe) = &other.purpose else { continue };
            if self.given.claims.of([&safe.0]).meets(&about) {
                let replaces = |one, other| self.given.claims.replaces(one, other);
                let anew =
                    matches!((request.ask, safe.0.ask), (Ask::Apply(one), Ask::Apply(other)) if replaces(one, other));
                for open in other.machine.still_to_do() {
                    // What it only takes back of others is so for whoever comes, whoever does it.
                    let own = anew && brings_about(&safe.1, &open.step);
                    if !(own && open.begun) {
                        earlier.counted.push((open.step, own));
                        continue;
                    }
                    if matches!(open.step, Step::State { .. }) && !does(&safe.1, &open.step) {
                        earlier.underlies.push(open.step.clone());
                    }
                    earlier.unknown.push(open.step);
                }
                earlier.numbers.push(other.number);
            }
        }
        earlier
    }

    /// A safe configuration that is not there yet is let go of, and the undo is not carried out. False: none is coming.
    pub(super) fn leaves_coming(&mut self, undo: &Request) -> bool {
        let applied = self.running.iter_mut().rev().filter_map(|running| match &mut running.purpose {
            Purpose::Safe(safe) => Some(&mut safe.0),
            _ => None,
        });
        // Those under way came before those that wait.
        let coming = applied.chain(self.safety.waiting.iter_mut());
        let Some(left) = undo.leaves(self.given.claims.newest_is_meant(undo), coming).map(|left| left.id) else {
            return false;
        };
        let of_it = |safe: &(Request, Frame, Touched)| safe.0.id == left;
        for running in &mut self.running {
            if let Purpose::Safe(safe) = &mut running.purpose
                && of_it(safe)
            {
                (safe.1.scope, safe.1.left) = (None, true);
            }
        }
        true
    }

    /// Values on their way to the platform, of steps that were interrupted.
    fn values_out(&self) -> Vec<Step> {
        let interrupted = self.running.iter().filter(|running| running.is_interrupted());
        interrupted.flat_map(|running| running.machine.values_out()).cloned().collect()
    }

    /// The stack as those leave it that are being applied: it takes the places of those of its group, past what the others have given.
    fn stack_with_earlier(&self) -> Stack {
        let mut stack = self.world.stack.clone();
        for other in self.running.iter().rev() {
            let Purpose::Safe(safe) = &other.purpose else { continue };
            let edits = self.safety.settled(other.machine.planned().parts[0].edits.clone());
            stack = stack.expecting(edits, safe.1.clone(), coming(other.number));
        }
        stack
    }

    /// What has ended *broken* is not expected with what safe configurations have done that are still being applied: their frames come.
    pub(super) fn leave_out_coming(&self, expected: &mut Snapshot) {
        for other in &self.running {
            if let Purpose::Safe(safe) = &other.purpose {
                safe.1.leaves_out(&other.machine.done_steps().collect::<Vec<_>>(), expected);
            }
        }
    }

    /// The steps of safe configurations that came before which are not over.
    pub(super) fn busy_before(&self, running: &Running) -> Vec<OpenStep> {
        if running.after.is_empty() {
            return Vec::new();
        }
        let before = self.running.iter().filter(|other| running.after.contains(&other.number));
        before.flat_map(|other| other.machine.still_to_do()).collect()
    }

    /// The stack in which frames that what is interrupted had begun to take back have what is left of that to be done, and what these were.
    fn begun_to_be_taken_back(&self, whole: &Stack) -> (Stack, Vec<Arc<Frame>>) {
        let (mut stack, mut begun) = (whole.clone(), Vec::new());
        for running in self.running.iter().filter(|running| running.is_interrupted()) {
            let mut done: Vec<&Step> = running.machine.done_so_far().map(|(planned, _)| &planned.step).collect();
            for popped in running.machine.planned().popped.iter().filter(|popped| !popped.safe) {
                let Some(whole) = stack.frame(popped.id).cloned() else { continue };
                if let Some(rest) = whole.but_for(&mut done) {
                    stack.replace(rest);
                    begun.push(whole);
                }
            }
        }
        (stack, begun)
    }

    /// Whether a safe configuration interrupts what is under way here: what claims something of its (sub)system, and whatever
    /// nobody asked for.
    fn is_reached(&self, id: ConfigId, running: &Running) -> bool {
        let requests = match &running.purpose {
            Purpose::Requests(number, _) => self.desk.active(*number).map(|active| &active.batch.requests),
            Purpose::Safe(_) | Purpose::Own | Purpose::Abandoned => None,
        };
        requests.is_none_or(|requests| self.given.claims.interrupts(id, requests))
    }

    /// Interrupts what is under way in the (sub)system of a safe configuration; the picture without it, if it has done anything.
    fn interrupt(&mut self, id: ConfigId) -> Option<System> {
        for at in 0..self.running.len() {
            let running = &self.running[at];
            if !running.is_safe() && !running.over && self.is_reached(id, running) {
                self.running[at].machine.on(Input::Interrupt(id), &mut self.world.system);
                // Calls that are out are told first, and what is back is taken in.
                self.running[at].stop_batches(&*self.given.platform);
                self.advance(at);
            }
        }
        // Safe configurations that came before, and are not over or not told to what was interrupted yet.
        let mut touched = self.safety.touched.clone();
        for other in self.running.iter().rev().filter(|other| other.is_safe()) {
            if let Purpose::Safe(safe) = &other.purpose {
                // What it has not written yet, for all that is known, is there as what is interrupted has left it.
                let (mut theirs, open): (_, Vec<OpenStep>) = (safe.2.clone(), other.machine.still_to_do().collect());
                other.machine.note_done(&mut theirs);
                theirs.missed(open.iter().map(|open| &open.step));
                touched.join(theirs);
            }
        }
        let mut before: Option<System> = None;
        for running in self.running.iter().filter(|r| r.is_interrupted() && r.machine.did_anything()) {
            running.machine.take_out(before.get_or_insert_with(|| self.world.system.clone()), &touched);
        }
        before
    }

    /// A safe configuration has been applied as far as it goes: its frame is pushed, it is answered, and what it interrupted
    /// goes back.
    pub(super) fn safe_ended(
        &mut self,
        number: u64,
        safe: (Request, Frame, Touched),
        mut machine: Transaction,
        stood: Option<u64>,
    ) {
        let (request, frame, mut touched) = safe;
        // Who asks for the same once more does not trust what it came to.
        if self.world.stack.frames().iter().any(|other| other.configuration == frame.configuration) {
            self.observing.at_once(self.given.clock.now());
        }
        machine.note_done(&mut touched);
        let given = taken_back(machine.planned()).flat_map(|frame| &frame.saved).map(|saved| saved.slot);
        let given: Vec<_> = given.collect();
        let failed = machine.failed_steps().map(|planned| &planned.step);
        touched.missed(failed.filter(|step| !given.contains(&slot(step))));
        // Also if it comes no further: what was interrupted heeds it. Calls are kept by its frame alone.
        self.safety.touched.join(touched.without_calls());
        let mut missed: Vec<Step> = machine.missed().cloned().collect();
        let done: Vec<Step> = machine.done_steps().cloned().collect();
        let edits = self.safety.settled(machine.planned().parts[0].edits.clone());
        let end = machine.end();
        let (mut troubles, missed_before) = self.safety.troubles_of(request.id);
        missed.extend(missed_before);
        let mut broken = None;
        if let Some(PartEnd::Broken(part)) = end.parts.into_iter().next() {
            broken = Some(part);
        }
        // Planned as if that had never been.
        let interrupted = !self.world.broken.is_empty() || self.running.iter().any(Running::is_interrupted);
        let held = self.held_frames();
        let failed = broken.as_ref().map(|part| part.frame.as_ref());
        let left_out = !troubles.is_empty();
        let how = SafeEnd { failed, missed: &missed, left_out, done: &done, interrupts: interrupted };
        let (pushed, verdict) = self.world.settle_safe(edits, frame, &how, &held);
        if broken.is_none() {
            self.safety.pushed.push((number, pushed));
        }
        // What failed of it is nothing that it keeps.
        self.world.stack.frame(pushed).into_iter().for_each(|frame| touched.leaves(frame));
        if let Some(part) = &broken {
            // Those that came later took what this one was to do about the same components for done.
            let about = |other: &&Running| match &other.purpose {
                Purpose::Safe(safe) => {
                    let own = components(&safe.1.footprint);
                    missed.iter().flat_map(touch::components).any(|component| own.contains(&component))
                }
                _ => false,
            };
            // But for what these do themselves, or others between them.
            let does = |other: &Running, step: &Step| {
                let between = |one: &&Running| other.after.contains(&one.number) && one.after.contains(&number);
                let mut doing = std::iter::once(other).chain(self.running.iter().filter(between));
                doing.any(|one| one.machine.all_steps().iter().any(|(_, own)| own == step))
            };
            let later = self.running.iter().filter(|other| other.after.contains(&number)).filter(about);
            let mut left: Vec<(RequestId, Vec<Step>)> = Vec::new();
            for other in later {
                let steps: Vec<Step> = missed.iter().filter(|step| !does(other, step)).cloned().collect();
                if !steps.is_empty() {
                    left.extend(other.serves.iter().map(|request| (*request, steps.clone())));
                }
            }
            for troubled in &mut self.safety.troubles {
                let Some((_, steps)) = left.iter().find(|(request, _)| *request == troubled.request) else { continue };
                let why = Reason::Broken(part.residual.clone());
                if !troubled.reasons.contains(&why) {
                    troubled.reasons.push(why);
                }
                troubled.missed.extend(steps.iter().cloned());
            }
        }
        let reason = match broken {
            None if troubles.is_empty() => None,
            None => {
                let cause = troubles.remove(0);
                let residual = Arc::new(Residual { also: troubles, ..Residual::of(cause) });
                self.partials.push((pushed, residual.clone()));
                Some(Reason::Broken(residual))
            }
            Some(part) => {
                let mut residual = (*part.residual).clone();
                residual.also.append(&mut troubles);
                let residual = Arc::new(residual);
                self.partials.push((pushed, residual.clone()));
                let part = BrokenPart { frame: None, instead: None, residual: residual.clone(), ..*part };
                self.left_broken(&request, part, pushed);
                if let (Some(last), false) = (self.world.broken.last_mut(), residual.is_settled()) {
                    last.frame = Some(pushed);
                }
                Some(Reason::Broken(residual))
            }
        };
        self.forget_confirmations();
        self.changed();
        match (verdict, request.ask) {
            (Verdict::Ok, Ask::Apply(id)) => {
                self.await_confirmation(request, pushed);
                self.applied(id, stood);
            }
            _ => self.forget_conditions(stood),
        }
        self.answer(request, verdict, reason);
        self.release(touched);
    }

    /// What was interrupted goes back, once no safe configuration is being applied any more.
    pub(super) fn release(&mut self, touched: Touched) {
        self.safety.touched.join(touched);
        // Also one that is over and is still to be booked.
        if self.running.iter().any(Running::is_safe) {
            return;
        }
        self.safety.pushed.clear();
        let touched = std::mem::take(&mut self.safety.touched);
        for running in self.running.iter_mut().filter(|running| running.is_interrupted()) {
            running.machine.on(Input::Release(touched.clone()), &mut self.world.system);
        }
    }
}

/// What safe configurations that are being applied have still to do about the same things.
#[derive(Default)]
struct Earlier {
    /// Counts as done; and whether it is what one wants whose place is taken, and not what that takes back of others.
    counted: Vec<(Step, bool)>,
    /// Values, run states and connections that are out, of one whose place is taken: nobody knows yet whether they come to be, and they are done once more. What
    /// that one itself takes the place of is taken back by it all the same.
    unknown: Vec<Step>,
    /// Those of them that its frame does not tell of, as it also takes others back with them: the frame goes on from there, as that one's does.
    underlies: Vec<Step>,
    /// Who.
    numbers: SmallVec<[u64; 1]>,
}

impl Earlier {
    /// What counts as done.
    fn steps(&self) -> Vec<Step> {
        self.counted.iter().map(|(step, _)| step.clone()).collect()
    }

    /// The same, without what of those whose place is taken is not among `left`.
    fn but_for_what_is_taken(&self, left: &Self) -> Vec<Step> {
        let stays = |one: &&(Step, bool)| !one.1 || left.counted.contains(one);
        self.counted.iter().filter(stays).map(|(step, _)| step.clone()).collect()
    }
}

/// The frames whose values one gives back: not what is safe itself, on top of which it is done.
fn taken_back(planned: &Planned) -> impl Iterator<Item = &Arc<Frame>> {
    planned.popped.iter().filter(|frame| !frame.safe)
}

/// Whether a frame has brought this about, and not what it takes the place of.
fn brings_about(frame: &Frame, step: &Step) -> bool {
    match step {
        Step::State { component, .. } => frame.moved(*component).is_some(),
        Step::PropertySet { .. } | Step::PortWrite { .. } => frame.saved.iter().any(|saved| saved.slot == slot(step)),
        Step::Operation(_) => false,
        _ => does(frame, step),
    }
}

/// Whether this is one of a frame's own steps.
fn does(frame: &Frame, step: &Step) -> bool {
    frame.steps().iter().any(|planned| planned.step == *step)
}

/// A system in which these steps are done.
fn with<'s>(system: &'s System, steps: &[Step]) -> Cow<'s, System> {
    let mut picture = Cow::Borrowed(system);
    for step in steps {
        let _ = step::apply(step, picture.to_mut());
    }
    picture
}
