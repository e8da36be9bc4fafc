//! Worlds, each once: which of them are one for whoever asks.

use super::outcome::{FramePlaces, Went, WorldId};
use super::shape::StackShape;
use super::systems::SystemId;
use super::world::{Exact, Knowledge, Worlds};
use crate::stack::{FrameId, World};
use crate::system::View;
use rustc_hash::FxHasher;
use std::hash::{Hash, Hasher};
use std::rc::Rc;

impl Worlds<'_> {
    /// Where it leads that a world has become another one, whose system has that number.
    pub(super) fn went(&mut self, from: WorldId, world: World, system: SystemId, pushed: &[FrameId]) -> Went {
        let shape = self.shapes.of(&world.stack);
        let (deep, left) = (shape.deep, shape.left);
        if !self.confirms {
            return Went { world: self.intern_shaped(world, system, &shape), places: None, deep, left };
        }
        let ids: Box<[FrameId]> = shape.ids(&world.stack).collect();
        let place = |id: &FrameId| ids.iter().position(|other| other == id).and_then(|at| u8::try_from(at).ok());
        let of_before = self.ids(from).map(|id| place(&id)).collect();
        let of = |id: &FrameId| world.stack.frame(*id).map(|frame| frame.configuration);
        let pushed = pushed.iter().filter_map(|id| Some((of(id)?, place(id)?))).collect();
        let world = self.intern_shaped(world, system, &shape);
        Went { world, places: Some(Rc::new(FramePlaces { of: of_before, pushed })), deep, left }
    }

    /// The number of a world whose system has that number.
    pub(super) fn intern(&mut self, world: World, system: SystemId) -> WorldId {
        let shape = self.shapes.of(&world.stack);
        self.intern_shaped(world, system, &shape)
    }

    fn intern_shaped(&mut self, world: World, system: SystemId, shape: &Rc<StackShape>) -> WorldId {
        let mut hasher = FxHasher::default();
        (system, &shape.counted).hash(&mut hasher);
        let in_order = self.shapes.undone.in_order;
        let same = |id: &&WorldId| match &self.worlds[**id as usize] {
            Knowledge::Exact(exact) => {
                exact.system == system
                    && (Rc::ptr_eq(&exact.shape, shape) || exact.shape.counted == shape.counted)
                    && (!in_order || exact.shape.ids(&exact.world.stack).eq(shape.ids(&world.stack)))
            }
            Knowledge::Top(_) => false,
        };
        let hash = hasher.finish();
        if let Some(id) = self.index.get(&hash).and_then(|ids| ids.iter().find(same)) {
            return *id;
        }
        let (id, mut world) = (self.next(), world);
        self.shapes.share(&mut world.stack);
        let safe = world.stack.safe().next().is_some();
        let piled_up = world.stack.frames().iter().any(|frame| frame.is_squashed());
        let mut actuator = false;
        world.system.for_each_component(&mut |node| actuator |= node.ty.actuator);
        let exact = Exact { world, system, safe, actuator, piled_up, shape: shape.clone() };
        self.worlds.push(Knowledge::Exact(Box::new(exact)));
        self.index.entry(hash).or_default().push(id);
        id
    }
}
