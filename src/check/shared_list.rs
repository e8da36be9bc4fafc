//! What a state of the product has few of, and mostly none: a list of one pointer, shared by all states that have it of each
//! other until one changes it.
//!
//! Of a hundred thousand states most differ in one or two things from the one that they come of; with the lists themselves in it
//! a state would be a kilobyte, and copying them most of what following costs.

use smallvec::SmallVec;
use std::ops::{Deref, DerefMut};
use std::rc::Rc;

/// A list that costs nothing where it is empty, and nothing to copy.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct SharedList<T>(Option<Rc<SmallVec<[T; 1]>>>);

impl<T> SharedList<T> {
    /// None.
    pub const fn new() -> Self {
        Self(None)
    }

    /// As a slice.
    pub fn as_slice(&self) -> &[T] {
        self.0.as_ref().map_or(&[], |list| list.as_slice())
    }

    /// None is left.
    pub fn clear(&mut self) {
        self.0 = None;
    }
}

impl<T: Clone> SharedList<T> {
    /// Lets something change them. An empty list stands as none, so that equal ones are equal.
    fn change<R>(&mut self, with: impl FnOnce(&mut SmallVec<[T; 1]>) -> R) -> R {
        let list = Rc::make_mut(self.0.get_or_insert_default());
        let answer = with(list);
        if list.is_empty() {
            self.0 = None;
        }
        answer
    }

    /// One more, at the end.
    pub fn push(&mut self, one: T) {
        self.change(|list| list.push(one));
    }

    /// The one at that place becomes this one; those that are missing before it are as if nothing was said.
    pub fn set(&mut self, at: usize, one: T)
    where
        T: Default + PartialEq,
    {
        if self.get(at) != Some(&one) {
            self.change(|list| {
                if list.len() <= at {
                    list.resize(at + 1, T::default());
                }
                list[at] = one;
            });
        }
    }

    /// Takes out the one at that place.
    ///
    /// # Panics
    /// There is none.
    pub fn remove(&mut self, at: usize) -> T {
        // The list of others is not copied to be emptied.
        match (self.as_slice(), at) {
            ([one], 0) => {
                let one = one.clone();
                self.clear();
                one
            }
            _ => self.change(|list| list.remove(at)),
        }
    }

    /// Only those of which this is true. Where it is of all, or of none, nothing is copied.
    pub fn retain(&mut self, stays: impl Fn(&T) -> bool) {
        if self.iter().all(&stays) {
            return;
        }
        if self.iter().any(&stays) {
            self.change(|list| list.retain(|one| stays(one)));
        } else {
            self.clear();
        }
    }

    /// Changes those of which this is true.
    pub fn update(&mut self, of: impl Fn(&T) -> bool, with: impl Fn(&mut T)) {
        if self.iter().any(&of) {
            self.iter_mut().filter(|one| of(one)).for_each(with);
        }
    }

    /// Of the same that follow each other one stays.
    pub fn dedup(&mut self)
    where
        T: PartialEq,
    {
        if self.windows(2).any(|two| two[0] == two[1]) {
            self.change(SmallVec::dedup);
        }
    }
}

impl<T> Clone for SharedList<T> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<T> Default for SharedList<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T> Deref for SharedList<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.as_slice()
    }
}

impl<T: Clone> DerefMut for SharedList<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        match &mut self.0 {
            Some(list) => Rc::make_mut(list).as_mut_slice(),
            None => &mut [],
        }
    }
}

impl<T: Clone> Extend<T> for SharedList<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, more: I) {
        let mut more = more.into_iter().peekable();
        if more.peek().is_some() {
            self.change(|list| list.extend(more));
        }
    }
}

impl<T: Clone> FromIterator<T> for SharedList<T> {
    fn from_iter<I: IntoIterator<Item = T>>(all: I) -> Self {
        let mut list = Self::new();
        list.extend(all);
        list
    }
}

impl<'a, T> IntoIterator for &'a SharedList<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl<T: Clone> IntoIterator for SharedList<T> {
    type Item = T;
    type IntoIter = smallvec::IntoIter<[T; 1]>;

    fn into_iter(self) -> Self::IntoIter {
        self.0.map(Rc::unwrap_or_clone).unwrap_or_default().into_iter()
    }
}
