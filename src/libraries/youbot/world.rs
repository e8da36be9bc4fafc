//! What there is of a robot when its software is taken away: arm and base, and what the tool touches.

use super::base::Twist2;
use super::kinematics::Tool;
use super::parameters::GRIPPER;
use super::plant::{ArmPlant, BasePlant};
use super::rigid_body::{ArmModel, J5, Posture};
use nalgebra::Vector3;

/// Integration step, in s.
pub const PLANT_STEP: f64 = 0.0005;
/// Steps taken at once at most: a world that is called late loses time, it does not make up for it.
const STEPS_AT_ONCE: f64 = 100.0;

/// A bar across the world's x axis, on rails along it: what one tool pushes, a tool on its other side feels.
#[derive(Debug, Clone, Copy)]
pub struct Bar {
    /// Where its middle is, in m.
    pub at: f64,
    /// In m/s.
    pub speed: f64,
    /// In kg.
    pub mass: f64,
    /// Of the rails, in N s/m.
    pub damping: f64,
}

/// Half of a bar's thickness, in m: more than any tool is pressed into it.
pub const BAR_HALF: f64 = 0.02;

impl Bar {
    /// How far a tool is inside of it, in m, and which way that is out of it (-1 or 1).
    fn penetration(&self, x: f64) -> (f64, f64) {
        match x < self.at {
            true => (x - (self.at - BAR_HALF), -1.0),
            false => (self.at + BAR_HALF - x, 1.0),
        }
    }

    /// Moves on by `dt` seconds under what the tools do to it, in N.
    pub fn step(&mut self, push: f64, dt: f64) {
        self.speed = (self.speed + push / self.mass * dt) / (1.0 + self.damping / self.mass * dt);
        self.at += self.speed * dt;
    }
}

/// A table, a wall and a bar, which the tool point touches without friction.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings {
    /// Height of the table, in m.
    pub table: f64,
    /// Where the wall stands, across the world's x axis, in m; it is behind that.
    pub wall: f64,
    /// The bar; none: there is none within reach.
    pub bar: Option<Bar>,
    /// Of all, in N/m.
    pub stiffness: f64,
    /// Of all, in N s/m.
    pub damping: f64,
}

/// Where nothing is touched: out of reach.
pub const FAR: f64 = 100.0;

impl Default for Surroundings {
    fn default() -> Self {
        Self { table: -FAR, wall: FAR, bar: None, stiffness: 10_000.0, damping: 100.0 }
    }
}

impl Surroundings {
    /// How far a tool is inside of the table and of the wall, in m; not positive: it does not touch it.
    pub fn penetration(&self, position: &Vector3<f64>) -> [f64; 2] {
        [self.table - position.z, position.x - self.wall]
    }

    /// What a tool is pressed out with that is so far inside and goes in so fast, in N.
    fn press(&self, inside: f64, speed: f64) -> f64 {
        match inside > 0.0 {
            // Nothing sticks.
            true => (self.stiffness * inside + self.damping * speed).max(0.0),
            false => 0.0,
        }
    }

    /// What table and wall do to a tool, in N.
    pub fn force(&self, position: &Vector3<f64>, velocity: &Vector3<f64>) -> Vector3<f64> {
        let inside = self.penetration(position);
        Vector3::new(-self.press(inside[1], velocity.x), 0.0, self.press(inside[0], -velocity.z))
    }

    /// What the bar does to a tool along the x axis, in N.
    pub fn bar_force(&self, position: &Vector3<f64>, velocity: &Vector3<f64>) -> f64 {
        self.bar.map_or(0.0, |bar| {
            let (inside, out) = bar.penetration(position.x);
            out * self.press(inside, out * (bar.speed - velocity.x))
        })
    }
}

/// A robot's body, and what its tool touches.
#[derive(Debug, Clone)]
pub struct RobotBody {
    /// The arm.
    pub arm: ArmPlant,
    /// The base.
    pub base: BasePlant,
    /// What the tool may touch.
    pub surroundings: Surroundings,
    /// What it does to the tool, in N.
    pub contact: Vector3<f64>,
    /// What the tool did to the bar along the x axis, over the steps taken at once, in N.
    pub on_bar: f64,
    /// Time constant with which the motors' torques follow what is wanted, in s; 0: at once.
    pub torque_lag: f64,
    /// What the motors give now, in N m.
    given: J5,
    seen: SeenRobot,
}

