//! What was there when a script failed: states, frames, and what happened last.

use super::SharedHost;
use crate::limits;
use crate::session::Session;
use crate::session::log::{FrameStatus, LogEntry};
use std::sync::Arc;

/// A deployment at the moment at which its script failed.
#[derive(Debug, Clone)]
pub struct ScriptScene {
    /// When, in seconds of the clock.
    pub at: f64,
    /// The active states, root to leaf.
    pub active: Vec<String>,
    /// Frames in force, newest last; none: nobody knows.
    pub stack: Option<Vec<FrameStatus>>,
    /// What happened last, oldest first.
    pub last: Vec<Arc<LogEntry>>,
}

impl ScriptScene {
    fn of(session: &Session) -> Self {
        let status = session.status();
        let active = session.hub().active();
        Self { at: status.at, active, stack: status.stack, last: session.hub().log(limits::SCENE_ENTRIES) }
    }
}

/// The scene of now, if something is deployed.
pub(super) fn now(host: &SharedHost) -> Option<ScriptScene> {
    let session = host.borrow().session.clone()?;
    Some(ScriptScene::of(&session))
}

/// Keeps the scene of now, unless there is one.
pub(super) fn keep_first(host: &SharedHost) {
    if host.borrow().scene.is_none() {
        let scene = now(host);
        host.borrow_mut().scene = scene;
    }
}
