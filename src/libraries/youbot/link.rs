//! What travels between the two robots, and how good the link is.

use std::collections::VecDeque;

crate::runtime::record! {
    /// One packet.
    #[derive(Copy, Default)]
    pub struct Packet {
        /// Counts restarts of the sender.
        pub epoch: i64,
        /// Counts packets of an epoch.
        pub seq: i64,
        /// When it was sent, ns of the common clock.
        pub stamp: i64,
        /// Tool position in the sender's world, m.
        pub p: [f64; 3],
        /// Tool velocity, m/s.
        pub v: [f64; 3],
        /// The wanted force has been small for a while.
        pub aligned: bool,
        /// The coupling is engaged.
        pub copying: bool,
    }

    /// How good the link is.
    #[derive(Copy, Default)]
    pub struct LinkStats {
        /// Of the newest sample, s.
        pub age: f64,
        /// Since a packet came, s.
        pub gap: f64,
        /// Of the transit time (RFC 3550), s.
        pub jitter: f64,
        /// Share of packets lost in the last second.
        pub loss: f64,
        /// Of the newest packet.
        pub seq: i64,
    }

    /// What the other robot says of itself.
    #[derive(Copy, Default)]
    pub struct PeerState {
        /// Counts its restarts.
        pub epoch: i64,
        /// Its wanted force has been small for a while.
        pub aligned: bool,
        /// Its coupling is engaged.
        pub copying: bool,
        /// It began anew within the last [`RESTART_SHOWN`] seconds.
        pub restarted: bool,
    }
}

/// How long it is shown that the other robot began anew, in s: long enough for whoever looks at a few Hz.
pub const RESTART_SHOWN: f64 = 0.25;

/// Arrivals remembered for the loss: a second of 1 kHz.
const ARRIVALS: usize = 1024;

/// The receiving end: keeps the newest packet and measures.
#[derive(Debug, Clone)]
pub struct LinkReceiver {
    newest: Option<Packet>,
    arrived: f64,
    transit: f64,
    jitter: f64,
    /// Moment (s) and number of the packets of the last second.
    arrivals: VecDeque<(f64, i64)>,
    /// Over how long loss is counted, in s.
    pub window: f64,
    /// A packet so many numbers behind the newest of its epoch means that the sender began anew.
    pub max_seq_gap: i64,
}

impl Default for LinkReceiver {
    fn default() -> Self {
        Self {
            newest: None,
            arrived: 0.0,
            transit: 0.0,
            jitter: 0.0,
            arrivals: VecDeque::with_capacity(ARRIVALS),
            window: 1.0,
            max_seq_gap: 50,
        }
    }
}

impl LinkReceiver {
    /// Takes a packet in at `now` (s). Late ones count for the loss, and for nothing else.
    #[allow(clippy::cast_precision_loss)]
    pub fn take(&mut self, packet: Packet, now: f64) {
        let transit = now - packet.stamp as f64 * 1e-9;
        if let Some(newest) = &self.newest {
            let same = newest.epoch == packet.epoch && packet.seq > newest.seq - self.max_seq_gap;
            if !same {
                if packet.epoch < newest.epoch {
                    return;
                }
                self.arrivals.clear();
            } else {
                self.jitter += ((transit - self.transit).abs() - self.jitter) / 16.0;
            }
            if same && packet.seq <= newest.seq {
                self.note(now, packet.seq);
                return;
            }
        }
        self.note(now, packet.seq);
        self.transit = transit;
        self.arrived = now;
        self.newest = Some(packet);
    }

    fn note(&mut self, now: f64, seq: i64) {
        if self.arrivals.len() == ARRIVALS {
            self.arrivals.pop_front();
        }
        self.arrivals.push_back((now, seq));
    }

    /// The newest packet.
    pub fn newest(&self) -> Option<&Packet> {
        self.newest.as_ref()
    }

    /// How good the link is at `now` (s); none before the first packet.
    #[allow(clippy::cast_precision_loss)]
    pub fn stats(&mut self, now: f64) -> Option<LinkStats> {
        let newest = self.newest?;
        while self.arrivals.front().is_some_and(|(at, _)| *at < now - self.window) {
            self.arrivals.pop_front();
        }
        let first = self.arrivals.iter().map(|(_, seq)| *seq).min().unwrap_or(newest.seq);
        let expected = (newest.seq - first + 1).max(1) as f64;
        Some(LinkStats {
            age: now - newest.stamp as f64 * 1e-9,
            gap: now - self.arrived,
            jitter: self.jitter,
            loss: (1.0 - self.arrivals.len() as f64 / expected).clamp(0.0, 1.0),
            seq: newest.seq,
        })
    }

    /// Forgets everything but the settings.
    pub fn reset(&mut self) {
        self.newest = None;
        self.jitter = 0.0;
        self.arrivals.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::super::network::{Network, Quality};
    use super::*;

    fn run(quality: Quality) -> LinkStats {
        let mut net = Network::new(quality, 3);
        let mut receiver = LinkReceiver::default();
        let mut stats = None;
        for tick in 0..3000_i64 {
            let now = tick as f64 * 0.001;
            if tick % 4 == 0 {
                net.send(now, Packet { seq: tick / 4, stamp: tick * 1_000_000, ..Packet::default() });
            }
            while let Some(packet) = net.receive(now) {
                receiver.take(packet, now);
            }
            stats = receiver.stats(now).or(stats);
        }
        stats.expect("packets came")
    }

    #[test]
    fn it_measures_what_the_network_does() {
        let clean = run(Quality { delay: 0.005, ..Quality::default() });
        assert!((0.005..0.0101).contains(&clean.age) && clean.gap < 0.0051 && clean.loss == 0.0, "{clean:?}");
        assert!(clean.jitter < 1e-9);
        let lossy = run(Quality { delay: 0.005, loss: 0.3, ..Quality::default() });
        assert!((0.2..0.4).contains(&lossy.loss), "{lossy:?}");
        let shaky = run(Quality { delay: 0.005, jitter: 0.02, ..Quality::default() });
        assert!(shaky.jitter > 0.003 && shaky.loss < 0.05, "{shaky:?}");
    }

    #[test]
    fn a_new_epoch_begins_anew_and_an_old_one_is_not_heard() {
        let mut receiver = LinkReceiver::default();
        receiver.take(Packet { epoch: 1, seq: 900, ..Packet::default() }, 0.0);
        receiver.take(Packet { epoch: 2, seq: 0, ..Packet::default() }, 0.1);
        receiver.take(Packet { epoch: 1, seq: 901, ..Packet::default() }, 0.2);
        let newest = receiver.newest().unwrap();
        assert_eq!((newest.epoch, newest.seq), (2, 0));
    }
}
