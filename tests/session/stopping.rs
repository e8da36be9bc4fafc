//! The three stages of stopping, on a deployment of two components: what each does, and what it leaves to the next.

use crate::names::event;
use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::{Ask, ConfigId, RunState};
use davit::platform::Platform;
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, Simulated, SimulatedOptions, StepPattern};
use davit::session::log::LogEntry;
use davit::session::service::SessionService;
use davit::session::socket::Service;
use davit::session::{Command, Ended, Happening, Phase, Session, Stage, rpc};
use davit::time::{Clock, Guard};
use serde_json::{Value as Json, json};
use std::sync::{Arc, Mutex};
use std::time::Duration;

const DEPLOYMENT: &str = "davit: 1
name: small
platform: simulated
types:
  T:
    properties: { k: { type: float, default: 1.0 }, g: { type: float, default: 1.0 } }
    operations:
      raise: { effect: { undo: lower }, moves: true }
      lower: { effect: { undo: raise }, moves: true }
      open: { effect: { undo: close } }
      close: { effect: { undo: open } }
configurations: [conf.lua]
coordinator: coordinator.lua
safety: [e_estop]
operator: [soft, stiff, look, hoist, lift]
deploy:   { event: e_start, up: up, failed: [failed], within_s: 20 }
shutdown: { event: e_stop, down: idle, within_s: 5, rest: [rest] }
";

const CONFIGURATIONS: &str = r#"ConfiguratorConf {
  base = Configuration { create("a", "T"), create("b", "T"), post_conf_state = { "_default:running" } },
  lift = Configuration { timeout = 10.0, operation_call("a.raise") },
  soft = Configuration { property_set("b.k", 3.0) },
  stiff = Configuration { property_set("b.k", 4.0) },
  look = Configuration { operation_call("b.open") },
  hoist = Configuration { operation_call("b.raise") },
  calm = Configuration { safe = true, property_set("a.g", 0.0) },
  rest = Configuration { timeout = 10.0, operation_call("a.lower"):undo("a.raise"), operation_call("b.open") },
}
"#;

/// `leading`: what happens when it is up and `e_stop` comes.
fn coordinator(leading: &str) -> String {
    format!(
        r#"return state {{
  idle = state {{}}, building = state {{ entry = "base" }}, lifting = state {{ entry = "lift" }}, up = state {{}}, failed = state {{}},
  lowering = state {{ entry = "lift.undo" }}, removing = state {{ entry = "base.undo" }}, deaf = state {{}},
  safe = state {{ entry = "calm" }}, resting = state {{ entry = "rest" }},
  trans {{ src = "initial", tgt = "idle" }},
  trans {{ src = "idle", tgt = "building", events = {{ "e_start" }} }},
  trans {{ src = "building", tgt = "lifting", events = {{ "base.ok" }} }},
  trans {{ src = "building", tgt = "failed", events = {{ "base.failed", "base.broken" }} }},
  trans {{ src = "lifting", tgt = "up", events = {{ "lift.ok" }} }},
  trans {{ src = "lifting", tgt = "failed", events = {{ "lift.failed", "lift.broken" }} }},
  trans {{ src = "lifting", tgt = "lowering", events = {{ "e_stop" }} }},
  trans {{ src = "up", tgt = "{leading}", events = {{ "e_stop" }} }},
  trans {{ src = "up", tgt = "safe", events = {{ "e_estop" }} }},
  trans {{ src = "lifting", tgt = "safe", events = {{ "e_estop" }} }},
  trans {{ src = "lowering", tgt = "safe", events = {{ "e_estop" }} }},
  trans {{ src = "lowering", tgt = "removing", events = {{ "lift.undone" }} }},
  trans {{ src = "lowering", tgt = "failed", events = {{ "lift.undo.failed", "lift.undo.broken" }} }},
  easing = state {{}}, held = state {{ entry = "calm" }}, releasing = state {{ entry = "calm.undo" }}, cooling = state {{}},
  trans {{ src = "easing", tgt = "held", events = {{ "e_estop" }} }},
  trans {{ src = "held", tgt = "releasing", events = {{ "e_stop" }} }},
  trans {{ src = "releasing", tgt = "cooling", events = {{ "calm.undone" }} }},
  trans {{ src = "cooling", tgt = "lowering", events = {{ "e_after(2.5)" }} }},
  trans {{ src = "removing", tgt = "idle", events = {{ "base.undone" }} }},
  trans {{ src = "removing", tgt = "failed", events = {{ "base.undo.failed", "base.undo.broken" }} }},
}}
"#
    )
}

