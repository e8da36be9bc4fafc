//! All components that any configuration creates: what names in configurations may mean at all.

use crate::model::codes::UNKNOWN_COMPONENT;
use crate::model::finding::did_you_mean;
use crate::model::{
    Catalogue, ChangeKind, ComponentName, ComponentType, ConfigId, Deployment, Effect, Finding, MemberRef, Origin,
    Step, TypeName, Value,
};
use crate::system::{Member, System, Violation, step};
use smallvec::SmallVec;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A type as which some configurations create a component.
#[derive(Debug, Clone)]
pub struct Creation {
    /// The type, as written.
    pub ty: TypeName,
    /// The type's description, if there is one of that name.
    pub description: Option<Arc<ComponentType>>,
    /// Where it is created first.
    pub origin: Origin,
    /// The configurations that do.
    by: SmallVec<[ConfigId; 1]>,
}

/// The components of a deployment, whichever configuration creates them; one name may be created as several types.
#[derive(Debug, Clone)]
pub struct Universe {
    components: BTreeMap<ComponentName, Vec<Creation>>,
    /// A system of these types with nothing in it.
    empty: System,
}

impl Universe {
    /// What the configurations of `deployment` create.
    pub fn new(deployment: &Deployment, catalogue: &Catalogue) -> Self {
        let mut components: BTreeMap<ComponentName, Vec<Creation>> = BTreeMap::new();
        for configuration in &deployment.configurations {
            for change in &configuration.changes {
                let ChangeKind::Create { component, ty, .. } = &change.kind else { continue };
                let creations = components.entry(*component).or_default();
                let at = creations.iter().position(|c| c.ty == *ty).unwrap_or_else(|| {
                    let description = catalogue.get(*ty).cloned();
                    creations.push(Creation { ty: *ty, description, origin: change.origin, by: SmallVec::new() });
                    creations.len() - 1
                });
                let by = &mut creations[at].by;
                if by.last() != Some(&configuration.id) {
                    by.push(configuration.id);
                }
            }
        }
        Self { components, empty: System::new(Arc::new(catalogue.clone())) }
    }

    /// One component of one type.
    pub fn alone(component: &str, ty: &ComponentType) -> Self {
        let name = ComponentName::new(component).expect("the name of a component");
        let creation =
            Creation { ty: ty.name, description: Some(Arc::new(ty.clone())), origin: ty.origin, by: SmallVec::new() };
        let mut types = Catalogue::new();
        types.insert(ty.clone());
        let empty = System::new(Arc::new(types));
        Self { components: BTreeMap::from([(name, vec![creation])]), empty }
    }

    /// How a component of that name may have been created; empty when none creates it.
    pub fn of(&self, component: ComponentName) -> &[Creation] {
        self.components.get(&component).map_or(&[], Vec::as_slice)
    }

    /// What a component may be while the changes of configuration `id` are made: `old`, before it creates it itself, what
    /// the others create; else what it creates. Where that is nothing, what anyone does.
    pub fn during(&self, component: ComponentName, id: ConfigId, old: bool) -> Vec<&Creation> {
        let all = self.of(component);
        if !all.iter().any(|creation| creation.by.contains(&id)) {
            return all.iter().collect();
        }
        let wanted = |creation: &&Creation| match old {
            true => creation.by.iter().any(|by| *by != id),
            false => creation.by.contains(&id),
        };
        let some: Vec<&Creation> = all.iter().filter(wanted).collect();
        if some.is_empty() { all.iter().collect() } else { some }
    }

    /// A picture of what may be there: these components as these creations make them, and nothing else. One of an unknown
    /// type is left out.
    pub fn picture(&self, parts: &[(ComponentName, &Creation)]) -> System {
        let mut system = self.empty.clone();
        for (component, creation) in parts {
            let Some(ty) = &creation.description else { continue };
            // No precondition looks at what a property holds.
            let properties = ty.properties.values().map(|p| p.default.clone().unwrap_or(Value::Bool(false))).collect();
            step::effect(&Step::Create { component: *component, ty: ty.name, activity: None, properties }, &mut system);
        }
        system
    }

    /// The operations that undo another one, as the types say.
    pub fn undone_by(&self, operation: MemberRef) -> impl Iterator<Item = MemberRef> + '_ {
        let types = self.of(operation.component).iter().filter_map(|creation| creation.description.as_ref());
        types.filter_map(move |ty| match &ty.operations.get(&operation.member)?.effect {
            Effect::Undo(undo) => Some(operation.component.member(*undo)),
            _ => None,
        })
    }

    /// The finding that nothing creates a component of that name.
    pub fn unknown(&self, component: ComponentName, at: Origin) -> Finding {
        let known = self.components.keys().map(ComponentName::as_str);
        Finding::error(UNKNOWN_COMPONENT, format!("no configuration creates a component `{component}`"))
            .at(at)
            .labelled("no such component")
            .help(did_you_mean(component.as_str(), "components", known))
    }

    /// The finding that the component has no such member, whichever it may be created as. None also when one of its types
    /// is unknown, which is said where it is created.
    pub fn lacks(&self, what: Member, member: MemberRef, at: Origin) -> Option<Finding> {
        let creations = self.of(member.component);
        let has = |c: &Creation| c.description.as_ref().is_none_or(|ty| what.is_in(ty, member.member));
        if creations.iter().any(has) {
            return None;
        }
        let types = creations.iter().map(|creation| creation.ty).collect();
        Some(Violation::UnknownMember { what, member, types }.finding(&self.empty).at(at))
    }
}
