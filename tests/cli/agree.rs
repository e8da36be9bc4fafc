//! What `check`, `plan`, `graph` and a run say of every shipped deployment is one and the same.

use crate::demo::{Demo, at_home};
use serde_json::Value;
use std::collections::{BTreeMap, VecDeque};

/// Every deployment that the program can run as it is. (`examples/own_components` needs a library of its own.)
fn shipped() -> Vec<String> {
    let home = env!("CARGO_MANIFEST_DIR");
    let files = std::fs::read_dir(format!("{home}/deployments")).expect("shipped deployments");
    let mut all: Vec<String> =
        files.map(|file| format!("deployments/{}", file.unwrap().file_name().to_string_lossy())).collect();
    all.push("examples/side_by_side/deployment.yaml".to_owned());
    all.sort();
    assert!(all.len() >= 5, "{all:?}");
    all
}

/// Requests of one step: who asked, the answers, and all their steps in the order of their names (another is not promised).
type Done = (String, Vec<String>, Vec<String>);

fn word(json: &Value, key: &str) -> String {
    json[key].as_str().unwrap_or_default().to_owned()
}

/// What a plan says will be done, and the system at its end.
fn planned(file: &str, which: &str, name: &str) -> (Vec<Done>, Value) {
    let ran = at_home(&["plan", file, which, "--json"]);
    assert_eq!(ran.code, 0, "{file}: {}{}", ran.out, ran.err);
    let json = ran.json();
    let mut all = Vec::new();
    for one in json.as_array().unwrap() {
        let step = |step: &Value| match word(step, "do").as_str() {
            verb @ ("connect" | "disconnect") => format!("{verb} {} -> {}", word(step, "from"), word(step, "to")),
            verb => format!("{verb} {}", word(step, "target")),
        };
        let mut steps: Vec<String> = one["steps"].as_array().unwrap().iter().map(step).collect();
        steps.sort();
        let who = one["coordinator"].as_str().unwrap_or(name).to_owned();
        let requests = one["requests"].as_array().unwrap().iter().map(|request| request.as_str().unwrap());
        let answers: Vec<String> = requests
            .map(|request| match request.strip_suffix(".undo") {
                Some(id) => format!("{id}.undone"),
                None => format!("{request}.ok"),
            })
            .collect();
        all.push((who, answers, steps));
    }
    (all, json.as_array().unwrap().last().expect("something is asked for")["result"].clone())
}

