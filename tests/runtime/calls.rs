//! Operations and hooks: answers now and later, deadlines, panics, late returns.

use crate::support::*;
use davit::model::*;
use davit::platform::{Cause, Outcome, Platform, StepBatch, TimedStep};
use davit::runtime::*;
use davit::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::Duration;

/// Has operations of every kind.
struct Busy {
    calibration: Option<(u32, Ticket<f64>)>,
    ticks: Prop<i64>,
    update_takes_ms: Prop<i64>,
}

impl Component for Busy {
    fn new(b: &mut Builder<Self>) -> Self {
        let shared = Arc::new(AtomicI64::new(0));
        b.operation("add", |_, _, (a, b): (i64, i64)| OperationAnswer::Done(a + b));
        b.operation("nothing", |_, _, (): ()| OperationAnswer::Done(()));
        b.operation("fail", |_, _, (why,): (String,)| OperationAnswer::<()>::Failed(why));
        b.operation("panic", |_, _, (): ()| -> OperationAnswer { panic!("on purpose") });
        b.operation("hang", |_, cx, (): ()| -> OperationAnswer { cx.clock().hang() });
        b.operation("sleep", |_, cx, (ms,): (i64,)| {
            cx.clock().sleep(MS * u32::try_from(ms).unwrap());
            OperationAnswer::Done(())
        });
        b.operation("calibrate", |this: &mut Self, cx, (): ()| {
            this.calibration = Some((0, cx.ticket()));
            OperationAnswer::<f64>::Pending
        });
        b.operation("forget", |this: &mut Self, _, (): ()| {
            this.calibration = None;
            OperationAnswer::Done(())
        });
        b.operation("careless", |_, _, (): ()| OperationAnswer::<()>::Pending);
        b.caller_operation("count", move |(): ()| OperationAnswer::Done(shared.fetch_add(1, Ordering::SeqCst)));
        b.caller_operation("sleep_beside", |(ms,): (u64,)| {
            // Beside the component; a test may not sleep, but it may take its time.
            OperationAnswer::Done(ms)
        });
        Self { calibration: None, ticks: b.property("ticks", 5), update_takes_ms: b.property("update_takes_ms", 0) }
    }

    fn update(&mut self, cx: &mut Context) {
        let takes = self.update_takes_ms.get();
        cx.clock().sleep(MS * u32::try_from(takes).unwrap());
        let needed = u32::try_from(self.ticks.get()).unwrap();
        if let Some((ticks, ticket)) = self.calibration.take() {
            if ticket.is_cancelled() {
                cx.raise(EventName::new("e_cancelled").unwrap());
            } else if ticks == needed {
                ticket.done(f64::from(ticks));
            } else {
                self.calibration = Some((ticks + 1, ticket));
            }
        }
    }
}

fn library() -> Library {
    Library::new("test").with::<Busy>("Busy").with::<Hooked>("Hooked")
}

fn busy(activity: &str) -> Bench {
    let b = bench(library());
    b.create("c", "Busy", activity, &[]);
    b
}

/// The way to a worker and back is paid once for all of them.
#[test]
fn many_are_made_and_dropped_in_few_hand_overs() {
    let b = bench(library());
    let component = |i| name(&format!("c{i}"));
    let create = |i| Step::Create {
        component: component(i),
        ty: TypeName::new("Busy").unwrap(),
        activity: Some(ident("fast")),
        properties: vec![Value::Int(5), Value::Int(0)],
    };
    let destroy = |i| Step::Destroy { component: component(i) };
    for step in [&create as &dyn Fn(usize) -> Step, &destroy] {
        let timed = |i| TimedStep { step: step(i), patience: MS, until: Time::NEVER };
        let batch = StepBatch::new(b.clock.clone(), (0..200).map(timed).collect());
        assert!(batch.steps().iter().all(|timed| b.platform.batches(&timed.step)));
        let before = b.clock.hand_overs();
        b.platform.execute_batch(&batch);
        let hand_overs = b.clock.hand_overs() - before;
        let answers = batch.take(true);
        assert!(answers.len() == 200 && answers.iter().all(|it| it.outcome == Outcome::Done(None)), "{answers:?}");
        assert!(hand_overs <= 5, "{hand_overs}");
    }
}

#[test]
fn operations_answer_whatever_the_run_state() {
    for activity in ["fast", "events"] {
        let b = busy(activity);
        for state in [Wanted::Unconfigured, Wanted::Stopped, Wanted::Running] {
            b.go("c", state);
            b.wait(MS);
            assert_eq!(b.does(call("c.add", vec![Value::Int(2), Value::Int(3)])), Some(Value::Int(5)), "{state}");
            assert_eq!(b.does(call("c.nothing", vec![])), None);
            let why = Outcome::NotDone(Cause::Failed("no".into()));
            assert_eq!(b.run(&call("c.fail", vec![Value::str("no")])), why);
            assert!(matches!(b.run(&call("c.careless", vec![])), Outcome::NotDone(Cause::Failed(_))));
        }
        assert_eq!(b.does(call("c.count", vec![])), Some(Value::Int(0)));
        assert_eq!(b.does(call("c.count", vec![])), Some(Value::Int(1)));
    }
}

