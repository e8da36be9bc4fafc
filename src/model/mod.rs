//! What is meant: plain data, no I/O, threads, clock or Lua.

pub mod codes;
pub mod component_type;
pub mod configuration;
pub mod deployment;
pub mod event;
pub mod finding;
pub mod functions;
pub mod monitor;
pub mod names;
pub mod outline;
pub mod program;
pub mod run_state;
pub mod snapshot;
pub mod statechart;
pub mod step;
pub mod value;

pub use component_type::{
    Catalogue, ComponentType, Direction, Effect, Irreversible, Moves, OperationType, PortType, PropertyType, Tunable,
};
pub use configuration::{Call, Change, ChangeKind, Configuration, Confirm, OnFailure, Policy, StateEntry, Target};
pub use deployment::{
    Activity, BringUp, Coordinator, Deployment, DeploymentLimits, FaultKind, OperatorMay, SimulatedReaction, StepFault,
    TakeDown, Written,
};
pub use event::{Ask, RequestId, Verdict};
pub use finding::{Code, Finding, Findings, Origin, Severity};
pub use monitor::Monitor;
pub use names::{ComponentName, ConfigId, EventName, Ident, MemberRef, TypeName};
pub use program::{Openings, Program};
pub use run_state::{RunState, Transition};
pub use snapshot::{ActivityStatus, ComponentSnapshot, Snapshot};
pub use statechart::Statechart;
pub use step::Step;
pub use value::{Value, ValueType};
