//! Deployments: everything of one system, as written.

use super::component_type::ComponentType;
use super::configuration::Configuration;
use super::event::{Ask, UNDO, Verdict};
use super::finding::Origin;
use super::monitor::Monitor;
use super::names::{ComponentName, ConfigId, EventName, Ident, MemberRef};
use super::platform_kind::PlatformKind;
use super::program::Program;
use super::statechart::{Statechart, is_internal};
use super::subsystem::Interface;
use super::value::Value;
use super::words::words;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// A deployment file and all it names, lowered.
#[derive(Debug, Clone, PartialEq)]
pub struct Deployment {
    /// Its name; also the name of its control socket.
    pub name: Ident,
    /// The platform it runs on.
    pub platform: Ident,
    /// What kind of platform that is.
    pub kind: PlatformKind,
    /// What the platform is given, under its own name.
    pub platform_options: BTreeMap<Ident, Value>,
    /// Component libraries it uses.
    pub libraries: Vec<Ident>,
    /// Component types declared in the file.
    pub types: Vec<ComponentType>,
    /// Activities by name.
    pub activities: BTreeMap<Ident, Activity>,
    /// Configurations in written order; IDs are unique.
    pub configurations: Vec<Configuration>,
    /// The coordinators in written order: at least one, and no two of one name.
    pub coordinators: Vec<Coordinator>,
    /// The texts of coordinators that have functions, by the coordinators' names.
    pub programs: BTreeMap<Ident, Arc<Program>>,
    /// Monitors in written order; names are unique.
    pub monitors: Vec<Monitor>,
    /// Events that leave the deployment.
    pub emits: Vec<(EventName, Origin)>,
    /// Events that must lead to a `safe` configuration wherever an actuator exists.
    pub safety: Vec<(EventName, Origin)>,
    /// What an operator may do while it is up.
    pub operator: Vec<(OperatorMay, Origin)>,
    /// How it is brought up.
    pub deploy: BringUp,
    /// How it is taken down.
    pub shutdown: TakeDown,
    /// Bounds the user may set.
    pub limits: DeploymentLimits,
    /// What simulated components raise by themselves; nothing on other platforms.
    pub reactions: Vec<SimulatedReaction>,
    /// What goes wrong on the simulated platform.
    pub faults: Vec<StepFault>,
    /// What it shows to one that it is a subsystem of.
    pub interface: Interface,
    /// Its subsystems. What they are made of is among all the above, under names that begin with theirs.
    pub subsystems: Vec<Subsystem>,
    /// Without what its subsystems are made of, if it has any.
    pub own: Option<Arc<Self>>,
    /// Where it was written.
    pub origin: Origin,
    /// Where keys of the file were written, by key path (`deploy.event`, `activities.control.period_ms`), for findings
    /// about them.
    pub key_origins: BTreeMap<String, Origin>,
}

/// An instance of a deployment's file in another one.
#[derive(Debug, Clone, PartialEq)]
pub struct Subsystem {
    /// What it is called there.
    pub name: Ident,
    /// What is written in its file, by the names that it has there; of its own subsystems too.
    pub own: Arc<Deployment>,
    /// Its activities that are those of the parent, each with the one it is updated in there.
    pub activities: BTreeMap<Ident, Ident>,
    /// What its components may hold for themselves, to any depth and whatever values its files and its parent give; known where it is
    /// followed.
    pub holds: BTreeSet<String>,
    /// Its file, as it is named.
    pub file: String,
    /// Where it is named.
    pub origin: Origin,
}

/// A coordinator of a deployment. Each has its own state that means *up* and its own that means *down*: a deployment is up
/// when all of its coordinators are.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinator {
    /// Its name, by which its frames are known. One without a name of its own is called like the deployment.
    pub name: Ident,
    /// How it came to its name.
    pub written: CoordinatorNaming,
    /// Its statechart.
    pub chart: Statechart,
    /// Its state that means *up*: a name or a path (`operational`, `root.operational`).
    pub up: String,
    /// Its states that mean that the bring-up failed.
    pub failed: Vec<String>,
    /// Its state that means *down*.
    pub down: String,
    /// The path of the subsystem that it is a coordinator of; none: of the deployment itself.
    pub of: Option<Ident>,
    /// Where it was named.
    pub origin: Origin,
}

