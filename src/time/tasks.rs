//! Tasks: what is done step by step, again and again, and waits only between its steps.
//!
//! In real time a task is a thread. On a simulated clock a thread would be woken and put to sleep for every step, some
//! microseconds for what takes less than one; there as many threads as there are tasks run any of them, and one of them alone
//! runs step after step as long as nobody else is due. A step that waits in the middle after all (a component that sleeps, or
//! hangs) keeps its thread, and another one goes on with the rest. The order of steps is that of threads.

use super::clock::{Clock, Join, JoinError, TaskThread, TimeKind};
use super::schedule::{Called, ClockTask, Id, SchedulerState, TaskWait, WaitUntil};
use super::simulated::Scheduler;
use super::{Sender, Signal, Time, lock};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// A task, with what it is woken by and who is told of its end.
struct SignalledTask<F> {
    step: F,
    signal: Signal,
    /// It has waited for the signal, which is cleared when that has ended.
    waited: bool,
    done: Sender<Result<(), JoinError>>,
    /// For the thread that has run its last step, which is joined with it.
    last: TaskThread,
}

/// What is known of the scheduler's participants, locked.
type Locked<'s> = MutexGuard<'s, SchedulerState>;

impl<F: FnMut() -> TaskWait + Send> ClockTask for SignalledTask<F> {
    fn step(&mut self) -> TaskWait {
        if std::mem::take(&mut self.waited) {
            self.signal.clear();
        }
        (self.step)()
    }

    fn begin_wait(&mut self, deadline: Time, begin: &mut dyn FnMut() -> WaitUntil) -> bool {
        self.waited = self.signal.begin_wait(deadline, begin);
        self.waited
    }

    fn end(self: Box<Self>, panic: Option<Box<dyn Any + Send>>, thread: Option<JoinHandle<()>>) {
        let Self { step, done, last, .. } = *self;
        *lock(&last) = thread;
        let dropped = catch_unwind(AssertUnwindSafe(|| drop(step))).err();
        let outcome = panic.or(dropped).map_or(Ok(()), |payload| Err(JoinError::of(&*payload)));
        let _ = done.try_send(outcome);
    }
}

impl Clock {
    /// Does `step` again and again, each time when the one before has asked for it; `signal` is waited for by nobody else.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn try_spawn_task(
        &self,
        name: &str,
        signal: &Signal,
        step: impl FnMut() -> TaskWait + Send + 'static,
    ) -> std::io::Result<Join> {
        let signal = signal.clone();
        let scheduler = match &*self.0 {
            TimeKind::Simulated(scheduler) if !scheduler.is_paced() => scheduler,
            _ => {
                let (clock, mut step) = (self.clone(), step);
                return self.try_spawn(name, move || {
                    loop {
                        match step() {
                            TaskWait::Wait(deadline) => drop(signal.wait(deadline)),
                            TaskWait::Pause(until) => clock.sleep_until(until),
                            TaskWait::End => return,
                        }
                    }
                });
            }
        };
        let (clock, mut state) = (self.clone(), lock(&scheduler.state));
        // As many as there are tasks: one that waits in the middle of a step keeps the thread that runs it.
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || {
            if let TimeKind::Simulated(scheduler) = &*clock.0 {
                scheduler.run_tasks();
            }
        })?;
        // Before it can look for something to run.
        state.runners.insert(thread.thread().id(), thread);
        drop(state);
        let ((done, ended), last) = (self.channel(1), TaskThread::default());
        scheduler.register_task(Box::new(SignalledTask { step, signal, waited: false, done, last: last.clone() }));
        Ok(Join::of_task(ended, last))
    }
}

impl Scheduler {
    /// A new participant, ready for its first step.
    fn register_task(&self, task: Box<dyn ClockTask>) {
        let mut state = lock(&self.state);
        let id = state.add();
        if let Some(participant) = state.participants.get_mut(&id) {
            participant.task = Some(task);
        }
        state.ready.push_back(id);
        self.dispatch_and_call(state);
    }

    /// Runs whichever task is due, until one of them has ended: then there is a thread too many.
    fn run_tasks(&self) {
        Self::make_room();
        let mut state = lock(&self.state);
        loop {
            let due = state.due.take();
            let Some((id, task)) = due.and_then(|id| Some((id, state.participants.get_mut(&id)?.task.take()?))) else {
                state = self.idle_runners.wait(state).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            drop(state);
            self.be(id);
            let Some((task, locked)) = self.run_until_it_waits(id, task) else {
                self.leave();
                return;
            };
            self.be_nobody(id);
            state = locked;
            if let Some(participant) = state.participants.get_mut(&id) {
                participant.task = Some(task);
            }
            state.running = None;
            let called = self.dispatch(&mut state, None);
            // Another task: this thread takes it, no other one is woken.
            if matches!(called, Called::Thread(_)) {
                drop(state);
                self.call(called);
                state = lock(&self.state);
            }
        }
    }

    /// The task, which waits now, and what is locked since it does; none: it has ended.
    fn run_until_it_waits(&self, id: Id, mut task: Box<dyn ClockTask>) -> Option<(Box<dyn ClockTask>, Locked<'_>)> {
        loop {
            let mut waits = None;
            match catch_unwind(AssertUnwindSafe(|| task.step())) {
                Ok(TaskWait::Wait(deadline)) => {
                    task.begin_wait(deadline, &mut || {
                        let mut state = lock(&self.state);
                        let wait = self.begin_wait(&mut state, id, deadline);
                        waits = Some(state);
                        wait
                    });
                }
                Ok(TaskWait::Pause(until)) => {
                    let mut state = lock(&self.state);
                    if until > Time(self.now.load(Ordering::Relaxed)) {
                        self.begin_wait(&mut state, id, until);
                        waits = Some(state);
                    }
                }
                ended => {
                    let own = lock(&self.state).runners.remove(&std::thread::current().id());
                    task.end(ended.err(), own);
                    return None;
                }
            }
            if let Some(locked) = waits {
                return Some((task, locked));
            }
        }
    }
}
