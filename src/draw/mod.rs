//! Pictures: components, coordinators and plans as SVG, DOT and Mermaid text.
//!
//! Each subject becomes one [`Diagram`]; each format writes any diagram. Knows no file and no terminal.

mod components;
mod components_view;
mod coordinator;
pub mod diagram;
mod dot;
mod exchange;
mod hierarchy;
pub mod layout;
mod mermaid;
mod plan;
mod svg;
mod text;

pub use components::components;
pub use components_view::ComponentsView;
pub use coordinator::coordinator;
pub use diagram::Diagram;
pub use exchange::{coordinator_json, coordinator_plantuml};
pub use hierarchy::{PlacedCoordinator, coordinators};
pub use plan::{DrawnPlan, plan};

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
