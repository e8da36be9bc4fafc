//! The status of a deployment taken apart: what is its own, and what is each subsystem's; and how a subsystem is folded into a line.

use super::inside::is_within;
use super::inside_view::innermost;
use super::output::{Output, Style, Table};
use super::status::{state_style, text};
use crate::model::finding::count;
use crate::model::names::level;
use serde_json::Value as Json;

/// What of a status belongs to one file.
#[derive(Debug, Default)]
pub struct FilePart<'a> {
    /// The subsystem's path; empty: the deployment's own.
    pub path: &'a str,
    /// How it stands, of a subsystem.
    pub standing: &'a str,
    /// Its coordinators with their active states.
    pub coordinators: Vec<(&'a str, &'a Json)>,
    /// Requests that are not answered.
    pub waiting: Vec<&'a str>,
    /// Its frames.
    pub frames: Vec<&'a Json>,
    /// Its components.
    pub components: Vec<(&'a str, &'a Json)>,
    /// What is left of what broke it.
    pub residual: Vec<&'a Json>,
    /// What is wrong with its components.
    pub faults: Vec<&'a Json>,
}

/// All of them, the deployment's own first, then parents before their children.
pub fn parts(status: &Json) -> Vec<FilePart<'_>> {
    let list = |key: &str| status[key].as_array().map(Vec::as_slice).unwrap_or_default();
    let subsystems = list("subsystems").iter();
    let mut parts = vec![FilePart::default()];
    parts.extend(subsystems.map(|one| FilePart {
        path: text(&one["name"]),
        standing: text(&one["standing"]),
        ..FilePart::default()
    }));
    let of = |name: &str| {
        let path = innermost(parts.iter().map(|part| part.path).filter(|path| !path.is_empty()), name);
        parts.iter().position(|part| part.path == path).unwrap_or_default()
    };
    let of_coordinator = |name: &str| {
        let is_its = |one: &Json| one["coordinators"].as_array().is_some_and(|all| all.iter().any(|own| own == name));
        list("subsystems").iter().position(is_its).map_or(0, |at| at + 1)
    };
    let of_asked = |asked: &str| match asked.rsplit_once(" by ") {
        Some((ask, _)) if ask.contains('/') => of(ask),
        Some((_, by)) => of_coordinator(by),
        None => 0,
    };
    let coordinators: Vec<_> =
        entries(&status["coordinators"]).map(|(name, it)| (of_coordinator(name), name, it)).collect();
    let components: Vec<_> = entries(&status["system"]["components"]).map(|(name, it)| (of(name), name, it)).collect();
    let waiting: Vec<_> = list("outstanding").iter().map(text).map(|asked| (of_asked(asked), asked)).collect();
    let frames: Vec<_> = list("stack").iter().map(|frame| (of(text(&frame["configuration"])), frame)).collect();
    let residual: Vec<_> = list("residual").iter().map(|one| (of(text(&one["target"])), one)).collect();
    let faults: Vec<_> = list("faults").iter().map(|fault| (of(text(&fault["component"])), fault)).collect();
    coordinators.into_iter().for_each(|(at, name, it)| parts[at].coordinators.push((name, it)));
    components.into_iter().for_each(|(at, name, it)| parts[at].components.push((name, it)));
    waiting.into_iter().for_each(|(at, asked)| parts[at].waiting.push(asked));
    frames.into_iter().for_each(|(at, frame)| parts[at].frames.push(frame));
    residual.into_iter().for_each(|(at, one)| parts[at].residual.push(one));
    faults.into_iter().for_each(|(at, fault)| parts[at].faults.push(fault));
    parts
}

fn entries(table: &Json) -> impl Iterator<Item = (&str, &Json)> {
    table.as_object().into_iter().flatten().map(|(name, it)| (name.as_str(), it))
}

/// The innermost of active states.
pub fn leaf(states: &Json) -> &str {
    states.as_array().and_then(|all| all.last()).map_or("(inactive)", text)
}

/// Writes what is unfolded part by part, and behind each the subsystems in it that are folded, in lines.
pub fn each<'p, 'a>(
    parts: &'p [FilePart<'a>],
    depth: Option<usize>,
    page: &mut String,
    open: impl Fn(&'p FilePart<'a>) -> String,
    lines: impl Fn(&[&'p FilePart<'a>]) -> String,
) {
    let mut closed: Vec<&FilePart<'_>> = Vec::new();
    for part in parts {
        match level(part.path).saturating_sub(depth.unwrap_or(usize::MAX)) {
            0 => *page += &(lines(&std::mem::take(&mut closed)) + &open(part)),
            1 => closed.push(part),
            _ => {}
        }
    }
    *page += &lines(&closed);
}

