//! Batches that begin and end: what the stack decides is carried out, booked and answered.

use super::confirmations::Confirming;
use super::control::FrameView;
use super::engine::Engine;
use super::fast::Fared;
use super::progress::Progress;
use super::repair::Repaired;
use super::request::{Reason, Request};
use super::running::{Purpose, Running};
use crate::model::{Ask, ConfigId, EventName, RequestId, Step, Verdict};
use crate::stack::{
    About, Batch, Broken, Endings, Frame, FrameId, Gone, Group, Part, Pile, Planned, Rules, Stopped, TakenAlong, Why,
    settle, take_up,
};
use crate::time::Time;
use crate::transaction::{BrokenPart, Input, LeftBeside, Limit, PartEnd, Spec, Transaction};
use smallvec::SmallVec;
use std::sync::Arc;
use std::time::Duration;

/// What was carried out of a group.
struct Carried<'c> {
    planned: &'c Planned,
    /// Its steps, each with the part that it is of, where something is broken.
    steps: Vec<(usize, Step)>,
    /// What leads back where something safe interrupted it, and something is broken.
    back: Vec<(usize, Step)>,
    /// Parts that stand for what they should, with the numbers of their conditions.
    stood: &'c [(usize, u64)],
    /// The safe configuration that interrupted it.
    reason: Option<Reason>,
    /// The number of the first frame that could come after it began.
    since: FrameId,
    /// What differs beside it.
    beside: Option<LeftBeside>,
}

impl Engine {
    /// A batch begins.
    pub(super) fn begin(&mut self, number: u32) {
        let Some(active) = self.desk.active(number) else { return };
        let requests: SmallVec<[Request; 2]> = SmallVec::from_slice(&active.batch.requests);
        for request in &requests {
            self.owe(*request);
        }
        if let [request] = requests[..]
            && self.running.is_empty()
            && request.why == Why::Asked
            && self.handle_fast(Some(number), request) != Fared::Not
        {
            return;
        }
        self.take_up(number);
    }

    /// The rest of a batch under way is taken up.
    fn take_up(&mut self, number: u32) {
        let (mut looked, mut rested) = (false, false);
        // Once it is taken down nothing begins that had not begun: the rest is answered by that.
        while !self.taking_down {
            let Some(active) = self.desk.active(number) else { return };
            let (requests, led) = (active.batch.requests.clone(), active.led());
            // Given up together with one before it, of which it was to be taken up anew.
            if let Some(place) = active.given_up.iter().map(|given_up| given_up.place).min() {
                self.cancel_behind(number, place, requests[place]);
                continue;
            }
            let configurations = self.given.configurations.clone();
            let held = self.held_frames();
            let places = self.places_taken();
            let rules = Rules {
                configurations: &configurations,
                operator: &self.given.operator,
                context: &self.given.context,
                at: self.given.clock.now(),
                held: &held,
                places: &places,
                joined: false,
                placed: false,
                rested,
                led,
                pushes: None,
            };
            let mut group = take_up(&self.world, &requests, &rules);
            if let Some(at) = group.repairs
                && (group.hindered || !(rested || looked && group.mends.is_some()))
            {
                // What it comes to is decided on what is there, and by whether a safe configuration came meanwhile.
                if !looked && !group.hindered {
                    looked = true;
                    if self.read_broken(at) {
                        continue;
                    }
                }
                looked = false;
                let moving = std::mem::take(&mut rested);
                match self.repair_for((number, moving), at) {
                    Some(Repaired::Whole) => continue,
                    Some(Repaired::Rests) => {
                        rested = true;
                        continue;
                    }
                    None => {}
                }
                if self.desk.answered(number, 0, None).over {
                    return;
                }
                continue;
            }
            let still_broken = group.told.iter().find_map(|told| match &told.reason {
                Some(Reason::StillBroken(left)) => Some(left.clone()),
                _ => None,
            });
            if still_broken.is_some_and(|left| self.is_right_again(&left)) {
                continue;
            }
            if group.down {
                self.is_taken_up_as_down(requests[0].requester);
                self.forget(requests[0]);
                group.told.clear();
                if self.desk.answered(number, 0, None).over {
                    return;
                }
                continue;
            }
            if group.commits {
                self.is_made_permanent(requests[0].requester);
                self.world.stack.make_permanent(requests[0].requester);
                self.forget_confirmations();
                self.changed();
            }
            let Some(planned) = group.planned.take() else {
                self.book(number, group, Vec::new(), None);
                rested = false;
                if self.desk.under_way().iter().all(|active| active.number != number) {
                    return;
                }
                continue;
            };
            let serves: SmallVec<[RequestId; 2]> = group.places.iter().map(|place| requests[*place].id).collect();
            for place in &group.places {
                self.given.tells(|| Progress::Begun { request: requests[*place], steps: planned.steps.len() });
            }
            self.prepare(&planned);
            let spec = self.spec(&planned, false);
            let machine = Transaction::new(planned, spec);
            let running =
                Running::new(self.number(), machine, Purpose::Requests(number, group), serves, self.world.stack.next());
            self.running.push(running);
            return;
        }
    }

