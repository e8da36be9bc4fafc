//! Whether every way leads down, and what it leaves behind.

use super::children::Child;
use super::closed::still_comes;
use super::edges::{Barred, Edge};
use super::explore::Graph;
use super::judge::Traced;
use super::members::Member;
use super::product::Product;
use super::reactions::triggers;
use super::state::{Failed, Move, ProductState};
use super::uncertain::fails;
use crate::model::codes::{COORD_LEFTOVERS, COORD_NO_WAY_DOWN};
use crate::model::{ComponentName, Finding, Severity};
use crate::statechart::{EventId, NodeId};
use crate::system::View;
use rustc_hash::FxHashSet;
use std::collections::VecDeque;

impl Graph<'_, '_> {
    /// Ways down that leave something behind.
    pub(super) fn leftovers(&mut self, found: &mut Traced) {
        let left = |state: &ProductState| left_in(self.product, state);
        let some = (0u32..).zip(&self.states).filter(|(_, state)| !left(state).is_empty());
        let some = some.map(|(at, _)| at).collect();
        let Some(at) = self.best_first(some).first().copied() else { return };
        let left = left_in(self.product, &self.states[at as usize]);
        let names: Vec<String> = left.iter().take(6).map(ToString::to_string).collect();
        let more = if left.len() > 6 { format!(" and {} more", left.len() - 6) } else { String::new() };
        let finding = Finding::warning(COORD_LEFTOVERS, format!("a way down leaves {}{more} behind", names.join(", ")))
            .at(self.product.deployment.key_origin("shutdown.down"))
            .path("shutdown.down")
            .help("let every way down undo or destroy what was applied on the way up; else what is left is taken away without its coordinator");
        let trace = self.trace(at);
        found.push((finding, trace));
    }

    /// From everywhere there is a way down. What was not followed to its end may lead down.
    pub(super) fn ways_down(&mut self, stuck: &FxHashSet<u32>, found: &mut Traced) {
        let arrives = self.arrives();
        let reaches = self.reaching_down(&arrives, |_, _| true);
        let several = self.product.members.len() > 1;
        let lost = |at: &u32| {
            let rests = !several || self.states[*at as usize].is_at_rest();
            !reaches[*at as usize] && rests && !self.is_stranded(*at)
        };
        let all: Vec<u32> = (0u32..).zip(&self.states).map(|(at, _)| at).filter(lost).collect();
        let leaves: FxHashSet<&[NodeId]> = stuck.iter().map(|at| &self.states[*at as usize].leaves[..]).collect();
        let some: Vec<u32> = if several {
            // Where nothing leads on at all tells most.
            let some: Vec<u32> = all.iter().copied().filter(|at| stuck.contains(at)).collect();
            if some.is_empty() { all } else { some }
        } else {
            let unbegun = self.states.iter().filter(|state| self.product.waits_for_unbegun(state, 0).is_some());
            let leaves: FxHashSet<&[NodeId]> = unbegun.map(|state| &state.leaves[..]).chain(leaves).collect();
            all.into_iter().filter(|at| !leaves.contains(&self.states[*at as usize].leaves[..])).collect()
        };
        let Some(at) = self.best_first(some).first().copied() else {
            let comes_up = self.comes_up();
            let told = self.once_down(&arrives, &reaches, &comes_up, found);
            return self.failing(&comes_up, told, found);
        };
        let deployment = self.product.deployment;
        let help = self.leads_nowhere(at);
        let state = &self.states[at as usize];
        let finding = if let Some(finding) = self.is_down_alone(state) {
            finding
        } else if let Some(finding) = self.unknown_when_down() {
            finding
        } else if several {
            let message = format!("from {} no way leads down together", self.product.place(state));
            Finding::warning(COORD_NO_WAY_DOWN, message)
                .at(deployment.key_origin("shutdown.down"))
                .path("shutdown.down")
                .help("look at the trace: which of them waits for the other, and for what?")
        } else {
            let member = &self.product.members[0];
            let (leaf, fqn) = (state.leaves[0], member.chart.fqn(state.leaves[0]).to_string());
            let down = deployment.coordinator_named(member.name).map_or("", |c| c.down.as_str());
            Finding::warning(COORD_NO_WAY_DOWN, format!("from `{fqn}` no way leads to `{down}`"))
                .at(member.chart.origin(leaf))
                .path(format!("coordinator.{fqn}"))
                .also(deployment.key_origin("shutdown.down"), "the state that means down")
                .help(help)
        };
        let mut finding = finding;
        if self.product.knows_less() {
            finding.severity = Severity::Info;
        }
        let trace = self.trace(at);
        found.push((finding, trace));
    }

