//! What is known of a subsystem by what its parent has raised and heard: in which states of its interface automaton it may be (its belief
//! state), found on demand.
//!
//! What the parent raises lies in the subsystem's inbox for a while, so a belief has pairs of a state and of what is still to be taken. What
//! the subsystem tells is heard at once: told earlier and heard only now, it might as well have been told now, since whatever the subsystem
//! took before it told that was raised before.

use super::automaton::{InterfaceAction, InterfaceAutomaton};
use super::state::Failed;
use crate::model::{EventName, Precedence, SubsystemStanding, precedence::taken_first};
use indexmap::IndexSet;
use rustc_hash::{FxBuildHasher, FxHashMap};
use smallvec::SmallVec;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;

/// So many events of a parent lie in a subsystem's inbox at once, at most; it takes the first of them before one more comes.
pub const MOST_UNTAKEN: usize = 3;

/// So often one event comes before it tells something, where less is known of its inbox; what comes once more changes nothing.
const MOST_REPEATED: u8 = 1;

/// So many possible things are gone through in the time in which one transition of the parent is followed.
const POSSIBLE_A_STEP: usize = 32;

/// A state that it may be in, and what it has not taken yet: places among the events that it takes, from 1 on.
type Possible = (u32, [u8; MOST_UNTAKEN]);

/// What a subsystem may tell, each with what must have failed in it and with what is known when that was heard: of ways on which less fails
/// nothing more is told.
pub type MayTell = Rc<[(EventName, Failed, u32)]>;

/// What was raised last, since it has told something, and how often: where that is known.
type Repeated = Option<(u8, u8)>;

/// A possible thing by its number, from 0 on in the order in which they were met.
type PossibleId = u32;

/// What may be, in the order of the numbers.
type Belief = Rc<[PossibleId]>;

/// What may be known of a subsystem. Known things are numbers from 0 (the start) on.
#[derive(Debug, Clone)]
pub struct Beliefs {
    automaton: Arc<InterfaceAutomaton>,
    /// So many events lie in its inbox at once.
    most_untaken: usize,
    /// What its parent waits for; what else it tells is nothing to see.
    heard: BTreeSet<EventName>,
    takes: Vec<(EventName, Precedence)>,
    /// What others raise for it of whom nothing is known here: that comes at any time.
    others: BTreeSet<EventName>,
    possible: IndexSet<Possible, FxBuildHasher>,
    /// Of each possible thing, once somebody has asked: what it may be next without the parent seeing it.
    silent: Vec<Option<Rc<[PossibleId]>>>,
    /// In which set each was met last, while one is made.
    met: Vec<u32>,
    making: u32,
    sets: IndexSet<(Belief, Repeated), FxBuildHasher>,
    tells: FxHashMap<u32, MayTell>,
    raised: FxHashMap<(u32, u8), (u32, bool)>,
    /// Something was raised where so many events may lie in its inbox already that one more was not followed there.
    filled: bool,
    /// How many possible things were gone through for all this.
    work: usize,
}

impl Beliefs {
    /// Nothing was raised yet. `takes`: what those who are followed may raise, and what of that goes first; `others`: what coordinators of
    /// the parent may raise who are not; by the names of the subsystem's own file, like `heard`. `most_untaken`: so many events lie in its inbox at
    /// once, as far as it can take them; of fewer than [`MOST_UNTAKEN`] what is raised again before it tells something changes nothing.
    pub fn new(
        automaton: Arc<InterfaceAutomaton>,
        most_untaken: usize,
        takes: Vec<(EventName, Precedence)>,
        others: BTreeSet<EventName>,
        heard: BTreeSet<EventName>,
    ) -> Self {
        let start = automaton.start();
        let (sets, tells, raised) = (IndexSet::default(), FxHashMap::default(), FxHashMap::default());
        let possible = IndexSet::default();
        let (silent, met, making) = (Vec::new(), Vec::new(), 0);
        let mut beliefs = Self {
            automaton,
            most_untaken,
            heard,
            takes,
            others,
            possible,
            silent,
            met,
            making,
            sets,
            tells,
            raised,
            filled: false,
            work: 0,
        };
        beliefs.of([(start, [0; MOST_UNTAKEN])], None);
        beliefs
    }

    /// So many events lie in its inbox at once.
    pub fn most_untaken(&self) -> usize {
        self.most_untaken
    }

    /// What it has taken to know all this, in steps that are as much as the one from one state of its parent to the next.
    pub fn work(&self) -> usize {
        self.work / POSSIBLE_A_STEP
    }

