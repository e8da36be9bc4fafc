//! One robot is led in free space, the other one's tool meets a wall and a table of 10 kN/m: approach, hard contact, release.

use crate::coupling::{Side, at_delay, hear, mm};
use davit::libraries::youbot::hand::{Hand, HandScript};
use davit::libraries::youbot::impedance::CouplingLaw;
use davit::libraries::youbot::network::Quality;
use davit::libraries::youbot::passivity::{CouplingEnd, PassivityObserver};
use davit::libraries::youbot::robot::CONTROL_PERIOD;
use nalgebra::Vector3;

/// How far the hand goes on behind where the other tool is stopped, in m, and how far away that is at the beginning.
const BEHIND: f64 = 0.05;
const AWAY: f64 = 0.05;

#[derive(Debug, Default)]
struct Contact {
    /// At the moment of meeting, in m/s.
    speed: f64,
    /// At most, in m.
    penetration: f64,
    /// What the hand feels while it presses, in N, and what the wall or the table does to the other tool.
    reflected: f64,
    pressed: f64,
    /// Times that contact was lost and found again while the hand presses; fastest of the tool in its last half second, in m/s.
    lost: usize,
    restless: f64,
    /// Between the two tools a second after the release, in m.
    after: f64,
    touched_after: bool,
}

/// To the wall (or down to the table) in 2 s, pressed for 3 s, and back.
fn meet(law: CouplingLaw, delay: f64, table: bool) -> Contact {
    let quality = at_delay(delay);
    let mut pair = [Side::new(quality, 1), Side::new(quality, 2)];
    for side in &mut pair {
        let p = &mut side.robot.impedance.parameters;
        (p.law, p.stiffness) = (law, 300.0);
    }
    let start = pair[1].robot.tool.position;
    let way = if table { Vector3::new(0.0, 0.0, -1.0) } else { Vector3::x() };
    let surroundings = &mut pair[1].robot.body.surroundings;
    if table {
        surroundings.table = start.z - AWAY;
    } else {
        surroundings.wall = start.x + AWAY;
    }
    let go = way * (AWAY + BEHIND);
    let script =
        format!("hold 1; go 2 {0} {1} {2}; hold 3; go 2 {3} {4} {5}; hold 2", go.x, go.y, go.z, -go.x, -go.y, -go.z);
    let mut hand = Hand::new(script.replace("-0 ", "0 ").parse::<HandScript>().expect("a script"));
    let mut out = Contact::default();
    let (mut samples, mut touched) = (0.0, false);
    for tick in 0..10_000_u32 {
        let now = f64::from(tick) * CONTROL_PERIOD;
        hear(&mut pair, now);
        let tool = &pair[0].robot.tool;
        let push = hand.update(&tool.position, &tool.velocity, None, CONTROL_PERIOD);
        for (side, push) in pair.iter_mut().zip([push, Vector3::zeros()]) {
            side.step(now, &push);
            if tick % 4 == 0 {
                side.send(now);
            }
        }
        let body = &pair[1].robot.body;
        let inside = body.surroundings.penetration(&body.tool().position);
        let (inside, touches) = (inside[usize::from(!table)], body.contact.norm() > 0.0);
        out.penetration = out.penetration.max(inside);
        if touches && !touched && out.speed == 0.0 {
            out.speed = body.tool().velocity.dot(&way);
        }
        let presses = (3.5..6.0).contains(&now);
        out.lost += usize::from(presses && touched && !touches);
        touched = touches;
        if (5.5..6.0).contains(&now) {
            samples += 1.0;
            out.reflected += push.dot(&way);
            out.pressed -= body.contact.dot(&way);
            out.restless = out.restless.max(body.tool().velocity.norm());
        }
        out.touched_after |= now > 9.0 && touches;
    }
    out.reflected /= samples;
    out.pressed /= samples;
    out.after = (pair[0].robot.tool.position - pair[1].robot.tool.position).norm();
    out
}

/// What the world, the network and the laws do every millisecond.
#[test]
fn a_step_of_it_all_allocates_nothing() {
    let bad = Quality {
        delay: 0.05,
        jitter: 0.05,
        reorder: 0.2,
        duplicate: 0.5,
        loss: 0.1,
        rate: 400.0,
        ..Quality::default()
    };
    let mut pair = [Side::new(bad, 1), Side::new(bad, 2)];
    for side in &mut pair {
        side.robot.impedance.parameters.law = CouplingLaw::Tank;
        side.robot.body.surroundings.table = side.robot.tool.position.z + 0.001;
        side.robot.body.torque_lag = 0.001;
    }
    let mut observer = PassivityObserver::default();
    let made = crate::counting::made_by(|| {
        for tick in 0..2_000_u32 {
            let now = f64::from(tick) * CONTROL_PERIOD;
            hear(&mut pair, now);
            for side in &mut pair {
                side.step(now, &Vector3::new(3.0, 0.0, -3.0));
                side.send(now);
            }
            let end = |side: &Side| CouplingEnd { force: side.robot.force, position: side.robot.tool.position };
            observer.update([end(&pair[0]), end(&pair[1])]);
        }
    });
    assert!(made == 0 && pair[0].robot.body.contact.norm() > 0.0, "{made}");
}

/// The table of docs/youbot.md: `cargo test --test youbot -- --nocapture --exact contact::table`.
#[test]
fn table() {
    println!(
        "| | law | one way, ms | meets at, mm/s | penetration, mm | pressed with, N | hand feels, N | lost | still, mm/s | after, mm |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for (table, place) in [(false, "wall"), (true, "table")] {
        for (law, name) in [(CouplingLaw::Position, "position"), (CouplingLaw::Tank, "tank")] {
            for delay in [0.0, 0.005, 0.02, 0.05] {
                let c = meet(law, delay, table);
                println!(
                    "| {place} | {name} | {} | {:.0} | {:.2} | {:.1} | {:.1} | {} | {:.1} | {:.1} |",
                    delay * 1e3,
                    mm(c.speed),
                    mm(c.penetration),
                    c.pressed,
                    c.reflected,
                    c.lost,
                    mm(c.restless),
                    mm(c.after),
                );
                let what = format!("{place}, {name}, {delay} s: {c:?}");
                assert!(c.speed > 0.01 && c.penetration > 0.0 && c.penetration < 0.003, "{what}");
                assert!(c.lost == 0 && c.restless < 0.002, "{what}");
                assert!(c.pressed > 4.0 && (c.reflected - c.pressed).abs() < 4.0, "{what}");
                assert!(!c.touched_after && c.after < 0.02, "{what}");
            }
        }
    }
}
