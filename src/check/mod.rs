//! Is it sound: everything that can be said about a deployment before it runs. One file per family.
//!
//! Pure: no I/O, no clock, no platform. A [`Checked`] deployment can come only from here, and whoever starts something
//! takes nothing else, so nothing runs that was not looked at.

mod configurations;
mod coordinator;
mod types;
mod universe;

use crate::model::{Catalogue, Deployment, Findings, finding};
use serde::Serialize;
use std::ops::Deref;

/// Something in which `check` found nothing that refuses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Checked<T>(T);

impl<T> Checked<T> {
    /// The thing itself, no longer known to be checked.
    pub fn into_inner(self) -> T {
        self.0
    }
}

impl<T> Deref for Checked<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

/// How far the coordinator was followed through events and answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Explored {
    /// States of coordinator, system, stack and waiting requests together.
    pub states: usize,
    /// Events and answers followed from them.
    pub transitions: usize,
    /// Whether that was all there is.
    pub complete: bool,
}

/// What `check` has to say.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The deployment, if nothing refuses it.
    pub checked: Option<Checked<Deployment>>,
    /// Everything found, errors first.
    pub findings: Findings,
    /// How far the coordinator was followed.
    pub explored: Explored,
    /// The shortest way to the first finding that has one: events and answers, one a line; else empty.
    pub trace: Vec<String>,
}

/// Checks a deployment against the component types it may use (those of its libraries and those it declares).
pub fn run(deployment: &Deployment, catalogue: &Catalogue) -> Report {
    let universe = universe::Universe::new(deployment, catalogue);
    let mut findings = types::check(deployment, catalogue);
    findings.extend(configurations::check(deployment, catalogue, &universe));
    let (chart, problems) = crate::statechart::compile(&deployment.coordinator);
    findings.extend(problems);
    if let Some(chart) = &chart {
        findings.extend(coordinator::check(deployment, chart));
    }
    findings.sort_by_key(|f| std::cmp::Reverse(f.severity));
    let sound = chart.is_some() && !finding::has_errors(&findings);
    Report {
        checked: sound.then(|| Checked(deployment.clone())),
        findings,
        explored: Explored::default(),
        trace: Vec::new(),
    }
}
