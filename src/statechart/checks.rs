//! What is wrong or doubtful in a chart whose references are all good.

use super::chart::{Chart, EventId, NONE, NodeKind};
use super::hook::Nobody;
use super::{EdgeId, NodeId};
use super::{Machine, MicrostepResult};
use crate::limits;
use crate::model::codes;
use crate::model::finding::{Finding, Findings};
use crate::time::Time;
use rustc_hash::FxHashMap;

/// Errors: cycles of connectors that nothing holds, and chains of connectors that are too long to search. Warnings: cycles
/// that the events of one step can open.
pub(super) fn connector_cycles(chart: &Chart, findings: &mut Findings) {
    // Each alone: what is closed in one may hide what is in the other.
    walk_connectors(chart, true, findings);
    walk_connectors(chart, false, findings);
}

/// Goes along the transitions between connectors that no guard holds; along those that need no event, or along all.
fn walk_connectors(chart: &Chart, null: bool, findings: &mut Findings) {
    const UNSEEN: u32 = 0;
    const OPEN: u32 = 1;
    let mut mark = vec![UNSEEN; chart.nodes.len()];
    // Length of the longest chain of connectors from here, once closed.
    let mut length = vec![0_usize; chart.nodes.len()];
    let next_of = |node: u32| {
        chart.nodes[node as usize].out.ids().filter(|edge| {
            let row = &chart.edges[*edge as usize];
            let held = row.guard.is_some() || row.predicates.len > 0 || (null && !row.null);
            !held && chart.nodes[row.tgt as usize].kind == NodeKind::Connector
        })
    };
    let mut too_long = None;
    for start in 0..u32::try_from(chart.nodes.len()).unwrap_or(NONE) {
        if chart.nodes[start as usize].kind != NodeKind::Connector || mark[start as usize] != UNSEEN {
            continue;
        }
        // Each with the transition that led to it.
        let mut open = vec![(start, next_of(start), NONE)];
        mark[start as usize] = OPEN;
        while let Some((node, edges, _)) = open.last_mut() {
            let node = *node;
            let Some(edge) = edges.next() else {
                open.pop();
                mark[node as usize] = 2;
                if length[node as usize] > limits::CONNECTOR_CHAIN {
                    too_long = Some(node);
                }
                if let Some((before, ..)) = open.last() {
                    let through = length[node as usize] + 1;
                    length[*before as usize] = length[*before as usize].max(through);
                }
                continue;
            };
            let target = chart.edges[edge as usize].tgt;
            match mark[target as usize] {
                UNSEEN => {
                    mark[target as usize] = OPEN;
                    open.push((target, next_of(target), edge));
                }
                OPEN => {
                    let from = open.iter().position(|step| step.0 == target).unwrap_or(0);
                    let cycle: Vec<NodeId> = open[from..].iter().map(|step| NodeId(step.0)).collect();
                    let mut edges: Vec<u32> = open[from + 1..].iter().map(|step| step.2).collect();
                    edges.push(edge);
                    findings.extend(cycle_finding(chart, &cycle, &edges, null));
                }
                _ => {
                    let longest = length[target as usize] + 1;
                    length[node as usize] = length[node as usize].max(longest);
                }
            }
        }
    }
    if let Some(node) = too_long.filter(|_| !null) {
        let (most, fqn) = (limits::CONNECTOR_CHAIN, chart.fqn(NodeId(node)));
        let message = format!("more than {most} connectors follow one another from `{fqn}`");
        let finding = Finding::error(codes::CHART_LONG_CHAIN, message);
        findings.push(of_node(chart, NodeId(node), finding).help("put states between them"));
    }
}

/// A finding about a state or connector.
fn of_node(chart: &Chart, node: NodeId, finding: Finding) -> Finding {
    finding.at(chart.origin(node)).path(chart.fqn(node).to_string())
}

