//! The configurator's own thread: mail comes in, what the desk lets begin goes on, everything is answered; it survives itself.

use super::conditions::{Conditions, Standings};
use super::confirmations::Confirmations;
use super::control::{ConfiguratorView, ControlCommand, Moment, QueuedCommand, StoppingBegan, UrgentCommand};
use super::inbox::{Counts, Mail};
use super::looks::Observing;
use super::pool::Pool;
use super::progress::{AnswerSink, Progress, ProgressSink};
use super::request::{Answer, Reason, Request};
use super::running::{Purpose, Running};
use super::safety::Safety;
use super::suspects::{CameBack, Suspects};
use super::switches::Fast;
use crate::model::{Ask, ConfigId, Configuration, DeploymentLimits, Ident, RunState, Snapshot, Verdict};
use crate::plan::PlanContext;
use crate::platform::{Platform, PlatformEvent};
use crate::stack::claims::Claims;
use crate::stack::{Arrived, Batch, BeforeEmergency, Desk, FrameId, LedDown, Requester, Why, World};
use crate::time::{Clock, Receiver, RecvError, Time};
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::any::Any;
use std::collections::{BTreeSet, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// What is applied when everything is taken down by force, in order: what is safe, and what brings the system to rest.
#[derive(Debug, Clone, Default)]
pub(super) struct Force {
    pub safe: Vec<ConfigId>,
    pub rest: Vec<ConfigId>,
}

/// What a configurator is told once and for all.
pub(super) struct Given {
    pub clock: Clock,
    pub platform: Arc<dyn Platform>,
    pub limits: DeploymentLimits,
    pub configurations: Arc<FxHashMap<ConfigId, Configuration>>,
    pub claims: Claims,
    pub force: Force,
    /// What an operator may apply, beside what is safe.
    pub operator: FxHashSet<ConfigId>,
    pub context: PlanContext,
    pub coordinators: BTreeSet<Requester>,
    pub subsystems: Vec<(Ident, Vec<Requester>)>,
    pub answers: AnswerSink,
    pub progress: Option<ProgressSink>,
    /// Who evaluates conditions.
    pub conditions: Option<Arc<dyn Conditions>>,
}

pub(super) struct Engine {
    pub given: Given,
    pub pool: Pool,
    pub inbox: Receiver<Mail>,
    pub counts: Arc<Counts>,
    /// The configurations that stand for something.
    pub standings: Standings,
    /// The slow look at what nothing is under way with.
    pub observing: Observing,
    /// System, stack and what is broken.
    pub world: World,
    /// Who waits for whom.
    pub desk: Desk,
    /// Transactions under way, and how many there were.
    pub running: Vec<Running>,
    pub numbers: u64,
    /// Steps that have ended.
    pub steps: u64,
    pub safety: Safety,
    /// Commands that wait.
    pub commands: VecDeque<QueuedCommand>,
    pub suspects: Suspects,
    /// A component came back: what is broken may be mended.
    pub returned: CameBack,
    /// What partial frames are left of.
    pub partials: Vec<(FrameId, Arc<super::request::Residual>)>,
    /// It was told last that something is broken, or in part in force.
    pub told_broken: bool,
    /// Plans that are carried out again, at most so many of each configuration, the one used last at the end.
    pub switches: FxHashMap<ConfigId, Vec<Fast>>,
    pub confirmations: Confirmations,
    /// Emergencies that are not over.
    pub emergencies: Vec<BeforeEmergency>,
    /// Coordinators that are down.
    pub down: BTreeSet<Requester>,
    /// Requests that have begun and were not answered.
    pub current: SmallVec<[(Request, Time); 4]>,
    pub revision: u64,
    /// Kept for the next view, with what it is a picture of.
    snapshot: Option<((u64, u64), Arc<Snapshot>)>,
    pub stopping: bool,
    /// Everything is being taken down.
    pub taking_down: bool,
    /// When stopping began, and what was in force then.
    pub began: Option<StoppingBegan>,
    /// When the event that ends the deployment came, and it is not down since.
    pub leaving: Option<Moment>,
    /// Subsystems that are led down by themselves, as of so many changes.
    pub leaving_inside: (usize, SmallVec<[Ident; 2]>),
    /// What takes its time has been broken off, since force is wanted.
    pub hurried: bool,
    /// Panics since there was last nothing to be done.
    pub panics: usize,
    /// The command that is being carried out: a panic that takes it does not end it.
    pub doing: Option<QueuedCommand>,
    /// A listener has panicked when it was told an answer.
    pub listener: Option<Box<dyn Any + Send>>,
}

impl Engine {
    pub fn new(given: Given, pool: Pool, inbox: Receiver<Mail>, counts: Arc<Counts>, world: World) -> Self {
        Self {
            given,
            pool,
            inbox,
            counts,
            standings: Standings::default(),
            observing: Observing::default(),
            world,
            desk: Desk::default(),
            running: Vec::new(),
            numbers: 0,
            steps: 0,
            safety: Safety::default(),
            commands: VecDeque::new(),
            suspects: Suspects::default(),
            returned: CameBack::Nobody,
            partials: Vec::new(),
            told_broken: false,
            switches: FxHashMap::default(),
            confirmations: Confirmations::default(),
            emergencies: Vec::new(),
            down: BTreeSet::new(),
            current: SmallVec::new(),
            revision: 0,
            snapshot: None,
            stopping: false,
            taking_down: false,
            began: None,
            leaving: None,
            leaving_inside: (0, SmallVec::new()),
            hurried: false,
            panics: 0,
            doing: None,
            listener: None,
        }
    }

    /// The life of the configurator's thread.
    pub fn live(mut self) {
        while !self.stopping {
            if let Err(payload) = catch_unwind(AssertUnwindSafe(|| self.work())) {
                self.survive(&crate::time::clock::panic_text(&*payload));
            }
        }
        self.bid_farewell();
    }

    fn work(&mut self) {
        while !self.stopping {
            if let Some(payload) = self.listener.take() {
                resume_unwind(payload);
            }
            self.tell_broken();
            if let Some(command) = self.commands.pop_front() {
                self.counts.command_taken(command.only_asks());
                self.queued(command);
                continue;
            }
            let mut did = self.serve_safe();
            while !self.waits_for_a_look()
                && let Some(number) = self.begin_next()
            {
                did = true;
                self.begin(number);
                self.look_at_emergencies();
                if self.urgent() {
                    break;
                }
            }
            did |= self.advance_all();
            self.look_at_emergencies();
            self.review_standings();
            self.tell_fallen();
            self.look_at_suspects();
            if did {
                self.glance();
                continue;
            }
            if self.revert_unconfirmed() {
                continue;
            }
            if self.returned == CameBack::Now {
                self.mend();
                continue;
            }
            if self.observe_slowly() {
                continue;
            }
            self.panics = 0;
            let confirm = self.confirmations.until();
            let looks = self.suspects.until().unwrap_or(Time::NEVER);
            let (observed, idle) = self.observing.until();
            let until = confirm.min(looks).min(observed).min(self.running_until()).min(self.standing_until());
            match self.inbox.recv_or_idle(until, idle) {
                Ok(Mail::Request(request)) if self.is_idle() && self.began.is_none() => {
                    self.heed_leaving();
                    self.comes_alone(request);
                }
                received => self.received(received),
            }
        }
    }

    /// The next batch that may begin, by its number.
    pub fn begin_next(&mut self) -> Option<u32> {
        self.heed_leaving();
        let Self { desk, given, world, leaving, leaving_inside, running, .. } = self;
        let safe: SmallVec<[ConfigId; 1]> = running.iter().filter_map(Running::safe_configuration).collect();
        let whole = leaving.is_some().then_some(LedDown::Whole);
        let led: SmallVec<[LedDown; 2]> = match whole {
            Some(whole) => SmallVec::from_slice(&[whole]),
            None => leaving_inside.1.iter().copied().map(LedDown::Inside).collect(),
        };
        let along = |batch: &Batch| {
            led.iter().find_map(|led| Some((*led, world.stack.taken_along(batch, *led, &given.claims)?)))
        };
        desk.begin_next(&given.claims, along, &safe).map(|active| active.number)
    }

    /// Takes in what has come, waiting for something until `until`.
    pub fn pump(&mut self, until: Time) {
        let received = self.inbox.recv_or_idle(until, Time::NEVER);
        self.received(received);
    }

    fn received(&mut self, received: Result<Mail, RecvError>) {
        match received {
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
        // Nearly never, and to look costs less than to take.
        if self.counts.reports_lost.load(Ordering::Acquire) && self.counts.reports_lost.swap(false, Ordering::AcqRel) {
            self.suspects.report_all(&self.world.system);
            self.returned = CameBack::Now;
            self.counts.missed().into_iter().for_each(|event| self.confirmed(event));
        }
    }

    pub fn take_in(&mut self, mail: Mail) {
        self.heed_leaving();
        match mail {
            Mail::Request(request) => self.arrive(Batch::one(request)),
            Mail::Batch(batch) => self.arrive(*batch),
            Mail::Reply(ticket, reply) => self.pool.came(ticket, reply),
            Mail::Platform(event) => {
                self.counts.report_taken();
                self.reported(event);
            }
            // Whoever waits for it looks.
            Mail::Truths => self.counts.truths.store(false, Ordering::Release),
            Mail::Answers => self.counts.answers.store(false, Ordering::Release),
            Mail::Event(event) => {
                self.counts.report_taken();
                self.confirmed(event);
            }
            Mail::Command(ControlCommand::AtOnce(command)) => {
                self.counts.command_taken(command.only_asks());
                self.at_once(command);
            }
            // What is queued keeps its place until then.
            Mail::Command(ControlCommand::Queued(command)) => self.commands.push_back(command),
        }
    }

    fn at_once(&mut self, command: UrgentCommand) {
        match command {
            // How things stand can be told at any time.
            UrgentCommand::View { system, reply } => _ = reply.try_send(self.view(system)),
            UrgentCommand::Define { configuration, listed, reply } => {
                self.given.define(*configuration, listed, &mut self.switches);
                let _ = reply.try_send(());
            }
            UrgentCommand::Stopping => self.stopping_begins(),
            // To have it come is all: who waits looks whether force is wanted.
            UrgentCommand::Hurry => {}
            // It is no defect of the place it comes from.
            UrgentCommand::Panic => resume_unwind(Box::new("a panic was injected".to_owned())),
            UrgentCommand::Down(coordinator) => self.told_down(coordinator),
        }
    }

    /// A batch comes: what it overtakes, gives up or cancels is answered, the rest waits its turn.
    pub fn arrive(&mut self, batch: Batch) {
        let Some(batch) = self.without_refused(batch) else { return };
        let configurations = self.given.configurations.clone();
        let safe = |id: ConfigId| configurations.get(&id).is_some_and(|c| c.safe);
        let arrival = self.desk.arrive(batch, safe, &self.given.claims);
        for arrived in arrival.in_order() {
            match arrived {
                Arrived::Told(request, verdict, reason) => {
                    self.owe(request);
                    if verdict == Verdict::UndoFailed {
                        let newest = self.given.claims.newest_is_meant(&request);
                        let held = self.frames_left();
                        if !(newest && self.leaves_coming(&request) || self.world.stays(&request, &held)) {
                            self.leaves_coming(&request);
                        }
                    }
                    let reason = (verdict != Verdict::Undone).then_some(reason);
                    self.answer(request, verdict, reason);
                }
                Arrived::GivesUp(number, undo) => {
                    self.owe(undo);
                    self.give_up_request(number, undo);
                }
                Arrived::Safe(safe) => {
                    let applied = self.running.iter().filter_map(|running| match &running.purpose {
                        Purpose::Safe(safe) => Some(&safe.0),
                        _ => None,
                    });
                    let waiting = self.safety.waiting.iter().chain(applied);
                    self.world.note_gone(&safe, &self.given.claims, waiting, self.desk.requests_mut());
                    self.safety.waiting.push_back(safe);
                }
            }
        }
        self.changed();
    }

    fn reported(&mut self, event: PlatformEvent) {
        if let Some(conditions) = &self.given.conditions {
            conditions.nudge();
        }
        match event {
            PlatformEvent::Faulted { component, .. } => {
                self.suspects.report_fault(component);
                self.fails_in_emergency(component);
            }
            PlatformEvent::Returned { component, .. } => {
                self.suspects.report(component);
                self.returned = CameBack::Now;
                self.observing.at_once(self.given.clock.now());
                self.note_quarantine();
            }
            PlatformEvent::Raised { .. } => {}
        }
        self.changed();
    }

    /// Whether something waits that everything else gives way to.
    pub fn urgent(&self) -> bool {
        self.counts.safe.load(Ordering::Acquire) > 0 || self.commands.iter().any(QueuedCommand::is_urgent)
    }

    pub fn note_quarantine(&mut self) {
        let mut now = self.given.platform.quarantined();
        now.sort_unstable();
        if now != self.world.quarantined {
            self.world.quarantined = now;
            self.changed();
        }
    }

    /// Something that the view shows changed.
    pub fn changed(&mut self) {
        self.revision += 1;
    }

    /// A number for a transaction.
    pub fn number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    /// A request makes room in the queue and is owed an answer.
    pub fn owe(&mut self, request: Request) {
        self.owe_since(request, self.given.clock.now());
    }

    pub fn owe_since(&mut self, request: Request, begun: Time) {
        if request.why == Why::Asked {
            let count = if self.is_safe(&request) { &self.counts.safe } else { &self.counts.requests };
            count.fetch_sub(1, Ordering::AcqRel);
            self.down.remove(&request.requester);
        }
        self.current.push((request, begun));
    }

    /// Whether that asks for a safe configuration.
    pub fn is_safe(&self, request: &Request) -> bool {
        matches!(request.ask, Ask::Apply(id) if self.given.configurations.get(&id).is_some_and(|c| c.safe))
    }

    /// Answers a request that has begun.
    pub fn answer(&mut self, request: Request, verdict: Verdict, reason: Option<Reason>) {
        let Some(at) = self.current.iter().position(|(r, _)| r.id == request.id && r.ask == request.ask) else {
            debug_assert!(false, "a request is answered once");
            return;
        };
        // No longer owed, whatever the listeners do with it.
        let (_, begun) = self.current.remove(at);
        self.note_answered(&request);
        self.confirmations.answered(request.id);
        self.tell_answer(request, verdict, reason.map(Arc::new), begun);
    }

    /// What was owed is over, and nobody is told.
    pub fn forget(&mut self, request: Request) {
        self.current.retain(|(r, _)| !(r.id == request.id && r.ask == request.ask && r.why == request.why));
        self.confirmations.answered(request.id);
    }

    /// Tells an answer, or a notice in the form of one.
    pub fn tell_answer(&mut self, request: Request, verdict: Verdict, reason: Option<Arc<Reason>>, begun: Time) {
        let at = self.given.clock.now();
        let took = at.since(begun);
        let answer = Answer { request, verdict, at, took, reason };
        self.changed();
        // Who asked is told, whatever becomes of those who only listen, and so is who else is answered now.
        if let Some(progress) = &self.given.progress
            && let Err(payload) = catch_unwind(AssertUnwindSafe(|| progress(&Progress::Answered(answer.clone()))))
        {
            self.listener = Some(payload);
        }
        (self.given.answers)(answer);
    }

    pub fn view(&mut self, system: bool) -> Arc<ConfiguratorView> {
        let stack = self.frame_views();
        let system = system.then(|| match &self.snapshot {
            Some((of, snapshot)) if *of == (self.revision, self.world.system.revision()) => snapshot.clone(),
            _ => {
                let mut snapshot = self.world.system.snapshot();
                for name in self.suspects.faulted() {
                    snapshot.components.entry(name).and_modify(|component| component.state = RunState::Faulted);
                }
                let snapshot = Arc::new(snapshot);
                self.snapshot = Some(((self.revision, self.world.system.revision()), snapshot.clone()));
                snapshot
            }
        });
        Arc::new(ConfiguratorView {
            system,
            stack,
            broken: self.broken_longest(),
            residuals: self.world.broken.iter().map(|broken| broken.residual.clone()).collect(),
            partial: self.left_partial(),
            quarantined: self.world.quarantined.clone(),
        })
    }

    /// What is broken longest, or left over longest in a partial frame.
    fn broken_longest(&mut self) -> Option<Arc<super::request::Residual>> {
        let stack = &self.world.stack;
        self.partials.retain(|(frame, _)| stack.frame(*frame).is_some_and(|frame| frame.partial));
        let broken = self.world.broken.first().map(|broken| &broken.residual);
        broken.or(self.in_part().next().map(|(_, residual)| residual)).cloned()
    }

    /// Tells that something is broken now, or nothing any more.
    pub(super) fn tell_broken(&mut self) {
        if self.world.broken.is_empty() && self.partials.is_empty() && !self.told_broken {
            return;
        }
        let broken = self.broken_longest().is_some();
        if std::mem::replace(&mut self.told_broken, broken) != broken {
            self.given.tells(|| Progress::Broken(broken));
        }
    }

    /// What partial frames hold that nothing else tells of.
    fn left_partial(&self) -> Vec<super::request::Residual> {
        let told = |frame: &FrameId| self.world.broken.iter().any(|broken| broken.frame == Some(*frame));
        let left = self.in_part().filter(|(frame, _)| !told(frame));
        left.map(|(_, residual)| residual.of_partial(&self.world.system)).collect()
    }

    /// What is only in part in force, oldest first, with what is left of it.
    pub(super) fn in_part(&self) -> impl Iterator<Item = &(FrameId, Arc<super::request::Residual>)> {
        let stack = &self.world.stack;
        self.partials.iter().filter(|(frame, _)| stack.frame(*frame).is_some_and(|frame| stack.is_in_part(frame)))
    }
}
