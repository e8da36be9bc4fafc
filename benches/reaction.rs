//! How soon the coordinator reacts to an event: while the configurator is idle, and while it waits for an operation that
//! never returns. Both distributions in one run; they should be one.
//!
//! `cargo bench --bench reaction`

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::{Ask, ConfigId, EventName};
use davit::runtime::{Builder, Component, Library, OperationAnswer};
use davit::session::{Happening, Session};
use davit::time::{Clock, Time};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

const EVENTS: usize = 500;
const ROUNDS: usize = 41;

/// Its operation never returns.
struct Stuck;

impl Component for Stuck {
    fn new(b: &mut Builder<Self>) -> Self {
        b.no_effect().operation("hang", |_, cx, (): ()| -> OperationAnswer { cx.clock().hang() });
        Self
    }
}

const DEPLOYMENT: &str = "\
davit: 1
name: reaction
platform: embedded
libraries: [bench]
activities:
  loop: { period_ms: 1000.0 }
configurations: [configurations.lua]
coordinator: coordinator.lua
deploy:   { event: e_start, up: up,   within_s: 10 }
shutdown: { event: e_stop,  down: idle, within_s: 10 }
limits:   { step_timeout_s: 600.0 }
";

const CONFIGURATIONS: &str = r#"
ConfiguratorConf {
  make = Configuration {
    create("stuck", "bench.Stuck", { activity = "loop" }),
    post_conf_state = { "_default:running" },
  },
  hang = Configuration { operation_call("stuck.hang") },
}
"#;

const COORDINATOR: &str = r#"
return state {
  idle = state {},
  up = state {
    a = state {},
    b = state {},
    trans { src = "initial", tgt = "a" },
    trans { src = "a", tgt = "b", events = { "e_toggle" } },
    trans { src = "b", tgt = "a", events = { "e_toggle" } },
  },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "up", events = { "e_start" }, effect = "make" },
  trans { src = "up", tgt = "idle", events = { "e_stop" }, effect = "make.undo" },
}
"#;

#[allow(clippy::disallowed_methods)] // a benchmark measures real time
fn now() -> Instant {
    Instant::now()
}

fn percentile(sorted: &[u64], share: f64) -> f64 {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
    let at = ((sorted.len() - 1) as f64 * share) as usize;
    sorted[at] as f64 / 1000.0
}

/// A session of which is seen when its coordinator moves.
struct Watched {
    session: Arc<Session>,
    begin: Instant,
    /// When the coordinator was last seen to have moved, in nanoseconds from the beginning.
    moved: Arc<AtomicU64>,
}

#[allow(clippy::cast_possible_truncation)]
impl Watched {
    fn new(checked: &app::Checked, clock: &Clock) -> Self {
        let session = app::start(checked, clock).expect("an embedded platform");
        session.bring_up().expect("up");
        let (begin, moved) = (now(), Arc::new(AtomicU64::new(0)));
        let told = moved.clone();
        session.hub().observe(Arc::new(move |_: Time, what: &Happening| {
            if let Happening::State { .. } = what {
                told.store(begin.elapsed().as_nanos() as u64, Ordering::Release);
            }
        }));
        Self { session, begin, moved }
    }

    /// Nanoseconds from an event to the move it causes, of many events, one after the other.
    fn measure(&self) -> Vec<u64> {
        let toggle = EventName::new("e_toggle").expect("an event");
        let one = |_| {
            self.moved.store(0, Ordering::Release);
            let raised = self.begin.elapsed().as_nanos() as u64;
            self.session.raise(toggle, "bench");
            loop {
                let at = self.moved.load(Ordering::Acquire);
                if at != 0 {
                    return at - raised;
                }
                std::hint::spin_loop();
            }
        };
        (0..EVENTS).map(one).collect()
    }
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in
        [("r.yaml", DEPLOYMENT), ("configurations.lua", CONFIGURATIONS), ("coordinator.lua", COORDINATOR)]
    {
        std::fs::write(folder.path().join(name), text).expect("a folder of ours");
    }
    let libraries = libraries::builtin().with(Library::new("bench").with::<Stuck>("bench.Stuck"));
    let clock = Clock::real();
    let _me = clock.enter();
    let read = app::read(&folder.path().join("r.yaml"), &LoadOptions::default(), &libraries)
        .unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    let checked = app::check(read).unwrap_or_else(|refused| panic!("{:?}", refused.findings));
    // Two of them, measured in turn, so that whatever else the machine does comes to both.
    let idle = Watched::new(&checked, &clock);
    let stuck = Watched::new(&checked, &clock);
    stuck.session.request(Ask::Apply(ConfigId::new("hang").expect("a name")), "bench", true);
    clock.sleep(Duration::from_millis(100)); // the operation is out
    let (mut quick, mut held) = (Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        let (a, b) = (idle.measure(), stuck.measure());
        // The first round warms up.
        if round > 0 {
            quick.extend(a);
            held.extend(b);
        }
    }
    assert!(!stuck.session.hub().all_answered(), "the configurator is still stuck");
    quick.sort_unstable();
    held.sort_unstable();
    println!("event to reaction, µs ({} events each)", quick.len());
    println!("{:>22} {:>9} {:>9} {:>9} {:>9}", "configurator", "median", "90 %", "99 %", "99.9 %");
    for (what, times) in [("idle", &quick), ("in a hung operation", &held)] {
        let of = |share| percentile(times, share);
        println!("{what:>22} {:>9.2} {:>9.2} {:>9.2} {:>9.2}", of(0.5), of(0.9), of(0.99), of(0.999));
    }
    println!("ratio of the medians: {:.2}", percentile(&held, 0.5) / percentile(&quick, 0.5));
    // The operation never returns, so neither would an orderly end.
    std::process::exit(0);
}
