//! Which configuration a finding of the text is about: said by the finding's path, `configurations.ID`.
//!
//! What is wrong with one configuration need not keep anybody from working with another. So a finding is given the path
//! of a configuration only where it is sure that nothing else can have suffered from it; one without such a path counts
//! against everything.

use super::tree::{Cx, Entry, Kind, Node};
use crate::diagnostics::{FileId, Language};
use crate::limits;
use crate::model::{Findings, codes, finding};
use std::ops::Range;

/// The path of the configuration of that name.
pub fn path(name: &str) -> String {
    format!("configurations.{name}")
}

/// Everything that was found since there were `since` findings is about the configuration of that name.
pub fn all(cx: &mut Cx, since: usize, name: &str) {
    for finding in cx.findings.iter_mut().skip(since).filter(|f| f.path.is_empty()) {
        finding.path = path(name);
    }
}

/// What was found since then, before configurations had names (while a text was parsed or run), is about the one
/// configuration in whose text it stands, if there is one. `configurations` is the map of them.
pub fn by_place(cx: &mut Cx, since: usize, configurations: &Node) {
    let Kind::Map(entries) = &configurations.kind else { return };
    if cx.findings.len() == since {
        return;
    }
    let texts = texts(cx, entries);
    if shared(cx, entries, &texts) {
        return;
    }
    for i in since..cx.findings.len() {
        let Some(place) = cx.sources.locate(cx.findings[i].origin) else { continue };
        // A name that stands twice is found at the second, which is in nobody's text.
        let starts = |(_, file, text): &&Text| {
            let label = cx.findings[i].labels.first().and_then(|label| cx.sources.locate(label.origin));
            cx.findings[i].code == codes::TEXT_DUPLICATE_KEY
                && label.is_some_and(|first| first.file == *file && first.span.start == text.start)
        };
        if let Some((name, ..)) = texts.iter().find(starts) {
            cx.findings[i].path = path(name);
            continue;
        }
        let mut held = texts.iter().filter(|(_, file, text)| {
            *file == place.file
                && text.start <= place.span.start
                && place.span.end <= text.end
                && !place.span.is_empty()
        });
        // A text that is two configurations at once (a local one with two names) is nobody's alone.
        if let (Some((name, ..)), None) = (held.next(), held.next())
            && cx.findings[i].path.is_empty()
        {
            cx.findings[i].path = path(name);
        }
    }
}

/// A configuration's name and text.
type Text = (String, FileId, Range<usize>);

/// Whether one configuration holds what is written in another's text (YAML's aliases): what is wrong there would be wrong
/// in both.
fn shared(cx: &Cx, entries: &[Entry], texts: &[Text]) -> bool {
    fn reaches_out(cx: &Cx, node: &Node, own: &Text) -> bool {
        let out = cx
            .sources
            .locate(node.origin)
            .is_some_and(|place| place.file != own.1 || place.span.start < own.2.start || place.span.start > own.2.end);
        out || match &node.kind {
            Kind::List(list) => list.iter().any(|node| reaches_out(cx, node, own)),
            Kind::Map(entries) => entries.iter().any(|entry| reaches_out(cx, &entry.value, own)),
            _ => false,
        }
    }
    entries.iter().zip(texts).any(|(entry, own)| {
        let yaml = cx.sources.file(own.1).language == Language::Yaml;
        yaml && reaches_out(cx, &entry.value, own)
    })
}

/// The text of each configuration. In Lua that of its constructor; in YAML from its name to the next one's.
fn texts(cx: &Cx, entries: &[Entry]) -> Vec<Text> {
    let mut texts: Vec<Text> = Vec::with_capacity(entries.len());
    for entry in entries {
        let made = matches!(entry.value.kind, Kind::Made(..));
        let Some((file, text)) = cx.sources.extent(if made { entry.value.origin } else { entry.origin }) else {
            continue;
        };
        if cx.sources.file(file).language == Language::Yaml {
            if let Some((_, _, before)) = texts.last_mut() {
                before.end = text.start;
            }
            texts.push((entry.key.to_string(), file, text.start..cx.sources.file(file).text.len()));
        } else {
            texts.push((entry.key.to_string(), file, text));
        }
    }
    texts
}

/// Whether all that refuses is about configurations, and was found: the others, and everything else, can be relied on.
pub fn only_configurations(findings: &Findings) -> bool {
    findings.len() < limits::FINDINGS
        && findings.iter().filter(|f| f.is_error()).all(|f| finding::configuration(f).is_some())
}
