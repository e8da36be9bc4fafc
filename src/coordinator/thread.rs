//! The coordinator's own thread.

use super::core::{ChartTrouble, Core, Listener};
use super::inbox::{Class, Dropped, Inbox, Incoming, NotAccepted, Put};
use super::{Delivered, Tag};
use crate::limits;
use crate::model::names::EventName;
use crate::statechart::{Chart, FunctionOutput, Hook, Nobody, NodeId, Printer, Raised};
use crate::time::clock::panic_text;
use crate::time::{Clock, Join, JoinError, Released, Signal, Time, lock};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, TryLockError};

/// A running coordinator. Cloning makes another handle of the same one; it ends when it is told to, not when the handles
/// are gone.
#[derive(Clone)]
pub struct CoordinatorHandle {
    shared: Arc<CoordinatorShared>,
}

struct CoordinatorShared {
    clock: Clock,
    chart: Arc<Chart>,
    /// The chart, once a model with functions has added to it.
    grown: OnceLock<Mutex<Arc<Chart>>>,
    inbox: Mutex<Inbox>,
    bell: Signal,
    /// Index of the active leaf plus one; 0 before the chart was entered. The leaf tells the whole active configuration.
    leaf: AtomicUsize,
    detached: AtomicBool,
    /// When the reaction under way began, in nanoseconds plus one; 0: it does not react.
    since: AtomicU64,
    /// Events that were lost inside the chart.
    lost: AtomicU64,
    /// Held while the coordinator reacts.
    reacting: Mutex<()>,
    /// Held while the listener is called; whoever holds it knows that nothing is being told. Not held while a function of
    /// the model runs, which may take as long as it likes.
    telling: Mutex<()>,
    thread: Mutex<Thread>,
}

#[derive(Default)]
struct Thread {
    join: Option<Join>,
    id: Option<std::thread::ThreadId>,
}

impl CoordinatorHandle {
    /// Starts a thread that enters the chart, and then reacts to what is [delivered](Self::deliver).
    pub fn start(name: &str, chart: Arc<Chart>, clock: &Clock, listener: impl Listener + Send + 'static) -> Self {
        Self::start_with(name, chart, clock, listener, || Ok(Nobody))
    }

    /// The same, with functions. `open` is called on the new thread, which they never leave. When it fails, the listener is
    /// told why, and the coordinator has ended.
    pub fn start_with<F: Hook>(
        name: &str,
        chart: Arc<Chart>,
        clock: &Clock,
        listener: impl Listener + Send + 'static,
        open: impl FnOnce() -> Result<F, String> + Send + 'static,
    ) -> Self {
        let inbox = Inbox::new(chart.events().iter().copied());
        let shared = Arc::new(CoordinatorShared {
            clock: clock.clone(),
            chart,
            grown: OnceLock::new(),
            inbox: Mutex::new(inbox),
            bell: clock.signal(),
            leaf: AtomicUsize::new(0),
            detached: AtomicBool::new(false),
            since: AtomicU64::new(0),
            lost: AtomicU64::new(0),
            reacting: Mutex::new(()),
            telling: Mutex::new(()),
            thread: Mutex::new(Thread::default()),
        });
        let coordinator = Self { shared };
        let mut thread = lock(&coordinator.shared.thread);
        let shared = coordinator.shared.clone();
        thread.join = Some(clock.spawn(name, move || shared.run(listener, open)));
        thread.id = thread.join.as_ref().and_then(|join| join.thread()).map(std::thread::Thread::id);
        drop(thread);
        coordinator
    }

    /// The chart it runs. It is the one it was started with, but for a model that adds to its own.
    pub fn chart(&self) -> Arc<Chart> {
        self.shared.chart()
    }

    /// Takes room for one event of a class: for an answer when it is asked for, for an event from outside before anybody else
    /// is told of it. The next event of that class that is delivered takes that room.
    ///
    /// # Errors
    /// [`NotAccepted`]: there is none (counted), or the coordinator has been detached.
    pub fn hold(&self, class: Class) -> Result<(), NotAccepted> {
        if self.is_detached() {
            return Err(NotAccepted::Detached);
        }
        lock(&self.shared.inbox).hold(class)
    }

    /// Gives room back that was taken and is not needed.
    pub fn release(&self, class: Class) {
        lock(&self.shared.inbox).release(class);
    }

    /// Puts an event into the inbox. Never waits.
    ///
    /// # Errors
    /// [`NotAccepted`]: there is no room (counted), or the coordinator has been detached.
    pub fn deliver(&self, incoming: Incoming) -> Result<Put, NotAccepted> {
        {
            let mut inbox = lock(&self.shared.inbox);
            if self.is_detached() {
                inbox.not_heard(incoming);
                return Err(NotAccepted::Detached);
            }
            inbox.push(incoming)
        }
        .inspect(|_| self.shared.bell.notify())
    }

    /// The active leaf; none before the chart was entered. Takes no lock (but for a model that has added to its chart).
    pub fn leaf(&self) -> Option<NodeId> {
        self.shared.leaf()
    }

