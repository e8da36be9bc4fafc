//! A component in its place: the gate that decides who may touch it, and the component behind the gate.

use super::beat::Beat;
use super::call::{Call, Progress, Reply};
use super::component::{Context, HookResult};
use super::guard;
use super::library::{Body, Kind};
use crate::model::{ComponentName, RunState, Transition, Value};
use crate::time::{Clock, Time};
use std::cell::UnsafeCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

const CONFIGURED: u32 = 1;
/// Its activity updates it.
const RUN: u32 = 2;
/// Somebody is inside: its activity in an update or operation, or a worker in a hook.
const BUSY: u32 = 4;
const FAULTED: u32 = 8;
/// A call of it did not return in time.
const QUARANTINED: u32 = 16;
/// From this bit on: how many calls of it that had been given up did not come to rest in time. While it runs steps are kept
/// out as in quarantine, but it is updated on: only so can it come to rest.
const RESTLESS: u32 = 32;
/// What stays when the run state changes.
const KEPT: u32 = !(RESTLESS - 1);

/// A component and its gate.
///
/// The gate is one atomic word. Its `BUSY` bit is a lock that is only ever *tried*: an activity enters components that run,
/// everybody else only components that do not, so a control activity never meets anybody.
pub(crate) struct Cell {
    pub(crate) name: ComponentName,
    pub(crate) kind: Arc<Kind>,
    pub(crate) beat: Arc<Beat>,
    gate: AtomicU32,
    /// The release (or, event-driven, the moment) of the last update since the last start; `NEVER`: none yet.
    last: AtomicU64,
    body: Behind,
}

/// What is behind the gate.
struct Behind(UnsafeCell<Option<Box<dyn Body>>>);

// SAFETY: it is touched only through an `Inside`, and at any time there is one `Inside` of a cell at most: only who has set `BUSY`
// has one, and who sets it sees (acquire) what the one before did (release). So several threads may share it, though each
// touches it alone, and what it holds goes from one to the next: `Body` is `Send`. All else of a cell is `Sync` by itself.
unsafe impl Sync for Behind {}

/// Why a gate did not open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Closed {
    State(RunState),
    Busy,
    Quarantined,
}

fn state_of(gate: u32) -> RunState {
    if gate & FAULTED != 0 {
        RunState::Faulted
    } else if gate & RUN != 0 {
        RunState::Running
    } else if gate & CONFIGURED != 0 {
        RunState::Stopped
    } else {
        RunState::Unconfigured
    }
}

fn bits_of(state: RunState) -> u32 {
    match state {
        RunState::Unconfigured => 0,
        RunState::Stopped => CONFIGURED,
        RunState::Running => CONFIGURED | RUN,
        RunState::Faulted => FAULTED,
    }
}

/// Whether quarantine keeps a step out. A `safe` one is let in wherever the component's code can still be called.
fn keeps_out(gate: u32, safe: bool) -> bool {
    gate & QUARANTINED != 0 || (!safe && gate & KEPT != 0 && gate & (RUN | BUSY) != 0)
}

impl Cell {
    pub(crate) fn new(kind: Arc<Kind>, beat: Arc<Beat>, body: Box<dyn Body>) -> Self {
        Self {
            name: beat.name,
            kind,
            beat,
            gate: AtomicU32::new(0),
            last: AtomicU64::new(Time::NEVER.0),
            body: Behind(UnsafeCell::new(Some(body))),
        }
    }

    pub(crate) fn state(&self) -> RunState {
        state_of(self.gate.load(Ordering::Acquire))
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.gate.load(Ordering::Acquire) & BUSY != 0
    }

    /// Whether steps on it are refused.
    pub(crate) fn is_quarantined(&self) -> bool {
        keeps_out(self.gate.load(Ordering::Acquire), false)
    }

    /// Whether a call of it never returned: its code is not to be called any more.
    pub(crate) fn is_lost(&self) -> bool {
        self.gate.load(Ordering::Acquire) & QUARANTINED != 0
    }

    /// Whether a call that was given up is still at work in it. Who is neither updated nor inside a call is at rest.
    pub(crate) fn is_restless(&self) -> bool {
        self.beat.restless.load(Ordering::Acquire) > 0 && self.gate.load(Ordering::Acquire) & (RUN | BUSY) != 0
    }

    /// A call that was given up has not come to rest in time.
    pub(crate) fn keep_out_until_rest(&self) {
        self.gate.fetch_add(RESTLESS, Ordering::AcqRel);
    }

