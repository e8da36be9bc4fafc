//! The operator's hand: a spring and a damper that follow a script.

use nalgebra::Vector3;

/// What a hand does, one segment after the other: `free 1; align 5; hold 1; sway 20 0.06 0 0 0.15`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HandScript {
    segments: Vec<HandSegment>,
}

/// One segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandSegment {
    /// How long, in s.
    pub duration: f64,
    /// What.
    pub act: HandAct,
}

/// What a hand can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum HandAct {
    /// `free T`: not touch the tool.
    Free,
    /// `hold T`: keep it where it was when the segment began.
    Hold,
    /// `align T`: carry it to the other robot's tool.
    Align,
    /// `sway T X Y Z HERTZ`: to and fro by so much (m), about where it was.
    Sway {
        /// In m.
        amplitude: Vector3<f64>,
        /// In Hz.
        frequency: f64,
    },
    /// `go T X Y Z`: carry it by so much (m), in that time.
    Go(Vector3<f64>),
    /// `push T X Y Z`: push with a constant force (N).
    Push(Vector3<f64>),
}

/// Why a script is not one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}`: write free T, hold T, align T, sway T X Y Z HERTZ, go T X Y Z or push T X Y Z, separated by `;`")]
pub struct ScriptError(pub String);

/// Segments a script may have: it is written by hand.
const SEGMENTS_MAX: usize = 256;
/// Fastest that a hand carries a tool, in m/s.
const CARRY_SPEED: f64 = 0.1;
/// A hand that has to pull with all its strength for so long lets go, in s.
const PATIENCE: f64 = 0.5;

impl std::str::FromStr for HandScript {
    type Err = ScriptError;

    fn from_str(text: &str) -> Result<Self, ScriptError> {
        let mut segments = Vec::new();
        for part in text.split(';').map(str::trim).filter(|p| !p.is_empty()) {
            let error = || ScriptError(part.chars().take(60).collect());
            let mut words = part.split_whitespace();
            let verb = words.next().unwrap_or_default();
            let numbers: Vec<f64> = words
                .map(|w| w.parse::<f64>().ok().filter(|n| n.is_finite()))
                .collect::<Option<_>>()
                .ok_or_else(error)?;
            let act = match (verb, numbers.as_slice()) {
                ("free", [_]) => HandAct::Free,
                ("hold", [_]) => HandAct::Hold,
                ("align", [_]) => HandAct::Align,
                ("sway", [_, x, y, z, frequency]) => {
                    HandAct::Sway { amplitude: Vector3::new(*x, *y, *z), frequency: *frequency }
                }
                ("go", [_, x, y, z]) => HandAct::Go(Vector3::new(*x, *y, *z)),
                ("push", [_, x, y, z]) => HandAct::Push(Vector3::new(*x, *y, *z)),
                _ => return Err(error()),
            };
            let duration = numbers[0];
            if duration < 0.0 || segments.len() >= SEGMENTS_MAX {
                return Err(error());
            }
            segments.push(HandSegment { duration, act });
        }
        Ok(Self { segments })
    }
}

/// A hand following a script.
#[derive(Debug, Clone)]
pub struct Hand {
    /// Stiffness of the arm behind the hand, in N/m.
    pub stiffness: f64,
    /// Its damping, in N s/m.
    pub damping: f64,
    /// The strongest it pushes, in N.
    pub f_max: f64,
    script: HandScript,
    segment: usize,
    elapsed: f64,
    target: Vector3<f64>,
    origin: Vector3<f64>,
    begun: bool,
    strained: f64,
}

impl Hand {
    /// A hand with the usual stiffness and strength.
    pub fn new(script: HandScript) -> Self {
        Self {
            stiffness: 300.0,
            damping: 30.0,
            f_max: 30.0,
            script,
            segment: 0,
            elapsed: 0.0,
            target: Vector3::zeros(),
            origin: Vector3::zeros(),
            begun: false,
            strained: 0.0,
        }
    }

