//! Ports and properties of running components: data, queues, written values, order, changes under load.

use crate::support::*;
use davit::model::{EventName, Policy, Step, Value, Wanted};
use davit::runtime::*;
use davit::time::{Clock, Time};
use proptest::prelude::*;
use std::time::Duration;

/// Writes how often it has been updated.
struct Counter {
    y: Out<i64>,
    wide: Out<[i64; 8]>,
    n: i64,
}

impl Component for Counter {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { y: b.output("y"), wide: b.output("wide"), n: 0 }
    }

    fn update(&mut self, _: &mut Context) {
        self.n += 1;
        self.y.write(self.n);
        self.wide.write([self.n; 8]);
    }
}

/// Notes what it reads.
struct Probe {
    u: In<i64>,
    wide: In<[i64; 8]>,
    queue: In<i64>,
    note: Prop<bool>,
    last: i64,
}

impl Component for Probe {
    fn new(b: &mut Builder<Self>) -> Self {
        Self {
            u: b.input("u"),
            wide: b.input("wide"),
            queue: b.buffered().input("queue"),
            note: b.property("note", true),
            last: 0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if let Some(wide) = self.wide.get() {
            if wide.iter().any(|v| *v != wide[0]) {
                cx.fault(format!("torn: {wide:?}"));
            }
            if wide[0] < self.last {
                cx.fault(format!("back from {} to {}", self.last, wide[0]));
            }
            self.last = wide[0];
        }
        if !self.note.get() {
            return;
        }
        let age = self.u.age();
        if let Some(sample) = self.u.sample().map(|s| (*s.value, s.at)) {
            log::note(cx.clock(), format!("{} u={} at {} age {:?}", cx.now(), sample.0, sample.1, age.unwrap()));
        } else {
            log::note(cx.clock(), format!("{} u never written", cx.now()));
        }
        let queued: Vec<i64> = std::iter::from_fn(|| self.queue.take()).collect();
        if !queued.is_empty() {
            log::note(cx.clock(), format!("queue {queued:?} lost {}", self.queue.overflows()));
        }
    }
}

fn library() -> Library {
    Library::new("test").with::<Counter>("Counter").with::<Probe>("Probe").with::<Relay>("Relay")
}

#[test]
fn the_latest_value_comes_with_its_age() {
    let b = bench(library());
    b.create("probe", "Probe", "fast", &[]);
    b.create("counter", "Counter", "slow", &[]);
    b.connect("counter.y", "probe.u", Policy::Data);
    b.start(&["counter", "probe"]);
    b.wait(MS * 12 + MS / 2);
    let lines = log::take(&b.clock);
    // The counter's activity was made first to run, so at common moments it goes first.
    assert_eq!(lines[0], "0 s u=1 at 0 s age 0ns");
    assert_eq!(lines[9], "0.009 s u=1 at 0 s age 9ms");
    assert_eq!(lines[12], "0.012 s u=2 at 0.01 s age 2ms");
    assert_eq!(lines.len(), 13);
}

#[test]
fn a_queue_that_overflows_says_so_and_keeps_the_oldest() {
    let b = bench(library());
    b.create("counter", "Counter", "fast", &[]);
    b.create("probe", "Probe", "slow", &[]);
    b.connect("counter.y", "probe.queue", Policy::Buffer(4));
    b.start(&["probe", "counter"]);
    b.wait(MS * 10 + MS / 2);
    let lines: Vec<_> = log::take(&b.clock).into_iter().filter(|l| l.contains("queue")).collect();
    assert_eq!(lines, ["queue [1, 2, 3, 4] lost 6"]);
}

#[test]
fn a_written_value_is_in_force_again_after_a_disconnect() {
    let b = bench(library());
    b.create("counter", "Counter", "slow", &[]);
    b.create("probe", "Probe", "slow", &[]);
    b.start(&["probe", "counter"]);
    let mut seen = Vec::new();
    let mut see = || {
        b.wait(MS * 10);
        let lines = log::take(&b.clock);
        seen.push(lines.last().map(|l| l.split_once(" s ").unwrap().1.split(" at").next().unwrap().to_owned()));
    };
    see();
    b.write("probe.u", 42);
    see();
    b.connect("counter.y", "probe.u", Policy::Data);
    see();
    b.disconnect("counter.y", "probe.u");
    see();
    b.does(Step::PortWrite { port: member("probe.u"), value: None });
    see();
    let seen: Vec<_> = seen.into_iter().flatten().collect();
    assert_eq!(seen, ["u never written", "u=42", "u=3", "u=42", "u never written"]);
}

/// Passes on, in an event-driven activity or not.
struct Relay {
    u: In<i64>,
    y: Out<i64>,
}

impl Component for Relay {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { u: b.input("u"), y: b.output("y") }
    }

