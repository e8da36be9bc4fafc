//! A deployment with its subsystems (semantics: *Composition*): who is where.

use super::deployment::{Coordinator, Deployment, Subsystem};
use super::names::{ConfigId, EventName, Ident, MemberRef};
use super::subsystem::{IGNORED, SubsystemStanding};
use super::within::Within;

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

    /// What brings the whole to rest when it is taken down by force: what its own file names for that, and what those of its subsystems do.
    pub fn all_rest(&self) -> Vec<ConfigId> {
        let own = self.shutdown.rest.iter().map(|(id, _)| *id);
        let inside = self.all_subsystems().into_iter().flat_map(|(path, subsystem)| {
            subsystem.own.shutdown.rest.iter().map(move |(id, _)| id.within(path)).collect::<Vec<_>>()
        });
        own.chain(inside).collect()
    }

    /// The subsystem of that path.
    pub fn subsystem(&self, path: &str) -> Option<&Subsystem> {
        let (first, rest) = path.split_once('/').map_or((path, None), |(first, rest)| (first, Some(rest)));
        let found = self.subsystems.iter().find(|subsystem| subsystem.name.as_str() == first)?;
        rest.map_or(Some(found), |rest| found.own.subsystem(rest))
    }

    /// A coordinator of it, or of a subsystem, by the names of its own file.
    pub fn in_its_file<'a>(&'a self, coordinator: &'a Coordinator) -> &'a Coordinator {
        let Some((path, file)) = coordinator.of.and_then(|path| Some((path, self.subsystem(path.as_str())?))) else {
            return coordinator;
        };
        let within = Within { path, activities: &file.activities };
        let own = file.own.coordinators.iter().filter(|own| own.of.is_none());
        own.into_iter().find(|own| within.coordinator_name(own) == coordinator.name).unwrap_or(coordinator)
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
            && (word.ends_with(IGNORED) || SubsystemStanding::WORDS.iter().any(|(own, _)| *own == word))
    }

    /// What a subsystem exports under a name (`line.speed`), by the name that it has here (`line/Belt.slope`).
    pub fn exported(&self, subsystem: &str, name: &str) -> Option<MemberRef> {
        let (path, of) = self.all_subsystems().into_iter().find(|(path, _)| path.as_str() == subsystem)?;
        let (_, export) = of.own.interface.exports.iter().find(|(own, _)| own.as_str() == name)?;
        Some(export.of.component.within(path).member(export.of.member))
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
