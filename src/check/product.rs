//! The product: coordinators, system and stack, what waits and what is under way. Its states, and what leads from one to
//! the next.
//!
//! Who waits for whom is kept by a [`Desk`], what a batch comes to is asked of the stack; both are what a running
//! configurator uses. A state has the batches that have begun and those that wait; how each of those under way may end are
//! moves. A batch begins as soon as it can. Where it makes a difference that it may not have begun yet, or be over already,
//! when something comes that interrupts it or gives it up, these are moves of their own.
//!
//! An event from outside goes to all that wait for it somewhere, and each takes it when it comes to it: until then it lies
//! in that one's inbox, and so does what another one emits ([`inbox`](super::inbox)). Answers go first. The next event from outside comes when all
//! inboxes are empty.

use super::aside::Aside;
use super::behind::Behind;
use super::children::{Child, WatchedSubsystem};
use super::coordinator::outside_events;
use super::coupling;
use super::desks::{Desks, PlainBatch};
use super::effort::{Effort, Left};
use super::from_outside::FromOutside;
use super::members::{Member, hears_loss, members};
use super::neighbours::ParentInterface;
use super::offers::AllOffers;
use super::outcome::{Comes, ConcurrentWork, EMPTY, Held, Went, WorldId};
use super::seldom::{SharedSeldom, Unconfirmed};
use super::shared_list::SharedList;
use super::state::{Failed, Move, Next, Nexts, ProductState, Reacts, bit, index, one};
use super::world::Worlds;
use crate::limits;
use crate::model::{Catalogue, ConfigId, Deployment, EventName, Precedence, Verdict};
use crate::stack::{ActiveBatch, Desk, FrameId, Request, Requester, Why};
use crate::statechart::{Chart, EventId, NodeId};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::rc::Rc;
use std::time::Duration;

