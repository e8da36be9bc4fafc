//! The configurator's own thread: takes up requests one batch after the other, safe ones first, and survives itself.

use super::AnswerSink;
use super::control::{Busy, Command, View};
use super::fast::Fast;
use super::inbox::{Counts, Mail};
use super::pool::{Pool, Reply, Ticket};
use super::progress::{Progress, ProgressSink};
use super::request::{Answer, Batch, Reason, Request, Residual};
use super::transaction::{Interruption, Left};
use crate::model::{
    Ask, ComponentName, ConfigId, Configuration, DeploymentLimits, EventName, RunState, Snapshot, Verdict,
};
use crate::plan::Context;
use crate::platform::{Platform, PlatformEvent};
use crate::stack::{Requester, Stack};
use crate::system::System;
use crate::time::{Clock, Receiver, RecvError, Time};
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

/// The system is neither as before an application nor as after it.
pub(super) struct Broken {
    pub residual: Arc<Residual>,
    /// The system as it should be.
    pub expected: System,
    /// The configuration whose application broke it, and who asked: its undo recovers.
    pub culprit: Option<(ConfigId, Requester)>,
    /// May be mended without being asked, when a component comes back.
    pub mendable: bool,
}

/// A frame that waits for its confirmation.
pub(super) struct Confirming {
    pub request: Request,
    pub event: EventName,
    pub within: Duration,
    pub until: Time,
}

pub(super) struct Engine {
    pub clock: Clock,
    pub platform: Arc<dyn Platform>,
    pub limits: DeploymentLimits,
    pub configurations: Arc<FxHashMap<ConfigId, Configuration>>,
    pub context: Context,
    pub system: System,
    pub stack: Stack,
    pub pool: Pool,
    pub inbox: Receiver<Mail>,
    pub counts: Arc<Counts>,
    pub answers: AnswerSink,
    pub progress: Option<ProgressSink>,
    /// Batches that have not begun.
    pub queue: VecDeque<Batch>,
    /// Commands that wait.
    pub commands: VecDeque<Command>,
    pub replies: Vec<(Ticket, Reply)>,
    pub given_up: FxHashSet<Ticket>,
    pub broken: Option<Broken>,
    /// The picture as it should be, when a panic came in the middle of an application.
    pub expected: Option<System>,
    pub quarantined: Vec<ComponentName>,
    /// Components that were reported faulted and not looked at since.
    pub suspects: Vec<ComponentName>,
    /// A component came back: a broken system may be mended.
    pub returned: bool,
    /// Prepared switches.
    pub switches: FxHashMap<ConfigId, Box<Fast>>,
    pub confirming: Vec<Confirming>,
    /// Confirming events that came since the request under way began.
    pub heard: Vec<EventName>,
    /// The time of the configuration that is carried out.
    pub allowed: Duration,
    /// How long one step may take.
    pub patience: Duration,
    /// Requests that have begun and were not answered.
    pub current: SmallVec<[(Request, Time); 4]>,
    pub revision: u64,
    /// Kept for the next view, with what it is a picture of: a picture read back counts its revisions from anew, so the
    /// view's own revision belongs to it.
    snapshot: Option<((u64, u64), Arc<Snapshot>)>,
    /// The safe configurations that a forced teardown has applied already, and what they could not do.
    pub forced_safe: Option<(Vec<ConfigId>, Vec<Reason>)>,
    pub stopping: bool,
}

/// What a configurator is made of.
pub(super) struct Parts {
    pub clock: Clock,
    pub platform: Arc<dyn Platform>,
    pub limits: DeploymentLimits,
    pub configurations: Arc<FxHashMap<ConfigId, Configuration>>,
    pub context: Context,
    pub pool: Pool,
    pub inbox: Receiver<Mail>,
    pub counts: Arc<Counts>,
    pub answers: AnswerSink,
    pub progress: Option<ProgressSink>,
}

