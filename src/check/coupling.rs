//! Several coordinators side by side: what each of them is checked as by itself, what they and an operator touch in common,
//! and who is therefore followed together.

use super::coordinator::ask_of;
use super::interface::told_by;
use super::members::hears_loss;
use crate::model::codes::{COORD_SHARED, DEPLOY_EVENT_UNHEARD};
use crate::model::{
    Ask, Catalogue, ComponentName, ConfigId, Configuration, Deployment, EventName, Finding, Findings, Ident, RequestId,
    Severity, Subsystem, Target,
};
use crate::stack::claims::{self, Claim, Claims};
use crate::stack::contenders::may_hold;
use crate::stack::{Request, Requester};
use crate::statechart::{Chart, EventId};
use std::collections::{BTreeMap, BTreeSet};

/// The deployment as its `number`-th coordinator alone sees it. `charts` are all of them, compiled.
pub fn view(deployment: &Deployment, charts: &[&Chart], number: usize) -> Option<Deployment> {
    let alone = deployment.coordinators.get(number)?.clone();
    let mut seen = Deployment { coordinators: vec![alone], ..deployment.clone() };
    let own = charts[number];
    let others = || charts.iter().enumerate().filter(move |(other, _)| *other != number).map(|(_, chart)| *chart);
    let raises = |chart: &Chart, name| chart.raises().iter().any(|site| site.name == name);
    // What nobody raises is said once, of the first.
    seen.emits.retain(|(event, _)| raises(own, *event) || (number == 0 && !others().any(|c| raises(c, *event))));
    let between = own.raises().iter().filter(|site| others().any(|other| other.event(site.name) != EventId::OTHER));
    seen.emits.extend(between.map(|site| (site.name, site.origin)));
    // A failed state without a coordinator's name is meant of those that have it; of the first, if none does.
    seen.coordinators[0]
        .failed
        .retain(|state| own.find(state).is_ok() || (number == 0 && !others().any(|other| other.find(state).is_ok())));
    Some(seen)
}

/// Configurations that a coordinator asks for.
pub fn asked(deployment: &Deployment, chart: &Chart) -> BTreeSet<ConfigId> {
    let asks = chart.raises().iter().filter_map(|site| ask_of(deployment, site.name));
    asks.filter_map(|ask| match ask {
        Ask::Apply(id) => Some(id),
        _ => None,
    })
    .collect()
}

/// What an operator may ask for at any time.
pub(super) fn by_operator(deployment: &Deployment) -> BTreeSet<ConfigId> {
    let safe = deployment.configurations.iter().filter(|c| c.safe).map(|c| c.id);
    let listed = deployment.operator_applies().filter(|id| deployment.configuration(*id).is_some());
    safe.chain(listed).collect()
}

