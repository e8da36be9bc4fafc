//! That part of what commands an actuator may die, and nobody would notice.
//!
//! It is demanded where there is an actuator, of components that a configuration starts: those whose data reach one, over as
//! many connections as it takes, those that a configuration's `holds` reads (what it stands for stays true with their last
//! value), and those that run the monitors. What sends nothing cannot be missed. A component is watched where a monitor reads
//! it, or whoever receives its data can raise events, or its fault is heard.

use super::universe::Universe;
use crate::model::codes::DEPLOY_UNWATCHED;
use crate::model::monitor::is_monitors;
use crate::model::{
    ChangeKind, ComponentName, ComponentType, Deployment, Direction, EventName, FAULTED, Finding, Findings, Ident,
    MemberRef, Origin, PortType, RunState, Target, ValueType,
};
use crate::statechart::Chart;
use rustc_hash::{FxHashMap, FxHashSet};

/// Components that may die unnoticed.
pub fn check(deployment: &Deployment, universe: &Universe, charts: &[&Chart]) -> Findings {
    if !universe.types().any(|ty| ty.actuator) {
        return Vec::new();
    }
    let look = Look { deployment, universe, charts };
    let (read, reach) = (look.read_by_holds(), look.reaching_an_actuator());
    let (watched, reported, started) = (look.read_by_monitors(), look.reported(), look.started());
    let missed = |name: &ComponentName| {
        started(*name) && look.sends(*name) && !watched.contains(name) && !reported.contains(name)
    };
    let mut names: Vec<ComponentName> = universe.components().filter(missed).collect();
    names.sort_unstable_by_key(ComponentName::as_str);
    let missed = names.into_iter().filter(|name| !look.is_fault_heard(*name) && !look.is_watched_inside(*name));
    missed
        .filter_map(|name| {
            let why = if let Some((_, at)) = read.iter().find(|(read, _)| *read == name) {
                (*at, "a configuration stands for what it sends")
            } else if look.is(name, |ty| is_monitors(ty.name)) {
                (Origin::NONE, "it runs the monitors")
            } else if look.is(name, |ty| ty.actuator) {
                (Origin::NONE, "it is an actuator")
            } else if reach.contains(&name) {
                (Origin::NONE, "what it sends reaches an actuator")
            } else {
                return None;
            };
            Some(look.finding(name, why))
        })
        .collect()
}

struct Look<'a> {
    deployment: &'a Deployment,
    universe: &'a Universe,
    charts: &'a [&'a Chart],
}

