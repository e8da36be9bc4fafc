//! From findings to words: where a model element was written, and the one rendering of findings.
//!
//! A [`SourceMap`] turns the [`Origin`](crate::model::Origin)s that model elements carry into places in texts. Loading
//! notes lines only; columns are worked out when something is shown, so a file without findings pays nothing for them.
//! This room judges nothing and reads no file.

mod extent;
mod large;
mod render;
mod source_file;
mod source_map;
mod tokens;
mod wrap;
mod yaml_extent;

pub use render::{RenderOptions, render, render_with, to_json};
pub use source_file::{FileId, Language, Location, SourceFile};
pub use source_map::SourceMap;
pub use tokens::{LuaToken, next_token};
pub use wrap::wrapped;