    /// It has after all. Whether no other call keeps it restless.
    pub(crate) fn came_to_rest(&self) -> bool {
        self.gate.fetch_sub(RESTLESS, Ordering::AcqRel) & KEPT == RESTLESS
    }

    /// Moves to another run state, for transitions without a hook. `stop` does not wait for an update under way.
    pub(crate) fn shift(&self, transition: Transition, safe: bool) -> Result<(), Closed> {
        self.change(|gate| {
            if keeps_out(gate, safe) {
                return Err(Closed::Quarantined);
            }
            let state = state_of(gate);
            if !transition.allowed_in(state) {
                return Err(Closed::State(state));
            }
            if gate & BUSY != 0 && transition != Transition::Stop {
                return Err(Closed::Busy);
            }
            Ok(bits_of(transition.target()) | (gate & (BUSY | KEPT)))
        })
        .map(drop)
    }

    fn change(&self, f: impl Fn(u32) -> Result<u32, Closed>) -> Result<u32, Closed> {
        let mut gate = self.gate.load(Ordering::Acquire);
        loop {
            match self.gate.compare_exchange_weak(gate, f(gate)?, Ordering::AcqRel, Ordering::Acquire) {
                Ok(before) => return Ok(before),
                Err(now) => gate = now,
            }
        }
    }

    /// Enters to update: only when it runs and nobody is inside.
    #[inline]
    pub(crate) fn enter_running(&self) -> Option<Inside<'_>> {
        let gate = self.gate.load(Ordering::Relaxed);
        if gate & (RUN | BUSY) != RUN {
            return None;
        }
        self.gate
            .compare_exchange(gate, gate | BUSY, Ordering::AcqRel, Ordering::Relaxed)
            .ok()
            .map(|_| Inside { cell: self })
    }

    /// Enters for an operation in its activity's thread: whether it runs or not.
    pub(crate) fn enter_for_operation(&self, safe: bool) -> Result<Inside<'_>, Closed> {
        self.enter(safe, |_| Ok(()))
    }

    /// Enters while it does not run, for a hook or an operation on a worker.
    pub(crate) fn enter_idle(&self, safe: bool, allowed: impl Fn(RunState) -> bool) -> Result<Inside<'_>, Closed> {
        self.enter(
            safe,
            |state| {
                if state != RunState::Running && allowed(state) { Ok(()) } else { Err(Closed::State(state)) }
            },
        )
    }

    /// Enters a component that was put in quarantine and has come back, to clean it up.
    pub(crate) fn enter_returned(&self) -> Option<Inside<'_>> {
        self.change(|gate| if gate & BUSY != 0 { Err(Closed::Busy) } else { Ok(gate | BUSY) })
            .ok()
            .map(|_| Inside { cell: self })
    }

    fn enter(&self, safe: bool, allowed: impl Fn(RunState) -> Result<(), Closed>) -> Result<Inside<'_>, Closed> {
        self.change(|gate| {
            if keeps_out(gate, safe) {
                return Err(Closed::Quarantined);
            }
            if gate & BUSY != 0 {
                return Err(Closed::Busy);
            }
            allowed(state_of(gate)).map(|()| gate | BUSY)
        })
        .map(|_| Inside { cell: self })
    }

    /// Says that a call has not returned in time; from now on it is not updated. Whether it was running; none: the call
    /// has returned just now, and nothing is said.
    pub(crate) fn quarantine(&self) -> Option<bool> {
        self.change(|gate| if gate & BUSY != 0 { Ok((gate | QUARANTINED) & !RUN) } else { Err(Closed::Busy) })
            .ok()
            .map(|before| before & RUN != 0)
    }

    /// Seconds since the last update, and notes this one; none: it is the first since the start.
    pub(crate) fn elapsed(&self, release: Time) -> Option<f64> {
        let last = self.last.swap(release.0, Ordering::Relaxed);
        (last != Time::NEVER.0).then(|| release.since(Time(last)).as_secs_f64())
    }

    /// Forgets the last update.
    pub(crate) fn restart(&self) {
        self.last.store(Time::NEVER.0, Ordering::Relaxed);
        if self.beat.is_event_driven() {
            self.beat.wake_at.store(Time::NEVER.0, Ordering::Relaxed);
        }
    }
}

/// How the call of an operation ended.
pub(crate) struct Ended {
    /// Why the component is faulted, if it is.
    pub(crate) fault: Option<String>,
    /// None: the answer comes later.
    reply: Option<Reply>,
    to: Arc<Progress>,
    /// The answering end, where no ticket has it: it answers by itself when it is dropped, so not before the answer.
    _call: Option<Call>,
}

