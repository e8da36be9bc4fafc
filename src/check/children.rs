//! Subsystems as those know them who follow their parent, and as a state has them.

use super::belief::Beliefs;
use super::reactions::{Macrostep, Reactions};
use super::state::ProductState;
use super::uncertain::uncertain_events;
use crate::model::subsystem::IGNORED;
use crate::model::{
    Ask, ConfigId, Configuration, Deployment, EventName, Ident, Statechart, Subsystem, SubsystemStanding,
};
use crate::stack::{Requester, claims};
use crate::statechart::{Chart, compile};
use rustc_hash::FxHashSet;
use std::collections::BTreeSet;

/// How a parent knows a subsystem.
#[derive(Debug, Clone)]
pub struct Child {
    /// Its name.
    pub path: Ident,
    /// The event that begins it.
    pub begins: EventName,
    /// From this one on what it exports is there.
    pub from: EventName,
    pub up: EventName,
    /// Until the parent raises this one.
    pub until: EventName,
    /// What it tells when it wants to leave.
    pub leaves: Option<EventName>,
    pub down: EventName,
    /// The event that ends it.
    pub ends: EventName,
    /// It may take that where nobody has begun it, and tells then when it is down.
    pub ends_unbegun: bool,
    /// It tells this where it ignores the event that ends it, as far as it is known where it does.
    pub ignores: Option<EventName>,
    /// A state in which it ignores that though it is not down; none: nowhere.
    pub deaf: Option<String>,
    /// It does so only while it is led down: if that was raised once since it was begun, it is down where it ignores it.
    pub deaf_once_ended: bool,
    /// Configurations that touch what it exports.
    pub touching: FxHashSet<ConfigId>,
    /// What it may hold for itself.
    pub holds: BTreeSet<String>,
    /// It may do so though nobody has begun it.
    pub unbidden: bool,
    /// It may go somewhere, and tell of it, by another event than the one that begins it.
    pub wakes: bool,
    /// What it tells only where something has failed, or a monitor reports it.
    pub uncertain: BTreeSet<EventName>,
    /// What may be known of it; none: it may tell anything in any order.
    pub beliefs: Option<Beliefs>,
}

/// Of so many subsystems of one file it is known how they stand.
pub const MOST_CHILDREN: usize = 20;

impl Child {
    /// Whether it is kept what it means that it ignores the event that ends it: where nothing else is known of what it may tell.
    pub fn knows_ignored(&self) -> bool {
        self.ignores.is_some() && self.deaf_once_ended && self.beliefs.is_none() && !self.ends_unbegun
    }

    /// Whether this event says that it ignored the event that ends it, and so may say that it is down.
    pub fn is_down_by(&self, name: EventName) -> bool {
        self.ignores == Some(name) && self.knows_ignored()
    }

    /// Whether this event says that it ignored the event that ends it, and it is known to be down by what it has told so far.
    pub fn is_known_down(&self, name: EventName, belief: u32) -> bool {
        let begins = || self.begins.local(self.path).unwrap_or_default();
        let ignored = || name.as_str().strip_suffix(IGNORED) == Some(self.ends.as_str());
        self.beliefs.as_ref().is_some_and(|beliefs| ignored() && beliefs.is_down(belief, begins()))
    }

