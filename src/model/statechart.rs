//! Statecharts, as written: what a coordinator is before it is compiled (semantics: *Coordinators*, the semantics of rFSM).
//!
//! Nothing is resolved here. A transition keeps the texts of its source and target, in the scope in which it was written;
//! `crate::statechart::compile` resolves them and says what is wrong. The order of things matters and is kept: of
//! transitions in a scope, of children in a state (rFSM goes through a state's positional entries first, then through
//! its named children; there in an order of its own, here as written), and of names raised by one action list.

use super::finding::Origin;
use super::names::{ConfigId, EventName, Ident, NameError};
use super::words::words;
use std::fmt;

/// A hierarchical statechart.
#[derive(Debug, Clone, PartialEq)]
pub struct Statechart {
    /// The outermost state. Its name is `root`, whatever it was called in the file.
    pub root: State,
    /// Functions that are not the model's own: a plugin of rFSM added them, of this name.
    pub plugins: Vec<(FunctionId, String)>,
}

impl Statechart {
    /// A chart of that outermost state.
    pub fn new(root: State) -> Self {
        Self { root, plugins: Vec::new() }
    }

    /// Whether nothing in it is a function: a *pure* coordinator (semantics: *Coordinators*).
    pub fn is_pure(&self) -> bool {
        self.root.is_pure()
    }

    /// Whether something in it raises that name.
    pub fn raises(&self, name: &str) -> bool {
        let is = |action: &(Action, Origin)| matches!(action.0, Action::Raise(raised) if raised.as_str() == name);
        self.root.any(&|state| {
            let effects = state.transitions.iter().flat_map(|transition| &transition.effect);
            state.entry.iter().chain(&state.exit).chain(effects).any(is)
        })
    }

    /// The events that transitions wait for, as often as they are listed.
    pub fn waited_for(&self) -> Vec<EventName> {
        let mut all = Vec::new();
        self.root.for_each(&mut |state| {
            let triggers = state.transitions.iter().flat_map(|transition| &transition.events);
            all.extend(triggers.filter_map(|(of, _)| if let Trigger::Event(event) = of { Some(*event) } else { None }));
        });
        all
    }

    /// The names that it raises, as often as they are listed.
    pub fn raised(&self) -> Vec<EventName> {
        let mut all = Vec::new();
        self.root.for_each(&mut |state| {
            let effects = state.transitions.iter().flat_map(|transition| &transition.effect);
            let actions = state.entry.iter().chain(effects).chain(&state.exit);
            all.extend(actions.filter_map(|(of, _)| if let Action::Raise(name) = of { Some(*name) } else { None }));
        });
        all
    }

    /// Whether a transition waits for an event of that name.
    pub fn waits_for(&self, name: &str) -> bool {
        let is = |trigger: &(Trigger, Origin)| matches!(&trigger.0, Trigger::Event(event) if event.as_str() == name);
        self.root.any(&|state| state.transitions.iter().flat_map(|transition| &transition.events).any(is))
    }
}

impl Default for Statechart {
    fn default() -> Self {
        Self::new(State::new(Ident::new(ROOT).expect("`root` is a name")))
    }
}

/// The name of the outermost state.
pub const ROOT: &str = "root";

/// The name of the connector at which a composite state is entered.
pub const INITIAL: &str = "initial";

/// A state: a *leaf* when it has no child node, else *composite*.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// Its name in its parent.
    pub name: Ident,
    /// Child states and connectors, as written.
    pub children: Vec<ChartNode>,
    /// The transitions written in this state's scope, as written. Their source need not be a child.
    pub transitions: Vec<ChartTransition>,
    /// What happens on entry, in this order.
    pub entry: Vec<(Action, Origin)>,
    /// What happens on exit, in this order.
    pub exit: Vec<(Action, Origin)>,
    /// Configurations in force while the state is active: pushed after `entry` in this order, popped before `exit` in the
    /// reverse order (semantics: *The stack*).
    pub config: Vec<(ConfigId, Origin)>,
    /// The activity of a leaf: a function that may yield.
    pub doo: Option<(FunctionId, Origin)>,
    /// What it is for.
    pub doc: Option<String>,
    /// Where it was written.
    pub origin: Origin,
}

impl State {
    /// A state with nothing in it.
    pub fn new(name: Ident) -> Self {
        Self {
            name,
            children: Vec::new(),
            transitions: Vec::new(),
            entry: Vec::new(),
            exit: Vec::new(),
            config: Vec::new(),
            doo: None,
            doc: None,
            origin: Origin::NONE,
        }
    }

