//! What a script has measured and recorded, and what was there when it failed, as `davit run` tells it.

use super::log;
use super::output::{Output, Style, Table};
use super::{CommandFailure, CommandResult};
use crate::app::script::{Figure, ScriptSample, ScriptScene};
use crate::cli::exit::Exit;
use crate::model::SampleText;
use crate::model::codes::CLI_UNWRITABLE;
use crate::monitor::table::decimal;
use serde_json::{Value as Json, json};
use std::fmt::Write;
use std::path::Path;

/// The table of figures.
pub fn table(out: &Output, figures: &[Figure]) -> String {
    let mut table = Table::new(0);
    table.row(["figure", "value", "expected", ""].map(|head| out.paint(Style::Bold, head)));
    for figure in figures {
        let expected = figure.expected();
        let end = match figure.ok {
            true if expected.is_empty() => String::new(),
            true => out.paint(Style::Good, "ok"),
            false => out.paint(Style::Bad, "missed"),
        };
        table.row([out.paint(Style::Name, &figure.name), figure.shown(), expected, end]);
    }
    table.to_string()
}

/// What was there when a script failed.
pub fn scene(out: &Output, scene: &ScriptScene) -> String {
    let frames = match &scene.stack {
        None => "nobody knows".to_owned(),
        Some(stack) if stack.is_empty() => "no frames".to_owned(),
        Some(stack) => {
            let newest: Vec<&str> = stack.iter().rev().map(|frame| frame.configuration.as_str()).collect();
            format!("{}, newest first", newest.join(", "))
        }
    };
    let leaf: Vec<&str> = scene.active.iter().map(String::as_str).collect();
    let mut text = format!(
        "{} {:.6} s\n  states  {}\n  stack   {frames}\n  what happened before that\n",
        out.paint(Style::Bold, "where it failed: at"),
        scene.at,
        leaf.join(" "),
    );
    for entry in &scene.last {
        text.push_str(&log::line(out, &serde_json::to_value(&**entry).expect("entries are plain data"), false));
    }
    text.trim_end().to_owned()
}

/// The same for programs.
pub fn scene_json(scene: &ScriptScene) -> Json {
    let last: Vec<Json> = scene.last.iter().map(|entry| json!(**entry)).collect();
    json!({ "at": scene.at, "what": "failed", "active": scene.active, "stack": scene.stack, "last": last })
}

/// Writes each recording into a file of its own in a folder, as `davit monitor --samples` reads it.
///
/// # Errors
/// When one cannot be written.
pub fn write_samples(folder: &Path, samples: &[ScriptSample]) -> CommandResult {
    let failed = |path: &Path, error: std::io::Error| {
        let help = "name a folder that may be written with `--samples`; it is made where there is none";
        CommandFailure::usage(CLI_UNWRITABLE, format!("{}: {error}", path.display()), help)
    };
    if samples.is_empty() {
        super::output::error(&format!(
            "note: nothing is written into {}: the script has recorded nothing (`sample`)\n",
            folder.display()
        ));
        return Ok(Exit::Done);
    }
    std::fs::create_dir_all(folder).map_err(|error| failed(folder, error))?;
    for sample in samples {
        let path = folder.join(format!("{}.csv", sample.name));
        std::fs::write(&path, csv(sample)).map_err(|error| failed(&path, error))?;
    }
    Ok(Exit::Done)
}

fn csv(sample: &ScriptSample) -> String {
    let table = sample.recording.table();
    let signals = sample.recording.signals();
    let mut text = "time".to_owned();
    signals.iter().for_each(|signal| _ = write!(text, ",{signal}"));
    text.push('\n');
    for (at, row) in table.times.iter().zip(table.values.chunks(signals.len().max(1))) {
        text.push_str(&decimal(*at));
        // No number, no sample.
        for value in row {
            let _ = if value.is_nan() { write!(text, ",") } else { write!(text, ",{}", SampleText(*value)) };
        }
        text.push('\n');
    }
    text
}
