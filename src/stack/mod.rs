//! What is in force: frames, how they are taken back, and what a batch of requests means (semantics: *The stack*, *Requests*).
//!
//! Pure: a stack never touches a platform, and it never changes by itself. [`transaction`] decides everything beforehand
//! and gives the steps together with the edits of the stack; [`Stack::apply`] takes those over when the steps are done, and
//! dropping the plan leaves the stack as it was. What a batch of requests means is decided by [`take_up`]; which batch
//! begins when by the [`Desk`]. The configurator carries out what these say, `check` follows what these say.
//!
//! * [`request`], [`answer`]: what is asked and answered. `work`: requests become one plan. `batch`: what the requests of a
//!   batch come to. `settle`: what comes of them when they have ended. `effort`: what a safe configuration does; `before`: what an emergency leads back to; `there`: of what it names, what is there to be done, also beside what it interrupts. `leave`: what a coordinator that leads down takes along. `mend`: what is broken, brought back, in one net with the undo that asks for it. `desk`, [`claims`]: who waits for whom. `world`: system, stack and what is broken, as one. `prepared`: plans that are carried out again. `pushes`: plans that are not made again.
//! * `share`: what keeps a frame from being undone. `squash`: the bound. `stands`: when what a configuration stands for is watched no more. `net`: fewer steps to the same system.

pub mod answer;
mod batch;
mod before;
pub mod claims;
pub mod contenders;
mod desk;
mod effort;
mod keep;
mod leave;
mod mend;
mod net;
mod permanent;
mod pile;
mod prepared;
mod pushes;
pub mod request;
mod settle;
mod share;
mod squash;
mod stands;
mod still;
#[cfg(test)]
mod tests;
mod there;
mod void;
mod work;
mod world;

pub use self::{net::reduce, permanent::may_commit, pile::Pile};
pub use answer::{Answer, Reason, Residual, TakenAlong};
pub use batch::{Group, Rules, Told, held, may_apply, take_up};
pub use before::BeforeEmergency;
pub use desk::{ActiveBatch, Arrival, Arrived, Desk, GivenUp, Gone, given_up_of};
pub use effort::{BestEffort, effort};
pub use keep::keeps_still;
pub use leave::Barring;
pub use prepared::{ResolvedStep, Switch};
pub use pushes::{PlannedPushes, PushesOf};
pub use request::{Batch, FrameId, LedDown, Request, Requester, Scope, Stillness, Why};
pub use settle::{About, Ending, Endings, SafeEnd, Settled, Stopped, settle};
pub use share::{HandOver, calls, components, is_kept, shares, staying};
pub use stands::{is_stood_down, running_for};
pub use still::Beside;
pub use there::beside_what_is_interrupted;
pub use void::TakenAway;
pub use work::{Along, Op, Part, Planned, places, transaction};
pub use world::{Broken, SafeWrites, World};

use crate::model::{ComponentName, ConfigId, Finding, Ident, RunState, Step, codes};
use crate::plan::footprint::Footprint;
use crate::plan::undo::DraftStep;
use crate::plan::{PlannedStep, SavedValue};
use crate::system::touch;
use crate::time::Time;
use claims::is_in_system;
use smallvec::SmallVec;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A configuration that is contained in a squashed or committed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Buried {
    /// The configuration.
    pub configuration: ConfigId,
    /// Who asked for it.
    pub requester: Requester,
    /// The group it belongs to.
    pub group: Option<Ident>,
}

/// How a frame is taken back.
#[derive(Debug, Clone, PartialEq)]
pub enum Inverse {
    /// By undoing its steps, last first. They are those of the plan that it came of.
    Steps(Arc<Vec<PlannedStep>>),
    /// By this list: several frames squashed into one, or what is left of one.
    List(Arc<Vec<DraftStep>>),
}

