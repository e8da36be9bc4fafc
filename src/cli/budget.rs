//! How much `davit check` follows, and what is told meanwhile: a line on the terminal, the memory that is left, Ctrl-C.

use super::CommandFailure;
use crate::check::{Far, Halt};
use crate::limits;
use crate::model::codes::CLI_MEMORY_UNKNOWN;
use crate::model::finding::count;
use crate::time::{Clock, Time};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use rustc_hash::FxHashMap;
use signal_hook::SigId;
use signal_hook::consts::SIGINT;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::ThreadId;
use std::time::Duration;

/// How much is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CheckBudget {
    /// Transitions of coordinators that are followed together.
    pub transitions: usize,
    /// States of them; none: any.
    pub states: Option<usize>,
    /// Bytes of memory that the process takes up; none: any.
    pub memory: Option<u64>,
}

impl Default for CheckBudget {
    fn default() -> Self {
        Self { transitions: limits::CHECK_TRANSITIONS, states: None, memory: None }
    }
}

/// Units of memory and what a number of transitions may end with, the longest first.
const BYTES: [(&str, u64); 4] = [("KB", 1_000), ("MB", 1_000_000), ("GB", 1_000_000_000), ("B", 1)];
const TIMES: [(&str, u64); 4] = [("K", 1_000), ("M", 1_000_000), ("G", 1_000_000_000), ("", 1)];

/// What is written before one of these units, in whole ones; none: it is none of them, or no number.
fn number(text: &str, units: &[(&str, u64)]) -> Option<u64> {
    let upper = text.trim().to_ascii_uppercase();
    let (digits, times) = units.iter().find_map(|(unit, times)| Some((upper.strip_suffix(unit)?, times)))?;
    let digits = digits.trim_end();
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let plain = !whole.is_empty() && whole.bytes().chain(part.bytes()).all(|byte| byte.is_ascii_digit());
    // More digits behind the point than the unit has places mean nothing.
    let part = part.trim_end_matches('0');
    let places = u32::try_from(part.len()).ok()?;
    if !plain || places > times.ilog10() {
        return None;
    }
    let part = if part.is_empty() { 0 } else { part.parse::<u64>().ok()?.checked_mul(times / 10u64.pow(places))? };
    whole.parse::<u64>().ok()?.checked_mul(*times)?.checked_add(part)
}

/// A number of states: what is written before that word.
fn states(text: &str) -> Option<u64> {
    let upper = text.trim().to_ascii_uppercase();
    number(upper.strip_suffix("STATES").or_else(|| upper.strip_suffix("STATE"))?, &TIMES)
}

/// As many as can be followed. With who is told otherwise: what was written, and of what.
fn followed(part: &str, most: u64, of: &str) -> Result<usize, String> {
    let most = usize::try_from(most).ok().filter(|n| (1..=limits::CHECK_TRANSITIONS_MOST).contains(n));
    most.ok_or_else(|| format!("`{part}`: between 1 and {} {of}", limits::CHECK_TRANSITIONS_MOST))
}

impl FromStr for CheckBudget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut budget = Self::default();
        let mut transitions = None;
        for part in text.split(',') {
            if let Some(bytes) = number(part, &BYTES).filter(|_| budget.memory.is_none()) {
                budget.memory = Some(bytes);
            } else if let Some(most) = number(part, &TIMES).filter(|_| transitions.is_none()) {
                transitions = Some(followed(part, most, "transitions")?);
            } else if let Some(most) = states(part).filter(|_| budget.states.is_none()) {
                budget.states = Some(followed(part, most, "states")?);
            } else {
                return Err(format!(
                    "`{part}`: a number of transitions (`2000000`, `2M`), states (`500Kstates`), memory (`2GB`), or several, \
                     each once: `2M,2GB`"
                ));
            }
        }
        // Who counts states counts no transitions, unless both are said.
        let others = budget.states.map_or(budget.transitions, |_| limits::CHECK_TRANSITIONS_MOST);
        budget.transitions = transitions.unwrap_or(others);
        Ok(budget)
    }
}

/// Memory in the largest unit that it is whole in.
fn memory(bytes: u64) -> String {
    let whole = |(_, times): &(&str, u64)| bytes >= *times && bytes.is_multiple_of(*times);
    let (unit, times) = [BYTES[2], BYTES[1], BYTES[0]].into_iter().find(whole).unwrap_or(BYTES[3]);
    format!("{}{unit}", bytes / times)
}

/// As it is read: `800000`, `800000,2GB`, `500000states`.
impl std::fmt::Display for CheckBudget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let transitions = self.bounds_transitions().then(|| self.transitions.to_string());
        let states = self.states.map(|states| format!("{states}states"));
        let parts: Vec<String> = transitions.into_iter().chain(states).chain(self.memory.map(memory)).collect();
        f.write_str(&parts.join(","))
    }
}

