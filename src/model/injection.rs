//! What can be made to go wrong in a component, as the world would do it: declared by its type, or the same in every component
//! whose code runs here.

use super::component_type::{ComponentType, fit_within};
use super::finding::did_you_mean;
use super::names::Ident;
use super::value::{Value, ValueType};
use serde::Serialize;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// Something that a type declares to be injected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InjectionType {
    /// Its parameters, in the order in which the component takes them.
    pub parameters: Vec<InjectionParameter>,
    /// What happens.
    pub doc: String,
}

/// A parameter of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InjectionParameter {
    /// Its name.
    pub name: Ident,
    /// Its type.
    #[serde(rename = "type")]
    pub ty: ValueType,
    /// Its value where none is given; without one it must be given.
    pub default: Option<Value>,
    /// Smallest value allowed, of every number in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value allowed, of every number in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// The unit, if it states one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<Arc<str>>,
}

/// What happens to one component.
#[derive(Debug, Clone, PartialEq)]
pub enum Injection {
    /// What its type declares, with a value of each parameter.
    Declared {
        /// Which.
        name: Ident,
        /// The values, in the order of the parameters.
        values: Vec<Value>,
        /// Those of them that were not left out, by name: so it is told.
        given: Vec<(Ident, Value)>,
    },
    /// Its code does not return any more; with an operation, from the next call of that one on.
    Hang {
        /// The operation.
        operation: Option<Ident>,
    },
    /// Its code panics.
    Panic,
    /// Its code takes so long once; with an operation, the next call of that one takes so long more.
    Stall {
        /// How long.
        time: Duration,
        /// The operation.
        operation: Option<Ident>,
    },
}

/// Those that every component knows whose code runs in this process: name, parameters as people write them, what happens.
pub const GENERIC_INJECTIONS: [(&str, &str, &str); 3] = [
    (
        "hang",
        "operation: string = \"\"",
        "its code does not return any more, or does not from the next call of that operation on",
    ),
    ("panic", "", "its code panics, which leaves it faulted"),
    (
        "stall",
        "seconds: float, operation: string = \"\"",
        "its code takes that long once, and its activity waits for it; or the next call of that operation takes so long more",
    ),
];

/// The longest stall, in s: longer than any deadline of a story.
const LONGEST_STALL: f64 = 3600.0;

