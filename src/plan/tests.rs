//! One clean example, then one deliberate breakage after the other, each with its exact finding.

use super::{Plan, PlanContext, PlanStage, PlannedStep, Refusal, irreversible, plan};
use crate::model::*;
use crate::system::{Reversibility, System, Undo, step};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

fn port(direction: Direction, ty: &str, unit: Option<&str>, buffered: bool) -> PortType {
    let port = PortType::new(direction, ty.parse().unwrap());
    PortType { unit: unit.map(Arc::from), buffered, origin: Origin(90), ..port }
}

fn property(ty: &str, default: Option<Value>, tunable: Tunable) -> PropertyType {
    let property = PropertyType::new(ty.parse().unwrap(), tunable);
    PropertyType { default, min: Some(0.0), max: Some(10.0), origin: Origin(91), ..property }
}

fn operation(effect: Effect) -> OperationType {
    OperationType { args: vec![ValueType::Float], origin: Origin(92), ..OperationType::new(effect) }
}

fn ident(name: &str) -> Ident {
    Ident::new(name).unwrap()
}

fn types() -> Arc<Catalogue> {
    let mut gain = ComponentType::new("t.Gain", "a gain");
    gain.ports = BTreeMap::from([
        (ident("u"), port(Direction::In, "float", Some("N"), false)),
        (ident("y"), port(Direction::Out, "float", Some("N"), false)),
        (ident("m"), port(Direction::Out, "float", Some("m"), false)),
        (ident("n"), port(Direction::Out, "int", None, false)),
        (ident("q"), port(Direction::In, "float", None, true)),
        (ident("e"), port(Direction::In, "event", None, false)),
    ]);
    gain.properties = BTreeMap::from([
        (ident("k"), property("float", Some(Value::Float(1.0)), Tunable::Stopped)),
        (ident("v"), property("float[3]", Some(Value::floats(&[0.0; 3])), Tunable::Always)),
    ]);
    gain.operations = BTreeMap::from([
        (ident("open"), operation(Effect::Undo(ident("close")))),
        (ident("close"), operation(Effect::None)),
        (ident("weld"), operation(Effect::Irreversible)),
        (ident("swing"), OperationType { moves: true, ..operation(Effect::Undo(ident("swing"))) }),
    ]);
    gain.start_after = vec![TypeName::new("t.Motor").unwrap()];
    let mut motor = ComponentType::new("t.Motor", "moves");
    motor.actuator = true;
    motor.ports = gain.ports.clone();
    motor.properties.insert(ident("id"), property("int", None, Tunable::Unconfigured));
    motor.irreversible.destroy = true;
    motor.moves.start = true;
    let mut catalogue = Catalogue::new();
    catalogue.insert(gain);
    catalogue.insert(motor);
    Arc::new(catalogue)
}

fn conf(id: &str, pre: &[&str], changes: Vec<ChangeKind>, post: &[&str]) -> Configuration {
    let mut conf = Configuration::new(ConfigId::new(id).unwrap());
    let mut origin = 0;
    let mut next = || {
        origin += 1;
        Origin(origin)
    };
    let entry = |text: &&str, origin| {
        let (who, state) = text.split_once(':').unwrap();
        let target = match who {
            "_default" => Target::Default,
            name => Target::Component(ComponentName::new(name).unwrap()),
        };
        StateEntry { target, state: RunState::from_name(state).and_then(RunState::wanted).unwrap(), origin }
    };
    conf.pre = StateList::of(pre.iter().map(|t| entry(t, next()))).unwrap();
    conf.changes = changes.into_iter().map(|kind| Change { kind, origin: next() }).collect();
    conf.post = StateList::of(post.iter().map(|t| entry(t, next()))).unwrap();
    conf
}

fn member(text: &str) -> MemberRef {
    MemberRef::new(text).unwrap()
}

fn create(name: &str, ty: &str, properties: &[(&str, Value)]) -> ChangeKind {
    let properties = properties.iter().map(|(n, v)| (ident(n), v.clone())).collect();
    let component = ComponentName::new(name).unwrap();
    ChangeKind::Create { component, ty: TypeName::new(ty).unwrap(), activity: None, properties }
}

