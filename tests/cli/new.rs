//! `davit new`: what it writes is accepted, runs, and is the same in both languages; nothing that is there is touched.

use crate::demo::Demo;

/// What `convert` makes of it, without its name.
fn model(demo: &Demo, folder: &str) -> String {
    let ran = demo.run(&["convert", &format!("{folder}/deployment.yaml"), "--to", "yaml"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
    ran.out.replace(folder, "NAME")
}

#[test]
fn what_it_writes_is_accepted_and_runs_in_both_languages() {
    let demo = Demo::new();
    for (folder, more) in [("belt", &[][..]), ("lift", &["--lua"][..])] {
        let new = demo.run(&[&["new", folder][..], more].concat());
        assert!(
            new.code == 0 && new.out.contains(&format!("davit check {folder}/deployment.yaml")),
            "{}{}",
            new.out,
            new.err
        );
        // The commands that it names.
        let next: Vec<&str> = new.out.lines().filter_map(|line| line.strip_prefix("  davit ")).collect();
        assert_eq!(next.len(), 3, "{}", new.out);
        for command in &next[..2] {
            let ran = demo.run(&command.split(' ').collect::<Vec<_>>());
            assert!(ran.code == 0 && !ran.err.contains('⚠'), "{command}: {}{}", ran.out, ran.err);
        }
        let told = demo.run(&["check", &format!("{folder}/deployment.yaml"), "--json"]).json();
        let told: Vec<_> =
            told["findings"].as_array().unwrap().iter().filter(|one| one["severity"] != "info").collect();
        assert!(told.is_empty(), "{told:?}");
        let ran = demo.run(&["run", &format!("{folder}/story.lua"), "--clock", "simulated"]);
        assert!(
            ran.out.contains("fast: 0.4 m/s") && ran.out.contains("stopped: 0.0 m/s, 3 frames in force"),
            "{}",
            ran.out
        );
    }
    assert_eq!(model(&demo, "belt"), model(&demo, "lift"));
}

#[test]
fn nothing_that_is_there_is_touched() {
    let demo = Demo::new();
    std::fs::create_dir(demo.path("mine")).unwrap();
    demo.write("mine/story.lua", "mine");
    let new = demo.run(&["new", "mine"]);
    assert!(new.code == 1 && new.err.contains("davit::cli::not_empty"), "{}{}", new.out, new.err);
    assert_eq!(
        (demo.read("mine/story.lua").as_str(), std::fs::read_dir(demo.path("mine")).unwrap().count()),
        ("mine", 1)
    );
    // A file where the folder would be, and a name that is none: neither leaves a folder.
    demo.write("file", "mine");
    let new = demo.run(&["new", "file"]);
    assert!(new.code == 2 && new.err.contains("davit::cli::unwritable"), "{}", new.err);
    let new = demo.run(&["new", "my belt"]);
    assert!(new.code == 2 && new.err.contains("--name") && !demo.path("my belt").exists(), "{}", new.err);
    let new = demo.run(&["new", "my belt", "--name", "belt", "--json"]);
    assert_eq!((new.code, &new.json()["name"]), (0, &"belt".into()), "{}", new.err);
    assert!(demo.read("my belt/deployment.yaml").contains("\nname: belt\n"));
    // In the folder where one is.
    std::fs::create_dir(demo.path("here")).unwrap();
    let here = demo.command(&["new", "."]).current_dir(demo.path("here")).output().unwrap();
    assert!(here.status.success() && demo.read("here/deployment.yaml").contains("\nname: here\n"));
}

/// What is no deployment is told what it is.
#[test]
fn a_script_that_is_checked_is_told_how_it_is_run() {
    let demo = Demo::new();
    assert_eq!(demo.run(&["new", "belt"]).code, 0);
    let checked = demo.run(&["check", "belt/story.lua"]);
    assert!(checked.code == 2 || checked.code == 1, "{}", checked.code);
    assert!(checked.err.contains("this is a script: `davit run belt/story.lua` runs it"), "{}", checked.err);
}

/// A code is found by what is behind its area.
#[test]
fn a_code_is_explained_by_its_own_name() {
    let demo = Demo::new();
    let explained = demo.run(&["explain", "never_up"]);
    assert!(
        explained.code == 0 && explained.out.starts_with("deploy::never_up: "),
        "{}{}",
        explained.out,
        explained.err
    );
}
