//! One run of a chart: rFSM's `step` and `run` (`docs/rfsm.md` §5, §6, §7, §9).

use super::EdgeId;
use super::chart::{ActionOp, Chart, EventId, NONE, NodeId, NodeKind, Span};
use super::hook::{ActionPlace, Doo, Hook, HookContext, Nobody, Raised};
use super::outcome::{MicrostepResult, Mode, RunEnd, Stepped};
use super::queue::Queue;
use super::search::{Around, Search, Straight};
use super::{timers::ArmedTimer, trace::Trace};
use crate::limits;
use crate::time::Time;
use std::sync::Arc;

/// The state of one run of a chart. All of its methods must be given the chart it was made for (or one that grew from it).
#[derive(Debug, Clone)]
pub struct Machine {
    /// Active states from the root inwards; also while a transition is under way.
    pub(super) path: Vec<NodeId>,
    /// rFSM's active leaf: on exit still the old one, on entry none.
    pub(super) leaf: Option<NodeId>,
    pub(super) mode: Mode,
    pub(super) queue: Queue,
    events: Vec<EventId>,
    /// What a hook made of the events of a step.
    changed: Vec<EventId>,
    /// By node: how often it was entered.
    pub(super) visits: Vec<u32>,
    /// By time event.
    pub(super) timers: Vec<ArmedTimer>,
    pub(super) search: Search,
    chain: Vec<NodeId>,
    /// The chart, once the model has added to the one that is given.
    grown: Option<Arc<Chart>>,
}

impl Machine {
    /// A run that has not begun: the first step enters the chart.
    pub fn new(chart: &Chart) -> Self {
        let depth = chart.depth as usize + 1;
        let mut machine = Self {
            path: Vec::with_capacity(depth),
            leaf: None,
            mode: Mode::Done,
            queue: Queue::new(),
            events: Vec::with_capacity(limits::CHART_QUEUE),
            changed: Vec::new(),
            visits: vec![0; chart.nodes.len()],
            timers: chart.timers.iter().map(ArmedTimer::at_start).collect(),
            search: Search::new(chart),
            chain: Vec::with_capacity(depth),
            grown: None,
        };
        machine.queue.push(chart.init);
        machine
    }

    /// The chart it runs: the one given, or what that has become by what the model added to it.
    pub fn chart<'a>(&'a self, given: &'a Chart) -> &'a Chart {
        self.grown.as_deref().unwrap_or(given)
    }

    /// The chart as it is now, when the model has added to it.
    pub fn grown(&self) -> Option<&Arc<Chart>> {
        self.grown.as_ref()
    }

    /// Begins anew: no exit action runs, and the next step enters the chart.
    pub fn reset(&mut self, chart: &Chart) {
        self.path.clear();
        self.leaf = None;
        self.queue.events.clear();
        self.queue.push(chart.init);
    }

    /// Leaves a state and all active ones inside it, innermost first, with their exit actions. What is around it stays
    /// active, with no leaf; nothing happens if it is not active. Once the root was left, the next step enters the chart.
    pub fn leave(&mut self, chart: &Chart, state: NodeId, hook: &mut impl Hook) {
        if self.is_active(chart, state) {
            while self.path.len() > chart.depth(state) {
                self.exit(chart, NodeId::ROOT, hook);
            }
            self.leaf = None;
        }
    }

    /// Queues an event; `false`: the queue is full, and the event is dropped and counted.
    pub fn send(&mut self, event: EventId) -> bool {
        self.queue.push(event)
    }

    /// Forgets the events left for the next step.
    pub fn drop_queue(&mut self) {
        self.queue.events.clear();
    }

    /// Exchanges the events left for the next step.
    pub fn exchange(&mut self, by: impl FnMut(EventId) -> EventId) {
        self.queue.exchange(by);
    }

    /// The events left for the next step.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// The active states, from the root to the leaf; empty before the chart was entered.
    pub fn active(&self) -> &[NodeId] {
        &self.path
    }

