//! The links of a port: a list that the component's thread owns and that the configurator changes while it runs.
//!
//! The configurator leaves orders (add, remove) in an inbox; the owner takes them all with one exchange before it uses the
//! list, and leaves what it no longer needs in an outbox, where the configurator picks it up. So no thread ever waits for
//! another, and the owner neither allocates nor frees: nodes are made and dropped by the configurator.
//!
//! There is one owner and, at a time, one configurator (the embedded platform's registry lock sees to it; [`LinksSender`] needs
//! `&mut`).

use super::sync::{Arc, AtomicPtr, Ordering};
use std::ptr::null_mut;

struct ChainNode<L> {
    next: Option<Box<Self>>,
    id: u64,
    /// The link to add; none: remove the one with this number.
    link: Option<L>,
}

struct Boxes<L> {
    /// Orders, oldest first. Filled by the configurator, emptied by either.
    inbox: AtomicPtr<ChainNode<L>>,
    /// What may be dropped. Filled by the owner, emptied by the configurator.
    outbox: AtomicPtr<ChainNode<L>>,
}

// SAFETY: the pointers are owned chains of boxes, handed over whole by acquire-release exchanges; whoever takes one out owns it
// alone. So links go from thread to thread, which `Send` allows, and are never shared. (Without these two the pointers alone
// would let boxes of anything travel.)
unsafe impl<L: Send> Sync for Boxes<L> {}
unsafe impl<L: Send> Send for Boxes<L> {}

fn take<L>(slot: &AtomicPtr<ChainNode<L>>) -> Option<Box<ChainNode<L>>> {
    let taken = slot.swap(null_mut(), Ordering::AcqRel);
    // SAFETY: what is not null came from `put` below and has just been taken out: it is ours alone.
    (!taken.is_null()).then(|| unsafe { Box::from_raw(taken) })
}

/// Puts a chain in an empty slot. Only one side fills a slot, and the other only empties it, so it is still empty. An exchange
/// all the same, not a store: it is as cheap on a way that is taken only when something changes, and what it finds is seen.
fn put<L>(slot: &AtomicPtr<ChainNode<L>>, chain: Option<Box<ChainNode<L>>>) {
    if let Some(chain) = chain {
        let before = slot.swap(Box::into_raw(chain), Ordering::AcqRel);
        debug_assert!(before.is_null(), "filled by one side only");
    }
}

/// Frees a chain one node at a time: the compiler's own drop would recurse.
fn free<L>(mut chain: Option<Box<ChainNode<L>>>) {
    while let Some(mut node) = chain {
        chain = node.next.take();
    }
}

impl<L> Drop for Boxes<L> {
    fn drop(&mut self) {
        free(take(&self.inbox));
        free(take(&self.outbox));
    }
}

/// The configurator's side.
pub struct LinksSender<L>(Arc<Boxes<L>>);

/// The owner's side.
pub struct Links<L> {
    boxes: Arc<Boxes<L>>,
    first: Option<Box<ChainNode<L>>>,
}

/// An empty list.
pub fn links<L>() -> (LinksSender<L>, Links<L>) {
    let boxes = Arc::new(Boxes { inbox: AtomicPtr::new(null_mut()), outbox: AtomicPtr::new(null_mut()) });
    (LinksSender(boxes.clone()), Links { boxes, first: None })
}

impl<L> LinksSender<L> {
    /// Adds a link at the end of the list.
    pub fn add(&mut self, id: u64, link: L) {
        self.order(Box::new(ChainNode { next: None, id, link: Some(link) }));
    }

    /// Removes the link of that number.
    pub fn remove(&mut self, id: u64) {
        self.order(Box::new(ChainNode { next: None, id, link: None }));
    }

    fn order(&mut self, node: Box<ChainNode<L>>) {
        free(take(&self.0.outbox));
        let mut chain = take(&self.0.inbox);
        // A link the owner has not even seen is taken back: orders of a port that nobody uses do not pile up.
        if node.link.is_none() && remove_from(&mut chain, node.id).is_some() {
            put(&self.0.inbox, chain);
            return;
        }
        append(&mut chain, node);
        put(&self.0.inbox, chain);
    }
}

fn append<L>(chain: &mut Option<Box<ChainNode<L>>>, node: Box<ChainNode<L>>) {
    let mut end = chain;
    while let Some(next) = end {
        end = &mut next.next;
    }
    *end = Some(node);
}

fn remove_from<L>(chain: &mut Option<Box<ChainNode<L>>>, id: u64) -> Option<Box<ChainNode<L>>> {
    let mut at = chain;
    while at.as_ref().is_some_and(|node| node.id != id || node.link.is_none()) {
        at = &mut at.as_mut().expect("looked at just now").next;
    }
    let mut removed = at.take()?;
    *at = removed.next.take();
    Some(removed)
}

impl<L> Links<L> {
    /// Follows the orders that have come. One load when there are none.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        if self.boxes.inbox.load(Ordering::Relaxed).is_null() {
            return false;
        }
        self.follow();
        true
    }

    #[cold]
    fn follow(&mut self) {
        let mut orders = take(&self.boxes.inbox);
        let mut waste = take(&self.boxes.outbox);
        while let Some(mut order) = orders {
            orders = order.next.take();
            if order.link.is_some() {
                append(&mut self.first, order);
            } else {
                if let Some(mut removed) = remove_from(&mut self.first, order.id) {
                    removed.next = waste;
                    waste = Some(removed);
                }
                order.next = waste;
                waste = Some(order);
            }
        }
        put(&self.boxes.outbox, waste);
    }

    /// The first link.
    #[inline]
    pub fn first_mut(&mut self) -> Option<&mut L> {
        self.first.as_mut().and_then(|node| node.link.as_mut())
    }

    /// All links, in the order in which they were added.
    #[inline]
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut L> {
        let mut next = self.first.as_deref_mut();
        std::iter::from_fn(move || {
            let node = next.take()?;
            next = node.next.as_deref_mut();
            node.link.as_mut()
        })
    }
}

impl<L> Drop for Links<L> {
    fn drop(&mut self) {
        free(self.first.take());
    }
}
