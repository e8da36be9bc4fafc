//! How far stopping is: for who asks meanwhile, and for safety events that no coordinator hears any more.

use super::stages::Stage;
use crate::limits;
use crate::model::{ConfigId, EventName, RequestId};
use crate::time::{Time, lock};
use rustc_hash::FxHashSet;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// What stopping is at: part of what `status --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StoppingView {
    /// The stage.
    pub stage: Stage,
    /// A safe configuration holds what is left until somebody asks for force.
    pub held: bool,
    /// Which one does, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_by: Option<String>,
    /// What it waits for: requests that are not answered.
    pub waits_for: Vec<String>,
    /// The time of the first stage stands still.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stands_still: Option<StandsStill>,
}

impl StoppingView {
    /// Why nothing goes on before somebody decides; none: it goes on.
    pub fn stands_still(&self) -> Option<String> {
        let held = || {
            let by = self.held_by.as_deref().unwrap_or("a safe configuration is in force");
            format!("{by}, and holds what is left: `davit shutdown --force`, or a signal, lets go")
        };
        self.stands_still.as_ref().map(ToString::to_string).or_else(|| self.held.then(held))
    }
}

/// Why the time of the first stage stands still: people decide how it goes on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StandsStill {
    /// The safe configuration that has come since stopping began, and is in force.
    pub safe: String,
    /// Since when, in seconds of its clock.
    pub since: f64,
    /// What leads on from there.
    pub leads_on: String,
}

impl std::fmt::Display for StandsStill {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "`{}` is in force since {:.3} s, and nothing goes on before somebody asks for it: {}",
            self.safe, self.since, self.leads_on
        )
    }
}

/// Of one session.
#[derive(Default)]
pub(super) struct StoppingState {
    /// Declared safety events.
    safety: FxHashSet<EventName>,
    /// The safe configurations, in the order written.
    safe: Vec<ConfigId>,
    state: Mutex<HaltState>,
}

/// What a safety event does that acts by itself.
pub(super) struct Heeded<'h> {
    /// The requests that it made, or those of the one with which it is one.
    pub requests: Vec<RequestId>,
    /// What is to be applied with these numbers; nothing: that has been asked for.
    pub apply: &'h [ConfigId],
}

#[derive(Default)]
struct HaltState {
    /// Stopping has begun.
    began: bool,
    stage: Option<Stage>,
    /// What holds what is left until somebody asks for force, in words.
    held_by: Option<String>,
    /// No coordinator leads any more.
    alone: bool,
    /// When one acted by itself last, and the requests that it made.
    acted: Option<(Time, Vec<RequestId>)>,
    /// What components reported since it began, each event once.
    reported: Vec<EventName>,
}

impl StoppingState {
    pub fn new(safety: impl IntoIterator<Item = EventName>, safe: Vec<ConfigId>) -> Self {
        Self { safety: safety.into_iter().collect(), safe, state: Mutex::default() }
    }

    /// Whether an event is declared as one of safety.
    pub fn is_safety(&self, event: EventName) -> bool {
        self.safety.contains(&event)
    }

    pub fn begin(&self) {
        lock(&self.state).began = true;
    }

    pub fn has_begun(&self) -> bool {
        lock(&self.state).began
    }

    /// A stage begins; from the second on safety events act by themselves.
    pub fn stage(&self, stage: Stage) {
        let mut state = lock(&self.state);
        state.stage = Some(stage);
        state.alone = stage != Stage::Led;
    }

    /// Somebody has to ask for force from now on, since that holds what is left; none: not any more.
    pub fn hold(&self, by: Option<String>) {
        lock(&self.state).held_by = by;
    }

    /// Whether what is left is held until somebody asks for force.
    pub fn is_held(&self) -> bool {
        lock(&self.state).held_by.is_some()
    }

    /// Whether a coordinator still leads down.
    pub fn is_led(&self) -> bool {
        let state = lock(&self.state);
        state.began && !state.alone
    }

    /// An event came. What is to be applied since it is a safety event that nobody else acts on, with numbers for these requests
    /// from `number`. However often one comes, it acts once in a while: in between it is one with the one that has acted, unless
    /// `anew` says of its requests that they did not make everything safe.
    /// None: it is no such event, or a coordinator acts on it.
    pub fn heed(
        &self,
        event: EventName,
        now: Time,
        anew: impl FnOnce(&[RequestId]) -> bool,
        mut number: impl FnMut() -> RequestId,
    ) -> Option<Heeded<'_>> {
        let mut state = lock(&self.state);
        if !self.safety.contains(&event) || !state.alone {
            return None;
        }
        if let Some((acted, requests)) = &state.acted
            && now < *acted + limits::SAFETY_AGAIN
            && !anew(requests)
        {
            return Some(Heeded { requests: requests.clone(), apply: &[] });
        }
        let requests: Vec<RequestId> = self.safe.iter().map(|_| number()).collect();
        state.acted = Some((now, requests.clone()));
        Some(Heeded { requests, apply: &self.safe })
    }

    /// A component raised an event.
    pub fn report(&self, event: EventName) {
        let mut state = lock(&self.state);
        if state.began && state.reported.len() < limits::REPORTED && !state.reported.contains(&event) {
            state.reported.push(event);
        }
    }

    /// What components reported since stopping began.
    pub fn reported(&self) -> Vec<String> {
        lock(&self.state).reported.iter().map(ToString::to_string).collect()
    }

    pub fn view(&self, waits_for: Vec<String>) -> Option<StoppingView> {
        let state = lock(&self.state);
        let held_by = state.held_by.clone();
        state.stage.map(|stage| StoppingView { stage, held: held_by.is_some(), held_by, waits_for, stands_still: None })
    }
}
