//! A shipped deployment alive in simulated time, coordinator in the loop, with a probe in its control loop and nothing else
//! changed.

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::libraries::youbot::components::samples::{JointState, Odometry, ToolPose, seconds_since};
use davit::libraries::youbot::kinematics::Tool;
use davit::libraries::youbot::rigid_body::{ArmModel, J5};
use davit::model::{Call, ComponentName, EventName, Ident, MemberRef, Step, Value};
use davit::platform::Outcome;
use davit::runtime::{Builder, Component, Context, In, Library, Prop};
use davit::session::{Happening, Session};
use davit::time::{Clock, Guard, Time};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicI64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// One update of the control loop.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// In s.
    pub t: f64,
    pub tool: Vector3<f64>,
    pub speed: Vector3<f64>,
    /// Where the other tool really is.
    pub other: Option<Vector3<f64>>,
    pub hand: Vector3<f64>,
    pub saturated: u8,
    pub mode: u8,
    pub joints: JointState,
    pub base: Odometry,
}

static ROWS: Mutex<BTreeMap<i64, Vec<Row>>> = Mutex::new(BTreeMap::new());

struct Probe {
    other: In<ToolPose>,
    hand: In<Vector3<f64>>,
    saturated: In<u8>,
    mode: In<u8>,
    joints: In<JointState>,
    base: In<Odometry>,
    id: Prop<i64>,
    model: ArmModel,
    rows: Vec<Row>,
}

impl Component for Probe {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Records the control loop.");
        Self {
            other: b.input("other"),
            hand: b.input("hand"),
            saturated: b.input("saturated"),
            mode: b.input("mode"),
            joints: b.input("joints"),
            base: b.input("base"),
            id: b.property("id", 0_i64),
            model: ArmModel::youbot(0.219, 1.0),
            rows: Vec::new(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(joints) = self.joints.get() else { return };
        let base = self.base.get().unwrap_or_default();
        let (pose, twist) = base.split();
        let tool = Tool::of(&self.model, &J5::from(joints.pos), &J5::from(joints.vel), pose, twist);
        self.rows.push(Row {
            t: seconds_since(cx.now(), Time(0)),
            tool: tool.position,
            speed: tool.velocity,
            other: self.other.get().map(|p| p.p.into()),
            hand: self.hand.get().unwrap_or_default(),
            saturated: self.saturated.get().unwrap_or(0),
            mode: self.mode.get().unwrap_or(0),
            joints,
            base,
        });
        if self.rows.len() >= 16 {
            ROWS.lock().unwrap().entry(self.id.get()).or_default().append(&mut self.rows);
        }
    }
}

/// Where the probe looks.
const LOOKS: [(&str, &str); 6] = [
    ("Peer.tool_pose", "other"),
    ("Operator.ext_force", "hand"),
    ("Dynamics.tau_sat", "saturated"),
    ("youbot.control_mode", "mode"),
    ("youbot.jointstate", "joints"),
    ("youbot.odometry", "base"),
];

/// What the hand does as shipped.
const SHIPPED_HAND: &str = "free 0.5; align 8; hold 1; sway 600 0.06 0 0 0.15";

/// `text` with `new` put behind `old`, which stands in it once.
fn behind(text: &str, old: &str, new: &str) -> String {
    assert_eq!(text.matches(old).count(), 1, "{old}");
    text.replace(old, &format!("{old}{new}"))
}

/// The shipped configurations with the probe in them.
fn probed(id: i64, change: impl Fn(String) -> String) -> String {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/youbot/configurations.lua");
    let text = std::fs::read_to_string(shipped).unwrap();
    let each = |verb: &str| LOOKS.map(|(from, to)| format!("\n{verb}(\"{from}\", \"Probe.{to}\"),")).concat();
    let created =
        format!("\ncreate(\"Probe\", \"test.Probe\", {{ activity = \"control\", properties = {{ id = {id} }} }}),");
    let text =
        behind(&text, "create_core = Configuration(with_stand_in({ description = \"the control loop\",", &created);
    let text = behind(&text, "\n  connect_all = Configuration(with_stand_in({", &each("connect"));
    let text = behind(&text, "disconnect_all = Configuration(with_stand_in({", &each("disconnect"));
    let text = behind(&text, "destroy_all = Configuration(with_stand_in({", "destroy(\"Probe\"),");
    change(behind(&text, "post_conf_state = with_world{\n      \"youbot:running\",", "\n      \"Probe:running\","))
}

/// A file with the probe in it, read and checked once for all that want the same, one after the other: to check it takes
/// longer than to bring it up.
struct Loaded {
    /// The file's name and its configurations before they got the probe's number.
    key: (String, String),
    id: i64,
    checked: Arc<app::Checked>,
}

/// What nobody uses at the moment.
static LOADED: Mutex<Vec<Loaded>> = Mutex::new(Vec::new());

impl Loaded {
    fn of(name: &str, change: &impl Fn(String) -> String) -> Self {
        static NEXT: AtomicI64 = AtomicI64::new(1);
        let key = (name.to_owned(), probed(0, change));
        let free = |all: &mut Vec<Self>| all.iter().position(|one| one.key == key).map(|at| all.swap_remove(at));
        if let Some(one) = free(&mut LOADED.lock().unwrap()) {
            ROWS.lock().unwrap().remove(&one.id);
            return one;
        }
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let folder = tempfile::tempdir().unwrap();
        let shipped = std::fs::read_to_string(root.join("deployments").join(format!("{name}.yaml"))).unwrap();
        let shipped = shipped.replace("../configs/youbot/configurations.lua", "probed.lua");
        let shipped = shipped.replace("../configs", root.join("configs").to_str().unwrap());
        let shipped = shipped.replace("libraries: [youbot]", "libraries: [youbot, test]");
        std::fs::write(folder.path().join("d.yaml"), shipped).unwrap();
        std::fs::write(folder.path().join("probed.lua"), probed(id, change)).unwrap();
        let libraries = libraries::builtin().with(Library::new("test").with::<Probe>("test.Probe"));
        let checked = app::read(&folder.path().join("d.yaml"), &LoadOptions::default(), &libraries)
            .and_then(app::check)
            .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        Self { key, id, checked: Arc::new(checked) }
    }
}

impl Drop for Loaded {
    fn drop(&mut self) {
        // A test that fails may leave its probe running.
        if !std::thread::panicking() {
            LOADED.lock().unwrap().push(Self { key: self.key.clone(), id: self.id, checked: self.checked.clone() });
        }
    }
}

/// What happened, with its time in s: events as they are called, states as `in NAME`.
type Happened = Arc<Mutex<Vec<(f64, String)>>>;

pub struct Live {
    pub clock: Clock,
    pub session: Arc<Session>,
    happened: Happened,
    id: i64,
    // Dropped behind all that uses it: leaving the clock, then what was loaded.
    _guard: Guard,
    _loaded: Loaded,
}

impl Live {
    /// Nothing brought up yet; `name` is a file under deployments/.
    pub fn new(name: &str) -> Self {
        Self::with(name, |text| text)
    }

