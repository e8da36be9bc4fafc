//! What is no word of SCXML: attributes that it does not have, elements of other languages, text. Nothing is passed over without a word.

use super::{ScxmlReader, is_state, own};
use crate::lang::print::scxml::{OURS, SCXML};
use crate::model::finding::{did_you_mean, nearest};
use crate::model::{Finding, codes};
use roxmltree::Node as Element;
use rustc_hash::FxHashSet;

/// The elements that are read, with their attributes.
const ATTRIBUTES: &[(&str, &[&str])] = &[
    ("scxml", &["initial", "name", "version", "datamodel", "binding", "exmode"]),
    ("state", &["id", "initial"]),
    ("final", &["id"]),
    ("initial", &[]),
    ("transition", &["event", "cond", "target", "type"]),
    ("onentry", &[]),
    ("onexit", &[]),
    (
        "send",
        &[
            "event",
            "eventexpr",
            "target",
            "targetexpr",
            "type",
            "typeexpr",
            "id",
            "idlocation",
            "delay",
            "delayexpr",
            "namelist",
        ],
    ),
    ("cancel", &["sendid", "sendidexpr"]),
    ("log", &["label", "expr"]),
    ("datamodel", &[]),
];

/// Attributes without a counterpart, and what to do instead.
const NONE: &[(&str, &str, &str)] = &[
    ("send", "targetexpr", "write where it is for: `target=\"#_parent\"`"),
    ("send", "typeexpr", "leave it out: events are all that is sent"),
    ("send", "idlocation", "a coordinator has no data: name it with `id`"),
    ("send", "namelist", "an event carries no data here"),
    ("cancel", "sendidexpr", "name what is taken back: `sendid=\"…\"`"),
];

/// What is written beside SCXML in its own namespace, so that a chart comes back as it was.
const OWN: &[&str] = &["semantics", "kind", "config", "doo", "done", "timer", "event", "function", "pn", "order"];

/// The namespace of what Qt's editor notes, also in transitions.
const QT: &str = "http://www.qt.io/2015/02/scxml-ext";

/// The namespace of what puts documents together.
const XINCLUDE: &str = "http://www.w3.org/2001/XInclude";