/// An applied configuration.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::struct_excessive_bools)]
pub struct Frame {
    /// Its number.
    pub id: FrameId,
    /// The configuration; of a squashed frame the newest one in it.
    pub configuration: ConfigId,
    /// The group it belongs to.
    pub group: Option<Ident>,
    /// Who asked.
    pub requester: Requester,
    /// When.
    pub at: Time,
    /// What was done, or, squashed, what takes it back.
    pub inverse: Inverse,
    /// What it wrote, demanded, and what its inverse needs.
    pub footprint: Arc<Footprint>,
    /// What its absolute writes overwrote.
    pub saved: Vec<SavedValue>,
    /// Why undo does not pass it, if it does not.
    pub floor: Option<String>,
    /// What was squashed into it; empty for a frame of its own.
    pub parts: Arc<BTreeSet<Buried>>,
    /// The state of its coordinator that it belongs to, while that is active: such a frame is never squashed.
    pub scope: Option<Scope>,
    /// Its coordinator has let go of it (it left the state that this belonged to, or asked for its undo), and it was not undone then: nobody
    /// may ask for it any more.
    pub left: bool,
    /// It is what was done and not taken back of something that ended *broken*.
    pub partial: bool,
    /// Its configuration is a `safe` one.
    pub safe: bool,
    /// Of a safe one that ended *broken*: what takes back the frames whose place it was to take, and may not have been done. Who asks for
    /// something of its group makes up for it.
    pub owes: Arc<Vec<DraftStep>>,
}

impl Frame {
    /// Whether two frames differ in nothing but number and age, and what undoes them and what they touch: these may be shared, which is looked at first.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        (self.configuration, self.group, self.requester, self.scope)
            == (other.configuration, other.group, other.requester, other.scope)
            && (self.left, self.partial, self.safe, &self.floor)
                == (other.left, other.partial, other.safe, &other.floor)
            && self.parts == other.parts
            && self.saved == other.saved
            && self.owes == other.owes
    }
}

impl Frame {
    /// The steps it was applied with; none for a squashed frame.
    pub fn steps(&self) -> &[PlannedStep] {
        match &self.inverse {
            Inverse::Steps(steps) => steps,
            Inverse::List(_) => &[],
        }
    }

    /// From where to where it moved a component, as far as its undo takes that back.
    pub(crate) fn moved(&self, component: ComponentName) -> Option<(RunState, RunState)> {
        let (steps, items) = match &self.inverse {
            Inverse::Steps(steps) => (steps.as_slice(), [].as_slice()),
            Inverse::List(items) => ([].as_slice(), items.as_slice()),
        };
        let undone = steps.iter().rev().flat_map(|done: &PlannedStep| done.undo.steps());
        let mut back = undone.chain(items.iter().map(|item: &DraftStep| &item.step)).filter_map(|step| match step {
            Step::State { component: of, transition } if *of == component => Some(*transition),
            _ => None,
        });
        let last = back.next()?;
        Some((back.next_back().unwrap_or(last).target(), last.inverse().target()))
    }

    /// Whether several frames were squashed into it.
    pub fn is_squashed(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Why `by` must leave the frame alone: it was asked for by another coordinator. An operator may undo anybody's, and
    /// anybody an operator's.
    pub fn foreign_to(&self, by: Requester) -> Option<Finding> {
        let foreign = matches!((self.requester, by), (Requester::Coordinator(a), Requester::Coordinator(b)) if a != b);
        foreign.then(|| {
            let message =
                format!("`{}` is a frame of the coordinator `{}`, not of `{by}`", self.configuration, self.requester);
            Finding::error(codes::STACK_FOREIGN, message)
                .help(format!("only `{}` or an operator undoes it: ask it by an event", self.requester))
        })
    }

    fn buried(&self) -> Buried {
        Buried { configuration: self.configuration, requester: self.requester, group: self.group }
    }
}

/// The frames in force, oldest first.
#[derive(Debug, Clone)]
pub struct Stack {
    frames: Vec<Arc<Frame>>,
    /// What was committed: below the first frame.
    committed: BTreeSet<Buried>,
    bound: usize,
    next: u64,
    /// What was squashed of which two; shared with its copies.
    memory: Option<squash::Memory>,
}

/// How a stack changes when a part of a transaction has ended: frames popped, with what they hand over, and pushed.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Edits {
    /// Frames that go.
    pub pops: Vec<(FrameId, HandOver)>,
    /// Those of something safe that the one which comes takes over, with all that they take back.
    pub over: SmallVec<[FrameId; 1]>,
    /// Components that their own file takes away: what frames of others did to them is void.
    pub gone: Vec<void::TakenAway>,
    /// A frame that comes; its number is given when it does.
    pub push: Option<Arc<Frame>>,
    /// That frame waits for its confirmation: until then it is not squashed, since it may have to be taken back alone.
    pub waits: bool,
}

