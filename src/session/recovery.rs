//! The way out of *broken* (semantics: *What goes wrong*): what differs from what should be, going back, taking what is there.

use super::Session;
use super::log::{Happening, LogEntry, StepTime};
use crate::configurator::{ConfiguratorView, Drift, Recovery, Residual};
use crate::limits;
use crate::model::{ComponentName, Step};
use serde::Serialize;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// One thing that is not as it should be: `{"how": "differs", "do": "property_set", "target": "a.k", "value": 2.0,
/// "text": "property_set a.k = 2.0"}`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    how: How,
    #[serde(flatten)]
    what: DifferenceIn,
    text: String,
}

/// What is known of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum How {
    /// The step leads from what should be to what is.
    Differs,
    /// The step was done and not taken back; what is in force in part has it.
    Left,
    /// Nobody knows whether the step happened.
    Unknown,
    /// The step happened, and nothing undoes it.
    Irreversible,
    /// The component is faulted and should not be.
    Faulted,
    /// A call of the component has not returned.
    Quarantined,
    /// A part of what is in force could not be done, and nothing of it is left over.
    Missing,
}

/// What it is about.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
enum DifferenceIn {
    Step(Step),
    Component {
        target: ComponentName,
    },
    /// What is not there.
    Nothing {},
}

impl Difference {
    fn step(how: How, step: &Step) -> Self {
        let text = match how {
            How::Unknown => format!("{step} (nobody knows whether it happened)"),
            How::Irreversible => format!("{step} (cannot be undone)"),
            How::Left => format!("{step} (done, and not taken back)"),
            _ => step.to_string(),
        };
        Self { how, what: DifferenceIn::Step(step.clone()), text }
    }

    fn component(how: How, target: ComponentName) -> Self {
        let word = if how == How::Faulted { "faulted" } else { "in quarantine" };
        Self { how, what: DifferenceIn::Component { target }, text: format!("{target} is {word}") }
    }

    /// What the platform shows that should not be so, and what it cannot show.
    fn of_drift(drift: &Drift) -> Vec<Self> {
        let steps = drift.steps.iter().map(|step| Self::step(How::Differs, step));
        let unknown = drift.unsettled.iter().map(|step| Self::step(How::Unknown, step));
        let faulted = drift.faulted.iter().map(|name| Self::component(How::Faulted, *name));
        let quarantined = drift.quarantined.iter().map(|name| Self::component(How::Quarantined, *name));
        steps.chain(unknown).chain(faulted).chain(quarantined).collect()
    }

    /// Everything that is not as it should be, each once: all that is broken, what partial frames hold, and components that
    /// still have not come back from a call.
    pub(super) fn of_view(view: &ConfiguratorView) -> Vec<Self> {
        let residuals = view.residuals.iter().map(|residual| &**residual).chain(&view.partial);
        let mut all: Vec<Self> = Vec::new();
        let quarantined = view.quarantined.iter().map(|name| Self::component(How::Quarantined, *name));
        let missing = view.partial.iter().map(|residual| {
            let text = format!("not done: {}", residual.cause);
            Self { how: How::Missing, what: DifferenceIn::Nothing {}, text }
        });
        for one in missing.chain(residuals.flat_map(Self::of_residual)).chain(quarantined) {
            // A call that was out then may have come back since.
            let back = |name: &ComponentName| one.how == How::Quarantined && !view.quarantined.contains(name);
            let over = matches!(&one.what, DifferenceIn::Component { target } if back(target));
            if !over && !all.contains(&one) {
                all.push(one);
            }
        }
        all
    }

