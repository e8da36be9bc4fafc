//! The configurator's half of the product: system, stack and what is known of them, as requests change them.
//!
//! What a batch comes to is asked of the stack ([`take_up`]), as a running configurator asks; each world is planned in once
//! per batch. Two worlds are one when nothing that is requested in them can tell them apart: the same components with the
//! same values, connections and policies, and the same frames with the same inverses. Frames that nobody ever undoes count
//! only by what they keep of others; which of two frames lies above the other counts only where they share something.
//!
//! After *broken* nothing is known any more: that is a world of its own ([`Top`]).

use super::alike::{hash_system, same_system};
use super::shape::{Counted, Shapes, Undone};
use crate::limits;
use crate::model::{Ask, Catalogue, Code, ConfigId, Configuration, Deployment, Findings, Verdict};
use crate::plan::{Context, PlannedStep, Refusal, plan};
use crate::stack::claims::Claims;
use crate::stack::{
    Effort, Frame, FrameId, Group, Planned, Reason, Request, Requester, Rules, Stack, World, effort, take_up,
};
use crate::system::{System, View, step};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet, FxHasher};
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::hash::{Hash, Hasher};
use std::rc::Rc;
use std::sync::Arc;

/// The number of a world.
pub type WorldId = u32;

/// The world in which nothing was applied.
pub const EMPTY: WorldId = 0;

/// What is known of a world of which not everything is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Top {
    /// A safe configuration is in force.
    pub safe: bool,
    /// There may be an actuator.
    pub actuator: bool,
}

enum Known {
    Exact(Box<Exact>),
    Top(Top),
}

struct Exact {
    world: World,
    counted: Vec<Counted>,
    /// The numbers of the counted frames.
    ids: Vec<FrameId>,
}

/// Where something leads to.
#[derive(Debug, Clone)]
pub struct Went {
    /// The world.
    pub world: WorldId,
    /// Of each frame that counted before, its place among those that count now; none: nothing was asked about that.
    pub places: Option<Rc<Vec<Option<u8>>>>,
    /// The places of the frames that were pushed, with the configurations.
    pub pushed: SmallVec<[(ConfigId, u8); 1]>,
    /// A configuration of which one requester has more than [`limits::CHECK_FRAMES`] frames then.
    pub deep: Option<ConfigId>,
    /// The same with [`limits::CHECK_LEFT`].
    pub left: Option<ConfigId>,
}

/// A part of a group that is carried out.
#[derive(Debug, Clone)]
pub struct PartOf {
    /// The place of its request in the batch.
    pub place: usize,
    /// When it was given up: those before it stand.
    pub before: Went,
    /// When it failed; none: there is nothing in it that can.
    pub failed: Option<Went>,
    /// Whether something is undone.
    pub undo: bool,
}

/// What the first requests of a batch come to.
#[derive(Debug, Clone)]
pub struct Comes {
    /// Told without being carried out: place and verdict.
    pub told: SmallVec<[(usize, Option<Verdict>); 2]>,
    /// Those that are told because they are refused.
    pub refused: Vec<(usize, Rc<Findings>)>,
    /// What is carried out; empty: nothing.
    pub parts: Vec<PartOf>,
    /// When all is done.
    pub done: Went,
    /// So many requests are settled then.
    pub takes: usize,
}

/// Frames that must stay as they are.
pub type Held = SmallVec<[FrameId; 2]>;

/// What is under way beside a batch, as far as the batch minds it.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Beside {
    /// Frames that others pop or hand over to, or that wait for their confirmation.
    pub held: Held,
    /// The batch was begun as one, and some of it were answered since.
    pub joined: bool,
    /// Its pushes have taken their place.
    pub placed: bool,
}

/// What a safe configuration comes to.
#[derive(Debug, Clone)]
pub struct SafeComes {
    /// When all of it is done that can be.
    pub done: Went,
    /// What of it cannot be done there: then it ends *broken*.
    pub troubles: Rc<Findings>,
    /// Whether a step of it can fail.
    pub may_fail: bool,
}

