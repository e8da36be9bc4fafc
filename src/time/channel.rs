//! Bounded queues between threads, on the clock's time.
//!
//! On the real clock they are crossbeam's; on a simulated one a receiver that waits gives the token away.

use super::clock::{Clock, TimeKind};
use super::schedule::WaitUntil;
use super::simulated::Scheduler;
use super::{Time, lock};
use crossbeam_channel as real;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// The end values go in at. Cloning makes another sender.
pub struct Sender<T>(ChannelEnd<real::Sender<T>, T>);

/// The end values come out at, each once. Cloning makes another receiver of the same queue.
pub struct Receiver<T>(ChannelEnd<real::Receiver<T>, T>);

enum ChannelEnd<R, T> {
    Real(Clock, R),
    Simulated(Clock, Arc<Mutex<ChannelQueue<T>>>),
}

struct ChannelQueue<T> {
    values: VecDeque<T>,
    bound: usize,
    senders: usize,
    receivers: usize,
    want_value: VecDeque<WaitUntil>,
    want_room: VecDeque<WaitUntil>,
}

/// Why a value was not queued; it is given back.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum TrySendError<T> {
    /// The queue holds as many values as it may.
    #[error("the queue is full")]
    Full(T),
    /// There is no receiver any more.
    #[error("nobody receives any more")]
    Closed(T),
}

/// Why a value was not queued by a deadline; it is given back.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SendError<T> {
    /// The queue was full until the deadline.
    #[error("the queue was full until the deadline")]
    Timeout(T),
    /// There is no receiver any more.
    #[error("nobody receives any more")]
    Closed(T),
}

/// Why nothing was received.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecvError {
    /// Nothing came until the deadline.
    #[error("nothing came until the deadline")]
    Timeout,
    /// The queue is empty and there is no sender any more.
    #[error("nobody sends any more")]
    Closed,
}

/// Why there is nothing to receive now.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum TryRecvError {
    /// The queue is empty.
    #[error("the queue is empty")]
    Empty,
    /// The queue is empty and there is no sender any more.
    #[error("nobody sends any more")]
    Closed,
}

pub(super) fn new<T>(clock: &Clock, bound: usize) -> (Sender<T>, Receiver<T>) {
    if clock.is_simulated() {
        let queue = Arc::new(Mutex::new(ChannelQueue {
            values: VecDeque::new(),
            bound,
            senders: 1,
            receivers: 1,
            want_value: VecDeque::new(),
            want_room: VecDeque::new(),
        }));
        (
            Sender(ChannelEnd::Simulated(clock.clone(), queue.clone())),
            Receiver(ChannelEnd::Simulated(clock.clone(), queue)),
        )
    } else {
        let (sender, receiver) = real::bounded(bound);
        (Sender(ChannelEnd::Real(clock.clone(), sender)), Receiver(ChannelEnd::Real(clock.clone(), receiver)))
    }
}

fn scheduler(clock: &Clock) -> &Scheduler {
    match &*clock.0 {
        TimeKind::Simulated(scheduler) => scheduler,
        TimeKind::Real(_) => unreachable!("a simulated channel belongs to a simulated clock"),
    }
}

/// Wakes the first of those who wait that still does. The queue's lock is held: its owner and those who wait agree.
fn wake_first(clock: &Clock, waiting: &mut VecDeque<WaitUntil>) {
    while let Some(wait) = waiting.pop_front() {
        if scheduler(clock).wake(wait) {
            return;
        }
    }
}

