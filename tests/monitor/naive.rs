//! The definitions of `docs/monitors.md`, evaluated as they stand over the whole history.
//!
//! Nothing changes but at whole nanoseconds and right behind them, so that each signal is constant between two of them. The
//! instants looked at are the whole nanoseconds and, for all the others, two between each and the next; quantifiers go
//! over all of them. That is exact, but for one thing that a finite number of instants cannot show: behind an instant
//! between two nanoseconds there is always another one before the next, so what must hold *after* it must hold there.

use davit::model::monitor::*;
use davit::monitor::Grade;
use std::time::Duration;

/// Instants from one nanosecond to the next.
pub const STEPS: usize = 3;

/// What happened: of a port, samples with the instant from which they count; of a fault, changes.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// The instant of the first evaluation, in nanoseconds.
    pub start: u64,
    /// Of each port `A.x`, `A.y`: from which instant (in steps), stamp in nanoseconds, value.
    pub ports: [Vec<(usize, u64, f64)>; 2],
    /// Of component `A`: from which instant (in steps), faulted or not.
    pub faults: Vec<(usize, bool)>,
}

impl History {
    fn port(&self, name: &str) -> &[(usize, u64, f64)] {
        &self.ports[usize::from(name == "A.y")]
    }

    fn value(&self, name: &str, t: usize) -> f64 {
        self.port(name).iter().rev().find(|(from, ..)| *from <= t).map_or(f64::NAN, |(_, _, v)| *v)
    }

    /// The age at an instant, in steps.
    fn age(&self, name: &str, t: usize) -> i64 {
        let newest = self.port(name).iter().rev().find(|(from, ..)| *from <= t).map_or(self.start, |(_, at, _)| *at);
        t as i64 - newest as i64 * STEPS as i64
    }

    fn number(&self, s: &MonitoredSignal, t: usize) -> f64 {
        let all = |list: &[MonitoredSignal]| list.iter().map(|s| self.number(s, t)).collect::<Vec<_>>();
        let pick = |list: Vec<f64>, f: fn(f64, f64) -> f64| {
            if list.iter().any(|v| v.is_nan()) { f64::NAN } else { list.into_iter().reduce(f).unwrap() }
        };
        match &s.kind {
            SignalKind::Port(port) => self.value(&port.to_string(), t),
            SignalKind::Constant(v) => *v,
            SignalKind::Difference(a, b) => self.number(a, t) - self.number(b, t),
            SignalKind::Abs(s) => self.number(s, t).abs(),
            SignalKind::Min(list) => pick(all(list), f64::min),
            SignalKind::Max(list) => pick(all(list), f64::max),
            SignalKind::Norm(list) => all(list).iter().map(|v| v * v).sum::<f64>().sqrt(),
            SignalKind::Rate { port, over } => {
                let (name, over) = (port.to_string(), over.as_nanos() as usize);
                if t < (self.start as usize + over) * STEPS {
                    return f64::NAN;
                }
                // Samples of the history, by their stamps; the first look tells only what was there before.
                let first = self.start as usize * STEPS;
                let news = self.port(&name).iter().filter(|(from, at, _)| *from > first && *at >= self.start);
                let inside = news.filter(|(from, at, _)| *from <= t && (*at as usize + over) * STEPS > t);
                inside.count() as f64 / (over as f64 / 1e9)
            }
            SignalKind::Age(_) | SignalKind::Activity { .. } => unreachable!("not generated here"),
        }
    }

