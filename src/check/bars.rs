//! Which moves lead a deployment down that is being stopped, where that is up to the way that it has come: what a component or
//! a monitor reports comes where it has reason to, and people decide where an emergency made it stand still.
//!
//! What a simulated component reports after a step (`simulated: { reactions }`) comes once. It is still to come where every way
//! since that step was quick, or led through places alone that would have heard it.

use super::edges::{Barred, Edge};
use super::explore::Graph;
use super::state::{Move, ProductState};
use crate::model::monitor::is_monitors;
use crate::model::{EventName, Monitor, RunState, Value};
use crate::system::View;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

impl Graph<'_, '_> {
    /// Of each edge, why it leads no deployment down that is being stopped.
    pub(super) fn bars(&mut self) -> Vec<Option<Barred>> {
        let (safe, below) = (self.stands_still(), self.waits_below());
        let people: Vec<bool> = safe.into_iter().zip(below).map(|(safe, below)| safe || below).collect();
        let shutdown = self.product.deployment.shutdown.event;
        let unknown = self.product.children.iter().any(|child| child.beliefs.is_none());
        let mut bars: Vec<Option<Barred>> = Vec::with_capacity(self.edges.len());
        let mut watched: FxHashMap<(u16, u32), bool> = FxHashMap::default();
        let mut asked: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (number, edge) in self.edges.iter().enumerate() {
            let waits = people[edge.from as usize];
            let again =
                || matches!(self.by(edge), Move::Event(at) if self.product.outside[usize::from(at)] == shutdown);
            bars.push(match (edge.barred(), self.by(edge)) {
                (Some(Barred::Again), _) if waits && again() => None,
                (Some(Barred::Late), _) if waits => None,
                (Some(Barred::Gone), Move::Event(at)) => {
                    let world = self.states[edge.from as usize].world;
                    let names = || self.product.alike_to(at);
                    let watches = || names().any(|name| self.is_watched(world, name));
                    let comes = *watched.entry((at, world)).or_insert_with(watches);
                    asked.entry(usize::from(at)).or_default().push(number);
                    (!comes).then_some(Barred::Gone)
                }
                (None, Move::Event(at)) if unknown => {
                    let unended = |name| self.product.unended(&self.states[edge.from as usize], name).is_some();
                    self.product.alike_to(at).all(unended).then_some(Barred::Gone)
                }
                (barred, _) => barred,
            });
        }
        for (at, numbers) in asked {
            let comes = self.is_to_come(at);
            for number in numbers.into_iter().filter(|number| comes[self.edges[*number].from as usize]) {
                bars[number] = None;
            }
        }
        bars
    }

    /// Where its time stands still while it is stopped: a safe configuration has come since, and people decide how it goes on,
    /// by the event that ends the deployment once more.
    pub(super) fn stands_still(&self) -> Vec<bool> {
        let is_safe =
            |state: &ProductState| state.stopping && (state.elsewhere || self.product.worlds.is_safe(state.world));
        let safes: Vec<bool> = self.states.iter().map(is_safe).collect();
        let safe = |at: u32| safes[at as usize];
        // What was in force before counts for nothing. Each state is judged by its best way.
        let begins = |edge: &&Edge| safe(edge.to) && !self.states[edge.from as usize].stopping;
        let open: Vec<u32> = self.edges.iter().filter(begins).map(|edge| edge.to).collect();
        let best = |edge: &Edge| self.failed[edge.from as usize].max(edge.failed()) <= self.failed[edge.to as usize];
        // Where one is there that was asked for meanwhile, that holds it now; of a group it is the only one.
        let comes = |edge: &Edge| self.states[edge.from as usize].safe.len() > self.states[edge.to as usize].safe.len();
        let before = self.spread_from(open, |_, edge| safe(edge.to) && best(edge) && !comes(edge));
        (0u32..).zip(before).map(|(at, before)| safe(at) && !before).collect()
    }

