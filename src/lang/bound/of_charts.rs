//! What states and transitions are written with.

use super::{Pen, WrittenValue};
use crate::lang::grammar::Key;
use crate::lang::lower::{bad_name, name, parse_time, text as plain};
use crate::lang::print::fields::{list, text, texts};
use crate::lang::tree::{Cx, Fields, Kind, Node};
use crate::model::statechart::{Action, Trigger};
use crate::model::{ConfigId, EventName, Finding, Origin, codes};

/// A source or a target, as it is written. That one is missing is told where the chart is compiled, with what it would have to be.
impl WrittenValue for (String, Origin) {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let node = fields.take_entry(key)?.value;
        let place = cx.place(&node);
        if matches!(node.kind, Kind::List(_)) {
            let message = format!("`{key}` must be one state, this is {}", node.describe());
            cx.report(Finding::error(codes::TEXT_WRONG_TYPE, message).at(place).labelled("expected a text").help(
                "write a transition for each, or put these states into one around them, and write that: a transition of a state serves for all inside",
            ));
            return None;
        }
        plain(cx, &node, &format!("`{key}`"), fields.row(key).example).map(|text| (text, place))
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        text(&self.0, pen.language)
    }
}

/// What triggers a transition: one or several.
impl WrittenValue for Vec<(Trigger, Origin)> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let mut all = Self::new();
        for node in fields.several(cx, key) {
            let (place, example) = (cx.place(&node), fields.row(key).example);
            match &node.kind {
                Kind::Str(text) => match Trigger::parse(text) {
                    Ok(trigger) => all.push((trigger, place)),
                    Err(error) => bad_name(cx, &node, &error, timed(text).as_deref().unwrap_or(example)),
                },
                Kind::Function => function(cx, &node, &format!("a predicate in `{key}`")),
                _ => cx.wrong(&node, "an event", "a name (a text)", example),
            }
        }
        Some(all)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.iter().all(|(trigger, _)| matches!(trigger, Trigger::Predicate(_)))
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        let told = self.iter().map(|(trigger, _)| trigger).filter(|of| !matches!(of, Trigger::Predicate(_)));
        list(&texts(told, pen.language), pen.language)
    }
}

/// How a time event is written that is written otherwise: with a unit, or without its brackets.
fn timed(text: &str) -> Option<String> {
    let word = ["e_after", "e_at"].into_iter().find(|word| text.starts_with(word))?;
    let rest = text[word.len()..].trim_matches(|c: char| c.is_whitespace() || "()=:".contains(c));
    Some(format!("events = {{ \"{word}({})\" }}", parse_time(rest)?))
}

/// Names to raise: one or several.
impl WrittenValue for Vec<(Action, Origin)> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let mut all = Self::new();
        for node in fields.several(cx, key) {
            if matches!(node.kind, Kind::Function) {
                function(cx, &node, &format!("`{key}`"));
                continue;
            }
            let place = cx.place(&node);
            let event = name::<EventName>(cx, &node, &format!("`{key}`"), fields.row(key).example);
            all.extend(event.map(|event| (Action::Raise(event), place)));
        }
        Some(all)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.iter().all(|(action, _)| !action.is_pure())
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        let raised = self.iter().filter_map(|(action, _)| match action {
            Action::Raise(event) => Some(*event),
            Action::Function(_) => None,
        });
        list(&texts(raised, pen.language), pen.language)
    }
}

/// Configurations of a state.
impl WrittenValue for Vec<(ConfigId, Origin)> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let mut all = Self::new();
        for node in fields.several(cx, key) {
            let id = name::<ConfigId>(cx, &node, &format!("`{key}`"), fields.row(key).example);
            let place = cx.place(&node);
            all.extend(id.map(|id| (id, place)));
        }
        Some(all)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self.iter().map(|(id, _)| id), pen.language), pen.language)
    }
}

/// A function in a chart: its place is known, its meaning comes later.
pub fn function(cx: &mut Cx, node: &Node, what: &str) {
    if !matches!(node.kind, Kind::Function) {
        let expected = "a function (names of events stand in `entry`, `exit` and `effect`)";
        if cx.is_lua(node.origin) {
            return cx.wrong(node, what, expected, "entry = \"e_ready\"");
        }
        // There are none in YAML.
        let instead =
            "let a monitor raise an event where that is so (`monitors:` in the deployment), and hear it in `events`";
        cx.wrong_so(node, what, expected, instead);
        return;
    }
    let message = format!("{what} is a function, and a coordinator that is not trusted must be pure");
    cx.report(Finding::error(codes::CHART_FUNCTION, message).at(node.origin).labelled("in this one").help(
        "write `trusted: true` in the deployment to let it run, or raise the name of an event instead \
         (`entry = \"e_ready\"`) and let a component or a monitor do the work",
    ));
}
