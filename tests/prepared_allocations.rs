//! What a prepared switch costs in allocations: nothing, from its second application on (the first one makes the frame
//! that is used again afterwards).

use davit::model::*;
use davit::plan::prepare::{Act, Switch};
use davit::plan::{Context, plan};
use davit::stack::{Requester, Scope, Stack};
use davit::system::{System, step};
use davit::time::Time;
use std::alloc::{GlobalAlloc, Layout};
use std::cell::Cell;
use std::sync::Arc;

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on to the system's allocator unchanged; counting touches a thread-local without a
// destructor, which allocates nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: the caller's obligations are the system allocator's.
        unsafe { std::alloc::System.alloc(layout) }
    }

    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { std::alloc::System.dealloc(at, layout) }
    }

    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: as above.
        unsafe { std::alloc::System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn count(f: impl FnOnce()) -> u64 {
    let before = COUNT.with(Cell::get);
    f();
    COUNT.with(Cell::get) - before
}

fn arm() -> System {
    let mut ty = ComponentType::new("T.arm", "an arm's controller");
    let ident = |n: &str| Ident::new(n).unwrap();
    let property = PropertyType {
        ty: "float[3]".parse().unwrap(),
        default: Some(Value::floats(&[0.0; 3])),
        min: Some(0.0),
        max: Some(10.0),
        tunable: Tunable::Stopped,
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
    for s in plan(&system, &up, &Context::default()).unwrap().steps {
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

fn perform(switch: &Switch, system: &mut System) {
    for i in 0..switch.acts().len() {
        let act: Act = switch.acts()[i];
        std::hint::black_box(switch.sends(act));
        switch.done(act, system);
    }
}

#[test]
fn a_prepared_switch_allocates_nothing() {
    let mut system = arm();
    let mut stack = Stack::new(8);
    let before = system.snapshot();
    let mut switch = Switch::new(&mut system, &switch(2.0)).unwrap();
    let cycle = |switch: &mut Switch, system: &mut System, stack: &mut Stack| {
        assert!(stack.takes(switch));
        assert!(switch.ready(system));
        perform(switch, system);
        stack.push_switch(switch, Requester::Operator, Time(1), Some(Scope(1)));
        let top = stack.top_of(switch).expect("it was just pushed");
        assert!(switch.ready_undo(system, &top.acts, &top.saved));
        perform(switch, system);
        stack.pop_switch();
    };
    let first = count(|| cycle(&mut switch, &mut system, &mut stack));
    assert!(first > 0, "the counter counts");
    assert_eq!(count(|| (0..100).for_each(|_| cycle(&mut switch, &mut system, &mut stack))), 0);
    assert_eq!(system.snapshot(), before);
    // Planning and capturing alone allocate nothing at the first time either.
    let mut fresh = Switch::new(&mut system, &self::switch(3.0)).unwrap();
    assert_eq!(
        count(|| {
            assert!(fresh.ready(&system));
            perform(&fresh, &mut system);
        }),
        0
    );
    assert_ne!(system.snapshot(), before);
}
