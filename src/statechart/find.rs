//! The states that a text names.

use super::chart::{Chart, NodeId};
use crate::model::finding::nearest;

/// Why a text names no state.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FindError {
    /// No state's path ends so.
    #[error("the coordinator has no state `{name}`{}", near.as_ref().map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    Unknown {
        /// What was asked for.
        name: String,
        /// The state that may have been meant.
        near: Option<String>,
    },
    /// More than one state's path ends so.
    #[error("`{name}` is the name of {} states: {}", candidates.len(), candidates.join(", "))]
    Ambiguous {
        /// What was asked for.
        name: String,
        /// The full names of all that fit.
        candidates: Vec<String>,
    },
}

impl Chart {
    /// The state that `text` names: by its own name (`operational`), its full name (`root.operational`), or any end of it
    /// (`sync.copying`).
    ///
    /// # Errors
    /// [`FindError`] when no state or more than one is named so. A full name is never ambiguous.
    pub fn find(&self, text: &str) -> Result<NodeId, FindError> {
        let found = self.named(text);
        match found[..] {
            [node] => Ok(node),
            [] => {
                let last = text.rsplit('.').next().unwrap_or_default();
                let names: Vec<String> =
                    self.nodes().filter(|n| self.is_state(*n)).map(|n| self.name(n).to_string()).collect();
                let near = nearest(last, names.iter().map(String::as_str)).map(str::to_owned);
                Err(FindError::Unknown { name: text.to_owned(), near })
            }
            _ => Err(FindError::Ambiguous {
                name: text.to_owned(),
                candidates: found.iter().map(|n| self.fqn(*n).to_string()).collect(),
            }),
        }
    }

    /// All states that `text` names, as [`Self::find`] reads it: one where that is a full name.
    pub fn named(&self, text: &str) -> Vec<NodeId> {
        let parts: Vec<&str> = text.split('.').collect();
        let fits = |node: &NodeId| self.is_state(*node) && self.ends_with(*node, &parts);
        let found: Vec<NodeId> = self.nodes().filter(fits).collect();
        let whole = found.iter().find(|node| self.depth(**node) + 1 == parts.len());
        whole.map_or(found.clone(), |whole| vec![*whole])
    }

    fn ends_with(&self, node: NodeId, parts: &[&str]) -> bool {
        let mut at = Some(node);
        for part in parts.iter().rev() {
            match at {
                Some(n) if self.name(n).as_str() == *part => at = self.parent(n),
                _ => return false,
            }
        }
        true
    }
}
