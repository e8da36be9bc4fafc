//! A list that grows by pieces of one size: nothing is copied when it grows, and no more than one piece is kept that is not used.

use std::ops::{Index, IndexMut};

/// Of a piece.
const PIECE: usize = 1024;

/// All of such a list, in order.
pub(super) type ChunksIter<'c, T> = std::iter::Flatten<std::slice::Iter<'c, Vec<T>>>;

/// A list of very many.
#[derive(Debug)]
pub(super) struct Chunks<T> {
    pieces: Vec<Vec<T>>,
    len: usize,
}

impl<T> Default for Chunks<T> {
    fn default() -> Self {
        Self { pieces: Vec::new(), len: 0 }
    }
}

impl<T> Chunks<T> {
    /// One more, at the end.
    pub fn push(&mut self, one: T) {
        if self.len.is_multiple_of(PIECE) {
            // Where there are few, no more than those.
            let room = if self.pieces.is_empty() { 0 } else { PIECE };
            self.pieces.push(Vec::with_capacity(room));
        }
        if let Some(last) = self.pieces.last_mut() {
            last.push(one);
            self.len += 1;
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// All, in order.
    pub fn iter(&self) -> ChunksIter<'_, T> {
        self.pieces.iter().flatten()
    }
}

impl<T> Index<usize> for Chunks<T> {
    type Output = T;

    fn index(&self, at: usize) -> &T {
        &self.pieces[at / PIECE][at % PIECE]
    }
}

impl<T> IndexMut<usize> for Chunks<T> {
    fn index_mut(&mut self, at: usize) -> &mut T {
        &mut self.pieces[at / PIECE][at % PIECE]
    }
}
