//! Configurations, the seven primitives and what is made of them.

use super::{Form, Key, NameKind, Object, key};
use crate::model::codes::{
    CONF_BAD_STATE, CONF_UNKNOWN_CHANGE, MONITOR_UNKNOWN_WORD, TEXT_BAD_NAME, TEXT_BAD_TIME, TEXT_BAD_VALUE,
    TEXT_NOT_FINITE, TEXT_UNKNOWN_KEY, TEXT_WRONG_TYPE,
};

/// A file of configurations in YAML.
pub static CONFIGURATIONS_FILE: Object = Object {
    name: "configurations_file",
    what: "a file of configurations",
    doc: "Configurations by name. In Lua: `ConfiguratorConf { name = Configuration { … } }`, as in the paper's listings.",
    example: "configurations: { engage: { changes: [{ property_set: { property: A.k, value: 1.0 } }] } }",
    keys: &[key(
        "configurations",
        Form::Named(NameKind::Configuration, &Form::Table(&CONFIGURATION)),
        "The configurations.",
        "configurations: { engage: { changes: [{ property_set: { property: A.k, value: 1.0 } }] } }",
        ("configuratons: {}", TEXT_UNKNOWN_KEY),
    )
    .required()],
    ..Object::BARE
};

/// A configuration.
pub static CONFIGURATION: Object = Object {
    name: "configuration",
    what: "a configuration",
    doc: "A named change of the system: run states first, then an unordered set of changes, then run states. Applied whole or not at \
          all, and undone by an inverse that is computed. In Lua: `Configuration { … }`, with its changes as elements.",
    example: "name = Configuration { property_set(\"A.k\", 1.0) }",
    in_yaml: "name: { changes: [{ property_set: { property: A.k, value: 1.0 } }] }",
    keys: &[
        key(
            "pre_conf_state",
            Form::States,
            "Run states to bring components to first, in this order: `unconfigured`, `stopped` or `running` (the names of RTT, ROS 2, \
             microblx and the paper are read too). `_default:STATE` stands for every component that the list does not name.",
            "pre_conf_state = { 'youbot:running', '_default:stopped' }",
            ("pre_conf_state: [\"youbot:runing\"]", CONF_BAD_STATE),
        ).without("none is asked for first"),
        key(
            "changes",
            Form::Changes,
            "What is changed. It is a set: the order in which it is written means nothing, and what one change needs of another is \
             worked out.",
            "changes: [{ property_set: { property: Dynamics.force_gain, value: [0.1, 0.1, 0.1] } }]",
            ("changes: [{ property_sett: {} }]", CONF_UNKNOWN_CHANGE),
        ).without("nothing but run states is changed"),
        key(
            "post_conf_state",
            Form::States,
            "Run states to bring components to last, in this order; written like `pre_conf_state`.",
            "post_conf_state = { '_default:running' }",
            ("post_conf_state: [\"youbot\"]", CONF_BAD_STATE),
        ).without("none is asked for last"),
        key(
            "timeout",
            Form::Seconds,
            "How long all of it may take; what is done by then is undone.",
            "timeout = 0.5",
            ("timeout: -1", TEXT_BAD_TIME),
        )
        .without("each step has `limits.step_timeout_s`"),
        key(
            "group",
            Form::Name(NameKind::Plain),
            "Alternatives have the same one: applying one of them replaces the frame of the one in force.",
            "group = \"dof\"",
            ("group: \"d of\"", TEXT_BAD_NAME),
        ).without("it has no alternatives"),
        key(
            "safe",
            Form::Truth,
            "It makes the system safe: it may be applied at any time, goes before everything else, and each of its steps is tried \
             whatever becomes of the others.",
            "safe = true",
            ("safe: yes", TEXT_WRONG_TYPE),
        )
        .without("`false`"),
        key(
            "on_failure",
            Form::Choice(&["rollback", "hold"]),
            "What is done when a step fails. `rollback`: what was done is undone, also where that moves hardware. `hold`: nothing is \
             undone, the answer is *broken*, and the coordinator decides. Refused beside `safe`.",
            "on_failure = \"rollback\"",
            ("on_failure: stay", TEXT_BAD_VALUE),
        )
        .without("what was done is undone, as far as undoing it moves nothing"),
        key(
            "holds",
            Form::Condition,
            "What it stands for: true once it was applied, else it failed, and watched while it is in force. When it becomes false \
             the coordinator hears `ID.lost`.",
            "holds = in_state(\"Driver\", \"running\")",
            ("holds: { runs: [Driver] }", MONITOR_UNKNOWN_WORD),
        ).without("nothing is watched but what its steps did"),
        key(
            "confirm",
            Form::Table(&CONFIRM),
            "An event that must come, else it is undone again (`ID.reverted`). Refused beside `safe` and `on_failure: hold`.",
            "confirm = { event = \"e_aligned\", within = 2.0 }",
            ("confirm: e_aligned", TEXT_WRONG_TYPE),
        ).without("it stays"),
        key(
            "irreversible",
            Form::Truth,
            "That its author knows that something in it cannot be undone: `davit check` warns no more. Where something in it cannot, an undo does not pass its frame.",
            "irreversible = true",
            ("irreversible: 1", TEXT_WRONG_TYPE),
        )
        .without("`false`"),
        key(
            "description",
            Form::Text,
            "What it is for.",
            "description = \"what it is for\"",
            ("description: 1", TEXT_WRONG_TYPE),
        ).without("none"),
    ],
    ..Object::BARE
};

