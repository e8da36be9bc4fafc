//! The languages: the paper's listings, both spellings, typos, hostile files, round trips.

mod helpers;
mod hostile;
mod listings;
mod monitors;
mod reference;
mod round_trip;
mod tongue;
mod typos;