impl Engine {
    pub fn new(parts: Parts, system: System) -> Self {
        let stack = Stack::new(parts.limits.stack);
        Self {
            clock: parts.clock,
            platform: parts.platform,
            limits: parts.limits,
            configurations: parts.configurations,
            context: parts.context,
            system,
            stack,
            pool: parts.pool,
            inbox: parts.inbox,
            counts: parts.counts,
            answers: parts.answers,
            progress: parts.progress,
            queue: VecDeque::new(),
            commands: VecDeque::new(),
            replies: Vec::new(),
            given_up: FxHashSet::default(),
            broken: None,
            expected: None,
            quarantined: Vec::new(),
            suspects: Vec::new(),
            returned: false,
            switches: FxHashMap::default(),
            confirming: Vec::new(),
            heard: Vec::new(),
            allowed: Duration::ZERO,
            patience: parts.limits.step_timeout,
            current: SmallVec::new(),
            revision: 0,
            snapshot: None,
            forced_safe: None,
            stopping: false,
        }
    }

    /// The life of the configurator's thread.
    pub fn live(mut self) {
        while !self.stopping {
            if let Err(payload) = catch_unwind(AssertUnwindSafe(|| self.work())) {
                let text = crate::time::clock::panic_text(&*payload);
                // A panic while starting anew must not end the thread either: then there is no picture to be had.
                if catch_unwind(AssertUnwindSafe(|| self.start_anew(&text))).is_err() {
                    self.current.clear();
                }
            }
        }
        self.bid_farewell();
    }

    fn work(&mut self) {
        while !self.stopping {
            if let Some(command) = self.commands.pop_front() {
                self.command(command);
            } else if let Some(batch) = self.next_batch() {
                self.handle(batch);
            } else if self.confirming.iter().any(|waiting| waiting.until <= self.clock.now()) {
                self.revert_unconfirmed();
            } else if !self.suspects.is_empty() {
                self.read_suspects();
            } else if std::mem::take(&mut self.returned) {
                self.mend();
            } else {
                let until = self.confirming.iter().map(|waiting| waiting.until).min().unwrap_or(Time::NEVER);
                self.pump(until);
            }
        }
    }

    /// Takes in what has come, waiting for something until `until`.
    pub fn pump(&mut self, until: Time) {
        match self.inbox.recv_deadline(until) {
            Ok(mail) => self.take_in(mail),
            Err(RecvError::Timeout) => return,
            Err(RecvError::Closed) => {
                self.stopping = true;
                return;
            }
        }
        self.glance();
    }

    /// Takes in what has come, without waiting.
    pub fn glance(&mut self) {
        while let Ok(mail) = self.inbox.try_recv() {
            self.take_in(mail);
        }
        if self.counts.reports_lost.swap(false, Ordering::AcqRel) {
            self.suspects.clear();
            self.suspects.extend(self.system.graph().node_weights().map(|node| node.name));
            self.returned = true;
        }
    }

    fn take_in(&mut self, mail: Mail) {
        match mail {
            Mail::Batch(batch) => self.enqueue(batch),
            Mail::Reply(ticket, reply) => {
                if self.given_up.remove(&ticket) {
                    self.pool.came_back();
                } else {
                    self.pool.ended();
                    self.replies.push((ticket, reply));
                }
            }
            Mail::Platform(event) => {
                self.counts.report_taken();
                self.reported(event);
            }
            Mail::Event(event) => {
                self.counts.report_taken();
                self.confirming.retain(|waiting| waiting.event != event);
                self.heard.push(event);
            }
            Mail::Command(command) => {
                self.counts.command_taken();
                match command {
                    // How things stand can be told at any time.
                    Command::View { system, reply } => {
                        let _ = reply.try_send(self.view(system));
                    }
                    other => self.commands.push_back(other),
                }
            }
        }
    }

    fn reported(&mut self, event: PlatformEvent) {
        match event {
            PlatformEvent::Faulted { component, .. } => {
                self.suspects.push(component);
            }
            PlatformEvent::Returned { component, .. } => {
                self.suspects.push(component);
                self.returned = true;
                self.note_quarantine();
            }
            PlatformEvent::Raised { .. } => {}
        }
        self.changed();
    }

