//! A diagram as SVG: no script, no font of its own, no outside reference; readable on a light background.

use super::diagram::{Diagram, DiagramNode, RankDirection, Shape, Tone};
use super::layout::{LINE, Layout, LineRun, Rect, Route, SMALL, TITLE, header, layout};
use super::text::{width, xml};
use std::fmt::Write as _;

const MARGIN: f64 = 20.0;

/// Fill, stroke and text of a tone.
fn colours(tone: Tone) -> (&'static str, &'static str, &'static str) {
    match tone {
        Tone::Plain => ("#ffffff", "#5b6b7b", "#1c2733"),
        Tone::Good => ("#e9f6ec", "#3a8f55", "#173f26"),
        Tone::Care => ("#fdf4dc", "#b98212", "#4a3608"),
        Tone::Bad => ("#fdeaea", "#c0403c", "#5c1513"),
        Tone::Quiet => ("#f3f4f6", "#9aa5b1", "#4b5662"),
        Tone::Active => ("#ffe9b8", "#d97706", "#3d2703"),
    }
}

/// The fill of a group at a depth: a little darker with each level, so that boxes in boxes can be told apart.
fn group_fill(depth: usize) -> &'static str {
    ["#f6f8fb", "#edf1f7", "#e4eaf3", "#dbe3ee", "#d2dcea"][depth.min(4)]
}

pub(super) fn write(diagram: &Diagram) -> String {
    let Layout { nodes, routes, size } = layout(diagram);
    let heading = if diagram.title.is_empty() { 0.0 } else { 30.0 };
    let legend = if diagram.legend.is_empty() { 0.0 } else { 30.0 };
    let legend_width: f64 = diagram.legend.iter().map(|(_, t)| width(t, SMALL) + 40.0).sum();
    let w = size.0.max(width(&diagram.title, 16.0) * 1.1).max(legend_width) + 2.0 * MARGIN;
    let h = size.1 + 2.0 * MARGIN + heading + legend;
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w:.0}\" height=\"{h:.0}\" viewBox=\"0 0 {w:.0} {h:.0}\" \
         font-family=\"'DejaVu Sans', Verdana, Helvetica, Arial, sans-serif\" font-size=\"{SMALL}\">"
    );
    let _ = writeln!(out, "<title>{}</title>", xml(&diagram.title));
    let _ = writeln!(
        out,
        "<defs><marker id=\"arrow\" viewBox=\"0 0 10 10\" refX=\"9\" refY=\"5\" markerWidth=\"7\" markerHeight=\"7\" \
         orient=\"auto-start-reverse\"><path d=\"M0,1 L10,5 L0,9 z\" fill=\"#44525f\"/></marker></defs>"
    );
    let _ = writeln!(out, "<rect width=\"{w:.0}\" height=\"{h:.0}\" fill=\"#ffffff\"/>");
    if heading > 0.0 {
        let _ = writeln!(
            out,
            "<text x=\"{MARGIN}\" y=\"{}\" font-size=\"16\" font-weight=\"bold\" fill=\"#1c2733\">{}</text>",
            MARGIN + 10.0,
            xml(&diagram.title)
        );
    }
    let _ = writeln!(out, "<g transform=\"translate({MARGIN},{})\">", MARGIN + heading);
    let mut depth = vec![0usize; diagram.nodes.len()];
    for (i, node) in diagram.nodes.iter().enumerate() {
        depth[i] = node.parent.map_or(0, |p| depth[p] + 1);
        if node.shape == Shape::Group {
            draw_node(&mut out, diagram, i, nodes[i], depth[i]);
        }
    }
    for (edge, route) in diagram.edges.iter().zip(&routes) {
        let dash = if edge.dashed { " stroke-dasharray=\"5 4\"" } else { "" };
        let _ = writeln!(
            out,
            "<path d=\"{}\" fill=\"none\" stroke=\"#44525f\" stroke-width=\"1.3\"{dash} marker-end=\"url(#arrow)\"/>",
            path(route, diagram.direction)
        );
    }
    for (i, node) in diagram.nodes.iter().enumerate() {
        if node.shape == Shape::Group {
            draw_heading(&mut out, node, nodes[i], Some(group_colour(node, depth[i])));
        } else {
            draw_node(&mut out, diagram, i, nodes[i], depth[i]);
            if node.shape != Shape::Dot {
                draw_heading(&mut out, node, nodes[i], None);
            }
        }
    }
    for (edge, route) in diagram.edges.iter().zip(&routes) {
        if let Some(rect) = route.label.filter(|_| !edge.label.is_empty()) {
            hover(&mut out, &edge.whole);
            draw_label(&mut out, &edge.label, rect, route.looped.is_some());
            hover_end(&mut out, &edge.whole);
        }
    }
    out.push_str("</g>\n");
    let mut x = MARGIN;
    for (tone, meaning) in &diagram.legend {
        let (fill, stroke, text) = colours(*tone);
        let y = h - MARGIN - 6.0;
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{:.1}\" width=\"14\" height=\"12\" rx=\"3\" fill=\"{fill}\" stroke=\"{stroke}\"/>\
             <text x=\"{:.1}\" y=\"{y:.1}\" fill=\"{text}\">{}</text>",
            y - 10.0,
            x + 20.0,
            xml(meaning)
        );
        x += width(meaning, SMALL) + 40.0;
    }
    out.push_str("</svg>\n");
    out
}

