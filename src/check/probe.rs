//! What is left out because it makes too many states, and whether it matters in this very deployment.
//!
//! Events from outside come when all have heard what came before, and an operator has one frame in force. Where nothing is
//! wrong and that is easy all is followed once more without that. What would be judged otherwise is said to be left out, and
//! so is what could not be looked at; findings are made only of what is followed always.

use super::bound::Bound;
use super::explore::{Graph, explore};
use super::judge::Traced;
use super::product::Product;
use super::state::Failed;
use crate::limits;
use crate::model::{ConfigId, Severity};

impl Graph<'_, '_> {
    /// Notes what was left out and matters. `found` is what is said already.
    pub fn probe(&mut self, found: &Traced) {
        // Only what would be called sound needs it.
        if found.iter().any(|(finding, _)| finding.severity > Severity::Info) {
            return;
        }
        if self.product.members.len() > 1 && self.differs(|product| product.crosses = true) {
            self.cut(Bound::Across, Failed::Nothing);
        }
        self.product.crosses = false;
        let safe = |id: &ConfigId| self.product.is_safe(*id);
        let (listed, safes) =
            (self.product.operator.iter().any(|id| !safe(id)), self.product.operator.iter().any(safe));
        // One that is safe is followed alone.
        if listed && (safes || self.differs(|product| product.by_hand = 2)) {
            self.cut(Bound::Together, Failed::Nothing);
        }
        self.product.by_hand = 1;
    }

    /// Whether more is found, or it cannot be said, where the product is followed otherwise.
    fn differs(&mut self, how: impl Fn(&mut Product<'_>)) -> bool {
        if self.edges.len() > limits::CHECK_PROBED {
            return true;
        }
        let less = self.product.effort.at_most(limits::CHECK_PROBE);
        let effort = std::mem::replace(&mut self.product.effort, less);
        how(self.product);
        let mut probe = explore(self.product);
        // Other bounds leave out what has little to do with it.
        let ends = [Bound::Inbox, Bound::Forks];
        let more = probe.is_cut_off() && !self.reached.is_cut_off()
            || ends.iter().any(|bound| probe.bounds.contains_key(bound) && !self.reached.bounds.contains_key(bound));
        let differs = more || probe.judge().iter().any(|(finding, _)| finding.severity > Severity::Info);
        self.product.effort = effort;
        differs
    }
}