impl CheckBudget {
    /// Whether it bounds transitions, and not states alone.
    fn bounds_transitions(self) -> bool {
        self.states.is_none() || self.transitions < limits::CHECK_TRANSITIONS_MOST
    }

    /// In words.
    pub fn told(self) -> String {
        let transitions = self.bounds_transitions().then(|| count(self.transitions, "transition"));
        transitions.into_iter().chain(self.beside()).collect::<Vec<_>>().join(" and ")
    }

    /// What it bounds beside transitions, if anything, in words.
    fn beside(self) -> Option<String> {
        let memory = self.memory.map(|bytes| format!("{} of memory", memory(bytes)));
        let beside: Vec<String> = self.states.map(|states| count(states, "state")).into_iter().chain(memory).collect();
        (!beside.is_empty()).then(|| beside.join(" and "))
    }

    /// How far it is, for the line that tells it: what all have come to that are followed, and of how many transitions each may.
    fn so_far(self, Far { states, transitions }: Far, now: usize) -> String {
        let transitions = match self.bounds_transitions() {
            true if now == transitions => format!("{transitions} of {}", count(self.transitions, "transition")),
            // What was followed before had as many for itself.
            true => format!("{} ({now} of {} here)", count(transitions, "transition"), self.transitions),
            false => count(transitions, "transition"),
        };
        let most = self.beside().map(|beside| format!(", at most {beside}"));
        format!("{}, {transitions}{}", count(states, "state"), most.unwrap_or_default())
    }
}

/// What the process takes up in memory, in bytes; none: the system does not tell.
fn taken_up() -> Option<u64> {
    let told = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = told.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1_024)
}

/// How soon a line tells how far it is: what is over before needs none.
const TELLS_AFTER: Duration = Duration::from_millis(500);

/// Following that is under way.
pub struct Following {
    budget: CheckBudget,
    clock: Clock,
    began: Time,
    bar: ProgressBar,
    /// Ctrl-C came.
    interrupted: Arc<AtomicBool>,
    signals: Vec<SigId>,
    told: Mutex<ToldSoFar>,
}

/// What was told last, by those that follow side by side.
struct ToldSoFar {
    at: Time,
    /// How far the files are that a thread has followed, and the one that it follows.
    far: FxHashMap<ThreadId, (Far, Far)>,
}

impl ToldSoFar {
    /// How far all are, with what this thread tells of the file that it follows.
    fn all(&mut self, of: Far) -> Far {
        let (before, now) = self.far.entry(std::thread::current().id()).or_default();
        if of.states < now.states || of.transitions < now.transitions {
            *before = before.and(*now);
        }
        *now = of;
        self.far.values().fold(Far::default(), |all, (before, now)| all.and(*before).and(*now))
    }
}

impl Following {
    /// From now on. The first Ctrl-C ends it, the second one the process, as it would without us.
    ///
    /// # Errors
    /// The operating system does not tell how much memory is taken up, and that is bounded.
    pub fn new(budget: CheckBudget, silent: bool) -> Result<Self, CommandFailure> {
        if budget.memory.is_some() && taken_up().is_none() {
            return Err(CommandFailure::usage(
                CLI_MEMORY_UNKNOWN,
                "the system does not tell how much memory this process takes up",
                "give `--budget` a number of transitions or states",
            ));
        }
        let interrupted = Arc::new(AtomicBool::new(false));
        // Where signals cannot be watched the first one ends the process.
        let watched = signal_hook::flag::register_conditional_default(SIGINT, interrupted.clone());
        let watched =
            watched.and_then(|ends| Ok(vec![ends, signal_hook::flag::register(SIGINT, interrupted.clone())?]));
        let mut following = Self::before_acting(silent);
        (following.budget, following.interrupted) = (budget, interrupted);
        following.signals = watched.unwrap_or_default();
        Ok(following)
    }

    /// The same before something else is done: it only tells how far it is, and Ctrl-C is the command's.
    pub fn before_acting(silent: bool) -> Self {
        // It draws on a terminal only.
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(None, target);
        bar.set_style(ProgressStyle::with_template("{spinner} {wide_msg}").expect("a valid template"));
        let clock = Clock::real();
        let began = clock.now();
        Self {
            budget: CheckBudget::default(),
            clock,
            began,
            bar,
            interrupted: Arc::default(),
            signals: Vec::new(),
            told: Mutex::new(ToldSoFar { at: began, far: FxHashMap::default() }),
        }
    }