pub struct Small {
    pub clock: Clock,
    pub platform: Simulated,
    pub session: Arc<Session>,
    pub heard: Arc<Mutex<Vec<String>>>,
    _guard: Guard,
}

impl Small {
    /// Raising and lowering take 2 s each.
    pub fn new(leading: &str, faults: Vec<FaultRule>) -> Self {
        Self::on(leading, faults, |platform| Arc::new(platform))
    }

    /// The same with something between it and its platform.
    pub fn on(leading: &str, faults: Vec<FaultRule>, wrap: impl FnOnce(Simulated) -> Arc<dyn Platform>) -> Self {
        Self::of(leading, &[], "d.yaml", faults, wrap)
    }

    /// The same of a file beside these, in which it may be a subsystem.
    pub fn of(
        leading: &str,
        more: &[(&str, &str)],
        main: &str,
        faults: Vec<FaultRule>,
        wrap: impl FnOnce(Simulated) -> Arc<dyn Platform>,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let coordinator = coordinator(leading);
        let own = [("d.yaml", DEPLOYMENT), ("conf.lua", CONFIGURATIONS), ("coordinator.lua", coordinator.as_str())];
        for (name, text) in own.iter().chain(more) {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        // It is about a coordinator that does not do what `check` demands.
        let read = app::read(&folder.path().join(main), &LoadOptions::default(), libraries::builtin());
        let checked = read
            .and_then(|read| app::check_while(read, true, &|_| Ok(())))
            .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let clock = Clock::simulated();
        let guard = clock.enter();
        let two = |step: &str| (StepPattern::new(step), Duration::from_secs(2));
        let inside = ["operation_call in/a.raise", "operation_call in/a.lower"];
        let of = ["operation_call a.raise", "operation_call a.lower"].into_iter().chain(inside).map(two).collect();
        let delays = Delays { of, ..Delays::default() };
        let options =
            SimulatedOptions { faults: Faults::new(faults), delays, blocking: true, ..SimulatedOptions::default() };
        let platform = Simulated::new(checked.catalogue.clone(), clock.clone(), options);
        platform.record();
        let session = app::start_on(&checked, wrap(platform.clone()), &clock);
        let heard = Arc::new(Mutex::new(Vec::new()));
        let log = heard.clone();
        session.hub().observe(Arc::new(move |_, what| {
            let line = match what {
                Happening::Answered(answer) => answer.answer.clone(),
                Happening::Stopping { stage, .. } => format!("{stage:?}"),
                _ => return,
            };
            log.lock().unwrap().push(line);
        }));
        Self { clock, platform, session, heard, _guard: guard }
    }

    pub fn up(leading: &str) -> Self {
        let small = Self::new(leading, Vec::new());
        small.session.bring_up().unwrap_or_else(|not| panic!("{not:#?}"));
        small.platform.record();
        small
    }

    /// Somebody does something so many seconds from now, while this thread is stopping it.
    pub fn after(&self, seconds: f64, what: impl FnOnce(&Session) + Send + 'static) {
        let (clock, session) = (self.clock.clone(), self.session.clone());
        self.clock.spawn("somebody", move || {
            clock.sleep(Duration::from_secs_f64(seconds));
            what(&session);
        });
    }

    /// The steps that the platform was asked for since they were read last.
    pub fn steps(&self) -> Vec<String> {
        self.platform.record().iter().map(ToString::to_string).collect()
    }

    pub fn heard(&self, what: &str) -> bool {
        self.heard.lock().unwrap().iter().any(|line| line == what)
    }

    pub fn stop(&self) -> (Ended, f64) {
        let began = self.clock.now();
        let ended = self.session.take_down(false);
        (ended, self.clock.now().since(began).as_secs_f64())
    }

    /// Nothing is there, whatever is said.
    #[track_caller]
    pub fn is_empty(&self) {
        let seen = self.platform.observe(self.clock.now() + Duration::from_secs(1)).unwrap();
        assert!(seen.is_empty(), "{seen:?}");
    }
}

impl Small {
    /// An operator has applied these, one after the other.
    pub fn with(self, applied: &[&str]) -> Self {
        for id in applied {
            self.session.request(Ask::Apply(ConfigId::new(id).unwrap()), "operator", false);
            self.clock.sleep(Duration::from_secs(1));
            assert!(self.heard(&format!("{id}.ok")), "{:?}", self.heard.lock().unwrap());
        }
        self.steps();
        self
    }

