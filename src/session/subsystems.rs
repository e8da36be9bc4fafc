//! The subsystems of a deployment that runs (semantics: *Composition*): who hears what, and what a parent is told without anybody writing it.

use super::held::SafeOnes;
use super::hub::Hub;
use super::log::{Happening, Phase, SubsystemStatus};
use super::routes::Junction;
use crate::configurator::Requester;
use crate::coordinator::{Class, CoordinatorHandle, Incoming, Tag};
use crate::limits;
use crate::model::subsystem::{IGNORED, SeenStanding, standing};
use crate::model::{Deployment, EventName, Ident, SubsystemStanding};
use crate::statechart::NodeId;
use crate::time::{Clock, Signal, Time, lock};
use rustc_hash::FxHashMap;
use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

/// A subsystem of a deployment.
#[derive(Debug)]
struct KnownSubsystem {
    path: Ident,
    /// That of its parent; none: the deployment itself.
    parent: Option<Ident>,
    begins: EventName,
    up_within: Duration,
    ends: EventName,
    down_within: Duration,
    /// Its coordinators, with the states that count.
    coordinators: Vec<(Requester, Counting)>,
}

/// The names of states of a coordinator.
#[derive(Debug)]
struct Counting {
    up: String,
    failed: Vec<String>,
    down: String,
}

/// What is known of a subsystem.
#[derive(Debug, Default)]
struct SubsystemLife {
    told: Option<SubsystemStanding>,
    /// When it has to be up, and down.
    up_until: Option<Time>,
    down_until: Option<Time>,
    /// Since when that counts.
    since: Time,
    /// The one or the other is over, and nothing safe holds it.
    is_late: bool,
    /// It is over, and something safe holds it.
    is_held: bool,
    /// It was down with nothing left, and has asked for nothing since.
    empty: bool,
}

impl SubsystemLife {
    /// When its time is over, if one runs.
    fn until(&self) -> Option<Time> {
        self.up_until.or(self.down_until)
    }

    /// In one word: what was told last, but for one that is on its way.
    fn standing(&self) -> &'static str {
        match self.told {
            Some(SubsystemStanding::Stranded) if self.up_until.is_none() => SubsystemStanding::Stranded.word(),
            _ if self.down_until.is_some() => Phase::ShuttingDown.as_str(),
            Some(SubsystemStanding::Failed) => SubsystemStanding::Failed.word(),
            Some(told) if self.up_until.is_none() => told.word(),
            _ => Phase::Deploying.as_str(),
        }
    }
}

/// An event that a subsystem may take or not.
#[derive(Debug, Clone, Copy)]
struct OfferedToSubsystem {
    ticket: u64,
    event: EventName,
    by: Requester,
    tag: Option<Tag>,
}

/// The subsystems.
pub(super) struct Subsystems {
    all: Vec<KnownSubsystem>,
    /// The subsystem that components with this path are in.
    paths: FxHashMap<&'static str, Ident>,
    /// As what an event is heard that something in a subsystem raises, as far as somebody there waits for it.
    heard: FxHashMap<(Ident, EventName), EventName>,
    /// The same of others, as they are raised.
    unheard: Mutex<FxHashMap<(Ident, EventName), EventName>>,
    /// Safety events that are given on.
    safety: FxHashMap<EventName, Vec<EventName>>,
    /// Events that a parent may raise.
    accepted: FxHashMap<EventName, usize>,
    /// The paths of coordinators.
    of: FxHashMap<Requester, Ident>,
    lives: Mutex<Vec<SubsystemLife>>,
    safe: SafeOnes,
    offered: Mutex<Vec<OfferedToSubsystem>>,
    clock: Clock,
    wake: Signal,
}

