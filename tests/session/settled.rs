//! Calls of which no answer came, settled by the condition that their operation names.

use davit::app;
use davit::lang::LoadOptions;
use davit::model::monitor::{Condition, ConditionKind};
use davit::model::{Ask, Catalogue, ComponentName, ComponentSnapshot, ConfigId, Execution, Outcome, Snapshot, Step};
use davit::monitor::MonitorInput;
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::{Cause, EventSink, ObserveError, Platform, Watch};
use davit::runtime::{Builder, Component, Context, Libraries, Library, OperationAnswer, Out};
use davit::session::Session;
use davit::time::{Clock, Signal, Time};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Closes and opens; what it is shows on a port.
struct Gripper {
    closed: bool,
    shows: Out<bool>,
}

impl Component for Gripper {
    fn new(b: &mut Builder<Self>) -> Self {
        let closed = Condition::new(ConditionKind::IsTrue("self.closed".parse().unwrap()));
        b.settled_by(closed).undone_by("open").operation("close", |gripper: &mut Self, _, (): ()| {
            gripper.closed = true;
            OperationAnswer::Done(())
        });
        b.undone_by("close").operation("open", |gripper: &mut Self, _, (): ()| {
            gripper.closed = false;
            OperationAnswer::Done(())
        });
        Self { closed: false, shows: b.output("closed") }
    }

    fn update(&mut self, _: &mut Context) {
        self.shows.write(self.closed);
    }
}

/// What is lost of the call of `close`.
#[derive(Clone, Copy, PartialEq)]
enum Lost {
    Answer,
    Request,
    /// The answer, and nothing can be seen.
    Sight,
}

struct Lossy {
    inner: EmbeddedPlatform,
    clock: Clock,
    lost: Mutex<Option<Lost>>,
}

impl Platform for Lossy {
    fn catalogue(&self) -> &Catalogue {
        self.inner.catalogue()
    }
    fn execution(&self, step: &Step) -> Execution {
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        let lost = *self.lost.lock().unwrap();
        let Some(lost) = lost.filter(|_| step.to_string().starts_with("operation_call gripper.close")) else {
            return self.inner.execute(step, deadline);
        };
        if lost != Lost::Request {
            self.inner.execute(step, deadline);
        }
        self.clock.sleep_until(deadline);
        Outcome::Unknown(Cause::Timeout)
    }
    fn cancel(&self, step: &Step) {
        self.inner.cancel(step);
    }
    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        self.inner.observe(deadline)
    }
    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError> {
        self.inner.observe_component(component, deadline)
    }
    fn watch(&self, inputs: &[MonitorInput], wake: &Signal) -> Option<Box<dyn Watch>> {
        if *self.lost.lock().unwrap() == Some(Lost::Sight) { None } else { self.inner.watch(inputs, wake) }
    }
    fn subscribe(&self, sink: EventSink) {
        self.inner.subscribe(sink);
    }
    fn quarantined(&self) -> Vec<ComponentName> {
        self.inner.quarantined()
    }
}

const DEPLOYMENT: &str = "\
davit: 1
name: grip
platform: embedded
libraries: [grippers]
activities: { control: { period_ms: 10.0 } }
configurations: [conf.lua]
coordinator: coordinator.lua
deploy:   { event: e_start, up: up, within_s: 5 }
shutdown: { event: e_stop,  down: idle, within_s: 5 }
limits:   { step_timeout_s: 0.5 }
";

const COORDINATOR: &str = r#"
return state {
  idle = state {},
  up   = state { config = "make" },
  trans { src = "initial", tgt = "idle" },
  trans { src = "idle", tgt = "up", events = { "e_start" } },
  trans { src = "up", tgt = "idle", events = { "e_stop", "make.failed", "make.broken" } },
}
"#;

const CONFIGURATIONS: &str = r#"
ConfiguratorConf {
  make  = Configuration { create("gripper", "Gripper", { activity = "control" }), post_conf_state = { "gripper:running" } },
  close = Configuration { operation_call("gripper.close") },
}
"#;

/// Asks for `close` where this is lost; the answer, its reasons, how long it took.
fn close(lost: Lost) -> (String, String, Duration) {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let libraries = Libraries::new().with(Library::new("grippers").with::<Gripper>("Gripper"));
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("g.yaml", DEPLOYMENT), ("conf.lua", CONFIGURATIONS), ("coordinator.lua", COORDINATOR)] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let checked = app::read(&folder.path().join("g.yaml"), &LoadOptions::default(), &libraries)
        .and_then(app::check)
        .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
    let inner = EmbeddedPlatform::new(&clock, &checked.libraries, &checked.deployment.activities);
    let platform = Arc::new(Lossy { inner, clock: clock.clone(), lost: Mutex::default() });
    let session: Arc<Session> = app::start_on(&checked, platform.clone(), &clock);
    session.bring_up().unwrap();
    *platform.lost.lock().unwrap() = Some(lost);
    let asked = clock.now();
    let request = session.request(Ask::Apply(ConfigId::new("close").unwrap()), "test", true);
    let answered = loop {
        match session.hub().answer(request) {
            Some(answered) => break answered,
            None => clock.sleep(Duration::from_millis(5)),
        }
        assert!(clock.now().since(asked) < Duration::from_secs(10), "it is answered");
    };
    let took = clock.now().since(asked);
    *platform.lost.lock().unwrap() = None;
    session.take_down(true);
    clock.shutdown();
    (answered.answer, answered.reasons.join("\n"), took)
}

#[test]
fn it_was_done_if_the_condition_becomes_true() {
    let (answer, reasons, took) = close(Lost::Answer);
    assert_eq!(answer, "close.ok", "{reasons}");
    assert!(took < Duration::from_millis(550), "with the first sample after the call's deadline: {took:?}");
}

#[test]
fn it_was_not_done_if_the_condition_stays_false() {
    let (answer, reasons, took) = close(Lost::Request);
    assert_eq!(answer, "close.failed", "{reasons}");
    assert!(!reasons.contains("nobody knows"), "{reasons}");
    assert!(took >= Duration::from_millis(1000), "what is not so yet may come about: {took:?}");
}

#[test]
fn nobody_knows_where_nothing_can_be_seen() {
    let (answer, reasons, _) = close(Lost::Sight);
    assert_eq!(answer, "close.broken");
    assert!(reasons.contains("nobody knows"), "{reasons}");
}
