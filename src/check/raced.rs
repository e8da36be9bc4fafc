//! What one event has two coordinators ask for at once, and that ends otherwise in another order: both write the same, with different values.
//! Such requests are not refused (an absolute write bars nobody), and which coordinator is quicker is luck.

use super::explore::Graph;
use super::judge::Traced;
use super::product::Product;
use super::state::ProductState;
use crate::model::codes::COORD_RACED;
use crate::model::{Ask, Change, ChangeKind, ConfigId, Deployment, Finding};
use crate::plan::ConflictSubject;
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;

/// Whether a change writes a value, that stays until another one is written.
fn writes(change: &Change) -> bool {
    matches!(change.kind, ChangeKind::PropertySet { .. } | ChangeKind::PortWrite { .. })
}

/// Whether two writes come to the same: a whole number is written on what takes fractions as well.
fn is_alike(one: &ChangeKind, other: &ChangeKind) -> bool {
    use ChangeKind::{PortWrite, PropertySet};
    match (one, other) {
        (PropertySet { value: a, .. }, PropertySet { value: b, .. })
        | (PortWrite { value: a, .. }, PortWrite { value: b, .. }) => {
            a == b || a.as_f64().is_some_and(|number| b.as_f64() == Some(number))
        }
        _ => one == other,
    }
}

/// Two changes of these configurations that write the same, with different values.
fn rivals(deployment: &Deployment, one: ConfigId, other: ConfigId) -> Option<(&Change, &Change)> {
    let group = |id| deployment.configuration(id).and_then(|c| c.group);
    // Of one group the later one is refused, or takes the place of the other.
    if group(one).is_some() && group(one) == group(other) {
        return None;
    }
    let of = |id| deployment.configuration(id).into_iter().flat_map(|c| &c.changes).filter(|change| writes(change));
    of(one).find_map(|own| {
        let same = |theirs: &&Change| ConflictSubject::of(&theirs.kind) == ConflictSubject::of(&own.kind);
        of(other).find(|theirs| same(theirs) && !is_alike(&theirs.kind, &own.kind)).map(|theirs| (own, theirs))
    })
}

impl Product<'_> {
    /// What a coordinator asks for when it takes what comes next to it.
    fn asks_next(&mut self, state: &ProductState, number: usize) -> Vec<ConfigId> {
        let takes = self.takes_next(state, number);
        let Some(event) = takes.first().map(|takes| takes.event) else { return Vec::new() };
        let step = self.members[number].react(state.leaves[number], event);
        let requests = step.handed.iter().flat_map(|batch| &batch.requests);
        let applied = requests.filter_map(|request| match request.ask {
            Ask::Apply(id) => Some(id),
            _ => None,
        });
        applied.collect()
    }

    /// Two coordinators that have to take something, and what of it they would ask for that ends otherwise in another order.
    fn raced(&mut self, state: &ProductState, able: &FxHashSet<ConfigId>) -> Vec<[(usize, ConfigId); 2]> {
        let mut waiting: Vec<usize> = state.inbox.iter().map(|(to, _)| usize::from(*to)).collect();
        waiting.sort_unstable();
        waiting.dedup();
        if waiting.len() < 2 {
            return Vec::new();
        }
        let mut asked: Vec<(usize, ConfigId)> = Vec::new();
        for number in waiting {
            asked.extend(
                self.asks_next(state, number).into_iter().filter(|id| able.contains(id)).map(|id| (number, id)),
            );
        }
        let mut raced = Vec::new();
        for (at, one) in asked.iter().enumerate() {
            let others = asked[at + 1..].iter().filter(|other| other.0 != one.0);
            raced.extend(
                others.filter(|other| rivals(self.deployment, one.1, other.1).is_some()).map(|other| [*one, *other]),
            );
        }
        raced
    }
}

impl Graph<'_, '_> {
    /// Where two coordinators write the same at once.
    pub(super) fn races(&mut self, found: &mut Traced) {
        let deployment = self.product.deployment;
        let all: Vec<ConfigId> = deployment.configurations.iter().map(|c| c.id).collect();
        let able = |id: &ConfigId| all.iter().any(|other| rivals(deployment, *id, *other).is_some());
        let able: FxHashSet<ConfigId> = all.iter().copied().filter(able).collect();
        if able.is_empty() || self.product.members.len() < 2 {
            return;
        }
        let mut some: BTreeMap<[(usize, ConfigId); 2], Vec<u32>> = BTreeMap::new();
        for (at, state) in (0u32..).zip(&self.reached.states) {
            for raced in self.product.raced(state, &able) {
                some.entry(raced).or_default().push(at);
            }
        }
        for ([one, other], states) in some {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let Some((own, theirs)) = rivals(self.product.deployment, one.1, other.1) else { continue };
            let name = |number: usize| self.product.members[number].name;
            let message = format!(
                "`{}` of `{}` and `{}` of `{}` are asked for at once: of `{}` and `{}` the later one decides, and that is luck",
                one.1,
                name(one.0),
                other.1,
                name(other.0),
                own.kind,
                theirs.kind
            );
            let finding = Finding::warning(COORD_RACED, message)
                .at(own.origin)
                .labelled("this change")
                .also(theirs.origin, "and this one")
                .path(format!("configurations.{}", one.1))
                .help("let one coordinator ask for it and tell the other by an event, or let one wait for the other's");
            let trace = self.trace(at);
            found.push((finding, trace));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{MemberRef, Value};

    #[test]
    fn what_is_written_as_a_whole_number_is_the_same_value() {
        let set = |value| ChangeKind::PropertySet { property: MemberRef::new("a.k").unwrap(), value };
        assert!(is_alike(&set(Value::Int(2)), &set(Value::Float(2.0))));
        assert!(!is_alike(&set(Value::Int(2)), &set(Value::Float(2.5))));
        assert!(!is_alike(&set(Value::Bool(true)), &set(Value::Int(1))));
    }
}
