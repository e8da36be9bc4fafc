//! Rust types as values of the model: what travels through ports, is a property, an argument or a result.

use crate::model::monitor::ValuePart;
use crate::model::{EventName, Ident, Value, ValueType};
use std::sync::Arc;

/// A Rust type whose values are values of the model. Implemented for `bool`, the integer types, `f64`, `f32`, `String`,
/// `Arc<str>`, [`EventName`], arrays, `Vec`, nalgebra's `SVector` (`float[N]`) and structs made with [`record!`](crate::record).
///
/// Two Rust types of the same [`ValueType`] (`i32` and `i64`; `[f64; 3]` and `Vector3<f64>`) may be connected; samples
/// are then converted on their way, which costs an allocation or more. Ports of one Rust type convert nothing.
pub trait PortValue: Clone + Send + 'static {
    /// The model's type of these values.
    fn value_type() -> ValueType;

    /// The value.
    fn to_value(&self) -> Value;

    /// The value as this type; none when it is not of [`PortValue::value_type`], or does not fit (300 is no `u8`).
    fn from_value(value: &Value) -> Option<Self>;

    /// The number on this way into the value, bools as 0 and 1: what a monitor looks at. None when there is no number.
    ///
    /// Allocates nothing for the types named above; a type of your own that does not say otherwise goes through
    /// [`PortValue::to_value`].
    fn number(&self, path: &[ValuePart]) -> Option<f64> {
        self.to_value().number(path)
    }

    /// The smallest and largest number a Rust type can hold where the model's type holds more; they limit properties.
    fn limits() -> Option<(f64, f64)> {
        None
    }
}

fn text(value: &Value) -> Option<&Arc<str>> {
    if let Value::Str(text) = value { Some(text) } else { None }
}

