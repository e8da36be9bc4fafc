//! A composed deployment and the same system written flat by hand give the same plans, step for step: random subsystems of one file.

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

#[test]
fn composed_and_written_flat_the_steps_are_the_same() {
    let names = ["left", "right", "third"];
    for seed in 1..40_u64 {
        let mut chance = Chance(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        let head = |name: &str, keys: &str| format!("davit: 1\nname: {name}\nplatform: simulated\n{keys}{TYPES}{REST}");
        let many = 2 + usize::try_from(chance.below(2)).unwrap();
        let seeds: Vec<u64> = (0..many).map(|_| chance.below(1000) + 1).collect();
        write("c.lua", "return state { idle = state {}, trans { src = \"initial\", tgt = \"idle\" } }");
        let (mut flat, mut ids, mut subsystems) = (String::new(), Vec::new(), String::new());
        for (name, own) in names.iter().zip(&seeds) {
            write(&format!("{name}.lua"), &format!("ConfiguratorConf {{ {} }}", configurations(*own, "")));
            let keys = format!(
                "configurations: [{name}.lua]\nexports: {{ ports: {{ out: C0.a, ref: C1.b }}, properties: {{ k: C1.k }} }}\n"
            );
            write(&format!("{name}.yaml"), &head(name, &keys));
            flat += &configurations(*own, &format!("{name}/"));
            _ = writeln!(subsystems, "  {name}: {{ deployment: {name}.yaml }}");
            ids.extend(["make", "run", "tune"].map(|id| format!("{name}/{id}")));
        }
        let last = names[many - 1];
        let couple = |out: &str, to: &str, k: &str| {
            format!(
                "couple = Configuration {{ connect(\"left{out}\", \"{last}{to}\"), property_set(\"{last}{k}\", 7.0) }},"
            )
        };
        ids.push("couple".to_owned());
        write("whole.lua", &format!("ConfiguratorConf {{ {} }}", couple(".out", ".ref", ".k")));
        write("whole.yaml", &head("whole", &format!("configurations: [whole.lua]\nsubsystems:\n{subsystems}")));
        write("flat.lua", &format!("ConfiguratorConf {{ {flat} {} }}", couple("/C0.a", "/C1.b", "/C1.k")));
        write("flat.yaml", &head("whole", "configurations: [flat.lua]\n"));
        let composed = planned(&folder.path().join("whole.yaml"), &ids);
        assert!(composed.len() > 10, "{seed}: {composed:?}");
        assert_eq!(composed, planned(&folder.path().join("flat.yaml"), &ids), "{seed}");
    }
}
