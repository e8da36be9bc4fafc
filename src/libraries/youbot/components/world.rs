//! `youbot.World`: the bodies of one or two robots, and what they touch.

use super::aged;
use super::samples::{PlantCommand, PlantState, ToolPose, ToolTwist, stamp};
use crate::libraries::youbot::parameters::{GRIPPER, PARK_POSE_DEG};
use crate::libraries::youbot::rigid_body::{J5, radians};
use crate::libraries::youbot::world::{Bar, FAR, PLANT_STEP, RobotBody, Surroundings};
use crate::model::{EventName, Tunable};
use crate::runtime::{Builder, Component, Context, EventOut, In, Out, Prop};
use nalgebra::Vector3;

/// Drives that were not told anything for so long are off, their windings shorted: the watchdog of the field bus, in s.
const BUS_WATCHDOG: f64 = 0.02;
/// A push older than this has ended, in s.
const PUSH_STALE: f64 = 0.05;

/// An arm whose windings are shorted has fallen when its tool has come down by more than this, in m.
const FALL: f64 = 0.02;

/// One robot's body with its ports.
struct WorldRobot {
    command: In<PlantCommand>,
    ext_force: In<Vector3<f64>>,
    state: Out<PlantState>,
    tool_pose: Out<ToolPose>,
    tool_twist: Out<ToolTwist>,
    contact: Out<Vector3<f64>>,
    torque: Out<J5>,
    q_start: Prop<J5>,
    mass_scale: Prop<f64>,
    payload: Prop<f64>,
    friction_scale: Prop<f64>,
    torque_lag: Prop<f64>,
    table: Prop<f64>,
    wall: Prop<f64>,
    place: Prop<f64>,
    body: RobotBody,
    /// Where its tool was when its windings were shorted, in m; none: they are not, or it has fallen and that was told.
    held_at: Option<f64>,
    braked: bool,
    /// Whether there is such a robot: it was connected once since the world was configured.
    is_there: bool,
}

impl WorldRobot {
    fn declare(b: &mut Builder<YoubotWorld>, robot: &str) -> Self {
        let named = |name: &str| format!("{robot}_{name}");
        let s = Surroundings::default();
        Self {
            command: b
                .doc("What its driver does to it. Silent for 20 ms: the drives are off, their windings shorted.")
                .input(&named("command")),
            ext_force: b.doc("What a hand does to its tool, in the world.").unit("N").input(&named("ext_force")),
            state: b.doc("Where it is, for its driver.").output(&named("state")),
            tool_pose: b.doc("Where its tool truly is.").output(&named("tool_pose")),
            tool_twist: b.doc("How its tool truly moves.").output(&named("tool_twist")),
            contact: b.doc("What table, wall and bar do to its tool, in the world.").unit("N").output(&named("contact")),
            torque: b
                .doc("What its motors give: what its driver wants, with their lag; nothing while their windings are shorted.")
                .unit("N m")
                .output(&named("torque")),
            q_start: b
                .doc("Where its arm is when the simulation begins, rad from candle.")
                .unit("rad")
                .range(-3.0..=3.0)
                .tunable(Tunable::Unconfigured)
                .property(&named("q_start"), radians(PARK_POSE_DEG)),
            mass_scale: b
                .doc("Masses of its arm, as a multiple of the nominal ones.")
                .range(0.1..=3.0)
                .property(&named("mass_scale"), 1.0),
            payload: b
                .doc("Mass at its tool, the gripper included. It may be taken up and put down at any time.")
                .unit("kg")
                .range(0.0..=3.0)
                .property(&named("payload"), GRIPPER.mass),
            friction_scale: b
                .doc("Its friction, as a multiple of the nominal one.")
                .range(0.0..=10.0)
                .property(&named("friction_scale"), 1.0),
            torque_lag: b
                .doc("Time constant with which its motors' torques follow what is wanted.")
                .unit("s")
                .range(0.0..=0.02)
                .property(&named("torque_lag"), 0.0),
            table: b
                .doc("Height of the table its tool may touch; far below: none.")
                .unit("m")
                .range(-FAR..=FAR)
                .property(&named("table"), s.table),
            wall: b
                .doc("Where the wall stands that its tool may touch, across the x axis; far away: none.")
                .unit("m")
                .range(-FAR..=FAR)
                .property(&named("wall"), s.wall),
            place: b
                .doc("Where its frame begins on the world's x axis, along which the bar slides. All else is in its own frame.")
                .unit("m")
                .range(-FAR..=FAR)
                .property(&named("place"), 0.0),
            body: RobotBody::new(radians(PARK_POSE_DEG), 1.0),
            held_at: None,
            braked: false,
            is_there: false,
        }
    }

    /// Whether its arm has just fallen.
    fn step(&mut self, cx: &Context, surroundings: Surroundings) -> bool {
        let command = aged(&mut self.command, cx).filter(|(_, age)| *age <= BUS_WATCHDOG);
        let command = command.map_or(PlantCommand { braked: true, ..PlantCommand::default() }, |(command, _)| command);
        let push = aged(&mut self.ext_force, cx).filter(|(_, age)| *age <= PUSH_STALE);
        let push = push.map(|(force, _)| force).unwrap_or_default();
        if self.mass_scale.changed() | self.payload.changed() {
            self.body.weigh(self.mass_scale.get(), self.payload.get());
        }
        self.body.arm.friction_scale = self.friction_scale.get();
        self.body.torque_lag = self.torque_lag.get();
        let bar = surroundings.bar.map(|bar| Bar { at: bar.at - self.place.get(), ..bar });
        self.body.surroundings = Surroundings { table: self.table.get(), wall: self.wall.get(), bar, ..surroundings };
        self.body.advance(&command.torque.into(), command.twist.into(), &push, command.braked, cx.dt());
        let height = self.body.tool().position.z;
        if std::mem::replace(&mut self.braked, command.braked) != command.braked {
            self.held_at = command.braked.then_some(height);
        }
        self.held_at.take_if(|held| height < *held - FALL).is_some()
    }

