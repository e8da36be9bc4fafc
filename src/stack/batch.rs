//! What the requests of a batch come to: written once. The configurator carries out what stands here, `check` follows it.
//!
//! A batch ends as if its requests had been carried out one after the other, undos first, then pushes, each in the order
//! they were raised. Undos and pushes of one batch are carried out together, by their net difference; where one of them
//! fails, those before it stand, and those behind it are taken up anew. A request that is refused by itself is answered and
//! left out, and the rest is planned anew.

use super::keep::{keeps_still, overwrites_safe};
use super::leave::along;
use super::still::Beside;
use super::work::{Op, Planned, Room, Work};
use super::{
    FrameId, LedDown, Pile, PushesOf, Reason, Request, Requester, Residual, Why, World, claims, may_commit, share,
};

use crate::model::{Ask, ComponentName, ConfigId, Configuration, Finding, OnFailure, Snapshot, Step, Verdict, codes};
use crate::plan::replace::neighbours;
use crate::plan::{PlanContext, PlannedStep, Refusal};
use crate::system::{Overlay, touch};
use crate::time::Time;
use rustc_hash::{FxHashMap, FxHashSet};
use smallvec::SmallVec;
use std::sync::Arc;

/// What requests are judged by, beside the world.
#[derive(Debug, Clone, Copy)]
pub struct Rules<'a> {
    /// The configurations.
    pub configurations: &'a FxHashMap<ConfigId, Configuration>,
    /// What an operator may apply without force, beside what is safe: the deployment's `operator:`.
    pub operator: &'a FxHashSet<ConfigId>,
    /// What plans are made with.
    pub context: &'a PlanContext,
    /// When.
    pub at: Time,
    /// Frames that others under way pop or hand over to, and those that wait for their confirmation.
    pub held: &'a [FrameId],
    /// Of which piles the pushes under way beside it are: these have taken their places on the stack ([`places`]).
    pub places: &'a [Pile],
    /// Undos and pushes of the batch were begun together, though not all of them may be left: some were answered since.
    pub joined: bool,
    /// Its pushes have taken their place on the stack when they began: what others hold on to since does not matter.
    pub placed: bool,
    /// What its undo repairs is repaired, as far as nothing has to move for that: what is broken still stays so.
    pub rested: bool,
    /// It takes along what nobody asks for any more and is in the way of its undos, while this is led down.
    pub led: Option<LedDown>,
    /// What is known of pushes in the system of the world; none: each is planned.
    pub pushes: Option<PushesOf<'a>>,
}

/// A request of a batch that is answered.
#[derive(Debug, Clone)]
pub struct Told {
    /// Its place in the batch.
    pub place: usize,
    /// How; none: it was no request of anybody, and nobody is told.
    pub verdict: Option<Verdict>,
    /// Why, where it is not simply a success.
    pub reason: Option<Reason>,
}

/// The first requests of a batch, which are carried out together.
#[derive(Debug, Clone, Default)]
pub struct Group {
    /// So many requests of the batch are settled by it.
    pub takes: usize,
    /// Those that are answered without being carried out: told with the others, in the order of the batch.
    pub told: SmallVec<[Told; 2]>,
    /// What is done for the others; none: nothing needs to be.
    pub planned: Option<Planned>,
    /// Of each operation of the plan, the place of its request in the batch.
    pub places: SmallVec<[usize; 2]>,
    /// Of each operation, the frame that it undoes since the state it belongs to was left.
    pub visits: SmallVec<[Option<FrameId>; 2]>,
    /// What is repaired before the plan is carried out, by its place in [`World::broken`].
    pub repairs: Option<usize>,
    /// That is repaired by the plan itself, in one net with the undo, or was before it; when it is done, this is broken no more.
    pub mends: Option<Arc<Residual>>,
    /// But for what would move: what is expected of that then.
    pub left: Option<Snapshot>,
    /// It does not go where that has not moved.
    pub hindered: bool,
    /// The requester's frames are made permanent.
    pub commits: bool,
    /// A coordinator has come to its *down* state.
    pub down: bool,
    /// Frames that were to be undone with the state they belong to and stay, since that is refused, by the place of the
    /// request: from now on they are frames like others.
    pub stay: SmallVec<[(usize, FrameId); 1]>,
}

/// What one request comes to.
enum ResolvedRequest<'a> {
    Op(Op<'a>),
    Tell(Option<Verdict>, Option<Reason>),
    Commit,
    Down,
}