/// Lua that writes a value as JSON.
const TO_JSON: &str = r#"
local function json(v)
  if type(v) == "table" then
    local parts = {}
    if #v > 0 then
      for _, one in ipairs(v) do parts[#parts + 1] = json(one) end
      return "[" .. table.concat(parts, ",") .. "]"
    end
    for key, one in pairs(v) do parts[#parts + 1] = string.format("%q:%s", key, json(one)) end
    return "{" .. table.concat(parts, ",") .. "}"
  elseif type(v) == "number" then return string.format("%.17g", v)
  elseif type(v) == "string" then return string.format("%q", v)
  else return tostring(v) end
end
"#;

/// Numbers as floats, nothing as an empty object: what Lua makes of a value.
fn plain(value: &Value) -> Value {
    match value {
        Value::Number(number) => Value::from(number.as_f64().unwrap()),
        Value::Array(all) if all.is_empty() => Value::Object(serde_json::Map::new()),
        Value::Array(all) => all.iter().map(plain).collect(),
        Value::Object(all) => {
            let kept = all.iter().filter(|(_, value)| !value.is_null());
            Value::Object(kept.map(|(key, value)| (key.clone(), plain(value))).collect())
        }
        other => other.clone(),
    }
}

#[test]
fn check_plan_graph_and_run_agree_on_every_shipped_file() {
    for file in shipped() {
        let name = std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        let name = name.lines().find_map(|line| line.strip_prefix("name: ")).expect("a name").trim().to_owned();
        // What is checked comes up and down without anything refused, failed or forced.
        let checked = at_home(&["check", &file, "--json"]).json();
        assert!(["sound", "followed"].contains(&checked["verdict"].as_str().unwrap()), "{file}: {checked:#}");
        let whole = file.starts_with("deployments/");
        assert!(!whole || checked["explored"]["unfollowed"] == 0, "{file}: {}", checked["explored"]);
        let (mut expected, up) = planned(&file, "--bringup", &name);
        let ups = expected.len();
        let (downs, down) = planned(&file, "--shutdown", &name);
        expected.extend(downs);

        let demo = Demo::new();
        let path = format!("{}/{file}", env!("CARGO_MANIFEST_DIR"));
        demo.write("story.lua", &format!("{TO_JSON} deploy({path:?}) say(json(system())) shutdown()"));
        let ran = demo.run(&["run", "story.lua", "--clock", "simulated", "--platform", "simulated", "--json"]);
        assert_eq!(ran.code, 0, "{file}: {}{}", ran.out, ran.err);
        let lines: Vec<Value> = ran.out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
        let said = lines.iter().find(|line| line["what"] == "said").expect("the system");
        let system: Value = serde_json::from_str(said["text"].as_str().unwrap()).unwrap();
        assert_eq!(plain(&system), plain(&up), "{file}");
        assert!(
            down.as_object()
                .unwrap()
                .values()
                .all(|all| *all == serde_json::json!({}) || *all == serde_json::json!([])),
            "{down}"
        );

        let mut done: BTreeMap<String, VecDeque<(String, Vec<String>)>> = BTreeMap::new();
        for line in lines.iter().filter(|line| line["what"] == "answered") {
            let steps = line["steps"].as_array().unwrap().iter().map(|step| word(step, "step")).collect();
            done.entry(word(line, "by")).or_default().push_back((word(line, "answer"), steps));
        }
        for (who, answers, steps) in &expected {
            let mut did: Vec<String> = Vec::new();
            for answer in answers {
                let next = done.get_mut(who).and_then(VecDeque::pop_front);
                let (told, steps) = next.unwrap_or_else(|| panic!("{file}: `{answer}` of {who} is not told"));
                assert_eq!(told, *answer, "{file}");
                did.extend(steps);
            }
            did.sort();
            assert_eq!(did, *steps, "{file}: {answers:?}");
        }
        assert!(done.values().all(VecDeque::is_empty), "{file}: more was done than planned: {done:?}");

        let dot = |what: &str| at_home(&["graph", &file, "--what", what, "--format", "dot"]).out;
        let components = dot("components");
        let drawn = |name: &String| {
            // What is in a subsystem stands in a box of that name.
            let name = name.rsplit('/').next().unwrap_or(name);
            ["label=\"{", "label=\"", "}|"].iter().any(|before| components.contains(&format!("{before}{name}\\n")))
        };
        let names: Vec<&String> = up["components"].as_object().unwrap().keys().collect();
        assert!(names.iter().all(|name| drawn(name)), "{file}: {names:?}\n{components}");
        // What monitors look at is drawn dashed, without a policy.
        let connections =
            components.lines().filter(|line| line.contains(" -> ") && !line.contains("[style=dashed]")).count();
        assert_eq!(components.matches("shape=").count(), names.len(), "{file}");
        assert_eq!(connections, up["connections"].as_array().unwrap().len(), "{file}");
        let plan = dot("plan");
        for (_, answers, steps) in &expected[..ups] {
            let asks: Vec<&str> = answers.iter().map(|answer| answer.rsplit_once('.').unwrap().0).collect();
            assert!(plan.contains(asks[0]), "{file}: {asks:?}");
            let missing: Vec<&String> =
                steps.iter().filter(|step| !plan.contains(step.split(" -> ").next().unwrap())).collect();
            assert!(missing.is_empty(), "{file}: not drawn: {missing:?}");
        }
    }
}

/// What README shows of `check` is what it says.
#[test]
fn readme_shows_what_check_says() {
    let readme = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/README.md")).unwrap();
    let ran = at_home(&["check", "deployments/hello.yaml"]);
    for line in ran.out.lines() {
        assert!(readme.contains(line.trim_end()), "README does not show: {line}");
    }
    // And of a mistake.
    let demo = Demo::new();
    for folder in ["deployments", "configs/hello"] {
        std::fs::create_dir_all(demo.path(folder)).unwrap();
    }
    for file in ["deployments/hello.yaml", "configs/hello/configurations.lua", "configs/hello/coordinator.lua"] {
        let text = std::fs::read_to_string(format!("{}/{file}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        demo.write(file, &text.replace("property_set(\"gain.k\", 0.5)", "property_set(\"gain.kk\", 0.5)"));
    }
    let ran = demo.run(&["check", "deployments/hello.yaml"]);
    assert!(ran.code == 1 && ran.err.contains("unknown_property"), "{}", ran.err);
    for line in ran.err.lines() {
        assert!(readme.contains(line.trim_end()), "README does not show: {line}");
    }
}
