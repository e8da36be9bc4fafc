//! When two systems, or two frames, are the same to whoever may ask for something.

use crate::model::Value;
use crate::stack::{Frame, FrameId, Inverse, components, shares};
use crate::system::{System, View};
use rustc_hash::{FxHashMap, FxHasher};
use smallvec::SmallVec;
use std::hash::{Hash, Hasher};
use std::sync::{Arc, Weak};

/// The number of what a frame contains, whatever its own number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct FrameNumber(u32);

impl FrameNumber {
    #[cfg(test)]
    pub(super) fn of(number: u32) -> Self {
        Self(number)
    }

    /// As a place in a list.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The frames that were met, by what they contain.
#[derive(Default)]
pub struct FrameBook {
    frames: Vec<Arc<Frame>>,
    index: FxHashMap<u64, SmallVec<[u32; 1]>>,
    shares: FxHashMap<(u32, u32), bool>,
    meets: FxHashMap<(u32, u32), bool>,
    /// Those of which worlds are made, each once.
    kept: FxHashMap<(FrameNumber, FrameId), Arc<Frame>>,
    /// By address, which is not used again as long as it is known here. What a frame contains goes with the last world that has it.
    known: FxHashMap<usize, KnownFrame>,
    /// With so many of them, those that are gone are forgotten.
    forgets_at: usize,
}

/// What is known of a frame at an address.
struct KnownFrame {
    number: FrameNumber,
    frame: Weak<Frame>,
    /// It is one of those of which worlds are made.
    kept: bool,
}

fn address(frame: &Arc<Frame>) -> usize {
    Arc::as_ptr(frame) as usize
}

impl FrameBook {
    /// The number of what a frame contains.
    pub fn number(&mut self, frame: &Arc<Frame>) -> FrameNumber {
        if let Some(known) = self.known.get(&address(frame)) {
            return known.number;
        }
        let mut hasher = FxHasher::default();
        hash_frame(frame, &mut hasher);
        let bucket = self.index.entry(hasher.finish()).or_default();
        let number = match bucket.iter().find(|at| same_frame(&self.frames[**at as usize], frame)) {
            Some(at) => *at,
            None => {
                let next = u32::try_from(self.frames.len()).unwrap_or(u32::MAX);
                self.frames.push(frame.clone());
                bucket.push(next);
                next
            }
        };
        if self.known.len() >= self.forgets_at {
            self.known.retain(|_, known| known.frame.strong_count() > 0);
            self.forgets_at = (2 * self.known.len()).max(1024);
        }
        let number = FrameNumber(number);
        self.known.insert(address(frame), KnownFrame { number, frame: Arc::downgrade(frame), kept: false });
        number
    }

    /// The frame of that number that contains the same, as it was first kept; none: it is that one. All that contain the same share it.
    pub fn keep(&mut self, frame: &Arc<Frame>) -> Option<Arc<Frame>> {
        let number = self.number(frame);
        let Self { kept, frames, known, .. } = self;
        if known.get(&address(frame)).is_some_and(|of| of.kept) {
            return None;
        }
        let make = || {
            let first = &frames[number.0 as usize];
            if Arc::ptr_eq(first, frame) {
                return frame.clone();
            }
            Arc::new(Frame { id: frame.id, at: frame.at, ..(**first).clone() })
        };
        let same = kept.entry((number, frame.id)).or_insert_with(make);
        known.insert(address(same), KnownFrame { number, frame: Arc::downgrade(same), kept: true });
        (!Arc::ptr_eq(same, frame)).then(|| same.clone())
    }

    /// Whether a frame above another one may keep that from being undone, take over from it or keep what it has called: not where they
    /// are about different components and want nothing of the same name for themselves.
    pub fn meet(&mut self, (a, x): (&Frame, FrameNumber), (above, y): (&Frame, FrameNumber)) -> bool {
        let meets = || {
            let over = || a.saved.iter().any(|own| above.saved.iter().any(|other| other.slot == own.slot));
            let apart = || components(&a.footprint).is_disjoint(&components(&above.footprint));
            above.safe || a.floor.is_some() || over() || !apart() || shares(a, above)
        };
        *self.meets.entry((x.0, y.0)).or_insert_with(meets)
    }

