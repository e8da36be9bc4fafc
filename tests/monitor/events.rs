//! When events are raised, to the nanosecond; what is defined about times, samples and switching.

use crate::support::*;
use davit::model::monitor::*;
use davit::model::*;
use davit::monitor::{Bank, InputSample};
use davit::time::Time;

fn c(kind: ConditionKind) -> Condition {
    Condition::new(kind)
}

fn boxed(condition: Condition) -> Box<Condition> {
    Box::new(condition)
}

fn for_at_least(condition: Condition, time: u64) -> Condition {
    c(ConditionKind::ForAtLeast { condition: boxed(condition), time: ms(time) })
}

fn within_last(condition: Condition, time: u64) -> Condition {
    c(ConditionKind::WithinLast { condition: boxed(condition), time: ms(time) })
}

fn silent(port: &str, time: u64) -> Condition {
    c(ConditionKind::Silent { port: MemberRef::new(port).unwrap(), time: ms(time) })
}

#[test]
fn for_at_least_is_exact_and_needs_the_history() {
    let mut rig = Rig::new(&[monitor(for_at_least(above("A.x", 1.0), 300))]);
    rig.sample("A.x", 0, 5.0);
    assert_eq!(rig.bank.next_wake(), Some(Time(300 * MS)));
    rig.step(300 * MS - 1);
    assert_eq!(rig.bank.is_true(0), Some(false));
    rig.step(300 * MS);
    rig.sample("A.x", 500 * MS, 0.0);
    rig.sample("A.x", 600 * MS, 2.0);
    rig.sample("A.x", 900 * MS - 1, 0.0);
    rig.sample("A.x", 1000 * MS, 2.0);
    rig.sample("A.x", 1300 * MS, 0.0);
    rig.run(2000 * MS);
    assert_eq!(rig.events(), ["300000000 e_on", "500000000 e_off"]);
}

#[test]
fn within_last_ends_exactly() {
    let mut rig = Rig::new(&[monitor(within_last(above("A.x", 1.0), 100))]);
    rig.sample("A.x", 0, 0.0);
    rig.sample("A.x", 10 * MS, 5.0);
    rig.sample("A.x", 20 * MS, 0.0);
    rig.run(500 * MS);
    // The last instant at which it was above lies before 20 ms.
    assert_eq!(rig.events(), ["10000000 e_on", "120000000 e_off"]);
}

#[test]
fn a_rise_is_an_instant() {
    let rise = c(ConditionKind::Rise(boxed(above("A.x", 1.0))));
    let mut rig = Rig::new(&[monitor(rise.clone()), monitor(within_last(rise, 100))]);
    rig.sample("A.x", 0, 0.0);
    rig.sample("A.x", 10 * MS, 5.0);
    rig.sample("A.x", 11 * MS, 6.0);
    rig.run(500 * MS);
    let of = |m: usize| rig.raised.iter().filter(|r| r.1 == m).map(|r| (r.0, r.2.as_str())).collect::<Vec<_>>();
    assert_eq!(of(0), [(10 * MS, "e_on"), (10 * MS + 1, "e_off")]);
    // The window is closed: 100 ms after the instant it still counts, just behind it not any more.
    assert_eq!(of(1), [(10 * MS, "e_on"), (110 * MS + 1, "e_off")]);
    let fall = c(ConditionKind::Fall(boxed(above("A.x", 1.0))));
    let mut rig = Rig::new(&[monitor(fall)]);
    for (at, v) in [(0, 5.0), (1, 5.0), (2, 0.0), (3, 0.0), (4, f64::NAN), (5, 3.0), (6, f64::NAN)] {
        rig.sample("A.x", at * MS, v);
    }
    rig.run(10 * MS);
    assert_eq!(rig.events(), ["2000000 e_on", "2000001 e_off", "6000000 e_on", "6000001 e_off"]);
}

#[test]
fn what_is_true_from_the_beginning_has_risen() {
    let rise = c(ConditionKind::Rise(boxed(above("A.x", 1.0))));
    let mut rig = Rig::new(&[monitor(rise), monitor(above("A.x", 1.0))]);
    rig.sample("A.x", 7, 2.0);
    assert_eq!(rig.events(), ["7 e_on", "7 e_on"]);
}

