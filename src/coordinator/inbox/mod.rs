//! Where events wait for the coordinator: in classes with room of their own (semantics: *Coordinators*), so that no flood of one kind
//! displaces another, and each waits for a bounded number of turns.
//!
//! 1. Urgent ones (declared safety events, those that begin and end the deployment), one of each at most, of the latter two in the
//!    order in which they came last, of the former one more behind those; then the words of
//!    the configurator, in its order: answers, whose room was taken when they were asked for, and what it says unasked
//!    (`ID.lost`, `ID.reverted`, answers for which there was no room), one of each at most.
//! 2. Reports: events of components, monitors and other coordinators. When their room is full there is still room for one of
//!    each event that the chart waits for: the last of a name is never lost. The others are lost and counted.
//! 3. Events from outside. When their room is full they are refused to whoever sends them. None of them is taken up while
//!    [`limits::INBOX_ASKED`] requests of the coordinator are not answered: it would only ask for more. Those that wait when a safety event
//!    comes from outside are overtaken by it, and delivered to nobody.
//!
//! The first class goes first, after [`limits::INBOX_ROW`] in a row one of the other two; between these what came first, and
//! after as many in a row of one class the other. Of the first class, after as many urgent ones a word. Which goes first is, but
//! for these turns, `model/precedence.rs`, where `check` asks the same.

mod lists;
#[cfg(test)]
mod tests;

use super::core::Tag;
use crate::limits;
use crate::model::Precedence;
use crate::model::names::EventName;
use crate::statechart::NodeId;
use lists::{List, Lists};
use rustc_hash::FxHashMap;
use serde::Serialize;

/// What an event is to a coordinator: where it waits, and what becomes of it when there is no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Class {
    /// Goes before everything else. One that waits already is this one, too.
    Urgent,
    /// An answer; its room is [held](super::CoordinatorHandle::hold) since it was asked for.
    Answer,
    /// What the configurator says unasked. One that waits already gives way to this one: the last word counts.
    Notice,
    /// An event of a component, a monitor or another coordinator.
    Report,
    /// An event from outside; its sender holds room for it, or hears that there is none.
    Outside,
}

/// An event on its way to a coordinator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incoming {
    /// The event.
    pub event: EventName,
    /// For whom it is, when it answers something that a state asked; not delivered once that visit of the state is over.
    pub tag: Option<Tag>,
    /// What it is.
    pub class: Class,
    /// Whose number is told with what became of it; 0: nobody wants to know.
    pub ticket: u64,
    /// Of an urgent one that waits already: it waits where it came last, behind what came between.
    pub last: bool,
    /// Of an event of safety from outside: what waits from outside is overtaken. One that a component or a coordinator raises, perhaps in each of its
    /// cycles, keeps nobody outside from being heard.
    pub overtakes: bool,
    /// Of one from outside: such an event came since. Who raised it could not know of that, and the last word is the other one's.
    pub overtaken: bool,
}

impl Incoming {
    /// An event of a class, for nobody in particular.
    pub fn new(class: Class, event: EventName) -> Self {
        Self { event, tag: None, class, ticket: 0, last: false, overtakes: false, overtaken: false }
    }

    /// The same, going before others as its precedence says.
    #[must_use]
    pub fn going(self, precedence: Precedence) -> Self {
        let class = if precedence.is_urgent() { Class::Urgent } else { self.class };
        let overtakes = precedence == Precedence::Urgent && self.class == Class::Outside;
        Self { class, last: precedence == Precedence::UrgentAsLast, overtakes, ..self }
    }

    /// The same, for whoever asked.
    #[must_use]
    pub fn tagged(self, tag: Option<Tag>) -> Self {
        Self { tag, ..self }
    }

    /// The same, of which somebody wants to know whether a transition heard it.
    #[must_use]
    pub fn watched(self, ticket: u64) -> Self {
        Self { ticket, ..self }
    }
}

/// Why an event was not accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NotAccepted {
    /// There is no room for it; that was counted.
    #[error("the coordinator does not keep up: no room for another event")]
    Full,
    /// The coordinator was detached or has ended.
    #[error("the coordinator has been detached")]
    Detached,
}

