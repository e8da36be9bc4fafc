//! The coupling of two robots, law against law over a delayed link: the figures the design rests on.

use davit::libraries::youbot::hand::{Hand, Script};
use davit::libraries::youbot::impedance::Reference;
use davit::libraries::youbot::network::{Network, Quality};
use davit::libraries::youbot::parameters::WORKING_POSE_DEG;
use davit::libraries::youbot::rigid_body::radians;
use davit::libraries::youbot::robot::{CONTROL_PERIOD, Robot};
use nalgebra::Vector3;

/// Position, velocity and the moment they were true, in s.
type Sample = (Vector3<f64>, Vector3<f64>, f64);

struct Side {
    robot: Robot,
    outgoing: Network<Sample>,
    heard: Option<Sample>,
}

impl Side {
    fn new(quality: Quality, seed: u64) -> Self {
        Self { robot: Robot::new(radians(WORKING_POSE_DEG)), outgoing: Network::new(quality, seed), heard: None }
    }
}

/// What was measured.
#[derive(Debug, Default)]
struct Figures {
    rms: f64,
    worst: f64,
    raw_max: f64,
    hand_rms: f64,
    hand_max: f64,
    saturated: f64,
}

struct Scenario {
    stiffness: f64,
    damping_rel: f64,
    damping_abs: f64,
    quality: Quality,
    friction_comp: f64,
    force_gain: f64,
    recenter: f64,
    script: &'static str,
    seconds: f64,
    /// Control periods between two packets.
    send_every: u64,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            stiffness: 150.0,
            damping_rel: 12.0,
            damping_abs: 5.0,
            quality: Quality { delay: 0.005, ..Quality::default() },
            friction_comp: 0.9,
            force_gain: 0.0,
            recenter: 1.0,
            script: "sway 60 0.042 0.042 0 0.15",
            seconds: 20.0,
            send_every: 4,
        }
    }
}

impl Scenario {
    /// Robot A is moved by a hand, robot B follows.
    fn run(&self) -> Figures {
        let mut sides = [Side::new(self.quality, 1), Side::new(self.quality, 2)];
        for side in &mut sides {
            let p = &mut side.robot.impedance.parameters;
            p.stiffness = self.stiffness;
            p.damping_rel = self.damping_rel;
            p.damping_abs = self.damping_abs;
            p.ref_max_age = 10.0;
            let p = &mut side.robot.dynamics.parameters;
            p.friction_comp = self.friction_comp;
            p.force_gain = Vector3::repeat(self.force_gain);
            p.recenter_gain = self.recenter;
        }
        let mut hand = Hand::new(self.script.parse::<Script>().unwrap());
        let mut out = Figures::default();
        let ticks = (self.seconds / CONTROL_PERIOD) as u64;
        let (mut saturated, mut hand_squares, mut squares) = (0u64, 0.0, 0.0);
        for tick in 0..ticks {
            let now = tick as f64 * CONTROL_PERIOD;
            for me in 0..2 {
                let other = 1 - me;
                while let Some(sample) = sides[other].outgoing.receive(now) {
                    if sides[me].heard.is_none_or(|h| h.2 < sample.2) {
                        sides[me].heard = Some(sample);
                    }
                }
            }
            let tool = &sides[0].robot.tool;
            let push = hand.update(&tool.position, &tool.velocity, None, CONTROL_PERIOD);
            for (side, push) in sides.iter_mut().zip([push, Vector3::zeros()]) {
                let reference =
                    side.heard.map(|(position, velocity, at)| Reference { position, velocity, age: now - at });
                side.robot.step(reference.as_ref(), true, &push);
                if tick % self.send_every == 0 {
                    let sample = (side.robot.tool.position, side.robot.tool.velocity, now);
                    side.outgoing.send(now, sample);
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

#[test]
fn explore() {
    let show = |name: String, f: Figures| println!("= {name}: {:.1} {:.1} mm raw {:.1} hand {:.1} {:.1} sat {:.3}", f.rms * 1e3, f.worst * 1e3, f.raw_max, f.hand_rms, f.hand_max, f.saturated);
    for delay in [0.002, 0.005, 0.02, 0.05, 0.1, 0.2] {
        let quality = Quality { delay, ..Quality::default() };
        show(format!("K150 delay {delay}"), Scenario { quality, ..Scenario::default() }.run());
        show(format!("K300 delay {delay}"), Scenario { quality, stiffness: 300.0, damping_rel: 20.0, ..Scenario::default() }.run());
        show(format!("8dof delay {delay}"), Scenario { quality, force_gain: 0.1, ..Scenario::default() }.run());
    }
    for (loss, jitter, send_every) in [(0.05, 0.002, 4), (0.3, 0.01, 4), (0.0, 0.0, 1), (0.0, 0.0, 50)] {
        let quality = Quality { delay: 0.005, loss, jitter, ..Quality::default() };
        show(format!("K300 loss {loss} jitter {jitter} every {send_every}"), Scenario { quality, send_every, stiffness: 300.0, damping_rel: 20.0, ..Scenario::default() }.run());
    }
    show("norecenter".into(), Scenario { force_gain: 0.1, recenter: 0.0, ..Scenario::default() }.run());
    for script in ["go 8 0.4 0 0; hold 4; go 8 -0.4 0 0; hold 4", "go 8 0 0.4 0; hold 4; go 8 0 -0.4 0; hold 4", "sway 40 0.2 0 0 0.025", "go 8 0.28 0.28 0; hold 4; go 8 -0.28 -0.28 0"] {
      for fg in [0.0, 0.1] {
        show(format!("{script} {fg}"), Scenario { force_gain: fg, script, seconds: 24.0, ..Scenario::default() }.run());
      }
    }
}