    /// Whether something was raised where its inbox may have been too full for that.
    pub fn was_filled(&self) -> bool {
        self.filled
    }

    /// The states of its automaton in which it may be where it has taken everything, is not down, and nothing has failed.
    pub fn may_wait_in(&self, belief: u32) -> impl Iterator<Item = u32> + '_ {
        let waits = |(state, untaken): Possible| {
            let of = self.automaton.state(state);
            (untaken[0] == 0 && !of.down && !of.failed).then_some(state)
        };
        self.all_of(belief).filter_map(waits)
    }

    /// What leads on from a state of its automaton without its parent: to where, and what is told of that, if the parent waits for it somewhere.
    pub fn goes_on(&self, state: u32) -> impl Iterator<Item = (Option<EventName>, u32)> + '_ {
        self.automaton.leads(state).iter().filter_map(|(by, to)| match by {
            InterfaceAction::Tells(event, _) => Some((Some(*event).filter(|event| self.heard.contains(event)), *to)),
            InterfaceAction::Takes { event, .. } if !self.others.contains(event) => None,
            InterfaceAction::Takes { .. } | InterfaceAction::Silent => Some((None, *to)),
        })
    }

    /// Whether it is down wherever it may be, and nothing lies untaken that begins it.
    pub fn is_down(&self, belief: u32, begins: &str) -> bool {
        let takes = |place: u8| self.takes.get(usize::from(place).wrapping_sub(1));
        let begins = |place: &u8| takes(*place).is_some_and(|(event, _)| event.as_str() == begins);
        self.all_of(belief).all(|(state, untaken)| self.automaton.state(state).down && !untaken.iter().any(begins))
    }

    /// What it may tell now.
    pub fn tells(&mut self, belief: u32) -> MayTell {
        if let Some(known) = self.tells.get(&belief) {
            return known.clone();
        }
        let mut after: BTreeMap<(EventName, Failed), Vec<Possible>> = BTreeMap::new();
        for (state, untaken) in self.all_of(belief) {
            for (by, to) in self.automaton.leads(state) {
                if let InterfaceAction::Tells(event, failed) = by
                    && self.heard.contains(event)
                    && is_told(*event, untaken)
                {
                    after.entry((*event, *failed)).or_default().push((*to, untaken));
                }
            }
        }
        let tells: MayTell =
            after.into_iter().map(|((event, failed), those)| (event, failed, self.of(those, None))).collect();
        self.tells.insert(belief, tells.clone());
        tells
    }

    /// Its parent raises an event: what is known then, and whether that comes to nothing for sure where something is expected of it.
    pub fn raised(&mut self, belief: u32, event: EventName) -> (u32, bool) {
        let Some(at) = self.takes.iter().position(|(takes, _)| *takes == event) else { return (belief, false) };
        let number = u8::try_from(at + 1).unwrap_or(u8::MAX);
        if let Some(known) = self.raised.get(&(belief, number)) {
            return *known;
        }
        let before: Vec<Possible> = self.all_of(belief).collect();
        self.filled |= before.iter().any(|(_, untaken)| untaken[MOST_UNTAKEN - 1] != 0);
        let repeated = self.sets[belief as usize].1;
        let times = repeated.filter(|(last, _)| *last == number).map_or(0, |(_, times)| times);
        let repeated = (self.most_untaken < MOST_UNTAKEN).then_some((number, times + 1));
        if repeated.is_some() && times >= MOST_REPEATED {
            return (belief, false);
        }
        let with = |most: usize| -> Vec<Possible> {
            let of = |(state, untaken): &Possible| {
                let mut untaken = *untaken;
                *untaken[..most].iter_mut().find(|place| **place == 0)? = number;
                Some((*state, untaken))
            };
            before.iter().filter_map(of).collect()
        };
        // Where it can take none of them before, more of them lie there; and what came last gives way to this one.
        let after = (self.most_untaken..=MOST_UNTAKEN).map(with).find(|after| !after.is_empty());
        let after = after.unwrap_or_else(|| {
            let instead = |(state, untaken): &Possible| {
                let mut untaken = *untaken;
                untaken[MOST_UNTAKEN - 1] = number;
                (*state, untaken)
            };
            before.iter().map(instead).collect()
        });
        // Where something has failed nobody can tell.
        let heeds = |(state, untaken): &Possible| {
            let mut takes = self.automaton.leads(*state).iter();
            untaken[0] != 0 || takes.any(|(by, _)| *by == InterfaceAction::Takes { event, heeded: true })
        };
        let well: Vec<&Possible> = before.iter().filter(|(state, _)| !self.automaton.state(*state).failed).collect();
        let down = |(state, _): &Possible| self.automaton.state(*state).down;
        let lost = !well.is_empty() && !well.into_iter().any(|possible| heeds(possible) || down(possible));
        let known = (self.of(after, repeated), lost);
        self.raised.insert((belief, number), known);
        known
    }

    /// Whether, when it has told an event there, and nothing was raised for it since, that may be known.
    pub fn may_be_after(&self, belief: u32, event: EventName, then: u32) -> bool {
        self.tells
            .get(&belief)
            .is_some_and(|tells| tells.iter().any(|(told, _, known)| *told == event && *known == then))
    }

    /// The possible things that a belief has.
    fn all_of(&self, belief: u32) -> impl Iterator<Item = Possible> + '_ {
        self.sets[belief as usize].0.iter().map(|number| self.possible[*number as usize])
    }

    /// What is known where it is in one of these, or silently got on from there.
    fn of(&mut self, some: impl IntoIterator<Item = Possible>, repeated: Repeated) -> u32 {
        self.making += 1;
        let mut open: Vec<PossibleId> = some.into_iter().map(|of| self.number_of(of)).collect();
        let mut set: Vec<PossibleId> = Vec::with_capacity(open.len());
        while let Some(number) = open.pop() {
            if std::mem::replace(&mut self.met[number as usize], self.making) != self.making {
                set.push(number);
                open.extend(self.silently(number).iter());
            }
        }
        self.work += set.len();
        set.sort_unstable();
        let set: Belief = set.into();
        u32::try_from(self.sets.insert_full((set, repeated)).0).unwrap_or(u32::MAX)
    }

    fn number_of(&mut self, of: Possible) -> PossibleId {
        let (number, is_new) = self.possible.insert_full(of);
        if is_new {
            self.silent.push(None);
            self.met.push(0);
        }
        u32::try_from(number).unwrap_or(u32::MAX)
    }

    /// What something possible may be next without the parent seeing it: one step of it.
    fn silently(&mut self, number: PossibleId) -> Rc<[PossibleId]> {
        if let Some(known) = &self.silent[number as usize] {
            return known.clone();
        }
        let (state, untaken) = self.possible[number as usize];
        let mut next: Vec<Possible> = Vec::new();
        let taken = self.taken(untaken);
        for (by, to) in self.automaton.leads(state) {
            match by {
                InterfaceAction::Silent => next.push((*to, untaken)),
                InterfaceAction::Tells(event, _) if self.heard.contains(event) => {}
                InterfaceAction::Tells(event, _) if !is_told(*event, untaken) => {}
                InterfaceAction::Tells(..) => next.push((*to, untaken)),
                InterfaceAction::Takes { event, heeded } => {
                    next.extend(self.others.contains(event).then_some((*to, untaken)));
                    // Of those that are one each is told to have been ignored.
                    let rest = taken.iter().filter(|taken| taken.event == *event);
                    next.extend(rest.map(|taken| (*to, if *heeded { taken.rest } else { taken.but_one })));
                }
            }
        }
        let next: Rc<[PossibleId]> = next.into_iter().map(|of| self.number_of(of)).collect();
        self.silent[number as usize] = Some(next.clone());
        next
    }

    /// What it may take next of what it has not taken: of some of it the rest may not have come yet.
    fn taken(&self, untaken: [u8; MOST_UNTAKEN]) -> SmallVec<[TakenNext; 1]> {
        let takes = |place: &u8| self.takes.get(usize::from(*place).wrapping_sub(1)).copied();
        let came: SmallVec<[(EventName, Precedence); MOST_UNTAKEN]> = untaken.iter().map_while(takes).collect();
        let mut all: SmallVec<[TakenNext; 1]> = SmallVec::new();
        for some in 1..=came.len() {
            let first = taken_first(&came[..some]);
            let Some(event) = first.first().map(|at| came[*at].0) else { continue };
            let without = |gone: &[usize]| {
                let mut rest = [0; MOST_UNTAKEN];
                let left = untaken.iter().enumerate().filter(|(at, _)| !gone.contains(at));
                rest.iter_mut().zip(left).for_each(|(place, (_, left))| *place = *left);
                rest
            };
            let taken = TakenNext { event, rest: without(&first), but_one: without(&first[..1]) };
            if !all.contains(&taken) {
                all.push(taken);
            }
        }
        all
    }
}

