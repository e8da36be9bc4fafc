//! What waits for a coordinator waits in classes (semantics: *Coordinators*): each of them flooded, on a running deployment. How long
//! something waits is counted in turns of the coordinator, never in seconds.

use crate::names::event;
use davit::app;
use davit::coordinator::NotAccepted;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::limits;
use davit::model::{Ask, ComponentName};
use davit::platform::simulated::{Simulated, SimulatedOptions};
use davit::session::{Happening, NotRaised, Session, SessionSetup};
use davit::statechart::compile;
use davit::time::Clock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

const DEPLOYMENT: &str = "davit: 1
name: crowd
platform: simulated
types: { Eye: {} }
configurations: [conf.lua]
coordinator: k.lua
safety: [e_estop, e_press]
emits: [urgent, word, report, outside]
deploy: { event: e_start, up: on, within_s: 30 }
shutdown: { event: e_shutdown, down: idle, within_s: 30 }
";

/// Every turn of the coordinator emits what it was. So many requests are unanswered at any time: for each answer the next one
/// is asked for.
fn coordinator(requests: usize) -> String {
    let asks = "\"ask\", ".repeat(requests);
    format!(
        "return state {{
           idle = state {{}}, building = state {{ entry = \"build\" }}, halted = state {{}},
           leaving = state {{ entry = \"build.undo\" }},
           on = state {{}},
           trans {{ src = \"initial\", tgt = \"idle\" }},
           trans {{ src = \"idle\", tgt = \"building\", events = {{ \"e_start\" }} }},
           trans {{ src = \"building\", tgt = \"on\", events = {{ \"build.ok\" }} }},
           trans {{ src = \"on\", tgt = \"on\", events = {{ \"e_begin\" }}, effect = {{ {asks} \"word\" }} }},
           trans {{ src = \"on\", tgt = \"on\", events = {{ \"ask.ok\" }}, effect = {{ \"ask\", \"word\" }} }},
           trans {{ src = \"on\", tgt = \"on\", events = {{ \"ask.failed\" }}, effect = \"word\" }},
           trans {{ src = \"on\", tgt = \"on\", events = {{ \"e_press\" }}, effect = \"urgent\" }},
           trans {{ src = \"on\", tgt = \"on\", events = {{ \"e_seen\" }}, effect = \"report\" }},
           trans {{ src = \"on\", tgt = \"on\", events = {{ \"e_click\" }}, effect = \"outside\" }},
           trans {{ src = \"on\", tgt = \"halted\", events = {{ \"e_estop\" }} }},
           trans {{ src = \"on\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
           trans {{ src = \"halted\", tgt = \"leaving\", events = {{ \"e_shutdown\" }} }},
           trans {{ src = \"leaving\", tgt = \"idle\", events = {{ \"build.undone\" }} }},
         }}"
    )
}

const CONFIGURATIONS: &str = "ConfiguratorConf {
  build = Configuration { create(\"Eye\", \"Eye\") },
  ask = Configuration { group = \"asked\" },
}
";

/// A deployment that is up, on a platform whose components say what the test lets them say.
struct Crowd {
    session: Arc<Session>,
    platform: Simulated,
    clock: Clock,
    eye: ComponentName,
}

impl Crowd {
    fn up(requests: usize) -> Arc<Self> {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("d.yaml", DEPLOYMENT), ("conf.lua", CONFIGURATIONS), ("k.lua", coordinator(requests).as_str())]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        // What it does under a flood is no business of `check`: it is started as it is written.
        let read = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), libraries::builtin());
        let read = read.unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let clock = Clock::real();
        let platform = Simulated::new(read.catalogue.clone(), clock.clone(), SimulatedOptions::default());
        let charts = read.deployment.charts().map(|written| Arc::new(compile(written).0.expect("a chart"))).collect();
        let session = Session::start(SessionSetup {
            deployment: Arc::new(read.deployment.clone()),
            charts,
            functions: vec![None],
            catalogue: read.catalogue.clone(),
            platform: Arc::new(platform.clone()),
            clock: clock.clone(),
        });
        session.bring_up().unwrap();
        Arc::new(Self { session, platform, clock, eye: ComponentName::new("Eye").unwrap() })
    }

    fn report(&self, name: &str) {
        self.platform.raise(self.eye, event(name));
    }

    fn until(&self, what: &str, mut look: impl FnMut() -> bool) {
        let deadline = self.clock.now() + Duration::from_secs(120);
        while !look() {
            assert!(self.clock.now() < deadline, "never: {what}");
            self.clock.sleep(Duration::from_millis(1));
        }
    }

    /// Calls `hear` with what each turn emits, and `turn` before each turn's names are raised, both in the coordinator's
    /// thread.
    fn observe(&self, hear: impl Fn(&str) + Send + Sync + 'static, turn: impl Fn(&str) + Send + Sync + 'static) {
        self.session.hub().observe(Arc::new(move |_, what| match what {
            Happening::Emitted { event } => hear(event),
            Happening::State { active } => turn(active.last().map_or("", |leaf| leaf)),
            _ => {}
        }));
    }

    fn down(&self) {
        let ended = self.session.take_down(false);
        assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    }
}

/// In how many turns each kind goes again, at most.
fn longest(turns: &[String], kind: &str) -> usize {
    let at: Vec<usize> = (0..turns.len()).filter(|turn| turns[*turn] == kind).collect();
    let gaps = at.windows(2).map(|pair| pair[1] - pair[0]);
    let ends = [at.first().map(|first| first + 1), at.last().map(|last| turns.len() - last)];
    gaps.chain(ends.into_iter().flatten()).max().unwrap_or(usize::MAX)
}

#[test]
fn with_every_class_flooded_at_once_each_has_its_turns() {
    const TURNS: usize = 2000;
    let crowd = Crowd::up(40);
    let turns: Arc<Mutex<Vec<String>>> = Arc::default();
    let (log, own) = (turns.clone(), Arc::downgrade(&crowd));
    let heard = turns.clone();
    let (stop, halted): (Arc<OnceLock<usize>>, Arc<OnceLock<usize>>) = <_>::default();
    let (stopped, told) = (stop.clone(), halted.clone());
    crowd.observe(
        move |event| log.lock().unwrap().push(event.to_owned()),
        move |leaf| {
            let Some(crowd) = own.upgrade() else { return };
            let turns = heard.lock().unwrap().len();
            if leaf == "root.halted" {
                told.get_or_init(|| turns);
            }
            if leaf != "root.on" || turns == 0 || stopped.get().is_some() {
                return;
            }
            // Every class is full again before the next turn, and every answer is there.
            crowd.report("e_press");
            (0..if turns == 1 { 2 * limits::INBOX_REPORT } else { 3 }).for_each(|_| crowd.report("e_seen"));
            while crowd.session.offer(event("e_click"), "test").is_ok() {}
            crowd.until("the answers", || crowd.session.hub().all_answered());
            if turns == TURNS {
                // The stop of a component, while all others crowd.
                stopped.get_or_init(|| turns);
                crowd.report("e_estop");
            }
        },
    );
    crowd.session.raise(event("e_begin"), "test");
    crowd.until("the stop is heard", || halted.get().is_some());
    // The turn in which it was raised, one of urgent events that came before, and one of each other class.
    let (raised, halted) = (*stop.get().unwrap(), *halted.get().unwrap());
    assert!(halted - raised <= 4, "it waited for {} turns", halted - raised);
    let turns = turns.lock().unwrap().split_off(2);
    let row = limits::INBOX_ROW;
    assert!(longest(&turns, "urgent") <= 3, "{}", longest(&turns, "urgent"));
    assert!(longest(&turns, "word") <= row + 3, "{}", longest(&turns, "word"));
    for kind in ["report", "outside"] {
        assert!(longest(&turns, kind) <= (row + 1) * (row + 1), "{kind}: {}", longest(&turns, kind));
    }
    let dropped = crowd.session.status().dropped;
    assert!(dropped.report >= limits::INBOX_REPORT as u64 - 1 && dropped.outside > 0, "counted: {dropped:?}");
    crowd.down();
}

#[test]
fn a_flood_from_outside_is_refused_and_displaces_no_answer_and_no_shutdown() {
    const EACH: usize = 5000;
    let crowd = Crowd::up(20);
    // The coordinator stands still as long as the gate is closed.
    let (closed, stands) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let (since, leaves) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicUsize::new(usize::MAX)));
    let (gate, standing, own) = (closed.clone(), stands.clone(), Arc::downgrade(&crowd));
    let (turns, left) = (since.clone(), leaves.clone());
    crowd.observe(
        |_| {},
        move |leaf| {
            let Some(crowd) = own.upgrade() else { return };
            if leaf == "root.leaving" {
                left.store(turns.load(Ordering::SeqCst), Ordering::SeqCst);
            }
            turns.fetch_add(1, Ordering::SeqCst);
            if gate.load(Ordering::SeqCst) {
                standing.store(true, Ordering::SeqCst);
                crowd.until("the gate opens", || !gate.load(Ordering::SeqCst));
                turns.store(0, Ordering::SeqCst);
            }
        },
    );
    crowd.session.raise(event("e_begin"), "test");
    closed.store(true, Ordering::SeqCst);
    crowd.until("it stands still", || stands.load(Ordering::SeqCst));
    let send = || {
        let crowd = crowd.clone();
        std::thread::spawn(move || {
            let sent = (0..EACH).map(|_| crowd.session.offer(event("e_click"), "test"));
            let refused = sent.filter(|sent| *sent == Err(NotAccepted::Full.into())).count();
            EACH - refused
        })
    };
    let clients: Vec<_> = std::iter::repeat_with(send).take(4).collect();
    let accepted: usize = clients.into_iter().map(|client| client.join().unwrap()).sum();
    assert_eq!(accepted, limits::INBOX_OUTSIDE, "the others are told so");
    assert_eq!(crowd.session.status().dropped.outside, (4 * EACH - limits::INBOX_OUTSIDE) as u64);
    crowd.until("the answers are there", || crowd.session.hub().outstanding().len() < 20);
    crowd.session.raise(event("e_shutdown"), "test");
    closed.store(false, Ordering::SeqCst);
    crowd.until("it leaves", || leaves.load(Ordering::SeqCst) != usize::MAX);
    assert!(leaves.load(Ordering::SeqCst) <= 1, "the shutdown event is next: {leaves:?}");
    // It comes down by its own answers, of which none was lost.
    crowd.down();
}

/// Also one that is embedded tells no coordinator what only the configurator knows.
#[test]
fn what_an_answer_tells_comes_from_nobody_else() {
    let crowd = Crowd::up(1);
    let heard = Arc::new(AtomicUsize::new(0));
    let count = heard.clone();
    crowd.observe(move |event| _ = count.fetch_add(usize::from(event == "word"), Ordering::SeqCst), |_| {});
    for name in ["ask.ok", "ask.failed"] {
        assert!(matches!(crowd.session.offer(event(name), "test"), Err(NotRaised::NotFromOutside(_))), "{name}");
        assert!(crowd.session.offer_watched(event(name), "test").is_err(), "{name}");
        assert!(crowd.session.offer_to(event(name), &crowd.session.coordinators(), "test").is_err(), "{name}");
        crowd.session.raise(event(name), "test");
    }
    let log = crowd.session.hub().log(usize::MAX);
    let noted = |what: &Happening| matches!(what, Happening::Noted { note } if note.contains("`ask.ok` is an answer"));
    assert!(log.iter().any(|entry| noted(&entry.what)), "{log:?}");
    crowd.session.raise(event("e_begin"), "test");
    crowd.until("the first word", || heard.load(Ordering::SeqCst) > 0);
    crowd.down();
}

#[test]
fn room_for_an_answer_is_taken_when_it_is_asked_for() {
    const ASKED: usize = limits::INBOX_ANSWERS + 6;
    let crowd = Crowd::up(ASKED);
    let (words, told): (Arc<AtomicUsize>, Arc<Mutex<Vec<String>>>) = <_>::default();
    let (count, answers) = (words.clone(), told.clone());
    crowd.observe(move |event| _ = count.fetch_add(usize::from(event == "word"), Ordering::SeqCst), |_| {});
    crowd.session.hub().observe(Arc::new(move |_, what| {
        if let Happening::Answered(answered) = what {
            answers.lock().unwrap().push(format!("{}: {}", answered.answer, answered.reasons.join(", ")));
        }
    }));
    crowd.session.raise(event("e_begin"), "test");
    // More than the configurator takes, too: each is answered, the six beyond with one word.
    crowd.until("all are answered", || told.lock().unwrap().len() == ASKED);
    crowd.until("all are heard", || words.load(Ordering::SeqCst) > limits::INBOX_ANSWERS + 1);
    let told = std::mem::take(&mut *told.lock().unwrap());
    assert!(told.iter().all(|answer| answer.starts_with("ask.failed")), "{told:?}");
    assert_eq!(told.iter().filter(|answer| answer.ends_with("no room for another answer")).count(), 6);
    assert!(crowd.session.hub().all_answered());
    crowd.session.request(Ask::Apply(davit::model::ConfigId::new("ask").unwrap()), "operator", true);
    crowd.down();
    assert_eq!(words.load(Ordering::SeqCst), 1 + limits::INBOX_ANSWERS + 1);
}
