//! Where model elements were written.

use super::large::Large;
use super::source_file::{FileId, Language, Location, SourceFile};
use super::{extent, yaml_extent};
use crate::model::{Finding, Origin};
use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

/// How a place is known.
#[derive(Debug, Clone)]
enum TextPlace {
    /// Nowhere: the place of [`Origin::NONE`].
    Nowhere,
    /// The whole file.
    File(FileId),
    /// A line (from 1).
    Line { file: FileId, line: u32 },
    /// A line (from 1) and a column (from 0, in characters), with a length in characters (0: to be found).
    Exact { file: FileId, line: u32, column: u32, length: u32 },
    /// The `nth` call of `word` on a line.
    Call { file: FileId, line: u32, nth: u32, word: &'static str },
    /// The first token `word` inside the place `parent`.
    Within { parent: Origin, word: Box<str> },
    /// The token `word` on a line (from 1), where it is read.
    Read { file: FileId, line: u32, word: Box<str> },
}

/// All texts that were read, and where the elements of the model stand in them.
#[derive(Debug, Clone)]
pub struct SourceMap {
    files: Vec<SourceFile>,
    places: Vec<TextPlace>,
    speller: Option<Speller>,
    large: Large,
}

/// What a text is in a finding about a file of that language: the examples in it, which stand between backticks, are written as Lua has them.
pub type Speller = fn(Language, &str) -> String;

impl Default for SourceMap {
    fn default() -> Self {
        Self { files: Vec::new(), places: vec![TextPlace::Nowhere], speller: None, large: Large::default() }
    }
}

impl SourceMap {
    /// An empty one.
    pub fn new() -> Self {
        Self::default()
    }

    /// Who knows how examples are spelt.
    pub fn spell_with(&mut self, speller: Speller) {
        self.speller = Some(speller);
    }