impl Look<'_> {
    fn finding(&self, name: ComponentName, (stands, why): (Origin, &str)) -> Finding {
        let message = format!("`{name}` may die unnoticed, and {why}");
        let origin = self.universe.of(name).first().map_or(Origin::NONE, |creation| creation.origin);
        // Where nothing happens an event port is silent as well.
        let sends = |port: &PortType| port.direction == Direction::Out && port.ty != ValueType::Event;
        let port = self.types(name).flat_map(|ty| &ty.ports).find(|(_, port)| sends(port));
        let port = port.map(|(port, _)| name.member(*port));
        let within = self.within(name);
        let fault = match within {
            // What happens to it is heard there, and nowhere else.
            Some((path, own)) => format!("let a transition of `{path}`, in its own file, hear `{own}.faulted`"),
            None => format!("let a transition hear `{name}.faulted`"),
        };
        // It may be read by the name by which it is exported.
        let port = port.map(|port| self.exported_as(port).unwrap_or_else(|| port.to_string()));
        let help = match port {
            // Of its own death it tells nothing.
            _ if self.is(name, |ty| is_monitors(ty.name)) => format!(
                "{fault}; or connect what it writes in every update (`is_NAME` of a monitor) to a component that raises an event when \
                 that is silent"
            ),
            Some(port) => {
                format!("let a monitor tell that `{port}` is silent, and a transition hear its event; or {fault}")
            }
            None => fault,
        };
        let finding = Finding::warning(DEPLOY_UNWATCHED, message).at(origin).labelled("nobody watches it");
        let finding = if stands.is_some() { finding.also(stands, "what it stands for") } else { finding };
        finding.path("monitors").help(help)
    }

    fn types(&self, name: ComponentName) -> impl Iterator<Item = &ComponentType> {
        self.universe.of(name).iter().filter_map(|creation| creation.description.as_deref())
    }

    fn is(&self, name: ComponentName, what: impl Fn(&ComponentType) -> bool) -> bool {
        self.types(name).any(what)
    }

    /// Whether some configuration brings a component to running.
    fn started(&self) -> impl Fn(ComponentName) -> bool {
        let (mut named, mut all) = (FxHashSet::default(), FxHashSet::default());
        for configuration in &self.deployment.configurations {
            let entries = configuration.pre.iter().chain(configuration.post.iter());
            for entry in entries.filter(|entry| RunState::from(entry.state) == RunState::Running) {
                match entry.target {
                    Target::Component(component) => _ = named.insert(component),
                    Target::Default => _ = all.insert(configuration.id.prefix()),
                }
            }
        }
        move |name| named.contains(&name) || all.contains(name.prefix())
    }

    fn sends(&self, name: ComponentName) -> bool {
        self.is(name, |ty| ty.ports.values().any(|port| port.direction == Direction::Out))
    }

    fn is_fault_heard(&self, name: ComponentName) -> bool {
        let Ok(event) = EventName::new(&format!("{name}{FAULTED}")) else { return false };
        self.hears(event)
    }

    /// The subsystem that a component is in, and its name there.
    fn within(&self, name: ComponentName) -> Option<(Ident, &'static str)> {
        self.deployment.subsystems.iter().find_map(|of| Some((of.name, name.local(of.name)?)))
    }

    fn exported_as(&self, port: MemberRef) -> Option<String> {
        self.deployment.subsystems.iter().find_map(|of| {
            let mut exports = of.own.interface.exports.iter();
            let is =
                |of_it: MemberRef| of_it.component.within(of.name) == port.component && of_it.member == port.member;
            exports.find(|(_, export)| is(export.of)).map(|(alias, _)| format!("{}.{alias}", of.name))
        })
    }

    /// Whether it is in a subsystem in which its fault is heard, or a monitor reads it: that one tells how it stands.
    fn is_watched_inside(&self, name: ComponentName) -> bool {
        let Some((path, own)) = self.within(name) else { return false };
        let Some(inside) = self.deployment.subsystems.iter().find(|of| of.name == path) else { return false };
        let mut read = false;
        for monitor in &inside.own.monitors {
            monitor.when.for_each_component(&mut |component, _| read |= component.as_str() == own);
        }
        read || inside.own.charts().any(|chart| chart.waits_for(&format!("{own}{FAULTED}")))
    }

    fn hears(&self, event: EventName) -> bool {
        self.charts.iter().any(|chart| chart.events().contains(&event))
    }

    /// Components whose data somebody receives who can raise events.
    fn reported(&self) -> FxHashSet<ComponentName> {
        let tells = |ty: &ComponentType| {
            ty.ports.values().any(|port| port.direction == Direction::Out && port.ty == ValueType::Event)
        };
        let heard = self.connections().filter(|(_, to)| self.is(to.component, tells));
        heard.map(|(from, _)| from.component).collect()
    }

    fn connections(&self) -> impl Iterator<Item = (MemberRef, MemberRef)> {
        self.deployment.configurations.iter().flat_map(|c| &c.changes).filter_map(|change| match change.kind {
            ChangeKind::Connect { from, to, .. } => Some((from, to)),
            _ => None,
        })
    }

    fn reaching_an_actuator(&self) -> FxHashSet<ComponentName> {
        let mut senders: FxHashMap<ComponentName, Vec<ComponentName>> = FxHashMap::default();
        self.connections().for_each(|(from, to)| senders.entry(to.component).or_default().push(from.component));
        let is_actuator = |name: &ComponentName| self.is(*name, |ty| ty.actuator);
        let mut further: Vec<ComponentName> = self.universe.components().filter(is_actuator).collect();
        let mut reach: FxHashSet<ComponentName> = further.iter().copied().collect();
        while let Some(name) = further.pop() {
            let new = senders.get(&name).into_iter().flatten().filter(|from| reach.insert(**from));
            further.extend(new);
        }
        reach
    }

    /// Components that what configurations stand for looks at, and where that is said.
    fn read_by_holds(&self) -> Vec<(ComponentName, Origin)> {
        let mut read = Vec::new();
        for holds in self.deployment.configurations.iter().filter_map(|c| c.holds.as_ref()) {
            holds.for_each_component(&mut |component, at| read.push((component, at)));
        }
        read
    }

    /// Components that monitors look at whose events are heard.
    fn read_by_monitors(&self) -> FxHashSet<ComponentName> {
        let mut read = FxHashSet::default();
        let heard = |event: EventName| self.hears(event);
        for monitor in self.deployment.monitors.iter().filter(|monitor| monitor.events().any(heard)) {
            // What alone runs it does not tell that it is dead itself.
            let run_by = |name: ComponentName| self.is(name, |ty| is_monitors(ty.name) && ty.name == monitor.run_by());
            let runs = |name: ComponentName| {
                run_by(name) && !self.universe.components().any(|other| other != name && run_by(other))
            };
            monitor.when.for_each_component(&mut |component, _| {
                if !runs(component) {
                    read.insert(component);
                }
            });
        }
        read
    }
}
