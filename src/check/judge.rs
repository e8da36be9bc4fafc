//! What is judged of everything that was followed: findings, each with its own shortest way.

use super::coordinator::place;
use super::explore::Graph;
use super::state::{Failed, Move, Next, ProductState, Trouble};
use super::trace::TraceStep;
use crate::limits;
use crate::model::codes::{
    COORD_LOST_UNHEARD, COORD_REFUSED_BY_OTHER, COORD_REQUEST_REFUSED, COORD_REVERTED_UNHEARD, COORD_STACK_GROWS,
    STACK_FULL,
};
use crate::model::{
    Ask, ChangeKind, Code, ComponentName, ConfigId, Configuration, Finding, Findings, Severity, Verdict,
};
use crate::stack::{Request, Requester, claims};
use crate::statechart::{NodeId, RaiseMoment, RaiseSite};
use crate::system::View;
use rustc_hash::{FxHashMap, FxHashSet};
use std::collections::BTreeSet;
use std::rc::Rc;
use std::time::Duration;

/// Findings with the ways to them; empty: there is none to tell.
pub type Traced = Vec<(Finding, Vec<TraceStep>)>;

impl Graph<'_, '_> {
    /// Everything there is to say.
    pub fn judge(&mut self) -> Traced {
        let mut found = Traced::new();
        self.refusals(&mut found);
        self.withheld(&mut found);
        self.hollow(&mut found);
        self.growing(&mut found);
        self.unhandled(&mut found);
        self.endless(&mut found);
        self.unbegun(&mut found);
        let stuck = self.stuck(&mut found);
        self.leftovers(&mut found);
        self.ways_down(&stuck, &mut found);
        self.waits_in_vain(&mut found);
        self.down_behind_safe(&mut found);
        self.safety(&mut found);
        self.warned(&mut found);
        self.promises(&mut found);
        self.let_go_in_vain(&mut found);
        self.exclusives(&mut found);
        self.races(&mut found);
        self.exports_stay(&mut found);
        self.never_entered(&mut found);
        found
    }

    /// Which of the states comes first, in the order of failing and length.
    fn firsts<T>(&mut self, list: Vec<(u32, T)>) -> Vec<(u32, T)> {
        let order = self.best_first(list.iter().map(|(at, _)| *at).collect());
        let rank: FxHashMap<u32, usize> = order.into_iter().zip(0..).collect();
        let mut list = list;
        list.sort_by_key(|(at, _)| rank[at]);
        list
    }

    /// What is wrong of one kind, the best way first.
    fn troubled<T>(&mut self, of: impl Fn(&Trouble) -> Option<T>) -> Vec<(u32, T)> {
        let list = self.troubles.iter().filter_map(|(at, trouble)| Some((*at, of(trouble)?))).collect();
        self.firsts(list)
    }

    /// The first move that follows from a state of which this is so, with that state; none: there is none.
    pub(super) fn following(&mut self, at: u32, is: impl Fn(&Next) -> bool) -> Vec<(ProductState, Next)> {
        let next = self.nexts(at).all.into_iter().find(is);
        next.map(|next| (self.states[at as usize].clone(), next)).into_iter().collect()
    }

    fn refusals(&mut self, found: &mut Traced) {
        // What is said of a refusal is told again only where it is worse.
        let mut said: FxHashMap<(Requester, Ask, Code, u32, String), Severity> = FxHashMap::default();
        let mut judged = FxHashSet::default();
        let refused = |trouble: &Trouble| match trouble {
            Trouble::Refused(request, reasons) => Some((*request, reasons.clone())),
            _ => None,
        };
        for (at, (request, reasons)) in self.troubled(refused) {
            let Some(first) = reasons.first() else { continue };
            let told = (request.requester, request.ask, first.code, first.origin.0, first.message.clone());
            let (class, world) = (self.failed[at as usize], self.states[at as usize].world);
            let worse = |severity| said.get(&told).is_none_or(|said| severity > *said);
            if !worse(severity_of(class)) || !judged.insert((told.clone(), world, class)) {
                continue;
            }
            let finding = self.refused(at, &request, &reasons);
            if !worse(finding.severity) {
                continue;
            }
            said.insert(told, finding.severity);
            let mut trace = self.trace(at);
            if let Some(last) = trace.last_mut() {
                // Beside what it is carried out with it is answered when that is.
                let within = self.runs_out(at, &request).unwrap_or_default().max(limits::REPLAY_STEP * 2);
                last.replay.then = Some((request.ask.failed().event(request.ask), within));
            }
            let finding = self.with_what_was_asked_twice(finding, at, &request, &trace);
            // The reasons are findings of their own, each at its place.
            let number = self.product.member(request.requester);
            let made = number.is_some_and(|n| self.maker(n, &self.states[at as usize], request.ask).is_some());
            let own = finding.code == COORD_REQUEST_REFUSED && self.failed[at as usize] == Failed::Nothing && !made;
            let severity = finding.severity;
            found.push((finding, trace.clone()));
            for reason in reasons.iter().filter(|reason| own && reason.origin.is_some()) {
                let reason = Finding { severity: reason.severity.min(severity), ..reason.clone() };
                found.push((reason, trace.clone()));
            }
        }
    }