    /// How a plan is carried out: each of its parts in the time that the configuration gives itself.
    pub(super) fn spec(&self, planned: &Planned, asked_back: bool) -> Spec {
        let now = self.given.clock.now();
        let limit = |part: &Part| {
            let own = part.pushes.and_then(|id| self.given.configurations.get(&id)?.timeout);
            let popped = planned.popped.iter().filter(|frame| part.edits.pops.iter().any(|(id, _)| *id == frame.id));
            let patience = self.patience(part.pushes.into_iter().chain(popped.map(|frame| frame.configuration)));
            let until = own.map_or(Time::NEVER, |limit| now + limit);
            Limit { until, timeout: own.unwrap_or_default(), patience }
        };
        let mut limits: SmallVec<[Limit; 1]> = planned.parts.iter().map(limit).collect();
        if limits.iter().all(|limit| *limit == limits[0]) {
            limits.truncate(1);
        }
        if limits.is_empty() {
            limits.push(Limit::patient(self.given.limits.step_timeout));
        }
        Spec { limits, best_effort: false, asked_back }
    }

    /// How long one step of these configurations, or of their undoing, may take: as long as one gives itself, where that is
    /// longer than a step's own time.
    pub(super) fn patience(&self, ids: impl IntoIterator<Item = ConfigId>) -> Duration {
        let own = ids.into_iter().filter_map(|id| self.given.configurations.get(&id)?.timeout);
        own.fold(self.given.limits.step_timeout, Duration::max)
    }

    /// A transaction is over.
    pub(super) fn ended(&mut self, running: Running) {
        let Running { number: own, mut machine, purpose, asked, stood, since, .. } = running;
        self.forget_conditions(asked.iter().map(|asked| asked.number));
        if let Some(conditions) = &self.given.conditions {
            conditions.nudge();
        }
        match purpose {
            Purpose::Requests(number, group) => {
                let broken = !self.world.broken.is_empty();
                let back = if broken && machine.interrupted().is_some() { machine.undoing() } else { Vec::new() };
                let steps = if broken { machine.all_steps() } else { Vec::new() };
                let end = machine.end();
                // It is dropped when everybody has been answered: a long plan takes its time for that.
                let (reason, planned) = (machine.interrupted(), machine.planned());
                let beside = end.beside;
                self.book(
                    number,
                    group,
                    end.parts,
                    Some(Carried { planned, steps, back, stood: &stood, reason, since, beside }),
                );
                self.take_up(number);
            }
            Purpose::Safe(safe) => {
                self.safe_ended(own, *safe, machine, stood.first().map(|(_, number)| *number));
            }
            Purpose::Abandoned => self.abandoned(machine, since),
            Purpose::Own => {}
        }
    }

