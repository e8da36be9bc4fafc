//! That a safe configuration lets go of what another one of its group has made safe.
//!
//! Alternatives replace one another: the frame that was in force is undone, and what it had called is taken back, before the
//! next one acts. What both call is not taken back in between (`stack/share.rs`); what only the first one calls is.

use super::universe::Universe;
use crate::model::codes::CONF_SAFE_LETS_GO;
use crate::model::{Call, ChangeKind, Configuration, Deployment, Finding, Findings, MemberRef, Origin};

/// A call that is taken back when its configuration's frame is undone, where it stands, and what takes it back.
type Kept = (MemberRef, Origin, MemberRef);

/// Of every two safe alternatives: what the first one has called and the second one lets go of.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let safe = || deployment.configurations.iter().filter(|c| c.safe && c.group.is_some());
    let pairs = safe().flat_map(|first| {
        safe()
            .filter(move |second| second.group == first.group && second.id != first.id)
            .map(move |second| (first, second))
    });
    let found = pairs.filter_map(|(first, second)| {
        let calls_too = |operation| calls(second).any(|(call, ..)| call.operation == operation);
        let kept = kept(first, universe).into_iter().find(|(operation, ..)| !calls_too(*operation))?;
        Some(finding(first, second, kept))
    });
    found.collect()
}

fn calls(configuration: &Configuration) -> impl Iterator<Item = (&Call, Option<&Call>, Origin)> {
    configuration.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::OperationCall { call, undo } => Some((call, undo.as_ref(), change.origin)),
        _ => None,
    })
}

fn kept(configuration: &Configuration, universe: &Universe) -> Vec<Kept> {
    let kept = calls(configuration).filter_map(|(call, undo, at)| {
        let by = undo.map(|undo| undo.operation).or_else(|| universe.undone_by(call.operation).next())?;
        Some((call.operation, at, by))
    });
    kept.collect()
}

fn finding(first: &Configuration, second: &Configuration, (operation, at, by): Kept) -> Finding {
    let message = format!(
        "`{}` replaces `{}`, and lets go of what that has made safe: `{by}` takes `{operation}` back before it acts",
        second.id, first.id
    );
    Finding::warning(CONF_SAFE_LETS_GO, message)
        .at(second.origin)
        .also(at, format!("`{}` calls it here", first.id))
        .path(format!("configurations.{}.group", second.id))
        .help(format!("let `{}` call `{operation}` too: it then stays; or give them no group in common", second.id))
}