impl<T> Sender<T> {
    /// Queues a value; never waits.
    ///
    /// # Errors
    /// [`TrySendError`] with the value, when the queue is full or nobody receives any more.
    pub fn try_send(&self, value: T) -> Result<(), TrySendError<T>> {
        match &self.0 {
            ChannelEnd::Real(_, sender) => sender.try_send(value).map_err(|error| match error {
                real::TrySendError::Full(value) => TrySendError::Full(value),
                real::TrySendError::Disconnected(value) => TrySendError::Closed(value),
            }),
            ChannelEnd::Simulated(clock, queue) => {
                let mut queue = lock(queue);
                if queue.receivers == 0 {
                    return Err(TrySendError::Closed(value));
                }
                if queue.values.len() >= queue.bound {
                    return Err(TrySendError::Full(value));
                }
                queue.values.push_back(value);
                wake_first(clock, &mut queue.want_value);
                Ok(())
            }
        }
    }

    /// Queues a value, waiting for room until `deadline`.
    ///
    /// # Errors
    /// [`SendError`] with the value, when the queue stayed full or nobody receives any more.
    pub fn send_deadline(&self, value: T, deadline: Time) -> Result<(), SendError<T>> {
        match &self.0 {
            ChannelEnd::Real(clock, sender) => match real_instant(clock, deadline) {
                Some(instant) => sender.send_deadline(value, instant).map_err(|error| match error {
                    real::SendTimeoutError::Timeout(value) => SendError::Timeout(value),
                    real::SendTimeoutError::Disconnected(value) => SendError::Closed(value),
                }),
                None => sender.send(value).map_err(|error| SendError::Closed(error.0)),
            },
            ChannelEnd::Simulated(clock, queue) => scheduler(clock).as_participant(|me| {
                let mut value = value;
                loop {
                    value = match self.try_send(value) {
                        Ok(()) => return Ok(()),
                        Err(TrySendError::Closed(value)) => return Err(SendError::Closed(value)),
                        Err(TrySendError::Full(value)) => value,
                    };
                    let mut locked = lock(queue);
                    locked.want_room.retain(|wait| !wait.is_of(me));
                    if locked.values.len() < locked.bound || locked.receivers == 0 {
                        continue;
                    }
                    if clock.now() >= deadline {
                        return Err(SendError::Timeout(value));
                    }
                    scheduler(clock).wait(me, deadline, move |wait| locked.want_room.push_back(wait));
                }
            }),
        }
    }

    /// Values queued and not yet received.
    pub fn len(&self) -> usize {
        match &self.0 {
            ChannelEnd::Real(_, sender) => sender.len(),
            ChannelEnd::Simulated(_, queue) => lock(queue).values.len(),
        }
    }

    /// Whether nothing is queued.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl<T> Receiver<T> {
    /// The next value, if there is one; never waits.
    ///
    /// # Errors
    /// [`TryRecvError`]: empty, or empty for ever.
    pub fn try_recv(&self) -> Result<T, TryRecvError> {
        match &self.0 {
            ChannelEnd::Real(_, receiver) => receiver.try_recv().map_err(|error| match error {
                real::TryRecvError::Empty => TryRecvError::Empty,
                real::TryRecvError::Disconnected => TryRecvError::Closed,
            }),
            ChannelEnd::Simulated(clock, queue) => {
                let mut queue = lock(queue);
                match queue.values.pop_front() {
                    Some(value) => {
                        wake_first(clock, &mut queue.want_room);
                        Ok(value)
                    }
                    None if queue.senders == 0 => Err(TryRecvError::Closed),
                    None => Err(TryRecvError::Empty),
                }
            }
        }
    }

    /// The next value, waiting for one until `deadline`. A value that is there is given out also after the deadline.
    ///
    /// # Errors
    /// [`RecvError`]: nothing came, or nothing will come.
    pub fn recv_deadline(&self, deadline: Time) -> Result<T, RecvError> {
        self.recv_or_idle(deadline, Time::NEVER)
    }

