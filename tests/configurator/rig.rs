//! A configurator on a simulated platform, with plain types and short words for configurations.

pub use crate::names::{event, id, ident, member, name};
use davit::configurator::*;
use davit::model::*;
use davit::platform::Platform;
use davit::platform::simulated::{Fault, FaultRule, Faults, Simulated, SimulatedOptions};
use davit::stack::Why;
use davit::time::{Clock, Guard};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// `Node`: a float in and out, an always tunable gain, one that needs `stopped`, operations of every effect.
pub fn catalogue() -> Catalogue {
    let port = |direction, ty: &str| PortType {
        direction,
        ty: ty.parse().unwrap(),
        unit: None,
        buffered: false,
        required: false,
        doc: String::new(),
        origin: Origin::NONE,
    };
    let property = |tunable| PropertyType {
        ty: ValueType::Float,
        default: Some(Value::Float(0.0)),
        min: Some(-100.0),
        max: Some(100.0),
        tunable,
        raises: false,
        unit: None,
        doc: String::new(),
        origin: Origin::NONE,
    };
    let operation = OperationType::new;
    let mut node = ComponentType::new("Node", "A component with a bit of everything.");
    node.ports.insert(ident("u"), port(Direction::In, "float"));
    node.ports.insert(ident("w"), port(Direction::In, "float"));
    node.ports.insert(ident("y"), port(Direction::Out, "float"));
    node.properties.insert(ident("k"), property(Tunable::Always));
    node.properties.insert(ident("s"), property(Tunable::Stopped));
    node.operations.insert(ident("look"), operation(Effect::None));
    node.operations.insert(ident("open"), operation(Effect::Undo(ident("close"))));
    node.operations.insert(ident("close"), operation(Effect::Undo(ident("open"))));
    node.operations.insert(ident("burn"), operation(Effect::Irreversible));
    let mut catalogue = Catalogue::new();
    catalogue.insert(node);
    catalogue
}

/// One change in words: `create A`, `destroy A`, `swap A` (by another one), `connect A.y B.u`, `disconnect A.y B.u`, `set A.k 2`, `write A.u 3`,
/// `call A.open`.
fn change(text: &str) -> Change {
    let words: Vec<&str> = text.split_whitespace().collect();
    let number = |at: usize| Value::Float(words[at].parse().unwrap());
    let kind = match words[0] {
        "create" => ChangeKind::Create {
            component: name(words[1]),
            ty: TypeName::new("Node").unwrap(),
            activity: None,
            properties: BTreeMap::new(),
        },
        "swap" => ChangeKind::Replace {
            component: name(words[1]),
            ty: TypeName::new("Node").unwrap(),
            activity: None,
            properties: BTreeMap::new(),
            map: BTreeMap::new(),
        },
        "destroy" => ChangeKind::Destroy { component: name(words[1]) },
        "connect" => ChangeKind::Connect { from: member(words[1]), to: member(words[2]), policy: Policy::Data },
        "disconnect" => ChangeKind::Disconnect { from: member(words[1]), to: member(words[2]) },
        "set" => ChangeKind::PropertySet { property: member(words[1]), value: number(2) },
        "write" => ChangeKind::PortWrite { port: member(words[1]), value: number(2) },
        "call" => ChangeKind::OperationCall { call: Call { operation: member(words[1]), args: vec![] }, undo: None },
        other => panic!("no change {other}"),
    };
    Change { kind, origin: Origin::NONE }
}

fn entry(text: &str) -> StateEntry {
    let (target, state) = text.split_once(':').unwrap();
    let target = if target == "_default" { Target::Default } else { Target::Component(name(target)) };
    StateEntry { target, state: RunState::from_name(state).and_then(RunState::wanted).unwrap(), origin: Origin::NONE }
}

/// A configuration: pre-states, changes, post-states, each in words separated by `;` or blanks.
pub fn configuration(name: &str, pre: &str, changes: &str, post: &str) -> Configuration {
    Configuration {
        pre: StateList::of(pre.split_whitespace().map(entry)).unwrap(),
        changes: changes.split(';').map(str::trim).filter(|t| !t.is_empty()).map(change).collect(),
        post: StateList::of(post.split_whitespace().map(entry)).unwrap(),
        ..Configuration::new(id(name))
    }
}

/// What a platform around a simulated one leaves to that: everything but how steps are carried out.
macro_rules! leaves_to_inner {
    () => {
        leaves_to_inner!(all but cancel);

        fn cancel(&self, step: &davit::model::Step) {
            self.inner.cancel(step);
        }
    };
    (all but cancel) => {
        fn catalogue(&self) -> &davit::model::Catalogue {
            self.inner.catalogue()
        }
        fn observe(&self, deadline: Time) -> Result<davit::model::Snapshot, davit::platform::ObserveError> {
            self.inner.observe(deadline)
        }
        fn observe_some(
            &self,
            components: &[davit::model::ComponentName],
            deadline: Time,
        ) -> Result<davit::model::Snapshot, davit::platform::ObserveError> {
            self.inner.observe_some(components, deadline)
        }
        fn observe_component(
            &self,
            component: davit::model::ComponentName,
            deadline: Time,
        ) -> Result<Option<davit::model::ComponentSnapshot>, davit::platform::ObserveError> {
            self.inner.observe_component(component, deadline)
        }
        fn subscribe(&self, sink: davit::platform::EventSink) {
            self.inner.subscribe(sink);
        }
        fn quarantined(&self) -> Vec<davit::model::ComponentName> {
            self.inner.quarantined()
        }
    };
}
pub(crate) use leaves_to_inner;

