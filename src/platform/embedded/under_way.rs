//! The calls that are under way, so that they can be given up from another thread.

use super::step_sequence::StepSequence;
use crate::model::{Call, ComponentName, Step, Transition};
use crate::runtime::call::CallProgress;
use crate::time::lock;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex};

/// A call under way, as far as it can be given up.
pub(super) enum What {
    Operation(Call, Arc<CallProgress>),
    /// Once begun a hook cannot be told anything.
    Hook(ComponentName, Transition, Arc<HookSettlement>),
    /// Steps that make or drop components: those not begun are taken back.
    Sequence(Arc<StepSequence>),
}

/// Who settles a hook: its worker by answering, or its caller by giving up. Exactly one does.
#[derive(Default)]
pub(super) struct HookSettlement(AtomicU8);

impl HookSettlement {
    const QUEUED: u8 = 0;
    const BEGUN: u8 = 1;
    const SETTLED: u8 = 2;
    const WITHDRAWN: u8 = 3;

    fn move_on(&self, from: u8, to: u8) -> bool {
        self.0.compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire).is_ok()
    }

    /// The component's code is about to be called; false: it must not be.
    pub(super) fn begin(&self) -> bool {
        self.move_on(Self::QUEUED, Self::BEGUN)
    }

    /// Takes the hook back if it has not begun.
    pub(super) fn withdraw(&self) -> bool {
        self.move_on(Self::QUEUED, Self::WITHDRAWN)
    }

    pub(super) fn is_withdrawn(&self) -> bool {
        self.0.load(Ordering::Acquire) == Self::WITHDRAWN
    }

    pub(super) fn first(&self) -> bool {
        self.move_on(Self::BEGUN, Self::SETTLED)
    }
}

#[derive(Default)]
pub(super) struct UnderWay(Mutex<OutstandingCalls>);

#[derive(Default)]
struct OutstandingCalls {
    list: Vec<(u64, What)>,
    numbers: u64,
}

impl UnderWay {
    /// From now on, until what is answered is dropped, the call can be given up.
    pub(super) fn enter(&self, what: What) -> Entered<'_> {
        let mut calls = lock(&self.0);
        calls.numbers += 1;
        let number = calls.numbers;
        calls.list.push((number, what));
        Entered { all: self, number }
    }

    /// Gives up the calls for exactly this step. Waits for nobody's code.
    pub(super) fn cancel(&self, step: &Step) {
        for (_, what) in &lock(&self.0).list {
            match (what, step) {
                (What::Operation(call, progress), Step::Operation(other)) if call == other => progress.cancel(),
                (What::Hook(name, moved, settled), Step::State { component, transition })
                    if name == component && moved == transition =>
                {
                    settled.withdraw();
                }
                (What::Sequence(sequence), Step::Create { .. } | Step::Destroy { .. }) => sequence.take_back(step),
                _ => {}
            }
        }
    }
}

/// A call in the list.
pub(super) struct Entered<'a> {
    all: &'a UnderWay,
    number: u64,
}

impl Drop for Entered<'_> {
    fn drop(&mut self) {
        let mut calls = lock(&self.all.0);
        if let Some(at) = calls.list.iter().position(|(number, _)| *number == self.number) {
            // What it held may be a component's; it is not dropped under this lock.
            let what = calls.list.swap_remove(at);
            drop(calls);
            drop(what);
        }
    }
}
