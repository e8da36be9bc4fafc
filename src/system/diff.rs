//! The steps from one system to another. One mechanism for repair of drift, a return to a saved system, forced teardown
//! and the comparison of two systems (semantics: *Steps and plans*).

use super::{ComponentNode, Overlay, System, View, step};
use crate::model::{ComponentName, MemberRef, Policy, RunState, Step, Value, Wanted};
use std::collections::{BTreeMap, BTreeSet};

/// The steps that make `from` into `to`, in an order in which each may happen. Empty when the two show the same.
///
/// A component that is faulted in `to` is taken as unconfigured there, unless it is faulted in `from` as well: a fault is
/// nobody's wish, and nothing can bring it about. Components stop producers first and start consumers first.
pub fn diff(from: &System, to: &System) -> Vec<Step> {
    let mut diff = Diff { steps: Vec::new(), states: BTreeMap::new(), sets: Vec::new() };
    diff.compare(from, to);
    diff.steps
}

/// Whether one of these steps, done one after the other, moves hardware: also one of a component that an earlier one makes.
pub fn moves_any(steps: &[Step], system: &System) -> bool {
    let mut view = Overlay::new(system);
    steps.iter().any(|step| {
        let moves = step::moves(step, &view);
        let _ = step::apply(step, &mut view);
        moves
    })
}