/// What the first requests of a batch (arranged, not empty) come to in `world`: as many as are carried out together.
pub fn take_up(world: &World, requests: &[Request], rules: &Rules<'_>) -> Group {
    let together = together(world, requests, rules.joined);
    let repairs = (together == 1).then(|| repairs(world, &requests[0])).flatten();
    let avoiding;
    let whole = world.broken.is_empty() && world.quarantined.is_empty();
    let context = if whole {
        rules.context
    } else {
        avoiding = PlanContext { avoid: world.avoided(), ..rules.context.clone() };
        &avoiding
    };
    let mut refused: SmallVec<[Told; 2]> = SmallVec::new();
    let mut hindered = false;
    let needs_it = |beside: &Option<(FrameId, SmallVec<[FrameId; 2]>)>| match (repairs, beside) {
        (Some(at), Some((frame, with))) => world.needs_moving(at, (*frame, with), context),
        _ => false,
    };
    'anew: loop {
        let mut group = Group { takes: together, told: refused.clone(), repairs, hindered, ..Group::default() };
        let mut beside: Option<(FrameId, SmallVec<[FrameId; 2]>)> = None;
        let mut view = Overlay::new(&world.system);
        let mut work = Work::new(&mut view, &world.stack).knowing(rules.pushes.filter(|_| whole));
        for (place, request) in requests[..together].iter().enumerate() {
            if refused.iter().any(|told| told.place == place) {
                continue;
            }
            match resolve(world, &work, request, rules, repairs.is_some()) {
                ResolvedRequest::Tell(verdict, reason) => group.told.push(Told { place, verdict, reason }),
                ResolvedRequest::Commit => group.commits = true,
                ResolvedRequest::Down => group.down = true,
                ResolvedRequest::Op(op) => {
                    let let_go =
                        |frame: &FrameId| world.stack.frame(*frame).is_some_and(|frame| request.lets_go_of(frame));
                    let visit = if let Op::Undo(frame) = &op { Some(*frame).filter(let_go) } else { None };
                    let meant = |(at, frame): (usize, FrameId)| {
                        let with = taken_along(world, &work, request, frame, (rules, true)).ok()?;
                        Some((at, world.undo_mended(at, (frame, &with), context)?))
                    };
                    if let (Some(at), Op::Undo(frame)) = (repairs, &op)
                        && let Some((at, (planned, left))) = meant((at, *frame))
                    {
                        group.mends = Some(world.broken[at].residual.clone());
                        group.left = left;
                        group.places.push(place);
                        group.visits.push(visit);
                        return with_plan(world, requests, group, planned, rules);
                    }
                    if let (true, Op::Undo(frame)) = (rules.rested, &op) {
                        let with = taken_along(world, &work, request, *frame, (rules, true)).unwrap_or_default();
                        beside = Some((*frame, with));
                    }
                    if let Err(refusal) = add(world, &mut work, request, &op, (rules, context), repairs.is_some()) {
                        hindered = needs_it(&beside);
                        refused.push(no(place, request, Reason::Refused(refusal.findings)));
                        continue 'anew;
                    }
                    group.places.push(place);
                    group.visits.push(visit);
                }
            }
        }
        if !group.places.is_empty() {
            let room = (!rules.placed).then_some(Room { held: rules.held, places: rules.places });
            match work.finish(&world.system, room) {
                Err(refusal) => {
                    let place = group.places[refusal.request.min(group.places.len() - 1)];
                    hindered = needs_it(&beside);
                    refused.push(no(place, &requests[place], Reason::Refused(refusal.findings)));
                    continue 'anew;
                }
                Ok(planned) => {
                    if let (Some(at), Some((frame, with))) = (repairs, &beside) {
                        let residual = world.broken[at].residual.clone();
                        match world.beside(at, (*frame, with), &planned, context) {
                            Beside::Left(left) => (group.mends, group.left) = (Some(residual), Some(left)),
                            Beside::Hindered => return Group { hindered: true, ..group },
                            Beside::Barred => {
                                let place = group.places[0];
                                refused.push(no(place, &requests[place], Reason::StillBroken(residual)));
                                continue 'anew;
                            }
                        }
                    }
                    if let Some((part, reason)) = forbidden(world, requests, &group, &planned, rules) {
                        let place = group.places[part];
                        refused.push(no(place, &requests[place], reason));
                        continue 'anew;
                    }
                    group.planned = Some(planned);
                }
            }
        }
        return told(world, requests, group);
    }
}

