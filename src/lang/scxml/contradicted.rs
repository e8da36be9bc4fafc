//! What this program wrote says some things twice: in SCXML's words for others, and in its own so that a chart comes back as it was.
//! Who edits one of the two means something by it: it is not passed over.

use super::transition::seconds;
use super::{ScxmlReader, own};
use crate::lang::print::scxml::{SCXML, event_name, plain_event};
use crate::model::statechart::{ChartTransition, Since, Trigger};
use crate::model::{Finding, codes};
use roxmltree::Node as Element;

impl<'t> ScxmlReader<'_, 't> {
    /// That `event` is what `davit:event` comes to there.
    pub(super) fn events_agree(&mut self, element: Element<'_, 't>, fqn: &str, of: &ChartTransition) {
        // A name without a namespace finds those of any.
        let plain =
            element.attributes().find(|attribute| attribute.namespace().is_none() && attribute.name() == "event");
        let (Some(said), Some(exact)) = (plain.map(|event| event.value()), own(element, "event")) else { return };
        let names = of.events.iter().filter_map(|(trigger, _)| event_name(trigger, fqn));
        let plain: Vec<String> = names.map(|name| plain_event(&name)).collect();
        if said.split_whitespace().ne(plain.iter().map(String::as_str)) {
            let message = format!("`event` says `{said}`, and `davit:event` beside it `{exact}`");
            let help = "change `davit:event`, by which it is read, and `event`, by which others read it; or leave `davit:event` out";
            let origin = self.at_value(element, "event");
            self.cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(origin).help(help));
        }
    }

    /// That what a state sends itself later comes when its transitions say.
    pub(super) fn times_agree(&mut self, state: Element<'_, 't>, fqn: &str, transitions: &[ChartTransition]) {
        let blocks = state.children().filter(|child| child.has_tag_name((SCXML, "onentry")));
        let sends = blocks.flat_map(|block| block.children()).filter(|child| own(*child, "timer").is_some());
        for send in sends.collect::<Vec<_>>() {
            let (Some(event), Some(delay)) = (send.attribute("event"), send.attribute("delay")) else { continue };
            let mut timed = transitions.iter().flat_map(|of| &of.events).filter_map(|(trigger, _)| match trigger {
                Trigger::Timed(timed) if timed.since == Since::Entry => Some(timed),
                _ => None,
            });
            let meant = timed.find(|timed| plain_event(&timed.event_of(fqn)) == event);
            let agrees = meant.is_some_and(|timed| seconds(delay) == Some(timed.seconds.max(0.0)));
            if !agrees {
                let other = match meant {
                    Some(timed) => format!("the transition that waits for it has `{}`", Trigger::Timed(timed.clone())),
                    None => "no transition of this state waits for it".to_owned(),
                };
                let message = format!("`{event}` is sent after `{delay}`, and {other}");
                let help =
                    "change both, `davit:event` and `delay`; or leave `davit:event` out there and `davit:timer` here";
                let origin = self.at_value(send, "delay");
                self.cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(origin).help(help));
            }
        }
    }
}