    /// Why something was answered so.
    pub fn why(&self, answered: &str) -> String {
        let log = self.session.hub().log(usize::MAX);
        let mut why = log.iter().rev().filter_map(|entry| match &entry.what {
            Happening::Answered(answer) if answer.answer == answered => Some(answer.reasons.join("; ")),
            _ => None,
        });
        why.next().unwrap_or_else(|| panic!("no {answered}: {:?}", self.heard.lock().unwrap()))
    }

    pub fn in_force(session: &Session) -> Vec<String> {
        session
            .status()
            .stack
            .unwrap()
            .iter()
            .map(|frame| format!("{}{}", frame.configuration, ["", " partial"][usize::from(frame.partial)]))
            .collect()
    }
}

pub fn force(session: &Session) {
    session.command(Command::Shutdown { force: true });
}

#[test]
fn its_coordinator_leads_down() {
    let small = Small::up("lowering");
    let (ended, took) = small.stop();
    assert!(ended.is_orderly() && ended.forced.is_empty(), "{ended:?}");
    assert!((2.0..3.0).contains(&took), "{took}");
    small.is_empty();
}

#[test]
fn a_bring_up_that_is_interrupted_is_led_down_too() {
    let small = Small::new("lowering", Vec::new());
    small.after(1.0, |session| session.command(Command::Shutdown { force: false }));
    let not_up = small.session.bring_up().unwrap_err();
    assert!(not_up.interrupted && not_up.ended.is_orderly(), "{not_up:?}");
    assert!(small.steps().iter().any(|step| step.contains("a.lower")), "what was half raised is lowered");
    small.is_empty();
}

/// The state in which a bring-up failed hears nothing: what was done is taken back, and nobody waits for a coordinator.
#[test]
fn a_bring_up_that_failed_is_taken_back_where_nobody_leads_down() {
    let small = Small::new("lowering", vec![FaultRule::on("operation_call a.raise", Fault::Fail)]);
    let began = small.clock.now();
    let not_up = small.session.bring_up().unwrap_err();
    assert!(small.clock.now().since(began) < Duration::from_secs(4), "it waited for a coordinator that does not hear");
    assert_eq!((not_up.ended.stage, not_up.interrupted), (Stage::TakenBack, false), "{not_up:?}");
    assert!(not_up.ended.is_clean() && !not_up.ended.is_orderly(), "{not_up:?}");
    small.is_empty();
    // Where nothing was done nothing had to be taken back.
    let small = Small::new("lowering", vec![FaultRule::on("create a", Fault::Fail)]);
    let not_up = small.session.bring_up().unwrap_err();
    assert!(not_up.ended.is_orderly(), "{not_up:?}");
}

#[test]
fn a_coordinator_that_does_not_come_down_is_left_out_and_everything_is_taken_back() {
    let small = Small::up("deaf");
    let (ended, took) = small.stop();
    assert_eq!(ended.stage, Stage::TakenBack, "{ended:?}");
    assert!(ended.is_clean(), "{ended:?}");
    // Its time, and the compensation of what was raised.
    assert!((7.0..8.0).contains(&took), "{took}");
    let steps = small.steps();
    let at =
        |what: &str| steps.iter().position(|step| step.contains(what)).unwrap_or_else(|| panic!("{what}: {steps:?}"));
    assert!(at("a.lower") < at("stop a"), "{steps:?}");
    small.is_empty();
}

/// It comes to rest by the event that ends the deployment and no further; what was lowered is not raised again by whoever
/// stops it then.
#[test]
fn what_was_put_to_rest_before_it_was_stopped_is_not_raised_again() {
    for by_event in [true, false] {
        let small = Small::up("resting");
        if by_event {
            small.session.raise(event("e_stop"), "test");
            small.clock.sleep(Duration::from_secs(60));
            assert!(small.heard("rest.ok"), "{:?}", small.heard.lock().unwrap());
        }
        let (ended, _) = small.stop();
        assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
        let steps = small.steps();
        assert!(!steps.iter().any(|step| step.contains("a.raise")), "{steps:?}");
        small.is_empty();
    }
}

#[test]
fn force_comes_when_it_is_asked_for_in_every_stage() {
    // In the first, while the coordinator has it lowered; in the second, while that is taken back.
    for (leading, at, stages) in
        [("lowering", 1.0, "Led Forced"), ("deaf", 2.0, "Led Forced"), ("deaf", 6.0, "Led TakenBack Forced")]
    {
        let small = Small::up(leading);
        small.after(at, force);
        let (ended, took) = small.stop();
        let told: Vec<String> = small.heard.lock().unwrap().clone();
        let told: Vec<&str> = told.iter().map(String::as_str).filter(|line| !line.contains('.')).collect();
        assert_eq!(told.join(" "), stages, "{ended:?}");
        assert_eq!(ended.stage, Stage::Forced);
        assert!(ended.is_clean() && took < at + 4.0, "{took} {ended:?}");
        // What is safe, what brings it to rest, then everything.
        let steps = small.steps();
        let at = |what: &str| {
            steps.iter().rposition(|step| step.contains(what)).unwrap_or_else(|| panic!("{what}: {steps:?}"))
        };
        assert!(at("a.g") < at("a.lower") && at("a.lower") < at("stop a"), "{steps:?}");
        small.is_empty();
    }
}

/// What a safe configuration holds is let go by people only, and nothing moves on the way.
#[test]
fn what_is_held_waits_for_force_and_is_not_moved() {
    let small = Small::up("deaf");
    small.session.raise(event("e_estop"), "test");
    small.clock.sleep(Duration::from_secs(1));
    assert!(small.heard("calm.ok"));
    small.steps();
    small.after(100.0, |session| {
        let view = session.status().stopping.expect("it is being stopped");
        assert!(view.held && view.stage == Stage::TakenBack, "{view:?}");
        assert_eq!(session.system().unwrap().components.values().next().unwrap().state, RunState::Running);
        force(session);
    });
    let (ended, took) = small.stop();
    assert!((100.0..102.0).contains(&took), "{took}");
    assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
    let steps = small.steps();
    assert!(!steps.iter().any(|step| step.contains("operation_call")), "{steps:?}");
    small.is_empty();
}

/// Nobody is there to let go: what the safe configuration holds is not taken away, and nothing is commanded any more.
#[test]
fn what_nobody_attends_is_not_waited_for_and_stays() {
    let small = Small::up("deaf");
    small.session.raise(event("e_estop"), "test");
    small.clock.sleep(Duration::from_secs(1));
    small.session.unattended();
    small.steps();
    let (ended, took) = small.stop();
    assert!(took < 8.0 && ended.stage == Stage::TakenBack && !ended.is_clean(), "{took} {ended:?}");
    let says = "`calm` is in force, and nobody is there to ask for force: what is left stays as it is";
    assert!(ended.forced.iter().any(|note| note == says), "{ended:?}");
    assert_eq!(small.steps(), Vec::<String>::new(), "nothing but what `calm` holds was there to be taken back");
    assert_eq!(small.session.system().unwrap().components.len(), 2);
}

/// An emergency while it is led down: its coordinator is not left out while what is safe is in force; shut down again, it is
/// told again.
#[test]
fn an_emergency_on_the_way_down_stops_the_time() {
    let small = Small::up("lowering");
    small.after(1.0, |session| session.raise(event("e_estop"), "test"));
    // Whoever looks at the terminal is told before the time of the stage would be over.
    small.after(4.0, |session| {
        let told = |entry: &&Arc<LogEntry>| matches!(&entry.what, Happening::Noted { note } if note.contains("nothing goes on before"));
        assert_eq!(session.hub().log(usize::MAX).iter().filter(told).count(), 1);
    });
    small.after(60.0, |session| {
        let status = session.status();
        let view = status.stopping.expect("it is being stopped");
        assert_eq!(view.stage, Stage::Led, "{:?}", status.coordinator);
        let still = view.stands_still.expect("it waits for people").to_string();
        let says = "its coordinator hears nothing there that is open now; `davit shutdown --force`";
        assert!(still.starts_with("`calm` is in force since ") && still.contains(says), "{still}");
        force(session);
    });
    let (ended, took) = small.stop();
    assert!((62.0..63.0).contains(&took), "{took}");
    assert!(ended.is_clean(), "{ended:?}");
    let calls = small.steps().iter().filter(|step| step.contains("operation_call a.")).count();
    assert_eq!(calls, 2, "nothing moves before somebody asks: {:?}", small.heard.lock().unwrap());
}

/// From when people let it go on it has as long as from the beginning, whenever that was.
#[test]
fn after_an_emergency_on_the_way_down_the_time_begins_anew() {
    for again in [3.5, 9.0] {
        let small = Small::up("easing");
        small.after(1.0, |session| session.raise(event("e_estop"), "test"));
        small.after(again, |session| session.command(Command::Shutdown { force: false }));
        let (ended, took) = small.stop();
        assert!(ended.is_orderly() && (again + 4.5..again + 5.0).contains(&took), "{again}: {took} {ended:?}");
    }
}

/// The event that ends the deployment leads down whoever raises it, and that is what is seen, also where an emergency keeps it.
#[test]
fn an_event_that_leads_down_is_seen_as_that() {
    let small = Small::up("easing");
    let (seen, raise) = (|| small.session.status().phase, |name| small.session.raise(event(name), "test"));
    let wait = |seconds| small.clock.sleep(Duration::from_secs(seconds));
    assert_eq!(seen(), Phase::Up);
    for name in ["e_stop", "e_estop"] {
        raise(name);
        wait(1);
        assert_eq!(seen(), Phase::ShuttingDown, "after {name}");
    }
    assert!(small.heard("calm.ok"));
    raise("e_stop");
    wait(10);
    assert_eq!(seen(), Phase::Down, "{:?}", small.heard.lock().unwrap());
    small.is_empty();
    raise("e_start");
    wait(10);
    assert_eq!(seen(), Phase::Up, "it is brought up anew");
}

/// An emergency while it comes up: late as it is then, nothing is lowered before somebody asks.
#[test]
fn an_emergency_on_the_way_up_stops_the_time() {
    let small = Small::new("lowering", Vec::new());
    small.after(1.0, |session| session.raise(event("e_estop"), "test"));
    small.after(60.0, force);
    let began = small.clock.now();
    let not_up = small.session.bring_up().unwrap_err();
    let took = small.clock.now().since(began).as_secs_f64();
    assert!(took >= 60.0 && not_up.interrupted, "{took}: {not_up:?}");
    let log = small.session.hub().log(usize::MAX);
    let told = log.iter().filter(
        |entry| matches!(&entry.what, Happening::Noted { note } if note.starts_with("not up after 20 s, and something safe")),
    );
    assert_eq!(told.count(), 1, "who waits for it to come up is told why it does not");
    let calls = small.steps().iter().filter(|step| step.contains("a.raise")).count();
    assert_eq!(calls, 1, "nothing moves after it: {:?}", small.heard.lock().unwrap());
}

/// An emergency while force brings it to rest: nothing is taken away before somebody asks once more, and nothing moves any more.
#[test]
fn an_emergency_while_it_is_forced_waits_for_people() {
    let small = Small::up("lowering");
    small.after(1.0, |session| session.raise(event("e_estop"), "test"));
    small.after(30.0, force);
    let began = small.clock.now();
    let ended = small.session.take_down(true);
    let took = small.clock.now().since(began).as_secs_f64();
    assert!((30.0..32.0).contains(&took), "{took}: {ended:?}");
    let calls = small.steps().iter().filter(|step| step.contains("a.lower")).count();
    assert_eq!(calls, 1, "nothing moves any more: {:?}", small.heard.lock().unwrap());
    // What was broken off has not come to rest, and nobody is told that it has.
    let told = |words: &str| ended.forced.iter().filter(|note| note.contains(words)).count();
    assert!(told("to come to rest, applied as far as it went") > 0 && told("interrupted by") > 0, "{ended:?}");
    assert!(!ended.forced.iter().any(|note| note.ends_with("to come to rest, applied")), "{ended:?}");
    small.is_empty();
}

/// One that waits for its coordinator when force begins is not lost with that: it acts by itself, and people let go.
#[test]
fn an_emergency_that_nobody_has_reacted_to_when_force_begins_waits_for_people() {
    let small = Small::up("lowering");
    small.session.raise(event("e_estop"), "test");
    small.after(30.0, force);
    let began = small.clock.now();
    let ended = small.session.take_down(true);
    let took = small.clock.now().since(began).as_secs_f64();
    assert!((30.0..33.0).contains(&took), "{took}: {ended:?}");
    assert!(small.heard("calm.ok"), "{:?}", small.heard.lock().unwrap());
    let note = "`e_estop` came before, and no coordinator had reacted to it: it acts by itself";
    assert!(ended.forced.iter().any(|told| told == note), "{ended:?}");
    assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
    small.is_empty();
}

/// The same where nobody is there to ask: it is made safe all the same, and stays.
#[test]
fn an_emergency_that_nobody_has_reacted_to_is_acted_on_where_nobody_attends() {
    let small = Small::up("lowering");
    small.session.unattended();
    small.session.raise(event("e_estop"), "test");
    let ended = small.session.take_down(true);
    assert!(small.heard("calm.ok"), "{:?}", small.heard.lock().unwrap());
    let note = "`calm` is in force, and nobody is there to ask for force: what is left stays as it is";
    assert!(!ended.left.is_empty() && ended.forced.iter().any(|told| told == note), "{ended:?}");
}

/// Where nothing is left nothing holds it.
#[test]
fn an_emergency_that_nobody_has_reacted_to_keeps_nobody_waiting_where_nothing_is_there() {
    let small = Small::new("lowering", Vec::new());
    small.session.unattended();
    small.clock.sleep(Duration::from_secs(1));
    small.session.raise(event("e_estop"), "test");
    let ended = small.session.take_down(true);
    assert!(ended.is_clean(), "{ended:?}");
}

/// When no coordinator hears it any more, a safety event acts by itself: the call under way is given up, and nothing moves.
#[test]
fn a_safety_event_acts_by_itself_once_nobody_leads() {
    let small = Small::up("deaf");
    small.after(6.0, |session| session.raise(event("e_estop"), "test"));
    small.after(50.0, force);
    let (ended, took) = small.stop();
    assert!(small.heard("calm.ok"), "{:?}", small.heard.lock().unwrap());
    assert!((50.0..52.0).contains(&took), "held until somebody lets go: {took}");
    assert!(ended.is_clean() && ended.stage == Stage::Forced, "{ended:?}");
    let steps = small.steps();
    let safe = steps.iter().position(|step| step.contains("a.g")).unwrap();
    assert!(!steps[safe..].iter().any(|step| step.contains("operation_call")), "{steps:?}");
}

/// An operator's safe configuration that was asked for before, at the very instant, has not come since: nobody waits for what its
/// coordinator would do about it.
#[test]
fn what_was_made_safe_at_the_very_instant_was_so_before() {
    let small = Small::up("deaf");
    small.session.request(Ask::Apply(ConfigId::new("calm").unwrap()), "operator", false);
    small.after(20.0, |session| {
        let view = session.status().stopping.expect("it is being stopped");
        assert!(view.held && view.stage == Stage::TakenBack && view.stands_still.is_none(), "{view:?}");
        force(session);
    });
    let (ended, took) = small.stop();
    assert!((20.0..22.0).contains(&took) && ended.is_clean(), "{took} {ended:?}");
}

impl Small {
    /// It is stopped, and once nobody leads somebody sends the safety event so many times in a row; then it is forced. What was
    /// answered, and how it ended.
    fn stop_while_sent(&self, times: usize) -> (Vec<Json>, Ended) {
        let service = SessionService::new(Arc::downgrade(&self.session));
        let answered = Arc::new(Mutex::new(Vec::new()));
        let told = answered.clone();
        self.after(6.0, move |session| {
            // Who waits outside the clock is no participant of it.
            let asked = std::thread::spawn(move || {
                for _ in 0..times {
                    let params = json!({"event": "e_estop", "wait": true});
                    told.lock().unwrap().push(service.call(1, "event", &params).unwrap());
                }
            });
            // Time goes on by so little that on the deployment's clock less than a second passes, however busy the machine is.
            while !asked.is_finished() {
                session.clock().sleep(Duration::from_nanos(100));
            }
            force(session);
            asked.join().unwrap();
        });
        let (ended, _) = self.stop();
        (std::mem::take(&mut *answered.lock().unwrap()), ended)
    }
}

/// Who sends a safety event that acts by itself is told so, and its safe configurations are nobody's requests.
#[test]
fn who_sends_a_safety_event_that_acts_by_itself_is_told() {
    let small = Small::up("deaf");
    let (answered, ended) = small.stop_while_sent(2);
    assert_eq!(answered[0], json!({"accepted": true, "taken": true, "acted": ["calm.ok"]}), "{ended:?}");
    assert_eq!(answered[1], json!({"accepted": true, "taken": true, "acted": ["calm.ok"], "before": true}));
    let log = small.session.hub().log(usize::MAX);
    let by = log.iter().find_map(|entry| match &entry.what {
        Happening::Answered(answer) if answer.answer == "calm.ok" => Some(answer.by.clone()),
        _ => None,
    });
    assert_eq!(by.as_deref(), Some("a safety event"));
    let delivered =
        log.iter().any(|entry| matches!(&entry.what, Happening::Noted { note } if note.contains("was not delivered")));
    assert!(!delivered, "it did what it is for");
}

/// Who asks again where what was safe failed is not put off: it is tried again, and the sender is told what came of that.
#[test]
fn a_safety_event_that_failed_acts_again_when_it_is_sent_again() {
    let small = Small::new("deaf", vec![FaultRule::on("property_set a.g", Fault::Fail).times(1)]);
    small.session.bring_up().unwrap_or_else(|not| panic!("{not:#?}"));
    let (all, ended) = small.stop_while_sent(3);
    assert_eq!(all[0], json!({"accepted": true, "taken": true, "acted": ["calm.broken"]}));
    assert_eq!(all[1], json!({"accepted": true, "taken": true, "acted": ["calm.ok"]}));
    assert_eq!(all[2], json!({"accepted": true, "taken": true, "acted": ["calm.ok"], "before": true}));
    assert!(ended.is_clean() && small.heard("calm.ok"), "{ended:?} {:?}", small.heard.lock().unwrap());
}

/// From the first moment on; what makes safe, what shuts down and what only looks stays open.
#[test]
fn while_it_is_stopped_others_are_refused_in_words() {
    let small = Small::up("lowering");
    let seen = Arc::new(Mutex::new(Vec::new()));
    let told = seen.clone();
    small.after(1.0, move |session| {
        let session = session.hub().is_stopping().then_some(session).expect("it is being stopped");
        told.lock().unwrap().push(session.request(Ask::Apply(ConfigId::new("soft").unwrap()), "script", false));
    });
    let (service, refused) = (SessionService::new(Arc::downgrade(&small.session)), Arc::new(Mutex::new(Vec::new())));
    let log = refused.clone();
    small.after(1.0, move |_| {
        for (method, params) in [
            ("apply", json!({"configuration": "lift"})),
            ("undo", json!({"configuration": "lift", "force": true})),
            ("commit", json!({})),
            ("event", json!({"event": "e_start"})),
        ] {
            let error = service.call(1, method, &params).expect_err(method);
            assert_eq!(error.code, rpc::GOING_DOWN, "{method}: {error}");
            assert!(error.message.contains("`small` is being stopped"), "{error}");
            log.lock().unwrap().push(method);
        }
        for (method, params) in [
            ("status", json!({})),
            ("log", json!({})),
            ("event", json!({"event": "e_stop"})),
            ("event", json!({"event": "e_estop"})),
        ] {
            service.call(1, method, &params).unwrap_or_else(|error| panic!("{method}: {error}"));
            log.lock().unwrap().push(method);
        }
    });
    small.after(20.0, force);
    small.stop();
    let told: Vec<&str> = refused.lock().unwrap().clone();
    assert_eq!(told.len(), 8, "{told:?}");
    assert!(small.heard("soft.failed"), "{:?}", small.heard.lock().unwrap());
    assert!(!small.steps().iter().any(|step| step.contains("b.k")));
}

/// Down is what the platform shows, not what it has said: what is there all the same is removed by the next stages.
#[test]
fn what_was_said_to_be_gone_and_is_there_is_not_down() {
    let small = Small::new("lowering", vec![FaultRule::on("destroy a", Fault::FalseDone).times(1)]);
    small.session.bring_up().unwrap();
    let (ended, _) = small.stop();
    assert!(ended.is_clean() && ended.stage != Stage::Led, "{ended:?}");
    assert!(ended.forced[0].contains("`idle` was reached with components left"), "{ended:?}");
    small.is_empty();
}

/// What brings it to rest is tried again as often as what is removed, and only what failed of it.
#[test]
fn what_brings_it_to_rest_is_tried_again() {
    for (times, partly) in [(2, false), (9, true)] {
        let small = Small::up("lowering");
        small.platform.set_faults(Faults::new(vec![FaultRule::on("operation_call a.lower", Fault::Fail).times(times)]));
        let began = small.clock.now();
        let ended = small.session.take_down(true);
        // Three times two seconds, and what was done is not done again.
        let took = small.clock.now().since(began).as_secs_f64();
        assert!((6.0..7.0).contains(&took), "{took} {ended:?}");
        let steps = small.steps();
        assert_eq!(steps.iter().filter(|step| step.contains("b.open")).count(), 1, "{steps:?}");
        let told = "`rest`, to come to rest, applied";
        assert!(ended.forced.contains(&told.to_owned()) != partly, "{ended:?}");
        // Its time is not that in which everything is removed.
        assert!(ended.is_clean(), "{ended:?}");
        small.is_empty();
    }
}