/// Adds what a request comes to, with what it takes along.
fn add(
    world: &World,
    work: &mut Work<'_, '_, '_>,
    request: &Request,
    op: &Op<'_>,
    (rules, context): (&Rules<'_>, &PlanContext),
    repaired: bool,
) -> Result<(), Refusal> {
    match op {
        Op::Undo(id) if rules.led.is_some_and(|led| led.is_led_by(request.requester)) => {
            let with = taken_along(world, work, request, *id, (rules, repaired))?;
            work.add_undo(*id, &with)
        }
        op => work.add(op, context),
    }
}

/// The frames that the undo of one takes along.
fn taken_along(
    world: &World,
    work: &Work<'_, '_, '_>,
    request: &Request,
    id: FrameId,
    (rules, repaired): (&Rules<'_>, bool),
) -> Result<SmallVec<[FrameId; 2]>, Refusal> {
    match rules.led.filter(|led| led.is_led_by(request.requester)) {
        Some(led) => along(world, &work.frames, request, id, (led, repaired)).map_err(|found| Refusal::one(*found)),
        None => Ok(SmallVec::new()),
    }
}

/// The group with its answers in order, and the frames that stay since their undo is refused.
fn told(world: &World, requests: &[Request], mut group: Group) -> Group {
    group.told.sort_by_key(|told| told.place);
    let failed = group.told.iter().filter(|told| told.verdict == Some(Verdict::UndoFailed));
    group.stay = failed.filter_map(|told| Some((told.place, world.let_go_by(&requests[told.place])?))).collect();
    group
}

/// A group of one whose plan is there already, if it may be carried out.
fn with_plan(world: &World, requests: &[Request], mut group: Group, planned: Planned, rules: &Rules<'_>) -> Group {
    match forbidden(world, requests, &group, &planned, rules) {
        None => group.planned = Some(planned),
        Some((_, reason)) => {
            let place = group.places.remove(0);
            group.visits.clear();
            group.told.push(no(place, &requests[place], reason));
        }
    }
    told(world, requests, group)
}

fn no(place: usize, request: &Request, reason: Reason) -> Told {
    Told { place, verdict: Some(request.ask.failed()), reason: Some(reason) }
}

/// How many of the first requests are carried out together: undos and pushes of one batch, else one.
fn together(world: &World, requests: &[Request], joined: bool) -> usize {
    let plain = |request: &Request| {
        request.why == Why::Asked && matches!(request.ask, Ask::Apply(_) | Ask::UndoOf(_) | Ask::Undo)
    };
    let mixed = requests.iter().any(|r| r.ask.is_undo()) && requests.iter().any(|r| !r.ask.is_undo());
    if joined {
        return requests.len();
    }
    if !mixed || !requests.iter().all(plain) || !requests[0].ask.is_undo() {
        return 1;
    }
    // What is repaired goes by itself.
    let alone = requests.iter().position(|request| repairs(world, request).is_some());
    alone.map_or(requests.len(), |at| at.max(1))
}

/// What a request repairs before anything else.
fn repairs(world: &World, request: &Request) -> Option<usize> {
    let Ask::UndoOf(id) = request.ask else { return None };
    if world.broken.is_empty() {
        return None;
    }
    let frame = world.stack.newest_of(id, own(request)).map(|frame| frame.id);
    world.repaired_by(id, request.requester, frame)
}

/// Whose frames an undo finds: one's own, by force anybody's.
fn own(request: &Request) -> Option<Requester> {
    if request.force { None } else { Some(request.requester) }
}

fn tell<'a>(verdict: Verdict, reason: Reason) -> ResolvedRequest<'a> {
    ResolvedRequest::Tell(Some(verdict), Some(reason))
}

fn resolve<'a>(
    world: &World,
    work: &Work<'_, '_, '_>,
    request: &Request,
    rules: &Rules<'a>,
    repaired: bool,
) -> ResolvedRequest<'a> {
    let failed = request.ask.failed();
    if request.why == Why::Down {
        return ResolvedRequest::Down;
    }
    let still_broken = |components: &mut dyn Iterator<Item = ComponentName>| {
        world.broken_at(components).map(|broken| Reason::StillBroken(broken.residual.clone()))
    };
    let touched = |of: &Configuration| claims::components(of).into_iter().chain(neighbours(of, &world.system));
    match request.ask {
        Ask::Apply(id) => {
            let Some(configuration) = rules.configurations.get(&id) else { return tell(failed, Reason::Unknown(id)) };
            // Like what waits it does not begin any more.
            if let Some(by) = request.is_overtaken() {
                return tell(Verdict::Cancelled, Reason::SafeCame(by));
            }
            if !may_apply(request, configuration, rules.operator) {
                return tell(failed, Reason::NotListed(id));
            }
            // What it would take the place of is undone with it, and is what only that undo repairs.
            let of_group = |f: &&Arc<super::Frame>| f.group.is_some() && f.group == configuration.group && !f.safe;
            let undone = || work.frames.iter().rev().find(of_group).map(|frame| share::components(&frame.footprint));
            if !world.broken.is_empty()
                && let Some(reason) = still_broken(&mut touched(configuration).chain(undone().into_iter().flatten()))
            {
                return tell(failed, reason);
            }
            let Request { requester, scope, .. } = *request;
            ResolvedRequest::Op(Op::Push { configuration, requester, at: rules.at, scope })
        }
        Ask::UndoOf(id) => {
            if !rules.configurations.contains_key(&id) {
                return tell(failed, Reason::Unknown(id));
            }
            let found = match (request.why, request.scope) {
                (Why::Unconfirmed(frame), _) => match work.frames.iter().find(|f| f.id == frame) {
                    Some(frame) => Some(frame),
                    None => return ResolvedRequest::Tell(None, None),
                },
                // Leaving a state undoes the frame of that visit and no other; that of a later one, which has gone before
                // since it is safe, stands above.
                (_, Some(scope)) => {
                    let of = |f: &&Arc<super::Frame>| {
                        let of = (f.scope, f.configuration, f.requester);
                        !request.gone && of == (Some(scope), id, request.requester)
                    };
                    work.frames.iter().find(of)
                }
                _ => work.newest_of(id, own(request)),
            };
            match found {
                Some(frame) => {
                    // A safe configuration was applied to what is broken as it is; taken back, that is as it was.
                    if !repaired
                        && !frame.safe
                        && !world.broken.is_empty()
                        && let Some(reason) = still_broken(&mut share::components(&frame.footprint).into_iter())
                    {
                        return tell(failed, reason);
                    }
                    ResolvedRequest::Op(Op::Undo(frame.id))
                }
                None if request.scope.is_none() && world.stack.is_buried(id, own(request)) => tell(
                    failed,
                    Reason::Refused(vec![
                        Finding::error(
                            codes::STACK_SQUASHED,
                            format!("`{id}` was committed, or squashed together with others"),
                        )
                        .help("`undo` takes the squashed frame back as one; what was committed is not undone any more"),
                    ]),
                ),
                None if request.requester == Requester::Operator
                    && !request.force
                    && work.newest_of(id, None).is_some() =>
                {
                    tell(failed, Reason::NeedsForce(id))
                }
                None => {
                    // A coordinator leaves a state whose configuration has failed; a person takes *undone* for something done.
                    let person = request.requester == Requester::Operator && request.why == Why::Asked;
                    ResolvedRequest::Tell(Some(Verdict::Undone), person.then_some(Reason::NotInForce(id)))
                }
            }
        }
        Ask::Undo => match work.frames.iter().rev().find(|frame| frame.requester == request.requester) {
            Some(frame) => match still_broken(&mut share::components(&frame.footprint).into_iter()) {
                Some(reason) if !frame.safe => tell(failed, reason),
                _ => ResolvedRequest::Op(Op::Undo(frame.id)),
            },
            None if request.requester == Requester::Operator && !work.frames.is_empty() => {
                tell(failed, Reason::NoneByHand)
            }
            None => tell(failed, Reason::NothingToUndo),
        },
        Ask::UndoTo(left) => {
            if let Some(broken) = world.broken.first() {
                return tell(failed, Reason::StillBroken(broken.residual.clone()));
            }
            match work.frames.get(left..) {
                None | Some([]) => tell(failed, Reason::NothingAbove(work.frames.len())),
                Some(above) => match foreign(above, request) {
                    Some(id) => tell(failed, Reason::NeedsForce(id)),
                    None => ResolvedRequest::Op(Op::UndoTo(left)),
                },
            }
        }
        Ask::Commit { force } => {
            if let Some(broken) = world.broken.first() {
                return tell(failed, Reason::StillBroken(broken.residual.clone()));
            }
            match may_commit(&world.stack, request.requester, force) {
                Err(held) => tell(failed, Reason::Refused(vec![held])),
                Ok(()) => ResolvedRequest::Commit,
            }
        }
    }
}

