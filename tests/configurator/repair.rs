//! What is broken is repaired: by itself or in one net with its undo, and never against a safe configuration.

use crate::rig::*;
use davit::configurator::{ConfiguratorHandle, Progress, Recovery};
use davit::model::*;
use davit::platform::Platform;
use davit::platform::simulated::{Fault, Simulated, SimulatedOptions};
use davit::stack::{Batch, Request};
use davit::time::Time;
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What happens while the platform looks, once.
type Meanwhile = Arc<Mutex<Option<Box<dyn FnOnce() + Send>>>>;

/// A platform that takes its time to look, while something else happens.
struct Watched {
    inner: Simulated,
    meanwhile: Meanwhile,
}

impl Watched {
    fn meanwhile(&self) {
        let meanwhile = self.meanwhile.lock().unwrap().take();
        if let Some(meanwhile) = meanwhile {
            meanwhile();
            self.inner.clock().sleep(Duration::from_millis(300));
        }
    }
}

impl Platform for Watched {
    fn catalogue(&self) -> &Catalogue {
        self.inner.catalogue()
    }
    fn execution(&self, step: &Step) -> Execution {
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        self.inner.execute(step, deadline)
    }
    fn cancel(&self, step: &Step) {
        self.inner.cancel(step);
    }
    fn observe(&self, deadline: Time) -> Result<Snapshot, davit::platform::ObserveError> {
        let seen = self.inner.observe(deadline);
        self.meanwhile();
        seen
    }
    fn observe_component(
        &self,
        name: ComponentName,
        until: Time,
    ) -> Result<Option<ComponentSnapshot>, davit::platform::ObserveError> {
        self.inner.observe_component(name, until)
    }
    fn observe_some(
        &self,
        components: &[ComponentName],
        deadline: Time,
    ) -> Result<Snapshot, davit::platform::ObserveError> {
        let seen = self.inner.observe_some(components, deadline);
        self.meanwhile();
        seen
    }
    fn subscribe(&self, sink: davit::platform::EventSink) {
        self.inner.subscribe(sink);
    }
    fn quarantined(&self) -> Vec<ComponentName> {
        self.inner.quarantined()
    }
}

struct Bench {
    rig: Rig,
    meanwhile: Meanwhile,
}

impl Bench {
    /// `A` running, `B` and `C` stopped, all made for good by an operator; starting moves.
    fn new() -> Self {
        let mut catalogue = catalogue();
        let mut node = (**catalogue.get(TypeName::new("Node").unwrap()).unwrap()).clone();
        node.moves.start = true;
        catalogue.insert(node);
        let mut all = vec![
            configuration("make", "", "create A; create B; create C", "A:running B:stopped C:stopped"),
            configuration("go", "", "", "C:running"),
            configuration("gain", "", "set A.k 7; set B.k 3", ""),
            configuration("hold", "C:running", "call B.open", ""),
            configuration("sure", "", "set A.k 7", ""),
            configuration("nine", "", "set B.k 9", ""),
            configuration("low", "", "set A.k 1", ""),
            configuration("rest", "", "set C.k 1", "C:stopped"),
            configuration("tune", "", "set C.k 2; call C.open", ""),
            configuration("park", "", "set C.k 1; call C.open", ""),
        ];
        for configuration in &mut all {
            configuration.safe = ["nine", "low", "rest", "park"].contains(&configuration.id.as_str());
            if configuration.id == id("sure") {
                configuration.confirm = Some(Confirm { event: event("e_fine"), within: Duration::from_secs(20) });
            }
            if configuration.id == id("hold") {
                configuration.on_failure = OnFailure::Hold;
            }
        }
        let meanwhile = Meanwhile::default();
        let watched = meanwhile.clone();
        let limits = DeploymentLimits::default();
        let wrap = |inner| Arc::new(Watched { inner, meanwhile: watched }) as Arc<dyn Platform>;
        let rig = Rig::of(catalogue, BTreeSet::new(), all, SimulatedOptions::default(), wrap, limits);
        let operator = davit::stack::Requester::Operator;
        assert_eq!(rig.ask_as("make", operator), ["make.ok"]);
        assert_eq!(rig.ask_as("commit!", operator), ["commit.ok"]);
        Self { rig, meanwhile }
    }

