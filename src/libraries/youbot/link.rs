//! What travels between the two robots, and how good the link is.

use super::peer_clock::{Moments, PeerClock};
use std::collections::VecDeque;

crate::runtime::record! {
    /// One packet.
    #[derive(Copy, Default)]
    pub struct Packet {
        /// Counts restarts of the sender.
        pub epoch: i64,
        /// Counts packets of an epoch.
        pub seq: i64,
        /// When it was sent, ns of the sender's clock.
        pub stamp: i64,
        /// What the sender had heard of the receiver last.
        pub echo: Echo,
        /// Tool position in the sender's world, m.
        pub p: [f64; 3],
        /// Tool velocity, m/s.
        pub v: [f64; 3],
        /// The wanted force has been small for a while.
        pub aligned: bool,
        /// The sender wants to be coupled.
        pub copying: bool,
        /// The sender's base yields: eight degrees of freedom.
        pub yields: bool,
        /// Energy that the sender's coupling has given to the receiver's so far, J (the law `tank`).
        pub energy: f64,
    }

    /// What was heard of the other robot last, for it to measure the time under way.
    #[derive(Copy, Default)]
    pub struct Echo {
        /// When it was sent, ns of the clock of whoever sent it; 0: nothing was heard.
        pub stamp: i64,
        /// When it was heard, ns of the clock of whoever heard it.
        pub heard: i64,
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
        /// The quickest way there and back of the last seconds, s.
        pub round_trip: f64,
        /// The other robot's clock minus this one's, s.
        pub clock_offset: f64,
    }

    /// What the other robot says of itself.
    #[derive(Copy, Default)]
    pub struct PeerState {
        /// Counts its restarts.
        pub epoch: i64,
        /// Its wanted force has been small for a while.
        pub aligned: bool,
        /// It wants to be coupled.
        pub copying: bool,
        /// Its base yields: eight degrees of freedom.
        pub yields: bool,
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
    clock: PeerClock,
    /// Moment (s) and number of the packets of the last second.
    arrivals: VecDeque<(f64, i64)>,
    /// When one came last that was sent before the one that came before it.
    disordered: f64,
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
            clock: PeerClock::default(),
            arrivals: VecDeque::with_capacity(ARRIVALS),
            disordered: f64::NEG_INFINITY,
            window: 1.0,
            max_seq_gap: 50,
        }
    }
}

impl LinkReceiver {
    /// Takes a packet in at `now` (s). Late ones count for the loss, and for nothing else.
    pub fn take(&mut self, packet: Packet, now: f64) {
        // By two clocks: of use where two of them are compared.
        let transit = now - seconds(packet.stamp);
        if let Some(newest) = &self.newest {
            let same = newest.epoch == packet.epoch && packet.seq > newest.seq - self.max_seq_gap;
            if !same {
                if packet.epoch < newest.epoch {
                    return;
                }
                self.arrivals.clear();
                self.clock = PeerClock::default();
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
        if packet.echo.stamp != 0 {
            self.clock.take(Moments {
                sent: seconds(packet.echo.stamp),
                heard: seconds(packet.echo.heard),
                answered: seconds(packet.stamp),
                came: now,
            });
        }
    }

    fn note(&mut self, now: f64, seq: i64) {
        if self.arrivals.len() == ARRIVALS {
            self.arrivals.pop_front();
        }
        if self.arrivals.back().is_some_and(|(_, before)| seq < *before) {
            self.disordered = now;
        }
        self.arrivals.push_back((now, seq));
    }

    /// The newest packet.
    pub fn newest(&self) -> Option<&Packet> {
        self.newest.as_ref()
    }

    /// What is sent back, so that the other robot can measure.
    pub fn echo(&self) -> Echo {
        self.newest.map_or_else(Echo::default, |newest| Echo { stamp: newest.stamp, heard: nanoseconds(self.arrived) })
    }

    /// When the newest packet was sent, by the receiver's clock, in s. None before a packet that went round has shown how
    /// the two clocks differ: what is not heard by the other robot has no link.
    pub fn sent(&self) -> Option<f64> {
        let newest = self.newest?;
        // Nothing comes before it is sent: where the ways differ the clocks are not known better than that.
        self.clock.offset().map(|offset| (seconds(newest.stamp) - offset).min(self.arrived))
    }

    /// How good the link is at `now` (s); none before the first packet that went round.
    #[allow(clippy::cast_precision_loss)]
    pub fn stats(&mut self, now: f64) -> Option<LinkStats> {
        let (newest, sent) = (self.newest?, self.sent()?);
        while self.arrivals.front().is_some_and(|(at, _)| *at < now - self.window) {
            self.arrivals.pop_front();
        }
        // Mostly they came in order; who asks a thousand times a second does not look at all of them.
        let first = match self.arrivals.front() {
            Some((at, seq)) if *at > self.disordered => *seq,
            _ => self.arrivals.iter().map(|(_, seq)| *seq).min().unwrap_or(newest.seq),
        };
        let expected = (newest.seq - first + 1).max(1) as f64;
        Some(LinkStats {
            age: now - sent,
            gap: now - self.arrived,
            jitter: self.jitter,
            loss: (1.0 - self.arrivals.len() as f64 / expected).clamp(0.0, 1.0),
            seq: newest.seq,
            round_trip: self.clock.round_trip()?,
            clock_offset: self.clock.offset()?,
        })
    }

    /// Forgets everything but the settings.
    pub fn reset(&mut self) {
        self.newest = None;
        self.jitter = 0.0;
        self.clock = PeerClock::default();
        self.arrivals.clear();
    }
}

#[allow(clippy::cast_precision_loss)]
fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 * 1e-9
}

#[allow(clippy::cast_possible_truncation)]
fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::super::network::{Network, Quality};
    use super::*;

