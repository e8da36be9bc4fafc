//! What a signal of a port leads to: the way into the value that a port carries, held against its type.

use super::finding::did_you_mean;
use super::monitor::{PortSignal, ValuePart};
use super::value::ValueType;

/// Why a signal leads nowhere in what its port carries: one sentence, and what to do.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct NoSuchPart {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

fn no(message: String, help: impl Into<String>) -> NoSuchPart {
    NoSuchPart { message, help: help.into() }
}

impl PortSignal {
    /// The type of what the signal leads to, in a value of the type that its port carries.
    ///
    /// # Errors
    /// Where the way leads out of the type.
    pub fn part<'t>(&self, carried: &'t ValueType) -> Result<&'t ValueType, NoSuchPart> {
        let mut ty = carried;
        for step in &self.path {
            ty = match (step, ty) {
                (ValuePart::Field(field), ValueType::Record(fields)) => {
                    fields.iter().find(|(name, _)| name == field).map(|(_, ty)| ty).ok_or_else(|| {
                        let known = fields.iter().map(|(name, _)| name.as_str());
                        let message = format!("`{}` carries {ty}, which has no field `{field}`", self.member);
                        no(message, did_you_mean(field.as_str(), "fields", known))
                    })?
                }
                (ValuePart::Index(index), ValueType::Array(element, length)) => {
                    if length.is_some_and(|length| *index >= length) {
                        let message = format!("`{}` carries {ty}, which has no element {index}", self.member);
                        return Err(no(message, "elements are counted from 0"));
                    }
                    element
                }
                (ValuePart::Field(field), _) => {
                    return Err(no(format!("`.{field}` of {ty}, which has no fields"), self.way_on(ty)));
                }
                (ValuePart::Index(index), _) => {
                    return Err(no(format!("`[{index}]` of {ty}, which has no elements"), self.way_on(ty)));
                }
            };
        }
        Ok(ty)
    }

    /// That what it leads to, which is of this type, is a number or a bool.
    ///
    /// # Errors
    /// Where it is neither.
    pub fn is_number(&self, ty: &ValueType) -> Result<(), NoSuchPart> {
        if matches!(ty, ValueType::Bool | ValueType::Int | ValueType::Float) {
            return Ok(());
        }
        Err(no(format!("`{self}` is {ty}, which is neither a number nor a bool"), self.way_on(ty)))
    }

    fn way_on(&self, ty: &ValueType) -> String {
        match ty {
            ValueType::Array(..) => format!("name an element, counted from 0: `{self}[0]`"),
            ValueType::Record(fields) => {
                let name = fields.first().map_or("x", |(name, _)| name.as_str());
                format!("name a field, such as `{self}.{name}`")
            }
            ValueType::Str | ValueType::Event => {
                "only when it comes can be watched: `age`, `sample_rate` and `silent` take any port".to_owned()
            }
            _ => format!("it carries {ty}: write `{}` alone", self.member),
        }
    }
}
