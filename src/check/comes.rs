//! What a batch comes to in a world: asked of the stack once, and followed to each end that it may have.

use super::desks::PlainBatch;
use super::outcome::{Comes, ConcurrentWork, DecidedGroup, Went, WorldId};
use super::stands::never;
use super::world::Worlds;
use crate::model::{Ask, Findings};
use crate::plan::PlannedStep;
use crate::stack::{Ending, Endings, FrameId, Group, Planned, Reason, Request, Rules, Stopped, held, settle, take_up};
use crate::transaction::can_fail;
use smallvec::SmallVec;
use std::cell::OnceCell;
use std::rc::Rc;
use std::sync::Arc;

impl Worlds<'_> {
    /// What the rest of a batch comes to in a world that is known.
    pub fn comes(&mut self, id: WorldId, asks: &PlainBatch, concurrent: &ConcurrentWork) -> Rc<Comes> {
        let mut key = (id, asks.clone(), concurrent.clone());
        if concurrent.placed {
            // What finds its place comes to the same as what has one.
            key.2.placed = false;
            if let Some(known) = self.comes.get(&key).filter(|known| !known.lacks_room()) {
                return known.clone();
            }
            key.2.placed = true;
        }
        if let Some(known) = self.comes.get(&key) {
            return known.clone();
        }
        let comes = Rc::new(self.work_out(id, asks, concurrent));
        self.comes.insert(key, comes.clone());
        comes
    }

    /// The first requests of a batch, as the stack decides.
    pub fn group(&self, id: WorldId, requests: &[Request], concurrent: &ConcurrentWork) -> Option<Group> {
        let ConcurrentWork { held, joined, placed, led } = concurrent;
        let pushes = Some(self.pushes.of(self.system(id)));
        let rules = Rules { held, joined: *joined, placed: *placed, led: *led, pushes, ..self.rules() };
        self.get(id).map(|world| take_up(world, requests, &rules))
    }

    fn work_out(&mut self, id: WorldId, requests: &[Request], concurrent: &ConcurrentWork) -> Comes {
        self.asked.extend(requests.iter().filter_map(|r| if let Ask::Apply(id) = r.ask { Some(id) } else { None }));
        let mut group = self.group(id, requests, concurrent).unwrap_or_default();
        let refused = group.told.iter().filter_map(|told| {
            let reasons = match told.reason.as_ref()? {
                Reason::Overtaken | Reason::GivenUp | Reason::SafeCame(_) => return None,
                other => other.findings(),
            };
            Some((told.place, Rc::new(reasons)))
        });
        let refused = refused.collect();
        let planned = group.planned.take();
        let warnings = planned.as_ref().map(|planned| planned.warnings.clone()).filter(|warnings| !warnings.is_empty());
        let warnings = warnings.map(Rc::new);
        let holds = planned.iter().flat_map(held).collect();
        let can_fail = planned.as_ref().map(can_fail).unwrap_or_default();
        let mut ends =
            |endings: &[Ending]| self.after(id, requests, &group, planned.as_ref(), endings, &concurrent.held);
        let parts = can_fail.len();
        let until = |part: usize, ending: Ending| -> Endings {
            let of = |at: usize| {
                if at < part {
                    Ending::Done
                } else if at == part {
                    ending
                } else {
                    Ending::Anew
                }
            };
            (0..parts).map(of).collect()
        };
        let done = ends(&until(parts, Ending::Anew));
        let stopped = (0..parts).map(|part| {
            let cancelled = ends(&until(part, Ending::Cancelled));
            (cancelled, can_fail[part].then(|| ends(&until(part, Ending::Failed))))
        });
        let stopped = stopped.collect();
        let hollow = self.hollow(done.world, &group, planned.as_ref());
        let (group, ends, interrupted) = (DecidedGroup::of(&group), OnceCell::new(), OnceCell::new());
        Comes { group, refused, hollow, warnings, holds, can_fail, done, stopped, ends, interrupted }
    }

    /// The requests of a group that say what is false in the world in which all of it is done.
    fn hollow(&self, done: WorldId, group: &Group, planned: Option<&Planned>) -> Box<[(usize, Rc<Findings>)]> {
        let parts = planned.iter().flat_map(|planned| &planned.parts).enumerate().filter(|(_, part)| part.holds);
        let says = parts.filter_map(|(at, part)| {
            let id = part.pushes.filter(|id| self.judged.contains(id))?;
            let finding = never(self.deployment, self.configuration(id)?, &self.get(done)?.system)?;
            Some((group.places[at], Rc::new(vec![finding])))
        });
        says.collect()
    }

    /// The world after a group has ended so, nothing of it being left in between.
    fn after(
        &mut self,
        id: WorldId,
        requests: &[Request],
        group: &Group,
        planned: Option<&Planned>,
        endings: &[Ending],
        held: &[FrameId],
    ) -> Went {
        let Some(before) = self.get(id) else { unreachable!("planned in a world that is known") };
        let settled = settle(requests, group, endings, Stopped::Not);
        let done = endings.iter().take_while(|ending| **ending == Ending::Done).count();
        if done == 0 && settled.stay.is_empty() {
            return Went::to(id);
        }
        let mut world = before.clone();
        let (mut pushed, mut system) = (Vec::new(), self.system(id));
        if let Some(planned) = planned {
            let steps = match done == endings.len() {
                true => &planned.steps[..],
                false => &planned.whole()[..planned.parts[..done].last().map_or(0, |part| part.range.end as usize)],
            };
            system = self.systems.carry_out(system, &mut world.system, steps);
            pushed = world.take_over(planned.parts.iter().map(|part| &part.edits), endings, held);
        }
        world.keep(requests, &settled);
        let pushed: SmallVec<[FrameId; 2]> = pushed.into_iter().flatten().collect();
        self.went(id, world, system, &pushed)
    }

    /// The steps of a group, for who shows them.
    pub fn steps(&self, id: WorldId, requests: &[Request], concurrent: &ConcurrentWork) -> Vec<PlannedStep> {
        self.group(id, requests, concurrent)
            .and_then(|group| group.planned)
            .map_or_else(Vec::new, |planned| Arc::unwrap_or_clone(planned.steps))
    }
}
