//! Events that are nearly, but not quite, ones that there are: an unknown one is no error by itself, since operators may raise any.

use super::listeners::named;
use super::universe::Universe;
use crate::model::codes::COORD_NEAR_EVENT;
use crate::model::finding::{closest, did_you_mean, nearest};
use crate::model::{Deployment, EventName, FAULTED, Finding, Monitor, Raise};
use std::collections::BTreeSet;

/// What a state hears when what is in it has come to its end.
const DONE: &str = "e_done";

/// What is known of events of a deployment.
pub struct KnownEvents<'a> {
    deployment: &'a Deployment,
    /// What is raised in it, as its files say.
    raised: BTreeSet<&'a str>,
    /// What its components raise, as their types say.
    by_components: BTreeSet<&'a str>,
    accepted: BTreeSet<&'a str>,
    declared: BTreeSet<EventName>,
    confirms: BTreeSet<&'a str>,
    /// What coordinators raise.
    told: &'a BTreeSet<EventName>,
    /// What transitions of any of them list.
    waited_for: &'a BTreeSet<EventName>,
}

impl<'a> KnownEvents<'a> {
    /// `told`: what coordinators raise; `waited_for`: what transitions of any of them list.
    pub fn new(
        deployment: &'a Deployment,
        universe: &'a Universe,
        told: &'a BTreeSet<EventName>,
        waited_for: &'a BTreeSet<EventName>,
    ) -> Self {
        let configurations = || deployment.configurations.iter();
        let confirms: BTreeSet<&str> =
            configurations().filter_map(|c| c.confirm.map(|c| c.event)).map(|event| event.as_str()).collect();
        let mut raised = confirms.clone();
        raised.extend([deployment.deploy.event.as_str(), deployment.shutdown.event.as_str()]);
        raised.extend(deployment.reactions.iter().map(|reaction| reaction.raise.as_str()));
        raised.extend(deployment.monitors.iter().flat_map(Monitor::events).map(|event| event.as_str()));
        let is_event = |name: &EventName| {
            matches!(Raise::of(*name, |id| deployment.configuration(id).is_some()), Raise::Event)
                && !name.as_str().contains('/')
        };
        raised.extend(told.iter().filter(|name| is_event(name)).map(|event| event.as_str()));
        // What components of a subsystem raise is heard there.
        let own = universe.components().filter(|component| !component.as_str().contains('/'));
        let types = own.flat_map(|component| universe.of(component)).filter_map(|made| made.description.as_deref());
        let by_components = types.flat_map(|ty| ty.raises.keys()).map(|event| event.as_str()).collect();
        raised.extend(named(deployment, universe).iter().map(|named| named.event.as_str()));
        let accepted = deployment.interface.accepts.iter().map(|(event, _)| event.as_str()).collect();
        let declared = deployment.safety.iter().chain(&deployment.emits).map(|(event, _)| *event).collect();
        Self { deployment, raised, by_components, accepted, declared, confirms, told, waited_for }
    }

    /// Whether it is one that there is.
    pub fn is_known(&self, event: &str) -> bool {
        [&self.raised, &self.by_components, &self.accepted].into_iter().any(|known| known.contains(event))
    }

    /// That nobody raises an event, since it was meant to be another one: a time event, or the fault of a component.
    pub fn never_raised(&self, event: &str) -> Option<Finding> {
        if let Some((head, inner)) = event.split_once('(') {
            let near = closest(head, ["e_after", "e_at"]);
            let message = format!("`{event}` is no time event: somebody must raise it under that very name");
            return Some(Finding::warning(COORD_NEAR_EVENT, message).help(format!("did you mean `{near}({inner}`?")));
        }
        let changes = self.deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
        let created: BTreeSet<&str> =
            changes.filter_map(|change| change.kind.makes()).map(|(component, ..)| component.as_str()).collect();
        if let Some((component, word)) = event.rsplit_once('.').filter(|(component, _)| created.contains(component))
            && format!(".{word}") != FAULTED
            && is_slip(word, &FAULTED[1..])
        {
            let message = format!("`{event}` never comes: that `{component}` fails is told as `{component}{FAULTED}`");
            return Some(
                Finding::warning(COORD_NEAR_EVENT, message).help(format!("did you mean `{component}{FAULTED}`?")),
            );
        }
        if let Some((component, word)) = event.rsplit_once('.').filter(|(component, _)| created.contains(component))
            && self.is_known(word)
        {
            let message = format!("`{event}` never comes: what `{component}` raises is heard without its name");
            return Some(Finding::warning(COORD_NEAR_EVENT, message).help(format!("did you mean `{word}`?")));
        }
        let (component, word) = event.rsplit_once('.')?;
        let is_fault = word == &FAULTED[1..];
        let fault = nearest(word, [&FAULTED[1..]]).is_some() || is_fault;
        let exists = created.contains(component);
        let declared =
            || EventName::new(event).is_ok_and(|event| self.declared.contains(&event) || self.told.contains(&event));
        if exists && !is_fault && !self.deployment.looks_like_answer(event) && !declared() {
            let message =
                format!("nobody raises `{event}`: of `{component}` itself only `{component}{FAULTED}` is told");
            let help = match fault {
                true => format!("did you mean `{component}{FAULTED}`?"),
                false => {
                    format!("wait for `{component}{FAULTED}`, or for what it raises, which is heard without its name")
                }
            };
            return Some(Finding::warning(COORD_NEAR_EVENT, message).help(help));
        }
        (fault && !exists && !self.deployment.looks_like_answer(event)).then(|| {
            let help = match nearest(component, created.iter().copied()) {
                Some(near) => format!("did you mean `{near}{FAULTED}`?"),
                None => did_you_mean(component, "components", created.iter().copied()),
            };
            Finding::warning(COORD_NEAR_EVENT, format!("`{event}` never comes: there is no component `{component}`"))
                .help(help)
        })
    }

