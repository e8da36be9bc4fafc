//! Where a command's words go: text or JSON on stdout, findings on stderr, colours only where a terminal shows them.
//!
//! A reader that goes away (`davit plan … | head`) is no error of ours: what is left is thrown away and the command's
//! answer stands. Anything else that keeps words from being written (a full disk) is remembered, and the command's end
//! says so.

use crate::diagnostics::{SourceMap, render, wrapped};
use crate::model::finding::count;
use crate::model::{Finding, Severity};
use serde::Serialize;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// When to use colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Color {
    /// On a terminal, unless NO_COLOR is set or TERM is `dumb`.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

impl Color {
    fn on(self, terminal: bool) -> bool {
        match self {
            Self::Auto => {
                let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
                terminal && !dumb && std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty())
            }
            Self::Always => true,
            Self::Never => false,
        }
    }
}

/// The two streams of a command.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    stdout_color: bool,
    stderr_color: bool,
}

/// A style of a word, by the number that terminals know it by. Styles mean the same in every command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Headings.
    Bold = 1,
    /// What matters less.
    Dim = 2,
    /// Fine, running, exact.
    Good = 32,
    /// Look at it: warnings, compensated.
    Care = 33,
    /// Wrong, broken, irreversible.
    Bad = 31,
    /// Names.
    Name = 36,
}

impl Output {
    /// Streams with colours as asked.
    pub fn new(color: Color) -> Self {
        let (out, err) = (io::stdout().is_terminal(), io::stderr().is_terminal());
        ON_TERMINAL.store(out || err, Ordering::Relaxed);
        Self { stdout_color: color.on(out), stderr_color: color.on(err) }
    }

    /// `text` in `style`, where stdout shows colours.
    pub fn paint(&self, style: Style, text: impl Display) -> String {
        if !self.stdout_color {
            return text.to_string();
        }
        format!("\x1b[{}m{text}\x1b[0m", style as u8)
    }

    /// Text to stdout as it is.
    pub fn text(&self, text: impl AsRef<str>) {
        put(Stream::Out, text.as_ref());
    }

    /// A line to stdout.
    pub fn line(&self, line: impl Display) {
        put(Stream::Out, &format!("{line}\n"));
    }

    /// A value as JSON on stdout, indented, with a final newline.
    pub fn json(&self, value: &impl Serialize) {
        let text = serde_json::to_string_pretty(value).expect("views are plain data");
        self.line(text);
    }

    /// A value as JSON on one line of stdout.
    pub fn json_line(&self, value: &impl Serialize) {
        let text = serde_json::to_string(value).expect("views are plain data");
        self.line(text);
    }

    /// Findings to stderr, each with its place and its help.
    pub fn findings(&self, findings: &[Finding], sources: &SourceMap) {
        if !findings.is_empty() {
            self.error(render(findings, sources, self.stderr_color));
        }
    }

    /// Those of findings that refuse something to stderr, and of the others how many `shows` shows.
    pub fn refused(&self, findings: &[Finding], sources: &SourceMap, shows: &str) {
        let (errors, others): (Vec<Finding>, Vec<Finding>) = findings.iter().cloned().partition(Finding::is_error);
        self.findings(&errors, sources);
        let warnings = others.iter().filter(|finding| finding.severity == Severity::Warning).count();
        let of = |number: usize, what: &str| (number > 0).then(|| count(number, what));
        let parts: Vec<String> =
            [of(warnings, "warning"), of(others.len() - warnings, "note")].into_iter().flatten().collect();
        if !parts.is_empty() {
            let them = if others.len() == 1 { "it" } else { "them" };
            self.error(format!("{}: {shows} shows {them}\n", parts.join(", ")));
        }
    }

    /// Text to stderr as it is.
    pub fn error(&self, text: impl AsRef<str>) {
        error(text.as_ref());
    }
}

/// Text to stderr as it is.
pub fn error(text: &str) {
    put(Stream::Err, text);
}

/// A panic, which is nobody's own word: to stderr wherever that leads, so that it is kept with what components print.
pub fn panic(text: &str) {
    put(Stream::Process, text);
}

