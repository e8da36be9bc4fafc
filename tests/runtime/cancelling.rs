//! Calls that are given up, in what only this runtime has: activities with their queues, tickets, operations beside them.

use crate::support::*;
use davit::model::*;
use davit::platform::{Cause, Outcome, Platform};
use davit::runtime::*;
use davit::time::{Receiver, Time};
use std::time::Duration;

/// Moves something in every update until it is told, or notices that it is given up.
struct Mover {
    task: Option<Ticket<i64>>,
    moved: i64,
    deaf: Prop<bool>,
}

impl Component for Mover {
    fn new(b: &mut Builder<Self>) -> Self {
        b.operation("go", |this: &mut Self, cx, (): ()| {
            this.task = Some(cx.ticket());
            OperationAnswer::<i64>::Pending
        });
        b.operation("arrive", |this: &mut Self, _, (): ()| {
            if let Some(ticket) = this.task.take() {
                ticket.done(this.moved);
            }
            OperationAnswer::Done(())
        });
        b.operation("grind", |this: &mut Self, cx, (ms,): (i64,)| {
            for _ in 0..ms {
                if cx.is_cancelled() && !this.deaf.get() {
                    return OperationAnswer::Done(this.moved);
                }
                this.moved += 1;
                cx.clock().sleep(MS);
            }
            OperationAnswer::Done(-1)
        });
        b.operation("far", |this: &mut Self, _, (): ()| OperationAnswer::Done(this.moved));
        b.operation("note", |_, cx, (what,): (String,)| {
            log::note(cx.clock(), what);
            OperationAnswer::Done(())
        });
        b.operation("hang", |_, cx, (): ()| -> OperationAnswer { cx.clock().hang() });
        b.operation("fall", |_, cx, (): ()| -> OperationAnswer {
            while !cx.is_cancelled() {
                cx.clock().sleep(MS);
            }
            panic!("on purpose")
        });
        b.caller_operation("brake", |(): ()| OperationAnswer::Done(()));
        Self { task: None, moved: 0, deaf: b.property("deaf", false) }
    }

    fn update(&mut self, _: &mut Context) {
        if let Some(ticket) = &self.task {
            if ticket.is_cancelled() && !self.deaf.get() {
                self.task = None;
            } else {
                self.moved += 1;
            }
        }
    }
}

fn running() -> Bench {
    let b = bench(Library::new("test").with::<Mover>("Mover"));
    b.create("m", "Mover", "fast", &[]);
    b.create("n", "Mover", "fast", &[]);
    b.start(&["m", "n"]);
    b.wait(MS);
    b
}

fn go() -> Step {
    call("m.go", vec![])
}

fn note(what: &str) -> Step {
    call("m.note", vec![Value::str(what)])
}

impl Bench {
    /// Another thread carries the step out; what it answers, and when.
    fn begin(&self, step: &Step, limit: Duration) -> Receiver<(Outcome, Time)> {
        let (answer, answered) = self.clock.channel(1);
        let (platform, clock, step) = (self.platform.clone(), self.clock.clone(), step.clone());
        let deadline = self.clock.now() + limit;
        self.clock.spawn("another", move || {
            let outcome = platform.execute(&step, deadline);
            let _ = answer.try_send((outcome, clock.now()));
        });
        self.wait(Duration::ZERO);
        answered
    }

    fn far(&self) -> Option<Value> {
        self.does(call("m.far", vec![]))
    }

    fn safe(&self, step: &Step) -> Outcome {
        self.platform.execute_safe(step, self.clock.now() + Duration::from_secs(1))
    }
}

const SECOND: Duration = Duration::from_secs(1);

#[test]
fn what_takes_many_updates_ends_in_the_next_one() {
    let b = running();
    let going = b.begin(&go(), SECOND * 10);
    b.wait(MS * 20);
    let told = b.clock.now();
    b.platform.cancel(&go());
    let (outcome, at) = going.recv_deadline(told + SECOND).unwrap();
    assert_eq!(outcome, Outcome::Done(None));
    assert!(at.since(told) <= MS, "{:?}", at.since(told));
    let there = b.far();
    b.wait(MS * 20);
    assert_eq!(b.far(), there, "it stands");
}

#[test]
fn code_that_works_for_long_looks_whether_it_is_given_up() {
    for state in [Wanted::Stopped, Wanted::Running] {
        let b = running();
        b.go("m", state);
        let grind = call("m.grind", vec![Value::Int(500)]);
        let grinding = b.begin(&grind, SECOND);
        b.wait(MS * 20);
        b.platform.cancel(&grind);
        b.wait(MS * 2);
        let (outcome, _) = grinding.try_recv().expect("it looked");
        // What it answers is told: it came back by itself.
        assert!(
            matches!(outcome, Outcome::Done(Some(Value::Int(n))) if (15..=25).contains(&n)),
            "{state}: {outcome:?}"
        );
    }
}

