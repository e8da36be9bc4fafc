//! What a subsystem exports is there while that is promised: from the event that says so until its parent has let go. The parent is held
//! to it here: it asks for what touches it only then, and holds no frame of it any more when the promise ends. The file of the subsystem
//! is in [`exports`](super::exports).

use super::children::{Child, DOUBT, begun, promised, released};
use super::explore::Graph;
use super::judge::{Traced, severity_of};
use super::product::Product;
use super::reactions::{Emitted, triggers};
use super::seldom::RaisedForChild;
use super::state::{Failed, ProductState, index};
use crate::model::codes::{COMPOSE_PROMISE, COMPOSE_UNLEFT};
use crate::model::subsystem::IGNORED;
use crate::model::{Ask, ConfigId, EventName, Finding, Ident, OperatorMay, Origin, Severity};
use crate::statechart::{EventId, NodeId};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Whether that a subsystem ignores the event that ends it says that it is down: it ignores that nowhere else, or was ended once since it was begun.
fn is_over(state: &ProductState, child: &Child, at: usize) -> bool {
    let ended = state.children & (begun(at) | promised(at) | released(at));
    child.deaf.is_none() || ended == begun(at) | released(at) || state.children & begun(at) == 0
}

/// The event that begins, or ends, a subsystem is raised: kept in what else cannot be of one. It is *released* and *promised* where that was
/// raised once more since it was ended, and *released* though not begun where it was ended so.
fn raised_anew(state: &mut ProductState, at: usize, begins: bool, ends: bool) {
    let (is_begun, is_released) = (state.children & begun(at) != 0, state.children & released(at) != 0);
    match (is_begun, is_released) {
        (true, true) if begins || ends => state.children |= promised(at),
        (false, false) if ends => state.children = state.children & !promised(at) | released(at),
        (false, true) if begins => state.children &= !released(at),
        _ => {}
    }
}

/// That an event was ignored may still be told of this life of the subsystem, or of one before.
const OF_THIS_LIFE: u64 = 1;
const OF_ANOTHER: u64 = 2;

/// Of so many events that end one subsystem it is kept that it may still be told that they were ignored; of more it may be of another life.
const MOST_ENDS: usize = 4;

/// The event that begins, or ends, a subsystem is raised, which that may tell to have ignored: to this state of who raised it, while it is not left.
fn may_be_ignored(state: &mut ProductState, child: &Child, (by, emitted): (usize, Emitted)) {
    let (begins, ends) = (emitted.event == child.begins, emitted.event == child.ends);
    if begins && state.offered.iter().any(|of| of.event == child.ends) {
        state.change(|seldom| seldom.offered.update(|of| of.event == child.ends, |of| of.waits = OF_ANOTHER));
    }
    if let (true, Some(owner)) = (ends, emitted.owner) {
        let many = state.offered.iter().filter(|of| of.event == child.ends).count() >= MOST_ENDS;
        let raised = RaisedForChild { event: child.ends, by: index(by), owner, waits: OF_THIS_LIFE };
        state.change(|seldom| match many {
            true => seldom.offered.update(|of| of.event == child.ends, |of| of.waits = OF_ANOTHER),
            false => seldom.offered.push(raised),
        });
    }
}

/// A coordinator hears that one of those was ignored: whether that is of this life.
fn is_of_this_life(state: &mut ProductState, child: &Child, by: usize) -> bool {
    let own = |of: &RaisedForChild| of.event == child.ends && of.by == index(by);
    let Some(at) = state.offered.iter().position(own) else { return false };
    state.change(|seldom| seldom.offered.remove(at)).waits == OF_THIS_LIFE
}

