//! `scara.Follower`: the force on the tool; and `scara.Torques`: what makes it of arm and rail.

use super::aged;
use super::coupling::{Coupling, Law};
use super::drives::BELIEVED_PAYLOAD;
use super::model::{AXES, Arm, COULOMB, RAIL, V4, V5, WORKING, jacobian, tool};
use super::samples::{Axes, Told, Tool};
use davit::component::{Builder, Component, Context, In, OperationAnswer, Out, Prop};

/// A reference older than this is not believed, in s.
const STALE: f64 = 0.06;
/// Over so many updates a rise of the force is a jump: 10 ms.
const JUMP: usize = 10;

/// The component.
pub struct Follower {
    axes: In<Axes>,
    told: In<Told>,
    follow: In<bool>,
    near: In<bool>,
    tool: Out<Tool>,
    wrench: Out<[f64; 4]>,
    engaged: Out<f64>,
    wanted: Out<f64>,
    jump: Out<f64>,
    age: Out<f64>,
    active: Out<bool>,
    tells: Out<Told>,
    stiffness: Prop<f64>,
    damping_rel: Prop<f64>,
    damping_abs: Prop<f64>,
    most: Prop<f64>,
    coupling: Coupling,
    recent: [f64; JUMP],
    next: usize,
}

impl Component for Follower {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "The force that pulls this tool to the other one: spring and damper, bounded. Always computed, and put out while both ends want \
             to be coupled, with a ramp; it lets go by itself of what was not heard for 60 ms.",
        )
        .on_start(|c, _| {
            (c.coupling, c.recent, c.next) = (Coupling::default(), [f64::INFINITY; JUMP], 0);
            Ok(())
        });
        Self {
            axes: b.doc("Where the axes are.").required().input("axes"),
            told: b.doc("What the other end tells.").required().input("told"),
            follow: b.doc("Whether to be coupled. Never written: no.").input("follow"),
            near: b.doc("Whether this end counts as near the other one; it is passed on.").input("near"),
            tool: b.doc("Where the tool is, by the axes.").output("tool"),
            wrench: b.doc("Forces wanted on the tool (N), and the torque about z (N m).").output("wrench"),
            engaged: b.doc("How much of the coupling is in force, 0 to 1.").output("engaged"),
            wanted: b.doc("The force that it would want, coupled or not.").unit("N").output("wanted"),
            jump: b.doc("How much that has risen within 10 ms.").unit("N").output("jump"),
            age: b.doc("How old what was told is; not written before the first.").unit("s").output("age"),
            active: b.doc("Whether it is to be coupled.").output("active"),
            tells: b.doc("What is told the other end.").output("tells"),
            stiffness: b.doc("Spring.").unit("N/m").range(0.0..=1000.0).property("stiffness", 300.0),
            damping_rel: b
                .doc("Damper on the difference of the speeds.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_rel", 12.0),
            damping_abs: b
                .doc("Damper on the own speed: at least 1.2 times stiffness times delay.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_abs", 5.0),
            most: b.doc("Largest force.").unit("N").range(0.0..=40.0).property("most", 15.0),
            coupling: Coupling::default(),
            recent: [f64::INFINITY; JUMP],
            next: 0,
        }
    }

    #[allow(clippy::cast_precision_loss)]
    fn update(&mut self, cx: &mut Context) {
        let Some(axes) = self.axes.get() else { return };
        let q = V5::from(axes.pos);
        let (p, v) = (tool(&q), jacobian(&q) * V5::from(axes.vel));
        let now = i64::try_from(cx.now().0).unwrap_or(i64::MAX);
        let told = self.told.get().map(|told| (told, (now - told.stamp) as f64 * 1e-9));
        let active = self.follow.get().unwrap_or(false);
        let coupled = active && told.as_ref().is_some_and(|(told, age)| told.coupled && *age < STALE);
        let there = told.as_ref().map(|(told, _)| (V4::from(told.p), V4::from(told.v)));
        let law = Law {
            stiffness: self.stiffness.get(),
            damping_rel: self.damping_rel.get(),
            damping_abs: self.damping_abs.get(),
            most: self.most.get(),
        };
        let there = there.as_ref().map(|(p, v)| (p, v));
        let pull = self.coupling.update(&law, (&p, &v), there, coupled, cx.dt());
        self.tool.write(Tool { p: p.into(), v: v.into() });
        self.wrench.write(pull.wrench.into());
        self.engaged.write(self.coupling.engaged);
        if let Some((_, age)) = told {
            let least = self.recent.iter().fold(pull.wanted, |least, value| least.min(*value));
            self.recent[self.next % JUMP] = pull.wanted;
            self.next = (self.next + 1) % JUMP;
            self.wanted.write(pull.wanted);
            self.jump.write(pull.wanted - least);
            self.age.write(age);
        }
        self.active.write(active);
        let aligned = self.near.get().unwrap_or(false);
        self.tells.write(Told { p: p.into(), v: v.into(), stamp: now, aligned, coupled: active });
    }
}

