//! `scara.Leader`: what the arm follows: a handle in somebody's hand, at the other end of a network.

use super::coupling::{Coupling, Law};
use super::model::V4;
use super::samples::{Told, Tool};
use davit::component::{Builder, Component, Context, In, Out, Prop};
use davit::platforms::Tunable;
use std::f64::consts::TAU;

/// Of the handle, in kg, and of its guide, in N s/m.
const MASS: f64 = 1.0;
const GUIDE: f64 = 2.0;
/// The hand: spring and damper, and its strength, in N/m, N s/m and N.
const HAND: (f64, f64, f64) = (300.0, 30.0, 30.0);
/// How fast the hand goes where it wants to be, in m/s, and how soon, in s.
const HAND_SPEED: f64 = 0.12;
const HAND_LAG: f64 = 0.3;
/// Between two packets, in s, and how many are under way at most each way.
const PACKETS: f64 = 0.004;
const UNDER_WAY: usize = 128;
/// What was not heard for so long is not there, in s.
const STALE: f64 = 0.1;
/// Aligned: the force would be so small, in N, for so long, in s.
const ALIGNED: (f64, f64) = (2.0, 0.3);
/// A path grows to its size within so many seconds.
const SETS_OUT: f64 = 2.0;

/// One direction of the network.
struct Way {
    packets: [(f64, Told); UNDER_WAY],
    first: usize,
    count: usize,
    random: u64,
    last: f64,
}

/// What it does to packets.
#[derive(Clone, Copy)]
struct Quality {
    delay: f64,
    jitter: f64,
    loss: f64,
    cut: bool,
}

impl Way {
    fn new(seed: u64) -> Self {
        // Any seed will do but 0.
        let random = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        Self { packets: [(0.0, Told::default()); UNDER_WAY], first: 0, count: 0, random, last: 0.0 }
    }

    /// Evenly from 0 to 1 (xorshift).
    #[allow(clippy::cast_precision_loss)]
    fn draw(&mut self) -> f64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A packet sets out; the order is kept.
    fn send(&mut self, now: f64, quality: Quality, packet: Told) {
        let (late, lost) = (self.draw() * quality.jitter, self.draw() < quality.loss);
        if lost || quality.cut || self.count == UNDER_WAY {
            return;
        }
        self.last = self.last.max(now + quality.delay + late);
        self.packets[(self.first + self.count) % UNDER_WAY] = (self.last, packet);
        self.count += 1;
    }

    fn receive(&mut self, now: f64, quality: Quality) -> Option<Told> {
        let (at, packet) = self.packets[self.first];
        if self.count == 0 || at > now + 1e-9 {
            return None;
        }
        self.first = (self.first + 1) % UNDER_WAY;
        self.count -= 1;
        if quality.cut { None } else { Some(packet) }
    }
}

/// The component.
pub struct Leader {
    heard: In<Told>,
    told: Out<Told>,
    tool: Out<Tool>,
    hand: Out<f64>,
    engaged: Out<f64>,
    start: Prop<[f64; 4]>,
    amplitude: Prop<[f64; 4]>,
    frequency: Prop<f64>,
    go: Prop<[f64; 3]>,
    seed: Prop<i64>,
    delay: Prop<f64>,
    jitter: Prop<f64>,
    loss: Prop<f64>,
    cut: Prop<bool>,
    stiffness: Prop<f64>,
    damping_rel: Prop<f64>,
    damping_abs: Prop<f64>,
    most: Prop<f64>,
    ways: Box<[Way; 2]>,
    other: Option<(f64, Told)>,
    p: V4,
    v: V4,
    /// Where the hand wants the handle, and where its path begins.
    wants: V4,
    begins: V4,
    coupling: Coupling,
    along: f64,
    coupled: bool,
    near: f64,
    since: f64,
    /// How far off what it tells is, and for how much longer, in s.
    jump: (V4, f64),
}