#[test]
fn silence_is_noticed_without_any_sample() {
    let mut rig = Rig::new(&[monitor(silent("A.x", 100))]);
    rig.step(5 * MS);
    rig.run(300 * MS);
    rig.write("A.x", 300 * MS, f64::NAN);
    rig.step(300 * MS);
    rig.run(400 * MS);
    assert_eq!(rig.bank.is_true(0), Some(false), "exactly as long is not more");
    rig.run(401 * MS);
    assert_eq!(rig.events(), ["105000001 e_on", "300000000 e_off", "400000001 e_on"]);
}

#[test]
fn a_late_step_sees_what_was_written_meanwhile() {
    let mut rig = Rig::new(&[monitor(silent("A.x", 100)), monitor(for_at_least(above("A.x", 1.0), 50))]);
    rig.sample("A.x", 0, 0.0);
    rig.write("A.x", 60 * MS, 2.0);
    rig.step(130 * MS);
    assert_eq!(rig.bank.is_true(0), Some(false));
    // It was above for 70 ms: counted from the sample, not from the step.
    assert_eq!(rig.events(), ["130000000 e_on"]);
    assert_eq!(rig.raised[0].1, 1);
}

#[test]
fn hysteresis_keeps_what_began() {
    let when = c(ConditionKind::Compare {
        left: port("A.x"),
        op: Comparison::Above,
        right: constant(8.0),
        hysteresis: Some(2.0),
    });
    let mut rig = Rig::new(&[monitor(when)]);
    let mut seen = Vec::new();
    for (i, v) in [7.0, 8.0, 8.5, 7.0, 6.5, 6.0, 7.0, 9.0, f64::NAN, 7.0].into_iter().enumerate() {
        rig.sample("A.x", i as u64 * MS, v);
        seen.push((rig.bank.is_true(0).unwrap(), rig.bank.robustness(0).unwrap()));
    }
    let robust = [-1.0, 0.0, 2.5, 1.0, 0.5, -2.0, -1.0, 3.0, f64::NEG_INFINITY, -1.0];
    let truth = [false, false, true, true, true, false, false, true, false, false];
    assert_eq!(seen, truth.into_iter().zip(robust).collect::<Vec<_>>());
}

#[test]
fn the_event_is_repeated_while_true() {
    let mut m = monitor(above("A.x", 1.0));
    m.repeat = Some(ms(10));
    let mut rig = Rig::new(&[m]);
    rig.sample("A.x", 5 * MS, 2.0);
    rig.sample("A.x", 12 * MS, 3.0);
    rig.run(26 * MS);
    rig.sample("A.x", 35 * MS, 0.0);
    rig.run(90 * MS);
    let times = ["5000000 e_on", "15000000 e_on", "25000000 e_on", "35000000 e_off"];
    assert_eq!(rig.events(), times, "at 35 ms it is over");
    // Missed times count as one, and the beat goes on.
    rig.raised.clear();
    rig.sample("A.x", 100 * MS, 2.0);
    rig.step(147 * MS);
    rig.run(151 * MS);
    assert_eq!(rig.events(), ["100000000 e_on", "147000000 e_on", "150000000 e_on"]);
}

/// Who looks at ticks sees at the second of two that it has ended: no beat was due between them.
#[test]
fn what_has_ended_between_two_ticks_is_not_repeated_at_the_second() {
    let mut m = monitor(above("A.x", 1.0));
    m.sampling = Sampling::Every(ms(10));
    m.repeat = Some(ms(7));
    let mut rig = Rig::new(&[m]);
    rig.sample("A.x", 0, 2.0);
    rig.run(5 * MS);
    rig.sample("A.x", 5 * MS, 0.0);
    rig.run(40 * MS);
    assert_eq!(rig.events(), ["0 e_on", "10000000 e_off"]);
}

