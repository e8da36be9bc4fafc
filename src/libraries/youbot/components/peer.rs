//! `youbot.Peer`: a stand-in for the other robot and for the network between the two.

use super::net::{NetworkProperties, seen_by};
use super::samples::{ToolPose, stamp};
use crate::libraries::youbot::hand::{Hand, HandScript};
use crate::libraries::youbot::impedance::{CouplingLaw, DELAY_DAMPING, Reference};
use crate::libraries::youbot::link::{LinkReceiver, Packet};
use crate::libraries::youbot::network::{Network, Quality};
use crate::libraries::youbot::rigid_body::{J5, radians};
use crate::libraries::youbot::robot::{CONTROL_PERIOD, Robot};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, Failure, In, OperationAnswer, Out, Prop};
use nalgebra::Vector3;

/// Between two packets of the other robot, in s.
const SEND_PERIOD: f64 = 0.004;
/// Where the other arm begins, in degrees: near the working pose, about 10 cm beside it.
const START_DEG: [f64; 5] = [18.0, -22.0, 92.0, 60.0, 0.0];
/// Below it the other robot counts as aligned, in N, and for how long, in s.
const ALIGNED_FORCE: f64 = 2.0;
const ALIGNED_TIME: f64 = 0.3;

/// The component.
pub struct Peer {
    rx: In<Packet>,
    tx: Out<Packet>,
    tool_pose: Out<ToolPose>,
    q_start: Prop<J5>,
    script: Prop<String>,
    stiffness: Prop<f64>,
    damping_rel: Prop<f64>,
    damping_abs: Prop<f64>,
    law: Prop<String>,
    force_gain: Prop<Vector3<f64>>,
    network: NetworkProperties,
    jump: Prop<Vector3<f64>>,
    world: Box<PeerWorld>,
    epoch: i64,
}

/// A condition that must hold for a time.
#[derive(Debug, Clone, Copy, Default)]
struct HeldPeer(f64);

impl HeldPeer {
    /// Whether `condition` has held for `time` seconds, `dt` after the last call.
    fn update(&mut self, condition: bool, time: f64, dt: f64) -> bool {
        self.0 = if condition { self.0 + dt } else { 0.0 };
        condition && self.0 >= time - 1e-9
    }
}

struct PeerWorld {
    robot: Robot,
    hand: Hand,
    to_peer: Network<Packet>,
    from_peer: Network<Packet>,
    receiver: LinkReceiver,
    aligned: HeldPeer,
    since: f64,
    seq: i64,
}

impl PeerWorld {
    fn new(q: J5, script: HandScript, seed: u64) -> Self {
        Self {
            robot: Robot::new(q),
            hand: Hand::new(script),
            to_peer: Network::new(Quality::default(), seed),
            from_peer: Network::new(Quality::default(), seed ^ 0x5555_5555),
            receiver: LinkReceiver::default(),
            aligned: HeldPeer::default(),
            since: f64::INFINITY,
            seq: 0,
        }
    }

    /// One control period of the other robot, ending at `now` (s): whether it is aligned, and whether it wants to be coupled.
    fn step(&mut self, now: f64, ahead: i64) -> (bool, bool) {
        while let Some(packet) = self.to_peer.receive(now) {
            // The other robot's clock is ahead of this one's by so much, and it thinks in its own.
            self.receiver.take(seen_by(packet, ahead), now);
        }
        let heard = self.receiver.newest().copied().unwrap_or_default();
        let reference = self.receiver.sent().map(|sent| Reference {
            position: heard.p.into(),
            velocity: heard.v.into(),
            age: now - sent,
            coupled: heard.copying,
            energy: heard.energy,
        });
        let fresh = reference.is_some_and(|r| r.age < 0.1);
        // It follows: it wants to be coupled while it hears that we do.
        let copying = fresh && heard.copying;
        let tool = self.robot.tool;
        let push =
            self.hand.update(&tool.position, &tool.velocity, reference.as_ref().map(|r| &r.position), CONTROL_PERIOD);
        self.robot.step(reference.as_ref(), copying, heard.yields, &push);
        let low = fresh && self.robot.raw_norm < ALIGNED_FORCE;
        (self.aligned.update(low, ALIGNED_TIME, CONTROL_PERIOD), copying)
    }
}

