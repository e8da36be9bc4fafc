//! Where a parent waits for people, since an emergency holds one of its subsystems: its time stands still as where something safe of its own
//! is in force, and the event that ends it is raised once more.

use super::explore::Graph;
use super::state::Move;
use super::stops_below::StopBelow;
use crate::model::{Deployment, EventName, Ident};

impl Graph<'_, '_> {
    /// Where it has heard an event of safety that is given on to a subsystem which may be there, or that one is stopped, and waits since then.
    pub(super) fn waits_below(&self) -> Vec<bool> {
        let given = self.heard_below();
        let mut waits = vec![false; self.states.len()];
        if given.is_empty() {
            return waits;
        }
        let holds = |at: u16, to: u32| {
            let there = self.product.children_up(&self.states[to as usize]);
            let mut there = there.flat_map(|child| given.iter().filter(|(path, _)| *path == child.path));
            there.any(|(_, events)| self.product.alike_to(at).any(|name| events.contains(&name)))
        };
        let heard = self.edges.iter().filter(|edge| self.states[edge.from as usize].stopping && !edge.dropped());
        let heard = heard.filter(|edge| matches!(self.by(edge), Move::Event(at) if holds(at, edge.to)));
        let mut open: Vec<u32> = heard.map(|edge| edge.to).filter(|at| self.states[*at as usize].stopping).collect();
        // As long as its coordinator stays where it is.
        while let Some(at) = open.pop() {
            if std::mem::replace(&mut waits[at as usize], true) {
                continue;
            }
            let stays = |to: u32| {
                self.states[to as usize].stopping && self.states[to as usize].leaves == self.states[at as usize].leaves
            };
            let outgoing = self.outgoing().of(at).iter().map(|number| self.edges[*number as usize].to);
            open.extend(outgoing.filter(|to| stays(*to)));
        }
        waits
    }

    /// The events of safety that are given on to each subsystem in which they make something safe, and what it tells where it is stopped alone.
    fn heard_below(&self) -> Vec<(Ident, Vec<EventName>)> {
        let deployment = self.product.deployment;
        let heard = deployment.subsystems.iter().map(|subsystem| {
            let events = deployment.safety.iter().map(|(event, _)| *event);
            let given = events.filter(|event| makes_safe(&subsystem.own, *event));
            let alone = StopBelow::alone(subsystem).into_iter().flat_map(|stop| stop.heard);
            (subsystem.name, given.chain(alone).collect::<Vec<_>>())
        });
        heard.filter(|(_, events)| !events.is_empty()).collect()
    }
}

/// Whether something safe may come of an event of safety there, or in something in it.
fn makes_safe(own: &Deployment, event: EventName) -> bool {
    let here = own.safety.iter().any(|(its, _)| *its == event) && own.configurations.iter().any(|of| of.safe);
    here || own.subsystems.iter().any(|inner| makes_safe(&inner.own, event))
}
