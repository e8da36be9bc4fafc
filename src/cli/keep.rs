//! What `davit deploy` keeps on disk of the deployment that it runs, and `davit run` of those that a script has on the real clock.

use super::CommandFailure;
use super::deploy::short;
use super::last_words;
use super::output;
use super::printed::Printed;
use crate::session::kept::{Keeper, Leave};
use crate::session::{Ended, Happening, NotUp, Session};
use crate::time::Clock;
use std::path::Path;
use std::sync::Arc;

/// The log and the life of a deployment, as long as it runs; where they cannot be kept, nothing.
pub struct Keep {
    keeper: Option<Keeper>,
    /// What is printed in the background.
    printed: Option<Printed>,
}

impl Keep {
    /// Begins. That it cannot be kept is said, and no reason not to deploy.
    ///
    /// # Errors
    /// When what is printed in the background cannot be caught: then it would have nowhere to go.
    pub fn begin(
        session: &Arc<Session>,
        file: &Path,
        clock: &Clock,
        in_background: bool,
    ) -> Result<Self, CommandFailure> {
        let keeper = Keeper::open(session.deployment().name.as_str(), file, clock).map_err(|why| {
            let text = format!("note: what happens is not kept for `davit log` after the end: {why}\n");
            last_words::say(move || output::error(&text));
        });
        let keeper = keeper.ok();
        if let Some(keeper) = &keeper {
            session.hub().attach(keeper.observer());
        }
        // What is said so far goes to who started it.
        if in_background {
            last_words::end();
        }
        let hears = session.clone();
        let hear = move |text| hears.hub().report(Happening::Printed { text });
        let printed = in_background.then(|| Printed::catch(hear)).transpose().map_err(|error| {
            keeper.iter().for_each(|keeper| keeper.not_begun(&error.to_string()));
            short(error)
        })?;
        Ok(Self { keeper, printed })
    }

    /// It was stopped, so.
    pub fn ended(self, ended: &Ended) {
        drop(self.printed);
        self.keeper.iter().for_each(|keeper| keeper.ended(ended));
    }

    /// It did not come up.
    pub fn not_up(self, not_up: &NotUp) {
        drop(self.printed);
        self.keeper.iter().for_each(|keeper| keeper.not_up(not_up));
    }

    /// For a process that ends at once.
    pub fn leave(&self) -> Option<Leave> {
        self.keeper.as_ref().map(Keeper::leave)
    }
}
