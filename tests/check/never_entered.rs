//! States to which transitions lead that are never taken.

use super::composed::{catalogue, load};
use davit::check::{self, Report};
use davit::lang::Sources;
use davit::model::Severity;

const DEPLOYMENT: &str = "
davit: 1
name: cell
platform: simulated
types: { Lamp: { properties: { level: { type: float, default: 0.0 } } } }
configurations: [conf.yaml]
coordinator: coord.yaml
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_end, down: off, within_s: 5 }
";

const CONFIGURATIONS: &str = "
configurations:
  build: { changes: [{ create: { component: lamp, type: Lamp } }] }
  fast: { changes: [{ property_set: { property: lamp.level, value: 1.0 } }] }
";

/// From `on` it goes to `hurry` by these, and `hurry` asks for `fast`.
fn coordinator(more: &str) -> String {
    format!(
        "coordinator:
  states: {{ off: {{}}, making: {{ entry: build }}, on: {{}}, hurry: {{ config: fast }}, leaving: {{ entry: build.undo }}, left: {{}}, far: {{}} }}
  transitions:
    - {{ src: initial, tgt: off }}
    - {{ src: off, tgt: making, events: [e_start] }}
    - {{ src: making, tgt: 'on', events: [build.ok] }}
    - {{ src: making, tgt: leaving, events: [build.failed, build.broken, e_end] }}
    - {{ src: hurry, tgt: 'on', events: [e_slow, fast.failed, fast.broken] }}
    - {{ src: hurry, tgt: leaving, events: [e_end] }}
    - {{ src: 'on', tgt: leaving, events: [e_end] }}
    - {{ src: leaving, tgt: off, events: [build.undone] }}
    - {{ src: leaving, tgt: left, events: [build.undo.failed, build.undo.broken] }}
    - {{ src: left, tgt: leaving, events: [e_end] }}
{more}"
    )
}

fn checked(more: &str) -> Report {
    let files = [
        ("cell.yaml", DEPLOYMENT.to_owned()),
        ("conf.yaml", CONFIGURATIONS.to_owned()),
        ("coord.yaml", coordinator(more)),
    ];
    let deployment = load(&Sources::memory(files), "cell.yaml", &[]).deployment.expect("it can be read");
    let catalogue = catalogue(&deployment);
    check::run(deployment, &catalogue)
}

fn told(report: &Report) -> Vec<(Severity, &str)> {
    let never = report.findings.iter().filter(|finding| finding.code.0 == "coord::never_entered");
    never.map(|finding| (finding.severity, &*finding.message)).collect()
}

#[test]
fn where_only_its_own_answer_leads_nobody_comes() {
    let report = checked("    - { src: 'on', tgt: hurry, events: [fast.ok] }\n");
    let message = "`root.hurry` is never entered: `fast.ok` never comes where that would lead there";
    let expected = if report.explored.complete { Severity::Warning } else { Severity::Info };
    assert_eq!(told(&report), [(expected, message)]);
    assert_eq!(told(&checked("    - { src: 'on', tgt: hurry, events: [e_fast] }\n")), []);
    // That something is heard which does not come here may be prudence.
    let prudent = checked(
        "    - { src: 'on', tgt: hurry, events: [e_fast] }\n    - { src: 'on', tgt: far, events: [build.undone] }\n",
    );
    let message = "`root.far` is never entered: `build.undone` never comes where that would lead there";
    assert_eq!(told(&prudent), [(Severity::Info, message)]);
}

#[test]
fn of_several_the_first_on_the_way_is_told() {
    let beyond =
        "    - { src: 'on', tgt: hurry, events: [fast.ok] }\n    - { src: hurry, tgt: left, events: [e_far] }\n";
    assert_eq!(told(&checked(beyond)).len(), 1);
    // Who passes through has been there.
    let passed =
        "    - { src: 'on', tgt: hurry, events: [e_fast] }\n    - { src: hurry, tgt: 'on', events: [e_done] }\n";
    assert_eq!(told(&checked(passed)), []);
}

/// An answer goes to the state that asked, while that is active: a state beside it waits in vain.
#[test]
fn an_answer_goes_to_nobody_beside_who_asked() {
    let vain = |more: &str| {
        let report = checked(&format!("    - {{ src: 'on', tgt: hurry, events: [e_fast] }}\n{more}"));
        let never = report.findings.iter().filter(|finding| finding.code.0 == "coord::answer_never_comes");
        never.map(|finding| (finding.severity, finding.message.clone())).collect::<Vec<_>>()
    };
    let beside = "    - { src: hurry, tgt: far, events: [e_far] }\n    - { src: far, tgt: leaving, events: [e_end] }\n    - { src: far, tgt: 'on', events: [fast.ok, fast.failed] }\n";
    let message = "`fast.failed`, `fast.ok` never come in `root.far`: an answer goes to the state that asked, `root.hurry`, and is lost when that is left";
    assert_eq!(vain(beside), [(Severity::Warning, message.to_owned())]);
    // What is asked for on a transition goes to all that is inside of what is around it.
    let asked = "    - { src: hurry, tgt: far, events: [e_far], effect: [fast] }\n    - { src: far, tgt: leaving, events: [e_end, fast.ok] }\n";
    assert_eq!(vain(asked), []);
}

/// What only Davit tells is raised by nobody else: a parent, or a component, that did would tell what has not happened.
#[test]
fn nobody_else_raises_an_answer() {
    let codes = |deployment: &str, conf: &str| {
        let files = [
            ("cell.yaml", deployment.to_owned()),
            ("conf.yaml", conf.to_owned()),
            ("coord.yaml", coordinator("    - { src: 'on', tgt: hurry, events: [e_fast] }\n")),
        ];
        let deployment = load(&Sources::memory(files), "cell.yaml", &[]).deployment.expect("it can be read");
        let found = check::run(deployment.clone(), &catalogue(&deployment)).findings;
        found
            .into_iter()
            .filter(|finding| finding.severity > Severity::Info)
            .map(|finding| finding.code.0)
            .collect::<Vec<_>>()
    };
    let without = codes(DEPLOYMENT, CONFIGURATIONS);
    assert!(without.iter().all(|code| code.starts_with("chart::")), "{without:?}");
    for more in ["accepts: [build.ok]", "accepts: [fast]", "emits: [build.undone]", "emits: [fast]"] {
        assert!(codes(&format!("{DEPLOYMENT}{more}\n"), CONFIGURATIONS).contains(&"compose::word"), "{more}");
    }
    let reaction = "simulated: { reactions: [{ after: create lamp, raise: fast.ok, component: lamp }] }\n";
    assert!(codes(&format!("{DEPLOYMENT}{reaction}"), CONFIGURATIONS).contains(&"type::no_event"));
    let raises = checked(
        "    - { src: 'on', tgt: hurry, events: [e_fast] }\n    - { src: hurry, tgt: far, events: [e_far], effect: [build.ok] }\n",
    );
    let refused =
        raises.findings.iter().any(|finding| finding.is_error() && finding.message.contains("`build.ok` is an answer"));
    assert!(refused, "{:#?}", raises.findings);
    // And what confirms is not written nearly.
    let confirm = CONFIGURATIONS.replace("value: 1.0 } }]", "value: 1.0 } }], confirm: { event: e_fsat, within: 1.0 }");
    assert!(codes(DEPLOYMENT, &confirm).contains(&"coord::near_event"));
}
