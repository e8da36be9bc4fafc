//! Davit brings component-based robot systems up, switches them while they run, undoes what it did, and takes them down
//! again.
//!
//! What a system consists of, and when what is to change, is said in files: a *deployment* names component libraries,
//! *configurations* (what is created, connected, set, started) and a *coordinator*, a statechart that asks for
//! configurations by name. The names of this crate stand in the order in which a deployment goes through it: text becomes
//! model, model is checked and planned, what is planned meets a platform, and a session keeps it alive.
//!
//! ```
//! use davit::{Ask, Clock, LoadOptions, Phase, builtin, check, plan, read, render, start};
//! use std::path::Path;
//! use std::time::Duration;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // From text to model: the deployment, and all files that it names.
//! let read = read(Path::new("deployments/hello.yaml"), &LoadOptions::default(), builtin())
//!     .map_err(|refused| render(&refused.findings, &refused.sources, false))?;
//!
//! // What its configurations mean, step by step, before anything runs.
//! let planned = plan(&read, &["build", "run"]).map_err(|findings| render(&findings, &read.sources, false))?;
//! assert_eq!(planned[0].steps[0].step.to_string(), "create sine : standard.Sine");
//! assert_eq!(planned[1].result.components.len(), 3);
//!
//! // Nothing runs that was not checked: the coordinator is followed through every order of events and answers.
//! let checked = check(read).map_err(|refused| render(&refused.findings, &refused.sources, false))?;
//!
//! // Up. On the simulated clock, on which who acts has entered: seconds take no time.
//! let clock = Clock::simulated();
//! let _entered = clock.enter();
//! let session = start(&checked, &clock)?;
//! session.bring_up()?;
//! let (gain, k) = ("gain".parse()?, "k".parse()?);
//! let value = || session.system().map(|system| system.components[&gain].properties[&k].clone());
//! assert_eq!((session.status().phase, value()?), (Phase::Up, 0.5.into()));
//!
//! // An event: the coordinator goes to another state, and that is another configuration.
//! session.offer("e_loud".parse()?, "tutorial")?;
//! clock.sleep(Duration::from_millis(50));
//! assert_eq!(value()?, 2.0.into());
//!
//! // Somebody beside it undoes that, by force since the coordinator has asked for it: the gain is as before both.
//! session.request(Ask::UndoOf("loud".parse()?), "tutorial", true);
//! clock.sleep(Duration::from_millis(50));
//! assert_eq!(value()?, 1.0.into());
//!
//! // Down, in order: the coordinator undoes what is left.
//! let ended = session.take_down(false);
//! assert!(ended.is_clean());
//! # clock.shutdown();
//! # Ok(())
//! # }
//! ```
//!
//! * A program with components of its own is three lines around [`main`]: [`component`].
//! * So is one with a platform of its own, a middleware, a bus or another host: [`platform`](mod@platforms).
//! * The configurator alone, without files, coordinator and session: [`Configurator`].

/// The rooms: how they stand upon each other is told in `ARCHITECTURE.md`. They are public for the project's own tests and
/// measurements (the feature `internals`), and for nobody else.
#[path = ""]
// A room offers what belongs to it, whoever takes it; here nobody but the tests may.
#[cfg_attr(not(feature = "internals"), allow(unused_imports))]
mod rooms {
    pub mod app;
    pub mod check;
    pub mod cli;
    pub mod configurator;
    pub mod coordinator;
    pub mod diagnostics;
    pub mod draw;
    pub mod functions;
    pub mod lang;
    pub mod libraries;
    pub mod limits;
    pub mod model;
    pub mod monitor;
    pub mod plan;
    pub mod platform;
    pub mod runtime;
    pub mod session;
    pub mod stack;
    pub mod statechart;
    pub mod system;
    pub mod time;
    pub mod transaction;
}

#[cfg(feature = "internals")]
pub use rooms::*;
#[cfg(not(feature = "internals"))]
use rooms::*;

