//! From the wanted tool force to joint torques and a motion of the base.

use super::base::Twist2;
use super::handover::TORQUE_SLEW;
use super::identification::ArmScales;
use super::impedance::{ENGAGE, FADE};
use super::parameters::{COULOMB, FRICTION_SLOPE, JOINTS, TORQUE_LIMIT, WORKING_POSE_DEG};
use super::plant::joint_ranges;
use super::rigid_body::{ArmModel, J5, Jacobian, radians};
use super::tool_space::ToolSpace;
use nalgebra::{SMatrix, Vector3};

/// Tool velocity in the world per base twist (in the base's frame) and joint speed: 3×8.
pub type Jacobian8 = SMatrix<f64, 3, 8>;

/// Parameters of the law.
#[derive(Debug, Clone, Copy)]
pub struct DynamicsParameters {
    /// How the base yields to the tool force: (m/s)/N, (m/s)/N, (rad/s)/(N m). All zero: five degrees of freedom.
    pub force_gain: Vector3<f64>,
    /// Share of gravity that is compensated.
    pub gravity_gain: f64,
    /// Share of Coulomb friction that is compensated, where the joint turns and where the wanted force pulls it.
    pub friction_comp: f64,
    /// How much of that a joint at rest has: the hyperbolic tangent of this times the pull of the wanted force beside its friction. 0: none.
    pub stiction_comp: f64,
    /// Pull to the nominal posture where it does not move the tool, in N m/rad.
    pub posture_stiffness: f64,
    /// Its damping, in N m s/rad.
    pub posture_damping: f64,
    /// How fast the base moves to keep the tool in front of it, in 1/s.
    pub recenter_gain: f64,
    /// Where the tool is wanted, in the arm's base frame, in m.
    pub r_nominal: [f64; 2],
    /// Spring beyond 95 % of a joint's range, in N m/rad.
    pub soft_limit_k: f64,
    /// The nominal posture, in rad.
    pub posture: J5,
    /// Largest torques, in N m.
    pub tau_max: J5,
}

impl Default for DynamicsParameters {
    fn default() -> Self {
        Self {
            force_gain: Vector3::zeros(),
            gravity_gain: 1.0,
            friction_comp: 0.9,
            stiction_comp: 1.25,
            posture_stiffness: 8.0,
            posture_damping: 3.0,
            recenter_gain: 5.0,
            r_nominal: [0.26, 0.0],
            soft_limit_k: 80.0,
            posture: radians(WORKING_POSE_DEG),
            tau_max: J5::from(TORQUE_LIMIT),
        }
    }
}

impl DynamicsParameters {
    /// Whether the base gives way to the tool force: eight degrees of freedom.
    pub fn yields(&self) -> bool {
        self.force_gain.iter().any(|gain| *gain > 0.0)
    }
}

/// Share of a joint's range within which the soft limits are silent.
const WORKING_RANGE: f64 = 0.95;

/// Speed of recentring from which the arm's counter-motion is helped with all of the friction compensation, in m/s.
const COUNTER_SPEED: f64 = 0.01;
/// How the recentring sets out once the base yields, in m/s²: a base that went off at once for what is centimetres off would drive
/// the arm's joints faster than a push does, with nobody touching anything.
const SETTING_OUT: f64 = 0.4;
/// Joints slower than that stick, in rad/s.
const STILL: f64 = 1e-3;
/// A base that is slower than that stands, in m/s and rad/s. Two bases that go by fits and starts, since what pulls them is next to nothing, do not.
const STANDS: f64 = 1e-4;
/// Joints that are faster than that are moved by somebody, in rad/s.
const LED: f64 = 0.01;
/// For how long a base goes on that carries an arm along whose joints stick, in s.
const CARRIED: f64 = 1.0;
/// Joint speed by which the counter-motion may be wrong before all of the friction compensation corrects it, in rad/s.
const COUNTER_SLOPE: f64 = 0.03;