    /// What to do about a finding, in the language of what it is about: where it stands in the deployment, of what else it points at.
    pub fn told_help<'f>(&self, finding: &'f Finding) -> Option<Cow<'f, str>> {
        let elsewhere = |at: &Origin| self.file_of(*at).is_some_and(|file| file != FileId(0));
        let at = match elsewhere(&finding.origin) {
            true => None,
            false => finding.labels.iter().map(|label| label.origin).find(elsewhere),
        };
        finding.help.as_deref().map(|help| self.told(at.unwrap_or(finding.origin), help))
    }

    /// A text of a finding, with its examples in the language of the file in which `at` stands; in the first one, the deployment,
    /// which can only be YAML, in that of the files that it names.
    pub fn told<'t>(&self, at: Origin, text: &'t str) -> Cow<'t, str> {
        let lua = || self.files.iter().any(|file| file.language == Language::Lua);
        let language = || {
            let file = self.file_of(at)?;
            let language = self.file(file).language;
            (!(language == Language::Lua || file == FileId(0) && lua())).then_some(language)
        };
        match (self.speller, text.contains('`').then(language).flatten()) {
            (Some(speller), Some(language)) => Cow::Owned(speller(language, text)),
            _ => Cow::Borrowed(text),
        }
    }

    /// Adds a text.
    pub fn add_file(&mut self, name: impl Into<Arc<str>>, text: impl Into<Arc<str>>, language: Language) -> FileId {
        let id = FileId(u32::try_from(self.files.len()).unwrap_or(u32::MAX));
        self.files.push(SourceFile::new(name.into(), text.into(), language));
        id
    }

    /// Adds some lines of a text too large to be kept, of which the first is the `line`-th (from 1) of the whole.
    pub fn add_excerpt(&mut self, name: impl Into<Arc<str>>, text: impl Into<Arc<str>>, line: u32) -> FileId {
        let id = self.add_file(name, text, Language::Yaml);
        self.files[id.0 as usize].skipped = line.saturating_sub(1);
        id
    }

    /// The file of that id.
    ///
    /// # Panics
    /// When the id is of another source map.
    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[id.0 as usize]
    }

    /// All files, in the order they were added.
    pub fn files(&self) -> &[SourceFile] {
        &self.files
    }

    fn add(&mut self, place: TextPlace) -> Origin {
        let origin = Origin(u32::try_from(self.places.len()).unwrap_or(0));
        self.places.push(place);
        origin
    }

    /// The place of a whole file.
    pub fn whole_file(&mut self, file: FileId) -> Origin {
        self.add(TextPlace::File(file))
    }

    /// A line (from 1), a column (from 0) and a length, both in characters. Length 0 means up to the token's end.
    pub fn exact(&mut self, file: FileId, line: u32, column: u32, length: u32) -> Origin {
        self.add(TextPlace::Exact { file, line, column, length })
    }

    /// A whole line (from 1).
    pub fn exact_line(&mut self, file: FileId, line: u32) -> Origin {
        self.add(TextPlace::Line { file, line })
    }

    /// The `nth` (from 0) call of `word` that stands on a line (from 1).
    pub fn call(&mut self, file: FileId, line: u32, nth: u32, word: &'static str) -> Origin {
        self.add(TextPlace::Call { file, line, nth, word })
    }

    /// The token `word` on a line (from 1) where it is read, and not where something of that name is given a value.
    pub fn read(&mut self, file: FileId, line: u32, word: &str) -> Origin {
        self.add(TextPlace::Read { file, line, word: word.into() })
    }

    /// The token `word` inside the place `parent`; where that is not found, `parent` itself.
    pub fn within(&mut self, parent: Origin, word: &str) -> Origin {
        match self.places.get(parent.0 as usize) {
            Some(TextPlace::Call { .. } | TextPlace::Within { .. } | TextPlace::File(_) | TextPlace::Line { .. }) => {
                self.add(TextPlace::Within { parent, word: word.into() })
            }
            _ => parent,
        }
    }

    /// Whether a place is known exactly, without looking for its text.
    pub fn is_exact(&self, origin: Origin) -> bool {
        matches!(self.places.get(origin.0 as usize), Some(TextPlace::Exact { .. }))
    }

    /// The file in which an origin stands, without looking where.
    pub fn file_of(&self, origin: Origin) -> Option<FileId> {
        let mut at = origin;
        loop {
            return match self.places.get(at.0 as usize)? {
                TextPlace::Within { parent, .. } => {
                    at = *parent;
                    continue;
                }
                TextPlace::Nowhere => None,
                TextPlace::File(file)
                | TextPlace::Line { file, .. }
                | TextPlace::Exact { file, .. }
                | TextPlace::Call { file, .. }
                | TextPlace::Read { file, .. } => Some(*file),
            };
        }
    }

    /// The bytes of the whole element at `origin`, as far as they are known: of a call in Lua up to its closing bracket.
    pub fn extent(&self, origin: Origin) -> Option<(FileId, Range<usize>)> {
        let (file, span) = self.base(origin)?;
        Some((file, self.reach(origin, file, &span)))
    }

    /// Where an origin stands; none for that of what no text has.
    pub fn locate(&self, origin: Origin) -> Option<Location> {
        let mut words = Vec::new();
        let mut at = origin;
        while let TextPlace::Within { parent, word } = self.places.get(at.0 as usize)? {
            words.push(&**word);
            at = *parent;
        }
        let (file, span) = self.base(at)?;
        if words.is_empty() {
            return Some(self.location(file, span));
        }
        if let Some(found) = self.large.found(origin.0) {
            return Some(found);
        }
        // Past the budget the element around it is shown.
        if self.large.is_tired() {
            return Some(self.location(file, span));
        }
        let inside = self.reach(at, file, &span);
        let is_large = self.large.looks_through(inside.len());
        let is_line = matches!(self.places.get(at.0 as usize), Some(TextPlace::Line { .. }));
        let found = self.location(file, self.find(file, (span, inside), is_line, &words));
        if is_large {
            self.large.note(origin.0, found.clone());
        }
        Some(found)
    }

    /// The bytes of the innermost of these words, which is the first; what is not there is passed over.
    fn find(
        &self,
        file: FileId,
        (mut span, mut inside): (Range<usize>, Range<usize>),
        is_line: bool,
        words: &[&str],
    ) -> Range<usize> {
        let text = &self.file(file).text;
        for word in words.iter().rev() {
            let far = || extent::find_in_element(text, inside.clone(), word);
            let found = (is_line && inside == span).then(far).flatten();
            let Some(found) = found.or_else(|| extent::find(text, inside.clone(), word)) else { continue };
            inside = extent::reach_of_key(text, &found, inside.end);
            span = found;
        }
        span
    }

    /// Where a part of the element at `origin` stands: the token `word` inside it, if it is there; of a name of several parts also the last
    /// one by itself (`A.k`, where the component is named around it), or what is written for it where a subsystem exports it.
    pub fn locate_part(&self, origin: Origin, word: &str) -> Option<Location> {
        if let Some(found) = self.locate_word(origin, word) {
            return Some(found);
        }
        let whole = self.locate(origin).filter(|_| !self.large.is_tired())?;
        let source = self.file(whole.file);
        let inside = self.inside(origin, &whole);
        let found = match word.split_once('/') {
            Some((path, _)) => extent::find_member(&source.text, inside, path),
            None => extent::find_alone(&source.text, inside, word.rsplit_once('.')?.1),
        };
        Some(self.location(whole.file, found?))
    }

    /// The bytes of the element at `origin`, which begins at `whole`.
    fn inside(&self, origin: Origin, whole: &Location) -> Range<usize> {
        let source = self.file(whole.file);
        let of_yaml = matches!(self.places.get(origin.0 as usize), Some(TextPlace::Exact { .. }));
        match source.language {
            Language::Lua => extent::balanced(&source.text, whole.span.clone()),
            Language::Yaml if of_yaml && source.skipped == 0 => {
                let reach = yaml_extent::reach(&source.text, whole.span.start);
                reach.start..reach.end.max(whole.span.end)
            }
            Language::Yaml | Language::Scxml => whole.span.clone(),
        }
    }

    fn locate_word(&self, origin: Origin, word: &str) -> Option<Location> {
        let whole = self.locate(origin).filter(|_| !self.large.is_tired())?;
        let source = self.file(whole.file);
        let of_lines = !matches!(self.places.get(origin.0 as usize), Some(TextPlace::Exact { .. }));
        if of_lines && source.line(whole.line).end == whole.span.end {
            // Of a line it is not known where what begins there ends.
            let found = extent::find_in_element(&source.text, whole.span.clone(), word);
            let found = found.or_else(|| extent::find(&source.text, whole.span.clone(), word));
            return found.map(|span| self.location(whole.file, span));
        }
        let inside = self.inside(origin, &whole);
        self.large.looks_through(inside.len());
        Some(self.location(whole.file, extent::find(&source.text, inside, word)?))
    }

    fn location(&self, file: FileId, span: Range<usize>) -> Location {
        let source = self.file(file);
        let line = source.line_of(span.start);
        let start = source.line(line).start;
        let column = source
            .text
            .get(start..span.start)
            .map_or(0, |t| if source.is_ascii() { t.len() } else { t.chars().count() });
        Location { file, line, column: u32::try_from(column).unwrap_or(u32::MAX).saturating_add(1), span }
    }

    /// File and bytes of a place that is not inside another.
    fn base(&self, origin: Origin) -> Option<(FileId, Range<usize>)> {
        Some(match self.places.get(origin.0 as usize)? {
            TextPlace::Nowhere | TextPlace::Within { .. } => return None,
            TextPlace::File(file) => (*file, 0..0),
            TextPlace::Exact { file, line, column, length } => {
                let source = self.file(*file);
                let line = source.line(*line);
                let offset = |from: usize, chars: u32| {
                    if source.is_ascii() {
                        return from.saturating_add(chars as usize).min(source.text.len());
                    }
                    source.text[from..].char_indices().nth(chars as usize).map_or(source.text.len(), |(i, _)| from + i)
                };
                let start = offset(line.start, *column);
                let end = if *length == 0 { extent::token_end(&source.text, start) } else { offset(start, *length) };
                (*file, start..end)
            }
            TextPlace::Line { file, line } => {
                let source = self.file(*file);
                let line = source.line(*line);
                let indent = source.text[line.clone()].len() - source.text[line.clone()].trim_start().len();
                (*file, line.start + indent..line.end)
            }
            TextPlace::Read { file, line, word } => {
                let source = self.file(*file);
                let line = source.line(*line);
                let found = extent::find_read(&source.text, line.clone(), word);
                (*file, found.or_else(|| extent::find(&source.text, line.clone(), word)).unwrap_or(line))
            }
            TextPlace::Call { file, line, nth, word } => {
                let source = self.file(*file);
                let line = source.line(*line);
                let found = self
                    .large
                    .nth_name((*file, &source.text), line.clone(), word, *nth as usize)
                    .unwrap_or_else(|| {
                        let indent = source.text[line.clone()].len() - source.text[line.clone()].trim_start().len();
                        line.start + indent..line.end
                    });
                (*file, found)
            }
        })
    }

    /// The bytes in which parts of the element at `origin` are looked for.
    fn reach(&self, origin: Origin, file: FileId, span: &Range<usize>) -> Range<usize> {
        match self.places.get(origin.0 as usize) {
            Some(TextPlace::Call { .. }) => extent::balanced(&self.file(file).text, span.clone()),
            Some(TextPlace::File(_)) => 0..self.file(file).text.len(),
            _ => span.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LUA: &str = "-- property_set(\"A.k\", 1)\nConfiguration {\n  post_conf_state = { 'compA:running' },\n  \
                       property_set(\"A.k\", 1), property_set(\n    \"B.k\", 2),\n}\n";

    fn at(map: &SourceMap, origin: Origin) -> (u32, u32, String) {
        let location = map.locate(origin).unwrap();
        (location.line, location.column, map.file(location.file).text[location.span].to_owned())
    }

    #[test]
    fn tokens_of_lua_are_found() {
        let mut map = SourceMap::new();
        let file = map.add_file("a.lua", LUA, Language::Lua);
        let call = map.call(file, 4, 1, "property_set");
        let name = map.within(call, "B.k");
        assert_eq!(at(&map, call), (4, 27, "property_set".to_owned()));
        assert_eq!(at(&map, name), (5, 5, "\"B.k\"".to_owned()));
        let absent = map.within(call, "A.k");
        assert_eq!(at(&map, absent), (4, 27, "property_set".to_owned()), "outside the call");
        let conf = map.call(file, 2, 0, "Configuration");
        let list = map.within(conf, "post_conf_state");
        let entry = map.within(list, "compA:running");
        assert_eq!(at(&map, entry).1, 23);
        assert_eq!(map.locate_part(call, "B.k").unwrap().line, 5);
    }

    #[test]
    fn of_what_begins_on_a_line_parts_are_found_on_its_other_lines_but_not_in_what_follows_or_is_made_inside() {
        let text = "return state {\n  up = state {\n    low = state { exit = 1 },\n    exit = f(entry),\n    events = {\n      'e',\n    },\n  },\n  \
                    trans { entry = 2 },\n}\n";
        let mut map = SourceMap::new();
        let file = map.add_file("a.lua", text, Language::Lua);
        let line = map.exact_line(file, 2);
        for (word, wanted) in [("exit", 4), ("e", 6), ("entry", 2), ("trans", 2)] {
            let part = map.within(line, word);
            assert_eq!(map.locate(part).unwrap().line, wanted, "{word}");
            assert_eq!(map.locate_part(line, word).map(|at| at.line), Some(wanted).filter(|line| *line > 2), "{word}");
        }
    }

    #[test]
    fn exact_places_count_characters() {
        let mut map = SourceMap::new();
        let file = map.add_file("a.yaml", "é: [ü, x]\n", Language::Yaml);
        let x = map.exact(file, 1, 7, 1);
        assert_eq!(at(&map, x), (1, 8, "x".to_owned()));
        let beyond = map.exact(file, 9, 7, 1);
        assert!(map.locate(beyond).is_some());
        assert_eq!(map.locate(Origin::NONE), None);
    }
}
