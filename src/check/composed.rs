//! A deployment with subsystems: each file is followed alone, and never the product of them (semantics: *Composition*).
//!
//! A subsystem is followed as the deployment that its file is: whatever its parent may raise comes from outside there, at any time. The
//! parent is followed against their interface automata ([`derived`](super::derived)); of what they are made of there
//! are the components that they export, which are there while that is promised ([`promises`](super::promises) holds both to it).

use super::alike::is_alike;
use super::automaton::InterfaceAutomaton;
use super::broken_exports::{BrokenExport, created_as};
use super::neighbours::{Neighbours, ParentInterface, accepted};
use super::report::{Accepted, Explored, Report};
use super::settings;
use super::side_by_side;
use super::simulated;
use super::trace::{Does, TraceStep};
use super::universe::Universe;
use super::verdict::CheckVerdict;
use super::ways;
use crate::model::MemberClass;
use crate::model::{
    Catalogue, Change, ChangeKind, ComponentName, ComponentType, ConfigId, Configuration, Deployment, Finding, Ident,
    StateEntry, StateList, Statechart, Subsystem, Target, Value, ValueType, Wanted,
};
use crate::stack::contenders::may_hold;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// What there is to say of a file, and what it shows its parent, where that was asked for and is known.
pub type CheckedFile = (Report, Option<Arc<InterfaceAutomaton>>);

/// Checks a deployment, each of its files alone: `one` checks one. `around`: what is around all of it.
pub fn run<F>(whole: Arc<Deployment>, catalogue: &Catalogue, around: &Neighbours, one: &F) -> CheckedFile
where
    F: Fn(Arc<Deployment>, &Catalogue, &Neighbours) -> CheckedFile + Sync,
{
    if whole.own.is_none() {
        return one(whole, catalogue, around);
    }
    let files = Instances::of(&whole, catalogue);
    let closes = around.parent.as_ref().map_or(!whole.safety.is_empty(), |parent| parent.closes);
    let check = |file: &Instances<'_>, all: &[&Subsystem], stands_for: bool| {
        let local = catalogue.known_in(file.first.name);
        let parent = Some(ParentInterface::of(whole.own_part(), closes, all.iter().copied()));
        let around = Neighbours { parent, stands_for, ..Neighbours::default() };
        run(with_limits_of(&whole, &file.first.own), &local, &around, one)
    };
    // Of what stands for another one, that one's subsystems tell.
    let stands_for = around.stands_for;
    let mut checked = side_by_side::each(&files, |file| check(file, &file.all, stands_for || file.like.is_some()));
    for (at, file) in files.iter().enumerate() {
        // Of one that is refused for its values nothing was followed.
        if file.like.is_some_and(|like| checked[like].0.verdict == CheckVerdict::Refused) {
            checked[at] = check(file, &[file.first], stands_for);
        }
    }
    let mut around = Neighbours { parent: around.parent.clone(), stands_for, ..Neighbours::default() };
    around.alike = files.iter().map(|file| file.all.iter().map(|subsystem| subsystem.name).collect()).collect();
    let mut reports: Vec<(Vec<Ident>, Report)> = Vec::new();
    for (file, (report, shows)) in files.into_iter().zip(checked) {
        // What is refused is not run: what it might tell is not worth following.
        if let Some(shows) = shows.filter(|_| report.verdict != CheckVerdict::Refused) {
            around.children.extend(file.all.iter().map(|other| (other.name, shows.clone())));
        }
        reports.push((file.names(), report));
    }
    let (mut view, types) = parents_view(whole.own_part(), catalogue);
    // Steps of subsystems may be meant, also of what these do not export.
    view.faults.clear();
    let held = may_hold(whole.configurations.iter(), catalogue);
    for subsystem in &mut view.subsystems {
        let inside = held.iter().filter(|(component, _)| component.local(subsystem.name).is_some());
        subsystem.holds = inside.flat_map(|(_, names)| names.iter().cloned()).collect();
    }
    let (mut report, shows) = one(Arc::new(view), &types, &around);
    report.findings.iter_mut().for_each(|finding| as_exported(finding, &whole.subsystems));
    let broken = BrokenExport::all(whole.own_part(), catalogue);
    if !broken.is_empty() {
        report.drop_findings(|finding| broken.iter().any(|export| export.is_meant(finding)));
    }
    for finding in simulated::faults(whole.own_part(), &whole, &Universe::new(&whole, catalogue)) {
        report.findings.push(finding);
        report.traces.push(Vec::new());
    }
    // Files that lead up and down each by itself may not do so together. Of a subsystem that is asked with the whole.
    let sound = reports.iter().map(|(_, of)| of).chain([&report]).all(|of| of.verdict != CheckVerdict::Refused);
    if sound && around.parent.is_none() {
        let together = ways::together(&whole, catalogue);
        if together.is_none() {
            report.left.push("whether all files come up, and down, together was not followed".to_owned());
            report.explored.complete = false;
        }
        for (finding, way) in together.into_iter().flatten() {
            report.findings.push(finding);
            report.traces.push(way);
        }
    }
    if !stands_for && whole.subsystems.iter().any(|subsystem| subsystem.own.charts().any(is_timed)) {
        let what =
            "whether ways down through several files are in time, but for that from where all is up, was not followed";
        report.left.push(what.to_owned());
        report.explored.complete = false;
    }
    reports.push((Vec::new(), report));
    (put_together(whole, reports, stands_for), shows)
}