    fn refused(&self, at: u32, request: &Request, reasons: &Rc<Findings>) -> Finding {
        let state = &self.states[at as usize];
        let why = reasons.first().map_or("", |f| f.message.as_str());
        let class = severity_of(self.failed[at as usize]);
        let ask = request.ask;
        let Some(number) = self.product.member(request.requester) else {
            return Finding::new(class, COORD_REQUEST_REFUSED, format!("`{ask}` is refused: {why}"));
        };
        let member = &self.product.members[number];
        let blamed = self.blamed(state, request);
        // So many frames of its own are there through nobody else's doing.
        let own = reasons.first().is_some_and(|first| first.code == STACK_FULL);
        let by_operator = blamed.contains(&Requester::Operator);
        let others: Vec<Requester> = blamed.into_iter().filter(|by| !own || *by != Requester::Operator).collect();
        let maker = self.maker(number, state, ask);
        let mut finding = if others.is_empty() {
            let message = match (self.runs_out(at, request), ask) {
                (Some(within), Ask::UndoOf(id)) => {
                    format!(
                        "`{id}` cannot be taken back when it is not confirmed within {} s: {why}",
                        within.as_secs_f64()
                    )
                }
                _ => format!("`{ask}` is refused when it is asked for: {why}"),
            };
            let shared = by_operator || maker.is_some() || self.shares(number, ask) || !member.chart.is_pure();
            let severity = if shared { class.min(Severity::Warning) } else { class };
            Finding::new(severity, COORD_REQUEST_REFUSED, message)
        } else {
            let message = format!(
                "`{ask}` of `{}` is refused because of the frames of {}: {why}",
                member.name,
                others.iter().map(|by| self.called(*by)).collect::<Vec<_>>().join(" and ")
            );
            Finding::new(class.min(Severity::Warning), COORD_REFUSED_BY_OTHER, message)
        };
        let confirmed = |id| self.product.worlds.configuration(id).filter(|_| self.runs_out(at, request).is_some());
        if let Ask::UndoOf(id) = ask
            && let Some(configuration) = confirmed(id)
        {
            finding = finding.at(configuration.origin).labelled("waits for its confirmation");
        } else if let Some(site) = self.site(number, request) {
            finding = finding.at(site.origin).labelled("asked for here").path(place(member.chart, site.when));
        }
        for reason in reasons.iter().filter(|reason| reason.origin.is_some()).take(3) {
            finding = finding.also(reason.origin, reason.message.clone());
        }
        let help = reasons.first().and_then(|f| f.help.clone());
        finding.help(match (maker, others.is_empty()) {
            (Some((other, by, component)), _) => format!(
                "`{component}` comes with `{by}`, which `{other}` asks for: ask for this one when that is there, which \
                 `{other}` can tell by an event"
            ),
            (None, true) => help.unwrap_or_else(|| "ask for it where it fits the system".to_owned()),
            (None, false) if others == [Requester::Operator] => {
                let first = "let the operator undo that first (`davit undo`)";
                let own = self.product.worlds.of_operator(state.world);
                if own.first().is_some_and(|id| !self.product.is_safe(*id)) {
                    format!("{first}, or leave it out of `operator:`")
                } else {
                    first.to_owned()
                }
            }
            (None, false) => {
                "give each coordinator components of its own, or let one ask the other by an event".to_owned()
            }
        })
    }

    /// What can only fail, since what it stands for is false where it is applied.
    fn hollow(&mut self, found: &mut Traced) {
        let mut said: FxHashSet<ConfigId> = FxHashSet::default();
        let hollow = |trouble: &Trouble| match trouble {
            Trouble::Hollow(request, reasons) => Some((*request, reasons.clone())),
            _ => None,
        };
        for (at, (request, reasons)) in self.troubled(hollow) {
            let (Ask::Apply(id), Some(reason)) = (request.ask, reasons.first()) else { continue };
            if !said.insert(id) {
                continue;
            }
            let severity = severity_of(self.failed[at as usize]);
            let number = self.product.member(request.requester);
            let shared =
                number.is_some_and(|n| self.shares(n, request.ask) || !self.product.members[n].chart.is_pure());
            let severity = if shared { severity.min(Severity::Warning) } else { severity };
            let mut trace = self.trace(at);
            if let Some(last) = trace.last_mut() {
                let within = self.product.fails_within(request.ask, &reasons);
                last.replay.then = Some((request.ask.failed().event(request.ask), within));
            }
            found.push((Finding { severity, ..reason.clone() }, trace));
        }
    }