    /// The subsystems of a file, as its coordinators know them.
    pub fn all(deployment: &Deployment) -> Vec<Self> {
        let of = |subsystem: &Subsystem| {
            let (own, path) = (&*subsystem.own, subsystem.name);
            let from =
                own.interface.from.map_or_else(|| SubsystemStanding::Up.event(path), |(event, _)| event.within(path));
            let leaves = own.interface.leaving.map(|leaving| leaving.says.within(path));
            let until = own.interface.leaving.map_or(own.shutdown.event, |leaving| leaving.until).within(path);
            let touches = |c: &&Configuration| {
                c.id != ConfigId::from(path) && claims::components(c).iter().any(|c| c.local(path).is_some())
            };
            let touching = deployment.configurations.iter().filter(touches).map(|c| c.id).collect();
            let (begins, down) = (own.deploy.event.within(path), SubsystemStanding::Down.event(path));
            let (holds, wakes) = (subsystem.holds.clone(), is_unbidden(subsystem));
            let unbidden = wakes && !holds.is_empty();
            let (up, beliefs) = (SubsystemStanding::Up.event(path), None);
            let (ends, ends_unbegun) = (own.shutdown.event.within(path), ends_unbegun(own));
            let ignores = EventName::new(&format!("{ends}{IGNORED}")).ok();
            let ignores = ignores.filter(|_| own.subsystems.is_empty());
            let at_first = ignores.and_then(|_| deaf(own, false));
            let is_first = at_first.is_some();
            let deaf = at_first.or_else(|| ignores.and_then(|_| deaf(own, true)));
            // That it was ended is kept as that it was let go: of one that leaves it is not known how often.
            let deaf_once_ended = !is_first && (until == ends || deaf.is_none());
            let uncertain = uncertain_events(own).into_iter().map(|event| event.within(path)).collect();
            Self {
                path,
                begins,
                from,
                up,
                until,
                leaves,
                down,
                ends,
                ends_unbegun,
                ignores,
                deaf,
                deaf_once_ended,
                touching,
                holds,
                unbidden,
                wakes,
                uncertain,
                beliefs,
            }
        };
        deployment.subsystems.iter().take(MOST_CHILDREN).map(of).collect()
    }
}

pub fn begun(at: usize) -> u64 {
    1 << at
}

pub fn promised(at: usize) -> u64 {
    1 << (at + MOST_CHILDREN)
}

/// One was begun anew before it was heard to be down: what is heard then may be of the life before.
pub const DOUBT: u64 = 1 << 63;

/// A state in which a subsystem ignores the event that ends it though it is not down, as far as that is known of what its coordinators wait for:
/// before it was raised, or after that as well.
fn deaf(own: &Deployment, after: bool) -> Option<String> {
    let of = |(number, written): (usize, &Statechart)| {
        let unknown = || Some(own.coordinators[number].name.to_string());
        let Some(chart) = compile(written).0.filter(Chart::is_pure) else { return unknown() };
        let Ok(down) = chart.find(&own.coordinators[number].down) else { return unknown() };
        let ends = chart.event(own.shutdown.event);
        let mut reactions = Reactions::new(own, &chart, &[], Requester::Operator, None);
        let Some(first) = reactions.enter() else { return unknown() };
        let (mut known, mut open) = (FxHashSet::from_iter([first.leaf]), vec![first.leaf]);
        while let Some(leaf) = open.pop() {
            if !chart.is_inside(leaf, down) && !reactions.react(leaf, ends).taken {
                return Some(chart.fqn(leaf).to_string());
            }
            let mut events: Vec<_> = chart.events().iter().map(|event| chart.event(*event)).collect();
            events.extend(reactions.offers(leaf).iter());
            for event in events.into_iter().filter(|event| after || *event != ends) {
                let then = reactions.react(leaf, event).leaf;
                if known.insert(then) {
                    open.push(then);
                }
            }
        }
        None
    };
    own.charts().enumerate().find_map(of)
}

/// Whether the event that ends it leads a coordinator of it somewhere, wherever that can come to before it is begun: as far as that is known from
/// where it is at first.
fn ends_unbegun(own: &Deployment) -> bool {
    let leads = |chart: Chart| {
        let mut reactions = Reactions::new(own, &chart, &[], Requester::Operator, None);
        let first = reactions.enter();
        first.is_some_and(|first| reactions.react(first.leaf, chart.event(own.shutdown.event)).taken)
    };
    own.own_part().charts().filter_map(|chart| compile(chart).0).any(leads)
}

