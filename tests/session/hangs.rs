//! A component's own code that hangs, wherever it is called: while it is made, while it is dropped, in an operation beside
//! it. On the embedded platform, with everything above it.

use davit::app;
use davit::lang::LoadOptions;
use davit::model::EventName;
use davit::platform::Platform as _;
use davit::runtime::{Builder, Component, ComponentFactory, Libraries, Library, OperationAnswer, Prop};
use davit::session::{Happening, NotUp, Phase, Session};
use davit::time::Clock;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// Hangs where its property says, for ever or for half a minute.
struct Sluggish {
    clock: Clock,
    hangs: Prop<String>,
}

fn hang(clock: &Clock, wanted: &str, here: &str) {
    match wanted.split_once(' ') {
        Some((place, "ever")) if place == here => clock.hang(),
        Some((place, "long")) if place == here => clock.sleep(Duration::from_secs(30)),
        _ => {}
    }
}

impl Sluggish {
    fn kind(clock: &Clock) -> ComponentFactory {
        let clock = clock.clone();
        ComponentFactory::made_by("Sluggish", move |b: &mut Builder<Self>| {
            let own = clock.clone();
            let mut hangs = b.property("hangs", String::new());
            b.caller_operation("beside", move |(how,): (String,)| {
                hang(&own, &how, "beside");
                OperationAnswer::Done(())
            });
            hang(&clock, &hangs.get(), "made");
            Self { clock: clock.clone(), hangs }
        })
    }
}

impl Component for Sluggish {
    fn new(_: &mut Builder<Self>) -> Self {
        unreachable!("made by its kind")
    }
}

impl Drop for Sluggish {
    fn drop(&mut self) {
        hang(&self.clock, &self.hangs.get(), "dropped");
    }
}

const DEPLOYMENT: &str = "\
davit: 1
name: sluggish
platform: embedded
libraries: [slow]
configurations: [conf.lua]
coordinator: coordinator.lua
deploy:   { event: e_start, up: up,   failed: [failed], within_s: 60 }
shutdown: { event: e_stop,  down: idle, within_s: 60 }
limits:   { step_timeout_s: 0.5 }
";

/// It notes what it hears while the configurator is at work.
const COORDINATOR: &str = r#"
return state {
  idle    = state {},
  working = state { entry = "make",
    quiet = state {}, heard = state {},
    trans { src = "initial", tgt = "quiet" },
    trans { src = "quiet", tgt = "heard", events = { "e_look" } },
  },
  up       = state {},
  stopping = state { entry = "make.undo" },
  failed   = state {},
  trans { src = "initial",  tgt = "idle" },
  trans { src = "idle",     tgt = "working",  events = { "e_start" } },
  trans { src = "working",  tgt = "up",       events = { "make.ok" } },
  trans { src = "working",  tgt = "failed",   events = { "make.failed", "make.broken" } },
  trans { src = "up",       tgt = "stopping", events = { "e_stop" } },
  trans { src = "stopping", tgt = "idle",     events = { "make.undone" } },
  trans { src = "stopping", tgt = "failed",   events = { "make.undo.failed", "make.broken" } },
  trans { src = "failed",   tgt = "idle",     events = { "e_stop" } },
}
"#;

/// Ten components, the sixth of which hangs.
fn configuration(hangs: &str, call: &str) -> String {
    let create = |i: usize| {
        let hangs = if i == 5 { hangs } else { "" };
        format!("create(\"c{i}\", \"Sluggish\", {{ properties = {{ hangs = \"{hangs}\" }} }}),\n")
    };
    let creates: String = (0..10).map(create).collect();
    format!(
        "ConfiguratorConf {{ make = Configuration {{ {creates} {call} post_conf_state = {{ \"_default:stopped\" }} }} }}"
    )
}

struct Run {
    clock: Clock,
    session: Arc<Session>,
    heard: Arc<Mutex<Vec<(Duration, String)>>>,
}

