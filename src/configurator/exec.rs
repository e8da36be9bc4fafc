//! Carrying out steps: immediate ones in this thread, blocking ones on workers, independent ones side by side; every
//! outcome settled before it is believed.

use super::engine::Engine;
use super::flights::Flight;
use super::pool::{self, Call, Reply};
use super::progress::{Progress, StepEnd, StepName};
use super::request::Reason;
use super::work::{Item, Order};
use crate::limits;
use crate::model::{ComponentName, Finding, RunState, Step};
use crate::platform::{Cause, Execution, Outcome};
use crate::system::{View as _, Violation, step};
use crate::time::Time;
use smallvec::SmallVec;
use std::time::Duration;

/// How a carrying out stands.
pub(super) struct Run {
    /// It takes something back: failures do not stop it.
    pub undoing: bool,
    /// It belongs to a safe configuration.
    pub safe: bool,
    /// It gives way to safe configurations.
    pub gives_way: bool,
    /// No step's deadline is later.
    pub until: Time,
    /// Items that were done, in the order they were.
    pub done: Vec<u32>,
    /// Items that are over, done or not.
    pub over: Vec<bool>,
    pub failures: Vec<(u32, Reason)>,
    /// Components that steps of this made faulted, with the state they were in.
    pub faulted: Vec<(ComponentName, RunState)>,
    /// Items of which nobody knows.
    pub unsettled: Vec<u32>,
    /// Any outcome was unknown at first.
    pub doubted: bool,
    pub flights: Vec<Flight>,
    /// Unknown outcomes that wait to be settled.
    unread: Vec<(u32, Cause)>,
}

/// How a carrying out came to an end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// Every item is over.
    All,
    /// An item failed; nothing is out any more.
    Failed,
    /// It gave way; calls may be out.
    GaveWay,
}

impl Run {
    pub fn new(work: &[Item], undoing: bool, gives_way: bool, until: Time) -> Self {
        Self {
            undoing,
            safe: false,
            gives_way,
            until,
            done: Vec::with_capacity(work.len()),
            over: vec![false; work.len()],
            failures: Vec::new(),
            faulted: Vec::new(),
            unsettled: Vec::new(),
            doubted: false,
            flights: Vec::new(),
            unread: Vec::new(),
        }
    }

    fn stops(&self) -> bool {
        !(self.undoing || self.failures.is_empty() && self.unsettled.is_empty())
    }
}

impl Engine {
    /// Carries out what of `work` is not over.
    pub(super) fn carry_out(&mut self, work: &[Item], run: &mut Run) -> End {
        if !self.settle_unread(work, run) {
            return End::GaveWay;
        }
        if run.stops() {
            return End::Failed;
        }
        // As long as no step is blocking the list's own order serves, and nothing needs to be counted.
        let mut at = 0;
        let mut now = self.clock.now();
        while at < work.len() {
            if run.over[at] {
                at += 1;
                continue;
            }
            if self.gives_way(run) {
                return End::GaveWay;
            }
            match self.platform.execution(&work[at].step) {
                Execution::Immediate => {
                    self.inline(work, at as u32, run, &mut now);
                    at += 1;
                    if at % 64 == 0 {
                        self.glance();
                    }
                }
                // Those that were not begun are met again.
                Execution::Brief => {
                    if !self.brief_from(work, at, run) {
                        return End::GaveWay;
                    }
                    now = self.clock.now();
                }
                Execution::Blocking => return self.side_by_side(work, run, at),
            }
            if !run.unread.is_empty() {
                if !self.settle_unread(work, run) {
                    return End::GaveWay;
                }
                now = self.clock.now();
            }
            if run.stops() {
                return End::Failed;
            }
        }
        End::All
    }

    /// Carries out `items[from..]` with blocking steps among them.
    fn side_by_side(&mut self, work: &[Item], run: &mut Run, from: usize) -> End {
        let platform = self.platform.clone();
        let execution = |step: &Step| platform.execution(step);
        let mut order = Order::new(work, from, &execution);
        loop {
            if self.gives_way(run) {
                return End::GaveWay;
            }
            if run.stops() {
                return if self.collect(work, run) { End::Failed } else { End::GaveWay };
            }
            if let Some(i) = order.next(Execution::Immediate) {
                self.inline(work, i, run, &mut self.clock.now());
                if !run.unread.is_empty() && !self.settle_unread(work, run) {
                    return End::GaveWay;
                }
                order.ended(i);
                continue;
            }
            if self.pool.has_room() {
                let mut ready = SmallVec::<[u32; 1]>::new();
                if let Some(i) = order.next(Execution::Blocking) {
                    ready.push(i);
                } else {
                    let brief = std::iter::from_fn(|| order.next(Execution::Brief));
                    ready.extend(brief.take(limits::BRIEF_STEPS));
                }
                ready.retain(|i| {
                    let forbidden = self.forbidden(&work[*i as usize].step, run, self.clock.now());
                    let Some(reason) = forbidden else { return true };
                    run.over[*i as usize] = true;
                    run.failures.push((*i, reason));
                    order.ended(*i);
                    false
                });
                if !ready.is_empty() {
                    self.launch(work, ready, run);
                    continue;
                }
            }
            if run.flights.is_empty() {
                return if order.is_over() { End::All } else { End::Failed };
            }
            self.await_flight(run);
            let landed = self.landed(work, run);
            for (i, outcome) in &landed {
                match outcome {
                    Some(outcome) => self.conclude(work, *i, outcome.clone(), run),
                    None => order.again(*i),
                }
            }
            if !self.settle_unread(work, run) {
                return End::GaveWay;
            }
            landed.iter().filter(|(_, outcome)| outcome.is_some()).for_each(|(i, _)| order.ended(*i));
        }
    }

