//! Deployments with subsystems: what each file is held to, and that what is found file by file holds of all together.

use super::automata::{SOLO, SOLO_CONF, SOLO_COORDINATOR, solo};
use davit::check::{self, Effort};
use davit::lang::{self, LoadOptions, Sources};
use davit::libraries::monitors;
use davit::model::{Catalogue, Deployment, Finding, Severity};
use davit::runtime::Libraries;
use std::path::Path;

const ARM: &str = "davit: 1
name: arm
platform: simulated
types:
  Drive:
    ports: { pose: { direction: out, type: float }, ref: { direction: in, type: float } }
    properties: { k: { type: float, default: 1.0 } }
    operations: { brake: { effect: none } }
parameters: { gain: { type: float, default: 0.5, min: 0.0, max: 2.0 } }
exports:
  ports: { pose: D.pose, ref: D.ref }
  properties: { k: D.k }
  from: e_built
accepts: [e_released]
emits: [e_built, e_leaving]
leaving: { says: e_leaving, until: e_released }
configurations: [arm_conf.lua]
coordinator: arm.lua
deploy: { event: e_start, up: on, within_s: 5 }
shutdown: { event: e_shutdown, down: idle, within_s: 5 }
";
const ARM_CONF: &str = "ConfiguratorConf {
  make = Configuration { create('D', 'Drive'), property_set('D.k', gain), post_conf_state = { 'D:stopped' } },
  run = Configuration { post_conf_state = { 'D:running' } },
}";
const ARM_COORDINATOR: &str = "return state {
  idle = state {}, making = state { entry = 'make' }, starting = state { entry = { 'e_built', 'run' } }, on = state {},
  leaving = state { entry = 'e_leaving' }, stopping = state { entry = 'run.undo' }, unmaking = state { entry = 'make.undo' },
  undone = state {},
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
  trans { src = 'making', tgt = 'starting', events = { 'make.ok' } },
  trans { src = 'making', tgt = 'undone', events = { 'make.failed', 'make.broken' } },
  trans { src = 'making', tgt = 'unmaking', events = { 'e_shutdown' } },
  trans { src = 'undone', tgt = 'unmaking', events = { 'e_shutdown' } },
  trans { src = 'starting', tgt = 'on', events = { 'run.ok' } },
  trans { src = 'starting', tgt = 'leaving', events = { 'run.failed', 'run.broken', 'e_shutdown' } },
  trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown' } },
  trans { src = 'leaving', tgt = 'stopping', events = { 'e_released' } },
  trans { src = 'stopping', tgt = 'unmaking', events = { 'run.undone', 'run.undo.failed', 'run.undo.broken' } },
  trans { src = 'unmaking', tgt = 'idle', events = { 'make.undone' } },
  trans { src = 'unmaking', tgt = 'undone', events = { 'make.undo.failed', 'make.undo.broken' } },
}";
const PAIR: &str = "davit: 1
name: pair
platform: simulated
types: {}
subsystems:
  left: { deployment: arm.yaml, parameters: { gain: 0.7 } }
  right: { deployment: arm.yaml }
configurations: [pair_conf.lua]
coordinator: pair.lua
deploy: { event: e_start, up: coupled, within_s: 10 }
shutdown: { event: e_shutdown, down: idle, within_s: 10 }
";
const PAIR_CONF: &str = "ConfiguratorConf {
  couple = Configuration { connect('left.pose', 'right.ref'), connect('right.pose', 'left.ref') },
  stiff = Configuration { property_set('left.k', 2.0) },
}";
const PAIR_COORDINATOR: &str = "return state {
  idle = state {},
  alive = state {
    raising = state { entry = { 'left/e_start', 'right/e_start' } }, one = state {}, two = state {},
    coupling = state { entry = 'couple' }, coupled = state {},
    trans { src = 'initial', tgt = 'raising' },
    trans { src = 'raising', tgt = 'one', events = { 'left/up' } },
    trans { src = 'raising', tgt = 'two', events = { 'right/up' } },
    trans { src = 'one', tgt = 'coupling', events = { 'right/up' } },
    trans { src = 'two', tgt = 'coupling', events = { 'left/up' } },
    trans { src = 'coupling', tgt = 'coupled', events = { 'couple.ok' } },
  },
  parting = state { entry = 'couple.undo' },
  lowering = state { entry = { 'left/e_shutdown', 'right/e_shutdown', 'left/e_released', 'right/e_released' } },
  lone = state {}, ltwo = state {},
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'alive', events = { 'e_start' } },
  trans { src = 'alive', tgt = 'parting',
          events = { 'e_shutdown', 'left/e_leaving', 'right/e_leaving', 'couple.failed', 'couple.broken' } },
  trans { src = 'parting', tgt = 'lowering', events = { 'couple.undone', 'couple.undo.failed', 'couple.undo.broken' } },
  trans { src = 'lowering', tgt = 'lone', events = { 'left/down' } },
  trans { src = 'lowering', tgt = 'ltwo', events = { 'right/down' } },
  trans { src = 'lone', tgt = 'idle', events = { 'right/down' } },
  trans { src = 'ltwo', tgt = 'idle', events = { 'left/down' } },
}";

