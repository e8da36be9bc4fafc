//! What configurations stand for (semantics: *Configurations*, `holds`): asked before they count as applied, watched while they are in force.

use super::conditions::{HoldsWatch, Standing, Truth};
use super::engine::Engine;
use super::progress::Progress;
use super::request::Reason;
use super::running::{AskedBatch, Running};
use crate::model::ConfigId;
use crate::stack::{is_stood_down, running_for};
use crate::system::View as _;
use crate::time::Time;
use crate::transaction::{Input, Question};
use std::sync::Arc;

impl Engine {
    /// A transaction asks what only the values of components can tell.
    pub(super) fn ask_condition(&mut self, running: &mut Running, question: Question) {
        let now = self.given.clock.now();
        let (condition, until) = match question {
            Question::Stands { part } => {
                let id = running.machine.planned().parts[part].pushes;
                let limit = running.machine.spec().limit(part);
                let until = if limit.until == Time::NEVER { now + limit.patience } else { limit.until };
                (id.and_then(|id| self.given.configurations.get(&id)?.holds.clone()), until)
            }
            Question::WasDone { step } => {
                let step = &running.machine.step(step).step;
                let node = self.world.system.component(step.component());
                let condition = match (node, step) {
                    (Some(node), crate::model::Step::Operation(call)) => node
                        .ty
                        .operations
                        .get(&call.operation.member)
                        .and_then(|operation| operation.settled_by_for(step.component())),
                    _ => None,
                };
                (condition, now + self.given.limits.step_timeout)
            }
        };
        match (condition, self.given.conditions.clone()) {
            (Some(condition), Some(conditions)) => {
                let number = self.number();
                conditions.begin(number, &condition);
                running.asked.push(AskedBatch { question, number, until });
            }
            // Nobody looks: nothing speaks against it, and nobody knows.
            _ => {
                let is = matches!(question, Question::Stands { .. }).then_some(true);
                running.machine.on(Input::Told { question, is }, &mut self.world.system);
            }
        }
    }

    /// Takes in answers to what was asked. True: there were some.
    pub(super) fn land_truths(&mut self, running: &mut Running) -> bool {
        let Some(conditions) = self.given.conditions.clone().filter(|_| !running.asked.is_empty()) else {
            return false;
        };
        let now = self.given.clock.now();
        let mut did = false;
        let mut at = 0;
        while at < running.asked.len() {
            let AskedBatch { question, number, until } = running.asked[at];
            let truth = conditions.truth(number);
            let late = now >= until;
            let told = match question {
                Question::Stands { .. } if truth.is == Some(true) => Some(Some(true)),
                Question::Stands { .. } => late.then_some(Some(false)),
                Question::WasDone { .. } => was_done(truth, late),
            };
            let Some(is) = told else {
                at += 1;
                continue;
            };
            running.asked.remove(at);
            match question {
                Question::Stands { part } if is == Some(true) => running.stood.push((part, number)),
                _ => conditions.end(number),
            }
            running.machine.on(Input::Told { question, is }, &mut self.world.system);
            did = true;
        }
        did
    }

    /// These conditions are of interest no more.
    pub(super) fn forget_conditions(&self, numbers: impl IntoIterator<Item = u64>) {
        let Some(conditions) = &self.given.conditions else { return };
        numbers.into_iter().for_each(|number| conditions.end(number));
    }

    /// A configuration was applied; with the number by which what it stands for is watched, if it stands for something.
    pub(super) fn applied(&mut self, id: ConfigId, number: Option<u64>) {
        self.forget_standing(id);
        let Some(number) = number else { return };
        let holds = self.given.configurations.get(&id).and_then(|c| c.holds.as_ref());
        let runs = holds.map_or_else(Vec::new, |holds| running_for(holds, &self.world.system));
        self.standings.of.insert(id, Standing { watch: HoldsWatch::On(number, None), runs, lost: false });
    }

    /// A configuration is no longer watched, and not lost.
    fn forget_standing(&mut self, id: ConfigId) {
        if self.standings.of.is_empty() {
            return;
        }
        if let (Some(Standing { watch: HoldsWatch::On(number, _), .. }), Some(conditions)) =
            (self.standings.of.remove(&id), &self.given.conditions)
        {
            conditions.end(number);
        }
    }

    /// Nothing is watched any more: everything is taken down.
    pub(super) fn forget_standings(&mut self) {
        let ids: Vec<ConfigId> = self.standings.of.keys().copied().collect();
        ids.into_iter().for_each(|id| self.forget_standing(id));
    }

    /// Whether anything is watched.
    pub(super) fn watches_any(&self) -> bool {
        !self.standings.of.is_empty()
    }

    /// Whether a configuration in force is lost.
    pub(super) fn is_lost(&self, id: ConfigId) -> bool {
        self.standings.of.get(&id).is_some_and(|standing| standing.lost)
    }

