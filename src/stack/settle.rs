//! What it comes to that requests were carried out so: written once. The configurator books it, `check` follows it.
//!
//! The parts of a group end in order: those before one that failed stand, and what stands behind it is taken up anew, since
//! it was decided for a system in which that one is done. Where a safe configuration interrupts a group all of it ends.

use super::effort::{but_for_missed, owed_no_more, without};
use super::squash::list;
use super::{Edits, Frame, FrameId, Group, Request, Why, World};
use crate::model::{Ask, Step, Verdict};
use crate::plan::undo::DraftStep;
use smallvec::SmallVec;
use std::sync::Arc;

/// How a part of a group has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Ending {
    /// It was done.
    Done,
    /// The system is as before it.
    Failed,
    /// It was given up, and the system is as before it.
    Cancelled,
    /// Neither done nor taken back.
    Broken,
    /// It had not begun when one before it failed.
    Anew,
}

/// How the parts of a group have ended, in order.
pub type Endings = SmallVec<[Ending; 2]>;

/// What ended a group as a whole.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stopped {
    /// Nothing did.
    Not,
    /// A safe configuration: nothing of it stands that was not told before.
    Safe,
    /// Everything is being taken down: nothing is taken up anew.
    Down,
}

/// What an answer is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum About {
    /// A part of the group, by its number.
    Part(usize),
    /// A request that was settled without being carried out, by its place in [`Group::told`].
    Told(usize),
    /// The same, but it ends with those that were interrupted.
    Interrupted,
    /// What was made permanent.
    Commit,
}

/// What a group that has ended comes to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Settled {
    /// The answers in the order of the batch: place, verdict (none: nobody is told), and what it is about. What is not
    /// answered is taken up anew.
    pub answers: SmallVec<[(usize, Option<Verdict>, About); 2]>,
    /// Undos by leaving a state that were not carried out, by their places: their frames stay, and are frames like others.
    /// None: the frame of the visit that there is.
    pub stay: SmallVec<[(usize, Option<FrameId>); 2]>,
}

/// How a safe configuration has ended.
#[derive(Debug, Clone, Copy, Default)]
pub struct SafeEnd<'f> {
    /// A step of it failed, or what became of one is not known; with the frame of what was done, if that is another one than
    /// was planned.
    pub failed: Option<Option<&'f Frame>>,
    /// The steps that were not done, also of those that an earlier one was to do.
    pub missed: &'f [Step],
    /// A piece of it could not even be planned.
    pub left_out: bool,
    /// The steps that were done, also of taking back those whose place it takes.
    pub done: &'f [Step],
    /// It was planned for another system than there was: something is interrupted for its sake, or was broken.
    pub interrupts: bool,
}

/// What it comes to that the parts of `group` have ended so.
pub fn settle(requests: &[Request], group: &Group, endings: &[Ending], stopped: Stopped) -> Settled {
    let mut settled = Settled::default();
    let failed = endings.iter().position(|ending| *ending != Ending::Done).map(|part| group.places[part]);
    // What was decided of those behind one that failed took that for done.
    let end = failed.filter(|_| stopped == Stopped::Not).map_or(group.takes, |place| place + 1);
    for (part, ending) in endings.iter().enumerate() {
        let (place, ask) = (group.places[part], requests[group.places[part]].ask);
        let verdict = match ending {
            Ending::Anew => break,
            Ending::Done => ask.done(),
            Ending::Failed => ask.failed(),
            Ending::Cancelled => Verdict::Cancelled,
            Ending::Broken => ask.broken(),
        };
        if verdict != ask.done() {
            settled.stay.extend(group.visits.get(part).copied().flatten().map(|frame| (place, Some(frame))));
        }
        settled.answers.push((place, Some(verdict), About::Part(part)));
    }
    if group.commits {
        settled.answers.extend((0..group.takes).map(|place| (place, Some(Verdict::Ok), About::Commit)));
    }
    // Refused, whatever came of the others.
    settled
        .stay
        .extend(group.stay.iter().filter(|(place, _)| *place < end).map(|(place, frame)| (*place, Some(*frame))));
    for (at, told) in group.told.iter().enumerate().filter(|(_, told)| told.place < end) {
        let behind = stopped == Stopped::Safe && failed.is_some_and(|failed| told.place > failed);
        settled.answers.push(match told.verdict {
            // Whatever it would have come to after them.
            Some(_) if behind => {
                // What was refused was about a frame that stays already, and not about that of a later visit.
                if group.stay.iter().all(|(place, _)| *place != told.place) {
                    settled.stay.push((told.place, None));
                }
                (told.place, Some(requests[told.place].ask.failed()), About::Interrupted)
            }
            verdict => (told.place, verdict, About::Told(at)),
        });
    }
    settled.answers.sort_by_key(|(place, ..)| *place);
    settled
}

