//! What does not come any more once stopping has begun: where a deployment declares `safety:`, an ordinary event that somebody
//! raises from outside is refused then ([`Deployment::stays_open`](crate::model::Deployment::stays_open)). What components
//! and monitors report comes all the same, where they have reason to: [`bars`](super::bars).

use super::children::Child;
use super::edges::Barred;
use super::from_outside::{FromOutside, Raises};
use super::product::Product;
use super::reactions::triggers;
use super::state::{Move, ProductState};
use super::uncertain::fails;
use crate::model::{Ask, EventName, Monitor, Origin, SubsystemStanding, Verdict};
use crate::statechart::EventId;
use crate::system::{ComponentNode, View as _};

impl Product<'_> {
    /// What is known of each event from outside.
    pub(super) fn known_outside(&self) -> Vec<FromOutside> {
        let all = self.outside.iter().zip(0u16..);
        all.map(|(name, at)| FromOutside {
            told_between: self.deployment.is_told_between(name.as_str()),
            raises: self.alike_to(at).map(|name| self.may_raise(name)).max().unwrap_or(Raises::Nobody),
        })
        .collect()
    }

    /// Who may raise, while it is being stopped, what a move brings from outside.
    pub(super) fn raises_while_stopping(&self, by: Move) -> Raises {
        match by {
            Move::Event(at) => self.from_outside[usize::from(at)].raises,
            Move::Confirmed(id) => {
                let confirm = self.worlds.configuration(id).and_then(|configuration| configuration.confirm);
                confirm.map_or(Raises::Somebody, |confirm| self.may_raise(confirm.event))
            }
            Move::Lost(_) | Move::Elsewhere(_) => Raises::Sometimes,
            _ => Raises::Somebody,
        }
    }

    /// The events that are followed as one from outside, since no coordinator tells them apart.
    pub(super) fn alike_to(&self, at: u16) -> impl Iterator<Item = EventName> + Clone + '_ {
        let alike = (0..self.outside.len()).filter(move |other| self.alike[*other] == usize::from(at));
        alike.map(|other| self.outside[other])
    }

    /// Why a move leads no deployment down that is being stopped.
    pub(super) fn barred(&self, by: Move) -> Option<Barred> {
        if self.is_first_or_last(by) {
            return Some(Barred::Again);
        }
        match self.raises_while_stopping(by) {
            Raises::Nobody => return Some(Barred::Closed),
            Raises::Sometimes => return Some(Barred::Gone),
            Raises::Perhaps => return Some(Barred::Reported),
            Raises::Somebody => {}
        }
        let late = matches!(by, Move::Time(..)) && self.takes(by) >= self.deployment.shutdown.within;
        late.then_some(Barred::Late)
    }

    /// Events that would lead on from a state, were they not refused while the deployment is being stopped.
    pub(super) fn closed_at(&self, state: &ProductState) -> Vec<EventName> {
        let leads = |(at, _): &(usize, &EventName)| {
            let by = Move::Event(u16::try_from(*at).unwrap_or(u16::MAX));
            !self.is_first_or_last(by) && self.raises_while_stopping(by) == Raises::Nobody
        };
        let heard = |(_, name): &(usize, &EventName)| self.listens(state, **name).is_some();
        self.outside.iter().enumerate().filter(leads).filter(heard).map(|(_, name)| *name).collect()
    }

    /// The coordinator that waits for an event where it is.
    pub(super) fn listens(&self, state: &ProductState, name: EventName) -> Option<usize> {
        self.members.iter().zip(&state.leaves).position(|(member, leaf)| {
            let event = member.chart.event(name);
            event != EventId::OTHER && triggers(member.chart, *leaf).0.contains(&event)
        })
    }

    /// The event that a move brings from outside; empty: it brings none.
    pub(super) fn named(&self, by: Move) -> String {
        match by {
            Move::Event(at) => self.outside[usize::from(at)].to_string(),
            Move::Confirmed(id) => {
                let confirm = self.worlds.configuration(id).and_then(|configuration| configuration.confirm);
                confirm.map(|confirm| confirm.event.to_string()).unwrap_or_default()
            }
            Move::Lost(id) => Verdict::Lost.event(Ask::Apply(id)).to_string(),
            Move::Elsewhere(id) => id.to_string(),
            _ => String::new(),
        }
    }

    /// Whether a monitor tells it, or a component of the simulated platform.
    pub(super) fn is_reported(&self, name: EventName) -> bool {
        let deployment = self.deployment;
        let reacts = deployment.kind.imitates && deployment.reactions.iter().any(|reaction| reaction.raise == name);
        reacts || deployment.monitors.iter().flat_map(Monitor::events).any(|event| event == name)
    }

    /// Whether a monitor, or a component that is there, may raise it.
    pub(super) fn is_raised_inside(&self, state: &ProductState, name: EventName) -> bool {
        let mut raises = false;
        let mut look = |node: &ComponentNode| raises |= node.ty.raises.keys().any(|event| *event == name);
        let known = self.worlds.get(state.world).map(|world| world.system.for_each_component(&mut look));
        known.is_none() || raises || self.is_reported(name)
    }

    /// Whether it comes from outside, and need not come: it tells that something has failed, or on the way up that a subsystem leaves.
    pub(super) fn need_not_come(&self, by: Move, stopping: bool) -> bool {
        let Move::Event(at) = by else { return false };
        let name = self.outside[usize::from(at)];
        let tells = |child: &Child| {
            let fell = [SubsystemStanding::Failed, SubsystemStanding::Stranded];
            child.uncertain.contains(&name)
                || fell.iter().any(|standing| standing.event(child.path) == name)
                || !stopping && (child.down == name || child.leaves == Some(name))
        };
        fails(name) || self.is_reported(name) || self.children.iter().any(tells)
    }

    /// The event that a move brings from outside, where nothing in the deployment raises it: people do, or somebody's program.
    pub(super) fn raised_by_hand(&self, state: &ProductState, by: Move) -> Option<EventName> {
        let Move::Event(at) = by else { return None };
        let deployment = self.deployment;
        let listed = |list: &[(EventName, Origin)], name: EventName| list.iter().any(|(event, _)| *event == name);
        let known = |name: EventName| {
            let raised = self.from_outside[usize::from(at)].told_between
                || self.is_raised_inside(state, name)
                || self.is_told_by_child(name);
            raised || fails(name) || listed(&deployment.interface.accepts, name) || listed(&deployment.safety, name)
        };
        // What is followed as one is raised where one of them is.
        let mut alike = self.alike_to(at);
        if alike.clone().any(known) { None } else { alike.next() }
    }

    /// Whether a subsystem's event is refused while it is being stopped since the deployment that it is part of declares `safety`, and its own file
    /// does not. What its parent raises comes.
    fn is_closed_from_outside(&self, name: EventName) -> bool {
        let own = self.deployment;
        let until = own.interface.leaving.is_some_and(|leaving| leaving.until == name);
        let first_or_last = until || [own.deploy.event, own.shutdown.event].contains(&name);
        own.safety.is_empty()
            && !first_or_last
            && self.parent.as_ref().is_some_and(|parent| parent.closes && !parent.raises_for_all.contains(&name))
    }

    fn may_raise(&self, name: EventName) -> Raises {
        let deployment = self.deployment;
        let simulated = deployment.kind.imitates;
        if self.children.iter().any(|child| child.uncertain.contains(&name)) {
            return Raises::Sometimes;
        }
        // What a subsystem tells nobody can refuse. That something fails nobody can promise, though they may tell it by hand.
        let open = deployment.stays_open(name.as_str()) && !self.is_closed_from_outside(name);
        if self.is_told_by_child(name) || open && !fails(name) {
            Raises::Somebody
        } else if fails(name) || self.is_reported(name) {
            Raises::Sometimes
        } else if simulated {
            // There components raise what `simulated: { reactions }` says, and nothing else.
            Raises::Nobody
        } else {
            Raises::Perhaps
        }
    }
}

/// What to do about an event that is refused while the deployment is being stopped.
pub fn still_comes(event: &str) -> String {
    format!(
        "`{event}` is refused while it is being stopped, since it is not listed under `safety`: let an answer, a time, or what \
         a component or a monitor reports lead on"
    )
}
