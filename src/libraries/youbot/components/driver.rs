//! `youbot.Driver`: the robot's driver.

mod bus;
mod faults;
mod operations;

use super::samples::{
    DriverState, IdentifiedArm, JointState, MotorStates, Odometry, PlantCommand, PlantState, Twist, stamp,
};
use super::{aged, going_on};
use crate::libraries::youbot::drives::{DriveHappening, DriveMode, DriveOutput, DriveParameters, Drives, Measured};
use crate::libraries::youbot::motors::{Encoders, HeatChange, HeatLimit};
use crate::libraries::youbot::parameters::{GEAR, JOINTS, PARK_POSE_DEG, SPEED_LIMIT, TORQUE_CONSTANT, TORQUE_LIMIT};
use crate::libraries::youbot::rigid_body::{J5, radians};
use crate::model::{EventName, Tunable};
use crate::runtime::{Builder, Component, Context, EventOut, In, Out, Prop, Ticket};
use bus::BUS_TIMEOUT;
use faults::{FAULTS, I2T};

/// Drives that take torques are watched: when whoever does was not heard for so long it has stopped, in s.
const UNWATCHED: f64 = 0.04;
/// What lasts is told again so much later, as monitors do it: who was elsewhere when it began still hears of it. In s.
const AGAIN: f64 = 0.5;
/// Heating per current squared and time constant of a motor, °C/A² and s (assumed).
const HEATING: f64 = 1.5;
const HEAT_TIME: f64 = 120.0;
const AMBIENT: f64 = 25.0;

struct Events {
    soft_limit: EventName,
    soft_limit_exit: EventName,
    command_watchdog: EventName,
    base_watchdog: EventName,
    cooled: EventName,
    calibrated: EventName,
    calibration_failed: EventName,
    not_identified: EventName,
    arrived: EventName,
    blocked: EventName,
    dropped: EventName,
    emergency: EventName,
    unwatched: EventName,
    gives_way: EventName,
    faults: [EventName; FAULTS.len()],
}

/// The component.
pub struct Driver {
    effort: In<J5>,
    cmd_twist: In<Twist>,
    gripper: In<i32>,
    plant_state: In<PlantState>,
    watched: In<bool>,
    jointstate: Out<JointState>,
    odometry: Out<Odometry>,
    identified: Out<IdentifiedArm>,
    motor_states: Out<MotorStates>,
    driver_state: Out<DriverState>,
    control_mode: Out<u8>,
    tau_sat: Out<u8>,
    plant_command: Out<PlantCommand>,
    events: EventOut,
    tau_max: Prop<J5>,
    cmd_timeout: Prop<f64>,
    base_timeout: Prop<f64>,
    soft_limit: Prop<f64>,
    scale_end: Prop<f64>,
    encoders: Prop<bool>,
    heat_limit: Prop<bool>,
    speed_limit: Prop<bool>,
    comm_fault: Prop<String>,
    ifname: Prop<String>,
    names: Events,
    drives: Drives,
    counters: Encoders,
    heat: HeatLimit,
    running: bool,
    /// Whether the arm has been heard since it was started. Until then the drives are off, and nothing has failed.
    arm_is_there: bool,
    /// For how long a calibration has waited for the arm, in s.
    waits_for_arm: Option<f64>,
    /// The drives were told to be off, and what is left of their torque fades.
    goes_off: bool,
    motors: MotorStates,
    bus: DriverState,
    task: Option<Ticket>,
    /// For how long nobody has been watching, since that was told last, in s.
    unwatched: Option<f64>,
    /// The same of the arm.
    unheard: Option<f64>,
    /// Where it was heard last.
    plant: PlantState,
}

