//! A diagram in Mermaid's language: statecharts as `stateDiagram-v2`, everything else as a flowchart.

use super::diagram::{Diagram, RankDirection, Shape, Subject, Tone};
use std::fmt::Write as _;

pub(super) fn write(diagram: &Diagram) -> String {
    if diagram.subject == Subject::Statechart { statechart(diagram) } else { flowchart(diagram) }
}

fn flowchart(diagram: &Diagram) -> String {
    let mut out = format!("---\ntitle: {}\n---\n", title(&diagram.title));
    out.push_str(match diagram.direction {
        RankDirection::Right => "flowchart LR\n",
        RankDirection::Down => "flowchart TB\n",
    });
    flow_level(&mut out, diagram, None, 1);
    for edge in &diagram.edges {
        let mut label = edge.label.clone();
        let from_port = edge.from_port.and_then(|p| diagram.nodes[edge.from].outs.get(p));
        let to_port = edge.to_port.and_then(|p| diagram.nodes[edge.to].ins.get(p));
        if let (Some(from), Some(to)) = (from_port, to_port) {
            label.insert(0, if from == to { from.clone() } else { format!("{from} → {to}") });
        }
        let arrow = if edge.dashed { "-.->" } else { "-->" };
        if label.is_empty() {
            let _ = writeln!(out, "  n{} {arrow} n{}", edge.from, edge.to);
        } else {
            let _ = writeln!(out, "  n{} {arrow}|\"{}\"| n{}", edge.from, plain(&label.join("\n")), edge.to);
        }
    }
    for (i, node) in diagram.nodes.iter().enumerate() {
        if let Some(style) = style(node.tone) {
            let _ = writeln!(out, "  style n{i} {style}");
        }
    }
    out
}

/// Rows of a box that no edge ends at. Those of edges stand on the edges: a box has no rows here.
fn free_rows(diagram: &Diagram, index: usize) -> impl Iterator<Item = &String> {
    let node = &diagram.nodes[index];
    let taken = |row: usize, out: bool| {
        diagram.edges.iter().any(|edge| match out {
            true => edge.from == index && edge.from_port == Some(row),
            false => edge.to == index && edge.to_port == Some(row),
        })
    };
    let free = move |rows: &'_ [String], out: bool| (0..rows.len()).filter(|row| !taken(*row, out)).collect::<Vec<_>>();
    let (ins, outs) = (free(&node.ins, false), free(&node.outs, true));
    ins.into_iter().map(|row| &node.ins[row]).chain(outs.into_iter().map(|row| &node.outs[row]))
}

fn flow_level(out: &mut String, diagram: &Diagram, group: Option<usize>, depth: usize) {
    let indent = "  ".repeat(depth);
    for index in diagram.children(group) {
        let node = &diagram.nodes[index];
        let lines = std::iter::once(&node.title).chain(&node.lines).chain(free_rows(diagram, index));
        let text = lines.map(|l| plain(l)).collect::<Vec<_>>().join("<br/>");
        if node.shape == Shape::Group && diagram.children(Some(index)).next().is_some() {
            let _ = writeln!(out, "{indent}subgraph n{index} [\"{text}\"]");
            flow_level(out, diagram, Some(index), depth + 1);
            let _ = writeln!(out, "{indent}end");
        } else {
            let _ = writeln!(out, "{indent}n{index}[\"{text}\"]");
        }
    }
}

fn statechart(diagram: &Diagram) -> String {
    let mut out = format!("---\ntitle: {}\n---\nstateDiagram-v2\n", title(&diagram.title));
    state_level(&mut out, diagram, None, 1);
    let mut active = Vec::new();
    for (i, node) in diagram.nodes.iter().enumerate() {
        if node.tone == Tone::Active {
            active.push(format!("n{i}"));
        }
    }
    if !active.is_empty() {
        let _ = writeln!(out, "  classDef active fill:#ffe9b8,stroke:#d97706,stroke-width:2px");
        let _ = writeln!(out, "  class {} active", active.join(","));
    }
    out
}

fn state_level(out: &mut String, diagram: &Diagram, group: Option<usize>, depth: usize) {
    let indent = "  ".repeat(depth);
    for index in diagram.children(group) {
        let node = &diagram.nodes[index];
        match node.shape {
            Shape::Dot => continue,
            Shape::Connector => {
                let _ = writeln!(out, "{indent}state n{index} <<choice>>");
            }
            Shape::Box | Shape::Group => {
                // Of a state with states in it Mermaid takes one label and no description.
                let is_group = diagram.children(Some(index)).next().is_some();
                let lines = if is_group { &node.lines[..] } else { &[] };
                let label: Vec<&str> = std::iter::once(&node.title).chain(lines).map(String::as_str).collect();
                let _ = writeln!(out, "{indent}state \"{}\" as n{index}", plain(&label.join("\n")));
                if is_group {
                    let _ = writeln!(out, "{indent}state n{index} {{");
                    state_level(out, diagram, Some(index), depth + 1);
                    let _ = writeln!(out, "{indent}}}");
                    continue;
                }
                for line in &node.lines {
                    let _ = writeln!(out, "{indent}n{index} : {}", plain(line));
                }
            }
        }
    }
    // A transition stands in the innermost state around both its ends, where Mermaid wants `[*]` to be.
    for edge in diagram.edges.iter().filter(|e| scope(diagram, e.from, e.to) == group) {
        let name = |node: usize| match diagram.nodes[node].shape {
            Shape::Dot => "[*]".to_owned(),
            _ => format!("n{node}"),
        };
        let _ = write!(out, "{indent}{} --> {}", name(edge.from), name(edge.to));
        if edge.label.is_empty() {
            out.push('\n');
        } else {
            let _ = writeln!(out, " : {}", plain(&edge.label.join("\n")));
        }
    }
}

/// The innermost group around two nodes (not one of them).
fn scope(diagram: &Diagram, a: usize, b: usize) -> Option<usize> {
    let chain = |node: usize| {
        let mut chain = Vec::new();
        let mut at = diagram.nodes[node].parent;
        while let Some(group) = at {
            chain.push(group);
            at = diagram.nodes[group].parent;
        }
        chain
    };
    let around = chain(b);
    chain(a).into_iter().find(|group| around.contains(group))
}

fn style(tone: Tone) -> Option<&'static str> {
    Some(match tone {
        Tone::Plain => return None,
        Tone::Good => "fill:#e9f6ec,stroke:#3a8f55",
        Tone::Care => "fill:#fdf4dc,stroke:#b98212",
        Tone::Bad => "fill:#fdeaea,stroke:#c0403c",
        Tone::Quiet => "fill:#f3f4f6,stroke:#9aa5b1",
        Tone::Active => "fill:#ffe9b8,stroke:#d97706,stroke-width:2px",
    })
}

/// The title stands in YAML, where Mermaid reads no codes of characters.
fn title(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Text in which Mermaid sees nothing of its own.
fn plain(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '"' => out.push_str("#quot;"),
            '#' => out.push_str("#35;"),
            '<' => out.push_str("#lt;"),
            '>' => out.push_str("#gt;"),
            ';' => out.push_str("#59;"),
            ':' => out.push_str("#58;"),
            '\n' => out.push_str("<br/>"),
            c => out.push(c),
        }
    }
    out
}
