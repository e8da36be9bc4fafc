//! What coordinators come to hear: events that are put into their inboxes, and answers.

use super::arrive::is_for_somebody;
use super::product::Product;
use super::seldom::Unconfirmed;
use super::state::{Answers, Failed, Move, Next, Nexts, ProductState, States, add, index};
use crate::limits;
use crate::model::{Ask, ConfigId, EventName};
use crate::stack::Batch;
use crate::statechart::EventId;
use smallvec::SmallVec;

impl Product<'_> {
    /// So many events are on their way at once: two for each where there are many coordinators, for one event may be for all of them.
    fn most_between(&self) -> usize {
        limits::CHECK_INBOX.max(2 * self.members.len())
    }

    /// Puts an event into the inbox of everybody but the one that emits it.
    pub(super) fn spread(&mut self, state: &mut ProductState, name: EventName, but: Option<usize>) {
        let hearers = self.hearers(state, name, but);
        self.spread_to(state, &hearers);
    }

    /// Puts an event into the inboxes of these, as each knows it.
    pub(super) fn spread_to(&mut self, state: &mut ProductState, hearers: &[(u8, EventId)]) {
        if hearers.is_empty() {
            return;
        }
        for hears in hearers {
            if state.inbox.len() >= self.most_between() {
                self.overflow = true;
                continue;
            }
            state.inbox.push(*hears);
        }
        state.inbox.sort_by_key(|(to, _)| *to);
    }

    /// Who may take an event, but the one that emits it, and as what each knows it.
    pub(super) fn hearers(
        &mut self,
        state: &ProductState,
        name: EventName,
        but: Option<usize>,
    ) -> SmallVec<[(u8, EventId); 2]> {
        let mut hearers = SmallVec::new();
        for number in 0..self.members.len() {
            let member = &self.members[number];
            let event = member.chart.event(name);
            let own = index(number);
            if Some(number) == but || event == EventId::OTHER {
                continue;
            }
            // Nothing can bring it elsewhere before it takes the event, and here the event does nothing.
            let settled = || state.outstanding(member.by) == 0 && !state.inbox.iter().any(|(to, _)| *to == own);
            let alone = but.is_none() && self.members.len() == 1;
            if (alone || settled()) && !self.members[number].react(state.leaves[number], event).taken {
                continue;
            }
            hearers.push((own, event));
        }
        hearers
    }

    /// Frames that waited for this event have been confirmed.
    pub(super) fn confirm(&self, state: &mut ProductState, name: EventName) {
        if state.unconfirmed.iter().any(|waits| self.is_for(waits, name)) {
            state.change(|seldom| seldom.unconfirmed.retain(|waits| !self.is_for(waits, name)));
        }
    }

    /// Where something is under way what confirms may come too late for a frame, and what takes that back waits. None: it cannot.
    pub(super) fn confirmed_too_late(&self, state: &ProductState, name: EventName) -> Option<ProductState> {
        let waits = !self.tells_all && state.unconfirmed.iter().any(|waits| self.is_for(waits, name));
        (waits && !state.desk.is_empty()).then(|| {
            let mut late = state.clone();
            late.change(|seldom| {
                seldom.unconfirmed.update(|waits| self.is_for(waits, name), |waits| waits.late = true)
            });
            late
        })
    }

    fn is_for(&self, waits: &Unconfirmed, name: EventName) -> bool {
        matches!(waits.request.ask, Ask::Apply(id) if !waits.late && self.is_confirmed_by(id, name))
    }

    fn is_confirmed_by(&self, id: ConfigId, name: EventName) -> bool {
        self.worlds.configuration(id).and_then(|c| c.confirm).is_some_and(|confirm| confirm.event == name)
    }

    /// What comes while the configuration has been asked for, and is not there yet, confirms it as well. Where several coordinators ask it
    /// is not known which of them had asked by then.
    pub(super) fn confirm_early(&self, state: &mut ProductState, name: EventName) {
        if !self.worlds.confirms || self.members.len() > 1 || state.desk.is_empty() {
            return;
        }
        let asked = state.desk.requests().filter_map(|request| match request.ask {
            Ask::Apply(id) if self.is_confirmed_by(id, name) && !state.confirmed.contains(&id) => Some(id),
            _ => None,
        });
        let early: SmallVec<[ConfigId; 2]> = asked.collect();
        if !early.is_empty() {
            state.change(|seldom| {
                early.into_iter().for_each(|id| seldom.confirmed.push(id));
                seldom.confirmed.sort_unstable();
            });
        }
    }

    /// What is asked for anew is another request than the one that was confirmed, and of the two one may be gone.
    pub(super) fn asks_anew(&self, state: &mut ProductState, batch: &Batch) {
        if !state.confirmed.is_empty() {
            let asks = |id: &ConfigId| batch.requests.iter().any(|request| request.ask == Ask::Apply(*id));
            state.change(|seldom| seldom.confirmed.retain(|id| !asks(id)));
        }
    }

    /// What is asked for no more, however that came, was not confirmed by what came before.
    pub(super) fn forget_early(&self, state: &mut ProductState) {
        if state.confirmed.is_empty() {
            return;
        }
        let asked: SmallVec<[Ask; 4]> = state.desk.requests().map(|request| request.ask).collect();
        state.change(|seldom| seldom.confirmed.retain(|id| asked.contains(&Ask::Apply(*id))));
    }

    /// Gives answers, one after the other; each is heard before the next comes.
    pub(super) fn tell(&mut self, mut state: ProductState, answers: &Answers, failed: Failed, nexts: &mut Nexts) {
        self.begin(&mut state);
        if self.tells_all && self.members.len() > 1 {
            state.change(|seldom| {
                seldom.telling.extend(answers.iter().copied());
                // Each hears it in its own time: what another one asks for meanwhile may come first.
                seldom.telling.retain(|(request, _)| is_for_somebody(request));
            });
            for state in self.lands(state) {
                let state = self.settle(state);
                nexts.all.push(Next::answered(Move::Answer, answers.clone(), state, failed));
            }
            return;
        }
        // Those that are still to be heard lie with the state: who would hear them may be left by hearing those before.
        if answers.len() > 1 {
            state.change(|seldom| seldom.telling.extend(answers.iter().skip(1).copied()));
        }
        // What is in transit may come between what begins now and what is heard now.
        let mut states = self.lands(state);
        for place in 0..answers.len() {
            let mut heard = States::new();
            for mut state in states {
                let (request, verdict) = match place {
                    0 => answers[0],
                    _ => state.change(|seldom| seldom.telling.remove(0)),
                };
                let owner = self.member(request.requester).filter(|_| is_for_somebody(&request));
                match owner {
                    Some(number) => {
                        let event = self.members[number].answer(request.ask, verdict);
                        nexts.troubles.extend(self.unheard_revert(&state, number, &request, verdict));
                        add(&mut heard, self.react(state, number, event));
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