    /// The same, with the text of its configurations changed.
    pub fn with(name: &str, change: impl Fn(String) -> String) -> Self {
        let loaded = Loaded::of(name, &change);
        let clock = Clock::simulated();
        let guard = clock.enter();
        let session = app::start(&loaded.checked, &clock).unwrap();
        let happened = Happened::default();
        let log = happened.clone();
        session.hub().observe(Arc::new(move |at, what| {
            let what = match what {
                Happening::Event { event, .. } => event.clone(),
                Happening::Answered(answered) => answered.answer.clone(),
                Happening::State { active } => format!("in {}", active.last().map_or("", String::as_str)),
                Happening::Fault { component, .. } => format!("{component} faulted"),
                Happening::Lost { event, .. } => event.clone(),
                _ => return,
            };
            log.lock().unwrap().push((at.as_secs_f64(), what));
        }));
        Self { clock, session, happened, id: loaded.id, _guard: guard, _loaded: loaded }
    }

    /// The same, with another hand on the tool than the shipped one.
    pub fn with_hand(name: &str, script: &str) -> Self {
        Self::with(name, |text| {
            assert_eq!(text.matches(SHIPPED_HAND).count(), 1);
            text.replace(SHIPPED_HAND, script)
        })
    }

    /// The same, with other friction and other masses in its joints, as multiples of the nominal ones.
    pub fn with_joints(name: &str, script: &str, friction: f64, mass: f64) -> Self {
        let joints = format!(
            "\nproperty_set(\"World.robot1_friction_scale\", {friction:?}), property_set(\"World.robot1_mass_scale\", {mass:?}),"
        );
        Self::with(name, |text| {
            assert_eq!(text.matches(SHIPPED_HAND).count(), 1);
            behind(
                &text.replace(SHIPPED_HAND, script),
                "this robot's own numbers, then everything configured\",",
                &joints,
            )
        })
    }

