//! Functions for models that are not pure, written in the test: the engine calls them through its hook.

use davit::model::finding::Origin;
use davit::model::names::EventName;
use davit::model::statechart::{Action, FunctionId, Statechart};
use davit::statechart::{
    ActionPlace, Chart, Doo, EdgeId, EventId, Hook, HookContext, Machine, MicrostepResult, NodeId, Queue, Raised,
    compile,
};
use davit::time::Time;
use std::collections::{BTreeMap, VecDeque};

/// A function of a model: says what to answer, may send events.
type Body = Box<dyn FnMut(&mut HookContext<'_>) -> i32>;

/// Calls the functions by number and notes everything.
#[derive(Default)]
pub struct Scripted {
    pub log: Vec<String>,
    pub functions: BTreeMap<u32, Body>,
    /// What waits outside, one entry a call.
    pub outside: VecDeque<Vec<EventId>>,
    pub polled: usize,
    pub go_on: usize,
    pub sets: Vec<Vec<String>>,
    /// The active states, from the root inwards.
    path: Vec<NodeId>,
}

/// What a scripted `doo` answers.
pub const BUSY: i32 = 0;
pub const IDLE: i32 = 1;
pub const FINISHED: i32 = 2;
pub const FAILED: i32 = 3;

impl Scripted {
    pub fn function(mut self, id: u32, body: impl FnMut(&mut HookContext<'_>) -> i32 + 'static) -> Self {
        self.functions.insert(id, Box::new(body));
        self
    }

    /// What was noted since the last call, in one line.
    pub fn take(&mut self) -> String {
        std::mem::take(&mut self.log).join(" ")
    }

    fn call(&mut self, id: FunctionId, view: &mut HookContext<'_>) -> i32 {
        self.functions.get_mut(&id.0).map_or(0, |body| body(view))
    }
}

impl Hook for Scripted {
    fn entered(&mut self, chart: &Chart, state: NodeId) {
        self.log.push(format!("{}+", chart.name(state)));
        self.path.push(state);
    }

    fn exited(&mut self, chart: &Chart, state: NodeId) {
        self.log.push(format!("{}-", chart.name(state)));
        self.path.pop();
    }

    fn raised(&mut self, _: &Chart, raised: Raised) {
        self.log.push(raised.name.to_string());
    }

    fn poll(&mut self, queue: &mut Queue) -> bool {
        self.polled += 1;
        for event in self.outside.pop_front().unwrap_or_default() {
            queue.push(event);
        }
        true
    }

    fn before_step(&mut self, view: &mut HookContext<'_>, _: &mut Vec<EventId>) -> bool {
        self.sets.push(view.events.iter().map(|e| view.chart.event_text(*e)).collect());
        true
    }

    fn guard(&mut self, function: FunctionId, _: EdgeId, view: &mut HookContext<'_>) -> bool {
        self.log.push(format!("g{}", function.0));
        self.call(function, view) != 0
    }

    fn predicate(&mut self, function: FunctionId, event: EventId, view: &mut HookContext<'_>) -> bool {
        self.log.push(format!("p{}({})", function.0, view.chart.event_text(event)));
        self.call(function, view) != 0
    }

    fn action(&mut self, function: FunctionId, place: ActionPlace, view: &mut HookContext<'_>) {
        let active = self.path.last().map_or("none".to_owned(), |n| view.chart.name(*n).to_string());
        let leaf = view.leaf.map_or("none".to_owned(), |n| view.chart.name(n).to_string());
        let place = match place {
            ActionPlace::Entry(_) => "entry",
            ActionPlace::Exit(_) => "exit",
            ActionPlace::Effect(_) => "effect",
        };
        self.log.push(format!("{place}{}[{active},{leaf}]", function.0));
        self.call(function, view);
    }

    fn doo_reset(&mut self, state: NodeId) {
        self.log.push(format!("reset{}", state.index()));
    }

    fn doo(&mut self, function: FunctionId, _: NodeId, view: &mut HookContext<'_>) -> Doo {
        self.log.push(format!("doo{}", function.0));
        match self.call(function, view) {
            BUSY => Doo::Yielded { idle: false },
            IDLE => Doo::Yielded { idle: true },
            FINISHED => Doo::Finished,
            _ => Doo::Failed,
        }
    }

    fn conflict(&mut self, chart: &Chart, connector: NodeId, ways: &mut dyn Iterator<Item = EdgeId>) {
        let targets: Vec<String> = ways.map(|edge| chart.fqn(chart.ends(edge).1).to_string()).collect();
        self.log.push(format!("conflict {}: {}", chart.fqn(connector), targets.join(",")));
    }

    fn not_entered(&mut self, _: &Chart) {
        self.log.push("not-entered".to_owned());
    }

    fn runaway(&mut self, chart: &Chart, connector: NodeId) {
        self.log.push(format!("runaway {}", chart.fqn(connector)));
    }

    fn go_on(&mut self) -> bool {
        self.go_on = self.go_on.saturating_sub(1);
        self.go_on > 0
    }
}

/// A chart and its run, with functions.
pub struct Run {
    pub chart: Chart,
    pub machine: Machine,
    pub hook: Scripted,
}

impl Run {
    pub fn of(model: &Statechart, hook: Scripted) -> Self {
        let (chart, findings) = compile(model);
        let chart = chart.unwrap_or_else(|| panic!("refused: {findings:#?}"));
        Self { machine: Machine::new(&chart), chart, hook }
    }

    pub fn event(&self, text: &str) -> EventId {
        self.chart.event(EventName::new(text).unwrap())
    }

    pub fn send(&mut self, events: &str) {
        for event in events.split_whitespace() {
            let event = self.event(event);
            self.machine.send(event);
        }
    }

    /// `step(fsm, n)`: what it returns.
    pub fn step(&mut self, n: u64) -> bool {
        self.machine.step(&self.chart, Time(0), n, &mut self.hook).idle
    }

    pub fn run(&mut self) -> bool {
        self.machine.run(&self.chart, Time(0), &mut self.hook).idle
    }

    pub fn microstep(&mut self) -> MicrostepResult {
        self.machine.microstep(&self.chart, Time(0), &mut self.hook)
    }

    pub fn leaf(&self) -> String {
        self.machine.leaf().map_or(String::new(), |leaf| self.chart.fqn(leaf).to_string())
    }
}

pub fn call(id: u32) -> (Action, Origin) {
    (Action::Function(FunctionId(id)), Origin::NONE)
}

pub fn function(id: u32) -> Option<(FunctionId, Origin)> {
    Some((FunctionId(id), Origin::NONE))
}
