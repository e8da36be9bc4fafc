//! Parameters of Lua files: `with:` in the deployment, overridden by `--set a.b=1` on the command line.

use super::tree::{Cx, Entry, Kind, Node};
use super::yaml;
use crate::diagnostics::Language;
use crate::lang::tree::Reading;
use crate::model::finding::{did_you_mean, nearest};
use crate::model::{Finding, Ident, Origin, Severity, ValueType, codes};

/// A parameter.
#[derive(Debug)]
pub struct Param {
    /// The name Lua files read it by.
    pub name: String,
    /// Its value.
    pub value: Node,
    /// Whether some file has read it.
    pub used: bool,
    /// Whether the command line named it.
    set: bool,
    origin: Origin,
}

/// Whose parameters `--set` gives, where it is a deployment that is read.
#[derive(Debug, Clone, Default)]
pub struct SetPlace {
    /// What stands before their names: `left.` for those of a subsystem.
    pub within: String,
    /// The subsystems whose parameters are given the same way.
    pub subsystems: Vec<Ident>,
}

/// All parameters of one load.
#[derive(Debug, Default)]
pub struct Params {
    /// Each once.
    pub all: Vec<Param>,
    place: SetPlace,
}

impl Params {
    /// Takes the values of `with:`, then those of `--set`.
    pub fn new(cx: &mut Cx, with: Vec<Entry>, set: &[(String, String)]) -> Self {
        Self::of(cx, SetPlace::default(), with, set)
    }

    /// The same of a deployment's file.
    pub fn of(cx: &mut Cx, place: SetPlace, with: Vec<Entry>, set: &[(String, String)]) -> Self {
        let mut out = Self { place, ..Self::default() };
        for entry in with {
            if let Err(error) = Ident::new(&entry.key) {
                let finding =
                    Finding::error(codes::TEXT_BAD_NAME, format!("`{}` is not a parameter's name", entry.key));
                cx.report(finding.at(entry.origin).labelled(error.reason).help("write it like `gain: 0.5`"));
                continue;
            }
            if let Some(empty) = empty(&entry.value) {
                let finding =
                    Finding::error(codes::TEXT_BAD_PARAMETER, format!("the parameter `{}` has no value", entry.key));
                let help = "write one, or leave the parameter out: in Lua an empty one is `nil`, and whatever takes it is gone";
                cx.report(finding.at(empty).labelled("nothing stands here").help(help));
            }
            let (name, value, origin) = (entry.key.into_owned(), entry.value, entry.origin);
            out.all.push(Param { name, value, used: false, set: false, origin });
        }
        for (path, text) in set {
            out.set(cx, path, text);
        }
        out
    }

    fn set(&mut self, cx: &mut Cx, path: &str, text: &str) {
        let within = self.place.within.clone();
        let bad = |why: &str| bad(&format!("{within}{path}"), text, why);
        let parts: Vec<&str> = path.split('.').collect();
        if let Some(error) = parts.iter().find_map(|part| Ident::new(part).err()) {
            let refused = bad(&error.to_string());
            cx.refuse(match path.contains('/') {
                true => refused
                    .help(format!("a parameter of a subsystem is given as `--set {within}{}`", path.replace('/', "."))),
                false => refused,
            });
            return;
        }
        let Some((value, whole)) = value_of(cx, &within, path, text) else { return };
        let at = self.all.iter().position(|p| p.name == parts[0]);
        let index = at.unwrap_or_else(|| {
            let value = Node::new(Kind::Map(Vec::new()), whole);
            self.all.push(Param { name: parts[0].to_owned(), value, used: false, set: true, origin: whole });
            self.all.len() - 1
        });
        let mut node = &mut self.all[index].value;
        for part in &parts[1..] {
            let Kind::Map(entries) = &mut node.kind else {
                cx.report(bad(&format!("`{within}{path}` names a key inside a value that is no table")).at(whole));
                return;
            };
            let i = entries.iter().position(|e| e.key == *part).unwrap_or_else(|| {
                let value = Node::new(Kind::Map(Vec::new()), whole);
                entries.push(Entry { key: (*part).to_owned().into(), origin: whole, value });
                entries.len() - 1
            });
            node = &mut entries[i].value;
        }
        *node = value;
    }

