//! The youBot's coordinator: where the coupling could not be ended, the end of the stop that this leads to does not bring it back. And what of a robot could
//! not be taken away holds the other one only until it is.

use crate::demo::at_home;

#[test]
fn a_coupling_that_could_not_be_ended_does_not_come_back() {
    let controller = "Cart_Impedance.ext_ref_mode";
    for (arm, port) in
        [("generic_arm", "follower.follow"), ("youbot_arm", controller), ("youbot_arm_scoped", controller)]
    {
        for (how, event, stop, on) in [
            ("fail", "e_link_lost", "0", "e_reset"),
            ("lost", "e_misaligned", "0", "e_reset"),
            ("slow", "e_force_spike", "0", "e_reset"),
            ("fail", "e_link_lost", "0", "e_shutdown"),
            // A stop comes before it is answered: nobody hears then that it was given up.
            ("slow", "e_link_lost", "0.2", "e_reset"),
            ("lost", "e_force_spike", "0.01", "e_reset"),
            ("slow", "e_misaligned", "0.2", "e_shutdown"),
            ("lie", "e_estop", "0", "e_reset"),
        ] {
            let set = [
                format!("arm={arm}"),
                format!("port={port}"),
                format!("how={how}"),
                format!("event={event}"),
                format!("stop={stop}"),
                format!("on={on}"),
            ];
            let mut args = vec!["run", "tests/youbot/uncoupled.lua", "--clock", "simulated", "--platform", "simulated"];
            set.iter().for_each(|one| args.extend(["--set", one]));
            let ran = at_home(&args);
            assert_eq!(ran.code, 0, "{set:?}\n{}{}", ran.out, ran.err);
        }
    }
}

/// Nobody waits for ever for a robot of which nothing is left any more.
#[test]
fn who_is_down_with_something_left_is_down_when_that_is_gone() {
    let ran = at_home(&["run", "tests/youbot/left_behind.lua", "--clock", "simulated", "--platform", "simulated"]);
    assert_eq!(ran.code, 0, "{}{}", ran.out, ran.err);
}
