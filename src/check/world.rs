//! The configurator's half of the product: system, stack and what is known of them, as requests change them.
//!
//! What a batch comes to is asked of the stack ([`take_up`]), as a running configurator asks; each world is planned in once
//! per batch. Two worlds are one when nothing that is requested in them can tell them apart: the same components with the
//! same values, connections and policies, and the same frames with the same inverses. Frames that nobody ever undoes count
//! only by what they keep of others; which of two frames lies above the other counts only where they share something.
//!
//! After *broken* nothing is known any more: that is a world of its own ([`Top`]).

use super::desks::PlainBatch;
use super::kept::KeptValues;
use super::outcome::{Comes, ConcurrentWork, EndsSo, Held, InterruptedSo, SafeComes, Went, Whose, WorldId};
use super::shape::{Shapes, StackShape, Undone};
use super::systems::{SystemId, Systems};
use crate::model::{Ask, Catalogue, ConfigId, Configuration, Deployment, RequestId, Step};
use crate::plan::{PlanContext, Refusal, plan};
use crate::stack::claims::Claims;
use crate::stack::{
    BestEffort, FrameId, PlannedPushes, Reason, Request, Requester, Rules, SafeEnd, Stack, World, effort, take_up,
};
use crate::system::{System, step};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};
use std::rc::Rc;
use std::sync::Arc;

/// What is known of a world of which not everything is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Top {
    /// A safe configuration is in force.
    pub safe: bool,
    /// There may be an actuator.
    pub actuator: bool,
}

/// What is known of a world.
pub(super) enum Knowledge {
    Exact(Box<Exact>),
    Top(Top),
}

/// A world that is known.
pub(super) struct Exact {
    pub world: World,
    pub system: SystemId,
    /// A safe configuration is in force.
    pub safe: bool,
    /// There is an actuator.
    pub actuator: bool,
    /// Frames have been squashed.
    pub piled_up: bool,
    /// Those of its frames that count.
    pub shape: Rc<StackShape>,
}

/// All worlds that were met.
pub struct Worlds<'a> {
    pub(super) deployment: &'a Deployment,
    pub(super) configurations: FxHashMap<ConfigId, Configuration>,
    operator: FxHashSet<ConfigId>,
    /// What requests may touch, by their text.
    pub claims: Claims,
    context: PlanContext,
    pub(super) shapes: Shapes,
    /// Places of frames are wanted: there are configurations that must be confirmed.
    pub(super) confirms: bool,
    pub(super) worlds: Vec<Knowledge>,
    pub(super) index: FxHashMap<u64, SmallVec<[WorldId; 1]>>,
    pub(super) systems: Systems,
    /// What pushes come to in them.
    pub(super) pushes: PlannedPushes,
    pub(super) comes: FxHashMap<(WorldId, PlainBatch, ConcurrentWork), Rc<Comes>>,
    safes: FxHashMap<(WorldId, Request, Held), Rc<SafeComes>>,
    /// How batches may end: many may so in many worlds.
    pub(super) ends: KeptValues<Vec<EndsSo>>,
    /// The same where a safe configuration interrupts them.
    pub(super) interrupted: KeptValues<Vec<InterruptedSo>>,
    /// Frames that batches under way pop or hand over to, and those that stay though their undo was asked for.
    pub(super) helds: FxHashMap<(WorldId, PlainBatch, ConcurrentWork), (Held, Held)>,
    pub(super) withouts: FxHashMap<(WorldId, SmallVec<[Whose; 2]>), Option<Went>>,
    pub(super) asked: FxHashSet<ConfigId>,
    /// Configurations of which it can be told whether what they stand for is true.
    pub(super) judged: FxHashSet<ConfigId>,
}

/// The context in which a deployment's configurations are planned.
pub fn context(deployment: &Deployment) -> PlanContext {
    PlanContext { activities: deployment.activities.keys().copied().collect::<BTreeSet<_>>(), avoid: BTreeSet::new() }
}

impl<'a> Worlds<'a> {
    /// The empty world has the number 0.
    pub fn new(deployment: &'a Deployment, catalogue: &Catalogue, undone: Undone) -> Self {
        let mut worlds = Self {
            deployment,
            configurations: deployment.configurations.iter().map(|c| (c.id, c.clone())).collect(),
            operator: deployment.operator_applies().collect(),
            claims: Claims::new(deployment.configurations.iter(), catalogue),
            context: context(deployment),
            shapes: Shapes::new(undone, deployment.configurations.iter().map(|c| c.id)),
            confirms: deployment.configurations.iter().any(|c| c.confirm.is_some()),
            worlds: Vec::new(),
            index: FxHashMap::default(),
            systems: Systems::default(),
            pushes: PlannedPushes::default(),
            comes: FxHashMap::default(),
            safes: FxHashMap::default(),
            ends: KeptValues::default(),
            interrupted: KeptValues::default(),
            helds: FxHashMap::default(),
            withouts: FxHashMap::default(),
            asked: FxHashSet::default(),
            judged: FxHashSet::default(),
        };
        let mut system = System::new(Arc::new(catalogue.clone()));
        // What its subsystems export is there: when it may be touched is judged apart.
        for subsystem in &deployment.subsystems {
            let made = worlds.configurations.get(&ConfigId::from(subsystem.name));
            if let Some(Ok(planned)) = made.map(|made| plan(&system, made, &worlds.context)) {
                planned.steps.iter().for_each(|planned| step::effect(&planned.step, &mut system));
            }
        }
        let given = system.len();
        let world = World::new(system, Stack::remembering(deployment.limits.stack));
        worlds.met(World { given, ..world });
        worlds
    }

