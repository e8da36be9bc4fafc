//! The configurator's half of the product: system and stack, as requests change them.
//!
//! Two worlds are one when they cannot be told apart by what may be requested in them: the same components in the same
//! run states with the same connections (no precondition looks at a value), and the same frames that the coordinator may
//! undo, each blocked by the same kind of frames above it. Frames that nobody ever undoes count only by what they block.
//! Which of two frames lies above the other counts only where it matters: where one keeps the other from being undone, or
//! both have one name, of which the newest is undone first. (Where the top is undone, whatever it is, it always matters.)
//! Each world is planned in with the real planner and the real stack, once per request.

use crate::limits;
use crate::model::{
    Ask, Catalogue, Code, ComponentName, ConfigId, Configuration, Deployment, Findings, MemberRef, Policy, RunState,
    TypeName,
};
use crate::plan::footprint::{Index, Slot};
use crate::plan::{Context, PlannedStep, Refusal, plan};
use crate::stack::{Frame, Op, Requester, Stack, transaction};
use crate::system::{System, View, step};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;

/// The number of a world.
pub type WorldId = u32;

/// The world in which nothing was applied.
pub const EMPTY: WorldId = 0;

/// A world.
pub struct World {
    /// The system.
    pub system: System,
    /// The frames in force.
    pub stack: Stack,
}

/// What a request did.
#[derive(Debug, Clone)]
pub enum Applied {
    /// It is answered *ok* or *undone* in this world; `may_fail`: or it fails, and the world stays.
    Done {
        /// The world after it.
        world: WorldId,
        /// Whether there is a step that can fail.
        may_fail: bool,
        /// A configuration that may be undone, of which one coordinator has more than [`limits::CHECK_LEFT`] frames then.
        left: Option<ConfigId>,
    },
    /// It is refused, and the world stays.
    Refused {
        /// Which of the requests made together.
        which: usize,
        /// Why.
        findings: Rc<Findings>,
    },
    /// It would leave more frames of one configuration and one coordinator than are followed.
    TooDeep(ConfigId),
}

#[derive(PartialEq, Eq, Hash)]
struct Key {
    components: Vec<(ComponentName, TypeName, RunState)>,
    links: Vec<(MemberRef, MemberRef)>,
    frames: Vec<Kept>,
}

/// A frame that may be undone: of which configuration, by whom, and whether one that never is keeps it from that.
type Kept = (ConfigId, Requester, bool);

/// All worlds that were met.
pub struct Worlds<'a> {
    deployment: &'a Deployment,
    context: Context,
    requester: Requester,
    /// Configurations whose frames the coordinator may undo; none: all of them.
    undone: Option<FxHashSet<ConfigId>>,
    worlds: Vec<World>,
    keys: FxHashMap<Key, WorldId>,
    done: FxHashMap<(WorldId, Requester, Vec<Ask>), Applied>,
    /// Warnings of plans, each once.
    pub warnings: Findings,
    warned: FxHashSet<(Code, String)>,
    /// By address of the two frames, which are kept alive here.
    blocks: FxHashMap<(usize, usize), (bool, Arc<Frame>, Arc<Frame>)>,
}

/// The context in which a deployment's configurations are planned.
pub fn context(deployment: &Deployment) -> Context {
    Context { activities: deployment.activities.keys().copied().collect::<BTreeSet<_>>(), avoid: BTreeSet::new() }
}

/// How a deployment's coordinator is called in frames.
///
/// # Panics
/// Never: a deployment's name is a component name without prefix.
pub fn requester(deployment: &Deployment) -> Requester {
    Requester::Coordinator(ComponentName::new(deployment.name.as_str()).expect("a plain name"))
}

impl<'a> Worlds<'a> {
    /// The empty world has the number 0.
    pub fn new(deployment: &'a Deployment, catalogue: &Catalogue, undone: Option<FxHashSet<ConfigId>>) -> Self {
        let mut worlds = Self {
            deployment,
            context: context(deployment),
            requester: requester(deployment),
            undone,
            worlds: Vec::new(),
            keys: FxHashMap::default(),
            done: FxHashMap::default(),
            warnings: Vec::new(),
            warned: FxHashSet::default(),
            blocks: FxHashMap::default(),
        };
        let system = System::new(Arc::new(catalogue.clone()));
        worlds.intern(World { system, stack: Stack::new(deployment.limits.stack) });
        worlds
    }

