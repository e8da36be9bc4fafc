//! What a simulated platform is asked to do wrong, how long its steps take, and what it raises by itself. Plain data.

use crate::model::{ComponentName, EventName, StepPattern};
use std::time::Duration;

/// What goes wrong with a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// It does not happen, and the platform says so.
    Fail,
    /// The call never answers; the component is in quarantine. With a time, the call comes back so long after its
    /// deadline: what it had done is taken back, the component leaves quarantine, and the platform reports it.
    Hang {
        /// How long after the deadline the call returns.
        returns: Option<Duration>,
    },
    /// It does not happen, and nobody says so: the request was lost. The answer is *unknown* at the deadline.
    LostRequest,
    /// It happens, and nobody says so: the answer was lost. The answer is *unknown* at the deadline.
    LostAnswer,
    /// It does not happen, and the platform says that it did.
    FalseDone,
    /// It happens, and the platform says that it did not.
    FalseNotDone,
    /// The component's code panics: it is faulted (a component being created is not there).
    Panic,
    /// It takes as long as [`Delays`] say, and when it is given up the component takes no notice.
    Deaf,
    /// It takes so long instead of what [`Delays`] say. The first other fault that fits hits it as well.
    Slow(Duration),
}

/// Which executed step a fault hits: all conditions given must hold.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct When {
    /// The so-many-th step asked for since the faults were set, counted from 1.
    pub nth: Option<u64>,
    /// A step of this pattern.
    pub pattern: Option<StepPattern>,
    /// With this probability, 0 to 1, decided by the seed.
    pub chance: Option<f64>,
}

/// One thing that goes wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultRule {
    /// With which steps.
    pub when: When,
    /// What.
    pub fault: Fault,
    /// How often at most.
    pub times: u32,
}

impl FaultRule {
    /// `fault` at the `nth` step asked for from now on, counted from 1.
    pub fn nth(nth: u64, fault: Fault) -> Self {
        Self { when: When { nth: Some(nth), ..When::default() }, fault, times: 1 }
    }

    /// `fault` at every step of `pattern`.
    pub fn on(pattern: &str, fault: Fault) -> Self {
        Self { when: When { pattern: Some(StepPattern::new(pattern)), ..When::default() }, fault, times: u32::MAX }
    }

    /// `fault` at any step, with probability `chance`.
    pub fn chance(chance: f64, fault: Fault) -> Self {
        Self { when: When { chance: Some(chance), ..When::default() }, fault, times: u32::MAX }
    }

    /// The same, at most so often.
    #[must_use]
    pub fn times(mut self, times: u32) -> Self {
        self.times = times;
        self
    }
}

/// Everything that goes wrong. The default is: nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Faults {
    /// The rules; the first that fits a step decides.
    pub rules: Vec<FaultRule>,
    /// Observations find nobody: they time out.
    pub blind: bool,
    /// The seed of what is left to chance.
    pub seed: u64,
}

impl Faults {
    /// These rules, with seed 0.
    pub fn new(rules: impl IntoIterator<Item = FaultRule>) -> Self {
        Self { rules: rules.into_iter().collect(), ..Self::default() }
    }
}

/// How long steps take. The default is: no time.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Delays {
    /// Every step.
    pub base: Duration,
    /// Up to so much more, decided by the seed.
    pub jitter: Duration,
    /// These steps instead (without jitter); the first that fits decides. An operation that is given up
    /// meanwhile comes to rest at once. A step slower than its deadline has hung until then.
    pub of: Vec<(StepPattern, Duration)>,
}

impl Delays {
    /// Whether no step takes time.
    pub fn is_none(&self) -> bool {
        self.base.is_zero() && self.jitter.is_zero() && self.of.iter().all(|(_, d)| d.is_zero())
    }
}

/// What a simulated component raises by itself after a step was done: this stands for its behaviour, so that a
/// coordinator meets the events it waits for on this platform too.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reaction {
    /// After a step of this pattern.
    pub on: StepPattern,
    /// So much later.
    pub after: Duration,
    /// This event is raised.
    pub raise: EventName,
    /// In the name of this component.
    pub component: ComponentName,
}

/// A small generator of chance (splitmix64): the same seed gives the same run on every machine.
#[derive(Debug, Clone)]
pub(super) struct Chance(pub u64);

impl Chance {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    #[allow(clippy::cast_precision_loss)]
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chance_is_the_same_every_time_and_spread() {
        let draw = |seed| {
            (0..1000)
                .map({
                    let mut c = Chance(seed);
                    move |_| c.unit()
                })
                .sum::<f64>()
                / 1000.0
        };
        assert!((draw(7) - draw(7)).abs() < f64::EPSILON);
        assert!((draw(7) - 0.5).abs() < 0.05);
    }
}
