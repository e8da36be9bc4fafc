//! What is written in the file of a subsystem, as it is called from outside: every name with the path before it.

use super::deployment::{Coordinator, CoordinatorNaming};
use super::event::{Ask, UNDO, Verdict};
use super::monitor::is_monitors;
use super::names::{ComponentName, ConfigId, EventName, Ident, TypeName};
use super::naming::Naming;
use super::statechart::is_internal;
use std::collections::BTreeMap;

/// Puts names within a subsystem.
#[derive(Debug, Clone, Copy)]
pub struct Within<'a> {
    /// Its path.
    pub path: Ident,
    /// Its activities that are those of the parent.
    pub activities: &'a BTreeMap<Ident, Ident>,
}

impl Within<'_> {
    /// A coordinator. One that is called like its deployment is called like the subsystem.
    pub fn coordinator(&self, of: &Coordinator) -> Coordinator {
        let mut within = of.clone();
        within.name = self.coordinator_name(of);
        within.of = Some(of.of.map_or(self.path, |inner| inner.within(self.path)));
        self.chart(&mut within.chart);
        within
    }

    /// What it is called.
    pub fn coordinator_name(&self, of: &Coordinator) -> Ident {
        match of.written {
            CoordinatorNaming::Alone if of.of.is_none() => self.path,
            _ => of.name.within(self.path),
        }
    }
}

impl Naming for Within<'_> {
    /// Those of the statechart itself, and what answers a bare `undo`, are called the same everywhere.
    fn event(&self, event: EventName) -> EventName {
        let text = event.as_str();
        let bare = Ask::Undo.subject();
        let about_undo = text == bare || Verdict::split(text).is_some_and(|(subject, _)| subject == bare);
        let own = text == "e_done" || is_internal(text) || about_undo && !text.ends_with(UNDO);
        if own { event } else { event.within(self.path) }
    }

    fn activity(&self, activity: Ident) -> Ident {
        self.activities.get(&activity).copied().unwrap_or_else(|| activity.within(self.path))
    }

    fn component(&self, component: ComponentName) -> ComponentName {
        component.within(self.path)
    }

    /// The monitors of a subsystem are a type of their own, all others are the same everywhere.
    fn ty(&self, ty: TypeName) -> TypeName {
        if is_monitors(ty) { ty.within(self.path) } else { ty }
    }

    fn id(&self, id: ConfigId) -> ConfigId {
        id.within(self.path)
    }

    fn name(&self, name: Ident) -> Ident {
        name.within(self.path)
    }

    fn about(&self, word: &str) -> String {
        format!("{}/{word}", self.path)
    }
}
