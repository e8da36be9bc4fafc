//! What a user reads of a violation: one text, whoever found it.

use super::{View, Violation};
use crate::model::finding::did_you_mean;
use crate::model::{
    ComponentName, ComponentType, Finding, Ident, MemberClass, MemberRef, Origin, Resource, Tunable, TypeName,
    ValueType,
};

impl Violation {
    /// It as a finding, at no place yet: what is wrong, where what it is about was declared, what to do. `view` is the
    /// system it was found in.
    pub fn finding(&self, view: &impl View) -> Finding {
        let mut finding = Finding::error(self.code(), self.to_string()).labelled(self.label());
        finding.help = self.help(view);
        for (origin, text) in self.declarations(view) {
            if origin.is_some() {
                finding = finding.also(origin, text);
            }
        }
        finding
    }

    /// What to write at the place itself; mostly nothing.
    fn label(&self) -> String {
        match self {
            Self::UnknownType { component, .. } => format!("`{component}` would be one"),
            Self::UnknownActivity { .. } => "runs in an activity that the deployment does not declare".to_owned(),
            Self::UnknownMember { what, .. } => format!("no such {what}"),
            _ => String::new(),
        }
    }

    /// Where what it is about was declared.
    fn declarations(&self, view: &impl View) -> Vec<(Origin, String)> {
        let of_type =
            |ty: &TypeName| view.types().get(*ty).map(|ty| (ty.origin, format!("{} is declared here", ty.name)));
        let how = match self {
            Self::UnknownMember { types, .. } => return types.iter().filter_map(of_type).collect(),
            Self::PortUnmapped { ty, .. } => return of_type(ty).into_iter().collect(),
            Self::MissingProperty { .. } => " without a default",
            Self::NeedsBuffer { .. } => " as buffered",
            _ => "",
        };
        match self.kind().2 {
            [Some((_, declared)), None] => vec![(declared, format!("declared here{how}"))],
            both => {
                let both = both.into_iter().flatten();
                both.map(|(member, declared)| (declared, format!("`{member}` is declared here"))).collect()
            }
        }
    }

    /// What to do about it, with near names where a name is unknown in `view`.
    pub fn help(&self, view: &impl View) -> Option<String> {
        Some(match self {
            Self::UnknownComponent(name) => {
                let mut known = Vec::new();
                view.for_each_component(&mut |node| known.push(node.name));
                known.sort_unstable();
                did_you_mean(name.as_str(), "components", known.iter().map(ComponentName::as_str))
            }
            Self::UnknownType { ty, .. } => {
                let known: Vec<TypeName> = view.types().iter().map(|t| t.name).collect();
                did_you_mean(ty.as_str(), "component types", known.iter().map(TypeName::as_str))
            }
            Self::UnknownActivity { near, .. } => near.clone(),
            Self::UnknownMember { what, member, types } => {
                let types: Vec<&ComponentType> =
                    types.iter().filter_map(|ty| view.types().get(*ty)).map(AsRef::as_ref).collect();
                near_member(*what, *member, &types)
            }
            Self::ResourceHeld { component, by, .. } => {
                let node = view.component(*component);
                let given: Vec<Ident> =
                    node.iter().flat_map(|node| &node.ty.exclusive).flat_map(Resource::properties).collect();
                match given.first() {
                    Some(property) => format!("bring `{by}` to unconfigured first, or give one of the two another `{property}`"),
                    None => format!("bring `{by}` to unconfigured first: one component at a time has it"),
                }
            }
            Self::Exists(name) => format!("destroy `{name}` in the same configuration, or choose another name"),
            Self::StillConnected { links, .. } => {
                let shown: Vec<String> =
                    links.iter().map(|(from, to)| format!("`disconnect(\"{from}\", \"{to}\")`")).collect();
                format!("add {}", shown.join(", "))
            }
            Self::NotOut { .. } | Self::NotIn { .. } => {
                "are the two ends the wrong way round? the out-port is the first: `connect(out_port, in_port)`".to_owned()
            }
            Self::WritesOut { .. } => "name an in-port: what leaves an out-port, its component decides".to_owned(),
            Self::PortTypes { .. } => "connect ports of the same type; nothing is converted on the way".to_owned(),
            Self::PortUnits { .. } => {
                "put a component between them that converts, or correct the unit of one".to_owned()
            }
            Self::AlreadyConnected { from, to } => {
                format!("to change the policy add `disconnect(\"{from}\", \"{to}\")` to the same configuration")
            }
            Self::DataAlone { to, by } | Self::Driven { port: to, by } => match by.first() {
                Some(from) => format!("add `disconnect(\"{from}\", \"{to}\")` to the same configuration"),
                None => return None,
            },
            Self::NeedsBuffer { .. } => "give the connection a buffer, such as `buffer = 64`".to_owned(),
            Self::BufferSize(_) => "a buffer holds at least one sample".to_owned(),
            Self::NotTunable { property, tunable, .. } => {
                let state = if *tunable == Tunable::Unconfigured { "unconfigured" } else { "stopped" };
                let c = property.component;
                format!("add \"{c}:{state}\" to pre_conf_state, and \"{c}:running\" to post_conf_state")
            }
            Self::BadValue { wanted, .. } => format!("give it a value of type {wanted}"),
            Self::MissingProperty { property, ty, .. } => {
                format!("add `{} = …` ({ty}) to the properties of this create", property.member)
            }
            Self::NotWritable { .. } => "connect a component that sends what you want to write".to_owned(),
            Self::ArgumentCount { operation, wanted, .. } if wanted.is_empty() => {
                format!("it takes no arguments: `operation_call(\"{operation}\")`")
            }
            Self::ArgumentCount { operation, wanted, .. } | Self::Argument { operation, wanted, .. } => {
                let wanted: Vec<String> = wanted.iter().map(ValueType::to_string).collect();
                format!("call it as {operation}({})", wanted.join(", "))
            }
            Self::PortUnlike { .. } => {
                "a port becomes one of the same direction, type and unit: correct the map, or put a component between them".to_owned()
            }
            Self::PortUnmapped { port, with, out, ty } => {
                let (from, to) = if *out { (port, with) } else { (with, port) };
                let known: Vec<&str> = view.types().get(*ty).map(|ty| MemberClass::Port.of(ty)).unwrap_or_default();
                format!(
                    "say what it is called there, `map = {{ [\"{}\"] = \"…\" }}` ({}), or add `disconnect(\"{from}\", \"{to}\")`",
                    port.member,
                    did_you_mean(port.member.as_str(), "ports", known)
                )
            }
            Self::Transition { .. }
            | Self::NotUnconfigured { .. }
            | Self::NotConnected { .. }
            | Self::PropertyCount { .. } => return None,
        })
    }
}

/// What may have been meant by a member that none of `types` has.
fn near_member(what: MemberClass, member: MemberRef, types: &[&ComponentType]) -> String {
    let name = member.member;
    let others = MemberClass::WORDS.iter().map(|(_, other)| *other).filter(|other| *other != what);
    let mut elsewhere = others.flat_map(|other| types.iter().map(move |ty| (other, *ty)));
    if let Some((other, ty)) = elsewhere.find(|(other, ty)| other.of(ty).contains(&name.as_str())) {
        let article = if other == MemberClass::Operation { "an" } else { "a" };
        return format!("`{name}` is {article} {other} of {}", ty.name);
    }
    let mut known: Vec<&str> = types.iter().flat_map(|ty| what.of(ty)).collect();
    known.sort_unstable();
    known.dedup();
    did_you_mean(name.as_str(), what.several(), known)
}
