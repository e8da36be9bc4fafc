//! The ways to what is found: the shortest one that a script can go, as far as each of its moves tells; else the shortest.

use super::edges::{Edge, NOWHERE};
use super::explore::{Graph, Ways};
use super::product::Product;
use super::state::{Failed, Move, Next, ProductState};
use super::trace::{Again, Happened, MoveReplay, TraceStep};
use crate::limits;
use crate::stack::Request;
use std::collections::VecDeque;

/// What happens on a way.
enum WayStep {
    /// A move.
    Move(Box<(ProductState, Next)>),
    /// A cycle is gone round so many times, and where that leads.
    Rounds(usize, Vec<(ProductState, Next)>, Box<ProductState>),
}

impl Product<'_> {
    /// The beginning of each way, as it is told.
    pub(super) fn begins(&self, start: &ProductState) -> TraceStep {
        let states = self.places(start);
        TraceStep { what: Happened::Start, states, hears: Vec::new(), replay: MoveReplay::default() }
    }

    /// A move as a step of a way.
    pub(super) fn step(&mut self, before: &ProductState, next: &Next, replay: MoveReplay) -> TraceStep {
        let (what, states) = (self.told(next), self.places(&next.state));
        TraceStep { what, states, hears: self.hears(before, next), replay }
    }
}

impl Graph<'_, '_> {
    /// The way to a state on which nothing worse fails than on the best one.
    pub fn trace(&mut self, at: u32) -> Vec<TraceStep> {
        self.trace_on(at, Vec::new())
    }

    /// The same, and on to where these moves lead from there, each with the state before it.
    pub fn trace_on(&mut self, at: u32, more: Vec<(ProductState, Next)>) -> Vec<TraceStep> {
        let mut parts: Vec<WayStep> = Vec::new();
        for number in self.edges_to(at) {
            let edge = self.edges[number as usize];
            let from = self.states[edge.from as usize].clone();
            let rounds = if edge.place().is_none() { self.rounds_of(number) } else { None };
            parts.push(match rounds {
                Some((times, cycle)) => {
                    let cycle = cycle.iter().map(|number| self.gone(*number)).collect();
                    WayStep::Rounds(times, cycle, Box::new(self.states[edge.to as usize].clone()))
                }
                None => WayStep::Move(Box::new((from, self.gone(number).1))),
            });
        }
        parts.extend(more.into_iter().map(|pair| WayStep::Move(Box::new(pair))));
        self.told_of(&parts)
    }

    /// The steps of a way.
    fn told_of(&mut self, parts: &[WayStep]) -> Vec<TraceStep> {
        let mut pairs: Vec<(&ProductState, &Next)> = Vec::new();
        for part in parts {
            match part {
                WayStep::Move(pair) => pairs.push((&pair.0, &pair.1)),
                WayStep::Rounds(times, cycle, _) => {
                    // The first and the last one may differ from those between: what is under way begins before, or ends later.
                    for _ in 0..(*times).min(limits::REPLAY_ROUNDS) {
                        pairs.extend(cycle.iter().map(|pair| (&pair.0, &pair.1)));
                    }
                }
            }
        }
        let mut replays = self.product.replay(&pairs).into_iter();
        let product = &mut *self.product;
        let mut step = |pair: &(ProductState, Next), replay: Option<MoveReplay>| {
            product.step(&pair.0, &pair.1, replay.unwrap_or_default())
        };
        let mut steps = Vec::new();
        for part in parts {
            match part {
                WayStep::Move(pair) => steps.push(step(pair, replays.next())),
                WayStep::Rounds(times, cycle, to) => {
                    let gone = (*times).min(limits::REPLAY_ROUNDS) * cycle.len();
                    let moves = cycle.iter().cycle().take(gone);
                    let all: Vec<TraceStep> = moves.map(|pair| step(pair, replays.next())).collect();
                    let at = all.last().map(|step| step.replay.at).unwrap_or_default();
                    let again = Again { times: *times, round: cycle.len(), steps: all };
                    let to = Next::plain(Move::Rounds, (**to).clone(), Failed::Nothing);
                    let told = step(
                        &(to.state.clone(), to),
                        Some(MoveReplay { at, again: Some(again), ..MoveReplay::default() }),
                    );
                    steps.push(TraceStep { what: Happened::Rounds { times: *times }, ..told });
                }
            }
        }
        steps.insert(0, self.product.begins(&self.states[0]));
        steps
    }

