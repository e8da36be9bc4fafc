//! Several coordinators side by side: what each of them is checked as by itself, and what they touch in common.

use super::coordinator::ask_of;
use super::members::requester;
use crate::model::codes::{COORD_SHARED, DEPLOY_EVENT_UNHEARD};
use crate::model::{
    Ask, ComponentName, ConfigId, Configuration, Deployment, Finding, Findings, Ident, RequestId, Severity, Target,
};
use crate::stack::Request;
use crate::stack::claims::{self, Claims};
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

/// Components that a configuration names, and whether it may touch all by `_default`.
fn touched(configuration: &Configuration) -> (BTreeSet<ComponentName>, bool) {
    let mut entries = configuration.pre.iter().chain(configuration.post.iter());
    (claims::components(configuration), entries.any(|entry| entry.target == Target::Default))
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

/// What the configurations of different coordinators touch together: one finding for each pair of coordinators. `verified`:
/// they were followed together, so that what comes of it is told by findings of its own.
pub fn shared(deployment: &Deployment, charts: &[&Chart], numbers: &[usize], verified: bool) -> Findings {
    if numbers.len() < 2 {
        return Vec::new();
    }
    let names: Vec<Ident> = numbers.iter().map(|number| deployment.coordinators[*number].name).collect();
    let of = |chart: &Chart| -> Vec<(&Configuration, BTreeSet<ComponentName>, bool)> {
        let ids = asked(deployment, chart);
        let configurations = deployment.configurations.iter().filter(|c| ids.contains(&c.id));
        configurations.map(|c| (c, touched(c).0, touched(c).1)).collect()
    };
    let all: Vec<_> = numbers.iter().map(|number| of(charts[*number])).collect();
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
                    false => (Severity::Warning, "what they do together was not followed to the end"),
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

/// The coordinators in groups that have nothing to do with each other: they touch nothing in common, hear nothing of each
/// other, and no safe configuration of one interrupts another. What holds of each group holds of all together.
pub fn groups(deployment: &Deployment, charts: &[&Chart]) -> Vec<Vec<usize>> {
    if charts.len() < 2 {
        return (0..charts.len()).map(|number| vec![number]).collect();
    }
    let claims = Claims::new(deployment.configurations.iter());
    let requests = |chart: &Chart| -> Vec<Request> {
        let ids = asked(deployment, chart).into_iter();
        ids.map(|id| Request::new(RequestId(0), Ask::Apply(id), requester(deployment.coordinators[0].name))).collect()
    };
    let all: Vec<_> = charts.iter().map(|chart| claims.of(&requests(chart))).collect();
    let hears = |a: &Chart, b: &Chart| a.raises().iter().any(|site| b.event(site.name) != EventId::OTHER);
    let is_safe = |id: &ConfigId| deployment.configuration(*id).is_some_and(|c| c.safe);
    let safe: Vec<bool> = charts.iter().map(|chart| asked(deployment, chart).iter().any(is_safe)).collect();
    let own: Vec<_> = charts.iter().map(|chart| asked(deployment, chart)).collect();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for number in 0..charts.len() {
        let meets = |other: &usize| {
            let (a, b) = (number, *other);
            let same = own[a].intersection(&own[b]).next().is_some();
            let heard = hears(charts[a], charts[b]) || hears(charts[b], charts[a]);
            same || heard || safe[a] || safe[b] || all[a].meets(&all[b])
        };
        let (with, without): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| group.iter().any(meets));
        groups = without;
        let mut group: Vec<usize> = with.into_iter().flatten().chain([number]).collect();
        group.sort_unstable();
        groups.push(group);
    }
    groups.sort_unstable();
    groups
}