/// What became of an event that was accepted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Put {
    /// It waits.
    Waits,
    /// It is one with another of its name that waited already.
    Joined,
    /// It waits, and another of its name is lost for it; that was counted.
    Displaced,
}

/// Events that found no room.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Dropped {
    /// Of components, monitors and other coordinators: lost.
    pub report: u64,
    /// From outside: refused to whoever sent them.
    pub outside: u64,
    /// Of the chart's own queue: events that its functions sent, or that it raised for itself.
    pub inside: u64,
}

impl Dropped {
    /// This and another one, as one.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            report: self.report + other.report,
            outside: self.outside + other.outside,
            inside: self.inside + other.inside,
        }
    }
}

/// What there may be one of: a notice of its name for a state, since a later visit's tells nothing of the answer that another state waits for.
type Single = (EventName, Option<NodeId>);

/// Rooms that were taken and not used yet.
#[derive(Debug, Default)]
struct HeldRoom {
    answers: usize,
    outside: usize,
}

/// How much of each class may wait, and how long one goes before another; see those of the same names in [`limits`].
#[derive(Debug, Clone, Copy)]
struct InboxBounds {
    answers: usize,
    report: usize,
    outside: usize,
    joined: usize,
    row: usize,
    asked: usize,
}

const BOUNDS: InboxBounds = InboxBounds {
    answers: limits::INBOX_ANSWERS,
    report: limits::INBOX_REPORT,
    outside: limits::INBOX_OUTSIDE,
    joined: limits::INBOX_JOINED,
    row: limits::INBOX_ROW,
    asked: limits::INBOX_ASKED,
};

/// All classes.
#[derive(Debug)]
pub(super) struct Inbox {
    bounds: InboxBounds,
    lists: Lists,
    held: HeldRoom,
    /// Answers that wait, which share a list with notices.
    answers: usize,
    /// Notices that wait, by what there may be one of.
    singles: FxHashMap<Single, u32>,
    /// Of each event that the chart waits for the newest report that waits.
    newest: FxHashMap<EventName, Option<u32>>,
    /// Who else wants to know what becomes of an urgent event that waits, by where it does.
    joined: Vec<(u32, u64)>,
    /// How often in a row the first class went while another one waited, how often an urgent event while a word did, and one
    /// of the other classes while the other did.
    row: usize,
    urgent_row: usize,
    low_row: (List, usize),
    /// The urgent event that is reacted to.
    in_hand: Option<EventName>,
    /// Urgent ones that the coordinator had not reacted to when it ended.
    unheard: Vec<EventName>,
    dropped: Dropped,
}

impl Inbox {
    /// An empty one of a chart that waits for these events.
    pub fn new(declared: impl IntoIterator<Item = EventName>) -> Self {
        Self::within(BOUNDS, declared)
    }

    fn within(bounds: InboxBounds, declared: impl IntoIterator<Item = EventName>) -> Self {
        let newest: FxHashMap<EventName, Option<u32>> = declared.into_iter().map(|name| (name, None)).collect();
        let room = bounds.answers + bounds.report + newest.len() + bounds.outside;
        Self {
            bounds,
            lists: Lists::with_room(room + limits::INBOX_SINGLES),
            held: HeldRoom::default(),
            answers: 0,
            singles: FxHashMap::with_capacity_and_hasher(2 * limits::INBOX_SINGLES, rustc_hash::FxBuildHasher),
            newest,
            joined: Vec::with_capacity(bounds.joined),
            row: 0,
            urgent_row: 0,
            low_row: (List::Reports, 0),
            in_hand: None,
            unheard: Vec::new(),
            dropped: Dropped::default(),
        }
    }

    /// Takes room for one event of a class that has to have it before it comes; all others have it always.
    pub fn hold(&mut self, class: Class) -> Result<(), NotAccepted> {
        match class {
            Class::Answer if self.answers + self.held.answers < self.bounds.answers => self.held.answers += 1,
            Class::Outside if self.lists.len(List::Outside) + self.held.outside < self.bounds.outside => {
                self.held.outside += 1;
            }
            Class::Answer => return Err(NotAccepted::Full),
            Class::Outside => {
                self.dropped.outside += 1;
                return Err(NotAccepted::Full);
            }
            Class::Urgent | Class::Notice | Class::Report => {}
        }
        Ok(())
    }

