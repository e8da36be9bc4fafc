//! The coupling's law: a spring and a damper between this tool and the other one.
//!
//! Coupling is mutual: force is put out while both robots want to be coupled. So both take hold within one time that a packet is under
//! way, and when one lets go the other does, without waiting for anybody's coordinator.

use super::tank::Tank;
use nalgebra::Vector3;

/// What the law is told, all in this robot's world frame.
#[derive(Debug, Clone, Copy)]
pub struct Reference {
    /// Where the other tool was, in m.
    pub position: Vector3<f64>,
    /// How it moved, in m/s.
    pub velocity: Vector3<f64>,
    /// How long ago that was, in s.
    pub age: f64,
    /// The other robot wants to be coupled.
    pub coupled: bool,
    /// Energy its coupling has given to this one's so far, in J.
    pub energy: f64,
}

/// How the spring and the damper are kept from giving out more energy than they take in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CouplingLaw {
    /// Not at all: delayed, it takes damping of [`DELAY_DAMPING`] times stiffness times delay to be stable.
    #[default]
    Position,
    /// By a tank of energy at each end, whatever the delay.
    Tank,
}

impl CouplingLaw {
    /// From its name: `position` or `tank`.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "position" => Some(Self::Position),
            "tank" => Some(Self::Tank),
            _ => None,
        }
    }
}

/// Parameters of the law (defaults: youBot coupling, one-way delay of a few milliseconds).
#[derive(Debug, Clone, Copy)]
pub struct ImpedanceParameters {
    /// What keeps it passive.
    pub law: CouplingLaw,
    /// In N/m.
    pub stiffness: f64,
    /// On the difference of velocities, in N s/m.
    pub damping_rel: f64,
    /// On the tool's own velocity, in N s/m, at least.
    pub damping_abs: f64,
    /// So much times stiffness times delay it is where that is more ([`DELAY_DAMPING`] keeps a delayed coupling stable; 0: never). The tank
    /// needs none of it.
    pub delay_damping: f64,
    /// Largest force put out, in N.
    pub f_max: f64,
    /// Fastest change of the force put out, in N/s.
    pub f_rate: f64,
    /// Age from which the reference is not believed, in s.
    pub ref_max_age: f64,
    /// This robot's frame minus the other's, in m.
    pub offset: Vector3<f64>,
}

impl Default for ImpedanceParameters {
    fn default() -> Self {
        Self {
            law: CouplingLaw::Position,
            stiffness: 150.0,
            damping_rel: 12.0,
            damping_abs: 5.0,
            delay_damping: 0.0,
            f_max: 10.0,
            f_rate: 40.0,
            ref_max_age: 0.06,
            offset: Vector3::zeros(),
        }
    }
}

/// Time in which the coupling lets go, asked to or because the reference is stale, in s.
pub const FADE: f64 = 0.1;
/// Time in which it takes hold, in s.
pub const ENGAGE: f64 = 0.3;
/// Damping on the own velocity per stiffness and delay (`docs/youbot.md`, *How slow a network may be*): 1 is what the delay takes, the rest is for what varies.
pub const DELAY_DAMPING: f64 = 1.2;
/// What the delay asks for is taken on the average over about so long, in s.
const DELAY_TIME: f64 = 0.2;

/// The law with its memory.
#[derive(Debug, Clone, Default)]
pub struct Impedance {
    /// Its parameters.
    pub parameters: ImpedanceParameters,
    ramp: Vector3<f64>,
    trust: f64,
    share: f64,
    /// Stiffness times age of the reference, on the average, in N s/m: a change of either is not felt as a step.
    delayed: f64,
    tank: Tank,
}

/// What the law answers.
#[derive(Debug, Clone, Copy, Default)]
pub struct ImpedanceOutput {
    /// The force to put on the tool, in N; zero when let go of.
    pub force: Vector3<f64>,
    /// How much of the coupling is in force: 0 let go of, 1 fully engaged. The force is of that share already.
    pub engaged: f64,
    /// Norm of the force it would want, coupled or not, in N.
    pub raw_norm: f64,
}

