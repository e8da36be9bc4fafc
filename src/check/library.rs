//! What a deployment declares of a type, held against what a library says of the type of that name. The library's counts: it
//! is what runs. What was written in reliance on the declaration can fail there, or only be another than it says.

use crate::model::codes::TYPE_DIFFERS;
use crate::model::{
    Catalogue, ComponentType, Deployment, Effect, Finding, Findings, Ident, OperationType, Origin, PortType,
    PropertyType, Tunable, TypeName, ValueType,
};
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use std::fmt::Display;

/// Every difference, at the declaration: an error where a plan that the declaration allows could fail when it is carried out.
pub fn check(deployment: &Deployment, catalogue: &Catalogue) -> Findings {
    let mut findings = Findings::new();
    for declared in &deployment.types {
        // One that no library has is in the catalogue as it is declared.
        let Some(library) = catalogue.get(declared.name).filter(|ty| !ty.origin.is_some()) else { continue };
        Compared { ty: declared.name, origin: declared.origin, by: TypeOwner::Library, findings: &mut findings }
            .types(declared, library);
    }
    findings
}

/// What the types that a deployment was checked with are otherwise than the platform that it is to run on has them, as far as
/// its configurations make components of them. Where that makes no plan fail it is no difference.
pub fn platform(deployment: &Deployment, catalogue: &Catalogue, platform: &Catalogue) -> Findings {
    let mut findings = Findings::new();
    let changes = deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
    let mut seen = FxHashSet::default();
    for change in changes {
        let Some((_, ty, _)) = change.kind.makes() else { continue };
        let Some(checked) = catalogue.get(ty).filter(|_| seen.insert(ty)) else { continue };
        let Some(own) = platform.get(ty) else {
            let message = format!("the platform `{}` has no type `{ty}`", deployment.platform);
            findings.push(Finding::error(TYPE_DIFFERS, message).at(change.origin));
            continue;
        };
        Compared { ty, origin: checked.origin, by: TypeOwner::Platform, findings: &mut findings }.types(checked, own);
    }
    findings.retain(Finding::is_error);
    findings
}

/// Who has a type otherwise than it was declared.
#[derive(Clone, Copy)]
enum TypeOwner {
    Library,
    Platform,
}

impl TypeOwner {
    fn word(self) -> &'static str {
        match self {
            Self::Library => "library",
            Self::Platform => "platform",
        }
    }
}

/// A difference: of what, as declared, as the library has it, and whether a plan could fail for it.
struct Departure {
    what: &'static str,
    declared: String,
    library: String,
    fails: bool,
}

/// The differences of two members.
#[derive(Default)]
struct Departures(Vec<Departure>);

impl Departures {
    fn add<T: PartialEq>(&mut self, what: &'static str, pair: (&T, &T), fails: bool, told: impl Fn(&T) -> String) {
        if pair.0 != pair.1 {
            self.0.push(Departure { what, declared: told(pair.0), library: told(pair.1), fails });
        }
    }
}

struct Compared<'f> {
    ty: TypeName,
    origin: Origin,
    by: TypeOwner,
    findings: &'f mut Findings,
}

impl Compared<'_> {
    fn types(mut self, declared: &ComponentType, library: &ComponentType) {
        let of = &mut self;
        of.members("ports", "port", (&declared.ports, &library.ports), |of: &PortType| of.origin, port, |_| None);
        of.members(
            "properties",
            "property",
            (&declared.properties, &library.properties),
            |of: &PropertyType| of.origin,
            property,
            |of| of.default.is_none().then_some("has no default: a `create` that does not give it fails"),
        );
        of.members(
            "operations",
            "operation",
            (&declared.operations, &library.operations),
            |of: &OperationType| of.origin,
            operation,
            |_| None,
        );
        of.whole(declared, library);
    }

    fn members<T>(
        &mut self,
        key: &str,
        one: &str,
        (declared, library): (&BTreeMap<Ident, T>, &BTreeMap<Ident, T>),
        origin: impl Fn(&T) -> Origin,
        compare: impl Fn(&T, &T) -> Departures,
        needed: impl Fn(&T) -> Option<&'static str>,
    ) {
        let (ty, by) = (self.ty, self.by.word());
        for (name, own) in declared {
            let path = format!("types.{ty}.{key}.{name}");
            let Some(other) = library.get(name) else {
                let message = format!("the {by}'s `{ty}` has no {one} `{name}`");
                self.tell(true, message, origin(own), path);
                continue;
            };
            for Departure { what, declared, library, fails } in compare(own, other).0 {
                let message = format!("`{ty}.{name}`: {what} is declared as {declared}, the {by} has {library}");
                self.tell(fails, message, origin(own), path.clone());
            }
        }
        for (name, other) in library.iter().filter(|(name, _)| !declared.contains_key(*name)) {
            let path = format!("types.{ty}.{key}");
            let needed = needed(other);
            let why = needed.map_or_else(String::new, |why| format!(", which {why}"));
            let message = format!("the {by}'s `{ty}` has a {one} `{name}` that is not declared{why}");
            self.tell(needed.is_some(), message, self.origin, path);
        }
    }

    fn whole(&mut self, declared: &ComponentType, library: &ComponentType) {
        // Each field is decided about here, members each by itself: of one more the compiler asks what is to be.
        let ComponentType { start_after, stop_before, raises, actuator, moves, irreversible, exclusive, .. } = declared;
        let ComponentType {
            name: _,
            doc: _,
            ports: _,
            properties: _,
            operations: _,
            injections: _,
            origin: _,
            start_after: other_start_after,
            stop_before: other_stop_before,
            raises: other_raises,
            actuator: other_actuator,
            moves: other_moves,
            irreversible: other_irreversible,
            exclusive: other_exclusive,
        } = library;
        let mut found = Departures::default();
        let names = |list: &Vec<TypeName>| words(list.iter());
        found.add("start_after", (start_after, other_start_after), false, names);
        found.add("stop_before", (stop_before, other_stop_before), false, names);
        // What the library does not raise is waited for in vain; what is not declared is missed by nobody.
        if raises.keys().any(|event| !other_raises.contains_key(event)) {
            found.add("raises", (raises, other_raises), false, |all| words(all.keys()));
        }
        found.add("actuator", (actuator, other_actuator), false, bool::to_string);
        found.add("moves", (moves, other_moves), false, |of| words(of.words()));
        found.add("irreversible", (irreversible, other_irreversible), false, |of| words(of.words()));
        // What the library holds and the declaration does not say, a plan would not heed.
        let fails = other_exclusive.iter().any(|resource| !exclusive.contains(resource));
        found.add("exclusive", (exclusive, other_exclusive), fails, |all: &Vec<_>| words(all.iter()));
        for Departure { what, declared, library, fails } in found.0 {
            let message =
                format!("`{}`: {what} is declared as {declared}, the {} has {library}", self.ty, self.by.word());
            self.tell(fails, message, self.origin, format!("types.{}.{what}", self.ty));
        }
    }

    fn tell(&mut self, fails: bool, message: String, at: Origin, path: String) {
        let make = if fails { Finding::error } else { Finding::warning };
        let help = match self.by {
            TypeOwner::Library => format!(
                "the library's counts, as it is what runs: write what it has (`davit types {}` shows it), or leave the declaration \
                 out",
                self.ty
            ),
            TypeOwner::Platform => "the platform's counts, as it is what runs: declare what it has".to_owned(),
        };
        self.findings.push(make(TYPE_DIFFERS, message).at(at).path(path).help(help));
    }
}

