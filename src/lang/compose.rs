//! A deployment with its subsystems: what it touches of them is resolved to what they export, and all are put together.

use super::tree::Cx;
use crate::model::condition_walk::Looked;
use crate::model::configuration::NameInChange;
use crate::model::finding::{did_you_mean, nearest};
use crate::model::monitor::Condition;
use crate::model::naming::Naming;
use crate::model::within::Within;
use crate::model::{
    ComponentName, Configuration, Deployment, Finding, Ident, MemberClass, MemberRef, OperatorMay, Origin, Subsystem,
    Target, codes,
};
use std::sync::Arc;

/// Puts a deployment together with its subsystems: the result has all that they are made of, by their paths.
pub fn compose(cx: &mut Cx, mut own: Deployment) -> Deployment {
    if own.subsystems.is_empty() {
        return own;
    }
    let subsystems = own.subsystems.clone();
    let resolve = Resolve { subsystems: &subsystems };
    resolve.names(cx, &own);
    for (name, export) in &mut own.interface.exports {
        export.of = resolve.member(cx, export.of, export.kind, export.origin, name.as_str());
    }
    let mut configurations = std::mem::take(&mut own.configurations);
    configurations.iter_mut().for_each(|configuration| resolve.configuration(cx, configuration));
    own.configurations = configurations;
    let mut monitors = std::mem::take(&mut own.monitors);
    monitors.iter_mut().for_each(|monitor| {
        let origin = monitor.origin;
        resolve.condition(cx, &mut monitor.when, origin);
    });
    own.monitors = monitors;
    for (may, origin) in &mut own.operator {
        if let OperatorMay::Set(member) = may {
            let kind = resolve.kind_of(*member);
            *member = resolve.member(cx, *member, kind, *origin, "operator");
        }
    }
    let mut whole = own.clone();
    for subsystem in &subsystems {
        resolve.fits(cx, &own, subsystem);
        join(cx, &mut whole, subsystem);
    }
    whole.own = Some(Arc::new(own));
    whole
}

/// Takes in what a subsystem is made of.
fn join(cx: &mut Cx, whole: &mut Deployment, subsystem: &Subsystem) {
    let own = &*subsystem.own;
    let within = Within { path: subsystem.name, activities: &subsystem.activities };
    for library in &own.libraries {
        if !whole.libraries.contains(library) {
            whole.libraries.push(*library);
        }
    }
    for ty in &own.types {
        match whole.types.iter().find(|known| known.name == ty.name) {
            None => whole.types.push(ty.clone()),
            Some(known) if known == ty => {}
            Some(known) => {
                let message = format!("two files declare a type `{}`, and not the same", ty.name);
                let finding = Finding::error(codes::COMPOSE_DIFFERS, message).at(ty.origin);
                cx.report(finding.also(known.origin, "the other one").help("give one of them another name"));
            }
        }
    }
    let activities = own.activities.iter().filter(|(name, _)| !subsystem.activities.contains_key(*name));
    whole.activities.extend(activities.map(|(name, activity)| (within.activity(*name), *activity)));
    whole.configurations.extend(own.configurations.iter().map(|of| within.configuration(of)));
    for coordinator in &own.coordinators {
        if let Some(program) = own.programs.get(&coordinator.name) {
            whole.programs.insert(within.coordinator_name(coordinator), program.clone());
        }
        whole.coordinators.push(within.coordinator(coordinator));
    }
    whole.monitors.extend(own.monitors.iter().map(|monitor| within.monitor(monitor)));
    // What is told between the files leaves neither of them unheard.
    let told = own.emits.iter().chain(&own.interface.accepts).map(|(event, origin)| (within.event(*event), *origin));
    let asked = [own.deploy.event, own.shutdown.event].map(|event| (within.event(event), subsystem.origin));
    for (event, origin) in told.chain(asked) {
        if !whole.emits.iter().any(|(known, _)| *known == event) {
            whole.emits.push((event, origin));
        }
    }
    whole.safety.extend(own.safety.iter().map(|(event, origin)| (within.event(*event), *origin)));
    whole.operator.extend(own.operator.iter().map(|(may, origin)| (within.operator(*may), *origin)));
    whole.reactions.extend(own.reactions.iter().map(|reaction| within.reaction(reaction)));
    whole.faults.extend(own.faults.iter().map(|fault| within.fault(fault)));
}

