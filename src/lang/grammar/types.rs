//! Component types that a deployment declares.

use super::deployment::EVENTS;
use super::{Form, Key, NameKind, Object, key};
use crate::model::codes::{
    MONITOR_UNKNOWN_WORD, TEXT_BAD_NAME, TEXT_BAD_VALUE, TEXT_WRONG_TYPE, TYPE_BAD_DEFAULT, TYPE_BAD_TYPE,
};

/// What a part of a type does, for people.
const fn doc(example: &'static str) -> Key {
    key("doc", Form::Text, "What it is for.", example, ("doc: 1", TEXT_WRONG_TYPE)).without("none")
}

/// The unit of a port or property.
const UNIT: Key = key(
    "unit",
    Form::Text,
    "The unit of its number, as a text. Two ports that are connected have the same one, or one of them has none.",
    "unit: N",
    ("unit: 1", TEXT_WRONG_TYPE),
)
.without("none");

/// A component type.
pub static TYPE: Object = Object {
    name: "type",
    what: "a component type",
    doc: "What components of a type offer, and what it means to start, stop and destroy them.",
    example: "Gain: { ports: { u: { direction: in, type: float } }, properties: { k: { type: float, default: 1.0 } } }",
    may_be_empty: true,
    keys: &[
        doc("doc: multiplies its input"),
        key(
            "ports",
            Form::Named(NameKind::Plain, &Form::Table(&PORT)),
            "Its ports.",
            "ports: { u: { direction: in, type: float, unit: N } }",
            ("ports: [u]", TEXT_WRONG_TYPE),
        ).without("none"),
        key(
            "properties",
            Form::Named(NameKind::Plain, &Form::Table(&PROPERTY)),
            "Its properties.",
            "properties: { k: { type: float, default: 1.0 } }",
            ("properties: [k]", TEXT_WRONG_TYPE),
        ).without("none"),
        key(
            "operations",
            Form::Named(NameKind::Plain, &Form::Table(&OPERATION)),
            "Its operations.",
            "operations: { reset: { effect: none } }",
            ("operations: [reset]", TEXT_WRONG_TYPE),
        ).without("none"),
        key(
            "raises",
            EVENTS,
            "Events that components of it may raise by themselves: `davit check` knows by them what a coordinator was meant to wait for.",
            "raises: [e_arrived]",
            ("raises: [\"e arrived\"]", TEXT_BAD_NAME),
        ).without("none is known"),
        key(
            "start_after",
            Form::Set(&Form::Name(NameKind::Type)),
            "Where one `_default` starts both and connections go round in a circle, components of these types are started first; else the flow of data decides.",
            "start_after: [Driver]",
            ("start_after: [\"my driver\"]", TEXT_BAD_NAME),
        ).without("the name decides there"),
        key(
            "stop_before",
            Form::Set(&Form::Name(NameKind::Type)),
            "Likewise: where connections go round in a circle, it is stopped before components of these types.",
            "stop_before: [Driver]",
            ("stop_before: [\"my driver\"]", TEXT_BAD_NAME),
        ).without("the name decides there"),
        key(
            "actuator",
            Form::Truth,
            "Whether it moves something: `davit check` then demands ways to a safe configuration (`safety`), and warns where only \
             `_default` starts or stops it.",
            "actuator: true",
            ("actuator: yes", TEXT_WRONG_TYPE),
        )
        .without("`false`"),
        key(
            "moves",
            Form::Several(&Form::Choice(&["start", "stop"])),
            "Whether starting or stopping it moves hardware: no rollback that nobody asked for does that.",
            "moves: [start]",
            ("moves: [halt]", TEXT_BAD_VALUE),
        ).without("neither does"),
        key(
            "irreversible",
            Form::Several(&Form::Choice(&["configure", "stop", "destroy"])),
            "Which of these nothing undoes.",
            "irreversible: [destroy]",
            ("irreversible: [start]", TEXT_BAD_VALUE),
        ).without("none of them"),
        key(
            "exclusive",
            Form::Several(&Form::Text),
            "What a component needs for itself, by name, `{property}` being the value of one of its properties that is `tunable: unconfigured`. It holds that from \
             *configured* on until it is *unconfigured* again, one component at a time, in all of a deployment: a second one is refused.",
            "exclusive: [can0]",
            ("exclusive: 1", TEXT_WRONG_TYPE),
        ).without("nothing"),
    ],
    ..Object::BARE
};

