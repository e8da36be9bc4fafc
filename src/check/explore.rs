//! The product, followed through every order of events and answers.
//!
//! What can be reached with every request answered *ok* is followed first, the shortest way first; then what failures lead
//! to. So a finding's trace is short, and has a failure in it only where it needs one.

use super::Explored;
use super::coordinator::place;
use super::product::{Move, Product, State, Trouble};
use super::world::Applied;
use crate::limits;
use crate::model::codes::{COORD_LEFTOVERS, COORD_NO_WAY_DOWN, COORD_REQUEST_REFUSED, COORD_STACK_GROWS, COORD_STUCK};
use crate::model::{Ask, ComponentName, ConfigId, Finding, Findings};
use crate::statechart::{NodeId, RaiseSite, When};
use crate::system::View;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;

/// What was found, with the way there.
pub struct Exploration {
    /// Findings; each with a trace of its own.
    pub findings: Vec<(Finding, Vec<String>)>,
    /// How far it went.
    pub explored: Explored,
    /// Requests that were refused, with the first reason.
    pub refused: FxHashSet<(Ask, String)>,
    /// With nothing waiting: where the coordinator was, and which frames that it may undo were in force.
    pub rest: FxHashSet<(NodeId, Vec<ConfigId>)>,
}

/// The worst that failed on a way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Failed {
    /// Nothing did.
    Nothing,
    /// A configuration was not applied: to be expected, and the coordinator's to deal with.
    Apply,
    /// Something could not be undone: it stays in force, and not every coordinator can go on from there. A shutdown that
    /// gets stuck on it is forced.
    Undo,
}

impl Failed {
    /// What the failure of these is.
    pub fn of(asks: &[Ask]) -> Self {
        if asks.iter().all(|ask| matches!(ask, Ask::Apply(_))) { Self::Apply } else { Self::Undo }
    }
}

struct Search<'p, 'a> {
    product: &'p mut Product<'a>,
    states: Vec<State>,
    index: FxHashMap<State, u32>,
    /// How each state was first reached: from where, by what.
    from: Vec<Option<(u32, Move)>>,
    /// The worst that failed on the way to each, and whether it was followed further.
    with_failure: Vec<Failed>,
    followed: Vec<bool>,
    edges: Vec<(u32, u32)>,
    /// To be followed: reached without a failure, and with one.
    clean: VecDeque<u32>,
    failed: VecDeque<u32>,
    troubles: Vec<(u32, Trouble)>,
    cut: bool,
}

/// Follows everything, within the budget.
pub fn explore(product: &mut Product<'_>) -> Exploration {
    let mut search = Search {
        product,
        states: Vec::new(),
        index: FxHashMap::default(),
        from: Vec::new(),
        with_failure: Vec::new(),
        followed: Vec::new(),
        edges: Vec::new(),
        clean: VecDeque::new(),
        failed: VecDeque::new(),
        troubles: Vec::new(),
        cut: false,
    };
    search.run();
    search.judge()
}

impl Search<'_, '_> {
    fn run(&mut self) {
        let Some(start) = self.product.start() else {
            self.cut = true;
            return;
        };
        self.reach(start, None, Failed::Nothing);
        loop {
            if self.edges.len() >= limits::CHECK_TRANSITIONS && (!self.clean.is_empty() || !self.failed.is_empty()) {
                self.cut = true;
                return;
            }
            let Some(at) = self.clean.pop_front().or_else(|| self.failed.pop_front()) else { return };
            self.expand(at);
        }
    }

    fn reach(&mut self, state: State, from: Option<(u32, Move)>, failed: Failed) {
        let next = u32::try_from(self.states.len()).unwrap_or(u32::MAX);
        let id = *self.index.entry(state).or_insert_with_key(|state| {
            self.states.push(state.clone());
            next
        });
        let source = from.as_ref().map(|(at, _)| *at);
        if id == next {
            self.from.push(from);
            self.with_failure.push(failed);
            self.followed.push(false);
            if failed == Failed::Nothing { self.clean.push_back(id) } else { self.failed.push_back(id) }
        }
        if let Some(source) = source {
            self.edges.push((source, id));
        }
    }

