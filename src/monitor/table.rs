//! Recorded samples as text: comma-separated values, a column `time` in seconds and one for each signal.
//!
//! Line by line, so that a recording may be as long as it likes. What is wrong comes with its column in the line.

use super::sample::state_value;
use crate::model::codes::{SAMPLES_BACKWARDS, SAMPLES_BAD_NUMBER, SAMPLES_BAD_TIME, SAMPLES_COLUMNS, SAMPLES_EMPTY};
use crate::model::{Code, RunState};
use crate::time::Time;

/// What is wrong with a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableProblem {
    /// Its code.
    pub code: Code,
    /// One sentence.
    pub message: String,
    /// Where in the line, in characters from 0.
    pub column: u32,
    /// How many characters.
    pub length: u32,
    /// What to do.
    pub help: String,
}

/// The columns of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    names: Vec<String>,
    time: usize,
    last: Option<Time>,
}

/// A cell: its text without blanks and quotes, and where it stands, in bytes.
struct TableCell<'a> {
    text: &'a str,
    start: usize,
}

/// The cells of a line.
fn cells(line: &str) -> impl Iterator<Item = TableCell<'_>> {
    line.split(',').map(move |raw| {
        let trimmed = raw.trim();
        let text = trimmed.strip_prefix('"').and_then(|t| t.strip_suffix('"')).unwrap_or(trimmed);
        TableCell { text, start: text.as_ptr() as usize - line.as_ptr() as usize }
    })
}

fn problem(code: Code, line: &str, cell: &TableCell<'_>, message: String, help: impl Into<String>) -> TableProblem {
    let count = |text: &str| u32::try_from(text.chars().count()).unwrap_or(u32::MAX);
    TableProblem {
        code,
        message,
        column: count(&line[..cell.start]),
        length: count(cell.text).max(1),
        help: help.into(),
    }
}

/// A text without its line end and a mark of byte order.
fn clean(line: &str) -> &str {
    line.trim_start_matches('\u{feff}').trim_end_matches(['\r', '\n'])
}

/// Whether a line holds nothing.
pub fn is_blank(line: &str) -> bool {
    clean(line).trim().is_empty()
}

impl Columns {
    /// Reads the first line.
    ///
    /// # Errors
    /// When there is no column `time`, or a name is missing or stands twice.
    pub fn new(line: &str) -> Result<Self, TableProblem> {
        let line = clean(line);
        let wrong =
            |cell: &TableCell<'_>, message: String, help: &str| problem(SAMPLES_COLUMNS, line, cell, message, help);
        let mut names: Vec<String> = Vec::new();
        for cell in cells(line) {
            if cell.text.is_empty() {
                return Err(wrong(
                    &cell,
                    format!("column {} has no name", names.len() + 1),
                    "name each column, or leave it out",
                ));
            }
            if names.iter().any(|known| known == cell.text) {
                return Err(wrong(
                    &cell,
                    format!("there are two columns `{}`", cell.text),
                    "each signal has one column",
                ));
            }
            names.push(cell.text.to_owned());
        }
        let Some(time) = names.iter().position(|name| name == "time") else {
            let whole = TableCell { text: line, start: 0 };
            let help = if names.len() == 1 && line.contains([';', '\t']) {
                "columns are separated by commas"
            } else {
                "the first line names the columns: `time`, in seconds, then the signals"
            };
            return Err(wrong(&whole, "there is no column `time`".to_owned(), help));
        };
        Ok(Self { names, time, last: None })
    }

    /// Their names, in order.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Which of them is the time.
    pub fn time(&self) -> usize {
        self.time
    }

    /// Reads a line: answers its time, and calls `cell` with the column and the value of each cell of the columns that
    /// are `wanted` and hold a sample.
    ///
    /// # Errors
    /// When it has another number of cells, no time or one before that of the last line, or a cell that is no number.
    pub fn line(
        &mut self,
        line: &str,
        wanted: &[bool],
        cell: &mut dyn FnMut(usize, f64),
    ) -> Result<Time, TableProblem> {
        let line = clean(line);
        let mut at = None;
        let mut count = 0;
        for (i, c) in cells(line).enumerate() {
            count = i + 1;
            if i == self.time {
                let time = seconds(c.text).ok_or_else(|| {
                    let shown: String = c.text.chars().take(40).collect();
                    let message = if shown.is_empty() {
                        "the time is missing".to_owned()
                    } else {
                        format!("`{shown}` is not a time")
                    };
                    let help = if c.text.parse().is_ok_and(|t: f64| t.is_finite() && t > 0.0) {
                        "times are seconds, and this is more than a hundred years: if the recording counts milliseconds, \
                         microseconds or nanoseconds, divide its column `time`"
                    } else {
                        "write seconds, 0 or more, such as `0.125`"
                    };
                    problem(SAMPLES_BAD_TIME, line, &c, message, help)
                })?;
                if let Some(last) = self.last
                    && time < last
                {
                    let message = format!("the time goes back from {} s to {} s", decimal(last), decimal(time));
                    let help = "each line is at the time of the one before it or later: cut the file here";
                    return Err(problem(SAMPLES_BACKWARDS, line, &c, message, help));
                }
                at = Some(time);
            } else if !c.text.is_empty() && wanted.get(i).copied().unwrap_or(false) {
                let value = value(c.text).ok_or_else(|| {
                    let shown: String = c.text.chars().take(40).collect();
                    let help = "a cell holds a number, `true`, `false`, the name of a run state, or nothing";
                    problem(SAMPLES_BAD_NUMBER, line, &c, format!("`{shown}` is not a number"), help)
                })?;
                cell(i, value);
            }
        }
        if count != self.names.len() {
            let whole = TableCell { text: line, start: 0 };
            let message = format!("this line has {count} cells, the first one {}", self.names.len());
            let help = "every line has as many cells as there are columns; one without a new sample is left empty";
            return Err(problem(SAMPLES_COLUMNS, line, &whole, message, help));
        }
        let at = at.unwrap_or_default();
        self.last = Some(at);
        Ok(at)
    }
}

