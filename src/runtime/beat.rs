//! What all parts of a component share with whoever runs it: the moment its present update stands for, how it is woken, and
//! where its events go.

use crate::model::{ComponentName, EventName};
use crate::time::{Signal, Time};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};

/// What a component tells the platform by itself.
#[derive(Debug, Clone, PartialEq)]
pub enum Notice {
    /// It raised an event.
    Raised {
        /// The event.
        event: EventName,
        /// Who.
        component: ComponentName,
        /// When.
        at: Time,
    },
    /// It became faulted.
    Faulted {
        /// Who.
        component: ComponentName,
        /// What happened.
        reason: String,
        /// When.
        at: Time,
    },
}

/// Where notices go. Called from any thread, activities included; must not block.
pub type NoticeSink = Arc<dyn Fn(Notice) + Send + Sync>;

/// The place notices go to, shared by all components of a runtime.
#[derive(Default)]
pub struct Notices(RwLock<Option<NoticeSink>>);

impl Notices {
    /// From now on notices go to `sink`.
    pub fn subscribe(&self, sink: NoticeSink) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = Some(sink);
    }

    /// Delivers a notice; without a sink it is lost.
    pub fn send(&self, notice: Notice) {
        // The lock is only ever written by `subscribe`, once, before anything runs.
        if let Some(sink) = &*self.0.read().unwrap_or_else(PoisonError::into_inner) {
            sink(notice);
        }
    }
}

/// Shared by a component, its ports and its activity.
pub struct Beat {
    pub(crate) name: ComponentName,
    /// The moment the present (or last) call of the component stands for.
    now: AtomicU64,
    /// Something came for it since its last update. For event-driven activities.
    pub(crate) pending: AtomicBool,
    /// When it wants to be updated though nothing comes.
    pub(crate) wake_at: AtomicU64,
    /// Its calls that were given up while they were under way and have not come to rest. For a moment one too few, when
    /// the rest comes while it is being given up.
    pub(crate) restless: AtomicI32,
    /// How its activity is woken; none for periodic ones.
    wake: Option<Signal>,
    notices: Arc<Notices>,
}

impl Beat {
    pub(crate) fn new(name: ComponentName, wake: Option<Signal>, notices: Arc<Notices>) -> Self {
        Self {
            name,
            now: AtomicU64::new(0),
            pending: AtomicBool::new(false),
            wake_at: AtomicU64::new(Time::NEVER.0),
            restless: AtomicI32::new(0),
            wake,
            notices,
        }
    }

    #[inline]
    pub(crate) fn now(&self) -> Time {
        Time(self.now.load(Ordering::Relaxed))
    }

    #[inline]
    pub(crate) fn set_now(&self, now: Time) {
        self.now.store(now.0, Ordering::Relaxed);
    }

    /// Whether something arriving must wake it.
    pub(crate) fn is_event_driven(&self) -> bool {
        self.wake.is_some()
    }

    /// Something came for it.
    pub(crate) fn poke(&self) {
        if let Some(wake) = &self.wake {
            self.pending.store(true, Ordering::Release);
            wake.notify();
        }
    }

    pub(crate) fn raise(&self, event: EventName) {
        self.notices.send(Notice::Raised { event, component: self.name, at: self.now() });
    }

    pub(crate) fn faulted(&self, reason: String, at: Time) {
        self.notices.send(Notice::Faulted { component: self.name, reason, at });
    }
}
