//! Walking through conditions: everything in one, its signals, the components that it looks at.

use super::finding::Origin;
use super::monitor::{Condition, ConditionKind, MonitoredSignal, SignalKind};
use super::names::{ComponentName, Ident, MemberRef};

/// What a condition of this kind is made of, to be looked at or to be changed.
macro_rules! parts {
    ($kind:expr) => {{
        use ConditionKind as K;
        match $kind {
            K::Compare { .. } | K::IsTrue(_) | K::InState { .. } | K::Faulted(_) | K::Silent { .. } => Vec::new(),
            K::All(list) | K::Any(list) => Vec::from_iter(list),
            K::No(c) | K::Rise(c) | K::Fall(c) => vec![c],
            K::Once { condition: c, .. }
            | K::Historically { condition: c, .. }
            | K::ForAtLeast { condition: c, .. }
            | K::WithinLast { condition: c, .. } => vec![c],
            K::Implies(a, b) | K::Since { hold: a, from: b, .. } => vec![a, b],
        }
    }};
}

impl Condition {
    /// What it is made of.
    pub fn parts(&self) -> Vec<&Self> {
        parts!(&self.kind)
    }

    fn parts_mut(&mut self) -> Vec<&mut Self> {
        parts!(&mut self.kind)
    }

    /// Calls `f` with it and all that it is made of, outer ones first.
    pub fn for_each<'a>(&'a self, f: &mut impl FnMut(&'a Self)) {
        f(self);
        self.parts().into_iter().for_each(|part| part.for_each(f));
    }

    /// Calls `f` with every signal in it, outer ones first.
    pub fn for_each_signal<'a>(&'a self, f: &mut impl FnMut(&'a MonitoredSignal)) {
        self.for_each(&mut |condition| {
            if let ConditionKind::Compare { left, right, .. } = &condition.kind {
                left.for_each(f);
                right.for_each(f);
            }
        });
    }

    /// Calls `f` with every component that it looks at and where it does, as often as it stands in it.
    pub fn for_each_component(&self, f: &mut impl FnMut(ComponentName, Origin)) {
        self.for_each(&mut |condition| match &condition.kind {
            ConditionKind::IsTrue(port) => f(port.member.component, condition.origin),
            ConditionKind::InState { component, .. } | ConditionKind::Faulted(component) => {
                f(*component, condition.origin);
            }
            ConditionKind::Silent { port, .. } => f(port.component, condition.origin),
            _ => {}
        });
        self.for_each_signal(&mut |signal| match &signal.kind {
            SignalKind::Port(port) => f(port.member.component, signal.origin),
            SignalKind::Age(port) | SignalKind::Rate { port, .. } => f(port.component, signal.origin),
            _ => {}
        });
    }

    /// Calls `f` with every component that it looks at, as often as it stands in it: to put another in its place.
    pub fn for_each_component_mut(&mut self, f: &mut impl FnMut(&mut ComponentName)) {
        self.for_each_member_mut(&mut |looked| match looked {
            Looked::Member(member) => f(&mut member.component),
            Looked::Component(component) => f(component),
            Looked::Activity(_) => {}
        });
    }