/// Of a cycle that needs no event: an error. Of one that does: a warning, with what opens it.
fn cycle_finding(chart: &Chart, cycle: &[NodeId], edges: &[u32], null: bool) -> Option<Finding> {
    let mut names: Vec<String> = cycle.iter().map(|node| format!("`{}`", chart.fqn(*node))).collect();
    names.extend(names.first().cloned());
    let round = format!("connectors lead round in a circle: {}", names.join(" → "));
    let closing = EdgeId(*edges.last()?);
    let at = |finding: Finding| {
        let finding = finding.at(chart.edge_origin(closing)).labelled("this transition closes the circle");
        finding.path(chart.fqn(cycle[0]).to_string())
    };
    if null {
        let finding = Finding::error(codes::CHART_CONNECTOR_CIRCLE, round);
        return Some(at(finding).help("let one of these transitions end in a state"));
    }
    let listed: Vec<&[EventId]> = edges
        .iter()
        .map(|edge| &chart.edges[*edge as usize])
        .filter(|row| !row.null)
        .map(|row| row.events.of(&chart.triggers))
        .collect();
    // One that needs no event was an error.
    let (first, rest) = listed.split_first()?;
    let alone = first.iter().find(|event| rest.iter().all(|other| other.contains(event)));
    let opened = match alone {
        Some(event) => format!("on `{}` ", chart.event_text(*event)),
        None => {
            let mut events: Vec<String> = Vec::new();
            for event in listed.iter().filter_map(|list| list.first()) {
                let text = format!("`{}`", chart.event_text(*event));
                if !events.contains(&text) {
                    events.push(text);
                }
            }
            format!("when {} come in one step ", events.join(" and "))
        }
    };
    let finding = Finding::warning(codes::CHART_CONNECTOR_CIRCLE, format!("{opened}{round}"));
    Some(
        at(finding)
            .help("then no transition is taken, where rFSM overflows its stack: let one of these end in a state"),
    )
}

/// Warnings and remarks.
pub(super) fn doubts(chart: &Chart, findings: &mut Findings) {
    let reached = reached(chart);
    no_way_out(chart, findings);
    unreachable(chart, &reached, findings);
    ambiguous(chart, findings);
    shadowed(chart, findings);
    root_exit(chart, findings);
    if chart.unguarded {
        not_entered(chart, findings);
        if chart.pure {
            endless(chart, &reached, findings);
        }
    }
}

/// rFSM warns of every node without outgoing transitions. It matters for connectors, and for states that nothing around
/// or inside leads out of; the others are told in one remark.
fn no_way_out(chart: &Chart, findings: &mut Findings) {
    let own = |node: NodeId| chart.nodes[node.index()].out.len > 0;
    let mut inside = vec![false; chart.nodes.len()];
    for node in chart.nodes().filter(|n| chart.is_state(*n) && own(*n)) {
        let mut at = Some(node);
        while let Some(n) = at.filter(|n| !inside[n.index()]) {
            inside[n.index()] = true;
            at = chart.parent(n);
        }
    }
    let mut others = Vec::new();
    for node in chart.nodes().skip(1).filter(|node| !own(*node)) {
        let mut around = std::iter::successors(chart.parent(node), |n| chart.parent(*n));
        if !chart.is_state(node) {
            let fqn = chart.fqn(node);
            let message = format!("the connector `{fqn}` has no outgoing transition, so no path leads through it");
            let finding = of_node(chart, node, Finding::warning(codes::CHART_NO_OUTGOING, message));
            findings.push(finding.help("write a transition from it, or take it out"));
        } else if around.any(own) || inside[node.index()] {
            others.push(node);
        } else if chart.parent(node).is_some_and(|parent| parent == NodeId::ROOT || inside[parent.index()]) {
            // Only the outermost of states that cannot be left.
            let message = format!("no outgoing transitions from `{}`: once entered it is never left", chart.fqn(node));
            let finding = of_node(chart, node, Finding::warning(codes::CHART_NO_OUTGOING, message));
            findings.push(finding.help("right for a final state; else write the transition that leads on"));
        }
    }
    if let Some(first) = others.first() {
        let shown: Vec<String> = others.iter().take(8).map(|n| format!("`{}`", chart.fqn(*n))).collect();
        let shown = shown.join(", ");
        let more = if others.len() > 8 { format!(" and {} more", others.len() - 8) } else { String::new() };
        let message =
            format!("no outgoing transitions of their own: {shown}{more}; transitions around or inside lead out");
        findings.push(of_node(chart, *first, Finding::info(codes::CHART_NO_OUTGOING, message)));
    }
}