/// An arm passed on.
const MID: &str = "davit: 1
name: mid
platform: simulated
types: {}
subsystems: { inner: { deployment: arm.yaml } }
exports: { ports: { pose: inner.pose, ref: inner.ref }, properties: { k: inner.k } }
accepts: [e_released]
emits: [e_leaving]
leaving: { says: e_leaving, until: e_released }
configurations: [mid_conf.lua]
coordinator: mid.lua
deploy: { event: e_start, up: on, within_s: 8 }
shutdown: { event: e_shutdown, down: idle, within_s: 8 }
";
const MID_COORDINATOR: &str = "return state {
  idle = state {}, raising = state { entry = 'inner/e_start' }, on = state {}, leaving = state { entry = 'e_leaving' },
  lowering = state { entry = { 'inner/e_shutdown', 'inner/e_released' } },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'on', events = { 'inner/up' } },
  trans { src = 'raising', tgt = 'lowering', events = { 'e_shutdown' } },
  trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown', 'inner/e_leaving' } },
  trans { src = 'leaving', tgt = 'lowering', events = { 'e_released' } },
  trans { src = 'lowering', tgt = 'idle', events = { 'inner/down' } },
}";
/// Two coordinators for a pair: one begins and ends, the other touches.
pub const LEAD: &str = "return state {
  idle = state {}, raising = state { entry = { 'left/e_start', 'right/e_start' } }, on = state {},
  lowering = state { entry = { 'left/e_shutdown', 'right/e_shutdown', 'left/e_released', 'right/e_released' } },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'on', events = { 'left/up' } },
  trans { src = 'raising', tgt = 'lowering', events = { 'e_shutdown' } },
  trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown' } },
  trans { src = 'lowering', tgt = 'idle', events = { 'left/down' } },
}";
pub const LINK: &str = "return state {
  idle = state {}, waiting = state {}, joining = state { entry = 'stiff' }, joined = state {}, parting = state { entry = 'stiff.undo' },
  trans { src = 'initial', tgt = 'idle' },
  trans { src = 'idle', tgt = 'waiting', events = { 'e_start' } },
  trans { src = 'waiting', tgt = 'joining', events = { 'left/up' } },
  trans { src = 'waiting', tgt = 'idle', events = { 'e_shutdown' } },
  trans { src = 'joining', tgt = 'joined', events = { 'stiff.ok' } },
  trans { src = 'joining', tgt = 'parting', events = { 'stiff.failed', 'stiff.broken' } },
  trans { src = 'joined', tgt = 'parting', events = { 'e_shutdown' } },
  trans { src = 'parting', tgt = 'idle', events = { 'stiff.undone', 'stiff.undo.failed', 'stiff.undo.broken' } },
}";
const VOICE: &str = "return state {
  quiet = state {}, loud = state { entry = 'e_built' },
  trans { src = 'initial', tgt = 'quiet' },
  trans { src = 'quiet', tgt = 'loud', events = { 'e_start' } },
  trans { src = 'loud', tgt = 'quiet', events = { 'e_shutdown' } },
}";

/// The files of the pair, some of them changed: `(file, what stands there, what is to stand there)`.
pub fn files(changes: &[(&str, &str, &str)]) -> Sources {
    let mut files = [
        ("arm.yaml", ARM.to_owned()),
        ("arm_conf.lua", ARM_CONF.to_owned()),
        ("arm.lua", ARM_COORDINATOR.to_owned()),
        ("pair.yaml", PAIR.to_owned()),
        ("pair_conf.lua", PAIR_CONF.to_owned()),
        ("pair.lua", PAIR_COORDINATOR.to_owned()),
        ("mid.yaml", MID.to_owned()),
        ("mid_conf.lua", "ConfiguratorConf {}".to_owned()),
        ("mid.lua", MID_COORDINATOR.to_owned()),
        ("lead.lua", LEAD.to_owned()),
        ("link.lua", LINK.to_owned()),
        ("voice.lua", VOICE.to_owned()),
        ("solo.yaml", SOLO.to_owned()),
        ("solo_conf.lua", SOLO_CONF.to_owned()),
        ("solo.lua", SOLO_COORDINATOR.to_owned()),
    ];
    for (file, before, after) in changes {
        let text = &mut files.iter_mut().find(|(name, _)| name == file).expect("a file of the pair").1;
        assert!(text.contains(before), "{file} has no `{before}`");
        *text = text.replacen(before, after, 1);
    }
    Sources::memory(files)
}

pub fn load(sources: &Sources, file: &str, set: &[(&str, &str)]) -> lang::Loaded {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    lang::load_from(sources, Path::new(file), &LoadOptions { set, ..LoadOptions::default() })
}

pub fn catalogue(deployment: &Deployment) -> Catalogue {
    let mut catalogue = monitors::added_to(Libraries::default(), &deployment.monitors).catalogue();
    deployment.types.iter().for_each(|ty| _ = catalogue.insert(ty.clone()));
    catalogue
}

/// What reading finds, or, where it finds nothing, what `check` finds.
pub fn found(changes: &[(&str, &str, &str)]) -> Vec<Finding> {
    let loaded = load(&files(changes), "pair.yaml", &[]);
    match loaded.deployment {
        Some(deployment) if loaded.findings.is_empty() => {
            let catalogue = catalogue(&deployment);
            check::run(deployment, &catalogue).findings
        }
        _ => loaded.findings,
    }
}

/// The one finding of that code: what it says, and what it says to do.
pub fn one(changes: &[(&str, &str, &str)], code: &str) -> (String, String) {
    let found = found(changes);
    let of: Vec<&Finding> =
        found.iter().filter(|finding| finding.code.0 == code && finding.severity > Severity::Info).collect();
    let [one] = &of[..] else { panic!("{code}: {found:#?}") };
    (one.message.clone(), one.help.clone().unwrap_or_default())
}

#[test]
fn each_file_is_followed_alone_and_their_product_never() {
    let whole = load(&files(&[]), "pair.yaml", &[]).deployment.unwrap();
    let together = check::run(whole.clone(), &catalogue(&whole));
    let errors: Vec<&Finding> = together.findings.iter().filter(|finding| finding.is_error()).collect();
    assert!(errors.is_empty(), "{errors:#?}");
    assert!(together.checked.is_some());
    let arm = load(&files(&[]), "arm.yaml", &[]).deployment.unwrap();
    let alone = check::run(arm.clone(), &catalogue(&arm)).explored;
    let parents = together.explored.states - 2 * alone.states;
    assert!(alone.states > 20 && parents > 20, "{alone:?} {:?}", together.explored);
    let effort = Effort { together: true, ..Effort::default() };
    let product = check::run_with(whole.clone(), &catalogue(&whole), effort).explored;
    assert!(product.states > 5 * together.explored.states, "{product:?} {:?}", together.explored);
    // What is wrong in a file that is there twice is told once.
    let told = |code: &str| together.findings.iter().filter(|finding| finding.code.0 == code).count();
    let in_arm = check::run(arm.clone(), &catalogue(&arm)).findings;
    let unhandled = in_arm.iter().filter(|finding| finding.code.0 == "coord::failure_unhandled").count();
    assert!(told("coord::failure_unhandled") <= unhandled + 2, "{:#?}", together.findings);
}

/// A subsystem is begun by a coordinator of its parent, or never.
#[test]
fn a_subsystem_that_nobody_begins_is_warned_of() {
    let more = [("pair.yaml", "  right: {", "  spare: { deployment: arm.yaml }\n  right: {")];
    let unbegun = |changes: &[(&str, &str, &str)]| {
        let all = found(changes).into_iter().filter(|finding| finding.code.0 == "compose::unbegun");
        all.map(|finding| (finding.severity, finding.message)).collect::<Vec<_>>()
    };
    assert_eq!(unbegun(&[]), []);
    let told = "nobody begins `spare`: no coordinator raises `spare/e_start`".to_owned();
    assert_eq!(unbegun(&more), [(Severity::Warning, told)]);
}

