//! The one rendering of findings, for terminals and as JSON.

use super::source_file::{FileId, Location};
use super::source_map::SourceMap;
use super::wrap;
use crate::model::finding::count;
use crate::model::{Finding, Origin, Severity};
use miette::{
    Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, MietteError, MietteSpanContents, SourceCode,
    SourceSpan, SpanContents,
};
use std::borrow::Cow;
use std::fmt::{self, Write as _};
use std::ops::Range;
use std::sync::Arc;
use textwrap::WordSplitter;

/// How findings are shown.
#[derive(Debug, Clone, Copy)]
pub struct RenderOptions {
    /// With colours; only for a terminal.
    pub color: bool,
    /// Columns of the terminal.
    pub width: usize,
    /// How many findings are shown; the rest is counted.
    pub most: usize,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { color: false, width: 100, most: crate::limits::FINDINGS_SHOWN }
    }
}

/// The findings as text for a terminal, each with its code, its places and its help. Empty without findings.
pub fn render(findings: &[Finding], sources: &SourceMap, color: bool) -> String {
    render_with(findings, sources, RenderOptions { color, ..RenderOptions::default() })
}

/// The same, for a given width.
pub fn render_with(findings: &[Finding], sources: &SourceMap, options: RenderOptions) -> String {
    let theme = if options.color { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_width(options.width.max(30))
        .with_word_separator(wrap::SEPARATOR)
        .with_word_splitter(WordSplitter::NoHyphenation)
        .with_links(false)
        .with_context_lines(1)
        .without_cause_chain();
    let mut out = String::new();
    for finding in findings.iter().take(options.most) {
        let report = FindingReport::new(finding, sources);
        // The handler fails only where a source cannot be read; ours can always.
        if handler.render_report(&mut out, &report).is_err() {
            let _ = writeln!(out, "davit::{}: {}", finding.code, finding.message);
        }
        out.push('\n');
    }
    if findings.len() > options.most {
        let _ = writeln!(out, "… and {}", count(findings.len() - options.most, "more finding"));
    }
    out
}

/// The findings as data: an array of objects with the keys `code`, `severity`, `message`, `file`, `line`, `column`,
/// `help` (`file` … `column` null where there is no place), and `path` and `labels` where there are any.
pub fn to_json(findings: &[Finding], sources: &SourceMap) -> serde_json::Value {
    let place = |location: Option<&Location>| {
        let file = location.map(|l| sources.file(l.file).name.to_string());
        (file, location.map(|l| l.line + sources.file(l.file).skipped), location.map(|l| l.column))
    };
    let one = |finding: &Finding| {
        let (file, line, column) = place(primary(finding, sources).as_ref());
        let mut object = serde_json::json!({
            "code": finding.code.0,
            "severity": finding.severity,
            "message": sources.told(finding.origin, &finding.message),
            "file": file,
            "line": line,
            "column": column,
            "help": sources.told_help(finding),
        });
        if !finding.path.is_empty() {
            object["path"] = finding.path.clone().into();
        }
        let labels: Vec<_> = finding
            .labels
            .iter()
            .filter_map(|label| Some((sources.locate(label.origin)?, label)))
            .map(|(location, label)| {
                let (file, line, column) = place(Some(&location));
                serde_json::json!({ "text": sources.told(label.origin, &label.text), "file": file, "line": line, "column": column })
            })
            .collect();
        if !labels.is_empty() {
            object["labels"] = labels.into();
        }
        object
    };
    findings.iter().map(one).collect()
}

/// The place of a finding: inside the element at fault, the first name that the message quotes, if it stands there.
fn primary(finding: &Finding, sources: &SourceMap) -> Option<Location> {
    let whole = sources.locate(finding.origin)?;
    let mut quoted = finding.message.split('`').skip(1).step_by(2).filter(|word| word.len() > 1);
    Some(quoted.find_map(|word| sources.locate_part(finding.origin, word)).unwrap_or(whole))
}

/// A finding with its texts, as miette wants it.
#[derive(Debug)]
struct FindingReport {
    message: String,
    code: String,
    severity: miette::Severity,
    help: Option<String>,
    source: Option<SourceWindow>,
    labels: Vec<LabeledSpan>,
    related: Vec<Self>,
}

impl FindingReport {
    fn new(finding: &Finding, sources: &SourceMap) -> Self {
        let severity = match finding.severity {
            Severity::Error => miette::Severity::Error,
            Severity::Warning => miette::Severity::Warning,
            Severity::Info => miette::Severity::Advice,
        };
        let mut report = Self {
            message: sources.told(finding.origin, &finding.message).into_owned(),
            code: format!("davit::{}", finding.code),
            severity,
            help: sources.told_help(finding).map(Cow::into_owned),
            source: None,
            labels: Vec::new(),
            related: Vec::new(),
        };
        let mut home = None;
        if let Some(location) = primary(finding, sources) {
            home = Some(location.file);
            report.source = Some(SourceWindow::new(sources, location.file));
            let text = if finding.label.is_empty() { "here" } else { &*sources.told(finding.origin, &finding.label) };
            let span = first_line(sources, &location);
            report.labels.push(LabeledSpan::new_primary_with_span(Some(text.to_owned()), to_miette(&span)));
        } else if !finding.path.is_empty() {
            report.message = format!("{} (in {})", report.message, finding.path);
        }
        for label in &finding.labels {
            report.add_label(label.origin, &sources.told(label.origin, &label.text), home, sources);
        }
        report
    }

    /// A second place: in the same text a label, in another a report below.
    fn add_label(&mut self, origin: Origin, text: &str, home: Option<FileId>, sources: &SourceMap) {
        let Some(location) = sources.locate(origin) else {
            let note = self.help.take().map_or(String::new(), |help| format!("{help}\n"));
            self.help = Some(format!("{note}{text}"));
            return;
        };
        let span = to_miette(&first_line(sources, &location));
        if home == Some(location.file) && self.is_near(&span, &location, sources) {
            self.labels.push(LabeledSpan::new_with_span(Some(text.to_owned()), span));
        } else {
            self.related.push(Self {
                message: text.to_owned(),
                code: String::new(),
                severity: miette::Severity::Advice,
                help: None,
                source: Some(SourceWindow::new(sources, location.file)),
                labels: vec![LabeledSpan::new_primary_with_span(Some("here".to_owned()), span)],
                related: Vec::new(),
            });
        }
    }

    /// Whether a second place can be shown in one picture with the first: all between places on neighbouring lines is
    /// shown, however long these lines are.
    fn is_near(&self, span: &SourceSpan, location: &Location, sources: &SourceMap) -> bool {
        let Some(first) = self.labels.first().map(|label| label.offset()) else { return true };
        let line = sources.file(location.file).line(location.line);
        line.len() < LONG_LINE || first.abs_diff(span.offset()) < LONG_LINE
    }
}

fn to_miette(span: &Range<usize>) -> SourceSpan {
    (span.start, span.end - span.start).into()
}

/// The part of a place that stands on its first line: a call of twenty lines is shown by its beginning.
fn first_line(sources: &SourceMap, location: &Location) -> Range<usize> {
    let file = sources.file(location.file);
    let most = (location.span.start + LINE_MARGIN).min(file.text.len());
    let most = (0..=most).rev().find(|i| file.text.is_char_boundary(*i)).unwrap_or(0);
    location.span.start..location.span.end.min(file.line(location.line).end).min(most).max(location.span.start)
}

impl fmt::Display for FindingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for FindingReport {}

impl Diagnostic for FindingReport {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        (!self.code.is_empty()).then(|| Box::new(&self.code) as Box<dyn fmt::Display>)
    }
    fn severity(&self) -> Option<miette::Severity> {
        Some(self.severity)
    }
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }
    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source as &dyn SourceCode)
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        (!self.labels.is_empty())
            .then(|| Box::new(self.labels.iter().cloned()) as Box<dyn Iterator<Item = LabeledSpan>>)
    }
    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        (!self.related.is_empty())
            .then(|| Box::new(self.related.iter().map(|r| r as &dyn Diagnostic)) as Box<dyn Iterator<Item = _>>)
    }
}