#[test]
fn an_operation_runs_between_two_updates() {
    let b = busy("slow");
    b.set("c.update_takes_ms", 6);
    b.start(&["c"]);
    b.wait(MS * 12);
    b.does(call("c.nothing", vec![]));
    // Asked during the update from 10 to 16 ms: served at its end, not at the next release.
    assert_eq!(b.clock.now().as_nanos(), 16_000_000);
    b.wait(MS * 2);
    b.does(call("c.nothing", vec![]));
    assert_eq!(b.clock.now().as_nanos(), 18_000_000, "between two updates it is served at once");
}

#[test]
fn a_pending_operation_answers_in_a_later_update() {
    let b = busy("fast");
    b.start(&["c"]);
    b.wait(MS / 2);
    let before = b.clock.now();
    assert_eq!(b.does(call("c.calibrate", vec![])), Some(Value::Float(5.0)));
    assert_eq!(b.clock.now().since(before), MS * 5 + MS / 2);
}

#[test]
fn a_pending_operation_that_is_late_is_unknown_and_told_so() {
    let b = busy("fast");
    b.set("c.ticks", 100);
    b.start(&["c"]);
    assert_eq!(b.run_within(&call("c.calibrate", vec![]), MS * 20), Outcome::Unknown(Cause::Timeout));
    assert!(b.platform.quarantined().is_empty(), "it is healthy");
    b.wait(MS * 2);
    assert_eq!(b.raised(), [("e_cancelled".into(), "c".into())]);
    b.set("c.ticks", 1);
    assert_eq!(b.does(call("c.calibrate", vec![])), Some(Value::Float(1.0)));
}

#[test]
fn a_dropped_ticket_is_a_failure() {
    let b = busy("fast");
    b.set("c.ticks", 1_000);
    b.start(&["c"]);
    let clock = b.clock.clone();
    let platform = &b.platform;
    std::thread::scope(|scope| {
        let (ready, up) = clock.channel(1);
        let (done, waiting) = clock.channel(1);
        let other = clock.clone();
        scope.spawn(move || {
            let _guard = other.enter();
            ready.try_send(()).unwrap();
            other.sleep(MS * 30);
            done.try_send(platform.execute(&call("c.forget", vec![]), other.now() + MS * 10)).unwrap();
        });
        // The thread comes up when the operating system likes; simulated time is counted from when it is there.
        up.recv().unwrap();
        let outcome = b.run(&call("c.calibrate", vec![]));
        assert!(matches!(outcome, Outcome::NotDone(Cause::Failed(_))), "{outcome:?}");
        assert_eq!(waiting.recv().unwrap(), Outcome::Done(None));
    });
}

#[test]
fn a_panic_in_an_operation_faults_the_component() {
    for state in [Wanted::Stopped, Wanted::Running] {
        let b = busy("fast");
        b.go("c", state);
        let outcome = b.run(&call("c.panic", vec![]));
        assert!(
            matches!(&outcome, Outcome::NotDone(Cause::Panicked(text)) if text.starts_with("on purpose")),
            "{outcome:?}"
        );
        assert_eq!(b.state_of("c"), Some(RunState::Faulted));
        assert_eq!(b.faults().len(), 1);
        assert!(b.platform.activities().iter().all(|a| a.running == 0));
        b.go("c", Wanted::Running);
    }
}

#[test]
fn an_operation_that_hangs_is_unknown_at_the_deadline() {
    for state in [Wanted::Stopped, Wanted::Running] {
        let b = busy("fast");
        b.go("c", state);
        let before = b.clock.now();
        assert_eq!(b.run(&call("c.hang", vec![])), Outcome::Unknown(Cause::Timeout), "{state}");
        assert_eq!(b.clock.now().since(before), Duration::from_secs(1));
        assert_eq!(b.platform.quarantined(), [name("c")]);
        assert_eq!(b.run(&call("c.nothing", vec![])), Outcome::NotDone(Cause::Quarantined));
        assert_eq!(
            b.raised().len(),
            usize::from(state == Wanted::Running),
            "the activity is stuck only where it hangs"
        );
        b.clock.shutdown();
        b.wait(MS);
        assert_eq!(b.returned(), ["c"], "released by the clock, it has come back");
    }
}