/// Where the parts of a robot are, with what it was worked out from: a step, whoever looks at what came of it, and the next step ask for
/// the same.
#[derive(Debug, Clone)]
struct SeenRobot {
    q: J5,
    qd: J5,
    base: BasePlant,
    at: Posture,
    tool: Tool,
}

impl SeenRobot {
    fn of(arm: &ArmPlant, base: &BasePlant) -> Self {
        let at = arm.posture();
        let tool = Tool::at(&arm.model, &at, &arm.qd, base.pose, base.twist);
        Self { q: arm.q, qd: arm.qd, base: *base, at, tool }
    }

    fn is_of(&self, arm: &ArmPlant, base: &BasePlant) -> bool {
        self.q == arm.q && self.qd == arm.qd && self.base == *base
    }
}

impl RobotBody {
    /// At rest with its joints at `q`; masses as multiples of the nominal ones.
    pub fn new(q: J5, mass_scale: f64) -> Self {
        let (arm, base) = (ArmPlant::new(ArmModel::youbot(GRIPPER.mass, mass_scale), q), BasePlant::default());
        Self {
            seen: SeenRobot::of(&arm, &base),
            arm,
            base,
            surroundings: Surroundings::default(),
            contact: Vector3::zeros(),
            on_bar: 0.0,
            torque_lag: 0.0,
            given: J5::zeros(),
        }
    }

    /// From now on the masses of its arm are this multiple of the nominal ones, a robot as it may be, and at its tool are `payload` kg, the gripper
    /// included: more, when it takes something up.
    pub fn weigh(&mut self, mass_scale: f64, payload: f64) {
        self.arm.model = ArmModel::youbot(payload, mass_scale);
    }

    /// Where the tool is in the world, and how it moves.
    pub fn tool(&self) -> Tool {
        match self.seen.is_of(&self.arm, &self.base) {
            true => self.seen.tool,
            false => SeenRobot::of(&self.arm, &self.base).tool,
        }
    }

    fn look(&mut self) {
        if !self.seen.is_of(&self.arm, &self.base) {
            self.seen = SeenRobot::of(&self.arm, &self.base);
        }
    }

    /// What the motors give now, in N m.
    pub fn given(&self) -> &J5 {
        &self.given
    }

