//! The component types that a deployment declares.

use crate::model::codes::{
    TYPE_BAD_TYPE, TYPE_CIRCLE, TYPE_EXCLUSIVE, TYPE_NO_EVENT, TYPE_UNKNOWN_OPERATION, TYPE_UNKNOWN_TYPE,
    TYPE_WITHOUT_CODE,
};
use crate::model::finding::did_you_mean;
use crate::model::{
    Catalogue, ComponentType, Deployment, Effect, Finding, Findings, Ident, PropertyType, Tunable, TypeName, ValueType,
};
use std::collections::{BTreeSet, VecDeque};

/// What is wrong with the declared types: names of other types and of operations that are not there.
pub fn check(deployment: &Deployment, catalogue: &Catalogue) -> Findings {
    let mut findings = Vec::new();
    for ty in &deployment.types {
        for (key, others) in [("start_after", &ty.start_after), ("stop_before", &ty.stop_before)] {
            for (i, other) in others.iter().enumerate().filter(|(_, other)| catalogue.get(**other).is_none()) {
                let path = format!("types.{}.{key}", ty.name);
                let at = deployment.key_origins.get(&format!("{path}[{i}]")).or(deployment.key_origins.get(&path));
                let known = catalogue.iter().map(|ty| ty.name.as_str());
                findings.push(
                    Finding::error(
                        TYPE_UNKNOWN_TYPE,
                        format!("{}: {key} names a type `{other}` that there is not", ty.name),
                    )
                    .at(at.copied().unwrap_or(ty.origin))
                    .path(path)
                    .help(did_you_mean(other.as_str(), "types", known)),
                );
            }
        }
        for event in ty.raises.keys() {
            let Some(message) = deployment.never_from_outside(event.as_str()) else { continue };
            let path = format!("types.{}.raises", ty.name);
            findings.push(
                Finding::error(TYPE_NO_EVENT, message)
                    .at(deployment.key_origins.get(&path).copied().unwrap_or(ty.origin))
                    .path(path)
                    .labelled("no event of a component")
                    .help("list events that components raise: `raises: [e_arrived]`"),
            );
        }
        for (name, operation) in &ty.operations {
            let Effect::Undo(undo) = operation.effect else { continue };
            let path = format!("types.{}.operations.{name}", ty.name);
            let Some(inverse) = ty.operations.get(&undo) else {
                let known = ty.operations.keys().map(Ident::as_str);
                findings.push(
                    Finding::error(
                        TYPE_UNKNOWN_OPERATION,
                        format!("{}.{name} is undone by `{undo}`, which {} does not have", ty.name, ty.name),
                    )
                    .at(operation.origin)
                    .path(path)
                    .also(ty.origin, "the type is declared here")
                    .help(did_you_mean(undo.as_str(), "operations", known)),
                );
                continue;
            };
            if !inverse.args.is_empty() && inverse.args != operation.args {
                findings.push(
                    Finding::error(
                        TYPE_UNKNOWN_OPERATION,
                        format!("{}.{undo} cannot undo {}.{name}: it takes other arguments", ty.name, ty.name),
                    )
                    .at(operation.origin)
                    .path(path)
                    .also(inverse.origin, "declared here")
                    .help("an undo takes the same arguments, or none"),
                );
            }
        }
    }
    findings.extend(deployment.types.iter().filter_map(|ty| exclusive(deployment, ty)));
    findings.extend(deployment.types.iter().flat_map(nameless));
    findings.extend(cycles(deployment, catalogue));
    findings.extend(without_code(deployment, catalogue));
    findings
}

/// Properties that are to name events, and are of another type than names.
fn nameless(ty: &ComponentType) -> impl Iterator<Item = Finding> {
    let is_nameless = |(_, of): &(&Ident, &PropertyType)| of.raises && of.ty != ValueType::Str;
    ty.properties.iter().filter(is_nameless).map(|(name, of)| {
        let message = format!("`{name}` is a {}, and only a string can be the name of an event", of.ty);
        Finding::error(TYPE_BAD_TYPE, message)
            .at(of.origin)
            .help(format!("write `{name}: {{ type: string, raises: true }}`, or leave `raises` out"))
    })
}

