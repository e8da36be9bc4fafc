//! A hot swap on what runs: a controller is replaced by one of another type, with its connections and its run state. When
//! the new one fails, the old one is back: connected and running. On both platforms.

use davit::app;
use davit::lang::LoadOptions;
use davit::model::{Ask, ConfigId, Snapshot};
use davit::platform::Platform;
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::simulated::{Fault, FaultRule, Faults, Simulated, SimulatedOptions};
use davit::runtime::{Builder, Component, Context, Failure, In, Libraries, Library, Out, Prop};
use davit::session::Session;
use davit::time::Clock;
use std::sync::Arc;
use std::time::Duration;

/// Writes 1, 2, 3, …
struct Plant {
    n: f64,
    y: Out<f64>,
    u: In<f64>,
    got: Out<f64>,
}

impl Component for Plant {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { n: 0.0, y: b.output("y"), u: b.input("u"), got: b.output("got") }
    }

    fn update(&mut self, _: &mut Context) {
        self.n += 1.0;
        self.y.write(self.n);
        if let Some(u) = self.u.get() {
            self.got.write(u);
        }
    }
}

/// Passes on what it gets.
struct Pid {
    u: In<f64>,
    y: Out<f64>,
}

impl Component for Pid {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { u: b.input("in"), y: b.output("y") }
    }

    fn update(&mut self, _: &mut Context) {
        self.u.get().into_iter().for_each(|u| self.y.write(u));
    }
}

/// Passes on its negative. May fail where it is told to.
struct Mpc {
    state: In<f64>,
    y: Out<f64>,
    fails: Prop<String>,
}

impl Mpc {
    fn fail(&mut self, at: &str) -> Result<(), Failure> {
        if self.fails.get() == at { Err(Failure::from("no solver")) } else { Ok(()) }
    }
}

impl Component for Mpc {
    fn new(b: &mut Builder<Self>) -> Self {
        b.on_configure(|this, _| this.fail("configure")).on_start(|this, _| this.fail("start"));
        Self { state: b.input("state"), y: b.output("y"), fails: b.property("fails", String::new()) }
    }

    fn update(&mut self, _: &mut Context) {
        self.state.get().into_iter().for_each(|u| self.y.write(-u));
    }
}

const DEPLOYMENT: &str = "\
davit: 1
name: swapped
platform: PLATFORM
libraries: [controllers]
activities: { control: { period_ms: 10.0 }, slow: { period_ms: 20.0 } }
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
local function to_mpc(fails)
  return Configuration { replace("ctrl", "Mpc", { properties = { fails = fails }, map = { ["in"] = "state" } }) }
end
return ConfiguratorConf {
  make = Configuration {
    create("ctrl", "Pid", { activity = "slow" }),
    create("plant", "Plant", { activity = "control" }),
    create("log", "Plant", { activity = "control" }),
    connect("plant.y", "ctrl.in", { buffer = 4 }), connect("ctrl.y", "plant.u"), connect("ctrl.y", "log.u"),
    post_conf_state = { "_default:running" },
  },
  swap = to_mpc(""),
  fails_configure = to_mpc("configure"),
  fails_start = to_mpc("start"),
}
"#;

struct Swapped {
    session: Arc<Session>,
    platform: Arc<dyn Platform>,
    simulated: Option<Arc<Simulated>>,
    clock: Clock,
}

impl Swapped {
    fn up(platform: &str, clock: &Clock) -> Self {
        let clock = clock.clone();
        let library = Library::new("controllers").with::<Plant>("Plant").with::<Pid>("Pid").with::<Mpc>("Mpc");
        let libraries = Libraries::new().with(library);
        let folder = tempfile::tempdir().unwrap();
        let deployment = DEPLOYMENT.replace("PLATFORM", platform);
        for (name, text) in
            [("g.yaml", deployment.as_str()), ("conf.lua", CONFIGURATIONS), ("coordinator.lua", COORDINATOR)]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let checked = app::read(&folder.path().join("g.yaml"), &LoadOptions::default(), &libraries)
            .and_then(app::check)
            .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let embedded = EmbeddedPlatform::new(&clock, &checked.libraries, &checked.deployment.activities);
        let simulated = (platform == "simulated")
            .then(|| Arc::new(Simulated::new(checked.catalogue.clone(), clock.clone(), SimulatedOptions::default())));
        let platform: Arc<dyn Platform> = match &simulated {
            Some(simulated) => simulated.clone(),
            None => Arc::new(embedded),
        };
        let session = app::start_on(&checked, platform.clone(), &clock);
        session.bring_up().unwrap();
        Self { session, platform, simulated, clock }
    }

