//! The coupling of two robots, law against law over a delayed link: the figures the design rests on.

use davit::libraries::youbot::dynamics::DynamicsParameters;
use davit::libraries::youbot::hand::{Hand, HandScript};
use davit::libraries::youbot::impedance::{CouplingLaw, Reference};
use davit::libraries::youbot::network::{Network, Quality};
use davit::libraries::youbot::parameters::WORKING_POSE_DEG;
use davit::libraries::youbot::rigid_body::radians;
use davit::libraries::youbot::robot::{CONTROL_PERIOD, Robot};
use nalgebra::Vector3;

pub struct Side {
    pub robot: Robot,
    outgoing: Network<Reference>,
    heard: Option<Reference>,
}

impl Side {
    pub fn new(quality: Quality, seed: u64) -> Self {
        Self { robot: Robot::new(radians(WORKING_POSE_DEG)), outgoing: Network::new(quality, seed), heard: None }
    }

    /// What has arrived by `now` (s), the newest of it; here with its age from the beginning.
    pub fn hear(&mut self, other: &mut Self, now: f64) {
        while let Some(reference) = other.outgoing.receive(now) {
            if self.heard.is_none_or(|heard| heard.age > reference.age) {
                self.heard = Some(reference);
            }
        }
    }

    /// One control period from `now` (s) on, both bases yielding or none.
    pub fn step(&mut self, now: f64, push: &Vector3<f64>) {
        // What travels has minus the moment it was sent for an age.
        let reference = self.heard.map(|heard| Reference { age: now + heard.age, ..heard });
        self.robot.step(reference.as_ref(), true, true, push);
    }

    pub fn send(&mut self, now: f64) {
        let tool = &self.robot.tool;
        let energy = self.robot.impedance.energy_sent();
        let (position, velocity) = (tool.position, tool.velocity);
        self.outgoing.send(now, Reference { position, velocity, age: -now, coupled: true, energy });
    }
}

/// Both hear what has arrived.
pub fn hear(sides: &mut [Side; 2], now: f64) {
    let [left, right] = sides;
    left.hear(right, now);
    right.hear(left, now);
}

/// What was measured.
#[derive(Debug, Default)]
pub struct Figures {
    pub rms: f64,
    pub worst: f64,
    pub raw_max: f64,
    pub hand_rms: f64,
    pub hand_max: f64,
    pub saturated: f64,
}

pub struct Scenario {
    pub law: CouplingLaw,
    pub stiffness: f64,
    pub damping_rel: f64,
    pub damping_abs: f64,
    pub quality: Quality,
    pub friction_comp: f64,
    /// None here: the figures of the design check are those of a follower that sticks.
    pub stiction_comp: f64,
    pub force_gain: f64,
    pub recenter: f64,
    pub script: &'static str,
    pub seconds: f64,
    /// Control periods between two packets.
    pub send_every: u64,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            law: CouplingLaw::Position,
            stiffness: 150.0,
            damping_rel: 12.0,
            damping_abs: 5.0,
            quality: Quality { delay: 0.005, ..Quality::default() },
            friction_comp: 0.9,
            stiction_comp: 0.0,
            force_gain: 0.0,
            recenter: 5.0,
            script: "sway 60 0.042 0.042 0 0.15",
            seconds: 20.0,
            send_every: 4,
        }
    }
}

impl Scenario {
    /// Robot A is moved by a hand, robot B follows.
    pub fn run(&self) -> Figures {
        let mut sides = [Side::new(self.quality, 1), Side::new(self.quality, 2)];
        for side in &mut sides {
            let p = &mut side.robot.impedance.parameters;
            p.law = self.law;
            p.stiffness = self.stiffness;
            p.damping_rel = self.damping_rel;
            p.damping_abs = self.damping_abs;
            p.ref_max_age = 10.0;
            let p = &mut side.robot.dynamics.parameters;
            p.friction_comp = self.friction_comp;
            p.stiction_comp = self.stiction_comp;
            p.force_gain = Vector3::repeat(self.force_gain);
            p.recenter_gain = self.recenter;
        }
        let mut hand = Hand::new(self.script.parse::<HandScript>().unwrap());
        let mut out = Figures::default();
        let ticks = (self.seconds / CONTROL_PERIOD) as u64;
        let (mut saturated, mut hand_squares, mut squares) = (0u64, 0.0, 0.0);
        for tick in 0..ticks {
            let now = tick as f64 * CONTROL_PERIOD;
            hear(&mut sides, now);
            let tool = &sides[0].robot.tool;
            let push = hand.update(&tool.position, &tool.velocity, None, CONTROL_PERIOD);
            for (side, push) in sides.iter_mut().zip([push, Vector3::zeros()]) {
                side.step(now, &push);
                if tick % self.send_every == 0 {
                    side.send(now);
                }
                out.raw_max = out.raw_max.max(side.robot.raw_norm);
                saturated += u64::from(side.robot.saturated != 0);
            }
            let error = (sides[0].robot.tool.position - sides[1].robot.tool.position).norm();
            assert!(error.is_finite());
            squares += error * error;
            out.worst = out.worst.max(error);
            hand_squares += push.norm_squared();
            out.hand_max = out.hand_max.max(push.norm());
        }
        out.rms = (squares / ticks as f64).sqrt();
        out.hand_rms = (hand_squares / ticks as f64).sqrt();
        out.saturated = saturated as f64 / (2 * ticks) as f64;
        out
    }
}

