//! Rules of what a platform tells, and of lists of steps that it prepares.

use super::bed::Bed;
use super::trial::{RuleEnds, RuleStop, Trial, broken, has_heard, holds, is_not_done, same, same_system, told};
use super::words::*;
use crate::model::{ComponentName, Policy, RunState, Step, Transition, Value};
use crate::platform::{Outcome, PlatformEvent, Prepared};
use crate::time::lock;
use {Policy::Buffer, Policy::Data, Transition::Configure, Transition::Start, Transition::Stop as Halt};

pub fn one_component_observed_is_the_one_of_the_whole(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), create("b"), state("a", Configure), set("a.gain", 2.5)])?;
    let whole = t.see()?;
    ["a", "b", "nobody"].into_iter().try_for_each(|component| {
        let one = t.see_one(component)?;
        same(format_args!("observing `{component}`"), &one.as_ref(), &whole.components.get(&name(component)))
    })
}

pub fn some_components_observed_are_those_of_the_whole(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), create("b"), create("c"), create("d"), state("a", Configure), set("a.gain", 2.5)])?;
    t.all([connect("a.y", "b.u", Data), connect("a.y2", "b.q", Buffer(3)), connect("c.y", "b.q", Buffer(2))])?;
    t.all([connect("c.y", "c.u", Data), connect("a.w", "d.v", Data), connect("a.y", "c.u_plain", Data)])?;
    t.all([write("a.u", Some(Value::Float(1.0))), write("b.n", Some(Value::Int(2)))])?;
    let check = || {
        for asked in
            [&[][..], &["a"], &["b"], &["c"], &["d"], &["b", "c"], &["nobody", "d", "d"], &["a", "b", "c", "d"]]
        {
            let names: Vec<ComponentName> = asked.iter().map(|n| name(n)).collect();
            let with = format!("observing {asked:?}");
            let (deadline, of) = (t.deadline(), names.clone());
            let some = t.call(&with, deadline, move |platform| platform.observe_some(&of, deadline))?;
            let some = some.map_err(|why| broken(&with, "an answer", why))?;
            let mut whole = t.see()?;
            whole.components.retain(|n, _| names.contains(n));
            whole.connections.retain(|(f, t), _| names.contains(&f.component) || names.contains(&t.component));
            whole.ports.retain(|port, _| names.contains(&port.component));
            same_system(with, &some, &whole)?;
        }
        Ok(())
    };
    check()?;
    t.all([disconnect("a.y2", "b.q"), disconnect("c.y", "c.u"), write("a.u", None)])?;
    check()?;
    t.all([disconnect("a.w", "d.v"), destroy("d"), create("d"), connect("c.w", "d.v", Data)])?;
    check()
}

pub fn events_of_components_reach_the_sink(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), state("a", Configure), state("a", Start)])?;
    let heard = t.listen()?;
    t.raise("a", "e_hello");
    t.wait(t.times.limit);
    let it = |event: &PlatformEvent| {
        matches!(event, PlatformEvent::Raised { event, component, .. }
            if event.as_str() == "e_hello" && *component == name("a"))
    };
    has_heard("`a` raises `e_hello`", &heard, "`e_hello` of `a`", it)?;
    same("`a` raises `e_hello`, how much is heard", &lock(&heard).len(), &1)
}

/// A prepared list, whose steps are carried out as those of a platform.
struct StepList<'t> {
    t: &'t Trial,
    steps: Vec<Step>,
    prepared: Option<Box<dyn Prepared>>,
}

impl StepList<'_> {
    fn run(&mut self, index: usize, value: Option<Value>) -> RuleEnds<Outcome> {
        let (now, deadline) = (self.t.now(), self.t.deadline());
        let mut prepared = self.prepared.take().ok_or_else(|| RuleStop::Skipped("it is gone".to_owned()))?;
        let with = self.with(index);
        let (outcome, prepared) = self.t.call(with, deadline, move |_| {
            let outcome = prepared.execute(index, value.as_ref(), now, deadline);
            (outcome, prepared)
        })?;
        self.prepared = Some(prepared);
        Ok(outcome)
    }

    fn with(&self, index: usize) -> String {
        format!("`{}`, prepared", self.steps[index])
    }

    fn does(&mut self, index: usize, value: Option<Value>) -> RuleEnds {
        let outcome = self.run(index, value)?;
        holds(matches!(outcome, Outcome::Done(_)), self.with(index), "done", told(&outcome))
    }
}

pub fn prepared_steps_do_what_executed_ones_do(bed: &dyn Bed) -> RuleEnds {
    let t = Trial::of(bed, &[]);
    t.all([create("a"), state("a", Configure), state("a", Start)])?;
    let steps = vec![
        set("a.gains", Value::floats(&[0.1, 0.2, 0.3])),
        write("a.n", Some(Value::Int(7))),
        state("a", Halt),
        state("a", Start),
        write("a.n", None),
    ];
    let asked = steps.clone();
    let prepared = t.at_once("preparing", move |platform| platform.prepare(&asked))?;
    if prepared.is_none() {
        return Err(RuleStop::Skipped("the platform prepares nothing".to_owned()));
    }
    let mut list = StepList { t: &t, steps, prepared };
    let gains = |expected: &Value| {
        let seen = t.see()?.components.remove(&name("a")).and_then(|mut a| a.properties.remove(&ident("gains")));
        same("`a.gains`, which was set", &seen.as_ref(), &Some(expected))
    };
    (0..3).try_for_each(|index| list.does(index, None))?;
    gains(&Value::floats(&[0.1, 0.2, 0.3]))?;
    t.stands("stopped, prepared", "a", Some(RunState::Stopped))?;
    same("what was written", &t.see()?.ports, &written(&[("a.n", Value::Int(7))]))?;
    let again = list.run(2, None)?;
    is_not_done("`stop a`, prepared, once more", &again)?;
    let back = Value::floats(&[1.0; 3]);
    list.does(0, Some(back.clone()))?;
    list.does(1, Some(Value::Int(8)))?;
    same("what was written, with another value", &t.see()?.ports, &written(&[("a.n", Value::Int(8))]))?;
    list.does(4, None)?;
    list.does(3, None)?;
    same("what was written, taken back", &t.see()?.ports, &written(&[]))?;
    gains(&back)?;
    t.stands("started, prepared", "a", Some(RunState::Running))
}
