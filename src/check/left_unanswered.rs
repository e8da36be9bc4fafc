//! An answer goes to the state that asked, and nowhere else once that is left: a transition of a state beside it waits in vain.

use super::coordinator::{ask_of, edges};
use crate::model::codes::COORD_ANSWER_NEVER_COMES;
use crate::model::finding::Origin;
use crate::model::{Deployment, EventName, Finding, Findings, Verdict};
use crate::statechart::{Chart, EventId, NodeId, RaiseMoment};
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// Of each answer, the states to which it goes; none: who asked on a transition hears it as long as a state around both its ends is active.
type Owners = FxHashMap<EventName, Option<Vec<NodeId>>>;

fn owners(deployment: &Deployment, chart: &Chart) -> Owners {
    let mut owners = Owners::default();
    for site in chart.raises() {
        let Some(ask) = ask_of(deployment, site.name) else { continue };
        for verdict in ask.verdicts().iter().filter(|verdict| ![Verdict::Lost, Verdict::Reverted].contains(verdict)) {
            let known = owners.entry(verdict.event(ask)).or_insert_with(|| Some(Vec::new()));
            match site.when {
                RaiseMoment::Entry(state) => known.iter_mut().for_each(|known| known.push(state)),
                RaiseMoment::Exit(_) | RaiseMoment::Effect(_) => *known = None,
            }
        }
    }
    owners
}

/// Transitions that wait for an answer where it never comes.
pub fn check(deployment: &Deployment, chart: &Chart) -> Findings {
    let mut findings = Findings::new();
    if !chart.is_pure() {
        return findings;
    }
    let owners = owners(deployment, chart);
    // Said once of each state that waits for another one's, and of transitions that nothing else takes.
    let mut said: BTreeMap<(NodeId, NodeId), (Origin, BTreeSet<String>)> = BTreeMap::new();
    for edge in edges(chart) {
        let (from, _) = chart.ends(edge);
        let Some(triggers) = chart.triggers(edge).filter(|triggers| chart.is_state(from) && !triggers.is_empty())
        else {
            continue;
        };
        let lost = |trigger: &EventId| {
            let event = EventName::new(&chart.event_text(*trigger)).ok()?;
            let asking = owners.get(&event)?.as_ref()?;
            let hears = |owner: &NodeId| chart.is_inside(from, *owner) || chart.is_inside(*owner, from);
            let first = asking.first().filter(|_| !asking.iter().any(hears))?;
            Some((*first, event))
        };
        let Some(all) = triggers.iter().map(lost).collect::<Option<Vec<_>>>() else { continue };
        for (asking, event) in all {
            let (_, events) = said.entry((from, asking)).or_insert_with(|| (chart.edge_origin(edge), BTreeSet::new()));
            events.insert(format!("`{event}`"));
        }
    }
    for ((from, asking), (origin, events)) in said {
        let (here, there) = (chart.fqn(from), chart.fqn(asking));
        let never = if events.len() == 1 { "never comes" } else { "never come" };
        let events = events.into_iter().collect::<Vec<_>>().join(", ");
        findings.push(
            Finding::warning(
                COORD_ANSWER_NEVER_COMES,
                format!("{events} {never} in `{here}`: an answer goes to the state that asked, `{there}`, and is lost when that is left"),
            )
            .at(origin)
            .also(chart.origin(asking), "asks")
            .help(format!(
                "let `{there}` hear it; or ask on the entry of a state that both are in, which is not left meanwhile"
            )),
        );
    }
    findings
}