fn destroy(name: &str) -> ChangeKind {
    ChangeKind::Destroy { component: ComponentName::new(name).unwrap() }
}

fn connect(from: &str, to: &str) -> ChangeKind {
    ChangeKind::Connect { from: member(from), to: member(to), policy: Policy::Data }
}

fn buffered(from: &str, to: &str, n: u32) -> ChangeKind {
    ChangeKind::Connect { from: member(from), to: member(to), policy: Policy::Buffer(n) }
}

fn disconnect(from: &str, to: &str) -> ChangeKind {
    ChangeKind::Disconnect { from: member(from), to: member(to) }
}

fn set(property: &str, value: impl Into<Value>) -> ChangeKind {
    ChangeKind::PropertySet { property: member(property), value: value.into() }
}

fn write(port: &str, value: impl Into<Value>) -> ChangeKind {
    ChangeKind::PortWrite { port: member(port), value: value.into() }
}

fn call(operation: &str, undo: Option<&str>) -> ChangeKind {
    let call = |o: &str| Call { operation: member(o), args: vec![Value::Int(1)] };
    ChangeKind::OperationCall { call: call(operation), undo: undo.map(call) }
}

fn attempt(system: &System, conf: &Configuration) -> Result<Plan, Refusal> {
    plan(system, conf, &PlanContext { activities: BTreeSet::from([ident("fast")]), ..PlanContext::default() })
}

fn apply(system: &mut System, conf: &Configuration) -> Plan {
    let plan = attempt(system, conf).unwrap_or_else(|r| panic!("{r:?}"));
    for s in &plan.steps {
        step::apply(&s.step, system).unwrap();
    }
    plan
}

/// `A` feeds `B`, both running.
fn base() -> System {
    let mut system = System::new(types());
    let changes = vec![create("A", "t.Gain", &[]), create("B", "t.Gain", &[]), connect("A.y", "B.u")];
    apply(&mut system, &conf("base", &[], changes, &["_default:running"]));
    system
}

/// The codes with the origins of their places and labels.
fn findings(conf: &Configuration) -> Vec<(&'static str, u32, Vec<u32>)> {
    let refusal = attempt(&base(), conf).expect_err("it is refused");
    refusal.findings.iter().map(|f| (f.code.0, f.origin.0, f.labels.iter().map(|l| l.origin.0).collect())).collect()
}

fn one(changes: Vec<ChangeKind>) -> Vec<(&'static str, u32, Vec<u32>)> {
    findings(&conf("c", &[], changes, &[]))
}

fn steps(plan: &Plan) -> Vec<String> {
    plan.steps.iter().map(|s| s.step.to_string()).collect()
}

#[test]
fn the_clean_example_is_planned_in_derived_order() {
    // Written in the worst order; connected, destroyed and created again in one go.
    let changes = vec![
        connect("A.y", "B.u"),
        set("B.k", 2),
        create("B", "t.Gain", &[("v", Value::floats(&[1.0, 2.0, 3.0]))]),
        destroy("B"),
        disconnect("A.y", "B.u"),
    ];
    let conf = conf("again", &["A:stopped"], changes, &["B:running", "A:running"]);
    let plan = attempt(&base(), &conf).unwrap();
    let expected = [
        "stop A",
        "disconnect A.y -> B.u",
        "stop B",
        "cleanup B",
        "destroy B",
        "create B : t.Gain",
        "property_set B.k = 2.0",
        "connect A.y -> B.u (data)",
        "configure B",
        "start B",
        "start A",
    ];
    assert_eq!(steps(&plan), expected);
    let after: Vec<Vec<u32>> = plan.steps.iter().map(|s| s.after.to_vec()).collect();
    assert_eq!(after[4], [3, 1], "destroy waits for cleanup and for the disconnect");
    assert_eq!((after[5].as_slice(), after[6].as_slice(), after[7].as_slice()), (&[4][..], &[5][..], &[5, 1][..]));
    assert_eq!(plan.steps[0].stage, PlanStage::Pre);
    assert_eq!(plan.steps[10].stage, PlanStage::Post);
    assert!(plan.warnings.is_empty() && irreversible(&plan.steps).is_none());
}

