//! Whether a parent that waits for a subsystem may wait in vain: a safety event, a fault or a time may have led that one to where it tells nothing by
//! itself any more, and only an event of its parent leads it on.
//!
//! What a subsystem *may* tell is a set: that one of the states which it may be in tells *down* says nothing of the others. So the way down from a state
//! has to do without it there, or raise something for it.

use super::adjacency::Adjacency;
use super::bound::Bound;
use super::children::Child;
use super::edges::Edge;
use super::explore::Graph;
use super::judge::Traced;
use super::members::Member;
use super::product::Product;
use super::reactions::triggers;
use super::state::{Failed, Move};
use crate::limits;
use crate::model::codes::COORD_NO_WAY_DOWN;
use crate::model::{EventName, Finding, Ident};
use crate::statechart::{EventId, NodeId};
use indexmap::IndexSet;
use rustc_hash::{FxBuildHasher, FxHashMap};
use smallvec::SmallVec;

impl Graph<'_, '_> {
    /// One state from which no way leads down where a subsystem is where it was led by something else, of each subsystem.
    pub(super) fn waits_in_vain(&mut self, found: &mut Traced) {
        if self.product.knows_less() {
            return;
        }
        for child in 0..self.product.children.len() {
            let Some(at) = self.waits_in_vain_for(child) else { continue };
            let (product, state) = (&*self.product, &self.states[at as usize]);
            let path = product.children[child].path;
            let message = format!(
                "from {} no way leads down where `{path}` tells nothing more by itself that is heard there: something else than its parent may have led it there meanwhile",
                product.place(state)
            );
            // Who waits for it, of several.
            let waits = |number: &usize| {
                let member = &product.members[*number];
                let mut events = triggers(member.chart, state.leaves[*number]).0.into_iter();
                events.any(|event| member.name_of(event).is_some_and(|name| name.local(path).is_some()))
            };
            let number = (0..product.members.len()).find(waits).unwrap_or_default();
            let (member, leaf) = (&product.members[number], state.leaves[number]);
            let shutdown = product.deployment.shutdown.event;
            let finding = Finding::warning(COORD_NO_WAY_DOWN, message)
                .at(member.chart.origin(leaf))
                .path(format!("coordinator.{}", member.chart.fqn(leaf)))
                .also(product.deployment.key_origin("shutdown.down"), "the state that means down")
                .help(format!(
                    "let an event lead on from there that raises for `{path}` what ends it (`{shutdown}`, with the effect `{}`); or let `{path}` go on by \
                     itself",
                    product.children[child].ends
                ));
            let trace = self.trace(at);
            found.push((finding, trace));
        }
    }

    fn waits_in_vain_for(&mut self, child: usize) -> Option<u32> {
        let path = self.product.children[child].path;
        let tells: Vec<bool> = self.product.outside.iter().map(|event| event.local(path).is_some()).collect();
        let raises = self.raising_for(path, &tells);
        self.product.children[child].beliefs.as_ref()?;
        let belief = |at: u32| self.states[at as usize].beliefs.get(child).copied().unwrap_or_default();
        let told = |edge: &Edge| self.tells_of(edge, &tells).is_some();
        let mut reaches = self.arrives();
        for (reaches, raises) in reaches.iter_mut().zip(raises) {
            *reaches |= raises;
        }
        let others = self.edges.iter().filter(|edge| !told(edge) && belief(edge.from) != belief(edge.to));
        others.for_each(|edge| reaches[edge.from as usize] = true);
        let reaches = self.leading_to(reaches, |_, edge| !told(edge));
        let Some(some) = self.told_in_vain(child, &reaches, &tells) else {
            self.cut(Bound::Vain, Failed::Nothing);
            return None;
        };
        self.best_first(some).first().copied()
    }

    /// What of outside a subsystem tells there, if it does; `tells`: what of that is its.
    fn tells_of(&self, edge: &Edge, tells: &[bool]) -> Option<usize> {
        match self.by(edge) {
            Move::Event(of) | Move::Dropped(of) | Move::Unheard(of) => Some(usize::from(of)).filter(|of| tells[*of]),
            _ => None,
        }
    }

