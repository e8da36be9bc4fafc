//! Unknown outcomes, settled by what was read back; what cannot be settled is named.

use super::messages::{Poll, Question};
use super::run::StepsRun;
use super::{OpenQuestion, Transaction, TransactionPhase};
use crate::model::{ComponentName, Effect, RunState, Snapshot, Step};
use crate::system::touch::components;
use crate::system::{System, View as _, is_seen_so};

/// Whether a step happened.
enum SettledAs {
    Happened,
    DidNot,
    Nobody,
}

/// Whether a call names the condition that settles it.
fn is_asked(step: &Step, live: &System) -> bool {
    let Step::Operation(call) = step else { return false };
    let declared = live.component(step.component()).and_then(|node| node.ty.operations.get(&call.operation.member));
    declared.is_some_and(|operation| operation.settled_by.is_some())
}

impl Transaction {
    /// Settles unknown outcomes of the list in hand; what is to be done for it first, if anything is.
    pub(super) fn settle(&mut self, live: &mut System) -> Option<Poll> {
        if self.in_hand().unread.is_empty()
            || matches!(self.phase, TransactionPhase::Looking | TransactionPhase::LookingAgain | TransactionPhase::Over)
        {
            return None;
        }
        if self.reading {
            let Some(seen) = self.seen.take() else { return Some(Poll::Wait) };
            self.reading = false;
            self.in_hand_mut().settle_by(seen.as_ref(), live);
            return None;
        }
        if let Some(poll) = self.settle_by_questions(live) {
            return Some(poll);
        }
        if !self.in_hand_mut().settle_blind(live) {
            return None;
        }
        self.reading = true;
        let run = self.in_hand();
        let of = |i: u32| components(&run.list[i as usize].step);
        let mut about: Vec<ComponentName> = run.unread.iter().flat_map(|(i, _)| of(*i)).collect();
        about.sort_unstable();
        about.dedup();
        Some(Poll::Read(about))
    }

    /// The components of steps that failed.
    pub(super) fn failed_ones(&self) -> Vec<ComponentName> {
        let run = self.in_hand();
        let failed = run.failures.iter().flat_map(|(i, _)| components(&run.list[*i as usize].step));
        let mut failed: Vec<ComponentName> = failed.collect();
        failed.sort_unstable();
        failed.dedup();
        failed
    }

    /// What failed of a safe configuration and is as wanted all the same (an answer was wrong, or somebody else did it) counts
    /// as done. What nobody answers of stays as it was told.
    pub(super) fn review(&mut self, seen: Option<&Snapshot>, live: &mut System) {
        let (failed, mut actual) = (self.failed_ones(), live.clone());
        if seen.is_some_and(|seen| actual.adopt(&failed, seen).is_ok()) {
            self.in_hand_mut().review(&actual, live);
        }
    }

    /// Settles the calls that name the condition that settles them. None: there are none.
    fn settle_by_questions(&mut self, live: &mut System) -> Option<Poll> {
        let mut waits = false;
        let mut at = 0;
        while at < self.in_hand().unread.len() {
            let step = self.in_hand().unread[at].0;
            if !is_asked(&self.step(step).step, live) {
                at += 1;
                continue;
            }
            let question = Question::WasDone { step };
            let told = match self.asked.iter().find(|asked| asked.question == question) {
                // Nobody waits for anything any more.
                _ if self.taken_down => Some(None),
                Some(asked) => asked.told,
                None => {
                    self.asked.push(OpenQuestion { question, told: None });
                    return Some(Poll::Ask(question));
                }
            };
            let Some(is) = told else {
                waits = true;
                at += 1;
                continue;
            };
            self.asked.retain(|asked| asked.question != question);
            let settled = match is {
                Some(true) => SettledAs::Happened,
                Some(false) => SettledAs::DidNot,
                None => unread(&self.step(step).step, live).unwrap_or(SettledAs::Nobody),
            };
            self.in_hand_mut().settle(at, settled, live);
        }
        waits.then_some(Poll::Wait)
    }
}

/// What is known of a step of unknown outcome without reading anything; none: it must be read.
fn unread(step: &Step, live: &System) -> Option<SettledAs> {
    let Step::Operation(call) = step else { return None };
    // Nothing that can be observed tells whether it was called; what leaves nothing behind need not be known. What moves
    // may be moving still, though nothing undoes it.
    let declared = live.component(step.component()).and_then(|node| node.ty.operations.get(&call.operation.member));
    let leaves_nothing = declared.is_some_and(|operation| operation.effect == Effect::None && !operation.moves);
    Some(if leaves_nothing { SettledAs::DidNot } else { SettledAs::Nobody })
}

impl StepsRun {
    /// Settles what can be settled without reading. Answers whether something is left that must be read.
    pub(super) fn settle_blind(&mut self, live: &mut System) -> bool {
        let mut at = 0;
        while at < self.unread.len() {
            let i = self.unread[at].0;
            match unread(&self.list[i as usize].step, live) {
                None => at += 1,
                Some(settled) => self.settle(at, settled, live),
            }
        }
        !self.unread.is_empty()
    }

    /// Settles everything by what was read of its components; none: nobody answered.
    pub(super) fn settle_by(&mut self, seen: Option<&Snapshot>, live: &mut System) {
        while let Some((i, _)) = self.unread.last() {
            let i = *i;
            let settled = match seen {
                Some(seen) => self.judge(i, seen, live),
                None => SettledAs::Nobody,
            };
            self.settle(self.unread.len() - 1, settled, live);
        }
    }

    fn settle(&mut self, at: usize, settled: SettledAs, live: &mut System) {
        let (i, cause) = self.unread.remove(at);
        match settled {
            SettledAs::Happened => self.happened(i, live, false),
            SettledAs::DidNot => self.did_not_happen(i, cause, live),
            SettledAs::Nobody => self.leave_unsettled(i),
        }
    }

    /// Whether a step, which the model does not have yet, happened, from what was observed.
    fn judge(&mut self, i: u32, seen: &Snapshot, live: &mut System) -> SettledAs {
        let step = self.list[i as usize].step.clone();
        let component = step.component();
        let is = match (is_seen_so(&step, seen), &step) {
            // Not where it leads to: it did not happen only where the component has failed, or is where it was.
            (Some(false), Step::State { .. }) => match seen.components[&component].state {
                RunState::Faulted => {
                    self.made_faulted(component, live);
                    Some(false)
                }
                state => (live.component(component).map(|node| node.state) == Some(state)).then_some(false),
            },
            (is, _) => is,
        };
        match is {
            Some(true) => SettledAs::Happened,
            Some(false) => SettledAs::DidNot,
            None => SettledAs::Nobody,
        }
    }
}
