//! What the drives' electronics make of what is there and of what is wanted: encoders that count, and motors that must not get too hot.

use super::parameters::{ENCODER_TICKS, GEAR, JOINTS};
use super::rigid_body::J5;

/// Encoders: angles in whole counts, speeds as differences of them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Encoders {
    last: Option<J5>,
}

impl Encoders {
    /// What they make of angles `q` (rad), `dt` seconds after the last time: angles and speeds.
    pub fn read(&mut self, q: &J5, dt: f64) -> (J5, J5) {
        let counted = J5::from_fn(|i, _| {
            let count = std::f64::consts::TAU / (GEAR[i] * ENCODER_TICKS);
            (q[i] / count).round() * count
        });
        let before = self.last.replace(counted).unwrap_or(counted);
        (counted, if dt > 0.0 { (counted - before) / dt } else { J5::zeros() })
    }
}

/// Share of the largest torque that a motor gives for ever.
const LASTING: f64 = 0.8;
/// How long it gives the largest one when it is cold, in s.
const AT_MOST: f64 = 0.5;

/// The limit of current squared times time: a motor that gave too much for too long gives no more than it can for ever, until it has
/// made up for that.
#[derive(Debug, Clone, Copy, Default)]
pub struct HeatLimit {
    /// Squares of shares of the largest torque beyond the lasting ones, times s.
    used: J5,
    limited: [bool; JOINTS],
}

/// What the limit did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeatChange {
    /// A first motor is limited: of this joint, counted from 0.
    Exceeded(usize),
    /// None is any more.
    Exit,
}

impl HeatLimit {
    /// What the motors may give of `most` (N m).
    pub fn of(&self, most: &J5) -> J5 {
        J5::from_fn(|i, _| if self.limited[i] { LASTING * most[i] } else { most[i] })
    }

    /// They give `torque` for `dt` seconds, with `most` as their largest (N m).
    pub fn update(&mut self, torque: &J5, most: &J5, dt: f64) -> Option<HeatChange> {
        let limited = |it: &Self| it.limited.iter().position(|limited| *limited);
        let before = limited(self);
        for i in 0..JOINTS {
            let share = if most[i] > 0.0 { torque[i] / most[i] } else { 0.0 };
            self.used[i] = (self.used[i] + (share * share - LASTING * LASTING) * dt).max(0.0);
            let room = (1.0 - LASTING * LASTING) * AT_MOST;
            // Rounding must not let a motor that gives the lasting torque stay limited for ever.
            self.limited[i] = if self.limited[i] { self.used[i] > 1e-3 * room } else { self.used[i] >= room - 1e-9 };
        }
        match (before, limited(self)) {
            (None, Some(joint)) => Some(HeatChange::Exceeded(joint)),
            (Some(_), None) => Some(HeatChange::Exit),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoders_count() {
        let mut encoders = Encoders::default();
        let count = std::f64::consts::TAU / (156.0 * 4000.0);
        encoders.read(&J5::repeat(0.0), 0.001);
        let (q, qd) = encoders.read(&J5::repeat(1.05 * count), 0.001);
        assert!((q[0] - count).abs() < 1e-12 && (qd[0] - count / 0.001).abs() < 1e-9, "{q} {qd}");
        assert_eq!((q[3], qd[3]), (0.0, 0.0), "half a count of a coarser one");
    }

    #[test]
    fn the_largest_torque_is_given_for_half_a_second() {
        let (mut heat, most) = (HeatLimit::default(), J5::from([10.0, 13.0, 7.0, 3.0, 1.0]));
        let mut give = |share: f64, seconds: f64| {
            let ticks = (seconds * 1e3).round() as usize;
            let at = (0..ticks).find_map(|i| heat.update(&(most * share), &most, 0.001).map(|what| (i, what)));
            (at, heat.of(&most)[1] / most[1])
        };
        assert_eq!(give(LASTING, 60.0), (None, 1.0));
        assert_eq!(give(1.0, 2.0), (Some((499, HeatChange::Exceeded(0))), LASTING));
        let (back, share) = give(0.5, 2.0);
        assert!(matches!(back, Some((400..500, HeatChange::Exit))) && share == 1.0, "{back:?}");
    }
}
