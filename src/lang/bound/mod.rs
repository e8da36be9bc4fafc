//! Where the value of each key goes: both readers and both printers go through one list a table.
//!
//! A row of the [grammar](super::grammar) says what can be written; here stands which field of the model it is. One more key is a
//! row there, a field in the model, and its name in the list.

mod kinds;
mod of_charts;
mod of_configurations;
mod of_deployments;
mod of_types;
mod tables;

pub use of_charts::function;
pub use tables::{
    ACTIVITY, CONFIGURATION, CONNECTOR, DEPLOYMENT, FAULT, LIMITS, MONITOR, OPERATION, PARAMETER, PORT, PROPERTY,
    REACTION, STATE, TRANSITION, TYPE,
};

use super::grammar::{Key, Object};
use super::tree::{Cx, Fields};
use crate::diagnostics::Language;
use crate::model::monitor::Condition;

/// What can stand behind a key.
pub trait WrittenValue: Sized {
    /// What stands behind `key`; none where nothing does, and where it is wrong, which is told.
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self>;

    /// Whether it is what holds without the key.
    fn goes_without_saying(&self, _row: &Key) -> bool {
        false
    }

    /// Its text.
    fn text(&self, row: &Key, pen: &mut Pen) -> String;
}

/// What a value is printed with.
pub struct Pen<'a> {
    /// In which language.
    pub language: Language,
    /// How conditions are printed: those of one text may share parts.
    pub condition: &'a mut dyn FnMut(&Condition) -> String,
}

/// A key with what stands behind it.
pub type WrittenKey = (&'static str, String);

/// Which field of `T` a key is.
pub struct BoundKey<T> {
    key: &'static str,
    /// Reads it, if it is there; answers whether it was.
    read: fn(&mut T, &mut Fields, &mut Cx) -> bool,
    print: fn(&T, &Key, &mut Pen) -> Option<String>,
}

/// The keys of a table of which each is one field of `T`, in the order in which they are printed.
pub struct BoundTable<T: 'static> {
    table: &'static Object,
    keys: &'static [BoundKey<T>],
}

impl<T> BoundTable<T> {
    /// Its keys as they are written, conditions each by itself.
    pub fn plain(&self, of: &T, language: Language) -> Vec<WrittenKey> {
        let mut condition = |of: &Condition| super::print::condition(of, language);
        self.written(of, &mut Pen { language, condition: &mut condition })
    }

    /// Reads its keys into `of`. Answers whether all those are there that must be.
    pub fn read(&self, of: &mut T, fields: &mut Fields, cx: &mut Cx) -> bool {
        let mut whole = true;
        for bound in self.keys {
            let is_there = (bound.read)(of, fields, cx);
            whole &= is_there || !fields.row(bound.key).required;
        }
        whole
    }

    /// Its keys as they are written, without those that say what holds without them.
    pub fn written(&self, of: &T, pen: &mut Pen) -> Vec<WrittenKey> {
        let one = |bound: &BoundKey<T>| {
            let row = self.table.key(bound.key).expect("a bound key has a row");
            (bound.print)(of, row, pen).map(|text| (bound.key, text))
        };
        self.keys.iter().filter_map(one).collect()
    }
}

/// A field that `T` may have or not.
impl<T: WrittenValue> WrittenValue for Option<T> {
    fn read(fields: &mut Fields, cx: &mut Cx, key: &'static str) -> Option<Self> {
        T::read(fields, cx, key).map(Some)
    }

    fn goes_without_saying(&self, _row: &Key) -> bool {
        self.is_none()
    }

    fn text(&self, row: &Key, pen: &mut Pen) -> String {
        self.as_ref().map(|of| of.text(row, pen)).unwrap_or_default()
    }
}

/// Reads what stands behind `key` into `place`.
fn read_into<V: WrittenValue>(place: &mut V, key: &'static str, fields: &mut Fields, cx: &mut Cx) -> bool {
    let value = V::read(fields, cx, key);
    let is_there = value.is_some();
    value.into_iter().for_each(|value| *place = value);
    is_there
}

/// The text of what must be said.
fn said<V: WrittenValue>(value: &V, row: &Key, pen: &mut Pen) -> Option<String> {
    (!value.goes_without_saying(row)).then(|| value.text(row, pen))
}

/// The keys of a table, each with its field of the model: `key`, or `key: field` where they are called differently.
macro_rules! bound {
    ($table:ident, $model:ty: $($key:tt $(: $field:ident)?),* $(,)?) => {
        $crate::lang::bound::BoundTable::<$model> {
            table: &$crate::lang::grammar::$table,
            keys: &[$($crate::lang::bound::bound!(@ $model, $key, $($field)?)),*],
        }
    };
    (@ $model:ty, $key:ident,) => { $crate::lang::bound::bound!(@ $model, $key, $key) };
    (@ $model:ty, $key:ident, $field:ident) => {
        $crate::lang::bound::BoundKey::<$model> {
            key: stringify!($key),
            read: |of, fields, cx| $crate::lang::bound::read_into(&mut of.$field, stringify!($key), fields, cx),
            print: |of, row, pen| $crate::lang::bound::said(&of.$field, row, pen),
        }
    };
}

use bound;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::monitor::ConditionKind;
    use crate::model::statechart::{ChartTransition, State};
    use crate::model::{
        Activity, ComponentType, ConfigId, Configuration, DeploymentLimits, Direction, Effect, Ident, Monitor,
        OperationType, PortType, PropertyType, Tunable, ValueType,
    };

    /// What a reader begins with is what the rows say that holds without their keys.
    #[test]
    fn what_nobody_writes_goes_without_saying() {
        fn keys<T>(table: &BoundTable<T>, of: &T) -> Vec<&'static str> {
            table.plain(of, Language::Yaml).into_iter().map(|(key, _)| key).collect()
        }
        let name = || Ident::new("a").unwrap();
        let nothing = Condition::new(ConditionKind::All(Vec::new()));
        assert_eq!(keys(&CONFIGURATION, &Configuration::new(ConfigId::new("a").unwrap())), [""; 0]);
        assert_eq!(keys(&MONITOR, &Monitor::new(name(), nothing)), ["when"]);
        assert_eq!(keys(&STATE, &State::new(name())), [""; 0]);
        assert_eq!(keys(&TRANSITION, &ChartTransition::new("a", "b", [])), ["src", "tgt"]);
        assert_eq!(keys(&TYPE, &ComponentType::new("A", "")), [""; 0]);
        assert_eq!(keys(&PORT, &PortType::new(Direction::In, ValueType::Bool)), ["direction", "type"]);
        assert_eq!(keys(&PROPERTY, &PropertyType::new(ValueType::Bool, Tunable::default())), ["type"]);
        assert_eq!(keys(&OPERATION, &OperationType::new(Effect::Irreversible)), [""; 0]);
        assert_eq!(keys(&ACTIVITY, &Activity::default()), [""; 0]);
        assert_eq!(keys(&LIMITS, &DeploymentLimits::default()), [""; 0]);
    }
}