    fn update(&mut self, cx: &mut Context) {
        log::note(cx.clock(), cx.name().to_string());
        if let Some(u) = self.u.take() {
            self.y.write(u + 1);
        }
    }
}

#[test]
fn components_of_one_activity_run_along_the_data_flow() {
    let b = bench(library());
    // Created against the flow, connected while they run.
    let names = ["a", "b", "c", "d"];
    for n in names {
        b.create(n, "Relay", "slow", &[]);
    }
    b.start(&names);
    b.wait(MS);
    assert_eq!(log::take(&b.clock), ["a", "b", "c", "d"]);
    for (from, to) in [("d.y", "c.u"), ("c.y", "b.u"), ("b.y", "a.u")] {
        b.connect(from, to, Policy::Data);
    }
    b.wait(MS * 10);
    assert_eq!(log::take(&b.clock), ["d", "c", "b", "a"]);
    // A loop of c and b at its place behind d; inside, the name decides.
    b.disconnect("b.y", "a.u");
    b.disconnect("d.y", "c.u");
    b.connect("b.y", "c.u", Policy::Data);
    b.connect("d.y", "a.u", Policy::Data);
    b.wait(MS * 10);
    let order = log::take(&b.clock);
    let place = |n: &str| order.iter().position(|m| m == n).unwrap();
    assert!(place("d") < place("a") && place("b") < place("c"), "{order:?}");
    // The loop opened again: the flow decides.
    b.disconnect("b.y", "c.u");
    b.wait(MS * 10);
    let order = log::take(&b.clock);
    assert!(order.iter().position(|m| m == "c") < order.iter().position(|m| m == "b"), "{order:?}");
}

#[test]
fn a_sample_passes_through_a_chain_in_one_round() {
    let b = bench(library());
    let names: Vec<String> = (0..50).rev().map(|i| format!("r{i}")).collect();
    for n in &names {
        b.create(n, "Relay", "slow", &[]);
    }
    for i in 1..50 {
        b.connect(&format!("r{}.y", i - 1), &format!("r{i}.u"), Policy::Data);
    }
    b.create("probe", "Probe", "slow", &[]);
    b.connect("r49.y", "probe.u", Policy::Data);
    b.write("r0.u", 100);
    b.start(&names.iter().map(String::as_str).collect::<Vec<_>>());
    b.start(&["probe"]);
    b.wait(MS);
    assert!(log::take(&b.clock).contains(&"0 s u=150 at 0 s age 0ns".to_owned()));
}

#[test]
fn event_driven_components_are_updated_when_something_comes() {
    let b = bench(library());
    for n in ["first", "second"] {
        b.create(n, "Relay", "events", &[]);
    }
    b.create("counter", "Counter", "slow", &[]);
    b.connect("counter.y", "first.u", Policy::Data);
    b.connect("first.y", "second.u", Policy::Data);
    b.start(&["first", "second"]);
    b.wait(MS);
    assert_eq!(log::take(&b.clock), ["first", "second"], "once at the start");
    b.wait(MS * 100);
    assert_eq!(log::take(&b.clock), [] as [&str; 0], "nothing comes, nothing happens");
    b.start(&["counter"]);
    b.wait(MS);
    assert_eq!(log::take(&b.clock), ["first", "second"]);
    b.go("counter", Wanted::Stopped);
    b.disconnect("first.y", "second.u");
    b.write("second.u", 1);
    b.wait(MS);
    assert_eq!(log::take(&b.clock), ["second"], "a written value comes too");
}

