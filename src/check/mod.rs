//! Is it sound: everything that can be said about a deployment before it runs. One file per family.
//!
//! Pure: no I/O, no clock, no platform. A [`Checked`] deployment can come only from here, and whoever starts something
//! takes nothing else, so nothing runs that was not looked at.

mod beside;
mod configurations;
mod coordinator;
mod declared;
mod drive;
mod explore;
mod joint;
mod monitors;
mod product;
mod purity;
mod reactions;
mod simulated;
mod together;
mod types;
mod unheard;
mod universe;
mod world;

use crate::model::codes::{
    CLASH, DEPLOY_LEFTOVERS, DEPLOY_NEVER_DOWN, DEPLOY_NEVER_UP, POST_ON_DESTROYED, PRE_ON_CREATED, TOUCHES_DESTROYED,
    UNKNOWN_COMPONENT,
};
use crate::model::{Catalogue, Code, ConfigId, Deployment, Finding, Findings, Ident, Severity, finding};
use crate::statechart::Chart;
use crate::system::View;
pub use drive::{Drive, Happening, Until, drive};
use rustc_hash::FxHashSet;
use serde::Serialize;
use std::ops::Deref;
use std::sync::Arc;

/// Something in which `check` found nothing that refuses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked<T>(Arc<T>);

impl<T> Checked<T> {
    /// The thing itself, to be shared; no longer known to be checked.
    pub fn share(&self) -> Arc<T> {
        self.0.clone()
    }
}

impl<T> Deref for Checked<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

/// How far the coordinator was followed through events and answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Explored {
    /// States of coordinator, system, stack and waiting requests together.
    pub states: usize,
    /// Events and answers followed from them.
    pub transitions: usize,
    /// Whether that was all there is.
    pub complete: bool,
    /// States that were met and not followed further, because the budget was used up.
    pub unfollowed: usize,
    /// Whether every way was followed to its end on which no request fails.
    pub without_failure: bool,
    /// Of several coordinators: whether they were followed together, to the end. Else each was followed alone.
    pub together: Option<bool>,
}

impl Explored {
    /// This and another one, as one.
    fn and(self, other: Self) -> Self {
        Self {
            states: self.states + other.states,
            transitions: self.transitions + other.transitions,
            complete: self.complete && other.complete,
            unfollowed: self.unfollowed + other.unfollowed,
            without_failure: self.without_failure && other.without_failure,
            together: self.together.or(other.together),
        }
    }
}

/// What `check` has to say.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The deployment, if nothing refuses it.
    pub checked: Option<Checked<Deployment>>,
    /// Everything found, errors first.
    pub findings: Findings,
    /// How far the coordinator was followed.
    pub explored: Explored,
    /// The shortest way to the first finding that has one: events and answers, one a line; else empty.
    pub trace: Vec<String>,
}

/// Checks a deployment against the component types it may use (those of its libraries and those it declares).
pub fn run(deployment: impl Into<Arc<Deployment>>, catalogue: &Catalogue) -> Report {
    let shared = deployment.into();
    let deployment = &*shared;
    let universe = universe::Universe::new(deployment, catalogue);
    let mut findings = types::check(deployment, catalogue);
    findings.extend(configurations::check(deployment, catalogue, &universe));
    findings.extend(monitors::check(deployment, &universe));
    findings.extend(simulated::check(deployment, &universe));
    findings.extend(declared::check(deployment, &universe));
    let written = deployment.charts();
    let mut charts = Vec::new();
    let mut all = 0;
    for chart in written {
        let (chart, problems) = crate::statechart::compile(chart);
        findings.extend(problems);
        charts.extend(chart);
        all += 1;
    }
    let mut looked = Looked {
        charts: charts.iter().collect(),
        names: deployment.coordinators.iter().map(|c| c.name).collect(),
        entangled: false,
        catalogue,
        findings,
        explored: Explored::default(),
        trace: Vec::new(),
        alone: Vec::new(),
    };
    if charts.len() == all {
        looked.entangled = !beside::shared(deployment, &looked.charts, false).is_empty();
        looked.explored.complete = true;
        looked.explored.without_failure = true;
        looked.findings.extend(monitors::events(deployment, &looked.charts));
        looked.findings.extend(simulated::events(deployment, &looked.charts));
        if all == 1 {
            looked.at(deployment, 0, "");
        } else {
            let of = |number| beside::view(deployment, &looked.charts, number);
            let views: Vec<Deployment> = (0..all).filter_map(of).collect();
            for (number, (seen, name)) in views.iter().zip(deployment.coordinators.iter().map(|c| c.name)).enumerate() {
                looked.at(seen, number, &format!("{name}: "));
            }
            looked.together(deployment, &views);
        }
    }
    let Looked { explored, trace, mut findings, .. } = looked;
    findings.sort_by_key(|f| std::cmp::Reverse(f.severity));
    let sound = charts.len() == all && !finding::has_errors(&findings);
    Report { checked: sound.then(|| Checked(shared.clone())), findings, explored, trace }
}

