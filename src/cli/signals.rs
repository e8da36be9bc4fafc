//! Ctrl-C, and being asked to end (SIGTERM, SIGHUP, SIGQUIT, SIGXCPU).

use super::exit::Exit;
use crate::limits;
use crate::time::{Clock, Time};
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGXCPU};
use signal_hook::iterator::{Handle, Signals};
use std::thread::JoinHandle;

/// Watches for signals until dropped.
pub struct Watch {
    handle: Handle,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Each signal asks for more: at the first it calls `stop(false)`, at the second `stop(true)`: by force. The third is for
    /// when even that does not come to an end: it calls `leave` and ends the process with [`Exit::Forced`]; nothing more is
    /// asked of the components, and what the process holds goes with it. With `detached` the end of the terminal (SIGHUP) is
    /// no signal.
    ///
    /// One cause may bring several: a shell tells its jobs that the terminal is gone, and then the kernel does; `timeout` tells a
    /// process and its group; a key that is held down repeats. So a terminal that is gone, or a time limit, asks for no more than the
    /// first one has, and within [`limits::SIGNAL_REPEATS`] after another one neither does SIGTERM, nor does anything ask for the
    /// end at once.
    ///
    /// # Errors
    /// When the operating system does not let signals be watched.
    pub fn start(
        detached: bool,
        stop: impl Fn(bool) + Send + 'static,
        leave: impl FnOnce() + Send + 'static,
    ) -> std::io::Result<Self> {
        ignore_what_would_stop_it();
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU])?;
        let handle = signals.handle();
        let thread = std::thread::Builder::new().name("davit-signals".to_owned()).spawn(move || {
            let (clock, mut seen, mut last) = (Clock::real(), 0, None::<Time>);
            for signal in signals.forever() {
                let now = clock.now();
                let same = last.replace(now).is_some_and(|last| now.since(last) < limits::SIGNAL_REPEATS);
                let asks_for_more = match signal {
                    SIGHUP | SIGXCPU => false,
                    SIGTERM => !same,
                    _ => seen < 2 || !same,
                };
                if signal == SIGHUP && detached || seen > 0 && !asks_for_more {
                    continue;
                }
                seen += 1;
                if seen <= 2 {
                    stop(seen == 2);
                } else {
                    leave();
                    std::process::exit(i32::from(Exit::Forced.code()));
                }
            }
        })?;
        Ok(Self { handle, thread: Some(thread) })
    }

    /// Goes on until the process ends, whatever it still has to say.
    pub fn until_the_end(self) {
        std::mem::forget(self);
    }
}

/// From now on who is asked to end gives the terminal back as it is now, and ends: a line editor has it take single keys, which
/// would be left so.
///
/// # Errors
/// When the operating system does not let signals be watched, or has no thread left.
pub fn give_terminal_back() -> std::io::Result<()> {
    let mut before = std::mem::MaybeUninit::<libc::termios>::uninit();
    // SAFETY: `before` is as large as what is written to it, and it is read only when the call says that it was.
    let before = match unsafe { libc::tcgetattr(libc::STDIN_FILENO, before.as_mut_ptr()) } {
        0 => unsafe { before.assume_init() },
        _ => return Ok(()),
    };
    let mut signals = Signals::new([SIGTERM, SIGHUP, SIGQUIT])?;
    std::thread::Builder::new().name("davit-signals".to_owned()).spawn(move || {
        for signal in signals.forever() {
            // SAFETY: it is what the terminal itself has said. That a terminal is gone hurts nobody.
            unsafe { libc::tcsetattr(libc::STDIN_FILENO, libc::TCSANOW, &raw const before) };
            let _ = signal_hook::low_level::emulate_default_handler(signal);
        }
    })?;
    Ok(())
}

/// A terminal that takes no output from the background (`stty tostop`), and a file that may get no larger, would stop or end the
/// process, coordinator and all. Ignored, the one lets the write through, and the other is a disk that is full.
fn ignore_what_would_stop_it() {
    for signal in [libc::SIGTTOU, libc::SIGXFSZ] {
        // SAFETY: ignoring a signal runs no code of ours, and `signal` is given a number and a disposition that exist.
        unsafe { libc::signal(signal, libc::SIG_IGN) };
    }
}

/// What is told at the first signal, and at the second.
pub fn told(force: bool) -> &'static str {
    match force {
        false => "stopping; Ctrl-C again takes it down by force",
        true => "by force; Ctrl-C again ends at once and asks the components nothing more",
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.handle.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
