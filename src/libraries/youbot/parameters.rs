//! The numbers of the youBot, each with where it comes from. Data only; the laws are in the neighbouring files.
//!
//! # The one convention
//!
//! *Candle zero, URDF axes*: all joint angles are 0 when the arm stands straight up; then every link frame has the
//! orientation of the arm's base frame, `z` along the arm. Joints turn about the axes of the URDF, in their positive
//! sense: joint 1 and 5 about `-z`, joints 2, 3 and 4 about `+y` (a positive angle bends the arm forward).
//! The driver's own zero (folded, encoders at their stops) is candle zero plus [`CANDLE_OFFSET`]. The KU Leuven driver
//! counts joints 2 and 3 the other way; its numbers are converted here and nowhere else.
//!
//! # Sources
//!
//! | id | source |
//! |---|---|
//! | U | youbot/youbot-ros-pkg, `youbot_description` (URDF), commit 432570ac7efc |
//! | Dv | youbot/youbot_driver, configuration files, commit 814989dc4337 |
//! | L | keiserb/youbot_driver_rtt (KU Leuven driver), commit defc9906e428 |
//! | R | uzh-rpg/rpg_youbot_torque_control, table of the youBot store, commit 7e6ebe4e6074 |
//! | T | t-thanh/youbot-stack (Univ. Twente), commit b63b8996ba23 |
//! | H | LUHbots/luh_youbot_os (Hannover), identified values, commit d1479e9f0682 |
//! | M | from memory, not verified; D: derived from the others |

/// Joints of the arm.
pub const JOINTS: usize = 5;

/// Joint origin in the previous frame, in m (R; the URDF agrees up to joint 4).
pub const JOINT_ORIGIN: [[f64; 3]; JOINTS] =
    [[0.024, 0.0, 0.115], [0.033, 0.0, 0.0], [0.0, 0.0, 0.155], [0.0, 0.0, 0.135], [0.0, 0.0, 0.1136]];

/// Joint axis in its own frame (U).
pub const JOINT_AXIS: [[f64; 3]; JOINTS] =
    [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]];

/// Lower ends of the joint ranges, in degrees (U, counted from candle).
pub const RANGE_LOWER_DEG: [f64; JOINTS] = [-169.0, -65.0, -151.0, -102.5, -167.5];

/// Upper ends of the joint ranges, in degrees (U, counted from candle).
pub const RANGE_UPPER_DEG: [f64; JOINTS] = [169.0, 90.0, 146.0, 102.5, 167.5];

/// From the frame of joint 5 to the gripper's centre of mass, which is the tool point, in m (R: 0.05716 + 0.0289).
pub const TOOL_OFFSET: [f64; 3] = [0.0, 0.0, 0.05716 + 0.0289];

/// The arm's base frame in the mobile base's, in m (U puts it at z = 0.046 of its plate; 0.13 above the wheel axes).
pub const BASE_MOUNT: [f64; 3] = [0.143, 0.0, 0.13];

/// One rigid link.
#[derive(Debug, Clone, Copy)]
pub struct ArmLink {
    /// Mass, in kg.
    pub mass: f64,
    /// Centre of mass in the joint's frame, in m.
    pub com: [f64; 3],
    /// Principal moments of inertia at the centre of mass, along the frame's axes, in kg m².
    pub inertia: [f64; 3],
}

/// Links 1 to 5 (R). The store lists inertia along its own axes; for links 2 and 3, which are long in `z`, the smallest
/// moment is assigned to `z` (D). The sign of link 5's `z` is doubtful: the URDF has -0.01683, which
/// would lie behind the joint; taking it instead lowers the gravity torque of joints 2 to 4 by up to 0.22 N m (D).
pub const LINKS: [ArmLink; JOINTS] = [
    ArmLink { mass: 2.351, com: [0.01516, 0.00359, -0.03105], inertia: [0.002_952_5, 0.006_009_1, 0.005_882_1] },
    ArmLink { mass: 1.318, com: [-0.01903, 0.0150, 0.11397], inertia: [0.003_114_5, 0.003_163_1, 0.000_584_3] },
    ArmLink { mass: 0.821, com: [0.00013, 0.02022, 0.10441], inertia: [0.001_727_67, 0.001_846_8, 0.000_419_67] },
    ArmLink { mass: 0.769, com: [0.00015, -0.02464, 0.05353], inertia: [0.000_676_4, 0.001_057_3, 0.000_661_0] },
    ArmLink { mass: 0.687, com: [0.0, 0.0012, 0.01648], inertia: [0.000_193_4, 0.000_160_2, 0.000_068_9] },
];

/// The gripper (R), fixed to link 5 with its centre of mass at [`TOOL_OFFSET`].
pub const GRIPPER: ArmLink =
    ArmLink { mass: 0.219, com: TOOL_OFFSET, inertia: [0.000_232_4, 0.000_362_9, 0.000_206_7] };

/// Gear ratios (Dv, L).
pub const GEAR: [f64; JOINTS] = [156.0, 156.0, 100.0, 71.0, 71.0];

/// Torque constants, in N m/A (Dv, L).
pub const TORQUE_CONSTANT: [f64; JOINTS] = [0.0335, 0.0335, 0.0335, 0.051, 0.049];

/// Counts of the encoders in a turn of the motor (Dv).
pub const ENCODER_TICKS: f64 = 4000.0;

/// Inertia of rotor and gearbox seen at the joint, in kg m² (D from M: `(rotor + gearbox) * gear²`).
pub const REFLECTED_INERTIA: [f64; JOINTS] = [
    (1.35e-5 + 4.09e-7) * 156.0 * 156.0,
    (1.35e-5 + 4.09e-7) * 156.0 * 156.0,
    (1.35e-5 + 7.1e-8) * 100.0 * 100.0,
    (9.25e-6 + 7e-8) * 71.0 * 71.0,
    (3.5e-6 + 7e-8) * 71.0 * 71.0,
];

/// Torque the drives give for half a second, in N m (H). The URDF's 9.5 N m for joint 2 is less than gravity asks of it
/// with the arm stretched out (9.8 N m), so it is not used.
pub const TORQUE_LIMIT: [f64; JOINTS] = [10.0, 13.0, 7.0, 3.0, 1.0];

/// Coulomb friction, in N m (H, middle of its estimates).
pub const COULOMB: [f64; JOINTS] = [1.0, 0.8, 0.6, 0.2, 0.15];

/// Viscous friction, in N m s/rad (H's third term, of which the source states no unit; D).
pub const VISCOUS: [f64; JOINTS] = [1.5, 1.0, 1.0, 0.3, 0.1];

/// Speed at which compensated Coulomb friction is fully developed, in rad/s: `COULOMB * tanh(qd / FRICTION_SLOPE)`.
/// Compensation must be softer than friction is, or it pushes a joint that stands.
pub const FRICTION_SLOPE: f64 = 0.05;

/// Highest joint speed, in rad/s (U).
pub const SPEED_LIMIT: f64 = 1.571;

/// Gravity, in m/s².
pub const GRAVITY: f64 = 9.81;

/// Time constant with which the base follows a commanded twist, in s (assumed; not identified in any source).
pub const BASE_LAG: f64 = 0.1;

/// The pose the coupling works in, in degrees: elbow up, tool in front and low (D: well conditioned).
pub const WORKING_POSE_DEG: [f64; JOINTS] = [0.0, -30.0, 100.0, 60.0, 0.0];

/// The folded pose the arm is parked in, in degrees: half a degree before the stops, on which it then rests.
pub const PARK_POSE_DEG: [f64; JOINTS] = [0.0, -64.5, 145.5, -102.0, 0.0];
