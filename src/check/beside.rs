//! Several coordinators side by side: what each of them is checked as, and when that is all there is to know.
//!
//! Each coordinator is followed alone, with the events that the others emit counted among those that can come at any time
//! (which is more than can happen). As long as the configurations of one touch no component that those of another touch,
//! no request of the one is ever answered otherwise because of the other: their frames share nothing, and steps on
//! different components commute. So what holds of each alone holds of them together. Where they do touch the same
//! component, that is said; a few coordinators are then followed together as well (`joint`).

use super::coordinator::ask_of;
use crate::model::codes::{COORD_REQUEST_REFUSED, COORD_SHARED, DEPLOY_EVENT_UNHEARD, UNKNOWN_COMPONENT};
use crate::model::{
    Ask, ChangeKind, ComponentName, ConfigId, Configuration, Deployment, Finding, Findings, Ident, Severity, Target,
};
use crate::statechart::{Chart, EventId};
use std::collections::BTreeSet;

/// The deployment as its `number`-th coordinator alone sees it. `charts` are all of them, compiled.
pub fn view(deployment: &Deployment, charts: &[&Chart], number: usize) -> Option<Deployment> {
    let alone = deployment.coordinators.get(number)?.clone();
    let mut seen = Deployment { coordinators: vec![alone], ..deployment.clone() };
    let own = charts[number];
    let others = || charts.iter().enumerate().filter(move |(other, _)| *other != number).map(|(_, chart)| *chart);
    let raises = |chart: &Chart, name| chart.raises().iter().any(|site| site.name == name);
    // What nobody raises is said once, of the first.
    seen.emits.retain(|(event, _)| raises(own, *event) || (number == 0 && !others().any(|c| raises(c, *event))));
    let between = own.raises().iter().filter(|site| others().any(|other| other.event(site.name) != EventId::OTHER));
    seen.emits.extend(between.map(|site| (site.name, site.origin)));
    // A failed state without a coordinator's name is meant of those that have it; of the first, if none does.
    seen.coordinators[0]
        .failed
        .retain(|state| own.find(state).is_ok() || (number == 0 && !others().any(|other| other.find(state).is_ok())));
    Some(seen)
}

/// Components that a configuration names, or may touch by `_default`.
fn touched(configuration: &Configuration) -> (BTreeSet<ComponentName>, bool) {
    let mut components = BTreeSet::new();
    for change in &configuration.changes {
        match &change.kind {
            ChangeKind::Create { component, .. } | ChangeKind::Destroy { component } => {
                _ = components.insert(*component)
            }
            ChangeKind::Connect { from, to, .. } | ChangeKind::Disconnect { from, to } => {
                components.extend([from.component, to.component]);
            }
            ChangeKind::PropertySet { property, .. } => _ = components.insert(property.component),
            ChangeKind::PortWrite { port, .. } => _ = components.insert(port.component),
            ChangeKind::OperationCall { call, undo } => {
                components.insert(call.operation.component);
                components.extend(undo.iter().map(|undo| undo.operation.component));
            }
        }
    }
    let mut everything = false;
    for entry in configuration.pre.iter().chain(configuration.post.iter()) {
        match entry.target {
            Target::Component(component) => _ = components.insert(component),
            Target::Default => everything = true,
        }
    }
    (components, everything)
}

/// Configurations that a coordinator asks for.
pub fn asked(deployment: &Deployment, chart: &Chart) -> BTreeSet<ConfigId> {
    let asks = chart.raises().iter().filter_map(|site| ask_of(deployment, site.name));
    asks.filter_map(|ask| match ask {
        Ask::Apply(id) => Some(id),
        _ => None,
    })
    .collect()
}

/// Who asks for a configuration that makes the component which a finding of the `number`-th coordinator alone misses: that
/// coordinator's number, and the configuration with the component.
pub fn maker(
    deployment: &Deployment,
    charts: &[&Chart],
    number: usize,
    finding: &Finding,
) -> Option<(usize, ConfigId, ComponentName)> {
    let makes = |configuration: &Configuration| {
        configuration.changes.iter().find_map(|change| match &change.kind {
            ChangeKind::Create { component, .. } if misses(finding, *component) => Some((configuration.id, *component)),
            _ => None,
        })
    };
    let others = (0..charts.len()).filter(|other| *other != number);
    others.into_iter().find_map(|other| {
        let asked = asked(deployment, charts[other]);
        let own = deployment.configurations.iter().filter(|c| asked.contains(&c.id));
        own.into_iter().find_map(makes).map(|(id, component)| (other, id, component))
    })
}

/// Whether a finding is that this component is not there.
fn misses(finding: &Finding, component: ComponentName) -> bool {
    matches!(finding.code, UNKNOWN_COMPONENT | COORD_REQUEST_REFUSED)
        && finding.message.ends_with(&format!("there is no component `{component}`"))
}

/// What the configurations of different coordinators touch together: one finding for each pair of coordinators. `verified`:
/// they were followed together, so that what comes of it is told by findings of its own.
pub fn shared(deployment: &Deployment, charts: &[&Chart], verified: bool) -> Findings {
    if charts.len() < 2 {
        return Vec::new();
    }
    let names: Vec<Ident> = deployment.coordinators.iter().map(|c| c.name).collect();
    let of = |chart: &Chart| -> Vec<(&Configuration, BTreeSet<ComponentName>, bool)> {
        let ids = asked(deployment, chart);
        let configurations = deployment.configurations.iter().filter(|c| ids.contains(&c.id));
        configurations.map(|c| (c, touched(c).0, touched(c).1)).collect()
    };
    let all: Vec<_> = charts.iter().map(|chart| of(chart)).collect();
    let mut findings = Vec::new();
    for (a, mine) in all.iter().enumerate() {
        for (b, theirs) in all.iter().enumerate().skip(a + 1) {
            let found = mine.iter().find_map(|(one, components, everything)| {
                theirs.iter().find_map(|(other, touches, all)| {
                    let what = match components.intersection(touches).next() {
                        Some(component) => format!("`{component}`"),
                        None if one.id == other.id => "the same, being one configuration".to_owned(),
                        None if *everything || *all => "every component, by `_default`".to_owned(),
                        None if one.group.is_some() && one.group == other.group => {
                            format!("the group `{}`", one.group.map_or("", |g| g.as_str()))
                        }
                        None => return None,
                    };
                    Some((*one, *other, what))
                })
            });
            if let Some((one, other, what)) = found {
                let (severity, rest) = match verified {
                    true => (Severity::Info, "they were followed together"),
                    false => (Severity::Warning, "what they do together is not verified"),
                };
                let message = format!(
                    "`{}` of the coordinator `{}` and `{}` of `{}` touch {what}: {rest}",
                    one.id, names[a], other.id, names[b]
                );
                findings.push(
                    Finding::new(severity, COORD_SHARED, message)
                        .at(one.origin)
                        .also(other.origin, "the other one")
                        .help("give each coordinator components of its own, or let one ask the other by an event"),
                );
            }
        }
    }
    findings
}

/// Takes back that a coordinator does not wait for the event that starts or ends the deployment, if another one does.
pub fn forgive_unheard(deployment: &Deployment, charts: &[&Chart], findings: &mut Findings) {
    for (key, event) in [("deploy.event", deployment.deploy.event), ("shutdown.event", deployment.shutdown.event)] {
        if charts.iter().any(|chart| chart.event(event) != EventId::OTHER) {
            findings.retain(|f| f.code != DEPLOY_EVENT_UNHEARD || f.path != key);
        }
    }
}
