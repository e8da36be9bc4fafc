//! `scara.Drives`: the drives of the arm and its rail.

use super::aged;
use super::drives::{Commanded, Drives, Ended, Mode, SOFT_LIMIT};
use super::model::{AXES, LARGEST, V5};
use super::samples::{Axes, Command};
use davit::EventName;
use davit::component::{Builder, Component, Context, EventOut, Failure, In, OperationAnswer, Out, Ticket};

/// An arm, or whoever commands or watches it, that was not heard for so long is not there any more, in s.
const BUS_TIMEOUT: f64 = 0.02;
const COMMAND_TIMEOUT: f64 = 0.02;
const UNWATCHED: f64 = 0.04;
/// What lasts is told again so much later, in s: who was elsewhere when it began still hears of it.
const AGAIN: f64 = 0.5;
/// Back inside the soft limit by so much of a range before that is told.
const HYSTERESIS: f64 = 0.02;

/// What can be wrong with them: the name, the event, what it is.
const FAULTS: [(&str, &str, &str); 5] = [
    ("overcurrent", "e_OVERCURRENT", "A motor takes too much current; the drives hold, e_OVERCURRENT."),
    ("overtemp", "e_OVERTEMP", "A motor is too hot; the drives hold, e_OVERTEMP."),
    ("encoder", "e_ENCODER_ERR", "An encoder tells nonsense; the drives hold, e_ENCODER_ERR."),
    ("bus", "e_EC_TIMEOUT", "The field bus did not answer in time; the drives hold, e_EC_TIMEOUT."),
    ("emergency", "e_EMERGENCY_STOP", "Somebody pressed the emergency stop; the drives hold, e_EMERGENCY_STOP."),
];
/// The one that an arm which is not heard means.
const BUS: usize = 3;

/// Why drives that have died do nothing.
const DIED: &str = "the drives have died: what they do is not known";

const UNACKNOWLEDGED: &str = "a fault was not acknowledged";

struct Names {
    faults: [EventName; FAULTS.len()],
    command_watchdog: EventName,
    unwatched: EventName,
    soft_limit: EventName,
    soft_limit_exit: EventName,
}

/// The component.
pub struct Driver {
    plant: In<Axes>,
    effort: In<[f64; AXES]>,
    rail: In<f64>,
    watched: In<bool>,
    command: Out<Command>,
    axes: Out<Axes>,
    mode: Out<u8>,
    at_limit: Out<i64>,
    wrong: Out<i64>,
    events: EventOut,
    names: Names,
    drives: Drives,
    faults: i64,
    task: Option<Ticket>,
    /// For how long they have been taking torques, in s.
    taking: f64,
    outside: bool,
    unheard: Option<f64>,
    unwatched: Option<f64>,
}

/// What has died is asked in vain: what it answered nobody would do.
fn alive<A>(
    asked: impl Fn(&mut Driver, &mut Context, A) -> OperationAnswer,
) -> impl Fn(&mut Driver, &mut Context, A) -> OperationAnswer {
    move |drives, cx, args| match cx.is_faulted() {
        true => OperationAnswer::failed(DIED),
        false => asked(drives, cx, args),
    }
}

