//! State lists of configurations: run states to bring components to, in order, with at most one `_default` among them.

use super::finding::Origin;
use super::names::ComponentName;
use super::run_state::Wanted;
use std::fmt;

/// A pre- or post-state list. What must not be written has no place in it: a state that nobody can demand, a second
/// `_default`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StateList {
    named: Vec<(ComponentName, Wanted, Origin)>,
    default: Option<Rest>,
}

/// `_default` of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rest {
    state: Wanted,
    origin: Origin,
    /// So many named entries stand before it.
    after: usize,
}

/// One entry of a state list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateEntry {
    /// Whom it concerns.
    pub target: Target,
    /// The state demanded.
    pub state: Wanted,
    /// Where it was written.
    pub origin: Origin,
}

/// Whom an entry of a state list concerns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    /// One component.
    Component(ComponentName),
    /// `_default`: every component of the (sub)system that the same list does not name.
    Default,
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Component(name) => write!(f, "{name}"),
            Self::Default => f.write_str("_default"),
        }
    }
}

/// Where the `_default` stands that a list has already.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("`_default` stands twice")]
pub struct DefaultTwice(pub Origin);

impl StateList {
    /// The list of these entries.
    ///
    /// # Errors
    /// When `_default` is twice among them.
    pub fn of(entries: impl IntoIterator<Item = StateEntry>) -> Result<Self, DefaultTwice> {
        let mut list = Self::default();
        entries.into_iter().try_for_each(|entry| list.push(entry))?;
        Ok(list)
    }

    /// Appends an entry.
    ///
    /// # Errors
    /// When it is a second `_default`; the list stays as it is.
    pub fn push(&mut self, entry: StateEntry) -> Result<(), DefaultTwice> {
        let StateEntry { target, state, origin } = entry;
        match (target, self.default) {
            (Target::Component(component), _) => self.named.push((component, state, origin)),
            (Target::Default, None) => self.default = Some(Rest { state, origin, after: self.named.len() }),
            (Target::Default, Some(first)) => return Err(DefaultTwice(first.origin)),
        }
        Ok(())
    }

    /// Its entries in order.
    pub fn iter(&self) -> impl Iterator<Item = StateEntry> + '_ {
        let after = self.default.map_or(0, |rest| rest.after);
        let (before, behind) = self.named.split_at(after);
        let named = |(component, state, origin): &(ComponentName, Wanted, Origin)| StateEntry {
            target: Target::Component(*component),
            state: *state,
            origin: *origin,
        };
        let rest = self.default.map(|Rest { state, origin, .. }| StateEntry { target: Target::Default, state, origin });
        before.iter().map(named).chain(rest).chain(behind.iter().map(named))
    }

    /// The components that it names, as often as it does.
    pub fn named(&self) -> impl Iterator<Item = ComponentName> + '_ {
        self.named.iter().map(|(component, ..)| *component)
    }

    /// Whether `_default` stands in it.
    pub fn has_default(&self) -> bool {
        self.default.is_some()
    }

    /// How many entries it has.
    pub fn len(&self) -> usize {
        self.named.len() + usize::from(self.default.is_some())
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_keeps_its_order_and_one_default() {
        let entry = |text: &str, state, origin| {
            let target = match text {
                "_default" => Target::Default,
                name => Target::Component(ComponentName::new(name).unwrap()),
            };
            StateEntry { target, state, origin: Origin(origin) }
        };
        for place in 0..3 {
            let mut entries = vec![entry("a", Wanted::Running, 1), entry("b", Wanted::Stopped, 2)];
            entries.insert(place, entry("_default", Wanted::Unconfigured, 7));
            let mut list = StateList::of(entries.clone()).unwrap();
            assert_eq!(list.iter().collect::<Vec<_>>(), entries);
            assert_eq!((list.len(), list.has_default(), list.named().count()), (3, true, 2));
            let again = list.push(entry("_default", Wanted::Running, 9));
            assert_eq!(again.unwrap_err().0.0, 7, "the first one");
            assert_eq!(list.iter().collect::<Vec<_>>(), entries, "it stays as it is");
        }
        assert!(StateList::default().is_empty() && StateList::default().iter().next().is_none());
    }
}
