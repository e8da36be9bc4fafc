//! What travels through the ports.

use crate::libraries::youbot::base::{Pose2, Twist2};
use crate::libraries::youbot::identification::ArmScales;
use crate::libraries::youbot::rigid_body::J5;
use crate::time::Time;

crate::runtime::record! {
    /// What the joints measure.
    #[derive(Copy, Default)]
    pub struct JointState {
        /// Angles from candle, rad.
        pub pos: [f64; 5],
        /// Speeds, rad/s.
        pub vel: [f64; 5],
        /// Torques, N m.
        pub eff: [f64; 5],
        /// When, ns of the clock.
        pub stamp: i64,
    }

    /// Where the base is and how it moves.
    #[derive(Copy, Default)]
    pub struct Odometry {
        /// In m.
        pub x: f64,
        /// In m.
        pub y: f64,
        /// In rad.
        pub th: f64,
        /// Forward, m/s, in the base's frame.
        pub vx: f64,
        /// To the left, m/s.
        pub vy: f64,
        /// Turning left, rad/s.
        pub wz: f64,
    }

    /// A planar velocity in the base's frame.
    #[derive(Copy, Default)]
    pub struct Twist {
        /// Forward, m/s.
        pub vx: f64,
        /// To the left, m/s.
        pub vy: f64,
        /// Turning left, rad/s.
        pub wz: f64,
    }

    /// What a driver does to arm and base.
    #[derive(Copy, Default)]
    pub struct PlantCommand {
        /// Torques, N m.
        pub torque: [f64; 5],
        /// The windings are shorted, and no torque is given.
        pub braked: bool,
        /// Where the base is to go.
        pub twist: Twist,
    }

    /// Where arm and base are.
    #[derive(Copy, Default)]
    pub struct PlantState {
        /// Angles from candle, rad.
        pub pos: [f64; 5],
        /// Speeds, rad/s.
        pub vel: [f64; 5],
        /// The base.
        pub base: Odometry,
        /// When, ns of the clock.
        pub stamp: i64,
    }

    /// How the arm differs from its model, as a motion has told.
    #[derive(Copy)]
    pub struct IdentifiedArm {
        /// Its links' masses, as multiples of the model's.
        pub mass_scale: f64,
        /// Its joints' friction, the same.
        pub friction_scale: f64,
    }

    /// How the motors are.
    #[derive(Copy, Default)]
    pub struct MotorStates {
        /// In A.
        pub current: [f64; 5],
        /// In °C.
        pub temp: [f64; 5],
        /// As the drives' firmware counts them; 0 is none.
        pub error_flags: i64,
        /// The same of each joint's motor, as far as it is told whose they are.
        pub joint_error_flags: [i64; 5],
    }

    /// How the field bus is.
    #[derive(Copy, Default)]
    pub struct DriverState {
        /// Send errors so far.
        pub pd_send_err: i64,
        /// Receive errors so far.
        pub pd_recv_err: i64,
    }

    /// Where the tool is, in the world.
    #[derive(Copy)]
    pub struct ToolPose {
        /// In m.
        pub p: [f64; 3],
        /// Unit quaternion x, y, z, w.
        pub q: [f64; 4],
    }

    /// How the tool moves, in the world.
    #[derive(Copy, Default)]
    pub struct ToolTwist {
        /// In m/s.
        pub v: [f64; 3],
        /// In rad/s.
        pub w: [f64; 3],
    }

    /// The other robot's tool, in its world.
    #[derive(Copy, Default)]
    pub struct ExtRef {
        /// In m.
        pub p: [f64; 3],
        /// In m/s.
        pub v: [f64; 3],
        /// When it was so, ns of this robot's clock.
        pub stamp: i64,
        /// The other robot wants to be coupled.
        pub coupled: bool,
        /// Energy its coupling has given to this one's so far, J.
        pub energy: f64,
    }
}

impl From<ArmScales> for IdentifiedArm {
    fn from(arm: ArmScales) -> Self {
        Self { mass_scale: arm.mass, friction_scale: arm.friction }
    }
}

impl From<IdentifiedArm> for ArmScales {
    fn from(arm: IdentifiedArm) -> Self {
        Self { mass: arm.mass_scale, friction: arm.friction_scale }
    }
}

impl From<Twist2> for Twist {
    fn from(t: Twist2) -> Self {
        Self { vx: t.vx, vy: t.vy, wz: t.wz }
    }
}

impl From<Twist> for Twist2 {
    fn from(t: Twist) -> Self {
        Self { vx: t.vx, vy: t.vy, wz: t.wz }
    }
}

impl Odometry {
    /// From position and motion.
    pub fn new(pose: Pose2, twist: Twist2) -> Self {
        Self { x: pose.x, y: pose.y, th: pose.th, vx: twist.vx, vy: twist.vy, wz: twist.wz }
    }

    /// Position and motion.
    pub fn split(&self) -> (Pose2, Twist2) {
        (Pose2 { x: self.x, y: self.y, th: self.th }, Twist2 { vx: self.vx, vy: self.vy, wz: self.wz })
    }
}

impl PlantState {
    /// From the parts.
    pub fn new(q: J5, qd: J5, pose: Pose2, twist: Twist2, stamp: i64) -> Self {
        Self { pos: q.into(), vel: qd.into(), base: Odometry::new(pose, twist), stamp }
    }
}

/// A moment as the `stamp` of a sample: ns, up to 292 years.
pub fn stamp(time: Time) -> i64 {
    i64::try_from(time.0).unwrap_or(i64::MAX)
}

/// Seconds from `then` to `now`.
pub fn seconds_since(now: Time, then: Time) -> f64 {
    now.since(then).as_secs_f64()
}
