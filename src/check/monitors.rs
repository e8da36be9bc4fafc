//! Monitors against the deployment: do the things exist that they look at, are they numbers, does somebody listen.

use super::listeners::Listeners;
use super::universe::Universe;
use crate::model::codes::{
    MONITOR_EVENT_TAKEN, MONITOR_NO_SUCH_PART, MONITOR_NOT_A_NUMBER, MONITOR_NOT_RUN, MONITOR_UNHEARD, UNKNOWN_ACTIVITY,
};
use crate::model::finding::did_you_mean;
use crate::model::monitor::{Condition, ConditionKind, MONITORS_TYPE, PortSignal, SignalKind, is_monitors};
use crate::model::{
    Change, ComponentName, Deployment, Finding, Findings, Ident, MemberRef, Origin, PortType, ValueType,
};
use crate::statechart::Chart;
use crate::system::MemberClass;

/// What is wrong with the conditions.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let mut check = MonitorCheck { deployment, universe, path: String::new(), findings: Vec::new() };
    for monitor in &deployment.monitors {
        check.path = format!("monitors.{}", monitor.name);
        check.condition(&monitor.when);
    }
    check.findings.extend(never_run(deployment).or_else(|| not_seen(deployment)));
    check.findings
}

/// What is wrong with a condition that is no monitor's, said with that path.
pub fn condition(deployment: &Deployment, universe: &Universe, condition: &Condition, path: String) -> Findings {
    let mut check = MonitorCheck { deployment, universe, path, findings: Vec::new() };
    check.condition(condition);
    check.findings
}

/// Monitors that no component runs.
fn never_run(deployment: &Deployment) -> Option<Finding> {
    let first = deployment.monitors.first()?;
    let runs = |change: &Change| change.kind.makes().is_some_and(|(_, ty, _)| is_monitors(ty));
    if deployment.configurations.iter().flat_map(|c| &c.changes).any(runs) {
        return None;
    }
    let message = format!("no configuration creates a `{MONITORS_TYPE}`: nothing watches `{}`", first.name);
    Some(
        Finding::warning(MONITOR_NOT_RUN, message).at(deployment.key_origin("monitors")).path("monitors").help(
            format!("create a component of the type `{MONITORS_TYPE}` in the bring-up, in an activity of its own"),
        ),
    )
}

/// A monitor that needs no values, which the simulated platform does not have, and is not evaluated there all the same.
fn not_seen(deployment: &Deployment) -> Option<Finding> {
    let reads_states = |condition: &Condition| {
        let mut reads = false;
        condition.for_each(&mut |condition| {
            reads |= matches!(condition.kind, ConditionKind::InState { .. } | ConditionKind::Faulted(_));
        });
        reads
    };
    let first = deployment.monitors.iter().find(|monitor| reads_states(&monitor.when))?;
    (!deployment.kind.shows_values).then(|| {
        let message = format!("the simulated platform evaluates no monitors, and `{}` raises nothing there", first.name);
        Finding::info(MONITOR_NOT_RUN, message).at(first.origin).path(format!("monitors.{}", first.name)).help(
            "try it on the platform whose components run; what fails is told by `COMPONENT.faulted` on the simulated one, too",
        )
    })
}

/// What is wrong with the events.
pub fn events(deployment: &Deployment, charts: &[&Chart]) -> Findings {
    let mut findings = Vec::new();
    let listeners = Listeners::new(deployment, charts);
    for monitor in &deployment.monitors {
        for event in monitor.events() {
            let path = format!("monitors.{}", monitor.name);
            let text = event.as_str();
            if deployment.never_from_outside(text).is_some() {
                let message = format!("the monitor `{}` raises `{event}`, which tells of something else", monitor.name);
                findings.push(Finding::error(MONITOR_EVENT_TAKEN, message).at(monitor.origin).path(path).help(
                    "answers of the configurator and the events of the statechart itself cannot be made by a monitor: \
                     give its event another name, such as `e_aligned`",
                ));
            } else if !listeners.listen_to(event) {
                let message = format!("nobody listens to `{event}` of the monitor `{}`", monitor.name);
                let finding = Finding::warning(MONITOR_UNHEARD, message).at(monitor.origin).path(path);
                findings.push(finding.help(listeners.advice(event)));
            }
        }
    }
    findings
}

