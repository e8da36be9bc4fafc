//! What `check` says of a configuration by itself and what the planner says of it are one: both look at the same
//! preconditions. What is refused by types alone is refused in every system that the deployment's configurations can make;
//! and what the planner finds wrong by types alone is found beforehand, where each name has one type.

use crate::generate::{self, ConfigGene, TypeGene, context, read};
use crate::settings;
use davit::check;
use davit::lang::{self, LoadOptions, Sources};
use davit::model::codes::*;
use davit::model::*;
use davit::plan::plan;
use davit::system::{System, step};
use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// What follows from types alone. (A default twice and a demanded `faulted` are found by the readers: no model holds them.)
const OF_TYPES: [Code; 16] = [
    UNKNOWN_TYPE,
    UNKNOWN_ACTIVITY,
    UNKNOWN_PORT,
    UNKNOWN_PROPERTY,
    UNKNOWN_OPERATION,
    NOT_AN_OUT_PORT,
    NOT_AN_IN_PORT,
    PORT_TYPES,
    PORT_UNITS,
    PORT_UNLIKE,
    NEEDS_BUFFER,
    BUFFER_SIZE,
    BAD_VALUE,
    MISSING_PROPERTY,
    PORT_NOT_WRITABLE,
    BAD_ARGUMENTS,
];

/// A deployment with nothing in it.
fn empty() -> Deployment {
    static EMPTY: OnceLock<Deployment> = OnceLock::new();
    let load = || {
        let text = "davit: 1\nname: laws\nplatform: simulated\nlibraries: [standard]\nactivities:\n  fast: { period_ms: 1.0 }\n  slow: { period_ms: 9.0 }\n\
                    configurations: [c.lua]\ncoordinator: k.lua\n\
                    deploy: { event: e_start, up: idle, within_s: 1 }\nshutdown: { event: e_stop, down: idle, within_s: 1 }\n";
        let files = [
            ("d.yaml", text),
            ("c.lua", "ConfiguratorConf { a = Configuration {} }"),
            ("k.lua", "return state { idle = state {}, trans { src = 'initial', tgt = 'idle' } }"),
        ];
        let loaded = lang::load_from(&Sources::memory(files), Path::new("d.yaml"), &LoadOptions::default());
        loaded.deployment.unwrap_or_else(|| panic!("{:?}", loaded.findings))
    };
    EMPTY.get_or_init(load).clone()
}

/// A deployment of generated configurations, of which some have mistakes in them, and systems that they make.
struct World {
    catalogue: Arc<Catalogue>,
    deployment: Deployment,
    systems: Vec<System>,
}

/// One mistake, by chance, in one of the changes.
fn mistake(conf: &mut Configuration, [at, what, more]: [u8; 3]) {
    let n = conf.changes.len().max(1);
    let Some(change) = conf.changes.get_mut(at as usize % n) else { return };
    let member = |m: MemberRef| {
        let names = ["p0", "p1", "p2", "k0", "k1", "o0", "zz"];
        m.component.member(generate::ident(names[more as usize % names.len()]))
    };
    let value =
        [Value::Bool(true), Value::Int(1), Value::Float(f64::NAN), Value::str("x"), Value::floats(&[1.0, 9e9, 1.0])];
    let value = value[more as usize % 5].clone();
    match (&mut change.kind, what % 3) {
        (ChangeKind::Connect { from, to, .. }, 0) => std::mem::swap(from, to),
        (ChangeKind::Connect { from, .. }, 1) => *from = member(*from),
        (ChangeKind::Connect { to, policy, .. }, _) => match more % 4 {
            0 | 1 => *policy = Policy::Data,
            2 => *to = member(*to),
            _ => *policy = Policy::Buffer(0),
        },
        (ChangeKind::Disconnect { from, .. }, _) => *from = member(*from),
        (ChangeKind::PropertySet { property: m, .. } | ChangeKind::PortWrite { port: m, .. }, 0) => *m = member(*m),
        (ChangeKind::PropertySet { value: v, .. } | ChangeKind::PortWrite { value: v, .. }, _) => *v = value,
        (ChangeKind::OperationCall { call, .. }, 0) => call.operation = member(call.operation),
        (ChangeKind::OperationCall { call, .. }, 1) => call.args.push(value),
        (ChangeKind::OperationCall { call, .. }, _) => call.args = vec![value],
        (ChangeKind::Create { properties, .. }, 0) => _ = properties.insert(generate::ident("zz"), value),
        (ChangeKind::Create { properties, .. }, 1) => properties.values_mut().for_each(|v| *v = value.clone()),
        (ChangeKind::Create { activity, ty, .. }, _) => match more % 3 {
            0 => *activity = Some(generate::ident("fats")),
            1 => *ty = TypeName::new("T.four").unwrap(),
            _ => *ty = TypeName::new("T.five").unwrap(),
        },
        (ChangeKind::Replace { map, .. }, 0) => _ = map.insert(generate::ident("p0"), generate::ident("p1")),
        (ChangeKind::Replace { map, .. }, 1) => _ = map.insert(generate::ident("zz"), generate::ident("p1")),
        (ChangeKind::Replace { properties, .. }, _) => _ = properties.insert(generate::ident("zz"), value),
        (ChangeKind::Destroy { component }, _) => {
            *component = member(component.member(generate::ident("zz"))).component
        }
    }
}

