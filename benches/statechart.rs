//! Statecharts beside machines written by hand with `match`, in the same run: the ratio is what counts.
//!
//! `cargo bench --bench statechart`. Each pair does the same transitions with the same results to be seen: which names were
//! raised, in order, by which visit of which state (by that an answer that comes too late is told from a fresh one), and
//! where the machine stands. The hand-written machine has no queue, no completion events and no trace; it is the least that
//! such a machine can cost. `size` shows that a step costs the same in a chart of 100,000 states (as far as the caches hold
//! what it touches). At the end it prints both ratios, measured in turns.

use criterion::{BenchmarkId, Criterion, criterion_group};
use davit::model::finding::Origin;
use davit::model::names::{EventName, Ident};
use davit::model::statechart::{Action, ChartNode, ChartTransition, State, Statechart, Trigger};
use davit::statechart::{AtOnce, Chart, EventId, Hook, Machine, Raised, compile};
use davit::time::Time;
use std::hint::black_box;
use std::time::Instant;

fn state(name: &str) -> State {
    let mut state = State::new(Ident::new(name).unwrap());
    state.entry.push((Action::Raise(EventName::new(&format!("in_{name}")).unwrap()), Origin::NONE));
    state
}

fn transition(src: &str, tgt: &str, event: &str) -> ChartTransition {
    ChartTransition::new(src, tgt, (!event.is_empty()).then(|| Trigger::parse(event).unwrap()))
}

fn compiled(root: State) -> Chart {
    compile(&Statechart::new(root)).0.expect("a good chart")
}

fn toggle() -> Chart {
    let mut root = state("root");
    root.children = vec![ChartNode::State(state("off")), ChartNode::State(state("on"))];
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
            group.children.push(ChartNode::State(state(&format!("s{i}"))));
            group.transitions.push(transition(&format!("s{i}"), &format!("s{}", (i + 1) % per_group), "next"));
        }
        root.children.push(ChartNode::State(group));
        root.transitions.push(transition(&format!("g{g}"), &format!("g{}", (g + 1) % groups), "over"));
    }
    compiled(root)
}

/// What one reaction raised, until its reader has taken it.
struct Batch<T>(Vec<T>);

impl<T> Batch<T> {
    fn new() -> Self {
        Self(Vec::with_capacity(8))
    }

    /// The reader takes all.
    fn read(&mut self) {
        black_box(&self.0[..]);
        self.0.clear();
    }
}

impl Hook for Batch<Raised> {
    const MICROSTEPS: bool = false;
    const WATCHES: bool = false;

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.0.push(raised);
    }
}

/// One event, then to rest.
fn react(chart: &Chart, machine: &mut Machine, event: EventId, batch: &mut Batch<Raised>) {
    // As a coordinator does it.
    match machine.at_once(chart, event, Time(0), batch) {
        AtOnce::Rests => {}
        AtOnce::Goes => _ = black_box(machine.run(chart, Time(0), batch)),
        AtOnce::No => {
            machine.send(event);
            black_box(machine.run(chart, Time(0), batch));
        }
    }
    batch.read();
}

mod by_hand {
    use super::Batch;

    /// A name, who raised it, and in which visit. Its reader only takes it.
    #[allow(dead_code)]
    pub struct Raised<S> {
        pub name: &'static str,
        pub owner: S,
        pub visit: u32,
    }

    #[derive(Clone, Copy)]
    pub enum Toggle {
        Off,
        On,
    }

    pub struct ToggleMachine {
        pub at: Toggle,
        pub visits: [u32; 2],
    }

    impl ToggleMachine {
        fn enter(&mut self, state: Toggle, name: &'static str, batch: &mut Batch<Raised<Toggle>>) {
            self.at = state;
            let visits = &mut self.visits[state as usize];
            *visits = visits.wrapping_add(1);
            batch.0.push(Raised { name, owner: state, visit: *visits });
        }

        pub fn react(&mut self, event: u32, batch: &mut Batch<Raised<Toggle>>) {
            match (self.at, event) {
                (Toggle::Off, 0) => self.enter(Toggle::On, "in_on", batch),
                (Toggle::On, 0) => self.enter(Toggle::Off, "in_off", batch),
                _ => (),
            }
        }
    }

    #[derive(Clone, Copy, PartialEq)]
    #[rustfmt::skip]
    pub enum State { A, B, C, D, A0, A1, A2, A3, B0, B1, B2, B3, C0, C1, C2, C3, D0, D1, D2, D3 }

    pub struct Rings {
        pub at: State,
        pub visits: [u32; 20],
    }

    impl Rings {
        fn enter(&mut self, state: State, name: &'static str, batch: &mut Batch<Raised<State>>) {
            let visits = &mut self.visits[state as usize];
            *visits = visits.wrapping_add(1);
            batch.0.push(Raised { name, owner: state, visit: *visits });
        }

