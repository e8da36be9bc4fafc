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
pub mod platforms {
    pub use crate::app::{Making, PlatformMaker};
    pub use crate::model::{
        Call, Catalogue, Cause, ComponentSnapshot, ComponentType, Execution, Injection, MemberRef, Outcome,
        PlatformKind, PropertyType, Tunable,
    };
    pub use crate::platform::conformance;
    pub use crate::platform::simulated::{Simulated, SimulatedOptions};
    pub use crate::platform::{
        EventSink, ObserveError, Platform, PlatformEvent, Prepared, StepBatch, TimedOutcome, TimedStep,
    };
}