    /// Moves on by `dt` seconds, in steps of [`PLANT_STEP`]. `push` is a hand's force on the tool in the world, `braked`: the
    /// windings are shorted.
    pub fn advance(&mut self, torque: &J5, twist: Twist2, push: &Vector3<f64>, braked: bool, dt: f64) {
        let steps = (dt / PLANT_STEP).round().clamp(1.0, STEPS_AT_ONCE);
        let step = (dt / steps).min(2.0 * PLANT_STEP);
        let mut done = 0.0;
        self.on_bar = 0.0;
        while done < steps {
            self.look();
            let tool = &self.seen.tool;
            self.contact = self.surroundings.force(&tool.position, &tool.velocity);
            let bar = self.surroundings.bar_force(&tool.position, &tool.velocity);
            self.contact.x += bar;
            self.on_bar -= bar / steps;
            let force = tool.turn.inverse() * (push + self.contact);
            let motion = self.base.step(twist, step);
            // Shorted windings have no torque of the drives' to follow.
            let follows = if braked || self.torque_lag <= 0.0 { 1.0 } else { 1.0 - (-step / self.torque_lag).exp() };
            self.given += (torque - self.given) * follows;
            self.arm.step(&self.seen.at, &self.given, &force, &motion, braked, step);
            done += 1.0;
        }
        self.look();
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::WORKING_POSE_DEG;
    use super::super::rigid_body::radians;
    use super::*;

    #[test]
    fn a_wall_holds_a_pushed_tool_and_lets_it_go() {
        let mut body = RobotBody::new(radians(WORKING_POSE_DEG), 1.0);
        body.surroundings.wall = body.tool().position.x + 0.01;
        let pushed = |body: &mut RobotBody, push: f64| {
            for _ in 0..2000 {
                let torque = body.arm.model.gravity(&body.arm.posture());
                body.advance(&torque, Twist2::default(), &Vector3::new(push, 0.0, 0.0), false, PLANT_STEP);
            }
            body.surroundings.penetration(&body.tool().position)[1]
        };
        let inside = pushed(&mut body, 30.0);
        // Friction carries part of it, for the push or against it.
        assert!(
            inside > 0.002 && inside < 0.004 && (-40.0..-20.0).contains(&body.contact.x),
            "{inside} {}",
            body.contact
        );
        assert!(pushed(&mut body, -30.0) < -0.01 && body.contact == Vector3::zeros());
    }

    #[test]
    fn what_one_tool_pushes_the_other_one_feels() {
        let mut bodies = [0, 1].map(|_| RobotBody::new(radians(WORKING_POSE_DEG), 1.0));
        let (from, places) = (bodies[0].tool().position.x, [0.0, 0.06]);
        let mut bar = Bar { at: from + 0.03, speed: 0.0, mass: 1.0, damping: 2.0 };
        let mut most = 0.0_f64;
        for _ in 0..2000 {
            let push = [30.0, 0.0].map(|push| Vector3::new(push, 0.0, 0.0));
            for ((body, push), place) in bodies.iter_mut().zip(&push).zip(places) {
                body.surroundings.bar = Some(Bar { at: bar.at - place, ..bar });
                let torque = body.arm.model.gravity(&body.arm.posture());
                body.advance(&torque, Twist2::default(), push, false, PLANT_STEP);
            }
            bar.step(bodies.iter().map(|body| body.on_bar).sum(), PLANT_STEP);
            most = most.max(bodies[1].contact.x);
        }
        let moved = bodies.each_ref().map(|body| body.tool().position.x - from);
        // One on each side of it, all three together, and nothing is felt across a gap.
        assert!(moved[1] > 0.05 && most > 3.0, "{moved:?} {most}");
        assert!((moved[0] - moved[1] - 0.02).abs() < 0.005 && moved[0] < bar.at - from, "{moved:?} {bar:?}");
    }

    #[test]
    fn who_is_put_elsewhere_is_seen_there() {
        let mut put = RobotBody::new(radians(WORKING_POSE_DEG), 1.0);
        put.arm.q[1] += 0.3;
        let mut there = RobotBody::new(put.arm.q, 1.0);
        for at in [0.0, 1.0] {
            for body in [&mut put, &mut there] {
                body.base.pose.x = at;
                body.surroundings.table = 0.3;
                body.advance(&J5::zeros(), Twist2::default(), &Vector3::zeros(), false, PLANT_STEP);
            }
            assert_eq!(
                (put.arm.q, put.contact, put.tool().position),
                (there.arm.q, there.contact, there.tool().position)
            );
            assert!((there.tool().position.x - at).abs() < 0.6 && there.contact.z > 0.0, "{}", there.contact);
        }
        put.arm.q[0] += 1.0;
        assert!(put.tool().position.y < -0.1, "{}", put.tool().position);
    }

    #[test]
    fn torques_follow_with_a_lag() {
        let mut body = RobotBody::new(radians(WORKING_POSE_DEG), 1.0);
        body.torque_lag = 0.002;
        body.advance(&J5::repeat(1.0), Twist2::default(), &Vector3::zeros(), false, 0.002);
        assert!((body.given[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "{}", body.given);
    }

    #[test]
    fn nothing_is_touched_that_is_not_there() {
        let nothing = Surroundings::default();
        assert_eq!(nothing.force(&Vector3::new(0.5, 0.0, -0.1), &Vector3::zeros()), Vector3::zeros());
        let table = Surroundings { table: 0.1, ..nothing };
        assert_eq!(table.force(&Vector3::new(0.5, 0.0, 0.099), &Vector3::zeros()).z.round(), 10.0);
        assert_eq!(table.force(&Vector3::new(0.5, 0.0, 0.099), &Vector3::new(0.0, 0.0, 1.0)).z, 0.0);
    }
}
