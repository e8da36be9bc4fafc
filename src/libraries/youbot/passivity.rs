//! A passivity observer of two ports: what a coupling takes in and gives out at both of its ends, the network between them included.

use nalgebra::Vector3;

/// A coupling that has given out so much more than it took in and held at the beginning is not passive, in J: what rounding and the
/// step of 1 ms make of nothing is less.
const TOLERANCE: f64 = 1e-3;

/// One end of the coupling.
#[derive(Debug, Clone, Copy)]
pub struct CouplingEnd {
    /// What the coupling puts on the tool, in N.
    pub force: Vector3<f64>,
    /// Where the tool is, in m.
    pub position: Vector3<f64>,
}

/// What was observed.
#[derive(Debug, Clone, Copy, Default)]
pub struct PassivityObserver {
    /// What it has taken in at both ends so far, less what it gave out, in J.
    pub energy: f64,
    /// The least that was ever, in J.
    pub minimum: f64,
    /// What it held at the beginning, in J.
    pub stored: f64,
    /// Whether it ever gave out more than it had taken in and held at the beginning.
    pub violated: bool,
    last: Option<[CouplingEnd; 2]>,
}

impl PassivityObserver {
    /// Begins to count: the coupling holds so much (J). What was ever violated stays so.
    pub fn begin(&mut self, stored: f64) {
        *self = Self { stored, violated: self.violated, ..Self::default() };
    }

    /// Both ends, once a control period: the force is put out until the next time.
    pub fn update(&mut self, ends: [CouplingEnd; 2]) {
        if let Some(before) = self.last.replace(ends) {
            let work = |side: usize| before[side].force.dot(&(ends[side].position - before[side].position));
            self.energy -= work(0) + work(1);
            self.minimum = self.minimum.min(self.energy);
            self.violated |= self.minimum < -self.stored - TOLERANCE;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spring between two ends which go to and fro against each other, and may be stiffer on the way back.
    fn spring(out: f64, back: f64) -> PassivityObserver {
        let mut observer = PassivityObserver::default();
        observer.begin(0.0);
        for i in 0..=40_000 {
            let phase = f64::from(i) * std::f64::consts::TAU / 40_000.0;
            let (x, stiffness) = (0.05 * (1.0 - phase.cos()), if i < 20_000 { out } else { back });
            let end = |sign: f64| CouplingEnd {
                force: Vector3::new(-sign * stiffness * 2.0 * x, 0.0, 0.0),
                position: Vector3::new(sign * x, 0.0, 0.0),
            };
            observer.update([end(1.0), end(-1.0)]);
        }
        observer
    }

    #[test]
    fn a_spring_is_passive_and_one_that_gets_stiffer_is_not() {
        let true_one = spring(150.0, 150.0);
        assert!(!true_one.violated && true_one.energy.abs() < 0.02, "{true_one:?}");
        assert!(!spring(150.0, 100.0).violated);
        let wound = spring(150.0, 300.0);
        // Wound up with ½·150·0.2² J, unwound with twice that.
        assert!(wound.violated && (wound.minimum + 3.0).abs() < 0.1, "{wound:?}");
    }
}
