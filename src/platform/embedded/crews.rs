//! The crews: activities with the components in them, their threads and the order of updates.

use super::order::along_the_flow;
use super::registry::Registry;
use crate::limits;
use crate::model::{ComponentName, Ident};
use crate::platform::Cause;
use crate::runtime::activity::{Activity, Request, Schedule};
use crate::runtime::cell::Cell;
use crate::runtime::latest::{Reader, Writer, latest};
use crate::time::{Clock, Join, Receiver, Sender};
use rustc_hash::FxHashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// An activity with the components in it.
pub(super) struct Crew {
    pub(super) activity: Arc<Activity>,
    pub(super) schedule: Writer<Schedule>,
    pub(super) requests: Sender<Request>,
    /// What its thread will need, until it is started.
    waiting: Option<(Reader<Schedule>, Receiver<Request>)>,
    pub(super) thread: Option<Join>,
    /// The components in the order of updates; none: destroyed.
    pub(super) members: Vec<Option<u32>>,
    pub(super) holes: usize,
    /// Components being made for it.
    pub(super) expected: Vec<ComponentName>,
    pub(super) unpublished: bool,
    pub(super) disordered: bool,
    pub(super) looped: bool,
}

impl Registry {
    pub(super) fn crew(&mut self, name: Ident, make: impl FnOnce() -> Activity, clock: &Clock) -> &mut Crew {
        self.crews.entry(name).or_insert_with(|| {
            let (schedule, reader) = latest::<Schedule>(Arc::from([]));
            let (requests, inbox) = clock.channel(limits::ACTIVITY_REQUESTS);
            Crew {
                activity: Arc::new(make()),
                schedule,
                requests,
                waiting: Some((reader, inbox)),
                thread: None,
                members: Vec::new(),
                holes: 0,
                expected: Vec::new(),
                unpublished: false,
                disordered: false,
                looped: false,
            }
        })
    }

    pub(super) fn crew_of(&self, slot: u32) -> &Crew {
        let name = self.entry(slot).crew;
        self.crews.get(&name).expect("the activity of a component lives as long as it")
    }

    pub(super) fn crews(&self) -> impl Iterator<Item = &Crew> {
        self.crews.values()
    }

    pub(super) fn cells<'a>(&'a self, crew: &'a Crew) -> impl Iterator<Item = &'a Arc<Cell>> + Clone + 'a {
        crew.members.iter().flatten().map(|slot| &self.entry(*slot).cell)
    }

    /// Makes the activity of a component ready to update it: its thread, its place in the schedule.
    pub(super) fn enlist(&mut self, slot: u32, clock: &Clock) -> Result<(), Cause> {
        let name = self.entry(slot).crew;
        if let Some(crew) = self.crews.get_mut(&name)
            && let Some((reader, inbox)) = crew.waiting.take()
        {
            let activity = crew.activity.clone();
            let thread = clock.try_spawn(&format!("davit-{name}"), move || activity.run(reader, &inbox));
            crew.thread = Some(thread.map_err(|error| Cause::Refused(format!("no thread for `{name}`: {error}")))?);
        }
        if self.crews.get(&name).is_some_and(|crew| crew.unpublished || crew.disordered) {
            self.publish(name);
        }
        Ok(())
    }

    /// Gives the activity its components, in order.
    pub(super) fn publish(&mut self, name: Ident) {
        let Some(mut crew) = self.crews.remove(&name) else { return };
        crew.members.retain(Option::is_some);
        crew.holes = 0;
        if crew.disordered {
            let slots: Vec<u32> = crew.members.iter().flatten().copied().collect();
            let place: FxHashMap<ComponentName, usize> =
                slots.iter().enumerate().map(|(i, slot)| (self.entry(*slot).cell.name, i)).collect();
            let edges: Vec<(usize, usize)> = self
                .connections
                .keys()
                .map(|ends| ends.0)
                .filter_map(|(from, to)| Some((*place.get(&from.component)?, *place.get(&to.component)?)))
                .filter(|(from, to)| from != to)
                .collect();
            let names: Vec<ComponentName> = slots.iter().map(|slot| self.entry(*slot).cell.name).collect();
            let (order, looped) = along_the_flow(&names, &edges);
            crew.members = order.into_iter().map(|i| Some(slots[i])).collect();
            crew.looped = looped;
            crew.disordered = false;
        }
        for (i, slot) in crew.members.iter().flatten().enumerate() {
            if let Some(entry) = &mut self.slots[*slot as usize] {
                entry.place = u32::try_from(i).unwrap_or(u32::MAX);
            }
        }
        let cells: Schedule = crew.members.iter().flatten().map(|slot| self.entry(*slot).cell.clone()).collect();
        crew.schedule.write(|schedule| *schedule = cells);
        crew.unpublished = false;
        self.crews.insert(name, crew);
    }

    /// After a change of the data flow inside an activity: at once if it runs, else with the next start.
    pub(super) fn reorder_if_running(&mut self, name: Ident) {
        if self.crews.get(&name).is_some_and(|crew| crew.disordered && crew.activity.running.load(Ordering::SeqCst) > 0)
        {
            self.publish(name);
        }
    }

    /// A component that was to be made for an activity has been made, or not, or is waited for no longer.
    pub(super) fn arrived(&mut self, component: ComponentName, name: Ident) {
        if let Some(crew) = self.crews.get_mut(&name)
            && let Some(at) = crew.expected.iter().position(|expected| *expected == component)
        {
            crew.expected.swap_remove(at);
        }
        self.end_if_empty(name);
    }

    /// Ends an activity that has no component any more.
    pub(super) fn end_if_empty(&mut self, name: Ident) {
        if self.crews.get(&name).is_some_and(|crew| crew.expected.is_empty() && crew.holes == crew.members.len())
            && let Some(crew) = self.crews.remove(&name)
        {
            self.hide_activity(name);
            crew.activity.end();
            // The thread ends by itself, as soon as nothing in it hangs.
            self.ending.retain(|thread| !thread.is_finished());
            self.ending.extend(crew.thread);
        }
    }
}
