//! What a safe configuration is about of all that it names.

use super::{Frame, Stack};
use crate::model::{Change, ChangeKind, ComponentName, Configuration, Policy, StateEntry, StateList, Step, Target};
use crate::system::touch::{self, Slot};
use crate::system::{System, View};
use std::borrow::Cow;
use std::sync::Arc;

/// A configuration, without what is about components that are not there if it is a safe one: these have nothing to be made safe. `system` is as it begins,
/// when those whose place it takes are taken back: what they have destroyed is there again.
pub(super) fn of_what_is_there<'c>(system: &impl View, configuration: &'c Configuration) -> Cow<'c, Configuration> {
    if !configuration.safe {
        return Cow::Borrowed(configuration);
    }
    let created = |component: &ComponentName| {
        let makes =
            |change: &Change| matches!(&change.kind, ChangeKind::Create { component: of, .. } if of == component);
        configuration.changes.iter().any(makes)
    };
    let there = |component: &ComponentName| system.component(*component).is_some() || created(component);
    let entry = |entry: &StateEntry| !matches!(&entry.target, Target::Component(of) if !there(of));
    let list = |of: &StateList| StateList::of(of.iter().filter(entry)).unwrap_or_default();
    let change = |change: &Change| change.kind.components().iter().all(there);
    let states = || configuration.pre.iter().chain(configuration.post.iter());
    if configuration.changes.iter().all(change) && states().all(|one| entry(&one)) {
        return Cow::Borrowed(configuration);
    }
    let mut rest = configuration.clone();
    rest.changes.retain(change);
    (rest.pre, rest.post) = (list(&configuration.pre), list(&configuration.post));
    Cow::Owned(rest)
}

/// What is to be done for a safe configuration beside what it interrupts, whose doing is not `before`: an act that its `frame` tells of, and that is so in
/// the `system` already, as it is `then` (when those that came before are over), is left to it, but for what is still to be taken back of those whose place it takes on this `stack`; what drives an in-port that
/// it connects or writes is disconnected.
pub fn beside_what_is_interrupted<'c>(
    configuration: &'c Configuration,
    frame: &Frame,
    stack: &Stack,
    (system, then, before): (&System, &System, &System),
) -> Cow<'c, Configuration> {
    let replaced = |frame: &&Arc<Frame>| frame.group.is_some() && frame.group == configuration.group && !frame.safe;
    let replaced = stack.frames().iter().filter(replaced);
    let open: Vec<Slot> = replaced.flat_map(|frame| frame.taking_back()).map(|item| touch::slot(&item.step)).collect();
    let stays = |act: &ChangeKind| match act {
        ChangeKind::Create { component, .. } => !open.contains(&Slot::Component(*component)),
        ChangeKind::Connect { from, to, .. } | ChangeKind::Disconnect { from, to } => {
            !open.contains(&Slot::Link(*from, *to))
        }
        _ => false,
    };
    let is_own = |act: &ChangeKind| {
        frame.steps().iter().any(|planned| match (&planned.step, act) {
            (Step::Create { component, .. }, ChangeKind::Create { component: of, .. }) => component == of,
            (Step::Connect { from, to, .. }, ChangeKind::Connect { from: a, to: b, .. })
            | (Step::Disconnect { from, to }, ChangeKind::Disconnect { from: a, to: b }) => (from, to) == (a, b),
            _ => false,
        })
    };
    let is_so = |change: &Change| is_done(&change.kind, then) && is_own(&change.kind) && stays(&change.kind);
    let mut driving: Vec<Change> = Vec::new();
    for change in configuration.changes.iter().filter(|change| !is_so(change)) {
        let (port, beside) = match &change.kind {
            ChangeKind::Connect { to, policy, .. } => (*to, *policy != Policy::Data),
            ChangeKind::PortWrite { port, .. } => (*port, false),
            _ => continue,
        };
        system.for_each_link(&mut |from, to, policy| {
            if to == port && before.link(from, to).is_none() && !(beside && policy != Policy::Data) {
                driving.push(Change { kind: ChangeKind::Disconnect { from, to }, origin: change.origin });
            }
        });
    }
    if driving.is_empty() && !configuration.changes.iter().any(is_so) {
        return Cow::Borrowed(configuration);
    }
    let mut rest = configuration.clone();
    rest.changes.retain(|change| !is_so(change));
    rest.changes.extend(driving);
    Cow::Owned(rest)
}

/// Whether an act that would be refused is so already.
pub(super) fn is_done(act: &ChangeKind, system: &System) -> bool {
    match act {
        ChangeKind::Create { component, ty, .. } => {
            system.component(*component).is_some_and(|node| node.ty.name == *ty)
        }
        ChangeKind::Connect { from, to, policy } => system.link(*from, *to) == Some(*policy),
        ChangeKind::Disconnect { from, to } => system.link(*from, *to).is_none(),
        _ => false,
    }
}