/// A parent that ends a subsystem where it has not begun it waits in vain to hear that it is down, and is told what comes instead.
#[test]
fn who_ends_what_was_not_begun_is_told_to_hear_that_this_is_ignored() {
    let late = |waits: &str| {
        let waits = format!("tgt = 'idle', events = {{ {waits} }}");
        let changes = [
            ("pair.yaml", "coordinator: pair.lua", "coordinator: lead.lua"),
            ("pair.yaml", "up: coupled", "up: on"),
            (
                "lead.lua",
                "  trans { src = 'idle', tgt = 'raising', events = { 'e_start' } },",
                "  waiting = state {}, trans { src = 'idle', tgt = 'waiting', events = { 'e_start' } },
                 trans { src = 'waiting', tgt = 'raising', events = { 'e_go' } },
                 trans { src = 'waiting', tgt = 'lowering', events = { 'e_shutdown' } },",
            ),
            ("lead.lua", "tgt = 'idle', events = { 'left/down' }", waits.as_str()),
        ];
        let stuck = found(&changes).into_iter().filter(|finding| finding.code.0 == "coord::stuck");
        stuck.map(|finding| (finding.message, finding.help.unwrap_or_default())).collect::<Vec<_>>()
    };
    let told = late("'left/down'");
    let [(message, help)] = &told[..] else { panic!("{told:?}") };
    let whole = "what `root.lowering` waits for never comes: `left/down`, for on this way `left` was not begun, or is down again, and ignores `left/e_shutdown`";
    assert_eq!(message, whole);
    assert_eq!(help, "hear `left/e_shutdown.ignored` there as well: that is told then");
    assert_eq!(late("'left/down', 'left/e_shutdown.ignored'"), []);
}

/// Where nothing is known of the order in which a subsystem tells things (its coordinators are followed apart), what it ignores is known all the
/// same: where its file takes the event that ends it everywhere but in *down*, that it ignores it says that it is down.
#[test]
fn a_subsystem_that_ignores_its_end_is_down_if_it_takes_that_everywhere_else() {
    const PLAIN: &str = "return state {
      idle = state {}, making = state { entry = 'make' }, starting = state { entry = 'run' }, on = state {},
      stopping = state { entry = 'run.undo' }, unmaking = state { entry = 'make.undo' }, undone = state {},
      trans { src = 'initial', tgt = 'idle' },
      trans { src = 'idle', tgt = 'making', events = { 'e_start' } },
      trans { src = 'making', tgt = 'starting', events = { 'make.ok' } },
      trans { src = 'making', tgt = 'undone', events = { 'make.failed', 'make.broken' } },
      trans { src = 'making', tgt = 'unmaking', events = { 'e_shutdown' } },
      trans { src = 'undone', tgt = 'unmaking', events = { 'e_shutdown' } },
      trans { src = 'starting', tgt = 'on', events = { 'run.ok' } },
      trans { src = 'starting', tgt = 'undone', events = { 'run.failed', 'run.broken' } },
      trans { src = 'starting', tgt = 'stopping', events = { 'e_shutdown' } },
      trans { src = 'on', tgt = 'stopping', events = { 'e_shutdown' } },
      trans { src = 'stopping', tgt = 'unmaking', events = { 'run.undone', 'run.undo.failed', 'run.undo.broken' } },
      trans { src = 'unmaking', tgt = 'idle', events = { 'make.undone' } },
      trans { src = 'unmaking', tgt = 'undone', events = { 'make.undo.failed', 'make.undo.broken' } },
    }";
    const PARENT: &str = "return state {
      idle = state {}, early = state {}, raising = state { entry = 'left/e_start' }, on = state { entry = 'stiff' },
      parting = state { entry = 'stiff.undo' }, lowering = state { entry = 'left/e_shutdown' },
      trans { src = 'initial', tgt = 'idle' },
      trans { src = 'idle', tgt = 'early', events = { 'e_start' } },
      trans { src = 'early', tgt = 'raising', events = { 'e_go' } },
      trans { src = 'early', tgt = 'lowering', events = { 'e_shutdown' } },
      trans { src = 'raising', tgt = 'on', events = { 'left/up' } },
      trans { src = 'raising', tgt = 'lowering', events = { 'left/failed', 'e_shutdown' } },
      trans { src = 'on', tgt = 'parting', events = { 'e_shutdown', 'stiff.failed', 'stiff.broken' } },
      trans { src = 'parting', tgt = 'lowering', events = { 'stiff.undone', 'stiff.undo.failed', 'stiff.undo.broken' } },
      trans { src = 'lowering', tgt = 'idle', events = { 'left/down', 'left/e_shutdown.ignored' } },
      AGAIN
    }";
    let found = |keen: bool, again: bool, failed: &str| {
        let hears = "trans { src = 'stopping', tgt = 'stopping', events = { 'e_shutdown' } },
             trans { src = 'unmaking', tgt = 'unmaking', events = { 'e_shutdown' } },
             trans { src = 'making', tgt";
        let plain = if keen { PLAIN.replacen("trans { src = 'making', tgt", hears, 1) } else { PLAIN.to_owned() };
        let plain = plain.replace("src = 'starting', tgt = 'undone'", &format!("src = 'starting', tgt = '{failed}'"));
        let once_more = "held = state {}, trans { src = 'lowering', tgt = 'held', events = { 'e_hold' } },
             trans { src = 'held', tgt = 'lowering', events = { 'e_shutdown', 'e_go' } },";
        let parent = PARENT.replace("AGAIN", if again { once_more } else { "" });
        let promise = "  from: e_built\naccepts: [e_released]\nemits: [e_built, e_leaving]\n\
                       leaving: { says: e_leaving, until: e_released }\n";
        let all = solo(&[
            ("arm.yaml", promise, ""),
            ("arm.yaml", "coordinator: arm.lua", "coordinators: { arm: arm.lua, voice: voice.lua }"),
            ("arm.yaml", "up: on", "up: [arm:on, voice:loud]"),
            ("arm.yaml", "down: idle", "down: [arm:idle, voice:quiet]"),
            ("arm.lua", ARM_COORDINATOR, &plain),
            ("voice.lua", "{ entry = 'e_built' }", "{}"),
            ("solo.lua", SOLO_COORDINATOR, &parent),
        ]);
        let promise = all.into_iter().filter(|finding| finding.code.0 == "compose::promise" && finding.is_error());
        promise.map(|finding| finding.help.unwrap_or_default()).collect::<Vec<_>>()
    };
    assert_eq!(found(true, true, "undone"), [""; 0]);
    // Else where it is ended once: that it ignores as well what comes while it is led down is another matter.
    assert_eq!(found(false, false, "undone"), [""; 0]);
    for (again, failed) in [(true, "undone"), (false, "stopping")] {
        let told = found(false, again, failed);
        let deaf = ["stopping", "unmaking"]
            .map(|state| format!("for it ignores that in `root.{state}` as well: hear `e_shutdown` there"));
        assert!(!told.is_empty() && deaf.iter().any(|why| told[0].contains(why)), "{told:?}");
    }
}

