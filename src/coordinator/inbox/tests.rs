//! Random sequences: what goes in comes out, in its order, within its bounds and its turns.

use super::*;
use crate::model::precedence::taken_first;
use proptest::prelude::*;

const SMALL: InboxBounds = InboxBounds { answers: 4, report: 3, outside: 4, joined: 2, row: 3, asked: 100 };

/// Names that the chart waits for, and as many that it does not.
const DECLARED: usize = 3;

fn name(number: usize) -> EventName {
    EventName::new(&format!("e{number}")).unwrap()
}

#[derive(Debug, Clone, Copy)]
enum Op {
    /// Of a class, the event of that number, for the state of that number, with room held before or not.
    Push(Class, usize, usize, bool),
    Hold(Class),
    Release(Class),
    Pop,
}

fn class() -> impl Strategy<Value = Class> {
    use Class::{Answer, Notice, Outside, Report, Urgent};
    prop_oneof![1 => Just(Urgent), 1 => Just(Answer), 1 => Just(Notice), 3 => Just(Report), 2 => Just(Outside)]
}

fn ops() -> impl Strategy<Value = Vec<Op>> {
    let push = (class(), 0..2 * DECLARED, 0..2_usize, any::<bool>());
    let op = prop_oneof![
        12 => push.prop_map(|(class, event, state, held)| Op::Push(class, event, state, held)),
        1 => class().prop_map(Op::Hold),
        1 => class().prop_map(Op::Release),
        8 => Just(Op::Pop),
    ];
    prop::collection::vec(op, 0..400)
}

/// One that waits, as it is to be: with the tickets that are to come out with it, the turn at which it went in, and how many
/// of its list were before it.
#[derive(Debug, Clone)]
struct Waits {
    incoming: Incoming,
    tickets: Vec<u64>,
    since: usize,
    ahead: usize,
}

/// What is to be, kept the slow way.
#[derive(Default)]
struct Plain {
    lists: [Vec<Waits>; 4],
    answers: usize,
    outside: usize,
    lost: u64,
    refused: u64,
    turns: usize,
}

fn list(class: Class) -> List {
    match class {
        Class::Urgent => List::Urgent,
        Class::Answer | Class::Notice => List::Words,
        Class::Report => List::Reports,
        Class::Outside => List::Outside,
    }
}

impl Plain {
    fn of(&mut self, list: List) -> &mut Vec<Waits> {
        &mut self.lists[list as usize]
    }

    fn count(&self, class: Class) -> usize {
        self.lists[list(class) as usize].iter().filter(|waits| waits.incoming.class == class).count()
    }

    fn has_room(&self, class: Class) -> bool {
        match class {
            Class::Answer => self.count(class) + self.answers < SMALL.answers,
            Class::Outside => self.count(class) + self.outside < SMALL.outside,
            _ => true,
        }
    }

    fn hold(&mut self, class: Class) -> Result<(), NotAccepted> {
        if !self.has_room(class) {
            self.refused += u64::from(class == Class::Outside);
            return Err(NotAccepted::Full);
        }
        match class {
            Class::Answer => self.answers += 1,
            Class::Outside => self.outside += 1,
            _ => {}
        }
        Ok(())
    }

    fn release(&mut self, class: Class) {
        match class {
            Class::Answer => self.answers = self.answers.saturating_sub(1),
            Class::Outside => self.outside = self.outside.saturating_sub(1),
            _ => {}
        }
    }

    fn add(&mut self, incoming: Incoming) {
        let since = self.turns;
        let list = self.of(list(incoming.class));
        let tickets = Some(incoming.ticket).filter(|t| *t != 0).into_iter().collect();
        list.push(Waits { incoming, tickets, since, ahead: list.len() });
    }

