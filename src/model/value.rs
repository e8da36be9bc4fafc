//! Values and their types.

use super::monitor::ValuePart;
use super::names::Ident;
use crate::model::finding::count;
use serde::Serialize;
use std::fmt;
use std::sync::Arc;

/// The type of a property, a port, an operation's argument or result.
///
/// Written `bool`, `int`, `float`, `string`, `event`, `float[3]` (exactly three), `float[]` (any number),
/// `{x: float, y: float}`.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum ValueType {
    /// `bool`
    Bool,
    /// `int`: 64 bits, signed.
    Int,
    /// `float`: IEEE 754 double, finite.
    Float,
    /// `string`
    Str,
    /// `event`: a port that carries event names. Ports only; a FIFO whatever the connection's policy says.
    Event,
    /// `T[n]` or `T[]`
    Array(Box<ValueType>, Option<usize>),
    /// `{field: T, …}`, in the order written.
    Record(Vec<(Ident, ValueType)>),
}

/// A value.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A truth value.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A finite number.
    Float(f64),
    /// A text.
    Str(Arc<str>),
    /// Elements of one type.
    Array(Vec<Value>),
    /// Fields, in the order of the type once a value has been fitted to it.
    #[serde(serialize_with = "record_as_map")]
    Record(Vec<(Ident, Value)>),
}

fn record_as_map<S: serde::Serializer>(fields: &[(Ident, Value)], s: S) -> Result<S::Ok, S::Error> {
    s.collect_map(fields.iter().map(|(k, v)| (k, v)))
}

impl Clone for Value {
    fn clone(&self) -> Self {
        match self {
            Self::Bool(v) => Self::Bool(*v),
            Self::Int(v) => Self::Int(*v),
            Self::Float(v) => Self::Float(*v),
            Self::Str(v) => Self::Str(v.clone()),
            Self::Array(v) => Self::Array(v.clone()),
            Self::Record(v) => Self::Record(v.clone()),
        }
    }

    /// Reuses the memory of `self` where the shapes agree: writing a value of the same type allocates nothing.
    fn clone_from(&mut self, source: &Self) {
        match (self, source) {
            (Self::Array(to), Self::Array(from)) => to.clone_from(from),
            (Self::Record(to), Self::Record(from)) if to.len() == from.len() => {
                for ((to_name, to), (from_name, from)) in to.iter_mut().zip(from) {
                    *to_name = *from_name;
                    to.clone_from(from);
                }
            }
            (to, from) => *to = from.clone(),
        }
    }
}

/// Bit for bit, so that equality is an equivalence (values are finite: NaN is refused where values enter).
impl PartialEq for Value {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Bool(a), Self::Bool(b)) => a == b,
            (Self::Int(a), Self::Int(b)) => a == b,
            (Self::Float(a), Self::Float(b)) => a == b || a.to_bits() == b.to_bits(),
            (Self::Str(a), Self::Str(b)) => a == b,
            (Self::Array(a), Self::Array(b)) => a == b,
            (Self::Record(a), Self::Record(b)) => a == b,
            _ => false,
        }
    }
}
impl Eq for Value {}

/// Why a value is not one of a type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FitError {
    /// Another kind of value.
    #[error("expected {expected}, found {found}")]
    Type {
        /// The type wanted (of the element or field at fault).
        expected: ValueType,
        /// What was given, in words.
        found: String,
    },
    /// An array of another length.
    #[error("expected {}, found {found}", count(expected, "element"))]
    Length {
        /// Elements wanted.
        expected: usize,
        /// Elements given.
        found: usize,
    },
    /// A record without one of its fields.
    #[error("the field `{0}` is missing")]
    MissingField(Ident),
    /// A record with a field its type does not have.
    #[error("there is no field `{0}` in {1}")]
    UnknownField(Ident, ValueType),
    /// NaN or an infinity.
    #[error("{0} is not a finite number")]
    NotFinite(String),
}

