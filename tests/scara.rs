//! The paper's hypothesis on a second robot with dynamics: `examples/scara`, a SCARA on a rail under the youBot's coordinator, unchanged.

#[path = "support/counting.rs"]
#[allow(dead_code)] // only what one thread asks for
mod counting;
#[path = "../examples/scara/library.rs"]
#[allow(missing_docs)]
mod library;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;

use davit::app::script::{self, Interrupt, ScriptEnd, ScriptOptions};
use davit::app::{self, Checked};
use davit::component::{Builder, Component, Context, Libraries, Library, Prop};
use davit::lang::LoadOptions;
use davit::model::{Ask, ConfigId, Severity};
use davit::session::log::LogEntry;
use davit::session::tap::LogSink;
use davit::session::{Happening, Session};
use davit::time::Clock;
use library::model::{AXES, Arm, Body, COULOMB, Done, M5, QUILL, RAIL, STEP, V4, V5, WORKING, jacobian, tool};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex};
use std::time::Duration;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn libraries() -> Libraries {
    davit::builtin().with(library::library())
}

fn checked(path: &Path, libraries: Libraries) -> Checked {
    app::read(path, &LoadOptions::default(), libraries)
        .and_then(app::check)
        .unwrap_or_else(|refused| panic!("{} is refused: {:?}", path.display(), refused.findings))
}

static SCARA: LazyLock<Checked> =
    LazyLock::new(|| checked(&root().join("examples/scara/deployment.yaml"), libraries()));
static YOUBOT: LazyLock<Checked> =
    LazyLock::new(|| checked(&root().join("deployments/youbot_arm.yaml"), davit::builtin()));

// ---- one coordinator, two robots ----------------------------------------------------------------------------------------

/// The file that a deployment names as its coordinator.
fn coordinator(deployment: &str) -> PathBuf {
    let path = root().join(deployment);
    let text = std::fs::read_to_string(&path).unwrap();
    let named = text.lines().find_map(|line| line.strip_prefix("coordinator: ")).expect("a coordinator");
    path.parent().unwrap().join(named.trim()).canonicalize().unwrap()
}

#[test]
fn the_youbots_coordinator_is_taken_as_it_is() {
    let (scara, youbot) = (&*SCARA, &*YOUBOT);
    let file = coordinator("examples/scara/deployment.yaml");
    assert_eq!(file, coordinator("deployments/youbot_arm.yaml"), "one file");
    assert_eq!(scara.deployment.coordinators[0].chart, youbot.deployment.coordinators[0].chart);
    // What it asks for is said for this robot, and nothing of the other one is in it.
    for configuration in &scara.deployment.configurations {
        assert!(youbot.deployment.configuration(configuration.id).is_some(), "{}", configuration.id);
    }
    let own: Vec<_> = scara.catalogue.iter().filter(|ty| ty.name.to_string().starts_with("scara.")).collect();
    assert_eq!(own.len(), 5);
    assert!(own.iter().all(|ty| youbot.catalogue.get(ty.name).is_none()));
    // It names neither a component nor a type.
    let text = std::fs::read_to_string(&file).unwrap();
    let code: String = text.lines().map(|line| line.split("--").next().unwrap_or_default()).collect();
    let words: BTreeSet<&str> = code.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').collect();
    for name in ["Plant", "Drives", "Follower", "Torques", "Leader", "Monitors", "scara", "youbot"] {
        assert!(!words.contains(name), "the coordinator names `{name}`");
    }
}

#[test]
fn check_finds_nothing_but_notes() {
    for checked in [&*SCARA, &*YOUBOT] {
        let worse: Vec<_> = checked.findings.iter().filter(|finding| finding.severity != Severity::Info).collect();
        assert!(worse.is_empty(), "{worse:?}");
    }
}

/// Everything the coordinator goes through from nothing to up and back, without times.
fn states(checked: &Checked) -> Vec<String> {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(checked, &clock).unwrap();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let log = heard.clone();
    session.hub().observe(Arc::new(move |_, what| {
        if let Happening::State { active } = what {
            log.lock().unwrap().push(active.last().map_or("", |state| state.as_str()).to_owned());
        }
    }));
    session.bring_up().unwrap();
    let ended = session.take_down(false);
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    clock.shutdown();
    std::mem::take(&mut *heard.lock().unwrap())
}

