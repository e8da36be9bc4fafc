//! The oracle: what `check` follows and what a running deployment does are the same.
//!
//! Each case is a deployment out of a number: one or two coordinators, a few configurations over three components, a
//! simulated platform whose steps take time and go wrong. It runs in simulated time; events, an operator's requests and time
//! come to it at any moment. `check` follows it ([`davit::check::Follower`]); at every rest, that is after every answer, the
//! running session must look like one of the states that `check` has: coordinators, system, stack, what is not answered; and
//! every answer must be one that `check` has too.
//!
//! `DAVIT_ORACLE_CASES` says how many cases are run (22,000 without it, about a minute; a long run is 1,000,000), and
//! `DAVIT_ORACLE_FIRST` from which number on: that of a case that failed with `DAVIT_ORACLE_CASES=1` runs it alone.

mod classes;
mod drive;
mod generate;
mod laws;
mod mutations;
#[path = "../support/names.rs"]
mod names;
mod settings;

use classes::{CLASSES, Classes};
use generate::Chance;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// With so many cases that disagree it ends: more of them say no more.
const ENOUGH: u64 = 60;

/// The cases of a full run.
const CASES: u64 = 22_000;

/// The cases of each class that a full run has at least.
const LEAST: u64 = 500;

fn number(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

/// Cases behind those of a full run that disagreed once: to come to *down* again behind what an operator asked for meanwhile.
const MENDED: [u64; 1] = [55_789];

#[test]
fn what_disagreed_once_agrees() {
    for seed in MENDED {
        let mut chance = Chance::new(seed);
        let made = generate::make(&mut chance);
        let safe = drive::safe(&made).iter().map(ToString::to_string).collect();
        let went = drive::run(seed, &made, &mut chance, &mut Classes::of(safe));
        assert!(matches!(went, Ok(true)), "{seed}: {:?}", went.err().map(|disagreement| disagreement.0));
    }
}

#[test]
fn a_running_deployment_does_what_check_follows() {
    let (first, cases) = (number("DAVIT_ORACLE_FIRST", 0), number("DAVIT_ORACLE_CASES", CASES));
    let next = AtomicU64::new(first);
    let sums = Mutex::new(([0u64; CLASSES.len()], 0u64, Vec::<(u64, String)>::new()));
    let workers = std::thread::available_parallelism().map_or(2, usize::from).min(4);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= first + cases
                        || sums.lock().unwrap().2.len() as u64 >= number("DAVIT_ORACLE_ENOUGH", ENOUGH)
                    {
                        return;
                    }
                    let mut chance = Chance::new(seed);
                    let made = generate::make(&mut chance);
                    let safe = drive::safe(&made).iter().map(ToString::to_string).collect();
                    let mut classes = Classes::of(safe);
                    classes.tells = cases == 1;
                    let went = drive::run(seed, &made, &mut chance, &mut classes);
                    let mut sums = sums.lock().unwrap();
                    match went {
                        Ok(true) => {
                            let met = classes.met.iter().zip(&mut sums.0);
                            met.for_each(|(met, count)| *count += u64::from(*met));
                        }
                        Ok(false) => sums.1 += 1,
                        Err(disagreement) => sums.2.push((seed, disagreement.0)),
                    }
                }
            });
        }
    });
    let (counts, left_out, mut wrong) = sums.into_inner().unwrap();
    let told: Vec<String> = CLASSES.iter().zip(&counts).map(|(class, count)| format!("{count:>8}  {class}")).collect();
    println!("{cases} cases, {left_out} not followed\n{}", told.join("\n"));
    wrong.sort();
    let seeds: Vec<u64> = wrong.iter().map(|(seed, _)| *seed).collect();
    println!("disagree: {seeds:?}");
    assert!(wrong.is_empty(), "cases {seeds:?} disagree; the first:\n{}", wrong[0].1);
    assert!(left_out <= cases / 50, "{left_out} cases are not followed");
    if cases >= CASES {
        let few: Vec<&str> =
            CLASSES.iter().zip(&counts).filter(|(_, count)| **count < LEAST).map(|(class, _)| *class).collect();
        assert!(few.is_empty(), "classes with fewer than {LEAST} cases: {few:?}");
    }
}
