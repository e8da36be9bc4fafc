//! The youBot's coordinator: where the coupling could not be ended, the end of the stop that this leads to does not bring it back.

use crate::demo::at_home;

#[test]
fn a_coupling_that_could_not_be_ended_does_not_come_back() {
    for (arm, port) in [("generic_arm", "follower.follow"), ("youbot_arm", "Cart_Impedance.ext_ref_mode")] {
        for (how, event, on) in [
            ("fail", "e_link_lost", "e_reset"),
            ("lost", "e_misaligned", "e_reset"),
            ("slow", "e_force_spike", "e_reset"),
            ("fail", "e_link_lost", "e_shutdown"),
        ] {
            let set = [
                format!("arm={arm}"),
                format!("port={port}"),
                format!("how={how}"),
                format!("event={event}"),
                format!("on={on}"),
            ];
            let mut args = vec!["run", "tests/youbot/uncoupled.lua", "--clock", "simulated", "--platform", "simulated"];
            set.iter().for_each(|one| args.extend(["--set", one]));
            let ran = at_home(&args);
            assert_eq!(ran.code, 0, "{set:?}\n{}{}", ran.out, ran.err);
        }
    }
}