/// What is wrong with a recording without lines.
pub fn empty(header: bool) -> TableProblem {
    let message = if header { "there is no line after the first" } else { "the file is empty" };
    TableProblem {
        code: SAMPLES_EMPTY,
        message: message.to_owned(),
        column: 0,
        length: 0,
        help: "the first line names the columns (`time` and the signals), each other one holds the samples of a time"
            .to_owned(),
    }
}

/// The value of a cell.
fn value(text: &str) -> Option<f64> {
    match text {
        "true" | "True" => Some(1.0),
        "false" | "False" => Some(0.0),
        _ => text.parse().ok().or_else(|| RunState::from_name(text).map(state_value)),
    }
}

/// Seconds as a time, exact to the nanosecond.
pub fn seconds(text: &str) -> Option<Time> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, ""));
    let digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    if !whole.is_empty() && digits(whole) && digits(fraction) {
        let nanos: u64 = format!("{:0<9}", &fraction[..fraction.len().min(9)]).parse().ok()?;
        let up = u64::from(fraction.as_bytes().get(9).is_some_and(|b| *b >= b'5'));
        let at = whole.parse::<u64>().ok()?.checked_mul(1_000_000_000)?.checked_add(nanos + up)?;
        return (at <= MOST).then_some(Time(at));
    }
    let nanos = (text.parse::<f64>().ok()? * 1e9).round();
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
    (nanos >= 0.0 && nanos <= MOST as f64).then_some(Time(nanos as u64))
}

/// The latest time of a recording, in nanoseconds: a quarter of what the clock can say, more than a hundred years.
const MOST: u64 = u64::MAX / 4;

/// A time in seconds, exact.
pub fn decimal(at: Time) -> String {
    let (whole, rest) = (at.as_nanos() / 1_000_000_000, at.as_nanos() % 1_000_000_000);
    let fraction = format!("{rest:09}");
    let fraction = fraction.trim_end_matches('0');
    if fraction.is_empty() { format!("{whole}") } else { format!("{whole}.{fraction}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact() {
        for (text, nanos) in [
            ("0", 0),
            ("0.1", 100_000_000),
            ("1732200000.123456789", 1_732_200_000_123_456_789),
            ("1e-3", 1_000_000),
            ("0.0000000015", 2),
            ("2.", 2_000_000_000),
        ] {
            assert_eq!(seconds(text), Some(Time(nanos)), "{text}");
        }
        for text in ["", "-1", "nan", "inf", "1 s", ".", "1e300", "99999999999999999999"] {
            assert_eq!(seconds(text), None, "{text}");
        }
        assert_eq!(decimal(Time(1_500_000_001)), "1.500000001");
    }

    #[test]
    fn columns_and_cells() {
        let mut columns = Columns::new("\u{feff}time, \"A.x[0]\",b\r\n").unwrap();
        assert_eq!(columns.names(), ["time", "A.x[0]", "b"]);
        let mut seen = Vec::new();
        let mut read = |line: &str| columns.line(line, &[false, true, true], &mut |i, v| seen.push((i, v)));
        assert_eq!(read("0.5,1.5,\r\n"), Ok(Time(500_000_000)));
        assert_eq!(read("0.5,,running"), Ok(Time(500_000_000)));
        let wrong = [
            read("0.4,1,1").unwrap_err(),
            read("1,1x,1").unwrap_err(),
            read("1,1").unwrap_err(),
            read("1,1,1,1").unwrap_err(),
            read(",1,1").unwrap_err(),
        ];
        assert_eq!(
            wrong.map(|p| (p.code, p.column)),
            [
                (SAMPLES_BACKWARDS, 0),
                (SAMPLES_BAD_NUMBER, 2),
                (SAMPLES_COLUMNS, 0),
                (SAMPLES_COLUMNS, 0),
                (SAMPLES_BAD_TIME, 0),
            ]
        );
        assert_eq!(seen[..2], [(1, 1.5), (2, 2.0)]);
        for header in ["", "a,b", "time,,b", "time,a,a", "time;a"] {
            assert_eq!(Columns::new(header).unwrap_err().code, SAMPLES_COLUMNS, "{header}");
        }
    }
}
