//! Files that differ in values of properties alone: what follows from one of them follows from the other, so it is followed once.

use super::composed::{HANDS_DOWN, catalogue, files, load};
use davit::check::{self, is_alike};
use davit::lang::Sources;
use davit::model::{Code, Deployment, Severity};

/// What is followed of a pair with these two subsystems, and what is found.
fn of_pair(changes: &[(&str, &str, &str)], both: &str) -> (check::Explored, Vec<String>, Vec<(Code, String)>) {
    let before = "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }\n  right: { deployment: arm.yaml }";
    let changes = [changes, &[("pair.yaml", before, both)]].concat();
    let whole = load(&files(&changes), "pair.yaml", &[]).deployment.unwrap();
    let report = check::run(whole.clone(), &catalogue(&whole));
    let found = report.findings.iter().map(|finding| (finding.code, finding.message.clone())).collect();
    (report.explored, report.left, found)
}

/// It is followed once where two differ in values alone, and twice where one of these is the one that the property has by itself.
fn once_where_values_differ(followed: impl Fn(&str, &str) -> (check::Explored, Vec<String>, Vec<(Code, String)>)) {
    let once = followed("0.7", "0.7");
    assert_eq!(once, followed("0.7", "0.6"));
    // 1.0 is what the property has by itself: that it is set changes nothing there.
    let (left, right) = (followed("1.0", "0.6"), followed("0.6", "1.0"));
    assert!(left.0.states > once.0.states && right.0.states > once.0.states, "{left:?} {right:?} {once:?}");
}

#[test]
fn instances_that_differ_in_values_alone_are_followed_once() {
    once_where_values_differ(|left, right| {
        of_pair(
            &[],
            &format!(
                "left: {{ deployment: arm.yaml, parameters: {{ gain: {left} }} }}\n  right: {{ deployment: arm.yaml, parameters: {{ gain: {right} }} }}"
            ),
        )
    });
}

/// The same of files with subsystems of their own.
#[test]
fn instances_with_subsystems_that_differ_in_values_alone_are_followed_once() {
    once_where_values_differ(|left, right| {
        of_pair(
            &HANDS_DOWN,
            &format!(
                "left: {{ deployment: mid.yaml, parameters: {{ stiffness: {left} }} }}\n  right: {{ deployment: mid.yaml, parameters: {{ stiffness: {right} }} }}"
            ),
        )
    });
}

#[test]
fn a_value_that_is_wrong_is_told_though_what_follows_is_known() {
    let narrow = ("arm.yaml", "k: { type: float, default: 1.0 }", "k: { type: float, default: 1.0, min: 0.3 }");
    let with = |right: &str| {
        let text = format!("right: {{ deployment: arm.yaml, parameters: {{ gain: {right} }} }}");
        let files = files(&[narrow, ("pair.yaml", "right: { deployment: arm.yaml }", &text)]);
        let whole = load(&files, "pair.yaml", &[]).deployment.unwrap();
        let report = check::run(whole.clone(), &catalogue(&whole));
        let codes = report.findings.iter().filter(|finding| finding.severity == Severity::Error);
        codes.map(|finding| finding.code.0).collect::<Vec<_>>()
    };
    assert!(with("0.6").is_empty(), "{:?}", with("0.6"));
    assert_eq!(with("0.2").len(), 1, "{:?}", with("0.2"));
}

/// A component with two properties that two alternatives set, the values being those of the file's parameters.
fn valued(values: &[f64; 6]) -> Deployment {
    let [a, b, c, d, e, f] = values;
    let deployment = "davit: 1
name: valued
platform: simulated
types:
  T: { properties: { k: { type: float, default: 1.0 }, m: { type: float, default: 1.0 } } }
configurations: [conf.lua]
coordinator: coordinator.lua
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
operator: [by_hand]
";
    let configurations = format!(
        "ConfiguratorConf {{
  make = Configuration {{ create('T1', 'T', {{ properties = {{ k = {a} }} }}) }},
  one = Configuration {{ group = 'mode', property_set('T1.k', {b}) }},
  two = Configuration {{ group = 'mode', property_set('T1.k', {c}), property_set('T1.m', {d}) }},
  over = Configuration {{ property_set('T1.m', {e}) }},
  by_hand = Configuration {{ property_set('T1.k', {f}) }},
}}"
    );
    let coordinator = "return state {
  idle = state {}, making = state { entry = 'make' },
  on = state { one = state { config = 'one' }, two = state { config = 'two', entry = 'over' },
    trans { src = 'initial', tgt = 'one' }, trans { src = 'one', tgt = 'two', events = { 'e_two' } },
    trans { src = 'two', tgt = 'one', events = { 'e_one' }, effect = 'over.undo' } },
  off = state { entry = 'make.undo' },
  trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
  trans { src = 'making', tgt = 'on', events = { 'make.ok' } }, trans { src = 'making', tgt = 'idle', events = { 'make.failed' } },
  trans { src = 'on', tgt = 'off', events = { 'e_shutdown' } }, trans { src = 'off', tgt = 'idle', events = { 'make.undone' } },
}";
    let sources = Sources::memory([
        ("valued.yaml", deployment.to_owned()),
        ("conf.lua", configurations),
        ("coordinator.lua", coordinator.to_owned()),
    ]);
    let loaded = load(&sources, "valued.yaml", &[]);
    loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings))
}

