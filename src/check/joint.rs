//! Several coordinators followed together, and what is judged of it: none is refused anything because of another's frames,
//! each one's frames are what its own states lead to, and together they come up and down.

use super::Explored;
use super::explore::{Exploration, Failed};
use super::together::{Joint, Step, Together};
use super::world::Applied;
use crate::limits;
use crate::model::codes::{COORD_NO_WAY_DOWN, COORD_REFUSED_BY_OTHER, DEPLOY_NEVER_UP};
use crate::model::{Ask, Deployment, Finding, Findings};
use crate::stack::Requester;
use crate::statechart::Chart;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::VecDeque;

/// What following them together gave.
pub struct Followed {
    /// Findings, each with the way to it.
    pub findings: Vec<(Finding, Vec<String>)>,
    /// How far it went.
    pub explored: Explored,
}

struct Search<'p, 'a> {
    joint: &'p mut Together<'a>,
    states: Vec<Joint>,
    index: FxHashMap<Joint, u32>,
    from: Vec<Option<(u32, Step)>>,
    failed: Vec<Failed>,
    followed: Vec<bool>,
    edges: Vec<(u32, u32)>,
    clean: VecDeque<u32>,
    unclean: VecDeque<u32>,
    refused: Vec<(u32, Ask, u8, std::rc::Rc<Findings>)>,
    /// States that are not followed for a reason.
    ends: FxHashSet<u32>,
}

/// Follows them together, within the budget. `alone` is what each of them does alone.
pub fn follow(joint: &mut Together<'_>, alone: &[Exploration]) -> Followed {
    let mut search = Search {
        joint,
        states: Vec::new(),
        index: FxHashMap::default(),
        from: Vec::new(),
        failed: Vec::new(),
        followed: Vec::new(),
        edges: Vec::new(),
        clean: VecDeque::new(),
        unclean: VecDeque::new(),
        refused: Vec::new(),
        ends: FxHashSet::default(),
    };
    // One of them cannot be entered (said where its chart is compiled): there is nothing to follow, and nothing is known.
    let Some(start) = search.joint.start() else {
        return Followed { findings: Vec::new(), explored: Explored::default() };
    };
    search.reach(start, None, Failed::Nothing);
    while search.edges.len() < limits::CHECK_TRANSITIONS {
        let Some(at) = search.clean.pop_front().or_else(|| search.unclean.pop_front()) else { break };
        search.expand(at);
    }
    search.judge(alone)
}

impl Search<'_, '_> {
    fn reach(&mut self, state: Joint, from: Option<(u32, Step)>, failed: Failed) {
        let next = u32::try_from(self.states.len()).unwrap_or(u32::MAX);
        let id = *self.index.entry(state).or_insert_with_key(|state| {
            self.states.push(state.clone());
            next
        });
        if let Some((source, _)) = &from {
            self.edges.push((*source, id));
        }
        if id == next {
            self.from.push(from);
            self.failed.push(failed);
            self.followed.push(false);
            if failed == Failed::Nothing { self.clean.push_back(id) } else { self.unclean.push_back(id) }
        }
    }

    fn expand(&mut self, at: u32) {
        let state = self.states[at as usize].clone();
        let so_far = self.failed[at as usize];
        if state.waiting.len() > limits::CHECK_PILED {
            self.joint.overflow = true;
            return;
        }
        self.followed[at as usize] = true;
        if let Some(head) = state.waiting.first() {
            let (unit, by) = (head.unit.clone(), head.by);
            let (ok, fails) = match self.joint.head(&state) {
                Applied::Done { left: Some(_), may_fail, .. } if so_far == Failed::Undo => {
                    self.ends.insert(at);
                    (None, may_fail)
                }
                Applied::Done { world, may_fail, .. } => (Some(world), may_fail),
                Applied::Refused { which, findings } => {
                    self.refused.push((at, unit.asks[which.min(unit.asks.len() - 1)], by, findings));
                    (None, true)
                }
                Applied::TooDeep(_) => {
                    // Said of the one that goes round; what the others would do then is not known.
                    self.joint.overflow = true;
                    self.ends.insert(at);
                    (None, false)
                }
            };
            if let Some(world) = ok {
                let next = self.joint.answer(&state, true, world);
                self.reach(next, Some((at, Step::Answer(unit.clone(), by, true))), so_far);
            }
            if fails {
                let next = self.joint.answer(&state, false, state.world);
                let failed = so_far.max(Failed::of(&unit.asks));
                self.reach(next, Some((at, Step::Answer(unit, by, false))), failed);
            }
        }
        for (step, next) in self.joint.moves(&state) {
            self.reach(next, Some((at, step)), so_far);
        }
    }