    /// The active leaf; none before the chart was entered.
    pub fn leaf(&self) -> Option<NodeId> {
        self.leaf
    }

    /// The mode of the active leaf; none before the chart was entered.
    pub fn mode(&self) -> Option<Mode> {
        self.leaf.map(|_| self.mode)
    }

    /// Whether a state is active.
    pub fn is_active(&self, chart: &Chart, state: NodeId) -> bool {
        self.path.get(self.chart(chart).depth(state)) == Some(&state)
    }

    /// How often a state was entered. While the state is active, this is the number of the present visit.
    pub fn visit(&self, state: NodeId) -> u32 {
        self.visits[state.index()]
    }

    /// Whether the visit of `owner` in which a name was raised is still going on.
    pub fn is_present(&self, chart: &Chart, owner: NodeId, visit: u32) -> bool {
        self.is_active(chart, owner) && self.visit(owner) == visit
    }

    /// How many transitions all searches have looked at so far: what stepping costs, counted.
    pub fn work(&self) -> u64 {
        self.search.work()
    }

    /// Puts the machine into `leaf` as if it had been entered at `now` and had completed: nothing is raised, nothing is
    /// left in the queue. For walking through a chart's reactions without running it.
    ///
    /// # Panics
    /// If `leaf` is no leaf.
    pub fn place(&mut self, chart: &Chart, leaf: NodeId, now: Time) {
        assert_eq!(chart.kind(leaf), NodeKind::Leaf, "only a leaf can be the innermost active state");
        self.path.clear();
        self.queue.events.clear();
        let mut at = Some(leaf);
        while let Some(node) = at {
            self.path.push(node);
            self.visits[node.index()] += 1;
            self.restart_timer(chart, node, now, &mut Nobody);
            at = chart.parent(node);
        }
        self.path.reverse();
        self.leaf = Some(leaf);
        self.mode = if chart.nodes[leaf.index()].doo.is_some() { Mode::Active } else { Mode::Done };
    }

    /// Whether `event`, alone in its step, would take a transition now. Guards and predicates are taken to refuse.
    pub fn would_take(&self, chart: &Chart, event: EventId) -> bool {
        let mut trial = self.clone();
        trial.queue.events.clear();
        trial.queue.push(event);
        trial.triggers(chart)
    }

    /// Whether the events that wait trigger a transition; guards may be called. They wait no more then.
    pub(super) fn triggers(&mut self, chart: &Chart) -> bool {
        self.events.clear();
        std::mem::swap(&mut self.queue.events, &mut self.events);
        self.search.begin();
        (0..self.path.len()).any(|i| self.find(chart, self.path[i].0, &mut Nobody) != NONE)
    }

    /// What rFSM's `step(fsm, steps)` does: microsteps until `steps` of them counted, or nothing is left to do. A microstep whose
    /// events match no transition does not count.
    pub fn step(&mut self, chart: &Chart, now: Time, steps: u64, hook: &mut impl Hook) -> Stepped {
        let mut left = steps;
        let mut transition = false;
        for _ in 0..limits::CHART_RUN.saturating_add(steps) {
            let microstep = self.microstep(chart, now, hook);
            let mut idle = false;
            match microstep {
                MicrostepResult::NotEntered => return Stepped { idle: false, transition, ended: RunEnd::NotEntered },
                MicrostepResult::Entered | MicrostepResult::Taken => {
                    transition = true;
                    left = left.saturating_sub(1);
                }
                MicrostepResult::Unmatched => (),
                MicrostepResult::Quiet { idle: quiet } => {
                    idle = quiet;
                    left = left.saturating_sub(1);
                }
            }
            if left < 1 {
                return Stepped { idle, transition, ended: if idle { RunEnd::Idle } else { RunEnd::Steps } };
            }
            if idle && !hook.go_on() {
                return Stepped { idle, transition, ended: RunEnd::Idle };
            }
        }
        Stepped { idle: false, transition, ended: RunEnd::Endless }
    }

