//! Models in memory.

use davit::functions::{Functions, Opener};
use davit::lang::{LoadOptions, LoadedCoordinator, Sources, load_coordinator};
use davit::model::Finding;
use davit::statechart::{Chart, Observation, Sim, compile};
use davit::time::Clock;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads `model.lua` of a set of files as a file given by hand.
pub fn read(files: &[(&str, &str)], host: &[&str]) -> LoadedCoordinator {
    let from = Sources::memory(files.iter().map(|(name, text)| (*name, text.as_bytes())));
    let host = host.iter().map(PathBuf::from).collect();
    let options = LoadOptions { trusted: true, host, ..LoadOptions::default() };
    load_coordinator(&from, Path::new("model.lua"), &options)
}

/// The one error of a model.
pub fn refused(text: &str) -> (Finding, LoadedCoordinator) {
    let loaded = read(&[("model.lua", text)], &[]);
    assert!(loaded.coordinator.is_none(), "it is accepted");
    assert_eq!(loaded.findings.len(), 1, "{:?}", loaded.findings);
    (loaded.findings[0].clone(), loaded)
}

/// The line that a finding is about.
pub fn line(loaded: &LoadedCoordinator, finding: &Finding) -> u32 {
    loaded.sources.locate(finding.origin).expect("a place").line
}

/// A model with its functions, ready to be stepped.
pub struct Model {
    chart: Chart,
    opener: Option<Opener>,
}

impl Model {
    pub fn new(text: &str) -> Self {
        Self::of(&[("model.lua", text)], &[])
    }

    pub fn of(files: &[(&str, &str)], host: &[&str]) -> Self {
        let loaded = read(files, host);
        let written = loaded.coordinator.unwrap_or_else(|| panic!("refused: {:?}", loaded.findings));
        let (chart, findings) = compile(&written);
        let chart = chart.unwrap_or_else(|| panic!("does not compile: {findings:?}"));
        Self { chart, opener: loaded.program.map(|program| Opener::new(program, Arc::new(written))) }
    }

    pub fn sim(&self) -> Sim<'_, Functions> {
        self.sim_on(None)
    }

    /// With functions that run by that clock.
    pub fn sim_on(&self, clock: Option<Clock>) -> Sim<'_, Functions> {
        let opener = self.opener.as_ref().expect("a model with functions");
        Sim::with(&self.chart, opener.open(clock).expect("it opens as it was read"))
    }

    pub fn is_pure(&self) -> bool {
        self.opener.is_none()
    }

    /// Steps it line by line; answers what was seen of each.
    pub fn play(&self, lines: &[&str]) -> Vec<Observation> {
        let mut sim = self.sim();
        lines.iter().map(|line| sim.line(line).expect("a line")).collect()
    }

    /// All that functions said, over all lines.
    pub fn notes(&self, lines: &[&str]) -> Vec<String> {
        self.play(lines).into_iter().flat_map(|seen| seen.notes).collect()
    }
}
