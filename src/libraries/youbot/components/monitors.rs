//! `youbot.Link_Monitor`, `youbot.Force_Monitor`, `youbot.Safety_Monitor`: conditions over time, raised as events.
//!
//! What lasts is said again every `repeat` seconds: a coordinator that was elsewhere when it began still hears of it.

use super::aged;
use super::samples::{DriverState, JointState, MotorStates, Odometry};
use crate::libraries::youbot::link::{LinkStats, PeerState};
use crate::libraries::youbot::watch::{
    ForceThresholds, ForceWatch, LinkThresholds, LinkWatch, SafetySample, SafetyThresholds, SafetyWatch, Watched,
};
use crate::model::EventName;
use crate::runtime::{Builder, Component, Context, EventOut, In, Out, Prop};

/// Events by what they tell.
struct Names([(Watched, EventName); 14]);

impl Names {
    fn new<C: Component>(b: &Builder<C>) -> Self {
        Self(
            [
                (Watched::QosOk, "e_qos_ok"),
                (Watched::QosDegraded, "e_qos_degraded"),
                (Watched::QosRestored, "e_qos_restored"),
                (Watched::LinkLost, "e_link_lost"),
                (Watched::PeerLeft, "e_peer_left"),
                (Watched::Aligned, "e_aligned"),
                (Watched::Misaligned, "e_misaligned"),
                (Watched::ForceSpike, "e_force_spike"),
                (Watched::TorqueSaturated, "e_torque_sat"),
                (Watched::Overspeed, "e_overspeed"),
                (Watched::BaseOverspeed, "e_base_overspeed"),
                (Watched::Overtemperature, "e_OVERTEMP"),
                (Watched::BusErrors, "e_EC_TIMEOUT"),
                (Watched::ControllerLost, "e_controller_lost"),
            ]
            .map(|(what, name)| (what, b.event(name))),
        )
    }

    fn raise(&self, what: Watched, events: &mut EventOut) {
        for (watched, event) in &self.0 {
            if *watched == what {
                events.raise(*event);
            }
        }
    }
}

/// Watches the link.
pub struct LinkMonitor {
    link_stats: In<LinkStats>,
    peer_state: In<PeerState>,
    copying: In<bool>,
    events: EventOut,
    age_ok: Prop<f64>,
    age_degraded: Prop<f64>,
    age_lost: Prop<f64>,
    gap_degraded: Prop<f64>,
    gap_lost: Prop<f64>,
    jitter_ok: Prop<f64>,
    jitter_degraded: Prop<f64>,
    loss_ok: Prop<f64>,
    loss_degraded: Prop<f64>,
    loss_lost: Prop<f64>,
    t_degraded: Prop<f64>,
    t_restore: Prop<f64>,
    t_settle: Prop<f64>,
    t_peer: Prop<f64>,
    repeat: Prop<f64>,
    names: Names,
    watch: LinkWatch,
}