impl Stack {
    /// An empty stack that squashes past `bound` frames of one pile (at least 2).
    pub fn new(bound: usize) -> Self {
        Self {
            frames: Vec::with_capacity(bound.clamp(2, 4096) + 1),
            committed: BTreeSet::new(),
            bound: bound.max(2),
            next: 1,
            memory: None,
        }
    }

    /// The same, with memory for so many piles that are full.
    pub fn for_piles(mut self, piles: usize) -> Self {
        self.frames.reserve_exact(self.bound.saturating_mul(piles).min(4096));
        self
    }

    /// The same, and of the same frames it is squashed once, in it and all its copies: for whoever follows thousands of them.
    pub fn remembering(bound: usize) -> Self {
        Self { memory: Some(squash::Memory::default()), ..Self::new(bound) }
    }

    /// The frames, oldest first.
    pub fn frames(&self) -> &[Arc<Frame>] {
        &self.frames
    }

    /// Takes the same frames from elsewhere, where there are others: who keeps thousands of stacks has each once.
    pub fn share(&mut self, mut same: impl FnMut(&Arc<Frame>) -> Option<Arc<Frame>>) {
        for frame in &mut self.frames {
            if let Some(other) = same(frame) {
                *frame = other;
            }
        }
        self.frames.shrink_to_fit();
    }

    /// Whether so many more frames of a requester are within its bound.
    pub fn has_room(&self, by: Requester, more: usize) -> bool {
        self.frames.len() + more <= self.bound
            || self.frames.iter().filter(|frame| frame.requester == by).count() + more <= self.bound
    }

    /// How many frames there are.
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// The newest frame.
    pub fn top(&self) -> Option<&Arc<Frame>> {
        self.frames.last()
    }

    /// The frame of that number.
    pub fn frame(&self, id: FrameId) -> Option<&Arc<Frame>> {
        self.frames.iter().find(|f| f.id == id)
    }

    /// The newest frame of a configuration, by this requester or (none) by anyone. Squashed frames are not found.
    pub fn newest_of(&self, configuration: ConfigId, by: Option<Requester>) -> Option<&Arc<Frame>> {
        newest(&self.frames, configuration, by)
    }

    /// Whether a configuration is in a squashed frame or was committed: in force, and not to be undone by itself.
    pub fn is_buried(&self, configuration: ConfigId, by: Option<Requester>) -> bool {
        let fits = |p: &Buried| p.configuration == configuration && by.is_none_or(|by| p.requester == by);
        self.committed.iter().any(fits) || self.frames.iter().any(|f| f.parts.iter().any(fits))
    }

    /// Whether a frame was squashed into one of these.
    fn has_squashed(&self, frame: &Frame) -> bool {
        self.frames.iter().any(|other| other.parts.contains(&frame.buried()))
    }

    /// Whether a configuration stands, for what it stands for: in a frame that is whole, squashed and committed ones included.
    pub fn is_in_force(&self, id: ConfigId) -> bool {
        self.is_buried(id, None) || self.frames.iter().any(|frame| frame.configuration == id && !frame.partial)
    }

    /// Whether of a frame only a part is in force. Where it was applied once more, and whole, no part of it is missing.
    pub fn is_in_part(&self, frame: &Frame) -> bool {
        let anew =
            |newer: &&Arc<Frame>| newer.id > frame.id && newer.configuration == frame.configuration && !newer.partial;
        frame.partial && !self.frames.iter().any(|newer| anew(&newer))
    }

