//! `davit watch`: a running deployment as it changes.
//!
//! It asks again and again, as any client may: whatever becomes of this terminal (Ctrl-S, a pipe that nobody reads) is nothing
//! to the deployment.

use super::exit::Exit;
use super::inside::Hierarchy;
use super::kept;
use super::levels::{FilePart, each, folded, leaf, parts, states};
use super::list::silent;
use super::log::duration;
use super::output::{self, Output, Style, Table};
use super::remote::{OnlyWhich, connect, failure, seconds};
use super::status::{not_known, state_style, text};
use super::status_view::{components, heading, held_by, indented, title, titled};
use super::{CommandContext, CommandResult, Run};
use crate::model::finding::count;
use crate::model::names::level;
use crate::session::client::{Client, ClientError};
use crate::session::owner;
use crate::time::Clock;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Value as Json, json};
use std::time::Duration;

/// How long a look waits for what monitors say.
const PATIENCE: Duration = Duration::from_millis(300);

/// How long a look may take before it is said that the deployment does not answer.
const ANSWERS: Duration = Duration::from_secs(2);

/// Watch a running deployment: its phase, the coordinators' states, the stack, components, monitors (enabled, verdict, and how far
/// they are from changing) and activities.
///
/// On a terminal it is drawn anew again and again; elsewhere it is a line a look, with `--json` one object a line. A look that is not
/// answered within 2 s says so, and it goes on when the deployment answers again. What is a subsystem's stands below its path, as
/// `davit status` has it. Ctrl-C ends it, and so does the end of the deployment. Exit status: 0; 1 the deployment did not answer at the end; 4 it died.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    #[allow(missing_docs)] // a doc comment here would become the help of the whole command
    which: OnlyWhich,
    #[command(flatten)]
    hierarchy: Hierarchy,
    /// How often to look, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.5, value_parser = pause)]
    every: f64,
    /// End after so many looks.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    count: Option<u64>,
    /// Print JSON: one object a line.
    #[arg(long)]
    json: bool,
}

/// A pause between looks: asking without one would only keep a processor busy.
fn pause(text: &str) -> Result<f64, String> {
    seconds(text).and_then(|value| if value < 0.01 { Err("give at least 0.01 s".to_owned()) } else { Ok(value) })
}

impl Run for Args {
    fn run(self, context: &CommandContext) -> CommandResult {
        let out = &context.out;
        let client = connect(self.which.name())?;
        let name = client.name().to_owned();
        let mut looking = Looks { client, asked: None, anew: false };
        let screen = (!self.json && output::is_terminal()).then(WatchScreen::new);
        let clock = Clock::real();
        let (mut looks, mut page, mut heard) = (0, String::new(), clock.now());
        loop {
            let look = match looking.next() {
                Ok(look) => look,
                Err(error) => {
                    drop(screen);
                    looking.client.wait_until_free(Duration::MAX);
                    return if owner::is_owned(&name) { Err(failure(error)) } else { Ok(self.over(out, &name)) };
                }
            };
            let answers = look.is_some();
            if let Some(look) = look {
                heard = clock.now();
                let region = self.hierarchy.inside.in_status(&look["status"])?;
                let look = region.map_or(look.clone(), |region| region.look(&look));
                let depth = self.hierarchy.depth;
                match &screen {
                    _ if self.json => out.json_line(&look),
                    Some(screen) => {
                        page = drawn(out, &look, depth);
                        screen.draw(page.clone());
                    }
                    None => out.line(line(out, &look, depth)),
                }
            } else {
                let why = format!("does not answer for {:.0} s", clock.now().since(heard).as_secs_f64());
                let said = format!("{}  {}", out.paint(Style::Bold, &name), out.paint(Style::Bad, &why));
                match &screen {
                    _ if self.json => out.json_line(&silent(&name, &format!("`{name}` {why}"))),
                    // What was seen last stays below it.
                    Some(screen) => screen.draw(format!("{said}\n{page}").trim_end().to_owned()),
                    None => out.line(said),
                }
            }
            looks += 1;
            if self.count.is_some_and(|count| looks >= count) || output::arrives_nowhere() {
                return Ok(if answers { Exit::Done } else { Exit::No });
            }
            if answers {
                clock.sleep(Duration::from_secs_f64(self.every));
            }
        }
    }
}