/// Why something could not be written, the first time that happened. A reader that went away is no such reason.
static UNWRITTEN: OnceLock<String> = OnceLock::new();

/// Why something that was to be written was not, if there was anything (a disk is full, a stream is closed).
pub fn unwritten() -> Option<&'static str> {
    UNWRITTEN.get().map(String::as_str)
}

/// Remembers why a stream took nothing.
pub fn failed(error: &io::Error) {
    // A terminal that was closed refuses everything.
    let closed = error.raw_os_error() == Some(libc::EIO) && ON_TERMINAL.load(Ordering::Relaxed);
    if error.kind() == ErrorKind::BrokenPipe || closed {
        READER_GONE.store(true, Ordering::Relaxed);
    } else {
        let _ = UNWRITTEN.set(error.to_string());
    }
}

/// Whether stdout is a terminal.
pub fn is_terminal() -> bool {
    io::stdout().is_terminal()
}

/// Whether one of the streams went to a terminal when the command began.
static ON_TERMINAL: AtomicBool = AtomicBool::new(false);

static READER_GONE: AtomicBool = AtomicBool::new(false);

/// Whether what is printed arrives nowhere any more: nobody reads, or a disk is full. A command that would go on printing has
/// nothing left to do then.
pub fn arrives_nowhere() -> bool {
    READER_GONE.load(Ordering::Relaxed) || unwritten().is_some()
}

/// Whether nobody reads from stdout any more: for a command that may have nothing to print for long.
pub fn is_unread() -> bool {
    let mut poll = libc::pollfd { fd: libc::STDOUT_FILENO, events: 0, revents: 0 };
    // SAFETY: one descriptor, which is only looked at, and a list of that length.
    let ready = unsafe { libc::poll(&raw mut poll, 1, 0) };
    ready > 0 && poll.revents & (libc::POLLERR | libc::POLLHUP) != 0
}

#[derive(Clone, Copy)]
enum Stream {
    Out,
    Err,
    /// What stderr of the process is.
    Process,
}

/// Where a command's own words go while what else is printed in its process (by components) goes somewhere else.
static APART: Mutex<Option<Arc<[File; 2]>>> = Mutex::new(None);

/// From now on a command's own words go to these two, and not to stdout and stderr; to those again with none.
pub fn speak_to(streams: Option<[File; 2]>) {
    *APART.lock().unwrap_or_else(PoisonError::into_inner) = streams.map(Arc::new);
}

fn put(stream: Stream, text: &str) {
    let write = |to: &mut dyn Write| to.write_all(text.as_bytes()).and_then(|()| to.flush());
    // Not held while something is written: one stream that stands still does not keep the other waiting.
    let apart = APART.lock().unwrap_or_else(PoisonError::into_inner).clone();
    let written = match (apart.as_deref(), stream) {
        (Some([out, _]), Stream::Out) => write(&mut &*out),
        (Some([_, err]), Stream::Err) => write(&mut &*err),
        (None, Stream::Out) => write(&mut io::stdout().lock()),
        (None, Stream::Err) | (_, Stream::Process) => write(&mut io::stderr().lock()),
    };
    if let Err(error) = written {
        failed(&error);
    }
}

/// Rows in columns as wide as their widest cell. Cells may carry colours, which take no width.
#[derive(Debug, Clone, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
    indent: usize,
}

