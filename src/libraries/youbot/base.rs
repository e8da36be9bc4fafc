//! The mobile base.

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
    fn a_full_circle_comes_home() {
        let t = Twist2 { vx: 0.2, vy: 0.0, wz: 0.5 };
        let n = 10_000;
        let dt = std::f64::consts::TAU / t.wz / f64::from(n);
        let end = (0..n).fold(Pose2::default(), |p, _| p.moved(t, dt));
        assert!(end.x.hypot(end.y) < 1e-6);
    }
}