    /// The same, but it also waits no longer than until `idle`: a time that simulated time does not move on for by itself, so
    /// that who looks at something now and then keeps no clock going at which nothing else happens.
    ///
    /// # Errors
    /// [`RecvError`]: nothing came, or nothing will come.
    pub fn recv_or_idle(&self, deadline: Time, idle: Time) -> Result<T, RecvError> {
        match &self.0 {
            ChannelEnd::Real(clock, receiver) => match real_instant(clock, deadline.min(idle)) {
                Some(instant) => receiver.recv_deadline(instant).map_err(|error| match error {
                    real::RecvTimeoutError::Timeout => RecvError::Timeout,
                    real::RecvTimeoutError::Disconnected => RecvError::Closed,
                }),
                None => receiver.recv().map_err(|_| RecvError::Closed),
            },
            ChannelEnd::Simulated(clock, queue) => scheduler(clock).as_participant(|me| {
                loop {
                    match self.try_recv() {
                        Ok(value) => return Ok(value),
                        Err(TryRecvError::Closed) => return Err(RecvError::Closed),
                        Err(TryRecvError::Empty) => {}
                    }
                    let mut locked = lock(queue);
                    locked.want_value.retain(|wait| !wait.is_of(me));
                    if !locked.values.is_empty() || locked.senders == 0 {
                        continue;
                    }
                    if clock.now() >= deadline.min(idle) {
                        return Err(RecvError::Timeout);
                    }
                    let register = move |wait| locked.want_value.push_back(wait);
                    scheduler(clock).wait_or_idle(me, deadline, idle, register);
                }
            }),
        }
    }

    /// The next value, waiting for one as long as there are senders.
    ///
    /// # Errors
    /// [`RecvError::Closed`]: nothing will come.
    pub fn recv(&self) -> Result<T, RecvError> {
        self.recv_deadline(Time::NEVER)
    }

    /// Values queued and not yet received.
    pub fn len(&self) -> usize {
        match &self.0 {
            ChannelEnd::Real(_, receiver) => receiver.len(),
            ChannelEnd::Simulated(_, queue) => lock(queue).values.len(),
        }
    }

    /// Whether nothing is queued.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

fn real_instant(clock: &Clock, time: Time) -> Option<std::time::Instant> {
    match &*clock.0 {
        TimeKind::Real(real) => real.instant(time),
        TimeKind::Simulated(_) => None,
    }
}

impl<T> Clone for Sender<T> {
    fn clone(&self) -> Self {
        Self(match &self.0 {
            ChannelEnd::Real(clock, sender) => ChannelEnd::Real(clock.clone(), sender.clone()),
            ChannelEnd::Simulated(clock, queue) => {
                lock(queue).senders += 1;
                ChannelEnd::Simulated(clock.clone(), queue.clone())
            }
        })
    }
}

impl<T> Clone for Receiver<T> {
    fn clone(&self) -> Self {
        Self(match &self.0 {
            ChannelEnd::Real(clock, receiver) => ChannelEnd::Real(clock.clone(), receiver.clone()),
            ChannelEnd::Simulated(clock, queue) => {
                lock(queue).receivers += 1;
                ChannelEnd::Simulated(clock.clone(), queue.clone())
            }
        })
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        if let ChannelEnd::Simulated(clock, queue) = &self.0 {
            let mut queue = lock(queue);
            queue.senders -= 1;
            if queue.senders == 0 {
                for wait in std::mem::take(&mut queue.want_value) {
                    scheduler(clock).wake(wait);
                }
            }
        }
    }
}

impl<T> Drop for Receiver<T> {
    fn drop(&mut self) {
        if let ChannelEnd::Simulated(clock, queue) = &self.0 {
            let mut locked = lock(queue);
            locked.receivers -= 1;
            if locked.receivers == 0 {
                for wait in std::mem::take(&mut locked.want_room) {
                    scheduler(clock).wake(wait);
                }
                // Values may own ends of this very queue: they are dropped without its lock.
                let values = std::mem::take(&mut locked.values);
                drop(locked);
                drop(values);
            }
        }
    }
}

impl<T> std::fmt::Debug for Sender<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Sender({} queued)", self.len())
    }
}

impl<T> std::fmt::Debug for Receiver<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Receiver({} queued)", self.len())
    }
}
