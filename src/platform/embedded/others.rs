//! The ports at the other ends of a port's connections: one, as a rule, and then in no more room than its name. What stands
//! beside each port of thousands of components lies between what their updates use.

use crate::model::MemberRef;

/// Ports, in the order in which they were connected.
pub(super) enum Others {
    One(MemberRef),
    /// None: no other at all.
    #[allow(clippy::box_collection)] // A list as long as a pointer: it is rarely needed.
    List(Option<Box<Vec<MemberRef>>>),
}

impl Default for Others {
    fn default() -> Self {
        Self::List(None)
    }
}

impl Others {
    pub(super) fn is_empty(&self) -> bool {
        self.as_slice().is_empty()
    }

    pub(super) fn as_slice(&self) -> &[MemberRef] {
        match self {
            Self::One(other) => std::slice::from_ref(other),
            Self::List(None) => &[],
            Self::List(Some(list)) => list,
        }
    }

    pub(super) fn push(&mut self, other: MemberRef) {
        match self {
            Self::List(None) => *self = Self::One(other),
            Self::One(first) => *self = Self::List(Some(Box::new(vec![*first, other]))),
            Self::List(Some(list)) => list.push(other),
        }
    }

    /// What was connected last is disconnected first, as a rule: a port with thousands of readers is not searched through.
    pub(super) fn forget(&mut self, other: MemberRef) {
        match self {
            Self::One(one) if *one == other => *self = Self::List(None),
            Self::List(Some(list)) => {
                if let Some(at) = list.iter().rposition(|o| *o == other) {
                    list.remove(at);
                }
            }
            Self::One(_) | Self::List(None) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Others;
    use crate::model::MemberRef;
    use proptest::prelude::*;

    #[test]
    fn one_takes_no_more_room_than_its_name() {
        assert_eq!(size_of::<Others>(), size_of::<MemberRef>());
    }

    proptest! {
        /// Whatever is connected and disconnected: as in a plain list.
        #[test]
        fn as_in_a_list(orders in prop::collection::vec((any::<bool>(), 0..4_u8), 0..12)) {
            let name = |n: u8| format!("c{n}.u").parse::<MemberRef>().unwrap();
            let (mut others, mut list) = (Others::default(), Vec::new());
            for (push, n) in orders {
                if push {
                    others.push(name(n));
                    list.push(name(n));
                } else {
                    others.forget(name(n));
                    if let Some(at) = list.iter().rposition(|other| *other == name(n)) {
                        list.remove(at);
                    }
                }
                prop_assert_eq!(others.as_slice(), &list[..]);
                prop_assert_eq!(others.is_empty(), list.is_empty());
            }
        }
    }
}
