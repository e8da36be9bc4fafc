//! Components that may come to need one thing for themselves (`exclusive` of their types), known from the texts alone: whoever
//! touches one of them touches what the others may hold.

use crate::model::{Catalogue, Change, ChangeKind, ComponentName, Configuration, Ident, MemberRef, Value};
use std::collections::{BTreeMap, BTreeSet};

/// Of so many combinations of values names are made; past that the pattern stands for all of them.
const MOST_NAMES: usize = 256;

/// The names of what each component may hold, whatever values these configurations give it. What it is created with counts where the
/// configuration that creates it does not set it anew.
pub fn may_hold<'c>(
    configurations: impl Iterator<Item = &'c Configuration> + Clone,
    types: &Catalogue,
) -> BTreeMap<ComponentName, BTreeSet<String>> {
    let mut held: BTreeMap<ComponentName, BTreeSet<String>> = BTreeMap::new();
    if types.iter().all(|ty| ty.exclusive.is_empty()) {
        return held;
    }
    let changes = || configurations.clone().flat_map(|configuration| &configuration.changes);
    let mut sets: BTreeMap<MemberRef, Vec<&Value>> = BTreeMap::new();
    for change in changes() {
        if let ChangeKind::PropertySet { property, value } = &change.kind {
            sets.entry(*property).or_default().push(value);
        }
    }
    for (configuration, change) in configurations.clone().flat_map(|c| c.changes.iter().map(move |change| (c, change)))
    {
        let Some((component, ty, given)) = change.kind.makes() else { continue };
        let Some(ty) = types.get(ty) else { continue };
        let anew = |member: MemberRef| {
            let sets = |change: &Change| matches!(&change.kind, ChangeKind::PropertySet { property, .. } if *property == member);
            configuration.changes.iter().any(sets)
        };
        for resource in &ty.exclusive {
            let values = |property: Ident| -> Vec<&Value> {
                let own = given.get(&property).or_else(|| ty.properties.get(&property)?.default.as_ref());
                let later = sets.get(&component.member(property)).into_iter().flatten().copied();
                own.filter(|_| !anew(component.member(property))).into_iter().chain(later).collect()
            };
            let mut ways: Vec<BTreeMap<Ident, &Value>> = vec![BTreeMap::new()];
            for property in resource.properties() {
                let values = values(property);
                let with = |way: &BTreeMap<Ident, _>, value| {
                    way.iter().map(|(k, v)| (*k, *v)).chain([(property, value)]).collect()
                };
                ways = ways.iter().flat_map(|way| values.iter().map(move |value| with(way, *value))).collect();
                if ways.len() > MOST_NAMES {
                    break;
                }
            }
            let names = held.entry(component).or_default();
            match ways.len() > MOST_NAMES {
                true => _ = names.insert(resource.to_string()),
                false => names.extend(ways.iter().filter_map(|way| resource.named(|name| way.get(&name).copied()))),
            }
        }
    }
    held
}

/// With each component those others that may hold something of what it may hold.
pub fn contenders(held: &BTreeMap<ComponentName, BTreeSet<String>>) -> BTreeMap<ComponentName, Vec<ComponentName>> {
    let others = |name: &ComponentName, own: &BTreeSet<String>| -> Vec<ComponentName> {
        held.iter()
            .filter(|(other, names)| *other != name && !names.is_disjoint(own))
            .map(|(other, _)| *other)
            .collect()
    };
    held.iter().map(|(name, own)| (*name, others(name, own))).filter(|(_, others)| !others.is_empty()).collect()
}
