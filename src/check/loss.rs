//! How what a configuration stands for is lost on the simulated platform.

use super::product::Product;
use super::state::State;
use crate::model::monitor::Condition;
use crate::model::{ComponentName, ConfigId};
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
    /// How a configuration in force is lost, and no other one with it.
    pub fn loss(&self, state: &State, id: ConfigId) -> Option<Loss> {
        let world = self.worlds.get(state.world)?;
        let Some(holds) = &self.worlds.configuration(id)?.holds else { return Some(Loss::Lie) };
        let others: Vec<&Condition> = self
            .deployment
            .configurations
            .iter()
            .filter(|c| c.id != id && !state.lost.contains(&c.id) && world.stack.is_in_force(c.id))
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
