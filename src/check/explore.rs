//! The product, followed through every order of events and answers.
//!
//! What can be reached without anything failing is followed first, the shortest way first; then what failed applications
//! lead to, then failed undoings, then what is broken. A state belongs to the least of these over all ways to it.

use super::adjacency::Adjacency;
use super::bound::Bound;
use super::chunks::Chunks;
use super::edges::{Barred, Edge, NOWHERE, Tells};
use super::effort::{Far, Halt};
use super::frontier::Frontier;
use super::met::MetStates;
use super::outcome::WorldId;
use super::product::Product;
use super::report::Explored;
use super::shared_list::SharedList;
use super::state::{Failed, Move, Next, Nexts, ProductState, Reacts, Trouble};
use super::world::Top;
use crate::limits;
use crate::model::{Ask, ConfigId, EventName, Findings, Verdict};
use crate::stack::Requester;
use indexmap::IndexMap;
use rustc_hash::{FxBuildHasher, FxHashMap, FxHashSet};
use std::cell::OnceCell;
use std::ops::{Deref, DerefMut};
use std::rc::Rc;

/// Everything that was followed of a product.
pub struct Graph<'p, 'a> {
    /// The product.
    pub product: &'p mut Product<'a>,
    /// What was reached in it: another one may be put there.
    pub(super) reached: Reached,
}

/// What was reached: states, what leads from one to another, and what was found on the way.
#[derive(Default)]
pub struct Reached {
    /// The states, in the order they were met.
    pub states: MetStates,
    /// The worst that failed on the best way to each.
    pub failed: Vec<Failed>,
    /// Whether each was followed further.
    pub followed: Vec<bool>,
    /// What leads from one to another.
    pub edges: Chunks<Edge>,
    /// The moves that do, and why they lead none down that is being stopped.
    moves: IndexMap<Move, Option<Barred>, FxBuildHasher>,
    /// That of the edge before, and its number.
    last_move: Option<(Move, u32)>,
    /// What is wrong, and where.
    pub troubles: Vec<(u32, Trouble)>,
    /// What planning warns of, and where.
    pub warned: Vec<(u32, Rc<Findings>)>,
    /// Going round adds frames of this configuration.
    pub deep: Vec<(u32, ConfigId)>,
    /// States that are not followed on some way for a reason.
    pub ends: FxHashSet<u32>,
    /// What was cut off, and of what class it was.
    pub bounds: FxHashMap<Bound, Failed>,
    /// Edges that push a frame which nobody ever undoes: of which configuration, and by whom.
    pub(super) pushes: FxHashMap<(ConfigId, Requester), Vec<u32>>,
    /// In which worlds cycles that push one were gone round.
    pub(super) gone_round: FxHashMap<(ConfigId, Requester), FxHashSet<WorldId>>,
    /// How many transitions there were when the first was looked at that comes behind an undo that failed.
    pub(super) before_undo: Option<usize>,
    out: OnceCell<Adjacency>,
    into: OnceCell<Adjacency>,
    pub(super) depth: Vec<u32>,
    open: Frontier,
    /// For each class the shortest ways with nothing worse.
    pub(super) ways: FxHashMap<Failed, Ways>,
    /// Which steps of the simulated platform's reactions are done on edges on which nothing fails, by the reactions' places: in the order
    /// of the edges.
    reacts: Vec<(u32, u16)>,
    /// Events that let a subsystem go, and come to nothing there.
    pub(super) in_vain: Vec<(u32, EventName)>,
    /// What is told the parent on an edge.
    pub(super) told: FxHashMap<u32, SharedList<EventName>>,
    /// The cycles of edges that are gone round where an edge is no move.
    pub(super) rounds: FxHashMap<u32, Vec<u32>>,
}

/// By which edge each state is come to on the shortest way.
pub struct Ways {
    /// On those that a script can go.
    pub(super) shown: Vec<u32>,
    /// On any.
    pub(super) all: Vec<u32>,
}

impl Ways {
    /// Whether a script can go to a state.
    pub(super) fn shows(&self, at: u32) -> bool {
        at == 0 || self.shown[at as usize] != NOWHERE
    }
}

impl Reached {
    /// Whether it was not followed to its end: for there is more of it than is to be followed, or because it had to end.
    pub(super) fn is_cut_off(&self) -> bool {
        Bound::CUT_OFF.iter().any(|bound| self.bounds.contains_key(bound))
    }
}

impl Deref for Graph<'_, '_> {
    type Target = Reached;

