//! A running deployment followed through the product: in which of its states it may be after what was seen of it.
//!
//! What is seen is what comes from outside, in the order in which it came, and the answers. Everything between (who takes
//! what from an inbox, whether something had begun when it was stopped) is nobody's to see, so there may be more states than
//! one. When there is none, the running deployment has done something that `check` does not know of.
//!
//! Here every frame counts, in its place, and all answers are given: what `check` may leave out, since nobody can tell the
//! difference, is not left out.

use super::aside::Aside;
use super::coupling;
use super::product::Product;
use super::shape::Undone;
use super::state::{Answers, Move, Nexts, ProductState};
use super::world::Worlds;
use crate::model::{Ask, Catalogue, ComponentName, Deployment, EventName, MemberRef, RequestId, Snapshot, Target};
use crate::stack::{Batch, Request, Requester, Why, claims};
use crate::statechart::Chart;
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;

/// More states than that are not followed: each of many frames that nobody has confirmed may have been taken back, or not.
const MOST: usize = 20_000;

/// What is seen of a running deployment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seen {
    /// An event came from outside, when all coordinators were at rest.
    Event(EventName),
    /// An operator asked for something, when all coordinators were at rest.
    Operator {
        /// What.
        ask: Ask,
        /// Also where it is not the operator's own.
        force: bool,
    },
    /// A request was answered, or what was applied was taken back unasked.
    Answer {
        /// Who had asked.
        by: Requester,
        /// The event that tells it.
        event: EventName,
    },
}

/// A running deployment at rest, to be compared.
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    /// The innermost active state of each coordinator, in the deployment's order.
    pub leaves: Vec<String>,
    /// The system.
    pub system: Snapshot,
    /// The frames, oldest first: configuration, who asked, of how many it was squashed.
    pub frames: Vec<(String, String, usize)>,
    /// What is not answered yet, as `ASK by WHO`.
    pub open: Vec<String>,
}

/// A state in which it may be, and the answers of its last move that were not seen yet.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
struct May {
    state: ProductState,
    owed: Answers,
}

/// What is known of a state from being in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Known {
    /// System and stack are known; not so after *broken*.
    pub world: bool,
    /// So many requests are under way, and so many wait.
    pub under_way: usize,
    /// See there.
    pub waiting: usize,
}

/// Follows one running deployment.
pub struct Follower<'a> {
    product: Product<'a>,
    may: Vec<May>,
}

