//! A component that raises events in a deployment that is up asks for no memory, whoever hears them: neither for what the session
//! writes down of them nor for giving them to coordinators. Counted by the allocator in the threads of its activity.

use crate::counting::Together;
use davit::app;
use davit::lang::LoadOptions;
use davit::model::EventName;
use davit::platform::embedded::EmbeddedPlatform;
use davit::runtime::*;
use davit::session::{Happening, Session, SessionSetup};
use davit::statechart::compile;
use davit::time::Clock;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// The threads of the activity in which a component raises events, in each of the two deployments.
static FLAT: Together = Together::new();
static COMPOSED: Together = Together::new();

/// Raises an event that a coordinator waits for and one that nobody does, in each update.
struct Blinker<const IN_SUBSYSTEM: bool> {
    events: EventOut,
    heard: EventName,
    unheard: EventName,
}

impl<const IN_SUBSYSTEM: bool> Component for Blinker<IN_SUBSYSTEM> {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { events: b.event_output("events"), heard: b.event("e_blink"), unheard: b.event("e_dark") }
    }

    fn update(&mut self, _: &mut Context) {
        if IN_SUBSYSTEM {
            COMPOSED.add_thread()
        } else {
            FLAT.add_thread()
        }
        self.events.raise(self.heard);
        self.events.raise(self.unheard);
    }
}

const ONE: &str = "davit: 1
name: one
platform: embedded
libraries: [test]
activities: { control: { period_ms: 1.0 } }
configurations: [conf.lua]
coordinator: k.lua
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const COORDINATOR: &str = "return state {
  idle = state {}, making = state { entry = 'make' }, on = state {}, unmaking = state { entry = 'make.undo' },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
  trans { src = 'making', tgt = 'on', events = { 'make.ok' } },
  trans { src = 'on', tgt = 'on', events = { 'e_blink' } },
  trans { src = 'on', tgt = 'unmaking', events = { 'e_shutdown' } },
  trans { src = 'unmaking', tgt = 'idle', events = { 'make.undone' } },
}";

const PARENT: &str = "davit: 1
name: parent
platform: embedded
libraries: [test]
subsystems: { left: { deployment: one.yaml } }
configurations: [none.lua]
coordinator: parent.lua
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const PARENT_COORDINATOR: &str = "return state {
  idle = state {}, beginning = state { entry = 'left/e_start' }, on = state {}, ending = state { entry = 'left/e_shutdown' },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'beginning', events = { 'e_start' } },
  trans { src = 'beginning', tgt = 'on', events = { 'left/up' } },
  trans { src = 'on', tgt = 'ending', events = { 'e_shutdown' } },
  trans { src = 'ending', tgt = 'idle', events = { 'left/down' } },
}";

/// How often memory is asked for or given back while the deployment of that file is up, and how many events are raised meanwhile.
fn while_up<B: Component>(file: &str, count: &'static Together) -> (u64, u64) {
    let folder = tempfile::tempdir().unwrap();
    let conf = "ConfiguratorConf { make = Configuration { create('B', 'Blinker', { activity = 'control' }), post_conf_state = { 'B:running' } } }";
    let files = [
        ("one.yaml", ONE),
        ("conf.lua", conf),
        ("k.lua", COORDINATOR),
        ("parent.yaml", PARENT),
        ("none.lua", "ConfiguratorConf {}"),
        ("parent.lua", PARENT_COORDINATOR),
    ];
    files.iter().for_each(|(name, text)| std::fs::write(folder.path().join(name), text).unwrap());
    let library = Library::new("test").with::<B>("Blinker");
    let read = app::read(&folder.path().join(file), &LoadOptions::default(), Libraries::new().with(library));
    let read = read.unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
    // A thread for each activity: what is counted is the activity's own.
    let clock = Clock::simulated_paced(1e9);
    let _guard = clock.enter();
    let libraries = Libraries::new().with(Library::new("test").with::<B>("Blinker"));
    let activities = read.deployment.activities.iter().map(|(name, activity)| (*name, *activity)).collect();
    let charts: Vec<_> =
        read.deployment.charts().map(|written| Arc::new(compile(written).0.expect("a chart"))).collect();
    let session = Session::start(SessionSetup {
        deployment: Arc::new(read.deployment.clone()),
        functions: charts.iter().map(|_| None).collect(),
        charts,
        catalogue: read.catalogue.clone(),
        platform: Arc::new(EmbeddedPlatform::new(&clock, &libraries, &activities)),
        clock: clock.clone(),
    });
    let told = Arc::new(AtomicU64::new(0));
    let written = told.clone();
    session.hub().observe(Arc::new(move |_, what| {
        if matches!(what, Happening::Event { from, .. } if from.ends_with('B')) {
            written.fetch_add(1, Ordering::Relaxed);
        }
    }));
    session.bring_up().unwrap_or_else(|not_up| panic!("{not_up:?}"));
    // The first rounds take what is kept.
    clock.sleep(Duration::from_millis(200));
    let (before, events) = (count.touched(), told.load(Ordering::Relaxed));
    clock.sleep(Duration::from_secs(2));
    let counted = (count.touched() - before, told.load(Ordering::Relaxed) - events);
    let ended = session.take_down(false);
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    counted
}

#[test]
fn raising_events_in_a_deployment_that_is_up_allocates_nothing() {
    let (touched, events) = while_up::<Blinker<false>>("one.yaml", &FLAT);
    assert!(events > 3_000, "{events} events are written down");
    assert_eq!(touched, 0, "while {events} events were raised");
}

#[test]
fn raising_events_in_a_subsystem_allocates_nothing() {
    let (touched, events) = while_up::<Blinker<true>>("parent.yaml", &COMPOSED);
    assert!(events > 3_000, "{events} events are written down");
    assert_eq!(touched, 0, "while {events} events were raised");
}
