//! What runs in control activities, and what a prepared switch does, allocates nothing: counted by the allocator.

use crate::counting::Together;
use davit::model::*;
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::{Outcome, Platform};
use davit::runtime::*;
use davit::time::Clock;
use std::collections::BTreeMap;
use std::time::Duration;

/// The thread that switches, and that of the activity.
static COUNT: Together = Together::new();

/// Reads and writes a vector and a float.
struct Worker {
    u: In<[f64; 3]>,
    y: Out<[f64; 3]>,
    gains: Prop<[f64; 3]>,
    mode: In<bool>,
}

impl Component for Worker {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { u: b.input("u"), y: b.output("y"), gains: b.property("gains", [1.0; 3]), mode: b.input("mode") }
    }

    fn update(&mut self, _: &mut Context) {
        COUNT.add_thread();
        let gains = self.gains.get();
        let _ = (self.mode.get(), self.u.age());
        let u = self.u.get().unwrap_or_default();
        self.y.write(std::array::from_fn(|i| gains[i] * u[i] + 1.0));
    }
}

#[test]
fn updates_and_prepared_switches_allocate_nothing() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let libraries = Libraries::new().with(Library::new("test").with::<Worker>("Worker"));
    let activity = Activity { period: Some(Duration::from_millis(1)), priority: 0, cpu: None, origin: Origin::NONE };
    let control = Ident::new("control").unwrap();
    let platform = EmbeddedPlatform::new(&clock, &libraries, &BTreeMap::from([(control, activity)]));
    let done = |step: &Step| {
        let outcome = platform.execute(step, clock.now() + Duration::from_secs(1));
        assert_eq!(outcome, Outcome::Done(None), "{step}");
    };
    let name = |i: usize| ComponentName::new(&format!("c{i}")).unwrap();
    let member = |i: usize, m: &str| name(i).member(Ident::new(m).unwrap());
    for i in 0..4 {
        done(&Step::Create {
            component: name(i),
            ty: TypeName::new("Worker").unwrap(),
            activity: Some(control),
            properties: vec![Value::floats(&[1.0; 3])],
        });
    }
    for i in 1..4 {
        done(&Step::Connect { from: member(i - 1, "y"), to: member(i, "u"), policy: Policy::Data });
    }
    for i in 0..4 {
        done(&Step::State { component: name(i), transition: Transition::Configure });
        done(&Step::State { component: name(i), transition: Transition::Start });
    }
    let steps = [
        Step::PropertySet { property: member(2, "gains"), value: Value::floats(&[0.1; 3]) },
        Step::PortWrite { port: member(2, "mode"), value: Some(Value::Bool(true)) },
        Step::State { component: name(2), transition: Transition::Stop },
        Step::State { component: name(2), transition: Transition::Start },
    ];
    let mut prepared = platform.prepare(&steps).expect("all immediate");
    let other = Value::floats(&[0.2; 3]);
    let mut round = |n: u32| {
        for _ in 0..n {
            for index in 0..steps.len() {
                let value = (index == 0).then_some(&other);
                let outcome = prepared.execute(index, value, clock.now(), clock.now() + Duration::from_secs(1));
                assert_eq!(outcome, Outcome::Done(None));
            }
            clock.sleep(Duration::from_millis(5));
        }
    };
    COUNT.add_thread();
    // The first rounds take what is kept (the list of timers, the memory of slots).
    round(50);
    let before = COUNT.touched();
    assert!(before > 0, "the counter counts");
    round(200);
    assert_eq!(COUNT.touched() - before, 0);
    let cycles = platform.activities()[0].cycles;
    assert!(cycles >= 1000, "{cycles} rounds of four components were among them");
}