    /// What rFSM's `run(fsm)` does: microsteps until nothing is left to do, but no more than [`limits::CHART_RUN`].
    pub fn run<H: Hook>(&mut self, chart: &Chart, now: Time, hook: &mut H) -> Stepped {
        let mut transition = false;
        for _ in 0..limits::CHART_RUN {
            match self.microstep(chart, now, hook) {
                MicrostepResult::NotEntered => return Stepped { idle: false, transition, ended: RunEnd::NotEntered },
                MicrostepResult::Entered | MicrostepResult::Taken => {
                    transition = true;
                    if self.rest::<H>(chart) {
                        return Stepped { idle: true, transition, ended: RunEnd::Idle };
                    }
                }
                MicrostepResult::Quiet { idle: true } if !hook.go_on() => {
                    return Stepped { idle: true, transition, ended: RunEnd::Idle };
                }
                MicrostepResult::Unmatched | MicrostepResult::Quiet { .. } => (),
            }
        }
        Stepped { idle: false, transition, ended: RunEnd::Endless }
    }

    /// One microstep of the step loop: all events that wait are one set; it is used for at most one transition and then gone.
    pub fn microstep<H: Hook>(&mut self, chart: &Chart, now: Time, hook: &mut H) -> MicrostepResult {
        if !H::MICROSTEPS {
            return self.microstep_in(chart, now, hook);
        }
        let own = self.grown.clone();
        let chart = own.as_deref().unwrap_or(chart);
        self.fit(chart);
        let step = self.microstep_in(chart, now, hook);
        if let Some(grown) = hook.grown(chart, &mut self.queue) {
            self.fit(&grown);
            self.grown = Some(grown);
        }
        step
    }

    /// Makes room for the nodes of a chart that has grown.
    fn fit(&mut self, chart: &Chart) {
        if self.visits.len() < chart.nodes.len() {
            self.visits.resize(chart.nodes.len(), 0);
            self.search.fit(chart);
        }
    }

    fn microstep_in<H: Hook>(&mut self, chart: &Chart, now: Time, hook: &mut H) -> MicrostepResult {
        if !hook.poll(&mut self.queue) {
            return MicrostepResult::Unmatched;
        }
        self.events.clear();
        std::mem::swap(&mut self.queue.events, &mut self.events);
        if H::MICROSTEPS {
            let mut changed = std::mem::take(&mut self.changed);
            changed.clone_from(&self.events);
            if !hook.before_step(&mut self.view(chart), &mut changed) {
                return MicrostepResult::Unmatched;
            }
            self.changed = std::mem::replace(&mut self.events, changed);
        }

        let step = if self.path.is_empty() {
            self.enter_chart(chart, now, hook)
        } else if self.events.is_empty() {
            self.quiet(chart, hook)
        } else {
            self.transit(chart, now, hook)
        };
        if step != MicrostepResult::NotEntered {
            self.check_timers(chart, now, hook);
            hook.after_step(&mut self.view(chart));
        }
        step
    }

    /// Whether the microsteps that are left do nothing; then they count as taken. All that waits is the completion of a leaf
    /// without activity, of which compiling found that it triggers nothing, and time events were looked at already.
    pub fn rest<H: Hook>(&mut self, chart: &Chart) -> bool {
        let Some(leaf) = self.leaf.filter(|_| !H::MICROSTEPS) else { return false };
        let row = &chart.nodes[leaf.index()];
        let rests = row.settles && self.mode == Mode::Done && self.queue.events == [row.done];
        if rests {
            self.queue.events.clear();
        }
        rests
    }

    pub(super) fn view<'a>(&'a mut self, chart: &'a Chart) -> HookContext<'a> {
        HookContext { chart, leaf: self.leaf, events: &self.events, queue: &mut self.queue }
    }

    fn find(&mut self, chart: &Chart, node: u32, hook: &mut impl Hook) -> u32 {
        let mut around = Around { leaf: self.leaf, events: &self.events, queue: &mut self.queue };
        self.search.from(chart, node, &mut around, hook)
    }

