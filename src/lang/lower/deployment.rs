//! Deployment files: what their keys mean. The files they name are read by the caller.

use super::beside::{self, Fall, Rise};
use super::interface::{self, SubsystemDraft};
use super::{by_name, entries, name, own_name, simulated, text, types, value};
use crate::lang::bound;
use crate::lang::grammar::{ACTIVITY, DEPLOYMENT, Form, TRUSTED, TYPE};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::limits;
use crate::model::finding::did_you_mean;
use crate::model::{
    Activity, BringUp, Deployment, EventName, Finding, Ident, Openings, Origin, PlatformKind, TakeDown, Value, codes,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// A deployment file, before the files that it names are read.
pub struct Draft {
    /// What stands in it itself.
    pub deployment: Deployment,
    /// Whether all is there that must be; what is not has a name that nobody gave.
    pub is_whole: bool,
    /// `configurations`: paths and where they are named.
    pub configurations: Vec<(String, Origin)>,
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
    /// Parameters that are not declared in order, which is said.
    pub ill: Vec<Ident>,
    /// `subsystems`
    pub subsystems: Vec<SubsystemDraft>,
    /// `deploy`
    pub deploy: Option<Rise>,
    /// `shutdown`
    pub shutdown: Option<Fall>,
}

impl Draft {
    /// One with nothing in it.
    fn new() -> Option<Self> {
        let (nobody, event, within) = (Ident::new("unnamed").ok()?, EventName::new("unnamed").ok()?, Duration::ZERO);
        let shutdown = TakeDown { event, within, rest: Vec::new() };
        Some(Self {
            deployment: Deployment::new(nobody, nobody, BringUp { event, within }, shutdown),
            is_whole: true,
            configurations: Vec::new(),
            coordinators: Vec::new(),
            monitors: Vec::new(),
            trusted: None,
            host: Vec::new(),
            with: Vec::new(),
            ill: Vec::new(),
            subsystems: Vec::new(),
            deploy: None,
            shutdown: None,
        })
    }

    /// What must be there, if it is.
    fn needed<T>(&mut self, value: Option<T>) -> Option<T> {
        self.is_whole &= value.is_some();
        value
    }
}

/// Notes where every key of the file stands, by its path. Types are left out, but for the others that they name: they carry their
/// own places.
fn note_keys(entries: &[Entry], prefix: &str, out: &mut BTreeMap<String, Origin>) {
    for entry in entries {
        if prefix.is_empty() && matches!(&*entry.key, "types" | "with") {
            if let (true, Kind::Map(types)) = (entry.key == "types", &entry.value.kind) {
                types.iter().for_each(|ty| note_lists(ty, out));
            }
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

/// Notes where a type lists something: what its members are has places of its own.
fn note_lists(ty: &Entry, out: &mut BTreeMap<String, Origin>) {
    let Kind::Map(keys) = &ty.value.kind else { return };
    let is_list = |entry: &&Entry| matches!(TYPE.key(&entry.key), Some(key) if matches!(key.form, Form::Several(_) | Form::Set(_)));
    for entry in keys.iter().filter(is_list) {
        note_keys(std::slice::from_ref(entry), &format!("types.{}", ty.key), out);
    }
}

/// What a file is of that a deployment names, by its only key, and in which it is not named but written.
fn is_a_part(node: &Node) -> Option<&'static str> {
    let Kind::Map(entries) = &node.kind else { return None };
    let [only] = &entries[..] else { return None };
    let written = matches!(only.value.kind, Kind::Map(_));
    match &*only.key {
        "coordinator" if written => Some("a coordinator"),
        "configurations" if written => Some("configurations"),
        "monitors" if written => Some("monitors"),
        _ => None,
    }
}

/// Lowers the tree of a deployment file.
pub fn draft(cx: &mut Cx, node: Node, file_name: &str) -> Option<Draft> {
    if let Some(part) = is_a_part(&node) {
        let message = format!("this is a file of {part}, and no deployment");
        let help = "give the deployment that names it (it has `davit: 1`); `davit sim`, `davit graph` and `davit convert` take a coordinator";
        cx.report(Finding::error(codes::TEXT_NO_DEPLOYMENT, message).at(node.origin).help(help));
        return None;
    }
    let mut key_origins = BTreeMap::new();
    if let Kind::Map(entries) = &node.kind {
        note_keys(entries, "", &mut key_origins);
    }
    let mut fields = Fields::of(cx, node, &DEPLOYMENT)?;
    if let Some(node) = fields.take(cx, "davit") {
        match node.kind {
            Kind::Int(1) => {}
            Kind::Int(_) | Kind::Float(_) => cx.report(
                Finding::error(codes::TEXT_BAD_VALUE, "this version of Davit reads format 1 only")
                    .at(node.origin)
                    .labelled("another format")
                    .help("write `davit: 1`, or use the version of Davit that the file was written for"),
            ),
            _ => cx.wrong(&node, "`davit`", "a whole number (the format's version)", DEPLOYMENT.example),
        }
    }
    let mut out = Draft::new()?;
    let own = fields.needed(cx, "name", |_, _| format!("add `name: {file_name}`"));
    let own = own.and_then(|node| called(cx, &node, fields.row("name").example));
    out.needed(own).into_iter().for_each(|own| out.deployment.name = own);
    let platform = platform(cx, &mut fields);
    if let Some((platform, options)) = out.needed(platform) {
        (out.deployment.platform, out.deployment.platform_options) = (platform, options);
        out.deployment.kind = PlatformKind::of(platform);
    }
    let named = fields.has("libraries");
    bound::DEPLOYMENT.read(&mut out.deployment, &mut fields, cx);
    let types = fields.take(cx, "types").map(|node| types::types(cx, node));
    if !named && types.is_none() && !fields.misspelt("types") {
        let row = fields.row("libraries");
        let composed = fields.has("subsystems");
        let _ = fields.needed(cx, "libraries", |_, _| match composed {
            true => "where all components are those of its subsystems, add `types: {}`".to_owned(),
            false => format!("add `{}`, or types of your own under `types`", row.example),
        });
    }
    out.deployment.types = types.unwrap_or_default();
    out.deployment.activities = fields.take(cx, "activities").map(|node| activities(cx, node)).unwrap_or_default();
    out.configurations = files(cx, &mut fields, "configurations");
    out.coordinators = beside::coordinators(cx, &mut fields);
    out.monitors = files(cx, &mut fields, "monitors");
    out.trusted = fields.take(cx, "trusted").and_then(|node| trusted(cx, node));
    if let (None, Some(origin)) = (out.trusted, fields.place("host")) {
        let finding = Finding::error(codes::TEXT_BAD_VALUE, "`host` is given to coordinators that are not trusted");
        cx.report(finding.at(origin).help("write `trusted: true` beside it, or leave it out"));
    }
    out.host = files(cx, &mut fields, "host");
    out.with = fields.entries(cx, "with");
    (out.deployment.interface, out.ill) = interface::interface(cx, &mut fields);
    out.subsystems = interface::subsystems(cx, &mut fields);
    let deploy = fields.take(cx, "deploy").and_then(|node| beside::rise(cx, node));
    out.deploy = out.needed(deploy);
    let shutdown = fields.take(cx, "shutdown").and_then(|node| beside::fall(cx, node));
    out.shutdown = out.needed(shutdown);
    out.deploy.iter().for_each(|rise| out.deployment.deploy = rise.deploy);
    out.shutdown.iter().for_each(|fall| out.deployment.shutdown = fall.shutdown.clone());
    if let Some(entry) = fields.take_entry("durability") {
        let finding = Finding::error(codes::DEPLOY_NO_JOURNAL, "`durability` says how a journal is kept");
        cx.report(finding.at(entry.origin).help("there is no journal yet; leave the key out"));
    }
    let reactions = fields.take(cx, "simulated").map(|node| simulated::reactions(cx, node));
    out.deployment.reactions = reactions.unwrap_or_default();
    out.deployment.faults = fields.take(cx, "faults").map(|node| simulated::faults(cx, node)).unwrap_or_default();
    fields.finish(cx);
    out.deployment.key_origins = key_origins;
    Some(out)
}

/// The deployment's name: a file is called like that, and commands reach it there.
fn called(cx: &mut Cx, node: &Node, example: &str) -> Option<Ident> {
    let own: Ident = name(cx, node, "`name`", example)?;
    let letters = own.as_str().len();
    if letters <= limits::DEPLOYMENT_NAME {
        return Some(own);
    }
    let (at_most, origin) = (limits::DEPLOYMENT_NAME, cx.place(node));
    cx.report(
        Finding::error(codes::TEXT_BAD_NAME, format!("a deployment's name of {letters} letters"))
            .at(origin)
            .labelled(format!("at most {at_most}"))
            .help("commands reach it at a file of that name: choose a shorter one"),
    );
    None
}

/// `platform: NAME`, or `platform: { NAME: { option: value } }`.
fn platform(cx: &mut Cx, fields: &mut Fields) -> Option<(Ident, BTreeMap<Ident, Value>)> {
    let node = fields.take(cx, "platform")?;
    let example = fields.row("platform").example;
    let Node { kind: Kind::Map(mut entries), origin } = node else {
        return name(cx, &node, "`platform`", example).map(|name| (name, BTreeMap::new()));
    };
    let (Some(entry), true) = (entries.pop(), entries.is_empty()) else {
        let finding =
            Finding::error(codes::TEXT_BAD_VALUE, "`platform` names one platform, with its options under its name");
        cx.report(
            finding.at(origin).help(format!("write `{example}`, or `platform: {{ NAME: {{ option: value }} }}`")),
        );
        return None;
    };
    let platform = own_name::<Ident>(cx, &entry, "a platform", example)?;
    let mut options = BTreeMap::new();
    match entry.value.kind {
        Kind::Null => {}
        Kind::Map(entries) => {
            let what = "an option of a platform";
            let one = |cx: &mut Cx, _, entry: Entry| value(cx, entry.value, what);
            options.extend(by_name(cx, entries, what, "device: can0", one));
        }
        _ => cx.wrong(&entry.value, "what a platform is given", "a table of named values", "{ device: can0 }"),
    }
    Some((platform, options))
}

fn files(cx: &mut Cx, fields: &mut Fields, key: &'static str) -> Vec<(String, Origin)> {
    let mut out: Vec<(String, Origin)> = Vec::new();
    for node in fields.several(cx, key) {
        let Some(path) = text(cx, &node, &format!("`{key}`"), fields.row(key).example) else { continue };
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
    if let Kind::Bool(yes) = node.kind {
        return yes.then(Openings::default);
    }
    if !matches!(node.kind, Kind::Map(_)) {
        cx.wrong(&node, "`trusted`", "true or false, or a table with `open`", TRUSTED.example);
        return None;
    }
    let mut fields = Fields::of(cx, node, &TRUSTED)?;
    let mut out = Openings::default();
    for node in fields.several(cx, "open") {
        let Some(text) = text(cx, &node, "`open`", fields.row("open").example) else { continue };
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

fn activities(cx: &mut Cx, node: Node) -> BTreeMap<Ident, Activity> {
    let entries = entries(cx, node, "`activities`", ACTIVITY.example);
    let one = |cx: &mut Cx, _, entry: Entry| {
        let mut fields = Fields::of(cx, entry.value, &ACTIVITY)?;
        let mut activity = Activity { origin: entry.origin, ..Activity::default() };
        bound::ACTIVITY.read(&mut activity, &mut fields, cx);
        fields.finish(cx);
        Some(activity)
    };
    by_name(cx, entries, "an activity", ACTIVITY.example, one).into_iter().collect()
}