    /// Whether something waits that everything else gives way to.
    pub fn urgent(&self) -> bool {
        self.counts.safe.load(Ordering::Acquire) > 0 || self.commands.iter().any(Command::is_urgent)
    }

    pub fn has_reply(&self, ticket: Ticket) -> bool {
        self.replies.iter().any(|(t, _)| *t == ticket)
    }

    pub fn take_reply(&mut self, ticket: Ticket) -> Option<Reply> {
        let at = self.replies.iter().position(|(t, _)| *t == ticket)?;
        Some(self.replies.swap_remove(at).1)
    }

    /// The call is waited for no more; when it comes back its worker is free again.
    pub fn give_up(&mut self, ticket: Ticket) {
        if self.take_reply(ticket).is_none() {
            self.given_up.insert(ticket);
            self.pool.given_up();
        }
    }

    pub fn note_quarantine(&mut self) {
        let mut now = self.platform.quarantined();
        now.sort_unstable();
        if now != self.quarantined {
            self.quarantined = now;
            self.changed();
        }
    }

    /// Something that the view shows changed.
    pub fn changed(&mut self) {
        self.revision += 1;
    }

    pub fn is_safe(&self, request: &Request) -> bool {
        matches!(request.ask, Ask::Apply(id) if self.configurations.get(&id).is_some_and(|c| c.safe))
    }

    /// Queues a batch; an undo in it cancels its push that has not begun.
    fn enqueue(&mut self, batch: Batch) {
        let mut kept = Batch::default();
        for request in batch.requests {
            if let Ask::UndoOf(id) = request.ask
                && let Some(overtaken) = self.overtake(&mut kept, id, request.requester)
            {
                self.begin(overtaken);
                self.begin(request);
                self.answer(overtaken, Verdict::Cancelled, Some(Reason::Overtaken));
                self.answer(request, Verdict::Undone, None);
            } else {
                kept.requests.push(request);
            }
        }
        if !kept.requests.is_empty() {
            self.queue.push_back(kept);
        }
        self.changed();
    }

    fn overtake(&mut self, kept: &mut Batch, id: ConfigId, by: Requester) -> Option<Request> {
        let fits =
            |request: &Request| request.ask == Ask::Apply(id) && (by == Requester::Operator || request.requester == by);
        let batches = std::iter::once(kept).chain(self.queue.iter_mut().rev());
        for batch in batches {
            if let Some(at) = batch.requests.iter().rposition(fits) {
                return Some(batch.requests.remove(at));
            }
        }
        None
    }

    /// The next batch to be taken up: safe requests first, each by itself.
    fn next_batch(&mut self) -> Option<Batch> {
        if let Some(safe) = self.next_safe() {
            return Some(Batch::one(safe));
        }
        loop {
            let batch = self.queue.pop_front()?;
            if !batch.requests.is_empty() {
                return Some(batch);
            }
        }
    }

    /// The first safe request that waits, taken out of its batch.
    pub fn next_safe(&mut self) -> Option<Request> {
        if self.counts.safe.load(Ordering::Acquire) == 0 {
            return None;
        }
        for b in 0..self.queue.len() {
            if let Some(at) = self.queue[b].requests.iter().position(|request| self.is_safe(request)) {
                return Some(self.queue[b].requests.remove(at));
            }
        }
        None
    }

    /// `request` begins: it makes room in the queue and is owed an answer.
    pub fn begin(&mut self, request: Request) {
        let count = if self.is_safe(&request) { &self.counts.safe } else { &self.counts.requests };
        count.fetch_sub(1, Ordering::AcqRel);
        self.current.push((request, self.clock.now()));
    }

