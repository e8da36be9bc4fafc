//! `davit sim` at a terminal: the line editor around a session, with history and completion.

use super::exit::Exit;
use super::output::Style;
use super::sim_session::SimSession;
use super::{CommandContext, CommandFailure, CommandResult};
use crate::model::codes::CLI_EVENTS_UNREADABLE;
use crate::statechart::{Hook, Sim};
use rustyline::completion::Completer;
use rustyline::error::ReadlineError;
use rustyline::{Config, Editor, Helper, Highlighter, Hinter, Validator};
use std::cell::RefCell;
use std::rc::Rc;

/// Completes words as the session knows them.
#[derive(Helper, Highlighter, Hinter, Validator)]
struct SimWords<C: Fn(&str) -> (usize, Vec<String>)>(C);

impl<C: Fn(&str) -> (usize, Vec<String>)> Completer for SimWords<C> {
    type Candidate = String;

    fn complete(&self, line: &str, at: usize, _: &rustyline::Context<'_>) -> rustyline::Result<(usize, Vec<String>)> {
        Ok((self.0)(line.get(..at).unwrap_or(line)))
    }
}

/// Reads lines from the terminal until the end.
///
/// # Errors
/// When the terminal cannot be read, or `make` can make no machine.
pub fn edit<'c, F: Hook>(context: &CommandContext, make: impl Fn() -> Result<Sim<'c, F>, String>) -> CommandResult {
    let unreadable = |error: &dyn std::fmt::Display| {
        let help = "`--events FILE` reads the events from a file, `--events -` from standard input";
        CommandFailure::usage(CLI_EVENTS_UNREADABLE, format!("the terminal cannot be read: {error}"), help)
    };
    super::signals::give_terminal_back().map_err(|why| unreadable(&why))?;
    let session = SimSession::new(make).map_err(|why| unreadable(&why))?;
    let session = Rc::new(RefCell::new(session));
    let config = Config::builder().max_history_size(crate::limits::SIM_LINES).map_err(|e| unreadable(&e))?.build();
    let mut editor = Editor::with_config(config).map_err(|e| unreadable(&e))?;
    let known = session.clone();
    editor.set_helper(Some(SimWords(move |line: &str| known.borrow().complete(line))));
    let out = &context.out;
    out.line("a line is a set of events; Tab completes; `help` lists the commands; Ctrl-D ends");
    loop {
        out.text(out.paint(Style::Dim, session.borrow().state()));
        match editor.readline("> ") {
            Ok(line) => {
                // A line that cannot be remembered is not worth stopping for.
                let _ = editor.add_history_entry(line.as_str());
                let reply = session.borrow_mut().line(&line);
                out.text(reply.text);
                if reply.quit {
                    return Ok(Exit::Done);
                }
            }
            Err(ReadlineError::Interrupted) => {}
            Err(ReadlineError::Eof) => return Ok(Exit::Done),
            Err(error) => return Err(unreadable(&error)),
        }
    }
}
