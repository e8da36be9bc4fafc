//! The whole check, one family after the other; and single families, for who changes a running deployment.

use super::automaton::InterfaceAutomaton;
use super::belief::MOST_UNTAKEN;
use super::bound::Bound;
use super::deeper::Deeper;
use super::driven::DrivenPorts;
use super::effort::Effort;
use super::exchanged::Exchanging;
use super::explore::explore;
use super::judge::Traced;
use super::neighbours::Neighbours;
use super::product::Product;
use super::report::{Accepted, Explored, Report};
use super::state::Failed;
use super::verdict::CheckVerdict;
use super::{
    alone, composed, configurations as single, coordinator, coupling, declared, interface, led_below, led_on,
    left_unanswered, library, listeners, monitors as watched, moves_back, paths, purity, safety, settings, simulated,
    slips, types, unasked, undriven, unhandled, universe, unwatched, ways,
};
use crate::model::codes::{
    CLASH, COMPOSE_UNKNOWN, COMPOSE_UNLEFT, COORD_NEAR_EVENT, COORD_NO_WAY_DOWN, DEPLOY_NEVER_DOWN, DEPLOY_NEVER_UP,
    POST_ON_DESTROYED, PRE_ON_CREATED, TOUCHES_DESTROYED,
};
use crate::model::naming::Naming;
use crate::model::{
    Catalogue, Code, ConfigId, Deployment, EventName, Finding, Findings, MemberRef, Severity, StepFault,
};
use crate::statechart::Chart;
use rustc_hash::FxHashSet;
use std::cmp::Reverse;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Checks a deployment against the component types it may use (those of its libraries and those it declares).
pub fn run(deployment: impl Into<Arc<Deployment>>, catalogue: &Catalogue) -> Report {
    run_with(deployment, catalogue, Effort::default())
}

/// The same with more effort, or less.
pub fn run_with(deployment: impl Into<Arc<Deployment>>, catalogue: &Catalogue, effort: Effort<'_>) -> Report {
    let deployment = deployment.into();
    let part = undriven::part(&deployment, catalogue, Severity::Info);
    let one = |own, catalogue: &Catalogue, around: &Neighbours| run_one(own, catalogue, effort, around);
    let (mut report, _) = match effort.together {
        true => one(deployment, catalogue, &Neighbours::default()),
        false => composed::run(deployment, catalogue, &Neighbours::default(), &one),
    };
    report.traces.extend(part.iter().map(|_| Vec::new()));
    report.findings.extend(part);
    report
}

