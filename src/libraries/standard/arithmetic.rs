//! Signals out of signals, without memory.

use crate::runtime::{Builder, Component, Context, In, Out, Prop};

/// Multiplies by a factor.
pub struct Gain {
    u: In<f64>,
    y: Out<f64>,
    k: Prop<f64>,
}

impl Component for Gain {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Multiplies: y = k * u.");
        Self {
            u: b.doc("What is multiplied.").input("u"),
            y: b.doc("k * u; written in every update once `u` has a value.").output("y"),
            k: b.doc("The factor.").property("k", 1.0),
        }
    }

    fn update(&mut self, _: &mut Context) {
        if let Some(u) = self.u.get() {
            let k = self.k.get();
            self.y.write(k * u);
        }
    }
}

/// The inputs of a sum.
const INPUTS: usize = 4;

/// Adds up to four weighted signals.
pub struct Sum {
    inputs: [In<f64>; INPUTS],
    y: Out<f64>,
    gains: Prop<[f64; INPUTS]>,
}

impl Component for Sum {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Adds weighted signals: y = gains[0] * u1 + ... + gains[3] * u4. A difference has a gain of -1.");
        Self {
            inputs: ["u1", "u2", "u3", "u4"].map(|u| b.doc("A term; never written, it counts as 0.").input(u)),
            y: b.doc("The sum; written in every update once any input has a value.").output("y"),
            gains: b.doc("The weights of the inputs, in their order.").property("gains", [1.0; INPUTS]),
        }
    }

    fn update(&mut self, _: &mut Context) {
        let gains = self.gains.get();
        let mut sum = None;
        for (input, gain) in self.inputs.iter_mut().zip(gains) {
            if let Some(u) = input.get() {
                *sum.get_or_insert(0.0) += gain * u;
            }
        }
        if let Some(sum) = sum {
            self.y.write(sum);
        }
    }
}

/// Keeps a signal within limits.
pub struct Saturation {
    u: In<f64>,
    y: Out<f64>,
    saturated: Out<bool>,
    lower: Prop<f64>,
    upper: Prop<f64>,
}

impl Component for Saturation {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Keeps a signal within limits: y = u, but at least `lower` and at most `upper`.");
        Self {
            u: b.doc("What is limited.").input("u"),
            y: b.doc("u within the limits.").output("y"),
            saturated: b.doc("Whether `y` differs from `u`.").output("saturated"),
            lower: b.doc("The lower limit. Where it is above the upper one, it wins.").property("lower", -1.0),
            upper: b.doc("The upper limit.").property("upper", 1.0),
        }
    }

    fn update(&mut self, _: &mut Context) {
        if let Some(u) = self.u.get() {
            let y = within(u, self.lower.get(), self.upper.get());
            self.y.write(y);
            self.saturated.write(y != u);
        }
    }
}

/// `value`, at most `upper`, then at least `lower`: defined for limits in the wrong order too, where `clamp` panics.
pub(super) fn within(value: f64, lower: f64, upper: f64) -> f64 {
    value.min(upper).max(lower)
}
