//! Whether what a configuration stands for (`holds`) can be true at all where it has just been applied.
//!
//! Run states are known of a world; what ports carry and activities count is not, and is taken to speak for it. So it is the
//! monitors' own evaluator that decides: what is false even then cannot come true before the configuration's time is over.

use super::coupling;
use super::declared::is_unseen;
use super::members::requester;
use crate::limits;
use crate::model::codes::CONF_HOLDS_NEVER;
use crate::model::monitor::{Condition, ConditionKind};
use crate::model::{
    Ask, Catalogue, ComponentName, ConfigId, Configuration, Deployment, Finding, RequestId, RunState, Target,
};
use crate::monitor::{Bank, InputSample, MonitorInput, state_value};
use crate::stack::claims::{Claims, components};
use crate::stack::{Request, Requester};
use crate::statechart::Chart;
use crate::system::{System, View};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

/// Configurations of which it can be told: the platform shows what they look at, and nobody else can change that before
/// their time is over. And whether there are others that look at run states, of which it cannot.
pub fn judged(deployment: &Deployment, catalogue: &Catalogue, charts: &[&Chart]) -> (FxHashSet<ConfigId>, bool) {
    let (mut all, mut left) = (FxHashSet::default(), false);
    if deployment.configurations.iter().all(|c| c.holds.is_none()) {
        return (all, left);
    }
    let claims = Claims::new(deployment.configurations.iter(), catalogue);
    let names = deployment.coordinators.iter().map(|coordinator| requester(coordinator.name));
    let asked = charts.iter().map(|chart| coupling::asked(deployment, chart));
    let operator = (Requester::Operator, deployment.operator_applies().collect());
    let by: Vec<(Requester, BTreeSet<ConfigId>)> = names.zip(asked).chain([operator]).collect();
    let alone = by.iter().filter(|(_, ids)| !ids.is_empty()).count() < 2;
    let claim = |id: ConfigId| claims.of([&Request::new(RequestId(0), Ask::Apply(id), Requester::Operator)]);
    for configuration in deployment.configurations.iter().filter(|c| !c.safe) {
        let Some(holds) = configuration.holds.as_ref().filter(|holds| !is_unseen(deployment, holds)) else { continue };
        let (own, claimed) = (claim(configuration.id), components(configuration));
        let mut free = false;
        holds.for_each_component(&mut |component, _| {
            let touches = |c: &&Configuration| {
                let mut states = c.pre.iter().chain(c.post.iter());
                components(c).contains(&component) || states.any(|entry| entry.target == Target::Default)
            };
            let others = deployment.configurations.iter().filter(|c| !c.safe).filter(touches);
            let beside = others.into_iter().any(|c| !claim(c.id).meets(&own));
            let strange = component.prefix() != configuration.id.prefix();
            free |= strange || !alone && !claimed.contains(&component) && beside;
        });
        // What nothing in the world makes true in its time is known, too.
        let patience = configuration.timeout.unwrap_or(deployment.limits.step_timeout);
        let nothing = System::new(Arc::default());
        let never = || comes_true(&favoured(holds, true, &|_| false), &nothing, patience).is_none();
        if !free || never() {
            all.insert(configuration.id);
        } else {
            left |= looks_at_states(holds) && by.iter().any(|(_, ids)| ids.contains(&configuration.id));
        }
    }
    (all, left)
}

/// Whether anything of it rests on run states.
fn looks_at_states(condition: &Condition) -> bool {
    let mut found = false;
    condition
        .for_each(&mut |part| found |= matches!(part.kind, ConditionKind::InState { .. } | ConditionKind::Faulted(_)));
    found
}

/// That what a configuration stands for is false where it has just been applied, and stays so until its time is over.
pub fn never(deployment: &Deployment, configuration: &Configuration, system: &System) -> Option<Finding> {
    let holds = configuration.holds.as_ref()?;
    let patience = configuration.timeout.unwrap_or(deployment.limits.step_timeout);
    if comes_true(&favoured(holds, true, &is_known), system, patience).is_some() {
        return None;
    }
    let mut named: BTreeSet<ComponentName> = BTreeSet::new();
    holds.for_each_component(&mut |component, _| _ = named.insert(component));
    let state = |component: &ComponentName| match system.component(*component) {
        Some(node) => format!("`{component}` is {} then", node.state),
        None => format!("there is no `{component}` then"),
    };
    let states: Vec<String> = named.iter().map(state).collect();
    let id = configuration.id;
    let message = format!("`{id}` can only fail: what it stands for is false once it has been applied");
    let help = "let it bring what it looks at there itself (`post_conf_state`), ask for it where that is so already, or \
                correct `holds`";
    Some(
        Finding::error(CONF_HOLDS_NEVER, message)
            .at(holds.origin)
            .labelled(states.join(", "))
            .path(format!("configurations.{id}.holds"))
            .help(help),
    )
}

/// After what time a condition is true, nothing changing; none: not within so long.
fn comes_true(condition: &Condition, system: &System, patience: Duration) -> Option<Duration> {
    let mut now = Time::default();
    let until = now + patience;
    let mut bank = Bank::alone(condition, now);
    let inputs = bank.inputs().to_vec();
    let state = |component: &ComponentName| system.component(*component).map(|node| node.state);
    let of = |input: &MonitorInput| match input {
        MonitorInput::State(component) => state(component).map(state_value),
        MonitorInput::Faulted(component) => {
            state(component).map(|state| f64::from(u8::from(state == RunState::Faulted)))
        }
        MonitorInput::Port(_) | MonitorInput::Activity { .. } => None,
    };
    let samples: Vec<InputSample> = inputs
        .iter()
        .map(|input| {
            let value = of(input);
            InputSample { value: value.unwrap_or_default(), at: now, writes: 0, present: value.is_some() }
        })
        .collect();
    for _ in 0..limits::CHECK_STANDS {
        bank.step(now, &mut |input| samples[input], &mut |_, _| {});
        if bank.is_true(0) == Some(true) {
            return Some(now.since(Time::default()));
        }
        match bank.next_wake() {
            Some(wake) if wake <= until => now = wake.max(now + Duration::from_nanos(1)),
            _ => return None,
        }
    }
    // Nobody knows.
    Some(Duration::ZERO)
}