    /// These states, and where such edges lead from them.
    pub(super) fn spread_from(&self, mut open: Vec<u32>, leads: impl Fn(usize, &Edge) -> bool) -> Vec<bool> {
        let mut reached = vec![false; self.states.len()];
        // Where a coordinator cannot be entered there are none.
        open.retain(|at| (*at as usize) < self.states.len());
        while let Some(at) = open.pop() {
            if !std::mem::replace(&mut reached[at as usize], true) {
                let edges =
                    self.outgoing().of(at).iter().map(|number| (*number as usize, &self.edges[*number as usize]));
                let leads = |(number, edge): &(usize, &Edge)| !reached[edge.to as usize] && leads(*number, edge);
                open.extend(edges.filter(leads).map(|(_, edge)| edge.to));
            }
        }
        reached
    }

    /// Whether a monitor watches in a world for what would raise an event: one that runs and is enabled, and something that it
    /// looks at is there. Where there are no values nothing is raised.
    fn is_watched(&self, world: u32, name: EventName) -> bool {
        let deployment = self.product.deployment;
        let mut raising =
            deployment.monitors.iter().filter(|monitor| monitor.events().any(|event| event == name)).peekable();
        if deployment.kind.imitates || raising.peek().is_none() {
            return false;
        }
        // What is not known may be there.
        let Some(world) = self.product.worlds.get(world) else { return true };
        let mut watching: Vec<&Monitor> = Vec::new();
        world.system.for_each_component(&mut |node| {
            if is_monitors(node.ty.name) && node.state == RunState::Running {
                let enabled = |monitor: &&Monitor| {
                    node.value(monitor.own_name()).map_or(monitor.enabled, |value| *value == Value::Bool(true))
                };
                let own = |monitor: &&Monitor| monitor.run_by() == node.ty.name;
                watching.extend(raising.clone().filter(own).filter(enabled));
            }
        });
        watching.into_iter().any(|monitor| {
            let (mut named, mut there) = (false, false);
            monitor.when.for_each_component(&mut |component, _| {
                named = true;
                there |= world.system.component(component).is_some();
            });
            there || !named
        })
    }

    /// In which states a reaction of the simulated platform is still to come that raises an event from outside, or one that
    /// nobody tells from it.
    fn is_to_come(&mut self, at: usize) -> Vec<bool> {
        let mut comes = vec![false; self.states.len()];
        let deployment = self.product.deployment;
        let names: Vec<EventName> = self.product.alike_to(u16::try_from(at).unwrap_or(u16::MAX)).collect();
        let reactions = deployment.reactions.iter().enumerate();
        let in_time = reactions.filter(|(_, reaction)| reaction.delay < deployment.shutdown.within);
        let raising: Vec<usize> =
            in_time.filter(|(_, reaction)| names.contains(&reaction.raise)).map(|(at, _)| at).collect();
        if !deployment.kind.imitates || raising.is_empty() {
            return comes;
        }
        let mut hears = Vec::with_capacity(self.states.len());
        for state in &self.reached.states {
            let members = self.product.members.iter_mut().zip(&state.leaves);
            hears.push(members.into_iter().any(|(member, leaf)| member.takes(*leaf, names[0])));
        }
        for reaction in raising {
            let set_off = |number: usize| self.sets_off(number, reaction);
            let is_it = |edge: &Edge| matches!(self.by(edge), Move::Event(by) if usize::from(by) == at);
            let passes = |(number, edge): &(usize, &Edge)| {
                !set_off(*number) && (is_it(edge) || !edge.quiet() && !hears[edge.from as usize])
            };
            let gone = self.edges.iter().enumerate().filter(passes).map(|(_, edge)| edge.to);
            let gone = self.spread_from(gone.chain([0]).collect(), |number, _| !set_off(number));
            comes.iter_mut().zip(gone).for_each(|(comes, gone)| *comes |= !gone);
        }
        comes
    }
}
