//! What is made permanent (semantics: *The stack*): frames that are given up, so that what they did stays.

use super::{Frame, Requester, Stack, share};
use crate::model::{Finding, codes};
use std::sync::Arc;

/// Whether `by` may make its frames permanent: what a coordinator has in force may lie on them, or they on it, and its
/// undo would then write over what was to stay. `force` accepts that.
///
/// # Errors
/// The finding that names the frame.
pub fn may_commit(stack: &Stack, by: Requester, force: bool) -> Result<(), Finding> {
    let Some(held) = stack.frames().iter().rev().find(|frame| !force && !frame.is_own(by)) else { return Ok(()) };
    Err(Finding::error(
        codes::STACK_HELD,
        format!(
            "`{}` is in force, a frame of the coordinator `{}`: only with `--force` are the operator's own frames given up before it is undone",
            held.configuration, held.requester
        ),
    )
    .help(
        "commit when its coordinator has undone it (`davit stack` shows the frames), or with `--force`: then only your own \
         frames are given up, and its undo may write over what they did",
    ))
}

impl Frame {
    /// Whether all of it was asked for by `by`.
    fn is_own(&self, by: Requester) -> bool {
        if self.is_squashed() { self.parts.iter().all(|part| part.requester == by) } else { self.requester == by }
    }
}

impl Stack {
    /// Gives up the frames of `by`: what they did can no longer be undone. Those of others stay, and so does a floor that
    /// holds back one of them; it cannot be undone anyway.
    pub fn make_permanent(&mut self, by: Requester) {
        let mut kept: Vec<Arc<Frame>> = Vec::with_capacity(self.frames.capacity());
        for frame in self.frames.drain(..) {
            let holds_back = || frame.floor.is_some() && kept.iter().any(|below| share::holds_back(&frame, below));
            if !frame.is_own(by) || holds_back() {
                kept.push(frame);
                continue;
            }
            if frame.is_squashed() {
                self.committed.extend(frame.parts.iter().copied());
            } else {
                self.committed.insert(frame.buried());
            }
        }
        self.frames = kept;
    }
}
