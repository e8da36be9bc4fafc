//! Coordinators that are trusted to have functions: their text is run with the whole of Lua's string library, and with
//! rFSM's names of today and of old.
//!
//! A file is read as a pure one first: where that succeeds it is one, with the stricter reading that catches typing
//! errors (unless functions of its root feed it or listen: `getevents`, `idle_hook`, `dbg`). Only where it does not is it
//! run as a trusted one.

use super::files::Sources;
use super::grammar::primitive;
use super::lower::chart;
use super::lua;
use super::params::Params;
use super::print;
use super::slips;
use super::tree::{Cx, Entry, Kind, Node, Reading};
use super::words;
use crate::diagnostics::{FileId, Language};
use crate::functions::{self, Field, NotOpened, Short, Spot};
use crate::limits;
use crate::model::finding::{count, nearest};
use crate::model::program::{Openings, Program};
use crate::model::{Code, Finding, Findings, Origin, Statechart, codes};
use crate::statechart::{FunctionOutput, Printer};
use rustc_hash::FxHashMap;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

/// What a file is trusted with.
#[derive(Debug, Clone, Default)]
pub struct Trust {
    /// What is open to it.
    pub open: Openings,
    /// Files that stand in for its host, and where they are named.
    pub host: Vec<(PathBuf, Origin)>,
    /// Each field of its own is told: it will be left out.
    pub tell_fields: bool,
}

/// A coordinator with the program that has its functions, if it has any.
pub type Trusted = (Statechart, Option<Arc<Program>>);

/// Findings of the strict reading that a trusted one may make go away.
const MAY_GO: &[Code] = &[
    codes::CHART_FUNCTION,
    codes::LUA_CLOSED,
    codes::LUA_UNDEFINED,
    codes::LUA_ERROR,
    codes::LUA_BAD_RETURN,
    codes::TEXT_DUPLICATE_KEY,
    codes::TEXT_UNKNOWN_KEY,
    codes::TEXT_WRONG_TYPE,
    codes::TEXT_BAD_NAME,
    codes::TEXT_BAD_VALUE,
];

/// Reads a trusted Lua file: as a pure one where it is.
pub fn read(
    cx: &mut Cx,
    from: &Sources,
    path: &Path,
    reading: Reading,
    params: &mut Params,
    trust: &Trust,
    stem: &str,
) -> Option<Trusted> {
    let before = cx.findings.len();
    let loads = lua::Loads { from: from.clone(), folder: folder(path) };
    let strict = lua::read(cx, reading, params, stem, Some(loads)).and_then(|made| made.chart);
    let asks_its_host = strict.as_ref().is_some_and(asks_its_host);
    let strict = strict.and_then(|node| chart::statechart(cx, node));
    let strict_findings: Findings = cx.findings.split_off(before);
    let errors = || strict_findings.iter().filter(|f| f.severity == crate::model::Severity::Error);
    if errors().next().is_none() && strict.is_some() && trust.host.is_empty() && !asks_its_host {
        cx.findings.extend(strict_findings);
        return strict.map(|chart| (chart, None));
    }
    if cx.unreadable || !errors().all(|f| MAY_GO.contains(&f.code)) {
        // It is trusted: what is only wrong in a pure one is not what is wrong.
        let (pure_only, others): (Findings, Findings) =
            strict_findings.into_iter().partition(|f| MAY_GO.contains(&f.code));
        let told = others.iter().any(Finding::is_error);
        cx.findings.extend(if told { others } else { pure_only });
        return None;
    }
    open(cx, from, path, reading, params, trust)
}

/// Whether a chart has functions that say what happens to it or hear of it, though none of its own. The other printers tell
/// only of what functions do, so a chart with them stays pure.
fn asks_its_host(root: &Node) -> bool {
    let Kind::Made(_, fields, _) = &root.kind else { return false };
    let says = |entry: &Entry| {
        matches!(&*entry.key, "getevents" | "idle_hook" | "dbg") && matches!(entry.value.kind, Kind::Function)
    };
    fields.iter().any(says)
}

fn folder(path: &Path) -> PathBuf {
    path.parent().map_or_else(PathBuf::new, Path::to_path_buf)
}