impl Component for Driver {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "The drives of a SCARA on a rail. Off, the quill's brake carries it; they hold by themselves (1), or take forces and torques, \
             and a speed of the rail (2). Steps of 1 ms: give its activity that period.",
        )
        .actuator()
        .start_after("scara.Plant")
        .on_configure(|c, _| {
            (c.drives, c.faults) = (Drives::default(), 0);
            Ok(())
        })
        .on_start(|c, _| {
            let Some(seen) = c.plant.get() else {
                return Err("the arm is not heard (plant): start it first".into());
            };
            c.drives.see(seen.pos.into(), seen.vel.into());
            (c.outside, c.unheard, c.unwatched) = (false, None, None);
            Ok(())
        })
        .on_stop(|c, _| {
            c.task = None;
            c.drives.switch_off();
            c.command.write(Command { shorted: true, brake: true, ..Command::default() });
            Ok(())
        });
        b.doc("Changes what the drives do: 0 off and the brake closed, 1 hold, 2 take torques.").operation(
            "set_mode",
            alive(|c, _, (mode,): (u8,)| match Mode::from_number(mode) {
                Some(mode) => c.set_mode(mode),
                None => OperationAnswer::failed(format!("no mode {mode}: 0, 1 or 2")),
            }),
        );
        b.doc("The quill to its upper stop, then the carriage to its end. Takes seconds.")
            .no_effect()
            .moves()
            .operation("home", alive(|c, cx, (): ()| c.begin(cx, Drives::home)));
        b.doc("To the working pose, and holds there. Takes seconds.")
            .undone_by("fold")
            .moves()
            .operation("unfold", alive(|c, cx, (): ()| c.begin(cx, Drives::unfold)));
        b.doc("Folded, the quill at its top, the carriage at its end. Takes seconds.")
            .undone_by("unfold")
            .moves()
            .operation("fold", alive(|c, cx, (): ()| c.begin(cx, Drives::fold)));
        b.doc("Whatever moves comes to rest along a ramp and is held there.").undone_by("release").operation(
            "brake",
            alive(|c, _, (): ()| {
                c.task = None;
                c.drives.brake();
                OperationAnswer::Done(())
            }),
        );
        b.doc("They take torques again if they did before they braked and nothing is wrong; else they hold on.")
            .undone_by("brake")
            .operation(
                "release",
                alive(|c, _, (): ()| {
                    c.drives.release(c.faults == 0);
                    OperationAnswer::Done(())
                }),
            );
        b.doc("As brake, and nothing takes it back: for what moves although they were braked before.")
            .no_effect()
            .operation(
                "stop",
                alive(|c, _, (): ()| {
                    c.task = None;
                    c.drives.stop();
                    OperationAnswer::Done(())
                }),
            );
        b.doc("They take torques, whatever made them hold. Fails while they were told to brake, or a fault was not acknowledged.").no_effect().operation(
            "resume",
            alive(|c, _, (): ()| match c.faults {
                0 => c.drives.resume().map_or_else(OperationAnswer::failed, OperationAnswer::Done),
                _ => OperationAnswer::failed(UNACKNOWLEDGED),
            }),
        );
        b.doc("What was wrong is over: they take torques again when they are asked to.").no_effect().operation(
            "acknowledge",
            alive(|c, _, (): ()| {
                c.faults = 0;
                OperationAnswer::Done(())
            }),
        );
        for (i, (name, _, what)) in FAULTS.into_iter().enumerate() {
            b.doc(what).injection(name, move |c, _, (): ()| {
                c.fail(i);
                Ok::<(), Failure>(())
            });
        }
        Self {
            plant: b.doc("Where the axes are.").required().input("plant"),
            effort: b.doc("Forces and torques of the arm, heard in mode 2; the rail's is not.").input("effort"),
            rail: b.doc("Where the carriage is to go, heard in mode 2.").unit("m/s").input("rail"),
            watched: b
                .doc("Whatever whoever watches writes. Silent for 40 ms in mode 2: e_watch_lost.")
                .input("watched"),
            command: b.doc("What is done to the arm.").output("command"),
            axes: b.doc("Where the axes are, and how they move.").output("axes"),
            mode: b.doc("What the drives do: 0, 1 or 2.").output("mode"),
            at_limit: b.doc("How many motors give the most they can.").output("at_limit"),
            wrong: b.doc("Faults that were not acknowledged, a bit each.").output("wrong"),
            events: b.doc("Limits, watchdogs, errors.").event_output("events"),
            names: Names {
                faults: FAULTS.map(|(_, event, what)| b.doc(what).event(event)),
                command_watchdog: b
                    .doc("Nothing was commanded in mode 2 for too long: they hold by themselves.")
                    .event("e_cmd_watchdog"),
                unwatched: b.doc("Whoever watches was silent for 40 ms in mode 2.").event("e_watch_lost"),
                soft_limit: b.doc("An axis is beyond the soft limit of its range.").event("e_JNT_SOFT_LIMIT_EXEEDED"),
                soft_limit_exit: b
                    .doc("All axes are within the soft limits again.")
                    .event("e_JNT_SOFT_LIMIT_EXEEDED_EXIT"),
            },
            drives: Drives::default(),
            faults: 0,
            task: None,
            taking: 0.0,
            outside: false,
            unheard: None,
            unwatched: None,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let dt = cx.dt();
        let seen = aged(&mut self.plant, cx);
        if let Some((seen, _)) = seen {
            self.drives.see(V5::from(seen.pos), V5::from(seen.vel));
        }
        // Held up for longer than their watchdog waits the drives were off: they hold where the arm is now, with forces that begin from none.
        if dt > BUS_TIMEOUT && self.drives.mode() != Mode::Off {
            self.drives.lose_power();
            self.fail(BUS);
        }
        let deaf = seen.is_none_or(|(_, age)| age > BUS_TIMEOUT);
        if told(&mut self.unheard, deaf, dt) {
            self.fail(BUS);
        }
        if self.task.as_ref().is_some_and(Ticket::is_cancelled) {
            // Nobody waits any more: the motion ends where it is.
            self.task = None;
            self.drives.hold();
        }
        let fresh = |age: f64| age <= COMMAND_TIMEOUT;
        let effort = aged(&mut self.effort, cx).filter(|(_, age)| fresh(*age));
        let rail = aged(&mut self.rail, cx).filter(|(_, age)| fresh(*age));
        let command = effort.zip(rail).map(|((effort, _), (rail, _))| Commanded { effort: effort.into(), rail });
        // Who has just begun to command them has a moment to be heard in; until then they hold.
        self.taking = if self.drives.mode() == Mode::Torques { self.taking + dt } else { 0.0 };
        if self.taking > COMMAND_TIMEOUT && command.is_none() {
            self.drives.hold();
            self.events.raise(self.names.command_watchdog);
        }
        let unwatched = aged(&mut self.watched, cx).is_some_and(|(_, age)| age > UNWATCHED);
        if told(&mut self.unwatched, unwatched && self.drives.mode() == Mode::Torques, dt) {
            self.events.raise(self.names.unwatched);
        }
        match self.drives.update(command, going_on(cx)) {
            None => {}
            Some(Ended::Well) => _ = self.task.take().map(|task| task.done(())),
            Some(Ended::Badly) => _ = self.task.take().map(|task| task.failed("the axes did not get there")),
        }
        self.watch_limits();
        let off = self.drives.mode() == Mode::Off;
        let effort = self.drives.effort;
        // The brake closes with no force left on it.
        let rest = off && effort == V5::zeros();
        self.command.write(Command { effort: effort.into(), shorted: rest, brake: rest });
        self.axes.write(seen.map_or_else(Axes::default, |(seen, _)| seen));
        self.mode.write(self.drives.mode().number());
        let at_limit = (0..AXES).filter(|i| effort[*i].abs() >= LARGEST[*i]).count();
        self.wrong.write(self.faults);
        self.at_limit.write(at_limit.try_into().unwrap_or(i64::MAX));
    }
}