/// What the configurations of different coordinators touch together, or what an operator may apply touches of both: one
/// finding for each pair of coordinators. `verified`: they were followed together, so that what comes of it is told by
/// findings of its own.
pub fn shared(deployment: &Deployment, charts: &[&Chart], numbers: &[usize], verified: bool) -> Findings {
    if numbers.len() < 2 {
        return Vec::new();
    }
    let names: Vec<Ident> = numbers.iter().map(|number| deployment.coordinators[*number].name).collect();
    let of = |ids: BTreeSet<ConfigId>| -> Vec<ConfigurationExtent<'_>> {
        deployment.configurations.iter().filter(|c| ids.contains(&c.id)).map(ConfigurationExtent::by).collect()
    };
    let all: Vec<_> = numbers.iter().map(|number| of(asked(deployment, charts[*number]))).collect();
    let operated = of(by_operator(deployment));
    let (severity, rest) = match verified {
        true => (Severity::Info, "they were followed together"),
        false => (Severity::Warning, "what they do together was not followed to the end"),
    };
    let mut findings = Vec::new();
    for (a, mine) in all.iter().enumerate() {
        for (b, theirs) in all.iter().enumerate().skip(a + 1) {
            let both = mine.iter().find_map(|one| theirs.iter().find_map(|other| Some((one, other, one.with(other)?))));
            let between = || {
                let met = |of: &ConfigurationExtent<'_>, all: &[ConfigurationExtent<'_>]| {
                    all.iter().find_map(|own| of.with(own))
                };
                operated.iter().find_map(|of| Some((of, met(of, mine)?, met(of, theirs)?)))
            };
            if let Some((one, other, what)) = both {
                let (one, other) = (one.of, other.of);
                let message = format!(
                    "`{}` of the coordinator `{}` and `{}` of `{}` touch {what}: {rest}",
                    one.id, names[a], other.id, names[b]
                );
                findings.push(
                    Finding::new(severity, COORD_SHARED, message)
                        .at(one.origin)
                        .also(other.origin, "the other one")
                        .help("give each coordinator components of its own, or let one ask the other by an event"),
                );
            } else if let Some((of, what, other)) = between() {
                let message = format!(
                    "`{}`, which an operator may apply, touches {what} like the coordinator `{}`, and {other} like `{}`: {rest}",
                    of.of.id, names[a], names[b]
                );
                findings.push(
                    Finding::new(severity, COORD_SHARED, message)
                        .at(of.of.origin)
                        .labelled("touches what both touch")
                        .help("give the operator one for what each coordinator touches"),
                );
            }
        }
    }
    findings
}

/// What a configuration may touch, for words.
struct ConfigurationExtent<'d> {
    of: &'d Configuration,
    components: BTreeSet<ComponentName>,
    /// All there is, by `_default`.
    all: bool,
}

impl<'d> ConfigurationExtent<'d> {
    fn by(of: &'d Configuration) -> Self {
        let mut entries = of.pre.iter().chain(of.post.iter());
        let all = entries.any(|entry| entry.target == Target::Default);
        Self { of, components: claims::components(of), all }
    }

    /// What it touches that another one touches as well.
    fn with(&self, other: &Self) -> Option<String> {
        let group = self.of.group.filter(|group| other.of.group == Some(*group));
        match self.components.intersection(&other.components).next() {
            Some(component) => Some(format!("`{component}`")),
            None if self.of.id == other.of.id => Some("the same, being one configuration".to_owned()),
            None if self.all || other.all => Some("every component, by `_default`".to_owned()),
            None => group.map(|group| format!("the group `{group}`")),
        }
    }
}

/// Takes back that a coordinator does not wait for the event that starts or ends the deployment, if another one does.
pub fn forgive_unheard(deployment: &Deployment, charts: &[&Chart], findings: &mut Findings) {
    for (key, event) in [("deploy.event", deployment.deploy.event), ("shutdown.event", deployment.shutdown.event)] {
        if charts.iter().any(|chart| chart.event(event) != EventId::OTHER) {
            findings.retain(|f| f.code != DEPLOY_EVENT_UNHEARD || f.path != key);
        }
    }
}

/// What coordinators and an operator may meet in, known from the text of what they ask for.
struct Meeting<'a> {
    deployment: &'a Deployment,
    /// What components that the configurations name may hold for themselves.
    held: BTreeMap<ComponentName, BTreeSet<String>>,
    charts: &'a [&'a Chart],
    claims: Claims,
    /// What each coordinator may ask for, and what that claims.
    asked: Vec<(BTreeSet<ConfigId>, Claim)>,
}

