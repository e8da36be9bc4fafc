//! Time events of a run (`docs/rfsm.md` §9): begun on entry, looked at after every microstep.

use super::chart::{Chart, NodeId, TimerRow};
use super::hook::Hook;
use super::machine::Machine;
use super::trace::Trace;
use crate::time::Time;

/// A time event of one visit.
#[derive(Debug, Clone, Copy)]
pub(super) struct ArmedTimer {
    /// When its state was entered.
    entered: Time,
    /// Fires when more nanoseconds than this have passed.
    nanos: i64,
    /// It was, in this visit; or it never is.
    raised: bool,
}

impl ArmedTimer {
    /// Before its state was entered.
    pub(super) fn at_start(timer: &TimerRow) -> Self {
        Self { entered: Time::default(), nanos: timer.nanos, raised: false }
    }
}

impl Machine {
    /// The first moment at which a time event of an active state is due; none if no time event is to come.
    pub fn next_deadline(&self, chart: &Chart) -> Option<Time> {
        if chart.timers.is_empty() {
            return None;
        }
        let chart = self.chart(chart);
        let due = |node: &NodeId| {
            let index = chart.nodes[node.index()].timer;
            let timer = chart.timers.get(index as usize)?;
            let armed = self.timers[index as usize];
            (!armed.raised)
                .then(|| first_after(if timer.relative { armed.entered } else { Time::default() }, armed.nanos))
        };
        self.path.iter().filter_map(due).min()
    }

    pub(super) fn restart_timer(&mut self, chart: &Chart, state: NodeId, now: Time, hook: &mut impl Hook) {
        let index = chart.nodes[state.index()].timer as usize;
        let Some(timer) = chart.timers.get(index) else { return };
        let mut armed = ArmedTimer { entered: now, nanos: timer.nanos, raised: false };
        if let Some(function) = timer.by {
            let seconds = hook.seconds(function, state, &mut self.view(chart)).filter(|s| !s.is_nan());
            armed.raised = seconds.is_none();
            #[allow(clippy::cast_possible_truncation)] // saturates: 292 years
            let nanos = (seconds.unwrap_or_default() * 1e9).round() as i64;
            armed.nanos = nanos;
        }
        self.timers[index] = armed;
    }

    /// After a microstep: time events of the active states that are due, from the leaf outwards, each once a visit. What is
    /// raised here is seen in the next turn, even if this one was idle.
    pub(super) fn check_timers(&mut self, chart: &Chart, now: Time, hook: &mut impl Hook) {
        if chart.timers.is_empty() {
            return;
        }
        for level in (0..self.path.len()).rev() {
            let node = self.path[level];
            let index = chart.nodes[node.index()].timer;
            let Some(timer) = chart.timers.get(index as usize) else { continue };
            let armed = &mut self.timers[index as usize];
            let since = if timer.relative { armed.entered } else { Time::default() };
            if !armed.raised && now >= first_after(since, armed.nanos) {
                armed.raised = true;
                self.trace(chart, Trace::Due(timer.event), hook);
                self.trace(chart, Trace::Raised(timer.event), hook);
                self.queue.push(timer.event);
            }
        }
    }
}

/// The first moment that is *more* than so many nanoseconds after `since`.
fn first_after(since: Time, nanos: i64) -> Time {
    let first = i128::from(since.as_nanos()) + i128::from(nanos) + 1;
    Time(u64::try_from(first.max(0)).unwrap_or(u64::MAX))
}
