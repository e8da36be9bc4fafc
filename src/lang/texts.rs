//! Single texts: opened, read into a tree, and that for which they are named taken out of it.

use super::concern;
use super::files::{self, Sources};
use super::grammar::{CONFIGURATIONS_FILE, COORDINATOR_FILE, MONITORS_FILE, Object};
use super::lower::chart;
use super::lua;
use super::params::Params;
use super::scxml;
use super::tree::{Cx, Fields, Kind, Node, Reading};
use super::trusted::{self, Trust, Trusted};
use super::yaml;
use crate::diagnostics::Language;
use crate::model::{ConfigId, Configuration, Finding, Origin, codes};
use rustc_hash::FxHashMap;
use std::path::{Path, PathBuf};

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

pub(super) fn host_files(paths: &[PathBuf]) -> Vec<(PathBuf, Origin)> {
    paths.iter().map(|path| (path.clone(), Origin::NONE)).collect()
}

/// Reads a text into the source map. `named_at` is the place that named the file.
pub(super) fn open(cx: &mut Cx, from: &Sources, path: &Path, named_at: Origin) -> Option<(Reading, Language)> {
    let Some(language) = files::language(path) else {
        if let (Sources::Disk, true, Err(folder)) = (from, path.is_dir(), from.read(path)) {
            cx.refuse(folder.at(named_at));
            return None;
        }
        let message = format!("{} is neither Lua, YAML nor SCXML by its name", path.display());
        let help = "files end in `.lua`, `.yaml` or `.yml`, or `.scxml` for a coordinator";
        cx.refuse(Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, message).at(named_at).help(help));
        return None;
    };
    let by = cx.sources.file_of(named_at).map(|file| cx.sources.file(file).name.clone());
    let by = by.as_deref().and_then(|by| Path::new(by).file_name()).and_then(|name| name.to_str());
    match from.read_named(path, by) {
        Ok(text) => {
            let file = cx.sources.add_file(from.shown(path), text, language);
            let whole = cx.sources.whole_file(file);
            Some((Reading { file, whole }, language))
        }
        Err(finding) => {
            cx.refuse(finding.at(named_at));
            None
        }
    }
}

pub(super) fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}

/// The map of configurations of a file.
pub(super) fn configuration_tree(
    cx: &mut Cx,
    from: &Sources,
    path: &Path,
    named_at: Origin,
    params: &mut Params,
) -> Option<Node> {
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
pub(super) fn monitor_tree(
    cx: &mut Cx,
    from: &Sources,
    path: &Path,
    named_at: Origin,
    params: &mut Params,
) -> Option<Node> {
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
pub(super) fn only_charts(cx: &mut Cx, reading: Reading, what: &str) -> Option<Node> {
    let finding = Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, format!("{what} are not written in SCXML"));
    cx.refuse(finding.at(reading.whole).help("an SCXML file can be a coordinator"));
    None
}

pub(super) fn nothing(cx: &mut Cx, reading: Reading, what: &str, how: &str) {
    if !crate::model::finding::has_errors(&cx.findings) {
        let finding = Finding::error(codes::TEXT_NOTHING, format!("there is no {what} in this file"));
        cx.report(finding.at(reading.whole).help(format!("write {how}")));
    }
}

/// The value of a file's one top-level key.
pub(super) fn only_key(cx: &mut Cx, node: Node, reading: Reading, file: &'static Object) -> Option<Node> {
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
pub(super) fn unique(cx: &mut Cx, configurations: &mut Vec<Configuration>) {
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

pub(super) fn loads(from: &Sources, path: &Path) -> lua::Loads {
    lua::Loads { from: from.clone(), folder: path.parent().map_or_else(PathBuf::new, Path::to_path_buf) }
}

pub(super) fn coordinator(
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
