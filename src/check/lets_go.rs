//! That a safe configuration lets go of what another one of its group has made safe.
//!
//! Alternatives replace one another: the frame that was in force is undone, and what it had called is taken back, before the
//! next one acts. What both call is not taken back in between (`stack/share.rs`); what only the first one calls is, and so is what
//! only the first one sets, or brings to a run state.

use super::universe::Universe;
use crate::model::codes::CONF_SAFE_LETS_GO;
use crate::model::{
    Call, ChangeKind, Configuration, Deployment, Finding, Findings, MemberRef, Origin, StateEntry, Target,
};

/// What is taken back when a configuration's frame is undone.
struct Kept {
    at: Origin,
    /// What the configuration does with it.
    does: String,
    /// How it is taken back.
    back: String,
    /// How another one keeps it, too.
    keep: String,
}

/// Of every two safe alternatives: what the first one has called and the second one lets go of.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let safe = || deployment.configurations.iter().filter(|c| c.safe && c.group.is_some());
    let pairs = safe().flat_map(|first| {
        safe()
            .filter(move |second| second.group == first.group && second.id != first.id)
            .map(move |second| (first, second))
    });
    let found = pairs.filter_map(|(first, second)| {
        let kept = let_go_of(first, second, universe);
        Some(finding(first, second, &kept?))
    });
    found.collect()
}

fn calls(configuration: &Configuration) -> impl Iterator<Item = (&Call, Option<&Call>, Origin)> {
    configuration.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::OperationCall { call, undo } => Some((call, undo.as_ref(), change.origin)),
        _ => None,
    })
}

/// What the first one has made safe, and the second one does nothing about.
fn let_go_of(first: &Configuration, second: &Configuration, universe: &Universe) -> Option<Kept> {
    let calls_too = |operation| calls(second).any(|(call, ..)| call.operation == operation);
    let called = calls(first).filter(|(call, ..)| !calls_too(call.operation)).find_map(|(call, undo, at)| {
        let by = undo.map(|undo| undo.operation).or_else(|| universe.undone_by(call.operation).next())?;
        let operation = call.operation;
        Some(Kept {
            at,
            does: "calls it".to_owned(),
            back: format!("`{by}` takes `{operation}` back"),
            keep: format!("call `{operation}` too: it then stays"),
        })
    });
    let sets_too = |property| sets(second).any(|(other, _)| other == property);
    let set = || {
        sets(first).find(|(property, _)| !sets_too(*property)).map(|(property, at)| Kept {
            at,
            does: "sets it".to_owned(),
            back: format!("`{property}` is set back"),
            keep: format!("set `{property}` too"),
        })
    };
    let brings = |of: &Configuration| of.pre.iter().chain(of.post.iter()).map(|entry| entry.target).collect::<Vec<_>>();
    let theirs = brings(second);
    let brought = || {
        let alone = |entry: &StateEntry| !theirs.contains(&entry.target) && !theirs.contains(&Target::Default);
        first.post.iter().find(alone).map(|entry| Kept {
            at: entry.origin,
            does: "brings it to a run state".to_owned(),
            back: format!("the run state of `{}` is taken back", entry.target),
            keep: format!("bring `{}` to a run state too", entry.target),
        })
    };
    called.or_else(set).or_else(brought)
}

fn sets(configuration: &Configuration) -> impl Iterator<Item = (MemberRef, Origin)> {
    configuration.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::PropertySet { property, .. } => Some((*property, change.origin)),
        _ => None,
    })
}

fn finding(first: &Configuration, second: &Configuration, kept: &Kept) -> Finding {
    let message = format!(
        "`{}` replaces `{}`, and lets go of what that has made safe: {} before it acts",
        second.id, first.id, kept.back
    );
    Finding::warning(CONF_SAFE_LETS_GO, message)
        .at(second.origin)
        .also(kept.at, format!("`{}` {} here", first.id, kept.does))
        .path(format!("configurations.{}.group", second.id))
        .help(format!("let `{}` {}; or give them no group in common", second.id, kept.keep))
}
