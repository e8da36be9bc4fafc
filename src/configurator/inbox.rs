//! The configurator's one inbox: requests, replies of workers, reports of the platform.
//!
//! Each kind has room of its own in it, counted here, so that no flood of one kind keeps another out: a `safe` request
//! gets in when the queue of requests is full, and the reply of a worker always does.

use super::control::{ControlCommand, UrgentCommand};
use super::request::{Batch, Request};
use crate::limits;
use crate::model::{ComponentSnapshot, EventName, Ident, Snapshot};
use crate::platform::{ObserveError, PlatformEvent};
use crate::stack::Requester;
use crate::time::{Clock, Receiver, Sender, TrySendError};
use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A call of the platform, by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct PoolTicket(pub u64);

/// What came of a call.
pub(super) enum PoolReply {
    /// The call has returned; the answers are in its batch.
    Executed,
    Observed(Result<Snapshot, ObserveError>),
    ObservedComponent(Result<Option<ComponentSnapshot>, ObserveError>),
}

/// What comes in.
pub(super) enum Mail {
    /// A request alone: nearly all are, and what every letter takes in the box is what the largest kind takes.
    Request(Request),
    Batch(Box<Batch>),
    Reply(PoolTicket, PoolReply),
    /// Calls that are out have answered some of their steps.
    Answers,
    /// A component became faulted, or came back.
    Platform(PlatformEvent),
    /// An event that some configuration waits for as its confirmation.
    Event(EventName),
    /// Conditions that are evaluated for the configurator are so, or are so no more.
    Truths,
    /// To be done between requests, in the configurator's own thread.
    Command(ControlCommand),
}

#[derive(Default)]
pub(super) struct Counts {
    /// Requests that have not begun, safe ones apart.
    pub requests: AtomicUsize,
    /// Safe requests that have not begun.
    pub safe: AtomicUsize,
    /// A [`Mail::Truths`] is on its way.
    pub truths: AtomicBool,
    /// A [`Mail::Answers`] is.
    pub answers: AtomicBool,
    /// Somebody wants force.
    pub hurried: AtomicBool,
    /// The event that ends the deployment came, and it is not down since.
    pub leaving: AtomicBool,
    /// The same of subsystems, by their paths; and how often that changed.
    pub leaving_inside: Mutex<BTreeSet<Ident>>,
    pub leaving_changes: AtomicUsize,
    reports: AtomicUsize,
    commands: AtomicUsize,
    control: AtomicUsize,
    /// Reports did not fit: the platform must be looked at as a whole, and events are among those missed.
    pub reports_lost: AtomicBool,
    /// Events that did not fit, each once: looking at the platform does not tell them.
    missed: Mutex<BTreeSet<EventName>>,
}

/// The end mail is put in at.
#[derive(Clone)]
pub(super) struct Post {
    sender: Sender<Mail>,
    pub counts: Arc<Counts>,
}

pub(super) fn new(clock: &Clock) -> (Post, Receiver<Mail>) {
    let room = limits::REQUEST_QUEUE
        + limits::SAFE_QUEUE
        + limits::PLATFORM_REPORTS
        + limits::WORKERS_MOST
        + limits::WORKERS_GIVEN_UP
        + 2 * limits::WORKERS_SAFE
        + limits::CONFIGURATOR_COMMANDS
        + limits::CONFIGURATOR_CONTROL
        + 2;
    let (sender, receiver) = clock.channel(room);
    (Post { sender, counts: Arc::default() }, receiver)
}

impl Counts {
    /// A subsystem is led down from now on, or it is no more.
    pub fn leads(&self, path: Ident, down: bool) {
        let mut all = self.leaving_inside.lock().unwrap_or_else(PoisonError::into_inner);
        let changed = if down { all.insert(path) } else { all.remove(&path) };
        if changed {
            self.leaving_changes.fetch_add(1, Ordering::Release);
        }
    }

    /// A report was taken out: its room is free again.
    pub fn report_taken(&self) {
        self.reports.fetch_sub(1, Ordering::AcqRel);
    }

    /// A command was taken up: its room is free again.
    pub fn command_taken(&self, asks: bool) {
        self.room_of(asks).0.fetch_sub(1, Ordering::AcqRel);
    }

    /// A command is to be taken up again.
    pub fn command_again(&self, asks: bool) {
        self.room_of(asks).0.fetch_add(1, Ordering::AcqRel);
    }

    /// Where a command is counted, and how many there may be: whoever only asks takes no place from what must not be lost.
    fn room_of(&self, asks: bool) -> (&AtomicUsize, usize) {
        match asks {
            true => (&self.commands, limits::CONFIGURATOR_COMMANDS),
            false => (&self.control, limits::CONFIGURATOR_CONTROL),
        }
    }

    /// Events that did not fit since the last look.
    pub fn missed(&self) -> BTreeSet<EventName> {
        std::mem::take(&mut *crate::time::lock(&self.missed))
    }
}

fn reserve(count: &AtomicUsize, wanted: usize, bound: usize) -> bool {
    count.fetch_update(Ordering::AcqRel, Ordering::Acquire, |n| (n + wanted <= bound).then_some(n + wanted)).is_ok()
}

