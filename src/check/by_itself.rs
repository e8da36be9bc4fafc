//! What comes without anybody having said so: answers, times, completions, faults, and what subsystems tell.

use super::coordinator::edges;
use super::taken::Taken;
use crate::model::statechart::is_internal;
use crate::model::{Deployment, FAULTED, Verdict};
use crate::statechart::{Chart, EdgeId, EventId, NodeId};
use rustc_hash::FxHashSet;

/// What takes a transition without anybody having said so, in words.
pub fn by(deployment: &Deployment, chart: &Chart, edge: EdgeId) -> Option<String> {
    // What leads out of a connector comes of what led into it.
    let triggers = match chart.triggers(edge) {
        _ if !chart.is_state(chart.ends(edge).0) => return None,
        None | Some([]) => return Some("whatever comes next".to_owned()),
        Some(triggers) => triggers,
    };
    let comes_by_itself = |event: &&EventId| {
        let text = chart.event_text(**event);
        let is_answer = Verdict::split(&text).is_some() && deployment.looks_like_answer(&text);
        let is_told = text
            .split_once('/')
            .is_some_and(|(path, _)| deployment.subsystems.iter().any(|subsystem| subsystem.name.as_str() == path));
        let completes = is_internal(&text);
        let fails = text.ends_with(FAULTED);
        chart.time_of(**event).is_some() || completes || is_answer || is_told || fails
    };
    triggers.iter().find(comes_by_itself).map(|event| format!("`{}`", chart.event_text(*event)))
}

/// The transitions that come by themselves from where a state is entered, without anybody having said anything since, each with what takes it.
pub fn ways_on(deployment: &Deployment, chart: &Chart, state: NodeId) -> Vec<(EdgeId, String)> {
    let by_itself: Vec<(EdgeId, String)> =
        edges(chart).filter_map(|edge| Some((edge, by(deployment, chart, edge)?))).collect();
    let within = |edge: EdgeId| {
        let entered = Taken::of(chart, edge).entered;
        entered.into_iter().filter(|node| chart.is_inside(*node, state)).collect::<Vec<NodeId>>()
    };
    let into = edges(chart).filter(|edge| !chart.is_inside(chart.ends(*edge).0, state));
    let mut reached: FxHashSet<NodeId> = into.flat_map(within).collect();
    let mut found: Vec<(EdgeId, String)> = Vec::new();
    loop {
        let leaves = |edge: EdgeId| {
            let source = chart.ends(edge).0;
            chart.is_inside(source, state) && reached.iter().any(|node| chart.is_inside(*node, source))
        };
        let is_new = |edge: EdgeId| found.iter().all(|(known, _)| *known != edge);
        let next: Vec<_> = by_itself.iter().filter(|(edge, _)| leaves(*edge) && is_new(*edge)).cloned().collect();
        if next.is_empty() {
            return found;
        }
        reached.extend(next.iter().flat_map(|(edge, _)| within(*edge)));
        found.extend(next);
    }
}
