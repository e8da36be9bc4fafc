//! The evaluator against the definitions, over random conditions, samples and times. `DAVIT_LAW_CASES` sets how many.

use crate::naive::{History, STEPS};
use crate::support::*;
use davit::model::monitor::*;
use davit::model::*;
use davit::monitor::Bank;
use proptest::prelude::*;
use std::time::Duration;

fn cases() -> ProptestConfig {
    let cases = std::env::var("DAVIT_LAW_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(10_000);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}

fn name() -> impl Strategy<Value = &'static str> {
    prop_oneof![3 => Just("A.x"), 2 => Just("A.y")]
}

fn ns(range: std::ops::Range<u64>) -> impl Strategy<Value = Duration> {
    range.prop_map(Duration::from_nanos)
}

fn signal() -> impl Strategy<Value = MonitoredSignal> {
    let leaf = prop_oneof![
        5 => name().prop_map(port),
        1 => (-3..4_i32).prop_map(|v| constant(f64::from(v))),
        1 => (name(), ns(1..9)).prop_map(|(n, over)| {
            MonitoredSignal::new(SignalKind::Rate { port: MemberRef::new(n).unwrap(), over })
        }),
    ];
    leaf.prop_recursive(2, 4, 2, |inner| {
        let two = || (inner.clone(), inner.clone()).prop_map(|(a, b)| vec![a, b]);
        prop_oneof![
            two().prop_map(SignalKind::Norm),
            two().prop_map(SignalKind::Min),
            two().prop_map(SignalKind::Max),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| SignalKind::Difference(a.into(), b.into())),
            inner.clone().prop_map(|s| SignalKind::Abs(s.into())),
        ]
        .prop_map(MonitoredSignal::new)
    })
}

fn condition() -> impl Strategy<Value = Condition> {
    use ConditionKind as K;
    let op = || prop::sample::select(Comparison::WORDS.to_vec()).prop_map(|(_, op)| op);
    let bound = prop_oneof![3 => (-3..4_i32).prop_map(f64::from), 1 => (0..4_i32).prop_map(|v| f64::from(v) * 2.5e8)];
    let leaf = prop_oneof![
        6 => (signal(), op(), bound, proptest::option::of(0..3_u32)).prop_map(|(left, op, v, h)| K::Compare {
            left,
            op,
            right: constant(v),
            hysteresis: h.filter(|_| op.is_ordered()).map(f64::from),
        }),
        1 => (name(), op(), 0..7_u32).prop_map(|(n, op, v)| K::Compare {
            left: MonitoredSignal::new(SignalKind::Age(MemberRef::new(n).unwrap())),
            op,
            right: constant(f64::from(v) * 1e-9),
            hysteresis: None,
        }),
        1 => name().prop_map(|n| K::IsTrue(n.parse().unwrap())),
        1 => Just(K::Faulted(ComponentName::new("A").unwrap())),
        1 => (name(), ns(1..7)).prop_map(|(n, time)| K::Silent { port: MemberRef::new(n).unwrap(), time }),
    ];
    leaf.prop_map(Condition::new).prop_recursive(4, 10, 2, |inner| {
        let one = || inner.clone().prop_map(Box::new);
        let interval = || {
            (ns(0..7), proptest::option::of(ns(0..7)))
                .prop_map(|(a, length)| Interval { from: a, to: length.map(|length| a + length) })
        };
        prop_oneof![
            2 => proptest::collection::vec(inner.clone(), 2..3).prop_map(K::All),
            2 => proptest::collection::vec(inner.clone(), 2..3).prop_map(K::Any),
            2 => one().prop_map(K::No),
            1 => (one(), one()).prop_map(|(a, b)| K::Implies(a, b)),
            2 => one().prop_map(K::Rise),
            2 => one().prop_map(K::Fall),
            3 => (one(), interval()).prop_map(|(condition, interval)| K::Once { condition, interval }),
            3 => (one(), interval()).prop_map(|(condition, interval)| K::Historically { condition, interval }),
            5 => (one(), one(), interval()).prop_map(|(hold, from, interval)| K::Since { hold, from, interval }),
            2 => (one(), ns(1..9)).prop_map(|(condition, time)| K::ForAtLeast { condition, time }),
            2 => (one(), ns(1..9)).prop_map(|(condition, time)| K::WithinLast { condition, time }),
            // The same condition in several places, as one with a name stands in a file: it has one history there.
            2 => (one(), ns(1..9)).prop_map(|(condition, time)| {
                let lasts = Condition::new(K::ForAtLeast { condition: condition.clone(), time });
                let (hold, interval) = (Condition::new(K::No(condition.clone())), Interval { from: time, to: None });
                let since = K::Since { hold: hold.into(), from: lasts.clone().into(), interval };
                K::Any(vec![*condition, lasts, Condition::new(since)])
            }),
        ]
        .prop_map(Condition::new)
    })
}

