//! Evaluating monitors allocates nothing, whatever they hold, and neither does the component that raises what they find: counted by the
//! allocator.

use crate::counting::Together;
use davit::lang::{LoadOptions, Sources, load_monitors};
use davit::libraries::monitors;
use davit::model::*;
use davit::monitor::{Bank, InputSample};
use davit::platform::embedded::EmbeddedPlatform;
use davit::platform::{Outcome, Platform};
use davit::runtime::*;
use davit::time::{Clock, Time};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

static COUNT: Together = Together::new();

const MONITORS: &str = r#"
local high = above("A.x", 0.5, { hysteresis = 0.1 })
Monitors {
  a = monitor { when = high:for_at_least(3), event = "e", cleared = "c", repeat_every = 0.5 },
  b = monitor { when = any { since(high, rise(below("A.y", 0.2)), { 0.5, 9 }), silent("A.y", 0.01), faulted("A") }, event = "e" },
  c = monitor { when = all { high:once { 0.1, 20 }, no(high:historically { 1, math.huge }) }, event = "e", every = 0.01 },
  d = monitor { when = below(sample_rate("A.y", 10), max { 300, norm { "A.x", "A.y" } }), event = "e" },
  f = monitor { when = above("A.x", 0.9), event = "e" },
  g = monitor { when = below("A.z", 100):within_last(20), event = "e" },
  e = monitor { when = below(difference("A.z", abs("A.x")), 1):within_last(20), event = "e" },
}
"#;

#[test]
fn evaluating_allocates_nothing() {
    let loaded = load_monitors(&Sources::memory([("m.lua", MONITORS)]), Path::new("m.lua"), &LoadOptions::default());
    assert!(loaded.findings.is_empty(), "{:?}", loaded.findings);
    // A copy too: a component is made of a template.
    let mut bank = Bank::new(&loaded.monitors).clone();
    let mut samples = vec![InputSample::default(); bank.inputs().len()];
    let mut raised = 0_u64;
    let mut seed = 7_u64;
    COUNT.add_thread();
    let before = COUNT.touched();
    for i in 0..30_000_u64 {
        let now = Time(i * 1_000_000);
        for (n, sample) in samples.iter_mut().enumerate() {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if (seed >> 60) > n as u64 {
                // Noise, and a ramp that needs more memory than an operator has.
                let noise = (seed >> 33) as f64 / (1_u64 << 31) as f64;
                let value = if n == 3 { i as f64 * 1e-3 } else { noise };
                *sample = InputSample { value, at: now, writes: sample.writes + 1, present: true };
            }
        }
        if i % 1000 == 999 {
            bank.enable((i / 1000 % 2) as usize, i / 1000 % 4 < 2, now);
        }
        bank.step(now, &mut |n| samples[n], &mut |_, _| raised += 1);
        let _ = (bank.next_wake(), bank.is_true(0), bank.robustness(1));
    }
    let allocations = COUNT.touched() - before;
    assert!(raised > 100, "{raised} events");
    assert!(bank.troubles().merged > 0, "the memory of no operator was used up");
    assert_eq!(allocations, 0);
}

/// The threads of the activity in which a component of monitors runs.
static RAISING: Together = Together::new();

/// Writes what goes up and down.
struct Swing {
    y: Out<f64>,
    rounds: u32,
}

impl Component for Swing {
    fn new(b: &mut Builder<Self>) -> Self {
        Self { y: b.output("y"), rounds: 0 }
    }

    fn update(&mut self, _: &mut Context) {
        RAISING.add_thread();
        self.rounds += 1;
        self.y.write(f64::from(self.rounds % 20) - 10.0);
    }
}

const SWINGING: &str = r#"
Monitors {
  high = monitor { when = above("S.y", 5), event = "e_high", cleared = "e_low" },
  often = monitor { when = below("S.y", 100), event = "e_often", repeat_every = 0.002 },
  shaky = monitor { when = above("S.y", 0):for_at_least(0.003), event = "e_shaky" },
}
"#;

#[test]
fn a_component_of_monitors_raises_without_allocating() {
    // A thread for each activity: what is counted is the activity's own.
    let clock = Clock::simulated_paced(1e9);
    let _guard = clock.enter();
    let loaded = load_monitors(&Sources::memory([("m.lua", SWINGING)]), Path::new("m.lua"), &LoadOptions::default());
    assert!(loaded.findings.is_empty(), "{:?}", loaded.findings);
    let libraries = Libraries::new().with(Library::new("test").with::<Swing>("Swing"));
    let libraries = monitors::added_to(libraries, &loaded.monitors);
    let activity = Activity { period: Some(Duration::from_millis(1)), priority: 0, cpu: None, origin: Origin::NONE };
    let control = Ident::new("control").unwrap();
    let platform = EmbeddedPlatform::new(&clock, &libraries, &BTreeMap::from([(control, activity)]));
    let raised = Arc::new(AtomicU64::new(0));
    let told = raised.clone();
    platform.subscribe(Arc::new(move |_| _ = told.fetch_add(1, Ordering::Relaxed)));
    let done = |step: &Step| {
        let outcome = platform.execute(step, clock.now() + Duration::from_secs(1));
        assert_eq!(outcome, Outcome::Done(None), "{step}");
    };
    for (name, ty, properties) in
        [("S", "Swing", vec![]), ("M", "davit.Monitors", vec![Value::Bool(true); loaded.monitors.len()])]
    {
        let component = ComponentName::new(name).unwrap();
        done(&Step::Create { component, ty: TypeName::new(ty).unwrap(), activity: Some(control), properties });
        done(&Step::State { component, transition: Transition::Configure });
        done(&Step::State { component, transition: Transition::Start });
    }
    // The first rounds take what is kept.
    clock.sleep(Duration::from_millis(100));
    let (before, events) = (RAISING.touched(), raised.load(Ordering::Relaxed));
    clock.sleep(Duration::from_secs(5));
    let (touched, events) = (RAISING.touched() - before, raised.load(Ordering::Relaxed) - events);
    assert!(events > 2_000, "{events} events");
    assert_eq!(touched, 0, "while {events} events were raised");
}
