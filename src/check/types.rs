//! The component types that a deployment declares.

use crate::model::codes::{TYPE_UNKNOWN_OPERATION, TYPE_UNKNOWN_TYPE, TYPE_WITHOUT_CODE};
use crate::model::finding::did_you_mean;
use crate::model::{Catalogue, Deployment, Effect, Finding, Findings, Ident};

/// What is wrong with the declared types: names of other types and of operations that are not there.
pub fn check(deployment: &Deployment, catalogue: &Catalogue) -> Findings {
    let mut findings = Vec::new();
    for ty in &deployment.types {
        for (key, others) in [("start_after", &ty.start_after), ("stop_before", &ty.stop_before)] {
            for other in others.iter().filter(|other| catalogue.get(**other).is_none()) {
                let known = catalogue.iter().map(|ty| ty.name.as_str());
                findings.push(
                    Finding::error(
                        TYPE_UNKNOWN_TYPE,
                        format!("{}: {key} names a type `{other}` that there is not", ty.name),
                    )
                    .at(ty.origin)
                    .path(format!("types.{}.{key}", ty.name))
                    .help(did_you_mean(other.as_str(), "types", known)),
                );
            }
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
    findings.extend(without_code(deployment, catalogue));
    findings
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