impl Component for LinkMonitor {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Raises e_qos_ok when the link has been good for t_settle, e_qos_degraded and e_qos_restored, e_link_lost, \
             e_peer_left when the other robot is not with us any more.",
        )
        .on_start(|c, _| {
            c.watch.reset();
            Ok(())
        });
        let t = LinkThresholds::default();
        let mut seconds =
            |name: &str, doc: &str, default: f64| b.doc(doc).unit("s").range(0.0..=60.0).property(name, default);
        let age_ok = seconds("age_ok", "Age of the newest sample up to which the link is good.", t.age_ok);
        let age_degraded = seconds("age_degraded", "Age from which it is degraded.", t.age_degraded);
        let age_lost = seconds("age_lost", "Age from which it is lost.", t.age_lost);
        let gap_degraded = seconds("gap_degraded", "Silence from which it is degraded.", t.gap_degraded);
        let gap_lost = seconds("gap_lost", "Silence from which it is lost.", t.gap_lost);
        let jitter_ok = seconds("jitter_ok", "Jitter up to which it is good.", t.jitter_ok);
        let jitter_degraded = seconds("jitter_degraded", "Jitter from which it is degraded.", t.jitter_degraded);
        let t_degraded = seconds("t_degraded", "How long until it is called degraded.", t.t_degraded);
        let t_restore = seconds("t_restore", "How long it must be good again.", t.t_restore);
        let t_settle = seconds("t_settle", "How long it must be good at first.", t.t_settle);
        let t_peer = seconds("t_peer", "How long the peer may disagree.", t.t_peer);
        let repeat = seconds("repeat", "How often what lasts is said again.", t.repeat);
        let mut share = |name: &str, doc: &str, default: f64| b.doc(doc).range(0.0..=1.0).property(name, default);
        let loss_ok = share("loss_ok", "Loss up to which it is good.", t.loss_ok);
        let loss_degraded = share("loss_degraded", "Loss from which it is degraded.", t.loss_degraded);
        let loss_lost = share("loss_lost", "Loss from which it is lost.", t.loss_lost);
        Self {
            link_stats: b.doc("How good the link is.").input("link_stats"),
            peer_state: b.doc("What the other robot says of itself.").input("peer_state"),
            copying: b.doc("Whether our coupling is engaged.").input("copying"),
            events: b.doc("What it found.").event_output("events"),
            age_ok,
            age_degraded,
            age_lost,
            gap_degraded,
            gap_lost,
            jitter_ok,
            jitter_degraded,
            loss_ok,
            loss_degraded,
            loss_lost,
            t_degraded,
            t_restore,
            t_settle,
            t_peer,
            repeat,
            names: Names::new(b),
            watch: LinkWatch::default(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        self.watch.thresholds = LinkThresholds {
            age_ok: self.age_ok.get(),
            age_degraded: self.age_degraded.get(),
            age_lost: self.age_lost.get(),
            gap_degraded: self.gap_degraded.get(),
            gap_lost: self.gap_lost.get(),
            jitter_ok: self.jitter_ok.get(),
            jitter_degraded: self.jitter_degraded.get(),
            loss_ok: self.loss_ok.get(),
            loss_degraded: self.loss_degraded.get(),
            loss_lost: self.loss_lost.get(),
            t_degraded: self.t_degraded.get(),
            t_restore: self.t_restore.get(),
            t_settle: self.t_settle.get(),
            t_peer: self.t_peer.get(),
            repeat: self.repeat.get(),
        };
        // Statistics that are not renewed any more are those of a receiver that has stopped.
        let stats = aged(&mut self.link_stats, cx).map(|(mut stats, age)| {
            stats.age += age;
            stats.gap += age;
            stats
        });
        let peer = self.peer_state.get();
        let copying = self.copying.get().unwrap_or(false);
        let (names, events) = (&self.names, &mut self.events);
        self.watch.update(stats.as_ref(), peer.as_ref(), copying, cx.dt(), &mut |what| names.raise(what, events));
    }
}

/// Watches the wanted force.
pub struct ForceMonitor {
    f_raw_norm: In<f64>,
    peer_state: In<PeerState>,
    aligned: Out<bool>,
    events: EventOut,
    f_on: Prop<f64>,
    f_off: Prop<f64>,
    t_hold: Prop<f64>,
    t_off: Prop<f64>,
    f_spike: Prop<f64>,
    f_jump: Prop<f64>,
    repeat: Prop<f64>,
    names: Names,
    watch: ForceWatch,
}

/// A wanted force or a peer's word older than this is none, in s.
const STALE: f64 = 0.2;

impl Component for ForceMonitor {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Raises e_aligned when the wanted force of both robots is small, e_misaligned when ours is large, \
             e_force_spike when somebody pushes hard or the reference jumps.",
        )
        .on_start(|c, _| {
            c.watch.reset();
            Ok(())
        });
        let t = ForceThresholds::default();
        let mut newtons =
            |name: &str, doc: &str, default: f64| b.doc(doc).unit("N").range(0.0..=200.0).property(name, default);
        let f_on = newtons("f_on", "Below it we are aligned.", t.f_on);
        let f_off = newtons("f_off", "Above it we are not.", t.f_off);
        let f_spike = newtons("f_spike", "A spike.", t.f_spike);
        let f_jump = newtons("f_jump", "A jump within 10 ms.", t.f_jump);
        let mut seconds =
            |name: &str, doc: &str, default: f64| b.doc(doc).unit("s").range(0.0..=60.0).property(name, default);
        let t_hold = seconds("t_hold", "How long below f_on.", t.t_hold);
        let t_off = seconds("t_off", "How long above f_off.", t.t_off);
        let repeat = seconds("repeat", "How often what lasts is said again.", t.repeat);
        Self {
            f_raw_norm: b.doc("Norm of the wanted force.").unit("N").input("f_raw_norm"),
            peer_state: b.doc("What the other robot says of itself.").input("peer_state"),
            aligned: b.doc("Whether our wanted force has been small for long enough.").output("aligned"),
            events: b.doc("What it found.").event_output("events"),
            f_on,
            f_off,
            t_hold,
            t_off,
            f_spike,
            f_jump,
            repeat,
            names: Names::new(b),
            watch: ForceWatch::default(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        self.watch.thresholds = ForceThresholds {
            f_on: self.f_on.get(),
            f_off: self.f_off.get(),
            t_hold: self.t_hold.get(),
            t_off: self.t_off.get(),
            f_spike: self.f_spike.get(),
            f_jump: self.f_jump.get(),
            repeat: self.repeat.get(),
        };
        let force = aged(&mut self.f_raw_norm, cx).filter(|(_, age)| *age <= STALE).map(|(f, _)| f);
        let peer = aged(&mut self.peer_state, cx).filter(|(_, age)| *age <= STALE).map(|(p, _)| p);
        let (names, events) = (&self.names, &mut self.events);
        self.watch.update(force, peer.as_ref(), cx.dt(), &mut |what| names.raise(what, events));
        self.aligned.write(self.watch.aligned);
    }
}

