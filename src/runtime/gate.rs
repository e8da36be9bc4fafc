//! The gate of a component: one atomic word that says its run state and who may touch it.
//!
//! Its `BUSY` bit is a lock that is only ever *tried*: an activity enters components that run, everybody else only components
//! that do not, so a control activity never meets anybody. Who has set the bit is [`GateGuard`], and touches what is behind the
//! gate; nobody else does.

use super::sync::{Arc, AtomicU32, Ordering, UnsafeCell};
use crate::model::{RunState, Transition};

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

/// A gate and what is behind it.
pub(crate) struct Gate<T> {
    word: AtomicU32,
    behind: UnsafeCell<T>,
}

// SAFETY: what is behind is touched only through a `GateGuard`, and at any time there is one `GateGuard` of a gate at most: only who
// has set `BUSY` has one, and who sets it sees (acquire) what the one before did (release). So several threads may share the
// gate, though each touches what is behind it alone, and that goes from one to the next: it must be `Send`. The word is `Sync`
// by itself.
unsafe impl<T: Send> Sync for Gate<T> {}

/// What stands behind a gate of its own.
///
/// # Safety
/// `gate` always gives the same gate of the same value: the right to be inside is one of that gate.
pub(crate) unsafe trait Gated {
    type Behind;

    fn gate(&self) -> &Gate<Self::Behind>;
}

/// Why a gate did not open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Closed {
    State(RunState),
    Busy,
    Quarantined,
}

fn state_of(word: u32) -> RunState {
    if word & FAULTED != 0 {
        RunState::Faulted
    } else if word & RUN != 0 {
        RunState::Running
    } else if word & CONFIGURED != 0 {
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
fn keeps_out(word: u32, safe: bool) -> bool {
    word & QUARANTINED != 0 || (!safe && word & KEPT != 0 && word & (RUN | BUSY) != 0)
}

impl<T> Gate<T> {
    /// Of what is not configured.
    pub(crate) fn new(behind: T) -> Self {
        Self { word: AtomicU32::new(0), behind: UnsafeCell::new(behind) }
    }

    fn look(&self) -> u32 {
        self.word.load(Ordering::Acquire)
    }

    pub(crate) fn state(&self) -> RunState {
        state_of(self.look())
    }

    pub(crate) fn is_busy(&self) -> bool {
        self.look() & BUSY != 0
    }

    /// Neither updated nor inside a call.
    pub(crate) fn is_idle(&self) -> bool {
        self.look() & (RUN | BUSY) == 0
    }

    /// Whether steps on it are refused.
    pub(crate) fn is_quarantined(&self) -> bool {
        keeps_out(self.look(), false)
    }

    /// Whether a call of it never returned: its code is not to be called any more.
    pub(crate) fn is_lost(&self) -> bool {
        self.look() & QUARANTINED != 0
    }

    /// A call that was given up has not come to rest in time.
    pub(crate) fn keep_out_until_rest(&self) {
        self.word.fetch_add(RESTLESS, Ordering::AcqRel);
    }

    /// It has after all. Whether no other call keeps it restless.
    pub(crate) fn came_to_rest(&self) -> bool {
        self.word.fetch_sub(RESTLESS, Ordering::AcqRel) & KEPT == RESTLESS
    }

    /// Moves to another run state, for transitions without a hook. `stop` does not wait for an update under way.
    pub(crate) fn shift(&self, transition: Transition, safe: bool) -> Result<(), Closed> {
        self.change(|word| {
            if keeps_out(word, safe) {
                return Err(Closed::Quarantined);
            }
            let state = state_of(word);
            if !transition.allowed_in(state) {
                return Err(Closed::State(state));
            }
            if word & BUSY != 0 && transition != Transition::Stop {
                return Err(Closed::Busy);
            }
            Ok(bits_of(transition.target()) | (word & (BUSY | KEPT)))
        })
        .map(drop)
    }

    #[inline]
    fn change(&self, f: impl Fn(u32) -> Result<u32, Closed>) -> Result<u32, Closed> {
        let mut word = self.look();
        loop {
            match self.word.compare_exchange_weak(word, f(word)?, Ordering::AcqRel, Ordering::Acquire) {
                Ok(before) => return Ok(before),
                Err(now) => word = now,
            }
        }
    }

    /// Sets `BUSY` when it runs and nobody is inside.
    #[inline]
    fn take_running(&self) -> bool {
        let word = self.word.load(Ordering::Relaxed);
        word & (RUN | BUSY) == RUN
            && self.word.compare_exchange(word, word | BUSY, Ordering::AcqRel, Ordering::Relaxed).is_ok()
    }

    fn take(&self, safe: bool, allowed: impl Fn(RunState) -> bool) -> Result<(), Closed> {
        self.change(|word| {
            if keeps_out(word, safe) {
                return Err(Closed::Quarantined);
            }
            if word & BUSY != 0 {
                return Err(Closed::Busy);
            }
            let state = state_of(word);
            if allowed(state) { Ok(word | BUSY) } else { Err(Closed::State(state)) }
        })
        .map(drop)
    }

    /// Says that a call has not returned in time; from now on it is not updated. Whether it was running; none: the call
    /// has returned just now, and nothing is said.
    pub(crate) fn quarantine(&self) -> Option<bool> {
        self.change(|word| if word & BUSY != 0 { Ok((word | QUARANTINED) & !RUN) } else { Err(Closed::Busy) })
            .ok()
            .map(|before| before & RUN != 0)
    }
}

/// How a visit ended for who was visited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct VisitOutcome {
    /// It was running and does not any more.
    pub(crate) ended_running: bool,
    /// It had been put in quarantine meanwhile: somebody must clean it up.
    pub(crate) quarantined: bool,
}

enum GateOf<'a, G> {
    Lent(&'a G),
    Shared(Arc<G>),
}

/// The right to touch what is behind a gate: whoever has it has set `BUSY`. Dropped, it leaves.
pub(crate) struct GateGuard<'a, G: Gated> {
    of: GateOf<'a, G>,
    /// Whether the gate is left as it is when this is dropped.
    over: bool,
}