    /// Gives it back unused.
    pub fn release(&mut self, class: Class) {
        match class {
            Class::Answer => self.held.answers = self.held.answers.saturating_sub(1),
            Class::Outside => self.held.outside = self.held.outside.saturating_sub(1),
            Class::Urgent | Class::Notice | Class::Report => {}
        }
    }

    /// Puts an event in; an answer, or one from outside, into the room that was held for it (if none was, there must be some).
    pub fn push(&mut self, incoming: Incoming) -> Result<Put, NotAccepted> {
        match incoming.class {
            Class::Urgent => return self.push_urgent(incoming),
            Class::Notice => return Ok(self.push_notice(incoming)),
            Class::Report => return self.push_report(incoming),
            Class::Answer => {
                if self.held.answers == 0 {
                    self.hold(Class::Answer)?;
                }
                self.held.answers -= 1;
                self.answers += 1;
                self.lists.push(List::Words, incoming);
            }
            Class::Outside => {
                if self.held.outside == 0 {
                    self.hold(Class::Outside)?;
                }
                self.held.outside -= 1;
                self.lists.push(List::Outside, incoming);
            }
        }
        Ok(Put::Waits)
    }

    fn push_urgent(&mut self, incoming: Incoming) -> Result<Put, NotAccepted> {
        if incoming.overtakes {
            self.lists.for_each_mut(List::Outside, |waits| waits.overtaken = true);
        }
        // The last one of its name that waits, whether there is one before it, and whether what begins or ends the deployment came since.
        let (mut own, mut twice, mut since) = (None, false, false);
        for (at, waits) in self.lists.iter(List::Urgent) {
            if waits.event == incoming.event {
                (own, twice, since) = (Some(at), own.is_some(), false);
            } else {
                since |= waits.last;
            }
        }
        let Some(at) = own.filter(|_| incoming.last || twice || !since) else {
            self.lists.push(List::Urgent, incoming);
            return Ok(Put::Waits);
        };
        let at = if incoming.last || since {
            let waits = self.lists.remove(at);
            let now = self.lists.push(List::Urgent, waits);
            self.joined.iter_mut().filter(|(place, _)| *place == at).for_each(|(place, _)| *place = now);
            now
        } else {
            at
        };
        let waits = self.lists.at_mut(at);
        match incoming.ticket {
            0 => {}
            ticket if waits.ticket == 0 => waits.ticket = ticket,
            ticket if self.joined.len() < self.bounds.joined => self.joined.push((at, ticket)),
            _ => {
                self.dropped.outside += 1;
                return Err(NotAccepted::Full);
            }
        }
        Ok(Put::Joined)
    }

    fn push_notice(&mut self, incoming: Incoming) -> Put {
        let single = single(&incoming);
        let before = self.singles.remove(&single).map(|at| self.lists.remove(at));
        let at = self.lists.push(List::Words, incoming);
        self.singles.insert(single, at);
        if before.is_some() { Put::Joined } else { Put::Waits }
    }

    fn push_report(&mut self, incoming: Incoming) -> Result<Put, NotAccepted> {
        let full = self.lists.len(List::Reports) >= self.bounds.report;
        let newest = self.newest.get_mut(&incoming.event);
        let put = match newest.as_deref() {
            _ if !full => Put::Waits,
            Some(None) => Put::Waits,
            Some(Some(before)) => {
                self.lists.remove(*before);
                self.dropped.report += 1;
                Put::Displaced
            }
            None => {
                self.dropped.report += 1;
                return Err(NotAccepted::Full);
            }
        };
        let at = self.lists.push(List::Reports, incoming);
        if let Some(newest) = newest {
            *newest = Some(at);
        }
        Ok(put)
    }

