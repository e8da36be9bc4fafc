//! A deployment's file with all that it names, and with its subsystems.

use super::compose;
use super::files::Sources;
use super::lower::deployment as deployment_file;
use super::lower::interface::{self, SubsystemDraft};
use super::lower::{beside, configuration, monitor};
use super::params::{self, Params, SetPlace};
use super::texts::{LoadOptions, configuration_tree, coordinator, host_files, monitor_tree, open, stem, unique};
use super::tree::{Cx, Entry, Kind, Node};
use super::trusted::Trust;
use super::yaml;
use crate::diagnostics::Language;
use crate::limits;
use crate::model::{Deployment, Finding, Origin, Subsystem, codes};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// What a file is given that is read as a part of another one.
struct GivenPart {
    /// Whose it is, for messages: `` `left` ``.
    of: String,
    /// What stands before the names of its parameters on the command line: `left.`.
    within: String,
    given: Vec<Entry>,
    /// Which of that is given on, and where.
    given_on: Vec<(String, Origin)>,
    at: Origin,
}

/// Files that are being read, one as a part of the other.
struct DeploymentReader<'a> {
    from: &'a Sources,
    options: &'a LoadOptions,
    /// From the outside in, with the places that name them.
    open: Vec<(PathBuf, Origin)>,
    /// Instances so far.
    instances: usize,
    /// Coordinators of all files so far.
    coordinators: usize,
    /// What the same file, given the same, came to.
    known: FxHashMap<(PathBuf, String), Option<Arc<Deployment>>>,
}

/// A deployment's file with all that it names.
pub fn deployment(cx: &mut Cx, from: &Sources, path: &Path, options: &LoadOptions) -> Option<Deployment> {
    let known = FxHashMap::default();
    let mut reader = DeploymentReader {
        from,
        options,
        open: vec![(path.to_path_buf(), Origin::NONE)],
        instances: 0,
        coordinators: 0,
        known,
    };
    let part = GivenPart {
        of: "the command line".to_owned(),
        within: String::new(),
        given: Vec::new(),
        given_on: Vec::new(),
        at: Origin::NONE,
    };
    reader.deployment(cx, path, part, &options.set)
}

