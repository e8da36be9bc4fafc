//! A packet as it goes over UDP: 101 bytes, numbers with the lowest byte first, in the order of [`Packet`]'s fields behind four bytes that
//! say what it is and of which version.

use super::link::{Echo, Packet};
use std::io;
use std::net::{SocketAddr, UdpSocket};

/// What it begins with.
const MAGIC: [u8; 4] = *b"dvt1";
/// Its length.
pub const LENGTH: usize = 4 + 5 * 8 + 6 * 8 + 1 + 8;

/// A packet as bytes.
pub fn bytes_of(packet: &Packet) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let mut at = 0;
    let mut put = |part: &[u8]| {
        bytes[at..at + part.len()].copy_from_slice(part);
        at += part.len();
    };
    put(&MAGIC);
    for whole in [packet.epoch, packet.seq, packet.stamp, packet.echo.stamp, packet.echo.heard] {
        put(&whole.to_le_bytes());
    }
    for number in packet.p.iter().chain(&packet.v) {
        put(&number.to_le_bytes());
    }
    put(&[u8::from(packet.aligned) | u8::from(packet.copying) << 1 | u8::from(packet.yields) << 2]);
    put(&packet.energy.to_le_bytes());
    bytes
}

/// Restarts and moments (ns) are smaller: 36 years. So nothing that is counted with them overflows.
const FARTHEST: i64 = 1 << 60;
/// Positions, velocities and energies are smaller.
const LARGEST: f64 = 1e9;

/// What bytes say; none where they are no packet: of another length or version, with a bit that means nothing, or a number that is none, or
/// none of a robot's.
pub fn packet_of(bytes: &[u8]) -> Option<Packet> {
    let mut rest = bytes.strip_prefix(&MAGIC).filter(|_| bytes.len() == LENGTH)?;
    let mut eight = || {
        let (part, after) = rest.split_first_chunk::<8>()?;
        rest = after;
        Some(*part)
    };
    let mut whole = || eight().map(i64::from_le_bytes).filter(|whole| whole.abs_diff(0) < FARTHEST.unsigned_abs());
    let (epoch, seq, stamp, echo) = (whole()?, whole()?, whole()?, Echo { stamp: whole()?, heard: whole()? });
    // Not a number is not smaller than anything.
    let is_one = |number: &f64| number.abs() < LARGEST;
    let mut number = || eight().map(f64::from_le_bytes).filter(is_one);
    let (p, v) = ([number()?, number()?, number()?], [number()?, number()?, number()?]);
    let (flags, after) = rest.split_first()?;
    let energy = f64::from_le_bytes(after.try_into().ok()?);
    let is = |bit: u8| flags & 1 << bit != 0;
    let known = *flags < 8 && is_one(&energy) && epoch >= 0 && seq >= 0;
    known.then_some(Packet { epoch, seq, stamp, echo, p, v, aligned: is(0), copying: is(1), yields: is(2), energy })
}

/// What became of a datagram that came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Received {
    /// It is one.
    Packet(Packet),
    /// It is no packet.
    Refused,
}

/// One end of a link: sends to one address, and hears it alone.
#[derive(Debug)]
pub struct DatagramLink(UdpSocket);

impl DatagramLink {
    /// Binds to an address and connects to another one; nobody is waited for.
    ///
    /// # Errors
    /// What the system says, with the address.
    pub fn open(bind: &str, peer: &str) -> Result<Self, String> {
        let address = |text: &str, what: &str| {
            let wrong = || {
                format!(
                    "`{text}` is no address ({what}): write `127.0.0.1:4000` or `[::1]:4000`; names are not looked up"
                )
            };
            text.parse::<SocketAddr>().map_err(|_| wrong())
        };
        let (own, other) = (address(bind, "bind")?, address(peer, "peer")?);
        let said = |what: &str, error: io::Error| format!("{what}: {error}");
        if own.port() == 0 {
            return Err(format!("{own} has no port that anybody could send to (bind)"));
        }
        if other.ip().is_unspecified() || other.ip().is_multicast() || other.port() == 0 {
            return Err(format!("{other} is no address of one other end (peer)"));
        }
        let socket = UdpSocket::bind(own).map_err(|error| said(&format!("cannot bind to {own}"), error))?;
        socket.connect(other).map_err(|error| said(&format!("cannot send to {other}"), error))?;
        // One bound to every address of the machine is known by the one that leads there from now on.
        if socket.local_addr().is_ok_and(|own| own == other) {
            return Err(format!("{other} is its own address (peer): it would hear itself"));
        }
        socket.set_nonblocking(true).map_err(|error| said("the socket cannot be asked without waiting", error))?;
        Ok(Self(socket))
    }