impl<'t> ScxmlReader<'_, 't> {
    /// Findings for all that is in `root` and means nothing here, in documents of others.
    pub(super) fn strange(&mut self, root: Element<'_, 't>) {
        let mut told: FxHashSet<(String, String)> = FxHashSet::default();
        for element in root.descendants() {
            if element.is_text() {
                self.text(element);
            } else if element.is_element() && element.tag_name().namespace() == Some(SCXML) {
                self.attributes(element);
            } else if element.is_element() {
                self.of_others(element, &mut told);
            }
        }
    }

    /// Misspelt attributes: of SCXML, and of what is written beside it by this program.
    pub(super) fn misspelt(&mut self, root: Element<'_, 't>) {
        for element in root.descendants().filter(Element::is_element) {
            let own = element.attributes().filter(|attribute| attribute.namespace() == Some(OURS));
            for attribute in own.filter(|attribute| !OWN.contains(&attribute.name())) {
                let (key, help) = (attribute.name(), did_you_mean(attribute.name(), "attributes", OWN.iter().copied()));
                let (origin, message) = (self.at_name(attribute), format!("there is no attribute `davit:{key}`"));
                self.cx.report(Finding::error(codes::TEXT_UNKNOWN_KEY, message).at(origin).help(help));
            }
            if element.tag_name().namespace() == Some(SCXML) {
                self.unknown(element);
            }
            if element.tag_name().namespace() == Some(OURS) {
                let message = format!("there is no element `davit:{}`", element.tag_name().name());
                self.report(
                    element,
                    codes::TEXT_UNKNOWN_KEY,
                    message,
                    "what is of `davit:` are attributes: leave it out",
                );
            }
        }
    }

    /// What SCXML forbids, or says nothing of.
    fn forbidden(&mut self, element: Element<'_, 't>) {
        let name = element.tag_name().name();
        let around = element.parent_element();
        let inside = |of: &str| around.is_some_and(|around| around.has_tag_name((SCXML, of)));
        if name == "transition" && inside("final") {
            let help = "make it a `state`, or lead on from the state around it by `done.state.…`";
            self.report(element, codes::TEXT_BAD_VALUE, "`final` has no transitions: with it all ends there", help);
        } else if (is_state(element) || name == "initial") && inside("final") {
            let help = "make it a `state`: what is `final` has no states inside";
            let message = format!("`{name}` stands in a `final`: with that all ends");
            self.report(around.unwrap_or(element), codes::TEXT_BAD_VALUE, message, help);
        } else if name == "transition" && inside("initial") && element.attribute("event").is_some() {
            let help = "leave `event` out: it is taken when the state is entered";
            self.report(element, codes::TEXT_BAD_VALUE, "the transition in `initial` waits for nothing", help);
        } else if name == "transition" && element.attribute("event").is_some_and(|event| event.trim().is_empty()) {
            let help = "name the event, or leave `event` out: then it is taken at once";
            self.report(element, codes::TEXT_BAD_VALUE, "`event` is empty", help);
        }
        let twice = element.attribute("initial").is_some()
            && element.children().any(|child| child.has_tag_name((SCXML, "initial")));
        if twice {
            let message = format!("`{name}` has `initial` twice, as an attribute and as an element");
            self.report(element, codes::TEXT_DUPLICATE_KEY, message, "leave one of them out");
        }
        self.leads_out(element);
        if name == "scxml" && element.attribute("version").is_some_and(|version| version != "1.0") {
            self.report(
                element,
                codes::TEXT_BAD_VALUE,
                "there is no other `version` than 1.0",
                "write `version=\"1.0\"`",
            );
        }
    }

    /// The way into a state that leads out of it.
    fn leads_out(&mut self, element: Element<'_, 't>) {
        // A final state has no way in at all, which is told by itself.
        let full = self.full.get(&element.id()).filter(|_| !element.has_tag_name((SCXML, "final")));
        let Some(full) = full.cloned() else { return };
        let written = inside(element, "initial").into_iter().flat_map(|initial| inside(initial, "transition"));
        let ways = std::iter::once((element, "initial")).chain(written.map(|transition| (transition, "target")));
        for (at, key) in ways.collect::<Vec<_>>() {
            for id in at.attribute(key).unwrap_or_default().split_whitespace() {
                let is_inside = |target: &String| target.strip_prefix(&full).is_some_and(|rest| rest.starts_with('.'));
                // One that there is not is told where it is looked for: in what has states inside.
                let known = self.ids.get(id);
                if known.is_some_and(is_inside) || known.is_none() && element.children().any(is_state) {
                    continue;
                }
                let origin = self.at_value(at, key);
                let name = element.attribute("id").unwrap_or("state");
                let message = format!("`{id}` does not stand inside of `{name}`, which begins with it");
                let help = "name a state inside of it, or leave `initial` out: then it begins with the first one";
                self.cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(origin).help(help));
            }
        }
    }

    /// Attributes that SCXML does not have, or that mean nothing here.
    fn unknown(&mut self, element: Element<'_, 't>) {
        let name = element.tag_name().name();
        let Some((_, known)) = ATTRIBUTES.iter().find(|(of, _)| *of == name) else { return };
        for attribute in element.attributes().filter(|attribute| attribute.namespace().is_none()) {
            let key = attribute.name();
            if let Some((.., help)) = NONE.iter().find(|(of, none, _)| (*of, *none) == (name, key)) {
                self.no_counterpart(element, format!("`{key}` of `{name}` has no counterpart here"), help);
            } else if !known.contains(&key) {
                let help = match OWN.contains(&key) {
                    true => format!("did you mean `davit:{key}`?"),
                    false => did_you_mean(key, "attributes", known.iter().copied()),
                };
                let (origin, message) = (self.at_name(attribute), format!("`{name}` has no attribute `{key}`"));
                self.cx.report(Finding::error(codes::TEXT_UNKNOWN_KEY, message).at(origin).help(help));
            }
        }
    }

    fn attributes(&mut self, element: Element<'_, 't>) {
        self.forbidden(element);
        let name = element.tag_name().name();
        let kind =
            element.attribute("type").filter(|kind| name == "transition" && !["internal", "external"].contains(kind));
        if let Some(kind) = kind {
            let message = format!("`{kind}` is no type of a transition");
            self.report(element, codes::TEXT_BAD_VALUE, message, "write `internal` or `external`, or leave it out");
        }
    }

    /// An element of another language: one that would be carried out, or would bring more, changes what the chart does.
    fn of_others(&mut self, element: Element<'_, 't>, told: &mut FxHashSet<(String, String)>) {
        let (name, space) = (element.tag_name().name(), element.tag_name().namespace().unwrap_or_default());
        let inside = |around: &Element<'_, 't>| around.tag_name().namespace() == Some(SCXML);
        let Some(around) = element.parent_element().filter(inside).filter(|_| ![OURS, QT].contains(&space)) else {
            return;
        };
        if space == XINCLUDE {
            self.no_counterpart(
                element,
                format!("`{name}` brings in another document, which is not read"),
                "put its text here",
            );
        } else if space.is_empty() {
            let help = format!("SCXML's elements have its namespace: `<scxml xmlns=\"{SCXML}\" …>`");
            self.report(element, codes::TEXT_UNKNOWN_KEY, format!("SCXML has no element `{name}`"), &help);
        } else if ["onentry", "onexit", "transition"].contains(&around.tag_name().name())
            && told.insert((space.to_owned(), name.to_owned()))
        {
            let message = format!("`{name}` is of another language (`{space}`): what it would do is not done here");
            let help = "let a component do it, and ask for it by a configuration";
            self.warn(element, codes::SCXML_NO_COUNTERPART, message, help);
        }
    }

    fn text(&mut self, text: Element<'_, 't>) {
        let around = text.parent_element().filter(|around| around.tag_name().namespace() == Some(SCXML));
        let Some(around) =
            around.filter(|around| ATTRIBUTES.iter().any(|(name, _)| around.has_tag_name((SCXML, *name))))
        else {
            return;
        };
        let said = text.text().unwrap_or_default().trim();
        if !said.is_empty() && !around.has_tag_name((SCXML, "log")) {
            let (name, said) = (around.tag_name().name(), said.chars().take(32).collect::<String>());
            let message = format!("text in `{name}` means nothing: `{said}`");
            self.report(around, codes::TEXT_UNKNOWN_KEY, message, "put it into a comment: `<!-- … -->`");
        }
    }

    /// What is sent later by a state belongs to that here: it ends with it.
    pub(super) fn sent_later(&mut self, state: Element<'_, 't>) {
        if self.ours {
            return;
        }
        let blocks = |of| inside(state, of).into_iter();
        let taken_back: FxHashSet<&str> =
            blocks("onexit").flat_map(|block| inside(block, "cancel")).filter_map(|c| c.attribute("sendid")).collect();
        let transitions = blocks("transition").filter_map(|transition| transition.attribute("event"));
        let heard: FxHashSet<&str> = transitions.flat_map(str::split_whitespace).collect();
        let (mut own, mut sent): (FxHashSet<&str>, FxHashSet<&str>) = (FxHashSet::default(), FxHashSet::default());
        for send in blocks("onentry").flat_map(|block| inside(block, "send")) {
            let (Some(event), Some(_)) = (send.attribute("event"), send.attribute("delay")) else { continue };
            own.extend(send.attribute("id"));
            if !sent.insert(event) {
                let message = format!("`{event}` is sent later twice by one state");
                self.no_counterpart(send, message, "give the two events names of their own");
            }
            if send.attribute("target") == Some("#_internal") {
                let message = format!("`{event}` is sent later to `#_internal`, where all comes at once");
                self.no_counterpart(send, message, "leave `target` out: then it comes back later");
            } else if send.attribute("target").is_some() {
                let message = format!("`{event}` is sent later to the outside");
                let help = "send it on the entry of a state that a time event (`e_after`) leads to";
                self.no_counterpart(send, message, help);
            } else if heard.contains(event) && !send.attribute("id").is_some_and(|id| taken_back.contains(id)) {
                self.outlives(state, send, event);
            }
        }
        for send in blocks("onexit").flat_map(|block| inside(block, "send")) {
            if let (Some(event), Some(_)) = (send.attribute("event"), send.attribute("delay")) {
                let message = format!("`{event}` is sent later when the state is left");
                self.no_counterpart(send, message, "send it on the entry of the state that waits for it");
            }
        }
        // In another state it takes back what has ended with this one.
        for cancel in state.descendants().filter(|element| element.has_tag_name((SCXML, "cancel"))) {
            let own = cancel.attribute("sendid").is_some_and(|id| own.contains(id));
            let Some(block) = cancel.parent_element().filter(|_| own) else { continue };
            let leaves = block.has_tag_name((SCXML, "onexit")) || block.has_tag_name((SCXML, "transition"));
            if !(leaves && block.parent_element() == Some(state)) {
                let message = "what is sent later is taken back while the state that sends it goes on";
                self.no_counterpart(
                    cancel,
                    message,
                    "take it back on exit of that state, or send it in a state inside",
                );
            }
        }
    }

    /// That what a state sends later is not taken back when that is left, or under another name.
    fn outlives(&mut self, state: Element<'_, 't>, send: Element<'_, 't>, event: &str) {
        let id = send.attribute("id");
        let sent = |id: &str| {
            let mut all = state.document().root().descendants();
            all.any(|element| element.has_tag_name((SCXML, "send")) && element.attribute("id") == Some(id))
        };
        let slip = |cancel: &Element<'_, 't>| {
            let back = cancel.attribute("sendid").filter(|_| cancel.has_tag_name((SCXML, "cancel")));
            back.is_some_and(|back| nearest(back, id).is_some() && !sent(back))
        };
        let cancel = state.descendants().find(slip);
        let (origin, message, help) = match (cancel, id) {
            (Some(cancel), Some(id)) => {
                let back = cancel.attribute("sendid").unwrap_or_default();
                let message = format!("`{back}` takes nothing back: `{event}` is sent with the id `{id}`");
                (self.at_value(cancel, "sendid"), message, format!("did you mean `{id}`?"))
            }
            _ => {
                let message =
                    format!("`{event}` comes in SCXML also when this state was left; here it ends with the state");
                let gives = if id.is_some() { "" } else { "give it an `id`, and " };
                let id = id.unwrap_or("…");
                let help = format!("{gives}take it back on exit: `<onexit><cancel sendid=\"{id}\"/></onexit>`");
                (self.at(send), message, help)
            }
        };
        self.cx.report(Finding::warning(codes::SCXML_OUTLIVES, message).at(origin).help(help));
    }

    /// Whether an event has a name that means something by itself here, and nothing in SCXML.
    pub(super) fn is_taken(&mut self, element: Element<'_, 't>, event: &str) -> bool {
        let taken = event == "e_done"
            || event.starts_with("e_done@")
            || event.starts_with("e_after(")
            || event.starts_with("e_at(");
        let taken = taken && !self.ours && own(element, "event").is_none();
        if taken {
            let message = format!("`{event}` is no name of an event: here it means a completion, or a time");
            self.report(element, codes::TEXT_BAD_NAME, message, "give the event another name");
        }
        taken
    }
}

