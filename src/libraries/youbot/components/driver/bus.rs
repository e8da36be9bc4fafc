//! The field bus: whether the arm answers on it, and who waits for that.

use super::Driver;
use crate::libraries::youbot::drives::Measured;
use crate::runtime::Ticket;

/// An arm that was not heard for so long is not there any more: the field bus has failed, in s. Drives that are told nothing for so long switch
/// themselves off (`youbot.World`).
pub(super) const BUS_TIMEOUT: f64 = 0.02;
/// An arm that has not been heard at all is waited for so long by who wants it to move, in s.
const BUS_UP: f64 = 1.0;
/// Why nothing moves before that.
pub(super) const NO_ARM: &str = "the arm has not been heard yet (plant_state): nothing answers on the field bus";

impl Driver {
    /// Drives that have not heard their arm do not know where to hold it: they stay off.
    pub(super) fn hold(&mut self) {
        if self.arm_is_there {
            self.drives.hold();
        }
    }

    /// It comes back after the drives were told nothing for longer than their watchdog waits: they are off, and give no torque. Where they had power
    /// that is a fault of the bus; the arm is held where it is now, by torques that begin from none.
    pub(super) fn held_up(&mut self, measured: Measured) {
        if self.drives.has_power() {
            self.drives.lose_power(measured);
            self.fail("ec_timeout");
        }
    }

    /// Before the arm has been heard: the drives stay off, and all that is written is how they are. Whether it is `heard` now, and where it is then: what is
    /// held, or moved, begins there.
    pub(super) fn finds_arm(&mut self, heard: Option<Measured>, dt: f64) -> bool {
        self.arm_is_there = heard.is_some();
        if let Some(measured) = heard {
            self.drives.find(measured);
        }
        let heard = heard.is_some();
        if self.task.as_ref().is_some_and(Ticket::is_cancelled) {
            (self.task, self.waits_for_arm) = (None, None);
        }
        if let Some(waited) = self.waits_for_arm.take() {
            let outcome = match heard {
                true => self.drives.calibrate(),
                false if waited < BUS_UP => {
                    self.waits_for_arm = Some(waited + dt);
                    Ok(())
                }
                false => Err(NO_ARM),
            };
            if let Err(why) = outcome
                && let Some(ticket) = self.task.take()
            {
                ticket.failed(why);
            }
        }
        if !heard {
            self.motor_states.write(self.motors);
            self.driver_state.write(self.bus);
            self.control_mode.write(self.drives.mode().number());
        }
        heard
    }
}