    /// Answers a request that has begun.
    pub fn answer(&mut self, request: Request, verdict: Verdict, reason: Option<Reason>) {
        let Some(at) = self.current.iter().position(|(r, _)| r.id == request.id && r.ask == request.ask) else {
            debug_assert!(false, "a request is answered once");
            return;
        };
        // No longer owed, whatever the listeners do with it.
        let (_, begun) = self.current.remove(at);
        self.tell_answer(request, verdict, reason.map(Arc::new), begun);
    }

    /// Tells an answer, or a notice in the form of one.
    pub fn tell_answer(&mut self, request: Request, verdict: Verdict, reason: Option<Arc<Reason>>, begun: Time) {
        let at = self.clock.now();
        let took = at.since(begun);
        let answer = Answer { request, verdict, at, took, reason };
        self.changed();
        if let Some(progress) = &self.progress {
            progress(&Progress::Answered(answer.clone()));
        }
        (self.answers)(answer);
    }

    /// Looks at components that were reported faulted (the report may be older than what was done since).
    pub fn read_suspects(&mut self) {
        let mut suspects = std::mem::take(&mut self.suspects);
        suspects.sort_unstable();
        suspects.dedup();
        for component in suspects {
            let reply = self.ask(super::pool::Call::ObserveComponent(component), false);
            if let Ok(Some(Reply::ObservedComponent(Ok(Some(seen))))) = reply
                && seen.state == RunState::Faulted
                && self.system.set_state(component, RunState::Faulted)
            {
                self.changed();
            }
        }
    }

    pub fn view(&mut self, system: bool) -> Arc<View> {
        let stack = self.frame_views();
        let system = system.then(|| match &self.snapshot {
            Some((of, snapshot)) if *of == (self.revision, self.system.revision()) => snapshot.clone(),
            _ => {
                let snapshot = Arc::new(self.system.snapshot());
                self.snapshot = Some(((self.revision, self.system.revision()), snapshot.clone()));
                snapshot
            }
        });
        Arc::new(View {
            revision: self.revision,
            system,
            stack,
            busy: self.current.first().map(|(request, since)| Busy::of(request, *since)),
            waiting: self.queue.iter().map(|batch| batch.requests.len()).sum(),
            broken: self.broken.as_ref().map(|broken| broken.residual.clone()),
            quarantined: self.quarantined.clone(),
        })
    }

    /// After a panic: what is owed is answered *broken*, and the picture is read back from the platform.
    fn start_anew(&mut self, text: &str) {
        if let Some(progress) = &self.progress {
            progress(&Progress::Survived(text.to_owned()));
        }
        let expected = self.expected.take().unwrap_or_else(|| self.system.clone());
        let reason = Reason::Panic(text.to_owned());
        let mut between = Interruption::closed();
        let observed = match self.look(&mut between) {
            Some(seen) => self.adopt(&seen).is_ok(),
            None => false,
        };
        let left = Left::of(reason.clone());
        let residual = Arc::new(self.residual(left, &expected, observed));
        if self.broken.is_none() && (!residual.is_empty() || !observed) {
            self.broken = Some(Broken { residual: residual.clone(), expected, culprit: None, mendable: true });
        }
        while let Some((request, begun)) = self.current.pop() {
            let verdict = match request.ask {
                Ask::Apply(_) | Ask::Commit { .. } => Verdict::Broken,
                Ask::UndoOf(_) | Ask::Undo | Ask::UndoTo(_) => Verdict::UndoBroken,
            };
            self.tell_answer(request, verdict, Some(Arc::new(Reason::Broken(residual.clone()))), begun);
        }
    }

    /// Everything that still waits is answered.
    fn bid_farewell(&mut self) {
        self.glance();
        while let Some(batch) = self.queue.pop_front() {
            for request in batch.requests {
                let verdict = match request.ask {
                    Ask::Apply(_) | Ask::Commit { .. } => Verdict::Failed,
                    Ask::UndoOf(_) | Ask::Undo | Ask::UndoTo(_) => Verdict::UndoFailed,
                };
                let now = self.clock.now();
                self.tell_answer(request, verdict, Some(Arc::new(Reason::Ended)), now);
            }
        }
    }
}
