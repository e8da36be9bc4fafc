//! What costs nothing where it must not: no allocation in control activities, prepared switches, requests, monitors and steps of pure
//! charts, and work that does not grow. Counted by the allocator, for each test in its own threads, so that tests may run beside each
//! other.

mod charts;
#[path = "../support/counting.rs"]
mod counting;
mod monitors;
mod requests;
mod switch;
mod updates;

#[global_allocator]
static ALLOCATOR: counting::Counting = counting::Counting;
