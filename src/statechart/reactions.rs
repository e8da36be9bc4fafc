//! Whole reactions, worked out when a chart is compiled: what an event does to a leaf at rest, until the next rest.
//!
//! In a pure chart the answer to (leaf, event) is always the same. So the general engine is asked once for each pair, what
//! it does is written down as one row, and [`Machine::at_once`] only plays the row: which states stay, which are entered,
//! what is raised, and that the completion of the new leaf triggers nothing. Everything else takes the general way:
//! functions, conflicts at connectors (they are reported), states entered and left again on the way, leaves whose
//! completion triggers something, and what is past [`limits::CHART_REACTIONS`].

use super::EdgeId;
use super::chart::{Chart, EventId, NodeId, NodeKind, Span};
use super::hook::{Hook, Nobody, Raised};
use super::machine::Machine;
use super::outcome::{MicrostepResult, Mode};
use crate::limits;
use crate::model::names::EventName;
use crate::time::Time;

/// What one event does to one leaf at rest.
#[derive(Debug, Clone, Copy)]
struct ReactionRow {
    event: EventId,
    /// The leaf it ends in.
    leaf: NodeId,
    /// How many states from the root inwards stay active.
    keep: u32,
    /// It leaves one leaf for another of the same state, and at most that one raises something, one name; the chart has no
    /// time events. So nearly all reactions of nearly all machines: the rows below need not be looked at.
    simple: bool,
    /// What a simple one raises, and whether it is its state-scoped configuration.
    name: Option<EventName>,
    scoped: bool,
    /// The states entered before the leaf, outermost first.
    around: Span,
    /// What is raised, in order, with its owner.
    raised: Span,
}

/// What is known of one node. Its first row stands here itself: most leaves have only one or two, and to find the leaf, then
/// its rows, then the row would be three looks into memory that wait for each other.
#[derive(Debug, Clone, Copy)]
struct KnownReactions {
    first: ReactionRow,
    /// The other rows, sorted by event.
    more: Span,
}

impl KnownReactions {
    /// Nothing is known.
    const NONE: Self = {
        let none = Span { start: 0, len: 0 };
        let first = ReactionRow {
            event: EventId::NEVER,
            leaf: NodeId::ROOT,
            keep: 0,
            simple: false,
            name: None,
            scoped: false,
            around: none,
            raised: none,
        };
        Self { first, more: none }
    };
}

/// The reactions of a chart.
#[derive(Debug, Clone, Default)]
pub(super) struct ReactionTable {
    /// By node; nothing is known but of leaves.
    of: Vec<KnownReactions>,
    rows: Vec<ReactionRow>,
    around: Vec<NodeId>,
    raised: Vec<(EventName, NodeId, Option<NodeId>)>,
}

/// What playing a reaction came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AtOnce {
    /// There is no row for it, or the machine is not at rest: the event is neither queued nor used.
    No,
    /// The transition was taken, and the machine is at rest.
    Rests,
    /// The transition was taken; a time event that is due waits inside for the next microstep.
    Goes,
}

impl Machine {
    /// Takes the whole reaction to one event at once, if it is known beforehand and the machine is at rest. What happens is
    /// what [`send`](Self::send) and microsteps up to the next rest would do; only names raised are told to the hook, so a hook
    /// that watches states or transitions ([`Hook::WATCHES`]) is never served so.
    #[inline]
    pub fn at_once<H: Hook>(&mut self, chart: &Chart, event: EventId, now: Time, hook: &mut H) -> AtOnce {
        let Some(leaf) = self.leaf.filter(|_| !H::MICROSTEPS && !H::WATCHES) else { return AtOnce::No };
        if !self.queue.events.is_empty() {
            return AtOnce::No;
        }
        let all = &chart.reactions;
        let Some(known) = all.of.get(leaf.index()) else { return AtOnce::No };
        let row = if known.first.event == event {
            &known.first
        } else {
            let rows = known.more.of(&all.rows);
            // Few rows are gone through faster than searched.
            let found = if rows.len() <= 8 {
                rows.iter().find(|row| row.event == event)
            } else {
                rows.binary_search_by_key(&event, |row| row.event).ok().map(|at| &rows[at])
            };
            let Some(row) = found else { return AtOnce::No };
            row
        };
        self.search.looked_at(1);
        if row.simple
            && let Some(innermost) = self.path.get_mut(row.keep as usize)
            && let Some(visits) = self.visits.get_mut(row.leaf.index())
        {
            *innermost = row.leaf;
            *visits = visits.wrapping_add(1);
            (self.leaf, self.mode) = (Some(row.leaf), Mode::Done);
            if let Some(name) = row.name {
                let scope = row.scoped.then_some(row.leaf);
                hook.raised(chart, Raised { name, owner: row.leaf, visit: *visits, scope });
            }
            return AtOnce::Rests;
        }
        self.play(chart, *row, now, hook)
    }

    /// What a row says, step by step.
    #[inline(never)]
    fn play<H: Hook>(&mut self, chart: &Chart, row: ReactionRow, now: Time, hook: &mut H) -> AtOnce {
        let all = &chart.reactions;
        self.path.truncate(row.keep as usize);
        for state in row.around.of(&all.around) {
            self.visit_next(*state);
        }
        self.visit_next(row.leaf);
        self.leaf = Some(row.leaf);
        self.mode = Mode::Done;
        for (name, owner, scope) in row.raised.of(&all.raised) {
            let visit = self.visits[owner.index()];
            hook.raised(chart, Raised { name: *name, owner: *owner, visit, scope: *scope });
        }
        if chart.timers.is_empty() { AtOnce::Rests } else { self.time_after(chart, row, now) }
    }

