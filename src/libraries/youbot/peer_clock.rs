//! What the other robot's clock shows, from packets that go round.
//!
//! Two robots have two clocks, and a packet's moment of sending is one of the sender's. Each packet brings back the newest moment
//! that was heard of its receiver, with the moment it was heard at: with the packet's own two moments that makes four, from which the
//! time under way and the difference of the clocks follow (as in NTP, RFC 5905). The difference is right where both ways take
//! the same time, and wrong by half of what one takes longer. A packet that waited in a queue says little of it: of a while the one
//! that was quickest there and back counts.

/// The least of how many seconds counts, twice over: shorter than what clocks drift apart in that matters here (0.1 ms at 50 ppm).
const WHILE: f64 = 1.0;

/// What a receiver knows of the sender's clock.
#[derive(Debug, Clone, Copy, Default)]
pub struct PeerClock {
    /// The quickest of this while, and of the one before.
    best: [Option<RoundTrip>; 2],
    since: f64,
}

#[derive(Debug, Clone, Copy)]
struct RoundTrip {
    /// Under way, both ways together, in s.
    delay: f64,
    /// The sender's clock minus the receiver's, in s.
    offset: f64,
}

/// The four moments of a packet that went round, in s: sent and come back by the clock of whoever measures, heard and answered
/// by the other's.
#[derive(Debug, Clone, Copy)]
pub struct Moments {
    /// When the packet that is answered was sent.
    pub sent: f64,
    /// When the other robot heard it.
    pub heard: f64,
    /// When it answered.
    pub answered: f64,
    /// When the answer came.
    pub came: f64,
}

impl PeerClock {
    /// Takes a packet's moments into account.
    pub fn take(&mut self, m: Moments) {
        let delay = (m.came - m.sent) - (m.answered - m.heard);
        let offset = 0.5 * ((m.heard - m.sent) + (m.answered - m.came));
        if m.came - self.since > WHILE {
            self.best = [None, self.best[0]];
            self.since = m.came;
        }
        if self.best[0].is_none_or(|best| delay < best.delay) {
            self.best[0] = Some(RoundTrip { delay, offset });
        }
    }

    fn quickest(&self) -> Option<RoundTrip> {
        self.best.into_iter().flatten().min_by(|a, b| a.delay.total_cmp(&b.delay))
    }

    /// The sender's clock minus the receiver's, in s; none before a packet went round.
    pub fn offset(&self) -> Option<f64> {
        self.quickest().map(|trip| trip.offset)
    }

    /// The quickest way there and back, in s.
    pub fn round_trip(&self) -> Option<f64> {
        self.quickest().map(|trip| trip.delay)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A packet every 4 ms, answered after 2 ms, there and back in such times, by a clock that is `ahead` (s) and drifts.
    fn measured(there: impl Fn(u32) -> f64, back: impl Fn(u32) -> f64, ahead: f64, drift: f64) -> f64 {
        let mut clock = PeerClock::default();
        let other = |t: f64| t * (1.0 + drift) + ahead;
        let mut came = 0.0;
        for i in 0..2500 {
            let sent = f64::from(i) * 0.004;
            let heard = sent + there(i);
            came = heard + 0.002 + back(i);
            clock.take(Moments { sent, heard: other(heard), answered: other(heard + 0.002), came });
        }
        clock.offset().unwrap() - (other(came) - came)
    }

    #[test]
    fn it_is_right_on_equal_ways_and_wrong_by_half_of_what_one_takes_longer() {
        assert!(measured(|_| 0.02, |_| 0.02, 3.7, 0.0).abs() < 1e-9);
        assert!(measured(|_| 0.02, |_| 0.02, -3.7, 50e-6).abs() < 1.1e-4);
        let wrong = measured(|_| 0.02, |_| 0.05, 3.7, 0.0);
        assert!((wrong + 0.015).abs() < 1e-9, "{wrong}");
    }

    #[test]
    fn queues_do_not_disturb_it() {
        // One in twenty gets through without waiting.
        let waits =
            |i: u32, often: u32| if i.is_multiple_of(often) { 0.005 } else { 0.005 + f64::from(i * 7 % 30) * 1e-3 };
        let wrong = measured(|i| waits(i, 20), |i| waits(i, 20), 1.0, 0.0);
        assert!(wrong.abs() < 1e-9, "{wrong}");
    }
}
