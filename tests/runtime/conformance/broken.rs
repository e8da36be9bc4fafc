//! Platforms that are wrong on purpose: the rule that they break is named, with what was expected and what was seen.

use davit::model::{Catalogue, ComponentName, ComponentSnapshot, Snapshot, Step};
use davit::platform::conformance::{Ability, Bed, BedTrouble, RuleReport, RuleVerdict, StandIn, UnderTest, rules, run};
use davit::platform::simulated::Simulated;
use davit::platform::{EventSink, Execution, ObserveError, Outcome, Platform, StepBatch};
use davit::time::{Clock, Time};
use std::sync::Arc;
use std::time::Duration;

/// What a platform does wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Wrong {
    /// Where a component hangs it answers long after the deadline.
    AnswersLate,
    /// It does not answer at all when a component is destroyed.
    NeverAnswers,
    /// A value written to a port is done, and not there.
    ForgetsAWrite,
    /// It takes away what a port had before it finds that a connection may not be.
    HalfAConnect,
    /// It panics where one component is observed that there is not.
    Panics,
    /// It knows nobody in quarantine.
    KnowsNoQuarantine,
    /// A step of a safe configuration is one as every other.
    NothingIsSafe,
    /// Giving up waits for the end.
    WaitsToGiveUp,
    /// Of several steps it goes on behind one that is not done.
    GoesOn,
    /// The last of several steps comes first.
    Backwards,
    /// Of several steps it does those too that were not to begin.
    DoesNotStop,
    /// All of several steps share the time of the first.
    SharesTheTime,
    /// It answers several steps when all are over.
    AnswersAtTheEnd,
}

struct WrongBed(Wrong);

struct BrokenRule {
    inner: Simulated,
    wrong: Wrong,
}

/// At the end: those who hang are released, so that no thread outlives the test.
struct Release(Clock);

impl Drop for Release {
    fn drop(&mut self) {
        self.0.shutdown();
    }
}

impl Bed for WrongBed {
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest {
        let (inner, mut made) = StandIn::with(trouble);
        made.keep.insert(0, Box::new(Release(made.clock.clone())));
        UnderTest { platform: Arc::new(BrokenRule { inner, wrong: self.0 }), ..made }
    }
}

