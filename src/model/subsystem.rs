//! Composition: a deployment as a part of another one (semantics: *Composition*).

use super::component_type::{MemberClass, PropertyType};
use super::finding::Origin;
use super::names::{EventName, Ident, MemberRef};
use super::words::words;
use std::collections::BTreeMap;

/// What a deployment shows to one that it is a subsystem of.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Interface {
    /// What it can be given.
    pub parameters: BTreeMap<Ident, PropertyType>,
    /// What of its components may be touched.
    pub exports: BTreeMap<Ident, Export>,
    /// From which of its events on they may be; none: from *up*.
    pub from: Option<(EventName, Origin)>,
    /// Events that it takes.
    pub accepts: Vec<(EventName, Origin)>,
    /// How it is let go before it leaves.
    pub leaving: Option<LeavingRule>,
}

/// A member of a component under a name of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// What it is.
    pub kind: MemberClass,
    /// Which: of a component of the file, or of a subsystem.
    pub of: MemberRef,
    /// Where it was written.
    pub origin: Origin,
}

/// How a subsystem leaves: it says so, and waits until it is let go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LeavingRule {
    /// It emits this, and touches nothing that it exports until it has heard the other.
    pub says: EventName,
    /// The parent has let go.
    pub until: EventName,
    /// Where it was written.
    pub origin: Origin,
}

words! {
    /// What a parent is told of a subsystem without anybody writing it. None of these words is free as a name of an event that is
    /// emitted.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum SubsystemStanding by word {
        /// Its *up* states are active, and all that its coordinators asked for is answered.
        Up = "up",
        /// One that means that the bring-up failed is, or it was not up in time.
        Failed = "failed",
        /// It is down, and nothing is left of it.
        Down = "down",
        /// It was not down in time.
        Stranded = "stranded",
    }
}

impl SubsystemStanding {
    /// The event that tells it to the parent of the subsystem of that path.
    ///
    /// # Panics
    /// Never: a word is the name of an event.
    pub fn event(self, path: Ident) -> EventName {
        self.own_event().within(path)
    }

    /// The same by its name in the subsystem's own file.
    ///
    /// # Panics
    /// Never: a word is the name of an event.
    pub fn own_event(self) -> EventName {
        EventName::new(self.word()).expect("a word is the name of an event")
    }
}

/// How a subsystem is seen to be at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SeenStanding {
    /// All its coordinators are in their *up* states, and nothing that they asked for is unanswered.
    pub up: bool,
    /// One of them is in a state that means that the bring-up failed.
    pub failed: bool,
    /// All are in their *down* states, and nothing is left.
    pub down: bool,
    /// It was asked to come up, and its time is over.
    pub late: bool,
    /// It was asked to go down, and its time is over.
    pub stranded: bool,
}

/// What is to be told when a subsystem that was last told to be `told` (none: it was begun since) is seen so; none: nothing new. The one rule
/// for what runs and what is followed. One that nobody has begun yet counts as told to be down, until a
/// transition of it takes the event that ends it; one that is begun anew counts as told nothing.
pub fn standing(told: Option<SubsystemStanding>, seen: SeenStanding) -> Option<SubsystemStanding> {
    let now = if seen.stranded && !seen.down {
        SubsystemStanding::Stranded
    } else if seen.failed || seen.late && !seen.up {
        SubsystemStanding::Failed
    } else if seen.up {
        SubsystemStanding::Up
    } else if seen.down {
        SubsystemStanding::Down
    } else {
        return None;
    };
    (told != Some(now)).then_some(now)
}

/// What a refused event is answered with: `left/e_start.ignored`.
pub const IGNORED: &str = ".ignored";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_told_once() {
        let seen = SeenStanding::default();
        let never = Some(SubsystemStanding::Down);
        assert_eq!(standing(never, SeenStanding { down: true, ..seen }), None, "it is down before anybody asks");
        assert_eq!(
            standing(None, SeenStanding { down: true, ..seen }),
            Some(SubsystemStanding::Down),
            "begun, and down again without having been up"
        );
        let up = standing(None, SeenStanding { up: true, ..seen });
        assert_eq!(up, Some(SubsystemStanding::Up));
        assert_eq!(standing(up, SeenStanding { up: true, ..seen }), None);
        assert_eq!(standing(up, seen), None, "on the way down nothing is told");
        assert_eq!(standing(up, SeenStanding { down: true, ..seen }), Some(SubsystemStanding::Down));
        assert_eq!(standing(None, SeenStanding { late: true, ..seen }), Some(SubsystemStanding::Failed));
        assert_eq!(
            standing(None, SeenStanding { late: true, up: true, ..seen }),
            Some(SubsystemStanding::Up),
            "late, but there"
        );
        let stranded = Some(SubsystemStanding::Stranded);
        assert_eq!(standing(up, SeenStanding { stranded: true, ..seen }), stranded);
        let failed = Some(SubsystemStanding::Failed);
        assert_eq!(standing(failed, SeenStanding { stranded: true, failed: true, ..seen }), stranded);
        assert_eq!(standing(stranded, SeenStanding { stranded: true, failed: true, ..seen }), None);
    }
}
