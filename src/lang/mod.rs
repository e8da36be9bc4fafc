//! Text → model. Lua and YAML are read into one loose tree with places, which is lowered once into the model; what is
//! wrong is collected, all of it, with the place.
//!
//! This room runs no component and judges no meaning beyond the text itself: names are names, times are times, choices
//! exist. Whether a component has that port is the business of later rooms, which find the place through the
//! [`SourceMap`].

mod bound;
mod compose;
mod concern;
mod convert;
mod example;
mod files;
pub mod grammar;
mod left_out;
mod load;
mod lower;
mod lua;
mod params;
mod pipe;
pub mod print;
pub mod schema;
mod scxml;
mod slips;
mod spelling;
mod spelling_xml;
mod texts;
mod tokens;
mod tree;
mod trusted;
mod unknown_names;
mod whole;
mod words;
mod yaml;

pub use convert::{Converted, convert};
pub use files::Sources;
pub use left_out::warnings as functions_left_out;
pub use load::{
    Loaded, LoadedConfigurations, LoadedCoordinator, LoadedMonitors, load, load_configurations, load_coordinator,
    load_from, load_monitors,
};
pub use lua::why_closed;
pub use slips::key_again;
pub use texts::LoadOptions;
pub use unknown_names::{UnknownName, unknown_names};
