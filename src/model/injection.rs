//! What can be made to go wrong in a component, as the world would do it: declared by its type, or the same in every component
//! whose code runs here.

use super::component_type::ComponentType;
use super::finding::did_you_mean;
use super::names::Ident;
use super::value::{Value, ValueType};
use serde::Serialize;
use std::fmt;
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
    },
    /// Its code does not return any more; with an operation, from the next call of that one on.
    Hang {
        /// The operation.
        operation: Option<Ident>,
    },
    /// Its code panics.
    Panic,
    /// Its code takes so long once.
    Stall {
        /// How long.
        time: Duration,
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
    ("stall", "seconds: float", "its code takes that long once, and its activity waits for it"),
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
        };
        match name {
            "panic" => fit(name, &[], given).map(|_| Self::Panic),
            "hang" => {
                let values = fit(name, &[parameter("operation", ValueType::Str, Some(Value::str("")))], given)?;
                let Some(Value::Str(text)) = values.first().filter(|text| **text != Value::str("")) else {
                    return Ok(Self::Hang { operation: None });
                };
                let operation = ty.operations.keys().find(|known| known.as_str() == &**text);
                match operation {
                    Some(operation) => Ok(Self::Hang { operation: Some(*operation) }),
                    None => {
                        let known = ty.operations.keys().map(Ident::as_str);
                        no(format!("{} has no operation `{text}`", ty.name), did_you_mean(text, "operations", known))
                    }
                }
            }
            "stall" => {
                let values = fit(name, &[parameter("seconds", ValueType::Float, None)], given)?;
                let seconds = values.first().and_then(Value::as_f64).unwrap_or_default();
                if !(seconds > 0.0 && seconds <= LONGEST_STALL) {
                    return no(format!("a stall of {seconds} s"), format!("more than 0 and at most {LONGEST_STALL}"));
                }
                Ok(Self::Stall { time: Duration::from_secs_f64(seconds) })
            }
            _ => match ty.injections.iter().find(|(known, _)| known.as_str() == name) {
                Some((known, declared)) => {
                    Ok(Self::Declared { name: *known, values: fit(name, &declared.parameters, given)? })
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
            (Some(value), _) => match value.fit(ty) {
                Ok(value) => Ok(value),
                Err(why) => no(format!("`{name_of}` of `{name}`: {why}"), format!("give a value of the type {ty}")),
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
            Self::Declared { name, values } => {
                write!(f, "{name}")?;
                values.iter().try_for_each(|value| write!(f, " {value}"))
            }
            Self::Hang { operation: None } => f.write_str("hang"),
            Self::Hang { operation: Some(operation) } => write!(f, "hang of {operation}"),
            Self::Panic => f.write_str("panic"),
            Self::Stall { time } => write!(f, "stall of {} s", time.as_secs_f64()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_says_what_would() {
        let mut ty = ComponentType::new("Drive", "");
        let joint =
            InjectionParameter { name: Ident::new("joint").unwrap(), ty: ValueType::Int, default: Some(Value::Int(1)) };
        let declared = InjectionType { parameters: vec![joint], doc: String::new() };
        ty.injections.insert(Ident::new("overcurrent").unwrap(), declared);
        let of = |name: &str, given: &[(&str, Value)]| {
            let given: Vec<_> = given.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
            Injection::of(&ty, name, &given).map(|it| it.to_string()).map_err(|why| why.to_string())
        };
        assert_eq!(of("overcurrent", &[]), Ok("overcurrent 1".to_owned()));
        assert_eq!(of("overcurrent", &[("joint", Value::Int(3))]), Ok("overcurrent 3".to_owned()));
        assert_eq!(of("stall", &[("seconds", Value::Int(1))]), Ok("stall of 1 s".to_owned()));
        for (name, given, says) in [
            ("overcurent", vec![], "can be injected into Drive: did you mean `overcurrent`?"),
            ("panik", vec![], "did you mean `panic`?"),
            ("overcurrent", vec![("jiont", Value::Int(1))], "has no parameter `jiont`: did you mean `joint`?"),
            ("overcurrent", vec![("joint", Value::str("a"))], "`joint` of `overcurrent`: expected int"),
            ("stall", vec![], "`stall` needs `seconds`"),
            ("stall", vec![("seconds", Value::Float(-1.0))], "a stall of -1 s"),
            ("hang", vec![("operation", Value::str("fold"))], "Drive has no operation `fold`"),
        ] {
            let said = of(name, &given).unwrap_err();
            assert!(said.contains(says), "{name}: {said}");
        }
    }
}