#[test]
fn a_loop_of_event_driven_components_does_not_hold_time_still() {
    let b = bench(library());
    for n in ["a", "b"] {
        b.create(n, "Relay", "events", &[]);
    }
    b.connect("a.y", "b.u", Policy::Data);
    b.start(&["a", "b"]);
    b.write("a.u", 1);
    b.wait(MS);
    b.connect("b.y", "a.u", Policy::Data);
    b.disconnect("b.y", "a.u");
    b.write("a.u", 1);
    b.wait(MS);
    b.connect("b.y", "a.u", Policy::Data);
    b.go("b", Wanted::Stopped);
    b.start(&["b"]);
    b.wait(Duration::from_secs(1));
    assert!(b.clock.now() >= Time(1_000_000_000));
    log::take(&b.clock);
}

/// Raises and hears events.
struct Talker {
    said: EventOut,
    heard: EventIn,
    hello: EventName,
    echo: EventName,
}

impl Component for Talker {
    fn new(b: &mut Builder<Self>) -> Self {
        Self {
            said: b.event_output("said"),
            heard: b.event_input("heard"),
            hello: b.event("e_hello"),
            echo: b.event("e_echo"),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if cx.is_first() {
            self.said.raise(self.hello);
        }
        while let Some(event) = self.heard.take() {
            log::note(cx.clock(), format!("{} heard {event}", cx.name()));
            if event == self.hello {
                self.said.raise(self.echo);
            }
        }
    }
}

#[test]
fn events_go_to_the_platform_and_through_connections() {
    let b = bench(Library::new("test").with::<Talker>("Talker"));
    b.create("a", "Talker", "fast", &[]);
    b.create("b", "Talker", "events", &[]);
    b.connect("a.said", "b.heard", Policy::Data);
    b.connect("b.said", "a.heard", Policy::Buffer(2));
    b.start(&["b"]);
    b.wait(MS);
    b.start(&["a"]);
    b.wait(MS * 3);
    let pairs =
        |list: &[(&str, &str)]| list.iter().map(|(e, c)| ((*e).to_owned(), (*c).to_owned())).collect::<Vec<_>>();
    assert_eq!(b.raised(), pairs(&[("e_hello", "b"), ("e_hello", "a"), ("e_echo", "a"), ("e_echo", "b")]));
    let heard = log::take(&b.clock);
    assert_eq!(heard.len(), 4, "{heard:?}");
}

#[test]
fn properties_are_set_while_it_runs() {
    let b = bench(library());
    b.create("probe", "Probe", "fast", &[]);
    b.start(&["probe"]);
    b.wait(MS * 5 + MS / 2);
    assert_eq!(log::take(&b.clock).len(), 6);
    b.set("probe.note", false);
    b.wait(MS * 5);
    assert_eq!(log::take(&b.clock).len(), 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Writer and reader run in threads of their own, on the real clock, while they are connected, disconnected, written
    /// to, stopped and started: no value is torn, and none goes backwards through one connection.
    #[test]
    fn changes_under_load(changes in prop::collection::vec(0_u8..6, 20..120)) {
        let b = bench_on(Clock::real(), library());
        b.create("counter", "Counter", "fast", &[]);
        b.create("probe", "Probe", "events", &[("note", Value::Bool(false))]);
        // Never idle: it wakes itself.
        b.create("relay", "Relay", "events", &[]);
        b.connect("relay.y", "relay.u", Policy::Data);
        b.connect("counter.y", "probe.u", Policy::Data);
        b.start(&["counter", "probe"]);
        let mut connected = false;
        for change in changes {
            match change {
                0 | 1 if connected => { b.disconnect("counter.wide", "probe.wide"); connected = false; }
                0 | 1 => { b.connect("counter.wide", "probe.wide", Policy::Data); connected = true; }
                2 => { b.go("probe", Wanted::Stopped); }
                3 => { b.start(&["probe"]); }
                4 => b.set("probe.note", false),
                _ => {
                    b.go("counter", Wanted::Stopped);
                    b.start(&["counter"]);
                }
            }
        }
        prop_assert_eq!(b.faults(), []);
        b.clock.shutdown();
        log::take(&b.clock);
    }
}