#[test]
fn defaults_stop_producers_first_and_start_consumers_first() {
    let stop = attempt(&base(), &conf("c", &["_default:stopped"], vec![], &["_default:running"])).unwrap();
    assert_eq!(steps(&stop), ["stop A", "stop B", "start B", "start A"]);
    assert_eq!(stop.steps[1].after.as_slice(), [0]);
    assert_eq!(stop.steps[3].after.as_slice(), [2]);
    // In a loop `start_after` decides, then the name.
    let mut system = base();
    let id = [("id", Value::Int(1))];
    let changes = vec![create("Z", "t.Motor", &id), connect("B.y", "Z.u"), connect("Z.y", "A.u")];
    let plan = apply(&mut system, &conf("loop", &["_default:stopped"], changes, &["_default:running"]));
    assert_eq!(steps(&plan)[5..], ["configure Z", "start Z", "start A", "start B"]);
    assert_eq!(plan.warnings[0].code, codes::ACTUATOR_BY_DEFAULT);
}

/// What has faulted is not configured only to be stopped; where it is to be something, it is brought there.
#[test]
fn what_has_faulted_is_stopped_enough() {
    let mut system = base();
    assert!(system.set_state(ComponentName::new("A").unwrap(), RunState::Faulted));
    let of = |pre: &[&str], post: &[&str]| steps(&attempt(&system, &conf("c", pre, vec![], post)).unwrap());
    assert_eq!(of(&["_default:stopped"], &[]), ["stop B"]);
    assert_eq!(of(&["_default:unconfigured"], &[]), ["cleanup A", "stop B", "cleanup B"]);
    assert_eq!(of(&[], &["_default:stopped"]), ["cleanup A", "configure A", "stop B"]);
    assert_eq!(of(&["A:stopped"], &[]), ["cleanup A", "configure A"]);
}

#[test]
fn default_stays_in_the_file_of_its_configuration() {
    let mut system = System::new(types());
    let names = ["top", "left/a", "left/in/b", "left_too/c", "right/d"];
    let changes = names.iter().map(|n| create(n, "t.Gain", &[])).collect();
    apply(&mut system, &conf("up", &[], changes, &[]));
    let moved = |id: &str| steps(&attempt(&system, &conf(id, &[], vec![], &["_default:stopped"])).unwrap());
    assert_eq!(moved("go"), ["configure top"]);
    assert_eq!(moved("left/go"), ["configure left/a"]);
    assert_eq!(moved("left/in/go"), ["configure left/in/b"]);
    assert!(moved("lef/go").is_empty());
}

/// Where a name is destroyed and made again, *pre* is about the component that is there before.
#[test]
fn pre_is_about_the_component_that_goes() {
    let mut system = base();
    let name = system.graph().node_weights().find(|node| node.state == RunState::Running).map(|node| node.name);
    let name = name.expect("one runs").to_string();
    let links = system.snapshot().connections;
    let own = |member: &MemberRef| member.component.to_string() == name;
    let off = links.keys().filter(|(from, to)| own(from) || own(to));
    let off: Vec<ChangeKind> = off.map(|(from, to)| disconnect(&from.to_string(), &to.to_string())).collect();
    let ty = system.snapshot().components[&ComponentName::new(&name).unwrap()].ty.to_string();
    let changes = off.into_iter().chain([destroy(&name), create(&name, &ty, &[])]).collect();
    let swap = conf("swap", &[&format!("{name}:stopped")], changes, &[&format!("{name}:running")]);
    let done = steps(&apply(&mut system, &swap));
    let place =
        |step: String| done.iter().position(|one| one.starts_with(&step)).unwrap_or_else(|| panic!("{step}: {done:?}"));
    assert!(place(format!("stop {name}")) < place(format!("destroy {name}")), "{done:?}");
    assert!(place(format!("create {name}")) < place(format!("start {name}")), "{done:?}");
    assert_eq!(done.iter().filter(|step| **step == format!("stop {name}")).count(), 1, "{done:?}");
}

