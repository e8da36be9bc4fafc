//! YAML → loose tree: events of the parser with their places, under budgets.
//!
//! YAML 1.2: `yes` and `on` are texts, only `true` and `false` are not. One document a file. Aliases are expanded under
//! a budget of nodes; keys stand once; tags other than the core ones are refused.

use super::tree::{Cx, Entry, Kind, Node, Reading, stands_twice};
use crate::limits;
use crate::model::{Finding, Origin, codes};
use rustc_hash::FxHashMap;
use saphyr_parser::{Event, Parser, ScalarStyle, ScanError, Span, Tag};
use std::borrow::Cow;
use std::collections::hash_map;

/// A collection that is being read.
enum Open {
    List(Vec<Node>),
    Map { entries: Vec<Entry>, key: Option<(Cow<'static, str>, Origin)>, seen: FxHashMap<String, Origin> },
}

struct OpenCollection {
    open: Open,
    origin: Origin,
    anchor: usize,
    nodes: usize,
}

/// Maps up to this many keys are searched through, larger ones get an index.
const SMALL_MAP: usize = 8;

/// Stands for a key that was there already, until its value has been read. No YAML text can hold this character.
const AGAIN: Cow<'static, str> = Cow::Borrowed("\0");

struct YamlReader<'a> {
    cx: &'a mut Cx,
    reading: Reading,
    stack: Vec<OpenCollection>,
    /// Trees with an anchor, with their number of nodes.
    anchors: FxHashMap<usize, (Node, usize)>,
    nodes: usize,
    root: Option<Node>,
}

/// Reads the text of `reading`'s file. None, with findings, when it does not parse.
pub fn read(cx: &mut Cx, reading: Reading) -> Option<Node> {
    let text = cx.sources.file(reading.file).text.clone();
    let mut reader = YamlReader { cx, reading, stack: Vec::new(), anchors: FxHashMap::default(), nodes: 0, root: None };
    match reader.run(&text) {
        Ok(()) => Some(reader.root.take().unwrap_or(Node::new(Kind::Null, reading.whole))),
        Err(finding) => {
            cx.refuse(*finding);
            None
        }
    }
}

/// The element of an array in a line that stands there without quotes (`Joint.y[0]`).
fn bare_element(line: &str) -> Option<&str> {
    let is_named = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '/');
    line.match_indices('[').find_map(|(open, _)| {
        let begin = line[..open]
            .rfind(|c| !is_named(c))
            .map_or(0, |at| at + line[at..].chars().next().map_or(1, char::len_utf8));
        let close = open + line[open..].find(']')?;
        let is_number = close > open + 1 && line[open + 1..close].bytes().all(|c| c.is_ascii_digit());
        let is_quoted = line[..begin].ends_with(['"', '\'']);
        (is_number && line[begin..open].contains('.') && !is_quoted).then(|| &line[begin..=close])
    })
}

type ReadResult = Result<(), Box<Finding>>;