#[test]
fn both_robots_go_through_the_same_states() {
    let scara = states(&SCARA);
    assert_eq!(scara, states(&YOUBOT));
    assert!(scara.iter().any(|state| state.ends_with("parking")), "{scara:?}");
}

// ---- the story ----------------------------------------------------------------------------------------------------------

/// All that happens, in words.
struct Heard(Arc<Mutex<String>>);

impl LogSink for Heard {
    fn hear(&self, entry: &Arc<LogEntry>) {
        *self.0.lock().unwrap() += &format!("{entry:?}\n");
    }
}

fn story(set: &[(&str, &str)]) -> (ScriptEnd, String) {
    run(&root().join("examples/scara/story.lua"), set)
}

fn run(script: &Path, set: &[(&str, &str)]) -> (ScriptEnd, String) {
    let said = Arc::new(Mutex::new(String::new()));
    let heard = said.clone();
    let mut load = LoadOptions::default();
    load.set.extend(set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())));
    let clock = Clock::simulated();
    let end = script::run(
        script,
        ScriptOptions {
            clock: clock.clone(),
            extensions: libraries().into(),
            load,
            platform: None,
            observer: Some(Arc::new(Heard(said.clone()))),
            interrupt: Interrupt::default(),
            door: None,
            checking: None,
            say: Box::new(move |text| *heard.lock().unwrap() += &format!("{text}\n")),
        },
    );
    clock.shutdown();
    let said = std::mem::take(&mut *said.lock().unwrap());
    (end, said)
}

#[test]
fn the_story_keeps_its_bounds_and_is_the_same_each_time() {
    let set = [("seconds", "7"), ("seed", "2")];
    let (first, heard) = story(&set);
    assert!(first.failure.is_none(), "{:?}\n{:#?}", first.failure, first.figures);
    let ended = first.ended.as_ref().expect("it deployed something");
    assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}");
    assert!(first.figures.len() > 60, "{}", first.figures.len());
    let (second, again) = story(&set);
    assert_eq!(format!("{:?}", first.figures), format!("{:?}", second.figures));
    assert!(heard == again && heard.len() > 10_000, "what happened is the same");
    // Another network is another run.
    let (other, _) = story(&[("seconds", "7"), ("seed", "3")]);
    assert!(other.failure.is_none(), "{:?}\n{:#?}", other.failure, other.figures);
    assert_ne!(format!("{:?}", first.figures), format!("{:?}", other.figures));
}

/// Drives that die, or were held up for longer than their watchdog waits, stop the robot, as the youBot's do: it does not go on by itself.
#[test]
fn drives_that_die_or_are_late_are_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let told = |what: &str| {
        let file = root().join("examples/scara/deployment.yaml");
        let script = folder.path().join("dies.lua");
        let text = format!(
            "deploy([[{}]]) wait_state('copying', 15) wait(0.5) {what} say('it is in ' .. table.concat(active(), ' '))",
            file.display()
        );
        std::fs::write(&script, text).unwrap();
        let (end, said) = run(&script, &[]);
        format!("{said}{:?}", end.failure)
    };
    let dead = told("inject('Drives', 'panic') wait(0.06)");
    assert!(dead.contains("it is in root root.fault"), "{dead}");
    let unfolding = "raise('e_shutdown') wait_state('idle', 20) raise('e_start') wait_state('unfolding', 3) wait(1)";
    let dead = told(&format!("{unfolding} inject('Drives', 'panic') wait(0.06) say('Drives: ' .. state('Drives'))"));
    assert!(dead.contains("it is in root root.halted") && dead.contains("Drives: faulted"), "{dead}");
    let late = told("inject('Drives', 'stall', { seconds = 0.1 }) wait(2)");
    assert!(late.contains("it is in root root.fault") && late.contains("e_EC_TIMEOUT"), "{late}");
}

// ---- the control loop ---------------------------------------------------------------------------------------------------

static REQUESTS: [AtomicU64; 3] = [const { AtomicU64::new(0) }; 3];

/// How often its activity's thread has asked for memory.
struct Meter(Prop<u8>);

impl Component for Meter {
    fn new(b: &mut Builder<Self>) -> Self {
        Self(b.property("number", 0))
    }

    fn update(&mut self, _: &mut Context) {
        REQUESTS[usize::from(self.0.get())].store(counting::made(), Ordering::SeqCst);
    }
}

