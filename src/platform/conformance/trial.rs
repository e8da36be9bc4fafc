//! A platform under trial: every call of it from a thread that is waited for with a deadline, and what it does held against what
//! is expected.

use super::bed::{Bed, BedTrouble, Times, UnderTest};
use super::report::BrokenRule;
use super::words::name;
use crate::model::{ComponentName, ComponentSnapshot, RunState, Snapshot, Step, Value};
use crate::platform::{Cause, Outcome, Platform, PlatformEvent};
use crate::time::clock::panic_text;
use crate::time::{Clock, Receiver, Time, lock};
use std::collections::BTreeSet;
use std::fmt::{Debug, Display};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Why a rule is not tried to its end.
pub enum RuleStop {
    Broken(BrokenRule),
    Skipped(String),
}

/// How a rule, or a part of one, ends.
pub type RuleEnds<T = ()> = Result<T, RuleStop>;

/// What was expected with something, and what was seen.
pub fn broken(with: impl Display, expected: impl Display, seen: impl Display) -> RuleStop {
    RuleStop::Broken(BrokenRule { with: with.to_string(), expected: expected.to_string(), seen: seen.to_string() })
}

/// It holds, or was seen otherwise.
pub fn holds(is: bool, with: impl Display, expected: impl Display, seen: impl Display) -> RuleEnds {
    if is { Ok(()) } else { Err(broken(with, expected, seen)) }
}

/// Both are the same.
pub fn same<T: PartialEq + Debug>(with: impl Display, seen: &T, expected: &T) -> RuleEnds {
    holds(seen == expected, with, format_args!("{expected:?}"), format_args!("{seen:?}"))
}

/// Both systems are the same; where not, what only one of them has.
pub fn same_system(with: impl Display, seen: &Snapshot, expected: &Snapshot) -> RuleEnds {
    let (there, wanted) = (parts(seen), parts(expected));
    let only = |one: &BTreeSet<String>, other: &BTreeSet<String>| {
        let list: Vec<&str> = one.difference(other).map(String::as_str).collect();
        if list.is_empty() { "nothing of that".to_owned() } else { list.join("; ") }
    };
    holds(seen == expected, with, only(&wanted, &there), only(&there, &wanted))
}

/// What there is, each thing in words.
fn parts(system: &Snapshot) -> BTreeSet<String> {
    let component = |(name, it): (&ComponentName, &ComponentSnapshot)| {
        let values: Vec<String> = it.properties.iter().map(|(name, value)| format!("{name} = {value}")).collect();
        let activity = it.activity.map(|activity| format!(" in `{activity}`")).unwrap_or_default();
        format!("{name}: {} {}{activity} ({})", it.ty, it.state, values.join(", "))
    };
    let components = system.components.iter().map(component);
    let connections = system.connections.iter().map(|((from, to), policy)| format!("{from} -> {to} ({policy})"));
    let ports = system.ports.iter().map(|(port, value)| format!("{port} written: {value}"));
    components.chain(connections).chain(ports).collect()
}

/// An outcome in words.
pub fn told(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Done(None) => "done".to_owned(),
        Outcome::Done(Some(value)) => format!("done, with {value}"),
        Outcome::NotDone(cause) => format!("not done: {cause}"),
        Outcome::Unknown(cause) => format!("unknown: {cause}"),
    }
}

/// An outcome is as expected.
pub fn is(with: impl Display, outcome: &Outcome, expected: &str, as_expected: impl Fn(&Outcome) -> bool) -> RuleEnds {
    holds(as_expected(outcome), with, expected, told(outcome))
}

/// It is that outcome.
pub fn ends(with: impl Display, outcome: &Outcome, expected: &Outcome) -> RuleEnds {
    holds(outcome == expected, with, told(expected), told(outcome))
}

/// It did not happen, and nothing else is said of it.
pub fn is_not_done(with: impl Display, outcome: &Outcome) -> RuleEnds {
    is(with, outcome, "not done", |outcome| matches!(outcome, Outcome::NotDone(_)))
}

/// It is unknown since there was no answer in time.
pub fn is_unknown(with: impl Display, outcome: &Outcome) -> RuleEnds {
    ends(with, outcome, &Outcome::Unknown(Cause::Timeout))
}

