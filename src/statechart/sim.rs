//! A coordinator alone, stepped line by line: what `davit sim` does. Pure: lines in, observations out.

use super::Machine;
use super::chart::{Chart, NodeId};
use super::hook::{FunctionOutput, Hook, Nobody, Printer, Raised, Watched};
use super::outcome::{Mode, RunEnd, Stepped};
use super::{EdgeId, EventId};
use crate::limits;
use crate::model::finding::{count, nearest};
use crate::model::names::{EventName, NameError};
use crate::time::Time;
use serde::Serialize;
use std::fmt;
use std::time::Duration;

/// What one input line led to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Observation {
    /// Full names of the active states, from the root to the leaf; empty before the chart was entered.
    pub active: Vec<String>,
    /// The mode of the leaf; `null` while nothing is active.
    pub mode: Option<Mode>,
    /// Events left inside for the next step, in order.
    pub queue: Vec<String>,
    /// `exit STATE` and `entry STATE` in the order of execution, each `raise NAME` right after what raised it.
    pub actions: Vec<String>,
    /// A transition was taken; the first entry counts as one.
    pub transition: bool,
    /// What `step` returned: nothing is left to do.
    pub idle: bool,
    /// What functions printed, and what rFSM would have reported (a conflict at a connector, a failed entry). Not part of
    /// the JSON.
    #[serde(skip)]
    pub notes: Vec<String>,
    /// After how many of the actions each note came.
    #[serde(skip)]
    pub notes_after: Vec<usize>,
}

/// Why a line was not understood. Nothing happened then.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SimError {
    /// `advance` without a number of seconds.
    #[error("`{0}` is not understood: it is written `advance SECONDS`, with a number that is not negative")]
    Advance(String),
    /// Not an event.
    #[error(transparent)]
    Event(#[from] NameError),
}

/// Events of a line that no transition lists and that are named in one remark.
const UNKNOWN_SHOWN: usize = 4;

/// A machine that is stepped by lines of text, on a clock of its own.
#[derive(Debug, Clone)]
pub struct Sim<'c, F = Nobody> {
    chart: &'c Chart,
    machine: Machine,
    now: Time,
    functions: F,
}

impl<'c> Sim<'c> {
    /// A machine not yet entered, at time 0.
    pub fn new(chart: &'c Chart) -> Self {
        Self::with(chart, Nobody)
    }
}

impl<'c, F: Hook> Sim<'c, F> {
    /// The same, with the functions of the model.
    pub fn with(chart: &'c Chart, functions: F) -> Self {
        Self { chart, machine: Machine::new(chart), now: Time::default(), functions }
    }

    /// The chart, with what the model has added to it.
    pub fn chart(&self) -> &Chart {
        self.machine.chart(self.chart)
    }

    /// The machine.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The simulated time.
    pub fn now(&self) -> Time {
        self.now
    }