/// Whether to tell, or to tell again, of what is so; `since` is when that was told last.
fn told(since: &mut Option<f64>, so: bool, dt: f64) -> bool {
    *since = since.map(|since| since + dt).filter(|since| so && *since < AGAIN);
    let tell = so && since.is_none();
    if tell {
        *since = Some(0.0);
    }
    tell
}

/// How far an update takes ramps and motions, in s: one period, however long it was held up before.
fn going_on(cx: &Context) -> f64 {
    let period = if cx.period() > 0.0 { cx.period() } else { 0.001 };
    cx.dt().min(period)
}

impl Driver {
    fn set_mode(&mut self, mode: Mode) -> OperationAnswer {
        if mode == Mode::Torques && self.faults != 0 {
            return OperationAnswer::failed(UNACKNOWLEDGED);
        }
        self.drives.set_mode(mode).map_or_else(OperationAnswer::failed, OperationAnswer::Done)
    }

    /// Begins what takes many updates; its ticket answers when that has ended.
    fn begin(&mut self, cx: &mut Context, f: fn(&mut Drives) -> Result<(), &'static str>) -> OperationAnswer {
        match f(&mut self.drives) {
            Ok(()) => {
                self.task = Some(cx.ticket());
                OperationAnswer::Pending
            }
            Err(why) => OperationAnswer::failed(why),
        }
    }

    /// A fault: they hold. How far a motion came nobody knows, so it does not answer: it ends when it is given up.
    fn fail(&mut self, fault: usize) {
        self.faults |= 1 << fault;
        self.drives.hold();
        self.events.raise(self.names.faults[fault]);
    }

    fn watch_limits(&mut self) {
        let off = self.drives.excursion();
        let free = self.drives.mode() == Mode::Torques;
        if !self.outside && free && off > SOFT_LIMIT {
            self.outside = true;
            self.events.raise(self.names.soft_limit);
        } else if self.outside && (!free || off < SOFT_LIMIT - HYSTERESIS) {
            self.outside = false;
            self.events.raise(self.names.soft_limit_exit);
        }
    }
}
