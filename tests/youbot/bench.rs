//! A bench for one robot: the deployment's configurations applied on the embedded platform in simulated time, a probe in
//! the control loop, the events with their times.

use davit::libraries::youbot::components::samples::{JointState, Odometry, ToolPose, seconds_since};
use davit::model::{
    Call, ComponentName, ConfigId, Deployment, Ident, MemberRef, Policy, RunState, Step, Transition, TypeName, Value,
};
use davit::plan::{PlanContext, plan};
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::{Outcome, Platform, PlatformEvent};
use davit::runtime::{Builder, Component, Context, In, Libraries, Library, Prop};
use davit::system::System;
use davit::system::step::apply;
use davit::time::{Clock, Guard, Receiver, Time};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// One update of the control loop.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// In s.
    pub t: f64,
    pub tool: Vector3<f64>,
    /// Where the other tool really is.
    pub other: Option<Vector3<f64>>,
    /// Force put out, and what it was when it was not yet written.
    pub force: Vector3<f64>,
    pub hand: Vector3<f64>,
    pub saturated: u8,
    pub mode: u8,
    pub joints: JointState,
    pub base: Odometry,
    /// Memory requests of the control thread so far.
    pub requests: u64,
}

static ROWS: Mutex<BTreeMap<i64, Vec<Row>>> = Mutex::new(BTreeMap::new());

/// Records the control loop.
struct Probe {
    tool: In<ToolPose>,
    other: In<ToolPose>,
    force: In<Vector3<f64>>,
    hand: In<Vector3<f64>>,
    saturated: In<u8>,
    mode: In<u8>,
    joints: In<JointState>,
    base: In<Odometry>,
    id: Prop<i64>,
    rows: Vec<Row>,
}

impl Component for Probe {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Records the control loop.").on_stop(|c, _| {
            c.hand_over();
            Ok(())
        });
        b.no_effect().operation("read", |c, _, (): ()| {
            c.hand_over();
            davit::runtime::OperationAnswer::Done(())
        });
        Self {
            tool: b.input("tool"),
            other: b.input("other"),
            force: b.input("force"),
            hand: b.input("hand"),
            saturated: b.input("saturated"),
            mode: b.input("mode"),
            joints: b.input("joints"),
            base: b.input("base"),
            id: b.property("id", 0_i64),
            rows: Vec::with_capacity(200_000),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let Some(tool) = self.tool.get() else { return };
        self.rows.push(Row {
            t: seconds_since(cx.now(), Time(0)),
            tool: tool.p.into(),
            other: self.other.get().map(|p| p.p.into()),
            force: self.force.get().unwrap_or_default(),
            hand: self.hand.get().unwrap_or_default(),
            saturated: self.saturated.get().unwrap_or(0),
            mode: self.mode.get().unwrap_or(0),
            joints: self.joints.get().unwrap_or_default(),
            base: self.base.get().unwrap_or_default(),
            requests: crate::counting::made(),
        });
    }
}

impl Probe {
    fn hand_over(&mut self) {
        let id = self.id.get();
        ROWS.lock().unwrap().entry(id).or_default().append(&mut self.rows);
    }
}

/// Event names with their times in s.
type Events = Arc<Mutex<Vec<(f64, String)>>>;

pub struct Bench {
    pub clock: Clock,
    pub platform: Arc<EmbeddedPlatform>,
    pub system: System,
    pub deployment: Deployment,
    events: Events,
    id: i64,
    // Dropped last: leaving the clock.
    _guard: Guard,
}

pub const PROBE: &str = "Probe";

fn member(component: &str, name: &str) -> MemberRef {
    MemberRef { component: ComponentName::new(component).unwrap(), member: Ident::new(name).unwrap() }
}

impl Bench {
    /// Nothing deployed; `name` is a file under deployments/.
    pub fn new(name: &str) -> Self {
        Self::on(name, Clock::simulated())
    }

