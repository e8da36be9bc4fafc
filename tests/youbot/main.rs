//! The youBot reference application, measured in simulated time.

mod coupling;
mod files;
mod golden;