/// Every node that some sequence of events can bring into play.
fn reached(chart: &Chart) -> Vec<bool> {
    let mut reached = vec![false; chart.nodes.len()];
    let mut waiting = vec![chart.initial];
    while let Some(node) = waiting.pop() {
        let mut at = Some(NodeId(node));
        while let Some(n) = at.filter(|n| !reached[n.index()]) {
            reached[n.index()] = true;
            waiting.extend(chart.nodes[n.index()].out.ids().map(|edge| chart.edges[edge as usize].tgt));
            at = chart.parent(n);
        }
    }
    reached
}

fn unreachable(chart: &Chart, reached: &[bool], findings: &mut Findings) {
    for node in chart.nodes().filter(|n| !reached[n.index()] && chart.is_state(*n)) {
        // Only the outermost state of those that cannot be reached.
        if chart.parent(node).is_some_and(|parent| reached[parent.index()]) {
            let finding = Finding::warning(codes::CHART_UNREACHABLE, format!("`{}` is never entered", chart.fqn(node)));
            let help = "write a transition that leads to it, or take it out";
            findings.push(of_node(chart, node, finding).help(help));
        }
    }
}

/// Two transitions of one node with equal priority and a common event.
fn ambiguous(chart: &Chart, findings: &mut Findings) {
    for node in chart.nodes() {
        let mut rest = chart.nodes[node.index()].out.ids().peekable();
        while let Some(first) = rest.next() {
            // Edges of equal priority stand together.
            let pn = chart.priorities[first as usize];
            let mut group = vec![first];
            while let Some(next) = rest.next_if(|edge| chart.priorities[*edge as usize].total_cmp(&pn).is_eq()) {
                group.push(next);
            }
            if let Some((a, b, event)) = clash(chart, &group) {
                let what = event.map_or("any event".to_owned(), |event| format!("`{}`", chart.event_text(event)));
                let (fqn, to) = (chart.fqn(node), chart.fqn(chart.ends(EdgeId(a)).1));
                let message =
                    format!("on {what}, `{fqn}` has two transitions of equal priority; the one to `{to}` is taken");
                findings.push(
                    Finding::warning(codes::CHART_ORDER_DECIDES, message)
                        .at(chart.edge_origin(EdgeId(a)))
                        .labelled("this one is taken")
                        .also(chart.edge_origin(EdgeId(b)), "this one is not")
                        .path(fqn.to_string())
                        .help("give the one that matters more a higher `pn`"),
                );
            }
        }
    }
}

/// The first two of `group` that one event triggers and that differ in what they lead to, in the order they are tried;
/// no event: both take any.
fn clash(chart: &Chart, group: &[u32]) -> Option<(u32, u32, Option<EventId>)> {
    let mut by_event: FxHashMap<EventId, u32> = FxHashMap::default();
    let mut null: Option<u32> = None;
    let mut evented: Option<(u32, EventId)> = None;
    for edge in group.iter().copied().filter(|edge| !chart.is_guarded(EdgeId(*edge))) {
        let row = &chart.edges[edge as usize];
        let differs = |other: u32| {
            let other = &chart.edges[other as usize];
            other.tgt != row.tgt || other.effect.of(&chart.ops) != row.effect.of(&chart.ops)
        };
        let events = row.events.of(&chart.triggers);
        if let Some(other) = null.filter(|other| differs(*other)) {
            return Some((other, edge, events.first().copied()));
        }
        if row.null {
            if let Some((other, event)) = evented.filter(|(other, _)| differs(*other)) {
                return Some((other, edge, Some(event)));
            }
            null = null.or(Some(edge));
        }
        for event in events {
            if let Some(other) = by_event.get(event).copied().filter(|other| differs(*other)) {
                return Some((other, edge, Some(*event)));
            }
            by_event.entry(*event).or_insert(edge);
            evented = evented.or(Some((edge, *event)));
        }
    }
    None
}

