//! How a transaction may end, before anything of it has happened: what [`check`](crate::check) follows. A law drives the
//! machine through random outcomes and finds each of its ends here.

use crate::stack::{Ending, Endings, Planned};
use smallvec::SmallVec;

/// What stops a transaction on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopping<'a> {
    /// Nothing.
    Not,
    /// This part is given up; the last of it may have been done when that came.
    GivenUp(usize),
    /// A safe configuration; these parts were given up too.
    Safe(&'a [usize]),
}

/// Of so many parts before one that fails it is told apart whether something is left of them; further ones stand.
const TOLD_APART: usize = 4;

/// Whether each part of a plan can fail: it has a step, or stands for something.
pub fn can_fail(planned: &Planned) -> SmallVec<[bool; 2]> {
    let mut can: SmallVec<[bool; 2]> = planned.parts.iter().map(|part| part.holds).collect();
    for at in 0..planned.steps.len() {
        can[planned.part_of(planned.place(at))] = true;
    }
    can
}

/// Every way in which a transaction may end whose parts can fail or not. `each`: also which of several parts something is
/// left of, after which nothing is known whichever it is.
pub fn endings(can_fail: &[bool], stop: Stopping<'_>, each: bool) -> Vec<Endings> {
    let mut all = Vec::new();
    if let Stopping::Safe(given_up) = stop {
        interrupted(can_fail, given_up, each, &mut all);
        return all;
    }
    all.push(can_fail.iter().map(|_| Ending::Done).collect());
    let (upto, given_up) = match stop {
        Stopping::GivenUp(part) => (part, Some(part)),
        _ => (can_fail.len(), None),
    };
    for part in (0..upto).filter(|part| can_fail[*part]) {
        at(part, &[Ending::Failed, Ending::Broken], can_fail.len(), each, &mut all);
    }
    if let Some(part) = given_up {
        // What stands before it may have to be finished, where only the net of both was being carried out.
        let how: &[Ending] = match can_fail[..=part].contains(&true) {
            true => &[Ending::Cancelled, Ending::Broken],
            false => &[Ending::Cancelled],
        };
        at(part, how, can_fail.len(), each, &mut all);
    }
    all
}

/// A part ends so, and those before it stand, or were to stand and cannot be finished: then they are broken too.
fn at(part: usize, how: &[Ending], parts: usize, each: bool, all: &mut Vec<Endings>) {
    let subsets = if each { 1u32 << part.min(TOLD_APART) } else { 1 };
    for missing in 0..subsets {
        for ending in how {
            let before = |at: usize| {
                if missing & (1 << at.min(TOLD_APART)) != 0 { Ending::Broken } else { Ending::Done }
            };
            let of = |at: usize| match at {
                at if at < part => before(at),
                at if at == part => *ending,
                _ => Ending::Anew,
            };
            all.push((0..parts).map(of).collect());
        }
    }
}

/// Nothing stands; of each part that can fail something may be left.
fn interrupted(can_fail: &[bool], given_up: &[usize], each: bool, all: &mut Vec<Endings>) {
    let can: SmallVec<[usize; 2]> = (0..can_fail.len()).filter(|part| can_fail[*part]).collect();
    let subsets = match (each, can.is_empty()) {
        (true, _) => 1u32 << can.len().min(TOLD_APART + 1),
        (false, none) => 1 + u32::from(!none),
    };
    for some in 0..subsets {
        let left = |part: usize| can.iter().position(|of| *of == part).is_some_and(|at| some & (1 << at.min(31)) != 0);
        let of = |part: usize| match (left(part), given_up.contains(&part)) {
            (true, _) => Ending::Broken,
            (false, true) => Ending::Cancelled,
            (false, false) => Ending::Failed,
        };
        all.push((0..can_fail.len()).map(of).collect());
    }
}
