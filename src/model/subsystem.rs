//! Composition: a deployment as a part of another one (semantics: *Composition*).

use super::component_type::PropertyType;
use super::deployment::Deployment;
use super::finding::Origin;
use super::names::{EventName, Ident, MemberRef};
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::Arc;

/// An instance of a deployment's file in another one.
#[derive(Debug, Clone, PartialEq)]
pub struct Subsystem {
    /// What it is called there.
    pub name: Ident,
    /// What is written in its file, by the names that it has there; of its own subsystems too.
    pub own: Arc<Deployment>,
    /// Its activities that are those of the parent, each with the one it is updated in there.
    pub activities: BTreeMap<Ident, Ident>,
    /// Its file, as it is named.
    pub file: String,
    /// Where it is named.
    pub origin: Origin,
}

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
    pub leaving: Option<Leaving>,
}

/// A member of a component under a name of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Export {
    /// What it is.
    pub kind: ExportKind,
    /// Which: of a component of the file, or of a subsystem.
    pub of: MemberRef,
    /// Where it was written.
    pub origin: Origin,
}

/// What can be exported.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ExportKind {
    /// A port.
    Port,
    /// A property.
    Property,
    /// An operation.
    Operation,
}

impl ExportKind {
    /// All, with the keys they are listed under.
    pub const KEYS: [(&'static str, Self); 3] =
        [("ports", Self::Port), ("properties", Self::Property), ("operations", Self::Operation)];

    /// The key that it is listed under.
    pub fn key(self) -> &'static str {
        Self::KEYS.into_iter().find(|(_, kind)| *kind == self).map_or("", |(key, _)| key)
    }
}

/// How a subsystem leaves: it says so, and waits until it is let go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leaving {
    /// It emits this, and touches nothing that it exports until it has heard the other.
    pub says: EventName,
    /// The parent has let go.
    pub until: EventName,
    /// Where it was written.
    pub origin: Origin,
}

/// What a parent is told of a subsystem without anybody writing it. None of these words is free as a name of an event that is
/// emitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Standing {
    /// Its *up* states are active, and all that its coordinators asked for is answered.
    Up,
    /// One that means that the bring-up failed is, or it was not up in time.
    Failed,
    /// It is down, and nothing is left of it.
    Down,
    /// It was not down in time.
    Stranded,
}

impl Standing {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Up, Self::Failed, Self::Down, Self::Stranded];

    /// Its word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Up => "up",
            Self::Failed => "failed",
            Self::Down => "down",
            Self::Stranded => "stranded",
        }
    }

    /// The event that tells it to the parent of the subsystem of that path.
    ///
    /// # Panics
    /// Never: a word is the name of an event.
    pub fn event(self, path: Ident) -> EventName {
        EventName::new(self.word()).expect("a word is the name of an event").within(path)
    }
}

/// How a subsystem is seen to be at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Seen {
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
/// for what runs and what is followed. One that nobody has begun yet counts as told to be down.
pub fn standing(told: Option<Standing>, seen: Seen) -> Option<Standing> {
    let now = if seen.failed || seen.late && !seen.up {
        Standing::Failed
    } else if seen.up {
        Standing::Up
    } else if seen.down {
        Standing::Down
    } else if seen.stranded {
        Standing::Stranded
    } else {
        return None;
    };
    (told != Some(now)).then_some(now)
}

/// What a refused event is answered with: `left/e_start.ignored`.
pub const IGNORED: &str = ".ignored";

impl Deployment {
    /// All subsystems to any depth, with their paths from here, parents before their children.
    pub fn all_subsystems(&self) -> Vec<(Ident, &Subsystem)> {
        let mut all = Vec::new();
        for subsystem in &self.subsystems {
            all.push((subsystem.name, subsystem));
            let inner = subsystem.own.all_subsystems();
            all.extend(inner.into_iter().map(|(path, inner)| (path.within(subsystem.name), inner)));
        }
        all
    }

    /// The subsystem of that path.
    pub fn subsystem(&self, path: &str) -> Option<&Subsystem> {
        let (first, rest) = path.split_once('/').map_or((path, None), |(first, rest)| (first, Some(rest)));
        let found = self.subsystems.iter().find(|subsystem| subsystem.name.as_str() == first)?;
        rest.map_or(Some(found), |rest| found.own.subsystem(rest))
    }

    /// The path of the subsystem in whose file something of that name stands, the innermost; none: in the deployment's own.
    pub fn path_of(&self, name: &str) -> Option<Ident> {
        let mut path = name.rsplit_once('/').map(|(path, _)| path);
        while let Some(of) = path {
            if self.subsystem(of).is_some() {
                return self.all_subsystems().into_iter().map(|(path, _)| path).find(|path| path.as_str() == of);
            }
            path = of.rsplit_once('/').map(|(of, _)| of);
        }
        None
    }

    /// Whether an event is one that is told of a subsystem without anybody raising it.
    pub fn is_told_of(&self, event: &str) -> bool {
        let Some((path, word)) = event.rsplit_once('/') else { return false };
        self.subsystem(path).is_some()
            && (word.ends_with(IGNORED) || Standing::ALL.iter().any(|standing| standing.word() == word))
    }

    /// What is written in its own file alone: with subsystems the rest of it is made of theirs.
    pub fn own_part(&self) -> &Self {
        self.own.as_deref().unwrap_or(self)
    }

    /// An event as it is heard that a component of that name raises: in the subsystem that it is in, and nowhere else.
    pub fn heard_of(&self, component: &str, event: EventName) -> EventName {
        match self.path_of(component) {
            Some(path) if event.local(path).is_none() => event.within(path),
            _ => event,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_change_is_told_once() {
        let seen = Seen::default();
        let never = Some(Standing::Down);
        assert_eq!(standing(never, Seen { down: true, ..seen }), None, "it is down before anybody asks");
        assert_eq!(
            standing(None, Seen { down: true, ..seen }),
            Some(Standing::Down),
            "begun, and down again without having been up"
        );
        let up = standing(None, Seen { up: true, ..seen });
        assert_eq!(up, Some(Standing::Up));
        assert_eq!(standing(up, Seen { up: true, ..seen }), None);
        assert_eq!(standing(up, seen), None, "on the way down nothing is told");
        assert_eq!(standing(up, Seen { down: true, ..seen }), Some(Standing::Down));
        assert_eq!(standing(None, Seen { late: true, ..seen }), Some(Standing::Failed));
        assert_eq!(standing(None, Seen { late: true, up: true, ..seen }), Some(Standing::Up), "late, but there");
        assert_eq!(standing(up, Seen { stranded: true, ..seen }), Some(Standing::Stranded));
    }
}
