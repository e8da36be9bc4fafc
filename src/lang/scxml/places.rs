//! Places in a document, and its depth before it is parsed.

use crate::lang::tree::{Cx, Reading};
use crate::limits;
use crate::model::Origin;
use std::ops::Range;

/// What of a document costs the parser more than its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TooMuch {
    /// Elements inside each other.
    Deep,
    /// Attributes of one element.
    Attributes,
    /// Declarations of namespaces.
    Namespaces,
}

/// What goes past its bound, and where. Counted before parsing, roughly: what stands in comments counts as well.
pub fn too_much(text: &str) -> Option<(TooMuch, usize)> {
    let bytes = text.as_bytes();
    let (mut depth, mut at, mut quote) = (0_usize, 0, None);
    let mut opened = false;
    // Where the word begins that stands before a `=`.
    let (mut attributes, mut namespaces, mut word) = (0, 0, 0);
    while at < bytes.len() {
        let byte = bytes[at];
        match (quote, byte) {
            (Some(q), b) if b == q => quote = None,
            (Some(_), _) => {}
            (None, b'"' | b'\'') if opened => quote = Some(byte),
            (None, b'<') => match bytes.get(at + 1) {
                Some(b'/') => depth = depth.saturating_sub(1),
                Some(b'!' | b'?') => {}
                _ => {
                    depth += 1;
                    opened = true;
                    attributes = 0;
                    if depth > limits::XML_DEPTH {
                        return Some((TooMuch::Deep, at));
                    }
                }
            },
            (None, b'=') if opened => {
                attributes += 1;
                namespaces += usize::from(bytes[word..at].starts_with(b"xmlns"));
                if attributes > limits::XML_ATTRIBUTES {
                    return Some((TooMuch::Attributes, at));
                }
                if namespaces > limits::XML_NAMESPACES {
                    return Some((TooMuch::Namespaces, at));
                }
            }
            (None, b) if opened && b.is_ascii_whitespace() => word = at + 1,
            (None, b'>') if opened => {
                if at > 0 && bytes[at - 1] == b'/' {
                    depth -= 1;
                }
                opened = false;
            }
            _ => {}
        }
        at += 1;
    }
    None
}

/// Byte offsets as places.
pub struct LineIndex<'t> {
    reading: Reading,
    text: &'t str,
    /// Offset, line and column about every so many bytes: a document may be one long line.
    marks: Vec<(usize, u32, u32)>,
}

/// Bytes between two marks.
const STRIDE: usize = 1024;

impl<'t> LineIndex<'t> {
    pub fn new(reading: Reading, text: &'t str) -> Self {
        let mut marks = vec![(0, 1, 0)];
        let (mut line, mut column) = (1, 0);
        for (at, c) in text.char_indices() {
            if at >= marks.len() * STRIDE {
                marks.push((at, line, column));
            }
            (line, column) = if c == '\n' { (line + 1, 0) } else { (line, column + 1) };
        }
        Self { reading, text, marks }
    }

    /// What stands between two byte offsets.
    pub fn text(&self, range: Range<usize>) -> &'t str {
        self.text.get(range).unwrap_or_default()
    }

    pub fn place(&self, cx: &mut Cx, offset: usize, length: u32) -> Origin {
        let after = self.marks.partition_point(|(at, ..)| *at <= offset);
        let (from, mut line, mut column) = self.marks[after.saturating_sub(1)];
        for c in self.text.get(from..offset).unwrap_or_default().chars() {
            (line, column) = if c == '\n' { (line + 1, 0) } else { (line, column + 1) };
        }
        cx.sources.exact(self.reading.file, line, column, length)
    }
}
