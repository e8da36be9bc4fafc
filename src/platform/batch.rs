//! Steps that a platform carries out in one call, and their answers, told as they come.

use super::Outcome;
use crate::model::{Cause, Step};
use crate::time::{Clock, Time, lock};
use smallvec::SmallVec;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A step on its way to a platform, and how long it may take.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedStep {
    /// The step.
    pub step: Step,
    /// How long it may take from its beginning.
    pub patience: Duration,
    /// When it must be over, however late it begins.
    pub until: Time,
}

impl TimedStep {
    /// When it must be over if it begins now.
    pub fn deadline(&self, now: Time) -> Time {
        (now + self.patience).min(self.until)
    }
}

/// How a step of a batch ended.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedOutcome {
    /// How.
    pub outcome: Outcome,
    /// How long after the answer before it, or after it began.
    pub took: Duration,
}

/// Steps that a platform carries out in one call, none of which needs another one ([`Platform::execute_batch`]).
///
/// They are begun in their order and answered in their order, each as soon as it has ended. Nothing begins behind one that is
/// not done; what was not begun when the call returns did not happen, and comes again where it is still wanted.
///
/// A cheap handle: clones are the same batch.
///
/// [`Platform::execute_batch`]: super::Platform::execute_batch
#[derive(Clone)]
pub struct StepBatch(Arc<SharedBatch>);

struct SharedBatch {
    clock: Clock,
    steps: Vec<TimedStep>,
    safe: bool,
    /// Whoever waits for the answers looks.
    tell: Arc<dyn Fn() + Send + Sync>,
    stopped: AtomicBool,
    state: Mutex<BatchState>,
}

struct BatchState {
    begun: usize,
    answered: usize,
    /// All that were answered were done.
    done: bool,
    /// When the first that is not answered began, at the latest: when it, or all of them, were begun, or the one before was
    /// answered.
    since: Time,
    /// Answers that nobody has taken yet.
    answers: SmallVec<[TimedOutcome; 1]>,
    /// Nobody waits any more.
    closed: bool,
}

impl StepBatch {
    /// Steps to be handed to a platform that runs on `clock`.
    pub fn new(clock: Clock, steps: Vec<TimedStep>) -> Self {
        Self::telling(clock, steps, false, Arc::new(|| {}))
    }

    /// `safe`: they belong to a safe configuration. `tell` is called, from any thread, when there are answers to be taken before
    /// the call returns.
    pub(crate) fn telling(clock: Clock, steps: Vec<TimedStep>, safe: bool, tell: Arc<dyn Fn() + Send + Sync>) -> Self {
        let state = BatchState {
            begun: 0,
            answered: 0,
            done: true,
            since: clock.now(),
            answers: SmallVec::new(),
            closed: false,
        };
        Self(Arc::new(SharedBatch {
            clock,
            steps,
            safe,
            tell,
            stopped: AtomicBool::new(false),
            state: Mutex::new(state),
        }))
    }

    /// Whether they belong to a safe configuration: [`Platform::execute_safe`](super::Platform::execute_safe).
    pub fn is_safe(&self) -> bool {
        self.0.safe
    }

    /// All of them.
    pub fn steps(&self) -> &[TimedStep] {
        &self.0.steps
    }

    /// Takes the next steps to be carried out, at most so many; they are begun from now on. Whoever takes them one by one takes
    /// the next when the one before is answered; whoever sends them all to where they are carried out one after the other takes
    /// all at once. None: there are no more, one was not done, the time of the next is over, or it is to stop; the first is
    /// begun all the same, unless nobody waits for it any more.
    pub fn begin(&self, most: usize) -> &[TimedStep] {
        self.begin_at(most, self.0.clock.now())
    }

    pub(super) fn begin_at(&self, most: usize, now: Time) -> &[TimedStep] {
        let mut state = lock(&self.0.state);
        let first = state.begun;
        let rest = &self.0.steps[first..];
        let stopped = self.is_stopped();
        let begins = match first {
            0 => !state.closed,
            _ => !state.closed && !stopped && state.done && state.answered == first,
        };
        let most = if first == 0 && stopped { most.min(1) } else { most };
        let in_time = |at: &usize| first + at == 0 || now < rest[*at].until;
        let count = if begins { (0..rest.len().min(most)).take_while(in_time).count() } else { 0 };
        if count > 0 {
            state.begun += count;
            state.since = now;
        }
        &rest[..count]
    }