/// The law with its memory.
#[derive(Debug, Clone)]
pub struct Dynamics {
    /// The arm as the controller believes it to be.
    pub model: ArmModel,
    /// Its friction, as a multiple of the nominal one.
    pub friction: f64,
    /// Its parameters.
    pub parameters: DynamicsParameters,
    /// Torque of the coupling (force and posture), in N m: whoever stops asking for it suddenly, it goes along a ramp.
    coupling: J5,
    /// Torque of the wanted force alone, in N m, along the same ramp: what the friction compensation looks at where a joint sticks.
    pull: J5,
    /// How far the base yields because the other one does, 0 to 1.
    mutual: f64,
    /// For how long the base has yielded, in s.
    yielding: f64,
    /// For how long it has carried an arm along that sticks, in s.
    carried: f64,
}

/// What the coupling wants of the law.
#[derive(Debug, Clone, Copy)]
pub struct Coupled {
    /// On the tool, in the world, in N.
    pub force: Vector3<f64>,
    /// How much of the coupling is in force, 0 to 1: that much of the posture control and of the base's motion.
    pub engaged: f64,
    /// The other robot's base yields too. One base that yields to an arm that cannot follow it runs away from the hand: eight
    /// degrees of freedom are those of both robots.
    pub peer_yields: bool,
}

/// What the law answers.
#[derive(Debug, Clone, Copy)]
pub struct DynamicsOutput {
    /// In N m, within `tau_max`.
    pub torque: J5,
    /// For the base, in its frame.
    pub twist: Twist2,
    /// Bit `i`: joint `i + 1` is at its limit.
    pub saturated: u8,
}

/// Torques of the springs beyond 95 % of each joint's range, in N m.
pub fn soft_limits(q: &J5, stiffness: f64) -> J5 {
    let (lower, upper) = joint_ranges();
    let mut out = J5::zeros();
    for i in 0..JOINTS {
        let (middle, half) = (0.5 * (lower[i] + upper[i]), 0.5 * (upper[i] - lower[i]) * WORKING_RANGE);
        let off = q[i] - middle;
        out[i] = -stiffness * (off - off.clamp(-half, half));
    }
    out
}

impl Dynamics {
    /// A law for an arm.
    pub fn new(model: ArmModel) -> Self {
        let (coupling, pull) = (J5::zeros(), J5::zeros());
        Self {
            model,
            friction: 1.0,
            parameters: DynamicsParameters::default(),
            coupling,
            pull,
            mutual: 0.0,
            yielding: 0.0,
            carried: 0.0,
        }
    }

    /// From now on it is believed to be so, and to carry `payload` kg.
    pub fn believe(&mut self, arm: ArmScales, payload: f64) {
        self.model = ArmModel::youbot(payload, arm.mass);
        self.friction = arm.friction;
    }

    /// Coulomb friction of a joint, in N m.
    fn coulomb(&self, i: usize) -> f64 {
        COULOMB[i] * self.friction
    }

