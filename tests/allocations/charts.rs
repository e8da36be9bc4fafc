//! What a step of a pure chart costs: no allocation, and work that does not grow with the size of the chart. Counted, not
//! timed.

use crate::counting::{made, made_by};
use davit::coordinator::{Class, CoordinatorHandle, Core, Incoming, Listener};
use davit::model::finding::Origin;
use davit::model::names::{ConfigId, EventName, Ident};
use davit::model::statechart::{Action, ChartNode, ChartTransition, State, Statechart, Trigger};
use davit::statechart::{Chart, EventId, Machine, Nobody, Raised, compile};
use davit::time::{Clock, Time};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

fn state(name: &str) -> State {
    State::new(Ident::new(name).unwrap())
}

fn transition(src: &str, tgt: &str, event: &str) -> ChartTransition {
    ChartTransition::new(src, tgt, (!event.is_empty()).then(|| Trigger::parse(event).unwrap()))
}

/// Three levels: groups of `per_group` leaves in a ring, groups in a ring.
fn rings(groups: usize, per_group: usize) -> Chart {
    let mut root = state("root");
    root.transitions.push(transition("initial", "g0", ""));
    for g in 0..groups {
        let mut group = state(&format!("g{g}"));
        group.config.push((ConfigId::new("held").unwrap(), Origin::NONE));
        group.transitions.push(transition("initial", "s0", ""));
        for i in 0..per_group {
            let mut leaf = state(&format!("s{i}"));
            leaf.entry.push((Action::Raise(EventName::new("entered").unwrap()), Origin::NONE));
            group.children.push(ChartNode::State(leaf));
            group.transitions.push(transition(&format!("s{i}"), &format!("s{}", (i + 1) % per_group), "next"));
            group.transitions.push(transition(&format!("s{i}"), "s0", "e_after(1)"));
        }
        root.children.push(ChartNode::State(group));
        root.transitions.push(transition(&format!("g{g}"), &format!("g{}", (g + 1) % groups), "over"));
    }
    let (chart, findings) = compile(&Statechart::new(root));
    chart.unwrap_or_else(|| panic!("{findings:?}"))
}

struct Count(u64);

impl Listener for Count {
    fn raised(&mut self, _: &Chart, batch: &[Raised]) {
        self.0 += batch.len() as u64;
    }
}

#[test]
fn a_step_of_a_pure_chart_allocates_nothing() {
    let mut core = Core::new(Arc::new(rings(5, 4)));
    let events: Vec<EventName> =
        ["next", "over", "nobody_knows_this"].iter().map(|e| EventName::new(e).unwrap()).collect();
    let mut listener = Count(0);
    let mut now = Time(0);
    core.start(now, &mut listener);
    let mut reacted = 0;
    let count = made_by(|| {
        for i in 0..10_000_usize {
            now = Time(now.as_nanos() + 400_000_000);
            core.tick(now, &mut listener);
            reacted += u64::from(
                core.deliver(events[i * 7 % 3], None, now, &mut listener) == davit::coordinator::Delivered::Taken,
            );
        }
    });
    assert_eq!(count, 0);
    assert!(reacted > 5_000 && listener.0 > 10_000, "it did something: {reacted} transitions, {} names", listener.0);
    assert!(made_by(|| drop(std::hint::black_box(vec![1]))) == 1, "the counter counts");
}

/// What its thread has allocated so far, after each step.
struct Seen {
    steps: Arc<AtomicU64>,
    allocated: Arc<AtomicU64>,
}

impl Listener for Seen {
    fn raised(&mut self, _: &Chart, _: &[Raised]) {
        self.allocated.store(made(), Ordering::SeqCst);
        self.steps.fetch_add(1, Ordering::SeqCst);
    }
}

