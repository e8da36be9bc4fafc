//! Rules of several steps in one call.

use super::bed::{Bed, BedTrouble};
use super::trial::{RuleEnds, Trial, ends, holds, is, is_unknown, told};
use super::words::*;
use crate::model::Step;
use crate::platform::{Cause, Outcome, StepBatch, TimedStep};
use crate::time::Time;
use std::time::Duration;

/// Steps in one call, each with so much time.
fn batch(t: &Trial, steps: &[(Step, Duration)]) -> StepBatch {
    let timed =
        |(step, patience): &(Step, Duration)| TimedStep { step: step.clone(), patience: *patience, until: Time::NEVER };
    StepBatch::new(t.clock().clone(), steps.iter().map(timed).collect())
}

/// Hands the platform these steps, each with as long as a step may take, and answers what came of those that it began.
fn hand(t: &Trial, steps: &[Step], until: Time, stop: bool) -> RuleEnds<Vec<Outcome>> {
    let each = t.times.limit;
    let batch = batch(t, &steps.iter().map(|step| (step.clone(), each)).collect::<Vec<_>>());
    if stop {
        batch.stop();
    }
    carry_out(t, &batch, until)
}

fn carry_out(t: &Trial, batch: &StepBatch, until: Time) -> RuleEnds<Vec<Outcome>> {
    let (with, own) = (in_words(batch), batch.clone());
    t.call(&with, until, move |platform| platform.execute_batch(&own))?;
    let ended: Vec<Outcome> = batch.take(true).into_iter().map(|answer| answer.outcome).collect();
    holds(!ended.is_empty(), &with, "one answer at least", "none")?;
    let behind = ended.iter().skip_while(|it| is_done(it)).skip(1);
    let words = || ended.iter().map(told).collect::<Vec<_>>().join("; ");
    let known = behind.filter(|it| !matches!(it, Outcome::Unknown(_))).count();
    holds(known == 0, with, "no answer behind one that is not done", words())?;
    Ok(ended)
}

fn in_words(batch: &StepBatch) -> String {
    let words: Vec<String> = batch.steps().iter().map(|timed| format!("`{}`", timed.step)).collect();
    format!("{} in one call", words.join(", "))
}

fn is_done(outcome: &Outcome) -> bool {
    *outcome == Outcome::Done(None)
}

/// Has it carry out all of them, in as many calls as it likes. All are done.
fn hand_all(t: &Trial, mut steps: Vec<Step>) -> RuleEnds {
    while !steps.is_empty() {
        let ended = hand(t, &steps, t.now() + t.times.work, false)?;
        for (step, outcome) in steps.iter().zip(&ended) {
            ends(format_args!("`{step}` of several"), outcome, &Outcome::Done(None))?;
        }
        steps.drain(..ended.len());
    }
    Ok(())
}

/// Exactly these components are there.
fn there_are(t: &Trial, with: &str, expected: &[&str]) -> RuleEnds {
    let seen: Vec<String> = t.see()?.components.keys().map(ToString::to_string).collect();
    holds(seen == expected, with, expected.join(", "), seen.join(", "))
}

pub fn several_steps_are_carried_out_as_far_as_they_are_done(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    let names = ["a", "b", "c"];
    hand_all(&t, names.iter().map(|n| create(n)).collect())?;
    there_are(&t, "three that were created", &names)?;
    let wrong = [create("b"), create("e")];
    let ended = hand(&t, &wrong, t.deadline(), false)?;
    let refused = |outcome: &Outcome| matches!(outcome, Outcome::NotDone(Cause::Refused(_)));
    is("`create b` of several, which is there", &ended[0], "refused", refused)?;
    there_are(&t, "one that is refused, and one behind it", &names)
}

pub fn several_steps_stop_where_they_are_told_to(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    hand_all(&t, ["a", "b"].iter().map(|n| create(n)).collect())?;
    let steps = [destroy("a"), destroy("b")];
    let ended = hand(&t, &steps, t.deadline(), true)?;
    let with = "`destroy a`, `destroy b` in one call, told to stop";
    holds(ended.len() == 1 && is_done(&ended[0]), with, "the first is done, and no other", format_args!("{ended:?}"))?;
    there_are(&t, with, &["b"])
}

pub fn several_steps_end_with_one_that_hangs(bed: &dyn Bed) -> RuleEnds {
    let times = bed.times();
    let t = Trial::of(bed, &[("create", BedTrouble::Hang(Some(times.limit * 3)))]);
    t.all(["a", "b", "c"].iter().map(|n| create(n)))?;
    let mut steps = vec![destroy("a"), create_misbehaving(), create("d"), destroy("b")];
    // A platform may carry out as many in one call as it likes.
    let last = loop {
        let ended = hand(&t, &steps, t.now() + times.work, false)?;
        let done = ended.iter().take_while(|it| is_done(it)).count();
        match ended.into_iter().nth(done) {
            Some(other) => break other,
            None if steps.len() > done => steps.drain(..done),
            None => {
                return holds(false, "several steps", "`create bad` does not return", "it is done");
            }
        };
    };
    let with = "`create bad`, which does not return";
    is_unknown(with, &last)?;
    t.quarantines(with, &["bad"])?;
    there_are(&t, "what stands before it is done, nothing behind it has begun", &["b", "c"])?;
    t.wait(times.work);
    t.quarantines("when it has returned", &[])?;
    there_are(&t, "when it has returned", &["b", "c"])
}

pub fn each_of_several_steps_has_its_own_time(bed: &dyn Bed) -> RuleEnds {
    let limit = bed.times().limit;
    for (first, second) in [(limit, limit * 3), (limit * 5, limit)] {
        let t = Trial::of(bed, &[("create", BedTrouble::Hang(None))]);
        let batch = batch(&t, &[(create("a"), first), (create_misbehaving(), second)]);
        let began = t.now();
        let mut ended = carry_out(&t, &batch, began + second)?;
        if ended.len() == 1 {
            // One at a time, and the other one comes again.
            let batch = self::batch(&t, &[(create_misbehaving(), second)]);
            ended.extend(carry_out(&t, &batch, t.now() + second)?);
        }
        let with = format!("`create bad`, which does not return and has {second:?}, behind one that has {first:?}");
        is_unknown(&with, &ended[1])?;
        let (took, now) = (t.now().since(began), began + second);
        holds(took >= second, with, format_args!("no answer before {now}"), format_args!("one after {took:?}"))?;
    }
    Ok(())
}

pub fn what_is_done_is_told_before_the_end_of_others(bed: &dyn Bed) -> RuleEnds {
    let times = bed.times();
    let t = Trial::of(bed, &[("create", BedTrouble::Hang(Some(times.limit * 3)))]);
    let batch = batch(&t, &[(create("a"), times.limit), (create_misbehaving(), times.limit * 2)]);
    let began = t.now();
    let (own, with) = (batch.clone(), in_words(&batch));
    let working = t.work(with.clone(), move |platform| platform.execute_batch(&own));
    t.wait(times.limit);
    let told_of: Vec<String> = batch.take(false).iter().map(|answer| told(&answer.outcome)).collect();
    working.ended(began + times.limit * 2 + times.late)?;
    holds(told_of == ["done"], with, "`create a` is answered while `create bad` hangs", told_of.join("; "))
}
