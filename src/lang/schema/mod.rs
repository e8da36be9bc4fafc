//! What is made of the table of what can be written ([`grammar`](super::grammar)): JSON Schema for editors of YAML, annotations for
//! editors of Lua, the reference for people.

mod json;
mod lua;
mod reference;

pub use json::{OptionName, PlatformNames, ProgramNames, json_schema};
pub use lua::annotations;
pub use reference::{Example, ReferenceEntry, about, keys_of, markdown, names};
