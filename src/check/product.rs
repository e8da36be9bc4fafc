//! The product: coordinators, system and stack, what waits and what is under way. Its states, and what leads from one to
//! the next.
//!
//! Who waits for whom is kept by a [`Desk`], what a batch comes to is asked of the stack; both are what a running
//! configurator uses. A state has the batches that have begun and those that wait; how each of those under way may end are
//! moves. A batch begins as soon as it can. Where it makes a difference that it may not have begun yet, or be over already,
//! when something comes that interrupts it or gives it up, these are moves of their own.
//!
//! An event from outside goes to all that wait for it somewhere, and each takes it when it comes to it: until then it lies
//! in that one's inbox, and so does what another one emits. Answers go first. The next event from outside comes when all
//! inboxes are empty.

use super::arrive::Given;
use super::coordinator::outside_events;
use super::members::{Member, members};
use super::world::{Comes, EMPTY, Went, WorldId, Worlds};
use crate::limits;
use crate::model::{Ask, Catalogue, ConfigId, Deployment, EventName, Findings, OperatorMay, RequestId, Verdict};
use crate::stack::{Batch, Desk, Request, Requester, Why};
use crate::statechart::{Chart, EventId, NodeId};
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::rc::Rc;

/// The worst that failed on a way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Failed {
    /// Nothing did.
    Nothing,
    /// A configuration was not applied, or did not stay: to be expected, and the coordinator's to deal with.
    Apply,
    /// Something could not be undone: it stays in force, and not every coordinator can go on from there. A shutdown that
    /// gets stuck on it is forced.
    Undo,
    /// Something is left in between, and nothing is known any more.
    Broken,
}

/// What stops a batch under way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stop {
    /// This undo of one of its requests.
    GivenUp(Request),
    /// A safe configuration.
    Interrupted,
}

/// A frame that waits for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Unconfirmed {
    /// Its place among the frames that count.
    pub place: u8,
    /// The request that pushed it.
    pub request: Request,
}

/// A state of the product.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct State {
    /// Where each coordinator is.
    pub leaves: SmallVec<[NodeId; 2]>,
    /// System and stack.
    pub world: WorldId,
    /// What waits and what is under way.
    pub desk: Desk,
    /// Batches under way that are stopped, by their numbers.
    pub stopped: SmallVec<[(u32, Stop); 1]>,
    /// Safe configurations that are being applied, in their order.
    pub safe: SmallVec<[Request; 1]>,
    /// Answers on their way.
    pub due: SmallVec<[(Request, Verdict); 1]>,
    /// Answers that are being given; none in a state between moves.
    pub telling: SmallVec<[(Request, Verdict); 2]>,
    /// An undo that waited was cancelled by a safe configuration, and its frame stays; false in a state between moves.
    pub stayed: bool,
    /// Events on their way to a coordinator, those of one in order.
    pub inbox: SmallVec<[(u8, EventId); 2]>,
    /// Frames that wait for their confirmation.
    pub unconfirmed: SmallVec<[Unconfirmed; 1]>,
    /// Configurations that were lost, and are not applied anew.
    pub lost: SmallVec<[ConfigId; 1]>,
    /// Coordinators that have come to *down* and asked for nothing since, by their bits.
    pub down: u64,
    /// The event that ends the deployment has come, and it is not down yet. Kept only where it makes a difference.
    pub stopping: bool,
    /// Batches on their way, the first of which would stop what is under way: what it would stop ends before.
    pub flight: Vec<Batch>,
}

impl State {
    /// Batches of a requester that are not answered. That it has come to *down* once counts for nothing.
    pub fn outstanding(&self, by: Requester) -> usize {
        let first = |batch: &&Batch| batch.requests.first().is_some_and(|request| request.requester == by);
        let under_way = self.desk.under_way().iter().map(|turn| &turn.batch);
        let (downs, batches): (Vec<&Batch>, Vec<&Batch>) =
            under_way.chain(self.desk.waiting()).filter(first).partition(|batch| batch.requests[0].why == Why::Down);
        let due = usize::from(self.due.iter().any(|(request, _)| request.requester == by));
        let safe = self.safe.iter().filter(|request| request.requester == by).count();
        let given_up = self.undos().filter(|undo| undo.requester == by).count();
        batches.len() + downs.len().saturating_sub(1) + due + safe + given_up
    }

    /// Undos that give something up.
    fn undos(&self) -> impl Iterator<Item = &Request> {
        self.stopped.iter().filter_map(|(_, stop)| match stop {
            Stop::GivenUp(undo) => Some(undo),
            Stop::Interrupted => None,
        })
    }

