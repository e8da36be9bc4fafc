//! What may be asked of the drives.

use super::Driver;
use super::bus::NO_ARM;
use crate::libraries::youbot::drives::{DriveMode, Drives};
use crate::libraries::youbot::parameters::JOINTS;
use crate::runtime::{Builder, Context, OperationAnswer};

/// Why a driver that has died does nothing.
const DIED: &str = "the driver has died: what its drives do is not known";

/// A driver that has died is asked in vain: what it answered nobody would do.
fn alive<A, R>(
    asked: impl Fn(&mut Driver, &mut Context, A) -> OperationAnswer<R>,
) -> impl Fn(&mut Driver, &mut Context, A) -> OperationAnswer<R> {
    move |driver, cx, args| match cx.is_faulted() {
        true => OperationAnswer::failed(DIED),
        false => asked(driver, cx, args),
    }
}

impl Driver {
    /// The operations, and the faults that a script may inject.
    pub(super) fn offer_operations(b: &mut Builder<Self>) {
        b.doc(
            "Changes what the drives do: 0 off (done when their torque has faded), 1 hold a position, 6 take torques (while they brake: \
             when they are released).",
        )
        .operation(
            "setControlMode",
            alive(|c, cx, (mode,): (u8,)| match DriveMode::from_number(mode) {
                Some(mode) if mode != DriveMode::MotorStop && !c.arm_is_there => OperationAnswer::failed(NO_ARM),
                Some(mode) => match c.drives.set_mode(mode) {
                    // What is stopped next takes away what is left at once.
                    Ok(()) if mode == DriveMode::MotorStop && c.running && c.arm_is_there && c.drives.fades() => {
                        (c.task, c.goes_off) = (Some(cx.ticket()), true);
                        OperationAnswer::Pending
                    }
                    set => set.map_or_else(OperationAnswer::failed, OperationAnswer::Done),
                },
                None => OperationAnswer::failed(format!("no control mode {mode}: 0, 1 or 6")),
            }),
        );
        b.doc("Finds the stops of joints 2 to 4; ends resting on them, drives off. Takes seconds. Waits for the arm for a second.")
            .no_effect()
            .moves()
            .operation("start_calibration", alive(|c, cx, (): ()| match c.arm_is_there || !c.running {
                true => c.begin(cx, Drives::calibrate),
                false => {
                    (c.task, c.waits_for_arm) = (Some(cx.ticket()), Some(0.0));
                    OperationAnswer::Pending
                }
            }));
        b.doc("Moves the arm from its stops to the working pose and holds it there. Takes seconds.")
            .undone_by("fold")
            .moves()
            .operation("unfold", alive(|c, cx, (): ()| c.begin(cx, Drives::unfold)));
        b.doc("Moves the arm onto its stops. Takes seconds.")
            .undone_by("unfold")
            .moves()
            .operation("fold", alive(|c, cx, (): ()| c.begin(cx, Drives::fold)));
        b.doc(
            "Has a fault happen once, by its name in comm_fault: as the world does it, with nothing written that would be a difference.",
        )
        .no_effect()
        .operation("inject_fault", alive(|c, _, (fault,): (String,)| match c.fail(&fault) {
            true => OperationAnswer::Done(()),
            false => OperationAnswer::failed(format!("no fault `{fault}`")),
        }));
        b.doc("Forgets the drives' error flags.").no_effect().operation(
            "clear_faults",
            alive(|c, _, (): ()| {
                (c.motors.error_flags, c.motors.joint_error_flags) = (0, [0; JOINTS]);
                OperationAnswer::Done(())
            }),
        );
        b.doc("The drives hold where they are, whatever is commanded; raises e_EMERGENCY_STOP.").no_effect().operation(
            "emergency_stop",
            alive(|c, _, (): ()| {
                c.task = None;
                c.hold();
                c.events.raise(c.names.emergency);
                OperationAnswer::Done(())
            }),
        );
        b.doc("Whatever moves comes to rest along a ramp and is held there; the base stands.")
            .undone_by("release")
            .operation(
                "brake",
                alive(|c, _, (): ()| {
                    c.task = None;
                    c.drives.brake();
                    OperationAnswer::Done(())
                }),
            );
        b.doc("The same, and nothing takes it back: for what moves although they were braked before.")
            .no_effect()
            .operation(
                "stop",
                alive(|c, _, (): ()| {
                    c.task = None;
                    c.drives.stop();
                    OperationAnswer::Done(())
                }),
            );
        b.doc(
            "The drives take torques, as mode 6 which was set before says: for after they held by themselves. Fails while they \
             brake and were not released.",
        )
        .no_effect()
        .operation("resume", alive(|c, _, (): ()| match c.arm_is_there {
            true => c.drives.resume().map_or_else(OperationAnswer::failed, OperationAnswer::Done),
            false => OperationAnswer::failed(NO_ARM),
        }));
        b.doc("The drives take torques again if they did before they braked, for whatever reason; else they hold on.")
            .undone_by("brake")
            .operation(
                "release",
                alive(|c, _, (): ()| {
                    c.drives.release();
                    OperationAnswer::Done(())
                }),
            );
        b.doc("Whether torques are passed on also near the joints' limits.").operation(
            "disable_jntlim_safety",
            alive(|c, _, (off,): (bool,)| {
                c.drives.limit_safety = !off;
                OperationAnswer::Done(())
            }),
        );
        Self::offer_faults(b);
    }

    /// Begins something that takes many updates; its ticket answers when it has ended.
    fn begin(&mut self, cx: &mut Context, f: fn(&mut Drives) -> Result<(), &'static str>) -> OperationAnswer {
        if !self.running {
            return OperationAnswer::failed("the driver is not running");
        }
        if !self.arm_is_there {
            return OperationAnswer::failed(NO_ARM);
        }
        match f(&mut self.drives) {
            Ok(()) => {
                self.task = Some(cx.ticket());
                OperationAnswer::Pending
            }
            Err(why) => OperationAnswer::failed(why),
        }
    }
}
