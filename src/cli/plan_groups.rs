//! What is planned, as a subsystem is looked into or folded: who asks, in whose file, by which names.

use super::inside::Region;
use super::inside_view::list_mut;
use super::plan_view::PlanView;
use super::status::text;
use crate::app::Application;
use crate::model::names::folded_into;
use crate::model::{Ask, Deployment};
use serde_json::{Value as Json, json};

/// An application with its place in the hierarchy.
pub struct PlacedPlan<'a> {
    /// What is planned.
    pub plan: &'a Application,
    /// The path of the subsystem in whose file it stands, as it is called in the region; empty: what is looked into itself.
    pub path: String,
    /// The coordinator that asks, where its file has several or nobody knows it by the file.
    pub by: Option<String>,
    /// It is of somebody outside of the region, and touches something of it.
    pub outside: bool,
}

/// Those that belong to the region, or touch something of it; all where there is none.
pub fn placed<'a>(deployment: &Deployment, plans: &'a [Application], region: Option<&Region>) -> Vec<PlacedPlan<'a>> {
    plans.iter().filter_map(|plan| place(deployment, plan, region)).collect()
}

fn place<'a>(deployment: &Deployment, plan: &'a Application, region: Option<&Region>) -> Option<PlacedPlan<'a>> {
    let coordinator = plan.coordinator.as_deref();
    let own = deployment.coordinators.iter().find(|own| coordinator == Some(own.name.as_str()));
    let id = plan.asks.iter().find_map(|ask| match ask {
        Ask::Apply(id) | Ask::UndoOf(id) => deployment.path_of(id.as_str()),
        _ => None,
    });
    let path = match own {
        Some(own) => own.of,
        None => id,
    };
    let path = path.map_or("", |path| path.as_str());
    let alone = own.is_some_and(|own| deployment.coordinators.iter().filter(|other| other.of == own.of).count() == 1);
    // With headings of subsystems, a file's only coordinator needs no name.
    let by = coordinator.filter(|_| !alone || deployment.subsystems.is_empty());
    let Some(region) = region else {
        return Some(PlacedPlan { plan, path: path.to_owned(), by: by.map(str::to_owned), outside: false });
    };
    let outside = !region.has(path);
    let touches = || plan.steps.iter().any(|step| region.is_in_step(&step.step.to_string()));
    if outside && !touches() {
        return None;
    }
    let by = if outside { coordinator } else { by };
    let path = if path == region.path() || outside { String::new() } else { region.name(path) };
    Some(PlacedPlan { plan, path, by: by.map(|by| region.name(by)), outside })
}

/// Those that stand together: with the path of what they are folded into, or, unfolded, of the file that they stand in.
pub fn grouped<'p, 'a>(all: &'p [PlacedPlan<'a>], depth: Option<usize>) -> Vec<PlanGroup<'p, 'a>> {
    let depth = depth.unwrap_or(usize::MAX);
    let mut groups: Vec<PlanGroup<'p, 'a>> = Vec::new();
    for one in all {
        let folded = folded_into(&one.path, depth);
        let path = folded.unwrap_or(&one.path);
        match groups.last_mut().filter(|group| group.path == path) {
            Some(group) => group.plans.push(one),
            None => groups.push(PlanGroup { path, folded: folded.is_some(), plans: vec![one] }),
        }
    }
    groups
}

/// Applications of one subsystem in a row.
pub struct PlanGroup<'p, 'a> {
    /// Its path; empty: of what is looked into itself.
    pub path: &'p str,
    /// They are shown as one line.
    pub folded: bool,
    /// The applications.
    pub plans: Vec<&'p PlacedPlan<'a>>,
}

impl PlacedPlan<'_> {
    /// What is asked for.
    pub fn asks(&self, region: Option<&Region>) -> String {
        let name = |ask: &Ask| region.map_or(ask.to_string(), |region| region.name(&ask.to_string()));
        self.plan.asks.iter().map(name).collect::<Vec<_>>().join(", ")
    }

    /// Its object of `plan --json`.
    pub fn json(&self, region: Option<&Region>) -> Json {
        let mut view = json!(PlanView::new(self.plan));
        if let Some(region) = region {
            view = of_view(region, &view);
        }
        if !self.path.is_empty() {
            view["subsystem"] = json!(self.path);
        }
        view
    }
}

/// An event as it is called in the region: what is no name of a subsystem's is called the same everywhere.
pub fn event_in(region: Option<&Region>, event: &str) -> String {
    match region {
        Some(region) if region.has(event) => region.name(event),
        _ => event.to_owned(),
    }
}

/// An object of `plan --json` with the names of a region.
fn of_view(region: &Region, view: &Json) -> Json {
    let mut there = region.with_names(view, &["configuration", "coordinator"]);
    for ask in list_mut(&mut there, "requests") {
        *ask = json!(region.name(text(ask)));
    }
    for event in list_mut(&mut there, "events") {
        *event = json!(event_in(Some(region), text(event)));
    }
    for step in list_mut(&mut there, "steps") {
        let mut own = of_step(region, step);
        own["undo"] = of_step(region, &step["undo"]);
        for inverse in list_mut(&mut own["undo"], "steps") {
            *inverse = of_step(region, inverse);
        }
        *step = own;
    }
    there["result"] = region.system(&view["result"]);
    there
}

fn of_step(region: &Region, step: &Json) -> Json {
    let scoped = step["type"].as_str().is_some_and(|ty| ty.contains('/'));
    let own = region.with_names(step, &["target", "from", "to", "activity"]);
    if scoped { region.with_names(&own, &["type"]) } else { own }
}
