//! Groups of coordinators that are the same but for names: what follows from one of them follows from the other.
//!
//! Two are so where exchanging the names of the one for those of the other leaves the deployment as it is, but for the order in which it is written
//! and for values ([`alike`](super::alike)). Then every way of the one is a way of the other, by the names there, and nothing is found on the one that is
//! not found on the other. What has no such counterpart (a text, a resource that two subsystems may hold) makes them two.

use super::alike::is_alike;
use super::coordinator::ask_of;
use super::neighbours::{Neighbours, ParentInterface};
use crate::model::naming::Naming;
use crate::model::{
    Ask, Catalogue, ComponentName, ComponentType, ConfigId, Configuration, Deployment, EventName, Ident, Monitor,
    Subsystem, TypeName,
};
use crate::stack::contenders::may_hold;
use crate::statechart::Chart;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The words of one group by those of another one, and the other way round. What stands behind a point (a verdict, a member), and what is called so in
/// the file of a subsystem, is the same for both.
#[derive(Debug, Clone, Default)]
pub struct Exchange {
    words: BTreeMap<String, String>,
    subsystems: BTreeSet<Ident>,
}

/// Where groups are compared.
pub struct Exchanging<'a> {
    /// The deployment, and its coordinators compiled.
    pub deployment: &'a Deployment,
    pub charts: &'a [&'a Chart],
    pub catalogue: &'a Catalogue,
    pub around: &'a Neighbours,
}

impl Exchanging<'_> {
    /// What leads from one group to the other, if they are the same but for names.
    pub fn between(&self, one: &[usize], other: &[usize]) -> Option<Exchange> {
        let own = self.deployment;
        if one.len() != other.len() || !own.programs.is_empty() {
            return None;
        }
        let subsystems = own.subsystems.iter().map(|subsystem| subsystem.name).collect();
        let own_words = ["root", "e_done"].map(|word| (word.to_owned(), word.to_owned()));
        let mut exchange = Exchange { words: own_words.into(), subsystems };
        let (names, others) = (self.names(one), self.names(other));
        let fits = names.len() == others.len() && names.iter().zip(&others).all(|(a, b)| exchange.pair(a, b));
        if !fits {
            return None;
        }
        // What nobody asks for is found by what it is.
        let id = |of: &mut Configuration, id| of.id = id;
        exchange.find(&own.configurations, |of, by| by.configuration(of), |of| of.id, id, |id| id.as_str())?;
        let name = |of: &mut Monitor, name| of.name = name;
        exchange.find(&own.monitors, |of, by| by.monitor(of), |of| of.name, name, |name| name.as_str())?;
        self.is_kept(&exchange).then_some(exchange)
    }

    /// The names in a group, in the order of its charts.
    fn names(&self, group: &[usize]) -> Vec<String> {
        let names = NamesMet::default();
        let mut asked: Vec<ConfigId> = Vec::new();
        for number in group {
            let coordinator = &self.deployment.coordinators[*number];
            names.note(coordinator.name.as_str());
            names.chart(&mut coordinator.chart.clone());
            for site in self.charts[*number].raises() {
                if let Some(Ask::Apply(id) | Ask::UndoOf(id)) = ask_of(self.deployment, site.name)
                    && !asked.contains(&id)
                {
                    asked.push(id);
                }
            }
        }
        for id in asked {
            self.deployment.configuration(id).into_iter().for_each(|of| _ = names.configuration(of));
        }
        names.0.into_inner()
    }

    /// Whether the deployment is the same with these names exchanged.
    fn is_kept(&self, exchange: &Exchange) -> bool {
        let mut own = untold(self.deployment);
        let mut other = exchange.deployment(&own);
        let subsystems = std::mem::take(&mut own.subsystems);
        other.subsystems.clear();
        self.are_kept(&subsystems, exchange)
            && self.types_are_kept(exchange)
            && self.around.parent.as_ref().is_none_or(|parent| is_kept(parent, exchange))
            && is_alike(&own, &other, self.catalogue)
    }

    /// Whether each subsystem is what the one is in whose place it comes, and none of them may hold what another one may.
    fn are_kept(&self, subsystems: &[Subsystem], exchange: &Exchange) -> bool {
        let held = may_hold(self.deployment.configurations.iter(), self.catalogue);
        if subsystems.iter().any(|subsystem| held.values().any(|names| !names.is_disjoint(&subsystem.holds))) {
            return false;
        }
        let apart = |one: &Subsystem| {
            let others = subsystems.iter().filter(|other| other.name != one.name);
            one.holds.is_empty() || others.into_iter().all(|other| other.holds.is_disjoint(&one.holds))
        };
        let kept = |one: &Subsystem| {
            let name = exchange.name(one.name);
            let Some(other) = subsystems.iter().find(|other| other.name == name) else { return false };
            let shows = [one, other].map(|of| self.around.children.get(&of.name));
            let same = match shows {
                [Some(one), Some(other)] => Arc::ptr_eq(one, other),
                [None, None] => true,
                _ => false,
            };
            let activities = |(own, of): (&Ident, &Ident)| (*own, exchange.activity(*of));
            let files = || self.around.alike.iter().any(|names| names.contains(&one.name) && names.contains(&name));
            let moves = name != one.name;
            !moves
                || same && files() && apart(one) && one.activities.iter().map(activities).eq(copied(&other.activities))
        };
        subsystems.iter().all(kept)
    }

    /// Whether what is made is made as what has the same members.
    fn types_are_kept(&self, exchange: &Exchange) -> bool {
        let changes = self.deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
        let made = changes.filter_map(|change| change.kind.makes()).map(|(_, ty, _)| ty);
        let bare =
            |ty: &Arc<ComponentType>, name: TypeName| ComponentType { name, doc: String::new(), ..(**ty).clone() };
        made.filter(|ty| exchange.ty(*ty) != *ty).all(|ty| {
            let [one, other] = [ty, exchange.ty(ty)].map(|ty| self.catalogue.get(ty));
            matches!((one, other), (Some(one), Some(other)) if bare(one, ty) == bare(other, ty))
        })
    }
}

