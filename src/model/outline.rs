//! A statechart with its references followed: every node by its full name, every transition with both its ends.
//!
//! For whoever writes a chart in another form. References are followed as far as they lead to something; what leads
//! nowhere is left out here, and `crate::statechart::compile` says what is wrong with it.

use super::statechart::{ChartNode, ChartTransition, INITIAL, ROOT, State, Statechart};
use std::collections::HashMap;

/// A node of the outline.
#[derive(Debug, Clone)]
pub struct OutlineNode<'m> {
    /// Its full name: `root.sync.copying`.
    pub fqn: String,
    /// Its name in its parent.
    pub name: &'m str,
    /// The state around it, an index into [`Outline::items`]; none for the root.
    pub parent: Option<usize>,
    /// The state; none: a connector, written or implied.
    pub state: Option<&'m State>,
}

/// A transition with its ends: indices into [`Outline::items`].
#[derive(Debug, Clone)]
pub struct OutlineTransition<'m> {
    /// The source.
    pub src: usize,
    /// The target as written: a composite state stands for its initial connector.
    pub tgt: usize,
    /// The transition.
    pub transition: &'m ChartTransition,
}

/// The nodes and transitions of a chart, in rFSM's order: a scope's own transitions before those of the states in it.
#[derive(Debug, Clone, Default)]
pub struct Outline<'m> {
    /// States and connectors; a state stands before what is in it, and the root is first.
    pub items: Vec<OutlineNode<'m>>,
    /// Transitions.
    pub links: Vec<OutlineTransition<'m>>,
    children: HashMap<(usize, &'m str), usize>,
}

impl<'m> Outline<'m> {
    /// The outline of a chart.
    pub fn of(chart: &'m Statechart) -> Self {
        let mut outline = Self::default();
        let mut scopes = Vec::new();
        outline.walk(&chart.root, ROOT, None, &mut scopes);
        for (scope, state) in scopes {
            for transition in &state.transitions {
                let end = |text: &Option<(String, _)>| outline.find(scope, &text.as_ref()?.0);
                if let (Some(src), Some(tgt)) = (end(&transition.src), end(&transition.tgt)) {
                    outline.links.push(OutlineTransition { src, tgt, transition });
                }
            }
        }
        outline
    }

    fn walk(&mut self, state: &'m State, name: &'m str, parent: Option<usize>, scopes: &mut Vec<(usize, &'m State)>) {
        let at = self.add(name, parent, Some(state));
        scopes.push((at, state));
        for child in &state.children {
            match child {
                ChartNode::State(inner) => self.walk(inner, inner.name.as_str(), Some(at), scopes),
                ChartNode::Connector(connector) => _ = self.add(connector.name.as_str(), Some(at), None),
            }
        }
        let implied = state.transitions.iter().any(|t| t.src.as_ref().is_some_and(|(src, _)| src == INITIAL));
        if implied && !state.children.is_empty() && !self.children.contains_key(&(at, INITIAL)) {
            self.add(INITIAL, Some(at), None);
        }
    }

    fn add(&mut self, name: &'m str, parent: Option<usize>, state: Option<&'m State>) -> usize {
        let at = self.items.len();
        let fqn = match parent {
            Some(parent) => {
                self.children.insert((parent, name), at);
                format!("{}.{name}", self.items[parent].fqn)
            }
            None => name.to_owned(),
        };
        self.items.push(OutlineNode { fqn, name, parent, state });
        at
    }

    /// The child of that name.
    pub fn child(&self, of: usize, name: &str) -> Option<usize> {
        self.children.get(&(of, name)).copied()
    }

    /// The children of a state, in order.
    pub fn children(&self, of: usize) -> impl Iterator<Item = usize> + '_ {
        (of + 1..self.items.len()).filter(move |at| self.items[*at].parent == Some(of))
    }

    /// Whether an item is a state with something in it.
    pub fn is_composite(&self, at: usize) -> bool {
        self.items[at].state.is_some_and(|state| !state.children.is_empty())
    }

    /// What `text` names in a scope: a name of the scope, a path from it (with a leading dot), or a path from the root.
    fn find(&self, scope: usize, text: &str) -> Option<usize> {
        let is_separator = |c: char| c == '.' || c == '\\';
        if !text.contains(is_separator) {
            return self.child(scope, text);
        }
        let start = if text.starts_with('.') { scope } else { 0 };
        let pieces: Vec<&str> = text.trim_matches(is_separator).split(is_separator).collect();
        // A state inside may be called like the outermost one.
        let named = self.child(start, ROOT).is_some();
        let outermost = pieces.iter().take_while(|piece| **piece == ROOT).count();
        let mut rest = pieces[if named { outermost.min(1) } else { outermost }..].iter();
        rest.try_fold(start, |at, piece| self.child(at, piece))
    }
}