impl Impedance {
    /// One step of `dt` seconds. `coupled` is the port `ext_ref_mode`: while it is false, or the other robot's is, the wanted force is
    /// computed and, once it has faded, none put out.
    ///
    /// Independent of any coordination the force fades within [`FADE`] when the reference is older than `ref_max_age`.
    pub fn update(
        &mut self,
        position: &Vector3<f64>,
        velocity: &Vector3<f64>,
        reference: Option<&Reference>,
        coupled: bool,
        dt: f64,
    ) -> ImpedanceOutput {
        let p = &self.parameters;
        let away = reference.map_or_else(Vector3::zeros, |r| r.position + p.offset - position);
        let approach = reference.map_or_else(Vector3::zeros, |r| r.velocity - velocity);
        let raw = away * p.stiffness + approach * p.damping_rel;
        let raw_norm = raw.norm();
        let coupled = coupled && reference.is_some_and(|r| r.coupled);
        let fresh = reference.is_some_and(|r| r.age <= p.ref_max_age);
        // What is older is not believed, and pulls at nothing.
        let age = reference.map_or(0.0, |r| r.age.clamp(0.0, p.ref_max_age));
        self.delayed += (p.stiffness * age - self.delayed) * dt / (DELAY_TIME + dt);
        self.trust = (self.trust + if fresh { dt / FADE } else { -dt / FADE }).clamp(0.0, 1.0);
        self.share = (self.share + if coupled { dt / ENGAGE } else { -dt / FADE }).clamp(0.0, 1.0);
        if self.share == 0.0 {
            self.ramp = Vector3::zeros();
            // What a spring between the two tools holds: half of it at each end.
            self.tank = Tank::with(0.25 * p.stiffness * away.norm_squared()).after(&self.tank);
            return ImpedanceOutput { raw_norm, ..ImpedanceOutput::default() };
        }
        let wanted = if raw_norm > p.f_max { raw * (p.f_max / raw_norm) } else { raw };
        let step = wanted - self.ramp;
        let most = p.f_rate * dt;
        let length = step.norm();
        self.ramp += if length > most { step * (most / length) } else { step };
        let engaged = self.share * self.trust;
        let mut force = (self.ramp - velocity * self.damping()) * engaged;
        if p.law == CouplingLaw::Tank {
            force = self.tank.update(&force, position, velocity, reference.map(|r| r.energy), dt);
        }
        ImpedanceOutput { force, engaged, raw_norm }
    }

    /// The damper on the own velocity that the delay asks for now, in N s/m.
    pub fn damping(&self) -> f64 {
        let p = &self.parameters;
        match p.law {
            CouplingLaw::Position => p.damping_abs.max(p.delay_damping * self.delayed),
            CouplingLaw::Tank => p.damping_abs,
        }
    }

    /// Energy given to the other robot's coupling so far, in J.
    pub fn energy_sent(&self) -> f64 {
        self.tank.sent()
    }

