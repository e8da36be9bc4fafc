//! A PID controller.

use super::arithmetic::within;
use crate::runtime::{Builder, Component, Context, In, OperationAnswer, Out, Prop};

/// A PID controller with limits, anti-windup and a filtered derivative.
///
/// With the error e = setpoint - measured and the time step h, in every update:
///
/// * proportional part: kp e
/// * derivative part, of the measurement so that a step of the setpoint gives no kick, through a first-order filter of time
///   constant tf: d ← d + h / (tf + h) · (−(measured − previous) / h − d); kd d
/// * integral part, backward Euler: i ← i + ki e h, but only as far as to bring the command to its limit, and not at all
///   when it is there without it (conditional integration)
/// * command = kp e + i + kd d + feedforward, within the limits
pub struct Pid {
    setpoint: In<f64>,
    measured: In<f64>,
    feedforward: In<f64>,
    command: Out<f64>,
    kp: Prop<f64>,
    ki: Prop<f64>,
    kd: Prop<f64>,
    tf: Prop<f64>,
    lower: Prop<f64>,
    upper: Prop<f64>,
    integral: f64,
    derivative: f64,
    previous: Option<f64>,
}

impl Component for Pid {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "A PID controller: command = kp e + ki * integral of e - kd * derivative of `measured`, with e = setpoint - \
             measured. The derivative is filtered, the command limited, and the integral stands still while the command is \
             at a limit and would be pushed further. At every start it begins with an integral of 0.",
        );
        b.doc("Sets the integral part to this value and forgets the derivative.").no_effect();
        b.operation("reset", |this: &mut Self, _, (integral,): (f64,)| {
            this.forget(integral);
            OperationAnswer::Done(())
        });
        Self {
            setpoint: b.doc("What is wanted.").input("setpoint"),
            measured: b.doc("What is.").input("measured"),
            feedforward: b.doc("Added to the command; never written, it counts as 0.").input("feedforward"),
            command: b.doc("The command; written once `setpoint` and `measured` have values.").output("command"),
            kp: b.doc("Gain of the error.").property("kp", 1.0),
            ki: b.doc("Gain of the error's integral, per second.").unit("1/s").property("ki", 0.0),
            kd: b.doc("Gain of the derivative, seconds.").unit("s").property("kd", 0.0),
            tf: b.doc("Time constant of the derivative's filter; 0: none.").unit("s").min(0.0).property("tf", 0.01),
            lower: b.doc("The smallest command.").property("lower", -1e12),
            upper: b.doc("The largest command.").property("upper", 1e12),
            integral: 0.0,
            derivative: 0.0,
            previous: None,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if cx.is_first() {
            self.forget(0.0);
        }
        let (Some(setpoint), Some(measured)) = (self.setpoint.get(), self.measured.get()) else { return };
        let (error, h) = (setpoint - measured, cx.dt());
        if let Some(previous) = self.previous
            && h > 0.0
        {
            let slope = -(measured - previous) / h;
            self.derivative += h / (self.tf.get() + h) * (slope - self.derivative);
        }
        self.previous = Some(measured);
        let (lower, upper) = (self.lower.get(), self.upper.get());
        let rest = self.kp.get() * error + self.kd.get() * self.derivative + self.feedforward.get().unwrap_or(0.0);
        let step = self.ki.get() * error * h;
        let raw = rest + self.integral + step;
        self.integral = if raw > upper && step > 0.0 {
            self.integral.max(upper - rest)
        } else if raw < lower && step < 0.0 {
            self.integral.min(lower - rest)
        } else {
            self.integral + step
        };
        self.command.write(within(rest + self.integral, lower, upper));
    }
}

impl Pid {
    fn forget(&mut self, integral: f64) {
        self.integral = integral;
        self.derivative = 0.0;
        self.previous = None;
    }
}
