//! Ctrl-C, and being asked to end (SIGTERM, SIGHUP, SIGQUIT).

use super::exit::Exit;
use signal_hook::consts::{SIGHUP, SIGINT, SIGQUIT, SIGTERM};
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
    /// # Errors
    /// When the operating system does not let signals be watched.
    pub fn start(
        detached: bool,
        stop: impl Fn(bool) + Send + 'static,
        leave: impl FnOnce() + Send + 'static,
    ) -> std::io::Result<Self> {
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP, SIGQUIT])?;
        let handle = signals.handle();
        let thread = std::thread::Builder::new().name("davit-signals".to_owned()).spawn(move || {
            let mut seen = 0;
            for signal in signals.forever() {
                if signal == SIGHUP && detached {
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