/// How a deployment names a coordinator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CoordinatorNaming {
    /// `coordinator: FILE`: it has the name of the deployment.
    #[default]
    Alone,
    /// `coordinators: { NAME: FILE }`.
    Named,
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

/// A step of the simulated platform that goes wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct StepFault {
    /// Each step whose text begins so, at a word's end: `property_set a.k`, `start radio`.
    pub step: String,
    /// How.
    pub how: FaultKind,
    /// How many times, 1 or more; after that the step goes well.
    pub times: u32,
    /// How long it takes, where it is slow; zero else.
    pub takes: Duration,
    /// Where it was written.
    pub origin: Origin,
}

words! {
    /// How a step goes wrong.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum FaultKind by word {
        /// It is not done, and that is answered at once.
        Fail = "fail",
        /// Its call never comes back, also when it is given up: nothing is answered by the deadline, and the component is in
        /// quarantine for good.
        Hang = "hang",
        /// The same, but its call comes back [`FAULT_LATE`](crate::limits::FAULT_LATE) after the deadline; what it had done is
        /// taken back then, and the component leaves quarantine.
        Late = "late",
        /// The request is lost: it is not done, and nothing is answered by the deadline. The component is well.
        Lost = "lost",
        /// It is not done, and the answer says at once that it was.
        Lie = "lie",
        /// It takes so long ([`StepFault::takes`]), and can be given up meanwhile. What else goes wrong with it does so then.
        Slow = "slow",
    }
}

/// By this name an operator is told as the one who asked for something.
pub const OPERATOR: &str = "operator";

/// Something that an operator may do without being told that it is outside of what was checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OperatorMay {
    /// Apply this configuration.
    Apply(ConfigId),
    /// Set this property, or write this in-port.
    Set(MemberRef),
}

impl fmt::Display for OperatorMay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Apply(id) => write!(f, "{id}"),
            Self::Set(member) => write!(f, "{member}"),
        }
    }
}

/// A thread of the embedded runtime that updates components.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
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

/// How a deployment comes up. Which states mean *up* and *failed* is said of each [`Coordinator`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BringUp {
    /// The event that starts it.
    pub event: EventName,
    /// How long it may take.
    pub within: Duration,
}

/// How a deployment goes down. Which state means *down* is said of each [`Coordinator`].
#[derive(Debug, Clone, PartialEq)]
pub struct TakeDown {
    /// The event that starts it.
    pub event: EventName,
    /// How long each stage of it may take before the next begins.
    pub within: Duration,
    /// Configurations that bring the system to rest when it is taken down by force, in this order.
    pub rest: Vec<(ConfigId, Origin)>,
}

/// Bounds the user may set. Each has a default.
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

impl Deployment {
    /// One of which nothing else is said.
    pub fn new(name: Ident, platform: Ident, deploy: BringUp, shutdown: TakeDown) -> Self {
        Self {
            name,
            platform,
            kind: PlatformKind::of(platform),
            platform_options: BTreeMap::new(),
            libraries: Vec::new(),
            types: Vec::new(),
            activities: BTreeMap::new(),
            configurations: Vec::new(),
            coordinators: Vec::new(),
            programs: BTreeMap::new(),
            monitors: Vec::new(),
            emits: Vec::new(),
            safety: Vec::new(),
            operator: Vec::new(),
            deploy,
            shutdown,
            limits: DeploymentLimits::default(),
            reactions: Vec::new(),
            faults: Vec::new(),
            interface: Interface::default(),
            subsystems: Vec::new(),
            own: None,
            origin: Origin::NONE,
            key_origins: BTreeMap::new(),
        }
    }

