//! What a file declares and nothing in it leads to: a configuration that nobody asks for, a subsystem that nobody begins.

use super::children::is_unbidden;
use super::coupling::{asked, by_operator};
use crate::model::codes::{COMPOSE_UNBEGUN, CONF_UNASKED};
use crate::model::{ConfigId, Configuration, Deployment, Finding, Findings, Subsystem};
use crate::statechart::Chart;
use std::collections::BTreeSet;

/// So many are named in the note.
const SHOWN: usize = 4;

/// What of a file is never asked for. `charts` are its coordinators, compiled: where functions of one raise events, nothing is known of that.
pub fn check(own: &Deployment, charts: &[&Chart]) -> Findings {
    if !charts.iter().all(|chart| chart.is_pure()) {
        return Vec::new();
    }
    let mut known: BTreeSet<ConfigId> = charts.iter().flat_map(|chart| asked(own, chart)).collect();
    known.extend(by_operator(own));
    known.extend(own.shutdown.rest.iter().map(|(id, _)| *id));
    known.extend(own.subsystems.iter().map(|subsystem| ConfigId::from(subsystem.name)));
    let configurations: Vec<&Configuration> = own.configurations.iter().filter(|c| !known.contains(&c.id)).collect();
    let subsystems = own.subsystems.iter().filter(|subsystem| is_never_begun(own, subsystem, charts));
    unasked(&configurations).into_iter().chain(subsystems.map(unbegun)).collect()
}

/// One note of all: files of configurations are shared, and each coordinator asks for some of them.
fn unasked(all: &[&Configuration]) -> Option<Finding> {
    let first = all.first()?;
    let names: Vec<String> = all.iter().take(SHOWN).map(|configuration| format!("`{}`", configuration.id)).collect();
    let more = all.len().saturating_sub(SHOWN);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let (them, they) = if all.len() == 1 { ("it", "it is") } else { ("them", "they are") };
    let message =
        format!("{}{more}: no coordinator asks for {them}, and `operator:` does not list {them}", names.join(", "));
    let finding = Finding::info(CONF_UNASKED, message).at(first.origin).path(format!("configurations.{}", first.id));
    Some(finding.help(format!(
        "{they} applied by force only; ask for {them} in a state (`entry`, `config`) where that is not meant, or list {them} under `operator:`"
    )))
}

/// Whether nothing raises the event that begins a subsystem.
fn is_never_begun(own: &Deployment, subsystem: &Subsystem, charts: &[&Chart]) -> bool {
    let begins = subsystem.own.deploy.event.within(subsystem.name);
    let raised = charts.iter().any(|chart| chart.raises().iter().any(|site| site.name == begins));
    // One that an operator may raise in its parent's place.
    !raised && !is_unbidden(subsystem) && !own.safety.iter().any(|(event, _)| *event == begins)
}

fn unbegun(of: &Subsystem) -> Finding {
    let begins = of.own.deploy.event.within(of.name);
    Finding::warning(COMPOSE_UNBEGUN, format!("nobody begins `{}`: no coordinator raises `{begins}`", of.name))
        .at(of.origin)
        .path(format!("subsystems.{}", of.name))
        .help(format!(
            "raise `{begins}` in a state of the bring-up (`entry`), and wait for `{}/up`; or delete the subsystem",
            of.name
        ))
}