/// What following the coordinators found.
struct Looked<'a> {
    charts: Vec<&'a Chart>,
    names: Vec<Ident>,
    /// They touch the same components: what one alone leads to is not all there is to know.
    entangled: bool,
    catalogue: &'a Catalogue,
    findings: Findings,
    explored: Explored,
    trace: Vec<String>,
    /// What following each of several alone gave.
    alone: Vec<explore::Exploration>,
}

impl Looked<'_> {
    /// Follows several together, if they are few; `views` are the deployment as each sees it.
    fn together(&mut self, deployment: &Deployment, views: &[Deployment]) {
        let possible = self.alone.len() == views.len() && joint::few(deployment, &self.charts);
        let followed = possible.then(|| {
            let mut joint = together::Together::new(deployment, views, &self.charts, self.catalogue);
            joint::follow(&mut joint, &self.alone)
        });
        let verified = followed.as_ref().is_some_and(|followed| followed.explored.complete);
        self.explored.together = Some(verified);
        // Alone is all there is to know of those that touch nothing in common.
        self.explored.complete &= verified || !self.entangled;
        self.findings.extend(beside::shared(deployment, &self.charts, verified));
        let Some(followed) = followed else { return };
        self.explored.states += followed.explored.states;
        self.explored.transitions += followed.explored.transitions;
        self.explored.unfollowed += followed.explored.unfollowed;
        // What they do to each other is harder to see than what one does alone: the way to it goes before that to a warning.
        if !finding::has_errors(&self.findings) && followed.findings.iter().any(|(_, way)| !way.is_empty()) {
            self.trace.clear();
        }
        for (finding, way) in followed.findings {
            self.tell(finding, way, "");
        }
    }

    fn tell(&mut self, finding: Finding, way: Vec<String>, name: &str) {
        if self.findings.iter().any(|f| f.code == finding.code && f.message == finding.message) {
            return;
        }
        if self.trace.is_empty() {
            self.trace = way.into_iter().map(|line| format!("{name}{line}")).collect();
        }
        self.findings.push(finding);
    }

    /// Looks at one coordinator and follows it. `name` is written before the lines of its trace.
    fn at(&mut self, deployment: &Deployment, number: usize, name: &str) {
        let (chart, findings) = (self.charts[number], &mut self.findings);
        findings.extend(coordinator::check(deployment, chart));
        // Another one may wait for what starts and ends the deployment, and tell this one.
        beside::forgive_unheard(deployment, &self.charts, findings);
        // With wrong names in it, a configuration would be refused wherever it is asked for: that is said already.
        if finding::has_errors(findings) {
            self.explored.complete = false;
            self.explored.without_failure = false;
            return;
        }
        let mut product = drive::product(deployment, chart, self.catalogue);
        let mut traced = ways(deployment, chart, &mut product);
        let exploration = explore::explore(&mut product);
        self.explored = self.explored.and(exploration.explored);
        // Said once, of what none of them asks for.
        if number + 1 == self.charts.len() {
            let others = self.charts[..number].iter().flat_map(|other| beside::asked(deployment, other));
            findings.extend(unasked(deployment, &product, others.collect()));
        }
        let mut exploration = exploration;
        traced.append(&mut exploration.findings);
        self.alone.push(exploration);
        traced.sort_by_key(|(f, _)| std::cmp::Reverse(f.severity));
        for (mut finding, way) in traced {
            // Alone, it never meets what another one makes.
            if let Some((other, by, component)) = beside::maker(deployment, &self.charts, number, &finding) {
                if finding.code == UNKNOWN_COMPONENT {
                    continue;
                }
                let other = self.names[other];
                finding.help = Some(format!(
                    "`{component}` comes with `{by}`, which `{other}` asks for: ask for this one when that is there, \
                     which `{other}` can tell by an event"
                ));
            }
            // What functions decide, or what the components of another coordinator would change, is not known here.
            if (!chart.is_pure() || self.entangled) && finding.severity == Severity::Error {
                finding.severity = Severity::Warning;
            }
            self.tell(finding, way, name);
        }
    }
}