    /// Begins another script.
    pub fn follow(&mut self, script: HandScript) {
        self.script = script;
        self.segment = 0;
        self.elapsed = 0.0;
        self.begun = false;
    }

    /// The force on the tool (N, world frame) in the next `dt` seconds. `other`: where the other robot's tool is.
    /// A hand that the robot pulls along against all its strength lets go until the next segment.
    pub fn update(
        &mut self,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        other: Option<&Vector3<f64>>,
        dt: f64,
    ) -> Vector3<f64> {
        while let Some(s) = self.script.segments.get(self.segment)
            && self.elapsed >= s.duration
        {
            self.elapsed -= s.duration;
            self.segment += 1;
            self.begun = false;
        }
        let Some(HandSegment { duration, act }) = self.script.segments.get(self.segment).copied() else {
            return Vector3::zeros();
        };
        if !self.begun {
            self.begun = true;
            self.strained = 0.0;
            self.origin = *position;
            self.target = *position;
        }
        self.elapsed += dt;
        if self.strained > PATIENCE {
            return Vector3::zeros();
        }
        let before = self.target;
        match act {
            HandAct::Free => return Vector3::zeros(),
            HandAct::Push(force) => return force,
            HandAct::Hold => {}
            HandAct::Align => {
                if let Some(other) = other {
                    let way = other - self.target;
                    let most = CARRY_SPEED * dt;
                    self.target += if way.norm() > most { way * (most / way.norm()) } else { way };
                }
            }
            HandAct::Sway { amplitude, frequency } => {
                let phase = std::f64::consts::TAU * frequency * self.elapsed;
                self.target = self.origin + amplitude * phase.sin();
            }
            HandAct::Go(way) => {
                // Smooth start and end: a hand does not jerk.
                let s = (self.elapsed / duration.max(dt)).min(1.0);
                self.target = self.origin + way * (s * s * (3.0 - 2.0 * s));
            }
        }
        let speed = (self.target - before) / dt;
        let force = (self.target - position) * self.stiffness + (speed - velocity) * self.damping;
        let norm = force.norm();
        if norm > self.f_max {
            self.strained += dt;
            return force * (self.f_max / norm);
        }
        self.strained = 0.0;
        force
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scripts_are_read_or_refused() {
        let script: HandScript = "free 1; sway 2 0.06 0 0 0.15;go 3 0 0.4 0; ".parse().unwrap();
        assert_eq!(script.segments.len(), 3);
        for bad in ["sway 1", "free", "free -1", "dance 3", "push 1 0 0 NaN", "free 1 2"] {
            assert!(bad.parse::<HandScript>().is_err(), "{bad}");
        }
        assert!("free 1;".repeat(1000).parse::<HandScript>().is_err());
    }

    #[test]
    fn a_hand_lets_go_of_what_is_stronger() {
        let mut hand = Hand::new("hold 60".parse().unwrap());
        hand.update(&Vector3::zeros(), &Vector3::zeros(), None, 0.001);
        let away = Vector3::new(1.0, 0.0, 0.0);
        let pulls = (0..1000).filter(|_| hand.update(&away, &Vector3::zeros(), None, 0.001).norm() > 0.0).count();
        assert!((490..510).contains(&pulls), "{pulls} ms");
    }

    #[test]
    fn a_hand_carries_a_mass_to_the_other_tool() {
        let mut hand = Hand::new("free 0.5; align 5".parse().unwrap());
        let other = Vector3::new(0.1, -0.05, 0.0);
        let (mut x, mut v) = (Vector3::zeros(), Vector3::zeros());
        for _ in 0..5000 {
            let f = hand.update(&x, &v, Some(&other), 0.001);
            assert!(f.norm() <= 30.0 + 1e-9);
            v += f / 5.0 * 0.001;
            x += v * 0.001;
        }
        assert!((x - other).norm() < 1e-3, "{x}");
    }
}
