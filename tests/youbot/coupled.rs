//! Two robots with a network in each direction between them, in one deployment: they couple, and let go together.
//!
//! The files are the shipped ones of one robot, written flat for two, with a `youbot.Net` in place of the stand-in for the other one.

use crate::flat;
use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use davit::libraries::youbot::components::samples::{Odometry, ToolPose, seconds_since};
use davit::model::{Ask, Call, ComponentName, ConfigId, EventName, Ident, MemberRef, Step, Value};
use davit::platform::Outcome;
use davit::runtime::{Builder, Component, Context, In, Library};
use davit::session::{Happening, Session};
use davit::time::{Clock, Guard, Time};
use nalgebra::Vector3;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;

const SIDES: [&str; 2] = ["left_", "right_"];

/// One robot's half of a row.
#[derive(Debug, Clone, Copy)]
struct Half {
    tool: Vector3<f64>,
    force: Vector3<f64>,
    engaged: f64,
    base: Odometry,
}

/// Both robots at a moment (s).
type Row = (f64, [Half; 2]);

/// What the observer of the coupling has seen: given out at most and stored (J), and whether it was violated.
static OBSERVED: Mutex<(f64, f64, bool)> = Mutex::new((0.0, 0.0, true));

static ROWS: Mutex<Vec<Row>> = Mutex::new(Vec::new());

/// Records both control loops. There is one at a time.
struct PairProbe {
    tools: [In<ToolPose>; 2],
    forces: [In<Vector3<f64>>; 2],
    engaged: [In<f64>; 2],
    bases: [In<Odometry>; 2],
    given: In<f64>,
    stored: In<f64>,
    violated: In<bool>,
}

