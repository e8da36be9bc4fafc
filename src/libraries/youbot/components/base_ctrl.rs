//! `youbot.Base_Ctrl`: what the base is allowed to do.

use super::samples::{Odometry, Twist};
use super::{aged, going_on};
use crate::libraries::youbot::base::{BaseLimits, Twist2};
use crate::runtime::{Builder, Component, Context, In, OperationAnswer, Out, Prop};

/// A wanted twist older than this is none, in s.
const STALE: f64 = 0.1;

/// The component.
pub struct BaseCtrl {
    base_twist: In<Twist>,
    odometry: In<Odometry>,
    cmd_twist: Out<Twist>,
    v_max: Prop<f64>,
    w_max: Prop<f64>,
    a_max: Prop<f64>,
    deadband: Prop<f64>,
    enabled: Prop<bool>,
    last: Twist2,
}

impl Component for BaseCtrl {
    fn new(b: &mut Builder<Self>) -> Self {
        let l = BaseLimits::default();
        b.describe("Bounds speed and acceleration of the base; disabled, or without a fresh wish, it stands.")
            .start_after("youbot.Dynamics")
            .on_start(|c, _| {
                c.last = Twist2::default();
                Ok(())
            });
        b.doc("The base stands now, without a ramp; it moves again when it is asked to.").no_effect().operation(
            "stop",
            |c, _, (): ()| {
                c.last = Twist2::default();
                c.cmd_twist.write(Twist::default());
                OperationAnswer::Done(())
            },
        );
        Self {
            base_twist: b.doc("Wanted motion, in the base's frame.").required().input("base_twist"),
            odometry: b.doc("How the base moves.").required().input("odometry"),
            cmd_twist: b.doc("Commanded motion.").output("cmd_twist"),
            v_max: b.doc("Highest speed.").unit("m/s").range(0.0..=0.7).property("v_max", l.v_max),
            w_max: b.doc("Highest turning speed.").unit("rad/s").range(0.0..=0.7).property("w_max", l.w_max),
            a_max: b.doc("Highest acceleration.").unit("m/s^2").range(0.01..=5.0).property("a_max", l.a_max),
            deadband: b.doc("Wishes below it are none.").unit("m/s").range(0.0..=0.1).property("deadband", l.deadband),
            enabled: b.doc("Whether the base may move.").property("enabled", true),
            last: Twist2::default(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let limits = BaseLimits {
            v_max: self.v_max.get(),
            w_max: self.w_max.get(),
            a_max: self.a_max.get(),
            deadband: self.deadband.get(),
        };
        // It moves only while it is known how it moves.
        let known = aged(&mut self.odometry, cx).is_some_and(|(_, age)| age <= STALE);
        let may = known && self.enabled.get();
        let wish = aged(&mut self.base_twist, cx).filter(|(_, age)| may && *age <= STALE);
        self.last = limits.limit(wish.map(|(t, _)| t.into()).unwrap_or_default(), self.last, going_on(cx));
        self.cmd_twist.write(self.last.into());
    }
}
