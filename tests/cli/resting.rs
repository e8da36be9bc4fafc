//! Stopped once the arm lies on its stops: heard to the end of the way down, which goes on from where it had come to.

use crate::demo::Demo;

/// Slow at the first of a step, an emergency stop comes in the state; where it waits then.
const PLACES: [(&str, &str, &str); 5] = [
    ("stop follower", "shutting_down.stopping", "root.resting.parked.waiting"),
    ("stop arm", "shutting_down.powering_off", "root.resting.parked.waiting"),
    ("cleanup arm", "shutting_down.cleaning", "root.resting.stopped.waiting"),
    ("disconnect arm.state", "shutting_down.unwiring", "root.resting.cleaned.waiting"),
    ("destroy watch", "shutting_down.destroying", "root.resting.unwired.waiting"),
];

#[test]
fn a_stop_is_heard_to_the_end_of_the_way_down() {
    let deployment = concat!(env!("CARGO_MANIFEST_DIR"), "/deployments/generic_arm.yaml");
    for (step, state, waits) in PLACES {
        let demo = Demo::new();
        let script = format!(
            "deploy('{deployment}')
            wait(0.5)
            fault('{step}', 'slow', 1, 0.4)
            raise('e_shutdown')
            wait_state('{state}', 10)
            wait(0.1)
            raise('e_estop')
            wait_answer('safe_hold.ok', 0.05)
            wait_state('{waits}', 1)
            wait(1)
            raise('e_reset')
            wait(0.5)
            raise('e_shutdown')
            wait_state('idle', 10)
            shutdown()"
        );
        demo.write("stop.lua", &script);
        let ran = demo.run(&["run", "stop.lua", "--clock", "simulated"]);
        assert_eq!(ran.code, 0, "{state}: {}{}", ran.out, ran.err);
        assert!(!ran.out.contains("forced"), "{state}: {}", ran.out);
    }
}
