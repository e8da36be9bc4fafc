//! What configurations stand for (`holds`): true before they count as applied, watched while they are in force.

use crate::names::id;
use davit::app;
use davit::configurator::Recovery;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::{Ask, ComponentName, RequestId, Step, Value, codes};
use davit::platform::Platform as _;
use davit::platform::simulated::{Simulated, SimulatedOptions};
use davit::runtime::{Builder, Component, ComponentFactory, Context, Libraries, Library, OperationAnswer, Out, Prop};
use davit::session::{Happening, Phase, Session};
use davit::time::{Clock, Time};
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const MS: Duration = Duration::from_millis(1);

/// Goes to the mode that is wanted, one a round, as far as the world lets it; -1: it panics.
struct Drive {
    limit: Arc<AtomicI64>,
    wanted: Prop<f64>,
    mode: Out<f64>,
    now: f64,
}

impl Component for Drive {
    fn new(_: &mut Builder<Self>) -> Self {
        unreachable!("made by its kind")
    }

    fn update(&mut self, _: &mut Context) {
        let limit = self.limit.load(Ordering::SeqCst);
        assert!(limit >= 0, "the drive fails");
        let to = self.wanted.get().min(limit as f64);
        self.now += (to - self.now).clamp(-1.0, 1.0);
        if to < self.now {
            self.now = to;
        }
        self.mode.write(self.now);
    }
}

fn kind(limit: &Arc<AtomicI64>, clock: &Clock) -> ComponentFactory {
    let (limit, clock) = (limit.clone(), clock.clone());
    ComponentFactory::made_by("Drive", move |b: &mut Builder<Drive>| {
        let clock = clock.clone();
        b.caller_operation("settle", move |(): ()| {
            clock.sleep(100 * MS);
            OperationAnswer::Done(())
        });
        Drive { limit: limit.clone(), wanted: b.property("wanted", 0.0), mode: b.output("mode"), now: 0.0 }
    })
}

const DEPLOYMENT: &str = "\
configurations: [conf.lua]
coordinator: coordinator.lua
activities: { control: { period_ms: 10.0 } }
deploy:   { event: e_start, up: up, failed: [failed], within_s: 5 }
shutdown: { event: e_stop,  down: idle, within_s: 5 }
limits:   { step_timeout_s: 0.5 }
";

const COORDINATOR: &str = r#"
return state {
  idle   = state {},
  failed = state {},
  on     = state { config = "make",
    making = state {}, up = state {}, noticed = state {},
    trans { src = "initial", tgt = "making" },
    trans { src = "making", tgt = "up", events = { "make.ok" } },
    trans { src = "up", tgt = "noticed", events = { "engage.lost" } },
    trans { src = "noticed", tgt = "up", events = { "e_again" } },
  },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "on", events = { "e_start" } },
  trans { src = "on", tgt = "failed", events = { "make.failed", "make.broken" } },
  trans { src = "on", tgt = "idle", events = { "e_stop" } },
  trans { src = "failed", tgt = "idle", events = { "e_stop" } },
}
"#;

const CONFIGURATIONS: &str = r#"
ConfiguratorConf {
  make   = Configuration { create("drive", "Drive", { activity = "control" }), post_conf_state = { "drive:running" } },
  engage = Configuration { holds = at_least("drive.mode", 6), property_set("drive.wanted", 8) },
  hasty  = Configuration { holds = at_least("drive.mode", 6), timeout = 0.03, property_set("drive.wanted", 8) },
  slowly = Configuration { holds = at_least("drive.mode", 6), property_set("drive.wanted", 8),
    operation_call("drive.settle"):undo("drive.settle") },
  weaken = Configuration { property_set("drive.wanted", 3) },
  halt   = Configuration { pre_conf_state = { "drive:stopped" } },
}
"#;

pub struct Run {
    pub clock: Clock,
    pub session: Arc<Session>,
    pub heard: Arc<Mutex<Vec<(Time, String)>>>,
    limit: Arc<AtomicI64>,
}