    fn enter_chart(&mut self, chart: &Chart, now: Time, hook: &mut impl Hook) -> MicrostepResult {
        self.search.begin();
        let way = self.find(chart, chart.initial, hook);
        if way == NONE {
            hook.not_entered(chart);
            return MicrostepResult::NotEntered;
        }
        self.enter(chart, NodeId::ROOT, now, hook);
        self.trace_path(chart, way, hook);
        self.report(chart, chart.initial, way, hook);
        self.execute(chart, way, now, hook);
        MicrostepResult::Entered
    }

    /// The outermost active state with a complete path wins, whatever the priorities further in.
    fn transit(&mut self, chart: &Chart, now: Time, hook: &mut impl Hook) -> MicrostepResult {
        self.search.begin();
        self.trace(chart, Trace::Searching, hook);
        for i in 0..self.path.len() {
            let node = self.path[i];
            self.trace(chart, Trace::Checking(node), hook);
            if chart.nodes[node.index()].out.len == 0 {
                continue;
            }
            // By far the most transitions lead from a state straight to a leaf; these need no tree of ways.
            if chart.unguarded {
                match self.search.straight(chart, node.0, &self.events) {
                    Straight::None => continue,
                    Straight::Leaf(edge) => {
                        self.trace(chart, Trace::Path(&[EdgeId(edge)]), hook);
                        hook.taking(chart, EdgeId(edge));
                        let row = &chart.edges[edge as usize];
                        self.segment(chart, edge, NodeId(row.lca), now, hook);
                        return MicrostepResult::Taken;
                    }
                    Straight::Unclear => (),
                }
            }
            let way = self.find(chart, node.0, hook);
            if way != NONE {
                self.trace_path(chart, way, hook);
                self.execute(chart, way, now, hook);
                return MicrostepResult::Taken;
            }
        }
        self.trace(chart, Trace::NotFound, hook);
        MicrostepResult::Unmatched
    }

    fn quiet(&mut self, chart: &Chart, hook: &mut impl Hook) -> MicrostepResult {
        let mut idle = true;
        if let Some(leaf) = self.leaf
            && self.mode == Mode::Active
            && let Some(function) = chart.nodes[leaf.index()].doo
        {
            match hook.doo(function, leaf, &mut self.view(chart)) {
                Doo::Yielded { idle: content } => idle = content,
                Doo::Finished => {
                    self.mode = Mode::Done;
                    let done = chart.nodes[leaf.index()].done;
                    self.trace(chart, Trace::Raised(done), hook);
                    self.queue.push(done);
                }
                Doo::Failed => self.mode = Mode::Done,
            }
        }
        if idle {
            idle = hook.poll(&mut self.queue) && self.queue.events.is_empty();
        }
        MicrostepResult::Quiet { idle }
    }

    /// Takes the path that begins with `way`, segment by segment, to a leaf.
    fn execute(&mut self, chart: &Chart, mut way: u32, now: Time, hook: &mut impl Hook) {
        let owner = self.owner_of(chart, way);
        loop {
            let taken = self.search.ways[way as usize];
            hook.taking(chart, EdgeId(taken.edge));
            if self.segment(chart, taken.edge, owner, now, hook) {
                return;
            }
            way = taken.then;
            self.report(chart, chart.edges[taken.edge as usize].tgt, way, hook);
        }
    }

    /// At a connector the first of its ways is taken; where there are more, that is a conflict.
    fn report(&mut self, chart: &Chart, connector: u32, way: u32, hook: &mut impl Hook) {
        let ways = &self.search.ways;
        if ways[way as usize].other != NONE {
            let mut at = way;
            let mut all = std::iter::from_fn(|| {
                let way = ways.get(at as usize)?;
                at = way.other;
                Some(EdgeId(way.edge))
            });
            hook.conflict(chart, NodeId(connector), &mut all);
        }
    }