    fn expand(&mut self, at: u32) {
        let state = self.states[at as usize].clone();
        if state.waiting.len() > limits::CHECK_PILED {
            self.cut = true;
            return;
        }
        self.followed[at as usize] = true;
        if let Some(head) = state.waiting.first() {
            let asks = head.asks.clone();
            let (ok, fails) = match self.product.head(&state) {
                // Behind undoings that failed, each round would leave a frame more: two of them show what comes of it.
                Applied::Done { left: Some(_), may_fail, .. } if self.with_failure[at as usize] == Failed::Undo => {
                    self.troubles.push((at, Trouble::Left));
                    (None, may_fail)
                }
                Applied::Done { world, may_fail, .. } => (Some(world), may_fail),
                Applied::Refused { which, findings } => {
                    self.troubles.push((at, Trouble::Refused(asks[which.min(asks.len() - 1)], findings)));
                    (None, true)
                }
                Applied::TooDeep(id) => {
                    self.troubles.push((at, Trouble::TooDeep(id)));
                    (None, false)
                }
            };
            if let Some(world) = ok {
                let next = self.product.answer(&state, true, world);
                self.reach(
                    next,
                    Some((at, Move::Answer { asks: asks.clone(), ok: true })),
                    self.with_failure[at as usize],
                );
            }
            if fails {
                let next = self.product.answer(&state, false, state.world);
                let failed = self.with_failure[at as usize].max(Failed::of(&asks));
                self.reach(next, Some((at, Move::Answer { asks, ok: false })), failed);
            }
        }
        if state.waiting.len() < limits::CHECK_WAITING {
            for event in self.product.reactions.offers(state.leaf).iter() {
                let next = self.product.event(&state, *event);
                self.reach(next, Some((at, Move::Event(*event))), self.with_failure[at as usize]);
            }
        }
    }

    fn trace(&self, at: u32) -> Vec<String> {
        let mut lines = Vec::new();
        let mut at = at;
        while let Some((before, by)) = &self.from[at as usize] {
            lines.push(self.product.tell(by, &self.states[at as usize]));
            at = *before;
        }
        lines.push(format!("start → {}", self.product.chart.fqn(self.states[at as usize].leaf)));
        lines.reverse();
        lines
    }

    fn judge(self) -> Exploration {
        let mut findings: Vec<(Finding, Vec<String>)> = Vec::new();
        let mut said: FxHashSet<(Ask, String)> = FxHashSet::default();
        let mut deep: FxHashSet<ConfigId> = FxHashSet::default();
        for (at, trouble) in &self.troubles {
            match trouble {
                Trouble::Refused(ask, reasons) => {
                    let first = reasons.first().map_or_else(String::new, |f| f.message.clone());
                    if said.insert((*ask, first)) {
                        let failed = self.with_failure[*at as usize] != Failed::Nothing;
                        findings.push((self.refused(*at, *ask, reasons), self.trace(*at)));
                        // The reasons are findings of their own, each at its place.
                        for reason in reasons.iter().filter(|r| !failed && r.origin.is_some()) {
                            findings.push((reason.clone(), self.trace(*at)));
                        }
                    }
                }
                Trouble::Left => {}
                Trouble::TooDeep(id) => {
                    if deep.insert(*id) {
                        let origin = self.product.deployment.configuration(*id).map(|c| c.origin).unwrap_or_default();
                        let message = format!("going round applies `{id}` again and again without undoing it");
                        let finding = Finding::warning(COORD_STACK_GROWS, message).at(origin).help(format!(
                            "undo it on the way round, give it a group, or scope it to a state with `config = \"{id}\"`"
                        ));
                        findings.push((finding, self.trace(*at)));
                    }
                }
            }
        }
        self.ways_down(&mut findings);
        findings.extend(self.product.worlds.warnings.iter().cloned().map(|f| (f, Vec::new())));
        let explored = Explored {
            states: self.states.len(),
            transitions: self.edges.len(),
            complete: !self.cut,
            unfollowed: self.followed.iter().filter(|followed| !**followed).count(),
            without_failure: !self
                .followed
                .iter()
                .zip(&self.with_failure)
                .any(|(f, with)| !f && *with == Failed::Nothing),
            together: None,
        };
        let by = super::world::requester(self.product.deployment);
        let mut rest = FxHashSet::default();
        for state in self.states.iter().filter(|state| state.waiting.is_empty()) {
            rest.insert((state.leaf, self.product.worlds.frames_of(by, state.world, None)));
        }
        Exploration { findings, explored, refused: said, rest }
    }

    fn refused(&self, at: u32, ask: Ask, reasons: &Findings) -> Finding {
        let state = &self.states[at as usize];
        let chart = self.product.chart;
        let owner = state.waiting.first().and_then(|u| u.asks.iter().position(|a| *a == ask).and_then(|i| u.owners[i]));
        let site = self.site(ask, owner);
        let message =
            format!("`{ask}` is refused when it is asked for: {}", reasons.first().map_or("", |f| &f.message));
        let mut finding = match self.with_failure[at as usize] {
            Failed::Nothing => Finding::error(COORD_REQUEST_REFUSED, message),
            Failed::Apply => Finding::warning(COORD_REQUEST_REFUSED, message),
            Failed::Undo => Finding::info(COORD_REQUEST_REFUSED, message),
        };
        if let Some(site) = site {
            finding = finding.at(site.origin).labelled("asked for here").path(place(chart, site.when));
        }
        for reason in reasons.iter().take(3) {
            if reason.origin.is_some() {
                finding = finding.also(reason.origin, reason.message.clone());
            }
        }
        let help = reasons.first().and_then(|f| f.help.clone());
        finding.help(help.unwrap_or_else(|| "ask for it where it fits the system".to_owned()))
    }

