//! Exports that name nothing. Each is told in the file that exports it; what would follow from it in files around that one is not, since there
//! it is spelt by names that nobody wrote.

use crate::model::{Catalogue, ComponentName, ComponentType, Deployment, Finding, Ident, MemberClass};
use std::sync::Arc;

/// The type as which a file, or a subsystem of it, creates a component.
pub(super) fn created_as(
    of: &Deployment,
    component: ComponentName,
    catalogue: &Catalogue,
    path: Ident,
) -> Option<Arc<ComponentType>> {
    let changes = of.configurations.iter().flat_map(|configuration| &configuration.changes);
    let ty = changes.filter_map(|change| change.kind.makes()).find(|(name, ..)| *name == component)?.1;
    catalogue.get(ty).or_else(|| catalogue.get(ty.within(path))).cloned()
}

/// Something of a subsystem that it exports and does not have, by the names that it has inside.
pub(super) struct BrokenExport {
    component: ComponentName,
    /// What its type has not; none: nothing creates the component.
    member: Option<Ident>,
}

impl BrokenExport {
    /// Those of a file's subsystems.
    pub fn all(own: &Deployment, catalogue: &Catalogue) -> Vec<Self> {
        let exports = own.subsystems.iter().flat_map(|of| of.own.interface.exports.values().map(move |it| (of, it)));
        let broken = exports.filter_map(|(subsystem, export)| {
            let component = export.of.component.within(subsystem.name);
            let member = &export.of.member;
            let created = created_as(&subsystem.own, export.of.component, catalogue, subsystem.name);
            let Some(ty) = created else { return Some(Self { component, member: None }) };
            let has = match export.kind {
                MemberClass::Port => ty.ports.contains_key(member),
                MemberClass::Property => ty.properties.contains_key(member),
                MemberClass::Operation => ty.operations.contains_key(member),
            };
            (!has).then_some(Self { component, member: Some(*member) })
        });
        broken.collect()
    }

    /// Whether a finding of the file around it is about it.
    pub fn is_meant(&self, finding: &Finding) -> bool {
        match &self.member {
            None => finding.message.contains(&format!("`{}`", self.component)),
            Some(member) => {
                let has_not = finding.message.strip_prefix(&format!("{} (", self.component));
                has_not.is_some_and(|says| says.ends_with(&format!("`{member}`")))
            }
        }
    }
}
