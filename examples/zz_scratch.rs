use davit::lang::{self, LoadOptions, Sources};
use std::fmt::Write as _;
fn chain(n: usize, lua: bool) -> String {
    let mut out = String::new();
    if lua {
        out.push_str("ConfiguratorConf {\n  up = Configuration {\n");
        for i in 0..n {
            _ = writeln!(out, "    create(\"C{i}\", \"standard.Gain\", {{ properties = {{ k = 1.5 }} }}),");
            _ = writeln!(out, "    connect(\"C{i}.y\", \"C{}.u\"),", i + 1);
        }
        out.push_str("    post_conf_state = { \"_default:running\" },\n  },\n}\n");
    } else {
        out.push_str("configurations:\n  up:\n    changes:\n");
        for i in 0..n {
            _ = writeln!(out, "      - create: {{ component: C{i}, type: standard.Gain, properties: {{ k: 1.5 }} }}");
            _ = writeln!(out, "      - connect: {{ from: C{i}.y, to: C{}.u }}", i + 1);
        }
        out.push_str("    post_conf_state: [\"_default:running\"]\n");
    }
    out
}
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/schedstat").unwrap();
    s.split(' ').next().unwrap().parse::<f64>().unwrap() / 1e9
}
fn main() {
    for (file, lua) in [("c.lua", true), ("c.yaml", false)] {
        for n in [10, 1000, 10_000] {
            let sources = Sources::memory([(file, chain(n, lua))]);
            let reps = 200_000 / n.max(100);
            let t = cpu();
            for _ in 0..reps {
                std::hint::black_box(lang::load_configurations(&sources, std::path::Path::new(file), &LoadOptions::default()));
            }
            let per = (cpu() - t) / reps as f64;
            println!("{file} n={n}: {:.1} us per load, {:.3} us per entry", per * 1e6, per * 1e6 / (2 * n) as f64);
        }
    }
}
