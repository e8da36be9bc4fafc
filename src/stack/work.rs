//! Operations on the stack become one plan: every step decided, and how the stack changes with each part of it.

use super::pushes::PlannedPush;
use super::share::{self, HandOver};
use super::{
    Edits, Frame, FrameId, Inverse, Pile, PushesOf, Requester, Scope, Stack, net, newest, squash,
    void::{self, TakenAway},
};
use crate::model::finding::count;
use crate::model::{ConfigId, Configuration, Finding, Findings, MemberRef, OnFailure, codes};
use crate::plan::undo::{DraftStep, Script, undo};
use crate::plan::{PlanContext, PlannedStep, Refusal, StepId};
use crate::system::{Overlay, System, Violation, step};
use crate::time::Time;
use rustc_hash::FxHashSet;
use smallvec::SmallVec;
use std::ops::Range;
use std::sync::Arc;

/// One operation on the stack: a request with its names looked up.
#[derive(Debug, Clone, Copy)]
pub enum Op<'a> {
    /// Apply a configuration. Its group's frame, if there is one, is popped in the same transaction.
    Push {
        /// The configuration.
        configuration: &'a Configuration,
        /// Who asks.
        requester: Requester,
        /// When.
        at: Time,
        /// The state of the coordinator that is being entered, where it belongs to one.
        scope: Option<Scope>,
    },
    /// Pop this frame, from wherever it lies.
    Undo(FrameId),
    /// Pop the top. Requests name their frame.
    #[cfg(any(test, feature = "internals"))]
    UndoTop,
    /// Pop until so many frames are left.
    UndoTo(usize),
}

/// What one operation is of the whole: which steps, and what it does to the stack.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Its steps in [`Planned::whole`].
    pub range: Range<u32>,
    /// What it does to the stack.
    pub edits: Edits,
    /// The configuration that is pushed; none: something is undone.
    pub pushes: Option<ConfigId>,
    /// What the configuration stands for is to be true before it counts as applied.
    pub holds: bool,
    /// What a failure of it leads to.
    pub on_failure: OnFailure,
    /// Its frame as it will be, without a number: what is pushed, or what is being popped.
    pub frame: Option<Arc<Frame>>,
    /// What is undone with it, since it stands in its way ([`along`](super::leave::along)): first, and in that order.
    pub along: Vec<Along>,
}

/// A frame that is undone with another one, both or none.
#[derive(Debug, Clone, PartialEq)]
pub struct Along {
    /// The steps that undo it in [`Planned::whole`].
    pub range: Range<u32>,
    /// As it is.
    pub frame: Arc<Frame>,
}

impl Part {
    /// The steps without those of what is undone with it.
    pub fn own(&self) -> Range<u32> {
        self.along.last().map_or(self.range.start, |along| along.range.end)..self.range.end
    }
}

/// Steps, and how the stack changes when they are done. Take it over with [`Stack::commit`]; dropped, nothing happened.
#[must_use = "a plan does nothing until its steps are executed and the stack has taken it over"]
#[derive(Debug, Clone)]
pub struct Planned {
    /// What is done, in an order in which it may happen; `wave` and `after` tell what may happen in parallel.
    pub steps: Arc<Vec<PlannedStep>>,
    /// Of each of them the place in `whole`; empty: they are the whole.
    pub of: Vec<u32>,
    /// All steps, one operation after the other, where `steps` are the net of them; else empty.
    pub whole: Vec<PlannedStep>,
    /// The operations, in order.
    pub parts: Vec<Part>,
    /// The revision of the system it was made from.
    pub revision: u64,
    /// Of each plan that is pushed: what is allowed and worth saying.
    pub warnings: Findings,
    /// The frames that will be popped, as they are now.
    pub popped: Vec<Arc<Frame>>,
    /// Operations that safe configurations have called whose frames stay: no call of them is taken back.
    pub kept: FxHashSet<MemberRef>,
}

impl Planned {
    /// All steps, one operation after the other.
    pub fn whole(&self) -> &[PlannedStep] {
        if self.whole.is_empty() { &self.steps } else { &self.whole }
    }

