//! What goes wrong with a network for a time, whatever it should be like; then it is as it should be again.

use super::Quality;
use crate::libraries::youbot::link::Packet;
use crate::time::Time;

/// What may go wrong with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NetworkFault {
    /// Nothing gets through.
    Cut,
    /// One way takes so long, in s.
    Delay,
    /// Up to so much is added, in s.
    Jitter,
    /// Such a share takes longer.
    Reorder,
    /// Such a share comes twice.
    Duplicate,
    /// Such a share is lost.
    Loss,
    /// So many packets get through in a second.
    Rate,
}

impl NetworkFault {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Cut, Self::Delay, Self::Jitter, Self::Reorder, Self::Duplicate, Self::Loss, Self::Rate];
}

/// Those that are in force, each with its figure and its end; and by how much (m) the tool's position is wrong in what is sent.
#[derive(Debug, Clone, Copy, Default)]
pub struct NetworkFaults {
    figures: [Option<(f64, Time)>; NetworkFault::ALL.len()],
    displaced: Option<([f64; 3], Time)>,
}

impl NetworkFaults {
    /// It goes wrong until then; what is told of the same fault later counts.
    pub fn begin(&mut self, fault: NetworkFault, figure: f64, until: Time) {
        self.figures[fault as usize] = Some((figure, until));
    }

    /// The tool's position is wrong by so much until then.
    pub fn displace(&mut self, by: [f64; 3], until: Time) {
        self.displaced = Some((by, until));
    }

    /// Nothing is wrong any more.
    pub fn heal(&mut self) {
        *self = Self::default();
    }

    /// How a network is at `now` that should be so.
    pub fn over(&mut self, now: Time, mut quality: Quality) -> Quality {
        for (fault, begun) in NetworkFault::ALL.into_iter().zip(&mut self.figures) {
            *begun = begun.filter(|(_, until)| now < *until);
            let Some((figure, _)) = *begun else { continue };
            match fault {
                NetworkFault::Cut => quality.cut = true,
                NetworkFault::Delay => quality.delay = figure,
                NetworkFault::Jitter => quality.jitter = figure,
                NetworkFault::Reorder => quality.reorder = figure,
                NetworkFault::Duplicate => quality.duplicate = figure,
                NetworkFault::Loss => quality.loss = figure,
                NetworkFault::Rate => quality.rate = figure,
            }
        }
        quality
    }

    /// What is sent for a packet at `now`.
    pub fn sent_for(&mut self, now: Time, mut packet: Packet) -> Packet {
        self.displaced = self.displaced.filter(|(_, until)| now < *until);
        if let Some((by, _)) = self.displaced {
            packet.p.iter_mut().zip(by).for_each(|(p, by)| *p += by);
        }
        packet
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_over_when_their_time_is() {
        let should = Quality { delay: 0.002, ..Quality::default() };
        let at = |ms: u64| Time(ms * 1_000_000);
        let mut faults = NetworkFaults::default();
        faults.begin(NetworkFault::Cut, 0.0, at(20));
        faults.begin(NetworkFault::Delay, 0.05, at(30));
        faults.begin(NetworkFault::Loss, 0.3, Time::NEVER);
        assert_eq!(faults.over(at(19), should), Quality { delay: 0.05, loss: 0.3, cut: true, ..should });
        assert_eq!(faults.over(at(20), should), Quality { delay: 0.05, loss: 0.3, ..should });
        faults.begin(NetworkFault::Delay, 0.1, at(40));
        assert_eq!(faults.over(at(30), should), Quality { delay: 0.1, loss: 0.3, ..should });
        assert_eq!(faults.over(at(40), should), Quality { loss: 0.3, ..should });
        let packet = Packet { p: [1.0, 2.0, 3.0], v: [0.1, 0.2, 0.3], seq: 7, aligned: true, ..Packet::default() };
        faults.displace([0.5, 0.0, -1.0], at(50));
        assert_eq!(faults.sent_for(at(49), packet), Packet { p: [1.5, 2.0, 2.0], ..packet });
        assert_eq!(faults.sent_for(at(50), packet), packet);
        faults.displace([0.5, 0.0, -1.0], Time::NEVER);
        faults.heal();
        assert_eq!((faults.over(at(40), should), faults.sent_for(at(40), packet)), (should, packet));
    }
}
