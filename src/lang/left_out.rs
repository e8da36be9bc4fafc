//! What the functions of a coordinator mean for writing it in another language.

use crate::model::finding::count;
use crate::model::functions::{FunctionPlace, function_places};
use crate::model::program::Program;
use crate::model::{Finding, Findings, Statechart, codes};

/// Places shown; the rest is counted.
const SHOWN: usize = 12;

/// The keys at a place, with the plugins they are of.
fn parts(place: &FunctionPlace) -> String {
    let mut parts: Vec<String> = Vec::new();
    for (part, plugin) in &place.parts {
        let text =
            plugin.as_ref().map_or_else(|| format!("`{part}`"), |plugin| format!("`{part}` of the plugin `{plugin}`"));
        if !parts.contains(&text) {
            parts.push(text);
        }
    }
    parts.join(", ")
}

/// Why a coordinator with functions is not written in a language that has no word for them. None: it has no functions.
pub fn refused(chart: &Statechart, program: &Program) -> Option<Finding> {
    let places = function_places(chart, &program.beside);
    let first = places.first()?;
    let message =
        format!("a coordinator with functions cannot be converted: it has some in {}", count(places.len(), "place"));
    let mut finding = Finding::error(codes::CONVERT_FUNCTIONS, message).at(first.origin);
    for place in places.iter().take(SHOWN) {
        finding = finding.also(place.origin, format!("{}: {}", place.what, parts(place)));
    }
    let more = places.len().saturating_sub(SHOWN);
    let rest = if more > 0 { format!(" ({} not shown)", count(more, "more place")) } else { String::new() };
    Some(
        finding.help(format!(
            "names of events in place of functions make it pure; `--to scxml` writes it without them{rest}"
        )),
    )
}

/// One warning for each state and transition whose functions are left out in SCXML.
pub fn warnings(chart: &Statechart, program: Option<&Program>) -> Findings {
    let beside = program.map_or(&[][..], |program| &program.beside);
    let warning = |place: FunctionPlace| {
        let message = format!("{}: {} left out, SCXML has no word for functions of Lua", place.what, parts(&place));
        let keys: Vec<&str> = place.parts.iter().map(|(part, _)| part.as_str()).collect();
        let help = if keys.contains(&"guard") || keys.contains(&"events") {
            "its condition is the call of a function of the document: define that in a `<script>`; until then it is never taken"
        } else if keys.contains(&"doo") {
            "a comment stands in its place; the state does not complete by itself"
        } else {
            "a comment stands in its place"
        };
        Finding::warning(codes::CONVERT_LEFT_OUT, message).at(place.origin).help(help)
    };
    function_places(chart, beside).into_iter().map(warning).collect()
}