    /// These states, those with the least failing first, then those to which a script can go, then those with the shortest
    /// ways.
    pub fn best_first(&mut self, mut list: Vec<u32>) -> Vec<u32> {
        for class in [Failed::Nothing, Failed::Apply, Failed::Undo, Failed::Broken] {
            if list.iter().any(|at| self.failed[*at as usize] == class) {
                self.find_ways(class);
            }
        }
        list.sort_by_key(|at| {
            let class = self.failed[*at as usize];
            (class, !self.ways[&class].shows(*at), self.depth[*at as usize])
        });
        list
    }

    /// The move that an edge is, with the state before it.
    pub(super) fn gone(&mut self, number: u32) -> (ProductState, Next) {
        let edge = self.edges[number as usize];
        let (from, to) = (edge.from, edge.to);
        let next = edge.place().and_then(|place| self.nexts(from).all.into_iter().nth(place));
        let (before, state) = (self.states[from as usize].clone(), self.states[to as usize].clone());
        let next = next.unwrap_or_else(|| Next::plain(Move::Rounds, state.clone(), Failed::Nothing));
        (before, Next { state, ..next })
    }

    /// The edges of the way to a state.
    pub(super) fn edges_to(&mut self, at: u32) -> Vec<u32> {
        let class = self.failed[at as usize];
        self.find_ways(class);
        let ways = &self.ways[&class];
        let by = if ways.shows(at) { &ways.shown } else { &ways.all };
        let mut edges = Vec::new();
        let mut to = at;
        while by[to as usize] != NOWHERE {
            edges.push(by[to as usize]);
            to = self.edges[by[to as usize] as usize].from;
        }
        edges.reverse();
        edges
    }

    fn find_ways(&mut self, class: Failed) {
        if self.ways.contains_key(&class) {
            return;
        }
        let shown = self.search(|edge| edge.failed() <= class && edge.shown());
        let all = self.search(|edge| edge.failed() <= class);
        self.ways.insert(class, Ways { shown, all });
    }

    /// The shortest ways by such edges.
    fn search(&self, counts: impl Fn(&Edge) -> bool) -> Vec<u32> {
        let mut by = vec![NOWHERE; self.states.len()];
        let mut seen = vec![false; self.states.len()];
        let mut queue: VecDeque<u32> = VecDeque::from([0]);
        seen[0] = true;
        while let Some(at) = queue.pop_front() {
            for number in self.outgoing().of(at) {
                let edge = &self.edges[*number as usize];
                let to = edge.to;
                if counts(edge) && !std::mem::replace(&mut seen[to as usize], true) {
                    by[to as usize] = *number;
                    queue.push_back(to);
                }
            }
        }
        by
    }

    /// How many times a cycle is gone round from where an edge begins that is no move, and by which edges; none: it does not
    /// lead there by going round whole.
    fn rounds_of(&mut self, number: u32) -> Option<(usize, Vec<u32>)> {
        let Edge { from, to, .. } = self.edges[number as usize];
        let mut cycle = self.rounds.get(&number)?.clone();
        let first = cycle.iter().position(|edge| self.edges[*edge as usize].from == from)?;
        cycle.rotate_left(first);
        let mut requests: Vec<Vec<Request>> = Vec::new();
        for edge in &cycle {
            let answers = self.gone(*edge).1.answers;
            requests.push(answers.into_iter().filter(|(_, v)| v.is_success()).map(|(request, _)| request).collect());
        }
        let mut world = self.product.worlds.get(self.states[from as usize].world)?.clone();
        let wanted = self.states[to as usize].world;
        for times in 1..=self.product.deployment.limits.stack + 2 {
            if !requests.iter().all(|requests| self.product.worlds.carry_out(&mut world, requests)) {
                return None;
            }
            if self.product.worlds.met(world.clone()) == wanted {
                return Some((times, cycle));
            }
        }
        None
    }
}
