//! Rules of steps that fail, panic, hang, or come too late.

use super::bed::{Bed, BedTrouble};
use super::trial::{RuleEnds, Trial, ends, has_heard, holds, is, is_not_done, is_unknown, same_system};
use super::words::*;
use crate::model::{Policy, RunState, Step, Transition, Value};
use crate::platform::{Cause, Outcome, PlatformEvent};
use {Transition::Cleanup, Transition::Configure, Transition::Start, Transition::Stop};

/// The run state before `hook` is called, and the steps that lead there.
fn up_to(hook: &str) -> (RunState, Vec<Step>) {
    let all = [create_misbehaving(), state("bad", Configure), state("bad", Start)];
    match hook {
        "start" | "cleanup" => (RunState::Stopped, all[..2].to_vec()),
        "stop" => (RunState::Running, all.to_vec()),
        "create" => (RunState::Unconfigured, Vec::new()),
        _ => (RunState::Unconfigured, all[..1].to_vec()),
    }
}

fn step_of(hook: &str) -> Step {
    match hook {
        "create" => create_misbehaving(),
        "destroy" => destroy("bad"),
        "configure" => state("bad", Configure),
        "start" => state("bad", Start),
        "stop" => state("bad", Stop),
        _ => state("bad", Cleanup),
    }
}

const HOOKS: [&str; 4] = ["configure", "start", "stop", "cleanup"];

/// Where else a component's own code runs, beside its operations.
const MAKING: [&str; 2] = ["create", "destroy"];

pub fn a_failed_step_leaves_the_component_as_it_was(bed: &dyn Bed) -> RuleEnds {
    HOOKS[..2].iter().try_for_each(|hook| {
        let t = Trial::of(bed, &[(hook, BedTrouble::Fail)]);
        t.all(up_to(hook).1)?;
        let before = t.see()?;
        let with = format!("`{}`, which fails", step_of(hook));
        let failed = |outcome: &Outcome| matches!(outcome, Outcome::NotDone(Cause::Failed(_)));
        is(&with, &t.run(&step_of(hook))?, "not done, since the component failed", failed)?;
        same_system(with, &t.see()?, &before)
    })
}

pub fn a_panic_faults_the_component_and_nothing_else(bed: &dyn Bed) -> RuleEnds {
    HOOKS.iter().try_for_each(|hook| {
        let t = Trial::of(bed, &[(hook, BedTrouble::Panic)]);
        let heard = t.listen()?;
        t.all(up_to(hook).1)?;
        t.all([create("other"), state("other", Configure), state("other", Start)])?;
        let with = format!("`{}`, which panics", step_of(hook));
        let panicked = |outcome: &Outcome| matches!(outcome, Outcome::NotDone(Cause::Panicked(_)));
        is(&with, &t.run(&step_of(hook))?, "not done, since the component panicked", panicked)?;
        t.stands(&with, "bad", Some(RunState::Faulted))?;
        t.stands(&with, "other", Some(RunState::Running))?;
        let it = |e: &PlatformEvent| matches!(e, PlatformEvent::Faulted { component, .. } if *component == name("bad"));
        has_heard(with, &heard, "that `bad` is faulted", it)
    })
}

pub fn faulted_components_can_be_cleaned_up_and_destroyed(bed: &dyn Bed) -> RuleEnds {
    ["cleanup", "destroy"].iter().try_for_each(|last| {
        let t = Trial::of(bed, &[("start", BedTrouble::Panic)]);
        t.all(up_to("start").1)?;
        t.run(&step_of("start"))?;
        t.refuses(state("bad", Start))?;
        t.refuses(state("bad", Stop))?;
        t.refuses(state("bad", Configure))?;
        t.does(step_of(last))?;
        let left = (*last == "cleanup").then_some(RunState::Unconfigured);
        t.stands(format_args!("`{}` after a fault", step_of(last)), "bad", left)
    })
}