// Text, and in words what is wrong with it.
pub use diagnostics::{SourceMap, render};
pub use lang::{LoadOptions, Sources, load_configurations};

// The model: what is meant.
pub use model::{
    Ask, ComponentName, ConfigId, Configuration, Deployment, DeploymentLimits, EventName, Finding, Findings, Ident,
    RequestId, Severity, Snapshot, Step, Value, ValueType,
};

// From text to model, to what it will do, and to what may run.
pub use app::{Application, Checked, Extensions, Read, Refused, check, plan, plan_way, read};
pub use check::Until;
pub use libraries::builtin;
pub use plan::PlannedStep;

// The one clock of whatever runs.
pub use time::{Clock, Time};

// Transactions over a platform.
pub use configurator::{Answer, Batch, Configurator, ConfiguratorHandle, ConfiguratorSetup, Request, Requester};

// One deployment alive.
pub use app::{StartError, start, start_on};
pub use session::{Command, Ended, NotRaised, NotUp, Phase, Session, StatusView, Unanswered};

// Whole programs.
pub use app::script::{Interrupt, ScriptEnd, ScriptOptions, run as run_script};
pub use cli::main;

/// What component types of one's own are written with.
///
/// `examples/own_components.rs` is a whole program with two, and `docs/components.md` goes through it. A component declares its ports, properties and operations
/// with a [`Builder`](component::Builder), and is updated by an activity; it knows no other component, no configuration
/// and no coordinator.
pub mod component {
    pub use crate::model::monitor::{Comparison, Condition, ValuePart};
    pub use crate::model::{Irreversible, Tunable};
    pub use crate::record;
    pub use crate::runtime::{
        Builder, Component, Context, EventIn, EventOut, Failure, In, Libraries, Library, OperationAnswer, Out,
        PortValue, Prop, Sample, Ticket,
    };

    /// What [`record!`](crate::record) writes.
    #[doc(hidden)]
    pub mod recorded {
        pub use crate::runtime::value::{field, field_name};
    }
}

