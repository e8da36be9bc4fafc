//! Who owns a deployment's name: the process that holds its lock.
//!
//! The lock is a socket in the abstract namespace that belongs to the name, the user and the directory of the control sockets.
//! No file stands for it, so nobody can remove it (a logout that clears the runtime directory does not), it is there from the
//! moment it is taken, and it ends with its process, however that ends. Nothing is ever sent over it.

use super::place;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

/// Bytes that an address may have.
const LONGEST: usize = 100;

/// The lock of a name, held.
#[derive(Debug)]
pub struct Owner {
    _held: UnixDatagram,
}

impl Owner {
    /// Takes the lock of a name; none when another process holds it.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn of(name: &str) -> io::Result<Option<Self>> {
        match UnixDatagram::bind_addr(&address(name)?) {
            Ok(held) => Ok(Some(Self { _held: held })),
            Err(error) if error.kind() == io::ErrorKind::AddrInUse => Ok(None),
            Err(error) => Err(error),
        }
    }
}

/// Whether a process holds the lock of a name.
pub fn is_owned(name: &str) -> bool {
    let look = || UnixDatagram::unbound()?.connect_addr(&address(name)?);
    look().is_ok()
}

/// The names whose locks are held, in alphabetical order.
pub fn owned() -> Vec<String> {
    let Ok(sockets) = std::fs::read_to_string("/proc/net/unix") else { return Vec::new() };
    let prefix = format!("@{}", prefix());
    let mut names: Vec<String> = sockets
        .lines()
        .filter_map(|line| line.split_whitespace().last()?.strip_prefix(&prefix).map(str::to_owned))
        // One too long to be listed goes by its number.
        .filter(|name| !name.starts_with('#'))
        .collect();
    names.sort();
    names.dedup();
    names
}

fn prefix() -> String {
    let user = place::user();
    let directory = place::directory();
    let directory = std::path::absolute(&directory).unwrap_or(directory);
    format!("davit/{user}/{:016x}/", number(directory.as_os_str().as_encoded_bytes()))
}

fn address(name: &str) -> io::Result<SocketAddr> {
    let prefix = prefix();
    let own = if prefix.len() + name.len() > LONGEST {
        format!("#{:016x}", number(name.as_bytes()))
    } else {
        name.to_owned()
    };
    SocketAddr::from_abstract_name(prefix + &own)
}

/// FNV-1a: the same in every build, which both ends need not share.
fn number(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3))
}
