//! The observable system as plain data: what a platform reports, what is printed, compared and saved.

use super::configuration::Policy;
use super::names::{ComponentName, Ident, MemberRef, TypeName};
use super::run_state::RunState;
use super::value::Value;
use serde::Serialize;
use std::collections::BTreeMap;

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
