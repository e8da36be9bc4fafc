//! Activities: periods, overruns, faults, threads.

use crate::support::*;
use davit::model::*;
use davit::platform::{Cause, Outcome, Platform};
use davit::runtime::*;
use davit::time::Clock;
use std::time::Duration;

/// Takes its time, or panics, when it is told to.
struct Slow {
    takes_ms: Prop<i64>,
    panics: Prop<bool>,
    faults: Prop<bool>,
}

impl Component for Slow {
    fn new(b: &mut Builder<Self>) -> Self {
        Self {
            takes_ms: b.property("takes_ms", 0),
            panics: b.property("panics", false),
            faults: b.property("faults", false),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        log::note(cx.clock(), format!("{} {} dt {}", cx.name(), cx.now().as_nanos() / 1_000_000, cx.dt() * 1e3));
        // What is missed is no part of it: 10 ms, and 1 ms where a thread is looked for.
        assert!([0.01, 0.001].contains(&cx.period()), "{}", cx.period());
        let takes = self.takes_ms.get();
        if takes < 0 {
            cx.clock().hang();
        }
        cx.clock().sleep(MS * u32::try_from(takes).unwrap());
        assert!(!self.panics.get(), "on purpose");
        if self.faults.get() {
            cx.fault("cannot go on");
        }
    }
}

fn library() -> Library {
    Library::new("test").with::<Slow>("Slow")
}

#[test]
fn a_period_is_kept_and_what_is_missed_is_counted() {
    let b = bench(library());
    b.create("s", "Slow", "slow", &[]);
    b.start(&["s"]);
    b.wait(MS * 25);
    assert_eq!(log::take(&b.clock), ["s 0 dt 10", "s 10 dt 10", "s 20 dt 10"]);
    b.set("s.takes_ms", 25);
    b.wait(MS * 50);
    b.set("s.takes_ms", 0);
    b.wait(MS * 30);
    // The round at 30 lasts until 55: 40 and 50 are missed; the next, at 60, until 85; then 90, 100, in phase.
    assert_eq!(log::take(&b.clock), ["s 30 dt 10", "s 60 dt 30", "s 90 dt 30", "s 100 dt 10"]);
    let status = &b.platform.activities()[0];
    assert_eq!((status.cycles, status.overruns), (7, 4));
    assert_eq!((status.latency_max, status.duration_max), (Duration::ZERO, MS * 25));
    assert_eq!((status.components, status.running, status.stuck), (1, 1, None));
}

/// Between two rounds is what their `dt` says: whoever bounds what it changes in one does not do it twice at once.
#[test]
fn behind_a_long_operation_comes_one_round_for_all_that_is_missed() {
    let b = bench(library());
    b.create("s", "Slow", "slow", &[]);
    b.start(&["s"]);
    b.wait(MS * 12);
    let stall = davit::model::Injection::Stall { time: MS * 25, operation: None };
    b.platform.inject(name("s"), &stall, b.clock.now() + MS * 5).unwrap();
    b.wait(MS * 33);
    assert_eq!(log::take(&b.clock), ["s 0 dt 10", "s 10 dt 10", "s 37 dt 20", "s 40 dt 10"]);
    assert_eq!(b.platform.activities()[0].overruns, 1);
}

#[test]
fn a_panic_in_an_update_faults_that_component_and_nothing_else() {
    let b = bench(library());
    for n in ["a", "b", "c"] {
        b.create(n, "Slow", "slow", &[]);
    }
    b.start(&["a", "b", "c"]);
    b.wait(MS);
    b.set("b.panics", true);
    b.set("c.faults", true);
    b.wait(MS * 10);
    log::take(&b.clock);
    b.wait(MS * 10);
    assert_eq!(log::take(&b.clock), ["a 20 dt 10"]);
    let faults = b.faults();
    assert_eq!(faults[1], ("c".into(), "cannot go on".into()));
    assert!(faults[0].0 == "b" && faults[0].1.starts_with("on purpose (tests/runtime/activities.rs:"), "{faults:?}");
    assert_eq!(b.state_of("b"), Some(RunState::Faulted));
    // It can be taken up again.
    b.set("b.panics", false);
    b.start(&["b"]);
    b.wait(MS * 10);
    assert_eq!(log::take(&b.clock), ["a 30 dt 10", "b 30 dt 10"]);
}

#[test]
fn a_stop_waits_for_the_update_under_way() {
    let b = bench(library());
    b.create("s", "Slow", "slow", &[("takes_ms", Value::Int(8))]);
    b.start(&["s"]);
    b.wait(MS * 12);
    b.go("s", Wanted::Stopped);
    let stopped = b.clock.now().as_nanos() / 1_000_000;
    assert!((18..20).contains(&stopped), "the update lasts from 10 to 18; stopped at {stopped}");
}

#[test]
fn an_update_that_hangs_puts_the_component_in_quarantine_and_names_the_activity() {
    let b = bench(library());
    b.create("s", "Slow", "slow", &[("takes_ms", Value::Int(-1))]);
    b.create("t", "Slow", "slow", &[]);
    b.start(&["s", "t"]);
    b.wait(Duration::from_secs(2));
    assert_eq!(b.platform.activities()[0].stuck, Some(name("s")));
    let stop = Step::State { component: name("s"), transition: Transition::Stop };
    assert_eq!(b.run(&stop), Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.platform.quarantined(), [name("s")]);
    assert_eq!(b.raised(), [("slow.stuck".into(), "s".into())]);
    assert_eq!(b.run(&stop), Outcome::NotDone(Cause::Quarantined));
    // Its neighbour can still be taken down.
    for transition in [Transition::Stop, Transition::Cleanup] {
        b.does(Step::State { component: name("t"), transition });
    }
    b.does(Step::Destroy { component: name("t") });
    b.clock.shutdown();
}

#[test]
fn an_update_that_comes_back_late_is_cleaned_up() {
    let b = bench(library());
    b.create("s", "Slow", "slow", &[("takes_ms", Value::Int(3_000))]);
    b.start(&["s"]);
    b.wait(MS);
    let stop = Step::State { component: name("s"), transition: Transition::Stop };
    assert_eq!(b.run(&stop), Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.state_of("s"), Some(RunState::Stopped));
    b.wait(Duration::from_secs(3));
    assert_eq!((b.returned(), b.platform.quarantined()), (vec!["s".into()], vec![]));
    assert_eq!(b.state_of("s"), None);
    b.create("s", "Slow", "slow", &[]);
    b.start(&["s"]);
}

/// Threads of this process whose names begin so (the operating system knows fifteen letters of them).
fn threads(prefix: &str) -> usize {
    let tasks = std::fs::read_dir("/proc/self/task").expect("Linux");
    tasks
        .flatten()
        .filter(|task| std::fs::read_to_string(task.path().join("comm")).is_ok_and(|name| name.starts_with(prefix)))
        .count()
}

#[test]
fn no_thread_is_left_behind() {
    for clock in [Clock::simulated(), Clock::real()] {
        let guard = clock.enter();
        let activity = Activity { period: Some(MS), priority: 0, cpu: None, origin: Origin::NONE };
        let libraries = Libraries::new().with(library());
        let own = [(ident("lonely"), activity)].into();
        let platform = davit::platform::embedded::EmbeddedPlatform::new(&clock, &libraries, &own);
        let run =
            |step: Step| assert_eq!(platform.execute(&step, clock.now() + MS * 1000), Outcome::Done(None), "{step}");
        for round in 0..3 {
            let component = name("s");
            let ty = TypeName::new("Slow").unwrap();
            let properties = vec![Value::Bool(false), Value::Bool(false), Value::Int(0)];
            run(Step::Create { component, ty, activity: Some(ident("lonely")), properties });
            run(Step::State { component, transition: Transition::Configure });
            if round == 0 {
                assert_eq!(threads("davit-lonely"), 0, "there is none before something runs");
            }
            run(Step::State { component, transition: Transition::Start });
            while platform.activities()[0].cycles == 0 {
                clock.sleep(MS);
            }
            assert!(threads("davit-lonely") >= 1);
            run(Step::State { component, transition: Transition::Stop });
            run(Step::State { component, transition: Transition::Cleanup });
            if round < 2 {
                run(Step::Destroy { component });
            }
        }
        drop(platform);
        assert_eq!(threads("davit-lonely"), 0);
        log::take(&clock);
        drop(guard);
    }
}

#[test]
fn a_refused_priority_is_a_complaint_and_no_error() {
    let clock = Clock::real();
    let activity = Activity { period: Some(MS), priority: 0, cpu: Some(100_000), origin: Origin::NONE };
    let libraries = Libraries::new().with(library());
    let platform =
        davit::platform::embedded::EmbeddedPlatform::new(&clock, &libraries, &[(ident("odd"), activity)].into());
    let run = |step: Step| assert_eq!(platform.execute(&step, clock.now() + MS * 1000), Outcome::Done(None), "{step}");
    let (component, ty) = (name("s"), TypeName::new("Slow").unwrap());
    let properties = vec![Value::Bool(false), Value::Bool(false), Value::Int(0)];
    run(Step::Create { component, ty, activity: Some(ident("odd")), properties });
    run(Step::State { component, transition: Transition::Configure });
    run(Step::State { component, transition: Transition::Start });
    while platform.activities()[0].cycles == 0 {
        clock.sleep(MS);
    }
    let complaint = platform.activities()[0].complaint.clone().expect("a complaint");
    assert!(complaint.contains("CPU 100000"), "{complaint}");
    drop(platform);
    log::take(&clock);
}