    /// Does what a line says: `run` runs to idle; `advance 0.5` moves the clock by half a second and does one step; any
    /// other line is a set of events separated by blanks, queued in that order, and one step. The first line enters
    /// the machine, which loses the events that stand on it.
    ///
    /// # Errors
    /// [`SimError`] for a line that says none of these; the machine is as before.
    pub fn line(&mut self, line: &str) -> Result<Observation, SimError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let mut trace = SimTrace::default();
        let mut lost = 0;
        let stepped = match words[..] {
            ["run"] => {
                let mut hook = Watched { watcher: &mut trace, functions: &mut self.functions };
                self.machine.run(self.chart, self.now, &mut hook)
            }
            ["advance", ..] => {
                let seconds = match words[1..] {
                    [number] => number.parse().ok().filter(|s: &f64| s.is_finite() && *s >= 0.0),
                    _ => None,
                };
                let seconds = seconds.ok_or_else(|| SimError::Advance(line.trim().to_owned()))?;
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // finite, not negative; saturates
                let nanos = (seconds * 1e9).round() as u64;
                self.now += Duration::from_nanos(nanos);
                let mut hook = Watched { watcher: &mut trace, functions: &mut self.functions };
                self.machine.step(self.chart, self.now, 1, &mut hook)
            }
            _ => {
                let names: Vec<EventName> = words.iter().map(|word| EventName::new(word)).collect::<Result<_, _>>()?;
                let events: Vec<EventId> =
                    names.iter().map(|name| self.functions.event(self.machine.chart(self.chart), *name)).collect();
                lost = events.into_iter().filter(|event| !self.machine.send(*event)).count();
                let enters = self.machine.leaf().is_none();
                let mut hook = Watched { watcher: &mut trace, functions: &mut self.functions };
                let stepped = self.machine.step(self.chart, self.now, 1, &mut hook);
                if !stepped.transition {
                    self.remark_unknown(&names, &mut trace);
                } else if enters {
                    self.remark_entered(&names, &mut trace);
                }
                stepped
            }
        };
        if lost > 0 {
            let most = limits::CHART_QUEUE;
            trace.note(format!("{} found no room: a set holds at most {most}", count(lost, "event")));
        }
        Ok(self.observe(stepped, trace))
    }

    /// An event that is spelt wrongly does as little as one that is only not enabled.
    fn remark_unknown(&mut self, names: &[EventName], trace: &mut SimTrace) {
        let mut said = Vec::new();
        self.functions.said(&mut said);
        trace.heard(&mut said);
        let chart = self.chart();
        let mut unknown: Vec<&str> = Vec::new();
        for name in names.iter().filter(|name| chart.event(**name) == EventId::OTHER).map(EventName::as_str) {
            if name != "e_init_fsm" && !unknown.contains(&name) && unknown.len() <= UNKNOWN_SHOWN {
                unknown.push(name);
            }
        }
        let more = if unknown.len() > UNKNOWN_SHOWN { " and others" } else { "" };
        unknown.truncate(UNKNOWN_SHOWN);
        let Some(last) = unknown.last() else { return };
        // An answer that is spelt rightly is not meant to be another one.
        let answer = |name: &&str| crate::model::Verdict::ENDINGS.iter().any(|ending| name.ends_with(ending));
        let is_slip = unknown.len() == 1 && !answer(last);
        let near = nearest(last, chart.events().iter().map(EventName::as_str)).filter(|_| is_slip);
        let near = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
        trace.note(format!("no transition lists `{}`{more}{near}", unknown.join("`, `")));
    }

    /// What stands in the set of the step that enters is lost with it (rFSM), but for what a path through connectors looks at.
    fn remark_entered(&self, names: &[EventName], trace: &mut SimTrace) {
        let chart = self.chart();
        let connectors = || chart.nodes().filter(|node| !chart.is_state(*node));
        let looked_at = |event| {
            connectors()
                .flat_map(|node| chart.outgoing(node))
                .any(|edge| chart.triggers(edge).is_some_and(|triggers| triggers.contains(&event)))
        };
        let mut lost: Vec<&str> = Vec::new();
        for name in names.iter().filter(|name| name.as_str() != "e_init_fsm" && !looked_at(chart.event(**name))) {
            if lost.len() <= UNKNOWN_SHOWN && !lost.contains(&name.as_str()) {
                lost.push(name.as_str());
            }
        }
        if lost.is_empty() {
            return;
        }
        let are = if lost.len() == 1 { "is" } else { "are" };
        let more = if lost.len() > UNKNOWN_SHOWN { " and others" } else { "" };
        lost.truncate(UNKNOWN_SHOWN);
        let lost = lost.join("`, `");
        trace.note(format!(
            "`{lost}`{more} {are} lost: this step enters the machine; give events from the next line on"
        ));
    }

    fn observe(&mut self, stepped: Stepped, mut trace: SimTrace) -> Observation {
        let mut said = Vec::new();
        self.functions.said(&mut said);
        trace.heard(&mut said);
        let last = trace.actions.len();
        let mut end = |text: String| {
            trace.notes.push(text);
            trace.notes_after.push(last);
        };
        if trace.left_out > 0 {
            end(format!("left out: {}", count(trace.left_out, "more note")));
        }
        if stepped.ended == RunEnd::Endless {
            end(format!("stopped after {} turns: the machine does not come to rest", limits::CHART_RUN));
        }
        Observation {
            active: self.machine.active().iter().map(|node| self.chart().fqn(*node).to_string()).collect(),
            mode: self.machine.mode(),
            queue: self
                .machine
                .queue()
                .events()
                .iter()
                .map(|event| self.functions.event_text(self.chart(), *event))
                .collect(),
            actions: trace.actions,
            transition: stepped.transition,
            idle: stepped.idle,
            notes: trace.notes,
            notes_after: trace.notes_after,
        }
    }
}