/// The moves of the product.
pub struct Product<'a> {
    /// The deployment.
    pub deployment: &'a Deployment,
    /// The coordinators.
    pub members: Vec<Member<'a>>,
    /// What the configurator does.
    pub worlds: Worlds<'a>,
    /// What waits and what is under way in its states.
    pub desks: Desks,
    /// Events that come from outside.
    pub outside: Vec<EventName>,
    /// What is known of each of them.
    pub(super) from_outside: Vec<FromOutside>,
    /// Of each the first that no coordinator tells from it.
    pub(super) alike: Vec<usize>,
    /// What an operator may apply at any time.
    pub operator: Vec<ConfigId>,
    /// There are coordinators that have nothing to do with these, and are not followed with them.
    pub others: bool,
    /// A safe configuration that has nothing to do with these: of what it does they know only that it interrupts them.
    pub(super) elsewhere: Option<ConfigId>,
    /// That is followed: not behind something that failed.
    pub(super) minds_elsewhere: bool,
    /// Where others may interrupt these: the event that begins the deployment is followed also while others are led down. It is heard
    /// then where nobody has asked for the end by more than an event. Makes many states: only where these are few.
    pub(super) begins_anew: bool,
    /// More was on its way between coordinators than is followed.
    pub overflow: bool,
    /// One step asks for more than is followed, or may meet in more ways what is under way.
    pub forked: bool,
    /// Whether it is followed what comes where a batch under way may not have begun, or be over already, when it is stopped.
    pub races: bool,
    /// Batches of one coordinator that may be unanswered when the next event comes.
    pub most_waiting: usize,
    /// How much is followed behind an undo that fails.
    pub(super) behind: Behind,
    /// Configurations that may be lost, and whether they stand for something. Those that do not are lost where the platform is
    /// found to differ: followed where somebody listens.
    pub losable: Vec<(ConfigId, bool)>,
    /// Answers that nobody hears are given as well.
    pub tells_all: bool,
    /// It is kept that the deployment is being stopped. Of several coordinators without an operator it is kept for long, until
    /// all are down, and makes many states: only where these are few.
    pub minds_stopping: bool,
    /// What an operator's safe configuration leads to is followed: only where that is easy.
    pub follows_by_hand: bool,
    /// It is said already that the shutdown does not reach *down*.
    pub never_down: bool,
    /// A configuration stands for run states that others may change: whether it becomes true is not judged.
    pub(super) unjudged: bool,
    /// Configurations that have to stand for a time before they are answered, and how long at least.
    pub(super) standing: FxHashMap<ConfigId, Duration>,
    /// There were too many ways up or down to find the one that lasts shortest.
    pub untimed: bool,
    /// So many states are looked at for a way up or down, at least.
    pub(super) most_driven: usize,
    /// Two times were over at the same moment on a way up or down, and led to different ends.
    pub(super) tied: bool,
    /// A way up or down comes elsewhere in another order.
    pub(super) unordered: bool,
    /// Events from outside, and times, come also before all have heard what came before.
    pub crosses: bool,
    /// So many frames of an operator are in force at once.
    pub by_hand: usize,
    /// What is set aside where its undo fails.
    pub(super) aside: Aside,
    /// The subsystems of the deployment, as its coordinators know them.
    pub(super) children: Vec<Child>,
    /// The same where their coordinators are among these.
    pub(super) watched: Vec<WatchedSubsystem>,
    /// What they have to do with the parent of their deployment, if it is looked at.
    pub(super) parent: Option<ParentInterface>,
    /// Its coordinators in groups that have nothing to do with each other, by their places; none where that was not asked.
    pub(super) groups: Vec<Vec<usize>>,
    /// How much more is followed.
    pub(super) effort: Left<'a>,
    /// What is known of reactions to steps.
    pub(super) reacts: FxHashMap<(WorldId, PlainBatch, ConcurrentWork), Reacts>,
    /// What coordinators hear in each leaf.
    pub(super) offers: AllOffers,
    /// Room for what follows, used again and again.
    pub(super) spare: Vec<Next>,
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
            outside.extend(outside_of(deployment, &views[*number], charts[*number]));
        }
        let operator = coupling::operated(deployment, catalogue, charts, numbers);
        let losable = deployment.configurations.iter().map(|c| (c.id, c.holds.is_some()));
        let losable = losable.filter(|(id, holds)| *holds || hears_loss(charts, numbers, *id)).collect();
        let minds_stopping = !operator.is_empty() || members.len() == 1;
        let mut product = Self {
            deployment,
            members,
            worlds: Worlds::new(deployment, catalogue, undone),
            desks: Desks::default(),
            outside: outside.into_iter().collect(),
            from_outside: Vec::new(),
            alike: Vec::new(),
            operator,
            others: numbers.len() < deployment.coordinators.len(),
            elsewhere: coupling::safe_elsewhere(deployment, catalogue, charts, numbers),
            minds_elsewhere: true,
            begins_anew: false,
            overflow: false,
            forked: false,
            races: true,
            most_waiting: limits::CHECK_WAITING,
            behind: Behind::default(),
            losable,
            tells_all: false,
            minds_stopping,
            follows_by_hand: false,
            never_down: false,
            standing: super::stands::standing(deployment),
            untimed: false,
            most_driven: limits::CHECK_TRANSITIONS,
            tied: false,
            unordered: false,
            unjudged: false,
            crosses: false,
            by_hand: 1,
            aside: Aside::default(),
            children: if deployment.own.is_none() { Child::all(deployment) } else { Vec::new() },
            watched: Vec::new(),
            parent: None,
            groups: Vec::new(),
            effort: Effort::default().into(),
            reacts: FxHashMap::default(),
            offers: AllOffers::default(),
            spare: Vec::new(),
        };
        (product.worlds.judged, product.unjudged) = super::stands::judged(deployment, catalogue, charts);
        product.aside = Aside::of(deployment, &product.members, &product.losable);
        let names: Vec<_> = product.members.iter().map(|member| (member.name, member.of)).collect();
        product.watched = WatchedSubsystem::all(deployment, &names);
        product.alike = product.alike_events();
        product.from_outside = product.known_outside();
        for (place, number) in numbers.iter().enumerate() {
            let own = outside_of(deployment, &views[*number], charts[*number]);
            product.members[place].listen(deployment, &own);
        }
        product
    }

    /// The product of all coordinators of a deployment, those of its subsystems too.
    pub fn of_all(deployment: &'a Deployment, charts: &[&'a Chart], catalogue: &Catalogue) -> Self {
        let numbers: Vec<usize> = (0..charts.len()).collect();
        let views: Vec<Deployment> =
            numbers.iter().filter_map(|number| coupling::view(deployment, charts, *number)).collect();
        let groups = coupling::groups(deployment, catalogue, charts);
        Self { groups, ..Self::new(deployment, &views, charts, &numbers, catalogue) }
    }

    /// So much of it is followed.
    pub fn follow_with(&mut self, effort: Effort<'a>) {
        self.effort = effort.into();
        if self.aside.len() < effort.aside_from {
            self.aside = Aside::default();
        }
    }

    /// Nothing was followed in it yet; what was planned in its worlds stays known.
    pub fn follow_anew(&mut self) {
        (self.overflow, self.forked) = (false, false);
    }

    /// The state after the first entries; none when one of them cannot be entered.
    pub fn start(&mut self) -> Option<ProductState> {
        let entered: Option<Vec<_>> = self.members.iter_mut().map(Member::enter).collect();
        let entered = entered?;
        let state = ProductState {
            leaves: entered.iter().map(|reaction| reaction.leaf).collect(),
            world: EMPTY,
            desk: self.desks.empty(),
            inbox: SharedList::new(),
            stands: SharedList::new(),
            seldom: SharedSeldom::default(),
            stayed: false,
            aside: false,
            stopping: false,
            leaving: false,
            elsewhere: false,
            beliefs: SharedList::new(),
            told: SharedList::new(),
            across: false,
            down: 0,
            children: 0,
        };
        let mut states = one(state);
        for (by, reaction) in entered.iter().enumerate() {
            states = states.into_iter().flat_map(|state| self.follow(state, by, reaction)).collect();
        }
        // What several may come to is what one of them comes to a moment later; what is told at the start is told before anybody listens.
        states.into_iter().next().map(|state| ProductState { told: SharedList::new(), ..state })
    }

    /// All that follows from a state.
    pub fn nexts(&mut self, state: &ProductState) -> Nexts {
        let mut nexts = self.goes_on(state);
        if state.in_transit.is_empty() && state.inbox.is_empty() {
            self.comes_from_outside(state, &mut nexts);
        } else if state.in_transit.is_empty() && self.crosses {
            self.comes_across(state, &mut nexts);
        }
        nexts
    }

    /// What follows from a state without anything coming from outside.
    pub(super) fn goes_on(&mut self, state: &ProductState) -> Nexts {
        let mut nexts = Nexts { all: std::mem::take(&mut self.spare), ..Nexts::default() };
        // A batch in transit comes when one of those that it would stop is over.
        self.answers_come(state, &mut nexts);
        self.behind_given_up(state, &mut nexts);
        // What was interrupted goes back when the safe configuration is there, and what came later ends later.
        let still = |active: &&ActiveBatch| !state.safe.is_empty() && state.interrupted(active.number).is_some();
        let going = state.desk.under_way().iter().filter(|active| !still(active));
        let going =
            going.filter(|active| active.batch.requests.first().is_none_or(|first| !state.is_owed(first.requester)));
        let numbers: SmallVec<[u32; 4]> = going.map(|active| active.number).collect();
        for number in numbers {
            match state.is_stopped(number) {
                true => self.stopped_ends(state, number, &mut nexts),
                false => self.ends(state, number, &mut nexts),
            }
        }
        if state.telling.is_empty() && state.inbox.is_empty() {
            return nexts;
        }
        for number in 0..self.members.len() {
            let own = index(number);
            // Answers go first, but for what is urgent.
            let mine = |(request, _): &(Request, Verdict)| self.member(request.requester) == Some(number);
            if let Some(at) = state.telling.iter().position(mine) {
                let mut next = state.clone();
                let (request, verdict) = next.change(|seldom| seldom.telling.remove(at));
                let event = self.members[number].answer(request.ask, verdict);
                self.hear(next, number, event, Move::Taken(own, event), &mut nexts);
                let urgent = self.takes_next(state, number).into_iter().filter(|takes| takes.urgent);
                self.take(state, number, urgent, &mut nexts);
                continue;
            }
            let takes = self.takes_next(state, number);
            self.take(state, number, takes, &mut nexts);
        }
        nexts
    }

    /// Answers that come whatever else does: those on their way, and of safe configurations.
    fn answers_come(&mut self, state: &ProductState, nexts: &mut Nexts) {
        if let Some((request, verdict)) = state.due.first().copied() {
            let mut next = state.clone();
            next.change(|seldom| seldom.due.remove(0));
            let answers = SharedList::from_iter([(request, verdict)]);
            for next in self.lands(next) {
                self.tell(next, &answers, Failed::Nothing, nexts);
            }
        }
        // Those that have nothing to do with each other end in any order.
        for (at, request) in state.safe.iter().enumerate() {
            let claim = |request: &Request| self.worlds.claims.of([request]);
            let first = state.safe[..at].iter().all(|before| !claim(before).meets(&claim(request)));
            if first && !state.is_owed(request.requester) {
                self.safe_ends(state, at, nexts);
            }
        }
    }

    /// Whether what is down is taken to begin again only when the others are down, too.
    pub(super) fn waits_for_others(&self) -> bool {
        self.elsewhere.is_some() && !self.begins_anew
    }

    /// A coordinator hears an event.
    pub(super) fn hear(&mut self, state: ProductState, number: usize, event: EventId, by: Move, nexts: &mut Nexts) {
        let mut state = state;
        if !self.children.is_empty()
            && let Some(name) = self.members[number].name_of(event)
        {
            self.hears_of_child(&mut state, number, name);
        }
        self.begins_subsystem(&mut state, number, event);
        for state in self.react(state, number, event) {
            let next = Next::plain(by, self.settle(state), Failed::Nothing);
            nexts.all.push(next);
        }
    }

    /// Whether the event that starts or the one that ends the deployment comes.
    pub(super) fn is_first_or_last(&self, by: Move) -> bool {
        matches!(by, Move::Event(at) if self.deployment.precedence(self.outside[usize::from(at)]) == Precedence::UrgentAsLast)
    }

    /// What batches and safe configurations that stopped at last come to is decided in `ends`; this settles what needs no
    /// decision: who comes to *down*, and when the deployment is down.
    pub(super) fn settle(&mut self, mut state: ProductState) -> ProductState {
        self.tell_standings(&mut state);
        // Where others are still to come down, the deployment is being stopped until they have.
        state.stopping &= self.waits_for_others() || !self.is_down(&state);
        state.elsewhere &= state.stopping;
        if state.inbox.is_empty() {
            state.across = false;
            if state.moved != 0 {
                state.change(|seldom| seldom.moved = 0);
            }
        }
        state
    }

    /// Takes over a world.
    pub(super) fn go(&self, state: &mut ProductState, went: &Went) {
        let from = std::mem::replace(&mut state.world, went.world);
        if let Some(places) = &went.places
            && state.desk.requests().any(|request| matches!(request.why, Why::Unconfirmed(_)))
        {
            // Frames have the numbers of their world.
            self.desks.change(&mut state.desk, |desk| {
                for request in desk.requests_mut() {
                    if let Why::Unconfirmed(frame) = request.why {
                        let place = self.worlds.place(from, frame).and_then(|at| places.of.get(at).copied().flatten());
                        let frame = place.and_then(|place| self.worlds.frame(went.world, place));
                        request.why = Why::Unconfirmed(frame.unwrap_or(FrameId(0)));
                    }
                }
            });
        }
        if let Some(places) = went.places.as_ref().filter(|_| !state.unconfirmed.is_empty()) {
            let place = |waits: &Unconfirmed| places.of.get(usize::from(waits.place)).copied().flatten();
            let there =
                state.unconfirmed.iter().filter_map(|waits| Some(Unconfirmed { place: place(waits)?, ..*waits }));
            let there = there.collect();
            state.change(|seldom| seldom.unconfirmed = there);
        }
        self.review_standings(state);
    }

    /// What a batch under way comes to in the state's world.
    pub fn comes(&mut self, state: &ProductState, number: u32) -> Rc<Comes> {
        let concurrent = self.concurrent_work(state, Some(number));
        self.worlds.comes(state.world, &self.desks.asks_of(&state.desk, number), &concurrent)
    }

    /// What stands beside a batch under way (none: beside what does not wait) in the state's world.
    pub(super) fn concurrent_work(&mut self, state: &ProductState, number: Option<u32>) -> ConcurrentWork {
        let mut held = Held::new();
        for active in state.desk.under_way().iter().filter(|active| Some(active.number) != number) {
            let planned = state.planned(active.number);
            let asks = self.desks.asks_of(&state.desk, active.number);
            let own = self.worlds.held_by(planned, &asks, &as_begun(&state.desk, state, active.number));
            held.extend(own.into_iter().filter_map(|frame| self.worlds.below(planned, state.world, frame)));
        }
        held.extend(state.unconfirmed.iter().filter_map(|waits| self.worlds.frame(state.world, waits.place)));
        held.sort_unstable();
        held.dedup();
        let placed = number.is_some_and(|number| state.placed.contains(&number));
        let begun = number.map(|number| as_begun(&state.desk, state, number)).unwrap_or_default();
        ConcurrentWork { held, placed, ..begun }
    }

    /// Frames that undos under way are about, also those of which it is known that they stay: no later undo by leaving the
    /// same state is about them.
    pub(super) fn frames_left(&mut self, state: &ProductState) -> Held {
        let mut left = self.concurrent_work(state, None).held;
        for active in state.desk.under_way() {
            let planned = state.planned(active.number);
            let asks = self.desks.asks_of(&state.desk, active.number);
            let stay = self.worlds.staying(planned, &asks, &as_begun(&state.desk, state, active.number));
            left.extend(stay.into_iter().filter_map(|frame| self.worlds.below(planned, state.world, frame)));
        }
        left
    }

    /// Whether all of them are down, with nothing left to be answered or heard.
    pub fn is_down(&self, state: &ProductState) -> bool {
        state.is_at_rest() && self.all_are_down(state)
    }

    /// Whether all of them are in *down*, and their subsystems are known to be down.
    pub(super) fn all_are_down(&self, state: &ProductState) -> bool {
        self.all_in(state, |member| member.down) && self.children_down(state)
    }

    /// Whether all of them have come to *down* and asked for nothing since.
    pub(super) fn all_down(&self, state: &ProductState) -> bool {
        (0..self.members.len()).all(|number| state.down & bit(number) != 0)
    }

    /// Whether all coordinators are down once that one is. Who has asked for something since is down no more once that begins.
    pub(super) fn is_last_down(&self, state: &ProductState, number: usize) -> bool {
        let is_down = |other: usize| {
            other == number || state.down & bit(other) != 0 && state.has_answered(self.members[other].by)
        };
        (0..self.members.len()).all(is_down)
    }

    /// The coordinator that is in a state which means that the bring-up has failed: a running deployment is stopped there.
    pub(super) fn failed_in(&self, state: &ProductState) -> Option<usize> {
        let within = |number: &usize| {
            let (member, leaf) = (&self.members[*number], state.leaves[*number]);
            member.failed.iter().any(|failed| member.chart.is_inside(leaf, *failed))
        };
        (0..self.members.len()).find(within)
    }

    pub(super) fn all_in(&self, state: &ProductState, goal: impl Fn(&Member<'_>) -> Option<NodeId>) -> bool {
        let inside = |(member, leaf): (&Member<'_>, &NodeId)| {
            goal(member).is_some_and(|goal| member.chart.is_inside(*leaf, goal))
        };
        self.members.iter().zip(&state.leaves).all(inside)
    }

    /// The number of the coordinator that asks under that name.
    pub fn member(&self, by: Requester) -> Option<usize> {
        self.members.iter().position(|member| member.by == by)
    }
}

/// How a batch under way has begun; `desk`: as it stood at the state's desk.
pub(super) fn as_begun(desk: &Desk, state: &ProductState, number: u32) -> ConcurrentWork {
    let led = desk.active(number).and_then(ActiveBatch::led);
    ConcurrentWork { joined: state.joined.contains(&number), led, ..ConcurrentWork::default() }
}

/// Events that come to a coordinator from outside; what others alone raise comes from them, and only then.
fn outside_of(deployment: &Deployment, view: &Deployment, chart: &Chart) -> Vec<EventName> {
    let comes = |event: &EventName| deployment.never_from_outside(event.as_str()).is_none();
    outside_events(view, chart).into_iter().filter(comes).collect()
}
