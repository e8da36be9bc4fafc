//! Pictures of a system, each once: thousands of worlds have some hundred of them, and what steps make of one is worked out once.

use super::equivalence::{hash_system, same_system};
use crate::model::Step;
use crate::plan::PlannedStep;
use crate::system::{System, step};
use rustc_hash::{FxHashMap, FxHasher};
use smallvec::SmallVec;
use std::hash::{Hash, Hasher};

/// The number of a system.
pub type SystemId = u32;

/// All systems that were met.
#[derive(Default)]
pub struct Systems {
    all: Vec<System>,
    index: FxHashMap<u64, SmallVec<[SystemId; 1]>>,
    after: FxHashMap<(SystemId, u64), SmallVec<[(Box<[Step]>, SystemId); 1]>>,
}

impl Systems {
    /// The number of what is the same; `system` shares what is kept of it from now on.
    pub fn number(&mut self, system: &mut System) -> SystemId {
        let mut hasher = FxHasher::default();
        hash_system(system, &mut hasher);
        let same = self.index.entry(hasher.finish()).or_default();
        let known = same.iter().copied().find(|id| same_system(&self.all[*id as usize], system));
        let id = known.unwrap_or_else(|| {
            let next = SystemId::try_from(self.all.len()).unwrap_or(SystemId::MAX);
            self.all.push(system.clone());
            same.push(next);
            next
        });
        system.share_with(&self.all[id as usize]);
        id
    }

    /// Does steps in `system`, which has the number `id`: its number then.
    pub fn carry_out(&mut self, id: SystemId, system: &mut System, steps: &[PlannedStep]) -> SystemId {
        if steps.is_empty() {
            return id;
        }
        let mut hasher = FxHasher::default();
        steps.iter().for_each(|planned| (planned.step.verb(), planned.step.component()).hash(&mut hasher));
        let key = (id, hasher.finish());
        let does = |known: &[Step]| known.iter().eq(steps.iter().map(|planned| &planned.step));
        let known = self.after.get(&key).and_then(|all| all.iter().find(|(known, _)| does(known)));
        if let Some((_, after)) = known {
            system.share_with(&self.all[*after as usize]);
            return *after;
        }
        steps.iter().for_each(|planned| step::effect(&planned.step, system));
        let after = self.number(system);
        let steps = steps.iter().map(|planned| planned.step.clone()).collect();
        self.after.entry(key).or_default().push((steps, after));
        after
    }
}