impl Component for PairProbe {
    fn new(b: &mut Builder<Self>) -> Self {
        Self {
            tools: SIDES.map(|side| b.input(&format!("{side}tool"))),
            forces: SIDES.map(|side| b.input(&format!("{side}force"))),
            engaged: SIDES.map(|side| b.input(&format!("{side}engaged"))),
            bases: SIDES.map(|side| b.input(&format!("{side}base"))),
            given: b.input("given"),
            stored: b.input("stored"),
            violated: b.input("violated"),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let halves = [0, 1].map(|side| {
            Some(Half {
                tool: self.tools[side].get()?.p.into(),
                force: self.forces[side].get().unwrap_or_default(),
                engaged: self.engaged[side].get().unwrap_or_default(),
                base: self.bases[side].get().unwrap_or_default(),
            })
        });
        if let [Some(left), Some(right)] = halves {
            ROWS.lock().unwrap().push((seconds_since(cx.now(), Time(0)), [left, right]));
        }
        if let (Some(given), Some(stored)) = (self.given.get(), self.stored.get()) {
            *OBSERVED.lock().unwrap() = (-given, stored, self.violated.get().unwrap_or(true));
        }
    }
}

const PROBED: [(&str, &str); 4] = [
    ("Arm_Kinematics.tool_pose", "tool"),
    ("Cart_Impedance.f_des", "force"),
    ("Cart_Impedance.engaged", "engaged"),
    ("youbot.odometry", "base"),
];

const OBSERVED_AT: [(&str, &str); 3] = [
    ("Arm_Kinematics.tool_pose", "tool_pose"),
    ("Cart_Impedance.f_des", "force"),
    ("Cart_Impedance.engaged", "engaged"),
];

const TOLD: [(&str, &str); 3] = [("minimum", "given"), ("stored", "stored"), ("violated", "violated")];

/// The lines that connect, or disconnect, a robot with what it hears and with the probe.
fn joined(verb: &str, side: &str) -> String {
    let other = SIDES.iter().find(|other| **other != side).expect("another one");
    let buffer = if verb == "connect" { ", { buffer = 64 }" } else { "" };
    let probed = PROBED.map(|(from, to)| format!("{verb}(\"{side}{from}\", \"PairProbe.{side}{to}\"),\n"));
    let observed = OBSERVED_AT.map(|(from, to)| format!("{verb}(\"{side}{from}\", \"Observer.{side}{to}\"),\n"));
    let told = TOLD.map(|(from, to)| format!("{verb}(\"Observer.{from}\", \"PairProbe.{to}\"),\n"));
    // The observer and the probe are the right robot's.
    let told = if side == SIDES[1] { told.concat() } else { String::new() };
    format!("{verb}(\"{other}Net.tx\", \"{side}Link_Rx.rx\"{buffer}),\n{}{}{told}", probed.concat(), observed.concat())
}

fn once(text: &str, old: &str, new: &str) -> String {
    assert_eq!(text.matches(old).count(), 1, "{old}");
    text.replace(old, new)
}

/// `text` with the stand-in of that side's robot gone and the network to the other robot in its place.
fn with_net(side: &str, text: &str, hand: &str) -> String {
    let peer = format!("\"{side}Peer");
    let kept = |line: &&str| !line.contains(&format!("{peer}.tx\", ")) && !line.contains(&format!("{peer}.force_gain"));
    let text: String = text.lines().filter(kept).map(|line| line.to_owned() + "\n").collect();
    let text = text.replace(&peer, &format!("\"{side}Net")).replace("youbot.Peer", "youbot.Net");
    let text = once(&text, "free 0.5; align 8; hold 1; sway 600 0.06 0 0 0.15", hand);
    // The two robots' clocks show different times, and drift apart.
    let (ahead, drift) = if side == SIDES[0] { (7.5, 50.0) } else { (-7.5, -50.0) };
    let text = text.replace(
        &format!("property_set(\"{side}Net.delay\","),
        &format!(
            "property_set(\"{side}Net.clock_offset\", {ahead:?}), property_set(\"{side}Net.clock_drift\", {drift:?}),\n    \
             property_set(\"{side}Net.delay\","
        ),
    );
    let all = |verb: &str| format!("{side}{verb}_all = Configuration(with_stand_in({{\n");
    let text = ["connect", "disconnect"]
        .iter()
        .fold(text, |text, verb| once(&text, &all(verb), &(all(verb) + &joined(verb, side))));
    // Both networks and the probe are the right robot's, which is up and down behind the left one.
    let created = |what: &str, ty: &str, activity: &str| {
        format!("    create(\"{what}\", \"{ty}\", {{ activity = \"{activity}\" }}),\n")
    };
    let net = |side: &str| created(&format!("{side}Net"), "youbot.Net", "link");
    let own = text.lines().find(|line| line.contains("youbot.Net\"")).expect("its network").to_owned() + "\n";
    let destroyed = format!("destroy(\"{side}Net\")");
    if side == SIDES[0] {
        let text = once(&text, &own, "");
        return once(&text, &format!("{destroyed},"), "");
    }
    let text = once(
        &text,
        &own,
        &(SIDES.map(net).concat()
            + &created("Observer", "youbot.Passivity_Observer", "control")
            + &created("PairProbe", "test.PairProbe", "control")),
    );
    let text = once(
        &text,
        &destroyed,
        "destroy(\"left_Net\"), destroy(\"right_Net\"), destroy(\"Observer\"), destroy(\"PairProbe\")",
    );
    ["running", "configured", "stopped", "unconfigured"].iter().fold(text, |text, state| {
        let own = format!("\"right_Net:{state}\"");
        text.replace(&own, &format!("{own}, \"Observer:{state}\", \"PairProbe:{state}\""))
    })
}

/// The left hand carries its arm to the other one and sways it; the right one puts its arm aside and lets go.
const HANDS: [&str; 2] = ["free 0.5; align 6; sway 600 0.042 0.042 0 0.15", "free 0.2; go 1 0 0.06 0; free 600"];

struct Pair {
    clock: Clock,
    session: Arc<Session>,
    happened: Arc<Mutex<Vec<(f64, String)>>>,
    _guard: Guard,
    _alone: std::sync::MutexGuard<'static, ()>,
}

static ALONE: Mutex<()> = Mutex::new(());

impl Pair {
    /// Up; it takes so much virtual time as it needs.
    fn up() -> Self {
        let alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        ROWS.lock().unwrap().clear();
        let checked = checked();
        let clock = Clock::simulated();
        let guard = clock.enter();
        let session = app::start(&checked, &clock).unwrap();
        let happened: Arc<Mutex<Vec<(f64, String)>>> = Arc::default();
        let log = happened.clone();
        session.hub().observe(Arc::new(move |at, what| {
            let what = match what {
                Happening::Event { event, .. } => event.clone(),
                Happening::Answered(answered) => match answered.ok {
                    true => answered.answer.clone(),
                    false => format!("{}: {:?}", answered.answer, answered.reasons),
                },
                Happening::Fault { component, .. } => format!("{component} faulted"),
                _ => return,
            };
            log.lock().unwrap().push((at.as_secs_f64(), what));
        }));
        session.bring_up().unwrap_or_else(|not| panic!("{not:#?}"));
        Self { clock, session, happened, _guard: guard, _alone: alone }
    }

