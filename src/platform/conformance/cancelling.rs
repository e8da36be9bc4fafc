//! Rules of calls that are given up while they are under way.

use super::bed::{Bed, BedTrouble};
use super::trial::{RuleEnds, Trial, ends, has_heard, holds, is, is_not_done, is_unknown, same_system};
use super::words::*;
use crate::model::{Step, Transition, Value};
use crate::platform::{Cause, Outcome, PlatformEvent};

/// A component `bad` whose operation `work` is in trouble, not running and running.
fn each_way(bed: &dyn Bed, trouble: BedTrouble, f: impl Fn(Trial) -> RuleEnds) -> RuleEnds {
    [false, true].into_iter().try_for_each(|running| {
        let t = Trial::of(bed, &[("work", trouble)]);
        t.does(create_misbehaving())?;
        if running {
            t.all([state("bad", Transition::Configure), state("bad", Transition::Start)])?;
        }
        f(t)
    })
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

pub fn a_call_that_is_given_up_comes_to_rest_and_counts_as_done(bed: &dyn Bed) -> RuleEnds {
    each_way(bed, BedTrouble::Long, |t| {
        let long = t.times.work * 6;
        let working = t.begin(&work(), long);
        t.wait(t.times.limit);
        let told = t.now();
        t.cancel(&work())?;
        let (outcome, at) = working.ended(told + long)?;
        // It answered an error; but something of it has happened, and that is to be taken back.
        ends("`bad.work`, given up", &outcome, &Outcome::Done(None))?;
        let (rest, took) = (t.times.rest, at.since(told));
        holds(took <= rest, "`bad.work`, given up", format_args!("at rest within {rest:?}"), format_args!("{took:?}"))?;
        t.quarantines("`bad.work`, given up", &[])?;
        t.does(nothing())?;
        // And again: being given up is no lasting state.
        let working = t.begin(&work(), long);
        let (outcome, _) = working.ended(t.now() + t.times.work + t.times.limit)?;
        ends("`bad.work` once more", &outcome, &Outcome::Done(None))
    })
}

pub fn giving_up_what_is_not_under_way_does_nothing(bed: &dyn Bed) -> RuleEnds {
    each_way(bed, BedTrouble::Long, |t| {
        let before = t.see()?;
        for step in [work(), call("nobody.work", vec![]), state("bad", Transition::Stop)] {
            t.cancel(&step)?;
        }
        same_system("giving up what is not under way", &t.see()?, &before)?;
        let (began, long) = (t.now(), t.times.work * 6);
        let working = t.begin(&work(), long);
        t.wait(t.times.limit);
        // Something else of the same component, the same of another, another argument.
        for other in [nothing(), call("a.work", vec![]), call("bad.work", vec![Value::Int(1)]), brake()] {
            t.cancel(&other)?;
        }
        let (outcome, at) = working.ended(began + long)?;
        ends("`bad.work` while others are given up", &outcome, &Outcome::Done(None))?;
        let (work_takes, took) = (t.times.work, at.since(began));
        let expected = format!("it takes {work_takes:?}, since it was not given up");
        holds(took >= work_takes, "`bad.work` while others are given up", expected, format_args!("{took:?}"))?;
        // It is over.
        t.cancel(&work())?;
        t.does(nothing()).map(drop)
    })
}

pub fn a_failure_before_being_told_stays_one(bed: &dyn Bed) -> RuleEnds {
    each_way(bed, BedTrouble::Fail, |t| {
        let working = t.begin(&work(), t.times.work * 6);
        t.wait(t.times.limit);
        t.cancel(&work())?;
        let (outcome, _) = working.ended(t.deadline())?;
        let failed = |outcome: &Outcome| matches!(outcome, Outcome::NotDone(Cause::Failed(_)));
        is("`bad.work`, which had failed", &outcome, "not done, since the component failed", failed)
    })
}

pub fn what_has_no_ear_goes_on_when_it_is_given_up(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[("configure", BedTrouble::Hang(None))]);
    t.does(create_misbehaving())?;
    let configure = state("bad", Transition::Configure);
    let (began, limit) = (t.now(), t.times.limit);
    let configuring = t.begin(&configure, limit);
    t.wait(limit / 2);
    t.cancel(&configure)?;
    let (outcome, at) = configuring.ended(began + limit * 60)?;
    let with = "`configure bad`, which hangs and is given up";
    is_unknown(with, &outcome)?;
    let deadline = began + limit;
    holds(at >= deadline, with, format_args!("no answer before {deadline}"), format_args!("one at {at}"))
}

