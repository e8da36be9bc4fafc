//! Configurations that operators make up while the deployment runs: one change each (`davit set`).

use super::engine::Given;
use super::switches::Fast;
use crate::model::{ConfigId, Configuration};
use rustc_hash::FxHashMap;
use std::sync::Arc;

impl Given {
    /// Takes one in, in the place of the one of that name. Whoever is under way with others keeps what he has.
    pub(super) fn define(
        &mut self,
        configuration: Configuration,
        listed: bool,
        switches: &mut FxHashMap<ConfigId, Vec<Fast>>,
    ) {
        let id = configuration.id;
        // What was planned for it wrote another value.
        switches.remove(&id);
        if listed {
            self.operator.insert(id);
        }
        self.claims.add(&configuration);
        Arc::make_mut(&mut self.configurations).insert(id, configuration);
    }
}
