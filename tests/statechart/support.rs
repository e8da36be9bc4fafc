//! Charts in a few words, and a machine that notes what it does.

use davit::model::finding::{Finding, Origin};
use davit::model::names::{ConfigId, EventName, Ident};
use davit::model::statechart::{Action, ChartNode, ChartTransition, Connector, State, Statechart, Trigger};
use davit::statechart::{Chart, Observation, Sim, compile};

/// A piece of a state.
pub enum Part {
    Child(ChartNode),
    Trans(ChartTransition),
    Entry(&'static str),
    Exit(&'static str),
    Config(&'static str),
}

pub fn state(name: &str, parts: Vec<Part>) -> State {
    let mut state = State::new(Ident::new(name).unwrap());
    for part in parts {
        match part {
            Part::Child(node) => state.children.push(node),
            Part::Trans(transition) => state.transitions.push(transition),
            Part::Entry(name) => state.entry.push(raise(name)),
            Part::Exit(name) => state.exit.push(raise(name)),
            Part::Config(id) => state.config.push((ConfigId::new(id).unwrap(), Origin::NONE)),
        }
    }
    state
}

pub fn raise(name: &str) -> (Action, Origin) {
    (Action::Raise(EventName::new(name).unwrap()), Origin::NONE)
}

/// A child state.
pub fn s(name: &str, parts: Vec<Part>) -> Part {
    Part::Child(ChartNode::State(state(name, parts)))
}

/// A child connector.
pub fn c(name: &str) -> Part {
    Part::Child(ChartNode::Connector(Connector::new(Ident::new(name).unwrap())))
}

/// A transition on any of the events, separated by blanks; none: on any event.
pub fn t(src: &str, tgt: &str, events: &str) -> Part {
    Part::Trans(transition(src, tgt, events))
}

/// The same with a priority number and a name raised as its effect.
pub fn tx(src: &str, tgt: &str, events: &str, pn: f64, effect: &str) -> Part {
    let mut t = transition(src, tgt, events);
    t.pn = pn;
    t.effect = effect.split_whitespace().map(raise).collect();
    Part::Trans(t)
}

pub fn transition(src: &str, tgt: &str, events: &str) -> ChartTransition {
    ChartTransition::new(src, tgt, events.split_whitespace().map(|e| Trigger::parse(e).unwrap()))
}

pub fn root(parts: Vec<Part>) -> Statechart {
    Statechart::new(state("root", parts))
}

/// The compiled chart; panics when it is refused.
pub fn compiled(parts: Vec<Part>) -> Chart {
    let (chart, findings) = compile(&root(parts));
    chart.unwrap_or_else(|| panic!("refused: {findings:#?}"))
}

/// What compiling finds, errors and warnings.
pub fn findings(parts: Vec<Part>) -> Vec<Finding> {
    let (chart, findings) = compile(&root(parts));
    assert_eq!(chart.is_none(), findings.iter().any(Finding::is_error), "a chart exactly when there is no error");
    findings
}

/// One line, which must be understood.
pub fn line(sim: &mut Sim<'_>, text: &str) -> Observation {
    sim.line(text).unwrap()
}

/// The active leaf after a line.
pub fn leaf_after(sim: &mut Sim<'_>, text: &str) -> String {
    line(sim, text).active.last().cloned().unwrap_or_default()
}

/// What was done by a line, in short: `a+` entered, `a-` left, other words raised. Own names, not full ones.
pub fn trace_of(sim: &mut Sim<'_>, text: &str) -> String {
    short(&line(sim, text))
}

pub fn short(observation: &Observation) -> String {
    let own = |fqn: &str| fqn.rsplit('.').next().unwrap().to_owned();
    let words = observation.actions.iter().map(|action| match action.split_once(' ') {
        Some(("entry", fqn)) => format!("{}+", own(fqn)),
        Some(("exit", fqn)) => format!("{}-", own(fqn)),
        Some(("raise", name)) => name.to_owned(),
        _ => panic!("{action}"),
    });
    words.collect::<Vec<_>>().join(" ")
}
