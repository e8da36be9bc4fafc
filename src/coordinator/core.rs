//! The coordinator without its thread: one event in, batches of names out.

use crate::limits;
use crate::model::finding::Finding;
use crate::model::names::EventName;
use crate::model::{codes, finding};
use crate::statechart::{
    AtOnce, Chart, FunctionOutput, Hook, Machine, MicrostepResult, Mode, Nobody, NodeId, Raised, Watched,
};
use crate::time::Time;
use std::sync::Arc;

/// For whom an answer is: one visit of one state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Tag {
    /// The state that asked.
    pub owner: NodeId,
    /// The how-manieth visit of it.
    pub visit: u32,
}

impl From<Raised> for Tag {
    fn from(raised: Raised) -> Self {
        Self { owner: raised.owner, visit: raised.visit }
    }
}

/// Who hears of what a coordinator does. It is called from the coordinator's thread and must not wait.
#[allow(unused_variables)] // their names tell what a default that does nothing is given
pub trait Listener {
    /// One step raised these names, in this order. What a step raises belongs together: an undo and a push of one batch
    /// are one transaction (semantics: *The stack*).
    fn raised(&mut self, chart: &Chart, batch: &[Raised]);

    /// A transition was taken (or the chart was entered). `active` are the states active now, from the root inwards. Called
    /// before [`raised`](Self::raised) of the same step.
    fn moved(&mut self, chart: &Chart, active: &[NodeId]) {}

    /// An event is delivered; what it leads to is told next.
    fn delivers(&mut self, event: EventName) {}

    /// The event with this ticket was taken up, and what became of it.
    fn taken_up(&mut self, ticket: u64, delivered: Delivered) {}

    /// An event triggered nothing.
    fn unmatched(&mut self, event: EventName) {}

    /// An event from outside is not delivered: one of safety came before it was taken up.
    fn overtaken(&mut self, event: EventName) {}

    /// An answer came for a visit that is over; it was not delivered.
    fn stale(&mut self, chart: &Chart, event: EventName, tag: Tag) {}

    /// It has reacted to everything delivered so far and is about to wait. Whoever was told of an event before, and looked
    /// while it was being reacted to, must look again now.
    fn rested(&mut self) {}

    /// A function of the model printed something, or failed.
    fn said(&mut self, said: &FunctionOutput) {}

    /// The model has added to its own chart: from now on this is it, and the numbers of what there was stay. Called with
    /// the same one again after each further step.
    fn grown(&mut self, chart: &Arc<Chart>) {}

    /// Its thread has ended by itself, and why: its functions could not be opened, or something in it panicked. It leads nothing
    /// any more, and nothing comes after this.
    fn ended(&mut self, why: &str) {}

    /// The chart behaved badly.
    fn trouble(&mut self, chart: &Chart, trouble: ChartTrouble) {}
}

/// What a chart does that it should not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChartTrouble {
    /// It could not be entered. The next event tries again.
    NotEntered,
    /// It did not come to rest within [`limits::CHART_RUN`] microsteps. What it still had inside was dropped.
    Runaway,
}

impl ChartTrouble {
    /// The trouble as a finding.
    pub fn finding(self, chart: &Chart) -> Finding {
        let initial = chart.initial();
        let (node, code, message) = match self {
            Self::NotEntered => (
                initial,
                codes::CHART_NOT_ENTERED,
                "the coordinator could not be entered: no path from `initial`".to_owned(),
            ),
            Self::Runaway => (
                NodeId::ROOT,
                codes::CHART_RUNAWAY,
                format!(
                    "the coordinator did not come to rest within {} steps: what it had sent to itself is dropped, and it goes \
                     on with the next event from where it stands",
                    limits::CHART_RUN
                ),
            ),
        };
        Finding::new(finding::Severity::Error, code, message).at(chart.origin(node)).path(chart.fqn(node).to_string())
    }
}

/// What became of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delivered {
    /// It triggered a transition.
    Taken,
    /// It triggered nothing.
    Unmatched,
    /// It was an answer for a visit that is over: not delivered.
    Stale,
}

/// A coordinator that is driven by calls, with the functions of its model where it has some.
#[derive(Debug, Clone)]
pub struct Core<F = Nobody> {
    chart: Arc<Chart>,
    machine: Machine,
    batch: Vec<Raised>,
    functions: F,
    said: Vec<FunctionOutput>,
    /// When the model is to be given a turn although nothing happened.
    again: Option<Time>,
}

/// Collects what one step raises.
struct Collect<'a>(&'a mut Vec<Raised>);

impl Hook for Collect<'_> {
    const MICROSTEPS: bool = false;
    const WATCHES: bool = false;

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.0.push(raised);
    }
}

#[cfg(any(test, feature = "internals"))]
impl Core {
    /// A coordinator that has not begun, of a chart without functions.
    pub fn new(chart: Arc<Chart>) -> Self {
        Self::with(chart, Nobody)
    }
}

impl<F: Hook> Core<F> {
    /// The same, with functions.
    pub fn with(chart: Arc<Chart>, functions: F) -> Self {
        let machine = Machine::new(&chart);
        // No step raises more than there are places that raise.
        let batch = Vec::with_capacity(chart.raises().len());
        Self { chart, machine, batch, functions, said: Vec::new(), again: None }
    }

