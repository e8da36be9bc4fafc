//! How far stopping is: for who asks meanwhile, and for safety events that no coordinator hears any more.

use super::stages::Stage;
use crate::limits;
use crate::model::{ConfigId, EventName};
use crate::time::{Time, lock};
use rustc_hash::FxHashSet;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// What stopping is at: part of what `status --json` prints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoppingView {
    /// The stage.
    pub stage: Stage,
    /// A safe configuration holds what is left until somebody asks for force.
    pub held: bool,
    /// What it waits for: requests that are not answered.
    pub waits_for: Vec<String>,
}

/// Of one session.
#[derive(Default)]
pub(super) struct Halt {
    /// Declared safety events.
    safety: FxHashSet<EventName>,
    /// The safe configurations, in the order written.
    safe: Vec<ConfigId>,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Stopping has begun.
    began: bool,
    stage: Option<Stage>,
    held: bool,
    /// No coordinator leads any more.
    alone: bool,
    /// When one acted by itself last.
    acted: Option<Time>,
    /// What components reported since it began, each event once.
    reported: Vec<String>,
}

impl Halt {
    pub fn new(safety: impl IntoIterator<Item = EventName>, safe: Vec<ConfigId>) -> Self {
        Self { safety: safety.into_iter().collect(), safe, state: Mutex::default() }
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

    pub fn hold(&self, held: bool) {
        lock(&self.state).held = held;
    }

    /// Whether a coordinator still leads down.
    pub fn is_led(&self) -> bool {
        let state = lock(&self.state);
        state.began && !state.alone
    }

    /// An event came. What is to be applied since it is a safety event that nobody else acts on: again and again only after
    /// a while, however often it comes.
    pub fn heed(&self, event: EventName, now: Time) -> &[ConfigId] {
        if !self.safety.contains(&event) {
            return &[];
        }
        let mut state = lock(&self.state);
        if !state.alone || state.acted.is_some_and(|acted| now < acted + limits::SAFETY_AGAIN) {
            return &[];
        }
        state.acted = Some(now);
        &self.safe
    }

    /// A component raised an event.
    pub fn report(&self, event: EventName) {
        let mut state = lock(&self.state);
        if state.began
            && state.reported.len() < limits::REPORTED
            && !state.reported.iter().any(|known| known == event.as_str())
        {
            state.reported.push(event.to_string());
        }
    }

    /// What components reported since stopping began.
    pub fn reported(&self) -> Vec<String> {
        lock(&self.state).reported.clone()
    }

    pub fn view(&self, waits_for: Vec<String>) -> Option<StoppingView> {
        let state = lock(&self.state);
        state.stage.map(|stage| StoppingView { stage, held: state.held, waits_for })
    }
}