/// All worlds that were met.
pub struct Worlds<'a> {
    deployment: &'a Deployment,
    configurations: FxHashMap<ConfigId, Configuration>,
    operator: FxHashSet<ConfigId>,
    /// What requests may touch, by their text.
    pub claims: Claims,
    context: Context,
    shapes: Shapes,
    /// Places of frames are wanted: there are configurations that must be confirmed.
    confirms: bool,
    worlds: Vec<Known>,
    index: FxHashMap<u64, SmallVec<[WorldId; 1]>>,
    comes: FxHashMap<(WorldId, SmallVec<[Request; 2]>, Beside), Rc<Comes>>,
    safes: FxHashMap<(WorldId, Request, Held), Rc<SafeComes>>,
    pub(super) helds: FxHashMap<(WorldId, SmallVec<[Request; 2]>, bool), Held>,
    asked: FxHashSet<ConfigId>,
    /// Warnings of plans, each once.
    pub warnings: Findings,
    warned: FxHashSet<(Code, String)>,
}

/// Requests without what means nothing to what they come to.
pub(super) fn plain(requests: &[Request]) -> SmallVec<[Request; 2]> {
    requests.iter().map(|request| Request { tag: (0, 0), ..*request }).collect()
}

/// The context in which a deployment's configurations are planned.
pub fn context(deployment: &Deployment) -> Context {
    Context { activities: deployment.activities.keys().copied().collect::<BTreeSet<_>>(), avoid: BTreeSet::new() }
}

impl<'a> Worlds<'a> {
    /// The empty world has the number 0.
    pub fn new(deployment: &'a Deployment, catalogue: &Catalogue, undone: Undone) -> Self {
        let mut worlds = Self {
            deployment,
            configurations: deployment.configurations.iter().map(|c| (c.id, c.clone())).collect(),
            operator: deployment.operator_applies().collect(),
            claims: Claims::new(deployment.configurations.iter()),
            context: context(deployment),
            shapes: Shapes::new(undone),
            confirms: deployment.configurations.iter().any(|c| c.confirm.is_some()),
            worlds: Vec::new(),
            index: FxHashMap::default(),
            comes: FxHashMap::default(),
            safes: FxHashMap::default(),
            helds: FxHashMap::default(),
            asked: FxHashSet::default(),
            warnings: Vec::new(),
            warned: FxHashSet::default(),
        };
        let system = System::new(Arc::new(catalogue.clone()));
        worlds.intern(World::new(system, Stack::new(deployment.limits.stack)));
        worlds
    }

    /// The world of that number; none: it is not known.
    pub fn get(&self, id: WorldId) -> Option<&World> {
        match &self.worlds[id as usize] {
            Known::Exact(exact) => Some(&exact.world),
            Known::Top(_) => None,
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
        self.worlds.push(Known::Top(top));
        self.index.entry(hash).or_default().push(id);
        id
    }

    /// The numbers of the frames that count, in their order.
    pub(super) fn ids(&self, id: WorldId) -> &[FrameId] {
        match &self.worlds[id as usize] {
            Known::Exact(exact) => &exact.ids,
            Known::Top(_) => &[],
        }
    }

    /// What is known of a world that is not known.
    pub fn top(&self, id: WorldId) -> Option<Top> {
        match &self.worlds[id as usize] {
            Known::Exact(_) => None,
            Known::Top(top) => Some(*top),
        }
    }

    /// Whether a safe configuration is in force.
    pub fn is_safe(&self, id: WorldId) -> bool {
        match &self.worlds[id as usize] {
            Known::Exact(exact) => exact.world.stack.safe().next().is_some(),
            Known::Top(top) => top.safe,
        }
    }

    /// Whether there is, or may be, an actuator.
    pub fn has_actuator(&self, id: WorldId) -> bool {
        match &self.worlds[id as usize] {
            Known::Exact(exact) => {
                let mut some = false;
                exact.world.system.for_each_component(&mut |node| some |= node.ty.actuator);
                some
            }
            Known::Top(top) => top.actuator,
        }
    }

    /// The configuration of that name.
    pub fn configuration(&self, id: ConfigId) -> Option<&Configuration> {
        self.configurations.get(&id)
    }

    /// What the rest of a batch comes to in a world that is known.
    pub fn comes(&mut self, id: WorldId, requests: &[Request], beside: &Beside) -> Rc<Comes> {
        let key = (id, plain(requests), beside.clone());
        if let Some(known) = self.comes.get(&key) {
            return known.clone();
        }
        let comes = Rc::new(self.work_out(id, &key.1, beside));
        self.comes.insert(key, comes.clone());
        comes
    }

    /// The first requests of a batch, as the stack decides.
    pub fn group(&self, id: WorldId, requests: &[Request], beside: &Beside) -> Option<Group> {
        let rules = Rules { held: &beside.held, joined: beside.joined, placed: beside.placed, ..self.rules() };
        self.get(id).map(|world| take_up(world, requests, &rules))
    }

    fn rules(&self) -> Rules<'_> {
        Rules {
            configurations: &self.configurations,
            operator: &self.operator,
            context: &self.context,
            at: Time::default(),
            busy: false,
            held: &[],
            joined: false,
            placed: false,
        }
    }