impl Value {
    /// A text value.
    pub fn str(text: &str) -> Self {
        Self::Str(Arc::from(text))
    }

    /// An array of floats.
    pub fn floats(values: &[f64]) -> Self {
        Self::Array(values.iter().map(|v| Self::Float(*v)).collect())
    }

    /// What kind of value it is, for messages: `an int (3)`.
    pub fn describe(&self) -> String {
        match self {
            Self::Bool(v) => format!("a bool ({v})"),
            Self::Int(v) => format!("an int ({v})"),
            Self::Float(v) => format!("a float ({v})"),
            Self::Str(v) => format!("a string ({:?})", v.chars().take(24).collect::<String>()),
            Self::Array(v) => format!("an array of {}", v.len()),
            Self::Record(_) => "a record".to_owned(),
        }
    }

    /// This value as one of type `ty`: an int where a float is wanted becomes one (never the reverse), a record's
    /// fields come into the type's order, an empty record stands for an empty array (Lua writes both `{}`).
    ///
    /// # Errors
    /// `FitError`, naming the element at fault.
    pub fn fit(self, ty: &ValueType) -> Result<Self, FitError> {
        match (ty, self) {
            (ValueType::Bool, v @ Self::Bool(_))
            | (ValueType::Int, v @ Self::Int(_))
            | (ValueType::Str | ValueType::Event, v @ Self::Str(_)) => Ok(v),
            (ValueType::Float, Self::Int(v)) =>
            {
                #[allow(clippy::cast_precision_loss)]
                Ok(Self::Float(v as f64))
            }
            (ValueType::Float, Self::Float(v)) => {
                if v.is_finite() {
                    Ok(Self::Float(v))
                } else {
                    Err(FitError::NotFinite(v.to_string()))
                }
            }
            (ValueType::Array(element, length), Self::Array(values)) => {
                if let Some(expected) = *length
                    && values.len() != expected
                {
                    return Err(FitError::Length { expected, found: values.len() });
                }
                values.into_iter().map(|v| v.fit(element)).collect::<Result<_, _>>().map(Self::Array)
            }
            (ValueType::Array(..), Self::Record(fields)) if fields.is_empty() => Self::Array(Vec::new()).fit(ty),
            (ValueType::Record(fields), Self::Record(mut values)) => {
                let mut fitted = Vec::with_capacity(fields.len());
                for (name, field) in fields {
                    let at = values.iter().position(|(n, _)| n == name).ok_or(FitError::MissingField(*name))?;
                    fitted.push((*name, values.swap_remove(at).1.fit(field)?));
                }
                match values.first() {
                    Some((name, _)) => Err(FitError::UnknownField(*name, ty.clone())),
                    None => Ok(Self::Record(fitted)),
                }
            }
            (_, v) => Err(FitError::Type { expected: ty.clone(), found: v.describe() }),
        }
    }

    /// Whether this is exactly a value of type `ty` (as [`Value::fit`] leaves it).
    pub fn is_of(&self, ty: &ValueType) -> bool {
        match (ty, self) {
            (ValueType::Bool, Self::Bool(_))
            | (ValueType::Int, Self::Int(_))
            | (ValueType::Str | ValueType::Event, Self::Str(_)) => true,
            (ValueType::Float, Self::Float(v)) => v.is_finite(),
            (ValueType::Array(element, length), Self::Array(values)) => {
                length.is_none_or(|n| n == values.len()) && values.iter().all(|v| v.is_of(element))
            }
            (ValueType::Record(fields), Self::Record(values)) => {
                fields.len() == values.len() && fields.iter().zip(values).all(|((n, t), (m, v))| n == m && v.is_of(t))
            }
            _ => false,
        }
    }

