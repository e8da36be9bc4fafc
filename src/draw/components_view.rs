//! Which part of a system is drawn: a subsystem alone, or with those that are deep folded into a box each.

use super::diagram::{Diagram, Tone};
use super::hierarchy::SubsystemBoxes;
use crate::model::finding::count;
use crate::model::names::{folded_into, local_to};
use crate::model::{ComponentName, Ident, MemberRef, RunState};
use std::collections::BTreeSet;

/// What of a system is drawn.
#[derive(Debug, Clone, Copy, Default)]
pub struct ComponentsView {
    /// The subsystem of this path alone, by the names of its own file; of the rest what it is connected to, with a `/` before its path.
    pub inside: Option<Ident>,
    /// Subsystems that are more levels deep are one box each, with those of their ports that are connected to something outside.
    pub depth: Option<usize>,
}

/// Where a component is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ComponentPlace {
    /// In the box of the subsystem of that path.
    Own(&'static str),
    /// As a part of the box of that subsystem.
    Folded(&'static str),
    /// Beside what is drawn, as far as that is connected to it.
    Outside,
}

impl ComponentsView {
    pub(super) fn place(&self, name: ComponentName) -> ComponentPlace {
        let own = match self.inside {
            Some(path) => name.local(path),
            None => Some(name.as_str()),
        };
        let Some(own) = own else { return ComponentPlace::Outside };
        let path = own.rsplit_once('/').map_or("", |(path, _)| path);
        folded_into(path, self.depth.unwrap_or(usize::MAX)).map_or(ComponentPlace::Own(path), ComponentPlace::Folded)
    }

    /// Whether a connection is to be seen.
    pub(super) fn shows(&self, from: MemberRef, to: MemberRef) -> bool {
        match (self.place(from.component), self.place(to.component)) {
            (ComponentPlace::Outside, ComponentPlace::Outside) => false,
            (from, to) => from != to || matches!(from, ComponentPlace::Own(_)),
        }
    }

    /// How something is called that is drawn.
    pub(super) fn called(&self, name: &str) -> String {
        match self.inside {
            Some(path) => match local_to(name, path.as_str()) {
                Some(own) => own.to_owned(),
                None => format!("/{name}"),
            },
            None => name.to_owned(),
        }
    }
}

/// A subsystem as one box.
pub(super) struct FoldedBox {
    /// Its node.
    pub at: usize,
    /// The run states of what is in it.
    pub states: Vec<RunState>,
}

impl FoldedBox {
    /// An empty one.
    pub fn new(diagram: &mut Diagram, groups: &mut SubsystemBoxes, path: &str) -> Self {
        Self { at: groups.folded(diagram, path), states: Vec::new() }
    }

    /// Says how many components it has, and in which run states. It has the colour of the worst.
    pub fn say(self, diagram: &mut Diagram, tones: &mut BTreeSet<RunState>) {
        let number = |state: RunState| self.states.iter().filter(|of| **of == state).count();
        let node = &mut diagram.nodes[self.at];
        node.lines.push(count(self.states.len(), "component"));
        let worst = [RunState::Faulted, RunState::Unconfigured, RunState::Stopped, RunState::Running];
        let present: Vec<RunState> = worst.into_iter().filter(|state| number(*state) > 0).collect();
        node.lines.push(match present[..] {
            [only] => only.to_string(),
            _ => present.iter().map(|state| format!("{} {state}", number(*state))).collect::<Vec<_>>().join(", "),
        });
        if let Some(worst) = present.first() {
            node.tone = tone(*worst);
            tones.insert(*worst);
        }
    }
}

/// The colour of a run state.
pub(super) fn tone(state: RunState) -> Tone {
    match state {
        RunState::Unconfigured => Tone::Quiet,
        RunState::Stopped => Tone::Care,
        RunState::Running => Tone::Good,
        RunState::Faulted => Tone::Bad,
    }
}
