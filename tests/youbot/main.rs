//! The youBot reference application, measured in simulated time.

mod bench;
mod chatter;
mod coupling;
mod files;
mod golden;
mod robot;
mod two;

#[global_allocator]
static ALLOCATOR: bench::Counting = bench::Counting;