    fn deref(&self) -> &Reached {
        &self.reached
    }
}

impl DerefMut for Graph<'_, '_> {
    fn deref_mut(&mut self) -> &mut Reached {
        &mut self.reached
    }
}

/// Follows everything, within the budget.
pub fn explore<'p, 'a>(product: &'p mut Product<'a>) -> Graph<'p, 'a> {
    let mut graph = Graph { product, reached: Reached::default() };
    match graph.product.start() {
        Some(start) => {
            let at = graph.reach(start, Failed::Nothing, 0);
            graph.cut_short(at, Failed::Nothing);
            graph.run();
            while graph.go_round() {
                graph.run();
            }
        }
        None => graph.cut(Bound::Entered, Failed::Nothing),
    }
    if graph.product.unjudged {
        graph.cut(Bound::Stands, Failed::Nothing);
    }
    graph
}

/// How many transitions, or states, are followed before those with at worst this failing come to their end: what fails is to be looked
/// at also where there is no end to what does not.
fn share_of(failed: Failed, of: usize) -> usize {
    let eighths = match failed {
        Failed::Nothing => 5,
        Failed::Apply => 6,
        Failed::Undo => 7,
        Failed::Broken => 8,
    };
    of / 8 * eighths + of % 8 * eighths / 8
}

impl Graph<'_, '_> {
    fn run(&mut self) {
        let mut looked_at = 0;
        while let Some((failed, at)) = self.open.pop() {
            if self.followed[at as usize] || failed > self.failed[at as usize] {
                continue;
            }
            let far = Far { states: self.states.len(), transitions: self.edges.len() };
            if !self.product.effort.goes_on(looked_at, far) {
                let halt = self.product.effort.halted();
                self.cut(if halt == Some(Halt::Memory) { Bound::Memory } else { Bound::Interrupted }, failed);
                continue;
            }
            looked_at += 1;
            if self.edges.len() + self.product.known_by() >= share_of(failed, self.product.effort.transitions()) {
                self.cut(Bound::Budget, failed);
                continue;
            }
            if self.states.len() >= share_of(failed, self.product.effort.states()) {
                self.cut(Bound::States, failed);
                continue;
            }
            self.expand(at, failed);
        }
    }

    /// Whether there is more of it than is to be followed.
    pub(super) fn is_used_up(&self) -> bool {
        [Bound::Budget, Bound::States].iter().any(|bound| self.bounds.contains_key(bound))
    }

    /// Something was left out that comes where at worst this failed.
    pub fn cut(&mut self, bound: Bound, failed: Failed) {
        let known = self.bounds.entry(bound).or_insert(failed);
        *known = failed.min(*known);
    }

    /// What follows from a state was not followed to its end, if more was on its way than is followed.
    fn cut_short(&mut self, at: u32, failed: Failed) {
        let overflow = std::mem::take(&mut self.product.overflow).then_some(Bound::Inbox);
        let forked = std::mem::take(&mut self.product.forked).then_some(Bound::Forks);
        for bound in overflow.into_iter().chain(forked) {
            self.ends.insert(at);
            self.cut(bound, failed);
        }
    }

    /// The number of a state that is reached with at worst this failing.
    pub(super) fn reach(&mut self, state: ProductState, failed: Failed, depth: u32) -> u32 {
        let (id, is_new) = self.states.meet(state);
        if is_new {
            self.failed.push(failed);
            self.depth.push(depth);
            self.followed.push(false);
            self.open.push(failed, depth, id);
        } else if (failed, depth) < (self.failed[id as usize], self.depth[id as usize]) && !self.followed[id as usize] {
            self.failed[id as usize] = failed;
            self.depth[id as usize] = depth;
            self.open.push(failed, depth, id);
        }
        id
    }

