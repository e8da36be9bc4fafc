//! The entrances: a deployment with all its files, or one file alone.

use super::concern;
use super::files::{self, Sources};
use super::grammar::{CONFIGURATIONS_FILE, COORDINATOR_FILE, MONITORS_FILE, Object};
use super::lower::{beside, chart, configuration, deployment, monitor};
use super::lua;
use super::params::Params;
use super::scxml;
use super::tree::{Cx, Entry, Fields, Kind, Node, Reading};
use super::trusted::{self, Trust, Trusted};
use super::yaml;
use crate::diagnostics::{Language, SourceMap};
use crate::model::{
    ConfigId, Configuration, Deployment, Finding, Findings, Monitor, Origin, PlatformKind, Program, Statechart, codes,
};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How to load.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Parameters (`--set a.b=1` is `("a.b", "1")`): they override `with:`.
    pub set: Vec<(String, String)>,
    /// For a coordinator's file alone: it may have functions. In a deployment `trusted:` says so.
    pub trusted: bool,
    /// Files that stand in for the host of a trusted coordinator, beside those that a deployment names.
    pub host: Vec<PathBuf>,
}

/// What loading a deployment gave.
#[derive(Debug)]
pub struct Loaded {
    /// The deployment; none when something in its texts refuses it.
    pub deployment: Option<Deployment>,
    /// The deployment when nothing refuses it but what is wrong in the texts of some configurations: each such finding has
    /// a path that begins with `configurations.ID`. What could not be read of these is missing in it.
    pub but_for: Option<Deployment>,
    /// What was found.
    pub findings: Findings,
    /// The texts, and where everything stands.
    pub sources: SourceMap,
    /// Whether a text could not be read or parsed at all (exit status 2); else what is wrong was judged (1).
    pub unreadable: bool,
}

/// What loading a file of configurations gave.
#[derive(Debug)]
pub struct LoadedConfigurations {
    /// Its configurations, in written order.
    pub configurations: Vec<Configuration>,
    /// What was found.
    pub findings: Findings,
    /// The text, and where everything stands.
    pub sources: SourceMap,
    /// As in [`Loaded`].
    pub unreadable: bool,
}

/// What loading a coordinator's file gave.
#[derive(Debug)]
pub struct LoadedCoordinator {
    /// The statechart.
    pub coordinator: Option<Statechart>,
    /// Its texts, when it has functions.
    pub program: Option<Arc<Program>>,
    /// What was found.
    pub findings: Findings,
    /// The text, and where everything stands.
    pub sources: SourceMap,
    /// As in [`Loaded`].
    pub unreadable: bool,
}

/// What loading a file of monitors gave.
#[derive(Debug)]
pub struct LoadedMonitors {
    /// Its monitors, in written order.
    pub monitors: Vec<Monitor>,
    /// What was found.
    pub findings: Findings,
    /// The text, and where everything stands.
    pub sources: SourceMap,
    /// As in [`Loaded`].
    pub unreadable: bool,
}

/// Loads a deployment file and all that it names.
pub fn load(path: &Path, options: &LoadOptions) -> Loaded {
    load_from(&Sources::Disk, path, options)
}

/// The same, from a given set of files.
pub fn load_from(from: &Sources, path: &Path, options: &LoadOptions) -> Loaded {
    let mut cx = Cx::default();
    let deployment = load_deployment(&mut cx, from, path, options);
    let (deployment, but_for) = match deployment {
        Some(deployment) if !crate::model::finding::has_errors(&cx.findings) => (Some(deployment), None),
        other => (None, other.filter(|_| !cx.unreadable && concern::only_configurations(&cx.findings))),
    };
    Loaded { deployment, but_for, findings: cx.findings, sources: cx.sources, unreadable: cx.unreadable }
}