pub fn mm(metres: f64) -> f64 {
    metres * 1e3
}

/// Within 30 % of a figure of the design check (one scenario each, other integrator, friction and arm: not more).
fn about(what: &str, measured: f64, figure: f64) {
    assert!((measured - figure).abs() <= 0.3 * figure, "{what}: {measured:.1}, the figure is {figure}");
}

pub fn at_delay(delay: f64) -> Quality {
    Quality { delay, ..Quality::default() }
}

#[test]
fn a_stiffer_coupling_follows_closer() {
    for (stiffness, rms, rms_less_compensation) in
        [(70.0, 41.0, 45.0), (150.0, 20.0, 23.0), (300.0, 9.5, 11.3), (500.0, 5.7, 6.8)]
    {
        let scenario = Scenario { stiffness, quality: at_delay(0.002), ..Scenario::default() };
        let figures = scenario.run();
        about(&format!("RMS at {stiffness} N/m, mm"), mm(figures.rms), rms);
        assert_eq!(figures.saturated, 0.0);
        let figures = Scenario { friction_comp: 0.8, ..scenario }.run();
        about(
            &format!("RMS at {stiffness} N/m, less friction compensated, mm"),
            mm(figures.rms),
            rms_less_compensation,
        );
    }
}

/// As the robots come: who sticks is helped along the force that pulls it.
#[test]
fn who_does_not_stick_follows_closer() {
    let helped = DynamicsParameters::default().stiction_comp;
    for stiffness in [150.0, 300.0] {
        let with = |stiction_comp| Scenario { stiffness, stiction_comp, ..Scenario::default() }.run();
        let (sticks, follows) = (with(0.0), with(helped));
        println!("{stiffness} N/m: {:.1} mm, helped {:.1} mm", mm(sticks.rms), mm(follows.rms));
        assert!(follows.rms < 0.85 * sticks.rms, "{sticks:?} {follows:?}");
        assert!(follows.hand_rms < 1.05 * sticks.hand_rms && follows.saturated == 0.0, "{sticks:?} {follows:?}");
    }
}

#[test]
fn the_hand_feels_a_few_newtons() {
    let figures = Scenario::default().run();
    about("hand, N rms", figures.hand_rms, 6.0);
    about("hand, N peak", figures.hand_max, 9.5);
}

#[test]
fn delay_costs_little_up_to_a_fifth_of_a_second() {
    for (delay, rms, raw) in [
        (0.002, 19.6, 5.7),
        (0.005, 19.7, 5.7),
        (0.02, 20.3, 6.0),
        (0.05, 21.5, 6.5),
        (0.1, 23.4, 7.1),
        (0.2, 26.6, 8.3),
    ] {
        let figures = Scenario { quality: at_delay(delay), ..Scenario::default() }.run();
        about(&format!("RMS at {delay} s, mm"), mm(figures.rms), rms);
        about(&format!("largest wanted force at {delay} s, N"), figures.raw_max, raw);
    }
    for (delay, rms) in [(0.001, 9.9), (0.02, 10.8), (0.05, 12.2), (0.1, 14.2), (0.2, 17.3), (0.3, 19.5)] {
        let scenario = Scenario { stiffness: 300.0, damping_rel: 20.0, ..Scenario::default() };
        let figures = Scenario { quality: at_delay(delay), ..scenario }.run();
        about(&format!("RMS at 300 N/m and {delay} s, mm"), mm(figures.rms), rms);
    }
}

