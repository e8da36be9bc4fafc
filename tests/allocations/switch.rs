//! What a prepared switch costs in allocations: nothing, from its second application on (the first one is planned, and
//! makes the frame that is used again afterwards).

use crate::counting::made_by;
use davit::model::*;
use davit::plan::footprint::Saved;
use davit::plan::{PlanContext, plan};
use davit::stack::{Op, Requester, ResolvedStep, Scope, Stack, Switch, transaction};
use davit::system::{System, step};
use davit::time::Time;
use std::sync::Arc;

fn arm() -> System {
    let mut ty = ComponentType::new("T.arm", "an arm's controller");
    let ident = |n: &str| Ident::new(n).unwrap();
    let property = PropertyType {
        ty: "float[3]".parse().unwrap(),
        default: Some(Value::floats(&[0.0; 3])),
        min: Some(0.0),
        max: Some(10.0),
        tunable: Tunable::Stopped,
        raises: false,
        unit: None,
        doc: String::new(),
        origin: Origin::NONE,
    };
    ty.properties.insert(ident("gain"), property);
    let port = PortType {
        direction: Direction::In,
        ty: "float[2]".parse().unwrap(),
        unit: None,
        buffered: false,
        required: false,
        doc: String::new(),
        origin: Origin::NONE,
    };
    ty.ports.insert(ident("mode"), port);
    let mut catalogue = Catalogue::new();
    catalogue.insert(ty);
    let mut system = System::new(Arc::new(catalogue));
    let mut up = Configuration::new(ConfigId::new("up").unwrap());
    let component = ComponentName::new("arm").unwrap();
    let create = ChangeKind::Create {
        component,
        ty: TypeName::new("T.arm").unwrap(),
        activity: None,
        properties: std::collections::BTreeMap::new(),
    };
    up.changes.push(Change { kind: create, origin: Origin::NONE });
    up.post.push(StateEntry { target: Target::Default, state: Wanted::Running, origin: Origin::NONE }).unwrap();
    for s in plan(&system, &up, &PlanContext::default()).unwrap().steps {
        step::apply(&s.step, &mut system).unwrap();
    }
    system
}

fn switch(gain: f64) -> Configuration {
    let mut conf = Configuration::new(ConfigId::new("switch").unwrap());
    let component = ComponentName::new("arm").unwrap();
    let target = Target::Component(component);
    conf.pre.push(StateEntry { target, state: Wanted::Stopped, origin: Origin::NONE }).unwrap();
    let set = ChangeKind::PropertySet {
        property: MemberRef::new("arm.gain").unwrap(),
        value: Value::floats(&[gain, gain, gain]),
    };
    let write = ChangeKind::PortWrite { port: MemberRef::new("arm.mode").unwrap(), value: Value::floats(&[gain, 1.0]) };
    conf.changes.extend([set, write].map(|kind| Change { kind, origin: Origin::NONE }));
    conf.post.push(StateEntry { target, state: Wanted::Running, origin: Origin::NONE }).unwrap();
    conf
}

/// Does the steps as the configurator does, and says how many.
fn perform(switch: &Switch, undoing: bool, system: &mut System) -> usize {
    let mut done = 0;
    while let Some(ResolvedStep { step, place, value, .. }) = switch.step(done, undoing) {
        std::hint::black_box(value);
        assert!(place.precondition(step, system).is_empty());
        place.effect(step, system);
        done += 1;
    }
    done
}

#[test]
fn a_prepared_switch_allocates_nothing() {
    let mut system = arm();
    let mut stack = Stack::new(8);
    let configuration = switch(2.0);
    let (requester, at, scope) = (Requester::Operator, Time(1), Some(Scope(1)));
    let push = Op::Push { configuration: &configuration, requester, at, scope };
    let plan = |system: &mut System, stack: &mut Stack| {
        let planned = transaction(system, stack, &[push], &PlanContext::default()).unwrap();
        let switch = Switch::new(system, &configuration, &planned).expect("a fixed switch");
        for planned in planned.steps.iter() {
            step::apply(&planned.step, system).unwrap();
        }
        stack.commit(planned);
        switch
    };
    let before = system.snapshot();
    let mut first = None;
    assert!(made_by(|| first = Some(plan(&mut system, &mut stack))) > 0, "the counter counts");
    let mut switch = first.unwrap();
    let undo = transaction(&system, &stack, &[Op::UndoTop], &PlanContext::default()).unwrap();
    for planned in undo.steps.iter() {
        step::apply(&planned.step, &mut system).unwrap();
    }
    stack.commit(undo);
    assert_eq!(system.snapshot(), before);
    let cycle = |switch: &mut Switch, system: &mut System, stack: &mut Stack| {
        assert!(stack.takes(switch, requester));
        assert!(switch.ready(system, requester, at, scope));
        assert_eq!(perform(switch, false, system), 4);
        stack.push_switch(switch);
        assert!(stack.is_top(switch) && switch.fits(system, true));
        assert_eq!(perform(switch, true, system), 4);
        stack.pop_switch();
    };
    assert_eq!(made_by(|| (0..100).for_each(|_| cycle(&mut switch, &mut system, &mut stack))), 0);
    assert_eq!(system.snapshot(), before);
    // In force twice, it has two frames.
    let gain = |value: f64, system: &mut System| {
        let property = MemberRef::new("arm.gain").unwrap();
        for wanted in [Transition::Stop, Transition::Start] {
            let component = property.component;
            step::apply(&Step::State { component, transition: wanted }, system).unwrap();
            if wanted == Transition::Stop {
                let value = Value::floats(&[value; 3]);
                step::apply(&Step::PropertySet { property, value }, system).unwrap();
                step::apply(&Step::PortWrite { port: MemberRef::new("arm.mode").unwrap(), value: None }, system)
                    .unwrap();
            }
        }
    };
    for old in [1.0, 3.0] {
        gain(old, &mut system);
        assert!(switch.ready(&system, requester, at, scope));
        perform(&switch, false, &mut system);
        stack.push_switch(&mut switch);
    }
    let saved = |at: usize| stack.frames()[at].saved.iter().map(|s| s.value.clone()).collect::<Vec<_>>();
    assert_eq!(saved(0)[0], Saved::Property(Value::floats(&[1.0; 3])));
    assert_eq!(saved(1)[0], Saved::Property(Value::floats(&[3.0; 3])));
}
