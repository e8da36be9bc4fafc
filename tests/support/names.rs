//! Names out of text, for tests.
#![allow(dead_code)] // no test binary needs all of them

use davit::model::{ComponentName, ConfigId, EventName, Ident, MemberRef};

pub fn ident(text: &str) -> Ident {
    Ident::new(text).unwrap()
}

/// Of a component.
pub fn name(text: &str) -> ComponentName {
    ComponentName::new(text).unwrap()
}

/// Of a configuration.
pub fn id(text: &str) -> ConfigId {
    ConfigId::new(text).unwrap()
}

pub fn event(text: &str) -> EventName {
    EventName::new(text).unwrap()
}

/// Of a component, `component.member`.
pub fn member(text: &str) -> MemberRef {
    MemberRef::new(text).unwrap()
}