    /// Whether neither it nor anything inside is a function.
    pub fn is_pure(&self) -> bool {
        self.doo.is_none()
            && self.entry.iter().chain(&self.exit).all(|(action, _)| action.is_pure())
            && self.transitions.iter().all(ChartTransition::is_pure)
            && self.children.iter().all(|child| match child {
                ChartNode::State(state) => state.is_pure(),
                ChartNode::Connector(_) => true,
            })
    }

    /// Goes through it and the states inside, outer ones first.
    fn for_each<'a>(&'a self, f: &mut impl FnMut(&'a Self)) {
        f(self);
        for child in &self.children {
            if let ChartNode::State(state) = child {
                state.for_each(f);
            }
        }
    }

    /// Whether something is so of it or of a state inside.
    fn any(&self, is: &impl Fn(&Self) -> bool) -> bool {
        let inside = |child: &ChartNode| matches!(child, ChartNode::State(state) if state.any(is));
        is(self) || self.children.iter().any(inside)
    }

    /// Its own functions, each with the key of the part it stands in.
    pub fn functions(&self) -> Vec<(&'static str, FunctionId)> {
        let of = |key, actions: &[(Action, Origin)]| {
            actions.iter().filter_map(move |(action, _)| Some((key, action.function()?))).collect::<Vec<_>>()
        };
        let mut all = of("entry", &self.entry);
        all.extend(self.doo.map(|(function, _)| ("doo", function)));
        all.extend(of("exit", &self.exit));
        all
    }

    /// Visits the place of everything in it.
    pub fn places(&mut self, visit: &mut impl FnMut(&mut Origin)) {
        visit(&mut self.origin);
        self.entry.iter_mut().chain(&mut self.exit).for_each(|(_, origin)| visit(origin));
        self.config.iter_mut().for_each(|(_, origin)| visit(origin));
        self.doo.iter_mut().for_each(|(_, origin)| visit(origin));
        for transition in &mut self.transitions {
            visit(&mut transition.origin);
            transition.src.iter_mut().chain(&mut transition.tgt).for_each(|(_, origin)| visit(origin));
            transition.events.iter_mut().for_each(|(_, origin)| visit(origin));
            transition.guard.iter_mut().for_each(|(_, origin)| visit(origin));
            transition.effect.iter_mut().for_each(|(_, origin)| visit(origin));
        }
        for child in &mut self.children {
            match child {
                ChartNode::State(state) => state.places(visit),
                ChartNode::Connector(connector) => visit(&mut connector.origin),
            }
        }
    }

    /// The child of that name.
    pub fn child(&self, name: &str) -> Option<&ChartNode> {
        self.children.iter().find(|child| child.name().as_str() == name)
    }
}

/// A child of a state.
#[derive(Debug, Clone, PartialEq)]
pub enum ChartNode {
    /// A state.
    State(State),
    /// A connector: a junction where transitions meet and part.
    Connector(Connector),
}

impl ChartNode {
    /// Its name in its parent.
    pub fn name(&self) -> Ident {
        match self {
            Self::State(state) => state.name,
            Self::Connector(connector) => connector.name,
        }
    }

    /// Where it was written.
    pub fn origin(&self) -> Origin {
        match self {
            Self::State(state) => state.origin,
            Self::Connector(connector) => connector.origin,
        }
    }
}

/// A connector. `initial` need not be written: it is made where a transition of that source needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Connector {
    /// Its name in its parent.
    pub name: Ident,
    /// What it is for.
    pub doc: Option<String>,
    /// Where it was written.
    pub origin: Origin,
}

impl Connector {
    /// A connector.
    pub fn new(name: Ident) -> Self {
        Self { name, doc: None, origin: Origin::NONE }
    }
}

/// A transition, in the scope in which it was written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ChartTransition {
    /// The text that names its source: a name of the scope (`copying`), a path from the root (`root.sync.copying`,
    /// `sync.copying`) or a path from the scope (`.copying.five_DOF_mode`). None is an error that `compile` reports.
    pub src: Option<(String, Origin)>,
    /// The text that names its target, in the same forms.
    pub tgt: Option<(String, Origin)>,
    /// What triggers it, any one of them; empty: any event.
    pub events: Vec<(Trigger, Origin)>,
    /// Must not say *false*.
    pub guard: Option<(FunctionId, Origin)>,
    /// What happens between exits and entries, in this order.
    pub effect: Vec<(Action, Origin)>,
    /// Priority number among the transitions of one source: the higher goes first. Any finite number; 0 if not written.
    pub pn: f64,
    /// What it is for.
    pub doc: Option<String>,
    /// Where it was written.
    pub origin: Origin,
}

