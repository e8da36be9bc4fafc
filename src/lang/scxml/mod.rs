//! SCXML → statechart, for the part of SCXML that has a meaning here; every element that has none is a finding of its own.
//!
//! States, `<final>`, `<initial>`, transitions on events, `<send>` to the outside and delayed sends as time events are read.
//! What [`super::print::scxml`] wrote comes back as the same chart. Hostile documents: no DTD (so no entities), bounded
//! nesting, a bounded number of nodes, and the size of any file.

mod content;
mod contradicted;
mod meaning;
mod places;
mod strange;
mod transition;

use super::print::scxml::{OURS, SCXML};
use super::tree::{Cx, Reading};
use crate::limits;
use crate::model::statechart::{ChartNode, ChartTransition, Connector, INITIAL, ROOT, State, Statechart};
use crate::model::{Code, ConfigId, Finding, Ident, Origin, codes};
use meaning::EventNames;
use places::{LineIndex, TooMuch, too_much};
use roxmltree::{Attribute, Document, Node as Element, ParsingOptions};
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeMap;
use std::ops::Range;

/// Reads an SCXML document.
pub fn read(cx: &mut Cx, reading: Reading) -> Option<Statechart> {
    let text = cx.sources.file(reading.file).text.clone();
    if let Some((what, offset)) = too_much(&text) {
        let origin = LineIndex::new(reading, &text).place(cx, offset, 1);
        let (code, message, help) = match what {
            TooMuch::Deep => (
                codes::TEXT_TOO_DEEP,
                format!("elements are nested more than {} deep", limits::XML_DEPTH),
                "a statechart has a handful of levels",
            ),
            TooMuch::Attributes => (
                codes::TEXT_TOO_MANY_NODES,
                format!("an element has more than {} attributes", limits::XML_ATTRIBUTES),
                "an element of a statechart has a handful of them",
            ),
            TooMuch::Namespaces => (
                codes::TEXT_TOO_MANY_NODES,
                format!("more than {} namespaces are declared", limits::XML_NAMESPACES),
                "declare each once, at the outermost element",
            ),
        };
        cx.refuse(Finding::error(code, message).at(origin).help(help));
        return None;
    }
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: u32::try_from(limits::TEXT_NODES).unwrap_or(u32::MAX),
        ..ParsingOptions::default()
    };
    let document = match Document::parse_with_options(&text, options) {
        Ok(document) => document,
        Err(error) => {
            let (code, help) = match error {
                roxmltree::Error::DtdDetected => {
                    (codes::TEXT_SYNTAX, "leave out the `<!DOCTYPE …>`: entities are not read")
                }
                roxmltree::Error::NodesLimitReached => (codes::TEXT_TOO_MANY_NODES, "split the chart"),
                _ => (codes::TEXT_SYNTAX, "an SCXML document is well-formed XML"),
            };
            let pos = error.pos();
            let origin = cx.sources.exact(reading.file, pos.row, pos.col.saturating_sub(1), 1);
            cx.refuse(Finding::error(code, format!("not XML that is read here: {error}")).at(origin).help(help));
            return None;
        }
    };
    let mut reader = ScxmlReader {
        cx,
        places: LineIndex::new(reading, &text),
        ids: BTreeMap::new(),
        full: FxHashMap::default(),
        finals: FxHashMap::default(),
        ours: false,
        names: EventNames::default(),
        elsewhere: FxHashSet::default(),
        again: BTreeMap::new(),
    };
    reader.document(document.root_element())
}

struct ScxmlReader<'c, 't> {
    cx: &'c mut Cx,
    places: LineIndex<'t>,
    /// Full names of the states by their ids.
    ids: BTreeMap<String, String>,
    /// The same by their elements, which need no id.
    full: FxHashMap<roxmltree::NodeId, String>,
    /// Full names of the final children of a state, by its id.
    finals: FxHashMap<String, Vec<String>>,
    /// Written by us: the meaning is rFSM's already.
    ours: bool,
    /// All names of events, in documents of others.
    names: EventNames,
    /// Events that come from elsewhere than from the time that a state sends them at.
    elsewhere: FxHashSet<String>,
    /// Connectors that leave a state and enter it again, by the full name of the state.
    again: BTreeMap<String, String>,
}

fn own<'a>(element: Element<'a, '_>, name: &str) -> Option<&'a str> {
    element.attribute((OURS, name))
}

fn is_state(element: Element<'_, '_>) -> bool {
    ["state", "final", "parallel", "history"].iter().any(|name| element.has_tag_name((SCXML, *name)))
}

