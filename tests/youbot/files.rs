//! The deployment files: the paper's configurations as they stand, and the series that brings the robot up and down.

use davit::lang::{LoadOptions, load};
use davit::libraries::{builtin, monitors};
use davit::model::{Catalogue, ConfigId, Deployment, EventName};
use davit::plan::{PlanContext, irreversible, plan};
use davit::system::System;
use davit::system::step::apply;
use std::path::Path;
use std::sync::Arc;

const PAPER: &str = r#"ConfiguratorConf {
   disable_copying = Configuration{
       port_write("Cart_Impedance.ext_ref_mode", false)
   },
   
   enable_copying = Configuration {
       port_write("Cart_Impedance.ext_ref_mode", true)
   },

   eight_DOF = Configuration {
      property_set("Dynamics.force_gain", {0.1, 0.1, 0.1})
   },

   five_DOF = Configuration {
      property_set("Dynamics.force_gain", {0, 0, 0})
   },
}
"#;

const UP: &[&str] = &[
    "create_core",
    "create_link",
    "create_monitors",
    "connect_all",
    "load_properties",
    "start_driver",
    "calibrate",
    "unfold",
    "start_control",
    "take_over",
];
const DOWN: &[&str] =
    &["base_stop", "hold", "park", "stop_control", "stop_all", "cleanup_all", "disconnect_all", "destroy_all"];
const DEPLOYMENTS: &[&str] = &["youbot_arm", "youbot_arm_scoped", "generic_arm"];

pub fn deployment(name: &str) -> (Deployment, Arc<Catalogue>) {
    let path = format!("deployments/{name}.yaml");
    let loaded = load(Path::new(&path), &LoadOptions::default());
    let deployment = loaded.deployment.unwrap_or_else(|| panic!("{path}: {:?}", loaded.findings));
    let libraries = builtin().select(&deployment.libraries).expect("built in");
    let mut catalogue = monitors::added_to(libraries, &deployment.monitors).catalogue();
    for ty in &deployment.types {
        catalogue.insert(ty.clone());
    }
    (deployment, Arc::new(catalogue))
}

fn go(system: &mut System, deployment: &Deployment, ids: &[&str]) {
    let context = PlanContext { activities: deployment.activities.keys().copied().collect(), ..Default::default() };
    for id in ids {
        let configuration = deployment.configuration(ConfigId::new(id).unwrap()).unwrap_or_else(|| panic!("no {id}"));
        let plan = plan(system, configuration, &context).unwrap_or_else(|r| panic!("{id}: {:?}", r.findings));
        assert_eq!(irreversible(&plan.steps), None, "{id}");
        for step in &plan.steps {
            apply(&step.step, system).unwrap_or_else(|v| panic!("{id}: {}: {v:?}", step.step));
        }
    }
}

#[test]
fn listing_2_stands_as_in_the_paper() {
    let file = std::fs::read_to_string("configs/youbot/coupling.lua").unwrap();
    let text: String = file.lines().filter(|l| !l.starts_with("--")).map(|l| format!("{l}\n")).collect();
    assert_eq!(text, PAPER);
}

#[test]
fn every_series_goes_up_and_comes_down_to_nothing() {
    for name in DEPLOYMENTS {
        let (deployment, catalogue) = deployment(name);
        let mut system = System::new(catalogue);
        go(&mut system, &deployment, UP);
        let up = system.snapshot();
        assert!(up.components.values().all(|c| c.state == davit::model::RunState::Running), "{name}");
        // What happens while it is up, also twice, takes nothing from the way down.
        let switches: &[&str] =
            &["five_DOF", "enable_copying", "eight_DOF", "safe_hold", "disable_copying", "restart_controller"];
        go(&mut system, &deployment, switches);
        go(&mut system, &deployment, switches);
        go(&mut system, &deployment, DOWN);
        assert!(system.is_empty(), "{name}: {:?}", system.snapshot());
    }
}

/// `davit check` has nothing to warn of, and follows each coordinator as far as its bounds of waiting requests say: a
/// coordinator that hears `e_5dof` and `e_8dof` while it waits may have asked for any number of switches.
#[test]
fn every_deployment_is_followed_within_the_bounds() {
    for name in DEPLOYMENTS {
        let (deployment, catalogue) = deployment(name);
        let report = davit::check::run(deployment, &catalogue);
        let told: Vec<_> = report.findings.iter().filter(|f| f.severity > davit::model::Severity::Info).collect();
        assert!(told.is_empty(), "{name}: {told:#?}");
        assert!(report.explored.unfollowed == 0, "{name}: {:?}", report.explored);
        let bounds = [
            "behind an undo that failed",
            "batches of one coordinator",
            "an operator's safe configuration",
            "2 frames of one configuration",
            "each round leaves a frame more",
            "where frames have been squashed",
            "which frames are squashed",
        ];
        let named = |line: &String| bounds.iter().any(|bound| line.contains(bound));
        assert!(report.left.iter().all(named), "{name}: {:?}", report.left);
        assert!(report.explored.states > 300, "{name}: {:?}", report.explored);
    }
}