impl ChartTransition {
    /// A transition between two nodes on any of `events`.
    pub fn new(src: &str, tgt: &str, events: impl IntoIterator<Item = Trigger>) -> Self {
        Self {
            src: Some((src.to_owned(), Origin::NONE)),
            tgt: Some((tgt.to_owned(), Origin::NONE)),
            events: events.into_iter().map(|trigger| (trigger, Origin::NONE)).collect(),
            ..Self::default()
        }
    }

    /// Its functions, each with the key of the part it stands in.
    pub fn functions(&self) -> Vec<(&'static str, FunctionId)> {
        let asked = self.events.iter().filter_map(|(trigger, _)| match trigger {
            Trigger::Predicate(function) => Some(*function),
            Trigger::Timed(timed) => timed.by,
            Trigger::Event(_) => None,
        });
        let mut all: Vec<_> = asked.map(|function| ("events", function)).collect();
        all.extend(self.guard.map(|(function, _)| ("guard", function)));
        all.extend(self.effect.iter().filter_map(|(action, _)| Some(("effect", action.function()?))));
        all
    }

    /// Whether nothing in it is a function.
    pub fn is_pure(&self) -> bool {
        self.guard.is_none()
            && self.effect.iter().all(|(action, _)| action.is_pure())
            && self.events.iter().all(|(trigger, _)| match trigger {
                Trigger::Predicate(_) => false,
                Trigger::Timed(timed) => timed.by.is_none(),
                Trigger::Event(_) => true,
            })
    }
}

/// What an entry, an exit or an effect does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Raises an event (a request, or one that the deployment emits). It does not come back to the chart by itself.
    Raise(EventName),
    /// Calls a function.
    Function(FunctionId),
}

impl Action {
    /// The function that it calls, if it calls one.
    pub fn function(self) -> Option<FunctionId> {
        if let Self::Function(function) = self { Some(function) } else { None }
    }

    /// Whether it is not a function.
    pub fn is_pure(self) -> bool {
        matches!(self, Self::Raise(_))
    }
}

/// A function of a model that is not pure: an index into the list that the loader of the model keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FunctionId(pub u32);

/// What can trigger a transition.
#[derive(Debug, Clone, PartialEq)]
pub enum Trigger {
    /// An event of that name. `e_done` alone means the completion of the transition's source.
    Event(EventName),
    /// The passing of time.
    Timed(TimeEvent),
    /// Any event for which the function says yes.
    Predicate(FunctionId),
}

/// A time event: written `e_after(SECONDS)` or `e_at(SECONDS)`.
///
/// It is raised inside the chart, under the name `e_after(ID)@SOURCE`, once per visit of the transition's source, when
/// *more* than that time has passed since the source was entered (`e_after`) or since the clock's start (`e_at`).
#[derive(Debug, Clone, PartialEq)]
pub struct TimeEvent {
    /// Since when the time counts.
    pub since: Since,
    /// The time in seconds, finite. A negative one has always passed.
    pub seconds: f64,
    /// What stands for the time in the event's name; the time as written where nothing else was given. No blanks, no
    /// comma, no parentheses.
    pub id: String,
    /// A function that says the seconds instead, asked on every entry of the source.
    pub by: Option<FunctionId>,
}

words! {
    /// From when a time event counts.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Since by word {
        /// From the entry of the source (`e_after`).
        Entry = "e_after",
        /// From the clock's start (`e_at`).
        Start = "e_at",
    }
}

impl TimeEvent {
    /// The event's name where it is raised: `e_after(ID)@SOURCE`.
    pub fn event_of(&self, source: &str) -> String {
        format!("{}({})@{source}", self.since.word(), self.id)
    }
}

impl Trigger {
    /// The trigger that `text` means: `e_after(0.5)`, `e_at(20)`, `e_after(0.5,deadline)` are time events, all else is the
    /// name of an event. `Display` prints what this reads.
    ///
    /// # Errors
    /// [`NameError`] when `text` is neither: a time that is no finite number, a text with blanks.
    pub fn parse(text: &str) -> Result<Self, NameError> {
        for since in [Since::Entry, Since::Start] {
            let inner = text.strip_prefix(since.word()).and_then(|rest| rest.strip_prefix('('));
            if let Some(inner) = inner {
                let timed = inner.strip_suffix(')').and_then(|inner| TimeEvent::parse(since, inner));
                return timed.map(Self::Timed).ok_or_else(|| NameError {
                    text: text.to_owned(),
                    kind: "time event",
                    reason: "it is written `e_after(SECONDS)` or `e_at(SECONDS)` with a number, such as `e_after(0.5)`",
                });
            }
        }
        EventName::new(text).map(Self::Event)
    }