    fn trace(&self, at: u32) -> Vec<String> {
        let mut lines = Vec::new();
        let mut at = at;
        while let Some((before, by)) = &self.from[at as usize] {
            lines.push(self.joint.tell_move(by, &self.states[at as usize]));
            at = *before;
        }
        lines.push(format!("start → {}", self.joint.place(&self.states[at as usize])));
        lines.reverse();
        lines
    }

    fn judge(self, alone: &[Exploration]) -> Followed {
        let unfollowed = self.followed.iter().filter(|followed| !**followed).count();
        let explored = Explored {
            states: self.states.len(),
            transitions: self.edges.len(),
            complete: unfollowed == 0 && !self.joint.overflow,
            unfollowed,
            without_failure: !self.followed.iter().zip(&self.failed).any(|(f, with)| !f && *with == Failed::Nothing),
            together: None,
        };
        let mut findings = Vec::new();
        self.refusals(alone, &mut findings);
        self.frames(alone, &mut findings);
        if explored.complete {
            self.ways(&mut findings);
        }
        findings.extend(self.joint.worlds.warnings.iter().cloned().map(|f| (f, Vec::new())));
        Followed { findings, explored }
    }

    /// Requests that are refused, and never are when their coordinator is alone.
    fn refusals(&self, alone: &[Exploration], findings: &mut Vec<(Finding, Vec<String>)>) {
        let mut said: FxHashSet<(Ask, u8)> = FxHashSet::default();
        for (at, ask, by, reasons) in &self.refused {
            let why = reasons.first().map_or_else(String::new, |f| f.message.clone());
            let Some(solo) = alone.get(usize::from(*by)) else { continue };
            if solo.refused.contains(&(*ask, why.clone())) || !said.insert((*ask, *by)) {
                continue;
            }
            let who = self.joint.members[usize::from(*by)].name;
            let others = self.holders(*at, *by);
            let message = format!("`{ask}` of `{who}` is refused because of the frames of {others}: {why}");
            let chart = self.joint.members[usize::from(*by)].chart;
            let name = ask.to_string();
            let site = chart.raises().iter().find(|site| site.name.as_str() == name);
            let mut finding = Finding::warning(COORD_REFUSED_BY_OTHER, message);
            if let Some(site) = site {
                finding = finding.at(site.origin).labelled("asked for here");
            }
            for reason in reasons.iter().filter(|reason| reason.origin.is_some()).take(3) {
                finding = finding.also(reason.origin, reason.message.clone());
            }
            findings.push((
                finding.help("give each coordinator components of its own, or let one ask the other by an event"),
                self.trace(*at),
            ));
        }
    }

    /// The other coordinators that have frames in force.
    fn holders(&self, at: u32, by: u8) -> String {
        let stack = &self.joint.worlds.get(self.states[at as usize].world).stack;
        let holds = |by: Requester| stack.frames().iter().any(|frame| frame.requester == by);
        let others = self.joint.members.iter().enumerate().filter(|(number, _)| *number != usize::from(by));
        let mut names: Vec<String> =
            others.filter(|(_, member)| holds(member.by)).map(|(_, member)| format!("`{}`", member.name)).collect();
        if names.is_empty() {
            names.push("the others".to_owned());
        }
        names.join(" and ")
    }