/// A port.
pub static PORT: Object = Object {
    name: "port",
    what: "a port",
    doc: "A typed, directed end of data flow, `Component.port`.",
    example: "{ direction: in, type: float, unit: N }",
    keys: &[
        key(
            "direction",
            Form::Choice(&["in", "out"]),
            "Whether samples come in or go out.",
            "direction: in",
            ("direction: inn", TEXT_BAD_VALUE),
        )
        .required(),
        key("type", Form::ValueType, "What it carries.", "type: float", ("type: flaot", TYPE_BAD_TYPE)).required(),
        UNIT,
        key(
            "buffered",
            Form::Truth,
            "Whether its connections are queues: an in-port that takes every sample, one after the other.",
            "buffered: true",
            ("buffered: 8", TEXT_WRONG_TYPE),
        )
        .without("`false`"),
        key(
            "required",
            Form::Truth,
            "Whether something has to drive the in-port: `davit check` warns where nothing that may be in force while the deployment is up connects or writes it.",
            "required: true",
            ("required: yes", TEXT_WRONG_TYPE),
        )
        .without("`false`: it is a note where nothing does"),
        doc("doc: the force on the tool"),
    ],
    ..Object::BARE
};

/// A property.
pub static PROPERTY: Object = Object {
    name: "property",
    what: "a property",
    doc: "A typed parameter of a component, set by `create` and `property_set`.",
    example: "{ type: float, default: 1.0, min: 0.0, max: 10.0, tunable: stopped }",
    keys: &[
        key("type", Form::ValueType, "What it is; no event.", "type: float", ("type: event", TYPE_BAD_TYPE)).required(),
        key(
            "default",
            Form::Value,
            "Its value where `create` gives none.",
            "default: 1.0",
            ("default: one", TYPE_BAD_DEFAULT),
        )
        .without("`create` must give one"),
        key(
            "min",
            Form::Number,
            "The least number: of each element, and of each number in a record; says nothing of texts.",
            "min: 0.0",
            ("min: .inf", crate::model::codes::TEXT_NOT_FINITE),
        )
        .without("any is allowed"),
        key("max", Form::Number, "The greatest, likewise.", "max: 10.0", ("max: ten", TEXT_WRONG_TYPE))
            .without("any is allowed"),
        key(
            "tunable",
            Form::Choice(&["unconfigured", "stopped", "always"]),
            "In which run states it may be set: `stopped` means *unconfigured* or *stopped*.",
            "tunable: stopped",
            ("tunable: running", TEXT_BAD_VALUE),
        )
        .without("`always`"),
        key(
            "raises",
            Form::Truth,
            "Whether its value, a `string`, is the name of an event that the component raises, empty for none: `davit check` warns of one that nobody listens to.",
            "raises: true",
            ("raises: e_seen", TEXT_WRONG_TYPE),
        )
        .without("`false`"),
        UNIT,
        doc("doc: gain of the loop"),
    ],
    ..Object::BARE
};

/// An operation.
pub static OPERATION: Object = Object {
    name: "operation",
    what: "an operation",
    doc: "A call on a component that may take long; it has a deadline.",
    example: "{ args: [float], returns: bool, effect: none }",
    may_be_empty: true,
    keys: &[
        key(
            "args",
            Form::List(&Form::ValueType),
            "The types of its arguments.",
            "args: [float, int]",
            ("args: float", TEXT_WRONG_TYPE),
        )
        .without("none"),
        key("returns", Form::ValueType, "The type of its result.", "returns: bool", ("returns: bol", TYPE_BAD_TYPE))
            .without("none"),
        key(
            "effect",
            Form::Either(&[Form::Choice(&["none", "irreversible"]), Form::Table(&EFFECT)]),
            "What it leaves behind: nothing, something that another operation undoes, or something that nothing undoes.",
            "effect: { undo: park }",
            ("effect: non", TEXT_BAD_VALUE),
        )
        .without("`irreversible`"),
        key(
            "moves",
            Form::Truth,
            "Whether calling it moves hardware: no rollback that nobody asked for calls it.",
            "moves: true",
            ("moves: yes", TEXT_WRONG_TYPE),
        )
        .without("`false`"),
        key(
            "settled_by",
            Form::Condition,
            "What is true of the component once it was done, which is `self` here: this settles a call of which no answer came, \
             and shows a platform's false *done*.",
            "settled_by: { below: [self.y, 0.1] }",
            ("settled_by: { belw: [self.y, 0.1] }", MONITOR_UNKNOWN_WORD),
        )
        .without("the answer counts"),
        doc("doc: moves the arm to its rest"),
    ],
    ..Object::BARE
};

/// An operation that another one undoes.
pub static EFFECT: Object = Object {
    name: "effect",
    what: "`effect`",
    doc: "What undoes an operation.",
    example: "effect: { undo: park }",
    keys: &[key(
        "undo",
        Form::Name(NameKind::Plain),
        "The operation of the same component that undoes it, called with the same arguments, or none if it takes none.",
        "undo: park",
        ("undo: \"p ark\"", TEXT_BAD_NAME),
    )
    .required()],
    ..Object::BARE
};
