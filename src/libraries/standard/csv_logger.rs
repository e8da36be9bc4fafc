//! Signals into a file.

use crate::model::{SampleText, Tunable};
use crate::runtime::{Builder, Component, Context, Failure, HookResult, In, Prop};
use std::fs::File;
use std::io::{BufWriter, Write};

const COLUMNS: [&str; 8] = ["u1", "u2", "u3", "u4", "u5", "u6", "u7", "u8"];

/// Writes up to eight signals to a CSV file, one line an update.
pub struct CsvLogger {
    columns: [In<f64>; COLUMNS.len()],
    path: Prop<String>,
    every: Prop<i64>,
    file: Option<BufWriter<File>>,
    updates: i64,
}

impl Component for CsvLogger {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Writes up to eight signals to a file of comma-separated values, one line an update: the time in seconds, then \
             the signals; one that was never written is left empty. Configuring creates the file (an old one is \
             overwritten), stopping and cleaning up bring it to disk. It writes in its activity's thread: give it one of \
             its own.",
        );
        b.on_configure(Self::open).on_stop(Self::flush).on_cleanup(Self::close);
        Self {
            columns: COLUMNS.map(|u| b.doc("A column.").input(u)),
            path: b.doc("The file.").tunable(Tunable::Unconfigured).required_property("path", String::new()),
            every: b.doc("Only every so many-th update is written.").min(1.0).property("every", 1),
            file: None,
            updates: 0,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let every = self.every.get().max(1);
        self.updates += 1;
        if self.updates % every != 0 {
            return;
        }
        if let Err(error) = self.write_line(cx.now().as_secs_f64()) {
            cx.fault(format!("cannot write the log: {error}"));
        }
    }
}

impl CsvLogger {
    fn open(&mut self, _: &mut Context) -> HookResult {
        let path = self.path.get();
        let failure = |error: std::io::Error| Failure(format!("cannot create {path:?}: {error}"));
        let mut file = BufWriter::new(File::create(&path).map_err(failure)?);
        writeln!(file, "time,{}", COLUMNS.join(",")).map_err(failure)?;
        self.file = Some(file);
        self.updates = 0;
        Ok(())
    }

    fn write_line(&mut self, time: f64) -> std::io::Result<()> {
        let Some(file) = &mut self.file else { return Ok(()) };
        write!(file, "{time}")?;
        for column in &mut self.columns {
            match column.get() {
                Some(value) => write!(file, ",{}", SampleText(value))?,
                None => file.write_all(b",")?,
            }
        }
        file.write_all(b"\n")
    }

    fn flush(&mut self, _: &mut Context) -> HookResult {
        match &mut self.file {
            Some(file) => file.flush().map_err(|error| Failure(format!("cannot write the log: {error}"))),
            None => Ok(()),
        }
    }

    fn close(&mut self, cx: &mut Context) -> HookResult {
        let result = self.flush(cx);
        // Closed in any case: a disk that is full must not keep the component from being cleaned up the next time.
        self.file = None;
        result
    }
}