/// Why something cannot be injected: one sentence, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}: {help}")]
pub struct NoInjection {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

fn no<T>(message: String, help: impl Into<String>) -> Result<T, NoInjection> {
    Err(NoInjection { message, help: help.into() })
}

impl Injection {
    /// What `name` means to a component of a type, with the values that are given by name.
    ///
    /// # Errors
    /// When there is none of that name, or the values are not those of its parameters.
    pub fn of(ty: &ComponentType, name: &str, given: &[(String, Value)]) -> Result<Self, NoInjection> {
        let parameter = |name: &str, ty, default| InjectionParameter {
            name: Ident::new(name).expect("a parameter's name"),
            ty,
            default,
            min: None,
            max: None,
            unit: None,
        };
        match name {
            "panic" => fit(name, &[], given).map(|_| Self::Panic),
            "hang" => {
                let values = fit(name, &[parameter("operation", ValueType::Str, Some(Value::str("")))], given)?;
                Ok(Self::Hang { operation: operation(ty, values.first())? })
            }
            "stall" => {
                let seconds = parameter("seconds", ValueType::Float, None);
                let values =
                    fit(name, &[seconds, parameter("operation", ValueType::Str, Some(Value::str("")))], given)?;
                let operation = operation(ty, values.get(1))?;
                let seconds = values.first().and_then(Value::as_f64).unwrap_or_default();
                if !(seconds > 0.0 && seconds <= LONGEST_STALL) {
                    return no(format!("a stall of {seconds} s"), format!("more than 0 and at most {LONGEST_STALL}"));
                }
                Ok(Self::Stall { time: Duration::from_secs_f64(seconds), operation })
            }
            _ => match ty.injections.iter().find(|(known, _)| known.as_str() == name) {
                Some((known, declared)) => {
                    let values = fit(name, &declared.parameters, given)?;
                    // In the order of the parameters: a table of Lua has none.
                    let told = declared.parameters.iter().zip(&values);
                    let told =
                        told.filter(|(parameter, _)| given.iter().any(|(name, _)| parameter.name.as_str() == name));
                    let given = told.map(|(parameter, value)| (parameter.name, value.clone())).collect();
                    Ok(Self::Declared { name: *known, values, given })
                }
                None => {
                    let declared = ty.injections.keys().map(Ident::as_str);
                    let known = declared.chain(GENERIC_INJECTIONS.map(|(name, ..)| name));
                    let help = did_you_mean(name, "injections", known);
                    no(format!("nothing called `{name}` can be injected into {}", ty.name), help)
                }
            },
        }
    }
}

/// The operation that is meant by its name; the empty one means none.
fn operation(ty: &ComponentType, name: Option<&Value>) -> Result<Option<Ident>, NoInjection> {
    let Some(Value::Str(text)) = name.filter(|text| **text != Value::str("")) else { return Ok(None) };
    match ty.operations.keys().find(|known| known.as_str() == &**text) {
        Some(operation) => Ok(Some(*operation)),
        None => {
            let known = ty.operations.keys().map(Ident::as_str);
            no(format!("{} has no operation `{text}`", ty.name), did_you_mean(text, "operations", known))
        }
    }
}

/// The given values in the order of the parameters, each of its type.
fn fit(name: &str, parameters: &[InjectionParameter], given: &[(String, Value)]) -> Result<Vec<Value>, NoInjection> {
    if let Some((unknown, _)) = given.iter().find(|(given, _)| parameters.iter().all(|p| p.name.as_str() != given)) {
        let known = parameters.iter().map(|p| p.name.as_str());
        return no(format!("`{name}` has no parameter `{unknown}`"), did_you_mean(unknown, "parameters", known));
    }
    let one = |parameter: &InjectionParameter| {
        let value = given.iter().find(|(given, _)| parameter.name.as_str() == given).map(|(_, value)| value.clone());
        let (name_of, ty) = (parameter.name, &parameter.ty);
        match (value, &parameter.default) {
            (Some(value), _) => match fit_within(value, ty, parameter.min, parameter.max) {
                Ok(value) => Ok(value),
                Err(why) => no(format!("`{name_of}` of `{name}`: {why}"), why.advice(ty)),
            },
            (None, Some(default)) => Ok(default.clone()),
            (None, None) => no(format!("`{name}` needs `{name_of}`"), format!("give it: {{ {name_of} = … }}, a {ty}")),
        }
    };
    parameters.iter().map(one).collect()
}

/// As it is told: `overcurrent {joint = 2}`.
impl fmt::Display for Injection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Declared { name, given, .. } => {
                let one = |(name, value): &(Ident, Value)| format!("{name} = {value}");
                match given.is_empty() {
                    true => write!(f, "{name}"),
                    false => write!(f, "{name} {{{}}}", given.iter().map(one).collect::<Vec<_>>().join(", ")),
                }
            }
            Self::Hang { operation: None } => f.write_str("hang"),
            Self::Hang { operation: Some(operation) } => write!(f, "hang of {operation}"),
            Self::Panic => f.write_str("panic"),
            Self::Stall { time, operation: None } => write!(f, "stall of {} s", time.as_secs_f64()),
            Self::Stall { time, operation: Some(operation) } => {
                write!(f, "stall of {operation} by {} s", time.as_secs_f64())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_says_what_would() {
        let mut ty = ComponentType::new("Drive", "");
        let joint = InjectionParameter {
            name: Ident::new("joint").unwrap(),
            ty: ValueType::Int,
            default: Some(Value::Int(0)),
            min: Some(0.0),
            max: Some(5.0),
            unit: None,
        };
        let declared = InjectionType { parameters: vec![joint], doc: String::new() };
        ty.injections.insert(Ident::new("overcurrent").unwrap(), declared);
        let of = |name: &str, given: &[(&str, Value)]| {
            let given: Vec<_> = given.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
            Injection::of(&ty, name, &given).map(|it| it.to_string()).map_err(|why| why.to_string())
        };
        assert_eq!(of("overcurrent", &[]), Ok("overcurrent".to_owned()));
        assert_eq!(of("overcurrent", &[("joint", Value::Int(3))]), Ok("overcurrent {joint = 3}".to_owned()));
        assert_eq!(of("stall", &[("seconds", Value::Int(1))]), Ok("stall of 1 s".to_owned()));
        for (name, given, says) in [
            ("overcurent", vec![], "can be injected into Drive: did you mean `overcurrent`?"),
            ("panik", vec![], "did you mean `panic`?"),
            ("overcurrent", vec![("jiont", Value::Int(1))], "has no parameter `jiont`: did you mean `joint`?"),
            ("overcurrent", vec![("joint", Value::str("a"))], "`joint` of `overcurrent`: expected int"),
            ("overcurrent", vec![("joint", Value::Int(6))], "6 is outside 0 … 5: give a value from 0 to 5"),
            ("stall", vec![], "`stall` needs `seconds`"),
            ("stall", vec![("seconds", Value::Float(-1.0))], "a stall of -1 s"),
            ("hang", vec![("operation", Value::str("fold"))], "Drive has no operation `fold`"),
            (
                "stall",
                vec![("seconds", Value::Int(1)), ("operation", Value::str("fold"))],
                "Drive has no operation `fold`",
            ),
        ] {
            let said = of(name, &given).unwrap_err();
            assert!(said.contains(says), "{name}: {said}");
        }
    }
}
