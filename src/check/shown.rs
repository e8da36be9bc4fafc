//! Every code that `check` can give, and whether a way leads to it: the only list of them.

use crate::model::Code;
use crate::model::codes::*;

/// Found by following the coordinators: such a finding has its own way from the start, which a script goes. (What is wrong with
/// a configuration wherever it is applied is found by looking at it, and has none.)
#[cfg(any(test, feature = "internals"))]
pub const FOLLOWED: &[Code] = &[
    // What coordinators come to.
    COORD_REQUEST_REFUSED,
    COORD_REFUSED_BY_OTHER,
    COORD_STACK_GROWS,
    COORD_LOST_UNHEARD,
    COORD_REVERTED_UNHEARD,
    COORD_ENDLESS,
    COORD_STUCK,
    COORD_LEFTOVERS,
    COORD_NO_WAY_DOWN,
    COORD_SAFETY_UNHEARD,
    COORD_RACED,
    // The bring-up and the shutdown.
    DEPLOY_NEVER_UP,
    DEPLOY_BY_HAND,
    DEPLOY_NEVER_DOWN,
    DEPLOY_LEFTOVERS,
    // Why a request is refused, or can only fail.
    CONF_HOLDS_NEVER,
    STACK_GROUP,
    STACK_SQUASHED,
    CLASH,
    PRE_ON_CREATED,
    POST_ON_DESTROYED,
    TOUCHES_DESTROYED,
    UNKNOWN_COMPONENT,
    COMPONENT_EXISTS,
    STILL_CONNECTED,
    ALREADY_CONNECTED,
    NOT_CONNECTED,
    DATA_ALONE,
    NOT_TUNABLE,
    PORT_DRIVEN,
    RESOURCE_HELD,
    PORT_UNMAPPED,
    // The same, where a component is of one of several types then.
    UNKNOWN_PORT,
    UNKNOWN_PROPERTY,
    UNKNOWN_OPERATION,
    NOT_AN_OUT_PORT,
    NOT_AN_IN_PORT,
    PORT_TYPES,
    PORT_UNLIKE,
    PORT_UNITS,
    NEEDS_BUFFER,
    BAD_VALUE,
    PORT_NOT_WRITABLE,
    BAD_ARGUMENTS,
    // What planning warns of.
    IRREVERSIBLE,
    ACTUATOR_BY_DEFAULT,
];

/// Found without following anything, and why no way leads there.
pub const READ: &[(&str, &[Code])] = &[
    (
        "it is about one file of several, and what comes from the others there is brought about by no script",
        &[
            COMPOSE_PROMISE,
            COMPOSE_UNLEFT,
            COMPOSE_UNKNOWN,
            COMPOSE_SAFETY,
            COMPOSE_NOT_DOWN_AT_FIRST,
            COMPOSE_UNBEGUN,
            COMPOSE_WORD,
            COMPOSE_EXPORT_DRIVEN,
            COMPOSE_EXCLUSIVE,
        ],
    ),
    (
        "it is told of what the deployment says, wherever that is used: no way leads to it",
        &[
            UNKNOWN_TYPE,
            UNKNOWN_ACTIVITY,
            BUFFER_SIZE,
            MISSING_PROPERTY,
            TYPE_BAD_TYPE,
            TYPE_CIRCLE,
            TYPE_DIFFERS,
            TYPE_EXCLUSIVE,
            TYPE_NO_EVENT,
            TYPE_UNKNOWN_OPERATION,
            TYPE_UNKNOWN_TYPE,
            TYPE_WITHOUT_CODE,
            TYPE_SETTLED_ELSEWHERE,
            CONF_HOLDS_UNSEEN,
            CONF_SAFE_MOVES,
            CONF_ALONE_IN_GROUP,
            CONF_EVENT_UNHEARD,
            CONF_UNASKED,
            CHANGE_TWICE,
            DEPLOY_SAFETY_ANSWER,
            DEPLOY_UNKNOWN_CONFIGURATION,
            DEPLOY_UNKNOWN_STATE,
            DEPLOY_EVENT_UNHEARD,
            DEPLOY_NO_REST,
            DEPLOY_ONE_EVENT,
            DEPLOY_PORT_REQUIRED,
            DEPLOY_PORT_UNDRIVEN,
            DEPLOY_UNWATCHED,
            MONITOR_EVENT_TAKEN,
            MONITOR_NOT_A_NUMBER,
            MONITOR_NOT_RUN,
            MONITOR_NO_SUCH_PART,
            MONITOR_UNHEARD,
            SIMULATED_NOT_USED,
            SIMULATED_UNHEARD,
            SIMULATED_UNKNOWN_STEP,
        ],
    ),
    (
        "it is told of all states and transitions of the coordinator together: no way leads to it",
        &[
            COORD_UNKNOWN_REQUEST,
            COORD_UNKNOWN_ANSWER,
            COORD_ANSWER_NEVER_COMES,
            COORD_NEVER_EMITTED,
            COORD_NEVER_ENTERED,
            COORD_NEAR_EVENT,
            COORD_FAILURE_UNHANDLED,
            COORD_SAFE_LEFT,
            COORD_NOT_PURE,
        ],
    ),
    ("it is told of all that two coordinators ask for together: no way leads to it", &[COORD_SHARED]),
    (
        "it is told as the reason why a request is refused, with the way to that",
        &[STACK_EMPTY, STACK_FULL, STACK_NO_FRAME],
    ),
    ("it is told of the deployment's text: no way leads to it", &[DEPLOY_PART]),
    (
        "what is planned leads through all run states on its way: only a component that has failed meets it",
        &[ILLEGAL_TRANSITION, NOT_UNCONFIGURED],
    ),
];

/// Why no way leads to a finding that has none.
pub fn why_no_way(code: Code) -> &'static str {
    let known = READ.iter().find(|(_, codes)| codes.contains(&code));
    known.map_or("it stands in the text: no way leads to it", |(why, _)| *why)
}