#[test]
fn an_operation_that_never_began_is_not_done() {
    let b = busy("fast");
    b.create("d", "Busy", "fast", &[]);
    b.start(&["c", "d"]);
    b.wait(MS);
    assert_eq!(b.run_within(&call("c.sleep", vec![Value::Int(500)]), MS * 10), Outcome::Unknown(Cause::Timeout));
    // The activity is held up: the call of the other one is not even begun by its deadline.
    assert_eq!(b.run_within(&call("d.nothing", vec![]), MS * 10), Outcome::NotDone(Cause::Timeout));
    b.wait(MS * 500);
    assert_eq!(b.returned(), ["c"]);
    assert_eq!(b.does(call("d.nothing", vec![])), None);
}

/// Notes its hooks; one of them takes the time it is told.
struct Hooked {
    u: In<f64>,
    late: Prop<String>,
    takes_ms: Prop<i64>,
}

impl Component for Hooked {
    fn new(b: &mut Builder<Self>) -> Self {
        b.on_configure(|this, cx| this.hook("configure", cx));
        b.on_start(|this, cx| this.hook("start", cx));
        b.on_stop(|this, cx| this.hook("stop", cx));
        b.on_cleanup(|this, cx| this.hook("cleanup", cx));
        Self { u: b.input("u"), late: b.property("late", String::new()), takes_ms: b.property("takes_ms", 0) }
    }

    fn update(&mut self, _: &mut Context) {
        self.u.get();
    }
}

impl Hooked {
    fn hook(&mut self, hook: &str, cx: &mut Context) -> HookResult {
        log::note(cx.clock(), hook);
        if *self.late.get_ref() == hook {
            cx.clock().sleep(MS * u32::try_from(self.takes_ms.get()).unwrap());
        }
        if self.takes_ms.get() == 7 {
            return Err(Failure::from("seven"));
        }
        Ok(())
    }
}

impl Drop for Hooked {
    fn drop(&mut self) {
        DROPPED.fetch_add(1, Ordering::SeqCst);
    }
}

static DROPPED: AtomicI64 = AtomicI64::new(0);

#[test]
fn a_stop_hook_that_fails_leaves_it_running() {
    let b = bench(library());
    b.create("h", "Hooked", "fast", &[]);
    b.start(&["h"]);
    b.set("h.takes_ms", 7);
    let stop = Step::State { component: name("h"), transition: Transition::Stop };
    assert_eq!(b.run(&stop), Outcome::NotDone(Cause::Failed("seven".into())));
    assert_eq!(b.state_of("h"), Some(RunState::Running));
    assert_eq!(b.platform.activities()[0].running, 1);
    b.set("h.takes_ms", 0);
    b.does(stop);
    assert_eq!(b.platform.activities()[0].running, 0);
    assert_eq!(log::take(&b.clock), ["configure", "start", "stop", "stop"]);
}

#[test]
fn a_hook_that_comes_back_late_leaves_nothing() {
    for (hook, expected) in [
        ("configure", vec!["configure", "cleanup"]),
        ("start", vec!["configure", "start", "cleanup"]),
        ("stop", vec!["configure", "start", "stop", "cleanup"]),
        ("cleanup", vec!["configure", "cleanup"]),
    ] {
        let b = bench(library());
        b.create("source", "standard.Constant", "fast", &[]);
        b.create("h", "Hooked", "fast", &[("late", Value::str(hook)), ("takes_ms", Value::Int(3_000))]);
        b.connect("source.y", "h.u", Policy::Data);
        b.start(&["source"]);
        let path: &[Transition] = match hook {
            "configure" => &[Transition::Configure],
            "start" => &[Transition::Configure, Transition::Start],
            "stop" => &[Transition::Configure, Transition::Start, Transition::Stop],
            _ => &[Transition::Configure, Transition::Cleanup],
        };
        let (last, first) = path.split_last().unwrap();
        for transition in first {
            b.does(Step::State { component: name("h"), transition: *transition });
        }
        let step = Step::State { component: name("h"), transition: *last };
        assert_eq!(b.run(&step), Outcome::Unknown(Cause::Timeout), "{hook}");
        b.wait(Duration::from_secs(3));
        assert_eq!(log::take(&b.clock), expected, "{hook}");
        assert_eq!(b.returned(), ["h"], "{hook}");
        let left = b.platform.observe(b.clock.now()).unwrap();
        assert_eq!(left.components.keys().copied().collect::<Vec<_>>(), [name("source")], "{hook}");
        assert!(left.connections.is_empty() && b.platform.quarantined().is_empty());
        b.go("source", Wanted::Unconfigured);
        b.does(Step::Destroy { component: name("source") });
    }
    assert!(DROPPED.load(Ordering::SeqCst) >= 4);
}

#[test]
fn whoever_has_the_answer_may_call_again() {
    // On the real clock, where caller and worker race.
    let b = bench_on(davit::time::Clock::real(), library());
    b.create("c", "Busy", "fast", &[]);
    for i in 0..2_000 {
        assert_eq!(b.does(call("c.add", vec![Value::Int(i), Value::Int(1)])), Some(Value::Int(i + 1)));
    }
}
