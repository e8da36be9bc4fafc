//! Plans as other programs see them.

use crate::app::Application;
use crate::model::{Ask, Snapshot};
use crate::plan::{PlanStage, PlannedStep};
use crate::system::Undo;
use serde::Serialize;
use serde_json::{Map, Value as Json, json};
use std::collections::BTreeSet;

/// An object of `plan --json`.
#[derive(Serialize)]
pub struct PlanView<'a> {
    configuration: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    coordinator: Option<&'a str>,
    requests: Vec<String>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    events: &'a [String],
    #[serde(skip_serializing_if = "Option::is_none")]
    state: Option<&'a str>,
    steps: Vec<Map<String, Json>>,
    result: &'a Snapshot,
}

impl<'a> PlanView<'a> {
    /// The view of one application.
    pub fn new(planned: &'a Application) -> Self {
        // The configuration that is applied, else the one that is undone.
        let configurations = || planned.asks.iter().filter(|ask| matches!(ask, Ask::Apply(_) | Ask::UndoOf(_)));
        let one = configurations().find(|ask| !ask.is_undo()).or_else(|| configurations().next());
        let configuration = match one {
            Some(Ask::Apply(id) | Ask::UndoOf(id)) => id.to_string(),
            _ => String::new(),
        };
        Self {
            configuration,
            coordinator: planned.coordinator.as_deref(),
            requests: planned.asks.iter().map(ToString::to_string).collect(),
            events: &planned.events,
            state: planned.state.as_deref(),
            steps: SystemSteps::new(&planned.steps).map(|s| s.view(&planned.steps)).collect(),
            result: &planned.result,
        }
    }
}

/// The steps of a plan with their order complete: `after` and `stage` together say all there is to say.
///
/// The planner also knows barriers inside a stage (a list of run states is worked off entry by entry). Here a step after
/// such a barrier is after the last steps before it. Where a transaction undoes one configuration and applies another, the
/// stages of both do not follow each other: then everything counts as changes.
pub struct SystemSteps<'a> {
    steps: &'a [PlannedStep],
    next: usize,
    before: Vec<u32>,
    wave: Vec<u32>,
    monotonic: bool,
}

/// One step of the list.
pub struct ShownStep {
    /// Its place in the list.
    pub index: usize,
    /// The stage it belongs to.
    pub stage: &'static str,
    /// Steps that must be done before.
    pub after: Vec<u32>,
}

impl<'a> SystemSteps<'a> {
    /// The steps of a plan or transaction.
    pub fn new(steps: &'a [PlannedStep]) -> Self {
        let monotonic = steps.windows(2).all(|pair| pair[0].stage <= pair[1].stage);
        Self { steps, next: 0, before: Vec::new(), wave: Vec::new(), monotonic }
    }
}

impl Iterator for SystemSteps<'_> {
    type Item = ShownStep;

    fn next(&mut self) -> Option<ShownStep> {
        let index = self.next;
        let step = self.steps.get(index)?;
        self.next += 1;
        if index > 0 && self.steps[index - 1].wave != step.wave {
            // The last steps of the wave before: those that no other of it waits for.
            let last = std::mem::take(&mut self.wave);
            let steps = &self.steps[index - last.len()..index];
            let waited: BTreeSet<u32> = steps.iter().flat_map(|s| s.after.iter().copied()).collect();
            self.before = last.into_iter().filter(|id| !waited.contains(id)).collect();
        }
        self.wave.push(step.id);
        let mut after: Vec<u32> = step.after.to_vec();
        if after.is_empty() {
            after.clone_from(&self.before);
        }
        let stage = if self.monotonic { step.stage } else { PlanStage::Changes }.word();
        Some(ShownStep { index, stage, after })
    }
}

impl ShownStep {
    fn view(&self, steps: &[PlannedStep]) -> Map<String, Json> {
        let step = &steps[self.index];
        let mut view = match json!(step.step) {
            Json::Object(fields) => fields,
            _ => Map::new(),
        };
        view.insert("id".to_owned(), json!(step.id));
        view.insert("after".to_owned(), json!(self.after));
        view.insert("stage".to_owned(), json!(self.stage));
        view.insert("reversibility".to_owned(), json!(step.reversibility));
        view.insert("moves".to_owned(), json!(step.moves));
        let mut back = undo(&step.undo);
        back["moves"] = json!(step.undo_moves);
        view.insert("undo".to_owned(), back);
        view
    }
}

fn undo(undo: &Undo) -> Json {
    match undo {
        Undo::One(step) => json!(step),
        Undo::Many(steps) => json!({ "do": "steps", "steps": steps }),
        Undo::Nothing => json!({ "do": "nothing" }),
        Undo::Irreversible(reason) => json!({ "do": "impossible", "reason": reason }),
    }
}