/// Watches what must not happen.
pub struct SafetyMonitor {
    jointstate: In<JointState>,
    odometry: In<Odometry>,
    motor_states: In<MotorStates>,
    driver_state: In<DriverState>,
    tau_sat: In<u8>,
    controller: In<f64>,
    events: EventOut,
    qd_max: Prop<f64>,
    tau_sat_time: Prop<f64>,
    temp_max: Prop<f64>,
    pd_err_max: Prop<i64>,
    base_v_max: Prop<f64>,
    hb_timeout: Prop<f64>,
    repeat: Prop<f64>,
    names: Names,
    watch: SafetyWatch,
}

impl Component for SafetyMonitor {
    fn new(b: &mut Builder<Self>) -> Self {
        let t = SafetyThresholds::default();
        b.describe(
            "Raises e_torque_sat, e_overspeed, e_base_overspeed, e_OVERTEMP, e_EC_TIMEOUT, and e_controller_lost when the \
             impedance controller is not heard for hb_timeout.",
        )
        .on_start(|c, _| {
            c.watch.reset();
            Ok(())
        });
        Self {
            jointstate: b.doc("What the joints measure.").input("jointstate"),
            odometry: b.doc("How the base moves.").input("odometry"),
            motor_states: b.doc("How the motors are.").input("motor_states"),
            driver_state: b.doc("How the field bus is.").input("driver_state"),
            tau_sat: b.doc("Joints at their torque limit.").input("tau_sat"),
            controller: b.doc("Something the impedance controller writes in every update.").input("controller"),
            events: b.doc("What it found.").event_output("events"),
            qd_max: b.doc("Joint speed.").unit("rad/s").range(0.0..=10.0).property("qd_max", t.qd_max),
            tau_sat_time: b
                .doc("How long a joint may be at its torque limit.")
                .unit("s")
                .range(0.0..=60.0)
                .property("tau_sat_time", t.tau_sat_time),
            temp_max: b.doc("Motor temperature.").unit("degC").range(0.0..=150.0).property("temp_max", t.temp_max),
            pd_err_max: b.doc("Bus errors.").range(0.0..=1e6).property("pd_err_max", t.pd_err_max),
            base_v_max: b.doc("Base speed.").unit("m/s").range(0.0..=2.0).property("base_v_max", t.base_v_max),
            hb_timeout: b
                .doc("How long the controller may be silent.")
                .unit("s")
                .range(0.005..=10.0)
                .property("hb_timeout", t.hb_timeout),
            repeat: b
                .doc("How often what lasts is said again.")
                .unit("s")
                .range(0.0..=60.0)
                .property("repeat", t.repeat),
            names: Names::new(b),
            watch: SafetyWatch::default(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        self.watch.thresholds = SafetyThresholds {
            qd_max: self.qd_max.get(),
            base_v_max: self.base_v_max.get(),
            tau_sat_time: self.tau_sat_time.get(),
            temp_max: self.temp_max.get(),
            pd_err_max: self.pd_err_max.get(),
            hb_timeout: self.hb_timeout.get(),
            repeat: self.repeat.get(),
        };
        let sample = SafetySample {
            speeds: self.jointstate.get().map(|j| j.vel),
            base_speed: self.odometry.get().map(|o| o.vx.hypot(o.vy)),
            saturated: self.tau_sat.get(),
            temperature: self.motor_states.get().map(|m| m.temp.iter().copied().fold(f64::MIN, f64::max)),
            bus_errors: self.driver_state.get().map(|d| d.pd_send_err.saturating_add(d.pd_recv_err)),
            controller_age: aged(&mut self.controller, cx).map(|(_, age)| age),
        };
        let (names, events) = (&self.names, &mut self.events);
        self.watch.update(&sample, cx.dt(), &mut |what| names.raise(what, events));
    }
}
