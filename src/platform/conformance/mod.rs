//! The rules of the [`Platform`] trait, to be tried on a platform. Whoever brings one learns from them where it does otherwise
//! than a configurator relies on.
//!
//! A platform joins by a [`Bed`]: how to make one with the test types ([`types()`]), how to make a component of it fail, panic
//! or hang, and how to make one raise an event. Then a test of one's own is
//!
//! ```
//! use davit::platforms::conformance::{StandIn, run};
//!
//! // `StandIn` is the bed of the simulated platform; put your own here.
//! let report = run(&StandIn);
//! assert!(report.is_kept(), "{report}");
//! ```
//!
//! Nothing here panics to report, and nothing waits without a deadline of the platform's clock: a platform that panics, or does
//! not answer, has broken the rule that was being tried.

mod bed;
mod cancelling;
mod going_wrong;
mod looking;
mod report;
mod several;
mod stand_in;
mod steps;
mod trial;
mod words;

pub use bed::{Ability, Bed, BedRaise, BedTrouble, Times, UnderTest};
pub use report::{BrokenRule, RuleReport, RuleVerdict};
pub use stand_in::StandIn;
pub use words::types;

#[allow(unused_imports)] // named in the documentation
use super::Platform;
use crate::time::clock::panic_text;
use std::panic::{AssertUnwindSafe, catch_unwind};
use trial::{RuleEnds, RuleStop};

/// One rule of the trait.
pub struct Rule {
    /// What it is called.
    pub name: &'static str,
    /// What a platform that keeps it does.
    pub demands: &'static str,
    /// What it needs to be tried at all.
    pub needs: &'static [Ability],
    check: fn(&dyn Bed) -> RuleEnds,
}

impl Rule {
    /// Tries it on a platform that `bed` makes, in the calling thread.
    pub fn test(&self, bed: &dyn Bed) -> RuleVerdict {
        let cannot = bed.cannot();
        if let Some(missing) = self.needs.iter().find(|need| cannot.contains(need)) {
            return RuleVerdict::Skipped(format!("the bed cannot make that {missing}"));
        }
        match catch_unwind(AssertUnwindSafe(|| (self.check)(bed))) {
            Ok(Ok(())) => RuleVerdict::Kept,
            Ok(Err(RuleStop::Broken(broken))) => RuleVerdict::Broken(broken),
            Ok(Err(RuleStop::Skipped(why))) => RuleVerdict::Skipped(why),
            Err(payload) => RuleVerdict::Broken(BrokenRule {
                with: "the bed".to_owned(),
                expected: "a platform".to_owned(),
                seen: format!("a panic: {}", panic_text(&*payload)),
            }),
        }
    }
}

/// Every rule, the plainest first: whoever writes a platform makes them true in this order.
pub fn rules() -> &'static [Rule] {
    RULES
}

/// Tries every rule.
pub fn run(bed: &dyn Bed) -> RuleReport {
    RuleReport::new(rules().iter().map(|rule| (rule, rule.test(bed))).collect())
}

macro_rules! rules {
    ($($room:ident: $($name:ident [$($need:ident),*] $demands:literal)*;)*) => {
        const RULES: &[Rule] = &[$($(Rule {
            name: stringify!($name),
            demands: $demands,
            needs: &[$(Ability::$need),*],
            check: $room::$name,
        }),*),*];
    };
}

