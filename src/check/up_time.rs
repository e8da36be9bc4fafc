//! What is there while a deployment is up: from where its coordinators have come up until they hear the event that ends it, through
//! whatever modes that leads.

use super::bound::Bound;
use super::driven::driven_by;
use super::edges::Edge;
use super::explore::Graph;
use super::state::Move;
use super::systems::SystemId;
use crate::model::{Ask, ConfigId, EventName, MemberRef};
use crate::system::{System, View};
use rustc_hash::FxHashSet;

/// Where one of these cut something off, what is asked for there may be missing.
const CUTS: [Bound; 3] = [Bound::Piled, Bound::Inbox, Bound::Forks];

impl Graph<'_, '_> {
    /// Those of these in-ports that are there while the deployment is up, and that nothing drives in any state then. None where not
    /// all of it was followed, or it never is up.
    pub(super) fn undriven_while_up(&self, ports: &[MemberRef]) -> Option<FxHashSet<MemberRef>> {
        let whole = !self.is_cut_off() && !CUTS.iter().any(|bound| self.bounds.contains_key(bound));
        if !whole || self.product.others || !self.product.deployment.subsystems.is_empty() {
            return None;
        }
        let up: Vec<u32> = (0u32..).take(self.states.len()).filter(|at| self.is_up(*at)).collect();
        if up.is_empty() {
            return None;
        }
        let goes_on = |_: usize, edge: &Edge| !self.ends_it(self.by(edge));
        let while_up = self.spread_from(up, goes_on);
        let mut left: Vec<(MemberRef, bool)> = ports.iter().map(|port| (*port, false)).collect();
        let (mut met, mut asked) = (FxHashSet::<SystemId>::default(), FxHashSet::<ConfigId>::default());
        for (state, _) in self.states.iter().zip(while_up).filter(|(_, while_up)| *while_up) {
            if left.is_empty() {
                break;
            }
            match self.product.worlds.get(state.world) {
                Some(world) if met.insert(self.product.worlds.system(state.world)) => {
                    left.retain_mut(|(port, there)| match is_driven(*port, &world.system) {
                        Some(driven) => {
                            *there = true;
                            !driven
                        }
                        None => true,
                    });
                }
                Some(_) => {}
                // What is asked for where nothing is known may be done.
                None => {
                    asked.extend(state.desk.requests().chain(state.safe.iter()).filter_map(
                        |request| match request.ask {
                            Ask::Apply(id) => Some(id),
                            _ => None,
                        },
                    ))
                }
            }
        }
        let asked = self.product.deployment.configurations.iter().filter(|c| asked.contains(&c.id));
        let driven = driven_by(asked);
        Some(left.into_iter().filter(|(port, there)| *there && !driven.contains(port)).map(|(port, _)| port).collect())
    }

    /// Whether the event that ends the deployment comes, or is heard.
    fn ends_it(&self, by: Move) -> bool {
        let shutdown: EventName = self.product.deployment.shutdown.event;
        match by {
            Move::Event(at) => self.product.outside[usize::from(at)] == shutdown,
            Move::Taken(number, event) => self.product.members[usize::from(number)].name_of(event) == Some(shutdown),
            _ => false,
        }
    }
}

/// Whether an in-port is connected or was written; none: there is no such port.
fn is_driven(port: MemberRef, system: &System) -> Option<bool> {
    let node = system.component(port.component)?;
    let (at, _) = node.port(port.member)?;
    Some(system.driven(port).links > 0 || node.written(at).is_some())
}
