//! What the robot is for, as shipped and with its coordinator in the loop: it copies, all of the time.

use crate::live::{Live, Row};

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0_u32, 0.0), |(n, sum), v| (n + 1, sum + v * v));
    (sum / f64::from(n.max(1))).sqrt()
}

/// Lets time pass, in which `copying` is never left and nothing is at a limit. What was recorded.
fn copies(live: &Live, seconds: f64) -> Vec<Row> {
    live.rows();
    let from = live.now();
    live.run(seconds);
    let story = live.story(from);
    let left = story.lines().find(|line| line.contains(" in ") && !line.contains("copying.eight_DOF_mode"));
    assert!(left.is_none() && live.session.in_state("eight_DOF_mode"), "it left `copying`: {left:?}\n{story}");
    for event in ["e_JNT_SOFT_LIMIT_EXEEDED", "e_overspeed", "e_torque_sat", "e_misaligned"] {
        assert_eq!(live.first(event, from), None, "{event}");
    }
    let rows = live.rows();
    #[allow(clippy::cast_precision_loss)]
    let expected = rows.len() as f64 / 1000.0;
    assert!((expected - seconds).abs() < 0.1, "{expected} s recorded");
    assert!(rows.iter().all(|row| row.saturated == 0 && row.mode == 6));
    rows
}

/// Tracking (mm), and the hand's force (N, rms and peak).
fn figures(rows: &[Row]) -> (f64, f64, f64) {
    let error = rms(rows.iter().map(|row| (row.tool - row.other.expect("the other robot is there")).norm()));
    let hand = rows.iter().map(|row| row.hand.norm());
    (error * 1e3, rms(hand.clone()), hand.fold(0.0, f64::max))
}

/// As it is shipped, nobody doing anything: the operator of the simulation brings the arms together and sways.
fn as_shipped(name: &str) {
    let live = Live::copying(name);
    let (error, hand, _) = figures(&copies(&live, 60.0)[10_000..]);
    assert!(error <= 12.0 && hand <= 8.0, "{error} mm, {hand} N rms");
    live.down();
}

#[test]
fn a_minute_as_shipped() {
    as_shipped("youbot_arm");
}

#[test]
fn a_minute_as_shipped_scoped() {
    as_shipped("youbot_arm_scoped");
}

/// Nobody touches it; 42 mm to and fro in both directions for a minute; 40 cm away and back.
fn acceptance(name: &str) {
    let script = "free 0.5; align 4; free 20; sway 60 0.042 0.042 0 0.15; go 8 0.283 0.283 0; hold 4; go 8 -0.283 -0.283 0; hold 4";
    let live = Live::with_hand(name, script);
    live.bring_up();
    live.until_state("copying", 10.0);
    // The hand's time runs from when the drives take torques.
    let up = live.first("in root.operational.unsync.for_eight", 0.0).expect("up");
    copies(&live, up + 24.4 - live.now());
    let untouched = copies(&live, 0.1);
    let last = untouched.last().unwrap();
    let (first, base) = (untouched[0], last.base);
    assert!((last.tool - first.tool).norm() < 1e-4 && base.vx.hypot(base.vy) < 1e-3, "it creeps: {first:?} {last:?}");

    let rows = copies(&live, 60.0);
    let (error, hand, peak) = figures(&rows);
    println!("{name}, 42 mm: {error:.1} mm RMS, hand {hand:.1} N rms, {peak:.1} N peak");
    let span = |axis: usize| {
        let of = rows.iter().map(|row| row.tool[axis]);
        of.clone().fold(f64::MIN, f64::max) - of.fold(f64::MAX, f64::min)
    };
    assert!(span(0) > 0.06 && span(1) > 0.06, "the tool hardly moves: {} {}", span(0), span(1));
    assert!(error <= 12.0 && hand <= 8.0, "{error} mm, {hand} N rms");

    let rows = copies(&live, 23.0);
    let (error, hand, peak) = figures(&rows);
    println!("{name}, 40 cm: {error:.1} mm RMS, hand {hand:.1} N rms, {peak:.1} N peak");
    let start = rows[0].tool;
    let way = rows.iter().map(|row| (row.tool - start).norm()).fold(0.0, f64::max);
    assert!(way > 0.37, "{way} m");
    assert!(error <= 14.7 && hand <= 8.0, "{error} mm, {hand} N rms");
    live.down();
}

#[test]
fn untouched_swayed_and_led_away() {
    acceptance("youbot_arm");
}

#[test]
fn untouched_swayed_and_led_away_scoped() {
    acceptance("youbot_arm_scoped");
}
