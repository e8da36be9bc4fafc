//! Loading a chain of N components with N connections from text: what a file costs, per entry.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use davit::lang::{self, LoadOptions, Sources};
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;

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

fn load(criterion: &mut Criterion) {
    for (language, file) in [("lua", "chain.lua"), ("yaml", "chain.yaml")] {
        let mut group = criterion.benchmark_group(format!("load/{language}"));
        group.sample_size(10);
        for n in [10, 100, 1_000, 10_000] {
            let sources = Sources::memory([(file, chain(n, language == "lua"))]);
            group.throughput(Throughput::Elements(2 * n as u64));
            group.bench_with_input(BenchmarkId::from_parameter(n), &sources, |bencher, sources| {
                bencher.iter(|| {
                    let loaded = lang::load_configurations(sources, Path::new(file), &LoadOptions::default());
                    assert_eq!(loaded.configurations[0].changes.len(), 2 * n);
                    black_box(loaded)
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, load);
criterion_main!(benches);
