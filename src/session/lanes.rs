//! A bounded memory of what happened, in which what components report displaces only its own kind: a monitor that chatters
//! does not make the session forget what was asked and answered.

use std::collections::VecDeque;

/// Two rings with one count. The oldest of a full ring goes.
#[derive(Debug)]
pub struct Lanes<T> {
    own: VecDeque<(u64, T)>,
    reports: VecDeque<(u64, T)>,
    most: usize,
    most_reports: usize,
    count: u64,
    /// The newest that was displaced.
    displaced: Option<(u64, T)>,
}

impl<T> Lanes<T> {
    /// An empty one with room for `most` things, and beside them for `most_reports` reports of components.
    pub fn new(most: usize, most_reports: usize) -> Self {
        Self { own: VecDeque::new(), reports: VecDeque::new(), most, most_reports, count: 0, displaced: None }
    }

    /// Adds something; answers its number, from 1.
    pub fn push(&mut self, what: T, is_report: bool) -> u64 {
        let (lane, most) = if is_report { (&mut self.reports, self.most_reports) } else { (&mut self.own, self.most) };
        if lane.len() >= most {
            let oldest = lane.pop_front();
            if oldest.as_ref().map(|(number, _)| number) > self.displaced.as_ref().map(|(number, _)| number) {
                self.displaced = oldest;
            }
        }
        self.count += 1;
        lane.push_back((self.count, what));
        self.count
    }

    /// How many things were added so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// How many were displaced, and the newest of them.
    pub fn displaced(&self) -> Option<(u64, &T)> {
        let remembered = self.own.len() + self.reports.len();
        self.displaced.as_ref().map(|(_, what)| (self.count - remembered as u64, what))
    }

    /// All that is remembered with its numbers, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = (u64, &T)> {
        let (mut own, mut reports) = (self.own.iter().peekable(), self.reports.iter().peekable());
        std::iter::from_fn(move || {
            let first = match (own.peek(), reports.peek()) {
                (Some((a, _)), Some((b, _))) if b < a => reports.next(),
                (Some(_), _) => own.next(),
                (None, _) => reports.next(),
            };
            first.map(|(number, what)| (*number, what))
        })
    }

    /// The newest `last`, oldest first.
    pub fn newest(&self, last: usize) -> impl Iterator<Item = &T> {
        let all = self.own.len() + self.reports.len();
        self.iter().skip(all.saturating_sub(last)).map(|(_, what)| what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_displaces_its_own_and_the_order_is_kept() {
        let mut lanes = Lanes::new(3, 2);
        for i in 1..=10 {
            assert_eq!(lanes.push(i, i % 2 == 0), i);
        }
        let all: Vec<u64> = lanes.iter().map(|(number, what)| (*what == number).then_some(number).unwrap()).collect();
        assert_eq!(all, [5, 7, 8, 9, 10]);
        assert_eq!(lanes.newest(2).copied().collect::<Vec<_>>(), [9, 10]);
        assert_eq!(lanes.count(), 10);
        assert_eq!(lanes.displaced(), Some((5, &6)), "the newest of five");
        assert_eq!(Lanes::<u8>::new(1, 1).displaced(), None);
    }
}
