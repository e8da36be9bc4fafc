//! Monitors, as written: conditions over signals and time, and the events they raise (docs/monitors.md).
//!
//! What a condition means, to the instant, is said in `docs/monitors.md` and done in `crate::monitor`.

use super::finding::Origin;
use super::names::{ComponentName, EventName, Ident, MemberRef, NameError, TypeName};
use super::run_state::RunState;
use super::words::words;
use std::fmt;
use std::time::Duration;

/// The component type that runs the monitors of a deployment. A configuration creates one, in the activity whose rounds
/// evaluate them; each monitor is a property of it, true while it is enabled.
pub const MONITORS_TYPE: &str = "davit.Monitors";

/// How a component is written in a condition of its own type: `self.mode`.
pub const SELF: &str = "self";

/// A monitor: watches a condition and raises an event when it becomes true.
#[derive(Debug, Clone, PartialEq)]
pub struct Monitor {
    /// Its name, unique in a deployment.
    pub name: Ident,
    /// What it watches for.
    pub when: Condition,
    /// Raised when the condition becomes true; none: the monitor only shows its verdict.
    pub raise: Option<EventName>,
    /// Raised when it becomes false again.
    pub cleared: Option<EventName>,
    /// While it stays true, `raise` is raised again each time this has passed.
    pub repeat: Option<Duration>,
    /// When it is evaluated.
    pub sampling: Sampling,
    /// Whether it watches from the beginning.
    pub enabled: bool,
    /// What it is for.
    pub description: Option<String>,
    /// Where it was written.
    pub origin: Origin,
}

/// When a monitor is evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// When something that it looks at changes, and when time alone may change its verdict.
    OnSample,
    /// At a fixed rate, with this period.
    Every(Duration),
}

/// Something that is true or false at every instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// What.
    pub kind: ConditionKind,
    /// Where it was written.
    pub origin: Origin,
}

/// The kinds of conditions.
#[derive(Debug, Clone, PartialEq)]
pub enum ConditionKind {
    /// Two signals compared.
    Compare {
        /// The left side.
        left: MonitoredSignal,
        /// How.
        op: Comparison,
        /// The right side.
        right: MonitoredSignal,
        /// Once true, it stays true until the left side is this much beyond the right one; 0 or more, in the signals'
        /// unit. Of ordered comparisons only.
        hysteresis: Option<f64>,
    },
    /// A port that carries a bool, or a number that is not zero.
    IsTrue(PortSignal),
    /// The component is in the run state.
    InState {
        /// The component.
        component: ComponentName,
        /// The state.
        state: RunState,
    },
    /// The component is faulted.
    Faulted(ComponentName),
    /// No sample came to the port for more than this time.
    Silent {
        /// The port.
        port: MemberRef,
        /// How long.
        time: Duration,
    },
    /// All of these; true when there is none.
    All(Vec<Condition>),
    /// At least one of these; false when there is none.
    Any(Vec<Condition>),
    /// Not this.
    No(Box<Condition>),
    /// The second whenever the first.
    Implies(Box<Condition>, Box<Condition>),
    /// The instants at which it becomes true.
    Rise(Box<Condition>),
    /// The instants at which it becomes false.
    Fall(Box<Condition>),
    /// At some instant of the interval before now.
    Once {
        /// What.
        condition: Box<Condition>,
        /// How long ago.
        interval: Interval,
    },
    /// At all instants of the interval before now.
    Historically {
        /// What.
        condition: Box<Condition>,
        /// How long ago.
        interval: Interval,
    },
    /// `hold` at all instants after one of the interval before now at which `from` was true.
    Since {
        /// What has held since then.
        hold: Box<Condition>,
        /// What was true then.
        from: Box<Condition>,
        /// How long ago.
        interval: Interval,
    },
    /// Historically over `[0, time]`, and the history is that long.
    ForAtLeast {
        /// What.
        condition: Box<Condition>,
        /// How long.
        time: Duration,
    },
    /// Once in `[0, time]`.
    WithinLast {
        /// What.
        condition: Box<Condition>,
        /// How long ago at most.
        time: Duration,
    },
}