/// A text of which only the lines around a place are shown. Finds lines by bisection, so that a thousand findings in
/// a large file do not read it a thousand times, and cuts lines that no terminal could show.
struct SourceWindow {
    name: Arc<str>,
    text: Arc<str>,
    line_starts: Vec<usize>,
    skipped: usize,
}

impl fmt::Debug for SourceWindow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

/// Bytes shown on either side of a place in an overlong line, and of a place that is itself longer.
const LINE_MARGIN: usize = 120;

/// Bytes from which a line is too long to be shown whole.
const LONG_LINE: usize = 2_000;

impl SourceWindow {
    fn new(sources: &SourceMap, file: FileId) -> Self {
        let source = sources.file(file);
        Self {
            name: source.name.clone(),
            text: source.text.clone(),
            line_starts: source.line_starts().collect(),
            skipped: source.skipped as usize,
        }
    }

    fn cut(&self, offset: usize) -> usize {
        (0..=offset.min(self.text.len())).rev().find(|i| self.text.is_char_boundary(*i)).unwrap_or(0)
    }
}

impl SourceCode for SourceWindow {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let line_of = |offset: usize| self.line_starts.partition_point(|s| *s <= offset).saturating_sub(1);
        let end_of = |line: usize| self.line_starts.get(line + 1).map_or(self.text.len(), |next| next - 1);
        let from = span.offset().min(self.text.len());
        let to = (span.offset() + span.len()).min(self.text.len());
        let first = line_of(from).saturating_sub(before);
        let last = (line_of(to) + after).min(self.line_starts.len() - 1);
        let mut range = self.line_starts[first]..end_of(last).max(self.line_starts[first]);
        let mut line = first;
        if range.len() > (last - first + 1) * LINE_MARGIN * 3 {
            line = line_of(from);
            range = self.cut(from.saturating_sub(LINE_MARGIN).max(self.line_starts[line]))
                ..self.cut((to + LINE_MARGIN).min(end_of(line_of(to))));
        }
        let column = self.text[self.line_starts[line]..from.max(self.line_starts[line])].chars().count();
        let window = SourceSpan::from((range.start, range.len()));
        let lines = last - line + 1;
        let bytes = &self.text.as_bytes()[range];
        Ok(Box::new(MietteSpanContents::new_named(
            self.name.to_string(),
            bytes,
            window,
            line + self.skipped,
            column,
            lines,
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::super::source_file::Language;
    use super::*;
    use crate::model::finding::Code;

    const CODE: Code = Code("text::wrong_type");

    fn sources() -> (SourceMap, Origin, Origin, Origin) {
        let mut map = SourceMap::new();
        let lua = map.add_file("c.lua", "Configuration {\n  property_set(\"A.k\", x),\n}\n", Language::Lua);
        let yaml = map.add_file("d.yaml", "name: é\nother: 2\n", Language::Yaml);
        let (call, name, other) =
            (map.call(lua, 2, 0, "property_set"), map.exact(yaml, 1, 6, 1), map.exact(yaml, 2, 0, 5));
        (map, call, name, other)
    }

    #[test]
    fn a_report_says_code_places_and_help() {
        let (map, call, name, other) = sources();
        let finding = Finding::error(CODE, "no property `A.k`").at(call).also(name, "first seen here").help("write it");
        let text = render(&[finding, Finding::warning(CODE, "two").at(name).also(other, "the other")], &map, false);
        for part in ["davit::text::wrong_type", "c.lua:2:16", "first seen here", "d.yaml:1:7", "write it", "the other"]
        {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
        assert!(!text.contains('\u{1b}'));
        assert!(render(&[Finding::error(CODE, "x").at(call)], &map, true).contains('\u{1b}'));
    }

    #[test]
    fn narrow_terminals_and_no_place() {
        let (map, call, ..) = sources();
        let finding = Finding::error(CODE, "a long message ".repeat(10)).at(call).help("a long help ".repeat(10));
        let narrow = RenderOptions { width: 40, ..RenderOptions::default() };
        let text = render_with(&[finding, Finding::error(CODE, "nowhere")], &map, narrow);
        assert!(text.lines().all(|line| line.chars().count() <= 48), "{text}");
        assert!(text.contains("nowhere"));
    }

    #[test]
    fn long_lines_are_cut() {
        let mut map = SourceMap::new();
        let file = map.add_file("x.yaml", format!("a: [{}]", "é, ".repeat(100_000)), Language::Yaml);
        let at = map.exact(file, 1, 60_000, 1);
        let text = render(&[Finding::error(CODE, "x").at(at)], &map, false);
        assert!(text.len() < 5_000, "{}", text.len());
    }

    #[test]
    fn long_places_and_places_far_apart_are_cut() {
        let mut map = SourceMap::new();
        let file = map.add_file("x.yaml", format!("a: \"{}\", a: 1", "é".repeat(100_000)), Language::Yaml);
        let (long, far) = (map.exact(file, 1, 3, 100_002), map.exact(file, 1, 100_007, 1));
        let text = render(&[Finding::error(CODE, "x").at(long).also(far, "and here")], &map, false);
        assert!(text.len() < 5_000, "{}", text.len());
        assert!(text.contains("and here"), "{text}");
    }

    #[test]
    fn json_has_the_stated_keys() {
        let (map, call, ..) = sources();
        let json = to_json(&[Finding::error(CODE, "no `A.k`").at(call), Finding::info(CODE, "nowhere")], &map);
        assert_eq!(json[0]["code"], "text::wrong_type");
        assert_eq!((&json[0]["line"], &json[0]["column"]), (&2.into(), &16.into()));
        assert_eq!(json[0]["file"], "c.lua");
        assert_eq!(json[1]["file"], serde_json::Value::Null);
        assert_eq!(json[1]["severity"], "info");
    }
}