fn folder(head: &str, configurations: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let deployment = format!("davit: 1\nname: drives\n{head}{DEPLOYMENT}");
    for (name, text) in
        [("d.yaml", deployment.as_str()), ("conf.lua", configurations), ("coordinator.lua", COORDINATOR)]
    {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

impl Run {
    fn with(what: impl FnOnce(&Self)) {
        let clock = Clock::simulated();
        let _me = clock.enter();
        let limit = Arc::new(AtomicI64::new(100));
        let libraries = Libraries::new().with(Library::new("drives").with_kind(kind(&limit, &clock)));
        let folder = folder("platform: embedded\nlibraries: [drives]\n", CONFIGURATIONS);
        let checked = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), &libraries)
            .and_then(app::check)
            .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let session = app::start(&checked, &clock).unwrap();
        let run = Self { heard: record(&session), clock: clock.clone(), session, limit };
        run.session.bring_up().unwrap();
        run.clock.sleep(95 * MS);
        what(&run);
        assert!(run.session.take_down(false).is_clean());
        clock.shutdown();
    }

    fn ask(&self, ask: Ask) -> RequestId {
        self.session.request(ask, "test", true)
    }

    /// The answer to a request, which comes within ten seconds.
    fn answer(&self, ask: Ask) -> String {
        let id = self.ask(ask);
        for _ in 0..1000 {
            if let Some(answered) = self.session.hub().answer(id) {
                return answered.answer;
            }
            self.clock.sleep(10 * MS);
        }
        panic!("`{ask}` is not answered")
    }

    fn heard(&self, line: &str) -> usize {
        self.heard.lock().unwrap().iter().filter(|(_, l)| l == line).count()
    }

    fn at(&self, line: &str) -> Time {
        let heard = self.heard.lock().unwrap();
        heard.iter().rev().find(|(_, l)| l == line).unwrap_or_else(|| panic!("never heard {line}: {heard:?}")).0
    }

    fn is_lost(&self, id: &str) -> bool {
        let status = self.session.status();
        let stack = status.stack.unwrap();
        let frame = stack.iter().rev().find(|frame| frame.configuration == id);
        frame.unwrap_or_else(|| panic!("no frame of {id}: {stack:?}")).lost
    }
}

fn record(session: &Session) -> Arc<Mutex<Vec<(Time, String)>>> {
    let heard = Arc::new(Mutex::new(Vec::new()));
    let log = heard.clone();
    session.hub().observe(Arc::new(move |at, what| {
        let line = match what {
            Happening::State { active } => active.last().map_or("", |s| s.as_str()).to_owned(),
            Happening::Answered(answer) => answer.answer.clone(),
            Happening::Lost { event, .. } => event.clone(),
            _ => return,
        };
        log.lock().unwrap().push((at, line));
    }));
    heard
}

fn apply(name: &str) -> Ask {
    Ask::Apply(id(name))
}

#[test]
fn it_counts_as_applied_once_what_it_stands_for_is_true() {
    Run::with(|run| {
        let asked = run.clock.now();
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        // One a round of 10 ms: the sixth is at least 50 ms after the step.
        let took = run.at("engage.ok").since(asked);
        assert!(took >= 50 * MS && took <= 70 * MS, "{took:?}");
        assert!(!run.is_lost("engage"));
    });
}

