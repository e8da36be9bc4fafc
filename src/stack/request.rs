//! What is asked of a configurator: requests, who makes them, and which belong together (semantics: *Requests*).

use super::Frame;
use crate::model::names::is_within;
use crate::model::words::sent_as_shown;
use crate::model::{Ask, ComponentName, ConfigId, Finding, Ident, OPERATOR, RequestId, codes};
use smallvec::SmallVec;
use std::fmt;
use std::hash::{Hash, Hasher};

/// Who asked for a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Requester {
    /// A coordinator, by the name of its deployment or the path of its subsystem.
    Coordinator(ComponentName),
    /// Somebody at a terminal or behind the control socket. All of them are one requester.
    Operator,
    /// A safety event that acts by itself, since no coordinator leads any more.
    Safety,
}

impl fmt::Display for Requester {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Coordinator(name) => write!(f, "{name}"),
            Self::Operator => f.write_str(OPERATOR),
            Self::Safety => f.write_str("a safety event"),
        }
    }
}

sent_as_shown!(Requester);

/// The number of a frame; never used again.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
pub struct FrameId(pub u64);

/// The state of a coordinator that a state-scoped request belongs to, by its number in the chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Scope(pub u32);

/// Why a request is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Why {
    /// Somebody asked for it.
    Asked,
    /// This frame of an earlier request was not confirmed in time: it is taken back.
    Unconfirmed(FrameId),
    /// The coordinator has come to its *down* state.
    Down,
}

/// Whether what is asked for may move something.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stillness {
    /// It may.
    No,
    /// It was raised in the same step as a `safe` configuration.
    WithSafe,
    /// This `safe` configuration came while it stood behind others of its batch: it is applied no more, and undone as far as nothing moves.
    Overtaken(ConfigId),
}

impl Stillness {
    /// A `safe` configuration comes.
    pub fn come(&mut self, how: Self) {
        if *self == Self::No || matches!((*self, how), (Self::WithSafe, Self::Overtaken(_))) {
            *self = how;
        }
    }
}

/// One request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// Its number, given by who asks.
    pub id: RequestId,
    /// What is asked.
    pub ask: Ask,
    /// Who asks.
    pub requester: Requester,
    /// The state of the coordinator that asks by being entered, or takes back by being left.
    pub scope: Option<Scope>,
    /// What is refused for the operator's sake is done all the same.
    pub force: bool,
    /// Whether nothing of it may move, since a `safe` configuration came with it or since.
    pub still: Stillness,
    /// An undo by leaving a state: the frame of that visit was gone when a later visit's came, and it undoes nothing. A safe
    /// configuration that a state brings with it: that was left, and the undo was not carried out.
    pub gone: bool,
    /// The connection through which an operator asks: its requests begin one after the other. 0: one that waits for no other.
    pub line: u32,
    /// Why it is there.
    pub why: Why,
    /// Comes back with the answer; means nothing to the configurator.
    pub tag: (u64, u64),
}

impl Hash for Request {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        // By what differs between those that are met.
        (self.ask, self.requester, self.scope, self.tag.0, self.still).hash(hasher);
    }
}

impl Request {
    /// What `requester` asks.
    pub fn new(id: RequestId, ask: Ask, requester: Requester) -> Self {
        Self {
            id,
            ask,
            requester,
            scope: None,
            force: false,
            still: Stillness::No,
            gone: false,
            line: 0,
            why: Why::Asked,
            tag: (0, 0),
        }
    }

    /// Whether a coordinator lets go of a frame of that configuration by this undo: by leaving the state that the frame belongs to, or by
    /// naming one that belongs to none.
    pub fn lets_go_of(&self, frame: &Frame) -> bool {
        self.lets_go() && (frame.scope, frame.requester) == (self.scope, self.requester)
    }

