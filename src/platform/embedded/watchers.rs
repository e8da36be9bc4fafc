//! Probes given to those who want to see components: put in place when what they look at appears, taken away with it. Who
//! looks is a component (monitors are one), or whoever asked the platform for a [`Watch`].

use super::Inner;
use super::registry::Registry;
use crate::model::{ComponentName, Direction, Ident, MemberRef};
use crate::monitor::{InputSample, MonitorInput};
use crate::platform::Watch;
use crate::runtime::beat::{Beat, Notices};
use crate::runtime::builder::PortEnd;
use crate::runtime::links::LinksSender;
use crate::runtime::probe::{Observed, Probe, ProbeTap, Probes, ProbesEnd};
use crate::runtime::sight::Sight;
use crate::time::{Signal, Time, lock};
use rustc_hash::FxHashMap;
use std::sync::{Arc, Weak};

/// Somebody who looks at components.
pub(super) struct Watcher {
    number: u64,
    /// The component that looks, if one does.
    name: Option<ComponentName>,
    wanted: Arc<[Observed]>,
    places: FxHashMap<Observed, usize>,
    sender: LinksSender<(usize, Probe)>,
    wake: Option<Arc<Beat>>,
    given: Vec<InstalledProbe>,
}

/// A probe that is in place.
struct InstalledProbe {
    number: u64,
    place: usize,
    /// The out-port it is a link of.
    at: Option<MemberRef>,
}

impl Watcher {
    /// Whether it looks at this.
    fn place(&self, wanted: &Observed) -> Option<usize> {
        self.places.get(wanted).copied()
    }

    /// Takes away the probes for which `gone` is true; answers the links they were.
    fn take(&mut self, gone: impl Fn(&InstalledProbe, &Observed) -> bool) -> Vec<(u64, MemberRef)> {
        let mut links = Vec::new();
        let (sender, wanted) = (&mut self.sender, &self.wanted);
        self.given.retain(|given| {
            let gone = gone(given, &wanted[given.place]);
            if gone {
                sender.remove(given.number);
                links.extend(given.at.map(|at| (given.number, at)));
            }
            !gone
        });
        links
    }
}

impl Registry {
    /// A component has come that looks at others: shows it what is there.
    pub(super) fn watch(&mut self, slot: u32, probes: ProbesEnd) {
        let name = self.entry(slot).cell.name;
        self.watch_as(Some(name), probes);
    }

    /// Somebody looks from now on: shows what is there. Answers the number to end it by.
    fn watch_as(&mut self, name: Option<ComponentName>, probes: ProbesEnd) -> u64 {
        let number = self.next_number();
        let ProbesEnd { wanted, sender, wake } = probes;
        let places = wanted.iter().cloned().zip(0..).collect();
        self.watchers.push(Watcher { number, name, wanted, places, sender, wake, given: Vec::new() });
        let present: Vec<u32> =
            (0..self.slots.len()).filter(|i| self.slots[*i].is_some()).filter_map(|i| u32::try_from(i).ok()).collect();
        let watcher = self.watchers.len() - 1;
        for slot in present {
            self.show_to(watcher, slot);
        }
        let connections: Vec<_> = self.connections.keys().map(|ends| ends.0).collect();
        for (from, to) in connections {
            self.show_connection_to(watcher, from, to);
        }
        number
    }

    /// Who looked looks no more.
    fn unwatch(&mut self, number: u64) {
        if let Some(at) = self.watchers.iter().position(|watcher| watcher.number == number) {
            let mut watcher = self.watchers.swap_remove(at);
            self.detach(watcher.take(|_, _| true));
        }
    }

    /// A component has come: shows it to those who look at it.
    pub(super) fn show(&mut self, slot: u32) {
        for watcher in 0..self.watchers.len() {
            self.show_to(watcher, slot);
        }
    }

    fn show_to(&mut self, watcher: usize, slot: u32) {
        let entry = self.entry(slot);
        let (cell, runs_in) = (entry.cell.clone(), entry.runs_in);
        if let Some(place) = self.watchers[watcher].place(&Observed::Component(cell.name)) {
            self.give(watcher, place, None, Probe::Component(cell.clone()));
        }
        if let Some(place) = self.watchers[watcher].place(&Observed::Activity(runs_in))
            && self.watchers[watcher].given.iter().all(|given| given.place != place)
            && let Some(scheduled) = self.activities.get(&runs_in)
        {
            let activity = scheduled.activity.clone();
            self.give(watcher, place, None, Probe::Activity(activity));
        }
        for (index, port) in cell.kind.ports.iter().enumerate() {
            let member = cell.name.member(*port);
            let out = cell.kind.ty.ports.get(port).is_some_and(|ty| ty.direction == Direction::Out);
            if out && let Some(place) = self.watchers[watcher].place(&Observed::Port(member)) {
                self.tap(watcher, place, slot, index, member);
            }
        }
    }