/// The check of one file.
fn run_one(
    shared: Arc<Deployment>,
    catalogue: &Catalogue,
    effort: Effort<'_>,
    around: &Neighbours,
) -> composed::CheckedFile {
    let deployment = &*shared;
    let universe = universe::Universe::new(deployment, catalogue);
    let mut findings = types::check(deployment, catalogue);
    findings.extend(library::check(deployment, catalogue));
    findings.extend(single::check(deployment, &universe));
    findings.extend(watched::check(deployment, &universe));
    findings.extend(simulated::check(deployment, &universe));
    findings.extend(declared::check(deployment, &universe));
    findings.extend(moves_back::check(deployment, &universe));
    findings.extend(alone::check(deployment));
    findings.extend(safety::unnamed(deployment, catalogue));
    let written = deployment.charts();
    let mut charts = Vec::new();
    let mut all = 0;
    for chart in written {
        let (chart, problems) = crate::statechart::compile(chart);
        findings.extend(problems);
        charts.extend(chart);
        all += 1;
    }
    let mut traced: Traced = findings.into_iter().map(|finding| (finding, Vec::new())).collect();
    let mut explored = Explored::default();
    let mut left: BTreeSet<String> = BTreeSet::new();
    let (mut replayed, mut shows, mut idle) = (None, None, None);
    let compiled: Vec<&Chart> = charts.iter().collect();
    let mut driven_ports = DrivenPorts::new(deployment, (charts.len() == all).then_some(&compiled[..]));
    if charts.len() == all {
        let charts = compiled;
        let mut findings = watched::events(deployment, &charts);
        findings.extend(simulated::events(deployment, &charts));
        findings.extend(listeners::events(deployment, &universe, &charts));
        findings.extend(unwatched::check(deployment, &universe, &charts));
        findings.extend(interface::check(deployment, &universe, &charts));
        if deployment.own.is_none() {
            findings.extend(interface::between(deployment, &charts, catalogue));
            findings.extend(paths::heard(deployment, &charts));
            findings.extend(unasked::check(deployment, &charts));
        }
        let of = |number| coupling::view(deployment, &charts, number);
        let views: Vec<Deployment> = (0..all).filter_map(of).collect();
        let told: BTreeSet<EventName> = charts
            .iter()
            .flat_map(|chart| chart.raises())
            .filter_map(|site| EventName::new(site.name.as_str()).ok())
            .collect();
        let waited_for: BTreeSet<EventName> = charts.iter().flat_map(|chart| chart.events()).copied().collect();
        let known = slips::KnownEvents::new(deployment, &universe, &told, &waited_for);
        for configuration in &deployment.configurations {
            let near = configuration.confirm.and_then(|confirm| known.confirmed_as(confirm.event));
            let path = || format!("configurations.{}.confirm", configuration.id);
            findings.extend(near.map(|near| near.at(configuration.origin).path(path())));
        }
        for (view, chart) in views.iter().zip(&charts) {
            let known = slips::KnownEvents::new(view, &universe, &told, &waited_for);
            findings.extend(coordinator::check(view, chart, &known));
            findings.extend(unhandled::check(view, chart));
            findings.extend(left_unanswered::check(view, chart));
            findings.extend(led_on::check(view, chart));
            findings.extend(purity::check(view));
        }
        findings.extend(led_below::check(deployment, &charts));
        // Another one may wait for what starts and ends the deployment, and tell the others.
        coupling::forgive_unheard(deployment, &charts, &mut findings);
        traced.extend(findings.into_iter().map(|finding| (finding, Vec::new())));
        // With wrong names in it, a configuration would be refused wherever it is asked for: that is said already.
        if !traced.iter().any(|(finding, _)| finding.is_error()) {
            replayed = Some(Accepted::new(shared.clone()));
            let followed = settings::followed(deployment, &universe);
            let driven = &driven_ports.by_coordinators()[..];
            let those =
                Followed { deployment: &followed, views: &views, charts: &charts, catalogue, effort, around, driven };
            if around.stands_for {
                explored = Explored { complete: true, without_failure: true, ..Explored::default() };
            } else {
                (explored, shows, idle) = follow(&those, &mut traced, &mut left);
            }
            slip_first(&mut traced);
            // Where there is an actuator, more is said of it.
            let said = |finding: &crate::model::Finding| {
                traced.iter().any(|(f, _)| (f.code, f.origin.0) == (finding.code, finding.origin.0))
            };
            let unhandled: Findings = safety::unhandled(deployment, &charts).into_iter().filter(|f| !said(f)).collect();
            traced.extend(unhandled.into_iter().map(|finding| (finding, Vec::new())));
        }
    }
    // Where a request is refused, that is why what it drives is not driven.
    if let Some(idle) = idle.filter(|_| !traced.iter().any(|(finding, _)| finding.is_error())) {
        driven_ports.forget(&idle);
    }
    let undriven = undriven::check(&universe, &driven_ports);
    traced.extend(undriven.into_iter().map(|finding| (finding, Vec::new())));
    traced.sort_by_key(|(finding, _)| Reverse(finding.severity));
    let (findings, traces): (Findings, Vec<_>) = traced.into_iter().unzip();
    let left: Vec<String> = left.into_iter().collect();
    let verdict = CheckVerdict::of(&findings, charts.len() == all, left.clone());
    let checked = (verdict != CheckVerdict::Refused).then(|| Accepted::new(shared.clone()));
    (Report { checked, replayed, findings, traces, explored, left, verdict }, shows)
}

/// A way that stops has stopped at a slip, where there is one: that is said first.
fn slip_first(traced: &mut Traced) {
    let is_slip = |finding: &Finding| {
        let near = finding.help.as_deref().is_some_and(|help| help.starts_with("did "));
        near && [COORD_NEAR_EVENT, COMPOSE_UNKNOWN].contains(&finding.code)
    };
    let Some(slip) = traced.iter().find(|(finding, _)| is_slip(finding)).map(|(slip, _)| slip.in_a_line()) else {
        return;
    };
    let follows = [DEPLOY_NEVER_UP, DEPLOY_NEVER_DOWN, COMPOSE_UNLEFT];
    let stops = |finding: &Finding| follows.contains(&finding.code);
    for (finding, _) in traced.iter_mut().filter(|(finding, _)| stops(finding)) {
        let help = finding.help.take().map(|help| format!(" If that is not it: {help}")).unwrap_or_default();
        finding.help = Some(format!("{slip}{help}"));
    }
}

/// What is followed.
struct Followed<'f, 'e> {
    deployment: &'f Deployment,
    /// The deployment as each of its coordinators sees it.
    views: &'f [Deployment],
    charts: &'f [&'f Chart],
    catalogue: &'f Catalogue,
    effort: Effort<'e>,
    around: &'f Neighbours,
    /// In-ports that coordinators drive, as it is written.
    driven: &'f [MemberRef],
}