    /// Tells how far it is, and whether it goes on.
    ///
    /// # Errors
    /// It does not, and why.
    pub fn goes_on(&self, far: Far) -> Result<(), Halt> {
        if self.interrupted.load(Ordering::Relaxed) {
            self.bar.set_message("working out what was found so far; Ctrl-C again ends at once");
            self.bar.tick();
            return Err(Halt::Interrupted);
        }
        let over = |most: u64| taken_up().is_some_and(|bytes| bytes > most);
        if self.budget.memory.is_some_and(over) {
            return Err(Halt::Memory);
        }
        self.tell(far);
        Ok(())
    }

    /// Tells how far it is.
    pub fn tell(&self, far: Far) {
        if self.bar.is_hidden() {
            return;
        }
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let all = told.all(far);
        let now = self.clock.now();
        let spent = now.since(self.began);
        if spent >= TELLS_AFTER && now.since(told.at) >= Duration::from_millis(100) {
            told.at = now;
            #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let rate = (all.states as f64 / spent.as_secs_f64()) as u64;
            let so_far = self.budget.so_far(all, far.transitions);
            self.bar.set_message(match self.signals.is_empty() {
                true => format!("checking: {so_far}; {rate} states/s"),
                false => format!("following: {so_far}; {rate} states/s; Ctrl-C tells what was found so far"),
            });
            self.bar.tick();
        }
    }

    /// It is over; whether it was interrupted.
    pub fn over(self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        self.signals.drain(..).for_each(|id| _ = signal_hook::low_level::unregister(id));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_states_of_all_files_are_counted() {
        let mut told = ToldSoFar { at: Clock::real().now(), far: FxHashMap::default() };
        let far = |states: usize| Far { states, transitions: 2 * states };
        assert_eq!([4, 10, 3].map(|states| told.all(far(states))), [4, 10, 13].map(far), "another file begins anew");
        let beside = std::thread::scope(|scope| scope.spawn(|| told.all(far(5))).join());
        assert_eq!(beside.ok(), Some(far(18)), "a thread tells of its own file");
        let second = CheckBudget::default().so_far(told.all(far(6)), 12);
        assert!(second.starts_with("21 states, 42 transitions (12 of "), "the count does not go back: {second}");
    }

    #[test]
    fn a_budget_is_told_in_words() {
        for (text, told, so_far) in [
            ("2M", "2000000 transitions", "8 states, 9 of 2000000 transitions"),
            ("7,1GB", "7 transitions and 1GB of memory", "8 states, 9 of 7 transitions, at most 1GB of memory"),
            ("5Kstates", "5000 states", "8 states, 9 transitions, at most 5000 states"),
            (
                "7,5states,1KB",
                "7 transitions and 5 states and 1KB of memory",
                "8 states, 9 of 7 transitions, at most 5 states and 1KB of memory",
            ),
        ] {
            let budget = text.parse::<CheckBudget>().unwrap();
            assert_eq!(
                (budget.told().as_str(), budget.so_far(Far { states: 8, transitions: 9 }, 9).as_str()),
                (told, so_far)
            );
        }
    }

    #[test]
    fn a_budget_is_written_as_it_is_read() {
        let (usual, most) = (limits::CHECK_TRANSITIONS, limits::CHECK_TRANSITIONS_MOST);
        for (text, transitions, states, memory, told) in [
            ("2M", 2_000_000, None, None, "2000000"),
            ("0.5k", 500, None, None, "500"),
            ("1.25g", 1_000_000_000, None, None, ""),
            ("2 GB", usual, None, Some(2_000_000_000), "800000,2GB"),
            ("1.5GB, 7", 7, None, Some(1_500_000_000), "7,1500MB"),
            ("9B", usual, None, Some(9), "800000,9B"),
            ("500Kstates", most, Some(500_000), None, "500000states"),
            ("1 state, 2M", 2_000_000, Some(1), None, "2000000,1states"),
            ("0.5M STATES,1GB", most, Some(500_000), Some(1_000_000_000), "500000states,1GB"),
            ("2Gstates", most, None, None, ""),
            ("0states", most, None, None, ""),
        ] {
            match text.parse::<CheckBudget>() {
                Ok(budget) => {
                    assert_eq!(budget, CheckBudget { transitions, states, memory }, "{text}");
                    assert_eq!(budget.to_string(), told, "{text}");
                    assert_eq!(told.parse(), Ok(budget), "{text}");
                }
                Err(why) => assert!(told.is_empty(), "{text}: {why}"),
            }
        }
        for none in [
            "",
            "M",
            ".5M",
            "1e3",
            "1.2345k",
            "+3",
            "3,4",
            "1GB,2GB",
            "99999999999999999999",
            "5TB",
            "١",
            "states",
            "5states,6states",
            "5sta",
            "1GBstates",
        ] {
            assert!(none.parse::<CheckBudget>().is_err(), "{none}");
        }
    }
}
