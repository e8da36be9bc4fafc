//! Signals out of nothing but time.

use crate::runtime::{Builder, Component, Context, Out, Prop};

/// Writes the same value in every update.
pub struct Constant {
    y: Out<f64>,
    value: Prop<f64>,
}

impl Component for Constant {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Writes the same value in every update.");
        Self { y: b.doc("`value`.").output("y"), value: b.doc("What is written.").property("value", 0.0) }
    }

    fn update(&mut self, _: &mut Context) {
        let value = self.value.get();
        self.y.write(value);
    }
}

/// A straight line over the time since the start.
pub struct Ramp {
    y: Out<f64>,
    offset: Prop<f64>,
    slope: Prop<f64>,
    time: f64,
}

impl Component for Ramp {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("A straight line over time: y = offset + slope * t, with t in seconds since the start.");
        Self {
            y: b.doc("offset + slope * t.").output("y"),
            offset: b.doc("The value at the start.").property("offset", 0.0),
            slope: b
                .doc("How much it grows in a second. It takes effect for all of t, not from now on.")
                .property("slope", 1.0),
            time: 0.0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        self.time = if cx.is_first() { 0.0 } else { self.time + cx.dt() };
        let value = self.offset.get() + self.slope.get() * self.time;
        self.y.write(value);
    }
}

/// A sine over the time since the start.
pub struct Sine {
    y: Out<f64>,
    amplitude: Prop<f64>,
    frequency: Prop<f64>,
    phase: Prop<f64>,
    offset: Prop<f64>,
    turns: f64,
}

impl Component for Sine {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "A sine over time: y = offset + amplitude * sin(2 pi frequency t + phase), with t in seconds since the \
             start. A frequency that changes while it runs bends the curve and does not break it.",
        );
        Self {
            y: b.doc("The sine.").output("y"),
            amplitude: b.doc("Half the way from its lowest to its highest value.").property("amplitude", 1.0),
            frequency: b.doc("Turns in a second.").unit("Hz").min(0.0).property("frequency", 1.0),
            phase: b.doc("Where in its turn it starts.").unit("rad").property("phase", 0.0),
            offset: b.doc("The value in the middle.").property("offset", 0.0),
            turns: 0.0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let step = self.frequency.get() * cx.dt();
        // Kept small, so that it is as exact after a year as in the first second.
        self.turns = if cx.is_first() { 0.0 } else { (self.turns + step).fract() };
        let angle = std::f64::consts::TAU * self.turns + self.phase.get();
        let value = self.offset.get() + self.amplitude.get() * angle.sin();
        self.y.write(value);
    }
}