#[test]
fn a_parent_touches_what_is_exported_and_nothing_else() {
    let pose = "connect('left.pose', 'right.ref')";
    let (says, help) = one(&[("pair_conf.lua", pose, "connect('left/D.pose', 'right.ref')")], "compose::not_exported");
    assert!(says.starts_with("`left/D.pose` is in `left`") && help == "write `left.pose`", "{says}: {help}");
    let inner = [("arm.yaml", "pose: D.pose, ", ""), ("pair_conf.lua", pose, "connect('left/D.pose', 'right.ref')")];
    let others = found(&inner);
    let help: Vec<&str> = others.iter().filter_map(|finding| finding.help.as_deref()).collect();
    assert!(help.iter().any(|help| help.contains("`exports: { ports: { pose: D.pose } }`")), "{others:#?}");
    let (says, help) = one(&[("pair_conf.lua", pose, "connect('left.pase', 'right.ref')")], "compose::not_exported");
    assert_eq!((says.as_str(), help.as_str()), ("`left.pase` is nothing that `left` exports", "did you mean `pose`?"));
    let (says, _) = one(
        &[("pair_conf.lua", "property_set('left.k', 2.0)", "property_set('left.ref', 2.0)")],
        "compose::not_exported",
    );
    assert_eq!(says, "`left.ref` is exported under `ports`, and not under `properties`");
    for wrong in ["destroy('left/D')", "create('left', 'Drive')", "pre_conf_state = { 'left/D:stopped' }"] {
        let (says, help) = one(&[("pair_conf.lua", "property_set('left.k', 2.0)", wrong)], "compose::not_own");
        assert!(says.contains("subsystem") && help.contains("`left/e_start`"), "{says}: {help}");
    }
    let own = ("pair_conf.lua", "couple = Configuration {", "['left/couple'] = Configuration {");
    assert!(one(&[own], "compose::name_taken").0.contains("`left/couple`"));
    // Types and directions are those of the inner thing.
    let (says, _) = one(&[("pair_conf.lua", pose, "connect('left.ref', 'right.ref')")], "conf::not_an_out_port");
    assert!(says.contains("left/D.ref"), "{says}");
    let (says, _) =
        one(&[("pair_conf.lua", "property_set('left.k', 2.0)", "property_set('left.k', true)")], "conf::bad_value");
    assert!(says.contains("left/D.k"), "{says}");
}

#[test]
fn a_parent_asks_for_what_touches_an_export_only_while_it_is_there() {
    // At once, and not when both are up.
    let early = [(
        "pair.lua",
        "raising = state { entry = { 'left/e_start', 'right/e_start' } }",
        "raising = state { entry = { 'left/e_start', 'right/e_start', 'stiff' } }",
    )];
    let (says, help) = one(&early, "compose::promise");
    assert_eq!(says, "`stiff` is asked for where what `left` exports need not be there");
    assert!(help.contains("`left/e_built`") && help.contains("`left/e_released`"), "{help}");
    // Let go, and the frame is still there.
    let late = [(
        "pair.lua",
        "parting = state { entry = 'couple.undo' }",
        "parting = state { entry = { 'left/e_released', 'couple.undo' } }",
    )];
    let found = found(&late);
    let held = found.iter().find(|finding| finding.code.0 == "compose::promise" && finding.is_error());
    assert!(held.is_some_and(|finding| finding.message.contains("`couple`")), "{found:#?}");
    // Without the event being waited for.
    let blind = [(
        "pair.lua",
        "trans { src = 'raising', tgt = 'one', events = { 'left/up' } }",
        "trans { src = 'raising', tgt = 'one', events = { 'e_after(0.1)' } }",
    )];
    assert!(one(&blind, "compose::promise").0.contains("`left`"));
}

#[test]
fn a_subsystem_takes_nothing_away_before_it_is_let_go() {
    let hasty = [(
        "arm.lua",
        "trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown' } }",
        "trans { src = 'on', tgt = 'stopping', events = { 'e_shutdown' } }",
    )];
    let (says, help) = one(&hasty, "compose::unleft");
    assert_eq!(says, "`D`, which is exported, is not there between `e_built` and `e_released`");
    assert!(help.contains("`e_released`"), "{help}");
    let before = [("arm.lua", "making = state { entry = 'make' }", "making = state { entry = { 'e_built', 'make' } }")];
    assert!(one(&before, "compose::unleft").0.contains("`D`"));
}

/// What hands its own parameter down to the arm in it.
pub const HANDS_DOWN: [(&str, &str, &str); 2] = [
    ("mid.yaml", "types: {}", "types: {}\nparameters: { stiffness: { type: float, default: 0.4, max: 9.0 } }"),
    (
        "mid.yaml",
        "inner: { deployment: arm.yaml }",
        "inner: { deployment: arm.yaml, parameters: { gain: { parameter: stiffness } } }",
    ),
];

