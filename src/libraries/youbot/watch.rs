//! The conditions that the monitors raise events on, over time. Pure: samples and time in, happenings out.

use super::link::{LinkStats, PeerState};
use super::parameters::JOINTS;

/// A condition that must hold for a time.
#[derive(Debug, Clone, Copy, Default)]
pub struct Held(f64);

impl Held {
    /// Whether `condition` has held for `time` seconds, `dt` after the last call.
    pub fn update(&mut self, condition: bool, time: f64, dt: f64) -> bool {
        self.0 = if condition { self.0 + dt } else { 0.0 };
        condition && self.0 >= time - 1e-9
    }
}

/// Something that is said when it becomes true, and again every so often while it is.
#[derive(Debug, Clone, Copy, Default)]
pub struct Repeated {
    was: bool,
    since: f64,
}

impl Repeated {
    /// Whether to say it now.
    pub fn update(&mut self, is: bool, every: f64, dt: f64) -> bool {
        self.since += dt;
        let say = is && (!self.was || self.since >= every - 1e-9);
        if say {
            self.since = 0.0;
        }
        self.was = is;
        say
    }
}

/// What the monitors report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Watched {
    QosOk,
    QosDegraded,
    QosRestored,
    LinkLost,
    PeerLeft,
    Aligned,
    Misaligned,
    ForceSpike,
    TorqueSaturated,
    Overspeed,
    BaseOverspeed,
    Overtemperature,
    BusErrors,
    ControllerLost,
}

/// Thresholds of the link: seconds and shares.
#[derive(Debug, Clone, Copy)]
pub struct LinkThresholds {
    /// Age up to which the link is good.
    pub age_ok: f64,
    /// Age from which it is degraded.
    pub age_degraded: f64,
    /// Age from which it is lost.
    pub age_lost: f64,
    /// Silence from which it is degraded.
    pub gap_degraded: f64,
    /// Silence from which it is lost.
    pub gap_lost: f64,
    /// Jitter up to which it is good.
    pub jitter_ok: f64,
    /// Jitter from which it is degraded.
    pub jitter_degraded: f64,
    /// Loss up to which it is good.
    pub loss_ok: f64,
    /// Loss from which it is degraded.
    pub loss_degraded: f64,
    /// Loss from which it is lost.
    pub loss_lost: f64,
    /// How long it must be degraded to be called so.
    pub t_degraded: f64,
    /// How long it must be good after having been degraded.
    pub t_restore: f64,
    /// How long it must be good after having been lost.
    pub t_settle: f64,
    /// How long the peer may disagree about being engaged.
    pub t_peer: f64,
    /// How often a lasting condition is said again.
    pub repeat: f64,
}

