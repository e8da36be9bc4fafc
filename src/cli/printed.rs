//! What components print in a deployment in the background: caught, and told like everything else that happens.
//!
//! From the moment that it is caught on, stdout and stderr of the process are a pipe that a thread of its own reads: whoever
//! prints never waits for a disk or a terminal. The command's own words go on to who started it ([`output::speak_to`]), until it
//! is up.

use super::output;
use crate::limits;
use crate::model::finding::count;
use crate::time::{Clock, Time, lock};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Read};
use std::os::fd::{AsFd, AsRawFd};
use std::sync::{Arc, Condvar, Mutex, PoisonError};

/// Catches what is printed, until it is dropped.
pub struct Printed {
    over: Arc<(Mutex<bool>, Condvar)>,
}

impl Printed {
    /// From now on each line that is printed is handed to `hear`, in a thread of its own.
    ///
    /// # Errors
    /// When the operating system refuses.
    pub fn catch(mut hear: impl FnMut(String) + Send + 'static) -> io::Result<Self> {
        let (read, write) = io::pipe()?;
        let own = [io::stdout().as_fd().try_clone_to_owned()?, io::stderr().as_fd().try_clone_to_owned()?];
        let over = Arc::new((Mutex::new(false), Condvar::new()));
        let ends = over.clone();
        std::thread::Builder::new().name("davit-printed".to_owned()).spawn(move || {
            pass_on(BufReader::new(read), &mut hear);
            *lock(&ends.0) = true;
            ends.1.notify_all();
        })?;
        output::speak_to(Some(own.map(File::from)));
        lead_to(&write)?;
        Ok(Self { over })
    }
}

impl Drop for Printed {
    /// What was printed is handed on; what comes now is lost. A process that a component started may still hold the pipe:
    /// nobody waits for that.
    fn drop(&mut self) {
        super::last_words::end();
        if let Ok(nowhere) = OpenOptions::new().write(true).open("/dev/null") {
            let _ = lead_to(&nowhere);
        }
        let over = lock(&self.over.0);
        drop(
            self.over
                .1
                .wait_timeout_while(over, limits::PRINTED_END, |over| !*over)
                .unwrap_or_else(PoisonError::into_inner),
        );
    }
}

/// Leads stdout and stderr to a stream.
fn lead_to(stream: &impl AsRawFd) -> io::Result<()> {
    for own in [libc::STDOUT_FILENO, libc::STDERR_FILENO] {
        // SAFETY: both are descriptors of this process that stay open; what held on to what they were has a copy.
        if unsafe { libc::dup2(stream.as_raw_fd(), own) } < 0 {
            return Err(io::Error::last_os_error());
        }
    }
    Ok(())
}

/// Reads to the end, and hands on as many lines a second as anybody wants to keep.
fn pass_on(mut from: impl BufRead, hear: &mut impl FnMut(String)) {
    let clock = Clock::real();
    let (mut second, mut told, mut left_out) = (Time::default(), 0, 0_u64);
    let mut line = Vec::new();
    loop {
        line.clear();
        match (&mut from).take(limits::PRINTED_LENGTH as u64).read_until(b'\n', &mut line) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Ok(0) | Err(_) => break,
            Ok(_) => {}
        }
        let now = clock.now();
        if now.since(second) >= limits::DROPS_TOLD {
            (second, told) = (now, 0);
            if left_out > 0 {
                hear(format!("({} left out: more was printed than is kept)", count(left_out, "more line")));
                left_out = 0;
            }
        }
        if told == limits::PRINTED_LINES {
            left_out += 1;
            continue;
        }
        told += 1;
        hear(String::from_utf8_lossy(&line).trim_end().to_owned());
    }
    if left_out > 0 {
        hear(format!("({} left out: more was printed than is kept)", count(left_out, "more line")));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn passed(text: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        pass_on(text, &mut |line| lines.push(line));
        lines
    }

    #[test]
    fn lines_are_bounded_in_length_and_number() {
        assert_eq!(passed(b"one\ntwo \xff\n\nfour"), ["one", "two \u{fffd}", "", "four"]);
        let long = "x".repeat(limits::PRINTED_LENGTH + 1);
        assert_eq!(passed(long.as_bytes()), [&long[1..], "x"]);
        let printed = u64::from(limits::PRINTED_LINES) * 3;
        let lines = passed("x\n".repeat(usize::try_from(printed).unwrap()).as_bytes());
        let said = lines.iter().filter(|line| *line == "x").count() as u64;
        // As many seconds as it took: at most all of them were told.
        let missed: u64 =
            lines.iter().filter_map(|line| line.strip_prefix('(')?.split(' ').next()?.parse::<u64>().ok()).sum();
        assert_eq!(said + missed, printed, "nothing is left out without being counted");
    }
}