    /// Waits for the calls that are out and settles what is unknown. False: it gave way.
    pub(super) fn collect(&mut self, work: &[Item], run: &mut Run) -> bool {
        loop {
            if !self.settle_unread(work, run) {
                return false;
            }
            if run.flights.is_empty() {
                return true;
            }
            if self.gives_way(run) {
                return false;
            }
            self.await_flight(run);
            for (i, outcome) in self.landed(work, run) {
                if let Some(outcome) = outcome {
                    self.conclude(work, i, outcome, run);
                }
            }
        }
    }

    /// Why `step` must not be given to the platform now, if so: its precondition on the live model, and the time.
    pub(super) fn forbidden(&mut self, step: &Step, run: &Run, now: Time) -> Option<Reason> {
        if now >= run.until {
            return Some(Reason::Timeout(self.allowed));
        }
        self.false_precondition(step)
    }

    fn false_precondition(&self, step: &Step) -> Option<Reason> {
        let violations = step::precondition(step, &self.system);
        if violations.is_empty() {
            return None;
        }
        let finding = |violation: &Violation| {
            let finding = Finding::error(violation.code(), format!("`{step}`: {violation}"));
            match violation.help(&self.system) {
                Some(help) => finding.help(help),
                None => finding,
            }
        };
        Some(Reason::Refused(violations.iter().map(finding).collect()))
    }

    /// Carries out an immediate step, from `at` on, which becomes the time of its end: of steps that follow each other one
    /// begins where the one before has ended, since a look at the clock costs as much as half a step.
    fn inline(&mut self, work: &[Item], i: u32, run: &mut Run, at: &mut Time) {
        let step = &work[i as usize].step;
        let started = *at;
        if let Some(reason) = self.forbidden(step, run, started) {
            run.over[i as usize] = true;
            run.failures.push((i, reason));
            return;
        }
        self.tell_started(step);
        let deadline = (started + self.patience).min(run.until);
        let outcome = pool::execute(&*self.platform, step, deadline);
        *at = self.clock.now();
        self.tell(StepName::of(step), StepEnd::from(&outcome), Some(at.since(started)), run.undoing);
        if let Outcome::Done(_) = outcome {
            // In this thread, so nothing can have come between the look at the precondition and now.
            self.took_effect(step, i, run);
        } else {
            self.conclude(work, i, outcome, run);
        }
    }

    /// Draws the conclusion from an outcome; an unknown one waits to be settled.
    pub(super) fn conclude(&mut self, work: &[Item], i: u32, outcome: Outcome, run: &mut Run) {
        let step = &work[i as usize].step;
        match outcome {
            Outcome::Done(_) => self.happened(work, i, run),
            Outcome::NotDone(cause) => self.did_not_happen(step, i, cause, run),
            Outcome::Unknown(cause) => {
                run.doubted = true;
                run.unread.push((i, cause));
            }
        }
    }

    fn happened(&mut self, work: &[Item], i: u32, run: &mut Run) {
        let step = &work[i as usize].step;
        // While the call was out, its component may have failed by itself; then the model's precondition is gone.
        if let Some(reason) = self.false_precondition(step) {
            run.over[i as usize] = true;
            run.doubted = true;
            run.failures.push((i, reason));
            return;
        }
        self.took_effect(step, i, run);
    }

    pub(super) fn took_effect(&mut self, step: &Step, i: u32, run: &mut Run) {
        run.over[i as usize] = true;
        step::effect(step, &mut self.system);
        run.done.push(i);
    }

    fn did_not_happen(&mut self, step: &Step, i: u32, cause: Cause, run: &mut Run) {
        run.over[i as usize] = true;
        if matches!(cause, Cause::Panicked(_)) {
            self.made_faulted(step.component(), run);
        }
        run.failures.push((i, Reason::Step { step: step.clone(), cause }));
    }

    fn made_faulted(&mut self, component: ComponentName, run: &mut Run) {
        // The state before the first fault: a second one is none of that.
        if let Some(node) = self.system.component(component).filter(|node| node.state != RunState::Faulted) {
            run.faulted.push((component, node.state));
            self.system.set_state(component, RunState::Faulted);
        }
    }