/// What must come after a configuration.
pub static CONFIRM: Object = Object {
    name: "confirm",
    what: "`confirm`",
    doc: "The event that lets a configuration stand.",
    example: "confirm = { event = \"e_aligned\", within = 2.0 }",
    keys: &[
        key(
            "event",
            Form::Name(NameKind::Event),
            "The event. It confirms from the moment on at which the configuration begins to be applied.",
            "event = \"e_aligned\"",
            ("event: \"e a\"", TEXT_BAD_NAME),
        )
        .required(),
        key("within", Form::Seconds, "How long it is waited for.", "within = 2.0", ("within: 0", TEXT_BAD_TIME))
            .required(),
    ],
    ..Object::BARE
};

/// A change: one of the primitives, or what is made of them.
#[derive(Debug)]
pub struct Primitive {
    /// Its keys, under its word.
    pub object: &'static Object,
    /// The names of its arguments in Lua, in order. What ends in `…` takes all that follow; `options` is a table of the others.
    pub arguments: &'static [&'static str],
}

/// The changes, in the order of the reference.
pub static CHANGES: &[Primitive] = &[
    Primitive { object: &CREATE, arguments: &["component", "type", "options"] },
    Primitive { object: &DESTROY, arguments: &["component"] },
    Primitive { object: &CONNECT, arguments: &["from", "to", "policy"] },
    Primitive { object: &DISCONNECT, arguments: &["from", "to"] },
    Primitive { object: &PROPERTY_SET, arguments: &["property", "value"] },
    Primitive { object: &PORT_WRITE, arguments: &["port", "value"] },
    Primitive { object: &OPERATION_CALL, arguments: &["operation", "args…"] },
    Primitive { object: &REPLACE, arguments: &["component", "type", "options"] },
];

/// The change of that word.
pub fn primitive(word: &str) -> Option<&'static Primitive> {
    CHANGES.iter().find(|change| change.object.name == word)
}

const COMPONENT: Key = key(
    "component",
    Form::Name(NameKind::Component),
    "The component.",
    "component: Dynamics",
    ("component: Dyna-mics", TEXT_BAD_NAME),
)
.required();

const COMPONENT_TYPE: Key =
    key("type", Form::Name(NameKind::Type), "Its type.", "type: youbot.Dynamics", ("type: \"you bot\"", TEXT_BAD_NAME))
        .required();

const PROPERTIES: Key = key(
    "properties",
    Form::Named(NameKind::Plain, &Form::Value),
    "Initial values of properties; in Lua in the table behind the type. `tunable` does not bind them.",
    "properties = { friction_comp = 0.9 }",
    ("properties: [0.9]", TEXT_WRONG_TYPE),
)
.without("their defaults");