    /// How many requests are not answered.
    pub fn waiting(&self) -> usize {
        let under_way: usize = self.desk.under_way().iter().map(|turn| turn.batch.requests.len()).sum();
        self.desk.len() + under_way + self.safe.len() + self.due.len() + self.undos().count()
    }

    /// Whether nothing waits to be answered or heard.
    pub fn is_at_rest(&self) -> bool {
        self.desk.is_empty()
            && self.safe.is_empty()
            && self.due.is_empty()
            && self.inbox.is_empty()
            && self.flight.is_empty()
    }
}

/// What leads from one state to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Move {
    /// An event comes from outside, by its place among them.
    Event(u16),
    /// Time passes for a coordinator.
    Time(u8, EventId),
    /// A coordinator takes what lies in its inbox.
    Taken(u8, EventId),
    /// Requests are answered.
    Answer,
    /// A confirmation comes.
    Confirmed(ConfigId),
    /// What a configuration stands for is no longer so.
    Lost(ConfigId),
    /// An operator asks for something.
    Operator(Ask),
    /// Coordinators that have nothing to do with these are down as well.
    OthersDown,
}

/// The answers that a move gives.
pub type Answers = SmallVec<[(Request, Verdict); 2]>;

/// A state that follows.
#[derive(Debug, Clone)]
pub struct Next {
    /// What leads there.
    pub by: Move,
    /// The answers given.
    pub answers: Answers,
    /// The state.
    pub state: State,
    /// What failed.
    pub failed: Failed,
    /// A configuration of which there are more frames than are followed, and more than are followed behind undoings that
    /// failed.
    pub deep: (Option<ConfigId>, Option<ConfigId>),
    /// An operator asks for a safe configuration.
    pub by_hand: bool,
}

/// What is wrong with a move.
#[derive(Debug, Clone)]
pub enum Trouble {
    /// The request is refused.
    Refused(Request, Rc<Findings>),
    /// Nobody hears that this is lost.
    Unheard(ConfigId),
}

/// All that follows from a state.
#[derive(Debug, Default)]
pub struct Nexts {
    /// The states.
    pub all: Vec<Next>,
    /// What is wrong.
    pub troubles: Vec<Trouble>,
    /// Events were heard here and not followed, since too many requests wait.
    pub cut: bool,
}

/// The moves of the product.
pub struct Product<'a> {
    /// The deployment.
    pub deployment: &'a Deployment,
    /// The coordinators.
    pub members: Vec<Member<'a>>,
    /// What the configurator does.
    pub worlds: Worlds<'a>,
    /// Events that come from outside.
    pub outside: Vec<EventName>,
    /// What an operator may apply at any time.
    pub operator: Vec<ConfigId>,
    /// There are coordinators that have nothing to do with these, and are not followed with them.
    pub others: bool,
    /// More was on its way between coordinators than is followed.
    pub overflow: bool,
    /// Whether it is followed what comes where a batch under way may not have begun, or be over already, when it is stopped.
    pub races: bool,
    /// Batches of one coordinator that may be unanswered when the next event comes.
    pub most_waiting: usize,
    /// Configurations that stand for something.
    holds: Vec<ConfigId>,
}

