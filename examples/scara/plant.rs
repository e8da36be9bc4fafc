//! `scara.Plant`: the arm itself, in simulated or in real time.

use super::aged;
use super::model::{AXES, Body, Done, PARKED, STEP, V4, V5, jacobian, tool};
use super::samples::{Axes, Command, Tool};
use davit::component::{Builder, Component, Context, In, Out, Prop};
use davit::platforms::Tunable;

/// Drives that were not heard for so long are off and the brake is closed: the watchdog of the bus, in s.
const BUS_WATCHDOG: f64 = 0.02;

/// The component.
pub struct Plant {
    command: In<Command>,
    state: Out<Axes>,
    tool: Out<Tool>,
    start: Prop<[f64; AXES]>,
    payload: Prop<f64>,
    friction: Prop<f64>,
    body: Body,
    /// Somebody pushes the tool: with what, in N, and for how much longer, in s.
    push: (V4, f64),
}

impl Component for Plant {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(&format!(
            "A SCARA on a rail, as rigid bodies: full mass matrix, Coriolis and centrifugal forces, weight of the quill, Coulomb's and \
             viscous friction, stops, a brake. Steps of at most {} ms. It goes on while its drives are stopped.",
            STEP * 1e3
        ))
        .on_configure(|c, _| {
            c.body = Body::new(c.start.get().into(), c.payload.get());
            c.push = (V4::zeros(), 0.0);
            Ok(())
        })
        .on_start(|c, _| {
            c.publish();
            Ok(())
        });
        b.doc("Somebody pushes the tool, in N, for so many seconds.")
            .parameter("x", Some(0.0))
            .parameter("y", Some(0.0))
            .parameter("z", Some(0.0))
            .parameter("seconds", None::<f64>)
            .injection("push", |c, _, (x, y, z, seconds): (f64, f64, f64, f64)| {
                c.push = (V4::new(x, y, z, 0.0), seconds);
                Ok(())
            });
        Self {
            command: b
                .doc("What its drives do to it. Silent for 20 ms: they are off, and the brake is closed.")
                .input("command"),
            state: b.doc("Where its axes are.").output("state"),
            tool: b.doc("Where its tool truly is, and how it moves.").output("tool"),
            start: b
                .doc("Where its axes are when the simulation begins, m and rad.")
                .range(-6.3..=6.3)
                .tunable(Tunable::Unconfigured)
                .property("start", PARKED),
            payload: b
                .doc("What the gripper really carries.")
                .unit("kg")
                .range(0.0..=5.0)
                .tunable(Tunable::Unconfigured)
                .property("payload", super::drives::BELIEVED_PAYLOAD),
            friction: b
                .doc("Its friction, as a multiple of the nominal one.")
                .range(0.0..=5.0)
                .property("friction", 1.0),
            body: Body::new(PARKED.into(), 0.0),
            push: (V4::zeros(), 0.0),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let command = aged(&mut self.command, cx).filter(|(_, age)| *age <= BUS_WATCHDOG);
        let command =
            command.map_or(Command { shorted: true, brake: true, ..Command::default() }, |(command, _)| command);
        self.push.1 -= cx.dt();
        let push = if self.push.1 > 0.0 { self.push.0 } else { V4::zeros() };
        self.body.friction = self.friction.get();
        let done = Done { effort: V5::from(command.effort), push, shorted: command.shorted, brake: command.brake };
        self.body.advance(&done, cx.dt());
        self.publish();
    }
}

impl Plant {
    fn publish(&mut self) {
        let (q, v) = (&self.body.q, &self.body.v);
        self.state.write(Axes { pos: (*q).into(), vel: (*v).into() });
        self.tool.write(Tool { p: tool(q).into(), v: (jacobian(q) * v).into() });
    }
}