        pub fn react(&mut self, event: u32, batch: &mut Batch<Raised<State>>) {
            use State::{A, A0, A1, A2, A3, B, B0, B1, B2, B3, C, C0, C1, C2, C3, D, D0, D1, D2, D3};
            let (leaf, name) = match (self.at, event) {
                (A0 | A1 | A2 | A3, 1) => {
                    self.enter(B, "in_g1", batch);
                    (B0, "in_s0")
                }
                (B0 | B1 | B2 | B3, 1) => {
                    self.enter(C, "in_g2", batch);
                    (C0, "in_s0")
                }
                (C0 | C1 | C2 | C3, 1) => {
                    self.enter(D, "in_g3", batch);
                    (D0, "in_s0")
                }
                (D0 | D1 | D2 | D3, 1) => {
                    self.enter(A, "in_g0", batch);
                    (A0, "in_s0")
                }
                (A0, 0) => (A1, "in_s1"),
                (A1, 0) => (A2, "in_s2"),
                (A2, 0) => (A3, "in_s3"),
                (A3, 0) => (A0, "in_s0"),
                (B0, 0) => (B1, "in_s1"),
                (B1, 0) => (B2, "in_s2"),
                (B2, 0) => (B3, "in_s3"),
                (B3, 0) => (B0, "in_s0"),
                (C0, 0) => (C1, "in_s1"),
                (C1, 0) => (C2, "in_s2"),
                (C2, 0) => (C3, "in_s3"),
                (C3, 0) => (C0, "in_s0"),
                (D0, 0) => (D1, "in_s1"),
                (D1, 0) => (D2, "in_s2"),
                (D2, 0) => (D3, "in_s3"),
                (D3, 0) => (D0, "in_s0"),
                _ => return,
            };
            self.at = leaf;
            self.enter(leaf, name, batch);
        }
    }
}

/// Which of the two events comes when: five times `next`, then `over`.
fn schedule(i: u32) -> u32 {
    u32::from(i % 6 == 5)
}

/// Each of these is one reaction and its reader, over and over.
fn toggle_by_hand() -> impl FnMut() {
    let mut machine = by_hand::ToggleMachine { at: by_hand::Toggle::Off, visits: [1, 0] };
    let mut batch = Batch::new();
    move || {
        black_box(&mut machine).react(black_box(0), &mut batch);
        batch.read();
    }
}

fn toggle_of(chart: &Chart) -> impl FnMut() {
    let event = chart.event(EventName::new("e").unwrap());
    let (mut machine, mut batch) = (Machine::new(chart), Batch::new());
    machine.run(chart, Time(0), &mut batch);
    move || react(chart, black_box(&mut machine), black_box(event), &mut batch)
}

fn rings_by_hand() -> impl FnMut() {
    let mut machine = by_hand::Rings { at: by_hand::State::A0, visits: [0; 20] };
    let (mut batch, mut i) = (Batch::new(), 0_u32);
    move || {
        black_box(&mut machine).react(black_box(schedule(i)), &mut batch);
        batch.read();
        i = i.wrapping_add(1);
    }
}

fn rings_of(chart: &Chart) -> impl FnMut() {
    let events = ["next", "over"].map(|e| chart.event(EventName::new(e).unwrap()));
    let (mut machine, mut batch, mut i) = (Machine::new(chart), Batch::new(), 0_u32);
    machine.run(chart, Time(0), &mut batch);
    move || {
        react(chart, black_box(&mut machine), black_box(events[schedule(i) as usize]), &mut batch);
        i = i.wrapping_add(1);
    }
}

fn beside_match(c: &mut Criterion) {
    let chart = toggle();
    let mut group = c.benchmark_group("toggle");
    group.bench_function("match", |b| b.iter(toggle_by_hand()));
    group.bench_function("chart", |b| b.iter(toggle_of(&chart)));
    group.finish();

    let chart = rings(4, 4);
    let mut group = c.benchmark_group("twenty_states");
    group.bench_function("match", |b| b.iter(rings_by_hand()));
    group.bench_function("chart", |b| b.iter(rings_of(&chart)));
    group.finish();

    let mut group = c.benchmark_group("size");
    for groups in [4, 400, 25_000] {
        let chart = rings(groups, 4);
        group.bench_with_input(BenchmarkId::from_parameter(chart.len()), &chart, |b, chart| b.iter(rings_of(chart)));
    }
    group.finish();
}

/// The two in turns, so that what slows the machine down slows both: the medians, and how many times the one the other is.
fn ratio(name: &str, bound: f64, mut chart: impl FnMut(), mut by_hand: impl FnMut()) {
    const TURNS: usize = 15;
    const EACH: u32 = 500_000;
    let turn = |react: &mut dyn FnMut()| {
        #[allow(clippy::disallowed_methods)] // a benchmark measures real time
        let begun = Instant::now();
        react();
        begun.elapsed().as_secs_f64() * 1e9 / f64::from(EACH)
    };
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..TURNS {
        times[0].push(turn(&mut || (0..EACH).for_each(|_| chart())));
        times[1].push(turn(&mut || (0..EACH).for_each(|_| by_hand())));
    }
    let [chart, by_hand] = times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[TURNS / 2]
    });
    let ratio = chart / by_hand;
    let kept = if ratio <= bound { "kept" } else { "NOT kept" };
    println!("{name}: chart {chart:.2} ns, match {by_hand:.2} ns, ratio {ratio:.2}, bound {bound}: {kept}");
}

fn ratios() {
    ratio("toggle", 5.0, toggle_of(&toggle()), toggle_by_hand());
    ratio("twenty states, three levels", 5.0, rings_of(&rings(4, 4)), rings_by_hand());
}

criterion_group!(benches, beside_match);

fn main() {
    benches();
    ratios();
    Criterion::default().configure_from_args().final_summary();
}