impl Product<'_> {
    /// An event is heard, or would be if anybody waited for it: it may tell how a subsystem stands.
    pub(super) fn hears_of_child(&self, state: &mut ProductState, by: usize, name: EventName) {
        for (at, child) in self.children.iter().enumerate() {
            if name == child.from || name == child.up {
                // What comes after it was let go may have been told before.
                if state.children & released(at) == 0 {
                    state.children |= promised(at);
                }
            } else if child.is_down_by(name) && is_of_this_life(state, child, by) && is_over(state, child, at) {
                // That it is down may be told behind that.
                let down = if state.children & begun(at) != 0 { promised(at) | released(at) } else { 0 };
                state.children = state.children & !(promised(at) | begun(at) | released(at)) | down;
            } else if name == child.down
                || child.is_known_down(name, state.beliefs.get(at).copied().unwrap_or_default())
            {
                state.children &= !(promised(at) | begun(at) | released(at));
            }
        }
    }

    /// A coordinator raises an event: it may be for a subsystem.
    pub(super) fn tells_child(&mut self, state: &mut ProductState, by: usize, emitted: Emitted) {
        let name = emitted.event;
        for (at, child) in self.children.iter_mut().enumerate() {
            if let (Some(beliefs), Some(own)) = (&mut child.beliefs, name.local(child.path))
                && let Ok(own) = EventName::new(own)
            {
                let belief = state.beliefs.get(at).copied().unwrap_or_default();
                let (then, lost) = beliefs.raised(belief, own);
                state.beliefs.set(at, then);
                if lost && name == child.until && state.children & begun(at) != 0 {
                    state.told.push(name);
                }
            }
            if child.knows_ignored() {
                may_be_ignored(state, child, (by, emitted));
            }
            if child.knows_ignored() && child.deaf.is_some() {
                raised_anew(state, at, name == child.begins, name == child.ends);
            }
            if name == child.begins {
                if state.children & begun(at) == 0 {
                    state.children &= !(promised(at) | released(at));
                }
                if state.children & begun(at) != 0 && !child.holds.is_empty() {
                    state.children |= DOUBT;
                }
                state.children |= begun(at);
            } else if name == child.ends && child.ends_unbegun && child.beliefs.is_none() {
                // What it tells of that, if it does, is heard.
                state.children |= begun(at);
            }
            if name == child.until && state.children & released(at) == 0 {
                state.children &= !promised(at);
                if state.children & begun(at) != 0 {
                    state.children |= released(at);
                }
            }
        }
    }

    /// Whether what a subsystem exports is promised.
    pub(super) fn is_promised(&self, state: &ProductState, at: usize) -> bool {
        state.children & promised(at) != 0 && state.children & released(at) == 0
    }

    /// Whether an event is one of a subsystem that cannot tell anything: nobody has begun it.
    pub(super) fn is_silent(&self, state: &ProductState, name: EventName) -> bool {
        let mut children = self.children.iter().enumerate();
        let told = |child: &Child| name.local(child.path).is_some_and(|own| !own.ends_with(IGNORED));
        // Where it is known what it may tell, that says so.
        let unknown = |child: &Child| child.beliefs.is_none() || !child.ends_unbegun;
        let silent = |at: usize, child: &Child| {
            let unbegun =
                state.children & begun(at) == 0 && !(name == child.down && state.children & released(at) != 0);
            told(child) && unknown(child) && !child.wakes && unbegun
                // Nothing is ignored that was not raised.
                || child.is_down_by(name) && !state.offered.iter().any(|of| of.event == child.ends)
        };
        children.any(|(at, child)| silent(at, child))
    }

    /// Whether it is known when an event comes that a subsystem tells.
    pub(super) fn is_known(&self, name: EventName) -> bool {
        self.children.iter().any(|child| child.beliefs.is_some() && name.local(child.path).is_some())
    }

    /// Whether a subsystem tells an event.
    pub(super) fn is_told_by_child(&self, name: EventName) -> bool {
        self.children.iter().any(|child| name.local(child.path).is_some())
    }

    /// Whether every subsystem is known to be down.
    pub(super) fn children_down(&self, state: &ProductState) -> bool {
        self.children_up(state).next().is_none()
    }

    /// The subsystem that is to tell by an event that it is down, or ignores the event that ends it, where nothing is known of it but that it
    /// was begun and nobody has ended it.
    pub(super) fn unended(&self, state: &ProductState, name: EventName) -> Option<&Child> {
        let ignores = name.as_str().strip_suffix(IGNORED);
        let told = |(at, child): &(usize, &Child)| {
            let runs = state.children & begun(*at) != 0 && state.children & released(*at) == 0;
            (name == child.down || ignores == Some(child.ends.as_str())) && child.beliefs.is_none() && runs
        };
        self.children.iter().enumerate().find(told).map(|(_, child)| child)
    }

    /// The subsystems that were begun, and of which it is not known that they are down.
    pub(super) fn children_up(&self, state: &ProductState) -> impl Iterator<Item = &Child> {
        self.children.iter().enumerate().filter(|(at, _)| state.children & begun(*at) != 0).map(|(_, child)| child)
    }

    /// What is asked for or in force of what a subsystem exports though that need not be there, and of which subsystem.
    fn unpromised(&self, state: &ProductState) -> Option<(ConfigId, bool, usize)> {
        for (at, child) in self.children.iter().enumerate() {
            if self.is_promised(state, at) || child.touching.is_empty() {
                continue;
            }
            let touches = |id: &ConfigId| child.touching.contains(id);
            let asks = state.desk.under_way().iter().flat_map(|active| &active.batch.requests);
            let asks = asks.chain(state.safe.iter()).filter_map(|request| match request.ask {
                Ask::Apply(id) => Some(id),
                _ => None,
            });
            let held = self.worlds.get(state.world).into_iter().flat_map(|world| world.stack.frames());
            let held = held.map(|frame| (frame.configuration, true));
            if let Some((id, held)) = asks.map(|id| (id, false)).chain(held).find(|(id, _)| touches(id)) {
                return Some((id, held, at));
            }
        }
        None
    }
}