    /// While the platform looks next, this is asked for.
    fn comes(&self, word: &str) {
        let handle: ConfiguratorHandle = self.rig.handle.clone();
        let request = Request::new(RequestId(1_000_000), Ask::Apply(id(word)), coordinator("c2"));
        *self.meanwhile.lock().unwrap() =
            Some(Box::new(move || handle.submit(Batch::one(request).requests.into_iter().collect()).unwrap()));
    }

    /// Somebody has stopped what runs, or set what was set, and it has been found.
    fn tamper(&self, steps: &[Step]) {
        assert!(steps.iter().all(|step| self.rig.platform.tamper(step)));
        self.rig.wait(12.0);
        assert_eq!(self.rig.view().residuals.len(), 1);
        self.rig.platform.record();
    }

    /// What has been done since, in words.
    fn done(&self) -> Vec<String> {
        self.rig.platform.record().iter().map(ToString::to_string).collect()
    }

    fn recover(&self) -> Result<(), String> {
        self.recover_by(Recovery::Back)
    }

    fn recover_by(&self, direction: Recovery) -> Result<(), String> {
        let deadline = self.rig.clock.now() + Duration::from_secs(20);
        let recovered = self.rig.handle.recover(direction, deadline).expect("an answer");
        recovered.map(|_| ()).map_err(|residual| residual.to_string())
    }

    fn gain(&self, component: &str) -> Value {
        self.rig.see().components[&name(component)].properties[&ident("k")].clone()
    }
}

fn stop(component: &str) -> Step {
    Step::State { component: name(component), transition: Transition::Stop }
}

fn start(component: &str) -> Step {
    Step::State { component: name(component), transition: Transition::Start }
}

fn set(property: &str, value: f64) -> Step {
    Step::PropertySet { property: member(property), value: Value::Float(value) }
}

#[test]
fn a_safe_configuration_that_comes_while_it_is_looked_keeps_everything_still() {
    let bench = Bench::new();
    bench.tamper(&[stop("A")]);
    bench.comes("nine");
    let why = bench.recover().expect_err("it would move");
    assert!(why.contains("not done unasked, since it moves: `start A`"), "{why}");
    assert_eq!(bench.done(), ["property_set B.k = 9.0"]);
    assert_eq!(bench.rig.ask_as("nine.undo", coordinator("c2")), ["nine.undone"]);
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), ["property_set B.k = 0.0", "start A"]);
    bench.rig.in_step();
}

/// Who takes what is there as the state does not know of what has come while it was looked: that stays in force, and is in the model.
#[test]
fn a_safe_configuration_that_comes_while_what_is_there_is_accepted_stays_in_force() {
    let bench = Bench::new();
    bench.tamper(&[set("A.k", 5.0)]);
    bench.comes("nine");
    let why = bench.recover_by(Recovery::Accept).expect_err("it came meanwhile");
    assert!(why.contains("`nine`"), "{why}");
    let frames: Vec<_> = bench.rig.view().stack.iter().map(|frame| frame.configuration).collect();
    assert!(frames.contains(&id("nine")), "{frames:?}");
    assert_eq!(bench.recover_by(Recovery::Accept), Ok(()));
    assert!(bench.rig.view().stack.is_empty(), "asked for once more it is given up");
    bench.rig.in_step();
}

#[test]
fn an_undo_that_was_asked_for_before_a_safe_configuration_came_moves_nothing_after_it() {
    let bench = Bench::new();
    assert_eq!(bench.rig.ask("gain"), ["gain.ok"]);
    bench.tamper(&[stop("A"), set("A.k", 5.0)]);
    bench.comes("nine");
    let told = bench.rig.ask("gain.undo");
    assert_eq!(told, ["nine.ok", "gain.undone"], "{:?}", bench.rig.last());
    assert_eq!(bench.done(), ["property_set B.k = 9.0", "property_set A.k = 0.0"], "B.k is the safe configuration's");
    // What still differs says so, and waits for whom the safe configuration allows it.
    let why = bench.recover().expect_err("it would move");
    assert!(why.contains("since it moves: `start A`"), "{why}");
    assert_eq!(bench.rig.ask_as("nine.undo", coordinator("c2")), ["nine.undone"]);
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), ["property_set B.k = 0.0", "start A"]);
    bench.rig.in_step();
}