fn draw_node(out: &mut String, diagram: &Diagram, index: usize, r: Rect, depth: usize) {
    let node: &DiagramNode = &diagram.nodes[index];
    let (fill, stroke, ink) = colours(node.tone);
    let (cx, cy) = r.middle();
    match node.shape {
        Shape::Dot => {
            let _ = writeln!(out, "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"6\" fill=\"#1c2733\"/>");
            return;
        }
        Shape::Connector => {
            let _ = writeln!(
                out,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"{:.1}\" fill=\"{fill}\" \
                 stroke=\"{stroke}\" stroke-dasharray=\"2 2\"/>",
                r.x,
                r.y,
                r.w,
                r.h,
                r.h / 2.0
            );
        }
        Shape::Box | Shape::Group => {
            let group = node.shape == Shape::Group;
            let fill = if group { group_colour(node, depth) } else { fill };
            let wide = if node.tone == Tone::Active { 2.4 } else { 1.2 };
            let _ = writeln!(
                out,
                "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"7\" fill=\"{fill}\" \
                 stroke=\"{stroke}\" stroke-width=\"{wide}\"/>",
                r.x, r.y, r.w, r.h
            );
        }
    }
    if node.ins.is_empty() && node.outs.is_empty() {
        return;
    }
    let top = r.y + header(diagram, index);
    let _ = writeln!(
        out,
        "<path d=\"M{:.1},{:.1} h{:.1}\" stroke=\"{stroke}\" stroke-width=\"0.6\"/>",
        r.x,
        top - 2.0,
        r.w
    );
    for (ports, x, anchor, dot) in
        [(&node.ins, r.x + 9.0, "start", r.x), (&node.outs, r.x + r.w - 9.0, "end", r.x + r.w)]
    {
        for (row, port) in ports.iter().enumerate() {
            #[allow(clippy::cast_precision_loss)]
            let y = top + (row as f64 + 0.5) * LINE;
            let _ = writeln!(
                out,
                "<circle cx=\"{dot:.1}\" cy=\"{y:.1}\" r=\"2.6\" fill=\"#ffffff\" stroke=\"{stroke}\"/>\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" fill=\"{ink}\">{}</text>",
                y + 4.0,
                xml(port)
            );
        }
    }
}

/// Opens what has that text whole where a pointer rests on it.
fn hover(out: &mut String, whole: &[String]) {
    if !whole.is_empty() {
        let _ = writeln!(out, "<g><title>{}</title>", xml(&whole.join(", ")));
    }
}

/// Closes it.
fn hover_end(out: &mut String, whole: &[String]) {
    if !whole.is_empty() {
        out.push_str("</g>\n");
    }
}