rules! {
    steps:
        create_needs_a_known_type_and_a_free_name []
            "A component is created unconfigured, with the values given; of a type that there is not, or under a name that is taken, it is refused."
        create_needs_every_value_of_its_type_and_within_its_limits []
            "Creating takes a value for every property, each of its type, within its limits and a number; anything else is refused."
        run_states_move_along_the_legal_path_only []
            "Configure, start, stop and cleanup happen from the run state that they begin in, and are refused in every other one."
        destroy_needs_unconfigured_and_no_connections []
            "Only an unconfigured component without connections is destroyed, and nothing is left of it, no written value either."
        a_property_takes_its_type_within_its_limits []
            "A property takes values of its type within its limits, and shows the last one it took."
        a_property_is_set_only_where_it_is_tunable []
            "A property is set in the run states in which it is tunable, and keeps its value through the others."
        a_data_connection_is_the_only_one_of_its_port []
            "A data connection is the only one of its in-port; buffered ones may share a port among themselves, and hold one value at least."
        types_units_and_directions_of_connected_ports_agree []
            "A connection leads from an out-port to an in-port of the same type, and of the same unit where both have one."
        event_ports_take_many_connections []
            "An in-port of events takes many connections, each once."
        port_write_needs_a_port_that_nothing_drives []
            "A value is written to an in-port of its type that has no connection and is neither buffered nor of events."
        a_written_value_survives_a_connection_and_never_written_comes_back []
            "What was written is recorded while the port is connected and in force again afterwards, until it is taken back."
        a_component_may_be_connected_to_itself []
            "A component may be connected to itself, and is not destroyed meanwhile."
        operations_need_their_arguments_and_answer_their_type []
            "An operation takes arguments of its types and answers a value of its own; anything else is refused.";
    looking:
        one_component_observed_is_the_one_of_the_whole []
            "One component observed is what the whole observation says of it, and none where there is none."
        some_components_observed_are_those_of_the_whole []
            "Some components observed are those of the whole observation, with the connections that begin or end at them and their written ports."
        events_of_components_reach_the_sink [Raises]
            "An event that a component raises reaches the sink, once and in its name."
        prepared_steps_do_what_executed_ones_do []
            "A prepared step does what the same step executed does, checks its precondition as well, and takes another value where one is given.";
    several:
        several_steps_are_carried_out_as_far_as_they_are_done []
            "Several steps in one call are carried out in their order; there is an answer for each that was begun, at least one, and none begins behind one that is not done."
        several_steps_stop_where_they_are_told_to []
            "Once it is told to stop, no second one of several steps begins."
        several_steps_end_with_one_that_hangs [MakingHangs]
            "Of several steps one that hangs is unknown at its deadline: what comes before it is done, and nothing behind it begins."
        each_of_several_steps_has_its_own_time [MakingHangs]
            "Each of several steps has its own time from its beginning on, whatever the others have."
        what_is_done_is_told_before_the_end_of_others [MakingHangs]
            "Of several steps each is answered as it ends: one that hangs keeps back no answer of those before it.";
    going_wrong:
        what_is_not_done_by_its_deadline_does_not_happen_later []
            "What was answered not to have happened does not happen later, and what was answered to have happened has."
        safe_steps_do_what_others_do []
            "A step of a safe configuration does what it does for others, and is refused where they are."
        a_failed_step_leaves_the_component_as_it_was [Fails]
            "A step whose component answers an error is not done, and the component is as it was."
        a_panic_faults_the_component_and_nothing_else [Panics]
            "A component whose code panics is faulted and the sink is told; the step is not done, and every other component goes on."
        faulted_components_can_be_cleaned_up_and_destroyed [Panics]
            "A faulted component can be cleaned up and destroyed, and nothing else."
        a_hung_call_is_unknown_at_its_deadline_and_quarantined [Hangs]
            "A call whose component does not return is unknown at its deadline, and the component is in quarantine; all others go on."
        a_hung_making_or_end_is_unknown_at_its_deadline_and_quarantined [MakingHangs]
            "So is a component that hangs while it is made, or dropped."
        a_quarantined_component_holds_up_no_other [Hangs]
            "While a component is in quarantine, others are created, connected, disconnected and destroyed."
        a_call_that_returns_late_is_cleaned_up [HangsReturn]
            "When a call in quarantine returns, its component is gone or as before the call, leaves quarantine, and the sink is told."
        a_making_or_end_that_returns_late_is_cleaned_up [MakingHangs, HangsReturn]
            "So does a component that hung while it was made, or dropped."
        unknown_is_settled_by_reading_back [Hangs]
            "What became of an unknown step can be read: a call that has not returned has not happened.";
    cancelling:
        a_call_that_is_given_up_comes_to_rest_and_counts_as_done [Works]
            "An operation that is given up half way comes to rest soon and counts as done, whatever it answers; giving up does not wait."
        giving_up_what_is_not_under_way_does_nothing [Works]
            "Giving up a call that is not under way does nothing, and exactly the call that is named is given up."
        a_failure_before_being_told_stays_one [Fails]
            "An operation that had failed before it was given up is not done."
        what_has_no_ear_goes_on_when_it_is_given_up [Hangs]
            "Only operations can be told; everything else goes on to its end, or its deadline, once it has begun."
        until_it_rests_a_component_begins_no_other_operation [Deaf]
            "Until a call that was given up has come to rest, the component begins no other operation; one that waits can be taken back."
        what_is_safe_runs_beside_a_call_that_does_not_rest [Deaf, Beside]
            "A safe step does not wait until a call that was given up has come to rest, where it needs nothing of the component's activity."
        a_component_that_does_not_rest_is_quarantined_until_it_does [Deaf]
            "An operation that does not come to rest by its deadline is unknown, and its component in quarantine until it does.";
}
