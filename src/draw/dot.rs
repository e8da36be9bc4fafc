//! A diagram in Graphviz' language; groups become clusters, ports record fields.

use super::diagram::{Diagram, DiagramNode, RankDirection, Shape, Tone};
use std::fmt::Write as _;

pub(super) fn write(diagram: &Diagram) -> String {
    let mut out = String::new();
    let rank = match diagram.direction {
        RankDirection::Right => "LR",
        RankDirection::Down => "TB",
    };
    let _ = writeln!(out, "digraph {} {{", quoted(&diagram.title));
    let _ = writeln!(
        out,
        "  rankdir={rank}; newrank=true; compound=true; fontname=\"Helvetica\"; label={}; labelloc=t;",
        quoted(&diagram.title)
    );
    out.push_str("  node [fontname=\"Helvetica\", fontsize=11, style=\"rounded,filled\", fillcolor=white];\n");
    out.push_str("  edge [fontname=\"Helvetica\", fontsize=10];\n");
    level(&mut out, diagram, None, 1);
    for edge in &diagram.edges {
        let mut attributes = Vec::new();
        if !edge.label.is_empty() {
            attributes.push(format!("label={}", quoted(&edge.label.join("\n"))));
        }
        if edge.dashed {
            attributes.push("style=dashed".to_owned());
        }
        let (from, tail) = anchor(diagram, edge.from);
        let (to, head) = anchor(diagram, edge.to);
        if let Some(cluster) = tail {
            attributes.push(format!("ltail=\"cluster_{cluster}\""));
        }
        if let Some(cluster) = head {
            attributes.push(format!("lhead=\"cluster_{cluster}\""));
        }
        let from_port = edge.from_port.map_or_else(String::new, |p| format!(":o{p}:e"));
        let to_port = edge.to_port.map_or_else(String::new, |p| format!(":i{p}:w"));
        let _ = writeln!(out, "  n{from}{from_port} -> n{to}{to_port} [{}];", attributes.join(", "));
    }
    out.push_str("}\n");
    out
}

/// The node an edge of `index` is tied to: itself, or for a cluster something in it and the cluster.
fn anchor(diagram: &Diagram, index: usize) -> (usize, Option<usize>) {
    let mut at = index;
    while diagram.nodes[at].shape == Shape::Group
        && let Some(child) = diagram.children(Some(at)).next()
    {
        at = child;
    }
    (at, (at != index).then_some(index))
}

fn level(out: &mut String, diagram: &Diagram, group: Option<usize>, depth: usize) {
    let indent = "  ".repeat(depth);
    for index in diagram.children(group) {
        let node = &diagram.nodes[index];
        if node.shape == Shape::Group && diagram.children(Some(index)).next().is_some() {
            let _ = writeln!(out, "{indent}subgraph \"cluster_{index}\" {{");
            let _ = writeln!(
                out,
                "{indent}  label={}; style=\"rounded,filled\"; fillcolor=\"{}\";",
                quoted(&heading(node)),
                fill(node.tone, depth)
            );
            level(out, diagram, Some(index), depth + 1);
            let _ = writeln!(out, "{indent}}}");
            continue;
        }
        let look = match node.shape {
            Shape::Dot => "shape=circle, width=0.15, label=\"\", fillcolor=black".to_owned(),
            Shape::Connector => format!("shape=diamond, label={}", quoted(&node.title)),
            Shape::Box | Shape::Group if node.ins.is_empty() && node.outs.is_empty() => {
                format!("shape=box, label={}, fillcolor=\"{}\"", quoted(&heading(node)), fill(node.tone, 0))
            }
            Shape::Box | Shape::Group => {
                let ports = |side: &str, names: &[String]| {
                    names
                        .iter()
                        .enumerate()
                        .map(|(i, n)| format!("<{side}{i}> {}", field(n)))
                        .collect::<Vec<_>>()
                        .join("|")
                };
                let label = format!(
                    "{}|{{{{{}}}|{{{}}}}}",
                    field(&heading(node)),
                    ports("i", &node.ins),
                    ports("o", &node.outs)
                );
                format!("shape=record, label=\"{{{label}}}\", fillcolor=\"{}\"", fill(node.tone, 0))
            }
        };
        let _ = writeln!(out, "{indent}n{index} [{look}];");
    }
}

fn heading(node: &DiagramNode) -> String {
    std::iter::once(&node.title).chain(&node.lines).cloned().collect::<Vec<_>>().join("\n")
}

fn fill(tone: Tone, depth: usize) -> &'static str {
    match tone {
        Tone::Plain if depth > 0 => "#f3f6fa",
        Tone::Plain => "#ffffff",
        Tone::Good => "#e9f6ec",
        Tone::Care => "#fdf4dc",
        Tone::Bad => "#fdeaea",
        Tone::Quiet => "#f3f4f6",
        Tone::Active => "#ffe9b8",
    }
}

/// A quoted string of the language.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}

/// Text of a record's field.
fn field(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\n' => out.push_str("\\n"),
            '{' | '}' | '|' | '<' | '>' | '"' | '\\' | ' ' => {
                out.push('\\');
                out.push(c);
            }
            c => out.push(c),
        }
    }
    out
}