/// For people: one line an action, then where it stands.
impl fmt::Display for Observation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut notes = self.notes.iter().zip(&self.notes_after).peekable();
        for done in 0..=self.actions.len() {
            while let Some((note, _)) = notes.next_if(|(_, after)| **after <= done) {
                writeln!(f, "  note: {note}")?;
            }
            let Some(action) = self.actions.get(done) else { break };
            // Of a machine that does not rest, the beginning and the end.
            let (first, last) =
                (limits::SIM_ACTIONS_SHOWN, self.actions.len().saturating_sub(limits::SIM_ACTIONS_SHOWN));
            if done < first || done >= last {
                writeln!(f, "  {action}")?;
            } else if done == first {
                writeln!(f, "  … {} more are left out", last - first)?;
            }
        }
        match (self.active.last(), self.mode) {
            (Some(leaf), Some(Mode::Active)) => write!(f, "= {leaf} (active)")?,
            (Some(leaf), _) => write!(f, "= {leaf} (done)")?,
            (None, _) => f.write_str("= not entered")?,
        }
        if !self.queue.is_empty() {
            write!(f, ", waiting: {}", self.queue.join(" "))?;
        }
        if !self.transition {
            f.write_str(", no transition")?;
        }
        if self.idle {
            f.write_str(", idle")?;
        }
        Ok(())
    }
}

/// Writes down what happens.
#[derive(Debug, Default)]
struct SimTrace {
    actions: Vec<String>,
    notes: Vec<String>,
    notes_after: Vec<usize>,
    /// Notes that are too many.
    left_out: usize,
}

impl SimTrace {
    fn note(&mut self, text: String) {
        if self.notes.len() >= limits::SIM_NOTES {
            self.left_out += 1;
            return;
        }
        self.notes.push(text);
        self.notes_after.push(self.actions.len());
    }
}

impl Hook for SimTrace {
    const MICROSTEPS: bool = false;
    const HEARS: bool = true;

    fn heard(&mut self, said: &mut Vec<FunctionOutput>) {
        for FunctionOutput { by, text } in said.drain(..) {
            self.note(match by {
                Printer::Err => format!("error: {text}"),
                Printer::Warn => format!("warning: {text}"),
                Printer::Info | Printer::Dbg => text,
            });
        }
    }

    fn entered(&mut self, chart: &Chart, state: NodeId) {
        self.actions.push(format!("entry {}", chart.fqn(state)));
    }

    fn exited(&mut self, chart: &Chart, state: NodeId) {
        self.actions.push(format!("exit {}", chart.fqn(state)));
    }

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.actions.push(format!("raise {}", raised.name));
    }

    fn conflict(&mut self, chart: &Chart, connector: NodeId, ways: &mut dyn Iterator<Item = EdgeId>) {
        let targets: Vec<String> = ways.map(|edge| chart.fqn(chart.ends(edge).1).to_string()).collect();
        self.note(format!("conflicting transitions from src {} to {}", chart.fqn(connector), targets.join(", ")));
    }

    fn runaway(&mut self, chart: &Chart, connector: NodeId) {
        self.notes.push(format!("connectors lead round in a circle at {}: no path is taken", chart.fqn(connector)));
    }

    fn not_entered(&mut self, chart: &Chart) {
        self.note(format!("failed to enter, no valid path from {}", chart.fqn(chart.initial())));
    }
}
