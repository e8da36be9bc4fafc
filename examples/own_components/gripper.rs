//! `mine.Gripper`: two jaws on a spindle. `docs/components.md` goes through it, piece by piece.

use davit::EventName;
use davit::component::{Builder, Component, Context, EventOut, Failure, OperationAnswer, Out, Prop, Ticket, Tunable};

/// Widest opening, in m.
const OPEN: f64 = 0.1;
/// What it pulls at the spindle while the jaws press, in N.
const PRESS: f64 = 25.0;

/// Where the jaws are to go, and who waits for it.
struct Motion {
    to: f64,
    ticket: Ticket,
}

/// Two jaws on a spindle.
pub struct Gripper {
    width: Out<f64>,
    force: Out<f64>,
    events: EventOut,
    device: Prop<String>,
    speed: Prop<f64>,
    e_grasped: EventName,
    e_dropped: EventName,
    /// What a real one would read from its spindle, in m.
    at: f64,
    /// How wide what lies between the jaws is, in m; none: nothing lies there.
    thing: Option<f64>,
    holds: bool,
    jammed: bool,
    motion: Option<Motion>,
}

impl Component for Gripper {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Two jaws on a spindle, 0 to 0.1 m apart. Closing ends where something is between them.")
            .actuator()
            .exclusive("serial:{device}")
            .on_configure(|this, _| {
                // Here a real one opens its device.
                match this.device.get().is_empty() {
                    true => Err("which device? `device` is empty".into()),
                    false => Ok(()),
                }
            })
            .on_stop(|this, _| {
                this.motion = None;
                Ok(())
            });
        b.doc("Closes until something is between the jaws, or until they meet. Takes up to 2 s.")
            .undone_by("open")
            .moves()
            .operation("close", |this: &mut Self, cx: &mut Context, (): ()| this.begin(cx, 0.0));
        b.doc("Opens wide: what was held falls. Takes up to 2 s.")
            .undone_by("close")
            .moves()
            .operation("open", |this: &mut Self, cx: &mut Context, (): ()| this.begin(cx, OPEN));
        b.doc("Stays as it is; what is held is held on to.").no_effect().operation(
            "halt",
            |this: &mut Self, _: &mut Context, (): ()| {
                this.motion = None;
                OperationAnswer::Done(())
            },
        );
        b.doc("Something lies between the jaws.").unit("m").range(0.0..=OPEN).parameter("width", Some(0.04)).injection(
            "thing",
            |this, _, (width,): (f64,)| {
                this.thing = Some(width);
                Ok::<(), Failure>(())
            },
        );
        b.doc("What is held slips out; e_dropped.").injection("slip", |this, _, (): ()| match this.holds {
            true => {
                this.thing = None;
                Ok(())
            }
            false => Err("nothing is held".into()),
        });
        b.doc("The spindle jams at the next motion: the component fails.").injection("jam", |this, _, (): ()| {
            this.jammed = true;
            Ok::<(), Failure>(())
        });
        Self {
            width: b.doc("How far the jaws are apart.").unit("m").output("width"),
            force: b.doc("With how much they press.").unit("N").output("force"),
            events: b.doc("What was grasped and dropped.").event_output("events"),
            device: b
                .doc("The serial device of its spindle.")
                .tunable(Tunable::Unconfigured)
                .required_property("device", String::new()),
            speed: b
                .doc("How fast the jaws move.")
                .unit("m/s")
                .range(0.01..=0.2)
                .tunable(Tunable::Always)
                .property("speed", 0.05),
            e_grasped: b.doc("Something is between the jaws, and held.").event("e_grasped"),
            e_dropped: b.doc("What was held is gone, and nobody opened.").event("e_dropped"),
            at: OPEN,
            thing: None,
            holds: false,
            jammed: false,
            motion: None,
        }
    }

    fn update(&mut self, cx: &mut Context) {
        if self.motion.as_ref().is_some_and(|motion| motion.ticket.is_cancelled()) {
            // Nobody waits any more: it stops where it is, and drops the ticket.
            self.motion = None;
        }
        if let Some(motion) = &self.motion {
            if self.jammed {
                return cx.fault("the spindle does not turn");
            }
            let step = self.speed.get() * cx.dt();
            let to = self.thing.filter(|thing| motion.to < *thing && *thing <= self.at).unwrap_or(motion.to);
            self.at += (to - self.at).clamp(-step, step);
            if self.at == to {
                self.arrived(to);
            }
        }
        if self.holds && self.thing.is_none() {
            self.holds = false;
            self.events.raise(self.e_dropped);
        }
        self.width.write(self.at);
        self.force.write(if self.holds { PRESS } else { 0.0 });
    }
}

impl Gripper {
    /// The jaws begin to move: the answer comes when they are there.
    fn begin(&mut self, cx: &mut Context, to: f64) -> OperationAnswer {
        if cx.is_faulted() {
            return OperationAnswer::failed("it has failed: nothing turns its spindle");
        }
        self.holds &= to == 0.0;
        self.motion = Some(Motion { to, ticket: cx.ticket() });
        OperationAnswer::Pending
    }

    fn arrived(&mut self, at: f64) {
        if Some(at) == self.thing && !self.holds {
            self.holds = true;
            self.events.raise(self.e_grasped);
        }
        if let Some(motion) = self.motion.take() {
            motion.ticket.done(());
        }
    }
}
