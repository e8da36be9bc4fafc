//! What a machine calls: functions of a model that has some, and whoever wants to see what happens.

use super::chart::{Chart, NodeId};
use super::queue::Queue;
use super::trace::Trace;
use super::{EdgeId, EventId};
use crate::model::names::EventName;
use crate::model::statechart::FunctionId;
use crate::model::words::words;
use std::sync::Arc;

/// A name raised by an entry, an exit or an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Raised {
    /// The name.
    pub name: EventName,
    /// Who is to hear the answer: the state, if raised on its entry; the least common ancestor of the transition (the
    /// outermost one of a compound transition) if raised on an exit or by an effect.
    pub owner: NodeId,
    /// The owner's how-manieth visit this is, from 1. Once the owner has been left, the visit is over for good.
    pub visit: u32,
    /// The state whose state-scoped configuration asks: by being entered for it, by being left for its undo.
    pub scope: Option<NodeId>,
}

/// Where a function of a model is called.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ActionPlace {
    /// On the entry of a state.
    Entry(NodeId),
    /// On the exit of a state, which is already inactive then.
    Exit(NodeId),
    /// Between the exits and the entries of a transition.
    Effect(EdgeId),
}

/// What a function may see and do.
pub struct HookContext<'a> {
    /// The chart.
    pub chart: &'a Chart,
    /// The active leaf; while a transition is under way as rFSM tells it: on exit still the old one, on entry none.
    pub leaf: Option<NodeId>,
    /// The events of this step.
    pub events: &'a [EventId],
    /// Takes events that the function sends to the chart itself; they are seen in the next step.
    pub queue: &'a mut Queue,
}

/// How one resumption of a leaf's activity ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Doo {
    /// It yielded, and is content to wait (`idle`) or wants to be called again at once.
    Yielded {
        /// Nothing to do for now.
        idle: bool,
    },
    /// It is through: the leaf completes.
    Finished,
    /// It raised an error (reported by the hook): no completion event.
    Failed,
}

/// What a machine calls. Every method has a default that does nothing: a pure chart needs none.
///
/// Functions report their own errors; an error never aborts a transition.
#[allow(unused_variables)] // their names tell what a default that does nothing is given
pub trait Hook {
    /// Whether the hook has its hand in single microsteps: it implements [`poll`](Self::poll), [`before_step`](Self::before_step),
    /// [`after_step`](Self::after_step) or [`go_on`](Self::go_on). If not, [`Machine::run`](super::Machine::run) leaves out
    /// microsteps of which it is known that they do nothing (a completion that triggers nothing, and the idle microstep after it).
    const MICROSTEPS: bool = true;

    /// Whether the hook wants to hear of more than names raised: it implements [`entered`](Self::entered),
    /// [`exited`](Self::exited), [`taking`](Self::taking) or [`conflict`](Self::conflict). If not (and if it has no hand in
    /// single microsteps), whole reactions that are known beforehand are taken at once.
    const WATCHES: bool = true;

    /// Whether a watcher wants what functions print between the things it watches, in [`heard`](Self::heard).
    const HEARS: bool = false;

    /// The event that `name` means; a hook may remember names that the chart does not know.
    fn event(&mut self, chart: &Chart, name: EventName) -> EventId {
        chart.event(name)
    }

    /// The text of an event that this hook may have remembered.
    fn event_text(&self, chart: &Chart, event: EventId) -> String {
        chart.event_text(event)
    }

