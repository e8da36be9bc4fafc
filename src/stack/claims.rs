//! What a request may touch, known from its text: requests that have nothing to do with each other are carried out at the
//! same time (semantics: *Requests*).

use super::contenders::{contenders, may_hold};
use super::request::{Request, Requester};
use super::{Frame, share};
use crate::model::names::is_within;
use crate::model::{Ask, Catalogue, ChangeKind, ComponentName, ConfigId, Configuration, Ident, Target};
use rustc_hash::FxHashMap;
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// A set of the components that the configurations of a deployment name.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Claim {
    /// Everything there is.
    all: bool,
    bits: SmallVec<[u64; 4]>,
}

impl Claim {
    /// Everything.
    pub fn all() -> Self {
        Self { all: true, bits: SmallVec::new() }
    }

    fn set(&mut self, at: usize) {
        if self.bits.len() <= at / 64 {
            self.bits.resize(at / 64 + 1, 0);
        }
        self.bits[at / 64] |= 1 << (at % 64);
    }

    fn has(&self, at: usize) -> bool {
        self.bits.get(at / 64).is_some_and(|bits| bits & 1 << (at % 64) != 0)
    }

    /// Takes `other` in.
    pub fn join(&mut self, other: &Self) {
        self.all |= other.all;
        if self.bits.len() < other.bits.len() {
            self.bits.resize(other.bits.len(), 0);
        }
        self.bits.iter_mut().zip(&other.bits).for_each(|(a, b)| *a |= b);
    }

    /// Whether they have something in common. Nothing has nothing in common with anything.
    pub fn meets(&self, other: &Self) -> bool {
        let empty = |claim: &Self| !claim.all && claim.bits.iter().all(|bits| *bits == 0);
        match (self.all, other.all) {
            (true, _) => !empty(other),
            (_, true) => !empty(self),
            _ => self.bits.iter().zip(&other.bits).any(|(a, b)| a & b != 0),
        }
    }
}

/// The claims of a deployment's configurations.
#[derive(Debug, Clone, Default)]
pub struct Claims {
    of: FxHashMap<ConfigId, Claim>,
    /// The components with their numbers.
    numbers: FxHashMap<ComponentName, usize>,
    /// Components that may hold what others may hold, with these.
    contenders: BTreeMap<ComponentName, Vec<ComponentName>>,
    /// The groups of those that have one.
    groups: FxHashMap<ConfigId, Ident>,
}

