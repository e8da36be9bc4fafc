//! The connections that there may be, whichever configuration makes them.

use crate::model::{ChangeKind, Configuration, MemberRef};
use std::collections::BTreeSet;

/// What configurations connect, and what becomes of it where an end is replaced and has another name then.
pub fn links<'d>(configurations: impl Iterator<Item = &'d Configuration>) -> BTreeSet<(MemberRef, MemberRef)> {
    let (mut links, mut replaced) = (BTreeSet::new(), Vec::new());
    for change in configurations.flat_map(|configuration| &configuration.changes) {
        match &change.kind {
            ChangeKind::Connect { from, to, .. } => _ = links.insert((*from, *to)),
            ChangeKind::Replace { component, map, .. } => replaced.push((*component, map)),
            _ => {}
        }
    }
    let mut new: Vec<(MemberRef, MemberRef)> = links.iter().copied().collect();
    while let Some((from, to)) = new.pop() {
        for (component, map) in &replaced {
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
