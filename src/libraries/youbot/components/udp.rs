//! `youbot.Udp`: a robot's end of the network, over UDP.

use super::net_faults::offer_network_faults;
use crate::libraries::youbot::datagram::{DatagramLink, Received};
use crate::libraries::youbot::link::Packet;
use crate::libraries::youbot::network::{Network, NetworkFaults, Quality};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, In, Out, Prop};

/// Datagrams that are read in one step; what is more waits in the socket.
const A_STEP: usize = 64;
/// Old datagrams that are thrown away when it starts.
const STALE: usize = 4096;

crate::runtime::record! {
    /// What became of packets and datagrams so far.
    #[derive(Copy, Default)]
    pub struct DatagramCounts {
        /// Packets sent.
        pub sent: i64,
        /// Packets that the system did not take.
        pub unsent: i64,
        /// Packets received.
        pub received: i64,
        /// Datagrams that are no packets.
        pub refused: i64,
    }
}

/// The component.
pub struct Udp {
    rx: In<Packet>,
    tx: Out<Packet>,
    counts: Out<DatagramCounts>,
    bind: Prop<String>,
    peer: Prop<String>,
    link: Option<DatagramLink>,
    counted: DatagramCounts,
    /// What is wrong with the network, for what is sent; what is lost there was never given to the socket.
    faults: NetworkFaults,
    outgoing: Network<Packet>,
}

impl Component for Udp {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "A robot's end of the network, over UDP: what its Link_Tx sends goes to `peer`, and what `peer` sends to its Link_Rx, in steps of \
             its activity's period. Never waits. On the simulated clock packets take no time. Faults that are injected are of what it sends.",
        )
        .exclusive("udp:{bind}")
        .on_configure(|c, _| {
            c.link = Some(DatagramLink::open(c.bind.get_ref(), c.peer.get_ref())?);
            c.counted = DatagramCounts::default();
            // Each end has a luck of its own.
            let seed = c.bind.get_ref().bytes().fold(0, |sum: u64, byte| sum.wrapping_mul(31).wrapping_add(byte.into()));
            c.outgoing = Network::new(Quality::default(), seed);
            Ok(())
        })
        .on_start(|c, _| {
            c.outgoing.clear();
            // What came while nobody listened is old; who sends without end is not waited for.
            if let Some(link) = &c.link {
                std::iter::from_fn(|| link.receive()).take(STALE).for_each(drop);
            }
            Ok(())
        })
        .on_cleanup(|c, _| {
            c.link = None;
            Ok(())
        });
        offer_network_faults(b, |c| &mut c.faults);
        Self {
            rx: b.doc("Packets from Link_Tx of its robot.").buffered().required().input("rx"),
            tx: b.doc("Packets for Link_Rx of its robot, for a buffered connection.").output("tx"),
            counts: b.doc("What became of packets and datagrams since it was configured.").output("counts"),
            bind: b
                .doc("Address and port that it has, `127.0.0.1:4000`.")
                .tunable(Tunable::Unconfigured)
                .property("bind", "127.0.0.1:4000".to_owned()),
            peer: b
                .doc("Address and port of the other robot's end; nobody else is heard.")
                .tunable(Tunable::Unconfigured)
                .property("peer", "127.0.0.1:4001".to_owned()),
            link: None,
            counted: DatagramCounts::default(),
            faults: NetworkFaults::default(),
            outgoing: Network::new(Quality::default(), 1),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(link) = &self.link else { return };
        let now = cx.now().as_secs_f64();
        self.outgoing.quality = self.faults.over(cx.now(), Quality::default());
        while let Some(packet) = self.rx.take() {
            self.outgoing.send(now, self.faults.sent_for(cx.now(), packet));
        }
        while let Some(packet) = self.outgoing.receive(now) {
            let sent = if link.send(&packet) { &mut self.counted.sent } else { &mut self.counted.unsent };
            *sent += 1;
        }
        for received in std::iter::from_fn(|| link.receive()).take(A_STEP) {
            match received {
                Received::Packet(packet) => {
                    self.tx.write(packet);
                    self.counted.received += 1;
                }
                Received::Refused => self.counted.refused += 1,
            }
        }
        self.counts.write(self.counted);
    }
}
