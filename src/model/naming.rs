//! What is written, by other names: every name of it is changed in one way.

use super::condition_walk::Looked;
use super::configuration::{Change, ChangeKind, Configuration, NameInChange};
use super::deployment::{OperatorMay, SimulatedReaction, StepFault};
use super::monitor::{Condition, Monitor};
use super::names::{ComponentName, ConfigId, EventName, Ident, MemberRef, TypeName};
use super::state_list::{StateEntry, StateList, Target};
use super::statechart::{Action, ChartNode, State, Statechart, Trigger};

/// How names are changed. Names of members, and of states, are those of their type and of their chart: they stay.
pub trait Naming {
    /// An event.
    fn event(&self, event: EventName) -> EventName;
    /// An activity.
    fn activity(&self, activity: Ident) -> Ident;
    /// A component.
    fn component(&self, component: ComponentName) -> ComponentName;
    /// A type.
    fn ty(&self, ty: TypeName) -> TypeName;
    /// A configuration.
    fn id(&self, id: ConfigId) -> ConfigId;
    /// A group, or a monitor.
    fn name(&self, name: Ident) -> Ident;
    /// What the text of a step is about: a component, or a member of one.
    fn about(&self, word: &str) -> String;

    /// A member of a component.
    fn member(&self, member: MemberRef) -> MemberRef {
        MemberRef { component: self.component(member.component), ..member }
    }

    /// A list of run states.
    fn list(&self, list: &StateList) -> StateList {
        let entry = |entry: StateEntry| match entry.target {
            Target::Component(component) => {
                StateEntry { target: Target::Component(self.component(component)), ..entry }
            }
            Target::Default => entry,
        };
        StateList::of(list.iter().map(entry)).unwrap_or_default()
    }

    /// What a change does.
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
    fn condition(&self, condition: &Condition) -> Condition {
        let mut condition = condition.clone();
        condition.for_each_member_mut(&mut |looked| match looked {
            Looked::Member(member) => *member = self.member(*member),
            Looked::Component(component) => *component = self.component(*component),
            Looked::Activity(activity) => *activity = self.activity(*activity),
        });
        condition
    }

    /// A configuration.
    fn configuration(&self, of: &Configuration) -> Configuration {
        let change = |change: &Change| Change { kind: self.kind(&change.kind), origin: change.origin };
        let mut named = of.clone();
        named.id = self.id(of.id);
        named.pre = self.list(&of.pre);
        named.post = self.list(&of.post);
        named.changes = of.changes.iter().map(change).collect();
        named.group = of.group.map(|group| self.name(group));
        named.holds = of.holds.as_ref().map(|holds| self.condition(holds));
        named.confirm.iter_mut().for_each(|confirm| confirm.event = self.event(confirm.event));
        named
    }

    /// A chart: the events that it hears and raises, and what it asks for.
    fn chart(&self, chart: &mut Statechart) {
        self.state(&mut chart.root);
    }

    /// A state, with those in it.
    fn state(&self, state: &mut State) {
        let action = |action: &mut Action| {
            if let Action::Raise(event) = action {
                *event = self.event(*event);
            }
        };
        state.entry.iter_mut().chain(&mut state.exit).for_each(|(of, _)| action(of));
        state.config.iter_mut().for_each(|(id, _)| *id = self.id(*id));
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
    fn monitor(&self, of: &Monitor) -> Monitor {
        let mut named = of.clone();
        named.name = self.name(of.name);
        named.when = self.condition(&of.when);
        named.raise = of.raise.map(|event| self.event(event));
        named.cleared = of.cleared.map(|event| self.event(event));
        named
    }

    /// What an operator may do.
    fn operator(&self, may: OperatorMay) -> OperatorMay {
        match may {
            OperatorMay::Apply(id) => OperatorMay::Apply(self.id(id)),
            OperatorMay::Set(member) => OperatorMay::Set(self.member(member)),
        }
    }

    /// A reaction of a simulated component.
    fn reaction(&self, of: &SimulatedReaction) -> SimulatedReaction {
        SimulatedReaction {
            after: self.step(&of.after),
            raise: self.event(of.raise),
            component: self.component(of.component),
            ..of.clone()
        }
    }

    /// A fault of a step.
    fn fault(&self, of: &StepFault) -> StepFault {
        StepFault { step: self.step(&of.step), ..of.clone() }
    }

    /// The text of a step, or its beginning: behind the verb, and behind an arrow, stands what it is about.
    fn step(&self, text: &str) -> String {
        let mut about = false;
        let words = text.split(' ').enumerate().map(|(at, word)| {
            let named = std::mem::replace(&mut about, at == 0 || word == "->");
            if named && !word.is_empty() { self.about(word) } else { word.to_owned() }
        });
        words.collect::<Vec<_>>().join(" ")
    }
}