    /// Calls `f` with all that it looks at, as often as it stands in it: to put another in its place.
    pub fn for_each_member_mut(&mut self, f: &mut impl FnMut(Looked<'_>)) {
        use ConditionKind as K;
        match &mut self.kind {
            K::Compare { left, right, .. } => {
                left.for_each_member_mut(f);
                right.for_each_member_mut(f);
            }
            K::IsTrue(port) => f(Looked::Member(&mut port.member)),
            K::InState { component, .. } | K::Faulted(component) => f(Looked::Component(component)),
            K::Silent { port, .. } => f(Looked::Member(port)),
            _ => {}
        }
        self.parts_mut().into_iter().for_each(|part| part.for_each_member_mut(f));
    }
}

/// What a condition looks at.
#[derive(Debug)]
pub enum Looked<'a> {
    /// A port.
    Member(&'a mut MemberRef),
    /// A component.
    Component(&'a mut ComponentName),
    /// An activity.
    Activity(&'a mut Ident),
}

impl MonitoredSignal {
    /// Calls `f` with all that it looks at.
    fn for_each_member_mut(&mut self, f: &mut impl FnMut(Looked<'_>)) {
        use SignalKind as K;
        match &mut self.kind {
            K::Port(port) => f(Looked::Member(&mut port.member)),
            K::Age(port) | K::Rate { port, .. } => f(Looked::Member(port)),
            K::Activity { activity, .. } => f(Looked::Activity(activity)),
            K::Constant(_) => {}
            K::Norm(list) | K::Min(list) | K::Max(list) => list.iter_mut().for_each(|s| s.for_each_member_mut(f)),
            K::Difference(a, b) => {
                a.for_each_member_mut(f);
                b.for_each_member_mut(f);
            }
            K::Abs(s) => s.for_each_member_mut(f),
        }
    }

    /// Calls `f` with it and all that it is made of, outer ones first.
    pub fn for_each<'a>(&'a self, f: &mut impl FnMut(&'a Self)) {
        use SignalKind as K;
        f(self);
        match &self.kind {
            K::Port(_) | K::Age(_) | K::Rate { .. } | K::Activity { .. } | K::Constant(_) => {}
            K::Norm(list) | K::Min(list) | K::Max(list) => list.iter().for_each(|s| s.for_each(f)),
            K::Difference(a, b) => {
                a.for_each(f);
                b.for_each(f);
            }
            K::Abs(s) => s.for_each(f),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::monitor::{Comparison, Interval, PortSignal, SELF};
    use super::super::run_state::RunState;
    use super::*;
    use std::time::Duration;

    #[test]
    fn the_component_itself_is_put_in_everywhere() {
        use super::super::component_type::{Effect, OperationType};
        use ConditionKind as K;
        let port = |text: &str| text.parse::<PortSignal>().unwrap();
        let name = |text: &str| ComponentName::new(text).unwrap();
        let about = |who: &str| {
            let signal = |kind| Box::new(MonitoredSignal::new(kind));
            let list = vec![
                MonitoredSignal::new(SignalKind::Abs(signal(SignalKind::Port(port(&format!("{who}.x[1]")))))),
                MonitoredSignal::new(SignalKind::Age(port(&format!("{who}.x")).member)),
                MonitoredSignal::new(SignalKind::Difference(
                    signal(SignalKind::Rate { port: port(&format!("{who}.x")).member, over: Duration::from_secs(1) }),
                    signal(SignalKind::Constant(1.0)),
                )),
            ];
            let (left, right) =
                (MonitoredSignal::new(SignalKind::Norm(list)), MonitoredSignal::new(SignalKind::Constant(2.0)));
            let compare = K::Compare { left, op: Comparison::Above, right, hysteresis: None };
            let leaves = [
                compare,
                K::IsTrue(port(&format!("{who}.on"))),
                K::InState { component: name(who), state: RunState::Running },
                K::Faulted(name(who)),
                K::Silent { port: port(&format!("{who}.x")).member, time: Duration::from_secs(1) },
                K::IsTrue(port("other.on")),
            ];
            let [a, b, c, d, e, other] = leaves.map(|kind| Box::new(Condition::new(kind)));
            let interval = Interval { from: Duration::ZERO, to: None };
            let time = Duration::from_secs(1);
            Condition::new(K::All(vec![
                Condition::new(K::Implies(a, b)),
                Condition::new(K::Since { hold: c, from: d, interval }),
                Condition::new(K::No(Box::new(Condition::new(K::ForAtLeast { condition: e, time })))),
                *other,
            ]))
        };
        let operation = OperationType { settled_by: Some(about(SELF)), ..OperationType::new(Effect::None) };
        assert_eq!(operation.settled_by_for(name("left/arm")), Some(about("left/arm")));
        assert_eq!(OperationType::new(Effect::None).settled_by_for(name("arm")), None);
    }
}