pub struct Rig {
    pub handle: ConfiguratorHandle,
    pub platform: Simulated,
    pub answers: Arc<Mutex<Vec<Answer>>>,
    pub progress: Arc<Mutex<Vec<Progress>>>,
    pub submitted: Mutex<Vec<Request>>,
    pub clock: Clock,
    /// After so many tellings whoever listens to the progress panics, once; 0: never.
    pub trap: Arc<AtomicUsize>,
    next: Mutex<u64>,
    _guard: Guard,
}

pub const COORDINATOR: &str = "c1";

pub fn coordinator(name_: &str) -> Requester {
    Requester::Coordinator(name(name_))
}

impl Rig {
    pub fn new(configurations: Vec<Configuration>) -> Self {
        Self::with(configurations, SimulatedOptions::default(), |platform| Arc::new(platform))
    }

    pub fn with(
        configurations: Vec<Configuration>,
        options: SimulatedOptions,
        wrap: impl FnOnce(Simulated) -> Arc<dyn Platform>,
    ) -> Self {
        Self::full(configurations, options, wrap, DeploymentLimits::default())
    }

    pub fn full(
        configurations: Vec<Configuration>,
        options: SimulatedOptions,
        wrap: impl FnOnce(Simulated) -> Arc<dyn Platform>,
        limits: DeploymentLimits,
    ) -> Self {
        Self::of(catalogue(), BTreeSet::new(), configurations, options, wrap, limits)
    }