    /// The place of a step in [`Self::whole`]; none: it is there for no one of them alone.
    pub fn place(&self, step: usize) -> Option<u32> {
        if self.whole.is_empty() {
            u32::try_from(step).ok()
        } else {
            self.of.get(step).copied().filter(|of| *of != DraftStep::NOWHERE)
        }
    }

    /// The number of the operation that the step at a place of the whole belongs to.
    pub fn part_of(&self, place: Option<u32>) -> usize {
        let last = self.parts.len().saturating_sub(1);
        place.map_or(last, |place| self.parts.iter().position(|part| part.range.contains(&place)).unwrap_or(last))
    }
}

/// What `ops`, one after the other, mean as one transaction. Where something is undone and something is pushed, the steps
/// are the net of both. All or nothing: if one is refused, the whole is.
///
/// # Errors
/// [`Refusal`], with the place of the refused operation.
pub fn transaction(system: &System, stack: &Stack, ops: &[Op<'_>], context: &PlanContext) -> Result<Planned, Refusal> {
    let mut view = Overlay::new(system);
    let mut work = Work::new(&mut view, stack);
    for (i, op) in ops.iter().enumerate() {
        work.add(op, context).map_err(|refusal| Refusal { request: i, ..refusal })?;
    }
    work.finish(system, Some(Room { held: &[], places: &[] }))
}

/// What is taken of the stack by others.
#[derive(Debug, Clone, Copy)]
pub(super) struct Room<'a> {
    /// Frames that are not squashed.
    pub held: &'a [FrameId],
    /// Of which piles the pushes under way are: so many more frames there will be of each.
    pub places: &'a [Pile],
}

/// Of which piles the frames are that a plan under way pushes, without those whose place another one of theirs leaves.
pub fn places(planned: &Planned) -> SmallVec<[Pile; 2]> {
    let pushes = planned.parts.iter().filter_map(|part| part.edits.push.as_ref());
    let mut places: SmallVec<[Pile; 2]> = pushes.map(|frame| frame.pile()).collect();
    for popped in &planned.popped {
        if let Some(at) = places.iter().position(|pile| pile.has(popped)) {
            places.remove(at);
        }
    }
    places
}

/// A plan in the making.
pub(super) struct Work<'o, 's, 'k> {
    script: Script<'o, 's>,
    /// Steps of a push that came first: as long as nothing follows, they are the whole plan, and stand in no script.
    lone: Option<Arc<Vec<PlannedStep>>>,
    /// The frames as they are after the operations so far; those that are pushed have numbers from the top of the range.
    pub(super) frames: Vec<Arc<Frame>>,
    stack: &'k Stack,
    warnings: Findings,
    popped: Vec<Arc<Frame>>,
    parts: Vec<Part>,
    pushed: Vec<FrameId>,
    replaced: bool,
    /// What is known of pushes in the system as it is.
    known: Option<PushesOf<'k>>,
    /// The view does not show yet what the lone steps do: they were known.
    unseen: bool,
}

impl<'o, 's, 'k> Work<'o, 's, 'k> {
    pub(super) fn new(view: &'o mut Overlay<'s>, stack: &'k Stack) -> Self {
        Self {
            script: Script::new(view),
            lone: None,
            frames: stack.frames.clone(),
            stack,
            warnings: Vec::new(),
            popped: Vec::new(),
            parts: Vec::new(),
            pushed: Vec::new(),
            replaced: false,
            known: None,
            unseen: false,
        }
    }

    /// The newest frame of a configuration, after the operations so far.
    pub(super) fn newest_of(&self, configuration: ConfigId, by: Option<Requester>) -> Option<&Arc<Frame>> {
        newest(&self.frames, configuration, by)
    }

    fn place(&self) -> u32 {
        let steps = self.lone.as_ref().map_or(self.script.steps.len(), |lone| lone.len());
        u32::try_from(steps).expect("fewer steps than that")
    }

    /// The same, where something is known of pushes in the system as it is.
    pub(super) fn knowing(self, known: Option<PushesOf<'k>>) -> Self {
        Self { known, ..self }
    }