    /// At rest, what each has in force it could have alone, where it is.
    fn frames(&self, alone: &[Exploration], findings: &mut Vec<(Finding, Vec<String>)>) {
        if alone.iter().any(|solo| !solo.explored.complete) {
            return;
        }
        for (number, (member, solo)) in self.joint.members.iter().zip(alone).enumerate() {
            let strange = self.states.iter().enumerate().find(|(at, state)| {
                // Where undoing failed, frames are followed only so far.
                self.failed[*at] != Failed::Undo && Together::is_at_rest(state) && {
                    let own = self.joint.worlds.frames_of(member.by, state.world, member.undone.as_ref());
                    !solo.rest.contains(&(state.leaves[number], own))
                }
            });
            if let Some((at, state)) = strange {
                let at = u32::try_from(at).unwrap_or(u32::MAX);
                let own = self.joint.worlds.frames_of(member.by, state.world, member.undone.as_ref());
                let own: Vec<String> = own.iter().map(|id| format!("`{id}`")).collect();
                let leaf = state.leaves[number];
                let message = format!(
                    "`{}` in `{}` has {} in force, which it never has alone: that comes of {}",
                    member.name,
                    member.chart.fqn(leaf),
                    if own.is_empty() { "nothing".to_owned() } else { own.join(", ") },
                    self.holders(at, u8::try_from(number).unwrap_or(u8::MAX)),
                );
                findings.push((
                    Finding::warning(COORD_REFUSED_BY_OTHER, message)
                        .at(member.chart.origin(leaf))
                        .help("give each coordinator components of its own, or let one ask the other by an event"),
                    self.trace(at),
                ));
            }
        }
    }

    /// Together they come up, and from everywhere they can come down.
    fn ways(&self, findings: &mut Vec<(Finding, Vec<String>)>) {
        let joint = &*self.joint;
        let up = self.states.iter().zip(&self.failed).any(|(s, failed)| *failed == Failed::Nothing && joint.is_up(s));
        if !up {
            let last = self.states.iter().rposition(Together::is_at_rest).unwrap_or(0);
            let message = format!(
                "together the coordinators never come up: {} is as far as they get",
                joint.place(&self.states[last])
            );
            let finding = Finding::warning(DEPLOY_NEVER_UP, message)
                .at(joint.deployment.key_origin("deploy.up"))
                .path("deploy.up")
                .help("look at the trace: which event does one of them wait for that no other emits?");
            findings.push((finding, self.trace(u32::try_from(last).unwrap_or(0))));
        }
        let mut before: Vec<Vec<u32>> = vec![Vec::new(); self.states.len()];
        self.edges.iter().for_each(|(a, b)| before[*b as usize].push(*a));
        let mut reaches: Vec<bool> = self.states.iter().map(|s| joint.is_down(s)).collect();
        self.ends.iter().for_each(|at| reaches[*at as usize] = true);
        let mut open: Vec<usize> = (0..self.states.len()).filter(|at| reaches[*at]).collect();
        while let Some(at) = open.pop() {
            for b in &before[at] {
                if !std::mem::replace(&mut reaches[*b as usize], true) {
                    open.push(*b as usize);
                }
            }
        }
        let mut leads_on = vec![false; self.states.len()];
        self.edges.iter().for_each(|(a, _)| leads_on[*a as usize] = true);
        let lost = |at: &usize| !reaches[*at] && Together::is_at_rest(&self.states[*at]);
        // Where nothing leads on at all tells most.
        let lost =
            (0..self.states.len()).find(|at| lost(at) && !leads_on[*at]).or_else(|| (0..self.states.len()).find(lost));
        if let Some(at) = lost {
            let message = format!("from {} no way leads down together", joint.place(&self.states[at]));
            let finding = Finding::warning(COORD_NO_WAY_DOWN, message)
                .at(joint.deployment.key_origin("shutdown.down"))
                .path("shutdown.down")
                .help("look at the trace: which of them waits for the other, and for what?");
            findings.push((finding, self.trace(u32::try_from(at).unwrap_or(0))));
        }
    }
}

/// Whether so many coordinators are followed together at all.
pub fn few(deployment: &Deployment, charts: &[&Chart]) -> bool {
    deployment.coordinators.len() <= limits::CHECK_TOGETHER && charts.iter().all(|chart| chart.is_pure())
}