    fn ask(&self, ask: Ask) -> String {
        let asked = self.clock.now();
        let request = self.session.request(ask, "test", true);
        loop {
            if let Some(answered) = self.session.hub().answer(request) {
                return answered.answer;
            }
            self.clock.sleep(Duration::from_millis(5));
            assert!(self.clock.now().since(asked) < Duration::from_secs(10), "it is answered");
        }
    }

    fn apply(&self, id: &str) -> String {
        self.ask(Ask::Apply(ConfigId::new(id).unwrap()))
    }

    fn seen(&self) -> Snapshot {
        self.platform.observe(self.clock.now() + Duration::from_secs(1)).unwrap()
    }

    fn end(self) {
        self.session.take_down(false);
        assert!(self.seen().components.is_empty(), "nothing is left");
        self.clock.shutdown();
    }
}

fn told(snapshot: &Snapshot) -> String {
    let ctrl = &snapshot.components[&"ctrl".parse().unwrap()];
    let mut links: Vec<String> =
        snapshot.connections.iter().map(|(ends, policy)| format!("{} -> {} ({policy})", ends.0, ends.1)).collect();
    links.sort();
    let activity = ctrl.activity.map(|name| name.to_string()).unwrap_or_default();
    format!("{} {} in {activity}; {}", ctrl.ty, ctrl.state, links.join(", "))
}

const OLD: &str =
    "Pid running in slow; ctrl.y -> log.u (data), ctrl.y -> plant.u (data), plant.y -> ctrl.in (buffer(4))";
const NEW: &str =
    "Mpc running in slow; ctrl.y -> log.u (data), ctrl.y -> plant.u (data), plant.y -> ctrl.state (buffer(4))";

#[test]
fn the_new_one_has_the_connections_the_activity_and_the_run_state_of_the_old_one() {
    for platform in ["embedded", "simulated"] {
        let clock = Clock::simulated();
        let _me = clock.enter();
        let up = Swapped::up(platform, &clock);
        let before = up.seen();
        assert_eq!(told(&before), OLD, "{platform}");
        assert_eq!(up.apply("swap"), "swap.ok", "{platform}");
        assert_eq!(told(&up.seen()), NEW, "{platform}");
        assert_eq!(up.ask(Ask::Undo), "undo.done", "{platform}");
        assert_eq!(up.seen(), before, "{platform}");
        up.end();
    }
}

#[test]
fn where_the_new_one_fails_the_old_one_is_back_connected_and_running() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let up = Swapped::up("embedded", &clock);
    let before = up.seen();
    for fails in ["fails_configure", "fails_start"] {
        assert_eq!(up.apply(fails), format!("{fails}.failed"));
        assert_eq!(up.seen(), before, "{fails}");
        assert!(up.session.status().residual.is_some_and(|left| left.is_empty()), "{fails}");
    }
    // Nothing stands in the way of the next try.
    assert_eq!(up.apply("swap"), "swap.ok");
    up.end();
}

#[test]
fn whichever_step_of_it_fails_the_old_one_is_back() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let up = Swapped::up("simulated", &clock);
    let before = up.seen();
    let simulated = up.simulated.clone().unwrap();
    let mut failed = 0;
    for nth in 1.. {
        simulated.set_faults(Faults { rules: vec![FaultRule::nth(nth, Fault::Fail)], ..Faults::default() });
        let answer = up.apply("swap");
        simulated.set_faults(Faults::default());
        if answer == "swap.ok" {
            break;
        }
        assert_eq!(answer, "swap.failed", "step {nth}");
        assert_eq!(up.seen(), before, "step {nth}");
        failed += 1;
    }
    // stop, cleanup, three disconnects, destroy, create, three connects, configure, start.
    assert_eq!(failed, 12);
    assert_eq!(told(&up.seen()), NEW);
    up.end();
}
