//! Where edges lead from each of very many states, as two lists: a list a state would be as many allocations as there are states.

/// The other ends of edges, by one end.
pub(super) struct Adjacency {
    starts: Vec<u32>,
    ends: Vec<u32>,
}

impl Adjacency {
    /// Of edges among `count` states: where they are looked up, and where they lead. They are gone through twice.
    pub fn new(count: usize, edges: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0; count + 1];
        for (from, _) in edges.clone() {
            starts[from as usize + 1] += 1;
        }
        for at in 0..count {
            starts[at + 1] += starts[at];
        }
        let mut next = starts.clone();
        let mut ends = vec![0; starts[count] as usize];
        for (from, to) in edges {
            let place = &mut next[from as usize];
            ends[*place as usize] = to;
            *place += 1;
        }
        Self { starts, ends }
    }

    /// Those of one state, in the order of the edges.
    pub fn of(&self, at: u32) -> &[u32] {
        &self.ends[self.starts[at as usize] as usize..self.starts[at as usize + 1] as usize]
    }
    /// Of each state, which states lead to it and are led to by it: the number of one of them, the same for all (Tarjan).
    pub fn components(&self) -> Vec<u32> {
        const NONE: u32 = u32::MAX;
        let count = self.starts.len() - 1;
        let (mut component, mut met) = (vec![NONE; count], vec![NONE; count]);
        // The first met of those that it leads to and that have no component yet.
        let mut least = vec![NONE; count];
        // States on the way, each with the next of its edges; and all that have no component yet, as they were met.
        let (mut way, mut open): (Vec<(u32, u32)>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut now = 0;
        for first in 0..count {
            let mut next = (met[first] == NONE).then_some(first);
            loop {
                if let Some(at) = next.take() {
                    (met[at], least[at]) = (now, now);
                    now += 1;
                    open.push(at as u32);
                    way.push((at as u32, self.starts[at]));
                }
                let Some((at, edge)) = way.last_mut() else { break };
                let here = *at as usize;
                if *edge < self.starts[here + 1] {
                    let to = self.ends[*edge as usize] as usize;
                    *edge += 1;
                    if met[to] == NONE {
                        next = Some(to);
                    } else if component[to] == NONE {
                        least[here] = least[here].min(met[to]);
                    }
                    continue;
                }
                way.pop();
                if let Some((before, _)) = way.last() {
                    let before = *before as usize;
                    least[before] = least[before].min(least[here]);
                }
                if least[here] == met[here] {
                    let from = open.iter().rposition(|at| *at as usize == here).unwrap_or_default();
                    open.drain(from..).for_each(|at| component[at as usize] = here as u32);
                }
            }
        }
        component
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use petgraph::algo::kosaraju_scc;
    use petgraph::graph::DiGraph;

    /// What leads to each other is one component, and nothing else is.
    #[test]
    fn components_are_those_of_another_algorithm() {
        let mut seed = 1u32;
        let mut random = |below: u32| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) % below
        };
        for round in 0..200 {
            let count = 1 + random(30);
            let edges: Vec<(u32, u32)> = (0..random(2 * count)).map(|_| (random(count), random(count))).collect();
            let own = Adjacency::new(count as usize, edges.iter().copied()).components();
            let mut graph = DiGraph::<(), ()>::from_edges(edges.iter().copied());
            while graph.node_count() < count as usize {
                graph.add_node(());
            }
            let mut other = vec![0; count as usize];
            for (number, states) in kosaraju_scc(&graph).into_iter().enumerate() {
                states.into_iter().for_each(|at| other[at.index()] = number);
            }
            for (a, b) in (0..count as usize).flat_map(|a| (0..count as usize).map(move |b| (a, b))) {
                assert_eq!(own[a] == own[b], other[a] == other[b], "{a} and {b} of round {round}: {edges:?}");
            }
        }
    }
}
