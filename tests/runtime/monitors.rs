//! Monitors as a component: what they see of others, also of those that come and go.

use crate::support::*;
use davit::libraries::monitors;
use davit::model::monitor::*;
use davit::model::*;
use davit::platform::PlatformEvent;
use davit::runtime::{Builder, Component, Context, Out, Prop};
use std::time::Duration;

davit::record! {
    /// Something with parts.
    #[derive(Copy)]
    pub struct Reading {
        /// Numbers.
        pub q: [f64; 2],
        /// A flag.
        pub ok: bool,
    }
}

/// Writes its level in every update.
struct Source {
    level: Prop<f64>,
    y: Out<f64>,
    reading: Out<Reading>,
}

impl Component for Source {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { level: b.property("level", 0.0), y: b.output("y"), reading: b.output("reading") }
    }

    fn update(&mut self, _: &mut Context) {
        let level = self.level.get();
        self.y.write(level);
        self.reading.write(Reading { q: [0.0, level], ok: level > 1.0 });
    }
}

fn signal(text: &str) -> PortSignal {
    text.parse().unwrap()
}

fn above(text: &str, limit: f64) -> Condition {
    let side = |kind| MonitoredSignal { kind, origin: Origin::NONE };
    Condition::new(ConditionKind::Compare {
        left: side(SignalKind::Port(signal(text))),
        op: Comparison::Above,
        right: side(SignalKind::Constant(limit)),
        hysteresis: None,
    })
}

fn monitor(name: &str, when: Condition, enabled: bool) -> Monitor {
    Monitor {
        raise: Some(EventName::new(&format!("e_{name}")).unwrap()),
        cleared: Some(EventName::new(&format!("e_no_{name}")).unwrap()),
        enabled,
        ..Monitor::new(ident(name), when)
    }
}

fn bed(list: &[Monitor]) -> Bench {
    let clock = davit::time::Clock::simulated();
    let library = davit::runtime::Library::new("test").with::<Source>("Source");
    bench_with(clock, [library, monitors::library(list)])
}

fn set(b: &Bench, property: &str, value: Value) {
    b.does(Step::PropertySet { property: member(property), value });
}

/// The events raised since the last call, with the milliseconds they were raised at.
fn raised(b: &Bench) -> Vec<String> {
    let events = std::mem::take(&mut *b.events.lock().unwrap());
    events
        .into_iter()
        .filter_map(|event| match event {
            PlatformEvent::Raised { event, .. } => Some(event.to_string()),
            _ => None,
        })
        .collect()
}

#[test]
fn a_monitor_sees_ports_it_is_not_connected_to() {
    let held = Condition::new(ConditionKind::ForAtLeast {
        condition: Box::new(above("s.reading.q[1]", 2.0)),
        time: Duration::from_millis(30),
    });
    let b = bed(&[
        monitor("high", above("s.y", 2.0), true),
        monitor("held", held, true),
        monitor("flag", Condition::new(ConditionKind::IsTrue(signal("s.reading.ok"))), true),
    ]);
    b.create("watch", MONITORS_TYPE, "fast", &[]);
    b.create("s", "Source", "fast", &[]);
    b.start(&["watch", "s"]);
    b.clock.sleep(20 * MS);
    assert_eq!(raised(&b), [""; 0]);
    set(&b, "s.level", Value::Float(3.0));
    b.clock.sleep(20 * MS);
    assert_eq!(raised(&b), ["e_high", "e_flag"]);
    b.clock.sleep(20 * MS);
    assert_eq!(raised(&b), ["e_held"]);
    set(&b, "s.level", Value::Float(1.0));
    b.clock.sleep(5 * MS);
    assert_eq!(raised(&b), ["e_no_high", "e_no_held", "e_no_flag"]);
}

#[test]
fn enabling_is_a_property_and_forgets() {
    let b = bed(&[monitor("high", above("s.y", 2.0), false)]);
    b.create("s", "Source", "fast", &[("level", Value::Float(3.0))]);
    b.create("watch", MONITORS_TYPE, "fast", &[]);
    b.start(&["s", "watch"]);
    b.clock.sleep(20 * MS);
    assert_eq!(raised(&b), [""; 0]);
    for _ in 0..3 {
        set(&b, "watch.high", Value::Bool(true));
        b.clock.sleep(5 * MS);
        assert_eq!(raised(&b), ["e_high"]);
        set(&b, "watch.high", Value::Bool(false));
        b.clock.sleep(5 * MS);
        assert_eq!(raised(&b), [""; 0]);
    }
}