/// What is held for itself, by a property that cannot say what.
fn exclusive(deployment: &Deployment, ty: &ComponentType) -> Option<Finding> {
    let (resource, (property, why)) = ty.exclusive.iter().find_map(|one| Some((one, one.misfit(ty)?)))?;
    let path = format!("types.{}.exclusive", ty.name);
    let help = match ty.properties.get(&property) {
        Some(of) if of.tunable != Tunable::Unconfigured => {
            format!("mark it: `{property}: {{ type: {}, tunable: unconfigured }}`", of.ty)
        }
        Some(_) => format!("give `{property}` one of these types, or name the thing without it"),
        None => did_you_mean(property.as_str(), "properties", ty.properties.keys().map(Ident::as_str)),
    };
    let finding =
        Finding::error(TYPE_EXCLUSIVE, format!("{}: `\"{resource}\"` is no name of one thing: {why}", ty.name));
    Some(finding.at(deployment.key_origins.get(&path).copied().unwrap_or(ty.origin)).path(path).help(help))
}

/// Orders that lead back to where they begin: inside a feedback loop none of these types could come first, and the name would
/// decide.
fn cycles(deployment: &Deployment, catalogue: &Catalogue) -> Findings {
    let mut findings = Findings::new();
    for (key, others) in [
        ("start_after", (|ty| &ty.start_after) as fn(&ComponentType) -> &Vec<TypeName>),
        ("stop_before", |ty| &ty.stop_before),
    ] {
        for ty in &deployment.types {
            let Some(round) = round(ty.name, catalogue, others) else { continue };
            // It is told of the first of them that is declared here.
            let first = deployment.types.iter().find(|ty| round.contains(&ty.name));
            if first.is_none_or(|first| first.name != ty.name) {
                continue;
            }
            let path = format!("types.{}.{key}", ty.name);
            let named: Vec<&str> = round.iter().chain(round.first()).map(TypeName::as_str).collect();
            findings.push(
                Finding::error(
                    TYPE_CIRCLE,
                    format!("{}: {key} leads round in a circle: {}", ty.name, named.join(" → ")),
                )
                .at(deployment.key_origins.get(&path).copied().unwrap_or(ty.origin))
                .path(path)
                .help("leave one of them out: no order fits all of them"),
            );
        }
    }
    findings
}

/// A shortest way from a type back to itself, over what `others` names.
fn round(from: TypeName, catalogue: &Catalogue, others: fn(&ComponentType) -> &Vec<TypeName>) -> Option<Vec<TypeName>> {
    let mut ways = VecDeque::from([vec![from]]);
    let mut seen = BTreeSet::new();
    while let Some(way) = ways.pop_front() {
        let ty = way.last().and_then(|name| catalogue.get(*name))?.clone();
        for next in others(&ty) {
            if *next == from {
                return Some(way);
            }
            if catalogue.get(*next).is_some() && seen.insert(*next) {
                ways.push_back([&way[..], &[*next]].concat());
            }
        }
    }
    None
}

/// Declared types say what a component looks like, not what it does: only the simulated platform can make one that no library has.
fn without_code(deployment: &Deployment, catalogue: &Catalogue) -> Findings {
    let mut findings = Vec::new();
    if !deployment.kind.runs_libraries {
        return findings;
    }
    for configuration in &deployment.configurations {
        for change in &configuration.changes {
            let Some((component, ty, _)) = change.kind.makes() else { continue };
            if let Some(declared) = deployment
                .types
                .iter()
                .find(|d| d.name == ty && catalogue.get(ty).is_none_or(|known| known.origin.is_some()))
            {
                findings.push(
                    Finding::error(TYPE_WITHOUT_CODE, format!("`{component}` cannot be made: `{ty}` is only declared"))
                        .at(change.origin)
                        .path(format!("configurations.{}", configuration.id))
                        .also(declared.origin, "declared here, which gives it no code")
                        .help("use `platform: simulated`, or a type of a library"),
                );
            }
        }
    }
    findings
}
