//! From a checked deployment to one that is alive.

use super::Checked;
use super::platforms::{Make, Making};
use crate::functions::Opener;
use crate::limits;
use crate::model::{Coordinator, Deployment, FaultKind, Finding, Findings, Severity, SimulatedReaction, StepFault};
use crate::platform::Platform;
use crate::platform::simulated::{self, Fault, FaultRule, Simulated, StepPattern};
use crate::session::{Session, SessionSetup};
use crate::statechart;
use crate::time::Clock;
use std::sync::Arc;

/// Why a checked deployment could not be started.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StartError {
    /// The platform could not be made.
    #[error("the platform `{name}` cannot be made: {why}")]
    Platform {
        /// Its name.
        name: String,
        /// Why, in its own words.
        why: String,
    },
    /// The platform has component types otherwise than the deployment was checked with them, so that its plans could fail there.
    #[error("the platform `{name}` has other component types than the deployment was checked with: {}", told(.findings))]
    Types {
        /// Its name.
        name: String,
        /// Each difference.
        findings: Findings,
    },
    /// It is a part of something larger, and cannot do without what its parent connects.
    #[error("{}", .finding.message)]
    Part {
        /// What says so (`deploy::part`).
        finding: Box<Finding>,
    },
    /// The functions of the coordinator could not be opened.
    #[error("the coordinator's functions cannot be run: {why}")]
    Functions {
        /// Why.
        why: String,
    },
}

/// The first few differences, in words.
fn told(findings: &Findings) -> String {
    let told: Vec<&str> = findings.iter().take(3).map(|finding| finding.message.as_str()).collect();
    match findings.len().checked_sub(told.len()) {
        None | Some(0) => told.join("; "),
        Some(more) => format!("{}; and {more} more", told.join("; ")),
    }
}

/// What the deployment says that its components raise by themselves, for a simulated platform of one's own making.
pub fn reactions(deployment: &Deployment) -> Vec<simulated::Reaction> {
    let one = |reaction: &SimulatedReaction| simulated::Reaction {
        on: StepPattern::new(&reaction.after),
        after: reaction.delay,
        raise: reaction.raise,
        component: reaction.component,
    };
    deployment.reactions.iter().map(one).collect()
}

/// What the deployment says that goes wrong, for a simulated platform of one's own making.
pub fn faults(deployment: &Deployment) -> simulated::Faults {
    simulated::Faults::new(deployment.faults.iter().map(rule))
}

/// What a fault in a deployment or script means to the platform.
pub(super) fn rule(fault: &StepFault) -> FaultRule {
    let what = match fault.how {
        FaultKind::Fail => Fault::Fail,
        FaultKind::Hang => Fault::Hang { returns: None },
        FaultKind::Late => Fault::Hang { returns: Some(limits::FAULT_LATE) },
        FaultKind::Lost => Fault::LostRequest,
        FaultKind::Lie => Fault::FalseDone,
        FaultKind::Slow => Fault::Slow(fault.takes),
    };
    FaultRule::on(&fault.step, what).times(fault.times)
}

/// Makes the deployment's platform and starts its session. Nothing happens until it is brought up.
///
/// # Errors
/// When the deployment is a part of something larger, the platform cannot be made, or the functions of a coordinator cannot be run.
pub fn start(checked: &Checked, clock: &Clock) -> Result<Arc<Session>, StartError> {
    start_open(checked, clock, Played::AsWritten).map(|(session, _)| session)
}

/// Who says what components of a simulated platform raise by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Played {
    /// The deployment.
    AsWritten,
    /// The deployment, and somebody who may add faults while it runs.
    Steered,
    /// Only a script that goes a way: what components raise on it, it raises itself.
    Replayed,
}

/// The same, with the platform too, if it is the simulated one.
pub(super) fn start_open(
    checked: &Checked,
    clock: &Clock,
    played: Played,
) -> Result<(Arc<Session>, Option<Simulated>), StartError> {
    let deployment = &checked.deployment;
    if let Some(finding) = crate::check::part(deployment, &checked.catalogue, Severity::Error) {
        return Err(StartError::Part { finding: Box::new(finding) });
    }
    // Once here, to say what is wrong; then on each coordinator's own thread, from the same text.
    for opener in openers(checked).into_iter().flatten() {
        opener.open(None).map_err(|failure| StartError::Functions { why: failure.to_string() })?;
    }
    let making = Making { checked, clock, options: &deployment.platform_options };
    let (platform, simulated): (Arc<dyn Platform>, _) = match &checked.platform.make {
        Make::Embedded => (making.embedded(), None),
        Make::Simulated => {
            let reactions = if played == Played::Replayed { Vec::new() } else { reactions(deployment) };
            let options = simulated::SimulatedOptions {
                faults: faults(deployment),
                reactions,
                blocking: played != Played::AsWritten,
                ..simulated::SimulatedOptions::default()
            };
            let platform = Simulated::new(checked.catalogue.clone(), clock.clone(), options);
            (Arc::new(platform.clone()), Some(platform))
        }
        Make::Own(make) => {
            let name = deployment.platform.to_string();
            let platform = make(&making).map_err(|why| StartError::Platform { name: name.clone(), why })?;
            let findings = crate::check::on_platform(deployment, &checked.catalogue, platform.catalogue());
            if !findings.is_empty() {
                return Err(StartError::Types { name, findings });
            }
            (platform, None)
        }
    };
    Ok((start_on(checked, platform, clock), simulated))
}

/// The same, on a platform of the caller's.
pub fn start_on(checked: &Checked, platform: Arc<dyn Platform>, clock: &Clock) -> Arc<Session> {
    let charts = checked.deployment.charts().map(|written| {
        let (chart, _) = statechart::compile(written);
        Arc::new(chart.expect("a checked deployment's coordinators compile"))
    });
    let host = checked.platform.functions_of(&platform, clock);
    // What a platform offers names components as from outside: it is for the deployment's own file.
    let own = checked.deployment.coordinators.iter().map(|own| own.of.is_none());
    let openers = openers(checked).into_iter().zip(own);
    let openers = openers.map(|(opener, own)| match own {
        true => opener.map(|opener| opener.with_host(host.clone())),
        false => opener,
    });
    Session::start(SessionSetup {
        deployment: checked.deployment.share(),
        functions: openers.collect(),
        charts: charts.collect(),
        catalogue: checked.catalogue.clone(),
        platform,
        clock: clock.clone(),
    })
}

/// What opens the functions of a deployment's coordinators, by coordinator; none for those that have none.
fn openers(checked: &Checked) -> Vec<Option<Opener>> {
    let deployment = &checked.deployment;
    let opener = |own: &Coordinator| {
        let program = deployment.programs.get(&own.name)?;
        Some(Opener::new(program.clone(), Arc::new(own.chart.clone())).within(own.of))
    };
    deployment.coordinators.iter().map(opener).collect()
}
