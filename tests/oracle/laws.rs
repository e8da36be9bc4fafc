//! Laws of a running deployment that need nothing of what `check` and the session share: they are about what was asked, what
//! was answered, and when.

use crate::drive::Note;
use davit::check::Shown;
use davit::time::Time;

/// A request as it was raised, with its first answer.
struct Raised {
    request: u64,
    ask: String,
    /// It may overtake or give up another one, or goes first: it is answered by itself.
    apart: bool,
    answer: Option<(usize, Time, String)>,
}

/// What one step of a coordinator asked for.
struct Step {
    by: String,
    raised: Vec<Raised>,
}

/// What was seen so far.
#[derive(Default)]
pub struct Laws {
    safe: Vec<String>,
    /// Whether frames may be squashed: then one takes the place of another.
    squashes: bool,
    steps: Vec<Step>,
    answers: usize,
    /// Every configuration that was applied, in the order of the answers, with who asked.
    applied: Vec<(String, String)>,
    /// Something ended *broken*: what is left of it is of another kind.
    broken: bool,
    last_requested: bool,
}

fn is_undo(ask: &str) -> bool {
    ask == "undo" || ask.ends_with(".undo")
}

impl Laws {
    /// Nothing seen yet, of a deployment with these safe configurations.
    pub fn of(safe: Vec<String>, squashes: bool) -> Self {
        Self { safe, squashes, ..Self::default() }
    }

    /// What happened since the last rest, and how it stands.
    pub fn hold(&mut self, notes: &[(Time, Note)], shown: &Shown) -> Result<(), String> {
        for (at, note) in notes {
            match note {
                Note::Requested { request, by, ask } => self.requested(*request, by, ask),
                Note::Answer { request, by, answer, .. } => self.answered(*at, *request, by, answer)?,
                _ => {}
            }
            self.last_requested = matches!(note, Note::Requested { .. });
        }
        self.last_requested = false;
        if self.broken {
            return Ok(());
        }
        if shown.frames.is_empty() && shown.open.is_empty() && !shown.system.is_empty() {
            return Err(format!("nothing is in force, and this is there: {:?}", shown.system));
        }
        let mut applied = self.applied.iter();
        let in_order = |(id, by, _): &(String, String, usize)| applied.any(|(of, who)| of == id && who == by);
        if !self.squashes && !shown.frames.iter().all(in_order) {
            return Err(format!(
                "frames {:?} do not stand in the order of the answers {:?}",
                shown.frames, self.applied
            ));
        }
        Ok(())
    }

    fn requested(&mut self, request: u64, by: &str, ask: &str) {
        let of = ask.strip_suffix(".undo").unwrap_or_default();
        let pending = |raised: &Raised| raised.ask == of && raised.answer.is_none();
        let gives_up = self.steps.iter().filter(|step| step.by == by).flat_map(|step| &step.raised).any(pending);
        let apart = gives_up || self.safe.iter().any(|safe| safe == ask);
        let raised = Raised { request, ask: ask.to_owned(), apart, answer: None };
        match self.steps.last_mut().filter(|step| self.last_requested && step.by == by && by != "operator") {
            Some(step) => step.raised.push(raised),
            None => self.steps.push(Step { by: by.to_owned(), raised: vec![raised] }),
        }
    }

    fn answered(&mut self, at: Time, request: u64, by: &str, answer: &str) -> Result<(), String> {
        self.broken |= answer.ends_with(".broken");
        if let Some(id) = answer.strip_suffix(".ok") {
            self.applied.push((id.to_owned(), by.to_owned()));
        }
        let of = |step: &Step| step.raised.iter().any(|raised| raised.request == request);
        let Some(step) = self.steps.iter_mut().rev().find(|step| of(step)) else { return Ok(()) };
        let place = self.answers;
        self.answers += 1;
        // What is told of it later is no answer.
        if let Some(raised) = step.raised.iter_mut().find(|raised| raised.request == request && raised.answer.is_none())
        {
            raised.answer = Some((place, at, answer.to_owned()));
        }
        if self.broken || step.raised.iter().any(|raised| raised.answer.is_none()) {
            return Ok(());
        }
        let step = self.steps.iter().position(of).map(|at| self.steps.remove(at)).expect("found above");
        step.holds()
    }
}

impl Step {
    fn holds(mut self) -> Result<(), String> {
        let told: Vec<String> = self.raised.iter().map(|one| format!("{} ({:?})", one.ask, one.answer)).collect();
        let answer = |one: &Raised| one.answer.clone().unwrap_or((0, Time::default(), String::new()));
        // What was given up by another one is answered with that.
        let cancelled = |one: &Raised| answer(one).2.ends_with(".cancelled");
        let whole = !self.raised.iter().any(|one| cancelled(one) || one.apart);
        self.raised.retain(|one| !one.apart && !cancelled(one));
        self.raised.sort_by_key(|one| !is_undo(&one.ask));
        if !self.raised.is_sorted_by_key(|one| answer(one).0) {
            return Err(format!("undos first, each in the order it was raised: {told:?}"));
        }
        let mixed = self.raised.iter().any(|one| is_undo(&one.ask)) && self.raised.iter().any(|one| !is_undo(&one.ask));
        let success = |one: &Raised| [".ok", ".undone", ".done"].iter().any(|end| answer(one).2.ends_with(end));
        let moment = self.raised.first().map(|one| answer(one).1);
        if whole
            && mixed
            && self.raised.iter().all(success)
            && self.raised.iter().any(|one| Some(answer(one).1) != moment)
        {
            return Err(format!("undo and push of one step are carried out as one: {told:?}"));
        }
        Ok(())
    }
}
