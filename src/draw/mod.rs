//! Pictures: components, coordinators and plans as SVG, DOT and Mermaid text.
//!
//! Each subject becomes one [`Picture`]; each format writes any picture. Knows no file and no terminal.

mod components;
mod coordinator;
mod dot;
mod exchange;
pub mod layout;
mod mermaid;
pub mod picture;
mod plan;
mod svg;
mod text;

pub use components::components;
pub use coordinator::{coordinator, coordinators};
pub use exchange::{coordinator_json, coordinator_plantuml};
pub use picture::Picture;
pub use plan::plan;

impl Picture {
    /// The picture as SVG.
    pub fn svg(&self) -> String {
        svg::write(self)
    }

    /// The picture in Graphviz' language.
    pub fn dot(&self) -> String {
        dot::write(self)
    }

    /// The picture in Mermaid's language.
    pub fn mermaid(&self) -> String {
        mermaid::write(self)
    }
}