#[test]
fn it_failed_when_that_does_not_become_true_in_time() {
    Run::with(|run| {
        run.limit.store(5, Ordering::SeqCst);
        let asked = run.clock.now();
        let id = run.ask(apply("engage"));
        run.clock.sleep(700 * MS);
        let answered = run.session.hub().answer(id).unwrap();
        assert_eq!(answered.answer, "engage.failed");
        assert!(answered.reasons[0].contains("what `engage` stands for did not become true"), "{answered:?}");
        let took = run.at("engage.failed").since(asked);
        assert!(took >= 500 * MS && took <= 520 * MS, "by `step_timeout_s`: {took:?}");
        // Its own `timeout` counts where it has one.
        run.limit.store(100, Ordering::SeqCst);
        run.clock.sleep(50 * MS);
        let asked = run.clock.now();
        assert_eq!(run.answer(apply("hasty")), "hasty.failed");
        assert!(run.at("hasty.failed").since(asked) <= 40 * MS);
        let drive = ComponentName::new("drive").unwrap();
        let wanted = &run.session.system().unwrap().components[&drive].properties;
        assert!(format!("{wanted:?}").contains("0.0"), "it was rolled back: {wanted:?}");
        assert!(run.session.status().stack.unwrap().iter().all(|frame| frame.configuration == "make"));
    });
}

#[test]
fn a_value_from_before_the_last_step_does_not_count() {
    Run::with(|run| {
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        // It still shows 8, and never again anything: the world holds it fast from now on.
        assert_eq!(run.answer(apply("halt")), "halt.ok");
        assert_eq!(run.answer(apply("engage")), "engage.failed");
    });
}

#[test]
fn the_coordinator_hears_that_it_is_lost_once_until_it_is_applied_anew() {
    Run::with(|run| {
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        run.clock.sleep(100 * MS);
        assert_eq!(run.heard("engage.lost"), 0);
        let begun = run.clock.now();
        run.limit.store(2, Ordering::SeqCst);
        run.clock.sleep(100 * MS);
        assert!(run.at("engage.lost").since(begun) <= 20 * MS);
        assert!(run.session.in_state("noticed"), "the coordinator heard it");
        assert!(run.is_lost("engage"), "and the frame stays, marked");
        // Up and down again: that was told.
        for limit in [100, 2] {
            run.limit.store(limit, Ordering::SeqCst);
            run.clock.sleep(200 * MS);
        }
        assert_eq!(run.heard("engage.lost"), 1);
        run.limit.store(100, Ordering::SeqCst);
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        assert!(!run.is_lost("engage"));
        run.limit.store(2, Ordering::SeqCst);
        run.clock.sleep(100 * MS);
        assert_eq!(run.heard("engage.lost"), 2);
    });
}

#[test]
fn a_later_configuration_can_make_it_false_its_own_undo_cannot() {
    Run::with(|run| {
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        assert_eq!(run.answer(Ask::UndoOf(id("engage"))), "engage.undone");
        run.clock.sleep(100 * MS);
        assert_eq!(run.heard("engage.lost"), 0, "that was its undo");
        // Also while that is under way for longer than the drive needs to fall.
        assert_eq!(run.answer(apply("slowly")), "slowly.ok");
        assert_eq!(run.answer(Ask::UndoOf(id("slowly"))), "slowly.undone");
        assert_eq!(run.heard("slowly.lost"), 0);
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        assert_eq!(run.answer(apply("weaken")), "weaken.ok");
        run.clock.sleep(100 * MS);
        assert_eq!(run.heard("engage.lost"), 1);
        assert!(run.is_lost("engage") && !run.is_lost("weaken"));
    });
}

#[test]
fn who_stops_what_it_looks_at_ends_it_silently_a_fault_does_not() {
    Run::with(|run| {
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        assert_eq!(run.answer(apply("halt")), "halt.ok");
        run.clock.sleep(700 * MS);
        run.limit.store(2, Ordering::SeqCst);
        assert_eq!(run.answer(Ask::UndoOf(id("halt"))), "halt.undone");
        run.clock.sleep(700 * MS);
        assert_eq!(run.heard("engage.lost"), 0);
        assert!(!run.is_lost("engage"));
        run.limit.store(100, Ordering::SeqCst);
        assert_eq!(run.answer(Ask::UndoOf(id("engage"))), "engage.undone");
        assert_eq!(run.answer(apply("engage")), "engage.ok");
        // Its port goes on showing 8.
        run.limit.store(-1, Ordering::SeqCst);
        run.clock.sleep(100 * MS);
        assert_eq!(run.heard("engage.lost"), 1);
        run.limit.store(100, Ordering::SeqCst);
    });
}