    /// Takes one transition: exits, effect, entries. Answers whether it ended in a leaf.
    fn segment(&mut self, chart: &Chart, edge: u32, owner: NodeId, now: Time, hook: &mut impl Hook) -> bool {
        let row = &chart.edges[edge as usize];
        let keep = row.keep as usize;
        self.trace(chart, Trace::Leaving(EdgeId(edge)), hook);
        while self.path.len() > keep {
            self.exit(chart, owner, hook);
        }
        self.trace(chart, Trace::Effect(EdgeId(edge)), hook);
        if row.effect.len > 0 {
            self.act(chart, row.effect, ActionPlace::Effect(EdgeId(edge)), owner, hook);
        }
        self.trace(chart, Trace::Entering(EdgeId(edge)), hook);
        let target = &chart.nodes[row.tgt as usize];
        let into = if target.kind == NodeKind::Connector { target.parent } else { row.tgt };
        let depth = chart.nodes[into as usize].depth as usize;
        if depth == keep {
            self.enter(chart, NodeId(into), now, hook);
        } else if depth > keep {
            self.enter_down_to(chart, into, now, hook);
        }
        target.kind != NodeKind::Connector
    }

    /// Who owns what the exits and effects of the path raise: the outermost of its least common ancestors, which stays
    /// active throughout.
    fn owner_of(&self, chart: &Chart, mut way: u32) -> NodeId {
        let mut owner = NONE;
        while way != NONE {
            let taken = self.search.ways[way as usize];
            let lca = chart.edges[taken.edge as usize].lca;
            if owner == NONE || chart.nodes[lca as usize].depth < chart.nodes[owner as usize].depth {
                owner = lca;
            }
            way = taken.then;
        }
        NodeId(owner)
    }

    /// Leaves the innermost active state. When its exit actions run it is inactive already.
    fn exit(&mut self, chart: &Chart, owner: NodeId, hook: &mut impl Hook) {
        let Some(state) = self.path.pop() else { return };
        hook.exited(chart, state);
        let row = &chart.nodes[state.index()];
        self.act(chart, row.exit, ActionPlace::Exit(state), owner, hook);
        if row.kind == NodeKind::Leaf {
            self.leaf = None;
        }
        self.trace(chart, Trace::Left(state), hook);
    }

    /// Enters all states from below the innermost active one down to `state`.
    fn enter_down_to(&mut self, chart: &Chart, state: u32, now: Time, hook: &mut impl Hook) {
        let mut chain = std::mem::take(&mut self.chain);
        let mut at = state;
        while chart.nodes[at as usize].depth as usize >= self.path.len() {
            chain.push(NodeId(at));
            at = chart.nodes[at as usize].parent;
        }
        while let Some(next) = chain.pop() {
            self.enter(chart, next, now, hook);
        }
        self.chain = chain;
    }

    fn enter(&mut self, chart: &Chart, state: NodeId, now: Time, hook: &mut impl Hook) {
        self.path.push(state);
        self.visits[state.index()] = self.visits[state.index()].wrapping_add(1);
        self.restart_timer(chart, state, now, hook);
        hook.entered(chart, state);
        let row = &chart.nodes[state.index()];
        self.act(chart, row.entry, ActionPlace::Entry(state), state, hook);
        if row.kind == NodeKind::Leaf {
            self.leaf = Some(state);
            if row.doo.is_some() {
                self.mode = Mode::Active;
                hook.doo_reset(state);
            } else {
                self.mode = Mode::Done;
                self.trace(chart, Trace::Raised(row.done), hook);
                self.queue.push(row.done);
            }
        }
        self.trace(chart, Trace::Entered(state), hook);
    }

    fn act(&mut self, chart: &Chart, ops: Span, place: ActionPlace, owner: NodeId, hook: &mut impl Hook) {
        for op in ops.of(&chart.ops) {
            match *op {
                ActionOp::Raise(name) | ActionOp::RaiseScoped(name) => {
                    let (visit, scope) = (self.visits[owner.index()], op.scope(place));
                    hook.raised(chart, Raised { name, owner, visit, scope });
                }
                ActionOp::Call(function) => hook.action(function, place, &mut self.view(chart)),
            }
        }
    }
}
