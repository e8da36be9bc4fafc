//! How control passes from one law to another without a jolt: the torque of before fades, a moving arm is slowed along a
//! ramp, and nothing is driven faster than the drives may turn.

use super::parameters::{JOINTS, SPEED_LIMIT};
use super::rigid_body::J5;

/// How fast the torque that a switch leaves behind fades, in N m/s: 0.2 N m in an update of 1 ms.
pub const TORQUE_SLEW: f64 = 200.0;
/// How fast any torque of the drives changes, whatever asks for it, in N m/s: less than half a newton metre in an update of 1 ms.
const TORQUE_RATE: f64 = 450.0;
/// Deceleration of a quick stop, in rad/s²: from the drives' highest speed in a sixth of a second. With the speed gain of the
/// position controllers it asks for at most 0.24 N m more in each millisecond.
pub const QUICK_STOP: f64 = 10.0;
/// Speed from which torque that drives a joint on is taken away, in rad/s; at [`SPEED_LIMIT`] all of `tau_max` brakes.
const SPEED_GUARD: f64 = 1.4;

/// How far ahead it is looked whether a joint gets too fast, in s.
const FORESIGHT: f64 = 0.005;

/// `value` nearer to zero by at most `most` in each element.
pub fn towards_zero(value: &J5, most: f64) -> J5 {
    value.map(|v| v - v.clamp(-most, most))
}

/// From the torque `before` towards `wanted`, no faster than [`TORQUE_RATE`].
pub fn ramped(before: &J5, wanted: &J5, dt: f64) -> J5 {
    let most = TORQUE_RATE * dt;
    before + (wanted - before).map(|step| step.clamp(-most, most))
}

/// The speed of a quick stop, `dt` seconds after it was `speed`.
pub fn slowed(speed: &J5, dt: f64) -> J5 {
    towards_zero(speed, QUICK_STOP * dt)
}

/// The torque that is left of what was before a switch.
#[derive(Debug, Clone, Copy, Default)]
pub struct Handover {
    left: J5,
    begins: bool,
}

impl Handover {
    /// What is wanted from now on comes from another law.
    pub fn begin(&mut self) {
        self.begins = true;
    }

    /// What is put out where `wanted` is: in the first update after a switch the torque `before`, which then fades.
    pub fn over(&mut self, wanted: &J5, before: &J5, dt: f64) -> J5 {
        if std::mem::take(&mut self.begins) {
            self.left = before - wanted;
        }
        self.left = towards_zero(&self.left, TORQUE_SLEW * dt);
        wanted + self.left
    }
}

/// `torque` with what would drive a joint above [`SPEED_LIMIT`] taken away, and braking there with all of `most`. Torque comes by
/// a ramp: what counts is the speed that it will have [`FORESIGHT`] later, if it goes on `gaining` (rad/s²). A push that is
/// stronger than the drives still can.
pub fn within_speed(torque: &J5, speed: &J5, gaining: &J5, most: &J5) -> J5 {
    let mut out = *torque;
    for i in 0..JOINTS {
        let gained = (speed[i].signum() * gaining[i]).max(0.0) * FORESIGHT;
        let beyond = ((speed[i].abs() + gained - SPEED_GUARD) / (SPEED_LIMIT - SPEED_GUARD)).clamp(0.0, 1.0);
        out[i] += (-speed[i].signum() * most[i] - out[i]) * beyond;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.001;

    #[test]
    fn a_switch_is_not_felt_and_is_over_soon() {
        let mut handover = Handover::default();
        let (before, wanted) = (J5::repeat(7.0), J5::repeat(-3.0));
        assert_eq!(handover.over(&before, &J5::zeros(), DT), before, "no switch, nothing left");
        handover.begin();
        let (mut last, mut updates) = (before, 0);
        while last != wanted {
            let next = handover.over(&wanted, &last, DT);
            assert!((next - last).amax() <= 0.2 + 1e-9, "{last} {next}");
            (last, updates) = (next, updates + 1);
        }
        assert!((50..=51).contains(&updates), "{updates} ms");
    }

    #[test]
    fn a_quick_stop_ends_at_rest() {
        let mut speed = J5::from([1.5, -1.5, 0.3, 0.0, -0.004]);
        for _ in 0..150 {
            speed = slowed(&speed, DT);
        }
        assert!(speed.amax() < 1e-12, "{speed}");
    }

    #[test]
    fn only_what_is_too_fast_is_held_back() {
        let most = J5::repeat(10.0);
        let torque = J5::repeat(10.0);
        assert_eq!(within_speed(&torque, &J5::repeat(1.39), &J5::zeros(), &most), torque);
        assert_eq!(within_speed(&torque, &J5::repeat(SPEED_LIMIT), &J5::zeros(), &most), -torque);
        assert_eq!(within_speed(&torque, &J5::repeat(-2.0), &J5::zeros(), &most), torque, "it brakes already");
        let soon = within_speed(&torque, &J5::repeat(1.39), &J5::repeat(30.0), &most);
        assert!(soon.amax() < 10.0, "it will be too fast: {soon}");
        assert_eq!(within_speed(&torque, &J5::repeat(1.39), &J5::repeat(-30.0), &most), torque, "it is slowed already");
    }

    #[test]
    fn no_torque_comes_or_goes_at_once() {
        let (mut torque, wanted) = (J5::zeros(), J5::from([10.0, -13.0, 0.3, 0.0, 1.0]));
        for _ in 0..30 {
            let next = ramped(&torque, &wanted, DT);
            assert!((next - torque).amax() < 0.5, "{torque} {next}");
            torque = next;
        }
        assert_eq!(torque, wanted);
    }
}