    /// The seconds of a time event whose time a function says; asked on every entry of `state`. None: it never comes.
    fn seconds(&mut self, function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Option<f64> {
        None
    }

    /// Moves what functions said since the last time to the end of `said`.
    fn said(&mut self, said: &mut Vec<FunctionOutput>) {}

    /// What functions have said up to here, for who watches and wants it in order with what happens
    /// ([`HEARS`](Self::HEARS)). Drained.
    fn heard(&mut self, said: &mut Vec<FunctionOutput>) {
        said.clear();
    }

    /// How many events functions sent so far that found no room.
    fn lost(&self) -> u64 {
        0
    }

    /// Whether microsteps are to be taken now and then even when no event waits: the model asks outside for events.
    fn polls(&self) -> bool {
        false
    }

    /// Whether [`trace`](Self::trace) is wanted just now.
    fn traces(&self) -> bool {
        false
    }

    /// What happens, told to a model's own `dbg` printer.
    fn trace(&mut self, what: Trace<'_>, view: &mut HookContext<'_>) {}

    /// A state is active now; its entry actions follow.
    fn entered(&mut self, chart: &Chart, state: NodeId) {}

    /// A state is not active any more; its exit actions follow.
    fn exited(&mut self, chart: &Chart, state: NodeId) {}

    /// A transition was chosen; its exits, effect and entries follow. A compound transition says so for each segment.
    fn taking(&mut self, chart: &Chart, edge: EdgeId) {}

    /// A name was raised.
    fn raised(&mut self, chart: &Chart, raised: Raised) {}

    /// At `connector` more than one way led on; `ways` lists their first segments, and the first of them is taken.
    fn conflict(&mut self, chart: &Chart, connector: NodeId, ways: &mut dyn Iterator<Item = EdgeId>) {}

    /// The chart could not be entered: no path from its initial connector.
    fn not_entered(&mut self, chart: &Chart) {}

    /// Adds the events that wait outside (rFSM's `getevents`). `false`: it failed, and the microstep ends there.
    fn poll(&mut self, queue: &mut Queue) -> bool {
        true
    }

    /// Before a step. `events` are those of the step; what the hook leaves in there the step uses. `false`: it failed, and
    /// the microstep ends there.
    fn before_step(&mut self, view: &mut HookContext<'_>, events: &mut Vec<EventId>) -> bool {
        true
    }

    /// After a step.
    fn after_step(&mut self, view: &mut HookContext<'_>) {}

    /// Whether a guard lets the transition pass. What a script answers with nothing at all counts as yes.
    fn guard(&mut self, function: FunctionId, edge: EdgeId, view: &mut HookContext<'_>) -> bool {
        false
    }

    /// Whether a predicate accepts an event.
    fn predicate(&mut self, function: FunctionId, event: EventId, view: &mut HookContext<'_>) -> bool {
        false
    }

    /// Runs an entry, exit or effect function.
    fn action(&mut self, function: FunctionId, place: ActionPlace, view: &mut HookContext<'_>) {}

    /// The activity of `state` starts from its beginning when next resumed.
    fn doo_reset(&mut self, state: NodeId) {}

    /// Resumes the activity of `state`.
    fn doo(&mut self, function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Doo {
        Doo::Failed
    }

    /// Called when a run is idle; yes: go on stepping (rFSM's `idle_hook`).
    fn go_on(&mut self) -> bool {
        false
    }

    /// A path ends at a composite state, which only transitions that were added to a running machine do: it is none.
    fn no_way(&mut self, chart: &Chart, from: NodeId) {}

    /// After a microstep: the chart from now on, if the model has added to it. `chart` is the one of this microstep, whose numbers
    /// stay; events in `queue` that have got a number by it are exchanged.
    fn grown(&mut self, chart: &Chart, queue: &mut Queue) -> Option<Arc<Chart>> {
        None
    }

    /// A chain of connectors went round in a cycle, held by nothing; no transition is taken in this step.
    fn runaway(&mut self, chart: &Chart, connector: NodeId) {}
}

/// What a function of a model prints, or what it did wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FunctionOutput {
    /// By which of the four printers.
    pub by: Printer,
    /// One line or more.
    pub text: String,
}

words! {
    /// rFSM's four printers.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum Printer by word {
        /// Errors, among them those that functions raise.
        Err = "err",
        /// Warnings.
        Warn = "warn",
        /// All else.
        Info = "info",
        /// For those who look for a fault.
        Dbg = "dbg",
    }
}

/// Functions with somebody who watches: `watcher` sees what happens, `functions` decide and act.
#[derive(Debug)]
pub struct Watched<'a, W, F> {
    /// Sees what happens.
    pub watcher: &'a mut W,
    /// The functions of the model.
    pub functions: &'a mut F,
}

impl<W: Hook, F: Hook> Watched<'_, W, F> {
    /// Before something is watched: what was said before it.
    fn hear(&mut self) {
        if W::HEARS {
            let mut said = Vec::new();
            self.functions.said(&mut said);
            self.watcher.heard(&mut said);
        }
    }
}