const METERS: &str = "ConfiguratorConf { meters = Configuration {
    create('plant_meter',   'meter.Meter', { activity = 'plant',   properties = { number = 0 } }),
    create('control_meter', 'meter.Meter', { activity = 'control', properties = { number = 1 } }),
    create('link_meter',    'meter.Meter', { activity = 'link',    properties = { number = 2 } }),
    post_conf_state = { 'plant_meter:running', 'control_meter:running', 'link_meter:running' },
} }";

#[test]
fn the_control_loop_allocates_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let shipped = root().join("examples/scara/deployment.yaml");
    let text = std::fs::read_to_string(&shipped).unwrap();
    let scara = root().join("examples/scara");
    let text = text
        .replace("libraries: [scara]", "libraries: [scara, meter]")
        .replace("[configurations.lua]", &format!("[{}, meters.lua]", scara.join("configurations.lua").display()))
        .replace("[monitors.lua]", &format!("[{}]", scara.join("monitors.lua").display()))
        .replace("../../configs", &root().join("configs").display().to_string());
    std::fs::write(folder.path().join("deployment.yaml"), text).unwrap();
    std::fs::write(folder.path().join("meters.lua"), METERS).unwrap();
    let with_meter = libraries().with(Library::new("meter").with::<Meter>("meter.Meter"));
    let checked = checked(&folder.path().join("deployment.yaml"), with_meter);

    // A thread for each activity, as where time is paced; the pace is one that nothing waits for.
    let clock = Clock::simulated_paced(1e9);
    let _me = clock.enter();
    let session = app::start(&checked, &clock).unwrap();
    session.bring_up().unwrap();
    let ask = |ask: Ask| {
        session.request(ask, "test", true);
        clock.sleep(Duration::from_millis(20));
    };
    ask(Ask::Apply(ConfigId::new("meters").unwrap()));
    clock.sleep(Duration::from_secs(4));
    assert!(is_in(&session, "eight_DOF_mode"), "{:?}", session.status().coordinator);
    let seen = || REQUESTS.each_ref().map(|requests| requests.load(Ordering::SeqCst));
    let before = seen();
    assert!(before.iter().all(|requests| *requests > 0), "the meters count: {before:?}");
    clock.sleep(Duration::from_secs(3));
    assert_eq!(seen(), before, "memory is asked for");
    session.request(Ask::UndoOf(ConfigId::new("meters").unwrap()), "test", true);
    clock.sleep(Duration::from_millis(20));
    let ended = session.take_down(false);
    assert!(ended.is_clean(), "{ended:?}");
    clock.shutdown();
}

fn is_in(session: &Session, state: &str) -> bool {
    session.status().coordinator.iter().any(|active| active.ends_with(state))
}

// ---- the arm ------------------------------------------------------------------------------------------------------------

const POSES: [[f64; AXES]; 4] =
    [WORKING, [0.3, -1.2, 2.1, -0.05, 1.0], [-0.2, 2.0, -0.7, -0.19, -3.0], [0.1, 0.3, 0.02, -0.12, 0.4]];
const SPEEDS: [f64; AXES] = [0.4, -1.3, 1.7, 0.2, -2.2];

/// d(f)/d(q_i), numerically.
fn slope<T>(q: &V5, i: usize, f: impl Fn(&V5) -> T) -> T
where
    T: std::ops::Sub<Output = T> + std::ops::Div<f64, Output = T>,
{
    let mut off = V5::zeros();
    off[i] = 1e-6;
    (f(&(q + off)) - f(&(q - off))) / 2e-6
}

#[test]
fn the_tool_moves_as_its_jacobian_says() {
    for q in POSES.map(V5::from) {
        for i in 0..AXES {
            let off = slope(&q, i, tool) - jacobian(&q).column(i);
            assert!(off.amax() < 1e-8, "axis {i}: {off}");
        }
    }
}

#[test]
fn what_the_gripper_carries_weighs_where_the_tool_is() {
    // A payload is a point at the tool: its share of the mass matrix is what the jacobian makes of it, by other equations.
    for q in POSES.map(V5::from) {
        let share = Arm { payload: 2.0 }.mass(&q) - Arm { payload: 0.0 }.mass(&q);
        let j = jacobian(&q).fixed_rows::<3>(0).into_owned();
        let off = share - j.transpose() * j * 2.0;
        assert!(off.amax() < 1e-12, "{off}");
    }
}

