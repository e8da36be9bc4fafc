//! Ports: typed ends of the data flow, as a component holds them.
//!
//! A write costs one exchange per connection, a read one load and, when something new came, one exchange; neither
//! allocates (for types that own no memory), waits, or takes a lock. See [`latest`](super::latest) and
//! [`links`](super::links).

use super::beat::Beat;
use super::latest::{Reader, Writer, latest};
use super::links::{Links, LinksSender, links};
use super::probe::{ProbeTap, Tapped};
use super::value::PortValue;
use crate::model::{EventName, Policy, Value};
use crate::time::Time;
use std::any::Any;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// A value with the moment it was written; none: never written.
#[derive(Debug, Clone)]
pub(super) struct Stamped<T> {
    pub(super) value: Option<T>,
    pub(super) at: Time,
}

impl<T: Clone> Stamped<T> {
    const EMPTY: Self = Self { value: None, at: Time(0) };

    fn set(&mut self, value: &T, at: Time) {
        match &mut self.value {
            Some(slot) => slot.clone_from(value),
            None => self.value = Some(value.clone()),
        }
        self.at = at;
    }
}

/// Where an in-port's values come from.
enum Source<T> {
    Data(Reader<Stamped<T>>),
    Fifo(rtrb::Consumer<(T, Time)>, Arc<AtomicU64>),
    /// What `port_write` writes; in force while nothing else is there.
    Written(Reader<Stamped<T>>),
}

/// What an in-port was read to hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample<'a, T> {
    /// The value.
    pub value: &'a T,
    /// When it was written: the moment the writing component's update stands for.
    pub at: Time,
    /// Whether this is the first time it is read here.
    pub fresh: bool,
}

/// An in-port.
///
/// Connected with policy `data`, it gives the latest value; with `buffer(n)`, one value of the queue at each read, oldest
/// first (over several connections, by the moment of writing), and the last one again while the queue is empty. Not
/// connected, it gives what a `port_write` wrote. "Never written" is none.
pub struct In<T> {
    links: Links<Source<T>>,
    /// The value popped last from a queue.
    popped: Stamped<T>,
    beat: Option<Arc<Beat>>,
}

enum FoundSource {
    Data,
    Fifo,
    Written,
    Nothing,
}

impl<T: PortValue> In<T> {
    /// A port of nobody: what a description of a type holds.
    pub(crate) fn loose() -> Self {
        Self { links: links().1, popped: Stamped::EMPTY, beat: None }
    }

    pub(crate) fn new(beat: &Arc<Beat>) -> (Self, Box<dyn InEnd>) {
        let (sender, list) = links();
        let port = Self { links: list, popped: Stamped::EMPTY, beat: Some(beat.clone()) };
        (port, Box::new(InPortEnd::<T> { sender, written: None, beat: beat.clone() }))
    }

