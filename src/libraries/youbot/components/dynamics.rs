//! `youbot.Dynamics`: from the wanted force to torques and a motion of the base.

use super::samples::{IdentifiedArm, JointState, Odometry, Twist, seconds_since};
use super::{aged, going_on};
use crate::libraries::youbot::dynamics::{Coupled, Dynamics, DynamicsParameters, Jacobian8};
use crate::libraries::youbot::identification::ArmScales;
use crate::libraries::youbot::link::PeerState;
use crate::libraries::youbot::parameters::GRIPPER;
use crate::libraries::youbot::rigid_body::{ArmModel, J5};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, In, OperationAnswer, Out, Prop};
use nalgebra::Vector3;

/// A wanted force older than this is none, in s: the controller that sent it has stopped.
const STALE: f64 = 0.02;

/// The component.
pub struct DynamicsComponent {
    f_des: In<Vector3<f64>>,
    engaged: In<f64>,
    peer_state: In<PeerState>,
    jointstate: In<JointState>,
    jacobian: In<[f64; 24]>,
    odometry: In<Odometry>,
    identified: In<IdentifiedArm>,
    effort: Out<J5>,
    base_twist: Out<Twist>,
    tau_sat: Out<u8>,
    yields: Out<bool>,
    force_gain: Prop<Vector3<f64>>,
    gravity_gain: Prop<f64>,
    payload: Prop<f64>,
    friction_comp: Prop<f64>,
    stiction_comp: Prop<f64>,
    posture_stiffness: Prop<f64>,
    posture_damping: Prop<f64>,
    recenter_gain: Prop<f64>,
    r_nominal: Prop<[f64; 2]>,
    soft_limit_k: Prop<f64>,
    tau_max: Prop<J5>,
    law: Dynamics,
    /// As it was identified.
    arm: ArmScales,
}

