//! A flood of events: what a monitor raises about a signal that is noisy around its threshold, a thousand times a second.
//!
//! It is bounded, counted and told; it neither delays nor displaces what an operator and the configurator say, nor the
//! session's memory of it.

use crate::names::event;
use davit::app;
use davit::lang::LoadOptions;
use davit::limits;
use davit::model::{Ask, ConfigId, EventName};
use davit::runtime::{Builder, Component, Context, EventOut, Libraries, Library, Out, Prop};
use davit::session::{Happening, Session};
use davit::time::Clock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Writes noise around zero in every update, and raises as many events at once as its property says.
struct Noise {
    y: Out<f64>,
    burst: Prop<i64>,
    events: EventOut,
    burst_event: EventName,
    state: u64,
    done: i64,
}

impl Component for Noise {
    fn new(b: &mut Builder<Self>) -> Self {
        Self {
            y: b.output("y"),
            burst: b.property("burst", 0_i64),
            events: b.event_output("events"),
            burst_event: event("e_burst"),
            state: 0x9E37_79B9_7F4A_7C15,
            done: 0,
        }
    }

    fn update(&mut self, _: &mut Context) {
        // Xorshift: the same noise every time.
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        self.y.write(if self.state & 1 == 0 { 0.5 } else { -0.5 });
        let burst = self.burst.get();
        if burst != self.done {
            (0..burst).for_each(|_| self.events.raise(self.burst_event));
            self.done = burst;
        }
    }
}