    /// What is left of an application that is neither done nor undone.
    pub(super) fn of_residual(residual: &Residual) -> Vec<Self> {
        let lists = [
            (How::Differs, &residual.difference),
            (How::Unknown, &residual.unsettled),
            (How::Irreversible, &residual.irreversible),
        ];
        let left = residual.left.iter().filter(|step| !residual.irreversible.contains(step));
        let left = left.map(|step| Self::step(How::Left, step));
        let steps = lists.into_iter().flat_map(|(how, steps)| steps.iter().map(move |step| Self::step(how, step)));
        let components = [(How::Faulted, &residual.faulted), (How::Quarantined, &residual.quarantined)];
        let components =
            components.into_iter().flat_map(|(how, names)| names.iter().map(move |name| Self::component(how, *name)));
        left.chain(steps).chain(components).collect()
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// How a recovery ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recovered {
    /// Whether the system is whole now.
    pub recovered: bool,
    /// Whether it was broken before.
    pub was_broken: bool,
    /// Why it still is not whole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// What remains; empty when it is whole.
    pub residual: Vec<Difference>,
    /// What was done for it.
    pub steps: Vec<StepTime>,
}

/// The word of a recovery, as it is typed.
pub fn recovery(word: &str) -> Option<Recovery> {
    Recovery::WORDS.iter().find(|(own, _)| *own == word).map(|(_, recovery)| *recovery)
}

/// Why nothing can be finished instead of undone.
pub const NO_FORWARD: &str = "nothing can be finished forward: there is no journal yet that says how far it came";

impl Session {
    /// What differs from what should be, as the platform shows it; empty when all is as it should be. None: no answer
    /// within `within`, or the platform could not be read.
    pub fn drift(&self, within: Duration) -> Option<Vec<Difference>> {
        let drift = self.configurator().drift(self.clock().now() + within)?;
        drift.observed.then(|| Difference::of_drift(&drift))
    }

    /// Recovers a broken system, in the name of `by`; a whole one stays as it is. None: no answer within `within`; what
    /// was begun goes on.
    pub fn recover(&self, how: Recovery, by: &str, within: Duration) -> Option<Recovered> {
        let deadline = self.clock().now() + within;
        let was_broken = self.configurator().view(false, deadline)?.broken.is_some();
        let asked = Happening::Requested { request: None, ask: format!("recover --{how}"), by: by.to_owned() };
        self.hub().note(asked.clone());
        let ended = self.configurator().recover(how, deadline)?;
        // Or it was found to be when it was looked at.
        let was_broken = was_broken || ended != Ok(false);
        let residual = ended.err();
        if let Some(residual) = &residual {
            self.hub().note(Happening::Noted { note: format!("not recovered: {residual}") });
        }
        Some(Recovered {
            recovered: residual.is_none(),
            was_broken,
            why: residual.as_ref().map(|residual| residual.why()),
            residual: residual.map(|residual| Difference::of_residual(&residual)).unwrap_or_default(),
            steps: self.steps_since(&asked),
        })
    }

    /// What was done to mend something since that was written down.
    fn steps_since(&self, asked: &Happening) -> Vec<StepTime> {
        let log = self.hub().log(limits::RECOVERY_LOOKS_BACK);
        let since = log.iter().rposition(|entry| entry.what == *asked).unwrap_or(log.len());
        let of = |entry: &Arc<LogEntry>| match &entry.what {
            Happening::Recovered { steps } => steps.clone(),
            _ => Vec::new(),
        };
        log[since..].iter().flat_map(of).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::configurator::Reason;
    use crate::model::{MemberRef, Value};
    use std::sync::Arc;

    #[test]
    fn each_is_told_once_and_what_is_over_not_at_all() {
        let name = |text: &str| ComponentName::new(text).unwrap();
        let set = |value| Step::PropertySet { property: MemberRef::new("a.k").unwrap(), value: Value::Float(value) };
        let residual = |quarantined: &[&str]| Residual {
            unsettled: vec![set(1.0)],
            quarantined: quarantined.iter().map(|text| name(text)).collect(),
            ..Residual::of(Reason::Busy)
        };
        let view = ConfiguratorView {
            system: None,
            stack: Vec::new(),
            broken: None,
            residuals: vec![Arc::new(residual(&["a"])), Arc::new(residual(&["b"]))],
            partial: vec![Residual { left: vec![set(2.0)], ..Residual::of(Reason::Busy) }],
            quarantined: vec![name("b"), name("c")],
        };
        let told: Vec<String> = Difference::of_view(&view).iter().map(ToString::to_string).collect();
        let unknown = "property_set a.k = 1.0 (nobody knows whether it happened)";
        let (missing, left) =
            (format!("not done: {}", Reason::Busy), "property_set a.k = 2.0 (done, and not taken back)");
        assert_eq!(told, [&*missing, unknown, "b is in quarantine", left, "c is in quarantine"]);
    }
}