    /// Full names of the active states, from the root to the leaf; empty before the chart was entered.
    pub fn active(&self) -> Vec<String> {
        let chart = &self.shared.chart();
        let mut names: Vec<String> =
            std::iter::successors(self.leaf(), |n| chart.parent(*n)).map(|n| chart.fqn(n).to_string()).collect();
        names.reverse();
        names
    }

    /// Whether a state is active.
    pub fn is_active(&self, state: NodeId) -> bool {
        self.leaf().is_some_and(|leaf| self.shared.chart().is_inside(leaf, state))
    }

    /// Events that found no room.
    pub fn dropped(&self) -> Dropped {
        let inside = self.shared.lost.load(Ordering::Relaxed);
        Dropped { inside, ..lock(&self.shared.inbox).dropped() }
    }

    /// Since when it has been reacting to one event; none: it waits for one. Never waits.
    pub fn reacting_since(&self) -> Option<Time> {
        self.shared.since.load(Ordering::Relaxed).checked_sub(1).map(Time)
    }

    /// Whether it has been reacting to one event for longer than [`limits::REACTION_LONG`]: a function of its model hangs.
    pub fn hangs(&self) -> bool {
        self.reacting_since().is_some_and(|since| self.shared.clock.now() > since + limits::REACTION_LONG)
    }

    /// Whether it was detached (or has ended).
    pub fn is_detached(&self) -> bool {
        self.shared.detached.load(Ordering::SeqCst)
    }

    /// Whether it has reacted to everything delivered so far: no event waits, and no step is under way.
    pub fn is_settled(&self) -> bool {
        match self.shared.reacting.try_lock() {
            Ok(_reacting) => lock(&self.shared.inbox).is_empty(),
            Err(TryLockError::Poisoned(_)) => true,
            Err(TryLockError::WouldBlock) => false,
        }
    }

    /// Takes the command from it: when this returns, its listener hears nothing from it any more. Waits for a call of the
    /// listener at most, never for a function of the model. Its last state stays readable; its thread ends by itself, once
    /// nothing in it hangs. Answers the urgent events to which it has not reacted, also where it hangs in one of them or has ended
    /// by itself; each is answered once.
    pub fn detach(&self) -> Vec<EventName> {
        // Under its lock: what comes later is refused, and nothing is put where nobody looks.
        {
            let _inbox = lock(&self.shared.inbox);
            self.shared.detached.store(true, Ordering::SeqCst);
        }
        self.shared.bell.notify();
        let own = lock(&self.shared.thread).id == Some(std::thread::current().id());
        if !own {
            drop(lock(&self.shared.telling));
        }
        lock(&self.shared.inbox).take_urgent()
    }

    /// Detaches it and waits for its thread to end.
    ///
    /// # Errors
    /// [`JoinError`]: it had not ended by the deadline, or its listener panicked.
    pub fn stop(&self, deadline: Time) -> Result<(), JoinError> {
        self.detach();
        let join = lock(&self.shared.thread).join.take();
        join.map_or(Ok(()), |join| join.join(deadline))
    }
}

impl std::fmt::Debug for CoordinatorHandle {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Coordinator").field("leaf", &self.leaf()).field("detached", &self.is_detached()).finish()
    }
}

impl CoordinatorShared {
    fn leaf(&self) -> Option<NodeId> {
        let number = self.leaf.load(Ordering::SeqCst).checked_sub(1)?;
        self.chart.node(number).or_else(|| self.chart().node(number))
    }

    fn chart(&self) -> Arc<Chart> {
        self.grown.get().map_or_else(|| self.chart.clone(), |grown| lock(grown).clone())
    }

    /// The life of the thread. However it ends, nobody waits for it any more; where nobody had detached it that is told at once.
    fn run<F: Hook>(&self, mut listener: impl Listener, open: impl FnOnce() -> Result<F, String>) {
        let ended = catch_unwind(AssertUnwindSafe(|| self.lead(&mut listener, open)));
        let by_itself = !self.detached.swap(true, Ordering::SeqCst);
        self.since.store(0, Ordering::Relaxed);
        lock(&self.inbox).clear();
        match ended {
            Ok(Err(why)) if by_itself => listener.ended(&why),
            Err(panic) => {
                if by_itself && !panic.is::<Released>() {
                    // It may be its listener that panics.
                    let why = format!("it panicked: {}", panic_text(&*panic));
                    let _ = catch_unwind(AssertUnwindSafe(|| listener.ended(&why)));
                }
                resume_unwind(panic);
            }
            Ok(_) => {}
        }
    }

