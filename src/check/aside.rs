//! What may be set aside where undos fail one after the other ([`undo_failed`](super::undo_failed)).

use super::coordinator::ask_of;
use super::members::Member;
use crate::model::{Ask, ChangeKind, ComponentName, ConfigId, Configuration, Deployment, MemberRef, StateList};
use crate::stack::claims;
use crate::statechart::RaiseSite;
use rustc_hash::{FxHashMap, FxHashSet};

/// What may be set aside.
#[derive(Default)]
pub(super) struct Aside {
    ids: FxHashSet<ConfigId>,
}

impl Aside {
    /// Those of a deployment's configurations that states bring with them (`config`), so that a frame of theirs whose undo has failed is
    /// told from one that is in force, and of which nothing else depends in a plan: they change values, call operations and make
    /// connections to ports that no other one connects or writes, leave run states as they are, and stand for nothing that is watched,
    /// confirmed or replaced. None, where somebody undoes whatever is the newest, or frames have to be told apart by their places.
    pub fn of(deployment: &Deployment, members: &[Member<'_>], losable: &[(ConfigId, bool)]) -> Self {
        let configurations = &deployment.configurations;
        let by_place = |ask: Option<Ask>| matches!(ask, Some(Ask::Undo | Ask::UndoTo(_)));
        let sites = || members.iter().flat_map(|member| member.chart.raises());
        if sites().any(|site| by_place(ask_of(deployment, site.name)))
            || configurations.iter().any(|c| c.confirm.is_some())
        {
            return Self::default();
        }
        let mut users: FxHashMap<MemberRef, usize> = FxHashMap::default();
        let mut replaced: FxHashSet<ComponentName> = FxHashSet::default();
        for configuration in configurations {
            let ports: FxHashSet<MemberRef> = ports(configuration).collect();
            ports.into_iter().for_each(|port| *users.entry(port).or_default() += 1);
            replaced.extend(configuration.changes.iter().filter_map(|change| match &change.kind {
                ChangeKind::Replace { component, .. } => Some(*component),
                _ => None,
            }));
        }
        let scoped = |configuration: &Configuration| {
            let asks = |site: &&RaiseSite| ask_of(deployment, site.name) == Some(Ask::Apply(configuration.id));
            sites().filter(asks).all(|site| site.scoped)
        };
        let watched = |configuration: &Configuration| {
            configuration.holds.is_some() || losable.iter().any(|(id, _)| *id == configuration.id)
        };
        let plain = |c: &&Configuration| {
            let own = ports(c).all(|port| users[&port] == 1)
                && claims::components(c).iter().all(|component| !replaced.contains(component));
            own && scoped(c) && !watched(c) && !c.safe && c.group.is_none() && leaves_structure(c)
        };
        Self { ids: configurations.iter().filter(plain).map(|c| c.id).collect() }
    }

    /// How many configurations there are whose frames may be.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// Configurations whose frames may be set aside.
    pub fn ids(&self) -> impl Iterator<Item = ConfigId> + '_ {
        self.ids.iter().copied()
    }

    /// Whether the frames of a configuration may be set aside.
    pub fn may(&self, id: ConfigId) -> bool {
        self.ids.contains(&id)
    }
}

/// In-ports that a configuration connects, disconnects or writes.
fn ports(configuration: &Configuration) -> impl Iterator<Item = MemberRef> + '_ {
    configuration.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::Connect { to, .. } | ChangeKind::Disconnect { to, .. } => Some(*to),
        ChangeKind::PortWrite { port, .. } => Some(*port),
        _ => None,
    })
}

/// Whether a configuration changes nothing but values and connections: components and run states stay as they are.
fn leaves_structure(configuration: &Configuration) -> bool {
    use ChangeKind::{Connect, Disconnect, OperationCall, PortWrite, PropertySet};
    let changes = configuration.changes.iter().all(|change| {
        let kind = &change.kind;
        matches!(
            kind,
            PropertySet { .. } | PortWrite { .. } | OperationCall { .. } | Connect { .. } | Disconnect { .. }
        )
    });
    let states = |list: &StateList| list.iter().map(|entry| (entry.target, entry.state)).collect::<FxHashSet<_>>();
    changes && states(&configuration.pre) == states(&configuration.post)
}