/// A deployment without what is said of it in words.
fn untold(of: &Deployment) -> Deployment {
    let mut own = of.clone();
    own.configurations.iter_mut().for_each(|configuration| configuration.description = None);
    own.monitors.iter_mut().for_each(|monitor| monitor.description = None);
    own.key_origins.clear();
    own
}

fn copied(activities: &BTreeMap<Ident, Ident>) -> impl Iterator<Item = (Ident, Ident)> {
    activities.iter().map(|(own, of)| (*own, *of))
}

/// Whether a parent has to do with one in the same way as with the other.
fn is_kept(parent: &ParentInterface, exchange: &Exchange) -> bool {
    let kept = |events: &BTreeSet<EventName>| events.iter().all(|event| events.contains(&exchange.event(*event)));
    [&parent.raises, &parent.raises_for_all, &parent.hears].into_iter().all(kept)
}

/// A text in words and what stands between them.
fn tokens(text: &str) -> impl Iterator<Item = &str> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut rest = text;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let end = if is_word(first) { rest.find(|c| !is_word(c)).unwrap_or(rest.len()) } else { first.len_utf8() };
        let (token, after) = rest.split_at(end);
        rest = after;
        Some(token)
    })
}

impl Exchange {
    /// A name in what is exchanged of it, and the rest.
    fn parts<'n>(&self, name: &'n str) -> (&'n str, &'n str) {
        let end = name.find('.').unwrap_or(name.len());
        let of_subsystem =
            name[..end].find('/').filter(|at| self.subsystems.iter().any(|of| of.as_str() == &name[..*at]));
        name.split_at(of_subsystem.unwrap_or(end))
    }

    /// One name comes in the place of the other. False: it cannot, as that of another one comes there.
    fn pair(&mut self, one: &str, other: &str) -> bool {
        let ((one, rest), (other, others)) = (self.parts(one), self.parts(other));
        if rest != others {
            return false;
        }
        let (mut a, mut b) = (tokens(one), tokens(other));
        loop {
            match (a.next(), b.next()) {
                (None, None) => return true,
                (Some(a), Some(b)) => {
                    let known = |words: &BTreeMap<String, String>, of: &str, as_: &str| {
                        words.get(of).is_none_or(|known| known == as_)
                    };
                    if !known(&self.words, a, b) || !known(&self.words, b, a) {
                        return false;
                    }
                    self.words.insert(a.to_owned(), b.to_owned());
                    self.words.insert(b.to_owned(), a.to_owned());
                }
                _ => return false,
            }
        }
    }

    /// Finds what comes in the place of those that change and have no counterpart yet, by all but their names. None: there is no way.
    fn find<T: Clone + PartialEq, N: Copy + PartialEq>(
        &mut self,
        all: &[T],
        exchanged: impl Fn(&T, &Self) -> T,
        name: impl Fn(&T) -> N,
        rename: impl Fn(&mut T, N),
        text: impl Fn(&N) -> &str,
    ) -> Option<()> {
        for of in all {
            let mut other = exchanged(of, self);
            if name(&other) != name(of) || other == *of {
                continue;
            }
            let counterpart = all.iter().find(|candidate| {
                rename(&mut other, name(candidate));
                other == **candidate
            })?;
            self.pair(text(&name(of)), text(&name(counterpart))).then_some(())?;
        }
        Some(())
    }

    fn text(&self, text: &str) -> String {
        let (own, rest) = self.parts(text);
        let own = tokens(own).map(|token| self.words.get(token).map_or(token, String::as_str));
        own.chain([rest]).collect()
    }

    /// The name that `make` makes of the text with words exchanged; the same where that is none.
    fn named<N: Copy, E>(&self, name: N, text: &str, make: impl Fn(&str) -> Result<N, E>) -> N {
        make(&self.text(text)).unwrap_or(name)
    }

    /// A deployment with names exchanged, in the order of the names in the one that it is of.
    fn deployment(&self, of: &Deployment) -> Deployment {
        let mut other = of.clone();
        other.configurations = of.configurations.iter().map(|of| self.configuration(of)).collect();
        in_order(&of.configurations, &mut other.configurations, |of| of.id);
        for coordinator in &mut other.coordinators {
            coordinator.name = self.name(coordinator.name);
            self.chart(&mut coordinator.chart);
        }
        in_order(&of.coordinators, &mut other.coordinators, |of| of.name);
        other.monitors = of.monitors.iter().map(|of| self.monitor(of)).collect();
        in_order(&of.monitors, &mut other.monitors, |of| of.name);
        other.activities = of.activities.iter().map(|(name, of)| (self.activity(*name), *of)).collect();
        other.operator.iter_mut().for_each(|(may, _)| *may = self.operator(*may));
        in_order(&of.operator, &mut other.operator, |(may, _)| *may);
        let interface = &mut other.interface;
        for (events, theirs) in [
            (&mut other.emits, &of.emits),
            (&mut other.safety, &of.safety),
            (&mut interface.accepts, &of.interface.accepts),
        ] {
            events.iter_mut().for_each(|(event, _)| *event = self.event(*event));
            in_order(theirs, events, |(event, _)| *event);
        }
        interface.exports.values_mut().for_each(|export| export.of = self.member(export.of));
        for event in interface.from.iter_mut().map(|(event, _)| event).chain([&mut other.deploy.event]) {
            *event = self.event(*event);
        }
        if let Some(leaving) = &mut interface.leaving {
            (leaving.says, leaving.until) = (self.event(leaving.says), self.event(leaving.until));
        }
        other.shutdown.event = self.event(of.shutdown.event);
        other.shutdown.rest.iter_mut().for_each(|(id, _)| *id = self.id(*id));
        in_order(&of.shutdown.rest, &mut other.shutdown.rest, |(id, _)| *id);
        other.reactions = of.reactions.iter().map(|of| self.reaction(of)).collect();
        in_order(&of.reactions, &mut other.reactions, |of| (of.after.clone(), of.raise));
        other.faults = of.faults.iter().map(|of| self.fault(of)).collect();
        in_order(&of.faults, &mut other.faults, |of| of.step.clone());
        other
    }
}

