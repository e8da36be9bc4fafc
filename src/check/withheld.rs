//! What moves and is interrupted by something safe is not taken back unasked. No step fails on the way there: a call that lasts is enough.
//! So whoever leads down has to ask for its undo by its name; who asks for what it stands in the way of is refused.
//!
//! Behind such an end nothing is known ([`Top`](super::world::Top)), so no refusal is met there: whether the undo is asked for first is seen
//! from the requests, and whether it stands in the way from the frames that there are without the emergency.

use super::edges::Edge;
use super::explore::Graph;
use super::judge::Traced;
use super::outcome::WorldId;
use super::product::as_begun;
use super::state::{Failed, Move, Next, ProductState};
use crate::model::codes::COORD_REQUEST_REFUSED;
use crate::model::{Ask, ConfigId, Finding, Severity};
use crate::stack::{Barring, Request, Requester};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::{BTreeMap, VecDeque};

/// Something that moves and may be left by an interruption.
struct LeftMoving {
    id: ConfigId,
    by: Requester,
    undo: bool,
    /// As it stands in the way where it is left.
    barring: Barring,
}

/// What is interrupted in states, by what and whose it is, and what it bars.
type Interruptions = BTreeMap<(ConfigId, Requester, bool, Vec<ConfigId>), (Barring, Vec<u32>)>;

fn asks(state: &ProductState, is: impl Fn(&Request) -> bool) -> Option<Request> {
    let under_way = state.desk.under_way().iter().flat_map(|turn| &turn.batch.requests);
    let waiting = state.desk.waiting().chain(state.in_transit.iter()).flat_map(|batch| &batch.requests);
    under_way.chain(waiting).find(|request| is(request)).copied()
}

impl Graph<'_, '_> {
    /// That something is left in the way though no step fails.
    pub(super) fn withheld(&mut self, found: &mut Traced) {
        for ((id, by, undo, _), (barring, at)) in self.interruptions() {
            let left = LeftMoving { id, by, undo, barring };
            let Some((way, asked)) = self.way_to_refusal(&left, &at) else { continue };
            let Some(number) = self.product.member(by) else { continue };
            let site = self.site(number, &asked).map(|site| site.origin).unwrap_or_default();
            let is_said = |finding: &Finding| {
                finding.code == COORD_REQUEST_REFUSED && finding.severity >= Severity::Warning && finding.origin == site
            };
            if found.iter().any(|(finding, _)| is_said(finding)) {
                continue;
            }
            let from = self.edges[way[0] as usize].from;
            let moves: Vec<(ProductState, Next)> = way.iter().map(|number| self.gone(*number)).collect();
            let trace = self.trace_on(from, moves);
            found.push((self.left_in_the_way(&left, &asked).at(site).labelled("asked for here"), trace));
        }
    }

    fn left_in_the_way(&self, left: &LeftMoving, asked: &Request) -> Finding {
        let LeftMoving { id, undo, barring, .. } = left;
        let (ask, undone) = (asked.ask, Ask::UndoOf(*id));
        let why = barring.of.iter().find(|(of, _)| Ask::UndoOf(*of) == ask).map_or("", |(_, why)| why.as_str());
        let when = if *undo { "undone" } else { "applied" };
        let message = format!(
            "`{ask}` is refused where something safe comes while `{id}` is being {when}: `{}` moves and is not done unasked, \
             and {why}",
            barring.moves
        );
        let help = format!(
            "ask for `{undone}` before `{ask}` on every way down, also behind an emergency, and go on by `{}`, `{}` and `{}`: \
             where nothing of it is left, it is answered as done",
            undone.done().event(undone),
            undone.failed().event(undone),
            undone.broken().event(undone)
        );
        let origin = self.product.worlds.configuration(*id).map(|c| c.origin).unwrap_or_default();
        Finding::warning(COORD_REQUEST_REFUSED, message).also(origin, "what moves").help(help)
    }

