//! From a condition as written to a program.

use super::nodes::{Number, Rate, TruthNode};
use super::program::CompiledCondition;
use super::sample::{MonitorInput, state_value};
use super::window::{SinceWindow, Window};
use crate::limits::MONITOR_PIECES;
use crate::model::monitor::{Comparison, Condition, ConditionKind, Interval, MonitoredSignal, SignalKind};
use std::time::Duration;

/// A time in positions.
pub fn positions(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX).saturating_mul(2)
}

/// Compiles a condition. The inputs that its samples come from are answered in the order of its slots, each with whether
/// its value matters, or only when it comes.
///
/// What must be merged because the memory of an operator is used up makes the whole condition less true, never more: an
/// event is raised only when it would be with all the memory in the world. Under an odd number of negations an operator
/// therefore errs to the other side.
pub fn compile(condition: &Condition, pieces: usize) -> (CompiledCondition, Vec<(MonitorInput, bool)>) {
    let mut compiler = Compiler { numbers: Vec::new(), truths: Vec::new(), slots: Vec::new(), pieces };
    compiler.condition(condition, false);
    (CompiledCondition::new(compiler.numbers, compiler.truths), compiler.slots)
}

/// Pieces an operator keeps where nothing else is said.
pub const PIECES: usize = MONITOR_PIECES;

struct Compiler {
    numbers: Vec<Number>,
    truths: Vec<TruthNode>,
    slots: Vec<(MonitorInput, bool)>,
    pieces: usize,
}

/// Where a part stands that is made like this one, or the place of this one, now the last. Parts that are made alike of the same parts have
/// the same history and are the same at every position: a condition that stands in several places of another one (with a name in Lua
/// that is quickly so: each use of it is one more copy) is evaluated once. No part is a part of itself, so the condition itself still comes last.
fn known_or_new<T: PartialEq>(parts: &mut Vec<T>, part: T) -> usize {
    parts.iter().position(|known| *known == part).unwrap_or_else(|| {
        parts.push(part);
        parts.len() - 1
    })
}

impl Compiler {
    fn slot(&mut self, input: MonitorInput) -> usize {
        self.slots.iter().position(|(known, _)| *known == input).unwrap_or_else(|| {
            self.slots.push((input, false));
            self.slots.len() - 1
        })
    }

    /// The slot of an input whose value is looked at.
    fn valued(&mut self, input: MonitorInput) -> usize {
        let slot = self.slot(input);
        self.slots[slot].1 = true;
        slot
    }

    fn number(&mut self, number: Number) -> usize {
        known_or_new(&mut self.numbers, number)
    }

    fn truth(&mut self, truth: TruthNode) -> usize {
        known_or_new(&mut self.truths, truth)
    }

    fn signals(&mut self, list: &[MonitoredSignal]) -> Box<[usize]> {
        list.iter().map(|s| self.signal(s)).collect()
    }

    fn signal(&mut self, signal: &MonitoredSignal) -> usize {
        let number = match &signal.kind {
            SignalKind::Port(port) => Number::Input(self.valued(MonitorInput::Port(port.clone()))),
            // Compared directly only; `lang` sees to it. Elsewhere an age has no value.
            SignalKind::Age(_) => Number::Constant(f64::NAN),
            SignalKind::Rate { port, over } => {
                let slot = self.slot(MonitorInput::whole(*port));
                Number::Rate(slot, Rate::new(positions(*over), self.pieces))
            }
            SignalKind::Activity { activity, counter } => {
                Number::Input(self.valued(MonitorInput::Activity { activity: *activity, counter: *counter }))
            }
            SignalKind::Norm(list) => Number::Norm(self.signals(list)),
            SignalKind::Difference(a, b) => Number::Difference(self.signal(a), self.signal(b)),
            SignalKind::Min(list) => Number::Min(self.signals(list)),
            SignalKind::Max(list) => Number::Max(self.signals(list)),
            SignalKind::Abs(s) => Number::Abs(self.signal(s)),
            SignalKind::Constant(v) => Number::Constant(*v),
        };
        self.number(number)
    }

    fn conditions(&mut self, list: &[Condition], upward: bool) -> Box<[usize]> {
        list.iter().map(|c| self.condition(c, upward)).collect()
    }