    /// Within what time a confirmation was to come, where a request takes back what was not confirmed.
    fn runs_out(&self, at: u32, request: &Request) -> Option<Duration> {
        let state = &self.states[at as usize];
        let Ask::UndoOf(id) = request.ask else { return None };
        let of = (Ask::Apply(id), request.requester);
        let waits = state.unconfirmed.iter().any(|waits| (waits.request.ask, waits.request.requester) == of);
        let asked = state.desk.under_way().iter().flat_map(|turn| &turn.batch.requests).any(|r| r.ask == request.ask);
        let confirm = self.product.worlds.configuration(id).and_then(|configuration| configuration.confirm);
        confirm.filter(|_| waits && !asked).map(|confirm| confirm.within)
    }

    /// Components that a request is about, in the state's world.
    fn about(&self, state: &ProductState, ask: Ask, by: Requester) -> BTreeSet<ComponentName> {
        let mut about = BTreeSet::new();
        if let Ask::Apply(id) | Ask::UndoOf(id) = ask
            && let Some(configuration) = self.product.worlds.configuration(id)
        {
            about.extend(claims::components(configuration));
        }
        let frames = self.product.worlds.get(state.world).map(|world| world.stack.frames()).unwrap_or_default();
        let pops = |id: ConfigId| match ask {
            Ask::UndoOf(of) => of == id,
            Ask::Undo => true,
            _ => false,
        };
        let popped = frames.iter().rev().find(|frame| frame.requester == by && pops(frame.configuration));
        for touch in popped.iter().flat_map(|frame| &frame.footprint.touches) {
            let (a, b) = touch.slot.components();
            about.extend([a, b]);
        }
        about
    }

    /// Those whose frames are in the way of a request: they share a component (or a group) with it, and without their frames
    /// it would not be refused.
    fn blamed(&self, state: &ProductState, request: &Request) -> Vec<Requester> {
        let Some(world) = self.product.worlds.get(state.world) else { return Vec::new() };
        let strange = |requester: &Requester| *requester != request.requester;
        // What a state brings with it, and nobody asks for else.
        let stays = |id: ConfigId| self.is_scoped(id) && !self.is_asked_plainly(id);
        let batch = state.desk.under_way().iter().map(|turn| &turn.batch.requests);
        let own = batch.into_iter().find_map(|all| Some(&all[..all.iter().position(|other| other == request)?]));
        if !world.stack.frames().iter().any(|frame| strange(&frame.requester))
            || self.product.worlds.is_refused_alone(state.world, own.unwrap_or_default(), request, stays)
        {
            return Vec::new();
        }
        let about = self.about(state, request.ask, request.requester);
        let group = match request.ask {
            Ask::Apply(id) => self.product.worlds.configuration(id).and_then(|c| c.group),
            _ => None,
        };
        let mut others: Vec<Requester> = Vec::new();
        for frame in world.stack.frames().iter().filter(|frame| strange(&frame.requester)) {
            let touches = frame.footprint.touches.iter().any(|touch| {
                let (a, b) = touch.slot.components();
                about.contains(&a) || about.contains(&b)
            });
            if (touches || group.is_some() && frame.group == group) && !others.contains(&frame.requester) {
                others.push(frame.requester);
            }
        }
        others
    }

    fn called(&self, by: Requester) -> String {
        match self.product.member(by) {
            Some(number) => format!("`{}`", self.product.members[number].name),
            None => "an operator".to_owned(),
        }
    }

    fn asked_by(&self, number: usize) -> BTreeSet<ConfigId> {
        super::coupling::asked(self.product.deployment, self.product.members[number].chart)
    }

    /// Whether other coordinators ask for configurations that touch what a request is about: then what it meets there may be
    /// their doing.
    fn shares(&self, number: usize, ask: Ask) -> bool {
        let (Ask::Apply(id) | Ask::UndoOf(id)) = ask else { return false };
        let Some(own) = self.product.worlds.configuration(id).map(claims::components) else { return false };
        let meets = |id: &ConfigId| {
            let other = self.product.worlds.configuration(*id).map(claims::components);
            other.is_some_and(|other| other.intersection(&own).next().is_some())
        };
        let others = (0..self.product.members.len()).filter(|other| *other != number);
        others.into_iter().any(|other| self.asked_by(other).iter().any(meets))
    }

