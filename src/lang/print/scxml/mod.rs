//! Printing a coordinator as SCXML (W3C, 2015).
//!
//! The meaning is kept as far as SCXML can hold it; what it has no word for stands in attributes of our own namespace,
//! which other interpreters ignore and [`crate::lang`] reads back, so that nothing is lost on the way there and back:
//!
//! * names raised are `<send target="#_parent">`: they leave the chart and do not come back by themselves;
//! * the completion of a leaf is an internal event, raised last on its entry;
//! * a time event is a delayed `<send>`, cancelled on exit; `e_at` counts from the clock's start, which SCXML does not know;
//! * connectors are states with transitions that have a condition on the event, decided one after the other, not beforehand;
//! * **the outermost state wins in rFSM, the innermost in SCXML**, and priority numbers order only one state's transitions;
//! * a transition to a state around its source stays inside that state here, and leaves it in SCXML: it goes to the initial
//!   connector, which is then written as one;
//! * transitions stand in the order in which they are tried;
//! * functions are left out: a comment stands for what they do, and for a condition the call of a function that nobody has
//!   defined, so that the transition is not taken. A state with a `doo` does not complete.

mod transitions;

pub use transitions::event_name;

use crate::model::Origin;
use crate::model::outline::{Outline, OutlineTransition};
use crate::model::statechart::{Action, FunctionId, INITIAL, Since, Statechart, Trigger};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// The namespace of SCXML.
pub const SCXML: &str = "http://www.w3.org/2005/07/scxml";
/// The namespace of what SCXML has no word for.
pub const OURS: &str = "urn:davit:scxml:1";

/// The chart as an SCXML document.
pub fn coordinator_scxml(chart: &Statechart) -> String {
    let outline = Outline::of(chart);
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(
        out,
        "<scxml xmlns=\"{SCXML}\" xmlns:davit=\"{OURS}\" version=\"1.0\" datamodel=\"ecmascript\" davit:semantics=\"rfsm\" initial=\"root\">"
    );
    out.push_str(
        "  <!-- Written by davit. Of transitions that one event enables in several active states, the outermost is meant;\n       \
         SCXML takes the innermost. What is sent to #_parent is a request or an event for the outside. -->\n",
    );
    let entered_from_inside = transitions::entered_from_inside(&outline);
    let mut writer = ScxmlWriter { out: &mut out, outline: &outline, entered_from_inside };
    writer.node(0, 1);
    out.push_str("</scxml>\n");
    out
}

/// A text inside an attribute's quotes.
fn quoted(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// An event's name in the characters that SCXML allows in one.
pub fn plain_event(name: &str) -> String {
    let plain = |c: char| if c.is_alphanumeric() || matches!(c, '_' | '-' | '.') { c } else { '.' };
    let text: String = name.chars().map(plain).collect();
    text.split('.').filter(|piece| !piece.is_empty()).collect::<Vec<_>>().join(".")
}

struct ScxmlWriter<'a> {
    out: &'a mut String,
    outline: &'a Outline<'a>,
    /// Composite states that a transition from inside goes to.
    entered_from_inside: BTreeSet<usize>,
}