/// Loads one file of configurations, Lua or YAML.
pub fn load_configurations(from: &Sources, path: &Path, options: &LoadOptions) -> LoadedConfigurations {
    let mut cx = Cx::default();
    let mut params = Params::new(&mut cx, Vec::new(), &options.set);
    let mut configurations = Vec::new();
    if let Some(node) = configuration_tree(&mut cx, from, path, Origin::NONE, &mut params) {
        configurations = configuration::configurations(&mut cx, node);
        unique(&mut cx, &mut configurations);
    }
    params.finish(&mut cx);
    LoadedConfigurations { configurations, findings: cx.findings, sources: cx.sources, unreadable: cx.unreadable }
}

/// Loads one coordinator's file, Lua or YAML.
pub fn load_coordinator(from: &Sources, path: &Path, options: &LoadOptions) -> LoadedCoordinator {
    let mut cx = Cx::default();
    let mut params = Params::new(&mut cx, Vec::new(), &options.set);
    let trust = options.trusted.then(|| Trust { host: host_files(&options.host), ..Trust::default() });
    let coordinator = coordinator(&mut cx, from, path, Origin::NONE, &mut params, trust.as_ref());
    params.finish(&mut cx);
    let coordinator = coordinator.filter(|_| !crate::model::finding::has_errors(&cx.findings));
    let (coordinator, program) = coordinator.map_or((None, None), |(chart, program)| (Some(chart), program));
    LoadedCoordinator { coordinator, program, findings: cx.findings, sources: cx.sources, unreadable: cx.unreadable }
}

fn host_files(paths: &[PathBuf]) -> Vec<(PathBuf, Origin)> {
    paths.iter().map(|path| (path.clone(), Origin::NONE)).collect()
}

/// Loads one file of monitors, Lua or YAML.
pub fn load_monitors(from: &Sources, path: &Path, options: &LoadOptions) -> LoadedMonitors {
    let mut cx = Cx::default();
    let mut params = Params::new(&mut cx, Vec::new(), &options.set);
    let mut monitors = Vec::new();
    if let Some(node) = monitor_tree(&mut cx, from, path, Origin::NONE, &mut params) {
        monitors = monitor::monitors(&mut cx, node);
        monitor::unique(&mut cx, &mut monitors);
    }
    params.finish(&mut cx);
    LoadedMonitors { monitors, findings: cx.findings, sources: cx.sources, unreadable: cx.unreadable }
}

/// What a file turned out to hold.
#[derive(Debug)]
pub enum Content {
    /// Configurations.
    Configurations(Vec<Configuration>),
    /// A coordinator.
    Coordinator(Statechart, Option<Arc<Program>>),
    /// Monitors.
    Monitors(Vec<Monitor>),
}

/// Loads a file of configurations or a coordinator's file, whichever it is.
pub(super) fn load_any(
    from: &Sources,
    path: &Path,
    options: &LoadOptions,
) -> (Option<Content>, Findings, SourceMap, bool) {
    let mut cx = Cx::default();
    let mut params = Params::new(&mut cx, Vec::new(), &options.set);
    let content = any(&mut cx, from, path, &mut params, options);
    params.finish(&mut cx);
    (content, cx.findings, cx.sources, cx.unreadable)
}

