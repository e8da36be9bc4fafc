//! Transitions and what triggers them.

use super::content::NO_COUNTERPART;
use super::strange::has_unknown;
use super::{ScxmlReader, is_state, own};
use crate::lang::print::scxml::SCXML;
use crate::limits;
use crate::model::finding::did_you_mean;
use crate::model::statechart::{ChartTransition, INITIAL, ROOT, Since, Trigger};
use crate::model::{EventName, Finding, codes};
use roxmltree::Node as Element;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;

impl<'t> ScxmlReader<'_, 't> {
    /// Events that a state sends itself later, with their seconds.
    pub(super) fn delays(&mut self, element: Element<'_, 't>) -> BTreeMap<String, f64> {
        let sends = element.children().filter(|c| c.has_tag_name((SCXML, "onentry"))).flat_map(|c| c.children());
        let timers = sends.filter(|c| c.has_tag_name((SCXML, "send")) && own(*c, "timer").is_none());
        timers.filter_map(|c| Some((c.attribute("event")?.to_owned(), seconds(c.attribute("delay")?)?))).collect()
    }

    /// The state that an attribute names.
    pub(super) fn one_target(&mut self, element: Element<'_, 't>, key: &str, ids: &str) -> Option<String> {
        let mut all = ids.split_whitespace();
        let (first, more) = (all.next()?, all.next());
        if more.is_some() {
            self.no_counterpart(element, "several targets are entered in parallel", NO_COUNTERPART[0].1);
            return None;
        }
        match self.ids.get(first) {
            Some(target) if target == ROOT => Some(format!("{ROOT}.{INITIAL}")),
            Some(target) => Some(target.clone()),
            // Of an `id` that is misspelt it is told at that.
            None if element.document().descendants().any(|other| is_state(other) && has_unknown(other)) => None,
            None => {
                // Nobody reads what thousands may have meant.
                let help = match self.cx.findings.len() < limits::FINDINGS_SHOWN {
                    true => did_you_mean(first, "states", self.ids.keys().map(String::as_str)),
                    false => "name a state that is there".to_owned(),
                };
                let origin = self.at_value(element, key);
                let message = format!("there is no state `{first}`");
                self.cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(origin).help(help));
                None
            }
        }
    }

    pub(super) fn transition(
        &mut self,
        element: Element<'_, 't>,
        src: &str,
        fqn: &str,
        source: Element<'_, 't>,
        delays: &BTreeMap<String, f64>,
    ) -> Option<ChartTransition> {
        let origin = self.at(element);
        let Some(ids) = element.attribute("target") else {
            // One that is misspelt is told by itself.
            if has_unknown(element) {
                return None;
            }
            let help = "a transition always leads somewhere: raise the names on the entry of a state";
            self.no_counterpart(element, "a transition without a target", help);
            return None;
        };
        let target = self.one_target(element, "target", ids)?;
        if own(element, "function").is_some() {
            let help = "read the coordinator from the Lua file that has it";
            self.no_counterpart(element, "a condition that was left out", help);
            return None;
        }
        if element.attribute("cond").is_some() && own(element, "event").is_none() {
            let help = "let what decides raise one event or another";
            self.no_counterpart(element, "a condition on data", help);
            return None;
        }
        let inside = target.strip_prefix(fqn).is_some_and(|rest| rest.starts_with('.'));
        if element.attribute("type") == Some("internal") && inside && src != INITIAL && source.children().any(is_state)
        {
            let help = "here the state is left and entered again; write the transition at the states inside";
            self.no_counterpart(element, "an internal transition of a state around its target", help);
            return None;
        }
        let leads_back = !self.ours && fqn.strip_prefix(&target).is_some_and(|rest| rest.starts_with('.'));
        let target = if leads_back { self.again(&target) } else { target };
        let mut out = ChartTransition { origin, ..ChartTransition::default() };
        out.src = Some((src.to_owned(), origin));
        out.tgt = Some((target, origin));
        let events = own(element, "event").or_else(|| element.attribute("event")).unwrap_or_default();
        let exact = own(element, "event").is_some();
        let mut known = FxHashSet::default();
        for event in events.split_whitespace().filter(|event| *event != "*") {
            if self.is_taken(element, event) {
                return None;
            }
            if exact || self.ours || delays.contains_key(event) {
                self.trigger(element, event, exact, delays, &mut known, &mut out);
                continue;
            }
            for meant in self.descriptor(element, event) {
                self.trigger(element, &meant, exact, delays, &mut known, &mut out);
            }
        }
        if events.split_whitespace().any(|event| event == "*") {
            if !self.ours {
                let message = "`*` would also mean the state's own completion here, so it would be taken at once";
                let help = "list the events that are meant";
                self.no_counterpart(element, message, help);
                return None;
            }
            out.events.clear();
        }
        self.events_agree(element, fqn, &out);
        if let Some(pn) = own(element, "pn") {
            out.pn = pn.parse().ok().filter(|pn: &f64| pn.is_finite()).unwrap_or_default();
        }
        let (effect, timers) = self.actions(element);
        if let Some(event) = timers.keys().next() {
            let message = format!("`{event}` is sent later by a transition");
            self.no_counterpart(element, message, "send it on the entry of the state that waits for it");
        }
        out.effect = effect;
        Some(out)
    }

    fn trigger(
        &mut self,
        element: Element<'_, 't>,
        event: &str,
        exact: bool,
        delays: &BTreeMap<String, f64>,
        known: &mut FxHashSet<String>,
        out: &mut ChartTransition,
    ) {
        if let Some(seconds) = delays.get(event).filter(|_| !exact) {
            out.events.push((Trigger::timed(Since::Entry, *seconds), out.origin));
            // What others wait for as well may come before its time.
            if !self.elsewhere.contains(event) {
                return;
            }
        }
        if let Some(id) = event.strip_prefix("done.state.").filter(|_| !exact) {
            let finals = self.finals.get(id).cloned().unwrap_or_default();
            if finals.is_empty() {
                let help = "give the state a `<final>` inside: its completion is that of one of those";
                self.no_counterpart(element, format!("`{event}` never comes"), help);
            }
            let names = finals.iter().filter_map(|fqn| EventName::new(&format!("e_done@{fqn}")).ok());
            out.events.extend(names.map(|name| (Trigger::Event(name), out.origin)));
            return;
        }
        match Trigger::parse(event) {
            Ok(trigger) if !self.ours && !known.insert(trigger.to_string()) => {}
            Ok(trigger) => out.events.push((trigger, out.origin)),
            Err(error) => self.report(element, codes::TEXT_BAD_NAME, error.to_string(), "write the name of an event"),
        }
    }
}

/// A CSS2 time in seconds.
pub(super) fn seconds(text: &str) -> Option<f64> {
    let text = text.trim();
    let (number, unit) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s')?, 1.0),
    };
    number.trim().parse().ok().map(|v: f64| v * unit).filter(|v| v.is_finite() && *v >= 0.0)
}