    fn expand(&mut self, at: u32, so_far: Failed) {
        let state = self.states[at as usize].clone();
        if state.waiting() > limits::CHECK_PILED {
            return self.cut(Bound::Piled, so_far);
        }
        self.followed[at as usize] = true;
        // Down, and not all is known: what is left is taken away by force.
        if self.product.worlds.top(state.world).is_some() && self.product.is_down(&state) {
            return;
        }
        let depth = self.depth[at as usize] + 1;
        if so_far >= Failed::Undo && self.before_undo.is_none() {
            self.before_undo = Some(self.edges.len());
            if self.is_lean(at) {
                self.cut(Bound::Lean, so_far);
            }
        }
        // Going back to a state that is known cuts nothing off.
        (self.product.overflow, self.product.forked) = (false, false);
        let nexts = self.nexts(at);
        self.cut_short(at, so_far);
        if nexts.cut && !self.is_lean(at) {
            self.cut(Bound::Waiting, so_far);
        }
        self.troubles.extend(nexts.troubles.into_iter().map(|trouble| (at, trouble)));
        self.warned.extend(nexts.warnings.into_iter().map(|warnings| (at, warnings)));
        let shows = self.product.shows(&state);
        let mut all = nexts.all;
        for (place, next) in all.drain(..).enumerate() {
            if let Some(deep) = next.deep.0 {
                // Of what was set aside the same may be applied anew without its frame being one more.
                if !state.aside {
                    self.deep.push((at, deep));
                }
                self.ends.insert(at);
                self.cut(Bound::Frames, so_far);
                continue;
            }
            // What is squashed is no more than it was for failures: they were followed with fewer frames in force. Those on a
            // round on which something fails lead round.
            let leads_round = next.failed <= Failed::Apply && so_far == Failed::Apply;
            if next.failed != Failed::Nothing && !leads_round && self.product.worlds.is_piled_up(state.world) {
                self.ends.insert(at);
                self.cut(Bound::Squashed, so_far);
                continue;
            }
            // Behind undoings that failed, each round would leave a frame more: two of them show what comes of it.
            if next.deep.1.is_some() && so_far >= Failed::Undo {
                self.ends.insert(at);
                self.cut(Bound::Left, so_far);
                continue;
            }
            for (request, verdict) in &next.answers {
                if let (Ask::Apply(id), Verdict::Ok) = (request.ask, verdict)
                    && !self.product.worlds.counts(id, request.requester)
                {
                    let edge = u32::try_from(self.edges.len()).unwrap_or(NOWHERE);
                    self.pushes.entry((id, request.requester)).or_default().push(edge);
                }
            }
            let reacts = match next.by {
                Move::Answer => self.product.reacts(&state, &next),
                _ => Reacts::new(),
            };
            let failed = next.failed;
            let quiet = failed == Failed::Nothing && matches!(next.by, Move::Answer | Move::Taken(..));
            let dropped = matches!(next.by, Move::Dropped(_));
            let shown = !next.state.aside && shows.shows(self.product, &state, &next);
            let (by, told) = (next.by, next.told.clone());
            let (mut next, class) = self.abstracted(next, so_far);
            next.aside &= self.product.worlds.top(next.world).is_none();
            if next.aside {
                self.cut(Bound::Aside, so_far.max(class));
            }
            // Behind undoings that failed it is taken down by force anyway: only operators mind.
            next.stopping &= so_far.max(class) < Failed::Undo || !self.product.operator.is_empty();
            let to = self.reach(next, so_far.max(class), depth);
            if class == Failed::Nothing && !reacts.is_empty() {
                let edge = u32::try_from(self.reached.edges.len()).unwrap_or(NOWHERE);
                self.reached.reacts.extend(reacts.into_iter().map(|reaction| (edge, reaction)));
            }
            let in_vain = told.iter().filter(|name| self.product.is_told_by_child(**name));
            self.reached.in_vain.extend(in_vain.map(|name| (at, *name)));
            if !told.is_empty() {
                self.reached.told.insert(u32::try_from(self.reached.edges.len()).unwrap_or(NOWHERE), told);
            }
            let by = self.moved(by);
            let barred = self.moves[by as usize].filter(|_| state.stopping);
            let tells = Tells { failed: class, quiet, barred, dropped, shown };
            self.edges.push(Edge::new(at, to, by, Some(place), tells));
        }
        self.product.spare = all;
    }

    /// The numbers of the edges from each state, once all were followed.
    pub(super) fn outgoing(&self) -> &Adjacency {
        let edges = || (0u32..).zip(self.edges.iter()).map(|(number, edge)| (edge.from, number));
        self.out.get_or_init(|| Adjacency::new(self.states.len(), edges()))
    }

    /// Of those to each state.
    pub(super) fn incoming(&self) -> &Adjacency {
        let edges = || (0u32..).zip(self.edges.iter()).map(|(number, edge)| (edge.to, number));
        self.into.get_or_init(|| Adjacency::new(self.states.len(), edges()))
    }

    /// What leads along an edge.
    pub(super) fn by(&self, edge: &Edge) -> Move {
        self.moves.get_index(edge.by() as usize).map_or(Move::Rounds, |(by, _)| *by)
    }