    /// Forgets the past: the force starts from zero.
    pub fn reset(&mut self) {
        self.ramp = Vector3::zeros();
        self.trust = 0.0;
        self.share = 0.0;
        self.delayed = 0.0;
        self.tank = Tank::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.001;

    fn away(age: f64) -> Reference {
        let position = Vector3::new(0.15, 0.0, 0.0);
        Reference { position, velocity: Vector3::zeros(), age, coupled: true, energy: 0.0 }
    }

    #[test]
    fn uncoupled_it_wants_but_does_not_push() {
        let mut law = Impedance::default();
        let out = law.update(&Vector3::zeros(), &Vector3::zeros(), Some(&away(0.005)), false, DT);
        assert_eq!(out.force, Vector3::zeros());
        assert!((out.raw_norm - 22.5).abs() < 1e-9);
    }

    #[test]
    fn alone_nobody_is_coupled() {
        let mut law = Impedance::default();
        let mut force = |coupled: bool, ticks: usize| {
            let reference = Reference { coupled, ..away(0.005) };
            let update = |_| law.update(&Vector3::zeros(), &Vector3::zeros(), Some(&reference), true, DT);
            (0..ticks).map(update).last().expect("ticks").force.norm()
        };
        assert_eq!(force(false, 1000), 0.0);
        assert!(force(true, 1000) > 9.0);
        assert_eq!(force(false, 101), 0.0, "the other one lets go: so does this, within FADE");
    }

    #[test]
    fn coupled_it_ramps_and_is_bounded() {
        let mut law = Impedance::default();
        let mut last: f64 = 0.0;
        for _ in 0..1000 {
            let f = law.update(&Vector3::zeros(), &Vector3::zeros(), Some(&away(0.005)), true, DT).force.norm();
            assert!((f - last).abs() < 0.15 && f <= 10.0 + 1e-9);
            last = f;
        }
        assert!((last - 10.0).abs() < 1e-6);
    }

    #[test]
    fn the_damping_follows_the_delay_without_a_step() {
        let mut law = Impedance::default();
        law.parameters.delay_damping = DELAY_DAMPING;
        let fast = Vector3::new(0.0, 0.4, 0.0);
        let (mut last, mut force) = (5.0, Vector3::zeros());
        // Packets come every 4 ms; from 1 s on they are 50 ms under way, from 3 s on 5 ms again, and from 5 s on none come.
        for tick in 0..6000 {
            let (held, t) = (f64::from(tick % 4) * DT, f64::from(tick) * DT);
            let age = match t {
                t if t >= 5.0 => t - 5.0,
                t if (1.0..3.0).contains(&t) => 0.05 + held,
                _ => 0.005 + held,
            };
            let out = law.update(&Vector3::zeros(), &fast, Some(&away(age)), true, DT);
            assert!(tick < 400 || (out.force - force).norm() < 0.15, "{tick} ms");
            assert!((law.damping() - last).abs() < 0.1, "{} {last}", law.damping());
            (last, force) = (law.damping(), out.force);
            let least = DELAY_DAMPING * 150.0 * 0.05;
            // The same law, a little less stiff for a moment.
            law.parameters.stiffness = if (2300..2310).contains(&tick) { 120.0 } else { 150.0 };
            match tick {
                0..1000 | 3800..5000 => assert_eq!(last, 5.0, "{tick} ms"),
                2200..3000 => assert!(last >= least && last < 1.1 * least, "{tick} ms: {last}"),
                _ => assert!(last <= 1.2 * least, "{tick} ms: {last}"),
            }
        }
        law.parameters.law = CouplingLaw::Tank;
        assert_eq!(law.damping(), 5.0);
    }

    #[test]
    fn it_takes_hold_and_lets_go_without_a_step() {
        let mut law = Impedance::default();
        // A moving tool: its damping comes in with the rest.
        let fast = Vector3::new(0.0, 0.4, 0.0);
        let mut last = ImpedanceOutput::default();
        for tick in 0..1500 {
            let out = law.update(&Vector3::zeros(), &fast, Some(&away(0.005)), (100..1000).contains(&tick), DT);
            let step = (out.force - last.force).norm();
            assert!(step < 0.15, "{step} N at {tick} ms");
            assert!(out.engaged >= last.engaged || tick >= 1000);
            last = out;
            let whole = (100 + 300..1000).contains(&tick);
            assert!((out.engaged > 0.999) == whole || tick == 399, "{} at {tick} ms", out.engaged);
        }
        assert_eq!((last.engaged, last.force), (0.0, Vector3::zeros()));
    }

    #[test]
    fn a_stale_reference_fades_by_itself() {
        let mut law = Impedance::default();
        for _ in 0..1000 {
            law.update(&Vector3::zeros(), &Vector3::zeros(), Some(&away(0.005)), true, DT);
        }
        let mut age = 0.0;
        let mut gone = None;
        for i in 0..400 {
            age += DT;
            let f = law.update(&Vector3::zeros(), &Vector3::zeros(), Some(&away(age)), true, DT).force.norm();
            if f < 0.1 && gone.is_none() {
                gone = Some(f64::from(i) * DT);
            }
        }
        let gone = gone.expect("fades");
        assert!(gone > 0.1 && gone < 0.165, "{gone}");
    }
}