impl Component for DynamicsComponent {
    fn new(b: &mut Builder<Self>) -> Self {
        let p = DynamicsParameters::default();
        b.describe(
            "Torques that carry the arm and put the wanted force on the tool; a twist that lets the base give way to it \
             (force_gain). Not engaged, or with a stale force, it carries the arm and does nothing else.",
        )
        .start_after("youbot.Cart_Impedance")
        .on_configure(|c, _| {
            c.law.believe(c.arm, c.payload.get());
            Ok(())
        })
        .on_start(|c, _| {
            c.law.reset();
            Ok(())
        });
        b.doc("Torques that hold the arm at these angles, as it was found.")
            .no_effect()
            .operation("compute_gravity", |c, _, (q,): (J5,)| {
                OperationAnswer::Done(c.law.model.gravity(&c.law.model.posture(&q)))
            });
        Self {
            f_des: b.doc("Force wanted on the tool, in the world.").unit("N").input("f_des"),
            engaged: b
                .doc("How much of the coupling is in force, as Cart_Impedance gives it. Not connected: none.")
                .input("engaged"),
            peer_state: b
                .doc(
                    "Whether the other base yields too, as Link_Rx gives it: eight degrees of freedom are those of both robots. \
                     Not connected: it does.",
                )
                .input("peer_state"),
            jointstate: b.doc("What the joints measure.").required().input("jointstate"),
            jacobian: b.doc("As Arm_Kinematics gives it.").required().input("jacobian"),
            odometry: b.doc("How the base moves.").input("odometry"),
            identified: b
                .doc("How the arm differs from its model, as the driver has found it. Not connected, or nothing found: not at all.")
                .input("identified"),
            effort: b.doc("Torques.").unit("N m").output("joint_effort_command"),
            base_twist: b.doc("Wanted motion of the base, in its frame.").output("base_twist"),
            tau_sat: b.doc("Bit i: joint i+1 is at its torque limit.").output("tau_sat"),
            yields: b.doc("Whether the base is to yield: force_gain is not zero.").output("yields"),
            force_gain: b
                .doc("How the base gives way: (m/s)/N, (m/s)/N, (rad/s)/(N m). All zero: five degrees of freedom.")
                .range(0.0..=1.0)
                .property("force_gain", p.force_gain),
            gravity_gain: b
                .doc("Share of gravity compensated.")
                .range(0.0..=1.2)
                .property("gravity_gain", p.gravity_gain),
            payload: b
                .doc("Mass at the tool, the gripper included.")
                .unit("kg")
                .range(0.0..=1.0)
                .tunable(Tunable::Stopped)
                .property("payload", GRIPPER.mass),
            friction_comp: b
                .doc("Share of Coulomb friction compensated; more than 1 makes the arm run away.")
                .range(0.0..=1.0)
                .property("friction_comp", p.friction_comp),
            stiction_comp: b
                .doc(
                    "How much of friction_comp a joint at rest has along the wanted force: the hyperbolic tangent of this times the \
                     force's torque beside the joint's friction. 0: none, the follower sticks.",
                )
                .range(0.0..=5.0)
                .property("stiction_comp", p.stiction_comp),
            posture_stiffness: b
                .doc("Pull to the working posture where it does not move the tool.")
                .unit("N m/rad")
                .range(0.0..=100.0)
                .property("posture_stiffness", p.posture_stiffness),
            posture_damping: b
                .doc("Its damping.")
                .unit("N m s/rad")
                .range(0.0..=50.0)
                .property("posture_damping", p.posture_damping),
            recenter_gain: b
                .doc("How fast the base moves to have the tool in front of it.")
                .unit("1/s")
                .range(0.0..=20.0)
                .property("recenter_gain", p.recenter_gain),
            r_nominal: b
                .doc("Where the tool is wanted, in the arm's frame.")
                .unit("m")
                .range(-1.0..=1.0)
                .property("r_nominal", p.r_nominal),
            soft_limit_k: b
                .doc("Spring beyond 95 % of a joint's range.")
                .unit("N m/rad")
                .range(0.0..=500.0)
                .property("soft_limit_k", p.soft_limit_k),
            tau_max: b.doc("Largest torques asked for.").unit("N m").range(0.0..=20.0).property("tau_max", p.tau_max),
            law: Dynamics::new(ArmModel::youbot(GRIPPER.mass, 1.0)),
            arm: ArmScales::default(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(joints) = self.jointstate.get() else { return };
        self.law.parameters = DynamicsParameters {
            force_gain: self.force_gain.get(),
            gravity_gain: self.gravity_gain.get(),
            friction_comp: self.friction_comp.get(),
            stiction_comp: self.stiction_comp.get(),
            posture_stiffness: self.posture_stiffness.get(),
            posture_damping: self.posture_damping.get(),
            recenter_gain: self.recenter_gain.get(),
            r_nominal: self.r_nominal.get(),
            soft_limit_k: self.soft_limit_k.get(),
            posture: self.law.parameters.posture,
            tau_max: self.tau_max.get(),
        };
        let arm = self.identified.get().map(ArmScales::from).unwrap_or_default();
        if arm != self.arm {
            self.arm = arm;
            self.law.believe(arm, self.payload.get());
        }
        let jacobian = aged(&mut self.jacobian, cx).filter(|(_, age)| *age <= STALE);
        let fresh = |age: f64| age <= STALE && jacobian.is_some();
        let force = aged(&mut self.f_des, cx).filter(|(_, age)| fresh(*age));
        let engaged = aged(&mut self.engaged, cx).filter(|(_, age)| fresh(*age));
        let peer_yields = match self.peer_state.get() {
            Some(peer) => peer.yields,
            None => !self.peer_state.is_connected(),
        };
        let coupled = force.zip(engaged).map(|((force, _), (engaged, _))| Coupled { force, engaged, peer_yields });
        let jacobian = jacobian.map_or_else(Jacobian8::zeros, |(flat, _)| Jacobian8::from_column_slice(&flat));
        let (q, qd) = (J5::from(joints.pos), J5::from(joints.vel));
        // The base moves only while it is known how it moves.
        let moves =
            self.odometry.sample().filter(|o| seconds_since(cx.now(), o.at) <= STALE).map(|o| o.value.split().1);
        let out = self.law.update(&q, &qd, &jacobian, moves.unwrap_or_default(), coupled.as_ref(), going_on(cx));
        self.effort.write(out.torque);
        self.base_twist.write(if moves.is_some() { out.twist.into() } else { Twist::default() });
        self.tau_sat.write(out.saturated);
        self.yields.write(self.law.parameters.yields());
    }
}
