//! What a safe configuration that comes in between makes of what was asked for before it.

use crate::support::Small;

/// Two undos of one step: something safe comes while the first is under way, and the second, which moves, stays undone. Who asked could
/// not know of it.
#[test]
fn what_a_safe_one_overtakes_is_no_mistake_of_who_asked() {
    let configurations = "base = Configuration { create('a', 'Drive'), post_conf_state = { 'a:running' } },
         lift = Configuration { operation_call('a.raise') }, halt = Configuration { safe = true, group = 'halt', operation_call('a.open') },";
    let states = |leaving: &str| {
        format!(
            "idle = state {{}},
             alive = state {{
               building = state {{ entry = 'base' }}, ready = state {{}}, lifting = state {{ entry = 'lift' }}, up = state {{}},
               halted = state {{ config = 'halt' }}, failed = state {{}},
               trans {{ src = 'initial', tgt = 'building' }},
               trans {{ src = 'building', tgt = 'ready', events = {{ 'base.ok' }} }},
               trans {{ src = 'building', tgt = 'failed', events = {{ 'base.failed', 'base.broken' }} }},
               trans {{ src = 'ready', tgt = 'lifting', events = {{ 'e_lift' }} }},
               trans {{ src = 'lifting', tgt = 'up', events = {{ 'lift.ok' }} }},
               trans {{ src = 'lifting', tgt = 'failed', events = {{ 'lift.failed', 'lift.broken' }} }},
               trans {{ src = 'halted', tgt = 'failed', events = {{ 'e_reset', 'halt.failed', 'halt.broken' }} }},
             }},
             leaving = state {{
               lowering = state {{ entry = {leaving} }}, removing = state {{ entry = 'base.undo' }},
               trans {{ src = 'initial', tgt = 'lowering' }},
               trans {{ src = 'lowering', tgt = 'removing', events = {{ 'lift.undone', 'lift.undo.failed', 'lift.undo.broken' }} }},
             }},
             trans {{ src = 'initial', tgt = 'idle' }},
             trans {{ src = 'idle', tgt = 'alive', events = {{ 'e_start' }} }},
             trans {{ src = 'alive', tgt = '.alive.halted', events = {{ 'e_stop' }} }},
             trans {{ src = 'leaving', tgt = '.alive.halted', events = {{ 'e_stop' }} }},
             trans {{ src = 'alive', tgt = 'leaving', events = {{ 'e_shutdown' }} }},
             trans {{ src = 'leaving', tgt = 'idle', events = {{ 'base.undone' }} }},
             trans {{ src = 'leaving', tgt = '.alive.failed', events = {{ 'base.undo.failed', 'base.undo.broken' }} }},"
        )
    };
    let refused = |leaving: &str| {
        let said = Small::new(configurations, &states(leaving), "safety: [e_stop]\n").check();
        let found = said.of("coord::request_refused");
        let lift = found.iter().filter(|f| f["message"].as_str().is_some_and(|told| told.starts_with("`lift.undo`")));
        lift.map(|f| f["severity"].as_str().unwrap_or_default().to_owned()).collect::<Vec<_>>()
    };
    assert!(refused("'lift.undo'").iter().all(|severity| severity == "info"), "{:?}", refused("'lift.undo'"));
    // Asked for in one step with something safe it is.
    assert!(
        refused("{ 'lift.undo', 'halt' }").contains(&"error".to_owned()),
        "{:?}",
        refused("{ 'lift.undo', 'halt' }")
    );
}