    /// Reads: the value, when it was written, and whether it has been read before.
    pub fn sample(&mut self) -> Option<Sample<'_, T>> {
        self.links.refresh();
        // Mostly there is one connection, or one that comes first.
        if matches!(self.links.first_mut(), Some(Source::Data(_))) {
            let Some(Source::Data(reader)) = self.links.first_mut() else { return None };
            let fresh = reader.update();
            let slot = reader.value();
            return slot.value.as_ref().map(|value| Sample { value, at: slot.at, fresh });
        }
        let mut found = FoundSource::Nothing;
        for link in self.links.iter_mut() {
            match link {
                Source::Data(_) => {
                    found = FoundSource::Data;
                    break;
                }
                Source::Fifo(..) => {
                    found = FoundSource::Fifo;
                    break;
                }
                Source::Written(_) => found = FoundSource::Written,
            }
        }
        let (slot, fresh) = match found {
            FoundSource::Nothing => return None,
            FoundSource::Fifo => {
                let fresh = self.pop();
                (&self.popped, fresh)
            }
            FoundSource::Data | FoundSource::Written => {
                let data = matches!(found, FoundSource::Data);
                let reader = self.links.iter_mut().find_map(|link| match link {
                    Source::Data(reader) if data => Some(reader),
                    Source::Written(reader) if !data => Some(reader),
                    _ => None,
                })?;
                let fresh = reader.update();
                (reader.value(), fresh)
            }
        };
        slot.value.as_ref().map(|value| Sample { value, at: slot.at, fresh })
    }

    /// Takes the oldest value of all queues into `popped`.
    fn pop(&mut self) -> bool {
        let mut oldest: Option<(Time, &mut rtrb::Consumer<(T, Time)>)> = None;
        for link in self.links.iter_mut() {
            if let Source::Fifo(queue, _) = link
                && let Ok((_, at)) = queue.peek()
                && oldest.as_ref().is_none_or(|(t, _)| at < t)
            {
                let at = *at;
                oldest = Some((at, queue));
            }
        }
        match oldest.and_then(|(_, queue)| queue.pop().ok()) {
            Some((value, at)) => {
                self.popped = Stamped { value: Some(value), at };
                true
            }
            None => false,
        }
    }

    /// Reads: the value, fresh or not.
    pub fn get(&mut self) -> Option<T> {
        self.sample().map(|sample| sample.value.clone())
    }

    /// Reads: the value, if it has not been read before. The way to empty a queue.
    pub fn take(&mut self) -> Option<T> {
        self.sample().filter(|sample| sample.fresh).map(|sample| sample.value.clone())
    }

    /// How long ago the value was written that a read now gives (and it counts as read); none: never written.
    pub fn age(&mut self) -> Option<Duration> {
        let now = self.beat.as_ref().map_or(Time(0), |beat| beat.now());
        self.sample().map(|sample| now.since(sample.at))
    }

    /// Values lost because the queues to this port were full.
    pub fn overflows(&mut self) -> u64 {
        self.links.refresh();
        self.links
            .iter_mut()
            .map(|link| match link {
                Source::Fifo(_, lost) => lost.load(Ordering::Relaxed),
                _ => 0,
            })
            .sum()
    }

    /// Whether something is connected.
    pub fn is_connected(&mut self) -> bool {
        self.links.refresh();
        self.links.iter_mut().any(|link| !matches!(link, Source::Written(_)))
    }
}

/// The writing end of one connection, for values of the in-port's type.
pub struct Inlet<T> {
    kind: InletKind<T>,
    wake: Option<Arc<Beat>>,
}

enum InletKind<T> {
    Data(Writer<Stamped<T>>),
    /// A probe: the latest value, and how often there was one.
    Tap(Writer<(Stamped<T>, u64)>, u64),
    Fifo(rtrb::Producer<(T, Time)>, Arc<AtomicU64>),
}

impl<T: PortValue> Inlet<T> {
    #[inline]
    fn put(&mut self, value: &T, at: Time) {
        match &mut self.kind {
            InletKind::Data(writer) => writer.write(|slot| slot.set(value, at)),
            InletKind::Tap(writer, writes) => {
                *writes += 1;
                writer.write(|(slot, count)| {
                    slot.set(value, at);
                    *count = *writes;
                });
            }
            InletKind::Fifo(queue, lost) => {
                // The newest value is the one that is dropped: only the reader may take from the other end.
                if queue.push((value.clone(), at)).is_err() {
                    lost.fetch_add(1, Ordering::Relaxed);
                }
            }
        }
        if let Some(beat) = &self.wake {
            beat.poke();
        }
    }
}

/// The writing end of one connection, whatever the in-port's type.
pub trait Feed: Send {
    /// Writes a value of the model; one that does not fit is lost.
    fn put_value(&mut self, value: &Value, at: Time);
    /// Itself, to be recognised by an out-port of the same Rust type.
    fn into_any(self: Box<Self>) -> Box<dyn Any + Send>;
    /// Itself, to be recognised.
    fn as_any(&self) -> &dyn Any;
}

impl<T: PortValue> Feed for Inlet<T> {
    fn put_value(&mut self, value: &Value, at: Time) {
        if let Some(value) = T::from_value(value) {
            self.put(&value, at);
        }
    }
    fn into_any(self: Box<Self>) -> Box<dyn Any + Send> {
        self
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
}

enum PortTarget<T> {
    Same(Inlet<T>),
    Converted(Box<dyn Feed>),
}

/// An out-port. A write goes to all its connections; without any it goes nowhere.
pub struct Out<T> {
    links: Links<PortTarget<T>>,
    beat: Option<Arc<Beat>>,
}

impl<T: PortValue> Out<T> {
    pub(crate) fn loose() -> Self {
        Self { links: links().1, beat: None }
    }

    pub(crate) fn new(beat: &Arc<Beat>) -> (Self, Box<dyn OutEnd>) {
        let (sender, list) = links::<PortTarget<T>>();
        (Self { links: list, beat: Some(beat.clone()) }, Box::new(sender))
    }

