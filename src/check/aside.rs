//! What may be set aside where undos fail one after the other ([`undo_failed`](super::undo_failed)).

use super::coordinator::ask_of;
use super::members::Member;
use crate::model::{Ask, ChangeKind, ConfigId, Configuration, Deployment, MemberRef};
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
        for configuration in configurations {
            let ports: FxHashSet<MemberRef> = ports(configuration).collect();
            ports.into_iter().for_each(|port| *users.entry(port).or_default() += 1);
        }
        let alone = |configuration: &Configuration| ports(configuration).all(|port| users[&port] == 1);
        let plain =
            |configuration: &Configuration| {
                let makes = |kind: &ChangeKind| matches!(kind, ChangeKind::Create { .. } | ChangeKind::Destroy { .. });
                let stays = configuration.post.iter().all(|post| {
                    configuration.pre.iter().any(|pre| (pre.target, pre.state) == (post.target, post.state))
                });
                let brought = configuration.pre.iter().all(|pre| {
                    configuration.post.iter().any(|post| (pre.target, pre.state) == (post.target, post.state))
                });
                let asks = |site: &&RaiseSite| ask_of(deployment, site.name) == Some(Ask::Apply(configuration.id));
                let scoped = sites().filter(asks).all(|site| site.scoped);
                scoped
                    && !configuration.safe
                    && configuration.group.is_none()
                    && configuration.holds.is_none()
                    && losable.iter().all(|(id, _)| *id != configuration.id)
                    && !configuration.changes.iter().any(|change| makes(&change.kind))
                    && stays
                    && brought
            };
        Self { ids: configurations.iter().filter(|c| plain(c) && alone(c)).map(|c| c.id).collect() }
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