    /// The next event. Its tickets are put into `tickets`.
    pub fn pop(&mut self, tickets: &mut Vec<u64>) -> Option<Incoming> {
        tickets.clear();
        let list = self.next_list()?;
        let (at, incoming) = self.lists.pop(list)?;
        match incoming.class {
            Class::Urgent => {
                self.in_hand = Some(incoming.event);
                tickets.extend(self.joined.iter().filter(|(of, _)| *of == at).map(|(_, ticket)| *ticket));
                self.joined.retain(|(of, _)| *of != at);
            }
            Class::Notice => _ = self.singles.remove(&single(&incoming)),
            Class::Answer => self.answers -= 1,
            Class::Report => {
                if let Some(newest) = self.newest.get_mut(&incoming.event).filter(|newest| **newest == Some(at)) {
                    *newest = None;
                }
            }
            Class::Outside => {}
        }
        tickets.extend(Some(incoming.ticket).filter(|ticket| *ticket != 0));
        Some(incoming)
    }

    /// Which list goes next; none: nothing waits.
    fn next_list(&mut self) -> Option<List> {
        let waits = |list| !self.lists.is_empty(list);
        let low = waits(List::Reports) || self.takes_from_outside();
        let (urgent, words) = (waits(List::Urgent), waits(List::Words));
        if (urgent || words) && !(low && self.row >= self.bounds.row) {
            self.row = if low { self.row + 1 } else { 0 };
            if urgent && !(words && self.urgent_row >= self.bounds.row) {
                self.urgent_row = if words { self.urgent_row + 1 } else { 0 };
                return Some(List::Urgent);
            }
            self.urgent_row = 0;
            return Some(List::Words);
        }
        self.row = 0;
        low.then(|| self.low_turn())
    }

    /// Whether an event from outside waits that may have its turn.
    fn takes_from_outside(&self) -> bool {
        self.held.answers < self.bounds.asked && !self.lists.is_empty(List::Outside)
    }

    /// Which of the two lower classes goes next; one of them waits.
    fn low_turn(&mut self) -> List {
        let outside = self.lists.came(List::Outside).filter(|_| self.takes_from_outside());
        let first = match (self.lists.came(List::Reports), outside) {
            (Some(report), Some(outside)) if report < outside => List::Reports,
            (Some(_), Some(_)) => List::Outside,
            (alone, _) => {
                let list = if alone.is_some() { List::Reports } else { List::Outside };
                self.low_row = (list, 0);
                return list;
            }
        };
        let list = match self.low_row {
            (of, row) if of == first && row >= self.bounds.row => first.other_low(),
            _ => first,
        };
        let row = if self.low_row.0 == list { self.low_row.1 + 1 } else { 1 };
        self.low_row = (list, row);
        list
    }

    pub fn is_empty(&self) -> bool {
        List::ALL.iter().all(|list| self.lists.is_empty(*list))
    }

    pub fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// What was taken out last has been reacted to.
    pub fn reacted(&mut self) {
        self.in_hand = None;
    }

    /// An urgent event came when nobody takes anything out any more.
    pub fn not_heard(&mut self, incoming: Incoming) {
        if incoming.class == Class::Urgent && !self.unheard.contains(&incoming.event) {
            self.unheard.push(incoming.event);
        }
    }

    /// Takes the urgent events out that the coordinator has not reacted to, in their order; each is answered once.
    pub fn take_urgent(&mut self) -> Vec<EventName> {
        let mut urgent = std::mem::take(&mut self.unheard);
        urgent.extend(self.in_hand.take());
        while let Some((_, incoming)) = self.lists.pop(List::Urgent) {
            urgent.push(incoming.event);
        }
        self.joined.clear();
        urgent
    }

    /// Forgets all that waits, but for which urgent events there were.
    pub fn clear(&mut self) {
        self.unheard = self.take_urgent();
        self.lists.clear();
        self.singles.clear();
        self.joined.clear();
        self.answers = 0;
        self.newest.values_mut().for_each(|newest| *newest = None);
    }
}

fn single(notice: &Incoming) -> Single {
    (notice.event, notice.tag.map(|tag| tag.owner))
}
