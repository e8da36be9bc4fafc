//! A queue whose memory is taken once.

use std::collections::VecDeque;
use std::ops::{Deref, DerefMut};

/// A queue of at most so many elements. A copy has taken its memory too, so that one made of a template at run time
/// allocates nothing afterwards.
#[derive(Debug, PartialEq)]
pub struct RingBuffer<T> {
    queue: VecDeque<T>,
    most: usize,
}

impl<T> RingBuffer<T> {
    /// An empty one, with the memory for `most` elements.
    pub fn new(most: usize) -> Self {
        Self { queue: VecDeque::with_capacity(most), most }
    }
}

impl<T: Copy> RingBuffer<T> {
    /// Makes room by joining neighbours, old to new, as long as `joined` answers what the two become; answers how many
    /// were joined. If none could be, the two oldest are, by `forced`.
    ///
    /// Called when it is full. What joins is to be such that half of the room is free afterwards; then an element still
    /// costs the same on average.
    pub fn join(&mut self, joined: impl Fn(T, T) -> Option<T>, forced: impl Fn(T, T) -> T) -> usize {
        let before = self.queue.len();
        let mut kept = 0;
        for i in 1..before {
            if let Some(one) = joined(self.queue[kept], self.queue[i]) {
                self.queue[kept] = one;
            } else {
                kept += 1;
                self.queue[kept] = self.queue[i];
            }
        }
        self.queue.truncate(kept + 1);
        if self.queue.len() == before
            && let (Some(first), Some(second)) = (self.queue.pop_front(), self.queue.pop_front())
        {
            self.queue.push_front(forced(first, second));
        }
        before - self.queue.len()
    }
}

/// How far apart neighbours may lie that are joined, in a queue of `most` that spans `window`. Groups no wider than this,
/// any two neighbours of which are wider together, are half of `most` at the most.
pub fn grain(window: u64, most: usize) -> u64 {
    let most = u64::try_from(most).unwrap_or(u64::MAX).max(1);
    (window / most).saturating_add(1).saturating_mul(4)
}

impl<T: Clone> Clone for RingBuffer<T> {
    fn clone(&self) -> Self {
        let mut copy = Self::new(self.most);
        copy.queue.extend(self.queue.iter().cloned());
        copy
    }
}

impl<T> Deref for RingBuffer<T> {
    type Target = VecDeque<T>;
    fn deref(&self) -> &VecDeque<T> {
        &self.queue
    }
}

impl<T> DerefMut for RingBuffer<T> {
    fn deref_mut(&mut self) -> &mut VecDeque<T> {
        &mut self.queue
    }
}
