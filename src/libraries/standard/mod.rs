//! `standard`: components people need for wiring and testing. All signals are floats without a unit, so that they connect
//! to any.
//!
//! A component whose input was never written writes nothing.

pub mod arithmetic;
pub mod csv_logger;
pub mod pid;
pub mod sources;
pub mod threshold;

use crate::runtime::Library;

pub use arithmetic::{Gain, Saturation, Sum};
pub use csv_logger::CsvLogger;
pub use pid::Pid;
pub use sources::{Constant, Ramp, Sine};
pub use threshold::Threshold;

/// The library. What only calculates is made and dropped at once; a logger has a file to close.
pub fn library() -> Library {
    Library::new("standard")
        .with_immediate::<Constant>("standard.Constant")
        .with::<CsvLogger>("standard.CsvLogger")
        .with_immediate::<Gain>("standard.Gain")
        .with_immediate::<Pid>("standard.Pid")
        .with_immediate::<Ramp>("standard.Ramp")
        .with_immediate::<Saturation>("standard.Saturation")
        .with_immediate::<Sine>("standard.Sine")
        .with_immediate::<Sum>("standard.Sum")
        .with_immediate::<Threshold>("standard.Threshold")
}
