//! Values that are kept once each, and known by a number: two of them are compared and hashed in no time.

use std::borrow::Borrow;
use std::cell::RefCell;
use std::hash::{Hash, Hasher};
use std::ops::Deref;
use std::rc::Rc;

use rustc_hash::FxHashSet;

/// A value of a [`KeptValues`], which has it once.
#[derive(Debug)]
pub struct KeptValue<T>(Rc<Numbered<T>>);

#[derive(Debug)]
struct Numbered<T> {
    number: u32,
    value: T,
}

impl<T> Clone for KeptValue<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T> Deref for KeptValue<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.value
    }
}

impl<T> PartialEq for KeptValue<T> {
    fn eq(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.0, &other.0)
    }
}

impl<T> Eq for KeptValue<T> {}

impl<T> Hash for KeptValue<T> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.0.number.hash(hasher);
    }
}

/// One of them by what it is.
#[derive(Debug)]
struct ByValue<T>(KeptValue<T>);

impl<T> Borrow<T> for ByValue<T> {
    fn borrow(&self) -> &T {
        &self.0
    }
}

impl<T: PartialEq> PartialEq for ByValue<T> {
    fn eq(&self, other: &Self) -> bool {
        *self.0 == *other.0
    }
}

impl<T: Eq> Eq for ByValue<T> {}

impl<T: Hash> Hash for ByValue<T> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (*self.0).hash(hasher);
    }
}

/// All values of one kind that were met.
#[derive(Debug)]
pub struct KeptValues<T>(RefCell<FxHashSet<ByValue<T>>>);

impl<T> Default for KeptValues<T> {
    fn default() -> Self {
        Self(RefCell::default())
    }
}

impl<T: Eq + Hash + Clone> KeptValues<T> {
    /// The one that is the same.
    pub fn keep(&self, value: T) -> KeptValue<T> {
        let mut all = self.0.borrow_mut();
        if let Some(ByValue(known)) = all.get(&value) {
            return known.clone();
        }
        let number = u32::try_from(all.len()).unwrap_or(u32::MAX);
        // What has grown has more room than it needs; a copy has not.
        let kept = KeptValue(Rc::new(Numbered { number, value: value.clone() }));
        all.insert(ByValue(kept.clone()));
        kept
    }
}
