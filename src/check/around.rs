//! What is around a file that is followed alone: the parent of its deployment, as far as the two have to do with each other, and its own
//! subsystems, as far as these show what they do.

use super::automaton::InterfaceAutomaton;
use super::belief::Beliefs;
use super::derived::ParentInterface;
use super::effort::Left;
use super::product::Product;
use crate::limits;
use crate::model::{Deployment, EventName, Ident, Subsystem};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What is around a file.
#[derive(Debug, Default)]
pub struct Around {
    /// Its parent; none: it has none, or that is not looked at.
    pub parent: Option<ParentInterface>,
    /// What its subsystems show, by their names. One that is not here may tell anything in any order.
    pub children: BTreeMap<Ident, Arc<InterfaceAutomaton>>,
}

impl ParentInterface {
    /// What the coordinators of a file raise and hear of a subsystem, and of those that are of the same file: all are followed once.
    pub fn of(own: &Deployment, subsystem: &Subsystem) -> Self {
        let mut interface = Self::default();
        for alike in own.subsystems.iter().filter(|other| Arc::ptr_eq(&other.own, &subsystem.own)) {
            let local = |event: EventName| EventName::new(event.local(alike.name)?).ok();
            for chart in own.charts() {
                interface.hears.extend(chart.waited_for().into_iter().filter_map(local));
            }
            let raised = super::composed::accepted(alike).into_iter();
            let raised = raised.filter(|event| own.charts().any(|chart| chart.raises(event.as_str())));
            interface.raises.extend(raised.filter_map(local));
        }
        interface
    }
}

impl<'a> Product<'a> {
    /// This is around the deployment.
    pub(super) fn stands_in(&mut self, around: &Around) {
        self.parent = around.parent.clone();
        for child in &mut self.children {
            let local = |event: &EventName| EventName::new(event.local(child.path)?).ok();
            let heard: BTreeSet<EventName> = self.outside.iter().filter_map(local).collect();
            let raised = self.members.iter().flat_map(|member| member.chart.raises());
            let raised: BTreeSet<EventName> = raised.filter_map(|site| local(&site.name)).collect();
            let of = self.deployment.subsystems.iter().find(|subsystem| subsystem.name == child.path);
            let Some((of, automaton)) = of.zip(around.children.get(&child.path)) else { continue };
            let takes = raised.into_iter().map(|event| (event, of.own.precedence(event))).collect();
            child.beliefs = Some(Beliefs::new(automaton.clone(), takes, heard));
        }
    }

    /// Whether it is known of a subsystem what it may tell.
    pub(super) fn knows_children(&self) -> bool {
        self.children.iter().any(|child| child.beliefs.is_some())
    }

    /// From now on they may tell anything in any order.
    pub(super) fn forget_children(&mut self) {
        self.children.iter_mut().for_each(|child| child.beliefs = None);
    }

    /// How much is followed while what is known of subsystems makes more of it.
    pub(super) fn most_believed(&self) -> Left<'a> {
        match self.knows_children() {
            true => self.effort.at_most(limits::CHECK_BELIEVED),
            false => self.effort.at_most(usize::MAX),
        }
    }
}