#[test]
fn parameters_are_handed_down() {
    let given = |left: &'static str| {
        let passed = ("pair.yaml", "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }", left);
        [HANDS_DOWN[0], HANDS_DOWN[1], passed]
    };
    let value = |left: &'static str, set: &[(&str, &str)]| {
        let loaded = load(&files(&given(left)), "pair.yaml", set);
        assert!(loaded.findings.is_empty(), "{:#?}", loaded.findings);
        let deployment = loaded.deployment.unwrap();
        let make = deployment.configurations.iter().find(|c| c.id.as_str() == "left/inner/make").unwrap();
        make.changes.iter().map(|change| change.kind.to_string()).collect::<Vec<_>>().join("; ")
    };
    assert!(value("left: { deployment: mid.yaml }", &[]).contains("D.k = 0.4"));
    let wide = "left: { deployment: mid.yaml, parameters: { stiffness: 0.9 } }";
    assert!(value(wide, &[]).contains("D.k = 0.9"));
    assert!(value(wide, &[("left.stiffness", "1.1")]).contains("D.k = 1.1"));
    // What is given to the inner one itself goes before.
    assert!(value(wide, &[("left.stiffness", "1.1"), ("left.inner.gain", "1.2")]).contains("D.k = 1.2"));
    // It is held to what both declare.
    let high = given("left: { deployment: mid.yaml, parameters: { stiffness: 3.0 } }");
    let (says, help) = one(&high, "compose::parameter");
    assert!(says.starts_with("the parameter `gain`: 3 is outside 0 … 2"), "{says}");
    assert_eq!(help, "give a value from 0 to 2");
    // It is shown where it was given, and where it is given on.
    let told = load(&files(&high), "pair.yaml", &[]);
    let high = told.findings.iter().find(|finding| finding.code.0 == "compose::parameter").unwrap();
    let file = |origin| told.sources.file(told.sources.locate(origin).expect("a place").file).name.to_string();
    let given_on = high.labels.iter().find(|label| label.text == "given on here").expect("where it is given on");
    assert!(file(high.origin).ends_with("pair.yaml") && file(given_on.origin).ends_with("mid.yaml"), "{high:#?}");
    let mut slip = given(wide);
    slip[1].2 = "inner: { deployment: arm.yaml, parameters: { gain: { parameter: stifness } } }";
    let all = load(&files(&slip), "pair.yaml", &[]).findings;
    let told: Vec<_> = all.iter().filter(|f| f.is_error()).map(|f| (f.message.as_str(), f.help.as_deref())).collect();
    assert_eq!(told, [("this file has no parameter `stifness`", Some("did you mean `stiffness`?"))]);
    let mut word = given(wide);
    word[1].2 = "inner: { deployment: arm.yaml, parameters: { gain: { paramter: stiffness } } }";
    let (says, help) = one(&word, "compose::parameter");
    assert_eq!(
        (says.as_str(), help.as_str()),
        ("`paramter: stiffness` gives nothing on", "did you mean `parameter: stiffness`?")
    );
    (slip[0].2, slip[2].2) = ("types: {}", "left: { deployment: mid.yaml }");
    let (says, help) = one(&slip, "compose::parameter");
    assert!(
        says.contains("has no parameter") && help.contains("`parameters: { stifness: { type: float } }`"),
        "{says} {help}"
    );
}

#[test]
fn parameters_are_typed_and_given_once() {
    let gain =
        |text: &str| [("pair.yaml", "gain: 0.7", text)].map(|(f, a, b)| (f.to_owned(), a.to_owned(), b.to_owned()));
    for (text, says) in [
        ("gain: 3.0", "the parameter `gain`: 3 is outside 0 … 2"),
        ("gain: fast", "the parameter `gain`:"),
        ("gian: 0.7", "there is no parameter `gian`"),
    ] {
        let [(file, before, after)] = gain(text);
        let (told, _) = one(&[(&file, &before, &after)], "compose::parameter");
        assert!(told.starts_with(says), "{told}");
    }
    let needed = [("arm.yaml", "default: 0.5, ", "")];
    let (says, help) = one(&needed, "compose::parameter");
    assert!(says.contains("`right` does not give the parameter `gain`") && help.contains("default"), "{says}: {help}");
    // By the command line, to any depth.
    let value = |set: &[(&str, &str)]| {
        let deployment = load(&files(&[]), "pair.yaml", set).deployment.unwrap();
        let make = deployment.configurations.iter().find(|c| c.id.as_str() == "left/make").unwrap();
        make.changes.iter().map(|change| change.kind.to_string()).collect::<Vec<_>>().join("; ")
    };
    assert!(value(&[]).contains("left/D.k = 0.7"), "{}", value(&[]));
    assert!(value(&[("left.gain", "1.5")]).contains("left/D.k = 1.5"), "{}", value(&[("left.gain", "1.5")]));
    // One that is not given, or not as it is to be, is told once, and not by those who read it; a number may be meant as a text.
    let text = [
        ("arm.yaml", "type: float, default: 0.5, min: 0.0, max: 2.0", "type: string"),
        ("arm_conf.lua", "property_set('D.k', gain)", "property_set('D.k', #gain)"),
    ];
    let told = |set: &[(&str, &str)]| {
        let findings = load(&files(&text), "arm.yaml", set).findings;
        findings.into_iter().map(|finding| finding.help.unwrap_or_default()).collect::<Vec<_>>()
    };
    assert_eq!(told(&[]), ["give it (string): `--set gain=…`; or write a `default` where it is declared"]);
    assert_eq!(told(&[("gain", "3")]), Vec::<String>::new());
    let misspelt = told(&[("gian", "x")]);
    assert!(misspelt.len() == 2 && misspelt[1] == "did you mean `gain`?", "{misspelt:?}");
    let inside = found(&needed);
    assert!(
        inside.iter().any(|f| f.help.as_ref().is_some_and(|help| help.contains("`--set right.gain=…`"))),
        "{inside:#?}"
    );
    let unread = [("arm_conf.lua", "property_set('D.k', gain)", "property_set('D.k', 1.0)")];
    let unread = load(&files(&unread), "arm.yaml", &[]).findings;
    assert!(
        unread.iter().any(|f| f.help.as_ref().is_some_and(|help| help.contains("files in YAML read none"))),
        "{unread:#?}"
    );
    let wrong = load(&files(&[]), "pair.yaml", &[("left.gian", "1.5")]);
    assert!(wrong.findings.iter().any(|finding| finding.is_error()), "{:?}", wrong.findings);
}