    /// Writes a value.
    #[inline]
    pub fn write(&mut self, value: T) {
        self.write_ref(&value);
    }

    /// Writes a copy of a value.
    #[inline]
    pub fn write_ref(&mut self, value: &T) {
        let at = self.beat.as_ref().map_or(Time(0), |beat| beat.now());
        self.write_at(value, at);
    }

    /// Writes a copy of a value that stands for another moment than this update: one measured earlier, or sent on.
    pub fn write_at(&mut self, value: &T, at: Time) {
        self.links.refresh();
        for link in self.links.iter_mut() {
            match link {
                PortTarget::Same(inlet) => inlet.put(value, at),
                PortTarget::Converted(feed) => feed.put_value(&value.to_value(), at),
            }
        }
    }

    /// Whether anything is connected.
    pub fn is_connected(&mut self) -> bool {
        self.links.refresh();
        self.links.first_mut().is_some()
    }
}

/// An event out-port. What is raised goes to the deployment's coordinator (without a connection) and to all connections.
pub struct EventOut {
    out: Out<EventName>,
}

impl EventOut {
    pub(crate) fn over(out: Out<EventName>) -> Self {
        Self { out }
    }

    /// Raises an event. Make the name once, in the component's constructor: making one takes a lock.
    pub fn raise(&mut self, event: EventName) {
        self.out.write(event);
        if let Some(beat) = &self.out.beat {
            beat.raise(event);
        }
    }
}

/// An event in-port: a queue of event names; [`In::take`] gives the next one.
pub type EventIn = In<EventName>;

/// An in-port as the configurator sees it.
pub trait InEnd: Send {
    /// Makes connection `id`, and gives its writing end.
    fn open(&mut self, id: u64, policy: Policy) -> Box<dyn Feed>;
    /// Ends connection `id`.
    fn close(&mut self, id: u64);
    /// Takes the memory that writes need.
    fn prepare(&mut self);
    /// Writes a value, or restores "never written"; false when the value does not fit.
    fn write(&mut self, value: Option<&Value>, at: Time) -> bool;
}

struct InPortEnd<T> {
    sender: LinksSender<Source<T>>,
    written: Option<Writer<Stamped<T>>>,
    beat: Arc<Beat>,
}

/// The number of the pseudo-connection that carries written values; connections are counted from 1.
const WRITTEN: u64 = 0;

impl<T: PortValue> InEnd for InPortEnd<T> {
    fn open(&mut self, id: u64, policy: Policy) -> Box<dyn Feed> {
        let wake = self.beat.is_event_driven().then(|| self.beat.clone());
        match policy {
            Policy::Data => {
                let (writer, reader) = latest(Stamped::EMPTY);
                self.sender.add(id, Source::Data(reader));
                Box::new(Inlet { kind: InletKind::Data(writer), wake })
            }
            Policy::Buffer(n) => {
                let (producer, consumer) = rtrb::RingBuffer::new(n.max(1) as usize);
                let lost = Arc::new(AtomicU64::new(0));
                self.sender.add(id, Source::Fifo(consumer, lost.clone()));
                Box::new(Inlet { kind: InletKind::Fifo(producer, lost), wake })
            }
        }
    }

    fn close(&mut self, id: u64) {
        self.sender.remove(id);
    }

    fn prepare(&mut self) {
        if self.written.is_none() {
            let (writer, reader) = latest(Stamped::EMPTY);
            self.sender.add(WRITTEN, Source::Written(reader));
            self.written = Some(writer);
        }
    }

    fn write(&mut self, value: Option<&Value>, at: Time) -> bool {
        let value = match value.map(T::from_value) {
            Some(None) => return false,
            Some(value) => value,
            None => None,
        };
        self.prepare();
        if let Some(writer) = &mut self.written {
            writer.write(|slot| *slot = Stamped { value, at });
        }
        self.beat.poke();
        true
    }
}

/// An out-port as the configurator sees it.
pub(crate) trait OutEnd: Send {
    /// Adds connection `id`.
    fn attach(&mut self, id: u64, feed: Box<dyn Feed>);
    /// Removes connection or probe `id`.
    fn detach(&mut self, id: u64);
    /// Adds the probe `id`; every write wakes `wake`.
    fn tap(&mut self, id: u64, wake: Option<Arc<Beat>>) -> Box<dyn ProbeTap>;
}

impl<T: PortValue> OutEnd for LinksSender<PortTarget<T>> {
    fn attach(&mut self, id: u64, feed: Box<dyn Feed>) {
        let target = if feed.as_any().is::<Inlet<T>>() {
            match feed.into_any().downcast::<Inlet<T>>() {
                Ok(inlet) => PortTarget::Same(*inlet),
                Err(_) => unreachable!("recognised just now"),
            }
        } else {
            PortTarget::Converted(feed)
        };
        self.add(id, target);
    }