fn any(cx: &mut Cx, from: &Sources, path: &Path, params: &mut Params, options: &LoadOptions) -> Option<Content> {
    let (reading, language) = open(cx, from, path, Origin::NONE)?;
    let (configurations, chart, monitors) = match language {
        Language::Lua => {
            let before = cx.findings.len();
            let made = lua::read(cx, reading, params, &stem(path), Some(loads(from, path)));
            // Whatever it makes, it is no coordinator, trusted or not.
            let other = made.as_ref().is_some_and(|made| {
                let some = made.configurations.is_some() || made.monitors.is_some();
                made.chart.is_none() && (some || !crate::model::finding::has_errors(&cx.findings[before..]))
            });
            if options.trusted && !other && !cx.unreadable && !made_of_others(cx, reading) {
                cx.findings.truncate(before);
                let host = host_files(&options.host);
                let trust = Trust { host, tell_fields: true, ..Trust::default() };
                let read = trusted::read(cx, from, path, reading, params, &trust, &stem(path));
                return read.map(|(chart, program)| Content::Coordinator(chart, program));
            }
            let made = made?;
            (made.configurations, made.chart, made.monitors)
        }
        Language::Scxml => return scxml::read(cx, reading).map(|chart| Content::Coordinator(chart, None)),
        Language::Yaml => {
            let node = yaml::read(cx, reading)?;
            let is = |key: &str| matches!(&node.kind, Kind::Map(entries) if entries.iter().any(|e| e.key == key));
            if is("davit") {
                let finding = Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, "a deployment is written in YAML only");
                cx.report(
                    finding.at(reading.whole).help("convert the files of configurations and the coordinator it names"),
                );
                return None;
            }
            if is("coordinator") {
                (None, only_key(cx, node, reading, &COORDINATOR_FILE), None)
            } else if is("monitors") {
                (None, None, only_key(cx, node, reading, &MONITORS_FILE))
            } else {
                (only_key(cx, node, reading, &CONFIGURATIONS_FILE), None, None)
            }
        }
    };
    match (configurations, chart, monitors) {
        (_, Some(node), _) => chart::statechart(cx, node).map(|chart| Content::Coordinator(chart, None)),
        (None, None, Some(node)) => {
            let mut list = monitor::monitors(cx, node);
            monitor::unique(cx, &mut list);
            Some(Content::Monitors(list))
        }
        (Some(node), None, _) => {
            let mut list = configuration::configurations(cx, node);
            unique(cx, &mut list);
            Some(Content::Configurations(list))
        }
        (None, None, None) => {
            nothing(
                cx,
                reading,
                "configuration, no coordinator and no monitor",
                "`ConfiguratorConf { … }`, `return state { … }` or `Monitors { … }`",
            );
            None
        }
    }
}

/// Whether a text makes configurations or monitors, by the constructors it names.
fn made_of_others(cx: &Cx, reading: Reading) -> bool {
    let text = &cx.sources.file(reading.file).text;
    ["ConfiguratorConf", "Configuration", "Monitors"].iter().any(|name| trusted::mentions(text, name))
}

/// Reads a text into the source map. `named_at` is the place that named the file.
fn open(cx: &mut Cx, from: &Sources, path: &Path, named_at: Origin) -> Option<(Reading, Language)> {
    let Some(language) = files::language(path) else {
        let message = format!("{} is neither Lua, YAML nor SCXML by its name", path.display());
        let help = "files end in `.lua`, `.yaml` or `.yml`, or `.scxml` for a coordinator";
        cx.refuse(Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, message).at(named_at).help(help));
        return None;
    };
    match from.read(path) {
        Ok(text) => {
            let file = cx.sources.add_file(path.display().to_string(), text, language);
            let whole = cx.sources.whole_file(file);
            Some((Reading { file, whole }, language))
        }
        Err(finding) => {
            cx.refuse(finding.at(named_at));
            None
        }
    }
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The map of configurations of a file.
fn configuration_tree(cx: &mut Cx, from: &Sources, path: &Path, named_at: Origin, params: &mut Params) -> Option<Node> {
    let (reading, language) = open(cx, from, path, named_at)?;
    let before = cx.findings.len();
    match language {
        Language::Lua => {
            let made = lua::read(cx, reading, params, &stem(path), None)?;
            if let Some(configurations) = &made.configurations {
                concern::by_place(cx, before, configurations);
            }
            if made.configurations.is_none() {
                nothing(cx, reading, "configuration", "`ConfiguratorConf { name = Configuration { … } }`");
            }
            made.configurations
        }
        Language::Scxml => only_charts(cx, reading, "configurations"),
        Language::Yaml => {
            let node = yaml::read(cx, reading)?;
            let after = cx.findings.len();
            let configurations = only_key(cx, node, reading, &CONFIGURATIONS_FILE)?;
            // Of the file as a whole is what was found after it was read.
            let of_file = cx.findings.split_off(after);
            concern::by_place(cx, before, &configurations);
            cx.findings.extend(of_file);
            Some(configurations)
        }
    }
}

