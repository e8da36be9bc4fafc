//! What configurations mean before anything runs: by name, or as the coordinators ask for them on their way.

use super::Read;
use crate::check::{self, Drive, Until, WayEvent};
use crate::model::codes::{CLI_UNKNOWN_CONFIGURATION, DEPLOY_NEVER_DOWN, DEPLOY_NEVER_UP, UNKNOWN_COMPONENT};
use crate::model::finding::{configuration, did_you_mean, has_errors};
use crate::model::{Ask, ComponentName, ConfigId, Configuration, Deployment, Finding, Findings, Ident, Snapshot};
use crate::plan::{PlanContext, PlannedStep};
use crate::stack::{Op, Requester, Stack, transaction};
use crate::system::{System, step};
use crate::time::Time;
use std::collections::BTreeMap;
use std::sync::Arc;

/// One planned application of what a coordinator, or whoever plans, asks for together.
#[derive(Debug, Clone)]
pub struct Application {
    /// The coordinator that asks, of several.
    pub coordinator: Option<String>,
    /// What was asked for.
    pub asks: Vec<Ask>,
    /// Events that come before it.
    pub events: Vec<String>,
    /// The coordinator's state after it, when it is driven.
    pub state: Option<String>,
    /// The steps.
    pub steps: Vec<PlannedStep>,
    /// The system after it.
    pub result: Snapshot,
}

/// What is wrong in the texts of these configurations.
fn of_texts(read: &Read, ids: &[ConfigId]) -> Findings {
    let about = |f: &&Finding| configuration(f).is_some_and(|name| ids.iter().any(|id| id.as_str() == name));
    read.findings.iter().filter(|f| f.is_error()).filter(about).cloned().collect()
}

/// What is wrong with configurations that were not asked for, which refuses nothing: everything but what is `told` already.
///
/// Where a text could not be read, only that is said: what a configuration lacks then makes wrong names of others.
pub fn wrong_in_others(read: &Read, told: &[Finding]) -> Findings {
    let mut wrong: Findings = read.findings.iter().filter(|f| f.is_error()).cloned().collect();
    if wrong.is_empty() {
        let all: Vec<ConfigId> = read.deployment.configurations.iter().map(|c| c.id).collect();
        wrong = check::configurations(&read.deployment, &read.catalogue, &all);
        wrong.retain(Finding::is_error);
    }
    wrong.retain(|f| !told.contains(f));
    wrong
}

/// Planning begins with nothing deployed: what creates what is not there then has to be named, too.
fn begins_with_nothing(deployment: &Deployment, id: ConfigId, findings: &mut [Finding]) {
    let others = || deployment.configurations.iter().filter(|c| c.id != id);
    let creates = |c: &Configuration, is: &dyn Fn(ComponentName) -> bool| {
        c.changes.iter().filter_map(|change| change.kind.makes()).any(|(component, ..)| is(component))
    };
    let missing = |component: ComponentName| {
        let named = format!("`{component}`");
        findings.iter().any(|finding| finding.code == UNKNOWN_COMPONENT && finding.message.contains(&named))
    };
    let mut creators: Vec<&str> = others().filter(|c| creates(c, &missing)).map(|c| c.id.as_str()).collect();
    // What nothing creates may be a slip: then what the same file creates is shown.
    if creators.is_empty() {
        let own = others().filter(|c| c.id.prefix() == id.prefix() && creates(c, &|_| true));
        creators = own.map(|c| c.id.as_str()).take(3).collect();
    }
    for finding in findings.iter_mut().filter(|f| f.code == UNKNOWN_COMPONENT && !creators.is_empty()) {
        finding.help = Some(format!(
            "configurations are planned one after the other, beginning with nothing deployed: name what creates it before, as in `{} {id}`",
            creators.join(" ")
        ));
    }
}

