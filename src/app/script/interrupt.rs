//! How somebody outside stops a script and what it has brought up: a signal.

use super::error;
use crate::limits;
use crate::session::{Command, Session};
use crate::time::{Clock, Time, lock};
use std::sync::{Arc, Mutex, Weak};

/// Stops a script: from now on every function of it fails, and what it brought up is stopped. Clones stop the same one.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    asked: bool,
    force: bool,
    session: Weak<Session>,
}

impl Interrupt {
    /// Asks it to end; with `force` what it brought up is taken down by force.
    pub fn stop(&self, force: bool) {
        let session = {
            let mut state = lock(&self.0);
            state.asked = true;
            state.force |= force;
            state.session.clone()
        };
        if let Some(session) = session.upgrade() {
            session.command(Command::Shutdown { force });
        }
    }

    /// A deployment of the script's: commands go to it from now on, also one that came before.
    pub(super) fn up(&self, session: &Arc<Session>) {
        let state = {
            let mut state = lock(&self.0);
            state.session = Arc::downgrade(session);
            (state.asked, state.force)
        };
        if let (true, force) = state {
            session.command(Command::Shutdown { force });
        }
    }

    /// Fails once it is asked for.
    pub(super) fn check(&self) -> mlua::Result<()> {
        if lock(&self.0).asked { Err(error("interrupted by a signal")) } else { Ok(()) }
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
