//! Deployment files: the keys of design §16. The files they name are read by the caller.

use super::beside::{self, Fall, Rise};
use super::{Unit, name, one_or_more, simulated, text, time, types, whole};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::did_you_mean;
use crate::model::names::NameError;
use crate::model::{
    Activity, ComponentType, ConfigId, DeploymentLimits, EventName, Finding, Ident, MemberRef, Openings, OperatorMay,
    Origin, SimulatedReaction, StepFault, codes,
};
use std::collections::BTreeMap;
use std::str::FromStr;

/// A deployment file, before the files that it names are read.
pub struct Draft {
    /// `name`
    pub name: Option<Ident>,
    /// `platform`
    pub platform: Option<Ident>,
    /// `libraries`
    pub libraries: Vec<Ident>,
    /// `types`
    pub types: Vec<ComponentType>,
    /// `activities`
    pub activities: BTreeMap<Ident, Activity>,
    /// `configurations`: paths and where they are named; none when the key is missing.
    pub configurations: Option<Vec<(String, Origin)>>,
    /// `coordinator` and `coordinators`, in written order: names (none: called like the deployment), paths, and where.
    pub coordinators: Vec<(Option<Ident>, String, Origin)>,
    /// `monitors`: paths and where they are named.
    pub monitors: Vec<(String, Origin)>,
    /// `trusted`: the coordinators may have functions, and this is open to them.
    pub trusted: Option<Openings>,
    /// `host`: Lua files that stand in for the coordinators' host, and where they are named.
    pub host: Vec<(String, Origin)>,
    /// `with`: parameters of the Lua files.
    pub with: Vec<Entry>,
    /// `emits`
    pub emits: Vec<(EventName, Origin)>,
    /// `safety`
    pub safety: Vec<(EventName, Origin)>,
    /// `operator`
    pub operator: Vec<(OperatorMay, Origin)>,
    /// `deploy`
    pub deploy: Option<Rise>,
    /// `shutdown`
    pub shutdown: Option<Fall>,
    /// `limits`
    pub limits: DeploymentLimits,
    /// `simulated`
    pub reactions: Vec<SimulatedReaction>,
    /// `faults`
    pub faults: Vec<StepFault>,
    /// Where keys stand, by path.
    pub key_origins: BTreeMap<String, Origin>,
}

/// Notes where every key of the file stands, by its path. Types are left out: they carry their own places.
fn note_keys(entries: &[Entry], prefix: &str, out: &mut BTreeMap<String, Origin>) {
    for entry in entries {
        if prefix.is_empty() && matches!(&*entry.key, "types" | "with") {
            continue;
        }
        let path = if prefix.is_empty() { entry.key.to_string() } else { format!("{prefix}.{}", entry.key) };
        match &entry.value.kind {
            Kind::Map(inner) => note_keys(inner, &path, out),
            Kind::List(list) => {
                for (i, node) in list.iter().enumerate() {
                    out.insert(format!("{path}[{i}]"), node.origin);
                }
            }
            Kind::Str(_) | Kind::Int(_) | Kind::Float(_) => {
                out.insert(path, entry.value.origin);
                continue;
            }
            _ => {}
        }
        out.insert(path, entry.origin);
    }
}