    /// A connection has been made: who looks at its in-port sees what comes through it.
    pub(super) fn show_connection(&mut self, from: MemberRef, to: MemberRef) {
        for watcher in 0..self.watchers.len() {
            self.show_connection_to(watcher, from, to);
        }
    }

    fn show_connection_to(&mut self, watcher: usize, from: MemberRef, to: MemberRef) {
        if let Some(place) = self.watchers[watcher].place(&Observed::Port(to))
            && let Ok(slot) = self.find(from.component)
            && let Ok((index, _)) = self.port(slot, from.member)
        {
            self.tap(watcher, place, slot, index, from);
        }
    }

    /// A connection is being removed.
    pub(super) fn hide_connection(&mut self, to: MemberRef) {
        self.take_probes(|_, wanted| *wanted == Observed::Port(to));
    }

    /// A component is being removed: it looks no more, and is looked at no more.
    pub(super) fn hide(&mut self, slot: u32) {
        let name = self.entry(slot).cell.name;
        if let Some(number) = self.watchers.iter().find(|w| w.name == Some(name)).map(|w| w.number) {
            self.unwatch(number);
        }
        self.take_probes(|given, wanted| {
            *wanted == Observed::Component(name) || given.at.is_some_and(|at| at.component == name)
        });
    }

    /// An activity has ended.
    pub(super) fn hide_activity(&mut self, name: Ident) {
        self.take_probes(|_, wanted| *wanted == Observed::Activity(name));
    }

    fn take_probes(&mut self, gone: impl Fn(&InstalledProbe, &Observed) -> bool) {
        for watcher in 0..self.watchers.len() {
            let links = self.watchers[watcher].take(&gone);
            self.detach(links);
        }
    }

    fn detach(&mut self, links: Vec<(u64, MemberRef)>) {
        for (number, at) in links {
            if let Ok(slot) = self.find(at.component)
                && let Ok((index, _)) = self.port(slot, at.member)
                && let Some(PortEnd::Out(end)) = &mut self.entry_mut(slot).ends.ports[index]
            {
                end.detach(number);
            }
        }
    }

    fn tap(&mut self, watcher: usize, place: usize, slot: u32, index: usize, at: MemberRef) {
        let (number, wake) = (self.next_number(), self.watchers[watcher].wake.clone());
        let tap: Option<Box<dyn ProbeTap>> = match &mut self.entry_mut(slot).ends.ports[index] {
            Some(PortEnd::Out(end)) => Some(end.tap(number, wake)),
            _ => None,
        };
        if let Some(tap) = tap {
            self.give_as(watcher, place, number, Some(at), Probe::Port(tap));
        }
    }

    fn give(&mut self, watcher: usize, place: usize, at: Option<MemberRef>, probe: Probe) {
        let number = self.next_number();
        self.give_as(watcher, place, number, at, probe);
    }

    fn give_as(&mut self, watcher: usize, place: usize, number: u64, at: Option<MemberRef>, probe: Probe) {
        let watcher = &mut self.watchers[watcher];
        watcher.given.push(InstalledProbe { number, place, at });
        watcher.sender.add(number, (place, probe));
    }
}

/// A look from outside, by probes of its own.
pub(super) struct ProbeWatch {
    inner: Weak<Inner>,
    number: u64,
    sight: Sight,
    probes: Probes,
}

impl ProbeWatch {
    /// Begins one; `wake` hears of what is written.
    pub(super) fn new(inner: &Arc<Inner>, inputs: &[MonitorInput], wake: &Signal) -> Self {
        let sight = Sight::of(inputs);
        // Nothing is ever raised in this name.
        let name = ComponentName::new("davit").expect("a plain name");
        let beat = Arc::new(Beat::new(name, Some(wake.clone()), Arc::new(Notices::default())));
        let (probes, end) = Probes::new(sight.wanted().clone(), &beat);
        let number = lock(&inner.registry).watch_as(None, end);
        Self { inner: Arc::downgrade(inner), number, sight, probes }
    }
}

impl Watch for ProbeWatch {
    fn shows(&self, _: usize) -> bool {
        true
    }

    fn look(&mut self, now: Time, samples: &mut [InputSample]) {
        self.sight.look(&mut self.probes, now, samples);
    }
}

impl Drop for ProbeWatch {
    fn drop(&mut self) {
        if let Some(inner) = self.inner.upgrade() {
            lock(&inner.registry).unwatch(self.number);
        }
    }
}
