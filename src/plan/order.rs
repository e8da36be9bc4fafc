//! Orders: the data flow of a system, and irreversible steps last.

use super::{PlannedStep, SavedValue, StepId};
use crate::model::{ComponentName, Transition, TypeName};
use crate::system::{Overlay, Reversibility, View};
use petgraph::Direction;
use petgraph::graph::{DiGraph, NodeIndex};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// A component that moves, and the moves (places in the list) that its start or stop waits for.
pub(super) struct OrderMove {
    pub(super) component: ComponentName,
    pub(super) after: SmallVec<[u32; 4]>,
}

/// More predecessors than this behind a component that does not move are chained, so that the number of edges stays in
/// proportion to the system.
const FAN: usize = 8;

/// The order in which components of `moving` start (consumers before producers) or stop (producers before consumers).
/// Inside a feedback loop `start_after` and `stop_before` decide, then the name, one at a time. Iterative: chains of a
/// hundred thousand components are ordinary.
pub(super) fn data_flow(view: &Overlay<'_>, moving: Vec<ComponentName>, key: Transition) -> Vec<OrderMove> {
    if moving.len() == 1 {
        return moving.into_iter().map(|component| OrderMove { component, after: SmallVec::new() }).collect();
    }
    let mut graph: DiGraph<ComponentName, ()> = DiGraph::new();
    let mut at: FxHashMap<ComponentName, NodeIndex> = FxHashMap::default();
    view.for_each_component(&mut |node| _ = at.insert(node.name, graph.add_node(node.name)));
    view.for_each_link(&mut |from, to, _| {
        if from.component != to.component {
            graph.add_edge(at[&from.component], at[&to.component], ());
        }
    });
    let mut moves_at = vec![false; graph.node_count()];
    for name in &moving {
        moves_at[at[name].index()] = true;
    }
    // Consumers first.
    let mut loops = petgraph::algo::kosaraju_scc(&graph);
    let towards = if key == Transition::Start { Direction::Outgoing } else { Direction::Incoming };
    if key != Transition::Start {
        loops.reverse();
    }
    let mut moves: Vec<OrderMove> = Vec::with_capacity(moving.len());
    // What follows a component waits for these moves.
    let mut exits: Vec<SmallVec<[u32; 2]>> = vec![SmallVec::new(); graph.node_count()];
    for members in &loops {
        let mut waits: SmallVec<[u32; 4]> = SmallVec::new();
        for member in members {
            for neighbour in graph.neighbors_directed(*member, towards) {
                waits.extend(exits[neighbour.index()].iter().copied());
            }
        }
        waits.sort_unstable();
        waits.dedup();
        let movers: Vec<ComponentName> = members.iter().filter(|m| moves_at[m.index()]).map(|m| graph[*m]).collect();
        if movers.is_empty() {
            if waits.len() > FAN {
                for pair in waits.windows(2) {
                    if !moves[pair[1] as usize].after.contains(&pair[0]) {
                        moves[pair[1] as usize].after.push(pair[0]);
                    }
                }
                waits.drain(..waits.len() - 1);
            }
            for member in members {
                exits[member.index()] = SmallVec::from_slice(&waits);
            }
            continue;
        }
        for component in in_loop(view, movers, key) {
            let id = u32::try_from(moves.len()).expect("fewer components than that");
            moves.push(OrderMove { component, after: std::mem::take(&mut waits) });
            waits.push(id);
        }
        for member in members {
            exits[member.index()] = SmallVec::from_slice(&waits);
        }
    }
    moves
}

