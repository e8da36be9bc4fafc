//! A slow look at components that nothing is under way with (semantics: *What goes wrong*): are they as the steps have left them? What differs (a
//! false *done*, a stranger's doing) is a residual like others, and who wrote it last is lost.

use super::engine::Engine;
use super::inbox::PoolReply;
use super::looks::SlowLook;
use super::pool::{CallFor, PlatformCall};
use super::progress::Progress;
use super::request::{Reason, Residual};
use crate::limits;
use crate::model::{ComponentName, RunState, Snapshot, Step};
use crate::plan::footprint::Footprint;
use crate::stack::{Broken, Frame};
use crate::system::touch::{self, Access, touches};
use crate::system::{self, View as _};
use rustc_hash::FxHashSet;
use std::sync::Arc;

impl Engine {
    /// Looks on, when it is time. True: something differs.
    pub(super) fn observe_slowly(&mut self) -> bool {
        let now = self.given.clock.now();
        if let Some(look) = self.observing.out.take() {
            match self.pool.take(look.ticket) {
                Some(PoolReply::Observed(Ok(seen))) => {
                    if self.compare(&look.components, seen) {
                        return true;
                    }
                }
                Some(_) => {}
                None if now >= look.until => self.pool.give_up(look.ticket),
                None => {
                    self.observing.out = Some(look);
                    return false;
                }
            }
            if self.observing.rest.is_empty() {
                self.observing.later(now);
            }
        }
        self.observing.owed |= !self.world.system.is_empty();
        if !self.observing.owed {
            self.observing.next = None;
            self.observing.rest.clear();
            return false;
        }
        match self.observing.next {
            None => self.observing.later(now),
            Some(next) if now < next => {}
            Some(_) if self.pool.has_room_beside(1) => self.look_on(),
            // Another time: whoever is busy is not to wait for this.
            Some(_) => self.observing.next = Some(now + limits::OBSERVE_EVERY),
        }
        false
    }

    /// Looks at the next components of a round.
    fn look_on(&mut self) {
        let now = self.given.clock.now();
        if self.observing.rest.is_empty() {
            self.observing.rest = self.to_look_at();
            self.observing.owed = !self.world.system.is_empty();
        }
        let busy = self.not_to_be_judged();
        let mut components = Vec::new();
        while components.len() < limits::OBSERVED_AT_ONCE
            && let Some(name) = self.observing.rest.pop()
        {
            if !busy.contains(&name) {
                components.push((name, self.generation(name)));
            }
        }
        if components.is_empty() {
            return self.observing.later(now);
        }
        let deadline = now + self.given.limits.step_timeout;
        let names = components.iter().map(|(name, _)| *name).collect();
        let ticket = self.call(PlatformCall::ObserveSome(names), deadline, CallFor::Plain);
        self.observing.out = Some(SlowLook { ticket, components, until: deadline + limits::PLATFORM_GRACE });
    }

