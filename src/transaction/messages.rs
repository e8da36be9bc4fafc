//! What goes into a transaction and comes out of it.

use super::touched::Touched;
use crate::model::{ComponentName, ConfigId, Execution, Outcome, Snapshot, Step};
use crate::stack::Reason;
use crate::system::touch::{self, absolute};
use smallvec::SmallVec;

/// What whoever drives it can do now.
pub struct Can<'a> {
    /// How a step is carried out on the platform.
    pub execution: &'a dyn Fn(&Step) -> Execution,
    /// Whether the platform would have a blocking step in one call with others.
    pub batches: &'a dyn Fn(&Step) -> bool,
    /// Whether there is room for a call that takes time.
    pub room: bool,
    /// Components whose call has not returned.
    pub quarantined: &'a [ComponentName],
    /// What earlier safe configurations have still to do: what a later one does there comes after it.
    pub busy: &'a [OpenStep],
}

/// A step of an earlier safe configuration that is not over.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenStep {
    /// The step.
    pub step: Step,
    /// It is out.
    pub begun: bool,
}

impl OpenStep {
    /// Whether `later` comes after it. A value or a call does not wait for a value of the same component that has not even begun, nor a value for
    /// such a call: these may wait for another component, which does not answer.
    pub fn is_before(&self, later: &Step) -> bool {
        let own = touch::components(later);
        if !touch::components(&self.step).iter().any(|component| own.contains(component)) {
            return false;
        }
        let (value, call) = (|step: &Step| absolute(step).is_some(), |step: &Step| matches!(step, Step::Operation(_)));
        let apart = match value(&self.step) {
            true => value(later) && absolute(&self.step) != absolute(later) || call(later),
            false => call(&self.step) && value(later),
        };
        self.begun || !apart
    }
}

/// How a step gets to the platform.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CallKind {
    /// In the configurator's own thread.
    Immediate,
    /// In one call with others that begin then.
    Batched,
    /// In a call of its own.
    Alone,
}

impl Can<'_> {
    /// How a step gets to the platform. Operations have calls of their own, whatever the platform says: they may take long, run
    /// beside each other, and are given up one by one.
    pub(super) fn kind(&self, step: &Step) -> CallKind {
        match (self.execution)(step) {
            Execution::Immediate => CallKind::Immediate,
            Execution::Blocking if !matches!(step, Step::Operation(_)) && (self.batches)(step) => CallKind::Batched,
            Execution::Blocking => CallKind::Alone,
        }
    }
}

/// What only the values that components show can tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Question {
    /// Whether what the configuration of a part stands for becomes true, within its time.
    Stands {
        /// The part.
        part: usize,
    },
    /// Whether a call of unknown outcome was done, by the condition that its operation names.
    WasDone {
        /// The number of the step in the list in hand.
        step: u32,
    },
}

/// What is to be done next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Poll {
    /// These steps begin now, by their numbers in the list in hand ([`Transaction::step`]).
    Begin(SmallVec<[u32; 1]>),
    /// The call that is out for this step is given up: it is told so.
    Cancel(u32),
    /// These components are read back.
    Read(Vec<ComponentName>),
    /// This is found out, on what is seen from now on: [`Input::Told`].
    Ask(Question),
    /// Nothing, until something comes.
    Wait,
    /// It is over: [`Transaction::end`].
    Over,
}

/// What happened.
#[derive(Debug, Clone)]
pub enum Input {
    /// A step that was begun is back.
    Ended {
        /// Its number.
        step: u32,
        /// How.
        outcome: Outcome,
    },
    /// A step that was to begin did not.
    NotBegun(u32),
    /// What was read; none: nobody answered.
    Seen(Option<Snapshot>),
    /// What was asked; none: it cannot be seen.
    Told {
        /// What was asked.
        question: Question,
        /// Whether it is so.
        is: Option<bool>,
    },
    /// A part of it is given up, by who asked for it: what was done is taken back, also what moves.
    GiveUp {
        /// The part.
        part: usize,
    },
    /// A safe configuration goes first. Nothing further begins, and nothing is taken back before [`Input::Release`].
    Interrupt(ConfigId),
    /// The safe configuration has been applied, and touched this.
    Release(Touched),
    /// Everything is taken down: nothing further begins, and nothing is taken back.
    TakenDown,
    /// Nothing further begins, and what was done is taken back as after a failure.
    Stop,
    /// Whoever carries it out has failed: nothing further begins, nothing is taken back, and it ends *broken*.
    BreakOff(Reason),
}