/// Whether an element has an attribute that SCXML does not have there.
pub(super) fn has_unknown(element: Element<'_, '_>) -> bool {
    let known = ATTRIBUTES.iter().find(|(of, _)| *of == element.tag_name().name()).map(|(_, known)| *known);
    let own = element.attributes().filter(|attribute| attribute.namespace().is_none());
    known.is_some_and(|known| own.into_iter().any(|attribute| !known.contains(&attribute.name())))
}

/// Events that a state waits for which does not send them itself later: these come from elsewhere.
pub(super) fn from_elsewhere(root: Element<'_, '_>) -> FxHashSet<String> {
    let mut events = FxHashSet::default();
    for transition in root.descendants().filter(|element| element.has_tag_name((SCXML, "transition"))) {
        let Some(state) = transition.parent_element() else { continue };
        let sends = inside(state, "onentry").into_iter().flat_map(|block| inside(block, "send"));
        let later: FxHashSet<&str> =
            sends.filter(|send| send.attribute("delay").is_some()).filter_map(|send| send.attribute("event")).collect();
        let heard = transition.attribute("event").unwrap_or_default().split_whitespace();
        events.extend(heard.filter(|event| !later.contains(event)).map(str::to_owned));
    }
    events
}

/// The elements of SCXML of this name right in another one.
fn inside<'a, 'i>(element: Element<'a, 'i>, name: &str) -> Vec<Element<'a, 'i>> {
    element.children().filter(|child| child.has_tag_name((SCXML, name))).collect()
}
