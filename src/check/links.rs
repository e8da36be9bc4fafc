//! The connections that there may be, whichever configuration makes them.

use crate::model::{ChangeKind, Deployment, MemberRef};
use std::collections::BTreeSet;

/// What configurations connect, and what becomes of it where an end is replaced and has another name then.
pub fn links(deployment: &Deployment) -> BTreeSet<(MemberRef, MemberRef)> {
    let changes = || deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
    let connected = changes().filter_map(|change| match change.kind {
        ChangeKind::Connect { from, to, .. } => Some((from, to)),
        _ => None,
    });
    let mut links: BTreeSet<(MemberRef, MemberRef)> = connected.collect();
    let mut new: Vec<(MemberRef, MemberRef)> = links.iter().copied().collect();
    while let Some((from, to)) = new.pop() {
        for change in changes() {
            let ChangeKind::Replace { component, map, .. } = &change.kind else { continue };
            let called = |end: MemberRef| match map.get(&end.member).filter(|_| end.component == *component) {
                Some(name) => component.member(*name),
                None => end,
            };
            let link = (called(from), called(to));
            if links.insert(link) {
                new.push(link);
            }
        }
    }
    links
}
