//! A running deployment as `davit status` shows it: what is its own, then each subsystem under its path.

use super::drift::listed;
use super::levels::{FilePart, each, folded, leaf, parts};
use super::output::{Output, Style, Table};
use super::status::{not_known, state_style, text};
use crate::model::finding::count;
use crate::session::{StandsStill, StoppingView};
use serde_json::{Value as Json, json};

/// Prints it; what is deeper than `depth` in a line each.
pub fn print(out: &Output, status: &Json, depth: Option<usize>) {
    let known = status["stack"].is_array();
    let parts = parts(status);
    let mut page = title(out, status) + "\n";
    let open = |part: &FilePart<'_>| match part.path.is_empty() {
        true => own(out, status, part, known),
        false => format!("{}\n{}", heading(out, part), indented(&own(out, status, part, known))),
    };
    each(&parts, depth, &mut page, open, |lines| folded(out, &parts, lines, known).to_string());
    out.text(page);
}

/// Which it is, and how it stands; in which deployment, of a subsystem.
pub fn title(out: &Output, status: &Json) -> String {
    let word = text(if status["in"].is_null() { &status["phase"] } else { &status["standing"] });
    let name = match status["in"].as_str() {
        Some(path) => format!("{}/{path}", text(&status["name"])),
        None => text(&status["name"]).to_owned(),
    };
    let at = status["at"].as_f64().unwrap_or_default();
    format!("{}  {}  {at:.3} s", out.paint(Style::Bold, name), out.paint(state_style(word), word))
}

/// What stands above what is a subsystem's.
pub fn heading(out: &Output, part: &FilePart<'_>) -> String {
    format!("{}  {}", out.paint(Style::Bold, part.path), out.paint(state_style(part.standing), part.standing))
}

/// Below a heading.
pub fn indented(text: &str) -> String {
    text.lines().fold(String::new(), |all, line| all + "  " + line + "\n")
}

/// That a coordinator stands still in a function, and for how long.
fn in_function(out: &Output, seconds: Option<&Json>) -> String {
    let Some(seconds) = seconds.and_then(Json::as_f64) else { return String::new() };
    format!(", {}", out.paint(Style::Care, format!("in a function for {seconds:.0} s")))
}

/// What is of one file.
fn own(out: &Output, status: &Json, part: &FilePart<'_>, known: bool) -> String {
    let mut said = String::new();
    let top = part.path.is_empty();
    let mut line = |line: String| {
        said += &line;
        said.push('\n');
    };
    let several = part.coordinators.len() > 1;
    for (name, states) in &part.coordinators {
        let slow = in_function(out, status["slow"].get(name));
        let name = if several { format!("{name}: ") } else { String::new() };
        line(format!("coordinator  {name}{}{slow}", out.paint(Style::Name, leaf(states))));
    }
    if let Ok(stopping) = serde_json::from_value::<StoppingView>(status["stopping"].clone())
        && top
    {
        let still = stopping.stands_still().map(|still| format!(": stands still, {still}")).unwrap_or_default();
        line(format!("stopping     {}{still}", stopping.stage.words()));
    }
    if let Ok(still) = serde_json::from_value::<StandsStill>(status["stands_still"].clone())
        && top
    {
        line(format!("stands still {still}"));
    }
    if top && status["left"].is_array() {
        let told = "its coordinators are down, and components are there: `davit shutdown` takes them away";
        line(format!("left         {}", out.paint(Style::Bad, told)));
    }
    if !part.waiting.is_empty() {
        line(format!("waiting for  {}", part.waiting.join(", ")));
    }
    if top {
        dropped(out, status).into_iter().for_each(&mut line);
    }
    if !known {
        line(format!("stack        {}", out.paint(Style::Bad, not_known())));
        line(format!("components   {}", out.paint(Style::Bad, not_known())));
        return said + &faults(out, part);
    }
    line(format!(
        "stack        {}{}",
        count(part.frames.len(), "frame"),
        match part.frames.last() {
            Some(newest) => format!(", newest {}", text(&newest["configuration"])),
            None => String::new(),
        }
    ));
    for (key, style, words) in
        [("lost", Style::Bad, "what it did or stands for is no longer so"), ("unseen", Style::Dim, "not observed here")]
    {
        for frame in part.frames.iter().filter(|frame| frame[key] == true) {
            line(format!("             {} {}", text(&frame["configuration"]), out.paint(style, words)));
        }
    }
    if top {
        held_by(out, status).into_iter().for_each(&mut line);
    }
    titled(out, &mut said, "components", &components(out, part, true));
    if !part.residual.is_empty() {
        // Not what is to be done: what has happened to it.
        let told = |one: &Json| match text(&one["how"]) {
            "differs" => json!({ "text": format!("{} (as the platform shows it)", text(&one["text"])) }),
            _ => one.clone(),
        };
        let residual: Vec<Json> = part.residual.iter().map(|one| told(one)).collect();
        let broken = status["phase"] == "broken";
        let title = if broken { "what remains of what broke it" } else { "what is not as it should be" };
        said += &format!("{}\n{}", out.paint(Style::Bad, title), listed(&residual));
    }
    said + &faults(out, part)
}

/// A table below its title, if it has rows.
pub fn titled(out: &Output, page: &mut String, title: &str, table: &Table) {
    if !table.is_empty() {
        *page += &format!("{}\n{table}", out.paint(Style::Bold, title));
    }
}

/// The components of one file, with what they run in where that is wanted.
pub fn components(out: &Output, part: &FilePart<'_>, activities: bool) -> Table {
    let mut table = Table::new(2);
    for (name, component) in &part.components {
        let state = text(&component["state"]);
        let dim = |key: &str| out.paint(Style::Dim, text(&component[key]));
        let activity = activities.then(|| dim("activity"));
        table.row([out.paint(state_style(state), state), (*name).to_owned(), dim("type")].into_iter().chain(activity));
    }
    table
}

/// Frames of others that hold something of a subsystem.
pub fn held_by(out: &Output, status: &Json) -> Vec<String> {
    let frame = |frame: &Json| {
        let by = format!("by {}", text(&frame["by"]));
        format!("held by      {}  {}", text(&frame["configuration"]), out.paint(Style::Dim, by))
    };
    status["held_by"].as_array().into_iter().flatten().map(frame).collect()
}

fn dropped(out: &Output, status: &Json) -> Vec<String> {
    let word = out.paint(Style::Care, "dropped");
    let number = |kind: &str| status["dropped"][kind].as_u64().filter(|number| *number > 0);
    let inside = number("inside").map(|inside| {
        format!("{word}      {} that a coordinator sent to itself: too many at once", count(inside, "event"))
    });
    let others = [("report", "lost"), ("outside", "from outside, refused")].into_iter().filter_map(|(kind, what)| {
        let dropped = count(number(kind)?, "event");
        Some(format!("{word}      {dropped} {what}: the coordinator does not keep up"))
    });
    inside.into_iter().chain(others).collect()
}

fn faults(out: &Output, part: &FilePart<'_>) -> String {
    let word = out.paint(Style::Bad, "fault");
    let fault = |fault: &&Json| format!("{word} {}: {}\n", text(&fault["component"]), text(&fault["reason"]));
    part.faults.iter().map(fault).collect()
}
