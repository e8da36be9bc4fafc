//! What is meant: plain data, no I/O, threads, clock or Lua.

pub mod codes;
pub mod component_type;
mod composition;
pub mod condition_walk;
pub mod configuration;
pub mod deployment;
pub mod event;
pub mod finding;
pub mod functions;
pub mod injection;
pub mod monitor;
pub mod names;
pub mod naming;
pub mod outcome;
pub mod outline;
pub mod pattern;
pub mod platform_kind;
pub mod precedence;
pub mod program;
pub mod resource;
pub mod run_state;
pub mod signal_part;
pub mod snapshot;
pub mod state_list;
pub mod statechart;
pub mod step;
pub mod subsystem;
pub mod value;
pub mod within;
pub mod words;

pub use component_type::{
    Catalogue, ComponentType, Direction, Effect, Irreversible, MemberClass, Moves, OperationType, PortType,
    PropertyType, Tunable,
};
pub use configuration::{Call, Change, ChangeKind, Configuration, Confirm, OnFailure, Policy};
pub use deployment::{
    Activity, BringUp, Coordinator, CoordinatorNaming, Deployment, DeploymentLimits, FaultKind, OPERATOR, OperatorMay,
    SimulatedReaction, StepFault, Subsystem, TakeDown,
};
pub use event::{Ask, FAULTED, Raise, RequestId, Verdict};
pub use finding::{Code, Finding, Findings, Origin, Severity};
pub use injection::{GENERIC_INJECTIONS, Injection, InjectionParameter, InjectionType};
pub use monitor::Monitor;
pub use names::{ComponentName, ConfigId, EventName, Ident, MemberRef, TypeName};
pub use outcome::{Cause, Execution, Outcome};
pub use pattern::StepPattern;
pub use platform_kind::PlatformKind;
pub use precedence::Precedence;
pub use program::{Openings, Program};
pub use resource::Resource;
pub use run_state::{RunState, Transition, Wanted};
pub use snapshot::{ActivityStatus, ComponentSnapshot, Snapshot};
pub use state_list::{DefaultTwice, StateEntry, StateList, Target};
pub use statechart::Statechart;
pub use step::Step;
pub use subsystem::{Export, Interface, LeavingRule, SubsystemStanding};
pub use value::{SampleText, Value, ValueType};
