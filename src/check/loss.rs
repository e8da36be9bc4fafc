//! Which configurations in force are watched for what they stand for, and how that is lost on the simulated platform.

use super::product::Product;
use super::state::ProductState;
use crate::model::monitor::Condition;
use crate::model::{ComponentName, ConfigId};
use crate::stack::{is_stood_down, running_for};
use crate::system::View;

/// How a loss comes about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// This component fails: what it showed last is no word of it then.
    Fails(ComponentName),
    /// A step said that it was done, and was not: the next look finds it so.
    Lie,
}

impl Product<'_> {
    /// A configuration has been applied: what of it runs now is watched.
    pub(super) fn stands_for(&self, state: &mut ProductState, id: ConfigId) {
        let Some(holds) = self.worlds.configuration(id).and_then(|c| c.holds.as_ref()) else { return };
        if state.over.contains(&id) {
            state.change(|seldom| seldom.over.retain(|over| *over != id));
        }
        state.stands.retain(|(of, _)| *of != id);
        // What else is under way may have started it, or be about to stop it: nobody knows which came first.
        if let Some(world) = self.worlds.get(state.world).filter(|_| state.desk.under_way().is_empty()) {
            state.stands.extend(running_for(holds, &world.system).into_iter().map(|name| (id, name)));
            state.stands.sort_unstable();
        }
    }

    /// The world is another one: what something stands for that is in force is watched on, or no more.
    pub(super) fn review_standings(&self, state: &mut ProductState) {
        if state.stands.is_empty() && state.over.is_empty() {
            return;
        }
        let ProductState { stands, seldom, world, .. } = state;
        let in_force = |id: ConfigId| self.worlds.is_in_force(*world, id);
        if !seldom.get().over.is_empty() {
            seldom.change(|seldom| seldom.over.retain(|id| in_force(*id)));
        }
        stands.retain(|(id, _)| in_force(*id));
        let Some(world) = self.worlds.get(*world) else { return };
        let of = |id: ConfigId| stands.iter().filter(move |(of, _)| *of == id).map(|(_, name)| *name);
        let down: Vec<ConfigId> =
            stands.iter().map(|(id, _)| *id).filter(|id| is_stood_down(of(*id), &world.system)).collect();
        if down.is_empty() {
            return;
        }
        stands.retain(|(id, _)| !down.contains(id));
        seldom.change(|seldom| {
            seldom.over.extend(down);
            seldom.over.sort_unstable();
            seldom.over.dedup();
        });
    }

    /// How a configuration in force is lost, and no other one with it.
    pub fn loss(&self, state: &ProductState, id: ConfigId) -> Option<Loss> {
        let world = self.worlds.get(state.world)?;
        let holds = self.worlds.configuration(id)?.holds.as_ref().filter(|_| !state.over.contains(&id));
        let Some(holds) = holds else { return Some(Loss::Lie) };
        let watched = |id: &ConfigId| !state.lost.contains(id) && !state.over.contains(id);
        let others: Vec<&Condition> = self
            .deployment
            .configurations
            .iter()
            .filter(|c| c.id != id && watched(&c.id) && world.stack.is_in_force(c.id))
            .filter_map(|c| c.holds.as_ref())
            .collect();
        let looked_at = |component: ComponentName| others.iter().any(|holds| names(holds).contains(&component));
        let there = |component: &ComponentName| world.system.component(*component).is_some();
        names(holds).into_iter().find(|component| there(component) && !looked_at(*component)).map(Loss::Fails)
    }
}

/// The components that a condition looks at.
fn names(condition: &Condition) -> Vec<ComponentName> {
    let mut names = Vec::new();
    condition.for_each_component(&mut |name, _| names.push(name));
    names
}