/// The map of monitors of a file.
fn monitor_tree(cx: &mut Cx, from: &Sources, path: &Path, named_at: Origin, params: &mut Params) -> Option<Node> {
    let (reading, language) = open(cx, from, path, named_at)?;
    match language {
        Language::Lua => {
            let made = lua::read(cx, reading, params, &stem(path), None)?;
            if made.monitors.is_none() {
                nothing(cx, reading, "monitor", "`Monitors { name = monitor { … } }`");
            }
            made.monitors
        }
        Language::Scxml => only_charts(cx, reading, "monitors"),
        Language::Yaml => {
            let node = yaml::read(cx, reading)?;
            only_key(cx, node, reading, &MONITORS_FILE)
        }
    }
}

/// SCXML has words for charts and for nothing else.
fn only_charts(cx: &mut Cx, reading: Reading, what: &str) -> Option<Node> {
    let finding = Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, format!("{what} are not written in SCXML"));
    cx.refuse(finding.at(reading.whole).help("an SCXML file can be a coordinator"));
    None
}

fn nothing(cx: &mut Cx, reading: Reading, what: &str, how: &str) {
    if !crate::model::finding::has_errors(&cx.findings) {
        let finding = Finding::error(codes::TEXT_NOTHING, format!("there is no {what} in this file"));
        cx.report(finding.at(reading.whole).help(format!("write {how}")));
    }
}

/// The value of a file's one top-level key.
fn only_key(cx: &mut Cx, node: Node, reading: Reading, file: &'static Object) -> Option<Node> {
    let node = match node.kind {
        Kind::Null => Node::new(Kind::Map(Vec::new()), reading.whole),
        _ => node,
    };
    let mut fields = Fields::of(cx, node, file)?;
    let value = fields.needed(cx, file.keys[0].name, |_, _| format!("add `{}`", file.example));
    fields.finish(cx);
    value
}

/// Reports configurations of the same name, and keeps the first of each.
fn unique(cx: &mut Cx, configurations: &mut Vec<Configuration>) {
    let mut seen: FxHashMap<ConfigId, Origin> = FxHashMap::default();
    configurations.retain(|c| match seen.get(&c.id) {
        None => {
            seen.insert(c.id, c.origin);
            true
        }
        Some(first) => {
            cx.report(
                Finding::error(codes::CONF_DUPLICATE, format!("there are two configurations `{}`", c.id))
                    .at(c.origin)
                    .labelled("again here")
                    .also(*first, "first here")
                    .path(concern::path(c.id.as_str()))
                    .help("a request names one configuration: give one of them another name"),
            );
            false
        }
    });
}

fn loads(from: &Sources, path: &Path) -> lua::Loads {
    lua::Loads { from: from.clone(), folder: path.parent().map_or_else(PathBuf::new, Path::to_path_buf) }
}

fn coordinator(
    cx: &mut Cx,
    from: &Sources,
    path: &Path,
    named_at: Origin,
    params: &mut Params,
    trust: Option<&Trust>,
) -> Option<Trusted> {
    let (reading, language) = open(cx, from, path, named_at)?;
    let node = match (language, trust) {
        (Language::Lua, Some(trust)) => {
            return trusted::read(cx, from, path, reading, params, trust, &stem(path));
        }
        (Language::Lua, None) => {
            let made = lua::read(cx, reading, params, &stem(path), Some(loads(from, path)))?;
            if made.chart.is_none() {
                nothing(cx, reading, "coordinator", "`return state { … }`");
            }
            made.chart?
        }
        (Language::Scxml, _) => return scxml::read(cx, reading).map(|chart| (chart, None)),
        (Language::Yaml, _) => {
            let node = yaml::read(cx, reading)?;
            only_key(cx, node, reading, &COORDINATOR_FILE)?
        }
    };
    chart::statechart(cx, node).map(|chart| (chart, None))
}

