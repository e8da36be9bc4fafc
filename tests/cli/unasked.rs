//! A mistake in the text of one configuration, for those who ask for others.

use crate::demo::Demo;

/// Each mistake stands in `rename`, and is found while the text is read.
#[test]
fn a_mistake_of_the_text_refuses_those_that_ask_for_it() {
    let mistakes = [
        ("property_set(\"source.name\", \"second\"", "property_set(\"source.name\"", "text::missing_key"),
        ("property_set(\"source.name\"", "property_set(17", "text::wrong_type"),
        ("property_set(\"source.name\"", "property_set(\"source..name\"", "text::bad_name"),
        ("\"second\"", "\"second\", 1", "lua::arguments"),
        ("\"second\"", "secnd", "lua::undefined"),
        ("rename = Configuration {", "rename = Configuration { timeot = 1,", "text::unknown_key"),
        ("rename = Configuration {", "rename = Configuration { timeout = \"1 km\",", "text::bad_time"),
        ("rename = Configuration {", "rename = Configuration { timeout = -1,", "text::bad_time"),
        (
            "rename = Configuration {",
            "rename = Configuration { post_conf_state = { \"sink:runing\" },",
            "conf::bad_state",
        ),
    ];
    let (sound, json) =
        (["plan", "deployment.yaml", "create_all"], ["plan", "deployment.yaml", "create_all", "--json"]);
    let expected = Demo::new().run(&json).json();
    for (from, to, code) in mistakes {
        let demo = Demo::new();
        demo.replace("configurations.lua", from, to);
        let ran = demo.run(&sound);
        assert_eq!(ran.code, 0, "{to}: {}", ran.err);
        assert!(ran.err.contains(code) && ran.err.contains("configurations.lua"), "{to}: {}", ran.err);
        assert_eq!(demo.run(&json).json(), expected, "{to}");
        let asked = demo.run(&["plan", "deployment.yaml", "create_all", "rename", "--json"]);
        assert_eq!(asked.code, 1, "{to}");
        assert_eq!(asked.json()["findings"][0]["code"], code, "{to}");
        assert_eq!(asked.json()["findings"][0]["path"], "configurations.rename", "{to}");
        assert_eq!(demo.run(&["plan", "deployment.yaml"]).code, 0, "not on the way up: {to}");
        assert_eq!(demo.run(&["graph", "deployment.yaml"]).code, 0, "{to}");
        assert_eq!(demo.run(&["check", "deployment.yaml"]).code, 1, "{to}");
    }
}

#[test]
fn a_mistake_of_the_text_on_the_way_up_refuses_the_bringup() {
    let demo = Demo::new();
    demo.replace("configurations.lua", "property_set(\"source.k\", 1.0)", "property_set(\"source.k\")");
    assert_eq!(demo.run(&["plan", "deployment.yaml", "create_all"]).code, 0);
    let ran = demo.run(&["plan", "deployment.yaml", "--bringup", "--json"]);
    assert_eq!(ran.code, 1, "{}", ran.out);
    assert_eq!(ran.json()["findings"][0]["code"], "text::missing_key");
    // What is no configuration's own refuses all of them.
    for (file, from, to) in [
        ("configurations.lua", "ConfiguratorConf {", "local x = property_set(\"source.k\", 1, 2)\nConfiguratorConf {"),
        ("coordinator.lua", "entry = \"create_all\"", "entry = 17"),
        ("deployment.yaml", "period_ms: 1.0", "period_ms: fast"),
    ] {
        let demo = Demo::new();
        demo.replace(file, from, to);
        assert_eq!(demo.run(&["plan", "deployment.yaml", "create_all"]).code, 1, "{to}");
    }
}

/// In YAML a value can be written once and stand in two configurations.
#[test]
fn a_mistake_that_two_configurations_share_refuses_both() {
    let yaml = |rename: &str, again: &str| {
        let demo = Demo::new();
        demo.run(&["convert", "configurations.lua", "--to", "yaml", "-o", "configurations.yaml"]);
        demo.replace("deployment.yaml", "configurations.lua", "configurations.yaml");
        let text = demo.read("configurations.yaml");
        let (head, _) = text.split_once("  rename:").unwrap_or_else(|| panic!("{text}"));
        demo.write("configurations.yaml", &format!("{head}  rename:\n{rename}  again:\n{again}"));
        demo
    };
    let change = "    changes:\n      - property_set: { property: source.name, value: second }\n";
    let plan = |demo: &Demo, id| demo.run(&["plan", "deployment.yaml", "create_all", id]).code;
    let twice = "    changes:\n      - property_set: { property: source.k, value: 1, value: 2 }\n";
    let demo = yaml(twice, change);
    assert_eq!((plan(&demo, "again"), plan(&demo, "rename")), (0, 1));
    let demo = yaml(change, twice);
    assert_eq!((plan(&demo, "again"), plan(&demo, "rename")), (1, 0));
    let demo = yaml(
        "    changes: &same\n      - property_set: { property: source.k, value: 1, value: 2 }\n",
        "    changes: *same\n",
    );
    assert_eq!((plan(&demo, "again"), plan(&demo, "rename")), (1, 1));
    assert_eq!(demo.run(&["plan", "deployment.yaml", "create_all"]).code, 1, "whose it is, is not known");
    // A name that stands twice is wrong for those that ask for it.
    let demo = yaml(change, &format!("{change}  rename:\n{change}"));
    assert_eq!((plan(&demo, "again"), plan(&demo, "rename")), (0, 1));
}