/// Who takes a gain back has not asked for a motor to start: what stands, though the model has it running, is left, and told.
#[test]
fn an_undo_sets_nothing_in_motion_that_is_not_its_own() {
    let bench = Bench::new();
    let faults = [("start C", Fault::FalseDone), ("operation_call C.open", Fault::Fail)];
    let rules = faults.map(|(step, fault)| davit::platform::simulated::FaultRule::on(step, fault).times(1));
    bench.rig.platform.set_faults(davit::platform::simulated::Faults::new(rules));
    bench.rig.submit("go");
    bench.rig.submit("tune");
    bench.rig.wait(2.0);
    assert_eq!(bench.rig.events()[2..], ["go.ok", "tune.broken"], "{:?}", bench.rig.last());
    assert_eq!(bench.rig.view().residuals[0].difference, [stop("C")]);
    bench.done();
    assert_eq!(bench.rig.ask("tune.undo"), ["tune.undone"], "{:?}", bench.rig.last());
    assert_eq!(bench.done(), [""; 0]);
    let view = bench.rig.view();
    assert_eq!(view.residuals[0].difference, [stop("C")], "C stands, and that is told");
    assert_eq!(view.residuals[0].withheld, Some(start("C")));
    let lost = |told: &Progress| matches!(told, Progress::Lost { configuration, .. } if *configuration == id("go"));
    assert!(bench.rig.progress.lock().unwrap().iter().any(lost), "who had started it is lost");
    // It is of that one now, which goes straight to where it leads.
    assert_eq!(bench.rig.ask("go.undo"), ["go.undone"]);
    assert_eq!(bench.done(), [""; 0]);
    assert!(bench.rig.view().residuals.is_empty());
    bench.rig.in_step();
}

/// The end of what is safe neither: what had never started stays where it is when it is let go.
#[test]
fn letting_go_of_what_is_safe_starts_nothing() {
    let bench = Bench::new();
    bench.rig.inject("start C", Fault::FalseDone);
    assert_eq!(bench.rig.ask("go"), ["go.ok"]);
    bench.rig.inject("operation_call C.open", Fault::LostAnswer);
    assert_eq!(bench.rig.ask_as("park", coordinator("c2")), ["park.broken"]);
    bench.rig.wait(12.0);
    bench.done();
    assert_eq!(bench.rig.ask_as("park.undo", coordinator("c2")), ["park.undone"], "{:?}", bench.rig.last());
    assert!(bench.done().iter().all(|step| step != "start C"));
    assert_eq!(bench.rig.view().residuals[0].difference, [stop("C")]);
    assert_eq!(bench.rig.ask("go.undo"), ["go.undone"]);
    assert_eq!(bench.done(), [""; 0]);
    bench.rig.in_step();
}

#[test]
fn what_a_safe_configuration_has_done_meanwhile_is_not_taken_back() {
    let bench = Bench::new();
    bench.tamper(&[set("A.k", 5.0)]);
    bench.comes("nine");
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), ["property_set B.k = 9.0", "property_set A.k = 0.0"]);
    assert_eq!((bench.gain("A"), bench.gain("B")), (Value::Float(0.0), Value::Float(9.0)));
    bench.rig.in_step();
}

/// Also on the very component that is broken.
#[test]
fn what_a_safe_configuration_wants_of_what_is_broken_stays_while_it_is_in_force() {
    let bench = Bench::new();
    bench.tamper(&[set("A.k", 5.0)]);
    bench.comes("low");
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), ["property_set A.k = 1.0"], "A is as the safe configuration wants it");
    // It had found what somebody else has set; it is taken back to what the model had.
    assert_eq!(bench.rig.ask_as("low.undo", coordinator("c2")), ["low.undone"]);
    assert_eq!(bench.gain("A"), Value::Float(0.0));
    bench.rig.in_step();
}

/// While it is looked it is not whole yet, and who asks is told so.
#[test]
fn what_is_being_repaired_is_broken_until_it_is_not() {
    let bench = Bench::new();
    bench.tamper(&[set("A.k", 5.0)]);
    let told = Arc::new(Mutex::new(None));
    let (handle, clock, seen) = (bench.rig.handle.clone(), bench.rig.clock.clone(), told.clone());
    *bench.meanwhile.lock().unwrap() = Some(Box::new(move || {
        let view = handle.view(false, clock.now() + Duration::from_secs(5)).expect("a view");
        *seen.lock().unwrap() = Some((view.broken.is_some(), view.residuals.len()));
    }));
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(*told.lock().unwrap(), Some((true, 1)));
    assert!(bench.rig.view().broken.is_none());
    bench.rig.in_step();
}