impl Component for Leader {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "A handle (1 kg) in a hand, behind a network that delays, jitters, loses and can be cut, both ways alike. While it is not coupled the \
             hand brings it to where the arm's tool is; coupled it goes along its path, and feels the arm by a spring as that feels it.",
        )
        .on_configure(|c, _| {
            c.draw_anew();
            c.jump = (V4::zeros(), 0.0);
            (c.p, c.v, c.wants) = (c.start.get().into(), V4::zeros(), c.start.get().into());
            (c.other, c.coupling, c.coupled, c.near, c.since) = (None, Coupling::default(), false, 0.0, PACKETS);
            Ok(())
        });
        b.doc("What it tells is off by so much, in m, for so many seconds: a sensor that jumps.")
            .parameter("x", Some(0.0))
            .parameter("y", Some(0.0))
            .parameter("z", Some(0.0))
            .parameter("seconds", None::<f64>)
            .injection("jump", |c, _, (x, y, z, seconds): (f64, f64, f64, f64)| {
                c.jump = (V4::new(x, y, z, 0.0), seconds);
                Ok(())
            });
        Self {
            heard: b.doc("What the arm's end tells.").required().input("heard"),
            told: b.doc("What it tells the arm's end, when that arrives there.").output("told"),
            tool: b.doc("Where the handle is now.").output("tool"),
            hand: b.doc("What the hand does to it: the norm.").unit("N").output("hand"),
            engaged: b.doc("How much of its coupling is in force, 0 to 1.").output("engaged"),
            start: b
                .doc("Where it is when the simulation begins: x, y, z (m), angle (rad).")
                .range(-6.3..=6.3)
                .tunable(Tunable::Unconfigured)
                .property("start", [0.10, 0.38, -0.12, 2.0]),
            amplitude: b
                .doc("Its path: an eight of that half-width along x and y, and to and fro in z (m) and about z (rad).")
                .range(-1.0..=1.0)
                .property("amplitude", [0.0; 4]),
            frequency: b.doc("Rounds of it.").unit("Hz").range(0.0..=2.0).property("frequency", 0.15),
            go: b
                .doc("How far from where it began it goes besides, at 0.12 m/s.")
                .unit("m")
                .range(-1.0..=1.0)
                .property("go", [0.0; 3]),
            seed: b.doc("Decides what is lost and late, from now on.").property("seed", 1),
            delay: b.doc("One way.").unit("s").range(0.0..=0.3).property("delay", 0.005),
            jitter: b.doc("Up to so much more.").unit("s").range(0.0..=0.1).property("jitter", 0.0),
            loss: b.doc("Share of the packets that is lost.").range(0.0..=1.0).property("loss", 0.0),
            cut: b.doc("Nothing gets through.").property("cut", false),
            stiffness: b.doc("Spring of its coupling.").unit("N/m").range(0.0..=1000.0).property("stiffness", 300.0),
            damping_rel: b.doc("Damper.").unit("N s/m").range(0.0..=200.0).property("damping_rel", 12.0),
            damping_abs: b
                .doc("Damper on its own speed.")
                .unit("N s/m")
                .range(0.0..=200.0)
                .property("damping_abs", 2.0),
            most: b.doc("Largest force.").unit("N").range(0.0..=40.0).property("most", 15.0),
            ways: Box::new([Way::new(1), Way::new(2)]),
            other: None,
            p: V4::zeros(),
            v: V4::zeros(),
            wants: V4::zeros(),
            begins: V4::zeros(),
            coupling: Coupling::default(),
            along: 0.0,
            coupled: false,
            near: 0.0,
            since: 0.0,
            jump: (V4::zeros(), 0.0),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let (now, dt) = (cx.now().as_secs_f64(), cx.dt());
        let quality =
            Quality { delay: self.delay.get(), jitter: self.jitter.get(), loss: self.loss.get(), cut: self.cut.get() };
        if self.seed.changed() {
            self.draw_anew();
        }
        self.jump.1 -= dt;
        self.since += dt;
        let sends = self.since >= PACKETS - 0.5 * dt;
        if sends {
            self.since = 0.0;
            if let Some(packet) = self.heard.get() {
                self.ways[0].send(now, quality, packet);
            }
        }
        while let Some(packet) = self.ways[0].receive(now, quality) {
            self.other = Some((now, packet));
        }
        let other = self.other.filter(|(at, _)| now - at < STALE).map(|(_, told)| told);

        let coupled = other.is_some_and(|other| other.coupled);
        if coupled && !self.coupled {
            (self.begins, self.along) = (self.wants, 0.0);
        }
        self.coupled = coupled;
        let hand = self.lead(other, dt);
        let law = Law {
            stiffness: self.stiffness.get(),
            damping_rel: self.damping_rel.get(),
            damping_abs: self.damping_abs.get(),
            most: self.most.get(),
        };
        let there = other.map(|other| (V4::from(other.p), V4::from(other.v)));
        let there = there.as_ref().map(|(p, v)| (p, v));
        let pull = self.coupling.update(&law, (&self.p, &self.v), there, coupled, dt);
        self.step(&(hand + pull.wrench), dt);

        let near = other.is_some() && pull.wanted < ALIGNED.0;
        self.near = if near { self.near + dt } else { 0.0 };
        if sends {
            let off = if self.jump.1 > 0.0 { self.jump.0 } else { V4::zeros() };
            let told = Told {
                p: (self.p + off).into(),
                v: self.v.into(),
                stamp: i64::try_from(cx.now().0).unwrap_or(i64::MAX),
                aligned: self.near >= ALIGNED.1,
                coupled,
            };
            self.ways[1].send(now, quality, told);
        }
        while let Some(packet) = self.ways[1].receive(now, quality) {
            self.told.write(packet);
        }
        self.tool.write(Tool { p: self.p.into(), v: self.v.into() });
        self.hand.write(hand.fixed_rows::<3>(0).norm());
        self.engaged.write(self.coupling.engaged);
    }
}

