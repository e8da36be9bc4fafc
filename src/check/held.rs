//! Frames of a world: which are held by what is under way, which stay though the state they belonged to was left, and how one
//! is found again in the world that follows.

use super::desks::PlainBatch;
use super::outcome::{ConcurrentWork, Held, Went, WorldId};
use super::world::Worlds;
use crate::model::ConfigId;
use crate::stack::claims::Claim;
use crate::stack::{Batch, Frame, FrameId, LedDown, Request, Requester, Stack, held};
use smallvec::SmallVec;

impl Worlds<'_> {
    /// The frames that a batch under way pops or hands over to.
    pub fn held_by(&mut self, id: WorldId, asks: &PlainBatch, begun: &ConcurrentWork) -> Held {
        self.held_and_staying(id, asks, begun).0.clone()
    }

    /// The frames that undos of a batch under way are about and that stay, since these are refused.
    pub fn staying(&mut self, id: WorldId, asks: &PlainBatch, begun: &ConcurrentWork) -> Held {
        self.held_and_staying(id, asks, begun).1.clone()
    }

    fn held_and_staying(&mut self, id: WorldId, asks: &PlainBatch, begun: &ConcurrentWork) -> &(Held, Held) {
        let key = (id, asks.clone(), begun.clone());
        if !self.helds.contains_key(&key) {
            let of = match self.comes.get(&key) {
                Some(known) => (known.holds.iter().copied().collect(), known.group.staying().collect()),
                None => {
                    let group = self.group(id, asks, begun).unwrap_or_default();
                    let stay = group.stay.iter().map(|(_, frame)| *frame).collect();
                    (group.planned.iter().flat_map(held).collect(), stay)
                }
            };
            self.helds.insert(key.clone(), of);
        }
        &self.helds[&key]
    }

    /// Whether these may be refused for want of room on the stack.
    pub fn is_tight(&self, id: WorldId, requests: &[Request]) -> bool {
        let pushes = requests.iter().filter(|request| !request.ask.is_undo()).count();
        let by = requests.first().map(|request| request.requester);
        by.zip(self.get(id)).is_some_and(|(by, world)| pushes > 0 && !world.stack.has_room(by, pushes))
    }

    /// A frame of the world `from` in the world `to`, in which it lies below others.
    pub fn below(&self, from: WorldId, to: WorldId, frame: FrameId) -> Option<FrameId> {
        let (from, to) = (self.get(from)?, self.get(to)?);
        let of = |frame: &Frame| (frame.configuration, frame.requester);
        let like = of(from.stack.frame(frame)?);
        if to.stack.frame(frame).is_some_and(|frame| of(frame) == like) {
            return Some(frame);
        }
        let alike = |stack: &Stack| -> Vec<FrameId> {
            stack.frames().iter().filter(|frame| of(frame) == like).map(|frame| frame.id).collect()
        };
        let place = alike(&from.stack).iter().position(|id| *id == frame)?;
        alike(&to.stack).get(place).copied()
    }

    /// The world in which these undos were taken back, planned in `planned`, beside frames that others undo (`held`): frames
    /// that were to be undone with the states they belonged to stay without these.
    pub fn stay(
        &mut self,
        id: WorldId,
        planned: WorldId,
        undos: impl Iterator<Item = Request>,
        held: &[FrameId],
    ) -> Went {
        let (Some(before), Some(planned)) = (self.get(id), self.get(planned)) else { return Went::to(id) };
        // Others may have come since, above it; but none that was not there then.
        let was = undos.filter(|undo| planned.let_go_by(undo).is_some());
        let stay: SmallVec<[FrameId; 2]> = was.filter_map(|undo| before.left_with(&undo, held)).collect();
        self.unscoped(id, &stay)
    }

    /// The world in which these frames no longer belong to a state.
    pub(super) fn unscoped(&mut self, id: WorldId, stay: &[FrameId]) -> Went {
        let Some(before) = self.get(id).filter(|_| !stay.is_empty()) else { return Went::to(id) };
        let mut world = before.clone();
        stay.iter().for_each(|frame| world.stack.let_go(*frame));
        self.went(id, world, self.system(id), &[])
    }

    /// The place of a frame that counts.
    pub fn place(&self, id: WorldId, frame: FrameId) -> Option<usize> {
        self.ids(id).position(|id| id == frame)
    }

    /// The number of the frame that counts at that place.
    pub fn frame(&self, id: WorldId, place: u8) -> Option<FrameId> {
        self.ids(id).nth(usize::from(place))
    }

    /// Whether frames have been squashed somewhere, and which of them goes back to an order that was not followed everywhere.
    pub fn squashes_mixed(&self) -> bool {
        self.mixes_orders() && (0..self.count()).any(|id| self.is_piled_up(id))
    }

    /// Whether a frame of this configuration is in force, in whatever shape.
    pub fn is_in_force(&self, id: WorldId, configuration: ConfigId) -> bool {
        self.get(id).is_some_and(|world| world.stack.is_in_force(configuration))
    }

    /// What a batch would take along while everything is led down.
    pub fn taken_along(&self, id: WorldId, batch: &Batch) -> Option<(LedDown, Claim)> {
        let along = self.get(id)?.stack.taken_along(batch, LedDown::Whole, &self.claims)?;
        Some((LedDown::Whole, along))
    }

    /// Of what an operator has frames in force, the oldest first.
    pub fn of_operator(&self, id: WorldId) -> SmallVec<[ConfigId; 2]> {
        let frames = self.get(id).map(|world| world.stack.frames()).unwrap_or_default();
        let own = frames.iter().filter(|frame| frame.requester == Requester::Operator);
        own.map(|frame| frame.configuration).collect()
    }
}
