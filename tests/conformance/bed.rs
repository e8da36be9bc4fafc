//! What a platform brings to be tested, and short words for the tests.

use davit::model::*;
use davit::platform::{Cause, Outcome, Platform, PlatformEvent};
use davit::time::{Clock, Receiver, Time};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What a component of the test type `Misbehaving` does in one of its hooks, or in its operation `work`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(dead_code)]
pub enum Trouble {
    /// The hook or operation answers an error.
    Fail,
    /// The hook panics.
    Panic,
    /// The hook never returns, or so long after it was called.
    Hang(Option<Duration>),
    /// The operation takes [`WORK`]; given up meanwhile it comes to rest within [`REST`].
    Long,
    /// The operation takes [`WORK`], and takes no notice of being given up.
    Deaf,
}

/// How long the operation `work` of a `Misbehaving` in trouble takes.
pub const WORK: Duration = Duration::from_secs(10);

/// How long a component takes at most to come to rest.
pub const REST: Duration = Duration::from_millis(50);

/// Lets the component of that name raise that event.
pub type Raise = Box<dyn Fn(&str, &str)>;

/// A platform under test.
pub struct Made {
    pub platform: Arc<dyn Platform>,
    pub clock: Clock,
    /// Lets the component of that name raise that event.
    pub raise: Raise,
    /// Whatever must live as long.
    #[allow(dead_code)]
    pub keep: Vec<Box<dyn std::any::Any>>,
}