    /// The next that was begun and is not answered has ended so. What comes when nobody waits any more is no news.
    pub fn answer(&self, outcome: Outcome) {
        if self.note(outcome, self.0.clock.now()) {
            self.tell();
        }
    }

    /// [`Self::answer`] without telling: whether whoever waits has something of it, which he will hear otherwise.
    pub(super) fn note(&self, outcome: Outcome, now: Time) -> bool {
        let mut state = lock(&self.0.state);
        if state.closed || state.answered == state.begun {
            return false;
        }
        state.done &= matches!(outcome, Outcome::Done(_));
        let took = now.since(state.since);
        state.answers.push(TimedOutcome { outcome, took });
        state.answered += 1;
        state.since = now;
        // Behind the last one the call returns at once.
        state.done && state.answered < self.0.steps.len()
    }

    /// Whoever waits for the answers takes those that there are.
    pub(super) fn tell(&self) {
        (self.0.tell)();
    }

    /// When the next to be answered must be over.
    pub fn deadline(&self) -> Time {
        let state = lock(&self.0.state);
        match self.0.steps.get(state.answered) {
            Some(timed) if state.done => timed.deadline(state.since),
            _ => state.since,
        }
    }

    /// Carries out one after the other by `execute`, which is given a step and its deadline.
    pub fn one_by_one(&self, execute: impl Fn(&Step, Time) -> Outcome) {
        while let [timed] = self.begin(1) {
            self.answer(execute(&timed.step, self.deadline()));
        }
    }

    /// No further one is to be begun.
    pub fn stop(&self) {
        self.0.stopped.store(true, Ordering::Release);
    }

    /// Whether no further one is to be begun: what was taken and has not begun there need not. It is told by
    /// [`Platform::cancel`](super::Platform::cancel) too, for each such step.
    pub fn is_stopped(&self) -> bool {
        self.0.stopped.load(Ordering::Acquire)
    }

    /// The steps that were begun, as far as is known, and are not answered.
    pub fn under_way(&self) -> &[TimedStep] {
        let state = lock(&self.0.state);
        &self.0.steps[state.answered..state.begun]
    }

    /// The answers since they were last taken. Before the call has returned (`over`) the last one stays: whoever has it waits for
    /// nothing.
    pub fn take(&self, over: bool) -> SmallVec<[TimedOutcome; 1]> {
        let mut state = lock(&self.0.state);
        let last = !over && state.answered == self.0.steps.len();
        let kept = if last { state.answers.pop() } else { None };
        let taken = std::mem::take(&mut state.answers);
        state.answers.extend(kept);
        taken
    }

    /// The call has returned, or broken down (`lost`): of what was begun and not answered nobody knows then. Who returns without
    /// a word at all has not kept his.
    pub(crate) fn returned(&self, lost: Option<&str>) {
        let silent = lock(&self.0.state).answered == 0;
        if silent && self.under_way().is_empty() {
            self.begin(1);
        }
        let (why, unknown) = match lost {
            Some(why) => (why, self.under_way().len()),
            None => ("the platform said nothing", usize::from(silent)),
        };
        for _ in 0..unknown {
            self.note(Outcome::Unknown(Cause::Lost(why.to_owned())), self.0.clock.now());
        }
    }

    /// None of them has begun, and none will, where none is answered.
    pub(crate) fn not_begun(&self, cause: Cause) {
        if lock(&self.0.state).answered == 0 {
            self.begin(1);
            self.note(Outcome::NotDone(cause), self.0.clock.now());
        }
    }