#[test]
fn switching_forgets_the_history() {
    let mut m = monitor(for_at_least(above("A.x", 1.0), 100));
    m.enabled = false;
    let mut rig = Rig::new(&[m, monitor(within_last(above("A.x", 1.0), 1000))]);
    rig.sample("A.x", 0, 2.0);
    rig.run(200 * MS);
    assert_eq!((rig.bank.is_true(0), rig.bank.robustness(0)), (None, None));
    rig.bank.enable(0, true, Time(200 * MS));
    assert_eq!(rig.bank.next_wake(), Some(Time(200 * MS)));
    rig.run(299 * MS);
    assert_eq!(rig.bank.is_true(0), Some(false));
    rig.run(300 * MS);
    assert_eq!(rig.bank.is_true(0), Some(true));
    // Off: nothing more is said; on again: as new.
    rig.bank.enable(0, false, Time(310 * MS));
    rig.run(320 * MS);
    rig.bank.enable(0, true, Time(320 * MS));
    rig.bank.enable(0, true, Time(330 * MS));
    rig.run(419 * MS);
    assert_eq!(rig.bank.is_true(0), Some(false));
    rig.run(420 * MS);
    rig.write("A.x", 430 * MS, 0.0);
    rig.step(430 * MS);
    rig.bank.enable(1, false, Time(431 * MS));
    rig.bank.enable(1, true, Time(431 * MS));
    rig.step(431 * MS);
    assert_eq!(rig.bank.is_true(1), Some(false), "it has not been above within what is remembered");
    let of = |m: usize| rig.raised.iter().filter(|r| r.1 == m).map(|r| r.0 / MS).collect::<Vec<_>>();
    assert_eq!(of(0), [300, 420, 430]);
}

#[test]
fn no_number_makes_every_comparison_false() {
    for (_, op) in Comparison::WORDS.iter().copied() {
        let mut rig = Rig::new(&[monitor(compare(port("A.x"), op, 1.0))]);
        rig.step(0);
        let nothing = (Some(false), Some(f64::NEG_INFINITY));
        assert_eq!((rig.bank.is_true(0), rig.bank.robustness(0)), nothing, "{op:?} before the first sample");
        rig.sample("A.x", MS, f64::NAN);
        assert_eq!((rig.bank.is_true(0), rig.bank.robustness(0)), nothing, "{op:?} of NaN");
        assert_eq!(rig.bank.troubles().not_numbers, 1);
        rig.sample("A.x", 2 * MS, 1.0);
        assert_eq!(rig.bank.robustness(0), Some(0.0));
        assert_eq!(
            rig.bank.is_true(0),
            Some(matches!(op, Comparison::AtMost | Comparison::AtLeast | Comparison::Equals))
        );
        // The component is destroyed.
        let i = rig.input("A.x");
        rig.samples[i] = InputSample::default();
        rig.step(3 * MS);
        assert_eq!((rig.bank.is_true(0), rig.bank.robustness(0)), nothing, "{op:?} of a port that is gone");
    }
    let mut rig = Rig::new(&[monitor(compare(
        MonitoredSignal::new(SignalKind::Max(vec![port("A.x"), port("A.y")])),
        Comparison::Above,
        1.0,
    ))]);
    rig.write("A.x", 0, 5.0);
    rig.step(0);
    assert_eq!(rig.bank.is_true(0), Some(false), "one of them has no value yet");
}

#[test]
fn time_that_goes_backwards_stands_still_and_is_counted() {
    let mut rig = Rig::new(&[monitor(for_at_least(above("A.x", 1.0), 100))]);
    rig.sample("A.x", 100 * MS, 2.0);
    rig.step(50 * MS);
    assert_eq!(rig.bank.troubles().backwards, 1);
    rig.step(199 * MS);
    assert_eq!(rig.bank.is_true(0), Some(false));
    rig.step(200 * MS);
    assert_eq!(rig.bank.is_true(0), Some(true));
    // A sample older than the one before it, and one from the future.
    rig.write("A.x", 20 * MS, 3.0);
    rig.step(210 * MS);
    rig.write("A.x", 999 * MS, 3.0);
    rig.step(220 * MS);
    assert_eq!(rig.bank.troubles().backwards, 3);
    rig.step(230 * MS);
    assert_eq!((rig.bank.troubles().backwards, rig.bank.is_true(0)), (3, Some(true)), "each sample counts once");
}

#[test]
fn a_monitor_at_a_rate_looks_at_its_ticks_only() {
    let mut m = monitor(above("A.x", 1.0));
    m.sampling = Sampling::Every(ms(10));
    let mut rig = Rig::new(&[m]);
    rig.write("A.x", 3 * MS, 0.0);
    rig.step(3 * MS);
    assert_eq!(rig.bank.next_wake(), Some(Time(13 * MS)));
    rig.sample("A.x", 5 * MS, 2.0);
    rig.sample("A.x", 7 * MS, 0.0);
    rig.sample("A.x", 20 * MS, 2.0);
    rig.step(22 * MS);
    assert!(rig.raised.is_empty());
    rig.run(23 * MS);
    rig.step(57 * MS);
    assert_eq!(rig.bank.next_wake(), Some(Time(63 * MS)), "ticks keep their beat");
    assert_eq!(rig.events(), ["23000000 e_on"]);
}