    fn now(&self) -> f64 {
        self.clock.now().as_secs_f64()
    }

    fn run(&self, seconds: f64) {
        self.clock.sleep(Duration::from_secs_f64(seconds));
    }

    /// When something of that name happened first, at `t` or later.
    fn first(&self, what: &str, t: f64) -> Option<f64> {
        self.happened.lock().unwrap().iter().find(|(at, w)| *at >= t && w == what).map(|(at, _)| *at)
    }

    /// What happened from `t` on, what monitors repeat told once.
    fn story(&self, t: f64) -> Vec<(f64, String)> {
        let mut told: Vec<(f64, String)> = Vec::new();
        for (at, what) in self.happened.lock().unwrap().iter().filter(|(at, _)| *at >= t) {
            if !told.iter().rev().take(8).any(|(_, before)| before == what) {
                told.push((*at, what.clone()));
            }
        }
        told
    }

    fn until(&self, what: &str, within: f64) -> f64 {
        let begin = self.now();
        loop {
            if let Some(at) = self.first(what, begin) {
                return at;
            }
            assert!(self.now() < begin + within, "no {what}: {:?}", self.story(begin - 3.0));
            self.run(0.001);
        }
    }

    fn set(&self, component: &str, property: &str, value: impl Into<Value>) {
        let property =
            MemberRef { component: ComponentName::new(component).unwrap(), member: Ident::new(property).unwrap() };
        self.step(&Step::PropertySet { property, value: value.into() });
    }

    /// The left hand does something else.
    fn hand(&self, script: &str) {
        let operation = MemberRef {
            component: ComponentName::new("left_Operator").unwrap(),
            member: Ident::new("load_script").unwrap(),
        };
        self.step(&Step::Operation(Call { operation, args: vec![script.into()] }));
    }

    fn step(&self, step: &Step) {
        let outcome = self.session.platform().execute(step, self.clock.now() + Duration::from_secs(1));
        assert!(matches!(outcome, Outcome::Done(_)), "{step}: {outcome:?}");
    }

    fn raise(&self, event: &str) {
        self.session.raise(EventName::new(event).unwrap(), "test");
    }

    fn rows(&self) -> Vec<Row> {
        std::mem::take(&mut ROWS.lock().unwrap())
    }

    /// Both in `copying`.
    fn copying() -> Self {
        let pair = Self::up();
        for side in SIDES {
            if pair.first(&format!("{side}enable_copying.ok"), 0.0).is_none() {
                pair.until(&format!("{side}enable_copying.ok"), 10.0);
            }
        }
        pair
    }

