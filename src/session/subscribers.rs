//! Who hears what happens over the control socket: each behind a [tap](super::tap) of its own, and all behind one that
//! turns what happens into lines, so that nothing of it is done in a thread that acts.

use super::connection::SocketConnection;
use super::log::LogEntry;
use super::rpc;
use super::tap::{Full, LogSink, News, Tap};
use crate::limits;
use crate::time::{Clock, lock};
use serde_json::json;
use std::io;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Those who subscribed.
pub(super) struct Subscribers {
    list: Mutex<Vec<Subscriber>>,
    count: AtomicUsize,
    /// Whose time it is that they hear of.
    clock: Mutex<Clock>,
    queue: usize,
}

struct Subscriber {
    connection: Arc<SocketConnection>,
    tap: Tap<Arc<str>>,
}

impl Subscribers {
    /// Nobody, each with room for so many lines.
    pub fn new(queue: usize) -> Self {
        Self { list: Mutex::default(), count: AtomicUsize::new(0), clock: Mutex::new(Clock::real()), queue }
    }

    /// From now on all lines are sent to that connection; false: they are already.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn add(&self, connection: &Arc<SocketConnection>) -> io::Result<bool> {
        let mut list = lock(&self.list);
        if list.iter().any(|s| s.connection.number == connection.number) {
            return Ok(false);
        }
        let to = connection.clone();
        let tap = Tap::new("davit-subscriber", self.queue, &lock(&self.clock), move |news: News<Arc<str>>| {
            // A connection that takes nothing is closed by the attempt, and its own thread takes it from the list.
            if let News::One(line) = news {
                let _ = to.send(&line);
            }
        })?;
        list.push(Subscriber { connection: connection.clone(), tap });
        self.count.store(list.len(), Ordering::Release);
        Ok(true)
    }

    /// That connection is over.
    pub fn remove(&self, number: u32) {
        let mut list = lock(&self.list);
        list.retain(|s| s.connection.number != number);
        self.count.store(list.len(), Ordering::Release);
    }

    /// Sends a line to all; never waits. Who has no room for it is cut off: it would otherwise hear a story with holes and
    /// not know it.
    pub fn send(&self, line: &str) {
        let line: Arc<str> = line.into();
        let mut list = lock(&self.list);
        list.retain(|s| match s.tap.offer(line.clone()) {
            Ok(()) => true,
            Err(Full) => {
                s.connection.cut();
                false
            }
        });
        self.count.store(list.len(), Ordering::Release);
    }

    /// In simulated time waits for those who take what they are sent.
    fn keep_pace(&self) {
        let taps: Vec<Tap<Arc<str>>> = lock(&self.list).iter().map(|s| s.tap.clone()).collect();
        taps.iter().for_each(Tap::keep_pace);
    }

    /// Nothing more comes: lets them read the rest for as long as they do, all together for `limit`, and closes them.
    pub fn finish(&self, limit: Duration) {
        let list = std::mem::take(&mut *lock(&self.list));
        let real = Clock::real();
        for Subscriber { connection, tap } in list {
            tap.finish(limit.saturating_sub(Duration::from_nanos(real.now().0)));
            connection.cut();
        }
    }

    /// What turns all that happens, on `clock`, into lines for them.
    ///
    /// # Errors
    /// When the operating system has no thread left.
    pub fn observer(self: &Arc<Self>, clock: &Clock) -> io::Result<ToSubscribers> {
        lock(&self.clock).clone_from(clock);
        let (to, clock_of) = (self.clone(), clock.clone());
        let tap = Tap::new("davit-notify", limits::TAP, clock, move |news: News<Arc<LogEntry>>| {
            to.send(&match news {
                News::One(entry) => rpc::notification("log", &json!(entry)),
                News::Missed(entries) => {
                    let at = clock_of.now().as_secs_f64();
                    rpc::notification("log", &json!({ "at": at, "what": "missed", "entries": entries }))
                }
            });
            to.keep_pace();
        })?;
        Ok(ToSubscribers { tap, subscribers: self.clone() })
    }
}

/// Hears what happens, for those who subscribed.
#[derive(Clone)]
pub(super) struct ToSubscribers {
    tap: Tap<Arc<LogEntry>>,
    subscribers: Arc<Subscribers>,
}

impl ToSubscribers {
    /// Waits until everything that happened is on its way.
    pub fn finish(&self, patience: Duration) {
        self.tap.finish(patience);
    }
}

impl LogSink for ToSubscribers {
    fn hear(&self, entry: &Arc<LogEntry>) {
        // Nobody listens: no thread is woken.
        if self.subscribers.count.load(Ordering::Acquire) > 0 {
            self.tap.put(entry.clone());
        }
    }

    fn keep_pace(&self) {
        self.tap.keep_pace();
    }
}
