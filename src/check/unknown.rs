//! Worlds of which not everything is known: what is left in between is nobody's to tell.

use super::outcome::{EMPTY, WorldId};
use super::world::{Top, Worlds};
use crate::model::{Ask, ConfigId, TypeName, Verdict};
use crate::stack::Request;

impl Worlds<'_> {
    /// The world after something of `id` ended *broken*.
    pub fn broken(&mut self, id: WorldId, asks: impl Iterator<Item = Ask>) -> WorldId {
        let top = Top { safe: self.is_safe(id), actuator: self.has_actuator(id) };
        self.topped(top, asks)
    }

    /// The unknown world after these were asked.
    pub fn topped(&mut self, mut top: Top, asks: impl Iterator<Item = Ask>) -> WorldId {
        for ask in asks {
            if let Ask::Apply(id) = ask {
                top.actuator |= self.creates_actuator(id);
            }
        }
        self.unknown(top)
    }

    /// The unknown world after a request was answered.
    pub fn answered(&mut self, top: Top, request: &Request, verdict: Verdict) -> WorldId {
        let done = verdict.is_success();
        let is_safe = |id: ConfigId| self.configuration(id).is_some_and(|c| c.safe);
        let safe = match request.ask {
            Ask::Apply(id) => top.safe || is_safe(id) && verdict != request.ask.failed(),
            Ask::UndoOf(id) => top.safe && !(done && is_safe(id)),
            _ => top.safe && !done,
        };
        // Failed, it is as before, whatever that is.
        let failed = verdict == request.ask.failed() || verdict == Verdict::Cancelled;
        self.topped(Top { safe, ..top }, (!failed).then_some(request.ask).into_iter())
    }

    fn creates_actuator(&self, id: ConfigId) -> bool {
        let types = self.get(EMPTY).map(|world| world.system.catalogue());
        let actuator = |ty: TypeName| types.and_then(|types| types.get(ty)).is_some_and(|ty| ty.actuator);
        self.configuration(id)
            .is_some_and(|c| c.changes.iter().any(|change| change.kind.makes().is_some_and(|(_, ty, _)| actuator(ty))))
    }
}