    /// What to do about a state from which no way leads down: what ends the deployment may lead on from there, to nowhere.
    pub(super) fn leads_nowhere(&mut self, at: u32) -> String {
        let (leaf, shutdown) = (self.states[at as usize].leaves[0], self.product.deployment.shutdown.event);
        let member = &mut self.product.members[0];
        let event = member.chart.event(shutdown);
        let then = member.react(leaf, event).leaf;
        match event != EventId::OTHER && then != leaf {
            true => format!(
                "`{shutdown}` leads to `{}` from there: see that what is waited for from there on comes",
                member.chart.fqn(then)
            ),
            false => "add transitions that lead down from there".to_owned(),
        }
    }

    /// From which states such edges lead to *down*, or to where it is not followed, or to nothing that is known.
    fn reaching_down(&self, arrives: &[bool], counts: impl Fn(usize, &Edge) -> bool) -> Vec<bool> {
        let forced = |state: &ProductState| self.product.worlds.top(state.world).is_some();
        // What the broken ends lead to is taken away by force: that is no way down of an intact system.
        let counts = |number: usize, edge: &Edge| !forced(&self.states[edge.to as usize]) && counts(number, edge);
        self.leading_to(arrives.to_vec(), counts)
    }

    /// These states, and from which others such edges lead to them.
    pub(super) fn leading_to(&self, mut reaches: Vec<bool>, counts: impl Fn(usize, &Edge) -> bool) -> Vec<bool> {
        let mut open: Vec<u32> = (0u32..).zip(&reaches).filter(|(_, reaches)| **reaches).map(|(at, _)| at).collect();
        while let Some(at) = open.pop() {
            for number in self.incoming().of(at) {
                let edge = &self.edges[*number as usize];
                if !reaches[edge.from as usize] && counts(*number as usize, edge) {
                    reaches[edge.from as usize] = true;
                    open.push(edge.from);
                }
            }
        }
        reaches
    }

    /// Whether coordinators that are down may go on: by an event, or `also_by_time`. What begins and ends the deployment is taken by
    /// all, or refused. Where others are not followed with them all of these have to be down at once.
    pub(super) fn goes_on_when_down(&self, also_by_time: bool) -> bool {
        let leads = |edge: &Edge| {
            let comes = match self.by(edge) {
                by @ Move::Event(_) => !self.product.is_first_or_last(by),
                by => also_by_time && matches!(by, Move::Time(..)),
            };
            comes && self.failed[edge.from as usize] == Failed::Nothing
        };
        let is_down = |at: u32| self.product.all_in(&self.states[at as usize], |member| member.down);
        self.edges.iter().any(|edge| leads(edge) && is_down(edge.from) && !is_down(edge.to))
    }

    /// Which states are *down*, or what is in force there is taken away by force, or they are not followed further, or nothing is known of them.
    pub(super) fn arrives(&self) -> Vec<bool> {
        let of = |(state, followed): (&ProductState, &bool)| {
            !followed || self.product.is_down(state) || self.product.worlds.top(state.world).is_some()
        };
        let mut arrives: Vec<bool> = self.states.iter().zip(&self.followed).map(of).collect();
        let forced = self.troubles.iter().filter(|(_, trouble)| trouble.stays_in_force()).map(|(at, _)| *at);
        self.ends.iter().copied().chain(forced).for_each(|at| arrives[at as usize] = true);
        arrives
    }