/// A wrench that was not heard for so long is none, in s.
const UNHEARD: f64 = 0.02;
/// Speed from which friction counts as that of motion, in rad/s and m/s.
const STILL: f64 = 0.02;
/// A force of the wrench counts as motion the way it pulls: N s/m for each N of friction, so that an axis does not stick.
const SETS_OUT: f64 = 30.0;
/// Most that the carriage is sent with, in m/s, and gains, in m/s².
const RAIL_SPEED: f64 = 0.4;
const RAIL_GAIN: f64 = 1.0;

/// The component.
pub struct Torques {
    axes: In<Axes>,
    wrench: In<[f64; 4]>,
    engaged: In<f64>,
    effort: Out<[f64; AXES]>,
    rail: Out<f64>,
    rail_gain: Prop<f64>,
    recenter: Prop<f64>,
    friction_comp: Prop<f64>,
    enabled: Prop<bool>,
    arm: Arm,
    /// What the carriage is sent with.
    speed: f64,
}

impl Component for Torques {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Forces and torques of the arm for a wrench on its tool, with its weight, its Coriolis forces and, while it is coupled, most of its \
             friction taken off; and the speed of a carriage that gives way. Without a wrench the arm floats and comes to rest.",
        )
        .start_after("scara.Follower")
        .on_start(|c, _| {
            c.speed = 0.0;
            Ok(())
        });
        b.doc("The carriage stands, without a ramp here; it moves again when it is pulled.").no_effect().operation(
            "stand",
            |c, _, (): ()| {
                c.speed = 0.0;
                c.rail.write(0.0);
                OperationAnswer::Done(())
            },
        );
        Self {
            axes: b.doc("Where the axes are.").required().input("axes"),
            wrench: b.doc("Wanted on the tool; silent for 20 ms: none.").input("wrench"),
            engaged: b.doc("How much of a coupling is in force.").input("engaged"),
            effort: b.doc("For the arm (rail: 0).").output("effort"),
            rail: b.doc("Where the carriage is to go.").unit("m/s").output("rail"),
            rail_gain: b
                .doc("How the carriage gives way to the force along it, (m/s)/N; 0: it stands.")
                .range(0.0..=0.2)
                .property("rail_gain", 0.0),
            recenter: b
                .doc("How fast a carriage that gives way goes to where the tool is before it.")
                .unit("1/s")
                .range(0.0..=10.0)
                .property("recenter", 4.0),
            friction_comp: b
                .doc("Share of Coulomb's friction taken off while it is coupled.")
                .range(0.0..=1.0)
                .property("friction_comp", 0.9),
            enabled: b.doc("Whether the carriage may move at all.").property("enabled", true),
            arm: Arm { payload: BELIEVED_PAYLOAD },
            speed: 0.0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(axes) = self.axes.get() else { return };
        let (q, v) = (V5::from(axes.pos), V5::from(axes.vel));
        let heard = aged(&mut self.wrench, cx).filter(|(_, age)| *age <= UNHEARD);
        let wrench = heard.map_or_else(V4::zeros, |(wrench, _)| V4::from(wrench));
        let engaged = if heard.is_some() { self.engaged.get().unwrap_or(0.0) } else { 0.0 };

        let gain = if self.enabled.get() { self.rail_gain.get() } else { 0.0 };
        let wish = if gain > 0.0 {
            let nominal = V5::from(WORKING);
            let off = (tool(&q)[0] - q[RAIL]) - (tool(&nominal)[0] - nominal[RAIL]);
            (gain * wrench[0] + self.recenter.get() * off * engaged).clamp(-RAIL_SPEED, RAIL_SPEED)
        } else {
            0.0
        };

        let pulled = jacobian(&q).tr_mul(&wrench);
        let mut effort = pulled + self.arm.bias(&q, &v);
        // Let go of, an arm comes to rest by its own friction: help against it would let it coast.
        let share = self.friction_comp.get() * engaged;
        for i in 0..AXES {
            let way = v[i] + pulled[i] / (SETS_OUT * COULOMB[i]);
            effort[i] += share * COULOMB[i] * (way / STILL).tanh();
        }
        effort[RAIL] = 0.0;
        self.effort.write(effort.into());
        let most = RAIL_GAIN * cx.dt();
        self.speed += (wish - self.speed).clamp(-most, most);
        self.rail.write(self.speed);
    }
}
