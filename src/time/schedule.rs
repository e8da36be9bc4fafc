//! Who is next on a simulated clock: the participants, what each of them waits for, and in which order they are due.
//!
//! Plain data, guarded by the scheduler's lock.

use super::Time;
use super::lock;
use rustc_hash::FxHashMap;
use std::any::Any;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::{JoinHandle, ThreadId};
use std::time::Duration;

/// A participant. Numbers only grow, so they are also the order among those who wait for the same moment.
pub(super) type Id = u64;

/// One wait of one participant; a later wait of the same participant has another number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct WaitUntil {
    pub(super) id: Id,
    pub(super) number: u64,
}

impl WaitUntil {
    pub(super) fn is_of(self, id: u64) -> bool {
        self.id == id
    }
}

#[derive(Default)]
pub(super) struct SchedulerState {
    pub(super) next_id: Id,
    pub(super) next_wait: u64,
    pub(super) participants: FxHashMap<Id, Participant>,
    /// Who holds the token. Nobody: all wait for a moment that pacing has not reached, or for the outside.
    pub(super) running: Option<Id>,
    pub(super) ready: VecDeque<Id>,
    /// Moments waited for; entries of waits that have ended otherwise stay until they come up.
    pub(super) timers: BinaryHeap<Reverse<(Time, Id, u64)>>,
    /// Moments for which alone time does not move on; at most one of each participant, and of few.
    pub(super) idle: Vec<(Time, Id, u64)>,
    pub(super) hung: Vec<WaitUntil>,
    pub(super) shut: bool,
    /// Who watches real time, when paced.
    pub(super) pacer: Option<Id>,
    pub(super) hand_overs: u64,
    /// The task that has the token, until one of the threads that run tasks has taken it.
    pub(super) due: Option<Id>,
    /// The threads that run tasks, one for each.
    pub(super) runners: FxHashMap<ThreadId, JoinHandle<()>>,
}

#[derive(Default)]
pub(super) struct Participant {
    pub(super) parker: Arc<Parker>,
    /// The wait it is in; none: ready or running.
    pub(super) wait: Option<u64>,
    /// A task between two of its steps: whoever runs tasks takes it from here. None: a thread waits for the token, also
    /// that of a task whose step waits for something in the middle.
    pub(super) task: Option<Box<dyn ClockTask>>,
}

/// What is done step by step, and waits between its steps.
pub(super) trait ClockTask: Send {
    fn step(&mut self) -> TaskWait;

    /// Registers the wait for its signal; false: there is nothing to wait for.
    fn begin_wait(&mut self, deadline: Time, begin: &mut dyn FnMut() -> WaitUntil) -> bool;

    /// It has ended, by itself or in a panic; the thread that has run it ends, too.
    fn end(self: Box<Self>, panic: Option<Box<dyn Any + Send>>, thread: Option<JoinHandle<()>>);
}

/// When a task wants its next step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskWait {
    /// When its signal is set, at the latest at this moment.
    Wait(Time),
    /// At this moment, whatever its signal says.
    Pause(Time),
    /// Never: it has ended.
    End,
}

/// Where a thread is parked until it is told to look whether it has the token. Its own lock, so that who is woken does not meet the
/// waker at the scheduler's.
#[derive(Default)]
pub(super) struct Parker {
    unparked: Mutex<bool>,
    changed: Condvar,
}

impl Parker {
    pub(super) fn unpark(&self) {
        *lock(&self.unparked) = true;
        self.changed.notify_one();
    }

    /// Waits until it is unparked, at most for so long.
    pub(super) fn park(&self, longest: Option<Duration>) {
        let mut unparked = lock(&self.unparked);
        while !*unparked {
            unparked = match longest {
                None => self.changed.wait(unparked).unwrap_or_else(PoisonError::into_inner),
                Some(longest) => {
                    // Whoever waits for a time looks again in any case.
                    let waited = self.changed.wait_timeout(unparked, longest);
                    *waited.unwrap_or_else(PoisonError::into_inner).0 = false;
                    return;
                }
            };
        }
        *unparked = false;
    }
}

/// Whom to wake once the scheduler's lock is released.
#[must_use = "whoever has the token sleeps until it is called"]
pub(super) enum Called {
    Nobody,
    Thread(Arc<Parker>),
    /// One of the threads that run tasks.
    Runner,
}

impl SchedulerState {
    pub(super) fn add(&mut self) -> Id {
        let id = self.next_id;
        self.next_id += 1;
        self.participants.insert(id, Participant::default());
        id
    }

    pub(super) fn make_ready(&mut self, wait: WaitUntil) -> bool {
        match self.participants.get_mut(&wait.id) {
            Some(participant) if participant.wait == Some(wait.number) => {
                participant.wait = None;
                self.ready.push_back(wait.id);
                true
            }
            _ => false,
        }
    }

    /// The earliest moment somebody waits for, and who.
    pub(super) fn next_timer(&mut self) -> Option<(Time, Id)> {
        let (eager, idle) = (self.next_eager(), self.next_idle());
        eager.into_iter().chain(idle).min().map(|(at, id, _)| (at, id))
    }

    /// Takes the next one that waits for this moment, the earliest that somebody waits for.
    pub(super) fn pop_timer(&mut self, at: Time) -> Option<WaitUntil> {
        let (eager, idle) = (self.next_eager(), self.next_idle());
        let first = eager.into_iter().chain(idle).min().filter(|first| first.0 == at)?;
        if idle == Some(first) {
            self.idle.retain(|timer| *timer != first);
        } else {
            self.timers.pop();
        }
        Some(WaitUntil { id: first.1, number: first.2 })
    }

    /// Whether nobody waits for a moment for which time moves on.
    pub(super) fn is_idle(&mut self) -> bool {
        self.next_eager().is_none()
    }

    pub(super) fn next_eager(&mut self) -> Option<(Time, Id, u64)> {
        while let Some(Reverse((at, id, number))) = self.timers.peek().copied() {
            if self.participants.get(&id).is_some_and(|p| p.wait == Some(number)) {
                return Some((at, id, number));
            }
            self.timers.pop();
        }
        None
    }

    pub(super) fn next_idle(&mut self) -> Option<(Time, Id, u64)> {
        let Self { participants, idle, .. } = self;
        idle.retain(|(_, id, number)| participants.get(id).is_some_and(|p| p.wait == Some(*number)));
        idle.iter().min().copied()
    }
}
