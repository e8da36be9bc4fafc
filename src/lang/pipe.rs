//! What is given as a file and is none: a named pipe, a terminal. It comes when it comes, and never if nobody writes.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::os::fd::AsRawFd;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::Duration;

/// It is read as it comes, and waited for no longer than that at a time.
pub struct Pipe {
    file: File,
    wait: Duration,
}

impl Pipe {
    /// Opened whether or not somebody writes.
    pub fn open(path: &Path, wait: Duration) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).custom_flags(libc::O_NONBLOCK).open(path)?;
        Ok(Self { file, wait })
    }

    /// Waits until there is something to be read, or there will be nothing more.
    fn wait(&self) -> io::Result<()> {
        let mut poll = libc::pollfd { fd: self.file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
        let wait = libc::c_int::try_from(self.wait.as_millis()).unwrap_or(libc::c_int::MAX);
        // SAFETY: one descriptor, which is open as long as `self`, and a list of that length.
        match unsafe { libc::poll(&raw mut poll, 1, wait) } {
            0 => {
                let why = format!("nobody has written anything into it for {} s", self.wait.as_secs());
                Err(io::Error::new(ErrorKind::TimedOut, why))
            }
            1.. => Ok(()),
            _ => Err(io::Error::last_os_error()),
        }
    }
}

impl Read for Pipe {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        loop {
            // Asked first: of a pipe that nobody has opened yet it would be read that it is at its end.
            self.wait()?;
            match self.file.read(bytes) {
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                read => return read,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CString;
    use std::io::Write;
    use std::thread;

    fn pipe(folder: &Path) -> std::path::PathBuf {
        let path = folder.join("pipe");
        let name = CString::new(path.as_os_str().as_encoded_bytes()).unwrap();
        // SAFETY: the name ends with a zero.
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        path
    }

    #[test]
    fn a_pipe_that_nobody_writes_is_not_waited_for_without_end() {
        let folder = tempfile::tempdir().unwrap();
        let mut text = String::new();
        let mut nobody = Pipe::open(&pipe(folder.path()), Duration::from_millis(1)).unwrap();
        let error = nobody.read_to_string(&mut text).unwrap_err();
        assert_eq!((error.kind(), text.as_str()), (ErrorKind::TimedOut, ""));
    }

    #[test]
    fn what_is_written_into_a_pipe_by_and_by_is_read_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = pipe(folder.path());
        let mut read = Pipe::open(&path, Duration::from_secs(60)).unwrap();
        let writer = thread::spawn(move || {
            let mut file = OpenOptions::new().write(true).open(path).unwrap();
            let part = "a line\n".repeat(20_000);
            (0..3).for_each(|_| file.write_all(part.as_bytes()).unwrap());
        });
        let mut text = String::new();
        read.read_to_string(&mut text).unwrap();
        writer.join().unwrap();
        assert_eq!(text, "a line\n".repeat(60_000));
    }
}
