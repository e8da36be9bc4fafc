//! `youbot.Udp`: a robot's end of the network, over UDP.

use crate::libraries::youbot::datagram::{DatagramLink, Received};
use crate::libraries::youbot::link::Packet;
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
}

impl Component for Udp {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "A robot's end of the network, over UDP: what its Link_Tx sends goes to `peer`, and what `peer` sends to its Link_Rx, in steps of \
             its activity's period. Never waits. On the simulated clock packets take no time.",
        )
        .exclusive("udp:{bind}")
        .on_configure(|c, _| {
            c.link = Some(DatagramLink::open(c.bind.get_ref(), c.peer.get_ref())?);
            c.counted = DatagramCounts::default();
            Ok(())
        })
        .on_start(|c, _| {
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
        }
    }

    fn update(&mut self, _: &mut Context) {
        let Some(link) = &self.link else { return };
        while let Some(packet) = self.rx.take() {
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