#[test]
fn what_waits_in_the_activity_is_taken_back_at_once() {
    let b = running();
    let _hanging = b.begin(&call("n.grind", vec![Value::Int(900)]), SECOND * 2);
    b.wait(MS);
    let waiting = b.begin(&note("never"), SECOND * 2);
    b.wait(MS * 10);
    let before = b.clock.now();
    b.platform.cancel(&note("never"));
    assert_eq!(waiting.recv_deadline(before + SECOND).unwrap(), (Outcome::NotDone(Cause::Cancelled), before));
    b.wait(SECOND);
    assert!(log::take(&b.clock).is_empty(), "it never begins");
}

#[test]
fn a_panic_stays_one() {
    let b = running();
    let fall = call("m.fall", vec![]);
    let falling = b.begin(&fall, SECOND);
    b.wait(MS * 10);
    b.platform.cancel(&fall);
    let (outcome, _) = falling.recv_deadline(b.clock.now() + SECOND).unwrap();
    assert!(matches!(outcome, Outcome::NotDone(Cause::Panicked(_))), "{outcome:?}");
    assert_eq!(b.state_of("m"), Some(RunState::Faulted));
    assert_eq!(b.does(note("after")), None, "who is faulted is at rest");
}

#[test]
fn what_is_kept_back_keeps_its_order_and_holds_nobody_else_up() {
    let b = running();
    b.set("m.deaf", true);
    let going = b.begin(&go(), SECOND * 10);
    b.wait(MS * 5);
    b.platform.cancel(&go());
    let waiting: Vec<_> = ["one", "two", "three"].map(|what| b.begin(&note(what), SECOND * 5)).into();
    // One of them is no longer wanted when its turn comes.
    assert_eq!(b.run_within(&note("late"), MS * 10), Outcome::NotDone(Cause::Timeout));
    assert_eq!(b.does(call("n.note", vec![Value::str("neighbour")])), None);
    assert_eq!(b.safe(&note("safe")), Outcome::Done(None));
    assert_eq!(log::take(&b.clock), ["neighbour", "safe"]);
    b.set("m.deaf", false);
    b.wait(MS * 2);
    assert_eq!(going.try_recv().expect("at rest").0, Outcome::Done(None));
    assert_eq!(log::take(&b.clock), ["one", "two", "three"]);
    assert!(waiting.iter().all(|w| w.try_recv().expect("answered").0 == Outcome::Done(None)));
}

#[test]
fn more_than_the_activity_holds_is_refused() {
    let b = running();
    b.set("m.deaf", true);
    let _going = b.begin(&go(), SECOND * 10);
    b.wait(MS * 5);
    b.platform.cancel(&go());
    let waiting: Vec<_> =
        (0..davit::limits::ACTIVITY_REQUESTS).map(|i| b.begin(&note(&i.to_string()), SECOND * 5)).collect();
    b.wait(MS * 5);
    assert!(matches!(b.run(&note("one too many")), Outcome::NotDone(Cause::Refused(_))));
    b.set("m.deaf", false);
    b.wait(MS * 5);
    assert!(waiting.iter().all(|w| w.try_recv().expect("answered").0 == Outcome::Done(None)));
}

#[test]
fn stopping_brings_to_rest() {
    let b = running();
    b.set("m.deaf", true);
    let _going = b.begin(&go(), SECOND * 10);
    b.wait(MS * 5);
    b.platform.cancel(&go());
    let waiting = b.begin(&note("kept back"), SECOND * 5);
    b.wait(MS * 5);
    assert!(waiting.is_empty());
    b.go("m", Wanted::Stopped);
    b.go("n", Wanted::Stopped);
    b.wait(MS);
    assert_eq!(waiting.try_recv().expect("who is not updated is at rest").0, Outcome::Done(None));
    assert_eq!(b.does(note("and on a worker")), None);
}

