//! A platform that a program brings itself: named like a built-in one, given its options, and what may be wrong with them.

use davit::app::{self, Extensions, PlatformMaker, StartError};
use davit::lang::LoadOptions;
use davit::libraries;
use davit::model::{Catalogue, PlatformKind, Value, ValueType};
use davit::platform::simulated::{Simulated, SimulatedOptions};
use davit::session::Phase;
use davit::time::Clock;
use std::sync::{Arc, Mutex};

/// What the platform was made with, each time.
type Made = Arc<Mutex<Vec<String>>>;

fn program(made: &Made) -> Extensions {
    let made = made.clone();
    let bus = PlatformMaker::new("bus", PlatformKind::ELSEWHERE, move |making| {
        made.lock().unwrap().push(format!("{:?}", making.options));
        let device = |name: &str| making.options.values().any(|value| *value == Value::Str(name.into()));
        if device("gone") {
            return Err("no such device".to_owned());
        }
        let mut types = Catalogue::new();
        for ty in making.checked.catalogue.iter().filter(|_| !device("empty")) {
            let mut own = (**ty).clone();
            // What is said of it in other words makes no difference.
            for level in own.properties.values_mut().filter(|_| device("dim")) {
                level.max = Some(0.5);
                level.doc = "half as bright".to_owned();
            }
            types.insert(own);
        }
        Ok(Arc::new(Simulated::new(types, making.clock.clone(), SimulatedOptions::default())))
    })
    .option("device", ValueType::Str, None, "the device file")
    .option("rate", ValueType::Float, Some(Value::Int(50)), "how often it is read, in Hz");
    Extensions::from(libraries::builtin()).with_platform(bus)
}

/// The example with another `platform`, in a folder of its own.
fn read(platform: &str, made: &Made) -> Result<app::Checked, Vec<(String, String, String)>> {
    let folder = tempfile::tempdir().unwrap();
    for file in ["deployment.yaml", "configurations.yaml", "coordinator.yaml"] {
        let text = std::fs::read_to_string(format!("examples/own_platform/{file}")).unwrap();
        let line = text.lines().find(|line| line.starts_with("platform:"));
        let text = line.map_or_else(|| text.clone(), |line| text.replace(line, &format!("platform: {platform}")));
        std::fs::write(folder.path().join(file), text).unwrap();
    }
    let read = app::read(&folder.path().join("deployment.yaml"), &LoadOptions::default(), program(made));
    read.and_then(app::check).map_err(|refused| {
        let shown = davit::diagnostics::to_json(&refused.findings, &refused.sources);
        let of = |finding: &serde_json::Value, key: &str| finding[key].as_str().unwrap_or_default().to_owned();
        let all = shown.as_array().unwrap().iter();
        all.map(|f| (of(f, "code"), of(f, "message"), format!("{}:{} {}", f["line"], f["column"], of(f, "help"))))
            .collect()
    })
}

#[test]
fn a_platform_of_ones_own_is_deployed_to() {
    let made = Made::default();
    let checked = read("{ bus: { device: /dev/bus0 } }", &made).unwrap_or_else(|why| panic!("{why:?}"));
    let clock = Clock::simulated();
    let _me = clock.enter();
    let session = app::start(&checked, &clock).unwrap();
    session.bring_up().unwrap();
    assert_eq!(session.status().phase, Phase::Up);
    session.take_down(false);
    clock.shutdown();
    // An int is taken for a float, as for a property.
    let options = made.lock().unwrap().clone();
    assert_eq!(options, ["{device: Str(\"/dev/bus0\"), rate: Float(50.0)}"]);
}

#[test]
fn what_is_wrong_with_a_platform_is_told() {
    let made = Made::default();
    for (platform, code, message, help) in [
        (
            "bus",
            "deploy::platform_option",
            "the platform `bus` needs `device`: the device file",
            "platform: { bus: { device: … } }",
        ),
        ("{ bus: { device: 7 } }", "deploy::platform_option", "`device` of the platform `bus`", "4:28 it is string"),
        (
            "{ bus: { device: a, raet: 5 } }",
            "deploy::platform_option",
            "the platform `bus` has no option `raet`",
            "4:37 did you mean `rate`?",
        ),
        (
            "{ simulated: { seed: 1 } }",
            "deploy::platform_option",
            "the platform `simulated` has no option `seed`",
            "there are no options here",
        ),
        ("bsu", "deploy::unknown_platform", "this program has no platform `bsu`", "did you mean `bus`?"),
        ("{ bus: 7 }", "text::wrong_type", "what a platform is given", "{ device: can0 }"),
        ("{ bus: {}, simulated: {} }", "text::bad_value", "`platform` names one platform", "platform: { NAME:"),
    ] {
        let found = read(platform, &made).err().unwrap_or_default();
        let [one] = &found[..] else { panic!("{platform}: {found:?}") };
        assert!(one.0.ends_with(code) && one.1.contains(message) && one.2.contains(help), "{platform}: {one:?}");
    }
    let checked = read("{ bus: { device: gone } }", &made).unwrap_or_else(|why| panic!("{why:?}"));
    let refused = app::start(&checked, &Clock::simulated()).err().map(|error| error.to_string());
    assert_eq!(refused.as_deref(), Some("the platform `bus` cannot be made: no such device"));
}

/// What `check` accepted could fail there: nothing of it is begun.
#[test]
fn a_platform_whose_types_are_others_is_not_deployed_to() {
    for (device, told) in [
        ("empty", "the platform `bus` has no type `Lamp`"),
        ("dim", "`Lamp.level`: max is declared as 1, the platform has 0.5"),
    ] {
        let checked = read(&format!("{{ bus: {{ device: {device} }} }}"), &Made::default())
            .unwrap_or_else(|why| panic!("{why:?}"));
        let refused = app::start(&checked, &Clock::simulated()).err();
        let Some(StartError::Types { findings, .. }) = &refused else { panic!("{device}: {refused:?}") };
        assert_eq!(findings.iter().map(|f| f.message.as_str()).collect::<Vec<_>>(), [told], "{device}");
        assert!(findings[0].origin.is_some() && findings[0].code == davit::model::codes::TYPE_DIFFERS, "{findings:?}");
        assert!(refused.unwrap().to_string().contains(told));
    }
}
