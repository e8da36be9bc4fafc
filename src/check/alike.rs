//! Instances of one file that differ in values of properties alone: what follows from one of them follows from the other.
//!
//! What is followed asks of a property's value only whether it is the one that was there before. So two files are the same for it where
//! everything but such values is, and where these are alike wherever they are alike in the other file. What is said of values themselves
//! (types, limits, what a library reads in them) is no part of that, and is looked at in each; where a value itself is asked for, it is the same in both.

use crate::model::monitor::is_monitors;
use crate::model::{
    Catalogue, ChangeKind, ComponentName, Deployment, Ident, MemberRef, OperatorMay, Subsystem, TypeName, Value,
    ValueType,
};
use crate::stack::contenders::may_hold;
use std::collections::{BTreeMap, BTreeSet};

/// Whether two files, with their subsystems, are the same but for values.
pub fn is_alike(one: &Deployment, other: &Deployment, catalogue: &Catalogue) -> bool {
    let (own, theirs) = match (&one.own, &other.own) {
        (None, None) => return is_alike_alone(one, other, catalogue),
        (Some(own), Some(theirs)) => (own, theirs),
        _ => return false,
    };
    let alone = |of: &Deployment| Deployment { subsystems: Vec::new(), ..of.clone() };
    let same = |(one, other): (&Subsystem, &Subsystem)| {
        (one.name, &one.file, &one.activities) == (other.name, &other.file, &other.activities)
            && is_alike(&one.own, &other.own, &catalogue.known_in(one.name))
    };
    // Who gets in whose way over several files is looked at in each.
    [one, other].into_iter().all(|of| nothing_is_held_twice(of, catalogue))
        && own.subsystems.len() == theirs.subsystems.len()
        && own.subsystems.iter().zip(&theirs.subsystems).all(same)
        && is_alike_alone(&alone(own), &alone(theirs), catalogue)
}

/// Whether what two files have themselves is the same but for values.
fn is_alike_alone(one: &Deployment, other: &Deployment, catalogue: &Catalogue) -> bool {
    let Some(mut pairs) = Pairs::new(one, catalogue) else { return false };
    pairs.fixed = asked_for(one, other, catalogue);
    let taken = defaults_taken(one, catalogue);
    let mut renamed = other.clone();
    for (configuration, by) in renamed.configurations.iter_mut().zip(&one.configurations) {
        for (change, by) in configuration.changes.iter_mut().zip(&by.changes) {
            let fits = match (&mut change.kind, &by.kind) {
                (ChangeKind::PropertySet { property, value }, ChangeKind::PropertySet { property: of, value: by }) => {
                    property == of && pairs.renames(*of, value, by)
                }
                (
                    ChangeKind::Create { component, properties, .. }
                    | ChangeKind::Replace { component, properties, .. },
                    ChangeKind::Create { component: of, properties: by, .. }
                    | ChangeKind::Replace { component: of, properties: by, .. },
                ) => {
                    let given = properties.iter_mut().zip(by);
                    component == of
                        && given.fold(true, |fits, ((name, value), (same, by))| {
                            fits && name == same && pairs.renames(of.member(*name), value, by)
                        })
                }
                _ => true,
            };
            if !fits {
                return false;
            }
        }
    }
    // What nobody gives is the same in both; nothing of what is followed is about the name of a file's deployment.
    let defaults = taken.into_iter().all(|(member, default)| pairs.are_one(member, &default, &default));
    renamed.name = one.name;
    defaults && renamed == *one
}

/// The values of one file by those of the other, property by property.
struct Pairs {
    /// What properties take: a whole number may be written for any number.
    types: BTreeMap<MemberRef, ValueType>,
    /// Whose values are asked for, and have to be the same.
    fixed: BTreeSet<MemberRef>,
    known: BTreeMap<MemberRef, Vec<(Value, Value)>>,
}

impl Pairs {
    /// None: what a property takes depends on what its component is made as.
    fn new(of: &Deployment, catalogue: &Catalogue) -> Option<Self> {
        let mut types: BTreeMap<MemberRef, ValueType> = BTreeMap::new();
        for (component, ty, _) in made(of) {
            for (name, property) in catalogue.get(ty).into_iter().flat_map(|ty| &ty.properties) {
                let known = types.entry(component.member(*name)).or_insert_with(|| property.ty.clone());
                if *known != property.ty {
                    return None;
                }
            }
        }
        Some(Self { types, fixed: BTreeSet::new(), known: BTreeMap::new() })
    }

    /// A value of the other file is called as in this one, if that is one to one.
    fn renames(&mut self, property: MemberRef, other: &mut Value, one: &Value) -> bool {
        let fits = self.are_one(property, other, one);
        other.clone_from(one);
        fits
    }

    fn are_one(&mut self, property: MemberRef, other: &Value, one: &Value) -> bool {
        // What does not fit is refused, and nothing follows.
        let fit = |value: &Value| self.types.get(&property).and_then(|ty| value.clone().fit(ty).ok());
        let (Some(other), Some(one)) = (fit(other), fit(one)) else { return other == one };
        if self.fixed.contains(&property) {
            return other == one;
        }
        let known = self.known.entry(property).or_default();
        match known.iter().find(|(of, by)| *of == other || *by == one) {
            Some((of, by)) => *of == other && *by == one,
            None => {
                known.push((other, one));
                true
            }
        }
    }
}

/// What a file makes, as what and with which values.
fn made(of: &Deployment) -> impl Iterator<Item = (ComponentName, TypeName, &BTreeMap<Ident, Value>)> {
    of.configurations.iter().flat_map(|configuration| &configuration.changes).filter_map(|change| change.kind.makes())
}

/// The defaults that properties take since who creates their component does not give them.
fn defaults_taken(of: &Deployment, catalogue: &Catalogue) -> Vec<(MemberRef, Value)> {
    let taken = made(of).filter_map(|(component, ty, given)| {
        let properties = catalogue.get(ty)?.properties.iter().filter(|(name, _)| !given.contains_key(*name));
        Some(properties.filter_map(move |(name, of)| Some((component.member(*name), of.default.clone()?))))
    });
    taken.flatten().collect()
}

/// The properties whose values matter: which monitors are enabled, what an operator may set (what another value than these is), and, where
/// components may get in each other's way by them, what they have for themselves.
fn asked_for(one: &Deployment, other: &Deployment, catalogue: &Catalogue) -> BTreeSet<MemberRef> {
    let set = one.operator.iter().filter_map(|(may, _)| match may {
        OperatorMay::Set(member) => Some(*member),
        OperatorMay::Apply(_) => None,
    });
    let mut asked: BTreeSet<MemberRef> = set.collect();
    let apart = nothing_is_held_twice(one, catalogue) && nothing_is_held_twice(other, catalogue);
    for (component, ty, _) in made(one) {
        let Some(ty) = catalogue.get(ty) else { continue };
        let resources = ty.exclusive.iter().filter(|_| !apart).flat_map(|resource| resource.properties());
        asked.extend(resources.map(|name| component.member(name)));
        let enabled = ty.properties.keys().filter(|_| is_monitors(ty.name));
        asked.extend(enabled.map(|name| component.member(*name)));
    }
    asked
}

/// Whether no two components of a file can come to have the same thing for themselves.
fn nothing_is_held_twice(of: &Deployment, catalogue: &Catalogue) -> bool {
    let held = may_hold(of.configurations.iter(), catalogue);
    let mut names: Vec<&String> = held.values().flatten().collect();
    names.sort();
    names.windows(2).all(|two| two[0] != two[1])
}