    /// Calls `f` with every number in the value, at any depth.
    pub fn for_each_number(&self, f: &mut impl FnMut(f64)) {
        match self {
            #[allow(clippy::cast_precision_loss)]
            Self::Int(v) => f(*v as f64),
            Self::Float(v) => f(*v),
            Self::Array(values) => values.iter().for_each(|v| v.for_each_number(f)),
            Self::Record(fields) => fields.iter().for_each(|(_, v)| v.for_each_number(f)),
            Self::Bool(_) | Self::Str(_) => {}
        }
    }

    /// The number, if it is one.
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            #[allow(clippy::cast_precision_loss)]
            Self::Int(v) => Some(*v as f64),
            Self::Float(v) => Some(*v),
            _ => None,
        }
    }

    /// The number on this way into the value, bools as 0 and 1; none when there is no number.
    pub fn number(&self, path: &[ValuePart]) -> Option<f64> {
        match (path.split_first(), self) {
            (None, Self::Bool(v)) => Some(f64::from(u8::from(*v))),
            (None, value) => value.as_f64(),
            (Some((ValuePart::Index(index), rest)), Self::Array(values)) => values.get(*index)?.number(rest),
            (Some((ValuePart::Field(field), rest)), Self::Record(fields)) => {
                fields.iter().find(|(name, _)| name == field).and_then(|(_, value)| value.number(rest))
            }
            _ => None,
        }
    }
}

/// The value as it is written in Lua and in messages: `{0.1, 0.1, 0.1}`, `{x = 1.0}`, `"text"`, `1.0` (a float keeps
/// its point, so that it reads back as a float).
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(v) => write!(f, "{v}"),
            Self::Int(v) => write!(f, "{v}"),
            Self::Float(v) => write!(f, "{v:?}"),
            Self::Str(v) => write!(f, "{v:?}"),
            Self::Array(values) => {
                f.write_str("{")?;
                for (i, v) in values.iter().enumerate() {
                    write!(f, "{}{v}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str("}")
            }
            Self::Record(fields) => {
                f.write_str("{")?;
                for (i, (name, v)) in fields.iter().enumerate() {
                    write!(f, "{}{name} = {v}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str("}")
            }
        }
    }
}

/// A number as tables of samples have it: with an exponent where it would be written with many zeros, so that who reads them takes it for a number.
#[derive(Debug, Clone, Copy)]
pub struct SampleText(pub f64);

impl fmt::Display for SampleText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.0.abs();
        match size.is_finite() && (size >= 1e16 || size != 0.0 && size < 1e-5) {
            true => write!(f, "{:e}", self.0),
            false => write!(f, "{}", self.0),
        }
    }
}

impl From<bool> for Value {
    fn from(v: bool) -> Self {
        Self::Bool(v)
    }
}
impl From<i64> for Value {
    fn from(v: i64) -> Self {
        Self::Int(v)
    }
}
impl From<f64> for Value {
    fn from(v: f64) -> Self {
        Self::Float(v)
    }
}
impl From<&str> for Value {
    fn from(v: &str) -> Self {
        Self::str(v)
    }
}

impl fmt::Display for ValueType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool => f.write_str("bool"),
            Self::Int => f.write_str("int"),
            Self::Float => f.write_str("float"),
            Self::Str => f.write_str("string"),
            Self::Event => f.write_str("event"),
            Self::Array(element, Some(n)) => write!(f, "{element}[{n}]"),
            Self::Array(element, None) => write!(f, "{element}[]"),
            Self::Record(fields) => {
                f.write_str("{")?;
                for (i, (name, ty)) in fields.iter().enumerate() {
                    write!(f, "{}{name}: {ty}", if i == 0 { "" } else { ", " })?;
                }
                f.write_str("}")
            }
        }
    }
}

super::words::sent_as_shown!(ValueType);

/// Why a text is not a type.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a type: write bool, int, float, string, event, T[n], T[] or {{name: T, …}}")]
pub struct TypeError(pub String);

impl std::str::FromStr for ValueType {
    type Err = TypeError;