#[test]
fn a_coordinator_takes_events_of_every_class_without_allocating() {
    let clock = Clock::real();
    let (steps, allocated): (Arc<AtomicU64>, Arc<AtomicU64>) = Default::default();
    let listener = Seen { steps: steps.clone(), allocated: allocated.clone() };
    let mut root = state("root");
    let mut leaf = state("on");
    leaf.entry.push((Action::Raise(EventName::new("entered").unwrap()), Origin::NONE));
    root.children.push(ChartNode::State(leaf));
    root.transitions.push(transition("initial", "on", ""));
    root.transitions.push(transition("on", "on", "next"));
    let (chart, _) = compile(&Statechart::new(root));
    let coordinator = CoordinatorHandle::start("coordinator", Arc::new(chart.unwrap()), &clock, listener);
    let next = EventName::new("next").unwrap();
    let all = [Class::Urgent, Class::Answer, Class::Notice, Class::Report, Class::Outside];
    let (mut sent, mut begun) = (1, None);
    let sending = |class: Class| {
        coordinator.hold(class).unwrap();
        coordinator.deliver(Incoming::new(class, next)).unwrap();
    };
    let mut mine = 0;
    for round in 0..1_000 {
        let own = made_by(|| all.into_iter().for_each(sending));
        sent += all.len() as u64;
        let deadline = clock.now() + Duration::from_secs(60);
        while steps.load(Ordering::SeqCst) < sent {
            assert!(clock.now() < deadline, "{steps:?} of {sent}");
            std::thread::yield_now();
        }
        // What a thread makes when it first waits or is woken is made once.
        if round == 10 {
            begun = Some(allocated.load(Ordering::SeqCst));
        }
        mine += if round > 10 { own } else { 0 };
    }
    assert_eq!(Some(allocated.load(Ordering::SeqCst)), begun, "the coordinator's thread");
    assert_eq!(mine, 0, "who sends");
    coordinator.stop(Time::NEVER).unwrap();
}

/// Transitions looked at for 1,000 events.
fn work(chart: &Chart) -> u64 {
    let mut machine = Machine::new(chart);
    machine.run(chart, Time(0), &mut Nobody);
    let event = |text: &str| -> EventId { chart.event(EventName::new(text).unwrap()) };
    let events = [event("next"), event("next"), event("over"), event("unknown")];
    let before = machine.work();
    for i in 0..1_000 {
        machine.send(events[i % 4]);
        machine.run(chart, Time(0), &mut Nobody);
    }
    machine.work() - before
}

#[test]
fn what_a_step_costs_does_not_depend_on_the_size_of_the_chart() {
    let small = work(&rings(4, 4));
    assert!(small > 0);
    assert_eq!(work(&rings(400, 4)), small);
    assert_eq!(work(&rings(25_000, 4)), small, "100,000 leaves");
}

#[test]
fn what_a_step_costs_does_not_depend_on_how_many_transitions_leave_its_state() {
    // Through the general engine, as compiling asks it for every reaction.
    let cost = |count: usize| {
        let mut root = state("root");
        root.children.extend([ChartNode::State(state("a")), ChartNode::State(state("b"))]);
        root.transitions.push(transition("initial", "a", ""));
        root.transitions.push(transition("b", "a", "back"));
        root.transitions.extend((0..count).map(|n| transition("a", "b", &format!("e{n}"))));
        let (chart, _) = compile(&Statechart::new(root));
        let chart = chart.unwrap();
        let mut machine = Machine::new(&chart);
        machine.run(&chart, Time(0), &mut Nobody);
        let event = |text: &str| chart.event(EventName::new(text).unwrap());
        let before = machine.work();
        for n in (0..count).step_by(count / 100) {
            for name in [format!("e{n}"), "nobody_knows_this".to_owned(), "back".to_owned()] {
                machine.send(event(&name));
                machine.run(&chart, Time(0), &mut Nobody);
            }
        }
        assert_eq!(machine.leaf(), chart.find("a").ok());
        machine.work() - before
    };
    let few = cost(1_000);
    assert!(few > 0);
    assert_eq!(cost(100_000), few);
}

#[test]
fn a_net_of_connectors_costs_its_transitions_not_its_paths() {
    // 60 layers of two connectors, each leading to both of the next layer, and nothing at the end: 2^60 paths.
    let mut root = state("root");
    root.children.push(ChartNode::State(state("a")));
    root.children.push(ChartNode::State(state("b")));
    for layer in 0..60 {
        for side in 0..2 {
            let name = format!("k{layer}_{side}");
            root.children
                .push(ChartNode::Connector(davit::model::statechart::Connector::new(Ident::new(&name).unwrap())));
            for next in 0..2 {
                let target = if layer == 59 { "b".to_owned() } else { format!("k{}_{next}", layer + 1) };
                root.transitions.push(transition(&name, &target, if layer == 59 { "never" } else { "" }));
            }
        }
    }
    root.transitions.push(transition("initial", "a", ""));
    root.transitions.push(transition("a", "k0_0", ""));
    let (chart, _) = compile(&Statechart::new(root));
    let chart = chart.unwrap();
    let mut machine = Machine::new(&chart);
    machine.run(&chart, Time(0), &mut Nobody);
    assert!(machine.work() < 1_000, "{} transitions were looked at", machine.work());
    machine.send(chart.event(EventName::new("never").unwrap()));
    machine.run(&chart, Time(0), &mut Nobody);
    assert_eq!(machine.leaf(), chart.find("b").ok());
}