impl Component for Driver {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "The youBot's driver: of an arm and a base that are in youbot.World. Drives start off; the arm then rests on its \
             stops or sinks onto them. It may be started before its arm is there: the first to ask for it, the calibration, waits for it \
             for a second. An arm that is not heard any more for 20 ms: e_EC_TIMEOUT.",
        )
        .actuator()
        .exclusive("ethercat:{ifname}")
        .start_after("youbot.World")
        .on_configure(|c, _| {
            c.drives = Drives::new(radians(PARK_POSE_DEG));
            (c.counters, c.heat) = (Encoders::default(), HeatLimit::default());
            c.motors = MotorStates { temp: [AMBIENT; JOINTS], ..MotorStates::default() };
            c.bus = DriverState::default();
            if c.ifname.get_ref().is_empty() {
                return Err("no network interface is named (ifname)".into());
            }
            Ok(())
        })
        .on_start(|c, cx| {
            let heard = aged(&mut c.plant_state, cx).filter(|(_, age)| *age <= BUS_TIMEOUT);
            c.arm_is_there = heard.is_some();
            if let Some((state, _)) = heard {
                c.drives.measured = measured(&state);
                c.plant = state;
            }
            c.running = true;
            (c.unwatched, c.unheard, c.waits_for_arm, c.goes_off) = (None, None, None, false);
            Ok(())
        })
        .on_stop(|c, _| {
            c.running = false;
            (c.task, c.waits_for_arm, c.goes_off) = (None, None, false);
            if !c.drives.switch_off() {
                c.events.raise(c.names.dropped);
            }
            c.plant_command.write(PlantCommand { braked: true, ..PlantCommand::default() });
            c.control_mode.write(c.drives.mode().number());
            Ok(())
        });
        Self::offer_operations(b);
        let p = DriveParameters::default();
        Self {
            effort: b.doc("Torques, heard in mode 6.").unit("N m").input("joint_effort_command"),
            cmd_twist: b.doc("Motion of the base, in its frame, heard in mode 6.").input("cmd_twist"),
            gripper: b.doc("1 opens, 0 closes the gripper.").input("gripper_cmd"),
            plant_state: b.doc("Where arm and base are.").required().input("plant_state"),
            watched: b
                .doc("Whatever whoever watches the robot writes. Silent for 40 ms in mode 6: e_watch_lost.")
                .input("watched"),
            jointstate: b.doc("What the joints measure.").output("jointstate"),
            odometry: b.doc("Where the base is.").output("odometry"),
            identified: b
                .doc("How the arm differs from its model, found while it unfolds or folds by itself; not written before, nor where it does not tell.")
                .output("identified"),
            motor_states: b.doc("How the motors are.").output("motor_states"),
            driver_state: b.doc("How the field bus is.").output("driver_state"),
            control_mode: b.doc("What the drives do: 0, 1 or 6.").output("control_mode"),
            tau_sat: b.doc("Bit i: joint i+1 takes torques, and its drive gives all that it has.").output("tau_sat"),
            plant_command: b.doc("What is done to arm and base.").output("plant_command"),
            events: b.doc("Limits, watchdogs, errors.").event_output("events"),
            tau_max: b
                .doc("Largest torques.")
                .unit("N m")
                .range(0.0..=20.0)
                .property("tau_max", J5::from(TORQUE_LIMIT)),
            cmd_timeout: b
                .doc("Without a torque command for so long the drives hold by themselves.")
                .unit("s")
                .range(0.001..=10.0)
                .property("cmd_timeout", p.cmd_timeout),
            base_timeout: b
                .doc("Without a twist for so long the base stands.")
                .unit("s")
                .range(0.001..=10.0)
                .property("base_timeout", p.base_timeout),
            soft_limit: b
                .doc("Share of a joint's range from which outward torque is reduced.")
                .range(0.1..=1.0)
                .property("soft_limit", p.soft_limit),
            scale_end: b
                .doc("Share of a joint's range at which no outward torque is left.")
                .range(0.1..=1.0)
                .property("scale_end", p.scale_end),
            encoders: b
                .doc("Angles in whole counts of the encoders, speeds as differences of them; else as they truly are.")
                .property("encoders", false),
            heat_limit: b
                .doc(
                    "A motor gives tau_max for half a second and 80 % of it for ever (current squared times time); more: e_I2T_EXCEEDED. \
                     Else tau_max for ever.",
                )
                .property("heat_limit", false),
            speed_limit: b
                .doc(&format!(
                    "Drives that take torques slow down a joint that comes near {SPEED_LIMIT} rad/s, whatever is commanded; else it gets what is \
                     commanded at any speed."
                ))
                .property("speed_limit", p.speed_limit),
            comm_fault: b
                .doc(&format!("Fault to inject: none, {}.", FAULTS.each_ref().map(|fault| fault.name).join(", ")))
                .property("comm_fault", "none".to_owned()),
            ifname: b
                .doc("The network interface of the field bus.")
                .tunable(Tunable::Unconfigured)
                .property("ifname", "sim0".to_owned()),
            names: Events {
                soft_limit: b.doc("A joint is beyond the soft limit of its range.").event("e_JNT_SOFT_LIMIT_EXEEDED"),
                soft_limit_exit: b.doc("All joints are within the soft limits again.").event("e_JNT_SOFT_LIMIT_EXEEDED_EXIT"),
                command_watchdog: b.doc("Drives that take torques got none for cmd_timeout: they hold by themselves.").event("e_cmd_watchdog"),
                base_watchdog: b.doc("No motion of the base was commanded for base_timeout: it stands.").event("e_base_cmd_watchdog"),
                cooled: b.doc("The motor that gave too much for too long has cooled down.").event("e_I2T_EXCEEDED_EXIT"),
                calibrated: b.doc("Its calibration is done.").event("e_calibrated"),
                calibration_failed: b.doc("Its calibration failed.").event("e_calibration_failed"),
                not_identified: b
                    .doc("The torques of its unfolding fit no arm that it could be: it goes on as it is known, at first as the model has it.")
                    .event("e_not_identified"),
                arrived: b.doc("A motion that it was asked for has come to its end.").event("e_arrived"),
                blocked: b.doc("Something is in the way of a motion that it was asked for.").event("e_motion_blocked"),
                dropped: b.doc("The drives went off, and nothing holds the arm up.").event("e_arm_dropped"),
                emergency: b.event("e_EMERGENCY_STOP"),
                unwatched: b.doc("The monitors were not heard for 40 ms while the drives take torques.").event("e_watch_lost"),
                gives_way: b
                    .doc("The drives hold the arm with all that they have, and a joint was taken along by 0.05 rad: it is too heavy for them, or somebody is stronger.")
                    .event("e_arm_gives_way"),
                faults: FAULTS.each_ref().map(|fault| b.doc(&format!("{}; the drives hold.", fault.what)).event(fault.event)),
            },
            drives: Drives::new(radians(PARK_POSE_DEG)),
            running: false,
            arm_is_there: false,
            waits_for_arm: None,
            goes_off: false,
            motors: MotorStates::default(),
            bus: DriverState::default(),
            task: None,
            counters: Encoders::default(),
            heat: HeatLimit::default(),
            unwatched: None,
            unheard: None,
            plant: PlantState::default(),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let most = self.tau_max.get();
        self.drives.parameters = DriveParameters {
            tau_max: self.heat.of(&most),
            cmd_timeout: self.cmd_timeout.get(),
            base_timeout: self.base_timeout.get(),
            soft_limit: self.soft_limit.get(),
            scale_end: self.scale_end.get(),
            speed_limit: self.speed_limit.get(),
        };
        if self.comm_fault.changed() {
            let wanted = self.comm_fault.get_ref().clone();
            self.fail(&wanted);
        }
        let effort = aged(&mut self.effort, cx);
        let twist = aged(&mut self.cmd_twist, cx).map(|(t, age)| (t.into(), age));
        let (plant, age) = aged(&mut self.plant_state, cx).unwrap_or((self.plant, f64::INFINITY));
        let found = (age <= BUS_TIMEOUT).then(|| measured(&plant));
        if !self.arm_is_there && !self.finds_arm(found, cx.dt()) {
            return;
        }
        self.plant = plant;
        let (q, qd) = self.counters.read(&plant.pos.into(), cx.dt());
        let measured = match self.encoders.get() {
            true => Measured { q, qd, ..measured(&plant) },
            false => measured(&plant),
        };
        if cx.dt() > BUS_TIMEOUT {
            self.held_up(measured);
        }
        self.unheard = self.again(age > BUS_TIMEOUT, self.unheard, cx.dt(), |c| _ = c.fail("ec_timeout"));
        let _ = self.gripper.take();
        if self.task.as_ref().is_some_and(Ticket::is_cancelled) {
            // Nobody waits any more: the motion ends where it is.
            self.task = None;
            self.drives.hold();
        }
        let (events, names, task) = (&mut self.events, &self.names, &mut self.task);
        let driven = self.drives.update(measured, effort, twist, going_on(cx), &mut |what| match what {
            DriveHappening::SoftLimit => events.raise(names.soft_limit),
            DriveHappening::SoftLimitExit => events.raise(names.soft_limit_exit),
            DriveHappening::CommandWatchdog => events.raise(names.command_watchdog),
            DriveHappening::BaseWatchdog => events.raise(names.base_watchdog),
            DriveHappening::NotIdentified => events.raise(names.not_identified),
            DriveHappening::Calibrated | DriveHappening::Arrived => {
                events.raise(if what == DriveHappening::Arrived { names.arrived } else { names.calibrated });
                if let Some(ticket) = task.take() {
                    ticket.done(());
                }
            }
            DriveHappening::MotionFailed => {
                events.raise(names.blocked);
                if let Some(ticket) = task.take() {
                    ticket
                        .failed("the arm did not get there: something is in the way; it went back as far as it could");
                }
            }
            DriveHappening::CalibrationFailed => {
                events.raise(names.calibration_failed);
                if let Some(ticket) = task.take() {
                    ticket.failed("the stops were not found");
                }
            }
        });
        if self.goes_off && (driven.braked || self.drives.mode() != DriveMode::MotorStop) {
            self.goes_off = false;
            if let Some(ticket) = self.task.take() {
                match driven.braked {
                    true => ticket.done(()),
                    false => ticket.failed("the drives were told otherwise meanwhile"),
                }
            }
        }
        if !self.heat_limit.get() {
            self.heat = HeatLimit::default();
        } else if let Some(change) = self.heat.update(&driven.torque, &most, cx.dt()) {
            match change {
                HeatChange::Exceeded(joint) => _ = self.fail_at(I2T, Some(joint)),
                HeatChange::Exit => self.events.raise(self.names.cooled),
            }
        }
        let most = self.drives.parameters.tau_max;
        let full = |joint: &usize| driven.torque[*joint].abs() >= most[*joint];
        let full = (0..JOINTS).filter(full).fold(0, |mask, joint| mask | 1 << joint);
        self.tau_sat.write(if self.drives.mode() == DriveMode::Torque { full } else { 0 });
        let lost = aged(&mut self.watched, cx).is_some_and(|(_, age)| age > UNWATCHED);
        let lost = lost && self.drives.mode() == DriveMode::Torque;
        self.unwatched = self.again(lost, self.unwatched, cx.dt(), |c| c.events.raise(c.names.unwatched));
        if self.drives.gives_way() {
            self.events.raise(self.names.gives_way);
        }
        self.publish(&plant, &driven, cx);
    }
}

