//! Components that were reported faulted: looked at, since the report may be older than what was done since.

use super::inbox::{PoolReply, PoolTicket};
use super::pool::{CallFor, PlatformCall, Pool};
use crate::limits;
use crate::model::{ComponentName, RunState};
use crate::system::{System, View as _};
use crate::time::Time;
use rustc_hash::FxHashSet;
use std::time::Duration;

/// Whether a component came back from a call that had never returned, and what is broken may be mended since.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CameBack {
    /// None has.
    Nobody,
    /// One has, and what is under way is about it, or about what is to be done to it: when that has ended it is looked at.
    Later,
    /// It is looked at now.
    Now,
}

/// A look at a component that was reported faulted.
struct SuspectLook {
    ticket: PoolTicket,
    component: ComponentName,
    /// When the model had touched it last: what is done to it meanwhile makes the look stale.
    generation: Option<u64>,
    until: Time,
}

/// Components that were reported faulted and not looked at since, and looks that are under way.
#[derive(Default)]
pub(super) struct Suspects {
    reported: Vec<ComponentName>,
    looks: Vec<SuspectLook>,
    /// Of those, the ones whose fault was reported: they are shown so, while what is under way with them keeps anybody from looking.
    faulted: FxHashSet<ComponentName>,
}

impl Suspects {
    /// A component is said to be faulted, or to have come back.
    pub fn report(&mut self, component: ComponentName) {
        self.reported.push(component);
    }

    /// A component has said that it is faulted.
    pub fn report_fault(&mut self, component: ComponentName) {
        self.report(component);
        self.faulted.insert(component);
    }

    /// Those of whom the model does not know yet that they are faulted.
    pub fn faulted(&self) -> impl Iterator<Item = ComponentName> + '_ {
        self.faulted.iter().copied()
    }

    /// Reports were lost: anything may be faulted.
    pub fn report_all(&mut self, system: &System) {
        self.reported.clear();
        self.reported.extend(system.graph().node_weights().map(|node| node.name));
    }

    /// Components that were not looked at yet.
    pub fn reported(&self) -> impl Iterator<Item = ComponentName> + '_ {
        self.reported.iter().copied()
    }

    /// Whether nobody is to be looked at, nor is being looked at.
    pub fn is_empty(&self) -> bool {
        self.reported.is_empty() && self.looks.is_empty()
    }

    /// When something must be looked at again, if nothing comes; none: no look is under way.
    pub fn until(&self) -> Option<Time> {
        self.looks.iter().map(|look| look.until).min()
    }

    /// Takes in what was seen, and begins to look at who is not `busy`: what is being worked on is looked at by whoever works
    /// on it, or afterwards. Answers whether the model has changed.
    pub fn look(
        &mut self,
        system: &mut System,
        pool: &mut Pool,
        busy: impl FnOnce() -> FxHashSet<ComponentName>,
        now: Time,
        timeout: Duration,
    ) -> bool {
        let mut changed = false;
        let mut at = 0;
        while at < self.looks.len() {
            let SuspectLook { ticket, component, generation, until } = self.looks[at];
            let seen = match pool.take(ticket) {
                Some(PoolReply::ObservedComponent(Ok(seen))) => seen,
                Some(_) => None,
                None if now >= until => {
                    pool.give_up(ticket);
                    None
                }
                None => {
                    at += 1;
                    continue;
                }
            };
            self.looks.remove(at);
            let faulted = seen.is_some_and(|seen| seen.state == RunState::Faulted);
            changed |= self.faulted.remove(&component);
            if faulted && generation_of(system, component) != generation {
                self.reported.push(component);
            } else if faulted {
                changed |= system.set_state(component, RunState::Faulted);
            }
        }
        if self.reported.is_empty() {
            return changed;
        }
        let busy = busy();
        let mut later = Vec::new();
        while let Some(component) = self.reported.pop() {
            if self.looks.iter().any(|look| look.component == component) {
                continue;
            }
            if busy.contains(&component) || !pool.has_room_beside(1) {
                later.push(component);
                continue;
            }
            let deadline = now + timeout;
            let ticket = pool.start(PlatformCall::ObserveComponent(component), deadline, CallFor::Plain);
            let until = deadline + limits::PLATFORM_GRACE;
            self.looks.push(SuspectLook { ticket, component, generation: generation_of(system, component), until });
        }
        self.reported = later;
        changed
    }
}

/// When the model has touched a component last.
pub(super) fn generation_of(system: &System, component: ComponentName) -> Option<u64> {
    system.component(component).map(|node| node.generation)
}