#[test]
fn demands_that_are_true_need_no_step_and_acts_are_refused() {
    let plan = attempt(&base(), &conf("c", &["A:running"], vec![set("A.v", Value::floats(&[0.0; 3]))], &[])).unwrap();
    assert!(plan.steps.is_empty());
    assert_eq!(plan.saved.len(), 1);
    assert!(plan.footprint.writes(super::footprint::Slot::Property(member("A.v"))));
    assert_eq!(one(vec![create("A", "t.Gain", &[])]), [("conf::component_exists", 1, vec![])]);
    assert_eq!(one(vec![connect("A.y", "B.u")]), [("conf::already_connected", 1, vec![])]);
    assert_eq!(one(vec![disconnect("B.y", "A.u")]), [("conf::not_connected", 1, vec![])]);
    assert_eq!(one(vec![destroy("C")]), [("conf::unknown_component", 1, vec![])]);
    // The same act twice counts once.
    let twice = conf("c", &[], vec![connect("B.y", "A.u"), connect("B.y", "A.u")], &[]);
    assert_eq!(attempt(&base(), &twice).unwrap().steps.len(), 1);
    // Rules are checked although the value is there already.
    assert_eq!(one(vec![set("A.k", 1)]), [("conf::not_tunable", 1, vec![91])]);
}

#[test]
fn clashes_show_both_lines() {
    assert_eq!(
        one(vec![set("A.v", Value::floats(&[1.0; 3])), set("A.v", Value::floats(&[2.0; 3]))]),
        [("conf::clash", 2, vec![1])]
    );
    assert_eq!(one(vec![write("A.u", 1.0), write("A.u", 2.0)]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![create("C", "t.Gain", &[("k", 2.0.into())]), set("C.k", 3.0)]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![connect("B.y", "A.u"), write("A.u", 2.0)]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![connect("B.y", "A.q"), buffered("B.y", "A.q", 3)]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![connect("A.y", "A.u"), connect("B.y", "A.u")]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![create("C", "t.Gain", &[]), create("C", "t.Motor", &[])]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![call("A.open", None), call("A.open", Some("A.close"))]), [("conf::clash", 2, vec![1])]);
    // A call and what takes it back, in either order.
    assert_eq!(one(vec![call("A.open", None), call("A.close", None)]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![call("A.close", None), call("A.open", None)]), [("conf::clash", 2, vec![1])]);
    assert_eq!(one(vec![call("A.close", Some("A.weld")), call("A.weld", None)]), [("conf::clash", 2, vec![1])]);
    let gone = vec![disconnect("A.y", "B.u"), destroy("B"), set("B.v", Value::floats(&[1.0; 3]))];
    assert_eq!(one(gone), [("conf::touches_destroyed", 3, vec![2])]);
    // One value as an int and as a float is one demand.
    let same = conf("c", &["A:stopped"], vec![set("A.k", 2), set("A.k", 2.0)], &[]);
    assert_eq!(attempt(&base(), &same).unwrap().steps.len(), 2);
}

