//! What is done on entry, on exit and by transitions, and everything that has no counterpart here.

use super::transition::seconds;
use super::{ScxmlReader, is_state, own};
use crate::lang::print::scxml::SCXML;
use crate::model::finding::did_you_mean;
use crate::model::statechart::Action;
use crate::model::{EventName, Origin, codes};
use roxmltree::Node as Element;
use std::collections::BTreeMap;

/// Elements without a counterpart here, and what to do instead.
pub(super) const NO_COUNTERPART: &[(&str, &str)] = &[
    ("parallel", "write a coordinator for each region and let them run side by side (`coordinators:`)"),
    ("history", "a state is always entered by its initial transition: name the state to return to"),
    ("data", "a coordinator has no data: let a component or a monitor raise an event instead"),
    ("assign", "a coordinator has no data: let a component or a monitor raise an event instead"),
    ("script", "a coordinator runs no code: let a component do it, and ask for it by a configuration"),
    ("invoke", "name a configuration that creates what is to run (`config`)"),
    ("finalize", "a coordinator invokes nothing"),
    ("if", "use a connector with a transition for each case"),
    ("elseif", "use a connector with a transition for each case"),
    ("else", "use a connector with a transition for each case"),
    ("foreach", "a coordinator runs no code: raise the names one after the other"),
    ("raise", "an event raised by the chart does not come back to it: go to the state that is meant"),
    ("donedata", "an event carries no data here"),
    ("param", "an event carries no data here"),
    ("content", "an event carries no data here"),
];

/// Elements that are read.
const KNOWN: &[&str] =
    &["scxml", "state", "final", "initial", "transition", "onentry", "onexit", "send", "cancel", "log", "datamodel"];

impl<'t> ScxmlReader<'_, 't> {
    /// What is raised, and what is sent later with its seconds.
    pub(super) fn actions(&mut self, block: Element<'_, 't>) -> (Vec<(Action, Origin)>, BTreeMap<String, f64>) {
        let (mut actions, mut later) = (Vec::new(), BTreeMap::new());
        for element in block.children().filter(Element::is_element) {
            if element.has_tag_name((SCXML, "raise")) && own(element, "done").is_some()
                || !element.has_tag_name((SCXML, "send"))
            {
                self.other(element, false);
                continue;
            }
            let computed = element.attribute("delayexpr").is_some();
            if own(element, "config").is_some() || (own(element, "timer").is_some() && !computed) {
                continue;
            }
            let Some(event) = element.attribute("event") else {
                let help = "write the event's name: `<send event=\"e_ready\" target=\"#_parent\"/>`";
                self.no_counterpart(element, "an event without a fixed name", help);
                continue;
            };
            if let Some(delay) = element.attribute("delay") {
                match seconds(delay) {
                    Some(seconds) => _ = later.insert(event.to_owned(), seconds),
                    None => self.report(
                        element,
                        codes::TEXT_BAD_VALUE,
                        format!("`{delay}` is not a time"),
                        "write `0.5s` or `500ms`",
                    ),
                }
                continue;
            }
            if computed {
                self.no_counterpart(element, "a delay that is computed", "write the time: `delay=\"0.5s\"`");
                continue;
            }
            match element.attribute("target") {
                None => {
                    let message = format!("`{event}` comes back to the chart in SCXML; here it only leaves it");
                    self.warn(
                        element,
                        codes::SCXML_SENT_HOME,
                        message,
                        "write `target=\"#_parent\"` if it is for the outside; if the chart is to go on by it, leave `event` out where \
                         that is waited for",
                    );
                }
                Some("#_internal") => {
                    self.other(element, true);
                    continue;
                }
                Some(_) => {}
            }
            let origin = self.at(element);
            match EventName::new(event) {
                Ok(name) => actions.push((Action::Raise(name), origin)),
                Err(error) => {
                    self.report(element, codes::TEXT_BAD_NAME, error.to_string(), "write the name of an event")
                }
            }
            self.others(element);
        }
        (actions, later)
    }

    /// Findings for everything in `element` that is not read.
    pub(super) fn others(&mut self, element: Element<'_, 't>) {
        for child in element.children().filter(Element::is_element) {
            self.other(child, false);
        }
    }

    fn other(&mut self, element: Element<'_, 't>, to_itself: bool) {
        let name = element.tag_name().name();
        if element.tag_name().namespace() != Some(SCXML) || own(element, "done").is_some() {
            return;
        }
        let name_sought = if to_itself { "raise" } else { name };
        if let Some((_, help)) = NO_COUNTERPART.iter().find(|(none, _)| *none == name_sought) {
            self.no_counterpart(element, format!("`{name}` has no counterpart here"), help);
        } else if name == "datamodel" {
            self.others(element);
        } else if !KNOWN.contains(&name) {
            let help = did_you_mean(name, "elements", KNOWN.iter().copied());
            self.report(element, codes::TEXT_UNKNOWN_KEY, format!("SCXML has no element `{name}`"), &help);
        }
    }

    /// Where SCXML would decide otherwise: an event for which a state and one around it both have a transition.
    pub(super) fn doubts(&mut self, element: Element<'_, 't>, around: &mut Vec<Vec<String>>) {
        for child in element.children().filter(|child| is_state(*child)) {
            let transitions = child.children().filter(|c| c.has_tag_name((SCXML, "transition")));
            let mut own: Vec<String> = Vec::new();
            for transition in transitions {
                if transition.attribute("event").is_none() {
                    if around.iter().flatten().any(String::is_empty) {
                        let message = "here and in a state around a transition needs no event: here the outer one wins, in SCXML \
                                       the inner one";
                        let help = "let one of the two wait for an event";
                        self.warn(transition, codes::SCXML_PRIORITY, message.to_owned(), help);
                    }
                    own.push(String::new());
                }
                for event in transition.attribute("event").unwrap_or_default().split_whitespace() {
                    let both = around.iter().flatten().any(|outer| !outer.is_empty() && overlap(outer, event));
                    if both {
                        let message = format!(
                            "`{event}` is waited for here and in a state around: here the outer one wins, in SCXML the inner one"
                        );
                        self.warn(
                            transition,
                            codes::SCXML_PRIORITY,
                            message,
                            "give the two transitions different events",
                        );
                    }
                    own.push(event.to_owned());
                }
            }
            around.push(own);
            self.doubts(child, around);
            around.pop();
        }
    }
}

/// Whether one event can match both descriptors, by SCXML's rule of leading pieces.
fn overlap(a: &str, b: &str) -> bool {
    let pieces =
        |text: &'_ str| -> Vec<String> { text.split('.').filter(|piece| *piece != "*").map(str::to_owned).collect() };
    pieces(a).iter().zip(&pieces(b)).all(|(a, b)| a == b)
}