#[test]
fn coriolis_forces_are_those_of_the_mass_matrix() {
    let arm = Arm { payload: 0.7 };
    for q in POSES.map(V5::from) {
        let v = V5::from(SPEEDS);
        assert!((arm.mass(&q) - arm.mass(&q).transpose()).amax() < 1e-12);
        assert!(arm.mass(&q).cholesky().is_some(), "positive definite");
        let by_axis: [_; AXES] = std::array::from_fn(|i| slope(&q, i, |q| arm.mass(q)));
        let turning: M5 = by_axis.iter().zip(v.iter()).map(|(slope, v)| slope * *v).sum();
        let mut wanted = turning * v;
        for i in 0..AXES {
            let potential = slope(&q, i, |q| arm.energy(q, &V5::zeros()));
            wanted[i] += potential - 0.5 * v.dot(&(by_axis[i] * v));
        }
        let off = wanted - arm.bias(&q, &v);
        assert!(off.amax() < 1e-6, "{off}");
    }
}

#[test]
fn nothing_is_lost_or_won_without_friction() {
    let mut body = Body::new(WORKING.into(), 0.5);
    body.friction = 0.0;
    body.v = V5::new(0.1, 0.8, -1.1, 0.0, 1.5);
    let weight = body.arm.bias(&body.q, &V5::zeros())[QUILL];
    let done = Done { effort: V5::new(0.0, 0.0, 0.0, weight, 0.0), ..Done::default() };
    let energy = |body: &Body| body.arm.energy(&body.q, &body.v);
    let before = energy(&body);
    let kinetic = before - Arm { payload: 0.5 }.energy(&body.q, &V5::zeros());
    let momentum = |body: &Body| (body.arm.mass(&body.q) * body.v)[RAIL];
    let along = momentum(&body);
    for _ in 0..4 {
        body.advance(&done, 0.1);
        assert!((energy(&body) - before).abs() < 2e-3 * kinetic, "{} {before}", energy(&body));
        // Nobody pushes along the rail. The axes turn between two looks at where they are: not to the last digit.
        assert!((momentum(&body) - along).abs() < 1e-3, "{} {along}", momentum(&body));
    }
}

#[test]
fn friction_holds_what_is_weaker_and_the_brake_the_quill() {
    let start = V5::from(WORKING);
    for share in [0.98, 1.05] {
        let mut body = Body::new(start, 0.3);
        let mut effort = body.arm.bias(&start, &V5::zeros());
        effort += V5::from(COULOMB) * share;
        body.advance(&Done { effort, ..Done::default() }, 1.0);
        let went = body.q - start;
        if share < 1.0 {
            assert!(went.amax() < 1e-9, "{went}");
        } else {
            assert!(went.iter().filter(|way| **way > 1e-4).count() >= 4, "{went}");
        }
    }
    // Drives off: the brake carries the quill, without it that comes down.
    for brake in [true, false] {
        let mut body = Body::new(start, 0.3);
        body.advance(&Done { shorted: true, brake, ..Done::default() }, 1.0);
        assert_eq!((body.q - start).amax() < 1e-9, brake, "{}", body.q - start);
    }
}

/// How far the axes are off, after a second of being driven to and fro through rest, where steps of 10 µs bring them.
#[test]
fn the_steps_are_fine_enough() {
    let after = |step: f64| {
        let mut body = Body::new(WORKING.into(), 0.3);
        let weight = body.arm.bias(&body.q, &V5::zeros());
        let steps = (0.001 / step).round() as u32;
        for ms in 0..1000_u32 {
            let sway = (std::f64::consts::TAU * f64::from(ms) * 1e-3).sin();
            let done = Done {
                effort: weight + V5::from(COULOMB) * (3.0 * sway),
                push: V4::new(2.0, -1.0, 0.0, 0.0),
                ..Done::default()
            };
            (0..steps).for_each(|_| body.advance(&done, step));
        }
        body.q
    };
    let exact = after(1e-5);
    assert!((exact - V5::from(WORKING)).amax() > 0.01, "it moves");
    let off = (after(STEP) - exact).amax();
    assert!(off < 5e-4, "{off}");
}