/// Lowers the tree of a deployment file.
pub fn draft(cx: &mut Cx, node: Node, file_name: &str) -> Option<Draft> {
    let mut key_origins = BTreeMap::new();
    if let Kind::Map(entries) = &node.kind {
        note_keys(entries, "", &mut key_origins);
    }
    let mut fields = Fields::of(cx, node, "a deployment", "davit: 1")?;
    if let Some(node) = fields.required(cx, "davit", "davit: 1") {
        match node.kind {
            Kind::Int(1) => {}
            Kind::Int(_) | Kind::Float(_) => cx.report(
                Finding::error(codes::TEXT_BAD_VALUE, "this version of Davit reads format 1 only")
                    .at(node.origin)
                    .labelled("another format")
                    .help("write `davit: 1`, or use the version of Davit that the file was written for"),
            ),
            _ => cx.wrong(&node, "`davit`", "a whole number (the format's version)", "davit: 1"),
        }
    }
    let deployment = fields
        .required(cx, "name", &format!("name: {file_name}"))
        .and_then(|node| name::<Ident>(cx, &node, "`name`", "name: youbot_arm"));
    let platform = fields
        .required(cx, "platform", "platform: embedded")
        .and_then(|node| name::<Ident>(cx, &node, "`platform`", "platform: embedded"));
    let libraries = fields.take("libraries").map(|node| libraries(cx, node));
    let types = fields.take("types").map(|node| types::types(cx, node));
    if libraries.is_none() && types.is_none() && !fields.misspelt("types") {
        let _ = fields.required(cx, "libraries", "libraries: [standard]");
    }
    let activities = fields.take("activities").map(|node| activities(cx, node)).unwrap_or_default();
    let configurations = fields
        .required(cx, "configurations", "configurations: [configurations.lua]")
        .map(|node| files(cx, node, "`configurations`", "configurations: [configurations.lua]"));
    let coordinators = beside::coordinators(cx, &mut fields);
    let monitors = fields.take("monitors").map(|node| files(cx, node, "`monitors`", "monitors: [monitors.lua]"));
    let trusted = fields.take("trusted").and_then(|node| trusted(cx, node));
    let host_key = fields.take_entry("host");
    if let (None, Some(entry)) = (trusted, &host_key) {
        let finding = Finding::error(codes::TEXT_BAD_VALUE, "`host` is given to coordinators that are not trusted");
        cx.report(finding.at(entry.origin).help("write `trusted: true` beside it, or leave it out"));
    }
    let host = host_key.map(|entry| files(cx, entry.value, "`host`", "host: [robot.lua]")).unwrap_or_default();
    let with = match fields.take("with") {
        None => Vec::new(),
        Some(Node { kind: Kind::Map(entries), .. }) => entries,
        Some(node) => {
            cx.wrong(&node, "`with`", "a table of named values", "with: { gain: 0.5 }");
            Vec::new()
        }
    };
    let emits = fields.take("emits").map(|node| emits(cx, node)).unwrap_or_default();
    let safety = fields.take("safety");
    let safety = safety.map(|node| names(cx, node, "`safety`", "an event", "safety: [e_estop]")).unwrap_or_default();
    let operator = fields.take("operator").map(|node| operator(cx, node)).unwrap_or_default();
    let deploy = fields.required(cx, "deploy", DEPLOY).and_then(|node| beside::rise(cx, node));
    let shutdown = fields.required(cx, "shutdown", SHUTDOWN).and_then(|node| beside::fall(cx, node));
    let limits = fields.take("limits").map(|node| limits(cx, node)).unwrap_or_default();
    if let Some(entry) = fields.take_entry("durability") {
        let finding = Finding::error(codes::DEPLOY_NO_JOURNAL, "`durability` says how a journal is kept");
        cx.report(finding.at(entry.origin).help("there is no journal yet; leave the key out"));
    }
    let reactions = fields.take("simulated").map(|node| simulated::reactions(cx, node)).unwrap_or_default();
    let faults = fields.take("faults").map(|node| simulated::faults(cx, node)).unwrap_or_default();
    fields.finish(cx);
    Some(Draft {
        name: deployment,
        platform,
        libraries: libraries.unwrap_or_default(),
        types: types.unwrap_or_default(),
        activities,
        configurations,
        coordinators,
        monitors: monitors.unwrap_or_default(),
        trusted,
        host,
        with,
        emits,
        safety,
        operator,
        deploy,
        shutdown,
        limits,
        reactions,
        faults,
        key_origins,
    })
}

pub(super) const DEPLOY: &str = "deploy: { event: e_start, up: operational, within_s: 20 }";
pub(super) const SHUTDOWN: &str = "shutdown: { event: e_shutdown, down: idle, within_s: 20 }";

fn libraries(cx: &mut Cx, node: Node) -> Vec<Ident> {
    one_or_more(node).iter().filter_map(|node| name(cx, node, "a library", "libraries: [standard]")).collect()
}

fn files(cx: &mut Cx, node: Node, what: &str, example: &str) -> Vec<(String, Origin)> {
    let mut out: Vec<(String, Origin)> = Vec::new();
    for node in one_or_more(node) {
        let Some(path) = text(cx, &node, what, example) else { continue };
        if let Some((_, first)) = out.iter().find(|(p, _)| *p == path) {
            let finding = Finding::error(codes::TEXT_DUPLICATE_KEY, format!("`{path}` is named twice"));
            cx.report(finding.at(node.origin).also(*first, "first here").help("name each file once"));
            continue;
        }
        out.push((path, node.origin));
    }
    out
}

/// `trusted: true`, or `trusted: { open: [io] }`.
fn trusted(cx: &mut Cx, node: Node) -> Option<Openings> {
    const EXAMPLE: &str = "trusted: { open: [io, os] }";
    if let Kind::Bool(yes) = node.kind {
        return yes.then(Openings::default);
    }
    let mut fields = Fields::of(cx, node, "`trusted`", "trusted: true")?;
    let mut out = Openings::default();
    for node in fields.take("open").map(one_or_more).unwrap_or_default() {
        let Some(text) = text(cx, &node, "`open`", EXAMPLE) else { continue };
        match text.as_str() {
            "io" => out.io = true,
            "os" => out.os = true,
            other => {
                let finding = Finding::error(codes::TEXT_BAD_VALUE, format!("`{other}` cannot be opened"));
                cx.report(finding.at(node.origin).help(did_you_mean(other, "libraries", Openings::NAMES)));
            }
        }
    }
    fields.finish(cx);
    Some(out)
}