/// Types that are one value of the model: which, the way there and back, and the number that it is.
macro_rules! scalars {
    ($($(#[$attribute:meta])* $ty:ty: $model:ident, $to:expr, $from:expr, $number:expr;)*) => {$(
        impl PortValue for $ty {
            fn value_type() -> ValueType {
                ValueType::$model
            }
            fn to_value(&self) -> Value {
                let to: fn(&Self) -> Value = $to;
                to(self)
            }
            $(#[$attribute])*
            fn from_value(value: &Value) -> Option<Self> {
                let from: fn(&Value) -> Option<Self> = $from;
                from(value)
            }
            fn number(&self, path: &[ValuePart]) -> Option<f64> {
                let number: fn(&Self) -> Option<f64> = $number;
                if path.is_empty() { number(self) } else { None }
            }
        }
    )*};
}

scalars! {
    bool: Bool, |v| Value::Bool(*v), |value| if let Value::Bool(v) = value { Some(*v) } else { None }, |v| Some(f64::from(u8::from(*v)));
    f64: Float, |v| Value::Float(*v), Value::as_f64, |v| Some(*v);
    #[allow(clippy::cast_possible_truncation)]
    f32: Float, |v| Value::Float(f64::from(*v)), |value| value.as_f64().map(|v| v as Self), |v| Some(f64::from(*v));
    String: Str, |v| Value::str(v), |value| text(value).map(ToString::to_string), |_| None;
    Arc<str>: Str, |v| Value::Str(v.clone()), |value| text(value).cloned(), |_| None;
    EventName: Event, |v| Value::str(v.as_str()), |value| Self::new(text(value)?).ok(), |_| None;
}

macro_rules! integers {
    ($($ty:ty),*) => {$(
        impl PortValue for $ty {
            fn value_type() -> ValueType {
                ValueType::Int
            }
            /// The largest `int` stands for what is larger still.
            fn to_value(&self) -> Value {
                Value::Int(i64::try_from(*self).unwrap_or(i64::MAX))
            }
            fn from_value(value: &Value) -> Option<Self> {
                match value {
                    Value::Int(v) => Self::try_from(*v).ok(),
                    _ => None,
                }
            }
            #[allow(clippy::cast_precision_loss, clippy::cast_lossless)]
            fn number(&self, path: &[ValuePart]) -> Option<f64> {
                path.is_empty().then_some(*self as f64)
            }
            #[allow(clippy::cast_precision_loss, clippy::cast_lossless)]
            fn limits() -> Option<(f64, f64)> {
                (Self::BITS < 64 || Self::MIN == 0).then(|| {
                    // The model's numbers end where an i64 does; the largest f64 below that is 2^63 - 1024.
                    (Self::MIN as f64, (Self::MAX as f64).min(9_223_372_036_854_774_784.0))
                })
            }
        }
    )*};
}
integers!(i8, i16, i32, i64, u8, u16, u32, u64, usize);

impl<T: PortValue, const N: usize> PortValue for [T; N] {
    fn value_type() -> ValueType {
        ValueType::Array(Box::new(T::value_type()), Some(N))
    }
    fn to_value(&self) -> Value {
        Value::Array(self.iter().map(T::to_value).collect())
    }
    fn from_value(value: &Value) -> Option<Self> {
        let Value::Array(values) = value else { return None };
        if values.len() != N {
            return None;
        }
        let mut fits = true;
        let converted: [Option<T>; N] = std::array::from_fn(|i| {
            let element = T::from_value(&values[i]);
            fits &= element.is_some();
            element
        });
        fits.then(|| converted.map(|element| element.expect("all elements fit")))
    }
    fn number(&self, path: &[ValuePart]) -> Option<f64> {
        element(self, path)
    }
    fn limits() -> Option<(f64, f64)> {
        T::limits()
    }
}

impl<T: PortValue> PortValue for Vec<T> {
    fn value_type() -> ValueType {
        ValueType::Array(Box::new(T::value_type()), None)
    }
    fn to_value(&self) -> Value {
        Value::Array(self.iter().map(T::to_value).collect())
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Array(values) => values.iter().map(T::from_value).collect(),
            _ => None,
        }
    }
    fn number(&self, path: &[ValuePart]) -> Option<f64> {
        element(self, path)
    }
    fn limits() -> Option<(f64, f64)> {
        T::limits()
    }
}

impl<const N: usize> PortValue for nalgebra::SVector<f64, N> {
    fn value_type() -> ValueType {
        <[f64; N]>::value_type()
    }
    fn to_value(&self) -> Value {
        Value::floats(self.as_slice())
    }
    fn from_value(value: &Value) -> Option<Self> {
        <[f64; N]>::from_value(value).map(Self::from)
    }
    fn number(&self, path: &[ValuePart]) -> Option<f64> {
        element(self.as_slice(), path)
    }
}

fn element<T: PortValue>(values: &[T], path: &[ValuePart]) -> Option<f64> {
    match path.split_first()? {
        (ValuePart::Index(index), rest) => values.get(*index)?.number(rest),
        (ValuePart::Field(_), _) => None,
    }
}

/// The field `name` of a record, for [`record!`](crate::record).
#[doc(hidden)]
pub fn field<T: PortValue>(value: &Value, name: &str) -> Option<T> {
    match value {
        Value::Record(fields) => fields.iter().find(|(n, _)| n.as_str() == name).and_then(|(_, v)| T::from_value(v)),
        _ => None,
    }
}

/// The name of a field, for [`record!`](crate::record).
#[doc(hidden)]
pub fn field_name(name: &str) -> Ident {
    Ident::new(name).expect("a Rust field's name is a name")
}

/// Structs that are records of the model: `{pos: float[5], stamp: float}`.
///
/// ```
/// davit::record! {
///     /// What the joints measure.
///     #[derive(Copy, Default)]
///     pub struct JointState {
///         /// Angles, rad.
///         pub pos: [f64; 5],
///         /// Speeds, rad/s.
///         pub vel: [f64; 5],
///     }
/// }
/// use davit::component::PortValue;
/// assert_eq!(JointState::value_type().to_string(), "{pos: float[5], vel: float[5]}");
/// ```
///
/// `Debug`, `Clone` and `PartialEq` are derived; more may be asked for.
#[macro_export]
macro_rules! record {
    ($($(#[$attribute:meta])* $vis:vis struct $name:ident {
        $($(#[$field_attribute:meta])* $field_vis:vis $field:ident : $ty:ty),+ $(,)?
    })+) => {$(
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq)]
        $vis struct $name {
            $($(#[$field_attribute])* $field_vis $field: $ty,)+
        }

        impl $crate::component::PortValue for $name {
            fn value_type() -> $crate::ValueType {
                $crate::ValueType::Record(vec![$((
                    $crate::component::recorded::field_name(stringify!($field)),
                    <$ty as $crate::component::PortValue>::value_type(),
                )),+])
            }
            fn to_value(&self) -> $crate::Value {
                $crate::Value::Record(vec![$((
                    $crate::component::recorded::field_name(stringify!($field)),
                    $crate::component::PortValue::to_value(&self.$field),
                )),+])
            }
            fn from_value(value: &$crate::Value) -> Option<Self> {
                Some(Self { $($field: $crate::component::recorded::field(value, stringify!($field))?),+ })
            }
            fn number(&self, path: &[$crate::component::ValuePart]) -> Option<f64> {
                let ($crate::component::ValuePart::Field(field), rest) = path.split_first()? else { return None };
                $(if field.as_str() == stringify!($field) {
                    return $crate::component::PortValue::number(&self.$field, rest);
                })+
                None
            }
        }
    )+};
}

pub use record;

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Debug;

    record! {
        struct Pose {
            at: [f64; 3],
            id: u8,
        }
    }

    fn there_and_back<T: PortValue + PartialEq + Debug>(v: &T) {
        let value = v.to_value();
        assert!(value.is_of(&T::value_type()), "{value} is no {}", T::value_type());
        assert_eq!(T::from_value(&value).as_ref(), Some(v));
        // Every way that may lead to a number leads to the same one in the model's value.
        for text in ["A.x", "A.x[1]", "A.x[0][1]", "A.x.at[2]", "A.x.id", "A.x[0].at[1]", "A.x[9]", "A.x.none"] {
            let path = text.parse::<crate::model::monitor::PortSignal>().unwrap().path;
            assert_eq!(v.number(&path), value.number(&path), "{value} {text}");
        }
    }

    #[test]
    fn values_come_back() {
        there_and_back(&true);
        there_and_back(&-3_i32);
        there_and_back(&2.5);
        there_and_back(&"text".to_owned());
        there_and_back(&[[1.0, 2.0], [3.0, 4.0]]);
        there_and_back(&vec![1_u8, 2, 3]);
        there_and_back(&nalgebra::Vector3::new(1.0, 2.0, 3.0));
        there_and_back(&EventName::new("e_done").unwrap());
        there_and_back(&vec![Pose { at: [1.0, 2.0, 3.0], id: 7 }]);
        assert_eq!(Pose::value_type().to_string(), "{at: float[3], id: int}");
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert_eq!(u8::from_value(&Value::Int(300)), None);
        assert_eq!(<[f64; 2]>::from_value(&Value::floats(&[1.0])), None);
        assert_eq!(<[u8; 2]>::from_value(&Value::Array(vec![Value::Int(1), Value::Int(-1)])), None);
        assert_eq!(Pose::from_value(&Value::Record(vec![])), None);
    }
}
