//! What types of components and their members are written with.

use super::{Pen, WrittenValue};
use crate::lang::grammar::{EFFECT, Key};
use crate::lang::lower::{by_name, name, text as plain};
use crate::lang::print::fields::{list, table, text, texts};
use crate::lang::tree::{Cx, Entry, Fields, Kind, Node};
use crate::model::finding::nearest;
use crate::model::{Effect, EventName, Finding, Irreversible, Moves, Resource, ValueType, codes};
use std::collections::BTreeMap;

/// A type: a text (`float`, `"float[3]"`), or a record as a map (`{x: float, y: float}`).
impl WrittenValue for ValueType {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.take(cx, key).and_then(|node| value_type(cx, node))
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        text(&self.to_string(), pen.language)
    }
}

/// The types of arguments.
impl WrittenValue for Vec<ValueType> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let node = fields.take(cx, key)?;
        let Kind::List(all) = node.kind else {
            cx.wrong(&node, &format!("`{key}`"), "a list of types", fields.row(key).example);
            return None;
        };
        Some(all.into_iter().filter_map(|node| value_type(cx, node)).collect())
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self, pen.language), pen.language)
    }
}

/// What an operation leaves behind.
impl WrittenValue for Effect {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.take(cx, key).and_then(|node| effect(cx, node))
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        *self == Self::Irreversible
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::Irreversible => "irreversible".to_owned(),
            Self::Undo(operation) => table([("undo", text(operation.as_str(), pen.language))], pen.language),
        }
    }
}

/// The events that components of a type raise; what each tells is a library's to say.
impl WrittenValue for BTreeMap<EventName, String> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let raised: Option<Vec<EventName>> = WrittenValue::read(fields, cx, key);
        raised.map(|raised| raised.into_iter().map(|event| (event, String::new())).collect())
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self.keys(), pen.language), pen.language)
    }
}

/// Marks of a type, each a word.
macro_rules! marks {
    ($($marks:ty),*) => {$(
        impl WrittenValue for $marks {
            fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
                let words: Vec<_> = Self::WORDS.iter().map(|word| (*word, *word)).collect();
                let mut marks = Self::default();
                fields.choices(cx, key, &words).into_iter().for_each(|word| marks.mark(word));
                Some(marks)
            }

            fn goes_without_saying(&self, _row: &Key) -> bool {
                *self == Self::default()
            }

            fn text(&self, _row: &Key, pen: &mut Pen) -> String {
                list(&texts(self.words(), pen.language), pen.language)
            }
        }
    )*};
}

marks!(Moves, Irreversible);

/// What is needed for itself, each with the mistake in its text.
impl WrittenValue for Vec<Resource> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let mut all = Vec::new();
        for node in fields.several(cx, key) {
            let Some(text) = plain(cx, &node, &format!("`{key}`"), fields.row(key).example) else { continue };
            match Resource::parse(&text) {
                Ok(resource) => all.push(resource),
                Err(why) => cx.report(
                    Finding::error(codes::TEXT_BAD_VALUE, format!("`{text}` names nothing that a component could hold: {why}"))
                        .at(node.origin)
                        .help("write a name, `exclusive: [can0]`, or one with the value of a property, `exclusive: [\"can:{bus}\"]`"),
                ),
            }
        }
        Some(all)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self, pen.language), pen.language)
    }
}

/// `none`, `irreversible`, or `undo: OPERATION`: in a flow map `{…, effect: undo: park}` YAML allows no second colon, so
/// the text `undo: park` in quotes and the map `{ undo: park }` are both taken.
fn effect(cx: &mut Cx, node: Node) -> Option<Effect> {
    match &node.kind {
        Kind::Str(text) => {
            if let Some(operation) = text.strip_prefix("undo:") {
                let node = Node::new(Kind::Str(operation.trim().into()), node.origin);
                return name(cx, &node, "an operation", EFFECT.example).map(Effect::Undo);
            }
            let words = ["none", "irreversible"];
            match &**text {
                "none" => return Some(Effect::None),
                "irreversible" => return Some(Effect::Irreversible),
                _ => {}
            }
            let help = match nearest(text, words) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "known values: `none`, `irreversible`, `{ undo: OPERATION }`".to_owned(),
            };
            let (origin, message) = (cx.place(&node), format!("`effect` cannot be `{text}`"));
            cx.report(Finding::error(codes::TEXT_BAD_VALUE, message).at(origin).help(help));
            None
        }
        _ => {
            if !matches!(node.kind, Kind::Map(_)) {
                cx.wrong(&node, "`effect`", "`none`, `irreversible` or a table with `undo`", EFFECT.example);
                return None;
            }
            let mut fields = Fields::of(cx, node, &EFFECT)?;
            let operation = fields.name(cx, "undo");
            fields.finish(cx);
            operation.map(Effect::Undo)
        }
    }
}

/// A type: a text (`float`, `"float[3]"`), or a record as a map (`{x: float, y: float}`).
fn value_type(cx: &mut Cx, node: Node) -> Option<ValueType> {
    match node.kind {
        Kind::Str(text) => match text.parse() {
            Ok(ty) => Some(ty),
            Err(_) => {
                let origin = node.origin;
                let words = ["bool", "int", "float", "string", "event"];
                let (word, lengths) = text.split_at(text.find('[').unwrap_or(text.len()));
                let near = crate::model::finding::nearest(word.trim(), words);
                let help = near.map_or_else(
                    || {
                        "types are bool, int, float, string, event, \"float[3]\", \"float[]\", {x: float, y: float}"
                            .to_owned()
                    },
                    |near| format!("did you mean `{near}{lengths}`?"),
                );
                cx.report(
                    Finding::error(codes::TYPE_BAD_TYPE, format!("`{text}` is not a type")).at(origin).help(help),
                );
                None
            }
        },
        Kind::Map(entries) if !entries.is_empty() => {
            let length = entries.len();
            let one = |cx: &mut Cx, _, entry: Entry| value_type(cx, entry.value);
            let fields = by_name(cx, entries, "a field of a record", "{x: float, y: float}", one);
            (fields.len() == length).then_some(ValueType::Record(fields))
        }
        // `float[3]` without quotes inside brackets is read by YAML as a list: say so.
        Kind::List(_) => {
            cx.wrong(&node, "a type", "a text or a record", "\"float[3]\" (in quotes)");
            None
        }
        _ => {
            cx.wrong(&node, "a type", "a text or a record", "float");
            None
        }
    }
}
