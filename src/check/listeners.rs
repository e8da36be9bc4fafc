//! Whether somebody listens to what monitors, simulated components and components raise by a name that a deployment has given them.

use super::universe::Universe;
use crate::model::codes::CONF_EVENT_UNHEARD;
use crate::model::finding::{did_you_mean, nearest};
use crate::model::statechart::is_internal;
use crate::model::{
    ChangeKind, ComponentName, ComponentType, Deployment, EventName, Finding, Findings, Ident, Origin, Value,
};
use crate::statechart::Chart;
use std::collections::BTreeSet;

/// Who waits for what.
pub struct Listeners<'a> {
    deployment: &'a Deployment,
    /// What transitions of any coordinator list.
    heard: BTreeSet<&'a str>,
}

impl<'a> Listeners<'a> {
    /// Of a deployment with these coordinators.
    pub fn new(deployment: &'a Deployment, charts: &[&'a Chart]) -> Self {
        let heard = charts.iter().flat_map(|chart| chart.events()).map(|event| event.as_str()).collect();
        Self { deployment, heard }
    }

    /// Whether a transition waits for an event, or a configuration is confirmed by it.
    pub fn listen_to(&self, event: EventName) -> bool {
        let mut confirms = self.deployment.configurations.iter().filter_map(|configuration| configuration.confirm);
        self.heard.contains(event.as_str()) || confirms.any(|confirm| confirm.event == event)
    }

    /// What may have been meant by one that nobody listens to.
    pub fn advice(&self, event: EventName) -> String {
        did_you_mean(event.as_str(), "events", self.heard.iter().copied().filter(|event| !is_internal(event)))
    }
}

/// An event that the value of a property names.
pub struct NamedEvent {
    component: ComponentName,
    property: Ident,
    /// The event.
    pub event: EventName,
    at: Origin,
}

/// The events that components of this file are told to raise, by values of their properties. What is in a subsystem raises its own there.
pub fn named(deployment: &Deployment, universe: &Universe) -> Vec<NamedEvent> {
    let mut all = Vec::new();
    let mut add = |component: ComponentName, property: Ident, value: &Value, at: Origin| {
        let Value::Str(text) = value else { return };
        let mut types = universe.of(component).iter().filter_map(|made| made.description.as_deref());
        let raises = types.any(|ty| ty.properties.get(&property).is_some_and(|property| property.raises));
        if let (true, Ok(event)) = (raises && !component.as_str().contains('/'), EventName::new(text)) {
            all.push(NamedEvent { component, property, event, at });
        }
    };
    for change in deployment.configurations.iter().flat_map(|configuration| &configuration.changes) {
        if let Some((component, _, properties)) = change.kind.makes() {
            properties.iter().for_each(|(property, value)| add(component, *property, value, change.origin));
        } else if let ChangeKind::PropertySet { property, value } = &change.kind {
            add(property.component, property.member, value, change.origin);
        }
    }
    all
}

/// What is wrong with those.
pub fn events(deployment: &Deployment, universe: &Universe, charts: &[&Chart]) -> Findings {
    let listeners = Listeners::new(deployment, charts);
    let mut findings = Vec::new();
    for NamedEvent { component, property, event, at } in named(deployment, universe) {
        let (finding, help) = match deployment.never_from_outside(event.as_str()) {
            Some(why) => (
                Finding::error(CONF_EVENT_UNHEARD, why),
                format!("let `{component}` raise an event of another name, such as `e_seen`"),
            ),
            None if listeners.listen_to(event) => continue,
            None => (
                Finding::warning(
                    CONF_EVENT_UNHEARD,
                    format!("nobody listens to `{event}`, which `{component}` raises"),
                ),
                listeners.advice(event),
            ),
        };
        findings.push(finding.at(at).labelled(format!("`{property}`")).help(help));
    }
    findings.extend(deployment.types.iter().flat_map(|ty| misspelt(deployment, &listeners, ty)));
    findings
}

/// Events that a type of this file raises which nobody listens to, and a near one which no type raises is listened to. What is merely not
/// listened to is no matter: a type is written for more than one system.
fn misspelt(deployment: &Deployment, listeners: &Listeners<'_>, ty: &ComponentType) -> Findings {
    let raised =
        |event: &str| deployment.types.iter().any(|ty| ty.raises.keys().any(|raised| raised.as_str() == event));
    let unheard = ty.raises.keys().filter(|event| !listeners.listen_to(**event));
    let with_near = unheard.filter_map(|event| {
        let others = listeners.heard.iter().copied().filter(|heard| !is_internal(heard) && !raised(heard));
        let near = nearest(event.as_str(), others)?;
        let path = format!("types.{}.raises", ty.name);
        let at = deployment.key_origins.get(&path).copied().unwrap_or(ty.origin);
        let message = format!("nobody listens to `{event}`, which components of the type `{}` raise", ty.name);
        let help = format!("did you mean `{near}`?");
        Some(Finding::warning(CONF_EVENT_UNHEARD, message).at(at).path(path).help(help))
    });
    with_near.collect()
}
