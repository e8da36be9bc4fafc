//! The coordinator on its own thread, in simulated time: what it hears, raises, forgets, and when it falls silent.

use crate::names::event;
use crate::support::*;
use davit::coordinator::{
    ChartTrouble, Class, CoordinatorHandle, Core, Delivered, Incoming, Listener, NotAccepted, Tag,
};
use davit::limits;
use davit::model::names::EventName;
use davit::statechart::{Chart, Hook, NodeId, Raised};
use davit::time::{Clock, Time};
use std::sync::{Arc, Mutex, OnceLock};
use std::time::Duration;

/// Notes everything, in words.
#[derive(Clone, Default)]
struct Log(Arc<Mutex<Vec<String>>>);

impl Log {
    fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap())
    }

    fn add(&self, line: String) {
        self.0.lock().unwrap().push(line);
    }
}

impl Listener for Log {
    fn raised(&mut self, chart: &Chart, batch: &[Raised]) {
        let words: Vec<String> =
            batch.iter().map(|r| format!("{}<{}#{}", r.name, chart.fqn(r.owner), r.visit)).collect();
        self.add(words.join(" "));
    }

    fn unmatched(&mut self, event: EventName) {
        self.add(format!("unmatched {event}"));
    }

    fn stale(&mut self, _: &Chart, event: EventName, _: Tag) {
        self.add(format!("stale {event}"));
    }

    fn trouble(&mut self, _: &Chart, trouble: ChartTrouble) {
        self.add(format!("{trouble:?}"));
    }
}

/// The coupling's switch with state-scoped configurations.
fn copying() -> Chart {
    compiled(vec![
        s("harmonizing", vec![]),
        s(
            "copying",
            vec![
                Part::Config("enable_copying"),
                s("eight", vec![Part::Config("eight_DOF")]),
                s("five", vec![Part::Config("five_DOF")]),
                t("initial", "eight", ""),
                tx("eight", "five", "e_5dof", 0.0, "switching"),
            ],
        ),
        t("initial", "harmonizing", ""),
        t("harmonizing", "copying", "e_aligned"),
        t("copying", "harmonizing", "e_misaligned enable_copying.failed"),
    ])
}

#[test]
fn one_step_raises_one_batch_and_says_who_asked() {
    let (mut core, mut log) = (Core::new(Arc::new(copying())), Log::default());
    core.start(Time(0), &mut log);
    assert!(log.take().is_empty());
    assert_eq!(core.deliver(event("e_aligned"), None, Time(0), &mut log), Delivered::Taken);
    assert_eq!(log.take(), ["enable_copying<root.copying#1 eight_DOF<root.copying.eight#1"]);
    core.deliver(event("e_5dof"), None, Time(0), &mut log);
    // The undo and the effect belong to the state around both, the push to the state entered; all are one transaction.
    assert_eq!(log.take(), ["eight_DOF.undo<root.copying#1 switching<root.copying#1 five_DOF<root.copying.five#1"]);
    core.deliver(event("e_misaligned"), None, Time(0), &mut log);
    assert_eq!(log.take(), ["five_DOF.undo<root#1 enable_copying.undo<root#1"]);
    assert_eq!(core.deliver(event("e_unheard_of"), None, Time(0), &mut log), Delivered::Unmatched);
    assert_eq!(log.take(), ["unmatched e_unheard_of"]);
}

#[test]
fn answers_for_a_visit_that_is_over_are_not_news() {
    let chart = Arc::new(copying());
    let copying = chart.find("copying").unwrap();
    let (mut core, mut log) = (Core::new(chart), Log::default());
    core.start(Time(0), &mut log);
    let failed = event("enable_copying.failed");
    let visit = |visit| Some(Tag { owner: copying, visit });
    core.deliver(event("e_aligned"), None, Time(0), &mut log);
    core.deliver(event("e_misaligned"), None, Time(0), &mut log);
    log.take();
    assert_eq!(core.deliver(failed, visit(1), Time(0), &mut log), Delivered::Stale, "left");
    core.deliver(event("e_aligned"), None, Time(0), &mut log);
    log.take();
    assert_eq!(core.deliver(failed, visit(1), Time(0), &mut log), Delivered::Stale, "entered again");
    assert_eq!(log.take(), ["stale enable_copying.failed"]);
    assert!(core.machine().is_active(core.chart(), copying));
    assert_eq!(core.deliver(failed, visit(2), Time(0), &mut log), Delivered::Taken, "the present visit's");
    assert!(!core.machine().is_active(core.chart(), copying));
}

