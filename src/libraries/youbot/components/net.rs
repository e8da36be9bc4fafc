//! `youbot.Net`: one direction of the network between the two robots; and its properties, which the stand-in for the other
//! robot has as well.

use super::net_faults::offer_network_faults;
use crate::libraries::youbot::link::{Echo, Packet};
use crate::libraries::youbot::network::{Network, NetworkCounts, NetworkFaults, Quality, WAITING};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, In, OperationAnswer, Out, Prop};
use crate::time::Time;

/// How a network is doing: as its properties say, but for what was injected.
pub(super) struct NetworkProperties {
    delay: Prop<f64>,
    jitter: Prop<f64>,
    reorder: Prop<f64>,
    duplicate: Prop<f64>,
    loss: Prop<f64>,
    burst_begin: Prop<f64>,
    burst_end: Prop<f64>,
    burst_loss: Prop<f64>,
    rate: Prop<f64>,
    cut: Prop<bool>,
    clock_offset: Prop<f64>,
    clock_drift: Prop<f64>,
    seed: Prop<i64>,
    pub(super) faults: NetworkFaults,
}

impl NetworkProperties {
    pub(super) fn declare<C: Component>(b: &mut Builder<C>, own: fn(&mut C) -> &mut Self) -> Self {
        offer_network_faults(b, move |c| &mut own(c).faults);
        let q = Quality::default();
        Self {
            delay: b.doc("One way.").unit("s").range(0.0..=1.0).property("delay", 0.002),
            jitter: b
                .doc("Added to the delay, evenly spread up to this, with the order kept.")
                .unit("s")
                .range(0.0..=1.0)
                .property("jitter", q.jitter),
            reorder: b
                .doc("Share of packets that take 10 ms longer: later ones may come before them.")
                .range(0.0..=1.0)
                .property("reorder", q.reorder),
            duplicate: b.doc("Share of packets that come twice.").range(0.0..=1.0).property("duplicate", q.duplicate),
            loss: b.doc("Share of packets lost, one by one.").range(0.0..=1.0).property("loss", q.loss),
            burst_begin: b
                .doc("Share of packets with which a bad time begins (Gilbert and Elliott).")
                .range(0.0..=1.0)
                .property("burst_begin", q.burst_begin),
            burst_end: b
                .doc("Share of packets of a bad time with which it ends: 1 over its mean length.")
                .range(0.001..=1.0)
                .property("burst_end", q.burst_end),
            burst_loss: b
                .doc("Share of packets lost in a bad time, instead of loss.")
                .range(0.0..=1.0)
                .property("burst_loss", q.burst_loss),
            rate: b
                .doc(&format!("Packets a second that get through; {WAITING} more wait, others are lost. 0: any number."))
                .unit("1/s")
                .range(0.0..=100_000.0)
                .property("rate", q.rate),
            cut: b.doc("Nothing gets through. What is under way already arrives.").property("cut", q.cut),
            clock_offset: b
                .doc("The receiver's clock minus the sender's: packets bring moments of the sender's. The other direction has the negative.")
                .unit("s")
                .range(-1e6..=1e6)
                .property("clock_offset", 0.0),
            clock_drift: b
                .doc("How much faster the receiver's clock is, in millionths. The other direction has the negative.")
                .range(-500.0..=500.0)
                .property("clock_drift", 0.0),
            seed: b.doc("Of the network's luck.").tunable(Tunable::Unconfigured).property("seed", 1_i64),
            faults: NetworkFaults::default(),
        }
    }

    pub(super) fn quality(&mut self, now: Time) -> Quality {
        let should = Quality {
            delay: self.delay.get(),
            jitter: self.jitter.get(),
            reorder: self.reorder.get(),
            duplicate: self.duplicate.get(),
            loss: self.loss.get(),
            burst_begin: self.burst_begin.get(),
            burst_end: self.burst_end.get(),
            burst_loss: self.burst_loss.get(),
            rate: self.rate.get(),
            cut: self.cut.get(),
        };
        self.faults.over(now, should)
    }

    pub(super) fn seed(&mut self) -> u64 {
        self.seed.get().unsigned_abs()
    }

    /// The receiver's clock minus the sender's at `now` (s), in ns.
    #[allow(clippy::cast_possible_truncation)]
    pub(super) fn clock_difference(&mut self, now: f64) -> i64 {
        ((self.clock_offset.get() + now * self.clock_drift.get() * 1e-6) * 1e9) as i64
    }
}

/// `packet` as a receiver sees it whose clock is so much (ns) ahead of the sender's. Both robots run on the simulation's
/// clock, so the receiver's is the reference: all moments are moved, those of the receiver's own that come back as well, since it is with
/// moved ones that the sender has heard of them.
pub(super) fn seen_by(mut packet: Packet, ahead: i64) -> Packet {
    packet.stamp -= ahead;
    if packet.echo != Echo::default() {
        packet.echo.stamp -= ahead;
        packet.echo.heard -= ahead;
    }
    packet
}

/// The component.
pub struct Net {
    rx: In<Packet>,
    tx: Out<Packet>,
    counts: Out<NetworkCounts>,
    properties: NetworkProperties,
    network: Network<Packet>,
}

impl Component for Net {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "One direction of the network between two robots, in steps of its activity's period: it delays, jitters, reorders, \
             duplicates, loses one by one and in bursts, is slow, and can be cut; what it does is decided by the seed.",
        )
        .on_configure(|c, _| {
            c.network = Network::new(Quality::default(), c.properties.seed());
            Ok(())
        })
        .on_stop(|c, _| {
            c.network.clear();
            Ok(())
        });
        b.doc("Loses what is under way.").no_effect().operation("clear", |c, _, (): ()| {
            c.network.clear();
            OperationAnswer::Done(())
        });
        Self {
            rx: b.doc("Packets from Link_Tx of one robot.").buffered().required().input("rx"),
            tx: b.doc("Packets for Link_Rx of the other, for a buffered connection.").output("tx"),
            counts: b.doc("What became of the packets so far.").output("counts"),
            properties: NetworkProperties::declare(b, |c| &mut c.properties),
            network: Network::new(Quality::default(), 1),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let now = cx.now().as_secs_f64();
        self.network.quality = self.properties.quality(cx.now());
        while let Some(packet) = self.rx.take() {
            self.network.send(now, self.properties.faults.sent_for(cx.now(), packet));
        }
        let ahead = self.properties.clock_difference(now);
        while let Some(packet) = self.network.receive(now) {
            self.tx.write(seen_by(packet, ahead));
        }
        self.counts.write(self.network.counts);
    }
}