/// Each of the deployments' safety events is heard in every state, but for those below.
#[test]
fn every_state_hears_every_stop() {
    // Nothing is there yet, or any more; safe_hold or brake_again is being asked for, and a stop was the last word; drives that
    // are off, while what is left is disconnected or destroyed.
    let deaf = [
        "root.idle",
        ".braking.staying",
        ".losing.staying",
        ".again",
        ".ending.stopped",
        "unwiring.braked.braking",
        "unwiring.braked.waiting",
        "destroying.braked.braking",
        "destroying.braked.waiting",
    ];
    for name in DEPLOYMENTS {
        let (deployment, _) = deployment(name);
        assert!(!deployment.safety.is_empty());
        let stops = deployment.safety.iter().map(|(event, _)| event.as_str());
        let unheard = unheard(&deployment, stops, &deaf);
        assert!(unheard.is_empty(), "{name}: {unheard:?}");
    }
}

/// What has died is heard wherever the drives may take torques, which is everywhere but in the states below.
#[test]
fn every_state_with_torques_hears_every_loss() {
    let losses = ["e_cmd_watchdog", "e_base_cmd_watchdog", "e_control_lost", "e_watch_lost"];
    let deaf = [
        // They are off, or hold by themselves.
        "root.idle",
        "deploying.creating_core",
        "deploying.creating_link",
        "deploying.creating_monitors",
        "deploying.wiring",
        "deploying.configuring",
        "deploying.powering",
        "deploying.calibrating",
        "deploying.unfolding",
        "deploying.starting",
        "cancelling.stopping",
        "cancelling.folding",
        "cancelling.uncalibrating",
        "cancelling.powering_down",
        "cancelling.unconfiguring",
        "cancelling.unwiring",
        "cancelling.letting_go",
        "cancelling.removing_monitors",
        "cancelling.removing_link",
        "cancelling.removing_core",
        "shutting_down.parking",
        "shutting_down.stopping",
        "shutting_down.powering_off",
        "shutting_down.cleaning",
        "shutting_down.unwiring.",
        "shutting_down.letting_go",
        "shutting_down.destroying.",
        "root.resting.",
        "stranded.parked",
        "stranded.stopped",
        "stranded.cleaned",
        "stranded.unwired",
        // They are told to brake, or brake.
        ".braking.staying",
        ".braking.leaving",
        ".losing.on",
        ".losing.staying",
        ".losing.leaving",
        ".waiting",
        ".again",
        ".ending.on",
        ".ending.stopped",
        "fault.clearing",
        "fault.repairing",
        // What is asked for now, or as soon as they are released, is that they hold or brake.
        "cancelling.handing_back",
        "quieting.released",
        "shutting_down.holding",
        ".releasing.leaving",
        ".releasing.stopped",
        ".releasing.stopped_leaving",
        // Where they are released to, it is heard when it is told again; what is told once has them hold.
        "halted.releasing.on",
        "lowering.releasing.on",
    ];
    for name in DEPLOYMENTS {
        let (deployment, _) = deployment(name);
        let unheard = unheard(&deployment, losses, &deaf);
        assert!(unheard.is_empty(), "{name}: {unheard:?}");
    }
}

/// The leaf states that do not hear one of these events, but for those whose names end so, or contain a part between dots.
fn unheard<'e>(
    deployment: &Deployment,
    events: impl IntoIterator<Item = &'e str>,
    deaf: &[&str],
) -> Vec<(String, &'e str)> {
    let (chart, findings) = davit::statechart::compile(&deployment.first_coordinator().chart);
    let chart = chart.unwrap_or_else(|| panic!("{findings:?}"));
    let parents: Vec<_> = chart.nodes().filter_map(|node| chart.parent(node)).collect();
    let leaves = || chart.nodes().filter(|node| chart.is_state(*node) && !parents.contains(node));
    assert!(leaves().count() > 60);
    let hears = |leaf, event| {
        std::iter::successors(Some(leaf), |node| chart.parent(*node))
            .any(|node| chart.outgoing(node).any(|edge| chart.may_trigger(edge, chart.event(event))))
    };
    let mut unheard = Vec::new();
    for event in events {
        let name = EventName::new(event).unwrap();
        let missed = leaves().filter(|leaf| !hears(*leaf, name)).map(|leaf| (chart.fqn(leaf).to_string(), event));
        unheard.extend(missed);
    }
    unheard.retain(|(place, _)| {
        !deaf.iter().any(|end| place.ends_with(end) || (end.ends_with('.') && place.contains(end)))
    });
    unheard
}
