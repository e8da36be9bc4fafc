//! A diagram in Graphviz' language; groups become clusters, ports record fields.

use super::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Shape, Tone};
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
    for (at, edge) in diagram.edges.iter().enumerate() {
        let mut attributes = Vec::new();
        if !edge.label.is_empty() {
            attributes.push(format!("label={}", quoted(&edge.label.join("\n"))));
        }
        if edge.dashed {
            attributes.push("style=dashed".to_owned());
        }
        let (from, tail) = anchor(diagram, edge.from);
        let (to, head) = anchor(diagram, edge.to);
        let tail = tail.map(|cluster| format!("ltail=\"cluster_{cluster}\""));
        let head = head.map(|cluster| format!("lhead=\"cluster_{cluster}\""));
        if bends(diagram, edge).is_some() {
            let out_of: Vec<String> =
                attributes.iter().cloned().chain(tail).chain(["arrowhead=none".to_owned()]).collect();
            let into: Vec<String> = edge.dashed.then(|| "style=dashed".to_owned()).into_iter().chain(head).collect();
            let _ = writeln!(out, "  n{from} -> b{at} [{}];", out_of.join(", "));
            let _ = writeln!(out, "  b{at} -> n{to} [{}];", into.join(", "));
            continue;
        }
        attributes.extend(tail.into_iter().chain(head));
        let from_port = edge.from_port.map_or_else(String::new, |p| format!(":o{p}:e"));
        let to_port = edge.to_port.map_or_else(String::new, |p| format!(":i{p}:w"));
        let _ = writeln!(out, "  n{from}{from_port} -> n{to}{to_port} [{}];", attributes.join(", "));
    }
    out.push_str("}\n");
    out
}

/// The cluster that an edge leads from, or to, and whose other end is inside of it: Graphviz draws no such edge, so it goes by a point beside that
/// cluster.
fn bends(diagram: &Diagram, edge: &DiagramEdge) -> Option<usize> {
    let is_inside = |node: usize, cluster: usize| {
        std::iter::successors(Some(node), |at| diagram.nodes[*at].parent).any(|at| at == cluster)
    };
    let is_cluster = |node: usize| anchor(diagram, node).1.is_some();
    let (from, to) = (edge.from, edge.to);
    let out_of = Some(from).filter(|from| is_cluster(*from) && is_inside(to, *from));
    out_of.or(Some(to).filter(|to| is_cluster(*to) && is_inside(from, *to)))
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
            for (at, _) in diagram.edges.iter().enumerate().filter(|(_, edge)| bends(diagram, edge) == Some(index)) {
                let _ = writeln!(out, "{indent}b{at} [shape=point, width=0.02];");
            }
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
                // In-ports stand on the side that arrows come from.
                let sides = [("i", &node.ins), ("o", &node.outs)].map(|(side, names)| match names.is_empty() {
                    true => String::new(),
                    false => format!("{{{}}}", ports(side, names)),
                });
                let [ins, outs] = sides;
                let all = [ins, field(&heading(node)), outs];
                let label = all.into_iter().filter(|field| !field.is_empty()).collect::<Vec<_>>().join("|");
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
