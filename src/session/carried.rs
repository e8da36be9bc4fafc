//! What ports carry, seen from outside: a look at one signal that is kept, and recordings' way to the numbers in it.

use super::Session;
use super::members::{MemberKind, NoMember, no};
use crate::limits;
use crate::model::monitor::{PortSignal, ValuePart};
use crate::model::{Value, ValueType};
use crate::monitor::{InputSample, MonitorInput};
use crate::platform::Watch;
use crate::time::{Signal, Time};
use serde_json::Value as Json;

/// A look at what a port carries, or at a part of it: what was written last, since the look began.
pub struct PortLook {
    ty: ValueType,
    watch: Box<dyn Watch>,
    samples: Vec<InputSample>,
    /// Notified whenever something is written there.
    pub wake: Signal,
}

/// What a signal leads to.
pub struct FoundSignal {
    /// The signal.
    pub signal: PortSignal,
    /// The type of what it leads to.
    pub ty: ValueType,
    /// What its member is.
    pub kind: MemberKind,
}

impl Session {
    /// A signal of a component that is there: `Component.port`, with `.field` and `[index]` behind it.
    ///
    /// # Errors
    /// When there is no such component, port or part.
    pub fn find_signal(&self, text: &str) -> Result<FoundSignal, NoMember> {
        let dot = text.find('.').map_or(text.len(), |dot| dot + 1);
        let end = text[dot..].find(['.', '[']).map_or(text.len(), |end| dot + end);
        let found = self.member(&text[..end])?;
        let signal: PortSignal = text
            .parse()
            .map_err(|why: crate::model::names::NameError| no(why.to_string(), "write it like `Arm.state.q[3]`"))?;
        let ty = signal.part(&found.ty).map_err(|wrong| no(wrong.message, wrong.help))?.clone();
        Ok(FoundSignal { signal, ty, kind: found.kind })
    }

    /// A look at what a port, or a part of it, carries from now on; `ty` is the type of what the signal leads to.
    ///
    /// # Errors
    /// When what goes through it is not shown.
    pub fn look_at(&self, signal: &PortSignal, ty: &ValueType) -> Result<PortLook, String> {
        let unseen = || format!("what goes through a port of the type {ty} is not shown");
        let parts = parts(ty).filter(|parts| parts.len() <= limits::GET_PARTS).ok_or_else(unseen)?;
        let below = |path: Vec<ValuePart>| {
            let path = signal.path.iter().copied().chain(path).collect();
            MonitorInput::Port(PortSignal { member: signal.member, path })
        };
        let inputs: Vec<MonitorInput> = parts.into_iter().map(below).collect();
        let wake = self.clock().signal();
        let watch = self.platform().watch(&inputs, &wake);
        let watch = watch.filter(|watch| (0..inputs.len()).all(|input| watch.shows(input)));
        let watch = watch.ok_or("this platform does not show what goes through ports")?;
        Ok(PortLook { ty: ty.clone(), watch, samples: vec![InputSample::default(); inputs.len()], wake })
    }
}

impl PortLook {
    /// The value written last, and when that was. None: nothing was, since the look began, or the port is gone.
    pub fn seen(&mut self, now: Time) -> Option<(Value, Time)> {
        self.watch.look(now, &mut self.samples);
        if !self.samples.iter().all(|sample| sample.present) {
            return None;
        }
        let at = self.samples.iter().map(|sample| sample.at).max().unwrap_or_default();
        Some((assembled(&self.ty, &mut self.samples.iter()), at))
    }
}

/// The ways to all numbers in a value of a type; none: there may be anything in it.
fn parts(ty: &ValueType) -> Option<Vec<Vec<ValuePart>>> {
    let below = |step: ValuePart, ty: &ValueType| -> Option<Vec<Vec<ValuePart>>> {
        let under = |path: Vec<ValuePart>| std::iter::once(step).chain(path).collect();
        Some(parts(ty)?.into_iter().map(under).collect())
    };
    match ty {
        ValueType::Bool | ValueType::Int | ValueType::Float => Some(vec![Vec::new()]),
        ValueType::Array(element, Some(length)) if *length <= limits::GET_PARTS => {
            let each = (0..*length).map(|at| below(ValuePart::Index(at), element)).collect::<Option<Vec<_>>>()?;
            Some(each.concat())
        }
        ValueType::Record(fields) => {
            let each =
                fields.iter().map(|(name, ty)| below(ValuePart::Field(*name), ty)).collect::<Option<Vec<_>>>()?;
            Some(each.concat())
        }
        _ => None,
    }
}

/// The value of that type whose numbers these are.
fn assembled<'a>(ty: &ValueType, numbers: &mut impl Iterator<Item = &'a InputSample>) -> Value {
    match ty {
        ValueType::Array(element, length) => {
            Value::Array((0..length.unwrap_or_default()).map(|_| assembled(element, numbers)).collect())
        }
        ValueType::Record(fields) => {
            Value::Record(fields.iter().map(|(name, ty)| (*name, assembled(ty, numbers))).collect())
        }
        _ => {
            let number = numbers.next().map_or(f64::NAN, |sample| sample.value);
            match ty {
                ValueType::Bool => Value::Bool(number != 0.0),
                #[allow(clippy::cast_possible_truncation)]
                ValueType::Int => Value::Int(number as i64),
                _ => Value::Float(number),
            }
        }
    }
}

/// A value as JSON has it; a number that is not finite is a text: `inf`, `-inf`, `nan`.
pub(super) fn shown(value: &Value) -> Json {
    match value {
        // JSON has no number for it, and null would be no value.
        Value::Float(number) if !number.is_finite() => number.to_string().to_lowercase().into(),
        Value::Array(elements) => elements.iter().map(shown).collect(),
        Value::Record(fields) => fields.iter().map(|(name, value)| (name.to_string(), shown(value))).collect(),
        other => serde_json::to_value(other).expect("values are plain data"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_is_told_as_text() {
        let sample = |value| InputSample { value, at: Time(0), writes: 1, present: true };
        let samples = [1.5, f64::INFINITY, f64::NEG_INFINITY, f64::NAN].map(sample);
        let ty = ValueType::Array(Box::new(ValueType::Float), Some(4));
        let seen = shown(&assembled(&ty, &mut samples.iter()));
        assert_eq!(seen, serde_json::json!([1.5, "inf", "-inf", "nan"]));
    }
}