    fn on(name: &str, clock: Clock) -> Self {
        static NEXT: Mutex<i64> = Mutex::new(0);
        let id = {
            let mut next = NEXT.lock().unwrap();
            *next += 1;
            *next
        };
        let (deployment, _) = super::files::deployment(name);
        let libraries = Libraries::new()
            .with(davit::libraries::youbot::library())
            .with(davit::libraries::monitors::library(&deployment.monitors))
            .with(Library::new("test").with::<Probe>("test.Probe"));
        let guard = clock.enter();
        let platform = Arc::new(EmbeddedPlatform::new(&clock, &libraries, &deployment.activities));
        let events = Events::default();
        let heard = events.clone();
        platform.subscribe(Arc::new(move |event| match event {
            PlatformEvent::Raised { event, at, .. } => {
                heard.lock().unwrap().push((at.as_secs_f64(), event.as_str().to_owned()));
            }
            PlatformEvent::Faulted { component, at, .. } => {
                heard.lock().unwrap().push((at.as_secs_f64(), format!("{component} faulted")));
            }
            PlatformEvent::Returned { .. } => {}
        }));
        let system = System::new(Arc::new(platform.catalogue().clone()));
        Self { clock, platform, system, deployment, events, id, _guard: guard }
    }

    /// One step, on the platform and in the picture.
    pub fn step(&mut self, step: &Step, within: Duration) {
        let outcome = self.platform.execute(step, self.clock.now() + within);
        assert!(matches!(outcome, Outcome::Done(_)), "{step}: {outcome:?}");
        apply(step, &mut self.system).unwrap_or_else(|v| panic!("{step}: {v:?}"));
    }

    /// A configuration of the deployment, step by step.
    pub fn apply(&mut self, id: &str) {
        let context =
            PlanContext { activities: self.deployment.activities.keys().copied().collect(), ..Default::default() };
        let id = ConfigId::new(id).unwrap();
        let configuration = self.deployment.configuration(id).unwrap_or_else(|| panic!("no {id}"));
        let within = configuration.timeout.unwrap_or(Duration::from_secs(1));
        let plan = plan(&self.system, configuration, &context).unwrap_or_else(|r| panic!("{id}: {:?}", r.findings));
        for step in &plan.steps {
            self.step(&step.step, within);
        }
    }

    pub fn all(&mut self, ids: &[&str]) {
        for id in ids {
            self.apply(id);
        }
    }

    pub fn set(&mut self, component: &str, property: &str, value: impl Into<Value>) {
        let ty = {
            let name = ComponentName::new(component).unwrap();
            self.system.snapshot().components[&name].ty
        };
        let catalogue = self.system.catalogue().clone();
        let slot = &catalogue.get(ty).unwrap().properties[&Ident::new(property).unwrap()];
        let value = slot.fit(value.into()).unwrap();
        self.step(&Step::PropertySet { property: member(component, property), value }, Duration::from_secs(1));
    }

    pub fn call(&mut self, operation: (&str, &str), args: Vec<Value>) -> Outcome {
        let call = Call { operation: member(operation.0, operation.1), args };
        self.platform.execute(&Step::Operation(call), self.clock.now() + Duration::from_secs(10))
    }

    /// Has another thread call an operation without arguments; what it answers, and when.
    pub fn begin(&self, operation: (&str, &str)) -> Receiver<(Outcome, Time)> {
        let (answer, answered) = self.clock.channel(1);
        let (platform, clock) = (self.platform.clone(), self.clock.clone());
        let step = Step::Operation(Call { operation: member(operation.0, operation.1), args: vec![] });
        self.clock.spawn("another", move || {
            let outcome = platform.execute(&step, clock.now() + Duration::from_secs(10));
            let _ = answer.try_send((outcome, clock.now()));
        });
        answered
    }

    pub fn give_up(&self, operation: (&str, &str)) {
        self.platform.cancel(&Step::Operation(Call { operation: member(operation.0, operation.1), args: vec![] }));
    }

    pub fn state(&mut self, component: &str, transition: Transition) {
        let component = ComponentName::new(component).unwrap();
        self.step(&Step::State { component, transition }, Duration::from_secs(1));
    }

    /// Lets time pass.
    pub fn run(&self, seconds: f64) {
        self.clock.sleep(Duration::from_secs_f64(seconds));
    }

    pub fn now(&self) -> f64 {
        self.clock.now().as_secs_f64()
    }

