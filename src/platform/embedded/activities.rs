//! The activities: activities with the components in them, their threads and the order of updates.

use super::order::along_the_flow;
use super::registry::Registry;
use crate::limits;
use crate::model::{ComponentName, Ident};
use crate::platform::Cause;
use crate::runtime::activity::{ActivityThread, OperationJob, Rounds, Schedule};
use crate::runtime::cell::Cell;
use crate::runtime::latest::{Reader, Writer, latest};
use crate::time::{Clock, Join, Receiver, Sender};
use rustc_hash::FxHashMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// An activity with the components in it.
pub(super) struct ScheduledActivity {
    pub(super) activity: Arc<ActivityThread>,
    pub(super) schedule: Writer<Schedule>,
    pub(super) requests: Sender<OperationJob>,
    /// What its thread will need, until it is started.
    waiting: Option<(Reader<Schedule>, Receiver<OperationJob>)>,
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
    pub(super) fn scheduled(
        &mut self,
        name: Ident,
        make: impl FnOnce() -> ActivityThread,
        clock: &Clock,
    ) -> &mut ScheduledActivity {
        self.activities.entry(name).or_insert_with(|| {
            let (schedule, reader) = latest::<Schedule>(Arc::from([]));
            let (requests, inbox) = clock.channel(limits::ACTIVITY_REQUESTS);
            ScheduledActivity {
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

    pub(super) fn activity_of(&self, slot: u32) -> &ScheduledActivity {
        let name = self.entry(slot).runs_in;
        self.activities.get(&name).expect("the activity of a component lives as long as it")
    }

    pub(super) fn activities(&self) -> impl Iterator<Item = &ScheduledActivity> {
        self.activities.values()
    }

    pub(super) fn cells<'a>(
        &'a self,
        scheduled: &'a ScheduledActivity,
    ) -> impl Iterator<Item = &'a Arc<Cell>> + Clone + 'a {
        scheduled.members.iter().flatten().map(|slot| &self.entry(*slot).cell)
    }

    /// Makes the activity of a component ready to update it: its thread, its place in the schedule.
    pub(super) fn enlist(&mut self, slot: u32, clock: &Clock) -> Result<(), Cause> {
        let name = self.entry(slot).runs_in;
        if let Some(scheduled) = self.activities.get_mut(&name)
            && let Some((reader, inbox)) = scheduled.waiting.take()
        {
            let activity = scheduled.activity.clone();
            let (signal, mut rounds) = (activity.signal.clone(), Rounds::new(reader, inbox));
            let step = move || activity.step(&mut rounds);
            let thread = clock.try_spawn_task(&format!("davit-{name}"), &signal, step);
            scheduled.thread =
                Some(thread.map_err(|error| Cause::Refused(format!("no thread for `{name}`: {error}")))?);
        }
        if self.activities.get(&name).is_some_and(|scheduled| scheduled.unpublished || scheduled.disordered) {
            self.publish(name);
        }
        Ok(())
    }

    /// Gives the activity its components, in order.
    pub(super) fn publish(&mut self, name: Ident) {
        let Some(mut scheduled) = self.activities.remove(&name) else { return };
        scheduled.members.retain(Option::is_some);
        scheduled.holes = 0;
        if scheduled.disordered {
            let slots: Vec<u32> = scheduled.members.iter().flatten().copied().collect();
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
            scheduled.members = order.into_iter().map(|i| Some(slots[i])).collect();
            scheduled.looped = looped;
            scheduled.disordered = false;
        }
        for (i, slot) in scheduled.members.iter().flatten().enumerate() {
            if let Some(entry) = &mut self.slots[*slot as usize] {
                entry.place = u32::try_from(i).unwrap_or(u32::MAX);
            }
        }
        let cells: Schedule = scheduled.members.iter().flatten().map(|slot| self.entry(*slot).cell.clone()).collect();
        scheduled.schedule.write(|schedule| *schedule = cells);
        scheduled.unpublished = false;
        self.activities.insert(name, scheduled);
    }

    /// After a change of the data flow inside an activity: at once if it runs, else with the next start.
    pub(super) fn reorder_if_running(&mut self, name: Ident) {
        if self
            .activities
            .get(&name)
            .is_some_and(|scheduled| scheduled.disordered && scheduled.activity.running.load(Ordering::SeqCst) > 0)
        {
            self.publish(name);
        }
    }

    /// A component that was to be made for an activity has been made, or not, or is waited for no longer.
    pub(super) fn arrived(&mut self, component: ComponentName, name: Ident) {
        if let Some(scheduled) = self.activities.get_mut(&name)
            && let Some(at) = scheduled.expected.iter().position(|expected| *expected == component)
        {
            scheduled.expected.swap_remove(at);
        }
        self.end_if_empty(name);
    }

    /// Ends an activity that has no component any more.
    pub(super) fn end_if_empty(&mut self, name: Ident) {
        if self
            .activities
            .get(&name)
            .is_some_and(|scheduled| scheduled.expected.is_empty() && scheduled.holes == scheduled.members.len())
            && let Some(scheduled) = self.activities.remove(&name)
        {
            self.hide_activity(name);
            scheduled.activity.end();
            // The thread ends by itself, as soon as nothing in it hangs.
            self.ending.retain(|thread| !thread.is_finished());
            self.ending.extend(scheduled.thread);
        }
    }
}
