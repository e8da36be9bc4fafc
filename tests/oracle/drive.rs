//! One case: a deployment runs on the simulated platform in simulated time, things come to it at any moment, and at every
//! rest it is compared with where `check` follows it to.

use crate::classes::Classes;
use crate::generate::{CONFIRMS, Chance, EVENTS, Made};
use crate::laws::Laws;
use crate::names::event;
use crate::settings::{Setting, followed};
use davit::check::{Follower, Known, Seen, Shown};
use davit::model::{Ask, ConfigId, EventName};
use davit::platform::simulated::{Delays, Fault, FaultRule, Faults, Simulated, SimulatedOptions, StepPattern};
use davit::session::{Happening, Session, SessionSetup};
use davit::stack::Requester;
use davit::statechart::{Chart, compile};
use davit::time::{Clock, Time};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What an observer of the session wrote down.
#[derive(Debug, Clone)]
pub enum Note {
    Answer {
        request: u64,
        by: String,
        answer: String,
        #[allow(dead_code)] // told when a case disagrees
        steps: String,
        /// What an operator had put in its way was undone with it.
        along: bool,
    },
    Requested {
        request: u64,
        by: String,
        ask: String,
    },
    Moved(Vec<String>),
    /// The configurator itself failed.
    Failed(String),
}

/// How a case went wrong: what happened, what was expected, what is.
pub struct Disagreement(pub String);

struct Case<'a> {
    session: Arc<Session>,
    platform: Simulated,
    clock: Clock,
    follower: Follower<'a>,
    notes: Arc<Mutex<Vec<(Time, Note)>>>,
    laws: Laws,
    /// Everything that happened, in words.
    log: Vec<String>,
    classes: &'a mut Classes,
    names: Vec<String>,
    settings: Vec<Setting>,
}

/// What goes wrong. Left out: what leaves a component faulted or in quarantine, and a platform that lies, which `check` takes
/// for what a monitor tells of or a loss.
fn faults(chance: &mut Chance) -> Faults {
    let mut rules = Vec::new();
    if chance.percent(50) {
        let often = [0.1, 0.3, 0.8][chance.below(3)];
        rules.push(FaultRule::chance(often, Fault::Fail).times(1 + chance.below(8) as u32));
    }
    if chance.percent(10) {
        let fault = if chance.percent(50) { Fault::LostRequest } else { Fault::LostAnswer };
        rules.push(FaultRule::chance(0.2, fault).times(1 + chance.below(2) as u32));
    }
    Faults { seed: chance.below(1 << 30) as u64, ..Faults::new(rules) }
}

/// How long steps take.
fn delays(chance: &mut Chance) -> Delays {
    let ms = |n: usize| Duration::from_millis(n as u64);
    if chance.percent(15) {
        return Delays::default();
    }
    let base = ms(chance.below(3));
    let mut of = Vec::new();
    for step in ["operation_call", "create", "start", "property_set a.k"] {
        if chance.percent(40) {
            of.push((StepPattern::new(step), ms(chance.below(6))));
        }
    }
    Delays { base, jitter: Duration::ZERO, of }
}

