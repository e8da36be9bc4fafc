//! Properties: parameters of a component, which the configurator may set while the component runs.

use super::latest::{Reader, Writer, latest};
use super::value::PortValue;
use crate::model::Value;

/// A property. Its value may change between two calls of [`Prop::get`], also within one update: read it once.
pub struct Prop<T>(Reader<T>);

impl<T: PortValue> Prop<T> {
    pub(crate) fn new(value: T) -> (Self, Box<dyn PropEnd>) {
        let (writer, reader) = latest(value);
        (Self(reader), Box::new(writer))
    }

    /// The value of a property of nobody.
    pub(crate) fn loose(value: T) -> Self {
        Self(latest(value).1)
    }

    /// The value now.
    #[inline]
    pub fn get(&mut self) -> T {
        self.get_ref().clone()
    }

    /// The value now, without copying it.
    #[inline]
    pub fn get_ref(&mut self) -> &T {
        self.0.update();
        self.0.value()
    }

    /// Whether it was set since it was read last (and it counts as read).
    pub fn changed(&mut self) -> bool {
        self.0.update()
    }
}

/// A property as the configurator sees it.
pub trait PropEnd: Send {
    /// Sets it; false when the value does not fit the Rust type.
    fn set(&mut self, value: &Value) -> bool;
}

impl<T: PortValue> PropEnd for Writer<T> {
    fn set(&mut self, value: &Value) -> bool {
        match T::from_value(value) {
            Some(value) => {
                self.write(|slot| *slot = value);
                true
            }
            None => false,
        }
    }
}