    /// One step of `dt` seconds. `moves`: how the base does, in its frame. `coupled`: what the coupling wants; none: nothing, or
    /// it is not known any more, and only gravity and friction are compensated.
    pub fn update(
        &mut self,
        q: &J5,
        qd: &J5,
        jacobian: &Jacobian8,
        moves: Twist2,
        coupled: Option<&Coupled>,
        dt: f64,
    ) -> DynamicsOutput {
        let p = &self.parameters;
        let at = self.model.posture(q);
        let mutual = coupled.is_some_and(|coupled| coupled.peer_yields);
        let mut torque = self.model.gravity(&at) * p.gravity_gain + soft_limits(q, p.soft_limit_k);
        let most = TORQUE_SLEW * dt;
        let arm: Jacobian = jacobian.fixed_columns::<JOINTS>(3).into_owned();
        let coupled = coupled.filter(|coupled| coupled.engaged > 0.0);
        let pull = coupled.map_or_else(J5::zeros, |coupled| arm.tr_mul(&coupled.force));
        self.pull += (pull - self.pull).map(|step| step.clamp(-most, most));
        for i in 0..JOINTS {
            // Who is pulled is helped out of sticking, too, by what the pull is beside the joint's friction. That puts no energy into
            // the arm, whatever the delay: the compensation never is more than the friction that takes it.
            let along = qd[i] / FRICTION_SLOPE + p.stiction_comp * self.pull[i] / self.coulomb(i);
            torque[i] += p.friction_comp * self.coulomb(i) * along.tanh();
        }
        let (mut twist, mut coupling) = (Twist2::default(), J5::zeros());
        self.mutual = (self.mutual + if mutual { dt / ENGAGE } else { -dt / FADE }).clamp(0.0, 1.0);
        let yields = p.yields() && self.mutual > 0.0 && coupled.is_some();
        self.yielding = if yields { self.yielding + dt } else { 0.0 };
        self.carried = match qd.amax() {
            led if led > LED => 0.0,
            still if still < STILL && moves.vx.hypot(moves.vy).max(moves.wz.abs()) > STANDS => self.carried + dt,
            _ => self.carried,
        };
        // What sticks is not where the tool is wanted and does not come nearer: the base would drive on for ever, with nobody
        // touching anything. It waits until somebody moves the arm.
        let yields = yields && self.carried < CARRIED;
        if let Some(Coupled { force, engaged, .. }) = coupled {
            coupling = pull;
            let tool = ToolSpace::of(&self.model, &at, &arm);
            if let Some(tool) = &tool {
                coupling += self.posture_torque(tool, q, qd) * *engaged;
            }
            if yields {
                let base = jacobian.fixed_columns::<3>(0).into_owned();
                let wrench = base.tr_mul(force) * self.mutual;
                let off = Vector3::new(at.tool.x - p.r_nominal[0], at.tool.y - p.r_nominal[1], 0.0);
                let home = off * (p.recenter_gain * engaged * self.mutual);
                let home = home.cap_magnitude(SETTING_OUT * self.yielding);
                let mut wanted = p.force_gain.component_mul(&wrench) + home;
                if let Some(tool) = &tool {
                    let speed = arm * qd + base * Vector3::new(moves.vx, moves.vy, moves.wz);
                    wanted *= tool.share_followed(&(base * wanted), &speed);
                    coupling += self.counter_torque(tool, &(base * home), qd) * *engaged;
                }
                twist = Twist2 { vx: wanted.x, vy: wanted.y, wz: wanted.z };
            }
        }
        self.coupling += (coupling - self.coupling).map(|step| step.clamp(-most, most));
        torque += self.coupling;
        let mut saturated = 0;
        for i in 0..JOINTS {
            let most = p.tau_max[i];
            if torque[i].abs() >= most {
                saturated |= 1 << i;
                torque[i] = torque[i].clamp(-most, most);
            }
        }
        DynamicsOutput { torque, twist, saturated }
    }

    /// Torque towards the nominal posture, in the null space of the tool's position.
    fn posture_torque(&self, tool: &ToolSpace, q: &J5, qd: &J5) -> J5 {
        let p = &self.parameters;
        let wish = (p.posture - q) * p.posture_stiffness - qd * p.posture_damping;
        wish - tool.arm.tr_mul(&tool.inertia.solve(&(tool.arm * tool.mass.solve(&wish))))
    }

    /// Torque that lets the tool stay behind while the base goes `home` (m/s, in the world): without it the arm's friction
    /// carries the tool along, the base never gets there, and drives on with nobody touching anything. It is friction
    /// compensation, about the joint speeds that leave the tool where it is.
    fn counter_torque(&self, tool: &ToolSpace, home: &Vector3<f64>, qd: &J5) -> J5 {
        let speeds = -tool.joints(home);
        let share = self.parameters.friction_comp * (home.norm() / COUNTER_SPEED).min(1.0);
        J5::from_fn(|i, _| share * self.coulomb(i) * ((speeds[i] - qd[i]) / COUNTER_SLOPE).tanh())
    }