fn load_deployment(cx: &mut Cx, from: &Sources, path: &Path, options: &LoadOptions) -> Option<Deployment> {
    let (reading, language) = open(cx, from, path, Origin::NONE)?;
    if language != Language::Yaml {
        let finding = Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, "a deployment is written in YAML").at(reading.whole);
        cx.refuse(finding.help("give the deployment's file (`deployments/NAME.yaml`); this one can be named in it"));
        return None;
    }
    let node = yaml::read(cx, reading)?;
    let node = match node.kind {
        Kind::Null => Node::new(Kind::Map(Vec::new()), reading.whole),
        _ => node,
    };
    let origin = match &node.kind {
        Kind::Map(entries) => entries.first().map_or(reading.whole, |e: &Entry| e.origin),
        _ => reading.whole,
    };
    let draft = deployment::draft(cx, node, &stem(path))?;
    let mut params = Params::new(cx, draft.with, &options.set);
    let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let mut configurations = Vec::new();
    for (file, named_at) in &draft.configurations {
        if let Some(node) = configuration_tree(cx, from, &folder.join(file), *named_at, &mut params) {
            let of_file = configuration::configurations(cx, node);
            if configurations.is_empty() {
                configurations = of_file;
            } else {
                configurations.extend(of_file);
            }
        }
    }
    unique(cx, &mut configurations);
    let (mut charts, mut programs) = (Vec::new(), BTreeMap::new());
    let trust = draft.trusted.map(|open| {
        let named = draft.host.iter().map(|(file, origin)| (folder.join(file), *origin));
        Trust { open, host: named.chain(host_files(&options.host)).collect(), tell_fields: false }
    });
    for (name, file, named_at) in &draft.coordinators {
        if let Some((chart, program)) =
            coordinator(cx, from, &folder.join(file), *named_at, &mut params, trust.as_ref())
        {
            let own = name.or(draft.name);
            programs.extend(own.zip(program));
            charts.push((*name, chart, *named_at));
        }
    }
    let is_lua = |cx: &Cx, file: &str| {
        let name = folder.join(file).display().to_string();
        cx.sources.files().iter().any(|of| *of.name == *name && of.language == Language::Lua)
    };
    if let (Some((_, at)), true, false) = (draft.host.first(), trust.is_some(), charts.is_empty())
        && !draft.coordinators.iter().any(|(_, file, _)| is_lua(cx, file))
    {
        let finding = Finding::error(codes::TEXT_BAD_VALUE, "`host` is given, and no coordinator is in Lua").at(*at);
        cx.report(finding.help("leave it out: only functions of a coordinator in Lua have a host"));
    }
    let mut monitors = Vec::new();
    for (file, named_at) in &draft.monitors {
        if let Some(node) = monitor_tree(cx, from, &folder.join(file), *named_at, &mut params) {
            monitors.extend(monitor::monitors(cx, node));
        }
    }
    monitor::unique(cx, &mut monitors);
    params.finish(cx);
    if charts.len() < draft.coordinators.len() {
        return None;
    }
    if charts.is_empty() {
        return None;
    }
    let (coordinators, deploy, shutdown) = beside::join(cx, draft.name?, charts, &draft.deploy?, &draft.shutdown?);
    Some(Deployment {
        name: draft.name?,
        platform: draft.platform?,
        kind: PlatformKind::of(draft.platform?),
        platform_options: draft.platform_options,
        libraries: draft.libraries,
        types: draft.types,
        activities: draft.activities,
        configurations,
        coordinators,
        programs,
        monitors,
        emits: draft.emits,
        safety: draft.safety,
        operator: draft.operator,
        deploy,
        shutdown,
        limits: draft.limits,
        reactions: draft.reactions,
        faults: draft.faults,
        origin,
        key_origins: draft.key_origins,
    })
}