fn port(declared: &PortType, library: &PortType) -> Departures {
    let PortType { direction, ty, unit: own_unit, buffered, required, doc: _, origin: _ } = declared;
    let mut found = Departures::default();
    found.add("the direction", (direction, &library.direction), true, |of| of.word().to_owned());
    found.add("the type", (ty, &library.ty), true, ValueType::to_string);
    // One without a unit may be connected to any.
    found.add("the unit", (own_unit, &library.unit), library.unit.is_some(), unit);
    found.add("buffered", (buffered, &library.buffered), true, bool::to_string);
    found.add("required", (required, &library.required), false, bool::to_string);
    found
}

fn property(declared: &PropertyType, library: &PropertyType) -> Departures {
    let PropertyType { ty, default, min, max, tunable, raises, unit: own_unit, doc: _, origin: _ } = declared;
    let mut found = Departures::default();
    found.add("the type", (ty, &library.ty), true, ValueType::to_string);
    found.add("the unit", (own_unit, &library.unit), false, unit);
    found.add("the default", (default, &library.default), library.default.is_none(), shown);
    let narrower = |declared: Option<f64>, library: Option<f64>, is: fn(f64, f64) -> bool| {
        library.is_some_and(|library| declared.is_none_or(|declared| is(library, declared)))
    };
    let bounds = [
        ("min", *min, library.min, narrower(*min, library.min, |library, declared| library > declared)),
        ("max", *max, library.max, narrower(*max, library.max, |library, declared| library < declared)),
    ];
    for (what, own, other, fails) in bounds {
        found.add(what, (&own, &other), fails, shown);
    }
    // In the order of the run states in which it may be set.
    found.add("tunable", (tunable, &library.tunable), library.tunable < *tunable, Tunable::to_string);
    found.add("raises", (raises, &library.raises), library.raises && !raises, bool::to_string);
    found
}

fn operation(declared: &OperationType, library: &OperationType) -> Departures {
    let OperationType { args: own_args, returns, effect, moves, settled_by, doc: _, origin: _ } = declared;
    let mut found = Departures::default();
    let args =
        |of: &Vec<ValueType>| format!("[{}]", of.iter().map(ValueType::to_string).collect::<Vec<_>>().join(", "));
    found.add("args", (own_args, &library.args), true, args);
    found.add("returns", (returns, &library.returns), false, shown);
    found.add("the effect", (effect, &library.effect), false, |effect| match effect {
        Effect::None => "none".to_owned(),
        Effect::Undo(undo) => format!("undo: {undo}"),
        Effect::Irreversible => "irreversible".to_owned(),
    });
    found.add("moves", (moves, &library.moves), false, bool::to_string);
    if *settled_by != library.settled_by {
        let told = |is: bool| if is { "one condition" } else { "none" }.to_owned();
        let other = if library.settled_by.is_some() && settled_by.is_some() { "another one" } else { "" };
        let library = if other.is_empty() { told(library.settled_by.is_some()) } else { other.to_owned() };
        let declared = told(settled_by.is_some());
        found.0.push(Departure { what: "settled_by", declared, library, fails: false });
    }
    found
}

fn unit(of: &Option<std::sync::Arc<str>>) -> String {
    of.as_ref().map_or_else(|| "none".to_owned(), |unit| format!("`{unit}`"))
}

fn shown<T: Display>(of: &Option<T>) -> String {
    of.as_ref().map_or_else(|| "none".to_owned(), ToString::to_string)
}

fn words<T: Display>(of: impl Iterator<Item = T>) -> String {
    let all: Vec<String> = of.map(|word| word.to_string()).collect();
    if all.is_empty() { "none".to_owned() } else { all.join(", ") }
}