/// A look at the inputs: how long after the one before it, and what was written meanwhile.
#[derive(Debug, Clone)]
struct Look {
    gap: u64,
    /// Of each port: value, and how long before the look.
    writes: [Option<(f64, u64)>; 2],
    fault: Option<bool>,
}

fn looks() -> impl Strategy<Value = Vec<Look>> {
    let value = prop_oneof![8 => (-3..4_i32).prop_map(f64::from), 1 => Just(f64::NAN)];
    let write = (value, prop_oneof![3 => Just(0_u64), 1 => 0..5_u64]);
    let write = || proptest::option::weighted(0.5, write.clone());
    let look = (1..5_u64, write(), write(), proptest::option::weighted(0.2, any::<bool>()))
        .prop_map(|(gap, x, y, fault)| Look { gap, writes: [x, y], fault });
    proptest::collection::vec(look, 1..10)
}

proptest! {
    #![proptest_config(cases())]

    /// Verdict, robustness and events are those of the definitions, at every look.
    #[test]
    fn as_defined(condition in condition(), looks in looks(), awake in any::<bool>()) {
        let mut rig = Rig::of(Bank::new(&[monitor(condition.clone())]));
        let mut history = History::default();
        let mut now = 10;
        let mut last: Option<u64> = None;
        for look in &looks {
            now += look.gap;
            if awake && last.is_some() {
                // Also where nothing came; it must make no difference.
                while let Some(wake) = rig.bank.next_wake().filter(|w| w.0 < now) {
                    prop_assert!(wake.0 > last.unwrap(), "woken for the past");
                    rig.step(wake.0);
                    last = Some(wake.0);
                }
            }
            history.start = if last.is_none() { now } else { history.start };
            for (i, name) in ["A.x", "A.y"].into_iter().enumerate() {
                let Some((value, before)) = look.writes[i] else { continue };
                let stamp = (now - before).max(history.ports[i].last().map_or(0, |(_, at, _)| *at));
                // It counts from its stamp, or right behind the last look.
                let from = match last {
                    None => now as usize * STEPS,
                    Some(last) => (stamp as usize * STEPS).max(last as usize * STEPS + 1),
                };
                history.ports[i].push((from, stamp, value));
                if rig.bank.inputs().iter().any(|input| input.to_string() == name) {
                    rig.write(name, stamp, value);
                }
            }
            if let Some(fault) = look.fault {
                history.faults.push((now as usize * STEPS, fault));
                if rig.bank.inputs().iter().any(|input| input.to_string() == "faulted(A)") {
                    rig.write("faulted A", 0, f64::from(u8::from(fault)));
                }
            }
            rig.step(now);
            last = Some(now);
            let defined = history.evaluate(&condition, now as usize * STEPS);
            let expected = defined[defined.len() - 1];
            let found = (rig.bank.is_true(0), rig.bank.robustness(0));
            prop_assert_eq!(found, (Some(expected.holds), Some(expected.robustness)), "at {}", now);
            // Soundness.
            prop_assert!(expected.robustness <= 0.0 || expected.holds);
            prop_assert!(expected.robustness >= 0.0 || !expected.holds);
            let mut raised = Vec::new();
            let mut before = false;
            for grade in &defined {
                if grade.holds != before {
                    raised.push(if grade.holds { "e_on" } else { "e_off" });
                }
                before = grade.holds;
            }
            let found: Vec<&str> = rig.raised.iter().map(|(_, _, event)| event.as_str()).collect();
            prop_assert_eq!(found, raised, "at {}", now);
        }
        prop_assert_eq!(rig.bank.troubles().merged, 0);
    }
}
