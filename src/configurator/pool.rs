//! The workers that make blocking calls to the platform, so that the configurator's own thread never waits for a
//! component.
//!
//! A worker is given one call at a time and reports its end to the configurator's inbox. A platform promises to answer
//! by the deadline; a worker whose call is not back a while after it is given up and replaced, and its late report is
//! told apart by its ticket. Where too many are stuck no further call is made, but for what is safe.

use super::inbox::{Mail, PoolReply, PoolTicket, Post};
use crate::limits;
use crate::model::{ComponentName, Step};
use crate::platform::{Cause, ObserveError, Outcome, Platform, StepBatch, TimedStep};
use crate::time::{Clock, Receiver, Sender, Time, TrySendError};
use rustc_hash::FxHashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// What a worker is to call.
pub(super) enum PlatformCall {
    Execute(StepBatch),
    Observe,
    ObserveSome(Vec<ComponentName>),
    ObserveComponent(ComponentName),
}

/// Whose call it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CallFor {
    /// Anybody's.
    Plain,
    /// A look that tells what a call has done: without it that is not known, and the system broken.
    Look,
    /// Of a safe configuration, or of what takes everything down: it has workers beside those of all others.
    Safe,
}

struct PoolJob {
    ticket: PoolTicket,
    call: PlatformCall,
    deadline: Time,
}

pub(super) struct Pool {
    clock: Clock,
    platform: Arc<dyn Platform>,
    post: Post,
    /// Has the configurator look at what calls that are out have answered.
    tell: Arc<dyn Fn() + Send + Sync>,
    jobs: (Sender<PoolJob>, Receiver<PoolJob>),
    /// Workers that wait for a job or are at one, not counting those given up.
    workers: usize,
    busy: usize,
    bound: usize,
    next: u64,
    /// What came of calls that somebody waits for.
    replies: Vec<(PoolTicket, PoolReply)>,
    /// Calls that nobody waits for any more.
    given_up: FxHashSet<PoolTicket>,
    /// No call was made since too many are stuck, and nobody was told yet.
    refused: Option<String>,
    /// That was told, and none has come back since.
    told: bool,
}

/// Calls `platform` for an immediate step and survives its panic: whether the step happened is then unknown.
pub(super) fn execute(platform: &dyn Platform, step: &Step, deadline: Time, safe: bool) -> Outcome {
    let call = || if safe { platform.execute_safe(step, deadline) } else { platform.execute(step, deadline) };
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|payload| Outcome::Unknown(Cause::Lost(panicked(&*payload))))
}

fn panicked(payload: &(dyn std::any::Any + Send)) -> String {
    format!("the platform panicked: {}", crate::time::clock::panic_text(payload))
}

fn perform(platform: &dyn Platform, call: PlatformCall, deadline: Time) -> PoolReply {
    let lost = || ObserveError::Lost("the platform panicked".to_owned());
    match call {
        PlatformCall::Execute(batch) => {
            let lost = catch_unwind(AssertUnwindSafe(|| platform.execute_batch(&batch))).err();
            batch.returned(lost.map(|payload| panicked(&*payload)).as_deref());
            PoolReply::Executed
        }
        PlatformCall::Observe => PoolReply::Observed(
            catch_unwind(AssertUnwindSafe(|| platform.observe(deadline))).unwrap_or_else(|_| Err(lost())),
        ),
        PlatformCall::ObserveSome(names) => PoolReply::Observed(
            catch_unwind(AssertUnwindSafe(|| platform.observe_some(&names, deadline))).unwrap_or_else(|_| Err(lost())),
        ),
        PlatformCall::ObserveComponent(name) => PoolReply::ObservedComponent(
            catch_unwind(AssertUnwindSafe(|| platform.observe_component(name, deadline)))
                .unwrap_or_else(|_| Err(lost())),
        ),
    }
}

impl Pool {
    pub fn new(clock: Clock, platform: Arc<dyn Platform>, post: Post, bound: usize) -> Self {
        let jobs = clock.channel(bound.max(1) + limits::WORKERS_GIVEN_UP + 2 * limits::WORKERS_SAFE);
        let told = post.clone();
        Self {
            clock,
            platform,
            post,
            tell: Arc::new(move || told.answers()),
            jobs,
            workers: 0,
            busy: 0,
            bound: bound.max(1),
            next: 0,
            replies: Vec::new(),
            given_up: FxHashSet::default(),
            refused: None,
            told: false,
        }
    }