/// Puts those of another list in the order of this one.
fn in_order<T, K: PartialEq>(own: &[T], other: &mut [T], key: impl Fn(&T) -> K) {
    let place = |of: &T| own.iter().position(|own| key(own) == key(of));
    other.sort_by_key(place);
}

impl Naming for Exchange {
    fn event(&self, event: EventName) -> EventName {
        self.named(event, event.as_str(), EventName::new)
    }

    fn activity(&self, activity: Ident) -> Ident {
        self.name(activity)
    }

    fn component(&self, component: ComponentName) -> ComponentName {
        self.named(component, component.as_str(), ComponentName::new)
    }

    fn ty(&self, ty: TypeName) -> TypeName {
        self.named(ty, ty.as_str(), TypeName::new)
    }

    fn id(&self, id: ConfigId) -> ConfigId {
        self.named(id, id.as_str(), ConfigId::new)
    }

    fn name(&self, name: Ident) -> Ident {
        self.named(name, name.as_str(), Ident::new)
    }

    fn about(&self, word: &str) -> String {
        self.text(word)
    }
}

/// Notes the names that it meets.
#[derive(Default)]
struct NamesMet(RefCell<Vec<String>>);

impl NamesMet {
    fn note(&self, text: &str) {
        self.0.borrow_mut().push(text.to_owned());
    }
}

impl Naming for NamesMet {
    fn event(&self, event: EventName) -> EventName {
        self.note(event.as_str());
        event
    }

    fn activity(&self, activity: Ident) -> Ident {
        self.name(activity)
    }

    fn component(&self, component: ComponentName) -> ComponentName {
        self.note(component.as_str());
        component
    }

    fn ty(&self, ty: TypeName) -> TypeName {
        self.note(ty.as_str());
        ty
    }

    fn id(&self, id: ConfigId) -> ConfigId {
        self.note(id.as_str());
        id
    }

    fn name(&self, name: Ident) -> Ident {
        self.note(name.as_str());
        name
    }

    fn about(&self, word: &str) -> String {
        self.note(word);
        word.to_owned()
    }
}