/// Whether something of a coordinator takes time.
fn is_timed(written: &Statechart) -> bool {
    crate::statechart::compile(written).0.is_some_and(|chart| chart.has_times())
}

/// A subsystem's file with the limits of the deployment that it is part of: those of its own count where it is deployed alone.
fn with_limits_of(whole: &Deployment, own: &Arc<Deployment>) -> Arc<Deployment> {
    match own.limits == whole.limits {
        true => own.clone(),
        false => Arc::new(Deployment { limits: whole.limits, ..(**own).clone() }),
    }
}

/// Subsystems of one file and the same parameters.
struct Instances<'s> {
    first: &'s Subsystem,
    /// Of which what is followed here tells: these, and those that differ in values alone.
    all: Vec<&'s Subsystem>,
    /// What is followed of these others tells of them.
    like: Option<usize>,
}

impl<'s> Instances<'s> {
    /// Of which what is said of the first is true, that one first.
    fn names(&self) -> Vec<Ident> {
        let others = self.all.iter().map(|subsystem| subsystem.name).filter(|name| *name != self.first.name);
        std::iter::once(self.first.name).chain(others).collect()
    }

    fn of(whole: &'s Deployment, catalogue: &Catalogue) -> Vec<Self> {
        let mut files: Vec<Self> = Vec::new();
        for subsystem in &whole.subsystems {
            let same = |file: &Self| Arc::ptr_eq(&file.first.own, &subsystem.own);
            let local = catalogue.known_in(subsystem.name);
            let alike =
                |file: &Self| file.first.file == subsystem.file && is_alike(&file.first.own, &subsystem.own, &local);
            let known = files.iter().any(same);
            let like = files.iter().position(|file| file.like.is_none() && (same(file) || alike(file)));
            if let Some(like) = like {
                files[like].all.push(subsystem);
            }
            if !known {
                let all = if like.is_some() { Vec::new() } else { vec![subsystem] };
                files.push(Self { first: subsystem, all, like });
            }
        }
        files
    }
}

/// A deployment as its own file has it, with what its subsystems export.
fn parents_view(own: &Deployment, catalogue: &Catalogue) -> (Deployment, Catalogue) {
    let mut view = own.clone();
    let mut types = Catalogue::new();
    for ty in catalogue.iter().filter(|ty| !ty.name.as_str().contains('/')) {
        types.insert(ty.clone());
    }
    for subsystem in &own.subsystems {
        let exported = exported(own, subsystem, catalogue);
        let accepted = accepted(subsystem).into_iter().map(|event| (event, subsystem.origin));
        for (event, origin) in accepted {
            let raises = own.charts().any(|chart| chart.raises(event.as_str()));
            if raises && !view.emits.iter().any(|(known, _)| *known == event) {
                view.emits.push((event, origin));
            }
        }
        if exported.is_empty() {
            continue;
        }
        let mut made = Configuration::new(ConfigId::from(subsystem.name));
        let mut running = Vec::new();
        for (component, ty) in exported {
            let kind = ChangeKind::Create { component, ty: ty.name, activity: None, properties: BTreeMap::new() };
            made.changes.push(Change { kind, origin: subsystem.origin });
            let (target, state) = (Target::Component(component), Wanted::Running);
            running.push(StateEntry { target, state, origin: subsystem.origin });
            types.insert(ty);
        }
        made.post = StateList::of(running).unwrap_or_default();
        made.origin = subsystem.origin;
        view.configurations.push(made);
    }
    (view, types)
}

/// The components that a subsystem exports something of, each with a type that has that and nothing else. What the subsystem has given a property
/// is not known there: another value than any that the parent gives, so that each of these is a step that may fail.
fn exported(
    parent: &Deployment,
    subsystem: &Subsystem,
    catalogue: &Catalogue,
) -> BTreeMap<ComponentName, ComponentType> {
    let mut types: BTreeMap<ComponentName, ComponentType> = BTreeMap::new();
    for export in subsystem.own.interface.exports.values() {
        let component = export.of.component.within(subsystem.name);
        let Some(whole) = created_as(&subsystem.own, export.of.component, catalogue, subsystem.name) else { continue };
        let ty = types.entry(component).or_insert_with(|| {
            let mut ty = ComponentType::new("davit.exported", &whole.doc);
            ty.name = ty.name.of(component);
            ty.actuator = false;
            ty
        });
        match export.kind {
            MemberClass::Port => ty.ports.extend(whole.ports.get_key_value(&export.of.member).map(own)),
            MemberClass::Property => {
                ty.properties.extend(whole.properties.get_key_value(&export.of.member).map(own).map(
                    |(name, mut of)| {
                        of.default = settings::another(parent, component.member(name), &of).or(of.default);
                        of.default = of.default.or_else(|| Some(some_value(&of.ty)));
                        (name, of)
                    },
                ));
            }
            MemberClass::Operation => {
                ty.operations.extend(whole.operations.get_key_value(&export.of.member).map(own));
            }
        }
    }
    types
}

