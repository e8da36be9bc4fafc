//! What `check` has to say of a deployment, and the deployment as one that was checked.

use super::trace::TraceStep;
use super::verdict::CheckVerdict;
use crate::model::{Deployment, Finding, Findings};
use serde::Serialize;
use std::ops::Deref;
use std::sync::Arc;

/// Something in which `check` found nothing that refuses it.
#[derive(Debug, Clone, PartialEq)]
pub struct Accepted<T>(Arc<T>);

impl<T> Accepted<T> {
    /// What was looked at.
    pub(super) fn new(thing: Arc<T>) -> Self {
        Self(thing)
    }

    /// The thing itself, to be shared; no longer known to be checked.
    pub fn share(&self) -> Arc<T> {
        self.0.clone()
    }
}

impl<T> Deref for Accepted<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

/// How far the coordinators were followed through events and answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Explored {
    /// States of coordinators, system, stack and waiting requests together.
    pub states: usize,
    /// Events and answers followed from them.
    pub transitions: usize,
    /// Whether that was all there is.
    pub complete: bool,
    /// States that were met and not followed further, because the budget was used up.
    pub unfollowed: usize,
    /// Whether every way was followed to its end on which no request fails.
    pub without_failure: bool,
}

impl Explored {
    /// This and another one, as one.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            states: self.states + other.states,
            transitions: self.transitions + other.transitions,
            complete: self.complete && other.complete,
            unfollowed: self.unfollowed + other.unfollowed,
            without_failure: self.without_failure && other.without_failure,
        }
    }
}

/// What `check` has to say.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The deployment, if nothing refuses it.
    pub checked: Option<Accepted<Deployment>>,
    /// The deployment, if whatever refuses it was found by following its coordinators: fit to be replayed on the simulated
    /// platform, where the ways to that can be gone, and for nothing else.
    pub replayed: Option<Accepted<Deployment>>,
    /// Everything found, errors first.
    pub findings: Findings,
    /// Of each finding the shortest way to it from the start; empty: it needs none.
    pub traces: Vec<Vec<TraceStep>>,
    /// How far the coordinators were followed.
    pub explored: Explored,
    /// What was left out: one bound each.
    pub left: Vec<String>,
    /// What it comes to.
    pub verdict: CheckVerdict,
}

impl Report {
    /// Leaves these findings out, with the ways to them.
    pub(super) fn drop_findings(&mut self, of: impl Fn(&Finding) -> bool) {
        let all = std::mem::take(&mut self.findings).into_iter().zip(std::mem::take(&mut self.traces));
        (self.findings, self.traces) = all.filter(|(finding, _)| !of(finding)).unzip();
    }
}
