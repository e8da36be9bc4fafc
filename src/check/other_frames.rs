//! The frames of a stack that do not count, as whoever looks up or down from one that does meets them: such lists are known by numbers.

use super::equivalence::FrameNumber;
use rustc_hash::FxHashMap;
use std::rc::Rc;

/// The number of a list.
pub(super) type ListNumber = u32;

/// Nothing.
pub(super) const NOBODY: ListNumber = 0;

/// All lists that were met. Of frames that are met one after the other the next list is found by the one before: thousands of stacks
/// differ only in their newest frames.
#[derive(Default)]
pub(super) struct OtherFrames {
    with: FxHashMap<(ListNumber, FrameNumber), ListNumber>,
    /// Where neither order nor number counts: what each of them has, from the second on, and the other way round.
    sets: Vec<Rc<[FrameNumber]>>,
    of_sets: FxHashMap<Rc<[FrameNumber]>, ListNumber>,
    /// So many there are beside none.
    lists: ListNumber,
}

impl OtherFrames {
    /// A list with one more. `as_set`: in which order they were met, and how often, does not count.
    pub fn with(&mut self, list: ListNumber, one: FrameNumber, as_set: bool) -> ListNumber {
        if let Some(known) = self.with.get(&(list, one)) {
            return *known;
        }
        let more = if as_set { self.set_with(list, one) } else { self.one_more() };
        self.with.insert((list, one), more);
        more
    }

    fn one_more(&mut self) -> ListNumber {
        self.lists += 1;
        self.lists
    }

    fn set_with(&mut self, list: ListNumber, one: FrameNumber) -> ListNumber {
        let own = (list as usize).checked_sub(1).map_or(&[][..], |at| &self.sets[at]);
        let Err(at) = own.binary_search(&one) else { return list };
        let more: Rc<[FrameNumber]> = own[..at].iter().chain([&one]).chain(&own[at..]).copied().collect();
        if let Some(known) = self.of_sets.get(&more) {
            return *known;
        }
        let number = self.one_more();
        self.sets.push(more.clone());
        self.of_sets.insert(more, number);
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(lists: &mut OtherFrames, numbers: &[u32], as_set: bool) -> ListNumber {
        numbers.iter().fold(NOBODY, |list, one| lists.with(list, FrameNumber::of(*one), as_set))
    }

    #[test]
    fn sets_are_one_in_whatever_order_they_were_met() {
        let mut lists = OtherFrames::default();
        let one = of(&mut lists, &[3, 1, 2], true);
        assert_eq!(of(&mut lists, &[2, 3, 3, 1, 2], true), one);
        assert_ne!(of(&mut lists, &[3, 1], true), one);
        assert_ne!(one, NOBODY);
    }

    #[test]
    fn lists_are_one_in_one_order_only() {
        let mut lists = OtherFrames::default();
        let one = of(&mut lists, &[3, 1, 2], false);
        assert_eq!(of(&mut lists, &[3, 1, 2], false), one);
        let others = [&[1, 3, 2][..], &[3, 1], &[3, 1, 2, 2]].map(|other| of(&mut lists, other, false));
        assert!(!others.contains(&one));
    }
}
