//! Names that somebody asks a running deployment about, and that cannot be right.

use super::Session;
use crate::model::finding::did_you_mean;
use crate::model::{EventName, Verdict};

/// What ends a wait for an answer beside that answer itself: the others that the same request may be answered with.
pub(super) fn instead(event: &str) -> Vec<String> {
    let Some((subject, ending)) = Verdict::split(event) else { return Vec::new() };
    let bare = subject == "undo";
    let others: &[Verdict] = match ending {
        _ if ending == Verdict::Ok.ending(false) => &[Verdict::Failed, Verdict::Broken, Verdict::Cancelled],
        _ if ending == Verdict::Undone.ending(bare) => &[Verdict::UndoFailed, Verdict::UndoBroken],
        _ => &[],
    };
    others.iter().map(|verdict| format!("{subject}{}", verdict.ending(bare))).collect()
}

impl Session {
    /// Why an event will never be heard, if that is known: it is spelt like an answer, and nothing is answered so.
    pub fn never_heard(&self, event: &str) -> Option<String> {
        let is = |name: &EventName| name.as_str() == event;
        if !self.deployment().looks_like_answer(event)
            || self.events().iter().any(is)
            || self.deployment().emits.iter().any(|(name, _)| is(name))
        {
            return None;
        }
        let answers = self.deployment().answers();
        if answers.iter().any(is) {
            return None;
        }
        // Of the answers about what it names, if there is such a thing, else of all.
        let subject = Verdict::split(event).map(|(subject, _)| subject).or_else(|| Some(event.rsplit_once('.')?.0));
        let about = |name: &&str| Verdict::split(name).map(|(subject, _)| subject) == subject;
        let all = || answers.iter().map(EventName::as_str);
        let near: Vec<&str> = match all().any(|name| about(&name)) {
            true => all().filter(about).collect(),
            false => all().collect(),
        };
        Some(format!("`{event}` is never heard, no request is answered so: {}", did_you_mean(event, "answers", near)))
    }
}