    #[inline]
    fn visit_next(&mut self, state: NodeId) {
        self.path.push(state);
        let visits = &mut self.visits[state.index()];
        *visits = visits.wrapping_add(1);
    }

    /// Time events after a reaction: those of the entered states begin anew, and those that are due are raised.
    #[cold]
    fn time_after(&mut self, chart: &Chart, row: ReactionRow, now: Time) -> AtOnce {
        for state in row.around.of(&chart.reactions.around).iter().chain([&row.leaf]) {
            self.restart_timer(chart, *state, now, &mut Nobody);
        }
        self.queue.push(chart.nodes[row.leaf.index()].done);
        self.check_timers(chart, now, &mut Nobody);
        if self.queue.events.len() == 1 {
            self.queue.events.clear();
            AtOnce::Rests
        } else {
            AtOnce::Goes
        }
    }
}

impl ReactionTable {
    /// Asks the engine what each event that a leaf or a state around it lists does to that leaf.
    pub(super) fn of(chart: &Chart) -> Self {
        let mut reactions = Self { of: vec![KnownReactions::NONE; chart.nodes.len()], ..Self::default() };
        if !chart.pure {
            return Self::default();
        }
        let mut machine = Machine::new(chart);
        let mut events = Vec::new();
        let mut notes = Notes::default();
        let (mut firsts, mut cost) = (0, 0);
        for leaf in chart.nodes().filter(|node| chart.kind(*node) == NodeKind::Leaf) {
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
            cost += events.len() as u64;
            events.sort_unstable();
            events.dedup();
            let start = reactions.rows.len();
            let mut first = None;
            for event in &events {
                // Also where nothing comes of it that can be written down.
                if cost + machine.work() > limits::CHART_WORK {
                    break;
                }
                machine.place(chart, leaf, Time::default());
                notes.clear();
                machine.send(*event);
                let step = machine.microstep(chart, Time::default(), &mut notes);
                if step == MicrostepResult::Taken && notes.plain && machine.rest::<Notes>(chart) {
                    let row = reactions.row(chart, leaf, *event, &machine, &notes);
                    if let Some(row) = row
                        && first.is_some()
                    {
                        reactions.rows.push(row);
                    }
                    first = first.or(row);
                }
            }
            if let Some(first) = first {
                reactions.of[leaf.index()] = KnownReactions { first, more: span(start, reactions.rows.len()) };
            }
            firsts += usize::from(first.is_some());
            let size = firsts + reactions.rows.len() + reactions.around.len() + reactions.raised.len();
            if size > limits::CHART_REACTIONS || cost + machine.work() > limits::CHART_WORK {
                return reactions;
            }
        }
        reactions
    }

    /// What the machine just did, as a row; it was in the leaf `from`.
    fn row(
        &mut self,
        chart: &Chart,
        from: NodeId,
        event: EventId,
        machine: &Machine,
        notes: &Notes,
    ) -> Option<ReactionRow> {
        let leaf = machine.leaf?;
        let (entered, around) = notes.entered.split_last()?;
        debug_assert_eq!(*entered, leaf, "a transition ends in the leaf it enters last");
        let starts = (self.around.len(), self.raised.len());
        self.around.extend_from_slice(around);
        self.raised.extend_from_slice(&notes.raised);
        let keep = machine.path.len() - notes.entered.len();
        let name = match notes.raised[..] {
            [] => Some(None),
            [(name, owner, scope)] if owner == leaf && scope.is_none_or(|scope| scope == leaf) => {
                Some(Some((name, scope.is_some())))
            }
            _ => None,
        };
        let simple = around.is_empty() && chart.depth(from) == keep && name.is_some() && chart.timers.is_empty();
        Some(ReactionRow {
            event,
            leaf,
            keep: u32::try_from(keep).expect("less deep than ids are many"),
            simple,
            name: name.flatten().map(|(name, _)| name),
            scoped: name.flatten().is_some_and(|(_, scoped)| scoped),
            around: span(starts.0, self.around.len()),
            raised: span(starts.1, self.raised.len()),
        })
    }
}

fn span(start: usize, end: usize) -> Span {
    let number = |n| u32::try_from(n).expect("fewer rows than ids");
    Span { start: number(start), len: number(end - start) }
}

/// Writes down one step.
struct Notes {
    entered: Vec<NodeId>,
    raised: Vec<(EventName, NodeId, Option<NodeId>)>,
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
    const MICROSTEPS: bool = false;

    fn entered(&mut self, _: &Chart, state: NodeId) {
        self.entered.push(state);
    }

    fn exited(&mut self, _: &Chart, _: NodeId) {
        self.plain &= self.entered.is_empty();
    }

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.raised.push((raised.name, raised.owner, raised.scope));
    }

    fn conflict(&mut self, _: &Chart, _: NodeId, _: &mut dyn Iterator<Item = EdgeId>) {
        self.plain = false;
    }
}