impl Args {
    /// It does not run any more.
    fn over(&self, out: &Output, name: &str) -> Exit {
        if kept::told_died(out, name, self.json) {
            return kept::EXIT;
        }
        if self.json {
            out.json_line(&json!({ "name": name, "phase": "down" }));
        } else {
            let life = crate::session::kept::life(name).filter(|life| life.end.is_some());
            out.line(life.map_or(format!("`{name}` ended"), |life| kept::ended(&life)));
        }
        Exit::Done
    }
}

/// Looks at a deployment, again and again on one connection.
struct Looks {
    client: Client,
    /// The look that is not answered yet: while there is one no other is asked for.
    asked: Option<u64>,
    /// The connection was made anew, and nothing has come on it.
    anew: bool,
}

impl Looks {
    /// The next look; none: it is not answered in time, and goes on.
    fn next(&mut self) -> Result<Option<Json>, ClientError> {
        let answered = self.ask();
        let Err(error) = answered else {
            self.anew = false;
            return answered;
        };
        // One that says nothing for long is closed: who was stopped for as long may have closed it.
        if std::mem::replace(&mut self.anew, true) {
            return Err(error);
        }
        self.client = Client::connect(Some(self.client.name()))?;
        self.asked = None;
        self.ask()
    }

    fn ask(&mut self) -> Result<Option<Json>, ClientError> {
        let asked = match self.asked {
            Some(asked) => asked,
            None => self.client.send("look", &json!({ "within_s": PATIENCE.as_secs_f64() }))?,
        };
        self.asked = Some(asked);
        let answer = self.client.answer(asked, ANSWERS)?;
        self.asked = self.asked.filter(|_| answer.is_none());
        Ok(answer)
    }
}

/// What is drawn anew.
struct WatchScreen(ProgressBar);

impl WatchScreen {
    fn new() -> Self {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stdout());
        bar.set_style(ProgressStyle::with_template("{msg}").expect("a valid template"));
        Self(bar)
    }

    fn draw(&self, text: String) {
        let fits = output::terminal().map(|(columns, rows)| output::fitting(&text, columns, rows));
        self.0.set_message(fits.unwrap_or(text));
    }
}

impl Drop for WatchScreen {
    /// What was seen last stays.
    fn drop(&mut self) {
        self.0.abandon();
    }
}

/// The innermost active states of all coordinators, with their names where there are several; of a subsystem that is folded how it
/// stands.
fn leaves(out: &Output, status: &Json, depth: Option<usize>) -> String {
    let mut said = Vec::new();
    for part in &parts(status) {
        match level(part.path).saturating_sub(depth.unwrap_or(usize::MAX)) {
            0 if part.path.is_empty() => said.push(out.paint(Style::Name, states(part))),
            0 => said.extend(
                part.coordinators.iter().map(|(name, it)| format!("{name}:{}", out.paint(Style::Name, leaf(it)))),
            ),
            1 => said.push(format!("{} {}", part.path, out.paint(state_style(part.standing), part.standing))),
            _ => {}
        }
    }
    said.join(", ")
}

fn verdict(out: &Output, monitor: &Json) -> String {
    match (monitor["enabled"] == true, monitor["verdict"].as_bool()) {
        (false, _) => out.paint(Style::Dim, "off"),
        (true, None) => out.paint(Style::Dim, "not heard of"),
        (true, Some(true)) => out.paint(Style::Care, "true"),
        (true, Some(false)) => "false".to_owned(),
    }
}

/// The path of the subsystem whose monitor it is.
fn path_of(monitor: &Json) -> &str {
    text(&monitor["component"]).rsplit_once('/').map_or("", |(path, _)| path)
}

fn margin(monitor: &Json) -> String {
    monitor["robustness"].as_f64().map_or_else(String::new, |margin| format!("{margin:+.4}"))
}

