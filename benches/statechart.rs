//! Statecharts beside machines written by hand with `match`, in the same run: the ratio is what counts.
//!
//! `cargo bench --bench statechart`. Each pair does the same transitions and raises the same names. The hand-written machine
//! has no queue, no completion events and no trace; it is the least that such a machine can cost. `size` shows that a
//! step costs the same in a chart of 100,000 states (as far as the caches hold what it touches).

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use davit::model::finding::Origin;
use davit::model::names::{EventName, Ident};
use davit::model::statechart::{Action, Node, State, Statechart, Transition, Trigger};
use davit::statechart::{Chart, EventId, Hook, Machine, Raised, compile};
use davit::time::Time;
use std::hint::black_box;

fn state(name: &str) -> State {
    let mut state = State::new(Ident::new(name).unwrap());
    state.entry.push((Action::Raise(EventName::new(&format!("in_{name}")).unwrap()), Origin::NONE));
    state
}

fn transition(src: &str, tgt: &str, event: &str) -> Transition {
    Transition::new(src, tgt, (!event.is_empty()).then(|| Trigger::parse(event).unwrap()))
}

fn compiled(root: State) -> Chart {
    compile(&Statechart::new(root)).0.expect("a good chart")
}

fn toggle() -> Chart {
    let mut root = state("root");
    root.children = vec![Node::State(state("off")), Node::State(state("on"))];
    root.transitions =
        vec![transition("initial", "off", ""), transition("off", "on", "e"), transition("on", "off", "e")];
    compiled(root)
}

/// Groups of leaves: `next` goes round inside a group, `over` to the next group. Three levels.
fn rings(groups: usize, per_group: usize) -> Chart {
    let mut root = state("root");
    root.transitions.push(transition("initial", "g0", ""));
    for g in 0..groups {
        let mut group = state(&format!("g{g}"));
        group.transitions.push(transition("initial", "s0", ""));
        for i in 0..per_group {
            group.children.push(Node::State(state(&format!("s{i}"))));
            group.transitions.push(transition(&format!("s{i}"), &format!("s{}", (i + 1) % per_group), "next"));
        }
        root.children.push(Node::State(group));
        root.transitions.push(transition(&format!("g{g}"), &format!("g{}", (g + 1) % groups), "over"));
    }
    compiled(root)
}

/// Counts what is raised.
#[derive(Default)]
struct Count(u64);

impl Hook for Count {
    const TURNS: bool = false;

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.0 += 1;
        black_box(raised.name);
    }
}

/// One event, then to rest.
fn react(chart: &Chart, machine: &mut Machine, event: EventId, count: &mut Count) {
    machine.send(event);
    black_box(machine.run(chart, Time(0), count));
}

mod by_hand {
    use std::hint::black_box;

    #[derive(Clone, Copy)]
    pub enum Toggle {
        Off,
        On,
    }

    pub fn toggle(at: Toggle, event: u32, raised: &mut u64) -> Toggle {
        match (at, event) {
            (Toggle::Off, 0) => {
                *raised += 1;
                black_box("in_on");
                Toggle::On
            }
            (Toggle::On, 0) => {
                *raised += 1;
                black_box("in_off");
                Toggle::Off
            }
            (at, _) => at,
        }
    }

    macro_rules! twenty {
        ($($name:ident),*) => {
            #[derive(Clone, Copy, PartialEq)]
            pub enum Leaf { $($name),* }
        };
    }
    twenty!(A0, A1, A2, A3, B0, B1, B2, B3, C0, C1, C2, C3, D0, D1, D2, D3);

    pub fn rings(at: Leaf, event: u32, raised: &mut u64) -> Leaf {
        use Leaf::{A0, A1, A2, A3, B0, B1, B2, B3, C0, C1, C2, C3, D0, D1, D2, D3};
        let mut raise = |name: &'static str| {
            *raised += 1;
            black_box(name);
        };
        match (at, event) {
            (A0 | A1 | A2 | A3, 1) => {
                raise("in_g1");
                raise("in_s0");
                B0
            }
            (B0 | B1 | B2 | B3, 1) => {
                raise("in_g2");
                raise("in_s0");
                C0
            }
            (C0 | C1 | C2 | C3, 1) => {
                raise("in_g3");
                raise("in_s0");
                D0
            }
            (D0 | D1 | D2 | D3, 1) => {
                raise("in_g0");
                raise("in_s0");
                A0
            }
            (_, 0) => {
                let (to, name) = match at {
                    A0 => (A1, "in_s1"),
                    A1 => (A2, "in_s2"),
                    A2 => (A3, "in_s3"),
                    A3 => (A0, "in_s0"),
                    B0 => (B1, "in_s1"),
                    B1 => (B2, "in_s2"),
                    B2 => (B3, "in_s3"),
                    B3 => (B0, "in_s0"),
                    C0 => (C1, "in_s1"),
                    C1 => (C2, "in_s2"),
                    C2 => (C3, "in_s3"),
                    C3 => (C0, "in_s0"),
                    D0 => (D1, "in_s1"),
                    D1 => (D2, "in_s2"),
                    D2 => (D3, "in_s3"),
                    D3 => (D0, "in_s0"),
                };
                raise(name);
                to
            }
            (at, _) => at,
        }
    }
}

/// Which of the two events comes when: five times `next`, then `over`.
fn schedule(i: u32) -> u32 {
    u32::from(i % 6 == 5)
}

fn beside_match(c: &mut Criterion) {
    let mut group = c.benchmark_group("toggle");
    group.bench_function("match", |b| {
        let (mut at, mut raised) = (by_hand::Toggle::Off, 0);
        b.iter(|| {
            at = by_hand::toggle(black_box(at), black_box(0), &mut raised);
        });
        black_box(raised);
    });
    group.bench_function("chart", |b| {
        let chart = toggle();
        let event = chart.event(EventName::new("e").unwrap());
        let (mut machine, mut count) = (Machine::new(&chart), Count::default());
        machine.run(&chart, Time(0), &mut count);
        b.iter(|| react(&chart, &mut machine, black_box(event), &mut count));
        black_box(count.0);
    });
    group.finish();

    let mut group = c.benchmark_group("twenty_states");
    group.bench_function("match", |b| {
        let (mut at, mut raised, mut i) = (by_hand::Leaf::A0, 0, 0_u32);
        b.iter(|| {
            at = by_hand::rings(black_box(at), black_box(schedule(i)), &mut raised);
            i = i.wrapping_add(1);
        });
        black_box(raised);
    });
    group.bench_function("chart", |b| {
        let chart = rings(4, 4);
        rounds(b, &chart);
    });
    group.finish();

    let mut group = c.benchmark_group("size");
    for groups in [4, 400, 25_000] {
        let chart = rings(groups, 4);
        group.bench_with_input(BenchmarkId::from_parameter(chart.len()), &chart, rounds);
    }
    group.finish();
}

fn rounds(b: &mut criterion::Bencher<'_>, chart: &Chart) {
    let events = ["next", "over"].map(|e| chart.event(EventName::new(e).unwrap()));
    let (mut machine, mut count, mut i) = (Machine::new(chart), Count::default(), 0_u32);
    machine.run(chart, Time(0), &mut count);
    b.iter(|| {
        react(chart, &mut machine, black_box(events[schedule(i) as usize]), &mut count);
        i = i.wrapping_add(1);
    });
    black_box(count.0);
}

criterion_group!(benches, beside_match);
criterion_main!(benches);