/// What is measured of a robot that is so.
fn measured(plant: &PlantState) -> Measured {
    Measured { q: plant.pos.into(), qd: plant.vel.into(), base: plant.base.split().1 }
}

impl Driver {
    /// Tells what is so, and tells it again as long as it lasts; since when it was told last, in s.
    fn again(&mut self, so: bool, told: Option<f64>, dt: f64, tell: impl FnOnce(&mut Self)) -> Option<f64> {
        let told = told.map(|since| since + dt).filter(|since| *since < AGAIN);
        so.then(|| {
            told.unwrap_or_else(|| {
                tell(self);
                0.0
            })
        })
    }

    fn publish(&mut self, plant: &PlantState, driven: &DriveOutput, cx: &Context) {
        let (torque, twist) = (driven.torque.into(), driven.twist.into());
        self.plant_command.write(PlantCommand { torque, braked: driven.braked, twist });
        let d = &self.drives;
        let (pos, vel) = (d.measured.q.into(), d.measured.qd.into());
        self.jointstate.write(JointState { pos, vel, eff: torque, stamp: stamp(cx.now()) });
        self.odometry.write(plant.base);
        for i in 0..JOINTS {
            let current = d.torque[i] / (TORQUE_CONSTANT[i] * GEAR[i]);
            let heat = AMBIENT + HEATING * current * current - self.motors.temp[i];
            self.motors.current[i] = current;
            self.motors.temp[i] += heat * cx.dt() / HEAT_TIME;
        }
        if let Some(arm) = d.identified() {
            self.identified.write(arm.into());
        }
        self.motor_states.write(self.motors);
        self.driver_state.write(self.bus);
        self.control_mode.write(d.mode().number());
    }
}