fn small(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl YamlReader<'_> {
    fn run(&mut self, text: &str) -> ReadResult {
        let mut parser = Parser::new_from_str(text);
        let mut documents = 0;
        while let Some(event) = parser.next_event() {
            let (event, span) = event.map_err(|error| self.syntax(&error))?;
            match event {
                Event::DocumentStart(_) => {
                    documents += 1;
                    if documents > 1 {
                        return Err(Box::new(
                            Finding::error(codes::TEXT_SEVERAL_DOCUMENTS, "a second document begins here")
                                .at(self.origin(span))
                                .help("write one document a file: remove this `---` and what follows it"),
                        ));
                    }
                }
                Event::Scalar(text, style, anchor, tag) => {
                    let origin = self.origin(span);
                    let kind = self.scalar(&text, style, tag.as_deref(), origin)?;
                    self.node(Node::new(kind, origin), anchor, 1)?;
                }
                Event::SequenceStart(anchor, tag) => self.open(Open::List(Vec::new()), span, anchor, tag.as_deref())?,
                Event::MappingStart(anchor, tag) => {
                    let map = Open::Map { entries: Vec::new(), key: None, seen: FxHashMap::default() };
                    self.open(map, span, anchor, tag.as_deref())?;
                }
                Event::SequenceEnd | Event::MappingEnd => self.close()?,
                Event::Alias(anchor) => {
                    let origin = self.origin(span);
                    // The budget first: a copy of what is too large must not be made.
                    self.nodes += self.anchors.get(&anchor).map_or(0, |(_, nodes)| *nodes);
                    self.budget(origin)?;
                    let Some((node, nodes)) = self.anchors.get(&anchor).cloned() else {
                        return Err(Box::new(
                            Finding::error(codes::TEXT_SYNTAX, "this alias stands inside what it names")
                                .at(origin)
                                .help("an alias can only name something that is complete"),
                        ));
                    };
                    self.place(node, nodes)?;
                }
                Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentEnd => {}
            }
        }
        Ok(())
    }

    fn origin(&mut self, span: Span) -> Origin {
        let length = if span.end.line() == span.start.line() {
            span.end.col().saturating_sub(span.start.col())
        } else {
            span.end.index().saturating_sub(span.start.index())
        };
        let file = self.reading.file;
        self.cx.sources.exact(file, small(span.start.line()), small(span.start.col()), small(length))
    }

    fn syntax(&mut self, error: &ScanError) -> Box<Finding> {
        let marker = error.marker();
        let origin = self.cx.sources.exact(self.reading.file, small(marker.line()), small(marker.col()), 0);
        let deep = error.info().contains("recursion") || error.info().contains("too deep");
        let code = if deep { codes::TEXT_TOO_DEEP } else { codes::TEXT_SYNTAX };
        let tab = self.cx.sources.file(self.reading.file).line(small(marker.line()));
        let line = &self.cx.sources.file(self.reading.file).text[tab];
        let help = if line.trim_start_matches(' ').starts_with('\t') {
            "YAML is indented with blanks, never with tabs".to_owned()
        } else if let Some(part) = bare_element(line) {
            format!("the part of a port stands in quotes in YAML: `\"{part}\"`")
        } else {
            "see what stands just before this place: a name without its `:` at the end of a line, a bracket or quote left open, a missing blank after `:`, or \
             indentation that does not fit"
                .to_owned()
        };
        Box::new(Finding::error(code, format!("this is not YAML: {}", error.info())).at(origin).help(help))
    }

    fn budget(&mut self, origin: Origin) -> ReadResult {
        if self.nodes <= limits::TEXT_NODES {
            return Ok(());
        }
        Err(Box::new(
            Finding::error(codes::TEXT_TOO_MANY_NODES, format!("more than {} values", limits::TEXT_NODES))
                .at(origin)
                .labelled("with this one, aliases expanded")
                .help("split the file; if aliases (`*name`) repeat large parts, write less of them"),
        ))
    }

    fn open(&mut self, open: Open, span: Span, anchor: usize, tag: Option<&Tag>) -> ReadResult {
        let origin = self.origin(span);
        if let Some(tag) = tag
            && !(tag.is_yaml_core_schema() && matches!(tag.suffix.as_str(), "map" | "seq"))
        {
            return Err(refused_tag(tag, origin));
        }
        if self.stack.len() >= limits::TEXT_DEPTH {
            return Err(Box::new(
                Finding::error(codes::TEXT_TOO_DEEP, format!("nested more than {} levels deep", limits::TEXT_DEPTH))
                    .at(origin)
                    .labelled("one level too many")
                    .help("nothing that Davit reads needs so many levels: a bracket is probably not closed"),
            ));
        }
        self.stack.push(OpenCollection { open, origin, anchor, nodes: 1 });
        Ok(())
    }

    fn close(&mut self) -> ReadResult {
        let Some(frame) = self.stack.pop() else { return Ok(()) };
        let kind = match frame.open {
            Open::List(list) => Kind::List(list),
            Open::Map { entries, .. } => Kind::Map(entries),
        };
        self.node(Node::new(kind, frame.origin), frame.anchor, frame.nodes)
    }

    /// A complete node: remembered if it has an anchor, then put where it belongs.
    fn node(&mut self, node: Node, anchor: usize, nodes: usize) -> ReadResult {
        self.nodes += 1;
        self.budget(node.origin)?;
        if anchor > 0 {
            // The copy that is kept, and what parser and reader remember of its name.
            self.nodes += nodes + 4;
            self.budget(node.origin)?;
            self.anchors.insert(anchor, (node.clone(), nodes));
        }
        self.place(node, nodes)
    }

    fn place(&mut self, node: Node, nodes: usize) -> ReadResult {
        let Some(frame) = self.stack.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        frame.nodes += nodes;
        match &mut frame.open {
            Open::List(list) => list.push(node),
            Open::Map { entries, key, seen } => match key.take() {
                None => {
                    let text: Cow<'static, str> = match node.kind {
                        Kind::Str(text) => Cow::Owned(text.into()),
                        Kind::Int(v) => Cow::Owned(v.to_string()),
                        Kind::Bool(v) => Cow::Owned(v.to_string()),
                        _ => {
                            return Err(Box::new(
                                Finding::error(codes::TEXT_SYNTAX, "a key must be a name")
                                    .at(node.origin)
                                    .help("write `name: value`"),
                            ));
                        }
                    };
                    let first = if entries.len() < SMALL_MAP {
                        entries.iter().find(|e| e.key == text).map(|e| e.origin)
                    } else {
                        if seen.is_empty() {
                            seen.extend(entries.iter().map(|e| (e.key.to_string(), e.origin)));
                        }
                        match seen.entry(text.to_string()) {
                            hash_map::Entry::Occupied(first) => Some(*first.get()),
                            hash_map::Entry::Vacant(free) => {
                                free.insert(node.origin);
                                None
                            }
                        }
                    };
                    if let Some(first) = first {
                        self.cx.report(stands_twice(&text, first, node.origin));
                    }
                    *key = Some((if first.is_some() { AGAIN } else { text }, node.origin));
                }
                Some((key, origin)) => {
                    if key != AGAIN {
                        entries.push(Entry { key, origin, value: node });
                    }
                }
            },
        }
        Ok(())
    }

    fn scalar(
        &mut self,
        text: &str,
        style: ScalarStyle,
        tag: Option<&Tag>,
        origin: Origin,
    ) -> Result<Kind, Box<Finding>> {
        if let Some(tag) = tag {
            if !tag.is_yaml_core_schema() {
                return Err(refused_tag(tag, origin));
            }
            if tag.suffix == "str" {
                return Ok(Kind::Str(text.into()));
            }
            if !matches!(tag.suffix.as_str(), "int" | "float" | "bool" | "null") {
                return Err(refused_tag(tag, origin));
            }
        }
        if style != ScalarStyle::Plain && tag.is_none() {
            return Ok(Kind::Str(text.into()));
        }
        match plain(text) {
            Some(kind) => Ok(kind),
            None => {
                self.cx.report(
                    Finding::error(codes::TEXT_WRONG_TYPE, format!("`{text}` is too large for an int of 64 bits"))
                        .at(origin)
                        .help("write it as a float (with a point), or as a text in quotes"),
                );
                Ok(Kind::Poison)
            }
        }
    }
}

