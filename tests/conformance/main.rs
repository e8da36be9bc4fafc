//! One contract for every platform (semantics: *Platforms*): each test is a rule of the `Platform` trait, run on every platform.
//!
//! A platform joins by a [`bed::Bed`]: how to make one with the test types of [`bed::types`], how to make a component of it
//! fail, panic or hang in a hook, hang while it is made or dropped, work long in an operation and hear, or not, that it is
//! given up, and how to make one raise an event.

mod bed;
mod cancelling;
mod embedded;
mod rules;
mod simulated;

/// All rules, wherever they are written.
mod all {
    pub use crate::{cancelling::*, rules::*};
}

/// Every rule as a test of its own, for the platform that `$bed` makes.
macro_rules! conforms {
    ($platform:ident, $bed:expr; $($rule:ident),* $(,)?) => {
        mod $platform {
            $(
                #[test]
                fn $rule() {
                    crate::all::$rule(&$bed);
                }
            )*
        }
    };
}

macro_rules! every_rule {
    ($platform:ident, $bed:expr) => {
        conforms!($platform, $bed;
            create_needs_a_known_type_and_a_free_name,
            create_needs_every_value_of_its_type_and_within_its_limits,
            run_states_move_along_the_legal_path_only,
            destroy_needs_unconfigured_and_no_connections,
            a_property_takes_its_type_within_its_limits,
            a_property_is_set_only_where_it_is_tunable,
            a_data_connection_is_the_only_one_of_its_port,
            types_units_and_directions_of_connected_ports_agree,
            event_ports_take_many_connections,
            port_write_needs_a_port_that_nothing_drives,
            a_written_value_survives_a_connection_and_never_written_comes_back,
            a_component_may_be_connected_to_itself,
            operations_need_their_arguments_and_answer_their_type,
            a_failed_step_leaves_the_component_as_it_was,
            a_panic_faults_the_component_and_nothing_else,
            faulted_components_can_be_cleaned_up_and_destroyed,
            a_hung_call_is_unknown_at_its_deadline_and_quarantined,
            a_quarantined_component_can_be_disconnected,
            a_call_that_returns_late_is_cleaned_up,
            brief_steps_are_carried_out_as_far_as_they_are_done,
            what_is_not_done_by_its_deadline_does_not_happen_later,
            unknown_is_settled_by_reading_back,
            events_of_components_reach_the_sink,
            prepared_steps_do_what_executed_ones_do,
            one_component_observed_is_the_one_of_the_whole,
            some_components_observed_are_those_of_the_whole,
            safe_steps_do_what_others_do,
            a_call_that_is_given_up_comes_to_rest_and_counts_as_done,
            giving_up_what_is_not_under_way_does_nothing,
            a_failure_before_being_told_stays_one,
            what_has_no_ear_goes_on_when_it_is_given_up,
            until_it_rests_a_component_begins_no_other_operation,
            a_component_that_does_not_rest_is_quarantined_until_it_does,
        );
    };
}

every_rule!(on_simulated, crate::simulated::SimulatedBed);
every_rule!(on_embedded, crate::embedded::EmbeddedBed);
