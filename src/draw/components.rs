//! The components of a system, their ports and connections.

use super::components_view::{ComponentPlace, ComponentsView, FoldedBox, tone};
use super::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Subject};
use super::hierarchy::SubsystemBoxes;
use super::text::short;
use crate::model::monitor::{ConditionKind, SignalKind, is_monitors};
use crate::model::names::local_to;
use crate::model::{
    Catalogue, ComponentName, Direction as PortDirection, MemberRef, Monitor, Policy, RunState, Snapshot, TypeName,
    Value,
};
use std::collections::{BTreeMap, BTreeSet};

/// What a system looks like: a box for each component with its type, its run state and those of its ports that are
/// connected, written or watched; an edge for each connection, labelled with its policy where that is not `data`. A
/// component that runs `monitors` has a dashed line from each port they watch, and a row for each of them with its events.
pub fn components(
    title: &str,
    system: &Snapshot,
    catalogue: &Catalogue,
    monitors: &[Monitor],
    view: ComponentsView,
) -> Diagram {
    let mut diagram = Diagram::new(Subject::Components, RankDirection::Right, title);
    let is_own = |name: ComponentName| matches!(view.place(name), ComponentPlace::Own(_));
    let mut used: BTreeSet<MemberRef> = BTreeSet::new();
    let connections = || system.connections.iter().filter(|((from, to), _)| view.shows(*from, *to));
    used.extend(connections().flat_map(|((from, to), _)| [*from, *to]));
    used.extend(system.ports.keys().filter(|port| is_own(port.component)));
    let watching = |ty: TypeName| is_monitors(ty);
    let watchers: BTreeSet<TypeName> =
        system.components.iter().filter(|(name, c)| watching(c.ty) && is_own(**name)).map(|(_, c)| c.ty).collect();
    let watched: Vec<(&Monitor, BTreeSet<WatchedMember>)> = monitors
        .iter()
        .filter(|monitor| watchers.contains(&monitor.run_by()))
        .map(|monitor| (monitor, watches(monitor)))
        .collect();
    used.extend(watched.iter().flat_map(|(_, of)| of).filter_map(|watched| match watched {
        WatchedMember::Port(port) => Some(*port),
        WatchedMember::Component(_) => None,
    }));
    let mut boxes: BTreeMap<ComponentName, usize> = BTreeMap::new();
    let mut rows: BTreeMap<MemberRef, (PortDirection, usize)> = BTreeMap::new();
    let mut groups = SubsystemBoxes::default();
    let mut tones: BTreeSet<RunState> = BTreeSet::new();
    let mut lines: Vec<(WatchedMember, ComponentName, usize)> = Vec::new();
    let mut folded: BTreeMap<&str, FoldedBox> = BTreeMap::new();
    for (name, component) in &system.components {
        let place = view.place(*name);
        let ports = |node: &mut DiagramNode, rows: &mut BTreeMap<MemberRef, (PortDirection, usize)>, before: &str| {
            let Some(ty) = catalogue.get(component.ty) else { return };
            for (port, description) in &ty.ports {
                let member = name.member(*port);
                if !used.contains(&member) {
                    continue;
                }
                let list = match description.direction {
                    PortDirection::In => &mut node.ins,
                    PortDirection::Out => &mut node.outs,
                };
                rows.insert(member, (description.direction, list.len()));
                list.push(match system.ports.get(&member) {
                    Some(value) => format!("{before}{port} = {}", short(&value.to_string(), 18)),
                    None => format!("{before}{port}"),
                });
            }
        };
        let (parent, own) = match place {
            ComponentPlace::Own(path) => {
                (groups.of(&mut diagram, path), name.as_str().rsplit('/').next().unwrap_or(name.as_str()).to_owned())
            }
            ComponentPlace::Folded(path) => {
                let folded = folded.entry(path).or_insert_with(|| FoldedBox::new(&mut diagram, &mut groups, path));
                folded.states.push(component.state);
                let called = view.called(name.as_str());
                let before = local_to(&called, path).unwrap_or(&called);
                ports(&mut diagram.nodes[folded.at], &mut rows, &format!("{before}."));
                boxes.insert(*name, folded.at);
                continue;
            }
            ComponentPlace::Outside if used.iter().any(|member| member.component == *name) => {
                (None, view.called(name.as_str()))
            }
            ComponentPlace::Outside => continue,
        };
        let mut node = DiagramNode::new(name.as_str(), own);
        node.parent = parent;
        let ty = component.ty.as_str();
        // Types are the same everywhere, but for that of a subsystem's monitors.
        node.lines.push(if ty.contains('/') { view.called(ty) } else { ty.to_owned() });
        node.lines.push(match component.activity {
            Some(activity) if place != ComponentPlace::Outside => {
                format!("{} · {}", component.state, view.called(activity.as_str()))
            }
            _ => component.state.to_string(),
        });
        node.tone = tone(component.state);
        tones.insert(component.state);
        ports(&mut node, &mut rows, "");
        if watching(component.ty) && is_own(*name) {
            // A row for each thing that is watched, not for each monitor: several watch one port.
            let own = || watched.iter().filter(|(monitor, _)| monitor.run_by() == component.ty);
            for of in own().flat_map(|(_, of)| of).collect::<BTreeSet<_>>() {
                lines.push((*of, *name, node.ins.len()));
                node.ins.push(view.called(&of.to_string()));
            }
            for (monitor, _) in own() {
                let off = component.properties.get(&monitor.own_name()) == Some(&Value::Bool(false));
                let events: Vec<String> = monitor.events().map(|event| view.called(event.as_str())).collect();
                let arrow = if events.is_empty() { "" } else { " → " };
                let off = if off { " (off)" } else { "" };
                node.outs.push(format!("{}{off}{arrow}{}", monitor.own_name(), events.join(", ")));
            }
        }
        boxes.insert(*name, diagram.add(node));
    }
    for folded in folded.into_values() {
        folded.say(&mut diagram, &mut tones);
    }
    for ((from, to), policy) in connections() {
        let (Some(a), Some(b)) = (boxes.get(&from.component), boxes.get(&to.component)) else { continue };
        let mut edge = DiagramEdge::new(*a, *b);
        edge.from_port = rows.get(from).map(|(_, row)| *row);
        edge.to_port = rows.get(to).map(|(_, row)| *row);
        if let Policy::Buffer(_) = policy {
            edge.label.push(policy.to_string());
            edge.dashed = true;
        }
        diagram.edges.push(edge);
    }
    for (watched, by, row) in lines {
        let (component, port) = match watched {
            WatchedMember::Port(port) => (port.component, rows.get(&port)),
            WatchedMember::Component(name) => (name, None),
        };
        let (Some(a), Some(b)) = (boxes.get(&component), boxes.get(&by)) else { continue };
        let mut edge = DiagramEdge::new(*a, *b);
        // An in-port is watched at its box: lines leave at the other side.
        edge.from_port = port.filter(|(direction, _)| *direction == PortDirection::Out).map(|(_, row)| *row);
        edge.to_port = Some(row);
        edge.dashed = true;
        diagram.edges.push(edge);
    }
    diagram.legend = tones.into_iter().map(|state| (tone(state), state.to_string())).collect();
    diagram
}