    pub fn of(
        catalogue: Catalogue,
        activities: BTreeSet<Ident>,
        configurations: Vec<Configuration>,
        options: SimulatedOptions,
        wrap: impl FnOnce(Simulated) -> Arc<dyn Platform>,
        limits: DeploymentLimits,
    ) -> Self {
        let clock = Clock::simulated();
        let guard = clock.enter();
        let platform = Simulated::new(catalogue.clone(), clock.clone(), options);
        let answers: Arc<Mutex<Vec<Answer>>> = Arc::default();
        let sink = answers.clone();
        let progress: Arc<Mutex<Vec<Progress>>> = Arc::default();
        let told = progress.clone();
        let trap: Arc<AtomicUsize> = Arc::default();
        let trapped = trap.clone();
        let handle = Configurator::start(ConfiguratorSetup {
            operator: configurations.iter().map(|c| c.id).collect(),
            configurations,
            rest: Vec::new(),
            catalogue,
            activities,
            coordinators: BTreeSet::new(),
            subsystems: Vec::new(),
            platform: wrap(platform.clone()),
            clock: clock.clone(),
            limits,
            workers: 4,
            answers: Arc::new(move |answer| sink.lock().unwrap().push(answer)),
            progress: Some(Arc::new(move |progress| {
                told.lock().unwrap().push(progress.clone());
                let left = trapped.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |left| left.checked_sub(1));
                assert!(left != Ok(1), "a listener fails");
            })),
            conditions: None,
        });
        let told = handle.clone();
        platform.subscribe(Arc::new(move |event| told.platform_event(&event)));
        Self {
            handle,
            platform,
            answers,
            progress,
            submitted: Mutex::new(Vec::new()),
            clock,
            trap,
            next: Mutex::new(1),
            _guard: guard,
        }
    }

    /// Nobody hears what the platform reports meanwhile.
    pub fn platform_deaf(&self, what: impl FnOnce(&Simulated)) {
        use davit::platform::Platform as _;
        self.platform.subscribe(Arc::new(|_| {}));
        what(&self.platform);
        let told = self.handle.clone();
        self.platform.subscribe(Arc::new(move |event| told.platform_event(&event)));
    }

    fn request(&self, word: &str, requester: Requester) -> Request {
        let ask = match word {
            "undo" => Ask::Undo,
            "commit" => Ask::Commit { force: false },
            "commit!" => Ask::Commit { force: true },
            _ => match word.strip_suffix(".undo") {
                Some(name) => Ask::UndoOf(id(name)),
                None => match word.strip_prefix("to=") {
                    Some(n) => Ask::UndoTo(n.parse().unwrap()),
                    None => Ask::Apply(id(word)),
                },
            },
        };
        let mut next = self.next.lock().unwrap();
        *next += 1;
        // The scenario's operator means it.
        let force = requester == Requester::Operator;
        let request = Request { force, tag: (*next, 7), ..Request::new(RequestId(*next), ask, requester) };
        self.submitted.lock().unwrap().push(request);
        request
    }

    /// Submits one batch of requests, in words: `on`, `on.undo`, `undo`, `to=2`, `commit`, `commit!` (by force).
    pub fn submit_as(&self, words: &str, requester: Requester) -> Result<(), QueueFull> {
        self.handle.submit(words.split_whitespace().map(|word| self.request(word, requester)).collect())
    }

    pub fn submit(&self, words: &str) {
        self.submit_as(words, coordinator(COORDINATOR)).unwrap();
    }

    /// Lets so many seconds pass.
    pub fn wait(&self, seconds: f64) {
        self.clock.sleep(Duration::from_secs_f64(seconds));
    }

    /// Submits a batch, waits until it must be over, and answers the status events since.
    pub fn ask(&self, words: &str) -> Vec<String> {
        self.ask_as(words, coordinator(COORDINATOR))
    }

    pub fn ask_as(&self, words: &str, requester: Requester) -> Vec<String> {
        let before = self.answers.lock().unwrap().len();
        self.submit_as(words, requester).unwrap();
        self.wait(100.0);
        self.events()[before..].to_vec()
    }

    /// Every status event so far.
    pub fn events(&self) -> Vec<String> {
        self.answers.lock().unwrap().iter().map(|answer| answer.event().to_string()).collect()
    }

    pub fn last(&self) -> Answer {
        self.answers.lock().unwrap().last().expect("an answer").clone()
    }

    pub fn see(&self) -> Snapshot {
        self.platform.set_faults(Faults::default());
        self.platform.observe(self.clock.now() + Duration::from_secs(1)).unwrap()
    }

    pub fn platform_quarantined(&self) -> Vec<ComponentName> {
        self.platform.quarantined()
    }

    pub fn view(&self) -> Arc<ConfiguratorView> {
        self.handle.view(true, self.clock.now() + Duration::from_secs(10)).expect("a view")
    }

    /// The configurations of the frames in force, oldest first.
    pub fn frames(&self) -> Vec<String> {
        self.view().stack.iter().map(|frame| frame.configuration.to_string()).collect()
    }

    pub fn inject(&self, pattern: &str, fault: Fault) {
        self.platform.set_faults(Faults::new([FaultRule::on(pattern, fault).times(1)]));
    }

    /// Every request got exactly one answer.
    #[track_caller]
    pub fn each_answered_once(&self) {
        let mut open: BTreeMap<u64, i32> = self.submitted.lock().unwrap().iter().map(|r| (r.id.0, 1)).collect();
        for answer in self.answers.lock().unwrap().iter().filter(|a| a.request.why == Why::Asked) {
            *open.get_mut(&answer.request.id.0).expect("an answer to a request") -= 1;
            assert_eq!(answer.request.tag, (answer.request.id.0, 7), "the tag comes back");
        }
        assert!(open.values().all(|n| *n == 0), "open or twice: {open:?}");
    }

    /// The picture is the platform, and the difference says so.
    #[track_caller]
    pub fn in_step(&self) {
        assert_eq!(*self.view().system.as_ref().unwrap().as_ref(), self.see());
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        let deadline = self.clock.now() + Duration::from_secs(60);
        let stopped = self.handle.stop(deadline);
        if !std::thread::panicking() {
            assert!(stopped, "the configurator ends when it is told to");
        }
        self.clock.shutdown();
    }
}

/// Three nodes in a chain, running; and switches on them.
pub fn scenario() -> Vec<Configuration> {
    let mut all = vec![
        configuration("make", "", "create A; create B; create C", "_default:stopped"),
        configuration("wire", "", "connect A.y B.u; connect B.y C.u; write A.u 1; set A.k 1", ""),
        configuration("run", "", "", "_default:running"),
        configuration("switch", "B:stopped", "set B.s 2; set B.k 3; write C.w 4; call C.open", "B:running"),
        configuration("rewire", "C:stopped", "disconnect B.y C.u; connect A.y C.u; write B.w 5", "C:running"),
        configuration("replace", "", "disconnect A.y B.u; disconnect B.y C.u; destroy B; create B", "B:running"),
        configuration("eight", "", "set A.k 8; set B.k 8", ""),
        configuration("five", "", "set A.k 5; set B.k 5", ""),
        configuration("drop", "", "disconnect A.y B.u; disconnect B.y C.u; destroy A; destroy B; destroy C", ""),
        configuration("quiet", "", "", "_default:stopped"),
        configuration("quick", "B:stopped", "set B.s 2; set B.k 3; write C.w 4", "B:running"),
        configuration("bad", "", "set Z.k 1", ""),
        configuration("hot", "", "swap B", ""),
    ];
    for configuration in &mut all {
        configuration.safe = configuration.id == id("quiet");
        if ["eight", "five"].contains(&configuration.id.as_str()) {
            configuration.group = Some(ident("dof"));
        }
    }
    all
}