    /// Waits for an event raised from now on; its time in s.
    pub fn wait(&self, event: &str, within: f64) -> f64 {
        let begin = self.now();
        loop {
            let found = self.events().into_iter().find(|(t, e)| e == event && *t > begin);
            if let Some((t, _)) = found {
                return t;
            }
            assert!(self.now() < begin + within, "no {event} within {within} s; heard {:?}", self.since(begin));
            self.run(0.001);
        }
    }

    pub fn events(&self) -> Vec<(f64, String)> {
        self.events.lock().unwrap().clone()
    }

    pub fn since(&self, t: f64) -> Vec<(f64, String)> {
        self.events().into_iter().filter(|(at, _)| *at >= t).collect()
    }

    pub fn heard(&self, event: &str) -> bool {
        self.events().iter().any(|(_, e)| e == event)
    }

    /// Puts the probe into the control loop; after create_*, before connect_all or later.
    pub fn probe(&mut self) {
        let component = ComponentName::new(PROBE).unwrap();
        let second = Duration::from_secs(1);
        self.step(
            &Step::Create {
                component,
                ty: TypeName::new("test.Probe").unwrap(),
                activity: Some(Ident::new("control").unwrap()),
                properties: vec![Value::Int(self.id)],
            },
            second,
        );
        for (from, port, to) in [
            ("Arm_Kinematics", "tool_pose", "tool"),
            ("Peer", "tool_pose", "other"),
            ("Cart_Impedance", "f_des", "force"),
            ("Operator", "ext_force", "hand"),
            ("Dynamics", "tau_sat", "saturated"),
            ("youbot", "control_mode", "mode"),
            ("youbot", "jointstate", "joints"),
            ("youbot", "odometry", "base"),
        ] {
            self.step(&Step::Connect { from: member(from, port), to: member(PROBE, to), policy: Policy::Data }, second);
        }
        self.state(PROBE, Transition::Configure);
        self.state(PROBE, Transition::Start);
    }

    /// Takes the probe out again.
    pub fn unprobe(&mut self) {
        self.state(PROBE, Transition::Stop);
        self.state(PROBE, Transition::Cleanup);
        let probe = ComponentName::new(PROBE).unwrap();
        let ends: Vec<_> =
            self.system.snapshot().connections.keys().filter(|(_, to)| to.component == probe).copied().collect();
        for (from, to) in ends {
            self.step(&Step::Disconnect { from, to }, Duration::from_secs(1));
        }
        self.step(&Step::Destroy { component: probe }, Duration::from_secs(1));
    }

    /// What the probe has seen since it was read last.
    pub fn rows(&mut self) -> Vec<Row> {
        let name = ComponentName::new(PROBE).unwrap();
        if self.system.snapshot().components.get(&name).is_some_and(|c| c.state == RunState::Running) {
            assert!(matches!(self.call((PROBE, "read"), vec![]), Outcome::Done(_)));
        }
        ROWS.lock().unwrap().remove(&self.id).unwrap_or_default()
    }

    /// Up, with the probe in the loop: the drives take torques, nothing is coupled.
    pub fn up(name: &str) -> Self {
        let mut bench = Self::new(name);
        bench.all(&["create_core", "create_link", "create_monitors", "connect_all", "load_properties"]);
        bench.probe();
        bench.all(&["start_driver", "calibrate", "unfold", "start_control", "take_over"]);
        bench
    }

    /// Up and engaged: the hand has aligned the arms and lets go.
    pub fn engaged(name: &str) -> Self {
        Self::engages(Self::new(name))
    }

    /// The same with a thread for each activity, as where time is paced: what a thread asks for is its own activity's. The pace is
    /// one that nothing waits for.
    pub fn engaged_in_threads(name: &str) -> Self {
        Self::engages(Self::on(name, Clock::simulated_paced(1e9)))
    }

    fn engages(mut bench: Self) -> Self {
        bench.all(&["create_core", "create_link", "create_monitors", "connect_all", "load_properties"]);
        bench.set("Operator", "script", "free 0.5; align 4");
        bench.probe();
        bench.all(&["start_driver", "calibrate", "unfold", "start_control", "take_over", "five_DOF"]);
        bench.wait("e_qos_ok", 3.0);
        bench.wait("e_aligned", 6.0);
        bench.apply("enable_copying");
        bench
    }
}
