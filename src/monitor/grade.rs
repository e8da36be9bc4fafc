//! Truth and robustness, together.

/// What a condition is at an instant: whether it holds, and how far it is from the contrary.
///
/// Both are kept, because a robustness of zero leaves open which: `x < 5` and `x <= 5` at 5 have the same distance. Ordered
/// by robustness, then by truth, the smaller of two grades is the grade of *both*, and the larger that of *either*: a
/// positive robustness always holds, and a negative one never does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grade {
    /// How far from the contrary, in the unit of the signals compared: positive where it holds by that much, negative where
    /// it does not. Never NaN. Infinite for what has no distance, such as a run state.
    pub robustness: f64,
    /// Whether it holds.
    pub holds: bool,
}

impl Grade {
    /// Holds, whatever is changed.
    pub const TOP: Self = Self { robustness: f64::INFINITY, holds: true };
    /// Does not hold, whatever is changed.
    pub const BOTTOM: Self = Self { robustness: f64::NEG_INFINITY, holds: false };

    /// Of something that has no distance.
    pub fn of(holds: bool) -> Self {
        if holds { Self::TOP } else { Self::BOTTOM }
    }

    /// Of the contrary.
    #[must_use]
    pub fn contrary(self) -> Self {
        Self { robustness: -self.robustness, holds: !self.holds }
    }

    /// Whether it is the same to the bit.
    pub fn is_same(self, other: Self) -> bool {
        self.robustness.to_bits() == other.robustness.to_bits() && self.holds == other.holds
    }

    /// Whether `self` is less than `other`.
    pub fn less(self, other: Self) -> bool {
        self.robustness < other.robustness || (self.robustness == other.robustness && !self.holds && other.holds)
    }

    /// The smaller: both hold.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        if other.less(self) { other } else { self }
    }

    /// The larger: either holds.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        if self.less(other) { other } else { self }
    }
}