impl ScxmlWriter<'_> {
    fn line(&mut self, depth: usize, text: &str) {
        let _ = writeln!(self.out, "{}{text}", "  ".repeat(depth));
    }

    fn links(&self, of: usize) -> Vec<OutlineTransition<'_>> {
        self.outline.links.iter().filter(|link| link.src == of).cloned().collect()
    }

    /// The one transition of an initial connector that needs no event: then `<initial>` says it.
    fn simple_initial(&self, at: usize) -> Option<OutlineTransition<'_>> {
        let initial = self.outline.child(at, INITIAL).filter(|i| self.outline.items[*i].state.is_none())?;
        if self.entered_from_inside.contains(&at) {
            return None;
        }
        match &self.links(initial)[..] {
            [one] if one.transition.events.is_empty() && one.transition.guard.is_none() => Some(one.clone()),
            _ => None,
        }
    }

    fn node(&mut self, at: usize, depth: usize) {
        let outline = self.outline;
        let item = &outline.items[at];
        let composite = outline.is_composite(at);
        let initial =
            self.simple_initial(at).map(|link| (self.target(link.src, link.tgt), link.transition.effect.clone()));
        let mut head = format!("<state id=\"{}\"", quoted(&item.fqn));
        let Some(state) = item.state else {
            self.line(depth, &format!("{head} davit:kind=\"connector\">"));
            self.transitions(at, depth + 1);
            return self.line(depth, "</state>");
        };
        if composite && initial.is_none() && outline.child(at, INITIAL).is_some() {
            let _ = write!(head, " initial=\"{}.{INITIAL}\"", quoted(&item.fqn));
        }
        if !state.config.is_empty() {
            let ids: Vec<&str> = state.config.iter().map(|(id, _)| id.as_str()).collect();
            let _ = write!(head, " davit:config=\"{}\"", ids.join(" "));
        }
        if state.doo.is_some() {
            head.push_str(" davit:doo=\"true\"");
        }
        self.line(depth, &format!("{head}>"));
        if let Some((target, effect)) = initial {
            self.line(depth + 1, "<initial>");
            self.transition(depth + 2, &format!(" target=\"{}\"", quoted(&target)), &effect);
            self.line(depth + 1, "</initial>");
        }
        let timers = self.timers(at);
        let configs: Vec<&str> = state.config.iter().map(|(id, _)| id.as_str()).collect();
        // In a block of its own, and first: of what stands behind something that cannot be sent, since there is no parent, an interpreter does
        // nothing more.
        if !timers.is_empty() || !composite {
            self.line(depth + 1, "<onentry>");
            for (event, delay) in &timers {
                let event = quoted(event);
                let delay = match delay {
                    Delay::Seconds(seconds) => format!("delay=\"{seconds}s\""),
                    Delay::By(function) => {
                        let name = format!("seconds_{}", function.0);
                        self.undefined(depth + 2, &name, "until then the event does not come");
                        format!("delayexpr=\"{name}() + 's'\"")
                    }
                };
                self.line(depth + 2, &format!("<send event=\"{event}\" id=\"{event}\" {delay} davit:timer=\"true\"/>"));
            }
            if state.doo.is_some() {
                self.line(
                    depth + 2,
                    "<!-- doo: a function, left out; the state completes when it ends, so here it does not -->",
                );
            } else if !composite {
                let done = plain_event(&format!("e_done@{}", item.fqn));
                self.line(depth + 2, &format!("<raise event=\"{}\" davit:done=\"true\"/>", quoted(&done)));
            }
            self.line(depth + 1, "</onentry>");
        }
        if !state.entry.is_empty() || !configs.is_empty() {
            self.line(depth + 1, "<onentry>");
            self.actions(depth + 2, &state.entry);
            for id in &configs {
                self.line(depth + 2, &format!("<send event=\"{id}\" target=\"#_parent\" davit:config=\"true\"/>"));
            }
            self.line(depth + 1, "</onentry>");
        }
        if !state.exit.is_empty() || !configs.is_empty() || !timers.is_empty() {
            self.line(depth + 1, "<onexit>");
            for event in timers.keys() {
                self.line(depth + 2, &format!("<cancel sendid=\"{}\"/>", quoted(event)));
            }
            for id in configs.iter().rev() {
                self.line(depth + 2, &format!("<send event=\"{id}.undo\" target=\"#_parent\" davit:config=\"true\"/>"));
            }
            self.actions(depth + 2, &state.exit);
            self.line(depth + 1, "</onexit>");
        }
        self.transitions(at, depth + 1);
        for child in outline.children(at).collect::<Vec<_>>() {
            let folded = outline.items[child].name == INITIAL
                && outline.items[child].state.is_none()
                && self.simple_initial(at).is_some();
            if !folded {
                self.node(child, depth + 1);
            }
        }
        self.line(depth, "</state>");
    }

    /// Time events of a state that count from its entry, with their times.
    fn timers(&self, at: usize) -> BTreeMap<String, Delay> {
        let fqn = &self.outline.items[at].fqn;
        let links = self.links(at);
        let triggers = links.iter().flat_map(|link| &link.transition.events);
        let timed = triggers.filter_map(|(trigger, _)| match trigger {
            Trigger::Timed(timed) if timed.since == Since::Entry => {
                let delay = timed.by.map_or(Delay::Seconds(timed.seconds.max(0.0)), Delay::By);
                Some((plain_event(&timed.event_of(fqn)), delay))
            }
            _ => None,
        });
        timed.collect()
    }

    fn actions(&mut self, depth: usize, actions: &[(Action, Origin)]) {
        for (action, _) in actions {
            match action {
                Action::Raise(event) => {
                    self.line(depth, &format!("<send event=\"{}\" target=\"#_parent\"/>", quoted(event.as_str())));
                }
                Action::Function(_) => self.line(depth, "<!-- a function, left out -->"),
            }
        }
    }

    /// A remark on a function that the document calls and does not define.
    fn undefined(&mut self, depth: usize, name: &str, else_: &str) {
        self.line(depth, &format!("<!-- {name} is a function that is left out: define it in a <script>; {else_} -->"));
    }
}

/// When a time event comes.
#[derive(Debug, Clone, Copy)]
enum Delay {
    Seconds(f64),
    By(FunctionId),
}
