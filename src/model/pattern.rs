//! Steps by their text, as faults and reactions of the simulated platform name them.

use super::Step;
use std::fmt;

/// Steps, by how they are printed: `start`, `start Dynamics`, `property_set A.k`, `property_set A.k = 2.0`,
/// `operation_call youbot.park`. A pattern names every step whose text begins with it at a word's end; `2` and `2.0` are one
/// number.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StepPattern(String);

impl StepPattern {
    /// The pattern with that text; an empty one names every step.
    pub fn new(text: &str) -> Self {
        Self(plain(text.trim()))
    }

    /// Whether it names `step`.
    pub fn matches(&self, step: &Step) -> bool {
        // The verb alone decides nearly always; only then is the step's text made.
        if self.0.is_empty() {
            return true;
        }
        let verb = self.0.split(' ').next().unwrap_or_default();
        if verb != step.verb() {
            return false;
        }
        let text = plain(&step.to_string());
        text.strip_prefix(self.0.as_str())
            .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '/')))
    }
}

/// The text with its numbers written one way, as floats are.
fn plain(text: &str) -> String {
    let is_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '/');
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let within = plain.chars().next_back().is_some_and(is_name);
        let number = rest.find(|c: char| !(is_name(c) || matches!(c, '-' | '+'))).map_or(rest, |end| &rest[..end]);
        match number.parse::<f64>() {
            Ok(value) if !within && value.is_finite() => {
                plain.push_str(&format!("{value:?}"));
                rest = &rest[number.len()..];
            }
            _ => {
                plain.push(first);
                rest = &rest[first.len_utf8()..];
            }
        }
    }
    plain
}

impl fmt::Display for StepPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{ComponentName, MemberRef, Transition, Value};

    #[test]
    fn patterns_end_at_words() {
        let start = Step::State { component: ComponentName::new("Dyn").unwrap(), transition: Transition::Start };
        let set = Step::PropertySet { property: MemberRef::new("A.k").unwrap(), value: Value::Float(2.0) };
        for (pattern, step, fits) in [
            ("start", &start, true),
            ("start Dyn", &start, true),
            ("start Dy", &start, false),
            ("sta", &start, false),
            ("", &start, true),
            ("property_set A.k", &set, true),
            ("property_set A", &set, false),
            ("property_set A.k = 2.0", &set, true),
            ("property_set A.k = 2", &set, true),
            ("property_set A.k = 2.01", &set, false),
            ("property_set A.k = -2", &set, false),
            ("property_set A.k = 20", &set, false),
            ("start", &set, false),
        ] {
            assert_eq!(StepPattern::new(pattern).matches(step), fits, "{pattern} / {step}");
        }
    }
}