    /// The event that ends the deployment is raised once, and not all that leads on where it is not being stopped does then:
    /// one finding, of the worst; of several as bad, of what is the first of these in the way somewhere. The state that is
    /// warned of; none: none is.
    fn once_down(&mut self, arrives: &[bool], reaches: &[bool], comes_up: &[bool], found: &mut Traced) -> Option<u32> {
        let (bars, behind_failed) = (self.bars(), self.behind_failed(comes_up));
        // Where something fails not every coordinator can go on; but a bring-up that has failed is to be led down.
        let expects = |failed: &[Failed], at: u32| failed[at as usize] == Failed::Nothing || behind_failed[at as usize];
        let mut worst: Option<(u32, Finding)> = None;
        let mut found_at =
            |graph: &mut Self, some: Vec<u32>, certain: bool, tell: &dyn Fn(&mut Self, u32) -> Finding| {
                let best = graph.best_first(some);
                let expected = best.iter().find(|at| expects(&graph.failed, **at)).filter(|_| certain);
                let Some(at) = expected.or(best.first()).copied() else { return };
                let severity = if expected.is_some() { Severity::Warning } else { Severity::Info };
                if worst.as_ref().is_none_or(|(_, worst)| severity > worst.severity) {
                    worst = Some((at, Finding { severity, ..tell(graph, at) }));
                }
            };
        let mut before = reaches.to_vec();
        // Nothing comes of what is refused.
        let stopping: Vec<bool> = self.states.iter().map(|state| state.stopping).collect();
        let stops = |at: u32| stopping[at as usize];
        let begins: Vec<&Edge> = self.edges.iter().filter(|edge| !stops(edge.from) && stops(edge.to)).collect();
        let begun: Vec<u32> = begins.iter().map(|edge| edge.to).collect();
        // What came just before is overtaken by the event that ends the deployment, and heard behind it. Where that leads nowhere
        // it is told as unhandled.
        let heard = begins.iter().filter(|edge| !edge.dropped()).map(|edge| edge.to).collect();
        let stale = self.spread_from(heard, |number, edge| stops(edge.to) && bars[number] == Some(Barred::Closed));
        let stale = (0u32..).zip(stale).filter(|(_, stale)| *stale).map(|(at, _)| at);
        let begun: Vec<u32> = stale.chain(begun).collect();
        let begun_all = begun.clone();
        let comes = self.spread_from(begun, |number, edge| stops(edge.to) && bars[number] != Some(Barred::Closed));
        // Where nothing has failed what leads down by a failure alone, beside what may go well, is no way to count on.
        let mut goes_well = vec![false; self.states.len()];
        let well = self.edges.iter().filter(|edge| edge.failed() == Failed::Nothing && self.by(edge) == Move::Answer);
        well.for_each(|edge| goes_well[edge.from as usize] = true);
        let counts = |graph: &Self, edge: &Edge| {
            let from = edge.from as usize;
            edge.failed() == Failed::Nothing || graph.failed[from] != Failed::Nothing || !goes_well[from]
        };
        let mut before_well = self.reaching_down(arrives, |_, edge| counts(self, edge));
        for barred in [Barred::Again, Barred::Closed, Barred::Gone, Barred::Late, Barred::Reported] {
            // Where nothing is barred so, as much leads down as before.
            if !bars.contains(&Some(barred)) {
                continue;
            }
            let after = self.reaching_down(arrives, |number, _| bars[number].is_none_or(|of| of > barred));
            let open = |number: usize, edge: &Edge| bars[number].is_none_or(|of| of > barred) && counts(self, edge);
            let after_well = self.reaching_down(arrives, open);
            let lost = |at: &u32| {
                let (state, at) = (&self.states[*at as usize], *at as usize);
                let rests = state.stopping && state.is_at_rest() && comes[at];
                let well = self.failed[at] == Failed::Nothing && before_well[at] && !after_well[at];
                rests && (before[at] && !after[at] || well)
            };
            let some = (0..u32::try_from(self.states.len()).unwrap_or_default()).filter(lost).collect();
            if !(self.product.never_down && matches!(barred, Barred::Closed | Barred::Late)) {
                let tell = |graph: &mut Self, at| match graph.loses_the_end(at).filter(|_| barred == Barred::Again) {
                    Some(finding) => finding,
                    None => {
                        let missed = graph.missed(at).filter(|_| barred == Barred::Again);
                        missed.into_iter().fold(graph.barred(at, barred, &bars, &before), Finding::help)
                    }
                };
                let certain = barred != Barred::Reported && (barred == Barred::Again || !self.product.knows_less());
                found_at(self, some, certain, &tell);
            }
            (before, before_well) = (after, after_well);
        }
        let alone = self.led_by_emergency_alone(&begun_all, arrives, &bars);
        found_at(self, alone, !self.product.knows_less(), &|graph: &mut Self, at| graph.waits_for_an_emergency(at));
        if !self.product.never_down {
            let slow = self.slow(&bars);
            let tell = |graph: &mut Self, at| graph.lasts_too_long(at, slow.always[&at]);
            found_at(self, slow.always.keys().copied().collect(), true, &tell);
            let tell = |graph: &mut Self, at| graph.is_overtaken(at, slow.overtaken[&at]);
            found_at(self, slow.overtaken.keys().copied().collect(), true, &tell);
            for (late, certain) in [(&slow.late, true), (&slow.reported, false)] {
                let tell = |graph: &mut Self, at| graph.lasts_too_long_late(at, &late[&at]);
                found_at(self, late.keys().copied().collect(), certain, &tell);
            }
        }
        let (at, finding) = worst?;
        let told = (finding.severity == Severity::Warning).then_some(at);
        let trace = self.trace(at);
        found.push((finding, trace));
        told
    }