#[test]
fn rates_count_samples_in_their_time() {
    let rate = MonitoredSignal::new(SignalKind::Rate { port: MemberRef::new("A.x").unwrap(), over: ms(100) });
    let mut rig = Rig::new(&[monitor(compare(rate, Comparison::Below, 25.0))]);
    rig.write("A.x", 0, 0.0);
    rig.step(0);
    for i in 1..=20 {
        rig.sample("A.x", i * 20 * MS, 0.0);
    }
    // Five samples in 100 ms: 50/s. The last ones leave at 480 and 500 ms.
    assert_eq!(rig.bank.robustness(0), Some(-25.0));
    rig.run(1000 * MS);
    assert_eq!(rig.events(), ["460000000 e_on"], "two of five are left");
    assert_eq!(rig.bank.robustness(0), Some(25.0));
}

#[test]
fn states_faults_and_counters() {
    let arm = ComponentName::new("Arm").unwrap();
    let control = Ident::new("control").unwrap();
    let overruns = MonitoredSignal::new(SignalKind::Activity { activity: control, counter: Counter::Overruns });
    let all = [
        monitor(c(ConditionKind::InState { component: arm, state: RunState::Running })),
        monitor(c(ConditionKind::Faulted(arm))),
        monitor(compare(overruns, Comparison::Above, 3.0)),
        monitor(c(ConditionKind::IsTrue("Arm.ready".parse().unwrap()))),
    ];
    let mut rig = Rig::new(&all);
    rig.step(0);
    let verdicts = |rig: &Rig| (0..4).map(|i| rig.bank.is_true(i).unwrap()).collect::<Vec<_>>();
    assert_eq!(verdicts(&rig), [false; 4]);
    rig.write("state Arm", 0, davit::monitor::state_value(RunState::Running));
    rig.write("faulted Arm", 0, 1.0);
    rig.write("control overruns", 0, 4.0);
    rig.write("Arm.ready", 0, 1.0);
    rig.step(MS);
    assert_eq!(verdicts(&rig), [true; 4]);
    assert_eq!(rig.bank.robustness(0), Some(f64::INFINITY));
    rig.write("state Arm", 0, davit::monitor::state_value(RunState::Stopped));
    rig.write("faulted Arm", 0, 0.0);
    rig.write("Arm.ready", 2 * MS, 0.0);
    rig.step(2 * MS);
    assert_eq!(verdicts(&rig), [false, false, true, false]);
}

/// A ramp keeps every piece of its window: the memory is bounded, the verdict errs to false only, and it is counted.
#[test]
fn memory_is_bounded_and_merging_raises_nothing() {
    let conditions = [
        within_last(above("A.x", 0.0), 1000),
        c(ConditionKind::No(boxed(c(ConditionKind::Historically {
            condition: boxed(above("A.x", 500.0)),
            interval: Interval { from: ms(300), to: Some(ms(900)) },
        })))),
    ];
    for condition in conditions {
        let all = [monitor(condition)];
        let (mut exact, mut small) = (Rig::new(&all), Rig::of(Bank::with_memory(&all, 8)));
        let mut differ = 0;
        for i in 0..4000_u64 {
            // Down for two seconds, then up: the slow ramps that keep most.
            let v = if i < 2000 { 1000.0 - i as f64 } else { i as f64 - 3000.0 };
            for rig in [&mut exact, &mut small] {
                rig.write("A.x", i * MS, v);
                rig.step(i * MS);
            }
            let (a, b) = (exact.bank.robustness(0).unwrap(), small.bank.robustness(0).unwrap());
            assert!(b <= a, "{i}: {b} is more than {a}");
            assert!(exact.bank.is_true(0).unwrap() || !small.bank.is_true(0).unwrap());
            differ += u32::from(a != b);
        }
        assert!(differ > 0 && small.bank.troubles().merged > 100);
        assert_eq!(exact.bank.troubles().merged, 0);
    }
}

