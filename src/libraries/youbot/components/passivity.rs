//! `youbot.Passivity_Observer`: whether the coupling gives out more energy than it takes in.

use super::samples::ToolPose;
use crate::libraries::youbot::passivity::{CouplingEnd, PassivityObserver};
use crate::runtime::{Builder, Component, Context, In, OperationAnswer, Out, Prop};
use nalgebra::Vector3;

/// What is seen of one robot.
struct Port {
    force: In<Vector3<f64>>,
    tool_pose: In<ToolPose>,
    engaged: In<f64>,
}

impl Port {
    fn declare(b: &mut Builder<CouplingObserver>, robot: &str) -> Self {
        Self {
            force: b
                .doc("What its coupling puts on its tool, as Cart_Impedance gives it.")
                .unit("N")
                .required()
                .input(&format!("{robot}_force")),
            tool_pose: b.doc("Where its tool is.").required().input(&format!("{robot}_tool_pose")),
            engaged: b.doc("How much of its coupling is in force.").required().input(&format!("{robot}_engaged")),
        }
    }

    fn end(&mut self) -> Option<CouplingEnd> {
        Some(CouplingEnd { force: self.force.get()?, position: self.tool_pose.get()?.p.into() })
    }

    fn engaged(&mut self) -> bool {
        self.engaged.get().is_some_and(|engaged| engaged > 0.0)
    }
}

/// The component.
pub struct CouplingObserver {
    ports: [Port; 2],
    energy: Out<f64>,
    minimum: Out<f64>,
    stored: Out<f64>,
    violated: Out<bool>,
    stiffness: Prop<f64>,
    offset: Prop<Vector3<f64>>,
    observer: PassivityObserver,
    engaged: bool,
}

impl Component for CouplingObserver {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe(
            "Counts what the coupling of two robots takes in and gives out at both tools, the network between them included, \
             from the moment on that one of them engages. In the activity of the controllers.",
        )
        .on_start(|c, _| {
            (c.observer, c.engaged) = (PassivityObserver::default(), false);
            Ok(())
        });
        b.doc("Begins anew; what was violated is forgotten.").no_effect().operation("reset", |c, _, (): ()| {
            (c.observer, c.engaged) = (PassivityObserver::default(), false);
            OperationAnswer::Done(())
        });
        Self {
            ports: ["left", "right"].map(|robot| Port::declare(b, robot)),
            energy: b.doc("Taken in so far, less what was given out.").unit("J").output("energy"),
            minimum: b.doc("The least of it.").unit("J").output("minimum"),
            stored: b.doc("What the spring held when the robots engaged.").unit("J").output("stored"),
            violated: b.doc("Whether more was ever given out than was taken in and stored.").output("violated"),
            stiffness: b.doc("Of the coupling.").unit("N/m").range(0.0..=1000.0).property("stiffness", 150.0),
            offset: b
                .doc("The left robot's world minus the right one's.")
                .unit("m")
                .range(-100.0..=100.0)
                .property("offset", Vector3::zeros()),
            observer: PassivityObserver::default(),
            engaged: false,
        }
    }

    fn update(&mut self, _: &mut Context) {
        let [left, right] = &mut self.ports;
        let (Some(a), Some(b)) = (left.end(), right.end()) else { return };
        let engaged = [left.engaged(), right.engaged()].contains(&true);
        if engaged && !self.engaged {
            let apart = b.position + self.offset.get() - a.position;
            self.observer.begin(0.5 * self.stiffness.get() * apart.norm_squared());
        }
        self.engaged = engaged;
        self.observer.update([a, b]);
        self.energy.write(self.observer.energy);
        self.minimum.write(self.observer.minimum);
        self.stored.write(self.observer.stored);
        self.violated.write(self.observer.violated);
    }
}