    /// What coordinators wait for and nobody raises, where a name that one of them raises may be that with a slip.
    pub fn waited_for_as(&self, raised: &str) -> Option<&'a str> {
        let unheard =
            self.waited_for.iter().filter(|event| !self.told.contains(*event) && !self.is_known(event.as_str()));
        // What answers a request is raised by nobody.
        let unheard = unheard.filter(|event| !self.deployment.looks_like_answer(event.as_str()));
        let near = nearest(raised, unheard.map(|event| event.as_str()))?;
        is_slip(raised, near).then_some(near)
    }

    /// That what would confirm a configuration is nearly an event that there is, and none by itself.
    pub fn confirmed_as(&self, event: EventName) -> Option<Finding> {
        let text = event.as_str();
        let deployment = self.deployment;
        let raised = deployment.reactions.iter().map(|reaction| reaction.raise);
        let raised = raised.chain(deployment.monitors.iter().flat_map(Monitor::events));
        let others = raised.chain(self.told.iter().copied()).chain(self.waited_for.iter().copied());
        let others: BTreeSet<&str> = others.chain(self.declared.iter().copied()).map(|event| event.as_str()).collect();
        let known = || others.iter().chain(&self.by_components).chain(&self.accepted).copied();
        if known().any(|known| known == text) {
            return None;
        }
        let near = nearest(text, known()).filter(|near| is_slip(text, near) && !deployment.looks_like_answer(near))?;
        let finding =
            Finding::warning(COORD_NEAR_EVENT, format!("`{event}` confirms, and is nearly `{near}`, which there is"));
        Some(finding.help(format!("did you mean `{near}`? if not, a component or an operator must raise `{event}`")))
    }

    /// That an event which `listed` transitions of a coordinator wait for is nearly one that there is.
    pub fn near(&self, event: EventName, listed: usize) -> Option<Finding> {
        let text = event.as_str();
        // Nobody slips twice in the same way.
        if self.declared.contains(&event) || self.told.contains(&event) || listed > 1 {
            return None;
        }
        let safety = || self.deployment.safety.iter().map(|(event, _)| event.as_str());
        let known = [&self.raised, &self.by_components, &self.accepted].into_iter().flatten();
        let near = nearest(text, known.copied().chain(safety()).chain([DONE]))?;
        if near == DONE {
            let message = format!("`{event}` is nearly `{DONE}`, which says that what is in a state is done");
            let help = format!("did you mean `{DONE}`? if not, a component or an operator must raise `{event}`");
            // `e_one` is a word.
            let begins = text.get(..3).is_some_and(|begins| begins.eq_ignore_ascii_case(&DONE[..3]));
            return (begins && is_slip(text, DONE)).then(|| Finding::warning(COORD_NEAR_EVENT, message).help(help));
        }
        // Of what nobody hears it is said where it is raised, with what may have been meant; but a component's type is another file's.
        let is_heard = self.waited_for.iter().any(|event| event.as_str() == near);
        let is_safety = safety().any(|event| event == near);
        if !is_heard && !is_safety && !self.confirms.contains(near) && !self.by_components.contains(near) {
            return None;
        }
        if !is_slip(text, near) {
            return None;
        }
        let by = match (self.raised.contains(near), self.by_components.contains(near)) {
            (true, _) => "the deployment raises",
            (false, true) => "a component raises",
            _ if is_safety => "`safety` lists",
            (false, false) => "the deployment accepts",
        };
        let finding = Finding::warning(COORD_NEAR_EVENT, format!("`{event}` is nearly `{near}`, which {by}"));
        Some(finding.help(format!("did you mean `{near}`? if not, a component or an operator must raise `{event}`")))
    }
}

/// Whether one name may be the other one with a slip of the finger, or with other capitals, and is not another word.
fn is_slip(one: &str, other: &str) -> bool {
    if one.eq_ignore_ascii_case(other) {
        return true;
    }
    let (one, other) = (&*one.to_lowercase(), &*other.to_lowercase());
    // In a short name two letters make another word; and another number is another thing.
    let slips = if one.chars().count() < 8 { 1 } else { 2 };
    strsim::damerau_levenshtein(one, other) <= slips
        && without_numbers(one) != without_numbers(other)
        && !are_two_words(one, other)
}

/// Whether two names differ in one word of them alone, and mean another thing there: `e_limit_x` and `e_limit_y`, what is to be done and that it
/// has been (`e_close`, `e_closed`), something and its contrary (`e_locked`, `e_unlocked`).
fn are_two_words(one: &str, other: &str) -> bool {
    let parts = |name| str::split(name, ['_', '.', '-']);
    if parts(one).count() != parts(other).count() {
        return false;
    }
    let mut differ = parts(one).zip(parts(other)).filter(|(one, other)| one != other);
    let (Some((one, other)), None) = (differ.next(), differ.next()) else { return false };
    let (short, long) = if one.len() < other.len() { (one, other) } else { (other, one) };
    let is_letter = |word: &str| word.chars().count() == 1;
    let ends = ["d", "ed", "ing"].iter().any(|end| long.strip_suffix(end) == Some(short));
    let begins = ["un", "re", "de"].iter().any(|start| long.strip_prefix(start) == Some(short));
    is_letter(short) && is_letter(long) || short.len() > 2 && (ends || begins)
}

/// A name with the same in place of every number.
fn without_numbers(name: &str) -> String {
    let mut text = name.replace(|c: char| c.is_ascii_digit(), "0");
    while text.contains("00") {
        text = text.replace("00", "0");
    }
    text
}