/// How a platform is made for a test.
pub trait Bed {
    /// A platform with nothing on it, on a simulated clock that the calling thread has entered, with the test types;
    /// in every component of type `Misbehaving`, the given hooks (`configure`, `start`, `stop`, `cleanup`), or its making
    /// and its end (`create`, `destroy`: they only hang), or its operation `work` (`Fail`, `Long`, `Deaf`), are in trouble.
    /// Its operation `brake` needs nothing of its activity.
    fn make(&self, trouble: &[(&'static str, Trouble)]) -> Made;
}

fn port(direction: Direction, ty: &str, unit: Option<&str>, buffered: bool) -> PortType {
    PortType {
        direction,
        ty: ty.parse().unwrap(),
        unit: unit.map(Into::into),
        buffered,
        required: false,
        doc: String::new(),
        origin: Origin::NONE,
    }
}

fn property(ty: &str, default: Option<Value>, limits: Option<(f64, f64)>, tunable: Tunable) -> PropertyType {
    PropertyType {
        ty: ty.parse().unwrap(),
        default,
        min: limits.map(|l| l.0),
        max: limits.map(|l| l.1),
        tunable,
        unit: None,
        doc: String::new(),
        origin: Origin::NONE,
    }
}

fn operation(args: &[&str], returns: Option<&str>) -> OperationType {
    OperationType {
        args: args.iter().map(|t| t.parse().unwrap()).collect(),
        returns: returns.map(|t| t.parse().unwrap()),
        ..OperationType::new(Effect::None)
    }
}

/// The test types. `Plant` has a member of every kind; `Misbehaving` is as plain as can be.
pub fn types() -> Vec<ComponentType> {
    let mut plant = ComponentType::new("Plant", "Has a member of every kind.");
    let (i, o) = (Direction::In, Direction::Out);
    for (name, ty) in [
        ("u", port(i, "float", Some("N"), false)),
        ("u_plain", port(i, "float", None, false)),
        ("u_m", port(i, "float", Some("m"), false)),
        ("v", port(i, "float[3]", None, false)),
        ("n", port(i, "int", None, false)),
        ("q", port(i, "float", Some("N"), true)),
        ("heard", port(i, "event", None, false)),
        ("y", port(o, "float", Some("N"), false)),
        ("y2", port(o, "float", Some("N"), false)),
        ("w", port(o, "float[3]", None, false)),
        ("said", port(o, "event", None, false)),
    ] {
        plant.ports.insert(ident(name), ty);
    }
    for (name, ty) in [
        ("gain", property("float", Some(Value::Float(1.0)), Some((0.0, 10.0)), Tunable::Always)),
        ("gains", property("float[3]", Some(Value::floats(&[1.0; 3])), Some((0.0, 10.0)), Tunable::Always)),
        ("mode", property("int", None, None, Tunable::Stopped)),
        ("device", property("string", Some(Value::str("none")), None, Tunable::Unconfigured)),
        ("pose", property("{x: float, y: float}", Some(pose(0.0, 0.0)), Some((-1.0, 1.0)), Tunable::Always)),
    ] {
        plant.properties.insert(ident(name), ty);
    }
    plant.operations.insert(ident("nothing"), operation(&[], None));
    plant.operations.insert(ident("scale"), operation(&["float", "int"], Some("float")));
    let mut misbehaving = ComponentType::new("Misbehaving", "Does in its hooks what the test asks for.");
    for name in ["work", "brake", "nothing"] {
        misbehaving.operations.insert(ident(name), operation(&[], None));
    }
    misbehaving.operations.insert(ident("echo"), operation(&["int"], None));
    vec![plant, misbehaving]
}

pub fn pose(x: f64, y: f64) -> Value {
    Value::Record(vec![(ident("x"), Value::Float(x)), (ident("y"), Value::Float(y))])
}

pub fn ident(text: &str) -> Ident {
    Ident::new(text).unwrap()
}

pub fn name(text: &str) -> ComponentName {
    ComponentName::new(text).unwrap()
}

pub fn member(text: &str) -> MemberRef {
    MemberRef::new(text).unwrap()
}

/// The values of a `Plant`, in the order of its type: device, gain, gains, mode, pose.
pub fn plant_values() -> Vec<Value> {
    vec![Value::str("none"), Value::Float(1.0), Value::floats(&[1.0; 3]), Value::Int(0), pose(0.0, 0.0)]
}

pub fn create(component: &str) -> Step {
    Step::Create {
        component: name(component),
        ty: TypeName::new("Plant").unwrap(),
        activity: None,
        properties: plant_values(),
    }
}

pub fn create_misbehaving(component: &str) -> Step {
    Step::Create {
        component: name(component),
        ty: TypeName::new("Misbehaving").unwrap(),
        activity: None,
        properties: Vec::new(),
    }
}

pub fn state(component: &str, transition: Transition) -> Step {
    Step::State { component: name(component), transition }
}

pub fn destroy(component: &str) -> Step {
    Step::Destroy { component: name(component) }
}

pub fn connect(from: &str, to: &str, policy: Policy) -> Step {
    Step::Connect { from: member(from), to: member(to), policy }
}

pub fn disconnect(from: &str, to: &str) -> Step {
    Step::Disconnect { from: member(from), to: member(to) }
}

pub fn set(property: &str, value: impl Into<Value>) -> Step {
    Step::PropertySet { property: member(property), value: value.into() }
}

pub fn write(port: &str, value: Option<Value>) -> Step {
    Step::PortWrite { port: member(port), value }
}

pub fn call(operation: &str, args: Vec<Value>) -> Step {
    Step::Operation(Call { operation: member(operation), args })
}

/// How long a step of a test may take.
pub const LIMIT: Duration = Duration::from_secs(1);

impl Made {
    pub fn deadline(&self) -> Time {
        self.clock.now() + LIMIT
    }

    pub fn run(&self, step: &Step) -> Outcome {
        self.platform.execute(step, self.deadline())
    }

    /// The step happens.
    #[track_caller]
    pub fn does(&self, step: Step) -> Option<Value> {
        match self.run(&step) {
            Outcome::Done(value) => value,
            other => panic!("`{step}` should happen: {other:?}"),
        }
    }

    #[track_caller]
    pub fn all(&self, steps: impl IntoIterator<Item = Step>) {
        for step in steps {
            self.does(step);
        }
    }

    /// The step is refused, and nothing changes.
    #[track_caller]
    pub fn refuses(&self, step: Step) {
        let before = self.see();
        match self.run(&step) {
            Outcome::NotDone(Cause::Refused(why)) => assert!(!why.is_empty()),
            other => panic!("`{step}` should be refused: {other:?}"),
        }
        assert_eq!(self.see(), before, "`{step}` was refused and changed something");
    }

    #[track_caller]
    pub fn see(&self) -> Snapshot {
        self.platform.observe(self.deadline()).expect("an observation")
    }

    #[track_caller]
    pub fn state_of(&self, component: &str) -> Option<RunState> {
        self.see().components.get(&name(component)).map(|c| c.state)
    }

    /// From now on events are collected.
    pub fn listen(&self) -> Arc<Mutex<Vec<PlatformEvent>>> {
        let heard = Arc::new(Mutex::new(Vec::new()));
        let sink = heard.clone();
        self.platform.subscribe(Arc::new(move |event| sink.lock().unwrap().push(event)));
        heard
    }

    /// Has another thread carry the step out within `limit` from now on; what it answers, and when.
    pub fn begin(&self, step: &Step, limit: Duration) -> Receiver<(Outcome, Time)> {
        let (answer, answered) = self.clock.channel(1);
        let (platform, clock, step) = (self.platform.clone(), self.clock.clone(), step.clone());
        let deadline = self.clock.now() + limit;
        self.clock.spawn("another", move || {
            let outcome = platform.execute(&step, deadline);
            let _ = answer.try_send((outcome, clock.now()));
        });
        answered
    }

    /// Lets so much time pass.
    pub fn wait(&self, time: Duration) {
        self.clock.sleep_until(self.clock.now() + time);
    }
}

pub fn written(pairs: &[(&str, Value)]) -> BTreeMap<MemberRef, Value> {
    pairs.iter().map(|(port, value)| (member(port), value.clone())).collect()
}