words! {
    /// How two signals are compared.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
    pub enum Comparison by word {
        /// `<`
        Below = "below",
        /// `<=`
        AtMost = "at_most",
        /// `>`
        Above = "above",
        /// `>=`
        AtLeast = "at_least",
        /// `==`
        Equals = "equals",
        /// `!=`
        Differs = "differs",
    }
}

impl Comparison {
    /// Whether one side may be beyond the other: the ones that can have a hysteresis.
    pub fn is_ordered(self) -> bool {
        !matches!(self, Self::Equals | Self::Differs)
    }
}

/// A closed interval of time before now: from `from` ago to `to` ago.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interval {
    /// The newer end, how long ago.
    pub from: Duration,
    /// The older end, how long ago; none: the beginning of the history.
    pub to: Option<Duration>,
}

/// Something that has a number at every instant, or none.
#[derive(Debug, Clone, PartialEq)]
pub struct MonitoredSignal {
    /// What.
    pub kind: SignalKind,
    /// Where it was written.
    pub origin: Origin,
}

/// The kinds of signals.
#[derive(Debug, Clone, PartialEq)]
pub enum SignalKind {
    /// What a port carries, bools as 0 and 1.
    Port(PortSignal),
    /// Seconds since the newest sample of the port.
    Age(MemberRef),
    /// Samples of the port in the time before now, divided by that time, in 1/s.
    Rate {
        /// The port.
        port: MemberRef,
        /// The time.
        over: Duration,
    },
    /// A counter of an activity.
    Activity {
        /// The activity.
        activity: Ident,
        /// What is counted or measured.
        counter: Counter,
    },
    /// The Euclidean norm of several signals.
    Norm(Vec<MonitoredSignal>),
    /// The first minus the second.
    Difference(Box<MonitoredSignal>, Box<MonitoredSignal>),
    /// The smallest of several.
    Min(Vec<MonitoredSignal>),
    /// The largest of several.
    Max(Vec<MonitoredSignal>),
    /// Without its sign.
    Abs(Box<MonitoredSignal>),
    /// Always this number.
    Constant(f64),
}

words! {
    /// What is known of an activity.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
    pub enum Counter by word {
        /// Rounds of updates begun.
        Cycles = "cycles",
        /// Periods that were missed because a round took too long.
        Overruns = "overruns",
        /// How late the last round began, in seconds.
        Latency = "latency",
        /// How long the last round took, in seconds.
        Duration = "duration",
    }
}

/// A number in what a port carries: `Component.port`, `Component.port.field`, `Component.port.field[3]`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PortSignal {
    /// The port.
    pub member: MemberRef,
    /// The way to the number in the port's value; empty: the value itself.
    pub path: Vec<ValuePart>,
}

/// One step into a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ValuePart {
    /// The field of a record.
    Field(Ident),
    /// The element of an array, from 0.
    Index(usize),
}

impl PortSignal {
    /// The value of the port itself.
    pub fn whole(member: MemberRef) -> Self {
        Self { member, path: Vec::new() }
    }
}

