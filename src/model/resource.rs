//! Things that a component needs for itself: a bus, a serial line, a network interface (semantics: *Steps and plans*).

use super::component_type::{ComponentType, Tunable};
use super::names::Ident;
use super::value::{Value, ValueType};
use std::fmt;
use std::sync::Arc;

/// The longest text of one, in bytes.
const LONGEST: usize = 200;

/// The name of something that a component needs for itself, with the values of properties in it: `ethercat:{ifname}`. A component
/// holds it from *configured* on until it is *unconfigured* again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resource {
    text: Arc<str>,
    parts: Vec<ResourcePart>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum ResourcePart {
    Text(Arc<str>),
    Property(Ident),
}

impl Resource {
    /// Reads a text in which `{name}` is the value of a property.
    ///
    /// # Errors
    /// In words, what is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text.trim().is_empty() {
            return Err("it is empty".to_owned());
        }
        if text.len() > LONGEST {
            return Err(format!("it is longer than {LONGEST} bytes"));
        }
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(open) = rest.find(['{', '}']) {
            let (before, after) = rest.split_at(open);
            if !before.is_empty() {
                parts.push(ResourcePart::Text(before.into()));
            }
            let name = after.strip_prefix('{').ok_or("a `}` without `{`")?;
            let (name, after) = name.split_once('}').ok_or("a `{` without `}`")?;
            let ident = Ident::new(name).map_err(|_| format!("`{{{name}}}` has no name of a property inside"))?;
            parts.push(ResourcePart::Property(ident));
            rest = after;
        }
        if !rest.is_empty() {
            parts.push(ResourcePart::Text(rest.into()));
        }
        Ok(Self { text: text.into(), parts })
    }

    /// The properties whose values stand in it.
    pub fn properties(&self) -> impl Iterator<Item = Ident> + '_ {
        self.parts.iter().filter_map(|part| match part {
            ResourcePart::Property(name) => Some(*name),
            ResourcePart::Text(_) => None,
        })
    }

    /// Its name where properties have these values; none where one has no value.
    pub fn named<'v>(&self, value: impl Fn(Ident) -> Option<&'v Value>) -> Option<String> {
        let mut name = String::new();
        for part in &self.parts {
            match part {
                ResourcePart::Text(text) => name.push_str(text),
                ResourcePart::Property(property) => match value(*property)? {
                    Value::Str(text) => name.push_str(text),
                    other => name.push_str(&other.to_string()),
                },
            }
        }
        Some(name)
    }

    /// Why a type cannot have it, in words: which thing a component holds must not change while it holds it.
    pub fn misfit(&self, ty: &ComponentType) -> Option<(Ident, String)> {
        self.properties().find_map(|name| {
            let why = match ty.properties.get(&name) {
                None => format!("{} has no property `{name}`", ty.name),
                Some(property) if property.tunable != Tunable::Unconfigured => {
                    format!("`{name}` can change while it is held: it is not `tunable: unconfigured`")
                }
                Some(property) if !matches!(property.ty, ValueType::Str | ValueType::Int | ValueType::Bool) => {
                    format!("`{name}` is of type {}, and no string, int or bool", property.ty)
                }
                Some(_) => return None,
            };
            Some((name, why))
        })
    }
}

impl fmt::Display for Resource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

super::words::sent_as_shown!(Resource);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_in_the_name() {
        let both = Resource::parse("can:{bus}/{node}").unwrap();
        let (bus, node) = (Value::Str("can0".into()), Value::Int(7));
        let value = |name: Ident| if name.as_str() == "bus" { Some(&bus) } else { Some(&node) };
        assert_eq!(both.named(value).as_deref(), Some("can:can0/7"));
        assert_eq!(both.named(|_| None), None);
        assert_eq!(Resource::parse("gpu").unwrap().named(|_| None).as_deref(), Some("gpu"));
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for text in ["", "  ", "a{", "a}", "{}", "{a b}", "{a{b}}", &"x".repeat(201)] {
            assert!(Resource::parse(text).is_err(), "{text}");
        }
    }
}
