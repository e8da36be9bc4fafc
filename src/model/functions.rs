//! Where the functions of a coordinator stand.

use super::finding::Origin;
use super::program::AuxiliaryFunction;
use super::statechart::{ChartNode, FunctionId, ROOT, State, Statechart};
use std::collections::BTreeMap;

/// A state or a transition with functions.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionPlace {
    /// What it is, as findings name it: `` `root.a` ``, `` `a` → `b` in `root` ``.
    pub what: String,
    /// The keys they stand under, each with the plugin that added it; none: the model.
    pub parts: Vec<(String, Option<String>)>,
    /// Where it stands.
    pub origin: Origin,
}

impl FunctionPlace {
    /// Whether it is a transition, and no state.
    pub fn is_transition(&self) -> bool {
        self.what.contains(" → ")
    }

    /// The keys of the model's own functions, each once.
    pub fn own(&self) -> Vec<&str> {
        let mut own: Vec<&str> = Vec::new();
        for (part, plugin) in &self.parts {
            if plugin.is_none() && !own.contains(&part.as_str()) {
                own.push(part);
            }
        }
        own
    }
}

/// All places of functions in a chart, in written order, with those of what is called beside it.
pub fn function_places(chart: &Statechart, beside: &[AuxiliaryFunction]) -> Vec<FunctionPlace> {
    let plugins: BTreeMap<FunctionId, &str> = chart.plugins.iter().map(|(id, plugin)| (*id, plugin.as_str())).collect();
    let mut places = Vec::new();
    collect(&chart.root, ROOT, &plugins, &mut places);
    for AuxiliaryFunction { place, part, plugin, origin } in beside {
        let part = (part.clone(), plugin.clone());
        match places.iter_mut().find(|p| p.what == *place) {
            Some(known) => known.parts.push(part),
            None => places.push(FunctionPlace { what: place.clone(), parts: vec![part], origin: *origin }),
        }
    }
    places
}

fn collect(state: &State, fqn: &str, plugins: &BTreeMap<FunctionId, &str>, places: &mut Vec<FunctionPlace>) {
    let parts = |functions: Vec<(&'static str, FunctionId)>| -> Vec<(String, Option<String>)> {
        let named = |(part, id): (&str, FunctionId)| (part.to_owned(), plugins.get(&id).map(|p| (*p).to_owned()));
        functions.into_iter().map(named).collect()
    };
    let own = parts(state.functions());
    if !own.is_empty() {
        places.push(FunctionPlace { what: format!("`{fqn}`"), parts: own, origin: state.origin });
    }
    for transition in &state.transitions {
        let parts = parts(transition.functions());
        if !parts.is_empty() {
            let end = |end: &Option<(String, Origin)>| end.as_ref().map_or("?".to_owned(), |(text, _)| text.clone());
            let what = format!("`{}` → `{}` in `{fqn}`", end(&transition.src), end(&transition.tgt));
            places.push(FunctionPlace { what, parts, origin: transition.origin });
        }
    }
    for child in &state.children {
        if let ChartNode::State(inner) = child {
            collect(inner, &format!("{fqn}.{}", inner.name), plugins, places);
        }
    }
}
