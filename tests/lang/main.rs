//! The languages: the paper's listings, both spellings, typos, hostile files, round trips.

mod examples;
mod helpers;
mod hostile;
mod in_lua;
mod listings;
mod monitors;
mod reference;
mod round_trip;
mod tongue;
mod typos;