impl<'a, G: Gated> GateGuard<'a, G> {
    /// For who has just set `BUSY`, and nobody else: dropped, it takes the bit back.
    #[inline]
    fn lent(of: &'a G) -> Self {
        Self { of: GateOf::Lent(of), over: false }
    }

    /// Enters to update: only when it runs and nobody is inside.
    #[inline]
    pub(crate) fn running(of: &'a G) -> Option<Self> {
        of.gate().take_running().then(|| Self::lent(of))
    }

    /// Enters for an operation in its activity's thread: whether it runs or not.
    pub(crate) fn for_operation(of: &'a G, safe: bool) -> Result<Self, Closed> {
        of.gate().take(safe, |_| true).map(|()| Self::lent(of))
    }

    /// Enters while it does not run, for a hook or an operation on a worker.
    pub(crate) fn idle(of: &'a G, safe: bool, allowed: impl Fn(RunState) -> bool) -> Result<Self, Closed> {
        of.gate().take(safe, |state| state != RunState::Running && allowed(state)).map(|()| Self::lent(of))
    }

    /// Enters what was put in quarantine and has come back, to clean it up.
    pub(crate) fn returned(of: &'a G) -> Option<Self> {
        of.gate()
            .change(|word| if word & BUSY != 0 { Err(Closed::Busy) } else { Ok(word | BUSY) })
            .ok()
            .map(|_| Self::lent(of))
    }

    /// The same right, to be taken to another thread. Dropped there unused, it leaves all the same.
    pub(crate) fn sent(mut self, with: &Arc<G>) -> GateGuard<'static, G> {
        assert!(std::ptr::eq(self.at(), &raw const **with), "the right is one of another gate");
        self.over = true;
        GateGuard { of: GateOf::Shared(with.clone()), over: false }
    }

    #[inline]
    fn at(&self) -> &G {
        match &self.of {
            GateOf::Lent(of) => of,
            GateOf::Shared(of) => of,
        }
    }

    /// Who is visited, and what is behind the gate.
    #[inline]
    pub(crate) fn with<R>(&mut self, f: impl FnOnce(&G, &mut G::Behind) -> R) -> R {
        let of = self.at();
        // SAFETY: `BUSY` of this very gate is set by us (see `Gate`), and `&mut self` makes it the only reference.
        of.gate().behind.with_mut(|behind| f(of, unsafe { &mut *behind }))
    }

    /// Leaves, in another state if one is given.
    #[inline]
    pub(crate) fn leave(mut self, state: Option<RunState>) -> VisitOutcome {
        self.over = true;
        let before = self
            .at()
            .gate()
            .change(|word| {
                Ok((state.map_or(word & (CONFIGURED | RUN | FAULTED), bits_of)) | (word & (QUARANTINED | KEPT)))
            })
            .unwrap_or_default();
        VisitOutcome {
            ended_running: before & RUN != 0 && matches!(state, Some(s) if s != RunState::Running),
            quarantined: before & QUARANTINED != 0,
        }
    }

    /// Never leaves: nobody comes in any more.
    pub(crate) fn close(mut self) {
        self.over = true;
    }
}

impl<G: Gated> Drop for GateGuard<'_, G> {
    #[inline]
    fn drop(&mut self) {
        if !self.over {
            self.at().gate().word.fetch_and(!BUSY, Ordering::AcqRel);
        }
    }
}