    /// Who asks for a configuration that makes a component which is missing: the coordinator, the configuration and the
    /// component.
    fn maker(&self, number: usize, state: &ProductState, ask: Ask) -> Option<(String, ConfigId, ComponentName)> {
        let world = self.product.worlds.get(state.world)?;
        let Ask::Apply(id) = ask else { return None };
        let own = self.product.worlds.configuration(id)?;
        let made: BTreeSet<ComponentName> = created(own).collect();
        let missing: Vec<ComponentName> = claims::components(own)
            .into_iter()
            .filter(|component| !made.contains(component) && world.system.component(*component).is_none())
            .collect();
        let others = (0..self.product.members.len()).filter(|other| *other != number);
        others.into_iter().find_map(|other| {
            let asked = self.asked_by(other);
            let configurations = asked.iter().filter_map(|id| self.product.worlds.configuration(*id));
            let name = self.product.members[other].name.to_string();
            let makes = |c: &Configuration| created(c).find(|component| missing.contains(component));
            configurations.into_iter().find_map(|c| makes(c).map(|component| (name.clone(), c.id, component)))
        })
    }

    /// The place that made a request, as far as it can be told.
    pub(super) fn site(&self, number: usize, request: &Request) -> Option<&RaiseSite> {
        let name = request.ask.to_string();
        let chart = self.product.members[number].chart;
        let owner = request.tag.0.checked_sub(1).and_then(|at| chart.node(usize::try_from(at).ok()?));
        let sites = || chart.raises().iter().filter(|site| site.name.as_str() == name);
        sites()
            .find(|site| matches!(site.when, RaiseMoment::Entry(node) if Some(node) == owner))
            .or_else(|| sites().next())
    }

    /// Configurations that are applied again and again.
    fn growing(&mut self, found: &mut Traced) {
        let mut said: FxHashSet<ConfigId> = FxHashSet::default();
        for (at, id) in self.firsts(self.deep.clone()) {
            if !said.insert(id) {
                continue;
            }
            let origin = self.product.worlds.configuration(id).map(|c| c.origin).unwrap_or_default();
            let pushes = self.following(at, |next| next.deep.0 == Some(id));
            let trace = self.trace_on(at, pushes);
            let undo = Ask::UndoOf(id);
            let not_undone = [undo.failed().event(undo), undo.broken().event(undo)];
            let failed =
                trace.iter().flat_map(TraceStep::answers).any(|told| not_undone.iter().any(|e| e.as_str() == told));
            let (how, help) = match (failed, self.is_scoped(id)) {
                // What is safe is not undone so that it can come again.
                (true, _) if self.product.worlds.configuration(id).is_some_and(|c| c.safe) => (
                    "after its undo has failed",
                    "give it a group: then one frame of it is in force, however often it is asked for".to_owned(),
                ),
                (true, _) => (
                    "after its undo has failed",
                    format!(
                        "on `{}` lead to a state that asks for its undo once more, not back to where it is applied",
                        not_undone[0]
                    ),
                ),
                (false, true) => ("without undoing it", "undo it on the way round, or give it a group".to_owned()),
                (false, false) => (
                    "without undoing it",
                    format!("undo it on the way round, give it a group, or make `{id}` the `config` of a state"),
                ),
            };
            let message = format!("going round applies `{id}` again and again {how}");
            let finding = Finding::warning(COORD_STACK_GROWS, message).at(origin).help(help);
            found.push((finding, trace));
        }
    }

    /// Whether some state of a coordinator has it as its `config`.
    fn is_scoped(&self, id: ConfigId) -> bool {
        let of = |site: &RaiseSite| site.scoped && site.name.as_str() == id.as_str();
        self.product.members.iter().any(|member| member.chart.raises().iter().any(of))
    }

    fn is_asked_plainly(&self, id: ConfigId) -> bool {
        let of = |site: &RaiseSite| !site.scoped && site.name.as_str() == id.as_str();
        self.product.members.iter().any(|member| member.chart.raises().iter().any(of))
    }