/// A look in one line.
fn line(out: &Output, look: &Json, depth: Option<usize>) -> String {
    let status = &look["status"];
    let phase = text(&status["phase"]);
    let frames = status["stack"]
        .as_array()
        .map_or_else(|| out.paint(Style::Bad, format!("stack {}", not_known())), |stack| count(stack.len(), "frame"));
    let mut parts = vec![
        format!("{:>12.3} s", status["at"].as_f64().unwrap_or_default()),
        out.paint(state_style(phase), phase),
        leaves(out, status, depth),
        frames,
    ];
    let monitors = look["monitors"].as_array().into_iter().flatten();
    let unfolded = monitors.filter(|it| level(path_of(it)) <= depth.unwrap_or(usize::MAX));
    parts.extend(unfolded.map(|it| {
        let (path, name) = (path_of(it), text(&it["name"]));
        let name = if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
        format!("{name}: {} {}", verdict(out, it), margin(it)).trim_end().to_owned()
    }));
    let faults = status["faults"].as_array().into_iter().flatten();
    parts.extend(
        faults.map(|it| out.paint(Style::Bad, format!("fault {}: {}", text(&it["component"]), text(&it["reason"])))),
    );
    parts.join("  ")
}

/// A look as a page.
fn drawn(out: &Output, look: &Json, depth: Option<usize>) -> String {
    let status = &look["status"];
    let list = |key: &str| look[key].as_array().cloned().unwrap_or_default();
    let parts = parts(status);
    let monitors = list("monitors");
    let mut page = title(out, status) + "\n";
    each(
        &parts,
        depth,
        &mut page,
        |part| {
            let own = own(out, status, part, &monitors);
            if part.path.is_empty() { own } else { format!("{}\n{}", heading(out, part), indented(&own)) }
        },
        |lines| folded(out, &parts, lines, !status["stack"].is_null()).to_string(),
    );
    let mut activities = Table::new(2);
    for activity in list("activities") {
        let us = |key: &str| duration(activity[key].as_f64().unwrap_or_default() * 1e6);
        let overruns = activity["overruns"].as_u64().unwrap_or_default();
        activities.row([
            text(&activity["name"]).to_owned(),
            count(&activity["cycles"], "round"),
            out.paint(if overruns > 0 { Style::Care } else { Style::Dim }, format!("{overruns} missed")),
            format!("late {} (at most {})", us("latency_last_s"), us("latency_max_s")),
            format!("takes {} (at most {})", us("duration_last_s"), us("duration_max_s")),
        ]);
    }
    titled(out, &mut page, "activities", &activities);
    page.trim_end().to_owned()
}

/// What of a look is of one file.
fn own(out: &Output, status: &Json, part: &FilePart<'_>, monitors: &[Json]) -> String {
    let states = out.paint(Style::Name, states(part));
    let mut page = format!("coordinator  {states}\n");
    if !part.waiting.is_empty() {
        page += &format!("waiting for  {}\n", part.waiting.join(", "));
    }
    let frames: Vec<String> = part.frames.iter().rev().map(|frame| framed(out, frame)).collect();
    let stack = match frames.len() {
        _ if status["stack"].is_null() => out.paint(Style::Bad, not_known()),
        0 => "empty".to_owned(),
        1 => frames.join(""),
        _ => frames.join(", ") + &out.paint(Style::Dim, ", newest first"),
    };
    page += &format!("stack        {stack}\n");
    if part.path.is_empty() {
        held_by(out, status).iter().for_each(|line| page += &format!("{line}\n"));
    }
    for fault in &part.faults {
        let word = out.paint(Style::Bad, "fault");
        page += &format!("{word}        {}: {}\n", text(&fault["component"]), text(&fault["reason"]));
    }
    titled(out, &mut page, "components", &components(out, part, false));
    let mut watched = Table::new(2);
    let its = |name: &str| part.components.iter().any(|(own, _)| *own == name);
    for monitor in monitors.iter().filter(|monitor| its(text(&monitor["component"]))) {
        watched.row([verdict(out, monitor), text(&monitor["name"]).to_owned(), margin(monitor)]);
    }
    titled(out, &mut page, "monitors", &watched);
    page
}

/// A frame, with what is wrong with it.
fn framed(out: &Output, frame: &Json) -> String {
    let name = text(&frame["configuration"]);
    let marks: Vec<&str> = ["partial", "lost"].into_iter().filter(|mark| frame[*mark] == true).collect();
    if marks.is_empty() { name.to_owned() } else { format!("{name} ({})", out.paint(Style::Bad, marks.join(", "))) }
}
