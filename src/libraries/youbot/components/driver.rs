//! `youbot.Driver`: the robot's driver.

use super::aged;
use super::samples::{DriverState, JointState, MotorStates, Odometry, PlantCommand, PlantState, Twist, stamp};
use crate::libraries::youbot::drives::{DriveHappening, DriveMode, DriveOutput, DriveParameters, Drives, Measured};
use crate::libraries::youbot::motors::{Encoders, HeatChange, HeatLimit};
use crate::libraries::youbot::parameters::{GEAR, JOINTS, PARK_POSE_DEG, TORQUE_CONSTANT, TORQUE_LIMIT};
use crate::libraries::youbot::rigid_body::{J5, radians};
use crate::model::{EventName, Tunable};
use crate::runtime::{Builder, Component, Context, EventOut, Failure, In, OperationAnswer, Out, Prop, Ticket};

/// An arm that was not heard for so long is not there any more: the field bus has failed, in s.
const BUS_TIMEOUT: f64 = 0.02;
/// An arm that has not been heard at all is waited for so long by who wants it to move, in s.
const BUS_UP: f64 = 1.0;
/// Why nothing moves before that.
const NO_ARM: &str = "the arm has not been heard yet (plant_state): nothing answers on the field bus";
/// Drives that take torques are watched: when whoever does was not heard for so long it has stopped, in s.
const UNWATCHED: f64 = 0.04;
/// What lasts is told again so much later, as monitors do it: who was elsewhere when it began still hears of it. In s.
const AGAIN: f64 = 0.5;
/// Heating per current squared and time constant of a motor, °C/A² and s (assumed).
const HEATING: f64 = 1.5;
const HEAT_TIME: f64 = 120.0;
const AMBIENT: f64 = 25.0;

/// The fault of a motor that gave too much for too long.
const I2T: &str = "i2t";