    /// What a condition is at every instant from the start to `end`, in steps.
    pub fn evaluate(&self, c: &Condition, end: usize) -> Vec<Grade> {
        use ConditionKind as K;
        let start = self.start as usize * STEPS;
        let every = |f: &mut dyn FnMut(usize) -> Grade| (start..=end).map(f).collect::<Vec<_>>();
        let steps = |d: Duration| d.as_nanos() as usize * STEPS;
        // The instants of an interval before the `i`-th, as indices.
        let window = |i: usize, interval: &Interval| -> std::ops::Range<usize> {
            let newest = i.checked_sub(steps(interval.from)).map_or(0, |n| n + 1);
            let oldest = interval.to.map_or(0, |to| i.saturating_sub(steps(to)));
            oldest..newest.max(oldest)
        };
        match &c.kind {
            K::Compare { left, op, right, hysteresis } => {
                if let (SignalKind::Age(port), SignalKind::Constant(bound)) = (&left.kind, &right.kind) {
                    let bound = (bound * 1e9).round() as i64 * STEPS as i64;
                    return every(&mut |t| Grade::of(holds(self.age(&port.to_string(), t), *op, bound)));
                }
                let mut was = false;
                every(&mut |t| {
                    let (l, r) = (self.number(left, t), self.number(right, t));
                    let bounds = |h: f64| match op {
                        Comparison::Below => ((r + h) - l, l < r + h),
                        Comparison::AtMost => ((r + h) - l, l <= r + h),
                        Comparison::Above => (l - (r - h), l > r - h),
                        Comparison::AtLeast => (l - (r - h), l >= r - h),
                        Comparison::Equals => (-(l - r).abs(), l == r),
                        Comparison::Differs => ((l - r).abs(), l != r),
                    };
                    // It begins at the bound and ends at the one that is easier to keep.
                    let easier = hysteresis.unwrap_or(0.0);
                    let (_, truth) = bounds(if was { easier } else { 0.0 });
                    let (robustness, _) = bounds(if truth { easier } else { 0.0 });
                    let known = !robustness.is_nan();
                    was = known && truth;
                    if known { Grade { robustness, holds: truth } } else { Grade::BOTTOM }
                })
            }
            K::IsTrue(port) => every(&mut |t| {
                let v = self.value(&port.to_string(), t);
                Grade::of(!v.is_nan() && v != 0.0)
            }),
            K::Faulted(_) => every(&mut |t| {
                Grade::of(self.faults.iter().rev().find(|(from, _)| *from <= t).is_some_and(|(_, f)| *f))
            }),
            K::Silent { port, time } => every(&mut |t| Grade::of(self.age(&port.to_string(), t) > steps(*time) as i64)),
            K::All(list) => self.each(list, end, Grade::TOP, Grade::and),
            K::Any(list) => self.each(list, end, Grade::BOTTOM, Grade::or),
            K::No(c) => self.evaluate(c, end).into_iter().map(Grade::contrary).collect(),
            K::Implies(a, b) => {
                let (a, b) = (self.evaluate(a, end), self.evaluate(b, end));
                a.into_iter().zip(b).map(|(a, b)| a.contrary().or(b)).collect()
            }
            K::Rise(inner) | K::Fall(inner) => {
                let rise = matches!(c.kind, K::Rise(_));
                let now = self.evaluate(inner, end);
                // What becomes true right behind a nanosecond rises until the next one: there is no first such instant.
                let before = |i: usize| match i % STEPS {
                    0 if i == 0 => Grade::BOTTOM,
                    0 => now[i - 1],
                    phase => now[i - phase],
                };
                let at =
                    |i: usize| if rise { now[i].and(before(i).contrary()) } else { now[i].contrary().and(before(i)) };
                (0..now.len()).map(at).collect()
            }
            K::Once { condition, interval } => {
                let of = self.evaluate(condition, end);
                let largest = |i| of[window(i, interval)].iter().fold(Grade::BOTTOM, |a, b| a.or(*b));
                (0..of.len()).map(largest).collect()
            }
            K::Historically { condition, interval } => {
                let of = self.evaluate(condition, end);
                let smallest = |i| of[window(i, interval)].iter().fold(Grade::TOP, |a, b| a.and(*b));
                (0..of.len()).map(smallest).collect()
            }
            K::Since { hold, from, interval } => {
                let (hold, from) = (self.evaluate(hold, end), self.evaluate(from, end));
                (0..hold.len())
                    .map(|now| {
                        let mut best = Grade::BOTTOM;
                        for u in window(now, interval) {
                            let mut held = hold[u + 1..=now].iter().fold(Grade::TOP, |a, b| a.and(*b));
                            if !(start + u).is_multiple_of(STEPS) && u < now {
                                held = held.and(hold[u]);
                            }
                            best = best.or(from[u].and(held));
                        }
                        best
                    })
                    .collect()
            }
            K::ForAtLeast { condition, time } => {
                let of = self.evaluate(condition, end);
                let long = steps(*time);
                let held = |i: usize| of[i - long..=i].iter().fold(Grade::TOP, |a, b| a.and(*b));
                (0..of.len()).map(|i| if i < long { Grade::BOTTOM } else { held(i) }).collect()
            }
            K::WithinLast { condition, time } => {
                let interval = Interval { from: Duration::ZERO, to: Some(*time) };
                self.evaluate(&Condition::new(K::Once { condition: condition.clone(), interval }), end)
            }
            K::InState { .. } => unreachable!("not generated here"),
        }
    }

    fn each(&self, list: &[Condition], end: usize, empty: Grade, join: fn(Grade, Grade) -> Grade) -> Vec<Grade> {
        let length = end + 1 - self.start as usize * STEPS;
        list.iter().fold(vec![empty; length], |sum, c| {
            sum.into_iter().zip(self.evaluate(c, end)).map(|(a, b)| join(a, b)).collect()
        })
    }
}

fn holds(age: i64, op: Comparison, bound: i64) -> bool {
    match op {
        Comparison::Below => age < bound,
        Comparison::AtMost => age <= bound,
        Comparison::Above => age > bound,
        Comparison::AtLeast => age >= bound,
        Comparison::Equals => age == bound,
        Comparison::Differs => age != bound,
    }
}