    /// Something follows: steps that stood alone are the first of the whole.
    fn goes_on(&mut self) {
        if let Some(lone) = self.lone.take() {
            if std::mem::take(&mut self.unseen) {
                let view = self.script.view_mut();
                lone.iter().for_each(|planned| step::effect(&planned.step, view));
            }
            self.script.append(lone.iter().cloned());
        }
    }

    /// Adds an operation.
    ///
    /// # Errors
    /// [`Refusal`]; what is in the making is then of no further use.
    pub(super) fn add(&mut self, op: &Op<'_>, context: &PlanContext) -> Result<(), Refusal> {
        self.goes_on();
        let from = self.place();
        let mut edits = Edits::default();
        let (mut pushes, mut holds, mut on_failure, mut frame) = (None, false, OnFailure::default(), None);
        match op {
            Op::Push { configuration, requester, at, scope } => {
                pushes = Some(configuration.id);
                on_failure = configuration.on_failure;
                holds = configuration.holds.is_some();
                self.push(configuration, *requester, *at, *scope, context, &mut edits)?;
                frame.clone_from(&edits.push);
            }
            Op::Undo(id) => frame = Some(self.undo(*id, &mut edits)?),
            #[cfg(any(test, feature = "internals"))]
            Op::UndoTop => match self.frames.len().checked_sub(1) {
                Some(top) => {
                    frame = Some(self.frames[top].clone());
                    self.pop(top, None, &mut edits)?;
                }
                None => {
                    return Err(Refusal::one(if self.stack.committed.is_empty() {
                        Finding::error(codes::STACK_EMPTY, "there is nothing to undo")
                    } else {
                        Finding::error(codes::STACK_FLOOR, "there is nothing to undo above the committed floor")
                    }));
                }
            },
            Op::UndoTo(left) => {
                while self.frames.len() > *left {
                    self.pop(self.frames.len() - 1, None, &mut edits)?;
                }
            }
        }
        let range = from..self.place();
        self.parts.push(Part { range, edits, pushes, holds, on_failure, frame, along: Vec::new() });
        Ok(())
    }

    /// Adds the undo of a frame with those of others that stand in its way, which come first: one part of the whole.
    ///
    /// # Errors
    /// As [`Self::add`].
    pub(super) fn add_undo(&mut self, id: FrameId, with: &[FrameId]) -> Result<(), Refusal> {
        self.goes_on();
        let from = self.place();
        let (mut edits, mut along) = (Edits::default(), Vec::with_capacity(with.len()));
        for other in with {
            let first = self.place();
            let frame = self.undo(*other, &mut edits)?;
            along.push(Along { range: first..self.place(), frame });
        }
        let frame = Some(self.undo(id, &mut edits)?);
        let (range, on_failure) = (from..self.place(), OnFailure::default());
        self.parts.push(Part { range, edits, pushes: None, holds: false, on_failure, frame, along });
        Ok(())
    }

    /// Pops a frame, and answers it as it was.
    fn undo(&mut self, id: FrameId, edits: &mut Edits) -> Result<Arc<Frame>, Refusal> {
        let Some(at) = self.frames.iter().position(|f| f.id == id) else {
            let finding = Finding::error(codes::STACK_NO_FRAME, format!("there is no frame {}", id.0));
            return Err(Refusal::one(finding.help("`davit stack` shows the frames")));
        };
        let frame = self.frames[at].clone();
        self.pop(at, None, edits)?;
        Ok(frame)
    }

    /// `by`: the configuration that replaces it.
    fn pop(&mut self, at: usize, by: Option<&Configuration>, edits: &mut Edits) -> Result<(), Refusal> {
        let mut hand = share::examine(&self.frames, at).map_err(|finding| Refusal::one(*finding))?;
        let frame = self.frames[at].clone();
        hand.keep(by.into_iter().flat_map(|by| share::called_again(by, &frame)));
        // What a safe configuration interrupted may have taken a component away from under it.
        self.script.leaves_out_gone = frame.safe;
        let taken_back = self.take_back(&frame, &hand);
        self.script.leaves_out_gone = false;
        taken_back.map_err(|found| drifted(&found))?;
        share::hand_over(&mut self.frames, &hand, &|id| id);
        self.frames.remove(at);
        self.is_taken_away(void::taken_away_with(&frame, self.script.view()), edits);
        // A frame that this very transaction pushes and pops leaves no trace.
        if let Some(i) = self.pushed.iter().position(|id| *id == frame.id) {
            self.pushed.remove(i);
        } else {
            self.popped.push(frame.clone());
        }
        edits.pops.push((frame.id, hand));
        Ok(())
    }

