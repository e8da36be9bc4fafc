//! What a safe configuration takes back of another one of its group that is not safe: what moves then.
//!
//! Alternatives replace one another: the frame that was in force is undone, and what it had called is taken back, before the
//! next one acts. What both call is not taken back in between (`stack/share.rs`); what only the first one calls is, and so is what
//! only the first one has brought to a run state. Where both are safe nothing is taken back (`stack/effort.rs`).

use super::universe::Universe;
use crate::model::codes::CONF_SAFE_MOVES;
use crate::model::{
    Ask, Call, ChangeKind, Configuration, Deployment, Finding, Findings, MemberRef, Origin, StateEntry, Target, Wanted,
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

/// Of every two alternatives of which only the second one is safe: what of the first one moves when it is taken back.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let grouped = || deployment.configurations.iter().filter(|c| c.group.is_some());
    let pairs = grouped().filter(|first| !first.safe).flat_map(|first| {
        let others = grouped().filter(move |second| second.safe && second.group == first.group);
        others.map(move |second| (first, second))
    });
    pairs.filter_map(|(first, second)| Some(finding(first, second, &moves_back(first, second, universe)?))).collect()
}

fn calls(configuration: &Configuration) -> impl Iterator<Item = (&Call, Option<&Call>, Origin)> {
    configuration.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::OperationCall { call, undo } => Some((call, undo.as_ref(), change.origin)),
        _ => None,
    })
}

/// What the first one calls and the second one does not, by what it is taken back, and where.
fn taken_back<'c>(
    first: &'c Configuration,
    second: &'c Configuration,
    universe: &'c Universe,
) -> impl Iterator<Item = (MemberRef, MemberRef, Origin)> + 'c {
    let calls_too = |operation| calls(second).any(|(call, ..)| call.operation == operation);
    calls(first).filter(move |(call, ..)| !calls_too(call.operation)).filter_map(|(call, undo, at)| {
        let by = undo.map(|undo| undo.operation).or_else(|| universe.undone_by(call.operation).next())?;
        Some((call.operation, by, at))
    })
}

/// What moves when the first one, which is not safe, is taken back: an operation, or what it has brought to rest and the second one does not.
fn moves_back(first: &Configuration, second: &Configuration, universe: &Universe) -> Option<Kept> {
    let called = || {
        let (operation, by, at) = taken_back(first, second, universe).find(|(_, by, _)| universe.moves(*by))?;
        // What moves itself is nothing to call in an emergency.
        let keep = if universe.moves(operation) {
            String::new()
        } else {
            format!("; or let it call `{operation}` too: it then stays")
        };
        Some(Kept {
            at,
            does: "calls it".to_owned(),
            back: format!("`{by}` moves, and takes `{operation}` back"),
            keep,
        })
    };
    let theirs = brings(second);
    let starts = |entry: &StateEntry| {
        let Target::Component(of) = entry.target else { return false };
        let last = first.pre.iter().chain(first.post.iter()).filter(|other| other.target == entry.target).last();
        let rests = last.is_some_and(|last| last.state != Wanted::Running);
        rests && universe.moves_started(of) && !theirs.contains(&entry.target) && !theirs.contains(&Target::Default)
    };
    let brought = || {
        first.pre.iter().chain(first.post.iter()).find(starts).map(|entry| Kept {
            at: entry.origin,
            does: "brings it to rest".to_owned(),
            back: format!("`{}` starts again where it ran before", entry.target),
            keep: format!("; or let it bring `{}` to rest too", entry.target),
        })
    };
    called().or_else(brought)
}

/// What a configuration brings to a run state.
fn brings(configuration: &Configuration) -> Vec<Target> {
    configuration.pre.iter().chain(configuration.post.iter()).map(|entry| entry.target).collect()
}

fn finding(first: &Configuration, second: &Configuration, kept: &Kept) -> Finding {
    let message = format!(
        "`{}` is safe, and replaces `{}`, something of which moves when it is taken back: {}",
        second.id, first.id, kept.back
    );
    Finding::warning(CONF_SAFE_MOVES, message)
        .at(second.origin)
        .also(kept.at, format!("`{}` {} here", first.id, kept.does))
        .path(format!("configurations.{}.group", second.id))
        .help(format!(
            "give `{}` a group of its own: it is then in force over `{}`, and what moves is taken back where `{}` is asked for, in a later step{}",
            second.id,
            first.id,
            Ask::UndoOf(first.id),
            kept.keep
        ))
}