impl Claims {
    /// What each configuration claims: the components that it and those of its group name, and what those may be connected to
    /// that it replaces; with `_default` all of its file; with each component those that may need the same thing for themselves.
    pub fn new<'c>(configurations: impl Iterator<Item = &'c Configuration> + Clone, types: &Catalogue) -> Self {
        let most = configurations.clone().map(|configuration| configuration.changes.len()).max().unwrap_or_default();
        let mut numbers: FxHashMap<ComponentName, usize> = FxHashMap::default();
        numbers.reserve(most);
        let mut of: FxHashMap<ConfigId, Claim> = FxHashMap::default();
        for configuration in configurations.clone() {
            let mut claim = Claim::default();
            for_each_named(configuration, &mut |component| {
                let next = numbers.len();
                claim.set(*numbers.entry(component).or_insert(next));
            });
            of.insert(configuration.id, claim);
        }
        // What is replaced may be connected to whatever any of them connects it to.
        let changes = configurations.clone().flat_map(|configuration| &configuration.changes);
        let linked: Vec<(ComponentName, ComponentName)> = changes
            .filter_map(|change| match &change.kind {
                ChangeKind::Connect { from, to, .. } => Some((from.component, to.component)),
                _ => None,
            })
            .collect();
        for configuration in configurations.clone() {
            for change in &configuration.changes {
                let ChangeKind::Replace { component, .. } = &change.kind else { continue };
                let ends = linked.iter().filter(|(from, to)| from == component || to == component);
                let Some(claim) = of.get_mut(&configuration.id) else { continue };
                ends.flat_map(|(from, to)| [from, to]).for_each(|end| claim.set(numbers[end]));
            }
        }
        // With `_default` all of the file, whichever names it.
        for configuration in configurations.clone() {
            let mut states = configuration.pre.iter().chain(configuration.post.iter());
            if states.any(|entry| entry.target == Target::Default)
                && let Some(claim) = of.get_mut(&configuration.id)
            {
                let scope = configuration.id.prefix();
                numbers.iter().filter(|(name, _)| name.prefix() == scope).for_each(|(_, at)| claim.set(*at));
            }
        }
        let contenders = contenders(&may_hold(configurations.clone(), types));
        let rivals: Vec<(usize, Vec<usize>)> = contenders
            .iter()
            .map(|(name, all)| (numbers[name], all.iter().map(|rival| numbers[rival]).collect()))
            .collect();
        for claim in of.values_mut() {
            let mut more = Claim::default();
            let claimed = rivals.iter().filter(|(at, _)| claim.has(*at));
            claimed.flat_map(|(_, rivals)| rivals).for_each(|at| more.set(*at));
            claim.join(&more);
        }
        let grouped = configurations.clone();
        let mut groups: BTreeMap<Ident, Claim> = BTreeMap::new();
        for configuration in configurations.clone() {
            if let (Some(group), Some(claim)) = (configuration.group, of.get(&configuration.id)) {
                groups.entry(group).or_default().join(claim);
            }
        }
        for configuration in configurations {
            if let (Some(group), Some(claim)) = (configuration.group, of.get_mut(&configuration.id)) {
                claim.join(&groups[&group]);
            }
        }
        let groups = grouped.filter_map(|configuration| Some((configuration.id, configuration.group?))).collect();
        Self { of, numbers, contenders, groups }
    }

    /// Whether applying one takes the frame of another one away: it is that, or of its group, and has one.
    pub fn replaces(&self, one: ConfigId, other: ConfigId) -> bool {
        self.groups.get(&one).is_some_and(|group| self.groups.get(&other) == Some(group))
    }

    /// Whether an undo that is not carried out lets go of what is still coming, and not of a frame that is there, where there are both: by its name
    /// the newest is meant; and the frame of a visit before is replaced by what comes, whose undo came with that.
    pub fn newest_is_meant(&self, undo: &Request) -> bool {
        undo.scope.is_none() || matches!(undo.ask, Ask::UndoOf(id) if self.replaces(id, id))
    }

    /// Adds one that names components only, and belongs to no group; in the place of one of that name. What a value that it gives
    /// makes them need is not known: the step that would take it is looked at when it comes.
    pub fn add(&mut self, configuration: &Configuration) {
        let mut claim = Claim::default();
        let mut named = components(configuration);
        let more = named.iter().flat_map(|name| self.contenders.get(name)).flatten().copied().collect::<Vec<_>>();
        named.extend(more);
        named.into_iter().for_each(|component| {
            let next = self.numbers.len();
            claim.set(*self.numbers.entry(component).or_insert(next));
        });
        self.of.insert(configuration.id, claim);
    }

    /// Every component that a configuration names.
    pub fn components(&self) -> impl Iterator<Item = ComponentName> + '_ {
        self.numbers.keys().copied()
    }

    /// Whether a safe configuration interrupts requests of one batch: one of them claims something of its (sub)system, or belongs
    /// to it without claiming anything.
    pub fn interrupts<'r>(&self, safe: ConfigId, requests: impl IntoIterator<Item = &'r Request> + Clone) -> bool {
        let path = safe.prefix();
        let belongs = |request: &Request| match request.ask {
            Ask::Apply(id) | Ask::UndoOf(id) => is_of_system(safe, id),
            // What it claims says the rest.
            Ask::Undo => !matches!(request.requester, Requester::Coordinator(name) if !is_within(name.as_str(), path)),
            Ask::UndoTo(_) | Ask::Commit { .. } => true,
        };
        path.is_empty() || requests.clone().into_iter().any(belongs) || self.inside(path).meets(&self.of(requests))
    }

    /// What a frame is about: everything, where that is more than the configurations of the deployment name.
    pub fn of_frame(&self, frame: &Frame) -> Claim {
        let mut claim = Claim::default();
        for component in share::components(&frame.footprint) {
            match self.numbers.get(&component) {
                Some(at) => claim.set(*at),
                None => return Claim::all(),
            }
        }
        claim
    }

    /// What a requester's file, and those of its subsystems, are about.
    fn of_file(&self, requester: Requester) -> Claim {
        let Requester::Coordinator(name) = requester else { return Claim::all() };
        let name = name.as_str();
        let is_path = self.numbers.keys().any(|component| is_within(component.prefix(), name));
        match name.rsplit_once('/') {
            // A coordinator without a name of its own is called like its subsystem.
            _ if is_path => self.inside(name),
            Some((path, _)) => self.inside(path),
            None => Claim::all(),
        }
    }

    /// All components of the subsystem of a path.
    fn inside(&self, path: &str) -> Claim {
        let mut inside = Claim::default();
        let names = self.numbers.iter().filter(|(name, _)| is_within(name.prefix(), path));
        names.for_each(|(_, at)| inside.set(*at));
        inside
    }

    /// What requests claim together. A configuration that is not there claims nothing.
    pub fn of<'r>(&self, requests: impl IntoIterator<Item = &'r Request>) -> Claim {
        let mut claim = Claim::default();
        for request in requests {
            match request.ask {
                Ask::Apply(id) | Ask::UndoOf(id) => {
                    if let Some(own) = self.of.get(&id) {
                        claim.join(own);
                    }
                }
                // Which frame is the newest is not known from the text. That a coordinator is down is asked like this, too.
                Ask::Undo => claim.join(&self.of_file(request.requester)),
                Ask::UndoTo(_) | Ask::Commit { .. } => claim.all = true,
            }
        }
        claim
    }
}