    /// The world of that number; none: it is not known.
    pub fn get(&self, id: WorldId) -> Option<&World> {
        match &self.worlds[id as usize] {
            Knowledge::Exact(exact) => Some(&exact.world),
            Knowledge::Top(_) => None,
        }
    }

    /// The world of which this is known.
    pub fn unknown(&mut self, top: Top) -> WorldId {
        let mut hasher = FxHasher::default();
        top.hash(&mut hasher);
        let hash = hasher.finish();
        let known = self.index.get(&hash).and_then(|ids| ids.iter().find(|id| self.top(**id) == Some(top)));
        if let Some(id) = known {
            return *id;
        }
        let id = self.next();
        self.worlds.push(Knowledge::Top(top));
        self.index.entry(hash).or_default().push(id);
        id
    }

    /// The numbers of the frames that count, in their order.
    pub(super) fn ids(&self, id: WorldId) -> impl Iterator<Item = FrameId> + '_ {
        let exact = match &self.worlds[id as usize] {
            Knowledge::Exact(exact) => Some(exact),
            Knowledge::Top(_) => None,
        };
        exact.into_iter().flat_map(|exact| exact.shape.ids(&exact.world.stack))
    }

    /// What is known of a world that is not known.
    pub fn top(&self, id: WorldId) -> Option<Top> {
        match &self.worlds[id as usize] {
            Knowledge::Exact(_) => None,
            Knowledge::Top(top) => Some(*top),
        }
    }

    /// Whether a safe configuration is in force.
    pub fn is_safe(&self, id: WorldId) -> bool {
        match &self.worlds[id as usize] {
            Knowledge::Exact(exact) => exact.safe,
            Knowledge::Top(top) => top.safe,
        }
    }

    /// Whether there is, or may be, an actuator.
    pub fn has_actuator(&self, id: WorldId) -> bool {
        match &self.worlds[id as usize] {
            Knowledge::Exact(exact) => exact.actuator,
            Knowledge::Top(top) => top.actuator,
        }
    }

    /// Whether frames have been squashed.
    pub fn is_piled_up(&self, id: WorldId) -> bool {
        matches!(&self.worlds[id as usize], Knowledge::Exact(exact) if exact.piled_up)
    }

    /// The number of the system of a world that is known.
    pub(super) fn system(&self, id: WorldId) -> SystemId {
        match &self.worlds[id as usize] {
            Knowledge::Exact(exact) => exact.system,
            Knowledge::Top(_) => SystemId::MAX,
        }
    }

    /// The configuration of that name.
    pub fn configuration(&self, id: ConfigId) -> Option<&Configuration> {
        self.configurations.get(&id)
    }

    pub(super) fn rules(&self) -> Rules<'_> {
        Rules {
            configurations: &self.configurations,
            operator: &self.operator,
            context: &self.context,
            at: Time::default(),
            held: &[],
            // All that one coordinator asks for is begun after what it asked before, and one operator is followed at a time.
            places: &[],
            joined: false,
            placed: false,
            rested: false,
            led: None,
            pushes: None,
        }
    }

    /// What a safe configuration comes to in a world that is known.
    pub fn safe(&mut self, id: WorldId, request: &Request, held: &Held) -> Rc<SafeComes> {
        let key = (id, Request { tag: (0, 0), ..*request }, held.clone());
        if let Some(known) = self.safes.get(&key) {
            return known.clone();
        }
        let Ask::Apply(configuration) = request.ask else { unreachable!("safe configurations are applied") };
        self.asked.insert(configuration);
        let Some(before) = self.get(id) else { unreachable!("planned in a world that is known") };
        let configuration = &self.configurations[&configuration];
        let BestEffort { planned, frame, troubles } =
            effort(&before.system, &before.stack, configuration, request, Time::default(), &self.context);
        let mut world = before.clone();
        let system = self.systems.carry_out(self.system(id), &mut world.system, &planned.steps);
        let edits = planned.parts[0].edits.clone();
        let done: Vec<Step> = match edits.over.is_empty() {
            true => Vec::new(),
            false => planned.steps.iter().map(|planned| planned.step.clone()).collect(),
        };
        let how = SafeEnd { left_out: !troubles.is_empty(), done: &done, ..SafeEnd::default() };
        let (pushed, verdict) = world.settle_safe(edits, frame, &how, held);
        let may_fail = !planned.steps.is_empty();
        let troubles = Rc::new(troubles.iter().flat_map(Reason::findings).collect());
        let comes = SafeComes { done: self.went(id, world, system, &[pushed]), verdict, troubles, may_fail };
        let comes = Rc::new(comes);
        self.safes.insert(key, comes.clone());
        comes
    }

    /// The world after a coordinator has come to its *down* state, and all are down.
    pub fn settle_down(&mut self, id: WorldId) -> Option<WorldId> {
        let mut world = self.get(id)?.clone();
        let system = self.system(id);
        world.settle_down().then(|| self.intern(world, system))
    }

    /// Whether a frame of this configuration by this requester counts.
    pub fn counts(&self, id: ConfigId, by: Requester) -> bool {
        let named = self.shapes.undone.ids.as_ref().is_none_or(|ids| ids.contains(&id));
        named || self.shapes.undone.bare.contains(&by) || by == Requester::Operator
    }

    /// Carries out requests that are answered together in a world of the caller's own. False: one is refused.
    pub fn carry_out(&self, world: &mut World, requests: &[Request]) -> bool {
        let rules = self.rules();
        let mut rest = requests;
        while !rest.is_empty() {
            let group = take_up(world, rest, &rules);
            if group.told.iter().any(|told| told.reason.is_some()) {
                return false;
            }
            if let Some(planned) = &group.planned {
                planned.steps.iter().for_each(|planned| step::effect(&planned.step, &mut world.system));
                world.stack.apply(planned.parts.iter().map(|part| &part.edits), &[]);
            }
            rest = &rest[group.takes.max(1).min(rest.len())..];
        }
        true
    }

    /// The same in a world whose system has that number: it has another one then. What pushes come to is known from elsewhere.
    pub(super) fn carry_on(&mut self, world: &mut World, system: &mut SystemId, requests: &[Request]) -> bool {
        let mut rest = requests;
        while !rest.is_empty() {
            let group = take_up(world, rest, &Rules { pushes: Some(self.pushes.of(*system)), ..self.rules() });
            if group.told.iter().any(|told| told.reason.is_some()) {
                return false;
            }
            if let Some(planned) = &group.planned {
                *system = self.systems.carry_out(*system, &mut world.system, &planned.steps);
                world.stack.apply(planned.parts.iter().map(|part| &part.edits), &[]);
            }
            rest = &rest[group.takes.max(1).min(rest.len())..];
        }
        true
    }

    /// The number of a world of the caller's own.
    pub fn met(&mut self, mut world: World) -> WorldId {
        let system = self.systems.number(&mut world.system);
        self.intern(world, system)
    }

    /// Configurations that were asked for in some world.
    pub fn asked(&self) -> &FxHashSet<ConfigId> {
        &self.asked
    }

    /// Plans a configuration in the world with the most components.
    ///
    /// # Errors
    /// Why it is refused there.
    pub fn try_anywhere(&self, configuration: &Configuration) -> Result<(), Refusal> {
        let worlds = (0..self.worlds.len()).filter_map(|id| self.get(id as WorldId));
        let fullest = worlds.max_by_key(|world| world.system.len());
        fullest.map_or(Ok(()), |world| plan(&world.system, configuration, &self.context).map(|_| ()))
    }

    /// Whether `request` would be refused if none but its requester had asked for anything; `before` stand before it in its
    /// batch, and frames of such configurations are there only where their undo was refused.
    pub fn is_refused_alone(
        &self,
        id: WorldId,
        before: &[Request],
        request: &Request,
        stays: impl Fn(ConfigId) -> bool,
    ) -> bool {
        let Some(world) = self.get(id) else { return false };
        let mut undone = world.clone();
        for frame in world.stack.frames().iter().rev().filter(|frame| frame.requester != request.requester) {
            let undo = Request::new(RequestId(0), Ask::UndoOf(frame.configuration), frame.requester);
            let mut without = undone.clone();
            if self.carry_out(&mut without, &[undo]) {
                undone = without;
            }
        }
        // Of what cannot be undone by itself it is not known how it would be without that.
        let mut stack = Stack::new(self.deployment.limits.stack);
        for frame in undone.stack.frames().iter().filter(|frame| frame.requester == request.requester) {
            stack.push((**frame).clone());
        }
        let mut alone = World::new(undone.system, stack);
        let own = alone.stack.frames().iter().rev().filter(|frame| frame.scope.is_none() && stays(frame.configuration));
        let undo = |id: ConfigId| Request::new(RequestId(0), Ask::UndoOf(id), request.requester);
        let left: Vec<Request> = own.map(|frame| undo(frame.configuration)).collect();
        for request in left.iter().chain(before) {
            let mut after = alone.clone();
            if self.carry_out(&mut after, std::slice::from_ref(request)) {
                alone = after;
            }
        }
        let group = take_up(&alone, std::slice::from_ref(request), &self.rules());
        group.told.iter().any(|told| told.reason.is_some())
    }

    /// How many there are: numbered from 0 on.
    pub(super) fn count(&self) -> WorldId {
        self.next()
    }

    /// [`Shapes::mixes_orders`].
    pub(super) fn mixes_orders(&self) -> bool {
        self.shapes.mixes_orders()
    }

    pub(super) fn next(&self) -> WorldId {
        WorldId::try_from(self.worlds.len()).unwrap_or(WorldId::MAX)
    }
}