    fn lets_go(&self) -> bool {
        let coordinator = self.scope.is_some() || matches!(self.requester, Requester::Coordinator(_));
        self.why == Why::Asked && !self.gone && coordinator
    }

    /// An undo by which a coordinator lets go of something is not carried out, and there is no frame of it: it is of a safe configuration that
    /// is still `coming` (the oldest first), and that nobody asks for any more. Visits are left in their order, unless the
    /// `newest` is meant.
    pub fn leaves<'r>(
        &self,
        newest: bool,
        coming: impl DoubleEndedIterator<Item = &'r mut Self>,
    ) -> Option<&'r mut Self> {
        let Ask::UndoOf(id) = self.ask else { return None };
        let of =
            |r: &&'r mut Self| (r.ask, r.scope, r.requester) == (Ask::Apply(id), self.scope, self.requester) && !r.gone;
        let mut coming = coming.filter(|_| self.lets_go());
        let left = if newest { coming.rfind(of) } else { coming.find(of) }?;
        left.gone = true;
        Some(left)
    }

    /// The `safe` configuration over which it is not applied any more: that came while it stood behind others.
    pub fn is_overtaken(&self) -> Option<ConfigId> {
        match (self.ask, self.still) {
            (Ask::Apply(_), Stillness::Overtaken(by)) => Some(by),
            _ => None,
        }
    }

    /// Whether it is refused for nothing but a `safe` configuration that came while it stood behind others.
    pub fn was_overtaken(&self, refused: &[Finding]) -> bool {
        matches!(self.still, Stillness::Overtaken(_))
            && refused.iter().all(|reason| reason.code == codes::MOVES_WHILE_SAFE)
    }

    /// Whether what it is answered is for the state that asked, and for nobody once that has been left. What came of a
    /// confirmation that did not come answers nothing that was asked: the coordinator hears it in whatever state it is.
    pub fn is_asked(&self) -> bool {
        self.why == Why::Asked
    }
}

/// Requests that belong together: raised in one step of a coordinator. They are carried out undos first, then pushes, each
/// in the order they were raised, and answered in that order.
#[derive(Debug, PartialEq, Eq, Hash, Default)]
pub struct Batch {
    /// The requests.
    pub requests: SmallVec<[Request; 2]>,
}

impl Clone for Batch {
    fn clone(&self) -> Self {
        // At once: requests are plain memory.
        Self { requests: SmallVec::from_slice(&self.requests) }
    }
}

impl Batch {
    /// A batch of one.
    pub fn one(request: Request) -> Self {
        Self { requests: SmallVec::from_iter([request]) }
    }

    /// Whether it is no request, but that a coordinator has come to its *down* state.
    pub fn is_down(&self) -> bool {
        self.requests.first().is_some_and(|request| request.why == Why::Down)
    }

    /// Brings the requests into the order in which they are carried out.
    pub fn arrange(&mut self) {
        self.requests.sort_by_key(|request| !request.ask.is_undo());
    }
}

impl FromIterator<Request> for Batch {
    fn from_iter<I: IntoIterator<Item = Request>>(requests: I) -> Self {
        Self { requests: requests.into_iter().collect() }
    }
}

/// What is led down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum LedDown {
    /// The deployment.
    Whole,
    /// The subsystem of this path, by the event that ends it.
    Inside(Ident),
}

impl LedDown {
    /// Whether a coordinator is one of those that lead it down.
    pub fn is_led_by(self, requester: Requester) -> bool {
        match (self, requester) {
            (Self::Whole, _) => true,
            (Self::Inside(path), Requester::Coordinator(name)) => is_within(name.as_str(), path.as_str()),
            (Self::Inside(_), Requester::Operator | Requester::Safety) => false,
        }
    }

    /// Whether a configuration belongs to it.
    pub fn has(self, id: ConfigId) -> bool {
        match self {
            Self::Whole => true,
            Self::Inside(path) => is_within(id.prefix(), path.as_str()),
        }
    }
}
