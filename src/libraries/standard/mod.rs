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
        .with::<Constant>("Constant")
        .with::<CsvLogger>("CsvLogger")
        .with::<Gain>("Gain")
        .with::<Pid>("Pid")
        .with::<Ramp>("Ramp")
        .with::<Saturation>("Saturation")
        .with::<Sine>("Sine")
        .with::<Sum>("Sum")
        .with::<Threshold>("Threshold")
}
