//! Any sequence of requests to a stack beside a plain record of what is in force: after every request the system is what
//! the records of the frames in force say.

use crate::generate::{self, ConfigGene, TypeGene, read};
use crate::plain::Plain;
use crate::settings;
use crate::stacks::{Both, record};
use davit::model::{Configuration, Ident, Snapshot, Step};
use davit::stack::{FrameId, Op, Requester};
use davit::time::Time;
use proptest::prelude::*;
use proptest_state_machine::{ReferenceStateMachine, StateMachineTest, prop_state_machine};

#[derive(Debug, Clone)]
pub enum Act {
    Push(ConfigGene),
    UndoTop,
    Undo(u8),
    UndoTo(u8),
    UndoAndPush(u8, ConfigGene),
    Commit,
}

/// The reference has only the types: what is in force is recorded by the subject beside the stack.
#[derive(Debug, Clone)]
pub struct Types(Vec<TypeGene>);

pub struct Machine;

impl ReferenceStateMachine for Machine {
    type State = Types;
    type Transition = Act;

    fn init_state() -> BoxedStrategy<Types> {
        generate::types().prop_map(Types).boxed()
    }

    fn transitions(_: &Types) -> BoxedStrategy<Act> {
        prop_oneof![
            8 => generate::config().prop_map(Act::Push),
            2 => Just(Act::UndoTop),
            3 => any::<u8>().prop_map(Act::Undo),
            1 => any::<u8>().prop_map(Act::UndoTo),
            3 => (any::<u8>(), generate::config()).prop_map(|(n, c)| Act::UndoAndPush(n, c)),
            1 => Just(Act::Commit),
        ]
        .boxed()
    }

    fn apply(state: Types, _: &Act) -> Types {
        state
    }
}

/// A frame as the plain side knows it.
#[derive(Debug, Clone)]
struct InForce {
    id: FrameId,
    did: Vec<Step>,
    group: Option<Ident>,
    /// Frames squashed together have one mark.
    squashed: bool,
}

pub struct Subject {
    both: Both,
    /// The system under the first frame.
    base: Snapshot,
    frames: Vec<InForce>,
}

const BOUND: usize = 4;

impl Subject {
    fn replay(&self, frames: &[InForce]) -> Snapshot {
        let mut plain = Plain::new(self.base.clone(), &self.both.types);
        for step in frames.iter().flat_map(|f| &f.did) {
            assert!(plain.try_make(step), "{step} cannot be replayed");
        }
        plain.is
    }

    fn push(id: FrameId, both: &Both, conf: &Configuration) -> InForce {
        let frame = both.stack.frame(id).expect("the newest frame is never squashed at once");
        InForce { id, did: record(conf, frame.steps(), &both.system), group: conf.group, squashed: false }
    }

    /// Drops from the record what is no longer on the stack, and marks what was squashed.
    fn settle(&mut self, popped: &[FrameId]) {
        // A squashed frame carries the number of its newest part; popping it pops all marked ones up to that.
        for id in popped {
            let Some(at) = self.frames.iter().position(|f| f.id == *id) else { continue };
            let mut from = at;
            while from > 0
                && self.frames[from].squashed
                && self.both.stack.frame(self.frames[from - 1].id).is_none()
                && self.frames[from - 1].squashed
            {
                from -= 1;
            }
            self.frames.drain(from..=at);
        }
        for frame in &mut self.frames {
            frame.squashed |= self.both.stack.frame(frame.id).is_none_or(|f| f.is_squashed());
        }
    }

    fn ask(&mut self, requests: &[Op<'_>], conf: Option<&Configuration>) {
        let before = self.both.system.snapshot();
        let Ok(transaction) = self.both.ask(requests) else {
            assert_eq!(self.both.system.snapshot(), before);
            return;
        };
        let popped: Vec<FrameId> = transaction.popped.iter().map(|f| f.id).collect();
        let mut pushed = self.both.execute(transaction);
        self.settle(&popped);
        if let (Some(id), Some(conf)) = (pushed.pop(), conf) {
            // Alternatives: at most one of a group is in force.
            assert!(conf.group.is_none() || self.frames.iter().all(|f| f.group != conf.group), "two of one group");
            let frame = Self::push(id, &self.both, conf);
            self.frames.push(frame);
        }
        self.settle(&[]);
        // Of each file: of what operators do, each has its own.
        let frames = self.both.stack.frames();
        let of = |path: &str| frames.iter().filter(|frame| frame.inside() == path).count();
        assert!(["", "s", "t"].iter().all(|path| of(path) <= BOUND));
    }
}

impl StateMachineTest for Machine {
    type SystemUnderTest = Subject;
    type Reference = Self;

    fn init_test(types: &Types) -> Subject {
        let both = Both::new(generate::catalogue(&types.0, false), BOUND);
        Subject { both, base: Snapshot::default(), frames: Vec::new() }
    }

    fn apply(mut s: Subject, _: &Types, act: Act) -> Subject {
        let push = |configuration| Op::Push { configuration, requester: Requester::Operator, at: Time(0), scope: None };
        let chosen = |s: &Subject, n: u8| {
            let frames = s.both.stack.frames();
            (!frames.is_empty()).then(|| frames[n as usize % frames.len()].id)
        };
        match act {
            Act::Push(gene) => {
                let conf = read(&gene, &s.both.system);
                s.ask(&[push(&conf)], Some(&conf));
            }
            Act::UndoTop => s.ask(&[Op::UndoTop], None),
            Act::Undo(n) => {
                if let Some(id) = chosen(&s, n) {
                    s.ask(&[Op::Undo(id)], None);
                }
            }
            Act::UndoTo(n) => {
                let to = n as usize % (BOUND + 1);
                s.ask(&[Op::UndoTo(to)], None);
                assert!(s.both.stack.len() <= to);
            }
            Act::UndoAndPush(n, gene) => {
                if let Some(id) = chosen(&s, n) {
                    let conf = read(&gene, &s.both.system);
                    s.ask(&[Op::Undo(id), push(&conf)], Some(&conf));
                }
            }
            Act::Commit => {
                s.both.stack.make_permanent(Requester::Operator);
                s.base = s.both.system.snapshot();
                s.frames.clear();
                assert!(s.both.ask(&[Op::UndoTop]).is_err());
            }
        }
        s
    }

    fn check_invariants(s: &Subject, _: &Types) {
        assert_eq!(s.both.system.snapshot(), s.replay(&s.frames));
    }

    fn teardown(mut s: Subject, _: Types) {
        s.ask(&[Op::UndoTo(0)], None);
        assert_eq!(s.both.system.snapshot(), s.base);
    }
}

prop_state_machine! {
    #![proptest_config(settings())]

    #[test]
    fn any_sequence(sequential 1..12 => Machine);
}
