//! Deployments: everything of one system, as written.

use super::component_type::ComponentType;
use super::configuration::Configuration;
use super::finding::Origin;
use super::monitor::Monitor;
use super::names::{ComponentName, ConfigId, EventName, Ident};
use super::program::Program;
use super::statechart::Statechart;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// A deployment file and all it names, lowered.
#[derive(Debug, Clone, PartialEq)]
pub struct Deployment {
    /// Its name; also the name of its control socket.
    pub name: Ident,
    /// The platform it runs on.
    pub platform: Ident,
    /// Component libraries it uses.
    pub libraries: Vec<Ident>,
    /// Component types declared in the file.
    pub types: Vec<ComponentType>,
    /// Activities by name.
    pub activities: BTreeMap<Ident, Activity>,
    /// Configurations in written order; IDs are unique.
    pub configurations: Vec<Configuration>,
    /// The coordinator; the first one, if there are several.
    pub coordinator: Statechart,
    /// The first coordinator's name, where it was given one; else it is called like the deployment.
    pub first: Option<Ident>,
    /// Coordinators that run beside the first one.
    pub beside: Vec<Beside>,
    /// The texts of coordinators that have functions, by the coordinators' names.
    pub programs: BTreeMap<Ident, Arc<Program>>,
    /// Monitors in written order; names are unique.
    pub monitors: Vec<Monitor>,
    /// Events that leave the deployment.
    pub emits: Vec<(EventName, Origin)>,
    /// How it is brought up.
    pub deploy: BringUp,
    /// How it is taken down.
    pub shutdown: TakeDown,
    /// Bounds the user may set.
    pub limits: DeploymentLimits,
    /// How safely the journal is kept.
    pub durability: Durability,
    /// What simulated components raise by themselves; nothing on other platforms.
    pub reactions: Vec<SimulatedReaction>,
    /// Where it was written.
    pub origin: Origin,
    /// Where keys of the file were written, by key path (`deploy.event`, `activities.control.period_ms`), for findings
    /// about them.
    pub key_origins: BTreeMap<String, Origin>,
}

/// A coordinator beside the first one. It has its own state that means *up* and its own that means *down*: a deployment is
/// up when all of its coordinators are.
#[derive(Debug, Clone, PartialEq)]
pub struct Beside {
    /// Its name, by which its frames are known.
    pub name: Ident,
    /// Its statechart.
    pub chart: Statechart,
    /// Its state that means *up*.
    pub up: String,
    /// Its states that mean that the bring-up failed.
    pub failed: Vec<String>,
    /// Its state that means *down*.
    pub down: String,
    /// Where it was named.
    pub origin: Origin,
}

/// What a component of the simulated platform raises by itself after a step was done: this stands for its behaviour, so
/// that a coordinator meets the events it waits for.
#[derive(Debug, Clone, PartialEq)]
pub struct SimulatedReaction {
    /// After each step whose text begins so, at a word's end: `start radio`, `operation_call arm.home`.
    pub after: String,
    /// So much later.
    pub delay: Duration,
    /// This event is raised.
    pub raise: EventName,
    /// By this component.
    pub component: ComponentName,
    /// Where it was written.
    pub origin: Origin,
}

/// A thread of the embedded runtime that updates components.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Activity {
    /// Its period; none: event-driven, updated when a sample or an event arrives.
    pub period: Option<Duration>,
    /// Its scheduling priority, 0 (none asked for) to 99.
    pub priority: u8,
    /// The CPU it is bound to.
    pub cpu: Option<u32>,
    /// Where it was written.
    #[serde(skip)]
    pub origin: Origin,
}

/// How a deployment comes up.
#[derive(Debug, Clone, PartialEq)]
pub struct BringUp {
    /// The event that starts it.
    pub event: EventName,
    /// The coordinator's state that means *up*: a name or a path (`operational`, `root.operational`).
    pub up: String,
    /// States that mean it failed.
    pub failed: Vec<String>,
    /// How long it may take.
    pub within: Duration,
}

/// How a deployment goes down.
#[derive(Debug, Clone, PartialEq)]
pub struct TakeDown {
    /// The event that starts it.
    pub event: EventName,
    /// The coordinator's state that means *down*.
    pub down: String,
    /// How long it may take before it is forced.
    pub within: Duration,
}

/// Bounds the user may set; defaults are in [`crate::limits`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeploymentLimits {
    /// Frames on the stack before the oldest are squashed.
    pub stack: usize,
    /// How long one step may take.
    pub step_timeout: Duration,
}

impl Default for DeploymentLimits {
    fn default() -> Self {
        Self { stack: crate::limits::STACK, step_timeout: crate::limits::STEP_TIMEOUT }
    }
}

/// How safely the journal is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Durability {
    /// Every application is on disk before it begins.
    #[default]
    Full,
    /// Faster; after a crash the last application may be unknown.
    Relaxed,
}

impl Deployment {
    /// The configuration of that name.
    pub fn configuration(&self, id: ConfigId) -> Option<&Configuration> {
        self.configurations.iter().find(|c| c.id == id)
    }

    /// The names of the coordinators, the first one's first.
    pub fn coordinators(&self) -> Vec<Ident> {
        std::iter::once(self.first.unwrap_or(self.name)).chain(self.beside.iter().map(|b| b.name)).collect()
    }

    /// The deployment as one of its coordinators sees it: that one alone, with its states. `None` for a number past the last.
    pub fn seen_by(&self, number: usize) -> Option<Self> {
        let mut seen = Self { beside: Vec::new(), ..self.clone() };
        if let Some(number) = number.checked_sub(1) {
            let own = self.beside.get(number)?;
            seen.coordinator = own.chart.clone();
            seen.first = Some(own.name);
            seen.deploy.up.clone_from(&own.up);
            seen.deploy.failed.clone_from(&own.failed);
            seen.shutdown.down.clone_from(&own.down);
        }
        Some(seen)
    }

    /// Where the key of that path was written.
    pub fn key_origin(&self, path: &str) -> Origin {
        self.key_origins.get(path).copied().unwrap_or(self.origin)
    }
}