#[test]
fn what_follows_from_one_follows_from_what_is_alike() {
    let mut seed = 0x2545_F491_4F6C_DD1D_u64;
    let mut pick = move |of: usize| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        usize::try_from(seed % of as u64).unwrap()
    };
    let seen = |of: &Deployment| {
        let report = check::run(of.clone(), &catalogue(of));
        let told: Vec<_> =
            report.findings.iter().map(|finding| (finding.code, finding.severity, finding.message.clone())).collect();
        (report.explored, report.left, told, report.traces)
    };
    let (mut alike, mut differ, mut follows) = (0, 0, 0);
    for _ in 0..400 {
        let mut values = || [(); 6].map(|()| [1.0, 1.5, 2.0, 2.5][pick(4)]);
        let both = [values(), values()];
        let [one, other] = both.map(|values| valued(&values));
        let same = is_alike(&one, &other, &catalogue(&one));
        assert_eq!(same, is_alike(&other, &one, &catalogue(&one)), "both ways: {both:?}");
        if !same && differ > 60 {
            continue;
        }
        let of = [seen(&one), seen(&other)];
        let agree = of[0] == of[1];
        match same {
            true => {
                assert!(agree, "{both:?} {of:#?}");
                alike += 1;
            }
            false => {
                differ += 1;
                follows += usize::from(!agree);
            }
        }
    }
    // Were two taken for alike whose values are not, that would be seen.
    assert!(alike > 5 && follows > 10, "{alike} alike; of {differ} others {follows} lead to something else");
}

/// A file with these types, configurations and further keys, whose coordinator applies `make` and then `one`.
fn file(types: &str, configurations: &str, more: &str) -> Deployment {
    let deployment = format!(
        "davit: 1\nname: file\nplatform: simulated\nlibraries: [standard]\ntypes: {{ {types} }}\nconfigurations: [conf.lua]\n\
         coordinator: coordinator.lua\ndeploy: {{ event: e_start, up: on, within_s: 5 }}\n\
         shutdown: {{ event: e_shutdown, down: idle, within_s: 5 }}\n{more}"
    );
    let coordinator = "return state {
  idle = state {}, making = state { entry = 'make' }, on = state { entry = 'one' }, off = state { entry = { 'one.undo', 'make.undo' } },
  trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
  trans { src = 'making', tgt = 'on', events = { 'make.ok' } }, trans { src = 'on', tgt = 'off', events = { 'e_shutdown' } },
  trans { src = 'off', tgt = 'idle', events = { 'make.undone' } },
}";
    let sources = Sources::memory([
        ("file.yaml", deployment),
        ("conf.lua", format!("ConfiguratorConf {{ {configurations} }}")),
        ("coordinator.lua", coordinator.to_owned()),
        ("monitors.lua", "Monitors { low = monitor { when = below('S.y', 5.0), event = 'e_low' } }".to_owned()),
    ]);
    let loaded = load(&sources, "file.yaml", &[]);
    loaded.deployment.unwrap_or_else(|| panic!("{:#?}", loaded.findings))
}

fn alike(types: &str, configurations: [&str; 2], more: &str) -> bool {
    let [one, other] = configurations.map(|configurations| file(types, configurations, more));
    is_alike(&one, &other, &catalogue(&one))
}

