//! Pictures: components, coordinators and plans as SVG, DOT and Mermaid text.
//!
//! Each subject becomes one [`Diagram`]; each format writes any diagram. Knows no file and no terminal.

mod components;
mod coordinator;
pub mod diagram;
mod dot;
mod exchange;
pub mod layout;
mod mermaid;
mod plan;
mod svg;
mod text;

pub use components::components;
pub use coordinator::{coordinator, coordinators};
pub use diagram::Diagram;
pub use exchange::{coordinator_json, coordinator_plantuml};
pub use plan::plan;

impl Diagram {
    /// The diagram as SVG.
    pub fn svg(&self) -> String {
        svg::write(self)
    }

    /// The diagram in Graphviz' language.
    pub fn dot(&self) -> String {
        dot::write(self)
    }

    /// The diagram in Mermaid's language.
    pub fn mermaid(&self) -> String {
        mermaid::write(self)
    }
}