/// Methods that only the functions have an answer to.
macro_rules! passed_on {
    ($($name:ident($($arg:ident: $ty:ty),*) $(-> $answer:ty)?;)*) => {$(
        fn $name(&mut self, $($arg: $ty),*) $(-> $answer)? {
            self.functions.$name($($arg),*)
        }
    )*};
}

impl<W: Hook, F: Hook> Hook for Watched<'_, W, F> {
    const MICROSTEPS: bool = W::MICROSTEPS || F::MICROSTEPS;
    const WATCHES: bool = W::WATCHES || F::WATCHES;

    passed_on! {
        event(chart: &Chart, name: EventName) -> EventId;
        seconds(function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Option<f64>;
        said(said: &mut Vec<FunctionOutput>);
        trace(what: Trace<'_>, view: &mut HookContext<'_>);
        poll(queue: &mut Queue) -> bool;
        before_step(view: &mut HookContext<'_>, events: &mut Vec<EventId>) -> bool;
        after_step(view: &mut HookContext<'_>);
        guard(function: FunctionId, edge: EdgeId, view: &mut HookContext<'_>) -> bool;
        predicate(function: FunctionId, event: EventId, view: &mut HookContext<'_>) -> bool;
        action(function: FunctionId, place: ActionPlace, view: &mut HookContext<'_>);
        doo_reset(state: NodeId);
        doo(function: FunctionId, state: NodeId, view: &mut HookContext<'_>) -> Doo;
        no_way(chart: &Chart, from: NodeId);
        grown(chart: &Chart, queue: &mut Queue) -> Option<Arc<Chart>>;
        go_on() -> bool;
    }

    fn event_text(&self, chart: &Chart, event: EventId) -> String {
        self.functions.event_text(chart, event)
    }

    fn lost(&self) -> u64 {
        self.functions.lost()
    }

    fn polls(&self) -> bool {
        self.functions.polls()
    }

    fn traces(&self) -> bool {
        self.functions.traces()
    }

    fn entered(&mut self, chart: &Chart, state: NodeId) {
        self.hear();
        self.watcher.entered(chart, state);
        self.functions.entered(chart, state);
    }

    fn exited(&mut self, chart: &Chart, state: NodeId) {
        self.hear();
        self.watcher.exited(chart, state);
        self.functions.exited(chart, state);
    }

    fn taking(&mut self, chart: &Chart, edge: EdgeId) {
        self.watcher.taking(chart, edge);
        self.functions.taking(chart, edge);
    }

    fn raised(&mut self, chart: &Chart, raised: Raised) {
        self.hear();
        self.watcher.raised(chart, raised);
        self.functions.raised(chart, raised);
    }

    fn conflict(&mut self, chart: &Chart, connector: NodeId, ways: &mut dyn Iterator<Item = EdgeId>) {
        let ways: Vec<EdgeId> = ways.collect();
        self.hear();
        self.watcher.conflict(chart, connector, &mut ways.iter().copied());
        self.functions.conflict(chart, connector, &mut ways.iter().copied());
    }

    fn not_entered(&mut self, chart: &Chart) {
        self.watcher.not_entered(chart);
        self.functions.not_entered(chart);
    }

    fn runaway(&mut self, chart: &Chart, connector: NodeId) {
        self.watcher.runaway(chart, connector);
        self.functions.runaway(chart, connector);
    }
}

/// The hook of a pure chart that nobody watches.
#[derive(Debug, Clone, Copy, Default)]
pub struct Nobody;

impl Hook for Nobody {
    const MICROSTEPS: bool = false;
    const WATCHES: bool = false;
}