#[test]
fn files_that_do_not_fit_each_other_are_told() {
    let circle = [(
        "arm.yaml",
        "configurations: [arm_conf.lua]",
        "configurations: [arm_conf.lua]\nsubsystems: { inner: { deployment: pair.yaml } }",
    )];
    assert!(found(&circle).iter().any(|finding| finding.code.0 == "compose::circle"));
    let platform = [("pair.yaml", "platform: simulated", "platform: embedded")];
    assert!(found(&platform).iter().any(|finding| finding.code.0 == "compose::differs"), "{:#?}", found(&platform));
    // Of more it would not be known how they stand, and that must not be called sound.
    let more: String =
        (0..davit::limits::SUBSYSTEMS).map(|at| format!("  s{at}: {{ deployment: arm.yaml }}\n")).collect();
    let many = found(&[("pair.yaml", "subsystems:\n", &format!("subsystems:\n{more}"))]);
    assert!(many.iter().any(|finding| finding.code.0 == "text::too_large"), "{many:#?}");
    let word = [("arm.yaml", "emits: [e_built, e_leaving]", "emits: [e_built, e_leaving, up]")];
    assert!(found(&word).iter().any(|finding| finding.code.0 == "compose::word"));
    let said = one(&[("pair.lua", "'left/e_leaving'", "'left/e_laeving'")], "compose::unknown");
    assert!(said.1.contains("did you mean `e_leaving`?"), "{said:?}");
    let until = one(&[("arm.yaml", "accepts: [e_released]", "accepts: []")], "compose::unknown");
    assert!(until.0.contains("leaving.until"), "{until:?}");
    let member = found(&[("arm.yaml", "pose: D.pose", "pose: D.psoe")]);
    assert!(member.iter().any(|finding| finding.code.0 == "compose::unknown"), "{member:#?}");
    let driven = [
        ("arm.yaml", "ref: D.ref", "ref: D.ref"),
        ("arm_conf.lua", "property_set('D.k', gain)", "property_set('D.k', gain), port_write('D.ref', 1.0)"),
    ];
    assert!(found(&driven).iter().any(|finding| finding.code.0 == "compose::export_driven"));
    // A safety event reaches every subsystem with actuators.
    let acts = [
        ("arm.yaml", "  Drive:\n", "  Drive:\n    actuator: true\n"),
        ("pair.yaml", "types: {}", "types: {}\nsafety: [e_estop]"),
    ];
    let unsafe_in: Vec<String> =
        found(&acts).into_iter().filter(|f| f.code.0 == "compose::safety").map(|f| f.message).collect();
    assert_eq!(unsafe_in.len(), 2, "{unsafe_in:?}");
    assert!(unsafe_in[0].contains("`e_estop` does not reach `left`"), "{unsafe_in:?}");
}

#[test]
fn what_is_raised_for_a_subsystem_is_among_what_it_accepts_and_what_is_heard_of_it_is_of_one_that_is_there() {
    let list = "`left` accepts `e_released`, `e_shutdown`, `e_start`";
    let raised = |to: &str| {
        one(&[("pair.lua", "'left/e_start', 'right", &format!("'left/{to}', 'right"))], "coord::unknown_request")
    };
    for (wrong, near) in [("e_strat", "e_start"), ("e_relased", "e_released"), ("e_shutdonw", "e_shutdown")] {
        let (says, help) = raised(wrong);
        assert_eq!(says, format!("`left/{wrong}` is nothing that `left` accepts"));
        assert_eq!(help, format!("did you mean `left/{near}`? {list}"));
    }
    // What would be refused again, or ignored, is not advised.
    let (_, help) = raised("run");
    assert!(
        help.starts_with("`run` is a configuration") && help.contains("raise an event that it waits for"),
        "{help}"
    );
    let inside = [
        ("pair.yaml", "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }", "left: { deployment: mid.yaml }"),
        ("pair.lua", "'left/e_start', 'right", "'left/inner/e_start', 'right"),
    ];
    let (_, help) = one(&inside, "coord::unknown_request");
    assert!(help.contains("led by its own coordinator: raise what that accepts, `e_released`"), "{help}");
    let (says, help) =
        one(&[("pair.yaml", "coordinator: pair.lua", "operator: [left.k]\ncoordinator: pair.lua")], "compose::promise");
    assert!(
        says.starts_with("an operator may set `left/D.k` at any time") && help.contains("`operator: [D.k]`"),
        "{says} {help}"
    );
    let (_, help) = raised("fold");
    assert!(help.starts_with(list) && help.contains("`accepts`"), "{help}");
    let by_itself = [
        ("arm.yaml", "emits: [", "safety: [e_estop]\nemits: ["),
        ("pair.lua", "'left/e_start', 'right", "'left/e_estop', 'right"),
    ];
    let (_, help) = one(&by_itself, "coord::unknown_request");
    assert!(help.contains("reaches `left` by itself") && !help.contains("did you mean"), "{help}");
    let nobody = one(&[("pair.lua", "'left/e_start', 'right", "'lfet/e_start', 'right")], "coord::unknown_request");
    assert!(nobody.0.contains("no subsystem `lfet`") && nobody.1 == "did you mean `left`?", "{nobody:?}");
    let (says, help) = one(&[("pair.lua", "events = { 'left/up' }", "events = { 'lfet/up' }")], "compose::unknown");
    assert_eq!(
        (says.as_str(), help.as_str()),
        ("`lfet/up` never comes: there is no subsystem `lfet`", "did you mean `left`?")
    );
}

/// Small compositions: a number of children in a row, and a parent that does some of what it should, in some order.
fn random(seed: u64) -> Vec<(&'static str, &'static str, String)> {
    let mut seed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut pick = |of: u64| {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        seed % of
    };
    let mut changes = Vec::new();
    let mut swap = |file, before: &'static str, after: &[&str], chance: u64| {
        if pick(chance) == 0 {
            let at = pick(after.len() as u64);
            changes.push((file, before, after[usize::try_from(at).unwrap()].to_owned()));
        }
    };
    swap(
        "pair.lua",
        "trans { src = 'one', tgt = 'coupling', events = { 'right/up' } }",
        &[
            "trans { src = 'one', tgt = 'coupling', events = { 'right/e_built' } }",
            "trans { src = 'one', tgt = 'coupling', events = { 'e_go' } }",
        ],
        3,
    );
    swap(
        "pair.lua",
        "parting = state { entry = 'couple.undo' }",
        &[
            "parting = state { entry = { 'couple.undo', 'stiff.undo' } }",
            "parting = state { entry = { 'left/e_shutdown', 'couple.undo' } }",
            "parting = state { entry = { 'left/e_released', 'couple.undo' } }",
        ],
        3,
    );
    swap(
        "pair.lua",
        "coupled = state {}",
        &["coupled = state { entry = 'stiff' }", "coupled = state { config = 'stiff' }"],
        3,
    );
    swap(
        "arm.lua",
        "trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown' } }",
        &[
            "trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown', 'e_tired' } }",
            "trans { src = 'on', tgt = 'stopping', events = { 'e_shutdown' } }",
            "trans { src = 'on', tgt = 'leaving', events = { 'e_released', 'e_shutdown' } }",
        ],
        3,
    );
    swap(
        "arm.lua",
        "starting = state { entry = { 'e_built', 'run' } }",
        &["starting = state { entry = { 'run', 'e_built' } }"],
        3,
    );
    swap(
        "arm.lua",
        "trans { src = 'leaving', tgt = 'stopping', events = { 'e_released' } }",
        &["trans { src = 'leaving', tgt = 'stopping', events = { 'e_released', 'e_after(1.0)' } }"],
        4,
    );
    changes
}

