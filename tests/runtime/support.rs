//! A platform on a simulated clock, and short words for the tests.

pub use crate::names::{ident, member, name};
use davit::model::*;
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::{Outcome, Platform, PlatformEvent};
use davit::runtime::{Libraries, Library};
use davit::time::{Clock, Guard, Time};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub const MS: Duration = Duration::from_millis(1);

pub struct Bench {
    pub platform: Arc<EmbeddedPlatform>,
    pub clock: Clock,
    pub events: Arc<Mutex<Vec<PlatformEvent>>>,
    // Last: the others need the token while they are dropped.
    _guard: Guard,
}

/// Activities `fast` (1 ms), `slow` (10 ms) and `events` (event-driven).
pub fn activities() -> BTreeMap<Ident, Activity> {
    let activity = |period| Activity { period, priority: 0, cpu: None, origin: Origin::NONE };
    [("fast", Some(MS)), ("slow", Some(10 * MS)), ("events", None)]
        .map(|(name, period)| (ident(name), activity(period)))
        .into()
}

pub fn bench(library: Library) -> Bench {
    bench_on(Clock::simulated(), library)
}

pub fn bench_on(clock: Clock, library: Library) -> Bench {
    bench_with(clock, [library])
}

pub fn bench_with(clock: Clock, libraries: impl IntoIterator<Item = Library>) -> Bench {
    let guard = clock.enter();
    let standard = Libraries::new().with(davit::libraries::standard::library());
    let libraries = libraries.into_iter().fold(standard, Libraries::with);
    let platform = Arc::new(EmbeddedPlatform::new(&clock, &libraries, &activities()));
    let events = Arc::new(Mutex::new(Vec::new()));
    let sink = events.clone();
    platform.subscribe(Arc::new(move |event| sink.lock().unwrap().push(event)));
    Bench { platform, clock, events, _guard: guard }
}

pub fn call(operation: &str, args: Vec<Value>) -> Step {
    Step::Operation(Call { operation: member(operation), args })
}

impl Bench {
    pub fn run(&self, step: &Step) -> Outcome {
        self.run_within(step, Duration::from_secs(1))
    }

    pub fn run_within(&self, step: &Step, limit: Duration) -> Outcome {
        self.platform.execute(step, self.clock.now() + limit)
    }

    #[track_caller]
    pub fn does(&self, step: Step) -> Option<Value> {
        match self.run(&step) {
            Outcome::Done(value) => value,
            other => panic!("`{step}` should happen: {other:?}"),
        }
    }

    /// Creates a component in an activity; values not given are the defaults.
    #[track_caller]
    pub fn create(&self, component: &str, ty: &str, activity: &str, values: &[(&str, Value)]) {
        let declared = self.platform.catalogue().get(TypeName::new(ty).unwrap()).expect("a type").clone();
        for (given, _) in values {
            assert!(declared.properties.contains_key(&ident(given)), "{ty} has no property {given}");
        }
        let properties = declared
            .properties
            .iter()
            .map(|(property, p)| {
                let given = values.iter().find(|(n, _)| *n == property.as_str()).map(|(_, v)| v.clone());
                given.or_else(|| p.default.clone()).expect("a value")
            })
            .collect();
        let (component, ty) = (name(component), TypeName::new(ty).unwrap());
        self.does(Step::Create { component, ty, activity: Some(ident(activity)), properties });
    }

    #[track_caller]
    pub fn go(&self, component: &str, target: Wanted) {
        let now = self.platform.observe_component(name(component), Time::NEVER).unwrap().expect("a component").state;
        for transition in now.path_to(target) {
            self.does(Step::State { component: name(component), transition: *transition });
        }
    }

    #[track_caller]
    pub fn start(&self, components: &[&str]) {
        for component in components {
            self.go(component, Wanted::Running);
        }
    }

    #[track_caller]
    pub fn connect(&self, from: &str, to: &str, policy: Policy) {
        self.does(Step::Connect { from: member(from), to: member(to), policy });
    }

    #[track_caller]
    pub fn disconnect(&self, from: &str, to: &str) {
        self.does(Step::Disconnect { from: member(from), to: member(to) });
    }

    #[track_caller]
    pub fn set(&self, property: &str, value: impl Into<Value>) {
        self.does(Step::PropertySet { property: member(property), value: value.into() });
    }

    #[track_caller]
    pub fn write(&self, port: &str, value: impl Into<Value>) {
        self.does(Step::PortWrite { port: member(port), value: Some(value.into()) });
    }

    pub fn state_of(&self, component: &str) -> Option<RunState> {
        self.platform.observe_component(name(component), Time::NEVER).unwrap().map(|c| c.state)
    }

    pub fn wait(&self, time: Duration) {
        self.clock.sleep(time);
    }

    /// The events raised so far, with who raised them.
    pub fn raised(&self) -> Vec<(String, String)> {
        let events = self.events.lock().unwrap();
        events
            .iter()
            .filter_map(|event| match event {
                PlatformEvent::Raised { event, component, .. } => Some((event.to_string(), component.to_string())),
                _ => None,
            })
            .collect()
    }

    pub fn faults(&self) -> Vec<(String, String)> {
        let events = self.events.lock().unwrap();
        events
            .iter()
            .filter_map(|event| match event {
                PlatformEvent::Faulted { component, reason, .. } => Some((component.to_string(), reason.clone())),
                _ => None,
            })
            .collect()
    }

    pub fn returned(&self) -> Vec<String> {
        let events = self.events.lock().unwrap();
        events
            .iter()
            .filter_map(|event| match event {
                PlatformEvent::Returned { component, .. } => Some(component.to_string()),
                _ => None,
            })
            .collect()
    }
}

/// A log that components of one test share: found by their clock, of which every test has its own.
pub mod log {
    use davit::time::Clock;
    use std::sync::Mutex;

    static LINES: Mutex<Vec<(Clock, String)>> = Mutex::new(Vec::new());

    pub fn note(clock: &Clock, line: impl Into<String>) {
        LINES.lock().unwrap().push((clock.clone(), line.into()));
    }

    /// Takes out what was noted on this clock.
    pub fn take(clock: &Clock) -> Vec<String> {
        let mut lines = LINES.lock().unwrap();
        let (own, others) = std::mem::take(&mut *lines).into_iter().partition(|(c, _)| c.is(clock));
        *lines = others;
        let own: Vec<(Clock, String)> = own;
        own.into_iter().map(|(_, line)| line).collect()
    }
}