/// Runs a case. `Ok(false)`: it cannot be followed (more was on its way than `check` follows).
pub fn run(seed: u64, made: &Made, chance: &mut Chance, classes: &mut Classes) -> Result<bool, Disagreement> {
    let charts: Vec<Arc<Chart>> = made
        .deployment
        .charts()
        .map(|written| {
            let (chart, findings) = compile(written);
            Arc::new(chart.unwrap_or_else(|| panic!("seed {seed}: {findings:?}\n{}", made.text)))
        })
        .collect();
    let lent: Vec<&Chart> = charts.iter().map(|chart| &**chart).collect();
    let settings = Setting::all(chance);
    let followed = followed(&made.deployment, &settings);
    let Some(follower) = Follower::new(&followed, &lent, &made.catalogue) else { return Ok(false) };
    let clock = Clock::simulated();
    let me = clock.enter();
    let options = SimulatedOptions { delays: delays(chance), ..SimulatedOptions::default() };
    let said = format!("{:?}", options.delays);
    let platform = Simulated::new(made.catalogue.clone(), clock.clone(), options);
    let session = Session::start(SessionSetup {
        deployment: Arc::new(made.deployment.clone()),
        functions: charts.iter().map(|_| None).collect(),
        charts: charts.clone(),
        catalogue: made.catalogue.clone(),
        platform: Arc::new(platform.clone()),
        clock: clock.clone(),
    });
    let notes = Arc::new(Mutex::new(Vec::new()));
    session.hub().observe({
        let notes = notes.clone();
        Arc::new(move |at, what| {
            let note = match what {
                Happening::Answered(a) => {
                    let steps = serde_json::to_string(&a.steps).unwrap_or_default();
                    let along = a.reasons.iter().any(|reason| reason.contains("of an operator was undone with it"));
                    Note::Answer { request: a.request, by: a.by.clone(), answer: a.answer.clone(), steps, along }
                }
                Happening::Requested { request, ask, by } => {
                    Note::Requested { request: request.unwrap_or_default(), by: by.clone(), ask: ask.clone() }
                }
                Happening::State { active } => Note::Moved(active.clone()),
                Happening::Noted { note } if note.contains("configurator itself") => Note::Failed(note.clone()),
                _ => return,
            };
            notes.lock().unwrap_or_else(PoisonError::into_inner).push((at, note));
        })
    });
    let names = made.deployment.coordinators.iter().map(|c| c.name.to_string()).collect();
    let safes = safe(made).iter().map(ToString::to_string).collect();
    let laws = Laws::of(safes, made.deployment.limits.stack < 16);
    let log = vec![said];
    let mut case =
        Case { session, platform, clock: clock.clone(), follower, notes, log, classes, names, settings, laws };
    let went = case.go(made, chance);
    let overflowed = case.follower.overflowed();
    let log = std::mem::take(&mut case.log);
    drop(case);
    clock.shutdown();
    drop(me);
    match went {
        _ if overflowed => Ok(false),
        Ok(()) => Ok(true),
        Err(why) => Err(Disagreement(format!("seed {seed}\n{}\n{}\n{why}", made.text, log.join("\n")))),
    }
}