#[test]
fn names_types_and_values() {
    let typo = attempt(&base(), &conf("c", &[], vec![set("A.kk", 1)], &[])).unwrap_err();
    assert_eq!(typo.findings[0].help.as_deref(), Some("did you mean `k`?"));
    assert_eq!(one(vec![create("C", "t.Gian", &[])]), [("conf::unknown_type", 1, vec![])]);
    assert_eq!(one(vec![connect("A.yy", "B.q")]), [("conf::unknown_port", 1, vec![])]);
    assert_eq!(one(vec![call("A.opn", None)]), [("conf::unknown_operation", 1, vec![])]);
    assert_eq!(one(vec![create("C", "t.Gain", &[("z", 1.0.into())])]), [("conf::unknown_property", 1, vec![])]);
    assert_eq!(one(vec![create("C", "t.Motor", &[])]), [("conf::missing_property", 1, vec![91])]);
    // A property_set beside the create does not replace the value.
    assert_eq!(one(vec![create("C", "t.Motor", &[]), set("C.id", 3)]), [("conf::missing_property", 1, vec![91])]);
    assert_eq!(one(vec![connect("A.n", "A.u")]), [("conf::port_types", 1, vec![90, 90])]);
    assert_eq!(one(vec![connect("A.m", "A.u")]), [("conf::port_units", 1, vec![90, 90])]);
    assert_eq!(one(vec![connect("A.u", "A.u")]), [("conf::not_an_out_port", 1, vec![90])]);
    assert_eq!(one(vec![connect("A.y", "B.y")]), [("conf::not_an_in_port", 1, vec![90])]);
    assert_eq!(one(vec![connect("A.y", "B.q")]), [("conf::needs_buffer", 1, vec![90])]);
    assert_eq!(one(vec![buffered("A.y", "B.q", 0)]), [("conf::buffer_size", 1, vec![])]);
    assert_eq!(one(vec![connect("B.y", "B.u")]), [("conf::data_alone", 1, vec![])]);
    assert_eq!(one(vec![buffered("B.y", "B.u", 2)]), [("conf::data_alone", 1, vec![])]);
    assert_eq!(one(vec![write("B.u", 1)]), [("conf::port_driven", 1, vec![])]);
    assert_eq!(one(vec![write("B.q", 1)]), [("conf::port_not_writable", 1, vec![90])]);
    assert_eq!(one(vec![write("B.e", "x")]), [("conf::port_not_writable", 1, vec![90])]);
    assert_eq!(one(vec![set("A.v", Value::floats(&[1.0, 11.0, 1.0]))]), [("conf::bad_value", 1, vec![91])]);
    assert_eq!(one(vec![set("A.v", Value::floats(&[1.0, f64::NAN, 1.0]))]), [("conf::bad_value", 1, vec![91])]);
    assert_eq!(one(vec![set("A.v", true)]), [("conf::bad_value", 1, vec![91])]);
    let wrong = Call { operation: member("A.open"), args: vec![] };
    assert_eq!(
        one(vec![ChangeKind::OperationCall { call: wrong, undo: None }]),
        [("conf::bad_arguments", 1, vec![92])]
    );
    let mut activity = create("C", "t.Gain", &[]);
    if let ChangeKind::Create { activity, .. } = &mut activity {
        *activity = Some(ident("fats"));
    }
    assert_eq!(one(vec![activity]), [("conf::unknown_activity", 1, vec![])]);
}

#[test]
fn lists() {
    let on = |pre: &[&str], changes, post: &[&str]| findings(&conf("c", pre, changes, post));
    assert_eq!(on(&["C:stopped"], vec![create("C", "t.Gain", &[])], &[]), [("conf::pre_on_created", 1, vec![2])]);
    // Of one that is destroyed and created again the old one is meant, in a list as elsewhere.
    let again = |name: &str| vec![destroy(name), create(name, "t.Gain", &[])];
    let swapped = conf("c", &["A:stopped"], [vec![disconnect("A.y", "B.u")], again("A")].concat(), &["A:stopped"]);
    let expected = ["stop A", "disconnect A.y -> B.u", "cleanup A", "destroy A", "create A : t.Gain", "configure A"];
    assert_eq!(steps(&attempt(&base(), &swapped).unwrap()), expected);
    let missing = conf("c", &["C:stopped"], again("C"), &[]);
    let missing = attempt(&base(), &missing).unwrap_err();
    assert!(missing.findings.iter().all(|f| f.code == codes::UNKNOWN_COMPONENT), "{missing:?}");
    let gone = vec![disconnect("A.y", "B.u"), destroy("B")];
    assert_eq!(on(&[], gone, &["B:stopped"]), [("conf::post_on_destroyed", 3, vec![2])]);
    assert_eq!(on(&[], vec![], &["C:running"]), [("conf::unknown_component", 1, vec![])]);
    // A property that needs `stopped`, after an entry that starts; and one that is enough.
    assert_eq!(on(&["A:stopped", "A:running"], vec![set("A.k", 2)], &[]), [("conf::not_tunable", 3, vec![91])]);
    assert!(attempt(&base(), &conf("c", &["A:running", "A:stopped"], vec![set("A.k", 2)], &[])).is_ok());
    assert_eq!(one(vec![destroy("B")]), [("conf::still_connected", 1, vec![])]);
    // All violations at once, from every stage, and no consequence of one as another.
    let all = on(
        &["X:stopped"],
        vec![create("C", "t.Gian", &[]), connect("C.y", "A.u"), set("A.k", 99)],
        &["Y:stopped", "C:stopped"],
    );
    let codes: Vec<&str> = all.iter().map(|f| f.0).collect();
    let expected = [
        "conf::unknown_component",
        "conf::unknown_type",
        "conf::not_tunable",
        "conf::bad_value",
        "conf::unknown_component",
    ];
    assert_eq!(codes, expected);
}

