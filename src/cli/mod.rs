//! The command line: a thin skin. One file a command, each: load, one call of the library, one view as text or JSON.
//!
//! A program with components of its own is three lines: `fn main() -> ExitCode { davit::main(libraries) }`.
//!
//! To add a command: a file with an `Args` struct (its doc comment is the help text) that implements [`Run`], and one
//! line in `commands!` below.

mod budget;
mod check;
mod completions;
mod convert;
mod deploy;
mod detach;
mod drift;
pub mod exit;
mod explain;
mod figures;
mod flags;
mod graph;
pub mod input;
mod inside;
mod inside_view;
mod keep;
mod kept;
mod last_words;
mod levels;
mod list;
mod log;
mod member;
mod monitor;
mod new;
pub mod output;
mod plan;
mod plan_groups;
mod plan_view;
mod printed;
mod progress;
mod recover;
mod remote;
mod replay;
mod request;
mod run;
mod schema;
mod shutdown;
mod sieve;
mod signals;
mod sim;
mod sim_editor;
mod sim_session;
mod stack;
mod status;
mod status_view;
mod sweep;
mod types;
mod watch;

use crate::app::Extensions;
use crate::diagnostics::{SourceMap, to_json};
use crate::model::codes::CLI_UNWRITABLE;
use crate::model::{Code, Finding, Findings};
use crate::time::NoThread;
use clap::{FromArgMatches, Parser};
use exit::Exit;
use output::{Color, Output};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::Path;
use std::process::ExitCode;

/// Brings component-based robot systems up, switches them while they run, undoes what it did, and takes them down again.
///
/// Exit status: 0 done; 1 the answer is no (findings, failed and rolled back); 2 usage or unreadable input; 3 broken:
/// `davit status` names what is left, `davit undo ID` of the very configuration that broke it goes back, and so does `davit
/// recover --back`; `davit recover --accept` takes what is there as the state; 4 a deployment was shut down without its
/// coordinator, by force, or incompletely.
#[derive(Debug, Parser)]
#[command(name = "davit", version, max_term_width = 100)]
struct Cli {
    /// When to use colours.
    #[arg(long, global = true, value_enum, default_value_t, value_name = "WHEN")]
    color: Color,
    #[command(subcommand)]
    command: Subcommand,
}

macro_rules! commands {
    ($($variant:ident = $args:path,)*) => {
        #[derive(Debug, clap::Subcommand)]
        enum Subcommand {
            $($variant($args),)*
        }

        impl Subcommand {
            fn run(self, context: &CommandContext) -> CommandResult {
                match self {
                    $(Self::$variant(args) => args.run(context),)*
                }
            }
        }
    };
}

commands! {
    Check = check::Args,
    Plan = plan::Args,
    Graph = graph::Args,
    New = new::Args,
    Types = types::Args,
    Convert = convert::Args,
    Sim = sim::Args,
    Monitor = monitor::Args,
    Deploy = deploy::Args,
    Run = run::Args,
    Sweep = sweep::Args,
    Shutdown = shutdown::Args,
    List = list::Args,
    Status = status::Args,
    Watch = watch::Args,
    Stack = stack::Args,
    Log = log::Args,
    Event = request::EventArgs,
    Apply = request::ApplyArgs,
    Undo = request::UndoArgs,
    Get = member::GetArgs,
    Set = member::SetArgs,
    Drift = drift::Args,
    Recover = recover::Args,
    Commit = request::CommitArgs,
    Schema = schema::Args,
    Explain = explain::Args,
    Completions = completions::Args,
}

/// What every command may use.
#[derive(Debug)]
pub struct CommandContext {
    /// Its streams.
    pub out: Output,
    /// The component libraries and platforms of this program.
    pub extensions: Extensions,
}

/// A command.
pub trait Run {
    /// Does it, and says how it ended.
    ///
    /// # Errors
    /// [`CommandFailure`] when there are findings instead of an answer.
    fn run(self, context: &CommandContext) -> CommandResult;
}

/// How a command ended, or what kept it from its work.
pub type CommandResult = Result<Exit, CommandFailure>;

/// Findings that end a command, and its exit code.
#[derive(Debug)]
pub struct CommandFailure {
    /// How it ended.
    pub exit: Exit,
    /// Why.
    pub findings: Findings,
    /// The texts the findings are about.
    pub sources: SourceMap,
    /// What shows the findings that refuse nothing: people are told that, and not them. None: they are told all.
    pub others: Option<String>,
}

impl CommandFailure {
    /// Findings about these texts; the answer is no.
    pub fn found(findings: Findings, sources: SourceMap) -> Self {
        Self { exit: Exit::No, findings, sources, others: None }
    }

    /// One error; the answer is no.
    pub fn no(code: Code, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::found(vec![Finding::error(code, message).help(help)], SourceMap::new())
    }

