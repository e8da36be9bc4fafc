//! System, stack and what is broken, as one: all that requests are judged by and that they change.

use super::claims::Claims;
use super::{FrameId, Request, Requester, Residual, Stack};
use crate::model::{Ask, ComponentName, ConfigId, Ident, Snapshot};
use crate::plan::footprint::{Saved, Slot};
use crate::system::{System, View};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Components of which not all is known, or that are not as the model has them, since a request ended *broken*.
#[derive(Debug, Clone)]
pub struct Broken {
    /// What is left, and of what.
    pub residual: Arc<Residual>,
    /// The components; they stay claimed.
    pub components: BTreeSet<ComponentName>,
    /// The configuration that was being applied or undone, and who asked: its undo repairs them.
    pub culprit: Option<(ConfigId, Requester)>,
    /// Its partial frame, where there is one.
    pub frame: Option<FrameId>,
    /// May be mended without being asked, when a component comes back.
    pub mendable: bool,
    /// The components as the model has them, but for guests.
    pub expected: Snapshot,
    /// Those of them that are only at the other end of a connection which differs: nothing else is expected of them, and others go on with them.
    pub guests: BTreeSet<ComponentName>,
    /// What safe configurations had done, where what is broken was seen by looking: the model had that too. None: what is there
    /// of theirs is as they left it.
    pub seen: Option<SafeWrites>,
    /// What safe configurations in force had written of it when it broke.
    pub held: Vec<(Slot, Saved)>,
}

impl Broken {
    /// What no configuration is known to have left so, and what is not mended unasked.
    pub fn of_nobody(residual: Arc<Residual>, components: BTreeSet<ComponentName>, expected: Snapshot) -> Self {
        let (culprit, frame, guests, seen) = (None, None, BTreeSet::new(), None);
        Self { residual, components, culprit, frame, mendable: false, expected, guests, seen, held: Vec::new() }
    }
}

/// What safe configurations in force had done when something was seen that is otherwise.
#[derive(Debug, Clone, PartialEq)]
pub struct SafeWrites {
    /// The newest frame of that time.
    pub newest: FrameId,
    /// What they had written.
    pub written: Vec<(Slot, Saved)>,
}

/// The configurator's half of a running deployment.
#[derive(Debug, Clone)]
pub struct World {
    /// The picture of the system.
    pub system: System,
    /// The frames in force.
    pub stack: Stack,
    /// What is broken, oldest first.
    pub broken: Vec<Broken>,
    /// Components whose call has not returned.
    pub quarantined: Vec<ComponentName>,
    /// So many components are there that nobody here made: what subsystems are followed by.
    pub given: usize,
}

impl World {
    /// A system with nothing in force.
    pub fn new(system: System, stack: Stack) -> Self {
        Self { system, stack, broken: Vec::new(), quarantined: Vec::new(), given: 0 }
    }

    /// Whether nothing is there that anybody here has made.
    pub fn is_bare(&self) -> bool {
        self.system.len() == self.given
    }

    /// What is broken about one of these components, if anything is.
    pub fn broken_at(&self, mut components: impl Iterator<Item = ComponentName>) -> Option<&Broken> {
        if self.broken.is_empty() {
            return None;
        }
        components.find_map(|component| self.broken.iter().find(|broken| broken.components.contains(&component)))
    }

    /// What the undo of `id` by `by` repairs (its place): that of this frame, or of this configuration.
    pub fn repaired_by(&self, id: ConfigId, by: Requester, frame: Option<FrameId>) -> Option<usize> {
        self.broken.iter().position(|broken| match (broken.frame, frame) {
            (Some(broken), Some(frame)) => broken == frame,
            (Some(_), None) => false,
            (None, _) => broken
                .culprit
                .is_some_and(|(culprit, asked)| culprit == id && (by == Requester::Operator || by == asked)),
        })
    }

    /// Components that `_default` passes over.
    pub fn avoided(&self) -> BTreeSet<ComponentName> {
        let broken = self.broken.iter().flat_map(|broken| broken.components.iter().copied());
        broken.chain(self.quarantined.iter().copied()).collect()
    }

    /// The frame that a coordinator lets go of by an undo: that of the visit whose state is left, or the one that it names; none: nobody's,
    /// or there is no frame.
    pub fn let_go_by(&self, undo: &Request) -> Option<FrameId> {
        self.left_with(undo, &[])
    }

    /// The same beside frames that are being undone by what is under way.
    pub fn left_with(&self, undo: &Request, held: &[FrameId]) -> Option<FrameId> {
        let Ask::UndoOf(id) = undo.ask else { return None };
        let mut frames = self.stack.frames().iter();
        let fits = |frame: &&Arc<super::Frame>| {
            frame.configuration == id && undo.lets_go_of(frame) && !held.contains(&frame.id)
        };
        // A safe configuration of a later visit may be there already: visits are left in their order.
        let frame = if undo.scope.is_some() { frames.find(fits) } else { frames.rev().find(fits) };
        frame.map(|frame| frame.id)
    }

    /// A safe configuration comes that a state brings with it. Undos by leaving that state that came before (`undos`, oldest
    /// first) are about earlier visits: those whose frame is gone already undo nothing, and not what comes now. `coming`: safe
    /// configurations that came before, and whose frames are not there yet. One of a group takes the place of all of these.
    pub fn note_gone<'r>(
        &self,
        safe: &Request,
        claims: &Claims,
        coming: impl Iterator<Item = &'r Request>,
        undos: impl Iterator<Item = &'r mut Request>,
    ) {
        let (Ask::Apply(id), Some(_)) = (safe.ask, safe.scope) else { return };
        let same = |ask: Ask, request: &Request| {
            (request.ask, request.scope, request.requester) == (ask, safe.scope, safe.requester)
        };
        let visits =
            self.stack.frames().iter().filter(|frame| {
                (frame.scope, frame.configuration, frame.requester) == (safe.scope, id, safe.requester)
            });
        let there = match claims.replaces(id, id) {
            true => 0,
            false => visits.count() + coming.filter(|request| same(Ask::Apply(id), request) && !request.gone).count(),
        };
        let undos = undos.filter(|undo| same(Ask::UndoOf(id), undo) && !undo.gone);
        undos.skip(there).for_each(|undo| undo.gone = true);
    }

    /// An undo was not carried out by which a coordinator lets go of something: its frame stays, and is one like others. Frames that are
    /// being undone (`held`) are those of others before. False: there is none.
    pub fn stays(&mut self, undo: &Request, held: &[FrameId]) -> bool {
        let frame = self.left_with(undo, held);
        frame.into_iter().for_each(|frame| self.stack.let_go(frame));
        frame.is_some()
    }

    /// All coordinators of a subsystem are down. True: nothing of it is there any more, and what was in force of it is not. `busy`: see
    /// [`Stack::apply`].
    pub fn settle_down_in(&mut self, path: Ident, busy: &[FrameId]) -> bool {
        let mut inside = false;
        self.system.for_each_component(&mut |node| inside |= node.name.local(path).is_some());
        let over =
            !inside && !self.broken.iter().any(|broken| broken.components.iter().any(|c| c.local(path).is_some()));
        if over {
            self.stack.discard_in(path, busy);
        }
        over
    }

    /// All coordinators are down. True: nothing is there any more, and what was in force in one life is not in force in the
    /// next, nor waited for.
    pub fn settle_down(&mut self) -> bool {
        let over = self.is_bare() && self.broken.is_empty();
        if over {
            self.stack.discard();
        }
        over
    }
}