    fn push(&mut self, incoming: Incoming) -> Result<Put, NotAccepted> {
        let like = |waits: &Waits| waits.incoming.class == incoming.class && waits.incoming.event == incoming.event;
        match incoming.class {
            Class::Urgent => {
                let joined: usize = self.of(List::Urgent).iter().map(|w| w.tickets.len().saturating_sub(1)).sum();
                if let Some(waits) = self.of(List::Urgent).iter_mut().find(|waits| like(waits)) {
                    if incoming.ticket != 0 && !waits.tickets.is_empty() && joined >= SMALL.joined {
                        self.refused += 1;
                        return Err(NotAccepted::Full);
                    }
                    waits.tickets.extend(Some(incoming.ticket).filter(|t| *t != 0));
                    return Ok(Put::Joined);
                }
            }
            Class::Notice => {
                let owner = |incoming: &Incoming| incoming.tag.map(|tag| tag.owner);
                let same = |waits: &Waits| like(waits) && owner(&waits.incoming) == owner(&incoming);
                let before = self.of(List::Words).iter().position(same);
                if let Some(before) = before {
                    self.of(List::Words).remove(before);
                    self.add(incoming);
                    return Ok(Put::Joined);
                }
            }
            Class::Report if self.count(Class::Report) >= SMALL.report => {
                self.lost += 1;
                let newest = self.of(List::Reports).iter().rposition(like);
                match newest {
                    _ if (0..DECLARED).all(|number| name(number) != incoming.event) => return Err(NotAccepted::Full),
                    Some(before) => _ = self.of(List::Reports).remove(before),
                    None => self.lost -= 1,
                }
                self.add(incoming);
                return Ok(if newest.is_some() { Put::Displaced } else { Put::Waits });
            }
            Class::Report => {}
            Class::Answer => match self.answers {
                0 if !self.has_room(Class::Answer) => return Err(NotAccepted::Full),
                _ => self.release(Class::Answer),
            },
            Class::Outside => match self.outside {
                0 if !self.has_room(Class::Outside) => {
                    self.refused += 1;
                    return Err(NotAccepted::Full);
                }
                _ => self.release(Class::Outside),
            },
        }
        self.add(incoming);
        Ok(Put::Waits)
    }

    /// What came out is the first of its list, and did not wait for longer than it may.
    fn popped(&mut self, incoming: Option<Incoming>, tickets: &[u64]) {
        let Some(incoming) = incoming else {
            assert!(self.lists.iter().all(Vec::is_empty), "something waits, and nothing came out");
            return;
        };
        self.turns += 1;
        let turns = self.turns;
        let list = list(incoming.class);
        let first = self.of(list).remove(0);
        let same = |a: Incoming, b: Incoming| (a.event, a.tag, a.class) == (b.event, b.tag, b.class);
        assert!(same(first.incoming, incoming), "{:?} goes before {incoming:?}", first.incoming);
        let (mut there, mut wanted) = (tickets.to_vec(), first.tickets.clone());
        there.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(there, wanted);
        let (waited, mine) = (turns - first.since, first.ahead + 1);
        let most = match list {
            List::Urgent => mine + 2 * (mine / SMALL.row + 2),
            List::Words => mine * (SMALL.row + 3) + 1,
            List::Reports | List::Outside => mine * (SMALL.row + 1) * (SMALL.row + 1),
        };
        assert!(waited <= most, "{incoming:?} waited for {waited} turns behind {} of its class", first.ahead);
    }
}

