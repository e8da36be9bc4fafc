//! What makes a deployment a part of another one: parameters, interface, subsystems.

use super::{Form, NameKind, Object, key};
use crate::model::codes::{
    TEXT_BAD_NAME, TEXT_NO_FILE, TEXT_NOT_FINITE, TEXT_WRONG_TYPE, TYPE_BAD_DEFAULT, TYPE_BAD_TYPE,
};

/// A parameter of a deployment.
pub static PARAMETER: Object = Object {
    name: "parameter",
    what: "a parameter",
    doc: "A typed value that a deployment is given.",
    example: "{ type: float, default: 0.005, min: 0.0, unit: s, doc: one way }",
    keys: &[
        key("type", Form::ValueType, "What it is; no event.", "type: float", ("type: event", TYPE_BAD_TYPE)).required(),
        key(
            "default",
            Form::Value,
            "Its value where none is given.",
            "default: 0.5",
            ("default: half", TYPE_BAD_DEFAULT),
        )
        .without("one must be given"),
        key(
            "min",
            Form::Number,
            "The least number: of each element, and of each number in a record; says nothing of texts.",
            "min: 0.0",
            ("min: .inf", TEXT_NOT_FINITE),
        )
        .without("any is allowed"),
        key("max", Form::Number, "The greatest, likewise.", "max: 10.0", ("max: ten", TEXT_WRONG_TYPE))
            .without("any is allowed"),
        key("unit", Form::Text, "Its unit, for whoever reads it.", "unit: s", ("unit: 1", TEXT_WRONG_TYPE))
            .without("none"),
        key("doc", Form::Text, "What it is for.", "doc: one way", ("doc: 1", TEXT_WRONG_TYPE)).without("none"),
    ],
    ..Object::BARE
};

const MEMBERS: Form = Form::Named(NameKind::Plain, &Form::Name(NameKind::Member));

/// The exports of a deployment.
pub static EXPORTS: Object = Object {
    name: "exports",
    what: "`exports`",
    doc: "The members of components that a parent may touch, by the names under which it does. Each is a member of a component of this \
          file, or an export of a subsystem of it.",
    example: "exports: { ports: { level: A.x }, from: e_built }",
    may_be_empty: true,
    keys: &[
        key(
            "ports",
            MEMBERS,
            "Ports, to be connected or written. An in-port is one that nothing inside drives.",
            "ports: { level: A.x }",
            ("ports: [A.x]", TEXT_WRONG_TYPE),
        )
        .without("none"),
        key(
            "properties",
            MEMBERS,
            "Properties, to be set.",
            "properties: { gain: A.k }",
            ("properties: { gain: k }", TEXT_BAD_NAME),
        )
        .without("none"),
        key(
            "operations",
            MEMBERS,
            "Operations, to be called.",
            "operations: { reset: A.reset }",
            ("operations: A.reset", TEXT_WRONG_TYPE),
        )
        .without("none"),
        key(
            "from",
            Form::Name(NameKind::Event),
            "The event that it emits when what it exports is there; it stays there until the deployment leaves.",
            "from: e_built",
            ("from: \"e built\"", TEXT_BAD_NAME),
        )
        .without("from *up* on"),
    ],
    ..Object::BARE
};

/// How a subsystem leaves.
pub static LEAVING: Object = Object {
    name: "leaving",
    what: "`leaving`",
    doc: "A subsystem that wants to take away what it exports says so, and waits until its parent has let go of it.",
    example: "leaving: { says: e_leaving, until: e_released }",
    keys: &[
        key(
            "says",
            Form::Name(NameKind::Event),
            "The event that it emits; listed under `emits` too.",
            "says: e_leaving",
            ("says: \"e leaving\"", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "until",
            Form::Name(NameKind::Event),
            "The event that it waits for; listed under `accepts` too.",
            "until: e_released",
            ("until: 1", TEXT_WRONG_TYPE),
        )
        .required(),
    ],
    ..Object::BARE
};

/// An instance of a deployment in another one.
pub static SUBSYSTEM: Object = Object {
    name: "subsystem",
    what: "a subsystem",
    doc: "A deployment as a part of another one.",
    example: "left: { deployment: robot.yaml, parameters: { delay_s: 0.02 } }",
    keys: &[
        key(
            "deployment",
            Form::Path,
            "Its file, relative to this one.",
            "deployment: robot.yaml",
            ("deployment: nowhere.yaml", TEXT_NO_FILE),
        )
        .required(),
        key(
            "parameters",
            Form::Named(NameKind::Plain, &Form::Value),
            "Values of its parameters; `{ parameter: NAME }` for one gives it what this file's own parameter of that name is worth.",
            "parameters: { delay_s: 0.02 }",
            ("parameters: 0.02", TEXT_WRONG_TYPE),
        ).without("their defaults"),
        key(
            "activities",
            Form::Named(NameKind::Plain, &Form::Name(NameKind::Plain)),
            "Activities of it that are those of this file: its name for one, and the name here. All others are its own.",
            "activities: { control: control }",
            ("activities: [control]", TEXT_WRONG_TYPE),
        ).without("all are its own"),
    ],
    ..Object::BARE
};
