//! A hub and n modes, each of which a state brings with it and each of whose undos may fail; and several coordinators of them beside
//! each other that have nothing to do with each other.

use std::fmt::Write;
use std::path::{Path, PathBuf};

fn coordinator(number: usize, n: usize) -> String {
    let (base, mut up) = (format!("base{number}"), String::new());
    for i in 0..n {
        let _ = writeln!(
            up,
            "m{i} = state {{ config = 's{number}_{i}' }}, trans {{ src = 'hub', tgt = 'm{i}', events = {{ 'e{number}_{i}' }} }},
             trans {{ src = 'm{i}', tgt = 'hub', events = {{ 'e{number}_back', 's{number}_{i}.failed', 's{number}_{i}.broken' }} }},"
        );
    }
    format!(
        "return state {{ idle = state {{}}, starting = state {{ entry = '{base}' }},
         up = state {{ hub = state {{}}, trans {{ src = 'initial', tgt = 'hub' }}, {up} }},
         leaving = state {{ entry = '{base}.undo' }}, again = state {{ entry = '{base}.undo' }},
         trans {{ src = 'initial', tgt = 'idle' }},
         trans {{ src = 'idle', tgt = 'starting', events = {{ 'e_start' }} }},
         trans {{ src = 'starting', tgt = 'up', events = {{ '{base}.ok' }} }},
         trans {{ src = 'starting', tgt = 'idle', events = {{ '{base}.failed' }} }},
         trans {{ src = 'starting', tgt = 'leaving', events = {{ 'e_stop', '{base}.broken' }} }},
         trans {{ src = 'up', tgt = 'leaving', events = {{ 'e_stop' }} }},
         trans {{ src = 'leaving', tgt = 'idle', events = {{ '{base}.undone' }} }},
         trans {{ src = 'leaving', tgt = 'again', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'leaving', events = {{ '{base}.undo.failed', '{base}.undo.broken' }} }},
         trans {{ src = 'again', tgt = 'idle', events = {{ '{base}.undone' }} }} }}"
    )
}

/// So many coordinators with so many modes each.
pub fn write(folder: &Path, coordinators: usize, n: usize) -> PathBuf {
    let mut configurations = String::from("ConfiguratorConf {\n");
    let mut names = Vec::new();
    for number in 0..coordinators {
        let of = |text: &dyn Fn(usize) -> String| (0..n).map(text).collect::<Vec<_>>().join(", ");
        let creates = of(&|i| format!("create('c{number}_{i}', 'G')"));
        let states = of(&|i| format!("'c{number}_{i}:running'"));
        let _ =
            writeln!(configurations, "base{number} = Configuration {{ {creates}, post_conf_state = {{ {states} }} }},");
        for i in 0..n {
            let _ =
                writeln!(configurations, "s{number}_{i} = Configuration {{ property_set('c{number}_{i}.k', 1.0) }},");
        }
        std::fs::write(folder.join(format!("k{number}.lua")), coordinator(number, n)).expect("a folder of ours");
        names.push(format!("k{number}"));
    }
    configurations.push('}');
    std::fs::write(folder.join("c.lua"), configurations).expect("a folder of ours");
    let of = |text: &dyn Fn(&String) -> String| names.iter().map(text).collect::<Vec<_>>().join(", ");
    let deployment = format!(
        "davit: 1\nname: family\nplatform: simulated\n\
         types: {{ G: {{ properties: {{ k: {{ type: float, default: 0.0 }} }} }} }}\nconfigurations: [c.lua]\n\
         coordinators: {{ {} }}\ndeploy: {{ event: e_start, up: [{}], within_s: 5 }}\n\
         shutdown: {{ event: e_stop, down: [{}], within_s: 5 }}\n",
        of(&|name| format!("{name}: {name}.lua")),
        of(&|name| format!("{name}:up")),
        of(&|name| format!("{name}:idle")),
    );
    let file = folder.join("family.yaml");
    std::fs::write(&file, deployment).expect("a folder of ours");
    file
}
