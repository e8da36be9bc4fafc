//! Ctrl-C, and being asked to end (SIGTERM).

use super::exit::Exit;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::{Handle, Signals};
use std::thread::JoinHandle;

/// Watches for signals until dropped.
pub struct Watch {
    handle: Handle,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// At the first signal calls `first`; at the second calls `second` and ends the process with [`Exit::Broken`]: nothing
    /// more is asked of the components, and what the process holds goes with it. With `detached` the end of the
    /// terminal (SIGHUP) is no signal.
    ///
    /// # Errors
    /// When the operating system does not let signals be watched.
    pub fn start(
        detached: bool,
        first: impl Fn() + Send + 'static,
        second: impl FnOnce() + Send + 'static,
    ) -> std::io::Result<Self> {
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGHUP])?;
        let handle = signals.handle();
        let thread = std::thread::Builder::new().name("davit-signals".to_owned()).spawn(move || {
            let mut seen = 0;
            for signal in signals.forever() {
                if signal == SIGHUP && detached {
                    continue;
                }
                seen += 1;
                if seen == 1 {
                    first();
                } else {
                    second();
                    std::process::exit(i32::from(Exit::Broken.code()));
                }
            }
        })?;
        Ok(Self { handle, thread: Some(thread) })
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
