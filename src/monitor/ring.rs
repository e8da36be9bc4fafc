//! A queue whose memory is taken once.

use std::collections::VecDeque;
use std::ops::{Deref, DerefMut};

/// A queue of at most so many elements. A copy has taken its memory too, so that one made of a template at run time
/// allocates nothing afterwards.
#[derive(Debug)]
pub struct Ring<T> {
    queue: VecDeque<T>,
    most: usize,
}

impl<T> Ring<T> {
    /// An empty one, with the memory for `most` elements.
    pub fn new(most: usize) -> Self {
        Self { queue: VecDeque::with_capacity(most), most }
    }
}

impl<T: Clone> Clone for Ring<T> {
    fn clone(&self) -> Self {
        let mut copy = Self::new(self.most);
        copy.queue.extend(self.queue.iter().cloned());
        copy
    }
}

impl<T> Deref for Ring<T> {
    type Target = VecDeque<T>;
    fn deref(&self) -> &VecDeque<T> {
        &self.queue
    }
}

impl<T> DerefMut for Ring<T> {
    fn deref_mut(&mut self) -> &mut VecDeque<T> {
        &mut self.queue
    }
}