const FROM: Key =
    key("from", Form::Name(NameKind::Member), "The out-port.", "from: Kin.jacobian", ("from: Kin", TEXT_BAD_NAME))
        .required();

const TO: Key =
    key("to", Form::Name(NameKind::Member), "The in-port.", "to: Dynamics.jacobian", ("to: 1", TEXT_WRONG_TYPE))
        .required();

const OPERATION: Key = key(
    "operation",
    Form::Name(NameKind::Member),
    "The operation.",
    "operation: youbot.setControlMode",
    ("operation: setControlMode", TEXT_BAD_NAME),
)
.required();

const ARGS: Key =
    key("args", Form::List(&Form::Value), "Its arguments.", "args: [6]", ("args: 6", TEXT_WRONG_TYPE)).without("none");

static CREATE: Object = Object {
    name: "create",
    what: "create",
    doc: "Creates a component, unconfigured. Refused where there is one of that name.",
    example: "create(\"Dynamics\", \"youbot.Dynamics\")",
    in_yaml: "create: { component: Dynamics, type: youbot.Dynamics }",
    keys: &[
        COMPONENT,
        COMPONENT_TYPE,
        key(
            "activity",
            Form::Name(NameKind::Plain),
            "The activity it runs in; in Lua in the table behind the type.",
            "activity = \"control\"",
            ("activity: 1", TEXT_WRONG_TYPE),
        )
        .without("one with a period of 10 ms, which no file names (`davit status` calls it `default`)"),
        PROPERTIES,
    ],
    ..Object::BARE
};

/// Puts another component in the place of one.
static REPLACE: Object = Object {
    name: "replace",
    what: "replace",
    doc: "Puts a new component in the place of one: destroys the old one, creates the new one under its name, and connects it as the \
          old one is connected where it is applied, with the same policies. The new one comes to the run state of the old one \
          (where that has faulted it stays unconfigured), unless `post_conf_state` says otherwise. Values of properties and written ports are not \
          taken over. Made of the seven others, and undone like them: when it fails, the old one is back. A `disconnect` \
          beside it lets that connection end.",
    example: "replace(\"ctrl\", \"Mpc\", { map = { force = \"wrench\" } })",
    in_yaml: "replace: { component: ctrl, type: Mpc, map: { force: wrench } }",
    keys: &[
        COMPONENT,
        COMPONENT_TYPE,
        key(
            "activity",
            Form::Name(NameKind::Plain),
            "The activity that the new one runs in; in Lua in the table behind the type.",
            "activity = \"control\"",
            ("activity: 1", TEXT_WRONG_TYPE),
        )
        .without("that of the old one"),
        PROPERTIES,
        key(
            "map",
            Form::Named(NameKind::Plain, &Form::Name(NameKind::Plain)),
            "Ports of the old one, and what they are called on the new one; in Lua in the table behind the type. A connected port that \
             the new one does not have must stand here.",
            "map = { force = \"wrench\" }",
            ("map: { force: 1 }", TEXT_WRONG_TYPE),
        )
        .without("each port keeps its name"),
    ],
    ..Object::BARE
};

static DESTROY: Object = Object {
    name: "destroy",
    what: "destroy",
    doc: "Destroys a component: it is stopped and cleaned up first. Refused while it has connections.",
    example: "destroy(\"Dynamics\")",
    in_yaml: "destroy: { component: Dynamics }",
    keys: &[COMPONENT],
    ..Object::BARE
};

static CONNECT: Object = Object {
    name: "connect",
    what: "connect",
    doc: "Connects an out-port to an in-port of the same type. Refused where they are connected.",
    example: "connect(\"Kin.jacobian\", \"Dynamics.jacobian\")",
    in_yaml: "connect: { from: Kin.jacobian, to: Dynamics.jacobian }",
    keys: &[
        FROM,
        TO,
        key(
            "policy",
            Form::Either(&[Form::Choice(&["data"]), Form::Table(&BUFFER)]),
            "How samples are carried. `data`: the newest value is there. A buffer: each sample is there once, in order. In Lua the third argument.",
            "policy: { buffer: 64 }",
            ("policy: fifo", TEXT_BAD_VALUE),
        )
        .without("`data`"),
    ],
    ..Object::BARE
};