/// Whether a configuration belongs to the (sub)system of another one, or to one inside it.
pub fn is_of_system(of: ConfigId, id: ConfigId) -> bool {
    is_within(id.prefix(), of.prefix())
}

/// Whether a component is in the (sub)system of a configuration, or in one inside it.
pub fn is_in_system(of: ConfigId, component: ComponentName) -> bool {
    is_within(component.prefix(), of.prefix())
}

/// Calls `f` with the components that a configuration names; one may come more than once.
fn for_each_named(configuration: &Configuration, f: &mut impl FnMut(ComponentName)) {
    for change in &configuration.changes {
        change.kind.components().into_iter().for_each(&mut *f);
    }
    for entry in configuration.pre.iter().chain(configuration.post.iter()) {
        if let Target::Component(component) = entry.target {
            f(component);
        }
    }
}

/// Components that a configuration names, each once.
pub fn components(configuration: &Configuration) -> std::collections::BTreeSet<ComponentName> {
    let mut components = std::collections::BTreeSet::new();
    for_each_named(configuration, &mut |component| _ = components.insert(component));
    components
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Change, Origin, Policy, RequestId, TypeName, Value};

    #[test]
    fn what_is_replaced_claims_what_it_may_be_connected_to() {
        let component = |name: &str| ComponentName::new(name).unwrap();
        let member = |name: &str, port: &str| component(name).member(Ident::new(port).unwrap());
        let one = |id: &str, kind: ChangeKind| Configuration {
            changes: vec![Change { kind, origin: Origin::NONE }],
            ..Configuration::new(ConfigId::new(id).unwrap())
        };
        let set = |of: &str| ChangeKind::PropertySet { property: member(of, "k"), value: Value::Int(1) };
        let all = [
            one("wire", ChangeKind::Connect { from: member("a", "y"), to: member("b", "u"), policy: Policy::Data }),
            one(
                "swap",
                ChangeKind::Replace {
                    component: component("b"),
                    ty: TypeName::new("T").unwrap(),
                    activity: None,
                    properties: BTreeMap::new(),
                    map: BTreeMap::new(),
                },
            ),
            one("source", set("a")),
            one("other", set("c")),
        ];
        let claims = Claims::new(all.iter(), &Catalogue::new());
        let of = |n: usize| claims.of([&Request::new(RequestId(0), Ask::Apply(all[n].id), Requester::Operator)]);
        assert!(of(1).meets(&of(2)) && of(1).meets(&of(0)) && !of(1).meets(&of(3)));
    }

    #[test]
    fn what_is_asked_of_a_file_claims_that_file() {
        let set = |of: &str| Configuration {
            changes: vec![Change {
                kind: ChangeKind::PropertySet {
                    property: ComponentName::new(of).unwrap().member(Ident::new("k").unwrap()),
                    value: Value::Int(1),
                },
                origin: Origin::NONE,
            }],
            ..Configuration::new(ConfigId::new(&format!("{}x", of.trim_end_matches('D'))).unwrap())
        };
        let all = [set("D"), set("left/D"), set("left/in/D"), set("right/D")];
        let claims = Claims::new(all.iter(), &Catalogue::new());
        let by = |name: &str| Requester::Coordinator(ComponentName::new(name).unwrap());
        let meets = |name: &str, n: usize| {
            let undo = Request::new(RequestId(0), Ask::Undo, by(name));
            let apply = Request::new(RequestId(1), Ask::Apply(all[n].id), Requester::Operator);
            claims.of([&undo]).meets(&claims.of([&apply]))
        };
        let of = |name: &str| (0..4).map(|n| meets(name, n)).collect::<Vec<_>>();
        assert_eq!(of("pair"), [true, true, true, true]);
        assert_eq!(of("left"), [false, true, true, false]);
        assert_eq!(of("left/arm"), [false, true, true, false]);
        assert_eq!(of("left/in"), [false, false, true, false]);
    }
}
