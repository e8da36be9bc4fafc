//! Pictures of components: each connection begins at its own out-port, ends with its arrowhead at its own in-port, and runs beside the
//! boxes; those that run backwards, too.

use davit::app::drive;
use davit::draw::diagram::{Diagram, DiagramEdge, DiagramNode, RankDirection, Shape, Subject};
use davit::draw::layout::{LINE, Rect, header, layout};
use davit::draw::{ComponentsView, components};
use davit::{LoadOptions, Until, builtin, read};
use std::path::Path;

type Point = (f64, f64);

/// The points of a path as it is written, curves in small steps.
fn points(path: &str) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    let mut numbers: Vec<Point> = Vec::new();
    let mut command = ' ';
    for word in path.split_whitespace() {
        let point = word.trim_start_matches(['M', 'L', 'C']);
        if point.len() < word.len() {
            command = word.chars().next().unwrap();
        }
        let (x, y) = point.split_once(',').unwrap_or_else(|| panic!("{word} in {path}"));
        numbers.push((x.parse().unwrap(), y.parse().unwrap()));
        match (command, &numbers[..]) {
            ('M' | 'L', [to]) => out.push(*to),
            ('C', [b, c, d]) => {
                let a = *out.last().unwrap();
                out.extend((1..=24).map(|step| {
                    let t = f64::from(step) / 24.0;
                    let u = 1.0 - t;
                    let at = |f: fn(&Point) -> f64| {
                        u * u * u * f(&a) + 3.0 * u * u * t * f(b) + 3.0 * u * t * t * f(c) + t * t * t * f(d)
                    };
                    (at(|p| p.0), at(|p| p.1))
                }));
            }
            _ => continue,
        }
        numbers.clear();
    }
    out
}

/// Whether the way from one point to the next one comes behind a box.
fn behind(a: Point, b: Point, r: &Rect) -> bool {
    (0..=8).any(|step| {
        let t = f64::from(step) / 8.0;
        let (x, y) = (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t);
        x > r.x + 1.5 && x < r.x + r.w - 1.5 && y > r.y + 1.5 && y < r.y + r.h - 1.5
    })
}

/// What is wrong with how the connections of a diagram are drawn.
fn wrong(diagram: &Diagram) -> Vec<String> {
    let laid = layout(diagram);
    let svg = diagram.svg();
    let paths: Vec<&str> = (svg.lines())
        .filter(|line| line.contains("marker-end"))
        .map(|line| line.strip_prefix("<path d=\"").unwrap().split_once('"').unwrap().0)
        .collect();
    assert_eq!(paths.len(), diagram.edges.len());
    let mut wrong = Vec::new();
    for (edge, path) in diagram.edges.iter().zip(paths) {
        let (from, to) = (&diagram.nodes[edge.from], &diagram.nodes[edge.to]);
        let names = format!("{} {:?} -> {} {:?}", from.id, edge.from_port, to.id, edge.to_port);
        let row = |node: usize, port: usize| laid.nodes[node].y + header(diagram, node) + (port as f64 + 0.5) * LINE;
        let way = points(path);
        let (first, last) = (way[0], way[way.len() - 1]);
        let near = |a: Point, b: Point| (a.0 - b.0).abs() < 0.2 && (a.1 - b.1).abs() < 0.2;
        let out = laid.nodes[edge.from].x + laid.nodes[edge.from].w;
        let begins = edge.from_port.map_or((out, first.1), |port| (out, row(edge.from, port)));
        if !near(first, begins) || way[1].0 < first.0 {
            wrong.push(format!("{names} begins at {first:?}, not at {begins:?}"));
        }
        let ends = edge.to_port.map_or(last, |port| (laid.nodes[edge.to].x, row(edge.to, port)));
        if !near(last, ends) || way[way.len() - 2].0 > last.0 {
            wrong.push(format!("{names} ends at {last:?}, not at {ends:?}"));
        }
        for (at, node) in diagram.nodes.iter().enumerate().filter(|(_, node)| node.shape != Shape::Group) {
            if way.windows(2).any(|pair| behind(pair[0], pair[1], &laid.nodes[at])) {
                wrong.push(format!("{names} runs behind {}", node.id));
            }
        }
    }
    wrong
}

#[test]
fn connections_of_what_is_shipped_end_at_their_ports() {
    let mut backwards = 0;
    for file in [
        "deployments/hello.yaml",
        "deployments/generic_arm.yaml",
        "deployments/youbot_arm.yaml",
        "deployments/youbot_arm_scoped.yaml",
        "deployments/youbot_robot.yaml",
        "deployments/youbot_coupling.yaml",
        "examples/pair/robot.yaml",
        "examples/pair/pair.yaml",
        "examples/side_by_side/deployment.yaml",
    ] {
        let read = read(Path::new(file), &LoadOptions::default(), builtin()).unwrap_or_else(|_| panic!("{file}"));
        let (drive, _) = drive(&read, Until::Up).unwrap_or_else(|found| panic!("{file}: {found:?}"));
        for depth in [None, Some(0)] {
            let view = ComponentsView { inside: None, depth };
            let diagram = components(file, &drive.system, &read.catalogue, &read.deployment.monitors, view);
            let laid = layout(&diagram);
            let end = |rect: &Rect| rect.x + rect.w;
            backwards += diagram.edges.iter().filter(|e| end(&laid.nodes[e.from]) > laid.nodes[e.to].x).count();
            assert_eq!(wrong(&diagram), Vec::<String>::new(), "{file}");
        }
    }
    assert!(backwards > 10, "{backwards}");
}

/// A diagram from a seed: boxes with ports, some of them in groups in groups, and connections from any to any.
fn diagram(seed: u64) -> Diagram {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 33) as usize % n
    };
    let mut diagram = Diagram::new(Subject::Components, RankDirection::Right, "seeded");
    for i in 0..next(4) {
        let mut group = DiagramNode::new(format!("g{i}"), "x".repeat(1 + next(30)));
        group.shape = Shape::Group;
        group.parent = Some(next(i + 1)).filter(|parent| *parent < i);
        diagram.add(group);
    }
    let (groups, count) = (diagram.nodes.len(), 2 + next(9));
    for i in 0..count {
        let mut node = DiagramNode::new(format!("n{i}"), "x".repeat(1 + next(14)));
        node.parent = Some(next(groups + 1)).filter(|parent| *parent < groups);
        node.lines = vec!["type".to_owned()];
        node.ins = (0..1 + next(4)).map(|port| format!("in{port}")).collect();
        node.outs = (0..1 + next(4)).map(|port| format!("out{port}")).collect();
        diagram.add(node);
    }
    for _ in 0..1 + next(2 * count) {
        let (from, to) = (groups + next(count), groups + next(count));
        let mut edge = DiagramEdge::new(from, to);
        // A monitor watches a box whose in-port it looks at.
        edge.from_port = Some(next(diagram.nodes[from].outs.len())).filter(|_| next(8) > 0);
        edge.to_port = Some(next(diagram.nodes[to].ins.len()));
        edge.label = (0..next(6) / 4).map(|_| "buffer(64)".to_owned()).collect();
        diagram.edges.push(edge);
    }
    diagram
}

#[test]
fn connections_between_any_boxes_end_at_their_ports() {
    for seed in 0..600 {
        assert_eq!(wrong(&diagram(seed)), Vec::<String>::new(), "seed {seed}");
    }
}