impl World {
    /// The stack takes over what the parts that were done do to it; answers of each of them the frame that it pushed, unless a
    /// later one popped that again. All at once: one may pop what another one pushes. `busy`: see [`Stack::apply`].
    ///
    /// [`Stack::apply`]: super::Stack::apply
    pub fn take_over<'e>(
        &mut self,
        edits: impl Iterator<Item = &'e Edits>,
        endings: &[Ending],
        busy: &[FrameId],
    ) -> Vec<Option<FrameId>> {
        let done = edits.zip(endings).filter(|(_, ending)| **ending == Ending::Done);
        let mut pushed = self.stack.apply_each(done.map(|(edits, _)| edits), busy).into_iter();
        let of = |ending: &Ending| if *ending == Ending::Done { pushed.next().flatten() } else { None };
        endings.iter().map(of).collect()
    }

    /// A safe configuration has been applied as far as it goes. Its frame comes to stand above those of what it interrupted;
    /// nothing of it is taken back, so what could not be done leaves it *broken*, with a partial frame. Its own answer comes
    /// before those of what it interrupted, which end by [`settle`] as stopped for its sake. `busy`: see [`Stack::apply`].
    ///
    /// [`Stack::apply`]: super::Stack::apply
    pub fn settle_safe(
        &mut self,
        mut edits: Edits,
        frame: Frame,
        end: &SafeEnd<'_>,
        busy: &[FrameId],
    ) -> (FrameId, Verdict) {
        let broken = end.failed.is_some();
        let mut busy: SmallVec<[FrameId; 4]> = SmallVec::from_slice(busy);
        let (mut others, planned) = (edits.over.clone(), (!end.done.is_empty()).then(|| frame.clone()));
        if broken {
            // What was done of it undoes what was done, and no more: what it was to take the place of is taken over with what that undoes,
            // also where something else was under way, and about that itself: else that would seem to be in force, whatever was left of it.
            busy.retain(|frame| edits.pops.iter().all(|(id, _)| id != frame));
            others.extend(edits.pops.drain(..).map(|(id, _)| id));
        }
        let taken = |of: &&Arc<Frame>| {
            of.safe && of.group.is_some() && of.group == frame.group && of.foreign_to(frame.requester).is_none()
        };
        for earlier in self.stack.frames().iter().filter(taken).cloned().collect::<Vec<_>>() {
            but_for_missed(&earlier, end.missed, &self.system).into_iter().for_each(|rest| self.stack.replace(rest));
        }
        let frame = match end.failed {
            None if end.missed.is_empty() => frame,
            Some(done) if !end.interrupts => Frame { partial: true, ..done.cloned().unwrap_or(frame) },
            // As if what was interrupted had never been; what an earlier one was to do and did not is not done either.
            _ => without(frame, end.missed),
        };
        let frame = match &planned {
            Some(own) => {
                let (frame, made_up) = owed_no_more(&mut self.stack, &others, own, frame, end.done);
                self.expects_done(&made_up, None);
                frame
            }
            None => frame,
        };
        let verdict = if broken || end.left_out { Verdict::Broken } else { Verdict::Ok };
        // What is broken is repaired by the undo of its frame: of the one that takes the place of that.
        let stack = &self.stack;
        let there = |frame: &FrameId| stack.frame(*frame).is_some();
        let broken: Vec<FrameId> = self.broken.iter().filter_map(|broken| broken.frame).filter(there).collect();
        let group = frame.group;
        let gone: SmallVec<[FrameId; 2]> =
            edits.pops.iter().map(|(frame, _)| *frame).chain(edits.over.clone()).collect();
        let before = if self.broken.is_empty() { Vec::new() } else { self.stack.frames().to_vec() };
        if !before.is_empty() {
            // Its own undo leads back from there, beside what is broken.
            self.expects_back(&connections(&frame));
        }
        // What it was to take the place of, and what it was not.
        let apart: Vec<FrameId> = broken.iter().filter(|id| !others.contains(id)).copied().collect();
        let own = frame.saved.clone();
        let pushed = self.stack.push_safe(edits, frame, &busy, (&broken, &apart));
        if !before.is_empty() {
            let after = self.stack.clone();
            let taken = |frame: &Frame| {
                let of_group = group.is_some() && frame.group == group && !after.has_squashed(frame);
                after.frame(frame.id).is_none() && (gone.contains(&frame.id) || of_group)
            };
            self.expects_no_more(&before, taken);
            self.answers_for(&before, taken, pushed, &own);
            self.takes_back_what_is_there(pushed);
        }
        let gone: Vec<FrameId> = broken.into_iter().filter(|frame| self.stack.frame(*frame).is_none()).collect();
        for frame in self.broken.iter_mut().filter_map(|broken| broken.frame.as_mut()) {
            if gone.contains(frame) {
                *frame = pushed;
            }
        }
        (pushed, verdict)
    }

    /// Frames that were to be undone with the state they belong to stay.
    pub fn keep(&mut self, requests: &[Request], settled: &Settled) {
        for (place, frame) in &settled.stay {
            match frame {
                Some(frame) => self.stack.let_go(*frame),
                None => _ = self.stays(&requests[*place], &[]),
            }
        }
    }
}

/// The connections that a frame has made and taken away.
fn connections(frame: &Frame) -> Vec<Step> {
    let made = |item: &DraftStep| match (&item.step, item.was) {
        (Step::Connect { from, to, .. }, _) => Some(Step::Disconnect { from: *from, to: *to }),
        (Step::Disconnect { from, to }, Some(policy)) => Some(Step::Connect { from: *from, to: *to, policy }),
        _ => None,
    };
    list(frame).iter().rev().filter_map(made).collect()
}

impl Request {
    /// A request as it is told of: what took back a frame that was not confirmed tells of that frame's configuration. Why it
    /// is there stays with it: so it is no answer to a state.
    pub fn as_told(self, verdict: Verdict) -> (Self, Verdict) {
        match (self.why, verdict, self.ask) {
            (Why::Unconfirmed(..), Verdict::Undone, Ask::UndoOf(id)) => {
                (Self { ask: Ask::Apply(id), ..self }, Verdict::Reverted)
            }
            _ => (self, verdict),
        }
    }
}