impl Post {
    #[allow(clippy::result_large_err)] // The batch is given back: it still has to be answered.
    /// Puts a batch in; `safe` of its requests ask for safe configurations. Gives it back when there is no room.
    pub fn batch(&self, batch: Batch, safe: usize) -> Result<(), Batch> {
        let plain = batch.requests.len() - safe;
        // However much an operator asks for, a coordinator finds room: it cannot wait for another time.
        let by_operator = batch.requests.iter().any(|request| request.requester == Requester::Operator);
        let room = if by_operator { limits::REQUEST_OPERATORS } else { limits::REQUEST_QUEUE };
        if plain > 0 && !reserve(&self.counts.requests, plain, room) {
            return Err(batch);
        }
        if safe > 0 && !reserve(&self.counts.safe, safe, limits::SAFE_QUEUE) {
            self.counts.requests.fetch_sub(plain, Ordering::AcqRel);
            return Err(batch);
        }
        let mail = match batch.requests[..] {
            [request] => Mail::Request(request),
            _ => Mail::Batch(Box::new(batch)),
        };
        self.sender.try_send(mail).map_err(|refused| {
            self.counts.requests.fetch_sub(plain, Ordering::AcqRel);
            self.counts.safe.fetch_sub(safe, Ordering::AcqRel);
            match refused {
                TrySendError::Full(mail) | TrySendError::Closed(mail) => match mail {
                    Mail::Request(request) => Batch::one(request),
                    Mail::Batch(batch) => *batch,
                    _ => Batch::default(),
                },
            }
        })
    }

    /// Puts a report or an event in.
    pub fn report(&self, mail: Mail) {
        let event = if let Mail::Event(event) = mail { Some(event) } else { None };
        if !reserve(&self.counts.reports, 1, limits::PLATFORM_REPORTS) || self.sender.try_send(mail).is_err() {
            // There is much to read: whoever reads it looks at everything then.
            if let Some(event) = event {
                crate::time::lock(&self.counts.missed).insert(event);
            }
            self.counts.reports_lost.store(true, Ordering::Release);
        }
    }

    /// Says that truths have changed, once until that is taken in.
    pub fn truths(&self) {
        if !self.counts.truths.swap(true, Ordering::AcqRel) && self.sender.try_send(Mail::Truths).is_err() {
            self.counts.truths.store(false, Ordering::Release);
        }
    }

    /// Says that steps of calls that are out were answered, once until that is taken in.
    pub fn answers(&self) {
        if !self.counts.answers.swap(true, Ordering::AcqRel) && self.sender.try_send(Mail::Answers).is_err() {
            self.counts.answers.store(false, Ordering::Release);
        }
    }

    /// Puts a command in; answers whether there was room.
    pub fn command(&self, command: impl Into<ControlCommand>) -> bool {
        let command = command.into();
        let asks = match &command {
            ControlCommand::AtOnce(command) => command.only_asks(),
            ControlCommand::Queued(command) => command.only_asks(),
        };
        let (count, bound) = self.counts.room_of(asks);
        reserve(count, 1, bound) && self.sender.try_send(Mail::Command(command)).is_ok()
    }

    /// Has the thread panic; whether there was room to say so.
    pub fn inject_panic(&self) -> bool {
        self.command(UrgentCommand::Panic)
    }

    /// Says that force is wanted. That is known also when there is no room to wake whoever waits: then there is much to take in.
    pub fn hurry(&self) {
        self.counts.hurried.store(true, Ordering::Release);
        self.command(UrgentCommand::Hurry);
    }

    /// Says that the deployment is led down from now on, or that it is brought up. Whoever takes something up looks: it wakes
    /// nobody, for it changes nothing of what is under way.
    pub fn leaving(&self, leaving: bool) {
        self.counts.leaving.store(leaving, Ordering::Release);
    }

    /// Says it of a subsystem.
    pub fn leaving_inside(&self, path: Ident, leaving: bool) {
        self.counts.leads(path, leaving);
    }

    /// Whether it is led down.
    pub fn is_leaving(&self) -> bool {
        self.counts.leaving.load(Ordering::Acquire)
    }

    /// Puts a worker's reply in: there is room for every call that is out. When the configurator has ended, nobody
    /// wants it.
    pub fn send(&self, mail: Mail) {
        let _ = self.sender.try_send(mail);
    }
}

#[cfg(test)]
mod tests {
    use super::super::control::QueuedCommand;
    use super::*;

    /// An event that a configuration waits for is not among what looking at the platform tells.
    #[test]
    fn an_event_that_does_not_fit_is_kept() {
        let (post, _inbox) = new(&Clock::simulated());
        let event = |name: &str| EventName::new(name).expect("a name");
        for _ in 0..limits::PLATFORM_REPORTS {
            post.report(Mail::Event(event("e_other")));
        }
        assert!(post.counts.missed().is_empty());
        for _ in 0..3 {
            post.report(Mail::Event(event("e_fine")));
        }
        assert!(post.counts.reports_lost.load(Ordering::Acquire));
        assert_eq!(post.counts.missed(), BTreeSet::from([event("e_fine")]));
        assert!(post.counts.missed().is_empty(), "taken once");
    }

    /// Who only asks leaves room for what must not be lost, and keeps its place until it is carried out.
    #[test]
    fn asking_takes_no_room_from_what_must_not_be_lost() {
        let (post, inbox) = new(&Clock::simulated());
        let drift = || QueuedCommand::Drift { reply: Clock::simulated().channel(1).0 };
        let asked = (0..1_000).filter(|_| post.command(drift())).count();
        assert_eq!(asked, limits::CONFIGURATOR_COMMANDS);
        let told = (0..1_000).filter(|_| post.command(UrgentCommand::Stopping)).count();
        assert_eq!(told, limits::CONFIGURATOR_CONTROL);
        let Ok(Mail::Command(ControlCommand::Queued(command))) = inbox.try_recv() else { panic!("a command") };
        assert!(!post.command(drift()), "it was taken in, and waits");
        post.counts.command_taken(command.only_asks());
        assert!(post.command(drift()));
    }
}
