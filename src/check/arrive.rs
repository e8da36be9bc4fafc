//! What coordinators hand on: requests come to the desk, and begin there.

use super::desks::{AnsweredPlaces, Coming, is_left};
use super::product::{Product, as_begun};
use super::reactions::Macrostep;
use super::seldom::Interrupted;
use super::state::{ProductState, States, add, bit, one};
use crate::limits;
use crate::model::{Ask, ConfigId, Verdict};
use crate::stack::{ActiveBatch, Arrived, Batch, Desk, Request, Requester, Why, given_up_of};
use crate::statechart::EventId;
use smallvec::SmallVec;
use std::rc::Rc;

impl Product<'_> {
    /// A coordinator hears an event, and comes to rest again.
    pub(super) fn react(&mut self, mut state: ProductState, by: usize, event: EventId) -> States {
        let reaction = self.members[by].react(state.leaves[by], event);
        let (chart, deployment) = (self.members[by].chart, self.deployment);
        state.leaving &= !(reaction.taken && event == chart.event(deployment.deploy.event) && event != EventId::OTHER);
        if self.crosses {
            state.change(|seldom| seldom.moved |= bit(by));
        }
        self.follow(state, by, &reaction)
    }

    /// Brings a reaction of a coordinator into a state. More than one: it makes a difference what is over already.
    pub(super) fn follow(&mut self, mut state: ProductState, by: usize, reaction: &Macrostep) -> States {
        state.leaves[by] = reaction.leaf;
        self.forget(&mut state, by, reaction);
        let mut states = one(state);
        // A coordinator that does not come to rest asks without end, and each time may come before or after what ends.
        self.forked |= reaction.handed.len() > limits::CHECK_HANDED;
        for (before, batch) in reaction.handed.iter().take(limits::CHECK_HANDED).enumerate() {
            self.confirms_early(&mut states, reaction, before);
            states = self.all_arrive(states, batch);
            self.forked |= states.len() > limits::CHECK_FORKS;
            states.truncate(limits::CHECK_FORKS);
        }
        self.confirms_early(&mut states, reaction, reaction.handed.len());
        for emitted in &reaction.emitted {
            let name = emitted.event;
            let late: States = states.iter().filter_map(|state| self.confirmed_too_late(state, name)).collect();
            states.iter_mut().for_each(|state| self.confirm(state, name));
            add(&mut states, late);
            self.forked |= states.len() > limits::CHECK_FORKS;
            states.truncate(limits::CHECK_FORKS);
            for state in &mut states {
                if self.parent.as_ref().is_some_and(|parent| parent.hears.contains(&name)) {
                    state.told.push(name);
                }
                self.tells_child(state, by, *emitted);
                let hearers = self.hearers(state, name, Some(by));
                self.spread_to(state, &hearers);
                self.offers_child(state, by, *emitted, &hearers);
            }
        }
        states
    }

    /// What is told behind so many batches confirms what these, and others before, ask for.
    fn confirms_early(&self, states: &mut States, reaction: &Macrostep, behind: usize) {
        for emitted in reaction.emitted.iter().filter(|emitted| emitted.behind == behind) {
            states.iter_mut().for_each(|state| self.confirm_early(state, emitted.event));
        }
    }

    /// Nobody hears the answers any more whose state has been left.
    fn forget(&self, state: &mut ProductState, by: usize, Macrostep { left, number: macrostep, .. }: &Macrostep) {
        if left.is_empty() {
            return;
        }
        let requester = self.members[by].by;
        let gone = |request: &Request| is_left(request, requester, left);
        if !state.desk.is_empty() {
            self.desks.leave(&mut state.desk, requester, left, macrostep);
        }
        if state.seldom.is_nothing() {
            return;
        }
        self.forgets_offered(state, by, left);
        // Mostly there is nothing to forget, and nothing is copied for that.
        let idle = |request: &Request| gone(request) || !is_for_somebody(request);
        let told = |(request, _): &(Request, Verdict)| idle(request);
        let mut in_transit = state.in_transit.iter().flat_map(|batch| &batch.requests);
        if !state.safe.iter().any(gone) && !state.due.iter().chain(&state.telling).any(told) && !in_transit.any(gone) {
            return;
        }
        state.change(|seldom| {
            seldom.safe.update(gone, |request| request.tag = (0, 0));
            seldom.due.update(|(request, _)| gone(request), |(request, _)| request.tag = (0, 0));
            seldom.due.retain(|(request, _)| self.tells_all || is_for_somebody(request));
            seldom.telling.update(|(request, _)| gone(request), |(request, _)| request.tag = (0, 0));
            if self.tells_all && self.members.len() > 1 {
                seldom.telling.retain(|(request, _)| is_for_somebody(request));
            }
            let requests = seldom.in_transit.iter_mut().flat_map(|batch| &mut batch.requests);
            requests.filter(|request| gone(request)).for_each(|request| request.tag = (0, 0));
        });
    }

    /// What `batch` does where it comes to the desk.
    fn arrival(&self, state: &ProductState, batch: &Batch) -> Rc<Coming> {
        self.desks.coming(&state.desk, batch, |id| self.is_safe(id), &self.worlds.claims)
    }

    /// Whether what comes would stop, overtake or cancel anything: then it makes a difference when it comes.
    fn meddles(state: &ProductState, coming: &Coming) -> bool {
        coming.meddles || coming.stops.iter().any(|number| !state.is_stopped(*number))
    }

    /// What is in transit comes now, or later where that makes a difference.
    pub(super) fn lands(&mut self, mut state: ProductState) -> States {
        if state.in_transit.is_empty() {
            return one(state);
        }
        let mut states = SmallVec::new();
        let mut in_transit = state.change(|seldom| std::mem::take(&mut seldom.in_transit)).into_iter();
        let first = in_transit.next().map_or_else(
            || state.clone(),
            |batch| {
                let coming = self.arrival(&state, &batch);
                if Self::meddles(&state, &coming) {
                    let in_transit = std::iter::once(batch.clone()).chain(in_transit.clone()).collect();
                    let mut later = state.clone();
                    later.change(|seldom| seldom.in_transit = in_transit);
                    states.push(later);
                }
                self.take_in(state.clone(), &batch, &coming)
            },
        );
        // What came with it may find that it has not begun.
        let mut landed = one(first);
        for batch in in_transit {
            landed = self.all_arrive(landed, &batch);
            self.forked |= landed.len() > limits::CHECK_FORKS;
            landed.truncate(limits::CHECK_FORKS);
        }
        add(&mut states, landed);
        states
    }

    fn all_arrive(&mut self, states: States, batch: &Batch) -> States {
        let mut arrived = States::new();
        for state in states {
            add(&mut arrived, self.arrive(state, batch));
        }
        arrived
    }

    /// A batch comes. More than one state: what it would stop may not have begun, or be over already.
    pub(super) fn arrive(&mut self, mut state: ProductState, batch: &Batch) -> States {
        if !state.in_transit.is_empty() {
            state.change(|seldom| seldom.in_transit.push(batch.clone()));
            return one(state);
        }
        let coming = self.arrival(&state, batch);
        let mut states = States::new();
        if self.races && Self::meddles(&state, &coming) {
            let mut later = state.clone();
            later.change(|seldom| seldom.in_transit.push(batch.clone()));
            states.push(later);
            let mut stops = coming.stops.clone();
            stops.retain(|number| !state.is_stopped(*number));
            // What an undo would wait its turn behind, but overtake where it has not begun.
            let behind = coming.about.iter().copied();
            let behind: SmallVec<[u32; 2]> =
                behind.filter(|of| !stops.contains(of) && !state.is_stopped(*of)).collect();
            stops.extend(behind.iter().copied());
            let is_safe = |r: &Request| matches!(r.ask, Ask::Apply(id) if self.is_safe(id));
            // Given up alone and once, it is answered the same way at whatever time.
            let among = |active: &ActiveBatch| {
                let gives_up = |request: &&Request| given_up_of(request, &active.batch.requests).is_some();
                let twice = batch.requests.iter().filter(gives_up).count() > 1;
                let differs =
                    self.tells_all || active.batch.requests.len() > 1 || twice || behind.contains(&active.number);
                stops.contains(&active.number) && differs
            };
            if batch.requests.iter().any(is_safe) || state.desk.under_way().iter().any(among) {
                // Any of them, but no more than a few at once: of more not each was followed.
                self.forked |= stops.len() > 3;
                for some in 1..1u32 << stops.len().min(3) {
                    // Where others wait, it may have come before or after them.
                    for last in [false, true]
                        .into_iter()
                        .take(if self.tells_all && state.desk.waiting().next().is_some() { 2 } else { 1 })
                    {
                        let mut waits = state.clone();
                        let those = stops.iter().enumerate().filter(|(at, _)| some & (1 << at.min(&2)) != 0);
                        for (_, number) in those.rev() {
                            self.desks.put_back(&mut waits.desk, *number, last);
                            if waits.placed.contains(number) {
                                waits.change(|seldom| seldom.placed.retain(|of| of != number));
                            }
                        }
                        let coming = self.arrival(&waits, batch);
                        states.push(self.take_in(waits, batch, &coming));
                    }
                }
            }
        }
        let first = self.take_in(state, batch, &coming);
        if states.is_empty() {
            return one(first);
        }
        states.insert(0, first);
        states
    }

    pub(super) fn is_safe(&self, id: ConfigId) -> bool {
        self.worlds.configuration(id).is_some_and(|c| c.safe)
    }

    /// A batch comes to the desk.
    fn take_in(&mut self, mut state: ProductState, batch: &Batch, coming: &Coming) -> ProductState {
        // Where others are not down nothing comes of it, and it waits for nothing that these have asked for.
        if batch.is_down()
            && let Some(first) = batch.requests.first()
            && let Some(number) = self.member(first.requester)
            && state.has_answered(first.requester)
            && (self.others || !self.is_last_down(&state, number))
        {
            state.down |= bit(number);
            return state;
        }
        self.asks_anew(&mut state, batch);
        // To come to *down* twice with nothing asked for in between, by anybody, is to come once.
        let same =
            |other: &Batch| other.requests.first().map(|r| r.requester) == batch.requests.first().map(|r| r.requester);
        if batch.is_down() && state.desk.waiting().last().is_some_and(|last| last.is_down() && same(last)) {
            return state;
        }
        let before = std::mem::replace(&mut state.desk, coming.desk.clone());
        if batch.requests.iter().any(|request| matches!(request.ask, Ask::Apply(id) if self.is_safe(id))) {
            // What has begun was planned as it was asked for.
            for active in before.under_way() {
                let planned = state.planned(active.number);
                if self.worlds.top(planned).is_none() {
                    let beside = as_begun(&before, &state, active.number);
                    let asks = self.desks.asks_of(&before, active.number);
                    let takes = self.worlds.comes(planned, &asks, &beside).takes();
                    self.desks.begun_as(&mut state.desk, &before, active.number, takes);
                }
            }
        }
        for arrived in &coming.arrived {
            match arrived {
                Arrived::Told(request, verdict, _) => {
                    self.owed(&mut state, request);
                    if *verdict == Verdict::UndoFailed {
                        state.stayed = true;
                        self.lets_go(&mut state, request);
                    }
                    self.due(&mut state, *request, *verdict);
                }
                Arrived::GivesUp(number, undo) => {
                    self.owed(&mut state, undo);
                    self.give_up(&mut state, *number, *undo);
                }
                Arrived::Safe(request) => self.interrupts(&mut state, *request),
            }
        }
        self.begin(&mut state);
        state
    }

    /// An undo that a safe configuration has kept from beginning lets go of what it is about.
    fn lets_go(&mut self, state: &mut ProductState, undo: &Request) {
        let newest = self.worlds.claims.newest_is_meant(undo);
        let coming =
            |state: &mut ProductState| state.change(|seldom| undo.leaves(newest, seldom.safe.iter_mut()).is_some());
        if newest && coming(state) {
            return;
        }
        let left = self.frames_left(state);
        let there = self.worlds.get(state.world).is_some_and(|world| world.left_with(undo, &left).is_some());
        let went = self.worlds.stay(state.world, state.world, std::iter::once(*undo), &left);
        self.go(state, &went);
        if !there {
            coming(state);
        }
    }

    /// A safe configuration interrupts what is under way in its (sub)system.
    fn interrupts(&self, state: &mut ProductState, request: Request) {
        let Ask::Apply(safe) = request.ask else { return };
        let desk = state.desk.clone();
        for active in desk.under_way() {
            let reached = self.worlds.claims.interrupts(safe, &active.batch.requests);
            if reached && state.interrupted.iter().all(|of| of.number != active.number) {
                let (number, given_up) = (active.number, active.given_up.len());
                let interrupted = Interrupted { number, planned: state.world, given_up };
                state.change(|seldom| seldom.interrupted.push(interrupted));
            }
        }
        self.owed(state, &request);
        if let Some(world) = self.worlds.get(state.world).filter(|_| request.scope.is_some() && !state.desk.is_empty())
        {
            let ProductState { desk, seldom, .. } = &mut *state;
            let claims = &self.worlds.claims;
            self.desks.change(desk, |desk| {
                world.note_gone(&request, claims, seldom.get().safe.iter(), desk.requests_mut());
            });
        }
        state.change(|seldom| seldom.safe.push(request));
    }

    /// What is under way is given up by its own undo.
    fn give_up(&mut self, state: &mut ProductState, number: u32, undo: Request) {
        let Some(place) = self.desks.give_up(&mut state.desk, number, undo) else {
            // Another undo of the same step has given it up already.
            return self.due(state, undo, Verdict::Undone);
        };
        // What was interrupted was planned before that.
        let planned = state.planned(number);
        let begun = match self.worlds.top(planned) {
            // Where nothing is known what stands behind may have begun with the first, or not.
            Some(_) => place == 0 || self.tells_all,
            None => {
                let beside = as_begun(&state.desk, state, number);
                let comes = self.worlds.comes(planned, &self.desks.asks_of(&state.desk, number), &beside);
                // What was begun as one stays so, whatever of it is answered now.
                if comes.takes() > 1 && !beside.joined {
                    state.change(|seldom| seldom.joined.push(number));
                }
                comes.group.places().any(|of| of == place)
            }
        };
        if !begun {
            self.cancel_behind(state, number, place);
        }
    }

    /// What stands behind in its batch, has not begun and was given up, is cancelled.
    pub(super) fn cancel_behind(&self, state: &mut ProductState, number: u32, place: usize) {
        let request = state.desk.active(number).and_then(|active| active.batch.requests.get(place)).copied();
        let given = AnsweredPlaces::from_iter([(place, Some(Verdict::Cancelled))]);
        let given = self.desks.given(given);
        let answered = self.desks.all_answered(&mut state.desk, number, &given);
        request.into_iter().for_each(|request| self.due(state, request, Verdict::Cancelled));
        answered.undone.iter().for_each(|(undo, verdict)| self.due(state, *undo, *verdict));
    }

    /// An answer is on its way, if anybody waits for it (or all are to be given).
    fn due(&self, state: &mut ProductState, request: Request, verdict: Verdict) {
        let listens = |number: usize| {
            let event = self.members[number].answer(request.ask, verdict);
            is_for_somebody(&request) && event != EventId::OTHER
        };
        if self.tells_all || self.member(request.requester).is_some_and(listens) {
            state.change(|seldom| seldom.due.push((request, verdict)));
        }
    }

    /// A request is taken up: who asks is not down any more.
    fn owed(&self, state: &mut ProductState, request: &Request) {
        if request.why == Why::Asked
            && let Some(number) = self.member(request.requester)
        {
            state.down &= !bit(number);
        }
    }

    /// The next batch that may begin does: its number.
    fn begin_next(&self, state: &mut ProductState) -> Option<u32> {
        let ProductState { desk, world, leaving, seldom, .. } = state;
        desk.waiting().next()?;
        let asked = seldom.get().safe.iter().map(|request| request.ask);
        let safe: SmallVec<[ConfigId; 1]> =
            asked.filter_map(|ask| if let Ask::Apply(id) = ask { Some(id) } else { None }).collect();
        let along = |batch: &Batch| if *leaving { self.worlds.taken_along(*world, batch) } else { None };
        if desk.waiting().any(|batch| along(batch).is_some()) {
            let begin =
                |desk: &mut Desk| desk.begin_next(&self.worlds.claims, along, &safe).map(|active| active.number);
            return self.desks.change(desk, begin);
        }
        self.desks.begin_next(desk, safe, &self.worlds.claims)
    }

    /// Whatever can begin does; nothing of a (sub)system of which a safe configuration is being applied.
    pub(super) fn begin(&mut self, state: &mut ProductState) {
        while let Some(number) = self.begin_next(state) {
            let begun = state.desk.clone();
            let Some(ActiveBatch { batch, .. }) = begun.active(number) else { continue };
            let first = batch.requests[0];
            if !batch.is_down() {
                for request in &batch.requests {
                    self.owed(state, request);
                }
                self.takes_place(state, number);
                continue;
            }
            self.desks.change(&mut state.desk, |desk| desk.over(number));
            if let Some(number) = self.member(first.requester) {
                state.down |= bit(number);
            }
            state.leaving &= !self.all_down(state) || self.others || state.desk.asks_on();
            if self.all_down(state)
                && !self.others
                && let Some(world) = self.worlds.settle_down(state.world)
            {
                state.world = world;
                state.change(|seldom| {
                    seldom.unconfirmed.clear();
                    seldom.lost.clear();
                });
                self.review_standings(state);
            }
        }
    }

    /// A batch under way begins, or the rest of it: a push takes its place on the stack then, or finds none.
    pub(super) fn takes_place(&mut self, state: &mut ProductState, number: u32) {
        // What is over, however that came, has no place, and its number is another's.
        if !state.placed.is_empty() || !state.joined.is_empty() {
            let ProductState { seldom, desk, .. } = &mut *state;
            seldom.change(|seldom| {
                seldom.placed.retain(|of| *of != number && desk.active(*of).is_some());
                seldom.joined.retain(|of| desk.active(*of).is_some());
            });
        }
        let Some(active) = state.desk.active(number) else { return };
        if self.worlds.is_tight(state.world, &active.batch.requests) && !self.comes(state, number).lacks_room() {
            state.change(|seldom| seldom.placed.push(number));
        }
    }
}

/// Whether an answer is for a coordinator: for the state that asked, while that is not left, or for whatever state there is.
pub(super) fn is_for_somebody(request: &Request) -> bool {
    !request.is_asked() && request.requester != Requester::Operator || request.tag.0 != 0
}
