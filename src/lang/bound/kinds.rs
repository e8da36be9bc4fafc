//! What is written alike wherever it stands: texts, numbers, times, names, words of a few, conditions, values.

use super::{Pen, WrittenValue};
use crate::lang::grammar::{Form, Key};
use crate::lang::lower::{condition, names, parse_time, value};
use crate::lang::print::fields::{list, quoted, text, texts, value as written};
use crate::lang::print::{float, milliseconds, seconds};
use crate::lang::tree::{Cx, Fields, Kind};
use crate::model::monitor::{Condition, Sampling};
use crate::model::names::NameError;
use crate::model::{ComponentName, Direction, EventName, FaultKind, Ident, Origin, Tunable, TypeName, Value};
use std::fmt::Display;
use std::str::FromStr;
use std::sync::Arc;
use std::time::Duration;

impl WrittenValue for bool {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.truth(cx, key)
    }

    fn goes_without_saying(&self, row: &Key) -> bool {
        *self == (row.default == "`true`")
    }

    fn text(&self, _row: &Key, _pen: &mut Pen) -> String {
        self.to_string()
    }
}

/// What a thing is for, in quotes.
impl WrittenValue for String {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.text(cx, key)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        quoted(self, pen.language)
    }
}

/// A unit.
impl WrittenValue for Arc<str> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.text(cx, key).map(Self::from)
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        text(self, pen.language)
    }
}

impl WrittenValue for f64 {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.number(cx, key)
    }

    fn goes_without_saying(&self, row: &Key) -> bool {
        row.default.parse() == Ok(*self)
    }

    fn text(&self, _row: &Key, _pen: &mut Pen) -> String {
        float(*self)
    }
}

/// Whole numbers, of which the bounds stand in the row.
macro_rules! whole {
    ($($number:ty),*) => {$(
        impl WrittenValue for $number {
            fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
                fields.whole(cx, key).and_then(|number| Self::try_from(number).ok())
            }

            fn goes_without_saying(&self, row: &Key) -> bool {
                row.default.parse() == Ok(*self)
            }

            fn text(&self, _row: &Key, _pen: &mut Pen) -> String {
                self.to_string()
            }
        }
    )*};
}

whole!(u8, u32, usize);

/// A time; without a word of another one in its row it is none at all.
impl WrittenValue for Duration {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.time(cx, key)
    }

    fn goes_without_saying(&self, row: &Key) -> bool {
        Self::from_secs_f64(parse_time(row.default).unwrap_or_default()) == *self
    }

    fn text(&self, row: &Key, _pen: &mut Pen) -> String {
        if matches!(row.form, Form::Milliseconds) { milliseconds(*self) } else { seconds(*self) }
    }
}

/// How often a monitor looks: the period, or each sample.
impl WrittenValue for Sampling {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        fields.time(cx, key).map(Self::Every)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        *self == Self::OnSample
    }

    fn text(&self, _row: &Key, _pen: &mut Pen) -> String {
        match self {
            Self::Every(period) => seconds(*period),
            Self::OnSample => String::new(),
        }
    }
}

/// Names.
macro_rules! named {
    ($($name:ty),*) => {$(
        impl WrittenValue for $name {
            fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
                fields.name(cx, key)
            }

            fn text(&self, _row: &Key, pen: &mut Pen) -> String {
                text(self.as_str(), pen.language)
            }
        }
    )*};
}

named!(Ident, EventName, ComponentName, TypeName);

/// Names that are listed, each of them once.
trait ListedName: FromStr<Err = NameError> + PartialEq + Display {}

impl ListedName for Ident {}
impl ListedName for TypeName {}
impl ListedName for EventName {}

impl<T: ListedName> WrittenValue for Vec<(T, Origin)> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        Some(names(cx, fields, key, &format!("`{key}`")))
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self.iter().map(|(name, _)| name), pen.language), pen.language)
    }
}

impl<T: ListedName> WrittenValue for Vec<T> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let all: Option<Vec<(T, Origin)>> = WrittenValue::read(fields, cx, key);
        all.map(|all| all.into_iter().map(|(name, _)| name).collect())
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_empty()
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        list(&texts(self, pen.language), pen.language)
    }
}

/// Words of which the list stands with the type.
macro_rules! by_word {
    ($($word:ty),*) => {$(
        impl WrittenValue for $word {
            fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
                fields.choice(cx, key, Self::WORDS)
            }

            fn goes_without_saying(&self, row: &Key) -> bool {
                row.default.trim_matches('`') == self.word()
            }

            fn text(&self, _row: &Key, pen: &mut Pen) -> String {
                text(self.word(), pen.language)
            }
        }
    )*};
}

by_word!(Direction, Tunable, FaultKind);

impl WrittenValue for Condition {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let mut node = fields.take(cx, key)?;
        // Lua knows the place of the whole table only.
        if !matches!(node.kind, Kind::Made(..) | Kind::Map(_)) {
            node.origin = cx.part(node.origin, key);
        }
        condition::condition(cx, node, 0)
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        (pen.condition)(self)
    }
}

impl WrittenValue for Value {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        let node = fields.take(cx, key)?;
        value(cx, node, &format!("`{key}`"))
    }

    fn text(&self, _row: &Key, pen: &mut Pen) -> String {
        written(self, pen.language)
    }
}