/// What it demands of a run state, too: then who recovers is told, and what is undone goes straight to where that leads.
#[test]
fn what_a_safe_configuration_demands_of_what_is_broken_is_not_mended() {
    let bench = Bench::new();
    bench.rig.inject("start C", Fault::FalseDone);
    assert_eq!(bench.rig.ask("go"), ["go.ok"]);
    bench.rig.wait(12.0);
    bench.done();
    assert_eq!(bench.rig.ask_as("rest", coordinator("c2")), ["rest.ok"]);
    let drift = bench.rig.handle.drift(bench.rig.clock.now() + Duration::from_secs(5)).unwrap();
    assert_eq!(drift.steps, [stop("C")], "what it wrote is no difference");
    let why = bench.recover().expect_err("C is to be stopped");
    assert!(why.contains("what differs: `stop C`"), "{why}");
    assert_eq!(bench.done(), ["property_set C.k = 1.0"]);
    // Undone although C is broken: it was applied so.
    assert_eq!(bench.rig.ask_as("rest.undo", coordinator("c2")), ["rest.undone"]);
    assert_eq!(bench.rig.ask("go.undo"), ["go.undone"]);
    assert_eq!(bench.done(), ["property_set C.k = 0.0"]);
    assert!(bench.rig.view().residuals.is_empty());
    bench.rig.in_step();
}

#[test]
fn a_repair_in_one_net_that_fails_leaves_what_is_broken_as_it_was() {
    let bench = Bench::new();
    assert_eq!(bench.rig.ask("gain"), ["gain.ok"]);
    bench.tamper(&[stop("A"), set("A.k", 5.0)]);
    let before = bench.rig.see();
    bench.rig.inject("property_set B.k", Fault::Fail);
    assert_eq!(bench.rig.ask("gain.undo"), ["gain.undo.broken"]);
    assert!(bench.rig.last().findings()[0].message.contains("`property_set B.k"), "{:?}", bench.rig.last());
    assert_eq!(bench.rig.see(), before);
    let view = bench.rig.view();
    assert_eq!((view.residuals.len(), view.stack.len()), (1, 1));
    assert_eq!(view.residuals[0].difference, [stop("A"), set("A.k", 5.0)]);
    assert_eq!(bench.rig.ask("low"), ["low.ok"]);
    assert_eq!(bench.rig.ask("low.undo"), ["low.undone"]);
    bench.done();
    assert_eq!(bench.rig.ask("gain.undo"), ["gain.undone"]);
    assert_eq!(bench.done(), ["property_set B.k = 0.0", "property_set A.k = 0.0"]);
    assert_eq!(bench.rig.view().residuals[0].difference, [stop("A")]);
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), ["start A"]);
    bench.rig.in_step();
    bench.rig.each_answered_once();
}

#[test]
fn who_recovers_does_not_start_what_is_taken_back_at_once() {
    let bench = Bench::new();
    let faults = [("start C", Fault::FalseDone), ("operation_call B.open", Fault::Fail)];
    let rules = faults.map(|(step, fault)| davit::platform::simulated::FaultRule::on(step, fault).times(1));
    bench.rig.platform.set_faults(davit::platform::simulated::Faults::new(rules));
    assert_eq!(bench.rig.ask("hold"), ["hold.broken"]);
    let view = bench.rig.view();
    assert_eq!(view.residuals[0].difference, [stop("C")]);
    bench.done();
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), [""; 0], "C does not run");
    assert!(bench.rig.view().stack.is_empty() && bench.rig.view().residuals.is_empty());
    let told = bench.rig.progress.lock().unwrap();
    assert!(told.iter().any(|told| matches!(told, Progress::Recovered)));
    drop(told);
    bench.rig.in_step();
}

/// Nobody asks for a revert: what would have to move for it is not mended either.
#[test]
fn a_confirmation_that_runs_out_mends_nothing_that_moves() {
    let bench = Bench::new();
    bench.rig.submit("sure");
    bench.rig.wait(0.1);
    bench.tamper(&[stop("A"), set("A.k", 5.0)]);
    bench.rig.wait(20.0);
    assert_eq!(bench.rig.events().last().unwrap(), "sure.reverted", "{:?}", bench.rig.last());
    assert_eq!(bench.done(), ["property_set A.k = 0.0"]);
    assert_eq!(bench.rig.frames(), [""; 0]);
    assert_eq!(bench.rig.view().residuals[0].difference, [stop("A")]);
    assert_eq!(bench.recover(), Ok(()));
    assert_eq!(bench.done(), ["start A"]);
    bench.rig.in_step();
}