impl DeploymentReader<'_> {
    fn deployment(
        &mut self,
        cx: &mut Cx,
        path: &Path,
        part: GivenPart,
        set: &[(String, String)],
    ) -> Option<Deployment> {
        let (from, options) = (self.from, self.options);
        let (reading, language) = open(cx, from, path, part.at)?;
        if language != Language::Yaml {
            let finding =
                Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, "a deployment is written in YAML").at(reading.whole);
            // What deploys something is a script.
            let deploys =
                cx.sources.file(reading.file).text.lines().any(|line| line.trim_start().starts_with("deploy("));
            cx.refuse(finding.help(match deploys {
                true => format!("this is a script: `davit run {}` runs it", path.display()),
                false => "give the deployment's file (`deployments/NAME.yaml`); this one can be named in it".to_owned(),
            }));
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
        let mut draft = deployment_file::draft(cx, node, &stem(path))?;
        let folder = path.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let inner = |path: &str| {
            let first = path.split_once('.').map(|(first, _)| first);
            draft.subsystems.iter().any(|subsystem| first == Some(subsystem.name.as_str()))
        };
        let declared = &draft.deployment.interface.parameters;
        let (mut given, mut given_on, mut others) = (part.given, part.given_on, Vec::new());
        for (path, text) in set.iter().filter(|(path, _)| !inner(path)) {
            let Some((_, parameter)) = declared.iter().find(|(name, _)| name.as_str() == path) else {
                others.push((path.clone(), text.clone()));
                continue;
            };
            if let Some((value, origin)) = params::value_for(cx, &part.within, (path, text), &parameter.ty) {
                given.retain(|entry| entry.key != path.as_str());
                given_on.retain(|(name, _)| name != path.as_str());
                given.push(Entry { key: path.clone().into(), origin, value });
            }
        }
        let mut with = draft.with;
        let at = if part.at.is_some() { part.at } else { origin };
        let own = interface::given(cx, (declared, &draft.ill), (given, &given_on), (&part.of, &part.within), at);
        let handed = interface::hand_down(cx, &mut draft.subsystems, &own);
        let subsystems = self.subsystems(cx, &folder, draft.subsystems, (&part.within, set))?;
        for entry in own {
            if let Some(twice) = with.iter().find(|other| other.key == entry.key) {
                let message = format!("`{}` is a parameter, and given under `with` too", entry.key);
                let finding = Finding::error(codes::TEXT_DUPLICATE_KEY, message).at(twice.origin);
                cx.report(finding.also(entry.origin, "the parameter").help("leave one of them out"));
                continue;
            }
            with.push(entry);
        }
        let names = subsystems.iter().map(|subsystem| subsystem.name).collect();
        let mut params = Params::of(cx, SetPlace { within: part.within, subsystems: names }, with, &others);
        params.all.iter_mut().for_each(|param| param.used |= handed.contains(&param.name));
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
        self.coordinators += draft.coordinators.len();
        if let (true, Some((.., named_at))) = (self.coordinators > limits::COORDINATORS, draft.coordinators.last()) {
            let message = format!("there are more than {} coordinators in all", limits::COORDINATORS);
            let finding = Finding::error(codes::TEXT_TOO_LARGE, message).at(*named_at);
            cx.report(finding.help("take the deployment apart"));
            return None;
        }
        let trust = draft.trusted.map(|open| {
            let named = draft.host.iter().map(|(file, origin)| (folder.join(file), *origin));
            Trust { open, host: named.chain(host_files(&options.host)).collect(), tell_fields: false }
        });
        for (name, file, named_at) in &draft.coordinators {
            if let Some((chart, program)) =
                coordinator(cx, from, &folder.join(file), *named_at, &mut params, trust.as_ref())
            {
                programs.extend(program.map(|program| (name.unwrap_or(draft.deployment.name), program)));
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
            let finding =
                Finding::error(codes::TEXT_BAD_VALUE, "`host` is given, and no coordinator is in Lua").at(*at);
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
        if charts.len() < draft.coordinators.len() || charts.is_empty() {
            return None;
        }
        if !draft.is_whole {
            return None;
        }
        let mut own = draft.deployment;
        own.coordinators = beside::join(cx, own.name, charts, &draft.deploy?, &draft.shutdown?);
        (own.configurations, own.programs, own.monitors) = (configurations, programs, monitors);
        (own.subsystems, own.origin) = (subsystems, origin);
        Some(compose::compose(cx, own))
    }

    /// Reads the files of subsystems. None: one of them could not be read.
    fn subsystems(
        &mut self,
        cx: &mut Cx,
        folder: &Path,
        drafts: Vec<SubsystemDraft>,
        (within, set): (&str, &[(String, String)]),
    ) -> Option<Vec<Subsystem>> {
        let wanted = drafts.len();
        let mut read = Vec::new();
        for draft in drafts {
            self.instances += 1;
            let too_many = self.instances > limits::SUBSYSTEMS || self.open.len() > limits::SUBSYSTEM_DEPTH;
            let path = normal(&folder.join(&draft.file));
            if let Some((_, first)) = self.open.iter().find(|(open, _)| normal(open) == path) {
                let message = format!("`{}` is a subsystem of itself", draft.file);
                let finding = Finding::error(codes::COMPOSE_CIRCLE, message).at(draft.named_at);
                // The first file of all is named on the command line.
                let finding = if *first == Origin::NONE { finding } else { finding.also(*first, "named here") };
                cx.report(finding.help("a deployment cannot be a part of itself"));
                continue;
            }
            if too_many {
                let message = format!(
                    "there are more than {} subsystems, or more than {} in each other",
                    limits::SUBSYSTEMS,
                    limits::SUBSYSTEM_DEPTH
                );
                let finding = Finding::error(codes::TEXT_TOO_LARGE, message).at(draft.named_at);
                cx.report(finding.help("take the deployment apart"));
                return None;
            }
            let own: Vec<(String, String)> = set
                .iter()
                .filter_map(|(path, text)| {
                    Some((path.strip_prefix(draft.name.as_str())?.strip_prefix('.')?.to_owned(), text.clone()))
                })
                .collect();
            let key = (path.clone(), format!("{} {own:?}", text_of(&draft.parameters)));
            let known = match self.known.get(&key) {
                Some(known) => known.clone(),
                None => {
                    self.open.push((path.clone(), draft.named_at));
                    let part = GivenPart {
                        of: format!("`{}`", draft.name),
                        within: format!("{within}{}.", draft.name),
                        given: draft.parameters,
                        given_on: draft.given_on,
                        at: draft.named_at,
                    };
                    let deployment = self.deployment(cx, &folder.join(&draft.file), part, &own).map(Arc::new);
                    self.open.pop();
                    self.known.insert(key, deployment.clone());
                    deployment
                }
            };
            let Some(own) = known else { continue };
            let activities = draft.activities.into_iter().map(|(inner, outer, _)| (inner, outer)).collect();
            read.push(Subsystem {
                name: draft.name,
                own,
                activities,
                holds: Default::default(),
                file: draft.file,
                origin: draft.origin,
            });
        }
        (read.len() == wanted).then_some(read)
    }
}

/// What is given, as a text.
fn text_of(given: &[Entry]) -> String {
    fn node(of: &Node) -> String {
        match &of.kind {
            Kind::List(list) => format!("[{}]", list.iter().map(node).collect::<Vec<_>>().join(", ")),
            Kind::Map(entries) => format!("{{ {} }}", text_of(entries)),
            kind => format!("{kind:?}"),
        }
    }
    given.iter().map(|entry| format!("{}: {}", entry.key, node(&entry.value))).collect::<Vec<_>>().join(", ")
}

/// A path without `.` and `..`, as far as that can be told without looking.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir if out.file_name().is_some() => _ = out.pop(),
            Component::CurDir => {}
            part => out.push(part),
        }
    }
    out
}
