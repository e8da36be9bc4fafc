//! What comes from outside when nothing lies in the inboxes: events, time, confirmations, losses, operators.

use super::judge::created;
use super::members::Member;
use super::offers::Offers;
use super::product::Product;
use super::seldom::Unconfirmed;
use super::state::{Answers, Failed, Move, Next, Nexts, ProductState, Trouble, bit, index};
use crate::limits;
use crate::model::{Ask, ConfigId, EventName, RequestId, Verdict};
use crate::stack::{Batch, FrameId, Request, Requester, Why};
use crate::statechart::{EdgeId, EventId};
use smallvec::SmallVec;
use std::rc::Rc;

/// Events from outside that are heard somewhere, by their places, in order.
type HeardEvents = SmallVec<[usize; 8]>;

impl Product<'_> {
    /// What comes when nothing lies in the inboxes.
    pub(super) fn comes_from_outside(&mut self, state: &ProductState, nexts: &mut Nexts) {
        let heard = self.times_come(state, nexts);
        self.unheard_shutdown(state, &heard, nexts);
        self.events_come(state, heard, nexts);
        self.children_tell(state, nexts);
        self.notices(state, nexts);
        self.operators(state, nexts);
        self.safe_comes_elsewhere(state, nexts);
        // Who has asked for nothing since it was down has nothing to be kept, but is led down all the same where it is not there.
        let led_down = state.stopping && !self.all_in(state, |member| member.down);
        if self.others
            && state.is_at_rest()
            && !led_down
            && self.all_down(state)
            && let Some(world) = self.worlds.settle_down(state.world)
            && (world != state.world || state.stopping)
        {
            let mut next = state.clone();
            next.world = world;
            (next.stopping, next.elsewhere) = (false, false);
            next.leaving = false;
            next.waits_for_none();
            self.review_standings(&mut next);
            nexts.all.push(Next::plain(Move::OthersDown, next, Failed::Nothing));
        }
    }

    /// A safe configuration comes of those who have nothing to do with these, and is over at once: it interrupts what is under way,
    /// cancels what waits, and changes nothing else here. Where nothing is under way it makes no difference.
    fn safe_comes_elsewhere(&mut self, state: &ProductState, nexts: &mut Nexts) {
        let Some(id) = self.elsewhere.filter(|_| self.minds_elsewhere && !state.desk.is_empty()) else { return };
        let request = Request::new(RequestId(0), Ask::Apply(id), Requester::Safety);
        for mut next in self.arrive(state.clone(), &Batch::one(request)) {
            // What is on its way only is what comes a moment later.
            if !next.in_transit.is_empty() {
                continue;
            }
            next.change(|seldom| seldom.safe.retain(|safe| safe.requester != Requester::Safety));
            next.elsewhere = next.stopping;
            self.begin(&mut next);
            nexts.all.push(Next::plain(Move::Elsewhere(id), self.settle(next), Failed::Apply));
        }
    }

    /// What comes while some have not heard yet what came before: events from outside, also such as are waited for only behind that,
    /// and the times of those that have not moved since. One comes so: two at once show what comes of more.
    pub(super) fn comes_across(&mut self, state: &ProductState, nexts: &mut Nexts) {
        if state.across {
            return;
        }
        if state.inbox.len() + self.members.len() > limits::CHECK_INBOX {
            self.overflow = true;
            return;
        }
        let state = ProductState { across: true, ..state.clone() };
        self.times_come(&state, nexts);
        let mut all = HeardEvents::from_slice(&self.alike);
        all.sort_unstable();
        all.dedup();
        self.events_come(&state, all, nexts);
        self.children_tell(&state, nexts);
    }

    /// Time passes for each. Answers the events from outside that are heard where they are.
    fn times_come(&mut self, state: &ProductState, nexts: &mut Nexts) -> HeardEvents {
        let mut heard = HeardEvents::new();
        for number in 0..self.members.len() {
            let offers = self.offered(state, number);
            heard.extend_from_slice(&offers.outside);
            for event in &offers.timed {
                if state.moved & bit(number) != 0 {
                    continue;
                }
                if self.is_busy(state, number) {
                    nexts.cut = true;
                } else {
                    self.hear(state.clone(), number, *event, Move::Time(index(number), *event), nexts);
                }
            }
        }
        if self.members.len() > 1 {
            heard.sort_unstable();
            heard.dedup();
        }
        heard
    }

    /// What a coordinator hears where it is.
    fn offered(&mut self, state: &ProductState, number: usize) -> Rc<Offers> {
        let member = &mut self.members[number];
        self.offers.of(number, member, state.leaves[number], &self.outside, &self.alike)
    }

    /// Each of these events comes from outside.
    fn events_come(&mut self, state: &ProductState, heard: HeardEvents, nexts: &mut Nexts) {
        let mut busy: SmallVec<[Rc<Offers>; 2]> = SmallVec::new();
        for number in 0..self.members.len() {
            if self.is_busy(state, number) {
                busy.push(self.offered(state, number));
            }
        }
        for at in heard {
            let name = self.outside[at];
            if self.waits_for_others() && state.stopping && name == self.deployment.deploy.event
                || self.is_silent(state, name)
                || self.is_known(name)
            {
                continue;
            }
            // One for all that are like it, and they are taken where it is.
            if busy.iter().any(|offers| offers.outside.binary_search(&at).is_ok()) {
                nexts.cut = true;
                continue;
            }
            self.raised(state, name, Move::Event(u16::try_from(at).unwrap_or(u16::MAX)), nexts);
        }
    }

    /// Each subsystem of which it is known tells what it may tell now. What nobody hears was told all the same.
    fn children_tell(&mut self, state: &ProductState, nexts: &mut Nexts) {
        for at in 0..self.children.len() {
            let path = self.children[at].path;
            let belief = state.beliefs.get(at).copied().unwrap_or_default();
            let Some(beliefs) = &mut self.children[at].beliefs else { continue };
            for (event, failed, then) in beliefs.tells(belief).iter() {
                let name = event.within(path);
                let Some(place) = self.outside.iter().position(|outside| *outside == name) else { continue };
                let place = u16::try_from(place).unwrap_or(u16::MAX);
                let members = self.members.iter_mut().zip(&state.leaves).enumerate();
                let takes = members.filter_map(|(number, (member, leaf))| member.takes(*leaf, name).then_some(number));
                let takes: SmallVec<[usize; 2]> = takes.collect();
                if takes.iter().any(|number| self.is_busy(state, *number)) {
                    nexts.cut = true;
                    continue;
                }
                let mut next = state.clone();
                next.beliefs.set(at, *then);
                if takes.is_empty() && state.inbox.is_empty() {
                    self.hears_of_child(&mut next, 0, name);
                    nexts.all.push(Next::plain(Move::Unheard(place), self.settle(next), *failed));
                } else {
                    let from = nexts.all.len();
                    self.raised(&next, name, Move::Event(place), nexts);
                    nexts.all[from..].iter_mut().for_each(|next| next.failed = next.failed.max(*failed));
                }
            }
        }
    }

    /// Whether a coordinator waits for as many answers as are followed.
    pub(super) fn is_busy(&self, state: &ProductState, number: usize) -> bool {
        state.outstanding(self.members[number].by) >= self.most_waiting
    }

    /// Of each event from outside the first that leads every coordinator to the same everywhere: one of them is followed for
    /// all. What begins and ends the deployment, and what confirms, is by itself.
    pub(super) fn alike_events(&self) -> Vec<usize> {
        let confirms = |name: EventName| {
            self.deployment.configurations.iter().any(|c| c.confirm.is_some_and(|confirm| confirm.event == name))
        };
        let triggered = |name: EventName| -> Option<Vec<(usize, EdgeId)>> {
            let own = [self.deployment.deploy.event, self.deployment.shutdown.event].contains(&name)
                || confirms(name)
                || self.is_told_by_child(name);
            let pure = self.members.iter().all(|member| member.chart.is_pure());
            let of = |(number, member): (usize, &Member<'_>)| {
                let (chart, event) = (member.chart, member.chart.event(name));
                let edges = chart.nodes().flat_map(|node| chart.outgoing(node));
                let edges = edges.filter(move |edge| event != EventId::OTHER && chart.may_trigger(*edge, event));
                edges.map(move |edge| (number, edge)).collect::<Vec<_>>()
            };
            (pure && !own).then(|| self.members.iter().enumerate().flat_map(of).collect())
        };
        let all: Vec<_> = self.outside.iter().map(|name| triggered(*name)).collect();
        let first = |at: usize| all[at].as_ref().and_then(|_| all[..at].iter().position(|other| *other == all[at]));
        (0..all.len()).map(|at| first(at).unwrap_or(at)).collect()
    }

    /// The event that ends the deployment comes where nobody waits for it: it is raised once, and gone.
    fn unheard_shutdown(&mut self, state: &ProductState, heard: &HeardEvents, nexts: &mut Nexts) {
        let shutdown = self.deployment.shutdown.event;
        let Some(at) = self.outside.iter().position(|name| *name == shutdown) else { return };
        if heard.contains(&at) || state.stopping || !self.minds_stopping || self.all_are_down(state) {
            return;
        }
        let next = ProductState { stopping: true, leaving: true, ..state.clone() };
        let by = Move::Dropped(u16::try_from(at).unwrap_or(u16::MAX));
        nexts.all.push(Next::plain(by, next, Failed::Nothing));
    }

    /// An event comes to all that wait for it.
    pub(super) fn raised(&mut self, state: &ProductState, name: EventName, by: Move, nexts: &mut Nexts) {
        let mut next = state.clone();
        next.stopping |= name == self.deployment.shutdown.event && self.minds_stopping;
        // Somebody wants it up again.
        next.stopping &= name != self.deployment.deploy.event;
        next.leaving |= name == self.deployment.shutdown.event;
        self.confirm_early(&mut next, name);
        let late = self.confirmed_too_late(&next, name);
        self.confirm(&mut next, name);
        for mut next in std::iter::once(next).chain(late) {
            let hearers = self.hearers(&next, name, None);
            // If one alone hears it, there is nothing to wait for, unless more may come before it does.
            if let [(only, event)] = hearers[..]
                && next.inbox.is_empty()
                && !self.crosses
            {
                self.hear(next, usize::from(only), event, by, nexts);
            } else {
                self.spread_to(&mut next, &hearers);
                nexts.all.push(Next::plain(by, next, Failed::Nothing));
            }
        }
    }

    /// Confirmations that come or do not, and what is lost.
    pub(super) fn notices(&mut self, state: &ProductState, nexts: &mut Nexts) {
        for (at, waits) in state.unconfirmed.iter().enumerate() {
            let Ask::Apply(id) = waits.request.ask else { continue };
            let event = self.worlds.configuration(id).and_then(|c| c.confirm).map(|confirm| confirm.event);
            // What is heard comes by itself.
            if let Some(event) = event.filter(|event| !waits.late && !self.is_heard(state, *event)) {
                let mut next = state.clone();
                self.confirm(&mut next, event);
                nexts.all.push(Next::plain(Move::Confirmed(id), next, Failed::Nothing));
            }
            if !self.waits_behind_others(state, at) {
                self.unconfirmed(state, at, id, nexts);
            }
        }
        for at in 0..self.losable.len() {
            let (id, holds) = self.losable[at];
            let holds = holds && !state.over.contains(&id);
            let busy = |request: &Request| matches!(request.ask, Ask::Apply(of) | Ask::UndoOf(of) if of == id);
            let under_way = state.desk.under_way().iter().any(|turn| turn.batch.requests.iter().any(busy));
            if state.lost.contains(&id) || under_way || !self.worlds.is_in_force(state.world, id) {
                continue;
            }
            let event = Verdict::Lost.event(Ask::Apply(id));
            let mut next = state.clone();
            next.change(|seldom| {
                seldom.lost.push(id);
                seldom.lost.sort_unstable();
            });
            let class = if holds { Failed::Apply } else { Failed::Broken };
            if !holds {
                // What differs stays as it is until somebody undoes or recovers it.
                next.world = self.worlds.broken(state.world, std::iter::empty());
                next.waits_for_none();
            }
            self.spread(&mut next, event, None);
            let by = Move::Lost(id);
            match next.inbox[..] {
                [] if !holds => {}
                [] => {
                    nexts.troubles.push(Trouble::Unhandled(id, Verdict::Lost));
                    nexts.all.push(Next::plain(by, next, class));
                }
                [(only, event)] => {
                    next.inbox.clear();
                    let from = nexts.all.len();
                    self.hear(next, usize::from(only), event, by, nexts);
                    nexts.all[from..].iter_mut().for_each(|next| next.failed = next.failed.max(class));
                }
                _ => nexts.all.push(Next::plain(by, next, class)),
            }
        }
    }

    /// Whether an event comes from outside, and some coordinator hears it.
    fn is_heard(&mut self, state: &ProductState, event: EventName) -> bool {
        self.members.len() == 1 && self.outside.contains(&event) && !self.hearers(state, event, None).is_empty()
    }

    /// Whether one that came before it, and is to be confirmed within no more time, is taken back first.
    fn waits_behind_others(&self, state: &ProductState, at: usize) -> bool {
        let within = |waits: &Unconfirmed| match waits.request.ask {
            Ask::Apply(id) => self.worlds.configuration(id).and_then(|c| c.confirm).map(|confirm| confirm.within),
            _ => None,
        };
        let own = within(&state.unconfirmed[at]);
        state.desk.is_empty() && state.unconfirmed.iter().take(at).any(|before| within(before) <= own)
    }

    /// A frame is taken back, since its confirmation did not come in time.
    fn unconfirmed(&mut self, state: &ProductState, at: usize, id: ConfigId, nexts: &mut Nexts) {
        let waits = state.unconfirmed[at];
        // In a world that is not known it may be any frame, or none any more.
        let unknown = self.worlds.top(state.world).filter(|_| self.tells_all).map(|_| FrameId(0));
        let frame = self.worlds.frame(state.world, waits.place).or(unknown);
        let Some(frame) = frame else { return };
        let why = Why::Unconfirmed(frame);
        let request = Request { ask: Ask::UndoOf(id), scope: None, why, ..waits.request };
        let mut left = state.clone();
        left.change(|seldom| seldom.unconfirmed.remove(at));
        if self.tells_all {
            // It is a request like others, and takes its time.
            self.desks
                .change(&mut left.desk, |desk| _ = desk.arrive(Batch::one(request), |_| false, &self.worlds.claims));
            self.begin(&mut left);
            nexts.all.push(Next::plain(Move::Confirmed(id), left, Failed::Nothing));
            return;
        }
        if state.is_owed(request.requester) {
            return;
        }
        let concurrent = self.concurrent_work(&left, None);
        let comes = self.worlds.comes(state.world, &self.desks.asks(&[request]), &concurrent);
        let told = |verdict: Verdict| Answers::from_iter([request.as_told(verdict)]);
        if !comes.refused.is_empty() {
            nexts.troubles.extend(comes.refused.iter().map(|(_, why)| Trouble::Refused(request, why.clone())));
            self.tell(left, &told(Verdict::UndoFailed), Failed::Undo, nexts);
            return;
        }
        if comes.can_fail.contains(&true) {
            self.tell(left.clone(), &told(Verdict::UndoFailed), Failed::Undo, nexts);
            let mut broken = left.clone();
            broken.waits_for_none();
            broken.world = self.worlds.broken(state.world, std::iter::once(request.ask));
            self.tell(broken, &told(Verdict::UndoBroken), Failed::Broken, nexts);
        }
        let mut next = left;
        self.go(&mut next, &comes.done);
        self.tell(next, &told(Verdict::Undone), Failed::Apply, nexts);
    }

    /// What is told to a coordinator that nobody asked for, and that it does not hear where it is: unless it asks itself for
    /// what has just been done.
    pub(super) fn unheard_revert(
        &mut self,
        state: &ProductState,
        number: usize,
        request: &Request,
        verdict: Verdict,
    ) -> Option<Trouble> {
        let (Verdict::Reverted, Ask::Apply(id)) = (verdict, request.ask) else { return None };
        let undoes = |other: &Request| {
            let undo = other.ask == Ask::Undo || matches!(other.ask, Ask::UndoOf(of) if of == id);
            undo && other.requester == request.requester
        };
        let under_way = state.desk.under_way().iter().flat_map(|turn| &turn.batch.requests);
        let waiting = state.desk.waiting().flat_map(|batch| &batch.requests);
        let coming = state.in_transit.iter().flat_map(|batch| &batch.requests);
        if under_way.chain(waiting).chain(coming).chain(state.undos()).any(undoes) {
            return None;
        }
        let member = &mut self.members[number];
        let event = member.answer(request.ask, verdict);
        // That no state at all hears it is told without following anything.
        let heard = event == EventId::OTHER || member.react(state.leaves[number], event).taken;
        (!heard).then_some(Trouble::Unhandled(id, verdict))
    }

    /// What an operator may ask for.
    fn operators(&mut self, state: &ProductState, nexts: &mut Nexts) {
        if state.stopping || self.worlds.top(state.world).is_some() || state.outstanding(Requester::Operator) > 0 {
            return;
        }
        let own = self.worlds.of_operator(state.world);
        let mut asks: Vec<Ask> = Vec::new();
        for id in &own {
            asks.extend(Some(Ask::UndoOf(*id)).filter(|undo| !asks.contains(undo)));
        }
        let fits = |id: &&ConfigId| own.iter().chain([*id]).all(|own| !self.is_safe(*own)) || own.is_empty();
        if own.len() < self.by_hand {
            asks.extend(self.operator.iter().filter(fits).map(|id| Ask::Apply(*id)));
        }
        // Nobody has anything to do with what is not there, but to make it.
        let empty = self.worlds.get(state.world).is_some_and(|world| world.is_bare()) && state.desk.is_empty();
        let makes = |ask: &Ask| match ask {
            Ask::Apply(id) => {
                self.worlds.configuration(*id).is_some_and(|configuration| created(configuration).next().is_some())
            }
            _ => false,
        };
        let asks: Vec<Ask> = asks.into_iter().filter(|ask| !empty || makes(ask)).collect();
        for ask in asks {
            let request = Request::new(RequestId(0), ask, Requester::Operator);
            let by_hand = matches!(ask, Ask::Apply(id) if self.is_safe(id));
            for next in self.arrive(state.clone(), &Batch::one(request)) {
                let next = Next::plain(Move::Operator(ask), self.settle(next), Failed::Nothing);
                nexts.all.push(Next { by_hand, ..next });
            }
        }
    }
}