    /// Whether what a configuration in force stands for cannot be seen on this platform.
    pub(super) fn is_unseen(&self, id: ConfigId) -> bool {
        match (self.standings.of.get(&id).map(|standing| &standing.watch), &self.given.conditions) {
            (Some(HoldsWatch::On(number, _)), Some(conditions)) => conditions.truth(*number).unseen,
            _ => false,
        }
    }

    /// When what is watched must be looked at though nothing comes.
    pub(super) fn standing_until(&self) -> Time {
        let until = |standing: &Standing| match standing.watch {
            HoldsWatch::On(_, Some(until)) => until,
            _ => Time::NEVER,
        };
        self.standings.of.values().map(until).min().unwrap_or(Time::NEVER)
    }

    /// Watches what is in force and nothing is under way with, and nothing else.
    pub(super) fn review_standings(&mut self) {
        let seen = (self.numbers, self.running.iter().filter(|running| !running.over).count(), self.revision);
        if self.standings.of.is_empty() || self.standings.seen == seen {
            return;
        }
        let ids: Vec<ConfigId> = self.standings.of.keys().copied().collect();
        for id in ids {
            if !self.world.stack.is_in_force(id) {
                self.forget_standing(id);
                continue;
            }
            let worked_on = self.running.iter().any(|running| !running.over && self.works_on(running, id));
            let standing = &self.standings.of[&id];
            let stood_down = || is_stood_down(standing.runs.iter().copied(), &self.world.system);
            let next = match &standing.watch {
                HoldsWatch::On(..) if worked_on => HoldsWatch::Paused,
                HoldsWatch::On(..) | HoldsWatch::Paused if !worked_on && stood_down() => HoldsWatch::Over,
                HoldsWatch::Paused if !worked_on => {
                    let holds = self.given.configurations.get(&id).and_then(|c| c.holds.clone());
                    match (holds, self.given.conditions.clone()) {
                        (Some(holds), Some(conditions)) => {
                            let number = self.number();
                            conditions.begin(number, &holds);
                            HoldsWatch::On(number, Some(self.given.clock.now() + self.given.limits.step_timeout))
                        }
                        _ => HoldsWatch::Over,
                    }
                }
                _ => continue,
            };
            let standing = self.standings.of.get_mut(&id).expect("looked at just now");
            if let (HoldsWatch::On(number, _), Some(conditions)) =
                (std::mem::replace(&mut standing.watch, next), &self.given.conditions)
            {
                conditions.end(number);
            }
        }
        self.standings.seen = (self.numbers, seen.1, self.revision);
    }

    /// Tells of what is no longer so.
    pub(super) fn tell_fallen(&mut self) {
        let Some(conditions) = self.given.conditions.clone().filter(|_| !self.standings.of.is_empty()) else { return };
        let now = self.given.clock.now();
        let mut fallen: Vec<ConfigId> = Vec::new();
        for (id, standing) in &mut self.standings.of {
            let HoldsWatch::On(number, until) = &mut standing.watch else { continue };
            let truth = conditions.truth(*number);
            if truth.fell || truth.is != Some(true) && until.is_some_and(|until| now >= until) {
                fallen.push(*id);
            } else if truth.is == Some(true) {
                *until = None;
            }
        }
        for id in fallen {
            self.lose(id, Reason::StandsNoMore(id));
        }
    }

    /// What a configuration in force did or stands for is no longer so: told once until it is applied anew.
    pub(super) fn lose(&mut self, id: ConfigId, reason: Reason) {
        if self.is_lost(id) {
            return;
        }
        self.forget_standing(id);
        self.standings.of.insert(id, Standing { watch: HoldsWatch::Over, runs: Vec::new(), lost: true });
        self.changed();
        self.given.tells(|| Progress::Lost { configuration: id, reason: Arc::new(reason) });
    }

    /// What a configuration had done, and was not there any more, is so again. What it stands for is not watched before it is applied anew.
    pub(super) fn is_found_again(&mut self, id: ConfigId) {
        let stands = self.given.configurations.get(&id).is_some_and(|configuration| configuration.holds.is_some());
        if self.is_lost(id) && !stands {
            self.forget_standing(id);
            self.changed();
        }
    }

    /// Whether a transaction applies, undoes or replaces a configuration, or stops or destroys what it looks at.
    fn works_on(&self, running: &Running, id: ConfigId) -> bool {
        let planned = running.machine.planned();
        planned.parts.iter().any(|part| part.pushes == Some(id))
            || planned
                .popped
                .iter()
                .any(|frame| frame.configuration == id || frame.parts.iter().any(|p| p.configuration == id))
            || self.standings.of.get(&id).is_some_and(|standing| running.machine.stops_any(&standing.runs))
    }
}

/// What is known of a call, by its condition; none: to be waited for. What is not so yet may still come about.
fn was_done(truth: Truth, late: bool) -> Option<Option<bool>> {
    match truth.is {
        Some(_) if truth.unseen => Some(None),
        Some(true) => Some(Some(true)),
        Some(false) if late && truth.sampled => Some(Some(false)),
        _ => late.then_some(None),
    }
}