    /// Brought up.
    pub fn up(name: &str) -> Self {
        let live = Self::new(name);
        live.bring_up();
        live
    }

    pub fn bring_up(&self) {
        self.session.bring_up().unwrap_or_else(|not| panic!("{not:#?}"));
    }

    /// Up, and in `copying` with eight degrees of freedom.
    pub fn copying(name: &str) -> Self {
        let live = Self::up(name);
        live.until("in copying", 15.0, |live| live.session.in_state("copying"));
        live
    }

    pub fn now(&self) -> f64 {
        self.clock.now().as_secs_f64()
    }

    pub fn run(&self, seconds: f64) {
        self.clock.sleep(Duration::from_secs_f64(seconds));
    }

    pub fn raise(&self, event: &str) {
        self.session.raise(EventName::new(event).unwrap(), "test");
    }

    /// Lets time pass until something is so.
    pub fn until(&self, what: &str, within: f64, so: impl Fn(&Self) -> bool) {
        let deadline = self.now() + within;
        while !so(self) {
            assert!(
                self.now() < deadline,
                "not {what} within {within} s: {}\n{}",
                self.place(),
                self.story(deadline - within)
            );
            self.run(0.001);
        }
    }

    pub fn until_state(&self, state: &str, within: f64) {
        self.until(&format!("in `{state}`"), within, |live| live.session.in_state(state));
    }

    pub fn place(&self) -> String {
        self.session.hub().active().last().cloned().unwrap_or_default()
    }

    /// What happened from `t` on, one line each.
    pub fn story(&self, t: f64) -> String {
        let all = self.happened.lock().unwrap();
        let mut lines: Vec<String> = Vec::new();
        for (at, what) in all.iter().filter(|(at, _)| *at >= t) {
            // What monitors repeat is told once.
            if !lines.iter().rev().take(6).any(|line| line.ends_with(&format!(" {what}"))) {
                lines.push(format!("{at:.4} {what}"));
            }
        }
        lines.join("\n")
    }

    /// When something of that name happened first, at `t` or later.
    pub fn first(&self, what: &str, t: f64) -> Option<f64> {
        self.happened.lock().unwrap().iter().find(|(at, w)| *at >= t && w == what).map(|(at, _)| *at)
    }

    /// A property behind everybody's back, as the world does it.
    pub fn set(&self, component: &str, property: &str, value: impl Into<Value>) {
        let property =
            MemberRef { component: ComponentName::new(component).unwrap(), member: Ident::new(property).unwrap() };
        self.step(&Step::PropertySet { property, value: value.into() });
    }

    pub fn step(&self, step: &Step) {
        let outcome = self.session.platform().execute(step, self.clock.now() + Duration::from_secs(1));
        assert!(matches!(outcome, Outcome::Done(_)), "{step}: {outcome:?}");
    }

    /// A fault of the driver.
    pub fn driver_fault(&self, fault: &str) {
        let operation =
            MemberRef { component: ComponentName::new("youbot").unwrap(), member: Ident::new("inject_fault").unwrap() };
        self.step(&Step::Operation(Call { operation, args: vec![fault.into()] }));
    }

    /// What the probe has seen since it was read last.
    pub fn rows(&self) -> Vec<Row> {
        ROWS.lock().unwrap().remove(&self.id).unwrap_or_default()
    }

    /// Down, with nothing left and nothing forced.
    pub fn down(self) {
        let ended = self.session.take_down(false);
        assert!(ended.is_clean() && ended.forced.is_empty(), "{ended:?}\n{}", self.story(0.0));
        assert_eq!(self.first("e_arm_dropped", 0.0), None);
        assert_eq!(self.first("e_arm_fell", 0.0), None);
        self.clock.shutdown();
    }
}

/// The largest change of a joint's torque from one update to the next, in N m, and when.
pub fn jolt(rows: &[Row]) -> (f64, f64) {
    let step = |w: &[Row]| (0..5).map(|i| (w[1].joints.eff[i] - w[0].joints.eff[i]).abs()).fold(0.0, f64::max);
    rows.windows(2).map(|w| (step(w), w[1].t)).fold((0.0, 0.0), |most, now| if now.0 > most.0 { now } else { most })
}
