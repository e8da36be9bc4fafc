//! Threads that call what may take long or never return: hooks, operations of components that do not run.
//!
//! A worker that is free is used again; one that hangs is simply not free. They end with the platform.

use crate::limits;
use crate::time::{Clock, Join, Sender, lock};
use std::sync::{Arc, Mutex};

pub(super) type Job = Box<dyn FnOnce() + Send>;

/// A job with the way to the worker that does it, which the worker lays open again when it is done: without a job on it
/// and without being free, nobody can reach a worker, and it ends.
struct Task {
    job: Job,
    way: Sender<Task>,
}

pub(super) struct Workers {
    clock: Clock,
    shared: Arc<IdleWorkers>,
    threads: Mutex<Vec<Join>>,
}

#[derive(Default)]
struct IdleWorkers {
    /// The ways to those who are free; none: closed.
    free: Mutex<Option<Vec<Sender<Task>>>>,
}

impl Workers {
    pub(super) fn new(clock: &Clock) -> Self {
        let shared = Arc::new(IdleWorkers { free: Mutex::new(Some(Vec::new())) });
        Self { clock: clock.clone(), shared, threads: Mutex::new(Vec::new()) }
    }

    /// Has `job` done by a worker.
    ///
    /// # Errors
    /// When the operating system has no thread left, or the platform is being taken down.
    pub(super) fn run(&self, job: Job) -> Result<(), String> {
        let free = match &mut *lock(&self.shared.free) {
            None => return Err("the platform is being taken down".to_owned()),
            Some(free) => free.pop(),
        };
        let way = match free {
            Some(way) => way,
            None => self.hire()?,
        };
        let task = Task { job, way: way.clone() };
        way.try_send(task).map_err(|_| "a worker has ended".to_owned())
    }

    fn hire(&self) -> Result<Sender<Task>, String> {
        let (way, tasks) = self.clock.channel::<Task>(1);
        let shared = self.shared.clone();
        let thread = self.clock.try_spawn("davit-worker", move || {
            while let Ok(Task { job, way }) = tasks.recv() {
                job();
                if let Some(free) = &mut *lock(&shared.free) {
                    free.push(way);
                }
            }
        });
        let thread = thread.map_err(|error| format!("no thread for a worker: {error}"))?;
        let mut threads = lock(&self.threads);
        threads.retain(|thread| !thread.is_finished());
        threads.push(thread);
        Ok(way)
    }

    /// Ends all workers that are free, and those that become so in time.
    pub(super) fn close(&self) {
        drop(lock(&self.shared.free).take());
        let threads = std::mem::take(&mut *lock(&self.threads));
        for thread in threads {
            let _ = thread.join(self.clock.now() + limits::RUNTIME_END);
        }
    }
}
