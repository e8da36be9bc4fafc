//! The order in which the components of one activity are updated: along the data flow, so that a sample passes through a
//! chain in one round.

use petgraph::algo::kosaraju_scc;
use petgraph::graph::{DiGraph, NodeIndex};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// An order of `0..names.len()` along the edges, writers before readers. Where the edges leave a choice, and inside loops,
/// the name decides: the order depends on what is connected, not on when it was.
///
/// Answers the order and whether there are loops.
pub(super) fn along_the_flow<N: Ord + Copy>(names: &[N], edges: &[(usize, usize)]) -> (Vec<usize>, bool) {
    let order = by_readiness(names, edges);
    if order.len() == names.len() {
        return (order, false);
    }
    // Each loop becomes one node, named after the first of its members; then there are no loops left.
    let mut graph = DiGraph::<(), ()>::with_capacity(names.len(), edges.len());
    for _ in names {
        graph.add_node(());
    }
    for (from, to) in edges {
        graph.add_edge(NodeIndex::new(*from), NodeIndex::new(*to), ());
    }
    let mut loops: Vec<Vec<usize>> =
        kosaraju_scc(&graph).into_iter().map(|nodes| nodes.into_iter().map(NodeIndex::index).collect()).collect();
    let mut loop_of = vec![0; names.len()];
    for (i, members) in loops.iter_mut().enumerate() {
        members.sort_by_key(|member| names[*member]);
        for member in members {
            loop_of[*member] = i;
        }
    }
    let loop_names: Vec<N> = loops.iter().map(|members| names[members[0]]).collect();
    let between: Vec<(usize, usize)> =
        edges.iter().map(|(a, b)| (loop_of[*a], loop_of[*b])).filter(|(a, b)| a != b).collect();
    let order = by_readiness(&loop_names, &between).into_iter().flat_map(|i| loops[i].clone()).collect();
    (order, true)
}

/// Nodes that nothing unordered points to, the first name first; incomplete when there are loops.
fn by_readiness<N: Ord + Copy>(names: &[N], edges: &[(usize, usize)]) -> Vec<usize> {
    // Successors as one array, with the place where each node's begin: two allocations instead of one a node.
    let mut begin = vec![0_usize; names.len() + 1];
    let mut waits_for = vec![0_usize; names.len()];
    for (from, to) in edges {
        begin[from + 1] += 1;
        waits_for[*to] += 1;
    }
    for i in 0..names.len() {
        begin[i + 1] += begin[i];
    }
    let mut successors = vec![0_usize; edges.len()];
    let mut fill = begin.clone();
    for (from, to) in edges {
        successors[fill[*from]] = *to;
        fill[*from] += 1;
    }
    let mut ready: BinaryHeap<Reverse<(N, usize)>> =
        (0..names.len()).filter(|i| waits_for[*i] == 0).map(|i| Reverse((names[i], i))).collect();
    let mut order = Vec::with_capacity(names.len());
    while let Some(Reverse((_, i))) = ready.pop() {
        order.push(i);
        for next in &successors[begin[i]..begin[i + 1]] {
            waits_for[*next] -= 1;
            if waits_for[*next] == 0 {
                ready.push(Reverse((names[*next], *next)));
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(names: &[&str], edges: &[(usize, usize)]) -> (String, bool) {
        let (order, looped) = along_the_flow(names, edges);
        (order.iter().map(|i| names[*i]).collect::<Vec<_>>().join(" "), looped)
    }

    #[test]
    fn writers_come_before_readers_and_names_break_ties() {
        assert_eq!(named(&["c", "a", "b"], &[]), ("a b c".into(), false));
        assert_eq!(named(&["c", "a", "b"], &[(0, 2), (2, 1)]), ("c b a".into(), false));
        assert_eq!(named(&["d", "c", "b", "a"], &[(0, 3), (0, 3), (1, 3)]), ("b c d a".into(), false));
    }

    #[test]
    fn loops_go_by_name_at_their_place_in_the_flow() {
        // z feeds the loop m, k, p; the loop feeds a.
        let edges = [(0, 1), (1, 2), (2, 3), (3, 1), (3, 4)];
        assert_eq!(named(&["z", "m", "k", "p", "a"], &edges), ("z k m p a".into(), true));
    }

    #[test]
    fn a_long_chain_and_a_long_loop() {
        const N: usize = 50_000;
        let names: Vec<usize> = (0..N).rev().collect();
        let chain: Vec<_> = (1..N).map(|i| (i - 1, i)).collect();
        assert_eq!(along_the_flow(&names, &chain).0, (0..N).collect::<Vec<_>>());
        let mut ring = chain;
        ring.push((N - 1, 0));
        assert_eq!(along_the_flow(&names, &ring), ((0..N).rev().collect::<Vec<_>>(), true));
    }
}
