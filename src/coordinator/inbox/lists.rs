//! Several lists of waiting events in one piece of memory, in the order in which they came. Anything is put in, taken out or
//! moved at once, wherever it stands, and nothing is allocated as long as there is room.

use super::Incoming;

/// Which list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum List {
    Urgent,
    Words,
    Reports,
    Outside,
}

impl List {
    pub const ALL: [Self; 4] = [Self::Urgent, Self::Words, Self::Reports, Self::Outside];

    /// The other one of the two lower classes.
    pub fn other_low(self) -> Self {
        if self == Self::Reports { Self::Outside } else { Self::Reports }
    }
}

const NONE: u32 = u32::MAX;

#[derive(Debug)]
struct ListNode {
    incoming: Incoming,
    /// As the how-manieth it came.
    came: u64,
    list: List,
    before: u32,
    /// The next of its list, or of those that are free.
    after: u32,
}

#[derive(Debug, Clone, Copy)]
struct ListEnds {
    first: u32,
    last: u32,
    len: usize,
}

const EMPTY: ListEnds = ListEnds { first: NONE, last: NONE, len: 0 };

#[derive(Debug)]
pub(super) struct Lists {
    nodes: Vec<ListNode>,
    free: u32,
    ends: [ListEnds; List::ALL.len()],
    came: u64,
}

impl Lists {
    /// Empty ones, with room for so many events at first.
    pub fn with_room(room: usize) -> Self {
        Self { nodes: Vec::with_capacity(room), free: NONE, ends: [EMPTY; List::ALL.len()], came: 0 }
    }

    pub fn len(&self, list: List) -> usize {
        self.ends[list as usize].len
    }

    pub fn is_empty(&self, list: List) -> bool {
        self.len(list) == 0
    }

    /// As the how-manieth its first one came.
    pub fn came(&self, list: List) -> Option<u64> {
        self.nodes.get(self.ends[list as usize].first as usize).map(|node| node.came)
    }

    pub fn at_mut(&mut self, at: u32) -> &mut Incoming {
        &mut self.nodes[at as usize].incoming
    }

    /// Those of a list in its order, and where they stand.
    pub fn iter(&self, list: List) -> impl Iterator<Item = (u32, &Incoming)> {
        let mut at = self.ends[list as usize].first;
        std::iter::from_fn(move || {
            let node = self.nodes.get(at as usize)?;
            Some((std::mem::replace(&mut at, node.after), &node.incoming))
        })
    }

    /// Does something with each of a list, in its order.
    pub fn for_each_mut(&mut self, list: List, mut each: impl FnMut(&mut Incoming)) {
        let mut at = self.ends[list as usize].first;
        while let Some(node) = self.nodes.get_mut(at as usize).filter(|_| at != NONE) {
            each(&mut node.incoming);
            at = node.after;
        }
    }

    /// Puts an event at the end of a list; answers its place, until it is taken out.
    pub fn push(&mut self, list: List, incoming: Incoming) -> u32 {
        let ends = &mut self.ends[list as usize];
        let node = ListNode { incoming, came: self.came, list, before: ends.last, after: NONE };
        self.came += 1;
        let at = if self.free == NONE {
            self.nodes.push(node);
            // Events are bounded far below that.
            u32::try_from(self.nodes.len() - 1).unwrap_or(NONE)
        } else {
            let at = self.free;
            self.free = std::mem::replace(&mut self.nodes[at as usize], node).after;
            at
        };
        match ends.last {
            NONE => ends.first = at,
            last => self.nodes[last as usize].after = at,
        }
        ends.last = at;
        ends.len += 1;
        at
    }

    /// Takes an event out from where it stands.
    pub fn remove(&mut self, at: u32) -> Incoming {
        let ListNode { incoming, list, before, after, .. } = self.nodes[at as usize];
        let ends = &mut self.ends[list as usize];
        match before {
            NONE => ends.first = after,
            before => self.nodes[before as usize].after = after,
        }
        match after {
            NONE => ends.last = before,
            after => self.nodes[after as usize].before = before,
        }
        ends.len -= 1;
        self.nodes[at as usize].after = self.free;
        self.free = at;
        incoming
    }

    /// Takes the first one of a list out; answers also where it stood.
    pub fn pop(&mut self, list: List) -> Option<(u32, Incoming)> {
        let first = self.ends[list as usize].first;
        (first != NONE).then(|| (first, self.remove(first)))
    }

    pub fn clear(&mut self) {
        self.nodes.clear();
        self.free = NONE;
        self.ends = [EMPTY; List::ALL.len()];
    }
}