impl<'t> ScxmlReader<'_, 't> {
    fn at(&mut self, element: Element<'_, 't>) -> Origin {
        let start = element.range().start;
        let length = element.tag_name().name().chars().count() + 1;
        self.places.place(self.cx, start, u32::try_from(length).unwrap_or(1))
    }

    /// The name of an attribute.
    fn at_name(&mut self, attribute: Attribute<'_, 't>) -> Origin {
        self.at_range(attribute.range_qname())
    }

    /// What an attribute of an element says; the element, where it has none.
    fn at_value(&mut self, element: Element<'_, 't>, key: &str) -> Origin {
        match element.attribute_node(key) {
            Some(attribute) => self.at_range(attribute.range_value()),
            None => self.at(element),
        }
    }

    fn at_range(&mut self, range: Range<usize>) -> Origin {
        let length = self.places.text(range.clone()).chars().count().max(1);
        self.places.place(self.cx, range.start, u32::try_from(length).unwrap_or(1))
    }

    fn report(&mut self, element: Element<'_, 't>, code: Code, message: impl Into<String>, help: &str) {
        let origin = self.at(element);
        self.cx.report(Finding::error(code, message).at(origin).help(help));
    }

    fn no_counterpart(&mut self, element: Element<'_, 't>, message: impl Into<String>, help: &str) {
        self.report(element, codes::SCXML_NO_COUNTERPART, message, help);
    }

    fn warn(&mut self, element: Element<'_, 't>, code: Code, message: String, help: &str) {
        let origin = self.at(element);
        self.cx.report(Finding::warning(code, message).at(origin).help(help));
    }

    fn document(&mut self, root: Element<'_, 't>) -> Option<Statechart> {
        if !root.has_tag_name((SCXML, "scxml")) {
            let message = match root.tag_name().name() {
                "scxml" => "`scxml` does not name SCXML's namespace".to_owned(),
                name => format!("the outermost element is `{name}`, not SCXML's `scxml`"),
            };
            self.report(
                root,
                codes::TEXT_NOTHING,
                message,
                &format!("write `<scxml xmlns=\"{SCXML}\" version=\"1.0\">`"),
            );
            return None;
        }
        self.ours = own(root, "semantics") == Some("rfsm");
        let outermost =
            root.children().find(|child| child.has_tag_name((SCXML, "state")) && child.attribute("id") == Some(ROOT));
        // Ours has the root as a state; others begin with what is in it.
        let top = outermost.filter(|_| self.ours).unwrap_or(root);
        if self.ours {
            self.ids.insert(ROOT.to_owned(), ROOT.to_owned());
        }
        self.name_all(top, ROOT);
        self.misspelt(root);
        if !self.ours {
            self.elsewhere = strange::from_elsewhere(root);
            self.names = EventNames::of(root);
            self.strange(root);
        }
        let mut state = self.state(top, ROOT, Ident::new(ROOT).ok()?);
        if top != root {
            self.others(root);
        }
        if state.children.is_empty() && !crate::model::finding::has_errors(&self.cx.findings) {
            self.report(
                root,
                codes::TEXT_NOTHING,
                "there is no state in this document",
                "write `<state id=\"idle\"/>`",
            );
        }
        state.origin = self.at(root);
        if !self.ours {
            self.doubts(top, &mut Vec::new());
        }
        let origin = state.origin;
        let mut chart = Statechart::new(state);
        self.connectors(&mut chart, origin);
        Some(chart)
    }

    /// Gives every state its full name.
    fn name_all(&mut self, element: Element<'_, 't>, fqn: &str) {
        let around = element.attribute("id").map(|id| format!("{id}."));
        for (number, child) in element.children().filter(|child| is_state(*child)).enumerate() {
            let id = child.attribute("id").map_or_else(|| format!("state_{}", number + 1), str::to_owned);
            let name = around.as_ref().and_then(|around| id.strip_prefix(around)).unwrap_or(&id).to_owned();
            if let Err(error) = Ident::new(&name) {
                let message = format!("`{id}` is not the name of a state: {}", error.reason);
                self.report(
                    child,
                    codes::TEXT_BAD_NAME,
                    message,
                    "use letters, digits and `_`, and begin with a letter",
                );
            }
            let full = format!("{fqn}.{name}");
            let key = if child.attribute("id").is_some() { id } else { full.clone() };
            if self.ids.insert(key.clone(), full.clone()).is_some() {
                self.report(
                    child,
                    codes::TEXT_DUPLICATE_KEY,
                    format!("two states have the id `{key}`"),
                    "give one of them another id",
                );
            }
            if child.has_tag_name((SCXML, "final")) {
                self.finals.entry(element.attribute("id").unwrap_or(ROOT).to_owned()).or_default().push(full.clone());
            }
            self.full.insert(child.id(), full.clone());
            self.name_all(child, &full);
        }
    }

    fn state(&mut self, element: Element<'_, 't>, fqn: &str, name: Ident) -> State {
        let mut state = State::new(name);
        state.origin = self.at(element);
        let mut delayed = BTreeMap::new();
        for child in element.children().filter(Element::is_element) {
            if child.has_tag_name((SCXML, "onentry")) {
                let (actions, timers) = self.actions(child);
                state.entry.extend(actions);
                delayed.extend(timers);
            } else if child.has_tag_name((SCXML, "onexit")) {
                state.exit.extend(self.actions(child).0);
            }
        }
        self.sent_later(element);
        for id in own(element, "config").unwrap_or_default().split_whitespace() {
            match ConfigId::new(id) {
                Ok(id) => state.config.push((id, state.origin)),
                Err(error) => self.report(element, codes::TEXT_BAD_NAME, error.to_string(), "name a configuration"),
            }
        }
        let around: Vec<Element<'_, 't>> = element.children().filter(|child| is_state(*child)).collect();
        if !around.is_empty() {
            self.initial(element, fqn, &around, &mut state);
        }
        for child in element.children().filter(Element::is_element) {
            if child.has_tag_name((SCXML, "state")) || child.has_tag_name((SCXML, "final")) {
                self.child(child, &mut state);
            }
        }
        self.others(element);
        if fqn == ROOT {
            for child in element.children().filter(|c| c.has_tag_name((SCXML, "transition"))) {
                self.no_counterpart(child, "the outermost state has no transitions", "write it at a state inside");
            }
        }
        let transitions = element.children().filter(|c| c.has_tag_name((SCXML, "transition")));
        let heard: FxHashSet<&str> =
            transitions.filter_map(|c| c.attribute("event")).flat_map(str::split_whitespace).collect();
        for event in delayed.keys() {
            if !heard.contains(event.as_str()) {
                let message = format!("`{event}` is sent later, and no transition of this state waits for it");
                self.no_counterpart(
                    element,
                    message,
                    "a time event (`e_after`) belongs to a transition of the state itself",
                );
            }
        }
        state
    }

    /// A child with its transitions, which stand in the scope around it.
    fn child(&mut self, element: Element<'_, 't>, state: &mut State) {
        let full = self.full.get(&element.id()).cloned();
        let Some(full) = full else { return };
        let Some(name) = full.rsplit('.').next().and_then(|name| Ident::new(name).ok()) else { return };
        let delays = self.delays(element);
        let mut read: Vec<(usize, ChartTransition)> = Vec::new();
        for (place, transition) in element.children().filter(|c| c.has_tag_name((SCXML, "transition"))).enumerate() {
            // Ours stand in the order in which they are tried; this is where they were written.
            let written = own(transition, "order").and_then(|order| order.parse().ok()).filter(|_| self.ours);
            let one = self.transition(transition, name.as_str(), &full, element, &delays);
            read.extend(one.map(|one| (written.unwrap_or(place), one)));
        }
        read.sort_by_key(|(place, _)| *place);
        let mut list: Vec<ChartTransition> = read.into_iter().map(|(_, transition)| transition).collect();
        self.times_agree(element, &full, &list);
        self.in_document_order(&mut list);
        state.transitions.extend(list);
        if own(element, "doo").is_some() {
            self.no_counterpart(
                element,
                "an activity that was left out",
                "read the coordinator from the Lua file that has it",
            );
        }
        if own(element, "kind") == Some("connector") {
            let origin = self.at(element);
            state.children.push(ChartNode::Connector(Connector { name, doc: None, origin }));
            return;
        }
        let inner = self.state(element, &full, name);
        state.children.push(ChartNode::State(inner));
    }

    /// The way in: `<initial>`, the attribute, or the first state written.
    fn initial(&mut self, element: Element<'_, 't>, fqn: &str, inside: &[Element<'_, 't>], state: &mut State) {
        let written = element.children().find(|c| c.has_tag_name((SCXML, "initial")));
        let transition = written.and_then(|i| i.children().find(|c| c.has_tag_name((SCXML, "transition"))));
        if let Some(transition) = transition {
            let read = self.transition(transition, INITIAL, fqn, element, &BTreeMap::new());
            state.transitions.extend(read);
            return;
        }
        if let Some(written) = written {
            self.report(
                written,
                codes::TEXT_MISSING_KEY,
                "`initial` holds no transition",
                "write `<transition target=\"…\"/>` in it",
            );
            return;
        }
        let named =
            element.attribute("initial").filter(|_| fqn != ROOT || element.has_tag_name((SCXML, "scxml")) || self.ours);
        let target = match named {
            Some(ids) => self.one_target(element, "initial", ids),
            None if self.ours => return,
            None => inside.first().and_then(|first| self.full.get(&first.id()).cloned()),
        };
        // Ours, when it is a connector: it is called `initial`, and its transitions stand with it.
        if let Some(target) = target.filter(|target| *target != format!("{fqn}.{INITIAL}")) {
            let mut transition = ChartTransition::new(INITIAL, &target, []);
            transition.origin = self.at(element);
            state.transitions.insert(0, transition);
        }
    }
}