/// Subsystems in a line each, with all that is in them.
pub fn folded(out: &Output, parts: &[FilePart<'_>], folded: &[&FilePart<'_>], known: bool) -> Table {
    let mut table = Table::new(0);
    for part in folded {
        let inside = || parts.iter().filter(|other| is_within(other.path, part.path));
        let number = |of: fn(&FilePart<'_>) -> usize| inside().map(of).sum::<usize>();
        let some = |number: usize, style, what: &str| match number {
            0 => String::new(),
            _ => out.paint(style, count(number, what)),
        };
        let waiting: Vec<&str> = inside().flat_map(|part| part.waiting.iter().copied()).collect();
        let marks = [
            some(number(|part| part.faults.len()), Style::Bad, "fault"),
            some(number(|part| part.residual.len()), Style::Bad, "difference"),
            some(number(|part| part.frames.iter().filter(|frame| frame["lost"] == true).count()), Style::Bad, "loss"),
            if waiting.is_empty() { String::new() } else { format!("waiting for {}", waiting.join(", ")) },
        ];
        let marks: Vec<String> = marks.into_iter().filter(|mark| !mark.is_empty()).collect();
        let (frames, components) = match known {
            true => (
                count(number(|part| part.frames.len()), "frame"),
                count(number(|part| part.components.len()), "component"),
            ),
            false => (String::new(), out.paint(Style::Bad, "not known")),
        };
        table.row([
            out.paint(Style::Bold, part.path),
            out.paint(state_style(part.standing), part.standing),
            out.paint(Style::Name, states(part)),
            frames,
            components,
            marks.join(", "),
        ]);
    }
    table
}

/// The innermost states of a file's coordinators; of several with their names.
pub fn states(part: &FilePart<'_>) -> String {
    let several = part.coordinators.len() > 1;
    let state = |(name, it): &(&str, &Json)| if several { format!("{name}:{}", leaf(it)) } else { leaf(it).to_owned() };
    part.coordinators.iter().map(state).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::output::Color;
    use serde_json::json;

    /// A deployment in whose deepest subsystem everything is wrong.
    fn status() -> Json {
        let frame = |configuration: &str, lost: bool| json!({ "configuration": configuration, "lost": lost });
        json!({
            "coordinators": { "cell": ["root", "root.on"], "duo": ["root"], "duo/arm": ["root.hurt"], "duo/hand": [] },
            "subsystems": [
                { "name": "duo", "standing": "up", "coordinators": ["duo"] },
                { "name": "duo/kin", "standing": "failed", "coordinators": ["duo/arm", "duo/hand"] },
            ],
            "outstanding": ["duo/kin/go by duo/arm", "undo by duo/hand", "join by cell"],
            "stack": [frame("duo/kin/make", true), frame("duo/join", false), frame("own", false)],
            "system": { "components": { "duo/kin/Drive": { "state": "faulted" }, "Net": { "state": "running" } } },
            "residual": [{ "target": "duo/kin/Drive.k", "text": "t" }],
            "faults": [{ "component": "duo/kin/Drive", "reason": "hot" }],
        })
    }

    #[test]
    fn what_is_of_each_file_is_found() {
        let status = status();
        let parts = parts(&status);
        let own: Vec<Json> = parts
            .iter()
            .map(|part| {
                json!([
                    part.path,
                    states(part),
                    part.waiting,
                    part.frames.len(),
                    part.components.len(),
                    part.faults.len()
                ])
            })
            .collect();
        let kin = "duo/arm:root.hurt, duo/hand:(inactive)";
        let waiting = ["duo/kin/go by duo/arm", "undo by duo/hand"];
        let expected = [
            json!(["", "root.on", ["join by cell"], 1, 1, 0]),
            json!(["duo", "root", [], 1, 0, 0]),
            json!(["duo/kin", kin, waiting, 1, 1, 1]),
        ];
        assert_eq!(own, expected);
    }

    #[test]
    fn a_line_says_whatever_is_wrong_in_it_however_deep() {
        let status = status();
        let parts = parts(&status);
        let mut page = String::new();
        let out = Output::new(Color::Never);
        let line = |lines: &[&FilePart<'_>]| folded(&out, &parts, lines, true).to_string();
        each(&parts, Some(0), &mut page, |part| format!("[{}]\n", part.path), line);
        let duo = "duo  up  root  2 frames  1 component  1 fault, 1 difference, 1 loss, waiting for duo/kin/go by duo/arm, undo by duo/hand\n";
        assert_eq!(page, format!("[]\n{duo}"));
        let mut page = String::new();
        let unknown = |lines: &[&FilePart<'_>]| folded(&out, &parts, lines, false).to_string();
        each(&parts, Some(1), &mut page, |part| format!("[{}]\n", part.path), unknown);
        assert!(page.starts_with("[]\n[duo]\nduo/kin  failed") && page.contains("not known"), "{page}");
    }
}