/// The same with arms that are passed on: one level more on one side, or on both.
fn random_of_two_levels(seed: u64) -> Vec<(&'static str, &'static str, String)> {
    let mut changes = random(seed);
    // Each side by a bit of the seed, and what the one in between does otherwise by what is left of it.
    let (sides, does) = (seed % 3, seed / 3);
    // What is in between does not tell when it is built.
    changes.retain(|(_, _, after)| sides == 0 || !after.contains("right/e_built"));
    let mut swap = |file, before, after: &str| changes.push((file, before, after.to_owned()));
    if sides != 1 {
        swap(
            "pair.yaml",
            "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }",
            "left: { deployment: mid.yaml }",
        );
    }
    if sides != 0 {
        swap("pair.yaml", "right: { deployment: arm.yaml }", "right: { deployment: mid.yaml }");
    }
    match does % 5 {
        // Not heard when what is within comes down by itself.
        1 => swap("mid.lua", "events = { 'e_shutdown', 'inner/e_leaving' }", "events = { 'e_shutdown' }"),
        2 => swap(
            "mid.lua",
            "entry = { 'inner/e_shutdown', 'inner/e_released' }",
            "entry = { 'inner/e_released', 'inner/e_shutdown' }",
        ),
        // It lets go before it is let go itself.
        3 => swap(
            "mid.lua",
            "leaving = state { entry = 'e_leaving' }",
            "leaving = state { entry = { 'inner/e_shutdown', 'e_leaving' } }",
        ),
        _ => {}
    }
    changes
}

#[test]
fn what_is_accepted_file_by_file_is_refused_by_no_product() {
    accepted_by_no_product_refused(random);
}

#[test]
fn what_is_accepted_at_two_levels_is_refused_by_no_product() {
    accepted_by_no_product_refused(random_of_two_levels);
}

fn accepted_by_no_product_refused(random: fn(u64) -> Vec<(&'static str, &'static str, String)>) {
    let (mut accepted, mut refused) = (0, 0);
    for seed in 1..60 {
        let changes = random(seed);
        let changes: Vec<(&str, &str, &str)> = changes.iter().map(|(f, a, b)| (*f, *a, b.as_str())).collect();
        let loaded = load(&files(&changes), "pair.yaml", &[]);
        let deployment = loaded.deployment.unwrap_or_else(|| panic!("{seed}: {:?}", loaded.findings));
        let types = catalogue(&deployment);
        let apart = check::run(deployment.clone(), &types);
        let effort = Effort { together: true, transitions: 30_000, ..Effort::default() };
        let product = check::run_with(deployment, &types, effort);
        assert!(product.explored.states > 100, "{seed}: {:#?}", product.findings);
        let violated = |f: &&Finding| {
            f.severity == Severity::Error
                && ["coord::request_refused", "conf::still_connected", "conf::unknown_component"].contains(&f.code.0)
        };
        let violations: Vec<&Finding> = product.findings.iter().filter(violated).collect();
        if apart.checked.is_some() {
            accepted += 1;
            assert!(violations.is_empty(), "{seed}: {changes:#?}\n{violations:#?}");
        } else {
            refused += 1;
        }
    }
    assert!(accepted > 5 && refused > 5, "{accepted} accepted, {refused} refused");
}

/// An export that names nothing is told where it stands, and not again, in names that nobody wrote, wherever it is used or handed on.
#[test]
fn what_follows_from_a_broken_export_is_not_said() {
    let handed_on = [
        ("pair.yaml", "left: { deployment: arm.yaml, parameters: { gain: 0.7 } }", "left: { deployment: mid.yaml }"),
        ("pair.yaml", "right: { deployment: arm.yaml }", "right: { deployment: mid.yaml }"),
    ];
    for (before, after, says) in [
        ("pose: D.pose, ref", "pose: D.pos, ref", "D (Drive) has no port `pos`"),
        ("properties: { k: D.k }", "properties: { k: D.kk }", "D (Drive) has no property `kk`"),
        ("properties: { k: D.k }", "properties: { k: E.k }", "no configuration creates a component `E`"),
    ] {
        for changes in [&[("arm.yaml", before, after)][..], &[("arm.yaml", before, after), handed_on[0], handed_on[1]]]
        {
            let errors = found(changes).into_iter().filter(Finding::is_error);
            let errors: Vec<String> = errors.map(|error| error.message).collect();
            assert_eq!(errors, [says], "{changes:?}");
        }
    }
    // What is wrong beside it is told all the same.
    let errors = found(&[
        ("arm.yaml", "pose: D.pose, ref", "pose: D.pos, ref"),
        ("pair.lua", "coupling = state { entry = 'couple' }", "coupling = state { entry = 'cuople' }"),
    ]);
    assert!(errors.iter().any(|error| error.is_error() && error.message.contains("cuople")), "{errors:#?}");
}

#[test]
fn a_fault_may_be_of_a_step_of_a_subsystem_that_exports_nothing_of_it() {
    let brakes = (
        "arm_conf.lua",
        "  run = Configuration {",
        "  halt = Configuration { operation_call('D.brake') },\n  run = Configuration {",
    );
    let with = |step: &str| {
        let faults = format!("platform: simulated\nfaults: [{{ step: '{step}', how: fail }}]\ntypes: {{}}");
        let errors = found(&[brakes, ("pair.yaml", "platform: simulated\ntypes: {}", &faults)]);
        errors.into_iter().filter(Finding::is_error).map(|error| error.message).collect::<Vec<_>>()
    };
    for step in ["operation_call left/D.brake", "start right/D", "connect left/D.pose -> right/D.ref"] {
        assert!(with(step).is_empty(), "{step}: {:?}", with(step));
    }
    assert_eq!(with("operation_call left/D.brak").len(), 1);
    assert_eq!(with("start middle/D").len(), 1);
}