    fn down(self) {
        let t = self.now();
        let ended = self.session.take_down(false);
        // What joins the two is one robot's: where that one is down first, the rest is taken away by force.
        assert!(ended.left.is_empty(), "{:?}\n{ended:?}", self.story(t));
        for side in SIDES {
            assert!(self.first(&format!("{side}park.ok"), t).is_some(), "{:?}", self.story(t));
        }
        assert_eq!(self.first("e_arm_dropped", 0.0), None);
        self.clock.shutdown();
    }
}

/// Read and checked once.
fn checked() -> Arc<app::Checked> {
    static CHECKED: Mutex<Option<Arc<app::Checked>>> = Mutex::new(None);
    let mut kept = CHECKED.lock().unwrap();
    if kept.is_none() {
        let folder = tempfile::tempdir().unwrap();
        let file = flat::youbots(folder.path(), &SIDES);
        for (side, hand) in SIDES.iter().zip(HANDS) {
            edit(folder.path(), &format!("{side}configurations.lua"), |text| with_net(side, &text, hand));
            edit(folder.path(), &format!("{side}monitors.lua"), |text| text.replace("Peer", "Net"));
        }
        edit(folder.path(), "youbots.yaml", |text| once(&text, "[youbot]", "[youbot, test]"));
        let libraries = libraries::builtin().with(Library::new("test").with::<PairProbe>("test.PairProbe"));
        let checked = app::read(&file, &LoadOptions::default(), &libraries)
            .and_then(app::check)
            .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        *kept = Some(Arc::new(checked));
    }
    kept.clone().unwrap()
}

fn edit(folder: &Path, name: &str, with: impl Fn(String) -> String) {
    let file = folder.join(name);
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(file, with(text)).unwrap();
}

/// The first moment at which that is so of a side.
fn when(rows: &[Row], side: usize, so: impl Fn(&Half) -> bool) -> f64 {
    rows.iter().find(|(_, halves)| so(&halves[side])).map_or(f64::INFINITY, |(t, _)| *t)
}

/// Between two packets, and under way (5 ms), with what the two activities add.
const PACKET: f64 = 0.004 + 0.005 + 0.003;

#[test]
fn they_couple_follow_and_let_go_together() {
    let pair = Pair::copying();
    pair.run(0.5);
    let rows = pair.rows();
    let engaged = [0, 1].map(|side| when(&rows, side, |half| half.engaged > 0.0));
    println!("both engage within {:.1} ms of each other", (engaged[0] - engaged[1]).abs() * 1e3);
    assert!((engaged[0] - engaged[1]).abs() <= PACKET, "{engaged:?}");

    // The left one is swayed; the right one, which nobody touches, follows.
    pair.run(6.0);
    pair.rows();
    pair.run(20.0);
    let rows = pair.rows();
    let squares = rows.iter().map(|(_, [left, right])| (left.tool - right.tool).norm_squared());
    let error = (squares.sum::<f64>() / rows.len() as f64).sqrt() * 1e3;
    let span = |side: usize, axis: usize| {
        let of = rows.iter().map(|(_, halves)| halves[side].tool[axis]);
        of.clone().fold(f64::MIN, f64::max) - of.fold(f64::MAX, f64::min)
    };
    println!("{error:.1} mm RMS between the tools, {:.3} m swayed, {:.3} m followed", span(0, 1), span(1, 1));
    assert!(rows.len() > 19_000 && error <= 12.0 && span(0, 1) > 0.06 && span(1, 1) > 0.05, "{error} mm");
    let moved = rows.iter().map(|(_, [_, right])| right.base.x.hypot(right.base.y)).fold(0.0, f64::max);
    assert!(moved > 0.02, "its base moved {moved} m");

    let (given, stored, violated) = *OBSERVED.lock().unwrap();
    println!("the coupling gave out {given:.4} J at most, {stored:.4} J were stored");
    assert!(!violated && stored < 0.02, "{given} J {stored} J");
    pair.hand("sway 600 0.02 0 0 0.3");
    // Eight degrees of freedom are those of both: one operator takes five, and neither base moves.
    let t = pair.now();
    pair.raise("e_5dof");
    pair.run(1.0);
    pair.rows();
    pair.run(3.0);
    let rows = pair.rows();
    assert!(rows.iter().all(|(_, halves)| halves.iter().all(|half| half.engaged > 0.99)), "{:?}", pair.story(t));
    let fastest = rows.iter().flat_map(|(_, halves)| halves.iter()).map(|half| half.base.vx.hypot(half.base.vy));
    assert!(fastest.fold(0.0, f64::max) < 1e-3);
    pair.raise("e_8dof");
    pair.run(1.0);
    for side in 0..2 {
        // Its operator asks for it, and no coordinator knows: what the other robot is told is what counts.
        let five = ConfigId::new(&format!("{}five_DOF", SIDES[side])).unwrap();
        pair.session.request(Ask::Apply(five), "operator", true);
        pair.run(0.5);
        pair.rows();
        pair.run(3.0);
        let rows = pair.rows();
        assert!(rows.iter().all(|(_, halves)| halves.iter().all(|half| half.engaged > 0.99)), "{:?}", pair.story(t));
        let fastest = rows.iter().map(|(_, halves)| halves[1 - side].base).map(|base| base.vx.hypot(base.vy));
        let fastest = fastest.fold(0.0, f64::max);
        assert!(fastest < 1e-3, "the base of {} yields alone, {fastest} m/s {:?}", SIDES[1 - side], pair.story(t));
        pair.session.request(Ask::UndoOf(five), "operator", true);
        pair.run(0.5);
    }

    // One lets go, as its controller says and before any coordinator is told.
    pair.rows();
    let t = pair.now();
    pair.raise("e_right_misaligned");
    pair.until("right_disable_copying.ok", 0.1);
    pair.run(0.2);
    let rows = pair.rows();
    // It may be told aligned, and begin again, a moment later.
    let gone = |side: usize| rows.iter().find(|(_, h)| h[side].force.norm() == 0.0).map_or(f64::NAN, |(at, _)| *at - t);
    let (left, right) = (gone(0), gone(1));
    println!("let go of: {:.1} ms, the other one {:.1} ms", right * 1e3, left * 1e3);
    assert!(right <= 0.102 && left > right - 0.003 && left <= right + PACKET, "{right} {left} {:?}", pair.story(t));
    pair.down();
}

/// What is good is told good whatever the other robot's clock shows; what is cut is lost at both ends, and couples again.
#[test]
fn what_is_cut_is_lost_at_both_ends() {
    let pair = Pair::copying();
    let t = pair.now();
    pair.run(5.0);
    for side in SIDES {
        for event in ["link_lost", "qos_degraded"] {
            assert_eq!(pair.first(&format!("e_{side}{event}"), t), None);
        }
    }
    pair.set("left_Net", "cut", true);
    // The right one hears nothing; the left one hears that it is not heard any more.
    let t = pair.now();
    pair.until("e_right_link_lost", 0.12);
    assert!(pair.first("right_disable_copying.ok", t).is_some());
    pair.run(0.3);
    let rows = pair.rows();
    let still = rows.iter().filter(|(at, _)| *at > t + 0.12 + 0.1 + PACKET).flat_map(|(_, halves)| halves.iter());
    let force = still.map(|half| half.force.norm()).fold(0.0, f64::max);
    let all: Vec<_> = rows.iter().map(|(at, h)| (*at - t, h[0].force.norm(), h[1].force.norm())).step_by(20).collect();
    assert!(force == 0.0, "{force} N {all:?} {:?}", pair.story(t));
    pair.set("left_Net", "cut", false);
    pair.hand("align 6; free 600");
    pair.until("right_enable_copying.ok", 10.0);
    pair.run(0.5);
    let rows = pair.rows();
    assert!(rows.last().unwrap().1.iter().all(|half| half.engaged > 0.99), "{:?}", rows.last());
    pair.down();
}