/// Does the same with both.
fn run(ops: &[Op]) {
    let mut inbox = Inbox::within(SMALL, (0..DECLARED).map(name));
    let (mut plain, mut tickets) = (Plain::default(), Vec::new());
    for (number, op) in (1..).zip(ops) {
        match *op {
            Op::Push(class, event, state, held) => {
                let tag = matches!(class, Class::Answer | Class::Notice)
                    .then_some(Tag { owner: NodeId::ROOT, visit: number })
                    .filter(|_| state > 0);
                // Of an urgent event not everybody wants to know.
                let ticket = if class == Class::Urgent && state == 0 { 0 } else { u64::from(number) };
                let incoming = Incoming::new(class, name(event)).tagged(tag).watched(ticket);
                if held {
                    let (there, wanted) = (inbox.hold(class), plain.hold(class));
                    assert_eq!(there, wanted);
                    if there.is_err() {
                        continue;
                    }
                }
                let wanted = plain.push(incoming);
                assert_eq!(inbox.push(incoming), wanted, "{incoming:?}");
                assert!(!held || class != Class::Answer || wanted.is_ok(), "an answer is lost");
            }
            Op::Hold(class) => assert_eq!(inbox.hold(class), plain.hold(class)),
            Op::Release(class) => {
                inbox.release(class);
                plain.release(class);
            }
            Op::Pop => plain.popped(inbox.pop(&mut tickets), &tickets),
        }
        assert!(plain.count(Class::Report) <= SMALL.report + DECLARED);
        assert!(plain.count(Class::Answer) + plain.answers <= SMALL.answers);
        assert!(plain.count(Class::Outside) + plain.outside <= SMALL.outside);
        assert_eq!((inbox.dropped().report, inbox.dropped().outside), (plain.lost, plain.refused));
        assert_eq!(inbox.is_empty(), plain.lists.iter().all(Vec::is_empty));
    }
    loop {
        let next = inbox.pop(&mut tickets);
        plain.popped(next, &tickets);
        if next.is_none() {
            break;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn what_goes_in_comes_out_in_its_order_its_bounds_and_its_turns(ops in ops()) {
        run(&ops);
    }
}

/// What comes out while every class is filled up again after each turn.
fn flooded(turns: usize) -> Vec<Class> {
    let mut inbox = Inbox::new((0..DECLARED).map(name));
    let mut tickets = Vec::new();
    let mut out = Vec::new();
    for _ in 0..turns {
        for number in 0..DECLARED {
            inbox.push(Incoming::new(Class::Urgent, name(number))).unwrap();
        }
        while inbox.hold(Class::Answer).is_ok() {
            inbox.push(Incoming::new(Class::Answer, name(0))).unwrap();
        }
        while inbox.push(Incoming::new(Class::Report, name(1))) == Ok(Put::Waits) {}
        while inbox.push(Incoming::new(Class::Outside, name(2))).is_ok() {}
        out.push(inbox.pop(&mut tickets).unwrap().class);
    }
    out
}

#[test]
fn with_every_class_flooded_each_has_its_turns() {
    let out = flooded(40 * limits::INBOX_ROW * limits::INBOX_ROW);
    let longest = |class: Class| {
        let at: Vec<usize> = (0..out.len()).filter(|turn| out[*turn] == class).collect();
        let gaps = at.windows(2).map(|pair| pair[1] - pair[0]);
        gaps.chain(at.first().map(|first| first + 1)).max().expect("it has a turn")
    };
    let row = limits::INBOX_ROW;
    assert_eq!(longest(Class::Urgent), 3, "an answer and a report in between");
    assert!(longest(Class::Answer) <= row + 3, "{}", longest(Class::Answer));
    let low = (row + 1) * (row + 1);
    assert!(longest(Class::Report) <= low && longest(Class::Outside) <= low);
    // One of the lower classes in each row.
    let lower = out.iter().filter(|class| matches!(class, Class::Report | Class::Outside)).count();
    assert_eq!(lower, out.len() / (row + 1));
}

#[test]
fn the_last_word_counts() {
    let (mut inbox, mut tickets) = (Inbox::new([]), Vec::new());
    inbox.push(Incoming::new(Class::Notice, name(0))).unwrap();
    inbox.push(Incoming::new(Class::Answer, name(1))).unwrap();
    assert_eq!(inbox.push(Incoming::new(Class::Notice, name(0))), Ok(Put::Joined));
    let mut next = || inbox.pop(&mut tickets).map(|incoming| incoming.event);
    assert_eq!([next(), next(), next()], [Some(name(1)), Some(name(0)), None], "lost, applied anew, and lost again");
}

#[test]
fn between_the_lower_classes_what_came_first_goes_first() {
    let (mut inbox, mut tickets) = (Inbox::new([name(1)]), Vec::new());
    for class in [Class::Outside, Class::Report, Class::Report, Class::Outside] {
        inbox.push(Incoming::new(class, name(1))).unwrap();
    }
    let out: Vec<Class> = std::iter::from_fn(|| inbox.pop(&mut tickets)).map(|incoming| incoming.class).collect();
    assert_eq!(out, [Class::Outside, Class::Report, Class::Report, Class::Outside]);
}

/// A coordinator that asks for more than is carried out takes up no event from outside, and goes on with everything else.
#[test]
fn while_much_is_asked_for_what_comes_from_outside_waits() {
    let (mut inbox, mut tickets) = (Inbox::new([name(1)]), Vec::new());
    (0..limits::INBOX_ASKED).for_each(|_| inbox.hold(Class::Answer).unwrap());
    for class in [Class::Outside, Class::Report, Class::Outside, Class::Urgent] {
        inbox.push(Incoming::new(class, name(1))).unwrap();
    }
    let mut out = |inbox: &mut Inbox| inbox.pop(&mut tickets).map(|incoming| incoming.class);
    assert_eq!([out(&mut inbox), out(&mut inbox), out(&mut inbox)], [Some(Class::Urgent), Some(Class::Report), None]);
    assert!(!inbox.is_empty());
    inbox.push(Incoming::new(Class::Answer, name(0))).unwrap();
    assert_eq!([out(&mut inbox), out(&mut inbox)], [Some(Class::Answer), Some(Class::Outside)]);
    inbox.hold(Class::Answer).unwrap();
    assert_eq!(out(&mut inbox), None);
    inbox.release(Class::Answer);
    assert_eq!([out(&mut inbox), out(&mut inbox)], [Some(Class::Outside), None]);
}

/// Of what begins and what ends the deployment the order of the last ones counts; a safety event keeps its place, and is heard once more behind
/// what came of those before it came again: the last word is a stop, if that came last.
#[test]
fn what_begins_and_what_ends_come_in_the_order_in_which_they_came_last() {
    let mut inbox = Inbox::new([]);
    let urgent = |at: usize, last: bool| Incoming { last, ..Incoming::new(Class::Urgent, name(at)) };
    let (begins, ends, stops) = ((0, true), (1, true), (2, false));
    for (came, order) in [
        (vec![begins, stops, ends, begins], vec![2, 1, 0]),
        (vec![begins, stops, ends, begins, stops], vec![2, 1, 0, 2]),
        (vec![stops, stops, ends], vec![2, 1]),
        (vec![stops, ends, stops, stops, (3, false), begins, stops], vec![2, 1, 3, 0, 2]),
        (vec![stops, ends, stops, ends], vec![2, 2, 1]),
    ] {
        for (number, (at, last)) in (1..).zip(came.iter().copied()) {
            inbox.push(urgent(at, last).watched(number)).unwrap();
        }
        let (mut tickets, mut told) = (Vec::new(), Vec::new());
        let taken = std::iter::from_fn(|| {
            let taken = inbox.pop(&mut tickets)?;
            told.extend(tickets.iter().map(|ticket| (taken.event, *ticket)));
            Some(taken.event)
        });
        assert_eq!(taken.collect::<Vec<_>>(), order.into_iter().map(name).collect::<Vec<_>>(), "{came:?}");
        told.sort_unstable_by_key(|(_, ticket)| *ticket);
        let raised: Vec<_> = (1..).zip(&came).map(|(number, (at, _))| (name(*at), number)).collect();
        assert_eq!(told, raised, "each who raised one is told once");
    }
}

/// Who raised something before a stop did not know of it: only what comes after it is heard. What begins and ends the deployment is no such word.
#[test]
fn what_waits_from_outside_is_overtaken_by_safety() {
    let mut inbox = Inbox::within(SMALL, []);
    inbox.push(Incoming::new(Class::Report, name(0))).unwrap();
    inbox.push(Incoming::new(Class::Outside, name(1)).watched(7)).unwrap();
    inbox.push(Incoming::new(Class::Outside, name(2)).going(Precedence::UrgentAsLast)).unwrap();
    // A component may raise it in each cycle.
    inbox.push(Incoming::new(Class::Report, name(3)).going(Precedence::Urgent)).unwrap();
    let told = |inbox: &mut Inbox| {
        let mut tickets = Vec::new();
        let taken = inbox.pop(&mut tickets).unwrap();
        (taken.event, taken.overtaken, tickets)
    };
    assert_eq!(told(&mut inbox), (name(2), false, vec![]));
    assert_eq!(told(&mut inbox), (name(3), false, vec![]));
    inbox.push(Incoming::new(Class::Outside, name(3)).going(Precedence::Urgent)).unwrap();
    inbox.push(Incoming::new(Class::Outside, name(4))).unwrap();
    assert_eq!(told(&mut inbox), (name(3), false, vec![]));
    assert_eq!(told(&mut inbox), (name(0), false, vec![]));
    assert_eq!(told(&mut inbox), (name(1), true, vec![7]), "whoever raised it is told");
    assert_eq!(told(&mut inbox), (name(4), false, vec![]));
}

/// What has come, and is taken between: of each class as many events as make no turns necessary.
fn arrivals() -> impl Strategy<Value = Vec<Option<(usize, Class)>>> {
    let low = prop_oneof![Just(Class::Report), Just(Class::Outside)];
    prop::collection::vec(prop::option::weighted(0.7, (0..4_usize, low)), 0..40)
}

proptest! {
    /// As long as no class has to give way after a row, what is taken is what the rule says that `check` follows.
    #[test]
    fn what_is_taken_is_what_the_rule_says(arrivals in arrivals()) {
        let precedence = |event: EventName| match event {
            event if event == name(0) => Precedence::Urgent,
            event if event == name(1) || event == name(2) => Precedence::UrgentAsLast,
            _ => Precedence::Queued,
        };
        let patient = InboxBounds { row: 100, report: 100, outside: 100, ..SMALL };
        let mut inbox = Inbox::within(patient, (0..DECLARED).map(name));
        let mut came: Vec<(EventName, Precedence)> = Vec::new();
        for arrival in arrivals.into_iter().chain(std::iter::repeat_n(None, 40)) {
            match arrival {
                Some((event, class)) => {
                    let event = name(event);
                    inbox.push(Incoming::new(class, event).going(precedence(event))).unwrap();
                    came.push((event, precedence(event)));
                }
                None => {
                    let taken = taken_first(&came);
                    let rule = taken.first().map(|at| came[*at].0);
                    prop_assert_eq!(inbox.pop(&mut Vec::new()).map(|taken| taken.event), rule);
                    let mut at = 0;
                    came.retain(|_| { at += 1; !taken.contains(&(at - 1)) });
                }
            }
        }
        prop_assert!(came.is_empty() && inbox.is_empty());
    }
}