    /// Forgets the past.
    pub fn reset(&mut self) {
        (self.coupling, self.pull) = (J5::zeros(), J5::zeros());
        self.mutual = 0.0;
        (self.yielding, self.carried) = (0.0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::kinematics::Tool;
    use super::super::tool_space::LEFT_BEHIND;
    use super::*;

    const AT_REST: Twist2 = Twist2 { vx: 0.0, vy: 0.0, wz: 0.0 };

    #[test]
    fn the_posture_does_not_push_the_tool() {
        let model = ArmModel::youbot(0.219, 1.0);
        let law = Dynamics::new(model.clone());
        let q = radians([10.0, -20.0, 90.0, 50.0, 20.0]);
        let at = model.posture(&q);
        let arm = at.jacobian();
        let torque = law.posture_torque(&ToolSpace::of(&model, &at, &arm).unwrap(), &q, &J5::zeros());
        assert!(torque.norm() > 0.1);
        let acc = arm * model.mass_matrix_with_drives(&at).cholesky().unwrap().solve(&torque);
        assert!(acc.norm() < 0.01, "{acc}");
    }

    #[test]
    fn uncoupled_it_compensates_gravity_and_nothing_else() {
        let model = ArmModel::youbot(0.219, 1.0);
        let mut law = Dynamics::new(model.clone());
        law.parameters.force_gain = Vector3::new(0.1, 0.1, 0.1);
        let q = radians([0.0, -30.0, 100.0, 60.0, 0.0]);
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        let pull = Coupled { force: Vector3::new(2.0, 0.0, 0.0), engaged: 1.0, peer_yields: true };
        for coupled in [None, Some(Coupled { engaged: 0.0, ..pull })] {
            let out = law.update(&q, &J5::zeros(), &tool.jacobian(), AT_REST, coupled.as_ref(), 0.001);
            assert_eq!(out.torque, model.gravity(&model.posture(&q)));
            assert_eq!(out.twist, Twist2::default());
        }
        law.parameters.r_nominal = [at_tool(&model, &q).x, at_tool(&model, &q).y];
        let along = Twist2 { vx: 0.3, ..AT_REST };
        let mut moves = |peer_yields: bool| {
            let pull = Coupled { peer_yields, ..pull };
            let update = |_| law.update(&q, &J5::zeros(), &tool.jacobian(), along, Some(&pull), 0.001).twist;
            (0..301).map(update).last().expect("updates")
        };
        assert_eq!(moves(false), Twist2::default(), "the other base stands");
        assert!((moves(true).vx - 0.2).abs() < 2e-3, "{:?}", moves(true));
        assert_eq!(moves(false), Twist2::default());
    }

    #[test]
    fn what_an_arm_carries_is_not_scaled_with_it() {
        let mut law = Dynamics::new(ArmModel::youbot(0.219, 1.0));
        let q = radians([0.0, -30.0, 100.0, 60.0, 0.0]);
        let mut gravity = |mass: f64, payload: f64| {
            law.believe(ArmScales { mass, friction: 1.0 }, payload);
            law.model.gravity(&law.model.posture(&q))
        };
        let (alone, loaded) = (gravity(1.0, 0.0), gravity(1.0, 0.5));
        assert!((loaded - alone).norm() > 0.5);
        assert!((gravity(1.1, 0.5) - (alone * 1.1 + (loaded - alone))).norm() < 1e-12);
    }

    #[test]
    fn the_base_sets_out_gently_for_a_tool_that_is_off_its_place() {
        let model = ArmModel::youbot(0.219, 1.0);
        let mut law = Dynamics::new(model.clone());
        law.parameters.force_gain = Vector3::new(0.1, 0.1, 0.1);
        let q = radians([0.0, -50.0, -70.0, -60.0, 0.0]);
        let off = at_tool(&model, &q) - Vector3::new(law.parameters.r_nominal[0], law.parameters.r_nominal[1], 0.0);
        let off = off.xy();
        assert!(off.norm() > 0.03, "{off}");
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        let rest = Coupled { force: Vector3::zeros(), engaged: 1.0, peer_yields: true };
        // The tool goes ahead of it.
        let ahead = Twist2 { vx: off.x * 20.0, vy: off.y * 20.0, wz: 0.0 };
        let led = J5::from([0.0, 0.0, 0.0, 0.0, 2.0 * LED]);
        let mut last = 0.0;
        for tick in 1..=6000 {
            let twist = law.update(&q, &led, &tool.jacobian(), ahead, Some(&rest), 0.001).twist;
            let speed = twist.vx.hypot(twist.vy);
            let most = SETTING_OUT * f64::from(tick) * 0.001;
            assert!(speed <= most + 1e-9 && speed >= last - 1e-9, "{speed} after {tick} ms");
            last = speed;
        }
        assert!((last - law.parameters.recenter_gain * off.norm()).abs() < 1e-6, "in the end all of it: {last}");
        // Once more from where it is.
        law.update(&q, &J5::zeros(), &tool.jacobian(), ahead, None, 1.0);
        let again = law.update(&q, &led, &tool.jacobian(), ahead, Some(&rest), 0.001).twist;
        assert!(again.vx.hypot(again.vy) < 1e-3, "{again:?}");
    }

    #[test]
    fn a_base_that_carries_an_arm_along_that_sticks_waits_until_somebody_moves_it() {
        let model = ArmModel::youbot(0.219, 1.0);
        let mut law = Dynamics::new(model.clone());
        law.parameters.force_gain = Vector3::new(0.1, 0.1, 0.1);
        let q = radians([0.0, -40.0, 100.0, 60.0, 0.0]);
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        let pull = Coupled { force: Vector3::new(0.3, 0.0, 0.0), engaged: 1.0, peer_yields: true };
        let mut after = |seconds: f64, speed: f64, moves: Twist2| {
            let update = |_| law.update(&q, &J5::repeat(speed), &tool.jacobian(), moves, Some(&pull), 0.001).twist;
            (0..(seconds * 1e3) as usize).map(update).last().expect("updates")
        };
        let along = Twist2 { vx: 0.02, ..AT_REST };
        assert_ne!(after(0.9, 0.0, along), AT_REST);
        assert_eq!(after(0.2, 0.0, along), AT_REST, "nobody moves the arm");
        assert_eq!(after(5.0, 0.0, AT_REST), AT_REST);
        assert_ne!(after(0.1, 0.02, AT_REST), AT_REST, "somebody does");
        assert_ne!(after(5.0, 0.0, AT_REST), AT_REST, "it has not set out yet");
        assert_ne!(after(5.0, 0.02, along), AT_REST, "it follows");
    }

    #[test]
    fn the_base_is_never_faster_than_the_joints_can_make_up_for() {
        let model = ArmModel::youbot(0.219, 1.0);
        let mut law = Dynamics::new(model.clone());
        law.parameters.force_gain = Vector3::new(0.1, 0.1, 0.1);
        // Arms as five degrees of freedom leave them, and forces as before it lets go.
        let cases = [
            ([0.0, -44.0, 100.0, 74.0, 0.0], [-1.0, 0.0, 0.5]),
            ([20.0, -30.0, 100.0, 60.0, 0.0], [4.0, -4.0, 0.0]),
            ([-30.0, 10.0, 80.0, 70.0, 10.0], [0.0, 8.0, -2.0]),
        ];
        for (q, force) in cases {
            let q = radians(q);
            let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
            let base = tool.jacobian().fixed_columns::<3>(0).into_owned();
            let space =
                ToolSpace::of(&model, &model.posture(&q), &tool.jacobian().fixed_columns::<JOINTS>(3).into_owned())
                    .unwrap();
            let pull = Coupled { force: Vector3::from(force), engaged: 1.0, peer_yields: true };
            let mut after = |moves: Twist2| {
                law.reset();
                let update = |_| law.update(&q, &J5::zeros(), &tool.jacobian(), moves, Some(&pull), 0.001).twist;
                (0..900).map(update).last().expect("updates")
            };
            let asked = |wanted: Twist2| space.joints(&(base * Vector3::new(wanted.vx, wanted.vy, wanted.wz))).amax();
            let stands = after(AT_REST);
            assert!((asked(stands) - LEFT_BEHIND).abs() < 1e-3, "{stands:?} asks for {} rad/s", asked(stands));
            // Carried along it may be as fast as it was meant to be, and in the same direction.
            let carried = after(Twist2 { vx: stands.vx * 20.0, vy: stands.vy * 20.0, wz: stands.wz * 20.0 });
            assert!(asked(carried) > 1.5 * LEFT_BEHIND, "{carried:?}");
            assert!((carried.vx * stands.vy - carried.vy * stands.vx).abs() < 1e-9);
        }
    }

    fn at_tool(model: &ArmModel, q: &J5) -> Vector3<f64> {
        model.posture(q).tool
    }

    #[test]
    fn what_coupled_and_died_is_let_go_of_along_a_ramp() {
        let model = ArmModel::youbot(0.219, 1.0);
        let mut law = Dynamics::new(model.clone());
        let q = radians([20.0, -10.0, 80.0, 50.0, 10.0]);
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        let alone = model.gravity(&model.posture(&q));
        let pull = Coupled { force: Vector3::new(6.0, -8.0, 0.0), engaged: 1.0, peer_yields: true };
        let (mut last, mut most) = (alone, 0.0_f64);
        for tick in 0..400 {
            let coupled = (tick < 200).then_some(&pull);
            let out = law.update(&q, &J5::zeros(), &tool.jacobian(), AT_REST, coupled, 0.001);
            // The force's own, and the friction compensation's for its sake.
            let bound = 0.2 * (1.0 + law.parameters.friction_comp * law.parameters.stiction_comp);
            assert!((out.torque - last).amax() <= bound + 1e-9, "{last} {}", out.torque);
            last = out.torque;
            most = most.max((last - alone).amax());
        }
        assert!(most > 1.5 && last == alone, "{most} {last}");
    }

    #[test]
    fn who_is_pulled_is_helped_out_of_sticking_by_less_than_the_friction() {
        let model = ArmModel::youbot(0.219, 1.0);
        let q = radians([0.0, -30.0, 100.0, 60.0, 0.0]);
        let tool = Tool::of(&model, &q, &J5::zeros(), Default::default(), Default::default());
        let arm: Jacobian = tool.jacobian().fixed_columns::<JOINTS>(3).into_owned();
        let carried = model.gravity(&model.posture(&q)) + soft_limits(&q, 80.0);
        for (force, qd) in [(1.0, 0.0), (8.0, 0.0), (8.0, 1.0), (8.0, -1.0), (-8.0, 0.02)] {
            let (pull, qd) = (Vector3::new(force, -0.5 * force, 0.3 * force), J5::repeat(qd));
            let mut law = Dynamics::new(model.clone());
            (law.parameters.posture_stiffness, law.parameters.posture_damping) = (0.0, 0.0);
            let coupled = Coupled { force: pull, engaged: 1.0, peer_yields: true };
            let update = |_| law.update(&q, &qd, &tool.jacobian(), AT_REST, Some(&coupled), 0.001).torque;
            let torque = (0..200).map(update).last().expect("updates");
            let (own, share) = (arm.tr_mul(&pull), law.parameters.friction_comp);
            let steep = law.parameters.stiction_comp;
            let help = torque - carried - own;
            for i in 0..JOINTS {
                assert!(help[i].abs() <= share * COULOMB[i] + 1e-9, "{help}");
                if qd[i] == 0.0 {
                    let most = share * COULOMB[i];
                    assert!(
                        (help[i] - most * (steep * own[i] / COULOMB[i]).tanh()).abs() < 1e-9,
                        "along the pull: {help} {own}"
                    );
                }
            }
        }
    }
}
