//! What an operator's configuration brings about beside what was asked for: whoever stands there is told at once.

use super::Session;
use crate::configurator::FrameView;
use crate::model::ConfigId;
use crate::stack::Requester;

/// What was in force before a configuration was asked for.
pub(super) struct Before(Vec<FrameView>);

impl Session {
    /// What is in force, before one of that name is asked for; nothing where that says nothing of it. What is safe waits for no look.
    pub(super) fn before(&self, id: ConfigId) -> Before {
        let grouped = self.deployment().configuration(id).is_some_and(|c| c.group.is_some() && !c.safe);
        Before(if grouped { self.frames().unwrap_or_default() } else { Vec::new() })
    }

    /// What comes of a configuration that was applied: it goes by itself unless it is confirmed, or has taken the place of one that a
    /// coordinator had in force, which an undo does not bring back.
    pub(super) fn consequences(&self, id: ConfigId, before: &Before) -> Vec<String> {
        let deployment = self.deployment();
        let Some(configuration) = deployment.configuration(id) else { return Vec::new() };
        let confirm = configuration.confirm.map(|confirm| {
            let (event, within) = (confirm.event, confirm.within.as_secs_f64());
            format!("`{id}` is taken back after {within} s unless `{event}` confirms it: `davit event {event}`")
        });
        let of_group = |frame: &&FrameView| {
            configuration.group.is_some()
                && deployment.configuration(frame.configuration).map(|c| c.group) == Some(configuration.group)
        };
        // Where that is not known nothing is said of it.
        let Ok(now) = self.frames() else { return confirm.into_iter().collect() };
        let gone = |frame: &&FrameView| {
            !now.iter().any(|other| (other.configuration, other.at) == (frame.configuration, frame.at))
        };
        let replaced = before.0.iter().filter(of_group).filter(gone).filter_map(|frame| match frame.by {
            Requester::Coordinator(name) => {
                let was = frame.configuration;
                let force = if deployment.operator_applies().any(|listed| listed == was) { "" } else { " --force" };
                Some(format!("it is in the place of `{was}` of `{name}`, which an undo does not bring back: `davit apply {was}{force}` does"))
            }
            _ => None,
        });
        confirm.into_iter().chain(replaced).collect()
    }
}