    fn publish(&mut self, stamp: i64) {
        let (arm, base, tool) = (&self.body.arm, &self.body.base, self.body.tool());
        self.state.write(PlantState::new(arm.q, arm.qd, base.pose, base.twist, stamp));
        self.tool_pose.write(ToolPose { p: tool.position.into(), q: tool.orientation().coords.into() });
        self.tool_twist.write(ToolTwist { v: tool.velocity.into(), w: tool.rotation_rate.into() });
        self.contact.write(self.body.contact);
        self.torque.write(*self.body.given());
    }
}

/// The component.
pub struct YoubotWorld {
    places: [WorldRobot; 2],
    bar: Option<Bar>,
    bar_at: Prop<f64>,
    bar_mass: Prop<f64>,
    bar_damping: Prop<f64>,
    bar_position: Out<f64>,
    events: EventOut,
    fell: EventName,
    /// The same of each.
    fell_of: [EventName; 2],
    stiffness: Prop<f64>,
    damping: Prop<f64>,
}

impl Component for YoubotWorld {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(&format!(
            "The simulated world: arms and bases of one or two robots (rigid bodies, friction, stops, the base's lag), a table and a \
             wall that their tools touch, and a bar that both push. Steps of {} ms: give its activity that period. Drivers, hands and controllers see it through ports \
             only; it goes on while drivers are stopped.",
            PLANT_STEP * 1e3
        ))
        .on_configure(|c, _| {
            for place in &mut c.places {
                place.body = RobotBody::new(place.q_start.get(), place.mass_scale.get());
                place.body.weigh(place.mass_scale.get(), place.payload.get());
                (place.held_at, place.braked, place.is_there) = (None, false, false);
            }
            c.put_bar();
            Ok(())
        })
        .on_start(|c, cx| {
            let now = stamp(cx.now());
            c.places.iter_mut().for_each(|place| place.publish(now));
            Ok(())
        });
        let s = Surroundings::default();
        Self {
            places: ["robot1", "robot2"].map(|robot| WorldRobot::declare(b, robot)),
            bar: None,
            bar_at: b
                .doc("Where a bar across the x axis is put, which tools push along that axis; far away: there is none.")
                .unit("m")
                .range(-FAR..=FAR)
                .property("bar", FAR),
            bar_mass: b.doc("Of the bar.").unit("kg").range(0.2..=100.0).property("bar_mass", 1.0),
            bar_damping: b.doc("Of the bar's rails.").unit("N s/m").range(0.0..=500.0).property("bar_damping", 2.0),
            bar_position: b.doc("Where the bar is; written while there is one.").unit("m").output("bar_position"),
            events: b.doc("That an arm came down.").event_output("events"),
            fell: b.doc("An arm whose windings are shorted came down by more than 2 cm.").event("e_arm_fell"),
            fell_of: ["robot1", "robot2"]
                .map(|robot| b.doc(&format!("The arm of {robot} did.")).event(&format!("e_{robot}_fell"))),
            stiffness: b
                .doc("Of table, wall and bar.")
                .unit("N/m")
                .range(0.0..=20_000.0)
                .property("contact_stiffness", s.stiffness),
            damping: b
                .doc("Of table, wall and bar.")
                .unit("N s/m")
                .range(0.0..=500.0)
                .property("contact_damping", s.damping),
        }
    }

    fn update(&mut self, cx: &mut Context) {
        let now = stamp(cx.now());
        if self.bar_at.changed() {
            self.put_bar();
        }
        let (mass, damping) = (self.bar_mass.get(), self.bar_damping.get());
        self.bar = self.bar.map(|bar| Bar { mass, damping, ..bar });
        let (stiffness, damping) = (self.stiffness.get(), self.damping.get());
        let surroundings = Surroundings { stiffness, damping, bar: self.bar, ..Surroundings::default() };
        let mut on_bar = 0.0;
        for (place, fell) in self.places.iter_mut().zip(self.fell_of) {
            place.is_there |= place.state.is_connected();
            if place.is_there {
                if place.step(cx, surroundings) {
                    self.events.raise(self.fell);
                    self.events.raise(fell);
                }
                on_bar += place.body.on_bar;
                place.publish(now);
            }
        }
        if let Some(bar) = &mut self.bar {
            bar.step(on_bar, cx.dt());
            self.bar_position.write(bar.at);
        }
    }
}

impl YoubotWorld {
    /// The bar stands where it is put; far away there is none.
    fn put_bar(&mut self) {
        let (at, mass, damping) = (self.bar_at.get(), self.bar_mass.get(), self.bar_damping.get());
        self.bar = (at.abs() < FAR).then_some(Bar { at, speed: 0.0, mass, damping });
    }
}