/// The steps, done one after the other, but for some, and for those that are not possible without these.
pub fn without(mut steps: Vec<Step>, system: &System, out: impl Fn(&Step, &Overlay<'_>) -> bool) -> Vec<Step> {
    let mut view = Overlay::new(system);
    steps.retain(|step| !out(step, &view) && step::apply(step, &mut view).is_ok());
    steps
}

/// What is demanded of a component that is to be as one in `state`.
fn to_want(state: RunState) -> Wanted {
    state.wanted().unwrap_or(Wanted::Unconfigured)
}

struct Diff {
    steps: Vec<Step>,
    /// The state each component is in after the steps so far, where that differs from `from`.
    states: BTreeMap<ComponentName, RunState>,
    sets: Vec<Step>,
}

impl Diff {
    fn go(&mut self, component: ComponentName, now: RunState, wanted: Wanted) {
        for transition in now.path_to(wanted) {
            self.steps.push(Step::State { component, transition: *transition });
        }
        self.states.insert(component, wanted.into());
    }

    fn compare(&mut self, from: &System, to: &System) {
        let order = data_flow(from);
        let kept = |node: &ComponentNode| {
            to.component(node.name).filter(|t| t.ty.name == node.ty.name && t.activity == node.activity)
        };
        // Down: what goes away, and what holds a property that cannot be set in its present state.
        for node in &order {
            match kept(node) {
                None if node.state == RunState::Faulted => {}
                None => self.go(node.name, node.state, Wanted::Unconfigured),
                Some(target) => self.lower(node, target),
            }
        }
        self.disconnect(from, to, &kept);
        for node in &order {
            if kept(node).is_none() {
                self.steps.push(Step::Destroy { component: node.name });
            }
        }
        let order = data_flow(to);
        for target in &order {
            if from.component(target.name).and_then(kept).is_none() {
                self.steps.push(Step::Create {
                    component: target.name,
                    ty: target.ty.name,
                    activity: target.activity,
                    properties: target.properties.clone(),
                });
                self.states.insert(target.name, RunState::Unconfigured);
                for (port, value) in target.written_ports() {
                    self.steps.push(Step::PortWrite { port: target.name.member(port), value: Some(value.clone()) });
                }
            }
        }
        self.steps.append(&mut self.sets);
        for target in &order {
            if let Some(node) = from.component(target.name).filter(|n| kept(n).is_some()) {
                for (port, value) in changed_ports(node, target) {
                    self.steps.push(Step::PortWrite { port, value });
                }
            }
        }
        self.connect(from, to);
        // Up: consumers first.
        for target in order.iter().rev() {
            let now = self.states.get(&target.name).copied().or_else(|| from.component(target.name).map(|n| n.state));
            let now = now.unwrap_or(RunState::Unconfigured);
            if now != target.state {
                self.go(target.name, now, to_want(target.state));
            }
        }
    }

    /// Brings a component that stays down to where it can be changed, and keeps its property_sets for later.
    fn lower(&mut self, node: &ComponentNode, target: &ComponentNode) {
        let (mut state, mut goal) = (node.state, None);
        let mut to_go = |wanted: Wanted| {
            goal = Some(wanted);
            RunState::from(wanted)
        };
        for (((name, declared), now), value) in node.ty.properties.iter().zip(&node.properties).zip(&target.properties)
        {
            if now != value {
                self.sets.push(Step::PropertySet { property: node.name.member(*name), value: value.clone() });
                while !declared.tunable.allows(state) {
                    let stopped = state == RunState::Running;
                    state = to_go(if stopped { Wanted::Stopped } else { Wanted::Unconfigured });
                }
            }
        }
        // One that has failed gives back what others may need.
        if node.state == RunState::Faulted && target.state != RunState::Faulted && !node.ty.exclusive.is_empty() {
            to_go(Wanted::Unconfigured);
        }
        // A component that only has to go down goes down here, with the others that do.
        let wanted = to_want(target.state);
        if node.state != target.state && node.state != RunState::Faulted && RunState::from(wanted) < state {
            to_go(wanted);
        }
        if let Some(goal) = goal {
            self.go(node.name, node.state, goal);
        }
    }

    fn disconnect<'t>(
        &mut self,
        from: &System,
        to: &'t System,
        kept: &impl Fn(&ComponentNode) -> Option<&'t ComponentNode>,
    ) {
        let stays = |port: MemberRef| from.component(port.component).is_some_and(|n| kept(n).is_some());
        // In-ports whose recorded value changes: written with nothing connected.
        let mut rewritten = BTreeSet::new();
        from.for_each_component(&mut |node| {
            if let Some(target) = kept(node) {
                rewritten.extend(changed_ports(node, target).into_iter().map(|(port, _)| port));
            }
        });
        let mut gone = Vec::new();
        from.for_each_link(&mut |a, b, policy| {
            let same = to.link(a, b) == Some(policy) && stays(a) && stays(b) && !rewritten.contains(&b);
            if !same {
                gone.push((a, b));
            }
        });
        gone.sort_unstable();
        self.steps.extend(gone.into_iter().map(|(from, to)| Step::Disconnect { from, to }));
    }

    fn connect(&mut self, from: &System, to: &System) {
        let cut: BTreeSet<(MemberRef, MemberRef)> = self
            .steps
            .iter()
            .filter_map(|s| if let Step::Disconnect { from, to } = s { Some((*from, *to)) } else { None })
            .collect();
        let mut wanted: Vec<(MemberRef, MemberRef, Policy)> = Vec::new();
        to.for_each_link(&mut |a, b, policy| {
            if from.link(a, b).is_none() || cut.contains(&(a, b)) {
                wanted.push((a, b, policy));
            }
        });
        wanted.sort_unstable();
        self.steps.extend(wanted.into_iter().map(|(from, to, policy)| Step::Connect { from, to, policy }));
    }
}

fn changed_ports(node: &ComponentNode, target: &ComponentNode) -> Vec<(MemberRef, Option<Value>)> {
    let ports = node.ty.ports.keys().enumerate();
    ports
        .filter(|(i, _)| node.written(*i) != target.written(*i))
        .map(|(i, port)| (node.name.member(*port), target.written(i).cloned()))
        .collect()
}

/// Components, producers before consumers; inside a loop by name.
fn data_flow(system: &System) -> Vec<&ComponentNode> {
    let mut components: Vec<Vec<&ComponentNode>> = petgraph::algo::kosaraju_scc(system.graph())
        .into_iter()
        .map(|scc| scc.into_iter().map(|i| &*system.graph()[i]).collect())
        .collect();
    // Kosaraju gives consumers first.
    components.reverse();
    for scc in &mut components {
        scc.sort_unstable_by_key(|n| n.name);
    }
    components.into_iter().flatten().collect()
}

/// Whether two systems show the same (faulted in `wanted` counts as unconfigured, see [`diff`]).
pub fn reached(system: &System, wanted: &System) -> bool {
    diff(system, wanted).is_empty()
}