/// Configurations that the coordinator never asks for can still be applied by an operator. Whether they fit the system
/// then is not known; what is wrong with them in any system is.
fn unasked(deployment: &Deployment, product: &product::Product<'_>, mut asked: FxHashSet<ConfigId>) -> Findings {
    const ANYWHERE: [Code; 4] = [CLASH, PRE_ON_CREATED, POST_ON_DESTROYED, TOUCHES_DESTROYED];
    let mut findings = Vec::new();
    asked.extend(product.worlds.asked());
    for configuration in deployment.configurations.iter().filter(|c| !asked.contains(&c.id)) {
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
        true => monitors::check(deployment, &universe::Universe::new(deployment, catalogue)),
        false => Vec::new(),
    };
    let written = deployment.charts();
    let charts: Option<Vec<Chart>> = written.map(|chart| crate::statechart::compile(chart).0).collect();
    if let Some(charts) = charts {
        findings.extend(monitors::events(deployment, &charts.iter().collect::<Vec<_>>()));
    }
    findings
}

/// What is wrong with some configurations by themselves; names are judged against all that the deployment creates.
pub fn configurations(deployment: &Deployment, catalogue: &Catalogue, ids: &[ConfigId]) -> Findings {
    let universe = universe::Universe::new(deployment, catalogue);
    let mut findings = configurations::some(deployment, catalogue, &universe, ids);
    findings.extend(declared::holds(deployment, &universe, ids));
    findings
}

/// Bring-up and shutdown must work when everything goes well.
fn ways(deployment: &Deployment, chart: &Chart, product: &mut product::Product<'_>) -> Vec<(Finding, Vec<String>)> {
    let Some((rise, fall)) = drive::ways(product) else { return Vec::new() };
    let mut found = Vec::new();
    let tell = |product: &product::Product<'_>, way: &drive::Way| -> Vec<String> {
        std::iter::once(format!("start → {}", chart.fqn(way.from.leaf)))
            .chain(way.moves.iter().map(|(by, to)| product.tell(by, to)))
            .collect()
    };
    let stops = |way: &drive::Way, code, key: &str, goal: &str, what: &str| {
        let at = chart.fqn(way.end().leaf).to_string();
        let mut finding = match &way.refused {
            Some((ask, reasons)) => {
                let why = reasons.first().map_or("", |f| f.message.as_str());
                let mut finding =
                    Finding::error(code, format!("{what} stops at `{at}`: `{ask}` is refused, because {why}"));
                for reason in reasons.iter().filter(|r| r.origin.is_some()).take(4) {
                    finding = finding.also(reason.origin, reason.message.clone());
                }
                finding
            }
            None => Finding::error(code, format!("{what} stops at `{at}` and never reaches `{goal}`"))
                .also(chart.origin(way.end().leaf), "stops here, even if every request succeeds"),
        };
        if let Some(help) = way.refused.as_ref().and_then(|(_, r)| r.first()).and_then(|f| f.help.clone()) {
            finding = finding.help(help);
        } else {
            finding = finding.help("look at the trace: which event does the coordinator wait for at its end?");
        }
        finding.at(deployment.key_origin(key)).path(key)
    };
    // The reasons of a refusal are findings of their own, each at its place.
    for way in [Some(&rise), fall.as_ref()].into_iter().flatten() {
        if let Some((_, reasons)) = &way.refused {
            found.extend(reasons.iter().map(|reason| (reason.clone(), tell(product, way))));
        }
    }
    if !rise.reached {
        found.push((
            stops(&rise, DEPLOY_NEVER_UP, "deploy.up", &deployment.first_coordinator().up, "the bring-up"),
            tell(product, &rise),
        ));
    }
    if let Some(fall) = fall {
        let way = tell(product, &fall);
        if fall.reached {
            let mut left = Vec::new();
            let world = product.worlds.get(fall.end().world);
            world.system.for_each_component(&mut |node| left.push(node.name.to_string()));
            left.sort();
            if !left.is_empty() {
                let more = if left.len() > 6 { format!(" and {} more", left.len() - 6) } else { String::new() };
                left.truncate(6);
                let message = format!("the shutdown leaves {}{more} behind", left.join(", "));
                let finding = Finding::error(DEPLOY_LEFTOVERS, message)
                    .at(deployment.key_origin("shutdown.down"))
                    .path("shutdown.down")
                    .help(
                        "let the coordinator undo what it applied, or apply a configuration that destroys what is left",
                    );
                found.push((finding, way));
            }
        } else {
            found.push((
                stops(&fall, DEPLOY_NEVER_DOWN, "shutdown.down", &deployment.first_coordinator().down, "the shutdown"),
                way,
            ));
        }
    }
    found
}
