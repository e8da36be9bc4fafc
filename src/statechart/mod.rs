//! Statecharts, compiled: flat tables and a step function with the semantics of rFSM (docs/rfsm.md).
//!
//! [`compile`] turns a chart as written into a [`Chart`] (every reference resolved, every outgoing list in its final
//! order) and says all that is wrong with it. A [`Machine`] is one run of a chart: [`Machine::step`] is what rFSM's
//! `step` does. Functions of a model, and whoever wants to see what happens, are reached through a [`Hook`].
//!
//! What is absent: threads, a clock (the time is an argument), configurations (a state-scoped configuration is here only
//! two names, raised on entry and on exit), and Lua. A step of a pure chart allocates nothing, and what it costs grows
//! with the depth and the outgoing transitions of the active states, not with the size of the chart. Where a pure chart's
//! reaction to an event is always the same, it is worked out at compile time (`reactions.rs`).

mod chart;
mod checks;
mod compile;
mod find;
mod grow;
mod hook;
mod machine;
mod order;
mod outcome;
mod queue;
mod reactions;
mod resolve;
mod search;
mod sim;
mod timers;
mod trace;
mod wide;

pub use chart::{Chart, EdgeId, EventId, NodeId, NodeKind, RaiseMoment, RaiseSite};
pub use compile::compile;
pub use find::FindError;
pub use grow::{Addition, NotGrown};
pub use hook::{ActionPlace, Doo, FunctionOutput, Hook, HookContext, Nobody, Printer, Raised, Watched};
pub use machine::Machine;
pub use order::sort as sort_by_priority;
pub use outcome::{MicrostepResult, Mode, RunEnd, Stepped};
pub use queue::Queue;
pub use reactions::AtOnce;
pub use sim::{Observation, Sim, SimError};
pub use trace::Trace;
