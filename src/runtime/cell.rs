//! A component in its place, behind its gate.

use super::beat::Beat;
use super::call::{CallProgress, Reply, Responder};
use super::component::{Context, HookResult};
use super::gate::{self, Gate, Gated};
use super::guard;
use super::library::{Body, ComponentFactory};
use crate::model::{ComponentName, RunState, Transition, Value};
use crate::time::{Clock, Time};
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::Ordering::{AcqRel, Relaxed};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

/// What is asked of a component that somebody enters.
pub(crate) enum CellRequest {
    /// An operation, by its index, with its arguments.
    Operation(usize, Vec<Value>),
    /// An injection that its type declares, by its index, with its values.
    Injection(usize, Vec<Value>),
    /// Not to return any more.
    Hang,
    /// To panic.
    Panic,
    /// To take so long.
    Stall(Duration),
}

/// No operation has this index.
const UNTRAPPED: usize = usize::MAX;

/// A component and its gate.
pub(crate) struct Cell {
    pub(crate) name: ComponentName,
    pub(crate) kind: Arc<ComponentFactory>,
    pub(crate) beat: Arc<Beat>,
    /// The component; none: it was taken out for good.
    pub(crate) gate: Gate<Option<Box<dyn Body>>>,
    /// The operation that is held up when it is called next; `UNTRAPPED`: none.
    trap: AtomicUsize,
    /// For how long, in ns; `u64::MAX`: it does not return.
    held: AtomicU64,
    /// The release (or, event-driven, the moment) of the last update since the last start; `NEVER`: none yet.
    last: AtomicU64,
}

// SAFETY: a field is always the same.
unsafe impl Gated for Cell {
    type Behind = Option<Box<dyn Body>>;

    #[inline]
    fn gate(&self) -> &Gate<Self::Behind> {
        &self.gate
    }
}

/// The right to touch a component.
pub(crate) type CellGuard<'a> = gate::GateGuard<'a, Cell>;

impl Cell {
    pub(crate) fn new(kind: Arc<ComponentFactory>, beat: Arc<Beat>, body: Box<dyn Body>) -> Self {
        let trap = AtomicUsize::new(UNTRAPPED);
        let (held, last) = (AtomicU64::new(0), AtomicU64::new(Time::NEVER.0));
        Self { name: beat.name, kind, beat, gate: Gate::new(Some(body)), trap, held, last }
    }

    /// The next call of that operation takes so long more; none: it does not return.
    pub(crate) fn trap(&self, operation: usize, time: Option<Duration>) {
        let time = time.map(|time| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
        self.held.store(time.unwrap_or(u64::MAX), Ordering::Relaxed);
        self.trap.store(operation, Ordering::Release);
    }

    pub(crate) fn state(&self) -> RunState {
        self.gate.state()
    }

    /// Whether a call that was given up is still at work in it. Who is neither updated nor inside a call is at rest.
    pub(crate) fn is_restless(&self) -> bool {
        self.beat.restless.load(Ordering::Acquire) > 0 && !self.gate.is_idle()
    }

    /// Seconds since the last update, and notes this one; none: it is the first since the start.
    pub(crate) fn elapsed(&self, release: Time) -> Option<f64> {
        // Whoever is inside is alone with it, and a start forgets it before anybody may come in: no exchange is needed, which
        // would cost more than all else that is noted of an update.
        let last = self.last.load(Ordering::Relaxed);
        self.last.store(release.0, Ordering::Relaxed);
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
pub(crate) struct CallEnded {
    /// Why the component is faulted, if it is.
    pub(crate) fault: Option<String>,
    /// None: the answer comes later.
    reply: Option<Reply>,
    to: Arc<CallProgress>,
    /// The answering end, where no ticket has it: it answers by itself when it is dropped, so not before the answer.
    _call: Option<Responder>,
}

impl CallEnded {
    pub(crate) fn answer(self) {
        if let Some(reply) = self.reply {
            self.to.answer(reply);
        }
    }
}

impl CellGuard<'_> {
    /// Takes the component out for good.
    pub(crate) fn take(&mut self) -> Option<Box<dyn Body>> {
        self.with(|_, body| body.take())
    }

    /// One update at a release. Its fault, if it has one. `period`: seconds that count as passed before the first one.
    #[inline]
    pub(crate) fn update(&mut self, clock: &Clock, now: Time, release: Time, period: f64) -> Result<(), String> {
        self.with(|cell, body| {
            cell.beat.set_now(now);
            let mut cx = Context::of_update(clock, &cell.beat, cell.elapsed(release), period);
            let Some(body) = body else { return Ok(()) };
            guard::call(|| body.update(&mut cx))?;
            match cx.fault.take() {
                None => Ok(()),
                Some(reason) => Err(reason),
            }
        })
    }

    /// Runs a hook. Outer error: the panic or fault; inner: the failure.
    pub(crate) fn hook(&mut self, clock: &Clock, transition: Transition) -> Result<HookResult, String> {
        self.with(|cell, body| {
            cell.beat.set_now(clock.now());
            let mut cx = Context::new(clock, &cell.beat);
            let Some(body) = body else { return Ok(Ok(())) };
            let result = guard::call(|| body.hook(transition, &mut cx))?;
            match cx.fault.take() {
                None => Ok(result),
                Some(reason) => Err(reason),
            }
        })
    }

    /// Calls an operation. Its answer is sent by [`CallEnded::answer`], after leaving: who hears it may call again at once.
    pub(crate) fn operation(&mut self, clock: &Clock, asked: &CellRequest, call: Responder) -> CallEnded {
        self.with(|cell, body| operate(cell, body.as_mut(), clock, asked, call))
    }
}

fn operate(
    cell: &Cell,
    body: Option<&mut Box<dyn Body>>,
    clock: &Clock,
    asked: &CellRequest,
    call: Responder,
) -> CallEnded {
    cell.beat.set_now(clock.now());
    let to = call.0.clone();
    let mut cx = Context::of_call(clock, &cell.beat, call, cell.state() == RunState::Faulted);
    let result = match body {
        None => Ok(Some(Reply::Refused("the component is gone".to_owned()))),
        Some(body) => guard::call(|| match asked {
            CellRequest::Operation(index, args) => {
                if cell.trap.compare_exchange(*index, UNTRAPPED, AcqRel, Relaxed).is_ok() {
                    match cell.held.load(Relaxed) {
                        u64::MAX => clock.hang(),
                        time => clock.sleep(Duration::from_nanos(time)),
                    }
                }
                body.operation(*index, args, &mut cx)
            }
            CellRequest::Injection(index, values) => body.inject(*index, values, &mut cx),
            CellRequest::Hang | CellRequest::Panic | CellRequest::Stall(_) => {
                // It has happened now, whatever comes of it.
                to.answer(Reply::Done(None));
                match asked {
                    CellRequest::Hang => clock.hang(),
                    CellRequest::Stall(time) => clock.sleep(*time),
                    // It is no defect of the place it comes from.
                    _ => resume_unwind(Box::new("a panic was injected".to_owned())),
                }
                Some(Reply::Done(None))
            }
        }),
    };
    let call = cx.take_call();
    let (reply, fault) = match result {
        Err(panic) => (Some(Reply::Panicked(panic.clone())), Some(panic)),
        Ok(None) if call.is_some() => {
            (Some(Reply::Failed("it answered `Pending` without taking a ticket".to_owned())), cx.fault.take())
        }
        Ok(reply) => (reply, cx.fault.take()),
    };
    CallEnded { fault, reply, to, _call: call }
}
