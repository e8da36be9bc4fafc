//! The workers that make blocking calls to the platform, so that the configurator's own thread never waits for a
//! component.
//!
//! A worker is given one call at a time and reports its end to the configurator's inbox. A platform promises to answer
//! by the deadline; a worker whose call is not back a while after it is given up and replaced, and its late report is
//! told apart by its ticket.

use super::inbox::{Mail, Post, Reply, Ticket};
use crate::limits;
use crate::model::{ComponentName, Step};
use crate::platform::{Cause, Ended, ObserveError, Outcome, Platform};
use crate::time::{Clock, Receiver, Sender, Time};
use rustc_hash::FxHashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// What a worker is to call.
pub(super) enum Call {
    /// One step; whether it belongs to a safe configuration.
    Execute(Step, bool),
    /// Several brief steps, each with so much time; none is begun any more once it is set.
    Several(Vec<Step>, Duration, Arc<AtomicBool>),
    Observe,
    ObserveSome(Vec<ComponentName>),
    ObserveComponent(ComponentName),
}

struct Job {
    ticket: Ticket,
    call: Call,
    deadline: Time,
}

pub(super) struct Pool {
    clock: Clock,
    platform: Arc<dyn Platform>,
    post: Post,
    jobs: (Sender<Job>, Receiver<Job>),
    /// Workers that wait for a job or are at one, not counting those given up.
    workers: usize,
    busy: usize,
    bound: usize,
    next: u64,
    /// What came of calls that somebody waits for.
    replies: Vec<(Ticket, Reply)>,
    /// Calls that nobody waits for any more.
    given_up: FxHashSet<Ticket>,
}

/// Calls `platform` and survives its panic: whether the step happened is then unknown.
pub(super) fn execute(platform: &dyn Platform, step: &Step, deadline: Time, safe: bool) -> Outcome {
    let call = || if safe { platform.execute_safe(step, deadline) } else { platform.execute(step, deadline) };
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| {
        Outcome::Unknown(Cause::Lost(format!("the platform panicked: {}", crate::time::clock::panic_text(&*payload))))
    })
}

fn perform(platform: &dyn Platform, call: Call, deadline: Time) -> Reply {
    let lost = || ObserveError::Lost("the platform panicked".to_owned());
    match call {
        Call::Execute(step, safe) => Reply::Executed(execute(platform, &step, deadline, safe)),
        Call::Several(steps, each, stop) => {
            let count = steps.len();
            let several = catch_unwind(AssertUnwindSafe(|| platform.execute_brief(steps, each, deadline, &stop)));
            Reply::Several(several.unwrap_or_else(|_| {
                let outcome = Outcome::Unknown(Cause::Lost("the platform panicked".to_owned()));
                vec![Ended { outcome, took: None }; count]
            }))
        }
        Call::Observe => Reply::Observed(
            catch_unwind(AssertUnwindSafe(|| platform.observe(deadline))).unwrap_or_else(|_| Err(lost())),
        ),
        Call::ObserveSome(names) => Reply::Observed(
            catch_unwind(AssertUnwindSafe(|| platform.observe_some(&names, deadline))).unwrap_or_else(|_| Err(lost())),
        ),
        Call::ObserveComponent(name) => Reply::ObservedComponent(
            catch_unwind(AssertUnwindSafe(|| platform.observe_component(name, deadline)))
                .unwrap_or_else(|_| Err(lost())),
        ),
    }
}

impl Pool {
    pub fn new(clock: Clock, platform: Arc<dyn Platform>, post: Post, bound: usize) -> Self {
        let jobs = clock.channel(bound.max(1) + limits::WORKERS_GIVEN_UP);
        Self {
            clock,
            platform,
            post,
            jobs,
            workers: 0,
            busy: 0,
            bound: bound.max(1),
            next: 0,
            replies: Vec::new(),
            given_up: FxHashSet::default(),
        }
    }

    /// Whether a worker is free (or can be had), with so many left over.
    pub fn has_room_beside(&self, others: usize) -> bool {
        self.busy + others.min(self.bound - 1) < self.bound
    }

    /// Hands `call` to a worker.
    pub fn start(&mut self, call: Call, deadline: Time) -> Ticket {
        if self.busy >= self.workers {
            self.hire();
        }
        self.next += 1;
        let ticket = Ticket(self.next);
        self.busy += 1;
        // There is room: at most `bound` calls are out at once.
        if self.jobs.0.try_send(Job { ticket, call, deadline }).is_err() {
            self.post.send(Mail::Reply(ticket, Reply::Executed(Outcome::NotDone(Cause::Lost("no worker".to_owned())))));
        }
        ticket
    }

    /// A worker is back with what came of its call.
    pub fn came(&mut self, ticket: Ticket, reply: Reply) {
        if self.given_up.remove(&ticket) {
            self.workers += 1;
        } else {
            self.busy = self.busy.saturating_sub(1);
            self.replies.push((ticket, reply));
        }
    }

    /// What came of a call, once.
    pub fn take(&mut self, ticket: Ticket) -> Option<Reply> {
        let at = self.replies.iter().position(|(of, _)| *of == ticket)?;
        Some(self.replies.swap_remove(at).1)
    }

    /// The call is waited for no more: it is not back long after its deadline. When it comes back its worker is free again.
    pub fn give_up(&mut self, ticket: Ticket) {
        if self.take(ticket).is_none() {
            self.given_up.insert(ticket);
            self.busy = self.busy.saturating_sub(1);
            self.workers = self.workers.saturating_sub(1);
        }
    }

    fn hire(&mut self) {
        let (jobs, post, platform) = (self.jobs.1.clone(), self.post.clone(), self.platform.clone());
        let worker = move || {
            while let Ok(Job { ticket, call, deadline }) = jobs.recv() {
                post.send(Mail::Reply(ticket, perform(&*platform, call, deadline)));
            }
        };
        // Without a thread the job waits for a worker that comes back; its deadline bounds that.
        if self.clock.try_spawn("configurator: worker", worker).is_ok() {
            self.workers += 1;
        }
    }
}