impl Subsystems {
    /// Those of a deployment.
    pub fn new(deployment: &Deployment, clock: &Clock) -> Self {
        let all = deployment.all_subsystems();
        let mut known = Vec::new();
        let (mut paths, mut heard, mut safety, mut accepted) =
            (FxHashMap::default(), FxHashMap::default(), FxHashMap::default(), FxHashMap::default());
        let mut give_on = |from: EventName, to: EventName| safety.entry(from).or_insert_with(Vec::new).push(to);
        for (path, subsystem) in &all {
            let own = &*subsystem.own;
            let parent = path.as_str().rsplit_once('/').map(|(parent, _)| parent);
            let parent = parent.and_then(|parent| all.iter().map(|(path, _)| *path).find(|of| of.as_str() == parent));
            paths.insert(path.as_str(), *path);
            for chart in own.coordinators.iter().filter(|coordinator| coordinator.of.is_none()) {
                for event in chart.chart.waited_for() {
                    heard.insert((*path, event), event.within(*path));
                }
            }
            let accepts = own.interface.accepts.iter().map(|(event, _)| *event);
            for event in accepts.chain([own.deploy.event, own.shutdown.event]) {
                accepted.insert(event.within(*path), known.len());
            }
            // To every child, whatever lies between.
            for (event, _) in &own.safety {
                let theirs = event.within(*path);
                let above = std::iter::once((None, deployment)).chain(
                    all.iter().filter(|(of, _)| path.local(*of).is_some()).map(|(of, above)| (Some(*of), &*above.own)),
                );
                for (of, above) in above {
                    if above.own_part().safety.iter().any(|(declared, _)| declared == event) {
                        give_on(of.map_or(*event, |of| event.within(of)), theirs);
                    }
                }
            }
            let counting = deployment.coordinators.iter().filter(|coordinator| coordinator.of == Some(*path));
            known.push(KnownSubsystem {
                path: *path,
                parent,
                begins: own.deploy.event.within(*path),
                up_within: own.deploy.within,
                ends: own.shutdown.event.within(*path),
                down_within: own.shutdown.within,
                coordinators: counting
                    .map(|own| {
                        let states =
                            Counting { up: own.up.clone(), failed: own.failed.clone(), down: own.down.clone() };
                        (Requester::Coordinator(own.name.into()), states)
                    })
                    .collect(),
            });
        }
        let of = deployment
            .coordinators
            .iter()
            .filter_map(|coordinator| Some((Requester::Coordinator(coordinator.name.into()), coordinator.of?)))
            .collect();
        let lives = Mutex::new(
            known
                .iter()
                .map(|_| SubsystemLife { told: Some(SubsystemStanding::Down), empty: true, ..SubsystemLife::default() })
                .collect(),
        );
        let (clock, wake) = (clock.clone(), clock.signal());
        let (unheard, offered) = (Mutex::default(), Mutex::default());
        let safe = SafeOnes::new(deployment.configurations.iter().filter(|of| of.safe).map(|of| of.id));
        Self { all: known, paths, heard, unheard, safety, accepted, of, lives, safe, offered, clock, wake }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// An event of a component as it is heard: in the subsystem that the component is in, and nowhere else.
    pub fn heard_of(&self, component: &str, event: EventName) -> EventName {
        if self.is_empty() {
            return event;
        }
        let path = component.rsplit_once('/').and_then(|(path, _)| self.paths.get(path));
        match path {
            Some(path) if event.local(*path).is_none() => {
                let known = self.heard.get(&(*path, event)).copied();
                known.unwrap_or_else(|| self.unheard_of(*path, event))
            }
            _ => event,
        }
    }

    /// The same of an event that no coordinator there waits for: its name is made once, not each time it is raised.
    fn unheard_of(&self, path: Ident, event: EventName) -> EventName {
        let mut unheard = lock(&self.unheard);
        if let Some(known) = unheard.get(&(path, event)) {
            return *known;
        }
        let name = event.within(path);
        if unheard.len() < limits::HEARD {
            unheard.insert((path, event), name);
        }
        name
    }

    /// The path of the subsystem whose coordinators an event is for; none: those of the deployment itself.
    pub fn path_of(&self, event: EventName) -> Option<Ident> {
        if self.is_empty() {
            return None;
        }
        let text = event.as_str();
        text.rmatch_indices('/').find_map(|(at, _)| self.paths.get(&text[..at]).copied())
    }

    /// Whether an event of that path is for a coordinator. What is emitted goes another way.
    pub fn is_for(&self, path: Option<Ident>, coordinator: Requester) -> bool {
        self.of.get(&coordinator).copied() == path
    }

    /// The safety events of subsystems that one is given on as.
    pub fn given_on(&self, event: EventName) -> &[EventName] {
        self.safety.get(&event).map_or(&[], Vec::as_slice)
    }

    /// A coordinator asks for something: it is not down any more.
    pub fn asks(&self, by: Requester) {
        let Some(path) = self.of.get(&by) else { return };
        let mut lives = lock(&self.lives);
        for (known, life) in self.all.iter().zip(lives.iter_mut()) {
            if known.path == *path || path.local(known.path).is_some() {
                life.empty = false;
            }
        }
    }

    /// A coordinator takes an event up: it may be the one that begins or ends its subsystem. Answers which, and whether it ends it.
    pub fn takes_up(&self, by: Requester, event: EventName) -> Option<(Ident, bool)> {
        let path = self.of.get(&by)?;
        let known = self.all.iter().find(|known| known.path == *path)?;
        (event == known.begins || event == known.ends).then_some((*path, event == known.ends))
    }

    /// It was that event, and a transition has taken it or none has: from then on its time counts. Begun anew it is told anew how the subsystem
    /// stands; where nobody had begun it, who ends it is told all the same when it is down. What nothing takes begins nothing, and ends nothing that
    /// is down.
    pub fn led(&self, path: Ident, ends: bool, heeded: bool) {
        let Some(at) = self.all.iter().position(|known| known.path == path) else { return };
        let (known, now) = (&self.all[at], self.clock.now());
        let mut lives = lock(&self.lives);
        let life = &mut lives[at];
        let is_down = life.told == Some(SubsystemStanding::Down);
        match ends {
            false if heeded => {
                (life.up_until, life.down_until, life.told) = (Some(now + known.up_within), None, None);
                (life.since, life.is_late, life.is_held) = (now, false, false);
            }
            true if heeded || !is_down => {
                (life.down_until, life.up_until) = (Some(now + known.down_within), None);
                (life.since, life.is_late, life.is_held) = (now, false, false);
                life.told.take_if(|_| is_down);
            }
            _ => return,
        }
        drop(lives);
        self.wake.notify();
    }

    /// All coordinators of a subsystem are down, and nothing is left of it. One of them may have asked for something meanwhile: then it is
    /// told again when that is over.
    pub fn emptied(&self, path: Ident, hub: &Hub, junction: &Junction) {
        let inside = |of: &Ident| *of == path || of.local(path).is_some();
        let mut own = self.of.iter().filter(|(_, of)| inside(of));
        if !own.all(|(by, _)| hub.has_answered(*by)) {
            return;
        }
        if let Some(at) = self.all.iter().position(|known| known.path == path) {
            lock(&self.lives)[at].empty = true;
            self.look_at(at, hub, junction);
        }
    }

    /// Something has changed that may be told of whoever asks under that name.
    pub fn look(&self, by: Requester, hub: &Hub, junction: &Junction) {
        let Some(path) = self.of.get(&by) else { return };
        if let Some(at) = self.all.iter().position(|known| known.path == *path) {
            self.look_at(at, hub, junction);
        }
    }

    /// How they stand.
    pub fn view(&self) -> Vec<SubsystemStatus> {
        let lives = lock(&self.lives);
        let all = self.all.iter().zip(lives.iter());
        let view = |(known, life): (&KnownSubsystem, &SubsystemLife)| SubsystemStatus {
            name: known.path.to_string(),
            standing: life.standing(),
            coordinators: known.coordinators.iter().map(|(name, _)| name.to_string()).collect(),
        };
        all.map(view).collect()
    }

    fn look_at(&self, at: usize, hub: &Hub, junction: &Junction) {
        let known = &self.all[at];
        let seen = self.seen(known, hub, junction);
        let told = {
            let mut lives = lock(&self.lives);
            let life = &mut lives[at];
            let seen = SeenStanding {
                down: seen.down && life.empty,
                late: life.is_late && life.up_until.is_some(),
                stranded: life.is_late && life.down_until.is_some(),
                ..seen
            };
            let told = standing(life.told, seen);
            if told.is_some() {
                life.told = told;
            }
            match told {
                Some(SubsystemStanding::Up) => life.up_until = None,
                // What is down is late no more.
                Some(SubsystemStanding::Down) => (life.down_until, life.up_until) = (None, None),
                _ => {}
            }
            told
        };
        let Some(told) = told else { return };
        let event = told.event(known.path);
        hub.note(Happening::Event { event: event.to_string(), from: known.path.to_string(), safety: false });
        junction.give_to(hub, known.parent, Incoming::new(Class::Report, event));
    }

    fn seen(&self, known: &KnownSubsystem, hub: &Hub, junction: &Junction) -> SeenStanding {
        let mut seen = SeenStanding { up: true, down: true, ..SeenStanding::default() };
        let before = hub.epoch();
        for (name, states) in &known.coordinators {
            let Some(coordinator) = junction.coordinator(*name) else { return SeenStanding::default() };
            let rest = coordinator.is_settled() && hub.has_answered(*name);
            seen.up &= rest && is_in(&coordinator, &states.up);
            seen.down &= rest && is_in(&coordinator, &states.down);
            seen.failed |= states.failed.iter().any(|state| is_in(&coordinator, state));
        }
        // What is seen between two equal counts was so at one moment; else whoever changed it lets it be looked at again.
        if known.coordinators.len() > 1 && hub.epoch() != before {
            SeenStanding { failed: seen.failed, ..SeenStanding::default() }
        } else {
            seen
        }
    }

    /// An event that a parent raises, with the number under which it is given; none: nobody needs to be told.
    pub fn offers(&self, hub: &Hub, event: EventName, by: Requester, tag: Option<Tag>, to: usize) -> Option<u64> {
        self.accepted.get(&event)?;
        let mut offered = lock(&self.offered);
        if offered.len() >= limits::OFFERED {
            return None;
        }
        let ticket = hub.ticket(to);
        offered.push(OfferedToSubsystem { ticket, event, by, tag });
        Some(ticket)
    }

    /// Tells of events that no transition took.
    pub fn tell_ignored(&self, hub: &Hub, junction: &Junction) {
        if self.is_empty() {
            return;
        }
        let mut ignored = Vec::new();
        lock(&self.offered).retain(|of| match hub.was_heard(of.ticket) {
            None => true,
            Some(heard) => {
                hub.forget(of.ticket);
                ignored.extend((!heard).then_some(*of));
                false
            }
        });
        for of in ignored {
            let event = EventName::new(&format!("{}{IGNORED}", of.event)).expect("an event with a suffix is one");
            hub.note(Happening::Event { event: event.to_string(), from: "configurator".to_owned(), safety: false });
            if let Some(coordinator) = junction.coordinator(of.by) {
                // In the order of what else the subsystem tells.
                hub.taken(coordinator.deliver(Incoming::new(Class::Report, event).tagged(of.tag)));
            }
        }
    }

    /// Starts what looks whether a time is over. It ends with the junction.
    pub fn watch(self: &Arc<Self>, hub: &Arc<Hub>, junction: &Arc<Junction>) {
        if self.is_empty() {
            return;
        }
        let (own, hub, junction): (_, _, Weak<Junction>) = (self.clone(), hub.clone(), Arc::downgrade(junction));
        self.clock.spawn("subsystems", move || {
            loop {
                // One that is over meanwhile is looked at at once.
                let of = |life: &SubsystemLife| life.until().filter(|_| !life.is_late);
                let next = lock(&own.lives).iter().filter_map(of).min();
                own.wake.wait(next.map_or(Time::NEVER, |over| own.safe.next_look(over, own.clock.now())));
                let Some(junction) = junction.upgrade() else { return };
                if junction.is_closed() {
                    return;
                }
                own.times_are_over(&hub, &junction);
                (0..own.all.len()).for_each(|at| own.look_at(at, &hub, &junction));
            }
        });
    }

    /// Those are late whose time is over. Where something safe holds one that came since its time began, it waits for people; its time begins anew when
    /// they let go.
    fn times_are_over(&self, hub: &Hub, junction: &Junction) {
        let now = self.clock.now();
        let is_over = |until: Time| self.safe.has_come(until, now, || junction.has_reacted(hub));
        let over = |life: &SubsystemLife| life.until().filter(|until| !life.is_late && is_over(*until));
        if !lock(&self.lives).iter().any(|life| over(life).is_some()) {
            return;
        }
        let configurator = lock(&junction.configurator).clone();
        let seen = hub.epoch();
        let frames = self.safe.frames(&self.clock, configurator.as_ref());
        for (at, known) in self.all.iter().enumerate() {
            let (until, since, within) = {
                let life = &lock(&self.lives)[at];
                let Some(until) = over(life) else { continue };
                (until, life.since, if life.up_until.is_some() { known.up_within } else { known.down_within })
            };
            let held = self.safe.hold(hub, frames.as_deref(), known.path, since);
            // What came while the frames were asked for is heard first.
            if !held && (!is_over(until) || hub.epoch() != seen && now < until + limits::VIEW) {
                continue;
            }
            let life = &mut lock(&self.lives)[at];
            // It may have been begun, or ended, meanwhile.
            if life.until() == Some(until) {
                let was_held = std::mem::replace(&mut life.is_held, held);
                life.is_late = !held && !was_held;
                let next = now + if held { within.min(limits::HELD_LOOK) } else { within };
                if !life.is_late {
                    life.up_until.iter_mut().chain(&mut life.down_until).for_each(|until| *until = next);
                }
            }
        }
    }

    /// Ends that.
    pub fn close(&self) {
        self.wake.notify();
    }
}

fn is_in(coordinator: &CoordinatorHandle, state: &str) -> bool {
    let node: Option<NodeId> = coordinator.chart().find(state).ok();
    node.is_some_and(|node| coordinator.is_active(node))
}

/// The subsystems of a deployment with the names under which all their coordinators ask, those of what is in them too.
pub(super) fn scopes(deployment: &Deployment) -> Vec<(Ident, Vec<Requester>)> {
    let inside = |path: Ident| {
        let own = deployment.coordinators.iter();
        let own = own.filter(move |c| c.of.is_some_and(|of| of == path || of.local(path).is_some()));
        own.map(|c| Requester::Coordinator(c.name.into())).collect()
    };
    deployment.all_subsystems().into_iter().map(|(path, _)| (path, inside(path))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_subsystem_stands_as_was_told_last_but_on_its_way() {
        let (up, down) = (Some(SubsystemStanding::Up), Some(SubsystemStanding::Down));
        let life = |told, up_until: Option<u64>, down_until: Option<u64>| SubsystemLife {
            told,
            up_until: up_until.map(Time),
            down_until: down_until.map(Time),
            since: Time::default(),
            is_late: false,
            is_held: false,
            empty: false,
        };
        let failed = Some(SubsystemStanding::Failed);
        let stranded = Some(SubsystemStanding::Stranded);
        for (told, up_until, down_until, word) in [
            (down, None, None, "down"),
            (None, Some(5), None, "deploying"),
            (up, None, None, "up"),
            // A bring-up that is late is told of while it goes on.
            (failed, Some(5), None, "failed"),
            (up, None, Some(9), "shutting_down"),
            (failed, None, Some(9), "shutting_down"),
            (None, None, Some(9), "shutting_down"),
            (stranded, None, Some(9), "stranded"),
            // Begun anew.
            (stranded, Some(5), None, "deploying"),
        ] {
            assert_eq!(life(told, up_until, down_until).standing(), word, "{told:?} {up_until:?} {down_until:?}");
        }
    }
}
