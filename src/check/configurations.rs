//! Each configuration by itself, against everything that any configuration creates: names, types, units, limits.
//!
//! The preconditions are those of `system::step`, looked at on a picture of what may be there: for each name every type
//! that some configuration creates under it, and of those what one configuration leaves of it (see [`Universe::during`]).
//! What holds in every case is wrong. What depends on the system it meets (is the component there, in which run state, what
//! drives the port) is found where it is requested: see `explore`.

use super::universe::{Creation, Creations, Universe};
use crate::limits;
use crate::model::codes::{CHANGE_TWICE, MISSING_PROPERTY};
use crate::model::finding::nearest;
use crate::model::{
    Change, ChangeKind, ComponentName, ConfigId, Configuration, Deployment, Finding, Findings, Origin, Severity,
    Target, TypeName,
};
use crate::plan::meant::Meant;
use crate::plan::{ConflictSubject, PlanContext};
use crate::system::{Picture, Violation, either};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// What stands for all other components in a list of states.
const DEFAULT: &str = "_default";

/// What is wrong with each configuration by itself.
pub fn check(deployment: &Deployment, universe: &Universe) -> Findings {
    let all: Vec<ConfigId> = deployment.configurations.iter().map(|c| c.id).collect();
    let mut findings = some(deployment, universe, &all);
    deployment.configurations.iter().for_each(|configuration| twice(configuration, &mut findings));
    findings
}

/// What is wrong with these configurations by themselves.
pub fn some(deployment: &Deployment, universe: &Universe, ids: &[ConfigId]) -> Findings {
    let mut check = ConfigurationCheck { universe, context: PlanContext::of(deployment), findings: Vec::new() };
    for configuration in deployment.configurations.iter().filter(|c| ids.contains(&c.id)) {
        check.configuration(configuration);
    }
    check.findings
}

/// What stands in a configuration a second time is done once: of an operation that may not be what was meant.
fn twice(configuration: &Configuration, findings: &mut Findings) {
    let mut known: FxHashMap<ConflictSubject, &Change> = FxHashMap::default();
    for (i, second) in configuration.changes.iter().enumerate() {
        let first = *known.entry(ConflictSubject::of(&second.kind)).or_insert(second);
        // Of others with one subject it is said that they clash.
        if std::ptr::eq(first, second) || first.kind != second.kind {
            continue;
        }
        let (severity, help) = match second.kind {
            ChangeKind::OperationCall { .. } => {
                (Severity::Warning, "to call it twice write two configurations, and apply them one after the other")
            }
            _ => (Severity::Info, "remove one of the two"),
        };
        let finding = Finding::new(severity, CHANGE_TWICE, format!("`{}` stands twice, and is done once", second.kind))
            .at(second.origin)
            .labelled("again")
            .also(first.origin, "first here")
            .help(help);
        findings.push(finding.path(format!("configurations.{}.changes[{i}]", configuration.id)));
    }
}

/// A component of a change, and one of the ways in which it may have been created.
type ChangedComponent<'a> = (ComponentName, &'a Creation);

/// A change names two components at most.
type ChangedComponents<'a> = SmallVec<[ChangedComponent<'a>; 2]>;

/// A combination of such ways, and the violations that a change then has.
struct Case<'a> {
    parts: ChangedComponents<'a>,
    picture: Picture<'a>,
    found: Vec<Violation>,
}

struct ConfigurationCheck<'a> {
    universe: &'a Universe,
    context: PlanContext,
    findings: Findings,
}

impl<'a> ConfigurationCheck<'a> {
    fn configuration(&mut self, configuration: &Configuration) {
        for (list, entries) in [("pre_conf_state", &configuration.pre), ("post_conf_state", &configuration.post)] {
            let path = |i: usize| format!("configurations.{}.{list}[{i}]", configuration.id);
            for (i, entry) in entries.iter().enumerate() {
                if let Target::Component(component) = entry.target
                    && self.universe.of(component).is_empty()
                {
                    let mut unknown = self.universe.unknown(component, entry.origin);
                    if component.as_str().starts_with('_')
                        && let Some(near) = nearest(component.as_str(), [DEFAULT])
                    {
                        unknown = unknown.help(format!("did you mean `{near}`?"));
                    }
                    self.findings.push(unknown.path(path(i)));
                }
            }
        }
        for (i, change) in configuration.changes.iter().enumerate() {
            let mut found = self.change(configuration.id, change);
            // One that is misspelt is missing as well: first how it is spelt.
            found.sort_by_key(|finding| finding.code == MISSING_PROPERTY);
            let path = || format!("configurations.{}.changes[{i}]", configuration.id);
            self.findings.extend(found.into_iter().map(|f| f.at(change.origin).path(path())));
        }
    }

