//! The library without the command line: configurations from a text, a platform of one's own, apply and undo from Rust.
//!
//! ```sh
//! cargo run --example embed
//! ```

use davit::platforms::{
    Catalogue, ComponentSnapshot, ComponentType, EventSink, Execution, ObserveError, Outcome, Platform, PropertyType,
    Simulated, SimulatedOptions, Tunable,
};
use davit::{
    Ask, Batch, Clock, ComponentName, ConfigId, Configurator, ConfiguratorSetup, DeploymentLimits, LoadOptions,
    Request, RequestId, Requester, Snapshot, Sources, Step, Time, Value, ValueType, load_configurations, render,
};
use std::collections::BTreeSet;
use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// A platform of one's own. This one says what it is asked to do and lets the simulated platform do it; one for a real
/// middleware would talk to it here, and answer *unknown* when it gets no answer before the deadline.
struct Talkative(Simulated);

impl Platform for Talkative {
    fn catalogue(&self) -> &Catalogue {
        self.0.catalogue()
    }

    fn execution(&self, step: &Step) -> Execution {
        self.0.execution(step)
    }

    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        let outcome = self.0.execute(step, deadline);
        println!("  {step}: {}", if matches!(outcome, Outcome::Done(_)) { "done" } else { "not done" });
        outcome
    }

    fn cancel(&self, step: &Step) {
        self.0.cancel(step);
    }

    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        self.0.observe(deadline)
    }

    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError> {
        self.0.observe_component(component, deadline)
    }

    fn subscribe(&self, sink: EventSink) {
        self.0.subscribe(sink);
    }

    fn quarantined(&self) -> Vec<ComponentName> {
        self.0.quarantined()
    }
}

/// A component type of one's own: here only its description, which is all that planning needs.
fn pump() -> ComponentType {
    let mut ty = ComponentType::new("Pump", "Moves water.");
    ty.actuator = true;
    let flow = PropertyType {
        default: Some(Value::Float(0.0)),
        min: Some(0.0),
        max: Some(10.0),
        unit: Some("l/s".into()),
        doc: "How much of it.".to_owned(),
        ..PropertyType::new(ValueType::Float, Tunable::Always)
    };
    ty.properties.insert("flow".parse().expect("a name"), flow);
    ty
}

const CONFIGURATIONS: &str = r#"
ConfiguratorConf {
  build = Configuration {
    create("Pump", "Pump"),
    post_conf_state = { "Pump:running" },
  },
  fast = Configuration { property_set("Pump.flow", 7.5) },
}
"#;

fn main() -> Result<(), Box<dyn Error>> {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let mut catalogue = Catalogue::new();
    catalogue.insert(pump());

    let texts = Sources::memory([("pump.lua", CONFIGURATIONS)]);
    let loaded = load_configurations(&texts, Path::new("pump.lua"), &LoadOptions::default());
    if !loaded.findings.is_empty() {
        eprint!("{}", render(&loaded.findings, &loaded.sources, false));
        return Err("the configurations are wrong".into());
    }

    let platform = Arc::new(Talkative(Simulated::new(catalogue.clone(), clock.clone(), SimulatedOptions::default())));
    let (answered, answers) = clock.channel(16);
    let configurator = Configurator::start(ConfiguratorSetup {
        operator: loaded.configurations.iter().map(|configuration| configuration.id).collect(),
        configurations: loaded.configurations,
        rest: Vec::new(),
        catalogue,
        activities: BTreeSet::new(),
        coordinators: BTreeSet::new(),
        subsystems: Vec::new(),
        platform,
        clock: clock.clone(),
        limits: DeploymentLimits::default(),
        workers: 2,
        answers: Arc::new(move |answer| {
            let _ = answered.try_send(answer);
        }),
        progress: None,
        conditions: None,
    });

    let apply = |name: &str| -> Result<Ask, Box<dyn Error>> { Ok(Ask::Apply(ConfigId::new(name)?)) };
    for (number, ask) in [apply("build")?, apply("fast")?, Ask::Undo, Ask::Undo].into_iter().enumerate() {
        println!("{ask}");
        let id = RequestId(number as u64);
        configurator.submit(Batch::one(Request::new(id, ask, Requester::Operator)))?;
        let answer = answers.recv_deadline(clock.now() + Duration::from_secs(5))?;
        println!("  = {}", answer.event());
    }

    let view = configurator.view(true, clock.now() + Duration::from_secs(1)).ok_or("the configurator has ended")?;
    assert!(view.system.as_ref().is_some_and(|system| system.is_empty()), "two undos: nothing is left");
    configurator.stop(clock.now() + Duration::from_secs(1));
    clock.shutdown();
    Ok(())
}