    /// Three seconds of packets both ways, the other's clock so far `ahead` (s).
    fn run(quality: Quality, ahead: f64) -> LinkStats {
        let mut nets = [Network::new(quality, 3), Network::new(quality, 4)];
        let mut receivers = [LinkReceiver::default(), LinkReceiver::default()];
        let mut stats = None;
        for tick in 0..3000_i64 {
            let times = [0, 1].map(|side| tick as f64 * 0.001 + if side == 1 { ahead } else { 0.0 });
            for side in 0..2 {
                if tick % 4 == 0 {
                    let (stamp, echo) = (nanoseconds(times[side]), receivers[side].echo());
                    let packet = Packet { seq: tick / 4, stamp, echo, ..Packet::default() };
                    nets[side].send(times[0], packet);
                }
                while let Some(packet) = nets[1 - side].receive(times[0]) {
                    receivers[side].take(packet, times[side]);
                }
            }
            stats = receivers[0].stats(times[0]).or(stats);
        }
        stats.expect("packets came")
    }

    #[test]
    fn it_measures_what_the_network_does_whatever_the_clocks_show() {
        for ahead in [0.0, 1234.5, -0.3] {
            let clean = run(Quality { delay: 0.005, ..Quality::default() }, ahead);
            assert!((0.0049..0.0101).contains(&clean.age) && clean.gap < 0.0051 && clean.loss == 0.0, "{clean:?}");
            assert!((clean.clock_offset - ahead).abs() < 1e-6 && clean.jitter < 1e-6, "{clean:?}");
            let lossy = run(Quality { delay: 0.005, loss: 0.3, ..Quality::default() }, ahead);
            assert!((0.2..0.4).contains(&lossy.loss), "{lossy:?}");
            let shaky = run(Quality { delay: 0.005, jitter: 0.02, ..Quality::default() }, ahead);
            assert!(shaky.jitter > 0.002 && shaky.loss < 0.05, "{shaky:?}");
        }
    }

    #[test]
    fn without_an_answer_there_is_no_link() {
        let mut receiver = LinkReceiver::default();
        receiver.take(Packet { seq: 1, stamp: 5, ..Packet::default() }, 0.1);
        assert_eq!((receiver.stats(0.1), receiver.sent()), (None, None));
        assert_eq!(receiver.echo(), Echo { stamp: 5, heard: 100_000_000 });
    }

    #[test]
    fn what_comes_out_of_order_is_not_lost() {
        let mut receiver = LinkReceiver { window: 0.1, ..LinkReceiver::default() };
        let mut loss = |seq: i64, now: f64| {
            let echo = Echo { stamp: nanoseconds(now - 0.003), heard: nanoseconds(now - 0.002) };
            receiver.take(Packet { seq, stamp: nanoseconds(now - 0.001), echo, ..Packet::default() }, now);
            receiver.stats(now).expect("it went round").loss
        };
        assert_eq!([(1, 1.0), (5, 1.05), (2, 1.06)].map(|(seq, now)| loss(seq, now)), [0.0, 0.6, 0.4]);
        // The first one is forgotten: those left are 5, 2 and 6 of 2 to 6, then 2, 6 and 7, and in order 6, 7 and 8.
        assert_eq!([(6, 1.11), (7, 1.155), (8, 1.165)].map(|(seq, now)| loss(seq, now)), [0.4, 0.5, 0.0]);
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
