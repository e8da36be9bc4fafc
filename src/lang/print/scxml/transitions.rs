//! Transitions: where they go, on what, and in which order.

use super::{ScxmlWriter, plain_event, quoted};
use crate::model::Origin;
use crate::model::outline::{Outline, OutlineTransition};
use crate::model::statechart::{Action, ChartTransition, FunctionId, INITIAL, Trigger};
use crate::statechart::sort_by_priority;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The state that is entered by going to a node: itself, or the one whose initial connector it is.
fn entered(outline: &Outline<'_>, tgt: usize) -> Option<usize> {
    let item = &outline.items[tgt];
    match item.state {
        Some(_) => outline.is_composite(tgt).then_some(tgt),
        None => item.parent.filter(|_| item.name == INITIAL),
    }
}

fn is_inside(outline: &Outline<'_>, node: usize, state: usize) -> bool {
    let mut at = outline.items[node].parent;
    while let Some(around) = at.filter(|around| *around != state) {
        at = outline.items[around].parent;
    }
    at.is_some()
}

/// Composite states that a transition from inside goes to. In rFSM such a state is not left, in SCXML it is; going to a state
/// in it is the same in both. So its initial connector is written as a state.
pub fn entered_from_inside(outline: &Outline<'_>) -> BTreeSet<usize> {
    let within =
        |link: &OutlineTransition<'_>| entered(outline, link.tgt).filter(|state| is_inside(outline, link.src, *state));
    outline.links.iter().filter_map(within).collect()
}

/// The event of a trigger of a state, by its whole name.
pub fn event_name(trigger: &Trigger, fqn: &str) -> Option<String> {
    match trigger {
        Trigger::Event(name) if name.as_str() == "e_done" => Some(format!("e_done@{fqn}")),
        Trigger::Event(name) => Some(name.to_string()),
        Trigger::Timed(timed) => Some(timed.event_of(fqn)),
        Trigger::Predicate(_) => None,
    }
}

/// What starts a transition: events by their plain names and as written, and a condition that only functions can decide.
struct Start {
    plain: Vec<String>,
    written: Vec<String>,
    /// Calls that must all say yes, as terms of ECMAScript; each the name of the function with the term.
    calls: Vec<(String, String)>,
}

impl ScxmlWriter<'_> {
    /// The id to go to for going from `src` to `tgt`.
    pub(super) fn target(&self, src: usize, tgt: usize) -> String {
        let outline = self.outline;
        let fqn = |at: usize| outline.items[at].fqn.clone();
        let Some(state) = entered(outline, tgt) else { return fqn(tgt) };
        let initial = outline.child(state, INITIAL);
        match initial {
            Some(initial) if is_inside(outline, src, state) => fqn(initial),
            // Folded into `<initial>`, the connector has no id of its own.
            _ if tgt != state && self.simple_initial(state).is_some() => fqn(state),
            _ => fqn(tgt),
        }
    }

    pub(super) fn transitions(&mut self, at: usize, depth: usize) {
        let outline = self.outline;
        let mut tried: Vec<(usize, &OutlineTransition<'_>)> =
            outline.links.iter().filter(|link| link.src == at).enumerate().collect();
        sort_by_priority(&mut tried, |(_, link)| link.transition.pn);
        let moved = tried.iter().enumerate().any(|(now, (written, _))| now != *written);
        for (number, link) in tried {
            for start in self.starts(at, link.transition) {
                let mut attributes = self.condition(at, depth, &start);
                if link.transition.pn != 0.0 {
                    let _ = write!(attributes, " davit:pn=\"{}\"", link.transition.pn);
                }
                if moved {
                    let _ = write!(attributes, " davit:order=\"{number}\"");
                }
                let _ = write!(attributes, " target=\"{}\"", quoted(&self.target(link.src, link.tgt)));
                self.transition(depth, &attributes, &link.transition.effect);
            }
        }
    }

    /// A transition's ways to start. One on events and on predicates is written as two.
    fn starts(&self, at: usize, transition: &ChartTransition) -> Vec<Start> {
        let fqn = &self.outline.items[at].fqn;
        let guard = transition.guard.map(|(id, _)| (format!("guard_{}", id.0), format!("guard_{}()", id.0)));
        let start = || Start { plain: Vec::new(), written: Vec::new(), calls: guard.iter().cloned().collect() };
        let (mut named, mut predicates): (Start, Vec<FunctionId>) = (start(), Vec::new());
        for (trigger, _) in &transition.events {
            if let Trigger::Predicate(id) = trigger {
                predicates.push(*id);
            }
            let Some(name) = event_name(trigger, fqn) else { continue };
            named.plain.push(plain_event(&name));
            named.written.push(trigger.to_string());
        }
        let mut starts = Vec::new();
        if !named.plain.is_empty() || predicates.is_empty() {
            starts.push(named);
        }
        for id in predicates {
            let mut one = start();
            one.calls.push((format!("predicate_{}", id.0), format!("predicate_{}(_event)", id.0)));
            starts.push(one);
        }
        starts
    }

    /// The attributes that say when, after remarks on what is not defined.
    fn condition(&mut self, at: usize, depth: usize, start: &Start) -> String {
        let connector = self.outline.items[at].state.is_none();
        let Start { plain, written, calls } = start;
        let mut attributes = String::new();
        let mut terms: Vec<String> = Vec::new();
        if connector && !plain.is_empty() {
            let names: Vec<String> = plain.iter().map(|name| format!("'{name}'")).collect();
            terms.push(format!("[{}].indexOf(_event.name) >= 0", names.join(",")));
        } else if !connector {
            let event = if plain.is_empty() { "*".to_owned() } else { plain.join(" ") };
            let _ = write!(attributes, " event=\"{}\"", quoted(&event));
        }
        for (name, call) in calls {
            self.undefined(depth, name, "until then this is not taken");
            terms.push(call.clone());
        }
        if !terms.is_empty() {
            let _ = write!(attributes, " cond=\"{}\"", quoted(&terms.join(" && ")));
        }
        if !calls.is_empty() {
            attributes.push_str(" davit:function=\"true\"");
        }
        if plain != written || connector && !written.is_empty() {
            let _ = write!(attributes, " davit:event=\"{}\"", quoted(&written.join(" ")));
        }
        attributes
    }

    pub(super) fn transition(&mut self, depth: usize, attributes: &str, effect: &[(Action, Origin)]) {
        if effect.is_empty() {
            return self.line(depth, &format!("<transition{attributes}/>"));
        }
        self.line(depth, &format!("<transition{attributes}>"));
        self.actions(depth + 1, effect);
        self.line(depth, "</transition>");
    }
}