/// The order inside one loop.
fn in_loop(view: &Overlay<'_>, mut names: Vec<ComponentName>, key: Transition) -> Vec<ComponentName> {
    if names.len() < 2 {
        return names;
    }
    names.sort_unstable();
    let mut waiting: BTreeMap<TypeName, Vec<ComponentName>> = BTreeMap::new();
    for name in names {
        let ty = view.component(name).expect("it moves, so it exists").ty.name;
        waiting.entry(ty).or_default().push(name);
    }
    let total: usize = waiting.values().map(Vec::len).sum();
    let mut blockers: BTreeMap<TypeName, Vec<TypeName>> = waiting.keys().map(|t| (*t, Vec::new())).collect();
    for ty in waiting.keys() {
        let Some(declared) = view.types().get(*ty) else { continue };
        if key == Transition::Start {
            let before = declared.start_after.iter().filter(|t| *t != ty && waiting.contains_key(*t));
            blockers.get_mut(ty).expect("its own entry").extend(before);
        } else {
            for later in declared.stop_before.iter().filter(|t| *t != ty) {
                if let Some(list) = blockers.get_mut(later) {
                    list.push(*ty);
                }
            }
        }
    }
    let mut left: BTreeMap<TypeName, usize> = waiting.iter().map(|(t, c)| (*t, c.len())).collect();
    let mut ready: BinaryHeap<Reverse<(ComponentName, TypeName)>> = BinaryHeap::new();
    let mut out = Vec::with_capacity(total);
    let release = |left: &BTreeMap<TypeName, usize>,
                   waiting: &mut BTreeMap<TypeName, Vec<ComponentName>>,
                   ready: &mut BinaryHeap<Reverse<(ComponentName, TypeName)>>| {
        let free: Vec<TypeName> =
            waiting.keys().filter(|t| blockers[*t].iter().all(|b| left[b] == 0)).copied().collect();
        for ty in free {
            ready.extend(waiting.remove(&ty).into_iter().flatten().map(|c| Reverse((c, ty))));
        }
    };
    release(&left, &mut waiting, &mut ready);
    while out.len() < total {
        let Some(Reverse((component, ty))) = ready.pop() else {
            // The declarations themselves go in a cycle: then the name decides.
            let ty = *waiting.iter().min_by_key(|(_, c)| c[0]).expect("something is left").0;
            ready.extend(waiting.remove(&ty).into_iter().flatten().map(|c| Reverse((c, ty))));
            continue;
        };
        out.push(component);
        let n = left.get_mut(&ty).expect("counted above");
        *n -= 1;
        if *n == 0 {
            release(&left, &mut waiting, &mut ready);
        }
    }
    out
}

/// Reorders the steps from place `from` on so that irreversible ones come last, each as late as what depends on it
/// allows, and makes them wait for what comes before. Numbers and edges are rewritten.
pub(super) fn irreversible_last(steps: &mut Vec<PlannedStep>, from: usize, saved: &mut [SavedValue]) {
    let base = StepId::try_from(from).expect("fewer steps than that");
    let never = |s: &PlannedStep| s.reversibility == Reversibility::Irreversible;
    if !steps[from..].iter().any(never) || steps.len() - from < 2 {
        return;
    }
    let tail: Vec<PlannedStep> = steps.drain(from..).collect();
    let mut blocked = vec![0usize; tail.len()];
    let mut followers: Vec<Vec<usize>> = vec![Vec::new(); tail.len()];
    for (i, step) in tail.iter().enumerate() {
        for id in step.after.iter().filter(|id| **id >= base) {
            blocked[i] += 1;
            followers[(*id - base) as usize].push(i);
        }
    }
    let mut ready: BinaryHeap<Reverse<(bool, usize)>> = BinaryHeap::new();
    ready.extend((0..tail.len()).filter(|i| blocked[*i] == 0).map(|i| Reverse((never(&tail[i]), i))));
    let mut place = vec![0 as StepId; tail.len()];
    let mut order = Vec::with_capacity(tail.len());
    while let Some(Reverse((_, i))) = ready.pop() {
        place[i] = base + StepId::try_from(order.len()).expect("fewer steps than that");
        order.push(i);
        for next in &followers[i] {
            blocked[*next] -= 1;
            if blocked[*next] == 0 {
                ready.push(Reverse((never(&tail[*next]), *next)));
            }
        }
    }
    let mut tail: Vec<Option<PlannedStep>> = tail.into_iter().map(Some).collect();
    // Steps since the last irreversible one, and which steps somebody waits for already.
    let mut since: Vec<StepId> = Vec::new();
    let mut waited = vec![false; tail.len()];
    for i in order {
        let mut step = tail[i].take().expect("every step stands once in the order");
        step.id = place[i];
        for id in &mut step.after {
            if *id >= base {
                *id = place[(*id - base) as usize];
                waited[(*id - base) as usize] = true;
            }
        }
        if never(&step) {
            for end in since.drain(..).filter(|end| !waited[(*end - base) as usize]) {
                step.after.push(end);
            }
        }
        since.push(step.id);
        steps.push(step);
    }
    for entry in saved.iter_mut().filter(|s| s.step && s.at >= base) {
        entry.at = place[(entry.at - base) as usize];
    }
    // Demands without a step commute with the whole stage: its beginning is as good a place as any.
    for entry in saved.iter_mut().filter(|s| !s.step && s.at >= base) {
        entry.at = base;
    }
}