    fn from_str(text: &str) -> Result<Self, TypeError> {
        let error = || TypeError(text.chars().take(60).collect());
        let mut rest = text;
        let ty = parse_type(&mut rest, 0).ok_or_else(error)?;
        if rest.trim().is_empty() { Ok(ty) } else { Err(error()) }
    }
}

/// Nesting of types is bounded: a type is written by hand, and deeper ones are mistakes or attacks.
const TYPE_DEPTH: usize = 16;

fn parse_type(rest: &mut &str, depth: usize) -> Option<ValueType> {
    if depth > TYPE_DEPTH {
        return None;
    }
    *rest = rest.trim_start();
    let mut ty = if let Some(after) = rest.strip_prefix('{') {
        *rest = after;
        let mut fields: Vec<(Ident, ValueType)> = Vec::new();
        loop {
            *rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix('}') {
                *rest = after;
                break;
            }
            let (name, after) = rest.split_once(':')?;
            let name = Ident::new(name.trim()).ok()?;
            if fields.iter().any(|(n, _)| *n == name) {
                return None;
            }
            *rest = after;
            fields.push((name, parse_type(rest, depth + 1)?));
            *rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix(',') {
                *rest = after;
            } else if !rest.starts_with('}') {
                return None;
            }
        }
        if fields.is_empty() {
            return None;
        }
        ValueType::Record(fields)
    } else {
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        *rest = after;
        match word {
            "bool" => ValueType::Bool,
            "int" => ValueType::Int,
            "float" => ValueType::Float,
            "string" => ValueType::Str,
            "event" => ValueType::Event,
            _ => return None,
        }
    };
    let mut layers = 0;
    while let Some(after) = rest.trim_start().strip_prefix('[') {
        layers += 1;
        if layers + depth > TYPE_DEPTH || ty == ValueType::Event {
            return None;
        }
        let (length, after) = after.split_once(']')?;
        let length = match length.trim() {
            "" => None,
            n => Some(n.parse::<usize>().ok().filter(|n| *n <= 65_536)?),
        };
        *rest = after;
        ty = ValueType::Array(Box::new(ty), length);
    }
    Some(ty)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ty(text: &str) -> ValueType {
        text.parse().unwrap()
    }

    #[test]
    fn tables_write_numbers_that_are_read_as_numbers() {
        let text = |value| SampleText(value).to_string();
        assert_eq!([text(0.0), text(0.5), text(-120.0), text(1e15)], ["0", "0.5", "-120", "1000000000000000"]);
        assert_eq!([text(1e20), text(-1e300), text(2.5e-9)], ["1e20", "-1e300", "2.5e-9"]);
        assert_eq!(text(f64::INFINITY), "inf");
        for value in [1e20, 3.0e-7, 0.1, 123.456] {
            assert_eq!(text(value).parse(), Ok(value));
        }
    }

    #[test]
    fn types_print_as_they_are_read() {
        for text in ["bool", "float[3]", "float[]", "{x: float, y: float}", "{pos: float[5], id: int}[2]"] {
            assert_eq!(ty(text).to_string(), text);
        }
        for text in ["", "double", "float[", "float[-1]", "{}", "{x float}", "float]", "event[3]", "{x: int, x: int}"] {
            assert!(text.parse::<ValueType>().is_err(), "{text}");
        }
        assert!("[".repeat(100_000).parse::<ValueType>().is_err());
    }

    #[test]
    fn fitting() {
        assert_eq!(Value::Int(3).fit(&ty("float")).unwrap(), Value::Float(3.0));
        assert!(Value::Float(3.0).fit(&ty("int")).is_err());
        assert!(Value::Float(f64::NAN).fit(&ty("float")).is_err());
        assert!(Value::floats(&[1.0, 2.0]).fit(&ty("float[3]")).is_err());
        assert!(Value::floats(&[1.0, f64::INFINITY]).fit(&ty("float[]")).is_err());
    }
}
