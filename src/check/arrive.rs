//! What coordinators hand on: requests come to the desk, emitted names to the others' inboxes.

use super::product::Product;
use super::reactions::{Handed, Macrostep};
use super::shared_list::SharedList;
use super::state::{Answers, Failed, Interrupted, Move, Next, Nexts, ProductState, States, bit, index, one};
use crate::limits;
use crate::model::{Ask, ConfigId, EventName, Findings, RequestId, Verdict, codes};
use crate::stack::{ActiveBatch, Arrival, Arrived, Batch, Request, Requester, Why, given_up_of};
use crate::statechart::{EventId, NodeId};
use smallvec::SmallVec;

/// Whether a push is refused because the stack is full.
fn is_for_room(why: &Findings) -> bool {
    why.iter().any(|finding| finding.code == codes::STACK_FULL)
}

impl Product<'_> {
    /// A coordinator hears an event, and comes to rest again.
    pub(super) fn react(&mut self, mut state: ProductState, by: usize, event: EventId) -> States {
        let reaction = self.members[by].react(state.leaves[by], event);
        let (chart, deployment) = (self.members[by].chart, self.deployment);
        state.leaving &= !(reaction.taken && event == chart.event(deployment.deploy.event) && event != EventId::OTHER);
        if self.crosses {
            state.moved |= bit(by);
        }
        self.follow(state, by, &reaction)
    }

    /// Brings a reaction of a coordinator into a state. More than one: it makes a difference what is over already.
    pub(super) fn follow(&mut self, mut state: ProductState, by: usize, reaction: &Macrostep) -> States {
        state.leaves[by] = reaction.leaf;
        self.forget(&mut state, by, &reaction.left);
        let mut states = one(state);
        let requester = self.members[by].by;
        // A coordinator that does not come to rest asks without end, and each time may come before or after what ends.
        self.forked |= reaction.handed.len() > limits::CHECK_HANDED;
        for handed in reaction.handed.iter().take(limits::CHECK_HANDED) {
            let batch = match handed {
                Handed::Batch(asked) => asked.iter().map(|asked| Self::request(requester, asked)).collect(),
                Handed::Down => {
                    Batch::one(Request { why: Why::Down, ..Request::new(RequestId(0), Ask::Undo, requester) })
                }
            };
            states = self.all_arrive(states, &batch);
            self.forked |= states.len() > limits::CHECK_FORKS;
            states.truncate(limits::CHECK_FORKS);
        }
        for name in &reaction.emitted {
            for state in &mut states {
                self.tells_child(state, *name);
                self.confirm(state, *name);
                self.spread(state, *name, Some(by));
            }
        }
        states
    }

    /// Nobody hears the answers any more whose state has been left.
    fn forget(&self, state: &mut ProductState, by: usize, left: &[NodeId]) {
        if left.is_empty() {
            return;
        }
        let requester = self.members[by].by;
        let gone = |request: &mut Request| {
            let owner = request.tag.0.checked_sub(1);
            if request.requester == requester && left.iter().any(|node| Some(node.index() as u64) == owner) {
                request.tag = (0, 0);
            }
        };
        if !state.desk.is_empty() {
            state.desk.requests_mut().for_each(gone);
        }
        state.safe.iter_mut().for_each(gone);
        state.due.iter_mut().for_each(|(request, _)| gone(request));
        state.due.retain(|(request, _)| self.tells_all || is_for_somebody(request));
        state.telling.iter_mut().for_each(|(request, _)| gone(request));
        if self.tells_all && self.members.len() > 1 {
            state.telling.retain(|(request, _)| is_for_somebody(request));
        }
        state.in_transit.iter_mut().flat_map(|batch| &mut batch.requests).for_each(gone);
    }

    /// The batches under way that `batch` would stop.
    pub(super) fn stopped_by(&self, state: &ProductState, batch: &Batch) -> SmallVec<[u32; 2]> {
        if state.desk.is_empty() {
            return SmallVec::new();
        }
        let is_safe = |id: ConfigId| self.worlds.configuration(id).is_some_and(|c| c.safe);
        let mut trial = state.desk.clone();
        let Arrival { safe, given_up, .. } = trial.arrive(batch.clone(), is_safe, &self.worlds.claims);
        let mut stopped: SmallVec<[u32; 2]> = given_up.iter().map(|(number, _)| *number).collect();
        if !safe.is_empty() {
            stopped.extend(state.desk.under_way().iter().map(|active| active.number));
        }
        stopped.retain(|number| !state.is_stopped(*number));
        stopped.sort_unstable();
        stopped.dedup();
        stopped
    }

    /// Whether `batch` would stop, overtake or cancel anything: then it makes a difference when it comes.
    pub(super) fn meddles(&self, state: &ProductState, batch: &Batch) -> bool {
        // What comes alone, and first, finds nothing to stop.
        if state.desk.is_empty() && batch.requests.len() == 1 {
            return false;
        }
        let is_safe = |id: ConfigId| self.is_safe(id);
        let arrival = state.desk.clone().arrive(batch.clone(), is_safe, &self.worlds.claims);
        // Also what waits its turn behind others: by then these may be over.
        let finds = |undo: &Request| {
            let mut active_batches = state.desk.under_way().iter();
            active_batches.any(|active| given_up_of(undo, &active.batch.requests).is_some())
        };
        // Who stands in the queue as down may be taken up before a safe configuration makes everything wait.
        let is_down = |batch: &Batch| batch.requests.first().is_some_and(|request| request.why == Why::Down);
        !arrival.told.is_empty()
            || !self.stopped_by(state, batch).is_empty()
            || batch.requests.iter().any(finds)
            || !arrival.safe.is_empty() && state.desk.waiting().any(is_down)
    }

    /// What is in transit comes now, or later where that makes a difference.
    pub(super) fn lands(&mut self, mut state: ProductState) -> States {
        let mut states = SmallVec::new();
        if state.in_transit.first().is_some_and(|batch| self.meddles(&state, batch)) {
            states.push(state.clone());
        }
        let mut in_transit = std::mem::take(&mut state.in_transit).into_iter();
        let first = in_transit.next().map_or_else(|| state.clone(), |batch| self.take_in(state.clone(), batch));
        // What came with it may find that it has not begun.
        let mut landed = one(first);
        for batch in in_transit {
            landed = self.all_arrive(landed, &batch);
            self.forked |= landed.len() > limits::CHECK_FORKS;
            landed.truncate(limits::CHECK_FORKS);
        }
        states.extend(landed);
        states
    }

    fn all_arrive(&mut self, states: States, batch: &Batch) -> States {
        let mut arrived = States::new();
        for state in states {
            arrived.extend(self.arrive(state, batch.clone()));
        }
        arrived
    }

    /// A batch comes. More than one state: what it would stop may not have begun, or be over already.
    pub(super) fn arrive(&mut self, mut state: ProductState, batch: Batch) -> States {
        if !state.in_transit.is_empty() {
            state.in_transit.push(batch);
            return one(state);
        }
        let mut stops = self.stopped_by(&state, &batch);
        // What an undo would wait its turn behind, but overtake where it has not begun.
        let about = |active: &&ActiveBatch| {
            batch.requests.iter().any(|undo| given_up_of(undo, &active.batch.requests).is_some())
        };
        let behind = state.desk.under_way().iter().filter(about).map(|active| active.number);
        let behind: SmallVec<[u32; 2]> = behind.filter(|of| !stops.contains(of) && !state.is_stopped(*of)).collect();
        stops.extend(behind.iter().copied());
        let mut states = States::new();
        if self.races && self.meddles(&state, &batch) {
            states.push(ProductState { in_transit: SharedList::from_iter([batch.clone()]), ..state.clone() });
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
                // Any of them, but no more than a few at once.
                for some in 1..1u32 << stops.len().min(3) {
                    // Where others wait, it may have come before or after them.
                    for last in [false, true]
                        .into_iter()
                        .take(if self.tells_all && state.desk.waiting().next().is_some() { 2 } else { 1 })
                    {
                        let mut waits = state.clone();
                        let those = stops.iter().enumerate().filter(|(at, _)| some & (1 << at.min(&2)) != 0);
                        for (_, number) in those.rev() {
                            waits.desk.put_back(*number, last);
                            waits.placed.retain(|of| of != number);
                        }
                        states.push(self.take_in(waits, batch.clone()));
                    }
                }
            }
        }
        states.insert(0, self.take_in(state, batch));
        states
    }

    pub(super) fn is_safe(&self, id: ConfigId) -> bool {
        self.worlds.configuration(id).is_some_and(|c| c.safe)
    }

    /// A batch comes to the desk.
    pub(super) fn take_in(&mut self, mut state: ProductState, batch: Batch) -> ProductState {
        // To come to *down* twice with nothing asked for in between is to come once.
        let is_down = |batch: &Batch| batch.requests.first().is_some_and(|request| request.why == Why::Down);
        let same =
            |other: &&Batch| other.requests.first().map(|r| r.requester) == batch.requests.first().map(|r| r.requester);
        if is_down(&batch) && state.desk.waiting().filter(same).last().is_some_and(is_down) {
            return state;
        }
        let is_safe = |id: ConfigId| self.worlds.configuration(id).is_some_and(|c| c.safe);
        let mut begun: SmallVec<[(u32, SmallVec<[Request; 2]>); 2]> = SmallVec::new();
        if batch.requests.iter().any(|request| matches!(request.ask, Ask::Apply(id) if is_safe(id))) {
            let active_batches: SmallVec<[ActiveBatch; 2]> = state.desk.under_way().iter().cloned().collect();
            for ActiveBatch { number, batch, .. } in active_batches {
                let planned = state.planned(number);
                if self.worlds.top(planned).is_none() {
                    let beside = Self::as_begun(&state, number);
                    let takes = self.worlds.comes(planned, &batch.requests, &beside).takes();
                    begun.push((number, batch.requests.into_iter().take(takes).collect()));
                }
            }
        }
        let is_safe = |id: ConfigId| self.worlds.configuration(id).is_some_and(|c| c.safe);
        let arrival = state.desk.arrive(batch, is_safe, &self.worlds.claims);
        // What has begun was planned as it was asked for.
        begun.into_iter().for_each(|(number, requests)| state.desk.begun_as(number, &requests));
        for arrived in arrival.in_order() {
            match arrived {
                Arrived::Told(request, verdict, _) => {
                    self.owed(&mut state, &request);
                    if verdict == Verdict::UndoFailed {
                        state.stayed = true;
                        let left = self.frames_left(&state);
                        let went = self.worlds.stay(state.world, state.world, std::iter::once(request), &left);
                        self.go(&mut state, &went);
                    }
                    self.due(&mut state, request, verdict);
                }
                Arrived::GivesUp(number, undo) => {
                    self.owed(&mut state, &undo);
                    self.give_up(&mut state, number, undo);
                }
                Arrived::Safe(request) => self.interrupts(&mut state, request),
            }
        }
        self.begin(&mut state);
        state
    }

    /// A safe configuration interrupts what is under way.
    fn interrupts(&self, state: &mut ProductState, request: Request) {
        for active in state.desk.under_way() {
            if state.interrupted.iter().all(|of| of.number != active.number) {
                let (number, given_up) = (active.number, active.given_up.len());
                state.interrupted.push(Interrupted { number, planned: state.world, given_up });
            }
        }
        self.owed(state, &request);
        if let Some(world) = self.worlds.get(state.world) {
            world.note_gone(&request, state.safe.iter(), state.desk.requests_mut());
        }
        state.safe.push(request);
    }

    /// What is under way is given up by its own undo.
    fn give_up(&mut self, state: &mut ProductState, number: u32, undo: Request) {
        let Some(place) = state.desk.give_up(number, undo) else {
            // Another undo of the same step has given it up already.
            return self.due(state, undo, Verdict::Undone);
        };
        let requests = state.desk.active(number).map(|active| active.batch.requests.clone()).unwrap_or_default();
        // What was interrupted was planned before that.
        let planned = state.planned(number);
        let begun = match self.worlds.top(planned) {
            // Where nothing is known what stands behind may have begun with the first, or not.
            Some(_) => place == 0 || self.tells_all,
            None => {
                let beside = Self::as_begun(state, number);
                let comes = self.worlds.comes(planned, &requests, &beside);
                // What was begun as one stays so, whatever of it is answered now.
                if comes.takes() > 1 && !beside.joined {
                    state.joined.push(number);
                }
                comes.group.places.contains(&place)
            }
        };
        if !begun {
            self.cancel_behind(state, number, place);
        }
    }

    /// What stands behind in its batch, has not begun and was given up, is cancelled.
    pub(super) fn cancel_behind(&self, state: &mut ProductState, number: u32, place: usize) {
        let request = state.desk.active(number).and_then(|active| active.batch.requests.get(place)).copied();
        let gone = state.desk.answered(number, place, Some(Verdict::Cancelled));
        request.into_iter().for_each(|request| self.due(state, request, Verdict::Cancelled));
        gone.undone.into_iter().for_each(|(undo, verdict)| self.due(state, undo, verdict));
    }

    /// An answer is on its way, if anybody waits for it (or all are to be given).
    fn due(&self, state: &mut ProductState, request: Request, verdict: Verdict) {
        let listens = |number: usize| {
            let event = self.members[number].answer(request.ask, verdict);
            is_for_somebody(&request) && event != EventId::OTHER
        };
        if self.tells_all || self.member(request.requester).is_some_and(listens) {
            state.due.push((request, verdict));
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

    /// The next batch that may begin.
    fn begin_next(&self, state: &mut ProductState) -> Option<ActiveBatch> {
        let ProductState { desk, world, leaving, .. } = state;
        desk.waiting().next()?;
        let alone = |batch: &Batch| *leaving && self.worlds.goes_alone(*world, batch);
        desk.begin_next(&self.worlds.claims, alone).cloned()
    }

    /// Whatever can begin does; nothing while a safe configuration is being applied.
    pub(super) fn begin(&mut self, state: &mut ProductState) {
        if !state.safe.is_empty() {
            return;
        }
        while let Some(active) = self.begin_next(state) {
            let first = active.batch.requests[0];
            if first.why != Why::Down {
                for request in &active.batch.requests {
                    self.owed(state, request);
                }
                self.takes_place(state, active.number);
                continue;
            }
            state.desk.over(active.number);
            if let Some(number) = self.member(first.requester) {
                state.down |= bit(number);
            }
            state.leaving &= !self.all_down(state) || self.others || state.desk.asks_on();
            if self.all_down(state)
                && !self.others
                && let Some(world) = self.worlds.settle_down(state.world)
            {
                state.world = world;
                state.unconfirmed.clear();
                state.lost.clear();
                self.review_standings(state);
            }
        }
    }

    /// A batch under way begins, or the rest of it: a push takes its place on the stack then, or finds none.
    pub(super) fn takes_place(&mut self, state: &mut ProductState, number: u32) {
        // What is over, however that came, has no place, and its number is another's.
        let ProductState { placed, joined, desk, .. } = &mut *state;
        placed.retain(|of| *of != number && desk.active(*of).is_some());
        joined.retain(|of| desk.active(*of).is_some());
        let active = state.desk.under_way().iter().find(|active| active.number == number);
        let Some(requests) = active.map(|active| active.batch.requests.clone()) else { return };
        if self.worlds.is_tight(state.world, &requests)
            && !self.comes(state, number, &requests).refused.iter().any(|(_, why)| is_for_room(why))
        {
            state.placed.push(number);
        }
    }

    /// Puts an event into the inbox of everybody but the one that emits it.
    pub(super) fn spread(&mut self, state: &mut ProductState, name: EventName, but: Option<usize>) {
        for number in 0..self.members.len() {
            let member = &mut self.members[number];
            let event = member.chart.event(name);
            let own = index(number);
            // Nothing can bring it elsewhere before it takes the event, and here the event does nothing.
            let settled = state.outstanding(member.by) == 0 && !state.inbox.iter().any(|(to, _)| *to == own);
            let alone = but.is_none() && self.members.len() == 1;
            let member = &mut self.members[number];
            if Some(number) == but
                || event == EventId::OTHER
                || (settled || alone) && !member.react(state.leaves[number], event).taken
            {
                continue;
            }
            if state.inbox.len() >= limits::CHECK_INBOX {
                self.overflow = true;
                continue;
            }
            state.inbox.push((own, event));
        }
        state.inbox.sort_by_key(|(to, _)| *to);
    }

    /// Frames that waited for this event have been confirmed; perhaps, where it may be too late and what takes one back waits
    /// its turn.
    pub(super) fn confirm(&self, state: &mut ProductState, name: EventName) {
        if !state.desk.is_empty() && !self.tells_all {
            return;
        }
        state.unconfirmed.retain(|waits| match waits.request.ask {
            Ask::Apply(id) => {
                self.worlds.configuration(id).and_then(|c| c.confirm).is_none_or(|confirm| confirm.event != name)
            }
            _ => false,
        });
    }

    /// Gives answers, one after the other; each is heard before the next comes.
    pub(super) fn tell(&mut self, mut state: ProductState, answers: Answers, failed: Failed, nexts: &mut Nexts) {
        self.begin(&mut state);
        // Those that are still to be heard lie with the state: who would hear them may be left by hearing those before.
        state.telling.extend(answers.iter().copied());
        if self.tells_all && self.members.len() > 1 {
            // Each hears it in its own time: what another one asks for meanwhile may come first.
            state.telling.retain(|(request, _)| is_for_somebody(request));
            let states = if state.in_transit.is_empty() { one(state) } else { self.lands(state) };
            for state in states {
                let state = self.settle(state);
                nexts.all.push(Next::answered(Move::Answer, answers.clone(), state, failed));
            }
            return;
        }
        // What is in transit may come between what begins now and what is heard now.
        let mut states = if state.in_transit.is_empty() { one(state) } else { self.lands(state) };
        for _ in 0..answers.len() {
            let mut heard = States::new();
            for mut state in states {
                let (request, verdict) = state.telling.remove(0);
                let owner = self.member(request.requester).filter(|_| is_for_somebody(&request));
                match owner {
                    Some(number) => {
                        let event = self.members[number].answer(request.ask, verdict);
                        nexts.troubles.extend(self.unheard_revert(&state, number, &request, verdict));
                        heard.extend(self.react(state, number, event));
                    }
                    None => heard.push(state),
                }
            }
            states = heard;
        }
        for mut state in states {
            self.begin(&mut state);
            let state = self.settle(state);
            nexts.all.push(Next::answered(Move::Answer, answers.clone(), state, failed));
        }
    }
}

/// Whether an answer is for a coordinator: for the state that asked, while that is not left, or for whatever state there is.
pub(super) fn is_for_somebody(request: &Request) -> bool {
    !request.is_asked() && request.requester != Requester::Operator || request.tag.0 != 0
}
