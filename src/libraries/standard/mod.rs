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

/// The library.
pub fn library() -> Library {
    Library::new("standard")
        .with::<Constant>("standard.Constant")
        .with::<CsvLogger>("standard.CsvLogger")
        .with::<Gain>("standard.Gain")
        .with::<Pid>("standard.Pid")
        .with::<Ramp>("standard.Ramp")
        .with::<Saturation>("standard.Saturation")
        .with::<Sine>("standard.Sine")
        .with::<Sum>("standard.Sum")
        .with::<Threshold>("standard.Threshold")
}
