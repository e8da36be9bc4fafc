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

/// What the base is allowed to do.
#[derive(Debug, Clone, Copy)]
pub struct BaseLimits {
    /// In m/s.
    pub v_max: f64,
    /// In rad/s.
    pub w_max: f64,
    /// In m/s² (and rad/s² times one metre).
    pub a_max: f64,
    /// Speeds below it are zero, in m/s.
    pub deadband: f64,
}

impl Default for BaseLimits {
    fn default() -> Self {
        Self { v_max: 0.3, w_max: 0.6, a_max: 1.0, deadband: 0.01 }
    }
}

impl BaseLimits {
    /// The next command after `last`, `dt` seconds later, towards `wanted`.
    pub fn limit(&self, wanted: Twist2, last: Twist2, dt: f64) -> Twist2 {
        let one = |want: f64, last: f64, most: f64| {
            let want = if want.abs() < self.deadband { 0.0 } else { want.clamp(-most, most) };
            last + (want - last).clamp(-self.a_max * dt, self.a_max * dt)
        };
        Twist2 {
            vx: one(wanted.vx, last.vx, self.v_max),
            vy: one(wanted.vy, last.vy, self.v_max),
            wz: one(wanted.wz, last.wz, self.w_max),
        }
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

    #[test]
    fn the_base_is_limited() {
        let limits = BaseLimits::default();
        let mut t = Twist2::default();
        for _ in 0..1000 {
            t = limits.limit(Twist2 { vx: 5.0, vy: 0.005, wz: -9.0 }, t, 0.004);
        }
        assert_eq!((t.vx, t.vy, t.wz), (0.3, 0.0, -0.6));
    }
}
