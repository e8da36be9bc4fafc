//! What is known of the subsystems of the deployment that is followed.

use super::belief::{Beliefs, MOST_UNTAKEN};
use super::effort::Left;
use super::neighbours::{Neighbours, accepted};
use super::product::Product;
use crate::model::EventName;
use std::collections::BTreeSet;

impl<'a> Product<'a> {
    /// It is part of another deployment.
    pub(super) fn is_part_of(&mut self, around: &Neighbours) {
        self.parent = around.parent.clone();
        if self.parent.as_ref().is_some_and(|parent| parent.closes) {
            self.from_outside = self.known_outside();
        }
    }

    /// This is around the deployment; of each subsystem is known what it may tell where so many events lie untaken in its inbox.
    pub(super) fn stands_in(&mut self, around: &Neighbours, most_untaken: usize) {
        self.is_part_of(around);
        for child in &mut self.children {
            let local = |event: &EventName| EventName::new(event.local(child.path)?).ok();
            let heard: BTreeSet<EventName> = self.outside.iter().filter_map(local).collect();
            let raised = self.members.iter().flat_map(|member| member.chart.raises());
            let raised: BTreeSet<EventName> = raised.filter_map(|site| local(&site.name)).collect();
            let of = self.deployment.subsystems.iter().find(|subsystem| subsystem.name == child.path);
            let Some((of, automaton)) = of.zip(around.children.get(&child.path)) else { continue };
            let charts = || self.deployment.charts();
            let raised_by_some = |event: &EventName| charts().any(|chart| chart.raises(event.as_str()));
            let others = accepted(of).into_iter().filter(raised_by_some).filter_map(|event| local(&event));
            let others = others.filter(|event| !raised.contains(event)).collect();
            let takes = raised.into_iter().map(|event| (event, of.own.precedence(event))).collect();
            child.beliefs = Some(Beliefs::new(automaton.clone(), most_untaken, takes, others, heard));
        }
    }

    /// Whether it is known of a subsystem what it may tell.
    pub(super) fn knows_children(&self) -> bool {
        self.children.iter().any(|child| child.beliefs.is_some())
    }

    /// Whether nothing is known of the order in which one of them tells things.
    pub(super) fn knows_no_order(&self) -> bool {
        self.children.iter().any(|child| child.beliefs.is_none())
    }

    /// Whether it is not known what comes of what is raised again before a subsystem tells something: it may lead on where nothing does here.
    pub(super) fn knows_less(&self) -> bool {
        let mut known = self.children.iter().filter_map(|child| child.beliefs.as_ref());
        known.any(|beliefs| beliefs.most_untaken() < MOST_UNTAKEN)
    }

    /// Whether more was raised for one of them than is followed before it takes it.
    pub(super) fn fills_children(&self) -> bool {
        let mut known = self.children.iter().filter_map(|child| child.beliefs.as_ref());
        known.any(Beliefs::was_filled)
    }

    /// What it has taken to know what they may tell, in transitions.
    pub(super) fn known_by(&self) -> usize {
        self.children.iter().filter_map(|child| child.beliefs.as_ref()).map(Beliefs::work).sum()
    }

    /// From now on they may tell anything in any order.
    pub(super) fn forget_children(&mut self) {
        self.children.iter_mut().for_each(|child| child.beliefs = None);
    }

    /// How much is followed while what is known of subsystems makes more of it.
    pub(super) fn most_believed(&self) -> Left<'a> {
        match self.knows_children() {
            true => self.effort.at_most(self.effort.believed()),
            false => self.effort.at_most(usize::MAX),
        }
    }
}
