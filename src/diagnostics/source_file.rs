//! A text that was read, and a place in it.

use std::ops::Range;
use std::sync::Arc;

/// A file of a source map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct FileId(pub u32);

/// What a file is written in: says how its tokens are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Language {
    /// Lua: only lines are known when it is loaded.
    Lua,
    /// YAML: every place is known exactly.
    Yaml,
    /// SCXML, for coordinators: every element's place is known exactly.
    Scxml,
}

/// A text that was read.
#[derive(Debug, Clone)]
pub struct SourceFile {
    /// Its name as the user gave it.
    pub name: Arc<str>,
    /// Its content; empty when it could not be read.
    pub text: Arc<str>,
    /// What it is written in.
    pub language: Language,
    /// Byte offsets at which lines begin.
    line_starts: Vec<u32>,
    /// Every character is one byte.
    is_ascii: bool,
    /// Lines of the whole text that stand before this one, when it is an excerpt.
    pub skipped: u32,
}

impl SourceFile {
    /// A text, with its lines found.
    pub(super) fn new(name: Arc<str>, text: Arc<str>, language: Language) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let after_breaks = breaks.map(|(i, _)| u32::try_from(i + 1).unwrap_or(u32::MAX));
        let line_starts = std::iter::once(0).chain(after_breaks).collect();
        let is_ascii = text.is_ascii();
        Self { name, text, language, line_starts, is_ascii, skipped: 0 }
    }

    /// Every character is one byte, so that a column is an offset.
    pub(super) fn is_ascii(&self) -> bool {
        self.is_ascii
    }

    /// Byte range of a line (from 1), without its line break; the end of the text when there is no such line.
    pub fn line(&self, line: u32) -> Range<usize> {
        let index = line.saturating_sub(1) as usize;
        let Some(start) = self.line_starts.get(index) else {
            return self.text.len()..self.text.len();
        };
        let start = *start as usize;
        let end = self.line_starts.get(index + 1).map_or(self.text.len(), |next| *next as usize);
        let text = &self.text[start..end];
        start..start + text.trim_end_matches(['\n', '\r']).len()
    }

    /// Byte offsets at which lines begin.
    pub(super) fn line_starts(&self) -> impl Iterator<Item = usize> + '_ {
        self.line_starts.iter().map(|start| *start as usize)
    }

    /// The line (from 1) that holds a byte.
    pub fn line_of(&self, offset: usize) -> u32 {
        u32::try_from(self.line_starts.partition_point(|start| *start as usize <= offset)).unwrap_or(u32::MAX).max(1)
    }
}

/// A place in a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Location {
    /// The file.
    pub file: FileId,
    /// The line, from 1.
    pub line: u32,
    /// The column, from 1, in characters.
    pub column: u32,
    /// The bytes of the place.
    pub span: Range<usize>,
}