/// A coordinator of a file that is not in its *down* state before anybody begins it, by its number.
pub fn not_down_at_first(own: &Deployment) -> Option<usize> {
    let elsewhere = |(number, chart): (usize, &Statechart)| {
        let chart: Chart = compile(chart).0?;
        let down = chart.find(&own.coordinators[number].down).ok()?;
        let leaf = Reactions::new(own, &chart, &[], Requester::Operator, None).enter()?.leaf;
        (!chart.is_inside(leaf, down)).then_some(number)
    };
    own.charts().enumerate().find_map(elsewhere)
}

/// Whether a subsystem, or one inside it, goes somewhere from where it is down by anything but the event that begins it, or an operator may
/// apply something there. Where the event that ends it leads, without asking for anything, it is to be down.
pub fn is_unbidden(subsystem: &Subsystem) -> bool {
    let own = &*subsystem.own;
    let wakes = |chart: &Chart| {
        let (begins, ends) = (chart.event(own.deploy.event), chart.event(own.shutdown.event));
        let mut reactions = Reactions::new(own, chart, &[], Requester::Operator, None);
        let Some(first) = reactions.enter() else { return true };
        let applies = |step: &Macrostep| {
            let mut asked = step.handed.iter().flat_map(|batch| &batch.requests);
            asked.any(|request| matches!(request.ask, Ask::Apply(_)))
        };
        let mut events: Vec<_> = chart.events().iter().map(|event| chart.event(*event)).collect();
        events.extend(reactions.offers(first.leaf).iter());
        let mut others = events.into_iter().filter(|event| *event != begins);
        applies(&first)
            || others.any(|event| {
                let step = reactions.react(first.leaf, event);
                step.leaf != first.leaf && event != ends || applies(&step)
            })
    };
    own.operator_applies().next().is_some()
        || own.own_part().charts().filter_map(|chart| compile(chart).0).any(|chart| wakes(&chart))
        || own.subsystems.iter().any(is_unbidden)
}

/// The parent has let it go, and it was not down since.
pub fn released(at: usize) -> u64 {
    1 << (at + 2 * MOST_CHILDREN)
}

/// A subsystem with the numbers of its coordinators.
#[derive(Debug, Clone)]
pub struct WatchedSubsystem {
    pub path: Ident,
    /// The event that begins it.
    pub begins: EventName,
    /// The one that ends it.
    pub ends: EventName,
    pub members: Vec<usize>,
}

/// Of so many subsystems it is known what was told of them.
const MOST: usize = 21;

/// What was told, as a state has it: nothing since it was begun, or one of these; at first *down*.
const TOLD: [Option<SubsystemStanding>; 5] = [
    Some(SubsystemStanding::Down),
    None,
    Some(SubsystemStanding::Up),
    Some(SubsystemStanding::Failed),
    Some(SubsystemStanding::Stranded),
];

impl WatchedSubsystem {
    /// The subsystems of a deployment that is put together, by the coordinators of these names.
    pub fn all(deployment: &Deployment, names: &[(Ident, Option<Ident>)]) -> Vec<Self> {
        if deployment.own.is_none() {
            return Vec::new();
        }
        let of = |path: Ident| (0..names.len()).filter(|number| names[*number].1 == Some(path)).collect::<Vec<_>>();
        let all = deployment.all_subsystems().into_iter().map(|(path, subsystem)| {
            let (begins, ends) = (subsystem.own.deploy.event.within(path), subsystem.own.shutdown.event.within(path));
            Self { path, begins, ends, members: of(path) }
        });
        all.filter(|watched| !watched.members.is_empty()).take(MOST).collect()
    }
}

pub fn told(state: &ProductState, at: usize) -> Option<SubsystemStanding> {
    TOLD.get((state.children >> (3 * at) & 7) as usize).copied().flatten()
}

pub fn tell(state: &mut ProductState, at: usize, now: Option<SubsystemStanding>) {
    let number = TOLD.iter().position(|told| *told == now).unwrap_or_default() as u64;
    state.children = state.children & !(7 << (3 * at)) | number << (3 * at);
}