/// Events that were heard.
pub type Heard = Arc<Mutex<Vec<PlatformEvent>>>;

/// One of them is as expected.
pub fn has_heard(with: impl Display, heard: &Heard, expected: &str, it: impl Fn(&PlatformEvent) -> bool) -> RuleEnds {
    let heard = lock(heard);
    holds(heard.iter().any(it), with, expected, format_args!("heard: {heard:?}"))
}

/// A platform under trial.
pub struct Trial {
    made: UnderTest,
    pub times: Times,
}

impl Trial {
    pub fn of(bed: &dyn Bed, trouble: &[(&'static str, BedTrouble)]) -> Self {
        Self { made: bed.make(trouble), times: bed.times() }
    }

    pub fn clock(&self) -> &Clock {
        &self.made.clock
    }

    pub fn now(&self) -> Time {
        self.made.clock.now()
    }

    pub fn deadline(&self) -> Time {
        self.now() + self.times.limit
    }

    /// Has the platform do something, in a thread of its own. It is back by `until`, a little later at most.
    pub fn call<T: Send + 'static>(
        &self,
        with: impl Display,
        until: Time,
        f: impl FnOnce(&dyn Platform) -> T + Send + 'static,
    ) -> RuleEnds<T> {
        let late = self.times.late;
        let expected = format!("an answer by {until}, or {late:?} later at most");
        self.work(with.to_string(), f).by(until + late, expected).map(|(it, _)| it)
    }

    /// Has the platform do what does not wait.
    pub fn at_once<T: Send + 'static>(
        &self,
        with: impl Display,
        f: impl FnOnce(&dyn Platform) -> T + Send + 'static,
    ) -> RuleEnds<T> {
        self.call(with, self.now(), f)
    }

    /// Carries a step out.
    pub fn run(&self, step: &Step) -> RuleEnds<Outcome> {
        self.run_by(step, self.deadline())
    }

    pub fn run_by(&self, step: &Step, deadline: Time) -> RuleEnds<Outcome> {
        let own = step.clone();
        self.call(format_args!("`{step}`"), deadline, move |platform| platform.execute(&own, deadline))
    }

    /// Carries a step out as one of a safe configuration.
    pub fn run_safe(&self, step: &Step) -> RuleEnds<Outcome> {
        let (own, deadline) = (step.clone(), self.deadline());
        self.call(format_args!("`{step}`, safe"), deadline, move |platform| platform.execute_safe(&own, deadline))
    }

    /// The step happens.
    pub fn does(&self, step: Step) -> RuleEnds<Option<Value>> {
        match self.run(&step)? {
            Outcome::Done(value) => Ok(value),
            other => Err(broken(format_args!("`{step}`"), "done", told(&other))),
        }
    }

    pub fn all(&self, steps: impl IntoIterator<Item = Step>) -> RuleEnds {
        steps.into_iter().try_for_each(|step| self.does(step).map(drop))
    }

    /// The step is refused, with a reason, and nothing changes.
    pub fn refuses(&self, step: Step) -> RuleEnds {
        let before = self.see()?;
        match self.run(&step)? {
            Outcome::NotDone(Cause::Refused(why)) if !why.is_empty() => {}
            Outcome::NotDone(Cause::Refused(_)) => return Err(broken(format_args!("`{step}`"), "a reason", "none")),
            other => return Err(broken(format_args!("`{step}`"), "refused", told(&other))),
        }
        same_system(format_args!("`{step}`, which was refused"), &self.see()?, &before)
    }

    /// Everything there is.
    pub fn see(&self) -> RuleEnds<Snapshot> {
        let deadline = self.deadline();
        let seen = self.call("observing", deadline, move |platform| platform.observe(deadline))?;
        seen.map_err(|why| broken("observing", "an answer", why))
    }

    /// One component.
    pub fn see_one(&self, component: &str) -> RuleEnds<Option<ComponentSnapshot>> {
        let (deadline, component) = (self.deadline(), name(component));
        let with = format!("observing `{component}`");
        let seen = self.call(&with, deadline, move |platform| platform.observe_component(component, deadline))?;
        seen.map_err(|why| broken(with, "an answer", why))
    }

