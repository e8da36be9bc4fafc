//! Where SCXML means more than the words that are the same here: leading pieces of event names, document order, and leaving
//! the state that a transition leads back to.

use super::ScxmlReader;
use crate::limits;
use crate::model::statechart::{ChartNode, ChartTransition, Connector, State, Statechart};
use crate::model::{Ident, Origin, codes};
use roxmltree::Node as Element;
use std::collections::BTreeSet;

/// The names of events in a document, for descriptors that mean several.
#[derive(Debug, Default)]
pub(super) struct EventNames(BTreeSet<String>);

impl EventNames {
    /// Of transitions and of what is sent.
    pub fn of(root: Element<'_, '_>) -> Self {
        let mut names = BTreeSet::new();
        for element in root.descendants() {
            let said = element.attribute("event").unwrap_or_default().split_whitespace();
            names.extend(said.map(|name| name.strip_suffix(".*").unwrap_or(name).to_owned()));
        }
        Self(names)
    }

    /// Names that begin with all pieces of `event`, and have more.
    fn longer<'n>(&'n self, event: &str) -> impl Iterator<Item = &'n str> {
        let (begin, from) = (format!("{event}."), format!("{event}."));
        self.0.range(from..).take_while(move |name| name.starts_with(&begin)).map(String::as_str)
    }
}

impl<'t> ScxmlReader<'_, 't> {
    /// The events that a descriptor means: itself, and the names in the document that begin with it.
    pub(super) fn descriptor(&mut self, element: Element<'_, 't>, event: &str) -> Vec<String> {
        let name = event.strip_suffix(".*").unwrap_or(event);
        let mut meant = vec![name.to_owned()];
        if name.starts_with("done.state.") {
            return meant;
        }
        meant.extend(self.names.longer(name).take(limits::SCXML_NAMES).map(str::to_owned));
        let too_many = self.names.longer(name).nth(limits::SCXML_NAMES).is_some();
        let added: Vec<String> = meant[1..].iter().take(3).map(|name| format!("`{name}`")).collect();
        let added = match meant.len() - 1 {
            0 => String::new(),
            1..=3 => format!(" {} of this document is added;", added.join(", ")),
            more => format!(" {} and {} more of this document are added;", added.join(", "), more - added.len()),
        };
        if name != event || meant.len() > 1 {
            let rest = if too_many { "not all names of this document were" } else { "no other name is meant" };
            let message = format!("`{event}` also means all names that begin with `{name}.` in SCXML:{added} {rest}");
            self.warn(element, codes::SCXML_PREFIX, message, "here names are compared whole: list every event");
        }
        meant
    }

    /// The node to go to for going from inside of `target` to it: SCXML leaves the state and enters it again, here it would
    /// not be left. A connector beside it has that effect.
    pub(super) fn again(&mut self, target: &str) -> String {
        if let Some(known) = self.again.get(target) {
            return known.clone();
        }
        let taken = |name: &str| self.full.values().chain(self.again.values()).any(|full| full == name);
        let names = (1..).map(|n| if n == 1 { format!("{target}_again") } else { format!("{target}_again_{n}") });
        let name = names.into_iter().find(|name| !taken(name)).unwrap_or_default();
        self.again.insert(target.to_owned(), name.clone());
        name
    }

    /// Puts those connectors into the chart.
    pub(super) fn connectors(&self, chart: &mut Statechart, origin: Origin) {
        for (target, connector) in &self.again {
            let Some((scope, name)) = connector.rsplit_once('.') else { continue };
            let (Some(scope), Ok(ident)) = (find(&mut chart.root, scope), Ident::new(name)) else { continue };
            scope.children.push(ChartNode::Connector(Connector { name: ident, doc: None, origin }));
            let mut transition = ChartTransition::new(name, target, []);
            transition.origin = origin;
            scope.transitions.push(transition);
        }
    }

    /// Four and more transitions of one state and one priority are tried in another order than the written one (rFSM's sort
    /// is not stable). Where more than one of them can be meant they get priorities.
    pub(super) fn in_document_order(&self, list: &mut [ChartTransition]) {
        if self.ours {
            return;
        }
        let given = list.iter().any(|transition| transition.pn != 0.0);
        if list.len() < if given { 3 } else { 4 } || !several_are_meant(list) {
            return;
        }
        let mut order: Vec<usize> = (0..list.len()).collect();
        order.sort_by(|a, b| list[*b].pn.total_cmp(&list[*a].pn));
        for (rank, at) in order.into_iter().rev().enumerate() {
            #[allow(clippy::cast_precision_loss)] // as many as there are transitions
            let pn = rank as f64;
            list[at].pn = pn;
        }
    }
}

/// Whether one event can start two of them.
fn several_are_meant(list: &[ChartTransition]) -> bool {
    let mut seen = BTreeSet::new();
    list.iter().any(|transition| {
        let own: BTreeSet<String> = transition.events.iter().map(|(trigger, _)| trigger.to_string()).collect();
        let again = own.is_empty() || own.iter().any(|trigger| seen.contains(trigger));
        seen.extend(own);
        again
    })
}

fn find<'s>(root: &'s mut State, fqn: &str) -> Option<&'s mut State> {
    let mut at = root;
    for piece in fqn.split('.').skip(1) {
        at = at.children.iter_mut().find_map(|child| match child {
            ChartNode::State(state) if state.name.as_str() == piece => Some(state),
            _ => None,
        })?;
    }
    Some(at)
}
