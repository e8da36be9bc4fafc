//! A configurator or a platform that does not answer: what nobody knows is not nothing.

use crate::names::event;
use crate::stopping::{Small, force};
use davit::model::{
    Ask, Catalogue, ComponentName, ComponentSnapshot, ConfigId, Execution, MemberRef, Outcome, Snapshot, Step, Value,
};
use davit::platform::simulated::Simulated;
use davit::platform::{EventSink, ObserveError, Platform};
use davit::session::service::SessionService;
use davit::session::socket::Service;
use davit::session::{Command, Happening, Phase, Stage, Unanswered};
use davit::time::Time;
use serde_json::json;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A platform on which one step holds the configurator itself up, and that may show nothing any more.
struct Deaf {
    inner: Simulated,
    step: &'static str,
    holds: Duration,
    blind: Arc<AtomicBool>,
}

impl Deaf {
    fn is_it(&self, step: &Step) -> bool {
        step.to_string().starts_with(self.step)
    }
}

impl Platform for Deaf {
    fn catalogue(&self) -> &Catalogue {
        self.inner.catalogue()
    }
    fn execution(&self, step: &Step) -> Execution {
        if self.is_it(step) { Execution::Immediate } else { self.inner.execution(step) }
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        if self.is_it(step) {
            self.inner.clock().sleep(self.holds);
        }
        self.inner.execute(step, deadline)
    }
    fn cancel(&self, step: &Step) {
        self.inner.cancel(step);
    }
    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        if self.blind.load(Ordering::Relaxed) { Err(ObserveError::Timeout) } else { self.inner.observe(deadline) }
    }
    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError> {
        self.inner.observe_component(component, deadline)
    }
    fn subscribe(&self, sink: EventSink) {
        self.inner.subscribe(sink);
    }
    fn quarantined(&self) -> Vec<ComponentName> {
        self.inner.quarantined()
    }
}

/// `step` holds the configurator up for so many seconds.
fn deaf(step: &'static str, seconds: u64) -> (Small, Arc<AtomicBool>) {
    let blind = Arc::new(AtomicBool::new(false));
    let (holds, shows) = (Duration::from_secs(seconds), blind.clone());
    let small =
        Small::on("lowering", Vec::new(), move |inner| Arc::new(Deaf { inner, step, holds, blind: shows }) as _);
    (small, blind)
}

fn apply(id: &str) -> Ask {
    Ask::Apply(ConfigId::new(id).unwrap())
}

#[test]
fn who_asks_is_told_that_it_is_not_known() {
    let (small, _) = deaf("property_set b.k", 60);
    small.session.bring_up().unwrap();
    small.session.request(apply("soft"), "operator", false);
    small.clock.sleep(Duration::from_secs(1));
    assert_eq!(small.session.system(), Err(Unanswered));
    let status = small.session.status();
    assert_eq!((status.system, status.stack, status.residual), (None, None, None));
    assert_eq!(status.phase, Phase::Up);
    let service = SessionService::new(Arc::downgrade(&small.session));
    let shown = service.call(1, "status", &json!({})).unwrap();
    assert!(shown["stack"].is_null() && shown["system"].is_null(), "{shown}");
    let why = Unanswered.to_string();
    assert_eq!(service.call(1, "stack", &json!({})).unwrap_err().message, why);
    assert_eq!(service.call(1, "get", &json!({ "name": "a.k" })).unwrap_err().message, why);
    small.clock.sleep(Duration::from_secs(60));
    assert_eq!(Small::in_force(&small.session), ["base", "lift"], "it answers again: that was too late");
    assert!(small.session.take_down(false).is_clean());
    assert_eq!(small.session.status().stack, Some(Vec::new()), "nobody is there any more, and nothing");
}

/// What is broken is not whole since nobody says so.
#[test]
fn what_is_broken_stays_so_while_nobody_answers() {
    let (small, _) = deaf("property_set b.k", 60);
    small.session.bring_up().unwrap();
    let platform = small.platform.clone();
    small.after(1.0, move |_| {
        let property = MemberRef::new("a.g").unwrap();
        assert!(platform.tamper(&Step::PropertySet { property, value: Value::Float(7.0) }));
    });
    let phases = Arc::new(Mutex::new(Vec::new()));
    let (before, after) = (phases.clone(), phases.clone());
    small.after(15.0, move |session| {
        before.lock().unwrap().push(session.hub().phase());
        session.request(apply("soft"), "operator", false);
    });
    // Whoever drives it looks again.
    small.after(20.0, |session| _ = session.request(apply("stiff"), "operator", false));
    small.after(30.0, move |session| {
        after.lock().unwrap().push(session.hub().phase());
        force(session);
    });
    assert_eq!(small.session.serve(), Command::Shutdown { force: true });
    assert_eq!(*phases.lock().unwrap(), [Phase::Broken; 2]);
}

/// A platform that shows nothing is not empty.
#[test]
fn what_cannot_be_seen_is_not_down() {
    let (small, blind) = deaf("-", 0);
    small.session.bring_up().unwrap();
    blind.store(true, Ordering::Relaxed);
    let (ended, _) = small.stop();
    assert_eq!((ended.phase, ended.stage), (Phase::Broken, Stage::Forced), "{ended:?}");
    let unseen = "what is there is not known: the platform has not answered";
    assert_eq!(ended.left, [unseen]);
    assert!(ended.forced[0].ends_with(&format!("`idle` was reached, and {unseen}")), "{ended:?}");
    assert!(!ended.is_clean());
}

/// An emergency may have come: nothing is done by force before people say so.
#[test]
fn where_nobody_knows_whether_it_is_held_people_decide() {
    let (small, _) = deaf("property_set a.g", 90);
    small.session.bring_up().unwrap();
    small.after(1.0, |session| session.raise(event("e_estop"), "test"));
    small.after(60.0, force);
    let (ended, took) = small.stop();
    assert!(took >= 60.0, "{took}: {ended:?}");
    let log = small.session.hub().log(usize::MAX);
    let notes = log.iter().filter_map(|entry| match &entry.what {
        Happening::Forced { note } | Happening::Noted { note } => Some(note.as_str()),
        _ => None,
    });
    let held = "whether a safe configuration is in force is not known: what is left stays as it is";
    assert!(notes.clone().any(|note| note.starts_with(held)), "{:?}", notes.collect::<Vec<_>>());
    assert_eq!(ended.phase, Phase::Broken, "{ended:?}");
}

/// The same while it comes up late: it is asked once more before it is stopped.
#[test]
fn an_emergency_on_the_way_up_that_nobody_tells_of_stops_the_time() {
    let (small, _) = deaf("property_set a.g", 30);
    small.after(1.0, |session| session.raise(event("e_estop"), "test"));
    small.after(60.0, force);
    let not_up = small.session.bring_up().unwrap_err();
    assert!(not_up.interrupted, "{not_up:?}");
}
