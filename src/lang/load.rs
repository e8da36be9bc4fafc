//! The entrances: a deployment with all its files, or one file alone.

use super::concern;
use super::files::Sources;
use super::grammar::{CONFIGURATIONS_FILE, COORDINATOR_FILE, MONITORS_FILE};
use super::lower::{chart, configuration, monitor};
use super::lua;
use super::params::Params;
use super::scxml;
use super::texts::{
    LoadOptions, configuration_tree, coordinator, host_files, loads, monitor_tree, nothing, only_key, open, stem,
    unique,
};
use super::tree::{Cx, Kind, Reading};
use super::trusted::{self, Trust};
use super::whole;
use super::yaml;
use crate::diagnostics::{Language, SourceMap};
use crate::model::{Configuration, Deployment, Finding, Findings, Monitor, Origin, Program, Statechart, codes};
use std::path::Path;
use std::sync::Arc;

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
    let deployment = whole::deployment(&mut cx, from, path, options);
    cx.told_once();
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
