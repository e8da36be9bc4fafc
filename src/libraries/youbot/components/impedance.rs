//! `youbot.Cart_Impedance`: the coupling's spring and damper.

use super::going_on;
use super::samples::{ExtRef, ToolPose, ToolTwist, stamp};
use crate::libraries::youbot::impedance::{CouplingLaw, DELAY_DAMPING, Impedance, ImpedanceParameters, Reference};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, Failure, In, OperationAnswer, Out, Prop};
use nalgebra::Vector3;

/// The component.
pub struct CartImpedance {
    tool_pose: In<ToolPose>,
    tool_twist: In<ToolTwist>,
    ext_ref: In<ExtRef>,
    ext_ref_mode: In<bool>,
    f_des: Out<Vector3<f64>>,
    f_raw_norm: Out<f64>,
    f_jump: Out<f64>,
    ref_age: Out<f64>,
    active: Out<bool>,
    engaged: Out<f64>,
    damping: Out<f64>,
    energy_sent: Out<f64>,
    law: Prop<String>,
    stiffness: Prop<f64>,
    damping_rel: Prop<f64>,
    damping_abs: Prop<f64>,
    delay_damping: Prop<f64>,
    f_max: Prop<f64>,
    f_rate: Prop<f64>,
    ref_max_age: Prop<f64>,
    offset: Prop<Vector3<f64>>,
    coupling: Impedance,
    recent: Recent,
}

/// The newest values of a norm, with their times in s.
#[derive(Default)]
struct Recent {
    values: [(f64, f64); 16],
    next: usize,
}

impl Recent {
    /// Over how long a rise is a jump, in s: ten updates of the control loop. Slower loops see the last ones.
    const WINDOW: f64 = 0.01;

    /// How much the newest value is above the smallest of the window before it.
    fn rise(&mut self, now: f64, value: f64) -> f64 {
        let within = self.values.iter().filter(|(at, _)| *at > 0.0 && now - at <= Self::WINDOW + 1e-9);
        let least = within.fold(value, |least, (_, v)| least.min(*v));
        self.values[self.next % 16] = (now, value);
        self.next += 1;
        value - least
    }
}

impl Component for CartImpedance {
    fn new(b: &mut Builder<Self>) -> Self {
        let p = ImpedanceParameters::default();
        b.describe(
            "The force that pulls this tool to the other robot's: spring, damper, bounded, ramped. It is always computed \
             and put out only while ext_ref_mode is true here and at the other robot, taking hold and letting go along ramps; it \
             fades by itself when the reference grows stale.",
        )
        .start_after("youbot.Arm_Kinematics")
        .on_configure(|c, _| match CouplingLaw::named(c.law.get_ref()) {
            Some(_) => Ok(()),
            None => Err(Failure(format!("no law `{}`: position or tank", c.law.get_ref()))),
        })
        .on_start(|c, _| {
            c.coupling.reset();
            c.recent = Recent::default();
            Ok(())
        });
        b.doc("The force begins from zero again.").no_effect().operation("reset", |c, _, (): ()| {
            c.coupling.reset();
            OperationAnswer::Done(())
        });
        Self {
            tool_pose: b.doc("Where this tool is.").required().input("tool_pose"),
            tool_twist: b.doc("How it moves.").required().input("tool_twist"),
            ext_ref: b.doc("Where the other tool was.").required().input("ext_ref"),
            ext_ref_mode: b.doc("Whether the force is put out. Never written: no.").input("ext_ref_mode"),
            f_des: b
                .doc("Force wanted on the tool, in the world; zero 0.1 s after ext_ref_mode became false, here or at the other robot.")
                .unit("N")
                .output("f_des"),
            f_raw_norm: b.doc("Norm of the force it would want, coupled or not.").unit("N").output("f_raw_norm"),
            f_jump: b.doc("How much that norm has risen within 10 ms.").unit("N").output("f_jump"),
            ref_age: b.doc("Age of the reference; not written before the first one.").unit("s").output("ref_age"),
            active: b.doc("Whether the force is to be put out: ext_ref_mode.").output("active"),
            engaged: b.doc("How much of the coupling is in force: from 0, let go of, to 1.").output("engaged"),
            damping: b.doc("Damper on the own velocity as it is now.").unit("N s/m").output("damping"),
            energy_sent: b
                .doc("Energy given to the other robot's coupling so far, for Link_Tx (law `tank`).")
                .unit("J")
                .output("energy_sent"),
            law: b
                .doc(
                    "`position`: spring and damper as they are; with delay they need damping_abs. `tank`: passive whatever the delay, \
                     by a tank of energy at each end; of use where both robots have it.",
                )
                .tunable(Tunable::Unconfigured)
                .property("law", "position".to_owned()),
            stiffness: b.doc("Spring.").unit("N/m").range(0.0..=1000.0).property("stiffness", p.stiffness),
            damping_rel: b
                .doc("Damper on the difference of velocities.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_rel", p.damping_rel),
            damping_abs: b
                .doc("Damper on the own velocity, at least.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_abs", p.damping_abs),
            delay_damping: b
                .doc(
                    "Where the reference is late, that damper is this times stiffness times its mean age over 0.2 s, if that is more: from \
                     1.2 on the coupling stays stable. 0: never. Law `tank` does without.",
                )
                .range(0.0..=5.0)
                .property("delay_damping", DELAY_DAMPING),
            f_max: b.doc("Largest force.").unit("N").range(0.0..=30.0).property("f_max", p.f_max),
            f_rate: b.doc("Fastest change of it.").unit("N/s").range(0.1..=1000.0).property("f_rate", p.f_rate),
            ref_max_age: b
                .doc("Age from which the reference is not believed.")
                .unit("s")
                .range(0.001..=1.0)
                .property("ref_max_age", p.ref_max_age),
            offset: b
                .doc("This robot's world minus the other's.")
                .unit("m")
                .range(-100.0..=100.0)
                .property("offset", p.offset),
            coupling: Impedance::default(),
            recent: Recent::default(),
        }
    }

    #[allow(clippy::cast_precision_loss)]
    fn update(&mut self, cx: &mut Context) {
        let (Some(pose), Some(twist)) = (self.tool_pose.get(), self.tool_twist.get()) else { return };
        self.coupling.parameters = ImpedanceParameters {
            law: CouplingLaw::named(self.law.get_ref()).unwrap_or_default(),
            stiffness: self.stiffness.get(),
            damping_rel: self.damping_rel.get(),
            damping_abs: self.damping_abs.get(),
            delay_damping: self.delay_damping.get(),
            f_max: self.f_max.get(),
            f_rate: self.f_rate.get(),
            ref_max_age: self.ref_max_age.get(),
            offset: self.offset.get(),
        };
        let reference = self.ext_ref.get().map(|r| Reference {
            position: r.p.into(),
            velocity: r.v.into(),
            age: (stamp(cx.now()) - r.stamp) as f64 * 1e-9,
            coupled: r.coupled,
            energy: r.energy,
        });
        let coupled = self.ext_ref_mode.get().unwrap_or(false);
        let out = self.coupling.update(&pose.p.into(), &twist.v.into(), reference.as_ref(), coupled, going_on(cx));
        self.f_des.write(out.force);
        self.engaged.write(out.engaged);
        self.damping.write(self.coupling.damping());
        self.energy_sent.write(self.coupling.energy_sent());
        if let Some(reference) = reference {
            self.f_raw_norm.write(out.raw_norm);
            self.f_jump.write(self.recent.rise(cx.now().as_secs_f64(), out.raw_norm));
            self.ref_age.write(reference.age);
        }
        self.active.write(coupled);
    }
}
