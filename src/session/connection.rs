//! One connection of the control socket: its lines, to and fro, with deadlines.

use crate::limits;
use crate::time::{Clock, lock};
use std::io::{self, Read, Write};
use std::net::Shutdown;
use std::os::fd::AsRawFd;
use std::os::unix::net::UnixStream;
use std::sync::Mutex;
use std::time::Duration;

/// A client, at the other end of a stream.
pub(super) struct SocketConnection {
    /// Its number among all, from 2 (scripts have the number 1).
    pub number: u32,
    stream: UnixStream,
    /// Held for a line: answers and notifications come from different threads.
    writing: Mutex<()>,
}

impl SocketConnection {
    /// Its client may take so long to accept what is written to it.
    pub fn new(number: u32, stream: UnixStream, write: Duration) -> io::Result<Self> {
        // A client that does not read must not hold a thread for ever.
        stream.set_write_timeout(Some(write))?;
        Ok(Self { number, stream, writing: Mutex::new(()) })
    }

    /// Sends a line. After one that did not go through the connection is closed: the next would begin in its midst.
    pub fn send(&self, line: &str) -> io::Result<()> {
        let _writing = lock(&self.writing);
        let sent = (&self.stream).write_all(format!("{line}\n").as_bytes());
        if sent.is_err() {
            self.cut();
        }
        sent
    }

    /// Closes it; whoever reads from it or writes to it returns.
    pub fn cut(&self) {
        let _ = self.stream.shutdown(Shutdown::Both);
    }

    /// Whether the client has closed its end altogether. One that only says nothing more still reads.
    pub fn is_gone(&self) -> bool {
        let mut poll = libc::pollfd { fd: self.stream.as_raw_fd(), events: 0, revents: 0 };
        // SAFETY: one descriptor, which is open as long as `self`, and no time to wait.
        let ready = unsafe { libc::poll(&raw mut poll, 1, 0) };
        ready > 0 && poll.revents & (libc::POLLHUP | libc::POLLERR) != 0
    }
}

/// What a client said next.
pub(super) enum SaidTo {
    Line(String),
    NotText,
    TooLong,
    /// Nothing, for as long as it may.
    Nothing,
    /// It is over.
    End,
}

/// The lines of a connection.
pub(super) struct Lines<'a> {
    stream: &'a UnixStream,
    clock: Clock,
    buffer: Vec<u8>,
    /// So many bytes at its beginning are known to hold no end of a line.
    seen: usize,
}

impl<'a> Lines<'a> {
    pub fn of(connection: &'a SocketConnection) -> Self {
        Lines { stream: &connection.stream, clock: Clock::real(), buffer: Vec::new(), seen: 0 }
    }

    /// The next line, if it is whole within `limit`.
    pub fn next(&mut self, limit: Option<Duration>) -> io::Result<SaidTo> {
        let deadline = limit.map(|limit| self.clock.now() + limit);
        let mut chunk = [0; 8192];
        loop {
            if let Some(end) = self.buffer[self.seen..].iter().position(|byte| *byte == b'\n') {
                let rest = self.buffer.split_off(self.seen + end + 1);
                self.seen = 0;
                return Ok(text(std::mem::replace(&mut self.buffer, rest)));
            }
            self.seen = self.buffer.len();
            if self.seen > limits::SOCKET_LINE {
                return Ok(SaidTo::TooLong);
            }
            let left = deadline.map(|deadline| deadline.since(self.clock.now()));
            if left == Some(Duration::ZERO) {
                return Ok(SaidTo::Nothing);
            }
            self.stream.set_read_timeout(left)?;
            match self.stream.read(&mut chunk) {
                Ok(0) if self.buffer.is_empty() => return Ok(SaidTo::End),
                Ok(0) => {
                    self.seen = 0;
                    return Ok(text(std::mem::take(&mut self.buffer)));
                }
                Ok(n) => self.buffer.extend_from_slice(&chunk[..n]),
                Err(e) if matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                    return Ok(SaidTo::Nothing);
                }
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
    }
}

fn text(line: Vec<u8>) -> SaidTo {
    if line.len() > limits::SOCKET_LINE {
        return SaidTo::TooLong;
    }
    String::from_utf8(line).map_or(SaidTo::NotText, SaidTo::Line)
}