/// Follows the coordinators, those together that have to do with each other. `left` is told what was left out. Answers also what they show
/// the parent of their deployment, if it has one and they are all followed together, and which in-ports nothing drives while it is up.
fn follow(
    those: &Followed<'_, '_>,
    traced: &mut Traced,
    left: &mut BTreeSet<String>,
) -> (Explored, Option<Arc<InterfaceAutomaton>>, Option<FxHashSet<MemberRef>>) {
    let Followed { deployment, views, charts, catalogue, effort, around, driven } = *those;
    let (mut shows, mut idle) = (None, None);
    // What functions raise is not known.
    let pure = charts.iter().all(|chart| chart.is_pure());
    let mut explored = Explored { complete: true, without_failure: true, ..Explored::default() };
    let all: Vec<usize> = (0..charts.len()).collect();
    let mut product = Product::new(deployment, views, charts, &all, catalogue);
    product.follow_with(effort);
    product.is_part_of(around);
    // Of several coordinators there are too many ways with all that is known of the order in which subsystems tell things.
    if all.len() == 1 {
        product.stands_in(around, MOST_UNTAKEN);
    }
    let groups = if effort.together { vec![all.clone()] } else { coupling::groups(deployment, catalogue, charts) };
    product.groups.clone_from(&groups);
    let mut found = ways::ways(&mut product);
    product.stands_in(around, MOST_UNTAKEN);
    if product.effort.halted().is_some() {
        // Where it ended says nothing of the ways.
        found.clear();
    }
    let mut asked = product.worlds.asked().clone();
    if product.untimed {
        left.insert(Bound::Times.told(Failed::Nothing, 0, &effort));
    }
    let clocked = charts.iter().any(|chart| chart.is_clocked());
    let known = [(Bound::Ties, product.tied), (Bound::Turns, product.unordered), (Bound::Clocked, clocked)];
    for (bound, _) in known.iter().filter(|(_, is)| *is) {
        left.insert(bound.told(Failed::Nothing, 0, &effort));
        explored.complete = false;
    }
    if groups.len() > 1 && !coupling::by_operator(deployment).is_empty() {
        left.insert(Bound::Begun.told(Failed::Nothing, 0, &effort));
        explored.complete = false;
    }
    if coupling::is_tied(deployment, catalogue, charts, &groups) {
        left.insert(Bound::Tied.told(Failed::Nothing, 0, &effort));
        explored.complete = false;
    }
    let exchanging = Exchanging { deployment, charts, catalogue, around };
    let mut clean: Vec<(Vec<usize>, FxHashSet<ConfigId>, bool)> = Vec::new();
    for numbers in groups {
        // What is found on one is told of that one: only where there is nothing does it stand for another one.
        let like = clean.iter().find_map(|one| Some((one, exchanging.between(&one.0, &numbers)?)));
        if let Some(((_, ids, verified), exchange)) = like {
            asked.extend(ids.iter().map(|id| exchange.id(*id)));
            let shared = coupling::shared(deployment, charts, &numbers, *verified);
            found.extend(shared.into_iter().map(|finding| (finding, Vec::new())));
            continue;
        }
        let before = found.len();
        // Where all have to do with each other, what was planned for the ways is known already.
        let mut apart = (numbers != all).then(|| Product::new(deployment, views, charts, &numbers, catalogue));
        if let Some(apart) = &mut apart {
            apart.never_down = product.never_down;
            apart.follow_with(effort);
            apart.stands_in(around, MOST_UNTAKEN);
        }
        let product = apart.as_mut().unwrap_or(&mut product);
        let mut deeper = Deeper::new(product);
        let mut forgotten = false;
        loop {
            product.follow_anew();
            product.effort = product.most_believed();
            let mut graph = explore(product);
            if !deeper.goes_back(&mut graph) {
                continue;
            }
            if graph.product.knows_children() && graph.is_used_up() && !graph.product.knows_less() {
                // With all that is known of them there is too much of it: with less it may still be found that something was told in vain.
                graph.product.stands_in(around, 1);
                graph.product.follow_with(effort);
                continue;
            }
            if graph.product.knows_less() {
                if !graph.is_used_up() {
                    let certain = |(finding, _): &(Finding, _)| {
                        finding.code == COORD_NO_WAY_DOWN && finding.severity > Severity::Info
                    };
                    found.extend(graph.judge().into_iter().filter(certain));
                }
                graph.product.forget_children();
                graph.product.follow_with(effort);
                forgotten = true;
                continue;
            }
            if deeper.goes_on(&mut graph) {
                continue;
            }
            if !graph.product.minds_stopping {
                graph.cut(Bound::Stopping, Failed::Nothing);
            }
            if graph.product.elsewhere.is_some() {
                graph.cut(Bound::Elsewhere, Failed::Nothing);
            }
            if graph.product.knows_no_order() {
                graph.cut(if forgotten { Bound::Forgotten } else { Bound::Told }, Failed::Nothing);
            }
            if graph.product.fills_children() {
                graph.cut(Bound::Untaken, Failed::Nothing);
            }
            if graph.product.waits_for_others() {
                graph.cut(Bound::Anew, Failed::Nothing);
            }
            if graph.product.others && graph.goes_on_when_down(true) {
                graph.cut(Bound::Apart, Failed::Nothing);
            }
            if around.parent.is_some() && graph.goes_on_when_down(true) {
                graph.cut(Bound::ByItself, Failed::Nothing);
            }
            if graph.goes_on_when_down(false) {
                graph.cut(Bound::Stale, Failed::Nothing);
            }
            if graph.product.worlds.squashes_mixed() {
                graph.cut(Bound::Orders, Failed::Nothing);
            }
            found.extend(graph.judge());
            graph.probe(&found);
            let verified = !graph.is_cut_off();
            if found.len() == before {
                clean.push((numbers.clone(), graph.product.worlds.asked().clone(), verified));
            }
            let shared = coupling::shared(deployment, charts, &numbers, verified);
            found.extend(shared.into_iter().map(|finding| (finding, Vec::new())));
            let told = |(bound, failed): (&Bound, &Failed)| {
                let told = bound.told(*failed, graph.product.most_waiting, &effort);
                match *bound == Bound::Lean && deeper.was_too_much_behind() {
                    true => {
                        format!("{told}: with that there are more than {} transitions (`--budget`)", effort.transitions)
                    }
                    false => told,
                }
            };
            left.extend(graph.bounds.iter().map(told));
            explored = explored.and(graph.explored());
            if let Some(parent) = around.parent.as_ref().filter(|_| numbers == all && verified && pure) {
                shows = graph.derived(parent).map(Arc::new);
            }
            if pure {
                idle = graph.undriven_while_up(driven);
            }
            asked.extend(product.worlds.asked());
            break;
        }
    }
    // Said once, of what none of them asks for.
    let wrong = in_any_system(deployment, &product, &asked);
    found.extend(wrong.into_iter().map(|finding| (finding, Vec::new())));
    found.sort_by_key(|(finding, _)| Reverse(finding.severity));
    for (finding, way) in found {
        // What is said twice of one place is told once, as the worse of both.
        let same = |known: &Finding| {
            let place = (known.code, known.origin.0, &known.path) == (finding.code, finding.origin.0, &finding.path);
            place && known.message == finding.message
        };
        match traced.iter_mut().find(|(known, _)| same(known)) {
            Some((known, _)) if known.severity >= finding.severity => {}
            Some(known) => *known = (finding, way),
            None => traced.push((finding, way)),
        }
    }
    (explored, shows, idle)
}

