//! A look at everything that changes by itself: what `davit watch` shows.

use super::Session;
use super::log::StatusView;
use crate::model::monitor::is_monitors;
use crate::model::{ActivityStatus, ComponentName, Ident, MemberRef, RunState, Value};
use crate::monitor::{InputSample, MonitorInput};
use serde::Serialize;
use std::cell::RefCell;
use std::time::Duration;

/// What `davit watch --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LookView {
    /// As `davit status --json` has it.
    pub status: StatusView,
    /// The monitors of the components that evaluate them.
    pub monitors: Vec<Monitored>,
    /// What the activities that have components did so far.
    pub activities: Vec<ActivityStatus>,
}

/// A monitor at one moment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Monitored {
    /// Its name.
    pub name: Ident,
    /// The component that evaluates it.
    pub component: ComponentName,
    /// Whether it is enabled.
    pub enabled: bool,
    /// Whether its condition is true; none: it is not enabled, or nothing was heard of it.
    pub verdict: Option<bool>,
    /// How far the condition is from changing, positive while it is true; none: also where it has no distance.
    pub robustness: Option<f64>,
}

impl Session {
    /// How everything stands, with what monitors have to say within that (real) time.
    pub fn look(&self, within: Duration) -> LookView {
        let status = self.status();
        let components = status.system.iter().flat_map(|system| &system.components);
        let evaluating = components.filter(|(_, it)| is_monitors(it.ty));
        let mut monitors: Vec<Monitored> = Vec::new();
        let mut inputs: Vec<MonitorInput> = Vec::new();
        // Of which monitor, and whether it says how far it is.
        let mut of: Vec<(usize, bool)> = Vec::new();
        for (component, it) in evaluating {
            for monitor in self.deployment().monitors.iter().filter(|monitor| monitor.run_by() == it.ty) {
                let name = monitor.own_name();
                let enabled = it.properties.get(&name) == Some(&Value::Bool(true));
                if enabled && it.state == RunState::Running {
                    for (port, distance) in [(format!("is_{name}"), false), (format!("robustness_of_{name}"), true)] {
                        let Ok(port) = Ident::new(&port) else { continue };
                        inputs.push(MonitorInput::whole(MemberRef { component: *component, member: port }));
                        of.push((monitors.len(), distance));
                    }
                }
                let component = *component;
                monitors.push(Monitored { name, component, enabled, verdict: None, robustness: None });
            }
        }
        let samples = if inputs.is_empty() { None } else { self.samples(&inputs, within) };
        for ((monitor, distance), sample) in of.into_iter().zip(samples.unwrap_or_default()) {
            if sample.present && distance {
                monitors[monitor].robustness = Some(sample.value).filter(|margin| margin.is_finite());
            } else if sample.present {
                monitors[monitor].verdict = Some(sample.value != 0.0);
            }
        }
        LookView { status, monitors, activities: self.platform().activities() }
    }

    /// The next samples of all of these, as far as they come within that time. None: this platform does not show them.
    pub(super) fn samples(&self, inputs: &[MonitorInput], within: Duration) -> Option<Vec<InputSample>> {
        let watch = self.platform().watch(inputs, &self.clock().signal());
        let watch = RefCell::new(watch.filter(|watch| (0..inputs.len()).all(|input| watch.shows(input)))?);
        let samples = RefCell::new(vec![InputSample::default(); inputs.len()]);
        // What has come when time is up counts as well.
        let _ = self.hub().wait_outside(within, |hub| {
            let mut samples = samples.borrow_mut();
            watch.borrow_mut().look(hub.now(), &mut samples);
            samples.iter().all(|sample| sample.present).then_some(())
        });
        Some(samples.into_inner())
    }
}
