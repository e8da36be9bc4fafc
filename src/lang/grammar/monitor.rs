//! Monitors. The words of their conditions are in [`words`](crate::lang::words).

use super::{Form, NameKind, Object, key};
use crate::model::codes::{
    MONITOR_BAD_HYSTERESIS, MONITOR_UNKNOWN_WORD, TEXT_BAD_NAME, TEXT_BAD_TIME, TEXT_UNKNOWN_KEY, TEXT_WRONG_TYPE,
};

/// A file of monitors in YAML.
pub static MONITORS_FILE: Object = Object {
    name: "monitors_file",
    what: "a file of monitors",
    doc: "Monitors by name. In Lua: `Monitors { name = monitor { … } }`.",
    example: "monitors: { high: { when: { above: [A.x, 2.0] }, event: e_high } }",
    keys: &[key(
        "monitors",
        Form::Named(NameKind::Plain, &Form::Table(&MONITOR)),
        "The monitors.",
        "monitors: { high: { when: { above: [A.x, 2.0] }, event: e_high } }",
        ("monitrs: {}", TEXT_UNKNOWN_KEY),
    )
    .required()],
    ..Object::BARE
};

/// A monitor.
pub static MONITOR: Object = Object {
    name: "monitor",
    what: "a monitor",
    doc: "Watches ports, run states and activities, and raises an event when a condition over time becomes true. They are run by a \
          component of the type `davit.Monitors`.",
    example: "name = monitor { when = above(\"A.x\", 2.0), event = \"e_high\" }",
    keys: &[
        key(
            "when",
            Form::Condition,
            "What it watches for.",
            "when = above(\"A.x\", 2.0)",
            ("when: { abve: [A.x, 2.0] }", MONITOR_UNKNOWN_WORD),
        )
        .required(),
        key(
            "event",
            Form::Name(NameKind::Event),
            "Raised when that becomes true, also when it is true at the first look.",
            "event = \"e_high\"",
            ("event: \"e high\"", TEXT_BAD_NAME),
        )
        .without("only its verdict counts"),
        key(
            "cleared",
            Form::Name(NameKind::Event),
            "Raised when it becomes false.",
            "cleared = \"e_calm\"",
            ("cleared: 1", TEXT_WRONG_TYPE),
        )
        .without("nothing is raised"),
        key(
            "repeat_every",
            Form::Seconds,
            "The time after which `event` is raised again, and again, while it stays true.",
            "repeat_every = 1.0",
            ("repeat_every: 0", TEXT_BAD_TIME),
        )
        .without("raised once")
        .beside("event: e_high"),
        key(
            "every",
            Form::Seconds,
            "The period at which it is evaluated, counted from its first evaluation.",
            "every = 0.01",
            ("every: fast", TEXT_BAD_TIME),
        )
        .without("on each sample, and when time alone changes something"),
        key(
            "enabled",
            Form::Truth,
            "Whether it watches from the beginning; `property_set(\"Monitors.NAME\", true)` switches it on.",
            "enabled = false",
            ("enabled: no", TEXT_WRONG_TYPE),
        )
        .without("`true`"),
        key(
            "description",
            Form::Text,
            "What it is for.",
            "description = \"what it is for\"",
            ("description: 1", TEXT_WRONG_TYPE),
        )
        .without("none"),
    ],
    ..Object::BARE
};

/// What a comparison may have behind its two sides.
pub static COMPARISON: Object = Object {
    name: "comparison",
    what: "a comparison",
    doc: "What stands behind the two sides of `below`, `at_most`, `above` and `at_least`.",
    example: "above(\"A.x\", 8.0, { hysteresis = 0.5 })",
    keys: &[key(
        "hysteresis",
        Form::Number,
        "How far back, past the bound, the left side must go before the condition ends; 0 or more.",
        "hysteresis = 0.5",
        ("hysteresis: -1", MONITOR_BAD_HYSTERESIS),
    )
    .unit("that of what is compared")
    .required()],
    ..Object::BARE
};