    pub fn state_of(&self, component: &str) -> RuleEnds<Option<RunState>> {
        Ok(self.see()?.components.get(&name(component)).map(|it| it.state))
    }

    /// The component is in that run state, or gone.
    pub fn stands(&self, with: impl Display, component: &str, expected: Option<RunState>) -> RuleEnds {
        let words = |state: Option<RunState>| state.map_or("gone".to_owned(), |state| state.to_string());
        let seen = self.state_of(component)?;
        let with = format_args!("{with}: `{component}`");
        holds(seen == expected, with, words(expected), words(seen))
    }

    /// Nothing is there.
    pub fn is_empty(&self, with: impl Display) -> RuleEnds {
        same_system(with, &self.see()?, &Snapshot::default())
    }

    /// These components are in quarantine, and no others.
    pub fn quarantines(&self, with: impl Display, expected: &[&str]) -> RuleEnds {
        let seen = self.at_once("asking who is in quarantine", |platform| platform.quarantined())?;
        let list = |names: &[ComponentName]| match names {
            [] => "nobody in quarantine".to_owned(),
            names => {
                let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
                format!("in quarantine: {}", names.join(", "))
            }
        };
        let expected: Vec<ComponentName> = expected.iter().map(|text| name(text)).collect();
        holds(seen == expected, with, list(&expected), list(&seen))
    }

    /// Gives a call up; that takes no time.
    pub fn cancel(&self, step: &Step) -> RuleEnds {
        let (own, told) = (step.clone(), self.now());
        let with = format!("giving `{step}` up");
        self.at_once(&with, move |platform| platform.cancel(&own))?;
        if !self.clock().is_simulated() {
            return Ok(());
        }
        same(format_args!("{with}, which does not wait"), &self.now(), &told)
    }

    /// From now on events are collected.
    pub fn listen(&self) -> RuleEnds<Heard> {
        let heard = Heard::default();
        let sink = heard.clone();
        let sink = Arc::new(move |event| lock(&sink).push(event));
        self.at_once("subscribing", move |platform| platform.subscribe(sink))?;
        Ok(heard)
    }

    /// Lets a component raise an event.
    pub fn raise(&self, component: &str, event: &str) {
        (self.made.raise)(component, event);
    }

    /// Has another thread carry the step out within `limit` from now on; what it answers, and when.
    pub fn begin(&self, step: &Step, limit: Duration) -> CallUnderWay<Outcome> {
        let (own, deadline) = (step.clone(), self.now() + limit);
        self.work(format!("`{step}`"), move |platform| platform.execute(&own, deadline))
    }

    /// Has another thread ask the platform something.
    pub fn work<T: Send + 'static>(
        &self,
        with: String,
        f: impl FnOnce(&dyn Platform) -> T + Send + 'static,
    ) -> CallUnderWay<T> {
        let (answer, answered) = self.made.clock.channel(1);
        let (platform, clock) = (self.made.platform.clone(), self.made.clock.clone());
        self.made.clock.spawn("conformance", move || {
            let came = catch_unwind(AssertUnwindSafe(|| f(&*platform)));
            drop(platform);
            let _ = answer.try_send(came.map(|it| (it, clock.now())).map_err(|p| panic_text(&*p)));
        });
        CallUnderWay { with, answered }
    }

    /// Lets so much time pass.
    pub fn wait(&self, time: Duration) {
        self.made.clock.sleep_until(self.now() + time);
    }
}

/// What another thread asks of a platform.
pub struct CallUnderWay<T> {
    with: String,
    answered: Receiver<Result<(T, Time), String>>,
}

impl<T> CallUnderWay<T> {
    /// What came of it, by `deadline`, and when.
    pub fn ended(&self, deadline: Time) -> RuleEnds<(T, Time)> {
        self.by(deadline, format_args!("an answer by {deadline}"))
    }

    fn by(&self, deadline: Time, expected: impl Display) -> RuleEnds<(T, Time)> {
        match self.answered.recv_deadline(deadline) {
            Ok(Ok(it)) => Ok(it),
            Ok(Err(text)) => Err(broken(&self.with, "an answer", format_args!("the platform panicked: {text}"))),
            Err(_) => Err(broken(&self.with, expected, "no answer")),
        }
    }
}
