//! A network that delays, jitters, reorders, duplicates, loses, is slow and stands still; seeded, so that a run can be repeated.

mod faults;

pub use faults::{NetworkFault, NetworkFaults};

use std::collections::VecDeque;

/// A small generator (SplitMix64): repeatable, and good enough to lose packets with.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// In [0, 1).
    #[allow(clippy::cast_precision_loss)]
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// How the network is doing. Shares are of packets, 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// One way, in s.
    pub delay: f64,
    /// Up to so much is added, in s, evenly spread. It is waited in a queue: no packet overtakes another because of it.
    pub jitter: f64,
    /// Share that goes another way, which takes [`DETOUR`] longer: what is sent later may come sooner.
    pub reorder: f64,
    /// Share that comes twice.
    pub duplicate: f64,
    /// Share lost, one by one, in good times.
    pub loss: f64,
    /// Share of packets with which a bad time begins (the model of Gilbert and Elliott).
    pub burst_begin: f64,
    /// Share of packets of a bad time with which it ends; 1 over its mean length in packets.
    pub burst_end: f64,
    /// Share lost in bad times.
    pub burst_loss: f64,
    /// Packets that get through in a second; 0: any number.
    pub rate: f64,
    /// Nothing gets through.
    pub cut: bool,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            delay: 0.0,
            jitter: 0.0,
            reorder: 0.0,
            duplicate: 0.0,
            loss: 0.0,
            burst_begin: 0.0,
            burst_end: 1.0,
            burst_loss: 1.0,
            rate: 0.0,
            cut: false,
        }
    }
}

crate::runtime::record! {
    /// What became of the packets so far.
    #[derive(Copy, Default)]
    pub struct NetworkCounts {
        /// Given to the network.
        pub sent: i64,
        /// Lost on the way, one by one, in bad times, or because the network was cut.
        pub lost: i64,
        /// Not taken because too many were waiting or under way.
        pub refused: i64,
        /// That arrived, those that came twice twice.
        pub delivered: i64,
    }
}

/// How much longer the other way takes, in s.
pub const DETOUR: f64 = 0.01;
/// Packets under way at once (a second of 250 Hz, twice over), and packets waiting for a slow network: what is more is refused.
const IN_FLIGHT: usize = 512;
/// See [`IN_FLIGHT`].
pub const WAITING: f64 = 32.0;

/// One direction of a link.
#[derive(Debug, Clone)]
pub struct Network<T> {
    /// How it is doing now; what is under way already is not touched.
    pub quality: Quality,
    /// What became of the packets so far.
    pub counts: NetworkCounts,
    random: Random,
    bad_time: bool,
    /// When the last packet has been let through, and when the last one that kept its place arrives, in s.
    free: f64,
    last: f64,
    /// With the moment of arrival, in s; not sorted.
    flying: VecDeque<(f64, T)>,
}

impl<T: Clone> Network<T> {
    /// A network whose luck is decided by `seed`.
    pub fn new(quality: Quality, seed: u64) -> Self {
        Self {
            quality,
            counts: NetworkCounts::default(),
            random: Random::new(seed),
            bad_time: false,
            free: 0.0,
            last: 0.0,
            flying: VecDeque::with_capacity(IN_FLIGHT),
        }
    }

    /// Sends a packet at `now` (s).
    pub fn send(&mut self, now: f64, packet: T) {
        // Every packet draws the same lots: one property more or less in force does not change another's luck.
        let [burst, loss, jitter, reorder, duplicate, again] = std::array::from_fn(|_| self.random.unit());
        let q = self.quality;
        self.counts.sent += 1;
        self.bad_time = if self.bad_time { burst >= q.burst_end } else { burst < q.burst_begin };
        if loss < (if self.bad_time { q.burst_loss } else { q.loss }) || q.cut {
            self.counts.lost += 1;
            return;
        }
        let begins = if q.rate > 0.0 { now.max(self.free) } else { now };
        let waits = (begins - now) * q.rate > WAITING;
        if waits || self.flying.len() >= IN_FLIGHT {
            self.counts.refused += 1;
            return;
        }
        self.free = begins + if q.rate > 0.0 { 1.0 / q.rate } else { 0.0 };
        let through = self.free + q.delay;
        if duplicate < q.duplicate && self.flying.len() + 1 < IN_FLIGHT {
            self.flying.push_back((through + again * q.jitter, packet.clone()));
        }
        let arrival = if reorder < q.reorder {
            through + jitter * q.jitter + DETOUR
        } else {
            self.last = (through + jitter * q.jitter).max(self.last);
            self.last
        };
        self.flying.push_back((arrival, packet));
    }

    /// The next packet that has arrived by `now` (s), if there is one.
    pub fn receive(&mut self, now: f64) -> Option<T> {
        let (at, _) = self
            .flying
            .iter()
            .enumerate()
            .filter(|(_, (arrival, _))| *arrival <= now)
            .min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        self.counts.delivered += 1;
        self.flying.remove(at).map(|(_, packet)| packet)
    }

    /// Loses what is under way.
    pub fn clear(&mut self) {
        self.flying.clear();
    }
}

#[cfg(test)]
mod tests;