impl fmt::Display for PortSignal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.member)?;
        for part in &self.path {
            match part {
                ValuePart::Field(field) => write!(f, ".{field}")?,
                ValuePart::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}

impl std::str::FromStr for PortSignal {
    type Err = NameError;

    /// `Component.port`, then `.field` and `[index]` in any order, as often as the value is deep.
    fn from_str(text: &str) -> Result<Self, NameError> {
        let bad = |reason| NameError { text: text.to_owned(), kind: "signal of a port", reason };
        let Some((component, rest)) = text.split_once('.') else {
            return Err(bad("it is written `Component.port`, with `.field` or `[index]` behind it"));
        };
        let end = |text: &str| text.find(['.', '[']).unwrap_or(text.len());
        let (port, mut rest) = rest.split_at(end(rest));
        let member = MemberRef { component: component.parse()?, member: port.parse()? };
        let mut path = Vec::new();
        while !rest.is_empty() {
            if let Some(inner) = rest.strip_prefix('[') {
                let (index, after) = inner.split_once(']').ok_or_else(|| bad("a `[` needs its `]`"))?;
                // Digits alone: `usize` would read `+3` too, which is printed otherwise.
                let digits = !index.is_empty() && index.bytes().all(|b| b.is_ascii_digit());
                let index = index.parse().ok().filter(|_| digits);
                path.push(ValuePart::Index(
                    index.ok_or_else(|| bad("an index is a whole number from 0, as in `[3]`"))?,
                ));
                rest = after;
            } else {
                let field = rest.strip_prefix('.').ok_or_else(|| bad("after `]` comes `.field` or `[index]`"))?;
                let (field, after) = field.split_at(end(field));
                path.push(ValuePart::Field(field.parse()?));
                rest = after;
            }
        }
        Ok(Self { member, path })
    }
}

/// Whether a type is that of a component that runs monitors: those of a deployment, or of a subsystem.
pub fn is_monitors(ty: TypeName) -> bool {
    ty.as_str().rsplit('/').next() == Some(MONITORS_TYPE)
}

impl Monitor {
    /// One that watches from the beginning, on each sample, and raises nothing.
    pub fn new(name: Ident, when: Condition) -> Self {
        Self {
            name,
            when,
            raise: None,
            cleared: None,
            repeat: None,
            sampling: Sampling::OnSample,
            enabled: true,
            description: None,
            origin: Origin::NONE,
        }
    }

    /// The type of the component that runs it: the monitors of a subsystem are a type of their own.
    ///
    /// # Panics
    /// Never: it is the name of a type.
    pub fn run_by(&self) -> TypeName {
        let path = self.name.as_str().rsplit_once('/').map_or(String::new(), |(path, _)| format!("{path}/"));
        TypeName::new(&format!("{path}{MONITORS_TYPE}")).expect("the name of a type")
    }

    /// Its name in its own file: that of its property of the component that runs it.
    ///
    /// # Panics
    /// Never: the end of a name is one.
    pub fn own_name(&self) -> Ident {
        Ident::new(self.name.last()).expect("the end of a name is one")
    }

    /// Calls `f` with every condition in it, from the outside in.
    pub fn for_each_condition<'a>(&'a self, f: &mut impl FnMut(&'a Condition)) {
        self.when.for_each(f);
    }

    /// Calls `f` with every signal in it, outer ones first.
    pub fn for_each_signal<'a>(&'a self, f: &mut impl FnMut(&'a MonitoredSignal)) {
        self.when.for_each_signal(f);
    }

    /// The events it may raise.
    pub fn events(&self) -> impl Iterator<Item = EventName> + '_ {
        self.raise.into_iter().chain(self.cleared)
    }
}

impl Condition {
    /// A condition of that kind that was never written in a file.
    pub fn new(kind: ConditionKind) -> Self {
        Self { kind, origin: Origin::NONE }
    }

    /// What a port carries, compared with a number: for the types that programmers declare.
    ///
    /// # Panics
    /// When `port` is not written like `self.mode`, with `.field` or `[index]` behind it where there is one.
    pub fn compare(port: &str, op: Comparison, value: f64) -> Self {
        let port = port.parse().expect("the signal of a port");
        let (left, right) =
            (MonitoredSignal::new(SignalKind::Port(port)), MonitoredSignal::new(SignalKind::Constant(value)));
        Self::new(ConditionKind::Compare { left, op, right, hysteresis: None })
    }
}

impl MonitoredSignal {
    /// A signal of that kind that was never written in a file.
    pub fn new(kind: SignalKind) -> Self {
        Self { kind, origin: Origin::NONE }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_print_as_they_are_read() {
        for text in ["A.x", "left/A.x", "A.x[0]", "A.x.pos[3].y", "A.x[1][2]"] {
            assert_eq!(text.parse::<PortSignal>().unwrap().to_string(), text);
        }
        for text in ["A", "A.", ".x", "A.x[", "A.x[]", "A.x[-1]", "A.x[+1]", "A.x[1", "A.x[1]y", "A.x.", "A.x[1.5]", ""]
        {
            assert!(text.parse::<PortSignal>().is_err(), "{text}");
        }
    }
}