impl Platform for BrokenRule {
    fn catalogue(&self) -> &Catalogue {
        self.inner.catalogue()
    }
    fn execution(&self, step: &Step) -> Execution {
        self.inner.execution(step)
    }
    fn execute(&self, step: &Step, deadline: Time) -> Outcome {
        match (self.wrong, step) {
            (Wrong::NeverAnswers, Step::Destroy { .. }) => self.inner.clock().hang(),
            (Wrong::ForgetsAWrite, Step::PortWrite { port, .. }) => {
                let before = self.inner.observe(deadline).map(|seen| seen.ports);
                let outcome = Platform::execute(&self.inner, step, deadline);
                if let (Outcome::Done(_), Ok(before)) = (&outcome, before) {
                    self.inner.tamper(&Step::PortWrite { port: *port, value: before.get(port).cloned() });
                }
                outcome
            }
            (Wrong::HalfAConnect, Step::Connect { to, .. }) => {
                let before = self.inner.observe(deadline).map(|seen| seen.connections).unwrap_or_default();
                let outcome = Platform::execute(&self.inner, step, deadline);
                if !matches!(outcome, Outcome::Done(_)) {
                    for (from, to) in before.keys().filter(|(_, other)| other == to) {
                        self.inner.tamper(&Step::Disconnect { from: *from, to: *to });
                    }
                }
                outcome
            }
            _ => {
                let outcome = Platform::execute(&self.inner, step, deadline);
                if self.wrong == Wrong::AnswersLate && matches!(outcome, Outcome::Unknown(_)) {
                    self.inner.clock().sleep(Duration::from_secs(1));
                }
                outcome
            }
        }
    }
    fn execute_safe(&self, step: &Step, deadline: Time) -> Outcome {
        match self.wrong {
            Wrong::NothingIsSafe => self.execute(step, deadline),
            _ => self.inner.execute_safe(step, deadline),
        }
    }
    fn execute_batch(&self, batch: &StepBatch) {
        let began = self.inner.clock().now();
        let execute = |step: &Step, deadline| Platform::execute(&self.inner, step, deadline);
        match self.wrong {
            Wrong::GoesOn => {
                for timed in batch.begin(usize::MAX) {
                    batch.answer(execute(&timed.step, batch.deadline()));
                }
            }
            Wrong::Backwards => {
                let begun = batch.begin(usize::MAX);
                let ended: Vec<Outcome> =
                    begun.iter().rev().map(|timed| execute(&timed.step, batch.deadline())).collect();
                ended.into_iter().rev().for_each(|outcome| batch.answer(outcome));
            }
            Wrong::DoesNotStop => {
                batch.one_by_one(execute);
                let behind = batch.steps().iter().skip(1).filter(|_| batch.is_stopped());
                behind.for_each(|timed| drop(execute(&timed.step, timed.deadline(began))));
            }
            Wrong::SharesTheTime => {
                let deadline = batch.steps()[0].deadline(began);
                batch.one_by_one(|step, _| execute(step, deadline));
            }
            Wrong::AnswersAtTheEnd => {
                let mut ended = Vec::new();
                for timed in batch.begin(usize::MAX) {
                    ended.push(execute(&timed.step, timed.deadline(self.inner.clock().now())));
                    if !matches!(ended.last(), Some(Outcome::Done(_))) {
                        break;
                    }
                }
                ended.into_iter().for_each(|outcome| batch.answer(outcome));
            }
            _ => batch.one_by_one(|step, deadline| self.execute(step, deadline)),
        }
    }
    fn cancel(&self, step: &Step) {
        self.inner.cancel(step);
        if self.wrong == Wrong::WaitsToGiveUp {
            self.inner.clock().sleep(Duration::from_millis(20));
        }
    }
    fn observe(&self, deadline: Time) -> Result<Snapshot, ObserveError> {
        self.inner.observe(deadline)
    }
    fn observe_component(
        &self,
        component: ComponentName,
        deadline: Time,
    ) -> Result<Option<ComponentSnapshot>, ObserveError> {
        let seen = self.inner.observe_component(component, deadline)?;
        assert!(seen.is_some() || self.wrong != Wrong::Panics, "no such component");
        Ok(seen)
    }
    fn subscribe(&self, sink: EventSink) {
        self.inner.subscribe(sink);
    }
    fn quarantined(&self) -> Vec<ComponentName> {
        if self.wrong == Wrong::KnowsNoQuarantine { Vec::new() } else { self.inner.quarantined() }
    }
}

const HANGS: &str = "several_steps_end_with_one_that_hangs";

fn named(report: &RuleReport) -> Vec<&'static str> {
    report.broken().map(|(rule, _)| rule.name).collect()
}

#[test]
fn what_is_wrong_is_named() {
    let of = |wrong| run(&WrongBed(wrong));
    let late = [
        "each_of_several_steps_has_its_own_time",
        "what_is_done_is_told_before_the_end_of_others",
        "a_hung_call_is_unknown_at_its_deadline_and_quarantined",
        "a_hung_making_or_end_is_unknown_at_its_deadline_and_quarantined",
        "a_quarantined_component_holds_up_no_other",
        "a_call_that_returns_late_is_cleaned_up",
        "a_making_or_end_that_returns_late_is_cleaned_up",
        "unknown_is_settled_by_reading_back",
        "a_component_that_does_not_rest_is_quarantined_until_it_does",
    ];
    assert_eq!(named(&of(Wrong::AnswersLate)), late);
    assert!(named(&of(Wrong::NeverAnswers)).contains(&"destroy_needs_unconfigured_and_no_connections"));
    let forgets = [
        "port_write_needs_a_port_that_nothing_drives",
        "a_written_value_survives_a_connection_and_never_written_comes_back",
    ];
    assert_eq!(named(&of(Wrong::ForgetsAWrite)), forgets);
    let half = ["a_data_connection_is_the_only_one_of_its_port", "event_ports_take_many_connections"];
    assert_eq!(named(&of(Wrong::HalfAConnect)), half);
    // Everything else that looks at a component that there is not is named too.
    let panics = named(&of(Wrong::Panics));
    assert_eq!(panics[0], "one_component_observed_is_the_one_of_the_whole", "{panics:?}");
    let quarantine = named(&of(Wrong::KnowsNoQuarantine));
    assert!(quarantine.contains(&"a_hung_call_is_unknown_at_its_deadline_and_quarantined"), "{quarantine:?}");
    assert_eq!(named(&of(Wrong::NothingIsSafe)), ["what_is_safe_runs_beside_a_call_that_does_not_rest"]);
    let goes_on = named(&of(Wrong::GoesOn));
    assert_eq!(goes_on, ["several_steps_are_carried_out_as_far_as_they_are_done", HANGS]);
    let backwards = named(&of(Wrong::Backwards));
    assert!(backwards.contains(&"several_steps_are_carried_out_as_far_as_they_are_done"), "{backwards:?}");
    assert_eq!(named(&of(Wrong::DoesNotStop)), ["several_steps_stop_where_they_are_told_to"]);
    assert_eq!(named(&of(Wrong::SharesTheTime)), ["each_of_several_steps_has_its_own_time"]);
    assert_eq!(named(&of(Wrong::AnswersAtTheEnd)), ["what_is_done_is_told_before_the_end_of_others"]);
    let waits = named(&of(Wrong::WaitsToGiveUp));
    assert!(waits.contains(&"a_call_that_is_given_up_comes_to_rest_and_counts_as_done"), "{waits:?}");
}

