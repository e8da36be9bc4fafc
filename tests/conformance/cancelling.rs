//! Rules of calls that are given up while they are under way.

use crate::bed::*;
use davit::model::*;
use davit::platform::{Cause, Outcome, PlatformEvent};
use std::time::Duration;

const SECOND: Duration = Duration::from_secs(1);
/// Longer than [`WORK`].
const LONG: Duration = Duration::from_secs(60);

/// A component `bad` whose operation `work` is in trouble, not running and running.
fn each_way(bed: &dyn Bed, trouble: Trouble, mut f: impl FnMut(Made)) {
    for running in [false, true] {
        let made = bed.make(&[("work", trouble)]);
        made.does(create_misbehaving("bad"));
        if running {
            made.all([state("bad", Transition::Configure), state("bad", Transition::Start)]);
        }
        f(made);
    }
}

fn work() -> Step {
    call("bad.work", vec![])
}

fn nothing() -> Step {
    call("bad.nothing", vec![])
}

fn brake() -> Step {
    call("bad.brake", vec![])
}

pub fn a_call_that_is_given_up_comes_to_rest_and_counts_as_done(bed: &dyn Bed) {
    each_way(bed, Trouble::Long, |made| {
        let working = made.begin(&work(), LONG);
        made.wait(SECOND);
        let told = made.clock.now();
        made.platform.cancel(&work());
        assert_eq!(made.clock.now(), told, "it does not wait");
        let (outcome, at) = working.recv_deadline(told + LONG).expect("an answer");
        // It answered an error; but something of it has happened, and that is to be taken back.
        assert_eq!(outcome, Outcome::Done(None));
        assert!(at.since(told) <= REST, "at rest after {:?}", at.since(told));
        assert!(made.platform.quarantined().is_empty());
        assert_eq!(made.does(nothing()), None);
        // And again: being given up is no lasting state.
        let working = made.begin(&work(), LONG);
        made.wait(WORK + SECOND);
        assert_eq!(working.try_recv().expect("it has ended").0, Outcome::Done(None));
    });
}

pub fn giving_up_what_is_not_under_way_does_nothing(bed: &dyn Bed) {
    each_way(bed, Trouble::Long, |made| {
        let before = made.see();
        made.platform.cancel(&work());
        made.platform.cancel(&call("nobody.work", vec![]));
        made.platform.cancel(&state("bad", Transition::Stop));
        assert_eq!(made.see(), before);
        let began = made.clock.now();
        let working = made.begin(&work(), LONG);
        made.wait(SECOND);
        // Something else of the same component, the same of another, another argument.
        for other in [nothing(), call("a.work", vec![]), call("bad.work", vec![Value::Int(1)]), brake()] {
            made.platform.cancel(&other);
        }
        let (outcome, at) = working.recv_deadline(began + LONG).expect("an answer");
        assert_eq!(outcome, Outcome::Done(None));
        assert!(at.since(began) >= WORK, "it was not given up, and ended after {:?}", at.since(began));
        // It is over.
        made.platform.cancel(&work());
        assert_eq!(made.does(nothing()), None);
    });
}

pub fn a_failure_before_being_told_stays_one(bed: &dyn Bed) {
    each_way(bed, Trouble::Fail, |made| {
        let working = made.begin(&work(), LONG);
        made.wait(SECOND);
        made.platform.cancel(&work());
        let (outcome, _) = working.recv_deadline(made.deadline()).expect("an answer");
        assert!(matches!(outcome, Outcome::NotDone(Cause::Failed(_))), "{outcome:?}");
    });
}

pub fn what_has_no_ear_goes_on_when_it_is_given_up(bed: &dyn Bed) {
    let made = bed.make(&[("configure", Trouble::Hang(None))]);
    made.does(create_misbehaving("bad"));
    let configure = state("bad", Transition::Configure);
    let began = made.clock.now();
    let configuring = made.begin(&configure, SECOND);
    made.wait(SECOND / 2);
    made.platform.cancel(&configure);
    let (outcome, at) = configuring.recv_deadline(began + LONG).expect("an answer");
    assert_eq!(outcome, Outcome::Unknown(Cause::Timeout));
    assert!(at >= began + SECOND, "the deadline stays");
}

pub fn until_it_rests_a_component_begins_no_other_operation(bed: &dyn Bed) {
    each_way(bed, Trouble::Deaf, |made| {
        let began = made.clock.now();
        let working = made.begin(&work(), LONG);
        made.wait(SECOND);
        made.platform.cancel(&work());
        // A call that waits is not begun by its deadline, and can be taken back.
        assert_eq!(made.run(&nothing()), Outcome::NotDone(Cause::Timeout));
        let waiting = made.begin(&nothing(), LONG);
        made.wait(SECOND / 10);
        made.platform.cancel(&nothing());
        made.wait(REST);
        assert_eq!(waiting.try_recv().expect("taken back").0, Outcome::NotDone(Cause::Cancelled));
        // What runs beside the component waits for nobody.
        let now = made.clock.now();
        assert_eq!(made.platform.execute_safe(&brake(), now + SECOND), Outcome::Done(None));
        assert!(made.clock.now().since(now) <= REST);
        // The others begin when it has come to rest.
        let first = made.begin(&call("bad.echo", vec![Value::Int(1)]), LONG);
        let second = made.begin(&nothing(), LONG);
        let (outcome, at) = working.recv_deadline(began + LONG).expect("an answer");
        assert_eq!(outcome, Outcome::Done(None), "it came to its end");
        for waited in [first, second] {
            let (outcome, then) = waited.recv_deadline(began + LONG).expect("an answer");
            assert_eq!(outcome, Outcome::Done(None));
            assert!(at <= then && then.since(at) <= REST, "{then} after {at}");
        }
    });
}

pub fn a_component_that_does_not_rest_is_quarantined_until_it_does(bed: &dyn Bed) {
    each_way(bed, Trouble::Deaf, |made| {
        let heard = made.listen();
        let began = made.clock.now();
        let working = made.begin(&work(), SECOND * 4);
        made.wait(SECOND);
        made.platform.cancel(&work());
        assert!(made.platform.quarantined().is_empty(), "it has until the deadline");
        let (outcome, at) = working.recv_deadline(began + LONG).expect("an answer");
        assert_eq!(outcome, Outcome::Unknown(Cause::Timeout));
        assert!(at.since(began + SECOND * 4) <= REST, "{at}");
        assert_eq!(made.platform.quarantined(), [name("bad")]);
        for step in [nothing(), work(), destroy("bad")] {
            let outcome = made.run(&step);
            assert!(matches!(outcome, Outcome::NotDone(_)), "`{step}` in quarantine: {outcome:?}");
        }
        assert_eq!(made.platform.execute_safe(&brake(), made.deadline()), Outcome::Done(None));
        made.wait(WORK);
        assert!(made.platform.quarantined().is_empty());
        let heard = heard.lock().unwrap();
        assert!(
            heard.iter().any(|e| matches!(e, PlatformEvent::Returned { component, .. } if *component == name("bad"))),
            "{heard:?}"
        );
        if made.state_of("bad").is_some() {
            assert_eq!(made.does(nothing()), None);
        }
    });
}
