//! What subsystems hold for themselves: no two that may hold the same thing are begun at once, and none together with a component of
//! the parent's own that holds it. Inside one file the planner refuses that.

use super::children::{DOUBT, begun};
use super::explore::Graph;
use super::judge::{Traced, severity_of};
use super::product::Product;
use super::state::{Failed, ProductState};
use crate::model::codes::COMPOSE_EXCLUSIVE;
use crate::model::{ComponentName, Finding, Ident, RunState};
use crate::system::{View, exclusive};
use std::collections::BTreeMap;

/// Who else may hold what a subsystem may hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rival {
    Subsystem(Ident),
    Own(ComponentName),
}

impl Product<'_> {
    /// A subsystem that is begun, who else may hold something that it may hold, and what.
    fn contended(&self, state: &ProductState) -> Option<(usize, Rival, String)> {
        let there = |at: usize| state.children & (begun(at) | DOUBT) != 0 || self.children[at].unbidden;
        for (at, child) in self.children.iter().enumerate().filter(|(at, child)| there(*at) && !child.holds.is_empty())
        {
            for (other, rival) in self.children.iter().enumerate().skip(at + 1).filter(|(other, _)| there(*other)) {
                if let Some(name) = rival.holds.intersection(&child.holds).next() {
                    return Some((other, Rival::Subsystem(child.path), name.clone()));
                }
            }
            let mut own = None;
            let Some(world) = self.worlds.get(state.world) else { continue };
            world.system.for_each_component(&mut |node| {
                if own.is_none() && node.state != RunState::Unconfigured {
                    let name = exclusive::names(node).find(|name| child.holds.contains(name));
                    own = name.map(|name| (node.name, name));
                }
            });
            if let Some((component, name)) = own {
                return Some((at, Rival::Own(component), name));
            }
        }
        None
    }
}

impl Graph<'_, '_> {
    /// What two would hold at once.
    pub(super) fn exclusives(&mut self, found: &mut Traced) {
        if self.product.children.iter().all(|child| child.holds.is_empty()) {
            return;
        }
        let mut some: BTreeMap<(usize, Rival), (String, Vec<u32>)> = BTreeMap::new();
        for (at, state) in (0u32..).zip(&self.states) {
            if self.failed[at as usize] == Failed::Broken {
                continue;
            }
            if let Some((child, rival, name)) = self.product.contended(state) {
                some.entry((child, rival)).or_insert_with(|| (name, Vec::new())).1.push(at);
            }
        }
        for ((child, rival), (name, states)) in some {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let path = self.product.children[child].path;
            let (message, help) = match rival {
                Rival::Subsystem(other) => (
                    format!("`{path}` and `{other}` may both hold `{name}`, and one is begun while the other is there"),
                    format!(
                        "create them with different values of what stands in that name, or begin one when `{other}/down` was heard"
                    ),
                ),
                Rival::Own(component) => (
                    format!("`{component}` holds `{name}`, which `{path}` may need while it is there"),
                    format!(
                        "bring `{component}` to unconfigured before `{path}` is begun, or give one of the two another value"
                    ),
                ),
            };
            let origin = self.product.deployment.subsystems.iter().find(|one| one.name == path).map(|one| one.origin);
            let finding = Finding::new(severity_of(self.failed[at as usize]), COMPOSE_EXCLUSIVE, message)
                .at(origin.unwrap_or_default())
                .path(format!("subsystems.{path}"));
            let trace = self.trace(at);
            found.push((finding.help(help), trace));
        }
    }
}