fn emits(cx: &mut Cx, node: Node) -> Vec<(EventName, Origin)> {
    one_or_more(node)
        .iter()
        .filter_map(|node| Some((name(cx, node, "an emitted event", "emits: [e_ready]")?, node.origin)))
        .collect()
}

/// A list of names, each of them once; `key` is where they stand, `what` what each of them is.
pub(super) fn names<T>(cx: &mut Cx, node: Node, key: &str, what: &str, example: &str) -> Vec<(T, Origin)>
where
    T: FromStr<Err = NameError> + PartialEq + std::fmt::Display,
{
    let mut out: Vec<(T, Origin)> = Vec::new();
    for node in one_or_more(node) {
        let Some(name) = name::<T>(cx, &node, what, example) else { continue };
        once(cx, &mut out, name, node.origin, key);
    }
    out
}

fn once<T: PartialEq + std::fmt::Display>(cx: &mut Cx, out: &mut Vec<(T, Origin)>, name: T, origin: Origin, key: &str) {
    match out.iter().find(|(other, _)| *other == name) {
        None => out.push((name, origin)),
        Some((_, first)) => {
            let finding = Finding::error(codes::TEXT_DUPLICATE_KEY, format!("`{name}` stands twice in {key}"));
            cx.report(finding.at(origin).also(*first, "first here").help("name each once"));
        }
    }
}

/// `operator`: configurations, and properties and in-ports as `Component.member`.
fn operator(cx: &mut Cx, node: Node) -> Vec<(OperatorMay, Origin)> {
    const EXAMPLE: &str = "operator: [profile_soft, Cart_Impedance.stiffness]";
    let mut out = Vec::new();
    for node in one_or_more(node) {
        let is_member = matches!(&node.kind, Kind::Str(text) if text.contains('.'));
        let may = if is_member {
            name::<MemberRef>(cx, &node, "a property or port", EXAMPLE).map(OperatorMay::Set)
        } else {
            name::<ConfigId>(cx, &node, "a configuration", EXAMPLE).map(OperatorMay::Apply)
        };
        if let Some(may) = may {
            once(cx, &mut out, may, node.origin, "`operator`");
        }
    }
    out
}

fn activities(cx: &mut Cx, node: Node) -> BTreeMap<Ident, Activity> {
    const EXAMPLE: &str = "control: { period_ms: 1.0, priority: 80 }";
    let entries = match node.kind {
        Kind::Map(entries) => entries,
        _ => {
            cx.wrong(&node, "`activities`", "a table of named values", EXAMPLE);
            return BTreeMap::new();
        }
    };
    let mut out = BTreeMap::new();
    for entry in entries {
        let key = Node::new(Kind::Str(entry.key.into()), entry.origin);
        let ident = name::<Ident>(cx, &key, "an activity", EXAMPLE);
        let value = match entry.value.kind {
            Kind::Null => Node::new(Kind::Map(Vec::new()), entry.origin),
            _ => entry.value,
        };
        let Some(mut fields) = Fields::of(cx, value, "an activity", EXAMPLE) else { continue };
        let period = fields
            .take("period_ms")
            .and_then(|node| time(cx, &node, "`period_ms`", Unit::Milliseconds, "period_ms: 1.0"));
        let priority = fields.take("priority").and_then(|node| whole(cx, &node, "`priority`", 0..=99, "priority: 80"));
        let cpu = fields.take("cpu").and_then(|node| whole(cx, &node, "`cpu`", 0..=4095, "cpu: 1"));
        fields.finish(cx);
        if let Some(ident) = ident {
            let priority = priority.and_then(|p| u8::try_from(p).ok()).unwrap_or_default();
            let cpu = cpu.and_then(|c| u32::try_from(c).ok());
            out.insert(ident, Activity { period, priority, cpu, origin: entry.origin });
        }
    }
    out
}

/// Fewest frames a deployment may ask for: the newest, and the one that all others are squashed into.
const FEWEST_FRAMES: i64 = 2;
/// Most frames a deployment may ask for: each holds its inverse in memory.
const MOST_FRAMES: i64 = 100_000;

fn limits(cx: &mut Cx, node: Node) -> DeploymentLimits {
    let mut out = DeploymentLimits::default();
    let Some(mut fields) = Fields::of(cx, node, "`limits`", "limits: { stack: 64, step_timeout_s: 1.0 }") else {
        return out;
    };
    if let Some(node) = fields.take("stack")
        && let Some(v) = whole(cx, &node, "`stack`", FEWEST_FRAMES..=MOST_FRAMES, "stack: 64")
    {
        out.stack = usize::try_from(v).unwrap_or(out.stack);
    }
    if let Some(node) = fields.take("step_timeout_s")
        && let Some(v) = time(cx, &node, "`step_timeout_s`", Unit::Seconds, "step_timeout_s: 1.0")
    {
        out.step_timeout = v;
    }
    fields.finish(cx);
    out
}
