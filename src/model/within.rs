//! What is written in the file of a subsystem, as it is called from outside: every name with the path before it.

use super::condition_walk::Looked;
use super::configuration::{Change, ChangeKind, Configuration, NameInChange};
use super::deployment::{Coordinator, CoordinatorNaming, OperatorMay, SimulatedReaction, StepFault};
use super::event::{Ask, UNDO, Verdict};
use super::monitor::{Condition, Monitor, is_monitors};
use super::names::{ComponentName, EventName, Ident, MemberRef, TypeName};
use super::state_list::{StateEntry, StateList, Target};
use super::statechart::{Action, ChartNode, State, Statechart, Trigger, is_internal};
use std::collections::BTreeMap;

/// Puts names within a subsystem.
#[derive(Debug, Clone, Copy)]
pub struct Within<'a> {
    /// Its path.
    pub path: Ident,
    /// Its activities that are those of the parent.
    pub activities: &'a BTreeMap<Ident, Ident>,
}

impl Within<'_> {
    /// An event: those of the statechart itself, and what answers a bare `undo`, are called the same everywhere.
    pub fn event(&self, event: EventName) -> EventName {
        let text = event.as_str();
        let bare = Ask::Undo.subject();
        let about_undo = text == bare || Verdict::split(text).is_some_and(|(subject, _)| subject == bare);
        let own = text == "e_done" || is_internal(text) || about_undo && !text.ends_with(UNDO);
        if own { event } else { event.within(self.path) }
    }

    /// An activity.
    pub fn activity(&self, activity: Ident) -> Ident {
        self.activities.get(&activity).copied().unwrap_or_else(|| activity.within(self.path))
    }

    /// A component.
    pub fn component(&self, component: ComponentName) -> ComponentName {
        component.within(self.path)
    }

    fn member(&self, member: MemberRef) -> MemberRef {
        MemberRef { component: self.component(member.component), ..member }
    }

    /// A type: the monitors of a subsystem are a type of their own, all others are the same everywhere.
    pub fn ty(&self, ty: TypeName) -> TypeName {
        if is_monitors(ty) { ty.within(self.path) } else { ty }
    }

    fn list(&self, list: &StateList) -> StateList {
        let entry = |entry: StateEntry| match entry.target {
            Target::Component(component) => {
                StateEntry { target: Target::Component(self.component(component)), ..entry }
            }
            Target::Default => entry,
        };
        StateList::of(list.iter().map(entry)).unwrap_or_default()
    }

    fn kind(&self, kind: &ChangeKind) -> ChangeKind {
        let mut kind = kind.clone();
        kind.for_each_name_mut(&mut |name| match name {
            NameInChange::Component(component) => *component = self.component(*component),
            NameInChange::Type(ty) => *ty = self.ty(*ty),
            NameInChange::Activity(activity) => *activity = self.activity(*activity),
            NameInChange::Member(member, _) => *member = self.member(*member),
        });
        kind
    }

    /// A condition.
    pub fn condition(&self, condition: &Condition) -> Condition {
        let mut condition = condition.clone();
        condition.for_each_member_mut(&mut |looked| match looked {
            Looked::Member(member) => *member = self.member(*member),
            Looked::Component(component) => *component = self.component(*component),
            Looked::Activity(activity) => *activity = self.activity(*activity),
        });
        condition
    }

    /// A configuration.
    pub fn configuration(&self, of: &Configuration) -> Configuration {
        let change = |change: &Change| Change { kind: self.kind(&change.kind), origin: change.origin };
        let mut within = of.clone();
        within.id = of.id.within(self.path);
        within.pre = self.list(&of.pre);
        within.post = self.list(&of.post);
        within.changes = of.changes.iter().map(change).collect();
        within.group = of.group.map(|group| group.within(self.path));
        within.holds = of.holds.as_ref().map(|holds| self.condition(holds));
        within.confirm.iter_mut().for_each(|confirm| confirm.event = self.event(confirm.event));
        within
    }

    /// A coordinator. One that is called like its deployment is called like the subsystem.
    pub fn coordinator(&self, of: &Coordinator) -> Coordinator {
        let mut within = of.clone();
        within.name = self.coordinator_name(of);
        within.of = Some(of.of.map_or(self.path, |inner| inner.within(self.path)));
        self.chart(&mut within.chart);
        within
    }

    /// What it is called.
    pub fn coordinator_name(&self, of: &Coordinator) -> Ident {
        match of.written {
            CoordinatorNaming::Alone if of.of.is_none() => self.path,
            _ => of.name.within(self.path),
        }
    }

    /// A chart: the events that it hears and raises, and what it asks for.
    pub fn chart(&self, chart: &mut Statechart) {
        self.state(&mut chart.root);
    }

    fn state(&self, state: &mut State) {
        let action = |action: &mut Action| {
            if let Action::Raise(event) = action {
                *event = self.event(*event);
            }
        };
        state.entry.iter_mut().chain(&mut state.exit).for_each(|(of, _)| action(of));
        state.config.iter_mut().for_each(|(id, _)| *id = id.within(self.path));
        for transition in &mut state.transitions {
            transition.effect.iter_mut().for_each(|(of, _)| action(of));
            for (trigger, _) in &mut transition.events {
                if let Trigger::Event(event) = trigger {
                    *event = self.event(*event);
                }
            }
        }
        for child in &mut state.children {
            if let ChartNode::State(child) = child {
                self.state(child);
            }
        }
    }

    /// A monitor.
    pub fn monitor(&self, of: &Monitor) -> Monitor {
        let mut within = of.clone();
        within.name = of.name.within(self.path);
        within.when = self.condition(&of.when);
        within.raise = of.raise.map(|event| self.event(event));
        within.cleared = of.cleared.map(|event| self.event(event));
        within
    }

    /// What an operator may do.
    pub fn operator(&self, may: OperatorMay) -> OperatorMay {
        match may {
            OperatorMay::Apply(id) => OperatorMay::Apply(id.within(self.path)),
            OperatorMay::Set(member) => OperatorMay::Set(self.member(member)),
        }
    }

    /// A reaction of a simulated component.
    pub fn reaction(&self, of: &SimulatedReaction) -> SimulatedReaction {
        SimulatedReaction {
            after: self.step(&of.after),
            raise: self.event(of.raise),
            component: self.component(of.component),
            ..of.clone()
        }
    }

    /// A fault of a step.
    pub fn fault(&self, of: &StepFault) -> StepFault {
        StepFault { step: self.step(&of.step), ..of.clone() }
    }

    /// The text of a step, or its beginning: behind the verb, and behind an arrow, stands what it is about.
    fn step(&self, text: &str) -> String {
        let mut about = false;
        let words = text.split(' ').enumerate().map(|(at, word)| {
            let named = std::mem::replace(&mut about, at == 0 || word == "->");
            if named && !word.is_empty() { format!("{}/{word}", self.path) } else { word.to_owned() }
        });
        words.collect::<Vec<_>>().join(" ")
    }
}
