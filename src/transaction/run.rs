//! One list of steps being carried out: which may begin, what came of those that did, what is not known yet.

use super::limits::Limit;
use super::messages::{CallKind, Can};
use super::order::Order;
use crate::limits;
use crate::model::{Cause, ComponentName, Execution, Finding, Outcome, RunState, Step, Transition};
use crate::plan::PlannedStep;
use crate::stack::Reason;
use crate::system::{System, Undo, View as _, Violation, is_so, step};
use crate::time::Time;
use rustc_hash::FxHashSet;
use smallvec::{SmallVec, smallvec};
use std::sync::Arc;

/// How a step stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum StepState {
    Waiting,
    /// Begun at this revision of the model.
    Out(u64),
    Over,
}

/// A list of steps and how far it is.
#[derive(Debug, Default)]
pub(super) struct StepsRun {
    pub list: Arc<Vec<PlannedStep>>,
    state: Vec<StepState>,
    /// As long as steps are immediate, or make and drop components, the list's own order serves, from here on.
    at: usize,
    order: Option<Order>,
    /// The last step of the batch that began last. Answers come in order: while this one is out, so is the batch.
    batch: Option<u32>,
    /// Steps that were done, in the order they were.
    pub done: Vec<u32>,
    pub failures: Vec<(u32, Reason)>,
    /// Components that steps of this made faulted, with the state they were in.
    pub faulted: Vec<(ComponentName, RunState)>,
    /// Steps of which nobody knows.
    pub unsettled: Vec<u32>,
    /// Unknown outcomes that wait to be settled.
    pub unread: Vec<(u32, Cause)>,
    /// How many steps are out.
    pub out: usize,
    /// Failures do not stop it: a best effort.
    pub tries_all: bool,
    /// How long each step may take, or all of them.
    limits: SmallVec<[Limit; 1]>,
    /// Steps that came in after a safe configuration had begun.
    pub late: Vec<LateStep>,
    pub late_from_now: bool,
    /// Whether it is noted when steps were done, and those, with the revision of the model that they led to.
    pub notes: bool,
    pub noted: Vec<(u32, u64)>,
}

/// A step that came in after a safe configuration had begun.
#[derive(Debug)]
pub(super) struct LateStep {
    pub step: u32,
    /// What takes it back to what was there when it came in.
    pub undo: Undo,
    /// The revision of the model when it came in.
    pub revision: u64,
}