/// Whether who asks may have this applied: what an operator is not expected to apply was not checked with everything else.
pub fn may_apply(request: &Request, configuration: &Configuration, operator: &FxHashSet<ConfigId>) -> bool {
    request.requester != Requester::Operator
        || request.force
        || configuration.safe
        || operator.contains(&configuration.id)
}

/// A frame of a coordinator that an operator without force does not meddle with.
fn foreign(frames: &[Arc<super::Frame>], request: &Request) -> Option<ConfigId> {
    let others = |frame: &&Arc<super::Frame>| frame.requester != request.requester;
    if request.force { None } else { frames.iter().find(others).map(|frame| frame.configuration) }
}

/// The part of a plan that must not be carried out now, and why: it needs a component in quarantine, or something would
/// move that nobody may move, or an operator would overwrite what is safe.
fn forbidden(
    world: &World,
    requests: &[Request],
    group: &Group,
    planned: &Planned,
    rules: &Rules<'_>,
) -> Option<(usize, Reason)> {
    if !world.quarantined.is_empty() {
        let hindered = hindered(world, planned.steps.iter());
        if let Some((at, findings)) = hindered {
            return Some((planned.part_of(planned.place(at)), Reason::Refused(findings)));
        }
    }
    // Nobody asked for a revert: it moves only where the configuration says so.
    let unasked = |part: usize, request: &Request| {
        let of = planned.parts[part].frame.as_ref().and_then(|frame| rules.configurations.get(&frame.configuration));
        let may = of.is_some_and(|configuration| configuration.on_failure == OnFailure::Rollback);
        matches!(request.why, Why::Unconfirmed(..)) && !may
    };
    for (part, place) in group.places.iter().enumerate() {
        let request = &requests[*place];
        let unasked = unasked(part, request);
        let kept = |step: &Step| keeps_still(world, request, touch::components(step));
        if let Some(reason) = overwrites_safe(world, request, planned, part) {
            return Some((part, reason));
        }
        let steps = planned.steps.iter().enumerate();
        let mut own = steps.filter(|(at, _)| planned.part_of(planned.place(*at)) == part);
        if let Some((_, moving)) = own.find(|(_, planned)| planned.moves && (unasked || kept(&planned.step))) {
            let step = moving.step.clone();
            let keeper = world.stack.keeper_of_step(&step);
            return Some((part, if unasked { Reason::MovesUnasked(step) } else { Reason::Moves(step, keeper) }));
        }
    }
    None
}

