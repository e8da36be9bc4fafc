//! A network that delays, jitters, loses and stands still; seeded, so that a run can be repeated.

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

/// How the network is doing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quality {
    /// One way, in s.
    pub delay: f64,
    /// Up to so much is added, in s, evenly spread.
    pub jitter: f64,
    /// Share of packets lost, 0 to 1.
    pub loss: f64,
    /// Nothing gets through.
    pub cut: bool,
}

/// Packets under way at once: past it the oldest is lost (a second of 250 Hz, twice over).
const IN_FLIGHT: usize = 512;

/// One direction of a link. Packets may overtake each other, as in a real one.
#[derive(Debug, Clone)]
pub struct Network<T> {
    /// How it is doing now; what is under way already is not touched.
    pub quality: Quality,
    random: Random,
    /// With the moment of arrival, in s; not sorted.
    flying: VecDeque<(f64, T)>,
}

impl<T> Network<T> {
    /// A network whose luck is decided by `seed`.
    pub fn new(quality: Quality, seed: u64) -> Self {
        Self { quality, random: Random::new(seed), flying: VecDeque::with_capacity(IN_FLIGHT) }
    }

    /// Sends a packet at `now` (s).
    pub fn send(&mut self, now: f64, packet: T) {
        let (lost, extra) = (self.random.unit() < self.quality.loss, self.random.unit() * self.quality.jitter);
        if lost || self.quality.cut {
            return;
        }
        if self.flying.len() == IN_FLIGHT {
            self.flying.pop_front();
        }
        self.flying.push_back((now + self.quality.delay + extra, packet));
    }

    /// The next packet that has arrived by `now` (s), if there is one.
    pub fn receive(&mut self, now: f64) -> Option<T> {
        let (at, _) = self
            .flying
            .iter()
            .enumerate()
            .filter(|(_, (arrival, _))| *arrival <= now)
            .min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
        self.flying.remove(at).map(|(_, packet)| packet)
    }

    /// Loses what is under way.
    pub fn clear(&mut self) {
        self.flying.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_delays_and_loses_as_told_and_repeatably() {
        let run = |seed| {
            let mut net = Network::new(Quality { delay: 0.01, jitter: 0.005, loss: 0.3, cut: false }, seed);
            let mut got = Vec::new();
            for i in 0..1000u32 {
                let now = f64::from(i) * 0.004;
                net.send(now, now);
                while let Some(sent) = net.receive(now) {
                    assert!(now - sent >= 0.01 && now - sent < 0.0200001);
                    got.push(sent.to_bits());
                }
            }
            got
        };
        let got = run(7);
        assert_eq!(got, run(7));
        assert_ne!(got, run(8));
        assert!((650..750).contains(&got.len()), "{}", got.len());
    }

    #[test]
    fn cut_means_nothing() {
        let mut net = Network::new(Quality { cut: true, ..Quality::default() }, 1);
        net.send(0.0, ());
        assert!(net.receive(10.0).is_none());
    }
}
