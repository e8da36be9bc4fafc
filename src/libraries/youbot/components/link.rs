//! `youbot.Link_Tx` and `youbot.Link_Rx`: the two ends of the link to the other robot.

use super::aged;
use super::samples::{ExtRef, ToolPose, ToolTwist, stamp};
use crate::libraries::youbot::link::{Echo, LinkReceiver, LinkStats, Packet, PeerState, RESTART_SHOWN};
use crate::runtime::{Builder, Component, Context, In, OperationAnswer, Out, Prop};

/// What was told longer ago is not so any more, in s: who told it (monitors every 10 ms) may be dead.
const FLAG_STALE: f64 = 0.05;

/// Whether it was told of late.
fn is_so(flag: &mut In<bool>, cx: &Context) -> bool {
    aged(flag, cx).is_some_and(|(is, age)| is && age <= FLAG_STALE)
}

/// Sends where the tool is.
pub struct LinkTx {
    tool_pose: In<ToolPose>,
    tool_twist: In<ToolTwist>,
    aligned: In<bool>,
    copying: In<bool>,
    yields: In<bool>,
    energy: In<f64>,
    echo: In<Echo>,
    tx: Out<Packet>,
    peer_addr: Prop<String>,
    period: Prop<f64>,
    epoch: Prop<i64>,
    since: f64,
    seq: i64,
}

impl Component for LinkTx {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Sends the tool's position and what this robot is doing to the other one.")
            .on_configure(|c, _| match c.peer_addr.get_ref().as_str() {
                "" => Err("there is no address of the other robot (peer_addr)".into()),
                _ => Ok(()),
            })
            .on_start(|c, _| {
                c.since = f64::INFINITY;
                c.seq = 0;
                Ok(())
            });
        Self {
            tool_pose: b.doc("Where the tool is.").input("tool_pose"),
            tool_twist: b.doc("How it moves.").input("tool_twist"),
            aligned: b.doc("Whether our wanted force is small; no longer so when 50 ms old, like the next two.").input("aligned"),
            copying: b.doc("Whether we want to be coupled.").input("copying"),
            yields: b.doc("Whether our base yields.").input("yields"),
            energy: b.doc("Energy our coupling has given to the other one so far.").unit("J").input("energy"),
            echo: b
                .doc("What Link_Rx heard last; without it the other robot cannot tell its clock from ours, and has no link.")
                .input("echo"),
            tx: b.doc("Packets, for a buffered connection.").output("tx"),
            peer_addr: b.doc("Where the other robot is.").property("peer_addr", "sim:peer".to_owned()),
            period: b.doc("Between two packets.").unit("s").range(0.001..=0.1).property("period", 0.004),
            epoch: b.doc("Tells the peer that we began anew.").min(0.0).property("epoch", 0_i64),
            since: f64::INFINITY,
            seq: 0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        self.since += cx.dt();
        // Half an update early rather than late.
        if self.since < self.period.get() - 0.5 * cx.dt() {
            return;
        }
        let (Some(pose), Some(twist)) = (self.tool_pose.get(), self.tool_twist.get()) else { return };
        self.since = 0.0;
        self.seq += 1;
        self.tx.write(Packet {
            epoch: self.epoch.get(),
            seq: self.seq,
            stamp: stamp(cx.now()),
            echo: self.echo.get().unwrap_or_default(),
            p: pose.p,
            v: twist.v,
            aligned: is_so(&mut self.aligned, cx),
            copying: is_so(&mut self.copying, cx),
            yields: is_so(&mut self.yields, cx),
            energy: self.energy.get().unwrap_or(0.0),
        });
    }
}

/// Receives where the other tool is, and measures the link.
pub struct LinkRx {
    rx: In<Packet>,
    ext_ref: Out<ExtRef>,
    link_stats: Out<LinkStats>,
    peer_state: Out<PeerState>,
    echo: Out<Echo>,
    max_seq_gap: Prop<i64>,
    window: Prop<f64>,
    receiver: LinkReceiver,
    epoch: Option<i64>,
    restarted: f64,
}

impl Component for LinkRx {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Receives the other robot's packets: the newest counts; age, gaps, jitter and loss are measured, and how the two clocks \
             differ. Before a packet went round there and back there is no reference and no link.",
        )
            .start_after("youbot.Link_Tx")
            .on_start(|c, _| {
                c.receiver.reset();
                (c.epoch, c.restarted) = (None, f64::NEG_INFINITY);
                Ok(())
            });
        b.doc("Forgets packets and measurements.").no_effect().operation("reset_stats", |c, _, (): ()| {
            c.receiver.reset();
            OperationAnswer::Done(())
        });
        Self {
            rx: b.doc("Packets.").buffered().required().input("rx"),
            ext_ref: b.doc("Where the other tool was, in moments of this robot's clock.").output("ext_ref"),
            link_stats: b.doc("How good the link is.").output("link_stats"),
            peer_state: b.doc("What the other robot says of itself.").output("peer_state"),
            echo: b.doc("What was heard last, for Link_Tx to send back.").output("echo"),
            max_seq_gap: b
                .doc("A packet so far behind means that the sender began anew.")
                .range(1.0..=10_000.0)
                .property("max_seq_gap", 50_i64),
            window: b.doc("Over how long loss is counted.").unit("s").range(0.1..=1.0).property("window", 1.0),
            receiver: LinkReceiver::default(),
            epoch: None,
            restarted: f64::NEG_INFINITY,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let now = cx.now().as_secs_f64();
        self.receiver.window = self.window.get();
        self.receiver.max_seq_gap = self.max_seq_gap.get();
        let mut news = false;
        while let Some(packet) = self.rx.take() {
            self.receiver.take(packet, now);
            news = true;
        }
        if news && let Some(p) = self.receiver.newest() {
            if let Some(sent) = self.receiver.sent() {
                #[allow(clippy::cast_possible_truncation)]
                let sent = (sent * 1e9) as i64;
                self.ext_ref.write(ExtRef { p: p.p, v: p.v, stamp: sent, coupled: p.copying, energy: p.energy });
            }
            self.echo.write(self.receiver.echo());
            if self.epoch.replace(p.epoch).is_some_and(|before| before != p.epoch) {
                self.restarted = now;
            }
            let restarted = now - self.restarted < RESTART_SHOWN;
            let Packet { epoch, aligned, copying, yields, .. } = *p;
            self.peer_state.write(PeerState { epoch, aligned, copying, yields, restarted });
        }
        if let Some(stats) = self.receiver.stats(now) {
            self.link_stats.write(stats);
        }
    }
}
