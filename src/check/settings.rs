//! What an operator may set (`operator: [Arm.gain]`), as the configurations of one change that it comes to.
//!
//! The value is the operator's to choose. It makes no difference to anybody else but by being another one than is there: what is
//! there already counts as written too, and needs no step that could fail. So one value is followed that nothing else gives;
//! where there is none, those that something does, of which one always is another.

use super::universe::Universe;
use crate::model::{
    Change, ChangeKind, ConfigId, Configuration, Deployment, Direction, Ident, MemberRef, OperatorMay, PropertyType,
    Value, ValueType,
};
use std::borrow::Cow;

/// The deployment as it is followed: what an operator may set is among what an operator may apply.
pub fn followed<'d>(deployment: &'d Deployment, universe: &Universe) -> Cow<'d, Deployment> {
    let mut followed = Cow::Borrowed(deployment);
    for (may, at) in &deployment.operator {
        let OperatorMay::Set(member) = may else { continue };
        for (value, kind) in changes(deployment, universe, *member) {
            let id = ConfigId::setting_to(*member, &value);
            if followed.configuration(id).is_none() {
                let followed = followed.to_mut();
                followed.configurations.push(Configuration::setting(id, kind));
                followed.operator.push((OperatorMay::Apply(id), *at));
            }
        }
    }
    followed
}

/// What setting a member may come to, by each type that its component may have: the value, and the change.
fn changes(deployment: &Deployment, universe: &Universe, member: MemberRef) -> Vec<(Value, ChangeKind)> {
    let given = given(deployment, member);
    let mut changes: Vec<(Value, ChangeKind)> = Vec::new();
    for ty in universe.of(member.component).iter().filter_map(|creation| creation.description.as_deref()) {
        let port = ty.port(member.member).filter(|port| port.direction == Direction::In);
        if let Some(declared) = ty.properties.get(&member.member) {
            let given: Vec<&Value> = declared.default.iter().chain(given.iter().copied()).collect();
            let values = values(&declared.ty, (declared.min, declared.max), &given, &|value| declared.fit(value).ok());
            changes.extend(values.into_iter().map(|value| {
                let kind = ChangeKind::PropertySet { property: member, value: value.clone() };
                (value, kind)
            }));
        } else if let Some(declared) = port {
            let values = values(&declared.ty, (None, None), &given, &|value| value.fit(&declared.ty).ok());
            changes.extend(values.into_iter().map(|value| {
                let kind = ChangeKind::PortWrite { port: member, value: value.clone() };
                (value, kind)
            }));
        }
    }
    changes
}

/// A value of a property that no configuration gives it; none: there is no such one.
pub fn another(deployment: &Deployment, property: MemberRef, declared: &PropertyType) -> Option<Value> {
    let given = given(deployment, property);
    let values = values(&declared.ty, (declared.min, declared.max), &given, &|value| declared.fit(value).ok());
    values
        .into_iter()
        .find(|value| !given.iter().any(|given| declared.fit((*given).clone()).ok().as_ref() == Some(value)))
}

/// The values that configurations give a member.
fn given<'d>(deployment: &'d Deployment, member: MemberRef) -> Vec<&'d Value> {
    let changes = deployment.configurations.iter().flat_map(|configuration| &configuration.changes);
    let value = |change: &'d Change| match &change.kind {
        ChangeKind::PropertySet { property: of, value } | ChangeKind::PortWrite { port: of, value } => {
            (*of == member).then_some(value)
        }
        kind => {
            let (_, _, properties) = kind.makes().filter(|(component, ..)| *component == member.component)?;
            properties.get(&member.member)
        }
    };
    changes.filter_map(value).collect()
}

/// One that nothing gives, or, if there is none, those that are given, as far as they fit.
fn values(
    ty: &ValueType,
    bounds: (Option<f64>, Option<f64>),
    given: &[&Value],
    fit: &dyn Fn(Value) -> Option<Value>,
) -> Vec<Value> {
    let mut values: Vec<Value> = Vec::new();
    for value in given.iter().filter_map(|value| fit((*value).clone())) {
        if !values.contains(&value) {
            values.push(value);
        }
    }
    let others = (0..=values.len()).filter_map(|n| fit(some(ty, bounds, n)?));
    let other = others.into_iter().find(|value| !values.contains(value));
    other.map_or(values, |other| vec![other])
}

/// Values of a type, one after the other.
fn some(ty: &ValueType, bounds: (Option<f64>, Option<f64>), n: usize) -> Option<Value> {
    #[allow(clippy::cast_precision_loss)]
    let count = n as f64;
    Some(match ty {
        ValueType::Bool => Value::Bool(n.is_multiple_of(2)),
        #[allow(clippy::cast_possible_truncation)]
        ValueType::Int => Value::Int(match bounds {
            (None, Some(max)) => (max - count).floor() as i64,
            (min, _) => (min.unwrap_or_default() + count).ceil() as i64,
        }),
        ValueType::Float => Value::Float(match bounds {
            (Some(min), Some(max)) => min + (max - min) / (count + 1.0),
            (None, Some(max)) => max - count,
            (min, None) => min.unwrap_or_default() + count,
        }),
        ValueType::Str => Value::str(&format!("other{n}")),
        ValueType::Event => return None,
        ValueType::Array(element, length) => {
            let element = some(element, bounds, n)?;
            Value::Array(vec![element; length.unwrap_or(1)])
        }
        ValueType::Record(fields) => {
            let field = |(name, ty): &(Ident, ValueType)| Some((*name, some(ty, bounds, n)?));
            Value::Record(fields.iter().map(field).collect::<Option<_>>()?)
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_value_is_followed_that_nothing_gives() {
        let of = |ty: &str, bounds: (Option<f64>, Option<f64>), given: &[Value]| {
            let ty: ValueType = ty.parse().unwrap();
            values(&ty, bounds, &given.iter().collect::<Vec<_>>(), &|value| value.fit(&ty).ok())
        };
        let no = (None, None);
        assert_eq!(of("float", (Some(0.0), Some(2.0)), &[2.0.into(), 1.into()]), [Value::Float(2.0 / 3.0)]);
        assert_eq!(of("float", (None, Some(-1.0)), &[]), [Value::Float(-1.0)]);
        assert_eq!(of("int", (Some(3.0), None), &[3.into(), 4.into()]), [Value::Int(5)]);
        assert_eq!(of("bool", no, &[true.into()]), [Value::Bool(false)]);
        assert_eq!(of("bool", no, &[true.into(), false.into(), true.into()]), [true, false].map(Value::Bool));
        assert_eq!(of("string", no, &["other0".into()]), [Value::str("other1")]);
        assert_eq!(of("float[2]", no, &[]), [Value::floats(&[0.0, 0.0])]);
        assert_eq!(of("{x: int, y: bool}", no, &[]).len(), 1);
        assert!(of("event", no, &[]).is_empty());
    }
}
