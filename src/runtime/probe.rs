//! Probes: what a component may see of others beside its connections. Monitors have them.
//!
//! A probe of a port is one more link of it, with a cell of its own: whoever writes does not wait for it, and is not
//! changed by it but for one more exchange a write. A probe comes and goes with what it looks at; what has none is absent.

use super::activity::ActivityThread;
use super::beat::Beat;
use super::cell::Cell;
use super::latest::Reader;
use super::links::{Links, LinksSender, links};
use super::port::Stamped;
use super::value::PortValue;
use crate::model::monitor::{Counter, ValuePart};
use crate::model::{ComponentName, Ident, MemberRef, RunState};
use crate::time::Time;
use std::sync::Arc;

/// Something that a component wants to see.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Observed {
    /// What is written to an out-port, or comes to an in-port through its `data` connection.
    Port(MemberRef),
    /// The run state of a component.
    Component(ComponentName),
    /// The counters of an activity.
    Activity(Ident),
}

/// A port seen from outside.
pub(crate) trait ProbeTap: Send {
    /// Fetches the newest value; answers when it was written and how often so far. None: never, since the tap is there.
    fn fetch(&mut self) -> Option<(Time, u64)>;

    /// The number on this way into the value fetched last; none when there is none.
    fn number(&self, path: &[ValuePart]) -> Option<f64>;
}

/// The reading end of a probe.
pub(super) struct Tapped<T> {
    pub(super) reader: Reader<(Stamped<T>, u64)>,
}

impl<T: PortValue> ProbeTap for Tapped<T> {
    fn fetch(&mut self) -> Option<(Time, u64)> {
        self.reader.update();
        let (slot, writes) = self.reader.value();
        slot.value.is_some().then_some((slot.at, *writes))
    }

    fn number(&self, path: &[ValuePart]) -> Option<f64> {
        self.reader.value().0.value.as_ref().and_then(|value| value.number(path))
    }
}

/// One probe.
pub(crate) enum Probe {
    Port(Box<dyn ProbeTap>),
    Component(Arc<Cell>),
    Activity(Arc<ActivityThread>),
}

/// The probes a component has, by the place of what they look at in its list of [`Observed`].
pub struct Probes {
    links: Links<(usize, Probe)>,
}

/// The configurator's end of the probes of one component.
pub(crate) struct ProbesEnd {
    pub(crate) wanted: Arc<[Observed]>,
    pub(crate) sender: LinksSender<(usize, Probe)>,
    /// Of a component in an event-driven activity: a write to what it looks at wakes it.
    pub(crate) wake: Option<Arc<Beat>>,
}

/// What a probe shows.
pub struct ProbeReading<'a>(&'a mut Probe);

impl Probes {
    pub(crate) fn new(wanted: Arc<[Observed]>, beat: &Arc<Beat>) -> (Self, ProbesEnd) {
        let (sender, links) = links();
        let wake = beat.is_event_driven().then(|| beat.clone());
        (Self { links }, ProbesEnd { wanted, sender, wake })
    }

    /// Probes of nothing.
    pub(crate) fn loose() -> Self {
        Self { links: links().1 }
    }

    /// All probes there are now, each with the place of what it looks at. Several may look at one place (an in-port that
    /// is being connected anew): the newest comes last.
    pub fn each(&mut self) -> impl Iterator<Item = (usize, ProbeReading<'_>)> {
        self.links.refresh();
        self.links.iter_mut().map(|(place, probe)| (*place, ProbeReading(probe)))
    }
}

impl ProbeReading<'_> {
    /// Of a port: when it was written last and how often since the probe is there.
    pub fn written(&mut self) -> Option<(Time, u64)> {
        match self.0 {
            Probe::Port(tap) => tap.fetch(),
            _ => None,
        }
    }

    /// Of a port that was written: the number on this way into its value.
    pub fn number(&self, path: &[ValuePart]) -> Option<f64> {
        match &self.0 {
            Probe::Port(tap) => tap.number(path),
            _ => None,
        }
    }

    /// Of a component: its run state.
    pub fn state(&self) -> Option<RunState> {
        match &self.0 {
            Probe::Component(cell) => Some(cell.state()),
            _ => None,
        }
    }

    /// Of an activity: a counter.
    pub fn counter(&self, counter: Counter) -> Option<f64> {
        match &self.0 {
            Probe::Activity(activity) => Some(activity.counter(counter)),
            _ => None,
        }
    }
}
