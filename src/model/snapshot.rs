//! The observable system as plain data: what a platform reports, what is printed, compared and saved.

use super::configuration::Policy;
use super::names::{ComponentName, Ident, MemberRef, TypeName};
use super::run_state::RunState;
use super::value::Value;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// A system as it can be observed (the identity of the laws; `SYSTEM` of the JSON views).
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Snapshot {
    /// Components by name.
    pub components: BTreeMap<ComponentName, ComponentSnapshot>,
    /// Connections in order of their ends.
    #[serde(serialize_with = "as_list")]
    pub connections: BTreeMap<(MemberRef, MemberRef), Policy>,
    /// The in-ports that were written by a `port_write`, with the value (also while connected); no others.
    pub ports: BTreeMap<MemberRef, Value>,
}

/// A component as it can be observed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ComponentSnapshot {
    /// Its type.
    #[serde(rename = "type")]
    pub ty: TypeName,
    /// Its run state.
    pub state: RunState,
    /// All its properties.
    pub properties: BTreeMap<Ident, Value>,
    /// Its activity, if it has one.
    pub activity: Option<Ident>,
}

fn as_list<S: serde::Serializer>(
    connections: &BTreeMap<(MemberRef, MemberRef), Policy>,
    s: S,
) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Connection<'a> {
        from: &'a MemberRef,
        to: &'a MemberRef,
        policy: &'a Policy,
    }
    s.collect_seq(connections.iter().map(|((from, to), policy)| Connection { from, to, policy }))
}

impl Snapshot {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.components.is_empty() && self.connections.is_empty() && self.ports.is_empty()
    }
}

/// What an activity did so far.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ActivityStatus {
    /// Its name.
    pub name: Ident,
    /// Its period; none: event-driven.
    #[serde(rename = "period_s", serialize_with = "seconds_if_any")]
    pub period: Option<Duration>,
    /// Components created in it.
    pub components: usize,
    /// Components that run.
    pub running: usize,
    /// Rounds of updates begun.
    pub cycles: u64,
    /// Periods that were missed because a round took too long.
    pub overruns: u64,
    /// How late the last round began.
    #[serde(rename = "latency_last_s", serialize_with = "seconds")]
    pub latency_last: Duration,
    /// How late a round began at most.
    #[serde(rename = "latency_max_s", serialize_with = "seconds")]
    pub latency_max: Duration,
    /// How long the last round took.
    #[serde(rename = "duration_last_s", serialize_with = "seconds")]
    pub duration_last: Duration,
    /// How long a round took at most.
    #[serde(rename = "duration_max_s", serialize_with = "seconds")]
    pub duration_max: Duration,
    /// The component whose update or operation has been running for longer than a second.
    pub stuck: Option<ComponentName>,
    /// What the operating system refused: a priority, a CPU.
    pub complaint: Option<String>,
}

fn seconds<S: serde::Serializer>(duration: &Duration, s: S) -> Result<S::Ok, S::Error> {
    s.serialize_f64(duration.as_secs_f64())
}

#[allow(clippy::ref_option)]
fn seconds_if_any<S: serde::Serializer>(duration: &Option<Duration>, s: S) -> Result<S::Ok, S::Error> {
    duration.as_ref().map(Duration::as_secs_f64).serialize(s)
}