impl Default for LinkThresholds {
    fn default() -> Self {
        Self {
            age_ok: 0.015,
            age_degraded: 0.020,
            age_lost: 0.100,
            gap_degraded: 0.020,
            gap_lost: 0.050,
            jitter_ok: 0.005,
            jitter_degraded: 0.010,
            loss_ok: 0.05,
            loss_degraded: 0.10,
            loss_lost: 0.50,
            t_degraded: 0.05,
            t_restore: 0.5,
            t_settle: 1.0,
            t_peer: 0.25,
            repeat: 0.5,
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Link {
    #[default]
    Lost,
    Degraded,
    Good,
}

/// Watches the link: lost → good after settling → degraded → good again; the peer leaving.
#[derive(Debug, Clone, Default)]
pub struct LinkWatch {
    /// Thresholds.
    pub thresholds: LinkThresholds,
    state: Link,
    good: Held,
    bad: Held,
    alone: Held,
    epoch: Option<i64>,
    said_ok: Repeated,
    said_degraded: Repeated,
    said_lost: Repeated,
    said_left: Repeated,
}

impl LinkWatch {
    /// One look, `dt` seconds after the last. `copying`: our own coupling is engaged.
    pub fn update(
        &mut self,
        stats: Option<&LinkStats>,
        peer: Option<&PeerState>,
        copying: bool,
        dt: f64,
        report: &mut impl FnMut(Watched),
    ) {
        let t = self.thresholds;
        let lost = stats.is_none_or(|s| s.age > t.age_lost || s.gap > t.gap_lost || s.loss > t.loss_lost);
        let bad = stats.is_some_and(|s| {
            s.age > t.age_degraded || s.gap > t.gap_degraded || s.jitter > t.jitter_degraded || s.loss > t.loss_degraded
        });
        let ok = stats.is_some_and(|s| s.age <= t.age_ok && s.jitter <= t.jitter_ok && s.loss <= t.loss_ok);
        // Between good and degraded: as it was.
        let good_for = if self.state == Link::Lost { t.t_settle } else { t.t_restore };
        let good = self.good.update(!lost && !bad && (ok || self.good.0 > 0.0), good_for, dt);
        let bad = self.bad.update(bad, t.t_degraded, dt);
        let before = self.state;
        self.state = match self.state {
            _ if lost => Link::Lost,
            Link::Lost | Link::Degraded if good => Link::Good,
            Link::Good if bad => Link::Degraded,
            state => state,
        };
        if before == Link::Degraded && self.state == Link::Good {
            report(Watched::QosRestored);
        }
        if self.said_lost.update(self.state == Link::Lost, t.repeat, dt) {
            report(Watched::LinkLost);
        }
        if self.said_ok.update(self.state == Link::Good, t.repeat, dt) {
            report(Watched::QosOk);
        }
        if self.said_degraded.update(self.state == Link::Degraded, t.repeat, dt) {
            report(Watched::QosDegraded);
        }
        let epoch = peer.map(|p| p.epoch);
        let restarted = matches!((self.epoch, epoch), (Some(a), Some(b)) if a != b);
        self.epoch = epoch.or(self.epoch);
        let apart = copying && peer.is_some_and(|p| !p.copying && !p.aligned);
        let alone = self.alone.update(apart, t.t_peer, dt);
        if self.said_left.update(alone, t.repeat, dt) || restarted {
            report(Watched::PeerLeft);
        }
    }

    /// Begins anew, as at the start.
    pub fn reset(&mut self) {
        *self = Self { thresholds: self.thresholds, ..Self::default() };
    }
}

/// Thresholds of the wanted force.
#[derive(Debug, Clone, Copy)]
pub struct ForceThresholds {
    /// Below it the arms are aligned, in N.
    pub f_on: f64,
    /// Above it they are not, in N.
    pub f_off: f64,
    /// How long below, in s.
    pub t_hold: f64,
    /// How long above, in s.
    pub t_off: f64,
    /// A spike, in N.
    pub f_spike: f64,
    /// A jump within 10 ms, in N.
    pub f_jump: f64,
    /// How often a lasting condition is said again, in s.
    pub repeat: f64,
}

impl Default for ForceThresholds {
    fn default() -> Self {
        Self { f_on: 2.0, f_off: 8.0, t_hold: 0.3, t_off: 0.1, f_spike: 25.0, f_jump: 15.0, repeat: 0.5 }
    }
}

/// Watches the wanted force. Aligned means both robots are: coordinators do not negotiate.
#[derive(Debug, Clone, Default)]
pub struct ForceWatch {
    /// Thresholds.
    pub thresholds: ForceThresholds,
    /// Our own force has been small for long enough.
    pub aligned: bool,
    low: Held,
    high: Held,
    last: Option<f64>,
    said_aligned: Repeated,
    said_misaligned: Repeated,
    spike: Repeated,
}

impl ForceWatch {
    /// One look, `dt` seconds after the last; none: no force is computed.
    pub fn update(&mut self, force: Option<f64>, peer: Option<&PeerState>, dt: f64, report: &mut impl FnMut(Watched)) {
        let t = self.thresholds;
        self.aligned = self.low.update(force.is_some_and(|f| f < t.f_on), t.t_hold, dt);
        let both = self.aligned && peer.is_some_and(|p| p.aligned || p.copying);
        if self.said_aligned.update(both, t.repeat, dt) {
            report(Watched::Aligned);
        }
        let misaligned = self.high.update(force.is_some_and(|f| f > t.f_off), t.t_off, dt);
        if self.said_misaligned.update(misaligned, t.repeat, dt) {
            report(Watched::Misaligned);
        }
        // A jump is judged over a look of at most 10 ms, longer looks in proportion.
        let jump = matches!((self.last, force), (Some(a), Some(b)) if b - a > t.f_jump * (dt / 0.01).max(1.0));
        self.last = force;
        if self.spike.update(jump || force.is_some_and(|f| f > t.f_spike), t.repeat, dt) {
            report(Watched::ForceSpike);
        }
    }

    /// Begins anew.
    pub fn reset(&mut self) {
        *self = Self { thresholds: self.thresholds, ..Self::default() };
    }
}

/// Thresholds of what must not happen.
#[derive(Debug, Clone, Copy)]
pub struct SafetyThresholds {
    /// Joint speed, in rad/s.
    pub qd_max: f64,
    /// Base speed, in m/s.
    pub base_v_max: f64,
    /// How long a joint may be at its torque limit, in s.
    pub tau_sat_time: f64,
    /// In °C.
    pub temp_max: f64,
    /// Bus errors in a row.
    pub pd_err_max: i64,
    /// How long the controller may be silent, in s.
    pub hb_timeout: f64,
    /// How often a lasting condition is said again, in s.
    pub repeat: f64,
}

impl Default for SafetyThresholds {
    fn default() -> Self {
        Self {
            qd_max: 1.5,
            base_v_max: 0.6,
            tau_sat_time: 0.5,
            temp_max: 80.0,
            pd_err_max: 100,
            hb_timeout: 0.05,
            repeat: 0.5,
        }
    }
}

/// What the safety watch looks at; none: not known.
#[derive(Debug, Clone, Copy, Default)]
pub struct SafetySample {
    /// Joint speeds, in rad/s.
    pub speeds: Option<[f64; JOINTS]>,
    /// Speed of the base, in m/s.
    pub base_speed: Option<f64>,
    /// Joints at their torque limit.
    pub saturated: Option<u8>,
    /// Hottest motor, in °C.
    pub temperature: Option<f64>,
    /// Bus errors so far.
    pub bus_errors: Option<i64>,
    /// How long the controller has been silent, in s; none: it never spoke.
    pub controller_age: Option<f64>,
}

/// Watches what must not happen.
#[derive(Debug, Clone, Default)]
pub struct SafetyWatch {
    /// Thresholds.
    pub thresholds: SafetyThresholds,
    saturated: Held,
    said: [Repeated; 6],
}

impl SafetyWatch {
    /// One look, `dt` seconds after the last.
    pub fn update(&mut self, s: &SafetySample, dt: f64, report: &mut impl FnMut(Watched)) {
        let t = self.thresholds;
        let saturated = self.saturated.update(s.saturated.is_some_and(|m| m != 0), t.tau_sat_time, dt);
        let conditions = [
            (saturated, Watched::TorqueSaturated),
            (s.speeds.is_some_and(|v| v.iter().any(|v| v.abs() > t.qd_max)), Watched::Overspeed),
            (s.base_speed.is_some_and(|v| v > t.base_v_max), Watched::BaseOverspeed),
            (s.temperature.is_some_and(|v| v > t.temp_max), Watched::Overtemperature),
            (s.bus_errors.is_some_and(|n| n > t.pd_err_max), Watched::BusErrors),
            (s.controller_age.is_some_and(|a| a > t.hb_timeout), Watched::ControllerLost),
        ];
        for (said, (is, what)) in self.said.iter_mut().zip(conditions) {
            if said.update(is, t.repeat, dt) {
                report(what);
            }
        }
    }

    /// Begins anew.
    pub fn reset(&mut self) {
        *self = Self { thresholds: self.thresholds, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 0.01;

    fn stats(age: f64, loss: f64) -> LinkStats {
        LinkStats { age, gap: 0.004, jitter: 0.001, loss, seq: 1 }
    }

    fn watch(w: &mut LinkWatch, s: Option<&LinkStats>, seconds: f64) -> Vec<(u32, Watched)> {
        let mut out = Vec::new();
        for i in 0..(seconds / DT).round() as u32 {
            w.update(s, None, false, DT, &mut |e| out.push((i, e)));
        }
        out
    }

    #[test]
    fn the_link_settles_degrades_and_is_lost() {
        let mut w =
            LinkWatch { thresholds: LinkThresholds { repeat: 100.0, ..Default::default() }, ..Default::default() };
        assert_eq!(watch(&mut w, None, 0.5), [(0, Watched::LinkLost)]);
        assert_eq!(watch(&mut w, Some(&stats(0.008, 0.0)), 2.0), [(99, Watched::QosOk)]);
        assert_eq!(watch(&mut w, Some(&stats(0.05, 0.0)), 0.5), [(4, Watched::QosDegraded)]);
        assert_eq!(watch(&mut w, Some(&stats(0.008, 0.0)), 1.0), [(49, Watched::QosRestored), (49, Watched::QosOk)]);
        assert_eq!(watch(&mut w, Some(&stats(0.008, 0.3)), 0.5), [(4, Watched::QosDegraded)]);
        assert_eq!(watch(&mut w, Some(&stats(0.15, 0.3)), 0.5), [(0, Watched::LinkLost)]);
        assert_eq!(watch(&mut w, Some(&stats(0.008, 0.0)), 0.9), []);
    }

    #[test]
    fn aligned_takes_both_and_time() {
        let mut w = ForceWatch::default();
        let mut seen = Vec::new();
        let ready = PeerState { aligned: true, ..PeerState::default() };
        for i in 0..100 {
            let peer = if i < 50 { PeerState::default() } else { ready };
            w.update(Some(1.0), Some(&peer), DT, &mut |e| seen.push((i, e)));
        }
        assert_eq!(seen, [(50, Watched::Aligned)]);
        seen.clear();
        for i in 0..20 {
            w.update(Some(9.0), Some(&ready), DT, &mut |e| seen.push((i, e)));
        }
        assert_eq!(seen, [(9, Watched::Misaligned)]);
        seen.clear();
        w.update(Some(26.0), Some(&ready), DT, &mut |e| seen.push((0, e)));
        assert!(seen.contains(&(0, Watched::ForceSpike)));
    }

    #[test]
    fn safety_conditions() {
        let mut w = SafetyWatch::default();
        let mut seen = Vec::new();
        let calm = SafetySample { controller_age: Some(0.001), saturated: Some(0), ..Default::default() };
        w.update(&calm, 0.005, &mut |e| seen.push(e));
        w.update(&SafetySample::default(), 0.005, &mut |e| seen.push(e));
        assert_eq!(seen, []);
        for _ in 0..99 {
            w.update(&SafetySample { saturated: Some(2), ..calm }, 0.005, &mut |e| seen.push(e));
        }
        assert_eq!(seen, []);
        w.update(&SafetySample { saturated: Some(2), ..calm }, 0.005, &mut |e| seen.push(e));
        assert_eq!(seen, [Watched::TorqueSaturated]);
        w.update(&SafetySample { controller_age: Some(0.06), ..calm }, 0.005, &mut |e| seen.push(e));
        assert_eq!(seen.last(), Some(&Watched::ControllerLost));
    }
}