#[test]
fn a_monitor_that_is_switched_off_says_no_and_names_do_not_clash() {
    let echo = Condition::new(ConditionKind::IsTrue(signal("watch.is_high")));
    // These two would have a port of one name if it were built the other way round.
    let odd = ["is_a", "a_robustness"].map(|name| monitor(name, above("s.y", 100.0), true));
    let list = [vec![monitor("high", above("s.y", 2.0), true), monitor("echo", echo, true)], odd.to_vec()].concat();
    let b = bed(&list);
    b.create("s", "Source", "fast", &[("level", Value::Float(3.0))]);
    b.create("watch", MONITORS_TYPE, "fast", &[]);
    b.start(&["s", "watch"]);
    b.clock.sleep(10 * MS);
    assert_eq!(raised(&b), ["e_high", "e_echo"]);
    set(&b, "watch.high", Value::Bool(false));
    b.clock.sleep(10 * MS);
    assert_eq!(raised(&b), ["e_no_echo"], "the monitor itself says nothing, its port does");
}

#[test]
fn what_is_watched_may_go_and_come_back() {
    let gone = Condition::new(ConditionKind::Silent { port: member("s.y"), time: Duration::from_millis(10) });
    let b = bed(&[
        monitor("high", above("s.y", 2.0), true),
        monitor("gone", gone, true),
        monitor(
            "runs",
            Condition::new(ConditionKind::InState { component: name("s"), state: RunState::Running }),
            true,
        ),
    ]);
    b.create("watch", MONITORS_TYPE, "fast", &[]);
    b.start(&["watch"]);
    for _ in 0..3 {
        b.create("s", "Source", "slow", &[("level", Value::Float(3.0))]);
        b.start(&["s"]);
        b.clock.sleep(25 * MS);
        let mut came = raised(&b);
        came.retain(|event| !event.contains("gone"));
        came.sort();
        assert_eq!(came, ["e_high", "e_runs"]);
        b.go("s", Wanted::Unconfigured);
        b.does(Step::Destroy { component: name("s") });
        b.clock.sleep(25 * MS);
        let went = raised(&b);
        assert!(went.contains(&"e_no_high".to_owned()), "{went:?}");
        assert!(went.contains(&"e_no_runs".to_owned()), "{went:?}");
        assert!(went.contains(&"e_gone".to_owned()), "{went:?}");
    }
}

#[test]
fn an_in_port_is_seen_through_its_connection() {
    let b = bed(&[monitor("high", above("g.u", 2.0), true)]);
    b.create("s", "Source", "fast", &[("level", Value::Float(3.0))]);
    b.create("g", "standard.Gain", "fast", &[]);
    b.create("watch", MONITORS_TYPE, "fast", &[]);
    b.start(&["s", "g", "watch"]);
    b.clock.sleep(5 * MS);
    assert_eq!(raised(&b), [""; 0]);
    b.connect("s.y", "g.u", Policy::Data);
    b.clock.sleep(5 * MS);
    assert_eq!(raised(&b), ["e_high"]);
    b.disconnect("s.y", "g.u");
    b.clock.sleep(5 * MS);
    assert_eq!(raised(&b), ["e_no_high"]);
}

#[test]
fn counters_of_activities_are_seen() {
    let side = |kind| MonitoredSignal { kind, origin: Origin::NONE };
    let counted = Condition::new(ConditionKind::Compare {
        left: side(SignalKind::Activity { activity: ident("slow"), counter: Counter::Cycles }),
        op: Comparison::AtLeast,
        right: side(SignalKind::Constant(5.0)),
        hysteresis: None,
    });
    let b = bed(&[monitor("five", counted, true)]);
    b.create("watch", MONITORS_TYPE, "fast", &[]);
    b.create("s", "Source", "slow", &[]);
    b.start(&["watch", "s"]);
    b.clock.sleep(30 * MS);
    assert_eq!(raised(&b), [""; 0]);
    b.clock.sleep(30 * MS);
    assert_eq!(raised(&b), ["e_five"]);
}

#[test]
fn in_an_event_driven_activity_a_write_wakes_it() {
    let b = bed(&[monitor("high", above("s.y", 2.0), true)]);
    b.create("s", "Source", "slow", &[]);
    b.create("watch", MONITORS_TYPE, "events", &[]);
    b.start(&["s", "watch"]);
    b.clock.sleep(15 * MS);
    set(&b, "s.level", Value::Float(3.0));
    b.clock.sleep(15 * MS);
    assert_eq!(raised(&b), ["e_high"]);
}
