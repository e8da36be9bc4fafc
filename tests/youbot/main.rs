//! The youBot reference application, measured in simulated time.

mod bench;
mod chatter;
mod coupling;
mod faults;
mod files;
mod golden;
mod last_word;
mod live;
mod motion;
mod robot;
mod stops;
mod two;

#[global_allocator]
static ALLOCATOR: bench::Counting = bench::Counting;