/// What a monitor looks at. Activities are in no diagram of components.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum WatchedMember {
    Port(MemberRef),
    Component(ComponentName),
}

impl std::fmt::Display for WatchedMember {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Port(port) => port.fmt(f),
            Self::Component(name) => name.fmt(f),
        }
    }
}

fn watches(monitor: &Monitor) -> BTreeSet<WatchedMember> {
    let mut of = BTreeSet::new();
    monitor.for_each_condition(&mut |condition| match &condition.kind {
        ConditionKind::IsTrue(signal) => _ = of.insert(WatchedMember::Port(signal.member)),
        ConditionKind::Silent { port, .. } => _ = of.insert(WatchedMember::Port(*port)),
        ConditionKind::InState { component, .. } | ConditionKind::Faulted(component) => {
            _ = of.insert(WatchedMember::Component(*component));
        }
        _ => {}
    });
    monitor.for_each_signal(&mut |signal| match &signal.kind {
        SignalKind::Port(signal) => _ = of.insert(WatchedMember::Port(signal.member)),
        SignalKind::Age(port) | SignalKind::Rate { port, .. } => _ = of.insert(WatchedMember::Port(*port)),
        _ => {}
    });
    of
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::monitor::Condition;
    use crate::model::monitor::MONITORS_TYPE;
    use crate::model::{ComponentSnapshot, ComponentType, EventName, Ident, PortType, ValueType};

    /// A diagram of the youBot's control loop, with everything a drawing can have.
    pub(crate) fn youbot() -> (Snapshot, Catalogue) {
        let ident = |t: &str| Ident::new(t).unwrap();
        let mut catalogue = Catalogue::new();
        let mut system = Snapshot::default();
        for (name, ins, outs, state) in [
            ("youbot", "joint_effort_command cmd_twist ext_force", "jointstate odometry events", RunState::Running),
            ("Arm_Kinematics", "jointstate odometry", "tool_pose tool_twist jacobian", RunState::Running),
            ("Cart_Impedance", "tool_pose tool_twist ext_ref ext_ref_mode", "f_des f_raw_norm", RunState::Running),
            ("Dynamics", "f_des jointstate jacobian odometry", "joint_effort_command base_twist", RunState::Stopped),
            ("Base_Ctrl", "base_twist odometry", "cmd_twist", RunState::Unconfigured),
            ("Link_Tx", "tool_pose tool_twist", "tx", RunState::Running),
            ("Link_Rx", "rx", "ext_ref link_stats", RunState::Running),
            ("Link_Monitor", "link_stats", "events", RunState::Running),
            ("Force_Monitor", "f_raw_norm", "events", RunState::Faulted),
            ("Operator", "tool_pose", "ext_force", RunState::Running),
            ("left/Relay", "u", "y", RunState::Running),
        ] {
            let ty = name.rsplit('/').next().unwrap();
            let mut description = ComponentType::new(ty, "");
            for (ports, direction) in [(ins, PortDirection::In), (outs, PortDirection::Out)] {
                for port in ports.split_whitespace() {
                    description.ports.insert(ident(port), PortType::new(direction, ValueType::Float));
                }
            }
            catalogue.insert(description);
            system.components.insert(
                ComponentName::new(name).unwrap(),
                ComponentSnapshot {
                    ty: TypeName::new(ty).unwrap(),
                    state,
                    properties: BTreeMap::new(),
                    activity: Some(ident("control")),
                },
            );
        }
        for pair in "youbot.jointstate Arm_Kinematics.jointstate youbot.jointstate Dynamics.jointstate youbot.odometry \
                     Arm_Kinematics.odometry youbot.odometry Dynamics.odometry youbot.odometry Base_Ctrl.odometry \
                     Arm_Kinematics.tool_pose Cart_Impedance.tool_pose Arm_Kinematics.tool_twist \
                     Cart_Impedance.tool_twist Arm_Kinematics.tool_pose Link_Tx.tool_pose Arm_Kinematics.tool_twist \
                     Link_Tx.tool_twist Arm_Kinematics.tool_pose Operator.tool_pose Arm_Kinematics.jacobian \
                     Dynamics.jacobian Link_Rx.ext_ref Cart_Impedance.ext_ref Link_Rx.link_stats \
                     Link_Monitor.link_stats Cart_Impedance.f_des Dynamics.f_des Cart_Impedance.f_raw_norm \
                     Force_Monitor.f_raw_norm Dynamics.joint_effort_command youbot.joint_effort_command \
                     Dynamics.base_twist Base_Ctrl.base_twist Base_Ctrl.cmd_twist youbot.cmd_twist Operator.ext_force \
                     youbot.ext_force Link_Tx.tx Link_Rx.rx left/Relay.y left/Relay.u"
            .split_whitespace()
            .collect::<Vec<_>>()
            .chunks(2)
        {
            let policy = if pair[0].ends_with("tx") { Policy::Buffer(64) } else { Policy::Data };
            system.connections.insert((MemberRef::new(pair[0]).unwrap(), MemberRef::new(pair[1]).unwrap()), policy);
        }
        system.ports.insert(MemberRef::new("Cart_Impedance.ext_ref_mode").unwrap(), Value::Bool(true));
        (system, catalogue)
    }

    #[test]
    fn every_component_port_and_connection_is_drawn() {
        let (system, catalogue) = youbot();
        let diagram = components("youbot", &system, &catalogue, &[], ComponentsView::default());
        assert_eq!(diagram.edges.len(), system.connections.len());
        assert!(diagram.edges.iter().all(|e| e.from_port.is_some() && e.to_port.is_some()));
        let svg = diagram.svg();
        if let Ok(path) = std::env::var("DRAW_COMPONENTS") {
            std::fs::write(path, &svg).unwrap();
        }
        for name in system.components.keys() {
            assert!(svg.contains(name.as_str().rsplit('/').next().unwrap()));
        }
        assert!(svg.contains("ext_ref_mode = true"));
        assert!(diagram.mermaid().contains("buffer(64)"));
        assert!(diagram.dot().contains("subgraph"));
    }

    #[test]
    fn monitors_have_lines_from_what_they_watch_and_rows_for_their_events() {
        let (mut system, mut catalogue) = youbot();
        let name = |text: &str| Ident::new(text).unwrap();
        let port = |text: &str| MemberRef::new(text).unwrap();
        let silent = |text: &str| {
            Condition::new(ConditionKind::Silent { port: port(text), time: std::time::Duration::from_millis(100) })
        };
        let monitor = |own: &str, when: Condition, raise: Option<&str>| Monitor {
            raise: raise.map(|event| EventName::new(event).unwrap()),
            ..Monitor::new(name(own), when)
        };
        let faulted = Condition::new(ConditionKind::Faulted(ComponentName::new("Base_Ctrl").unwrap()));
        let monitors = [
            monitor("lost", silent("Link_Rx.link_stats"), Some("e_lost")),
            monitor("both", Condition::new(ConditionKind::Any(vec![silent("Link_Rx.link_stats"), faulted])), None),
            monitor("inward", silent("Dynamics.f_des"), None),
        ];
        assert_eq!(
            components("none", &system, &catalogue, &monitors, ComponentsView::default()).edges.len(),
            system.connections.len()
        );
        catalogue.insert(ComponentType::new(MONITORS_TYPE, ""));
        let properties = BTreeMap::from([(name("both"), Value::Bool(false)), (name("lost"), Value::Bool(true))]);
        let component = ComponentSnapshot {
            ty: TypeName::new(MONITORS_TYPE).unwrap(),
            state: RunState::Running,
            properties,
            activity: None,
        };
        system.components.insert(ComponentName::new("Monitors").unwrap(), component);
        let diagram = components("youbot", &system, &catalogue, &monitors, ComponentsView::default());
        let at = diagram.nodes.iter().position(|node| node.title == "Monitors").unwrap();
        assert_eq!(diagram.nodes[at].ins, ["Dynamics.f_des", "Link_Rx.link_stats", "Base_Ctrl"]);
        assert_eq!(diagram.nodes[at].outs, ["lost → e_lost", "both (off)", "inward"]);
        let lines: Vec<&DiagramEdge> = diagram.edges.iter().filter(|edge| edge.to == at).collect();
        assert!(lines.len() == 3 && lines.iter().all(|edge| edge.dashed), "{lines:?}");
        let from = |row: usize| {
            let edge = lines.iter().find(|edge| edge.to_port == Some(row)).unwrap();
            (diagram.nodes[edge.from].title.as_str(), edge.from_port.map(|p| diagram.nodes[edge.from].outs[p].as_str()))
        };
        assert_eq!(from(0), ("Dynamics", None), "an in-port has no row on the side where lines leave");
        assert_eq!(from(1), ("Link_Rx", Some("link_stats")));
        assert_eq!(from(2), ("Base_Ctrl", None));
        for text in [diagram.svg(), diagram.dot(), diagram.mermaid()] {
            assert!(text.contains("e_lost") && text.contains("(off)") && text.contains("Link_Rx.link_stats"), "{text}");
        }
        assert!(diagram.svg().contains("stroke-dasharray") && diagram.mermaid().contains("-.->"));
    }
}