    /// Books what came of a group of requests and answers them, in the order of the batch.
    fn book(&mut self, number: u32, mut group: Group, parts: Vec<PartEnd>, carried: Option<Carried<'_>>) {
        let Some(active) = self.desk.active(number) else { return };
        let requests = active.batch.requests.clone();
        let busy = self.held_frames();
        let parts = self.mended(&mut group, parts, carried.as_ref().is_some_and(|carried| carried.reason.is_some()));
        let endings: Endings = parts.iter().map(PartEnd::ending).collect();
        let interrupted = carried.as_ref().and_then(|carried| carried.reason.clone());
        let stopped = match &interrupted {
            Some(_) => Stopped::Safe,
            None if parts.iter().any(was_taken_down) => Stopped::Down,
            None => Stopped::Not,
        };
        let settled = settle(&requests, &group, &endings, stopped);
        let mut confirm: Vec<(Request, FrameId)> = Vec::new();
        let mut reasons: Vec<Option<Reason>> = Vec::new();
        if let Some(Carried { planned, steps, back, stood, since, beside, .. }) = carried {
            self.taken_back(&back, &parts);
            let edits = planned.parts.iter().map(|part| &part.edits);
            let pushed = self.world.take_over(edits, &endings, &busy);
            self.went_on(&group, &steps, &parts);
            if let (Some(of), Some(left)) = (&group.mends, group.left.take()) {
                self.leave(of, left);
            }
            for (part, ended) in parts.into_iter().enumerate() {
                let request = requests[group.places[part]];
                let with = &planned.parts[part].along;
                let took = || Reason::TookAlong(with.iter().map(|along| TakenAlong::of(&along.frame)).collect());
                let popped = |frame: &&Arc<Frame>| planned.parts[part].edits.pops.iter().any(|(id, _)| *id == frame.id);
                let undid: Vec<ConfigId> = match request.ask {
                    Ask::Undo | Ask::UndoTo(_) => {
                        planned.popped.iter().filter(popped).map(|f| f.configuration).collect()
                    }
                    _ => Vec::new(),
                };
                reasons.push(match &ended {
                    PartEnd::Done if !with.is_empty() => Some(took()),
                    PartEnd::Done if !undid.is_empty() => Some(Reason::Undid(undid)),
                    _ => ended.reason(),
                });
                let stood = stood.iter().find(|(of, _)| *of == part).map(|(_, number)| *number);
                match (&ended, planned.parts[part].pushes) {
                    (PartEnd::Done, Some(id)) => self.applied(id, stood),
                    (PartEnd::Done, None) => {}
                    _ => self.forget_conditions(stood),
                }
                confirm.extend(pushed[part].map(|frame| (request, frame)));
                if let PartEnd::Broken(broken) = ended {
                    self.left_broken(&request, *broken, since);
                }
            }
            self.left_beside(beside);
        }
        self.world.keep(&requests, &settled);
        self.forget_confirmations();
        self.changed();
        for (request, frame) in confirm {
            self.await_confirmation(request, frame);
        }
        let gone = self.desk.all_answered(number, settled.answers.iter().map(|(place, verdict, _)| (*place, *verdict)));
        for ((place, verdict, about), gone) in settled.answers.into_iter().zip(gone) {
            let request = requests[place];
            let reason = match about {
                About::Part(part) => reasons[part].clone(),
                About::Told(at) => group.told[at].reason.clone(),
                About::Interrupted => interrupted.clone(),
                About::Commit => None,
            };
            self.finish(request, verdict, reason.clone());
            self.answer_undos(gone, reason.as_ref());
        }
    }

    /// Answers a request, or tells what came of what nobody asked for.
    fn finish(&mut self, request: Request, verdict: Option<Verdict>, reason: Option<Reason>) {
        match (request.why, verdict) {
            (_, None) | (Why::Down, _) => self.forget(request),
            (Why::Unconfirmed(_), Some(verdict)) => {
                let begun = self
                    .current
                    .iter()
                    .find(|(r, _)| *r == request)
                    .map_or(self.given.clock.now(), |(_, begun)| *begun);
                self.forget(request);
                // It carries the number of the request that had pushed the frame.
                let (told, verdict) = request.as_told(verdict);
                let confirm = match told.ask {
                    Ask::Apply(id) => self.given.configurations.get(&id).and_then(|c| c.confirm),
                    _ => None,
                };
                let late = confirm.filter(|_| verdict == Verdict::Reverted);
                let reason = late.map(|confirm| Reason::NotConfirmed(confirm.event, confirm.within)).or(reason);
                self.tell_answer(told, verdict, reason.map(Arc::new), begun);
            }
            (Why::Asked, Some(verdict)) => self.answer(request, verdict, reason),
        }
    }