impl<'a> Product<'a> {
    /// The product of these charts (numbers of the deployment's coordinators, compiled). `views` are the deployment as each
    /// of its coordinators sees it.
    pub fn new(
        deployment: &'a Deployment,
        views: &[Deployment],
        charts: &[&'a Chart],
        numbers: &[usize],
        catalogue: &Catalogue,
    ) -> Self {
        let (members, undone) = members(deployment, charts, numbers);
        let mut outside = BTreeSet::new();
        for number in numbers {
            outside.extend(outside_of(&views[*number], charts, *number));
        }
        let mut operator: Vec<ConfigId> = Vec::new();
        operator.extend(deployment.configurations.iter().filter(|c| c.safe).map(|c| c.id));
        operator.extend(deployment.operator.iter().filter_map(|(may, _)| match may {
            OperatorMay::Apply(id) if deployment.configuration(*id).is_some() => Some(*id),
            _ => None,
        }));
        operator.sort_unstable();
        operator.dedup();
        let holds = deployment.configurations.iter().filter(|c| c.holds.is_some()).map(|c| c.id).collect();
        let mut product = Self {
            deployment,
            members,
            worlds: Worlds::new(deployment, catalogue, undone),
            outside: outside.into_iter().collect(),
            operator,
            others: numbers.len() < deployment.coordinators.len(),
            overflow: false,
            races: true,
            most_waiting: limits::CHECK_WAITING,
            holds,
        };
        for (place, number) in numbers.iter().enumerate() {
            let own = outside_of(&views[*number], charts, *number);
            product.members[place].listen(deployment, &own);
        }
        product
    }

    /// The state after the first entries; none when one of them cannot be entered.
    pub fn start(&mut self) -> Option<State> {
        let entered: Option<Vec<_>> = self.members.iter_mut().map(Member::enter).collect();
        let entered = entered?;
        let state = State {
            leaves: entered.iter().map(|reaction| reaction.leaf).collect(),
            world: EMPTY,
            desk: Desk::default(),
            stopped: SmallVec::new(),
            safe: SmallVec::new(),
            due: SmallVec::new(),
            telling: SmallVec::new(),
            stayed: false,
            inbox: SmallVec::new(),
            unconfirmed: SmallVec::new(),
            lost: SmallVec::new(),
            down: 0,
            stopping: false,
            flight: Vec::new(),
        };
        let mut states = vec![state];
        for (by, reaction) in entered.iter().enumerate() {
            states = states.into_iter().flat_map(|state| self.follow(state, by, reaction)).collect();
        }
        // What several may come to is what one of them comes to a moment later.
        states.into_iter().next()
    }

    /// All that follows from a state.
    pub fn nexts(&mut self, state: &State) -> Nexts {
        let mut nexts = Nexts::default();
        if let Some(batch) = state.flight.first() {
            // It comes once one of those that it would stop is over.
            for number in self.stopped_by(state, batch) {
                self.ends(state, number, &mut nexts);
            }
            return nexts;
        }
        if let Some((request, verdict)) = state.due.first().copied() {
            let mut next = state.clone();
            next.due.remove(0);
            self.tell(next, SmallVec::from_iter([(request, verdict)]), Failed::Nothing, &mut nexts);
        }
        if let Some(request) = state.safe.first().copied() {
            self.safe_ends(state, &request, &mut nexts);
        }
        // What was interrupted goes back when the safe configuration is there, and what came later ends later.
        let going = state.desk.under_way().iter().filter(|_| state.safe.is_empty());
        let numbers: SmallVec<[u32; 4]> = going.map(|turn| turn.number).collect();
        for number in numbers {
            match state.stopped.iter().any(|(of, _)| *of == number) {
                true => self.stopped_ends(state, number, &mut nexts),
                false => self.ends(state, number, &mut nexts),
            }
        }
        for number in 0..self.members.len() {
            let own = index(number);
            let Some(at) = state.inbox.iter().position(|(to, _)| *to == own) else { continue };
            let mut next = state.clone();
            let (_, event) = next.inbox.remove(at);
            self.hear(next, number, event, Move::Taken(own, event), &mut nexts);
        }
        if state.inbox.is_empty() {
            self.from_outside(state, &mut nexts);
        }
        nexts
    }

    /// A coordinator hears an event.
    fn hear(&mut self, state: State, number: usize, event: EventId, by: Move, nexts: &mut Nexts) {
        for state in self.react(state, number, event) {
            let next = Next::plain(by, self.settle(state), Failed::Nothing);
            nexts.all.push(next);
        }
    }

    /// What comes when nothing lies in the inboxes.
    fn from_outside(&mut self, state: &State, nexts: &mut Nexts) {
        let mut heard: BTreeSet<usize> = BTreeSet::new();
        let busy: SmallVec<[bool; 4]> =
            self.members.iter().map(|member| state.outstanding(member.by) >= self.most_waiting).collect();
        for number in 0..self.members.len() {
            for event in self.members[number].offers(state.leaves[number]).iter() {
                let name = self.members[number].name_of(*event);
                match name.and_then(|name| self.outside.iter().position(|outside| *outside == name)) {
                    Some(at) => _ = heard.insert(at),
                    None if busy[number] => nexts.cut = true,
                    None => self.hear(state.clone(), number, *event, Move::Time(index(number), *event), nexts),
                }
            }
        }
        for at in heard {
            let name = self.outside[at];
            let takes =
                |(number, member): (usize, &mut Member<'_>)| busy[number] && member.takes(state.leaves[number], name);
            if self.members.iter_mut().enumerate().any(takes) {
                nexts.cut = true;
                continue;
            }
            let mut next = state.clone();
            next.stopping |= name == self.deployment.shutdown.event && self.minds_stopping();
            self.confirm(&mut next, name);
            self.spread(&mut next, name, None);
            let by = Move::Event(u16::try_from(at).unwrap_or(u16::MAX));
            // If one alone hears it, there is nothing to wait for.
            if let [(only, event)] = next.inbox[..] {
                next.inbox.clear();
                self.hear(next, usize::from(only), event, by, nexts);
            } else {
                nexts.all.push(Next::plain(by, next, Failed::Nothing));
            }
        }
        self.notices(state, nexts);
        self.operators(state, nexts);
        if self.others && state.is_at_rest() && self.all_down(state) {
            let world = self.worlds.settle_down(state.world);
            if world != state.world {
                let mut next = state.clone();
                next.world = world;
                next.unconfirmed.clear();
                nexts.all.push(Next::plain(Move::OthersDown, next, Failed::Nothing));
            }
        }
    }

    /// Confirmations that come or do not, and what is lost.
    fn notices(&mut self, state: &State, nexts: &mut Nexts) {
        for (at, waits) in state.unconfirmed.iter().enumerate() {
            let Ask::Apply(id) = waits.request.ask else { continue };
            let mut next = state.clone();
            next.unconfirmed.remove(at);
            nexts.all.push(Next::plain(Move::Confirmed(id), next, Failed::Nothing));
            self.unconfirmed(state, at, id, nexts);
        }
        for at in 0..self.holds.len() {
            let id = self.holds[at];
            let busy = |request: &Request| matches!(request.ask, Ask::Apply(of) | Ask::UndoOf(of) if of == id);
            let under_way = state.desk.under_way().iter().any(|turn| turn.batch.requests.iter().any(busy));
            if state.lost.contains(&id) || under_way || !self.worlds.is_in_force(state.world, id) {
                continue;
            }
            let event = Verdict::Lost.event(Ask::Apply(id));
            let mut next = state.clone();
            next.lost.push(id);
            next.lost.sort_unstable();
            self.spread(&mut next, event, None);
            let by = Move::Lost(id);
            match next.inbox[..] {
                [] => {
                    nexts.troubles.push(Trouble::Unheard(id));
                    nexts.all.push(Next::plain(by, next, Failed::Apply));
                }
                [(only, event)] => {
                    next.inbox.clear();
                    let from = nexts.all.len();
                    self.hear(next, usize::from(only), event, by, nexts);
                    nexts.all[from..].iter_mut().for_each(|next| next.failed = next.failed.max(Failed::Apply));
                }
                _ => nexts.all.push(Next::plain(by, next, Failed::Apply)),
            }
        }
    }

    /// A frame is taken back, since its confirmation did not come in time.
    fn unconfirmed(&mut self, state: &State, at: usize, id: ConfigId, nexts: &mut Nexts) {
        let waits = state.unconfirmed[at];
        let confirm = self.worlds.configuration(id).and_then(|c| c.confirm);
        let (Some(confirm), Some(frame)) = (confirm, self.worlds.frame(state.world, waits.place)) else { return };
        let why = Why::Unconfirmed(frame, confirm.event, confirm.within);
        let request = Request { ask: Ask::UndoOf(id), scope: None, why, ..waits.request };
        let mut left = state.clone();
        left.unconfirmed.remove(at);
        let comes = self.worlds.comes(state.world, &[request]);
        let stays = Answers::from_iter([(Request { why: Why::Asked, ..request }, Verdict::UndoFailed)]);
        if !comes.refused.is_empty() {
            let told = Request { why: Why::Asked, ..request };
            nexts.troubles.extend(comes.refused.iter().map(|(_, why)| Trouble::Refused(told, why.clone())));
            self.tell(left, stays, Failed::Undo, nexts);
            return;
        }
        if comes.parts.iter().any(|part| part.failed.is_some()) {
            self.tell(left.clone(), stays, Failed::Undo, nexts);
            let mut broken = left.clone();
            broken.unconfirmed.clear();
            broken.world = self.worlds.broken(state.world, std::iter::once(request.ask));
            let answers = Answers::from_iter([(Request { why: Why::Asked, ..request }, Verdict::UndoBroken)]);
            self.tell(broken, answers, Failed::Broken, nexts);
        }
        let mut next = left;
        self.go(&mut next, &comes.done);
        let told = Request { ask: Ask::Apply(id), why: Why::Asked, ..request };
        self.tell(next, Answers::from_iter([(told, Verdict::Reverted)]), Failed::Apply, nexts);
    }

    /// What an operator may ask for.
    fn operators(&mut self, state: &State, nexts: &mut Nexts) {
        if state.stopping || self.worlds.top(state.world).is_some() || state.outstanding(Requester::Operator) > 0 {
            return;
        }
        let asks: Vec<Ask> = match self.worlds.of_operator(state.world) {
            Some(id) => vec![Ask::UndoOf(id)],
            None => self.operator.iter().map(|id| Ask::Apply(*id)).collect(),
        };
        // Nobody has anything to do with what is not there.
        if self.worlds.get(state.world).is_some_and(|world| world.system.is_empty()) && state.desk.is_empty() {
            return;
        }
        for ask in asks {
            let request = Request::new(RequestId(0), ask, Requester::Operator);
            let by_hand = matches!(ask, Ask::Apply(id) if self.is_safe(id));
            for next in self.arrive(state.clone(), Batch::one(request)) {
                let next = Next::plain(Move::Operator(ask), self.settle(next), Failed::Nothing);
                nexts.all.push(Next { by_hand, ..next });
            }
        }
    }

    /// Whether it makes a difference that the deployment is being stopped.
    fn minds_stopping(&self) -> bool {
        !self.operator.is_empty()
    }

    /// What batches and safe configurations that stopped at last come to is decided in `ends`; this settles what needs no
    /// decision: who comes to *down*, and when the deployment is down.
    pub(super) fn settle(&mut self, mut state: State) -> State {
        state.stopping &= !(state.is_at_rest() && self.all_in(&state, |member| member.down));
        state
    }

    /// Takes over a world.
    pub(super) fn go(&self, state: &mut State, went: &Went) {
        state.world = went.world;
        if let Some(places) = &went.places {
            state.unconfirmed.retain(|waits| match places.get(usize::from(waits.place)).copied().flatten() {
                Some(place) => {
                    waits.place = place;
                    true
                }
                None => false,
            });
        }
    }

    /// What `requests` come to in the state's world.
    pub fn comes(&mut self, state: &State, requests: &[Request]) -> Rc<Comes> {
        self.worlds.comes(state.world, requests)
    }

    /// Whether all of them are down, with nothing left to be answered or heard.
    pub fn is_down(&self, state: &State) -> bool {
        state.is_at_rest() && self.all_in(state, |member| member.down)
    }

    /// Whether all of them have come to *down* and asked for nothing since.
    pub(super) fn all_down(&self, state: &State) -> bool {
        (0..self.members.len()).all(|number| state.down & (1 << number.min(63)) != 0)
    }

    pub(super) fn all_in(&self, state: &State, goal: impl Fn(&Member<'_>) -> Option<NodeId>) -> bool {
        let inside = |(member, leaf): (&Member<'_>, &NodeId)| {
            goal(member).is_some_and(|goal| member.chart.is_inside(*leaf, goal))
        };
        self.members.iter().zip(&state.leaves).all(inside)
    }

    /// The number of the coordinator that asks under that name.
    pub fn member(&self, by: Requester) -> Option<usize> {
        self.members.iter().position(|member| member.by == by)
    }

    /// A request as a coordinator makes it.
    pub(super) fn request(by: Requester, given: &Given) -> Request {
        let tag = given.owner.map_or((0, 0), |owner| (owner.index() as u64 + 1, 0));
        Request { scope: given.scope, tag, ..Request::new(RequestId(0), given.ask, by) }
    }
}

impl Next {
    /// A state that comes without an answer.
    pub(super) fn plain(by: Move, state: State, failed: Failed) -> Self {
        Self::answered(by, Answers::new(), state, failed)
    }

    /// A state that comes with answers.
    pub(super) fn answered(by: Move, answers: Answers, mut state: State, failed: Failed) -> Self {
        let failed = if std::mem::take(&mut state.stayed) { failed.max(Failed::Undo) } else { failed };
        Self { by, answers, state, failed, deep: (None, None), by_hand: false }
    }
}

/// A coordinator's number as a state has it.
pub fn index(number: usize) -> u8 {
    u8::try_from(number).unwrap_or(u8::MAX)
}

/// Events that come to a coordinator from outside: what others raise comes from them, and only then.
fn outside_of(view: &Deployment, charts: &[&Chart], number: usize) -> Vec<EventName> {
    let raised = |event: &EventName| {
        let others = charts.iter().enumerate().filter(|(other, _)| *other != number);
        others.into_iter().any(|(_, chart)| chart.raises().iter().any(|site| site.name == *event))
    };
    outside_events(view, charts[number]).into_iter().filter(|event| !raised(event)).collect()
}