    fn lead<F: Hook>(
        &self,
        listener: &mut impl Listener,
        open: impl FnOnce() -> Result<F, String>,
    ) -> Result<(), String> {
        let mut core = match open() {
            Ok(functions) => Core::with(self.chart.clone(), functions),
            Err(text) => {
                listener.said(&FunctionOutput { by: Printer::Err, text: text.clone() });
                return Err(format!("its functions cannot be run: {text}"));
            }
        };
        let mut listener = Publisher { shared: self, listener };
        let began = self.clock.now();
        self.react(began, || {
            core.start(began, &mut listener);
            true
        });
        self.lost.store(core.lost(), Ordering::Relaxed);
        let mut round = Round::default();
        let mut tickets = Vec::with_capacity(limits::INBOX_JOINED + 1);
        while !self.detached.load(Ordering::SeqCst) {
            let now = self.clock.now();
            // Taken out and reacted to under one lock, so that an event is always seen to be somewhere.
            let worked = self.react(now, || match self.next(&mut tickets) {
                Some(incoming) => {
                    let delivered = if incoming.overtaken {
                        listener.overtaken(incoming.event);
                        Delivered::Unmatched
                    } else {
                        core.deliver(incoming.event, incoming.tag, now, &mut listener)
                    };
                    tickets.iter().for_each(|ticket| listener.taken_up(*ticket, delivered));
                    lock(&self.inbox).reacted();
                    true
                }
                None if core.next_deadline().is_some_and(|due| due <= now) => {
                    core.tick(now, &mut listener);
                    true
                }
                None => false,
            });
            if worked {
                self.lost.store(core.lost(), Ordering::Relaxed);
                round.iterate(&self.clock, now);
            } else {
                listener.rested();
                self.bell.wait(core.next_deadline().unwrap_or(Time::NEVER));
            }
        }
        Ok(())
    }

    fn next(&self, tickets: &mut Vec<u64>) -> Option<Incoming> {
        lock(&self.inbox).pop(tickets)
    }

    /// Whether there was something to react to.
    fn react(&self, now: Time, reaction: impl FnOnce() -> bool) -> bool {
        let _reacting = lock(&self.reacting);
        if self.detached.load(Ordering::SeqCst) {
            return false;
        }
        self.since.store(now.0.saturating_add(1), Ordering::Relaxed);
        let worked = reaction();
        self.since.store(0, Ordering::Relaxed);
        worked
    }
}

/// How much happened at one moment of simulated time. A coordinator whose requests are answered at once and that goes
/// round for ever would keep time from moving, and nobody's deadline would ever come.
#[derive(Default)]
struct Round {
    at: Time,
    iterations: u32,
}

impl Round {
    /// It reacted at `now`; when that was too much for a moment, time passes.
    fn iterate(&mut self, clock: &Clock, now: Time) {
        if !clock.is_simulated() {
            return;
        }
        if now != self.at {
            *self = Self { at: now, iterations: 0 };
        }
        self.iterations = self.iterations.saturating_add(1);
        if self.iterations > limits::MOMENT_ITERATIONS {
            clock.sleep(limits::MOMENT_PAUSE);
            // Time that passes only here does not end the round.
            self.at = clock.now();
        }
    }
}

/// Between core and listener: publishes where the chart stands, and lets nothing through once detached.
struct Publisher<'a, L> {
    shared: &'a CoordinatorShared,
    listener: &'a mut L,
}

impl<L> Publisher<'_, L> {
    /// Calls the listener, unless the coordinator has been detached: that waits for the end of the call.
    fn tell(&mut self, call: impl FnOnce(&mut L)) {
        let _telling = lock(&self.shared.telling);
        if !self.shared.detached.load(Ordering::SeqCst) {
            call(self.listener);
        }
    }
}

impl<L: Listener> Listener for Publisher<'_, L> {
    fn raised(&mut self, chart: &Chart, batch: &[Raised]) {
        self.tell(|listener| listener.raised(chart, batch));
    }

    fn moved(&mut self, chart: &Chart, active: &[NodeId]) {
        let shared = self.shared;
        self.tell(|listener| {
            shared.leaf.store(active.last().map_or(0, |leaf| leaf.index() + 1), Ordering::SeqCst);
            listener.moved(chart, active);
        });
    }

    fn unmatched(&mut self, event: EventName) {
        self.tell(|listener| listener.unmatched(event));
    }

    fn overtaken(&mut self, event: EventName) {
        self.tell(|listener| listener.overtaken(event));
    }

    fn delivers(&mut self, event: EventName) {
        self.tell(|listener| listener.delivers(event));
    }

    fn taken_up(&mut self, ticket: u64, delivered: Delivered) {
        self.tell(|listener| listener.taken_up(ticket, delivered));
    }

    fn grown(&mut self, chart: &Arc<Chart>) {
        let mut known = lock(self.shared.grown.get_or_init(|| Mutex::new(chart.clone())));
        if !Arc::ptr_eq(&known, chart) {
            known.clone_from(chart);
        }
    }

    fn stale(&mut self, chart: &Chart, event: EventName, tag: Tag) {
        self.tell(|listener| listener.stale(chart, event, tag));
    }

    fn rested(&mut self) {
        self.tell(Listener::rested);
    }

    fn said(&mut self, said: &FunctionOutput) {
        self.tell(|listener| listener.said(said));
    }

    fn trouble(&mut self, chart: &Chart, trouble: ChartTrouble) {
        self.tell(|listener| listener.trouble(chart, trouble));
    }
}
