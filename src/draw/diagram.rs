//! A diagram before it is drawn: nodes inside nodes, edges between them, what each looks like. SVG, DOT and Mermaid are
//! three ways to write the same diagram.

/// Which way the ranks of a diagram run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RankDirection {
    /// Left to right: data flow, plans.
    Right,
    /// Top to bottom: statecharts.
    Down,
}

/// What a diagram is of; Mermaid has a language of its own for statecharts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// Components and their connections.
    Components,
    /// A coordinator.
    Statechart,
    /// The steps of configurations.
    Plan,
}

/// The outline of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// A box with text and, where given, ports.
    #[default]
    Box,
    /// A box around its children (drawn empty when it has none).
    Group,
    /// The filled dot of an initial connector.
    Dot,
    /// A connector.
    Connector,
}

/// How something is coloured; never the only way it is told apart (the text says it too).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Tone {
    /// As the rest.
    #[default]
    Plain,
    /// Fine: running, exact.
    Good,
    /// Look at it: stopped, compensated.
    Care,
    /// Wrong: faulted, irreversible.
    Bad,
    /// Not alive: unconfigured.
    Quiet,
    /// Where the system is now.
    Active,
}

/// A node.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct DiagramNode {
    /// Its name among all nodes of the diagram.
    pub id: String,
    /// The group it stands in: an index into [`Diagram::nodes`], smaller than its own.
    pub parent: Option<usize>,
    /// Its outline.
    pub shape: Shape,
    /// The heading.
    pub title: String,
    /// Smaller text below the heading.
    pub lines: Vec<String>,
    /// Heading and text whole, where they are cut.
    pub whole: Vec<String>,
    /// Its colour.
    pub tone: Tone,
    /// In-ports, top to bottom.
    pub ins: Vec<String>,
    /// Out-ports, top to bottom.
    pub outs: Vec<String>,
}

impl DiagramNode {
    /// A plain box at the top level.
    pub fn new(id: impl Into<String>, title: impl Into<String>) -> Self {
        Self { id: id.into(), title: title.into(), ..Self::default() }
    }
}

/// An edge.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DiagramEdge {
    /// Where it begins: an index into [`Diagram::nodes`].
    pub from: usize,
    /// The out-port it leaves from, an index into the node's [`DiagramNode::outs`].
    pub from_port: Option<usize>,
    /// Where it ends.
    pub to: usize,
    /// The in-port it ends at, an index into the node's [`DiagramNode::ins`].
    pub to_port: Option<usize>,
    /// Lines of text on it.
    pub label: Vec<String>,
    /// That text whole, where it is cut.
    pub whole: Vec<String>,
    /// Whether it is drawn dashed.
    pub dashed: bool,
}

impl DiagramEdge {
    /// A plain edge between two nodes.
    pub fn new(from: usize, to: usize) -> Self {
        Self { from, from_port: None, to, to_port: None, label: Vec::new(), whole: Vec::new(), dashed: false }
    }

    /// Whether it is about ports: it leaves at the side of the out-ports and comes in at that of the in-ports, whichever way it runs.
    pub(super) fn is_of_ports(&self) -> bool {
        self.from_port.is_some() || self.to_port.is_some()
    }
}

/// Nodes and edges with all they look like, but no coordinates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagram {
    /// What it is of.
    pub subject: Subject,
    /// Which way it runs.
    pub direction: RankDirection,
    /// Its name.
    pub title: String,
    /// The nodes; groups stand before what is in them.
    pub nodes: Vec<DiagramNode>,
    /// The edges.
    pub edges: Vec<DiagramEdge>,
    /// What the colours mean, in the order to be shown; empty: nothing to explain.
    pub legend: Vec<(Tone, String)>,
}

impl Diagram {
    /// An empty diagram.
    pub fn new(subject: Subject, direction: RankDirection, title: impl Into<String>) -> Self {
        Self { subject, direction, title: title.into(), nodes: Vec::new(), edges: Vec::new(), legend: Vec::new() }
    }

    /// Adds a node; answers its index.
    pub fn add(&mut self, node: DiagramNode) -> usize {
        debug_assert!(node.parent.is_none_or(|p| p < self.nodes.len()), "groups stand before what is in them");
        self.nodes.push(node);
        self.nodes.len() - 1
    }

    /// The nodes directly in `group` (none: at the top), in order.
    pub fn children(&self, group: Option<usize>) -> impl Iterator<Item = usize> + '_ {
        (0..self.nodes.len()).filter(move |i| self.nodes[*i].parent == group)
    }
}
