//! The languages: the paper's listings, both spellings, typos, hostile files, round trips.

mod helpers;
mod listings;
mod round_trip;
mod hostile;