    /// What is lost, or taken back unconfirmed, and nobody hears.
    fn unhandled(&mut self, found: &mut Traced) {
        let mut said: FxHashSet<(ConfigId, Verdict)> = FxHashSet::default();
        let unhandled = |trouble: &Trouble| match trouble {
            Trouble::Unhandled(id, verdict) => Some((*id, *verdict)),
            _ => None,
        };
        let mut list = self.troubled(unhandled);
        // Where nothing is under way it comes without waiting for anything.
        list.sort_by_key(|(at, _)| (self.failed[*at as usize], !self.states[*at as usize].desk.is_empty()));
        for (at, (id, verdict)) in list {
            if !said.insert((id, verdict)) {
                continue;
            }
            let event = verdict.event(Ask::Apply(id));
            let (code, what, doubt) = match verdict {
                Verdict::Reverted => (COORD_REVERTED_UNHEARD, "waits for its confirmation", "may wait to be confirmed"),
                _ => (COORD_LOST_UNHEARD, "stands for something that can be lost", "may be in force"),
            };
            let place = self.product.place(&self.states[at as usize]);
            let origin = self.product.worlds.configuration(id).map(|c| c.origin).unwrap_or_default();
            let message = format!("nobody hears `{event}` in {place}, where `{id}` {doubt}");
            // Where an undo has failed not every coordinator can go on.
            let behind_undo = verdict == Verdict::Reverted && self.failed[at as usize] >= Failed::Undo;
            let severity = if behind_undo { Severity::Info } else { Severity::Warning };
            let finding = Finding::new(severity, code, message)
                .at(origin)
                .labelled(what)
                .path(format!("configurations.{id}"))
                .help(format!("add a transition on `{event}` to a state around all in which `{id}` {doubt}"));
            let told = self.following(at, |next| {
                let told = |(request, given): &(Request, Verdict)| (request.ask, *given) == (Ask::Apply(id), verdict);
                next.by == Move::Lost(id) && verdict == Verdict::Lost || next.answers.iter().any(told)
            });
            let trace = self.trace_on(at, told);
            found.push((finding, trace));
        }
    }

    /// What planning warns of, where that is asked for and done.
    fn warned(&mut self, found: &mut Traced) {
        let mut said: FxHashSet<(Code, u32, String, String)> = FxHashSet::default();
        for (at, warnings) in self.firsts(self.warned.clone()) {
            for warning in warnings.iter() {
                let place = (warning.code, warning.origin.0, warning.path.clone(), warning.message.clone());
                if said.insert(place) {
                    let done = self.following(at, |next| {
                        next.failed == Failed::Nothing && next.answers.iter().any(|(_, verdict)| verdict.is_success())
                    });
                    let trace = self.trace_on(at, done);
                    found.push((warning.clone(), trace));
                }
            }
        }
    }

    /// Where nothing leads on.
    fn stuck(&mut self, found: &mut Traced) -> FxHashSet<u32> {
        let mut leads_on = vec![false; self.states.len()];
        self.edges.iter().filter(|edge| !edge.dropped()).for_each(|edge| leads_on[edge.from as usize] = true);
        let troubled = self.troubles.iter().filter(|(_, trouble)| trouble.stays_in_force()).map(|(at, _)| *at);
        let troubled: FxHashSet<u32> = troubled.collect();
        let mut stuck = FxHashSet::default();
        for at in self.in_order() {
            let state = &self.states[at as usize];
            let known = self.product.worlds.top(state.world).is_none();
            let over = self.product.is_down(state) || self.ends.contains(&at) || troubled.contains(&at);
            if !leads_on[at as usize] && self.followed[at as usize] && !over && known && !self.is_stranded(at) {
                stuck.insert(at);
            }
        }
        if self.product.members.len() > 1 {
            return stuck;
        }
        let mut told: FxHashSet<Vec<NodeId>> = FxHashSet::default();
        for at in self.best_first(stuck.iter().copied().collect()) {
            let leaves = self.states[at as usize].leaves.to_vec();
            let leaf = leaves[0];
            if self.product.waits_for_unbegun(&self.states[at as usize], 0).is_none() && told.insert(leaves) {
                let finding = self.product.nothing_leads_on(leaf);
                let mut finding = self.told_before(leaf).into_iter().fold(finding, Finding::help);
                if self.product.knows_less() {
                    finding.severity = Severity::Info;
                }
                let trace = self.trace(at);
                found.push((finding, trace));
            }
        }
        stuck
    }
}

/// How bad it is at most that something is refused where this failed before.
pub(super) fn severity_of(failed: Failed) -> Severity {
    match failed {
        Failed::Nothing => Severity::Error,
        Failed::Apply => Severity::Warning,
        Failed::Undo | Failed::Broken => Severity::Info,
    }
}

/// Components that a configuration makes.
pub(super) fn created(configuration: &Configuration) -> impl Iterator<Item = ComponentName> + '_ {
    configuration.changes.iter().filter_map(|change| match &change.kind {
        ChangeKind::Create { component, .. } => Some(*component),
        _ => None,
    })
}