/// What was tried, expected and seen.
#[test]
fn what_is_wrong_is_told() {
    let tell = |wrong: Wrong, rule: &str| {
        let rule = rules().iter().find(|known| known.name == rule).expect("a rule");
        match rule.test(&WrongBed(wrong)) {
            RuleVerdict::Broken(told) => [told.with, told.expected, told.seen],
            other => panic!("{wrong:?}: {other:?}"),
        }
    };
    assert_eq!(
        tell(Wrong::HalfAConnect, "a_data_connection_is_the_only_one_of_its_port"),
        ["`connect a.y -> b.u (data)`, which was refused", "a.y -> b.u (data)", "nothing of that"]
    );
    assert_eq!(
        tell(Wrong::Panics, "one_component_observed_is_the_one_of_the_whole"),
        ["observing `nobody`", "an answer", "the platform panicked: no such component"]
    );
    assert_eq!(
        tell(Wrong::NeverAnswers, "a_component_may_be_connected_to_itself"),
        ["`destroy a`", "an answer by 1 s, or 100ms later at most", "no answer"]
    );
    assert_eq!(
        tell(Wrong::KnowsNoQuarantine, "a_hung_call_is_unknown_at_its_deadline_and_quarantined"),
        ["`configure bad`, which hangs", "in quarantine: `bad`", "nobody in quarantine"]
    );
}

/// A bed that can make nothing go wrong.
struct PlainBed;

impl Bed for PlainBed {
    fn make(&self, trouble: &[(&'static str, BedTrouble)]) -> UnderTest {
        assert!(trouble.is_empty(), "it was not to be asked");
        StandIn.make(trouble)
    }
    fn cannot(&self) -> &[Ability] {
        use Ability::{Beside, Deaf, Fails, Hangs, HangsReturn, MakingHangs, Panics, Raises, Works};
        &[Beside, Deaf, Fails, Hangs, HangsReturn, MakingHangs, Panics, Raises, Works]
    }
}

#[test]
fn what_cannot_be_tried_is_said() {
    let report = run(&PlainBed);
    assert!(report.is_kept(), "{report}");
    let skipped: Vec<String> = report.skipped().map(|(rule, why)| format!("{}: {why}", rule.name)).collect();
    assert!(skipped.len() > 10 && skipped.len() < rules().len() - 10, "{skipped:?}");
    let events = "events_of_components_reach_the_sink: the bed cannot make that a component raises an event";
    assert!(skipped.iter().any(|it| it == events), "{skipped:?}");
    assert!(report.to_string().contains("not tried: events_of_components_reach_the_sink (the bed cannot"), "{report}");
}

/// The chapter shows what is printed of a bus without a way for what is safe.
#[test]
fn the_chapter_shows_what_is_printed() {
    let chapter = std::fs::read_to_string("docs/platforms.md").expect("the chapter");
    let report = run(&WrongBed(Wrong::NothingIsSafe)).to_string();
    assert!(chapter.contains(report.trim()), "{report}");
    let bed = include_str!("own_platform.rs").split_once("struct BusBed;").expect("the bed").1;
    let shown = bed.split("    let skipped").next().expect("its test").trim();
    assert!(chapter.contains(shown), "docs/platforms.md shows another bed than:\n{shown}");
}