pub fn until_it_rests_a_component_begins_no_other_operation(bed: &dyn Bed) -> RuleEnds {
    each_way(bed, BedTrouble::Deaf, |t| {
        let (began, long, rest) = (t.now(), t.times.work * 6, t.times.rest);
        let working = t.begin(&work(), long);
        t.wait(t.times.limit);
        t.cancel(&work())?;
        // A call that waits is not begun by its deadline, and can be taken back.
        let meanwhile = "`bad.nothing` before `bad.work` has come to rest";
        ends(meanwhile, &t.run(&nothing())?, &Outcome::NotDone(Cause::Timeout))?;
        let waiting = t.begin(&nothing(), long);
        t.wait(t.times.limit / 10);
        t.cancel(&nothing())?;
        let (outcome, _) = waiting.ended(t.now() + rest)?;
        ends("`bad.nothing`, taken back while it waits", &outcome, &Outcome::NotDone(Cause::Cancelled))?;
        // The others begin when it has come to rest.
        let first = t.begin(&call("bad.echo", vec![Value::Int(1)]), long);
        let second = t.begin(&nothing(), long);
        let (outcome, at) = working.ended(began + long)?;
        ends("`bad.work`, which comes to its end", &outcome, &Outcome::Done(None))?;
        for waited in [first, second] {
            let (outcome, then) = waited.ended(began + long)?;
            let with = "an operation behind `bad.work`";
            ends(with, &outcome, &Outcome::Done(None))?;
            let expected = format!("it ends between {at} and {}", at + rest);
            holds(at <= then && then.since(at) <= rest, with, expected, then)?;
        }
        Ok(())
    })
}

pub fn what_is_safe_runs_beside_a_call_that_does_not_rest(bed: &dyn Bed) -> RuleEnds {
    each_way(bed, BedTrouble::Deaf, |t| {
        let began = t.now();
        let working = t.begin(&work(), t.times.limit * 4);
        t.wait(t.times.limit);
        t.cancel(&work())?;
        let brakes = |with: &str| {
            let asked = t.now();
            ends(with, &t.run_safe(&brake())?, &Outcome::Done(None))?;
            let (rest, took) = (t.times.rest, t.now().since(asked));
            holds(took <= rest, with, format_args!("within {rest:?}"), format_args!("{took:?}"))
        };
        brakes("`bad.brake`, safe, beside `bad.work`")?;
        let (outcome, _) = working.ended(began + t.times.work)?;
        is_unknown("`bad.work`, which does not rest", &outcome)?;
        brakes("`bad.brake`, safe, in quarantine")
    })
}

pub fn a_component_that_does_not_rest_is_quarantined_until_it_does(bed: &dyn Bed) -> RuleEnds {
    each_way(bed, BedTrouble::Deaf, |t| {
        let heard = t.listen()?;
        let (began, limit, late) = (t.now(), t.times.limit, t.times.late);
        let working = t.begin(&work(), limit * 4);
        t.wait(limit);
        t.cancel(&work())?;
        t.quarantines("`bad.work`, given up and before its deadline", &[])?;
        let (outcome, _) = working.ended(began + limit * 4 + late)?;
        let with = "`bad.work`, which does not rest";
        is_unknown(with, &outcome)?;
        t.quarantines(with, &["bad"])?;
        for step in [nothing(), work(), destroy("bad")] {
            is_not_done(format_args!("`{step}` in quarantine"), &t.run(&step)?)?;
        }
        t.wait(t.times.work);
        t.quarantines("`bad.work`, when it has come to rest", &[])?;
        let it =
            |e: &PlatformEvent| matches!(e, PlatformEvent::Returned { component, .. } if *component == name("bad"));
        has_heard(with, &heard, "that `bad` has returned", it)?;
        match t.state_of("bad")? {
            None => Ok(()),
            Some(_) => t.does(nothing()).map(drop),
        }
    })
}