    /// Settles unknown outcomes by reading the platform back. False: it gave way (and some are still unknown).
    fn settle_unread(&mut self, work: &[Item], run: &mut Run) -> bool {
        // Several are settled by one look at the whole: a platform that does not answer is asked once, not once for each.
        let several =
            run.unread.iter().filter(|(i, _)| !matches!(work[*i as usize].step, Step::Operation(_))).count() > 1;
        let mut whole = None;
        while let Some((i, cause)) = run.unread.pop() {
            let step = &work[i as usize].step;
            self.note_quarantine();
            let settled = match self.question(step) {
                Err(settled) => settled,
                Ok(call) => {
                    let asked = match &whole {
                        Some(reply) => Ok(reply),
                        None => {
                            let call = if several { Call::Observe } else { call };
                            self.ask(call, run.gives_way).map(|reply| &*whole.insert(reply))
                        }
                    };
                    match asked {
                        Err(GaveWay) => {
                            run.unread.push((i, cause));
                            return false;
                        }
                        Ok(reply) => self.judge(step, reply.as_ref(), run),
                    }
                }
            };
            match settled {
                Settled::Happened => self.happened(work, i, run),
                Settled::DidNot => self.did_not_happen(step, i, cause, run),
                Settled::Nobody => {
                    run.over[i as usize] = true;
                    run.unsettled.push(i);
                }
            }
        }
        true
    }

    /// What must be observed to know whether `step` happened; an error: what is known without.
    fn question(&self, step: &Step) -> Result<Call, Settled> {
        match step {
            Step::State { .. } | Step::Create { .. } | Step::Destroy { .. } | Step::PropertySet { .. } => {
                Ok(Call::ObserveComponent(step.component()))
            }
            Step::Connect { .. } | Step::Disconnect { .. } | Step::PortWrite { .. } => Ok(Call::Observe),
            // Nothing that can be observed tells whether it was called; what leaves nothing behind need not be known.
            Step::Operation(call) => {
                let leaves_nothing = self
                    .system
                    .component(step.component())
                    .and_then(|node| node.ty.operations.get(&call.operation.member))
                    .is_some_and(|operation| operation.effect == crate::model::Effect::None);
                Err(if leaves_nothing { Settled::DidNot } else { Settled::Nobody })
            }
        }
    }

    /// Whether `step`, which the model does not have yet, happened, from what was observed.
    fn judge(&mut self, step: &Step, reply: Option<&Reply>, run: &mut Run) -> Settled {
        let component = step.component();
        let (one, whole) = match reply {
            Some(Reply::ObservedComponent(Ok(seen))) => (seen.as_ref(), None),
            Some(Reply::Observed(Ok(seen))) => (seen.components.get(&component), Some(seen)),
            _ => return Settled::Nobody,
        };
        let is = match step {
            Step::State { transition, .. } => match one {
                Some(seen) if seen.state == transition.target() => Some(true),
                Some(seen) if seen.state == RunState::Faulted => {
                    self.made_faulted(component, run);
                    Some(false)
                }
                Some(seen) => {
                    (self.system.component(component).map(|node| node.state) == Some(seen.state)).then_some(false)
                }
                None => None,
            },
            Step::Create { ty, .. } => Some(one.is_some_and(|seen| seen.ty == *ty)),
            Step::Destroy { .. } => Some(one.is_none()),
            Step::PropertySet { property, value } => {
                one.and_then(|seen| seen.properties.get(&property.member).map(|now| now == value))
            }
            Step::Connect { from, to, policy } => whole.map(|seen| seen.connections.get(&(*from, *to)) == Some(policy)),
            Step::Disconnect { from, to } => whole.map(|seen| !seen.connections.contains_key(&(*from, *to))),
            Step::PortWrite { port, value } => whole.map(|seen| seen.ports.get(port) == value.as_ref()),
            Step::Operation(_) => None,
        };
        match is {
            Some(true) => Settled::Happened,
            Some(false) => Settled::DidNot,
            None => Settled::Nobody,
        }
    }

    /// Asks the platform something on a worker. None: no answer.
    pub(super) fn ask(&mut self, call: Call, gives_way: bool) -> Result<Option<Reply>, GaveWay> {
        let deadline = self.clock.now() + self.limits.step_timeout;
        let ticket = self.pool.start(call, deadline);
        let until = deadline + limits::PLATFORM_GRACE;
        loop {
            if let Some(reply) = self.take_reply(ticket) {
                return Ok(Some(reply));
            }
            if gives_way && self.urgent() {
                self.give_up(ticket);
                return Err(GaveWay);
            }
            if self.clock.now() >= until {
                self.give_up(ticket);
                return Ok(None);
            }
            self.pump(until);
        }
    }

    pub(super) fn tell_started(&self, step: &Step) {
        if let Some(progress) = &self.progress {
            progress(&Progress::Started(StepName::of(step)));
        }
    }

    pub(super) fn tell(&self, step: StepName, end: StepEnd, took: Option<Duration>, undoing: bool) {
        if let Some(progress) = &self.progress {
            progress(&Progress::Ended { step, end, took, undoing });
        }
    }
}

enum Settled {
    Happened,
    DidNot,
    Nobody,
}

/// Something urgent came while an answer was waited for.
pub(super) struct GaveWay;
