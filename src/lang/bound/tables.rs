//! Which key is which field. What is not here (the changes of a configuration, the states in a state) is no one field, or is read by
//! rules of its own.

use super::{BoundTable, bound};
use crate::model::statechart::{ChartTransition, Connector, State};
use crate::model::{
    Activity, ComponentType, Configuration, Deployment, DeploymentLimits, Monitor, OperationType, PortType,
    PropertyType, SimulatedReaction, StepFault,
};

/// A configuration, but for its changes.
pub static CONFIGURATION: BoundTable<Configuration> = bound!(CONFIGURATION, Configuration:
    description,
    timeout,
    group,
    safe,
    on_failure,
    holds,
    confirm,
    irreversible,
    pre_conf_state: pre,
    post_conf_state: post,
);

/// A monitor.
pub static MONITOR: BoundTable<Monitor> = bound!(MONITOR, Monitor:
    description,
    when,
    event: raise,
    cleared,
    repeat_every: repeat,
    every: sampling,
    enabled,
);

/// A state, but for what is in it.
pub static STATE: BoundTable<State> = bound!(STATE, State: doc, config, entry, exit);

/// A connector.
pub static CONNECTOR: BoundTable<Connector> = bound!(CONNECTOR, Connector: doc);

/// A transition.
pub static TRANSITION: BoundTable<ChartTransition> = bound!(TRANSITION, ChartTransition:
    src,
    tgt,
    events,
    effect,
    pn,
    doc,
);

/// A component type, but for its members.
pub static TYPE: BoundTable<ComponentType> = bound!(TYPE, ComponentType:
    doc,
    raises,
    start_after,
    stop_before,
    actuator,
    moves,
    irreversible,
    exclusive,
);

/// A port.
pub static PORT: BoundTable<PortType> = bound!(PORT, PortType:
    direction,
    type: ty,
    unit,
    buffered,
    required,
    doc,
);

/// A property.
pub static PROPERTY: BoundTable<PropertyType> = bound!(PROPERTY, PropertyType:
    type: ty,
    default,
    min,
    max,
    tunable,
    raises,
    unit,
    doc,
);

/// A parameter, which is like a property that is given before anything runs.
pub static PARAMETER: BoundTable<PropertyType> = bound!(PARAMETER, PropertyType:
    type: ty,
    default,
    min,
    max,
    unit,
    doc,
);

/// An operation.
pub static OPERATION: BoundTable<OperationType> = bound!(OPERATION, OperationType:
    args,
    returns,
    effect,
    moves,
    settled_by,
    doc,
);

/// A deployment's own, but for what it names and what is made of several keys.
pub static DEPLOYMENT: BoundTable<Deployment> = bound!(DEPLOYMENT, Deployment:
    libraries,
    emits,
    safety,
    operator,
    limits,
);

/// An activity.
pub static ACTIVITY: BoundTable<Activity> = bound!(ACTIVITY, Activity: period_ms: period, priority, cpu);

/// The bounds of a deployment.
pub static LIMITS: BoundTable<DeploymentLimits> = bound!(LIMITS, DeploymentLimits: stack, step_timeout_s: step_timeout);

/// A reaction of the simulated platform.
pub static REACTION: BoundTable<SimulatedReaction> = bound!(REACTION, SimulatedReaction:
    delay_s: delay,
    raise,
    component,
);

/// A fault of the simulated platform, but for its step and its time.
pub static FAULT: BoundTable<StepFault> = bound!(FAULT, StepFault: how, takes_s: takes, times);
