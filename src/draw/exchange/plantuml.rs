//! A coordinator as a PlantUML state diagram, as rFSM's `plantuml.encode` writes one: ids are full names with `_` for every
//! character that is no letter, digit or underscore; composites are blocks; connectors are choices; the initial connector is
//! `[*]`, and going to it is going to the state around it.

use crate::draw::text::raised;
use crate::model::Statechart;
use crate::model::outline::{Outline, OutlineTransition};
use crate::model::statechart::{INITIAL, State};
use std::fmt::Write as _;

/// The diagram. `active` are the active states (`root.sync.copying`), which are marked.
pub fn coordinator_plantuml(title: &str, chart: &Statechart, active: &[String]) -> String {
    let outline = Outline::of(chart);
    let mut out = String::from("@startuml\n");
    if !title.is_empty() {
        let _ = writeln!(out, "title {}", one_line(title));
    }
    out.push_str("hide empty description\n");
    if !active.is_empty() {
        out.push_str("skinparam state {\n  BackgroundColor<<active>> #ffe9b8\n  BorderColor<<active>> #d97706\n}\n");
    }
    level(&mut out, &outline, 0, 0, active);
    out.push_str("@enduml\n");
    out
}

fn id(fqn: &str) -> String {
    fqn.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect()
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn level(out: &mut String, outline: &Outline<'_>, at: usize, depth: usize, active: &[String]) {
    let indent = "  ".repeat(depth);
    for child in outline.children(at) {
        let item = &outline.items[child];
        let name = id(&item.fqn);
        let Some(state) = item.state else {
            if item.name != INITIAL {
                let _ = writeln!(out, "{indent}state {name} <<choice>>");
            }
            continue;
        };
        let mark = if active.contains(&item.fqn) { " <<active>>" } else { "" };
        let _ = write!(out, "{indent}state \"{}\" as {name}{mark}", item.name);
        if outline.is_composite(child) {
            out.push_str(" {\n");
            level(out, outline, child, depth + 1, active);
            let _ = write!(out, "{indent}}}");
        }
        out.push('\n');
        for line in lines(state) {
            let _ = writeln!(out, "{indent}{name} : {line}");
        }
    }
    // A transition stands in the block of the state around both its ends, so that `[*]` means what it should.
    for link in outline.links.iter().filter(|link| block(outline, link) == at) {
        let end = |item: usize, leaving: bool| {
            let item = &outline.items[item];
            match item.parent {
                Some(_) if item.name == INITIAL && item.state.is_none() && leaving => "[*]".to_owned(),
                Some(0) if item.name == INITIAL && item.state.is_none() => "[*]".to_owned(),
                Some(around) if item.name == INITIAL && item.state.is_none() => id(&outline.items[around].fqn),
                _ => id(&item.fqn),
            }
        };
        let label = label(link);
        let colon = if label.is_empty() { "" } else { " : " };
        let _ = writeln!(out, "{indent}{} --> {}{colon}{label}", end(link.src, true), end(link.tgt, false));
    }
}

/// The state in whose block a transition is written: the source's parent.
fn block(outline: &Outline<'_>, link: &OutlineTransition<'_>) -> usize {
    outline.items[link.src].parent.unwrap_or(0)
}

fn lines(state: &State) -> Vec<String> {
    let mut lines = Vec::new();
    for (word, actions) in [("entry", &state.entry), ("exit", &state.exit)] {
        if !actions.is_empty() {
            lines.push(format!("{word} / {}", raised(actions).join(", ")));
        }
    }
    if !state.config.is_empty() {
        let ids: Vec<&str> = state.config.iter().map(|(id, _)| id.as_str()).collect();
        lines.push(format!("config {}", ids.join(", ")));
    }
    if state.doo.is_some() {
        lines.push("do / function".to_owned());
    }
    lines
}

/// Events without what follows `@`, a priority, and what is raised.
fn label(link: &OutlineTransition<'_>) -> String {
    let transition = link.transition;
    let events: Vec<String> = transition.events.iter().map(|(trigger, _)| trigger.to_string()).collect();
    let events: Vec<&str> = events.iter().map(|e| e.split('@').next().unwrap_or(e)).collect();
    let mut label = events.join(", ");
    if transition.guard.is_some() {
        label.push_str(" [guard]");
    }
    if transition.pn != 0.0 {
        let _ = write!(label, " ({})", transition.pn);
    }
    if !transition.effect.is_empty() {
        let _ = write!(label, " / {}", raised(&transition.effect).join(", "));
    }
    label.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;
    use super::*;

    #[test]
    fn blocks_choices_initials_and_what_is_active() {
        let text =
            coordinator_plantuml("a  title", &sample(), &["root".into(), "root.on".into(), "root.on.low".into()]);
        for line in [
            "@startuml\n",
            "title a title\n",
            "state \"idle\" as root_idle\n",
            "state \"on\" as root_on <<active>> {\n",
            "  state \"low\" as root_on_low <<active>>\n",
            "root_on_low : entry / e_low\n",
            "state root_fork <<choice>>\n",
            "  [*] --> root_on_low\n",
            "[*] --> root_idle\n",
            "root_idle --> root_fork : e_go (2) / e_gone\n",
            "root_fork --> root_on\n",
            "  root_on_low --> root_on_high : e_done, e_after(1)\n",
            "root_on --> [*] : e_again\n",
            "root_on : config power\n",
            "@enduml\n",
        ] {
            assert!(text.contains(line), "{line:?} is missing:\n{text}");
        }
    }
}