#[test]
fn things_that_are_there_once_are_told_apart_by_their_names() {
    let types = "T: { exclusive: ['bus:{b}'], properties: { b: { type: string, tunable: unconfigured } } }";
    let with = |values: [&str; 4]| {
        let [a, b, c, d] = values;
        format!(
            "make = Configuration {{ create('A', 'T', {{ properties = {{ b = '{a}' }} }}), create('B', 'T', {{ properties = {{ b = '{b}' }} }}) }},
             one = Configuration {{ property_set('A.b', '{c}'), property_set('B.b', '{d}'), post_conf_state = {{ 'A:stopped', 'B:stopped' }} }}"
        )
    };
    // Both may hold both in both files, and in one of them at once.
    let [apart, clash] = [["x", "y", "y", "x"], ["y", "y", "x", "x"]].map(with);
    assert!(!alike(types, [&apart, &clash], "") && !alike(types, [&clash, &apart], ""));
    let [one, other] = [["x", "y", "u", "v"], ["1", "2", "3", "4"]].map(with);
    assert!(alike(types, [&one, &other], ""), "nobody's twice");
}

#[test]
fn what_a_component_is_replaced_with_counts() {
    let types = "T: { properties: { k: { type: float, default: 1.0 } } }";
    let with = |k: &str| {
        format!(
            "make = Configuration {{ create('A', 'T', {{ properties = {{ k = 9.0 }} }}) }}, one = Configuration {{ property_set('A.k', {k}) }},
             again = Configuration {{ replace('A', 'T', {{ properties = {{ k = 2.0 }} }}) }}"
        )
    };
    let [same, other, third] = ["2.0", "3.0", "4.0"].map(with);
    assert!(!alike(types, [&same, &other], "") && !alike(types, [&other, &same], ""));
    assert!(alike(types, [&other, &third], ""));
}

#[test]
fn values_that_are_asked_for_are_the_same_in_what_is_alike() {
    let enabled = |low: bool| {
        format!(
            "make = Configuration {{ create('S', 'standard.Sine'), create('M', 'davit.Monitors', {{ properties = {{ low = {low} }} }}) }},
             one = Configuration {{}}"
        )
    };
    let monitors = "monitors: [monitors.lua]\n";
    assert!(alike("", [&enabled(true), &enabled(true)], monitors));
    assert!(!alike("", [&enabled(true), &enabled(false)], monitors), "a monitor that watches, and one that does not");
    let types = "T: { properties: { k: { type: bool, default: false } } }";
    let given = |k: bool| {
        format!(
            "make = Configuration {{ create('A', 'T', {{ properties = {{ k = {k} }} }}) }}, one = Configuration {{}}"
        )
    };
    assert!(alike(types, [&given(true), &given(false)], ""));
    assert!(!alike(types, [&given(true), &given(false)], "operator: [A.k]\n"), "the other one is the operator's");
}

#[test]
fn who_is_refused_for_its_values_stands_for_nobody() {
    let narrow = ("arm.yaml", "k: { type: float, default: 1.0 }", "k: { type: float, default: 1.0, min: 0.3 }");
    // An undo that fails is answered, and nobody hears that: only who follows finds where it leads.
    let deaf = "trans { src = 'unmaking', tgt = 'undone', events = { 'make.undo.failed', 'make.undo.broken' } },";
    let told = |left: &str| {
        let text = format!("left: {{ deployment: arm.yaml, parameters: {{ gain: {left} }} }}");
        let changes = [
            narrow,
            ("arm.lua", deaf, ""),
            ("pair.yaml", "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }", &*text),
        ];
        let whole = load(&files(&changes), "pair.yaml", &[]).deployment.unwrap();
        let findings = check::run(whole.clone(), &catalogue(&whole)).findings;
        findings.into_iter().map(|finding| finding.code.0).collect::<Vec<_>>()
    };
    let (both, one) = (told("0.7"), told("0.2"));
    assert!(both.contains(&"coord::stuck") && !both.contains(&"conf::bad_value"), "{both:?}");
    assert!(one.contains(&"coord::stuck") && one.contains(&"conf::bad_value"), "{one:?}");
}

#[test]
fn what_a_parent_sets_is_a_step_whatever_the_type_says() {
    let followed = |value: &str| {
        let stiff = format!("stiff = Configuration {{ property_set('left.k', {value}) }}");
        let changes = [
            ("pair_conf.lua", "stiff = Configuration { property_set('left.k', 2.0) }", &*stiff),
            ("pair.lua", "coupled = state {}", "coupled = state { entry = 'stiff' }"),
            (
                "pair.lua",
                "parting = state { entry = 'couple.undo' }",
                "parting = state { entry = { 'stiff.undo', 'couple.undo' } }",
            ),
        ];
        let whole = load(&files(&changes), "pair.yaml", &[]).deployment.unwrap();
        check::run(whole.clone(), &catalogue(&whole)).explored
    };
    // 1.0 is what the type has by itself; the subsystem has set another one.
    assert_eq!(followed("1.0"), followed("2.0"));
}