    /// The world of that number.
    pub fn get(&self, id: WorldId) -> &World {
        &self.worlds[id as usize]
    }

    /// What `asks`, made together by the deployment's coordinator, do in a world.
    pub fn apply(&mut self, id: WorldId, asks: &[Ask]) -> Applied {
        self.apply_by(self.requester, id, asks)
    }

    /// What `asks`, made together by that coordinator, do in a world.
    pub fn apply_by(&mut self, by: Requester, id: WorldId, asks: &[Ask]) -> Applied {
        if let Some(known) = self.done.get(&(id, by, asks.to_vec())) {
            return known.clone();
        }
        let applied = match apply(self.deployment, &self.context, by, self.get(id), asks) {
            Err(refusal) => Applied::Refused { which: refusal.request, findings: Rc::new(refusal.findings) },
            Ok(Change { world, steps, warnings }) => {
                for warning in warnings {
                    if self.warned.insert((warning.code, warning.message.clone())) {
                        self.warnings.push(warning);
                    }
                }
                match self.more_than(limits::CHECK_FRAMES, &world) {
                    Some(id) => Applied::TooDeep(id),
                    None => Applied::Done {
                        may_fail: !steps.is_empty(),
                        left: self.more_than(limits::CHECK_LEFT, &world),
                        world: self.intern(world),
                    },
                }
            }
        };
        self.done.insert((id, by, asks.to_vec()), applied.clone());
        applied
    }

    /// The configurations of a coordinator's frames that may be undone, in no order.
    pub fn frames_of(&self, by: Requester, id: WorldId, undone: Option<&FxHashSet<ConfigId>>) -> Vec<ConfigId> {
        let frames = self.get(id).stack.frames().iter();
        let counted = |id: &ConfigId| self.is_undone(*id) && undone.is_none_or(|undone| undone.contains(id));
        let mut ids: Vec<ConfigId> =
            frames.filter(|f| f.requester == by).map(|f| f.configuration).filter(counted).collect();
        ids.sort_unstable_by_key(|id| id.as_str());
        ids
    }

    /// Configurations that were asked for in some world.
    pub fn asked(&self) -> FxHashSet<ConfigId> {
        let asks = self.done.keys().flat_map(|(_, _, asks)| asks);
        asks.filter_map(|ask| if let Ask::Apply(id) = ask { Some(*id) } else { None }).collect()
    }

    /// Plans a configuration in the world with the most components.
    ///
    /// # Errors
    /// Why it is refused there.
    pub fn try_anywhere(&self, configuration: &Configuration) -> Result<(), Refusal> {
        let fullest = self.worlds.iter().max_by_key(|world| world.system.len());
        fullest.map_or(Ok(()), |world| plan(&world.system, configuration, &self.context).map(|_| ()))
    }

    fn is_undone(&self, id: ConfigId) -> bool {
        self.undone.as_ref().is_none_or(|undone| undone.contains(&id))
    }

    /// A configuration of which one coordinator has more frames than that. Those of another one come of other rounds.
    fn more_than(&self, most: usize, world: &World) -> Option<ConfigId> {
        let mut counts: FxHashMap<(ConfigId, Requester), usize> = FxHashMap::default();
        let deep = world.stack.frames().iter().find(|frame| {
            let count = counts.entry((frame.configuration, frame.requester)).or_default();
            *count += 1;
            self.is_undone(frame.configuration) && *count > most
        });
        deep.map(|frame| frame.configuration)
    }

    fn intern(&mut self, world: World) -> WorldId {
        let mut components = Vec::with_capacity(world.system.len());
        world.system.for_each_component(&mut |node| components.push((node.name, node.ty.name, node.state)));
        components.sort_unstable();
        let mut links = Vec::new();
        world.system.for_each_link(&mut |from, to, _: Policy| links.push((from, to)));
        links.sort_unstable();
        let frames = self.shape(&world);
        let key = Key { components, links, frames };
        if let Some(id) = self.keys.get(&key) {
            return *id;
        }
        let id = WorldId::try_from(self.worlds.len()).unwrap_or(WorldId::MAX);
        self.worlds.push(world);
        self.keys.insert(key, id);
        id
    }