#[test]
fn a_compound_transition_is_owned_by_what_stays_active_throughout() {
    // a and the connector are both in c; the path then leaves c.
    let chart = compiled(vec![
        s(
            "c",
            vec![
                s("a", vec![Part::Exit("left")]),
                c("k"),
                t("initial", "a", ""),
                tx("a", "k", "e", 0.0, "first"),
                tx("k", "root.b", "", 0.0, "second"),
            ],
        ),
        s("b", vec![]),
        t("initial", "c", ""),
    ]);
    let (mut core, mut log) = (Core::new(Arc::new(chart)), Log::default());
    core.start(Time(0), &mut log);
    core.deliver(event("e"), None, Time(0), &mut log);
    assert_eq!(log.take(), ["left<root#1 first<root#1 second<root#1"]);
}

#[test]
fn completions_are_steps_of_their_own() {
    let chart = compiled(vec![
        s("a", vec![Part::Config("a")]),
        s("b", vec![Part::Config("b")]),
        t("initial", "a", ""),
        t("a", "b", "e_done"),
    ]);
    let (mut core, mut log) = (Core::new(Arc::new(chart)), Log::default());
    core.start(Time(0), &mut log);
    assert_eq!(log.take(), ["a<root.a#1", "a.undo<root#1 b<root.b#1"]);
}

#[test]
fn a_chart_that_never_rests_is_stopped_and_heard_of() {
    let chart = compiled(vec![
        s("quiet", vec![]),
        s("a", vec![]),
        s("b", vec![]),
        t("initial", "quiet", ""),
        t("quiet", "a", "e_go"),
        t("a", "b", "e_done"),
        t("b", "a", "e_done"),
        t("a", "quiet", "e_back"),
        t("b", "quiet", "e_back"),
    ]);
    let (mut core, mut log) = (Core::new(Arc::new(chart)), Log::default());
    core.start(Time(0), &mut log);
    core.deliver(event("e_go"), None, Time(0), &mut log);
    assert_eq!(log.take(), ["Runaway"]);
    assert_eq!(core.deliver(event("e_back"), None, Time(0), &mut log), Delivered::Taken);
    assert_eq!(core.machine().leaf(), core.chart().find("quiet").ok());
    assert!(log.take().is_empty());
}

#[test]
fn a_chart_that_cannot_be_entered_says_so_and_tries_again() {
    let chart = compiled(vec![s("a", vec![]), t("initial", "a", "e_begin")]);
    let (mut core, mut log) = (Core::new(Arc::new(chart)), Log::default());
    core.start(Time(0), &mut log);
    core.deliver(event("e_other"), None, Time(0), &mut log);
    assert_eq!(log.take(), ["NotEntered", "NotEntered", "unmatched e_other"]);
    assert_eq!(core.deliver(event("e_begin"), None, Time(0), &mut log), Delivered::Taken);
}

#[test]
fn it_runs_on_its_own_thread_and_is_woken_by_events_and_by_time() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let chart = Arc::new(compiled(vec![
        s("off", vec![]),
        s("on", vec![Part::Entry("light")]),
        t("initial", "off", ""),
        t("off", "on", "e_on"),
        t("on", "off", "e_after(2)"),
    ]));
    let (on, off) = (chart.find("on").unwrap(), chart.find("root.off").unwrap());
    let log = Log::default();
    let coordinator = CoordinatorHandle::start("coordinator", chart, &clock, log.clone());
    clock.sleep(Duration::from_millis(1));
    coordinator.deliver(Incoming::new(Class::Outside, event("e_on"))).unwrap();
    let entered = clock.now();
    clock.sleep_until(entered + Duration::from_secs(2));
    assert_eq!(coordinator.active(), ["root", "root.on"]);
    assert!(coordinator.is_active(on) && coordinator.is_active(NodeId::ROOT) && !coordinator.is_active(off));
    // After *more* than 2 s.
    clock.sleep_until(entered + Duration::from_nanos(2_000_000_002));
    assert!(coordinator.is_active(off));
    assert_eq!(log.take(), ["light<root.on#1"]);
    coordinator.stop(Time::NEVER).unwrap();
}

