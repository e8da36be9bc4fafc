//! `davit monitor`: events and table over a recording, their JSON, and what is said of a recording that is not right.

use crate::demo::Demo;
use serde_json::Value;
use snapbox::{assert_data_eq, str};

const MONITORS: &str = r#"
Monitors {
  aligned = monitor { when = below("Dynamics.f_raw_norm", 2.0):for_at_least(0.3), event = "e_aligned" },
  misaligned = monitor {
    when = above("Dynamics.f_raw_norm", 8.0):for_at_least(0.1), event = "e_misaligned", cleared = "e_calm",
  },
  lost = monitor { when = silent("Link.stats", 0.5), event = "e_lost", enabled = false },
}
"#;

const SAMPLES: &str = "\
time,Dynamics.f_raw_norm,Link.stats,unused
0,9.5,1,a
0.1,9.0,,b
0.2,1.5,1,
0.45,1,,
0.6,3,1,
2,0.5,,
";

fn demo(samples: &str) -> Demo {
    let demo = Demo::new();
    demo.write("m.lua", MONITORS);
    demo.write("s.csv", samples);
    demo
}

#[test]
fn events_and_table() {
    let demo = demo(SAMPLES);
    let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert_data_eq!(
        &ran.out,
        str![[r#"
           0.1 s  e_misaligned  misaligned, robustness 1
           0.2 s  e_calm  misaligned, robustness -6.5
           0.5 s  e_aligned  aligned, robustness 0.5
monitor     became true  true for  least robustness  greatest
aligned     1            0.1 s     -7.5 at 0.3 s     0.5 at 0.5 s
misaligned  1            0.1 s     -7.5 at 2 s       1 at 0.1 s
lost (off)  0            0 s       –                 –

"#]]
    );
    assert!(ran.err.contains("samples::unused") && ran.err.contains("`unused`"), "{}", ran.err);
    let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv", "--only", "lost"]);
    assert!(ran.out.contains("1.100000001 s  e_lost"), "{}", ran.out);
}

/// The worked example of the chapter is what the program prints.
#[test]
fn the_chapter_shows_what_is_printed() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let chapter = std::fs::read_to_string(root.join("docs/monitors.md")).unwrap();
    for file in ["first", "tuned"] {
        let command = format!("davit monitor examples/monitors/{file}.lua --samples examples/monitors/contact.csv");
        let args: Vec<&str> = command.split(' ').skip(1).collect();
        let ran = crate::demo::at_home(&args);
        assert_eq!(ran.code, 0, "{}", ran.err);
        assert!(chapter.contains(&format!("$ {command}\n{}```", ran.out)), "{}", ran.out);
    }
}

#[test]
fn json_is_one_object_a_line() {
    let demo = demo(SAMPLES);
    let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv", "--json"]);
    let lines: Vec<Value> = ran.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 4);
    assert_eq!(lines[2]["event"], "e_aligned");
    assert_eq!(lines[2]["time_ns"], 500_000_000);
    assert_eq!(lines[2]["robustness"], 0.5);
    let table = &lines[3];
    assert_eq!(table["ok"], true);
    assert_eq!(table["monitors"][1]["became_true"], 1);
    assert_eq!(table["monitors"][0]["least"]["robustness"], -7.5);
    assert_eq!(table["lines"], 6);
    assert_eq!(table["findings"][0]["code"], "samples::unused");
}

#[test]
fn the_file_of_the_logger_is_read_with_its_columns_named() {
    let demo = demo("time,u1,u2,u3,u4,u5,u6,u7,u8\n0,9,,,,,,,\n0.1,9,,,,,,,\n0.3,NaN,,,,,,,\n");
    let args = ["monitor", "m.lua", "--samples", "s.csv", "--only", "misaligned"];
    let ran = demo.run(&[&args[..], &["--column", "Dynamics.f_raw_norm=u1"]].concat());
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.out.contains("0.1 s  e_misaligned") && ran.out.contains("0.3 s  e_calm"), "{}", ran.out);
    assert!(ran.err.contains("samples::nan"), "{}", ran.err);
    assert!(ran.err.contains("samples that are NaN: 1, the first in column `u1` at 0.3 s"), "{}", ran.err);
}