fn open(
    cx: &mut Cx,
    from: &Sources,
    path: &Path,
    reading: Reading,
    params: &mut Params,
    trust: &Trust,
) -> Option<Trusted> {
    let file = path.display().to_string();
    let text: Arc<str> = cx.sources.file(reading.file).text.clone();
    let mut ids: FxHashMap<String, FileId> = FxHashMap::default();
    ids.insert(file.clone(), reading.file);
    let mut host = Vec::new();
    for (path, named_at) in &trust.host {
        match from.read(path) {
            Ok(text) => {
                let name = path.display().to_string();
                let id = cx.sources.add_file(from.shown(path), text.clone(), Language::Lua);
                ids.insert(name.clone(), id);
                host.push((name, text.into()));
            }
            Err(finding) => cx.refuse(finding.at(*named_at)),
        }
    }
    if cx.unreadable {
        return None;
    }
    let mut with = Vec::new();
    for param in &params.all {
        with.push((param.name.clone(), json(&param.value)));
    }
    let mut program = Program { file, text, host, files: BTreeMap::new(), with, open: trust.open, beside: Vec::new() };
    // Files that the model loads are found out by running it.
    let loaded: Rc<RefCell<BTreeMap<String, (String, Arc<str>)>>> = Rc::default();
    let reader = {
        let (loaded, from, folder) = (loaded.clone(), from.clone(), folder(path));
        Box::new(move |name: &str| {
            let path = folder.join(name);
            let text = from.read(&path).map_err(|finding| finding.message)?;
            let shown = path.display().to_string();
            loaded.borrow_mut().insert(name.to_owned(), (shown.clone(), text.as_str().into()));
            Ok((shown, text))
        })
    };
    // Places are kept apart until the run is over: the source map is not lent to Lua.
    let mut spots: Vec<(Option<Spot>, String)> = Vec::new();
    let outcome = functions::read(&program, reader, &mut |spot, word| {
        spots.push((spot.cloned(), word.to_owned()));
        Origin(u32::try_from(spots.len()).unwrap_or(0))
    });
    program.files = std::mem::take(&mut *loaded.borrow_mut());
    for (shown, text) in program.files.values() {
        let id = cx.sources.add_file(from.shown(Path::new(shown)), text.clone(), Language::Lua);
        ids.insert(shown.clone(), id);
    }
    for param in &mut params.all {
        param.used |= print::program_texts(&program).any(|text| mentions(text, &param.name));
    }
    let reads = match outcome {
        Ok(reads) => reads,
        Err(failure) => {
            refuse(cx, &ids, reading, &failure, trust.open);
            return None;
        }
    };
    let mut origins: Vec<Origin> = vec![Origin::NONE];
    let mut calls: FxHashMap<(String, u32, u32), Origin> = FxHashMap::default();
    for (spot, word) in spots {
        let base = spot.and_then(|spot| {
            let id = *ids.get(&spot.file)?;
            let key = (spot.file.clone(), spot.line, spot.nth);
            Some(*calls.entry(key).or_insert_with(|| cx.sources.exact_line(id, spot.line)))
        });
        let base = base.unwrap_or(reading.whole);
        origins.push(if word.is_empty() { base } else { cx.sources.within(base, &word) });
    }
    let at = |origin: Origin| origins.get(origin.0 as usize).copied().unwrap_or(reading.whole);
    if let Some(finding) = printed(&program.file, &reads.said) {
        cx.report(finding);
    }
    let broken = !reads.problems.is_empty();
    for problem in reads.problems {
        cx.report(Finding::error(problem.code, problem.message).at(at(problem.origin)).help(problem.help));
    }
    if broken {
        return None;
    }
    for field in &reads.fields {
        let place = at(field.origin);
        let left_out = trust.tell_fields.then(|| {
            let Field { of, key, .. } = field;
            let message = format!("`{key}` is a field of your own in {of}: it is left out");
            let finding = Finding::warning(codes::CONVERT_LEFT_OUT, message).at(place);
            finding.help("a pure coordinator has no fields of one's own: keep it in a comment or in `doc`")
        });
        slips::field(field, place).or(left_out).into_iter().for_each(|finding| cx.report(finding));
    }
    let mut files: Vec<FileId> = ids.values().copied().collect();
    files.sort_unstable_by_key(|id| id.0);
    for id in files {
        let text: Arc<str> = cx.sources.file(id).text.clone();
        let found = slips::twice(cx, id, &text);
        found.into_iter().for_each(|finding| cx.report(finding));
    }
    let mut looked_through = 0;
    for (name, spot) in &reads.unset {
        let Some(id) = ids.get(&spot.file).copied() else { continue };
        let text: Arc<str> = cx.sources.file(id).text.clone();
        looked_through += text.len();
        if looked_through > limits::SLIP_BYTES {
            break;
        }
        let line = cx.sources.exact_line(id, spot.line);
        let finding = slips::unset(cx, line, &text, spot.line, name);
        finding.into_iter().for_each(|finding| cx.report(finding));
    }
    program.beside = reads.beside;
    program.beside.iter_mut().for_each(|beside| beside.origin = at(beside.origin));
    let mut chart = reads.chart;
    chart.root.places(&mut |origin| *origin = at(*origin));
    Some((chart, reads.runs_lua.then(|| Arc::new(program))))
}