#[test]
fn rate_and_loss_hardly_matter() {
    let with = |loss, jitter, send_every| {
        let quality = Quality { delay: 0.005, loss, jitter, ..Quality::default() };
        let scenario = Scenario { stiffness: 300.0, damping_rel: 20.0, send_every, quality, ..Scenario::default() };
        mm(scenario.run().rms)
    };
    let clean = with(0.0, 0.0, 1);
    for (loss, jitter, send_every) in [(0.05, 0.002, 4), (0.3, 0.01, 4), (0.0, 0.0, 50)] {
        let rms = with(loss, jitter, send_every);
        assert!(rms < 1.15 * clean, "{rms} against {clean} (loss {loss}, jitter {jitter}, every {send_every} ms)");
    }
}

#[test]
fn eight_degrees_of_freedom_follow_closer_while_the_link_is_quick() {
    let five = Scenario::default().run();
    for (delay, rms) in [(0.005, 5.9), (0.02, 6.3)] {
        let eight = Scenario { force_gain: 0.1, quality: at_delay(delay), ..Scenario::default() }.run();
        about(&format!("RMS at {delay} s, mm"), mm(eight.rms), rms);
        assert!(eight.rms < 0.5 * five.rms && eight.hand_rms <= 8.0, "{eight:?}");
        assert_eq!(eight.saturated, 0.0);
    }
    let quick = Scenario { force_gain: 0.1, ..Scenario::default() }.run();
    let slow = Scenario { force_gain: 0.1, quality: at_delay(0.1), ..Scenario::default() }.run();
    assert!(slow.rms > 1.3 * quick.rms && slow.rms < 0.6 * five.rms, "{slow:?}");
}

/// Forty centimetres are more than an arm reaches without its base: the demonstration of why the mode exists.
#[test]
fn forty_centimetres_need_the_base() {
    let script = "go 8 0.283 0.283 0; hold 4; go 8 -0.283 -0.283 0; hold 4";
    // As the robots come: the base of one that sticks waits for the force that breaks it loose.
    let stiction_comp = DynamicsParameters::default().stiction_comp;
    let five = Scenario { script, seconds: 24.0, stiction_comp, ..Scenario::default() }.run();
    let eight = Scenario { script, seconds: 24.0, stiction_comp, force_gain: 0.1, ..Scenario::default() }.run();
    assert!(
        mm(eight.rms) <= 14.7 && eight.hand_rms <= 8.0 && eight.hand_max < 15.0 && eight.saturated == 0.0,
        "{eight:?}"
    );
    assert!(five.worst > 4.0 * eight.worst && five.hand_max > 20.0, "{five:?}");
}

/// Stiffness times delay is what damping has to beat (1.2 times is the design rule).
#[test]
fn damping_by_the_rule_keeps_a_delayed_coupling_stable() {
    for (stiffness, delay) in [(150.0, 0.2), (300.0, 0.1), (600.0, 0.05), (600.0, 0.2)] {
        let settled = |damping_abs: f64| {
            let mut pair = [Side::new(at_delay(delay), 1), Side::new(at_delay(delay), 2)];
            for side in &mut pair {
                let p = &mut side.robot.impedance.parameters;
                (p.stiffness, p.damping_rel, p.damping_abs) = (stiffness, 0.0, damping_abs);
                (p.f_max, p.f_rate, p.ref_max_age) = (1e3, 1e6, 10.0);
                // Nothing but the coupling damps: the hardest case.
                side.robot.body.arm.friction_scale = 0.0;
                side.robot.dynamics.parameters.friction_comp = 0.0;
            }
            let start = pair[1].robot.tool.position;
            let mut hand = Hand::new("push 0.5 0 3 0; free 60".parse::<HandScript>().unwrap());
            let mut late: f64 = 0.0;
            for tick in 0..10_000u32 {
                let now = f64::from(tick) * CONTROL_PERIOD;
                hear(&mut pair, now);
                let push = hand.update(&start, &Vector3::zeros(), None, CONTROL_PERIOD);
                for (side, push) in pair.iter_mut().zip([push, Vector3::zeros()]) {
                    side.step(now, &push);
                    side.send(now);
                }
                if now > 8.0 {
                    late = late.max((pair[0].robot.tool.position - pair[1].robot.tool.position).norm());
                }
            }
            late
        };
        let by_rule = settled(1.2 * stiffness * delay);
        assert!(by_rule < 0.002, "{stiffness} N/m, {delay} s: {by_rule} m");
        let too_little = settled(2.0);
        assert!(too_little > 0.05, "{stiffness} N/m, {delay} s: {too_little} m with hardly any damping");
    }
}