impl StepsRun {
    /// Components that it has begun to start, to stop or to destroy: its way back is about what that moves, and about nothing else.
    pub fn moved(&self) -> impl Iterator<Item = ComponentName> + '_ {
        let begun = self.list.iter().zip(&self.state).filter(|(_, state)| **state != StepState::Waiting);
        begun.filter_map(|(planned, _)| match &planned.step {
            Step::State { component, transition: Transition::Start | Transition::Stop }
            | Step::Destroy { component } => Some(*component),
            _ => None,
        })
    }

    /// With one limit for all steps, or one for each.
    pub fn new(list: Arc<Vec<PlannedStep>>, limits: SmallVec<[Limit; 1]>) -> Self {
        Self {
            state: vec![StepState::Waiting; list.len()],
            done: Vec::with_capacity(list.len()),
            list,
            limits,
            ..Self::default()
        }
    }

    /// Whose steps begin however late it is.
    pub fn untimed(list: Arc<Vec<PlannedStep>>) -> Self {
        Self::new(list, smallvec![Limit::patient(std::time::Duration::MAX)])
    }

    fn limit(&self, i: usize) -> &Limit {
        self.limits.get(i).unwrap_or(&self.limits[0])
    }

    /// Whether no further step of it begins.
    pub fn stops(&self) -> bool {
        !(self.tries_all || self.failures.is_empty() && self.unsettled.is_empty())
    }

    /// Whether every step is over.
    pub fn is_over(&self) -> bool {
        match &self.order {
            Some(order) => order.is_over(),
            None => self.at >= self.list.len() && self.out == 0,
        }
    }

    /// The steps that are not over.
    pub fn open(&self) -> impl Iterator<Item = (&PlannedStep, bool)> {
        let open = self.list.iter().zip(&self.state).filter(|(_, state)| **state != StepState::Over);
        open.map(|(step, state)| (step, *state != StepState::Waiting))
    }

    /// Leaves out what has not begun and `out` says so of. Answers whether there was such.
    pub fn leave_out(&mut self, out: impl Fn(&Step) -> bool) -> bool {
        let waiting = (0..).zip(&self.state).filter(|(_, state)| **state == StepState::Waiting).map(|(i, _)| i);
        let gone: Vec<u32> = waiting.filter(|i: &u32| out(&self.list[*i as usize].step)).collect();
        gone.iter().for_each(|i| self.finish(*i));
        !gone.is_empty()
    }

    /// The steps that are out.
    pub fn outstanding(&self) -> impl Iterator<Item = u32> + '_ {
        (0..).zip(&self.state).filter(|(_, state)| matches!(state, StepState::Out(_))).map(|(i, _)| i)
    }

    #[inline]
    fn finish(&mut self, i: u32) {
        self.state[i as usize] = StepState::Over;
        if let Some(order) = &mut self.order {
            order.ended(i);
        }
    }

    /// The next steps that begin now: an immediate one, one that is called alone, or a batch. Those that must not begin
    /// fail here. Empty: nothing can begin.
    pub fn begin(&mut self, live: &System, now: Time, can: &Can<'_>) -> SmallVec<[u32; 1]> {
        let kind = |planned: &PlannedStep| can.kind(&planned.step);
        while self.order.is_none() && self.at < self.list.len() {
            if self.stops() {
                return smallvec![];
            }
            let at = self.at;
            if self.state[at] != StepState::Waiting {
                // Of a batch that is out, or over.
                if matches!(self.state[at], StepState::Out(_)) {
                    return smallvec![];
                }
                self.at += 1;
                continue;
            }
            if is_busy(&self.list[at].step, can) {
                return smallvec![];
            }
            match kind(&self.list[at]) {
                CallKind::Immediate => {
                    if self.out > 0 {
                        return smallvec![];
                    }
                    if let Some(i) = self.immediate(live, now) {
                        return smallvec![i];
                    }
                }
                CallKind::Batched if makes_or_drops(&self.list[at].step) => {
                    if self.out > 0 || !can.room {
                        return smallvec![];
                    }
                    let begun = self.in_a_row(live, now, can);
                    if !begun.is_empty() {
                        return begun;
                    }
                }
                CallKind::Batched | CallKind::Alone => {
                    let state = &self.state;
                    self.order = Some(Order::new(&self.list, &|i| state[i] == StepState::Over, &kind));
                }
            }
        }
        if self.order.is_some() { self.side_by_side(live, now, can) } else { smallvec![] }
    }

    /// The immediate step at the present place, which is out from now on. None: it must not begin, and has failed.
    #[inline]
    fn immediate(&mut self, live: &System, now: Time) -> Option<u32> {
        let i = self.at as u32;
        if !self.gate(i, live, now) {
            return None;
        }
        self.state[self.at] = StepState::Out(live.revision());
        self.out += 1;
        Some(i)
    }

    /// What [`Self::begin`] begins where that is an immediate step in the list's own order, with nothing to be looked at
    /// before; it is out from now on.
    #[inline]
    pub fn next_immediate(&mut self, live: &System, now: Time, execution: &impl Fn(&Step) -> Execution) -> Option<u32> {
        let plain = self.order.is_none() && self.out == 0 && self.unread.is_empty();
        if !plain || self.stops() {
            return None;
        }
        while *self.state.get(self.at)? == StepState::Over {
            self.at += 1;
        }
        let immediate = execution(&self.list[self.at].step) == Execution::Immediate;
        if immediate { self.immediate(live, now) } else { None }
    }

    /// The immediate step that was begun last was done. In the same breath, so that nothing can have come between the look at
    /// its precondition and now.
    #[inline]
    pub fn was_executed(&mut self, i: u32, live: &mut System) {
        self.out -= 1;
        self.took_effect(i, live);
        self.at = i as usize + 1;
    }

    /// A batch from the present place on of steps that make or drop components, none of which may need another: each is about a
    /// component of its own.
    fn in_a_row(&mut self, live: &System, now: Time, can: &Can<'_>) -> SmallVec<[u32; 1]> {
        let mut items: SmallVec<[u32; 1]> = SmallVec::new();
        let mut about = FxHashSet::<ComponentName>::default();
        for at in self.at..self.list.len() {
            if self.state[at] != StepState::Waiting {
                continue;
            }
            let step = &self.list[at].step;
            if items.len() == limits::BATCH_STEPS
                || !makes_or_drops(step)
                || can.kind(step) != CallKind::Batched
                || !about.insert(step.component())
                || is_busy(step, can)
            {
                break;
            }
            // What is wrong with a later one is found when its turn comes.
            let allowed = now < self.limit(at).until && step::precondition(step, live).is_empty();
            if !allowed {
                if items.is_empty() {
                    self.gate(at as u32, live, now);
                    return items;
                }
                break;
            }
            items.push(at as u32);
        }
        for i in &items {
            self.state[*i as usize] = StepState::Out(live.revision());
        }
        self.out += items.len();
        items
    }

    fn side_by_side(&mut self, live: &System, now: Time, can: &Can<'_>) -> SmallVec<[u32; 1]> {
        let mut later = SmallVec::<[u32; 1]>::new();
        let begun = self.free_ones(live, now, can, &mut later);
        if let Some(order) = &mut self.order {
            later.into_iter().for_each(|i| order.again(i));
        }
        begun
    }

    /// Those that may begin; what comes after steps of others goes to `later`.
    fn free_ones(
        &mut self,
        live: &System,
        now: Time,
        can: &Can<'_>,
        later: &mut SmallVec<[u32; 1]>,
    ) -> SmallVec<[u32; 1]> {
        loop {
            if self.stops() {
                return smallvec![];
            }
            let Some(order) = &mut self.order else { return smallvec![] };
            let mut ready = SmallVec::<[u32; 1]>::new();
            let mut batched = false;
            if let Some(i) = order.next(CallKind::Immediate) {
                ready.push(i);
            } else if can.room {
                if let Some(i) = order.next(CallKind::Alone) {
                    ready.push(i);
                } else if !self.batch.is_some_and(|last| matches!(self.state[last as usize], StepState::Out(_))) {
                    // What becomes ready while a batch is out goes with the next, not alone beside it.
                    ready.extend(std::iter::from_fn(|| order.next(CallKind::Batched)).take(limits::BATCH_STEPS));
                    batched = true;
                }
            }
            if ready.is_empty() {
                return ready;
            }
            // Left out meanwhile.
            ready.retain(|i| self.state[*i as usize] == StepState::Waiting);
            if !can.busy.is_empty() {
                let (busy, free): (SmallVec<_>, SmallVec<_>) =
                    ready.into_iter().partition(|i| is_busy(&self.list[*i as usize].step, can));
                later.extend::<SmallVec<[u32; 1]>>(busy);
                ready = free;
            }
            ready.retain(|i| self.gate(*i, live, now));
            if !ready.is_empty() {
                for i in &ready {
                    self.state[*i as usize] = StepState::Out(live.revision());
                }
                self.out += ready.len();
                if batched {
                    self.batch = ready.last().copied();
                }
                return ready;
            }
        }
    }

    /// Whether a step may be given to the platform now: its precondition on the live model, and the time. If not, it has
    /// failed.
    #[inline]
    fn gate(&mut self, i: u32, live: &System, now: Time) -> bool {
        let limit = self.limit(i as usize);
        let refused = if now >= limit.until {
            Some(Reason::Timeout(limit.timeout))
        } else {
            false_precondition(&self.list[i as usize].step, live)
        };
        let Some(reason) = refused else { return true };
        self.finish(i);
        self.fails(i, reason, live);
        false
    }

    /// A step has failed. Where everything is tried, what is so already need not be done, whoever did it; from now on it is wanted so.
    fn fails(&mut self, i: u32, reason: Reason, live: &System) {
        match self.tries_all && is_so(&self.list[i as usize].step, live) {
            true => self.note(i, live),
            false => self.failures.push((i, reason)),
        }
    }

    /// What has failed, but is so on what was seen, counts as done.
    pub fn review(&mut self, actual: &System, live: &mut System) {
        for (i, reason) in std::mem::take(&mut self.failures) {
            let step = &self.list[i as usize].step;
            if !is_so(step, actual) {
                self.failures.push((i, reason));
            } else if step::apply(step, live).is_ok() {
                self.done.push(i);
                self.note(i, live);
            } else if is_so(step, live) {
                self.note(i, live);
            } else {
                self.failures.push((i, reason));
            }
        }
    }

    fn note(&mut self, i: u32, live: &System) {
        if self.notes {
            self.noted.push((i, live.revision()));
        }
    }

    /// A step was done before this took over; the model has it.
    pub fn was_done(&mut self, i: u32) {
        self.state[i as usize] = StepState::Over;
        self.done.push(i);
        self.at = i as usize + 1;
    }

    /// A step is out that was begun before this took over.
    pub fn is_out(&mut self, i: u32, live: &System) {
        self.state[i as usize] = StepState::Out(live.revision());
        self.out += 1;
    }

    /// A step that was taken did not begin.
    pub fn not_begun(&mut self, i: u32) {
        self.out -= 1;
        self.state[i as usize] = StepState::Waiting;
        if let Some(order) = &mut self.order {
            order.again(i);
        }
    }

    /// A step that was out is back.
    pub fn ended(&mut self, i: u32, outcome: Outcome, live: &mut System) {
        let StepState::Out(revision) = self.state[i as usize] else { return };
        self.out -= 1;
        match outcome {
            Outcome::Done(_) => self.happened(i, live, live.revision() == revision),
            Outcome::NotDone(cause) => self.did_not_happen(i, cause, live),
            Outcome::Unknown(cause) => {
                // Neither over nor out, until it is settled.
                self.unread.push((i, cause));
            }
        }
    }

    /// A step happened; `known`: nothing touched the model since its precondition was looked at.
    pub fn happened(&mut self, i: u32, live: &mut System, known: bool) {
        let step = &self.list[i as usize].step;
        // While the call was out, its component may have failed by itself; then the model's precondition is gone.
        if !known && let Some(reason) = false_precondition(step, live) {
            self.finish(i);
            self.fails(i, reason, live);
            return;
        }
        self.took_effect(i, live);
    }

    #[inline]
    fn took_effect(&mut self, i: u32, live: &mut System) {
        if self.late_from_now {
            self.comes_late(i, live);
        }
        step::effect(&self.list[i as usize].step, live);
        self.note(i, live);
        self.finish(i);
        self.done.push(i);
    }

    #[cold]
    fn comes_late(&mut self, i: u32, live: &System) {
        let planned = &self.list[i as usize];
        let call = match &planned.undo {
            Undo::One(Step::Operation(call)) => Some(call.clone()),
            _ => None,
        };
        let undo = step::inverse(&planned.step, call.as_ref(), live);
        self.late.push(LateStep { step: i, undo, revision: live.revision() });
    }

    pub fn did_not_happen(&mut self, i: u32, cause: Cause, live: &mut System) {
        let step = self.list[i as usize].step.clone();
        self.finish(i);
        if matches!(cause, Cause::Panicked(_)) {
            self.made_faulted(step.component(), live);
        }
        let refused = matches!(cause, Cause::Refused(_));
        let reason = Reason::Step { step, cause };
        match refused {
            // Somebody else's step may have come to be before it.
            true => self.fails(i, reason, live),
            false => self.failures.push((i, reason)),
        }
    }

    pub fn made_faulted(&mut self, component: ComponentName, live: &mut System) {
        // The state before the first fault: a second one is none of that.
        if let Some(node) = live.component(component).filter(|node| node.state != RunState::Faulted) {
            self.faulted.push((component, node.state));
            live.set_state(component, RunState::Faulted);
        }
    }

    /// Nobody will know of a step whether it happened.
    pub fn leave_unsettled(&mut self, i: u32) {
        self.finish(i);
        self.unsettled.push(i);
    }
}

/// Of such steps that are about different components none needs another.
fn makes_or_drops(step: &Step) -> bool {
    matches!(step, Step::Create { .. } | Step::Destroy { .. })
}

/// Whether a step comes after what an earlier safe configuration still does.
fn is_busy(step: &Step, can: &Can<'_>) -> bool {
    can.busy.iter().any(|open| open.is_before(step))
}

/// Why the precondition of a step is false on the model, if it is.
#[inline]
pub(super) fn false_precondition(step: &Step, live: &System) -> Option<Reason> {
    let violations = step::precondition(step, live);
    if violations.is_empty() { None } else { Some(refused(step, &violations, live)) }
}

#[cold]
fn refused(step: &Step, violations: &[Violation], live: &System) -> Reason {
    let finding = |violation: &Violation| {
        let finding = Finding::error(violation.code(), format!("`{step}`: {violation}"));
        match violation.help(live) {
            Some(help) => finding.help(help),
            None => finding,
        }
    };
    Reason::Refused(violations.iter().map(finding).collect())
}