/// Transitions behind one that any event triggers and that always finds its way.
fn shadowed(chart: &Chart, findings: &mut Findings) {
    let mut always = vec![None; chart.nodes.len()];
    for node in chart.nodes().filter(|n| chart.is_state(*n)) {
        let mut out = chart.nodes[node.index()].out.ids();
        let Some(before) = out.find(|edge| never_fails(chart, *edge, &mut always)) else { continue };
        for edge in out {
            let to = |edge: u32| chart.fqn(chart.ends(EdgeId(edge)).1);
            let (fqn, to, other) = (chart.fqn(node), to(edge), to(before));
            let message =
                format!("the transition from `{fqn}` to `{to}` is never taken: any event takes the one to `{other}`");
            findings.push(
                Finding::warning(codes::CHART_SHADOWED, message)
                    .at(chart.edge_origin(EdgeId(edge)))
                    .also(chart.edge_origin(EdgeId(before)), "this one takes any event")
                    .path(fqn.to_string())
                    .help("give this one a higher `pn`, or list events on the other"),
            );
        }
    }
}

fn never_fails(chart: &Chart, edge: u32, always: &mut [Option<bool>]) -> bool {
    let row = &chart.edges[edge as usize];
    if !row.null || chart.is_guarded(EdgeId(edge)) {
        return false;
    }
    match chart.nodes[row.tgt as usize].kind {
        NodeKind::Leaf => true,
        NodeKind::Composite => false,
        NodeKind::Connector => match always[row.tgt as usize] {
            Some(known) => known,
            None => {
                // Chains without guards and events are bounded and have no cycles.
                let found = chart.nodes[row.tgt as usize].out.ids().any(|edge| never_fails(chart, edge, always));
                always[row.tgt as usize] = Some(found);
                found
            }
        },
    }
}

fn root_exit(chart: &Chart, findings: &mut Findings) {
    if let Some(site) = chart.raises.iter().find(|site| site.when == super::RaiseMoment::Exit(NodeId::ROOT)) {
        findings.push(
            Finding::warning(
                codes::CHART_ROOT_EXIT,
                format!("`{}` is never raised: the root is never left", site.name),
            )
            .at(site.origin)
            .path("root")
            .help("put it into a state inside the root"),
        );
    }
}

fn not_entered(chart: &Chart, findings: &mut Findings) {
    if Machine::new(chart).microstep(chart, Time::default(), &mut Nobody) == MicrostepResult::NotEntered {
        let message = "no path leads from the initial connector without an event";
        let finding = of_node(chart, NodeId(chart.initial), Finding::warning(codes::CHART_NOT_ENTERED, message));
        findings.push(finding.help("take the events off one of the transitions from `initial`"));
    }
}

/// Leaves whose completions lead round in a cycle.
fn endless(chart: &Chart, reached: &[bool], findings: &mut Findings) {
    let mut machine = Machine::new(chart);
    let mut next = vec![NONE; chart.nodes.len()];
    let goes_on = |n: &NodeId| reached[n.index()] && !chart.nodes[n.index()].settles;
    for leaf in chart.nodes().filter(|n| chart.kind(*n) == NodeKind::Leaf && goes_on(n)) {
        machine.place(chart, leaf, Time::default());
        machine.send(chart.completion(leaf));
        if machine.microstep(chart, Time::default(), &mut Nobody) == MicrostepResult::Taken {
            next[leaf.index()] = machine.leaf().map_or(NONE, |leaf| leaf.0);
        }
    }
    // Follow each chain once; one that meets itself closed a cycle.
    let mut seen = vec![NONE; chart.nodes.len()];
    for start in 0..u32::try_from(next.len()).unwrap_or(NONE) {
        let mut at = start;
        while at != NONE && seen[at as usize] == NONE {
            seen[at as usize] = start;
            at = next[at as usize];
        }
        if at == NONE || seen[at as usize] != start || next[at as usize] == NONE {
            continue;
        }
        let cycle = std::iter::successors(Some(next[at as usize]), |n| Some(next[*n as usize]));
        let mut names = vec![format!("`{}`", chart.fqn(NodeId(at)))];
        for node in cycle {
            names.push(format!("`{}`", chart.fqn(NodeId(node))));
            if node == at || names.len() > 8 {
                break;
            }
        }
        let message = format!("once there, the coordinator never comes to rest: {}", names.join(" → "));
        let finding = of_node(chart, NodeId(at), Finding::warning(codes::CHART_ENDLESS, message));
        findings.push(finding.help("let one of these transitions wait for an event other than the completion"));
    }
}