impl Leader {
    /// The network from the beginning.
    fn draw_anew(&mut self) {
        #[allow(clippy::cast_sign_loss)]
        let seed = self.seed.get() as u64;
        *self.ways = [Way::new(seed), Way::new(seed ^ 0x5555_5555)];
    }

    /// What the hand does to the handle, `dt` seconds later.
    fn lead(&mut self, other: Option<Told>, dt: f64) -> V4 {
        let mut ahead = self.wants;
        if self.coupled {
            self.along += dt;
            let go = self.go.get();
            ahead = self.begins + V4::new(go[0], go[1], go[2], 0.0);
        } else if let Some(other) = other {
            ahead = other.p.into();
        }
        // It sets out slowly, goes no faster than it does, and arrives slowly.
        let mut step = (ahead - self.wants) * (dt / HAND_LAG);
        let most = HAND_SPEED * dt;
        let length = step.fixed_rows::<3>(0).norm();
        step *= most / length.max(most);
        self.wants += step;

        let mut path = V4::zeros();
        if self.coupled {
            let amplitude = V4::from(self.amplitude.get());
            let grown = (self.along / SETS_OUT).min(1.0);
            let round = TAU * self.frequency.get() * self.along;
            let eight = [round.sin(), (2.0 * round).sin(), round.sin(), round.sin()];
            path = amplitude.component_mul(&V4::from(eight)) * grown;
        }
        let mut hand = (self.wants + path - self.p) * HAND.0 - self.v * HAND.1;
        let strength = hand.fixed_rows::<3>(0).norm();
        hand *= HAND.2 / strength.max(HAND.2);
        // The wrist turns it where it wants: as stiff as it is, for something that light.
        hand[3] = (self.wants[3] + path[3] - self.p[3]) * 4.0 - self.v[3] * 0.4;
        hand
    }

    /// The handle under what acts on it.
    fn step(&mut self, force: &V4, dt: f64) {
        let mass = V4::new(MASS, MASS, MASS, 0.02);
        let guide = V4::new(GUIDE, GUIDE, GUIDE, 0.02);
        for i in 0..4 {
            self.v[i] = (self.v[i] + dt * force[i] / mass[i]) / (1.0 + dt * guide[i] / mass[i]);
        }
        self.p += self.v * dt;
    }
}