/// Configurations that the coordinator never asks for can still be applied by an operator. Whether they fit the system
/// then is not known; what is wrong with them in any system is. Of a safe one it is, too, of which as much is done as can be.
fn in_any_system(deployment: &Deployment, product: &Product<'_>, asked: &FxHashSet<ConfigId>) -> Findings {
    const ANYWHERE: [Code; 4] = [CLASH, PRE_ON_CREATED, POST_ON_DESTROYED, TOUCHES_DESTROYED];
    let mut findings = Vec::new();
    for configuration in deployment.configurations.iter().filter(|c| c.safe || !asked.contains(&c.id)) {
        if let Err(refusal) = product.worlds.try_anywhere(configuration) {
            findings.extend(refusal.findings.into_iter().filter(|f| ANYWHERE.contains(&f.code)));
        }
    }
    findings
}

/// What is wrong with the monitors: names, parts of what ports carry, events that nobody hears. `names`: whether the
/// components are all known, so that names can be judged.
pub fn monitors(deployment: &Deployment, catalogue: &Catalogue, names: bool) -> Findings {
    let mut findings = match names {
        true => watched::check(deployment, &universe::Universe::new(deployment, catalogue)),
        false => Vec::new(),
    };
    let written = deployment.charts();
    let charts: Option<Vec<Chart>> = written.map(|chart| crate::statechart::compile(chart).0).collect();
    if let Some(charts) = charts {
        findings.extend(watched::events(deployment, &charts.iter().collect::<Vec<_>>()));
    }
    findings
}

/// What is wrong with the step of a fault, where the deployment runs on the simulated platform.
pub fn fault(fault: &StepFault, deployment: &Deployment, catalogue: &Catalogue) -> Findings {
    simulated::fault(fault, deployment, &universe::Universe::new(deployment, catalogue))
}

/// What is wrong with some configurations by themselves; names are judged against all that the deployment creates.
pub fn configurations(deployment: &Deployment, catalogue: &Catalogue, ids: &[ConfigId]) -> Findings {
    let universe = universe::Universe::new(deployment, catalogue);
    let mut findings = single::some(deployment, &universe, ids);
    findings.extend(declared::holds(deployment, &universe, ids));
    findings
}