    fn moved(&mut self, by: Move) -> u32 {
        // Mostly there are several answers one after the other.
        if let Some((last, number)) = self.last_move
            && last == by
        {
            return number;
        }
        let known = self.moves.get_index_of(&by);
        let number = known.unwrap_or_else(|| self.reached.moves.insert_full(by, self.product.barred(by)).0);
        let number = u32::try_from(number).unwrap_or(NOWHERE);
        self.last_move = Some((by, number));
        number
    }

    /// A cycle is gone round so often that it leads there.
    pub(super) fn rounds_lead(&mut self, from: u32, to: u32, failed: Failed, shown: bool) {
        let by = self.moved(Move::Rounds);
        self.edges.push(Edge::new(
            from,
            to,
            by,
            None,
            Tells { failed, quiet: false, barred: None, dropped: false, shown },
        ));
    }

    /// Whether the step of a reaction is done on an edge, as far as nothing fails.
    pub(super) fn sets_off(&self, edge: usize, reaction: usize) -> bool {
        let of = u32::try_from(edge).ok().zip(u16::try_from(reaction).ok());
        of.is_some_and(|of| self.reacts.binary_search(&of).is_ok())
    }

    fn is_lean(&self, at: u32) -> bool {
        self.failed[at as usize] >= Failed::Undo
            && self.before_undo.is_some_and(|before| self.product.behind.is_lean(before))
    }

    /// What follows from a state: always the same.
    pub(super) fn nexts(&mut self, at: u32) -> Nexts {
        self.product.minds_elsewhere = self.failed[at as usize] == Failed::Nothing;
        let nexts = self.nexts_of(at);
        self.product.minds_elsewhere = true;
        nexts
    }

    fn nexts_of(&mut self, at: u32) -> Nexts {
        let lean = self.is_lean(at);
        let state = &self.reached.states[at as usize];
        if !lean {
            return self.product.nexts(state);
        }
        let most = std::mem::replace(&mut self.product.most_waiting, 1);
        self.product.races = false;
        let nexts = self.product.nexts(state);
        self.product.most_waiting = most;
        self.product.races = true;
        nexts
    }

    /// What an operator's safe configuration leads to is the operator's to deal with: not every request fits in there. Where
    /// following that is not easy, nothing is known from there on but that it is in force.
    fn abstracted(&mut self, next: Next, so_far: Failed) -> (ProductState, Failed) {
        let Next { mut state, failed, by_hand, .. } = next;
        self.product.forget_early(&mut state);
        if !by_hand || self.product.worlds.top(state.world).is_some() {
            return (state, failed);
        }
        if self.product.follows_by_hand {
            return (state, failed.max(Failed::Undo));
        }
        self.cut(Bound::ByHand, so_far);
        let top = Top { safe: true, actuator: self.product.worlds.has_actuator(state.world) };
        state.world = self.product.worlds.topped(top, std::iter::empty());
        state.change(|seldom| {
            seldom.unconfirmed.clear();
            // What it interrupts may be over before, or not have begun: all the same where nothing is known.
            seldom.safe.retain(|request| request.requester != Requester::Operator);
            seldom.in_transit.clear();
        });
        (state, failed.max(Failed::Undo))
    }

    /// The states, those with the least failing and the shortest ways first.
    pub fn in_order(&self) -> Vec<u32> {
        // By counting: ways are short, and three ask for it.
        let depths = self.depth.iter().max().map_or(0, |most| *most as usize + 1);
        let class = |(failed, depth): (&Failed, &u32)| *failed as usize * depths + *depth as usize;
        let classes = || self.failed.iter().zip(&self.depth).map(class);
        let mut places = vec![0u32; (Failed::Broken as usize + 1) * depths];
        classes().for_each(|class| places[class] += 1);
        let mut before = 0;
        places.iter_mut().for_each(|place| before += std::mem::replace(place, before));
        let mut order = vec![0; self.states.len()];
        for (at, class) in (0u32..).zip(classes()) {
            order[places[class] as usize] = at;
            places[class] += 1;
        }
        order
    }

    /// How far it went.
    pub fn explored(&self) -> Explored {
        let unfollowed = self.followed.iter().filter(|followed| !**followed).count();
        let with = self.followed.iter().zip(&self.failed);
        Explored {
            states: self.states.len(),
            transitions: self.edges.len(),
            complete: self.bounds.is_empty() && unfollowed == 0,
            unfollowed,
            without_failure: !with.into_iter().any(|(followed, failed)| !followed && *failed == Failed::Nothing),
        }
    }
}