impl Run {
    fn with(hangs: &str, call: &str, what: impl FnOnce(&Self)) {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in
            [("s.yaml", DEPLOYMENT), ("conf.lua", &configuration(hangs, call)), ("coordinator.lua", COORDINATOR)]
        {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        let clock = Clock::simulated();
        let _me = clock.enter();
        let libraries = Libraries::new().with(Library::new("slow").with_kind(Sluggish::kind(&clock)));
        let checked = app::read(&folder.path().join("s.yaml"), &LoadOptions::default(), &libraries)
            .and_then(app::check)
            .unwrap_or_else(|refused| panic!("{:#?}", refused.findings));
        let session = app::start(&checked, &clock).unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let (log, began) = (heard.clone(), clock.now());
        session.hub().observe(Arc::new(move |at, what| {
            let line = match what {
                Happening::State { active } => active.last().map_or("", |s| s.as_str()).to_owned(),
                Happening::Answered(answer) => answer.answer.clone(),
                Happening::Returned { component } => format!("{component} returned"),
                _ => return,
            };
            log.lock().unwrap().push((at.since(began), line));
        }));
        what(&Self { clock: clock.clone(), session, heard });
        clock.shutdown();
    }

    /// Brings it up while somebody looks in after 0.1 s.
    fn bring_up(&self) -> Result<(), NotUp> {
        let (clock, session) = (self.clock.clone(), self.session.clone());
        let looker = self.clock.try_spawn("looker", move || {
            clock.sleep(Duration::from_millis(100));
            session.raise(EventName::new("e_look").unwrap(), "test");
        });
        let result = self.session.bring_up();
        looker.unwrap().join(self.clock.now() + Duration::from_secs(1)).unwrap();
        result
    }

    fn when(&self, line: &str) -> Duration {
        let heard = self.heard.lock().unwrap();
        heard.iter().find(|(_, l)| l == line).unwrap_or_else(|| panic!("never heard {line}: {heard:?}")).0
    }

    fn components(&self) -> Vec<String> {
        let seen = self.session.platform().observe(self.clock.now() + Duration::from_secs(1)).unwrap();
        seen.components.keys().map(ToString::to_string).collect()
    }

    fn quarantined(&self) -> Vec<String> {
        self.session.platform().quarantined().iter().map(ToString::to_string).collect()
    }
}

const SECOND: Duration = Duration::from_secs(1);

#[test]
fn a_component_that_hangs_while_it_is_made() {
    Run::with("made ever", "", |run| {
        let not_up = run.bring_up().unwrap_err();
        assert_eq!(run.when("root.working.heard"), SECOND / 10, "the coordinator did not wait for it");
        let answered = run.when("make.failed");
        assert!(answered >= SECOND / 2 && answered < SECOND, "by the step's deadline: {answered:?}");
        assert_eq!(not_up.ended.phase, Phase::Broken);
        assert!(not_up.ended.left.iter().any(|line| line.contains("c5") && line.contains("quarantined")), "{not_up:?}");
        assert_eq!(run.quarantined(), ["c5"]);
        assert!(run.components().is_empty(), "what hangs was never there, the others are gone");
    });
}

#[test]
fn a_component_that_is_made_too_late_leaves_nothing() {
    Run::with("made long", "", |run| {
        assert_eq!(run.bring_up().unwrap_err().ended.phase, Phase::Broken);
        run.clock.sleep(SECOND * 40);
        assert_eq!(run.when("c5 returned"), SECOND * 30);
        assert!(run.quarantined().is_empty() && run.components().is_empty());
    });
}

#[test]
fn a_component_that_hangs_while_it_is_dropped() {
    for (hangs, returns) in [("dropped ever", false), ("dropped long", true)] {
        Run::with(hangs, "", |run| {
            run.bring_up().unwrap();
            let began = run.clock.now();
            let ended = run.session.take_down(false);
            assert!(run.clock.now().since(began) < SECOND * 3, "{ended:?}");
            assert_eq!(ended.phase, Phase::Broken, "{ended:?}");
            assert!(ended.left.iter().any(|line| line.contains("c5")), "{ended:?}");
            assert!(run.components().is_empty(), "it is gone for everybody else: {:?}", run.components());
            assert_eq!(run.quarantined(), ["c5"]);
            run.clock.sleep(SECOND * 40);
            assert_eq!(run.quarantined().is_empty(), returns);
        });
    }
}

#[test]
fn an_operation_that_hangs_beside_its_component() {
    let call = "operation_call(\"c5.beside\", \"beside ever\"):undo(\"c5.beside\", \"\"),";
    Run::with("", call, |run| {
        let not_up = run.bring_up().unwrap_err();
        assert_eq!(run.when("root.working.heard"), SECOND / 10);
        let answered = run.heard.lock().unwrap().iter().find(|(_, l)| l.starts_with("make.")).map(|(at, _)| *at);
        assert!(answered.is_some_and(|at| at >= SECOND / 2 && at < SECOND * 2), "{answered:?}");
        // Nobody knows whether it had its effect, and that is said; the component itself is healthy, and gone.
        assert!(not_up.reasons.iter().any(|why| why.contains("nobody knows")), "{not_up:?}");
        assert!(not_up.ended.is_clean(), "{not_up:?}");
        assert!(run.quarantined().is_empty());
        assert!(run.components().is_empty(), "{:?}", run.components());
    });
}

#[test]
fn the_end_of_a_platform_does_not_wait_for_who_hangs() {
    let clock = Clock::simulated();
    let _me = clock.enter();
    let libraries = Libraries::new().with(Library::new("slow").with_kind(Sluggish::kind(&clock)));
    let platform = davit::platform::embedded::EmbeddedPlatform::new(&clock, &libraries, &Default::default());
    let create = davit::model::Step::Create {
        component: davit::model::ComponentName::new("c").unwrap(),
        ty: davit::model::TypeName::new("Sluggish").unwrap(),
        activity: None,
        properties: vec![davit::model::Value::str("dropped ever")],
    };
    assert!(matches!(platform.execute(&create, clock.now() + SECOND), davit::platform::Outcome::Done(_)));
    let began = clock.now();
    drop(platform);
    assert!(clock.now().since(began) <= davit::limits::RUNTIME_END * 2);
    clock.shutdown();
}