#[test]
fn what_column_names_must_be_there() {
    let demo = demo("time,Dynamics.f_raw_norm,u1\n0,9,\n0.1,9,\n");
    let run = |column: &str| demo.run(&["monitor", "m.lua", "--samples", "s.csv", "--column", column]);
    for (column, wrong, near) in [
        ("Dynamics.f_raw_norn=u1", "no monitor looks at `Dynamics.f_raw_norn`", "`Dynamics.f_raw_norm`"),
        ("Dynamics.f_raw_norm=u2", "the recording has no column `u2`", "`u1`"),
    ] {
        let ran = run(column);
        assert_eq!(ran.code, 1, "{column}: {}", ran.out);
        assert!(ran.err.contains(wrong) && ran.err.contains(near), "{column}: {}", ran.err);
        assert_eq!(
            ran.err.matches("samples::").count(),
            ran.err.matches("samples::renamed").count() + usize::from(ran.err.contains("samples::unused")),
            "{}",
            ran.err
        );
    }
    // `lost` is not enabled, so nobody misses its column; asked for, it is missed.
    assert_eq!(run("Dynamics.f_raw_norm=u1").code, 0);
    let asked = demo.run(&["monitor", "m.lua", "--samples", "s.csv", "--only", "lost", "--json"]);
    assert_eq!(asked.code, 1);
    assert_eq!(asked.out.lines().count(), 1, "also a refusal is one object a line: {}", asked.out);
    assert_eq!(asked.json()["findings"][0]["code"], "samples::missing");
}

#[test]
fn merging_and_times_that_are_no_seconds_are_told() {
    let mut samples = "time,A.x\n".to_owned();
    for i in 0..6000 {
        samples.push_str(&format!("{}.{:03},{}\n", i / 1000, i % 1000, -i));
    }
    let demo = demo(&samples);
    demo.write(
        "m.lua",
        "Monitors { high = monitor { when = above('A.x', 0):within_last(10), event = 'e' },
                    still = monitor { when = above('A.x', 0), repeat_every = 1 } }",
    );
    let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv"]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.err.contains("samples::merged") && ran.err.contains("`high`:"), "{}", ran.err);
    assert!(ran.err.contains("monitor::nothing_repeated"), "{}", ran.err);
    demo.write("s.csv", "time,A.x\n1732200000000000000,1\n");
    let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv"]);
    assert_eq!(ran.code, 1);
    assert!(ran.err.contains("nanoseconds"), "{}", ran.err);
}

#[test]
fn a_deployment_names_its_monitors() {
    let demo = demo("time,gain.y\n0,1\n1,5\n");
    demo.write("k.yaml", "monitors: { high: { when: { above: [gain.y, 2] }, event: e_high } }");
    let text = std::fs::read_to_string(demo.path("deployment.yaml")).unwrap();
    demo.write("with.yaml", &format!("{text}\nmonitors: [k.yaml]\n"));
    let ran = demo.run(&["monitor", "with.yaml", "--samples", "s.csv"]);
    assert!(ran.code == 0 && ran.out.contains("1 s  e_high"), "{}{}", ran.out, ran.err);
}

#[test]
fn what_is_wrong_with_a_recording_has_its_place() {
    let header = "time,Dynamics.f_raw_norm,Link.stats\n";
    for (samples, code, line, column, hint) in [
        ("".to_owned(), "samples::empty", 1, 1, "first line"),
        (header.to_owned(), "samples::empty", 1, 1, "holds the samples"),
        ("t,a\n".to_owned(), "samples::columns", 1, 1, "`time`"),
        ("time;Dynamics.f_raw_norm\n".to_owned(), "samples::columns", 1, 1, "commas"),
        ("time,Dynamics.f_norm,Link.stats\n0,1,1\n".to_owned(), "samples::missing", 1, 6, "`Dynamics.f_norm`"),
        (format!("{header}0,1,1\n0.1,1x,1\n"), "samples::bad_number", 3, 5, "number"),
        (format!("{header}0,1,1\n\n0.1 s,1,1\n"), "samples::bad_time", 4, 1, "seconds"),
        (format!("{header}0,1,1\n,1,1\n"), "samples::bad_time", 3, 1, "seconds"),
        (format!("{header}0.2,1,1\n0.1,1,1\n"), "samples::backwards", 3, 1, "cut the file"),
        (format!("{header}0,1,1\n0.1,1\n"), "samples::columns", 3, 1, "as many cells"),
    ] {
        let demo = demo(&samples);
        let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv", "--json"]);
        assert_eq!(ran.code, 1, "{code}: {}{}", ran.out, ran.err);
        let last: Value = serde_json::from_str(ran.out.lines().last().unwrap())
            .unwrap_or_else(|_| serde_json::from_str(&ran.out).unwrap_or_else(|e| panic!("{e}: {}", ran.out)));
        let found = last["findings"].as_array().unwrap().iter().find(|f| f["code"] == code);
        let found = found.unwrap_or_else(|| panic!("{code} is not in {last}"));
        assert_eq!((&found["line"], &found["column"]), (&line.into(), &column.into()), "{code}: {found}");
        assert!(found["help"].as_str().unwrap().contains(hint), "{found}");
        assert_eq!(found["file"], "s.csv");
        // The same on a terminal, with the line shown under its own number.
        let shown = demo.run(&["monitor", "m.lua", "--samples", "s.csv"]);
        assert!(shown.err.contains(&format!("s.csv:{line}:{column}")), "{}", shown.err);
    }
}