impl<'a> Follower<'a> {
    /// At the start of a deployment with these coordinators (compiled, in the deployment's order); none: one of them cannot
    /// be entered.
    pub fn new(deployment: &'a Deployment, charts: &[&'a Chart], catalogue: &Catalogue) -> Option<Self> {
        let numbers: Vec<usize> = (0..charts.len()).collect();
        let views: Vec<Deployment> =
            numbers.iter().filter_map(|number| coupling::view(deployment, charts, *number)).collect();
        let mut product = Product::new(deployment, &views, charts, &numbers, catalogue);
        product.worlds = Worlds::new(deployment, catalogue, Undone { in_order: true, ..Undone::default() });
        product.tells_all = true;
        product.aside = Aside::default();
        product.most_waiting = usize::MAX;
        let state = product.start()?;
        Some(Self { product, may: vec![May { state, owed: Answers::new() }] })
    }

    /// Moves on to where what was seen may lead.
    ///
    /// # Errors
    /// There is no such state: where it may have been, in words.
    pub fn see(&mut self, seen: Seen) -> Result<(), String> {
        let (rest, answering) = self.silently();
        let answering_too = answering.clone();
        let mut next: FxHashSet<May> = FxHashSet::default();
        match seen {
            Seen::Answer { by, event } => {
                for mut may in answering {
                    let (request, verdict) = may.owed[0];
                    if request.requester == by && verdict.event(request.ask) == event {
                        may.owed.remove(0);
                        next.insert(may);
                    }
                }
            }
            Seen::Event(name) => {
                for state in rest.iter().filter(|state| is_quiet(state)) {
                    let mut nexts = Nexts::default();
                    self.product.raised(state, name, Move::Event(0), &mut nexts);
                    next.extend(nexts.all.into_iter().map(|next| May { state: next.state, owed: next.answers }));
                }
            }
            Seen::Operator { ask, force } => {
                for state in rest.iter().filter(|state| is_quiet(state)) {
                    let request = Request { force, ..Request::new(RequestId(0), ask, Requester::Operator) };
                    let states = self.product.arrive(state.clone(), &Batch::one(request));
                    next.extend(states.into_iter().map(|state| {
                        let state = self.product.settle(state);
                        May { state, owed: Answers::new() }
                    }));
                }
            }
        }
        if next.is_empty() {
            let told = self.told(rest.iter());
            self.may = rest.into_iter().map(|state| May { state, owed: Answers::new() }).chain(answering_too).collect();
            return Err(format!("nothing of this leads there:\n{told}"));
        }
        self.may = next.into_iter().collect();
        Ok(())
    }

    /// Everything is at rest, and this is how it stands: only states that look the same remain.
    ///
    /// # Errors
    /// None does: how those look in which it may be.
    pub fn rests(&mut self, shown: &Shown) -> Result<Known, String> {
        let (rest, _) = self.silently();
        let same: Vec<&ProductState> = rest.iter().filter(|state| is_quiet(state) && self.fits(state, shown)).collect();
        let Some(first) = same.first() else {
            let told = self.told(rest.iter().filter(|s| is_quiet(s)));
            self.may = rest.into_iter().map(|state| May { state, owed: Answers::new() }).collect();
            return Err(format!("it is in none of these:\n{told}"));
        };
        let known = Known {
            world: self.product.worlds.get(first.world).is_some(),
            under_way: first.desk.under_way().len(),
            waiting: first.desk.len(),
        };
        self.may = same.into_iter().map(|state| May { state: state.clone(), owed: Answers::new() }).collect();
        Ok(known)
    }

    /// The states in which it may be, in words.
    pub fn may(&mut self) -> String {
        let may = self.may.clone();
        let (rest, _) = self.silently();
        self.may = may;
        self.told(rest.iter())
    }

    /// Whether more was on its way between coordinators than is followed, or it may have been in more states than are.
    pub fn overflowed(&self) -> bool {
        self.product.overflow
    }

    /// All states in which it may be without anything further being seen, and those that the next answer would lead to.
    fn silently(&mut self) -> (FxHashSet<ProductState>, Vec<May>) {
        let mut rest: FxHashSet<ProductState> = FxHashSet::default();
        let mut answering: FxHashSet<May> = FxHashSet::default();
        let mut open: Vec<ProductState> = Vec::new();
        let mut more = false;
        let mut note = |may: May,
                        rest: &mut FxHashSet<ProductState>,
                        open: &mut Vec<ProductState>,
                        answering: &mut FxHashSet<May>| {
            if !may.owed.is_empty() {
                answering.insert(may);
            } else if rest.len() >= MOST {
                // Not known to be new, but where so many are it does not matter.
                more = true;
            } else if rest.insert(may.state.clone()) {
                open.push(may.state);
            }
        };
        for may in std::mem::take(&mut self.may) {
            note(may, &mut rest, &mut open, &mut answering);
        }
        while let Some(state) = open.pop() {
            let mut nexts = self.product.goes_on(&state);
            if state.in_transit.is_empty() && state.inbox.is_empty() && state.telling.is_empty() {
                self.product.notices(&state, &mut nexts);
            }
            for next in nexts.all {
                if matches!(next.by, Move::Answer | Move::Taken(..) | Move::Confirmed(_)) {
                    let may = May { state: next.state, owed: next.answers };
                    note(may, &mut rest, &mut open, &mut answering);
                }
            }
        }
        self.product.overflow |= more;
        (rest, answering.into_iter().collect())
    }

    fn fits(&self, state: &ProductState, shown: &Shown) -> bool {
        self.leaves(state) == shown.leaves
            && open(state) == sorted(&shown.open)
            && self.product.worlds.get(state.world).is_none_or(|world| {
                let frames = self.frames(state);
                let busy = self.busy(state);
                let system = world.system.snapshot();
                frames == shown.frames
                    && busy.is_none_or(|busy| without(&system, &busy) == without(&shown.system, &busy))
            })
    }

    fn leaves(&self, state: &ProductState) -> Vec<String> {
        let leaf = |(member, leaf): (&super::members::Member<'_>, &crate::statechart::NodeId)| {
            member.chart.fqn(*leaf).to_string()
        };
        self.product.members.iter().zip(&state.leaves).map(leaf).collect()
    }

    fn frames(&self, state: &ProductState) -> Vec<(String, String, usize)> {
        let frames = self.product.worlds.get(state.world).map(|world| world.stack.frames()).unwrap_or_default();
        frames.iter().map(|f| (f.configuration.to_string(), f.requester.to_string(), f.parts.len().max(1))).collect()
    }

    /// The components that what is under way may be changing just now; none: any.
    fn busy(&self, state: &ProductState) -> Option<BTreeSet<ComponentName>> {
        // What is taken along its text does not name.
        if state.desk.under_way().iter().any(|turn| turn.along.is_some()) {
            return None;
        }
        let under_way = state.desk.under_way().iter().flat_map(|turn| &turn.batch.requests).chain(&state.safe);
        let mut busy = BTreeSet::new();
        for request in under_way {
            let (Ask::Apply(id) | Ask::UndoOf(id)) = request.ask else { return None };
            let configurations = &self.product.deployment.configurations;
            let group = self.product.worlds.configuration(id).and_then(|c| c.group);
            for one in configurations.iter().filter(|c| c.id == id || group.is_some() && c.group == group) {
                if one.pre.iter().chain(one.post.iter()).any(|entry| entry.target == Target::Default) {
                    return None;
                }
                busy.extend(claims::components(one));
            }
        }
        Some(busy)
    }

    fn told<'s>(&self, states: impl Iterator<Item = &'s ProductState>) -> String {
        let one = |state: &ProductState| {
            let world = match self.product.worlds.get(state.world) {
                Some(world) => format!("{:?}", world.system.snapshot()),
                None => "not known".to_owned(),
            };
            let (desk, due) = (open(state), &state.due);
            let batch = |batch: &Batch| batch.requests.iter().map(|r| r.ask.to_string()).collect::<Vec<_>>();
            let in_transit: Vec<_> = state.in_transit.iter().map(batch).collect();
            let stopped = state.interrupted.len() + state.undos().count();
            let under_way: Vec<_> = state.desk.under_way().iter().map(|turn| batch(&turn.batch)).collect();
            format!(
                "- {:?} frames {:?} open {desk:?} of them under way {under_way:?} due {} inbox {} in transit {in_transit:?} stopped {} unconfirmed {} system {world}",
                self.leaves(state),
                self.frames(state),
                due.len(),
                state.inbox.len(),
                stopped,
                state.unconfirmed.len(),
            )
        };
        states.take(8).map(one).collect::<Vec<_>>().join("\n")
    }
}