    fn detach(&mut self, id: u64) {
        self.remove(id);
    }

    fn tap(&mut self, id: u64, wake: Option<Arc<Beat>>) -> Box<dyn ProbeTap> {
        let (writer, reader) = latest((Stamped::EMPTY, 0));
        self.add(id, PortTarget::Same(Inlet { kind: InletKind::Tap(writer, 0), wake }));
        Box::new(Tapped { reader })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ComponentName;
    use crate::runtime::beat::Notices;

    fn beat(name: &str) -> Arc<Beat> {
        Arc::new(Beat::new(ComponentName::new(name).unwrap(), None, Arc::new(Notices::default())))
    }

    #[test]
    fn data_gives_the_latest_value_with_its_age() {
        let (a, b) = (beat("a"), beat("b"));
        let (mut out, mut out_end) = Out::<f64>::new(&a);
        let (mut input, mut in_end) = In::<f64>::new(&b);
        assert_eq!(input.get(), None);
        out.write(1.0);
        out_end.attach(1, in_end.open(1, Policy::Data));
        assert_eq!(input.get(), None, "a connection carries what is written from now on");
        a.set_now(Time(1_000));
        out.write(2.0);
        out.write(3.0);
        b.set_now(Time(5_000));
        assert_eq!(input.sample(), Some(Sample { value: &3.0, at: Time(1_000), fresh: true }));
        assert_eq!(input.age(), Some(Duration::from_nanos(4_000)));
        assert_eq!((input.take(), input.get()), (None, Some(3.0)));
    }

    #[test]
    fn a_written_value_is_in_force_while_nothing_is_connected() {
        let (a, b) = (beat("a"), beat("b"));
        let (mut out, mut out_end) = Out::<f64>::new(&a);
        let (mut input, mut in_end) = In::<f64>::new(&b);
        assert!(in_end.write(Some(&Value::Float(7.0)), Time(3)));
        assert!(!in_end.write(Some(&Value::Bool(true)), Time(3)));
        assert_eq!(input.take(), Some(7.0));
        out_end.attach(1, in_end.open(1, Policy::Data));
        assert_eq!(input.get(), None);
        out.write(1.0);
        assert_eq!(input.get(), Some(1.0));
        in_end.close(1);
        out_end.detach(1);
        assert_eq!(input.get(), Some(7.0));
        in_end.write(None, Time(4));
        assert_eq!(input.get(), None);
        out.write(2.0);
        assert!(!out.is_connected() && !input.is_connected());
    }

    #[test]
    fn queues_keep_the_oldest_and_count_what_they_lose() {
        let (a, b, c) = (beat("a"), beat("b"), beat("c"));
        let (mut first, mut first_end) = Out::<i64>::new(&a);
        let (mut second, mut second_end) = Out::<i64>::new(&b);
        let (mut input, mut in_end) = In::<i64>::new(&c);
        first_end.attach(1, in_end.open(1, Policy::Buffer(2)));
        second_end.attach(2, in_end.open(2, Policy::Buffer(2)));
        for (t, value) in [(10, 1), (30, 3), (50, 5)] {
            a.set_now(Time(t));
            first.write(value);
        }
        b.set_now(Time(20));
        second.write(2);
        assert_eq!(std::iter::from_fn(|| input.take()).collect::<Vec<_>>(), [1, 2, 3]);
        assert_eq!((input.get(), input.overflows()), (Some(3), 1));
    }

    #[test]
    fn values_of_the_same_type_in_the_model_are_converted() {
        let (a, b) = (beat("a"), beat("b"));
        let (mut out, mut out_end) = Out::<[f64; 2]>::new(&a);
        let (mut input, mut in_end) = In::<nalgebra::Vector2<f64>>::new(&b);
        out_end.attach(1, in_end.open(1, Policy::Data));
        out.write([1.0, 2.0]);
        assert_eq!(input.get(), Some(nalgebra::Vector2::new(1.0, 2.0)));
    }
}
