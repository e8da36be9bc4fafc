//! Coordinators.

use super::{Form, Key, Languages, NameKind, Object, key};
use crate::model::codes::{TEXT_BAD_NAME, TEXT_BAD_VALUE, TEXT_UNKNOWN_KEY, TEXT_WRONG_TYPE};

/// What a part of a chart is for.
const DOC: Key = key("doc", Form::Text, "What it is for.", "doc = \"waits for people\"", ("doc: 1", TEXT_WRONG_TYPE))
    .without("none");

/// A coordinator's file in YAML.
pub static COORDINATOR_FILE: Object = Object {
    name: "coordinator_file",
    what: "a coordinator's file",
    doc: "A statechart that performs nothing itself. In Lua the file returns its outermost state (`return state { … }`), in YAML \
          that stands under the one key. SCXML is read too.",
    example: "coordinator: { states: { idle: {} }, transitions: [{ src: initial, tgt: idle }] }",
    keys: &[key(
        "coordinator",
        Form::Table(&STATE),
        "The outermost state.",
        "coordinator: { states: { idle: {} }, transitions: [{ src: initial, tgt: idle }] }",
        ("coordinatr: {}", TEXT_UNKNOWN_KEY),
    )
    .required()],
    ..Object::BARE
};

/// A state.
pub static STATE: Object = Object {
    name: "state",
    what: "a state",
    doc: "A state of a coordinator, by itself or with states in it. In Lua: `state { … }`, with its states under their names and its \
          transitions as elements; rFSM's other constructors are read as well.",
    example: "idle: { entry: e_idle }",
    may_be_empty: true,
    keys: &[
        key(
            "states",
            Form::Named(NameKind::Plain, &Form::Either(&[Form::Table(&STATE), Form::Table(&CONNECTOR)])),
            "The states in it.",
            "states: { idle: {}, busy: {} }",
            ("states: [idle, busy]", TEXT_WRONG_TYPE),
        ).without("it has none in it")
        .only(Languages::Yaml),
        key(
            "transitions",
            Form::List(&Form::Table(&TRANSITION)),
            "Transitions between them. The source `initial` says which one is entered first.",
            "transitions: [{ src: initial, tgt: idle }]",
            ("transitions: { src: initial, tgt: idle }", TEXT_WRONG_TYPE),
        ).without("none")
        .only(Languages::Yaml),
        key(
            "config",
            Form::Several(&Form::Name(NameKind::Configuration)),
            "Configurations that are in force while it is active: entering it asks for them, leaving it takes them back.",
            "config = \"enable_copying\"",
            ("config: \"enable copying\"", TEXT_BAD_NAME),
        ).without("none is asked for"),
        key(
            "entry",
            Form::Several(&Form::Name(NameKind::Event)),
            "Names that are raised when it is entered: of configurations (`ID`, `ID.undo`, `undo`), which asks for them, or of events.",
            "entry = \"e_ready\"",
            ("entry: \"e ready\"", TEXT_BAD_NAME),
        ).without("nothing is raised"),
        key(
            "exit",
            Form::Several(&Form::Name(NameKind::Event)),
            "Names that are raised when it is left.",
            "exit = \"e_ready\"",
            ("exit: 1", TEXT_WRONG_TYPE),
        ).without("nothing is raised"),
        key(
            "doo",
            Form::Function,
            "What is done while it is active; only a trusted coordinator has one.",
            "doo = function() end",
            ("doo = \"e_work\"", TEXT_WRONG_TYPE),
        ).without("nothing is done")
        .only(Languages::Lua),
        DOC,
    ],
    ..Object::BARE
};

/// A connector.
pub static CONNECTOR: Object = Object {
    name: "connector",
    what: "a connector",
    doc: "A point at which transitions meet and part, and at which nothing rests. In Lua: `conn {}`.",
    example: "choice: { connector: true }",
    keys: &[
        key(
            "connector",
            Form::Truth,
            "That it is one; never `false`.",
            "connector: true",
            ("connector: false", TEXT_BAD_VALUE),
        )
        .required()
        .only(Languages::Yaml),
        DOC,
    ],
    ..Object::BARE
};

/// A transition.
pub static TRANSITION: Object = Object {
    name: "transition",
    what: "a transition",
    doc: "From one state to another, when one of its events comes. In Lua: `trans { … }`.",
    example: "{ src: idle, tgt: busy, events: [e_go] }",
    keys: &[
        key(
            "src",
            Form::Text,
            "The state it leaves: a name of the state it is written in (`idle`), a path from there (`.busy.homing`) or from the \
             root (`root.busy.homing`); `initial`: it is taken when the state around it is entered.",
            "src = \"idle\"",
            ("src: 1", TEXT_WRONG_TYPE),
        )
        .required(),
        key("tgt", Form::Text, "The state it enters, in the same forms.", "tgt = \"busy\"", ("tgt: 1", TEXT_WRONG_TYPE))
            .required(),
        key(
            "events",
            Form::Several(&Form::Trigger),
            "What triggers it, any one of them: an event, an answer (`enable_copying.failed`), a time in the state \
             (`e_after(0.5)`) or since the start (`e_at(20)`), in seconds; `e_done` when what it leaves is complete.",
            "events = { \"e_go\" }",
            ("events: [e_after(soon)]", TEXT_BAD_NAME),
        )
        .without("any event"),
        key(
            "guard",
            Form::Function,
            "Must not say no; only a trusted coordinator has one.",
            "guard = function() return true end",
            ("guard = \"e_ready\"", TEXT_WRONG_TYPE),
        ).without("an event of the transition is enough")
        .only(Languages::Lua),
        key(
            "effect",
            Form::Several(&Form::Name(NameKind::Event)),
            "Names that are raised when it is taken, after what is left and before what is entered.",
            "effect = \"e_ready\"",
            ("effect: \"e ready\"", TEXT_BAD_NAME),
        ).without("nothing is raised"),
        key(
            "pn",
            Form::Number,
            "Priority among the transitions that leave one state: the highest number goes first.",
            "pn = 1",
            ("pn: high", TEXT_WRONG_TYPE),
        )
        .without("0"),
        DOC,
    ],
    ..Object::BARE
};
