//! A composed deployment and the same system written flat by hand give the same plans, step for step: random subsystems, of up to three levels.

use davit::app;
use davit::lang::LoadOptions;
use davit::libraries;
use std::fmt::Write as _;
use std::path::Path;

const TYPES: &str = "types:
  T:
    ports: { a: { direction: out, type: float }, b: { direction: in, type: float } }
    properties: { k: { type: float, default: 1.0 }, m: { type: float, default: 0.0, tunable: stopped } }
    operations: { open: { effect: { undo: close } }, close: { effect: { undo: open } } }
";
const REST: &str = "coordinator: c.lua
deploy: { event: e_start, up: idle, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";

struct Chance(u64);

impl Chance {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % n
    }
}

/// The configurations of one file, every name with this before it; the same seed gives the same.
fn configurations(seed: u64, before: &str) -> String {
    let mut chance = Chance(seed | 1);
    let components = 2 + chance.below(3);
    let id = |name: &str| format!("[\"{before}{name}\"] = Configuration");
    let mut text = format!("{} {{ ", id("make"));
    for at in 0..components {
        _ = write!(text, "create(\"{before}C{at}\", \"T\"), ");
        if chance.below(2) == 0 {
            _ = write!(text, "property_set(\"{before}C{at}.k\", {}.5), ", chance.below(9));
        }
    }
    for to in 2..components {
        let from = chance.below(components);
        let policy = if chance.below(2) == 0 { ", { buffer = 4 }" } else { "" };
        _ = write!(text, "connect(\"{before}C{from}.a\", \"{before}C{to}.b\"{policy}), ");
    }
    let first = chance.below(components);
    _ = writeln!(text, "post_conf_state = {{ \"{before}C{first}:stopped\", \"_default:stopped\" }} }},");
    _ = writeln!(text, "{} {{ post_conf_state = {{ \"_default:running\" }} }},", id("run"));
    let (one, value) = (chance.below(components), chance.below(9));
    _ = writeln!(
        text,
        "{} {{ pre_conf_state = {{ \"{before}C{one}:stopped\" }}, property_set(\"{before}C{one}.m\", {value}.0), \
         operation_call(\"{before}C{one}.open\"), post_conf_state = {{ \"_default:running\" }} }},",
        id("tune")
    );
    text
}

/// The steps of these configurations, one after the other, as `davit plan` has them.
pub fn planned(file: &Path, ids: &[String]) -> Vec<String> {
    let name = file.display();
    let read = app::read(file, &LoadOptions::default(), libraries::builtin());
    let read = read.unwrap_or_else(|refused| panic!("{name}: {:#?}", refused.findings));
    let applications = app::plan(&read, ids).unwrap_or_else(|findings| panic!("{name}: {findings:#?}"));
    let steps = applications.iter().flat_map(|application| &application.steps);
    steps.map(|planned| format!("{} undone by {:?}", planned.step, planned.undo)).collect()
}

fn head(name: &str, keys: &str) -> String {
    format!("davit: 1\nname: {name}\nplatform: simulated\n{keys}{TYPES}{REST}")
}

/// What the files of the part at `path` are called.
fn stem(path: &str) -> String {
    if path.is_empty() { "whole".to_owned() } else { format!("of_{}", path.trim_end_matches('/').replace('/', "_")) }
}

/// A file of the composition as its parent sees it, and what it is when the whole is written flat.
struct Part {
    /// What is exported: an out-port, an in-port and a property, by the names they have in the whole.
    exported: [String; 3],
    flat: String,
    /// In the order in which they are planned.
    ids: Vec<String>,
}

/// Writes the files of a part and of all that is below it; `path` is where it is in the whole, with a slash behind it.
fn part(folder: &Path, chance: &mut Chance, path: &str, levels: u64) -> Part {
    let stem = stem(path);
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let own = chance.below(1000) + 1;
    let (mut text, mut flat) = (configurations(own, ""), configurations(own, path));
    let (mut ids, mut subsystems, mut below) = (Vec::new(), String::new(), Vec::new());
    // The whole has two at least; what is farther down one, two or none.
    let many = match levels {
        0 => 0,
        _ if path.is_empty() => 2 + chance.below(2),
        _ => chance.below(3),
    };
    for name in ["left", "right", "third"].into_iter().take(usize::try_from(many).unwrap()) {
        let child = part(folder, chance, &format!("{path}{name}/"), levels - 1);
        flat += &child.flat;
        ids.extend(child.ids);
        _ = writeln!(subsystems, "  {name}: {{ deployment: {}.yaml }}", self::stem(&format!("{path}{name}/")));
        below.push((name, child.exported));
    }
    ids.extend(["make", "run", "tune"].map(|id| format!("{path}{id}")));
    let mut exported = ["C0.a", "C1.b", "C1.k"].map(|own| (own.to_owned(), format!("{path}{own}")));
    if let (Some((first, out)), Some((last, to))) = (below.first(), below.last()) {
        let couple = |id: &str, out: &str, to: &str, k: &str| {
            format!("[\"{id}\"] = Configuration {{ connect(\"{out}\", \"{to}\"), property_set(\"{k}\", 7.0) }},")
        };
        text += &couple("couple", &format!("{first}.out"), &format!("{last}.ref"), &format!("{last}.k"));
        flat += &couple(&format!("{path}couple"), &out[0], &to[1], &to[2]);
        ids.push(format!("{path}couple"));
        // What is exported is its own, or handed on.
        for (at, name) in ["out", "ref", "k"].into_iter().enumerate() {
            // An in-port is driven once.
            let is_free = name != "ref" || below.len() > 1;
            if chance.below(2) == 0 && is_free {
                exported[at] = (format!("{first}.{name}"), out[at].clone());
            }
        }
    }
    let [out, to, k] = exported.each_ref().map(|(own, _)| own);
    let mut keys = format!(
        "configurations: [{stem}.lua]\nexports: {{ ports: {{ out: {out}, ref: {to} }}, properties: {{ k: {k} }} }}\n"
    );
    if !below.is_empty() {
        _ = write!(keys, "subsystems:\n{subsystems}");
    }
    write(&format!("{stem}.lua"), &format!("ConfiguratorConf {{ {text} }}"));
    write(&format!("{stem}.yaml"), &head(&stem, &keys));
    Part { exported: exported.map(|(_, whole)| whole), flat, ids }
}

#[test]
fn composed_and_written_flat_the_steps_are_the_same() {
    let (mut three_levels, mut handed_on) = (0, 0);
    for seed in 1..60_u64 {
        let mut chance = Chance(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("c.lua", "return state { idle = state {}, trans { src = \"initial\", tgt = \"idle\" } }");
        let whole = part(folder.path(), &mut chance, "", 1 + seed % 3);
        write("flat.lua", &format!("ConfiguratorConf {{ {} }}", whole.flat));
        write("flat.yaml", &head("whole", "configurations: [flat.lua]\n"));
        let composed = planned(&folder.path().join("whole.yaml"), &whole.ids);
        assert!(composed.len() > 10, "{seed}: {composed:?}");
        assert_eq!(composed, planned(&folder.path().join("flat.yaml"), &whole.ids), "{seed}");
        three_levels += u32::from(whole.ids.iter().any(|id| id.matches('/').count() == 3));
        handed_on += u32::from(whole.exported.iter().any(|name| name.contains('/')));
    }
    assert!(three_levels > 10 && handed_on > 10, "{three_levels} {handed_on}");
}
