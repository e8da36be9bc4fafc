//! An energy tank: what makes a coupling passive whatever the network between its two ends does.
//!
//! All work that the coupling does on its own tool comes out of the tank, exactly: force times the way it really went in each step.
//! What the hand puts in by moving against the force fills it, and a share of it goes to the other end's tank, told as a
//! sum so far: a lost packet loses no energy, and one that comes twice brings none. When the tank runs low the tool is braked, which fills
//! it, and when it is empty the force does no more work on the tool; it may still hold it. So both ends together never
//! give out more than they took in and had at the beginning, with any delay, jitter or loss (Franken, Stramigioli and others, "Bilateral
//! telemanipulation with time delays: a two-layer approach combining passivity and transparency", 2011).

use nalgebra::Vector3;

/// Level from which the tool is not braked to fill the tank, in J.
const WANTED: f64 = 0.06;
/// Level below which the force's work is reduced, in J.
const LOW: f64 = 0.01;
/// What is more is given up, in J: an oscillation cannot last on it.
const MOST: f64 = 0.25;
/// Braking with an empty tank, in N s/m.
const BRAKING: f64 = 15.0;
/// Share of the level that goes to the other end, in 1/s.
const SHARED: f64 = 10.0;
/// Share of the level that is given up, in 1/s: what nobody moves any more ends empty.
const LEAK: f64 = 0.5;
/// Speed above which reducing the work is reducing the force, in m/s, with a full tank; with an empty one always.
const SLOW: f64 = 0.01;

/// One end's tank.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tank {
    level: f64,
    sent: f64,
    /// What the other end has sent so far, as heard last.
    heard: Option<f64>,
    /// What was put out in the last step, in N, and where the tool was, in m.
    last: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl Tank {
    /// A tank with so much in it, in J.
    pub fn with(level: f64) -> Self {
        Self { level, ..Self::default() }
    }

    /// The same, with the sums of an earlier one: the other end counts on them.
    pub fn after(self, earlier: &Self) -> Self {
        Self { sent: earlier.sent, heard: None, ..self }
    }

    /// What is in it, in J.
    #[cfg(test)]
    pub fn level(&self) -> f64 {
        self.level
    }

    /// What it has given to the other end so far, in J.
    pub fn sent(&self) -> f64 {
        self.sent
    }

    /// The force that may be put out in the next `dt` seconds where `wanted` is (N), with the tool at `position` (m) moving
    /// with `velocity` (m/s); `heard`: what the other end has sent so far, in J.
    pub fn update(
        &mut self,
        wanted: &Vector3<f64>,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        heard: Option<f64>,
        dt: f64,
    ) -> Vector3<f64> {
        if let Some((force, before)) = self.last {
            self.level -= force.dot(&(position - before));
        }
        if let Some(now) = heard {
            // Less than before: the other end began anew.
            self.level += (now - self.heard.unwrap_or(now)).max(0.0);
            self.heard = Some(now);
        }
        let shared = self.level.max(0.0) * SHARED * dt;
        self.sent += shared;
        self.level -= shared + self.level.max(0.0) * LEAK * dt;
        self.level = self.level.min(MOST);
        let braking = BRAKING * (1.0 - self.level / WANTED).clamp(0.0, 1.0);
        let mut force = wanted - velocity * braking;
        let share = (self.level / LOW).clamp(0.0, 1.0);
        let speed = velocity.norm();
        let power = force.dot(velocity);
        if power > 0.0 {
            let slow = SLOW * share;
            force -= velocity * (power * (1.0 - share) / (speed * speed + slow * slow));
        }
        self.last = Some((force, *position));
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.001;

    /// Five seconds of a force of 5 N that always pushes along a motion of 0.1 m/s: what it does to the tool, in J.
    fn pushed_along(tank: &mut Tank, heard: impl Fn(usize) -> Option<f64>) -> f64 {
        let (velocity, mut position, mut work) = (Vector3::new(0.1, 0.0, 0.0), Vector3::zeros(), 0.0);
        for tick in 0..5000 {
            let force = tank.update(&Vector3::new(5.0, 0.0, 0.0), &position, &velocity, heard(tick), DT);
            position += velocity * DT;
            work += force.dot(&velocity) * DT;
        }
        work
    }

    #[test]
    fn what_pushes_along_ends_when_the_tank_is_empty() {
        // Shared with the other end meanwhile: less than was in it.
        let mut tank = Tank::with(0.02);
        let work = pushed_along(&mut tank, |_| None);
        assert!(work < 0.02 && tank.level() > -1e-4, "{work} J, {} J left", tank.level());
    }

    #[test]
    fn what_is_told_again_counts_once() {
        let told = |tick: usize| Some(if tick < 100 { 0.0 } else { 0.05 });
        let (mut with, mut without) = (Tank::with(0.0), Tank::with(0.0));
        let gained = pushed_along(&mut with, told) - pushed_along(&mut without, |_| None);
        assert!(gained > 0.01 && gained < 0.06, "{gained} J");
    }
}
