//! What the network does, counted over many packets.

use super::*;

/// Packets every 4 ms; each with the number and moment (s) it was sent and the one it arrived at.
fn sent(quality: Quality, packets: u32, seed: u64) -> (Vec<(u32, f64, f64)>, NetworkCounts) {
    let mut net = Network::new(quality, seed);
    let mut got = Vec::new();
    // In steps of 0.1 ms, so that what is measured is the network and not the step.
    for i in 0..(packets * 40 + 20_000) {
        let now = f64::from(i) * 1e-4;
        if i % 40 == 0 && i / 40 < packets {
            net.send(now, (i / 40, now));
        }
        while let Some((number, at)) = net.receive(now + 1e-9) {
            got.push((number, at, now));
        }
    }
    (got, net.counts)
}

fn times(got: &[(u32, f64, f64)]) -> Vec<f64> {
    got.iter().map(|(_, sent, came)| came - sent).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Numbers that come behind a larger one.
fn overtaken(got: &[(u32, f64, f64)]) -> usize {
    let mut newest = 0;
    let mut behind = |number: u32| {
        newest = newest.max(number);
        newest > number
    };
    got.iter().filter(|(number, ..)| behind(*number)).count()
}

#[test]
fn it_delays_and_loses_as_told_and_repeatably() {
    let quality = Quality { delay: 0.01, jitter: 0.003, loss: 0.3, ..Quality::default() };
    let (got, counts) = sent(quality, 10_000, 7);
    assert!((6_850..7_150).contains(&got.len()), "{}", got.len());
    assert_eq!((counts.sent, counts.lost + counts.delivered, counts.refused), (10_000, 10_000, 0));
    let times = times(&got);
    assert!(times.iter().all(|t| (0.0099..0.0132).contains(t)));
    // Evenly spread: half of the jitter on the mean, a twelfth of its square the variance.
    let (mean, square) = (mean(&times), mean(&times.iter().map(|t| t * t).collect::<Vec<_>>()));
    let deviation = (square - mean * mean).sqrt();
    assert!((mean - 0.0115).abs() < 1e-4 && (deviation - 0.003 / 12.0_f64.sqrt()).abs() < 5e-5, "{mean} {deviation}");
    assert_eq!(got, sent(quality, 10_000, 7).0);
    assert_ne!(got, sent(quality, 10_000, 8).0);
}

#[test]
fn jitter_keeps_the_order_and_another_way_does_not() {
    let jitter = Quality { delay: 0.005, jitter: 0.03, ..Quality::default() };
    let (got, _) = sent(jitter, 5_000, 1);
    assert!(got.len() == 5_000 && overtaken(&got) == 0);
    let (got, _) = sent(Quality { delay: 0.005, reorder: 0.2, ..Quality::default() }, 5_000, 1);
    let share = overtaken(&got) as f64 / 5_000.0;
    // One that goes round comes behind the two that follow it, unless both go round as well.
    assert!((share - 0.2 * (1.0 - 0.2 * 0.2)).abs() < 0.02, "{share}");
    let late = times(&got).into_iter().filter(|t| (*t - 0.005 - DETOUR).abs() < 2e-4).count() as f64 / 5_000.0;
    assert!((late - 0.2).abs() < 0.02, "{late}");
}

#[test]
fn losses_come_in_bursts_of_the_given_length() {
    let quality = Quality { burst_begin: 0.01, burst_end: 0.1, ..Quality::default() };
    let (got, _) = sent(quality, 40_000, 3);
    let lost = 1.0 - got.len() as f64 / 40_000.0;
    // In a bad time for begin / (begin + end) of the packets.
    assert!((lost - 0.01 / 0.11).abs() < 0.015, "{lost}");
    let gaps: Vec<f64> =
        got.windows(2).map(|w| f64::from(w[1].0 - w[0].0 - 1)).filter(|missing| *missing > 0.0).collect();
    assert!((mean(&gaps) - 10.0).abs() < 1.5, "{} in {} bursts", mean(&gaps), gaps.len());
    // Of as many lost one by one hardly two are neighbours.
    let (got, _) = sent(Quality { loss: 0.01 / 0.11, ..Quality::default() }, 40_000, 3);
    let gaps: Vec<f64> =
        got.windows(2).map(|w| f64::from(w[1].0 - w[0].0 - 1)).filter(|missing| *missing > 0.0).collect();
    assert!((mean(&gaps) - 1.1).abs() < 0.05, "{}", mean(&gaps));
}

#[test]
fn some_come_twice() {
    let (got, counts) = sent(Quality { delay: 0.002, duplicate: 0.1, ..Quality::default() }, 10_000, 5);
    assert_eq!(counts.delivered, got.len() as i64);
    assert!((10_900..11_100).contains(&got.len()), "{}", got.len());
}

#[test]
fn a_slow_network_lets_so_many_through_and_its_queue_has_an_end() {
    // A quarter faster than packets come, and at half of it.
    for (rate, through, longest) in [(312.5, 5_000, 0.0033), (125.0, 2_500, 0.0081 + WAITING / 125.0)] {
        let (got, counts) = sent(Quality { rate, ..Quality::default() }, 5_000, 1);
        let slowest = times(&got).into_iter().fold(0.0, f64::max);
        assert!((through..through + 40).contains(&got.len()), "{rate}: {}", got.len());
        assert!(slowest < longest && counts.refused == 5_000 - got.len() as i64, "{rate}: {slowest} {counts:?}");
    }
}

#[test]
fn what_is_under_way_is_bounded() {
    let mut net = Network::new(Quality { delay: 10.0, duplicate: 1.0, ..Quality::default() }, 1);
    (0..2_000).for_each(|i| net.send(f64::from(i) * 1e-3, i));
    let arrived = std::iter::from_fn(|| net.receive(100.0)).count();
    assert!(arrived <= IN_FLIGHT && net.flying.capacity() >= IN_FLIGHT, "{arrived}");
}

#[test]
fn cut_means_nothing_and_healed_it_goes_on() {
    let mut net = Network::new(Quality { cut: true, ..Quality::default() }, 1);
    net.send(0.0, 1);
    assert!(net.receive(10.0).is_none());
    net.quality.cut = false;
    net.send(10.0, 2);
    assert_eq!(net.receive(10.0), Some(2));
    assert_eq!(net.counts, NetworkCounts { sent: 2, lost: 1, refused: 0, delivered: 1 });
}