    /// What is left of a request that ended *broken*: its partial frame, and what is not known.
    pub(super) fn left_broken(&mut self, request: &Request, broken: BrokenPart, since: FrameId) {
        let BrokenPart { residual, frame, instead, mut expected, guests, gone, also } = broken;
        self.leave_out_coming(&mut expected);
        // What was to be undone with it has each its own.
        self.world.stack.apply([&gone], &[]);
        for frame in also {
            self.partials.push((frame.id, residual.clone()));
            self.world.stack.replace(frame);
        }
        let frame = match (frame, instead) {
            (Some(frame), Some(of)) => {
                self.world.stack.replace(Frame { id: of, ..frame });
                Some(of)
            }
            (Some(frame), None) => Some(self.push_partial(frame, since)),
            (None, of) => of,
        };
        self.partials.extend(frame.map(|frame| (frame, residual.clone())));
        // What was to be repaired and stays as it was is there already.
        let known = self.world.broken.iter().any(|broken| Arc::ptr_eq(&broken.residual, &residual));
        if !residual.is_settled() && !known {
            let components = residual.components().collect();
            let culprit = match request.ask {
                Ask::Apply(id) | Ask::UndoOf(id) => Some((id, request.requester)),
                _ => None,
            };
            let of_nobody = Broken::of_nobody(residual, components, expected);
            let broken = Broken { culprit, frame, mendable: true, guests, ..of_nobody };
            self.world.ends_broken(broken);
        }
        self.changed();
    }

    /// A partial frame lies below those of the safe configurations that interrupted what it is left of.
    fn push_partial(&mut self, frame: Frame, since: FrameId) -> FrameId {
        let held = self.held_frames();
        self.world.stack.push_below_safe(frame, since, &held)
    }

    /// Frames that those under way pop or hand over to, and those that wait for their confirmation.
    pub(super) fn held_frames(&self) -> Vec<FrameId> {
        let under_way = self.running.iter().flat_map(|running| crate::stack::held(running.machine.planned()));
        under_way.chain(self.confirmations.frames()).collect()
    }

    /// Who asked for the pushes under way: each has its place on the stack since it began.
    fn places_taken(&self) -> SmallVec<[Pile; 2]> {
        let pushes = self.running.iter().filter(|running| !running.over);
        pushes.flat_map(|running| crate::stack::places(running.machine.planned())).collect()
    }

    /// Frames that undos under way are about, also those of which it is known that they stay.
    pub(super) fn frames_left(&self) -> Vec<FrameId> {
        let groups = self.running.iter().filter_map(|running| match &running.purpose {
            Purpose::Requests(_, group) => Some(group),
            _ => None,
        });
        let stay = groups.flat_map(|group| group.stay.iter().map(|(_, frame)| *frame));
        self.held_frames().into_iter().chain(stay).collect()
    }

    /// What is under way is given up by its own undo.
    pub(super) fn give_up_request(&mut self, number: u32, undo: Request) {
        let of_batch = |running: &&mut Running| matches!(&running.purpose, Purpose::Requests(of, _) if *of == number);
        let Some(place) = self.desk.give_up(number, undo) else {
            return self.answer(undo, Verdict::Undone, None);
        };
        let running = self.running.iter_mut().find(of_batch);
        let part = running.as_ref().and_then(|running| match &running.purpose {
            Purpose::Requests(_, group) => group.places.iter().position(|p| *p == place),
            _ => None,
        });
        match (running, part) {
            (Some(running), Some(part)) => running.machine.on(Input::GiveUp { part }, &mut self.world.system),
            // It stands behind in its batch and has not begun.
            _ => {
                let request = self.desk.active(number).map(|active| active.batch.requests[place]);
                request.into_iter().for_each(|request| self.cancel_behind(number, place, request));
            }
        }
    }

    /// A request of a batch under way is given up before it began.
    fn cancel_behind(&mut self, number: u32, place: usize, request: Request) {
        let gone = self.desk.answered(number, place, Some(Verdict::Cancelled));
        self.shift_places(number, place);
        self.answer(request, Verdict::Cancelled, Some(Reason::Overtaken));
        self.answer_undos(gone, None);
    }

