//! What of a running deployment is whose: its subsystems as they stand, and the frames that reach into them.

use super::log::FrameStatus;
use crate::configurator::FrameView;
use crate::model::{ConfigId, Deployment, Ident};
use crate::stack::claims;
use std::collections::BTreeSet;

impl FrameStatus {
    /// As it is shown.
    pub(super) fn of(frame: &FrameView, deployment: &Deployment) -> Self {
        let subsystem = deployment.path_of(frame.configuration.as_str());
        Self {
            configuration: frame.configuration.to_string(),
            by: frame.by.to_string(),
            at: frame.at.as_secs_f64(),
            parts: frame.parts,
            floor: frame.floor,
            partial: frame.partial,
            lost: frame.lost,
            unseen: frame.unseen,
            touches: touches(deployment, frame.configuration, subsystem),
            subsystem: subsystem.map(|path| path.to_string()),
        }
    }
}

/// The subsystems, but the one whose configuration it is, that have a component which a configuration names.
fn touches(deployment: &Deployment, id: ConfigId, of: Option<Ident>) -> Vec<String> {
    let Some(configuration) = deployment.configuration(id).filter(|_| !deployment.subsystems.is_empty()) else {
        return Vec::new();
    };
    let prefixes: BTreeSet<&str> = claims::components(configuration).into_iter().map(|name| name.prefix()).collect();
    let elsewhere = prefixes.into_iter().filter(|path| of.is_none_or(|of| of.as_str() != *path));
    elsewhere.filter(|path| deployment.subsystem(path).is_some()).map(str::to_owned).collect()
}