    fn work_out(&mut self, id: WorldId, requests: &[Request], beside: &Beside) -> Comes {
        self.asked.extend(requests.iter().filter_map(|r| if let Ask::Apply(id) = r.ask { Some(id) } else { None }));
        let group = self.group(id, requests, beside).unwrap_or_default();
        let refused = group.told.iter().filter_map(|told| {
            let reasons = match told.reason.as_ref()? {
                Reason::Overtaken | Reason::GivenUp | Reason::SafeCame(_) => return None,
                other => other.findings(),
            };
            Some((told.place, Rc::new(reasons)))
        });
        let mut comes = Comes {
            told: group.told.iter().map(|told| (told.place, told.verdict)).collect(),
            refused: refused.collect(),
            parts: Vec::new(),
            done: Went::to(id),
            takes: group.takes.max(1),
        };
        let refused = |before: usize| -> Held {
            group.stay.iter().filter(|(place, _)| *place < before).map(|(_, frame)| *frame).collect()
        };
        let Some(planned) = group.planned else {
            comes.done = self.unscoped(id, &refused(comes.takes));
            return comes;
        };
        let held = &beside.held;
        for warning in &planned.warnings {
            if self.warned.insert((warning.code, warning.message.clone())) {
                self.warnings.push(warning.clone());
            }
        }
        let mut may_fail = vec![false; planned.parts.len()];
        for at in 0..planned.steps.len() {
            may_fail[planned.part_of(planned.place(at))] = true;
        }
        for (k, part) in planned.parts.iter().enumerate() {
            let place = group.places[k];
            let holds = part.pushes.and_then(|id| self.configurations.get(&id)).is_some_and(|c| c.holds.is_some());
            let mut stay = refused(place);
            let before = self.after(id, &planned, k, &stay, held);
            let request = &requests[place];
            let stays = part.frame.as_ref().filter(|_| request.ask.is_undo() && request.scope.is_some());
            let failed = (may_fail[k] || holds).then(|| match stays {
                Some(frame) => {
                    stay.push(frame.id);
                    self.after(id, &planned, k, &stay, held)
                }
                None => before.clone(),
            });
            comes.parts.push(PartOf { place, before, failed, undo: part.pushes.is_none() });
        }
        comes.done = self.after(id, &planned, planned.parts.len(), &refused(comes.takes), held);
        comes
    }

    /// The world after the first `parts` of a plan. `stay`: frames that were to be undone with the state they belonged to.
    fn after(&mut self, id: WorldId, planned: &Planned, parts: usize, stay: &[FrameId], held: &[FrameId]) -> Went {
        if parts == 0 {
            return self.unscoped(id, stay);
        }
        let Some(before) = self.get(id) else { unreachable!("planned in a world that is known") };
        let mut world = before.clone();
        if parts == planned.parts.len() {
            planned.steps.iter().for_each(|planned| step::effect(&planned.step, &mut world.system));
        } else {
            let steps = planned.parts[..parts].last().map_or(0, |part| part.range.end as usize);
            planned.whole()[..steps].iter().for_each(|planned| step::effect(&planned.step, &mut world.system));
        }
        let edits = planned.parts[..parts].iter().map(|part| &part.edits);
        let pushed = world.stack.apply(edits, held);
        stay.iter().for_each(|frame| world.stack.unscope(*frame));
        self.went(id, world, &pushed)
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
        let Effort { planned, frame, troubles } =
            effort(&before.system, &before.stack, configuration, request, Time::default(), &self.context);
        let mut world = before.clone();
        planned.steps.iter().for_each(|planned| step::effect(&planned.step, &mut world.system));
        let edits = planned.parts[0].edits.clone();
        let pushed = world.stack.push_safe(edits, Frame { partial: !troubles.is_empty(), ..frame }, held);
        let may_fail = !planned.steps.is_empty();
        let troubles = Rc::new(troubles.iter().flat_map(Reason::findings).collect());
        let comes = SafeComes { done: self.went(id, world, &[pushed]), troubles, may_fail };
        let comes = Rc::new(comes);
        self.safes.insert(key, comes.clone());
        comes
    }