fn own<T: Clone>((name, of): (&Ident, &T)) -> (Ident, T) {
    (*name, of.clone())
}

/// Any value of a type.
fn some_value(ty: &ValueType) -> Value {
    match ty {
        ValueType::Bool | ValueType::Event => Value::Bool(false),
        ValueType::Int => Value::Int(0),
        ValueType::Float => Value::Float(0.0),
        ValueType::Str => Value::str(""),
        ValueType::Array(element, length) => {
            Value::Array((0..length.unwrap_or_default()).map(|_| some_value(element)).collect())
        }
        ValueType::Record(fields) => Value::Record(fields.iter().map(|(name, ty)| (*name, some_value(ty))).collect()),
    }
}

/// One report of all. `stands_for`: what was left out is told of another one.
fn put_together(whole: Arc<Deployment>, reports: Vec<(Vec<Ident>, Report)>, stands_for: bool) -> Report {
    let mut all: Vec<(Finding, Vec<TraceStep>)> = Vec::new();
    let mut explored = Explored { complete: true, without_failure: true, ..Explored::default() };
    let mut left: BTreeSet<String> = BTreeSet::new();
    let mut told: Vec<(Finding, Option<String>)> = Vec::new();
    let (mut followed, mut replayed, mut refused) = (true, true, false);
    for (names, report) in reports {
        let path = names.first().copied();
        followed &= report.verdict != CheckVerdict::Refused || report.replayed.is_some();
        replayed &= report.replayed.is_some();
        refused |= report.verdict == CheckVerdict::Refused;
        explored = explored.and(report.explored);
        let of: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
        left.extend(report.left.into_iter().map(|bound| match &of[..] {
            [] => bound,
            of => format!("{}: {bound}", of.join(", ")),
        }));
        let file = |path: &Option<Ident>| path.and_then(|path| Some(whole.subsystem(path.as_str())?.file.clone()));
        let own = file(&path);
        // What is wrong in one file is told once, however often that is a subsystem; what is worse with other parameters is told again.
        let said = |finding: &Finding| {
            let same = |(known, of): &(Finding, Option<String>)| {
                let words = (known.code, &known.message) == (finding.code, &finding.message);
                own.is_some() && *of == own && words && known.severity >= finding.severity
            };
            told.iter().any(same)
        };
        let found = report.findings.into_iter().zip(report.traces);
        let found: Vec<_> = found.filter(|(finding, _)| !said(finding)).collect();
        told.extend(found.iter().map(|(finding, _)| (finding.clone(), own.clone())));
        all.extend(found.into_iter().map(|(finding, way)| (within(finding, path), alone(way, path))));
    }
    if !stands_for && whole.own_part().configurations.iter().any(|configuration| configuration.safe) {
        left.insert("what a safe configuration interrupts in subsystems is not followed there".to_owned());
        explored.complete = false;
    }
    all.sort_by_key(|(finding, _)| std::cmp::Reverse(finding.severity));
    let (findings, traces): (Vec<Finding>, Vec<_>) = all.into_iter().unzip();
    let left: Vec<String> = left.into_iter().collect();
    let verdict = match refused {
        true => CheckVerdict::Refused,
        false => CheckVerdict::of(&findings, followed, left.clone()),
    };
    let checked = (verdict != CheckVerdict::Refused).then(|| Accepted::new(whole.clone()));
    let replayed = replayed.then(|| Accepted::new(whole));
    Report { checked, replayed, findings, traces, explored, left, verdict }
}

/// What a finding says to write names what subsystems export as their parent may write it.
fn as_exported(finding: &mut Finding, subsystems: &[Subsystem]) {
    let Some(help) = &mut finding.help else { return };
    for subsystem in subsystems {
        for (alias, export) in &subsystem.own.interface.exports {
            let inside = format!("\"{}.{}\"", export.of.component.within(subsystem.name), export.of.member);
            *help = help.replace(&inside, &format!("\"{}.{alias}\"", subsystem.name));
        }
    }
}

/// The way to a finding of a subsystem's file: it is gone where that is deployed alone.
fn alone(mut way: Vec<TraceStep>, path: Option<Ident>) -> Vec<TraceStep> {
    if path.is_some() {
        way.iter_mut()
            .for_each(|step| step.replay.does = Does::Cannot("it is one of a subsystem's file: check that file alone"));
    }
    way
}

/// A finding of a subsystem's file, with the path that it has from here.
fn within(finding: Finding, path: Option<Ident>) -> Finding {
    let Some(path) = path else { return finding };
    let told = match finding.path.strip_prefix("configurations.") {
        Some(id) => format!("configurations.{path}/{id}"),
        None if finding.path.is_empty() => String::new(),
        None => format!("subsystems.{path}.{}", finding.path),
    };
    let mut finding = finding;
    finding.path = told;
    if !finding.origin.is_some() {
        finding.message = format!("`{path}`: {}", finding.message);
    }
    finding
}
