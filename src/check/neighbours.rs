//! What is around a file that is followed alone: the parent of its deployment, as far as the two have to do with each other, and its own
//! subsystems, as far as these show what they do.

use super::automaton::InterfaceAutomaton;
use crate::model::{Deployment, EventName, Ident, Subsystem};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What a parent and a subsystem have to do with each other. Events have the names of the subsystem's own file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ParentInterface {
    /// What the parent raises of what it accepts.
    pub raises: BTreeSet<EventName>,
    /// What it raises for each of those that are followed as one.
    pub raises_for_all: BTreeSet<EventName>,
    /// What the parent waits for of what it tells.
    pub hears: BTreeSet<EventName>,
    /// The deployment that all of it is declares events of safety: while it is being stopped all others from outside are refused, those of subsystems
    /// too.
    pub closes: bool,
}

/// What is around a file.
#[derive(Debug, Default)]
pub struct Neighbours {
    /// Its parent; none: it has none, or that is not looked at.
    pub parent: Option<ParentInterface>,
    /// What its subsystems show, by their names. One that is not here may tell anything in any order.
    pub children: BTreeMap<Ident, Arc<InterfaceAutomaton>>,
    /// Subsystems that are the same but for values.
    pub alike: Vec<Vec<Ident>>,
    /// Another file that is the same but for values is followed.
    pub stands_for: bool,
}

impl ParentInterface {
    /// What the coordinators of a file raise and hear of subsystems that are followed once.
    pub fn of<'s>(own: &Deployment, closes: bool, subsystems: impl IntoIterator<Item = &'s Subsystem>) -> Self {
        let mut interface = Self { closes, ..Self::default() };
        for (at, alike) in subsystems.into_iter().enumerate() {
            let local = |event: EventName| EventName::new(event.local(alike.name)?).ok();
            for chart in own.charts() {
                interface.hears.extend(chart.waited_for().into_iter().filter_map(local));
            }
            let raised = accepted(alike).into_iter();
            let raised = raised.filter(|event| own.charts().any(|chart| chart.raises(event.as_str())));
            let raised: BTreeSet<EventName> = raised.filter_map(local).collect();
            interface.raises_for_all = match at {
                0 => raised.clone(),
                _ => interface.raises_for_all.intersection(&raised).copied().collect(),
            };
            interface.raises.extend(raised);
        }
        interface
    }
}

/// The events that a parent may raise, by their names there.
pub fn accepted(subsystem: &Subsystem) -> BTreeSet<EventName> {
    let own = &*subsystem.own;
    let accepts = own.interface.accepts.iter().map(|(event, _)| *event);
    accepts.chain([own.deploy.event, own.shutdown.event]).map(|event| event.within(subsystem.name)).collect()
}