/// Whether a text has a word in it.
pub fn mentions(text: &str, word: &str) -> bool {
    let part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        !text[..at].chars().next_back().is_some_and(part) && !text[at + word.len()..].chars().next().is_some_and(part)
    })
}

/// Lines of what a file prints while it is loaded that are shown; the others are counted.
const PRINTS_SHOWN: usize = 5;

/// One remark about all that a file prints while it is loaded. Without a place: nobody knows the lines.
fn printed(file: &str, said: &[FunctionOutput]) -> Option<Finding> {
    let lines: Vec<&str> = said.iter().filter(|said| said.by != Printer::Dbg).map(|said| said.text.as_str()).collect();
    let mut message = format!("`{file}` prints while it is loaded: ");
    let shown: Vec<String> = lines.iter().take(PRINTS_SHOWN).map(|line| line.chars().take(200).collect()).collect();
    message.push_str(&shown.join("; "));
    match lines.len().checked_sub(PRINTS_SHOWN) {
        None | Some(0) => {}
        Some(more) => message.push_str(&format!("; and {}", count(more, "more line"))),
    }
    (!lines.is_empty()).then(|| Finding::info(codes::LUA_PRINT, message))
}

fn json(node: &Node) -> serde_json::Value {
    use serde_json::Value as Json;
    match &node.kind {
        Kind::Bool(v) => Json::Bool(*v),
        Kind::Int(v) => Json::from(*v),
        Kind::Float(v) => Json::from(*v),
        Kind::Str(text) => Json::from(&**text),
        Kind::List(list) => Json::Array(list.iter().map(json).collect()),
        Kind::Map(entries) => {
            Json::Object(entries.iter().map(|entry| (entry.key.to_string(), json(&entry.value))).collect())
        }
        _ => Json::Null,
    }
}

/// Whether a name is what files of configurations and of monitors are made of, and no coordinator.
fn is_of_another_file(name: &str) -> bool {
    let whole = ["ConfiguratorConf", "Configuration", "Monitors", "monitor"];
    whole.contains(&name) || primitive(name).is_some() || words::find(name).is_some()
}

/// The finding of a program that gives no chart.
fn refuse(cx: &mut Cx, ids: &FxHashMap<String, FileId>, reading: Reading, failure: &NotOpened, open: Openings) {
    let id = ids.get(&failure.file).copied().unwrap_or(reading.file);
    let at = match failure.line {
        Some(line) => cx.sources.exact_line(id, line),
        None => cx.sources.whole_file(id),
    };
    if failure.syntax {
        let finding = lua::not_lua(&mut cx.sources, id, failure.line, &failure.message);
        cx.refuse(finding);
        return;
    }
    if let Some(name) = &failure.missing {
        let place = cx.sources.within(at, name);
        let other = match name.as_str() {
            // What every script begins with.
            "deploy" => Some(("scripts", "`davit run` runs a script")),
            name if is_of_another_file(name) => {
                let help = "give the deployment's file (`deployments/NAME.yaml`); this one can be named in it";
                Some(("configurations or monitors", help))
            }
            _ => None,
        };
        if let Some((of, help)) = other {
            let message = format!("`{name}` is of {of}, and this is read as a coordinator");
            cx.report(Finding::error(codes::TEXT_NOTHING, message).at(place).labelled("used here").help(help));
            return;
        }
        let closed = Openings::NAMES.contains(&name.as_str());
        let finding = if closed && !(name == "io" && open.io) {
            Finding::error(codes::LUA_CLOSED, format!("`{name}` is not open to this model")).at(place).help(format!(
                "give what it needs as a parameter (`with:`), or open it in the deployment: `trusted: {{ open: [{name}] }}`"
            ))
        } else {
            let known =
                ["rfsm", "rfsm_timeevent", "rfsm_emem", "rfsm_ext", "rfsmpp", "utils", "string", "table", "math"];
            let near = nearest(name, known).map(|near| format!("did you mean `{near}`? if not: ")).unwrap_or_default();
            Finding::error(codes::LUA_HOST_MISSING, format!("the model expects `{name}` from its host")).at(place).help(
                format!(
                    "{near}define it in a Lua file of yours and name that: `host: [file.lua]` in the deployment, or \
                     `--host file.lua`"
                ),
            )
        };
        cx.report(finding.labelled("used here"));
        return;
    }
    let code = match failure.short {
        Some(Short::Instructions) => codes::LUA_INSTRUCTIONS,
        Some(Short::Memory) => codes::LUA_MEMORY,
        None => codes::LUA_ERROR,
    };
    let finding = Finding::error(code, format!("the file fails: {}", failure.message)).at(at);
    cx.report(finding.help("the message is Lua's own; the file must run to its end once and return a state"));
}