    /// Reports parameters that no file has read: they are most likely misspelt.
    pub fn finish(self, cx: &mut Cx) {
        // What does not parse was not run, and may have read it.
        if cx.findings.iter().any(|finding| finding.code == codes::TEXT_SYNTAX) {
            return;
        }
        // Nor was all of it read of what has failed: that a declared one is not read means nothing then.
        let failed = cx.findings.iter().any(|finding| finding.severity == Severity::Error);
        let others: Vec<String> = self.all.iter().filter(|p| !p.set || p.used).map(|p| p.name.clone()).collect();
        for param in self.all.iter().filter(|p| !p.used && (p.set || !failed)) {
            let within = if param.set { self.place.within.as_str() } else { "" };
            let message = format!("no Lua file reads the parameter `{within}{}`", param.name);
            // As the command line names them: `--set left.gain=1`.
            let others: Vec<String> =
                others.iter().filter(|n| **n != param.name).map(|name| format!("{within}{name}")).collect();
            let mut known: Vec<&str> = others.iter().map(String::as_str).collect();
            // `--set left.gain=1` is of a subsystem; another name before the point may be meant for one.
            let dotted = param.set && matches!(param.value.kind, Kind::Map(_));
            let subsystems: Vec<&str> =
                self.place.subsystems.iter().filter(|_| dotted).map(|name| name.as_str()).collect();
            let help = match nearest(&param.name, subsystems.iter().copied()) {
                Some(near) => format!("did you mean the subsystem `{near}`?"),
                // In a file of YAML nothing is read.
                None if known.is_empty() && subsystems.is_empty() => format!(
                    "files in Lua read it as the global `{}`, files in YAML read none: leave it out, or write in Lua what depends on it",
                    param.name
                ),
                None => {
                    let what = if subsystems.is_empty() { "parameters" } else { "parameters and subsystems" };
                    known.extend(subsystems);
                    did_you_mean(&format!("{within}{}", param.name), what, known)
                }
            };
            let finding = if param.set {
                Finding::error(codes::TEXT_UNKNOWN_PARAMETER, message)
            } else {
                Finding::warning(codes::TEXT_UNKNOWN_PARAMETER, message)
            };
            cx.report(finding.at(param.origin).help(help));
        }
    }
}

fn bad(path: &str, text: &str, why: &str) -> Finding {
    Finding::error(codes::TEXT_BAD_PARAMETER, format!("`--set {path}={text}`: {why}"))
        .help("write `--set name=value` or `--set table.key=value`; the value is read as YAML")
}

/// The value that the command line gives for a parameter that is declared: where that is a text, a number is one.
pub fn value_for(cx: &mut Cx, within: &str, (path, text): (&str, &str), ty: &ValueType) -> Option<(Node, Origin)> {
    let (mut value, whole) = value_of(cx, within, path, text)?;
    if *ty == ValueType::Str && matches!(value.kind, Kind::Bool(_) | Kind::Int(_) | Kind::Float(_)) {
        value.kind = Kind::Str(text.trim().to_owned().into());
    }
    Some((value, whole))
}

/// The value that the command line gives, and where that stands. `within` stands before the name there.
pub fn value_of(cx: &mut Cx, within: &str, path: &str, text: &str) -> Option<(Node, Origin)> {
    let file = cx.sources.add_file(format!("--set {within}{path}"), text, Language::Yaml);
    let whole = cx.sources.whole_file(file);
    let value = yaml::read(cx, Reading { file, whole })?;
    if empty(&value).is_some() {
        cx.refuse(bad(&format!("{within}{path}"), text, "it has no value"));
        return None;
    }
    Some((value, whole))
}

/// Where a value has nothing in it.
fn empty(value: &Node) -> Option<Origin> {
    match &value.kind {
        Kind::Null => Some(value.origin),
        Kind::List(elements) => elements.iter().find_map(empty),
        Kind::Map(entries) => entries.iter().find_map(|entry| empty(&entry.value)),
        _ => None,
    }
}
