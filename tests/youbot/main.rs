//! The youBot reference application, measured in simulated time.

mod bench;
mod chatter;
mod composed;
#[path = "../support/counting.rs"]
#[allow(dead_code)] // only what one thread asks for
mod counting;
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
static ALLOCATOR: counting::Counting = counting::Counting;