    /// The place that made a request, as far as it can be told.
    fn site(&self, ask: Ask, owner: Option<NodeId>) -> Option<&RaiseSite> {
        let name = ask.to_string();
        let sites = || self.product.chart.raises().iter().filter(|s| s.name.as_str() == name);
        sites().find(|s| matches!(s.when, When::Entry(n) if Some(n) == owner)).or_else(|| sites().next())
    }

    /// Where nothing leads on, where no way leads down, and ways down that leave something behind.
    fn ways_down(&self, findings: &mut Vec<(Finding, Vec<String>)>) {
        let product = &*self.product;
        let is_down = |s: &State| product.is_down(s);
        let mut out = vec![false; self.states.len()];
        self.edges.iter().for_each(|(a, _)| out[*a as usize] = true);
        let troubled: FxHashSet<u32> = self.troubles.iter().map(|(at, _)| *at).collect();
        let mut leaves: FxHashSet<NodeId> = FxHashSet::default();
        for (at, state) in self.states.iter().enumerate() {
            let id = u32::try_from(at).unwrap_or(u32::MAX);
            if !out[at] && self.followed[at] && !is_down(state) && !troubled.contains(&id) && leaves.insert(state.leaf)
            {
                let fqn = product.chart.fqn(state.leaf);
                let finding = Finding::warning(COORD_STUCK, format!("nothing leads on from `{fqn}`"))
                    .at(product.chart.origin(state.leaf))
                    .path(format!("coordinator.{fqn}"))
                    .help(format!("add a transition from it, at least on `{}`", product.deployment.shutdown.event));
                findings.push((finding, self.trace(id)));
            }
        }
        if let Some((at, left)) = self.states.iter().enumerate().find_map(|(at, state)| {
            let left = is_down(state).then(|| self.components(state)).filter(|l| !l.is_empty())?;
            Some((u32::try_from(at).ok()?, left))
        }) {
            let names: Vec<String> = left.iter().take(6).map(ToString::to_string).collect();
            let more = if left.len() > 6 { format!(" and {} more", left.len() - 6) } else { String::new() };
            let finding =
                Finding::warning(COORD_LEFTOVERS, format!("a way down leaves {}{more} behind", names.join(", ")))
                    .at(product.deployment.key_origin("shutdown.down"))
                    .path("shutdown.down")
                    .help("let every way down undo or destroy what was applied on the way up; else shutdown is forced");
            findings.push((finding, self.trace(at)));
        }
        // Backwards from everything that is down; what is not met has no way. Only what was followed to the end counts.
        if self.cut {
            return;
        }
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.states.len()];
        self.edges.iter().for_each(|(a, b)| before[*b as usize].push(*a));
        let mut reaches: Vec<bool> = self.states.iter().map(&is_down).collect();
        let mut next: Vec<usize> = (0..self.states.len()).filter(|i| reaches[*i]).collect();
        next.extend(troubled.iter().map(|at| *at as usize));
        while let Some(at) = next.pop() {
            for b in &before[at] {
                if !std::mem::replace(&mut reaches[*b as usize], true) {
                    next.push(*b as usize);
                }
            }
        }
        let lost = (0..self.states.len()).find(|at| {
            let id = u32::try_from(*at).unwrap_or(u32::MAX);
            !reaches[*at] && !troubled.contains(&id) && !leaves.contains(&self.states[*at].leaf)
        });
        if let Some(at) = lost {
            let leaf = self.states[at].leaf;
            let fqn = product.chart.fqn(leaf);
            let finding = Finding::warning(
                COORD_NO_WAY_DOWN,
                format!("from `{fqn}` no way leads to `{}`", product.deployment.first_coordinator().down),
            )
            .at(product.chart.origin(leaf))
            .path(format!("coordinator.{fqn}"))
            .also(product.deployment.key_origin("shutdown.down"), "the state that means down")
            .help("add transitions that lead down from there");
            findings.push((finding, self.trace(u32::try_from(at).unwrap_or(0))));
        }
    }

    fn components(&self, state: &State) -> Vec<ComponentName> {
        let mut names = Vec::new();
        self.product.worlds.get(state.world).system.for_each_component(&mut |node| names.push(node.name));
        names.sort_unstable();
        names
    }
}
