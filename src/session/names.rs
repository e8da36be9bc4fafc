//! Names that somebody outside gives a running deployment: those that cannot be right, and those that are kept for ever.

use super::Session;
use crate::limits::{EVENTS_UNLISTED, UNLISTED_BYTES};
use crate::model::finding::{did_you_mean, did_you_mean_path};
use crate::model::names::NameError;
use crate::model::{Ask, Code, EventName, Verdict, codes};
use crate::time::lock;
use std::collections::BTreeSet;
use std::sync::Mutex;

/// Why nobody outside may raise an event.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct NotFromOutside {
    message: String,
    /// What to do instead.
    pub help: String,
}

impl NotFromOutside {
    /// What `davit explain` tells more about.
    pub const CODE: Code = codes::NOT_FROM_OUTSIDE;
}

/// Why a text from outside is no event here.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NotNamed {
    /// It tells what only Davit knows.
    #[error(transparent)]
    NotFromOutside(#[from] NotFromOutside),
    /// No transition lists it, and no function may see it.
    #[error("the coordinator knows no event `{0}`")]
    Unknown(String),
    /// It is no name of an event.
    #[error(transparent)]
    Bad(#[from] NameError),
    /// No transition lists it, and it is too long to be kept.
    #[error("no transition lists this event, and its name is longer than {UNLISTED_BYTES} bytes")]
    Long,
    /// No transition lists it, and so many such names are kept already.
    #[error(
        "no transition lists `{0}`, and {EVENTS_UNLISTED} other such names were given: each is kept for ever, so there are no more"
    )]
    Many(String),
}

/// Names from outside that no transition lists, which functions may see all the same.
#[derive(Debug, Default)]
pub(super) struct Unlisted(Mutex<BTreeSet<String>>);

impl Unlisted {
    /// Keeps a name, if it is kept already or there is room for it.
    fn keep(&self, name: &str) -> Result<EventName, NotNamed> {
        if name.len() > UNLISTED_BYTES {
            return Err(NotNamed::Long);
        }
        let mut kept = lock(&self.0);
        if !kept.contains(name) && kept.len() >= EVENTS_UNLISTED {
            return Err(NotNamed::Many(name.to_owned()));
        }
        let event = EventName::new(name)?;
        kept.insert(name.to_owned());
        Ok(event)
    }
}

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

/// How what is meant is asked for.
fn instead_of(ask: Ask) -> String {
    let script = match ask {
        Ask::Apply(id) => format!("apply(\"{id}\")"),
        Ask::UndoOf(id) => format!("undo(\"{id}\")"),
        other => format!("{other}()"),
    };
    format!("`davit {}` asks for it (in a script `{script}`)", ask.command())
}

impl Session {
    /// Whether somebody outside may raise an event: everything that comes from there is asked this, by whichever way it comes.
    ///
    /// # Errors
    /// Nobody outside may raise it.
    pub fn may_raise(&self, event: &str) -> Result<(), NotFromOutside> {
        let deployment = self.deployment();
        let Some(message) = deployment.never_from_outside(event) else { return Ok(()) };
        let help = match deployment.asked_instead(event) {
            Some(ask) => instead_of(ask),
            None if deployment.is_theirs_alone(event) => {
                "raise what leads a coordinator to tell it; one that people raise as well is listed under `safety:`, or has a name of its own"
                    .to_owned()
            }
            None => "raise an event that a transition waits for; answers go to whoever asks for something".to_owned(),
        };
        Err(NotFromOutside { message, help })
    }

    /// What may have been meant by a text that is no event here: what somebody waits for, and may be raised from outside.
    pub fn near_event(&self, name: &str) -> String {
        if let Some(id) = self.configurations().into_iter().find(|id| id.as_str() == name) {
            return format!("`{name}` is a configuration: {}", instead_of(Ask::Apply(id)));
        }
        let events = self.events();
        let waited_for = events.iter().map(EventName::as_str).filter(|event| self.may_raise(event).is_ok());
        did_you_mean_path(name, "events", waited_for)
    }

    /// The event that a text from outside names. Asked before it becomes a name: names are kept for ever.
    ///
    /// # Errors
    /// Nobody outside may raise it, nobody here can hear it, or there are too many that only functions may hear.
    pub fn named(&self, name: &str) -> Result<EventName, NotNamed> {
        self.may_raise(name)?;
        match self.events().into_iter().find(|known| known.as_str() == name) {
            Some(known) => Ok(known),
            None if self.sees_all_events() => self.hub().unlisted.keep(name),
            None => Err(NotNamed::Unknown(name.to_owned())),
        }
    }

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
        // An operator may set it: that is answered, too.
        let is_set = |name: &str| self.setting(name).is_some() || self.member(name).is_ok();
        if Verdict::split(event).is_some_and(|(subject, _)| is_set(subject)) {
            return None;
        }
        let about = |name: &&str| Verdict::split(name).map(|(subject, _)| subject) == subject;
        // `grasp.done` does not mean `grasp.undone`, which is the contrary.
        let contrary =
            |name: &&str| event.rsplit_once('.').is_some_and(|(_, word)| name.ends_with(&format!("un{word}")));
        let all = || answers.iter().map(EventName::as_str).filter(|name| !contrary(name));
        let near: Vec<&str> = match all().any(|name| about(&name)) {
            true => all().filter(about).collect(),
            false => all().collect(),
        };
        Some(format!("`{event}` is never heard, no request is answered so: {}", did_you_mean(event, "answers", near)))
    }
}
