//! From a condition as written to a program.

use super::bank::{MonitorInput, state_value};
use super::nodes::{Number, Rate, TruthNode};
use super::program::CompiledCondition;
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
        self.numbers.push(number);
        self.numbers.len() - 1
    }

    fn truth(&mut self, truth: TruthNode) -> usize {
        self.truths.push(truth);
        self.truths.len() - 1
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