    /// The chart, as it was read.
    #[cfg(any(test, feature = "internals"))]
    pub fn chart(&self) -> &Arc<Chart> {
        &self.chart
    }

    /// Where it stands.
    #[cfg(any(test, feature = "internals"))]
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Events that found no room inside the chart so far: what it raises or its functions send to itself.
    pub fn lost(&self) -> u64 {
        self.machine.queue().dropped() + self.functions.lost()
    }

    /// Enters the chart and lets it come to rest.
    pub fn start(&mut self, now: Time, listener: &mut (impl Listener + ?Sized)) {
        self.settle(now, listener);
    }

    /// Delivers one event and lets the chart come to rest. The event is alone in its step, so that it cannot be lost to
    /// another one that wins (an answer, say, to an operator's command).
    pub fn deliver(
        &mut self,
        event: EventName,
        tag: Option<Tag>,
        now: Time,
        listener: &mut (impl Listener + ?Sized),
    ) -> Delivered {
        if let Some(tag) = tag.filter(|tag| !self.machine.is_present(&self.chart, tag.owner, tag.visit)) {
            listener.stale(self.machine.chart(&self.chart), event, tag);
            return Delivered::Stale;
        }
        listener.delivers(event);
        let id = self.functions.event(&self.chart, event);
        let at_once = if F::MICROSTEPS {
            AtOnce::No
        } else {
            self.machine.at_once(&self.chart, id, now, &mut Collect(&mut self.batch))
        };
        if at_once != AtOnce::No {
            listener.moved(&self.chart, self.machine.active());
            self.tell(listener);
            if at_once == AtOnce::Goes {
                self.settle(now, listener);
            }
            return Delivered::Taken;
        }
        self.machine.send(id);
        if matches!(self.settle(now, listener), MicrostepResult::Taken | MicrostepResult::Entered) {
            Delivered::Taken
        } else {
            listener.unmatched(event);
            Delivered::Unmatched
        }
    }

    /// Lets time events that are due happen.
    pub fn tick(&mut self, now: Time, listener: &mut (impl Listener + ?Sized)) {
        self.settle(now, listener);
    }

    /// When [`tick`](Self::tick) is next needed if no event comes; none: not at all.
    pub fn next_deadline(&self) -> Option<Time> {
        let due = self.machine.next_deadline(&self.chart);
        if F::MICROSTEPS { [due, self.again].into_iter().flatten().min() } else { due }
    }

    /// When an activity is to be resumed, or the model asked for events: what it wants at once waits a little, so that
    /// events come in between and no processor is kept busy with nothing.
    fn turn_after(&self, idle: bool, now: Time) -> Option<Time> {
        if !idle {
            return Some(now + limits::DOO_BUSY);
        }
        let wants = self.machine.mode() == Some(Mode::Active) || self.functions.polls();
        wants.then(|| now + limits::DOO_IDLE)
    }

    /// Whether a microstep left nothing to do.
    fn is_idle(&self, step: MicrostepResult) -> bool {
        step == MicrostepResult::Quiet { idle: true } && self.machine.queue().events().is_empty()
    }

    /// Hands on what the step raised.
    fn tell(&mut self, listener: &mut (impl Listener + ?Sized)) {
        if !self.batch.is_empty() {
            listener.raised(self.machine.chart(&self.chart), &self.batch);
            self.batch.clear();
        }
    }

    /// Turns until nothing is left to do; answers what the first one did.
    fn settle(&mut self, now: Time, listener: &mut (impl Listener + ?Sized)) -> MicrostepResult {
        let mut first = None;
        self.again = None;
        for _ in 0..limits::CHART_RUN {
            let mut collect = Collect(&mut self.batch);
            let mut hook = Watched { watcher: &mut collect, functions: &mut self.functions };
            let step = self.machine.microstep(&self.chart, now, &mut hook);
            first = first.or(Some(step));
            let goes_on = F::MICROSTEPS && self.is_idle(step) && self.functions.go_on();
            if F::MICROSTEPS {
                if let Some(grown) = self.machine.grown() {
                    listener.grown(grown);
                }
                self.functions.said(&mut self.said);
                self.said.drain(..).for_each(|said| listener.said(&said));
            }
            match step {
                MicrostepResult::Taken | MicrostepResult::Entered => {
                    listener.moved(self.machine.chart(&self.chart), self.machine.active())
                }
                MicrostepResult::NotEntered => {
                    listener.trouble(&self.chart, ChartTrouble::NotEntered);
                    return step;
                }
                MicrostepResult::Unmatched | MicrostepResult::Quiet { .. } => (),
            }
            self.tell(listener);
            let rests = match step {
                MicrostepResult::Taken | MicrostepResult::Entered => {
                    self.machine.rest::<Watched<'_, Collect<'_>, F>>(&self.chart)
                }
                // A time event that came due in an idle microstep waits inside for the next one.
                MicrostepResult::Quiet { .. } if goes_on || !self.machine.queue().events().is_empty() => false,
                MicrostepResult::Quiet { idle } => {
                    if F::MICROSTEPS {
                        self.again = self.turn_after(idle, now);
                    }
                    idle || F::MICROSTEPS
                }
                _ => false,
            };
            if rests {
                return first.unwrap_or(step);
            }
        }
        self.machine.drop_queue();
        listener.trouble(&self.chart, ChartTrouble::Runaway);
        first.unwrap_or(MicrostepResult::Unmatched)
    }
}