    /// Sends a packet, if that goes without waiting. False: it is lost, as packets are.
    pub fn send(&self, packet: &Packet) -> bool {
        self.0.send(&bytes_of(packet)).is_ok()
    }

    /// What has come; none: nothing (more). That nobody listens at the other end, which a system may tell here, is nothing.
    pub fn receive(&self) -> Option<Received> {
        let mut bytes = [0; LENGTH + 1];
        let length = self.0.recv(&mut bytes).ok()?;
        Some(packet_of(&bytes[..length]).map_or(Received::Refused, Received::Packet))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn packet() -> Packet {
        let echo = Echo { stamp: -7, heard: FARTHEST - 1 };
        let (p, v) = ([0.1, -0.2, 1e-300], [0.999e9, -0.0, 3.5]);
        Packet {
            epoch: 3,
            seq: 9,
            stamp: 1 << 40,
            echo,
            p,
            v,
            aligned: true,
            copying: false,
            yields: true,
            energy: -2.5,
        }
    }

    #[test]
    fn a_packet_comes_back_as_it_went() {
        assert_eq!(packet_of(&bytes_of(&packet())), Some(packet()));
        assert_eq!(packet_of(&bytes_of(&Packet::default())), Some(Packet::default()));
    }

    #[test]
    fn what_is_no_packet_is_refused() {
        let good = bytes_of(&packet());
        let with = |at: usize, byte: u8| {
            let mut bytes = good;
            bytes[at] = byte;
            packet_of(&bytes)
        };
        assert_eq!(packet_of(&good[..LENGTH - 1]), None);
        assert_eq!(packet_of(&[&good[..], &[0]].concat()), None);
        assert_eq!(with(3, b'2'), None, "of another version");
        assert_eq!(with(LENGTH - 9, 8), None, "a bit that means nothing");
        let eight = |at: usize, part: [u8; 8]| {
            let mut bytes = good;
            bytes[at..at + 8].copy_from_slice(&part);
            packet_of(&bytes)
        };
        for number in [f64::NAN, f64::INFINITY, -1e9] {
            assert_eq!(eight(44, number.to_le_bytes()), None, "{number}");
            assert_eq!(eight(LENGTH - 8, number.to_le_bytes()), None, "{number}");
        }
        // An epoch, a number and three moments.
        for (at, least) in [(4, 0), (12, 0), (20, -FARTHEST + 1), (28, -FARTHEST + 1), (36, -FARTHEST + 1)] {
            assert!(eight(at, least.to_le_bytes()).is_some() && eight(at, (FARTHEST - 1).to_le_bytes()).is_some());
            for whole in [i64::MIN, least - 1, FARTHEST, i64::MAX] {
                assert_eq!(eight(at, whole.to_le_bytes()), None, "{whole} at {at}");
            }
        }
    }

    proptest! {
        #[test]
        fn no_bytes_are_more_than_a_packet(bytes in proptest::collection::vec(any::<u8>(), 0..200), magic in any::<bool>()) {
            let mut bytes = bytes;
            if magic && bytes.len() >= 4 {
                bytes[..4].copy_from_slice(&MAGIC);
                bytes.resize(LENGTH, 0);
            }
            if let Some(packet) = packet_of(&bytes) {
                prop_assert_eq!(&bytes_of(&packet)[..], &bytes[..]);
            }
        }
    }

    #[test]
    fn two_ends_hear_each_other_and_an_address_is_had_once() {
        // The system gives the ports; the second end is told the first one's.
        let free = || UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
        let (left, right) = (free(), free());
        let (one, two) = (DatagramLink::open(&left, &right).unwrap(), DatagramLink::open(&right, &left).unwrap());
        assert!(one.send(&packet()));
        assert_eq!(two.receive(), Some(Received::Packet(packet())));
        assert_eq!(two.receive(), None);
        two.0.send(b"hello").unwrap();
        assert_eq!(one.receive(), Some(Received::Refused));
        let error = DatagramLink::open(&left, &right).unwrap_err();
        assert!(error.starts_with(&format!("cannot bind to {left}: ")), "{error}");
        let own = free();
        for (bind, peer) in [(own.clone(), own.clone()), (own.replace("127.0.0.1", "0.0.0.0"), own.clone())] {
            assert!(DatagramLink::open(&bind, &peer).unwrap_err().ends_with("it would hear itself"), "{bind} {peer}");
        }
        for nobody in ["0.0.0.0:4000", "224.0.0.1:4000", "127.0.0.1:0"] {
            let error = DatagramLink::open(&own, nobody).unwrap_err();
            assert!(error.ends_with("is no address of one other end (peer)"), "{error}");
        }
        assert!(DatagramLink::open("127.0.0.1:0", &own).unwrap_err().ends_with("(bind)"));
        assert!(DatagramLink::open("here", &right).unwrap_err().contains("`here` is no address (bind)"));
    }
}