    /// Also what should not be there: of what some configuration destroys, that it is gone.
    fn to_look_at(&self) -> Vec<ComponentName> {
        let there = self.world.system.graph().node_weights().map(|node| node.name);
        let mut all: Vec<ComponentName> = there.chain(self.given.claims.components()).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// A whole round at once, and waited for: for who is about to act on what it finds.
    pub(super) fn compare_all(&mut self) {
        let busy = self.not_to_be_judged();
        let names = self.to_look_at().into_iter().filter(|name| !busy.contains(name));
        let components: Vec<_> = names.map(|name| (name, self.generation(name))).collect();
        let names: Vec<ComponentName> = components.iter().map(|(name, _)| *name).collect();
        for (names, components) in
            names.chunks(limits::OBSERVED_AT_ONCE).zip(components.chunks(limits::OBSERVED_AT_ONCE))
        {
            let Some(PoolReply::Observed(Ok(seen))) = self.ask(PlatformCall::ObserveSome(names.to_vec())) else {
                return;
            };
            self.compare(components, seen);
        }
    }

    /// Components that something is under way with, or of which it is known that they are not as they should be.
    fn not_to_be_judged(&self) -> FxHashSet<ComponentName> {
        let running = self.running.iter().flat_map(|running| running.machine.components());
        let broken = self.world.broken.iter().flat_map(|broken| broken.components.iter().copied());
        running.chain(broken).chain(self.world.quarantined.iter().copied()).chain(self.suspects.reported()).collect()
    }

    /// Compares what was seen with the model. True: it differs.
    fn compare(&mut self, components: &[(ComponentName, Option<u64>)], mut seen: Snapshot) -> bool {
        let mut busy = self.not_to_be_judged();
        for (name, generation) in components {
            if self.generation(*name) != *generation {
                busy.insert(*name);
            }
        }
        // A fault is looked at like one that was reported.
        for (name, one) in &seen.components {
            let node = self.world.system.component(*name);
            if one.state == RunState::Faulted && node.is_some_and(|node| node.state != RunState::Faulted) {
                self.suspects.report(*name);
                busy.insert(*name);
            }
        }
        let still = |name: &ComponentName| !busy.contains(name);
        let names: Vec<ComponentName> = components.iter().map(|(name, _)| *name).filter(still).collect();
        let mut expected = self.world.system.snapshot_some(&names);
        for snapshot in [&mut seen, &mut expected] {
            snapshot.components.retain(|name, _| still(name));
            snapshot.connections.retain(|(from, to), _| still(&from.component) && still(&to.component));
            snapshot.ports.retain(|port, _| still(&port.component));
        }
        if seen == expected {
            return false;
        }
        // Connections to what is not judged stay as the model has them.
        let model = self.world.system.snapshot_some(&names).connections;
        seen.connections
            .extend(model.into_iter().filter(|((from, to), _)| !still(&from.component) || !still(&to.component)));
        self.differs(&names, &seen)
    }

    /// What was seen differs: it is broken from now on, and who wrote it last is lost. False: it does not differ in anything
    /// that a step could bring about.
    fn differs(&mut self, names: &[ComponentName], seen: &Snapshot) -> bool {
        let mut actual = self.world.system.clone();
        if actual.adopt(names, seen).is_err() {
            return false;
        }
        let steps = system::diff(&self.world.system, &actual);
        if steps.is_empty() {
            return false;
        }
        let mut components: Vec<ComponentName> = steps.iter().flat_map(touch::components).collect();
        components.sort_unstable();
        components.dedup();
        // What only leads to where something may be set, and back, is no difference.
        let state = |of: &system::System, name| of.component(name).map(|node| node.state);
        let differs = |step: &&Step| {
            !matches!(step, Step::State { component, .. }
                if state(&self.world.system, *component) == state(&actual, *component))
        };
        let mut losers: Vec<Arc<Frame>> = Vec::new();
        for step in steps.iter().filter(differs) {
            if let Some(frame) = self.wrote(step, |_| true)
                && losers.iter().all(|known| known.configuration != frame.configuration)
            {
                losers.push(frame);
            }
        }
        let expected = self.world.system.snapshot_some(&components);
        self.world.system = actual;
        self.switches.clear();
        let cause = Reason::SeenOtherwise(steps.clone());
        let residual = Arc::new(Residual { difference: steps, ..Residual::of(cause.clone()) });
        let culprit = losers.first().map(|frame| (frame.configuration, frame.requester));
        // What a stranger did is not taken back unasked.
        let components = components.into_iter().collect();
        self.world.is_otherwise(Broken { culprit, ..Broken::of_nobody(residual.clone(), components, expected) });
        self.changed();
        self.given.tells(|| Progress::Differs(residual));
        for frame in losers {
            self.lose(frame.configuration, cause.clone());
        }
        true
    }

    /// The newest of some frames that wrote what a step would change.
    pub(super) fn wrote(&self, step: &Step, of: impl Fn(&Frame) -> bool) -> Option<Arc<Frame>> {
        let slots = touches(step, None, &self.world.system);
        let writes = |footprint: &Footprint| {
            let mut own = footprint.touches.iter().filter(|touch| touch.access != Access::Need);
            own.any(|own| {
                slots.iter().filter(|touch| touch.access != Access::Need).any(|touch| own.slot.overlaps(touch.slot))
            })
        };
        let mut frames = self.world.stack.frames().iter().rev();
        frames.find(|frame| of(frame) && writes(&frame.footprint)).cloned()
    }
}