    /// Whether two frames share anything.
    pub fn share(&mut self, (a, x): (&Frame, FrameNumber), (b, y): (&Frame, FrameNumber)) -> bool {
        let (FrameNumber(x), FrameNumber(y)) = (x, y);
        let key = (x.min(y), x.max(y));
        if let Some(known) = self.shares.get(&key) {
            return *known;
        }
        let shared = shares(a, b) || shares(b, a);
        self.shares.insert(key, shared);
        shared
    }
}

fn hash_frame(frame: &Frame, hasher: &mut impl Hasher) {
    (frame.configuration, frame.requester, frame.scope, frame.left, frame.partial, frame.safe).hash(hasher);
    frame.parts.len().hash(hasher);
    frame.steps().len().hash(hasher);
    for saved in &frame.saved {
        saved.slot.hash(hasher);
    }
}

/// Whether two frames differ in nothing but their number, age and memory.
fn same_frame(a: &Frame, b: &Frame) -> bool {
    a.is_like(b)
        && same_inverse(&a.inverse, &b.inverse)
        && (Arc::ptr_eq(&a.footprint, &b.footprint) || a.footprint == b.footprint)
}

/// What is shared is the same without looking.
fn same_inverse(a: &Inverse, b: &Inverse) -> bool {
    let shared = match (a, b) {
        (Inverse::Steps(a), Inverse::Steps(b)) => Arc::ptr_eq(a, b),
        (Inverse::List(a), Inverse::List(b)) => Arc::ptr_eq(a, b),
        _ => false,
    };
    shared || a == b
}

fn hash_value(value: &Value, hasher: &mut impl Hasher) {
    match value {
        Value::Bool(v) => v.hash(hasher),
        Value::Int(v) => v.hash(hasher),
        // Both zeros are one.
        Value::Float(v) => (if *v == 0.0 { 0 } else { v.to_bits() }).hash(hasher),
        Value::Str(v) => v.hash(hasher),
        Value::Array(v) => v.iter().for_each(|v| hash_value(v, hasher)),
        Value::Record(v) => v.iter().for_each(|(_, v)| hash_value(v, hasher)),
    }
}

/// A hash whose sum with others tells them apart. As it is it grows by as much for one value in whatever component: all systems in which as
/// many components have it would have one sum.
fn mixed(hash: u64) -> u64 {
    let hash = (hash ^ (hash >> 32)).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    hash ^ (hash >> 29)
}

/// The same for systems that are the same, in whatever order they were built.
pub fn hash_system(system: &System, hasher: &mut impl Hasher) {
    let mut sum = 0u64;
    system.for_each_component(&mut |node| {
        let mut own = FxHasher::default();
        (node.name, node.ty.name, node.state, node.activity).hash(&mut own);
        node.properties.iter().for_each(|value| hash_value(value, &mut own));
        for (port, value) in node.written_ports() {
            port.hash(&mut own);
            hash_value(value, &mut own);
        }
        sum = sum.wrapping_add(mixed(own.finish()));
    });
    system.for_each_link(&mut |from, to, policy| {
        let mut own = FxHasher::default();
        (from, to, policy).hash(&mut own);
        sum = sum.wrapping_add(mixed(own.finish()));
    });
    sum.hash(hasher);
}

/// Whether two systems are the same to an observer.
pub fn same_system(a: &System, b: &System) -> bool {
    let mut same = a.len() == b.len();
    // What neither of them has changed since they were one is shared.
    a.for_each_component(&mut |node| {
        same = same && b.component(node.name).is_some_and(|other| std::ptr::eq(node, other) || node.same(other));
    });
    let mut links = 0usize;
    a.for_each_link(&mut |from, to, policy| {
        links += 1;
        same = same && b.link(from, to) == Some(policy);
    });
    b.for_each_link(&mut |_, _, _| links = links.wrapping_sub(1));
    same && links == 0
}
