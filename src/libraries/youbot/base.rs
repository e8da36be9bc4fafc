//! The mobile base: four mecanum wheels.

use super::parameters::{WHEEL_LEVER, WHEEL_RADIUS};

/// A planar velocity in the base's own frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist2 {
    /// Forward, in m/s.
    pub vx: f64,
    /// To the left, in m/s.
    pub vy: f64,
    /// Turning left, in rad/s.
    pub wz: f64,
}

/// A position on the floor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose2 {
    /// In m.
    pub x: f64,
    /// In m.
    pub y: f64,
    /// In rad.
    pub th: f64,
}

/// Wheel speeds (front left, front right, back left, back right), in rad/s, of a twist; signs as in the youBot's
/// driver, whose right-hand motors are mounted mirrored.
pub fn wheel_speeds(t: Twist2) -> [f64; 4] {
    let turn = WHEEL_LEVER * t.wz;
    [
        (-t.vx + t.vy + turn) / WHEEL_RADIUS,
        (t.vx + t.vy + turn) / WHEEL_RADIUS,
        (-t.vx - t.vy + turn) / WHEEL_RADIUS,
        (t.vx - t.vy + turn) / WHEEL_RADIUS,
    ]
}

/// The twist of wheel speeds: the least-squares answer when the wheels slip.
pub fn twist_of_wheels(w: [f64; 4]) -> Twist2 {
    let q = WHEEL_RADIUS / 4.0;
    Twist2 {
        vx: q * (-w[0] + w[1] - w[2] + w[3]),
        vy: q * (w[0] + w[1] - w[2] - w[3]),
        wz: q / WHEEL_LEVER * (w[0] + w[1] + w[2] + w[3]),
    }
}

impl Pose2 {
    /// Where the base is after moving with `t` for `dt` seconds (turn taken at its middle: exact to second order).
    pub fn moved(self, t: Twist2, dt: f64) -> Self {
        let (s, c) = (self.th + 0.5 * dt * t.wz).sin_cos();
        Self { x: self.x + dt * (c * t.vx - s * t.vy), y: self.y + dt * (s * t.vx + c * t.vy), th: self.th + dt * t.wz }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wheels_and_back() {
        for t in [
            Twist2 { vx: 0.3, vy: 0.0, wz: 0.0 },
            Twist2 { vx: 0.0, vy: -0.2, wz: 0.0 },
            Twist2 { vx: 0.1, vy: 0.2, wz: -0.5 },
        ] {
            let back = twist_of_wheels(wheel_speeds(t));
            assert!((back.vx - t.vx).abs() + (back.vy - t.vy).abs() + (back.wz - t.wz).abs() < 1e-12);
        }
        // Forward: the left wheels, mounted mirrored, turn the other way than the right ones.
        let w = wheel_speeds(Twist2 { vx: 0.475, vy: 0.0, wz: 0.0 });
        assert!((w[0] + 10.0).abs() < 1e-9 && (w[1] - 10.0).abs() < 1e-9);
    }

    #[test]
    fn a_full_circle_comes_home() {
        let t = Twist2 { vx: 0.2, vy: 0.0, wz: 0.5 };
        let n = 10_000;
        let dt = std::f64::consts::TAU / t.wz / f64::from(n);
        let end = (0..n).fold(Pose2::default(), |p, _| p.moved(t, dt));
        assert!(end.x.hypot(end.y) < 1e-6);
    }
}
