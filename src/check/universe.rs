//! All components that any configuration creates: what names in configurations may mean at all.

use crate::model::codes::UNKNOWN_COMPONENT;
use crate::model::finding::{did_you_mean, did_you_mean_path};
use crate::model::{
    Catalogue, ChangeKind, ComponentName, ComponentType, ConfigId, Deployment, Effect, Finding, MemberRef, Origin,
    TypeName,
};
use crate::system::{MemberClass, Picture, Violation};
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::{SmallVec, smallvec};
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
    components: FxHashMap<ComponentName, SmallVec<[Creation; 1]>>,
    types: Catalogue,
}

/// Ways in which a component may have been created.
pub type Creations<'a> = SmallVec<[&'a Creation; 1]>;

impl Universe {
    /// What the configurations of `deployment` create.
    pub fn new(deployment: &Deployment, catalogue: &Catalogue) -> Self {
        let mut components: FxHashMap<ComponentName, SmallVec<[Creation; 1]>> = FxHashMap::default();
        components.reserve(deployment.configurations.iter().map(|c| c.changes.len()).max().unwrap_or_default());
        let mut created: FxHashSet<ComponentName> = FxHashSet::default();
        for configuration in &deployment.configurations {
            for change in &configuration.changes {
                let Some((component, ty, _)) = change.kind.makes() else { continue };
                if matches!(change.kind, ChangeKind::Create { .. }) {
                    created.insert(component);
                }
                let creations = components.entry(component).or_default();
                let at = creations.iter().position(|c| c.ty == ty).unwrap_or_else(|| {
                    let description = catalogue.get(ty).cloned();
                    creations.push(Creation { ty, description, origin: change.origin, by: SmallVec::new() });
                    creations.len() - 1
                });
                let by = &mut creations[at].by;
                if by.last() != Some(&configuration.id) {
                    by.push(configuration.id);
                }
            }
        }
        // One takes the place of what is there.
        components.retain(|name, _| created.contains(name));
        Self { components, types: catalogue.clone() }
    }

    /// One component of one type.
    pub fn alone(component: &str, ty: &ComponentType) -> Self {
        let name = ComponentName::new(component).expect("the name of a component");
        let creation =
            Creation { ty: ty.name, description: Some(Arc::new(ty.clone())), origin: ty.origin, by: SmallVec::new() };
        let mut types = Catalogue::new();
        types.insert(ty.clone());
        Self { components: std::iter::once((name, smallvec![creation])).collect(), types }
    }

    /// The types of the components that there may be, as far as they are known.
    pub fn types(&self) -> impl Iterator<Item = &ComponentType> {
        self.components.values().flatten().filter_map(|creation| creation.description.as_deref())
    }

    /// The components that there may be.
    pub fn components(&self) -> impl Iterator<Item = ComponentName> + '_ {
        self.components.keys().copied()
    }

    /// How a component of that name may have been created; empty when none creates it.
    pub fn of(&self, component: ComponentName) -> &[Creation] {
        self.components.get(&component).map_or(&[], SmallVec::as_slice)
    }

    /// What a component may be while the changes of configuration `id` are made: `old`, before it creates it itself, what
    /// the others create; else what it creates. Where that is nothing, what anyone does.
    pub fn during(&self, component: ComponentName, id: ConfigId, old: bool) -> Creations<'_> {
        let all = self.of(component);
        if let [one] = all {
            return smallvec![one];
        }
        if !all.iter().any(|creation| creation.by.contains(&id)) {
            return all.iter().collect();
        }
        let wanted = |creation: &&Creation| match old {
            true => creation.by.iter().any(|by| *by != id),
            false => creation.by.contains(&id),
        };
        let some: Creations<'_> = all.iter().filter(wanted).collect();
        if some.is_empty() { all.iter().collect() } else { some }
    }

    /// A picture of what may be there: these components as these creations make them, and nothing else. One of an unknown
    /// type is left out.
    pub fn picture(&self, parts: &[(ComponentName, &Creation)]) -> Picture<'_> {
        let mut picture = Picture::new(&self.types);
        for (component, creation) in parts {
            if let Some(ty) = &creation.description {
                picture.add(*component, ty.clone());
            }
        }
        picture
    }

    /// Whether an operation moves hardware, as one of the types says.
    pub fn moves(&self, operation: MemberRef) -> bool {
        let types = self.of(operation.component).iter().filter_map(|creation| creation.description.as_ref());
        types.filter_map(|ty| ty.operations.get(&operation.member)).any(|of| of.moves)
    }

    /// Whether starting a component moves hardware, as one of the types says.
    pub fn moves_started(&self, component: ComponentName) -> bool {
        self.of(component).iter().filter_map(|creation| creation.description.as_ref()).any(|ty| ty.moves.start)
    }

    /// The operations that undo another one, as the types say.
    pub fn undone_by(&self, operation: MemberRef) -> impl Iterator<Item = MemberRef> + '_ {
        let types = self.of(operation.component).iter().filter_map(|creation| creation.description.as_ref());
        types.filter_map(move |ty| match &ty.operations.get(&operation.member)?.effect {
            Effect::Undo(undo) => Some(operation.component.member(*undo)),
            _ => None,
        })
    }

    /// The same of one that may be at any depth: what goes wrong is said of the platform's components.
    pub fn unknown_anywhere(&self, component: ComponentName, at: Origin) -> Finding {
        let mut known: Vec<&str> = self.components.keys().map(ComponentName::as_str).collect();
        known.sort_unstable();
        self.unknown(component, at).help(did_you_mean_path(component.as_str(), "components", known))
    }

    /// The finding that nothing creates a component of that name.
    pub fn unknown(&self, component: ComponentName, at: Origin) -> Finding {
        // Those of the same file, and its subsystems, which a parent knows by their names.
        let name = component.as_str();
        let file = name.rfind('/').map_or("", |end| &name[..=end]);
        let here = |other: &'static str| {
            let own = other.strip_prefix(file)?;
            Some(&other[..file.len() + own.find('/').unwrap_or(own.len())])
        };
        let mut known: Vec<&str> = self.components.keys().map(ComponentName::as_str).filter_map(here).collect();
        known.sort_unstable();
        known.dedup();
        // Names are those of a file: what there is beside it, a part of something larger, it does not see.
        let help = match known.is_empty() && name.contains('/') {
            true => "a file sees what is its own: what stands beside it comes by an in-port of it that whoever it is a part of connects (`exports`)"
                .to_owned(),
            false => did_you_mean(name, "components", known),
        };
        Finding::error(UNKNOWN_COMPONENT, format!("no configuration creates a component `{component}`"))
            .at(at)
            .labelled("no such component")
            .help(help)
    }

    /// The finding that the component has no such member, whichever it may be created as. None also when one of its types
    /// is unknown, which is said where it is created.
    pub fn lacks(&self, what: MemberClass, member: MemberRef, at: Origin) -> Option<Finding> {
        let creations = self.of(member.component);
        let has = |c: &Creation| c.description.as_ref().is_none_or(|ty| what.of(ty).contains(&member.member.as_str()));
        if creations.iter().any(has) {
            return None;
        }
        let types = creations.iter().map(|creation| creation.ty).collect();
        Some(Violation::UnknownMember { what, member, types }.finding(&Picture::new(&self.types)).at(at))
    }
}