    /// `upward`: merging may make it more true, not less.
    fn condition(&mut self, condition: &Condition, upward: bool) -> usize {
        use ConditionKind as K;
        let truth = match &condition.kind {
            K::Compare { left, op, right, hysteresis } => match (&left.kind, &right.kind) {
                (SignalKind::Age(port), SignalKind::Constant(seconds)) => {
                    // To the nanosecond; what is out of range is never reached, or always exceeded.
                    #[allow(clippy::cast_possible_truncation)]
                    let bound = (seconds * 1e9).round().clamp(-4e18, 4e18) as i64;
                    let slot = self.slot(MonitorInput::whole(*port));
                    TruthNode::Age { slot, op: *op, bound: bound.saturating_mul(2), start: None }
                }
                _ => {
                    let (left, right) = (self.signal(left), self.signal(right));
                    let hysteresis = hysteresis.unwrap_or(0.0);
                    TruthNode::Compare { left, op: *op, right, hysteresis, holds: false }
                }
            },
            K::IsTrue(port) => TruthNode::IsTrue(self.valued(MonitorInput::Port(port.clone()))),
            K::InState { component, state } => {
                TruthNode::Is(self.valued(MonitorInput::State(*component)), state_value(*state))
            }
            K::Faulted(component) => TruthNode::IsTrue(self.valued(MonitorInput::Faulted(*component))),
            K::Silent { port, time } => {
                let slot = self.slot(MonitorInput::whole(*port));
                let bound = i64::try_from(positions(*time)).unwrap_or(i64::MAX);
                TruthNode::Age { slot, op: Comparison::Above, bound, start: None }
            }
            K::All(list) => TruthNode::All(self.conditions(list, upward)),
            K::Any(list) => TruthNode::Any(self.conditions(list, upward)),
            K::No(c) => TruthNode::Not(self.condition(c, !upward)),
            K::Implies(a, b) => {
                let first = self.condition(a, !upward);
                let no = self.truth(TruthNode::Not(first));
                TruthNode::Any(Box::new([no, self.condition(b, upward)]))
            }
            K::Rise(c) => TruthNode::Rise(self.condition(c, upward), None),
            K::Fall(c) => TruthNode::Fall(self.condition(c, !upward), None),
            K::Once { condition, interval } => self.once(condition, *interval, upward),
            K::Historically { condition, interval } => self.historically(condition, *interval, upward),
            K::Since { hold, from, interval } => self.since(hold, from, *interval, upward),
            K::ForAtLeast { condition, time } => {
                let interval = Interval { from: Duration::ZERO, to: Some(*time) };
                let held = self.historically(condition, interval, upward);
                let held = self.truth(held);
                let lived = self.truth(TruthNode::Lived(positions(*time), None));
                TruthNode::All(Box::new([held, lived]))
            }
            K::WithinLast { condition, time } => {
                self.once(condition, Interval { from: Duration::ZERO, to: Some(*time) }, upward)
            }
        };
        self.truth(truth)
    }

    fn window(&self, interval: Interval, upward: bool) -> Window {
        let (newest, oldest) = ends(interval);
        Window::new(newest, oldest, false, self.pieces, upward)
    }

    fn once(&mut self, condition: &Condition, interval: Interval, upward: bool) -> TruthNode {
        let of = self.condition(condition, upward);
        TruthNode::Once(of, self.window(interval, upward))
    }

    fn historically(&mut self, condition: &Condition, interval: Interval, upward: bool) -> TruthNode {
        let of = self.condition(condition, upward);
        TruthNode::Historically(of, self.window(interval, !upward))
    }

    /// With a newer end `a` ago: what the operator with the interval up to now was `a` ago, and `hold` at every instant
    /// after that one.
    fn since(&mut self, hold: &Condition, from: &Condition, interval: Interval, upward: bool) -> TruthNode {
        let (hold, from) = (self.condition(hold, upward), self.condition(from, upward));
        let (newest, oldest) = ends(interval);
        let length = if oldest == u64::MAX { oldest } else { oldest.saturating_sub(newest) };
        let since = TruthNode::Since(hold, from, SinceWindow::new(length, self.pieces, upward));
        if newest == 0 {
            return since;
        }
        let since = self.truth(since);
        let then = self.truth(TruthNode::Once(since, Window::new(newest, newest, false, self.pieces, upward)));
        let after = self.truth(TruthNode::Historically(hold, Window::new(0, newest, true, self.pieces, !upward)));
        TruthNode::All(Box::new([then, after]))
    }
}

fn ends(interval: Interval) -> (u64, u64) {
    (positions(interval.from), interval.to.map_or(u64::MAX, positions))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::MemberRef;

    /// What an operator over time keeps is what it costs.
    #[test]
    fn what_stands_in_several_places_is_evaluated_once() {
        let above = |bound: f64| {
            let port = MonitorInput::whole(MemberRef::new("A.x").unwrap());
            let MonitorInput::Port(port) = port else { unreachable!("a port") };
            Condition::new(ConditionKind::Compare {
                left: MonitoredSignal::new(SignalKind::Port(port)),
                op: Comparison::Above,
                right: MonitoredSignal::new(SignalKind::Constant(bound)),
                hysteresis: None,
            })
        };
        let lasts = |condition: &Condition, seconds| {
            let time = Duration::from_secs(seconds);
            Condition::new(ConditionKind::ForAtLeast { condition: Box::new(condition.clone()), time })
        };
        let no = |condition: &Condition| Condition::new(ConditionKind::No(Box::new(condition.clone())));
        let all = |list: &[&Condition]| Condition::new(ConditionKind::All(list.iter().copied().cloned().collect()));
        let parts = |condition: &Condition| compile(condition, PIECES).0.parts();
        let (x, y) = (above(1.0), above(2.0));
        // The port, a bound; the comparison, what was so for so long, that the history is as long, both.
        assert_eq!(parts(&lasts(&x, 1)), (2, 4));
        let twice = all(&[&lasts(&x, 1), &x, &lasts(&x, 1)]);
        assert_eq!(parts(&twice), (2, 5));
        assert_eq!(parts(&all(&[&twice, &x, &twice])), (2, 6));
        // Another bound or time is another part, and so is what errs to the other side when its memory is used up.
        assert_eq!(parts(&all(&[&x, &y])), (3, 3));
        assert_eq!(parts(&all(&[&lasts(&x, 1), &lasts(&x, 2)])), (2, 8));
        assert_eq!(parts(&all(&[&lasts(&x, 1), &no(&lasts(&x, 1))])), (2, 8));
    }
}