#[test]
fn detached_it_raises_nothing_more() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let chart = Arc::new(compiled(vec![s("a", vec![Part::Entry("raised")]), t("initial", "a", ""), t("a", "a", "e")]));
    let log = Log::default();
    let coordinator = CoordinatorHandle::start("coordinator", chart, &clock, log.clone());
    clock.sleep(Duration::from_millis(1));
    log.take();
    coordinator.deliver(Incoming::new(Class::Outside, event("e"))).unwrap();
    coordinator.detach();
    assert_eq!(coordinator.deliver(Incoming::new(Class::Outside, event("e"))), Err(NotAccepted::Detached));
    clock.sleep(Duration::from_secs(1));
    assert!(log.take().is_empty(), "the event was in the inbox, and nobody commands any more");
    assert_eq!(coordinator.active(), ["root", "root.a"], "the last state stays readable");
    coordinator.stop(Time::NEVER).unwrap();
}

/// What goes before all others is not lost with it: whoever leads from then on is told, whether it waited, was being reacted to, or came
/// just after.
#[test]
fn what_is_urgent_and_was_not_reacted_to_is_answered() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let chart =
        Arc::new(compiled(vec![s("a", vec![]), t("initial", "a", ""), t("a", "a", "e"), t("a", "a", "e_stop")]));
    let coordinator = CoordinatorHandle::start("coordinator", chart, &clock, Log::default());
    clock.sleep(Duration::from_millis(1));
    coordinator.deliver(Incoming::new(Class::Urgent, event("e_stop"))).unwrap();
    clock.sleep(Duration::from_millis(1));
    for (class, name) in [(Class::Report, "e"), (Class::Urgent, "e_stop"), (Class::Urgent, "e_halt")] {
        coordinator.deliver(Incoming::new(class, event(name))).unwrap();
    }
    assert_eq!(coordinator.detach(), ["e_stop", "e_halt"].map(event), "not what was reacted to before");
    assert_eq!(coordinator.detach(), [], "each once");
    assert!(coordinator.deliver(Incoming::new(Class::Urgent, event("e_halt"))).is_err());
    clock.sleep(Duration::from_secs(1));
    assert_eq!(coordinator.detach(), [event("e_halt")], "which came later, and its thread has ended since");
    coordinator.stop(Time::NEVER).unwrap();
}

#[test]
fn a_flood_of_reports_does_not_displace_what_is_urgent() {
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let chart = Arc::new(compiled(vec![
        s("run", vec![]),
        s("halt", vec![Part::Entry("halted")]),
        t("initial", "run", ""),
        t("run", "halt", "e_stop"),
        tx("halt", "halt", "chatter", 0.0, "chatter_heard"),
    ]));
    let run = chart.find("run").unwrap();
    let log = Log::default();
    let coordinator = CoordinatorHandle::start("coordinator", chart, &clock, log.clone());
    clock.sleep(Duration::from_millis(1));
    assert!(coordinator.is_active(run));
    // This thread holds the token of the simulated clock: all of this waits in the inbox before anything is looked at.
    for _ in 0..limits::INBOX_REPORT + 100 {
        let _ = coordinator.deliver(Incoming::new(Class::Report, event("chatter")));
    }
    coordinator.deliver(Incoming::new(Class::Urgent, event("e_stop"))).unwrap();
    clock.sleep(Duration::from_secs(1));
    let log = log.take();
    assert_eq!(log[0], "halted<root.halt#1", "before any of the reports");
    assert_eq!(log.len(), limits::INBOX_REPORT + 1);
    assert_eq!(coordinator.dropped().report, 100);
    assert_eq!(coordinator.dropped().outside, 0);
    coordinator.stop(Time::NEVER).unwrap();
}