#[test]
fn who_does_not_rest_is_updated_on_and_lets_only_safe_steps_in() {
    let b = running();
    b.set("m.deaf", true);
    let going = b.begin(&go(), MS * 100);
    b.wait(MS * 20);
    b.platform.cancel(&go());
    assert!(b.platform.quarantined().is_empty());
    assert_eq!(going.recv_deadline(b.clock.now() + SECOND).unwrap().0, Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.platform.quarantined(), [name("m")]);
    assert_eq!(b.state_of("m"), Some(RunState::Running));
    let deaf = |deaf: bool| Step::PropertySet { property: member("m.deaf"), value: Value::Bool(deaf) };
    for step in [go(), note("x"), deaf(false), Step::State { component: name("m"), transition: Transition::Stop }] {
        assert_eq!(b.run(&step), Outcome::NotDone(Cause::Quarantined), "{step}");
    }
    let far = |b: &Bench| match b.safe(&call("m.far", vec![])) {
        Outcome::Done(Some(Value::Int(far))) => far,
        other => panic!("{other:?}"),
    };
    let there = far(&b);
    b.wait(MS * 20);
    assert!((19..=21).contains(&(far(&b) - there)), "it is updated on");
    assert_eq!(b.safe(&deaf(false)), Outcome::Done(None));
    b.wait(MS * 2);
    assert!(b.platform.quarantined().is_empty());
    assert_eq!(b.returned(), ["m"]);
    assert_eq!(b.state_of("m"), Some(RunState::Running), "its code was never lost: it stays");
    let there = b.far();
    b.wait(MS * 20);
    assert_eq!(b.far(), there);
}

#[test]
fn two_restless_calls_are_two() {
    let b = running();
    b.set("m.deaf", true);
    let grind = call("m.grind", vec![Value::Int(400)]);
    let going = b.begin(&go(), MS * 100);
    b.wait(MS);
    // Both under way at once: one in later updates, one inside.
    let grinding = b.begin(&grind, SECOND * 2);
    b.wait(MS * 10);
    b.platform.cancel(&go());
    b.platform.cancel(&grind);
    assert_eq!(going.recv_deadline(b.clock.now() + SECOND).unwrap().0, Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.platform.quarantined(), [name("m")]);
    assert!(matches!(grinding.recv_deadline(b.clock.now() + SECOND).unwrap().0, Outcome::Done(_)));
    assert_eq!(b.platform.quarantined(), [name("m")], "the other one has not come to rest");
    b.safe(&Step::PropertySet { property: member("m.deaf"), value: Value::Bool(false) });
    b.wait(MS * 2);
    assert!(b.platform.quarantined().is_empty());
    assert_eq!(b.does(note("again")), None);
}

#[test]
fn a_brake_works_on_a_component_whose_call_never_returns() {
    let b = running();
    let hang = call("m.hang", vec![]);
    let hanging = b.begin(&hang, MS * 100);
    b.wait(MS * 20);
    b.platform.cancel(&hang);
    assert_eq!(b.safe(&call("m.brake", vec![])), Outcome::Done(None));
    assert_eq!(hanging.recv_deadline(b.clock.now() + SECOND).unwrap().0, Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.platform.quarantined(), [name("m")]);
    assert_eq!(b.safe(&call("m.brake", vec![])), Outcome::Done(None));
    assert_eq!(b.run(&call("m.brake", vec![])), Outcome::NotDone(Cause::Quarantined));
    // Its code is not to be called any more, for nobody.
    assert_eq!(b.safe(&note("x")), Outcome::NotDone(Cause::Quarantined));
    b.clock.shutdown();
}

#[test]
fn what_makes_and_configures_is_taken_back_only_before_it_begins() {
    let b = running();
    let create = Step::Create {
        component: name("k"),
        ty: TypeName::new("Mover").unwrap(),
        activity: None,
        properties: vec![Value::Bool(false)],
    };
    b.platform.cancel(&create);
    b.does(create.clone());
    b.platform.cancel(&create);
    assert_eq!(b.state_of("k"), Some(RunState::Unconfigured));
}

#[test]
fn giving_up_races_with_answering() {
    // On the real clock: whatever comes first, there is one answer, and the component is ready for the next call.
    let b = bench_on(davit::time::Clock::real(), Library::new("test").with::<Mover>("Mover"));
    b.create("m", "Mover", "fast", &[]);
    b.start(&["m"]);
    for i in 0..300 {
        let going = b.begin(&go(), SECOND * 10);
        std::thread::yield_now();
        let (platform, step) = (b.platform.clone(), go());
        let told = std::thread::spawn(move || {
            for _ in 0..50 {
                platform.cancel(&step);
                std::thread::yield_now();
            }
        });
        if i % 2 == 0 {
            let _ = b.run(&call("m.arrive", vec![]));
        }
        told.join().unwrap();
        // One that came before the call reached the platform was lost.
        let until = b.clock.now() + SECOND * 5;
        let (outcome, _) = loop {
            b.platform.cancel(&go());
            match going.recv_deadline(b.clock.now() + MS) {
                Ok(answer) => break answer,
                Err(why) => assert!(b.clock.now() < until, "no answer: {why}"),
            }
        };
        let fine = matches!(outcome, Outcome::Done(_) | Outcome::NotDone(Cause::Cancelled));
        assert!(fine, "{outcome:?}");
        assert_eq!(b.does(call("m.note", vec![Value::str("ready")])), None);
        assert!(b.platform.quarantined().is_empty());
    }
}
