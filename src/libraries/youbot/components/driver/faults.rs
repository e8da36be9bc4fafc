//! Faults of the drives, as they report them and as they are injected.

use super::Driver;

/// The fault of a motor that gave too much for too long.
pub(super) const I2T: &str = "i2t";

/// Faults that `comm_fault` injects: the property's value, the event, the flag.
pub(super) const FAULTS: [(&str, &str, i64); 9] = [
    ("overcurrent", "e_OVERCURRENT", 0x01),
    ("undervoltage", "e_UNDERVOLTAGE", 0x02),
    ("hall", "e_HALL_ERR", 0x10),
    ("sine_comm", "e_SINE_COMM_INIT_ERR", 0x100),
    (I2T, "e_I2T_EXCEEDED", 0x200),
    ("overtemp", "e_OVERTEMP", 0x04),
    ("ec_timeout", "e_EC_TIMEOUT", 0x40),
    ("encoder", "e_ENCODER_ERR", 0x20),
    ("emergency", "e_EMERGENCY_STOP", 0x80),
];

/// What each of them is, for `davit types`.
pub(super) const FAULT_WORDS: [&str; FAULTS.len()] = [
    "A motor takes too much current; the drives hold, e_OVERCURRENT.",
    "The drives have too little voltage; they hold, e_UNDERVOLTAGE.",
    "A Hall sensor fails; the drives hold, e_HALL_ERR.",
    "A motor does not find its commutation; the drives hold, e_SINE_COMM_INIT_ERR.",
    "A motor has taken much current for long; the drives hold, e_I2T_EXCEEDED.",
    "A motor is too hot; the drives hold, e_OVERTEMP.",
    "The field bus did not answer in time; the drives hold, e_EC_TIMEOUT.",
    "An encoder tells nonsense; the drives hold, e_ENCODER_ERR.",
    "Somebody pressed the emergency stop; the drives hold, e_EMERGENCY_STOP.",
];

impl Driver {
    /// A fault of that name happens; false: there is none.
    pub(super) fn fail(&mut self, wanted: &str) -> bool {
        let Some(i) = FAULTS.iter().position(|(name, ..)| *name == wanted) else { return false };
        self.motors.error_flags |= FAULTS[i].2;
        self.bus.pd_recv_err += i64::from(wanted == "ec_timeout");
        // How far a motion under way came nobody knows: it does not answer that it failed, but ends when it is given up.
        self.hold();
        self.events.raise(self.names.faults[i]);
        true
    }
}