impl<'a> Meeting<'a> {
    fn of(deployment: &'a Deployment, catalogue: &'a Catalogue, charts: &'a [&'a Chart]) -> Self {
        let claims = Claims::new(deployment.configurations.iter(), catalogue);
        let asked = |chart: &&Chart| {
            let ids = asked(deployment, chart);
            let claim = claimed(&claims, &ids);
            (ids, claim)
        };
        let asked = charts.iter().map(asked).collect();
        let held = may_hold(deployment.configurations.iter(), catalogue);
        Self { deployment, held, charts, claims, asked }
    }

    /// Whether two coordinators have to do with each other.
    fn meets(&self, a: usize, b: usize) -> bool {
        let ((own, claim), (other, theirs)) = (&self.asked[a], &self.asked[b]);
        let hears = |a: usize, b: usize| {
            let mut raises = self.charts[a].raises().iter();
            raises.any(|site| self.charts[b].event(site.name) != EventId::OTHER)
        };
        // What a simulated component reports comes of who has it.
        let simulated = self.deployment.kind.imitates;
        let reactions = || self.deployment.reactions.iter().filter(|_| simulated);
        let has = |ids: &BTreeSet<ConfigId>, component| {
            let mut configurations = ids.iter().filter_map(|id| self.deployment.configuration(*id));
            configurations.any(|c| claims::components(c).contains(&component))
        };
        let reports = |ids: &BTreeSet<ConfigId>, to: usize| {
            let heard = |raise| self.charts[to].event(raise) != EventId::OTHER;
            reactions().any(|reaction| heard(reaction.raise) && has(ids, reaction.component))
        };
        let same = own.intersection(other).next().is_some();
        // A safe configuration in force keeps what was not confirmed from being taken back, whosever it is, where that moves.
        let of = |ids: &BTreeSet<ConfigId>, is: fn(&Configuration) -> bool| {
            ids.iter().any(|id| self.deployment.configuration(*id).is_some_and(is))
        };
        let withholds = |a, b| of(a, |c| c.safe) && of(b, |c| c.confirm.is_some());
        same || self.lead(a, b)
            || self.lead(b, a)
            || withholds(own, other)
            || withholds(other, own)
            || hears(a, b)
            || hears(b, a)
            || reports(own, b)
            || reports(other, a)
            || claim.meets(theirs)
    }

    /// Whether one says something that what the other does with subsystems, or with what a parent may touch, depends on.
    fn lead(&self, a: usize, b: usize) -> bool {
        let raises =
            |number: usize, event: EventName| self.charts[number].raises().iter().any(|site| site.name == event);
        let touched = |number: usize, is: &dyn Fn(ComponentName) -> bool| {
            let mut configurations = self.asked[number].0.iter().filter_map(|id| self.deployment.configuration(*id));
            configurations.any(|c| claims::components(c).into_iter().any(is))
        };
        let commands = |number: usize, subsystem: &Subsystem| {
            let own = &*subsystem.own;
            let until = own.interface.leaving.map(|leaving| leaving.until);
            let mut all = [own.deploy.event, own.shutdown.event].into_iter().chain(until);
            all.any(|event| raises(number, event.within(subsystem.name)))
        };
        let meets = |subsystem: &Subsystem| {
            let hears = || told_by(subsystem).into_iter().any(|event| self.charts[b].event(event) != EventId::OTHER);
            let touches = || touched(b, &|component| component.local(subsystem.name).is_some());
            // Two that may hold the same thing are not both to be begun.
            let contends = || {
                let mut others = self.deployment.subsystems.iter().filter(|other| other.name != subsystem.name);
                others.any(|other| !other.holds.is_disjoint(&subsystem.holds) && commands(b, other))
            };
            let held = |component| self.held.get(&component).is_some_and(|held| !held.is_disjoint(&subsystem.holds));
            commands(a, subsystem)
                && (commands(b, subsystem) || hears() || touches() || contends() || touched(b, &held))
        };
        let interface = &self.deployment.interface;
        let exported = |component| interface.exports.values().any(|export| export.of.component == component);
        self.deployment.subsystems.iter().any(meets)
            || interface.from.is_some_and(|(from, _)| raises(a, from) && touched(b, &exported))
    }

    /// Whether what a coordinator does and this, done by an operator, have to do with each other.
    fn is_met(&self, number: usize, id: ConfigId) -> bool {
        let own = claimed(&self.claims, &BTreeSet::from([id]));
        own.meets(&self.asked[number].1) || hears_loss(self.charts, &[number], id)
    }
}