    /// The safe configurations in force.
    pub fn safe(&self) -> impl Iterator<Item = ConfigId> + '_ {
        self.frames.iter().filter(|frame| frame.safe).map(|frame| frame.configuration)
    }

    /// Which of them keeps a component still: it is in its (sub)system, or in one inside that.
    pub fn keeper_of(&self, component: ComponentName) -> Option<ConfigId> {
        self.safe().find(|safe| is_in_system(*safe, component))
    }

    /// Which of them keeps a component of a step still.
    pub fn keeper_of_step(&self, step: &Step) -> Option<ConfigId> {
        touch::components(step).iter().find_map(|component| self.keeper_of(*component))
    }

    /// Its coordinator has let go of a frame, and it stays: from now on it belongs to no state, and is taken along where everything is led
    /// down.
    pub fn let_go(&mut self, frame: FrameId) {
        if let Some(frame) = self.frames.iter_mut().find(|f| f.id == frame && !f.left) {
            let frame = Arc::make_mut(frame);
            (frame.scope, frame.left) = (None, true);
        }
    }

    /// Forgets everything: the system is empty, or is no longer what the frames say. Numbers are not used again.
    pub fn discard(&mut self) {
        self.frames.clear();
        self.committed.clear();
    }

    /// The same of a subsystem of which nothing is left: its coordinators' frames, and of those of others what they did to it. `busy`: see
    /// [`Self::apply`].
    pub fn discard_in(&mut self, path: Ident, busy: &[FrameId]) {
        let asks = |by: Requester| match by {
            Requester::Coordinator(name) => name.as_str() == path.as_str() || name.local(path).is_some(),
            Requester::Operator | Requester::Safety => false,
        };
        self.frames.retain(|frame| {
            let empty = frame.footprint.touches.is_empty() && frame.configuration.local(path).is_some();
            !(asks(frame.requester) && frame.parts.iter().all(|part| asks(part.requester)) || empty)
        });
        self.committed.retain(|buried| !asks(buried.requester) && buried.configuration.local(path).is_none());
        self.take_out(&|_, of| of.local(path).is_some(), busy);
    }

    /// Takes out of the frames what they did to components that are gone.
    fn take_out(&mut self, gone: &dyn Fn(&Frame, ComponentName) -> bool, busy: &[FrameId]) {
        if void::take_out(&mut self.frames, gone) {
            // Some are about less than before, and count elsewhere.
            let mut piles: SmallVec<[Pile; 4]> = self.frames.iter().map(|frame| frame.pile()).collect();
            while let Some(pile) = piles.pop() {
                piles.retain(|other| *other != pile);
                let room = squash::Quota { pile, bound: self.bound, busy };
                squash::fit(&mut self.frames, room, self.memory.as_ref());
            }
        }
    }

    /// Takes over what the parts of a transaction do to the stack, in their order, now that their steps are done. Answers
    /// the numbers of the frames pushed. `busy` are frames that others under way pop or hand over to, and those that wait for
    /// their confirmation: they are not squashed.
    pub fn apply<'e>(&mut self, edits: impl IntoIterator<Item = &'e Edits>, busy: &[FrameId]) -> Vec<FrameId> {
        self.apply_each(edits, busy).into_iter().flatten().collect()
    }

    /// The same; answers of each of them the frame that it pushed, unless a later one popped that again.
    pub fn apply_each<'e>(
        &mut self,
        edits: impl IntoIterator<Item = &'e Edits>,
        busy: &[FrameId],
    ) -> Vec<Option<FrameId>> {
        let mut pushed: Vec<Option<FrameId>> = Vec::new();
        let mut numbers: Vec<(FrameId, FrameId)> = Vec::new();
        let mut busy = SmallVec::<[FrameId; 4]>::from_slice(busy);
        for Edits { pops, gone, push, waits, over: _ } in edits {
            for (id, hand) in pops {
                let real =
                    |id: FrameId| numbers.iter().rev().find(|(given, _)| *given == id).map_or(id, |(_, real)| *real);
                let popped = real(*id);
                share::hand_over(&mut self.frames, hand, &real);
                self.frames.retain(|frame| frame.id != popped);
                pushed.iter_mut().filter(|id| **id == Some(popped)).for_each(|id| *id = None);
            }
            if !gone.is_empty() {
                self.take_out(&|frame, of| void::is_void(gone, frame, of), &busy);
            }
            if push.is_none() {
                pushed.push(None);
            }
            if let Some(frame) = push {
                let id = FrameId(self.next);
                self.next += 1;
                numbers.push((frame.id, id));
                pushed.push(Some(id));
                let mut frame = frame.clone();
                Arc::make_mut(&mut frame).id = id;
                let pile = frame.pile();
                // Of those who follow thousands of stacks each has only what it needs.
                self.frames.reserve_exact(1);
                self.frames.push(frame);
                busy.extend(waits.then_some(id));
                // Room was made sure of when it began; where others hold on to frames since, there is one more for a while.
                let room = squash::Quota { pile, bound: self.bound, busy: &busy };
                squash::fit(&mut self.frames, room, self.memory.as_ref());
            }
        }
        pushed
    }

    /// Takes over all of a transaction.
    pub fn commit(&mut self, planned: Planned) -> Vec<FrameId> {
        self.apply(planned.parts.iter().map(|part| &part.edits), &[])
    }

    /// Gives values to the frames that take them over.
    fn hand_over(&mut self, hand: &HandOver) {
        share::hand_over(&mut self.frames, hand, &|id| id);
    }

    /// Puts another frame in the place of that of the same number.
    pub fn replace(&mut self, frame: Frame) {
        if let Some(at) = self.frames.iter().position(|f| f.id == frame.id) {
            self.frames[at] = Arc::new(frame);
        }
    }

    /// The number that the next frame gets.
    pub fn next(&self) -> FrameId {
        FrameId(self.next)
    }

    /// Pushes a frame of what began before the frame `since`, but below those of safe configurations at the top that came after
    /// that: they stand above what they interrupted.
    pub fn push_below_safe(&mut self, frame: Frame, since: FrameId, busy: &[FrameId]) -> FrameId {
        let id = self.push_beside(frame, busy);
        let mut at = self.frames.len() - 1;
        let interrupts = |frame: &Frame| frame.safe && frame.id >= since;
        while at > 0 && interrupts(&self.frames[at - 1]) && self.frames[at].id == id {
            self.frames.swap(at - 1, at);
            at -= 1;
        }
        id
    }

    /// Pushes the frame of a safe configuration that has been applied as far as it goes, with what goes with it. Frames of what is `broken`
    /// are not squashed, but one of their group takes their place, where they are not ordinary ones that it leaves `apart`.
    pub fn push_safe(
        &mut self,
        edits: Edits,
        frame: Frame,
        busy: &[FrameId],
        (broken, apart): (&[FrameId], &[FrameId]),
    ) -> FrameId {
        let kept: SmallVec<[FrameId; 4]> = busy.iter().chain(broken).copied().collect();
        let busy: SmallVec<[FrameId; 4]> = busy.iter().copied().filter(|id| !edits.over.contains(id)).collect();
        let push = Some(Arc::new(Frame { safe: true, ..frame }));
        let (bound, waits) = (self.bound, edits.waits);
        // Two of a group are one before they count.
        self.bound = bound.saturating_add(1);
        let pushed = self.apply([&Edits { push, ..edits }], &kept).first().copied().unwrap_or(FrameId(0));
        self.bound = bound;
        effort::take_over_group(&mut self.frames, pushed, &busy, apart);
        if let Some(pile) = self.frame(pushed).map(|frame| frame.pile()) {
            let busy: SmallVec<[FrameId; 4]> = kept.into_iter().chain(waits.then_some(pushed)).collect();
            let room = squash::Quota { pile, bound, busy: &busy };
            squash::fit(&mut self.frames, room, self.memory.as_ref());
        }
        pushed
    }

    /// How it will be when a safe configuration that is being applied has come to its end, whose frame has this number until then.
    pub fn expecting(&self, edits: Edits, frame: Frame, id: FrameId) -> Self {
        let mut expected = Self { next: id.0, ..self.clone() };
        expected.push_safe(edits, frame, &[], (&[], &[]));
        expected
    }

    /// Pushes a frame as it is, but for its number.
    pub fn push(&mut self, frame: Frame) -> FrameId {
        self.push_beside(frame, &[])
    }

    fn push_beside(&mut self, frame: Frame, busy: &[FrameId]) -> FrameId {
        let pushed = self.apply([&Edits { push: Some(Arc::new(frame)), ..Edits::default() }], busy);
        pushed.first().copied().unwrap_or(FrameId(0))
    }
}

/// The newest frame of a configuration among `frames`, by this requester or (none) by anyone.
fn newest(frames: &[Arc<Frame>], configuration: ConfigId, by: Option<Requester>) -> Option<&Arc<Frame>> {
    let fits =
        |f: &&Arc<Frame>| f.configuration == configuration && !f.is_squashed() && by.is_none_or(|by| f.requester == by);
    frames.iter().rev().find(fits)
}