#[test]
fn reversibility_is_known_beforehand() {
    let changes = vec![call("A.weld", None), call("A.open", None), set("A.v", Value::floats(&[1.0; 3]))];
    let plan = attempt(&base(), &conf("c", &[], changes, &[])).unwrap();
    assert_eq!(steps(&plan)[2], "operation_call A.weld(1.0)", "the irreversible one is last");
    assert_eq!(plan.steps[2].after.as_slice(), [0, 1]);
    assert_eq!(plan.steps[0].reversibility, Reversibility::Compensated);
    let close = Call { operation: member("A.close"), args: vec![Value::Float(1.0)] };
    assert_eq!(plan.steps[0].undo, Undo::One(Step::Operation(close)));
    assert!(irreversible(&plan.steps).is_some());
    assert_eq!(plan.warnings[0].code, codes::IRREVERSIBLE);
    let mut meant = conf("c", &[], vec![call("A.weld", None)], &[]);
    meant.irreversible = true;
    assert!(attempt(&base(), &meant).unwrap().warnings.is_empty());
    let named = conf("c", &[], vec![call("A.weld", Some("B.open"))], &[]);
    assert_eq!(attempt(&base(), &named).unwrap().steps[0].reversibility, Reversibility::Compensated);
}

#[test]
fn what_moves_is_known_beforehand() {
    let moving = |undo: &str, moves: bool, undo_moves: bool| {
        let plan = attempt(&base(), &conf("c", &[], vec![call("B.swing", (!undo.is_empty()).then_some(undo))], &[]));
        let plan = plan.unwrap();
        assert_eq!((plan.steps[0].moves, plan.steps[0].undo_moves), (moves, undo_moves), "{undo}");
    };
    moving("", true, true);
    moving("B.open", true, false);
    moving("B.swing", true, true);
    let back = attempt(&base(), &conf("c", &[], vec![call("B.open", Some("B.swing"))], &[])).unwrap();
    assert_eq!((back.steps[0].moves, back.steps[0].undo_moves), (false, true));
    // Of a component that this plan creates, too; and what it destroys is stopped first.
    let new = conf("c", &[], vec![create("C", "t.Motor", &[("id", Value::Int(1))])], &["C:running"]);
    let flags = |plan: &Plan| {
        let one = |s: &PlannedStep| (s.step.to_string(), s.moves, s.undo_moves);
        plan.steps.iter().map(one).filter(|(_, a, b)| *a || *b).collect::<Vec<_>>()
    };
    assert_eq!(flags(&attempt(&base(), &new).unwrap()), [("start C".to_owned(), true, false)]);
    let mut system = base();
    for s in attempt(&system, &new).unwrap().steps {
        step::apply(&s.step, &mut system).unwrap();
    }
    let gone = attempt(&system, &conf("d", &[], vec![destroy("C")], &[])).unwrap();
    assert_eq!(flags(&gone), [("stop C".to_owned(), false, true)]);
}

#[test]
fn chains_of_a_hundred_thousand_are_ordinary() {
    let n = 100_000;
    let name = |i: usize| format!("c{i}");
    let mut changes: Vec<ChangeKind> = (0..n).map(|i| create(&name(i), "t.Gain", &[])).collect();
    changes.extend((1..n).map(|i| connect(&format!("{}.y", name(i - 1)), &format!("{}.u", name(i)))));
    let plan = attempt(&System::new(types()), &conf("deep", &[], changes, &["_default:running"])).unwrap();
    assert_eq!(plan.steps.len(), 4 * n - 1);
    let edges: usize = plan.steps.iter().map(|s| s.after.len()).sum();
    assert!(edges < 6 * n, "{edges} edges");
    assert_eq!(plan.steps.last().unwrap().step.to_string(), "start c0", "the first producer starts last");
}