#[test]
fn a_listener_may_end_it_from_inside() {
    struct Once(Arc<Mutex<Option<CoordinatorHandle>>>, Log);
    impl Listener for Once {
        fn raised(&mut self, _: &Chart, batch: &[Raised]) {
            self.1.add(format!("{} names", batch.len()));
            if let Some(coordinator) = self.0.lock().unwrap().as_ref() {
                coordinator.detach();
            }
        }
    }
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let chart = Arc::new(compiled(vec![s("a", vec![]), t("initial", "a", ""), tx("a", "a", "e", 0.0, "x")]));
    let (slot, log) = (Arc::new(Mutex::new(None)), Log::default());
    let coordinator = CoordinatorHandle::start("coordinator", chart.clone(), &clock, Once(slot.clone(), log.clone()));
    *slot.lock().unwrap() = Some(coordinator.clone());
    clock.sleep(Duration::from_millis(1));
    coordinator.deliver(Incoming::new(Class::Outside, event("e"))).unwrap();
    let _ = coordinator.deliver(Incoming::new(Class::Outside, event("e")));
    clock.sleep(Duration::from_secs(1));
    coordinator.stop(Time::NEVER).unwrap();
    assert_eq!(log.take(), ["1 names"]);
}

#[test]
fn when_it_rests_it_is_seen_to_rest() {
    // Whoever looked while an event was being reacted to, and saw no rest, is told when to look again: also after an
    // event that moves nothing.
    struct Rests {
        coordinator: Arc<OnceLock<CoordinatorHandle>>,
        seen: Arc<Mutex<Vec<bool>>>,
    }
    impl Listener for Rests {
        fn raised(&mut self, _: &Chart, _: &[Raised]) {}
        fn unmatched(&mut self, _: EventName) {
            self.seen.lock().unwrap().push(self.coordinator.get().unwrap().is_settled());
        }
        fn rested(&mut self) {
            if let Some(coordinator) = self.coordinator.get() {
                self.seen.lock().unwrap().push(coordinator.is_settled());
            }
        }
    }
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let (own, seen) = (Arc::new(OnceLock::new()), Arc::new(Mutex::new(Vec::new())));
    let listener = Rests { coordinator: own.clone(), seen: seen.clone() };
    let coordinator = CoordinatorHandle::start("coordinator", Arc::new(copying()), &clock, listener);
    own.set(coordinator.clone()).unwrap();
    clock.sleep(Duration::from_millis(1));
    seen.lock().unwrap().clear();
    coordinator.deliver(Incoming::new(Class::Outside, event("e_unknown"))).unwrap();
    clock.sleep(Duration::from_millis(1));
    assert_eq!(*seen.lock().unwrap(), [false, true]);
    coordinator.stop(Time::NEVER).unwrap();
}

#[test]
fn it_is_detached_though_a_function_of_its_model_hangs() {
    /// A function that takes ten seconds in the entry of `copying`.
    struct Slow(Clock);
    impl Hook for Slow {
        fn entered(&mut self, chart: &Chart, state: NodeId) {
            if chart.fqn(state).to_string() == "root.copying" {
                self.0.sleep(Duration::from_secs(10));
            }
        }
    }
    let clock = Clock::simulated();
    let _guard = clock.enter();
    let (log, own) = (Log::default(), clock.clone());
    let coordinator =
        CoordinatorHandle::start_with("coordinator", Arc::new(copying()), &clock, log.clone(), move || Ok(Slow(own)));
    coordinator.deliver(Incoming::new(Class::Urgent, event("e_aligned"))).unwrap();
    clock.sleep(Duration::from_millis(1));
    let asked = clock.now();
    assert!(!coordinator.is_settled() && !coordinator.hangs());
    assert!(coordinator.reacting_since().is_some_and(|since| since < asked));
    clock.sleep(Duration::from_secs(1));
    assert!(coordinator.hangs(), "for longer than a second");
    let asked = clock.now();
    assert_eq!(coordinator.detach(), [event("e_aligned")], "what it hangs in is not lost");
    assert_eq!(clock.now(), asked, "nobody waits for it");
    assert!(coordinator.stop(clock.now() + Duration::from_secs(1)).is_err(), "its thread is still in the function");
    clock.sleep(Duration::from_secs(20));
    assert!(!coordinator.hangs() && coordinator.reacting_since().is_none());
    assert!(log.take().is_empty(), "what it comes back with is told to nobody");
}