/// However long it lasts, what was merged again and again lies within a bounded time of what it was: the verdict is that
/// of a window whose ends lie that much further in; what waits to enter a window counts as its least in that time.
#[test]
fn merging_shifts_the_ends_of_windows_by_a_bounded_time() {
    const MEMORY: u64 = 64;
    let past = |from: u64, to: u64| {
        c(ConditionKind::Once {
            condition: boxed(above("A.x", 0.0)),
            interval: Interval { from: ms(from), to: Some(ms(to)) },
        })
    };
    // Four parts in `MEMORY` of what the older end lies back; and of what the newer one does, in which the signal below
    // changes by no more than nine a millisecond.
    let waits = 4 * 500 / MEMORY + 1;
    let cases = [
        (within_last(above("A.x", 0.0), 1000), within_last(above("A.x", 0.0), 1000 - 4 * 1000 / MEMORY - 1), 0.0),
        (past(500, 1000), past(500, 1000 - 4 * 1000 / MEMORY - 1), (9 * waits) as f64),
    ];
    for (full, short, slack) in cases {
        let (full, short) = ([monitor(full)], [monitor(short)]);
        let memory = usize::try_from(MEMORY).unwrap();
        let (mut exact, mut shorter, mut small) =
            (Rig::new(&full), Rig::new(&short), Rig::of(Bank::with_memory(&full, memory)));
        for i in 0..20_000_u64 {
            let phase = i % 5000;
            let v = if phase < 4500 { -(phase as f64) } else { (phase as f64 - 4500.0) * 9.0 - 4500.0 };
            for rig in [&mut exact, &mut shorter, &mut small] {
                rig.write("A.x", i * MS, v);
                rig.step(i * MS);
            }
            let robustness = |rig: &Rig| rig.bank.robustness(0).unwrap();
            let (most, least, is) = (robustness(&exact), robustness(&shorter), robustness(&small));
            assert!(least - slack <= is && is <= most, "at {i} ms: {is} is not from {least} to {most}");
        }
        assert!(small.bank.troubles().merged > 1000);
    }
}

/// A sample rate counts each sample, and none for longer than four parts in its memory of its time.
#[test]
fn a_sample_rate_with_little_memory_counts_a_bounded_time_too_long() {
    let rate = |seconds: u64| {
        let rate =
            MonitoredSignal::new(SignalKind::Rate { port: MemberRef::new("A.x").unwrap(), over: ms(seconds * 1000) });
        [monitor(compare(rate, Comparison::Above, 0.0))]
    };
    let big = |monitors: &[Monitor]| Rig::of(Bank::with_memory(monitors, 1 << 16));
    // 34 s: 32 s and four parts in 64 of it.
    let (short, long) = (rate(32), rate(34));
    let (mut exact, mut longer, mut small) = (big(&short), big(&long), Rig::of(Bank::with_memory(&short, 64)));
    for i in 0..100_000_u64 {
        // 1,000 a second, 10 a second after the 60th.
        if i < 60_000 || i % 100 == 0 {
            for rig in [&mut exact, &mut longer, &mut small] {
                rig.write("A.x", i * MS, 0.0);
            }
        }
        for rig in [&mut exact, &mut longer, &mut small] {
            rig.step(i * MS);
        }
        if i > 34_000 {
            let count = |rig: &Rig, seconds: f64| (rig.bank.robustness(0).unwrap() * seconds).round();
            let (least, most, is) = (count(&exact, 32.0), count(&longer, 34.0), count(&small, 32.0));
            assert!(least <= is && is <= most, "at {i} ms: {is} is not from {least} to {most}");
        }
    }
    assert!(small.bank.troubles().merged > 1000);
}

/// Where a condition holds at an instant only, what must hold since begins right behind it.
#[test]
fn since_an_instant() {
    let rise = || boxed(c(ConditionKind::Rise(boxed(above("A.x", 1.0)))));
    let since = c(ConditionKind::Since {
        hold: boxed(c(ConditionKind::No(rise()))),
        from: rise(),
        interval: Interval { from: ms(0), to: Some(ms(100)) },
    });
    let mut rig = Rig::new(&[monitor(since)]);
    rig.sample("A.x", 0, 0.0);
    rig.sample("A.x", 10 * MS, 5.0);
    rig.sample("A.x", 20 * MS, 0.0);
    rig.run(500 * MS);
    // The interval is closed: the instant counts up to 100 ms after it.
    assert_eq!(rig.events(), ["10000000 e_on", "110000001 e_off"]);
}
