//! What coordinators come to hear: events that are put into their inboxes, and answers.

use super::arrive::is_for_somebody;
use super::product::Product;
use super::seldom::Unconfirmed;
use super::state::{Answers, Failed, Move, Next, Nexts, ProductState, States, add, index};
use crate::limits;
use crate::model::{Ask, EventName};
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

    /// Frames that waited for this event have been confirmed; perhaps, where it may be too late and what takes one back waits
    /// its turn.
    pub(super) fn confirm(&self, state: &mut ProductState, name: EventName) {
        if !state.desk.is_empty() && !self.tells_all {
            return;
        }
        if state.unconfirmed.is_empty() {
            return;
        }
        let waits_on = |waits: &Unconfirmed| match waits.request.ask {
            Ask::Apply(id) => {
                self.worlds.configuration(id).and_then(|c| c.confirm).is_none_or(|confirm| confirm.event != name)
            }
            _ => false,
        };
        state.change(|seldom| seldom.unconfirmed.retain(waits_on));
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
