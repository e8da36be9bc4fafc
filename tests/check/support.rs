//! A deployment of a drive or two, and what `check` says of it.

use crate::demo::Demo;
use davit::check::FOLLOWED;
use davit::lang::LoadOptions;
use davit::runtime::Libraries;
use serde_json::Value;

const DEPLOYMENT: &str = "davit: 1
name: small
platform: simulated
types:
  Drive:
    ports:
      out: { direction: out, type: float }
      in: { direction: in, type: float }
    properties:
      gain: { type: float, default: 1.0 }
      mode: { type: int, default: 0, tunable: stopped }
      address: { type: int, default: 0, tunable: unconfigured }
    operations:
      weld: { effect: irreversible }
      open: { effect: { undo: close } }
      close: { effect: { undo: open } }
      raise: { effect: { undo: lower }, moves: true }
      lower: { effect: { undo: raise }, moves: true }
  Arm:
    actuator: true
    ports: { push: { direction: in, type: float } }
  Guard:
    ports: { seen: { direction: in, type: float }, alarms: { direction: out, type: event } }
configurations: [conf.lua]
";

/// Small deployments by their parts.
pub struct Small {
    pub demo: Demo,
}

impl Small {
    /// One coordinator, given by its states and transitions, which is up in `up` and down in `idle`. `keys` are further
    /// lines of the deployment.
    pub fn new(configurations: &str, coordinator: &str, keys: &str) -> Self {
        let demo = Demo::new();
        demo.write("conf.lua", &format!("ConfiguratorConf {{ {configurations} }}"));
        demo.write("coordinator.lua", &format!("return state {{ {coordinator} }}"));
        let text = format!(
            "{DEPLOYMENT}coordinator: coordinator.lua
deploy: {{ event: e_start, up: up, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: idle, within_s: 5 }}\n{keys}"
        );
        demo.write("small.yaml", &text);
        Self { demo }
    }

    /// Several coordinators by their names.
    pub fn several(configurations: &str, coordinators: &[(&str, &str)], keys: &str) -> Self {
        let demo = Demo::new();
        demo.write("conf.lua", &format!("ConfiguratorConf {{ {configurations} }}"));
        let mut listed = Vec::new();
        for (name, coordinator) in coordinators {
            demo.write(&format!("{name}.lua"), &format!("return state {{ {coordinator} }}"));
            listed.push(format!("{name}: {name}.lua"));
        }
        let down: Vec<String> = coordinators.iter().map(|(name, _)| format!("{name}:idle")).collect();
        let text = format!(
            "{DEPLOYMENT}coordinators: {{ {} }}
deploy: {{ event: e_start, up: up, within_s: 5 }}
shutdown: {{ event: e_shutdown, down: [{}], within_s: 5 }}\n{keys}",
            listed.join(", "),
            down.join(", ")
        );
        demo.write("small.yaml", &text);
        Self { demo }
    }

    /// The deployment, not checked.
    pub fn read(&self) -> davit::app::Read {
        let path = self.demo.path("small.yaml");
        davit::app::read(&path, &LoadOptions::default(), Libraries::default())
            .unwrap_or_else(|_| panic!("it is readable"))
    }

    /// What `check` says.
    pub fn check(&self) -> Said {
        let said = Said(self.demo.run(&["check", "small.yaml", "--json"]).json());
        self.replay(&said);
        said
    }

    /// Goes the way to each finding by its script: the same answers come, and it ends in the same states.
    fn replay(&self, said: &Said) {
        for (number, finding) in (1..).zip(said.0["findings"].as_array().unwrap()) {
            let code = finding["code"].as_str().unwrap();
            let listed = FOLLOWED.iter().any(|known| known.0 == code);
            if finding["trace"].as_array().is_none_or(Vec::is_empty) {
                continue;
            }
            assert!(listed, "{code} has a way: it stands in the list of those that do");
            let (number, script) = (number.to_string(), format!("way{number}.lua"));
            let made = self.demo.run(&["check", "small.yaml", "--trace", &number, "--as", &script]);
            if made.err.contains("no script goes this way") {
                // Of one kind of finding at least is a way that a script goes: see `shown`.
                let reasons = [
                    "on its way",
                    "at once",
                    "not known",
                    "be lost alone",
                    "may have to wait",
                    "are squashed",
                    "only creates",
                    "so long",
                    "goes back",
                    "round for ever",
                    "followed apart",
                    "comes too late",
                ];
                assert!(reasons.iter().any(|why| made.err.contains(why)), "{}", made.err);
                continue;
            }
            let ran = self.demo.run(&["run", &script, "--clock", "simulated", "--platform", "simulated"]);
            let text = std::fs::read_to_string(self.demo.path(&script)).unwrap();
            assert!(!ran.err.contains("davit::script"), "{finding:#}\n{text}\n{}{}", ran.out, ran.err);
        }
    }
}

/// What `check` said.
pub struct Said(pub Value);

impl Said {
    /// The findings of a code.
    pub fn of(&self, code: &str) -> Vec<&Value> {
        self.0["findings"].as_array().unwrap().iter().filter(|f| f["code"] == code).collect()
    }

    /// The refusals of a request: severities and messages.
    pub fn refused(&self, request: &str) -> Vec<(&str, &str)> {
        let refused = self.of("coord::request_refused").into_iter();
        let told = refused.map(|f| (f["severity"].as_str().unwrap(), f["message"].as_str().unwrap()));
        told.filter(|(_, message)| message.starts_with(&format!("`{request}` is refused"))).collect()
    }

    /// The way to a finding, one line a step.
    pub fn answers(finding: &Value) -> Vec<String> {
        let steps = finding["trace"].as_array().unwrap().iter();
        let answers = steps.filter_map(|step| step["answers"].as_array()).flatten();
        answers.map(|answer| answer["answer"].as_str().unwrap().to_owned()).collect()
    }
}
