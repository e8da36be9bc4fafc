//! Whole reactions, worked out when a chart is compiled: what an event does to a leaf at rest, until the next rest.
//!
//! In a pure chart the answer to (leaf, event) is always the same. So the general engine is asked once for each pair, what
//! it does is written down as one row, and [`Machine::at_once`] only plays the row: which states stay, which are entered,
//! what is raised, and that the completion of the new leaf triggers nothing. Everything else takes the general way:
//! functions, conflicts at connectors (they are reported), states entered and left again on the way, leaves whose
//! completion triggers something, and what is past [`limits::CHART_REACTIONS`].

use super::EdgeId;
use super::chart::{Chart, EventId, Kind, NodeId, Span};
use super::hook::{Hook, Nobody, Raised};
use super::machine::Machine;
use super::outcome::{Ended, Mode, Step, Stepped};
use crate::limits;
use crate::model::names::EventName;
use crate::time::Time;

/// What one event does to one leaf at rest.
#[derive(Debug, Clone, Copy)]
struct Reaction {
    event: EventId,
    /// The leaf it ends in.
    leaf: NodeId,
    /// How many states from the root inwards stay active.
    keep: u32,
    /// The states entered, outermost first.
    entered: Span,
    /// What is raised, in order, with its owner.
    raised: Span,
}

/// The reactions of a chart.
#[derive(Debug, Clone, Default)]
pub(super) struct Reactions {
    /// By node: its rows, sorted by event; empty for all but leaves.
    of: Vec<Span>,
    rows: Vec<Reaction>,
    entered: Vec<NodeId>,
    raised: Vec<(EventName, NodeId)>,
}

/// What playing a reaction came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtOnce {
    /// There is no row for it, or the machine is not at rest: the event is neither queued nor used.
    No,
    /// The transition was taken, and the machine is at rest.
    Rests,
    /// The transition was taken; a time event that is due waits inside for the next turn.
    Goes,
}

impl Machine {
    /// Takes the whole reaction to one event at once, if it is known beforehand and the machine is at rest. What happens is
    /// what [`send`](Self::send) and turns up to the next rest would do; only names raised are told to the hook, so a hook
    /// that watches states or transitions ([`Hook::WATCHES`]) is never served so.
    #[inline]
    pub fn at_once<H: Hook>(&mut self, chart: &Chart, event: EventId, now: Time, hook: &mut H) -> AtOnce {
        let Some(leaf) = self.leaf.filter(|_| !H::TURNS && !H::WATCHES) else { return AtOnce::No };
        if !self.queue.events.is_empty() {
            return AtOnce::No;
        }
        let all = &chart.reactions;
        let Some(rows) = all.of.get(leaf.index()) else { return AtOnce::No };
        let rows = rows.of(&all.rows);
        // Few rows are gone through faster than searched.
        let found = if rows.len() <= 8 {
            rows.iter().find(|row| row.event == event)
        } else {
            rows.binary_search_by_key(&event, |row| row.event).ok().map(|at| &rows[at])
        };
        let Some(row) = found else { return AtOnce::No };
        self.search.looked_at(1);
        self.path.truncate(row.keep as usize);
        for state in row.entered.of(&all.entered) {
            self.path.push(*state);
            let visits = &mut self.visits[state.index()];
            *visits = visits.wrapping_add(1);
        }
        self.leaf = Some(row.leaf);
        self.mode = Mode::Done;
        for (name, owner) in row.raised.of(&all.raised) {
            hook.raised(chart, Raised { name: *name, owner: *owner, visit: self.visits[owner.index()] });
        }
        if chart.timers.is_empty() { AtOnce::Rests } else { self.time_after(chart, *row, now) }
    }

    /// Time events after a reaction: those of the entered states begin anew, and those that are due are raised.
    #[cold]
    fn time_after(&mut self, chart: &Chart, row: Reaction, now: Time) -> AtOnce {
        for state in row.entered.of(&chart.reactions.entered) {
            self.restart_timer(chart, *state, now, &mut Nobody);
        }
        self.queue.push(chart.nodes[row.leaf.index()].done);
        self.check_timers(chart, now);
        if self.queue.events.len() == 1 {
            self.queue.events.clear();
            AtOnce::Rests
        } else {
            AtOnce::Goes
        }
    }