/// Whether nothing is on its way: what is there stays until something comes from outside, or something under way ends.
fn is_quiet(state: &ProductState) -> bool {
    state.inbox.is_empty() && state.in_transit.is_empty() && state.due.is_empty() && state.telling.is_empty()
}

fn sorted(list: &[String]) -> Vec<String> {
    let mut list = list.to_vec();
    list.sort_unstable();
    list
}

/// What is not answered in a state.
fn open(state: &ProductState) -> Vec<String> {
    let under_way = state.desk.under_way().iter().flat_map(|turn| &turn.batch.requests);
    let waiting = state.desk.waiting().flat_map(|batch| &batch.requests);
    let all = under_way.chain(waiting).chain(&state.safe).chain(state.undos());
    let told = all.filter(|request| request.why == Why::Asked).map(|r| format!("{} by {}", r.ask, r.requester));
    sorted(&told.collect::<Vec<_>>())
}

/// A picture without these components.
fn without(system: &Snapshot, busy: &BTreeSet<ComponentName>) -> Snapshot {
    let mut system = system.clone();
    system.components.retain(|component, _| !busy.contains(component));
    let busy_end = |member: &MemberRef| busy.contains(&member.component);
    system.connections.retain(|(from, to), _| !busy_end(from) && !busy_end(to));
    system.ports.retain(|port, _| !busy_end(port));
    system
}