    /// The states from which nothing `reaches`, whatever the subsystem tells from some state of its automaton in which it may be there; none: there are
    /// too many of both to look at.
    fn told_in_vain(&self, child: usize, reaches: &[bool], tells: &[bool]) -> Option<Vec<u32>> {
        let Child { path, beliefs: Some(beliefs), .. } = &self.product.children[child] else { return Some(Vec::new()) };
        let mut pairs: IndexSet<(u32, u32), FxBuildHasher> = IndexSet::default();
        let belief = |at: u32| self.states[at as usize].beliefs.get(child).copied().unwrap_or_default();
        let candidates = (0u32..).zip(&self.states).filter(|(at, state)| {
            !reaches[*at as usize] && state.is_at_rest() && self.failed[*at as usize] == Failed::Nothing
        });
        for (at, _) in candidates {
            pairs.extend(beliefs.may_wait_in(belief(at)).map(|own| (at, own)));
        }
        let candidates = pairs.len();
        let places: FxHashMap<EventName, usize> =
            self.product.outside.iter().enumerate().map(|(place, event)| (*event, place)).collect();
        let (mut leads, mut steps): (Vec<u32>, Vec<(u32, u32)>) = (Vec::new(), Vec::new());
        let mut next = 0;
        while let Some((at, own)) = pairs.get_index(next).copied() {
            if pairs.len() > limits::CHECK_VAIN {
                return None;
            }
            let from = u32::try_from(next).unwrap_or(u32::MAX);
            next += 1;
            let mut then: SmallVec<[(u32, u32); 8]> = SmallVec::new();
            let outgoing = || self.outgoing().of(at).iter().map(|number| &self.edges[*number as usize]);
            then.extend(outgoing().filter(|edge| self.tells_of(edge, tells).is_none()).map(|edge| (edge.to, own)));
            for (event, to) in beliefs.goes_on(own) {
                let Some(event) = event else {
                    then.push((at, to));
                    continue;
                };
                let place = places.get(&event.within(*path)).copied();
                let before = then.len();
                let heard = outgoing().filter(|edge| self.tells_of(edge, tells) == place);
                then.extend(heard.clone().map(|edge| (edge.to, to)));
                // What comes of it was not followed there, or it has its parent raise something for it.
                let raises = |edge: &Edge| !beliefs.may_be_after(belief(at), event, belief(edge.to));
                leads.extend((then.len() == before || heard.clone().any(raises)).then_some(from));
            }
            leads.extend(then.iter().any(|(at, _)| reaches[*at as usize]).then_some(from));
            steps.extend(
                then.into_iter().map(|pair| (u32::try_from(pairs.insert_full(pair).0).unwrap_or(u32::MAX), from)),
            );
        }
        let before = Adjacency::new(pairs.len(), steps.iter().copied());
        let mut leading = vec![false; pairs.len()];
        while let Some(pair) = leads.pop() {
            if !std::mem::replace(&mut leading[pair as usize], true) {
                leads.extend(before.of(pair));
            }
        }
        let in_vain = pairs.iter().zip(leading).take(candidates).filter(|(_, leading)| !leading);
        let mut some: Vec<u32> = in_vain.map(|((at, _), _)| *at).collect();
        some.dedup();
        Some(some)
    }

    /// In which states something that may come, and is not told by the subsystem of that path (`tells`: what of outside is), has something raised for it.
    fn raising_for(&mut self, path: Ident, tells: &[bool]) -> Vec<bool> {
        let Self { product, reached, .. } = self;
        let Product { outside, members, .. } = &mut **product;
        let mut known: FxHashMap<(usize, NodeId), bool> = FxHashMap::default();
        let mut of = |number: usize, member: &mut Member<'_>, leaf: NodeId| {
            *known.entry((number, leaf)).or_insert_with(|| {
                let own: Vec<EventId> = outside
                    .iter()
                    .zip(tells)
                    .filter(|(_, tells)| **tells)
                    .map(|(event, _)| member.chart.event(*event))
                    .collect();
                let offers = member.offers(leaf);
                offers.iter().filter(|event| !own.contains(event)).any(|event| {
                    let step = member.react(leaf, *event);
                    step.emitted.iter().any(|emitted| emitted.event.local(path).is_some())
                })
            })
        };
        let all = reached
            .states
            .iter()
            .map(|state| (0..members.len()).any(|number| of(number, &mut members[number], state.leaves[number])));
        all.collect()
    }
}
