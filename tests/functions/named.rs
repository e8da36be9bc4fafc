//! That none of the tests which rFSM's authors named (docs/rfsm.md §10) is missing from `rfsm.rs`.

const NAMED: [(&str, &str); 8] = [
    (
        "core",
        "initial_entry event_transition unknown_event_no_transition init_rejects_non_state entry_exit_order
         guard_blocks_transition effect_runs_and_receives_events priority_number any_event_transition reset
         string_event_sugar predicate_event get_active_conf step_hook_add_rm load_str load_str_rejects_non_state
         relative_and_local_refs",
    ),
    ("connector", "partial_chain_not_taken full_chain_taken split_connector exit_connector"),
    ("composite", "nested_entry_and_transitions reentry_uses_initial example_models_load"),
    (
        "doo",
        "leaf_without_doo_completes_immediately doo_runs_to_completion_raises_e_done doo_can_raise_events
         event_preempts_doo idle_flag_keeps_state_active step_count",
    ),
    (
        "timeevent",
        "fires_after_timeout timeout_via_function timer_restarts_on_reentry e_at_absolute legacy_string_syntax",
    ),
    (
        "extensions",
        "emem_counts_across_steps emem_reset_on_exit await_multiple_events await_resets_on_exit
         checkevents_warns_on_unknown monitor_state seqand",
    ),
    ("marsh", "model2tab_structure model2tab_requires_initialized actinfo2tab rfsm2json_encode"),
    ("plantuml", "encode_basics states_and_nesting transitions_and_initial title requires_initialized"),
];

#[test]
fn each_of_the_51_tests_of_rfsm_is_here_under_its_name() {
    let text = include_str!("rfsm.rs");
    let mut count = 0;
    for (group, names) in NAMED {
        let module = text.split(&format!("\nmod {group} {{\n")).nth(1).expect(group).split("\n}\n").next().unwrap();
        for name in names.split_whitespace() {
            assert!(module.contains(&format!("    #[test]\n    fn {name}() {{\n")), "{group}::{name} is missing");
            count += 1;
        }
    }
    assert_eq!(count, 51);
}