#[test]
fn what_cannot_be_read_is_usage() {
    let demo = demo(SAMPLES);
    std::fs::write(demo.path("latin.csv"), b"time,Dynamics.f_raw_norm,Link.stats\n0,\xff,1\n").unwrap();
    for args in [
        vec!["monitor", "missing.lua", "--samples", "s.csv"],
        vec!["monitor", "m.lua", "--samples", "missing.csv"],
        vec!["monitor", "m.lua", "--samples", "."],
        vec!["monitor", "m.lua", "--samples", "latin.csv"],
        vec!["monitor", "m.lua"],
        vec!["monitor", "m.lua", "--samples", "s.csv", "--column", "x"],
    ] {
        let ran = demo.run(&args);
        assert_eq!(ran.code, 2, "{args:?}: {}{}", ran.out, ran.err);
        assert!(!ran.err.is_empty());
    }
    let ran = demo.run(&["monitor", "m.lua", "--samples", "s.csv", "--only", "alinged"]);
    assert!(ran.code == 1 && ran.err.contains("`aligned`"), "{}", ran.err);
}

/// The monitors of a deployment are checked against it.
#[test]
fn what_is_wrong_with_a_deployments_monitors_is_told() {
    let with = |monitors: &str| {
        let demo = Demo::new();
        demo.replace(
            "deployment.yaml",
            "coordinator: coordinator.lua",
            "coordinator: coordinator.lua\nmonitors: [m.lua]",
        );
        demo.write("m.lua", &format!("Monitors {{ {monitors} }}"));
        demo.write("s.csv", "time,source.y\n0,0.5\n1,9.5\n");
        demo
    };
    let run = |demo: &Demo, more: &[&str]| {
        let mut args = vec!["monitor", "deployment.yaml", "--samples", "s.csv"];
        args.extend(more);
        demo.run(&args)
    };
    let high = "high = monitor { when = above(\"source.y\", 8.0), event = \"e_fast\" }";
    let ran = run(&with(high), &[]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.out.contains("e_fast"), "{}", ran.out);
    // Nothing runs it: the demo creates no `davit.Monitors`. A warning, which refuses nothing.
    assert!(ran.err.contains("monitor::not_run"), "{}", ran.err);
    let deaf = run(&with(&high.replace("e_fast", "e_fats")), &[]);
    assert_eq!(deaf.code, 0, "{}", deaf.err);
    assert!(deaf.err.contains("monitor::unheard") && deaf.err.contains("`e_fast`"), "{}", deaf.err);
    let wrong = run(&with(&high.replace("source.y", "source.z")), &["--column", "source.z=source.y", "--json"]);
    assert_eq!(wrong.code, 0, "the recording has it: {}", wrong.out);
    let last: Value = serde_json::from_str(wrong.out.lines().last().unwrap()).unwrap();
    let found = last["findings"].as_array().unwrap().iter().find(|f| f["code"] == "conf::unknown_port");
    assert_eq!(found.unwrap()["path"], "monitors.high", "{last:#}");
    // A mistake in the text of a configuration keeps nobody from looking at a monitor.
    let demo = with(high);
    demo.replace("configurations.lua", "property_set(\"source.name\", \"second\")", "property_set(17)");
    let ran = run(&demo, &[]);
    assert_eq!(ran.code, 0, "{}", ran.err);
    assert!(ran.err.contains("text::"), "{}", ran.err);
}
