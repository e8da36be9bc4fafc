//! What a safe configuration is about of all that it names.

use crate::model::{Change, ChangeKind, ComponentName, Configuration, StateEntry, StateList, Target};
use crate::system::View;
use std::borrow::Cow;

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