/// What these claim together.
fn claimed(claims: &Claims, ids: &BTreeSet<ConfigId>) -> Claim {
    let request = |id: &ConfigId| Request::new(RequestId(0), Ask::Apply(*id), Requester::Operator);
    claims.of(&ids.iter().map(request).collect::<Vec<_>>())
}

/// The coordinators in groups that have nothing to do with each other: they touch nothing in common, hear nothing of each
/// other, and nothing that an operator may apply touches what both touch. That a safe configuration of one group interrupts what is under
/// way of another one is followed as something that may come at any time ([`safe_elsewhere`]). What holds of each group holds of all
/// together, but for when all of them are *down* at once (`Graph::goes_on_when_down`).
pub fn groups(deployment: &Deployment, catalogue: &Catalogue, charts: &[&Chart]) -> Vec<Vec<usize>> {
    if charts.len() < 2 {
        return (0..charts.len()).map(|number| vec![number]).collect();
    }
    let meeting = Meeting::of(deployment, catalogue, charts);
    let met = |id| (0..charts.len()).filter(|number| meeting.is_met(*number, id)).collect::<Vec<_>>();
    let between: Vec<Vec<usize>> = by_operator(deployment).into_iter().map(met).collect();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for number in 0..charts.len() {
        let operated = |other: usize| between.iter().any(|met| met.contains(&number) && met.contains(&other));
        let meets = |other: &usize| meeting.meets(number, *other) || operated(*other);
        let (with, without): (Vec<_>, Vec<_>) = groups.into_iter().partition(|group| group.iter().any(meets));
        groups = without;
        let mut group: Vec<usize> = with.into_iter().flatten().chain([number]).collect();
        group.sort_unstable();
        groups.push(group);
    }
    groups.sort_unstable();
    groups
}

/// Whether an operator may have frames for several groups. Where the stack is full the oldest are squashed into one, which touches then
/// what both touch.
pub fn is_tied(deployment: &Deployment, catalogue: &Catalogue, charts: &[&Chart], groups: &[Vec<usize>]) -> bool {
    let meeting = Meeting::of(deployment, catalogue, charts);
    let ids = by_operator(deployment);
    let met = |group: &&Vec<usize>| ids.iter().any(|id| group.iter().any(|number| meeting.is_met(*number, *id)));
    groups.iter().filter(met).count() > 1
}

/// A safe configuration that touches nothing that a group touches, whoever asks for it: of several one stands for all, since of each
/// nothing is seen but that it interrupts.
pub fn safe_elsewhere(
    deployment: &Deployment,
    catalogue: &Catalogue,
    charts: &[&Chart],
    numbers: &[usize],
) -> Option<ConfigId> {
    if numbers.len() == charts.len() {
        return None;
    }
    let meeting = Meeting::of(deployment, catalogue, charts);
    let met = |id: ConfigId| numbers.iter().any(|number| meeting.is_met(*number, id));
    deployment.configurations.iter().filter(|c| c.safe).map(|c| c.id).find(|id| !met(*id))
}

/// What of an operator is followed with a group: what touches something that it touches. What touches nothing that anybody touches is
/// followed with the first coordinator; what is safe and touches nothing of a group is what interrupts it ([`safe_elsewhere`]).
pub fn operated(deployment: &Deployment, catalogue: &Catalogue, charts: &[&Chart], numbers: &[usize]) -> Vec<ConfigId> {
    let ids = by_operator(deployment);
    if numbers.len() == charts.len() {
        return ids.into_iter().collect();
    }
    let meeting = Meeting::of(deployment, catalogue, charts);
    let followed = |id: &ConfigId| {
        let mut met = (0..charts.len()).filter(|number| meeting.is_met(*number, *id)).peekable();
        let safe = deployment.configuration(*id).is_some_and(|c| c.safe);
        let nobody = met.peek().is_none() && numbers.contains(&0) && !safe;
        // One in force withholds reverts that move.
        let withholds = safe && deployment.configurations.iter().any(|c| c.confirm.is_some());
        nobody || withholds || met.any(|number| numbers.contains(&number))
    };
    ids.into_iter().filter(followed).collect()
}
