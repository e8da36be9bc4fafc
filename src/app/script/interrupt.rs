//! How somebody outside stops a script and what it has brought up: a signal.

use super::error;
use crate::functions::INTERRUPTED;
use crate::limits;
use crate::session::{Command, Session};
use crate::time::{Clock, Time, lock};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, Weak};

/// Stops a script: it ends wherever it is, whatever it catches, and what it brought up is stopped. Clones stop the same one.
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    asked: Arc<AtomicBool>,
    state: Arc<Mutex<InterruptState>>,
}

#[derive(Debug, Default)]
struct InterruptState {
    force: bool,
    session: Weak<Session>,
}

impl Interrupt {
    /// Asks it to end; with `force` what it brought up is taken down by force.
    pub fn stop(&self, force: bool) {
        let session = {
            let mut state = lock(&self.state);
            self.asked.store(true, Ordering::Relaxed);
            state.force |= force;
            state.session.clone()
        };
        if let Some(session) = session.upgrade() {
            session.command(Command::Shutdown { force });
        }
    }

    /// Whether what it brought up is being stopped, and that stands still until somebody asks for force.
    pub fn waits_to_be_forced(&self) -> bool {
        let session = lock(&self.state).session.upgrade();
        session.is_some_and(|session| session.waits_to_be_forced())
    }

    /// Whether it has brought something up that would be stopped.
    pub fn has_deployed(&self) -> bool {
        lock(&self.state).session.strong_count() > 0
    }

    /// A deployment of the script's: commands go to it from now on, also one that came before.
    pub(super) fn up(&self, session: &Arc<Session>) {
        // Also who asks the deployment to end (`davit shutdown`) ends the script: whatever it catches, and whatever it would do next.
        session.flag_commands(&self.asked);
        let state = {
            let mut state = lock(&self.state);
            state.session = Arc::downgrade(session);
            (self.asked.load(Ordering::Relaxed), state.force)
        };
        if let (true, force) = state {
            session.command(Command::Shutdown { force });
        }
    }

    /// Whether it is asked for: what the budget of the script looks at.
    pub(super) fn asked(&self) -> Arc<AtomicBool> {
        self.asked.clone()
    }

    /// Fails once it is asked for.
    pub(super) fn check(&self) -> mlua::Result<()> {
        if self.asked.load(Ordering::Relaxed) { Err(error(INTERRUPTED.to_string_lossy())) } else { Ok(()) }
    }

    /// Waits until then. In simulated time that takes no time.
    pub(super) fn sleep(&self, clock: &Clock, until: Time) -> mlua::Result<()> {
        if clock.is_simulated() {
            clock.sleep_until(until);
            return self.check();
        }
        loop {
            self.check()?;
            let now = clock.now();
            if now >= until {
                return Ok(());
            }
            clock.sleep_until(until.min(now + limits::SIGNAL_LOOK));
        }
    }
}