    /// The time event of so many seconds, named by the shortest text of the number (`e_after(1)`, `e_after(0.5)`).
    pub fn timed(since: Since, seconds: f64) -> Self {
        Self::Timed(TimeEvent { since, seconds, id: seconds.to_string(), by: None })
    }
}

impl TimeEvent {
    fn parse(since: Since, inner: &str) -> Option<Self> {
        let (number, id) = match inner.split_once(',') {
            Some((number, id)) => (number.trim(), id.trim()),
            None => (inner.trim(), inner.trim()),
        };
        let seconds: f64 = number.parse().ok().filter(|s: &f64| s.is_finite())?;
        let plain = |c: char| !c.is_whitespace() && !c.is_control() && !matches!(c, ',' | '(' | ')');
        (!id.is_empty() && id.chars().all(plain)).then(|| Self { since, seconds, id: id.to_owned(), by: None })
    }
}

impl fmt::Display for TimeEvent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.id.parse() == Ok(self.seconds) {
            write!(f, "{}({})", self.since.word(), self.id)
        } else {
            write!(f, "{}({},{})", self.since.word(), self.seconds, self.id)
        }
    }
}

impl fmt::Display for Trigger {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Event(name) => write!(f, "{name}"),
            Self::Timed(timed) => write!(f, "{timed}"),
            Self::Predicate(id) => write!(f, "function {}", id.0),
        }
    }
}

/// Whether a statechart makes events of that name itself: completion and time events.
pub fn is_internal(event: &str) -> bool {
    event.starts_with("e_done@") || event.starts_with("e_after(") || event.starts_with("e_at(") || event == "e_init_fsm"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triggers_read_what_they_print() {
        for text in ["e_go", "e_done", "e_done@root.a", "e_after(1)", "e_after(0.50)", "e_at(20)", "e_after(0.5,late)"]
        {
            let trigger = Trigger::parse(text).unwrap();
            assert_eq!(trigger.to_string(), text);
        }
        assert_eq!(Trigger::timed(Since::Entry, 1.0).to_string(), "e_after(1)");
        assert!(matches!(Trigger::parse("e_after"), Ok(Trigger::Event(_))), "without parentheses it is a plain event");
        assert!(Trigger::parse("e_after(soon)").is_err());
        assert!(Trigger::parse("e_after(nan)").is_err());
        assert!(Trigger::parse("e_after(1").is_err());
        assert!(Trigger::parse("e_at(1e999)").is_err());
        assert!(Trigger::parse("e b").is_err());
        let Ok(Trigger::Timed(timed)) = Trigger::parse("e_after( 2 , x )") else { panic!("a time event") };
        assert_eq!(timed.event_of("root.a"), "e_after(x)@root.a");
    }

    #[test]
    fn origins_are_no_part_of_the_meaning() {
        let mut a = Statechart::default();
        a.root.transitions.push(ChartTransition::new("initial", "a", [Trigger::parse("e").unwrap()]));
        let mut b = a.clone();
        b.root.origin = Origin(7);
        b.root.transitions[0].origin = Origin(8);
        assert_eq!(a, b);
        b.root.transitions[0].pn = 1.0;
        assert_ne!(a, b);
    }

    #[test]
    fn purity_sees_every_place_of_a_function() {
        let function = (FunctionId(0), Origin::NONE);
        let pure = Statechart::default();
        assert!(pure.is_pure());
        let with = |change: &dyn Fn(&mut State)| {
            let mut root = State::new(Ident::new(ROOT).unwrap());
            let mut inner = State::new(Ident::new("a").unwrap());
            change(&mut inner);
            root.children.push(ChartNode::State(inner));
            Statechart::new(root).is_pure()
        };
        let call = (Action::Function(FunctionId(0)), Origin::NONE);
        assert!(with(&|_| ()));
        assert!(!with(&|s| s.doo = Some(function)));
        assert!(!with(&|s| s.entry.push(call)));
        assert!(!with(&|s| s.exit.push(call)));
        assert!(!with(&|s| s
            .transitions
            .push(ChartTransition { guard: Some(function), ..ChartTransition::default() })));
        assert!(!with(&|s| s.transitions.push(ChartTransition { effect: vec![call], ..ChartTransition::default() })));
        assert!(!with(&|s| s.transitions.push(ChartTransition::new("a", "b", [Trigger::Predicate(FunctionId(0))]))));
    }
}