    /// Whether a worker is free (or can be had), with so many left over.
    pub fn has_room_beside(&self, others: usize) -> bool {
        self.busy + others.min(self.bound - 1) < self.bound
    }

    /// Whether a worker can be had for what is safe, of which so many calls are out: it does not wait for others that are stuck.
    pub fn has_room_for_safe(&self, out: usize) -> bool {
        out < self.bound && self.busy < self.bound + limits::WORKERS_SAFE
    }

    /// Steps that are to be carried out in one call; whether they belong to a safe configuration.
    pub fn batch(&self, steps: Vec<TimedStep>, safe: bool) -> StepBatch {
        StepBatch::telling(self.clock.clone(), steps, safe, self.tell.clone())
    }

    /// Hands `call` to a worker.
    pub fn start(&mut self, call: PlatformCall, deadline: Time, whose: CallFor) -> PoolTicket {
        self.next += 1;
        let ticket = PoolTicket(self.next);
        self.busy += 1;
        let more = match whose {
            CallFor::Plain => 0,
            CallFor::Look => limits::WORKERS_SAFE / 2,
            CallFor::Safe => limits::WORKERS_SAFE,
        };
        if self.given_up.len() >= limits::WORKERS_GIVEN_UP + more {
            let why = format!("{} calls have not returned: no further one is made", self.given_up.len());
            self.refuse(ticket, &call, &why);
            if !std::mem::replace(&mut self.told, true) {
                self.refused = Some(why);
            }
            return ticket;
        }
        if self.busy > self.workers {
            self.hire();
        }
        if let Err(TrySendError::Full(job) | TrySendError::Closed(job)) =
            self.jobs.0.try_send(PoolJob { ticket, call, deadline })
        {
            self.refuse(ticket, &job.call, "no worker is free");
        }
        ticket
    }

    /// A call is not made.
    fn refuse(&mut self, ticket: PoolTicket, call: &PlatformCall, why: &str) {
        let reply = match call {
            PlatformCall::Execute(batch) => {
                batch.not_begun(Cause::Lost(why.to_owned()));
                PoolReply::Executed
            }
            PlatformCall::Observe | PlatformCall::ObserveSome(_) => {
                PoolReply::Observed(Err(ObserveError::Lost(why.to_owned())))
            }
            PlatformCall::ObserveComponent(_) => PoolReply::ObservedComponent(Err(ObserveError::Lost(why.to_owned()))),
        };
        self.came(ticket, reply);
    }

    /// That no further call is made, and why: once for as long as it is so.
    pub fn take_refused(&mut self) -> Option<String> {
        self.refused.take()
    }

    /// A worker is back with what came of its call.
    pub fn came(&mut self, ticket: PoolTicket, reply: PoolReply) {
        if self.given_up.remove(&ticket) {
            self.workers += 1;
            self.told = false;
        } else {
            self.busy = self.busy.saturating_sub(1);
            self.replies.push((ticket, reply));
        }
    }

    /// What came of a call, once.
    pub fn take(&mut self, ticket: PoolTicket) -> Option<PoolReply> {
        let at = self.replies.iter().position(|(of, _)| *of == ticket)?;
        Some(self.replies.swap_remove(at).1)
    }

    /// The call is waited for no more: it is not back long after its deadline. When it comes back its worker is free again.
    pub fn give_up(&mut self, ticket: PoolTicket) {
        if self.take(ticket).is_none() {
            self.given_up.insert(ticket);
            self.busy = self.busy.saturating_sub(1);
            self.workers = self.workers.saturating_sub(1);
        }
    }

    fn hire(&mut self) {
        let (jobs, post, platform) = (self.jobs.1.clone(), self.post.clone(), self.platform.clone());
        let worker = move || {
            while let Ok(PoolJob { ticket, call, deadline }) = jobs.recv() {
                post.send(Mail::Reply(ticket, perform(&*platform, call, deadline)));
            }
        };
        // Without a thread the job waits for a worker that comes back; its deadline bounds that.
        if self.clock.try_spawn("configurator: worker", worker).is_ok() {
            self.workers += 1;
        }
    }
}