    /// The world after a coordinator has come to its *down* state, and all are down.
    pub fn settle_down(&mut self, id: WorldId) -> Option<WorldId> {
        let mut world = self.get(id)?.clone();
        world.settle_down().then(|| self.intern(world))
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

    /// The number of a world of the caller's own.
    pub fn met(&mut self, world: World) -> WorldId {
        self.intern(world)
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

    /// Whether `request` would be refused if none but its requester had frames in force.
    pub fn is_refused_alone(&self, id: WorldId, request: &Request) -> bool {
        let Some(world) = self.get(id) else { return false };
        let mut stack = Stack::new(self.deployment.limits.stack);
        for frame in world.stack.frames().iter().filter(|frame| frame.requester == request.requester) {
            stack.push((**frame).clone());
        }
        let alone = World::new(world.system.clone(), stack);
        let group = take_up(&alone, std::slice::from_ref(request), &self.rules());
        group.told.iter().any(|told| told.reason.is_some())
    }

    /// The steps of a group, for who shows them.
    pub fn steps(&self, id: WorldId, requests: &[Request]) -> Vec<PlannedStep> {
        self.group(id, requests, &Beside::default())
            .and_then(|group| group.planned)
            .map_or_else(Vec::new, |planned| planned.steps)
    }

    fn next(&self) -> WorldId {
        WorldId::try_from(self.worlds.len()).unwrap_or(WorldId::MAX)
    }

    pub(super) fn went(&mut self, from: WorldId, world: World, pushed: &[FrameId]) -> Went {
        let (deep, left) = (self.more_than(limits::CHECK_FRAMES, &world), self.more_than(limits::CHECK_LEFT, &world));
        if !self.confirms {
            return Went { world: self.intern(world), places: None, pushed: SmallVec::new(), deep, left };
        }
        let (counted, ids) = self.shapes.of(&world.stack);
        let place = |id: &FrameId| ids.iter().position(|other| other == id).and_then(|at| u8::try_from(at).ok());
        let before = self.ids(from).to_vec();
        let places = before.iter().map(place).collect();
        let of = |id: &FrameId| world.stack.frame(*id).map(|frame| frame.configuration);
        let pushed = pushed.iter().filter_map(|id| Some((of(id)?, place(id)?))).collect();
        let world = self.intern_shaped(world, counted, ids);
        Went { world, places: Some(Rc::new(places)), pushed, deep, left }
    }

    /// A configuration of which one requester has more frames than that. Those of another one come of other rounds.
    fn more_than(&self, most: usize, world: &World) -> Option<ConfigId> {
        let mut counts: FxHashMap<(ConfigId, Requester), usize> = FxHashMap::default();
        let frames =
            world.stack.frames().iter().filter(|frame| self.shapes.undone.counts(frame) && !frame.is_squashed());
        let deep = frames.into_iter().find(|frame| {
            let count = counts.entry((frame.configuration, frame.requester)).or_default();
            *count += 1;
            *count > most
        });
        deep.map(|frame| frame.configuration)
    }

    fn intern(&mut self, world: World) -> WorldId {
        let (counted, ids) = self.shapes.of(&world.stack);
        self.intern_shaped(world, counted, ids)
    }

    fn intern_shaped(&mut self, world: World, counted: Vec<Counted>, ids: Vec<FrameId>) -> WorldId {
        let mut hasher = FxHasher::default();
        hash_system(&world.system, &mut hasher);
        counted.hash(&mut hasher);
        let hash = hasher.finish();
        let same = |id: &&WorldId| match &self.worlds[**id as usize] {
            Known::Exact(exact) => {
                let same = exact.counted == counted && (!self.shapes.undone.in_order || exact.ids == ids);
                same && same_system(&exact.world.system, &world.system)
            }
            Known::Top(_) => false,
        };
        if let Some(id) = self.index.get(&hash).and_then(|ids| ids.iter().find(same)) {
            return *id;
        }
        let id = self.next();
        self.worlds.push(Known::Exact(Box::new(Exact { world, counted, ids })));
        self.index.entry(hash).or_default().push(id);
        id
    }
}