    /// One error of usage, or input that cannot be read.
    pub fn usage(code: Code, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { exit: Exit::Usage, ..Self::no(code, message, help) }
    }

    /// Why, and what to do, in one sentence.
    pub fn message(&self) -> String {
        self.findings.iter().map(Finding::in_a_line).collect::<Vec<_>>().join("; ")
    }
}

/// Text to a file, or to stdout when there is none.
///
/// # Errors
/// When the file cannot be written.
pub fn write_output(context: &CommandContext, file: Option<&Path>, text: &str) -> Result<(), CommandFailure> {
    let Some(file) = file else {
        context.out.text(text);
        return Ok(());
    };
    std::fs::write(file, text).map_err(|error| {
        CommandFailure::usage(
            CLI_UNWRITABLE,
            format!("{}: {error}", file.display()),
            "name a file in a directory that exists and may be written, or print it instead",
        )
    })
}

/// The commands with their flags and help texts, for whoever compares, documents or completes them.
pub fn command() -> clap::Command {
    <Cli as clap::CommandFactory>::command()
}

/// The whole command line, with the component libraries and platforms that a program brings: parses the arguments, runs the command,
/// prints what it has to say.
pub fn main(extensions: impl Into<Extensions>) -> ExitCode {
    run(extensions.into())
}

fn run(extensions: Extensions) -> ExitCode {
    signals::ignore_large_files();
    let parsed = command().try_get_matches().and_then(|matches| {
        let asked = matches.subcommand().map(|(_, args)| args.try_get_one("json"));
        Ok((Cli::from_arg_matches(&matches)?, matches!(asked, Some(Ok(Some(true))))))
    });
    let (cli, json) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            // Also help and version, which are no errors.
            if let Err(unwritten) = error.print() {
                output::failed(&unwritten);
            }
            if let Some(tip) = remote::how_it_is_said(&error) {
                output::error(&tip);
            }
            return written(Output::new(Color::Auto), if error.use_stderr() { Exit::Usage } else { Exit::Done }).into();
        }
    };
    let context = CommandContext { out: Output::new(cli.color), extensions };
    // They keep a robot up: nothing that cannot be written may hold them.
    if matches!(cli.command, Subcommand::Deploy(_) | Subcommand::Run(_))
        && let Err(error) = last_words::prepare()
    {
        return tell(context.out, deploy::short(error), FailureAnswer::Text).into();
    }
    let answers = match &cli.command {
        _ if !json => FailureAnswer::Text,
        // Their help promises one object a line.
        Subcommand::Deploy(_) | Subcommand::Run(_) | Subcommand::Sim(_) | Subcommand::Monitor(_) => {
            FailureAnswer::JsonLine
        }
        Subcommand::Watch(_) => FailureAnswer::JsonLine,
        Subcommand::Log(log) if log.streams() => FailureAnswer::JsonLine,
        _ => FailureAnswer::Json,
    };
    let ran = catch_unwind(AssertUnwindSafe(|| cli.command.run(&context)));
    let exit = match ran {
        Ok(Ok(exit)) => exit,
        Ok(Err(failure)) => tell(context.out, failure, answers),
        Err(panic) => match panic.downcast::<NoThread>() {
            Ok(none) => tell(context.out, deploy::short(none.0), answers),
            Err(panic) => {
                last_words::end();
                resume_unwind(panic);
            }
        },
    };
    last_words::end();
    let exit = written(context.out, exit);
    last_words::end();
    exit.into()
}

/// How a failure is answered: as `{"ok":false,"findings":[…]}` by every command that was asked with `--json`.
#[derive(Clone, Copy)]
enum FailureAnswer {
    Text,
    Json,
    JsonLine,
}

/// Prints why a command did not do its work; answers how it ended.
fn tell(out: Output, failure: CommandFailure, answers: FailureAnswer) -> Exit {
    let CommandFailure { exit, findings, sources, others } = failure;
    last_words::say(move || {
        let answer = || serde_json::json!({ "ok": false, "findings": to_json(&findings, &sources) });
        match answers {
            FailureAnswer::Text => match others {
                Some(shows) => out.refused(&findings, &sources, &shows),
                None => out.findings(&findings, &sources),
            },
            FailureAnswer::Json => out.json(&answer()),
            FailureAnswer::JsonLine => out.json_line(&answer()),
        }
    });
    exit
}

/// How a command ended that has written what it had to say: no good end if it could not.
fn written(out: Output, exit: Exit) -> Exit {
    let Some(why) = output::unwritten() else { return exit };
    let failure = CommandFailure::usage(
        CLI_UNWRITABLE,
        format!("the output could not be written: {why}"),
        "make room where the output goes, or send it elsewhere",
    );
    let unwritten = tell(out, failure, FailureAnswer::Text);
    if exit == Exit::Done { unwritten } else { exit }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        command().debug_assert();
    }
}