impl Table {
    /// An empty table, its rows indented by so many blanks.
    pub fn new(indent: usize) -> Self {
        Self { rows: Vec::new(), indent }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let terminal = terminal_columns();
        // On a terminal one wide cell does not push away what stands behind it in all other rows.
        let most = terminal.map_or(usize::MAX, |columns| columns / 3);
        let widths: Vec<usize> = (0..columns)
            .map(|i| {
                let cells = self.rows.iter().filter_map(|r| r.get(i)).map(|c| width(c));
                cells.filter(|cell| *cell <= most).max().unwrap_or(0)
            })
            .collect();
        for row in &self.rows {
            let mut line = " ".repeat(self.indent);
            for (i, (cell, wide)) in row.iter().zip(&widths).enumerate() {
                let at = width(&line);
                let room = terminal.map_or(usize::MAX, |columns| columns.saturating_sub(at));
                if i + 1 == row.len() && room >= LEAST_TEXT && width(cell) > room {
                    // The last cell is a text: it goes on below itself.
                    let inside = wrapped(cell, at + room, at);
                    line.push_str(inside.trim());
                } else {
                    line.push_str(cell);
                    let last = row[i + 1..].iter().all(String::is_empty);
                    match wide.checked_sub(width(cell)) {
                        Some(left) => line.push_str(&" ".repeat(left + 2)),
                        None if last => {}
                        // The rest of the row goes on below.
                        None => {
                            writeln!(f, "{}", line.trim_end())?;
                            line = " ".repeat(at + wide + 2);
                        }
                    }
                }
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// Fewest columns in which a text is still read.
const LEAST_TEXT: usize = 16;

/// How many columns the terminal has that is written to; none: it is no terminal.
pub fn terminal_columns() -> Option<usize> {
    terminal().map(|(columns, _)| columns)
}

/// Columns and rows of the terminal that is written to.
pub fn terminal() -> Option<(usize, usize)> {
    let (columns, rows) = terminal_size::terminal_size_of(io::stdout())?;
    (columns.0 > 0 && rows.0 > 0).then(|| (usize::from(columns.0), usize::from(rows.0)))
}

/// As much of a page as a terminal of so many columns and rows shows at once, the last row saying how many lines are below it.
pub fn fitting(page: &str, columns: usize, rows: usize) -> String {
    let taken = |line: &str| width(line).div_ceil(columns.max(1)).max(1);
    let lines: Vec<&str> = page.lines().collect();
    let (mut used, mut shown, mut fits) = (0, 0, 0);
    for line in &lines {
        used += taken(line);
        // One row stays for what is not shown, and one for the cursor.
        if used + 2 <= rows {
            fits = shown + 1;
        }
        shown += 1;
    }
    if used < rows || fits == 0 {
        return page.to_owned();
    }
    format!(
        "{}\n… {} below: `--depth 0` folds subsystems, `davit status` shows all",
        lines[..fits].join("\n"),
        count(lines.len() - fits, "line")
    )
}

/// How long lines of text are: 100, or what the terminal has.
pub fn text_columns() -> usize {
    terminal_columns().map_or(100, |columns| columns.clamp(LEAST_TEXT, 100))
}

/// Characters of `text` that a terminal shows.
pub fn width(text: &str) -> usize {
    let mut count = 0;
    let mut escape = false;
    for c in text.chars() {
        match c {
            '\x1b' => escape = true,
            'm' if escape => escape = false,
            _ if escape => {}
            _ => count += 1,
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_a_page_that_does_not_fit_it_is_said_how_much_is_below() {
        let page = (1..=9).map(|n| n.to_string()).collect::<Vec<_>>().join("\n");
        assert_eq!(fitting(&page, 80, 10), page);
        assert_eq!(fitting(&page, 80, 9).lines().count(), 8);
        assert!(fitting(&page, 80, 9).starts_with("1\n2\n3\n4\n5\n6\n7\n… 2 lines below"));
        // A long line takes several rows.
        let long = format!("{}\n{page}", "x".repeat(25));
        assert!(
            fitting(&long, 10, 9)
                .ends_with("\n1\n2\n3\n4\n… 5 lines below: `--depth 0` folds subsystems, `davit status` shows all"),
            "{}",
            fitting(&long, 10, 9)
        );
    }

    #[test]
    fn columns_align_whatever_their_colour() {
        let mut table = Table::new(2);
        table.row(["a".into(), "\x1b[1mlong\x1b[0m".into(), "x".into()]);
        table.row(["bcd".into(), "s".into(), "y".into()]);
        assert_eq!(table.to_string(), "  a    \x1b[1mlong\x1b[0m  x\n  bcd  s     y\n");
    }
}