    /// A request was taken out of a batch under way: those behind it have moved up.
    fn shift_places(&mut self, number: u32, gone: usize) {
        for running in &mut self.running {
            if let Purpose::Requests(of, group) = &mut running.purpose
                && *of == number
            {
                group.takes -= usize::from(gone < group.takes);
                group.told.retain(|told| told.place != gone);
                group.stay.retain(|(place, _)| *place != gone);
                group.stay.iter_mut().filter(|(place, _)| *place > gone).for_each(|(place, _)| *place -= 1);
                group.places.iter_mut().filter(|place| **place > gone).for_each(|place| *place -= 1);
                group.told.iter_mut().filter(|told| told.place > gone).for_each(|told| told.place -= 1);
            }
        }
    }

    /// Answers the undos that had given up what is answered; those that came too late are owed again when they begin.
    pub(super) fn answer_undos(&mut self, gone: Gone, reason: Option<&Reason>) {
        for (undo, verdict) in gone.undone {
            let reason = reason.cloned().filter(|_| verdict == Verdict::UndoBroken);
            if verdict == Verdict::UndoBroken {
                // What is left of it.
                let held = self.held_frames();
                self.world.stays(&undo, &held);
            }
            self.answer(undo, verdict, reason);
        }
        for undo in gone.late {
            self.forget(undo);
            self.counts.requests.fetch_add(1, std::sync::atomic::Ordering::AcqRel);
        }
    }

    /// An event came that confirms what waits for it, and what has been asked for and is not answered yet.
    pub(super) fn confirmed(&mut self, event: EventName) {
        let configurations = &self.given.configurations;
        let asked = self.desk.requests().filter(|request| match request.ask {
            Ask::Apply(id) => {
                configurations.get(&id).and_then(|c| c.confirm).is_some_and(|confirm| confirm.event == event)
            }
            _ => false,
        });
        self.confirmations.came(event, asked.map(|request| request.id));
    }

    /// A frame waits for its confirmation, unless that has come already.
    pub(super) fn await_confirmation(&mut self, request: Request, frame: FrameId) {
        let Ask::Apply(id) = request.ask else { return };
        let Some(confirm) = self.given.configurations.get(&id).and_then(|c| c.confirm) else { return };
        self.confirmations.wait_for(confirm, request, frame, self.given.clock.now());
    }

    pub(super) fn forget_confirmations(&mut self) {
        self.confirmations.keep_those_of(&self.world.stack);
    }

    /// Frames whose confirmation did not come in time are to be taken back. True: there were some.
    pub(super) fn revert_unconfirmed(&mut self) -> bool {
        let now = self.given.clock.now();
        let mut some = false;
        while let Some(Confirming { request, frame, .. }) = self.confirmations.take_late(now) {
            let Ask::Apply(id) = request.ask else { continue };
            let revert = Request { ask: Ask::UndoOf(id), scope: None, why: Why::Unconfirmed(frame), ..request };
            let _ = self.desk.arrive(Batch::one(revert), |_| false, &self.given.claims);
            some = true;
        }
        some
    }

    /// The frames as they are shown, oldest first.
    pub(super) fn frame_views(&self) -> Vec<FrameView> {
        let view = |frame: &Arc<Frame>| FrameView {
            configuration: frame.configuration,
            by: frame.requester,
            at: frame.at,
            floor: frame.floor.is_some(),
            parts: frame.parts.len().max(1),
            partial: frame.partial,
            lost: self.is_lost(frame.configuration),
            unseen: self.is_unseen(frame.configuration),
            since_stopping: self.came_since(frame),
        };
        self.world.stack.frames().iter().map(view).collect()
    }
}

/// Whether a part ended since everything is taken down.
fn was_taken_down(part: &PartEnd) -> bool {
    let reason = match part {
        PartEnd::Failed(reason) => reason,
        PartEnd::Broken(broken) => &broken.residual.cause,
        _ => return false,
    };
    matches!(reason, Reason::TakenDown)
}
