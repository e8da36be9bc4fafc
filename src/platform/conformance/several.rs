//! Rules of several brief steps in one call.

use super::bed::{Bed, BedTrouble};
use super::trial::{RuleEnds, Trial, ends, holds, is, is_unknown};
use super::words::*;
use crate::model::Step;
use crate::platform::{Cause, Ended, Outcome};
use crate::time::Time;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Hands the platform these steps, which have so long together, and answers what came of those that it began.
fn hand(t: &Trial, steps: &[Step], until: Time, stop: bool) -> RuleEnds<Vec<Ended>> {
    let with = in_words(steps);
    let (own, each, stop) = (steps.to_vec(), t.times.limit, Arc::new(AtomicBool::new(stop)));
    let ended = t.call(&with, until, move |platform| platform.execute_brief(own, each, until, &stop))?;
    let bound = format!("1 to {} answers", steps.len());
    holds((1..=steps.len()).contains(&ended.len()), &with, bound, format_args!("{} answers", ended.len()))?;
    let done = ended.iter().take_while(|it| is_done(it)).count();
    holds(ended.len() <= done + 1, with, "no answer behind one that is not done", format_args!("{ended:?}"))?;
    Ok(ended)
}

fn in_words(steps: &[Step]) -> String {
    let words: Vec<String> = steps.iter().map(|step| format!("`{step}`")).collect();
    format!("{} in one call", words.join(", "))
}

fn is_done(ended: &Ended) -> bool {
    ended.outcome == Outcome::Done(None)
}

/// Has it carry out all of them, in as many calls as it likes. All are done.
fn hand_all(t: &Trial, mut steps: Vec<Step>) -> RuleEnds {
    while !steps.is_empty() {
        let ended = hand(t, &steps, t.now() + t.times.work, false)?;
        for (step, ended) in steps.iter().zip(&ended) {
            ends(format_args!("`{step}` of several"), &ended.outcome, &Outcome::Done(None))?;
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
    is("`create b` of several, which is there", &ended[0].outcome, "refused", refused)?;
    there_are(&t, "one that is refused, and one behind it", &names)
}

pub fn several_steps_stop_where_they_are_told_to(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    hand_all(&t, ["a", "b"].iter().map(|n| create(n)).collect())?;
    let steps = [destroy("a"), destroy("b")];
    let ended = hand(&t, &steps, t.deadline(), true)?;
    let with = format!("{}, told to stop", in_words(&steps));
    holds(ended.len() == 1 && is_done(&ended[0]), &with, "the first is done, and no other", format_args!("{ended:?}"))?;
    there_are(&t, &with, &["b"])
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
                return holds(false, in_words(&steps), "`create bad` does not return", "it is done");
            }
        };
    };
    let with = "`create bad`, which does not return";
    is_unknown(with, &last.outcome)?;
    t.quarantines(with, &["bad"])?;
    there_are(&t, "what stands before it is done, nothing behind it has begun", &["b", "c"])?;
    t.wait(times.work);
    t.quarantines("when it has returned", &[])?;
    there_are(&t, "when it has returned", &["b", "c"])
}
