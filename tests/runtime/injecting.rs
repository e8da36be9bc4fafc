//! Faults put straight into components: declared ones, in the middle of operations too, and those that every component knows.

use crate::support::*;
use davit::model::*;
use davit::platform::{Cause, Outcome, Platform};
use davit::runtime::*;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A drive whose motion takes twenty updates.
struct Drive {
    motion: Option<(u32, Ticket)>,
    hot: Option<i64>,
    updates: Out<i64>,
    count: i64,
}

impl Component for Drive {
    fn new(b: &mut Builder<Self>) -> Self {
        b.operation("go", |c: &mut Self, cx, (): ()| {
            c.motion = Some((0, cx.ticket()));
            OperationAnswer::<()>::Pending
        });
        b.operation("quick", |_, _, (): ()| OperationAnswer::Done(()));
        b.caller_operation("beside", |(): ()| OperationAnswer::Done(()));
        b.doc("A motor is too hot.").parameter("joint", Some(1_i64)).injection(
            "overtemp",
            |c: &mut Self, _, (joint,): (i64,)| {
                if joint > 4 {
                    return Err(Failure("there are joints 0 to 4".to_owned()));
                }
                c.hot = Some(joint);
                Ok(())
            },
        );
        Self { motion: None, hot: None, updates: b.output("updates"), count: 0 }
    }

    fn update(&mut self, _: &mut Context) {
        self.count += 1;
        self.updates.write(self.count);
        if let Some((done, ticket)) = self.motion.take() {
            match self.hot {
                Some(joint) => ticket.failed(format!("joint {joint} is hot")),
                None if done == 20 => ticket.done(()),
                None => self.motion = Some((done + 1, ticket)),
            }
        }
    }
}

fn drives() -> Bench {
    let b = bench(Library::new("test").with::<Drive>("Drive"));
    for component in ["a", "b"] {
        b.create(component, "Drive", "fast", &[]);
    }
    b.start(&["a", "b"]);
    b.wait(3 * MS);
    b
}

impl Bench {
    fn inject(&self, component: &str, what: &str, given: &[(&str, Value)]) -> Result<(), String> {
        let ty = self.platform.catalogue().get(TypeName::new("Drive").unwrap()).unwrap().clone();
        let given: Vec<_> = given.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        let injection = Injection::of(&ty, what, &given).expect("it is declared");
        self.platform.inject(name(component), &injection, self.clock.now() + Duration::from_secs(1))
    }

    /// Calls an operation beside this thread.
    fn called(&self, operation: &str, within: Duration) -> Arc<Mutex<Option<Outcome>>> {
        let outcome = Arc::new(Mutex::new(None));
        let (platform, clock, to, step) =
            (self.platform.clone(), self.clock.clone(), outcome.clone(), call(operation, vec![]));
        self.clock.spawn("caller", move || {
            let ended = platform.execute(&step, clock.now() + within);
            *to.lock().unwrap() = Some(ended);
        });
        outcome
    }

    fn rounds(&self) -> (u64, u64) {
        let status = self.platform.activities();
        let fast = status.iter().find(|activity| activity.name.as_str() == "fast").unwrap();
        (fast.cycles, fast.overruns)
    }
}

#[test]
fn what_a_type_declares_happens_in_the_middle_of_an_operation() {
    let b = drives();
    let outcome = b.called("a.go", Duration::from_secs(1));
    b.wait(5 * MS);
    assert_eq!(*outcome.lock().unwrap(), None, "it is under way");
    let before = b.clock.now();
    b.inject("a", "overtemp", &[("joint", Value::Int(3))]).unwrap();
    assert_eq!(b.clock.now(), before, "at once");
    b.wait(2 * MS);
    let failed = Outcome::NotDone(Cause::Failed("joint 3 is hot".to_owned()));
    assert_eq!(*outcome.lock().unwrap(), Some(failed));
    assert_eq!(b.inject("a", "overtemp", &[("joint", Value::Int(5))]), Err("there are joints 0 to 4".to_owned()));
    assert_eq!(b.inject("c", "overtemp", &[]), Err("refused by the platform: there is no component `c`".to_owned()));
}

#[test]
fn one_that_does_not_run_is_reached_too() {
    let b = drives();
    b.go("a", Wanted::Stopped);
    b.inject("a", "overtemp", &[]).unwrap();
    b.start(&["a"]);
    let outcome = b.called("a.go", Duration::from_secs(1));
    b.wait(3 * MS);
    assert_eq!(*outcome.lock().unwrap(), Some(Outcome::NotDone(Cause::Failed("joint 1 is hot".to_owned()))));
}