    /// Whether an event from outside is heard also while the deployment is being stopped: those of safety, and the one that
    /// shuts down. Where nobody has said which are those of safety, it may be any but the one that begins the deployment. Events
    /// of components and monitors always are: nobody asks them to be silent.
    pub fn stays_open(&self, event: &str) -> bool {
        let safety = || self.safety.is_empty() || self.safety.iter().any(|(safety, _)| safety.as_str() == event);
        // Its parent lets it go, or, where it has none, nobody has to.
        let until = self.interface.leaving.is_some_and(|leaving| leaving.until.as_str() == event);
        until || self.shutdown.event.as_str() == event || self.deploy.event.as_str() != event && safety()
    }

    /// Events that go before all others, whoever raises them: those of safety, and those that begin and end the deployment. Of
    /// each one waits at most.
    pub fn urgent(&self) -> impl Iterator<Item = EventName> + '_ {
        let safety = self.safety.iter().map(|(event, _)| *event);
        safety.chain([self.deploy.event, self.shutdown.event])
    }

    /// Whether an event is one that coordinators tell each other: whoever waits for it hears it of another one.
    pub fn is_told_between(&self, event: &str) -> bool {
        let numbers = || 0..self.coordinators.len();
        let told =
            |number: usize| numbers().any(|other| other != number && self.coordinators[other].chart.raises(event));
        let mut hear = numbers().filter(|number| self.coordinators[*number].chart.waits_for(event)).peekable();
        self.coordinators.len() > 1 && hear.peek().is_some() && hear.all(told)
    }

    /// The same of one that nobody else raises: no other source of it is declared, be it people or what brings it.
    pub fn is_theirs_alone(&self, event: &str) -> bool {
        let monitors = self.monitors.iter().flat_map(Monitor::events);
        let reactions = self.reactions.iter().map(|reaction| reaction.raise);
        let confirms = self.configurations.iter().filter_map(|c| Some(c.confirm?.event));
        let mut declared = self.urgent().chain(monitors).chain(reactions).chain(confirms);
        self.is_told_between(event) && declared.all(|own| own.as_str() != event)
    }

    /// Whether an event is spelt like an answer of the configurator: it ends like one, or is about a configuration or `undo`.
    pub fn looks_like_answer(&self, event: &str) -> bool {
        let is_one = |id: &str| ConfigId::new(id).is_ok_and(|id| self.configuration(id).is_some());
        match Verdict::split(event) {
            // `park.udno.failed`: no name of a configuration, and one begins it.
            Some((subject, _)) => {
                let of = subject.strip_suffix(UNDO).unwrap_or(subject);
                ConfigId::new(of).is_ok() || subject.split_once('.').is_some_and(|(id, _)| is_one(id))
            }
            None => event.rsplit_once('.').is_some_and(|(subject, _)| {
                let subject = subject.strip_suffix(UNDO).unwrap_or(subject);
                subject == Ask::Undo.subject() || is_one(subject)
            }),
        }
    }

    /// Whether a name is that of a configuration, and not of a subsystem.
    pub fn names_configuration(&self, name: &str) -> bool {
        let is_subsystem = || self.subsystems.iter().any(|subsystem| subsystem.name.as_str() == name);
        ConfigId::new(name).is_ok_and(|id| self.configuration(id).is_some()) && !is_subsystem()
    }

    /// Why an event cannot come from outside (of a component, a monitor, an operator): it tells what only Davit knows, or what only
    /// its coordinators tell each other. None: it can.
    pub fn never_from_outside(&self, event: &str) -> Option<String> {
        if self.own.is_some() && self.is_told_of(event) {
            Some(format!("`{event}` is told of a subsystem by itself, and nobody else raises it"))
        } else if is_internal(event) {
            Some(format!("`{event}` is an event of the statechart itself, which nobody else raises"))
        } else if self.names_configuration(event) {
            Some(format!("`{event}` is a configuration, which is asked for and not raised"))
        } else if !self.looks_like_answer(event) {
            let told = || format!("`{event}` is what coordinators tell each other, which nobody else raises");
            self.is_theirs_alone(event).then(told)
        } else if event.ends_with(UNDO) {
            Some(format!("`{event}` is a request to the configurator, no event"))
        } else {
            Some(format!("`{event}` is an answer of the configurator, which nobody else raises"))
        }
    }

    /// What is to be asked for in the place of such an event, as far as it names that.
    pub fn asked_instead(&self, event: &str) -> Option<Ask> {
        let (subject, ending) = Verdict::split(event).unwrap_or_else(|| {
            let asked = event.strip_suffix(UNDO);
            asked.map_or((event, ""), |id| (id, Verdict::Undone.ending(false)))
        });
        let of = [Ask::Undo, Ask::Commit { force: false }].into_iter().find(|ask| ask.subject() == subject);
        of.or_else(|| {
            let id = self.configurations.iter().map(|c| c.id).find(|id| id.as_str() == subject)?;
            let undoes = Ask::UndoOf(id).verdicts().iter().any(|verdict| verdict.ending(false) == ending);
            Some(if undoes { Ask::UndoOf(id) } else { Ask::Apply(id) })
        })
    }

    /// Every answer that anybody may get.
    pub fn answers(&self) -> BTreeSet<EventName> {
        let about = self.configurations.iter().flat_map(|c| [Ask::Apply(c.id), Ask::UndoOf(c.id)]);
        let asks = about.chain([Ask::Undo, Ask::Commit { force: false }]);
        asks.flat_map(|ask| ask.verdicts().iter().map(move |verdict| verdict.event(ask))).collect()
    }

    /// The configurations that an operator may apply, beside those that are safe.
    pub fn operator_applies(&self) -> impl Iterator<Item = ConfigId> + '_ {
        self.operator.iter().filter_map(|(may, _)| match may {
            OperatorMay::Apply(id) => Some(*id),
            OperatorMay::Set(_) => None,
        })
    }

    /// The configurations that may be asked for: what stands for a subsystem while its parent is checked is called like that, and is none.
    pub fn named_configurations(&self) -> impl Iterator<Item = &Configuration> {
        let stands_for =
            |c: &&Configuration| self.subsystems.iter().any(|subsystem| ConfigId::from(subsystem.name) == c.id);
        self.configurations.iter().filter(move |c| !stands_for(c))
    }

    /// The configuration of that name.
    pub fn configuration(&self, id: ConfigId) -> Option<&Configuration> {
        self.configurations.iter().find(|c| c.id == id)
    }

    /// The coordinator of that name.
    pub fn coordinator_named(&self, name: Ident) -> Option<&Coordinator> {
        self.coordinators.iter().find(|c| c.name == name)
    }

    /// The coordinator that is named first: the only one, for what looks at one alone.
    ///
    /// # Panics
    /// When there is none, which no text can say.
    pub fn first_coordinator(&self) -> &Coordinator {
        self.coordinators.first().expect("a deployment has a coordinator")
    }

    /// The statecharts of the coordinators, in order.
    pub fn charts(&self) -> impl Iterator<Item = &Statechart> {
        self.coordinators.iter().map(|c| &c.chart)
    }

    /// The states that mean *down*, for messages: `idle`; of several coordinators `arm:idle, gripper:open`.
    pub fn down_states(&self) -> String {
        match &self.coordinators[..] {
            [one] => one.down.clone(),
            all => all.iter().map(|c| format!("{}:{}", c.name, c.down)).collect::<Vec<_>>().join(", "),
        }
    }

    /// Where the key of that path was written.
    pub fn key_origin(&self, path: &str) -> Origin {
        self.key_origins.get(path).copied().unwrap_or(self.origin)
    }
}
