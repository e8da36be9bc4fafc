//! `youbot.Arm_Kinematics`: where the tool is.

use super::samples::{JointState, Odometry, ToolPose, ToolTwist};
use crate::libraries::youbot::kinematics::Tool;
use crate::libraries::youbot::parameters::{BASE_MOUNT, GRIPPER, TOOL_OFFSET};
use crate::libraries::youbot::rigid_body::{ArmModel, J5};
use crate::model::Tunable;
use crate::runtime::{Builder, Component, Context, In, Out, Prop};

/// The component.
pub struct ArmKinematics {
    jointstate: In<JointState>,
    odometry: In<Odometry>,
    tool_pose: Out<ToolPose>,
    tool_twist: Out<ToolTwist>,
    jacobian: Out<[f64; 24]>,
    manipulability: Out<f64>,
    tool_offset: Prop<[f64; 3]>,
    base_mount: Prop<[f64; 3]>,
    model: ArmModel,
}

impl Component for ArmKinematics {
    fn new(b: &mut Builder<Self>) -> Self {
        b.describe("Position and velocity of the tool in the world, and how base and joints move it.")
            .start_after("youbot.Driver")
            .on_configure(|c, _| {
                c.model.tool = c.tool_offset.get().into();
                c.model.mount = c.base_mount.get().into();
                Ok(())
            });
        Self {
            jointstate: b.doc("What the joints measure.").required().input("jointstate"),
            odometry: b.doc("Where the base is; without it, at the world's origin.").input("odometry"),
            tool_pose: b.doc("Where the tool is, in the world.").output("tool_pose"),
            tool_twist: b.doc("How it moves, in the world.").output("tool_twist"),
            jacobian: b
                .doc(
                    "Tool velocity per base twist (base's frame) and joint speed: 3 rows, 8 columns, column by column.",
                )
                .output("jacobian"),
            manipulability: b.doc("How far the arm is from a singular pose; 0 is singular.").output("manipulability"),
            tool_offset: b
                .doc("The tool point in the frame of joint 5.")
                .unit("m")
                .range(-1.0..=1.0)
                .tunable(Tunable::Unconfigured)
                .property("tool_offset", TOOL_OFFSET),
            base_mount: b
                .doc("The arm's foot in the base's frame.")
                .unit("m")
                .range(-1.0..=1.0)
                .tunable(Tunable::Unconfigured)
                .property("base_mount", BASE_MOUNT),
            model: ArmModel::youbot(GRIPPER.mass, 1.0),
        }
    }

    fn update(&mut self, _: &mut Context) {
        let Some(joints) = self.jointstate.get() else { return };
        let (pose, twist) = self.odometry.get().unwrap_or_default().split();
        let tool = Tool::of(&self.model, &J5::from(joints.pos), &J5::from(joints.vel), pose, twist);
        self.tool_pose.write(ToolPose { p: tool.position.into(), q: tool.orientation().coords.into() });
        self.tool_twist.write(ToolTwist { v: tool.velocity.into(), w: tool.rotation_rate.into() });
        let mut flat = [0.0; 24];
        flat.copy_from_slice(tool.jacobian().as_slice());
        self.jacobian.write(flat);
        self.manipulability.write(tool.manipulability());
    }
}
