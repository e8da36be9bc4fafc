//! One file in the other language.

use super::files::Sources;
use super::left_out;
use super::load::{self, Content};
use super::print;
use super::texts::LoadOptions;
use crate::diagnostics::{Language, SourceMap};
use crate::model::{Finding, Findings, Statechart, codes};
use std::path::Path;

/// What converting gave.
#[derive(Debug)]
pub struct Converted {
    /// The text in the language asked for; none when the file is refused.
    pub text: Option<String>,
    /// The coordinator that it is, if it is one.
    pub coordinator: Option<Statechart>,
    /// What was found.
    pub findings: Findings,
    /// The text that was read.
    pub sources: SourceMap,
    /// Whether the text could not be read or parsed at all.
    pub unreadable: bool,
}

/// A file of configurations, of monitors, or a coordinator's file, in the language given. The model is the same; comments, loops,
/// parameters and the layout of the text are not part of it. A
/// coordinator with functions is written in SCXML only, where they are left out, each with a warning.
pub fn convert(from: &Sources, path: &Path, to: Language, options: &LoadOptions) -> Converted {
    let (content, mut findings, sources, unreadable) = load::load_any(from, path, options);
    let mut coordinator = None;
    let text = match content {
        _ if crate::model::finding::has_errors(&findings) => None,
        Some(Content::Configurations(_) | Content::Monitors(_)) if to == Language::Scxml => {
            let finding = Finding::error(codes::TEXT_UNKNOWN_LANGUAGE, "SCXML has words for coordinators only");
            findings.push(finding.help("write them in Lua or YAML"));
            None
        }
        Some(Content::Configurations(list)) => Some(print::configurations(&list, to)),
        Some(Content::Monitors(list)) => Some(print::monitors(&list, to)),
        Some(Content::Coordinator(chart, program)) => {
            let refused = match (&program, to) {
                (Some(program), Language::Lua | Language::Yaml) => left_out::refused(&chart, program),
                _ => None,
            };
            if to == Language::Scxml {
                findings.extend(left_out::warnings(&chart, program.as_deref()));
            }
            let text = refused.is_none().then(|| print::coordinator(&chart, to));
            findings.extend(refused);
            coordinator = Some(chart);
            text
        }
        None => None,
    };
    Converted { text, coordinator, findings, sources, unreadable }
}