fn hung(bed: &dyn Bed, hooks: &[&'static str]) -> RuleEnds {
    hooks.iter().try_for_each(|hook| {
        let t = Trial::of(bed, &[(hook, BedTrouble::Hang(None))]);
        t.all(up_to(hook).1)?;
        t.does(create("other"))?;
        let with = format!("`{}`, which hangs", step_of(hook));
        let deadline = t.deadline();
        is_unknown(&with, &t.run_by(&step_of(hook), deadline)?)?;
        let now = t.now();
        holds(now >= deadline, &with, format_args!("no answer before {deadline}"), format_args!("one at {now}"))?;
        t.quarantines(&with, &["bad"])?;
        for step in [step_of(hook), state("bad", Configure), destroy("bad")] {
            is_not_done(format_args!("`{step}` in quarantine"), &t.run(&step)?)?;
        }
        t.all([state("other", Configure), state("other", Start)])?;
        t.see_one("bad").map(drop)
    })
}

pub fn a_hung_call_is_unknown_at_its_deadline_and_quarantined(bed: &dyn Bed) -> RuleEnds {
    hung(bed, &HOOKS)
}

pub fn a_hung_making_or_end_is_unknown_at_its_deadline_and_quarantined(bed: &dyn Bed) -> RuleEnds {
    hung(bed, &MAKING)
}

pub fn a_quarantined_component_holds_up_no_other(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[("start", BedTrouble::Hang(None))]);
    t.all(up_to("start").1)?;
    t.all([create("a"), create("b"), connect("a.y", "b.u", Policy::Data)])?;
    t.run(&step_of("start"))?;
    t.all([disconnect("a.y", "b.u"), destroy("a"), destroy("b")])?;
    let seen: Vec<String> = t.see()?.components.keys().map(ToString::to_string).collect();
    holds(seen == ["bad"], "others beside one in quarantine", "`bad` alone is left", seen.join(", "))
}

fn returns_late(bed: &dyn Bed, hooks: &[&'static str]) -> RuleEnds {
    let times = bed.times();
    hooks.iter().try_for_each(|hook| {
        let t = Trial::of(bed, &[(hook, BedTrouble::Hang(Some(times.limit * 3)))]);
        let heard = t.listen()?;
        let (before, steps) = up_to(hook);
        t.all(steps)?;
        let with = format!("`{}`, which returns late", step_of(hook));
        is_unknown(&with, &t.run(&step_of(hook))?)?;
        t.quarantines(&with, &["bad"])?;
        t.wait(times.limit * 5);
        t.quarantines(format_args!("{with}, when it has returned"), &[])?;
        let it =
            |e: &PlatformEvent| matches!(e, PlatformEvent::Returned { component, .. } if *component == name("bad"));
        has_heard(&with, &heard, "that `bad` has returned", it)?;
        match t.state_of("bad")? {
            None => Ok(()),
            Some(_) => t.stands(with, "bad", Some(before)),
        }
    })
}

pub fn a_call_that_returns_late_is_cleaned_up(bed: &dyn Bed) -> RuleEnds {
    returns_late(bed, &HOOKS)
}

pub fn a_making_or_end_that_returns_late_is_cleaned_up(bed: &dyn Bed) -> RuleEnds {
    returns_late(bed, &MAKING)
}

pub fn what_is_not_done_by_its_deadline_does_not_happen_later(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.does(create("a"))?;
    for (step, done) in [(destroy("a"), None), (create("b"), Some(RunState::Unconfigured))] {
        let component = step.component().to_string();
        let before = t.state_of(&component)?;
        // Its deadline is past: it may happen all the same, or not, but not when it was answered that it did not.
        let outcome = t.run_by(&step, t.now())?;
        t.wait(t.times.limit * 5);
        let expected = match outcome {
            Outcome::Done(_) => done,
            Outcome::NotDone(_) => before,
            Outcome::Unknown(_) => continue,
        };
        t.stands(format_args!("`{step}` past its deadline"), &component, expected)?;
        t.quarantines(format_args!("`{step}` past its deadline"), &[])?;
    }
    Ok(())
}

pub fn unknown_is_settled_by_reading_back(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[("configure", BedTrouble::Hang(None))]);
    t.all(up_to("configure").1)?;
    is_unknown("`configure bad`, which hangs", &t.run(&step_of("configure"))?)?;
    let seen = t.see_one("bad")?.map(|it| it.state);
    let expected = Some(RunState::Unconfigured);
    let words = |state: Option<RunState>| state.map_or("it is gone".to_owned(), |state| state.to_string());
    holds(seen == expected, "reading `bad` back, which hangs in `configure`", words(expected), words(seen))
}

pub fn safe_steps_do_what_others_do(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.does(create("a"))?;
    for step in
        [set("a.gain", 2.0), write("a.n", Some(Value::Int(1))), state("a", Configure), call("a.nothing", vec![])]
    {
        ends(format_args!("`{step}`, safe"), &t.run_safe(&step)?, &Outcome::Done(None))?;
    }
    let before = t.see()?;
    for step in [set("a.gain", 11.0), state("a", Configure), call("a.unknown", vec![]), call("b.nothing", vec![])] {
        let refused = |outcome: &Outcome| matches!(outcome, Outcome::NotDone(Cause::Refused(_)));
        is(format_args!("`{step}`, safe"), &t.run_safe(&step)?, "refused", refused)?;
    }
    same_system("safe steps that were refused", &t.see()?, &before)
}
