//! All components that any configuration creates: what names in configurations may mean at all.

use crate::model::codes::UNKNOWN_COMPONENT;
use crate::model::finding::did_you_mean;
use crate::model::{Catalogue, ChangeKind, ComponentName, ComponentType, Deployment, Finding, Origin, TypeName};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A component that some configuration creates.
#[derive(Debug, Clone)]
pub struct Creation {
    /// Its type, as written.
    pub ty: TypeName,
    /// The type's description, if there is one of that name.
    pub description: Option<Arc<ComponentType>>,
    /// Where it is created.
    pub origin: Origin,
}

/// The components of a deployment, whichever configuration creates them; one name may be created as several types.
#[derive(Debug, Clone, Default)]
pub struct Universe {
    components: BTreeMap<ComponentName, Vec<Creation>>,
}

impl Universe {
    /// What the configurations of `deployment` create.
    pub fn new(deployment: &Deployment, catalogue: &Catalogue) -> Self {
        let mut components: BTreeMap<ComponentName, Vec<Creation>> = BTreeMap::new();
        for change in deployment.configurations.iter().flat_map(|c| &c.changes) {
            if let ChangeKind::Create { component, ty, .. } = &change.kind {
                let creations = components.entry(*component).or_default();
                if creations.iter().all(|c| c.ty != *ty) {
                    let description = catalogue.get(*ty).cloned();
                    creations.push(Creation { ty: *ty, description, origin: change.origin });
                }
            }
        }
        Self { components }
    }

    /// One component of one type.
    pub fn alone(component: &str, ty: &ComponentType) -> Self {
        let name = ComponentName::new(component).expect("the name of a component");
        let creation = Creation { ty: ty.name, description: Some(Arc::new(ty.clone())), origin: ty.origin };
        Self { components: BTreeMap::from([(name, vec![creation])]) }
    }

    /// How a component of that name may have been created; empty when none creates it.
    pub fn of(&self, component: ComponentName) -> &[Creation] {
        self.components.get(&component).map_or(&[], Vec::as_slice)
    }

    /// The finding that nothing creates a component of that name.
    pub fn unknown(&self, component: ComponentName, at: Origin) -> Finding {
        let known = self.components.keys().map(ComponentName::as_str);
        Finding::error(UNKNOWN_COMPONENT, format!("no configuration creates a component `{component}`"))
            .at(at)
            .labelled("no such component")
            .help(did_you_mean(component.as_str(), "components", known))
    }
}