    /// Nobody waits any more: what was begun and not answered is unknown, what was not begun never will be.
    pub(crate) fn close(&self) {
        let mut state = lock(&self.0.state);
        let took = self.0.clock.now().since(state.since);
        for _ in state.answered..state.begun {
            state.answers.push(TimedOutcome { outcome: Outcome::Unknown(Cause::Timeout), took });
        }
        if state.begun == 0 {
            // No worker came to it.
            state.answers.push(TimedOutcome { outcome: Outcome::NotDone(Cause::Timeout), took });
        }
        state.closed = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{ComponentName, Transition};

    const MS: Duration = Duration::from_millis(1);

    fn batch(clock: &Clock, patience: &[u32]) -> StepBatch {
        let step = Step::State { component: ComponentName::new("a").expect("a name"), transition: Transition::Start };
        let timed = |ms: &u32| TimedStep { step: step.clone(), patience: MS * *ms, until: Time::NEVER };
        StepBatch::new(clock.clone(), patience.iter().map(timed).collect())
    }

    fn outcomes(batch: &StepBatch, over: bool) -> Vec<Outcome> {
        batch.take(over).into_iter().map(|answer| answer.outcome).collect()
    }

    #[test]
    fn each_has_its_time_from_its_beginning() {
        let clock = Clock::simulated();
        let _guard = clock.enter();
        let batch = batch(&clock, &[10, 20, 5]);
        clock.sleep(MS * 3);
        assert_eq!(batch.begin(usize::MAX).len(), 3);
        assert_eq!(batch.deadline(), Time::default() + MS * 13);
        clock.sleep(MS * 4);
        batch.answer(Outcome::Done(None));
        assert_eq!(batch.deadline(), Time::default() + MS * 27, "the second began when the first had ended");
        let told = batch.take(false);
        assert_eq!(told[..], [TimedOutcome { outcome: Outcome::Done(None), took: MS * 4 }]);
    }

    #[test]
    fn behind_one_that_is_not_done_none_begins() {
        let clock = Clock::simulated();
        let batch = batch(&clock, &[10; 3]);
        assert_eq!(batch.begin(1).len(), 1);
        assert_eq!(batch.begin(1).len(), 0, "the first is not answered");
        batch.answer(Outcome::NotDone(Cause::Cancelled));
        batch.answer(Outcome::Done(None));
        assert_eq!(batch.begin(1).len(), 0);
        assert_eq!(outcomes(&batch, true), [Outcome::NotDone(Cause::Cancelled)], "nothing else has begun");
    }

    #[test]
    fn once_it_is_to_stop_only_the_first_begins() {
        let clock = Clock::simulated();
        let batch = batch(&clock, &[10; 3]);
        batch.stop();
        assert_eq!(batch.begin(usize::MAX).len(), 1);
        batch.answer(Outcome::Done(None));
        assert_eq!(batch.begin(usize::MAX).len(), 0);
    }

    /// Of what nobody waits for any more only what has begun is unknown.
    #[test]
    fn what_has_begun_is_unknown_and_nothing_else() {
        let clock = Clock::simulated();
        let unknown = Outcome::Unknown(Cause::Timeout);
        let one_by_one = batch(&clock, &[10; 3]);
        let at_once = batch(&clock, &[10; 3]);
        one_by_one.begin(1);
        at_once.begin(usize::MAX);
        let neither = batch(&clock, &[10; 3]);
        for batch in [&one_by_one, &at_once, &neither] {
            batch.answer(Outcome::Done(None));
            batch.begin(1);
            batch.close();
            assert!(batch.begin(1).is_empty());
            batch.answer(Outcome::Done(None));
        }
        assert_eq!(outcomes(&one_by_one, true), [Outcome::Done(None), unknown.clone()]);
        assert_eq!(outcomes(&at_once, true), [Outcome::Done(None), unknown.clone(), unknown.clone()]);
        assert_eq!(outcomes(&neither, true), [unknown], "it began one");
        let unbegun = batch(&clock, &[10; 3]);
        unbegun.close();
        assert_eq!(outcomes(&unbegun, true), [Outcome::NotDone(Cause::Timeout)]);
    }

    #[test]
    fn who_says_nothing_or_panics_leaves_unknown_what_has_begun() {
        let clock = Clock::simulated();
        let lost = |why: &str| Outcome::Unknown(Cause::Lost(why.to_owned()));
        let silent = batch(&clock, &[10; 3]);
        silent.returned(None);
        assert_eq!(outcomes(&silent, true), [lost("the platform said nothing")]);
        let panicked = batch(&clock, &[10; 3]);
        panicked.begin(2);
        panicked.returned(Some("oh"));
        assert_eq!(outcomes(&panicked, true), [lost("oh"), lost("oh")]);
        let early = batch(&clock, &[10; 3]);
        early.begin(1);
        early.answer(Outcome::Done(None));
        early.returned(None);
        assert_eq!(outcomes(&early, true), [Outcome::Done(None)]);
    }

    /// Whoever has the last answer waits for nothing: it comes with the end of the call.
    #[test]
    fn the_last_answer_comes_with_the_end() {
        let clock = Clock::simulated();
        let batch = batch(&clock, &[10; 2]);
        batch.begin(2);
        batch.answer(Outcome::Done(None));
        batch.answer(Outcome::Done(None));
        assert_eq!(outcomes(&batch, false).len(), 1);
        assert_eq!(outcomes(&batch, false).len(), 0);
        assert_eq!(outcomes(&batch, true).len(), 1);
    }
}