    /// The frames that may be undone, each with whether one that never is keeps it from that; in a canonical order.
    fn shape(&mut self, world: &World) -> Vec<Kept> {
        let frames = world.stack.frames();
        let mut kept: Vec<(&Arc<Frame>, bool)> = Vec::new();
        for (i, frame) in frames.iter().enumerate() {
            if self.is_undone(frame.configuration) {
                let blocked = frames[i + 1..]
                    .iter()
                    .any(|above| !self.is_undone(above.configuration) && self.blocked(frame, above));
                kept.push((frame, blocked));
            }
        }
        if self.undone.is_none() {
            return kept.into_iter().map(|(frame, blocked)| (frame.configuration, frame.requester, blocked)).collect();
        }
        let mut shape = Vec::with_capacity(kept.len());
        while !kept.is_empty() {
            // Of those that could as well lie at the bottom, that with the least name.
            let mut least = 0;
            for at in 1..kept.len() {
                let (frame, _) = kept[at];
                if frame.configuration.as_str() < kept[least].0.configuration.as_str()
                    && kept[..at].iter().all(|(below, _)| self.commute(below, frame))
                {
                    least = at;
                }
            }
            let (frame, blocked) = kept.remove(least);
            shape.push((frame.configuration, frame.requester, blocked));
        }
        shape
    }

    /// Whether it makes no difference which of two frames lies above the other: neither keeps the other from being
    /// undone, and they are not asked for by one name.
    fn commute(&mut self, a: &Arc<Frame>, b: &Arc<Frame>) -> bool {
        a.configuration != b.configuration && !self.blocked(a, b) && !self.blocked(b, a)
    }

    /// Whether `above` keeps `frame` from being undone (as the stack would say; values that are handed over do not).
    fn blocked(&mut self, frame: &Arc<Frame>, above: &Arc<Frame>) -> bool {
        let key = (Arc::as_ptr(frame) as usize, Arc::as_ptr(above) as usize);
        if let Some(known) = self.blocks.get(&key) {
            return known.0;
        }
        let over: FxHashSet<Slot> = above.saved.iter().map(|s| s.slot).collect();
        let index = Index::new(&frame.footprint, |touch| touch.serves.is_none_or(|slot| !over.contains(&slot)));
        let blocked = above.floor.is_some() || above.footprint.touches.iter().any(|touch| index.shares(touch));
        self.blocks.insert(key, (blocked, frame.clone(), above.clone()));
        blocked
    }
}

/// What requests made together lead to.
pub struct Change {
    /// The world after them.
    pub world: World,
    /// The steps.
    pub steps: Vec<PlannedStep>,
    /// What the plans warn of.
    pub warnings: Findings,
}

/// What `asks`, made together by `requester`, do in `world`.
///
/// # Errors
/// Why they are refused.
pub fn apply(
    deployment: &Deployment,
    context: &Context,
    requester: Requester,
    world: &World,
    asks: &[Ask],
) -> Result<Change, Refusal> {
    let mut requests = Vec::new();
    let mut places = Vec::new();
    for (i, ask) in asks.iter().enumerate() {
        let request = match ask {
            Ask::Apply(id) => deployment.configuration(*id).map(|configuration| Op::Push {
                configuration,
                requester,
                at: Time::default(),
                scope: None,
            }),
            Ask::UndoOf(id) => world.stack.newest_of(*id, Some(requester)).map(|frame| Op::Undo(frame.id)),
            Ask::Undo => {
                let own = world.stack.frames().iter().rev().find(|frame| frame.requester == requester);
                Some(own.map_or(Op::UndoTop, |frame| Op::Undo(frame.id)))
            }
            Ask::UndoTo(n) => Some(Op::UndoTo(*n)),
            Ask::Commit { .. } => None,
        };
        // An undo of what is not there is answered *undone*.
        if let Some(request) = request {
            requests.push(request);
            places.push(i);
        }
    }
    let mut world = World { system: world.system.clone(), stack: world.stack.clone() };
    let mut transaction = transaction(&world.system, &world.stack, &requests, context)
        .map_err(|refusal| Refusal { request: places.get(refusal.request).copied().unwrap_or(0), ..refusal })?;
    for planned in &transaction.steps {
        step::effect(&planned.step, &mut world.system);
    }
    // Taken out, not copied: the stack commits frames, not steps.
    let steps = std::mem::take(&mut transaction.steps);
    let warnings = std::mem::take(&mut transaction.warnings);
    world.stack.commit(transaction);
    Ok(Change { world, steps, warnings })
}