impl Case<'_> {
    fn go(&mut self, made: &Made, chance: &mut Chance) -> Result<(), String> {
        self.rest(0)?;
        let actions = 8 + chance.below(10);
        for action in 0..actions {
            // At moments of its own: no step begun by another action ends then.
            self.clock.sleep(Duration::from_nanos(1000));
            match chance.below(20) {
                _ if action == 0 => self.raise("e_start")?,
                0..=9 => self.raise(chance.pick(&EVENTS))?,
                10..=12 => self.raise("e_start")?,
                13 | 14 => {
                    // What an operator has put on top of what is led down now.
                    let all = &made.deployment.configurations;
                    let first = if all.len() > 3 { 3 } else { 0 };
                    let id = all[first + chance.below(all.len() - first)].id;
                    if chance.percent(90) && !(id.as_str() == "c3" && made.kept) {
                        match chance.percent(25) {
                            true => self.set(chance)?,
                            false => self.operator(Ask::Apply(id))?,
                        }
                        self.rest(action)?;
                        for _ in 0..chance.below(12) {
                            self.clock.sleep(Duration::from_millis(1));
                            self.rest(action)?;
                        }
                        self.clock.sleep(Duration::from_nanos(1000));
                    }
                    self.raise("e_shutdown")?;
                }
                15 => self.raise(CONFIRMS)?,
                16..=18 if self.names.len() == 1 || chance.percent(50) => {
                    let id = made.deployment.configurations[chance.below(made.deployment.configurations.len())].id;
                    let kept = id.as_str() == "c3" && made.kept;
                    let ask = match chance.below(6) {
                        _ if kept => continue,
                        0 => Ask::Undo,
                        1 | 2 => Ask::UndoOf(id),
                        _ => Ask::Apply(id),
                    };
                    self.operator(ask)?;
                }
                19 => self.set(chance)?,
                _ => {}
            }
            self.rest(action)?;
            if action == 0 {
                // What is kept is there before anything else happens, or goes wrong.
                for _ in 0..24 {
                    self.clock.sleep(Duration::from_millis(1));
                    self.rest(0)?;
                }
                self.platform.set_faults(faults(chance));
            }
            for _ in 0..chance.of(&[0, 0, 1, 1, 2, 3, 8]).to_owned() {
                self.clock.sleep(Duration::from_millis(1));
                self.rest(action)?;
            }
        }
        for _ in 0..60 {
            self.clock.sleep(Duration::from_millis(1));
            self.rest(actions)?;
        }
        Ok(())
    }

    fn raise(&mut self, name: &str) -> Result<(), String> {
        self.log.push(format!("{} event {name}", self.clock.now()));
        let name: EventName = event(name);
        self.follower.see(Seen::Event(name)).map_err(|why| format!("the event {name}: {why}"))?;
        self.session.raise(name, "test");
        Ok(())
    }

    fn operator(&mut self, ask: Ask) -> Result<(), String> {
        self.log.push(format!("{} operator {ask}", self.clock.now()));
        let seen = Seen::Operator { ask, force: true };
        self.follower.see(seen).map_err(|why| format!("the operator's {ask}: {why}"))?;
        self.session.request(ask, "operator", true);
        Ok(())
    }

    /// An operator sets something, or takes back what was set.
    fn set(&mut self, chance: &mut Chance) -> Result<(), String> {
        let setting = &self.settings[chance.below(self.settings.len())];
        let (id, name, value) = (setting.id(), setting.member.to_string(), setting.value);
        if chance.percent(25) && self.session.setting(&name).is_some() {
            return self.operator(Ask::UndoOf(id));
        }
        // What is not there, or is being set already, is refused without a request.
        if self.session.set(0, &name, &value.into(), true).is_err() {
            return Ok(());
        }
        self.log.push(format!("{} operator sets {name} to {value}", self.clock.now()));
        let seen = Seen::Operator { ask: Ask::Apply(id), force: true };
        self.follower.see(seen).map_err(|why| format!("the operator's {id}: {why}"))
    }

    /// Lets everything that happens now happen, and compares.
    fn rest(&mut self, action: usize) -> Result<(), String> {
        self.clock.sleep(Duration::from_nanos(1));
        let notes = std::mem::take(&mut *self.notes.lock().unwrap_or_else(PoisonError::into_inner));
        if notes.is_empty() && action > 0 {
            return Ok(());
        }
        for (_, note) in &notes {
            self.log.push(format!("{} {note:?}", self.clock.now()));
        }
        for (_, note) in &notes {
            if let Note::Failed(why) = note {
                return Err(why.clone());
            }
            if let Note::Answer { by, answer, .. } = note {
                let by = match by.as_str() {
                    "operator" => Requester::Operator,
                    name => Requester::Coordinator(davit::model::ComponentName::new(name).expect("a plain name")),
                };
                let seen = Seen::Answer { by, event: event(answer) };
                self.follower.see(seen).map_err(|why| format!("the answer {answer}: {why}"))?;
                if self.classes.tells {
                    self.log.push(format!("after {answer}: {}", self.follower.may()));
                }
            }
        }
        let shown = self.shown();
        let known: Known = self.follower.rests(&shown).map_err(|why| format!("at rest as {shown:?}\n{why}"))?;
        self.laws.hold(&notes, &shown).map_err(|why| format!("a law is broken: {why}"))?;
        let notes: Vec<Note> = notes.into_iter().map(|(_, note)| note).collect();
        self.classes.note(&notes, &shown, known);
        Ok(())
    }

    fn shown(&self) -> Shown {
        let status = self.session.status();
        let leaf = |name: &String| {
            let active = status.coordinators.get(name).and_then(|active| active.last());
            active.cloned().unwrap_or_default()
        };
        Shown {
            leaves: self.names.iter().map(leaf).collect(),
            system: status.system.expect("the configurator answers"),
            frames: status.stack.iter().flatten().map(|f| (f.configuration.clone(), f.by.clone(), f.parts)).collect(),
            open: status.outstanding,
        }
    }
}

/// The configurations of a deployment that are safe.
pub fn safe(made: &Made) -> Vec<ConfigId> {
    made.deployment.configurations.iter().filter(|c| c.safe).map(|c| c.id).collect()
}