const DEPLOYMENT: &str = "\
davit: 1
name: noisy
platform: embedded
libraries: [noise]
activities: { control: { period_ms: 1.0, priority: 80 } }
configurations: [conf.lua]
coordinator: k.lua
monitors: [m.lua]
emits: [e_tick]
deploy: { event: e_start, up: on, failed: [failed], within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

const CONFIGURATIONS: &str = "ConfiguratorConf {
  build = Configuration {
    create(\"Source\", \"Noise\", { activity = \"control\" }),
    create(\"Monitors\", \"davit.Monitors\", { activity = \"control\" }),
    post_conf_state = { \"_default:running\" },
  },
  burst = Configuration { property_set(\"Source.burst\", 6000) },
  other = Configuration { },
}
";

/// The monitor's events are heard where nobody is: in `on` they trigger nothing.
const COORDINATOR: &str = "return state {
  idle = state {}, failed = state {}, building = state { entry = \"build\" }, leaving = state { entry = \"build.undo\" },
  on = state {}, other = state { config = \"other\" },
  trans { src = \"initial\", tgt = \"idle\" },
  trans { src = \"idle\", tgt = \"building\", events = { \"e_start\" } },
  trans { src = \"building\", tgt = \"on\", events = { \"build.ok\" } },
  trans { src = \"building\", tgt = \"failed\", events = { \"build.failed\", \"build.broken\" } },
  trans { src = \"on\", tgt = \"on\", events = { \"e_burst\" }, effect = \"e_tick\" },
  trans { src = \"on\", tgt = \"other\", events = { \"e_other\" } },
  trans { src = \"other\", tgt = \"on\", events = { \"e_back\", \"other.failed\" } },
  trans { src = \"on\", tgt = \"leaving\", events = { \"e_shutdown\" } },
  trans { src = \"other\", tgt = \"leaving\", events = { \"e_shutdown\" } },
  trans { src = \"failed\", tgt = \"leaving\", events = { \"e_shutdown\", \"e_high\", \"e_low\" } },
  trans { src = \"leaving\", tgt = \"idle\", events = { \"build.undone\" } },
  trans { src = \"leaving\", tgt = \"failed\", events = { \"build.undo.failed\", \"build.undo.broken\" } },
}
";

const MONITORS: &str = "Monitors {
  high = monitor { when = above(\"Source.y\", 0.0), event = \"e_high\", cleared = \"e_low\" },
}
";

struct Flooded {
    session: Arc<Session>,
    clock: Clock,
    heard: Arc<Mutex<Vec<(f64, Happening)>>>,
}

impl Flooded {
    fn with(what: impl FnOnce(&Self)) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("d.yaml", DEPLOYMENT), ("conf.lua", CONFIGURATIONS), ("k.lua", COORDINATOR), ("m.lua", MONITORS)]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let clock = Clock::simulated();
        let _me = clock.enter();
        let libraries = Libraries::new().with(Library::new("noise").with::<Noise>("Noise"));
        let read = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), &libraries).unwrap();
        assert!(read.catalogue.iter().any(|ty| ty.name.as_str() == davit::model::monitor::MONITORS_TYPE));
        let checked = app::check(read).unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let session = app::start(&checked, &clock).unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let log = heard.clone();
        session.hub().observe(Arc::new(move |at, what| log.lock().unwrap().push((at.as_secs_f64(), what.clone()))));
        session.bring_up().unwrap();
        let flooded = Self { session, clock: clock.clone(), heard };
        what(&flooded);
        let ended = flooded.session.take_down(false);
        assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
        clock.shutdown();
    }

    fn count(&self, which: impl Fn(&Happening) -> bool) -> usize {
        self.heard.lock().unwrap().iter().filter(|(_, what)| which(what)).count()
    }

    /// When the first such thing happened.
    fn when(&self, which: impl Fn(&Happening) -> bool) -> Option<f64> {
        self.heard.lock().unwrap().iter().find(|(_, what)| which(what)).map(|(at, _)| *at)
    }
}

fn is_event(what: &Happening, name: &str) -> bool {
    matches!(what, Happening::Event { event, .. } if event == name)
}

#[test]
fn a_chattering_monitor_delays_nothing_and_is_not_remembered_instead_of_all_else() {
    Flooded::with(|flooded| {
        flooded.clock.sleep(Duration::from_secs(20));
        let asked = flooded.clock.now().as_secs_f64();
        flooded.session.raise(event("e_other"), "test");
        flooded.clock.sleep(Duration::from_secs(20));
        let chatter = flooded.count(|what| is_event(what, "e_high") || is_event(what, "e_low"));
        assert!(chatter > 4 * limits::LOG_ENTRIES, "the noise is quiet: {chatter} events");
        // The switch in between was asked for and answered as if it were quiet.
        let answered =
            flooded.when(|what| matches!(what, Happening::Answered(answered) if answered.answer == "other.ok"));
        assert!(answered.expect("answered") - asked <= 0.002, "{answered:?} after {asked}");
        assert!(flooded.session.in_state("other"));
        // The coordinator keeps up: nothing is lost.
        let status = flooded.session.status();
        assert_eq!((status.dropped.outside, status.dropped.report), (0, 0));
        // What was asked and answered is still known, the chatter is its newest part, and the whole is bounded.
        let log = flooded.session.hub().log(usize::MAX);
        assert!(log.len() <= limits::LOG_ENTRIES, "{}", log.len());
        assert!(log.windows(2).all(|pair| pair[0].at <= pair[1].at), "in the order in which it happened");
        for ask in ["build", "other"] {
            let requested = |what: &Happening| matches!(what, Happening::Requested { ask: a, .. } if a == ask);
            assert!(log.iter().any(|entry| requested(&entry.what)), "`{ask}` is forgotten");
        }
        assert!(log.iter().any(|entry| is_event(&entry.what, "e_start")));
        let kept = log.iter().filter(|entry| is_event(&entry.what, "e_high") || is_event(&entry.what, "e_low")).count();
        assert_eq!(kept, limits::LOG_REPORTS);
        assert!(flooded.clock.now().as_secs_f64() - log.last().unwrap().at < 0.01, "the newest is among them");
    });
}

#[test]
fn what_the_inbox_cannot_hold_is_counted_and_told_and_an_operator_goes_first() {
    Flooded::with(|flooded| {
        // As soon as the coordinator's inbox is full, in the midst of the burst, an operator speaks.
        let (session, spoken) = (Arc::downgrade(&flooded.session), Arc::new(AtomicBool::new(false)));
        let once = spoken.clone();
        flooded.session.hub().observe(Arc::new(move |_, what| {
            if matches!(what, Happening::Dropped { .. })
                && !once.swap(true, Ordering::SeqCst)
                && let Some(session) = session.upgrade()
            {
                session.raise(event("e_other"), "test");
            }
        }));
        let burst = ConfigId::new("burst").unwrap();
        flooded.session.request(Ask::Apply(burst), "operator", true);
        flooded.clock.sleep(Duration::from_secs(3));
        let raised = flooded.count(|what| is_event(what, "e_burst"));
        assert_eq!(raised, 6000);
        let status = flooded.session.status();
        assert_eq!(status.dropped.outside, 0);
        let dropped = usize::try_from(status.dropped.report).unwrap();
        // A few of the monitor's came as well.
        assert!((1000..=6010 - limits::INBOX_REPORT).contains(&dropped), "{dropped}");
        // It is told at once, and not once for each.
        let told: Vec<u64> = flooded
            .heard
            .lock()
            .unwrap()
            .iter()
            .filter_map(|(_, what)| match what {
                Happening::Dropped { events } => Some(*events),
                _ => None,
            })
            .collect();
        assert_eq!(told.len(), 2, "the first at once, the others together: {told:?}");
        assert_eq!((told[0], told.iter().sum::<u64>()), (1, status.dropped.report));
        assert!(spoken.load(Ordering::SeqCst));
        // The operator's word overtook what was waiting: in `other` nobody answers the burst.
        assert!(flooded.session.in_state("other"));
        let ticks = flooded.count(|what| matches!(what, Happening::Emitted { event } if event == "e_tick"));
        assert!(ticks < limits::INBOX_REPORT / 2, "{ticks} reports were reacted to before the operator");
        flooded.session.raise(event("e_back"), "test");
        flooded.clock.sleep(Duration::from_secs(1));
        assert!(flooded.session.in_state("on"), "it still listens");
        flooded.session.request(Ask::UndoOf(burst), "operator", false);
        flooded.clock.sleep(Duration::from_millis(100));
    });
}
