//! Elements and lines that are large: to look through one again and again for the places of what is found in it would take for ever. What was
//! found is kept, and there is a budget.

use super::extent;
use super::source_file::{FileId, Location};
use crate::limits;
use rustc_hash::FxHashMap;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// What looking in large elements came to. A copy, whose places may be others from then on, begins anew.
#[derive(Debug, Default)]
pub(super) struct Large(Mutex<LargeElements>);

impl Clone for Large {
    fn clone(&self) -> Self {
        Self::default()
    }
}

/// Words that were looked for in large elements.
#[derive(Debug, Default)]
struct LargeElements {
    /// Bytes that were looked through, against [`limits::PLACE_BYTES`].
    bytes: usize,
    /// What was found, by the numbers of the places.
    found: FxHashMap<u32, Location>,
    /// The names of calls on large lines, by where these begin.
    names: FxHashMap<(FileId, usize, &'static str), Vec<Range<usize>>>,
}

impl Large {
    fn elements(&self) -> MutexGuard<'_, LargeElements> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was found of a place before.
    pub fn found(&self, place: u32) -> Option<Location> {
        self.elements().found.get(&place).cloned()
    }

    /// Where a place was found.
    pub fn note(&self, place: u32, found: Location) {
        self.elements().found.insert(place, found);
    }

    /// Whether so much was looked through that it is time to say less exactly where things stand.
    pub fn is_tired(&self) -> bool {
        self.elements().bytes > limits::PLACE_BYTES
    }

    /// So many bytes are; whether they are many: few are nothing that adds up.
    pub fn looks_through(&self, bytes: usize) -> bool {
        let is_large = bytes > limits::PLACE_LARGE;
        if is_large {
            self.elements().bytes += bytes;
        }
        is_large
    }

    /// The `nth` name `word` on a line of a file, or the last one where there are fewer. Of a large line all are looked for at once.
    pub fn nth_name(
        &self,
        (file, text): (FileId, &str),
        line: Range<usize>,
        word: &'static str,
        nth: usize,
    ) -> Option<Range<usize>> {
        if line.len() <= limits::PLACE_LARGE {
            let mut last = None;
            let mut names = extent::names(text, line, word).inspect(|name| last = Some(name.clone()));
            return names.nth(nth).or(last);
        }
        let mut elements = self.elements();
        let names = elements.names.entry((file, line.start, word));
        let names = names.or_insert_with(|| extent::names(text, line, word).collect());
        names.get(nth).or(names.last()).cloned()
    }
}
