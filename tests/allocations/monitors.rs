//! Evaluating monitors allocates nothing, whatever they hold: counted by the allocator.

use crate::counting::Together;
use davit::lang::{LoadOptions, Sources, load_monitors};
use davit::monitor::{Bank, InputSample};
use davit::time::Time;
use std::path::Path;

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
