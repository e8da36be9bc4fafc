//! The youBot's monitors on the worst signals there are: every one of them noise around the thresholds, a thousand times a
//! second. What they raise then, a coordinator that was held up for a second has room for (tests/session/flood.rs shows what
//! happens to what has no room).

use super::files::deployment;
use davit::limits;
use davit::model::ChangeKind;
use davit::model::monitor::{MONITORS_TYPE, SignalKind};
use davit::monitor::{Bank, InputSample, MonitorInput};
use davit::time::Time;
use std::collections::BTreeMap;

/// How long each monitor gets noise around its own thresholds.
const SECONDS: u64 = 5;

#[test]
fn a_second_of_the_worst_chatter_fits_the_coordinators_inbox() {
    let (deployment, _) = deployment("youbot_arm");
    let activity = deployment.configurations.iter().flat_map(|c| &c.changes).find_map(|change| match &change.kind {
        ChangeKind::Create { ty, activity, .. } if ty.as_str() == MONITORS_TYPE => *activity,
        _ => None,
    });
    let period = deployment.activities[&activity.expect("something runs them")].period.expect("a round every so often");
    let round = u64::try_from(period.as_millis()).unwrap().max(1);
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        usize::try_from(state % below as u64).unwrap()
    };
    let mut raised: BTreeMap<&str, u64> = BTreeMap::new();
    for (number, noisy) in deployment.monitors.iter().enumerate() {
        // Values on either side of its thresholds, and what a bool carries.
        let mut values = vec![0.0, 1.0];
        noisy.for_each_signal(&mut |signal| {
            if let SignalKind::Constant(threshold) = signal.kind {
                values.extend([0.99 * threshold, 1.01 * threshold]);
            }
        });
        let mut bank = Bank::new(&deployment.monitors);
        let ports: Vec<bool> = bank.inputs().iter().map(|input| matches!(input, MonitorInput::Port(_))).collect();
        let mut samples = vec![InputSample::default(); ports.len()];
        for ms in 1..=SECONDS * 1000 {
            let now = Time(ms * 1_000_000);
            for (sample, is_port) in samples.iter_mut().zip(&ports) {
                // Now and then nothing comes: silence and age are conditions too.
                if *is_port && random(10) > 0 {
                    let (value, writes) = (values[random(values.len())], sample.writes + 1);
                    *sample = InputSample { value, at: now, writes, present: true };
                }
            }
            if ms % round == 0 {
                bank.step(now, &mut |input| samples[input], &mut |monitor, _| {
                    *raised.entry(noisy.name.as_str()).or_default() += u64::from(monitor == number);
                });
            }
        }
    }
    // Without hysteresis a condition becomes true at most in every other round.
    let most = SECONDS * 1000 / round / 2;
    assert!(raised.values().all(|count| *count <= most), "{most}: {raised:?}");
    // As if all of them were at their worst at once.
    let a_second = raised.values().sum::<u64>() / SECONDS;
    assert!(a_second > 100, "the noise is quiet: {raised:?}");
    assert!(a_second < limits::INBOX_REPORT as u64, "{a_second} events a second: {raised:?}");
}
