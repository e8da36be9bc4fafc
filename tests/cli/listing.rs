//! All deployments of a user: those that run, and those that died.

use crate::demo::Demo;
use crate::kept::{deploy, kill};
use serde_json::Value;

/// Takes both down whatever the test found.
struct Two(Demo);

impl Drop for Two {
    fn drop(&mut self) {
        for name in ["demo", "other"] {
            let _ = self.0.command(&["shutdown", "--force", name]).output();
        }
    }
}

#[test]
fn what_runs_and_what_died_is_listed_until_it_is_forgotten() {
    let two = Two(Demo::new());
    let demo = &two.0;
    let text = demo.read("deployment.yaml").replace("name: demo", "name: other");
    demo.write("other.yaml", &text);
    assert_eq!(demo.run(&["list"]).out, "no deployment is running\n");
    assert_eq!(demo.run(&["list", "--json"]).json(), serde_json::json!([]));
    deploy(demo, "deployment.yaml");
    deploy(demo, "other.yaml");

    let list = demo.run(&["list"]);
    let lines: Vec<&str> = list.out.lines().collect();
    assert_eq!((list.code, lines.len()), (0, 2), "{}", list.out);
    for (line, name) in lines.iter().zip(["demo ", "other"]) {
        assert!(line.starts_with(&format!("{name}  up  root.operational.slow_mode")), "{line}");
        assert!(line.contains("process ") && line.contains("since 2"), "{line}");
    }
    // Which one is meant is not known: all in short, or each in full by its name.
    let status = demo.run(&["status"]);
    assert_eq!((status.code, &status.out), (0, &list.out), "{}", status.err);
    let both = demo.run(&["status", "other", "demo", "--json"]).json();
    let names: Vec<&Value> = both.as_array().expect("an array").iter().map(|status| &status["name"]).collect();
    assert_eq!(names, ["other", "demo"]);
    assert!(both[0]["system"]["components"]["source"].is_object(), "{both}");
    let asked = demo.run(&["apply", "rename"]);
    assert!(asked.code == 2 && asked.err.contains("cli::several_running"), "{}", asked.err);

    kill(demo, "other");
    let list = demo.run(&["list", "--json"]).json();
    let phases: Vec<&Value> = list.as_array().expect("an array").iter().map(|one| &one["phase"]).collect();
    assert_eq!(phases, ["up", "died"], "{list}");
    assert_eq!(list[0]["frames"], 4, "{list}");
    assert_eq!(list[1]["was"]["phase"], "up", "{list}");
    assert!(demo.run(&["list"]).out.contains("other  died  killed, or crashed"), "{list}");
    // One runs, and is meant; the other is not kept quiet about.
    let status = demo.run(&["status"]);
    assert!(status.code == 4 && status.out.starts_with("demo  up"), "{} {}", status.code, status.out);
    assert!(status.err.contains("`other` died") && !status.err.contains("`demo`"), "{}", status.err);
    assert_eq!(demo.run(&["status", "demo", "other"]).code, 4);

    // One that there is not hides none that there is, and how it ends tells of the worst.
    let three = demo.run(&["status", "none", "demo", "other"]);
    assert_eq!(three.code, 4, "{}", three.err);
    for words in ["none  not seen  no deployment named `none` is running", "demo  up", "other  died"] {
        assert!(three.out.contains(words), "{words}: {}", three.out);
    }
    let two = demo.run(&["status", "demo", "none", "--json"]);
    let seen = two.json();
    assert_eq!((two.code, &seen[0]["phase"], &seen[1]["phase"]), (1, &"up".into(), &Value::Null), "{seen}");
    assert_eq!(seen[1]["name"], "none");

    let runs = demo.run(&["list", "--forget", "demo"]);
    assert!(runs.code == 1 && runs.err.contains("cli::nothing_kept"), "{}", runs.err);
    assert!(runs.err.contains("`demo` runs, and nothing of it is forgotten"), "{}", runs.err);
    assert_eq!(demo.run(&["list", "--forget", "other"]).code, 0);
    assert_eq!(demo.run(&["list", "--json"]).json().as_array().map(Vec::len), Some(1));
    assert_eq!(demo.run(&["status", "other"]).code, 1);
    assert_eq!(demo.run(&["shutdown"]).code, 0);
    assert_eq!(demo.run(&["list"]).out, "no deployment is running\n", "what ended in order is not listed");
}

/// What is kept of a deployment is a file of its name: a name that leads elsewhere is none.
#[test]
fn a_path_is_no_name() {
    let demo = Demo::new();
    demo.write("victim.life", "mine");
    let elsewhere = demo.path("victim").display().to_string();
    for name in ["../victim", elsewhere.as_str(), "../../victim", "a/b", ""] {
        for args in [&["list", "--forget", name][..], &["status", name], &["log", name], &["shutdown", name]] {
            let ran = demo.run(args);
            assert_eq!(ran.code, 2, "{args:?} {}{}", ran.out, ran.err);
        }
    }
    assert_eq!(demo.read("victim.life"), "mine");
}
