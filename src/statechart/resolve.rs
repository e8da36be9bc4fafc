//! What the text of a source or target means (`docs/rfsm.md` §3).
//!
//! A text without a dot is a name of the scope in which the transition is written. One that begins with a dot is a path
//! from that scope; any other is a path from the root, with or without the word `root` in front. rFSM also takes a
//! backslash for a dot, and so do we.

use super::chart::NONE;
use crate::model::finding;
use crate::model::names::Ident;
use crate::model::statechart::{INITIAL, ROOT};
use rustc_hash::FxHashMap;

/// The names of a chart, as far as references need them.
pub(super) struct ResolvedNames<'a> {
    /// Child of a state by name.
    pub children: &'a FxHashMap<(u32, Ident), u32>,
    pub names: &'a [Ident],
    pub parents: &'a [u32],
    /// It is said what may have been meant; nobody reads that of thousands.
    pub suggests: bool,
}

/// Why a reference means nothing.
pub(super) struct Unresolved {
    pub message: String,
    pub help: String,
}

/// Whether a name that is not there is `initial`, misspelt.
pub fn is_meant_initial(name: &str) -> bool {
    finding::nearest(name, [INITIAL]).is_some()
}

impl ResolvedNames<'_> {
    pub fn child(&self, state: u32, name: &str) -> Option<u32> {
        self.children.get(&(state, Ident::new(name).ok()?)).copied()
    }

    pub fn fqn(&self, node: u32) -> String {
        let mut parts = vec![self.names[node as usize].as_str()];
        let mut at = node;
        while self.parents[at as usize] != NONE && at != 0 {
            at = self.parents[at as usize];
            parts.push(self.names[at as usize].as_str());
        }
        parts.reverse();
        parts.join(".")
    }

    /// The node that `text`, written in `scope`, refers to.
    pub fn resolve(&self, scope: u32, text: &str) -> Result<u32, Unresolved> {
        let is_separator = |c: char| c == '.' || c == '\\';
        if !text.contains(is_separator) {
            return self.child(scope, text).ok_or_else(|| self.missing(scope, text, text));
        }
        let mut pieces: Vec<&str> = text.split(is_separator).collect();
        // An empty piece counts only in the middle.
        if pieces.last() == Some(&"") {
            pieces.pop();
        }
        if pieces.first() == Some(&"") {
            pieces.remove(0);
        }
        let start = if text.starts_with('.') { scope } else { 0 };
        // A state inside may be called like the outermost one.
        let named = self.child(start, ROOT).is_some();
        let outermost = pieces.iter().take_while(|piece| **piece == ROOT).count();
        let mut at = start;
        for piece in &pieces[if named { outermost.min(1) } else { outermost }..] {
            at = self.child(at, piece).ok_or_else(|| self.missing(at, piece, text))?;
        }
        Ok(at)
    }

    fn missing(&self, state: u32, name: &str, text: &str) -> Unresolved {
        let here = self.fqn(state);
        let message = if text == name {
            format!("there is no `{name}` in `{here}`")
        } else {
            format!("`{text}` leads nowhere: there is no `{name}` in `{here}`")
        };
        if !self.suggests {
            return Unresolved { message, help: "name a state or connector that is there".to_owned() };
        }
        // Elsewhere in the chart there may be a node of exactly that name: then the way to it was what went wrong.
        let elsewhere = (0..self.names.len()).map(|i| u32::try_from(i).unwrap_or(NONE)).find(|node| {
            *node != 0 && self.names[*node as usize].as_str() == name && self.parents[*node as usize] != state
        });
        let mut known: Vec<&str> = self
            .children
            .iter()
            .filter(|((parent, _), _)| *parent == state)
            .map(|((_, name), _)| name.as_str())
            .collect();
        known.sort_unstable();
        let help = match (finding::nearest(name, known.iter().copied()), elsewhere) {
            _ if name == INITIAL => {
                format!("write a transition with `src = \"initial\"` in `{here}`, so that it has an initial connector")
            }
            (None, Some(node)) => format!("there is one elsewhere: write `{}`", self.fqn(node)),
            // What is misspelt may be what makes it be there.
            (None, None) if is_meant_initial(name) => format!("did you mean `{INITIAL}`?"),
            _ => finding::did_you_mean(name, "nodes", known),
        };
        Unresolved { message, help }
    }
}
