//! Groups of coordinators that are the same but for names: one of them is followed, and what is said of all is what is said where each is followed.

use crate::apart_random::{Has, Made, made, told};
use crate::aside::Chance;
use crate::support::Small;
use davit::check::{Effort, Report, run_with};
use davit::model::Code;
use std::collections::BTreeSet;

/// What is done to the second one, which is the first one by other names.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Changed {
    Nothing,
    /// A transition is left out.
    Less(usize),
    /// Something of what it asks for is worth something else.
    Other,
}

fn copies(seed: u64, changed: Changed) -> [Made; 3] {
    let of = |name: &str| {
        let mut chance = Chance(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1357_9bdf);
        let has = Has { stop: false, more: chance.percent(70), tells: false, shared: chance.percent(30) };
        made(&mut chance, name, has)
    };
    let mut all = ["a", "b", "c"].map(of);
    match changed {
        Changed::Nothing => {}
        Changed::Less(at) => {
            let kept = |coordinator: &str| -> Vec<String> { coordinator.lines().map(str::to_owned).collect() };
            let mut lines = kept(&all[1].coordinator);
            let arrows: Vec<usize> = (0..lines.len()).filter(|i| lines[*i].starts_with("trans {")).collect();
            lines.remove(arrows[at % arrows.len()]);
            all[1].coordinator = lines.join("\n");
        }
        Changed::Other => {
            let conf = &mut all[1].configurations;
            *conf = conf.replace("b_base = Configuration { ", "b_base = Configuration { port_write('b.in', 7.0), ");
        }
    }
    all
}

/// The report; `apart`: what says so is called otherwise in the second and third, so that nothing is taken for the same.
fn report(all: &[Made; 3], apart: bool) -> Option<Report> {
    let charts: Vec<String> = (0..)
        .zip(all)
        .map(|(i, of)| match apart {
            true => of.coordinator.replace("leaving", &format!("leaving{i}")),
            false => of.coordinator.clone(),
        })
        .collect();
    let configurations: String = all.iter().map(|of| of.configurations.as_str()).collect();
    let coordinators = [("a", charts[0].as_str()), ("b", &charts[1]), ("c", &charts[2])];
    let read = Small::several(&configurations, &coordinators, "").read();
    let effort = Effort { transitions: 3_000, ..Effort::default() };
    let report = run_with(read.deployment, &read.catalogue, effort);
    (!report.left.iter().any(|left| left.contains("as many as are looked at"))).then_some(report)
}

fn said(report: &Report) -> BTreeSet<(Code, String)> {
    let plain = |text: String| (0..3).fold(text, |text, i| text.replace(&format!("leaving{i}"), "leaving"));
    told(report).into_iter().map(|(code, text)| (code, plain(text))).collect()
}

/// `DAVIT_EXCHANGED_CASES=10000` is the long run.
#[test]
fn what_is_the_same_but_for_names_is_judged_as_where_each_is_followed() {
    let cases = std::env::var("DAVIT_EXCHANGED_CASES").map_or(60, |n| n.parse().expect("a number"));
    let (mut compared, mut fewer, mut found) = (0u64, [0u64; 3], 0u64);
    for seed in 0.. {
        if compared >= cases {
            break;
        }
        for (kind, changed) in
            (0..).zip([Changed::Nothing, Changed::Less(usize::try_from(seed).unwrap()), Changed::Other])
        {
            let all = copies(seed, changed);
            let (Some(once), Some(each)) = (report(&all, false), report(&all, true)) else { continue };
            compared += 1;
            assert_eq!(said(&once), said(&each), "{seed} {changed:?}");
            assert_eq!((&once.verdict, &once.left), (&each.verdict, &each.left), "{seed} {changed:?}");
            assert!(once.explored.states <= each.explored.states, "{seed} {changed:?}");
            fewer[kind] += u64::from(once.explored.states < each.explored.states);
            found += u64::from(!said(&each).is_empty());
        }
    }
    // Where the second one is another one, the third is still like the first. Mostly something is found on them, and each is followed.
    assert!(fewer.iter().all(|n| *n > 0) && found > cases / 20, "{fewer:?} {found} of {compared}");
}

/// Of three that are the same, with and without faults in them, states are counted once, and what is wrong is said of each.
#[test]
fn it_is_followed_once_and_told_of_each() {
    let (mut clean, mut wrong) = (0, 0);
    for seed in 0..120 {
        let all = copies(seed, Changed::Nothing);
        let (Some(three), Some(each)) = (report(&all, false), report(&all, true)) else { continue };
        match three.explored.states == each.explored.states {
            true => wrong += 1,
            false => {
                assert_eq!(each.explored.states, 3 * three.explored.states, "{seed}");
                clean += 1;
            }
        }
        assert_eq!(said(&three), said(&each), "{seed}");
    }
    assert!(clean > 3 && wrong > 3, "{clean} {wrong}");
}