    fn change(&self, id: ConfigId, change: &Change) -> Findings {
        let (mut findings, mut ways) = (Findings::new(), SmallVec::<[(ComponentName, Creations<'a>); 2]>::new());
        // A create is judged by what is written in it, whatever bore the name before.
        let named =
            if matches!(change.kind, ChangeKind::Create { .. }) { None } else { Some(change.kind.components()) };
        let old = matches!(
            change.kind,
            ChangeKind::Disconnect { .. } | ChangeKind::Destroy { .. } | ChangeKind::Replace { .. }
        );
        for component in named.into_iter().flatten() {
            let creations = self.universe.during(component, id, old);
            if creations.is_empty() {
                findings.push(self.universe.unknown(component, change.origin));
            }
            // What may be anything is not judged; that a type is unknown is said where it is created.
            let judged = creations.len() <= limits::CHECK_TYPES && creations.iter().all(|c| c.description.is_some());
            if judged && !creations.is_empty() {
                ways.push((component, creations));
            }
        }
        let mut cases = Vec::new();
        for parts in combinations(&ways) {
            let picture = self.universe.picture(&parts);
            let mut found = Meant::of(&change.kind, &picture, &self.context).violations(&picture);
            found.retain(Violation::is_of_types);
            if found.is_empty() {
                return findings;
            }
            cases.push(Case { parts, picture, found });
        }
        findings.extend(in_every(&cases));
        findings
    }
}

/// Every combination of the ways in which the components may have been created; of no components the one of nothing.
fn combinations<'a>(ways: &[(ComponentName, Creations<'a>)]) -> impl Iterator<Item = ChangedComponents<'a>> {
    let all: usize = ways.iter().map(|(_, creations)| creations.len()).product();
    (0..all).map(move |mut number| {
        // The ways of the last component change fastest.
        let mut parts: ChangedComponents<'a> = SmallVec::new();
        for (component, creations) in ways.iter().rev() {
            parts.push((*component, creations[number % creations.len()]));
            number /= creations.len();
        }
        parts.reverse();
        parts
    })
}

/// The violations that hold in every case; where each case has others, the first of each.
fn in_every(cases: &[Case<'_>]) -> Findings {
    let Some((first, others)) = cases.split_first() else { return Vec::new() };
    let several = several(cases);
    let mut findings = Vec::new();
    for violation in &first.found {
        let like = |case: &Case<'_>| case.found.iter().find(|other| other.is_like(violation)).cloned();
        let Some(same) = others.iter().map(like).collect::<Option<Vec<_>>>() else { continue };
        let whole = same.iter().fold(violation.clone(), |whole, other| whole.or(other));
        let mut finding = whole.finding(&first.picture);
        let told = matches!(whole, Violation::UnknownMember { .. });
        let about: Vec<&(ComponentName, Vec<&Creation>)> =
            several.iter().filter(|(component, _)| whole.is_about(*component)).collect();
        if !told && !about.is_empty() {
            let whichever: Vec<String> = about
                .iter()
                .map(|(component, creations)| {
                    let types: Vec<TypeName> = creations.iter().map(|creation| creation.ty).collect();
                    format!("`{component}` is {}", either(&types))
                })
                .collect();
            finding.message.push_str(&format!(", whether {}", whichever.join(" and ")));
        }
        if told && about.is_empty() {
            let created = first.parts.iter().filter(|(component, _)| whole.is_about(*component));
            finding = created.fold(finding, |finding, part| finding.also(part.1.origin, created_as(part)));
        }
        for (component, creations) in about {
            for creation in creations {
                finding = finding.also(creation.origin, created_as(&(*component, creation)));
            }
        }
        findings.push(finding);
    }
    if let (true, Some(violation)) = (findings.is_empty(), first.found.first()) {
        let mut finding = violation.finding(&first.picture);
        finding.message.push_str(&format!(", if {}", as_what(first, &several).1));
        for case in others {
            let (origin, what) = as_what(case, &several);
            if let Some(found) = case.found.first() {
                finding = finding.also(origin, format!("if {what}: {found}"));
            }
        }
        findings.push(finding);
    }
    findings
}

/// The components that may be of several types, with the ways in which they are created.
fn several<'a>(cases: &[Case<'a>]) -> Vec<(ComponentName, Vec<&'a Creation>)> {
    let mut all: Vec<(ComponentName, Vec<&'a Creation>)> = Vec::new();
    for (component, creation) in cases.iter().flat_map(|case| &case.parts) {
        match all.iter_mut().find(|(name, _)| name == component) {
            None => all.push((*component, vec![creation])),
            Some((_, creations)) if creations.iter().all(|c| c.ty != creation.ty) => creations.push(creation),
            Some(_) => {}
        }
    }
    all.retain(|(_, creations)| creations.len() > 1);
    all
}

fn created_as((component, creation): &ChangedComponent<'_>) -> String {
    format!("`{component}` is created here as {}", creation.ty)
}

/// What the components that may be of several types are in this case, and where the last of them is created so.
fn as_what(case: &Case<'_>, several: &[(ComponentName, Vec<&Creation>)]) -> (Origin, String) {
    let parts = case.parts.iter().filter(|(component, _)| several.iter().any(|(name, _)| name == component));
    let mut at = Origin::NONE;
    let told: Vec<String> = parts
        .map(|(component, creation)| {
            at = creation.origin;
            format!("`{component}` is {}", creation.ty)
        })
        .collect();
    (at, told.join(" and "))
}