/// Faults that `comm_fault` injects: the property's value, the event, the flag.
const FAULTS: [(&str, &str, i64); 9] = [
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
const FAULT_WORDS: [&str; FAULTS.len()] = [
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

struct Events {
    soft_limit: EventName,
    soft_limit_exit: EventName,
    command_watchdog: EventName,
    base_watchdog: EventName,
    cooled: EventName,
    calibrated: EventName,
    calibration_failed: EventName,
    arrived: EventName,
    blocked: EventName,
    dropped: EventName,
    emergency: EventName,
    unwatched: EventName,
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
                c.drives.measured = Measured { q: state.pos.into(), qd: state.vel.into() };
                c.plant = state;
            }
            c.running = true;
            (c.unwatched, c.unheard, c.waits_for_arm) = (None, None, None);
            Ok(())
        })
        .on_stop(|c, _| {
            c.running = false;
            (c.task, c.waits_for_arm) = (None, None);
            if !c.drives.switch_off() {
                c.events.raise(c.names.dropped);
            }
            c.plant_command.write(PlantCommand { braked: true, ..PlantCommand::default() });
            Ok(())
        });
        b.doc("Changes what the drives do: 0 off, 1 hold a position, 6 take torques.").operation(
            "setControlMode",
            |c, _, (mode,): (u8,)| match DriveMode::from_number(mode) {
                Some(mode) if mode != DriveMode::MotorStop && !c.arm_is_there => OperationAnswer::failed(NO_ARM),
                Some(mode) => c.drives.set_mode(mode).map_or_else(OperationAnswer::failed, OperationAnswer::Done),
                None => OperationAnswer::failed(format!("no control mode {mode}: 0, 1 or 6")),
            },
        );
        b.doc("Finds the stops of joints 2 to 4; ends resting on them, drives off. Takes seconds. Waits for the arm for a second.")
            .no_effect()
            .moves()
            .operation("start_calibration", |c, cx, (): ()| match c.arm_is_there || !c.running {
                true => c.begin(cx, Drives::calibrate),
                false => {
                    (c.task, c.waits_for_arm) = (Some(cx.ticket()), Some(0.0));
                    OperationAnswer::Pending
                }
            });
        b.doc("Moves the arm from its stops to the working pose and holds it there. Takes seconds.")
            .undone_by("fold")
            .moves()
            .operation("unfold", |c, cx, (): ()| c.begin(cx, Drives::unfold));
        b.doc("Moves the arm onto its stops. Takes seconds.")
            .undone_by("unfold")
            .moves()
            .operation("fold", |c, cx, (): ()| c.begin(cx, Drives::fold));
        b.doc(
            "Has a fault happen once, by its name in comm_fault: as the world does it, with nothing written that would be a difference.",
        )
        .no_effect()
        .operation("inject_fault", |c, _, (fault,): (String,)| match c.fail(&fault) {
            true => OperationAnswer::Done(()),
            false => OperationAnswer::failed(format!("no fault `{fault}`")),
        });
        b.doc("Forgets the drives' error flags.").no_effect().operation("clear_faults", |c, _, (): ()| {
            c.motors.error_flags = 0;
            OperationAnswer::Done(())
        });
        b.doc("The drives hold where they are, whatever is commanded; raises e_EMERGENCY_STOP.").no_effect().operation(
            "emergency_stop",
            |c, _, (): ()| {
                c.task = None;
                c.hold();
                c.events.raise(c.names.emergency);
                OperationAnswer::Done(())
            },
        );
        b.doc("Whatever moves comes to rest along a ramp and is held there; the base stands.")
            .undone_by("release")
            .operation("brake", |c, _, (): ()| {
                c.task = None;
                c.drives.brake();
                OperationAnswer::Done(())
            });
        b.doc("The same, and nothing takes it back: for what moves although they were braked before.")
            .no_effect()
            .operation("stop", |c, _, (): ()| {
                c.task = None;
                c.drives.stop();
                OperationAnswer::Done(())
            });
        b.doc(
            "The drives take torques, as mode 6 which was set before says: for after they held by themselves. Fails while they \
             brake and were not released.",
        )
        .no_effect()
        .operation("resume", |c, _, (): ()| match c.arm_is_there {
            true => c.drives.resume().map_or_else(OperationAnswer::failed, OperationAnswer::Done),
            false => OperationAnswer::failed(NO_ARM),
        });
        b.doc("The drives take torques again if they did before they braked, for whatever reason; else they hold on.")
            .undone_by("brake")
            .operation("release", |c, _, (): ()| {
                c.drives.release();
                OperationAnswer::Done(())
            });
        b.doc("Whether torques are passed on also near the joints' limits.").operation(
            "disable_jntlim_safety",
            |c, _, (off,): (bool,)| {
                c.drives.limit_safety = !off;
                OperationAnswer::Done(())
            },
        );
        for (fault, what) in FAULTS.iter().zip(FAULT_WORDS) {
            let name = fault.0;
            b.doc(what).injection(name, move |c, _, (): ()| match c.fail(name) {
                true => Ok(()),
                false => Err(Failure(format!("no fault `{name}`"))),
            });
        }
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
            comm_fault: b
                .doc(&format!("Fault to inject: none, {}.", FAULTS.map(|(name, ..)| name).join(", ")))
                .property("comm_fault", "none".to_owned()),
            ifname: b
                .doc("The network interface of the field bus.")
                .tunable(Tunable::Unconfigured)
                .property("ifname", "sim0".to_owned()),
            names: Events {
                soft_limit: b.event("e_JNT_SOFT_LIMIT_EXEEDED"),
                soft_limit_exit: b.event("e_JNT_SOFT_LIMIT_EXEEDED_EXIT"),
                command_watchdog: b.event("e_cmd_watchdog"),
                base_watchdog: b.event("e_base_cmd_watchdog"),
                cooled: b.event("e_I2T_EXCEEDED_EXIT"),
                calibrated: b.event("e_calibrated"),
                calibration_failed: b.event("e_calibration_failed"),
                arrived: b.event("e_arrived"),
                blocked: b.event("e_motion_blocked"),
                dropped: b.event("e_arm_dropped"),
                emergency: b.event("e_EMERGENCY_STOP"),
                unwatched: b.event("e_watch_lost"),
                faults: FAULTS.map(|(_, event, _)| b.event(event)),
            },
            drives: Drives::new(radians(PARK_POSE_DEG)),
            running: false,
            arm_is_there: false,
            waits_for_arm: None,
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
        };
        if self.comm_fault.changed() {
            let wanted = self.comm_fault.get_ref().clone();
            self.fail(&wanted);
        }
        let effort = aged(&mut self.effort, cx);
        let twist = aged(&mut self.cmd_twist, cx).map(|(t, age)| (t.into(), age));
        let (plant, age) = aged(&mut self.plant_state, cx).unwrap_or((self.plant, f64::INFINITY));
        if !self.arm_is_there && !self.finds_arm(age <= BUS_TIMEOUT, cx.dt()) {
            return;
        }
        self.plant = plant;
        self.unheard = self.again(age > BUS_TIMEOUT, self.unheard, cx.dt(), |c| _ = c.fail("ec_timeout"));
        let _ = self.gripper.take();
        if self.task.as_ref().is_some_and(Ticket::is_cancelled) {
            // Nobody waits any more: the motion ends where it is.
            self.task = None;
            self.drives.hold();
        }
        let (events, names, task) = (&mut self.events, &self.names, &mut self.task);
        let counted = self.counters.read(&plant.pos.into(), cx.dt());
        let measured = match self.encoders.get() {
            true => counted,
            false => Measured { q: plant.pos.into(), qd: plant.vel.into() },
        };
        let driven = self.drives.update(measured, effort, twist, cx.dt(), &mut |what| match what {
            DriveHappening::SoftLimit => events.raise(names.soft_limit),
            DriveHappening::SoftLimitExit => events.raise(names.soft_limit_exit),
            DriveHappening::CommandWatchdog => events.raise(names.command_watchdog),
            DriveHappening::BaseWatchdog => events.raise(names.base_watchdog),
            DriveHappening::Calibrated | DriveHappening::Arrived => {
                events.raise(if what == DriveHappening::Arrived { names.arrived } else { names.calibrated });
                if let Some(ticket) = task.take() {
                    ticket.done(());
                }
            }
            DriveHappening::MotionFailed => {
                events.raise(names.blocked);
                if let Some(ticket) = task.take() {
                    ticket.failed("the arm did not get there: something is in the way");
                }
            }
            DriveHappening::CalibrationFailed => {
                events.raise(names.calibration_failed);
                if let Some(ticket) = task.take() {
                    ticket.failed("the stops were not found");
                }
            }
        });
        if !self.heat_limit.get() {
            self.heat = HeatLimit::default();
        } else if let Some(change) = self.heat.update(&driven.torque, &most, cx.dt()) {
            match change {
                HeatChange::Exceeded => _ = self.fail(I2T),
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
        self.publish(&plant, &driven, cx);
    }
}

impl Driver {
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

    /// Drives that have not heard their arm do not know where to hold it: they stay off.
    fn hold(&mut self) {
        if self.arm_is_there {
            self.drives.hold();
        }
    }

    /// Before the arm has been heard: the drives stay off, and all that is written is how they are. Whether it is `heard` now.
    fn finds_arm(&mut self, heard: bool, dt: f64) -> bool {
        self.arm_is_there = heard;
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

    /// A fault of that name happens; false: there is none.
    fn fail(&mut self, wanted: &str) -> bool {
        let Some(i) = FAULTS.iter().position(|(name, ..)| *name == wanted) else { return false };
        self.motors.error_flags |= FAULTS[i].2;
        self.bus.pd_recv_err += i64::from(wanted == "ec_timeout");
        // How far a motion under way came nobody knows: it does not answer that it failed, but ends when it is given up.
        self.hold();
        self.events.raise(self.names.faults[i]);
        true
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
        self.motor_states.write(self.motors);
        self.driver_state.write(self.bus);
        self.control_mode.write(d.mode().number());
    }
}