    /// Where something that moves is interrupted, with no failure before.
    fn interruptions(&mut self) -> Interruptions {
        let mut all = Interruptions::new();
        let mut known: FxHashMap<(WorldId, Request), Option<Barring>> = FxHashMap::default();
        for at in 0..u32::try_from(self.states.len()).unwrap_or(u32::MAX) {
            if self.failed[at as usize] != Failed::Nothing || self.states[at as usize].interrupted.is_empty() {
                continue;
            }
            let state = self.states[at as usize].clone();
            for interrupted in &state.interrupted {
                let Some(active) = state.desk.active(interrupted.number) else { continue };
                // Who has asked for its undo since then asks for it again when that is answered.
                if active.given_up.len() > interrupted.given_up {
                    continue;
                }
                for request in &active.batch.requests {
                    let (Ask::Apply(id) | Ask::UndoOf(id)) = request.ask else { continue };
                    let by = request.requester;
                    if self.product.member(by).is_none() {
                        continue;
                    }
                    let world = match request.ask.is_undo() {
                        true => interrupted.planned,
                        false => {
                            let begun = as_begun(&state.desk, &state, interrupted.number);
                            let asks = self.product.desks.asks_of(&state.desk, interrupted.number);
                            self.product.worlds.comes(interrupted.planned, &asks, &begun).done.world
                        }
                    };
                    let of = || self.product.worlds.get(world)?.barring(id, by);
                    let Some(barring) = known.entry((world, Request { tag: (0, 0), ..*request })).or_insert_with(of)
                    else {
                        continue;
                    };
                    let bars = barring.of.iter().map(|(of, _)| *of).collect();
                    let of = all.entry((id, by, request.ask.is_undo(), bars));
                    of.or_insert_with(|| (barring.clone(), Vec::new())).1.push(at);
                }
            }
        }
        all
    }

    /// From these states, where it is interrupted, by which edges it goes on to where something is asked for that it stands in the way of
    /// before its own undo is: if there is such a way, by those that a script can go.
    fn way_to_refusal(&mut self, left: &LeftMoving, at: &[u32]) -> Option<(Vec<u32>, Request)> {
        let best = self.best_first(at.to_vec());
        self.way_by(left, &best, true).or_else(|| self.way_by(left, &best, false))
    }

    fn way_by(&self, left: &LeftMoving, best: &[u32], shown: bool) -> Option<(Vec<u32>, Request)> {
        let own = |request: &Request| request.requester == left.by;
        let bars =
            |request: &Request| own(request) && left.barring.of.iter().any(|(of, _)| request.ask == Ask::UndoOf(*of));
        let takes_back = |request: &Request| {
            own(request) && request.scope.is_none() && [Ask::Undo, Ask::UndoOf(left.id)].contains(&request.ask)
        };
        let is_it = |request: &Request| {
            own(request) && matches!(request.ask, Ask::Apply(of) | Ask::UndoOf(of) if of == left.id)
        };
        let stays = if left.undo { Failed::Undo } else { Failed::Broken };
        let mut came: FxHashMap<u32, u32> = FxHashMap::default();
        let mut open: VecDeque<u32> = VecDeque::new();
        let goes = |edge: &Edge| edge.place().is_some() && (edge.shown() || !shown);
        for at in best {
            for number in self.outgoing().of(*at) {
                let edge = &self.edges[*number as usize];
                let goes_on = edge.failed() >= stays && self.by(edge) == Move::Answer && goes(edge);
                let over = asks(&self.states[edge.to as usize], is_it).is_none();
                if goes_on && over && !came.contains_key(&edge.to) {
                    came.insert(edge.to, *number);
                    open.push_back(edge.to);
                }
            }
        }
        let first: FxHashSet<u32> = open.iter().copied().collect();
        while let Some(at) = open.pop_front() {
            let state = &self.states[at as usize];
            if asks(state, takes_back).is_some() {
                continue;
            }
            if let Some(asked) = asks(state, bars) {
                let mut way = vec![came[&at]];
                let mut to = at;
                while !first.contains(&to) {
                    to = self.edges[came[&to] as usize].from;
                    way.push(came[&to]);
                }
                way.reverse();
                return Some((way, asked));
            }
            for number in self.outgoing().of(at) {
                let edge = &self.edges[*number as usize];
                if edge.failed() == Failed::Nothing && goes(edge) && !came.contains_key(&edge.to) {
                    came.insert(edge.to, *number);
                    open.push_back(edge.to);
                }
            }
        }
        None
    }
}
