//! Faults of the drives, as they report them and as they are injected.

use super::Driver;
use crate::libraries::youbot::parameters::JOINTS;
use crate::runtime::{Builder, Failure};

/// A fault of the drives.
pub(super) struct DriveFault {
    /// As `comm_fault` and scripts call it.
    pub(super) name: &'static str,
    /// The event that tells it.
    pub(super) event: &'static str,
    /// The error flag that the drives show.
    flag: i64,
    /// Whether it is one motor's, and no matter of all drives.
    of_a_motor: bool,
    /// What it is, for `davit types`.
    pub(super) what: &'static str,
}

const fn fault(name: &'static str, event: &'static str, flag: i64, of_a_motor: bool, what: &'static str) -> DriveFault {
    DriveFault { name, event, flag, of_a_motor, what }
}

/// The fault of a motor that gave too much for too long.
pub(super) const I2T: &str = "i2t";

/// All of them.
pub(super) const FAULTS: [DriveFault; 9] = [
    fault("overcurrent", "e_OVERCURRENT", 0x01, true, "A motor takes too much current"),
    fault("undervoltage", "e_UNDERVOLTAGE", 0x02, false, "The drives have too little voltage"),
    fault("hall", "e_HALL_ERR", 0x10, true, "A Hall sensor fails"),
    fault("sine_comm", "e_SINE_COMM_INIT_ERR", 0x100, true, "A motor does not find its commutation"),
    fault(I2T, "e_I2T_EXCEEDED", 0x200, true, "A motor has taken much current for long"),
    fault("overtemp", "e_OVERTEMP", 0x04, true, "A motor is too hot"),
    fault("ec_timeout", "e_EC_TIMEOUT", 0x40, false, "The field bus did not answer in time"),
    fault("encoder", "e_ENCODER_ERR", 0x20, true, "An encoder tells nonsense"),
    fault("emergency", "e_EMERGENCY_STOP", 0x80, false, "Somebody pressed the emergency stop"),
];

impl Driver {
    /// What a script may inject: each fault by its name, one of a motor with the joint that the motor drives.
    pub(super) fn offer_faults(b: &mut Builder<Self>) {
        for DriveFault { name, event, of_a_motor, what, .. } in &FAULTS {
            let none = move || Failure(format!("no fault `{name}`"));
            let words = format!("{what}; the drives hold, {event}.");
            if *of_a_motor {
                b.doc(&format!("{words} Of a joint (0: not told which) motor_states.joint_error_flags shows it, too."))
                    .range(0.0..=JOINTS as f64)
                    .parameter("joint", Some(0_usize))
                    .injection(name, move |c, _, (joint,): (usize,)| {
                        c.fail_at(name, joint.checked_sub(1)).then_some(()).ok_or_else(none)
                    });
            } else {
                b.doc(&words).injection(name, move |c, _, (): ()| c.fail(name).then_some(()).ok_or_else(none));
            }
        }
    }

    /// A fault of that name happens, and nobody tells which motor's; false: there is none.
    pub(super) fn fail(&mut self, wanted: &str) -> bool {
        self.fail_at(wanted, None)
    }

    /// The same of the motor of a joint, counted from 0.
    pub(super) fn fail_at(&mut self, wanted: &str, joint: Option<usize>) -> bool {
        let Some(i) = FAULTS.iter().position(|fault| fault.name == wanted) else { return false };
        self.motors.error_flags |= FAULTS[i].flag;
        if let Some(flags) = joint.and_then(|joint| self.motors.joint_error_flags.get_mut(joint)) {
            *flags |= FAULTS[i].flag;
        }
        self.bus.pd_recv_err += i64::from(wanted == "ec_timeout");
        // How far a motion under way came nobody knows: it does not answer that it failed, but ends when it is given up.
        self.hold();
        self.events.raise(self.names.faults[i]);
        true
    }
}