/// What platforms of one's own are written with.
///
/// `examples/own_platform.rs` is a whole program with one, `examples/embed.rs` one that gives its platform to a
/// [`Configurator`]. A [`Platform`](platforms::Platform) is asked in blocking calls with deadlines, and whether it keeps the
/// rules that a configurator relies on is tried by a test of a few lines ([`conformance`](platforms::conformance)).
///
/// One with nothing behind it but a list of what is there; a real one asks a middleware, and answers *unknown* when it hears nothing
/// before the deadline:
///
/// ```
/// use davit::platforms::{
///     Catalogue, Cause, ComponentSnapshot, ComponentType, Direction, EventSink, Execution, ObserveError, Outcome, Platform,
///     PortType, RunState,
/// };
/// use davit::{Clock, ComponentName, Snapshot, Step, Time, ValueType};
/// use std::sync::Mutex;
///
/// struct Shelf {
///     types: Catalogue,
///     there: Mutex<Snapshot>,
/// }
///
/// /// Carries one step out, or says why it does not fit what is there.
/// fn carry_out(step: &Step, types: &Catalogue, there: &mut Snapshot) -> Result<(), &'static str> {
///     let Snapshot { components, connections, ports } = there;
///     match step {
///         Step::Create { component, ty, activity, properties } => {
///             let declared = types.get(*ty).ok_or("there is no such type")?;
///             let properties = declared.properties.keys().copied().zip(properties.iter().cloned()).collect();
///             let made = ComponentSnapshot { ty: *ty, state: RunState::Unconfigured, properties, activity: *activity };
///             match components.insert(*component, made) {
///                 None => Ok(()),
///                 Some(other) => {
///                     components.insert(*component, other);
///                     Err("there is one of that name")
///                 }
///             }
///         }
///         Step::Destroy { component } => components.remove(component).map(drop).ok_or("there is none"),
///         Step::State { component, transition } => {
///             let of = components.get_mut(component).ok_or("there is none")?;
///             if !transition.allowed_in(of.state) {
///                 return Err("not in its run state");
///             }
///             of.state = transition.target();
///             Ok(())
///         }
///         Step::PropertySet { property, value } => {
///             let of = components.get_mut(&property.component).ok_or("there is none")?;
///             of.properties.insert(property.member, value.clone()).map(drop).ok_or("it has no such property")
///         }
///         Step::Connect { from, to, policy } => match connections.insert((*from, *to), *policy) {
///             None => Ok(()),
///             Some(_) => Err("they are connected"),
///         },
///         Step::Disconnect { from, to } => connections.remove(&(*from, *to)).map(drop).ok_or("they are not connected"),
///         Step::PortWrite { port, value: Some(value) } => {
///             ports.insert(*port, value.clone());
///             Ok(())
///         }
///         Step::PortWrite { port, value: None } => {
///             ports.remove(port);
///             Ok(())
///         }
///         Step::Operation(_) => Err("it has no operations"),
///     }
/// }
///
/// impl Platform for Shelf {
///     fn catalogue(&self) -> &Catalogue {
///         &self.types
///     }
///     fn execution(&self, _: &Step) -> Execution {
///         Execution::Blocking
///     }
///     fn execute(&self, step: &Step, _: Time) -> Outcome {
///         match carry_out(step, &self.types, &mut self.there.lock().unwrap()) {
///             Ok(()) => Outcome::Done(None),
///             Err(why) => Outcome::NotDone(Cause::Refused(why.to_owned())),
///         }
///     }
///     fn cancel(&self, _: &Step) {}
///     fn observe(&self, _: Time) -> Result<Snapshot, ObserveError> {
///         Ok(self.there.lock().unwrap().clone())
///     }
///     fn observe_component(&self, of: ComponentName, _: Time) -> Result<Option<ComponentSnapshot>, ObserveError> {
///         Ok(self.there.lock().unwrap().components.get(&of).cloned())
///     }
///     fn subscribe(&self, _: EventSink) {}
///     fn quarantined(&self) -> Vec<ComponentName> {
///         Vec::new()
///     }
/// }
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut lamp = ComponentType::new("Lamp", "Lights up.");
/// lamp.ports.insert("level".parse()?, PortType::new(Direction::In, ValueType::Float));
/// let mut types = Catalogue::new();
/// types.insert(lamp);
/// let shelf = Shelf { types, there: Mutex::default() };
///
/// let clock = Clock::simulated();
/// let (soon, lamp) = (clock.now(), "lamp".parse()?);
/// let made = Step::Create { component: lamp, ty: "Lamp".parse()?, activity: None, properties: Vec::new() };
/// assert_eq!(shelf.execute(&made, soon), Outcome::Done(None));
/// assert!(matches!(shelf.execute(&made, soon), Outcome::NotDone(Cause::Refused(_))));
/// assert_eq!(shelf.observe(soon)?.components[&lamp].state, RunState::Unconfigured);
/// # clock.shutdown();
/// # Ok(())
/// # }
/// ```
pub mod platforms {
    pub use crate::app::{Making, PlatformMaker};
    pub use crate::model::monitor::{Counter, PortSignal};
    pub use crate::model::{
        ActivityStatus, Call, Catalogue, Cause, ComponentSnapshot, ComponentType, Direction, Effect, Execution,
        Injection, InjectionParameter, InjectionType, Irreversible, MemberRef, Moves, OperationType, Outcome,
        PlatformKind, Policy, PortType, PropertyType, Resource, RunState, Transition, Tunable, TypeName,
    };
    pub use crate::monitor::{InputSample, MonitorInput};
    pub use crate::platform::conformance;
    pub use crate::platform::simulated::{Simulated, SimulatedOptions};
    pub use crate::platform::{
        EventSink, ObserveError, Platform, PlatformEvent, Prepared, StepBatch, TimedOutcome, TimedStep, Watch,
    };
    pub use crate::time::Signal;
}