#[test]
fn a_panic_leaves_it_faulted_and_nothing_else() {
    let b = drives();
    b.inject("a", "panic", &[]).unwrap();
    b.wait(2 * MS);
    assert_eq!(b.faults(), [("a".to_owned(), "a panic was injected".to_owned())]);
    assert_eq!((b.state_of("a"), b.state_of("b")), (Some(RunState::Faulted), Some(RunState::Running)));
    assert!(matches!(
        *{
            let o = b.called("b.quick", MS);
            b.wait(2 * MS);
            o
        }
        .lock()
        .unwrap(),
        Some(Outcome::Done(_))
    ));
}

#[test]
fn a_stall_holds_the_activity_up_for_that_long() {
    let b = drives();
    let (cycles, overruns) = b.rounds();
    b.inject("a", "stall", &[("seconds", Value::Float(0.05))]).unwrap();
    b.wait(100 * MS);
    let (after, missed) = (b.rounds().0 - cycles, b.rounds().1 - overruns);
    assert!((48..=51).contains(&missed) && (49..=52).contains(&after), "{missed} missed, {after} rounds");
    assert_eq!(b.state_of("a"), Some(RunState::Running), "it goes on");
}

#[test]
fn a_stall_of_an_operation_waits_for_its_next_call_and_ends() {
    let b = drives();
    let given = [("seconds", Value::Float(0.05)), ("operation", Value::str("quick"))];
    b.inject("a", "stall", &given).unwrap();
    let cycles = b.rounds().0;
    b.wait(20 * MS);
    assert!(b.rounds().0 - cycles >= 19, "nothing is held up yet");
    let asked = b.clock.now();
    assert!(matches!(b.run_within(&call("a.quick", vec![]), 100 * MS), Outcome::Done(_)));
    assert!((50 * MS..60 * MS).contains(&b.clock.now().since(asked)), "once it is");
    let asked = b.clock.now();
    assert!(matches!(b.run_within(&call("a.quick", vec![]), 100 * MS), Outcome::Done(_)));
    assert!(b.clock.now().since(asked) < 5 * MS, "once only");

    // Behind its deadline it comes back all the same.
    b.inject("a", "stall", &given).unwrap();
    assert_eq!(b.run_within(&call("a.quick", vec![]), 20 * MS), Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.platform.quarantined(), [name("a")]);
    b.wait(50 * MS);
    assert_eq!(b.platform.quarantined(), []);
    assert_eq!(b.state_of("a"), None, "what was given up is taken away when it comes back");
    b.clock.shutdown();
}

#[test]
fn a_hang_leaves_what_is_under_way_unknown() {
    let b = drives();
    let outcome = b.called("a.go", 50 * MS);
    b.wait(5 * MS);
    b.inject("a", "hang", &[]).unwrap();
    b.wait(100 * MS);
    assert_eq!(*outcome.lock().unwrap(), Some(Outcome::Unknown(Cause::Timeout)));
    // Its update is what does not return: whoever shares its activity waits, too.
    b.wait(Duration::from_secs(2));
    let stuck: Vec<_> = b.platform.activities().iter().filter_map(|activity| activity.stuck).collect();
    assert_eq!(stuck, [name("a")]);
    assert_eq!(b.run_within(&call("b.quick", vec![]), 20 * MS), Outcome::NotDone(Cause::Timeout));
    b.clock.shutdown();
}

#[test]
fn a_hang_of_an_operation_waits_for_its_next_call() {
    let b = drives();
    let (cycles, _) = b.rounds();
    let given = [("operation", Value::str("quick"))];
    b.inject("a", "hang", &given).unwrap();
    b.wait(20 * MS);
    assert!(b.rounds().0 - cycles >= 19, "nothing hangs yet");
    assert_eq!(b.run_within(&call("a.quick", vec![]), 20 * MS), Outcome::Unknown(Cause::Timeout));
    assert_eq!(b.platform.quarantined(), [name("a")]);
    let beside = b.inject("b", "hang", &[("operation", Value::str("beside"))]);
    assert_eq!(beside, Err("`beside` runs beside `b`, in the thread of who calls it: it cannot be held up".to_owned()));
    b.clock.shutdown();
}