impl Graph<'_, '_> {
    /// A parent keeps to what it is promised.
    pub(super) fn promises(&mut self, found: &mut Traced) {
        if self.product.children.is_empty() {
            return;
        }
        let mut some: FxHashMap<(ConfigId, usize), Vec<u32>> = FxHashMap::default();
        let mut how: FxHashMap<(ConfigId, usize), bool> = FxHashMap::default();
        for (at, state) in (0u32..).zip(&self.states) {
            if self.failed[at as usize] == Failed::Broken {
                continue;
            }
            if let Some((id, held, child)) = self.product.unpromised(state) {
                some.entry((id, child)).or_default().push(at);
                how.entry((id, child)).or_insert(held);
            }
        }
        let mut all: Vec<_> = some.into_iter().collect();
        all.sort_by_key(|((id, child), _)| (id.as_str(), *child));
        for ((id, child), states) in all {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let of = &self.product.children[child];
            let severity = severity_of(self.failed[at as usize]);
            if let Some((member, _)) = id.sets() {
                found.push((self.set_unpromised(severity, id, member, of.path), self.trace(at)));
                continue;
            }
            let message = match how[&(id, child)] {
                true => format!("`{id}` is in force where `{}` need not be there any more, or not yet", of.path),
                false => format!("`{id}` is asked for where what `{}` exports need not be there", of.path),
            };
            let mut help = format!(
                "ask for it when `{}` was heard, and undo it, and wait for that, before `{}` is raised",
                of.from, of.until
            );
            let heard =
                |ignored: EventName| self.product.members.iter().any(|m| m.chart.event(ignored) != EventId::OTHER);
            if let (Some(ignored), Some(deaf)) = (of.ignores.filter(|ignored| heard(*ignored)), &of.deaf) {
                help += &format!(
                    "; `{ignored}` does not say that it is down, for it ignores that in `{deaf}` as well: hear `{}` there too",
                    of.ends.local(of.path).unwrap_or_default()
                );
            }
            if of.beliefs.is_none() {
                help += &format!(
                    "; in which order `{}` tells things is not known here, so it may be that it never comes to that: where it and its parent have fewer states, \
                     that is followed (`--budget` gives room for more)",
                    of.path
                );
            }
            let place = self.product.worlds.configuration(id).map(|c| c.origin).unwrap_or_default();
            let finding =
                Finding::new(severity, COMPOSE_PROMISE, message).at(place).path(format!("configurations.{id}"));
            let trace = self.trace(at);
            found.push((finding.help(help), trace));
        }
    }

