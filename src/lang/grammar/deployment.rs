//! The deployment's file.

use super::composition::{EXPORTS, LEAVING, PARAMETER, SUBSYSTEM};
use super::{Form, Languages, NameKind, Object, TYPE, key};
use crate::limits;
use crate::model::codes::{
    DEPLOY_NO_JOURNAL, TEXT_BAD_NAME, TEXT_BAD_TIME, TEXT_BAD_VALUE, TEXT_DUPLICATE_KEY, TEXT_NO_FILE, TEXT_WRONG_TYPE,
};

const FILES: Form = Form::Set(&Form::Path);
pub(super) const EVENTS: Form = Form::Set(&Form::Name(NameKind::Event));

/// Fewest frames a deployment may ask for: the newest, and the one that all others are squashed into.
const FEWEST_FRAMES: i64 = 2;
/// Most frames a deployment may ask for: each holds its inverse in memory.
const MOST_FRAMES: i64 = 100_000;

/// A deployment's file.
pub static DEPLOYMENT: Object = Object {
    name: "deployment",
    what: "a deployment",
    doc: "Everything of one system: where its components live, what may be done to them, and who decides when. Written in YAML.",
    example: "davit: 1",
    keys: &[
        key("davit", Form::Version, "The version of the format.", "davit: 1", ("davit: 2", TEXT_BAD_VALUE)).required(),
        key(
            "name",
            Form::Name(NameKind::Deployment),
            "What the deployment is called: by commands, and by its control socket.",
            "name: youbot_arm",
            ("name: 3arm", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "platform",
            Form::Either(&[
                Form::Name(NameKind::Platform),
                Form::Named(NameKind::Platform, &Form::Named(NameKind::Plain, &Form::Value)),
            ]),
            "Where its components live: `embedded` runs them in this process, `simulated` only keeps books of them and \
             injects the faults that are asked for; a program may bring others. Options of a platform stand under its name: \
             `platform: { bus: { device: \"can0\" } }`.",
            "platform: embedded",
            ("platform: 1", TEXT_WRONG_TYPE),
        )
        .required(),
        key(
            "libraries",
            Form::Set(&Form::Name(NameKind::Library)),
            "Libraries of component types, by name; `davit types` lists what they offer.",
            "libraries: [standard]",
            ("libraries: [\"my lib\"]", TEXT_BAD_NAME),
        )
        .instead("types"),
        key(
            "types",
            Form::Named(NameKind::Type, &Form::Table(&TYPE)),
            "Component types that are declared here. The simulated platform runs any; on another one a library must bring the \
             component. Where a library of the deployment has a type of that name, that is what counts, and `davit check` tells every \
             difference.",
            "types: { Gain: { properties: { k: { type: float, default: 1.0 } } } }",
            ("types: [Gain]", TEXT_WRONG_TYPE),
        ).without("there are those of `libraries`"),
        key(
            "activities",
            Form::Named(NameKind::Plain, &Form::Table(&ACTIVITY)),
            "Threads in which components are updated; `create` names the one of its component.",
            "activities: { control: { period_ms: 1.0, priority: 80 } }",
            ("activities: [control]", TEXT_WRONG_TYPE),
        ).without("there is one with a period of 10 ms, which no file names (`davit status` calls it `default`)"),
        key(
            "configurations",
            FILES,
            "Files of configurations, Lua or YAML, relative to this file.",
            "configurations: [configurations.lua]",
            ("configurations: [nowhere.lua]", TEXT_NO_FILE),
        )
        .required(),
        key(
            "coordinator",
            Form::Path,
            "The coordinator's file (Lua, YAML or SCXML). It is called like the deployment.",
            "coordinator: coordinator.lua",
            ("coordinator: nowhere.lua", TEXT_NO_FILE),
        )
        .instead("coordinators"),
        key(
            "coordinators",
            Form::Named(NameKind::Plain, &Form::Path),
            "Several coordinators that run side by side, each under its name.",
            "coordinators: { arm: arm.lua, gripper: gripper.lua }",
            ("coordinators: [arm.lua]", TEXT_WRONG_TYPE),
        ).without("there is the one of `coordinator`"),
        key(
            "monitors",
            FILES,
            "Files of monitors, Lua or YAML.",
            "monitors: [monitors.lua]",
            ("monitors: 1", TEXT_WRONG_TYPE),
        ).without("nothing is monitored"),
        key(
            "trusted",
            Form::Either(&[Form::Truth, Form::Table(&TRUSTED)]),
            "Whether the coordinators may have functions of their own, which run in this process; a table means that they may, and what is open to them.",
            "trusted: true",
            ("trusted: { open: [net] }", TEXT_BAD_VALUE),
        )
        .without("no coordinator may have one"),
        key(
            "host",
            FILES,
            "Files of Lua that stand in for what the functions of trusted coordinators expect around them; refused without `trusted`.",
            "host: [robot.lua]",
            ("host: 1", TEXT_WRONG_TYPE),
        ).without("none")
        .beside("trusted: true"),
        key(
            "with",
            Form::Named(NameKind::Plain, &Form::Value),
            "Parameters of the Lua files, where each is a global of that name; `--set gain=0.7` overrides it, and one of these that no file reads is refused (here that is a warning).",
            "with: { gain: 0.5 }",
            ("with: 0.5", TEXT_WRONG_TYPE),
        ).without("there is none"),
        key(
            "emits",
            EVENTS,
            "Events of the coordinators that leave the deployment, though nobody in it waits for them.",
            "emits: [e_ready]",
            ("emits: [\"e ready\"]", TEXT_BAD_NAME),
        ).without("none leaves it"),
        key(
            "accepts",
            EVENTS,
            "Events that it takes of the deployment that it is a subsystem of. Those that begin and end it are among them.",
            "accepts: [e_grasp]",
            ("accepts: [\"e grasp\"]", TEXT_BAD_NAME),
        ).without("those two alone"),
        key(
    "parameters",
    Form::Named(NameKind::Plain, &Form::Table(&PARAMETER)),
    "What the deployment can be given, by the deployment that it is a subsystem of or by `--set`; each is a global of its Lua files. \
     One without a default must be given, and one that no file reads is told.",
    "parameters: { gain: { type: float, default: 0.5, min: 0.0 } }",
    ("parameters: { gain: 0.5 }", TEXT_WRONG_TYPE),
).without("nothing"),
        key(
    "exports",
    Form::Table(&EXPORTS),
    "What of its components a parent may touch, each under a name of its own; the parent writes it as if the subsystem were a \
     component: `connect(\"left.tool_pose\", \"right.ext_ref\")`.",
    "exports: { ports: { level: A.x } }",
    ("exports: [A.x]", TEXT_WRONG_TYPE),
).without("nothing"),
        key(
    "leaving",
    Form::Table(&LEAVING),
    "How a subsystem is let go before it takes away what it exports.",
    "leaving: { says: e_leaving, until: e_released }",
    ("leaving: e_leaving", TEXT_WRONG_TYPE),
).without("it takes that away unasked")
.beside("accepts: [e_released]\nemits: [e_leaving]"),
        key(
    "subsystems",
    Form::Named(NameKind::Plain, &Form::Table(&SUBSYSTEM)),
    "Other deployments as parts of this one, each under a name; one file may be used many times. Names of what is in one have its \
     name before them: `left/Dynamics`, `left/e_start`.",
    "subsystems: { left: { deployment: robot.yaml } }",
    ("subsystems: [robot.yaml]", TEXT_WRONG_TYPE),
).without("none"),
        key(
            "safety",
            EVENTS,
            "Events that must lead to a safe configuration wherever an actuator exists; `davit check` demands it. They overtake \
             all others, and are heard while the deployment is being stopped.",
            "safety: [e_estop]",
            ("safety: [e_estop, e_estop]", TEXT_DUPLICATE_KEY),
        ).without("none"),
        key(
            "operator",
            Form::Set(&Form::Either(&[Form::Name(NameKind::Configuration), Form::Name(NameKind::Member)])),
            "What an operator may do while it is up: configurations to be applied, and properties and in-ports to be set \
             (`Component.member`). `davit check` follows them wherever they may come.",
            "operator: [profile_soft, Cart_Impedance.stiffness]",
            ("operator: [profile_soft, profile_soft]", TEXT_DUPLICATE_KEY),
        ).without("nothing"),
        key(
            "deploy",
            Form::Table(&DEPLOY),
            "How it is brought up.",
            "deploy: { event: e_start, up: operational, within_s: 20 }",
            ("deploy: e_start", TEXT_WRONG_TYPE),
        )
        .required(),
        key(
            "shutdown",
            Form::Table(&SHUTDOWN),
            "How it is taken down.",
            "shutdown: { event: e_shutdown, down: idle, within_s: 20 }",
            ("shutdown: e_shutdown", TEXT_WRONG_TYPE),
        )
        .required(),
        key(
            "limits",
            Form::Table(&LIMITS),
            "Bounds of this deployment.",
            "limits: { stack: 32, step_timeout_s: 0.5 }",
            ("limits: 64", TEXT_WRONG_TYPE),
        ).without("those of its keys"),
        key("durability", Form::Text, "", "", ("durability: full", DEPLOY_NO_JOURNAL)).only(Languages::None),
        key(
            "simulated",
            Form::Table(&SIMULATED),
            "What components do by themselves on the simulated platform, so that a coordinator meets the events that it waits for.",
            "simulated: { reactions: [{ after: start radio, delay_s: 0.5, raise: e_qos_ok, component: radio }] }",
            ("simulated: [e_qos_ok]", TEXT_WRONG_TYPE),
        ).without("they raise nothing"),
        key(
            "faults",
            Form::List(&Form::Table(&FAULT)),
            "What goes wrong on the simulated platform.",
            "faults: [{ step: \"property_set a.k\", how: fail }]",
            ("faults: { step: \"start a\", how: fail }", TEXT_WRONG_TYPE),
        ).without("nothing"),
    ],
    ..Object::BARE
};

/// What is open to functions.
pub static TRUSTED: Object = Object {
    name: "trusted",
    what: "`trusted`",
    doc: "What is open to the functions of trusted coordinators beside Lua itself.",
    example: "trusted: true",
    keys: &[key(
        "open",
        Form::Several(&Form::Choice(&crate::model::Openings::NAMES)),
        "Libraries of Lua that are closed otherwise.",
        "open: [io, os]",
        ("open: [net]", TEXT_BAD_VALUE),
    )
    .without("none of them is open")],
    ..Object::BARE
};

/// An activity.
pub static ACTIVITY: Object = Object {
    name: "activity",
    what: "an activity",
    doc: "A thread of the embedded platform that updates components, in rounds.",
    example: "control: { period_ms: 1.0, priority: 80 }",
    may_be_empty: true,
    keys: &[
        key(
            "period_ms",
            Form::Milliseconds,
            "The time from one round to the next.",
            "period_ms: 1.0",
            ("period_ms: 0", TEXT_BAD_TIME),
        )
        .without("a round whenever something comes to an in-port of its components"),
        key(
            "priority",
            Form::Whole { least: 0, most: 99 },
            "Real-time priority of the thread (first in, first out); 0 asks for none. Not getting it is told, and is no error.",
            "priority: 80",
            ("priority: 100", TEXT_BAD_VALUE),
        )
        .without("0"),
        key(
            "cpu",
            Form::Whole { least: 0, most: 4095 },
            "The CPU that the thread is bound to.",
            "cpu: 1",
            ("cpu: -1", TEXT_BAD_VALUE),
        )
        .without("any"),
    ],
    ..Object::BARE
};

/// The way up.
pub static DEPLOY: Object = Object {
    name: "deploy",
    what: "`deploy`",
    doc: "How a deployment is brought up: the event that asks for it, and the states of the coordinators that end it.",
    example: "deploy: { event: e_start, up: operational, within_s: 20 }",
    keys: &[
        key(
            "event",
            Form::Name(NameKind::Event),
            "The event that `davit deploy` raises.",
            "event: e_start",
            ("event: \"e start\"", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "up",
            Form::Set(&Form::State),
            "The state that means *up*; of several coordinators one each.",
            "up: operational",
            ("up: opera-tional", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "failed",
            Form::Several(&Form::State),
            "States that mean that it failed: it is led down then.",
            "failed: [fault]",
            ("failed: [1]", TEXT_WRONG_TYPE),
        )
        .without("it fails only when it takes too long"),
        key(
            "within_s",
            Form::Seconds,
            "How long it may take; after that it is led down.",
            "within_s: 20",
            ("within_s: 20s", TEXT_BAD_TIME),
        )
        .required(),
    ],
    ..Object::BARE
};

/// The way down.
pub static SHUTDOWN: Object = Object {
    name: "shutdown",
    what: "`shutdown`",
    doc: "How a deployment is taken down: the event that asks for it, and the state that ends it.",
    example: "shutdown: { event: e_shutdown, down: idle, within_s: 20 }",
    keys: &[
        key(
            "event",
            Form::Name(NameKind::Event),
            "The event that `davit shutdown`, Ctrl-C and SIGTERM raise.",
            "event: e_shutdown",
            ("event: 1", TEXT_WRONG_TYPE),
        )
        .required(),
        key(
            "down",
            Form::Set(&Form::State),
            "The state that means *down*; of several coordinators one each.",
            "down: idle",
            ("down: \"id le\"", TEXT_BAD_NAME),
        )
        .required(),
        key(
            "within_s",
            Form::Seconds,
            "How long the coordinators may take; after that it is taken down without them.",
            "within_s: 20",
            ("within_s: 0", TEXT_BAD_TIME),
        )
        .required(),
        key(
            "rest",
            Form::Set(&Form::Name(NameKind::Configuration)),
            "Configurations that bring the hardware to rest, in this order, where it is taken down without its coordinators.",
            "rest: [park]",
            ("rest: [\"p ark\"]", TEXT_BAD_NAME),
        ).without("only those that are `safe`"),
    ],
    ..Object::BARE
};

/// Bounds that the user sets.
pub static LIMITS: Object = Object {
    name: "limits",
    what: "`limits`",
    doc: "Bounds of one deployment.",
    example: "limits: { stack: 32, step_timeout_s: 0.5 }",
    keys: &[
        key(
            "stack",
            Form::Whole { least: FEWEST_FRAMES, most: MOST_FRAMES },
            "How many frames there may be of each coordinator, and of operators in each subsystem, before the oldest of them are squashed into one; that of \
             the deployment that runs counts for all its subsystems.",
            "stack: 32",
            ("stack: 1", TEXT_BAD_VALUE),
        )
        .without("64"),
        key(
            "step_timeout_s",
            Form::Seconds,
            "How long one step may take before its outcome is unknown, and how long a call that was given up may take to come \
             to rest.",
            "step_timeout_s: 0.5",
            ("step_timeout_s: -1", TEXT_BAD_TIME),
        )
        .without("1 s"),
    ],
    ..Object::BARE
};

/// What simulated components do.
pub static SIMULATED: Object = Object {
    name: "simulated",
    what: "`simulated`",
    doc: "What components of the simulated platform do by themselves.",
    example: "simulated: { reactions: [{ after: start radio, delay_s: 0.5, raise: e_qos_ok, component: radio }] }",
    keys: &[key(
        "reactions",
        Form::List(&Form::Table(&REACTION)),
        "What is raised after which step.",
        "reactions: [{ after: start radio, raise: e_qos_ok, component: radio }]",
        ("reactions: e_qos_ok", TEXT_WRONG_TYPE),
    )
    .without("nothing")],
    ..Object::BARE
};

/// A reaction.
pub static REACTION: Object = Object {
    name: "reaction",
    what: "a reaction",
    doc: "An event that a simulated component raises after a step was done.",
    example: "{ after: start radio, delay_s: 0.5, raise: e_qos_ok, component: radio }",
    keys: &[
        key(
            "after",
            Form::Step,
            "After each step whose text begins so, at a word's end; `davit plan` prints the texts of steps.",
            "after: start radio",
            ("after: 1", TEXT_WRONG_TYPE),
        )
        .required(),
        key("raise", Form::Name(NameKind::Event), "The event.", "raise: e_qos_ok", ("raise: \"e qos\"", TEXT_BAD_NAME))
            .required(),
        key(
            "component",
            Form::Name(NameKind::Component),
            "The component that raises it.",
            "component: radio",
            ("component: ra-dio", TEXT_BAD_NAME),
        )
        .required(),
        key("delay_s", Form::Seconds, "How much later.", "delay_s: 0.5", ("delay_s: -1", TEXT_BAD_TIME))
            .without("at once"),
    ],
    ..Object::BARE
};

/// A fault of the simulated platform.
pub static FAULT: Object = Object {
    name: "fault",
    what: "a fault",
    doc: "A step of the simulated platform that goes wrong.",
    example: "{ step: \"property_set a.k\", how: fail, times: 1 }",
    keys: &[
        key(
            "step",
            Form::Step,
            "Each step whose text begins so, at a word's end; `davit plan` prints the texts of steps.",
            "step: \"property_set a.k\"",
            ("step: 1", TEXT_WRONG_TYPE),
        )
        .required(),
        key(
            "how",
            Form::Choice(&["fail", "hang", "late", "lost", "lie", "slow"]),
            "What goes wrong with it. `fail`: refused at once. `hang`: its call never comes back. `late`: its call comes back after the deadline. `lost`: \
             the request never arrives. `lie`: answered as done, and it is not. `slow`: it takes `takes_s`.",
            "how: fail",
            ("how: fial", TEXT_BAD_VALUE),
        )
        .required(),
        key(
            "times",
            Form::Whole { least: 1, most: limits::FAULT_TIMES as i64 },
            "How many times; after that the step goes well.",
            "times: 2",
            ("times: 0", TEXT_BAD_VALUE),
        )
        .without("1"),
        key("takes_s", Form::Seconds, "How long a step takes that is `slow`: required there, and refused of any other.", "takes_s: 0.5", ("takes_s: 0", TEXT_BAD_TIME)).without("it takes no time")
            .beside("how: slow"),
    ],
    ..Object::BARE
};