const DECLARED: &str = "platform: simulated
types:
  Drive:
    ports: { mode: { direction: out, type: float } }
    properties: { wanted: { type: float, default: 0.0 } }
    operations: { settle: {} }
";

#[test]
fn where_no_values_can_be_seen_only_a_fault_speaks_against_it() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let folder = folder(DECLARED, CONFIGURATIONS);
    let checked = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), libraries::builtin())
        .and_then(app::check)
        .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
    let warned = checked.findings.iter().filter(|finding| finding.code == codes::CONF_HOLDS_UNSEEN).count();
    assert_eq!(warned, 3, "`check` says so of each: {:?}", checked.findings);
    let platform = Simulated::new(checked.catalogue.clone(), clock.clone(), SimulatedOptions::default());
    let session = app::start_on(&checked, Arc::new(platform.clone()), &clock);
    let run = Run { heard: record(&session), clock: clock.clone(), session, limit: Arc::default() };
    run.session.bring_up().unwrap();
    assert_eq!(run.answer(apply("engage")), "engage.ok");
    let frames = run.session.status().stack.unwrap();
    assert!(frames[1].unseen && !frames[1].lost && !frames[0].unseen, "{frames:?}");
    let drive = ComponentName::new("drive").unwrap();
    assert!(platform.fault(drive, "it burns"));
    run.clock.sleep(10 * MS);
    assert_eq!(run.heard("engage.lost"), 1);
    assert!(run.is_lost("engage"));
    assert!(run.session.in_state("noticed"));
    run.session.take_down(false);
    assert!(platform.observe(clock.now() + MS).unwrap().is_empty());
    clock.shutdown();
}

#[test]
fn what_a_later_look_finds_different_is_lost_too_and_looking_keeps_no_clock_going() {
    let clock = Clock::simulated();
    let me = clock.enter();
    let folder = folder(DECLARED, CONFIGURATIONS);
    let checked = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), libraries::builtin())
        .and_then(app::check)
        .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
    let platform = Simulated::new(checked.catalogue.clone(), clock.clone(), SimulatedOptions::default());
    let session = app::start_on(&checked, Arc::new(platform.clone()), &clock);
    let run = Run { heard: record(&session), clock: clock.clone(), session, limit: Arc::default() };
    run.session.bring_up().unwrap();
    assert_eq!(run.answer(apply("weaken")), "weaken.ok");
    // At rest: with nobody left who waits for a time, time stands still.
    let now = clock.now();
    drop(me);
    assert_eq!(clock.now(), now, "looking now and then does not move time on");
    let _me = clock.enter();
    let property = davit::model::MemberRef::new("drive.wanted").unwrap();
    assert!(platform.tamper(&Step::PropertySet { property, value: Value::Float(99.0) }));
    run.clock.sleep(6000 * MS);
    assert_eq!(run.heard("weaken.lost"), 1);
    assert!(run.is_lost("weaken") && !run.is_lost("make"));
    let status = run.session.status();
    assert_eq!(status.phase, Phase::Broken);
    assert_eq!(status.residual.as_ref().unwrap().len(), 1);
    let shown = serde_json::to_value(&status).unwrap();
    assert_eq!(shown["stack"][1]["lost"], true, "{shown}");
    let recovered = run.session.recover(Recovery::Back, "test", 5000 * MS).unwrap();
    assert!(recovered.recovered);
    let drive = ComponentName::new("drive").unwrap();
    let seen = platform.observe(clock.now() + MS).unwrap();
    assert!(format!("{:?}", seen.components[&drive].properties).contains("3.0"));
    assert!(run.session.take_down(false).is_clean());
    clock.shutdown();
}