impl Component for Peer {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "The other robot, simulated whole (plant, coupling, dynamics, hand), behind a network that delays, jitters, \
             loses and can be cut, both ways alike. It couples while it hears that this robot wants to be coupled.",
        )
        .on_configure(|c, _| {
            let script = c.read_script()?;
            *c.world = PeerWorld::new(c.q_start.get(), script, c.network.seed());
            c.law()
        });
        b.doc("The other robot begins anew: another epoch.").no_effect().operation("restart", |c, _, (): ()| {
            c.epoch += 1;
            c.world.seq = 0;
            c.world.from_peer.clear();
            OperationAnswer::Done(())
        });
        let law = crate::libraries::youbot::impedance::ImpedanceParameters::default();
        Self {
            rx: b.doc("Packets from this robot.").buffered().input("rx"),
            tx: b.doc("Packets from the other robot, for a buffered connection.").output("tx"),
            tool_pose: b.doc("Where the other tool really is now.").output("tool_pose"),
            q_start: b
                .doc("Where the other arm is when the simulation begins.")
                .unit("rad")
                .range(-3.0..=3.0)
                .tunable(Tunable::Unconfigured)
                .property("q_start", radians(START_DEG)),
            script: b.doc("What a hand does to the other arm.").property("script", String::new()),
            stiffness: b.doc("Of its coupling.").unit("N/m").range(0.0..=1000.0).property("stiffness", law.stiffness),
            damping_rel: b
                .doc("Of its coupling.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_rel", law.damping_rel),
            damping_abs: b
                .doc("Of its coupling.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_abs", law.damping_abs),
            force_gain: b
                .doc("How its base gives way, as of Dynamics.")
                .range(0.0..=1.0)
                .property("force_gain", Vector3::zeros()),
            law: b
                .doc("Of its coupling, as of Cart_Impedance.")
                .tunable(Tunable::Unconfigured)
                .property("law", "position".to_owned()),
            network: NetworkProperties::declare(b, |c| &mut c.network),
            jump: b
                .doc("Added to the positions the other robot sends: a corrupt sensor.")
                .unit("m")
                .range(-10.0..=10.0)
                .property("jump", Vector3::zeros()),
            world: Box::new(PeerWorld::new(radians(START_DEG), HandScript::default(), 1)),
            epoch: 1,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if self.script.changed() {
            match self.read_script() {
                Ok(script) => self.world.hand.follow(script),
                Err(Failure(why)) => return cx.fault(why),
            }
        }
        let now = cx.now().as_secs_f64();
        let (quality, ahead) = (self.network.quality(cx.now()), self.network.clock_difference(now));
        let w = &mut *self.world;
        w.to_peer.quality = quality;
        w.from_peer.quality = quality;
        let p = &mut w.robot.impedance.parameters;
        p.stiffness = self.stiffness.get();
        p.damping_rel = self.damping_rel.get();
        p.damping_abs = self.damping_abs.get();
        p.delay_damping = DELAY_DAMPING;
        w.robot.dynamics.parameters.force_gain = self.force_gain.get();
        while let Some(packet) = self.rx.take() {
            w.to_peer.send(now, self.network.faults.sent_for(cx.now(), packet));
        }
        let mut state = (false, false);
        let steps = (cx.dt() / CONTROL_PERIOD).round().max(1.0) as u32;
        for i in 0..steps {
            state = w.step(now - f64::from(steps - 1 - i) * CONTROL_PERIOD, -ahead);
        }
        let tool = &w.robot.tool;
        w.since += cx.dt();
        if w.since >= SEND_PERIOD - 0.5 * cx.dt() {
            w.since = 0.0;
            w.seq += 1;
            let packet = Packet {
                epoch: self.epoch,
                seq: w.seq,
                stamp: stamp(cx.now()),
                echo: w.receiver.echo(),
                p: (tool.position + self.jump.get()).into(),
                v: tool.velocity.into(),
                aligned: state.0,
                copying: state.1,
                yields: w.robot.dynamics.parameters.yields(),
                energy: w.robot.impedance.energy_sent(),
            };
            w.from_peer.send(now, self.network.faults.sent_for(cx.now(), packet));
        }
        while let Some(packet) = w.from_peer.receive(now) {
            self.tx.write(seen_by(packet, ahead));
        }
        self.tool_pose.write(ToolPose { p: tool.position.into(), q: tool.orientation().coords.into() });
    }
}

impl Peer {
    fn law(&mut self) -> Result<(), Failure> {
        let name = self.law.get_ref();
        let law = CouplingLaw::named(name).ok_or_else(|| Failure(format!("no law `{name}`: position or tank")))?;
        self.world.robot.impedance.parameters.law = law;
        Ok(())
    }

    fn read_script(&mut self) -> Result<HandScript, Failure> {
        self.script.get_ref().parse::<HandScript>().map_err(|e| Failure::from_error(&e))
    }
}