    /// An operator may set what a subsystem exports, and waits for nothing.
    fn set_unpromised(&self, severity: Severity, id: ConfigId, member: &str, path: Ident) -> Finding {
        let message =
            format!("an operator may set `{member}` at any time, and what `{path}` exports need not be there");
        let listed = self.product.deployment.operator.iter().find(|(may, _)| *may == OperatorMay::Apply(id));
        let own = member.rsplit_once('/').map_or(member, |(_, own)| own);
        let finding = Finding::new(severity, COMPOSE_PROMISE, message).at(listed.map_or(Origin::NONE, |(_, at)| *at));
        finding.path("operator").help(format!(
            "list it in the file of the subsystem that has it: `operator: [{own}]`; `davit set {member} …` is then its own configurator's to answer"
        ))
    }

    /// What is to come down there waits for a subsystem in which an undo has failed: that one may be stranded.
    pub(super) fn is_stranded(&self, at: u32) -> bool {
        let known = self.product.children.iter().any(|child| child.beliefs.is_some());
        known && self.failed[at as usize] >= Failed::Undo && !self.product.children_down(&self.states[at as usize])
    }

    /// What to do about a state that waits for what a subsystem tells and tells no more.
    pub(super) fn told_before(&self, leaf: NodeId) -> Option<String> {
        let member = &self.product.members[0];
        let waits = triggers(member.chart, leaf).0.into_iter().filter_map(|event| member.name_of(event));
        let told: Vec<String> =
            waits.filter(|name| self.product.is_known(*name)).map(|name| format!("`{name}`")).collect();
        (!told.is_empty()).then(|| {
            format!("{} may have been told before, where nobody waited for it: hear it there as well", told.join(", "))
        })
    }

    /// A parent lets a subsystem go where that waits for it.
    pub(super) fn let_go_in_vain(&mut self, found: &mut Traced) {
        let mut some: BTreeMap<EventName, Vec<u32>> = BTreeMap::new();
        for (at, name) in &self.in_vain {
            if self.failed[*at as usize] == Failed::Nothing {
                some.entry(*name).or_default().push(*at);
            }
        }
        for (name, states) in some {
            let Some(at) = self.best_first(states).first().copied() else { continue };
            let Some(child) = self.product.children.iter().find(|child| child.until == name) else { continue };
            let deployment = self.product.deployment;
            let Some(subsystem) = deployment.subsystems.iter().find(|of| of.name == child.path) else { continue };
            let Some(leaving) = subsystem.own.interface.leaving else { continue };
            let (says, ends) = (leaving.says.within(child.path), subsystem.own.shutdown.event.within(child.path));
            let raises = self.product.members.iter().flat_map(|member| member.chart.raises());
            let site = raises.filter(|site| site.name == name).map(|site| site.origin).next();
            let message = format!("`{name}` is raised where `{}` does not wait for it, and is lost", child.path);
            let finding = Finding::warning(COMPOSE_UNLEFT, message)
                .at(site.unwrap_or_default())
                .also(subsystem.origin, "the subsystem")
                .help(format!("raise `{name}` when `{says}` was heard, which comes of `{ends}` at the latest"));
            let trace = self.trace(at);
            found.push((finding, trace));
        }
    }
}