/// The policy of a queue.
pub static BUFFER: Object = Object {
    name: "buffer",
    what: "the policy of a connection",
    doc: "A connection that is a queue.",
    example: "{ buffer = 64 }",
    keys: &[key(
        "buffer",
        Form::Whole { least: 1, most: 1_000_000 },
        "How many samples it holds.",
        "buffer = 64",
        ("buffer: 0", TEXT_BAD_VALUE),
    )
    .unit("samples")
    .required()],
    ..Object::BARE
};

static DISCONNECT: Object = Object {
    name: "disconnect",
    what: "disconnect",
    doc: "Removes a connection. Refused where there is none.",
    example: "disconnect(\"Kin.jacobian\", \"Dynamics.jacobian\")",
    in_yaml: "disconnect: { from: Kin.jacobian, to: Dynamics.jacobian }",
    keys: &[FROM, TO],
    ..Object::BARE
};

static PROPERTY_SET: Object = Object {
    name: "property_set",
    what: "property_set",
    doc: "Sets a property. No step is needed where it has that value.",
    example: "property_set(\"Dynamics.force_gain\", 0.5)",
    in_yaml: "property_set: { property: Dynamics.force_gain, value: [0.1, 0.1, 0.1] }",
    keys: &[
        key(
            "property",
            Form::Name(NameKind::Member),
            "The property.",
            "property: Dynamics.force_gain",
            ("property: force_gain", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "value",
            Form::Value,
            "Its value: of its type, in its unit, within its bounds.",
            "value: 0.5",
            ("value: .nan", TEXT_NOT_FINITE),
        )
        .required(),
    ],
    ..Object::BARE
};

static PORT_WRITE: Object = Object {
    name: "port_write",
    what: "port_write",
    doc: "Writes a value to an in-port that nothing drives. No step is needed where that value was written.",
    example: "port_write(\"Cart_Impedance.ext_ref_mode\", true)",
    in_yaml: "port_write: { port: Cart_Impedance.ext_ref_mode, value: true }",
    keys: &[
        key(
            "port",
            Form::Name(NameKind::Member),
            "The in-port.",
            "port: Cart_Impedance.ext_ref_mode",
            ("port: ext_ref_mode", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "value",
            Form::Value,
            "The value: of the port's type and unit.",
            "value: 0.5",
            ("value: .inf", TEXT_NOT_FINITE),
        )
        .required(),
    ],
    ..Object::BARE
};

static OPERATION_CALL: Object = Object {
    name: "operation_call",
    what: "operation_call",
    doc: "Calls an operation and waits for it. Undone by `undo`, or by what the operation's type names.",
    example: "operation_call(\"youbot.setControlMode\", 6)",
    in_yaml: "operation_call: { operation: youbot.setControlMode, args: [6] }",
    keys: &[
        OPERATION,
        ARGS,
        key(
            "undo",
            Form::Table(&UNDO),
            "The call that takes it back; in Lua `operation_call(…):undo(\"youbot.setControlMode\", 0)`.",
            "undo: { operation: youbot.setControlMode, args: [0] }",
            ("undo: setControlMode", TEXT_WRONG_TYPE),
        )
        .without("what the operation's `effect` says"),
    ],
    ..Object::BARE
};

/// The call that takes another one back.
pub static UNDO: Object = Object {
    name: "undo",
    what: "`undo`",
    doc: "The call that takes another one back.",
    example: "operation_call(\"youbot.setControlMode\", 6):undo(\"youbot.setControlMode\", 0)",
    in_yaml: "undo: { operation: youbot.setControlMode, args: [0] }",
    keys: &[OPERATION, ARGS],
    ..Object::BARE
};