/// `single`: each name is created as one type only.
fn world(types: &[TypeGene], genes: &[(ConfigGene, [u8; 3])], single: bool) -> World {
    let catalogue = generate::catalogue(types, true);
    let mut system = System::new(catalogue.clone());
    let (mut deployment, mut systems) = (empty(), vec![system.clone()]);
    let mut first: BTreeMap<ComponentName, TypeName> = BTreeMap::new();
    for (i, (gene, slip)) in genes.iter().enumerate() {
        let mut conf = read(gene, &system);
        // An identifier is used once.
        conf.id = ConfigId::new(&format!("{}_{i}", conf.id)).unwrap();
        for change in &mut conf.changes {
            if let ChangeKind::Create { component, ty, .. } | ChangeKind::Replace { component, ty, .. } =
                &mut change.kind
                && single
            {
                *ty = *first.entry(*component).or_insert(*ty);
            }
        }
        if slip[0] % 2 == 1 {
            mistake(&mut conf, *slip);
        }
        if let Ok(plan) = plan(&system, &conf, &context()) {
            generate::run(&mut system, &plan);
            systems.push(system.clone());
        }
        deployment.configurations.push(conf);
    }
    World { catalogue, deployment, systems }
}

/// The world as other configurations may have left it: of each name any type that one of them creates, or nothing.
fn stranger(world: &World, without: ConfigId, seed: &[u8]) -> System {
    let mut types: BTreeMap<ComponentName, Vec<TypeName>> = BTreeMap::new();
    for conf in world.deployment.configurations.iter().filter(|conf| conf.id != without) {
        for change in &conf.changes {
            if let ChangeKind::Create { component, ty, .. } = &change.kind
                && world.catalogue.get(*ty).is_some()
            {
                types.entry(*component).or_default().push(*ty);
            }
        }
    }
    let mut system = System::new(world.catalogue.clone());
    for ((component, types), n) in types.into_iter().zip(seed.iter().cycle()) {
        if n % 5 == 4 {
            continue;
        }
        let ty = types[*n as usize % types.len()];
        let declared = world.catalogue.get(ty).unwrap();
        let properties =
            declared.properties.values().map(|p| p.default.clone().unwrap_or(Value::Bool(false))).collect();
        step::effect(&Step::Create { component, ty, activity: None, properties }, &mut system);
        for transition in [Transition::Configure, Transition::Start].iter().take(*n as usize / 7 % 3) {
            step::effect(&Step::State { component, transition: *transition }, &mut system);
        }
    }
    system
}

fn is_single(deployment: &Deployment) -> bool {
    let mut first: BTreeMap<ComponentName, TypeName> = BTreeMap::new();
    deployment.configurations.iter().flat_map(|conf| &conf.changes).all(|change| match &change.kind {
        ChangeKind::Create { component, ty, .. } | ChangeKind::Replace { component, ty, .. } => {
            first.entry(*component).or_insert(*ty) == ty
        }
        _ => true,
    })
}

/// Whether a configuration replaces a component by one whose ports have other names.
fn renames(conf: &Configuration) -> bool {
    conf.changes.iter().any(|change| matches!(&change.kind, ChangeKind::Replace { map, .. } if !map.is_empty()))
}

/// Compares the two for every configuration; counts what `check` refused, by code.
fn compare(world: &World, seed: &[u8], counts: &mut BTreeMap<Code, usize>) -> Result<(), TestCaseError> {
    let single = is_single(&world.deployment);
    for conf in &world.deployment.configurations {
        let told = check::configurations(&world.deployment, &world.catalogue, &[conf.id]);
        for finding in &told {
            *counts.entry(finding.code).or_default() += 1;
            prop_assert!(finding.path.starts_with(&format!("configurations.{}.", conf.id)), "{:?}", finding);
        }
        let stranger = stranger(world, conf.id, seed);
        for system in world.systems.iter().chain([&stranger]) {
            let planned = plan(system, conf, &context());
            prop_assert!(told.is_empty() || planned.is_err(), "planned all the same: {:?}\n{:?}", told, conf);
            if let (true, Err(refusal)) = (single, planned) {
                let said: BTreeSet<(Code, &str)> = told.iter().map(|f| (f.code, f.message.as_str())).collect();
                // What a renamed port is connected with is known in a system only: one without a unit takes any.
                let met = |f: &Finding| f.code == PORT_UNITS && renames(conf);
                for finding in refusal.findings.iter().filter(|f| OF_TYPES.contains(&f.code) && !met(f)) {
                    let key = (finding.code, finding.message.as_str());
                    prop_assert!(said.contains(&key), "only the planner says {:?}: {:?}\n{:?}", finding, told, conf);
                }
            }
        }
    }
    Ok(())
}

fn genes() -> impl Strategy<Value = (Vec<TypeGene>, Vec<(ConfigGene, [u8; 3])>, bool, [u8; 8])> {
    let configs = proptest::collection::vec((generate::config(), any::<[u8; 3]>()), 2..8);
    (generate::types(), configs, any::<bool>(), any::<[u8; 8]>())
}

proptest! {
    #![proptest_config(settings())]

    #[test]
    fn check_and_planner_agree((types, configs, single, seed) in genes()) {
        compare(&world(&types, &configs, single), &seed, &mut BTreeMap::new())?;
    }
}

proptest! {
    #![proptest_config(generate::counted())]

    /// Every kind of refusal is among what is compared.
    #[test]
    fn enough_is_refused(worlds in proptest::collection::vec(genes(), 6000)) {
        let (mut counts, mut several) = (BTreeMap::new(), 0);
        for (types, configs, single, seed) in &worlds {
            let world = world(types, configs, *single);
            several += usize::from(!is_single(&world.deployment));
            compare(&world, seed, &mut counts)?;
        }
        println!("{several} of {} with several types of one name, {counts:?}", worlds.len());
        prop_assert!(several > 300);
        for code in OF_TYPES {
            prop_assert!(counts.get(&code).copied().unwrap_or(0) >= 10, "{code}: {counts:?}");
        }
    }
}