    /// One event, then to rest: [`send`](Self::send) and [`run`](Self::run) in one, and faster where the reaction is known.
    /// An event for which the queue has no room is dropped and counted.
    #[inline]
    pub fn react<H: Hook>(&mut self, chart: &Chart, event: EventId, now: Time, hook: &mut H) -> Stepped {
        match self.at_once(chart, event, now, hook) {
            AtOnce::Rests => Stepped { idle: true, transition: true, ended: Ended::Idle },
            AtOnce::Goes => Stepped { transition: true, ..self.run(chart, now, hook) },
            AtOnce::No => {
                self.send(event);
                self.run(chart, now, hook)
            }
        }
    }
}

impl Reactions {
    /// Asks the engine what each event that a leaf or a state around it lists does to that leaf.
    pub(super) fn of(chart: &Chart) -> Self {
        let mut reactions = Self { of: vec![Span::default(); chart.nodes.len()], ..Self::default() };
        if !chart.pure {
            return Self::default();
        }
        let mut machine = Machine::new(chart);
        let mut events = Vec::new();
        let mut notes = Notes::default();
        for leaf in chart.nodes().filter(|node| chart.kind(*node) == Kind::Leaf) {
            events.clear();
            let mut at = Some(leaf);
            while let Some(node) = at {
                for edge in chart.outgoing(node) {
                    events.extend_from_slice(chart.triggers(edge).unwrap_or_default());
                }
                at = chart.parent(node);
                if events.len() > limits::CHART_REACTIONS {
                    return reactions;
                }
            }
            events.sort_unstable();
            events.dedup();
            let start = reactions.rows.len();
            for event in &events {
                machine.place(chart, leaf, Time::default());
                notes.clear();
                machine.send(*event);
                let step = machine.turn(chart, Time::default(), &mut notes);
                if step == Step::Taken && notes.plain && machine.rest::<Notes>(chart) {
                    reactions.add(*event, &machine, &notes);
                }
            }
            reactions.of[leaf.index()] = span(start, reactions.rows.len());
            let size = reactions.rows.len() + reactions.entered.len() + reactions.raised.len();
            if size > limits::CHART_REACTIONS {
                return reactions;
            }
        }
        reactions
    }

    fn add(&mut self, event: EventId, machine: &Machine, notes: &Notes) {
        let Some(leaf) = machine.leaf else { return };
        let (entered, raised) = (self.entered.len(), self.raised.len());
        self.entered.extend_from_slice(&notes.entered);
        self.raised.extend_from_slice(&notes.raised);
        let keep = machine.path.len() - notes.entered.len();
        self.rows.push(Reaction {
            event,
            leaf,
            keep: u32::try_from(keep).expect("less deep than ids are many"),
            entered: span(entered, self.entered.len()),
            raised: span(raised, self.raised.len()),
        });
    }
}

fn span(start: usize, end: usize) -> Span {
    let number = |n| u32::try_from(n).expect("fewer rows than ids");
    Span { start: number(start), len: number(end - start) }
}

/// Writes down one step.
struct Notes {
    entered: Vec<NodeId>,
    raised: Vec<(EventName, NodeId)>,
    /// First only exits, then only entries, and nothing to report.
    plain: bool,
}

impl Default for Notes {
    fn default() -> Self {
        Self { entered: Vec::new(), raised: Vec::new(), plain: true }
    }
}

impl Notes {
    fn clear(&mut self) {
        self.entered.clear();
        self.raised.clear();
        self.plain = true;
    }
}

impl Hook for Notes {
    const TURNS: bool = false;

    fn entered(&mut self, _: &Chart, state: NodeId) {
        self.entered.push(state);
    }

    fn exited(&mut self, _: &Chart, _: NodeId) {
        self.plain &= self.entered.is_empty();
    }

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.raised.push((raised.name, raised.owner));
    }

    fn conflict(&mut self, _: &Chart, _: NodeId, _: &mut dyn Iterator<Item = EdgeId>) {
        self.plain = false;
    }
}