struct MonitorCheck<'a> {
    deployment: &'a Deployment,
    universe: &'a Universe,
    path: String,
    findings: Findings,
}

impl MonitorCheck<'_> {
    fn add(&mut self, finding: Finding) {
        self.findings.push(finding.path(self.path.clone()));
    }

    fn condition(&mut self, condition: &Condition) {
        condition.for_each(&mut |condition| match &condition.kind {
            ConditionKind::IsTrue(port) => self.number(port, condition.origin),
            ConditionKind::InState { component, .. } | ConditionKind::Faulted(component) => {
                self.component(*component, condition.origin);
            }
            ConditionKind::Silent { port, .. } => _ = self.port(*port, condition.origin),
            _ => {}
        });
        condition.for_each_signal(&mut |signal| match &signal.kind {
            SignalKind::Port(port) => self.number(port, signal.origin),
            SignalKind::Age(port) | SignalKind::Rate { port, .. } => _ = self.port(*port, signal.origin),
            SignalKind::Activity { activity, .. } => self.activity(*activity, signal.origin),
            _ => {}
        });
    }

    fn component(&mut self, component: ComponentName, at: Origin) -> bool {
        let known = !self.universe.of(component).is_empty();
        if !known {
            self.add(self.universe.unknown(component, at));
        }
        known
    }

    fn activity(&mut self, activity: Ident, at: Origin) {
        if !self.deployment.activities.contains_key(&activity) {
            let known = self.deployment.activities.keys().map(Ident::as_str);
            self.add(
                Finding::error(UNKNOWN_ACTIVITY, format!("the deployment has no activity `{activity}`"))
                    .at(at)
                    .help(did_you_mean(activity.as_str(), "activities", known)),
            );
        }
    }

    /// The types of the port, in each of the ways in which its component is created; a finding when there is none.
    fn port(&mut self, port: MemberRef, at: Origin) -> Vec<PortType> {
        if !self.component(port.component, at) {
            return Vec::new();
        }
        if let Some(finding) = self.universe.lacks(MemberClass::Port, port, at) {
            self.add(finding);
            return Vec::new();
        }
        let types: Option<Vec<_>> = self.universe.of(port.component).iter().map(|c| c.description.as_ref()).collect();
        // That a type is unknown is said where it is created.
        types.into_iter().flatten().filter_map(|ty| ty.port(port.member).cloned()).collect()
    }

    fn number(&mut self, signal: &PortSignal, at: Origin) {
        let ports = self.port(signal.member, at);
        let wrong: Vec<Finding> = ports.iter().filter_map(|port| part(signal, &port.ty)).collect();
        // One of the types it may be created as is enough: which one it is, is known when it runs.
        if wrong.len() == ports.len()
            && let Some(finding) = wrong.into_iter().next()
        {
            let declared = ports.first().map_or(Origin::NONE, |port| port.origin);
            let finding = finding.at(at);
            self.add(if declared.is_some() { finding.also(declared, "the port") } else { finding });
        }
    }
}

/// What is wrong with the way to a number in a value of that type.
fn part(signal: &PortSignal, whole: &ValueType) -> Option<Finding> {
    let (code, wrong) = match signal.part(whole) {
        Err(wrong) => (MONITOR_NO_SUCH_PART, wrong),
        Ok(ty) => (MONITOR_NOT_A_NUMBER, signal.is_number(ty).err()?),
    };
    Some(Finding::error(code, wrong.message).help(wrong.help))
}