    /// Their own file takes components away: what frames of others did to them is void from now on.
    fn is_taken_away(&mut self, mut gone: Vec<TakenAway>, edits: &mut Edits) {
        let touched = void::touched_from_outside(&self.frames, gone.iter().map(|gone| gone.component));
        gone.retain(|gone| touched.contains(&gone.component));
        if !gone.is_empty() {
            gone.sort_unstable();
            void::take_out(&mut self.frames, &|frame, of| void::is_void(&gone, frame, of));
            edits.gone.extend(gone);
        }
    }

    fn take_back(&mut self, frame: &Frame, hand: &HandOver) -> Result<(), Vec<Violation>> {
        let skip = |slot| hand.slots.contains(&slot);
        match &frame.inverse {
            Inverse::Steps(steps) => undo(&mut self.script, steps, &frame.saved, &skip),
            Inverse::List(items) => {
                let wave = self.script.next_wave();
                for item in items.iter() {
                    if item.may_stay().is_some_and(skip) {
                        continue;
                    }
                    let after: SmallVec<[StepId; 1]> =
                        self.script.steps.last().filter(|s| s.wave == wave).map(|s| s.id).into_iter().collect();
                    match frame.partial || frame.safe {
                        true => self.script.add_left(item.clone(), wave, &after)?,
                        false => self.script.add(item.clone(), wave, &after)?,
                    };
                }
                self.script.settle_all()
            }
        }
    }

    fn push(
        &mut self,
        configuration: &Configuration,
        requester: Requester,
        at: Time,
        scope: Option<Scope>,
        context: &PlanContext,
        edits: &mut Edits,
    ) -> Result<(), Refusal> {
        if let Some(group) = configuration.group {
            self.replace(group, configuration, requester, edits)?;
        }
        let configuration = &*super::there::of_what_is_there(self.script.view(), configuration);
        let first = self.parts.is_empty() && !self.replaced && self.script.steps.is_empty();
        let pushes = self.known.filter(|_| first);
        let known = pushes.and_then(|pushes| pushes.known(configuration.id));
        self.unseen = known.is_some();
        let planned = known.unwrap_or_else(|| {
            let planned = PlannedPush::on(self.script.view_mut(), configuration, context);
            pushes.into_iter().for_each(|pushes| pushes.note(configuration.id, &planned));
            planned
        });
        let PlannedPush { steps, footprint, saved, floor, warnings } = (*planned).as_ref().map_err(Refusal::clone)?;
        self.warnings.extend(warnings.iter().cloned());
        self.is_taken_away(void::taken_away_by(steps), edits);
        if first {
            self.lone = Some(steps.clone());
        } else {
            self.script.append(steps.iter().cloned());
        }
        let number = FrameId(u64::MAX - self.pushed.len() as u64);
        self.pushed.push(number);
        let frame = Arc::new(Frame {
            id: number,
            configuration: configuration.id,
            group: configuration.group,
            requester,
            at,
            inverse: Inverse::Steps(steps.clone()),
            footprint: footprint.clone(),
            saved: saved.clone(),
            floor: floor.clone(),
            parts: Arc::default(),
            scope,
            left: false,
            partial: false,
            safe: configuration.safe,
            owes: Arc::default(),
        });
        self.frames.push(frame.clone());
        edits.push = Some(frame);
        edits.waits = configuration.confirm.is_some();
        Ok(())
    }