/// The condition where what is not `known` speaks for it (or, `so` being false, against it).
fn favoured(condition: &Condition, so: bool, known: &dyn Fn(&Condition) -> bool) -> Condition {
    use ConditionKind as K;
    let one = |condition: &Condition, so: bool| Box::new(favoured(condition, so, known));
    let each = |all: &[Condition]| all.iter().map(|condition| favoured(condition, so, known)).collect();
    let unknown = || if so { K::All(Vec::new()) } else { K::Any(Vec::new()) };
    let kind = match &condition.kind {
        K::InState { .. } | K::Faulted(_) if known(condition) => condition.kind.clone(),
        K::InState { .. } | K::Faulted(_) | K::Compare { .. } | K::IsTrue(_) | K::Silent { .. } => unknown(),
        K::All(all) => K::All(each(all)),
        K::Any(all) => K::Any(each(all)),
        K::No(of) => K::No(one(of, !so)),
        K::Implies(when, then) => K::Implies(one(when, !so), one(then, so)),
        // What is not known may turn at any moment.
        K::Rise(of) | K::Fall(of) if known(of) => condition.kind.clone(),
        K::Rise(_) | K::Fall(_) => unknown(),
        K::Once { condition, interval } => K::Once { condition: one(condition, so), interval: *interval },
        K::Historically { condition, interval } => {
            K::Historically { condition: one(condition, so), interval: *interval }
        }
        K::Since { hold, from, interval } => K::Since { hold: one(hold, so), from: one(from, so), interval: *interval },
        K::ForAtLeast { condition, time } => K::ForAtLeast { condition: one(condition, so), time: *time },
        K::WithinLast { condition, time } => K::WithinLast { condition: one(condition, so), time: *time },
    };
    Condition { kind, origin: condition.origin }
}

/// How long after its last step a configuration stands on the simulated platform, in a system as it has left it; none: it does
/// not. What the platform does not show counts as true.
pub fn stands_after(deployment: &Deployment, configuration: &Configuration, system: &System) -> Option<Duration> {
    let Some(holds) = &configuration.holds else { return Some(Duration::ZERO) };
    if !is_known(holds) {
        return Some(Duration::ZERO);
    }
    comes_true(holds, system, configuration.timeout.unwrap_or(deployment.limits.step_timeout))
}

/// How long each configuration is not answered at least, since it has to stand so long.
pub fn standing(deployment: &Deployment) -> FxHashMap<ConfigId, Duration> {
    let all = deployment.configurations.iter().filter(|c| !c.safe);
    all.map(|c| (c.id, least(deployment, c))).filter(|(_, lasts)| !lasts.is_zero()).collect()
}

/// How long it takes at least from its last step until a configuration stands, whatever is there.
fn least(deployment: &Deployment, configuration: &Configuration) -> Duration {
    let Some(holds) = &configuration.holds else { return Duration::ZERO };
    let nothing = System::new(Arc::default());
    let patience = configuration.timeout.unwrap_or(deployment.limits.step_timeout);
    comes_true(&favoured(holds, true, &|_| false), &nothing, patience).unwrap_or_default()
}

/// Whether it rests on run states alone.
fn is_known(condition: &Condition) -> bool {
    use ConditionKind as K;
    let mut known = true;
    condition.for_each(&mut |part| known &= !matches!(part.kind, K::Compare { .. } | K::IsTrue(_) | K::Silent { .. }));
    known
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::monitor::PortSignal;
    use crate::model::{Catalogue, Origin};

    fn of(kind: ConditionKind) -> Condition {
        Condition { kind, origin: Origin::NONE }
    }

    /// What is not known speaks for the condition, on whichever side of a `no` or an `implies` it stands.
    #[test]
    fn what_is_not_known_speaks_for_it() {
        use ConditionKind as K;
        let port = || of(K::IsTrue(PortSignal::whole("a.y".parse().unwrap())));
        let runs = || of(K::InState { component: ComponentName::new("b").unwrap(), state: RunState::Running });
        let no = |of_this: Condition| of(K::No(Box::new(of_this)));
        let both = |a, b| of(K::All(vec![a, b]));
        let implies = |a, b| of(K::Implies(Box::new(a), Box::new(b)));
        let system = System::new(Arc::new(Catalogue::default()));
        let may = |condition: &Condition| {
            comes_true(&favoured(condition, true, &is_known), &system, Duration::from_secs(1)).is_some()
        };
        for open in [port(), no(port()), implies(port(), runs()), no(both(port(), no(runs()))), implies(runs(), runs())]
        {
            assert!(may(&open), "{open:?}");
        }
        let never = [
            runs(),
            both(port(), runs()),
            no(no(both(port(), runs()))),
            no(implies(port(), runs())).clone(),
            of(K::Rise(Box::new(runs()))),
        ];
        for (at, condition) in never.iter().enumerate() {
            assert_eq!(may(condition), at == 3, "{condition:?}");
        }
    }
}