/// Plans the configurations of these names, one after the other, beginning with nothing deployed. What is wrong with others
/// refuses nothing (`wrong_in_others` tells it).
///
/// # Errors
/// Unknown names, and everything for which one is refused.
pub fn plan(read: &Read, names: &[impl AsRef<str>]) -> Result<Vec<Application>, Findings> {
    let deployment = &read.deployment;
    let mut ids = Vec::new();
    let mut unknown = Vec::new();
    for name in names.iter().map(AsRef::as_ref) {
        match ConfigId::new(name).ok().filter(|id| deployment.configuration(*id).is_some()) {
            Some(id) => ids.push(id),
            None => {
                let known = deployment.configurations.iter().map(|c| c.id.as_str());
                unknown.push(
                    Finding::error(CLI_UNKNOWN_CONFIGURATION, format!("there is no configuration `{name}`"))
                        .help(did_you_mean(name, "configurations", known)),
                );
            }
        }
    }
    if !unknown.is_empty() {
        return Err(unknown);
    }
    let unread = of_texts(read, &ids);
    if !unread.is_empty() {
        return Err(unread);
    }
    let wrong = check::configurations(deployment, &read.catalogue, &ids);
    if has_errors(&wrong) {
        return Err(wrong);
    }
    let context = PlanContext::of(deployment);
    let mut system = System::new(Arc::new(read.catalogue.clone()));
    let mut stack = Stack::new(deployment.limits.stack);
    let mut planned = Vec::new();
    for id in ids {
        let Some(configuration) = deployment.configuration(id) else { continue };
        let request = Op::Push { configuration, requester: Requester::Operator, at: Time::default(), scope: None };
        let transaction = transaction(&system, &stack, &[request], &context).map_err(|mut refusal| {
            if planned.is_empty() {
                begins_with_nothing(deployment, id, &mut refusal.findings);
            }
            refusal.findings
        })?;
        for planned in transaction.steps.iter() {
            step::effect(&planned.step, &mut system);
        }
        planned.push(Application {
            coordinator: None,
            asks: vec![Ask::Apply(id)],
            events: Vec::new(),
            state: None,
            steps: transaction.steps.to_vec(),
            result: system.snapshot(),
        });
        stack.commit(transaction);
    }
    Ok(planned)
}

/// Plans what the coordinators ask for on their way, every request answered *ok*.
///
/// # Errors
/// Findings of the coordinator, and why it does not arrive.
pub fn plan_way(read: &Read, until: Until) -> Result<Vec<Application>, Findings> {
    let (drive, arrived) = drive(read, until)?;
    arrived?;
    let several = read.deployment.coordinators.len() > 1;
    // What each has heard since it last asked for something: with several, in between others may ask.
    let mut heard: BTreeMap<Ident, Vec<String>> = BTreeMap::new();
    let mut planned = Vec::new();
    for happening in drive.happenings {
        match happening {
            WayEvent::Event { coordinator, event, .. } => heard.entry(coordinator).or_default().push(event),
            WayEvent::Applied { coordinator, asks, steps, result, state } => planned.push(Application {
                events: heard.remove(&coordinator).unwrap_or_default(),
                coordinator: several.then(|| coordinator.to_string()),
                asks,
                state: Some(state),
                steps,
                result,
            }),
        }
    }
    Ok(planned)
}

/// Drives the coordinators; with what is wrong when one does not arrive.
///
/// # Errors
/// When it cannot be driven at all.
pub fn drive(read: &Read, until: Until) -> Result<(Drive, Result<(), Findings>), Findings> {
    let deployment = &read.deployment;
    let Some(drive) = check::drive(deployment, &read.catalogue, until) else {
        return Err(check::run(deployment.clone(), &read.catalogue).findings);
    };
    let own = deployment.coordinator_named(drive.coordinator).unwrap_or(deployment.first_coordinator());
    let (code, what, key, goal) = match until {
        Until::Up => (DEPLOY_NEVER_UP, "the bring-up", "deploy.up", &own.up),
        Until::Down => (DEPLOY_NEVER_DOWN, "the shutdown", "shutdown.down", &own.down),
    };
    let of = |state: &str| {
        if deployment.coordinators.len() > 1 { format!("{}:{state}", own.name) } else { state.to_owned() }
    };
    let stops = format!("{what} stops at `{}`", of(&drive.state));
    let on_the_way = drive.happenings.iter().flat_map(|happening| match happening {
        WayEvent::Applied { asks, .. } => asks.as_slice(),
        WayEvent::Event { .. } => &[],
    });
    let on_the_way = on_the_way.chain(drive.refused.iter().map(|(ask, _)| ask));
    let applied = on_the_way.filter_map(|ask| if let Ask::Apply(id) = ask { Some(*id) } else { None });
    let unread = of_texts(read, &applied.collect::<Vec<_>>());
    let arrived = if !unread.is_empty() {
        Err(unread)
    } else if let Some((ask, findings)) = &drive.refused {
        let mut all = vec![
            Finding::error(code, format!("{stops}: `{ask}` is refused"))
                .at(deployment.key_origin(key))
                .help("see the findings below for the reason"),
        ];
        all.extend(findings.iter().cloned());
        Err(all)
    } else if drive.reached {
        Ok(())
    } else {
        Err(vec![
            Finding::error(code, format!("{stops} and never reaches `{}`", of(goal)))
                .at(deployment.key_origin(key))
                .help("`davit check` shows the way there"),
        ])
    };
    Ok((drive, arrived))
}
