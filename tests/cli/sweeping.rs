//! `davit sweep`: a grid of runs, of which none takes another one with it.

use crate::demo::{Demo, Ran};
use std::process::Stdio;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

const GRID: &str = "local k, mode = param('k', 1.0), param('mode', 'plain')
deploy('@hello.yaml')
if mode == 'fails' then assert(false, 'on purpose') end
while mode == 'hangs' do wait(1) end
set('gain.k', k, { force = true, within = 1 })
wait(0.1)
expect{ name = 'k', value = property('gain.k'), max = 2, unit = 'N' }
figure{ name = 'twice', value = 2 * k }
shutdown()";

fn sweep(script: &str, args: &[&str]) -> Ran {
    let demo = Demo::new();
    demo.write("grid.lua", &script.replace('@', &format!("{ROOT}/deployments/")));
    demo.run(&[&["sweep", "grid.lua"], args].concat())
}

#[test]
fn a_row_is_a_point_and_a_column_a_figure() {
    let args = ["--set", "k=1:3:1", "--set", "mode=plain,other"];
    let ran = sweep(GRID, &args);
    assert_eq!(ran.code, 1, "one misses: {}{}", ran.out, ran.err);
    let lines: Vec<Vec<&str>> = ran.out.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines[0], ["k", "mode", "k", "(N)", "twice"]);
    assert_eq!(lines[1], ["1", "plain", "1", "2", "ok"]);
    assert_eq!(lines[4], ["2", "other", "2", "4", "ok"]);
    assert_eq!(lines[5], ["3", "plain", "3", "!", "6", "missed"]);
    assert!(ran.out.contains("4 of 6 points are within their bounds"), "{}", ran.out);
    let json = sweep(GRID, &[&args[..], &["--json", "--jobs", "3"]].concat()).json();
    assert_eq!((json["ok"].as_bool(), json["points"].as_array().map(Vec::len)), (Some(false), Some(6)));
    assert_eq!(json["points"][5]["set"], serde_json::json!({ "k": "3", "mode": "other" }));
    assert_eq!(json["points"][5]["figures"][0]["ok"], false);
    let ran = sweep(GRID, &["--set", "k=1,2", "--csv"]);
    assert_eq!((ran.code, ran.out.as_str()), (0, "k,k,twice,end\n1,1,2,ok\n2,2,4,ok\n"));
}

#[test]
fn one_that_fails_or_hangs_takes_no_other_with_it() {
    // Each has its time, which a busy machine needs too; the one that hangs uses it up.
    let ran = sweep(GRID, &["--set", "mode=plain,fails,hangs,other", "--within", "20"]);
    assert_eq!(ran.code, 1, "{}{}", ran.out, ran.err);
    let ends = ["plain  1", "fails  –", "hangs  –", "other  1"];
    for (line, end) in ran.out.lines().skip(1).zip(ends) {
        assert!(line.starts_with(end), "{line}: {}", ran.out);
    }
    for word in ["failed: grid.lua:3: on purpose", "2 of 4 points"] {
        assert!(ran.out.contains(word), "{word}: {}", ran.out);
    }
    assert!(ran.out.contains("hung: not over in 20 s") || ran.out.contains("endless loop"), "{}", ran.out);
}

#[test]
fn what_is_not_read_or_not_written_so_is_named() {
    for (set, code, says) in [
        ("kk=1,2", 2, "nothing reads the parameter `kk`: did you mean `k`?"),
        ("k=1:2", 1, "`k` is a number, as its default is"),
        ("k=1:2:0", 2, "the step leads nowhere near the end"),
        ("k", 2, "it gives no parameter a value"),
    ] {
        let ran = sweep(GRID, &["--set", set]);
        assert_eq!(ran.code, code, "{set}: {}{}", ran.out, ran.err);
        let said: Vec<&str> =
            ran.err.split_whitespace().chain(ran.out.split_whitespace()).filter(|word| *word != "│").collect();
        assert!(said.join(" ").contains(says), "{set}: {}{}", ran.out, ran.err);
    }
    let demo = Demo::new();
    let ran = demo.run(&["sweep", "plian.lua", "--set", "k=1,2"]);
    assert!(ran.code == 2 && ran.err.contains("there is no file plian.lua"), "{}{}", ran.out, ran.err);
    demo.write("plain.lua", "param('k', 1) say('ran')");
    let ran = demo.run(&["run", "plain.lua", "--set", "kay=2"]);
    assert!(ran.code == 2 && ran.err.contains("script::unknown_parameter"), "{}{}", ran.out, ran.err);
    let ran = demo.run(&["run", "plain.lua", "--set", "k=2"]);
    assert_eq!((ran.code, ran.out.as_str()), (0, "ran\n"));
    // Also one that it comes to behind `deploy`, and not one that it has passed by.
    demo.write("late.lua", "deploy('deployment.yaml')\nif param ('k', 1) == 1 then param(\"late\", 1) end say('ran')");
    let ran = demo.run(&["run", "late.lua", "--clock", "simulated", "--quiet", "--set", "k=1", "--set", "late=3"]);
    assert_eq!((ran.code, ran.out.as_str()), (0, "ran\n"), "{}", ran.err);
    let ran = demo.run(&["run", "late.lua", "--clock", "simulated", "--quiet", "--set", "k=2", "--set", "late=3"]);
    assert!(ran.code == 2 && ran.err.contains("nothing reads the parameter `late`"), "{}{}", ran.out, ran.err);
}

#[test]
fn a_run_ends_with_whoever_has_started_it() {
    let demo = Demo::new();
    demo.write("story.lua", "for i = 1, 1000000000 do wait(0.001) end");
    let mut command = demo.command(&["run", "story.lua", "--clock", "simulated", "--with-parent"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    assert!(child.try_wait().unwrap().is_none());
    // As the system does for one that was killed; `wait` does it as well.
    drop(child.stdin.take());
    assert_eq!(child.wait().unwrap().code(), Some(1), "it was interrupted");
}