/// The text at the top of a node. A group's is drawn over the edges that pass there, with a rim in the group's colour: below
/// it, as a text of its own, since not all readers of SVG know another order of painting.
fn draw_heading(out: &mut String, node: &DiagramNode, r: Rect, rim: Option<&str>) {
    let ink = colours(node.tone).2;
    let cx = r.x + r.w / 2.0;
    let rim = rim.map(|c| format!("fill=\"{c}\" stroke=\"{c}\" stroke-width=\"5\" stroke-linejoin=\"round\""));
    hover(out, &node.whole);
    for paint in rim.into_iter().chain([format!("fill=\"{ink}\"")]) {
        let mut y = r.y + 19.0;
        let _ = writeln!(
            out,
            "<text x=\"{cx:.1}\" y=\"{y:.1}\" font-size=\"{TITLE}\" font-weight=\"bold\" text-anchor=\"middle\" \
             {paint}>{}</text>",
            xml(&node.title)
        );
        for line in &node.lines {
            y += LINE - 2.0;
            let _ =
                writeln!(out, "<text x=\"{cx:.1}\" y=\"{y:.1}\" text-anchor=\"middle\" {paint}>{}</text>", xml(line));
        }
    }
    hover_end(out, &node.whole);
}

/// The fill of a group: its tone's, or that of its depth.
fn group_colour(node: &DiagramNode, depth: usize) -> &'static str {
    if node.tone == Tone::Plain { group_fill(depth) } else { colours(node.tone).0 }
}

fn draw_label(out: &mut String, lines: &[String], r: Rect, beside: bool) {
    let (cx, _) = r.middle();
    let _ = writeln!(
        out,
        "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" rx=\"4\" fill=\"#ffffff\" \
         fill-opacity=\"0.92\"/>",
        r.x, r.y, r.w, r.h
    );
    let (x, anchor) = if beside { (r.x + 5.0, "start") } else { (cx, "middle") };
    for (i, line) in lines.iter().enumerate() {
        #[allow(clippy::cast_precision_loss)]
        let y = r.y + 12.5 + i as f64 * (LINE - 2.0);
        let _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"#2b3a48\">{}</text>",
            xml(line)
        );
    }
}

/// The path of an edge: its runs as straight lines, smooth curves from one to the next.
fn path(route: &Route, direction: RankDirection) -> String {
    let point = |along: f64, across: f64| match direction {
        RankDirection::Right => format!("{along:.1},{across:.1}"),
        RankDirection::Down => format!("{across:.1},{along:.1}"),
    };
    if let Some(r) = route.looped {
        let (x, y) = (r.x + r.w, r.y + r.h / 2.0);
        return format!(
            "M{x:.1},{:.1} C{:.1},{:.1} {:.1},{:.1} {x:.1},{:.1}",
            y - 8.0,
            x + 26.0,
            y - 16.0,
            x + 26.0,
            y + 16.0,
            y + 8.0
        );
    }
    let mut out = String::new();
    let mut before: Option<LineRun> = None;
    for run in &route.runs {
        match before {
            None => {
                let _ = write!(out, "M{}", point(run.from, run.across));
            }
            Some(last) => {
                let (a, b) = (last.to, run.from);
                let distance = (run.across - last.across).abs();
                let pull = if last.heading == run.heading {
                    (b - a).abs() * 0.5
                } else {
                    // Turning round: far enough out to be seen.
                    (distance * 0.4).clamp(10.0, 22.0)
                };
                if distance < 0.05 && last.heading == run.heading {
                    let _ = write!(out, " L{}", point(b, run.across));
                } else {
                    let _ = write!(
                        out,
                        " C{} {} {}",
                        point(a + pull * last.heading, last.across),
                        point(b - pull * run.heading, run.across),
                        point(b, run.across)
                    );
                }
            }
        }
        if (run.to - run.from).abs() > 0.05 {
            let _ = write!(out, " L{}", point(run.to, run.across));
        }
        before = Some(*run);
    }
    out
}