/// So many arms with nothing in common, each led by a coordinator of its own; `alike`: these are the same but for names.
fn fleet(n: usize, alike: bool) -> Sources {
    let lead = "return state { idle = state {}, raising = state { entry = 'NAME/e_start' }, on = state {}, failed = state {},
  lowering = state { entry = { 'NAME/e_shutdown', 'NAME/e_released' } },
  trans { src = 'initial', tgt = 'idle' }, trans { src = 'idle', tgt = 'raising', events = { 'e_start' } },
  trans { src = 'raising', tgt = 'on', events = { 'NAME/up' } }, trans { src = 'raising', tgt = 'failed', events = { 'NAME/failed' } },
  trans { src = 'raising', tgt = 'lowering', events = { 'e_shutdown' } }, trans { src = 'failed', tgt = 'lowering', events = { 'e_shutdown' } },
  trans { src = 'on', tgt = 'lowering', events = { 'e_shutdown' } }, trans { src = 'lowering', tgt = 'idle', events = { 'NAME/down' } } }";
    let lead = |i: usize| if alike { lead.to_owned() } else { lead.replace("raising", &format!("raising{i}")) };
    let all = |of: &dyn Fn(usize) -> String| (0..n).map(of).collect::<Vec<_>>().join(", ");
    let fleet = format!(
        "davit: 1\nname: fleet\nplatform: simulated\ntypes: {{}}\nsubsystems: {{ {} }}\nconfigurations: [none.lua]\ncoordinators: {{ {} }}\n\
         deploy: {{ event: e_start, up: [{}], within_s: 10 }}\nshutdown: {{ event: e_shutdown, down: [{}], within_s: 10 }}\n",
        all(&|i| format!("r{i}: {{ deployment: arm.yaml }}")),
        all(&|i| format!("c{i}: c{i}.lua")),
        all(&|i| format!("c{i}:on")),
        all(&|i| format!("c{i}:idle")),
    );
    let mut files = vec![
        ("arm.yaml".to_owned(), ARM.to_owned()),
        ("arm_conf.lua".to_owned(), ARM_CONF.to_owned()),
        ("arm.lua".to_owned(), ARM_COORDINATOR.to_owned()),
        ("none.lua".to_owned(), "ConfiguratorConf {}".to_owned()),
        ("fleet.yaml".to_owned(), fleet),
    ];
    files.extend((0..n).map(|i| (format!("c{i}.lua"), lead(i).replace("NAME", &format!("r{i}")))));
    Sources::memory(files)
}

/// What many subsystems take beside their own file grows with their number where each is led by another coordinator, and no faster; where these are the
/// same but for names it does not grow.
#[test]
fn what_many_subsystems_take() {
    let followed = |n: usize, alike: bool| {
        let whole = load(&fleet(n, alike), "fleet.yaml", &[]).deployment.unwrap();
        let report = check::run(whole.clone(), &catalogue(&whole));
        let errors: Vec<&Finding> = report.findings.iter().filter(|finding| finding.is_error()).collect();
        assert!(
            errors.is_empty() && report.left.is_empty() && report.explored.complete,
            "{n}: {errors:#?} {:?}",
            report.left
        );
        report.explored.states
    };
    let (two, eight, nine) = (followed(2, false), followed(8, false), followed(9, false));
    assert!(eight < 4 * two, "{two} {eight}");
    assert_eq!(nine - eight, (eight - two) / 6, "each takes the same");
    let (one, two, eight) = (followed(1, true), followed(2, true), followed(8, true));
    assert_eq!((two, eight), (one, one));
}

/// Files that lead down each by itself, and not together: all of them are driven up and down as one, too.
#[test]
fn files_that_do_not_come_down_together_are_refused() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/pair");
    let names = ["configurations.lua", "coordinator.lua"].map(|part| [format!("pair_{part}"), format!("robot_{part}")]);
    let names = names.into_iter().flatten().chain(["pair.yaml".to_owned(), "robot.yaml".to_owned()]);
    let shipped: Vec<(String, String)> =
        names.map(|name| (name.clone(), std::fs::read_to_string(folder.join(name)).unwrap())).collect();
    let errors = |files: Vec<(String, String)>| -> Vec<(String, usize)> {
        let files: Vec<(&str, &str)> = files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
        let deployment = load(&Sources::memory(files), "pair.yaml", &[]).deployment.unwrap();
        let catalogue = catalogue(&deployment);
        let report = check::run(deployment, &catalogue);
        let found = report.findings.iter().zip(&report.traces).filter(|(finding, _)| finding.is_error());
        found.map(|(finding, trace)| (finding.code.to_string(), trace.len())).collect()
    };
    assert_eq!(errors(shipped.clone()), []);
    let mut reordered = shipped;
    for (_, text) in &mut reordered {
        let both = r#""left/e_shutdown", "right/e_shutdown", "left/e_released", "right/e_released""#;
        let other = r#""left/e_released", "right/e_released", "left/e_shutdown", "right/e_shutdown""#;
        *text = text.replace(both, other);
    }
    let found = errors(reordered);
    assert!(matches!(&found[..], [(code, trace)] if code == "deploy::never_down" && *trace > 1), "{found:?}");
}

/// What a subsystem sends to an actuator of its parent: it is watched in its own file, or there it can be; the parent reads what is exported.
#[test]
fn what_is_watched_in_a_subsystem_is_watched() {
    let motor = [
        (
            "pair.yaml",
            "types: {}",
            "types: { Motor: { actuator: true, ports: { ref: { direction: in, type: float } } } }",
        ),
        (
            "pair_conf.lua",
            "ConfiguratorConf {",
            "ConfiguratorConf { drive = Configuration { create('M', 'Motor'), connect('left.pose', 'M.ref') },",
        ),
    ];
    let unwatched = |more: &[(&str, &str, &str)]| -> Vec<(String, String)> {
        let found = found(&[&motor[..], more].concat());
        let of = found.into_iter().filter(|finding| finding.code.0 == "deploy::unwatched");
        of.map(|finding| (finding.message, finding.help.unwrap_or_default())).collect()
    };
    let told = unwatched(&[]);
    assert!(told.len() == 2 && told[0].0.starts_with("`left/D` may die unnoticed"), "{told:?}");
    assert!(
        told[0].1.contains("`left.pose` is silent")
            && told[0].1.contains("of `left`, in its own file, hear `D.faulted`"),
        "{told:?}"
    );
    let hears = (
        "arm.lua",
        "  trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown' } },",
        "  trans { src = 'on', tgt = 'leaving', events = { 'e_shutdown', 'D.faulted' } },",
    );
    assert_eq!(unwatched(&[hears]), []);
}