/// Finds what is meant by names of what is in subsystems.
struct Resolve<'a> {
    subsystems: &'a [Subsystem],
}

impl Resolve<'_> {
    fn named(&self, name: &str) -> Option<&Subsystem> {
        self.subsystems.iter().find(|subsystem| subsystem.name.as_str() == name)
    }

    /// The subsystem that a component is in, by its name from here, or whose name it is.
    fn holding(&self, component: ComponentName) -> Option<&Subsystem> {
        let text = component.as_str();
        self.named(text.split_once('/').map_or(text, |(first, _)| first))
    }

    /// Whether a subsystem's platform and activities are those of the deployment.
    fn fits(&self, cx: &mut Cx, own: &Deployment, subsystem: &Subsystem) {
        let name = subsystem.name;
        if (subsystem.own.platform, &subsystem.own.platform_options) != (own.platform, &own.platform_options) {
            let (platform, its) = (own.platform, subsystem.own.platform);
            let near = nearest(platform.as_str(), std::iter::once(its.as_str())).filter(|_| platform != its);
            // One slip of the deployment's file is told where it stands, and not once for each subsystem.
            let (message, at, meant) = match near {
                Some(near) => (
                    format!("this deployment is for the platform `{platform}`, and a subsystem of it for `{its}`"),
                    own.key_origin("platform"),
                    // Which of the two there is, is not known here.
                    format!("`{near}` or `{platform}`? One"),
                ),
                None => {
                    let what = if platform == its {
                        "gives other options to the platform"
                    } else {
                        "is written for another platform than"
                    };
                    (format!("`{name}` {what} `{platform}`"), subsystem.origin, "one".to_owned())
                }
            };
            let help = format!("{meant} platform counts for all of a deployment: write the same in both files");
            let finding = Finding::error(codes::COMPOSE_DIFFERS, message).at(at);
            cx.report(finding.also(subsystem.own.key_origin("platform"), "its platform").help(help));
        }
        for (inner, outer) in &subsystem.activities {
            for (activity, of, whose) in [(inner, &*subsystem.own, "its file"), (outer, own, "this file")] {
                if !of.activities.contains_key(activity) {
                    let message = format!("there is no activity `{activity}` in {whose}");
                    let known = of.activities.keys().map(Ident::as_str);
                    // What is of a subsystem there is given on there.
                    let known = known.filter(|known| !known.contains('/'));
                    let help = did_you_mean(activity.as_str(), "activities", known);
                    let finding = Finding::error(codes::COMPOSE_UNKNOWN, message).at(subsystem.origin);
                    cx.report(finding.help(help));
                }
            }
        }
    }

    /// Whether the names of this file's own things are its own.
    fn names(&self, cx: &mut Cx, own: &Deployment) {
        for coordinator in &own.coordinators {
            if let Some(subsystem) = self.named(coordinator.name.as_str()) {
                let message = format!("a coordinator and a subsystem are both called `{}`", subsystem.name);
                let finding = Finding::error(codes::COMPOSE_NAME_TAKEN, message).at(subsystem.origin);
                cx.report(finding.also(coordinator.origin, "the coordinator").help("give one of them another name"));
            }
        }
        for configuration in &own.configurations {
            let first = configuration.id.as_str().split('/').next().unwrap_or_default();
            if let Some(subsystem) = self.named(first) {
                let message = format!("`{}` is called like what is in the subsystem `{first}`", configuration.id);
                let finding = Finding::error(codes::COMPOSE_NAME_TAKEN, message).at(configuration.origin);
                let path = super::concern::path(configuration.id.as_str());
                cx.report(finding.path(path).also(subsystem.origin, "the subsystem").help("give it another name"));
            }
        }
    }

    fn configuration(&self, cx: &mut Cx, of: &mut Configuration) {
        let before = cx.findings.len();
        for change in &mut of.changes {
            let at = change.origin;
            change.kind.for_each_name_mut(&mut |name| match name {
                NameInChange::Component(component) => self.not_own(cx, *component, at),
                NameInChange::Member(member, class) => *member = self.member(cx, *member, class, at, ""),
                NameInChange::Type(_) | NameInChange::Activity(_) => {}
            });
        }
        for entry in of.pre.iter().chain(of.post.iter()) {
            if let Target::Component(component) = entry.target {
                self.not_own(cx, component, entry.origin);
            }
        }
        if let Some(holds) = &mut of.holds {
            self.condition(cx, holds, of.origin);
        }
        super::concern::all(cx, before, of.id.as_str());
    }

    fn condition(&self, cx: &mut Cx, of: &mut Condition, origin: Origin) {
        let at = if of.origin.is_some() { of.origin } else { origin };
        of.for_each_member_mut(&mut |looked| match looked {
            Looked::Member(member) => *member = self.member(cx, *member, MemberClass::Port, at, ""),
            Looked::Component(component) => self.not_own(cx, *component, at),
            Looked::Activity(_) => {}
        });
    }

    /// What a member is that is exported; of what is not, what it is is no matter.
    fn kind_of(&self, member: MemberRef) -> MemberClass {
        let export = self.named(member.component.as_str()).and_then(|of| of.own.interface.exports.get(&member.member));
        export.map_or(MemberClass::Property, |export| export.kind)
    }

    /// What a member is that is written so: of a subsystem what it exports under that name.
    fn member(&self, cx: &mut Cx, member: MemberRef, kind: MemberClass, at: Origin, place: &str) -> MemberRef {
        let Some(subsystem) = self.holding(member.component) else { return member };
        let exports = &subsystem.own.interface.exports;
        if member.component.as_str() != subsystem.name.as_str() {
            let inner = member.component.local(subsystem.name).unwrap_or_default();
            let inner = format!("{inner}.{}", member.member);
            let alias = exports.iter().find(|(_, export)| export.of.to_string() == inner);
            let help = match alias {
                Some((alias, _)) => format!("write `{}.{alias}`", subsystem.name),
                None => format!(
                    "export it in its file (`exports: {{ {}: {{ {}: {inner} }} }}`), and write `{}.{}`",
                    kind.several(),
                    member.member,
                    subsystem.name,
                    member.member
                ),
            };
            let message = format!(
                "`{member}` is in `{}`: what a subsystem exports is touched from outside, and nothing else",
                subsystem.name
            );
            let finding = Finding::error(codes::COMPOSE_NOT_EXPORTED, message).at(at).path(place);
            cx.report(finding.help(help));
            return member;
        }
        match exports.get(&member.member) {
            Some(export) if export.kind == kind => {
                MemberRef { component: export.of.component.within(subsystem.name), member: export.of.member }
            }
            Some(export) => {
                let message = format!(
                    "`{member}` is exported under `{}`, and not under `{}`",
                    export.kind.several(),
                    kind.several()
                );
                let finding = Finding::error(codes::COMPOSE_NOT_EXPORTED, message).at(at).path(place);
                cx.report(
                    finding
                        .also(export.origin, "exported here")
                        .help("ports are connected and written, properties set, operations called"),
                );
                member
            }
            None => {
                let message = format!("`{member}` is nothing that `{}` exports", subsystem.name);
                let known = exports.iter().filter(|(_, export)| export.kind == kind).map(|(name, _)| name.as_str());
                let (name, key) = (member.member, kind.several());
                let help = did_you_mean(name.as_str(), key, known.clone());
                let help = match nearest(name.as_str(), known) {
                    Some(_) => help,
                    None => format!(
                        "export it in its file (`exports: {{ {key}: {{ {name}: COMPONENT.{name} }} }}`); {help}"
                    ),
                };
                let finding = Finding::error(codes::COMPOSE_NOT_EXPORTED, message).at(at).path(place);
                cx.report(finding.also(subsystem.origin, "the subsystem").help(help));
                member
            }
        }
    }

    /// A component that only its own file makes, takes away, and brings from one run state to another.
    fn not_own(&self, cx: &mut Cx, component: ComponentName, at: Origin) {
        if let Some(subsystem) = self.holding(component) {
            let name = subsystem.name;
            let message = match component.as_str() == name.as_str() {
                true => format!("`{name}` is a subsystem, and no component"),
                false => format!("`{component}` is a component of the subsystem `{name}`"),
            };
            let finding = Finding::error(codes::COMPOSE_NOT_OWN, message).at(at);
            cx.report(finding.also(subsystem.origin, "the subsystem").help(format!(
                "its own file makes, starts, stops and removes what is in it: raise an event that it accepts (`{name}/{}`)",
                subsystem.own.deploy.event
            )));
        }
    }
}