    /// Nothing but that leads down from a state in which it is being stopped. `reaches`: where it does.
    fn barred(&self, at: u32, barred: Barred, bars: &[Option<Barred>], reaches: &[bool]) -> Finding {
        let (deployment, state) = (self.product.deployment, &self.states[at as usize]);
        if let Some(finding) = self.is_down_alone(state) {
            return finding;
        }
        let (event, place) = (deployment.shutdown.event, self.product.place(state));
        let by = self.led_on_by(at, barred, bars, reaches);
        let named = by.map(|by| self.product.named(by)).unwrap_or_default();
        let unended = match by {
            Some(Move::Event(at)) => self.product.unended(state, self.product.outside[usize::from(at)]),
            _ => None,
        };
        let message = match barred {
            Barred::Again => format!("from `{place}` only a second `{event}` leads down, and it is raised once"),
            Barred::Closed => {
                format!("from `{place}` only `{named}` leads down, which is refused when `{event}` has been raised")
            }
            Barred::Gone => {
                let why = match (by, unended) {
                    (_, Some(child)) => format!("nobody has ended `{}` there", child.path),
                    (Some(Move::Event(at)), _) if !fails(self.product.outside[usize::from(at)]) => {
                        "nothing is sure to raise it there".to_owned()
                    }
                    _ => "that comes only where something fails".to_owned(),
                };
                format!("from `{place}` only `{named}` leads down, and {why}")
            }
            Barred::Late => format!(
                "from `{place}` only a time of {} s leads down, and `shutdown.within_s` gives it {} s",
                by.map(|by| self.product.takes(by)).unwrap_or_default().as_secs_f64(),
                deployment.shutdown.within.as_secs_f64()
            ),
            Barred::Reported => format!(
                "from `{place}` only `{named}` leads down: an operator cannot raise it when `{event}` has been raised, only a \
                 component can"
            ),
        };
        // The one that is not down yet, and would be led on.
        let heard = |member: &Member<'_>| match by {
            Some(Move::Event(at)) => member.chart.event(self.product.outside[usize::from(at)]) != EventId::OTHER,
            Some(Move::Time(number, _)) => self.product.members[usize::from(number)].by == member.by,
            _ => member.chart.event(event) != EventId::OTHER,
        };
        let late = |number: &usize| {
            let member = &self.product.members[*number];
            let down = member.down.is_some_and(|down| member.chart.is_inside(state.leaves[*number], down));
            !down && heard(member)
        };
        let late = (0..self.product.members.len()).find(late).unwrap_or(0);
        let help = match barred {
            Barred::Gone if let Some(child) = unended => format!("raise `{}` on the way there", child.ends),
            Barred::Again => "let an answer or a time lead on from there".to_owned(),
            Barred::Closed => still_comes(&named),
            Barred::Late => "give it more time with `shutdown.within_s`, or let something lead on sooner".to_owned(),
            Barred::Gone => "let an answer or a time lead on as well".to_owned(),
            Barred::Reported => "let an answer or a time lead on as well, where no component raises it".to_owned(),
        };
        Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(self.product.members[late].chart.origin(state.leaves[late]))
            .path("shutdown.event")
            .help(format!("{help}; else what is left is taken down without the coordinator"))
    }

    /// What ends the deployment came before a state, where no transition waited for it: it is missing there.
    fn loses_the_end(&mut self, at: u32) -> Option<Finding> {
        if self.product.members.len() > 1 {
            return None;
        }
        let event = self.product.deployment.shutdown.event;
        let way = self.edges_to(at);
        let ends = |number: &u32| {
            let edge = &self.edges[*number as usize];
            matches!(self.by(edge), Move::Event(at) | Move::Dropped(at) if self.product.outside[usize::from(at)] == event)
        };
        let number = way.into_iter().rfind(ends)?;
        let edge = self.edges[number as usize];
        let (then, now) = (self.states[edge.from as usize].leaves[0], self.states[at as usize].leaves[0]);
        if self.states[edge.to as usize].leaves[0] != then || then == now {
            return None;
        }
        let chart = &self.product.members[0].chart;
        // A transition that leads back to where it comes from has heard it.
        if triggers(chart, then).0.contains(&chart.event(event)) {
            return None;
        }
        let (lost, place) = (chart.fqn(then), chart.fqn(now));
        let message = format!(
            "no transition waits for `{event}` in `{lost}`: what comes after leads to `{place}`, and from there only a second one leads down"
        );
        let finding = Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(chart.origin(then))
            .path(format!("coordinator.{lost}"))
            .also(chart.origin(now), "it goes on to here")
            .help(format!(
                "let `{event}` lead down from `{lost}` as well; else what is left is taken down without the coordinator"
            ));
        Some(finding)
    }

    /// What to do about what a subsystem has told on the way, where no transition waited for it.
    fn missed(&mut self, at: u32) -> Option<String> {
        let way = self.edges_to(at);
        let told = |number: &u32| {
            let Move::Unheard(place) = self.by(&self.edges[*number as usize]) else { return None };
            let name = self.product.outside[usize::from(place)];
            self.product.is_known(name).then_some((*number, name))
        };
        let (number, name) = way.iter().rev().find_map(told)?;
        let place = self.product.place(&self.states[self.edges[number as usize].from as usize]);
        Some(format!(
            "`{name}` comes in `{place}`, where no transition waits for it, and is told once: hear it there as well; else what is left is taken \
             down without the coordinator"
        ))
    }

    /// All are in *down*, and a subsystem is not: nobody is there to lead it down.
    fn is_down_alone(&self, state: &ProductState) -> Option<Finding> {
        let (product, event) = (&*self.product, self.product.deployment.shutdown.event);
        let up = || product.children_up(state);
        let first = up().next().filter(|_| product.all_in(state, |member| member.down))?;
        let names: Vec<String> = up().map(|child| format!("`{}`", child.path)).collect();
        let (place, verb) = (product.place(state), if names.len() == 1 { "is" } else { "are" });
        let message = format!(
            "in `{place}`, which means down, {} {verb} not down, and nobody leads them there when `{event}` comes",
            names.join(" and ")
        );
        let finding = Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(product.members[0].chart.origin(state.leaves[0]))
            .path("shutdown.down")
            .also(product.deployment.key_origin("shutdown.down"), "the state that means down")
            .help(format!(
                "lead it down before, and wait for `{}` on the way there; else it is taken down by force",
                first.down
            ));
        Some(finding)
    }

    /// That a subsystem is down is heard nowhere, so that of no state it is known that all is down there.
    fn unknown_when_down(&self) -> Option<Finding> {
        let product = &*self.product;
        let unheard = |child: &&Child| product.members.iter().all(|m| m.chart.event(child.down) == EventId::OTHER);
        let events: Vec<String> =
            product.children.iter().filter(unheard).map(|child| format!("`{}`", child.down)).collect();
        let (last, before) = events.split_last()?;
        let all = if before.is_empty() { last.clone() } else { format!("{} or {last}", before.join(", ")) };
        let down = product.deployment.first_coordinator().down.as_str();
        let message = format!("no transition waits for {all}: whether all is down in `{down}` is not known");
        let finding = Finding::warning(COORD_NO_WAY_DOWN, message)
            .at(product.deployment.key_origin("shutdown.down"))
            .path("shutdown.down")
            .help(format!("wait on the way to `{down}` until each subsystem is down"));
        Some(finding)
    }

    /// The first move of that kind on the shortest way down.
    fn led_on_by(&self, at: u32, barred: Barred, bars: &[Option<Barred>], reaches: &[bool]) -> Option<Move> {
        let leads =
            |number: usize| bars[number].is_none_or(|of| of >= barred) && reaches[self.edges[number].to as usize];
        let mut seen: FxHashSet<u32> = std::iter::once(at).collect();
        let mut queue = VecDeque::from([at]);
        while let Some(at) = queue.pop_front() {
            for number in self.outgoing().of(at).iter().map(|number| *number as usize).filter(|number| leads(*number)) {
                let edge = &self.edges[number];
                if bars[number] == Some(barred) {
                    return Some(self.by(edge));
                }
                if seen.insert(edge.to) {
                    queue.push_back(edge.to);
                }
            }
        }
        None
    }
}

/// What is left where it is *down*.
fn left_in(product: &Product<'_>, state: &ProductState) -> Vec<ComponentName> {
    if product.is_down(state) { product.there(state) } else { Vec::new() }
}

impl Product<'_> {
    /// The components that are there, as far as that is known, without what is a subsystem's own: that takes it away.
    pub(super) fn there(&self, state: &ProductState) -> Vec<ComponentName> {
        let mut names = Vec::new();
        if let Some(world) = self.worlds.get(state.world) {
            world.system.for_each_component(&mut |node| names.push(node.name));
        }
        names.retain(|name: &ComponentName| self.children.iter().all(|child| name.local(child.path).is_none()));
        names.sort_unstable();
        names
    }
}