/// The first step that needs a component in quarantine, with the findings about all such components. A connection can be
/// taken from any component.
fn hindered<'a>(world: &World, steps: impl Iterator<Item = &'a PlannedStep> + Clone) -> Option<(usize, Vec<Finding>)> {
    let needs = |planned: &PlannedStep| -> SmallVec<[ComponentName; 2]> {
        if matches!(planned.step, Step::Disconnect { .. }) {
            SmallVec::new()
        } else {
            crate::system::touch::components(&planned.step)
        }
    };
    let hung = |planned: &PlannedStep| needs(planned).into_iter().any(|c| world.quarantined.contains(&c));
    let first = steps.clone().position(hung)?;
    let mut components: Vec<ComponentName> =
        steps.flat_map(needs).filter(|component| world.quarantined.contains(component)).collect();
    components.sort_unstable();
    components.dedup();
    let finding = |component| {
        Finding::error(codes::QUARANTINED, format!("`{component}` is in quarantine: an earlier call has not returned"))
            .help("wait until the call returns, restart what the component runs on, or leave it out")
    };
    Some((first, components.into_iter().map(finding).collect()))
}

/// The frames that a plan pops or hands values over to: nobody else squashes them meanwhile.
pub fn held(planned: &Planned) -> Vec<FrameId> {
    let pops = planned.parts.iter().flat_map(|part| &part.edits.pops);
    pops.flat_map(|(id, hand)| std::iter::once(*id).chain(hand.takers())).collect()
}