    /// Pops the group's frame, unless another coordinator asked for it.
    fn replace(
        &mut self,
        group: crate::model::Ident,
        configuration: &Configuration,
        requester: Requester,
        edits: &mut Edits,
    ) -> Result<(), Refusal> {
        let refused = |cause: Findings, old: &str| {
            let message = format!("`{}` would replace `{old}` of the group `{group}`", configuration.id);
            let mut findings = vec![
                Finding::error(codes::STACK_GROUP, message)
                    .at(configuration.origin)
                    .help("undo what stands in the way first; nothing has changed"),
            ];
            findings.extend(cause);
            Refusal { findings, request: 0 }
        };
        if let Some(at) = self.frames.iter().rposition(|f| f.group == Some(group)) {
            let old = self.frames[at].configuration;
            if let Some(cause) = self.frames[at].foreign_to(requester) {
                return Err(refused(vec![cause], old.as_str()));
            }
            self.replaced = true;
            return self.pop(at, Some(configuration), edits).map_err(|refusal| refused(refusal.findings, old.as_str()));
        }
        let buried = self.frames.iter().flat_map(|f| f.parts.iter()).find(|p| p.group == Some(group));
        if let Some(part) = buried {
            let message = format!("`{}` was squashed together with other frames", part.configuration);
            let cause = Finding::error(codes::STACK_SQUASHED, message).help("undo down to the squashed frame");
            return Err(refused(vec![cause], part.configuration.as_str()));
        }
        Ok(())
    }

    /// Ends the plan: the net of what is undone and pushed, and room on the stack, which each push takes when it begins, beside
    /// those of others; none: it has begun, and has its place.
    ///
    /// # Errors
    /// [`Refusal`] when the system is not as the frames say, or a push finds no room.
    pub(super) fn finish(self, system: &System, room: Option<Room<'_>>) -> Result<Planned, Refusal> {
        let Self { mut script, lone, frames, warnings, popped, parts, pushed, stack, replaced, .. } = self;
        script.settle_all().map_err(|found| drifted(&found))?;
        let undone = parts.iter().any(|part| part.pushes.is_none());
        let mixed = replaced || undone && parts.iter().any(|part| part.pushes.is_some());
        let end = mixed.then(|| script.view().clone());
        let whole = script.finish().map_err(|found| drifted(&found))?;
        let net = end.and_then(|end| net::shorter(system, &end, &whole));
        let waiting = parts.iter().filter(|part| part.edits.waits).filter_map(|part| part.edits.push.as_ref());
        let held = room.iter().flat_map(|room| room.held).copied();
        let busy: Vec<FrameId> = held.chain(waiting.map(|frame| frame.id)).collect();
        for (id, room) in pushed.iter().flat_map(|id| room.map(|room| (id, room))) {
            let Some(frame) = frames.iter().find(|frame| frame.id == *id) else { continue };
            let pile = frame.pile();
            let taken = room.places.iter().filter(|of| **of == pile).count();
            let own = taken + frames.iter().filter(|frame| pile.has(frame)).count();
            let bound = stack.bound.saturating_sub(taken);
            let wanted = squash::Quota { pile, bound, busy: &busy };
            if own > stack.bound && !squash::fits(&frames, wanted, stack.memory.as_ref()) {
                let message = format!("{pile} would have {}, and none can be squashed", count(own, "frame"));
                let what = squash::between(&frames, wanted).map_or_else(
                    || "something".to_owned(),
                    |frame| {
                        format!(
                            "`{}` (a frame of {}), which lies between two of them",
                            frame.configuration, frame.requester
                        )
                    },
                );
                let help = format!("undo or commit {what}, or raise `limits: {{ stack: … }}` in the deployment");
                let finding = Finding::error(codes::STACK_FULL, message).help(help);
                return Err(Refusal { findings: vec![finding], request: parts.len().saturating_sub(1) });
            }
        }
        let revision = system.revision();
        let (steps, of, whole) = match net {
            Some((steps, of)) => (Arc::new(steps), of, whole),
            None => (lone.unwrap_or_else(|| Arc::new(whole)), Vec::new(), Vec::new()),
        };
        let kept = share::kept_calls(frames.iter().filter(|frame| !pushed.contains(&frame.id)));
        Ok(Planned { steps, of, whole, parts, revision, warnings, popped, kept })
    }
}

fn drifted(found: &[Violation]) -> Refusal {
    let findings = found
        .iter()
        .map(|violation| {
            Finding::error(codes::STACK_DRIFTED, format!("the system is not as the frame left it: {violation}"))
                .help("`davit drift` shows the difference")
        })
        .collect();
    Refusal { findings, request: 0 }
}