fn refused_tag(tag: &Tag, origin: Origin) -> Box<Finding> {
    Box::new(
        Finding::error(codes::TEXT_TAG, format!("the tag `{tag}` means nothing here"))
            .at(origin)
            .help("remove it: types come from where a value stands"),
    )
}

/// A plain scalar by YAML 1.2's core schema; none for a whole number that 64 bits cannot hold.
pub fn plain(text: &str) -> Option<Kind> {
    Some(match text {
        "" | "~" | "null" | "Null" | "NULL" => Kind::Null,
        "true" | "True" | "TRUE" => Kind::Bool(true),
        "false" | "False" | "FALSE" => Kind::Bool(false),
        ".nan" | ".NaN" | ".NAN" => Kind::Float(f64::NAN),
        ".inf" | ".Inf" | ".INF" | "+.inf" | "+.Inf" | "+.INF" => Kind::Float(f64::INFINITY),
        "-.inf" | "-.Inf" | "-.INF" => Kind::Float(f64::NEG_INFINITY),
        _ => {
            let unsigned = text.strip_prefix(['-', '+']).unwrap_or(text);
            let digits = |t: &str, radix| !t.is_empty() && t.chars().all(|c| c.is_digit(radix));
            if let Some(hex) = text.strip_prefix("0x").filter(|t| digits(t, 16)) {
                return i64::from_str_radix(hex, 16).ok().map(Kind::Int);
            }
            if let Some(octal) = text.strip_prefix("0o").filter(|t| digits(t, 8)) {
                return i64::from_str_radix(octal, 8).ok().map(Kind::Int);
            }
            if digits(unsigned, 10) {
                return text.parse().ok().map(Kind::Int);
            }
            if is_float(unsigned) {
                text.parse().map_or_else(|_| Kind::Str(text.into()), Kind::Float)
            } else {
                Kind::Str(text.into())
            }
        }
    })
}

/// `[0-9]*\.?[0-9]*([eE][-+]?[0-9]+)?` with at least one digit before the exponent.
fn is_float(text: &str) -> bool {
    let (mantissa, exponent) = match text.split_once(['e', 'E']) {
        Some((m, e)) => (m, Some(e)),
        None => (text, None),
    };
    let digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
    let exponent_fits = exponent.is_none_or(|e| {
        let e = e.strip_prefix(['-', '+']).unwrap_or(e);
        !e.is_empty() && digits(e)
    });
    !(whole.is_empty() && fraction.is_empty()) && digits(whole) && digits(fraction) && exponent_fits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_scalars_follow_yaml_1_2() {
        let kind = |text| format!("{:?}", plain(text));
        for (text, expected) in [
            ("yes", "Some(Str(\"yes\"))"),
            ("12", "Some(Int(12))"),
            ("-0x1", "Some(Str(\"-0x1\"))"),
            ("0x1F", "Some(Int(31))"),
            ("1e3", "Some(Float(1000.0))"),
            ("-.5", "Some(Float(-0.5))"),
            ("1.", "Some(Float(1.0))"),
            (".", "Some(Str(\".\"))"),
            ("500ms", "Some(Str(\"500ms\"))"),
            ("inf", "Some(Str(\"inf\"))"),
            ("99999999999999999999", "None"),
        ] {
            assert_eq!(kind(text), expected, "{text}");
        }
    }
}