impl Ended {
    pub(crate) fn answer(self) {
        if let Some(reply) = self.reply {
            self.to.answer(reply);
        }
    }
}

/// How a visit to a component ended for the component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Left {
    /// It was running and does not any more.
    pub(crate) ended_running: bool,
    /// It had been put in quarantine meanwhile: somebody must clean it up.
    pub(crate) quarantined: bool,
}

/// The right to touch a component: whoever has it has set `BUSY`.
pub(crate) struct Inside<'a> {
    cell: &'a Cell,
}

impl<'a> Inside<'a> {
    /// Gives up the guard but not the right: another thread takes it over with [`Inside::resume`].
    pub(crate) fn hand_over(self) {
        std::mem::forget(self);
    }

    /// Takes over the right from a guard that was handed over.
    ///
    /// # Safety
    /// The caller must have got the cell from who called [`Inside::hand_over`], and be the only one who did.
    pub(crate) unsafe fn resume(cell: &'a Cell) -> Self {
        Self { cell }
    }

    fn body(&mut self) -> Option<&mut Box<dyn Body>> {
        // SAFETY: `BUSY` is set by us, see `Cell`; `&mut self` makes it the only reference.
        unsafe { (*self.cell.body.0.get()).as_mut() }
    }

    /// Takes the component out for good.
    pub(crate) fn take(&mut self) -> Option<Box<dyn Body>> {
        // SAFETY: as above.
        unsafe { (*self.cell.body.0.get()).take() }
    }

    /// One update at a release. Its fault, if it has one. `first`: seconds that count as passed before the first one.
    #[inline]
    pub(crate) fn update(&mut self, clock: &Clock, now: Time, release: Time, first: f64) -> Result<(), String> {
        let cell = self.cell;
        cell.beat.set_now(now);
        let elapsed = cell.elapsed(release);
        let mut cx = Context::new(clock, &cell.beat, elapsed.unwrap_or(first), elapsed.is_none());
        let Some(body) = self.body() else { return Ok(()) };
        guard::call(|| body.update(&mut cx))?;
        match cx.fault.take() {
            None => Ok(()),
            Some(reason) => Err(reason),
        }
    }

    /// Runs a hook. Outer error: the panic or fault; inner: the failure.
    pub(crate) fn hook(&mut self, clock: &Clock, transition: Transition) -> Result<HookResult, String> {
        let cell = self.cell;
        cell.beat.set_now(clock.now());
        let mut cx = Context::new(clock, &cell.beat, 0.0, false);
        let Some(body) = self.body() else { return Ok(Ok(())) };
        let result = guard::call(|| body.hook(transition, &mut cx))?;
        match cx.fault.take() {
            None => Ok(result),
            Some(reason) => Err(reason),
        }
    }

    /// Calls an operation. Its answer is sent by [`Ended::answer`], after leaving: who hears it may call again at once.
    pub(crate) fn operation(&mut self, clock: &Clock, index: usize, args: &[Value], call: Call) -> Ended {
        let cell = self.cell;
        cell.beat.set_now(clock.now());
        let to = call.0.clone();
        let mut cx = Context::of_call(clock, &cell.beat, call);
        let result = match self.body() {
            None => Ok(Some(Reply::Refused("the component is gone".to_owned()))),
            Some(body) => guard::call(|| body.operation(index, args, &mut cx)),
        };
        let call = cx.take_call();
        let (reply, fault) = match result {
            Err(panic) => (Some(Reply::Panicked(panic.clone())), Some(panic)),
            Ok(None) if call.is_some() => {
                (Some(Reply::Failed("it answered `Pending` without taking a ticket".to_owned())), cx.fault.take())
            }
            Ok(reply) => (reply, cx.fault.take()),
        };
        Ended { fault, reply, to, _call: call }
    }

    /// Leaves, in another state if one is given.
    pub(crate) fn leave(self, state: Option<RunState>) -> Left {
        let cell = self.cell;
        std::mem::forget(self);
        let before = cell
            .change(|gate| {
                Ok((state.map_or(gate & (CONFIGURED | RUN | FAULTED), bits_of)) | (gate & (QUARANTINED | KEPT)))
            })
            .unwrap_or_default();
        Left {
            ended_running: before & RUN != 0 && matches!(state, Some(s) if s != RunState::Running),
            quarantined: before & QUARANTINED != 0,
        }
    }
}

impl Drop for Inside<'_> {
    fn drop(&mut self) {
        self.cell.gate.fetch_and(!BUSY, Ordering::AcqRel);
    }
}
