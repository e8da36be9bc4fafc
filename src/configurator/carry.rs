//! A transaction between its machine and the platform: calls that are out, awaited and given up.

use super::engine::{Engine, Given};
use super::hands::Hands;
use super::inbox::PoolReply;
use super::pool::{CallFor, PlatformCall};
use super::progress::{Progress, StepEnd, StepName};
use super::running::{OutstandingCall, Purpose, Running};
use super::suspects::CameBack;
use crate::limits;
use crate::model::{Cause, Execution, Outcome, Snapshot, Step};
use crate::platform::{TimedOutcome, TimedStep};
use crate::time::Time;
use crate::transaction::{Can, Doing, Input, Poll};
use smallvec::SmallVec;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// After so many immediate steps the mail is looked at.
const GLANCE: usize = 64;

impl Engine {
    /// Lets a transaction go on as far as it can without waiting. True: it did something.
    pub(super) fn advance(&mut self, at: usize) -> bool {
        let mut running = self.running.remove(at);
        // Taken out, so that what it does may touch everything else; a panic on the way must not lose it.
        let before = self.steps;
        let went = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| self.go_on(&mut running)));
        running.panics += u8::from(went.is_err() && running.panics < u8::MAX);
        self.running.insert(at, running);
        match went {
            Ok(did) => did || self.steps != before,
            Err(payload) => std::panic::resume_unwind(payload),
        }
    }

    fn go_on(&mut self, running: &mut Running) -> bool {
        let mut did = self.land(running);
        let platform = self.given.platform.clone();
        let execution = |step: &Step| platform.execution(step);
        let batches = |step: &Step| platform.batches(step);
        let mut now = self.given.clock.now();
        let mut inline = 0;
        loop {
            let gives_way = !running.is_safe() && self.urgent();
            if gives_way || running.machine.begins_no_more() {
                running.stop_batches(&*platform);
            }
            if gives_way {
                // Steps that are begun one by one in this thread stop here; what is out is told by whoever is urgent.
                if inline > 0 {
                    return true;
                }
            }
            let room = self.has_room(running);
            let busy = self.busy_before(running);
            if busy.is_empty() {
                let begun = self.immediate_ones(running, &execution, &mut now);
                inline += begun;
                did |= begun > 0;
                if begun > 0 {
                    continue;
                }
            }
            let quarantined = &self.world.quarantined;
            let can = Can { execution: &execution, batches: &batches, room, quarantined, busy: &busy };
            match running.machine.poll(&mut self.world.system, now, &can) {
                Poll::Over => {
                    running.over = true;
                    return true;
                }
                Poll::Wait => return did,
                Poll::Cancel(step) => {
                    did = true;
                    self.cancel(running, step);
                }
                Poll::Read(components) => {
                    did = true;
                    let deadline = self.given.clock.now() + self.given.limits.step_timeout;
                    let ticket =
                        self.call(PlatformCall::ObserveSome(components), deadline, self.whose(running, CallFor::Look));
                    running.read = Some((ticket, deadline + limits::PLATFORM_GRACE));
                }
                Poll::Ask(question) => {
                    did = true;
                    self.ask_condition(running, question);
                }
                Poll::Begin(steps) => {
                    did = true;
                    let first = &running.machine.step(steps[0]).step;
                    if steps.len() == 1 && platform.execution(first) == Execution::Immediate {
                        let tools = (&*self.given.platform, &self.given.clock, self.given.progress.as_ref());
                        let hands = Hands::new(tools, &running.serves, running.enters_quarantine);
                        let outcome = hands.execute(running.machine.doing(steps[0], now), &mut now);
                        running.machine.ended(steps[0], outcome, &mut self.world.system);
                        self.steps += 1;
                        inline += 1;
                        if inline % GLANCE == 0 {
                            self.glance();
                        }
                    } else {
                        self.launch(running, steps);
                        now = self.given.clock.now();
                    }
                }
            }
        }
    }

    /// Carries out immediate steps, one after the other, until something else is to be done or somebody is urgent. Answers how
    /// many. Of steps that follow each other one begins where the one before has ended, since a look at the clock costs as
    /// much as half a step.
    fn immediate_ones(
        &mut self,
        running: &mut Running,
        execution: &impl Fn(&Step) -> Execution,
        now: &mut Time,
    ) -> usize {
        let mut count = 0;
        loop {
            if count > 0 && !running.is_safe() && self.urgent() {
                return count;
            }
            let gives_way = !running.is_safe();
            let counts = self.counts.clone();
            let goes_on = || !(gives_way && counts.safe.load(Ordering::Acquire) > 0);
            let tools = (&*self.given.platform, &self.given.clock, self.given.progress.as_ref());
            let hands = Hands::new(tools, &running.serves, running.enters_quarantine);
            let execute = |doing: Doing<'_>, at: &mut Time| hands.execute(doing, at);
            let did = running.machine.immediate_ones(GLANCE, &mut self.world.system, now, execution, goes_on, execute);
            self.steps += did as u64;
            count += did;
            if did < GLANCE {
                return count;
            }
            self.glance();
        }
    }

    /// Whose calls a transaction makes.
    fn whose(&self, running: &Running, plain: CallFor) -> CallFor {
        if running.is_safe() || self.taking_down { CallFor::Safe } else { plain }
    }

    /// Whether a call that takes time may begin: one worker stays free for each of the others that has none. What is safe waits
    /// for none of the others.
    fn has_room(&self, running: &Running) -> bool {
        if self.whose(running, CallFor::Plain) == CallFor::Safe {
            return self.pool.has_room_for_safe(running.outstanding.len());
        }
        let others = self.running.iter().filter(|other| other.outstanding.is_empty() && !other.over).count();
        self.pool.has_room_beside(if running.outstanding.is_empty() { 0 } else { others })
    }

    /// Hands steps to a worker. Their preconditions hold.
    fn launch(&mut self, running: &mut Running, steps: SmallVec<[u32; 1]>) {
        let timed = |i: &u32| {
            let (step, limit) = (&running.machine.step(*i).step, running.machine.limit_of(*i));
            self.tell_started(step);
            TimedStep { step: step.clone(), patience: limit.patience, until: limit.until }
        };
        let batch = self.pool.batch(steps.iter().map(timed).collect(), running.enters_quarantine);
        let call = PlatformCall::Execute(batch.clone());
        let ticket = self.call(call, batch.deadline(), self.whose(running, CallFor::Plain));
        running.outstanding.push(OutstandingCall { ticket, steps, back: 0, batch, bound: Time::NEVER });
    }

    /// A call is given up: it is told so, and is waited for no longer than a step may take.
    fn cancel(&mut self, running: &mut Running, step: u32) {
        let until = self.given.clock.now() + self.given.limits.step_timeout;
        if let Some(call) = running.outstanding.iter_mut().find(|call| call.is_of(step)) {
            call.bound = call.bound.min(until);
            call.batch.stop();
            self.given.platform.cancel(&running.machine.step(step).step);
        }
    }

    /// Takes in the calls that are back, and those given up. True: there were some.
    fn land(&mut self, running: &mut Running) -> bool {
        let mut did = self.land_truths(running);
        let now = self.given.clock.now();
        if let Some((ticket, until)) = running.read {
            let seen: Option<Option<Snapshot>> = match self.pool.take(ticket) {
                Some(PoolReply::Observed(Ok(seen))) => Some(Some(seen)),
                Some(_) => Some(None),
                None if now >= until => {
                    self.pool.give_up(ticket);
                    Some(None)
                }
                None => None,
            };
            if let Some(seen) = seen {
                running.read = None;
                self.note_quarantine();
                running.machine.on(Input::Seen(seen), &mut self.world.system);
                did = true;
            }
        }
        let mut at = 0;
        while at < running.outstanding.len() {
            let call = &mut running.outstanding[at];
            let returned = self.pool.take(call.ticket).is_some();
            let late = !returned && now >= call.deadline();
            if late {
                self.pool.give_up(call.ticket);
                call.batch.close();
            }
            let answers = call.batch.take(returned || late);
            let first = call.back;
            call.back += answers.len();
            let steps: SmallVec<[u32; 1]> = call.steps[first..call.back].iter().copied().collect();
            let stopped = call.batch.is_stopped() && call.steps.len() > 1;
            let mut not_begun = SmallVec::<[u32; 1]>::new();
            if returned || late {
                not_begun.extend_from_slice(&call.steps[call.back..]);
                running.outstanding.remove(at);
            } else {
                at += 1;
            }
            did |= !answers.is_empty() || !not_begun.is_empty() || returned || late;
            if returned || late || !steps.is_empty() {
                self.note_quarantine();
            }
            for (step, TimedOutcome { outcome, took }) in steps.into_iter().zip(answers) {
                // What was to stop, and had not begun, comes again where it is still wanted.
                if stopped && outcome == Outcome::NotDone(Cause::Cancelled) {
                    running.machine.on(Input::NotBegun(step), &mut self.world.system);
                    continue;
                }
                // Booked before anybody hears of it: whoever listens may panic.
                let end = StepEnd::from(&outcome);
                running.machine.on(Input::Ended { step, outcome }, &mut self.world.system);
                self.steps += 1;
                self.tell(running, step, end, Some(took));
            }
            for step in not_begun {
                running.machine.on(Input::NotBegun(step), &mut self.world.system);
            }
        }
        did
    }

    /// Lets everything that is under way go on, until the transaction of that number is over; it is taken off the list.
    /// Requests that come meanwhile wait, safe ones do not.
    pub(super) fn complete(&mut self, number: u64) -> Running {
        loop {
            self.serve_safe();
            self.heed_hurry();
            let did = self.advance_all();
            if let Some(at) = self.running.iter().position(|running| running.number == number && running.over) {
                return self.running.remove(at);
            }
            if !did {
                self.pump(self.running_until());
            }
        }
    }

    /// Everything that is under way goes on, safe configurations first. True: something happened.
    pub(super) fn advance_all(&mut self) -> bool {
        let mut did = false;
        self.review_standings();
        let mut order: BTreeMap<(bool, u64), ()> = BTreeMap::new();
        for running in self.running.iter().filter(|running| !running.over) {
            order.insert((!running.is_safe(), running.number), ());
        }
        for ((_, number), ()) in order {
            if let Some(at) = self.running.iter().position(|running| running.number == number && !running.over) {
                did |= self.advance(at);
            }
        }
        while let Some(number) = self.next_over() {
            let Some(at) = self.running.iter().position(|running| running.number == number) else { break };
            let running = self.running.remove(at);
            self.ended(running);
            if self.returned == CameBack::Later {
                self.returned = CameBack::Now;
            }
            did = true;
        }
        did
    }

    /// The next that is over and is answered. Of one moment: safe configurations first, then in the order in which they began.
    fn next_over(&self) -> Option<u64> {
        let waits = |running: &Running| self.running.iter().any(|other| running.after.contains(&other.number));
        let over = self.running.iter().filter(|running| running.over && !matches!(running.purpose, Purpose::Own));
        let over = over.filter(|running| !waits(running));
        over.min_by_key(|running| (!running.is_safe(), running.number)).map(|running| running.number)
    }

    /// When something that is under way must be looked at again.
    pub(super) fn running_until(&self) -> Time {
        self.running.iter().filter(|running| !running.over).map(Running::until).min().unwrap_or(Time::NEVER)
    }

    fn tell_started(&self, step: &Step) {
        self.given.tells(|| Progress::Started(StepName::of(step)));
    }

    fn tell(&self, running: &Running, number: u32, end: StepEnd, took: Option<std::time::Duration>) {
        self.given.tells(|| Progress::Ended {
            request: running.serves(number),
            step: StepName::of(&running.machine.step(number).step),
            end,
            took,
            undoing: running.machine.is_going_back(),
        });
    }
}

impl Given {
    /// Tells whoever listens; what is told is made up only where somebody does.
    pub(super) fn tells(&self, progress: impl FnOnce() -> Progress) {
        if let Some(listens) = &self.progress {
            listens(&progress());
        }
    }
}