/// An event that is taken next, as one with others of it that have come.
#[derive(PartialEq, Eq)]
struct TakenNext {
    event: EventName,
    /// What is left then.
    rest: [u8; MOST_UNTAKEN],
    /// What is left without the first of them.
    but_one: [u8; MOST_UNTAKEN],
}

/// Whether an event is told where so much is still to be taken: that it is down is seen where it rests, and what lies before it then comes to
/// nothing there. That it is up may have been told before the parent raised that.
fn is_told(event: EventName, untaken: [u8; MOST_UNTAKEN]) -> bool {
    untaken[0] == 0 || event != SubsystemStanding::Down.own_event()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::automaton::InterfaceState;
    use crate::check::automaton_draft::AutomatonDraft;

    fn name(text: &str) -> EventName {
        EventName::new(text).unwrap()
    }

    /// Begun it tells that it is up; ended, that it is down; anything else comes to nothing.
    fn beliefs() -> Beliefs {
        beliefs_beside(BTreeSet::new())
    }

    /// The same, and others raise these.
    fn beliefs_beside(others: BTreeSet<EventName>) -> Beliefs {
        let takes = |event: &str, heeded| InterfaceAction::Takes { event: name(event), heeded };
        let tells = |event: &str, failed| InterfaceAction::Tells(name(event), failed);
        let edges = [
            (0, takes("e_start", true), 1),
            (0, takes("e_shutdown", false), 0),
            (1, InterfaceAction::Silent, 2),
            (1, InterfaceAction::Silent, 5),
            (2, tells("up", Failed::Nothing), 3),
            (3, takes("e_shutdown", true), 4),
            (3, takes("e_start", false), 3),
            (4, tells("down", Failed::Nothing), 0),
            (5, tells("failed", Failed::Apply), 3),
        ];
        let mut states = vec![InterfaceState::default(); 6];
        (states[0].down, states[5].failed) = (true, true);
        let takes = vec![(name("e_start"), Precedence::UrgentAsLast), (name("e_shutdown"), Precedence::UrgentAsLast)];
        let heard = ["up", "down", "failed"].map(name).into();
        Beliefs::new(Arc::new(AutomatonDraft::whole(edges, states, 0)), MOST_UNTAKEN, takes, others, heard)
    }

    fn told(beliefs: &mut Beliefs, belief: u32) -> Vec<(String, Failed)> {
        beliefs.tells(belief).iter().map(|(event, failed, _)| (event.to_string(), *failed)).collect()
    }

    #[test]
    fn what_is_told_comes_in_its_order_and_by_what_fails() {
        let mut of = beliefs();
        assert!(told(&mut of, 0).is_empty(), "nobody has begun it");
        let (begun, _) = of.raised(0, name("e_start"));
        let expected = [("failed".to_owned(), Failed::Apply), ("up".to_owned(), Failed::Nothing)];
        assert_eq!(told(&mut of, begun), expected);
        let up = of.tells(begun)[1].2;
        assert!(told(&mut of, up).is_empty(), "once");
        let (ended, _) = of.raised(up, name("e_shutdown"));
        assert_eq!(told(&mut of, ended), [("down".to_owned(), Failed::Nothing)]);
        assert_eq!(of.tells(ended)[0].2, 0, "as at the start");
    }

    #[test]
    fn what_is_raised_waits_until_it_is_taken_and_may_come_to_nothing() {
        let mut of = beliefs();
        assert!(!of.raised(0, name("e_shutdown")).1, "nobody has begun it: nothing is expected");
        let (begun, _) = of.raised(0, name("e_start"));
        // It is ended before it has told that it is up: that waits behind it.
        let (ended, lost) = of.raised(begun, name("e_shutdown"));
        assert!(!lost);
        assert_eq!(told(&mut of, ended).last(), Some(&("up".to_owned(), Failed::Nothing)));
        let up = of.tells(ended)[1].2;
        assert_eq!(told(&mut of, up), [("down".to_owned(), Failed::Nothing)]);
        let (begun, _) = of.raised(0, name("e_start"));
        let up = of.tells(begun)[1].2;
        assert!(of.raised(up, name("e_start")).1, "it is up, and takes no second one");
    }
    #[test]
    fn what_others_raise_may_come_at_any_time() {
        let mut of = beliefs_beside([name("e_shutdown")].into());
        let (begun, _) = of.raised(0, name("e_start"));
        let up = of.tells(begun)[1].2;
        assert_eq!(told(&mut of, up), [("down".to_owned(), Failed::Nothing)], "somebody else may have ended it");
    }
}
